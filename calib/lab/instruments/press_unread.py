"""From a record without a force, a place or a capacitance to notes on columns that may be it, and what to type."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

import numpy as np

from calib.errors import Choice
from calib.lab.instruments.numbers import numbers_in
from calib.lab.instruments.other_quantities import is_of_another
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import is_unit_of
from calib.lab.instruments.vocabulary import FUNCTION, MAY_BE_A_CHANGE, UNKNOWN

# So many different numbers at least has what moves.
_FEWEST = 5
_LETTERS = {"displacement": "szuwxdh", "force": "fp", "capacitance": "c"}
# A symbol of a capacitance with a number and a unit behind it, which may be a factor or how far the meter reaches: "C_0.1pF".
_OF_METER = re.compile(r"c[ps]?[\W_]+\d+(?:[.,]\d+)?\s?[pnuµμm]?F(?![^\W_]).*", re.IGNORECASE)
# What was made of readings, or of how they scatter: "|Force|", "-Force", "Force + 2", "ln Force", "Force IQR".
_MADE = re.compile(r"^\s*[-\u2212|]|[|+*^√²³=>]|(?<![^\W_])(?:abs|iqr|sem|cv)(?![^\W_])", re.IGNORECASE)
# What is in g and no weight.
_ACCELERATION = re.compile(r"acc|beschl|vibr|shock|imu|(?<![^\W\d_])[axyz](?![^\W\d_])", re.IGNORECASE)


def notes_on_press(sheet: Sheet, read: Collection[str], unread: Mapping[int, str]) -> list[str]:
    """Say of a record of a press which columns that are not read may be its force, its place or its capacitance.

    They move, and are in a unit of the quantity, or called by a letter for it without a unit.

    Parameters
    ----------
    sheet : the record.
    read : the quantities that are read, and those that the user named.
    unread : index -> why a column is not read.
    """
    notes = []
    capacitance = {"capacitance", "capacitance_series"} & set(read)
    for quantity in ("displacement", "force") if capacitance else ("capacitance",):
        if quantity in read:
            continue
        found = [i for i in range(len(sheet.names)) if _may_be(sheet, i, quantity, unread.get(i, "")) and _moves(sheet, i)]
        if not found:
            continue
        names = " and ".join(f'"{sheet.names[i]}"' for i in found)
        asked = " or ".join(str(Choice("columns", (sheet.name_for_asking(i),), quantity)) for i in found)
        without_unit = not all(sheet.unit_written(i) for i in found)
        unit = f" --units {quantity}=..." if without_unit else ""
        move = "move" if len(found) > 1 else "moves"
        notes.append(
            f"no {quantity} is read; {names} {move} and may be one: if it is the {quantity} as it was measured, {asked}{unit}"
        )
    return notes


def _may_be(sheet: Sheet, index: int, quantity: str, why: str) -> bool:
    """Whether a column that is not understood is in a unit of a quantity, or called by a letter for it alone."""
    name = sheet.names[index]
    if not why.startswith((*UNKNOWN, MAY_BE_A_CHANGE)) or index in sheet.set_aside:
        return False
    if _MADE.search(name) or FUNCTION.search(name) or is_of_another(name, quantity):
        return False
    unit = sheet.unit_written(index)
    if unit:
        return is_unit_of(unit, quantity) and not (unit == "g" and _ACCELERATION.search(name))
    return name.lower() in tuple(_LETTERS[quantity]) or (quantity == "capacitance" and _OF_METER.fullmatch(name) is not None)


def _moves(sheet: Sheet, index: int) -> bool:
    values = numbers_in(sheet.columns[index], sheet.declared_decimal)
    return np.unique(values[np.isfinite(values)]).size >= _FEWEST
