"""From columns of numbers in which the decimal mark changes to the same with one mark, where each cell shows its own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from calib.lab.instruments.numbers import EXPONENT, SIGNS
from calib.lab.instruments.sheet import Sheet

# A number with one mark that sets no thousands apart: other than three digits are behind it, or a zero or four before it.
_OWN = re.compile(
    rf"\s*[{SIGNS}]?(?:(?P<of>\d*)(?P<mark>[.,])(?P<digits>\d{{1,2}}|\d{{4,}})|(?:0|\d{{4,}})(?P<second>[.,])(?P<three>\d{{3}}))"
    rf"(?:{EXPONENT})?\s*",
    re.ASCII,
)
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
    The sheet; None if one mark is in a few cells alone, may set thousands apart, or the decimals are not as many with either.
    """
    cells, notes = list(sheet.columns), list(sheet.notes)
    for index in columns:
        marked = [(r, c) for r, c in enumerate(sheet.columns[index]) if "." in c or "," in c]
        n_comma = sum("," in c for _, c in marked)
        if not n_comma or n_comma == len(marked):
            continue
        if min(n_comma, len(marked) - n_comma) < _FEWEST:
            return None
        found = [_OWN.fullmatch(cell) for _, cell in marked]
        decimals: dict[str, int] = {}
        for match in found:
            if match is None:
                return None
            mark, digits = (match["mark"], match["digits"]) if match["mark"] else (match["second"], match["three"])
            decimals[mark] = max(decimals.get(mark, 0), len(digits))
        if len(decimals) < 2 or len({*decimals.values()}) > 1:
            return None
        own = max(".,", key=[mark for _, cell in marked for mark in ".," if mark in cell].count)
        other = next((r, c) for r, c in marked if own not in c)
        cells[index] = [c.replace(",", ".") for c in sheet.columns[index]]
        shown = f'"{other[1].strip()}" (line {int(sheet.lines[other[0]])})'
        why = "with as many decimals each is read by its own"
        notes.append(f'"{sheet.names[index]}": {shown} has another decimal mark than most cells; {why}')
    changed = any(a is not b for a, b in zip(cells, sheet.columns, strict=True))
    return replace(sheet, columns=tuple(cells), notes=tuple(notes)) if changed else None
