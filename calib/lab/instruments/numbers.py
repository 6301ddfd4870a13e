"""From number cells as written, in either decimal notation, to numbers; refusing what is ambiguous or damaged."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress, islice

import numpy as np

from models.sensor import BoolArray, FloatArray

#: What instruments and programs write for "no reading" is at least this (9.9E37, 1E+30, 9.99999E+28): no unit makes it one.
OVER_RANGE = 1e20

#: What may set thousands apart besides a mark, and signs; both for a character class of a pattern.
SPACES = "'’ \u00a0\u202f\u2009"
SIGNS = "+\\-\u2212\u2013"
# Digits with any marks between them, and an exponent: a number in some notation.
_NUMERIC = re.compile(rf"[{SIGNS}]?[\d.,{SPACES}]+(?:[eE][{SIGNS}]?\d+)?", re.ASCII)
_LONGEST_NUMBER = 60
# The usual one, recognised at once.
_USUAL = re.compile(r"-?\d{1,12}[.,]?\d{0,12}", re.ASCII)
_NOT_NUMERIC = re.compile(
    rf"\n(?![ \t]*+[{SIGNS}]?+(?=[.,{SPACES}]*+\d)[\d.,{SPACES}]++(?:[eE][{SIGNS}]?\d++)?[ \t]*+$)", re.ASCII | re.MULTILINE
)
# Cells that `float` reads as they stand, or once a comma is made a point.
_PLAIN = {mark: re.compile(rf"[0-9{re.escape(mark)}eE+\-\n]*", re.ASCII) for mark in ".,"}
_OVER_WORD = re.compile(
    r"over|under|ovld|ovf?l|ovrld|ovf|ovrflw|ov\d+|ofl|[+-]?ol|o\.l|(?-i:ERR(?:OR)?|FAIL(?:ED)?|INVALID|OVR)|"
    r"err(?:or)?[ ._-]?\d{1,3}|overload|overflow|over ?range|out of range|"
    r"underflow|under ?range|(?-i:[OU]F)|[+-]?inf(?:inity)?|[+-]?1\.#inf0*|-+[.,]-+|-{2,}|\*{2,}|#{2,}",
    re.IGNORECASE,
)
_MISSING = re.compile(
    r"|[+-]?nan(?:\((?:s?ind|[qs]nan)\))?|[+-]?1\.#(?:[qs]?nan|ind)0*|#?n/?a|n\.a\.|#nv|#(?:value|wert|valeur|valor)!|"
    r"#(?:div|/)/?0!|null|none|-|–|—|missing|no ?data|nicht bekannt|unknown",
    re.IGNORECASE,
)
# What a spreadsheet program writes for an error, in its language: "#BEZUG!", "#¿NOMBRE?", "#DEĞER!", "#N/D", and "Err:502".
_ERROR = re.compile(
    r"#[¡¿]?[^\W\d_][\w/.'’ ]{0,20}[!?]|#(?:N/[DBV]|Н/Д|I/T|YOK|PUUTTUU|HIÁNYZIK|NENÍ_K_DISPOZICI|NEDOSTUPNÝ|GETTING_DATA)|"
    r"(?:ERR|ERROR|ERREUR|ERRORE|ERRO|FEHLER|FOUT|FEL|FEJL|FEIL|VIRHE|BŁĄD|CHYBA|HIBA|HATA|ОШИБКА|ПОМИЛКА) ?: ?5\d\d"
)
#: The exponent of a number, for patterns.
EXPONENT = rf"[eE][{SIGNS}]?\d+"


def _grammar(mark: str, other: str) -> str:
    """What a number with the decimal mark `mark` looks like; thousands by the other mark, an apostrophe or a blank.

    None of its parts gives back what it took, as none could do with less: that makes a search three times as fast.
    """
    point = re.escape(mark)
    plain = rf"\d++(?:{point}\d*+)?+|{point}\d++"
    grouped = rf"[1-9]\d{{0,2}}+(?:[{other}{SPACES}]\d{{3}})++(?:{point}\d*+)?+"
    if mark == ".":  # 1,06,600 as in India: thousands, and hundreds of them
        grouped = rf"[1-9]\d?+(?:,\d{{2}}(?=,))++,\d{{3}}(?:{point}\d*+)?+|{grouped}"
    return rf"[ \t]*+[{SIGNS}]?+(?:{grouped}|{plain})(?:{EXPONENT})?+[ \t]*+"


_GRAMMAR = {".": _grammar(".", ","), ",": _grammar(",", ".")}
_NUMBER = {mark: re.compile(rf"{grammar}\Z", re.ASCII) for mark, grammar in _GRAMMAR.items()}
# Where a cell of a column, each after a line end, is no such number (a literal "\n" is searched for twice as fast as "^").
_NOT_A_NUMBER = {mark: re.compile(rf"\n(?!{grammar}$)", re.ASCII | re.MULTILINE) for mark, grammar in _GRAMMAR.items()}
_APART = {".": f",{SPACES}\t", ",": f".{SPACES}\t"}


def is_numeric(cell: str) -> bool:
    """Whether a cell looks like a number in any notation."""
    if _USUAL.fullmatch(cell):
        return True
    cell = cell.strip()
    return len(cell) <= _LONGEST_NUMBER and _NUMERIC.fullmatch(cell) is not None and any(c in "0123456789" for c in cell)


def not_numbers(cells: Sequence[str], most: int) -> list[int] | None:
    """Find the cells of a column that are no numbers, all at once, as a file of a million rows needs; see `is_numeric`.

    Parameters
    ----------
    cells : of a column.
    most : how many of them are worth a look.

    Returns
    -------
    Their rows from 0; None if there are more than `most`.
    """
    return odd_cells(_NOT_NUMERIC, cells, most)


def is_over_range(cell: str) -> bool:
    """Whether a cell is a word by which an instrument says that it has no reading: OVER, OV01, OL, OF, dashes or stars.

    >>> [is_over_range(cell) for cell in ("OV01", "----", "--.--", "OF", "of", "over it", "-")]
    [True, True, True, True, False, False, False]
    """
    return _OVER_WORD.fullmatch(cell.strip()) is not None


def is_dashes(cell: str) -> bool:
    """Whether a cell is two dashes or more, with or without the decimal mark: no reading, over-range or of a slower meter."""
    return len(cell := cell.strip()) > 1 and not cell.strip("-.,") and cell.count("-") > 1


def is_hidden(cell: str) -> bool:
    """Whether a cell shows what a spreadsheet program does in place of a number for which its column is too narrow."""
    return len(cell := cell.strip()) > 1 and not cell.strip("#")


def is_missing(cell: str) -> bool:
    """Whether a cell is empty or says that nothing is there (nan, #N/A, nicht bekannt), or what a spreadsheet has for an error.

    >>> [is_missing(cell) for cell in ("", "#N/A", "#BEZUG!", "#¡DIV/0!", "#ЗНАЧ!", "Err:502", "#Note!", "# N!", "0")]
    [True, True, True, True, True, True, False, False, False]
    """
    return _MISSING.fullmatch(cell := cell.strip()) is not None or is_error_of_spreadsheet(cell)


def is_error_of_spreadsheet(cell: str) -> bool:
    """Whether a cell is what a spreadsheet program writes, in any of its languages, where a formula has no result."""
    if cell[:1] == "#":
        return cell == cell.upper() and _ERROR.fullmatch(cell) is not None
    return cell[:1].isalpha() and cell[-1:].isdigit() and _ERROR.fullmatch(cell.upper()) is not None


def parse_number(cell: str, decimal: str) -> float | None:
    """The number a cell holds in the notation with this decimal mark; None if it holds none.

    Thousands may be set apart by the other mark, an apostrophe or a blank, in full groups of three only.

    Parameters
    ----------
    cell : as written.
    decimal : "." or ",".

    >>> parse_number("1,000.06200", "."), parse_number("1.000,062", ","), parse_number("0,9966", ".")
    (1000.062, 1000.062, None)
    """
    if len(cell) > _LONGEST_NUMBER or _NUMBER[decimal].match(cell) is None:
        return None
    number = "".join(c for c in cell if c not in _APART[decimal])
    return float(number.replace(",", ".").replace("\u2212", "-").replace("\u2013", "-"))


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column of numbers: `values` with nan where there is none, and the masks of empty, over-range and bad cells."""

    values: FloatArray
    empty: BoolArray
    over: BoolArray
    bad: BoolArray


def to_numbers(cells: Sequence[str], decimal: str) -> Numbers:
    """Read a column of cells as numbers, before any unit, and mark the cells that hold none and why.

    Over-range are the words of `is_over_range` and readings of `OVER_RANGE` and more.

    Parameters
    ----------
    cells : of a column, (n_row,).
    decimal : the file's decimal mark, "." or ",".
    """
    n = len(cells)
    values = np.full(n, np.nan)
    empty, over, bad = (np.zeros(n, dtype=bool) for _ in range(3))
    if n == 0:
        return Numbers(values, empty, over, bad)
    if "" in cells:
        empty = ~np.fromiter(map(bool, cells), np.bool_, n)
        there = to_numbers(list(compress(cells, cells)), decimal)
        for column, of in ((values, there.values), (over, there.over), (bad, there.bad)):
            column[~empty] = of
        empty[~empty] = there.empty
        return Numbers(values, empty, over, bad)
    joined = "\n".join(cells)
    plain = _plain_numbers(joined, cells, decimal)
    if plain is not None:
        over = np.abs(plain) >= OVER_RANGE
        return Numbers(np.where(over, np.nan, plain), empty, over, bad)
    odd: Sequence[int] = range(n)
    if joined.count("\n") == n - 1:
        odd = odd_cells(_NOT_A_NUMBER[decimal], cells, n) or []
        regular = np.ones(n, dtype=bool)
        regular[list(odd)] = False
        text = "\n".join(c for c, r in zip(cells, regular.tolist(), strict=True) if r) if odd else joined
        if not _PLAIN[decimal].fullmatch(text):
            for mark in _APART[decimal]:
                text = text.replace(mark, "")
            text = text.replace("\u2212", "-").replace("\u2013", "-")
        if len(odd) < n:
            values[regular] = np.array(text.replace(",", ".").split("\n"), dtype=np.float64)
        over = np.abs(values) >= OVER_RANGE
        values[over] = np.nan
    for i in odd:
        cell = cells[i]
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


def numbers_in(cells: Sequence[str], decimal: str = "") -> FloatArray:
    """The numbers of cells in the notation that makes most of them numbers, nan where there is none.

    What a column is read by is decided by `decide_notation`; this is for looking at columns that are not read.

    Parameters
    ----------
    cells : of a column.
    decimal : the decimal mark that the file states, which is taken where both make as many; "" if it states none.

    >>> numbers_in(["0,5", " 1,25", "x"]).tolist(), numbers_in(["1,250"], ",").tolist()
    ([0.5, 1.25, nan], [1.25])
    """
    plain = [c.strip() for c in cells]
    likely, other = (",", ".") if decimal == "," else (".", ",")
    numbers = to_numbers(plain, likely).values
    if np.all(np.isfinite(numbers)):
        return numbers
    return max(numbers, to_numbers(plain, other).values, key=lambda values: int(np.count_nonzero(np.isfinite(values))))


def _plain_numbers(joined: str, cells: Sequence[str], decimal: str) -> FloatArray | None:
    """The numbers of a column, joined by line ends, if each is written as `float` reads it; None if one is not."""
    if _PLAIN[decimal].fullmatch(joined) is None or joined.count("\n") != len(cells) - 1:
        return None
    numbers = cells if decimal == "." else joined.replace(",", ".").split("\n")
    try:
        return np.fromiter(map(float, numbers), np.float64, len(cells))
    except ValueError:
        return None


def odd_cells(odd: re.Pattern[str], cells: Sequence[str], most: int) -> list[int] | None:
    """Find the cells of a column that a pattern finds, all at once, as a file of a million rows needs.

    Parameters
    ----------
    odd : the pattern; each cell stands after a line end.
    cells : of a column.
    most : how many of them are worth a look.

    Returns
    -------
    Their rows from 0; None if there are more than `most`.
    """
    starts = [m.start() for m in islice(odd.finditer("\n" + "\n".join(cells)), most + 1)]
    if not starts or len(starts) > most:
        return None if starts else []
    begins = np.cumsum(np.fromiter(map(len, cells), np.int64, len(cells)) + 1)
    return list(map(int, np.searchsorted(begins, starts, side="right").tolist()))
