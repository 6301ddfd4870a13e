"""From steps of a channel to how far they are more than its noise, which may grow with the reading."""

from __future__ import annotations

import numpy as np

from calib.lab.instruments.growing_noise import growing_noise
from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# Readings go on from where a step ends, as none go on from one that is noise, if a curve with a step there through so many on
# either side has one of so many times its own scatter.
_GO_ON, _STEPS = (6, 8, 12, 20), 9.0


def times_noise(y: FloatArray, at: IntArray, off: FloatArray, turns: IntArray) -> FloatArray:
    """Hold steps of a channel against its noise, which may be larger where the readings are, as that of many load cells is.

    Parameters
    ----------
    y : readings of the channel in order, (n,).
    at : steps, by the reading before them, (n_step,).
    off : how far each is off those beside it, (n_step,).
    turns : readings in which the press turns, over which none goes on.

    Returns
    -------
    How many times as large as that scatter each is, (n_step,); inf where readings go on from where it ends, or too few tell.
    """
    noise = np.max(growing_noise(y, np.stack([y[at], y[at + 1]])), axis=0)
    untold = (noise == 0) | _goes_on(y, at, turns)
    return np.where(untold, np.inf, off / np.where(untold, 1.0, noise))


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
