"""From a `TrainingSet` to a `Surrogate`: its networks, and from the paths kept out of the fit its error.

One path in eight is kept out. Of what the fit misses there, networks learn the standard deviation along the path, and its
correlation along the path gives modes of the error's covariance, scaled so that 90 % of what was kept out lies inside the 90 %
band.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from models.domain import (
    COMPRESSION,
    DIELECTRIC,
    DISC,
    ELECTRODE,
    PADDING,
    PATH,
    SENSOR,
    WIDTH,
    electric_features,
    mechanical_features,
)
from models.network import Network, train_network
from models.sensor import BoolArray, FloatArray
from models.surrogate import (
    CHANGE_SCALE,
    ERROR_POINTS,
    N_DEPTH_TERMS,
    N_ERROR_MODES,
    Surrogate,
    closed_force,
    depth_terms,
    error_weights,
    smooth_end,
)
from models.training import DIELECTRIC_POINTS, ELECTRODE_POINTS, TrainingSet, design_points

#: Hidden layers of the networks, and steps of their training.
HIDDEN = (96, 96, 96)
STEPS = 60_000

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
    kept_out = np.zeros(n_run, dtype=bool)
    kept_out[rng.permutation(n_run)[::8]] = True
    fitted = ~kept_out

    def told(name: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, total: progress(name, done, total)

    features = mechanical_features(data.groups)
    log_end, certain = _ends(data)
    small = max(steps // 4, 1)
    end = train_network(
        features[fitted],
        log_end[fitted, None],
        (24, 24),
        steps=small,
        rng=rng,
        weight=np.where(certain, 1.0, 0.1)[fitted],
        batch=512,
        progress=told("end of the paths"),
    )
    thickness = data.groups[:, SENSOR] + data.groups[:, PADDING]
    s = np.sqrt(data.depth / smooth_end(thickness * np.exp(end(features)[:, 0]))[:, None])

    log_force = np.log(data.force / closed_force(data.groups, data.depth))
    log_contact = np.log(data.contact_radius / np.sqrt(data.depth))
    curves = np.concatenate([_coefficients(s, y[..., None], 1) for y in (log_force, log_contact)], axis=1)[..., 0]
    mechanics = _train_curves(features, curves, fitted, _MECHANICS, hidden, steps, rng, told("mechanics"))

    every = _electric_groups(data.groups)
    electric = electric_features(every)
    width = every[:, WIDTH] * every[:, DISC]
    plain = (np.repeat(data.depth, _N_ELECTRIC, axis=0) / width[:, None]) ** 2 + CHANGE_SCALE
    change = np.moveaxis(data.capacitance.reshape(n_run, PATH.size, _N_ELECTRIC), 1, 2).reshape(-1, PATH.size)
    log_change = np.log(np.maximum(change + CHANGE_SCALE, 1e-12) / plain)
    per_run = np.moveaxis(log_change.reshape(n_run, _N_ELECTRIC, PATH.size), 1, 2)
    curves = np.moveaxis(_coefficients(s, per_run, 2), 1, 2).reshape(-1, N_DEPTH_TERMS)
    in_fit = np.repeat(fitted, _N_ELECTRIC)
    capacitance = _train_curves(electric, curves, in_fit, _CAPACITANCE, hidden, steps, rng, told("capacitance"))

    # What the fit misses on the paths kept out.
    out = np.flatnonzero(kept_out)
    terms = depth_terms(np.nan_to_num(s[out], nan=1.0))
    missed_force = log_force[out] - s[out] * (terms @ mechanics(features[out])[:, :N_DEPTH_TERMS, None])[..., 0]
    rows = (out[:, None] * _N_ELECTRIC + np.arange(_N_ELECTRIC)).ravel()
    s_rows = np.repeat(s[out], _N_ELECTRIC, axis=0)
    terms = depth_terms(np.nan_to_num(s_rows, nan=1.0))
    missed_change = log_change[rows] - s_rows**2 * (terms @ capacitance(electric[rows])[..., None])[..., 0]
    force_sd, force_modes = _learn_error(features[out], s[out], missed_force, steps // 8, rng)
    capacitance_sd, capacitance_modes = _learn_error(electric[rows], s_rows, missed_change, steps // 8, rng)
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
            "paths kept out of the fit": str(out.size),
            "training hash (SHA-256)": data.digest,
            "networks": f"{' x '.join(map(str, hidden))}, {N_DEPTH_TERMS} terms in depth, {steps} steps of SOAP, seed {seed}",
            "error of force on paths kept out": _in_words(missed_force),
            "error of capacitance change on paths kept out": _in_words(missed_change),
            "numpy": version("numpy"),
            "scipy": version("scipy"),
            "date": datetime.now(UTC).date().isoformat(),
        },
    )


# Power of s that leads a curve, and its weight in the fit: the contact radius steps from node to node and counts less.
_MECHANICS = ((1, 1.0), (1, 0.3))
_CAPACITANCE = ((2, 1.0),)

_N_ELECTRIC = DIELECTRIC_POINTS.size * ELECTRODE_POINTS.size


def _electric_groups(groups: FloatArray) -> FloatArray:
    """Groups (n * n_dielectric * n_electrode, 6): those of each run (n, 4) at every t_d/h_s and a_e/a it has."""
    gap, width = (x.ravel() for x in np.meshgrid(DIELECTRIC_POINTS, ELECTRODE_POINTS, indexing="ij"))
    electric = np.tile(np.stack([gap, width], axis=1), (len(groups), 1))
    return np.concatenate([np.repeat(groups, _N_ELECTRIC, axis=0), electric], axis=1)


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


def _coefficients(s: FloatArray, curves: FloatArray, power: int) -> FloatArray:
    """Coefficients (n, N_DEPTH_TERMS, m) of curves (n, n_depth, m) = s^power p(s); nan is not fitted.

    High terms are held down just enough for paths with fewer steps than terms.
    """
    hold = np.diag(1e-4 * 1.6 ** np.arange(N_DEPTH_TERMS))
    out = np.empty((len(s), N_DEPTH_TERMS, curves.shape[2]))
    for i, along in enumerate(s):
        seen = np.isfinite(along)
        terms = depth_terms(along[seen]) * along[seen, None] ** power
        right = np.vstack([curves[i, seen], np.zeros((N_DEPTH_TERMS, curves.shape[2]))])
        out[i] = np.linalg.lstsq(np.vstack([terms, hold]), right, rcond=None)[0]
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
    grid = np.linspace(PATH[0], 1.0, 2 * N_DEPTH_TERMS)
    triangle = np.zeros((coefficients.shape[1],) * 2)
    for k, (power, weight) in enumerate(curves):
        own = slice(k * N_DEPTH_TERMS, (k + 1) * N_DEPTH_TERMS)
        terms = depth_terms(grid) * (weight * grid[:, None] ** power / np.sqrt(grid.size))
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
    rms = np.full((len(s), ERROR_POINTS.size), np.nan)
    for k, near in enumerate(np.abs(s[:, None, :] - ERROR_POINTS[:, None]).swapaxes(0, 1) <= np.diff(ERROR_POINTS)[0] / 2):
        squares = np.sum(np.where(near, missed, 0.0) ** 2, axis=1)
        np.divide(squares, near.sum(axis=1), out=rms[:, k], where=near.any(axis=1))
    logs = np.log(np.maximum(rms, 1e-12)) / 2
    logs = np.where(np.isfinite(logs), logs, np.nanmean(logs, axis=1, keepdims=True))
    network = train_network(features, logs, (16, 16), steps=steps, rng=rng, batch=512)

    sd = np.exp((error_weights(np.nan_to_num(s, nan=1.0)) @ network(features)[..., None])[..., 0])
    score = missed / sd
    scale = float(np.nanquantile(np.abs(score), 0.9)) / _Z90
    last = network.layers[-1].copy()
    last[-1] += np.float32(np.log(scale))

    # A handful of wild paths must not make the correlation.
    along = np.clip(score / scale, -4, 4)
    grid = np.linspace(PATH[0], 1.0, 2 * N_DEPTH_TERMS)
    curves = np.array([np.interp(grid, x[np.isfinite(x)], y[np.isfinite(x)]) for x, y in zip(s, along, strict=True)])
    covariance = curves.T @ curves / len(curves)
    size = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / size / size[:, None])
    modes = vectors[:, ::-1][:, :N_ERROR_MODES] * np.sqrt(values[::-1][:N_ERROR_MODES])
    # What the modes left out must not be missing from the standard deviation.
    modes /= np.linalg.norm(modes, axis=1, keepdims=True)
    along_s = np.linalg.lstsq(depth_terms(grid), modes, rcond=None)[0].T
    return Network(network.centre, network.width, (*network.layers[:-1], last)), np.asarray(along_s)


def _in_words(error: FloatArray) -> str:
    size = np.abs(error[np.isfinite(error)])
    return f"median {np.median(size):.2%}, 95 % below {np.quantile(size, 0.95):.2%}, worst {np.max(size):.1%}"
