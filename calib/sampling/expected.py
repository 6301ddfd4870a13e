"""A problem, a point and draws of its scales in, what the readings of sweeps tell of its unknowns out, taken as linear there.

Readings m are taken as linear in all unknowns but the scales (noises and discrepancies), as in `calib.sampling.laplace`. What
they tell of the unknowns z, whatever will be read, is the expected information

    I(u) = M^T S(u)^-1 M,   M = dm/dz,                                                                              (1)

S(u) the covariance of the readings with scales u. Readings of sweeps that are independent of each other add up, those that
nobody has made yet included.

A calibration takes the errors of every sweep as new. Presses of one specimen under one ball are not so: what the model leaves
out of the first it leaves out of the others, too. Taken together, S has for points i and j of any of these sweeps

    S_ij = s_i^2 1_ij + (V V^T)_ij + delta^2 g_i g_j exp(-(d_i - d_j)^2 / 2 l^2)                                    (2)

with the terms of (4) of `calib.problem.measurement`, d true indentations, and l the correlation length of the first of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.catalogue import SCALES
from calib.problem import CORRELATION_LENGTH, PredictedReadings, Problem, SweepPlan, model_sweeps, values_at
from calib.sampling.laplace import weighed
from calib.sampling.scoring import STEP, central_slope
from models.response import OutOfRangeError
from models.sensor import FloatArray


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel of a sweep: its slopes M (n_point, n_unknown), depths of its points [m] (n_point,), S at draws of scales."""

    slopes: FloatArray
    depth: FloatArray
    readings: PredictedReadings


def expected_information(problem: Problem, plans: Sequence[SweepPlan], at: FloatArray, draws: FloatArray) -> FloatArray:
    """Say what the readings of sweeps tell of the unknowns of a problem: (1), before or after they are made.

    Parameters
    ----------
    problem : whose unknowns they are; the sweeps need not be among its own.
    plans : the sweeps, each with errors of its own.
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
    found = np.zeros((len(draws), at.size, at.size))
    for channels in _by_channel(problem, plans, at, draws).values():
        for channel in channels:
            found += weighed(channel.readings, channel.slopes)[0]
    return found


def information_together(problem: Problem, plans: Sequence[SweepPlan], at: FloatArray, draws: FloatArray) -> FloatArray:
    """Say what presses of one specimen under one ball tell together, which share what the model leaves out: (1) with (2).

    Parameters
    ----------
    problem, at, draws : as in `expected_information`.
    plans : the sweeps, the first of which has the correlation length.

    Returns
    -------
    As `expected_information`; of one sweep the same, but for what the low rank of its covariance leaves out.

    Raises
    ------
    OutOfRangeError
        As in `expected_information`.
    """
    found = np.zeros((len(draws), at.size, at.size))
    for channels in _by_channel(problem, plans, at, draws).values():
        slopes = np.concatenate([channel.slopes for channel in channels])
        depth = np.maximum(np.concatenate([channel.depth for channel in channels]), 0.0)
        length = CORRELATION_LENGTH * max(float(np.max(channels[0].depth)), 1e-9)
        alike = np.exp(-0.5 * ((depth[:, None] - depth) / length) ** 2)
        own = [_own_variance(channel.readings) for channel in channels]
        error = np.concatenate([channel.readings.error for channel in channels], axis=1)
        sd = np.concatenate([_discrepancy_sd(channel.readings) for channel in channels], axis=1)
        covariance = error @ np.swapaxes(error, 1, 2) + sd[:, :, None] * alike * sd[:, None, :]  # (2)
        covariance[:, np.arange(depth.size), np.arange(depth.size)] += np.concatenate(own, axis=1)
        found += slopes.T @ np.linalg.solve(covariance, np.broadcast_to(slopes, (len(draws), *slopes.shape)))
    return found


def _discrepancy_sd(readings: PredictedReadings) -> FloatArray:
    """Standard deviation of the discrepancy at each point, (n_draw, n_point)."""
    return np.zeros_like(readings.variance) if readings.discrepancy is None else readings.discrepancy.sd


def _own_variance(readings: PredictedReadings) -> FloatArray:
    """Variance of the noise alone: without what the low rank of the discrepancy leaves to single points, (n_draw, n_point)."""
    rest = 0.0 if readings.discrepancy is None else readings.discrepancy.sd**2 * readings.discrepancy.correlation.rest
    return np.asarray(readings.variance - rest, dtype=float)


def _by_channel(problem: Problem, plans: Sequence[SweepPlan], at: FloatArray, draws: FloatArray) -> dict[str, list[_Channel]]:
    """Differentiate the readings of sweeps at a point, and find their covariance at draws of the scales, channel by channel."""
    step = STEP * np.eye(at.size)
    scales = np.array([p.parameter in SCALES for p in problem.parameters])
    wide = np.where(scales, draws, at)
    around = at + np.concatenate([0 * step[:1], step, -step])
    of_steps = model_sweeps(problem, problem.forward, plans, values_at(problem, around))
    of_draws = model_sweeps(problem, problem.forward, plans, values_at(problem, wide))
    found: dict[str, list[_Channel]] = {}
    for plan, near, far in zip(plans, of_steps, of_draws, strict=True):
        if not near.covered[0] or not np.all(far.covered):
            raise OutOfRangeError(f"the {problem.forward.name} does not cover the press of {plan.sweep.title}")
        rows = np.cumsum(near.covered) - 1  # of each step among those that are covered
        for name, channel in near.channels.items():
            slope = np.where(scales, 0.0, central_slope(channel.mean[rows], near.covered).T)
            found.setdefault(name, []).append(_Channel(slope, channel.depth[rows[0]], far.channels[name]))
    return found
