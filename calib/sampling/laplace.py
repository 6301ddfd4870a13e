"""A calibration problem in, a first answer in tenths of a second out: means and standard deviations, from one mode.

At a mode of the posterior the readings m are taken as linear in all unknowns r but the scales u (noises and discrepancies),
m(r) = m + M (r - r_mode). Given u the posterior of r is normal then, and so known together with how probable u is,

    A(u) = P + M^T S(u)^-1 M,   b(u) = g + M^T S(u)^-1 (y - m),                                                       (1)
    log p(u | y) = -(log det S + (y - m)^T S^-1 (y - m) - b^T A^-1 b + log det A + u^T u) / 2,

with S the covariance of the readings, g and P the slope and the bend of the prior. The scales are what makes the posterior a
funnel, so they are drawn, in rounds of importance sampling, and the rest is drawn given them. In the end each draw is weighted
by its exact density, which mends what is not linear, priors' own shapes included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.catalogue import SCALES
from calib.problem import PredictedReadings, Problem, chi_square, columns_at, model_sweeps, values_at
from calib.sampling.coordinates import Coordinates, coordinates
from calib.sampling.diagnostics import FirstAnswer, FirstEstimate
from calib.sampling.scoring import STEP, central_slope, inverse_root, score, slopes_at
from models.sensor import FloatArray, IntArray

# Seed of the draws, of which many are made so that the answer hardly depends on it.
_SEED = 20190304
# Prior draws among which climbs begin, the most probable first, and most climbs until one meets the best mode so far: of those
# that begin anywhere about one in eight ends at a false mode.
_STARTS, _CLIMBS = 128, 8
# A mode is plausible with a misfit no further above its expectation than this, in its standard deviations, and with scales no
# higher in their priors than this.
_BEYOND, _HIGH_SCALE = 5.0, 2.0
# Draws of the scales in each round that finds out where they lie, and by how much the first of them is wider than at the mode.
_ROUNDS, _WIDEN = (160, 160), 1.5
# Degrees of freedom of the Student densities that they are drawn from, and by how much these are wider than the last draws.
_FREEDOM, _MARGIN = 5.0, 1.1
# Draws of all unknowns: so many at a time, until so many effective ones are there, or so many in all.
_AT_ONCE, _EFFECTIVE, _MOST = 700, 400.0, 2800
# Of more unknowns than this, those of many specimens, it would neither be fast nor have draws of any weight.
_MOST_UNKNOWNS = 100
# Of fewer effective draws than this nothing is said.
_TOO_FEW = 10.0
# Numbers in the matrices of (1) that are held at a time: of many unknowns fewer draws are made at once.
_HELD = 2e7


def first_answer(problem: Problem) -> FirstAnswer:
    """Estimate what a calibration will find, in tenths of a second: a first answer, not the result.

    It rests on one mode: whether there are others, and whether the forward model is honest, only `sample` and the spot check
    tell. Where the posterior is as this problem's usually are, means come out within a tenth of a standard deviation and
    standard deviations within a tenth.

    Parameters
    ----------
    problem : from `build_problem`.

    Raises
    ------
    ValueError
        If every unknown is fixed, there are more than a hundred, or the posterior is so far from what
        was taken for it that there is no answer.
    """
    if not problem.parameters:
        raise ValueError("every parameter is fixed: there is nothing to estimate")
    if len(problem.parameters) > _MOST_UNKNOWNS:
        raise ValueError(f"there is no first answer for {len(problem.parameters)} unknowns, only for {_MOST_UNKNOWNS} at most")
    space = coordinates(problem)
    n = len(problem.parameters)
    rng = np.random.default_rng(_SEED)
    mode, confirmed = _highest(space, rng)
    given = _linearised(space, mode)
    centre, spread = mode[given.scales], _WIDEN * _spread_of_scales(space, mode, given.scales)
    for count in _ROUNDS:
        u, log_student = _student(rng, count, centre, spread)
        weight = _weights(_given_scales(given, u).log_density - log_student)
        centre, spread = _fitted(u, weight)
    x: FloatArray = np.empty((0, n))
    log_ratio: FloatArray = np.empty(0)
    effective = 0.0
    while effective < _EFFECTIVE and len(x) < _MOST:
        more, log_proposal = _draws(given, rng, centre, spread)
        x = np.concatenate([x, more])
        log_ratio = np.concatenate([log_ratio, space.log_density(more) - log_proposal])
        weight = _weights(log_ratio)
        effective = 1 / float(np.sum(weight**2))
    if effective < _TOO_FEW:
        raise ValueError("there is no first answer: the posterior is not nearly normal, whatever noises and discrepancies are")
    theta, _ = space.to_theta(x)
    there = np.isfinite(log_ratio)
    values, weight = columns_at(problem, theta[there]), weight[there]
    mean = weight @ values
    sd = np.sqrt(weight @ (values - mean) ** 2)
    found = {name: FirstEstimate(float(m), float(s)) for name, m, s in zip(problem.names, mean, sd, strict=True)}
    return FirstAnswer(found, effective, confirmed)


@dataclass(frozen=True, eq=False)
class _Linearised:
    """A posterior near its mode x (n,): of its coordinates `scales` are u and `rest` r of (1).

    `gradient` and `bend` are g and P of (1); `misfits` and `slopes` are y - m (n_point,) and M (n_point, n_rest) of each
    channel of each sweep.
    """

    space: Coordinates
    x: FloatArray
    scales: IntArray
    rest: IntArray
    gradient: FloatArray
    bend: FloatArray
    misfits: tuple[FloatArray, ...]
    slopes: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class _Given:
    """What is known of r given draws of u: log p(u | y) (n_draw,), the Cholesky factors L of A and L^-1 b of (1)."""

    log_density: FloatArray
    factor: FloatArray
    whitened: FloatArray


def _highest(space: Coordinates, rng: np.random.Generator) -> tuple[FloatArray, bool]:
    """A mode (n,) at which nothing speaks against it, or the highest of a few climbs; and whether it can be relied on."""
    n = len(space.problem.parameters)
    best, top, _ = score(space, space.from_theta(np.zeros((1, n)))[0])
    if _plausible(space, best):
        return best, True
    draws = space.from_theta(rng.standard_normal((_STARTS, n)))
    density = space.log_density(draws)
    likely = draws[np.argsort(-np.where(np.isfinite(density), density, -np.inf))][
        : min(_CLIMBS - 1, np.sum(np.isfinite(density)))
    ]
    for x in likely:
        mode, value, met = score(space, x, [(best, top)])
        if met is not None:
            return best, True
        if value > top:
            best, top = mode, value
    return best, False


def _plausible(space: Coordinates, x: FloatArray) -> bool:
    """Whether a mode describes the readings, without noises and discrepancies that nobody expected: a false one does not."""
    problem = space.problem
    theta, _ = space.to_theta(x[None])
    models = model_sweeps(problem, problem.forward, problem.plans, values_at(problem, theta))
    channels = [channel for model in models for channel in model.channels.values()]
    misfit = sum(float(chi_square(channel)[0]) for channel in channels)
    n_point = sum(channel.observed.size for channel in channels)
    scales = [z for z, p in zip(theta[0], problem.parameters, strict=True) if p.parameter in SCALES]
    return misfit < n_point + _BEYOND * np.sqrt(2 * n_point) and max(scales, default=0.0) < _HIGH_SCALE


def _linearised(space: Coordinates, x: FloatArray) -> _Linearised:
    """Differentiate prior and readings at a mode."""
    problem, n = space.problem, x.size
    step = STEP * np.eye(n)
    theta, log_jacobian = space.to_theta(x + np.concatenate([np.zeros((1, n)), step, -step]))
    there = np.isfinite(log_jacobian)
    values = values_at(problem, np.where(there[:, None], theta, 0.0))
    models = list(model_sweeps(problem, problem.forward, problem.plans, values))
    for model in models:
        there &= model.covered
    scales = np.flatnonzero([p.parameter in SCALES for p in problem.parameters])
    rest = np.setdiff1d(np.arange(n), scales)
    across = central_slope(theta, there)[rest]
    misfits, slopes = [], []
    for model in models:
        rows = np.cumsum(model.covered) - 1  # of each draw among those that are covered
        for channel in model.channels.values():
            misfits.append(channel.observed - channel.mean[rows[0]])
            slopes.append(central_slope(channel.mean[rows], there)[rest].T)
    gradient = central_slope(log_jacobian - 0.5 * np.sum(theta**2, axis=1), there)[rest]
    return _Linearised(space, x, scales, rest, gradient, across @ across.T, tuple(misfits), tuple(slopes))


def _spread_of_scales(space: Coordinates, x: FloatArray, scales: IntArray) -> FloatArray:
    """A root of the covariance of the scales at the mode, (n_scale, n_scale)."""
    slopes = slopes_at(space, x, 1.0)
    if slopes is None:
        return np.eye(scales.size)
    factor = inverse_root(slopes[1])[scales]
    return np.asarray(np.linalg.cholesky(factor @ factor.T), dtype=float)


def _given_scales(given: _Linearised, u: FloatArray) -> _Given:
    """Equations (1) at draws u (n_draw, n_scale) of the scales."""
    problem = given.space.problem
    x = np.tile(given.x, (len(u), 1))
    x[:, given.scales] = u
    theta, _ = given.space.to_theta(x)
    a = np.tile(given.bend, (len(u), 1, 1))
    b = np.tile(given.gradient, (len(u), 1))
    log_density = -0.5 * np.sum(u**2, axis=1)
    models = model_sweeps(problem, problem.forward, problem.plans, values_at(problem, theta))
    channels = (channel for model in models for channel in model.channels.values())
    for channel, misfit, slope in zip(channels, given.misfits, given.slopes, strict=True):
        product, log_det = _weighed(channel, np.concatenate([slope, misfit[:, None]], axis=1))
        a += product[:, :-1, :-1]
        b += product[:, :-1, -1]
        log_density -= 0.5 * (product[:, -1, -1] + log_det)
    factor = np.asarray(np.linalg.cholesky(a), dtype=float)
    whitened = np.asarray(np.linalg.solve(factor, b[..., None])[..., 0], dtype=float)
    log_density += 0.5 * np.sum(whitened**2, axis=1) - _log_diagonal(factor)
    return _Given(log_density, factor, whitened)


def _weighed(channel: PredictedReadings, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """C^T S^-1 C (n_draw, k, k) of columns C (n_point, k), and log det S (n_draw,), S of low rank (Woodbury)."""
    modes = channel.modes
    weighted = modes / channel.variance[..., None]
    inner = np.asarray(np.linalg.cholesky(np.eye(modes.shape[-1]) + np.swapaxes(modes, 1, 2) @ weighted), dtype=float)
    shared = np.linalg.solve(inner, np.swapaxes(weighted, 1, 2) @ columns)
    own = (columns.T / channel.variance[:, None, :]) @ columns
    log_det = np.sum(np.log(channel.variance), axis=1) + 2 * _log_diagonal(inner)
    return own - np.swapaxes(shared, 1, 2) @ shared, log_det


def _log_diagonal(factors: FloatArray) -> FloatArray:
    """Sums of the logarithms on the diagonals of triangular factors (n, k, k), (n,)."""
    return np.asarray(np.sum(np.log(np.diagonal(factors, axis1=1, axis2=2)), axis=1), dtype=float)


def _draws(
    given: _Linearised, rng: np.random.Generator, centre: FloatArray, spread: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Draws x (n_draw, n) of the scales, and of the rest given them, and the log density they are drawn from (n_draw,)."""
    u, log_student = _student(rng, int(np.clip(_HELD / given.x.size**2, 50, _AT_ONCE)), centre, spread)
    of_rest = _given_scales(given, u)
    normal = rng.standard_normal(of_rest.whitened.shape)
    away = np.linalg.solve(np.swapaxes(of_rest.factor, 1, 2), (of_rest.whitened + normal)[..., None])[..., 0]
    x = np.empty((len(u), given.x.size))
    x[:, given.scales], x[:, given.rest] = u, given.x[given.rest] + away
    return x, log_student - 0.5 * np.sum(normal**2, axis=1) + _log_diagonal(of_rest.factor)


def _student(rng: np.random.Generator, n_draw: int, centre: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Draws (n_draw, n) of a Student density about a centre, and its logarithm there, up to a constant."""
    n = centre.size
    t = rng.standard_normal((n_draw, n)) / np.sqrt(rng.chisquare(_FREEDOM, n_draw) / _FREEDOM)[:, None]
    return centre + t @ spread.T, -0.5 * (_FREEDOM + n) * np.log1p(np.sum(t**2, axis=1) / _FREEDOM)


def _weights(log_ratio: Sequence[float] | FloatArray) -> FloatArray:
    """Weights that sum to 1, none above the root of their number (Ionides, J. Comput. Graph. Stat. 17 (2008) 295)."""
    ratio = np.where(np.isfinite(log_ratio), log_ratio, -np.inf)
    weight = np.exp(ratio - np.max(ratio))
    weight = np.minimum(weight, np.mean(weight) * np.sqrt(weight.size))
    return np.asarray(weight / np.sum(weight), dtype=float)


def _fitted(u: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre and spread of weighted draws (n_draw, n), a little wider than these."""
    centre = weight @ u
    covariance = ((u - centre).T * weight) @ (u - centre)
    return centre, np.asarray(_MARGIN * np.linalg.cholesky(covariance + 1e-9 * np.eye(centre.size)), dtype=float)
