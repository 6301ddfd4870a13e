"""From number cells as written, in either decimal notation, to numbers; refusing what is ambiguous or damaged."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from models.sensor import BoolArray, FloatArray

# Digits with any marks between them, and an exponent: a number in some notation.
_NUMERIC = re.compile(r"^[+-]?[\d.,'\s\u00a0\u202f]*\d[\d.,'\s\u00a0\u202f]*(?:[eE][+-]?\d+)?$")
_PLAIN = re.compile(r"[0-9.eE+\-\s]*")
_OVER_RANGE = re.compile(r"^(?:over|ovld|ov\d+|ol|overload|overflow)$", re.IGNORECASE)
_MISSING = re.compile(r"^(?:nan|n/?a)$", re.IGNORECASE)
#: What the meters write for "no reading" on their bus is at least this.
OVER_RANGE = 9.9e37

_GROUPED = r"[+-]?\d{{1,3}}(?:{0}\d{{3}})+"
_SPACES = "' \u00a0\u202f"


def _notation(mark: str, other: str) -> re.Pattern[str]:
    point = re.escape(mark)
    grouped = _GROUPED.format(f"[{other}{_SPACES}]")
    return re.compile(rf"^(?:[+-]?(?:\d+(?:{point}\d*)?|{point}\d+)|{grouped}(?:{point}\d*)?)(?:[eE][+-]?\d+)?$")


_NOTATION = {".": _notation(".", ","), ",": _notation(",", ".")}
_SEPARATORS = {".": re.compile(f"[,{_SPACES}]"), ",": re.compile(f"[.{_SPACES}]")}


def is_numeric(cell: str) -> bool:
    """Whether a cell looks like a number in any notation."""
    return _NUMERIC.match(cell.strip()) is not None


def is_over_range(cell: str) -> bool:
    """Whether a cell is a word by which an instrument says that it has no reading: OVER, OV01, OL.

    >>> is_over_range("OV01"), is_over_range("over it")
    (True, False)
    """
    return _OVER_RANGE.match(cell.strip()) is not None


def is_missing(cell: str) -> bool:
    """Whether a cell is empty or says that nothing is there (nan, n/a)."""
    cell = cell.strip()
    return not cell or _MISSING.match(cell) is not None


def parse_number(cell: str, decimal: str) -> float | None:
    """The number a cell holds in the notation with this decimal mark; None if it holds none.

    Thousands may be set apart by the other mark, an apostrophe or a space, in full groups of three only.

    >>> parse_number("1,000.06200", "."), parse_number("1.000,062", ","), parse_number("0,9966", ".")
    (1000.062, 1000.062, None)
    """
    cell = cell.strip()
    if _NOTATION[decimal].match(cell) is None:
        return None
    return float(_SEPARATORS[decimal].sub("", cell).replace(",", "."))


@dataclass(frozen=True)
class Notation:
    """The decimal mark of a file, or why it cannot be told: `conflict` says it, with the places (row, column) of the cells."""

    decimal: str
    conflict: str = ""
    places: tuple[tuple[int, int], ...] = ()


def _evidence(cell: str) -> Literal["", ".", ",", "weak"]:
    # Which mark this cell shows to be the decimal mark; "weak": one comma that may set thousands apart or be decimal.
    mantissa = re.split("[eE]", cell.strip(), maxsplit=1)[0].lstrip("+-")
    dots, commas = mantissa.count("."), mantissa.count(",")
    if dots and commas:
        last: Literal[".", ","] = "." if mantissa.rfind(".") > mantissa.rfind(",") else ","
        return last if _NOTATION[last].match(mantissa) else ""
    if dots + commas == 0:
        return ""
    mark: Literal[".", ","] = "." if dots else ","
    other: Literal[".", ","] = "," if dots else "."
    whole, _, fraction = mantissa.partition(mark)
    if dots + commas > 1:
        return other if re.fullmatch(_GROUPED.format(re.escape(mark)), mantissa) else ""
    if not (whole + fraction).isdigit():
        return ""
    if len(fraction) == 3 and 1 <= len(whole) <= 3 and not whole.startswith("0"):
        return "weak" if mark == "," else ""
    return mark


def decide_notation(columns: Sequence[Sequence[str]]) -> Notation:
    """The decimal mark of a file from all its number cells.

    A cell with both marks shows its decimal mark by the last one; a single mark not followed by exactly three digits, or
    after a leading zero, is decimal. One comma followed by three digits ("1,250") shows nothing by itself: if the whole
    file shows nothing else, it is refused. Cells that contradict each other are refused.

    Parameters
    ----------
    columns : the text of the cells, one sequence per column, equally long.
    """
    if not any("," in cell for cell in chain.from_iterable(columns)):
        return Notation(".")
    counts: dict[str, int] = {".": 0, ",": 0, "weak": 0}
    first: dict[str, tuple[int, int]] = {}
    for c, column in enumerate(columns):
        for r, cell in enumerate(column):
            if "," in cell or "." in cell:
                shown = _evidence(cell)
                if shown:
                    counts[shown] += 1
                    if shown not in first or (r, c) < first[shown]:
                        first[shown] = (r, c)
    if counts["."] and counts[","]:
        return Notation(
            "", f"{counts['.']} cell(s) have a decimal point and {counts[',']} a decimal comma", (first["."], first[","])
        )
    if counts["weak"] and not counts["."] and not counts[","]:
        return Notation(
            "", "the comma may set thousands apart or be the decimal mark, and no cell of the file tells", (first["weak"],)
        )
    return Notation("," if counts[","] else ".")


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column of numbers: `values` with nan where there is none, and the masks of empty, over-range and bad cells."""

    values: FloatArray
    empty: BoolArray
    over: BoolArray
    bad: BoolArray


def to_numbers(cells: Sequence[str], decimal: str) -> Numbers:
    """Numbers of a column of cells, all (n_row,). Values as written, before any unit; a bad cell is nan and marked.

    Over-range are the words of `is_over_range` and readings of `OVER_RANGE` and more.
    """
    joined = "\n".join(cells)
    if decimal == "," and "." not in joined:
        joined = joined.replace(",", ".")
    none = np.zeros(len(cells), dtype=bool)
    if _PLAIN.fullmatch(joined):
        try:
            values = np.array(joined.split("\n"), dtype=np.float64) if len(cells) else np.zeros(0)
        except ValueError:
            pass  # an empty or damaged cell: look at each
        else:
            if not np.any(np.abs(values) >= OVER_RANGE):
                return Numbers(values, none, none, none)
    values = np.full(len(cells), np.nan)
    empty, over, bad = none.copy(), none.copy(), none.copy()
    for i, cell in enumerate(cells):
        number = parse_number(cell, decimal)
        if number is not None and abs(number) < OVER_RANGE:
            values[i] = number
        elif number is not None or is_over_range(cell):
            over[i] = True
        elif is_missing(cell):
            empty[i] = True
        else:
            bad[i] = True
    return Numbers(values, empty, over, bad)
