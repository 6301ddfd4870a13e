"""From the marks of footnotes in a header, `Force (N)*`, to what is said of them and of the lines that begin with them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from calib.lab.instruments.brackets import footnote_of
from calib.lab.instruments.header import split_line, without_comment_mark
from calib.lab.instruments.sheet import Sheet

# The mark that a line begins with: "* tared", "¹ half of it", "1) tared", "(a) tared".
_BEGINS = re.compile(
    r"[\s\"',;\t]*(?:#\s*)?(?:\(?(?P<figure>[1-9a-c])\)|(?P<raised>[¹²³⁴-⁹])\)?|\(?(?P<mark>[*†‡§¶]{1,3})\)?)[\s:=.-]*"
    r"(?P<text>[^\W_].*?)[\s\"',;\t]*"
)
_LONGEST = 200


@dataclass(frozen=True)
class Footnote:
    """The mark at a column, and the line that begins with it, 0 and "" where there is none."""

    mark: str
    line: int = 0
    text: str = ""


def footnotes(sheet: Sheet, lines: Iterable[tuple[int, str]]) -> Mapping[int, Footnote]:
    """The footnotes of the columns of a record: cell index -> mark, and the first line that begins with it.

    Parameters
    ----------
    sheet : the record.
    lines : 1-based number and text of the lines around it.
    """
    below = _cells_of_units(sheet)
    marks = {
        i: mark
        for i, name in enumerate(sheet.names)
        if (mark := footnote_of(name) or footnote_of(below.get(i, ""), of_unit=True))
    }
    if not marks:
        return {}
    begun: dict[str, tuple[int, str]] = {}
    for number, line in lines:
        match = _BEGINS.fullmatch(line) if len(line) <= _LONGEST else None
        if match is not None:
            mark = match["figure"] or match["raised"] or match["mark"]
            begun.setdefault(unicodedata.normalize("NFKC", mark), (number, match["text"]))
    return {i: Footnote(mark, *begun.get(mark, (0, ""))) for i, mark in marks.items()}


def _cells_of_units(sheet: Sheet) -> Mapping[int, str]:
    """The cells of the row of units as they stand in the file."""
    if sheet.units_line is None:
        return {}
    line = without_comment_mark(sheet.text.lines[sheet.units_line - 1], sheet.delimiter)
    return dict(enumerate(split_line(line, sheet.delimiter)))


def in_words(name: str, footnote: Footnote) -> str:
    """The note on a column with the mark of a footnote.

    Parameters
    ----------
    name, footnote : of the column.

    >>> in_words("Force (N)*", Footnote("*", 95, "tared"))
    '"Force (N)*": the mark "*" of a footnote is passed by; line 95 says "tared"'
    """
    says = f'; line {footnote.line} says "{" ".join(footnote.text.split())[:80]}"' if footnote.line else ""
    return f'"{name}": the mark "{footnote.mark}" of a footnote is passed by{says}'
