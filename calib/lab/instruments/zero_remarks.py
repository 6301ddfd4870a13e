"""From the words among the rows of a record, in its comments and columns of events, to the rows where a zero was set anew."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import quantity_of, speaks_of_zero

# A column of remarks or of events has no more kinds of them; so many rows show what is in it.
_KINDS, _SHOWN = 300, 2000
# Lines between two rows that are looked at.
_BETWEEN = 50


@dataclass(frozen=True)
class Remark:
    """Words among the rows by which a zero was set anew.

    Attributes
    ----------
    row : the first row, from 0, that may have another zero than those above.
    line : 1-based line in which the words stand.
    words : as written.
    column : the name of their column, "" for a line of its own.
    quantity : what was zeroed, where they say so; else "".
    """

    row: int
    line: int
    words: str
    column: str
    quantity: str

    def __str__(self) -> str:
        return f'"{self.words}" in line {self.line}' + (f' (column "{self.column}")' if self.column else "")


def zero_remarks(sheet: Sheet, used: Sequence[int]) -> list[Remark]:
    """Find the remarks among the rows of a record that say that a zero was set anew there, in order.

    A remark beside one row may be meant for it or for the next, either of which may be the first of another zero; one that
    stands in several rows names a step of the test, which another zero may begin and end with.

    Parameters
    ----------
    sheet : the record.
    used : indices of the columns that hold readings.
    """
    found = [*_of_lines(sheet)]
    for index, column in enumerate(sheet.columns):
        if index not in used:
            found += _of_column(sheet, index, column)
    return sorted(found, key=lambda remark: remark.row)


def _of_lines(sheet: Sheet) -> Iterator[Remark]:
    lines = sheet.lines
    for r in (np.flatnonzero(np.diff(lines) > 1) + 1).tolist():
        for line in range(max(int(lines[r - 1]) + 1, int(lines[r]) - _BETWEEN), int(lines[r])):
            text = sheet.text.lines[line - 1].strip()
            # Rows of another record may stand there, too.
            if text and not is_numeric(text.partition(sheet.delimiter)[0].strip(' "')) and speaks_of_zero(text):
                words = re.sub(r"[\s,;\"]+", " ", text).strip(" #%!/")
                yield Remark(r, line, words[:60], "", quantity_of(text) or "")


def _of_column(sheet: Sheet, index: int, column: Sequence[str]) -> Iterator[Remark]:
    if len(set(column[:_SHOWN])) > _KINDS:
        return
    kinds = set(column)
    speaking = {c for c in kinds if not is_numeric(c) and speaks_of_zero(c)} if len(kinds) <= _KINDS else set()
    if not speaking:
        return
    says = np.array([c in speaking for c in column])
    for r in (np.flatnonzero(says[1:] != says[:-1]) + 1).tolist():
        at = r if says[r] else r - 1
        words = column[at].strip()
        quantity = quantity_of(words) or quantity_of(sheet.names[index]) or ""
        yield Remark(r, int(sheet.lines[at]), words[:60], sheet.names[index] or str(index + 1), quantity)
