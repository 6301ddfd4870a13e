"""A document in, one in which it is harder to see which way compression points out; the numbers are as written."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mutants.document import Document, Row, digits_after, number, put, shown, with_cells
from mutants.kind import Kind
from mutants.of_rows import changed_row, whole_rows
from mutants.presses import pressed


def _pair(doc: Document) -> tuple[int, int] | None:
    """The columns of displacement and force, if both are read, in whole rows of plain numbers."""
    places = [doc.index(q) for q in ("displacement", "force")]
    if set(doc.turned) != {"displacement", "force"} or not pressed(doc):
        return None
    if doc.refuse or any(doc.row(i).absent for i in doc.rows()):
        return None  # rows of two records, of which each has its press
    at = [j for j in places if j is not None and doc.columns[j].factors and not doc.columns[j].group]
    rows = doc.rows()
    if len(at) < 2 or len(rows) < 30 or any(doc.row(i).values[j] != doc.row(i).values[j] for i in rows for j in at):
        return None
    return None if len(whole_rows(doc)) < len(rows) else (at[0], at[1])


def _path(doc: Document, at: int) -> tuple[float, float]:
    """How far apart the last place is from the first, and the range of all, without a jump where the zero was set anew."""
    values = np.array([doc.row(i).values[at] for i in doc.rows()])
    steps = np.diff(values)
    steps[np.abs(steps) > max(20.0 * float(np.median(np.abs(steps))), 0.5 * float(np.ptp(values)))] = 0.0
    path = np.cumsum([0.0, *steps])
    return float(path[-1]), float(np.ptp(path))


def _range(doc: Document, at: int) -> float:
    values = [doc.row(i).values[at] for i in doc.rows()]
    return max(values) - min(values)


def _rewritten(row: Row, at: int, value: float, doc: Document) -> Row:
    column = doc.columns[at]
    text = shown(value, digits_after(row.cells[at], column.mark), column)
    return replace(row, cells=put(row.cells, at, text), values=put(row.values, at, number(text, column)))


def _moved(doc: Document, at: int, shift: Callable[[int, float], float]) -> Document:
    """The document with a column's numbers moved, by place among the rows and number."""
    column = doc.columns[at]
    place = iter(range(len(doc.rows())))

    def changed(text: str, value: float) -> tuple[str, float]:
        new = shown(shift(next(place), value), digits_after(text, column.mark), column)
        return new, number(new, column)

    return replace(with_cells(doc, at, changed), signs=True)


def spike(doc: Document, rng: random.Random) -> Document | None:
    """One force, or two in a row, far out on the other side."""
    at = _pair(doc)
    if at is None:
        return None
    away = -doc.turned["force"] * _range(doc, at[1]) * rng.uniform(1.5, 4.0)
    start = rng.randrange(len(doc.rows()) - 1)
    for i in doc.rows()[start : start + rng.choice((1, 2))]:
        doc = changed_row(doc, i, replace(_rewritten(doc.row(i), at[1], away, doc), doubtful=True))
    return replace(doc, signs=True)


def pull_off(doc: Document, rng: random.Random) -> Document | None:
    """The record goes on: back to where it began and further, with a pull larger than the press before the ball lets go."""
    at, clock = _pair(doc), doc.index("time")
    if at is None or clock is None or not doc.columns[clock].factors or doc.columns[clock].mark != "." or doc.free_time:
        return None
    rows = [doc.row(i) for i in doc.rows()]
    last, first, n = rows[-1], rows[0], max(len(rows) // 3, 12)
    if ":" in last.cells[clock] or last.values[clock] != last.values[clock]:
        return None
    step = (last.values[clock] - first.values[clock]) / (len(rows) - 1)
    way, travel = _path(doc, at[0])
    end = last.values[at[0]] - way - 0.4 * doc.turned["displacement"] * travel
    press = doc.turned["force"] * _range(doc, at[1])
    pull, zero = rng.uniform(1.2, 2.5), first.values[at[1]]
    added = []
    for k in range(1, n + 1):
        part = k / n
        new = _rewritten(last, clock, last.values[clock] + k * step, doc)
        new = _rewritten(new, at[0], last.values[at[0]] + (end - last.values[at[0]]) * part, doc)
        force = float(np.interp(part, (0.0, 0.35, 0.85, 0.9), (last.values[at[1]], zero, zero - pull * press, zero)))
        added.append(replace(_rewritten(new, at[1], force, doc), origin=-1, doubtful=True))
    after = doc.rows()[-1] + 1
    return replace(doc, body=(*doc.body[:after], *added, *doc.body[after:]), signs=True)


def starts_pressed(doc: Document, rng: random.Random) -> Document | None:
    """The record begins at its largest force."""
    at = _pair(doc)
    if at is None:
        return None
    rows = doc.rows()
    top = max(rows, key=lambda i: doc.turned["force"] * doc.row(i).values[at[1]])
    if len(rows) - rows.index(top) < 20:
        return None
    return replace(doc, body=doc.body[top:], signs=True)


def reset(doc: Document, rng: random.Random) -> Document | None:
    """The extension is set to zero within the record."""
    at = _pair(doc)
    if at is None:
        return None
    k = rng.randrange(5, len(doc.rows()) * 2 // 3)
    zero = doc.row(doc.rows()[k]).values[at[0]]
    return _moved(doc, at[0], lambda i, value: value - zero if i >= k else value)


def drift(doc: Document, rng: random.Random) -> Document | None:
    """The force drifts to the other side by a third to two thirds of the press."""
    at = _pair(doc)
    if at is None:
        return None
    rate = -doc.turned["force"] * _range(doc, at[1]) * rng.uniform(0.3, 0.7) / len(doc.rows())
    return _moved(doc, at[1], lambda i, value: value + rate * i)


def offset(doc: Document, rng: random.Random) -> Document | None:
    """The load was not zeroed, by more than the press."""
    at = _pair(doc)
    if at is None:
        return None
    shift = rng.choice((-1.0, 1.0)) * _range(doc, at[1]) * rng.uniform(1.0, 3.0)
    return _moved(doc, at[1], lambda _, value: value + shift)


_SAME = "compression points where it did, or refused"

KINDS = (
    Kind("force: spike on the other side", _SAME, spike),
    Kind("force: pull-off larger than the press", _SAME, pull_off),
    Kind("force: drift", _SAME, drift),
    Kind("force: not zeroed", _SAME, offset),
    Kind("record starts pressed", _SAME, starts_pressed),
    Kind("extension reset within the record", _SAME, reset),
)
