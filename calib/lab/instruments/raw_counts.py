"""From a `Sheet` to the columns that hold the counts of a converter or a motor where another holds the quantity in a unit."""

from __future__ import annotations

import re

from calib.lab.instruments.brackets import are_counts
from calib.lab.instruments.header import split_line
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import is_unit_of, stands_for
from calib.lab.instruments.vocabulary import NEEDS_UNIT, Heading

# Fewest letters of a name before the word behind it: "Force_raw".
_SHORTEST = 3


def raw_counts(sheet: Sheet) -> dict[int, str]:
    """Find the columns of counts that have no unit, where a column of the same quantity has one: index -> why it is not read.

    Parameters
    ----------
    sheet : without rows.
    """
    headings = {i: h for i, h in sheet.headings.items() if h.quantity in NEEDS_UNIT}
    in_unit = {_quantity(h): i for i, h in reversed(headings.items()) if _has_unit(sheet, i, h)}
    return {
        i: f'counts ("{said}"), no {_quantity(h)} in a unit: {_shown(sheet, in_unit[_quantity(h)])} is the {_quantity(h)}'
        for i, h in headings.items()
        if _quantity(h) in in_unit and i not in sheet.assigned and not _has_unit(sheet, i, h) and (said := _counts(sheet, i))
    }


def _shown(sheet: Sheet, index: int) -> str:
    unit = sheet.unit_below(index)
    return f'"{sheet.names[index]}"{f" in {unit}" if unit else ""}'


def _quantity(heading: Heading) -> str:
    return stands_for(heading.quantity)


def _has_unit(sheet: Sheet, index: int, heading: Heading) -> bool:
    """Whether a unit of its quantity stands in the name of a column, below it, or above the header."""
    written = [unit for unit in (heading.unit, sheet.unit_below(index)) if unit]
    return heading.quantity in sheet.declared_units or any(is_unit_of(unit, heading.quantity) for unit in written)


def _counts(sheet: Sheet, index: int) -> str:
    """What says in the brackets of a name, behind it or below it that its column holds counts; "" if nothing does."""
    name = sheet.names[index]
    behind = re.fullmatch(rf".{{{_SHORTEST},}}?[\s_]+([^\W_]+)", name)
    said = [*re.findall(r"[(\[{]([^()\[\]{}]+)[)\]}]", name), *([behind[1]] if behind is not None else [])]
    if sheet.units_line is not None:
        said += split_line(sheet.text.lines[sheet.units_line - 1], sheet.delimiter)[index : index + 1]
    return next((words.strip() for words in said if are_counts(words)), "")
