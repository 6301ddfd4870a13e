"""A document in, one with more columns or in another order out, with what may be read of it."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace

from calib.lab import Reading
from mutants.document import NAN, UNITS, Column, Document, Line, Row, digits_after, number, shown, with_column, with_rows
from mutants.kind import Kind

_READ = ("time", "displacement", "force", "capacitance")
_RIVALS = {
    "time": ("Time 2", "Start time", "Time (setpoint)", "Cycle time"),
    "displacement": ("Extension 2", "d", "z", "D", "Displacement (setpoint)", "Height", "Strain 1", "Extensometer"),
    "force": ("Load 2", "Load (setpoint)", "Force B", "Load cell 2", "Preload", "Force target", "Tare force"),
    "capacitance": ("Cap2", "Cp 2", "C2", "Cp (setpoint)", "C ref", "Stray capacitance"),
}
_KEYS = {
    "Channel": ("1", "2"),
    "Sensor": ("A", "B"),
    "Frequency (Hz)": ("1000", "100000"),
    "Specimen": ("1", "2"),
    "Range": ("100 pF", "1 nF"),
    "Sample ID": ("s1", "s2"),
}


def column_read(doc: Document, rng: random.Random, quantities: Sequence[str] = _READ) -> int | None:
    """One of the columns that are read as some quantity; None if there is none.

    Parameters
    ----------
    doc : the document.
    rng : random numbers.
    quantities : which may be taken.

    Returns
    -------
    Its place.
    """
    places = [j for j, c in enumerate(doc.columns) if c.quantity in quantities and c.name]
    return rng.choice(places) if places else None


def two_columns(doc: Document, rng: random.Random) -> tuple[int, int] | None:
    """A column that is read, and another one."""
    first = column_read(doc, rng)
    if first is None:
        return None
    # Two columns of one name and unit, exchanged, are what they were; one of them exchanged with a third is alone of its name.
    heads = [(c.name, c.unit) for c in doc.columns]
    others = [j for j, c in enumerate(doc.columns) if j != first and c.name and heads.count(heads[j]) == 1]
    return (first, rng.choice(others)) if others and heads.count(heads[first]) == 1 else None


def swap_columns(doc: Document, rng: random.Random) -> Document | None:
    """Two columns change places with all that is in them."""
    places = two_columns(doc, rng)
    if (
        places is None
        or any(c.name is None for c in doc.columns)
        or any(len(doc.row(i).cells) != len(doc.columns) for i in doc.rows())
    ):
        return None
    order = list(range(len(doc.columns)))
    order[places[0]], order[places[1]] = order[places[1]], order[places[0]]

    def moved(row: Row) -> Row:
        return replace(row, cells=tuple(row.cells[j] for j in order), values=tuple(row.values[j] for j in order))

    return with_rows(replace(doc, columns=tuple(doc.columns[j] for j in order)), moved)


def insert_column(doc: Document, at: int, column: Column, cells: Sequence[str], values: Sequence[float]) -> Document:
    """The document with one more column.

    Parameters
    ----------
    doc : the document.
    at : its place.
    column : its description.
    cells, values : text and number for each row of the body, in order.

    Returns
    -------
    The new document.
    """
    new = iter(zip(cells, values, strict=True))

    def longer(row: Row) -> Row:
        text, value = next(new)
        values = (*row.values[:at], value if at <= len(row.cells) else NAN, *row.values[at:])
        return replace(
            row, cells=(*row.cells[:at], text, *row.cells[at:]) if at <= len(row.cells) else row.cells, values=values
        )

    return with_rows(replace(doc, columns=(*doc.columns[:at], column, *doc.columns[at:])), longer)


def _inserted(doc: Document, at: int, column: Column, values: Sequence[float], digits: int) -> Document:
    """The document with one more column of numbers, which mean what their texts say."""
    cells = [shown(v, digits, column) if v == v else "" for v in values]
    return insert_column(doc, at, column, cells, [number(text, column) for text in cells])


def _series(doc: Document, at: int, rng: random.Random, style: str) -> list[float]:
    own = [doc.row(i).values[at] for i in doc.rows()]
    if style == "constant":
        return [round(rng.uniform(0.5, 20.0), 3)] * len(own)
    if style == "noise":
        return [rng.gauss(0.0, 0.01) for _ in own]
    # The same but for zero and sign is one reading, where its name says that it is another than the first.
    factor = rng.choice((0.5, 1.1, 1.3, -1.0 if style == "like" else -0.7))
    return [0.1 + factor * v for v in own]


def rival(doc: Document, rng: random.Random) -> Document | None:
    """A column with a name of the same kind and other numbers."""
    at = column_read(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    name = rng.choice(_RIVALS[column.quantity])
    new = replace(column, name=name, quantity="", factors=(), told="", added=True)
    factor = UNITS[column.quantity].get(column.unit) if column.unit else None
    if not column.factors and factor is not None:  # a change before has made the true one a statistic: it is the only one left
        new = replace(new, stands_in=column.quantity, factors=(factor,))
    values = _series(doc, at, rng, rng.choice(("like", "like", "constant", "noise")))
    place = rng.choice((at, at + 1, len(doc.columns)))
    return _inserted(doc, place, new, values, 4)


def twin(doc: Document, rng: random.Random) -> Document | None:
    """A column with the same header and other numbers that move, beside one that moves."""
    at = column_read(doc, rng)
    cells = {doc.row(i).cells[at] for i in doc.rows() if at is not None and at < len(doc.row(i).cells)}
    if at is None or len(cells) < 2 or any(":" in cell for cell in cells):  # times of day tell which of the two is the clock
        return None
    column = replace(doc.columns[at], factors=())
    return _beside(with_column(doc, at, column), rng, at, _series(doc, at, rng, rng.choice(("other", "noise"))))


def still_twin(doc: Document, rng: random.Random) -> Document | None:
    """A column with the same header and the same number in all rows."""
    at = column_read(doc, rng)
    return None if at is None else _beside(doc, rng, at, _series(doc, at, rng, "constant"))


def _beside(doc: Document, rng: random.Random, at: int, values: Sequence[float]) -> Document:
    new = replace(doc.columns[at], quantity="", factors=(), told="", added=True)
    return _inserted(doc, rng.choice((at, at + 1)), new, values, 4)


def agreeing_column(doc: Document, rng: random.Random) -> Document | None:
    """The force once more in pounds."""
    at = doc.index("force")
    if at is None or not doc.columns[at].factors or not doc.columns[at].unit:
        return None
    column = doc.columns[at]
    factor = UNITS["force"]["lbf"]
    new = replace(column, unit="lbf", quantity="", factors=(factor,), stands_in="force", added=True)
    values = [doc.row(i).values[at] * column.factors[0] / factor for i in doc.rows()]
    return _inserted(doc, rng.choice((at, at + 1)), new, values, 6)


def _keyed(doc: Document, rng: random.Random) -> tuple[Document, str, str] | None:
    whole = all(len(doc.row(i).cells) == len(doc.columns) for i in doc.rows())
    if not whole or any(c.name is None for c in doc.columns) or len(doc.rows()) < 4:
        return None
    name, keys = rng.choice(list(_KEYS.items()))
    at = rng.choice((0, 1, len(doc.columns)))
    blocks = rng.random() < 0.5
    column = Column(name, added=True) if "(" not in name else Column(name[:-5], " ", "()", "Hz", added=True)
    factors = [rng.choice((0.8, 1.2, 1.5)) for _ in doc.columns]

    def key(row: Row, text: str) -> Row:
        values = (*row.values[:at], NAN, *row.values[at:])
        return replace(row, cells=(*row.cells[:at], text, *row.cells[at:]), values=values)

    def second(row: Row) -> Row:
        cells = tuple(
            shown(row.values[j] * factors[j], max(digits_after(text, c.mark), 2), c)
            if j < len(doc.columns)
            and (c := doc.columns[j]).quantity not in ("", "time", "cycle")
            and row.values[j] == row.values[j]
            else text
            for j, text in enumerate(row.cells)
        )
        return replace(key(replace(row, cells=cells), keys[1]), absent=True)

    body: list[Row | Line] = []
    for item in doc.body:
        body += [key(item, keys[0])] if isinstance(item, Row) else [item]
        if isinstance(item, Row) and not blocks:
            body.append(second(item))
    if blocks:
        body += [second(item) for item in doc.body if isinstance(item, Row)]
    new = replace(
        doc, columns=(*doc.columns[:at], column, *doc.columns[at:]), body=tuple(v for v in body if not isinstance(v, str))
    )
    return new, name, keys[0]


def key_column(doc: Document, rng: random.Random) -> Document | None:
    """Every row twice, of two channels, frequencies or specimens."""
    found = _keyed(doc, rng)
    return None if found is None else replace(found[0], refuse=True)


def key_chosen(doc: Document, rng: random.Random) -> Document | None:
    """The same, and the user says which."""
    found = _keyed(doc, rng)
    if found is None or doc.reading != Reading():
        return None
    new, name, value = found
    header = name if doc.units_row is False or "(" not in name else name[:-5]
    return replace(new, reading=Reading(where={header: value}))


def constant_key(doc: Document, rng: random.Random) -> Document | None:
    """A key column with one value."""
    name, keys = rng.choice([(n, v) for n, v in _KEYS.items() if "(" not in n])
    n, column = len(doc.rows()), Column(name, added=True)
    return insert_column(doc, rng.choice((0, len(doc.columns))), column, [keys[0]] * n, [number(keys[0], column)] * n)


def index_column(doc: Document, rng: random.Random) -> Document | None:
    """A column that counts the rows, with a name."""
    n = len(doc.rows())
    start = rng.choice((0, 1))
    name = rng.choice(("No.", "Index", "#", "Point", "n", "Reading", "Sample", "Row"))
    return insert_column(doc, 0, Column(name, added=True), [str(i + start) for i in range(n)], [i + start for i in range(n)])


def index_without_name(doc: Document, rng: random.Random) -> Document | None:
    """A column that counts the rows, with an empty name or no cell in the header at all."""
    n = len(doc.rows())
    name = rng.choice(("", None))
    return insert_column(doc, 0, Column(name), [str(i) for i in range(n)], [float(i) for i in range(n)])


KINDS = (
    Kind("swap two columns", "order means nothing", swap_columns, True),
    Kind("rival column", "the true one is read and the rival named", rival),
    Kind("two columns of one header", "nothing says which is right", twin),
    Kind("a constant under the same header", "the one that moves is read and the other named, or refused", still_twin),
    Kind("the same force in pounds", "both agree", agreeing_column, True),
    Kind("key column of two values", "a choice must be made", key_column),
    Kind("key column, chosen", "the rows that were chosen", key_chosen, True),
    Kind("key column of one value", "named, as it is not used", constant_key, True),
    Kind("index column", "named, as it is not used", index_column, True),
    Kind("index column without a name", "no reading, and no column is shifted by it", index_without_name),
)
