"""From a jump of one channel to what stands behind it: the same curve shifted, or a multiple of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.spikes import noise_of
from models.sensor import BoolArray, FloatArray

# Readings on either side over which a curve is drawn through those before and behind a jump.
_WINDOWS = (4, 6, 10, 16, 24, 48, 96)
# One of two curves is the right one if the other misses the readings by so many times as much, or, where those that it misses
# by are mere noise, by so many times its uncertainty; they are if they are no more than so many times their scatter.
_BETTER, _BY_NOISE, _IS_NOISE = 2.0, 3.0, 1.3
# It misses them by less than such a share of the jump; the one without a jump by so many times as much.
_FITS, _NO_JUMP = 0.05, 4.0
# Multiples that are told from the same and from none, and how far off -1 one of another sign may be.
_LEAST, _MOST, _MIRROR = 1.1, 5.0, 1.2
# So near -1 it is no chance.
_OPPOSITE = 0.05
# Factors that are the same over two channels.
_ALIKE = 0.1
# Multiples that are tried, beside that of the readings next to the jump, twice, the second time as much nearer.
_TRIED, _AROUND = 41, 0.5


@dataclass(frozen=True)
class Followed:
    """What stands behind a jump, by the curves over other channels.

    Attributes
    ----------
    factor : by which the readings are multiplied from there on, if they are.
    kind : "multiple" or "shifted", where the other comes less near to the readings; "" where that is not told.
    by : the channels over which it shows.
    by_all : whether all channels let a multiple by this factor be.
    """

    factor: float
    kind: str
    by: frozenset[str]
    by_all: bool


def followed(y: FloatArray, witnesses: Mapping[str, FloatArray], i: int, jumps: IntArray) -> Followed | None:
    """Tell a channel whose range or sign changes from a reading on from one whose zero does.

    The curve with another zero is as steep over another channel behind the jump as before; one in another range, or of another
    sign, is steeper by the factor by which its readings are larger. Both have one number more than the curve, so that the one
    that comes nearer to the readings is the right one.

    Parameters
    ----------
    y : readings of the channel, (n,).
    witnesses : quantity -> readings of others in the same rows, each (n,), none of which shows the jump.
    i : the last reading before the jump.
    jumps : the last reading before each jump of the channel.

    Returns
    -------
    What follows; None if no multiple does, or there is no jump from the curve before.
    """
    first = max([0, *(jumps[jumps < i] + 1).tolist()])
    last = min([y.size - 1, *jumps[jumps > i].tolist()])
    fits: dict[str, list[_Fit]] = {}
    for quantity, w in witnesses.items():
        for n in _WINDOWS:
            rows = np.arange(max(i + 1 - n, first), min(i + n, last) + 1)
            before = rows <= i
            if min(np.count_nonzero(before), np.count_nonzero(~before)) >= _WINDOWS[0] and np.ptp(w[rows]):
                fits.setdefault(quantity, []).append(_fitted(y[rows], w[rows], before))
    jump = abs(float(y[i + 1] - y[i]))
    good = [(q, f) for q, of in fits.items() for f in of if _may_be(f, jump)]
    if not good:
        return None
    by = frozenset(q for q, f in good if f.multiple.is_better(f.shifted))
    shifted = any(f.shifted.is_better(f.multiple) for of in fits.values() for f in of if f.shifted.missed < _FITS * jump)
    best = min((f for q, f in good if q in by or not by), key=lambda f: f.multiple.missed / f.shifted.missed)
    kind = "shifted" if shifted and not by else "multiple" if by and not shifted else ""
    # That a new zero turns readings into their opposite would be chance.
    if not kind and not shifted and any(abs(f.factor + 1) < _OPPOSITE for _, f in good):
        kind, by = "multiple", frozenset(q for q, _ in good)
    alike = {q for q, f in good if abs(f.factor / best.factor - 1) < _ALIKE}
    return Followed(best.factor, kind, by, alike == set(witnesses))


@dataclass(frozen=True)
class _Curve:
    """By how much a curve misses readings, for each number that they have more, their scatter about it, and how many they are."""

    missed: float
    scatter: float
    n: int

    def is_better(self, other: _Curve) -> bool:
        """Whether this one is the right one of two."""
        least = 1 + _BY_NOISE / np.sqrt(self.n) if self.missed < _IS_NOISE * self.scatter else _BETTER
        return bool(other.missed > min(least, _BETTER) * self.missed)


@dataclass(frozen=True)
class _Fit:
    """Curves through readings: with a multiple behind a jump, with another zero there, and without a jump.

    The other channel goes on over the jump, or it turns: there a load falls to a part of itself, as by friction.
    """

    goes_on: bool
    factor: float
    multiple: _Curve
    shifted: _Curve
    plain: _Curve


def _may_be(fit: _Fit, jump: float) -> bool:
    """Whether a multiple that is one comes near to the readings, and the curve without a jump does not."""
    size = max(abs(fit.factor), 1 / abs(fit.factor))
    is_one = _LEAST < size < _MOST and fit.goes_on if fit.factor > 0 else size < _MIRROR
    return is_one and fit.multiple.missed < _FITS * jump and fit.plain.missed > _NO_JUMP * fit.multiple.missed


def _fitted(y: FloatArray, w: FloatArray, before: BoolArray) -> _Fit:
    """Fit curves of second order over another channel to readings on both sides of a jump."""
    at = (w - np.mean(w)) / np.ptp(w)
    curve = np.stack([np.ones(at.size), at, at**2], axis=1)
    factor = float(y[~before][0] / y[before][-1]) if y[before][-1] and y[~before][0] else 1.0
    around = _AROUND
    for _ in range(2):
        tried = factor * np.exp(np.linspace(-around, around, _TRIED))
        factor = min(tried.tolist(), key=lambda k: _of(curve * np.where(before, 1.0, k)[:, None], y).missed)
        around *= 2 / _TRIED
    multiple = _of(curve * np.where(before, 1.0, factor)[:, None], y)
    goes_on = bool((w[before][-1] - w[before][0]) * (w[~before][-1] - w[~before][0]) > 0)
    return _Fit(goes_on, factor, multiple, _of(np.column_stack([curve, ~before]), y), _of(curve, y))


def _of(curve: FloatArray, y: FloatArray) -> _Curve:
    """The nearest of the curves."""
    left = y - curve @ np.linalg.lstsq(curve, y, rcond=None)[0]
    return _Curve(float(np.sqrt(left @ left / (y.size - 4))), noise_of(left), y.size)
