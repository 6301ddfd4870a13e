"""An experiment, its sweeps and a forward model in, a vectorised log posterior over the unknowns out.

The measurement model and its covariance are those of `calib.problem.measurement`; equation numbers refer to it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calib.errors import Fault, InputError
from calib.experiment.plan import Experiment
from calib.lab.sweep import Sweep
from calib.problem.measurement import Channel, SweepModel, SweepPlan, model_sweep, plan_sweep, why_outside
from calib.problem.parameters import Calibrated, ParameterInfo, list_parameters, sweep_title, tied_by
from models.response import Forward
from models.sensor import FloatArray

__all__ = [
    "Channel",
    "ParameterInfo",
    "Problem",
    "SweepModel",
    "block_names",
    "build_problem",
    "given_other_points",
    "log_likelihood",
    "log_likelihood_at",
    "log_likelihood_blocks",
    "log_likelihood_points",
    "log_posterior",
    "named_values",
    "physical",
    "predict_sweep",
    "range_use",
]

#: Points of a block of `log_likelihood_blocks`, about.
BLOCK_POINTS = 8

#: Prior draws with which `build_problem` checks what the forward model covers.
_N_PRIOR_CHECK = 512

_LOG_2_PI = float(np.log(2 * np.pi))


@dataclass(frozen=True, eq=False)
class Problem:
    """A calibration ready to be sampled: unknowns with their priors, data, forward model.

    theta is the vector of standard-normal coordinates of the priors of `parameters`, value = prior.ppf_normal(z), so that
    the log prior is -z^2/2 summed. `fixed` holds what a prior fixed.
    """

    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    forward: Forward
    parameters: tuple[ParameterInfo, ...]
    fixed: Mapping[str, float]
    plans: tuple[SweepPlan, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, in the order of theta."""
        return tuple(p.name for p in self.parameters)


# --- values of the unknowns ---------------------------------------------------------------------------------------------


class Unknowns(Protocol):
    """What has unknowns with their priors: a `Problem` or a `Posterior`."""

    @property
    def parameters(self) -> tuple[ParameterInfo, ...]:
        """The unknowns, in the order of theta."""
        ...

    @property
    def fixed(self) -> Mapping[str, float]:
        """What a prior fixed."""
        ...


def physical(problem: Unknowns, theta: FloatArray) -> FloatArray:
    """SI values (n_draw, n_parameter) at standard-normal coordinates `theta` of the same shape."""
    columns = [p.prior.ppf_normal(theta[:, k]) for k, p in enumerate(problem.parameters)]
    return np.stack(columns, axis=1) if columns else np.empty(theta.shape)


def named_values(problem: Unknowns, theta: FloatArray) -> dict[str, FloatArray]:
    """Parameter name -> SI values (n_draw,), fixed ones included."""
    values = {p.name: p.prior.ppf_normal(theta[:, k]) for k, p in enumerate(problem.parameters)}
    return values | {name: np.full(theta.shape[0], value) for name, value in problem.fixed.items()}


# --- probabilities ------------------------------------------------------------------------------------------------------


def log_posterior(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log posterior density in the coordinates theta, up to a constant, (n_draw,); -inf outside what the forward covers."""
    return np.asarray(log_likelihood(problem, theta) - 0.5 * np.sum(theta**2, axis=1), dtype=float)


def log_likelihood(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log likelihood (n_draw,) of all sweeps at theta (n_draw, n_parameter).

    -inf for a draw whose design is invalid (a dielectric thicker than half the sensor, an electrode wider than the disc) or
    whose largest depth or force the forward model does not cover.
    """
    return log_likelihood_at(problem, problem.forward, problem.plans, named_values(problem, theta))


def log_likelihood_at(
    known: Calibrated,
    forward: Forward,
    plans: Sequence[SweepPlan],
    values: Mapping[str, FloatArray],
    tables: Sequence[FloatArray | None] | None = None,
) -> FloatArray:
    """Log likelihood (n_draw,) of the sweeps `plans` under any forward model; -inf as in `log_likelihood`.

    Parameters
    ----------
    values : parameter name -> SI values (n_draw,), fixed ones included.
    tables : one for each plan, see `model_sweep`.
    """
    total = np.zeros(next(iter(values.values())).size)
    for plan, table in zip(plans, tables or [None] * len(plans), strict=True):
        model = model_sweep(known, forward, plan, values, table)
        total[~model.covered] = -np.inf
        for channel in model.channels:
            total[model.covered] += _log_normal(channel)
    return total


def log_likelihood_blocks(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log density of each block of about eight neighbouring points given all other data, (n_draw, n_block), see `block_names`.

    log p(y_b | y_-b, theta): with Q the inverse of the channel's covariance (4) and r its residuals, the block's conditional
    precision is Q_bb and Q_bb^-1 (Q r)_b its residual (Buerkner, Gabry, Vehtari, Comput. Stat. 36 (2021) 1243, Eq. 10-13).
    This is what leave-block-out needs where residuals are correlated; only without correlation do the blocks add up to
    `log_likelihood`. -inf for draws that are not covered.
    """
    values = named_values(problem, theta)
    columns = []
    for plan in problem.plans:
        model = model_sweep(problem, problem.forward, plan, values)
        for channel in model.channels:
            block = np.full((theta.shape[0], len(_blocks(channel.observed.size))), -np.inf)
            block[model.covered] = _log_normal_blocks(channel)
            columns.append(block)
    return np.concatenate(columns, axis=1)


def given_other_points(channel: Channel) -> tuple[FloatArray, FloatArray]:
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


def log_likelihood_points(channel: Channel) -> FloatArray:
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
        s = plan.sweep
        for channel, points in (("force", s.force), ("capacitance", s.capacitance)):
            n = points.n_effective.size if points is not None else 0
            names += [f"{sweep_title(s)}, {channel} {k + 1}" for k in range(len(_blocks(n)))]
    return tuple(names)


def predict_sweep(problem: Problem, values: Mapping[str, FloatArray], sweep: Sweep) -> SweepModel:
    """Model of the readings of `sweep` at its data points for draws `values` (name -> SI, (n_draw,)), fixed ones included."""
    plan = next(p for p in problem.plans if (p.sweep.specimen, p.sweep.name) == (sweep.specimen, sweep.name))
    return model_sweep(problem, problem.forward, plan, values)


def range_use(problem: Problem, theta: FloatArray) -> FloatArray:
    """Deepest point over all sweeps relative to the deepest the forward model covers, (n_draw,); above 1 is not covered."""
    values = named_values(problem, theta)
    uses = [model_sweep(problem, problem.forward, plan, values).range_use for plan in problem.plans]
    return np.asarray(np.max(uses, axis=0), dtype=float)


def _log_normal(channel: Channel) -> FloatArray:
    """Log density of the observed readings, covariance D + W W^T, (n_draw,).

    With A = [W r]^T D^-1 [W r] + 1 = L L^T the last diagonal element of L is the root of 1 + r^T (D + W W^T)^-1 r (Woodbury)
    and the product of the others squared is det(D + W W^T) / det D.

    -inf where model error exceeds noise by so much (sd 1e8 times) that A is not positive definite in double precision: a
    modulus of 1e20 Pa on the way of a search, nothing that a posterior holds.
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


def _log_normal_blocks(channel: Channel) -> FloatArray:
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


# --- building a problem -------------------------------------------------------------------------------------------------


def build_problem(experiment: Experiment, sweeps: Sequence[Sweep], forward: Forward) -> Problem:
    """The calibration problem of an experiment: unknowns listed, data prepared, and the forward model's range checked.

    Raises
    ------
    InputError
        If a sweep has no readings or nothing that ties its capacitance to depth; if at the prior medians a design is
        invalid, or a design or its sweep's depth lies outside what the forward model covers; or if more than half of the
        prior's draws do.
    """
    faults = [Fault(problem, experiment.path, advice=advice) for s in sweeps for problem, advice in _unusable(s)]
    if not sweeps:
        faults.append(Fault("there is no sweep to calibrate with", experiment.path))
    if faults:
        raise InputError(faults)
    parameters, fixed = list_parameters(experiment, sweeps)
    problem = Problem(experiment, tuple(sweeps), forward, parameters, fixed, tuple(plan_sweep(s) for s in sweeps))
    if faults := _outside_faults(problem):
        raise InputError(faults)
    return problem


def _unusable(sweep: Sweep) -> list[tuple[str, str]]:
    where = f"sweep of {sweep_title(sweep)}"
    if sweep.force is None and sweep.capacitance is None:
        return [(f"{where} has neither force nor capacitance readings", "Leave it out")]
    if sweep.capacitance is not None and not tied_by(sweep):
        return [
            (
                f"{where}: nothing tells how deep the ball was at the capacitance readings",
                "Give a force file with a time column beside it, or a force or displacement column in the capacitance file",
            )
        ]
    return []


def _outside_faults(problem: Problem) -> list[Fault]:
    """What of the prior the forward model does not cover, as faults."""
    n = len(problem.parameters)
    draws = np.random.default_rng(20190304).standard_normal((_N_PRIOR_CHECK, n))
    faults = []
    for theta, share_allowed in ((np.zeros((1, n)), 0.0), (draws, 0.5)):
        values = named_values(problem, theta)
        for plan in problem.plans:
            covered = model_sweep(problem, problem.forward, plan, values).covered
            share = 1 - float(np.mean(covered))
            if share <= share_allowed:
                continue
            where = f"the sweep of {sweep_title(plan.sweep)}"
            first = int(np.argmin(covered))
            single = {name: value[first : first + 1] for name, value in values.items()}
            reason = why_outside(problem, problem.forward, plan, single)
            at = "at the prior medians" if share_allowed == 0 else f"for {share:.0%} of the prior's draws"
            faults.append(
                Fault(
                    f"{where} lies outside what the {problem.forward.name} covers {at}: {reason}",
                    problem.experiment.path,
                    advice="Check thicknesses, ball radius and contact_offset, narrow their priors, or use a smaller depth",
                )
            )
        if faults:
            break
    return faults
