"""A document in, one with numbers written in another way, or other numbers, out, with what may be read of it."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from statistics import median

from mutants.document import (
    NAN,
    UNITS,
    Document,
    all_numbers,
    digits_after,
    number,
    number_instead,
    put,
    shown,
    with_cells,
    with_column,
    with_rows,
)
from mutants.kind import Kind
from mutants.of_rows import changed_row, quantity_column, whole_row, whole_rows


def _with_mark(doc: Document, at: int, mark: str, places: Sequence[int] | None = None) -> Document:
    old = doc.columns[at].mark
    doc = with_cells(doc, at, lambda text, value: (text.replace(old, mark), value), places)
    return with_column(doc, at, replace(doc.columns[at], mark=mark)) if places is None else doc


def _plain(doc: Document, columns: Iterable[int]) -> bool:
    return all(doc.columns[j].mark == "." and not doc.columns[j].group for j in columns)


def commas(delimiter: str, protect: bool) -> Callable[[Document, random.Random], Document | None]:
    """A change to decimal commas in all cells.

    Parameters
    ----------
    delimiter : the new delimiter; "" to keep it.
    protect : cells that hold the delimiter are quoted.

    Returns
    -------
    The change.
    """

    def change(doc: Document, rng: random.Random) -> Document | None:
        if not _plain(doc, range(len(doc.columns))) or (not delimiter and not protect and doc.quote != "none"):
            return None
        above = tuple(v.replace(doc.delimiter, delimiter) if delimiter and '"' not in v else v for v in doc.above)
        for j in range(len(doc.columns)):
            doc = _with_mark(doc, j, ",")
        if delimiter or protect:
            return replace(doc, delimiter=delimiter or doc.delimiter, above=above, protect=True)
        return with_rows(replace(doc, protect=False), lambda row: replace(row, doubtful=True))

    return change


def comma_column(doc: Document, rng: random.Random) -> Document | None:
    """Decimal commas in one column, the others with points; semicolons between them."""
    at = quantity_column(doc, rng)
    if at is None or not _plain(doc, [at]):
        return None
    return _with_mark(replace(doc, delimiter=";"), at, ",")


def _with_marks(doc: Document, at: int) -> list[int]:
    return [i for i in whole_rows(doc, at) if doc.columns[at].mark in doc.row(i).cells[at]]


def comma_cell(doc: Document, rng: random.Random) -> Document | None:
    """The other decimal mark in one cell or a few, quoted or between semicolons."""
    at = quantity_column(doc, rng)
    if at is None or doc.columns[at].group or len(places := _with_marks(doc, at)) < 9:
        return None
    chosen = rng.sample(places, rng.choice((1, 1, 3, 6)))
    doc = with_rows(doc, lambda row: replace(row, doubtful=True), chosen)
    doc = replace(doc, delimiter=rng.choice((";", doc.delimiter)))
    return _with_mark(doc, at, "," if doc.columns[at].mark == "." else ".", chosen)


def bare_comma_cell(doc: Document, rng: random.Random) -> Document | None:
    """A decimal comma in one cell of a comma file, without quotes: one cell more in the row."""
    at = quantity_column(doc, rng)
    if at is None or doc.delimiter != "," or doc.quote != "none" or not _plain(doc, [at]):
        return None
    i = whole_row(doc, rng, at)
    if i is None or "." not in doc.row(i).cells[at]:
        return None
    row = doc.row(i)
    before, after = row.cells[at].split(".", 1)
    values = tuple(v if j <= at else NAN for j, v in enumerate(row.values))
    cells = (*row.cells[:at], before, after, *row.cells[at + 1 :])
    return changed_row(doc, i, replace(row, cells=cells, values=values, doubtful=True))


def _near(doc: Document, at: int, i: int, width: int = 4) -> list[float]:
    rows = doc.rows()
    k = rows.index(i)
    near = [doc.row(m).values[at] for m in (*rows[max(k - width, 0) : k], *rows[k + 1 : k + 1 + width])]
    return [v for v in near if v == v]


def contradicted(value: float, near: Sequence[float]) -> bool:
    """Whether the readings around a number agree with each other within 10 %, and with it but for a power of ten."""
    if len(near) < 4 or value == 0.0:
        return False
    middle = median(near)
    if middle == 0.0 or any(abs(v - middle) > 0.1 * abs(middle) for v in near):
        return False
    return any(0.9 < value / middle / 10.0**k < 1.1 for k in (-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6))


def _implausible(value: float, near: Sequence[float]) -> bool:
    if not near:
        return False
    span = max(max(near) - min(near), 0.5 * max(abs(v) for v in near), 1e-9)
    return not min(near) - 3 * span <= value <= max(near) + 3 * span


def _stripped(doc: Document, at: int, chosen: Sequence[int]) -> Document:
    column = doc.columns[at]
    new = doc
    for i in chosen:
        row = doc.row(i)
        text = row.cells[at].replace(column.mark, "")
        value = number_instead(doc, row, at, number(text, replace(column, mark=".")))
        wrong = value != row.values[at] and _implausible(value, _near(doc, at, i))
        values = put(row.values, at, NAN if wrong else value)
        new = changed_row(new, i, replace(row, cells=put(row.cells, at, text), values=values, doubtful=True))
    return new


def strip_cell(doc: Document, rng: random.Random) -> Document | None:
    """One cell without its decimal mark."""
    at = quantity_column(doc, rng)
    if at is None or doc.columns[at].group or len(places := _with_marks(doc, at)) < 9:
        return None
    return _stripped(doc, at, [rng.choice(places)])


def strip_some(doc: Document, rng: random.Random) -> Document | None:
    """Every second, fifth or ninth cell of a column without its decimal mark."""
    at = quantity_column(doc, rng)
    if at is None or doc.columns[at].group or len(places := _with_marks(doc, at)) < 20:
        return None
    step = rng.choice((2, 5, 9, 9))
    return _stripped(doc, at, places[rng.randrange(step) :: step])


def strip_column(doc: Document, rng: random.Random) -> Document | None:
    """A whole column without its decimal marks, of which the leading zeros tell."""
    at = quantity_column(doc, rng)
    if at is None or not _plain(doc, [at]):
        return None
    texts = [doc.row(i).cells[at] for i in whole_rows(doc, at)]
    telling = [t for t in texts if t.lstrip("-").startswith("0.") and t.strip("-0.")]
    if len(telling) < 2 or len(telling) < 0.02 * len(texts):
        return None
    # It is the numbers that cannot be read, under whatever name they stand.
    return with_cells(doc, at, lambda text, value: (text.replace(".", ""), NAN))


def _finer(doc: Document, at: int) -> Document | None:
    """The document with a column of whole numbers in a unit so small that there are thousands."""
    column = doc.columns[at]
    unit = {"time": "ms", "displacement": "µm", "force": "mN", "capacitance": "fF"}[column.quantity]
    factor = UNITS[column.quantity][unit]
    ratio = column.factors[0] / factor
    if not all_numbers(doc, at) or max((abs(doc.row(i).values[at]) for i in whole_rows(doc, at)), default=0.0) * ratio < 2000:
        return None

    def changed(text: str, value: float) -> tuple[str, float]:
        return (text, value) if value != value else (f"{round(value * ratio)}", float(round(value * ratio)))

    return with_column(with_cells(doc, at, changed), at, replace(column, unit=unit, factors=(factor,)))


def thousands(decimals: int, mark: str, group: str, delimiter: str) -> Callable[[Document, random.Random], Document | None]:
    """A change to thousands set apart in one column.

    Parameters
    ----------
    decimals : digits after the mark.
    mark, group : decimal mark and thousands separator.
    delimiter : the new delimiter, with the mark in all columns; "" to keep both.

    Returns
    -------
    The change.
    """

    def change(doc: Document, rng: random.Random) -> Document | None:
        at = quantity_column(doc, rng)
        if at is None or not _plain(doc, range(len(doc.columns))) or not doc.columns[at].unit:
            return None
        finer = _finer(doc, at)
        if finer is None:
            return None
        if delimiter:
            for j in range(len(doc.columns)):
                finer = _with_mark(finer, j, mark)
            finer = replace(finer, delimiter=delimiter)
        column = replace(finer.columns[at], mark=mark, group=group)
        finer = with_cells(finer, at, lambda text, value: (text if value != value else shown(value, decimals, column), value))
        return with_column(finer, at, column)

    return change


def thousands_cell(doc: Document, rng: random.Random) -> Document | None:
    """Thousands set apart in one cell alone."""
    at = quantity_column(doc, rng)
    if at is None or not _plain(doc, [at]):
        return None
    places = [i for i in whole_rows(doc, at) if abs(doc.row(i).values[at]) >= 1000]
    if not places:
        return None
    i = rng.choice(places)
    row = doc.row(i)
    column = replace(doc.columns[at], group=rng.choice((",", "'", " ")))
    text = shown(row.values[at], digits_after(row.cells[at], "."), column)
    return changed_row(doc, i, replace(row, cells=put(row.cells, at, text), doubtful=True))


def _one_cell(
    change: Callable[[Document, random.Random, int, int], tuple[str, float] | None],
) -> Callable[[Document, random.Random], Document | None]:
    """A change of one cell: document, random numbers, column and row in, its text and what may be read of it out."""

    def changed(doc: Document, rng: random.Random) -> Document | None:
        at = quantity_column(doc, rng)
        i = None if at is None else whole_row(doc, rng, at)
        if at is None or i is None or doc.columns[at].group:
            return None
        cell = change(doc, rng, at, i)
        if cell is None:
            return None
        row = doc.row(i)
        return changed_row(
            doc, i, replace(row, cells=put(row.cells, at, cell[0]), values=put(row.values, at, cell[1]), doubtful=True)
        )

    return changed


def times_ten(doc: Document, rng: random.Random, at: int, i: int) -> tuple[str, float] | None:
    """The cell times a power of ten."""
    row, column = doc.row(i), doc.columns[at]
    written = number(row.cells[at], column)
    text = shown(written * rng.choice((10.0, 100.0, 1000.0, 0.1)), digits_after(row.cells[at], column.mark), column)
    value = number_instead(doc, row, at, number(text, column))
    return None if value == row.values[at] else (text, NAN if contradicted(value, _near(doc, at, i)) else value)


def other_digit(doc: Document, rng: random.Random, at: int, i: int) -> tuple[str, float]:
    """The cell with one digit changed."""
    text = doc.row(i).cells[at]
    k = rng.choice([k for k, c in enumerate(text) if c.isdigit()])
    text = text[:k] + rng.choice([c for c in "0123456789" if c != text[k]]) + text[k + 1 :]
    return text, number_instead(doc, doc.row(i), at, number(text, doc.columns[at]))


def no_reading(doc: Document, rng: random.Random, at: int, i: int) -> tuple[str, float]:
    """What instruments write where they have no reading."""
    return rng.choice(("", "-", "---", "OVER", "9.9E37")), NAN


def no_number(doc: Document, rng: random.Random, at: int, i: int) -> tuple[str, float]:
    """What programs write where they have no number, and what only looks like one."""
    return rng.choice(("NaN", "inf", "#N/A", "n.a.", "OL", "?", "0x1F", "1e400", "1_0")), NAN


_OTHERS_TELL = "the other columns' marks tell, or refused"
_SAME = "the same numbers"
_OR_OUT = "the same number, or the row left out"
_CONTRADICTED = "left out where the neighbours contradict it"

KINDS = (
    Kind("decimal commas between semicolons", _SAME, commas(";", True), True),
    Kind("decimal commas between tabs", _SAME, commas("\t", True), True),
    Kind("decimal commas in quotes", _SAME, commas("", True), True),
    Kind("decimal commas between commas", "every cell is two: refused, or put together rightly", commas("", False)),
    Kind("decimal commas in one column", "the same numbers, each column has its mark", comma_column),
    Kind("other decimal mark in single cells", _OR_OUT, comma_cell),
    Kind("bare decimal comma in one cell", "a cell too many: the row is left out", bare_comma_cell),
    Kind("decimal mark lost in one cell", _CONTRADICTED, strip_cell),
    Kind("decimal mark lost in every ninth", _CONTRADICTED, strip_some),
    Kind("decimal marks lost in a column", "leading zeros show that it is no column of whole numbers", strip_column),
    Kind("thousands commas in quotes", _SAME, thousands(2, ".", ",", ""), True),
    Kind("thousands points between semicolons", _SAME, thousands(1, ",", ".", ";"), True),
    Kind("thousands points without decimals", _OTHERS_TELL, thousands(0, ",", ".", ";")),
    Kind("thousands commas without decimals", _OTHERS_TELL, thousands(0, ".", ",", "")),
    Kind("thousands in one cell", _OR_OUT, thousands_cell),
    Kind("cell times a power of ten", _CONTRADICTED, _one_cell(times_ten)),
    Kind("digit changed", "exactly that number: nobody can know", _one_cell(other_digit)),
    Kind("cell without a reading", "not read", _one_cell(no_reading), True),
    Kind("cell of another word", "not read", _one_cell(no_number)),
)
