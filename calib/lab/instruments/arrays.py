"""From columns of numbers with names and units, as binary files hold them, to a `Part`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from calib.lab.instruments.part import Part
from calib.lab.instruments.said_inside import Saying, may_change_readings, of_column
from calib.lab.instruments.text import LabText, OfColumn

#: A column as it stands in a file, of any type.
Values = npt.NDArray[Any]
# Lines above a table that are read as such; of more than these, those that may change readings, of so many that are looked at.
_MOST_LINES, _LOOKED_AT = 100, 600


@dataclass(frozen=True, eq=False)
class ArrayColumn:
    """A column: its name and unit as written ("" where there is none), values of shape (n_row,), and what is said of it.

    `differing` are the units that it states where they contradict each other, of which none is taken.
    """

    name: str
    unit: str
    values: Values
    said: tuple[Saying, ...] = ()
    differing: tuple[str, ...] = ()


@dataclass(frozen=True)
class Source:
    """Where a table stands: its file with the hash of its bytes, the format's name, and kind and name of the part."""

    path: Path
    sha256: str
    format: str
    kind: str
    name: str


@dataclass(frozen=True)
class Around:
    """What is known of values from around them: their file, units by name, what is said, and how long the longest column is."""

    where: Source
    units: Mapping[str, str]
    above: tuple[Saying, ...]
    longest: int

    def named(self, name: str) -> Source:
        """Where they stand, under the name of a table."""
        return replace(self.where, name=name)


def array_part(
    source: Source,
    columns: Sequence[ArrayColumn],
    *,
    above: Sequence[Saying] = (),
    notes: Sequence[str] = (),
    named: bool = True,
) -> Part:
    """Write columns as lines of text: what is said of them, names, units if there are any, and row by row the numbers.

    Parameters
    ----------
    source : where they stand.
    columns : equally long.
    above : what is said of the record, such as its date.
    notes : what is to be known of it.
    named : whether the columns have names; where not, they are chosen by number.
    """
    header, of_columns, left = _lines_above(above, columns)
    units = [column.unit or " or ".join(column.differing) for column in columns]
    if named:
        header.append("\t".join(_cell(column.name) for column in columns))
        if any(units):
            header.append("\t".join(map(_cell, units)))
    cells = [_cells(column.values) for column in columns]
    rows = map("\t".join, zip(*cells, strict=True))
    title = f"{source.format}, {source.kind} {source.name}"
    units_line = len(header) if named and any(units) else 0
    text = LabText(
        source.path,
        source.sha256,
        title,
        (*header, *rows, ""),
        True,
        ".",
        typed=True,
        units_line=units_line,
        of_columns=of_columns,
    )
    two = [f'channel "{c.name}" states two units, {" and ".join(c.differing)}' for c in columns if c.differing]
    return Part(source.kind, source.name, text, notes=(*notes, *two, *left), above=len(header))


def _lines_above(above: Sequence[Saying], columns: Sequence[ArrayColumn]) -> tuple[list[str], tuple[OfColumn, ...], list[str]]:
    """What is said of a table and its columns, as lines; which of them are of one column alone; and a note on those left out.

    What is said of all columns alike, and changes no reading, is said once.
    """
    names = [column.name for column in columns]
    shared = Counter(said for column in columns for said in dict.fromkeys(column.said))
    n_said = sum(bool(column.said) for column in columns)
    alike = [said for said, n in shared.items() if n == n_said > 1 and not may_change_readings(said)]
    told = [(said, of_column(said, names)) for said in (*above, *alike)]
    entries = [(said.line, said if index is None else said.without(names[index]), index) for said, index in told]
    for index, column in enumerate(columns):
        own = [said for said in column.said if said not in alike]
        entries += [(f"{_cell(column.name) or index + 1} {said.line}".replace('"', "'"), said, index) for said in own]
    entries = list(dict.fromkeys(entries))
    more: list[tuple[str, Saying, int | None]] = []
    if len(entries) > _MOST_LINES:
        kept = list(islice((entry for entry in entries[-_LOOKED_AT:] if may_change_readings(entry[1])), _MOST_LINES))
        left_out = set(entries).difference(kept)
        more, entries = [entry for entry in entries if entry in left_out], kept
    of_columns = tuple((line, index, said.line) for line, (_, said, index) in enumerate(entries, 1) if index is not None)
    shown = more[0][0].replace("\t", " ")[:60] if more else ""
    left = [f'{len(more)} more properties, such as "{shown}", are not read'] if more else []
    return [line for line, _, _ in entries], of_columns, left


def is_column(values: Values) -> bool:
    """Whether an array is a column of numbers, of times or of words."""
    return values.ndim == 1 and values.dtype.kind in "fiubMSUO"


def _cells(values: Values) -> list[str]:
    if values.dtype.kind in "fiu":
        return list(map(repr, values.tolist()))
    if values.dtype.kind == "b":
        return [str(int(value)) for value in values.tolist()]
    if values.dtype.kind == "M":
        return [text.replace("T", " ") for text in np.datetime_as_string(values.astype("datetime64[us]")).tolist()]
    return [_cell(value.decode("latin-1") if isinstance(value, bytes) else str(value)) for value in values.tolist()]


def _cell(text: str) -> str:
    one_line = re.sub(r"[\s\x00-\x1f]+", " ", text).strip()
    return '"' + one_line.replace('"', '""') + '"' if '"' in one_line else one_line
