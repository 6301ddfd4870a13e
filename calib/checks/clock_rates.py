"""A problem whose readings are tied by clock in, what its data say of meters' clocks that run fast or slow out.

The offset of the clocks is found by where both records turn round; that they run at one rate is taken for granted. A log whose
times are counted, readings times a nominal interval, runs at another. Between contact and turning point the capacitance is then
read at depths that are more and more off, which bends it as a padding of another modulus does. Which of both it is, the
evidence tells as it tells models apart (`calib.checks.departures`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from calib.errors import InputError
from calib.lab import Sweep
from calib.problem import Problem, build_problem
from calib.sampling import Departure, FirstAnswer, first_answer

#: By how much clocks of meters may gain on that of the tester, as likely one as the other; finer steps say the same.
RATES = (-0.02, -0.01, 0.01, 0.02)
#: Name of a departure by a clock's rate.
CLOCK_RATE = "clock-rate"


def is_tied_by_clock(problem: Problem) -> bool:
    """Whether readings of the problem have their depth from the clocks."""
    return any(sweep.tied_by(name) == "clock" for sweep in problem.sweeps for name in sweep.channels)


def at_rate(problem: Problem, near: Mapping[str, float], floor: float, rate: float) -> FirstAnswer | None:
    """Ask the data of a problem again, with the clocks of its meters faster than that of the tester.

    Parameters
    ----------
    problem : as given.
    near, floor : as in `calib.sampling.first_answer`.
    rate : [1], by how much they gain.

    Returns
    -------
    The first answer; None if there is none.
    """
    sweeps = [_corrected(sweep, rate) for sweep in problem.sweeps]
    try:
        return first_answer(build_problem(problem.experiment, sweeps, problem.forward), near, floor)
    except (InputError, ValueError):
        return None


def rate_departure(model: str, own: FirstAnswer, answers: Sequence[FirstAnswer | None]) -> Departure:
    """Put together what the data say of clocks of other rates, integrated over `RATES`.

    Parameters
    ----------
    model : the model as given, in words.
    own : its first answer, with clocks of one rate.
    answers : one for each of the rates.
    """
    evidence = np.array([-math.inf if answer is None else answer.log_evidence for answer in answers])
    best = answers[int(np.argmax(evidence))]
    if best is None:
        return Departure(CLOCK_RATE, f"{model}, the meter's clock fast or slow", float("nan"), None)
    rate = float(np.exp(evidence - logsumexp(evidence)) @ np.array(RATES))
    side = "fast" if rate > 0 else "slow"
    log_bayes = float(logsumexp(evidence)) - math.log(len(RATES)) - own.log_evidence
    told = f"{model}, the meter's clock about {100 * abs(rate):.1f} % {side}"
    return Departure(CLOCK_RATE, told, log_bayes, best.parameters.get("young_modulus"))


def _corrected(sweep: Sweep, rate: float) -> Sweep:
    """The sweep with the times of its meter as a clock of the tester's rate has them, held where the press turns round."""
    if sweep.track is None or not np.isfinite(sweep.clock_offset):
        return sweep
    turn = float(sweep.track.time[np.argmax(sweep.track.displacement)]) - sweep.clock_offset
    channels = {
        name: points if points.time is None else replace(points, time=turn + (points.time - turn) / (1 + rate))
        for name, points in sweep.channels.items()
    }
    return replace(sweep, channels=channels)
