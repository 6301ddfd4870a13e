"""Two series of readings, or two sweeps, in; whether one holds the readings of the other, however its file was cut, out.

A file that was cut to a part, zeroed, saved anew or renamed has other bytes and the same readings. Of two presses of one
machine single readings agree to the last digit, as there are only so many digits, and so do ramps that it was told to follow;
several noisy ones in a row do not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from calib.lab.sweep import Points, Sweep
from models.sensor import FloatArray, IntArray

# Readings in a row that have to agree, and how many different steps from one to the next they have to take.
_ROW, _UNLIKE = 8, 4
# One of so many rows is kept of a few.
_FEW = 16
# A copy that was thinned out has at least every so many-th reading.
_THINNEST = 10
# Binary digits (nine decimal ones) to which they agree, so that another unit in the file is no other reading.
_DIGITS = 30
#: Share [1] of the shorter series that stands in the other where they are the same.
SAME = 0.5
# Points of a channel that have to agree, at least, and to which share of the standard deviation of a point.
_POINTS, _EXACTLY = 8, 0.01
# Of so many points they need not agree as well: in mean square within this share of what noise makes of two presses.
_MANY_POINTS, _COPIED = 30, 0.25
# Points at rest, and how far their means may be apart in presses of one piece [1]; what must show of a force, as a share of its
# range, and how far curves of one piece are apart, in mean square over what noise makes of it.
_AT_REST, _REST_ALIKE, _FORCE_ALIKE, _LIKE_NOISE = 3, 3e-4, 5e-3, 2.0
# No reading has less noise than its last digit in double precision [1], as that of a curve without any has.
_DIGIT = 1e-12
# Of rows of long records those with a remainder of zero are compared, this many at most.
_MOST = 4000


def rows_of(readings: FloatArray, *, few: bool = False) -> IntArray:
    """Numbers that stand for the readings of a series, so many in a row each; for none that stand still or follow a ramp.

    Parameters
    ----------
    readings : (n,), in the order of reading; what is no number is passed over.
    few : of rows those alone whose first reading is one of a sixteenth of all there can be, the same in every series.

    Returns
    -------
    Each once, in order, (n_row,).
    """
    value = readings[np.isfinite(readings)]
    if value.size < _ROW:
        return np.empty(0, dtype=np.int64)
    mantissa, exponent = np.frexp(value)
    digits = np.round(mantissa * 2.0**_DIGITS).astype(np.int64) + (exponent.astype(np.int64) << (_DIGITS + 2))
    # Odd numbers of 63 bits, always the same: sums that wrap round differ wherever readings do.
    by = np.random.default_rng(0).integers(2**62, 2**63 - 1, _ROW, dtype=np.int64) | 1
    first = np.arange(value.size - _ROW + 1)
    if few:
        first = first[((digits[first] * by[0]) >> 40) % _FEW == 0]
    steps = np.round(np.diff(value) * 2.0**_DIGITS / max(float(np.max(np.abs(value))), 1e-300)).astype(np.int64)
    steps = np.sort(np.lib.stride_tricks.sliding_window_view(steps, _ROW - 1)[first], axis=1)
    unlike = 1 + np.count_nonzero(np.diff(steps, axis=1) > 2, axis=1)
    rows = np.lib.stride_tricks.sliding_window_view(digits, _ROW)[first[unlike >= _UNLIKE]]
    return np.unique(rows @ by)


def thinned_rows_of(readings: FloatArray, *, few: bool = False) -> IntArray:
    """The same of every second, third, ... tenth reading, from whichever it begins: what a copy that was thinned out has.

    Parameters
    ----------
    readings, few : as of `rows_of`.
    """
    value = readings[np.isfinite(readings)]
    parts = [rows_of(value[first::every], few=few) for every in range(2, _THINNEST + 1) for first in range(every)]
    return np.unique(np.concatenate(parts))


def share_in_both(first: IntArray, second: IntArray) -> float:
    """Which share [1] of the rows of the shorter series are in the other.

    Parameters
    ----------
    first, second : from `rows_of`.

    Examples
    --------
    >>> readings = np.random.default_rng(1).normal(size=300).round(3)
    >>> round(share_in_both(rows_of(readings), rows_of(1e3 * readings[40:200] / 1e3)), 2)
    1.0
    """
    fewest = min(first.size, second.size)
    every = max(1, fewest // _MOST)
    one, other = (rows if every == 1 else rows[rows % every == 0] for rows in (first, second))
    fewest = min(one.size, other.size)
    return float(np.intersect1d(one, other, assume_unique=True).size / fewest) if fewest >= _ROW else 0.0


def repeated_channels(first: Sweep, second: Sweep) -> tuple[str, ...]:
    """Say of which channels two sweeps have the same readings, whatever is zero in either.

    Told by the tester's record, where they keep it, by the times of a meter's log that is both's, and by points: of the same
    readings these are apart, but for where channel and crosshead have zero and where the cut lies, by far less than noise
    sets two presses apart, however alike these are. Over n points of two presses the mean square is below a quarter of what
    it is expected to be with a probability of P(chi2_(n-2) < n / 4), 1e-6 for 40.

    Parameters
    ----------
    first, second : the sweeps.
    """
    found = [name for name in first.channels if name in second.channels and _same_points(first, second, name)]
    if "force" not in found and first.track is not None and second.track is not None:
        tracks = (rows_of(track.force) for track in (first.track, second.track))
        found += ["force"] if share_in_both(*tracks) >= SAME else []
    return tuple(found)


def as_one_piece(first: Sweep, second: Sweep) -> bool:
    """Whether two presses are as alike as those of one piece: in capacitance at rest, and in force to its noise.

    Pieces of one lot differ by a per cent and more in what their layers are thick, in capacitance at rest by as much, in force
    by some times that. Where a force is read so coarsely that half a per cent of it does not show, nothing is told.

    Parameters
    ----------
    first, second : the sweeps.
    """
    if not all({"force", "capacitance"} <= sweep.channels.keys() for sweep in (first, second)):
        return False
    rest = [float(np.mean(sweep.channels["capacitance"].value[:_AT_REST])) for sweep in (first, second)]
    if abs(rest[0] - rest[1]) > _REST_ALIKE * abs(rest[0]):
        return False
    one, other = first.channels["force"], second.channels["force"]
    variances = [_variance(sweep, "force") for sweep in (first, second)]
    shown = (_FORCE_ALIKE * float(np.ptp(one.value))) ** 2
    for away, expected in _over_displacement(one, other, variances[0], variances[1], _POINTS, _moved(first, second)):
        if np.mean(expected) < shown and np.mean(away**2 / expected) < _LIKE_NOISE:
            return True
    return False


def _same_points(first: Sweep, second: Sweep, name: str) -> bool:
    one, other = first.channels[name], second.channels[name]
    equal = np.array_equal(one.value, other.value)
    if _of_one_log(first, second) and (equal or _overlap(one.time, other.time)):
        return True
    # Means of readings that are coarser than their noise agree to the last digit in two presses of one specimen, too.
    estimates = [sweep.readings[name] for sweep in (first, second) if name in sweep.readings]
    if any(estimate.noise < estimate.resolution for estimate in estimates):
        return False
    if equal:
        return True
    variances = [_variance(sweep, name) for sweep in (first, second)]
    exactly = _EXACTLY * float(np.sqrt(min(np.min(variance) for variance in variances)))
    fewest = max(_POINTS, math.ceil(SAME * min(one.value.size, other.value.size)))
    for away, expected in _beside_each_other(one, other, variances[0], variances[1], fewest, _moved(first, second)):
        alike = np.count_nonzero(np.abs(away) <= exactly) >= fewest
        if alike or (away.size >= _MANY_POINTS and np.mean(away**2 / expected) < _COPIED):
            return True
    return False


def _moved(first: Sweep, second: Sweep) -> float:
    """By how much contact comes later on the crosshead of the first [m]; 0 where it is not known."""
    return 0.0 if math.isnan(first.contact + second.contact) else first.contact - second.contact


def _variance(sweep: Sweep, name: str) -> FloatArray:
    """Variance of each point of a channel by the noise of its readings, at least that of a last digit."""
    points = sweep.channels[name]
    least = _DIGIT * float(np.max(np.abs(points.value)))
    return np.maximum(sweep.noise[name] ** 2 / points.n_effective, least**2)


def _beside_each_other(
    one: Points, other: Points, of_one: FloatArray, of_other: FloatArray, fewest: int, moved: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """How far points are apart but for a level, in each way to lay `fewest` or more beside each other, with noise's variance.

    Along the crosshead's reading; and point by point, those of one moved on by as many places as may have been cut off.
    """
    yield from _over_displacement(one, other, of_one, of_other, fewest, moved)
    for place in range(fewest - other.value.size, one.value.size - fewest + 1):
        mine = slice(max(place, 0), min(place + other.value.size, one.value.size))
        others = slice(mine.start - place, mine.stop - place)
        apart = one.value[mine] - other.value[others]
        yield apart - np.median(apart), of_one[mine] + of_other[others]


def _over_displacement(
    one: Points, other: Points, of_one: FloatArray, of_other: FloatArray, fewest: int, moved: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The same along the crosshead's reading alone, however readings were put together to points.

    Likewise with the reading of the other moved by as much as contact is (`moved` [m], and what is left of that as far as it
    shows).
    """
    if one.displacement is None or other.displacement is None or not np.all(np.diff(one.displacement) > 0):
        return
    for by in dict.fromkeys((0.0, moved)):
        x = other.displacement + by
        there = (x >= one.displacement[0]) & (x <= one.displacement[-1])
        if np.count_nonzero(there) >= fewest:
            value, variance = (np.interp(x[there], one.displacement, column) for column in (one.value, of_one))
            apart, expected = value - other.value[there], variance + of_other[there]
            yield apart - np.median(apart), expected
            slope = np.interp(x[there], one.displacement, np.gradient(one.value, one.displacement))
            yield _without(apart, expected, slope), expected


def _without(apart: FloatArray, variance: FloatArray, slope: FloatArray) -> FloatArray:
    """What is left of differences without a level, and without what a displacement makes of a curve of such slope."""
    root = np.sqrt(variance)
    columns = np.column_stack([np.ones_like(slope), slope / max(float(np.max(np.abs(slope))), 1e-300)])
    found = np.linalg.lstsq(columns / root[:, None], apart / root, rcond=None)[0]
    return np.asarray(apart - columns @ found, dtype=float)


def _of_one_log(first: Sweep, second: Sweep) -> bool:
    """Whether the last files of both, in which the meter's log stands where clocks tie it, are of the same bytes."""
    return bool(first.files and second.files and first.files[-1][1] == second.files[-1][1])


def _overlap(first: FloatArray | None, second: FloatArray | None) -> bool:
    """Whether times of one clock are the same for at least `SAME` of the shorter series; not without times."""
    if first is None or second is None:
        return False
    both = min(first[-1], second[-1]) - max(first[0], second[0])
    return bool(both >= SAME * min(np.ptp(first), np.ptp(second)))
