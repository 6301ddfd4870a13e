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

# Steps that are looked at together.
_AT_ONCE = 4096
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
    calm = np.ones(moves.size, dtype=bool)
    calm[at] = False
    moving = np.abs(moves) > _NOISES * other_noise
    told_by = ((calm & moving, _NEAR), (moving, _FAR), (calm, _NEAR), (np.ones(moves.size, dtype=bool), _FAR))
    step, moved = dy[at], moves[at]
    least = np.maximum(np.minimum(_OF_STEP * np.abs(moved), most), _NOISES * other_noise)
    before, behind = (_slopes(dy, moves, at, side, told_by, least) for side in (-1, 1))
    # Where one side tells none, it may be as steep there as so many times the other, or rest.
    one, alone = np.fmin(before, behind), np.isnan(before) | np.isnan(behind)
    a, b = np.where(alone, 0.0, before) * moved, np.where(alone, _ONE_SIDE * one, behind) * moved
    steepest = np.fmax(np.abs(before), np.abs(behind))
    room = np.abs(a - b) / 2 + _MISS * steepest * np.abs(moved) + _MISS_NOISES * (noise + steepest * other_noise)
    none = np.isnan(steepest)
    off = np.where(none, np.inf, step - (a + b) / 2)
    return Beside(off, np.where(none, 0.0, room), np.where(none, np.nan, before), np.where(none, np.nan, behind))


def _slopes(
    dy: FloatArray, moves: FloatArray, at: IntArray, side: int, told_by: Sequence[tuple[BoolArray, int]], least: FloatArray
) -> FloatArray:
    """Slopes on one side of steps, each to the nearest reading that is farther than so much, by some of them; nan if none."""
    found = np.full(at.size, np.nan)
    for rows, most in told_by:
        left = np.flatnonzero(np.isnan(found))
        for some in np.array_split(left, 1 + left.size // _AT_ONCE):
            near = at[some, None] + side * np.arange(1, most + 1)
            inside = (near >= 0) & (near < moves.size)
            near = np.where(inside, near, 0)
            told = inside & rows[near]
            way = np.cumsum(np.where(told, moves[near], 0.0), axis=1)
            far = np.abs(way) > least[some, None]
            k, ends = np.argmax(far, axis=1), np.any(far, axis=1)
            risen = np.cumsum(np.where(told, dy[near], 0.0), axis=1)
            each = np.arange(some.size)
            found[some[ends]] = risen[each, k][ends] / way[each, k][ends]
    return found
