"""From a log of a meter's replies, lines without a header, to a `Sheet` with names; what a reply looks like says the family."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText

#: A number in a reply, for patterns.
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
#: The group "time" for what a host may write before a reply.
TIME = r"(?:(?P<time>\d[\d:./\- T]*)\s*[,;\t]\s*)?"


def reply_table(
    text: LabText, pattern: re.Pattern[str], cells_of: Callable[[re.Match[str]], Mapping[str, str] | None]
) -> Sheet | None:
    """Replies as a table, so that a log without a header is read like any other: each reply a row with its line.

    Parameters
    ----------
    text : the file.
    pattern : what each of its lines must match.
    cells_of : a match -> header cell with unit -> cell; None for a line that is left out.

    Returns
    -------
    None if the file does not hold such replies.

    Raises
    ------
    InputError
        If a line among the replies is none, or names other values than the first.
    """
    seen = [line for line in text.lines[:20] if line.strip()]
    if len(seen) < 2 or not all(map(pattern.match, seen)):
        return None
    rows: list[list[str]] = []
    lines: list[int] = []
    faults: list[Fault] = []
    names: list[str] = []
    for number, line in enumerate(text.lines, 1):
        match = pattern.match(line)
        cut_short = not text.ended and number == len(text.lines)
        if match is None:
            if line.strip() and not cut_short:
                faults.append(Fault(f'"{line.strip()[:60]}" stands among the replies', text.path, number, 1))
            continue
        found = cells_of(match)
        if found is None or cut_short:
            continue
        names = names or list(found)
        if list(found) != names:
            there, first = ", ".join(found), ", ".join(names)
            faults.append(Fault(f"the reply holds {there}, the first one {first}", text.path, number, 1))
            continue
        rows.append(list(found.values()))
        lines.append(number)
    if faults:
        raise InputError(capped(faults, "lines cannot be read"))
    return _sheet(text, names, rows, lines) if rows else None


def _sheet(text: LabText, names: Sequence[str], rows: list[list[str]], lines: list[int]) -> Sheet:
    columns, places = tuple(zip(*rows, strict=True)), np.array(lines, dtype=np.int64)
    return Sheet(text, ",", 0, tuple(names), declared_decimal=".", columns=columns, lines=places)


def time_cell(match: re.Match[str]) -> dict[str, str]:
    """The cell of the time that stands before a reply, by its header cell; nothing if none does.

    A number has no unit, and may be a count: what it is is asked for.
    """
    return {"Time": match["time"].strip()} if match["time"] else {}
