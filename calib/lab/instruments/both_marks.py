"""From columns of numbers in which the decimal mark changes to the same with one mark, where each cell shows its own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib.lab.instruments.numbers import EXPONENT, SIGNS, to_numbers
from calib.lab.instruments.sheet import Sheet

# A number with one mark, and one whose mark may as well set thousands apart.
_MARKED = re.compile(rf"\s*[{SIGNS}]?\d*(?P<mark>[.,])(?P<digits>\d+)(?:{EXPONENT})?\s*", re.ASCII)
_UNSURE = re.compile(rf"\s*[{SIGNS}]?[1-9]\d{{0,2}}[.,]\d{{3}}\s*", re.ASCII)
# Steps across a change of the mark, as powers of ten, are smaller where both are decimal.
_SMOOTH = 0.35
# A few cells with another mark may be damaged; so many of each are not.
_FEWEST = 5


def with_one_mark(sheet: Sheet, columns: Sequence[int]) -> Sheet | None:
    """Write the numbers of columns in which points and commas stand with points, with a note.

    Parameters
    ----------
    sheet : the record.
    columns : of numbers, by index.

    Returns
    -------
    The sheet; None if one mark is in a few cells alone, the decimals are not as many with either, or three digits behind a mark
    may be thousands, as the numbers with one mark do not go on from those with the other.
    """
    cells, notes = list(sheet.columns), list(sheet.notes)
    for index in columns:
        marked = [(r, c) for r, c in enumerate(sheet.columns[index]) if "." in c or "," in c]
        n_comma = sum("," in c for _, c in marked)
        if not n_comma or n_comma == len(marked):
            continue
        if min(n_comma, len(marked) - n_comma) < _FEWEST:
            return None
        found = [_MARKED.fullmatch(cell) for _, cell in marked]
        decimals: dict[str, int] = {}
        for match in found:
            if match is None:
                return None
            decimals[match["mark"]] = max(decimals.get(match["mark"], 0), len(match["digits"]))
        if len(decimals) < 2 or len({*decimals.values()}) > 1:
            return None
        if any(_UNSURE.fullmatch(cell) for _, cell in marked) and not _go_on([cell for _, cell in marked]):
            return None
        own = max(".,", key=[mark for _, cell in marked for mark in ".," if mark in cell].count)
        other = next((r, c) for r, c in marked if own not in c)
        cells[index] = [c.replace(",", ".") for c in sheet.columns[index]]
        shown = f'"{other[1].strip()}" (line {int(sheet.lines[other[0]])})'
        why = "with as many decimals each is read by its own"
        notes.append(f'"{sheet.names[index]}": {shown} has another decimal mark than most cells; {why}')
    changed = any(a is not b for a, b in zip(cells, sheet.columns, strict=True))
    return replace(sheet, columns=tuple(cells), notes=tuple(notes)) if changed else None


def _go_on(cells: Sequence[str]) -> bool:
    """Whether numbers with one mark go on from those with the other, both as decimals; thousands are far from them."""
    size = np.abs(to_numbers([c.strip().replace(",", ".") for c in cells], ".").values)
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.abs(np.diff(np.log10(size)))[np.diff(np.array(["," in c for c in cells]).astype(np.int8)) != 0]
    steps = steps[np.isfinite(steps)]
    return steps.size > 0 and float(np.median(steps)) < _SMOOTH
