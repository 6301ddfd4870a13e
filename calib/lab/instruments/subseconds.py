"""From a clock of whole seconds and a column of their milliseconds to one clock with decimals, or why they do not fit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.clock import WITHOUT, read_clock
from calib.lab.instruments.clock_words import in_figures
from calib.lab.instruments.numbers import to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.times import clocks_by_cells
from calib.lab.instruments.units import is_unit_of, lab_factor
from models.sensor import FloatArray

# Words of a name -> how many of them are a second; 0 where the cells tell.
_PARTS = {
    word: size
    for size, listed in (
        (1e3, "ms msec msecs millis milli millisecond milliseconds millisekunde millisekunden millisecondes milisegundos 毫秒"),
        (1e3, "millitm"),
        (1e6, "us µs usec usecs micros microsecond microseconds mikrosekunden microsecondes 微秒"),
        (1e9, "ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds"),
        (1e2, "cs centiseconds hundredths hundertstel"),
        (1e1, "tenths zehntel"),
        (0.0, "subsec subsecs subsecond subseconds sub fraction fractions fractional frac subsekunden nachkommastellen"),
    )
    for word in listed.split()
}
_OF_TIMES = frozenset(
    ["time", "clock", "zeit", "uhrzeit", "temps", "hora", "of", "the", "a", "in", "part", "der", "tv", "stamp", "header"]
)
_SECONDS = {"s", "sec", "secs", "second", "seconds", "sekunde", "sekunden"}
_BESIDE = _OF_TIMES | _SECONDS
_WHOLE_SECONDS = re.compile(
    r"(?P<clock>.*\d:\d{1,2}:\d{1,2})(?P<end>\s*(?:[AaPp]\.?[Mm]\.?)?\s*(?:Z|UTC|GMT|[+-]\d{2}:?\d{2})?)\s*"
)
_WHOLE = re.compile(r"\s*[+-]?\d+\s*")
_FEWEST = 5
# Falls that damaged cells may make, and by what a step over a full second may be longer than those within one.
_FALLS, _LONGER = 0.01, 3.0
# Steps that differ by less are even [s]: milliseconds are rounded.
_STEADY = 1e-3


@dataclass(frozen=True, eq=False)
class WholeClock:
    """The sheet, its clock with the decimals that stood in a column of their own, and the fault where these do not fit it."""

    sheet: Sheet
    faults: tuple[Fault, ...] = ()


def with_subseconds(sheet: Sheet) -> WholeClock:
    """Put a clock of whole seconds and the column of its milliseconds, or of other parts of a second, together.

    They fit if the parts stay below a second, go on within each second, and begin anew as it is full. A column without a name
    is one of milliseconds where it does all that beside a clock that stands still within each second.

    Parameters
    ----------
    sheet : the record.
    """
    for clock, parts, size in _pairs(sheet):
        shares = _shares(sheet.columns[parts], size)
        if shares is None:
            continue
        cells = _together(sheet.columns[clock], shares)
        seconds = _seconds(cells)
        if np.count_nonzero(np.isfinite(seconds)) < _FEWEST:
            continue
        names = [f'"{sheet.names[i] or f"column {i + 1}"}"' for i in (clock, parts)]
        odd, named = _does_not_fit(seconds, shares), not _without_name(sheet, parts)
        if odd is None and (named or _fills_seconds(seconds, shares)):
            columns = (*sheet.columns[:clock], cells, *sheet.columns[clock + 1 :])
            aside = {**sheet.set_aside, parts: f"the parts of a second of {names[0]}, put together with it"}
            note = f"{names[1]} holds the parts of a second of {names[0]}: the time is put together from both"
            return WholeClock(replace(sheet, columns=columns, set_aside=aside, notes=(*sheet.notes, note)))
        if odd is None or not named:
            continue
        aside = {**sheet.set_aside, parts: f"does not go on with the seconds of {names[0]}"}
        apart = replace(sheet, set_aside=aside)
        if clock in sheet.assigned or "time" in sheet.assigned.values() or odd < 0:
            return WholeClock(apart)
        own = Choice("columns", (sheet.name_for_asking(clock),), "time")
        message = f"column {names[1]} seems to hold the parts of a second of {names[0]}, but does not go on with it here"
        advice = f"Export the time with its decimals in one column; or take whole seconds alone: {own}, {WITHOUT}"
        line = int(sheet.lines[odd])
        return WholeClock(apart, (Fault(message, sheet.text.path, line, parts + 1, advice=advice, choice=own),))
    return WholeClock(sheet)


def _pairs(sheet: Sheet) -> Iterator[tuple[int, int, float]]:
    """Columns of whole seconds, each with one that is called after parts of a second, and how many of these are one."""
    named = {i: size for i, name in enumerate(sheet.names) if (size := _named_parts(name, sheet.names)) is not None}
    if not named:
        cells = {
            i: sheet.columns[i][0].strip() for i in range(len(sheet.names)) if sheet.columns[i] and _without_name(sheet, i)
        }
        named = {i: 1e3 for i, cell in cells.items() if cell.isdecimal()}
    named = {i: size for i, size in named.items() if i not in sheet.assigned and i not in sheet.set_aside}
    if not named:
        return
    times = [i for i, h in sheet.headings.items() if h.quantity == "time" and i not in named]
    others = [i for i in range(len(sheet.names)) if i not in named and i not in times]
    for clock in times or clocks_by_cells(sheet, others):
        seen = [c for c in sheet.columns[clock][:50] if c.strip()]
        heading = sheet.headings.get(clock)
        unit = (heading.unit if heading is not None else "") or sheet.unit_below(clock)
        numbers = is_unit_of(unit, "time") and lab_factor(unit, "time") == 1.0 and all(map(_WHOLE.fullmatch, seen))
        if seen and (numbers or all(_WHOLE_SECONDS.fullmatch(in_figures(c).text) for c in seen)):
            yield from ((clock, parts, size) for parts, size in named.items())


def _without_name(sheet: Sheet, index: int) -> bool:
    """Whether a column has no name, or its number in place of one."""
    return not sheet.names[index] or not sheet.header_line


def _fills_seconds(seconds: FloatArray, shares: FloatArray) -> bool:
    """Whether parts of a second go up in each that has several, as milliseconds alone do, and reach beyond half of one."""
    whole = seconds - shares
    within = np.diff(whole) == 0
    return bool(np.count_nonzero(within) >= _FEWEST and np.all(np.diff(shares)[within] > 0) and np.nanmax(shares) > 0.5)


def _named_parts(name: str, names: Sequence[str]) -> float | None:
    """How many of what a column is called after are a second, 0 where its cells tell; None if it is none of parts of one.

    Words before it may be those that stand before the seconds of another column, too: "msg.stamp.nsecs", "msg.stamp.secs".
    """
    found = _words(name)
    sizes = [_PARTS[w] for w in found if w in _PARTS]
    if not sizes:
        return None
    beside = any(
        (own := _words(other))[:-1] == found[:-1] and own[-1:] != found[-1:] and {*own[-1:]} <= _SECONDS for other in names
    )
    return sizes[0] if beside or all(w in _PARTS or w in _BESIDE for w in found) else None


def _words(name: str) -> list[str]:
    return [w for w in re.split(r"[\W_]+", name.lower()) if w]


def _shares(cells: Sequence[str], size: float) -> FloatArray | None:
    """The parts of a second in each row [s], nan where there is none; None if a cell is none, or they pass a second."""
    numbers = to_numbers([c.strip() for c in cells], ".")
    there = numbers.values[np.isfinite(numbers.values)]
    if np.any(numbers.bad) or not there.size or there.min() < 0 or np.ptp(there) == 0:
        return None
    if not size:
        largest = float(there.max())
        size = next(s for s in (1.0, 1e3, 1e6, 1e9) if largest < s or s == 1e9)
    elif np.any(there % 1):
        return None
    return numbers.values / size if there.max() < size else None


def _together(cells: Sequence[str], shares: FloatArray) -> list[str]:
    """Cells of whole seconds with the decimals behind them; empty where one of the two is."""
    whole = []
    for cell, share in zip(cells, shares.tolist(), strict=True):
        figures = in_figures(cell).text
        match = _WHOLE_SECONDS.fullmatch(figures)
        clock, end = (match["clock"], match["end"]) if match is not None else (figures, "")
        decimals = f"{share:.9f}".partition(".")[2] if np.isfinite(share) else ""
        whole.append(f"{clock}.{decimals}{end}" if clock.strip() and decimals else "")
    return whole


def _seconds(cells: Sequence[str]) -> FloatArray:
    there = next((c for c in cells if c), "")
    return read_clock(cells).seconds if ":" in there else to_numbers(cells, ".").values


def _does_not_fit(seconds: FloatArray, shares: FloatArray) -> int | None:
    """The first row from 0 at which parts of seconds do not go on with them; -1 if nothing tells; None if they fit."""
    rows = np.flatnonzero(np.isfinite(seconds))
    time, whole = seconds[rows], seconds[rows] - shares[rows]
    steps, seconds_passed = np.diff(time), np.round(np.diff(whole))
    within, over = seconds_passed == 0, seconds_passed == 1
    if not np.any(within):
        # One reading a second at most: a steadier time shows that the parts are its own.
        steadier = float(np.std(steps)) <= max(float(np.std(seconds_passed)), _STEADY)
        return None if steadier and np.all(steps > 0) else -1
    falls = np.flatnonzero((steps < 0) & within)
    if falls.size > max(1, _FALLS * steps.size):
        return int(rows[falls[0] + 1])
    usual = steps[within & (steps > 0)]
    if np.any(over) and usual.size and float(np.median(steps[over])) > _LONGER * float(np.median(usual)):
        return int(rows[int(np.argmax(over)) + 1])
    return None
