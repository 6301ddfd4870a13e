"""A calibration problem in, a first answer in tenths of a second out: means and standard deviations, from one mode.

Draws of the density that is close to the posterior round its mode (`calib.sampling.laplace`) are each weighted by their exact
density, which mends what is not linear in it, priors' own shapes included.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.special import logsumexp

from calib.catalogue import SCALES
from calib.problem import Problem, chi_square, columns_at, model_sweeps, values_at
from calib.sampling.coordinates import Coordinates, coordinates
from calib.sampling.findings import FirstAnswer, FirstEstimate
from calib.sampling.laplace import importance_weights, laplace_density
from calib.sampling.scoring import score
from models.sensor import FloatArray

# Seed of the draws, of which many are made so that the answer hardly depends on it.
_SEED = 20190304
# Prior draws among which climbs begin, the most probable first, and most climbs until one meets the best mode so far: of those
# that begin anywhere about one in eight ends at a false mode.
_STARTS, _CLIMBS = 128, 8
# A mode is plausible with a misfit no further above its expectation than this, in its standard deviations, and with scales no
# higher in their priors than this.
_BEYOND, _HIGH_SCALE = 5.0, 2.0
# Draws of all unknowns: so many at a time, until so many effective ones are there, or so many in all.
_AT_ONCE, _EFFECTIVE, _MOST = 700, 400.0, 2800
# Of more unknowns than this, those of many specimens, it would neither be fast nor have draws of any weight.
_MOST_UNKNOWNS = 100
# Of fewer effective draws than this nothing is said.
_TOO_FEW = 10.0


def first_answer(problem: Problem, near: Mapping[str, float] | None = None) -> FirstAnswer:
    """Estimate what a calibration will find, in tenths of a second: a first answer, not the result.

    It rests on one mode: whether there are others, and whether the forward model is honest, only `sample` and the spot check
    tell. Where the posterior is as this problem's usually are, means come out within a tenth of a standard deviation and
    standard deviations within a tenth.

    Parameters
    ----------
    problem : from `build_problem`.
    near : values [SI] by name at which another model describes the same readings: climbed from first, and then no mode is
        looked for that describes the readings better, as there need be none, and a quarter of the draws do. What it does not
        name begins at its prior's median.

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
    random = np.random.RandomState(_SEED)
    mode, confirmed = _highest(space, random) if near is None else _higher_of_two(space, near)
    density = laplace_density(space, mode, random)
    x: FloatArray = np.empty((0, n))
    log_ratio: FloatArray = np.empty(0)
    effective = 0.0
    at_once, enough = (_AT_ONCE, _EFFECTIVE) if near is None else (_AT_ONCE // 2, _EFFECTIVE / 4)
    while effective < enough and len(x) < _MOST:
        more = density.draw(random, at_once)
        x = np.concatenate([x, more])
        log_ratio = np.concatenate([log_ratio, space.log_density(more) - density.log_density(more)])
        weight = importance_weights(log_ratio)
        effective = 1 / float(np.sum(weight**2))
    if effective < _TOO_FEW:
        raise ValueError("there is no first answer: the posterior is not nearly normal, whatever noises and discrepancies are")
    theta, _ = space.to_theta(x)
    there = np.isfinite(log_ratio)
    values, weight = columns_at(problem, theta[there]), weight[there]
    mean = weight @ values
    sd = np.sqrt(weight @ (values - mean) ** 2)
    found = {name: FirstEstimate(float(m), float(s)) for name, m, s in zip(problem.names, mean, sd, strict=True)}
    log_evidence = logsumexp(log_ratio[there]) - np.log(len(x)) + density.log_mass - 0.5 * n * np.log(2 * np.pi)
    return FirstAnswer(found, effective, confirmed, float(log_evidence))


def _highest(space: Coordinates, random: np.random.RandomState) -> tuple[FloatArray, bool]:
    """A mode (n,) at which nothing speaks against it, or the highest of a few climbs; and whether it can be relied on."""
    n = len(space.problem.parameters)
    best, top, _ = score(space, space.from_theta(np.zeros((1, n)))[0])
    if _plausible(space, best):
        return best, True
    draws = space.from_theta(random.standard_normal((_STARTS, n)))
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


def _higher_of_two(space: Coordinates, near: Mapping[str, float]) -> tuple[FloatArray, bool]:
    """A mode (n,) near given values, and whether it can be relied on.

    It is what a climb from there ends at if nothing speaks against it, else the higher of that and of a climb from the medians.
    """
    theta = np.zeros((1, len(space.problem.parameters)))
    for k, p in enumerate(space.problem.parameters):
        z = float(p.prior.to_normal(np.array([near.get(p.name, math.nan)]))[0])
        theta[0, k] = z if math.isfinite(z) else 0.0
    begin = space.from_theta(theta)
    known: list[tuple[FloatArray, float]] = []
    if np.isfinite(space.log_density(begin)[0]):
        known.append(score(space, begin[0])[:2])
        if _plausible(space, known[0][0]):
            return known[0][0], True
    mode, top, met = score(space, space.from_theta(np.zeros_like(theta))[0], known)
    return max([*known, (mode, top)], key=lambda found: found[1])[0], met is not None


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
