"""From the steps of two channels in the same rows to those of one that the other makes, at the slope that the rows beside have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# The slope on a side is told by rows over which the other channel changes by so much of its own step, and so many noises.
_OF_STEP, _NOISES = 0.5, 6.0
# Rows on a side that are looked at.
_FAR = 80
# A step may miss what the slopes let expect by such a share, and so many noises; where one side tells no slope it may be
# as much as so many times the other's.
_MISS, _MISS_NOISES, _ONE_SIDE = 0.3, 4.0, 1.5


@dataclass(frozen=True)
class Beside:
    """Steps of a channel beside those of another, each array (n_step,).

    Attributes
    ----------
    off : how far each is off the middle of what the slopes before and behind it make of the other channel's step.
    room : by how much it may be off all the same.
    before, behind : the slopes; nan where the other channel does not move.
    """

    off: FloatArray
    room: FloatArray
    before: FloatArray
    behind: FloatArray

    @property
    def explained(self) -> BoolArray:
        """Which steps are those of the other channel."""
        return np.asarray(np.abs(self.off) <= self.room)


def beside(y: FloatArray, other: FloatArray, at: IntArray, noise: float, other_noise: float) -> Beside:
    """Hold steps of a channel against those of another, such as of a load whose ball is cranked, or pushed from step to step.

    A step is explained if it lies between what the slopes before and behind it make of the other channel's step in the same
    row. A zero that was set anew, a counter that overflowed and a new range change the one channel alone.

    Parameters
    ----------
    y, other : readings of both in the same rows, (n,).
    at : steps, by the reading before them, (n_step,).
    noise, other_noise : scatter of a reading of each, its resolution included.
    """
    # Other such steps tell no slope, unless there is nothing else.
    calm = tuple(_without(v, at) for v in (y, other))
    found = np.full((4, at.size), np.nan)
    found[0], found[1] = np.inf, 0.0
    for k, i in enumerate(at.tolist()):
        step, moved = float(y[i + 1] - y[i]), float(other[i + 1] - other[i])
        least = max(_OF_STEP * abs(moved), _NOISES * other_noise)
        ahead, back = slice(i + 1, i + 2 + _FAR), slice(i, i - _FAR if i >= _FAR else None, -1)
        before, behind = (
            next((s for u, v in (calm, (y, other)) if np.isfinite(s := _slope(u[side], v[side], least))), np.nan)
            for side in (back, ahead)
        )
        slopes = [s for s in (before, behind) if not np.isnan(s)]
        if not slopes:
            continue
        steepest = max(map(abs, slopes))
        slopes = slopes if len(slopes) > 1 else [0.0, _ONE_SIDE * slopes[0]]
        low, high = sorted(s * moved for s in slopes)
        room = (high - low) / 2 + _MISS * steepest * abs(moved) + _MISS_NOISES * (noise + steepest * other_noise)
        found[:, k] = step - (low + high) / 2, room, before, behind
    return Beside(*found)


def _without(values: FloatArray, at: IntArray) -> FloatArray:
    """Readings as they were if some of their steps had not been made."""
    steps = np.diff(values)
    steps[at] = 0.0
    return np.concatenate([values[:1], values[0] + np.cumsum(steps)])


def _slope(y: FloatArray, other: FloatArray, least: float) -> float:
    """The slope from the first reading to the nearest that is farther from it than so much; nan if there is none."""
    far = np.abs(other - other[0]) > least
    if not np.any(far):
        return np.nan
    k = int(np.argmax(far))
    return float((y[k] - y[0]) / (other[k] - other[0]))
