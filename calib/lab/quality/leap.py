"""From a channel over the displacement to whether it leaps to another course, as where rows of two presses were joined."""

from __future__ import annotations

import numpy as np

from calib.lab.observations import Observations
from calib.lab.quality.grade import Grade, level_beyond
from calib.lab.quality.loading import LoadingBranch, channel_values
from calib.lab.quality.words import percent
from models.sensor import FloatArray

# A displacement leaps by so many of as many steps on either side, and so often at most.
LEAP, LEAP_BESIDE, LEAPS = 12.0, 4, 2
#: Readings on either side of a leap of the ball, at least and at most, along which the channel is a cubic of the displacement;
#: how far it is then on another course: in noises of that, and as a share of its range, twice the error of a force indicator
#: (ISO 7500-1).
FEWEST, COURSE, OFF_NOISES, OFF_COURSE = 10, 30, 6.0, 0.02
#: A channel leaps at the turn by such a share of its range and so many noises, and by so many times any of so many steps on
#: either side: more than the few per cent that a soft silicone relaxes by from one reading to the next.
OFF_TURN, TURN_NOISES, TURN_STEPS, TURN_BESIDE = 0.05, 8.0, 4.0, 5


def leap_of(x: FloatArray) -> tuple[int, float] | None:
    """Find where a displacement leaps by dozens of the steps on both sides.

    On both sides it goes on evenly in the direction of the leap, which the steps of a staircase with rests do not, and it leaps
    seldom, which a drive that goes by jerks does not.

    Parameters
    ----------
    x : displacement, (n_row,).

    Returns
    -------
    The row from 0 behind which it leaps, and by how many of its steps; None if it does not.
    """
    steps = np.diff(x)
    found = []
    for k in np.flatnonzero(np.abs(steps) > LEAP * np.nanmedian(np.abs(steps))).tolist():
        beside = np.concatenate([steps[k - LEAP_BESIDE : k], steps[k + 1 : k + 1 + LEAP_BESIDE]]) * np.sign(steps[k])
        if k >= LEAP_BESIDE and beside.size == 2 * LEAP_BESIDE and np.all(beside > 0) and abs(steps[k]) > LEAP * np.max(beside):
            found.append((k, abs(float(steps[k])) / float(np.median(beside))))
    return found[0] if 0 < len(found) <= LEAPS else None


def check_leap(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Does the channel go on along another course where the ball leaps, or leap where the ball turns round?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None if it does not, and where nothing tells.
    """
    if obs.displacement is None or obs.use.branch == "unloading" or not np.any(obs.loading):
        return None
    rows = np.flatnonzero(np.isfinite(obs.displacement) & np.isfinite(channel_values(obs, c.name)))
    x, y = obs.displacement[rows], c.sign * channel_values(obs, c.name)[rows]
    loading = np.flatnonzero(obs.loading[rows])
    if not loading.size:
        return None
    first, end = int(loading[0]), int(loading[-1])
    leap = leap_of(x[first : end + 1])
    if leap is not None:
        row, _ = leap
        off = off_course(x[first : end + 1], y[first : end + 1], row)
        if off is None or abs(off) <= max(OFF_COURSE * c.span, OFF_NOISES * c.noise):
            return None
        finding = (
            f"where the displacement leaps, in line {int(obs.table.lines[rows[first + row + 1]])}, {c.name} goes on "
            f"{percent(abs(off) / c.span)} of its range {'above' if off > 0 else 'below'} its course"
        )
        advice = "Rows of two presses may have been joined there: export each press in a file of its own."
        level = level_beyond(abs(off) / c.span, OFF_COURSE, OFF_TURN)
        return c.grade("leap", level, abs(off) / c.span, "1", finding, advice)
    steps = np.diff(y)
    low, high = end - TURN_BESIDE, end + TURN_BESIDE + 1
    if low < 0 or high > steps.size or obs.branch[int(rows[end + 1])] != "unloading":
        return None
    at = low + int(np.argmax(np.abs(steps[low:high])))
    beside = float(np.max(np.abs(np.delete(steps[low:high], at - low))))
    if abs(at - end) > 2 or abs(float(steps[at])) <= max(OFF_TURN * c.span, TURN_NOISES * c.noise, TURN_STEPS * beside):
        return None
    size = float(steps[at]) / c.span
    finding = (
        f"{c.name} {'rises' if size > 0 else 'falls'} by {percent(abs(size))} of its range from one row to the next where the "
        f"ball turns round, in line {int(obs.table.lines[rows[at + 1]])}"
    )
    advice = (
        "A rest at the turn was not written, or rows of two presses were joined there: look at the instrument's own record."
    )
    return c.grade("leap", "warning", abs(size), "1", finding, advice)


def off_course(x: FloatArray, y: FloatArray, row: int) -> float | None:
    """Tell how far a channel is off its course behind a leap of the displacement.

    A cubic through the readings on both sides is smooth over the leap but for a step there.

    Parameters
    ----------
    x, y : displacement and channel, (n_row,).
    row : from 0, behind which the displacement leaps.

    Returns
    -------
    In the unit of the channel; None where the readings on either side are too few, or do not keep to such a course.
    """
    near = slice(max(row + 1 - COURSE, 0), row + 1 + COURSE)
    place, own = x[near], y[near]
    behind = np.arange(place.size) > row - near.start
    if min(np.count_nonzero(behind), np.count_nonzero(~behind)) < FEWEST:
        return None
    u = (place - np.mean(place)) / max(float(np.ptp(place)), 1e-300)
    powers = np.vander(u, 4, increasing=True)
    design = np.column_stack([powers, behind.astype(float)])
    fitted = np.linalg.lstsq(design, own, rcond=None)[0]
    left = float(np.sum((own - design @ fitted) ** 2)) / (own.size - design.shape[1])
    error = float(np.sqrt(left * np.linalg.pinv(design.T @ design)[-1, -1]))
    off = float(fitted[-1])
    return off if abs(off) > OFF_NOISES * error else None
