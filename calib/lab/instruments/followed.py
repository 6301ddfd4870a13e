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
# One of two curves is the right one if the other misses the readings by so many times as much, or so many where those that it
# misses by are mere noise, no more than so many times their scatter; and if it is likelier by so much, by its logarithm.
_BETTER, _BY_NOISE, _IS_NOISE, _LIKELIER = 2.0, 1.2, 1.3, 5.0
# One that misses them by more than so many times their scatter is none that they follow.
_MISSES = 5.0
# The likelier of two may be contradicted by such a share of that.
_CONTRADICTED = 0.3
# Another channel goes on or turns by where it has moved by so many of its noises.
_MOVES = 6.0
# It misses them by less than such a share of the jump; the one without a jump by so many times as much.
_FITS, _NO_JUMP = 0.05, 4.0
# Multiples that are told from the same and from none, and how far off -1 one of another sign may be.
_LEAST, _MOST, _MIRROR = 1.1, 5.0, 1.2
# So near -1 it is no chance, of a load above such a share of the largest.
_OPPOSITE, _PRESSED = 0.05, 0.1
# Multiples that are tried, beside that of the readings next to the jump, twice, the second time as much nearer.
_TRIED, _AROUND = 41, 0.5
# So that a curve over few places has a solution.
_RIDGE = 1e-9


@dataclass(frozen=True)
class Followed:
    """What stands behind a jump, by the curves over other channels.

    Attributes
    ----------
    factor : by which the readings are multiplied from there on, if they are.
    kind : "multiple" or "shifted", where the other comes less near to the readings; "" where that is not told.
    by : the channels over which it shows.
    """

    factor: float
    kind: str
    by: frozenset[str]


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
    jump = abs(float(y[i + 1] - y[i]))
    good: list[tuple[str, _Fit]] = []
    shifted = 0.0
    for quantity, w in witnesses.items():
        noise, rubs = _MOVES * noise_of(w), None
        grows = float(np.sign(np.cov(np.abs(y[first : i + 1]), w[first : i + 1])[0, 1])) if i > first else 0.0
        for n in _WINDOWS:
            rows = np.arange(max(i + 1 - n, first), min(i + n, last) + 1)
            before = rows <= i
            if min(np.count_nonzero(before), np.count_nonzero(~before)) < _WINDOWS[0] or not np.ptp(w[rows]):
                continue
            fit = _fitted(y[rows], w[rows], before)
            rubs = _rubs(grows, w[rows], before, noise) if rubs is None else rubs
            if fit.shifted.missed < _FITS * jump:
                shifted = max(shifted, fit.shifted.likelier(fit.multiple))
            if _may_be(fit, jump) and (fit.factor < 0 or (rubs is not None and rubs * (fit.factor - 1) >= 0)):
                good.append((quantity, fit))
    if not good:
        return None
    likelier = max(f.multiple.likelier(f.shifted) for _, f in good)
    by = frozenset(q for q, f in good if f.multiple.likelier(f.shifted))
    kind = "shifted" if likelier < _CONTRADICTED * shifted else "multiple" if shifted < _CONTRADICTED * likelier else ""
    # That a new zero turns readings into their opposite would be chance; a ball that sticks and snaps off may do so, near none.
    pressed = abs(float(y[i])) > _PRESSED * float(np.max(np.abs(y)))
    if not kind and pressed and any(abs(f.factor + 1) < _OPPOSITE for _, f in good):
        kind, by = "multiple", frozenset(q for q, _ in good)
    # The widest windows tell the two apart, those in which a curve bends the least the factor.
    best = min((f for q, f in good if q in by or not by), key=lambda f: f.multiple.missed / np.sqrt(f.multiple.n))
    return Followed(best.factor if best.factor > 0 else -1.0, kind, by)


@dataclass(frozen=True)
class _Curve:
    """By how much a curve misses readings, for each number that they have more, their scatter about it, and their number."""

    missed: float
    scatter: float
    n: int

    def likelier(self, other: _Curve) -> float:
        """By how much this one is the likelier of two, as a logarithm; 0 where it is not for sure."""
        least = _BY_NOISE if self.missed < _IS_NOISE * self.scatter else _BETTER
        likelier = (self.n - 4) * float(np.log(max(other.missed, 1e-300) / max(self.missed, 1e-300)))
        told = other.missed > least * self.missed and self.missed < _MISSES * self.scatter
        return likelier if told and likelier > _LIKELIER else 0.0


@dataclass(frozen=True)
class _Fit:
    """Curves through readings: with a multiple behind a jump, with another zero there, and without a jump."""

    factor: float
    multiple: _Curve
    shifted: _Curve
    plain: _Curve


def _may_be(fit: _Fit, jump: float) -> bool:
    """Whether a multiple that is one comes near to the readings, and the curve without a jump does not."""
    size = max(abs(fit.factor), 1 / abs(fit.factor))
    is_one = _LEAST < size < _MOST if fit.factor > 0 else size < _MIRROR
    return is_one and fit.multiple.missed < _FITS * jump and fit.plain.missed > _NO_JUMP * fit.multiple.missed


def _rubs(grows: float, w: FloatArray, before: BoolArray, noise: float) -> float | None:
    """Which multiples friction cannot make: where another channel turns a load that grew falls to a part of itself at once.

    1 for those above one alone, -1 for those below, 0 for all, where the other channel goes on; None if it does not move.
    `grows` is 1 if the load rises with the other channel, -1 if it falls.
    """
    moves = float(w[before][-1] - w[before][0]), float(w[~before][-1] - w[~before][0])
    if min(map(abs, moves)) <= noise:
        return None
    return 0.0 if moves[0] * moves[1] > 0 else grows * float(np.sign(moves[0]))


def _fitted(y: FloatArray, w: FloatArray, before: BoolArray) -> _Fit:
    """Fit curves of second order over another channel to readings on both sides of a jump."""
    at = (w - np.mean(w)) / np.ptp(w)
    curve = np.stack([np.ones(at.size), at, at**2], axis=1)
    # What a multiple misses, for each number that is tried, by the sums of both sides.
    sums = [(curve[side].T @ curve[side], curve[side].T @ y[side]) for side in (before, ~before)]
    factor = float(y[~before][0] / y[before][-1]) if y[before][-1] and y[~before][0] else 1.0
    around = _AROUND
    for _ in range(2):
        tried = factor * np.exp(np.linspace(-around, around, _TRIED))
        squares = sums[0][0] + tried[:, None, None] ** 2 * sums[1][0]
        products = sums[0][1] + tried[:, None] * sums[1][1]
        # As large as the squares of the multiples, or it is lost among them where the other channel has two values only.
        ridge = _RIDGE * (1 + tried[:, None, None] ** 2) * np.eye(3)
        met = np.sum(products * np.linalg.solve(squares + ridge, products[..., None])[..., 0], axis=1)
        factor = float(tried[np.argmax(met)])
        around *= 2 / _TRIED
    multiple = _of(curve * np.where(before, 1.0, factor)[:, None], y)
    return _Fit(factor, multiple, _of(np.column_stack([curve, ~before]), y), _of(curve, y))


def _of(curve: FloatArray, y: FloatArray) -> _Curve:
    """The nearest of the curves."""
    left = y - curve @ np.linalg.lstsq(curve, y, rcond=None)[0]
    return _Curve(float(np.sqrt(left @ left / (y.size - 4))), noise_of(left), y.size)
