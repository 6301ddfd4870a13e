"""From the displacement or the force of a record to its branches: loading, unloading or hold, of which cycle each row is."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from calib.lab.instruments import IntArray
from calib.lab.shape import calm, working_range
from calib.lab.signal import reading_noise, reversals
from calib.lab.stretches import stretches
from models.sensor import BoolArray, FloatArray

# Readings on either side of where a smoothed record turns among which it does; of the steps there, how far beyond it the
# reading may lie at which it turns, one farther off being a stray, and by how little readings are as far.
_NEAR, _BEYOND, _AS_FAR = 3, 4, 0.5
# By how much of its noise a load falls between two readings, if it does.
_GIVES_WAY = 4
# How far the force has risen, as a share of its range, where contact is taken to begin; and where a record begins pressed.
_TOUCHED, _PRESSED = 0.05, 0.2
# Travel, as a share of that over which the force changes, from which on a crosshead does not stand still.
_STANDS = 0.05
# A press before the first that reaches half of the largest is one of a growing series if it reaches such a share of the next in
# force (depths of 1 to 2 make 0.35 by Hertz, 0.2 in a thin layer), or in displacement, which counts an approach, too; and if it
# goes back to less than such a share of its own.
_GROWS, _GROWS_IN_DEPTH, _BACK = 0.2, 0.45, 0.5


def label_branches(
    values: FloatArray, time: FloatArray | None, force: FloatArray | None, *, standstill: bool
) -> tuple[npt.NDArray[np.object_], IntArray, BoolArray]:
    """Label every row of a record with its branch, and count the cycles.

    A loading branch opens a cycle if it reaches half of the largest indentation, counted from where the force rises, or is one
    of a series of presses that grows up to there.

    Parameters
    ----------
    values : displacement, or force in a record without one, (n_row,), compression positive, in the order of reading.
    time : [s], likewise; None for the number of the reading.
    force : beside a displacement; None if there is none.
    standstill : whether rows in which the values stand still are a hold.

    Returns
    -------
    Per row its label, the cycle it belongs to (0 before the first), and whether it loads again within its cycle.
    """
    n = values.size
    noise = reading_noise(values)
    smooth = median_filter(values, size=5, mode="nearest") if n >= 15 else values
    span = float(np.ptp(smooth))
    labels = np.full(n, "hold", dtype=object)
    cycle = np.zeros(n, dtype=np.int64)
    again = np.zeros(n, dtype=bool)
    share = 0.02 if standstill else 0.05
    if span <= 6 * noise or span == 0.0:
        return labels, cycle, again
    # A press may be short against approach and withdrawal: it is measured by where the force changes.
    working = span if force is None else min(span, max(working_range(smooth, calm(force)), 0.02 * span))
    turns = reversals(smooth, max(share * working, 6 * noise))
    rises = [bool(smooth[b] > smooth[a]) for a, b in pairwise(turns)]
    turns = _turning_rows(values, smooth, turns, force, noise)
    clock = np.arange(n, dtype=float) if time is None else time - time[0]
    still = np.zeros(n, dtype=bool)
    count = 0
    top = float(np.max(smooth))
    # From the start, not from the lowest: a ball may be withdrawn further than it is pressed. Unless the record starts pressed.
    base = float(smooth[0]) if top - smooth[0] >= 0.1 * span else float(np.min(smooth))
    if force is not None:
        touch, pressed = _touch(smooth, force)
        base = touch if pressed else max(base, touch)
    parts = list(pairwise(turns))
    opening = [rising and bool(smooth[b] - base >= 0.5 * (top - base)) for (_, b), rising in zip(parts, rises, strict=True)]
    if force is not None:
        rise, grows = _rise(smooth, median_filter(force, size=5, mode="nearest")), _GROWS
        least = 6 * reading_noise(force)
    else:
        rise, grows = smooth - base, _GROWS_IN_DEPTH if standstill else _GROWS
        least = 6 * noise
    for k in _growing(parts, opening, rise, grows, least):
        opening[k] = True
    for (start, stop), rising, opens in zip(parts, rises, opening, strict=True):
        # The readings at which it turns are the last and the first of the ways on which the ball goes in.
        rows = slice(start + (not rising and start > 0), stop + (rising or stop == n - 1))
        count += int(opens)
        labels[rows] = "loading" if rising else "unloading"
        cycle[rows] = count
        again[rows] = rising and not opens and count > 0
        if standstill:
            still[rows] |= _standing(values[rows], clock[rows], noise, span, working)
    labels[still] = "hold"
    return labels, cycle, again


def _turning_rows(
    values: FloatArray, smooth: FloatArray, turns: Sequence[int], force: FloatArray | None, noise: float
) -> list[int]:
    """The rows of the readings at which a record turns: the farthest near each turn of the smoothed one, whose tip is cut off.

    Parameters
    ----------
    values, smooth : the readings, and the same smoothed, (n_row,).
    turns : rows at which the smoothed ones turn, with the first and the last row.
    force : beside a displacement, or None.
    noise : of a reading.
    """
    load_noise = 0.0 if force is None else reading_noise(force)
    found = [turns[0]]
    for before, turn, after in zip(turns, turns[1:], turns[2:], strict=False):
        way = np.sign(smooth[turn] - smooth[before])
        low, high = max(turn - _NEAR, found[-1] + 1), min(turn + _NEAR, after - 1)
        near = values[low : high + 1]
        beyond = (near - smooth[turn]) * way
        steps = np.abs(np.diff(smooth[max(before, low - _NEAR) : high + 2]))
        beyond[beyond > max(_BEYOND * float(np.max(steps)), 6 * noise)] = -np.inf
        # It may turn between two readings, or rest: the first of those that are as far is the last on the way in.
        as_far = max(_AS_FAR * float(np.median(steps[: max(turn - low, 1)])), 2 * noise)
        at = low + int(np.argmax(beyond >= np.max(beyond) - as_far))
        # A load that gives way on the last step in shows that the ball was on its way back when it was read.
        if force is not None and way > 0 and at - 1 > found[-1] and force[at - 1] - force[at] > _GIVES_WAY * load_noise:
            at -= 1
        found.append(at)
    return [*found, turns[-1]]


def _touch(x: FloatArray, force: FloatArray) -> tuple[float, bool]:
    """Displacement from which on the force has risen, or the smallest if noise hides that; whether it has in the first row."""
    rise = _rise(x, calm(force))
    top = float(np.max(rise))
    noise = 6 * reading_noise(force)
    beyond = x[rise > max(_TOUCHED * top, noise)]
    return float(np.min(beyond)) if beyond.size else float(np.min(x)), bool(rise[0] > max(_PRESSED * top, noise))


def _rise(x: FloatArray, force: FloatArray) -> FloatArray:
    """The force, less what it is where the ball is furthest from the sensor."""
    return np.asarray(force - float(np.median(force[x <= float(np.min(x)) + 0.1 * float(np.ptp(x))])))


def _growing(
    parts: Sequence[tuple[int, int]], opening: Sequence[bool], rise: FloatArray, grows: float, least: float
) -> list[int]:
    """Which parts before the first that opens a cycle are presses of a series that grows up to it, each by itself.

    Parameters
    ----------
    parts : first and last row of each monotone part.
    opening : which of them open a cycle anyway.
    rise : what a press is measured by, from its level at rest, (n_row,).
    grows : share of the next press that one has to reach.
    least : rise up to which there is none.
    """
    found: list[int] = []
    if True not in opening:
        return found
    following = opening.index(True)
    high = float(np.max(rise[slice(*parts[following])]))
    for k in reversed(range(following)):
        start, stop = parts[k]
        peak = float(np.max(rise[start : stop + 1]))
        back = float(np.min(rise[stop : parts[following][0] + 1]))
        if rise[stop] > rise[start] and peak > max(grows * high, least) and back < _BACK * peak:
            found.append(k)
            following, high = k, peak
    return found


def _standing(values: FloatArray, clock: FloatArray, noise: float, span: float, working: float) -> BoolArray:
    """Rows of one monotone stretch where the crosshead stands still, found by its speed over a few rows.

    A slow press after a fast approach does not stand still: it gets on by some of the range over which the force changes.
    """
    n = values.size
    still = np.zeros(n, dtype=bool)
    if n < 20:
        return still
    duration = float(clock[-1] - clock[0])
    travel = abs(float(values[-1] - values[0]))
    if duration <= 0 or travel == 0:
        return still
    mean_speed = travel / duration
    interval = duration / (n - 1)
    half = 3
    while half < n // 8 and 4 * noise * np.sqrt(2 / half) / (half * interval) > 0.2 * mean_speed:
        half = half * 3 // 2 + 1
    speed_noise = noise * np.sqrt(2 / half) / (half * interval)
    padded = np.concatenate([[0.0], np.cumsum(values - values[0])])
    ticks = np.concatenate([[0.0], np.cumsum(clock - clock[0])])
    i = np.arange(n)
    lo, hi = np.maximum(i - half, 0), np.minimum(i + half, n)
    mid_lo, mid_hi = np.maximum(i, 1), np.minimum(i, n - 1)
    before = (padded[mid_lo] - padded[lo]) / (mid_lo - lo)
    after = (padded[hi] - padded[mid_hi]) / (hi - mid_hi)
    elapsed = (ticks[hi] - ticks[mid_hi]) / (hi - mid_hi) - (ticks[mid_lo] - ticks[lo]) / (mid_lo - lo)
    speed = np.abs(after - before) / np.maximum(elapsed, 1e-12)
    slow = speed < max(4 * speed_noise, 0.05 * mean_speed)
    tolerance = max(3 * noise, 2e-4 * span)
    inner: list[tuple[int, int]] = []
    for begin, end in stretches(slow):
        if end - begin < half or abs(float(values[end - 1] - values[begin])) > max(6 * noise, _STANDS * working):
            continue
        level = float(np.median(values[begin:end]))
        while begin > 0 and abs(values[begin - 1] - level) <= tolerance:
            begin -= 1
        while end < n and abs(values[end] - level) <= tolerance:
            end += 1
        still[begin:end] = True
        if begin > 0 and end < n:
            inner.append((begin, end))
    # A staircase stands still most of the time and is measured there.
    if sum(e - b for b, e in inner) > n / 2:
        for b, e in inner:
            still[b:e] = False
    return still
