"""From the readings of a record to those that stand alone: a lost contact, an over-range mark, a damaged number."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from calib.lab.instruments.growing_noise import growing_noise
from calib.lab.instruments.labtable import IntArray
from models.sensor import FloatArray

#: Quantities of which each reading is near to those beside it.
SMOOTH = ("displacement", "force", "capacitance", "capacitance_series")
# What a motor drives does not jump and come back from one reading to the next.
_DRIVEN = ("displacement",)
# A reading stands alone if it is so far from the line between those beside it: in the noise of all readings, in the last digit
# of all, in the steps beside it.
_NOISES, _DIGITS, _STEPS = 15.0, 4.0, 6.0
# Noise may grow with the reading: it is off by so many times what readings as large scatter.
_AS_LARGE = 6.0
# Readings in succession that may do so together, and readings on either side that are looked at.
_RUN, _BESIDE = 3, 4
# Of those on a side so many may be beyond an end of the record.
_BEYOND = 2
# Of the steps on both sides so many may be larger: another reading that stands alone makes two.
_LARGER = 2
# A reading at an end stands alone if it is beyond all others by so many times their range.
_RANGES = 1.0
# Among steps nearly as large as it is, one is told by the course: off it by so many of these steps, and of the bends beside it,
# where other channels go on straight, whose steps differ by less than this share.
_OFF_STEPS, _OFF_BENDS, _STRAIGHT = 1.5, 6.0, 0.6
# Where they bend but go on one way, it must come back by so many of the steps beside it.
_COMES_BACK = 3.0
# It, and another so many rows behind it.
_TOGETHER = (0, 1, 2, 3)
# Records of more readings have no steps as large.
_SHORT = 5000
# So many readings may look off where a few are, as those between them do.
_MOST_OFF = 12
# A reading is off the cubic through those beside it by so many of their own scatters, and of all readings', and last digits;
# how many readings are taken out one after the other.
_CUBIC_LOCAL, _CUBIC_NOISES, _CUBIC_DIGITS = 12.0, 8.0, 4.0
_PASSES = 8
# A reading is on the line of those before it, and so many behind it rest, within such a share of how far it is off the cubic.
_ON_LINE, _AT_REST = 0.2, 3
# Differences in succession that are nothing, as a share of the readings, are of a range that ends there.
_STILL, _NOTHING = 8, 1e-12
# Of a long record the noise is that of so many readings.
_SAMPLE = 20_000
# A way of the ball is such a share of its travel; where it turns is beyond the middle of those beside by so many largest steps.
# A ball rests that is so near, in the largest steps, to where it turns.
_WAY, _A_TURN, _RESTS, _NO_TURN = 0.15, 1.6, 0.25, np.zeros(0, dtype=np.int64)
# Where others do not go on straight a reading is off by such a share of the range; so many stand on both sides
# of it where a record ends, and where the ball turns.
_MATTERS, _BOTH_SIDES, _BEFORE_A_TURN = 0.005, 3, 2
# A share of the range that no touch between readings of a channel which is sampled more rarely than others is off a cubic by.
_MORE_THAN_A_TOUCH = 0.05
# A channel keeps to its course within so many scatters of those beside it, of all, or last digits; so few tell a course.
_KEEPS, _FEWEST_BESIDE = 3.0, 6
# Another channel tells where a reading is if it moves by so many noises, within so many of both, and such a share of how far
# the reading is off.
_MOVED, _GOES_WITH, _SHARP = 6.0, 3.0, 0.7
# A step so many times as large as the others near it is a jump.
_A_JUMP = 4.0
# The ball goes on where the readings beside go so much of their steps one way; a capacitance goes with the load within a share.
_ONE_WAY, _IN_PROPORTION = 0.8, 0.3
# Steps of so many times the middle one may be leaps, of twice as many in a long record.
_MAY_LEAP = 3.0
# Readings that are looked at: each that is wrong, and each corner, makes eight beside it look off.
_MOST_LOOKED_AT = 120
# Readings that repeat the one before, from this share on, show the step of a display; a number is whole within so much.
_REPEATED, _WHOLE, _ABOUT = 0.05, 1e-3, 1.001
# Where a larger share of a record seems to stand alone, it is what the record is like.
_SHARE = 0.1
# A gap counts as so many rows that are missing at most: a course is not followed over more.
_MOST_MISSING = 8


def alone(values: Mapping[str, FloatArray], time: FloatArray | None = None) -> dict[str, dict[int, float]]:
    """Find readings that leave those beside them and come back at once, as nothing does that a tester presses on.

    At a turn, a touch or a snap the steps beside a reading are as large as its own, and it is left alone; and so is what force
    and capacitance show both, as something has happened then, unless there is a displacement that does not: nothing comes back
    at once to where the ball goes on, so that both were not measured. No crosshead comes back at once. Where rows are missing,
    or were written at uneven times, a reading that goes on as those beside it over time does not stand alone.

    Parameters
    ----------
    values : quantity -> readings, nan where there is none, (n_row,).
    time : when, in any unit, nan where it is not known, (n_row,); None where no time is read.

    Returns
    -------
    Quantity -> row -> what the readings beside it are near to, in their unit.
    """
    found = _alone_or_both(values)
    if not found or time is None or (places := _places(time)) is None:
        return found
    spread = {q: np.full(int(places[-1]) + 1, np.nan) for q in values}
    for quantity, own in spread.items():
        own[places] = values[quantity]
    over_time = _alone_or_both(spread)
    near = {q: {r: over_time.get(q, {}).get(int(places[r])) for r in rows} for q, rows in found.items()}
    told = {q: {r: v for r, v in rows.items() if v is not None} for q, rows in near.items()}
    return {q: rows for q, rows in told.items() if rows}


def _places(time: FloatArray) -> IntArray | None:
    """Where each row stands if none were missing, by the usual step of time; None if none are, or time does not tell."""
    steps = np.diff(time)
    forward = steps[steps > 0]
    if not forward.size:
        return None
    usual = float(np.median(forward))
    apart = np.clip(np.nan_to_num(np.rint(steps / usual), nan=1.0), 1, 1 + _MOST_MISSING).astype(np.int64)
    return np.concatenate([[0], np.cumsum(apart)]) if np.any(apart > 1) else None


def _alone_or_both(values: Mapping[str, FloatArray]) -> dict[str, dict[int, float]]:
    """Find readings that stand alone, row by row, as `alone` does: of one channel, and of load and capacitance together."""
    found = _alone(values)
    for capacitance in (q for q in SMOOTH[2:] if {"displacement", "force"} <= values.keys() and q in values):
        pair = ("force", capacitance)
        if not _leap_together(*(values[q] for q in pair)):
            continue
        # Each beside the ball alone: what both do there while it goes on has not happened.
        each = {q: _alone({"displacement": values["displacement"], q: values[q]}).get(q, {}) for q in pair}
        both = [r for r in each["force"] if r in each[capacitance]]
        place = values["displacement"]
        ball = {r for r in both if r not in found.get("displacement", {}) and _is_beside(place, r)}
        # While the ball does not go on, a knock shows in both alike.
        ball = {r for r in ball if _goes_on_evenly(place, r) or not _is_on_course(values["force"], values[capacitance], r)}
        for q in pair if ball else ():
            found[q] = {**found.get(q, {}), **{r: each[q][r] for r in ball}}
    return found


def _leap_together(one: FloatArray, other: FloatArray) -> bool:
    """Whether two channels leap from one row to the next, and do so again nearby, which is told at once of most records."""
    there = np.isfinite(one) & np.isfinite(other)
    steps = np.abs(np.diff(np.stack([one[there], other[there]])))
    if steps.shape[1] < 2 * _BESIDE:
        return False
    least = (_MAY_LEAP if steps.shape[1] <= _SHORT else 2 * _MAY_LEAP) * np.median(steps, axis=1)
    return bool(np.count_nonzero(np.all(steps > least[:, None], axis=0)) > 1)


def _is_beside(values: FloatArray, row: int) -> bool:
    """Whether a reading is no farther from those beside it than these are from each other, and its noise."""
    there = np.isfinite(values)
    if not there[row]:
        return False
    rows = np.flatnonzero(there)
    k = int(np.searchsorted(rows, row))
    near = np.delete(values[rows[max(k - _BESIDE, 0) : k + _BESIDE + 1]], min(k, _BESIDE))
    room = float(np.ptp(near)) / near.size + _KEEPS * noise_of(values[rows])
    return bool(np.min(near) - room <= values[row] <= np.max(near) + room)


def _goes_on_evenly(values: FloatArray, row: int) -> bool:
    """Whether the readings beside one go one way, none of their steps being most of it."""
    rows = np.flatnonzero(np.isfinite(values))
    k = int(np.searchsorted(rows, row))
    near = values[rows[max(k - _BESIDE, 0) : k + _BESIDE + 1]]
    gone, steps = abs(float(near[-1] - near[0])), np.abs(np.diff(near))
    return gone > max(_ONE_WAY * float(np.sum(steps)), _KEEPS * noise_of(values[rows]), 2 * float(np.max(steps)))


def _is_on_course(load: FloatArray, capacitance: FloatArray, row: int) -> bool:
    """Whether a capacitance is what it is elsewhere at such a load, or goes on in proportion beyond all others."""
    there = np.isfinite(load) & np.isfinite(capacitance)
    there[row] = False
    rows = np.flatnonzero(there)
    near = rows[np.argsort(np.abs(load[rows] - load[row]))[: 2 * _BESIDE]]
    slope = (np.ptp(capacitance[rows]) / np.ptp(load[rows])) if np.ptp(load[rows]) > 0 else 0.0
    level, beyond = float(np.median(capacitance[near])), float(load[row] - np.median(load[near]))
    off = min(abs(float(capacitance[row]) - level - way * slope * beyond) for way in (1, -1))
    return off < max(
        float(np.ptp(capacitance[near])), _KEEPS * noise_of(capacitance[rows]), _IN_PROPORTION * slope * abs(beyond)
    )


def _alone(values: Mapping[str, FloatArray]) -> dict[str, dict[int, float]]:
    """Find readings that stand alone, row by row, each channel beside all others."""
    channels = {q: values[q] for q in SMOOTH if q in values}
    found = {q: _runs_of(y) for q, y in channels.items()}
    leaving = {q: {r for rows in of.values() for run in rows for r in run} for q, of in found.items()}
    turns = turns_of(channels["displacement"]) if "displacement" in channels else _NO_TURN
    kept: dict[str, dict[int, float]] = {}
    for quantity, runs in found.items():
        rows: dict[int, float] = {}
        for length, by_rows in runs.items():
            beside = {r for q in found if q != quantity and (length > 1 or q not in _DRIVEN) for r in leaving[q]}
            for run, near in by_rows.items():
                if (length == 1 and quantity in _DRIVEN) or not beside & set(run):
                    rows.update((r, rows.get(r, near)) for r in run)
        if len(channels) > 1:
            others = [_beside_it(channels[quantity], y) for q, y in channels.items() if q != quantity]
            rows |= {r: near for r, near in _off_course(channels[quantity], others).items() if r not in rows}
            left = np.where(np.isin(np.arange(channels[quantity].size), list(rows)), np.nan, channels[quantity])
            off = _off_cubic(left, others, turns)
            rows |= {r: v for r, v in off.items() if not any(_goes_with(channels[quantity], o.values, r, v) for o in others)}
        rows |= {r: near for r, near in _at_ends(channels[quantity]).items() if r not in rows}
        rows = _more_than_noise(channels[quantity], rows)
        if 0 < len(rows) <= max(1, _SHARE * np.count_nonzero(np.isfinite(channels[quantity]))):
            kept[quantity] = rows
    return kept


def _more_than_noise(values: FloatArray, rows: Mapping[int, float]) -> dict[int, float]:
    """Those of some rows -> what is near them that are off it by more than readings as large scatter."""
    noise = growing_noise(values[np.isfinite(values)], np.array(list(rows.values())))
    least = dict(zip(rows, _AS_LARGE * noise, strict=True))
    return {r: near for r, near in rows.items() if abs(float(values[r]) - near) > least[r]}


@dataclass(frozen=True, eq=False)
class _Other:
    """Another channel where one has readings, `values`, nan elsewhere; all of its own, `whole`; and whether it has many more.

    From one of its rows to the next, a channel that is sampled more often hides what happens between readings of the other.
    """

    values: FloatArray
    whole: FloatArray
    is_finer: bool


def _beside_it(values: FloatArray, other: FloatArray) -> _Other:
    """Another channel, (n_row,), where one has readings, (n_row,)."""
    rows, there = np.isfinite(values), np.flatnonzero(np.isfinite(other))
    is_finer = there.size > max(2 * int(np.count_nonzero(rows & np.isfinite(other))), 1)
    if is_finer:
        between = np.interp(np.arange(values.size), there, other[there])
        return _Other(np.where(rows, between, np.nan), other[there], is_finer)
    return _Other(other, other[there], is_finer)


def _runs_of(values: FloatArray) -> dict[int, dict[tuple[int, ...], float]]:
    """Of each number of readings in succession: rows of those that stand alone -> the middle of those on either side."""
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    if y.size <= 2 * _BESIDE:
        return {}
    floor = max(_NOISES * noise_of(y), _DIGITS * last_step(y))
    return {length: _runs(rows, y, floor, length) for length in range(1, _RUN + 1)}


def _runs(rows: IntArray, y: FloatArray, floor: float, length: int) -> dict[tuple[int, ...], float]:
    if y.size < length + 2 * _BESIDE:
        return {}
    # Beside an end fewer are looked at: beyond it the course goes on as mirrored there.
    y, rows = np.pad(y, _BEYOND, mode="reflect", reflect_type="odd"), np.pad(rows, _BEYOND)
    # The first of a run is off the one before by more than five sixths of how far it is off the line.
    first = _BESIDE + np.flatnonzero(
        np.abs(np.diff(y[_BESIDE - 1 : y.size - _BESIDE - length + 1])) > floor * (1 - 1.2 / _STEPS)
    )
    if not first.size:
        return {}
    before, after = y[first - 1], y[first + length]
    share = np.arange(1, length + 1) / (length + 1)
    line = before[:, None] + (after - before)[:, None] * share
    off = np.min(np.abs(y[first[:, None] + np.arange(length)] - line), axis=1)
    slope = np.abs(after - before) / (length + 1)
    first, off, slope = (v[(off > floor) & (off > _STEPS * slope)] for v in (first, off, slope))
    if not first.size:
        return {}
    sides = [first[:, None] - 1 - np.arange(_BESIDE - 1), first[:, None] + length + np.arange(_BESIDE - 1)]
    steps = np.concatenate(
        [np.abs(y[sides[0]] - y[sides[0] - 1]), np.abs(y[sides[1] + 1] - y[sides[1]]), slope[:, None]], axis=1
    )
    usual = np.maximum(np.sort(steps, axis=1)[:, -1 - _LARGER], slope)
    found = first[off > _STEPS * usual]
    return {tuple(rows[k : k + length].tolist()): float(y[k - 1] + y[k + length]) / 2 for k in found.tolist()}


def _off_course(values: FloatArray, others: Sequence[_Other]) -> dict[int, float]:
    """Readings, one or two near each other, off a course of large steps, while other channels go on -> what is near them."""
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    if not 2 * _BESIDE <= y.size <= _SHORT:
        return {}
    floor = max(_NOISES * noise_of(y), _DIGITS * last_step(y))
    off = np.abs(np.diff(y, 2)) / 2
    usual = np.abs(y[2:] - y[:-2]) / 2
    at = (1 + np.flatnonzero((off > floor) & (off > usual))).tolist()
    found: dict[int, float] = {}
    if len(at) > max(_MOST_OFF, _SHARE * y.size):
        return found
    for k in at:
        for also in _TOGETHER:
            left = [k] if not also else [k, k + also]
            near = _beside(rows, y, left, floor)
            if near and not any(int(rows[r]) in found for r in left):
                lone = not also and _comes_back(y, k, floor)
                if all(_straight(o, int(rows[r])) or (lone and _goes_on(o.values, int(rows[r]))) for o in others for r in left):
                    found |= {int(rows[r]): v for r, v in zip(left, near, strict=True)}
                break
    return found


def _off_cubic(values: FloatArray, others: Sequence[_Other], turns: IntArray) -> dict[int, float]:
    """Readings off the cubic through those beside it, which these keep to, while other channels go on -> what it lets expect.

    Only readings of one way of the ball are held against each other. Where a channel has a corner (a touch, a step) the
    readings beside do not keep to a cubic, and nothing is told.
    """
    found: dict[int, float] = {}
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    cubic = np.insert(_cubic((*range(-_BESIDE, 0), *range(1, _BESIDE + 1)))[0], _BESIDE, 0.0)
    for _ in range(_PASSES):
        if not 3 * _BESIDE < y.size <= _SHORT:
            break  # of many readings one does not matter
        digit, noise = _digit(y), noise_of(y, 4)
        if last_step(np.unique(y)) < 2 * digit:
            noise = min(noise, noise_of(y))  # it is that of the last digit
        floor = max(_CUBIC_NOISES * noise, _CUBIC_DIGITS * digit)
        off = np.abs(y - np.convolve(y, cubic, "same")) > floor
        off[:_BESIDE] = off[-_BESIDE:] = True
        for turn in np.searchsorted(rows, turns).tolist():
            off[max(turn - _BESIDE, 0) : turn + _BESIDE + 1] = True
        at = np.flatnonzero(off)
        if at.size > max(_MOST_LOOKED_AT, _SHARE * y.size):
            break
        told = {k: near for k in at.tolist() if (near := _expected(rows, y, k, floor, turns)) is not None}
        # A wrong reading makes those beside it seem off: the one farthest off is taken first.
        # At an end nothing tells a corner from it.
        told = {k: v for k, v in told.items() if _is_told(rows, y, k, v, floor, turns, others) and not _begins_a_hold(y, k, v)}
        if not told:
            break
        best = max(told, key=lambda k: abs(float(y[k]) - told[k]))
        found[int(rows[best])] = told[best]
        rows, y = np.delete(rows, best), np.delete(y, best)
    return found


def turns_of(values: FloatArray) -> IntArray:
    """Find the rows in which the ball turns, the last of each way, whatever single readings do.

    Parameters
    ----------
    values : its place, or what goes with it, nan where there is no reading, (n_row,).

    Returns
    -------
    Rows in order; none of few readings, and of many, of which one does not matter.
    """
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    if not 3 * _BESIDE < y.size <= _SHORT:
        return _NO_TURN
    middle = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(y, 2, mode="edge"), 5), axis=1)
    step = float(np.max(np.abs(np.diff(middle))))
    least = _WAY * float(np.ptp(middle))
    turns, top, way = [], 0, 0
    for k in range(1, y.size):
        gone = float(middle[k] - middle[top])
        if way == 0:
            way = int(np.sign(gone)) if abs(gone) > least else 0
            top = k if way else top
        elif gone * way >= 0:
            top = k
        elif abs(gone) > least:
            near = np.arange(max(top - 3, 0), min(top + 3, y.size - 1) + 1)
            beyond = (y[near] - middle[top]) * way
            # One far beyond the middle of those beside it is no turn.
            near, beyond = near[beyond <= _A_TURN * step], beyond[beyond <= _A_TURN * step]
            turn = int(near[np.argmax(beyond)])
            # A hold is a way of its own.
            rests = np.abs(y - y[turn]) < _RESTS * step
            begin, end = (turn - int(np.argmin(rests[turn::-1])) + 1, turn + int(np.argmin(rests[turn:])) - 1)
            turns += [int(rows[begin]), int(rows[end])] if end - begin > 1 else [int(rows[turn])]
            top, way = k, -way
    return np.array(turns, dtype=np.int64)


def _way(rows: IntArray, k: int, turns: IntArray) -> tuple[int, int]:
    """The first reading of the way of the ball on which one stands, and the first behind it."""
    way = np.searchsorted(turns, rows, side="left")
    return int(np.searchsorted(way, way[k], side="left")), int(np.searchsorted(way, way[k], side="right"))


def _is_told(
    rows: IntArray, y: FloatArray, k: int, near: float, floor: float, turns: IntArray, others: Sequence[_Other]
) -> bool:
    """Whether a reading off its course is wrong, as other channels go on there, or keep to their course while it is far off."""
    off, span = abs(float(y[k]) - near), float(np.ptp(np.delete(y, k)))
    first, last = _way(rows, k, turns)
    # How many readings stand between it and the turns. Where it turns off the sample a touch may be as near.
    ends = [(k - first, first)] * (first > 0) + [(last - 1 - k, last - 1)] * (last < y.size)
    pressed = [abs(float(y[end] - y[0])) > span / 2 for _, end in ends]
    apart = min(
        (n if deep else n * _BEFORE_A_TURN // _BOTH_SIDES for (n, _), deep in zip(ends, pressed, strict=True)), default=y.size
    )
    # At an end the others are looked at where readings stand on both sides.
    inner = int(rows[min(max(k, 2), rows.size - 3)])
    slow = _is_slow(rows, y, k, turns)
    sure = apart >= (_BESIDE if slow else _BEFORE_A_TURN) and (1 < k < y.size - 2 or off > span)
    if sure and all(_straight(other, inner) for other in others):
        return True
    if off < _MATTERS * span or apart < _BEFORE_A_TURN or not 0 < k < y.size - 1 or slow:
        return False
    low, high = sorted((float(y[k - 1]), float(y[k + 1])))
    # Beside a turn or an end the course may bend, but it does not come back.
    both = min(k, y.size - 1 - k) >= _BOTH_SIDES and apart >= _BEFORE_A_TURN
    enough = both or max(low - float(y[k]), float(y[k]) - high) > floor
    # Between readings that are far apart lies more of a touch than a cubic follows.
    enough = enough and (off > _MORE_THAN_A_TOUCH * span or not any(other.is_finer for other in others))
    return enough and all(_keeps(other.values, int(rows[k]), turns) for other in others)


def _begins_a_hold(y: FloatArray, k: int, near: float) -> bool:
    """Whether a reading goes on along the line of those before it, and those behind rest: the ball stops, the force relaxes."""
    if not 1 < k < y.size - _AT_REST:
        return False
    room = _ON_LINE * abs(float(y[k]) - near)
    goes_on = abs(float(y[k] - 2 * y[k - 1] + y[k - 2])) < room < abs(float(y[k] - y[k - 1]))
    return goes_on and bool(np.ptp(y[k + 1 : k + 1 + _AT_REST]) < room)


def _is_slow(rows: IntArray, y: FloatArray, k: int, turns: IntArray) -> bool:
    """Whether readings beside one are written several times, as those of a slow meter are."""
    beside = _beside_on_way(rows, k, turns)
    return beside is not None and int(np.count_nonzero(np.diff(y[beside]) == 0)) > 1


def _keeps(values: FloatArray, row: int, turns: IntArray) -> bool:
    """Whether a channel keeps to its course in a row as well as the readings beside do."""
    rows = np.flatnonzero(np.isfinite(values))
    k = int(np.searchsorted(rows, row))
    if k >= rows.size or rows[k] != row or rows.size <= 3 * _BESIDE:
        return False
    y = values[rows]
    beside = _beside_on_way(rows, k, turns)
    if beside is None or _jumps_beside(y, k):
        return False
    near, sd, spread = _course_at(rows, y, k, beside)
    noise, digit = noise_of(y, 4), _digit(y)
    if _expected(rows, y, k, max(_CUBIC_NOISES * noise, _CUBIC_DIGITS * digit), turns) is not None:
        return False  # both show it, so that something has happened
    return abs(float(y[k]) - near) <= _KEEPS * max(sd, noise, digit) * spread


def _goes_with(values: FloatArray, other: FloatArray, row: int, near: float) -> bool:
    """Whether a reading is where another channel lets it be expected, as at a touch, or where a hand cranks unevenly.

    It is expected on the line over the other channel through the readings beside it, or through two on a side.
    """
    rows = np.flatnonzero(np.isfinite(values) & np.isfinite(other))
    k = int(np.searchsorted(rows, row))
    if k >= rows.size or rows[k] != row or rows.size <= 3 * _BESIDE or not 1 < k < rows.size - 2:
        return False
    y, w = values[rows], other[rows]
    off, noise, other_noise = abs(float(y[k]) - near), max(noise_of(y, 4), _digit(y)), max(noise_of(w, 4), _digit(w))
    for a, b in ((k - 1, k + 1), (k - 2, k - 1), (k + 1, k + 2)):
        moved = float(w[b] - w[a])
        if abs(moved) <= _MOVED * other_noise:
            continue
        slope = float(y[b] - y[a]) / moved
        beyond = 1.0 + abs(float(w[k] - w[a]) / moved)
        room = beyond * noise + abs(slope) * other_noise
        if abs(float(y[k] - y[a]) - slope * float(w[k] - w[a])) <= _GOES_WITH * room <= _SHARP * off:
            return True
    return False


def _jumps_beside(y: FloatArray, k: int) -> bool:
    """Whether a step to or from a reading is by far the largest near it, as at a snap, which other channels show, too."""
    steps = np.abs(np.diff(y[max(k - _BESIDE, 0) : k + _BESIDE + 1]))
    at = min(k, _BESIDE)
    own = steps[max(at - 1, 0) : at + 1]
    others = np.delete(steps, np.arange(max(at - 1, 0), min(at + 1, steps.size)))
    return bool(np.max(own) > _A_JUMP * max(float(np.max(others, initial=0.0)), noise_of(y, 4), _digit(y)))


def _beside_on_way(rows: IntArray, k: int, turns: IntArray) -> list[int] | None:
    """The readings next to one that are of the same way of the ball; None if they are too few to tell a course."""
    first, last = _way(rows, k, turns)
    low = max(min(max(k - _BESIDE, first), last - 2 * _BESIDE - 1), first)
    beside = [i for i in range(low, min(low + 2 * _BESIDE + 1, last)) if i != k]
    return beside if len(beside) >= _FEWEST_BESIDE else None


def _course_at(rows: IntArray, y: FloatArray, k: int, kept: Sequence[int]) -> tuple[float, float, float]:
    """What a cubic through readings lets expect of one, how far these are off it, and the spread of the difference."""
    weights, residual, spread = _cubic(tuple((rows[kept] - rows[k]).tolist()))
    left = residual @ y[kept]
    return float(weights @ y[kept]), math.sqrt(float(left @ left) / (len(kept) - 4)), spread


def _expected(rows: IntArray, y: FloatArray, k: int, floor: float, turns: IntArray) -> float | None:
    """What the cubic through those beside a reading lets expect, where these keep to it, but for one, and it does not."""
    beside = _beside_on_way(rows, k, turns)
    if beside is None:
        return None
    first, last = _way(rows, k, turns)
    # Beside a turn a step of the channel would be told, too, if one of the few behind it were left out.
    cut = (first > 0 and k - first < _BESIDE) or (last < y.size and last - 1 - k < _BESIDE)
    weights, residuals, degrees, spread = _cubics(tuple((rows[beside] - rows[k]).tolist()), k - beside[0], cut)
    if not weights.size:
        return None
    kept = y[beside]
    near = weights @ kept
    off, sd = np.abs(float(y[k]) - near), np.sqrt(np.sum((residuals @ kept) ** 2, axis=1) / degrees)
    for i in np.flatnonzero(off > _CUBIC_LOCAL * sd * spread).tolist():
        least = floor
        if (
            np.ptp(kept[residuals[i].any(axis=1)]) == 0
        ):  # where those beside it rest, a display shows less than its steps are elsewhere
            least = min(floor, max(_CUBIC_NOISES * noise_of(y, 4), _CUBIC_DIGITS * last_step(np.unique(y))))
        if off[i] > least * spread[i]:
            return float(near[i])
    return None


@lru_cache(maxsize=512)
def _cubics(places: tuple[int, ...], before: int, cut: bool) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Of cubics through readings about 0: through all; without one of each, if not `cut`; and without those farther off.

    `before` of them stand before the reading at 0. Per cubic, of those through enough readings, what `_cubic` has, (n, n_place)
    and (n, n_place, n_place), 0 for readings without part in it, its degrees of freedom, and the spread.
    """
    n = len(places)
    all_of = list(range(n))
    # Near an end of the record a corner among those farther off is none of its own.
    nearer = [i for i in all_of if before - _BESIDE <= i < before + _BESIDE]
    ways = [all_of, *([i for i in all_of if i != without] for without in all_of if not cut), nearer]
    ways = [kept for kept in ways if len(kept) >= _FEWEST_BESIDE]
    weights, residuals, spread = np.zeros((len(ways), n)), np.zeros((len(ways), n, n)), np.zeros(len(ways))
    for i, kept in enumerate(ways):
        weights[i, kept], residuals[i][np.ix_(kept, kept)], spread[i] = _cubic(tuple(places[k] for k in kept))
    return weights, residuals, np.array([len(kept) - 4.0 for kept in ways]), spread


@lru_cache(maxsize=512)
def _cubic(places: tuple[int, ...]) -> tuple[FloatArray, FloatArray, float]:
    """Of a cubic through readings at places about 0: the weights of its value there, what leaves their residuals, its spread.

    The spread is the sd of the difference to a reading at 0, in that of one reading.
    """
    powers = np.vander(np.array(places, dtype=np.float64) / _BESIDE, 4, increasing=True)
    inverse = np.linalg.pinv(powers)
    spread = math.sqrt(1.0 + float(inverse[0] @ inverse[0]))
    return inverse[0], np.eye(len(places)) - powers @ inverse, spread


def _beside(rows: IntArray, y: FloatArray, left: Sequence[int], floor: float) -> list[float]:
    """What those next to some readings let expect in their places, if these go on smoothly and they are far off; else none."""
    if left[0] < 2 or left[-1] > y.size - 3:
        return []
    around = np.arange(max(left[0] - _BESIDE, 0), min(left[-1] + _BESIDE + 1, y.size))
    kept = around[~np.isin(around, left)]
    slopes = np.diff(y[kept]) / np.diff(rows[kept])
    usual, bend = float(np.max(np.abs(slopes))), float(np.max(np.abs(np.diff(slopes))))
    near = np.interp(rows[list(left)], rows[kept], y[kept])
    off = float(np.min(np.abs(y[list(left)] - near)))
    return near.tolist() if off > max(_OFF_STEPS * usual, _OFF_BENDS * bend, floor) else []


def _comes_back(y: FloatArray, k: int, floor: float) -> bool:
    """Whether a reading is beyond both beside it by more than a floor and by several of the steps next to these."""
    low, high = sorted((float(y[k - 1]), float(y[k + 1])))
    beyond = max(low - float(y[k]), float(y[k]) - high)
    steps = np.abs(np.diff(y[max(k - _BESIDE, 0) : k])), np.abs(np.diff(y[k + 1 : k + _BESIDE + 1]))
    return beyond > max(_COMES_BACK * float(np.max(np.concatenate(steps))), floor)


def _goes_on(values: FloatArray, row: int) -> bool:
    """Whether a channel rises, or falls, over the two readings on either side of a row, each time by more than its noise."""
    rows = np.flatnonzero(np.isfinite(values))
    k = int(np.searchsorted(rows, row))
    if k >= rows.size or rows[k] != row or not 1 < k < rows.size - 2:
        return False
    y = values[rows]
    steps = np.diff(y[k - 2 : k + 3])
    return bool(
        np.min(np.abs(steps)) > max(_KEEPS * noise_of(y, 4), last_step(np.unique(y)))
        and abs(np.sum(np.sign(steps))) == steps.size
    )


def _straight(other: _Other, row: int) -> bool:
    """Whether a channel goes on, or rests, over a row: it neither turns nor jumps there."""
    values = other.values
    rows = np.flatnonzero(np.isfinite(values))
    k = int(np.searchsorted(rows, row))
    if k >= rows.size or rows[k] != row or not 1 < k < rows.size - 2:
        return False
    apart = np.diff(rows[k - 2 : k + 3])
    steps = np.diff(values[rows[k - 2 : k + 3]]) / apart
    noise = (8 * noise_of(other.whole) + last_step(other.whole)) / float(np.min(apart))
    return bool(np.ptp(steps) <= max(_STRAIGHT * float(np.max(np.abs(steps))), noise))


def _at_ends(values: FloatArray) -> dict[int, float]:
    """Readings at the ends of a record that are far beyond all others -> the first one that is not."""
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    found: dict[int, float] = {}
    if y.size < 2 * _BESIDE + _RUN:
        return found
    lengths = [(a, b) for a in range(_RUN + 1) for b in range(_RUN + 1) if a + b]
    # Of both ends only together: each alone would be held against the other.
    for first, last in sorted(lengths, key=lambda ends: (min(ends) > 0, sum(ends))):
        behind = y.size - last
        ends, rest = np.concatenate([y[:first], y[behind:]]), y[first:behind]
        low, high = float(np.min(rest)), float(np.max(rest))
        beyond = np.maximum(low - ends, ends - high)
        # Noise is looked for only where it could matter: of a million readings it takes its time.
        if np.all(beyond > _RANGES * (high - low)) and np.all(beyond > _NOISES * noise_of(rest)):
            found.update((int(r), float(rest[0])) for r in rows[:first])
            found.update((int(r), float(rest[-1])) for r in rows[behind:])
    return found


def noise_of(y: FloatArray, order: int = 2) -> float:
    """Scatter of readings about a smooth course, by their differences.

    Parameters
    ----------
    y : readings in order, (n_row,).
    order : of the differences, at least 1 and less than n_row; of few readings a bend is less of those of higher order.

    Returns
    -------
    Its standard deviation, in the unit of the readings.
    """
    differences = np.diff(y, order)
    differences = np.abs(differences[:: max(1, differences.size // _SAMPLE)])  # a sample tells it to 1 %
    if y.size <= _SAMPLE:
        differences = _but_still(differences, y)
    return 1.4826 * _median(differences) / math.sqrt(math.comb(2 * order, order))


def _median(values: FloatArray) -> float:
    """The median of values without nan, (n,), n > 0, as `numpy.median`, which takes several times as long for few values."""
    low, high = (values.size - 1) // 2, values.size // 2
    ordered = np.partition(values, (low, high))
    return 0.5 * float(ordered[low] + ordered[high])


def _but_still(differences: FloatArray, y: FloatArray) -> FloatArray:
    """Differences without those along the largest or the least reading, as at the end of a range, if all others scatter.

    Parameters
    ----------
    differences : of some order, (n_row - order,).
    y : readings in order, (n_row,).
    """
    nothing = _NOTHING * float(np.max(np.abs(y), initial=0.0))
    still = differences <= nothing
    if np.count_nonzero(still) < _STILL:
        return differences
    middle = (y.size - differences.size) // 2
    y = y[middle : middle + differences.size]
    still &= (y == np.max(y)) | (y == np.min(y))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8))).reshape(-1, 2)
    long = edges[edges[:, 1] - edges[:, 0] >= _STILL]
    in_long = np.zeros(differences.size + 1, dtype=np.int64)
    np.add.at(in_long, long[:, 0], 1)
    np.add.at(in_long, long[:, 1], -1)
    left = differences[np.cumsum(in_long[:-1]) == 0]
    scatters = left.size >= _FEWEST_BESIDE and np.count_nonzero(left <= nothing) <= _SHARE * left.size
    return left if scatters else differences


def last_step(y: FloatArray) -> float:
    """The least that two readings beside each other, (n_row,), differ by, if they do, in their unit."""
    steps = np.abs(np.diff(y))
    steps = steps[steps > 1e-9 * float(np.max(np.abs(y), initial=0.0))]
    return float(np.min(steps)) if steps.size else 0.0


def least_apart(y: FloatArray) -> float:
    """The least that any two readings of a channel, (n_row,), or of a sample of them, differ by, in their unit."""
    return last_step(np.unique(y[:: max(1, y.size // _SAMPLE)]))


def _digit(y: FloatArray) -> float:
    """The last digit of readings, (n_row,): the step of a display, else the power of ten of which all are whole multiples."""
    if np.count_nonzero(np.diff(y) == 0) > _REPEATED * y.size:
        return last_step(y)
    top = float(np.max(np.abs(y), initial=0.0))
    least = last_step(np.unique(y)) or np.inf
    for digits in range(1, 8):
        power = 10.0 ** (math.floor(math.log10(top)) - digits) if top > 0 else np.inf
        if power < _ABOUT * least and np.mean(np.abs(y / power - np.rint(y / power)) < _WHOLE) > 1 - _SHARE:
            return power
    return least if np.isfinite(least) else 0.0


def in_words(cell: str, near: float, unit: str = "") -> str:
    """Why a row is not used, for people.

    Parameters
    ----------
    cell : as it is written.
    near : what the readings beside it are near to, in the unit in which they are written.
    unit : that unit, "" for a number without one.

    >>> in_words(" 0.0000", 33.1243, "N")
    '"0.0000" stands alone: the readings beside it are near 33.12 N'
    """
    return f'"{cell.strip()[:40]}" stands alone: the readings beside it are near {near:.4g} {unit}'.rstrip()
