"""Times that are written unusually: points for colons, no marks at all, milliseconds without zeros, parts in columns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 161
PLACE = [0.006 * min(i, N - 1 - i) for i in range(N)]
LOAD = [3.0 * max(0.0, x - 0.06) ** 1.5 for x in PLACE]
DAY = datetime(2026, 11, 20)


def record(
    folder: Path, head: str, cell: Callable[[int], str], units: Mapping[str, str] | None = None, sep: str = ";"
) -> LabTable:
    rows = [sep.join((cell(i), f"{x:.4f}", f"{f:.4f}")) for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True))]
    path = folder / "press.csv"
    path.write_text("\n".join([sep.join((head, "Displacement (mm)", "Force (N)")), *rows, ""]), encoding="utf-8")
    return read_lab_file(path, Reading(units=units or {}))


def assert_steps(table: LabTable, seconds: Sequence[float], among: str) -> None:
    time = table.columns["time"]
    np.testing.assert_allclose(time - time[0], np.asarray(seconds) - seconds[0], atol=2e-5)
    assert not any(table.reasons)
    assert any(among in note for note in table.notes), table.notes


def steady(start: float, step: float) -> list[float]:
    return [start + step * i for i in range(N)]


def written(pattern: str, seconds: float) -> str:
    at = DAY + timedelta(seconds=seconds)
    return at.strftime(pattern.replace("%L", f"{at.microsecond // 1000:03d}"))


def counted(seconds: float, digits: int = 3) -> str:
    parts = round(seconds * 10**digits)
    return f"{parts // 10**digits}.{parts % 10**digits}"


# ----------------------------------------------------------------------------------------- a colon before parts of seconds


def four_parts(milliseconds: int, last: str) -> str:
    seconds, part = divmod(milliseconds, 1000)
    return f"10:{22 + seconds // 60 % 30:02d}:{seconds % 60:02d}:{last.format(ms=part, cs=part // 10, frame=part * 3 // 100)}"


@pytest.mark.parametrize(
    ("last", "step", "jitter"),
    [("{ms}", 50, 0), ("{ms}", 50, 7), ("{ms}", 500, 0), ("{cs:02d}", 500, 0), ("{cs:02d}", 130, 0), ("{cs}", 130, 0)],
)
@pytest.mark.parametrize("before", ["", "2026-11-20 "])
def test_hundredths_and_milliseconds_behind_a_colon_are_read_with_a_note_where_the_times_show_them(
    tmp_path: Path, last: str, step: int, jitter: int, before: str
) -> None:
    at = [step * i + i * 5 % 11 * jitter // 7 for i in range(N)]
    table = record(tmp_path, "Time", lambda i: before + four_parts(at[i], last))
    assert_steps(table, [t / 1000 for t in at], "the last part of the times counts")


@pytest.mark.parametrize("last", ["{cs:02d}", "{cs}"])
def test_others_are_refused_with_what_to_say_unless_they_are_days_hours_minutes_and_seconds(tmp_path: Path, last: str) -> None:
    at = [130 * i + i * 37 % 97 // 10 * 10 for i in range(N)] if "cs" in last else [100 * i for i in range(N)]
    with pytest.raises(InputError, match="--units time=h:min:s:cs"):
        record(tmp_path, "Time", lambda i: four_parts(at[i], last))
    if "cs" in last:
        table = record(tmp_path, "Time", lambda i: four_parts(at[i], last), {"time": "h:min:s:cs"})
        assert_steps(table, [t / 1000 for t in at], "counts hundredths")


@pytest.mark.parametrize("step", [1, 7, 20, 30, 40, 45, 59, 60, 61, 90])
def test_days_hours_minutes_and_seconds_are_no_times_with_hundredths(tmp_path: Path, step: int) -> None:
    def cell(i: int) -> str:
        days, rest = divmod(86_000 + step * i, 86_400)
        return f"{days}:{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"

    for said in ({}, {"time": "d:h:min:s"}):
        np.testing.assert_allclose(np.diff(record(tmp_path, "Time", cell, said).columns["time"]), step)


# --------------------------------------------------------------------------------- parts of seconds without zeros before them


@pytest.mark.parametrize("step", [0.05, 0.01, 0.02, 0.04, 0.025, 1.05, 0.95, 0.31])
def test_seconds_and_milliseconds_without_zeros_are_read_with_a_note_where_they_go_on_evenly(
    tmp_path: Path, step: float
) -> None:
    seconds = steady(0.0, step)
    table = record(tmp_path, "Time (s)", lambda i: counted(seconds[i]))
    assert_steps(table, seconds, "without zeros before them")


def test_so_are_microseconds_and_times_of_day(tmp_path: Path) -> None:
    seconds = steady(0.0, 0.05)
    assert_steps(record(tmp_path, "Time (s)", lambda i: counted(seconds[i], 6)), seconds, "without zeros before them")
    seconds = steady(0.0, 1.05)

    def clock(i: int) -> str:
        return f"{written('%H:%M:%S', 37351 + math.floor(seconds[i] + 1e-9))}.{counted(seconds[i]).split('.')[1]}"

    assert_steps(record(tmp_path, "Time", clock), seconds, "without zeros before them")


def test_they_are_refused_where_they_go_on_unevenly(tmp_path: Path) -> None:
    seconds = np.cumsum(np.where(np.arange(N) % 3, 0.05, 1.07))
    with pytest.raises(InputError, match="the zeros before its milliseconds left away"):
        record(tmp_path, "Time (s)", lambda i: counted(seconds[i]))


@pytest.mark.parametrize("pattern", ["{:g}", "{:.3f}", "{:.1f}", "{!r}", "{:#.4g}", "{:.2f}"])
@pytest.mark.parametrize("step", [0.05, 0.1, 0.15, 0.5, 1.05])
def test_usual_decimals_are_what_they_are(tmp_path: Path, pattern: str, step: float) -> None:
    cells = [pattern.format(round(s, 6)) for s in steady(0.0, step)]
    if len(set(cells)) < N:
        return
    table = record(tmp_path, "Time (s)", lambda i: cells[i])
    np.testing.assert_array_equal(table.columns["time"], [float(c) for c in cells])
    assert not any("zeros" in note for note in table.notes)


# ------------------------------------------------------------------------------------------------- points, and nothing between


@pytest.mark.parametrize("head", ["Aika", "Time", "Klokken", "Ora"])
@pytest.mark.parametrize("pattern", ["%H.%M.%S,%L", "%H.%M.%S.%L", "%d.%m.%Y %H.%M.%S,%L", "%Y-%m-%d %H.%M.%S.%L"])
def test_times_of_day_with_points_are_read(tmp_path: Path, head: str, pattern: str) -> None:
    seconds = steady(37351.25, 0.2)
    assert_steps(record(tmp_path, head, lambda i: written(pattern, seconds[i])), seconds, "is read as a time of day")


def test_they_go_on_over_midnight_and_in_whole_seconds(tmp_path: Path) -> None:
    seconds = steady(86390, 1.0)
    assert_steps(record(tmp_path, "Aika", lambda i: written("%H.%M.%S", seconds[i])), seconds, "is read as a time of day")


@pytest.mark.parametrize(
    "cell",
    [
        lambda i: (DAY + timedelta(days=i)).strftime("%d.%m.%y"),
        lambda i: f"1.{i % 60:02d}.{(7 * i) % 60:02d}",
        lambda i: f"10.61.{i % 60:02d}",
    ],
)
def test_dates_versions_and_places_with_points_are_no_times(tmp_path: Path, cell: Callable[[int], str]) -> None:
    table = record(tmp_path, "Lot", cell)
    assert "time" not in table.columns
    assert not any("is read as a time of day" in note for note in table.notes)


@pytest.mark.parametrize("pattern", ["%Y%m%d%H%M%S.%L", "%Y%m%d_%H%M%S.%L", "%Y%m%d %H%M%S,%L"])
def test_dates_with_times_without_marks_are_read(tmp_path: Path, pattern: str) -> None:
    seconds = steady(86351.25, 0.5)
    assert_steps(record(tmp_path, "Timestamp", lambda i: written(pattern, seconds[i])), seconds, "is read as a time of day")


@pytest.mark.parametrize("head", ["Time (hhmmss)", "Time [HHMMSS]", "Time"])
@pytest.mark.parametrize("start", [37351, 3555, 35990])
def test_times_of_day_without_marks_are_read(tmp_path: Path, head: str, start: int) -> None:
    seconds = steady(start, 1.0)
    table = record(tmp_path, head, lambda i: written("%H%M%S", seconds[i]))
    assert_steps(table, seconds, "hours, minutes and seconds without marks")


def test_numbers_that_pass_sixty_or_whose_unit_is_said_are_no_times_of_day(tmp_path: Path) -> None:
    for head, units in (("Time (s)", None), ("Time", {"time": "s"})):
        table = record(tmp_path, head, lambda i: f"{102200 + i}", units)
        np.testing.assert_array_equal(table.columns["time"], 102200 + np.arange(N))
    with pytest.raises(InputError, match="Leave its unit out to have it read so"):
        record(tmp_path, "Time", lambda i: written("%H%M%S", 37351 + i), {"time": "s"})


# ------------------------------------------------------------------------------------------------------------------- ticks


def test_ticks_since_the_year_1_are_told_with_the_unit_that_reads_them(tmp_path: Path) -> None:
    def cell(i: int) -> str:
        return f"{639_000_000_000_000_000 + 2_000_000 * i}"

    note = next(n for n in record(tmp_path, "Ticks", cell).notes if n.startswith("no time is read"))
    assert note.endswith('--columns time=Ticks --units "time=100 ns"')
    with pytest.raises(InputError) as refused:
        record(tmp_path, "Time", cell, {"time": "s"})
    assert '--units "time=100 ns"' in refused.value.faults[0].advice
    time = record(tmp_path, "Time", cell, {"time": "100 ns"}).columns["time"]
    np.testing.assert_allclose(np.diff(time), 0.2, atol=3e-5)


@pytest.mark.parametrize("name", ["FILETIME (100 ns)", "FILETIME", "Stamp"])
def test_ticks_of_windows_since_1601_are_told_with_the_unit_that_reads_them(tmp_path: Path, name: str) -> None:
    def cell(i: int) -> str:
        return f"{134_177_500_000_000_000 + 2_000_000 * i}"

    note = next(n for n in record(tmp_path, name, cell).notes if n.startswith("no time is read"))
    assert note.endswith('--units "time=100 ns"')
    with pytest.raises(InputError, match="100 ns since 1601"):
        record(tmp_path, "Time", cell, {"time": "s"})
    np.testing.assert_allclose(np.diff(record(tmp_path, "Time", cell, {"time": "100 ns"}).columns["time"]), 0.2, atol=3e-5)


# --------------------------------------------------------------------------------------------------------- parts in columns


@pytest.mark.parametrize("head", ["Hour;Minute;Second", "hh;mm;ss", "h;min;s", "Std;Min;Sek"])
@pytest.mark.parametrize(("pattern", "step"), [("%H;%M;%S.%L", 0.45), ("%H;%M;%S", 1.0)])
@pytest.mark.parametrize("start", [37351.0, 86380.0])
def test_hours_minutes_and_seconds_in_columns_are_one_time(
    tmp_path: Path, head: str, pattern: str, step: float, start: float
) -> None:
    seconds = steady(start, step)
    table = record(tmp_path, head, lambda i: written(pattern, seconds[i]))
    assert_steps(table, seconds, "are the parts of one time")


@pytest.mark.parametrize("head", ["min;s", "Minute;Second"])
def test_so_are_minutes_and_seconds_which_may_pass_the_hour(tmp_path: Path, head: str) -> None:
    seconds = steady(3500.0, 1.5)
    table = record(tmp_path, head, lambda i: f"{seconds[i] // 60:.0f};{seconds[i] % 60:.3f}")
    assert_steps(table, seconds, "are the parts of one time")


def test_seconds_that_do_not_go_on_with_their_minutes_are_no_time_and_not_advised(tmp_path: Path) -> None:
    table = record(tmp_path, "Minute;Second", lambda i: f"{(i // 50) % 2};{0.3 * i:.3f}")
    assert "time" not in table.columns
    assert not any("--columns" in note for note in table.notes)


def test_a_least_value_beside_a_distance_is_no_part_of_a_time(tmp_path: Path) -> None:
    table = record(tmp_path, "min;s", lambda i: f"{0.5 + 0.001 * i:.3f};{i / 10:.1f}")
    assert not any("parts of one time" in note for note in table.notes)


def test_millimetres_beside_seconds_are_no_minutes(tmp_path: Path) -> None:
    table = record(tmp_path, "mm;s", lambda i: f"{i // 40};{0.3 * i:.1f}")
    assert not any("put together" in note for note in table.notes)


@pytest.mark.parametrize("units", [None, {"time": "s"}])
def test_the_seconds_that_the_user_names_are_put_together_likewise(tmp_path: Path, units: Mapping[str, str] | None) -> None:
    path = tmp_path / "named.csv"
    stamps = [written("%H;%M;%S.%L", 37351.25 + 0.5 * i) for i in range(N)]
    rows = [f"{at};{x:.4f};{f:.4f}" for at, x, f in zip(stamps, PLACE, LOAD, strict=True)]
    path.write_text("\n".join(["Hour;Minute;Second;Displacement (mm);Force (N)", *rows, ""]), encoding="utf-8")
    table = read_lab_file(path, Reading(columns={"time": "Second"}, units=units or {}))
    assert_steps(table, steady(37351.25, 0.5), "are the parts of one time")


# ----------------------------------------------------------------------------------------------------- stamps before lines


@pytest.mark.parametrize("sep", [",", ";", "\t"])
@pytest.mark.parametrize("own", [True, False])
def test_stamps_of_a_serial_monitor_are_a_column_and_the_time_if_there_is_no_other(tmp_path: Path, sep: str, own: bool) -> None:
    lines = [sep.join(["time_ms"] * own + ["disp_um", "force_mN"])]
    for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True)):
        lines.append(sep.join([f"{100 * i}"] * own + [f"{1e3 * x:.0f}", f"{1e3 * f:.1f}"]))
    path = tmp_path / "serial.txt"
    stamps = [written("%H:%M:%S.%L", 37350.9 + 0.025 * i) for i in range(len(lines))]
    path.write_text("\n".join(f"{at} -> {line}" for at, line in zip(stamps, lines, strict=True)) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert_steps(table, steady(0.0, 0.1 if own else 0.025), "a serial monitor")
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=6e-5)
