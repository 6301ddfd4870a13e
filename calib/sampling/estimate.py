"""A calibration problem in, a first answer in tenths of a second out: means and standard deviations, from one mode.

Draws of the density that is close to the posterior round its mode (`calib.sampling.laplace`) are each weighted by their exact
density, which mends what is not linear in it, priors' own shapes included.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from calib.catalogue import SCALES
from calib.problem import Problem, chi_square, columns_at, coordinates_of, model_sweeps, put_together, values_at, values_of_lot
from calib.sampling.archive import smooth_weights
from calib.sampling.coordinates import Coordinates, coordinates
from calib.sampling.findings import FirstAnswer, FirstEstimate
from calib.sampling.laplace import StudentDensity, importance_weights, laplace_density
from calib.sampling.scoring import score, slopes_at
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
# A climb from the mode of another problem begins no further out than this in its priors, and takes so many steps at each power.
_FARTHEST, _SHORT_CLIMB = 3.0, ((1e-3, 5), (1e-1, 5), (1.0, 20))
# Of more unknowns than this, those of many specimens, it would neither be fast nor have draws of any weight.
_MOST_UNKNOWNS = 100
# Of fewer effective draws than this nothing is said.
_TOO_FEW = 10.0


@dataclass(frozen=True, eq=False)
class Look:
    """What a posterior looks like from one of its modes, before anything is sampled.

    Attributes
    ----------
    space : coordinates of the problem.
    mode : (n_unknown,), in these coordinates.
    confirmed : whether it describes the readings as expected, or two climbs ended there.
    misfit : chi square of all readings at the mode, of about as many degrees of freedom as there are points.
    n_point : how many these are.
    theta : (n_draw, n_unknown), draws near the mode as coordinates z of the priors.
    weight : (n_draw,), that make them draws of the posterior; they sum to 1.
    log_evidence : logarithm of how probable the data are under the problem, by all draws.
    """

    space: Coordinates
    mode: FloatArray
    confirmed: bool
    misfit: float
    n_point: int
    theta: FloatArray
    weight: FloatArray
    log_evidence: float

    @property
    def problem(self) -> Problem:
        """What was looked at."""
        return self.space.problem

    @property
    def effective_draws(self) -> float:
        """How many independent draws it is worth."""
        return 1 / float(np.sum(self.weight**2))

    @property
    def smoothed(self) -> tuple[FloatArray, float]:
        """The weights with their tail made smooth, (n_draw,), which sum to 1, and k-hat: above `K_HAT` they say nothing."""
        return smooth_weights(np.log(np.maximum(self.weight, 1e-300)))


def first_answer(problem: Problem, near: Mapping[str, float] | None = None, floor: float = -math.inf) -> FirstAnswer:
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
    floor : logarithm of the evidence below which the problem does not matter, as far below all that would matter as a climb may
        end too low. Where the mode that is climbed to from `near` does not describe the readings and has less by Laplace's
        method, this is the answer.

    Raises
    ------
    ValueError
        If every unknown is fixed, there are more than a hundred, or the posterior is so far from what
        was taken for it that there is no answer.
    """
    return answer_of(look_at(problem, near, floor))


def look_at(problem: Problem, near: Mapping[str, float] | None = None, floor: float = -math.inf) -> Look:
    """Find a mode of a posterior and weighted draws near it: what a first answer is made of.

    Parameters
    ----------
    problem : from `build_problem`.
    near, floor : as in `first_answer`; below the floor the draws are those of the density that is taken for the posterior.

    Raises
    ------
    ValueError
        If every unknown is fixed, there are more than a hundred, or the forward model covers nothing near the mode.
    """
    if not problem.parameters:
        raise ValueError("every parameter is fixed: there is nothing to estimate")
    if len(problem.parameters) > _MOST_UNKNOWNS:
        raise ValueError(f"there is no first answer for {len(problem.parameters)} unknowns, only for {_MOST_UNKNOWNS} at most")
    space = coordinates(problem)
    n = len(problem.parameters)
    random = np.random.RandomState(_SEED)
    known = None if near is None else _near_mode(space, near)
    if known is not None and not _plausible(space, known) and (crude := log_evidence_at(space, known)) < floor:
        draws, _ = space.to_theta(laplace_density(space, known, random).draw(random, _AT_ONCE // 2))
        there = draws[np.all(np.isfinite(draws), axis=1)]
        return Look(space, known, False, *_misfit(space, known), there, np.full(len(there), 1 / len(there)), crude)
    mode, confirmed = highest_mode(space, random) if near is None else _higher_of_two(space, known)
    density = laplace_density(space, mode, random)
    at_once, enough = (_AT_ONCE, _EFFECTIVE) if near is None else (_AT_ONCE // 2, _EFFECTIVE / 4)
    x: FloatArray = np.empty((0, n))
    log_target, log_near = np.empty(0), np.empty(0)  # of the posterior, and of the density near the mode
    effective = 0.0
    while effective < enough and len(x) < _MOST:
        more = density.draw(random, at_once)
        x = np.concatenate([x, more])
        log_target = np.concatenate([log_target, space.log_density(more)])
        log_near = np.concatenate([log_near, density.log_density(more)])
        if not np.any(np.isfinite(log_target)):
            raise ValueError("there is no first answer: the forward model covers nothing near the mode")
        weight = importance_weights(log_target - log_near)
        effective = 1 / float(np.sum(weight**2))
    wide = StudentDensity.about(x, weight)
    more = wide.draw(random, at_once // 2)
    of_near = len(x) / (len(x) + len(more))
    x = np.concatenate([x, more])
    log_target = np.concatenate([log_target, space.log_density(more)])
    log_near = np.concatenate([log_near, density.log_density(more)])
    log_ratio = log_target - np.logaddexp(np.log(of_near) + log_near, np.log1p(-of_near) + wide.log_density(x))
    theta, _ = space.to_theta(x)
    there = np.isfinite(log_ratio)
    weight = importance_weights(log_ratio)[there]
    log_evidence = float(logsumexp(log_ratio[there]) - np.log(len(x)) - 0.5 * n * np.log(2 * np.pi))
    misfit, n_point = _misfit(space, mode)
    return Look(space, mode, confirmed, misfit, n_point, theta[there], weight, log_evidence)


def answer_of(look: Look) -> FirstAnswer:
    """The first answer that a look at a posterior gives.

    Raises
    ------
    ValueError
        If the posterior is so far from what was taken for it that there is no answer.
    """
    if look.effective_draws < _TOO_FEW:
        raise ValueError("there is no first answer: the posterior is not nearly normal, whatever noises and discrepancies are")
    values, weight = columns_at(look.problem, look.theta), look.weight
    of_lot = values_of_lot(look.problem, look.theta, np.random.default_rng(_SEED))
    values = np.column_stack([*of_lot.values(), values])
    mean = weight @ values
    sd = np.sqrt(weight @ (values - mean) ** 2)
    names = [*of_lot, *look.problem.names]
    found = {name: FirstEstimate(float(m), float(s)) for name, m, s in zip(names, mean, sd, strict=True)}
    return FirstAnswer(found, look.effective_draws, look.confirmed, look.log_evidence)


def log_evidence_at(space: Coordinates, mode: FloatArray) -> float:
    """How probable the data are under a problem as a whole, by its mode alone: what other readings of them are weighed by.

    log p(y) = log p(y, x) - log det(I) / 2 at the mode x (Laplace), with the expected information I, up to a constant that
    depends on the number of unknowns alone. Of problems of the same data the differences are logarithms of how many times more
    probable the data are under the one than under the other, to about 2.

    Parameters
    ----------
    space : coordinates of the problem.
    mode : (n_unknown,).

    Returns
    -------
    -inf where the forward model does not cover the mode.
    """
    slopes = slopes_at(space, mode, 1.0)
    if slopes is None:
        return -np.inf
    return float(space.log_density(mode[None])[0]) - 0.5 * float(np.linalg.slogdet(slopes[1])[1])


def climb_from(other: Problem, space: Coordinates, mode: FloatArray, *, afresh: bool = False) -> tuple[Coordinates, FloatArray]:
    """Climb to a mode of a problem from that of another problem of the same unknowns: a few steps, a tenth of a second.

    Parameters
    ----------
    other : where to climb, the same data read in another way.
    space, mode : coordinates of the problem whose mode is known, and that mode, (n_unknown,).
    afresh : whether to look for modes as if none were known, too, and take the highest: where the known one makes no sense, as
        of data that contradict the priors. Takes seconds.

    Returns
    -------
    Coordinates of the other problem, and where the climb ended, (n_unknown,).
    """
    found = coordinates(other)
    theta, _ = space.to_theta(mode[None])
    z = coordinates_of(other, columns_at(space.problem, theta))[0]
    z = np.where(np.isfinite(z), np.clip(z, -_FARTHEST, _FARTHEST), 0.0)
    # Wide scales make a landscape soft: they shrink by themselves where the readings are described.
    scales = np.array([p.parameter in SCALES for p in other.parameters])
    z = np.where(scales, np.maximum(z, _HIGH_SCALE), z)
    reached, _, _ = score(found, found.from_theta(z[None])[0], powers=_SHORT_CLIMB)
    if afresh:
        again, _ = highest_mode(found, np.random.RandomState(_SEED))
        reached = max(again, reached, key=lambda x: float(found.log_density(x[None])[0]))
    return found, reached


def highest_mode(space: Coordinates, random: np.random.RandomState) -> tuple[FloatArray, bool]:
    """A mode (n,) at which nothing speaks against it, or the highest of a few climbs; and whether it can be relied on.

    Parameters
    ----------
    space : coordinates of the problem.
    random : of the places where climbs begin.
    """
    n = len(space.problem.parameters)
    best, top, _ = score(space, space.from_theta(np.zeros((1, n)))[0])
    if _plausible(space, best):
        return best, True
    draws = space.from_theta(random.standard_normal((_STARTS, n)))
    density = space.log_density(draws)
    likely = draws[np.argsort(-np.where(np.isfinite(density), density, -np.inf))][
        : min(_CLIMBS - 1, np.sum(np.isfinite(density)))
    ]
    again = False  # which a false mode is reached, too: as long as something speaks against it, there may be a better one
    for x in (space.nominal(), *likely):  # contact and load zero as the readings show them, then what the prior finds probable
        mode, value, met = score(space, x, [(best, top)])
        again |= met is not None
        if met is None and value > top:
            best, top, again = mode, value, False
            if _plausible(space, best):
                return best, True
    return best, again


def _near_mode(space: Coordinates, near: Mapping[str, float]) -> FloatArray | None:
    """Where a climb from given values ends, (n,); None where the posterior has no density there."""
    z = coordinates_of(space.problem, np.array([[near.get(name, math.nan) for name in space.problem.names]]))
    begin = space.from_theta(np.where(np.isfinite(z), z, 0.0))
    return score(space, begin[0])[0] if np.isfinite(space.log_density(begin)[0]) else None


def _higher_of_two(space: Coordinates, known: FloatArray | None) -> tuple[FloatArray, bool]:
    """A mode (n,), and whether it can be relied on: one that nothing speaks against, or the higher of it and a climb's."""
    if known is not None and _plausible(space, known):
        return known, True
    tops = [] if known is None else [(known, float(space.log_density(known[None])[0]))]
    mode, top, met = score(space, space.from_theta(np.zeros((1, len(space.problem.parameters))))[0], tops)
    return max([*tops, (mode, top)], key=lambda found: found[1])[0], met is not None


def _plausible(space: Coordinates, x: FloatArray) -> bool:
    """Whether a mode describes the readings, without noises and discrepancies that nobody expected: a false one does not."""
    misfit, n_point = _misfit(space, x)
    theta, _ = space.to_theta(x[None])
    scales = [z for z, p in zip(theta[0], space.problem.parameters, strict=True) if p.parameter in SCALES]
    return misfit < n_point + _BEYOND * np.sqrt(2 * n_point) and max(scales, default=0.0) < _HIGH_SCALE


def _misfit(space: Coordinates, x: FloatArray) -> tuple[float, int]:
    """Chi square of all readings at a point x (n,), and how many they are."""
    problem = space.problem
    theta, _ = space.to_theta(x[None])
    models = model_sweeps(problem, problem.forward, problem.plans, values_at(problem, theta))
    channels = [some.readings for some in put_together(problem.plans, models)]
    return sum(float(chi_square(channel)[0]) for channel in channels), sum(channel.observed.size for channel in channels)
