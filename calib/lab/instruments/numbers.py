"""From number cells as written, in either decimal notation, to numbers; refusing what is ambiguous or damaged."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import compress, islice

import numpy as np

from models.sensor import BoolArray, FloatArray

#: What the meters write for "no reading" on their bus is at least this.
OVER_RANGE = 9.9e37

_SPACES = "'’ \u00a0\u202f\u2009"
_MARKS = "+\\-\u2212"
# Digits with any marks between them, and an exponent: a number in some notation.
_NUMERIC = re.compile(rf"[{_MARKS}]?[\d.,{_SPACES}]+(?:[eE][{_MARKS}]?\d+)?", re.ASCII)
_LONGEST_NUMBER = 60
# The usual one, recognised at once.
_USUAL = re.compile(r"-?\d{1,12}[.,]?\d{0,12}", re.ASCII)
_NOT_NUMERIC = re.compile(
    rf"\n(?![ \t]*+[{_MARKS}]?+(?=[.,{_SPACES}]*+\d)[\d.,{_SPACES}]++(?:[eE][{_MARKS}]?\d++)?[ \t]*+$)", re.ASCII | re.MULTILINE
)
# Cells that `float` reads as they stand, or once a comma is made a point.
_PLAIN = {mark: re.compile(rf"[0-9{re.escape(mark)}eE+\-\n]*", re.ASCII) for mark in ".,"}
_OVER_WORD = re.compile(
    r"over|under|ovld|ovl|ovrld|ov\d+|ol|o\.l|overload|overflow|over ?range|out of range|[+-]?inf|-{2,}|\*{2,}|#{2,}",
    re.IGNORECASE,
)
_MISSING = re.compile(r"|nan|n/?a|null|none|-|nicht bekannt|unknown", re.IGNORECASE)
_EXPONENT = rf"[eE][{_MARKS}]?\d+"


def _grammar(mark: str, other: str) -> str:
    """What a number with the decimal mark `mark` looks like; thousands by the other mark, an apostrophe or a blank."""
    point = re.escape(mark)
    plain = rf"\d+(?:{point}\d*)?|{point}\d+"
    grouped = rf"[1-9]\d{{0,2}}(?:[{other}{_SPACES}]\d{{3}})+(?:{point}\d*)?"
    return rf"[ \t]*[{_MARKS}]?(?:{plain}|{grouped})(?:{_EXPONENT})?[ \t]*"


_GRAMMAR = {".": _grammar(".", ","), ",": _grammar(",", ".")}
_NUMBER = {mark: re.compile(rf"{grammar}\Z", re.ASCII) for mark, grammar in _GRAMMAR.items()}
# Where a cell of a column, each after a line end, is no such number (a literal "\n" is searched for twice as fast as "^").
_NOT_A_NUMBER = {mark: re.compile(rf"\n(?!{grammar}$)", re.ASCII | re.MULTILINE) for mark, grammar in _GRAMMAR.items()}
_APART = {".": re.compile(f"[,{_SPACES}\t]"), ",": re.compile(f"[.{_SPACES}\t]")}


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
    return _odd_cells(_NOT_NUMERIC, cells, most)


def is_over_range(cell: str) -> bool:
    """Whether a cell is a word by which an instrument says that it has no reading: OVER, OV01, OL, dashes or stars.

    >>> is_over_range("OV01"), is_over_range("----"), is_over_range("over it")
    (True, True, False)
    """
    return _OVER_WORD.fullmatch(cell.strip()) is not None


def is_missing(cell: str) -> bool:
    """Whether a cell is empty or says that nothing is there (nan, n/a, nicht bekannt)."""
    return _MISSING.fullmatch(cell.strip()) is not None


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
    return float(_APART[decimal].sub("", cell).replace(",", ".").replace("\u2212", "-"))


@dataclass(frozen=True)
class Notation:
    """The decimal mark of a file, or, if the file leaves it open, why: `conflict` says it, with the places of the cells."""

    decimal: str
    conflict: str = ""
    places: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class _Shown:
    """Where a cell of a column, each after a line end, shows which mark is the decimal one.

    certain : by any form that does.
    twice : by the other mark, standing twice.
    unsure : cells whose one mark may as well set thousands apart.
    """

    mark: str
    certain: re.Pattern[str]
    twice: re.Pattern[str]
    unsure: re.Pattern[str]

    def search(self, text: str) -> re.Match[str] | None:
        """The first cell that shows it."""
        # Without the mark itself only one form is left, and looked for several times as fast.
        return (self.certain if self.mark in text else self.twice).search(text)


def _shown(mark: str) -> _Shown:
    other = "," if mark == "." else "."
    point, apart = re.escape(mark), re.escape(other)
    sign = rf"\n[ \t]*[{_MARKS}]?"
    end = rf"(?:{_EXPONENT})?[ \t]*$"
    twice = rf"[1-9]\d{{0,2}}(?:{apart}\d{{3}}){{2,}}{end}"  # the other mark twice: it sets thousands apart
    strong = "|".join(
        (
            rf"[1-9]\d{{0,2}}(?:[{apart}{_SPACES}]\d{{3}})+{point}\d*{end}",  # both marks: the last is the decimal one
            twice,
            rf"\d*{point}(?:\d{{0,2}}|\d{{4,}}){end}",  # not three digits after it
            rf"(?:0\d*|\d{{4,}}|){point}\d{{3}}{end}",  # nothing, a leading zero or four digits before it
            rf"\d+{point}\d{{3}}{_EXPONENT}[ \t]*$",  # an exponent
        )
    )
    unsure = rf"[1-9]\d{{0,2}}{point}\d{{3}}[ \t]*$"
    patterns = (re.compile(rf"{sign}(?:{form})", re.MULTILINE | re.ASCII) for form in (strong, twice, unsure))
    return _Shown(mark, *patterns)


_SHOWN = {mark: _shown(mark) for mark in ".,"}
# After a line end: a whole number of a hundred or more without any mark, other than the nines that stand for no reading.
_WHOLE = re.compile(rf"\n[ \t]*[{_MARKS}]?(?!9{{6}}\b)\d{{3,}}[ \t]*$", re.MULTILINE | re.ASCII)
# With a mark: one or more digits other than a leading zero before it; nothing or zero before it and not three digits after it.
_ONE_AND_MORE = {m: re.compile(rf"\n[ \t]*[{_MARKS}]?[1-9]\d*{re.escape(m)}(\d*)[ \t]*$", re.M | re.A) for m in ".,"}
_BELOW_ONE = {m: re.compile(rf"\n[ \t]*[{_MARKS}]?0?{re.escape(m)}(\d*)[ \t]*$", re.M | re.A) for m in ".,"}


def decide_notation(columns: Sequence[Sequence[str]], declared: str = "") -> Notation:
    """Tell from all number cells of a file whether its decimal mark is a point or a comma, and refuse to guess.

    A cell with both marks shows its decimal mark by the last one; a single mark not followed by exactly three digits, after a
    leading zero, or before an exponent is decimal. One mark followed by three digits ("1,250") shows nothing by itself: a comma
    is refused if the whole file shows nothing else, a point only where whole numbers stand in the same column ("999", "1.000").
    Cells that contradict each other are refused; so is a column whose values below one have other than three decimals
    while all those above have exactly three: a spreadsheet has taken their decimal mark for a thousands mark ("0,9966",
    "10,114").

    Parameters
    ----------
    columns : the text of the cells, one sequence per column, equally long.
    declared : the decimal mark that the file itself states, "" if it states none.
    """
    texts = ["\n" + "\n".join(column) for column in columns]

    def first(search: Callable[[str], re.Match[str] | None]) -> tuple[int, int] | None:
        hits = [(text.count("\n", 0, m.start()), c) for c, text in enumerate(texts) if (m := search(text))]
        return min(hits, default=None)

    comma = any("," in text for text in texts)
    strong = {mark: first(_SHOWN[mark].search) for mark in ".,"} if comma else {".": None, ",": None}
    weak = {mark: first(_SHOWN[mark].unsure.search) for mark in ".,"} if comma else {".": None, ",": None}
    if strong["."] and strong[","]:
        return Notation("", "some cells have a decimal point and some a decimal comma", (strong["."], strong[","]))
    decimal = "." if strong["."] or not comma else "," if strong[","] else declared
    if declared and declared != decimal:
        place = strong[decimal]
        return Notation("", f'the file declares the decimal mark "{declared}", a cell shows another', (place,) if place else ())
    if not decimal:
        if weak[","]:
            return Notation(
                "", "the comma may set thousands apart or be the decimal mark, and no cell of the file tells", (weak[","],)
            )
        decimal = "."
    other = "," if decimal == "." else "."
    for c, text in enumerate(texts):
        if decimal not in text:
            continue
        apart = _SHOWN[decimal].unsure.search(text)
        if not declared and apart and _WHOLE.search(text) and not _SHOWN[decimal].search(text):
            whole = _WHOLE.search(text)
            assert whole is not None
            places = tuple(sorted((text.count("\n", 0, m.start()), c) for m in (whole, apart)))
            return Notation("", f'"{decimal}" may set thousands apart or be the decimal mark: whole numbers beside it', places)
        if apart and other not in text:
            below = {len(m) for m in _BELOW_ONE[decimal].findall(text)} - {0}
            above = {len(m) for m in _ONE_AND_MORE[decimal].findall(text)}
            if above == {3} and below and min(below) > 3:
                small = next(m for m in _BELOW_ONE[decimal].finditer(text) if len(m[1]) > 3)
                places = tuple(sorted((text.count("\n", 0, m.start()), c) for m in (small, apart)))
                return Notation("", "values below one have more decimals than three, all others exactly three", places)
    return Notation(decimal)


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
    joined = "\n".join(cells)
    odd: Sequence[int] = range(n)
    if joined.count("\n") == n - 1:
        odd = _odd_cells(_NOT_A_NUMBER[decimal], cells, n) or []
        regular = np.ones(n, dtype=bool)
        regular[list(odd)] = False
        text = "\n".join(c for c, r in zip(cells, regular.tolist(), strict=True) if r) if odd else joined
        if not _PLAIN[decimal].fullmatch(text):
            text = _APART[decimal].sub("", text).replace("\u2212", "-")
        if len(odd) < n:
            values[regular] = np.array(text.replace(",", ".").split("\n"), dtype=np.float64)
        over = np.abs(values) >= OVER_RANGE
        values[over] = np.nan
    for i in odd:
        cell = cells[i]
        if not cell:
            empty[i] = True
            continue
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


def _odd_cells(odd: re.Pattern[str], cells: Sequence[str], most: int) -> list[int] | None:
    """Which cells `odd` finds if each stands after a line end; None if more than `most`."""
    starts = [m.start() for m in islice(odd.finditer("\n" + "\n".join(cells)), most + 1)]
    if not starts or len(starts) > most:
        return None if starts else []
    begins = np.cumsum([0, *(len(c) + 1 for c in cells[:-1])])
    return [int(i) for i in np.searchsorted(begins, starts)]


# ------------------------------------------------------------------------------------------------------------- clock times

_CLOCK = re.compile(
    r"^\s*(?P<date>\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})?[ T]*(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d+)?)\s*"
    r"(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?:Z|[+-]\d{2}:?\d{2})?\s*$"
)
# The usual one, with a date or without, recognised and read at once; the next finds the date.
_USUAL_CLOCK = r"(?:\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}[ T]+)?\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?"
_NOT_USUAL_CLOCK = re.compile(rf"\n(?!{_USUAL_CLOCK}$)", re.ASCII | re.MULTILINE)
_DATE = re.compile(r"^[\d/.-]+[ T]+", re.ASCII | re.MULTILINE)
_DAY = 86400.0


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day, with or without a date: "12:30:01.25", "2024-05-02 12:30:01"."""
    return _CLOCK.match(cell) is not None


def not_clocks(cells: Sequence[str], most: int) -> list[int] | None:
    """Find the cells of a column that are no time of day as usually written, all at once, as `not_numbers` does for numbers.

    Parameters
    ----------
    cells : of a column.
    most : how many of them are worth a look.

    Returns
    -------
    Their rows from 0; None if there are more than `most`.
    """
    return _odd_cells(_NOT_USUAL_CLOCK, cells, most)


def clock_seconds(cells: Sequence[str]) -> FloatArray:
    """Seconds since the first midnight of times of day (n_row,); nan where a cell is none.

    A fall by more than half a day is a midnight.
    """
    odd = not_clocks(cells, len(cells)) or []
    regular = np.ones(len(cells), dtype=bool)
    regular[odd] = False
    parts = np.full((len(cells), 3), np.nan)
    if np.any(regular):
        text = _DATE.sub("", "\n".join(compress(cells, regular)))
        numbers = np.array(text.replace(",", ".").replace(":", "\n").split("\n"), dtype=np.float64)
        parts[regular] = numbers.reshape(-1, 3)
    for i in odd:
        match = _CLOCK.match(cells[i])
        if match is not None:
            hour = int(match["hour"])
            if match["half"]:
                hour = hour % 12 + (12 if match["half"][0] in "pP" else 0)
            parts[i] = hour, int(match["minute"]), float(match["second"].replace(",", "."))
    parts[(parts[:, 0] > 23) | (parts[:, 1] > 59) | (parts[:, 2] >= 61)] = np.nan
    values = np.asarray(3600.0 * parts[:, 0] + 60.0 * parts[:, 1] + parts[:, 2])
    there = np.isfinite(values)
    values[there] += _DAY * np.cumsum(np.diff(values[there], prepend=0.0) < -_DAY / 2)
    return values
