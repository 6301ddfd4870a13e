"""From the cells of a column that is not read to what they say: its remarks, or its few values and where each stands."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from calib.lab.instruments.clock_cells import is_date
from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.lines import DOUBT
from calib.lab.instruments.numbers import is_missing, is_numeric

# Rows that show whether a column has few values, how many these are, and how many stretches of rows numbers stand in at most.
_SEEN, _FEW, _STRETCHES = 2000, 6, 12
# A column of remarks has words in no more than this share of its rows; so many of them are quoted, each no longer than this.
_SELDOM, _QUOTED, _LONGEST = 0.2, 4, 60
# A remark has words, one behind the other.
_SAYING = re.compile(r"[^\W\d_]{2}\S*\s+\S*[^\W\d_]{2}")
# Beyond so many kinds a column of words is one of readings or of counts.
_KINDS = 300


def few_kinds(cells: Sequence[str]) -> set[str]:
    """What the cells of a column are, where they are of a few kinds, as the first of them tell at once; nothing of any other.

    Parameters
    ----------
    cells : of the column.
    """
    if len(set(cells[:_SEEN])) > _FEW:
        return set()
    kinds = set(cells)
    return kinds if len(kinds) <= _FEW else set()


def few_values(cells: Sequence[str]) -> list[str]:
    """The values of a column that has two or a few, each in most rows of its own, in the order of the first; else none.

    Parameters
    ----------
    cells : of the column.
    """
    kinds = few_kinds(cells)
    if not kinds:
        return []
    there = sorted((c for c in kinds if c.strip() and not is_missing(c)), key=cells.index)
    changes = sum(a != b for a, b in pairwise(cells[:_SEEN]))
    numbers = all(map(is_numeric, there))
    if all(map(is_date, there)):
        return []  # of the days of one record
    return there if len(there) > 1 and not (numbers and changes > _STRETCHES) and not is_seldom(cells) else []


def column_says(cells: Sequence[str], lines: IntArray) -> str:
    """What the cells of a column that is not read say, with their lines; "" if they are readings, or one word of no doubt.

    Parameters
    ----------
    cells : of the column.
    lines : 1-based line of each row.

    >>> import numpy as np
    >>> column_says(["first", "first", "test", "test"], np.arange(2, 6))
    '"first" in lines 2 to 3, "test" in lines 4 to 5'
    """
    values = few_values(cells)
    if values:
        return ", ".join(_where(cells, value, lines) for value in values)
    seldom = is_seldom(cells)
    if not seldom and len(set(cells[:_SEEN])) > _KINDS:
        return ""
    kinds = {c for c in set(cells) if c.strip() and not is_missing(c) and not is_numeric(c)}
    if len(kinds) == 1 and cells.count(one := next(iter(kinds))) == len(cells) and _SAYING.search(one):
        return f'"{_short(one)}" in every row'
    if not kinds or (not seldom and (len(kinds) > _KINDS or not any(map(DOUBT.search, kinds)))):
        return ""
    doubts = [c for c in kinds if DOUBT.search(c)]
    chosen = sorted(kinds if seldom else doubts, key=cells.index)
    kept = chosen[:_QUOTED]
    more = f" and {len(chosen) - len(kept)} more" if len(chosen) > len(kept) else ""
    return ", ".join(f'"{_short(c)}" (line {lines[cells.index(c)]})' for c in kept) + more


def is_seldom(cells: Sequence[str]) -> bool:
    """Whether a column is empty in all but few rows, as one of remarks.

    Parameters
    ----------
    cells : of the column.
    """
    return cells.count("") >= (1 - _SELDOM) * len(cells)


def _short(cell: str) -> str:
    return " ".join(cell.split())[:_LONGEST]


def _where(cells: Sequence[str], value: str, lines: IntArray) -> str:
    """Where a value of a column stands: in which lines, or in how many rows where others stand between them."""
    first, count = cells.index(value), cells.count(value)
    if count == 1:
        return f'"{_short(value)}" in line {lines[first]}'
    if set(cells[first : first + count]) == {value}:
        return f'"{_short(value)}" in lines {lines[first]} to {lines[first + count - 1]}'
    return f'"{_short(value)}" in {count} rows from line {lines[first]} on'
