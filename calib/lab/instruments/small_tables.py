"""From a cell beside the rows of a record to whether it is of a small table there, as of results: labels and their values."""

from __future__ import annotations

import re
from collections.abc import Collection

from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import speaks_of_scale, stated_factors, stated_units
from calib.lab.instruments.units import looks_like_unit

# "Fmax (mN)", "at [mm]:", "travel, mm": a unit behind a label, which is that of its value.
_UNIT_BEHIND = re.compile(r"(?P<label>.*?)\s*(?:\((?P<round>[^()]*)\)|\[(?P<square>[^\[\]]*)\]|,\s*(?P<bare>\S+?))\s*[:=]?\s*")
_OF_RESULTS = re.compile(r"results?|ergebnisse?|résultats?|risultati?|resultados?|wyniki?|结果|結果", re.IGNORECASE)


def in_small_table(sheet: Sheet, row: int, column: int, used: Collection[int]) -> bool:
    """Tell whether a cell is the label of a value beside or below it, or its unit, in columns that have no names.

    A unit among these is that of the value, and says nothing of the rows; a label that speaks of ranges or factors does.

    Parameters
    ----------
    sheet : the record.
    row, column : of the cell, from 0.
    used : columns that are read.
    """

    def cell(r: int, i: int) -> str:
        inside = 0 <= i < len(sheet.columns) and r < len(sheet.lines)
        return sheet.columns[i][r].strip() if inside and _is_free(sheet, i, used) else ""

    first = last = column
    while cell(row, first - 1):
        first -= 1
    while cell(row, last + 1):
        last += 1
    label, *others = [cell(row, i) for i in range(first, last + 1)]
    numbers = [c for c in others if is_numeric(c)]
    if numbers:
        whole = all(is_numeric(c) or looks_like_unit(c) for c in others)
        return whole and _is_label(label, numbers[0])
    below = cell(row + 1, column)
    return is_numeric(below) and _is_label(cell(row, column), below)


def _is_free(sheet: Sheet, column: int, used: Collection[int]) -> bool:
    """Whether a column may be one of a small table: without a name, or called results."""
    name = sheet.names[column] if column < len(sheet.names) else ""
    return column not in used and (not name or _OF_RESULTS.fullmatch(name) is not None)


def _is_label(label: str, value: str) -> bool:
    """Whether a text is the label of a value, but for its unit no word on the rows."""
    match = _UNIT_BEHIND.fullmatch(label)
    unit = next(filter(None, (match["round"], match["square"], match["bare"])), "") if match is not None else ""
    plain = match["label"] if match is not None and looks_like_unit(unit) else label
    if not label or is_numeric(label) or next(stated_units(label), None) or stated_factors([f"{plain}: {value}"]):
        return False
    return bool(plain) and not speaks_of_scale(plain)
