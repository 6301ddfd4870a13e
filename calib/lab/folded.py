"""From a force over the way of the ball to where it bounces off zero, or pulls upside down, as one without its sign does."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter

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
# A pull without its sign is a hump of so many noises and such a share of the largest force, between the press and the rest;
# next to the press it comes to such a share of itself, and at the rest it is no more than that.
_HUMP, _OF_ALL, _LOW = 12.0, 0.02, 0.2
# Readings below zero by so many noises are no zero that was set behind the loss of the sign.
_BELOW = 4.0
# No step is a larger share of the side next to the press, and the ball goes on evenly there, to such a share of that way.
_STEP, _EVENLY = 0.5, 0.25
# Up to the first share of the hump it takes no larger part of the rows to the second, as where its side is no line but round;
# on the side of the press it is below the last share of the hump in no more rows than that.
_FOOT, _HALF, _ROUND, _FLAT = 0.1, 0.5, 0.6, 0.03


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
    noise = reading_noise(size)
    found = [(a, _bounce(abscissa[a : b + 1], size[a : b + 1], noise)) for a, b in _ways(driver)]
    return [a + row for a, row in found if row is not None]


def pulls_of(driver: FloatArray, force: FloatArray) -> list[tuple[int, int]]:
    """Find where a force comes to zero between a press and a hump, as the pull of a sticky sample does without its sign.

    Behind a press, or before it, the load of a ball that goes on is at rest or pulls the other way. Where it comes to zero in
    one place, grows again in the sense of the press as the ball goes on, and is then at rest, it was a pull. A hump that falls
    to zero at once towards the press is one of something that broke; one whose foot is round is none that was turned over; and
    one in which the ball stands still is of what recovers in a hold.

    Parameters
    ----------
    driver : what goes with the ball, a displacement or a capacitance, (n_row,), in the order of reading.
    force : in either sign, (n_row,). All are finite.

    Returns
    -------
    The first and the last row of each pull, one at most on each way of the ball.
    """
    every = force.size // _FINE
    if every > 1 and not pulls_of(driver[::every], force[::every]):
        return []
    if force.size < 2 * _LEAST:
        return []
    size = force if abs(float(np.max(force))) >= abs(float(np.min(force))) else -force
    noise = reading_noise(size)
    if np.min(size) < -_BELOW * noise:
        return []
    largest = float(np.max(size))
    found = []
    for a, b in _ways(driver):
        for inwards in (False, True):
            step = -1 if inwards else 1
            pull = _pull(driver[a : b + 1][::step], size[a : b + 1][::step], max(_HUMP * noise, _OF_ALL * largest), noise)
            if pull is not None:
                first, last = pull
                found.append((b - last, b - first) if inwards else (a + first, a + last))
    return found


def _ways(driver: FloatArray) -> list[tuple[int, int]]:
    """The first and the last row of each way of the ball, from turn to turn."""
    every = max(1, driver.size // _FINE)
    path = calm(driver[::every])
    turns = [every * k for k in reversals(path, max(_WAY * float(np.ptp(path)), 6 * reading_noise(driver)))]
    return list(pairwise(turns))[:_MOST]


def _pull(driver: FloatArray, size: FloatArray, least: float, noise: float) -> tuple[int, int] | None:
    """The first and the last row of a hump behind a press, on one way of the ball out of it; None if there is none."""
    start = int(np.argmax(np.abs(driver - driver[-1])))
    driver, size = driver[start:], size[start:]
    if size.size < 3 * _LEAST:
        return None
    course = np.asarray(median_filter(size, size=3, mode="nearest"))
    fallen = np.minimum.accumulate(course)
    top = int(np.argmax(np.where(fallen <= _LOW * course, course - fallen, 0.0)))
    zero = int(np.argmin(course[: top + 1]))
    zero = max(zero - 1, 0) + int(np.argmin(size[max(zero - 1, 0) : zero + 2]))
    hump, low = float(course[top]), _LOW * float(course[top])
    behind = course[top + 1 :]
    if hump < least or top - zero < 2 or behind.size < _LEAST or float(np.max(course[: zero + 1])) < max(least, low):
        return None
    rest = float(np.median(behind[-max(_LEAST, behind.size // 4) :]))
    if rest > low:
        return None
    side, way = size[zero : top + 1], driver[zero : top + 1]
    if np.max(np.diff(course[zero : top + 1])) > _STEP * hump or not _goes_on(way, driver):
        return None
    foot, half = (int(np.argmax(side >= share * hump + 3 * noise)) for share in (_FOOT, _HALF))
    flat = int(np.argmax(size[zero::-1] >= _FLAT * hump + 3 * noise))
    if foot > max(2.0, _ROUND * half) or flat > half + 2:
        return None
    return start + zero, start + top + 1 + int(np.argmax(behind <= rest + 3 * noise))


def _goes_on(way: FloatArray, driver: FloatArray) -> bool:
    """Whether the ball goes on evenly, in the sense of its whole way."""
    went = float(way[-1] - way[0])
    if went * float(driver[-1] - driver[0]) <= 0 or abs(went) < 4 * reading_noise(driver):
        return False
    even = way[0] + went * np.arange(way.size) / (way.size - 1)
    return bool(np.max(np.abs(way - even)) <= _EVENLY * abs(went) + 2 * reading_noise(driver))


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
