"""From any point under the prior to a mode of the posterior: Fisher scoring, on a likelihood that is let in step by step.

Readings y of a channel are normal with mean m and covariance S, both of which depend on the unknowns x. Their expected second
derivatives need first derivatives alone (Mardia & Marshall, Biometrika 71 (1984) 135):

    I_kl = m_k^T S^-1 m_l + tr(S^-1 S_k S^-1 S_l) / 2                                                               (1)

so that a step costs 2 n + 1 evaluations for n unknowns, where a Hessian by differences costs 2 n^2 + 1, and I is positive
definite everywhere. The second term is taken for the scales alone, noises and discrepancies: for the others it is next to
nothing beside the first. Far from the mode the likelihood of thousands of readings has ridges so sharp that steps follow them
into false modes; to a small power, which grows to 1, it has not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calib.catalogue import SCALES
from calib.problem import PredictedReadings, log_likelihood, log_normal, model_sweeps, values_at
from calib.sampling.coordinates import Coordinates
from models.sensor import BoolArray, FloatArray, IntArray

# Powers of the likelihood, and most steps at each; the last is the posterior.
_POWERS = ((1e-5, 10), (1e-4, 10), (1e-3, 10), (1e-2, 10), (1e-1, 10), (1.0, 100))
# A climb goes on while a step gains this much in the tempered log density: at the powers below 1, and at the last.
_GAIN, _LAST_GAIN = 1.0, 1e-2
# Steps are tried at these lengths, as they are; where none leads up, with the diagonal of the information enlarged by these
# shares of itself (Levenberg & Marquardt).
_LENGTHS = 0.5 ** np.arange(-1, 9)
_DAMPING = ((0.0,), (1e-2, 1.0, 1e2))
# Step of the differences in x, which is about as wide as the prior: readings bend over more than 1e-3 of it.
_WIDTH = 1e-4


def score(
    space: Coordinates, x: FloatArray, known: Sequence[tuple[FloatArray, float]] = ()
) -> tuple[FloatArray, float, int | None]:
    """Climb to a mode of the posterior from a point anywhere under the prior.

    Parameters
    ----------
    space : coordinates of the problem.
    x : (n_parameter,), a point of finite posterior density.
    known : modes found before, and their log density: a climb that comes near one of them is not taken to its end.

    Returns
    -------
    The mode, (n_parameter,), its log posterior density in `space`, and the number of the known one that was met, or None. A
    climb may end at a false mode: of eight draws from the prior about one does, so climb from several.
    """
    for power, most in _POWERS:
        value = float(tempered(space, x[None], power)[0])
        for _ in range(most):
            slopes = slopes_at(space, x, power)
            if slopes is None:
                break
            if power == 1:
                met = _met(x, value, slopes[1], known)
                if met is not None:
                    return x, value, met
            gain = 0.0
            for damping in _DAMPING:
                tried = x + _steps(*slopes, damping)
                values = tempered(space, tried, power)
                best = int(np.argmax(values))
                gain = float(values[best]) - value
                if gain > 0:
                    x, value = tried[best], float(values[best])
                    break
            if not gain > (_LAST_GAIN if power == 1 else _GAIN):
                break
    return x, value, None


def _met(x: FloatArray, value: float, information: FloatArray, known: Sequence[tuple[FloatArray, float]]) -> int | None:
    """The known mode that a climb is about to reach: as near, and as little below it, as draws of the posterior are."""
    for k, (mode, top) in enumerate(known):
        apart = mode - x
        if value > top - 0.5 * x.size and float(apart @ information @ apart) < x.size:
            return k
    return None


def inverse_root(information: FloatArray) -> FloatArray:
    """A square root S of a covariance S S^T, (n, n), from its inverse (n, n); no direction is wider than the prior."""
    eigenvalue, vector = np.linalg.eigh(information)
    return np.asarray(vector / np.sqrt(np.maximum(eigenvalue, 1.0)), dtype=float)


def _steps(gradient: FloatArray, information: FloatArray, damping: Sequence[float]) -> FloatArray:
    """Scoring steps with each damping at each length, (n_step, n)."""
    scale = np.diag(np.diagonal(information))
    directions = [np.linalg.solve(information + share * scale, gradient) for share in damping]
    return np.concatenate([_LENGTHS[:, None] * direction for direction in directions])


def tempered(space: Coordinates, x: FloatArray, power: float) -> FloatArray:
    """Log density of the prior times a power of the likelihood: a landscape whose ridges are as soft as one likes.

    Parameters
    ----------
    space : coordinates of the problem.
    x : (n_draw, n_parameter).
    power : of the likelihood, 1 for the posterior.

    Returns
    -------
    (n_draw,), in the coordinates x; -inf where there is none.
    """
    theta, log_density = space.to_theta(x)
    possible = np.isfinite(log_density)
    if np.any(possible):
        theta = theta[possible]
        # Far out on a ladder of steps an unknown may be as large as no number is.
        with np.errstate(over="ignore", invalid="ignore"):
            log_density[possible] += power * log_likelihood(space.problem, theta) - 0.5 * np.sum(theta**2, axis=1)
    return np.where(np.isfinite(log_density), log_density, -np.inf)


def slopes_at(space: Coordinates, x: FloatArray, power: float) -> tuple[FloatArray, FloatArray] | None:
    """Tell where up is: the slope of the tempered log density at a point, and how it bends on average over possible readings.

    Differences are central, or one-sided beside the end of the forward model's range.

    Parameters
    ----------
    space : coordinates of the problem.
    x : (n_parameter,).
    power : of the likelihood, 1 for the posterior.

    Returns
    -------
    The gradient (n_parameter,) and the expected negative Hessian by (1); None outside the forward model's range.
    """
    n = x.size
    step = _WIDTH * np.eye(n)
    theta, log_jacobian = space.to_theta(x + np.concatenate([np.zeros((1, n)), step, -step]))
    there = np.isfinite(log_jacobian)
    values = values_at(space.problem, np.where(there[:, None], theta, 0.0))
    models = list(model_sweeps(space.problem, space.problem.forward, space.problem.plans, values))
    for model in models:
        there &= model.covered
    if not there[0]:
        return None
    log_prior = log_jacobian - 0.5 * np.sum(theta**2, axis=1)
    gradient = _slope(log_prior, there)
    across = _slope(theta, there)
    information = across @ across.T
    scales = np.flatnonzero([p.parameter in SCALES for p in space.problem.parameters])
    chosen = np.concatenate([[0], 1 + scales, 1 + n + scales])
    for model in models:
        rows = np.cumsum(model.covered) - 1  # of each draw among those that are covered
        for channel in model.channels.values():
            gradient += power * _slope(log_normal(channel)[rows], there)
            covariance = _covariance(channel, rows[chosen])
            whiten = np.linalg.inv(np.linalg.cholesky(covariance[0]))
            mean_slope = _slope(channel.mean[rows], there) @ whiten.T
            information += power * mean_slope @ mean_slope.T
            spread_slope = whiten @ _slope(covariance, there[chosen]) @ whiten.T
            flat = spread_slope.reshape(scales.size, channel.observed.size**2)
            information[np.ix_(scales, scales)] += 0.5 * power * flat @ flat.T
    return gradient, information


def _covariance(channel: PredictedReadings, rows: IntArray) -> FloatArray:
    """Covariances S of the readings of some draws, (n_row, n_point, n_point)."""
    modes = channel.modes[rows]
    covariance = modes @ np.swapaxes(modes, 1, 2)
    points = np.arange(channel.observed.size)
    covariance[:, points, points] += channel.variance[rows]
    return np.asarray(covariance, dtype=float)


def _slope(values: FloatArray, there: BoolArray) -> FloatArray:
    """Derivatives (n, ...) from values (2 n + 1, ...) at x, x + each step, x - each step, not all of which may be `there`."""
    n = (len(values) - 1) // 2
    shape = (n, *[1] * (values.ndim - 1))
    up, down = there[1 : n + 1].reshape(shape), there[n + 1 :].reshape(shape)
    above = np.where(up, values[1 : n + 1], values[0])
    below = np.where(down, values[n + 1 :], values[0])
    return np.asarray((above - below) / (_WIDTH * np.maximum(1.0 * up + down, 1.0)))
