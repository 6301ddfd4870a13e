"""From the observations of one lab file to all grades on them: which checks are made, and in which order."""

from __future__ import annotations

from calib.catalogue import responds
from calib.lab.observations import Observations
from calib.lab.quality.contact import check_drift, check_load_zero, check_return, check_start
from calib.lab.quality.grade import Grade
from calib.lab.quality.leap import check_leap
from calib.lab.quality.loading import loading_branch
from calib.lab.quality.material import check_compliance, check_hysteresis, check_relaxation
from calib.lab.quality.presses import check_presses
from calib.lab.quality.readings import (
    check_clipping,
    check_early,
    check_gap,
    check_late,
    check_place,
    check_readings,
    check_resolution,
    check_signal,
    check_size,
    check_time_steps,
    check_told_rows,
)
from calib.lab.quality.turn import check_turn
from calib.lab.signal import NO_SIGNAL


def judge(
    obs: Observations, machine_compliance: float | None = None, *, believed_compliance: float | None = None
) -> tuple[Grade, ...]:
    """Say what may spoil a calibration from this lab file, how much, and what to do: channel by channel, check by check.

    Parameters
    ----------
    obs : one lab file with force, capacitance or both, over displacement or time.
    machine_compliance : [m/N], measured, or the upper end of the prior that is given; None if nothing is given. Then a light
        table-top rig (`LIGHT_RIG`) is taken, and the grade is a warning at most.
    believed_compliance : [m/N], the upper end of what a calibration believes where nothing is given, to be told beside it.

    Returns
    -------
    One grade for each check that applies; none at all for a file with fewer than five readings of a channel on the loading
    branch, which the reduction refuses.
    """
    grades: list[Grade | None] = []
    for c in (loading_branch(obs, name) for name in obs.channels):
        if c is None:
            continue
        signal = check_signal(c) if responds(c.name) else None
        grades += [check_readings(c), signal, check_told_rows(obs, c), check_gap(obs, c), check_time_steps(obs, c)]
        if c.span <= NO_SIGNAL * c.noise:
            continue  # all other numbers would be shares of noise
        grades += [check_size(c), check_resolution(c), check_clipping(obs, c)]
        grades += [check_early(obs, c), check_late(obs, c), check_turn(obs, c), check_leap(obs, c)]
        grades.append(check_presses(obs, c))
        grades += [check_start(obs, c), check_drift(obs, c), check_return(obs, c), check_relaxation(obs, c)]
        if not any(v is not None and v.check == "resolution of displacement" for v in grades):
            grades.append(check_place(c))
        if c.name == "force":
            grades += [check_load_zero(c), check_hysteresis(obs, c)]
            grades.append(check_compliance(c, machine_compliance, believed_compliance))
    return tuple(v for v in grades if v is not None)


def judge_return(beside: Observations) -> tuple[Grade, ...]:
    """Say of a meter's log with times alone what shows only where the tester's record tells when the ball was away.

    Parameters
    ----------
    beside : the log, from `calib.lab.clocks.beside_tester`.

    Returns
    -------
    One grade for each channel that was read out of contact before and after the press.
    """
    branches = (loading_branch(beside, name) for name in beside.channels)
    grades = (check_return(beside, c) for c in branches if c is not None and c.span > NO_SIGNAL * c.noise)
    return tuple(v for v in grades if v is not None)
