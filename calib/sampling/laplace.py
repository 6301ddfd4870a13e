"""A mode of a posterior in, a density close to the posterior round it, that can be drawn from, out.

At a mode the readings m are taken as linear in most unknowns r, but not in the others u: the scales (noises and discrepancies),
which make the posterior a funnel, and what is known so badly that its prior bends the way from its coordinate to its value, as
a compliance near zero is. With m(u, r) = m(u) + M (r - r_mode) the posterior of r is normal given u, and so known together with
how probable u is,

    A(u) = P + M^T S(u)^-1 M,   b(u) = g + M^T S(u)^-1 (y - m(u)),                                                    (1)
    log p(u | y) = -(log det S + (y - m)^T S^-1 (y - m) - b^T A^-1 b + log det A + u^T u) / 2,

with S the covariance of the readings, g and P the slope and the bend of the prior. So u is drawn from a Student density found
in rounds of importance sampling, and the rest is drawn given it. Without the compliance in u, draws lay beside the ridge along
which it goes to zero, no weight told so, and its intervals of 90 % held 85 % (`docs/first_answer.md`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from calib.catalogue import SCALES
from calib.problem import PredictedReadings, Problem, log_prior_as_normal, model_sweeps, prior_bend, put_together, values_at
from calib.sampling.coordinates import Coordinates
from calib.sampling.funnel import log_student
from calib.sampling.scoring import STEP, central_slope, inverse_root, slopes_at
from models.sensor import FloatArray, IntArray

# Draws of u in each round that finds out where it lies, and by how much the first of them is wider than at the mode.
_ROUNDS, _WIDEN = (160, 160), 1.5
# The way from a coordinate to its value is bent, if over so many sds on either side of the mode it goes so many times as far on
# one side as on the other; most unknowns that are drawn first for it.
_ASIDE, _BENT, _MOST_BENT = 2.0, 1.03, 3
# Degrees of freedom of the Student densities that they are drawn from, and by how much these are wider than the last draws.
_FREEDOM, _MARGIN = 5.0, 1.1
# Numbers in the matrices of (1) that are held at a time.
_HELD = 2e7


@dataclass(frozen=True, eq=False)
class StudentDensity:
    """A Student density about `centre` (n,), with `spread` (n, n) for a triangular root of the covariance of a normal one."""

    centre: FloatArray
    spread: FloatArray

    @classmethod
    def about(cls, x: FloatArray, weight: FloatArray) -> StudentDensity:
        """One a little wider than weighted draws of another density.

        Parameters
        ----------
        x : the draws, (n_draw, n).
        weight : of each, (n_draw,); they sum to 1.
        """
        centre = weight @ x
        covariance = ((x - centre).T * weight) @ (x - centre)
        spread = _MARGIN * np.linalg.cholesky(covariance + 1e-9 * np.eye(centre.size))
        return cls(centre, np.asarray(spread, dtype=float))

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        wide = np.sqrt(random.chisquare(_FREEDOM, n_draw) / _FREEDOM)
        normal = random.standard_normal((n_draw, self.centre.size)) / wide[:, None]
        return np.asarray(self.centre + normal @ self.spread.T, dtype=float)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        square = np.sum(solve_triangular(self.spread, (x - self.centre).T, lower=True) ** 2, axis=0)
        return log_student(square, self.centre.size, _FREEDOM, 1.0) - float(np.sum(np.log(np.diagonal(self.spread))))


@dataclass(frozen=True, eq=False)
class LaplaceDensity:
    """A posterior near its mode x (n,): Student in its coordinates `first`, u, and normal given them in the `rest`, r of (1).

    `gradient` and `bend` are g and P of (1), `slopes` M (n_point, n_rest) of each channel of each sweep, or of those that
    repeat each other; `of_first` is the density of u. What is known given u costs most, so that `each` neighbouring draws may
    share their u; 1 for draws that are all independent.
    """

    space: Coordinates
    x: FloatArray
    first: IntArray
    rest: IntArray
    gradient: FloatArray
    bend: FloatArray
    slopes: tuple[FloatArray, ...]
    of_first: StudentDensity
    each: int = 1

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Draws (n_draw, n), independent but for the u that `each` of them share.

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        return np.concatenate([self._drawn(random, rows.size) for rows in self._batches(n_draw)])

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        return np.concatenate([self._log_density(x[rows]) for rows in self._batches(len(x))])

    def _batches(self, n_draw: int) -> list[IntArray]:
        return np.array_split(np.arange(n_draw), max(1, int(np.ceil(n_draw * self.x.size**2 / _HELD))))

    def _drawn(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        few = self.of_first.draw(random, -(-n_draw // self.each))
        u = np.repeat(few, self.each, axis=0)[:n_draw]
        given = _given_first(self, few).of(np.arange(n_draw) // self.each)
        normal = random.standard_normal(given.whitened.shape)
        away = np.linalg.solve(np.swapaxes(given.factor, 1, 2), (given.whitened + normal)[..., None])[..., 0]
        x = np.empty((n_draw, self.x.size))
        x[:, self.first], x[:, self.rest] = u, self.x[self.rest] + away
        return x

    def _log_density(self, x: FloatArray) -> FloatArray:
        few, which = np.unique(x[:, self.first], axis=0, return_inverse=True)
        given = _given_first(self, few).of(which.reshape(-1))
        away = x[:, self.rest] - self.x[self.rest]
        normal = (np.swapaxes(given.factor, 1, 2) @ away[..., None])[..., 0] - given.whitened
        of_rest = _log_diagonal(given.factor) - 0.5 * np.sum(normal**2, axis=1) - 0.5 * self.rest.size * np.log(2 * np.pi)
        return np.asarray(of_rest + self.of_first.log_density(x[:, self.first]), dtype=float)


@dataclass(frozen=True, eq=False)
class _Given:
    """What is known of r given draws of u: log p(u | y) (n_draw,), the Cholesky factors L of A and L^-1 b of (1)."""

    log_density: FloatArray
    factor: FloatArray
    whitened: FloatArray

    def of(self, rows: IntArray) -> _Given:
        """The same for these of the draws."""
        return _Given(self.log_density[rows], self.factor[rows], self.whitened[rows])


def laplace_density(space: Coordinates, x: FloatArray, random: np.random.RandomState) -> LaplaceDensity:
    """Find a density that is close to a posterior round one of its modes, where it is nearly normal given u of (1).

    Parameters
    ----------
    space : coordinates of the problem.
    x : (n,), the mode.
    random : the source of random numbers, by which u is looked for.

    Raises
    ------
    LinAlgError
        If readings or priors do not hold everything that is unknown.
    """
    found = _linearised(space, x)
    for count in _ROUNDS:
        u = found.of_first.draw(random, count)
        weight = importance_weights(_given_first(found, u).log_density - found.of_first.log_density(u))
        found = replace(found, of_first=StudentDensity.about(u, weight))
    return found


def importance_weights(log_ratio: FloatArray) -> FloatArray:
    """Weights that sum to 1, none above the root of their number (Ionides, J. Comput. Graph. Stat. 17 (2008) 295).

    Parameters
    ----------
    log_ratio : (n_draw,), logarithm of the density that is wanted over that which was drawn from; nan or -inf for no weight.
    """
    ratio = np.where(np.isfinite(log_ratio), log_ratio, -np.inf)
    weight = np.exp(ratio - np.max(ratio))
    weight = np.minimum(weight, np.mean(weight) * np.sqrt(weight.size))
    return np.asarray(weight / np.sum(weight), dtype=float)


def _linearised(space: Coordinates, x: FloatArray) -> LaplaceDensity:
    """Differentiate prior and readings at a mode."""
    problem, n = space.problem, x.size
    step = STEP * np.eye(n)
    theta, log_jacobian = space.to_theta(x + np.concatenate([np.zeros((1, n)), step, -step]))
    there = np.isfinite(log_jacobian)
    values = values_at(problem, np.where(there[:, None], theta, 0.0))
    models = list(model_sweeps(problem, problem.forward, problem.plans, values))
    for model in models:
        there &= model.covered
    factor = _spread(space, x)
    first = _drawn_first(space, x, np.linalg.norm(factor, axis=1))
    rest = np.setdiff1d(np.arange(n), first)
    across = central_slope(theta, there)[rest]
    slopes = []
    for some in put_together(problem.plans, models):
        rows = np.cumsum(some.covered) - 1  # of each draw among those that are covered
        slopes.append(central_slope(some.readings.mean[rows], there)[rest].T)
    gradient = central_slope(log_jacobian + log_prior_as_normal(problem, theta), there)[rest]
    own = factor[first]
    of_first = StudentDensity(x[first], np.asarray(_WIDEN * np.linalg.cholesky(own @ own.T), dtype=float))
    bend = across @ across.T + across @ prior_bend(problem, n) @ across.T
    return LaplaceDensity(space, x, first, rest, gradient, bend, tuple(slopes), of_first)


def _spread(space: Coordinates, x: FloatArray) -> FloatArray:
    """A root of the covariance of all coordinates at the mode, (n, n)."""
    slopes = slopes_at(space, x, 1.0)
    return np.eye(x.size) if slopes is None else np.asarray(inverse_root(slopes[1]), dtype=float)


def _drawn_first(space: Coordinates, x: FloatArray, sd: FloatArray) -> IntArray:
    """Which coordinates are u of (1): the scales, and those whose ways to their values bend most.

    Those are not that go together with others before the data: what is pooled in a lot, and what is exchanged.
    """
    problem, every = space.problem, range(x.size)
    scales = [k for k in every if problem.parameters[k].parameter in SCALES]
    tied = {exchange.column for exchange in space.exchanges} | {int(k) for lot in problem.table.lots for k in lot.columns}
    bends = {k: _bend_of(problem, k, float(x[k]), float(sd[k])) for k in set(every) - set(scales) - tied}
    most = sorted((k for k in bends if bends[k] > _BENT), key=lambda k: -bends[k])[:_MOST_BENT]
    return np.array(sorted([*scales, *most]), dtype=np.int64)


def _bend_of(problem: Problem, column: int, z: float, sd: float) -> float:
    """How many times as far a value goes on one side of its coordinate z as on the other, 1 at least."""
    below, at, above = problem.parameters[column].prior.ppf_normal(z + _ASIDE * sd * np.array([-1.0, 0.0, 1.0]))
    lower, upper = abs(float(at - below)), abs(float(above - at))
    return max(lower, upper) / max(min(lower, upper), 1e-300)


def _given_first(given: LaplaceDensity, u: FloatArray) -> _Given:
    """Equations (1) at draws u (n_draw, n_first); where the forward model does not cover one it is impossible."""
    problem = given.space.problem
    x = np.tile(given.x, (len(u), 1))
    x[:, given.first] = u
    theta, log_jacobian = given.space.to_theta(x)
    possible = np.isfinite(log_jacobian)
    a = np.tile(given.bend, (len(u), 1, 1))
    b = np.tile(given.gradient, (len(u), 1))
    log_density = -0.5 * np.sum(u**2, axis=1)
    values = values_at(problem, np.where(possible[:, None], theta, 0.0))
    models = list(model_sweeps(problem, problem.forward, problem.plans, values))
    for model in models:
        possible &= model.covered
    together = zip(put_together(problem.plans, models), given.slopes, strict=True) if np.any(possible) else ()
    for some, slope in together:
        readings = some.readings.only(possible[some.covered])
        misfit = readings.observed - readings.mean
        columns = np.concatenate([np.broadcast_to(slope, (len(misfit), *slope.shape)), misfit[..., None]], axis=2)
        product, log_det = weighed(readings, columns)
        a[possible] += product[:, :-1, :-1]
        b[possible] += product[:, :-1, -1]
        log_density[possible] -= 0.5 * (product[:, -1, -1] + log_det)
    factor = np.asarray(np.linalg.cholesky(a), dtype=float)
    whitened = np.asarray(np.linalg.solve(factor, b[..., None])[..., 0], dtype=float)
    log_density += 0.5 * np.sum(whitened**2, axis=1) - _log_diagonal(factor)
    return _Given(np.where(possible, log_density, -np.inf), factor, whitened)


def weighed(channel: PredictedReadings, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products of columns by the inverse of the covariance S of a channel's readings, which is of low rank (Woodbury).

    Parameters
    ----------
    channel : with S of each draw.
    columns : C, (n_point, k) for all draws or (n_draw, n_point, k).

    Returns
    -------
    C^T S^-1 C (n_draw, k, k), and log det S (n_draw,).
    """
    modes, across = channel.modes, np.swapaxes(columns, -1, -2)
    weighted = modes / channel.variance[..., None]
    inner = np.asarray(np.linalg.cholesky(np.eye(modes.shape[-1]) + np.swapaxes(modes, 1, 2) @ weighted), dtype=float)
    shared = np.linalg.solve(inner, np.swapaxes(weighted, 1, 2) @ columns)
    own = (across / channel.variance[:, None, :]) @ columns
    log_det = np.sum(np.log(channel.variance), axis=1) + 2 * _log_diagonal(inner)
    return own - np.swapaxes(shared, 1, 2) @ shared, log_det


def _log_diagonal(factors: FloatArray) -> FloatArray:
    """Sums of the logarithms on the diagonals of triangular factors (n, k, k), (n,)."""
    return np.asarray(np.sum(np.log(np.diagonal(factors, axis1=1, axis2=2)), axis=1), dtype=float)
