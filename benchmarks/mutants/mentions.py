"""A mutant and what the reader says of it in; whether every column and every line that is not used is named, out."""

from __future__ import annotations

import re
from collections.abc import Sequence

from calib.lab import LabTable
from mutants.document import Document, Line, Written


class SilentError(Exception):
    """Something was read that may not be, or left out without a word; the message says what."""


def said_of(table: LabTable) -> str:
    """All that a reader says of a file, in one text."""
    return " ".join([*table.notes, *(f"{u.what}: {u.reason}" for u in table.unread), *table.reasons])


def is_named(name: str, said: str) -> bool:
    """Whether a name stands in a text as a word of its own.

    Parameters
    ----------
    name : the name.
    said : the text.

    Returns
    -------
    True if it does.
    """
    return re.search(rf"(?<!\w){re.escape(name.strip().lower())}(?!\w)", said.lower()) is not None


def columns_named(doc: Document, table: LabTable, said: str) -> bool:
    """Hold the columns against what was said of them.

    Parameters
    ----------
    doc : the mutant.
    table : what was read of it.
    said : see `said_of`.

    Returns
    -------
    True if a column that was added, or made unreadable, was named.

    Raises
    ------
    SilentError
        If a quantity comes from a column that is none, or a column is neither used nor named.
    """
    for quantity in table.columns:
        known = any(
            quantity in (c.quantity, c.stands_in) or (quantity == "frequency" and c.name == "Frequency") for c in doc.columns
        )
        if not known:
            raise SilentError(f'{quantity} is read from "{table.sources[quantity]}", which is none')
    named = False
    used = " ".join(table.sources.values())
    for j, column in enumerate(doc.columns):
        twin = column.added and sum((c.name, c.unit) == (column.name, column.unit) for c in doc.columns) > 1
        taken = column.quantity in table.columns or (bool(column.name) and str(column.name) in used and not twin)
        if taken or "status" in str(column.name).lower():
            continue
        by_place = re.search(rf"\bcolumn {j + 1}\b", said) is not None
        if not by_place and (twin or not (column.name and is_named(column.name, said))):
            name = f'"{column.name}"' if column.name else f"{j + 1}, without a name,"
            raise SilentError(f"column {name} is neither used nor named")
        named |= column.added or bool(column.quantity)
    return named


def lines_named(doc: Document, out: Written, table: LabTable, said: str) -> bool:
    """Hold the lines outside the table, and those among its rows, against what was said of them.

    Parameters
    ----------
    doc : the mutant.
    out : its lines.
    table : what was read of it.
    said : see `said_of`.

    Returns
    -------
    True if a line among the rows was named.

    Raises
    ------
    SilentError
        If a line is not named.
    """
    among = [(n, v.text) for n, v in zip(out.lines, doc.body, strict=True) if isinstance(v, Line) and v.named]
    above = [(n, v) for n, v in enumerate(doc.above, 1) if not v.startswith("Units")]
    lines = [(n, v) for n, v in [*above, *among, *zip(out.below, doc.below, strict=True)] if v.strip(f"{doc.delimiter} ")]
    told = lines_mentioned([n for n, _ in lines], said)
    told |= {int(n) for n, why in zip(table.lines, table.reasons, strict=True) if why}
    for line, text in lines:
        if line not in told and not is_named(text, said):
            raise SilentError(f'line {line}, "{text}", is neither used nor named')
    return bool(among)


def lines_mentioned(lines: Sequence[int], said: str) -> set[int]:
    """Which of some lines were mentioned: by their number, as one of a range, or all of them, counted from the first on.

    Parameters
    ----------
    lines : numbers of lines.
    said : see `said_of`.

    Returns
    -------
    Those that were.
    """
    ranges = [(int(a), int(b)) for a, b in re.findall(r"(\d+)(?: to |-|–)(\d+)", said)]
    told = {n for n in lines if re.search(rf"\b{n}\b", said) or any(a <= n <= b for a, b in ranges)}
    counted = sum(int(v) for v in re.findall(r"(\d+) (?:line|row)", said))
    return set(lines) if told and counted >= len(lines) else told
