"""From a line of a lab file to whether its quotation marks set its cells apart: all in pairs, each pair around a whole cell."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.text import LabText

# Blanks that stand between the end of a cell in quotes and the delimiter.
_BLANKS = re.compile(r'" +(?=[,;\t|]|$)')
_ADVICE = "Close the quotation mark, remove it, or export the file again"


def is_misquoted(line: str, delimiter: str) -> bool:
    """Whether a cell begins in quotes and does not end with the next ones, so that cells, or lines, would run together.

    Parameters
    ----------
    line : of the file.
    delimiter : between cells; a blank stands for runs of blanks, between which quotes set nothing apart.

    >>> is_misquoted('0.1,0.5","1.2', ","), is_misquoted('0.1,"0.5"1.2', ","), is_misquoted('0.1, "5"" rod" ,1.2', ",")
    (True, True, False)
    """
    if delimiter == " " or '"' not in line:
        return False
    if line.count('"') % 2:
        return True
    try:
        list(csv.reader([_BLANKS.sub('"', line)], delimiter=delimiter, skipinitialspace=True, strict=True))
    except csv.Error:
        return True
    return False


def check_quotes(text: LabText, delimiter: str, first: int, lines: Sequence[str]) -> None:
    """Refuse lines in which cells would run together.

    Parameters
    ----------
    text : their file.
    delimiter : between cells.
    first : index of the first of them in the file, from 0.
    lines : to be looked at, in succession.

    Raises
    ------
    InputError
        With all such lines, up to a number.
    """
    odd = [first + i for i, line in enumerate(lines) if is_misquoted(line, delimiter)]
    if odd:
        faults = [Fault(_message(text.lines[i]), text.path, i + 1, advice=_ADVICE) for i in odd]
        raise InputError(capped(faults, "lines cannot be cut into cells"))


def _message(line: str) -> str:
    shown = line.strip()[:80]
    return f"a quotation mark is not closed where its cell ends: {shown}"
