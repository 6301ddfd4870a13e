"""From a `Sheet` to the same with the units that stand in columns of their own (`Force;Unit`) below their names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from calib.lab.instruments.brackets import usual_case, words_in
from calib.lab.instruments.header import UNIT_NAMES
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import is_unit_of
from calib.lab.instruments.vocabulary import Heading, understand

_UNIT = re.compile(UNIT_NAMES, re.IGNORECASE)


def with_unit_columns(sheet: Sheet) -> Sheet:
    """Take the units of columns from columns of units, where every reading has the same.

    A column of units has no name, is called one, or by the unit itself, and stands behind that of the readings, or names it
    ("Force unit").
    One of several units stays what it is: its rows are asked for.

    Parameters
    ----------
    sheet : the record.

    Returns
    -------
    The sheet with these units as if they stood below the names, with notes, and the columns of units set aside.
    """
    headings = sheet.headings
    units, aside, notes = dict(enumerate(sheet.units)), dict(sheet.set_aside), list(sheet.notes)
    for at, column in enumerate(sheet.columns[: len(sheet.names)]):
        first = next((c.strip() for c in column if c.strip()), "")
        if at in aside or at in sheet.assigned or not first or is_numeric(first):
            continue
        of = _column_of(sheet, at, headings, first)
        if of is None:
            continue
        said = {unit.strip() for unit, cell in zip(column, sheet.columns[of], strict=True) if is_numeric(cell)}
        if said != {first}:
            continue
        below = units.get(of, "")
        units[of] = first if below in ("", first) else f"{below} or {first}"
        aside[at] = f'the unit of "{sheet.names[of]}"'
        shown = f', "{sheet.names[at]}",' if sheet.names[at] else ""
        notes.append(f'"{sheet.names[of]}" is in {first}: column {at + 1}{shown} says so in every row')
    if aside == sheet.set_aside:
        return sheet
    written = tuple(units.get(index, "") for index in range(len(sheet.names)))
    return replace(sheet, units=written, set_aside=aside, notes=tuple(notes))


def _column_of(sheet: Sheet, at: int, headings: Mapping[int, Heading], unit: str) -> int | None:
    """The column of readings of which one may hold the units, such as `unit`; None if there is none."""
    name = sheet.names[at].strip()
    of_readings = {i: heading for i, heading in headings.items() if i != at and i < len(sheet.columns)}
    there = [i for i, heading in of_readings.items() if is_unit_of(usual_case(sheet.names[i], unit), heading.quantity)]
    if not name or _UNIT.fullmatch(name) or name.strip("()[]") == unit:
        return at - 1 if at - 1 in there else None
    named = [word for word in words_in(name) if not _UNIT.fullmatch(word)]
    meant = understand(" ".join(named)) if 0 < len(named) < len(words_in(name)) else None
    own = [i for i in there if meant is not None and headings[i].quantity == meant.quantity]
    return own[0] if len(own) == 1 else None
