"""From lines of columns of a fixed width, in which a full cell touches the next, `-9.9-10.0`, to lines with a blank there."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import islice, pairwise

# Numbers alone in a line, with blanks or nothing between them, and two that touch.
_NUMBER = r"[-+]?\d*\.\d+(?:[eE][-+]\d{2,3})?"
_ONE = re.compile(_NUMBER)
_TOUCHING = re.compile(r"\.\d++(?:[eE][-+]\d{2,3})?+(?:[-+]\d*+)?+\.\d")
# What is left between two points without digits and exponents.
_BETWEEN = (b"..", b".-.", b".+.", b".--.", b".-+.", b".+-.", b".++.")
_WORD = re.compile(r"\S+")
# Rows that show that all lines have one length, among so many lines, and rows that show where cells end.
_FEWEST, _LOOKED_AT, _SHOWN = 5, 60, 2000
# Words above a first row in which names are looked for.
_ABOVE = 3
# Characters of a row.
_LONGEST = 400


def with_cells_apart(text: str) -> tuple[str, str]:
    """The text with a blank between the numbers that touch each other in lines of a fixed width, and a note; "" of any other.

    They are parted where cells end in the lines of the same length in which no digits touch, or else where the names above end,
    if every line has its decimal points at the same places.

    Parameters
    ----------
    text : of a file.

    >>> rows = [f"{0.1 * k:8.3f}{-99.8 - 0.1 * k:8.3f}" for k in range(6)]
    >>> with_cells_apart("\\n".join(rows))[0].split("\\n")[3].split()
    ['0.300', '-100.100']
    """
    beginning = text.split("\n", _LOOKED_AT)[:_LOOKED_AT]
    rows = list(islice((i for i, line in enumerate(beginning) if _is_of_numbers(line)), _FEWEST))
    if len(rows) < _FEWEST or len({len(beginning[i].rstrip()) for i in rows}) > 1 or not _may_touch(text):
        return "", ""
    lines = text.split("\n")
    there = [i for i, line in enumerate(lines) if _is_of_numbers(line)]
    ends = _ends(lines, there, rows[0])
    if not ends:
        return "", ""
    points = Counter(tuple(k for k, c in enumerate(lines[i]) if c == ".") for i in there[:_SHOWN]).most_common(1)[0][0]
    parted: list[int] = []
    for i in there:
        line = lines[i].rstrip()
        if len(line.split()) == len(ends) or len(line) != ends[-1]:
            continue
        if tuple(k for k, c in enumerate(line) if c == ".") == points:
            lines[i] = " ".join(line[a:b] for a, b in zip((0, *ends), ends, strict=False))
            parted.append(i)
    if not parted:
        return "", ""
    note = (
        f"numbers touch each other in {len(parted)} line(s), the first is line {parted[0] + 1}: they are parted where the "
        f"cells of the other lines, or the names above, end: behind the places {', '.join(map(str, ends[:-1]))}"
    )
    return "\n".join(lines), note


def numbers_in_one(line: str) -> str:
    """The first word of a line of numbers that is several which touch each other; "" if there is none.

    Parameters
    ----------
    line : that was not parted.

    >>> numbers_in_one("0.5-102.0002-1005.0043  96.49"), numbers_in_one("0.5 -102.0002"), numbers_in_one("v1.2.3 of 2.5")
    ('0.5-102.0002-1005.0043', '', '')
    """
    words = line.split() if _is_of_numbers(line.rstrip()) else []
    return next((word for word in words if word.count(".") > 1), "")


def _may_touch(text: str) -> bool:
    """Whether two decimal points stand in a text with nothing but digits, exponents and signs between them."""
    if not text.isascii():
        return _TOUCHING.search(text) is not None
    bare = text.encode("ascii").translate(None, b"0123456789eE")
    return any(marks in bare for marks in _BETWEEN)


def _is_of_numbers(line: str) -> bool:
    return len(line) < _LONGEST and line.count(".") > 1 and not _ONE.sub("", line).strip(" ")


def _ends(lines: Sequence[str], rows: Sequence[int], first: int) -> tuple[int, ...]:
    """The places behind which the cells of rows end, as they do in those in which none touch, else in the names above; ()."""
    found = Counter(ends for i in rows[:_SHOWN] if (ends := _ends_of_numbers(lines[i]))).most_common(2)
    if len(found) == 1:
        return found[0][0]
    n_point = lines[first].count(".")
    above = [line for line in lines[max(first - _ABOVE, 0) : first] if len(line.split()) == n_point]
    named = {_ends_of(line) for line in above}
    length = len(lines[first].rstrip())
    return named.pop() if not found and len(named) == 1 and all(e[-1] == length for e in named) else ()


def _ends_of(line: str) -> tuple[int, ...]:
    return tuple(match.end() for match in _WORD.finditer(line))


def _ends_of_numbers(line: str) -> tuple[int, ...]:
    """The places behind which the numbers of a line end; () if digits of one touch those of the next, without a sign."""
    spans = [match.span() for match in _ONE.finditer(line)]
    apart = all(end < start or line[start] in "+-" for (_, end), (start, _) in pairwise(spans))
    return tuple(end for _, end in spans) if apart else ()
