"""From a `Sheet` to a `LabTable`: columns chosen by name, units applied, unusable rows given a reason, faults collected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.choice import choose_columns, holds_clock, missing_columns
from calib.lab.instruments.circuit import untold_circuit
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.keys import several_records
from calib.lab.instruments.labtable import LabTable, Reading, Unread
from calib.lab.instruments.numbers import Notation, clock_seconds, decide_notation, is_missing, to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.size import implausible
from calib.lab.instruments.started import started_at
from calib.lab.instruments.unit_choice import source_of_column, unit_of_column
from calib.lab.instruments.units import IN_PLACE_OF
from calib.lab.instruments.vocabulary import Heading
from calib.lab.instruments.where import rows_asked
from models.sensor import BoolArray, FloatArray

# A reading of 999999 digits is how some LCR meters say that there is none.
_NO_READING = 999999.0
_LCR = ("capacitance", "capacitance_series", "dissipation")
_ESSENTIAL = ("time", "displacement", "force", "capacitance", "capacitance_series")
_STATUS_GOOD = ("0", "+0", "0.0", "ok", "normal", "good", "")


@dataclass(frozen=True)
class _Column:
    """One column that is read: where it stands, what it is, and the factor to SI; `clock` if its cells are times of day."""

    index: int
    heading: Heading
    factor: float
    clock: bool

    @property
    def quantity(self) -> str:
        return self.heading.quantity


def read_columns(sheet: Sheet, family: InstrumentFamily, reason: str, reading: Reading) -> LabTable:
    """Read the columns of a sheet that are understood into SI, with a reason at each row that is not usable.

    Where several columns stand for one quantity the preferred name is taken and the choice noted, or the user is asked; every
    column that is not read is named in `LabTable.unread`, with the reason.

    Parameters
    ----------
    sheet : the record.
    family, reason : what it was recognised as, and why.
    reading : what the user says of the file.

    Raises
    ------
    InputError
        With every fault: a needed column missing, a choice of columns or of rows that the file leaves open, a unit missing, unknown or contradictory, readings of an
        implausible size, text in a number cell, an ambiguous decimal mark.
    """
    choice = choose_columns(sheet, family, reading)
    notes, faults, unread = list(choice.notes), list(choice.faults), dict(choice.unread)
    faults += missing_columns(sheet, family, choice, reading)
    if not family.verified:
        notes.append(f"the layout of {family.name} files is built from what is documented of them: check these numbers once")
    columns: list[_Column] = []
    for quantity, (index, heading) in choice.chosen.items():
        if quantity == "status":
            continue
        clock = quantity == "time" and holds_clock(sheet.columns[index])
        fault, factor = (None, 1.0) if clock else unit_of_column(sheet, index, heading, reading)
        if fault is not None and quantity == "frequency":
            unread[index] = "it has no unit of frequency"
            notes.append(f'"{sheet.names[index]}" left out: it has no unit of frequency')
            continue
        faults += [fault] if fault is not None else []
        columns.append(_Column(index, heading, factor, clock))
        if heading.unit_doubt and fault is None:
            notes.append(f'"{sheet.names[index]}" is read as asked: {heading.unit_doubt}')
    cells = {c.quantity: _cells(sheet, c.index) for c in columns}
    notation = decide_notation([cells[c.quantity] for c in columns if not c.clock], sheet.declared_decimal)
    if notation.conflict:
        raise InputError([*faults, _notation_fault(sheet, notation, [c for c in columns if not c.clock])])
    kept, others, more, open_rows = rows_asked(sheet, reading, notation.decimal)
    notes, faults = notes + more, faults + open_rows
    reasons = others or [""] * len(sheet.lines)
    n_kept = int(np.count_nonzero(kept))
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
        for r in np.flatnonzero(over & kept).tolist():
            _append(reasons, r, f"over-range {own[r].strip()}")
        # A quantity logged at a lower rate than the others leaves most of its cells empty: that makes no row unusable.
        empty &= kept
        n_empty = int(np.count_nonzero(empty))
        if n_kept / 2 < n_empty < n_kept:
            notes.append(f'"{name}" has a value in {n_kept - n_empty} of {n_kept} rows only')
        elif column.quantity in _ESSENTIAL or (column.quantity == "dissipation" and "capacitance_series" in choice.chosen):
            for r in np.flatnonzero(empty).tolist():
                _append(reasons, r, f"empty cell: {column.quantity.removesuffix('_series')}")
        values[column.quantity] = _times(number, column.factor)
        if column.clock:
            notes.append(f'time is taken from the time of day in "{name}"')
    faults = capped(sorted(faults, key=lambda f: (f.line or 0, f.column or 0)), "faults", 12) if len(faults) > 12 else faults
    places = {c.quantity: c.index for c in columns}
    if "quality" in values:
        _invert(values, notes, sheet.names[places["quality"]])
    if "capacitance" in values:
        index, heading = choice.chosen["capacitance"]
        more, unclear = untold_circuit(sheet, index, heading, values.get("dissipation"))
        notes, faults = notes + more, faults + unclear
    if not open_rows:
        faults += several_records(sheet, {q: i for q, (i, _) in choice.chosen.items()}, values, kept)
    if not faults:
        faults += implausible(sheet, values, places, kept, reading)
    if faults:
        raise InputError(faults)
    if "status" in choice.chosen:
        for r, cell in enumerate(_cells(sheet, choice.chosen["status"][0])):
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
            {_held(c.quantity): source_of_column(sheet, c.index, c.heading, reading, clock=c.clock) for c in columns}
        ),
        lines=sheet.lines,
        reasons=tuple(reasons),
        notes=(*sheet.notes, *notes),
        unread=(*sheet.unread, *(_unread(sheet, i, why) for i, why in sorted(unread.items()))),
        started=started_at(sheet, values.get("time")),
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


def _held(quantity: str) -> str:
    return IN_PLACE_OF[quantity] if quantity == "quality" else quantity


def _invert(values: dict[str, FloatArray], notes: list[str], name: str) -> None:
    """Put the dissipation in the place of the quality factor: D = 1/Q."""
    quality = values.pop("quality")
    values["dissipation"] = np.divide(1.0, quality, out=np.full(quality.shape, np.nan), where=quality != 0)
    notes.append(f'dissipation is 1/Q of "{name}"')


def _unread(sheet: Sheet, index: int, reason: str) -> Unread:
    name = sheet.names[index]
    return Unread(f'column {index + 1} "{name}"' if name else f"column {index + 1}", reason)


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
