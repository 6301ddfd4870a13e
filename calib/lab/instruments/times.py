"""From the time column of a sheet to seconds, and to what forbids that it is a lab's time: the unit, lost digits, no order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import islice

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.clock import ClockTimes, form_of_clock, is_date, read_clock
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# Seconds since 1970 of the years 2001 to 2100, in which a record may count its time.
_EPOCH = (1.0e9, 4.2e9)
# The same of the years 2010 to 2036, and days since 1899 as spreadsheets count them.
_NOW, _NOW_DAYS = (1.26e9, 2.1e9), (40_000.0, 50_000.0)
# No record of a press is sampled faster, or lasts longer [s].
_FASTEST, _LONGEST = 1e-6, 3.2e7
# Rows from which on the order of times tells something, and the share of falls among them that is too large.
_FEWEST, _MOST_FALLS = 9, 0.1
_EXPONENT = re.compile(r"[-+]?\d(?:[.,](?P<digits>\d*))?[eEdD](?P<power>[-+]?\d+)\s*")
_WHICH = "Say the unit that is meant, such as --units time="


def clock_of(sheet: Sheet, index: int, cells: Sequence[str], reading: Reading) -> ClockTimes:
    """Read a column of times of day of a sheet, with the dates that stand in a column beside it.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    cells : of that column.
    reading : what the user says of the file; as the unit of time, a form such as "min:s".
    """
    beside = date_column(sheet, index)
    asked = reading.units.get("time", "")
    heading = sheet.headings().get(index)
    said = asked or (heading.unit if heading is not None and heading.unit else "") or sheet.unit_below(index)
    form = form_of_clock(said)
    if asked and not form:
        return ClockTimes(
            np.full(len(cells), np.nan),
            conflict=f'the times are written with colons, which are in no unit "{asked}"',
            advice="Say --units time=h:min:s, --units time=min:s or --units time=min:s:cs",
        )
    return read_clock(cells, sheet.columns[beside] if beside is not None else (), form)


def date_column(sheet: Sheet, clock: int) -> int | None:
    """Find the column of dates that belongs to one of times of day; None if there is none, or the times have dates.

    Parameters
    ----------
    sheet : the record.
    clock : index of the column of times of day.
    """
    if any("-" in c or "/" in c or c.count(".") > 1 for c in sheet.columns[clock][:50]):
        return None
    for index in sorted(range(len(sheet.columns)), key=lambda i: abs(i - clock)):
        seen = list(islice((c for c in sheet.columns[index] if c.strip()), 50))
        if index != clock and seen and all(map(is_date, seen)) and all(is_date(c) for c in sheet.columns[index] if c.strip()):
            return index
    return None


def time_faults(
    sheet: Sheet, index: int, cells: Sequence[str], values: FloatArray, factor: float, reading: Reading
) -> list[Fault]:
    """List what forbids that a column is the time of a lab's record, each with what to do.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    cells : of that column.
    values : what was read of it in its own unit, nan where there is none or what there is is not usable, (n_row,).
    factor : from its unit to seconds; 0 for times of day, which are read in seconds.
    reading : what the user says of the file: a unit that is said is not doubted.
    """
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < 2:
        return []
    name, time = sheet.names[index], values[rows] * (factor or 1.0)
    steps = np.diff(time)

    def fault(row: int, message: str, advice: str) -> list[Fault]:
        line = int(sheet.lines[rows[row]])
        return [Fault(f'column "{name}": {message}', sheet.text.path, line, index + 1, advice=advice)]

    lost = _lost_digits(cells, rows.tolist(), steps)
    if lost:
        return fault(0, lost, "Export the time with all its digits, such as 1780650000.125, or as seconds since the start")
    if rows.size >= _FEWEST and not np.any(steps):
        words = f'all times are "{cells[rows[0]].strip()}"'
        return fault(0, words, "Export the time of each row, or name another column of time: --columns time=2")
    falls = np.flatnonzero(steps < 0)
    if rows.size >= _FEWEST and falls.size > max(1, _MOST_FALLS * steps.size):
        words = f"time falls at {falls.size} of {steps.size} rows, the first is this"
        return fault(int(falls[0]) + 1, words, "Sort the rows by time, or name the column of time: --columns time=2")
    if "time" in reading.units:
        return []
    start, largest = float(np.min(time)), float(np.max(np.abs(time)))
    usual = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
    written = cells[rows[0]].strip()
    number, pace = (start / factor, usual / factor) if factor else (0.0, 0.0)
    if largest > _EPOCH[1]:
        return fault(0, f'"{written}" would be {start:.4g} s, in no century of ours', f"{_WHICH}ms for milliseconds since 1970")
    if factor != 1.0 and _NOW[0] < number < _NOW[1]:
        words = f'"{written}" may be seconds since 1970, but its unit says otherwise'
        return fault(0, words, f"{_WHICH}s for seconds since 1970, or the unit of the header once more if that is right")
    if _NOW_DAYS[0] < number < _NOW_DAYS[1] and pace < 0.01 and float(np.ptp(time)) < 3.0 * factor:
        words = f'"{written}" seems to be the days since 1899 of a spreadsheet'
        return fault(0, words, f"{_WHICH}day, or the unit of the header once more if that is right")
    if not _EPOCH[0] < start and (usual < _FASTEST or float(np.ptp(time)) > _LONGEST or usual > 86_400):
        words = f"steps of {usual:.3g} s and {float(np.ptp(time)):.3g} s in all are no time of a press"
        return fault(0, words, f"{_WHICH}s or ms")
    return []


def _lost_digits(cells: Sequence[str], rows: Sequence[int], steps: FloatArray) -> str:
    """Why times with an exponent have too few digits: rows share a time, and times differ by the last digit that is written."""
    if np.all(steps > 0):
        return ""
    match = _EXPONENT.fullmatch(cells[rows[0]].strip())
    if match is None or int(match["power"]) - len(match["digits"] or "") < 1:
        return ""
    return f'"{cells[rows[0]].strip()}" has lost its last digits, and many rows share it'
