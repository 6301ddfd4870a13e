"""From times of day at the end of their ranges, 24:00:00 and second 60, to midnight, a leap second or a minute rounded up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# The minutes of an hour in which some zone's clock shows 23:59 UTC, the minute that a leap second ends.
_LAST_MINUTES = (29.0, 44.0, 59.0)
_LAST_UTC = 86340.0
# Usual steps are between these percentiles of all, and within this share of the middle one beyond them.
_USUAL, _BEYOND = (5.0, 95.0), 0.1
# From this share of the rows of a usual second on a second 60 is one of its own, up to the other half of one, by rounding.
_OWN, _HALF = 0.8, 0.6


def midnights(parts: FloatArray, dates: Sequence[str]) -> tuple[FloatArray, int | None]:
    """Read 24:00:00 as the midnight that it is: the end of its date, or its beginning where the date is already the next.

    It is one only between hours of 23 and of 0; anywhere else it is a damaged cell and stays as it is.

    Parameters
    ----------
    parts : hours, minutes and seconds, nan where there are none, (n_row, 3).
    dates : of each row, as written; () without dates.

    Returns
    -------
    The parts, with hour 0 where a day begins, and 24 left where the date's end is meant; the first row from 0 of such a
    midnight, None without one.
    """
    full = (parts[:, 0] == 24) & (parts[:, 1] == 0) & (parts[:, 2] == 0)
    if not np.any(full):
        return parts, None
    rows = np.flatnonzero(np.isfinite(parts[:, 0]) & ~full)
    hours, first = parts.copy(), None
    for row in np.flatnonzero(full).tolist():
        at = int(np.searchsorted(rows, row))
        before, behind = (int(rows[at - 1]) if at else None), (int(rows[at]) if at < rows.size else None)
        fits = (before is None or parts[before, 0] == 23) and (behind is None or parts[behind, 0] == 0)
        if not fits or (before is None and behind is None):
            hours[row] = np.nan
            continue
        first = row if first is None else first
        own_end = bool(dates) and (dates[row] == dates[before] if before is not None else dates[row] != dates[behind or 0])
        hours[row, 0] = 24.0 if own_end else 0.0
    return hours, first


@dataclass(frozen=True, eq=False)
class LeapSecond:
    """What a second 60 is.

    Attributes
    ----------
    seconds : times, going on over a leap second, nan where a second 60 is none, (n_row,).
    row : of the second 60 that is told of, from 0; None without one.
    conflict : why it may be two things; "" if it is one.
    """

    seconds: FloatArray
    row: int | None = None
    conflict: str = ""


def leap_second(values: FloatArray, parts: FloatArray, zones: FloatArray) -> LeapSecond:
    """Tell a leap second, behind which all is a second later than the clock says, from a minute that was rounded up.

    A leap second is logged once and at the end of 23:59 UTC. It is one if decimals count within it, or if time goes on behind
    it as it does elsewhere only if it is counted. 12:34:60.0 is 12:35:00.0, as programs write it that round their seconds.

    Parameters
    ----------
    values : seconds over days and midnights, nan where there is no time, (n_row,).
    parts : hours, minutes and seconds of the cells, (n_row, 3).
    zones : offsets from UTC [s], nan where none is written, (n_row,).
    """
    sixty = np.isfinite(values) & (parts[:, 2] >= 60)
    if not np.any(sixty):
        return LeapSecond(values)
    rows = np.flatnonzero(np.isfinite(values))
    at = np.flatnonzero(sixty[rows])
    first, last = int(rows[at[0]]), int(at[-1])
    whole = not np.any(parts[sixty, 2] > 60)
    together = last - at[0] + 1 == at.size and bool(np.all(parts[sixty, :2] == parts[first, :2]))
    minute = values[first] - (parts[first, 2] - 60.0)
    passed = last + 1 == rows.size or values[rows[last + 1]] >= minute
    if not (together and passed and _may_be_leap(parts[first], zones[first])):
        # Nothing but a rounded minute is left, and decimals are not rounded to.
        return LeapSecond(np.where(sixty & (parts[:, 2] > 60), np.nan, values))
    if last + 1 == rows.size:
        return LeapSecond(values)
    decided = True if not whole else _counts(values[rows], at)
    if decided is None:
        return LeapSecond(values, first, "a second 60 may be a leap second, or a minute that was rounded up")
    if not decided:
        return LeapSecond(values)
    later = values.copy()
    later[rows[last + 1 :]] += 1.0
    return LeapSecond(later, first)


def _may_be_leap(parts: FloatArray, zone: float) -> bool:
    """Whether a clock of this zone, or of any where it is nan, may show a leap second in this minute."""
    if np.isnan(zone):
        return bool(parts[1] in _LAST_MINUTES)
    return bool((3600.0 * parts[0] + 60.0 * parts[1] - zone) % 86400.0 == _LAST_UTC)


def _counts(time: FloatArray, at: IntArray) -> bool | None:
    """Whether a second 60 without decimals, at these places among the times, is one of its own; None if nothing tells."""
    steps = np.diff(time)
    others = np.delete(steps, int(at[-1]))
    over, positive = float(steps[at[-1]]), others[others > 0]
    if not positive.size:
        return None
    if np.count_nonzero(others == 0) > 0.1 * others.size:  # several rows a second: a rounded minute takes half of one
        share = at.size * (1 + positive.size) / time.size
        return True if share >= _OWN and at.size > 1 else False if share <= _HALF else None
    margin = _BEYOND * float(np.median(positive))
    low, high = np.percentile(positive, _USUAL)
    without, counted = (low - margin <= step <= high + margin for step in (over, over + 1.0))
    return bool(counted) if without != counted else None


def beyond_sixty(third: FloatArray) -> BoolArray:
    """Where the last part of times passes what a second may be, with one leap second, whose rows stand together, let pass.

    Parameters
    ----------
    third : last parts, nan where there are none, (n_row,).
    """
    above = third >= 60
    leap = above & (third < 61)
    at = np.flatnonzero(leap)
    if at.size and at[-1] - at[0] + 1 == at.size:
        above = above & ~leap
    return np.asarray(above)
