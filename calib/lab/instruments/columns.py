"""From a `Sheet` to a `LabTable`: columns chosen by name, units applied, unusable rows given a reason, faults collected."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import compress
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.labtable import LabTable, Reading
from calib.lab.instruments.numbers import Notation, clock_seconds, decide_notation, is_clock, is_missing, to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import SI_UNIT, lab_factor
from calib.lab.instruments.vocabulary import EXAMPLE, NEEDS_UNIT, Heading, understood_names
from models.sensor import BoolArray, FloatArray

# A reading of 999999 digits is how some LCR meters say that there is none.
_NO_READING = 999999.0
_LCR = ("capacitance", "capacitance_series", "dissipation")
_ESSENTIAL = ("time", "displacement", "force", "capacitance", "capacitance_series")
_STATUS_GOOD = ("0", "+0", "0.0", "ok", "normal", "good", "")

#: Largest reading, in SI, between which the tests of small soft samples lie: outside of it the unit is wrong.
PLAUSIBLE: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"displacement": (1e-9, 2.0), "force": (1e-6, 1e6), "capacitance": (1e-16, 1e-3), "capacitance_series": (1e-16, 1e-3)}
)


@dataclass(frozen=True)
class _Column:
    """One column that is read: where it stands, what it is, and the factor to SI; `clock` if its cells are times of day."""

    index: int
    quantity: str
    factor: float
    clock: bool


def read_columns(sheet: Sheet, family: InstrumentFamily, reason: str, reading: Reading) -> LabTable:
    """The columns of a sheet that are understood, in SI, with a reason at each row that is not usable.

    Where several columns stand for one quantity the preferred name is taken and the choice noted.

    Raises
    ------
    InputError
        With every fault: a needed column missing, a column twice, a unit missing, unknown or contradictory, readings of an
        implausible size, text in a number cell, an ambiguous decimal mark.
    """
    chosen, notes, faults = _choose(sheet, reading)
    faults += _missing(sheet, family, chosen, reading)
    if not family.verified:
        notes.append(f"the layout of {family.name} files is built from what is documented of them: check these numbers once")
    columns: list[_Column] = []
    for quantity, index in chosen.items():
        if quantity == "status":
            continue
        clock = quantity == "time" and _holds_clock(sheet.columns[index])
        fault, factor = (None, 1.0) if clock else _factor(sheet, quantity, index, reading)
        if fault is not None and quantity == "frequency":
            notes.append(f'"{sheet.names[index]}" left out: it has no unit of frequency')
        elif fault is not None:
            faults.append(fault)
            columns.append(_Column(index, quantity, 1.0, clock))
        else:
            columns.append(_Column(index, quantity, factor, clock))
    cells = {c.quantity: _cells(sheet, c.index) for c in columns}
    notation = decide_notation([cells[c.quantity] for c in columns if not c.clock], sheet.declared_decimal)
    if notation.conflict:
        raise InputError([*faults, _notation_fault(sheet, notation, [c for c in columns if not c.clock])])
    reasons = [""] * len(sheet.lines)
    if sheet.cut_short:
        reasons[-1] = "cut short: the file ends within this row"
    values: dict[str, FloatArray] = {}
    for column in columns:
        name, own = sheet.names[column.index], cells[column.quantity]
        number, empty, over, bad = _numbers(own, column, notation.decimal)
        faults += capped(
            [
                Fault(
                    f'"{own[r][:40]}" in column "{name}" is not a number',
                    sheet.text.path,
                    int(sheet.lines[r]),
                    column.index + 1,
                    advice="Correct the cell from the instrument's own record, or empty it to leave the row out",
                )
                for r in np.flatnonzero(bad).tolist()
            ],
            "cells are not numbers",
        )
        for r in np.flatnonzero(over).tolist():
            _append(reasons, r, f"over-range {own[r].strip()}")
        # A quantity logged at a lower rate than the others leaves most of its cells empty: that makes no row unusable.
        n_empty = int(np.count_nonzero(empty))
        if len(reasons) / 2 < n_empty < len(reasons):
            notes.append(f'"{name}" has a value in {len(reasons) - n_empty} of {len(reasons)} rows only')
        elif column.quantity in _ESSENTIAL or (column.quantity == "dissipation" and "capacitance_series" in chosen):
            for r in np.flatnonzero(empty).tolist():
                _append(reasons, r, f"empty cell: {column.quantity.removesuffix('_series')}")
        values[column.quantity] = _times(number, column.factor)
        if column.clock:
            notes.append(f'time is taken from the time of day in "{name}"')
    faults = capped(sorted(faults, key=lambda f: (f.line or 0, f.column or 0)), "faults", 12) if len(faults) > 12 else faults
    if not faults:
        faults += _implausible(sheet, values, {c.quantity: c.index for c in columns})
    if faults:
        raise InputError(faults)
    if "status" in chosen:
        for r, cell in enumerate(_cells(sheet, chosen["status"])):
            if cell.lower() not in _STATUS_GOOD and not is_missing(cell):
                _append(reasons, r, f"LCR status {cell[:20]}")
    for array in values.values():
        array.flags.writeable = False
    return LabTable(
        path=sheet.text.path,
        sha256=sheet.text.sha256,
        recognised_as=family.name,
        reason=reason,
        encoding=sheet.text.encoding,
        delimiter=sheet.delimiter,
        decimal=notation.decimal,
        columns=MappingProxyType(values),
        sources=MappingProxyType({c.quantity: _source(sheet, c, reading) for c in columns}),
        lines=sheet.lines,
        reasons=tuple(reasons),
        notes=(*sheet.notes, *notes),
        started=_started(sheet, values.get("time")),
    )


def _cells(sheet: Sheet, index: int) -> Sequence[str]:
    cells = sheet.columns[index]
    if not sheet.cut_short:
        return cells
    return [*cells[:-1], ""]


def _numbers(cells: Sequence[str], column: _Column, decimal: str) -> tuple[FloatArray, BoolArray, BoolArray, BoolArray]:
    """Values with nan where there is none, and the masks of empty, over-range and bad cells."""
    if column.clock:
        values = clock_seconds(cells)
        empty = np.isnan(values)
        empty[empty] = [is_missing(c) for c in compress(cells, empty)]
        return values, empty, np.zeros(len(cells), dtype=bool), np.isnan(values) & ~empty
    numbers = to_numbers(cells, decimal)
    values, over = numbers.values.copy(), numbers.over.copy()
    if column.quantity in _LCR:
        over |= np.abs(values) == _NO_READING
    values[over] = np.nan
    return values, numbers.empty, over, numbers.bad


def _append(reasons: list[str], row: int, reason: str) -> None:
    reasons[row] = f"{reasons[row]}; {reason}" if reasons[row] else reason


def _times(values: FloatArray, factor: float) -> FloatArray:
    # Division by an exact power of ten rounds once, multiplication by its inexact inverse twice.
    inverse = float(round(1 / factor)) if factor < 1 else 0.0
    return values / inverse if inverse and 1 / inverse == factor else values * factor


# -------------------------------------------------------------------------------------------------------- which columns


def _choose(sheet: Sheet, reading: Reading) -> tuple[dict[str, int], list[str], list[Fault]]:
    by_quantity: dict[str, list[tuple[int, Heading]]] = {}
    for index, heading in sheet.headings().items():
        by_quantity.setdefault(heading.quantity, []).append((index, heading))
    chosen: dict[str, int] = {}
    notes: list[str] = []
    faults: list[Fault] = []
    for quantity, candidates in by_quantity.items():
        if quantity in reading.columns:
            chosen[quantity] = candidates[0][0]
            notes.append(f'{quantity} is taken from "{sheet.names[candidates[0][0]]}" as asked')
            continue
        if quantity == "time":
            # Seconds are finer than a time of day.
            plain = [c for c in candidates if not _holds_clock(sheet.columns[c[0]])]
            candidates = plain or candidates
        filled = [c for c in candidates if any(cell.strip() for cell in sheet.columns[c[0]])]
        candidates = sorted(filled or candidates, key=lambda c: (c[1].rank, c[0]))
        best, *others = candidates
        chosen[quantity] = best[0]
        same = [i for i, h in others if h.rank == best[1].rank and quantity != "status"]
        twins = [i for i in same if _alike(sheet, i, best[0])]
        faults += [
            Fault(
                f'column "{sheet.names[index]}" appears twice (columns {best[0] + 1} and {index + 1})',
                sheet.text.path,
                sheet.header_line,
                index + 1,
                advice=f"Say which one is meant: --columns {quantity}={best[0] + 1}",
            )
            for index in same
            if index not in twins
        ]
        if twins:
            notes.append(f'"{sheet.names[best[0]]}" stands {len(twins) + 1} times with the same values')
        left_out = [f'"{sheet.names[i]}"' for i, h in others if h.rank != best[1].rank]
        if left_out:
            why = (
                "; the load as the cell read it is preferred, its zero is a parameter of the model"
                if quantity == "force"
                else ""
            )
            notes.append(f'{quantity} is taken from "{sheet.names[best[0]]}", not from {" or ".join(left_out)}{why}')
    return chosen, notes, faults


def _alike(sheet: Sheet, a: int, b: int) -> bool:
    return (
        sheet.columns[a] == sheet.columns[b] and sheet.unit_below(a) == sheet.unit_below(b) and sheet.names[a] == sheet.names[b]
    )


def _holds_clock(cells: Sequence[str]) -> bool:
    return any(map(is_clock, (c for c in cells[:50] if c.strip())))


def _missing(sheet: Sheet, family: InstrumentFamily, chosen: Mapping[str, int], reading: Reading) -> list[Fault]:
    found = frozenset("capacitance" if q == "capacitance_series" else q for q in chosen)
    there = ", ".join(f'"{n}"' for n in sheet.names if n)
    faults = [
        Fault(
            f"no {quantity} column among {there}",
            sheet.text.path,
            sheet.header_line or None,
            advice=f"{quantity.capitalize()} is understood under the names {understood_names(quantity)} and others, "
            f'for example "{EXAMPLE[quantity]}"; or say which column it is: --columns {quantity}=2',
        )
        for quantity in family.requirement(found)
    ]
    faults += [
        Fault(f'there is no {quantity} column to give the unit "{unit}" to', sheet.text.path, sheet.header_line or None)
        for quantity, unit in reading.units.items()
        if quantity not in found
    ]
    return faults


# ----------------------------------------------------------------------------------------------------------------- units


def _asked_unit(quantity: str, reading: Reading) -> str | None:
    return reading.units.get(quantity.removesuffix("_series"))


def _factor(sheet: Sheet, quantity: str, index: int, reading: Reading) -> tuple[Fault | None, float]:
    name, below = sheet.names[index], sheet.unit_below(index)
    heading = sheet.headings()[index]
    inside = heading.unit or ""
    declared, declared_line = sheet.declared_units.get(quantity.removesuffix("_series"), ("", 0))
    line = sheet.units_line if below and sheet.units_line is not None else sheet.header_line
    asked = _asked_unit(quantity, reading)

    def fault(message: str, advice: str) -> tuple[Fault, float]:
        return Fault(message, sheet.text.path, line or None, index + 1, advice), 1.0

    example = f'Write it into the header, for example "{EXAMPLE[quantity]}", or say it: --units {quantity}=...'
    if asked is not None:
        try:
            return None, lab_factor(asked, quantity)
        except ValueError as error:
            return fault(f"the unit asked for: {error}", "See `calib read --help`")
    said = [unit for unit in (inside, below, declared) if unit]
    if not said:
        return fault(f'column "{name}" has no unit', example) if quantity in (*NEEDS_UNIT, "frequency") else (None, 1.0)
    try:
        factors = [lab_factor(unit, quantity) for unit in said]
    except ValueError as error:
        return fault(f'column "{name}": {error}', example)
    if len(set(factors)) > 1 and inside and below and factors[0] != factors[1]:
        return fault(f'column "{name}" has the unit "{inside}" in its name and "{below}" below it', "Correct one of the two")
    if len(set(factors)) > 1:
        return fault(
            f'column "{name}" has the unit "{said[0]}" and "{declared}" is declared in line {declared_line}',
            f"Correct one of the two, or say which is right: --units {quantity}={said[0]}",
        )
    return None, factors[0]


def _source(sheet: Sheet, column: _Column, reading: Reading) -> str:
    name = sheet.names[column.index]
    if not sheet.header_line and name.isdigit():
        name = f"column {name}"
    asked = _asked_unit(column.quantity, reading)
    if asked is not None:
        return f"{name} (read as {asked})"
    below = sheet.unit_below(column.index)
    if below:
        return f"{name} ({below})"
    declared = sheet.declared_units.get(column.quantity.removesuffix("_series"), ("", 0))[0]
    inside = sheet.headings()[column.index].unit
    return f"{name} ({declared}, declared above)" if declared and not inside and not column.clock else name


def _implausible(sheet: Sheet, values: Mapping[str, FloatArray], places: Mapping[str, int]) -> list[Fault]:
    faults = []
    for quantity, (low, high) in PLAUSIBLE.items():
        if quantity not in values:
            continue
        size = np.abs(values[quantity])
        size = np.where(np.isfinite(size), size, 0.0)
        row = int(np.argmax(size))
        top = float(size[row])
        if top == 0.0 or low <= top <= high:
            continue
        si = SI_UNIT[quantity]
        name = sheet.names[places[quantity]]
        faults.append(
            Fault(
                f'column "{name}": the largest reading would be {top:.3g} {si}, which no test of a small sample gives',
                sheet.text.path,
                int(sheet.lines[row]),
                places[quantity] + 1,
                advice=f"Check its unit; say the right one by --units {quantity.removesuffix('_series')}=...",
            )
        )
    return faults


def _notation_fault(sheet: Sheet, notation: Notation, columns: Sequence[_Column]) -> Fault:
    shown = " and ".join(
        f'"{sheet.columns[columns[c].index][r].strip()}" (line {sheet.lines[r]}, column "{sheet.names[columns[c].index]}")'
        for r, c in notation.places
    )
    row, column = notation.places[-1] if notation.places else (0, 0)
    return Fault(
        f"the decimal mark cannot be told: {notation.conflict}: {shown}",
        sheet.text.path,
        int(sheet.lines[row]),
        columns[column].index + 1,
        advice="A spreadsheet program may have damaged the numbers: export the file again from the instrument's "
        "software, with a decimal point and without thousands separators",
    )


# ----------------------------------------------------------------------------------------------------------------- start

_DATE = re.compile(
    r"(?P<a>\d{1,4})(?P<mark>[-/.])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{1,4})(?:[ T]+(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2}))?"
    r"\s*(?P<half>[AaPp][Mm])?)?"
)
_EPOCH = 1e9  # [s] since 1970, in the year 2001: no time since the start of a test


def _started(sheet: Sheet, time: FloatArray | None) -> datetime | None:
    """When the record began: the date in the first row, the first one above the header, or seconds since 1970 (then UTC)."""
    first = sheet.text.lines[int(sheet.lines[0]) - 1] if len(sheet.lines) else ""
    for line in (first, *sheet.prelude[-200:]):
        match = _DATE.search(line)
        found = _date(match) if match else None
        if found is not None:
            return found
    if time is not None and time.size and _EPOCH < time[0] < np.inf:
        return datetime.fromtimestamp(round(float(time[0])), UTC).replace(tzinfo=None)
    return None


def _date(match: re.Match[str]) -> datetime | None:
    a, b, c = int(match["a"]), int(match["b"]), int(match["c"])
    if len(match["a"]) == 4:
        year, month, day = a, b, c
    elif len(match["c"]) == 4 and (match["mark"] == "." or a > 12):
        year, month, day = c, b, a
    elif len(match["c"]) == 4 and (b > 12 or a == b):
        year, month, day = c, a, b
    else:
        return None  # day and month cannot be told apart
    hour = int(match["h"] or 0)
    if match["half"]:
        hour = hour % 12 + (12 if match["half"][0] in "pP" else 0)
    try:
        return datetime(year, month, day, hour, int(match["m"] or 0), int(match["s"] or 0))
    except ValueError:
        return None
