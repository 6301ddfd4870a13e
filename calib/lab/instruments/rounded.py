"""From the readings of a channel to the rows in which they are rounded more coarsely than in others, and to their course."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# Rows of one coarser step, with several levels, and others that are finer, at least; and the share that repeats the row before.
_LEAST, _LEVELS, _REPEATS = 16, 2, 0.3
# Powers of ten that are looked at, and how near to whole is whole.
_POWERS, _WHOLE, _RELATIVE = 9, 1e-6, 1e-12
# Two levels beside each other are so many steps apart, or the channel jumps between them.
_NEXT = 1.5


@dataclass(frozen=True)
class Rounded:
    """Rows of a channel that are written in coarser steps than all others.

    Attributes
    ----------
    first, behind : the first of them, and the row behind the last, from 0.
    step : in which they are written.
    finest : in which the others are. Both in the unit of the readings.
    """

    first: int
    behind: int
    step: float
    finest: float


def rounded_rows(values: FloatArray) -> list[Rounded]:
    """Find the rows from which on, or up to which, a channel is written with fewer digits: a display, an export that changed.

    Rows that are equal throughout, and levels that never repeat, are none.

    Parameters
    ----------
    values : as written, in the unit of the file, nan where there is none, (n_row,).

    >>> course = np.round(1.2345 + 0.0123 * np.arange(120), 4)
    >>> rounded_rows(np.concatenate([course[:60], np.round(course[60:], 1)]))
    [Rounded(first=60, behind=120, step=0.1, finest=0.0001)]
    >>> rounded_rows(course), rounded_rows(np.round(course, 1))
    ([], [])
    """
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    top = float(np.max(np.abs(y), initial=0.0))
    if y.size < 2 * _LEAST or top == 0.0:
        return []
    first = -math.floor(math.log10(top))
    powers = range(first, first + _POWERS)
    finest = next((k for k in powers if np.all(_whole(y, k))), first + _POWERS)
    found: list[Rounded] = []
    taken = np.zeros(y.size, dtype=bool)
    for power in range(first, finest):
        whole = _whole(y, power) & ~taken
        if y.size - np.count_nonzero(whole) < _LEAST:
            break
        edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(np.int8))).reshape(-1, 2)
        for begin, end in edges[edges[:, 1] - edges[:, 0] >= _LEAST].tolist():
            own = y[begin:end]
            repeats = np.count_nonzero(np.diff(own) == 0) >= _REPEATS * (own.size - 1)
            if repeats and np.count_nonzero(np.diff(own)) >= _LEVELS:
                taken[begin:end] = True
                found.append(Rounded(int(rows[begin]), int(rows[end - 1]) + 1, _ten(power), _ten(finest)))
    return sorted(found, key=lambda r: r.first)


def course_of(values: FloatArray, rounded: Sequence[Rounded], factor: float) -> FloatArray:
    """Readings with the course between their levels in the place of those that are rounded: no level seems to stand still.

    Where levels beside each other are more than a step apart the channel jumps, and goes on to do so.

    Parameters
    ----------
    values : nan where there is none, (n_row,).
    rounded : of them.
    factor : from the unit of these to that of the readings.
    """
    course = values.copy()
    for part in rounded:
        rows = np.flatnonzero(np.isfinite(values[part.first : part.behind])) + part.first
        y = values[rows]
        change = np.flatnonzero(np.diff(y) != 0) + 1
        starts, ends = rows[np.concatenate([[0], change])], rows[np.concatenate([change, [y.size]]) - 1]
        levels = values[starts]
        at = dict(zip(((starts + ends) / 2).tolist(), levels.tolist(), strict=True))
        for k in np.flatnonzero(np.abs(np.diff(levels)) > _NEXT * part.step * abs(factor)).tolist():
            at |= {float(ends[k]): float(levels[k]), float(starts[k + 1]): float(levels[k + 1])}
        # The first and the last level begin and end beyond these rows: there the finer readings beside tell.
        for beside, level in ((part.first - 1, 0), (part.behind, -1)):
            if 0 <= beside < values.size and np.isfinite(values[beside]):
                at.pop(float((starts + ends)[level]) / 2, None)
                at[float(beside)] = float(values[beside])
        places = sorted(at)
        course[rows] = np.interp(rows, places, [at[p] for p in places])
    return course


def in_words(name: str, unit: str, lines: IntArray, part: Rounded) -> str:
    """What is told of such rows.

    Parameters
    ----------
    name, unit : of the column.
    lines : of the file, of each row.
    part : the rows.
    """
    where = f"lines {int(lines[part.first])} to {int(lines[part.behind - 1])}"
    steps = f"{part.step:g} {unit}".rstrip()
    return f'column "{name}": {where} are written in steps of {steps}, all others of {part.finest:g} {unit}'.rstrip() + (
        ": they are rounded more coarsely, and used as they are"
    )


def _whole(y: FloatArray, power: int) -> BoolArray:
    """Which readings are whole multiples of a power of ten."""
    scaled = y * 10.0**power
    return np.asarray(np.abs(scaled - np.rint(scaled)) <= _WHOLE + _RELATIVE * np.abs(scaled))


def _ten(power: int) -> float:
    """A decimal step."""
    return float(f"1e{-power}")
