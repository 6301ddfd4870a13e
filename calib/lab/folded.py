"""From a force over the way of the ball to the rows in which it bounces off zero, as one shown without its sign does."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from calib.lab.shape import calm
from calib.lab.signal import reading_noise, reversals
from models.sensor import FloatArray

# A force without its sign comes to less than such a share of its largest, and the ball goes by such a share of its way at once.
_NEAR_ZERO, _WAY = 0.05, 0.1
# Rows on either side of the bounce: at least, and as shares of the stretch of the ball's way in which it lies.
_LEAST, _SIDES = 4, (0.02, 0.035, 0.06, 0.1, 0.16, 0.25)
# Of a longer record every nth row tells where the ball turns.
_FINE = 4000
# Stretches that are looked at; rounds in which the row of the bounce settles.
_MOST, _ROUNDS = 40, 6
# On both sides the readings go away from zero by so many noises, and by such a share of the other side. Turned round on one,
# they are smooth: off a cubic by so many times less (in squares); or by no more than their noise, by so many sd of its square,
# while as written they are off by so many times more and so many squares of the noise.
_NOISES, _ALIKE, _SMOOTHER = 8.0, 0.2, 16.0
_AS_NOISE, _TIMES, _FEWER = 3.0, 1.5, 150.0


def bounces_of(driver: FloatArray, abscissa: FloatArray, force: FloatArray) -> list[int]:
    """Find where a force falls to zero and rises again as the ball goes on, so that it is smooth only with both signs.

    A force that is shown without its sign (|F - F0|) is never below zero, and comes to zero with the slope with which it
    leaves it. So does none of a press: it touches softly, or leaps, and where it pulls it is below zero. A ball that turns
    round there makes such a corner, too, so that only rows of one way of it are looked at.

    Parameters
    ----------
    driver : what goes with the ball, a displacement or a capacitance, (n_row,), in the order of reading.
    abscissa : along which the force is smooth, (n_row,): the displacement, a time or the number of the reading.
    force : in either sign, (n_row,). All are finite.

    Returns
    -------
    The first row behind each bounce, one at most on each way of the ball.
    """
    size = np.abs(force)
    if force.size < 2 * _LEAST or np.any(force > 0) == np.any(force < 0) or np.min(size) > _NEAR_ZERO * np.max(size):
        return []
    every = max(1, driver.size // _FINE)
    path = calm(driver[::every])
    turns = [every * k for k in reversals(path, max(_WAY * float(np.ptp(path)), 6 * reading_noise(driver)))]
    noise = reading_noise(size)
    ways = list(pairwise(turns))[:_MOST]
    found = [(a, _bounce(abscissa[a : b + 1], size[a : b + 1], noise)) for a, b in ways]
    return [a + row for a, row in found if row is not None]


def _bounce(x: FloatArray, size: FloatArray, noise: float) -> int | None:
    """The first row behind a bounce within one way of the ball, at any of several widths; None if there is none."""
    lowest = int(np.argmin(size))
    sides = sorted({max(_LEAST, round(share * size.size)) for share in _SIDES})
    for side in sides:
        near = slice(max(lowest - side, 0), lowest + side + 1)
        row = _smooth_if_turned(x[near], size[near], noise)
        if row is not None:
            return near.start + row
    return None


def _smooth_if_turned(x: FloatArray, size: FloatArray, noise: float) -> int | None:
    """The first row of those that, with the ones before turned round, make the readings smooth; None if none do."""
    if x.size < 2 * _LEAST or np.ptp(x) <= 0:
        return None
    powers = np.vander((x - np.mean(x)) / np.ptp(x), 4)
    row = int(np.argmin(size)) + 1
    for _ in range(_ROUNDS):
        turned = np.where(np.arange(size.size) < row, -size, size)
        course = powers @ np.linalg.lstsq(powers, turned, rcond=None)[0]
        before, row = row, int(np.count_nonzero(course < 0))
        if row == before:
            break
    if not _LEAST - 1 <= row <= size.size - _LEAST + 1:
        return None
    plain = powers @ np.linalg.lstsq(powers, size, rcond=None)[0]
    ends = -float(course[0]), float(course[-1])
    if min(ends) < max(_NOISES * noise, _ALIKE * max(ends)):
        return None
    off, off_turned = (float(np.sum(a**2)) for a in (size - plain, turned - course))
    if off > _SMOOTHER * off_turned:
        return row
    free, square = size.size - powers.shape[1], noise**2
    as_noise = off_turned <= (free + _AS_NOISE * math.sqrt(2.0 * free)) * square
    return row if as_noise and off > max(_TIMES * off_turned, off_turned + _FEWER * square) else None
