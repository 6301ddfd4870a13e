"""The parts of a lab file, with what each of its numbers means, in; its bytes and the line of each row out.

The meaning is carried along with the text: a mutation changes both, so that what may be read of a mutant is known without
reading it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from calib.lab import Reading

NAN = math.nan

T = TypeVar("T")

#: Quantity -> unit as written -> factor to SI. "" where a quantity has none.
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0},
    "displacement": {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "µm": 1e-6, "um": 1e-6, "in": 0.0254},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": 4.4482216152605, "kgf": 9.80665, "gf": 9.80665e-3},
    "capacitance": {"pF": 1e-12, "F": 1.0, "nF": 1e-9, "fF": 1e-15, "uF": 1e-6},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "dissipation": {"": 1.0, "%": 1e-2, "‰": 1e-3},
    "cycle": {"": 1.0},
}


@dataclass(frozen=True)
class Column:
    """One column: how its header is written, and what may be read of it.

    Attributes
    ----------
    name, gap, bracket, unit : parts of the header, "Load", " ", "()", "N"; bracket "" where no unit is written. `name` None
        where the header has no cell for the column.
    quantity : what the column is; "" for one that is no quantity.
    factors : factors to SI by which it may be read; none if it may not be read at all.
    told : what the notes must hold if it is read; "" for nothing.
    stands_in : quantity that it may be taken for once the column of that quantity was made unreadable.
    added : not of the real file; it must be named if it is not used.
    mark, group : decimal mark and thousands separator of its cells.
    """

    name: str | None
    gap: str = ""
    bracket: str = ""
    unit: str = ""
    quantity: str = ""
    factors: tuple[float, ...] = ()
    told: str = ""
    stands_in: str = ""
    added: bool = False
    mark: str = "."
    group: str = ""

    def unit_text(self) -> str:
        """The unit in its brackets, "(N)"."""
        return self.bracket[:1] + self.unit + self.bracket[1:] if self.bracket else self.unit


@dataclass(frozen=True)
class Row:
    """One row: its cells as they stand in the line, and what may be read of it.

    Attributes
    ----------
    cells : texts by place; fewer or more than there are columns if the row is damaged.
    values : numbers by column in the unit of the column; nan where none may be read.
    origin : row of the unmutated record.
    doubtful : it may be left out with a reason, and single readings of it, too.
    absent : it is to be left out, as the user asked for other rows.
    open_end : the line ends within its last cell.
    """

    cells: tuple[str, ...]
    values: tuple[float, ...]
    origin: int
    doubtful: bool = False
    absent: bool = False
    open_end: bool = False


@dataclass(frozen=True)
class Line:
    """A line of text among the rows, as it stands; `named` if it must be mentioned."""

    text: str
    named: bool = True


@dataclass(frozen=True)
class Document:
    """A lab file in parts, with what may be read of it.

    Attributes
    ----------
    above, below : lines as they stand.
    columns, body : the table.
    units_row : units stand in a row of their own.
    delimiter, newline, codec, quote : how it is written; quote "none", "data" or "all".
    protect : cells that hold the delimiter are quoted.
    prefix : what stands before header and units row.
    trail_header, trail_rows : delimiters at the end of header and rows.
    end : the file ends with a line end.
    flipped : quantities whose sign is turned when it is written.
    reading : what the user says of the file.
    refuse : nothing may be read of it.
    free_time : time may begin anywhere, only its differences count.
    doubt_all : any row may be left out with a reason.
    turned : quantity -> -1.0 if compression is negative in the file, 1.0 if it is positive; as the whole file shows.
    signs : compression must still point there.
    """

    path: Path
    above: tuple[str, ...]
    columns: tuple[Column, ...]
    body: tuple[Row | Line, ...]
    below: tuple[str, ...]
    units_row: bool
    delimiter: str
    newline: str
    quote: str = "none"
    protect: bool = True
    codec: str = "utf-8"
    prefix: str = ""
    trail_header: int = 0
    trail_rows: int = 0
    end: bool = True
    flipped: frozenset[str] = frozenset()
    reading: Reading = field(default_factory=Reading)
    refuse: bool = False
    free_time: bool = False
    doubt_all: bool = False
    turned: Mapping[str, float] = field(default_factory=dict)
    signs: bool = False

    def rows(self) -> list[int]:
        """Places in `body` that are rows."""
        return [i for i, item in enumerate(self.body) if isinstance(item, Row)]

    def row(self, at: int) -> Row:
        """The row at a place in `body`."""
        item = self.body[at]
        assert isinstance(item, Row)
        return item

    def index(self, quantity: str) -> int | None:
        """The column of a quantity; None if there is none."""
        return next((j for j, c in enumerate(self.columns) if c.quantity == quantity), None)


@dataclass(frozen=True)
class Written:
    """A document as bytes, the line (from 1) of each item of its body, and those of its last lines."""

    data: bytes
    lines: tuple[int, ...]
    below: tuple[int, ...]


def with_column(doc: Document, at: int, column: Column) -> Document:
    """The document with one column's description replaced, its cells as they are.

    Parameters
    ----------
    doc : the document.
    at : which column.
    column : the new description.

    Returns
    -------
    The new document.
    """
    return replace(doc, columns=(*doc.columns[:at], column, *doc.columns[at + 1 :]))


def with_rows(doc: Document, change: Callable[[Row], Row], places: Sequence[int] | None = None) -> Document:
    """The document with every row, or those at some places of the body, changed.

    Parameters
    ----------
    doc : the document.
    change : a row in, a row out.
    places : places in `body`; None for all rows.

    Returns
    -------
    The new document.
    """
    chosen = set(doc.rows() if places is None else places)
    body = (change(v) if i in chosen and isinstance(v, Row) else v for i, v in enumerate(doc.body))
    return replace(doc, body=tuple(body))


def with_cells(
    doc: Document, at: int, change: Callable[[str, float], tuple[str, float]], places: Sequence[int] | None = None
) -> Document:
    """The document with the cells of one column changed, where a row has them in their place.

    Parameters
    ----------
    doc : the document.
    at : which column.
    change : text and value in, text and value out.
    places : places in `body`; None for all rows.

    Returns
    -------
    The new document.
    """

    def changed(row: Row) -> Row:
        if at >= len(row.cells) or not row.cells[at]:
            return row
        text, value = change(row.cells[at], row.values[at])
        return replace(row, cells=put(row.cells, at, text), values=put(row.values, at, value))

    return with_rows(doc, changed, places)


def all_numbers(doc: Document, at: int) -> bool:
    """Whether all that stands in a column may be read, and as the number that stands there.

    Parameters
    ----------
    doc : the document.
    at : which column.

    Returns
    -------
    False if a cell is damaged, or stands for another number as a series capacitance does for the parallel one.
    """
    rows = [doc.row(i) for i in doc.rows()]
    return all(number(r.cells[at], doc.columns[at]) == r.values[at] for r in rows if at < len(r.cells) and r.cells[at])


def put(values: tuple[T, ...], at: int, value: T) -> tuple[T, ...]:
    """A tuple with one element replaced."""
    return (*values[:at], value, *values[at + 1 :])


def number(text: str, column: Column) -> float:
    """The number of a cell; nan where it is none."""
    plain = text.strip().replace(column.group, "") if column.group else text.strip()
    try:
        return float(plain.replace(column.mark, ".") if plain else "nan")
    except ValueError:
        return NAN


def number_instead(doc: Document, row: Row, at: int, written: float) -> float:
    """The number that may be read of a cell once another one is written there: what was converted stays so.

    Parameters
    ----------
    doc : the document.
    row, at : where the cell is.
    written : the number that stands in it now.

    Returns
    -------
    That number, times what the old one was multiplied by, as of a series capacitance; nan where it is none.
    """
    old, meant = number(row.cells[at], doc.columns[at]), row.values[at]
    return written * (meant / old) if old == old and old != 0.0 and meant == meant else written


def digits_after(text: str, mark: str) -> int:
    """Digits after the decimal mark of a number without exponent."""
    return len(text) - text.rindex(mark) - 1 if mark in text else 0


def shown(value: float, digits: int, column: Column) -> str:
    """A number as the column writes it, with some digits after the mark."""
    text = f"{value:,.{digits}f}"
    return "".join({",": column.group, ".": column.mark}.get(c, c) for c in text)


def written(doc: Document) -> Written:
    """The bytes of a document and where its rows stand in them."""
    sign = {j for j, c in enumerate(doc.columns) if c.quantity in doc.flipped}
    lines = [*doc.above]
    heads = [c for c in doc.columns if c.name is not None]
    names = [(c.name or "") + ("" if doc.units_row or not c.unit else c.gap + c.unit_text()) for c in heads]
    loud = doc.quote == "all"
    lines.append(doc.prefix + _joined(doc, names, loud) + doc.delimiter * doc.trail_header)
    if doc.units_row:
        units = [c.unit_text() if c.unit else "" for c in heads]
        lines.append(doc.prefix + _joined(doc, units, loud) + doc.delimiter * doc.trail_header)
    places = []
    for item in doc.body:
        lines.append(item.text if isinstance(item, Line) else _row_text(doc, item, sign))
        places.append(len(lines))
    first_below = len(lines)
    lines += doc.below
    text = doc.newline.join(lines) + (doc.newline if doc.end else "")
    return Written(text.encode(doc.codec, errors="replace"), tuple(places), tuple(range(first_below + 1, len(lines) + 1)))


def _row_text(doc: Document, row: Row, turned: set[int]) -> str:
    cells = [_turned(v) if j in turned else v for j, v in enumerate(row.cells)]
    text = _joined(doc, cells, doc.quote in ("all", "data"))
    if row.open_end:
        return text[:-1] if text.endswith('"') else text
    return text + doc.delimiter * doc.trail_rows


def _turned(text: str) -> str:
    if not text or not any(c in "123456789" for c in text):
        return text
    return text[1:] if text.startswith("-") else f"-{text}"


def _joined(doc: Document, cells: Sequence[str], quoted: bool) -> str:
    def cell(text: str) -> str:
        inside = doc.protect and (doc.delimiter in text or '"' in text)
        return '"' + text.replace('"', '""') + '"' if quoted or inside else text

    return doc.delimiter.join(cell(v) for v in cells)
