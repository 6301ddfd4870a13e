"""From the steps of two channels in the same rows to those of one that the other makes, at the slope of the rows beside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# The slope on a side is told by rows over which the other channel changes by so much of its own step, or such a share of its
# range where the step is large, and so many noises.
_OF_STEP, _OF_RANGE, _NOISES = 0.5, 0.02, 6.0
# Rows on a side that are looked at, and those of which other such steps are left out.
_FAR, _NEAR = 80, 20
# A step may miss what the slopes let expect by such a share, and so many noises; where one side tells no slope it may be
# as much as so many times the other's.
_MISS, _MISS_NOISES, _ONE_SIDE = 0.3, 4.0, 1.5

# A step is far off by so many times what it may be; slopes are alike within such a factor.
_FAR_OFF, _ALIKE = 2.0, 2.5


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

    @property
    def goes_on(self) -> BoolArray:
        """Which steps are far off, between slopes that are alike."""
        small, large = (of(np.abs(self.before), np.abs(self.behind)) for of in (np.fmin, np.fmax))
        alike = (self.before * self.behind > 0) & (large <= _ALIKE * small)
        return np.asarray(alike & (np.abs(self.off) > _FAR_OFF * self.room))


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
    dy, moves, most = np.diff(y), np.diff(other), _OF_RANGE * float(np.ptp(other))
    # Other such steps tell no slope unless there is nothing else, nor do rows in which the other channel rests.
    calm = ~np.isin(np.arange(moves.size), at)
    moving = np.abs(moves) > _NOISES * other_noise
    told_by = ((calm & moving, _NEAR), (moving, _FAR), (calm, _NEAR), (np.ones(moves.size, dtype=bool), _FAR))
    found = np.full((4, at.size), np.nan)
    found[0], found[1] = np.inf, 0.0
    for k, i in enumerate(at.tolist()):
        step, moved = float(dy[i]), float(moves[i])
        least = max(min(_OF_STEP * abs(moved), most), _NOISES * other_noise)
        sides = slice(i - 1, i - 1 - _FAR if i > _FAR else None, -1) if i else slice(0), slice(i + 1, i + 1 + _FAR)
        before, behind = (_slope(dy[side], moves[side], [(rows[side], far) for rows, far in told_by], least) for side in sides)
        slopes = [s for s in (before, behind) if not np.isnan(s)]
        if not slopes:
            continue
        steepest = max(map(abs, slopes))
        slopes = slopes if len(slopes) > 1 else [0.0, _ONE_SIDE * slopes[0]]
        low, high = sorted(s * moved for s in slopes)
        room = (high - low) / 2 + _MISS * steepest * abs(moved) + _MISS_NOISES * (noise + steepest * other_noise)
        found[:, k] = step - (low + high) / 2, room, before, behind
    return Beside(*found)


def _slope(steps: FloatArray, moves: FloatArray, told_by: Sequence[tuple[BoolArray, int]], least: float) -> float:
    """The slope from a reading to the nearest that is farther from it than so much, by some of the steps; nan if none is."""
    for rows, most in told_by:
        way = np.cumsum(np.where(rows, moves, 0.0)[:most])
        far = np.abs(way) > least
        if np.any(far):
            k = int(np.argmax(far))
            return float(np.sum(steps[: k + 1][rows[: k + 1]]) / way[k])
    return np.nan
