"""From the cells of one column to its readings in SI, with a reason at each row that has none, and the faults of the column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np

from calib.errors import Fault, capped
from calib.lab.instruments.cut_short import cut_short, misprinted
from calib.lab.instruments.doubts import doubtful
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import is_dashes, is_hidden, is_missing, is_numeric, to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.times import (
    above_the_record,
    clock_of,
    gone_on,
    out_of_order,
    ticks_since_1970,
    time_faults,
    time_notes,
)
from calib.lab.instruments.unit_cells import same_word_behind
from calib.lab.instruments.unit_choice import units_to_say
from calib.lab.instruments.units import is_unit_of, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import Heading
from models.sensor import BoolArray, FloatArray

# A reading of 999999 digits is how some LCR meters say that there is none.
_NO_READING = 999999.0
_LCR = ("capacitance", "capacitance_series", "dissipation", "quality")
# What is measured with decimals, and not counted.
_MEASURED = ("time", "displacement", "force", *_LCR)

#: What to do about numbers that cannot be what the instrument wrote.
DAMAGED = (
    "A spreadsheet program may have damaged the numbers: export the file again from the instrument's software, with a decimal "
    "point and without thousands separators"
)

#: How the reason begins where a spreadsheet program wrote what it showed in place of a number.
TOO_NARROW = "the column was too narrow in the spreadsheet for its number:"


@dataclass(frozen=True)
class ReadColumn:
    """One column that is read: where it stands, what it is, and the factor to SI; `clock` if its cells are times of day."""

    index: int
    heading: Heading
    factor: float
    clock: bool

    @property
    def quantity(self) -> str:
        """What the column holds."""
        return self.heading.quantity


@dataclass(frozen=True, eq=False)
class Readings:
    """What the cells of a column hold.

    Attributes
    ----------
    values : in SI, nan where there is none, (n_row,).
    empty : mask of the cells without anything, (n_row,).
    rows : row from 0 and why its reading is not usable.
    notes, faults : on the column.
    """

    values: FloatArray
    empty: BoolArray
    rows: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]
    faults: tuple[Fault, ...]


def readings_of(sheet: Sheet, column: ReadColumn, cells: Sequence[str], decimal: str, reading: Reading) -> Readings:
    """Read the cells of a column into SI.

    Parameters
    ----------
    sheet, column : the record, and which of its columns.
    cells : of the column, (n_row,).
    decimal : its decimal mark, "" for times of day.
    reading : what the user says of the file.
    """
    name = sheet.names[column.index] or f"column {column.index + 1}"
    rows: list[tuple[int, str]] = []
    notes: list[str] = []
    faults: list[Fault] = []
    if column.clock:
        number, empty, over, bad = _clock(sheet, cells, column, reading, faults, notes)
    else:
        number, empty, over, bad = _numbers(cells, column, decimal)
        number[list(sheet.reasons)] = np.nan
        bad[list(sheet.reasons)] = False
        # Who says the unit says what one count of a whole number is worth.
        whole = stands_for(column.quantity) in reading.units or column.quantity not in _MEASURED
        doubts = doubtful(cells, number, decimal, column.quantity, whole=whole)
        if doubts.fault:
            line = int(sheet.lines[doubts.row])
            one_unit = "If it is another unit, write all rows in one unit. " if "another unit" in doubts.fault else ""
            advice = one_unit + _last_digit(sheet, column, cells[doubts.row], doubts.decimals) + DAMAGED
            faults.append(Fault(f'column "{name}": {doubts.fault}', sheet.text.path, line, column.index + 1, advice=advice))
        for r, why in doubts.rows.items():
            number[r] = np.nan
            rows.append((r, why))
        if column.quantity in _MEASURED:
            for r, why in (cut_short(cells, number, decimal) | misprinted(cells, decimal)).items():
                number[r] = np.nan
                rows.append((r, why))
    if column.quantity == "time" and not np.any(bad) and not faults:
        number, told = gone_on(sheet, column.index, number)
        number, first = above_the_record(sheet, number)
        number, ahead = out_of_order(sheet, number)
        rows += (first | ahead).items()
        notes += [*told, *time_notes(sheet, column.index, number)]
        faults += time_faults(sheet, column.index, cells, number, 0.0 if column.clock else column.factor, reading)
    word = same_word_behind(cells) if np.any(bad) and not column.clock else ""
    both, kind = word == "m" and column.quantity == "displacement", column.quantity.replace("_", " ")
    if word and (both or not is_unit_of(word, column.quantity)) and (len(word) > 1 or looks_like_unit(word) or word in "pnuk"):
        shown = f'"{cells[0].strip()[:40]}" in column "{name}", as all others, has "{word}" behind the number'
        what = "may be metres, or thousandths of one" if both else f"is no unit of {kind}"
        faults.append(
            Fault(
                f"{shown}, which {what}",
                sheet.text.path,
                int(sheet.lines[0]),
                column.index + 1,
                advice=f"Say in which unit the numbers are: {units_to_say(column.quantity)}",
            )
        )
        bad[:] = False
    faults += capped(
        [
            Fault(
                f'"{cells[r][:40]}" in column "{name}" is not a number',
                sheet.text.path,
                int(sheet.lines[r]),
                column.index + 1,
                advice="Correct the cell from the instrument's own record, or empty it to leave the row out",
            )
            for r in np.flatnonzero(bad).tolist()
        ],
        "cells are not numbers",
    )
    dashes = np.array([is_dashes(cells[r]) for r in np.flatnonzero(over).tolist()], dtype=bool)
    if len(cells) / 2 < np.count_nonzero(empty) + np.count_nonzero(dashes) < len(cells):
        # A meter that is slower than what is beside it has no reading in most rows: that is none over its range.
        empty[np.flatnonzero(over)[dashes]] = True
        over &= ~empty
    rows += [(r, _without_reading(cells[r].strip())) for r in np.flatnonzero(over).tolist()]
    ticks = ticks_since_1970(cells, number, column.factor) if column.quantity == "time" and not column.clock else None
    notes += [f'"{name}": {ticks[1]}'] if ticks is not None else []
    values = _times(number, column.factor) if ticks is None else ticks[0]
    return Readings(values, empty, tuple(rows), tuple(notes), tuple(faults))


def _without_reading(cell: str) -> str:
    """Why a row is not used whose cell shows that there is no number."""
    if is_hidden(cell):
        return f"{TOO_NARROW} {cell}"
    return f"no reading, {cell}" if cell[:1] in "-−" and is_numeric(cell) else f"over-range {cell}"


def _last_digit(sheet: Sheet, column: ReadColumn, cell: str, decimals: int) -> str:
    """How numbers are read whose marks are lost and which all had so many decimals: by the unit of their last digit."""
    unit = column.heading.unit or sheet.unit_below(column.index)
    if not decimals or not unit or not is_unit_of(unit, column.quantity):
        return ""
    quantity = stands_for(column.quantity)
    number = cell.strip()
    meant = f"{number[:-decimals]}.{number[-decimals:]}"
    return f'If "{number}" is {meant} {unit}, and all have {decimals} decimals: --units "{quantity}=1e-{decimals} {unit}". '


def _numbers(cells: Sequence[str], column: ReadColumn, decimal: str) -> tuple[FloatArray, BoolArray, BoolArray, BoolArray]:
    """Values with nan where there is none, and the masks of empty, over-range and bad cells."""
    numbers = to_numbers(cells, decimal)
    values, over = numbers.values.copy(), numbers.over.copy()
    if column.quantity in _LCR:
        over |= np.abs(values) == _NO_READING
    values[over] = np.nan
    return values, numbers.empty, over, numbers.bad


def _clock(
    sheet: Sheet, cells: Sequence[str], column: ReadColumn, reading: Reading, faults: list[Fault], notes: list[str]
) -> tuple[FloatArray, BoolArray, BoolArray, BoolArray]:
    """Seconds of times of day and the masks as of `_numbers`; a form that may be two is a fault."""
    read = clock_of(sheet, column.index, cells, reading)
    name = sheet.names[column.index] or f"column {column.index + 1}"
    notes += [*read.notes, f'time is taken from the {"time of day" if read.of_day else "durations"} in "{name}"']
    empty = np.isnan(read.seconds)
    none = np.zeros(len(cells), dtype=bool)
    if read.conflict:
        faults.append(
            Fault(
                f'"{cells[read.row].strip()[:40]}" in column "{sheet.names[column.index]}": {read.conflict}',
                sheet.text.path,
                int(sheet.lines[read.row]),
                column.index + 1,
                advice=read.advice,
            )
        )
        return read.seconds, none, none, none
    empty[empty] = [is_missing(c) for c in compress(cells, empty)]
    return read.seconds, empty, none, np.isnan(read.seconds) & ~empty


def _times(values: FloatArray, factor: float) -> FloatArray:
    # Division by an exact power of ten rounds once, multiplication by its inexact inverse twice.
    inverse = float(round(1 / factor)) if factor < 1 else 0.0
    return values / inverse if inverse and 1 / inverse == factor else values * factor
