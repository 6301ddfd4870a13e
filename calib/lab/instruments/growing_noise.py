"""From readings of a channel to the noise of those as large, where noise grows with the reading."""

from __future__ import annotations

from math import comb, sqrt

import numpy as np

from models.sensor import FloatArray

# Noise is told by differences of this order of readings that are off rest by such a share of the range, if there are so many.
_ORDER, _AWAY, _FEWEST = 3, 0.2, 12
# Readings at the beginning that show the rest: such a share of them, and as many at most.
_OF_REST, _MOST = 0.1, 9


def growing_noise(y: FloatArray, levels: FloatArray) -> FloatArray:
    """Scatter of readings of a size, if noise is a share of how far they are off rest, as of many load cells and amplifiers.

    The scatter of all readings of a press is that of the many near zero and says little of those in contact. Where noise does
    not grow this is about what it is, a little less near rest and a little more at the peak. What few readings do, damaged
    ones among them, does not count.

    Parameters
    ----------
    y : readings of a channel in order, (n,).
    levels : readings, of any shape.

    Returns
    -------
    Standard deviations, of that shape; 0 where too few readings tell.
    """
    if y.size <= _ORDER:
        return np.zeros(np.shape(levels))
    rest = float(np.median(y[: max(1, min(_MOST, int(_OF_REST * y.size)))]))
    off = np.abs(y - rest)
    away = off[:-_ORDER]
    for k in range(1, _ORDER + 1):
        away = np.minimum(away, off[k : off.size - _ORDER + k])
    there = away > _AWAY * float(np.max(off))
    if np.count_nonzero(there) < _FEWEST:
        return np.zeros(np.shape(levels))
    share = float(np.median(np.abs(np.diff(y, _ORDER))[there] / away[there]))
    return np.asarray(1.4826 * share / sqrt(comb(2 * _ORDER, _ORDER)) * np.abs(levels - rest))
