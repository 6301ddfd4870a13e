"""From a `TrainingSet` to a `Surrogate`: its networks, and from the paths kept out of the fit its error.

One path in eight is kept out. Of what the fit misses there, networks learn the standard deviation along the path, and its
correlation along the path gives modes of the error's covariance, scaled so that 90 % of what was kept out lies inside the 90 %
band.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from models.domain import (
    COMPRESSION,
    DEPTH,
    DIELECTRIC,
    ELECTRODE,
    PADDING,
    PATH,
    SENSOR,
    electric_features,
    inside,
    mechanical_features,
)
from models.fem import one_thread
from models.network import Network, train_network
from models.sensor import BoolArray, FloatArray
from models.surrogate import (
    CHANGE_SCALE,
    N_DEPTH_TERMS,
    N_ERROR_MODES,
    N_ERROR_TERMS,
    N_MODE_TERMS,
    S_END,
    Surrogate,
    closed_change,
    closed_force,
    depth_terms,
    smooth_end,
)
from models.training import DIELECTRIC_POINTS, ELECTRODE_POINTS, TrainingSet, design_points

#: Hidden layers of the networks, and steps of their training.
HIDDEN = (96, 96, 96)
STEPS = 240_000

#: Windows in s over which what a fit missed is averaged: their middles.
_WINDOWS = np.array([0.19, 0.37, 0.55, 0.73, 0.91])

#: Half width of a normal 90 % interval in standard deviations.
_Z90 = 1.645


def worst_points(surrogate: Surrogate, n: int, seed: int) -> FloatArray:
    """Points (n, 4) for new training paths where `surrogate` states the largest errors, of force or of capacitance.

    Drawn without repetition from eight times as many points all over the range, each with a chance in proportion to its squared
    error (Efraimidis & Spirakis, Inf. Process. Lett. 97 (2006) 181).
    """
    rng = np.random.default_rng(seed)
    points = design_points(8 * n, seed)
    electric = np.stack([rng.uniform(*DIELECTRIC, len(points)), rng.uniform(*ELECTRODE, len(points))], axis=1)
    error = surrogate.own_error(np.concatenate([points, electric], axis=1))
    weight = np.sum((error / np.mean(error, axis=0)) ** 2, axis=1)
    return np.asarray(points[np.argsort(np.log(rng.uniform(size=len(points))) / weight)[::-1][:n]])


#: Fewest training paths that `fit_surrogate` takes, and steps a path must have to be of use.
LEAST_PATHS = 64
_LEAST_STEPS = 8

# Steps that a path's curves are continued from beyond its end.
_LAST_STEPS = 6


def fit_surrogate(
    data: TrainingSet,
    *,
    hidden: tuple[int, ...] = HIDDEN,
    steps: int = STEPS,
    seed: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Surrogate:
    """Train every network, then the networks of the error on the paths kept out.

    Parameters
    ----------
    hidden, steps : of the networks of mechanics and capacitance; the others are small.
    progress : called with the name of the network, the steps done and their number.

    Raises
    ------
    ValueError
        If fewer than `LEAST_PATHS` paths are of use.
    """
    data = data.only(data.n_step >= _LEAST_STEPS)
    n_run = len(data.groups)
    if n_run < LEAST_PATHS:
        raise ValueError(f"{n_run} training paths are too few; give at least {LEAST_PATHS}")
    # The points' order is that of the groups: every eighth of a random order is spread over all of them.
    rng = np.random.default_rng(seed)
    fitted = np.ones(n_run, dtype=bool)
    fitted[rng.permutation(n_run)[::8]] = False

    def told(name: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, total: progress(name, done, total)

    features = mechanical_features(data.groups)
    log_end, certain = _ends(data)
    end = train_network(
        features[fitted],
        log_end[fitted, None],
        (24, 24),
        steps=max(steps // 4, 1),
        rng=rng,
        weight=np.where(certain, 1.0, 0.1)[fitted],
        batch=512,
        progress=told("end of the paths"),
    )
    thinned = (data.groups[:, SENSOR] + data.groups[:, PADDING]) * np.exp(end(features)[:, 0])
    s = np.sqrt(data.depth / smooth_end(thinned)[:, None])

    # Curves by run and quantity, then by run and electrode: (n, n_depth).
    log_force = np.log(data.force / closed_force(data.groups, data.depth))
    log_contact = np.log(data.contact_radius / np.sqrt(data.depth))
    electric, log_change, weight = _electric_curves(data)
    by_run = (n_run, _N_ELECTRIC, PATH.size)
    change = _coefficients(s, log_change.reshape(by_run), weight.reshape(by_run), 0).reshape(-1, N_DEPTH_TERMS)
    both = _coefficients(s, np.stack([log_force, log_contact], axis=1), np.ones((n_run, 2, PATH.size)), 1).reshape(n_run, -1)
    in_fit = np.repeat(fitted, _N_ELECTRIC)
    first, second = rng.spawn(2)
    with one_thread(), ThreadPoolExecutor(2) as pool:
        mechanics, capacitance = (
            task.result()
            for task in (
                pool.submit(_train_curves, features, both, fitted, _MECHANICS, hidden, steps, first, told("mechanics")),
                pool.submit(_train_curves, electric, change, in_fit, _CAPACITANCE, hidden, steps, second, told("capacitance")),
            )
        )

    # What the fit misses where the surrogate answers: on paths kept out, inside the range, to the depth it goes to.
    middle = np.tile([np.mean(DIELECTRIC), np.mean(ELECTRODE)], (n_run, 1))
    out = np.flatnonzero(~fitted & inside(np.concatenate([data.groups, middle], axis=1)))
    rows = (out[:, None] * _N_ELECTRIC + np.arange(_N_ELECTRIC)).ravel()
    s_out = np.where(data.depth <= np.minimum(DEPTH, thinned)[:, None], s, np.nan)[out]
    s_rows = np.repeat(s_out, _N_ELECTRIC, axis=0)
    missed_force = log_force[out] - _curve(mechanics(features[out])[:, :N_DEPTH_TERMS], s_out, 1)
    missed_change = weight[rows] * (log_change[rows] - _curve(capacitance(electric[rows]), s_rows, 0))
    force_sd, force_modes = _learn_error(features[out], s_out, missed_force, max(steps // 8, 1), rng)
    capacitance_sd, capacitance_modes = _learn_error(electric[rows], s_rows, missed_change, max(steps // 8, 1), rng)
    return Surrogate(
        end,
        mechanics,
        capacitance,
        force_sd,
        capacitance_sd,
        force_modes,
        capacitance_modes,
        {
            "model": "neo-Hookean sensor on padding, bonded base, frictionless sphere",
            "finite elements": f"Q2/P1, accuracy {data.accuracy:g}, K/mu 1e4",
            "training paths": f"{n_run}, {sum(map(bool, data.failures))} of them without equilibrium to their end",
            "training hash (SHA-256)": data.digest,
            "networks": f"{' x '.join(map(str, hidden))}, {N_DEPTH_TERMS} terms in depth, {steps} steps of SOAP, seed {seed}",
            "error of force": f"{_in_words(missed_force)} ({out.size} paths kept out of the fit)",
            "error of capacitance change": f"{_in_words(missed_change)} (likewise)",
            "numpy": version("numpy"),
            "scipy": version("scipy"),
            "date": datetime.now(UTC).date().isoformat(),
        },
    )


# Power of s that leads a curve, and its weight in the fit: the contact radius steps from node to node and counts less.
_MECHANICS = ((1, 1.0), (1, 0.3))
_CAPACITANCE = ((0, 1.0),)

_N_ELECTRIC = DIELECTRIC_POINTS.size * ELECTRODE_POINTS.size


def _electric_curves(data: TrainingSet) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Every t_d/h_s and a_e/a of every run: features (n, 13), log of C/C0 - 1 over its closed form, and weights, (n, n_depth).

    The weight is the share of C/C0 - 1 in itself + delta: changes that count as nothing are not chased.
    """
    gap, width = (x.ravel() for x in np.meshgrid(DIELECTRIC_POINTS, ELECTRODE_POINTS, indexing="ij"))
    n_run = len(data.groups)
    own = np.tile(np.stack([gap, width], axis=1), (n_run, 1))
    groups = np.concatenate([np.repeat(data.groups, _N_ELECTRIC, axis=0), own], axis=1)
    depth = np.repeat(data.depth, _N_ELECTRIC, axis=0)
    change = np.moveaxis(data.capacitance.reshape(n_run, PATH.size, _N_ELECTRIC), 1, 2).reshape(-1, PATH.size)
    # No change of these designs is negative but by rounding.
    change = np.maximum(change, 1e-12)
    closed = closed_change(groups, depth, closed_force(groups, depth))
    return electric_features(groups), np.log(change / closed), change / (change + CHANGE_SCALE)


def _curve(coefficients: FloatArray, s: FloatArray, power: int) -> FloatArray:
    """Curves (n, n_depth) of coefficients (n, N_DEPTH_TERMS) at s (n, n_depth); nan where s is."""
    values = s**power * (coefficients[:, None] @ depth_terms(np.nan_to_num(s, nan=1.0)))[:, 0]
    return np.where(np.isfinite(s), values, np.nan)  # nan to the power of nothing is one


def _ends(data: TrainingSet) -> tuple[FloatArray, BoolArray]:
    """log(d/h) at which each path is thinned to 40 % or gets stuck (n_run,), and where that is seen and not extrapolated."""
    thickness = data.groups[:, SENSOR] + data.groups[:, PADDING]
    logs, certain = np.empty(len(thickness)), np.zeros(len(thickness), dtype=bool)
    for i, n in enumerate(data.n_step):
        x, y = np.log(data.depth[i, n - 3 : n]), np.log(data.compression[i, n - 3 : n])
        at, reached = np.log(COMPRESSION), y[-1] >= np.log(COMPRESSION)
        if data.failures[i] and not reached:
            logs[i], certain[i] = x[-1], True
        elif reached:
            logs[i], certain[i] = np.interp(at, y, x), True
        else:
            logs[i] = x[-1] + (at - y[-1]) / max((y[-1] - y[0]) / (x[-1] - x[0]), 0.3)
    return logs - np.log(thickness), certain


def _coefficients(s: FloatArray, curves: FloatArray, weight: FloatArray, power: int) -> FloatArray:
    """Coefficients (n, m, N_DEPTH_TERMS) of curves (n, m, n_depth) = s^power p(s) by weighted least squares; nan is not fitted.

    High terms are held down just enough for paths with fewer steps than terms, and from the end of a path to `S_END`, where it
    has no steps, its curves go on as a quadratic through the last of them: a polynomial left to itself there would be wild. The
    first steps, where few elements touch, hold what noise there is and weigh less.
    """
    n_run, n_curve = curves.shape[:2]
    hold = np.broadcast_to(np.diag(1e-4 * 1.6 ** np.arange(N_DEPTH_TERMS)), (n_curve, N_DEPTH_TERMS, N_DEPTH_TERMS))
    out = np.empty((n_run, n_curve, N_DEPTH_TERMS))
    for i, along in enumerate(s):
        seen = np.flatnonzero(np.isfinite(along))
        last = seen[-_LAST_STEPS:]
        beyond = along[last[-1]] + (S_END - along[last[-1]]) * np.array([0.5, 1.0])
        beyond = beyond[beyond > along[last[-1]]]
        onward = curves[i][:, last] @ (np.vander(beyond, 3) @ np.linalg.pinv(np.vander(along[last], 3))).T
        at = np.concatenate([along[seen], beyond])
        weights = np.concatenate(
            [weight[i][:, seen] * np.clip(along[seen] / 0.3, 0.3, 1.0), np.full(onward.shape, 0.3)], axis=1
        )
        right = weights * np.concatenate([curves[i][:, seen], onward], axis=1)
        left = np.concatenate([weights[..., None] * (depth_terms(at) * at**power).T, hold], axis=1)
        q, r = np.linalg.qr(left)
        out[i] = np.linalg.solve(r, np.swapaxes(q[:, : at.size], 1, 2) @ right[..., None])[..., 0]
    return out


def _train_curves(
    features: FloatArray,
    coefficients: FloatArray,
    fitted: BoolArray,
    curves: tuple[tuple[int, float], ...],
    hidden: tuple[int, ...],
    steps: int,
    rng: np.random.Generator,
    progress: Callable[[int, int], None] | None,
) -> Network:
    """A network to the coefficients (n, n_curve * N_DEPTH_TERMS), by least squares of the curves they stand for.

    With the terms on an even grid of s as A = Q R, the curves' sum of squares is that of R times the coefficients; the network
    is trained on these and its last layer then turned to the coefficients themselves. `curves` tells the power of s that leads
    each curve, and its weight.
    """
    grid = np.linspace(PATH[0], S_END, 2 * N_DEPTH_TERMS)
    triangle = np.zeros((coefficients.shape[1],) * 2)
    for k, (power, weight) in enumerate(curves):
        own = slice(k * N_DEPTH_TERMS, (k + 1) * N_DEPTH_TERMS)
        terms = depth_terms(grid).T * (weight * grid[:, None] ** power / np.sqrt(grid.size))
        triangle[own, own] = np.linalg.qr(terms)[1]
    mean = coefficients[fitted].mean(axis=0)
    scores = (coefficients[fitted] - mean) @ triangle.T
    network = train_network(features[fitted], scores, hidden, steps=steps, rng=rng, progress=progress)
    last = network.layers[-1].astype(float) @ np.linalg.inv(triangle.T)
    last[-1] += mean
    return Network(network.centre, network.width, (*network.layers[:-1], last.astype(np.float32)))


def _learn_error(
    features: FloatArray, s: FloatArray, missed: FloatArray, steps: int, rng: np.random.Generator
) -> tuple[Network, FloatArray]:
    """From what a fit missed (n, n_depth) at s: a network to the log of its sd, and the modes of its correlation."""
    squares = np.full((len(s), _WINDOWS.size), np.nan)
    for k, middle in enumerate(_WINDOWS):
        near = np.abs(s - middle) <= (_WINDOWS[1] - _WINDOWS[0]) / 2
        total = np.sum(np.where(near, missed, 0.0) ** 2, axis=1)
        np.divide(total, near.sum(axis=1), out=squares[:, k], where=near.any(axis=1))
    logs = np.log(np.maximum(squares, 1e-12)) / 2
    logs = np.where(np.isfinite(logs), logs, np.nanmean(logs, axis=1, keepdims=True))
    # Three terms through five windows: no wild ends.
    to_terms = np.linalg.pinv(depth_terms(_WINDOWS, N_ERROR_TERMS).T)
    network = train_network(features, logs @ to_terms.T, (16, 16), steps=steps, rng=rng, batch=512)

    sd = np.exp((network(features)[:, None] @ depth_terms(np.nan_to_num(s, nan=1.0), N_ERROR_TERMS))[:, 0])
    score = missed / sd
    scale = float(np.nanquantile(np.abs(score), 0.9)) / _Z90
    last = network.layers[-1].copy()
    last[-1, 0] += np.float32(np.log(scale))

    # A handful of wild paths must not make the correlation.
    along = np.clip(score / scale, -4, 4)
    grid = np.linspace(0.0, S_END, 2 * N_DEPTH_TERMS)
    curves = np.array([np.interp(grid, x[np.isfinite(x)], y[np.isfinite(x)]) for x, y in zip(s, along, strict=True)])
    covariance = curves.T @ curves / len(curves)
    size = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / size / size[:, None])
    modes = vectors[:, ::-1][:, :N_ERROR_MODES] * np.sqrt(values[::-1][:N_ERROR_MODES])
    terms = depth_terms(grid, N_MODE_TERMS).T
    smooth = np.linalg.lstsq(terms, modes, rcond=None)[0]
    # What modes and terms left out must not be missing from the standard deviation.
    short = np.linalg.norm(terms @ smooth, axis=1, keepdims=True)
    smooth = np.linalg.lstsq(terms, terms @ smooth / short, rcond=None)[0]
    return Network(network.centre, network.width, (*network.layers[:-1], last)), np.asarray(smooth.T)


def _in_words(error: FloatArray) -> str:
    size = np.abs(error[np.isfinite(error)])
    return f"median {np.median(size):.2%}, 95 % below {np.quantile(size, 0.95):.2%}, worst {np.max(size):.1%}"
