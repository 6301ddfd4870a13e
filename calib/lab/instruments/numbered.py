"""From lines of comments that list the columns by their numbers to the names of these columns, in order."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.header import DELIMITERS, HEADER_WITHIN, split_line
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range
from calib.lab.instruments.text import LabText
from calib.lab.instruments.vocabulary import understand

# Marks before a comment, and words before the number of a column.
_MARKS = re.compile(r"^[\s#%!;/*\"]+")
_COLUMN = r"(?:col(?:umn|onne|umna|onna)?|spalte|field|feld|channel|chan|ch|kanal)s?"
_TITLE = re.compile(rf"^(?:(?:the|data|file)\s+)?(?:{_COLUMN})(?:\s+are)?\s*[:=]\s*", re.IGNORECASE)
# A number of a column with a mark behind it; without one in a line of its own.
_NUMBER = rf"(?:{_COLUMN})?\.?[ #_]*[\[(]?{{k}}(?:[\])]?\s*[:=)\]]|\.(?!\d)|\s-)\s*"
_ALONE = re.compile(
    rf"^(?:{_COLUMN})?\.?[ #_]*[\[(]?(?P<k>\d{{1,2}})[\])]?\s*(?:[:=.)–-]\s*|\s+)(?P<name>[^\d\s].*)$", re.IGNORECASE
)
# Letters of a name in a list, and of a list in one line.
_LONGEST, _LONGEST_LIST = 80, 4000


@dataclass(frozen=True)
class ListedHeader:
    """Names of the columns, in order; the lines from `first` to `last`, from 0, that list them; the delimiter of the rows.

    `above` is the last line above the rows that is not blank: the list itself, or a comment behind it.
    """

    names: tuple[str, ...]
    first: int
    last: int
    delimiter: str
    above: int


def listed_header(text: LabText) -> ListedHeader | None:
    """Find a list of the columns above the rows: "# Columns: 1: time (s) 2: z (um)", or a line each, "# col 1: time, s".

    It is one if its numbers follow each other from 0 or 1, if every row has as many cells as it has names, if two of the names
    or more are understood, and if nothing but comments stands between it and the rows.
    """
    rows = next((i for i, line in enumerate(text.lines[:HEADER_WITHIN]) if _delimiter(line) is not None), None)
    if rows is None:
        return None
    delimiter = _delimiter(text.lines[rows]) or " "
    width = len(split_line(text.lines[rows], delimiter))
    for first, last, names in _lists(text, rows):
        known = sum(understand(name) is not None for name in names)
        between = [i for i in range(last + 1, rows) if text.lines[i].strip()]
        if len(names) == width and known >= 2 and all(_MARKS.match(text.lines[i]) for i in between):
            return ListedHeader(tuple(names), first, last, delimiter, between[-1] if between else last)
    return None


def _delimiter(line: str) -> str | None:
    """Between the cells of a row of numbers; None for any other line."""
    for delimiter in DELIMITERS:
        cells = split_line(line, delimiter)
        if len(cells) > 1 and is_numeric(cells[0]) and all(map(_is_reading, cells)):
            return delimiter
    return None


def _is_reading(cell: str) -> bool:
    return is_numeric(cell) or is_clock(cell) or is_missing(cell) or is_over_range(cell)


def _lists(text: LabText, rows: int) -> Iterator[tuple[int, int, list[str]]]:
    """The lists above the rows: first and last line, and names."""
    lines = [_MARKS.sub("", line).strip() for line in text.lines[:rows]]
    for i, line in enumerate(lines):
        names = _in_one_line(_TITLE.sub("", line))
        if names:
            yield i, i, names
    for i in range(len(lines)):
        names = _line_by_line(lines[i:])
        if names:
            yield i, i + len(names) - 1, names


def _in_one_line(line: str) -> list[str]:
    """The names between numbers that follow each other in a line that begins with the first of them; [] without such."""
    if len(line) > _LONGEST_LIST:
        return []
    for start in (0, 1):
        ends: list[tuple[int, int]] = []
        at = 0
        for k in count(start):
            match = re.compile(rf"(?:^|(?<=[\s,;|])){_NUMBER.format(k=k)}", re.IGNORECASE).search(line, at)
            if match is None or (not ends and match.start()):
                break
            ends.append((match.start(), match.end()))
            at = match.end()
        if len(ends) > 1:
            names = [line[a:b] for (_, a), b in zip(ends, [*(s for s, _ in ends[1:]), len(line)], strict=True)]
            return [name.strip(" ,;|\t") for name in names]
    return []


def _line_by_line(lines: list[str]) -> list[str]:
    """The names of lines with a number each, which follow each other from the first line on; [] without two of them."""
    names: list[str] = []
    start = 0
    for line in lines:
        match = _ALONE.match(line) if len(line) <= _LONGEST else None
        if match is None or (names and int(match["k"]) != start + len(names)) or (not names and int(match["k"]) > 1):
            break
        start = start if names else int(match["k"])
        names.append(match["name"].strip(" ,;|\t"))
    return names if len(names) > 1 else []
