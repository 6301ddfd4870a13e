"""A problem, a point and draws of its scales in, what the readings of sweeps tell of its unknowns out, taken as linear there.

Readings m are taken as linear in all unknowns but the scales, noises and discrepancies. What
they tell of the unknowns z, whatever will be read, is the expected information

    I(u) = M^T S(u)^-1 M,   M = dm/dz,                                                                              (1)

S(u) the covariance of the readings with scales u. Readings of sweeps that are independent of each other add up, those that
nobody has made yet included; those of sweeps that repeat each other have errors in common, as in a calibration.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calib.catalogue import SCALES
from calib.problem import Problem, SweepPlan, model_sweeps, put_together, values_at
from calib.sampling.laplace import weighed
from calib.sampling.scoring import STEP, central_slope
from models.response import OutOfRangeError
from models.sensor import FloatArray


def expected_information(problem: Problem, plans: Sequence[SweepPlan], at: FloatArray, draws: FloatArray) -> FloatArray:
    """Say what the readings of sweeps tell of the unknowns of a problem: (1), before or after they are made.

    Parameters
    ----------
    problem : whose unknowns they are; the sweeps need not be among its own.
    plans : the sweeps, planned together.
    at : (n_unknown,), coordinates z at which readings are differentiated.
    draws : (n_draw, n_unknown), of which the scales alone are taken.

    Returns
    -------
    (n_draw, n_unknown, n_unknown), in coordinates z; rows and columns of the scales are zero.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover a sweep at the point.
    """
    step = STEP * np.eye(at.size)
    scales = np.array([p.parameter in SCALES for p in problem.parameters])
    wide = np.where(scales, draws, at)
    around = at + np.concatenate([0 * step[:1], step, -step])
    of_steps = list(model_sweeps(problem, problem.forward, plans, values_at(problem, around)))
    of_draws = list(model_sweeps(problem, problem.forward, plans, values_at(problem, wide)))
    for plan, near, far in zip(plans, of_steps, of_draws, strict=True):
        if not near.covered[0] or not np.all(far.covered):
            raise OutOfRangeError(f"the {problem.forward.name} does not cover the press of {plan.sweep.title}")
    found = np.zeros((len(draws), at.size, at.size))
    for of_step, of_draw in zip(put_together(plans, of_steps), put_together(plans, of_draws), strict=True):
        rows = np.cumsum(of_step.covered) - 1  # of each step among those that are covered
        slope = np.where(scales, 0.0, central_slope(of_step.readings.mean[rows], of_step.covered).T)
        found += weighed(of_draw.readings, slope)[0]
    return found
