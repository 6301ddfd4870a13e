"""Times that are missing and may be had from a count and an interval, and dates beside times of day that are no clocks."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

N = 60
PRESS = np.linspace(0.0, 1.0, N)
CP = np.round(97.1 + 2.0 * np.maximum(np.sin(np.arange(N) / 20), 0) ** 1.4, 4)


def written(tmp_path: Path, lines: list[str]) -> Path:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("line", "step"),
    [
        ("Interval,200ms", "0.2"),
        ("INTERVAL;0.5 s", "0.5"),
        ("# Intervall: 2 s", "2"),
        ("Sampling rate: 5 Hz", "0.2"),
        ("Log interval 100 ms", "0.1"),
    ],
)
@pytest.mark.parametrize("name", ["No.", "Sample", "Index"])
def test_a_time_that_is_needed_is_offered_by_a_count_and_an_interval(tmp_path: Path, line: str, step: str, name: str) -> None:
    path = written(tmp_path, ["HIOKI IM3533", line, f"{name},Cp[F]", *(f"{k},{c}E-12" for k, c in enumerate(CP.tolist()))])
    with pytest.raises(InputError, match="no time column") as error:
        read_lab_file(path)
    assert f'--columns time={name} --units "time={step} s" reads the time from both' in error.value.faults[0].advice
    table = read_lab_file(path, Reading(columns={"time": name}, units={"time": f"{step} s"}))
    np.testing.assert_allclose(table.columns["time"], float(step) * np.arange(N))


@pytest.mark.parametrize("line", ["Interval: 5 N", "Check interval,yearly", "Model 200", "Confidence interval,95 %"])
def test_other_lines_offer_no_interval(tmp_path: Path, line: str) -> None:
    path = written(tmp_path, [line, "No.,Cp[F]", *(f"{k},{c}E-12" for k, c in enumerate(CP.tolist()))])
    with pytest.raises(InputError, match="no time column") as error:
        read_lab_file(path)
    assert 'if it is to be the time, --columns time=No. --units "time=... s"' in error.value.faults[0].advice


def test_a_counter_that_overflows_is_offered_as_one_time(tmp_path: Path) -> None:
    rows = [f"{(2**32 - 200 + 10 * k) % 2**32},{c:.4f}" for k, c in enumerate(CP.tolist())]
    path = written(tmp_path, ["ms,cap_pF", *rows])
    with pytest.raises(InputError, match="no time column") as error:
        read_lab_file(path)
    assert '"ms" rises from row to row as one does: if it is one, --columns time=ms' in error.value.faults[0].advice
    assert "begins anew" not in error.value.faults[0].advice
    table = read_lab_file(path, Reading(columns={"time": "ms"}, units={"time": "ms"}))
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.01)


@pytest.mark.parametrize("dates", [("12.03.24", "12.03.24"), ("12.03.24", "13.03.24"), ("01.02.24", "02.02.24")])
@pytest.mark.parametrize("name", ["Datum", "Tag", "Day"])
def test_dates_beside_times_of_day_are_read_as_no_time_of_day(tmp_path: Path, dates: tuple[str, str], name: str) -> None:
    first = 86390 if dates[0] != dates[1] else 43200
    lines = [f"{name};Uhrzeit;Kapazität [pF]"]
    for k, c in enumerate(CP.tolist()):
        at = first + k
        clock = f"{at // 3600 % 24:02d}:{at // 60 % 60:02d}:{at % 60:02d},00"
        lines.append(f"{dates[at // 86400]};{clock};" + f"{c:.3f}".replace(".", ","))
    table = read_lab_file(written(tmp_path, lines), Reading(decimal=","))
    np.testing.assert_allclose(np.diff(table.columns["time"]), 1.0)
    assert not any("is read as a time of day" in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "unit", "seconds"),
    [("Ticks (10 ms)", "10 ms", 0.01), ("Counter (1 ms)", "1 ms", 0.001), ("Index [0.5 s]", "0.5 s", 0.5)],
)
def test_a_count_whose_name_says_how_long_one_lasts_is_offered_in_that_unit(
    tmp_path: Path, name: str, unit: str, seconds: float
) -> None:
    path = written(
        tmp_path, [f"{name},Extension (mm),Load (N)", *(f"{10 * i},{x:.4f},{2 * x**1.5:.4f}" for i, x in enumerate(PRESS))]
    )
    note = next(n for n in read_lab_file(path).notes if n.startswith("no time is read"))
    assert f'--columns "time={name}" --units "time={unit}"' in note
    table = read_lab_file(path, Reading(columns={"time": name}, units={"time": unit}))
    assert table.columns["time"] == pytest.approx((10 * seconds * np.arange(N)).tolist())
    assert not any("though" in n for n in table.notes)
    other = read_lab_file(path, Reading(columns={"time": name}, units={"time": "min"}))
    assert f'"{name}" is read in min as asked, though the file says {unit}' in other.notes


def pressed(tmp_path: Path, line: str, name: str, counts: list[int]) -> Path:
    rows = (f"{k},{x:.4f},{2 * x**1.5:.4f}" for k, x in zip(counts, PRESS, strict=True))
    return written(tmp_path, [line, f"{name},Extension (mm),Load (N)", *rows])


@pytest.mark.parametrize(
    ("line", "unit", "seconds"),
    [
        ("Tick = 0.5 ms", "0.5 ms", 5e-4),
        ("1 tick = 0.5 ms", "0.5 ms", 5e-4),
        ("# Tick (ms): 0.5", "0.5 ms", 5e-4),
        ("Clock frequency: 2000 Hz", "0.0005 s", 5e-4),
        ("Timer rate;2;kHz", "0.0005 s", 5e-4),
        ("2000 ticks/s", "0.0005 s", 5e-4),
        ("Ticks per second: 2000", "0.0005 s", 5e-4),
        ("Counter resolution: 100 us", "100 us", 1e-4),
        ("Zählertakt: 10 kHz", "0.0001 s", 1e-4),
        ("# camera frame rate: 20 fps", "0.05 s", 0.05),
    ],
)
@pytest.mark.parametrize("name", ["Ticks", "Counter", "Frame"])
def test_counts_of_a_clock_are_offered_in_what_the_file_says_one_lasts(
    tmp_path: Path, line: str, unit: str, seconds: float, name: str
) -> None:
    path = pressed(tmp_path, line, name, [200 * i for i in range(N)])
    note = next(n for n in read_lab_file(path).notes if n.startswith("no time is read"))
    assert note.endswith(f'--columns time={name} --units "time={unit}" reads the time from both')
    table = read_lab_file(path, Reading(columns={"time": name}, units={"time": unit}))
    assert table.columns["time"] == pytest.approx((200 * seconds * np.arange(N)).tolist())
    assert not any("though line" in n for n in table.notes)
    other = read_lab_file(path, Reading(columns={"time": name}, units={"time": "s"}))
    assert any(f'one count of "{name}" is read as 1 s, as asked, though line 1 says' in n for n in other.notes)


@pytest.mark.parametrize("line", ["Timer: 20 s", "Count: 161", "Clock: 14:05:07", "Hold time 5 s", "Counts 500", "Frame 12 mm"])
def test_what_is_no_tick_leaves_the_unit_of_counts_open(tmp_path: Path, line: str) -> None:
    path = pressed(tmp_path, line, "Ticks", [200 * i for i in range(N)])
    note = next(n for n in read_lab_file(path).notes if n.startswith("no time is read"))
    assert "--units time=..., s or what one count lasts" in note
    table = read_lab_file(path, Reading(columns={"time": "Ticks"}, units={"time": "s"}))
    assert not any("though line" in n for n in table.notes)


@pytest.mark.parametrize(("line", "step"), [("Sample interval (s),0.25", 0.25), ("Interval: 100 ms", 0.1)])
@pytest.mark.parametrize("name", ["No.", "Sample"])
def test_an_index_with_rows_that_were_lost_is_offered_with_the_stated_interval(
    tmp_path: Path, line: str, step: float, name: str
) -> None:
    counts = [k for k in range(N + 3) if k not in (7, 20, 41)]
    path = pressed(tmp_path, line, name, counts)
    note = next(n for n in read_lab_file(path).notes if n.startswith("no time is read"))
    assert note.endswith(f'--columns time={name} --units "time={step:g} s" reads the time from both')
    table = read_lab_file(path, Reading(columns={"time": name}, units={"time": f"{step:g} s"}))
    assert table.columns["time"] == pytest.approx((step * np.array(counts)).tolist())
    wrong = read_lab_file(path, Reading(columns={"time": name}, units={"time": "s"}))
    assert any("but as it is read the readings follow each other after" in n for n in wrong.notes)


@pytest.mark.parametrize(("name", "first"), [("DOY", 70.5), ("MJD", 60378.5), ("day_of_year", 311.25)])
def test_days_are_offered_as_days_and_not_as_seconds_that_would_last_a_blink(tmp_path: Path, name: str, first: float) -> None:
    rows = [f"{first + 0.1 * k / 86400:.9f},{c:.4f},{p:.4f}" for k, (c, p) in enumerate(zip(CP, PRESS, strict=True))]
    path = written(tmp_path, [f"{name},Cp (pF),Displacement (mm)", *rows])
    note = next(n for n in read_lab_file(path).notes if n.startswith("no time is read"))
    assert note.endswith(f"--columns time={name} --units time=day")
    table = read_lab_file(path, Reading(columns={"time": name}, units={"time": "day"}))
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=2e-4)


def test_a_column_that_rises_as_a_time_does_is_named_in_a_file_of_decimal_commas_too(tmp_path: Path) -> None:
    place = np.concatenate([np.linspace(0.0, 0.6, 30), np.linspace(0.58, 0.0, 30)])
    rows = [f"{0.1 * k + 0.05:.2f};{x:.4f};{8 * max(x - 0.05, 0.0) ** 1.5:.4f}" for k, x in enumerate(place.tolist())]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Foo;Weg (mm);Kraft (N)", *(row.replace(".", ",") for row in rows)]) + "\n", encoding="utf-8")
    assert any("--columns time=Foo --units time=s" in note for note in read_lab_file(path).notes)
