"""From a sheet with numbers in ways of their own, `(0.004)`, `'0.5`, `9.7×10^-11`, to one with them as others write them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, not_numbers
from calib.lab.instruments.sheet import Sheet

_NUMBER = r"[\d.,]*\d[\d.,]*"
_MINUS = ("-", "\u2212", "\u2013")
_SIGN = "[-+\u2212\u2013]"
_RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺"
_LOWERED = str.maketrans(_RAISED, "0123456789-+")
_TIMES_TEN = r"[×x*·\u22c5]\s?10\s?(?:\^|\*\*)"


@dataclass(frozen=True)
class _Way:
    """A way of writing numbers.

    pattern : of a cell that is written so.
    plain : such a cell -> the number as all others are written.
    signs : whether it is one of writing the minus, beside which no cell may have it in front.
    """

    pattern: re.Pattern[str]
    plain: Callable[[re.Match[str]], str]
    signs: bool = False


@dataclass(frozen=True)
class _Written:
    """The way in which the odd cells of a column are written, and row -> the number in each as all others are written."""

    way: _Way
    numbers: Mapping[int, str]


_WAYS = (
    _Way(re.compile(rf"({_NUMBER})\s?[-\u2212\u2013]"), lambda m: f"-{m[1]}", signs=True),
    _Way(re.compile(rf"\(\s?({_NUMBER})\s?\)"), lambda m: f"-{m[1]}", signs=True),
    _Way(re.compile(rf"[-\u2212\u2013]\s+({_NUMBER}(?:[eE]{_SIGN}?\d+)?)"), lambda m: f"-{m[1]}", signs=True),
    # The mark by which a spreadsheet keeps a cell as text.
    _Way(re.compile(rf"['\u2019]({_SIGN}?{_NUMBER}(?:[eE]{_SIGN}?\d+)?)"), lambda m: m[1]),
    # A cell in single quotes.
    _Way(re.compile(rf"(?P<quote>['\u2018`])\s?({_SIGN}?{_NUMBER}(?:[eE]{_SIGN}?\d+)?)\s?['\u2019`]"), lambda m: m[2]),
    _Way(re.compile(rf"({_SIGN}?{_NUMBER})\s?{_TIMES_TEN}\s?\(?({_SIGN}?\d+)\)?"), lambda m: f"{m[1]}E{m[2]}"),
    _Way(re.compile(rf"({_SIGN}?{_NUMBER})\s?[×x*·\u22c5]\s?10([{_RAISED}]+)"), lambda m: f"{m[1]}E{m[2].translate(_LOWERED)}"),
    _Way(re.compile(rf"({_SIGN}?{_NUMBER})\s+[eE]\s?({_SIGN}\d+)"), lambda m: f"{m[1]}E{m[2]}"),
    # The exponent of a number in double precision as Fortran writes it.
    _Way(re.compile(rf"({_SIGN}?{_NUMBER})[dD]({_SIGN}\d+)"), lambda m: f"{m[1]}E{m[2]}"),
    # The point of British print.
    _Way(re.compile(r"([-+\u2212\u2013]?\d+)[·\u22c5](\d+)"), lambda m: f"{m[1]}.{m[2]}"),
)
# What shows in some of the first cells that a column may have such.
_SHOWS = re.compile(
    r"[-\u2212\u2013)]\s*$|^\s*(?:['\u2019]|[-\u2212\u2013]\s)|\d\s?[×x*·\u22c5]\s?\d|\d\s+[eE]|\d[dD][-+\u2212\u2013]\d"
)
_SEEN = 2000
# Characters of a number, however it is written.
_LONGEST = 60
# Blanks and apostrophes that set no thousands apart.
_LOOSE = re.compile(r"^\s*(?:['\u2019]|[-+\u2212\u2013]\s)|\d\s+[eE]")
# Cells so written that some column has at least: one may be damaged.
_FEWEST = 3


def with_plain_numbers(sheet: Sheet) -> Sheet:
    """Write numbers as all others do, "-0.004" for "(0.004)" or "0.004-".

    All odd cells of a column have to be of one such way, and some column of the file has to have a few of it.

    Parameters
    ----------
    sheet : the record.
    """
    columns, notes = list(sheet.columns), []
    found = {index: way for index, column in enumerate(sheet.columns) if (way := _way_of(column)) is not None}
    # What is written so in one column is no damage in another, be it there once.
    usual = {own.way for own in found.values() if len(own.numbers) >= _FEWEST}
    for index, own in found.items():
        if own.way in usual:
            first = next(iter(own.numbers))
            shown, number = columns[index][first].strip(), own.numbers[first]
            columns[index] = [own.numbers.get(r, cell) for r, cell in enumerate(columns[index])]
            notes.append(f'"{shown}" in "{sheet.names[index]}" is read as {number}, and so are all such cells')
    return replace(sheet, columns=tuple(columns), notes=(*sheet.notes, *notes)) if notes else sheet


def _way_of(column: Sequence[str]) -> _Written | None:
    """The way in which all odd cells of a column are written, and their numbers; None if there are none, or others."""
    if not any(map(_SHOWS.search, column[:_SEEN])):
        return None
    odd = {*(not_numbers(column, len(column)) or []), *(r for r, cell in enumerate(column) if _LOOSE.search(cell))}
    odd = {r for r in odd if not (is_missing(column[r]) or is_over_range(column[r]))}
    if any(len(column[r]) > _LONGEST for r in odd):
        return None
    for way in _WAYS:
        numbers = {r: way.plain(m) for r in sorted(odd) if (m := way.pattern.fullmatch(column[r].strip())) is not None}
        if not numbers or len(numbers) < len(odd) or not all(map(is_numeric, numbers.values())):
            continue
        if way.signs and any(_has_minus(cell) for r, cell in enumerate(column) if r not in numbers):
            continue  # written in two ways, one may be damage
        return _Written(way, numbers)
    return None


def _has_minus(cell: str) -> bool:
    """Whether a cell is a number with a minus in front, other than a zero, whose sign says nothing ("-0.0000")."""
    return cell.lstrip()[:1] in _MINUS and is_numeric(cell) and any(c in "123456789" for c in cell)
