"""From a `Sheet` to a `LabTable`: columns chosen by name, units applied, unusable rows given a reason, faults collected."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError
from calib.instruments.labtable import LabTable
from calib.instruments.numbers import decide_notation, is_missing, to_numbers
from calib.instruments.sheet import Sheet, capped
from calib.instruments.vocabulary import EXAMPLE, NEEDS_UNIT, SI_UNIT, Heading, understand, understood_names
from calib.quantity import unit_factor
from models.sensor import FloatArray

#: Says what is missing: the quantities found -> the quantities that are needed besides, () if nothing is.
Requirement = Callable[[frozenset[str]], tuple[str, ...]]

# A reading of 999999 digits is how some LCR meters say that there is none.
_NO_READING = 999999.0
_LCR = ("capacitance", "capacitance_series", "dissipation")
_ESSENTIAL = ("time", "displacement", "force", "capacitance", "capacitance_series")
_STATUS_GOOD = ("0", "+0", "0.0", "ok", "normal", "good", "")


def headings(sheet: Sheet) -> dict[int, Heading]:
    """Which columns of a sheet are understood, and as what: cell index -> heading."""
    found = {i: understand(name, sheet.unit_below(i)) for i, name in enumerate(sheet.names) if name}
    return {i: heading for i, heading in found.items() if heading is not None}


def needs(*quantities: str) -> Requirement:
    """Requirement of all these quantities."""
    return lambda found: tuple(q for q in quantities if q not in found)


def read_columns(sheet: Sheet, recognised_as: str, reason: str, requirement: Requirement) -> LabTable:
    """The columns of a sheet that are understood, in SI, with a reason at each row that is not usable.

    Where several columns stand for one quantity the preferred name is taken and the choice noted.

    Raises
    ------
    InputError
        With every fault: a needed column missing, a column twice, a unit missing or unknown, text in a number cell,
        an ambiguous decimal mark.
    """
    path, header_line = sheet.text.path, sheet.header_line
    chosen, notes, faults = _choose(sheet)
    found = frozenset("capacitance" if q == "capacitance_series" else q for q in chosen)
    for quantity in requirement(found):
        there = ", ".join(f'"{n}"' for n in sheet.names if n)
        faults.append(
            Fault(
                f"no {quantity} column among {there}",
                path,
                header_line,
                advice=f"{quantity.capitalize()} is understood under the names {understood_names(quantity)} and others, "
                f'for example "{EXAMPLE[quantity]}"',
            )
        )
    factors: dict[str, float] = {}
    for quantity, index in list(chosen.items()):
        if quantity == "status":
            continue
        unit_fault, factor = _factor(sheet, quantity, index)
        if unit_fault is not None and quantity == "frequency":
            notes.append(f'"{sheet.names[index]}" left out: it has no unit of frequency')
            del chosen[quantity]
        elif unit_fault is not None:
            faults.append(unit_fault)
        else:
            factors[quantity] = factor
    cells = {q: [row[i].strip() if i < len(row) else "" for row in sheet.rows] for q, i in chosen.items()}
    numeric = [q for q in cells if q != "status"]
    notation = decide_notation([cells[q] for q in numeric])
    if notation.conflict:
        places = [(sheet.lines[r], numeric[c], cells[numeric[c]][r]) for r, c in notation.places]
        shown = " and ".join(f'"{text}" (line {line}, column "{sheet.names[chosen[q]]}")' for line, q, text in places)
        line, quantity, _ = places[-1]
        faults.append(
            Fault(
                f"the decimal mark cannot be told: {notation.conflict}: {shown}",
                path,
                int(line),
                chosen[quantity] + 1,
                advice="A spreadsheet program may have damaged the numbers: export the file again from the instrument's "
                "software, with a decimal point and without thousands separators",
            )
        )
        raise InputError(faults)
    columns: dict[str, FloatArray] = {}
    reasons = [""] * len(sheet.rows)
    bad: list[Fault] = []
    for quantity in numeric:
        numbers = to_numbers(cells[quantity], notation.decimal)
        name = sheet.names[chosen[quantity]]
        bad += [
            Fault(
                f'"{cells[quantity][r]}" in column "{name}" is not a number',
                path,
                int(sheet.lines[r]),
                chosen[quantity] + 1,
                advice="Correct the cell from the instrument's own record, or empty it to leave the row out",
            )
            for r in np.flatnonzero(numbers.bad)
        ]
        values, over = numbers.values.copy(), numbers.over.copy()
        if quantity in _LCR:
            over |= values == _NO_READING
        values[over] = np.nan
        for r in np.flatnonzero(over).tolist():
            _append(reasons, r, f"over-range {cells[quantity][r]}")
        # A quantity logged at a lower rate than the others leaves most of its cells empty: that makes no row unusable.
        sparse = np.count_nonzero(numbers.empty) > len(reasons) / 2
        if sparse and not np.all(numbers.empty):
            notes.append(f'"{name}" has a value in {np.count_nonzero(~numbers.empty)} of {len(reasons)} rows only')
        elif quantity in _ESSENTIAL or (quantity == "dissipation" and "capacitance_series" in chosen):
            for r in np.flatnonzero(numbers.empty).tolist():
                _append(reasons, r, f"empty cell: {quantity.removesuffix('_series')}")
        columns[quantity] = _times(values, factors.get(quantity, 1.0))
    faults += capped(sorted(bad, key=lambda f: (f.line or 0, f.column or 0)), "cells are not numbers")
    if faults:
        raise InputError(faults)
    for r, cell in enumerate(cells.get("status", ())):
        if cell.lower() not in _STATUS_GOOD and not is_missing(cell):
            _append(reasons, r, f"LCR status {cell}")
    sources = {q: _source(sheet, i) for q, i in chosen.items() if q != "status"}
    for array in columns.values():
        array.flags.writeable = False
    return LabTable(
        path=path,
        sha256=sheet.text.sha256,
        recognised_as=recognised_as,
        reason=reason,
        encoding=sheet.text.encoding,
        delimiter=sheet.delimiter,
        decimal=notation.decimal,
        columns=MappingProxyType(columns),
        sources=MappingProxyType(sources),
        lines=sheet.lines,
        reasons=tuple(reasons),
        notes=(*sheet.notes, *notes),
    )


def _append(reasons: list[str], row: int, reason: str) -> None:
    reasons[row] = f"{reasons[row]}; {reason}" if reasons[row] else reason


def _times(values: FloatArray, factor: float) -> FloatArray:
    # Division by an exact power of ten rounds once, multiplication by its inexact inverse twice.
    inverse = float(round(1 / factor)) if factor < 1 else 0.0
    return values / inverse if inverse and 1 / inverse == factor else values * factor


def _choose(sheet: Sheet) -> tuple[dict[str, int], list[str], list[Fault]]:
    by_quantity: dict[str, list[tuple[int, Heading]]] = {}
    for index, heading in headings(sheet).items():
        by_quantity.setdefault(heading.quantity, []).append((index, heading))
    chosen: dict[str, int] = {}
    notes: list[str] = []
    faults: list[Fault] = []
    for quantity, candidates in by_quantity.items():
        candidates.sort(key=lambda c: (c[1].rank, c[0]))
        best, *others = candidates
        chosen[quantity] = best[0]
        faults += [
            Fault(
                f'column "{sheet.names[index]}" appears twice (columns {best[0] + 1} and {index + 1})',
                sheet.text.path,
                sheet.header_line,
                index + 1,
                advice="Keep one of the two, or give the other a name of its own",
            )
            for index, heading in others
            if heading.rank == best[1].rank
        ]
        left_out = [f'"{sheet.names[index]}"' for index, heading in others if heading.rank != best[1].rank]
        if left_out:
            why = (
                "; the load as the cell read it is preferred, its zero is a parameter of the model"
                if quantity == "force"
                else ""
            )
            notes.append(
                f'{quantity} is taken from "{sheet.names[best[0]]}", not from {" or ".join(left_out)}{why}',
            )
    return chosen, notes, faults


def _factor(sheet: Sheet, quantity: str, index: int) -> tuple[Fault | None, float]:
    name, below = sheet.names[index], sheet.unit_below(index)
    heading = understand(name, below)
    inside = heading.unit if heading is not None and heading.unit else ""
    line = sheet.units_line if below and sheet.units_line is not None else sheet.header_line

    def fault(message: str, advice: str) -> tuple[Fault, float]:
        return Fault(message, sheet.text.path, line, index + 1, advice), 1.0

    example = f'Write it into the header, for example "{EXAMPLE[quantity]}"'
    if not inside and not below:
        return fault(f'column "{name}" has no unit', example) if quantity in (*NEEDS_UNIT, "frequency") else (None, 1.0)
    try:
        factors = [unit_factor(unit, SI_UNIT[quantity]) for unit in (inside, below) if unit]
    except ValueError as error:
        return fault(f'column "{name}": {error}', example)
    if len(set(factors)) > 1:
        return fault(f'column "{name}" has the unit "{inside}" in its name and "{below}" below it', "Correct one of the two")
    if quantity.startswith("capacitance") and factors[0] > 1:
        return fault(f'column "{name}": "{inside or below}" means {factors[0]:g} farad', example)
    return None, factors[0]


def _source(sheet: Sheet, index: int) -> str:
    below = sheet.unit_below(index)
    return f"{sheet.names[index]} ({below})" if below else sheet.names[index]


def names_in(sheet: Sheet, quantities: Iterable[str]) -> list[str]:
    """The header cells that stand for one of the quantities, in the file's order."""
    wanted = set(quantities)
    return [sheet.names[i] for i, heading in headings(sheet).items() if heading.quantity in wanted]
