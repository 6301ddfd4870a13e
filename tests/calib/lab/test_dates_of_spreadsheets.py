"""Times of day behind dates as spreadsheets of several countries and names of files write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

N = 90
FORMS = [
    ("{d:02d}.{m:02d}.{y}. {t}", "31.03.2024. 23:59:56.000"),
    ("{y}. {m:02d}. {d:02d}. {t}", "2024. 03. 31. 23:59:56.000"),
    ("{d}. {m}. {y} {t}", "31. 3. 2024 23:59:56.000"),
    ("{d:02d}.{m:02d}.{y} г. {t}", "31.03.2024 г. 23:59:56.000"),
    ("{d:02d}.{m:02d}.{y} r. {t}", "31.03.2024 r. 23:59:56.000"),
    ("{y}.{m:02d}.{d:02d}. {t}", "2024.03.31. 23:59:56.000"),
    ("{y}-{m:02d}-{d:02d}_{of_files}", "2024-03-31_23-59-56.000"),
]


def stamps(form: str) -> list[str]:
    found = []
    for i in range(N):
        thousandths = 86_396_000 + 100 * i
        day, rest = divmod(thousandths, 86_400_000)
        minutes, part = divmod(rest, 60_000)
        t = f"{minutes // 60:02d}:{minutes % 60:02d}:{part / 1000:06.3f}"
        month, of_month = (3, 31) if day == 0 else (4, 1)
        found.append(form.format(d=of_month, m=month, y=2024, t=t, of_files=t.replace(":", "-")))
    return found


def read(folder: Path, name: str, cells: list[str], reading: Reading = AS_FOUND) -> LabTable:
    rows = [f"{name};Displacement (mm);Force (N)"]
    for i, cell in enumerate(cells):
        x = 0.01 * min(i, N - 1 - i)
        rows.append(f"{cell};{x:.4f};{1.5 * max(0.0, x - 0.05) ** 1.5:.4f}")
    path = folder / "lab.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return read_lab_file(path, reading)


@pytest.mark.parametrize(("form", "first"), FORMS)
@pytest.mark.parametrize("mark", [".", ","])
def test_a_date_of_any_country_is_read_over_midnight(tmp_path: Path, form: str, first: str, mark: str) -> None:
    cells = stamps(form)
    assert cells[0] == first
    if mark == ",":
        cells = [cell[:-4] + "," + cell[-3:] for cell in cells]
    np.testing.assert_allclose(read(tmp_path, "Time", cells).columns["time"], 86_396 + 0.1 * np.arange(N), atol=1e-6)


@pytest.mark.parametrize("form", [form for form, _ in FORMS])
@pytest.mark.parametrize("name", ["Dátum", "stamp", "Laiks"])
def test_it_is_taken_with_a_note_where_its_name_is_not_understood(tmp_path: Path, form: str, name: str) -> None:
    table = read(tmp_path, name, stamps(form))
    np.testing.assert_allclose(table.columns["time"], 86_396 + 0.1 * np.arange(N), atol=1e-6)
    assert any("is taken as the time, as its cells are dates" in note for note in table.notes)


def test_dates_with_points_in_a_column_of_their_own_are_those_of_the_times(tmp_path: Path) -> None:
    cells = [cell.rpartition(" ")[::2] for cell in stamps("{y}. {m}. {d}. {t}")]
    table = read(tmp_path, "Dátum;Time", [";".join(pair) for pair in cells])
    np.testing.assert_allclose(table.columns["time"], 86_396 + 0.1 * np.arange(N), atol=1e-6)


@pytest.mark.parametrize("cell", ["2024-03-01T10-00-{:02d}.{:03d}", "10h 00' {:02d}'' {:03d}", "1/3/2024 10h00 {:02d},{:03d}"])
def test_times_of_a_form_that_is_not_understood_are_told_of(tmp_path: Path, cell: str) -> None:
    table = read(tmp_path, "stamp", [cell.format(*divmod(50 * i, 1000)) for i in range(N)])
    assert "time" in table.columns or any('no time is read; if "stamp" is one' in note for note in table.notes)


@pytest.mark.parametrize("cell", ["A-{:02d}", "192.168.0.1", "v1.2.3", "S-07-{:02d}-x"])
def test_other_words_with_figures_are_no_times(tmp_path: Path, cell: str) -> None:
    table = read(tmp_path, "stamp", [cell.format(i % 7) for i in range(N)])
    assert not any("no time is read" in note for note in table.notes)


def test_a_date_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no date|no times that are understood"):
        read(tmp_path, "Time", [cell.replace("31", "32").replace("04", "13") for cell in stamps("{d:02d}. {m:02d}. {y} {t}")])


@pytest.mark.parametrize(("name", "start"), [("JD", 2_460_371), ("MJD", 60_371), ("Serial", 45_382)])
@pytest.mark.parametrize("unit", ["d", "day"])
def test_days_of_a_calendar_are_read_in_the_unit_of_days(tmp_path: Path, name: str, start: int, unit: str) -> None:
    cells = [f"{start + 0.1 * i / 86_400:.12f}" for i in range(N)]
    table = read(tmp_path, name, cells, Reading(columns={"time": name}, units={"time": unit}))
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], 0.1 * np.arange(N), atol=1e-3)


_SECOND = 1 / 86_400


@pytest.mark.parametrize(
    ("start", "second", "unit"),
    [(2_460_371.25, _SECOND, "day"), (45_382.25, _SECOND, "day"), (12.0, _SECOND, "day"), (12.0, 1.0, "s")],
)
def test_the_note_on_a_column_that_may_be_the_time_names_the_unit_that_works(
    tmp_path: Path, start: float, second: float, unit: str
) -> None:
    table = read(tmp_path, "Serial", [f"{start + 0.1 * i * second:.12f}" for i in range(N)])
    assert any(f"--columns time=Serial --units time={unit}" in note for note in table.notes)
