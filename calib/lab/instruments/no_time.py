"""From a `Sheet` of which no time is read to the note on a column that may be one, and the options by which it is read."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from decimal import Decimal

import numpy as np

from calib.errors import in_shell
from calib.lab.instruments.brackets import unit_of_a_whole
from calib.lab.instruments.clock_cells import is_clock, is_date
from calib.lab.instruments.numbers import numbers_in
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.ticks import Tick, as_written, stated_tick
from calib.lab.instruments.times import gone_on, unit_of_numbers
from calib.lab.instruments.unit_choice import counted_unit
from calib.lab.instruments.units import asked_factor, is_unit_of
from calib.lab.instruments.vocabulary import heading_as
from models.sensor import FloatArray

# "Sample rate: 50 Hz", "Sampling interval [ms];20", "Abtastrate 100 1/s", "Interval,200ms".
_RATE = re.compile(
    r"(?:^[\s\"'#%]*inter[vw]al\w*|\b(?:sampl\w*|scan|acquisition|data|logging|log|record\w*|measur\w*|abtast\w*|mess\w*|échantillonnage|muestreo)[\s_-]*"
    r"(?:acquisition[\s_-]*)?(?:rate|frequency|freq|interval|period|time|rate|frequenz|intervall|d'échantillonnage|step)?)\b"
    r"(?P<between>[^\d]*)(?P<number>\d+(?:[.,]\d+)?)[\s,;]*(?P<unit>[^\W\d]+(?:/s(?:ec)?)?|1/s)?",
    re.IGNORECASE,
)
_UNIT_BEFORE = re.compile(r"[\[(,]\s*(?P<unit>[^\W\d]+(?:/s)?|1/s)\s*[\])]?")
_PER_SECOND = frozenset(
    [
        "hz",
        "khz",
        "s/s",
        "ks/s",
        "sa/s",
        "ksa/s",
        "sps",
        "ksps",
        "1/s",
        "samples/s",
        "samples/sec",
        "pts/s",
        "points/s",
        "readings/s",
    ]
)
# Why a column is not read that may be a time.
_MAY_BE = ("not understood", "names of the rows", "without a name")
# How a note on a time that is not read begins.
_NO_TIME = "no time is read; "
_ITS_UNIT = '--units time=..., s or what one count lasts, as "0.5 ms"'
# Figures with marks between them, as a date or a time of day has: "2024-03-01T10-00-00", "10h 00' 01''".
_LIKE_A_TIME = re.compile(
    r"[^\W\d]{0,3}[ ,.]?\d{1,8}(?:[^\w+]{1,3}|[^\W\d]{1,3}[ .]?)\d{1,6}(?:[^\d+]{1,3}\d{1,9}){1,5}\D{0,3}"
)
# Of so many rows at least, nearly all steps of a column that may be a time go up; cells that show whether it holds clocks.
_FEWEST, _UP, _SEEN = 5, 0.98, 50
# Of the steps of a column that counts the rows so many are one, where some were lost.
_COUNTS = 0.7
# Seconds that a press lasts at least: a column that goes through less, such as days of a year, is not in seconds.
_A_PRESS = 0.05


def note_on_time(sheet: Sheet, used: Collection[int], unread: Mapping[int, str]) -> str:
    """Say of a record without a time which column may be one, and by which options it is read; "" if none may.

    It holds dates or times of day, goes up from row to row, or counts the rows; beside a stated rate that makes a time.

    Parameters
    ----------
    sheet : the record.
    used : indices of the columns that are read.
    unread : index -> why a column is not read.
    """
    counter, rising, falls = None, None, ""
    for index in range(len(sheet.names)):
        why = unread.get(index, "not understood")
        if index in used or index in sheet.set_aside or not why.startswith(_MAY_BE):
            continue
        seen = [c for c in sheet.columns[index][:_SEEN] if c.strip()]
        if seen and len(set(seen)) > 1 and all(is_clock(c) or is_date(c) for c in seen):
            return f'{_NO_TIME}if "{_name(sheet, index)}" is one: {_asked(sheet, index)}'
        if _seem_times(seen):
            return (
                f'{_NO_TIME}if "{_name(sheet, index)}" is one, its cells ("{seen[0].strip()[:40]}") are in a form that '
                f'is not understood: write them as "2024-05-02 12:30:01.5", or in seconds, and then {_asked(sheet, index)}'
            )
        values = _numbers(sheet, index)
        values = values[np.isfinite(values)]
        steps = np.diff(values)
        if values.size < _FEWEST or np.count_nonzero(steps > 0) < _UP * steps.size:
            continue
        if np.all(steps == 1) and np.all(values % 1 == 0):
            counter = index if counter is None else counter
        elif rising is None and (not sheet.unit_written(index) or is_unit_of(sheet.unit_written(index), "time")):
            own = sheet.unit_written(index) or counted_unit(sheet.names[index], "time") or unit_of_a_whole(sheet.names[index])
            own = own or (sheet.names[index] if is_unit_of(sheet.names[index], "time") else "")
            two = heading_as("time", sheet.names[index], sheet.unit_below(index)).unit_doubt.startswith("two units")
            rising = index, "" if two else own or unit_of_numbers(float(values[0])) or _unit_of_fractions(values)
            falls = _where_it_falls(sheet, index)
    tick = stated_tick(sheet.lines_around)
    if rising is not None and not rising[1] and not falls and (lasts := tick or _of_gaps(sheet, rising[0])) is not None:
        asked = f"{_asked(sheet, rising[0])} --units {in_shell(f'time={lasts.unit}')}"
        return (
            f'{_NO_TIME}"{_name(sheet, rising[0])}" rises from row to row as one does, and line {lasts.line} says '
            f'"{lasts.shown}": {asked} reads the time from both'
        )
    if rising is not None:
        unit = f"--units {in_shell(f'time={rising[1]}')}" if rising[1] else _ITS_UNIT
        name, asked = _name(sheet, rising[0]), f"{_asked(sheet, rising[0])} {unit}"
        if falls:
            return (
                f'{_NO_TIME}"{name}" rises from row to row as one does, but {falls}, as where a clock begins anew: '
                "if it is one, the rows before and behind are of two records, or its times there are wrong; save them as two "
                f"files, or correct them, and then {asked}"
            )
        return f'{_NO_TIME}"{name}" rises from row to row as one does: if it is one, {asked}'
    if counter is None:
        return ""
    name, stated = _name(sheet, counter), _stated_step(sheet)
    if stated is None and tick is not None:
        stated = (
            tick.line,
            tick.unit.removesuffix(" s") if tick.unit.endswith(" s") else as_written(Decimal(repr(tick.seconds))),
        )
    if stated is None:
        asked = f'{_asked(sheet, counter)} --units "time=... s", the seconds that one count lasts'
        return f'{_NO_TIME}"{name}" counts the rows: if it is to be the time, {asked}'
    line, step = stated
    asked = f"{_asked(sheet, counter)} --units {in_shell(f'time={step} s')}"
    said = sheet.prelude[line - 1].strip()[:60]
    return f'{_NO_TIME}"{name}" counts the rows and line {line} says "{said}": {asked} reads the time from both'


def counted_time(sheet: Sheet, used: Collection[int], unread: Mapping[int, str]) -> str:
    """What to do about a time that is needed and not there, where a column counts the rows or rises as one; "" if none does.

    Parameters
    ----------
    sheet, used, unread : as of `note_on_time`.
    """
    return note_on_time(sheet, used, unread).removeprefix(_NO_TIME)


def _of_gaps(sheet: Sheet, index: int) -> Tick | None:
    """What one count lasts of a column that counts the rows, but for some that were lost, by a line that says how often."""
    steps = np.diff(_numbers(sheet, index))
    stated = _stated_step(sheet)
    if stated is None or not np.all(steps % 1 == 0) or np.mean(steps == 1) < _COUNTS:
        return None
    line, step = stated
    return Tick(float(step), f"{step} s", line, sheet.prelude[line - 1].strip()[:60])


def _unit_of_fractions(values: FloatArray) -> str:
    """The unit in which numbers with decimals last as long as a press; "" of whole numbers, which may be counts of anything."""
    if not np.any(values % 1):
        return ""
    return "s" if np.ptp(values) > _A_PRESS else "day"


def _seem_times(cells: Sequence[str]) -> bool:
    """Whether cells have the form of a date or a time of day, and go on from row to row in their figures."""
    if len(cells) < _FEWEST or not all(_LIKE_A_TIME.fullmatch(c.strip()) for c in cells):
        return False
    figures = [[int(n) for n in re.findall(r"\d+", c)] for c in cells]
    return figures == sorted(figures) and 2 * len({*cells}) > len(cells)


def _numbers(sheet: Sheet, index: int) -> FloatArray:
    return numbers_in(sheet.columns[index], sheet.declared_decimal)


def _where_it_falls(sheet: Sheet, index: int) -> str:
    """Where a column that rises falls back, in words; "" if it does not, or as a counter that overflows."""
    values, _ = gone_on(sheet, index, _numbers(sheet, index))
    rows = np.flatnonzero(np.isfinite(values))
    fall = np.flatnonzero(np.diff(values[rows]) < 0)
    if not fall.size:
        return ""
    above, row = rows[fall[0] : fall[0] + 2].tolist()
    cells = [f'"{sheet.columns[index][r].strip()[:40]}"' for r in (above, row)]
    return f"falls from {cells[0]} to {cells[1]} in line {int(sheet.lines[row])}"


def _asked(sheet: Sheet, index: int) -> str:
    return f"--columns {in_shell(f'time={sheet.name_for_asking(index)}')}"


def _name(sheet: Sheet, index: int) -> str:
    return sheet.names[index] or f"column {index + 1}"


def _stated_step(sheet: Sheet) -> tuple[int, str] | None:
    """The line from 1 above the header that states how often was read, and the time [s] from one reading to the next."""
    for line, text in enumerate(sheet.prelude, 1):
        match = _RATE.search(text)
        if match is None or not Decimal(match["number"].replace(",", ".")):
            continue
        number = Decimal(match["number"].replace(",", "."))
        before = _UNIT_BEFORE.search(match["between"])
        unit = match["unit"] or (before["unit"] if before is not None else "")
        if unit.lower() in _PER_SECOND:
            return line, as_written(1 / (number * (1000 if unit.lower().startswith("k") else 1)))
        if unit and is_unit_of(unit, "time") and not re.search(r"total|duration|dauer", text, re.IGNORECASE):
            return line, as_written(number * Decimal(repr(asked_factor(unit, "time"))))
    return None
