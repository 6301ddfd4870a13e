"""From any point under the prior to a mode of the posterior: Fisher scoring, on a likelihood that is let in step by step.

Readings y of a channel are normal with mean m and covariance S, both of which depend on the unknowns x. Their expected second
derivatives need first derivatives alone (Mardia & Marshall, Biometrika 71 (1984) 135):

    I_kl = m_k^T S^-1 m_l + tr(S^-1 S_k S^-1 S_l) / 2                                                               (1)

so that a step costs 2 n + 1 evaluations for n unknowns, where a Hessian by differences costs 2 n^2 + 1, and I is positive
definite everywhere. The second term is taken for the scales alone, noises and discrepancies: for the others it is next to
nothing beside the first. Far from the mode the likelihood of thousands of readings has ridges so sharp that steps follow them
into false modes; to a small power, which grows to 1, it has not.

Many specimens, independent of each other given what they share, take steps of their own lengths, and one that has strayed is
put where another of them stands, relative to its own readings.

What is believed of specimens of one lot is taken as normal (`calib.problem.lots`): where they are all alike its density has a
ridge that holds next to nothing. Of many specimens it is left out, as it ties them together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.catalogue import SCALES
from calib.problem import (
    PredictedReadings,
    log_likelihood,
    log_normal,
    log_prior_as_normal,
    model_sweeps,
    prior_bend,
    put_together,
    values_at,
)
from calib.sampling.coordinates import CONTACT, Coordinates
from models.sensor import BoolArray, FloatArray, IntArray

# Powers of the likelihood, and most steps at each; the last is the posterior. One soft one leads to the right mode more often
# than five from 1e-5 to 1e-1 do, at half the cost (`docs/sampling.md`).
_POWERS = ((1e-2, 10), (1.0, 100))
# A climb goes on while a step gains this much in the tempered log density: at the powers below 1, and at the last.
_GAIN, _LAST_GAIN = 1.0, 1e-2
#: What lies further below a mode than this for each unknown does not matter: no width could make up for it.
FAR_BELOW = 10.0
# A climb is given up, if at the pace of so many last steps it would end that far below a mode that is known.
_PACE = 8
# Steps are tried at these lengths, as they are; where none leads up, with the diagonal of the information enlarged by these
# shares of itself (Levenberg & Marquardt).
_LENGTHS = 0.5 ** np.arange(-1, 9)
_DAMPING = ((0.0,), (1e-2, 1.0, 1e2))
# Lengths for what many specimens share at which each of them looks for its own, besides none.
_TRIED = 2
# Where a step of many specimens gains less than this, those that have strayed are looked for: by letting each climb so many
# steps from where so many others stand.
_STRAYED, _SHIFTS, _STEPS_ALONE = 10.0, 4, 8
#: Step of the differences in x, which is about as wide as the prior: readings bend over more than 1e-3 of it.
STEP = 1e-4


def score(
    space: Coordinates,
    x: FloatArray,
    known: Sequence[tuple[FloatArray, float]] = (),
    powers: Sequence[tuple[float, int]] = _POWERS,
) -> tuple[FloatArray, float, int | None]:
    """Climb to a mode of the posterior from a point anywhere under the prior.

    Parameters
    ----------
    space : coordinates of the problem.
    x : (n_parameter,), a point of finite posterior density.
    known : modes found before, and their log density: a climb that comes near one of them is not taken to its end.
    powers : of the likelihood, one after the other, and most steps at each; the last is 1. Few where a mode is near.

    Returns
    -------
    The mode, (n_parameter,), its log posterior density in `space`, and the number of the known one that was met, or None. A
    climb may end at a false mode, with a discrepancy that describes all, as up to twelve of forty draws from the prior do: so
    climb from several. One that creeps along far below a known mode is given up on the way.
    """
    many = seeking = bool(space.scopes.specimens)
    enough = max((top for _, top in known), default=-np.inf) - FAR_BELOW * x.size
    for power, most in powers:
        value = float(tempered(space, x[None], power)[0])
        climbed = []
        for left in range(most, 0, -1):
            climbed.append(value)
            if power == 1 and len(climbed) > _PACE and not seeking:
                pace = (value - climbed[-1 - _PACE]) / _PACE
                if value + pace * left < enough:
                    return x, value, None
            slopes = slopes_at(space, x, power)
            if slopes is None:
                break
            if power == 1:
                met = _met(x, value, slopes[1], known)
                if met is not None:
                    return x, value, met
            gain = 0.0
            for damping in _DAMPING:
                tried, reached = (_steps_of_each if many else _steps_of_all)(space, x, power, _directions(*slopes, damping))
                best = int(np.argmax(reached))
                gain = float(reached[best]) - value
                if gain > 0:
                    x, value = tried[best], float(reached[best])
                    break
            if seeking and power == 1 and not gain > _STRAYED:
                x, moved = _regrouped(space, x)
                value, gain, seeking = value + moved, gain + moved, moved > _STRAYED
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


def _directions(gradient: FloatArray, information: FloatArray, damping: Sequence[float]) -> FloatArray:
    """Scoring steps with each damping, (n_damping, n)."""
    scale = np.diag(np.diagonal(information))
    return np.stack([np.linalg.solve(information + share * scale, gradient) for share in damping])


def _steps_of_all(space: Coordinates, x: FloatArray, power: float, directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where each direction leads at each length, (n_step, n), and the tempered log density there."""
    tried = x + np.concatenate([_LENGTHS[:, None] * direction for direction in directions])
    return tried, tempered(space, tried, power)


def _steps_of_each(space: Coordinates, x: FloatArray, power: float, directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """As `_steps_of_all`, each specimen at the length that is best for it, at a few lengths for what they share."""
    lengths = np.append(_LENGTHS, 0.0)
    shared = space.scopes.shared
    found, values = [], []
    for direction in directions:
        ladder = x + lengths[:, None] * direction
        together = np.sum(space.log_parts(ladder[:-1], power), axis=1)
        chosen = [*np.argsort(-together)[:_TRIED], lengths.size - 1]
        tried = np.tile(ladder, (len(chosen), 1, 1))
        tried[..., shared] = ladder[chosen][:, None, shared]
        parts = space.log_parts(tried.reshape(-1, x.size), power).reshape(*tried.shape[:2], -1)
        for places, of_places in zip(tried, parts, strict=True):
            best, value = _best_of_each(space, places, of_places)
            found.append(best)
            values.append(value)
    return np.stack(found), np.array(values)


def _best_of_each(space: Coordinates, tried: FloatArray, parts: FloatArray) -> tuple[FloatArray, float]:
    """Of places (n_place, n) that share what is shared, the best for each specimen, and the log density of all of these."""
    which = np.argmax(parts[:, 1:], axis=0)
    best = tried[0].copy()
    for k, own in enumerate(space.scopes.specimens.values()):
        best[own] = tried[which[k], own]
    return best, float(parts[0, 0] + np.sum(np.max(parts[:, 1:], axis=0)))


def _regrouped(space: Coordinates, x: FloatArray) -> tuple[FloatArray, float]:
    """Let specimens climb from where others of them stand, what they share held; the best place, and what is gained.

    Contact and load zero, which differ most between specimens, are taken from the readings of each.
    A specimen that has strayed widens noise and discrepancy for all, which makes its own way back a smooth one.
    """
    specimens = list(space.scopes.specimens.values())
    seen = np.array([k for k, p in enumerate(space.problem.parameters) if p.parameter in CONTACT], dtype=np.int64)
    nominal = space.nominal()[seen]
    best, before = x, space.log_parts(x[None])[0]
    top = before
    for shift in range(1, min(_SHIFTS, len(specimens) - 1) + 1):
        tried = x.copy()
        for own, other in zip(specimens, specimens[shift:] + specimens[:shift], strict=True):
            if own.size == other.size:
                tried[own] = x[other]
        tried[seen] = nominal
        for own, part in zip(specimens, space.log_parts(tried[None])[0, 1:], strict=True):
            if not np.isfinite(part):
                tried[own] = x[own]
        tried, parts = _climbed_alone(space, tried)
        top, parts = np.maximum(top, parts), parts > top
        best = best.copy()
        for own, better in zip(specimens, parts[1:], strict=True):
            if better:
                best[own] = tried[own]
    gain = float(np.sum(top) - np.sum(before))
    return best, gain


def _climbed_alone(space: Coordinates, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Let each specimen climb by itself, what they share held: where they come to, (n,), and the parts of the log density."""
    specimens = list(space.scopes.specimens.values())
    x, parts = x.copy(), space.log_parts(x[None])[0]
    for _ in range(_STEPS_ALONE):
        slopes = slopes_at(space, x, 1.0)
        if slopes is None:
            break
        direction = np.zeros(x.size)
        for own in specimens:
            direction[own] = np.linalg.solve(slopes[1][np.ix_(own, own)], slopes[0][own])
        tried = x + np.append(_LENGTHS, 0.0)[:, None] * direction
        of_tried = space.log_parts(tried)
        x, _ = _best_of_each(space, tried, of_tried)
        parts = np.max(of_tried, axis=0)
    return x, parts


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
        # Far out on a ladder of steps an unknown may be as large as no number is, or nothing.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            log_density[possible] += power * log_likelihood(space.problem, theta) + _log_prior(space, theta)
    return np.where(np.isfinite(log_density), log_density, -np.inf)


def _tied(space: Coordinates) -> bool:
    """Whether a climb takes specimens as those of a lot: not many of them, which climb one by one."""
    return bool(space.problem.table.lots) and not space.scopes.specimens


def _log_prior(space: Coordinates, theta: FloatArray) -> FloatArray:
    """Logarithm of the prior as climbs take it, up to a constant, (n_draw,)."""
    return log_prior_as_normal(space.problem, theta) if _tied(space) else -0.5 * np.sum(theta**2, axis=1)


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
    ways = _Differences.of(space)
    steps = ways.steps(x.size)
    theta, log_slopes = space.to_theta_by_exchange(x + np.concatenate([np.zeros((1, x.size)), steps, -steps]))
    there = np.all(np.isfinite(log_slopes), axis=1)
    values = values_at(space.problem, np.where(there[:, None], theta, 0.0))
    models = list(model_sweeps(space.problem, space.problem.forward, space.problem.plans, values))
    if not there[0] or not all(model.covered[0] for model in models):
        return None
    gradient, information = np.zeros(x.size), np.zeros((x.size, x.size))

    for specimen, (columns, rows) in ways.of_specimens.items():
        own = theta[:, ways.own[specimen]]  # all of them where specimens are few
        across = central_slope(own[rows], there[rows])
        information[np.ix_(columns, columns)] += across @ across.T
        if _tied(space):
            information += across @ prior_bend(space.problem, x.size) @ across.T
        exchanged = [k for k, e in enumerate(space.exchanges) if e.column in ways.own[specimen]]
        log_prior = np.sum(log_slopes[:, exchanged], axis=1) + (
            _log_prior(space, own) if _tied(space) else -0.5 * np.sum(own**2, axis=1)
        )
        gradient[columns] += central_slope(log_prior[rows], there[rows])
    scales = np.flatnonzero([p.parameter in SCALES for p in space.problem.parameters])
    plans = space.problem.plans
    for some in put_together(plans, models):
        specimen = plans[some.repeats.places[0]].sweep.specimen
        columns, rows = ways.of_specimens[specimen if space.scopes.specimens else ""]
        found = (np.cumsum(some.covered) - 1)[rows]  # of each draw among those that are covered
        known = (there & some.covered)[rows]  # others may stand at an end of the range
        wide = np.flatnonzero(np.isin(columns, scales))
        chosen = np.concatenate([[0], 1 + wide, 1 + columns.size + wide])
        channel = some.readings
        gradient[columns] += power * central_slope(log_normal(channel)[found], known)
        of_mean = central_slope(channel.mean[found], known)
        if len(some.presses) > 1:
            told, of_spread = _of_many(channel.only(found[chosen]), of_mean, known[chosen])
            information[np.ix_(columns, columns)] += power * told
            information[np.ix_(columns[wide], columns[wide])] += 0.5 * power * of_spread
            continue
        covariance = _covariance(channel, found[chosen])
        whiten = np.linalg.inv(np.linalg.cholesky(covariance[0]))
        mean_slope = of_mean @ whiten.T
        information[np.ix_(columns, columns)] += power * mean_slope @ mean_slope.T
        spread_slope = whiten @ central_slope(covariance, known[chosen]) @ whiten.T
        flat = spread_slope.reshape(wide.size, channel.observed.size**2)
        information[np.ix_(columns[wide], columns[wide])] += 0.5 * power * flat @ flat.T
    return gradient, information


@dataclass(frozen=True, eq=False)
class _Differences:
    """Which coordinates are stepped along together, and which columns each specimen's readings depend on.

    Given the shared ones, specimens are independent: a step along one coordinate of each of them at once tells as much as a
    step along each (Curtis, Powell & Reid, J. Inst. Math. Appl. 13 (1974) 117), and the number of steps does not grow with
    that of the specimens.

    Attributes
    ----------
    together : the coordinates of each step.
    own : specimen, or "" for what is shared -> columns that are its own.
    of_specimens : specimen, or "" -> the columns that it depends on, and the rows of the point itself, of the steps up along
        these columns, and of those down.
    """

    together: tuple[IntArray, ...]
    own: Mapping[str, IntArray]
    of_specimens: Mapping[str, tuple[IntArray, IntArray]]

    @staticmethod
    def of(space: Coordinates) -> _Differences:
        shared, specimens = space.scopes.shared, space.scopes.specimens
        most = max((own.size for own in specimens.values()), default=0)
        each = [np.array([own[k] for own in specimens.values() if k < own.size]) for k in range(most)]
        together = (*(np.array([k]) for k in shared), *each)

        def rows(n_own: int) -> IntArray:
            steps = np.arange(shared.size + n_own)
            return np.concatenate([[0], 1 + steps, 1 + len(together) + steps])

        of = {name: (np.concatenate([shared, own]), rows(own.size)) for name, own in specimens.items()}
        return _Differences(together, {"": shared, **specimens}, {"": (shared, rows(0)), **of})

    def steps(self, n: int) -> FloatArray:
        """(n_step, n)."""
        step = np.zeros((len(self.together), n))
        for k, columns in enumerate(self.together):
            step[k, columns] = STEP
        return step


def _of_many(channel: PredictedReadings, of_mean: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Both terms of (1) of presses that repeat each other, in time that grows with the number of their points.

    In units of the noise S = 1 + V V^T, S^-1 = 1 - V M V^T with M = (1 + V^T V)^-1, and S_k = diag(a_k) + V_k V^T + V V_k^T, so
    that all traces are of products as wide as V.

    Parameters
    ----------
    channel : at x, at x + a step along each scale, and at x - each of these.
    of_mean : slopes of the mean by all coordinates, (n, n_point).
    known : which of the draws of the channel there are.

    Returns
    -------
    (n, n) and, but for the half of it, (n_scale, n_scale).
    """
    noise = np.sqrt(channel.variance[0])
    modes = channel.modes
    v, slopes = modes[0] / noise[:, None], central_slope(modes, known) / noise[:, None]
    a, of_mean = central_slope(channel.variance, known) / noise**2, of_mean / noise
    gram = v.T @ v
    m = np.linalg.inv(np.eye(len(gram)) + gram)
    across = of_mean @ v
    told = of_mean @ of_mean.T - across @ m @ across.T
    va = v.T * a[:, None, :]

    def trace(one: FloatArray, other: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("...ij,...ji->...", one, other), dtype=float)

    within, along = m @ (va @ v), m @ (v.T @ slopes)  # M V^T a_k V, M V^T V_k
    of_noise = a @ a.T - 2 * trace(m, np.einsum("kip,ljp->klij", va, va)) + trace(within[:, None], within)
    mixed = 2 * (trace(m, np.einsum("kip,lpj->klij", va, slopes)) - trace(within[:, None], along))
    left = np.einsum("kpi,lpj->klij", slopes, slopes) - np.swapaxes(v.T @ slopes, 1, 2)[:, None] @ along
    of_modes = 2 * (trace(along[:, None], along) + trace(m @ gram, left))
    return told, np.asarray(of_noise + mixed + mixed.T + of_modes, dtype=float)


def _covariance(channel: PredictedReadings, rows: IntArray) -> FloatArray:
    """Covariances S of the readings of some draws, (n_row, n_point, n_point)."""
    modes = channel.modes[rows]
    covariance = modes @ np.swapaxes(modes, 1, 2)
    points = np.arange(channel.observed.size)
    covariance[:, points, points] += channel.variance[rows]
    return np.asarray(covariance, dtype=float)


def central_slope(values: FloatArray, there: BoolArray) -> FloatArray:
    """Differentiate what was computed at x, at a `STEP` up along each coordinate, and at one down.

    Parameters
    ----------
    values : (2 n + 1, ...), at x, x + each step, x - each step.
    there : (2 n + 1,), which of them are known; where one side is not, the difference is of the other alone.

    Returns
    -------
    Derivatives (n, ...).
    """
    n = (len(values) - 1) // 2
    shape = (n, *[1] * (values.ndim - 1))
    up, down = there[1 : n + 1].reshape(shape), there[n + 1 :].reshape(shape)
    above = np.where(up, values[1 : n + 1], values[0])
    below = np.where(down, values[n + 1 :], values[0])
    return np.asarray((above - below) / (STEP * np.maximum(1.0 * up + down, 1.0)))
