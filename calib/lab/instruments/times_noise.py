"""From steps of a channel to how far they are more than its noise, which may grow with the reading."""

from __future__ import annotations

from math import comb, sqrt

import numpy as np

from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# Noise is told by differences of this order between readings nearly as large: so many, and such a share of all, as few may lie
# close by chance; the larger counts.
_ORDER, _ALIKE, _SHARE = 3, 24, 0.15
# The quartile of their sizes, in standard deviations; it is surer than the median of as few.
_QUARTILE, _OF_NORMAL = 0.75, 1.1503
# Readings go on from where a step ends, as none go on from one that is noise, if a curve with a step there through so many on
# either side has one of so many times its own scatter.
_GO_ON, _STEPS = (6, 8, 12, 20), 9.0


def times_noise(y: FloatArray, at: IntArray, off: FloatArray, turns: IntArray) -> FloatArray:
    """Hold steps of a channel against its noise, which may be larger where the readings are, as that of many load cells is.

    The scatter of all readings of a press is that of the many near zero and says little of those in contact. So a step is
    held against what scatters there is of readings as large as those on both sides of it.

    Parameters
    ----------
    y : readings of the channel in order, (n,).
    at : steps, by the reading before them, (n_step,).
    off : how far each is off those beside it, (n_step,).
    turns : readings in which the press turns, over which none goes on.

    Returns
    -------
    How many times as large as that scatter each is, (n_step,); inf where the readings go on from where it ends.
    """
    if not at.size or y.size <= _ORDER:
        return np.full(at.size, np.inf)
    with np.errstate(divide="ignore"):
        return np.where(_goes_on(y, at, turns), np.inf, off / _noise_at(y, at))


def _noise_at(y: FloatArray, at: IntArray) -> FloatArray:
    """Scatter of the readings on both sides of steps, the larger of the two, by that of others as large, (n_step,)."""
    differences, level = np.abs(np.diff(y, _ORDER)), y[1 : 1 - _ORDER]
    order = np.argsort(level, kind="stable")
    beside = np.searchsorted(level[order], np.stack([y[at], y[at + 1]]))
    scatter = np.zeros(at.size)
    for n in (min(_ALIKE, level.size), int(_SHARE * level.size)):
        alike = order[np.clip(beside - n // 2, 0, level.size - n)[..., None] + np.arange(n)]
        if n:
            scatter = np.maximum(scatter, np.max(np.quantile(differences[alike], _QUARTILE, axis=-1), axis=0))
    return np.asarray(scatter / _OF_NORMAL / sqrt(comb(2 * _ORDER, _ORDER)))


def _goes_on(y: FloatArray, at: IntArray, turns: IntArray) -> BoolArray:
    """Whether the readings behind steps go on from where these end, by curves of second order through those on both sides."""
    found = np.zeros(at.size, dtype=bool)
    for n in _GO_ON:
        places = np.arange(1 - n, n + 1) - 0.5
        curve = np.stack([places > 0, np.ones(2 * n), places / n, (places / n) ** 2], axis=1)
        inverse = np.linalg.pinv(curve)
        inside = np.flatnonzero((at + 1 >= n) & (at + n < y.size))
        first, last = at[inside] + 1 - n, at[inside] + n
        inside = inside[np.searchsorted(turns, first) == np.searchsorted(turns, last)]
        near = y[at[inside, None] + np.arange(1 - n, n + 1)]
        left = near - near @ inverse.T @ curve.T
        scatter = np.sqrt(np.sum(left**2, axis=1) / (2 * n - 4)) * float(np.linalg.norm(inverse[0]))
        found[inside] |= np.abs(near @ inverse[0]) > _STEPS * scatter
    return found
