"""Clocks that no name tells: columns of dates with times, durations, milliseconds apart; and notes where no time is read."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

N = 81
START = datetime(2026, 11, 20, 23, 59, 56, 200_000)
PLACE = [0.01 * min(i, N - 1 - i) for i in range(N)]
LOAD = [1.5 * max(0.0, x - 0.1) ** 1.5 for x in PLACE]


def stamp(i: int) -> datetime:
    return START + timedelta(milliseconds=100 * i)


def read(folder: Path, head: str, cell: Callable[[int], str], reading: Reading = AS_FOUND) -> LabTable:
    path = folder / "lab.csv"
    rows = [f"{cell(i)},{x:.4f},{f:.4f}" for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True))]
    path.write_text("\n".join([f"{head},Extension (mm),Load (N)", *rows, ""]), encoding="utf-8")
    return read_lab_file(path, reading)


def assert_time(table: LabTable, step: float = 0.1) -> None:
    time = table.columns["time"]
    np.testing.assert_allclose(time - time[0], step * np.arange(N), atol=2e-6)


def form(pattern: str) -> Callable[[int], str]:
    return lambda i: stamp(i).strftime(pattern.replace("%f3", f"{stamp(i).microsecond // 1000:03d}"))


@pytest.mark.parametrize("head", ["Datum/Zeit", "Date", "Date and time", "When", "いつ", ""])
@pytest.mark.parametrize(
    "pattern", ["%d.%m.%Y %H:%M:%S.%f3", "%y-%m-%d %H:%M:%S.%f3", "%Y-%m-%dT%H:%M:%S.%f3Z", "%d-%b-%Y %H:%M:%S.%f3"]
)
def test_a_column_of_dates_with_times_is_the_time_whatever_it_is_called(tmp_path: Path, head: str, pattern: str) -> None:
    table = read(tmp_path, head, form(pattern))
    assert_time(table)
    assert any("is taken as the time, as its cells are dates with times of day" in note for note in table.notes)


@pytest.mark.parametrize(
    "pattern",
    [
        '"%b %d, %Y %I:%M:%S.%f3 %p"',
        "%a %b %d %H:%M:%S.%f3 %Y",
        "%Y年%m月%d日 %H時%M分%S.%f3秒",
        "%Y年%m月%d日 下午 %I:%M:%S.%f3",
        "%Y%m%dT%H%M%S.%f3",
        "%d. November %Y %H:%M:%S.%f3",
        "%a %b %d %H:%M:%S.%f3 CET %Y",
        "%a %d %b %Y %I:%M:%S.%f3 %p CET",
        "Fr %d. Nov %H:%M:%S.%f3 +0100 %Y",
        "%G-W%V-%uT%H:%M:%S.%f3",
        "%Y-%jT%H:%M:%S.%f3Z",
    ],
)
def test_dates_and_times_written_with_words_or_without_marks_are_read(tmp_path: Path, pattern: str) -> None:
    early = form(pattern.replace("下午", "上午"))  # after midnight
    assert_time(read(tmp_path, "Time", lambda i: form(pattern)(i) if stamp(i).hour else early(i)))


@pytest.mark.parametrize("half", [("a. m.", "p. m."), ("a.m.", "p.m."), ("am", "pm")])
def test_a_clock_over_midnight_and_noon_is_the_time_whatever_it_is_called(tmp_path: Path, half: tuple[str, str]) -> None:
    def cell(i: int) -> str:
        return f"{form('%I:%M:%S.%f3')(i)} {half[stamp(i).hour >= 12]}"

    assert_time(read(tmp_path, "Hora", cell))
    assert_time(read(tmp_path, "Clock", form("%H:%M:%S.%f3")))


@pytest.mark.parametrize(
    "cell",
    [
        lambda i: f"0 days 00:00:{0.1 * i:09.6f}",
        lambda i: f'"1 day, 0:00:{0.1 * i:04.1f}"',
        lambda i: f"{0.1 * i:.1f} secs",
        lambda i: f"PT{0.1 * i:.1f}S",
        lambda i: f"2.00:00:{0.1 * i:04.1f}",
        lambda i: f"0 d 1 h 02 min {0.1 * i:.1f} s",
    ],
)
def test_durations_as_programs_write_them_need_no_unit(tmp_path: Path, cell: Callable[[int], str]) -> None:
    for name in ("elapsed", "dauer"):
        table = read(tmp_path, name, cell)
        assert_time(table)
        assert not any("time of day" in note or "times of day" in note for note in table.notes)


def test_a_time_of_day_is_called_one_and_minutes_with_seconds_are_durations(tmp_path: Path) -> None:
    assert 'time is taken from the time of day in "Time"' in read(tmp_path, "Time", form("%H:%M:%S.%f3")).notes
    table = read(tmp_path, "Time", lambda i: f"{i // 600:02d}:{0.1 * (i % 600):04.1f}")
    assert 'time is taken from the durations in "Time"' in table.notes


def test_cells_of_a_time_that_are_no_times_are_not_asked_for_a_unit_and_can_be_left_out(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no times that are understood.*--columns time=none") as error:
        read(tmp_path, "Time", lambda i: f"{i} beats")
    assert "--units" not in str(error.value)
    assert "time" not in read(tmp_path, "Time", lambda i: f"{i} beats", Reading(columns={"time": "none"})).columns


def test_a_clock_by_its_cells_that_is_set_back_is_refused_and_can_be_left_out(tmp_path: Path) -> None:
    def cell(i: int) -> str:
        return (stamp(i) - timedelta(hours=1 if i > 40 else 0)).strftime("%Y-%m-%d %H:%M:%S.%f")

    with pytest.raises(InputError, match=r"set back by an hour.*--columns time=none"):
        read(tmp_path, "Date and time", cell)
    assert "time" not in read(tmp_path, "Date and time", cell, Reading(columns={"time": "none"})).columns


@pytest.mark.parametrize("head", ["Test date", "Created", "Peak time"])
def test_a_date_that_stands_still_or_a_statistic_is_no_clock(tmp_path: Path, head: str) -> None:
    cell = form("%H:%M:%S.%f3") if head == "Peak time" else lambda _: "2026-11-20 14:03:00"
    assert "time" not in read(tmp_path, head, cell).columns


def test_a_clock_beside_a_time_is_not_the_time(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Date", lambda i: f"{0.1 * i:.1f},{form('%Y-%m-%d %H:%M:%S')(i)}")
    assert table.sources["time"] == "Time (s)"


@pytest.mark.parametrize(
    ("head", "cell", "said"),
    [
        ("datenum", lambda i: f"{740305.58 + i * 0.1 / 86400:.9f}", "--columns time=datenum --units time=day"),
        ("tick", lambda i: f"{1795183387200000000 + i * 100_000_000}", "--columns time=tick --units time=ns"),
        ("Sample", lambda i: f"{i + 7}", '--columns time=Sample --units "time=... s"'),
        ("Label", lambda i: f"{14 + i // 60}:{i % 60:02d}", "--columns time=Label"),
    ],
)
def test_a_table_without_a_time_says_which_column_may_be_one_and_what_to_type(
    tmp_path: Path, head: str, cell: Callable[[int], str], said: str
) -> None:
    table = read(tmp_path, head, cell)
    assert "time" not in table.columns
    assert any(note.startswith("no time is read") and said in note for note in table.notes)
    units = re.search(r"--units (time)=(day|ns)", said)
    if units is not None:
        reading = Reading(columns={"time": head}, units={"time": units[2]})
        np.testing.assert_allclose(np.diff(read(tmp_path, head, cell, reading).columns["time"]), 0.1, atol=2e-4)


def test_nothing_is_said_of_a_time_where_no_column_goes_up(tmp_path: Path) -> None:
    assert not any("no time" in note for note in read(tmp_path, "Remark", lambda i: f"{i % 7}").notes)


@pytest.mark.parametrize("name", ["Step time (s)", "Segment time [s]", "Schrittzeit (s)"])
def test_the_time_of_the_only_step_is_the_time_with_a_note(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, name, lambda i: f"{0.1 * i:.1f}")
    assert_time(table)
    assert any("never begins anew" in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("Step time (s)", lambda i: f"{0.1 * (i % 40):.1f}"),
        ("Step time (s)", lambda i: "30.0"),
        ("Step time", lambda i: f"{0.1 * i:.1f}"),
        ("Step time (N)", lambda i: f"{0.1 * i:.1f}"),
    ],
)
def test_the_time_of_several_steps_or_without_a_unit_is_not_read(tmp_path: Path, name: str, cell: Callable[[int], str]) -> None:
    assert "time" not in read(tmp_path, name, cell).columns


# --- milliseconds in a column of their own ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("head", "whole", "part"),
    [
        ("Time,ms", "%H:%M:%S", lambda t: f"{t.microsecond // 1000}"),
        ("Uhrzeit,Millisekunden", "%H:%M:%S", lambda t: f"{t.microsecond // 1000:03d}"),
        ("Clock,usec", "%H:%M:%S", lambda t: f"{t.microsecond}"),
        ("Date,sub-seconds", "%Y-%m-%d %H:%M:%S", lambda t: f"{t.microsecond / 1e6:.3f}"),
        ("Time,fraction of second", "%I:%M:%S %p", lambda t: f"{t.microsecond // 1000}"),
        ("Timestamp (s),msec", "%s", lambda t: f"{t.microsecond // 1000}"),
    ],
)
def test_a_clock_of_whole_seconds_and_its_milliseconds_are_put_together(
    tmp_path: Path, head: str, whole: str, part: Callable[[datetime], str]
) -> None:
    def cell(i: int) -> str:
        seconds = str(int((stamp(i).replace(microsecond=0) - datetime(1970, 1, 1)).total_seconds()))
        return f"{stamp(i).strftime(whole.replace('%s', seconds))},{part(stamp(i))}"

    table = read(tmp_path, head, cell)
    assert_time(table)
    assert any("put together from both" in note for note in table.notes)


LOGGER = ["CH,Signal,Input,Range,Filter,Span", "CH1,Force,DC,10V,Off,10,0,N", "CH2,Disp,DC,5V,Off,5,0,mm", "Data"]


def without_names(tmp_path: Path, cells: Callable[[int], str], above: Sequence[str] = ()) -> LabTable:
    """A press whose columns are said by number: row, clock, parts of a second, force, displacement."""
    rows = [f"{i + 1},{cells(i)},{f:.4f},{x:.4f}" for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True))]
    path = tmp_path / "logger.csv"
    path.write_text("\n".join([*above, *rows, ""]), encoding="utf-8")
    columns, units = {"force": "4", "displacement": "5"}, {"force": "N", "displacement": "mm"}
    return read_lab_file(path, Reading(columns=columns, units=units))


def whole_and_parts(i: int) -> str:
    return f"{stamp(i):%Y/%m/%d %H:%M:%S},{stamp(i).microsecond // 1000}"


def test_milliseconds_of_a_column_without_a_name_are_put_together_with_the_clock(tmp_path: Path) -> None:
    table = without_names(tmp_path, whole_and_parts)
    assert_time(table)
    assert any("put together from both" in note for note in table.notes)


def test_settings_of_channels_above_the_names_are_no_header_for_columns_that_are_said_by_number(tmp_path: Path) -> None:
    table = without_names(tmp_path, whole_and_parts, [*LOGGER, "Number,Date&Time,ms,CH1,CH2", "NO.,Time,ms,N,mm"])
    assert_time(table)
    assert table.sources["force"].startswith("Force")


@pytest.mark.parametrize("beside", [lambda i: i, lambda i: 999 - i, lambda i: (i * 377) % 1000, lambda i: 900])
def test_a_count_or_a_reading_without_a_name_is_not_added_to_a_clock(tmp_path: Path, beside: Callable[[int], int]) -> None:
    table = without_names(tmp_path, lambda i: f"{stamp(i):%H:%M:%S},{beside(i)}")
    assert set(np.diff(table.columns["time"])) == {0.0, 1.0}


def test_milliseconds_that_do_not_go_on_with_the_clock_are_refused_and_whole_seconds_can_be_taken(tmp_path: Path) -> None:
    def cell(i: int) -> str:
        return f"{stamp(i):%H:%M:%S},{(i * 377) % 1000}"

    with pytest.raises(InputError, match=r"does not go on with it.*--columns time=Time"):
        read(tmp_path, "Time,ms", cell)
    assert_time_of_seconds = read(tmp_path, "Time,ms", cell, Reading(columns={"time": "Time"})).columns["time"]
    assert set(np.diff(assert_time_of_seconds)) == {0.0, 1.0}
    assert "time" not in read(tmp_path, "Time,ms", cell, Reading(columns={"time": "none"})).columns


def test_a_delay_in_milliseconds_beside_a_clock_of_one_row_a_second_is_not_added(tmp_path: Path) -> None:
    table = read(tmp_path, "Time,ms", lambda i: f"{START + timedelta(seconds=i):%H:%M:%S},{120 + (i * 7) % 23}")
    assert_time(table, step=1.0)


def test_frames_that_count_within_a_second_are_no_key_and_channels_of_a_scan_are(tmp_path: Path) -> None:
    assert "time" in read(tmp_path, "Time,Burst", lambda i: f"{stamp(i):%H:%M:%S},{stamp(i).microsecond // 100_000}").columns
    path = tmp_path / "scan.csv"
    rows = [f"{i}.0,{x:.4f},{k},{97 + k + f:.4f}" for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True)) for k in range(4)]
    path.write_text("\n".join(["Time (s),Extension (mm),Burst,Cp (pF)", *rows, ""]), encoding="utf-8")
    with pytest.raises(InputError, match="several records"):
        read_lab_file(path)


@pytest.mark.parametrize(
    ("head", "size"),
    [("tv_sec,tv_usec", 1e6), ("secs,nsecs", 1e9), ("sec,nanosec", 1e9), ("Secs,msecs", 1e3), ("stamp.secs,stamp.nsecs", 1e9)],
)
def test_whole_seconds_and_their_parts_as_computers_give_them_are_the_time(tmp_path: Path, head: str, size: float) -> None:
    def cell(i: int) -> str:
        whole = int((stamp(i).replace(microsecond=0) - datetime(1970, 1, 1)).total_seconds())
        return f"{whole},{round(stamp(i).microsecond * size / 1e6)}"

    table = read(tmp_path, head, cell)
    assert_time(table)
    assert any("put together from both" in note for note in table.notes)


@pytest.mark.parametrize("head", ["Time,Millitm", "Time,Millisecond", "Time,Msec"])
def test_milliseconds_of_a_logger_beside_the_time_of_day_are_put_together(tmp_path: Path, head: str) -> None:
    assert_time(read(tmp_path, head, lambda i: f"{stamp(i):%H:%M:%S},{stamp(i).microsecond // 1000}"))


def test_seconds_within_a_minute_are_no_time(tmp_path: Path) -> None:
    def cell(i: int) -> str:
        return f"{stamp(i).minute},{stamp(i).second},{stamp(i).microsecond // 1000}"

    assert "time" not in read(tmp_path, "min,sec,msec", cell).columns
    assert "time" not in read(tmp_path, "Secs,Remark", lambda i: f"{stamp(i).second},{i % 7}").columns


@pytest.mark.parametrize("day", ["2026-03-01 ", "01.03.2026 ", "2026/03/01 ", ""])
def test_numbers_behind_a_date_and_a_time_without_names_are_refused_with_options_that_read_them(
    tmp_path: Path, day: str
) -> None:
    path = tmp_path / "log.txt"
    path.write_text("".join(f"{day}10:00:{0.1 * k:06.3f} {97.1 + 0.01 * k:.2f}\n" for k in range(60)))
    with pytest.raises(InputError) as error:
        read_lab_file(path)
    columns = {"time": "2", "capacitance": "3"} if day else {"time": "1", "capacitance": "2"}
    (fault,) = error.value.faults
    assert " ".join(f"--columns {quantity}={k}" for quantity, k in columns.items()) in fault.advice
    table = read_lab_file(path, Reading(columns=columns, units={"capacitance": "pF"}))
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * (97.1 + 0.01 * np.arange(60)))
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=1e-6)
