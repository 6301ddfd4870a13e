"""From a `Sheet` to a `LabTable`: columns chosen by name, units applied, unusable rows given a reason, faults collected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.choice import choose_columns, holds_clock, missing_columns, source_of_column, unit_of_column
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.labtable import LabTable, Reading
from calib.lab.instruments.numbers import Notation, clock_seconds, decide_notation, is_missing, to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.started import started_at
from calib.lab.instruments.units import SI_UNIT
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
    """Read the columns of a sheet that are understood into SI, with a reason at each row that is not usable.

    Where several columns stand for one quantity the preferred name is taken and the choice noted.

    Parameters
    ----------
    sheet : the record.
    family, reason : what it was recognised as, and why.
    reading : what the user says of the file.

    Raises
    ------
    InputError
        With every fault: a needed column missing, a column twice, a unit missing, unknown or contradictory, readings of an
        implausible size, text in a number cell, an ambiguous decimal mark.
    """
    chosen, notes, faults = choose_columns(sheet, reading)
    faults += missing_columns(sheet, family, chosen, reading)
    if not family.verified:
        notes.append(f"the layout of {family.name} files is built from what is documented of them: check these numbers once")
    columns: list[_Column] = []
    for quantity, index in chosen.items():
        if quantity == "status":
            continue
        clock = quantity == "time" and holds_clock(sheet.columns[index])
        fault, factor = (None, 1.0) if clock else unit_of_column(sheet, quantity, index, reading)
        if fault is not None and quantity == "frequency":
            notes.append(f'"{sheet.names[index]}" left out: it has no unit of frequency')
        elif fault is not None:
            faults.append(fault)
            columns.append(_Column(index, quantity, 1.0, clock))
        else:
            columns.append(_Column(index, quantity, factor, clock))
    cells = {c.quantity: _cells(sheet, c.index) for c in columns}
    certain = Notation(sheet.text.decimal) if sheet.text.typed else None
    notation = certain or decide_notation([cells[c.quantity] for c in columns if not c.clock], sheet.declared_decimal)
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
        sources=MappingProxyType(
            {c.quantity: source_of_column(sheet, c.quantity, c.index, reading, clock=c.clock) for c in columns}
        ),
        lines=sheet.lines,
        reasons=tuple(reasons),
        notes=(*sheet.notes, *notes),
        started=started_at(sheet, values.get("time")),
        sign=reading.sign,
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
