"""From the time column of a sheet to seconds, and to what forbids that it is a lab's time: the unit, lost digits, no order."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from itertools import islice

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.clock import WITHOUT, ClockTimes, read_clock
from calib.lab.instruments.clock_cells import is_date, is_full_clock, not_clocks
from calib.lab.instruments.clock_form import form_of_clock
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.rivals import holds_clock
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# Seconds since 1970 of the years 2001 to 2100, in which a record may count its time.
_EPOCH = (1.0e9, 4.2e9)
# The same of the years 2010 to 2036, and days as spreadsheets (since 1899), MATLAB (since the year 0) and astronomers (of
# Julius Scaliger) count them; those count from 1858, too, which short records in seconds may reach.
_NOW, _DAYS = (1.26e9, 2.1e9), ((40_000.0, 50_000.0), (730_000.0, 750_000.0), (2_455_000.0, 2_465_000.0))
_MODIFIED = (55_000.0, 65_000.0)
# No record of a press is sampled faster, is shorter or lasts longer [s]; units finer than a second.
_FASTEST, _SHORTEST, _LONGEST = 1e-6, 1e-3, 3.2e7
_DAY = 86_400.0
# What .NET counts since the year 1 and Windows since 1601 (FILETIME), and how many there are of it in the years 2010 to 2036.
TICK, _TICKS = "100 ns", {"the year 1": (6.339e17, 6.424e17), "1601 (FILETIME)": (1.29e17, 1.373e17)}
# The same at the beginning of 1970, and how many of them are a second.
_TICKS_1970, _TICKS_OF_SECOND = {"the year 1": 621_355_968_000_000_000, "1601 (FILETIME)": 116_444_736_000_000_000}, 10_000_000
_SIZES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# Rows from which on the order of times tells something, and the share of falls among them that is too large.
_FEWEST, _MOST_FALLS = 9, 0.1
# Seconds that move no oftener than this among many rows are no clock's, but number something else.
_FEW_MOVES = 2
# A time that lies so many usual steps ahead is none, where the next goes on from the one before within so many.
_AHEAD, _GOES_ON = 10.0, 3.0
# A time begins anew where it falls by more than so many usual steps, and by such a share of what had passed.
_BACK, _PASSED, _BEHIND = 5.0, 0.2, 5
# Single precision shows where numbers are this far apart in it.
_COARSE = 4.0
_EXPONENT = re.compile(r"[-+]?\d(?:[.,](?P<digits>\d*))?[eEdD](?P<power>[-+]?\d+)\s*")
_WHICH = "Say the unit that is meant: --units time="


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
    heading = sheet.headings.get(index)
    said = asked or (heading.unit if heading is not None and heading.unit else "") or sheet.unit_below(index)
    form = form_of_clock(said)
    if asked and not form:
        return ClockTimes(
            np.full(len(cells), np.nan),
            conflict=f'the times are written with colons, which are in no unit "{asked}"',
            advice="Say --units time=h:min:s, --units time=d:h:min:s, --units time=min:s, "
            "--units time=min:s:cs, --units time=h:min:s:cs, --units time=h:min:s:ms or --units time=h:min:s:frame/25",
        )
    return read_clock(cells, sheet.columns[beside] if beside is not None else (), form)


# Cells at either end of a column that show whether it holds times of day, and the share of all that may be damaged.
_ENDS, _DAMAGED = 50, 0.02


def clocks_by_cells(sheet: Sheet, columns: Sequence[int]) -> list[int]:
    """Find the columns that are clocks by their cells, whatever they are called: times of day throughout, which move.

    Parameters
    ----------
    sheet : the record.
    columns : that may be one, by index.
    """
    return [index for index in columns if _is_clock_throughout(sheet.columns[index])]


def _is_clock_throughout(column: Sequence[str]) -> bool:
    there = [c for c in (*column[:_ENDS], *column[-_ENDS:]) if c.strip()]
    if not there or not all(map(is_full_clock, there)) or len(set(there)) < 2:
        return False
    odd = not_clocks(column, len(column)) or []
    return sum(not is_full_clock(column[r]) for r in odd) <= _DAMAGED * len(column)


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


_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".asc", "")


def _sorting(sheet: Sheet, index: int, cells: Sequence[str], values: FloatArray) -> str:
    """A command that sorts the rows of a text by their time, where that puts them in order; "" where it would not."""
    lines, path = sheet.lines, sheet.text.path
    whole = (
        path.suffix.lower() in _TEXTS and len(sheet.delimiter) == 1 and not any(map(str.strip, sheet.text.lines[lines[-1] :]))
    )
    if not whole or lines[-1] - lines[0] != lines.size - 1 or not np.all(np.isfinite(values)):
        return ""
    if any('"' in sheet.text.lines[line - 1] for line in lines[:3].tolist()):
        return ""
    written = [cell.strip() for cell in cells]
    plain = all(_PLAIN.fullmatch(cell) for cell in written)
    order = np.argsort(values, kind="stable")
    if not plain and [written[k] for k in order.tolist()] != sorted(written):
        return ""
    file, behind = shlex.quote(str(path)), int(lines[0])
    apart = "" if sheet.delimiter == " " else f"-t '{sheet.delimiter}' " if sheet.delimiter != "\t" else "-t $'\\t' "
    by = f"LC_ALL=C sort -s {apart}-k{index + 1},{index + 1}{'g' if plain else ''}"
    return f": (head -n {behind - 1} {file}; tail -n +{behind} {file} | {by}) > sorted.csv"


# A number as `sort -g` reads it.
_PLAIN = re.compile(r"[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")


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

    lost = _lost_digits(cells, rows.tolist(), values[rows])
    if lost:
        return fault(0, lost, f"Export the time with all its digits, such as 1780650000.125, {WITHOUT}")
    moves = np.flatnonzero(steps)
    if rows.size >= _FEWEST * (1 + moves.size) and moves.size <= (_FEW_MOVES if factor else 0):
        found = [f'"{cells[row].strip()}"' for row in rows[[0, *(moves + 1)]]]
        words = f"all times are {' or '.join(dict.fromkeys(found))}"
        return fault(0, words, f"Export the time of each row, name another column of time, {WITHOUT}")
    falls = np.flatnonzero(steps < 0)
    if rows.size >= _FEWEST and falls.size > max(1, _MOST_FALLS * steps.size):
        words = f"time falls at {falls.size} of {steps.size} rows, the first is this"
        advice = f"Sort the rows by their time{_sorting(sheet, index, cells, values)}, or name another column of time"
        return fault(int(falls[0]) + 1, words, advice)
    # The middle one, as a damaged row may hold anything.
    start, largest = float(np.median(time)), float(np.max(np.abs(time)))
    usual = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
    written = cells[rows[0]].strip()
    number, pace = (start / factor, usual / factor) if factor else (0.0, 0.0)
    # Of a unit of days, said or written, the days of a calendar are what else they would be.
    said_days = factor == _DAY and any(low < number < high for low, high in (*_DAYS, _MODIFIED))
    said_ticks = reading.units.get("time") is not None and factor == 1e-7 and _begin_of_ticks(number)
    if largest > _EPOCH[1] and not said_days and not said_ticks:
        words = f'"{written}" would be {start:.4g} s, in no century of ours'
        unit = next((u for u, size in _SIZES.items() if _NOW[0] < number * size < _NOW[1]), "") if number else ""
        if begin := _begin_of_ticks(number):
            ticks = f'If they are ticks of 100 ns since {begin}, say so: --units "time={TICK}"'
            return fault(0, words, f"{ticks}, {WITHOUT}")
        return fault(
            0,
            words,
            f"{_WHICH}{unit} if they count from 1970, {WITHOUT}" if unit else f"Export the time in seconds, {WITHOUT}",
        )
    if factor and counts_clock(time / factor):
        words = f'"{written}" seems to be hours, minutes and seconds written as one number'
        read_so = "Leave its unit out to have it read so, or export" if "time" in reading.units else "Export"
        return fault(0, words, f"{read_so} the time in seconds, {WITHOUT}")
    if "time" in reading.units:
        return []
    if factor != 1.0 and _NOW[0] < number < _NOW[1]:
        words = f'"{written}" may be seconds since 1970, but its unit says otherwise'
        return fault(0, words, f"{_WHICH}s if it is so, or the unit of the header once more if that is right")
    few_days = pace < 0.01 and float(np.ptp(time)) < 3.0 * factor
    if few_days and not said_days and any(low < number < high for low, high in _DAYS):
        words = f'"{written}" seems to be the days of a calendar, as spreadsheets count them'
        return fault(0, words, f"If it is, say so by the unit of time (day), {WITHOUT}")
    span = float(np.ptp(time))
    absurd = usual < _FASTEST or span > _LONGEST or usual > 86_400 or (rows.size >= 2 * _FEWEST and span < _SHORTEST)
    if absurd and not _EPOCH[0] < start:
        words = f"steps of {usual:.3g} s and {span:.3g} s in all are no time of a press"
        return fault(0, words, f"Say the unit that is meant, {WITHOUT}")
    return []


def _begin_of_ticks(number: float) -> str:
    """Since when so many ticks of 100 ns are a time of our days; "" if since no year from which they are counted."""
    return next((begin for begin, (low, high) in _TICKS.items() if low < number < high), "")


def ticks_since_1970(cells: Sequence[str], numbers: FloatArray, factor: float) -> tuple[FloatArray, str] | None:
    """Seconds since 1970 of ticks of 100 ns since another year, to the last tick, and the note on them; None if they are none.

    As numbers of double precision they would be off by up to 64 ticks, and in seconds by 8 microseconds.

    Parameters
    ----------
    cells, numbers : of a time, and what was read of them, nan where there is none, (n_row,).
    factor : from its unit to seconds.
    """
    there = np.flatnonzero(np.isfinite(numbers))
    begin = _begin_of_ticks(float(np.median(numbers[there]))) if there.size and np.isclose(factor, 1e-7, rtol=1e-9) else ""
    if not begin:
        return None
    found = np.full(numbers.size, np.nan)
    for row in there.tolist():
        text = cells[row].strip()
        ticks = int(text) if text.isdecimal() else int(numbers[row])
        found[row] = (ticks - _TICKS_1970[begin]) / _TICKS_OF_SECOND
    return found, f"ticks of {TICK} since {begin} are read as seconds since 1970"


def unit_of_numbers(number: float) -> str:
    """The unit in which a number is a time of our days, since 1970 or in the days of a calendar; "" if it is none.

    >>> unit_of_numbers(1.7952e18), unit_of_numbers(740305.6), unit_of_numbers(2460371.5), unit_of_numbers(12.5)
    ('ns', 'day', 'day', '')
    >>> unit_of_numbers(6.38e17), unit_of_numbers(1.3418e17), unit_of_numbers(5e17)
    ('100 ns', '100 ns', '')
    """
    since_1970 = next((unit for unit, size in _SIZES.items() if _NOW[0] < number * size < _NOW[1]), "")
    if _begin_of_ticks(number):
        return TICK
    return since_1970 or ("day" if any(low < number < high for low, high in _DAYS) else "")


def begins_anew(sheet: Sheet, index: int, values: FloatArray) -> list[Fault]:
    """Refuse a time that begins anew within a record: two records in one, a counter that overflowed, or a clock that was set.

    A single row in another's place, and a time in numbers that falls once by a little, are none of this. Of times of day every
    fall is that the rows behind go on from, such as a second that is shown twice: nothing else makes a clock go back.

    Parameters
    ----------
    sheet, index : the record, and the column of its time.
    values : what was read of it [s], nan where there is none or what there is is not usable, (n_row,).
    """
    rows = np.flatnonzero(np.isfinite(values))
    time = values[rows]
    steps = np.diff(time)
    if rows.size < _FEWEST or not np.any(steps < 0) or not np.any(steps > 0):
        return []
    usual = float(np.median(steps[steps > 0]))
    set_back = _stays_behind(time) if holds_clock(sheet.columns[index]) else np.zeros(0, dtype=np.int64)
    for k in sorted({*np.flatnonzero(steps < -_BACK * usual).tolist(), *set_back[:1].tolist()}):
        passed = float(time[k] - np.min(time[: k + 1]))
        back = -steps[k] <= _BACK * usual or -steps[k] < _PASSED * passed
        if k not in set_back and (back or float(np.median(time[k + 1 : k + 1 + _BEHIND])) > time[k]):
            continue
        row = int(rows[k + 1])
        cell = sheet.columns[index][row].strip()
        why = "the clock was set back, or shows a second twice" if back else "the time begins anew, or a counter overflowed"
        message = f'column "{sheet.names[index]}": "{cell}" is {-steps[k]:.3g} s before the row above: {why}'
        # Rows of two records, one behind the other, are no more of one when the time is left out.
        advice = "Save what is before and behind it as two files, or export a time that goes on" + (
            f", {WITHOUT}" if back else ""
        )
        return [Fault(message, sheet.text.path, int(sheet.lines[row]), index + 1, advice=advice)]
    return []


def _stays_behind(time: FloatArray) -> IntArray:
    """The rows before falls of a time from which the rows behind go on, by the middle ones of three on either side."""
    steps = np.diff(time)
    falls = np.flatnonzero(steps < 0)
    falls = falls[(falls >= 2) & (falls < steps.size - 2)]
    if not falls.size:
        return falls
    pace = float(np.median(steps))
    before, behind = (np.median(time[falls[:, np.newaxis] + np.arange(*of)], axis=1) for of in ((-2, 1), (1, 4)))
    return np.asarray(falls[behind - before - 3 * pace <= 0.5 * (steps[falls] - pace)])


# What counters of milliseconds and microseconds overflow at, and how many usual steps may lie over it where it is short.
_OVERFLOWS, _OVER, _OVER_SHORT = (2.0**32, 2.0**16), 100, 3


def gone_on(sheet: Sheet, index: int, values: FloatArray) -> tuple[FloatArray, list[str]]:
    """Let a time go on where a counter of 32 or 16 bits has overflowed: it falls by nearly 4294967296, or 65536, once or more.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    values : what was read of it in its own unit, (n_row,).

    Returns
    -------
    The times, going on, and a note on each overflow.
    """
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    if not np.any(steps < -0.9 * _OVERFLOWS[-1]):
        return values, []
    usual = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    for overflow in _OVERFLOWS:
        most = _OVER * usual if overflow == _OVERFLOWS[0] else _OVER_SHORT * usual
        over = np.flatnonzero((steps < 0) & (steps > -overflow) & (steps + overflow <= most))
        if not over.size or float(np.ptp(values[rows])) >= overflow or np.any(values[rows] % 1):
            continue
        turned = np.zeros(values.size)
        turned[rows[over + 1]] = overflow
        lines = [int(sheet.lines[rows[k + 1]]) for k in over]
        notes = [f'"{sheet.names[index]}" goes on over an overflow at {overflow:.0f} in line {n}' for n in lines]
        return values + np.cumsum(turned), notes
    return values, []


def above_the_record(sheet: Sheet, values: FloatArray) -> tuple[FloatArray, dict[int, str]]:
    """Take out a first row that is none of the record, such as one of maxima: time falls after it, and never reaches it again.

    Parameters
    ----------
    sheet : the record.
    values : its times, (n_row,).

    Returns
    -------
    The times, nan in that row, and the row from 0 with why it is not usable.
    """
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    if rows.size < _FEWEST or steps[0] >= 0 or np.any(steps[1:] < 0) or values[rows[0]] < values[rows[-1]]:
        return values, {}
    kept = values.copy()
    kept[rows[0]] = np.nan
    return kept, {int(rows[0]): f"line {int(sheet.lines[rows[0]])} is none of the record: time falls after it"}


def out_of_order(sheet: Sheet, values: FloatArray) -> tuple[FloatArray, dict[int, str]]:
    """Take out single times that lie far ahead of the row before, where the row behind goes on from that one.

    Parameters
    ----------
    sheet : the record.
    values : its times, (n_row,).

    Returns
    -------
    The times, nan in such rows, and these from 0 with why they are not usable.
    """
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    if rows.size < _FEWEST or not np.any(steps < 0) or not np.any(steps > 0):
        return values, {}
    usual, over = float(np.median(steps[steps > 0])), values[rows[2:]] - values[rows[:-2]]
    ahead = (steps[:-1] > _AHEAD * usual) & (steps[1:] < 0) & (over > 0) & (over <= _GOES_ON * usual)
    odd = rows[np.flatnonzero(ahead) + 1]
    if not odd.size:
        return values, {}
    kept = values.copy()
    kept[odd] = np.nan
    return kept, {int(r): f"line {int(sheet.lines[r])} lies ahead: the times beside it go on without it" for r in odd}


def time_notes(sheet: Sheet, index: int, values: FloatArray) -> list[str]:
    """Write notes on times that fall or stand still, each with its first line.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    values : what was read of it, nan where there is none or what there is is not usable, (n_row,).
    """
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    notes = []
    for found, what in ((steps < 0, "falls back"), (steps == 0, "is the same as in the row before")):
        many = int(np.count_nonzero(found))
        if many:
            line = int(sheet.lines[rows[int(np.argmax(found)) + 1]])
            notes.append(f'"{sheet.names[index]}" {what} in {many} row(s), the first in line {line}')
    return notes


def copied_rows(values: Mapping[str, FloatArray]) -> list[int]:
    """Rows from 0 that are the row before once more, as of exports that write every reading twice: they tell nothing new.

    Where a time is written too coarsely to tell readings apart some that share one differ, and then none is taken for a copy.

    Parameters
    ----------
    values : what was read, with the time, nan where there is nothing, (n_row,) each.
    """
    if "time" not in values or len(values) < 2:
        return []
    rows = np.array(list(values.values()))
    known = np.isfinite(rows[:, 1:]) | np.isfinite(rows[:, :-1])
    same = np.all((rows[:, 1:] == rows[:, :-1]) | ~known, axis=0)
    at_once = np.diff(values["time"]) == 0
    copies = np.flatnonzero(at_once & same) + 1
    return copies.tolist() if copies.size == np.count_nonzero(at_once) else []


def counts_clock(numbers: FloatArray) -> bool:
    """Whether numbers read as 120059.9, 120100.0: no part of sixty is passed, and they jump by forty where a minute is full."""
    if np.any(numbers < 0) or np.any(numbers >= 240_000) or numbers[-1] < 100:
        return False
    if np.any(numbers % 100 >= 60) or np.any(numbers // 100 % 100 >= 60):
        return False
    steps = np.diff(numbers)
    full = np.flatnonzero(np.diff(numbers // 100) > 0)
    within = np.diff(numbers // 100) == 0
    if not full.size or not np.any(within):
        return False
    usual = float(np.median(steps[within]))
    going_on = 60 - numbers[full] % 100 + numbers[full + 1] % 100
    return bool(np.all(np.abs(going_on - usual) <= 2 * usual + 1e-6)) and usual < 10


def _of_single_precision(cells: Sequence[str], rows: Sequence[int], numbers: FloatArray) -> str:
    """Why times are those of single precision, too few digits for what is counted: most rows share one with the row before."""
    steps = np.abs(np.diff(numbers))
    spacing = np.spacing(np.abs(numbers).astype(np.float32)).astype(float)[1:]
    shared = np.count_nonzero(steps == 0) > steps.size / 2 and np.any(steps)
    if not shared or spacing.min() < _COARSE or np.any(steps % spacing):
        return ""
    return (
        f'"{cells[rows[0]].strip()}" and the others go up in steps of {spacing.min():g}, as numbers of single precision do, '
        "and many rows share one"
    )


def _lost_digits(cells: Sequence[str], rows: Sequence[int], numbers: FloatArray) -> str:
    """Why times with an exponent have too few digits: rows share a time, and times differ by the last digit that is written."""
    if np.all(np.diff(numbers) > 0):
        return ""
    if coarse := _of_single_precision(cells, rows, numbers):
        return coarse
    match = _EXPONENT.fullmatch(cells[rows[0]].strip())
    if match is None or int(match["power"]) - len(match["digits"] or "") < 1:
        return ""
    return f'"{cells[rows[0]].strip()}" seems to have lost its last digits, and many rows share it'
