"""From one channel to grades on how it was read: enough readings, in fine and even steps, without gap and flat top."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import median_filter

from calib.lab.linear import slope_and_error
from calib.lab.observations import Observations
from calib.lab.quality.grade import Grade, Level, level_beyond
from calib.lab.quality.leap import leap_of
from calib.lab.quality.loading import MANY_DIGITS, LoadingBranch, channel_values, longest_run
from calib.lab.quality.words import percent
from calib.lab.signal import NO_SIGNAL, resolution

#: Readings in contact. Noise (sd) judged from the n - 4 degrees of freedom that a cubic leaves is uncertain by
#: 1 / sqrt(2 (n - 4)): 12 % at 40 readings, which is also the number of points a channel is reduced to, and 25 % at 12.
FEW_READINGS, TOO_FEW_READINGS = 40, 12
#: Range over the noise of one reading. At 30 the range alone is known from forty independent readings to 2 % (sd), which is
#: what a calibration states for the modulus; at `NO_SIGNAL` the tie of two clocks gives the channel up.
WEAK_SIGNAL = 30.0
#: Steps of the display in the range: relative resolution of the force indicator of 0.5 % (class 1) and 1.5 % (class 3, the
#: coarsest of a calibrated testing machine), ISO 7500-1:2018, table 2. Taken over for the change of capacitance.
FEW_STEPS, TOO_FEW_STEPS = 1 / 0.005, 1 / 0.015
#: Readings in a row at exactly the largest value before a channel is suspected, and the share of its range that must be lost
#: on this flat top for the grade bad. The load cell or the meter's range ends there, and the curve with it.
FLAT_TOP, FLAT_TOP_LOSS = 5, 0.02
#: The same where noise lies on the flat top: readings that stay within so many times their noise of their median, at least so
#: many, rising less than such a share of what they did just before; and the share of the range that must be lost.
LEVEL_NOISES, LEVEL_READINGS, LEVEL_RISE, LEVEL_LOSS = 4.0, 10, 0.15, 0.05
#: Different places of the ball that show how a channel goes on; readings while it stands at one are a hold.
LEVEL_PLACES = 3
#: A gap is longer than so many usual time steps, and takes so much of the duration of loading: one of the forty points, and one
#: fifth of the curve.
GAP_STEPS, GAP, LARGE_GAP = 5.0, 1 / 40, 0.2
# Rows about the turn of a press.
TURN = 5
#: Travel on the way back, as a share of that in contact, after which a channel that still rises was not read then, and by how
#: much it rises, as a share of its range: a meter is late by about half of what it averages over. The same of a channel that
#: falls before the ball turns round, from that share of the travel before it on.
LATE, LATE_RISE, FEWEST_TURNED = 0.02, 0.02, 12
#: Share of a modulus that rounding the displacement is worth (sd): 1.5 times step / sqrt(12) over the travel in contact, as the
#: load goes with depth^1.5 E. 1 % are 43 steps and half of the 2 % that a calibration states; 3 % are 14 steps, and the scatter
#: of moduli within a lab. It is rounded if this share of what the channel changes by comes about while the displacement stands.
COARSE_PLACE, TOO_COARSE_PLACE, ROUNDED = 0.01, 0.03, 0.3
#: Ratio of long to short time steps (95th to 5th percentile) above which neighbouring readings are no even series: their
#: correlation, counted in readings, is then that of the densest part.
UNEVEN_STEPS = 10.0
#: Force [N] and travel in contact [m] beyond which a unit is asked about: a ball of the largest radius, 20 mm, half of it deep
#: in the stiffest silicone, 5 MPa, bears (16/9) E (R d^3)^(1/2) = 1.3 kN (Hertz).
LARGE_FORCE, LARGE_TRAVEL = 1000.0, 0.02


def check_readings(c: LoadingBranch) -> Grade:
    """Are there enough readings in contact to know the noise from them?"""
    n = int(np.sum(~c.flat))
    level = level_beyond(-n, -FEW_READINGS, -TOO_FEW_READINGS)
    finding = f"{n} readings of {c.name} in contact on the loading branch; from {FEW_READINGS} on the noise is known well"
    advice = "Log faster or press slower; a sweep lives on a hundred readings and more."
    return c.grade("readings in contact", level, n, "readings", finding, advice)


def check_signal(c: LoadingBranch) -> Grade | None:
    """Does the channel change by enough, against the noise of one reading? None for fewer than twenty readings."""
    if c.y.size < 20:
        return None  # second differences of so few readings are the curve's bend, not noise
    ratio = c.span / max(c.noise, 1e-9 * c.span, 1e-300)
    level = level_beyond(-ratio, -WEAK_SIGNAL, -NO_SIGNAL)
    finding = f"{c.name} changes by {c.text(c.span)}, {ratio:.0f} times the noise of one reading ({c.text(c.noise)})"
    advice = "Press harder, average longer (slower meter speed), shield the leads."
    return c.grade("signal", level, ratio, "times", finding, advice)


def check_size(c: LoadingBranch) -> Grade | None:
    """Is the press larger than any of a ball into a soft sample? None for a channel that is no force."""
    if c.name != "force":
        return None
    travel = float(c.x[-1]) - c.touch if c.x_unit == "m" else 0.0
    level = level_beyond(max(c.span / LARGE_FORCE, travel / LARGE_TRAVEL), 1.0, np.inf)
    over = f" over {travel * 1e3:.3g} mm in contact" if c.x_unit == "m" else ""
    most = f"a ball in soft silicone takes {LARGE_FORCE:.0f} N and {LARGE_TRAVEL * 1e3:.0f} mm at most"
    finding = f"the load rises by {c.text(c.span)}{over}; {most}"
    advice = "Check the units, and whether its numbers have to be multiplied: --units force=... and displacement=..."
    return c.grade("size", level, c.span, "N", finding, advice)


def check_resolution(c: LoadingBranch) -> Grade:
    """Is the channel written in steps that are small against its range?"""
    steps = c.span / c.step
    level = level_beyond(-steps, -FEW_STEPS, -TOO_FEW_STEPS)
    asked = f"class 1 of ISO 7500-1 asks for {FEW_STEPS:.0f}" if c.name == "force" else f"{FEW_STEPS:.0f} are enough"
    fine = c.step <= MANY_DIGITS * float(np.max(np.abs(c.y)))
    written = "with more than nine digits, at least" if fine else f"in steps of {c.text(c.step)},"
    finding = f"{c.name} is written {written} {steps:.0f} in the range of {c.text(c.span)}; {asked}"
    advice = "in N rather than kN, or use a smaller load cell" if c.name == "force" else "or choose a finer range of the meter"
    return c.grade("resolution", level, steps, "steps", finding, f"Export with more decimals, {advice}.")


def check_place(c: LoadingBranch) -> Grade | None:
    """Is the displacement written in steps that are small against the travel in contact?

    None where they are, and where the drive itself went by steps, between which the channel stood still.
    """
    travel, step = float(np.max(c.x)) - c.touch, resolution(c.x)
    stands = np.diff(c.x) == 0
    if c.x_unit != "m" or travel <= 0 or float(np.sum(np.diff(c.y)[stands])) < ROUNDED * c.span:
        return None
    off = step / math.sqrt(12) / travel
    share = 1.5 * off
    level = level_beyond(share, COARSE_PLACE, TOO_COARSE_PLACE)
    if level == "good":
        return None
    finding = (
        f"the displacement is written in steps of {step * 1e3:.3g} mm, {travel / step:.0f} in the {travel * 1e3:.3g} mm of "
        f"travel, while {c.name} goes on between: a depth is off by {percent(off)} of that (sd), a modulus by {percent(share)}"
    )
    advice = "Export the displacement with more decimals, or in µm."
    return c.grade("resolution of displacement", level, share, "1", finding, advice)


def check_clipping(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Did the load cell or the meter reach the end of its range, so that the curve has a flat top?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None over time alone where a flat top could as well be a hold that the display does not resolve.
    """
    y, x = c.y, c.x
    if c.x_unit != "m":
        if c.noise <= c.step:
            return None  # a meter without visible noise repeats one value in a hold as well
        # The branch ends where the channel does not rise any more, which here is the very thing to look at.
        x = np.flatnonzero(np.isfinite(channel_values(obs, c.name))).astype(np.float64)
        y = c.sign * channel_values(obs, c.name)[x.astype(np.intp)]
    top = float(np.max(y))
    begin, end = longest_run(y == top)
    n = end - begin
    before = (x >= x[begin] - 0.1 * float(np.ptp(x))) & (np.arange(x.size) < begin)
    rise = max(slope_and_error(x[before], y[before])[0], 0.0) if np.unique(x[before]).size >= LEVEL_PLACES else 0.0
    lost = rise * float(x[end - 1] - x[begin])
    if n >= FLAT_TOP and lost > 3 * (c.step + c.noise):
        finding = f"{n} readings in a row at exactly {c.text(c.sign * top)}, where {c.name} was to rise by {c.text(lost)} more"
        advice = "The channel may have reached the end of its range: choose a larger one, or press less."
        return c.grade("clipping", "bad" if lost > FLAT_TOP_LOSS * c.span else "warning", n, "readings", finding, advice)
    level_off = _levels_off(c) if c.x_unit == "m" else None
    if level_off is not None:
        n, lost = level_off
        level = c.text(c.sign * float(np.median(y[-n:])))
        finding = f"{c.name} levels off: its last {n} readings are near {level}, where it was to rise by {c.text(lost)} more"
        advice = "The end of a range, which noise hides, or a load that was held: leave these rows out (--max-depth)."
        return c.grade("clipping", "bad" if lost > LEVEL_LOSS * c.span else "warning", n, "readings", finding, advice)
    finding = f"{n} reading{'s' if n != 1 else ''} in a row at the largest value, {c.text(c.sign * top)}: no flat top"
    return c.grade("clipping", "good", n, "readings", finding, "")


def _levels_off(c: LoadingBranch) -> tuple[int, float] | None:
    """How many readings at the end of a press stand at one level but for noise, and by how much they were to rise, if any do.

    Their noise is that of the flat top itself: that of the whole channel is too large where it has a kink.
    """
    for n in range(c.y.size // 2, LEVEL_READINGS - 1, -1):
        x, y = c.x[-n:], c.y[-n:]
        noise = float(np.std(np.diff(y))) / math.sqrt(2)
        if np.max(np.abs(y - np.median(y))) > LEVEL_NOISES * max(noise, c.step):
            continue
        travel = float(x[-1] - x[0])
        before = (c.x >= x[0] - travel) & (c.x < x[0]) & (np.arange(c.x.size) < c.x.size - n)
        if min(np.unique(x).size, np.unique(c.x[before]).size) < LEVEL_PLACES:
            return None
        rise = slope_and_error(c.x[before], c.y[before])[0]
        lost = (rise - slope_and_error(x, y)[0]) * travel
        small = slope_and_error(x, y)[0] < LEVEL_RISE * rise
        return (n, lost) if small and lost > LEVEL_NOISES * max(noise, c.step) else None
    return None


def check_gap(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Are readings missing while loading?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None without a time column, or for fewer than ten readings.
    """
    if obs.time is None:
        return None
    # Holds within the branch are not used, but they are readings: no gap.
    first, last = int(np.min(c.rows)), int(np.max(c.rows))
    branch = slice(first, last + 1)
    time, values = obs.time[branch], channel_values(obs, c.name)[branch]
    time = np.maximum.accumulate(time[np.isfinite(time) & np.isfinite(values)])
    usual = float(np.median(np.diff(time))) if time.size >= 10 else 0.0
    if usual <= 0:
        return None
    advice = "Readings are missing: look for a stop of the logger, or for rows deleted by hand."
    longest, travel = float(np.max(np.diff(time))), float(time[-1] - time[0])
    leap = leap_of(obs.displacement[branch]) if obs.displacement is not None else None
    if leap is not None and longest <= GAP_STEPS * usual:
        row, times = leap
        finding = (
            f"the displacement leaps by {times:.0f} times its usual step in line {int(obs.table.lines[first + row + 1])}, in a "
            "usual step of time"
        )
        return c.grade(
            "gap in time",
            "warning",
            longest,
            "s",
            finding,
            f"{advice} The times may have been numbered anew, or rows of two presses joined.",
        )
    level = level_beyond(longest / travel, GAP, LARGE_GAP) if longest > GAP_STEPS * usual else "good"
    turn = _time_of_turn(obs, first, last, usual)
    where = "while loading"
    if level == "good" and turn > GAP_STEPS * usual and turn > GAP * travel:
        level, longest, where = "warning", turn, "at the turn"
        advice = f"{advice[:-1]}, or for a rest at the turn that was not written."
    size = f"{longest:.3g} s, {longest / usual:.3g} times the usual step and {percent(longest / travel)} of the branch"
    return c.grade("gap in time", level, longest, "s", f"longest time without a reading {where}: {size}", advice)


def _time_of_turn(obs: Observations, first: int, last: int, usual: float) -> float:
    """The time between two rows in which a press turns into the way back [s]; 0 where rows go on about it at another pace.

    Which rows turn, their noise leaves open by a few, and those behind a gap in which the ball stood may be called a hold.
    """
    begin, end = (max(first - TURN, 0), first + 1) if obs.use.branch == "unloading" else (last, last + TURN + 1)
    kinds = obs.branch[begin:end]
    if obs.time is None or kinds[0] != "loading" or kinds[-1] not in ("hold", "unloading"):
        return 0.0
    *others, longest = sorted(np.nan_to_num(np.diff(obs.time[begin:end])).tolist())
    return longest if not others or others[-1] <= GAP_STEPS * usual else 0.0


def check_told_rows(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Are there as many rows as the file says itself?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None where the file says no number of rows, or as many as there are.
    """
    if obs.table.told_rows is None:
        return None
    there, told = obs.table.told_rows
    level: Level = "warning" if there < (1 - GAP) * told else "good"
    finding = f"the file says that it has {told} rows, and has {there}"
    advice = "Look whether the export was cut, and export the file again; a count of something else changes nothing."
    return c.grade("rows of the file", level, there, "rows", finding, advice)


def check_time_steps(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Do the readings follow each other in even steps of time, as the estimate of their noise takes for granted?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None without a time column, or for fewer than ten steps.
    """
    if obs.time is None:
        return None
    steps = np.diff(obs.time[c.rows])[np.diff(c.rows) == 1]
    steps = steps[np.isfinite(steps)]
    if steps.size < 10 or float(np.median(steps)) <= 0:
        return None
    low, high = (float(v) for v in np.percentile(steps, [5, 95]))
    ratio = high / max(low, 1e-3 * float(np.median(steps)))
    finding = f"nine of ten time steps lie between {low:.3g} and {high:.3g} s"
    advice = "Log in equal steps of time: the noise is judged as if readings followed each other evenly."
    return c.grade("even time steps", level_beyond(ratio, UNEVEN_STEPS, math.inf), ratio, "times", finding, advice)


def check_early(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Does the channel fall again while the ball still goes deeper, as of a clock that runs ahead, or of another press?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None if it does not, and where nothing tells.
    """
    travel = float(np.max(c.x)) - c.touch
    if c.x_unit != "m" or obs.use.branch == "unloading" or c.y.size < FEWEST_TURNED or travel <= 0:
        return None
    y = median_filter(c.y, size=5, mode="nearest")
    first = int(np.argmax(y))
    fall = float(y[first] - np.median(c.y[-3:]))
    share = float(c.x[-1] - c.x[first]) / travel
    if share <= LATE or fall <= max(LATE_RISE * c.span, 6 * c.noise):
        return None
    finding = f"{c.name} falls by {percent(fall / c.span)} of its range while the ball still goes deeper by {percent(share)}"
    sample = ", or the sample slipped or gave way" if c.name == "force" else ""
    advice = (
        f"It is ahead of the press, or of another press{sample}: look at the clocks, and whether the columns belong together."
    )
    return c.grade("early readings", "bad", share, "1", finding, advice)


def check_late(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Does the channel still rise when the ball goes back, as of a meter that averages over a part of the press?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None if it does not, and where nothing tells.
    """
    if obs.displacement is None or obs.use.branch == "unloading":
        return None
    x, y = obs.displacement, c.sign * channel_values(obs, c.name)
    end = int(c.rows[-1])
    travel = float(x[end]) - c.touch
    behind = np.arange(end + 1, x.size)
    behind = behind[np.isfinite(x[behind]) & np.isfinite(y[behind])]
    # Rows of a hold may lie a little deeper; those of the next loading, maybe on a stiffer sample, are another's.
    first = np.flatnonzero(x[behind] < float(x[end]) - LATE * travel)
    if not first.size or travel <= 0:
        return None
    back = behind[first[0] :]
    again = np.flatnonzero((x[back] > x[end]) | (np.array(obs.branch, dtype=object)[back] == "loading"))
    back = back[: int(again[0])] if again.size else back
    if not back.size:
        return None
    last = int(back[np.argmax(y[back])])
    rise = float(y[last] - y[end])
    if rise <= max(LATE_RISE * c.span, 6 * c.noise):
        return None
    share = float(x[end] - x[last]) / travel
    finding = f"{c.name} still rises by {percent(rise / c.span)} of its range while the ball goes back by {percent(share)}"
    advice = "It is averaged over a part of the press, or late: average over less, or press slower, and look at the clocks."
    return c.grade("late readings", "bad", share, "1", finding, advice)
