"""From a `Sheet` to which of its columns stand for which quantity, and in which unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from calib.errors import Choice, Fault
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import is_clock
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import lab_factor
from calib.lab.instruments.vocabulary import EXAMPLE, NEEDS_UNIT, Heading, understood_names


def choose_columns(sheet: Sheet, reading: Reading) -> tuple[dict[str, int], list[str], list[Fault]]:
    """Choose which column of a file stands for which quantity: by the user's word, else by the preferred name.

    Parameters
    ----------
    sheet : the record.
    reading : what the user says of the file.

    Returns
    -------
    Quantity -> index of the column, notes on choices, and faults of columns that stand there twice.
    """
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
            plain = [c for c in candidates if not holds_clock(sheet.columns[c[0]])]
            candidates = plain or candidates
        filled = [c for c in candidates if any(cell.strip() for cell in sheet.columns[c[0]])]
        candidates = sorted(filled or candidates, key=lambda c: (c[1].rank, c[0]))
        best, *others = candidates
        chosen[quantity] = best[0]
        same = [i for i, h in others if h.rank == best[1].rank and quantity != "status"]
        twins = [i for i in same if _alike(sheet, i, best[0])]
        choice = Choice("columns", tuple(str(i + 1) for i in (best[0], *same) if i not in twins), quantity)
        faults += [
            Fault(
                f'column "{sheet.names[index]}" appears twice (columns {best[0] + 1} and {index + 1})',
                sheet.text.path,
                sheet.header_line,
                index + 1,
                advice=f"Say which one is meant: {choice}",
                choice=choice,
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


def holds_clock(cells: Sequence[str]) -> bool:
    """Whether a column holds times of day, by its first fifty cells."""
    return any(map(is_clock, (c for c in cells[:50] if c.strip())))


def missing_columns(sheet: Sheet, family: InstrumentFamily, chosen: Mapping[str, int], reading: Reading) -> list[Fault]:
    """List the faults of quantities that are needed and not there, and of units given to columns that are not there.

    Parameters
    ----------
    sheet : the record.
    family : what it was recognised as.
    chosen : quantity -> index of its column.
    reading : what the user says of the file.
    """
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


def _asked_unit(quantity: str, reading: Reading) -> str | None:
    return reading.units.get(quantity.removesuffix("_series"))


def unit_of_column(sheet: Sheet, quantity: str, index: int, reading: Reading) -> tuple[Fault | None, float]:
    """The factor from a column's unit to SI, wherever the unit stands: said by the user, in the name, below it, or above.

    Parameters
    ----------
    sheet : the record.
    quantity, index : which of its columns, and what it holds.
    reading : what the user says of the file.

    Returns
    -------
    The fault of a unit that is missing, unknown or contradicted, or None; and the factor, 1 with a fault.
    """
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


def source_of_column(sheet: Sheet, quantity: str, index: int, reading: Reading, *, clock: bool) -> str:
    """The column as people know it: its name in the file and where its unit was found.

    Parameters
    ----------
    sheet : the record.
    quantity, index : which of its columns, and what it holds.
    reading : what the user says of the file.
    clock : whether its cells are times of day, which have no unit.
    """
    name = sheet.names[index]
    if not sheet.header_line and name.isdigit():
        name = f"column {name}"
    asked = _asked_unit(quantity, reading)
    if asked is not None:
        return f"{name} (read as {asked})"
    below = sheet.unit_below(index)
    if below:
        return f"{name} ({below})"
    declared = sheet.declared_units.get(quantity.removesuffix("_series"), ("", 0))[0]
    inside = sheet.headings()[index].unit
    return f"{name} ({declared}, declared above)" if declared and not inside and not clock else name
