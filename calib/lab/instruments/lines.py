"""What a line below the header is (a row, the header again, text), and what the rows of one record become: a `Table`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from calib.lab.instruments.clock import is_clock
from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.vocabulary import understand

#: Rows of a second table that are too many to be left out as one of results.
FEW_ROWS = 10


@dataclass(frozen=True, eq=False)
class Table:
    """The rows of one record: columns of cells, as many as the header has, 1-based lines, and notes on what was left out."""

    columns: Sequence[Sequence[str]]
    lines: IntArray
    notes: Sequence[str]


def n_named(sheet: Sheet) -> int:
    """Count the columns up to the last that has a name."""
    return max((i + 1 for i, name in enumerate(sheet.names) if name), default=0)


def left_out(sheet: Sheet, indices: Sequence[int]) -> list[str]:
    """Write the note on lines of text that are left out; no note if there are none.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0.
    """
    if not indices:
        return []
    shown = sheet.text.lines[indices[0]].strip()[:80]
    return [f'{len(indices)} line(s) of text left out, the first is "{shown}" (line {indices[0] + 1})']


def kind_of_line(row: Sequence[str], header: Sequence[str], keys: Sequence[int], width: int) -> str:
    """Tell what a line below the header is: "header" again, "row", or "text".

    Parameters
    ----------
    row : its cells.
    header : those of the header, () if it cannot stand again.
    keys : columns that are understood, by index.
    width : columns of the header.
    """
    key = keys[0] if keys else 0
    if min(width, 2) <= len(row) > key and is_numeric(row[key]):
        return "row"
    cells = [c.strip() for c in row]
    if cells == list(header):
        return "header"
    there = [cells[i] for i in keys if i < len(cells)]
    numbers = sum(is_numeric(c) or is_clock(c) for c in there)
    nothing = sum(is_missing(c) or is_over_range(c) for c in there)
    first = next((c for c in cells if c), "")
    worded = not (is_numeric(first) or is_over_range(first) or is_clock(first) or is_missing(first))
    if worded and len(cells) < width and not any(map(is_numeric, cells[2:])):
        return "text"  # `key,value` below the table
    if numbers == 0 and not (nothing and not worded):
        return "text"
    return "row"


def is_other_header(row: Sequence[str]) -> bool:
    """Whether a line of text names columns of another table: two of its cells are understood."""
    return sum(understand(c.strip()) is not None for c in row if c.strip()) >= 2
