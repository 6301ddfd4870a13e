"""From columns of numbers with names and units, as binary files hold them, to a `Part`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from calib.lab.instruments.part import Part
from calib.lab.instruments.text import LabText

#: A column as it stands in a file, of any type.
Values = npt.NDArray[Any]


@dataclass(frozen=True, eq=False)
class ArrayColumn:
    """A column: its name and unit as written ("" where there is none), and values of shape (n_row,)."""

    name: str
    unit: str
    values: Values


@dataclass(frozen=True)
class Source:
    """Where a table stands: its file with the hash of its bytes, the format's name, and kind and name of the part."""

    path: Path
    sha256: str
    format: str
    kind: str
    name: str


def array_part(
    source: Source, columns: Sequence[ArrayColumn], *, above: Sequence[str] = (), notes: Sequence[str] = (), named: bool = True
) -> Part:
    """Write columns as lines of text: what stands above them, names, units if there are any, and row by row the numbers.

    Parameters
    ----------
    source : where they stand.
    columns : equally long.
    above : lines about the record, such as its date.
    notes : what is to be known of it.
    named : whether the columns have names; where not, they are chosen by number.
    """
    header = list(above)
    if named:
        header.append("\t".join(_cell(column.name) for column in columns))
        if any(column.unit for column in columns):
            header.append("\t".join(_cell(column.unit) for column in columns))
    cells = [_cells(column.values) for column in columns]
    rows = map("\t".join, zip(*cells, strict=True))
    title = f"{source.format}, {source.kind} {source.name}"
    units_line = len(header) if named and any(column.unit for column in columns) else 0
    text = LabText(source.path, source.sha256, title, (*header, *rows, ""), True, ".", typed=True, units_line=units_line)
    return Part(source.kind, source.name, text, notes=tuple(notes), above=len(header))


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
