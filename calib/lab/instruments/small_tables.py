"""From a cell beside the rows of a record to whether it is of a small table there, as of results: labels and their values."""

from __future__ import annotations

import re
from collections.abc import Collection

from calib.lab.instruments.numbers import SIGNS, is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import speaks_of_scale, stated_factors, stated_units
from calib.lab.instruments.units import looks_like_unit

# "Fmax (mN)", "at [mm]:", "travel, mm": a unit behind a label, which is that of its value.
_UNIT_BEHIND = re.compile(r"(?P<label>.*?)\s*(?:\((?P<round>[^()]*)\)|\[(?P<square>[^\[\]]*)\]|,\s*(?P<bare>\S+?))\s*[:=]?\s*")
# "10 N", and what has a capacity, which is no factor of the readings.
_WITH_UNIT = re.compile(rf"[{SIGNS}]?\d+(?:[.,]\d+)?\s?[^\W\d_]\S{{0,7}}")
_CAPACITY = re.compile(r"\bload ?cell\b|\bkraftmessdose\b", re.IGNORECASE)
# A small table beside the rows leaves such a share of them empty.
_MOSTLY_EMPTY = 0.8
_OF_RESULTS = re.compile(r"results?|ergebnisse?|résultats?|risultati?|resultados?|wyniki?|结果|結果", re.IGNORECASE)


def in_small_table(sheet: Sheet, row: int, column: int, used: Collection[int]) -> bool:
    """Tell whether a cell is the label of a value beside or below it, or its unit, in columns apart from those of the record.

    They have no names, or stand by themselves with an empty column before the record, so that the names are a row of theirs. A
    unit among these is that of the value, and says nothing of the rows; a label that speaks of ranges or factors does.

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
    numbers = [c for c in others if is_numeric(c) or _WITH_UNIT.fullmatch(c)]
    if numbers:
        whole = all(c in numbers or looks_like_unit(c) for c in others)
        return whole and is_label(label, numbers[0])
    below = cell(row + 1, column)
    return is_numeric(below) and is_label(cell(row, column), below)


def _is_free(sheet: Sheet, column: int, used: Collection[int]) -> bool:
    """Whether a column may be one of a small table: without a name, called results, or apart from those that are read."""
    name = sheet.names[column] if column < len(sheet.names) else ""
    free = not name or _OF_RESULTS.fullmatch(name) is not None or _is_apart(sheet, column, used)
    return column not in used and free


def _is_apart(sheet: Sheet, column: int, used: Collection[int]) -> bool:
    """Whether a column, and those beside it, hold few cells, and an empty column stands between them and any that is read."""
    block = {column}
    for step in (-1, 1):
        at = column
        while 0 <= at < len(sheet.columns) and (
            any(map(str.strip, sheet.columns[at])) or (at < len(sheet.names) and sheet.names[at])
        ):
            block.add(at)
            at += step
    sparse = all(sheet.columns[at].count("") >= _MOSTLY_EMPTY * len(sheet.lines) for at in block)
    return len(block) > 1 and sparse and not block & set(used)


def is_label(label: str, value: str) -> bool:
    """Tell whether a text is the label of a value, but for its unit no word on the rows.

    Parameters
    ----------
    label, value : the cells.
    """
    match = _UNIT_BEHIND.fullmatch(label)
    unit = next(filter(None, (match["round"], match["square"], match["bare"])), "") if match is not None else ""
    plain = match["label"] if match is not None and looks_like_unit(unit) else label
    if not label or is_numeric(label) or next(stated_units(label), None) or stated_factors([f"{plain}: {value}"]):
        return False
    return bool(plain) and not speaks_of_scale(_CAPACITY.sub("", plain))
