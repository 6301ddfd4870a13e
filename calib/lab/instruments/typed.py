"""From a record cut out of a workbook to the same with every number cell certain: what its types contradict is refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from calib.errors import Choice, Fault, InputError, capped
from calib.lab.instruments.grid import address, column_letters
from calib.lab.instruments.labtable import LabTable, Reading
from calib.lab.instruments.notation import decide_notation
from calib.lab.instruments.numbers import is_numeric, parse_number
from calib.lab.instruments.part import Cell, CellTypes, Part
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.shown import Shown, shown_as
from calib.lab.instruments.units import is_unit_of, lab_factor

# A date before this year in a column of time is a number of days or seconds that the sheet shows as a date.
_OLDEST = 1950
# Whole numbers from here on may be decimals whose mark a spreadsheet program took for one of thousands.
_THOUSANDS = 100
# Quantities beside the readings, of which an error takes no row; so many errors of a column are told one by one.
_BESIDE = ("cycle", "frequency")
_FEW = 3


@dataclass(frozen=True, eq=False)
class Certain:
    """A record whose cells are certain; `notes`; for rows by column and line why they are not usable; were numbers texts."""

    sheet: Sheet
    notes: tuple[str, ...]
    reasons: Mapping[int, Mapping[int, str]]
    of_texts: bool = False


@dataclass(frozen=True)
class _Column:
    """One column that is read: its index, quantity, unit as written ("" without), cells, and their places in the sheet."""

    index: int
    quantity: str
    unit: str
    cells: Sequence[str]
    places: Sequence[Cell]


def certain(sheet: Sheet, types: CellTypes, reading: Reading) -> Certain:
    """Hold the columns of a record against the types of its cells.

    A text that looks like a number is read as one where its column holds nothing else and its mark is clear, or as the user
    says by `Reading.decimal`. A number shown with a unit is read in that unit if the header names no other. Rows with an error,
    or with a formula among measured numbers (a mean, a sum), are not usable.

    Parameters
    ----------
    sheet : the record, whose column and line numbers are those of the sheet.
    types : of the cells of the sheet.
    reading : what the user says of the file.

    Raises
    ------
    InputError
        If a number may have been changed by a spreadsheet program, is shown in another unit than the header names, is a
        date, or is a formula without a result.
    """
    kinds = (types.texts, types.dates, types.shown, types.errors, types.uncalculated, types.formulas)
    marked = {column for kind in kinds for _, column in kind}
    if sheet.delimiter != "\t" or not marked:
        return Certain(sheet, (), MappingProxyType({}))
    columns = list(sheet.columns)
    units = list(sheet.units)
    read: list[_Column] = []
    for index, heading in sheet.headings.items():
        if heading.quantity == "status" or index not in marked:
            continue
        places = [(line, index) for line in sheet.lines.tolist()]
        unit = heading.unit or sheet.unit_below(index)
        read.append(_Column(index, heading.quantity, unit, columns[index], places))
    texts = {column.index: _texts(column, types, typed=sheet.text.typed) for column in read}
    marks, told, doubts = _marks_of_texts(read, texts, reading)
    faults = [replace(fault, path=sheet.text.path) for fault in doubts]
    notes = [*told]
    reasons: dict[int, Mapping[int, str]] = {}
    for column in read:
        index = column.index
        found = [*_uncalculated(column, types), *_dates(column, types)]
        cells, said = _numbers_in_text(column, texts[index], marks.get(index, ""), found)
        notes += said
        cells, unit_shown, said = _as_shown(replace(column, cells=cells), types, reading, found)
        notes += said
        if unit_shown:
            units += [""] * (index + 1 - len(units))
            units[index] = unit_shown
        faults += [replace(fault, path=sheet.text.path) for fault in found]
        columns[index], out = _left_out(replace(column, cells=cells), types)
        if out and column.quantity not in _BESIDE:
            reasons[index] = out
    if faults:
        raise InputError(capped(faults, "cells are in doubt"))
    units_line = sheet.units_line
    if units_line is None and any(units):
        units_line = sheet.header_line
    # What was text is written with a point now; cells with words may hold another mark still.
    left = [i for i, heading in sheet.headings.items() if heading.quantity != "status" and not texts.get(i, _NO_TEXTS).rows]
    pointed = any(of.rows for of in texts.values()) and not any("," in cell for i in left for cell in columns[i])
    whole = replace(
        sheet,
        columns=tuple(columns),
        units=tuple(units),
        units_line=units_line,
        declared_decimal="." if pointed else sheet.declared_decimal,
    )
    return Certain(whole, tuple(notes), MappingProxyType(reasons), any(of.rows for of in texts.values()))


def uncalculated_fault(part: Part) -> Fault | None:
    """The fault of a sheet with formulas that have no result, which may be why it is not understood; None without any."""
    cells = part.types.uncalculated
    if not cells or part.text is None:
        return None
    first = min(cells)
    message = f"{len(cells)} formula(s) have no result, the first in {address(first)}"
    return Fault(message, part.text.path, first[0], first[1] + 1, advice=_CALCULATE)


def with_reasons(table: LabTable, found: Certain) -> LabTable:
    """Put the reasons why rows are not usable, and the notes, into a table that was read.

    A cell of a column that is not read takes no row.

    Parameters
    ----------
    table : of the record.
    found : what the types of its cells say.
    """
    reasons = list(table.reasons)
    unread = {part.what.partition('"')[0].strip() for part in table.unread}
    by_line: dict[int, list[str]] = {}
    for index, own in found.reasons.items():
        for line, reason in own.items() if f"column {index + 1}" not in unread else ():
            by_line.setdefault(line, []).append(reason)
    for row in np.flatnonzero(np.isin(table.lines, list(by_line))).tolist():
        others = [part for part in reasons[row].split("; ") if part and not part.startswith("empty cell")]
        reasons[row] = "; ".join([*others, *by_line[int(table.lines[row])]])
    return replace(table, reasons=tuple(reasons), notes=(*table.notes, *found.notes))


_CALCULATE = "Open the file in a spreadsheet program, save it there, and try again; or export a CSV file"


def _uncalculated(column: _Column, types: CellTypes) -> list[Fault]:
    """The fault of a column of formulas of which none has a result; zeros are what some libraries write for all."""
    missing = [place for place in column.places if place in types.uncalculated]
    pairs = zip(column.places, column.cells, strict=True)
    results = [parse_number(cell, ".") for place, cell in pairs if place in types.formulas]
    n_formula = len(missing) + len(results)
    if n_formula < 2 or 2 * n_formula < len(column.cells) or any(result != 0 for result in results):
        return []
    place = missing[0] if missing else column.places[0]
    what = "no result" if missing else "the result 0"
    return [_fault(place, f"the {n_formula} formulas of the column of {column.quantity} have {what}", _CALCULATE)]


def _dates(column: _Column, types: CellTypes) -> list[Fault]:
    cells = [(place, cell) for place, cell in zip(column.places, column.cells, strict=True) if place in types.dates]
    if column.quantity == "time":
        if 0 < len(cells) < sum(1 for cell in column.cells if cell.strip()):
            cells = [(p, c) for p, c in cells if p in types.dates]
            message = f'"{cells[0][1]}" is a date or time among numbers of another kind'
            return [_fault(cells[0][0], message, _DATED)]
        cells = [(p, c) for p, c in cells if c[:4].isdecimal() and c[4:5] == "-" and int(c[:4]) < _OLDEST]
    return [
        _fault(place, f'"{cell}" is a date (shown as "{types.dates[place]}") where a number is expected', _DATED)
        for place, cell in cells[:1]
    ]


_DATED = (
    "A spreadsheet program may have taken a number for a date: export the file again from the instrument's software; or, if "
    "only the cells' format is wrong, set it to General"
)


_DECIMAL = Choice("decimal", (",", "."))


@dataclass(frozen=True)
class _Texts:
    """The rows of a column with a number written as text, and those with a number of the workbook."""

    rows: Sequence[int]
    typed: Sequence[int]


_NO_TEXTS = _Texts((), ())


def _texts(column: _Column, types: CellTypes, *, typed: bool) -> _Texts:
    """Which numbers of a column are text: if any is and no cell of the sheet is `typed`, whole numbers are, too."""
    marked = {i for i, place in enumerate(column.places) if place in types.texts}
    if not marked:
        return _NO_TEXTS
    others = [i for i, cell in enumerate(column.cells) if i not in marked and is_numeric(cell)]
    return _Texts(sorted(marked), others) if typed else _Texts(sorted([*marked, *others]), ())


def _marks_of_texts(
    columns: Sequence[_Column], texts: Mapping[int, _Texts], reading: Reading
) -> tuple[dict[int, str], tuple[str, ...], list[Fault]]:
    """The decimal mark of each column of texts, as they show together or the user says; notes, and a fault if it is open."""
    marks = {c.index: reading.decimal for c in columns if texts[c.index].rows and texts[c.index].typed}
    alone = [c for c in columns if texts[c.index].rows and not texts[c.index].typed]
    if not alone:
        return marks, (), []
    cells = []
    for column in alone:
        rows = set(texts[column.index].rows)
        cells.append([cell if i in rows else "" for i, cell in enumerate(column.cells)])
    notation = decide_notation(cells, [f"column {column_letters(c.index)}" for c in alone], asked=reading.decimal)
    if notation.conflict:
        shown = " and ".join(f'"{cells[c][row]}" ({address(alone[c].places[row])})' for row, c in notation.places)
        row, c = notation.places[-1]
        message = f"the numbers of this column are text, and their decimal mark cannot be told: {notation.conflict}: {shown}"
        choice = _DECIMAL if notation.askable else None
        advice = f"Say it: {choice}; or {_AGAIN.lower()}" if choice else _AGAIN
        return marks, (), [_fault(alone[c].places[row], message, advice, choice)]
    return marks | dict(zip((c.index for c in alone), notation.decimals, strict=True)), notation.notes, []


_AGAIN = "Export the file again from the instrument's software"


def _numbers_in_text(column: _Column, texts: _Texts, mark: str, faults: list[Fault]) -> tuple[Sequence[str], tuple[str, ...]]:
    """The cells with numbers written as text, in this decimal mark, made numbers; notes on them, and faults if in doubt."""
    in_text, typed = texts.rows, texts.typed
    if not in_text or not (mark or typed):
        return column.cells, ()
    first = in_text[0]
    where = (
        f"{address(column.places[first])} and {len(in_text) - 1} more" if len(in_text) > 1 else address(column.places[first])
    )
    shown = f'"{column.cells[first]}" ({where})'
    if not mark:
        message = f"{shown} is text, other cells of this column are numbers: a spreadsheet program may have changed them"
        advice = f"{_AGAIN}; or, if the numbers are right, say the decimal mark of the text: {_DECIMAL}"
        faults.append(_fault(column.places[first], message, advice, _DECIMAL))
        return column.cells, ()
    large = [
        i for i in typed if (n := parse_number(column.cells[i], ".")) is not None and n.is_integer() and abs(n) >= _THOUSANDS
    ]
    if large:
        place = column.places[large[0]]
        message = (
            f"{shown} is text and {address(place)} the whole number {column.cells[large[0]]}: a spreadsheet program has taken "
            "a decimal mark for one of thousands"
        )
        faults.append(_fault(place, message, _AGAIN))
        return column.cells, ()
    cells = list(column.cells)
    for i in in_text:
        number = parse_number(cells[i], mark)
        if number is None:
            message = f'"{cells[i]}" is no number with the decimal mark "{mark}"'
            faults.append(_fault(column.places[i], message, _AGAIN))
            return column.cells, ()
        cells[i] = repr(number)
    word = "comma" if mark == "," else "point"
    said = f"{len(in_text)} number(s) of column {column_letters(column.index)} are text, read with a decimal {word}: {shown}"
    return cells, (said,)


def _as_shown(
    column: _Column, types: CellTypes, reading: Reading, faults: list[Fault]
) -> tuple[Sequence[str], str, tuple[str, ...]]:
    """The cells as their number format means them, a unit that the format alone names ("" if none), and notes."""
    formats: dict[str, list[int]] = {}
    for i, place in enumerate(column.places):
        if place in types.shown:
            formats.setdefault(types.shown[place], []).append(i)
    if not formats:
        return column.cells, "", ()
    quantity = column.quantity.removesuffix("_series")
    numbers = sum(map(is_numeric, column.cells))
    letters = column_letters(column.index)
    cells, unit, notes = list(column.cells), "", []
    for number_format, rows in formats.items():
        shown = shown_as(number_format)
        assert shown is not None
        place = column.places[rows[0]]
        if quantity in reading.units:
            notes.append(
                f'column {letters} is shown as "{number_format}"; the stored numbers are read in {reading.units[quantity]}'
            )
        elif shown.percent and quantity == "dissipation" and not (shown.thousands or shown.literal):
            # Stored as a fraction, whatever the header says.
            if column.unit == "%":
                for i in rows:
                    cells[i] = repr(float(cells[i]) * 100)
            notes.append(f"column {letters} is shown in per cent and stored as a fraction")
        elif _agrees(shown, column):
            continue
        elif _names_unit(shown, column) and len(formats) == 1 and len(rows) == numbers:
            unit = shown.literal
            notes.append(f'column {letters} has its unit, {unit}, from the number format "{number_format}"')
        else:
            message = (
                f'{address(place)} holds {cells[rows[0]]}, which is shown otherwise by the number format "{number_format}": '
                f"which of the two is in {column.unit or 'the unit meant'} cannot be told"
            )
            advice = (
                f"Set the format to General and check the unit; or say the unit of the stored number: --units {quantity}=..."
            )
            faults.append(_fault(place, message, advice))
            return column.cells, "", ()
    return cells, unit, tuple(notes)


def _agrees(shown: Shown, column: _Column) -> bool:
    if shown.percent or shown.thousands or shown.inside or not column.unit or not is_unit_of(shown.literal, column.quantity):
        return False
    if not is_unit_of(column.unit, column.quantity):
        return False
    return lab_factor(shown.literal, column.quantity) == lab_factor(column.unit, column.quantity)


def _names_unit(shown: Shown, column: _Column) -> bool:
    plain = not (shown.percent or shown.thousands or shown.inside or column.unit)
    return plain and is_unit_of(shown.literal, column.quantity)


def _left_out(column: _Column, types: CellTypes) -> tuple[Sequence[str], dict[int, str]]:
    """The cells without errors and without formulas among measured numbers, and the reason by line."""
    reasons: dict[int, str] = {}
    cells = list(column.cells)
    written = {**types.formulas, **types.uncalculated}
    formulas = [i for i, place in enumerate(column.places) if place in written]
    if 2 * len(formulas) < len(cells):
        for i in formulas:
            said = f' "{written[column.places[i]][:40]}"' if written[column.places[i]] else ""
            reasons[column.places[i][0]] = f"formula{said} among numbers in {address(column.places[i])}"
            cells[i] = ""
    errors = [place for place in column.places if place in types.errors]
    for place in errors:
        where = address(place) if len(errors) <= _FEW else f"column {column_letters(column.index)}"
        reasons[place[0]] = f"error {types.errors[place]} in {where}"
    return cells, reasons


def _fault(place: Cell, message: str, advice: str, choice: Choice | None = None) -> Fault:
    return Fault(message, None, place[0], place[1] + 1, advice, choice)
