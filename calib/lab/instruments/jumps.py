"""From the readings of a record to the rows from which on one channel has another zero: an overflow, a tare, a new range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from calib.lab.instruments.explained import Beside
from calib.lab.instruments.explained import beside as held_beside
from calib.lab.instruments.followed import followed
from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.spikes import last_step, noise_of, turns_of
from calib.lab.instruments.times_noise import times_noise
from models.sensor import BoolArray, FloatArray

CAPACITANCES = ("capacitance", "capacitance_series")
_JUDGED = ("displacement", "force", *CAPACITANCES)
# Readings on either side that are looked at.
_NEAR = 5
# A step is a jump if it is off from those beside it by so many times what these differ by, their size, noises, last digits.
_APART, _STEPS, _NOISES, _DIGITS = 5.0, 1.5, 12.0, 4.0
# Of the steps beside so many may be as large: another jump makes one.
_LARGER = 1
# So few steps on a side must lie on a line with those on the other, near a touch or a turn; one shows the largest jumps only.
_FEW_BESIDE, _OF_ONE = (3, 2, 1), 0.5
# So many times as far off as steps differ from the next, bends aside, as a median, is more than noise.
_BENDS = 7.0
# Noise may also grow with the reading: steps of fewer times the scatter of readings as large are noise, or may be.
_MAY_BE_NOISE, _IS_MORE = 4.5, 8.0
# Steps of less than this share of what makes a jump are none.
_STILL = 0.25
# Readings that show what they are written in; numbers that differ by a smaller share are the same.
_SAMPLE, _SAME_NUMBER = 10_000, 1e-9
# Readings on a side whose slope is taken, as few as show one.
_FOR_SLOPE = (1, 2, 3, _NEAR)
# Where a larger share of the steps jumps, that is what the record is like; so many are looked at; fewer rows show nothing.
_SHARE, _MOST, _FEWEST = 0.1, 200, 12
# A step of a load is large that is such a share of its range and so many times the median step.
_OF_RANGE, _MEDIANS = 0.05, 2.5
# What a channel beside it may do: the same in its own steps, noises and digits.
_SEEN_STEPS, _SEEN_NOISES, _SEEN_DIGITS = 3.0, 4.0, 1.5
# A course moves if it is so many times as steep as its noise makes it, and would so change by such a share of its range.
_STEEP, _MOVES = 4.0, 0.05
# It goes on if it is so many times as steep behind the jump as before.
_ALIKE = 2.5
# A jump of the whole range, as of a counter; to both sides of zero; beyond zero; to zero; as shares of the jump; and of a step.
_WHOLE, _BOTH, _BEYOND, _TO_ZERO, _A_STEP = 0.75, 0.25, 0.1, 0.06, 1.2
# A load that goes on in contact is so steep, in the steps of the press; a drift is not.
_IN_PRESS = 0.25
# A step is one of several if one beside it is such a share of it.
_AS_FAR = 0.75
# A ball rests that moves by so little of its usual steps.
_RESTS = 0.2
# Jumps of one counter differ by less than this share; so many of different sizes may be zeros that were set anew.
_SAME, _FEW = 0.05, 3
# A jump by a factor is such a share of the range at least; slopes change by so many of its own powers at most.
_OF_SCALE, _AS_STEEP = 0.02, 3.0
# What moved with the other channels by its share of the range would be seen in so many of their noises and digits.
_WOULD_SHOW = 5.0
# A load shows nothing of a jump if it is off its course by less than this share of what it would show.
_UNSEEN = 0.1
# A jump that another channel shows is at most so many times what the slope beside makes of it.
_IN_PROPORTION = 2.0
# Over a pause a load may come back to a part more, but not to so many times itself.
_OVER_A_PAUSE = 1.5
# Steps of time that are a pause.
_PAUSE = 4.0
# A force that is so far, as a share of its range, from where it began is one of contact.
_IN_CONTACT = 0.2
# One that is not farther than that may be one of a touch.
_AT_TOUCH = 0.03
# A capacitance that is back on its course within this share of the jump, and after such a share of the rows, was lost.
_BACK, _LOST = 0.2, 0.2


#: A counter that overflowed or a range that changed; a zero that was set anew; what may also have happened; another scale.
OVERFLOW, ZERO, OPEN, SCALED = "overflow", "zero", "open", "scaled"

# What is said of one that is no larger than noise may be.
_OR_NOISE = "noise that grows with the reading, or another zero"
#: What is said of a jump that none of the columns that are read shows.
UNSHOWN = "something that no other column shows"


@dataclass(frozen=True)
class Jump:
    """A jump of one channel that nothing else in the record shows.

    Attributes
    ----------
    row, last : the first row behind it, and the last before.
    size : by how much, in the unit of the readings.
    kind : OVERFLOW, ZERO or SCALED, if it cannot have happened; else OPEN.
    why : what would show so, in words behind "as by".
    back : the row from which on the channel is on its course again; 0 if it stays.
    factor : by which the readings are multiplied from there on, if SCALED; else 1.
    """

    row: int
    last: int
    size: float
    kind: str
    why: str
    back: int = 0
    factor: float = 1.0


@dataclass(frozen=True, eq=False)
class _Course:
    """Readings of a channel in order, equal ones in succession once, with the rows in which each begins and ends."""

    y: FloatArray
    first: IntArray
    end: IntArray
    driven: bool = False

    @cached_property
    def noise(self) -> float:
        """Scatter of a reading about a smooth course."""
        return min(noise_of(self.y), noise_of(self.y, 3))

    @cached_property
    def digit(self) -> float:
        """The least that two readings beside each other differ by; of what a motor drives, also that two steps differ by."""
        if not self.driven:
            return last_step(self.y)
        bends = np.abs(np.diff(self.y, 2)[:: max(1, self.y.size // _SAMPLE)])
        bends = bends[bends > _SAME_NUMBER * float(np.max(np.abs(self.y)))]
        return min(last_step(self.y), float(np.median(bends))) if bends.size else last_step(self.y)

    @cached_property
    def steps(self) -> FloatArray:
        """From each reading to the next, as large as they were if no row between had been left out."""
        rows = self.first[1:] - self.end[:-1]
        return np.asarray(np.diff(self.y) / np.maximum(rows / np.median(rows), 1.0))

    @cached_property
    def span(self) -> float:
        """Range of the readings."""
        return float(np.ptp(self.y))

    @cached_property
    def usual(self) -> float:
        """A step of the steeper part of the record, from a few readings to the next few."""
        few = min(_NEAR, self.y.size - 1)
        return float(np.quantile(np.abs(self.y[few:] - self.y[:-few]), 0.9)) / few

    def rests(self, i: int, *, besides: bool = False) -> bool:
        """Whether the readings around a step stand still; `besides` the step itself."""
        low, high = max(i - _NEAR, 0), min(i + 1 + _NEAR, self.y.size - 1)
        change = float(self.y[high] - self.y[low]) - (float(self.y[i + 1] - self.y[i]) if besides else 0.0)
        steps = np.abs(self.steps)
        return abs(change) <= max(_RESTS * (high - low) * float(np.median(steps)), 3 * self.noise, self.digit)

    def is_one_of_several(self, i: int) -> bool:
        """Whether a step beside one goes the same way, nearly as far: on a slope, such as that of a sticky sample's neck."""
        beside = self.steps[[k for k in (i - 1, i + 1) if 0 <= k < self.steps.size]]
        return bool(np.any(beside * np.sign(self.steps[i]) > _AS_FAR * abs(self.steps[i])))

    def off(self, at: IntArray) -> FloatArray:
        """How far steps are from the middle of those beside them, of the shape of `at`."""
        beside = at[..., None] + np.arange(-_NEAR, _NEAR + 1)
        inside = (beside >= 0) & (beside < self.steps.size)
        middle = _middle(np.where(inside, self.steps[np.clip(beside, 0, self.steps.size - 1)], np.nan))
        return np.asarray(np.abs(self.steps[at] - middle), dtype=float)

    def slopes(self, i: int, others: IntArray) -> tuple[float, float, float]:
        """Steps per reading before the one from i to i + 1 and behind it, without other jumps, and what noise makes of them."""
        first = max([0, *(others[others < i][-1:] + 1).tolist()])
        last = min([self.y.size - 1, *others[others > i][:1].tolist()])
        before, after, error = np.nan, np.nan, np.inf
        for near in _FOR_SLOPE:
            ends = ((max(i - near, first), i), (i + 1, min(i + 1 + near, last)))
            before, after = (float(self.y[b] - self.y[a]) / (b - a) if b > a else np.nan for a, b in ends)
            error = (1.5 * self.noise + self.digit) / min((b - a for a, b in ends if b > a), default=1)
            # Farther away a touch or a turn may bend the course.
            if min(abs(before), abs(after)) > _STEEP * error:
                break
        return before, after, error

    def begins(self, i: int, others: IntArray) -> bool:
        """Whether the readings stand still before a step, or move less than behind it, as at a touch."""
        before, after, error = self.slopes(i, others)
        still = abs(before) <= max(_STEEP * error, _RESTS * abs(after))
        return abs(before) < abs(after) and (still or before * after > 0)

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


def _course(values: FloatArray, *, driven: bool = False) -> _Course | None:
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < _FEWEST:
        return None
    y = values[rows]
    new = np.concatenate([[True], y[1:] != y[:-1]])
    if 2 * np.count_nonzero(new) > y.size:
        return _Course(y, rows, rows, driven)
    # What a slow meter's logger wrote several times is one reading.
    begin = np.flatnonzero(new)
    end = rows[np.append(begin[1:], y.size) - 1]
    return _Course(y[begin], rows[begin], end, driven) if begin.size >= _FEWEST else None


def _middle(values: FloatArray) -> FloatArray:
    """The median along the last axis of what is no nan, as `numpy.nanmedian`, which takes many times as long for few values."""
    values = np.sort(values, axis=-1)  # nan last
    n = np.count_nonzero(~np.isnan(values), axis=-1)[..., None]
    low, high = (np.take_along_axis(values, np.maximum(k, 0), axis=-1)[..., 0] for k in ((n - 1) // 2, n // 2))
    return np.asarray(0.5 * (low + high), dtype=float)


def _steps_apart(steps: FloatArray, span: float, apart: float, size: float, floor: float, *, touch: bool = False) -> IntArray:
    """Places of steps that are unlike those beside them; `touch` if one side may rest while the other moves."""
    change = np.full(steps.size + 1, np.inf)
    change[1:-1] = np.abs(np.diff(steps))
    least = np.minimum(change[:-1], change[1:])
    small = np.full(steps.size + 2, np.inf)
    small[1:-1] = np.abs(steps)
    beside_it = size * np.minimum(small[:-2], small[2:])
    found = np.flatnonzero((least > floor / 2) & (least > beside_it))
    if not found.size:
        return found
    bent = _off_a_line(steps, found, span, apart, size, floor, touch=touch)
    beside = found[:, None] + np.array([k for k in range(-_NEAR, _NEAR + 1) if k])
    there = (beside >= 0) & (beside < steps.size)
    near = np.where(there, steps[np.clip(beside, 0, steps.size - 1)], np.nan)
    # A counter goes to and fro where it overflows.
    near[np.abs(near) >= _WHOLE * span] = np.nan
    with np.errstate(invalid="ignore"):
        enough = np.count_nonzero(np.isfinite(near), axis=1) >= 3
    # By the steps of ten, only what is large itself.
    enough &= (small[1 + found] > beside_it[found]) & (small[1 + found] + beside_it[found] / size > floor)
    at, found, near = found, found[enough], near[enough]
    middle = _middle(near)
    off = np.abs(steps[found] - middle)
    spread = np.sort(np.abs(near - middle[:, None]), axis=1)  # nan last
    counts = np.count_nonzero(np.isfinite(near), axis=1)
    spread = spread[np.arange(found.size), np.maximum(counts - 1 - _LARGER, 0)] if found.size else middle
    apart_from = (off > apart * spread) & (off > size * np.abs(middle)) & (off > floor)
    return np.union1d(found[apart_from], at[bent]).astype(np.int64)


def _off_a_line(
    steps: FloatArray, at: IntArray, span: float, apart: float, size: float, floor: float, *, touch: bool
) -> BoolArray:
    """Which steps are off a line through the few beside them by far more than these are, as near a touch or a turn."""
    found = np.zeros(at.size, dtype=bool)
    # From step to step farther out there is no more than noise, bends and a turn.
    bends = np.diff(steps, append=np.nan, prepend=np.nan)
    around = at[:, None] + np.array([k for k in range(1 - _NEAR, _NEAR + 1) if k not in (0, 1)])
    inside = (around > 0) & (around < steps.size)
    bent = np.where(inside, bends[np.clip(around, 1, steps.size - 1)], np.nan)
    usual = _middle(np.abs(bent - _middle(bent)[:, None]))
    for few in _FEW_BESIDE:
        places = np.array([k for k in range(-few, few + 1) if k])
        inside = (at >= few) & (at < steps.size - few)
        near = steps[np.clip(at[:, None] + places, 0, steps.size - 1)]
        middle = np.mean(near, axis=1)
        slope = near @ places / float(places @ places)
        spread = np.max(np.abs(near - middle[:, None] - slope[:, None] * places), axis=1) if few > 1 else np.abs(slope)
        off = np.abs(steps[at] - middle)
        # Beside those that go one way one that goes the other is odd, however small they are.
        odd = (off > size * np.abs(middle)) | (steps[at] * middle < 0)
        there = inside & odd & (off > np.maximum(apart * spread, _BENDS * usual)) & (off > floor)
        left, right = np.mean(near[:, :few], axis=1), np.mean(near[:, few:], axis=1)
        # At a turn a press may jump by itself.
        moving = (np.minimum if touch else np.maximum)(np.abs(left), np.abs(right))
        same_way = (left * right > 0) | (moving < _STILL * floor)
        found |= there & (np.abs(steps[at]) > _OF_ONE * span) if few == 1 else there & same_way
    return found


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
    courses = {
        q: c for q in (*_JUDGED, "time") if q in values and (c := _course(values[q], driven=q == "displacement")) is not None
    }
    found: dict[str, list[Jump]] = {}
    for quantity, course in courses.items():
        if quantity == "time":
            continue
        floor = max(_NOISES * course.noise, _DIGITS * course.digit)
        at = _steps_apart(course.steps, course.span, _APART, _STEPS, floor, touch=quantity == "force")
        others = {q: c for q, c in courses.items() if q not in (quantity, "time") and not {q, quantity} <= set(CAPACITANCES)}
        beside = {q: _resampled(values[q], course) for q in others}
        readings = {q: c.y for q, c in beside.items()}
        if quantity == "force":
            at = np.union1d(at, _large(course, floor))
        most = max(_MOST if quantity == "force" else 2, _SHARE * course.y.size)
        # Of a load those count that the ball does not make.
        if not at.size or at.size > most:
            continue
        turns = np.searchsorted(course.first, turns_of(values[next(iter(others))])) if others else _NONE
        times = times_noise(course.y, at, course.off(at), turns)
        seen = np.zeros(at.size, dtype=bool)
        for q, other in others.items():
            held = held_beside(course.y, beside[q].y, at, course.noise, other.noise)
            shared = _shared(course, at, {q: other}) & ~_too_large(quantity, course, at, beside)
            if quantity in CAPACITANCES:
                seen |= shared | held.explained
            else:
                seen |= (shared & ~_out_of_proportion(course, beside[q], at, held, other.noise)) | held.explained
        if quantity == "force" and "displacement" in others:
            seen &= ~_set_to_zero(course, at, beside["displacement"].y, others["displacement"].noise)
        few, rest, own = max(2, _SHARE * course.y.size), at[times > _IS_MORE], at[~seen]
        alone, looked_at = (at[~seen & (times > least)] for least in (_IS_MORE, _MAY_BE_NOISE))
        if alone.size > few:
            continue
        # What may be noise is told, and no row is left out for it.
        looked_at = looked_at if looked_at.size <= few else alone
        paused = _shared(course, looked_at, {q: c for q, c in courses.items() if q == "time"}, share=_PAUSE)
        jumps = []
        witnesses = {q: _resampled(values[q], course, driven=other.driven) for q, other in others.items()}
        for i, pause in zip(looked_at.tolist(), paused.tolist(), strict=True):
            sure = i in alone
            judged = _JUDGES[quantity](course, i, rest if sure else at, witnesses, pause)
            factor = 1.0
            if quantity not in CAPACITANCES:
                judged, factor = _or_scaled(judged, quantity, course, i, own, readings, pause)
            if judged is not None and not sure:
                judged, factor = (OPEN, _OR_NOISE), 1.0
            if judged is not None:
                size = float(course.y[i + 1] - course.y[i])
                jumps.append(Jump(int(course.first[i + 1]), int(course.end[i]), size, *judged, factor=factor))
        jumps = _with_returns(jumps, course) if quantity in CAPACITANCES else _as_one(jumps)
        if jumps:
            found[quantity] = jumps
    return found


def _large(course: _Course, floor: float) -> IntArray:
    """Places of the steps of a load that are large by themselves, among others as large, as of a ball that is cranked."""
    least = max(floor, _OF_RANGE * course.span, _MEDIANS * float(np.median(np.abs(course.steps))))
    return np.flatnonzero(np.abs(course.steps) > least)


def _shared(course: _Course, at: IntArray, others: Mapping[str, _Course], share: float = _SEEN_STEPS) -> BoolArray:
    """Whether a channel beside jumps where a course does, by its own readings or by its change from reading to reading."""
    seen = np.zeros(at.size, dtype=bool)
    if not at.size:
        return seen
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


def _out_of_proportion(course: _Course, other: _Course, at: IntArray, held: Beside, noise: float) -> BoolArray:
    """Whether jumps in contact are far more than the slope beside them makes of what another channel does there.

    What is far smaller may have come with the fault, as where a lead was touched, but does not make it. A touch, a snap and a
    pull-off, in which a load may jump by more, begin at none.
    """
    rest = float(np.median(course.y[: max(1, min(_NEAR, course.y.size // 10))]))
    steps, slope = course.steps[at], np.fmax(np.abs(held.before), np.abs(held.behind))
    before, after = course.y[at] - rest, course.y[at + 1] - rest
    same_side = before * after > 0
    pressed = np.abs(before) > _IN_CONTACT * course.span
    pressed |= same_side & (np.abs(before) > _AT_TOUCH * course.span) & (np.abs(after) > _IN_CONTACT * course.span)
    # The clocks of two instruments may differ by a row.
    near = np.clip(at[:, None] + np.arange(-1, 2), 0, other.steps.size - 1)
    moved = np.max(other.off(near), axis=1) + _SEEN_NOISES * noise
    with np.errstate(invalid="ignore"):
        found = np.abs(steps) > _IN_PROPORTION * slope * moved + _SEEN_NOISES * course.noise
        usual = np.nan_to_num(np.sign(held.before + held.behind))
    # Where it goes on the same side of rest, another channel that goes the other way does not make it either.
    ways = other.steps[near[np.arange(at.size), np.argmax(other.off(near), axis=1)]] * usual * steps
    return np.asarray(pressed & (found | (same_side & (ways < 0))), dtype=bool)


def _too_large(quantity: str, course: _Course, at: IntArray, others: Mapping[str, _Course]) -> BoolArray:
    """Whether a jump is far larger than one that another channel shows would make it, such as that of a turn beside it."""
    steps = course.steps[at]
    found = np.zeros(at.size, dtype=bool)
    if quantity in CAPACITANCES and "force" in others:
        # A capacitance that jumps by more than all that the press makes of it would need a load that does.
        rest = _of_press(course, at, steps)
        shown = _near_off(others["force"], at)
        found = (np.abs(steps) > rest) & (shown < _UNSEEN * np.abs(steps) / rest * others["force"].span)
    elif quantity == "force":
        before, after = course.y[at], course.y[at + 1]
        whole = (np.abs(steps) > _WHOLE * course.span) & (before * after < 0)
        whole &= np.minimum(np.abs(before), np.abs(after)) > _BOTH * np.abs(steps)
        for q in set(CAPACITANCES) & set(others) if np.any(whole) else ():
            found |= whole & (_near_off(others[q], at) < _OF_ONE * others[q].span)
    return found


def _of_press(course: _Course, at: IntArray, steps: FloatArray | float) -> FloatArray:
    """What a press makes of a channel: its range between jumps, and not less than a tenth of these."""
    return np.maximum(max(float(np.ptp(part)) for part in np.split(course.y, at + 1)), np.abs(steps) / 10)


def _near_off(course: _Course, at: IntArray) -> FloatArray:
    """How far steps, or those within two readings of them, are off from those beside them, (at.size,)."""
    near = np.clip(at[:, None] + np.arange(-2, 3), 0, course.steps.size - 1)
    return np.asarray(np.max(course.off(near), axis=1), dtype=float)


def _resampled(values: FloatArray, course: _Course, *, driven: bool = False) -> _Course:
    """Another channel at the readings of a course."""
    rows = np.flatnonzero(np.isfinite(values))
    return _Course(np.interp(course.first, rows, values[rows]), course.first, course.end, driven)


_Judged = tuple[str, str]
_ANEW = "a zero that was set anew there"
# A ball that comes off a sticky sample at once leaves the load at zero as well.
_OFF = f"{_ANEW}, or a ball that came off the sample"
_COUNTER = "a counter that overflowed"
_SLIP = "a slip, a pull-off, or another zero of the load cell"
_METER = "a meter's range or offset that changed, or a counter that overflowed"
_RANGE, _SIGN = "a range, a unit or a gain that changed", "a sign that changed"
_NONE = np.zeros(0, dtype=np.int64)


def _is_seen(course: _Course | None) -> bool:
    return course is not None and course.span > _WOULD_SHOW * (course.noise + course.digit)


def _witness(others: Mapping[str, _Course], quantity: str) -> _Course | None:
    """The channel that would show what a quantity does: it, or else the capacitance."""
    found = others.get(quantity) or next((others[q] for q in CAPACITANCES if q in others), None)
    return found if _is_seen(found) else None


def _of_force(course: _Course, i: int, at: IntArray, others: Mapping[str, _Course], pause: bool) -> _Judged | None:
    """Judge a jump of the force: it has not happened if it goes on as before while the ball goes on, or rests, as before."""
    before, after = float(course.y[i]), float(course.y[i + 1])
    jump, does = after - before, course.moves(i, at)
    whole = abs(jump) >= _WHOLE * course.span
    both = before * after < 0 and min(abs(before), abs(after)) > _BOTH * abs(jump)
    ahead, behind, _ = course.slopes(i, at)
    steep = max(abs(ahead), abs(behind)) if does else 0.0
    # It was set to zero within the step, in which the load went on.
    near_zero = _TO_ZERO * abs(jump) + 3 * course.noise + (_A_STEP * abs(behind) if does else 0.0)
    zero = abs(after) <= near_zero and abs(before) > 0.5 * abs(jump)
    ball = others.get("displacement")
    if ball is not None and _set_to_zero(course, at, ball.y, ball.noise)[np.searchsorted(at, i)]:
        return (OPEN, _SLIP) if pause else (ZERO, _OFF)
    witness = _witness(others, "displacement")
    if witness is None:
        if does != "on" or pause or not whole:
            return None
        return (OVERFLOW, _COUNTER) if both else (OPEN, f"a fast retreat, or {_COUNTER}") if zero else None
    if does == "on" and steep < _IN_PRESS * course.usual:
        return OPEN, _SLIP  # as of a drift
    if both and whole and does in ("on", "other") and witness.moves(i, _NONE) != "":
        return (OPEN, f"{_COUNTER}, over a pause") if pause else (OVERFLOW, _COUNTER)
    if does == "on" or (does == "rests" and witness.rests(i)):
        up = before * after > 0 and abs(after) > abs(before)
        beyond = before * after < 0 and min(abs(before), abs(after)) > _BEYOND * abs(jump)
        found = _OFF if zero else _ANEW if up or beyond else ""
        return (ZERO, found) if found and not (pause or course.is_one_of_several(i)) else (OPEN, _SLIP)
    if does == "other" and zero and course.begins(i, at) and _touches(course, i, witness):
        # A load that rests while the ball moves is none: a cell that was not zeroed before the touch.
        return (OPEN, _SLIP) if pause else (ZERO, _ANEW)
    scaled = does == "other" and _is_scaled(course, i, at) and witness.moves(i, _NONE) == "on"
    return (OPEN, f"another range of the load cell, or {_SLIP}") if scaled else (OPEN, _SLIP) if does == "rests" else None


def _or_scaled(
    judged: _Judged | None,
    quantity: str,
    course: _Course,
    i: int,
    alone: IntArray,
    beside: Mapping[str, FloatArray],
    pause: bool,
) -> tuple[_Judged | None, float]:
    """What a jump of a place or a load is, and the factor: another range or sign where the curve behind it is a multiple."""
    found = followed(course.y, beside, i, alone)
    if found is None or found.kind == "shifted":
        return judged, 1.0
    # A load may fall to a part of itself, as by a slip, unless a capacitance would show it.
    may_slip = quantity == "force" and 0 < found.factor < 1 and not found.by & set(CAPACITANCES)
    # Within a pause a sample relaxes, or recovers.
    sure = not pause or found.factor < 0 or found.factor > _OVER_A_PAUSE
    if found.kind and sure and not may_slip:
        return (SCALED, _SIGN if found.factor < 0 else _RANGE), found.factor
    or_range = f", or from there on they are {found.factor:.2g} times what they were"
    if judged is not None and judged[0] == ZERO:
        return (ZERO, f"{judged[1]}{or_range}"), 1.0
    return judged, 1.0


def _set_to_zero(course: _Course, at: IntArray, ball: FloatArray, ball_noise: float) -> BoolArray:
    """Which steps of a load end at zero and are none of the ball, over whose place it is as steep behind them as before."""
    before, after = np.abs(course.y[at]), np.abs(course.y[at + 1])
    jump = np.abs(course.y[at + 1] - course.y[at])
    zero = (after <= _TO_ZERO * jump + 3 * course.noise) & (before > 0.5 * jump)
    return zero & held_beside(course.y, ball, at, course.noise, ball_noise).goes_on if np.any(zero) else zero


def _is_scaled(course: _Course, i: int, at: IntArray) -> bool:
    """Whether a jump of a good part of the range is one by a factor by which the readings go on more or less steeply."""
    before, after = float(course.y[i]), float(course.y[i + 1])
    ahead, behind, _ = course.slopes(i, at)
    if not (before * after > 0 and ahead * behind > 0) or abs(after - before) < _OF_SCALE * course.span:
        return False
    by, steeper = np.log(after / before), np.log(behind / ahead)
    return bool(by * steeper > 0 and abs(steeper) < _AS_STEEP * abs(by))


def _touches(course: _Course, i: int, witness: _Course) -> bool:
    """Whether a witness goes on over a step of a force: a ball that moves, or a capacitance that does not show the step."""
    if witness.moves(i, _NONE) == "on":
        return True
    shown = abs(float(course.y[i + 1] - course.y[i])) / course.span * witness.span
    return shown > _WOULD_SHOW * (witness.noise + witness.digit) and _near_off(witness, np.array([i])).item() < _UNSEEN * shown


def _of_displacement(course: _Course, i: int, at: IntArray, others: Mapping[str, _Course], pause: bool) -> _Judged | None:
    """Judge a jump of the displacement: it has not happened if a load, or a capacitance, of contact goes on over it."""
    witness = _witness(others, "force")
    if witness is None:
        return None
    jump = abs(float(course.y[i + 1] - course.y[i]))
    least = _WOULD_SHOW * (witness.noise + witness.digit)
    own, load = course.moves(i, at), witness.moves(i, _NONE)
    found = False
    moves = course.slopes(i, at)[:2]
    if own == "on" and float(course.y[i + 1] - course.y[i]) * moves[0] < 0 and load in ("rests", "other", "on"):
        # A motor that goes on as before does not go back within a reading.
        found = load != "on" or jump > 2 * float(np.max(np.abs(moves)))
    elif own == "other" and load == "on" and _is_scaled(course, i, at):
        return OPEN, "another scale or zero of the displacement"
    elif load == own == "on":
        moved, steep = (np.abs(np.array(c.slopes(i, o)[:2])) for c, o in ((course, at), (witness, _NONE)))
        shown = jump / float(np.max(moved)) * float(np.min(steep))
        found = shown > max(least, 3 * abs(float(witness.y[i + 1] - witness.y[i])))
    elif load == "rests" and course.rests(i, besides=True):
        away = abs(float(witness.y[i] - np.median(witness.y[:_NEAR])))
        found = away > _IN_CONTACT * witness.span and jump / course.span * witness.span > least
    return None if not found else (OPEN, "another zero of the displacement, over a pause") if pause else (ZERO, _ANEW)


def _of_capacitance(course: _Course, i: int, at: IntArray, others: Mapping[str, _Course], pause: bool) -> _Judged | None:
    """Judge a jump of the capacitance: it has not happened if load and ball go on over it, and are at no touch."""
    jump, does = abs(float(course.y[i + 1] - course.y[i])), course.moves(i, at)
    doubt = f"{UNSHOWN}, or {_METER}"
    force, ball = others.get("force"), others.get("displacement")
    rest = float(_of_press(course, at, jump))
    if force is not None and _is_seen(force):
        expected = jump / rest * force.span
        would_show = expected > _WOULD_SHOW * (force.noise + force.digit)
        beside = force.moves(i, _NONE) != "other" and force.off(np.array([i])).item() < _UNSEEN * expected
        # What is larger than the press is none of it, at a turn either.
        sure = would_show and (beside or (jump > rest and _near_off(force, np.array([i])).item() < _UNSEEN * expected))
    elif does or (ball is not None and _is_seen(ball)):
        # Without a load on record a snap, a slip and a break look alike, but none is larger than the press.
        sure = does == "on" and jump > rest
    else:
        return None
    return (OVERFLOW, _METER) if sure and not pause else (OPEN, doubt)


def _as_one(jumps: list[Jump]) -> list[Jump]:
    """Jumps of a place or a load: of the whole range again and again, by as much, as a counter's; open if by other amounts."""
    sure = [j for j in jumps if j.kind in (OVERFLOW, ZERO)]
    if len(sure) < 2:
        return jumps
    sizes = np.abs([j.size for j in sure])
    alike = float(np.ptp(sizes)) <= _SAME * float(np.median(sizes))
    if alike:
        return [replace(j, kind=OVERFLOW, why=_COUNTER) if j in sure else j for j in jumps]
    if len(sure) <= _FEW:
        return jumps
    return [replace(j, kind=OPEN, why="another zero, or steps that no other column shows") if j in sure else j for j in jumps]


def _with_returns(jumps: list[Jump], course: _Course) -> list[Jump]:
    """Jumps of a capacitance, of which two that undo each other are one that comes back."""
    found: list[Jump] = []
    for jump in jumps:
        last = found[-1] if found else None
        if (
            last is not None
            and not last.back
            and last.kind == jump.kind == OVERFLOW
            and abs(jump.size + last.size) < _BACK * abs(last.size)
        ):
            rows = int(np.count_nonzero((course.first >= last.row) & (course.first < jump.row)))
            if rows <= _LOST * course.y.size:
                found[-1] = Jump(last.row, last.last, last.size, OVERFLOW, f"a lead that was lost, {_METER}", jump.row)
                continue
        found.append(jump)
    return found


_JUDGES = {
    "force": _of_force,
    "displacement": _of_displacement,
    **dict.fromkeys(CAPACITANCES, _of_capacitance),
}
