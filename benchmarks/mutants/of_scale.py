"""A document in, one of which rows are in another unit or range out, or whose words say so: nothing of these may be read."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

from mutants.document import NAN, Document, Line, digits_after, put, shown, with_rows
from mutants.kind import Kind
from mutants.of_rows import whole_rows

_FACTORS = {
    "force": (101.9716213, 1000.0, 0.001, 0.1019716213, 0.2248089431, 10.0, 100.0, 0.1),
    "displacement": (1000.0, 1 / 25.4, 0.1, 10.0),
    "capacitance": (0.001, 1000.0, 10.0, 100.0),
}
# Readings beside a switch that must hang together, by how much, and how many counts of their last digit they must be.
_BESIDE, _ALIKE, _COUNTS = 4, 0.25, 100.0
_COMMENTS = ("# force now in mN", "# units: kN", "% range x10", "// gain 10", "# Load: gf", "# extension now in um")
_ABOVE = ("Load gain: 10", "Amplifier factor 2", "Range x10", "Verstärkung: 100", "Multiplier = 0.5")


def _switch(block: bool) -> Callable[[Document, random.Random], Document | None]:
    def change(doc: Document, rng: random.Random) -> Document | None:
        places = [j for j, c in enumerate(doc.columns) if c.quantity in _FACTORS and c.factors and not c.group]
        rows = whole_rows(doc)
        if not places or len(rows) < 30 or len(rows) < len(doc.rows()):
            return None
        at = rng.choice(places)
        for _ in range(20):
            first = rng.randrange(_BESIDE, len(rows) - _BESIDE)
            last = min(first + rng.randrange(2, 30), len(rows)) if block else len(rows)
            if _is_calm(doc, at, rows[first - _BESIDE : first + _BESIDE]):
                return _rescaled(doc, at, rows[first:last], rng)
        return None

    return change


def _is_calm(doc: Document, at: int, places: Sequence[int]) -> bool:
    """Whether the readings hang together, move, and are far from zero."""
    values = [doc.row(i).values[at] for i in places]
    middle = sum(values) / len(values)
    digit = 10.0 ** -digits_after(doc.row(places[0]).cells[at], doc.columns[at].mark)
    steps = [abs(b - a) for a, b in pairwise(values)]
    moves = doc.columns[at].quantity == "capacitance" or min(steps) > 3 * digit
    return moves and abs(middle) > _COUNTS * digit and all(abs(v - middle) <= _ALIKE * abs(middle) for v in values)


def _rescaled(doc: Document, at: int, places: Sequence[int], rng: random.Random) -> Document:
    column = doc.columns[at]
    factor = rng.choice(_FACTORS[column.quantity])
    more = round(-math.log10(factor)) if factor < 1 or rng.random() < 0.5 else 0

    def changed(text: str, value: float) -> str:
        return shown(value * factor, max(digits_after(text, column.mark) + more, 0), column)

    return with_rows(
        doc,
        lambda row: replace(
            row,
            cells=put(row.cells, at, changed(row.cells[at], row.values[at])),
            values=put(row.values, at, NAN),
            doubtful=True,
        ),
        places,
    )


def comment(doc: Document, rng: random.Random) -> Document | None:
    """A comment among the rows that says that they are in another unit from there on."""
    rows = doc.rows()
    if len(rows) < 10:
        return None
    at = rows[rng.randrange(3, len(rows) - 3)]
    return replace(doc, body=(*doc.body[:at], Line(rng.choice(_COMMENTS)), *doc.body[at:]), refuse=True)


def factor_above(doc: Document, rng: random.Random) -> Document | None:
    """A line above that states a gain."""
    if not any(c.quantity in ("force", "capacitance") and c.factors for c in doc.columns):
        return None
    word = rng.choice(_ABOVE if doc.index("force") is not None else _ABOVE[1:])
    return replace(doc, above=(word, *doc.above), refuse=True)


KINDS = (
    Kind("unit switched from a row on", "refused, as nothing says which rows are right", _switch(False), last=True),
    Kind("unit switched for a block", "refused, or the block left out", _switch(True), last=True),
    Kind("comment of another unit among the rows", "refused, as the rows below may be in it", comment, last=True),
    Kind("factor stated above", "refused, as it may have been applied or not", factor_above, last=True),
)
