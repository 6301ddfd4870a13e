"""Times of day and numbers under "time": dates, offsets and midnights count, what may be two times or none is refused."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import Reading, read_lab_file
from calib.lab.instruments.clock import read_clock
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.clock_form import form_of_clock

N = 90


def lab_file(tmp_path: Path, name: str, times: Sequence[str], sep: str = ";") -> Path:
    path = tmp_path / "lab.csv"
    rows = (sep.join((t, f"{i * 0.0113:.4f}", f"{0.3 + i * 0.017:.3f}")) for i, t in enumerate(times))
    path.write_text("\n".join((sep.join((name, "Extension (mm)", "Load (N)")), *rows)) + "\n", encoding="utf-8")
    return path


def since_start(tmp_path: Path, name: str, times: Sequence[str], reading: Reading | None = None) -> np.ndarray:
    time = read_lab_file(lab_file(tmp_path, name, times), reading or Reading()).columns["time"]
    return np.asarray(time - time[0])


def refusal(path: Path, reading: Reading | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_lab_file(path, reading or Reading())
    return str(caught.value)


@pytest.mark.parametrize("pause", [0, 3600, 86_400, 86_400 * 3 + 77, 86_400 * 40])
@pytest.mark.parametrize("form", ["%Y-%m-%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S", "%Y-%m-%dT%H:%M:%S+02:00", "%Y/%m/%d %H:%M:%SZ"])
@pytest.mark.parametrize("start", [datetime(2024, 2, 28, 23, 59, 20), datetime(2023, 12, 31, 11, 0)])
def test_pauses_of_days_count_by_the_date(tmp_path: Path, pause: int, form: str, start: datetime) -> None:
    seconds = np.arange(N) + np.where(np.arange(N) >= 50, pause + 0.0, 0.0)
    times = [(start + timedelta(seconds=float(s))).strftime(form) for s in seconds]
    np.testing.assert_allclose(since_start(tmp_path, "Timestamp", times), seconds, atol=1e-6)


@pytest.mark.parametrize("order", [("Date", "Time"), ("Time", "Date")])
def test_a_column_of_dates_beside_the_times_counts_too(tmp_path: Path, order: tuple[str, str]) -> None:
    seconds = np.arange(N) + np.where(np.arange(N) >= 50, 2 * 86_400.0, 0.0)
    stamps = [datetime(2024, 5, 1, 12) + timedelta(seconds=float(s)) for s in seconds]
    cells = {"Date": "%Y-%m-%d", "Time": "%H:%M:%S"}
    times = [";".join(t.strftime(cells[name]) for name in order) for t in stamps]
    np.testing.assert_allclose(since_start(tmp_path, ";".join(order), times), seconds)


def test_day_and_month_are_told_by_a_midnight_and_refused_over_days() -> None:
    late = [datetime(2024, 5, 11, 23, 59, 30) + timedelta(seconds=i) for i in range(60)]
    read = read_clock([t.strftime("%d/%m/%Y %H:%M:%S") for t in late])
    np.testing.assert_allclose(read.seconds - read.seconds[0], np.arange(60))
    assert any("day, month, year" in note for note in read.notes)
    paused = [t + timedelta(days=3 if i > 30 else 0) - timedelta(days=10) for i, t in enumerate(late)]
    assert "day and month" in read_clock([t.strftime("%d/%m/%Y %H:%M:%S") for t in paused]).conflict
    # A day above twelve tells.
    known = [t + timedelta(days=5 if i > 30 else 0) for i, t in enumerate(late)]
    assert not read_clock([t.strftime("%d/%m/%Y %H:%M:%S") for t in known]).conflict


def test_an_offset_that_changes_is_taken_off_and_its_lack_refused() -> None:
    summer = [f"2024-10-27T02:59:{30 + i:02d}+02:00" for i in range(30)]
    winter = [f"2024-10-27T02:00:{i:02d}+01:00" for i in range(30)]
    read = read_clock([*summer, *winter])
    np.testing.assert_allclose(read.seconds - read.seconds[0], np.arange(60))
    assert "set back by an hour" in read_clock([c[:-6] for c in (*summer, *winter)]).conflict
    assert "offset" in read_clock([*summer, *(c[:-6] for c in winter)]).conflict


def _leap(step: float, decimals: int, zone: str = "Z", at: float = 86_400.0, dates: tuple[str, str] = ("", "")) -> list[str]:
    """Times of a clock whose second 60 begins in the twelfth row, at the full minute `at` of its day."""
    cells = []
    for i in range(N):
        s = at + (i - 11) * step
        of_day = s if s < at else s - 1
        leap = at <= s < at + 1
        second, minute = (60 + s - at, int(at - 60) // 60) if leap else (of_day % 60, int(of_day // 60))
        date = dates[int(of_day >= 86_400 and not leap)]
        width = 3 + decimals if decimals else 2
        clock = f"{minute // 60 % 24:02d}:{minute % 60:02d}:{second:0{width}.{decimals}f}"
        cells.append(f"{date}{clock}{zone}")
    return cells


@pytest.mark.parametrize(("step", "decimals"), [(0.05, 2), (0.1, 1), (0.5, 1), (0.7, 1), (1, 0), (2, 0), (5, 0)])
@pytest.mark.parametrize(
    ("zone", "at", "dates"),
    [
        ("Z", 86_400, ("2016-12-31T", "2017-01-01T")),
        ("", 86_400, ("", "")),
        ("+01:00", 3600, ("2017-01-01T", "2017-01-01T")),
        ("+05:30", 19_800, ("2017-01-01 ", "2017-01-01 ")),
        ("", 7200, ("2015-07-01 ", "2015-07-01 ")),
    ],
)
def test_a_leap_second_is_counted(
    tmp_path: Path, step: float, decimals: int, zone: str, at: float, dates: tuple[str, str]
) -> None:
    cells = _leap(step, decimals, zone, at, dates)
    assert ":60" in cells[11]
    np.testing.assert_allclose(since_start(tmp_path, "Timestamp", cells), step * np.arange(N), atol=2e-6)
    notes = " | ".join(read_lab_file(tmp_path / "lab.csv").notes)
    assert f'"{cells[11]}" is a leap second' in notes
    assert "falls back" not in notes


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("minute", ["09:58", "09:59"])
def test_a_second_60_that_a_program_rounded_up_to_is_the_full_minute(tmp_path: Path, step: float, minute: str) -> None:
    start = datetime(2024, 5, 2, 9, int(minute[3:])) + timedelta(seconds=60 - 20 * step)
    cells = [(start + timedelta(seconds=i * step)).strftime("%H:%M:%S.%f")[:10] for i in range(N)]
    cells[20] = f"{minute}:60.0"
    np.testing.assert_allclose(since_start(tmp_path, "Time", cells), step * np.arange(N), atol=2e-6)


def test_a_second_60_that_may_be_either_or_is_none_is_refused() -> None:
    cells = _leap(0.5, 1)
    behind = datetime(2017, 1, 1, 0, 10)
    paused = [*cells[:12], *((behind + timedelta(seconds=0.5 * i)).strftime("%H:%M:%S.%f")[:10] + "Z" for i in range(40))]
    assert "leap second, or a minute that was rounded up" in read_clock(paused).conflict
    damaged = [f"09:58:{0.5 * i:04.1f}" for i in range(N)]
    damaged[30] = "09:58:60.5"
    assert np.flatnonzero(np.isnan(read_clock(damaged).seconds)).tolist() == [30]
    elsewhere = [c.replace("23:59:60", "23:57:60") for c in cells]
    assert np.flatnonzero(np.isnan(read_clock(elsewhere).seconds)).tolist() == [12]


@pytest.mark.parametrize("back", [1.0, 2.0, 30.0, 1500.0])
@pytest.mark.parametrize("before", [60, 20_000])
def test_a_clock_that_goes_back_and_stays_there_is_refused_and_rows_that_changed_places_are_read(
    tmp_path: Path, back: float, before: int
) -> None:
    step = before / 60
    start = datetime(2024, 10, 27, 9)
    times = [start + timedelta(seconds=i * step - (back + step if i > 60 else 0)) for i in range(N)]
    path = lab_file(tmp_path, "Timestamp", [t.isoformat(sep=" ", timespec="milliseconds") for t in times])
    assert ":63:1: " in refusal(path)
    assert "set back" in refusal(path) or "begins anew" in refusal(path)
    assert "time" not in read_lab_file(path, Reading(columns={"time": "none"})).columns
    order = [*range(40), 41, 40, *range(42, N)]
    times = [start + timedelta(seconds=i * step) for i in order]
    np.testing.assert_allclose(
        since_start(tmp_path, "Timestamp", [t.isoformat(sep=" ", timespec="milliseconds") for t in times]),
        step * np.array(order),
        atol=1e-3,
    )


@pytest.mark.parametrize("hour", [0, 1, 2])
def test_a_clock_that_is_set_ahead_at_a_full_hour_of_the_night_is_refused(hour: int) -> None:
    times = [datetime(2024, 3, 31, hour) + timedelta(seconds=0.5 * (i - 30) + (3600 if i >= 30 else 0)) for i in range(60)]
    assert "set ahead by an hour" in read_clock([t.strftime("%H:%M:%S.%f") for t in times]).conflict


@pytest.mark.parametrize("dates", [("", ""), ("2024-05-02 ", "2024-05-03 "), ("2024-05-03 ", "2024-05-03 ")])
@pytest.mark.parametrize("first", [0, 20])
def test_24_00_00_is_the_midnight_that_it_stands_at(dates: tuple[str, str], first: int) -> None:
    times = [datetime(2024, 5, 2, 23, 59, 50) + timedelta(seconds=0.5 * i) for i in range(60)]
    date = "2024-05-02 " if dates[1] else ""
    cells = [(dates[1] if t.day == 3 else date) + t.strftime("%H:%M:%S.%f")[:10] for t in times]
    cells[20] = f"{dates[0]}24:00:00.0"
    read = read_clock(cells[first:])
    np.testing.assert_allclose(read.seconds - read.seconds[0], 0.5 * np.arange(60 - first))
    assert any("read as midnight" in note for note in read.notes)


def test_24_00_00_among_other_hours_is_no_time() -> None:
    cells = [f"14:00:{0.5 * i:04.1f}" for i in range(60)]
    cells[20] = "24:00:00.0"
    assert np.flatnonzero(np.isnan(read_clock(cells).seconds)).tolist() == [20]


def test_a_clock_of_twelve_hours_without_am_and_pm_is_refused() -> None:
    times = [datetime(2024, 5, 1, 12, 59, 30) + timedelta(seconds=i) for i in range(60)]
    assert "am and pm" in read_clock([t.strftime("%I:%M:%S") for t in times]).conflict
    read = read_clock([t.strftime("%I:%M:%S %p") for t in times])
    np.testing.assert_allclose(read.seconds - read.seconds[0], np.arange(60))


@pytest.mark.parametrize("step", [1, 7, 20])
def test_hours_minutes_seconds_are_known_by_going_on_where_a_minute_is_full(step: int) -> None:
    times = [f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in range(0, N * step, step)]
    read = read_clock(times)
    assert not read.conflict
    np.testing.assert_allclose(read.seconds, np.arange(N) * step)


@pytest.mark.parametrize("step", [4, 13, 25, 50])
@pytest.mark.parametrize("base", [25, 100])
def test_minutes_seconds_frames_are_not_read_as_hours(tmp_path: Path, step: int, base: int) -> None:
    counts = [i * min(step, base // 2) for i in range(N)]
    times = [f"{c // base // 60:02d}:{c // base % 60:02d}:{c % base:02d}" for c in counts]
    path = lab_file(tmp_path, "Time", times)
    if base == 100:
        assert "min:s:cs" in refusal(path)
        np.testing.assert_allclose(
            since_start(tmp_path, "Time", times, Reading(units={"time": "min:s:cs"})), np.array(counts) / 100, atol=1e-9
        )
    elif step == 4:
        np.testing.assert_allclose(since_start(tmp_path, "Time", times), np.array(counts) / 25, atol=2e-6)
    else:
        assert "--units time=min:s:frame/25" in refusal(path)
        said = Reading(units={"time": "min:s:frame/25"})
        np.testing.assert_allclose(since_start(tmp_path, "Time", times, said), np.array(counts) / 25, atol=2e-6)


def test_minutes_and_seconds_with_decimals_pass_the_hour() -> None:
    tenths = range(35_950, 35_950 + N)
    read = read_clock([f"{t // 600 % 60:02d}:{t // 10 % 60:02d}.{t % 10}" for t in tenths])
    np.testing.assert_allclose(read.seconds - read.seconds[0], np.arange(N) / 10, atol=1e-9)
    assert any("hour" in note for note in read.notes)


def test_two_parts_are_refused_until_their_form_is_said(tmp_path: Path) -> None:
    times = [f"{s // 60:02d}:{s % 60:02d}" for s in range(N)]
    assert "--units time=min:s" in refusal(lab_file(tmp_path, "Time", times))
    np.testing.assert_allclose(since_start(tmp_path, "Time", times, Reading(units={"time": "min:s"})), np.arange(N))
    np.testing.assert_allclose(since_start(tmp_path, "Time (mm:ss)", times), np.arange(N))
    assert "no unit" in refusal(lab_file(tmp_path, "Time", times), Reading(units={"time": "ms"}))


def test_decimals_that_are_not_filled_up_are_refused() -> None:
    assert "filled up" in read_clock([f"12:00:{ms // 1000:02d}.{ms % 1000}" for ms in range(0, 4500, 50)]).conflict


def test_forms_of_clocks_are_known_by_their_letters() -> None:
    words = ("hh:mm:ss", "h:min:s", "mm:ss.0", "hh:mm", "mm:ss:ff", "s")
    assert [form_of_clock(w) for w in words] == ["h:min:s", "h:min:s", "min:s", "h:min", "other", ""]


# --------------------------------------------------------------------------------------------------------------- numbers


SECONDS = np.arange(N) * 0.1


@pytest.mark.parametrize(
    ("unit", "cells", "word"),
    [
        ("s", [f"{1.7e12 + s * 1000:.0f}" for s in SECONDS], "--units time=ms"),
        ("min", [f"{1.7e9 + s:.1f}" for s in SECONDS], "--units time=s"),
        ("ms", [f"{1.7e9 + s:.1f}" for s in SECONDS], "--units time=s"),
        ("s", [f"{45_000.5 + s / 86_400:.9f}" for s in SECONDS], "days"),
        ("ms", [f"{45_000.5 + s / 86_400:.9f}" for s in SECONDS], "days"),
        ("s", [f"{739_000.5 + s / 86_400:.9f}" for s in SECONDS], "days"),
        ("s", [f"{0.5 + s / 86_400:.10f}" for s in SECONDS], "no time of a press"),
        ("s", ["1.78065E+09"] * N, "digits"),
        ("ms", [f"{1.78065e12 + 1e7 * (i // 40):.5E}" for i in range(N)], "digits"),
        ("s", ["1780650000"] * N, "all times are"),
        ("s", ["1"] * (N // 2) + ["2"] * (N - N // 2), 'all times are "1" or "2"'),
        ("min", [f"{3 * i // N}.0" for i in range(N)], 'all times are "0.0" or "1.0" or "2.0"'),
        ("s", [f"{(i * 37) % 91}.5" for i in range(N)], "falls"),
        ("s", [f"{(datetime(2024, 5, 1, 12, 0, 55) + timedelta(seconds=s)):%H%M%S.%f}" for s in SECONDS], "one number"),
    ],
)
def test_a_time_that_is_no_labs_time_is_refused_and_can_be_left_out(
    tmp_path: Path, unit: str, cells: list[str], word: str
) -> None:
    path = lab_file(tmp_path, f"Time ({unit})", cells)
    assert word in refusal(path)
    table = read_lab_file(path, Reading(columns={"time": "none"}))
    assert set(table.columns) == {"displacement", "force"}
    assert any("time is left out" in note for note in table.notes)


@pytest.mark.parametrize(
    ("unit", "cells"),
    [
        ("ms", [f"{1.7e12 + s * 1000:.0f}" for s in SECONDS]),
        ("s", [f"{1.7e9 + s:.1f}" for s in SECONDS]),
        ("s", [f"{3.8e9 + s:.1f}" for s in SECONDS]),
        ("s", [f"{s - 2:.1f}" for s in SECONDS]),
        ("ms", [f"{(2**32 - 3000 + round(s * 1000)) % 2**32}" for s in SECONDS]),
        ("min", [f"{s / 60:.8f}" for s in SECONDS]),
    ],
)
def test_times_of_any_origin_are_read(tmp_path: Path, unit: str, cells: list[str]) -> None:
    np.testing.assert_allclose(since_start(tmp_path, f"Time ({unit})", cells), SECONDS, atol=2e-6)


def test_a_time_that_falls_once_by_a_little_or_stands_still_is_read_with_a_note(tmp_path: Path) -> None:
    times = [f"{i // 2 - (4 if i > 60 else 0)}.0" for i in range(N)]
    notes = " | ".join(read_lab_file(lab_file(tmp_path, "Time (s)", times)).notes)
    assert "falls back in 1 row(s), the first in line 63" in notes
    assert "is the same as in the row before" in notes


@pytest.mark.parametrize("start", [0, 10])
def test_a_time_that_begins_anew_within_a_record_is_refused_and_not_advised_to_be_left_out(tmp_path: Path, start: int) -> None:
    path = lab_file(tmp_path, "Time (s)", [f"{i if i < 60 else start + i - 60}.0" for i in range(N)])
    with pytest.raises(InputError, match=r":62:1: .*begins anew.*as two files") as error:
        read_lab_file(path)
    assert "time=none" not in str(error.value)
    assert "time" not in read_lab_file(path, Reading(columns={"time": "none"})).columns


@pytest.mark.parametrize(
    ("bits", "low", "unit", "step"), [(16, 0, "ms", 500), (16, -(2**15), "ms", 700), (32, 0, "us", 50_000)]
)
def test_a_time_goes_on_where_its_counter_overflows(tmp_path: Path, bits: int, low: int, unit: str, step: int) -> None:
    counts = [(2**bits - 40 * step + step * i) % 2**bits + low for i in range(N)]
    table = read_lab_file(lab_file(tmp_path, f"Time ({unit})", [str(c) for c in counts]))
    np.testing.assert_allclose(np.diff(table.columns["time"]), step * (1e-3 if unit == "ms" else 1e-6))
    assert f"goes on over an overflow at {2**bits} in line 42" in " | ".join(table.notes)


def test_the_date_of_a_calibration_is_not_the_beginning_of_a_test(tmp_path: Path) -> None:
    path = lab_file(tmp_path, "Time (s)", [f"{s:.1f}" for s in SECONDS])
    text = path.read_text(encoding="utf-8")
    path.write_text("Calibration due: 2026-01-31\nSaved 2024-06-01\nTest start: 2024-05-02 12:30:01\n" + text, encoding="utf-8")
    assert read_lab_file(path).started == datetime(2024, 5, 2, 12, 30, 1)


@pytest.mark.parametrize("name", ["CEST", "PDT", "MEZ", "JST"])
@pytest.mark.parametrize("day", ["2024-06-12 ", ""])
def test_the_name_of_a_time_zone_behind_all_times_is_passed_by_with_a_note(name: str, day: str) -> None:
    read = read_clock([f"{day}14:03:{7 + i // 2:02d}.{5 * (i % 2)} {name}" for i in range(60)])
    np.testing.assert_allclose(np.diff(read.seconds), 0.5)
    assert any(f'"{name}" behind the times is passed by' in note for note in read.notes)


@pytest.mark.parametrize(("one", "other"), [("CEST", "CET"), ("CEST", ""), ("", "CEST")])
def test_a_name_of_a_time_zone_that_changes_is_refused(one: str, other: str) -> None:
    read = read_clock([f"2024-06-12 14:03:{i:02d}.5 {one if i < 30 else other}".strip() for i in range(60)])
    assert "the name of the time zone changes" in read.conflict
    assert read.row == 30


@pytest.mark.parametrize("cell", ["14:03:07 XYZ", "14:03:07 N", "14:03:07 mm", "14:03:07 Z CEST"])
def test_other_letters_behind_a_time_are_no_time_zone(cell: str) -> None:
    assert not is_clock(cell)


@pytest.mark.parametrize("first", [46_085.0, 738_988.4])
def test_days_of_a_spreadsheet_under_the_name_of_a_force_are_refused(tmp_path: Path, first: float) -> None:
    rows = [f"{first + 0.1 * i / 86_400:.10f};{0.0113 * i:.4f};{0.3 + 0.017 * i:.3f}" for i in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Load (N);Extension (mm);Time (s)", *rows]) + "\n")
    assert "as days since 1899 or 0 do" in refusal(path)
    path.write_text("\n".join(["Time (days);Extension (mm);Load (N)", *rows]) + "\n")
    assert read_lab_file(path).columns["force"][0] == pytest.approx(0.3)


def test_minutes_and_seconds_that_have_hours_before_them_from_the_first_full_hour_on_go_on(tmp_path: Path) -> None:
    """As clocks that leave the hours away while there are none: 59:59.9, then 1:00:00.0."""
    since = 3600.0 - 0.1 * (N - 10) + 0.1 * np.arange(N)
    times = [f"{t // 60:.0f}:{t % 60:04.1f}" for t in (since[:-10] + 0.01).tolist()]
    times += [f"1:00:0{0.1 * k:.1f}" for k in range(10)]
    np.testing.assert_allclose(since_start(tmp_path, "Time", times), 0.1 * np.arange(N), atol=0.11)
