"""From a channel over the displacement to how it looks: which way it goes, how it bends, where it is flat, what came first."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter

from calib.lab.signal import reading_noise, resolution, reversals
from calib.lab.stretches import stretches as runs
from models.sensor import BoolArray, FloatArray

#: Change of a channel over the noise of one reading up to which it shows nothing.
NOTHING = 6.0
# Most rows that are looked at one by one; of more, medians of neighbours are.
_MOST = 20_000
# Bins of the displacement along one branch.
_BINS = 40
# A branch counts from this share of the largest change of the channel on.
_COUNTS = 0.1
# Steps in the first or last rows that are so many times those beside them are no readings of the press.
_JUMP = 5.0
# Readings on either side of a jump and back that differ by less than this share of it are of one level.
_SAME_LEVEL = 0.3
# Two stretches over the same places show that they are not alike from this share of the largest change on; then one changes by
# less than such a share of the other, where it stands before those that count than the second one.
_SHOWN, _ALIKE, _HALF = 0.12, 0.1, 0.5
# A channel is flat as long as it stays within this share of its range.
_FLAT = 0.02
# Readings in succession that are one number at an extreme are of the end of a range, where those elsewhere scatter by so many
# steps, and bend the other way at such a share of the rows.
_SAME_NUMBER, _SCATTER, _OTHER_WAY = 5, 1.5, 0.25
# So many of them are no rest at zero, in steps; so many rows are left without them, at least.
_ZERO_STEPS, _LEFT = 1.5, 8


@dataclass(frozen=True, eq=False)
class Stretch:
    """A channel along one monotone stretch of the displacement, as medians in bins from the smallest displacement on.

    Attributes
    ----------
    travel : signed, from its first reading to its last, in the unit of the displacement.
    x, y : displacement and channel in each bin, (n_bin,).
    error : sd of such a median, about.
    begin, end : the channel at its first and at its last reading.
    duration : in the unit of the clock.
    last : the channel at its very last reading, for words.
    """

    travel: float
    x: FloatArray
    y: FloatArray
    error: float
    begin: float
    end: float
    duration: float
    last: float

    @property
    def change(self) -> float:
        """By how much the channel changes from the first reading to the last."""
        return self.end - self.begin


@dataclass(frozen=True)
class Shape:
    """How a channel goes with the displacement over a whole record; signs are those of the file.

    Attributes
    ----------
    slope : from -1 to 1: share of all change that goes up with the displacement, less that which goes down.
    bend : mean of the chord less the curve, in shares of the change: positive where the channel bends upwards.
    bend_above, bend_below : the same without the flat end at the smaller, and at the larger displacements.
    flat_low, flat_high : share of the travel at the smaller, and at the larger displacements over which the channel is flat.
    begin_extreme, end_extreme : whether the first stretch begins, and ends at an extreme of the channel.
    first, first_travel : change of the channel and of the displacement in the first stretch that counts.
    begin : what the channel reads where that begins.
    rise : change of the channel up to the very last reading of that stretch, for words.
    range : of the channel over all stretches.
    crosses : whether the channel goes through zero in the first stretch, far to either side.
    share : change of the first stretch over that of the largest.
    once : whether one stretch alone counts.
    against : whether the channel changes otherwise on the way back than it did over the same places on the way there.
    outdone : whether it changes twice as much on that way back, as under a ball that sticks; a drift is not taken off.
    """

    slope: float
    bend: float
    bend_above: float
    bend_below: float
    flat_low: float
    flat_high: float
    begin_extreme: bool
    end_extreme: bool
    first: float
    first_travel: float
    begin: float
    rise: float
    range: float
    crosses: bool
    share: float
    once: bool
    against: bool
    outdone: bool


def calm(values: FloatArray) -> FloatArray:
    """Readings without spikes of a few rows, as a running median that is longer in a longer record, (n_row,)."""
    size = 1 if values.size < 5 else 5 if values.size < 60 else 9 if values.size < 400 else 21
    return np.asarray(median_filter(values, size=size, mode="nearest"))


def settled(values: FloatArray) -> slice:
    """Which rows to look at: those but the first and last few, if an instrument still or already jumps in them."""
    few = min(6, values.size // 10)

    def jumps(values: FloatArray) -> int:
        steps = np.abs(np.diff(values[: 5 * few + 1]))
        usual = float(np.quantile(steps[few:], 0.9)) if few else 0.0
        cut = int(np.max(np.flatnonzero(steps[:few] > _JUMP * usual) + 1, initial=0))
        # What the last jump leads into may be a spike of two rows, and no reading either: behind it goes on what was before.
        into_spike = cut > 0 and abs(values[cut + 2] - values[cut - 1]) < _SAME_LEVEL * abs(values[cut] - values[cut - 1])
        return cut + 2 if into_spike else cut

    return slice(jumps(values), values.size - jumps(values[::-1]))


def steady(values: FloatArray) -> FloatArray:
    """Readings without spikes, and without jumps of the instrument at either end, for their range and level."""
    return calm(values[settled(values)])


def working_range(x: FloatArray, y: FloatArray) -> float:
    """Over how much of the displacement a channel changes: the press itself, without approach and withdrawal.

    Parameters
    ----------
    x, y : displacement and channel without spikes, (n_row,), in the order of reading.

    Returns
    -------
    In the unit of x; the range of all x where the channel shows nothing.
    """
    steps = np.abs(np.diff(y))
    noise = reading_noise(y)
    every = max(1, y.size // 200)
    # Over a few rows, so that the noise does not hide a slow change.
    steps = np.abs(y[every:] - y[:-every])
    weight = np.where(steps > max(3 * noise, 0.01 * float(np.ptp(y))), steps, 0.0)
    total = float(np.sum(weight))
    if total <= 0:
        return float(np.ptp(x))
    middle = (x[every:] + x[:-every]) / 2
    order = np.argsort(middle, kind="stable")
    share = np.cumsum(weight[order]) / total
    low, high = np.searchsorted(share, [0.01, 0.99])
    return float(middle[order[min(int(high), order.size - 1)]] - middle[order[int(low)]])


def stretches(x: FloatArray, y: FloatArray, clock: FloatArray) -> list[Stretch]:
    """Cut a record where the displacement turns round, and describe the channel along each part.

    Parameters
    ----------
    x, y, clock : displacement, channel and time or number of the reading, (n_row,), all finite, in the order of reading.

    Returns
    -------
    In order; none where the displacement does not move.
    """
    noise = reading_noise(y)
    if x.size > _MOST:
        groups = np.array_split(np.arange(x.size), _MOST)
        noise /= math.sqrt(x.size / _MOST)
        x, y, clock = (np.array([np.median(v[g]) for g in groups]) for v in (x, y, clock))
    threshold_noise = 6 * reading_noise(x)
    x, y = calm(x), calm(y)
    span = float(np.ptp(x))
    if span <= threshold_noise or span == 0.0:
        return []
    turns = reversals(x, max(0.02 * min(span, max(working_range(x, y), 0.02 * span)), threshold_noise))
    return [_stretch(x[a : b + 1], y[a : b + 1], clock[a : b + 1], noise) for a, b in pairwise(turns) if b - a >= 2]


def _stretch(x: FloatArray, y: FloatArray, clock: FloatArray, noise: float) -> Stretch:
    low, length = float(np.min(x)), max(float(np.ptp(x)), 1e-300)
    bins = min(_BINS, max(4, x.size // 3))
    which = np.minimum(((x - low) / length * bins).astype(np.int64), bins - 1)
    order = np.argsort(which, kind="stable")
    parts = [p for p in np.split(order, np.searchsorted(which[order], np.arange(1, bins))) if p.size]
    xs, ys = (np.array([float(np.median(v[p])) for p in parts]) for v in (x, y))
    forwards = x[-1] >= x[0]
    begin, end = (float(ys[0]), float(ys[-1])) if forwards else (float(ys[-1]), float(ys[0]))
    error = noise / math.sqrt(max(1.0, x.size / len(parts)))
    return Stretch(float(x[-1] - x[0]), xs, ys, error, begin, end, float(clock[-1] - clock[0]), float(y[-1]))


def shape_of(x: FloatArray, y: FloatArray, clock: FloatArray) -> Shape | None:
    """Describe how a channel goes with the displacement over the whole record, without drift, holds and spikes.

    Parameters
    ----------
    x, y, clock : as in `stretches`.

    Returns
    -------
    None where nothing changes with the displacement.
    """
    inner = settled(y)
    x, y, clock = x[inner], y[inner], clock[inner]
    noise = reading_noise(y)
    parts = stretches(x, y, clock)
    if not parts:
        return None
    drift = _drift(parts)
    change = np.array([s.change - drift * s.duration for s in parts])
    largest = float(np.max(np.abs(change)))
    if largest <= NOTHING * noise / math.sqrt(max(1.0, x.size / _MOST)):
        return None
    counted = [k for k in range(len(parts)) if abs(change[k]) >= max(_COUNTS * largest, 3 * parts[k].error)]
    first = counted[0]
    total = float(np.sum(np.abs(change[counted])))
    slope = float(sum(np.sign(parts[k].travel) * change[k] for k in counted)) / total
    # The first stretch is before any pull-off; the others together count half as much.
    weights = [1.0 if k == first else 0.5 * abs(change[k]) / max(total - abs(change[first]), 1e-300) for k in counted]
    seen = [_ends(parts[k], drift) for k in counted]
    bend, above, below, flat_low, flat_high = (
        float(sum(w * s[i] for w, s in zip(weights, seen, strict=True)) / sum(weights)) for i in range(5)
    )
    low = min(float(np.min(s.y)) for s in parts)
    high = max(float(np.max(s.y)) for s in parts)
    begin = float(calm(y)[0]) if first == 0 else parts[first].begin
    end = begin + float(change[first])
    crosses = begin * end < 0 and min(abs(begin), abs(end)) > _COUNTS * (high - low)
    return Shape(
        slope=slope,
        bend=bend,
        bend_above=above,
        bend_below=below,
        flat_low=flat_low,
        flat_high=flat_high,
        begin_extreme=_extreme(parts[first].begin, low, high),
        end_extreme=_extreme(parts[first].end, low, high),
        first=float(change[first]),
        first_travel=parts[first].travel,
        begin=begin,
        rise=parts[first].last - begin,
        range=high - low,
        crosses=crosses,
        share=abs(float(change[first])) / largest,
        once=len(counted) == 1,
        against=_goes_against_itself(parts, drift, largest, first),
        outdone=_is_outdone(parts[first : first + 2]),
    )


def _extreme(value: float, low: float, high: float) -> bool:
    """Whether a value is near the lowest or the highest."""
    return min(abs(value - low), abs(high - value)) <= _COUNTS * (high - low)


def _drift(parts: list[Stretch]) -> float:
    """How fast the channel goes on by itself: what is left of its change when the ball has gone there and back.

    Two stretches begin and end alike if the record comes back to where it began. Of more stretches every two neighbours tell a
    drift, wherever they turn; it is one if they agree.
    """
    pairs = [(a, b) for a, b in pairwise(parts) if a.travel * b.travel < 0 and a.duration + b.duration > 0]
    if not pairs:
        return 0.0
    rates = np.array([(a.change + b.change) / (a.duration + b.duration) for a, b in pairs])
    if len(pairs) >= 2:
        middle = float(np.median(rates))
        return middle if float(np.ptp(rates)) < 0.5 * abs(middle) else 0.0
    travel = [s.travel for s in pairs[0]]
    return float(rates[0]) if abs(sum(travel)) < 0.05 * max(abs(t) for t in travel) else 0.0


def _goes_against_itself(parts: list[Stretch], drift: float, largest: float, first: int) -> bool:
    """Whether a stretch changes the other way than the next one over the places of both, or not at all where that does.

    A press does not, whatever it loses at its turn: what it is under does, as a drift that is larger. `first` is the first
    stretch that counts: one before it, over the same places, should have counted.
    """
    for k, pair in enumerate(pairwise(parts)):
        low, high = max(float(s.x[0]) for s in pair), min(float(s.x[-1]) for s in pair)
        if high <= low:
            continue
        rises = [float(np.diff(np.interp([low, high], s.x, _without(s, drift)))[0]) for s in pair]
        small, large = sorted(rises, key=abs)
        alike = _HALF if k < first and abs(rises[0]) < abs(rises[1]) else _ALIKE
        shows = abs(large) >= max(_SHOWN * largest, NOTHING * max(s.error for s in pair))
        if shows and small * large <= alike * large**2:
            return True
    return False


def _is_outdone(pair: list[Stretch]) -> bool:
    """Whether the second of two stretches changes at least twice as much as the first over the places of both."""
    low, high = max(float(s.x[0]) for s in pair), min(float(s.x[-1]) for s in pair)
    first, *second = (abs(float(np.diff(np.interp([low, high], s.x, s.y))[0])) for s in pair)
    return bool(second) and first <= _HALF * second[0]


def _without(s: Stretch, drift: float) -> FloatArray:
    """The channel of a stretch without what drifted since its first reading."""
    u = (s.x - s.x[0]) / (s.x[-1] - s.x[0]) if s.x[-1] > s.x[0] else np.zeros(s.x.size)
    return np.asarray(s.y - drift * s.duration * (u if s.travel > 0 else 1 - u))


def _ends(s: Stretch, drift: float) -> tuple[float, float, float, float, float]:
    """Bend of a stretch, whole and without a flat end at either, and which share of the travel it is flat over at either."""
    length = float(s.x[-1] - s.x[0])
    if s.x.size < 4 or length <= 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    u = (s.x - s.x[0]) / length
    y = _without(s, drift)
    near = max(_FLAT * float(np.ptp(y)), 4 * s.error)
    off = [np.abs(y - np.median(y[:3])) > near, np.abs(y - np.median(y[-3:])) > near]
    low = float(u[np.argmax(off[0])]) if np.any(off[0]) else 1.0
    high = 1 - float(u[u.size - 1 - np.argmax(off[1][::-1])]) if np.any(off[1]) else 1.0
    above, below = (_bend(u[kept], y[kept]) for kept in (u >= low, u <= 1 - high))
    # A straight line stays near its end over some of the travel, too.
    straight = near / max(float(np.ptp(y)), 1e-300)
    return _bend(u, y), above, below, max(low - straight, 0.0), max(high - straight, 0.0)


def _bend(u: FloatArray, y: FloatArray) -> float:
    """Mean of the chord less the curve, in shares of its change; 0 for fewer than four points."""
    if u.size < 4:
        return 0.0
    u = (u - u[0]) / (u[-1] - u[0])
    chord = y[0] + (y[-1] - y[0]) * u
    return float(np.trapezoid(chord - y, u)) / max(abs(float(y[-1] - y[0])), 0.2 * float(np.ptp(y)), 1e-300)


def at_the_end_of_its_range(y: FloatArray) -> BoolArray:
    """Which readings are one number in succession at an extreme of the channel, as of a load cell that ends there, (n_row,).

    Readings of a rest are not: they scatter as all others do, or are zero.

    Parameters
    ----------
    y : readings, (n_row,), all finite, in the order of reading.

    >>> y = np.minimum(np.round(np.linspace(0, 2, 60) ** 1.5 + 0.01 * np.sin(9.0 * np.arange(60) ** 2), 4), 1.5)
    >>> int(np.sum(at_the_end_of_its_range(y))), int(np.sum(at_the_end_of_its_range(y - 1.5)))
    (21, 0)
    """
    found = np.zeros(y.size, dtype=bool)
    if y.size < _LEFT:
        return found
    step, path = resolution(y), calm(y)
    for end in (float(np.max(path)), float(np.min(path))):
        at = np.abs(y - end) <= 0.5 * step if step else y == end
        for first, behind in runs(at):
            at[first:behind] = behind - first >= _SAME_NUMBER
        left = y[~at]
        if not np.any(at) or left.size < _LEFT or abs(end) <= _ZERO_STEPS * step:
            continue
        second = np.diff(left, 2)
        other_way = float(np.mean(second[1:] * second[:-1] < 0))
        if reading_noise(left) >= _SCATTER * step and other_way >= _OTHER_WAY:
            found |= at
    return found if np.count_nonzero(~found) >= _LEFT else np.zeros(y.size, dtype=bool)
