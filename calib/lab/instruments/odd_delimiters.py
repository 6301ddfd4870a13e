"""From lines whose cells are parted by a mark that no program uses, `0.1~0.002~0.05`, to lines of cells between tabs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from calib.errors import Fault
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.numbers import is_missing, is_over_range, parse_number

# A number or a clock at the beginning of a line, the mark behind it, and what the next cell begins with. A dash, a plus and a
# star may belong to numbers, but with blanks on both sides.
_ROW = re.compile(
    r"[ \t]*\"?[-+\u2212]?\d(?:[\d.,:eE]{0,40}[\d.,])?(?:[eE][-+]\d+)?\"?"
    r"(?:[ \t]+(?P<apart>[-+*=>]{1,2})[ \t]+|[ \t]*(?P<mark>(?:[^\w\s.,;|'\"’()\[\]{}+\-*\u2212\u2013·×]|_){1,2})[ \t]*)"
    r"(?=[-+\u2212\"]?[.,]?\d|[a-zA-Z-])"
)
# Lines in which rows are looked for, how many must be alike, and how many lines of units may stand above them.
_LOOKED_AT, _FEWEST, _UNITS = 200, 3, 2
# Marks that times of day and dates have as well.
_OF_CLOCKS = (":", "/")


def mark_between_cells(lines: Sequence[str]) -> tuple[str, int, int]:
    """The mark between the numbers of the first rows of a file that no usual delimiter parts, their number and first line.

    Parameters
    ----------
    lines : of the file.

    Returns
    -------
    Mark, numbers in each row, and index of the first row; ("", 0, 0) if there is none.

    >>> mark_between_cells(["t~F", "0.1~0.2", "0.2~0.3", "0.3~0.4"]), mark_between_cells(["t;F", "1;2", "2;3", "4;5"])
    (('~', 2, 1), ('', 0, 0))
    """
    filled = list(islice((i for i, line in enumerate(lines) if line.strip()), _LOOKED_AT))
    for k, i in enumerate(filled[: -_FEWEST + 1]):
        match = _ROW.match(lines[i])
        if match is None:
            continue
        mark = match["mark"] or f" {match['apart']} "
        rows = [cells_between(lines[j], mark) for j in filled[k : k + 2 * _FEWEST]]
        if len({len(row) for row in rows}) == 1 and all(map(_is_row, rows)):
            return mark, len(rows[0]), i
        return "", 0, 0
    return "", 0, 0


def cells_between(line: str, mark: str) -> list[str]:
    """The cells of a line between a mark, blanks around them taken off.

    Parameters
    ----------
    line, mark : as written.
    """
    return [cell.strip() for cell in line.strip().split(mark)]


def _is_row(cells: Sequence[str]) -> bool:
    """Whether cells are those of a row: a number or a clock first, and others or nothing behind it."""
    plain = [cell.strip('" ') for cell in cells]
    others = (_is_reading(c) or is_missing(c) or is_over_range(c) for c in plain[1:])
    return len(plain) > 1 and _is_reading(plain[0]) and all(others)


def _is_reading(cell: str) -> bool:
    return is_clock(cell) or any(parse_number(cell, mark) is not None for mark in ".,")


def with_usual_delimiters(text: str) -> tuple[str, str]:
    """The text with tabs between its cells, where one mark parts names and rows into as many, and a note; "" of any other.

    Where no name stands above the rows, or another number of them, nothing shows which cell is which, or whether the mark
    belongs to a number, as that of a time of day does. Rows without anything above them are parted where it can be no such.

    Parameters
    ----------
    text : of a file.
    """
    mark, width, first = mark_between_cells(text.split("\n", 2 * _LOOKED_AT)[: 2 * _LOOKED_AT])
    if not mark:
        return "", ""
    lines = text.split("\n")
    above = [i for i in range(first - 1, -1, -1) if lines[i].strip()]
    header = -1
    for i in above[: _UNITS + 1]:  # names stand above units, if these are cells as well
        header = i if _are_names(lines[i], mark, width) else header
    if header < 0 and (above or mark.strip() in _OF_CLOCKS or mark.startswith(" ") or ">" in mark):
        return "", ""
    parted = [
        "\t".join(cells)
        if i >= header and mark.strip() in line and _belongs(cells := cells_between(line, mark), width)
        else line
        for i, line in enumerate(lines)
    ]
    note = f'the cells stand between "{mark.strip()}", {width} in each line from line {max(header, 0) + 1} on'
    return "\n".join(parted), note


def _are_names(line: str, mark: str, width: int) -> bool:
    """Whether a line has a word between the marks for each cell of the rows."""
    cells = cells_between(line.strip("#%! "), mark)
    return len(cells) == width and not any(map(_is_reading, cells)) and sum(any(map(str.isalpha, c)) for c in cells) > 1


def _belongs(cells: Sequence[str], width: int) -> bool:
    return len(cells) == width or _is_reading(cells[0])


def parted_oddly(path: Path, lines: Sequence[str]) -> Fault | None:
    """The fault of rows between a mark that no program uses, which names do not show to be cells; None of any other rows.

    Parameters
    ----------
    path, lines : of the file.
    """
    mark, width, first = mark_between_cells(lines)
    if not mark:
        return None
    shown, mark = lines[first].strip()[:60], mark.strip()
    but = ", but not for those within times of day or dates" if mark in _OF_CLOCKS else ""
    return Fault(
        f'"{shown}" seems to be {width} cells between "{mark}", and no line above names as many',
        path,
        first + 1,
        advice=f'Write a semicolon for each "{mark}" between cells{but}, and a line of names above the rows, one for each '
        "cell, such as Time (s);Force (N)",
    )
