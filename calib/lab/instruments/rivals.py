"""From two columns for one quantity to whether they agree: the same, the same but for zero or sign, or different."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calib.lab.instruments.clock import read_clock
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.numbers import to_numbers
from models.sensor import FloatArray

# Rows that are compared, spread over the record.
_SEEN = 4000
# Two columns agree to this share of their span: what instruments round to.
_SHARE = 0.01
# Two columns may be one quantity, measured twice, where spans differ by no more than this factor and readings go together.
_AS_MUCH, _TOGETHER, _FEWEST_TOGETHER = 2.0, 0.95, 5
# The sum of two parts of one way goes as far as such a share of the one with steps; of these, in few rows but several, the
# other takes back all but such a share in so many.
_AS_FAR, _FEW, _SEVERAL, _LEFT, _MANY = 0.5, 0.25, 3, 0.3, 0.6


def readings(columns: Sequence[Sequence[str]], factors: Sequence[float], decimal: str = "") -> list[FloatArray]:
    """The numbers of some columns of one file in SI, at the same rows each, for comparison; nan where a cell holds none.

    Parameters
    ----------
    columns : cells, equally many in each.
    factors : to SI, one of each column.
    decimal : the decimal mark where the file declares it; else the one that makes most cells numbers.
    """
    step = max(1, -(-len(columns[0]) // _SEEN)) if columns else 1
    seen = [column[::step] for column in columns]
    marks = [decimal] if decimal else [".", ","]
    tried = [[_numbers(cells, mark) for cells in seen] for mark in marks]
    best = max(tried, key=lambda found: sum(int(np.isfinite(v).sum()) for v in found))
    return [values * factor for values, factor in zip(best, factors, strict=True)]


def _numbers(cells: Sequence[str], decimal: str) -> FloatArray:
    if any(is_clock(c) for c in cells[:20]):
        return read_clock(cells).seconds
    return to_numbers([c.strip() for c in cells], decimal).values


def stands_still(values: FloatArray) -> bool:
    """Whether a column of three readings or more holds one value only."""
    there = values[np.isfinite(values)]
    return there.size >= 3 and bool(np.all(there == there[0]))


def goes_back(values: FloatArray) -> bool:
    """Whether a time falls somewhere, as one that begins anew at every cycle."""
    return bool(np.any(np.diff(values[np.isfinite(values)]) < 0))


def difference(one: FloatArray, other: FloatArray) -> tuple[str, float]:
    """Tell how two columns of the same rows differ: "same", "zero" or "sign" (but for that), else "different".

    Parameters
    ----------
    one, other : readings in SI, (n_row,).

    Returns
    -------
    The word, and the largest difference that it leaves, as a share of the span of the first.
    """
    both = np.isfinite(one) & np.isfinite(other)
    if np.count_nonzero(both) < 2:
        return "different", 1.0
    a, b = one[both], other[both]
    # Not the largest reading: a position of 240 mm that moves by 1 mm is compared by what it moves by.
    size = float(np.ptp(a))
    if size == 0.0:
        return ("same", 0.0) if np.array_equal(a, b) else ("different", 1.0)

    def left(residual: FloatArray) -> float:
        return float(np.max(np.abs(residual))) / size

    plain = left(a - b)
    if plain <= _SHARE:
        return "same", plain
    for word, residual in (("zero", a - b), ("sign", a + b)):
        # A zero in the middle would leave half of what two scales differ by.
        rest = max(left(residual - np.median(residual)), abs(_slope(a, residual)))
        if rest <= _SHARE:
            return word, rest
    return "different", plain


def _slope(a: FloatArray, b: FloatArray) -> float:
    """By how much readings go up with those of another column, which do not stand still."""
    off = a - np.mean(a)
    return float(off @ b / (off @ off))


def moves_with(one: FloatArray, other: FloatArray) -> bool:
    """Whether a column goes up or down with another by about as much, so that both may be one quantity, measured twice.

    Parameters
    ----------
    one, other : readings in SI, (n_row,).
    """
    both = np.isfinite(one) & np.isfinite(other)
    a, b = one[both], other[both]
    if a.size < _FEWEST_TOGETHER or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return False
    as_much = 1 / _AS_MUCH <= float(np.ptp(b) / np.ptp(a)) <= _AS_MUCH
    return as_much and abs(float(np.corrcoef(a, b)[0, 1])) > _TOGETHER


def add_up(one: FloatArray, other: FloatArray) -> bool:
    """Whether two columns are the parts of one way, as of two drives: one goes in steps, which the other takes back.

    Parameters
    ----------
    one, other : readings in SI, (n_row,).

    >>> way = np.linspace(0, 0.95, 40)
    >>> add_up(np.floor(10 * way) / 10, way - np.floor(10 * way) / 10), add_up(way, way + 0.01)
    (True, False)
    """
    both = np.isfinite(one) & np.isfinite(other)
    a, b = one[both], other[both]
    if a.size < _FEWEST_TOGETHER:
        return False
    step = np.abs(np.diff(a))
    steps = step > 0.5 * np.max(step)
    if not _SEVERAL <= np.count_nonzero(steps) <= _FEW * a.size or np.ptp(a + b) < _AS_FAR * np.ptp(a):
        return False
    taken_back = np.abs(np.diff(a + b))[steps] <= _LEFT * step[steps]
    return bool(np.mean(taken_back) >= _MANY)


def but_for_zero(one: FloatArray, other: FloatArray) -> float:
    """Tell how far two columns of the same rows are apart once their zeros are made one, as a share of the larger span.

    Parameters
    ----------
    one, other : readings in SI, (n_row,).

    Returns
    -------
    The largest such difference; infinite where fewer than two rows have both.
    """
    both = np.isfinite(one) & np.isfinite(other)
    if np.count_nonzero(both) < 2:
        return np.inf
    a, b = one[both], other[both]
    apart = a - b - np.median(a - b)
    span = max(float(np.ptp(a)), float(np.ptp(b)))
    return float(np.max(np.abs(apart))) / span if span > 0 else 0.0


def holds_clock(cells: Sequence[str]) -> bool:
    """Whether a column holds times of day, by its first fifty cells."""
    return any(map(is_clock, (c for c in cells[:50] if c.strip())))
