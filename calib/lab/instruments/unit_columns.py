"""From a `Sheet` to the same with the units that stand in columns of their own (`Force;Unit`) below their names."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.brackets import LONGEST, usual_case, words_in
from calib.lab.instruments.declared import UNIT_NAMES
from calib.lab.instruments.going_on import values_of
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.sheet import OF_UNITS, Sheet
from calib.lab.instruments.unit_choice import units_to_say, written_unit
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import Heading, understand
from models.sensor import FloatArray

_UNIT = re.compile(UNIT_NAMES, re.IGNORECASE)
# "ForceUnit", "Krafteinheit".
_JOINED = re.compile(r"(.{2,}?)[ _]?((?:unit|einheit)s?)", re.IGNORECASE)
# Where the unit changes a reading is off that before it by no more than this share of both, or so many of the steps near it.
_SHARE, _STEPS, _NEAR = 0.2, 4.0, 5


def with_unit_columns(sheet: Sheet, reading: Reading) -> Sheet:
    """Take the units of columns from columns of units.

    A column of units has no name, is called one, or by the unit itself, and stands behind that of the readings, or names it
    ("Force unit"). One of several units, as of a meter that chooses its range itself, gives each row its own where the readings
    go on from one to the next.

    Parameters
    ----------
    sheet : the record.
    reading : what the user says of the file.

    Returns
    -------
    The sheet with these units as if they stood below the names, with notes, and the columns of units set aside.

    Raises
    ------
    InputError
        If the units of the rows change, and the readings do not go on there.
    """
    headings, columns = sheet.headings, list(sheet.columns)
    units, aside, notes = dict(enumerate(sheet.units)), dict(sheet.set_aside), list(sheet.notes)
    for at, column in enumerate(sheet.columns[: len(sheet.names)]):
        column = [cell.strip().strip("()[]") for cell in column] if _in_brackets(column) else column
        first = next(filter(None, map(str.strip, column)), "")
        if at in aside or at in sheet.assigned or not first or is_numeric(first):
            continue
        of = _column_of(sheet, at, headings, first)
        if of is None:
            continue
        said = {unit.strip() for unit, cell in zip(column, sheet.columns[of], strict=True) if is_numeric(cell)}
        shown = f', "{sheet.names[at]}",' if sheet.names[at] else ""
        if said != {first}:
            found = _in_one_unit(sheet, of, at, reading) if not units.get(of, "") else None
            if found is not None:
                columns[of], units[of], listed = found
                aside[at] = f'{OF_UNITS} "{sheet.names[of]}"'
                notes.append(
                    f'"{sheet.names[of]}": each row is read in the unit that column {at + 1}{shown} gives it ({listed})'
                )
            continue
        below = units.get(of, "")
        units[of] = first if below in ("", first) else f"{below} or {first}"
        aside[at] = f'{OF_UNITS} "{sheet.names[of]}"'
        notes.append(f'"{sheet.names[of]}" is in {first}: column {at + 1}{shown} says so in every row')
    if aside == sheet.set_aside:
        return sheet
    written = tuple(units.get(index, "") for index in range(len(sheet.names)))
    return replace(sheet, columns=tuple(columns), units=written, set_aside=aside, notes=tuple(notes))


def _in_brackets(column: Sequence[str]) -> bool:
    """Whether the first cell of a column is a word in brackets."""
    first = next(filter(None, map(str.strip, column)), "")
    return len(first) > 2 and first[0] + first[-1] in ("()", "[]") and not any(map(str.isdigit, first))


def _in_one_unit(sheet: Sheet, of: int, at: int, reading: Reading) -> tuple[list[str], str, str] | None:
    """The cells of a column in the unit of its first row, that unit, and all units; None where not every row has a known one.

    Only where no unit is said of the column anywhere else, and the units differ by powers of ten.
    """
    heading = sheet.headings[of]
    quantity = heading.quantity
    asked = quantity in reading.units or stands_for(quantity) in reading.units
    own = [
        usual_case(sheet.names[of], unit.strip()) if is_numeric(c) else ""
        for unit, c in zip(sheet.columns[at], sheet.columns[of], strict=True)
    ]
    rows = [r for r, cell in enumerate(sheet.columns[of]) if is_numeric(cell)]
    if asked or written_unit(sheet, of, heading) or heading.unit_doubt or not all(is_unit_of(own[r], quantity) for r in rows):
        return None
    first = own[rows[0]]
    power = {u: math.log10(lab_factor(u, quantity) / lab_factor(first, quantity)) for u in {own[r] for r in rows}}
    cells = list(sheet.columns[of])
    whole = all(math.isclose(p, round(p), abs_tol=1e-9) for p in power.values())
    if not whole:
        return None
    for r in rows:
        cells[r] = _times_ten(cells[r].strip(), round(power[own[r]]))
    values = values_of([cells[r].strip() for r in rows], sheet.declared_decimal)
    if not np.all(np.isfinite(values)):
        return None
    broken = _does_not_go_on(values, [own[r] for r in rows])
    if broken is None:
        return cells, first, ", ".join(dict.fromkeys(own[r] for r in rows))
    if reading.where:
        return None
    before, after = rows[broken - 1], rows[broken]
    told = [f"{sheet.columns[of][r].strip()} {own[r]} (line {sheet.lines[r]})" for r in (before, after)]
    raise InputError(
        Fault(
            f'the unit of "{sheet.names[of]}" changes in column {at + 1}, but its readings do not go on there: '
            f"{' and '.join(told)}",
            sheet.text.path,
            int(sheet.lines[after]),
            at + 1,
            advice=f"Write the right unit into column {at + 1} of these rows; if all rows are in one unit, empty that column "
            f"and say the unit: {units_to_say(quantity)}",
        )
    )


def _times_ten(number: str, power: int) -> str:
    """A number as written with another power of ten.

    >>> _times_ten("0.0982", 3), _times_ten("9.82E-02", 3), _times_ten("97.3", 0)
    ('0.0982e3', '9.82e1', '97.3')
    """
    if not power:
        return number
    plain, _, exponent = number.lower().partition("e")
    return f"{plain}e{int(exponent.replace(chr(0x2212), '-').replace(chr(0x2013), '-') or 0) + power}"


def _does_not_go_on(values: FloatArray, units: Sequence[str]) -> int | None:
    """The first reading behind a change of unit that is no reading of the same course; None if all go on.

    It is off by no more than a share of itself, or some steps of those readings beside it that stand in one unit each.
    """
    changes = [i for i in range(1, len(units)) if units[i] != units[i - 1]]
    for i in changes:
        steps = []
        for side in (range(i - 1, max(i - 1 - _NEAR, 0), -1), range(i + 1, min(i + 1 + _NEAR, len(units)))):
            own = [abs(values[k] - values[k - 1]) for k in side if units[k] == units[k - 1]]
            steps += [max(own)] if own else []
        room = max(_STEPS * min(steps, default=0.0), _SHARE * min(abs(values[i]), abs(values[i - 1])))
        if not abs(values[i] - values[i - 1]) <= room:
            return i
    return None


def _column_of(sheet: Sheet, at: int, headings: Mapping[int, Heading], unit: str) -> int | None:
    """The column of readings of which one may hold the units, such as `unit`; None if there is none."""
    name = sheet.names[at].strip()
    of_readings = {i: heading for i, heading in headings.items() if i != at and i < len(sheet.columns)}
    there = [i for i, heading in of_readings.items() if is_unit_of(usual_case(sheet.names[i], unit), heading.quantity)]
    if not name or _UNIT.fullmatch(name) or name.strip("()[]") == unit:
        alone = there if name and _UNIT.fullmatch(name) else []
        return at - 1 if at - 1 in there else alone[0] if len(alone) == 1 else None
    if len(name) > LONGEST:
        return None
    parts = words_in(_JOINED.sub(r"\1 \2", name))
    named = [word for word in parts if not _UNIT.fullmatch(word)]
    meant = understand(" ".join(named), unit) if 0 < len(named) < len(parts) else None
    own = [i for i in there if meant is not None and headings[i].quantity == meant.quantity]
    return own[0] if len(own) == 1 else None
