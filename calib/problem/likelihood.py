"""An experiment, its sweeps and a forward model in, a vectorised log posterior over the unknowns out.

The measurement model and its covariance are those of `calib.problem.measurement`; equation numbers refer to it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.lab import Sweep
from calib.problem.measurement import PredictedReadings, SweepModel, SweepPlan, model_sweep
from calib.problem.problem import Problem
from calib.problem.values import Calibrated, values_at
from models.response import Forward
from models.sensor import FloatArray

#: Version of what the log posterior is at given unknowns and data. Raise it with every change that moves its values by more
#: than rounding (measurement model, covariance, priors' coordinates, default priors aside, which are hashed themselves), so
#: that no chain of the earlier density is continued with the later one.
LIKELIHOOD_VERSION = 2

#: Points of a block of `log_likelihood_blocks`, about.
BLOCK_POINTS = 8

_LOG_2_PI = float(np.log(2 * np.pi))


def log_posterior(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log posterior density of draws of the unknowns: how probable they are after the data, which is what the sampler explores.

    log p(theta | data) = log likelihood - theta^T theta / 2, up to a constant: the prior is standard normal in theta.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw,); -inf where `log_likelihood` is.
    """
    return np.asarray(log_likelihood(problem, theta) - 0.5 * np.sum(theta**2, axis=1), dtype=float)


def log_likelihood(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log likelihood of draws of the unknowns: how probable the readings of all sweeps are under them.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw,); -inf for a draw whose design is invalid (a dielectric thicker than half the sensor, an electrode wider than the
    disc) or whose largest depth or force the forward model does not cover.
    """
    return log_likelihood_at(problem, problem.forward, problem.plans, values_at(problem, theta))


def log_likelihood_at(
    known: Calibrated,
    forward: Forward,
    plans: Sequence[SweepPlan],
    values: Mapping[str, FloatArray],
    tables: Sequence[FloatArray | None] | None = None,
) -> FloatArray:
    """Log likelihood of given sweeps at given values under any forward model, such as finite elements for the surrogate.

    Parameters
    ----------
    known : the experiment and all its sweeps: a `Problem` or a `Posterior`.
    forward : the model of the sensor.
    plans : the sweeps to sum over, from `plan_sweep`.
    values : parameter name -> SI values (n_draw,), fixed ones included.
    tables : one for each plan, see `model_sweep`.

    Returns
    -------
    (n_draw,); -inf as in `log_likelihood`.
    """
    total = np.zeros(next(iter(values.values())).size)
    for plan, table in zip(plans, tables or [None] * len(plans), strict=True):
        model = model_sweep(known, forward, plan, values, table)
        total[~model.covered] = -np.inf
        for channel in model.channels.values():
            total[model.covered] += _log_normal(channel)
    return total


def log_likelihood_blocks(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log density of each block of about eight neighbouring points given all other data, by which models are compared.

    log p(y_b | y_-b, theta): with Q the inverse of the channel's covariance (4) and r its residuals, the block's conditional
    precision is Q_bb and Q_bb^-1 (Q r)_b its residual (Buerkner, Gabry, Vehtari, Comput. Stat. 36 (2021) 1243, Eq. 10-13).
    This is what leave-block-out needs where residuals are correlated; only without correlation do the blocks add up to
    `log_likelihood`.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw, n_block), in the order of `block_names`; -inf for draws that are not covered.
    """
    values = values_at(problem, theta)
    columns = []
    for plan in problem.plans:
        model = model_sweep(problem, problem.forward, plan, values)
        for channel in model.channels.values():
            block = np.full((theta.shape[0], len(_blocks(channel.observed.size))), -np.inf)
            block[model.covered] = _log_normal_blocks(channel)
            columns.append(block)
    return np.concatenate(columns, axis=1)


def given_other_points(channel: PredictedReadings) -> tuple[FloatArray, FloatArray]:
    """What each point of a channel should read if all its other points are known: mean and variance, (n_covered, n_point).

    With Q the inverse of the covariance (4) and r the residuals it is normal with mean y_i - (Q r)_i / Q_ii and variance
    1 / Q_ii (Buerkner, Gabry, Vehtari, Comput. Stat. 36 (2021) 1243, Eq. 10-13).

    Returns
    -------
    mean, variance : SI; nan where Q_ii is lost in rounding, as in `_log_normal`.
    """
    scale = np.sqrt(channel.variance)
    residual = (channel.observed - channel.mean) / scale
    modes = channel.modes / scale[..., None]
    across = np.swapaxes(modes, 1, 2)
    # Woodbury, in units of the noise: Q = 1 - W (1 + W^T W)^-1 W^T.
    gain = _solve(np.eye(modes.shape[-1]) + np.matmul(across, modes), across)
    q = 1 - np.sum(modes * np.swapaxes(gain, 1, 2), axis=-1)
    q = np.where(q > 0, q, np.nan)
    weighted = residual - np.matmul(modes, np.matmul(gain, residual[..., None]))[..., 0]
    return channel.observed - scale * weighted / q, channel.variance / q


def log_likelihood_points(channel: PredictedReadings) -> FloatArray:
    """Log density of each point of a channel given all its other points and the draw, (n_covered, n_point).

    log p(y_i | y_-i, theta), what leave-one-out needs where residuals are correlated, see `given_other_points`: blocks of one
    point of `log_likelihood_blocks`. -inf where rounding leaves nothing of it.
    """
    mean, variance = given_other_points(channel)
    density = -0.5 * ((channel.observed - mean) ** 2 / variance + np.log(variance) + _LOG_2_PI)
    return np.where(np.isfinite(density), density, -np.inf)


def block_names(problem: Problem) -> tuple[str, ...]:
    """Names of the blocks of `log_likelihood_blocks`: specimen, sweep, channel and number."""
    names = []
    for plan in problem.plans:
        for channel, points in plan.sweep.channels.items():
            names += [f"{plan.sweep.title}, {channel} {k + 1}" for k in range(len(_blocks(points.value.size)))]
    return tuple(names)


def predict_sweep(problem: Problem, values: Mapping[str, FloatArray], sweep: Sweep) -> SweepModel:
    """Predict what the instruments should read at the points of one sweep, with the forward model of the problem.

    Parameters
    ----------
    problem : from `build_problem`.
    values : parameter name -> SI values (n_draw,), fixed ones included.
    sweep : one of the problem's.
    """
    plan = next(p for p in problem.plans if (p.sweep.specimen, p.sweep.name) == (sweep.specimen, sweep.name))
    return model_sweep(problem, problem.forward, plan, values)


def range_use(problem: Problem, theta: FloatArray) -> FloatArray:
    """How much of the forward model's range draws use: their deepest point over all sweeps relative to the deepest it covers.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    [1], (n_draw,); a draw above 1 is not covered.
    """
    values = values_at(problem, theta)
    uses = [model_sweep(problem, problem.forward, plan, values).range_use for plan in problem.plans]
    return np.asarray(np.max(uses, axis=0), dtype=float)


def _log_normal(channel: PredictedReadings) -> FloatArray:
    """Log density of the observed readings, covariance D + W W^T, (n_draw,).

    With A = [W r]^T D^-1 [W r] + 1 = L L^T the last diagonal element of L is the root of 1 + r^T (D + W W^T)^-1 r (Woodbury)
    and the product of the others squared is det(D + W W^T) / det D.

    The density is -inf where the model error exceeds the noise by so much (1e8 times) that A is not positive definite in double
    precision. A search may pass there, at a modulus of 1e20 Pa; no posterior holds such a draw.
    """
    residual = channel.observed - channel.mean
    stacked = np.concatenate([channel.modes, residual[..., None]], axis=-1) / np.sqrt(channel.variance)[..., None]
    gram = np.matmul(np.swapaxes(stacked, 1, 2), stacked)
    k = gram.shape[-1]
    gram[:, np.arange(k), np.arange(k)] += 1.0
    diagonal = _cholesky_diagonal(gram)
    log_det = np.sum(np.log(channel.variance), axis=1) + 2 * np.sum(np.log(diagonal[:, :-1]), axis=1)
    density = -0.5 * (log_det + diagonal[:, -1] ** 2 - 1.0 + residual.shape[1] * _LOG_2_PI)
    return np.where(np.isfinite(density), density, -np.inf)


def _cholesky_diagonal(matrices: FloatArray) -> FloatArray:
    """Diagonals (n, k) of the Cholesky factors of (n, k, k) matrices; inf for one that is not positive definite."""
    try:
        return np.diagonal(np.linalg.cholesky(matrices), axis1=1, axis2=2)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(matrices.shape[:2], np.inf)
        half = len(matrices) // 2
        return np.concatenate([_cholesky_diagonal(matrices[:half]), _cholesky_diagonal(matrices[half:])])


def _solve(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions (n, k, m) of systems (n, k, k) with right sides (n, k, m); nan for one whose matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right), dtype=float)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan)
        half = len(matrices) // 2
        return np.concatenate([_solve(matrices[:half], right[:half]), _solve(matrices[half:], right[half:])])


def _log_normal_blocks(channel: PredictedReadings) -> FloatArray:
    """Log density of each block given the rest of the channel, (n_draw, n_block), see `log_likelihood_blocks`."""
    scale = np.sqrt(channel.variance)
    residual = (channel.observed - channel.mean) / scale
    modes = channel.modes / scale[..., None]
    precision = np.linalg.inv(np.eye(residual.shape[1]) + np.matmul(modes, np.swapaxes(modes, 1, 2)))
    weighted = np.matmul(precision, residual[..., None])
    columns = []
    for block in _blocks(residual.shape[1]):
        q = precision[:, block[:, None], block]
        g = weighted[:, block]
        square = np.matmul(np.swapaxes(g, 1, 2), np.linalg.solve(q, g))[:, 0, 0]
        log_det = np.linalg.slogdet(q)[1] - np.sum(np.log(channel.variance[:, block]), axis=1)
        columns.append(0.5 * (log_det - square - block.size * _LOG_2_PI))
    return np.stack(columns, axis=1)


def _blocks(n_point: int) -> list[np.ndarray[tuple[int], np.dtype[np.intp]]]:
    """Indices of neighbouring points, about `BLOCK_POINTS` in each block."""
    return list(np.array_split(np.arange(n_point), max(1, round(n_point / BLOCK_POINTS)))) if n_point else []
