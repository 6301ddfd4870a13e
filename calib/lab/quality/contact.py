"""From one channel to grades on what it shows before contact: whether there is such a part, its drift, its load zero."""

from __future__ import annotations

import math

import numpy as np

from calib.lab.linear import slope_and_error
from calib.lab.observations import Observations
from calib.lab.onset import FEW_BEFORE, FLAT_RISE, LIGHT_TOUCH, TOO_FEW_BEFORE
from calib.lab.part import HOLD
from calib.lab.quality.grade import Grade, Level, level_beyond
from calib.lab.quality.loading import LoadingBranch, channel_values
from calib.lab.quality.words import percent
from calib.lab.signal import reading_noise
from models.sensor import BoolArray

#: Drift before contact, scaled to the duration of loading, as a share of the range. The load zero is one constant: a drift goes
#: on into the modulus by 1.5 to 4.7 times its share (four labs of `benchmarks/simulated`). 0.5 % is then about what a
#: calibration states for the modulus (1 %), 5 % far above.
DRIFT, LARGE_DRIFT = 0.005, FLAT_RISE
#: Change of the level out of contact from before to after the press, scaled likewise: the same limits, as a drift that is even
#: is as large.
RETURN, LARGE_RETURN = DRIFT, LARGE_DRIFT
#: Readings out of contact on either side of the press that tell whether its level has changed.
LEAST_OUT = 5
# A force within so many times its noise of the load zero is none.
_NO_LOAD = 2.0
#: Share of the travel before contact. From 2 % on the flat part has points of its own in the reduction; with fewer than three
#: readings there, load zero and contact point are extrapolated.
SHORT_START = 0.02
#: Load zero [N] up to which the default prior of `load_zero` reaches.
LOAD_ZERO_REACH = 5.0


def check_start(obs: Observations, c: LoadingBranch) -> Grade:
    """Does the record start well before contact, so that load zero and contact point can be seen in it?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.
    """
    n = int(np.sum(c.flat))
    travel = max(c.touch - float(c.x[0]), 0.0)
    share = travel / max(float(np.ptp(c.x)), 1e-300)
    advice = "Start the record 0.1 mm or more above the sensor and let the ball come down to it."
    if n < TOO_FEW_BEFORE:
        finding = f"{c.name} changes from the first reading on: the record starts in contact, its contact point is extrapolated"
        first = abs(float(c.y[0])) / c.span
        light = c.name == "force" and first <= LIGHT_TOUCH
        if light:
            finding += f"; a light touch, {percent(first)} of the range, if the cell was balanced"
        if (other := _cycle_from_further_out(obs, c)) is not None:
            finding += f"; cycle {other} loads from further out"
            advice = f"Use the cycle that begins out of contact, if one does: --cycles {other}. {advice}"
        return c.grade("start before contact", "warning" if light else "bad", travel, c.x_unit, finding, advice)
    level: Level = "warning" if share < SHORT_START or n < FEW_BEFORE else "good"
    shown = f"{travel * 1e3:.3g} mm" if c.x_unit == "m" else f"{travel:.3g} {c.x_unit}"
    finding = f"{c.name} is flat over the first {shown} ({n} readings, {percent(share)} of the branch)"
    return c.grade("start before contact", level, travel, c.x_unit, finding, advice)


def _cycle_from_further_out(obs: Observations, c: LoadingBranch) -> int | None:
    """The first cycle that is not used whose loading begins further out than that which is, by more than the travel of that."""
    if obs.displacement is None or obs.use.branch == "unloading":
        return None
    out = float(np.min(c.x)) - float(np.ptp(c.x))
    loads = (np.array(obs.branch, dtype=object) == "loading") & (obs.displacement < out) & ~np.isin(obs.cycle, obs.used_cycles)
    return next((int(k) for k in obs.cycle[loads] if k > 0), None)


def check_drift(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Does the channel move before contact, while nothing touches the sensor?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None for fewer than ten readings before contact.
    """
    values = channel_values(obs, c.name)
    clock = np.arange(len(obs.used), dtype=float) if obs.time is None else obs.time
    flat = c.rows[c.flat]
    # The last fifth before the onset may already be contact that does not show yet.
    flat = flat[: max(TOO_FEW_BEFORE, int(0.8 * flat.size))]
    waiting = np.array([r == HOLD for r in obs.reason], dtype=bool) & (np.arange(len(obs.used)) < np.min(c.rows))
    if obs.displacement is not None:
        waiting &= obs.displacement <= c.touch
    rows = np.concatenate([np.flatnonzero(waiting), flat])
    rows = rows[np.isfinite(clock[rows]) & np.isfinite(values[rows])]
    if flat.size == 0 or rows.size < FEW_BEFORE:
        return None
    slope, error = slope_and_error(clock[rows], c.sign * values[rows])
    duration = abs(float(clock[c.rows[-1]] - clock[c.rows[0]]))
    if not (math.isfinite(error) and math.isfinite(duration)):
        return None
    share, sd = slope * duration / c.span, error * duration / c.span
    sure = abs(share) > 3 * sd
    level = level_beyond(abs(share), DRIFT, LARGE_DRIFT) if sure else "good"
    loading = f"{duration:.3g} {'s' if obs.time is not None else 'readings'} of loading"
    doubt = "" if sure else "; not distinct from none"
    finding = (
        f"before contact {c.name} drifts by {percent(share)} of its range in the {loading} (sd {percent(sd)}, from "
        f"{rows.size} readings{doubt})"
    )
    advice = (
        "Let cell and specimen come to rest before the test, press faster, and look for cables that pull."
        if c.name == "force"
        else "Warm the meter up, keep hands and cables away from the leads, and repeat the open correction."
    )
    return c.grade("drift before contact", level, share, "1", finding, advice)


def check_return(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Does the channel come back to the level before the press once the ball has left the sensor?

    What moves with time without being of the sensor (a cell that drifts, a meter that warms up) shows here ten times as well
    as before contact, as the time between is so much longer. Readings close to contact are left out, where silicone may stick.

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None where neither displacement nor force tells what is out of contact, with fewer than five readings well out of it on
    either side of the press, and where the unloading is what is used.
    """
    out = _well_out_of_contact(obs, c)
    if out is None or obs.use.branch == "unloading":
        return None
    values = channel_values(obs, c.name)
    clock = np.arange(len(obs.used), dtype=float) if obs.time is None else obs.time
    number = np.arange(clock.size)
    again = np.flatnonzero((number > c.rows[-1]) & (np.array(obs.branch, dtype=object) == "loading"))
    after = (number > c.rows[-1]) & (number < (again[0] if again.size else number.size))
    good = out & np.isfinite(values) & np.isfinite(clock)
    before, later = c.rows[c.flat & good[c.rows]], np.flatnonzero(after & good)
    if min(before.size, later.size) < LEAST_OUT:
        return None
    rows = np.concatenate([before, later])
    slope, error = slope_and_error(clock[rows], c.sign * values[rows])
    duration = abs(float(clock[c.rows[-1]] - clock[c.rows[0]]))
    if not (math.isfinite(error) and math.isfinite(duration)):
        return None
    share, sd = slope * duration / c.span, error * duration / c.span
    sure = abs(share) > 3 * sd
    level = level_beyond(abs(share), RETURN, LARGE_RETURN) if sure else "good"
    change = float(np.mean(values[later]) - np.mean(values[before]))
    side = "higher" if change > 0 else "lower"
    doubt = "" if sure else "; not distinct from none"
    finding = (
        f"out of contact {c.name} is {c.text(abs(change))} {side} after the press than before: {percent(share)} of its range "
        f"in the time of loading, if that came evenly (sd {percent(sd)}{doubt})"
    )
    advice = (
        "A cell that drifts, or silicone that still pulls at the ball: let both come to rest and go further up; press faster."
        if c.name == "force"
        else "A meter that drifts, cables that moved, or a dielectric that recovers slowly: log on until it stands still."
    )
    return c.grade("return to zero", level, share, "1", finding, advice)


def _well_out_of_contact(obs: Observations, c: LoadingBranch) -> BoolArray | None:
    """Which rows of a file lie well out of contact, (n_row,): by the displacement, or by the force of a log without one."""
    if not np.any(c.flat):
        return None
    if obs.displacement is not None:
        return np.asarray(obs.displacement <= (float(c.x[0]) + c.touch) / 2)
    if obs.force is None or c.name == "force":
        return None
    load = obs.force[c.rows]
    return np.asarray(obs.force <= float(np.median(load[c.flat])) + _NO_LOAD * reading_noise(load))


def check_load_zero(c: LoadingBranch) -> Grade:
    """Was the load cell balanced before the test?"""
    zero = c.sign * c.zero
    level: Level = "warning" if abs(zero) > min(c.span, LOAD_ZERO_REACH) else "good"
    where = "the force before contact" if np.any(c.flat) else "the first reading of force, in contact or not,"
    share = percent(abs(zero) / c.span)
    finding = f"{where} is {zero:.3g} N, {share} of the range of {c.text(c.span)}; it is a parameter, not taken off"
    advice = f"Balance the load cell before the test; beyond {LOAD_ZERO_REACH:g} N give load_zero a prior of its own."
    return c.grade("load zero", level, zero, "N", finding, advice)
