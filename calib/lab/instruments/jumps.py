"""From the readings of a record to the rows from which on one channel has another zero: an overflow, a tare, a meter's range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.spikes import last_step, noise_of
from models.sensor import BoolArray, FloatArray

CAPACITANCES = ("capacitance", "capacitance_series")
_JUDGED = ("displacement", "force", *CAPACITANCES)
# Readings on either side that are looked at.
_NEAR = 5
# A step is a jump if it is off from those beside it by so many times what these differ by, their size, noises, last digits.
_APART, _STEPS, _NOISES, _DIGITS = 5.0, 1.5, 12.0, 4.0
# Of the steps beside so many may be as large: another jump makes one.
_LARGER = 1
# Where a larger share of the steps jumps, that is what the record is like; fewer rows show nothing.
_SHARE, _FEWEST = 0.1, 12
# What a channel beside it may do: the same in its own steps, noises and digits.
_SEEN_STEPS, _SEEN_NOISES, _SEEN_DIGITS = 3.0, 4.0, 1.5
# A course moves if it is so many times as steep as its noise makes it, and would so change by such a share of its range.
_STEEP, _MOVES = 4.0, 0.05
# It goes on if it is so many times as steep behind the jump as before.
_ALIKE = 2.5
# A jump of the whole range, as of a counter; of both its sides beyond zero; to zero; as shares of the jump.
_WHOLE, _BEYOND, _TO_ZERO = 0.75, 0.1, 0.06
# What moved with the other channels by its share of the range would be seen in so many of their noises and digits.
_WOULD_SHOW = 5.0
# Steps of time that are a pause.
_PAUSE = 4.0
# A force that is so far, as a share of its range, from where it began is one of contact.
_IN_CONTACT = 0.2
# A capacitance that is back on its course within this share of the jump, and after such a share of the rows, was lost.
_BACK, _LOST = 0.2, 0.2


@dataclass(frozen=True)
class Jump:
    """A jump of one channel that nothing else in the record shows.

    Attributes
    ----------
    row, last : the first row behind it, and the last before.
    size : by how much, in the unit of the readings.
    sure : whether it cannot have happened; else it may have.
    why : what it may be, for people.
    back : the row from which on the channel is on its course again; 0 if it stays.
    """

    row: int
    last: int
    size: float
    sure: bool
    why: str
    back: int = 0


@dataclass(frozen=True, eq=False)
class _Course:
    """Readings of a channel in order, equal ones in succession once, with the rows in which each begins and ends."""

    y: FloatArray
    first: IntArray
    end: IntArray

    @cached_property
    def noise(self) -> float:
        """Scatter of a reading about a smooth course."""
        return noise_of(self.y)

    @cached_property
    def digit(self) -> float:
        """The least that two readings beside each other differ by."""
        return last_step(self.y)

    @cached_property
    def steps(self) -> FloatArray:
        """From each reading to the next, as large as they were if no row between had been left out."""
        rows = self.first[1:] - self.end[:-1]
        return np.asarray(np.diff(self.y) / np.maximum(rows / np.median(rows), 1.0))

    @cached_property
    def span(self) -> float:
        """Range of the readings."""
        return float(np.ptp(self.y))

    def slopes(self, i: int, others: IntArray) -> tuple[float, float, float]:
        """Steps per reading before the one from i to i + 1 and behind it, without other jumps, and what noise makes of them."""
        low = max([i - _NEAR, 0, *(others[others < i][-1:] + 1).tolist()])
        high = min([i + 1 + _NEAR, self.y.size - 1, *others[others > i][:1].tolist()])
        found = [(self.y[b] - self.y[a]) / (b - a) if b > a else np.nan for a, b in ((low, i), (i + 1, high))]
        few = min((b - a for a, b in ((low, i), (i + 1, high)) if b > a), default=1)
        return float(found[0]), float(found[1]), (1.5 * self.noise + self.digit) / few

    def moves(self, i: int, others: IntArray) -> str:
        """What the readings do on both sides of a step: "on" as before, "rests", or "other"; "" if too few tell."""
        before, after, error = self.slopes(i, others)
        if np.isnan(before) or np.isnan(after):
            return ""
        least = max(_STEEP * error, _MOVES * self.span / self.y.size)
        if max(abs(before), abs(after)) <= least:
            return "rests"
        small, large = sorted((abs(before), abs(after)))
        on = before * after > 0 and large <= _ALIKE * small + error
        return "on" if on else "other"


def _course(values: FloatArray) -> _Course | None:
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < _FEWEST:
        return None
    y = values[rows]
    new = np.concatenate([[True], y[1:] != y[:-1]])
    if 2 * np.count_nonzero(new) > y.size:
        return _Course(y, rows, rows)
    # What a slow meter's logger wrote several times is one reading.
    begin = np.flatnonzero(new)
    return _Course(y[begin], rows[begin], rows[np.append(begin[1:], y.size) - 1]) if begin.size >= _FEWEST else None


def _steps_apart(steps: FloatArray, span: float, apart: float, size: float, floor: float) -> IntArray:
    """Places of steps that are unlike those beside them."""
    large = np.abs(steps)
    small = np.full(steps.size + 2, np.inf)
    small[1:-1] = large
    found = np.flatnonzero((large > floor) & (large > size * np.minimum(small[:-2], small[2:])))
    if not found.size:
        return found
    beside = found[:, None] + np.array([k for k in range(-_NEAR, _NEAR + 1) if k])
    there = (beside >= 0) & (beside < steps.size)
    near = np.where(there, steps[np.clip(beside, 0, steps.size - 1)], np.nan)
    # A counter goes to and fro where it overflows.
    near[np.abs(near) >= _WHOLE * span] = np.nan
    with np.errstate(invalid="ignore"):
        enough = np.count_nonzero(np.isfinite(near), axis=1) >= 3
    found, near = found[enough], near[enough]
    middle = np.nanmedian(near, axis=1) if found.size else np.zeros(0)
    off = np.abs(steps[found] - middle)
    spread = np.sort(np.abs(near - middle[:, None]), axis=1)  # nan last
    counts = np.count_nonzero(np.isfinite(near), axis=1)
    spread = spread[np.arange(found.size), np.maximum(counts - 1 - _LARGER, 0)] if found.size else middle
    return found[(off > apart * spread) & (off > size * np.abs(middle)) & (off > floor)]


def jumps_of(values: Mapping[str, FloatArray]) -> dict[str, list[Jump]]:
    """Find the jumps of a channel from one reading to the next that no other channel of the record shows.

    A load that jumps while the ball goes on as before, a place that jumps while the load goes on, and a capacitance that jumps
    while both go on have not happened: a counter has overflowed, a zero was set anew, or a range or an offset has changed. What
    may have happened, too (a load that slips to a part of it, a touch, a record over time alone), is told apart.

    Parameters
    ----------
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).

    Returns
    -------
    Quantity -> its jumps in order; only those that have any.
    """
    courses = {q: c for q in (*_JUDGED, "time") if q in values and (c := _course(values[q])) is not None}
    found: dict[str, list[Jump]] = {}
    for quantity, course in courses.items():
        if quantity == "time":
            continue
        floor = max(_NOISES * course.noise, _DIGITS * course.digit)
        at = _steps_apart(course.steps, course.span, _APART, _STEPS, floor)
        if not at.size or at.size > max(2, _SHARE * course.y.size):
            continue
        others = {q: c for q, c in courses.items() if q not in (quantity, "time") and not {q, quantity} <= set(CAPACITANCES)}
        seen = _shared(course, at, others)
        alone, rest = at[~seen], at
        paused = _shared(course, alone, {q: c for q, c in courses.items() if q == "time"}, share=_PAUSE)
        jumps = []
        for i, pause in zip(alone.tolist(), paused.tolist(), strict=True):
            judged = _JUDGES[quantity](course, i, rest, {q: _resampled(values[q], course) for q in others}, pause)
            if judged is not None:
                size = float(course.y[i + 1] - course.y[i])
                jumps.append(Jump(int(course.first[i + 1]), int(course.end[i]), size, *judged))
        if quantity in CAPACITANCES:
            jumps = _with_returns(jumps, course)
        if jumps:
            found[quantity] = jumps
    return found


def _shared(course: _Course, at: IntArray, others: Mapping[str, _Course], share: float = _SEEN_STEPS) -> BoolArray:
    """Whether a channel beside jumps where a course does, by its own readings or by its change from reading to reading."""
    seen = np.zeros(at.size, dtype=bool)
    for other in others.values():
        floor = max(_SEEN_NOISES * other.noise, _SEEN_DIGITS * other.digit)
        own = _steps_apart(other.steps, other.span, share, share, floor)
        begins, ends = other.end[own], other.first[own + 1]
        # The clocks of two instruments may differ by a row.
        low, high = course.first[at] - 1, course.first[at + 1] + 1
        seen |= np.searchsorted(ends, low, side="left") < np.searchsorted(begins, high, side="right")
        if course.y.size < 0.9 * other.y.size:
            resampled = _Course(np.interp(course.first, other.first, other.y), course.first, course.end)
            seen |= np.isin(at, _steps_apart(resampled.steps, other.span, share, share, floor))
    return seen


def _resampled(values: FloatArray, course: _Course) -> _Course:
    """Another channel at the readings of a course."""
    rows = np.flatnonzero(np.isfinite(values))
    return _Course(np.interp(course.first, rows, values[rows]), course.first, course.end)


_Judged = tuple[bool, str]
_ZERO = "a counter that overflowed, or a zero that was set anew"


def _of_force(course: _Course, i: int, at: IntArray, others: Mapping[str, _Course], pause: bool) -> _Judged | None:
    """Judge a jump of the force: sure if it goes on behind it as before, though the ball goes on, too, or rests."""
    before, after = float(course.y[i]), float(course.y[i + 1])
    jump = after - before
    none = np.zeros(0, dtype=np.int64)
    does = course.moves(i, at)
    slope = np.nanmax(np.abs(course.slopes(i, at)[:2])) if does else 0.0
    whole = abs(jump) >= _WHOLE * course.span
    opposite = before * after < 0 and min(abs(before), abs(after)) > _BEYOND * abs(jump)
    zero = abs(after) <= _TO_ZERO * abs(jump) + 3 * course.noise + 2 * slope and abs(before) > 0.5 * abs(jump)
    up = before * after > 0 and abs(after) > abs(before)
    witness = others.get("displacement") or next((others[q] for q in CAPACITANCES if q in others), None)
    if witness is None or witness.span <= _WOULD_SHOW * (witness.noise + witness.digit):
        if does != "on" or pause or not whole:
            return None
        if opposite and min(abs(before), abs(after)) > 0.25 * abs(jump):
            return True, _ZERO
        return (False, f"a fast retreat, {_ZERO}") if zero else None
    ball = witness.moves(i, none)
    would_show = abs(jump) / course.span * witness.span > _WOULD_SHOW * (witness.noise + witness.digit)
    if opposite and whole and min(abs(before), abs(after)) > 0.25 * abs(jump) and would_show:
        return not pause, _ZERO
    if does == "on" and ball in ("on", "other"):
        if zero or opposite or up:
            return not pause, _ZERO
        return False, "a slip, or another zero of the load cell"
    if does == "rests" and ball == "rests":
        if (zero or opposite or up) and would_show:
            return not pause, _ZERO
        return False, "a slip, or another zero of the load cell"
    if does == "rests" and ball == "on":
        return False, "another zero of the load cell, out of contact"
    return None


def _of_displacement(course: _Course, i: int, at: IntArray, others: Mapping[str, _Course], pause: bool) -> _Judged | None:
    """Judge a jump of the displacement: sure if a load or a capacitance of contact goes on over it as before."""
    none = np.zeros(0, dtype=np.int64)
    witness = others.get("force") or next((others[q] for q in CAPACITANCES if q in others), None)
    if witness is None or witness.span <= _WOULD_SHOW * (witness.noise + witness.digit):
        return None
    jump = abs(float(course.y[i + 1] - course.y[i]))
    least = _WOULD_SHOW * (witness.noise + witness.digit)
    own, load = course.moves(i, at), witness.moves(i, none)
    steep, moved = (np.abs(np.array(c.slopes(i, o)[:2])) for c, o in ((witness, none), (course, at)))
    if load == "on" and own == "on":
        per_step = float(np.max(moved))
        shown = jump / per_step * float(np.min(steep)) if per_step > 0 else 0.0
        step = abs(float(witness.y[i + 1] - witness.y[i]))
        if shown > least and shown > 3 * step:
            return not pause, _ZERO
    away = abs(float(witness.y[i] - np.median(witness.y[:_NEAR])))
    if load == "rests" and own == "rests" and away > _IN_CONTACT * witness.span and jump / course.span * witness.span > least:
        return not pause, _ZERO
    return None


def _of_capacitance(course: _Course, i: int, at: IntArray, others: Mapping[str, _Course], pause: bool) -> _Judged | None:
    """Judge a jump of the capacitance: sure if load and ball go on over it, and are no touch."""
    none = np.zeros(0, dtype=np.int64)
    jump = abs(float(course.y[i + 1] - course.y[i]))
    does = course.moves(i, at)
    why = "a meter's range or offset that changed, or a counter that overflowed"
    doubt = f"something that no other column shows, or {why}"
    force, ball = others.get("force"), others.get("displacement")
    rest = course.span - jump if course.span > 1.5 * jump else course.span
    if force is not None and force.span > _WOULD_SHOW * (force.noise + force.digit):
        touch = force.moves(i, none) == "other"
        would_show = jump / max(rest, jump / 10) * force.span > _WOULD_SHOW * (force.noise + force.digit)
        return (True, why) if would_show and not touch and not pause else (False, doubt)
    if ball is not None and ball.span > _WOULD_SHOW * (ball.noise + ball.digit):
        goes = ball.moves(i, none)
        sure = does == "on" or (does == "rests" and goes in ("on", "rests"))
        return sure and not pause, why if sure else doubt
    if pause or not does:
        return None
    return (True, why) if does == "on" else (False, doubt)


def _with_returns(jumps: list[Jump], course: _Course) -> list[Jump]:
    """Jumps of a capacitance, of which two that undo each other are one that comes back."""
    found: list[Jump] = []
    for jump in jumps:
        last = found[-1] if found else None
        if last is not None and not last.back and last.sure and jump.sure and abs(jump.size + last.size) < _BACK * abs(last.size):
            rows = int(np.count_nonzero((course.first >= last.row) & (course.first < jump.row)))
            if rows <= _LOST * course.y.size:
                found[-1] = Jump(last.row, last.last, last.size, True, "a lead that was lost", jump.row)
                continue
        found.append(jump)
    return found


_JUDGES = {
    "force": _of_force,
    "displacement": _of_displacement,
    **dict.fromkeys(CAPACITANCES, _of_capacitance),
}
