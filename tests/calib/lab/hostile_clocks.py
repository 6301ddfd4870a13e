"""Files whose time is easily misread: days, offsets from UTC, frames, epochs under another unit, digits that were lost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta, timezone
from typing import Literal

import numpy as np
from hostile_cases import Case, Truth, truth
from hostile_press import content, lines_of, press, si

from calib.lab import AS_FOUND, Reading

KIND = "clocks"
BENIGN = f"benign {KIND}"
May = Literal["must_read", "must_refuse", "may_refuse"]
P = press(120, seed=111)
NOON = datetime(2024, 5, 1, 12, 0, 0)
STEADY = tuple(100 * i for i in range(120))  # [ms]
_TIMELESS = Reading(columns={"time": "none"})


def _known(rows: Sequence[int], ms: Sequence[int] | None) -> Truth:
    rest = {"displacement": si(P.d, "1e-3"), "force": si(P.f)}
    return truth(rows, **rest) if ms is None else truth(rows, time=np.array(ms) / 1000, **rest)


def _clock(
    name: str,
    head: str,
    stamps: Sequence[str],
    ms: Sequence[int] | None,
    may: May,
    *,
    kind: str = KIND,
    sep: str = ",",
    ways: tuple[Reading, ...] = (),
    named: tuple[str, ...] = (),
    told: tuple[str, ...] = (),
    blame: tuple[str, ...] = (),
    reading: Reading = AS_FOUND,
    tolerance: float = 2e-6,
    known: bool = True,
    timeless: bool = False,
    above: tuple[str, ...] = (),
    end: str = "\n",
    why: str = "",
) -> Case:
    """A tester's record whose time is written as `stamps` and is `ms` milliseconds; the header may name several columns.

    What is not `known` must be refused as a time, together with the file or alone; what is `timeless` can be left out as asked.
    """
    d, f = (tuple(x.replace(".", ",") for x in c) if sep == ";" else c for c in (P.d, P.f))
    lines, rows = lines_of([head, "Extension (mm)", "Load (N)"], [stamps, d, f], sep=sep, above=above)
    return Case(
        name,
        kind,
        content(lines, end=end),
        may if known else "may_refuse",
        _known(rows, ms if known else None),
        reading=reading,
        named=named if known else (head,),
        told=told,
        blame=blame or (head, "time"),
        ways_out=(*((way, _known(rows, ms)) for way in ways), *([(_TIMELESS, _known(rows, None))] if timeless else [])),
        time_tolerance=tolerance,
        why=why,
    )


def _stamps(ms: Sequence[int], form: str, start: datetime = NOON) -> tuple[str, ...]:
    """Date and time by strftime; %f1 and %f3 are tenths and milliseconds."""
    times = [start + timedelta(milliseconds=x) for x in ms]
    return tuple(
        t.strftime(form.replace("%f1", f"{t.microsecond // 100000}").replace("%f3", f"{t.microsecond // 1000:03d}"))
        for t in times
    )


def _dates() -> Iterator[Case]:
    day = 86_400_000
    paused = tuple(x + (day if i >= 60 else 0) for i, x in enumerate(STEADY))
    longer = tuple(x + (3 * day + 7000 if i >= 60 else 0) for i, x in enumerate(STEADY))
    iso, german = "%Y-%m-%d %H:%M:%S.%f1", "%d.%m.%Y %H:%M:%S,%f1"
    yield _clock(
        "paused_a_day", "Timestamp", _stamps(paused, iso), paused, "must_read", why="the clock goes on as if nothing was"
    )
    yield _clock("paused_three_days", "Timestamp", _stamps(longer, iso), longer, "must_read")
    yield _clock("paused_a_day_two_columns", "Date,Time", _stamps(paused, iso.replace(" ", ",")), paused, "must_read")
    yield _clock("paused_a_day_time_before_date", "Time,Date", _stamps(paused, "%H:%M:%S.%f1,%Y-%m-%d"), paused, "must_read")
    yield _clock(
        "paused_a_day_german", "Datum;Uhrzeit", _stamps(longer, german.replace(" ", ";")), longer, "must_read", sep=";"
    )
    yield _clock(
        "paused_a_day_far_columns",
        "Date,Operator,Time",
        _stamps(paused, "%Y-%m-%d,Meyer,%H:%M:%S.%f1"),
        paused,
        "must_read",
        named=("Operator",),
    )
    late = NOON + timedelta(hours=11, minutes=59, seconds=54)
    yield _clock("midnight_without_date", "Time", _stamps(STEADY, "%H:%M:%S.%f1", late), STEADY, "must_read", kind=BENIGN)
    yield _clock(
        "midnight_with_date", "Date,Time", _stamps(STEADY, iso.replace(" ", ","), late), STEADY, "must_read", kind=BENIGN
    )
    stale = _stamps(STEADY, "%H:%M:%S.%f1", late)
    yield _clock(
        "midnight_with_date_of_the_start",
        "Date,Time",
        tuple(f"2024-05-01,{x}" for x in stale),
        STEADY,
        "may_refuse",
        why="the date is that of the start in every row: time would fall by a day",
    )
    year = datetime(2023, 12, 31, 23, 59, 54)
    yield _clock("new_year", "Zeitstempel", _stamps(STEADY, german, year), STEADY, "must_read", sep=";", kind=BENIGN)
    leap = datetime(2024, 2, 28, 23, 59, 54)
    yield _clock("end_of_february_and_a_day", "Timestamp", _stamps(paused, iso, leap), paused, "must_read")
    yield _clock(
        "day_and_month_in_doubt",
        "Timestamp",
        _stamps(paused, "%d/%m/%Y %H:%M:%S.%f1"),
        paused,
        "may_refuse",
        timeless=True,
        told=("day|month",),
        why="01/05, then 02/05: a day or a month later",
    )
    ninth = datetime(2024, 9, 30, 12, 0)
    yield _clock(
        "day_first_by_30_09",
        "Timestamp",
        _stamps(paused, "%d/%m/%Y %H:%M:%S.%f1", ninth),
        paused,
        "must_read",
        why="30/09, then 01/10",
    )
    twelfth = datetime(2024, 12, 12, 12, 0)
    yield _clock(
        "month_first_by_12_13",
        "Timestamp",
        _stamps(paused, "%m/%d/%Y %H:%M:%S.%f1", twelfth),
        paused,
        "must_read",
        why="12/12, then 12/13",
    )
    yield _clock(
        "day_and_month_of_one_day", "Timestamp", _stamps(STEADY, "%d/%m/%Y %H:%M:%S.%f1"), STEADY, "must_read", kind=BENIGN
    )
    yield _clock("half_days_over_midnight", "Time", _stamps(STEADY, "%I:%M:%S.%f1 %p", late), STEADY, "must_read", kind=BENIGN)
    one = datetime(2024, 5, 1, 12, 59, 54)
    yield _clock(
        "half_days_at_one",
        "Time",
        _stamps(STEADY, "%I:%M:%S.%f1 %p", one),
        STEADY,
        "must_read",
        kind=BENIGN,
        why="12:59 PM, then 01:00 PM",
    )
    yield _clock(
        "half_days_with_dots",
        "Time",
        tuple(x.replace("PM", "p.m.") for x in _stamps(STEADY, "%I:%M:%S.%f1 %p", one)),
        STEADY,
        "may_refuse",
        why="01:00 p.m. is 13:00",
    )
    noon = datetime(2024, 5, 1, 11, 59, 54)
    yield _clock(
        "half_days_mark_lost",
        "Time",
        _stamps(STEADY, "%I:%M:%S.%f1", one),
        STEADY,
        "may_refuse",
        timeless=True,
        told=("12:59|01:00|1:00|hour|hours|midnight|half",),
        why="12:59:59.9, then 01:00:00.0: no midnight is between",
    )
    yield _clock("half_days_at_noon", "Time", _stamps(STEADY, "%I:%M:%S.%f1 %p", noon), STEADY, "must_read", kind=BENIGN)


def _offsets() -> Iterator[Case]:
    autumn = datetime(2024, 10, 27, 0, 59, 54, tzinfo=UTC)
    times = [autumn + timedelta(milliseconds=x) for x in STEADY]
    turn = datetime(2024, 10, 27, 1, 0, tzinfo=UTC)

    def local(t: datetime) -> datetime:
        return t.astimezone(timezone(timedelta(hours=2 if t < turn else 1)))

    def tenths(t: datetime, form: str) -> str:
        return local(t).strftime(form) + f".{t.microsecond // 100000}"

    def zone(t: datetime, colon: str = ":") -> str:
        return f"+0{2 if t < turn else 1}{colon}00"

    iso = "%Y-%m-%dT%H:%M:%S"
    yield _clock(
        "summer_ends_offset_written",
        "Timestamp",
        [tenths(t, iso) + zone(t) for t in times],
        STEADY,
        "must_read",
        why="02:59:59+02:00, then 02:00:00+01:00",
    )
    yield _clock(
        "summer_ends_offset_no_colon", "Timestamp", [tenths(t, iso) + zone(t, "") for t in times], STEADY, "may_refuse"
    )
    yield _clock(
        "summer_ends_no_offset",
        "Timestamp",
        [tenths(t, "%Y-%m-%d %H:%M:%S") for t in times],
        STEADY,
        "may_refuse",
        timeless=True,
        why="02:59:59.9, then 02:00:00.0 of the same date",
        told=("hour|hours|summer|falls|back",),
    )
    yield _clock(
        "summer_ends_time_only",
        "Time",
        [tenths(t, "%H:%M:%S") for t in times],
        STEADY,
        "may_refuse",
        timeless=True,
        why="an hour back is no midnight",
        told=("hour|hours|summer|falls|back",),
    )
    yield _clock(
        "summer_ends_named_zones",
        "Timestamp",
        [tenths(t, "%Y-%m-%d %H:%M:%S") + (" CEST" if t < turn else " CET") for t in times],
        STEADY,
        "may_refuse",
        timeless=True,
    )
    mixed = [
        tenths(t, iso) + zone(t) if i < 60 else t.strftime(iso) + f".{t.microsecond // 100000}Z" for i, t in enumerate(times)
    ]
    yield _clock("offset_then_zulu", "Timestamp", mixed, STEADY, "may_refuse", why="the logger was set to UTC between two rows")
    plus = _stamps(STEADY, "%Y-%m-%dT%H:%M:%S.%f1+02:00")
    yield _clock("one_offset_throughout", "Timestamp", plus, STEADY, "must_read", kind=BENIGN)
    yield _clock("zulu_throughout", "Timestamp", _stamps(STEADY, "%Y-%m-%dT%H:%M:%S.%f3Z"), STEADY, "must_read", kind=BENIGN)
    moved = [
        x if i % 2 else (NOON + timedelta(hours=3, milliseconds=STEADY[i])).strftime(iso) + f".{STEADY[i] // 100 % 10}+05:00"
        for i, x in enumerate(plus)
    ]
    yield _clock("offsets_alternate", "Timestamp", moved, STEADY, "may_refuse", why="two computers write into one log")


def _colons() -> Iterator[Case]:
    fine = tuple(130 * i for i in range(120))

    def frames(ms: int) -> str:
        return f"{ms // 60000:02d}:{ms // 1000 % 60:02d}:{ms // 10 % 100:02d}"

    yield _clock(
        "minutes_seconds_hundredths",
        "Time",
        [frames(x) for x in fine],
        fine,
        "may_refuse",
        why="00:12:50 is 12.5 s; the third field goes up to 99",
    )
    yield _clock("minutes_seconds_hundredths_named", "Time (mm:ss:ff)", [frames(x) for x in fine], fine, "may_refuse")
    seconds = tuple(500 * i for i in range(120))
    yield _clock(
        "hundredths_below_sixty",
        "Time (mm:ss:ff)",
        [frames(x) for x in seconds],
        seconds,
        "may_refuse",
        why="the third field is 00 or 50: nothing but the name tells",
    )
    yield _clock(
        "hours_minutes_under_mm_ss",
        "Time (mm:ss)",
        [f"{x // 60000:02d}:{x // 1000 % 60:02d}" for x in (1000 * i for i in range(120))],
        tuple(1000 * i for i in range(120)),
        "may_refuse",
        why="01:59 is 119 s",
    )
    yield _clock(
        "colon_before_milliseconds", "Time", [f"12:00:{x // 1000:02d}:{x % 1000:03d}" for x in STEADY], STEADY, "may_refuse"
    )
    unpadded = tuple(50 * i for i in range(120))
    yield _clock(
        "milliseconds_not_padded",
        "Time",
        [f"12:00:{x // 1000:02d}.{x % 1000}" for x in unpadded],
        unpadded,
        "may_refuse",
        timeless=True,
        why="1.50 is 50 ms, 1.100 is 100 ms: as decimals time falls",
    )
    yield _clock(
        "minutes_seconds_tenths",
        "Time",
        [f"{x // 60000}:{x // 1000 % 60:02d}.{x // 100 % 10}" for x in (x + 55000 for x in STEADY)],
        STEADY,
        "may_refuse",
        why="0:59.9, then 1:00.0, as a spreadsheet shows it",
    )
    yield _clock(
        "hour_lost_by_spreadsheet",
        "Time",
        [f"{x // 60000 % 60:02d}:{x // 1000 % 60:02d}.{x // 100 % 10}" for x in (x + 3594000 for x in STEADY)],
        STEADY,
        "may_refuse",
        why="59:59.9, then 00:00.0: an hour, no day, has gone",
    )
    day = 86_394_000
    long = [x + day for x in STEADY]
    yield _clock(
        "elapsed_over_a_day",
        "Elapsed",
        [f"{x // 3600000}:{x // 60000 % 60:02d}:{x // 1000 % 60:02d}.{x // 100 % 10}" for x in long],
        STEADY,
        "may_refuse",
        why="23:59:59.9, then 24:00:00.0",
    )
    far = [x + day + 90_000_000 for x in STEADY]
    yield _clock(
        "elapsed_49_hours",
        "Time (h:mm:ss)",
        [f"{x // 3600000}:{x // 60000 % 60:02d}:{x // 1000 % 60:02d}.{x // 100 % 10}" for x in far],
        STEADY,
        "may_refuse",
        why="48:59:59.9: hours above 24",
    )
    spans = [
        f"{x // 86400000}.{x // 3600000 % 24:02d}:{x // 60000 % 60:02d}:{x // 1000 % 60:02d}.{x // 100 % 10}" for x in long
    ]
    yield _clock("days_before_a_point", "Elapsed", spans, STEADY, "may_refuse", why="0.23:59:59.9, then 1.00:00:00.0 of .NET")
    yield _clock("pandas_timedelta", "Elapsed", [x.replace(".", " days ", 1) for x in spans], STEADY, "may_refuse")
    python = [f'"1 day, {x[3:]}"' if x[0] == "1" else f'"{x[2:]}"' for x in spans]
    yield _clock("python_timedelta", "Elapsed", python, STEADY, "may_refuse", why='"23:59:59.9", then "1 day, 0:00:00.0"')
    yield _clock(
        "hours_and_minutes_only",
        "Time",
        [f"12:{x // 60000:02d}" for x in (700 * i for i in range(120))],
        tuple(700 * i // 60000 * 60000 for i in range(120)),
        "may_refuse",
        why="the seconds were not exported",
        told=("minute|minutes|resolution|equal|same|seconds",),
    )
    yield _clock(
        "comma_before_milliseconds",
        "Uhrzeit",
        [f"12:00:{x // 1000:02d},{x % 1000:03d}" for x in STEADY],
        STEADY,
        "must_read",
        sep=";",
        kind=BENIGN,
    )
    yield _clock(
        "whole_seconds_only",
        "Time",
        [f"12:00:{x // 1000:02d}" for x in STEADY],
        tuple(x // 1000 * 1000 for x in STEADY),
        "must_read",
        kind=BENIGN,
        why="ten readings a second under stamps of one second",
    )
    yield _clock(
        "hours_not_padded",
        "Time",
        [f"9:{59 + x // 60000:02d}:{x // 1000 % 60:02d}.{x // 100 % 10}" for x in STEADY],
        STEADY,
        "must_read",
        kind=BENIGN,
    )


def _numbers() -> Iterator[Case]:
    epoch = 1_714_557_600_000
    s, ms, ns = (Reading(units={"time": unit}) for unit in ("s", "ms", "ns"))
    full = [f"{(epoch + x) // 1000}.{x % 1000:03d}" for x in STEADY]
    whole = [str(epoch + x) for x in STEADY]
    yield _clock(
        "epoch_seconds_under_ms", "Time (ms)", full, STEADY, "must_refuse", known=False, ways=(s,), why="12 ms for a press"
    )
    yield _clock(
        "epoch_milliseconds_under_s",
        "Time (s)",
        whole,
        STEADY,
        "must_refuse",
        known=False,
        ways=(ms,),
        why="a reading every 100 s since the year 56301",
    )
    yield _clock("epoch_milliseconds_no_unit", "timestamp", whole, STEADY, "may_refuse", ways=(ms,))
    yield _clock(
        "epoch_microseconds_under_ms",
        "t_ms",
        [x + "000" for x in whole],
        STEADY,
        "must_refuse",
        known=False,
        ways=(Reading(units={"time": "us"}),),
        tolerance=1e-3,
    )
    yield _clock(
        "epoch_nanoseconds_under_s", "Time (s)", [x + "000000" for x in whole], STEADY, "must_refuse", known=False, ways=(ns,)
    )
    yield _clock("epoch_minutes_name", "Time (min)", full, STEADY, "must_refuse", known=False, ways=(s,))
    yield _clock("epoch_seconds", "Timestamp(s)", full, STEADY, "must_read", kind=BENIGN)
    yield _clock("epoch_milliseconds", "Time (ms)", whole, STEADY, "must_read", kind=BENIGN)
    yield _clock(
        "labview_seconds",
        "Time (s)",
        [f"{3797402400 + x // 1000}.{x % 1000:03d}" for x in STEADY],
        STEADY,
        "must_read",
        kind=BENIGN,
        why="since 1904",
    )
    days = [f"{45413.5 + x / 86_400_000:.10f}" for x in STEADY]
    yield _clock("spreadsheet_days_under_s", "Time (s)", days, STEADY, "must_refuse", known=False, why="0.00014 s for a press")
    yield _clock("spreadsheet_days_under_ms", "t [ms]", days, STEADY, "must_refuse", known=False)
    yield _clock("spreadsheet_days_no_unit", "Time", days, STEADY, "must_refuse", known=False)
    yield _clock(
        "spreadsheet_days_under_h", "Time (h)", days, STEADY, "must_refuse", known=False, why="0.00014 h, that is 0.5 s"
    )
    yield _clock("spreadsheet_days_under_min", "Time (min)", days, STEADY, "must_refuse", known=False)
    yield _clock(
        "fraction_of_a_day_under_s",
        "Time (s)",
        [f"{0.5 + x / 86_400_000:.10f}" for x in STEADY],
        STEADY,
        "must_refuse",
        known=False,
        why="0.5000000000 to 0.5001377315: twelve seconds in days",
    )
    yield _clock(
        "spreadsheet_days_german", "Zeit (s)", [x.replace(".", ",") for x in days], STEADY, "must_refuse", known=False, sep=";"
    )
    yield _clock(
        "matlab_datenum_under_s",
        "Time (s)",
        [f"{739373.5 + x / 86_400_000:.10f}" for x in STEADY],
        STEADY,
        "must_refuse",
        known=False,
    )
    yield _clock(
        "epoch_lost_digits",
        "Time (s)",
        [f"{float(x):.5E}" for x in full],
        None,
        "must_refuse",
        known=False,
        why="1.71456E+09 in every row",
    )
    yield _clock("epoch_lost_digits_ms", "Time (ms)", [f"{float(x):.5E}" for x in whole], None, "must_refuse", known=False)
    yield _clock(
        "labview_lost_digits", "Time (s)", [f"{3797402400 + x / 1000:.6g}" for x in STEADY], None, "must_refuse", known=False
    )
    yield _clock(
        "epoch_lost_digits_german",
        "Zeit (s)",
        [f"{float(x):.5E}".replace(".", ",") for x in full],
        None,
        "must_refuse",
        known=False,
        sep=";",
    )
    yield _clock(
        "epoch_in_float32",
        "Time (s)",
        [f"{float(np.float32(float(x))):.1f}" for x in full],
        None,
        "must_refuse",
        known=False,
        why="single precision: steps of 128 s",
    )
    late = [f"{123456.7 + x / 1000:.6g}" for x in STEADY]
    yield _clock(
        "six_digits_late",
        "Time (s)",
        late,
        tuple(int(x) * 1000 for x in late),
        "may_refuse",
        told=("digits|resolution|equal|same|repeats|steps",),
        why="123457 ten times over: tenths were lost",
    )
    yield _clock(
        "hhmmss_as_number",
        "Time",
        _stamps(STEADY, "%H%M%S.%f1", NOON + timedelta(seconds=54)),
        STEADY,
        "may_refuse",
        why="120059.9, then 120100.0",
    )
    yield _clock(
        "hhmmss_under_s",
        "Time (s)",
        _stamps(STEADY, "%H%M%S.%f1", NOON + timedelta(seconds=54)),
        STEADY,
        "must_refuse",
        known=False,
        why="120059.9, then 120100.0: forty seconds that never were",
    )
    yield _clock(
        "yyyymmddhhmmss",
        "Timestamp",
        _stamps(tuple(1000 * i for i in range(120)), "%Y%m%d%H%M%S"),
        tuple(1000 * i for i in range(120)),
        "may_refuse",
        why="20240501120059, then 20240501120100",
    )
    yield _clock("iso_basic", "Timestamp", _stamps(STEADY, "%Y%m%dT%H%M%S.%f1"), STEADY, "may_refuse")
    wrapped = [str((x + 4_294_961_000) % 2**32) for x in STEADY]
    yield _clock(
        "arduino_millis_overflow",
        "millis (ms)",
        wrapped,
        STEADY,
        "may_refuse",
        told=("overflow|falls|wraps|wrapped|back|4294967296",),
        why="4294967200, then 4",
    )
    yield _clock(
        "arduino_time_overflow", "Time (ms)", wrapped, STEADY, "may_refuse", told=("overflow|falls|wraps|wrapped|back",)
    )
    jumped = tuple(x - (700 if i >= 60 else 0) for i, x in enumerate(STEADY))
    yield _clock(
        "clock_was_set_back",
        "Time (s)",
        [f"{x / 1000:.1f}" for x in jumped],
        jumped,
        "may_refuse",
        told=("falls|back|backwards|order|earlier|decreases",),
        why="time falls by 0.7 s in mid-press",
    )
    constant = ["0.0"] * 120
    yield _clock(
        "time_stands_still", "Time (s)", constant, None, "may_refuse", named=("Time (s)|time",), why="a clock that never ran"
    )
    yield _clock(
        "sample_number_no_time",
        "Sample",
        [str(i) for i in range(120)],
        None,
        "may_refuse",
        named=("Sample",),
        above=("Sample rate: 10 Hz",),
        why="a count is no time",
    )
    yield _clock(
        "scan_number_under_time", "Time (scan)", [str(i) for i in range(120)], None, "may_refuse", named=("Time (scan)",)
    )
    yield _clock("hours", "Time (h)", [f"{x / 3_600_000:.10f}" for x in STEADY], STEADY, "may_refuse", tolerance=2e-6)
    yield _clock(
        "minutes", "Time (min)", [f"{x / 60_000:.8f}" for x in STEADY], STEADY, "must_read", kind=BENIGN, tolerance=2e-6
    )
    yield _clock("microseconds", "Time (us)", [f"{x}000" for x in STEADY], STEADY, "must_read", kind=BENIGN)
    yield _clock("starts_before_zero", "Time (s)", [f"{x / 1000 - 2:.1f}" for x in STEADY], STEADY, "must_read", kind=BENIGN)


def _several_clocks() -> Iterator[Case]:
    elapsed = [f"{x / 1000:.1f}" for x in STEADY]
    coarse = [f"2024-05-01 12:00:{x // 1000:02d}" for x in STEADY]
    yield _clock(
        "stamp_and_elapsed",
        "Timestamp,Elapsed (s)",
        [f"{a},{b}" for a, b in zip(coarse, elapsed, strict=True)],
        STEADY,
        "must_read",
        named=("Timestamp",),
        why="the stamp has whole seconds",
    )
    rough = [f"{x / 1000 + 3.2 + 0.03 * (i % 3):.2f}" for i, x in enumerate(STEADY)]
    yield _clock(
        "time_and_pc_time",
        "Time (s),PC time (s)",
        [f"{a},{b}" for a, b in zip(elapsed, rough, strict=True)],
        STEADY,
        "may_refuse",
        named=("PC time",),
        ways=(Reading(columns={"time": "Time (s)"}),),
    )
    yield _clock(
        "pc_time_and_time",
        "PC time (s),Time (s)",
        [f"{b},{a}" for a, b in zip(elapsed, rough, strict=True)],
        STEADY,
        "may_refuse",
        named=("PC time",),
        ways=(Reading(columns={"time": "Time (s)"}),),
    )
    segment = [f"{(x if i < 72 else x - 7200) / 1000:.1f}" for i, x in enumerate(STEADY)]
    yield _clock(
        "segment_time_and_total_time",
        "Segment time (s),Total time (s)",
        [f"{a},{b}" for a, b in zip(segment, elapsed, strict=True)],
        STEADY,
        "may_refuse",
        named=("Segment time",),
        ways=(Reading(columns={"time": "Total time (s)"}),),
        why="the time of the segment begins again",
    )
    yield _clock(
        "step_time_and_time",
        "Step Time (s),Time (s)",
        [f"{a},{b}" for a, b in zip(segment, elapsed, strict=True)],
        STEADY,
        "must_read",
        named=("Step Time",),
    )
    lines, rows = lines_of(
        ["Instron time (s)", "Extension (mm)", "Load (N)", "LCR time (s)", "Cp (pF)"], [elapsed, P.d, P.f, rough, P.c]
    )
    rest = {"displacement": si(P.d, "1e-3"), "force": si(P.f), "capacitance": si(P.c, "1e-12")}
    press = {q: rest[q] for q in ("displacement", "force")}
    log = {"capacitance": rest["capacitance"]}
    clocks = {
        "Instron time (s)": truth(rows, time=si(elapsed), **press),
        "LCR time (s)": truth(rows, time=si(rough), **log),
    }
    yield Case(
        "two_instruments_two_clocks",
        KIND,
        content(lines),
        "must_refuse",
        None,
        blame=("time", "LCR time (s)"),
        ways_out=tuple((Reading(columns={"time": n}), t) for n, t in clocks.items()),
        why="rows of two instruments pasted side by side, each with its clock",
    )
    lines, rows = lines_of(["Time (s)", "Extension (mm)", "Load (N)", "Time (s)", "Cp (pF)"], [elapsed, P.d, P.f, rough, P.c])
    clocks = {"1": truth(rows, time=si(elapsed), **press), "4": truth(rows, time=si(rough), **log)}
    yield Case(
        "two_clocks_of_one_name",
        KIND,
        content(lines),
        "must_refuse",
        None,
        blame=("Time (s)", "time"),
        ways_out=tuple((Reading(columns={"time": n}), t) for n, t in clocks.items()),
        why="the second instrument's record is pasted beside the first",
    )
    slow = [f"{2 * i / 10:.1f}" if i < 60 else "" for i in range(120)]
    few = [P.c[2 * i] if i < 60 else "" for i in range(120)]
    lines, rows = lines_of(["Time (s)", "Extension (mm)", "Load (N)", "t LCR (s)", "Cp (pF)"], [elapsed, P.d, P.f, slow, few])
    yield Case(
        "two_records_of_unlike_length",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, time=si(elapsed), displacement=rest["displacement"], force=rest["force"]),
        named=("t LCR (s)", "Cp (pF)"),
        blame=("time", "t LCR (s)"),
        why="sixty readings of the meter beside a hundred and twenty of the tester: rows are no pairs",
    )


CASES = (*_dates(), *_offsets(), *_colons(), *_numbers(), *_several_clocks())
