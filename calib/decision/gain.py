"""What a calibration knows and a measurement in, how sure the unknowns would be after it out, by linearisation.

Given the scales u (noises, discrepancies, and the spread of a lot) what is not known of the unknowns has the covariance

    C(u) = (P(u) + I(u))^-1,                                                                                         (1)

P what is believed before the data, I what all readings tell (`calib.sampling.expected`). A press adds its own information, and
its own unknowns; a quantity that is read by itself with the sd s adds (dvalue/dz)^2 / s^2. What the model leaves out of a press
it leaves out of every other of the same specimen under the same ball: such a press adds what it tells to who knows the others,
as it does in a calibration. One that is deeper than these makes the calibration take that misfit for smoother than it is, and
larger (`calib.sampling.deeper`), for all of its sweeps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from calib.decision.candidate import Candidate
from calib.decision.known import Known
from calib.priors import LogNormal, Prior
from calib.problem import Lot, Problem, columns_at, specimen_and_ball
from calib.sampling import discrepancies_with, expected_information
from models.sensor import FloatArray

# Of more presses than these one that is deeper hardly tells how large discrepancies are.
_FEW_PRESSES = 8

#: C g (n_draw, n_state, n_part) of slopes g (n_state, n_part), of the unknowns before a measurement and the lot's values.
CovarianceTimes = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known of the unknowns of a problem near the middle of its posterior.

    Attributes
    ----------
    problem : with the unknowns.
    middle : (n_unknown,).
    draws : (n_draw, n_unknown), of which the scales count.
    spread : (n_draw, n_lot), of each quantity of a lot.
    information : (n_draw, n_unknown, n_unknown), what the readings tell.
    """

    problem: Problem
    middle: FloatArray
    draws: FloatArray
    spread: FloatArray
    information: FloatArray


def present_knowledge(known: Known, draws: FloatArray, spread: FloatArray) -> Knowledge:
    """What is known by the readings that there are.

    Parameters
    ----------
    known : the calibration.
    draws : (n_draw, n_unknown), of its posterior, for the scales.
    spread : (n_draw, n_lot), of each quantity of the lot at the same draws.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover the sweeps at the middle.
    """
    told = expected_information(known.problem, known.problem.plans, known.middle, draws)
    return Knowledge(known.problem, known.middle, draws, spread, told)


def with_measurement(present: Knowledge, candidate: Candidate) -> Knowledge:
    """What would be known after a measurement, whatever is read.

    Parameters
    ----------
    present : what is known before.
    candidate : the measurement.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover it.
    """
    if candidate.reads is not None:
        k, sd = candidate.reads
        step = 1e-4 * np.eye(present.middle.size)[k]
        up, down = columns_at(present.problem, present.middle + np.stack([step, -step]))[:, k]
        more = present.information.copy()
        more[:, k, k] += ((up - down) / 2e-4 / sd) ** 2
        return replace(present, information=more)
    assert candidate.problem is not None
    n = present.middle.size
    draws = np.tile(candidate.middle, (len(present.draws), 1))
    draws[:, :n] = present.draws
    *before, new = candidate.problem.plans
    alike = [k for k, plan in enumerate(before) if specimen_and_ball(plan.sweep) == specimen_and_ball(new.sweep)]
    if alike and len(before) <= _FEW_PRESSES:
        other = discrepancies_with(candidate.problem, candidate.middle, draws)
        if not np.array_equal(other, draws):
            told = expected_information(candidate.problem, candidate.problem.plans, candidate.middle, other)
            return Knowledge(candidate.problem, candidate.middle, other, present.spread, told)
    more = expected_information(candidate.problem, [*(before[k] for k in alike), new], candidate.middle, draws)
    if alike:  # what the new one tells to who knows the others, by themselves
        known = [present.problem.plans[k] for k in alike]
        more -= expected_information(candidate.problem, known, candidate.middle, draws)
    more[:, :n, :n] += present.information
    return Knowledge(candidate.problem, candidate.middle, draws, present.spread, more)


def covariance(known: Knowledge) -> CovarianceTimes:
    """The covariance of (1), as a function that multiplies slopes by it."""
    a = _believed(known)
    n, n_lot = known.middle.size, known.spread.shape[1]
    a[:, :n, :n] += known.information

    def times(slopes: FloatArray) -> FloatArray:
        # Unknowns that a measurement brings stand between those of before and the lot's, and the target knows nothing of them.
        own = len(slopes) - n_lot
        kept = np.concatenate([np.arange(own), n + np.arange(n_lot)])
        wide = np.zeros((a.shape[1], slopes.shape[1]))
        wide[kept] = slopes
        return np.asarray(np.linalg.solve(a, np.broadcast_to(wide, (len(a), *wide.shape)))[:, kept], dtype=float)

    return times


def _believed(known: Knowledge) -> FloatArray:
    """P(u): unit matrices, but for specimens of a lot, whose values are further states, (n_draw, n_state, n_state).

    x_s = mu + tau e_s, of which r_s = x_s + e'_s is known by itself, and x_s goes with z_s as its prior is wide: see
    `calib.problem.lots`. The states are mu of each quantity.
    """
    n, lots = known.middle.size, known.problem.table.lots
    found = np.tile(np.eye(n + len(lots)), (len(known.draws), 1, 1))
    for j, lot in enumerate(lots, n):
        precision = 1 / known.spread[:, j - n] ** 2
        found[:, j, j] = 1 / lot.prior.sd**2
        for s, k in enumerate(lot.columns):
            width, error = in_lot(lot, s, known.problem.parameters[k].prior)[1], _by_itself(lot, s)
            found[:, k, k] = width**2 * (precision + error)
            found[:, k, j] = found[:, j, k] = -width * precision
            found[:, j, j] += precision
    return found


def in_lot(lot: Lot, specimen: int, prior: Prior) -> tuple[float, float]:
    """Where a prior of a specimen lies on the axis x of its lot, and how wide it is there.

    Parameters
    ----------
    lot : one quantity.
    specimen : number of it.
    prior : of the coordinate z of it.
    """
    reference = float(lot.prior.at(np.zeros(1), specimen)[0])
    low, middle, high = (float(v) / reference for v in prior.ppf_normal(np.array([-1.0, 0.0, 1.0])))
    if isinstance(lot.prior.value, LogNormal):
        return math.log(middle), math.log(high / low) / 2
    return middle - 1, (high - low) / 2


def _by_itself(lot: Lot, specimen: int) -> float:
    """Precision of what is known of a specimen by itself, in x; 0 for nothing."""
    known = lot.prior.known[specimen]
    return 0.0 if known is None else 1 / in_lot(lot, specimen, known)[1] ** 2
