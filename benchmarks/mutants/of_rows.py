"""A document in, one with cells or rows missing, added or moved out, with what may be read of it."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace

from mutants.document import NAN, UNITS, Document, Line, Row, number, number_instead, put, with_column, with_rows
from mutants.kind import Kind
from mutants.presses import pressed

_READ = ("time", "displacement", "force", "capacitance")


def quantity_column(doc: Document, rng: random.Random) -> int | None:
    """A column of plain numbers that may be read as time, displacement, force or capacitance; None if there is none."""
    # A time that was written in another way holds dates, or other numbers than its seconds.
    read = [q for q in _READ if q != "time" or not doc.free_time]
    places = [j for j, c in enumerate(doc.columns) if c.quantity in read and c.factors]
    return rng.choice(places) if places else None


def whole_rows(doc: Document, at: int | None = None) -> list[int]:
    """Places of rows that have all their cells, and a number in a column.

    Parameters
    ----------
    doc : the document.
    at : the column; None for any.

    Returns
    -------
    Places in the body.
    """
    n = len(doc.columns)
    return [
        i for i in doc.rows() if len(doc.row(i).cells) == n and (at is None or doc.row(i).values[at] == doc.row(i).values[at])
    ]


def whole_row(doc: Document, rng: random.Random, at: int | None = None) -> int | None:
    """One of `whole_rows`; None if there are fewer than nine."""
    places = whole_rows(doc, at)
    return rng.choice(places) if len(places) > 8 else None


def changed_row(doc: Document, at: int, row: Row) -> Document:
    """The document with another row at a place of its body."""
    return replace(doc, body=put(doc.body, at, row))


def _kept(doc: Document, row: Row, cells: Sequence[str]) -> Row:
    """The row with other cells: only where the text is as it was may it be read.

    Blanks side by side, or at the ends of a line, hold no cell between them: a row of them has no empty ones.
    """
    if doc.delimiter == " " and doc.quote == "none":
        cells = [cell for cell in cells if cell]
    same = [
        value if j < min(len(cells), len(row.cells)) and cells[j] == row.cells[j] else NAN for j, value in enumerate(row.values)
    ]
    return replace(row, cells=tuple(cells), values=tuple(same), doubtful=True)


def drop_cell(doc: Document, rng: random.Random) -> Document | None:
    """One cell is missing from a row, or from several."""
    j = rng.randrange(len(doc.columns))
    places = whole_rows(doc)
    if len(places) < 20:
        return None
    chosen = rng.sample(places, rng.choice((1, 1, 1, 4, 8)))
    return with_rows(doc, lambda row: _kept(doc, row, (*row.cells[:j], *row.cells[j + 1 :])), chosen)


def add_cell(doc: Document, rng: random.Random) -> Document | None:
    """One cell too many in a row."""
    i = whole_row(doc, rng)
    if i is None:
        return None
    row, j = doc.row(i), rng.randrange(len(doc.columns) + 1)
    new = rng.choice(("", "0", rng.choice(row.cells), f"{rng.uniform(-5, 5):.3f}", "x"))
    return changed_row(doc, i, _kept(doc, row, (*row.cells[:j], new, *row.cells[j:])))


def shift_left(doc: Document, rng: random.Random) -> Document | None:
    """The first cell of a row is missing and the others have moved, with an empty one at the end or none."""
    i = whole_row(doc, rng)
    if i is None:
        return None
    end = rng.choice(((), ("",)))
    return changed_row(doc, i, _kept(doc, doc.row(i), (*doc.row(i).cells[1:], *end)))


def shift_right(doc: Document, rng: random.Random) -> Document | None:
    """An empty cell before the row, the last lost or one cell too many."""
    i = whole_row(doc, rng)
    if i is None:
        return None
    return changed_row(doc, i, _kept(doc, doc.row(i), ("", *doc.row(i).cells[: rng.choice((None, -1))])))


def shift_many(doc: Document, rng: random.Random) -> Document | None:
    """Rows in a block, or every other, shifted to the left."""
    places = whole_rows(doc)
    if len(places) < 20:
        return None
    start = rng.randrange(2, len(places) // 2)
    chosen = places[start : start + rng.choice((3, 10))] if rng.random() < 0.5 else places[start :: rng.choice((2, 7))]
    end = rng.choice(((), ("",)))
    return with_rows(doc, lambda row: _kept(doc, row, (*row.cells[1:], *end)), chosen)


def duplicate(doc: Document, rng: random.Random) -> Document | None:
    """A row, or a block of rows, twice."""
    rows = doc.rows()
    start, n = rng.randrange(len(rows)), rng.choice((1, 1, 5))
    chosen = rows[start : start + n]
    new = with_rows(doc, lambda row: replace(row, doubtful=True), chosen)
    at = chosen[-1] + 1
    return replace(new, body=(*new.body[:at], *(new.body[i] for i in chosen), *new.body[at:]))


def delete(doc: Document, rng: random.Random) -> Document | None:
    """A row less."""
    rows = doc.rows()
    if len(rows) < 20:
        return None
    i = rng.choice(rows)
    return replace(doc, body=doc.body[:i] + doc.body[i + 1 :])


def swap_rows(doc: Document, rng: random.Random) -> Document | None:
    """Two rows change places, neighbours or not; those between them may be left out, too, as time runs backwards there."""
    rows = doc.rows()
    if len(rows) < 20:
        return None
    k = rng.randrange(len(rows) - 1)
    first, second = sorted(rng.sample(rows, 2)) if rng.random() < 0.5 else (rows[k], rows[k + 1])
    doc = with_rows(doc, lambda row: replace(row, doubtful=True), [i for i in rows if first <= i <= second])
    a, b = doc.row(first), doc.row(second)
    return replace(doc, body=put(put(doc.body, first, b), second, a))


def _insert(doc: Document, rng: random.Random, lines: Sequence[Line]) -> Document | None:
    rows = doc.rows()
    if len(rows) < 20:
        return None
    at = rows[rng.randrange(1, len(rows) - 1)]
    return replace(doc, body=(*doc.body[:at], *lines, *doc.body[at:]))


def text_line(doc: Document, rng: random.Random) -> Document | None:
    """A line of text among the rows."""
    text = rng.choice(("paused by operator", "Segment 2", "Marker: touch", "*** Limit reached ***", "n/a", "Test aborted"))
    return _insert(doc, rng, [Line(text)])


def comment_line(doc: Document, rng: random.Random) -> Document | None:
    """A comment among the rows."""
    return _insert(doc, rng, [Line(rng.choice(("# stopped 12 s", "% second part", "// resumed", "; pause")))])


def blank_line(doc: Document, rng: random.Random) -> Document | None:
    """A blank line among the rows, or one of delimiters."""
    text = rng.choice(("", "", "  ", doc.delimiter * (len(doc.columns) - 1)))
    return _insert(doc, rng, [Line(text, named=False)] * rng.choice((1, 2)))


def _units_line(doc: Document) -> Line:
    return Line(doc.delimiter.join(c.unit_text() if c.unit else "" for c in doc.columns), named=False)


def _header_lines(doc: Document) -> list[Line]:
    names = [(c.name or "") + ("" if doc.units_row or not c.unit else c.gap + c.unit_text()) for c in doc.columns]
    line = Line(doc.delimiter.join(names), named=False)
    return [line, _units_line(doc)] if doc.units_row else [line]


def _has_names(doc: Document) -> bool:
    return all(c.name is not None for c in doc.columns)


def header_again(doc: Document, rng: random.Random) -> Document | None:
    """The header once more among the rows."""
    return _insert(doc, rng, _header_lines(doc)) if _has_names(doc) else None


def units_again(doc: Document, rng: random.Random) -> Document | None:
    """The row of units once more among the rows."""
    return _insert(doc, rng, [_units_line(doc)]) if doc.units_row and _has_names(doc) else None


def other_units_again(doc: Document, rng: random.Random) -> Document | None:
    """Header and units once more, with another unit for the rows below."""
    at = quantity_column(doc, rng)
    if at is None or not doc.columns[at].unit or not _has_names(doc):
        return None
    column = doc.columns[at]
    units = UNITS[column.quantity]
    unit = rng.choice([u for u in units if units[u] != column.factors[0]])
    other = _header_lines(with_column(doc, at, replace(column, unit=unit)))
    new = _insert(doc, rng, rng.choice((other, other[-1:])) if doc.units_row else other)
    if new is None:
        return None
    below = [i for i in new.rows() if i > new.body.index(other[-1])]
    ratio = units[unit] / column.factors[0]
    return with_rows(new, lambda row: replace(row, values=put(row.values, at, row.values[at] * ratio), doubtful=True), below)


def other_header_again(doc: Document, rng: random.Random) -> Document | None:
    """The header once more, with two columns swapped, for the rows below."""
    at = quantity_column(doc, rng)
    others = [j for j, c in enumerate(doc.columns) if c.quantity and c.quantity != "cycle" and j != at]
    if at is None or not others or not _has_names(doc):
        return None
    other = rng.choice(others)
    columns = put(put(doc.columns, at, doc.columns[other]), other, doc.columns[at])
    lines = _header_lines(replace(doc, columns=columns))
    new = _insert(doc, rng, lines)
    if new is None:
        return None
    below = [i for i in new.rows() if i > new.body.index(lines[-1])]

    def swapped(row: Row) -> Row:
        return replace(row, values=put(put(row.values, at, row.values[other]), other, row.values[at]), doubtful=True)

    # The numbers below these names are others now, and so is which way they go.
    moved = {columns[at].quantity, columns[other].quantity} & new.turned.keys()
    new = replace(new, turned={} if moved else new.turned)
    return with_rows(new, swapped, below)


def channel_numbers(doc: Document, rng: random.Random) -> Document | None:
    """A row 1, 2, 3 of channel numbers between the header and the first row."""
    start = rng.choice((0, 1))
    text = doc.delimiter.join(str(j + start) for j in range(len(doc.columns)))
    return replace(doc, body=(Line(text), *doc.body))


def cut_row(doc: Document, rng: random.Random) -> Document | None:
    """A row that ends within one of its cells."""
    i = whole_row(doc, rng)
    return None if i is None else _cut(doc, rng, i, False)


def cut_file(doc: Document, rng: random.Random) -> Document | None:
    """The file ends within a row."""
    rows = doc.rows()
    i = rows[rng.randrange(10, len(rows))] if len(rows) > 20 else None
    if i is None or len(doc.row(i).cells) != len(doc.columns):
        return None
    cut = replace(doc, body=doc.body[: i + 1], below=(), end=False)
    second = [any(doc.row(k).absent for k in of.rows()) for of in (doc, cut)]
    if doc.refuse and second == [True, False]:  # the second value of a key is gone, and with it the choice
        return None
    new = _cut(cut, rng, i, True)
    # With the press is gone what showed its direction, such as the rows in which a force rises faster than it drifts.
    return new if new is None or not pressed(doc) or pressed(new) else replace(new, turned={})


def _cut(doc: Document, rng: random.Random, i: int, end: bool) -> Document | None:
    row = doc.row(i)
    j = rng.randrange(len(row.cells))
    keep = rng.randrange(1, len(row.cells[j])) if len(row.cells[j]) > 1 else 0
    if not keep and not j:
        return None
    part = row.cells[j][:keep]
    new = replace(_kept(doc, row, (*row.cells[:j], part)), open_end=True)
    value = number_instead(doc, row, j, number(part, doc.columns[j]))
    # A last cell that lost digits shows nothing within the file: it is a number like another.
    whole = not end and j == len(row.cells) - 1 and doc.quote == "none"
    if value == row.values[j] or whole:
        new = replace(new, values=put(new.values, j, value))
    return changed_row(doc, i, new)


_OUT_OF_PLACE = "cells after it are not in their columns: the row is left out"
_NAMED = "named, the rows as they are"

KINDS = (
    Kind("cell missing", _OUT_OF_PLACE, drop_cell),
    Kind("cell added", _OUT_OF_PLACE, add_cell),
    Kind("row shifted left", "no cell is in its column", shift_left),
    Kind("row shifted right", "no cell is in its column", shift_right),
    Kind("rows shifted left", "no cell is in its column", shift_many),
    Kind("row twice", "the same numbers; one of them may be left out", duplicate),
    Kind("row deleted", "the others as they are", delete),
    Kind("rows swapped", "both read, or left out as time runs backwards", swap_rows),
    Kind("text among the rows", _NAMED, text_line),
    Kind("comment among the rows", _NAMED, comment_line),
    Kind("blank line among the rows", "nothing", blank_line, True),
    Kind("header repeated", "nothing", header_again, True, last=True),
    Kind("units repeated", "nothing", units_again, last=True),
    Kind("other units below", "the rows below scale by the factor, or refused", other_units_again, last=True),
    Kind("other header below", "the rows below follow it, or refused", other_header_again, last=True),
    Kind("row of channel numbers", "no reading", channel_numbers),
    Kind("row cut", "what is missing is not read; a last cell that lost digits is a number like another", cut_row),
    Kind("file cut within a row", "the last row is left out", cut_file, last=True),
)
