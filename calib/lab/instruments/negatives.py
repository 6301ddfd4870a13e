"""From a sheet whose negative numbers stand in brackets, or with their minus behind them, to one with it before them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, not_numbers
from calib.lab.instruments.sheet import Sheet

_BEHIND = re.compile(r"(?P<number>[\d.,]*\d[\d.,]*)\s?[-\u2212\u2013]")
_BRACKETED = re.compile(r"\(\s?(?P<number>[\d.,]*\d[\d.,]*)\s?\)")
_MINUS = ("-", "\u2212", "\u2013")
# Cells so written that a column has at least: one may be damaged.
_FEWEST = 3


def with_minus_before(sheet: Sheet) -> Sheet:
    """Write negative numbers as all others do, "-0.004" for "(0.004)" or "0.004-", where all odd cells of a column are such.

    Parameters
    ----------
    sheet : the record.
    """
    if sheet.text.typed:
        return sheet
    columns, notes = list(sheet.columns), []
    for index, column in enumerate(sheet.columns):
        found = _turned(column)
        if found is not None:
            columns[index], shown, number = found
            notes.append(f'"{shown}" in "{sheet.names[index]}" is read as {number}, and so are all such cells')
    return replace(sheet, columns=tuple(columns), notes=(*sheet.notes, *notes)) if notes else sheet


def _turned(column: Sequence[str]) -> tuple[list[str], str, str] | None:
    """The cells with the minus before them, and the first of them as it was and is; None if there are none, or others."""
    if not any(cell.rstrip().endswith((*_MINUS, ")")) for cell in column[:2000]):
        return None
    odd = [r for r in not_numbers(column, len(column)) or [] if not (is_missing(column[r]) or is_over_range(column[r]))]
    for form in (_BEHIND, _BRACKETED):
        numbers = {r: m["number"] for r in odd if (m := form.fullmatch(column[r].strip())) is not None}
        if len(numbers) < max(_FEWEST, len(odd)) or not all(map(is_numeric, numbers.values())):
            continue
        if any(cell.lstrip()[:1] in _MINUS and is_numeric(cell) for cell in column):
            continue  # written in two ways, one may be damage
        first = next(iter(numbers))
        cells = [f"-{numbers[r]}" if r in numbers else cell for r, cell in enumerate(column)]
        return cells, column[first].strip(), cells[first]
    return None
