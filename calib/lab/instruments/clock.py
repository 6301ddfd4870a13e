"""From the cells of a column of times of day to seconds: dates, midnights and offsets counted, what may be two refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.clock_cells import clock_parts
from calib.lab.instruments.clock_ends import leap_second, midnights
from calib.lab.instruments.clock_form import FORMS, clock_form
from calib.lab.instruments.dates import days_since
from models.sensor import FloatArray

_DAY = 86400.0
#: Rows that are out of order are so by less than this [s].
_OUT_OF_ORDER = 3600.0
_SAY = "Say what the parts of the time are: --units time="
#: What is left to a user who can change nothing else.
WITHOUT = "or leave the time out: --columns time=none"
_DATES = f"Write the dates as 2024-05-02, export the time in seconds, {WITHOUT}"
_LOG = f"Log the time in seconds, {WITHOUT}"
_UTC = f"Log the time in seconds or in UTC, split the file there, {WITHOUT}"


@dataclass(frozen=True, eq=False)
class ClockTimes:
    """Times of day, or durations, read as seconds, nan where a cell is none.

    Attributes
    ----------
    seconds : since the first midnight, (n_row,).
    notes : choices that were made.
    conflict, row, advice : why the column cannot be read, at which row from 0, and what to do; "" if it can.
    of_day : whether the times may be of a day, not durations by their form ("0 days 00:00:01", "01:12.5").
    """

    seconds: FloatArray
    notes: tuple[str, ...] = ()
    conflict: str = ""
    row: int = 0
    advice: str = ""
    of_day: bool = True


def read_clock(cells: Sequence[str], dates: Sequence[str] = (), form: str = "") -> ClockTimes:
    """Read times of day as seconds since the first midnight, refusing what may mean two things.

    Without dates a fall by more than half a day is a midnight; with dates the days between them are counted, pauses of days
    included. Offsets from UTC are taken off where they change. Times without hours (`mm:ss.f`) may pass the hour.

    Parameters
    ----------
    cells : of the column, (n_row,).
    dates : those of a column of dates beside it, (n_row,); () without one.
    form : how its parts are to be understood, as `form_of_clock` gives it; "" if nobody says.
    """
    parsed = clock_parts(cells)
    n = len(cells)
    parts, there = parsed.parts, np.isfinite(parsed.parts[:, 0])
    if not np.any(there):
        return ClockTimes(np.full(n, np.nan))
    if 2 * np.count_nonzero(there) < n and 2 * np.count_nonzero(there) < sum(bool(c.strip()) for c in cells):
        row = int(np.argmax(there))
        return ClockTimes(np.full(n, np.nan), conflict="a time of day stands among numbers", row=row, advice="Correct the cell")
    notes: list[str] = []
    before = np.flatnonzero(np.signbit(parts[:, 2]) & there)
    if before.size and (parsed.dates or len(dates)):
        row = int(before[0])
        return ClockTimes(np.full(n, np.nan), conflict="a time of a date has a minus", row=row, advice="Correct the cell")
    if before.size:
        notes.append(f'{before.size} time(s) with a minus, as "{cells[before[0]].strip()}", are read as before zero')
    if len(parsed.called) > 1:
        names = [next((name for name in parsed.called if name and cell.strip().endswith(name)), "") for cell in cells]
        row = next(i for i, name in enumerate(names) if name != names[0])
        several = " and ".join(f'"{name}"' if name else "none" for name in parsed.called)
        return ClockTimes(np.full(n, np.nan), conflict=f"the name of the time zone changes, {several}", row=row, advice=_UTC)
    notes += [f'"{name}" behind the times is passed by, as it stands behind all of them' for name in parsed.called]
    told = clock_form(parsed, dates, form)
    if told.conflict:
        row = int(np.argmax(there))
        advice = f"{_SAY}{told.likely}, {WITHOUT}" if told.likely else _LOG
        return ClockTimes(np.full(n, np.nan), conflict=told.conflict, row=row, advice=advice)
    notes += [f"the times are read as asked, though {told.against}"] if told.against else []
    meant = told.form
    weights = FORMS[meant]
    timed = meant == "h:min:s" and not parsed.long_hours
    if meant in ("h:min:s", "min:s:cs"):
        parts = np.where(np.isnan(parts[:, 2:]), np.nan, parts)  # a part is missing
    written = list(dates) if len(dates) else parsed.dates
    if timed:
        parts, midnight = midnights(parts, written)
        if midnight is not None:
            notes.append(f'"{cells[midnight].strip()}" is read as midnight')
    last = 24 + (parts[:, 1] + parts[:, 2] == 0) if timed else np.inf
    bad = (parts[:, 0] >= last) | (parts[:, 1] >= 60) | ((parts[:, 2] >= 61) & (meant == "h:min:s"))
    parts = np.where(bad[:, np.newaxis], np.nan, parts)
    values = np.asarray(weights[0] * parts[:, 0] + weights[1] * parts[:, 1])
    # "59:59.9" and then "1:00:00.0": from the first full hour on hours stand before the minutes.
    with_hours = np.isfinite(parts[:, 2])
    with_hours &= meant == "min:s" and bool(np.any(np.isfinite(parts[:, 1]) & ~with_hours))
    values = np.where(with_hours, parts @ np.array(FORMS["h:min:s"]), values)
    if weights[2]:
        values = values + weights[2] * parts[:, 2]
    values = values + parsed.fraction
    there = np.isfinite(values)
    unfilled = _unfilled(cells, values)
    if unfilled:
        return ClockTimes(
            values, conflict="the decimals of the seconds are not filled up with zeros", row=unfilled, advice=_LOG
        )
    if not timed:
        if meant == "min:s":
            falls = np.diff(values[there], prepend=values[there][:1]) < -0.8 * 3600
            values[there] += 3600 * np.cumsum(falls)
            and_then = ", falling where an hour is full" if np.any(falls) else ""
            and_then = ", with hours before them where there are three" if np.any(with_hours) else and_then
            notes.append(f"times are read as minutes and seconds{and_then}")
        elif parsed.days:
            notes.append("times are read as days, hours, minutes and seconds")
        elif meant != "h:min:s":
            notes.append(f"times are read as {meant}")
        return ClockTimes(values, tuple(notes), of_day=False)
    days = days_since(written, values)
    if days.conflict:
        return ClockTimes(values, conflict=days.conflict, row=int(np.argmax(there)), advice=_DATES)
    notes += [days.note] if days.note else []
    zones = parsed.zones
    without = there & np.isnan(zones)
    given = zones[there & ~np.isnan(zones)]
    changing = given.size > 0 and bool(np.ptp(given) > 0)
    if given.size and np.any(without):
        row = int(np.flatnonzero(without)[0])
        return ClockTimes(values, conflict="some times have an offset from UTC and some have none", row=row, advice=_UTC)
    if changing:
        values = values - zones + np.nanmin(zones)
        notes.append("the offset from UTC changes among the times; it is taken off")
    if days.days is not None:
        values = values + _DAY * days.days
    else:
        steps = np.diff(values[there], prepend=values[there][:1])
        falls = steps < -_DAY / 2
        # No pause is told from a row that stands a little too late, in the new day: it ran backwards over midnight.
        values[there] += _DAY * np.cumsum(falls.astype(float) - (steps > _DAY - _OUT_OF_ORDER))
        if np.any(falls):
            notes.append("time passes midnight, where it falls by nearly a day")
    sixty = leap_second(values, parts, zones)
    values = sixty.seconds
    if sixty.conflict and sixty.row is not None:
        return ClockTimes(values, tuple(notes), sixty.conflict, sixty.row, _LOG)
    if sixty.row is not None:
        notes.append(f'"{cells[sixty.row].strip()}" is a leap second: what is behind it is a second later than its clock says')
    conflict, row = _set_back(values, changing=changing)
    return ClockTimes(values, tuple(notes), conflict, row, _UTC if conflict else "")


def _unfilled(cells: Sequence[str], values: FloatArray) -> int:
    """A row where time falls within a second as decimals do that are not filled up (1.50, then 1.100); 0 if there is none."""
    falls = np.flatnonzero((np.diff(values) < 0) & (np.diff(values) > -1))
    if falls.size < 2 or falls.size > 0.5 * len(cells):
        return 0
    lengths = {len(re.split("[.,]", cells[i + k])[-1]) for i in falls[:20].tolist() for k in (0, 1)}
    return int(falls[0]) + 1 if len(lengths) > 1 else 0


def _set_back(values: FloatArray, *, changing: bool) -> tuple[str, int]:
    """Why a clock was set among the rows, and at which row: by an hour (daylight saving), or by half a day (no am and pm)."""
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    if changing or steps.size < 3:
        return "", 0
    usual = max(float(np.median(np.abs(steps))), 1.0)
    for size, why in (
        (3600.0, "the clock is set back by an hour"),
        (43200.0, "the clock falls by half a day, without am and pm"),
    ):
        back = np.flatnonzero((steps < 0) & (np.abs(steps + size) <= 3 * usual) & (np.abs(steps) > 10 * usual))
        if back.size:
            return why, int(rows[back[0] + 1])
    ahead = np.flatnonzero((np.abs(steps - 3600.0) <= 3 * usual) & (steps > 100 * usual))
    for k in ahead.tolist():
        before, after = values[rows[k]] % _DAY, values[rows[k + 1]] % _DAY
        if 3600 - before % 3600 <= 3 * usual and after % 3600 <= 3 * usual and after < 5 * 3600:
            return "the clock seems to be set ahead by an hour", int(rows[k + 1])
    return "", 0
