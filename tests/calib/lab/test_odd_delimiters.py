"""Cells between marks that no program uses as delimiter, or one value a line: read where names show the cells, else refused."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
WAY = np.round(np.concatenate([np.linspace(0.0, 0.6, N // 2), np.linspace(0.6, 0.0, N // 2)]), 4)
TIME = 0.1 * np.arange(N)
FORCE = np.round(8.0 * np.maximum(WAY - 0.05, 0.0) ** 1.5, 4)
NAMES = ["Time (s)", "Displacement (mm)", "Force (N)"]
ROWS = [[f"{t:.2f}", f"{x:.4f}", f"{f:.4f}"] for t, x, f in zip(TIME, WAY, FORCE, strict=True)]


def read(tmp_path: Path, lines: list[str], reading: Reading | None = None) -> LabTable:
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def check(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"], TIME, atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * WAY, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert not any(table.reasons)
    assert not table.unread


MARKS = ["~", ":", "^", "¦", "::", "/", " / ", " - ", " : ", "&", "@", "#", "\\", "_", " -> ", " => ", " * ", "§", "~~"]


@pytest.mark.parametrize("mark", MARKS)
def test_a_mark_that_parts_names_and_rows_into_as_many_is_a_delimiter_with_a_note(tmp_path: Path, mark: str) -> None:
    table = read(tmp_path, [mark.join(cells) for cells in (NAMES, *ROWS)])
    check(table)
    assert any(f'between "{mark.strip()}"' in note for note in table.notes)
    assert table.lines[0] == 2


@pytest.mark.parametrize("mark", ["~", ":", "^"])
def test_titles_above_and_units_below_the_names_change_nothing_of_it(tmp_path: Path, mark: str) -> None:
    lines = ["Press 3", "Note: 3^4 ~ 81", "", *(mark.join(cells) for cells in (["Time", "Displacement", "Force"], *ROWS))]
    lines.insert(4, mark.join(["s", "mm", "N"]))
    table = read(tmp_path, lines)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert table.lines[0] == 6


def test_decimal_commas_and_times_of_day_may_stand_between_such_marks(tmp_path: Path) -> None:
    rows = [[f"10:00:{t:05.2f}", x.replace(".", ","), f.replace(".", ",")] for t, (_, x, f) in zip(TIME, ROWS, strict=True)]
    table = read(tmp_path, ["~".join(cells) for cells in (["Time", *NAMES[1:]], *rows)])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    np.testing.assert_allclose(table.columns["time"] - 36000.0, TIME, atol=1e-6)


def test_colons_that_times_of_day_hold_as_well_are_refused_with_what_to_write(tmp_path: Path) -> None:
    lines = [":".join([f"10:00:{t:05.2f}", *row[1:]]) for t, row in zip(TIME, ROWS, strict=True)]
    with pytest.raises(InputError, match='5 cells between ":"') as error:
        read(tmp_path, [":".join(["Time", *NAMES[1:]]), *lines])
    assert "semicolon" in error.value.faults[0].advice
    as_told = [";".join(["Time", *NAMES[1:]]), *(";".join(line.rsplit(":", 2)) for line in lines)]
    np.testing.assert_allclose(read(tmp_path, as_told).columns["force"], FORCE, atol=1e-9)


def test_names_of_another_number_than_the_cells_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no line above names as many") as error:
        read(tmp_path, ["~".join(NAMES[:2]), *("~".join(row) for row in ROWS)])
    assert error.value.faults[0].line == 2


def test_rows_without_names_are_read_by_number(tmp_path: Path) -> None:
    columns = {"time": "1", "displacement": "2", "force": "3"}
    said = Reading(columns=columns, units={"time": "s", "displacement": "mm", "force": "N"})
    lines = ["~".join(row) for row in ROWS]
    check(read(tmp_path, lines, said))
    with pytest.raises(InputError) as error:
        read(tmp_path, lines)
    assert "--columns time=1 --columns displacement=2 --columns force=3" in error.value.faults[0].advice
