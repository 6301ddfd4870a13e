"""From a `TrainingSet` to a `Surrogate`: its networks, and from the paths kept out of the fit its error.

The networks say the coefficients of polynomials along a path, and what their training makes small is what these polynomials
miss of the path's own points, not of other coefficients: fitting coefficients, which trade off against each other, costs twice
the error. One path in eight is kept out (of few, one in four). Of what the fit misses there, networks learn the standard
deviation along the path, and its correlation along the path gives modes of the error's covariance, scaled so that 90 % of what
was kept out lies inside the 90 % band.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np
import numpy.typing as npt

from models.fem import one_thread
from models.sensor import BoolArray, FloatArray, IntArray
from models.surrogate.domain import (
    COMPRESSION,
    DEPTH,
    DIELECTRIC,
    ELECTRODE,
    N_MECHANICAL,
    PADDING,
    PATH,
    SENSOR,
    electric_features,
    inside,
    with_stiffening,
)
from models.surrogate.network import Network, least_squares, train_network
from models.surrogate.surrogate import (
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
    share_of_family,
    smooth_end,
)
from models.surrogate.training import DIELECTRIC_POINTS, ELECTRODE_POINTS, TrainingSet, design_points

#: Hidden layers of the networks of mechanics and of capacitance, of those that add to them for another family, and steps of
#: their training.
HIDDEN = ((128, 128, 128), (160, 160, 160))
HIDDEN_OF_FAMILY = ((64, 64, 64), (64, 64, 64))
STEPS = 120_000

#: Where most sensors of grippers lie, as h_s/R, h_p/R, a/R and E_p/E, and the widths of that region in logarithms. In a
#: second half of the training a path there has up to `_USUAL_WEIGHT` times more weight: posteriors of such sensors are narrower
#: than the error that is good enough for all designs.
_USUAL = np.array([0.15, 0.22, 2.0, 1.0])
_USUAL_WIDTH = np.array([0.6, 0.9, 0.5, 0.6])
_USUAL_WEIGHT = 100.0
_THIN_PADDING = 0.03  # added to h_p/R before its logarithm

#: Windows in s over which what a fit missed is averaged: their middles.
_WINDOWS = np.array([0.19, 0.37, 0.55, 0.73, 0.91])

# Most steps of the training of the error's networks, for each path, and parts of the paths that are left out in turn.
_ERROR_STEPS = 15
_ERROR_PARTS = 4

#: Half width of a normal 90 % interval in standard deviations.
_Z90 = 1.645


def worst_points(surrogate: Surrogate, n: int, seed: int) -> FloatArray:
    """Points (n, 5) for new training paths where `surrogate` states the largest errors, of force or of capacitance.

    Drawn without repetition from eight times as many points all over the range, each with a chance in proportion to its squared
    error (Efraimidis & Spirakis, Inf. Process. Lett. 97 (2006) 181).
    """
    rng = np.random.default_rng(seed)
    points = design_points(8 * n, seed, surrogate.family)
    electric = np.stack([rng.uniform(*DIELECTRIC, len(points)), rng.uniform(*ELECTRODE, len(points))], axis=1)
    error = surrogate.own_error(np.concatenate([points, electric], axis=1))
    weight = np.sum((error / np.mean(error, axis=0)) ** 2, axis=1)
    return np.asarray(points[np.argsort(np.log(rng.uniform(size=len(points))) / weight)[::-1][:n]])


#: Fewest training paths that `fit_surrogate` takes, and steps a path must have to be of use.
LEAST_PATHS = 64
_LEAST_STEPS = 8

# From so many paths on, one in eight tells enough of the error (of fewer, one in four is kept out), and the training has a
# second half.
_MANY_PATHS = 4096

# From the end of a path to `S_END`, where it has no steps, its curves go on as a quadratic through so many of its last steps,
# at these shares of the way, with little weight: a polynomial left to itself would be wild.
_LAST_STEPS = 6
_ONWARD = np.array([0.5, 1.0])
_ONWARD_WEIGHT = 0.1


def fit_surrogate(
    data: TrainingSet,
    *,
    base: Surrogate | None = None,
    hidden: tuple[tuple[int, ...], tuple[int, ...]] | None = None,
    steps: int = STEPS,
    seed: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Surrogate:
    """Train every network, then the networks of the error on the paths kept out.

    Parameters
    ----------
    base : surrogate of neo-Hookean layers without friction, which that of another family adds to.
    hidden : layers of the networks of mechanics and of capacitance; the others are small. Default `HIDDEN`, above a base
        `HIDDEN_OF_FAMILY`.
    steps : of their training, first with equal weight of all paths, then, of `_MANY_PATHS` and more, as many again with more
        weight near usual grippers.
    progress : called with the name of the network, the steps done and their number.

    Raises
    ------
    ValueError
        If fewer than `LEAST_PATHS` paths are of use.
    """
    hidden = hidden if hidden is not None else HIDDEN if base is None else HIDDEN_OF_FAMILY
    data = data.only(data.n_step >= _LEAST_STEPS)
    n_run = len(data.groups)
    if n_run < LEAST_PATHS:
        raise ValueError(f"{n_run} training paths are too few; give at least {LEAST_PATHS}")
    # The points' order is that of the groups: some of a random order are spread over all of them.
    rng = np.random.default_rng(seed)
    fitted = np.ones(n_run, dtype=bool)
    fitted[rng.permutation(n_run)[:: 8 if n_run >= _MANY_PATHS else 4]] = False

    def told(name: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, total: progress(name, done, total)

    # Runs first, then every electrode of every run.
    groups, log_change, share_of_change = _electric_curves(data)
    plain = electric_features(groups)
    electric = with_stiffening(plain, groups, data.family)
    features = with_stiffening(plain[::_N_ELECTRIC, :N_MECHANICAL], data.groups, data.family)
    rows_of = np.arange(len(groups)) // _N_ELECTRIC
    log_end, certain = _ends(data)
    end = train_network(
        features[fitted],
        least_squares(log_end[fitted, None], np.where(certain, 1.0, 0.1)[fitted]),
        (24, 24, 1),
        steps=max(steps // 4, 1),
        rng=rng,
        batch=512,
        progress=told("end of the paths"),
    )
    thinned = (data.groups[:, SENSOR] + data.groups[:, PADDING]) * np.exp(end(features)[:, 0])
    limit, reach = np.full(n_run, DEPTH), smooth_end(thinned)
    if base is not None:
        limit, reach = base.ends(groups[::_N_ELECTRIC], plain[::_N_ELECTRIC])
    s = np.sqrt(data.depth / reach[:, None])
    s[s > S_END * (1 + 1e-9)] = np.nan

    # Curves (n, n_curve, n_depth). The contact radius steps from node to node and counts less.
    share = share_of_family(data.groups, data.family)
    mechanical = np.stack(
        [np.log(data.force / closed_force(data.groups, data.depth)), np.log(data.contact_radius / np.sqrt(data.depth))], axis=1
    )
    if base is not None:
        below = base.coefficients(groups, plain).reshape(-1, 3, N_DEPTH_TERMS)
        mechanical = mechanical - np.stack([_curve(below[::_N_ELECTRIC, k], s, 1) for k in range(2)], axis=1)
        log_change = log_change - _curve(below[:, 2], s[rows_of], 0)
    weight = np.broadcast_to(np.array([[1.0], [0.3]]), mechanical.shape)
    # Few paths would be fitted too closely by a second half: 2,048 of Gent's law were, to 0.50 instead of 0.42 % at 95 %.
    usual = _emphasis(data.groups) if n_run >= _MANY_PATHS else None
    first, second = rng.spawn(2)
    jobs = (
        (features, _curves(s, mechanical, weight, 1), fitted, share, usual, hidden[0], steps, first, told("mechanics")),
        (
            electric,
            _curves(s, log_change[:, None], share_of_change[:, None], 0),
            fitted[rows_of],
            share[rows_of],
            None if usual is None else usual[rows_of],
            hidden[1],
            steps,
            second,
            told("capacitance"),
        ),
    )
    with one_thread(), ThreadPoolExecutor(2) as pool:
        mechanics, capacitance = pool.map(lambda job: _train_curves(*job), jobs)

    # What the fit misses where the surrogate answers: on paths kept out, inside the range, to the depth it goes to.
    out = np.flatnonzero(~fitted & inside(groups[::_N_ELECTRIC], data.family))
    rows = (out[:, None] * _N_ELECTRIC + np.arange(_N_ELECTRIC)).ravel()
    s_out = np.where(data.depth <= np.minimum(limit, thinned)[:, None], s, np.nan)[out]
    s_rows = np.repeat(s_out, _N_ELECTRIC, axis=0)
    force = share[out, None] * mechanics(features[out])[:, :N_DEPTH_TERMS]
    change = share[rows_of[rows], None] * capacitance(electric[rows])
    missed_force = mechanical[out, 0] - _curve(force, s_out, 1)
    missed_change = share_of_change[rows] * (log_change[rows] - _curve(change, s_rows, 0))
    force_sd, force_modes = _learn_error(features[out], s_out, missed_force, out.size, max(steps // 8, 1), rng)
    capacitance_sd, capacitance_modes = _learn_error(electric[rows], s_rows, missed_change, out.size, max(steps // 8, 1), rng)
    again = "" if usual is None else " and as many with more weight near usual grippers"
    sizes = ", ".join(" x ".join(map(str, layers)) for layers in hidden)
    return Surrogate(
        end,
        mechanics,
        capacitance,
        force_sd,
        capacitance_sd,
        force_modes,
        capacitance_modes,
        {
            "model": data.family.words,
            "finite elements": f"Q2/P1, accuracy {data.accuracy:g}, K/mu 1e4",
            "training paths": f"{n_run}, {sum(map(bool, data.failures))} of them without equilibrium to their end",
            "training hash (SHA-256)": data.digest,
            "networks": f"{sizes}, {N_DEPTH_TERMS} terms in depth, {steps} steps of SOAP{again}, seed {seed}",
            "error of force": f"{_in_words(missed_force)} ({out.size} paths kept out of the fit)",
            "error of capacitance change": f"{_in_words(missed_change)} (likewise)",
            "numpy": version("numpy"),
            "scipy": version("scipy"),
            "date": datetime.now(UTC).date().isoformat(),
        },
        data.family,
        base,
    )


_N_ELECTRIC = DIELECTRIC_POINTS.size * ELECTRODE_POINTS.size


def _emphasis(groups: FloatArray) -> FloatArray:
    """Weight of a path (n,) in the second half of the training: one far from `_USUAL`."""
    plain, middle = groups[:, : _USUAL.size].copy(), _USUAL.copy()
    plain[:, PADDING] += _THIN_PADDING
    middle[PADDING] += _THIN_PADDING
    away = np.log(plain / middle) / _USUAL_WIDTH
    return np.asarray(1 + _USUAL_WEIGHT * np.exp(-np.sum(away**2, axis=1) / 2))


def _electric_curves(data: TrainingSet) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Every t_d/h_s and a_e/a of every run: groups (n, 7), log of C/C0 - 1 over its closed form, and weights, (n, n_depth).

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
    return groups, np.log(change / closed), change / (change + CHANGE_SCALE)


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


@dataclass(frozen=True, eq=False)
class _Curves:
    """Curves along paths that a network is to follow, in single precision.

    Attributes
    ----------
    terms : (n_path, N_DEPTH_TERMS, n_point), s^power times the polynomials' terms, turned so that they are orthonormal.
    turn : (N_DEPTH_TERMS, N_DEPTH_TERMS), from coefficients of the turned terms to those of the terms.
    values, weight : (n, n_curve, n_point), what to follow, and the factor of what is missed of it; n a multiple of n_path.
    """

    terms: npt.NDArray[np.float32]
    turn: FloatArray
    values: npt.NDArray[np.float32]
    weight: npt.NDArray[np.float32]


def _curves(s: FloatArray, values: FloatArray, weight: FloatArray, power: int) -> _Curves:
    """Curves (n, n_curve, n_depth) over s (n_path, n_depth), nan where they are not known, and on from there to `S_END`.

    The first steps, where few elements touch, hold what noise there is and weigh less.
    """
    per_path = len(values) // len(s)
    n_point = s.shape[1] + _ONWARD.size
    points = np.zeros((len(s), n_point))
    at, sizes = (np.zeros((len(values), values.shape[1], n_point), np.float32) for _ in range(2))
    for i, along in enumerate(s):
        seen = np.flatnonzero(np.isfinite(along))
        last = seen[-_LAST_STEPS:]
        onward = along[last[-1]] + (S_END - along[last[-1]]) * _ONWARD
        go_on = (np.vander(onward, 3) @ np.linalg.pinv(np.vander(along[last], 3))).T
        own = slice(i * per_path, (i + 1) * per_path)
        points[i] = np.concatenate([np.nan_to_num(along), onward])
        at[own, :, seen] = values[own][:, :, seen]
        at[own, :, s.shape[1] :] = values[own][:, :, last] @ go_on
        sizes[own, :, seen] = weight[own][:, :, seen] * np.clip(along[seen] / 0.3, 0.3, 1.0)
        sizes[own, :, s.shape[1] :] = _ONWARD_WEIGHT * weight[own][:, :, last[-1:]]
    grid = np.linspace(PATH[0], S_END, 2 * N_DEPTH_TERMS)
    turn = np.linalg.inv(np.linalg.qr(depth_terms(grid).T / np.sqrt(grid.size))[1])
    terms = turn.T @ depth_terms(points) * points[:, None] ** power
    return _Curves(terms.astype(np.float32), turn, at, sizes)


def _train_curves(
    features: FloatArray,
    curves: _Curves,
    fitted: BoolArray,
    share: FloatArray,
    usual: FloatArray | None,
    hidden: tuple[int, ...],
    steps: int,
    rng: np.random.Generator,
    progress: Callable[[int, int], None] | None,
) -> Network:
    """A network to the coefficients (n, n_curve * N_DEPTH_TERMS) of `curves`, each `share` (n,) times what the network says.

    All curves weigh the same at first, then each `usual` (n,) more, if it is given. The network learns what is left of the
    mean curve, as coefficients of the turned terms; its last layer is then turned to those of the terms themselves.
    """
    rows_fitted = np.flatnonzero(fitted)
    n_curve, n_point = curves.values.shape[1:]
    per_path = len(curves.values) // len(curves.terms)
    scale = share.astype(np.float32)[:, None, None]

    def parts(rows: IntArray) -> tuple[Any, Any, Any]:
        return curves.terms[rows // per_path], curves.values[rows], curves.weight[rows]

    normal, right = np.zeros((n_curve, N_DEPTH_TERMS, N_DEPTH_TERMS)), np.zeros((n_curve, N_DEPTH_TERMS, 1))
    for rows in np.array_split(rows_fitted, 1 + len(rows_fitted) // 4096):
        terms, values, weight = parts(rows)
        leads = weight[:, :, None] * scale[rows, None] * terms[:, None]
        normal += np.sum(leads @ np.swapaxes(leads, 2, 3), axis=0, dtype=float)
        right += np.sum(leads @ (weight * values)[..., None], axis=0, dtype=float)
    mean = np.linalg.solve(normal + 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(N_DEPTH_TERMS), right)
    mean = mean[..., 0].astype(np.float32)

    def slope(out: npt.NDArray[Any], points: IntArray, emphasis: npt.NDArray[Any]) -> npt.NDArray[Any]:
        rows = rows_fitted[points]
        terms, values, weight = parts(rows)
        coefficients = scale[rows] * (out.reshape(-1, n_curve, N_DEPTH_TERMS) + mean)
        missed = emphasis[rows] * weight * weight * (coefficients @ terms - values)
        slopes = scale[rows] * (missed @ np.swapaxes(terms, 1, 2))
        return np.asarray(slopes.reshape(len(rows), -1) * np.float32(2 / len(rows) / n_point))

    sizes = (*hidden, n_curve * N_DEPTH_TERMS)
    network: Network | None = None
    halves = [np.ones(len(curves.values))] if usual is None else [np.ones(len(curves.values)), usual]
    for half, emphasis in enumerate(halves):
        network = train_network(
            features[rows_fitted],
            partial(slope, emphasis=emphasis.astype(np.float32)[:, None, None]),
            sizes,
            steps=steps,
            rng=rng,
            progress=None if progress is None else _counted_on(progress, half * steps, len(halves) * steps),
            start=network,
        )
    assert network is not None
    last = network.layers[-1].astype(float)
    last[-1] += mean.ravel()
    last = np.concatenate([part @ curves.turn.T for part in np.split(last, n_curve, axis=1)], axis=1)
    return Network(network.centre, network.width, (*network.layers[:-1], last.astype(np.float32)))


def _counted_on(progress: Callable[[int, int], None], done: int, total: int) -> Callable[[int, int], None]:
    return lambda n, _: progress(done + n, total)


def _learn_error(
    features: FloatArray, s: FloatArray, missed: FloatArray, n_path: int, steps: int, rng: np.random.Generator
) -> tuple[Network, FloatArray]:
    """From what a fit missed (n, n_depth) at s: a network to the log of its sd, and the modes of its correlation.

    Rows belong to `n_path` paths, one after the other. The network's scale is that of the scores of paths by networks trained
    without them, a quarter of the paths at a time.
    """
    squares = np.full((len(s), _WINDOWS.size), np.nan)
    for k, middle in enumerate(_WINDOWS):
        near = np.abs(s - middle) <= (_WINDOWS[1] - _WINDOWS[0]) / 2
        total = np.sum(np.where(near, missed, 0.0) ** 2, axis=1)
        np.divide(total, near.sum(axis=1), out=squares[:, k], where=near.any(axis=1))
    logs = np.log(np.maximum(squares, 1e-12)) / 2
    logs = np.where(np.isfinite(logs), logs, np.nanmean(logs, axis=1, keepdims=True))
    # Three terms through five windows: no wild ends.
    wanted = logs @ np.linalg.pinv(depth_terms(_WINDOWS, N_ERROR_TERMS).T).T
    along = depth_terms(np.nan_to_num(s, nan=1.0), N_ERROR_TERMS)

    def trained(rows: BoolArray) -> Network:
        sizes = (16, 16, N_ERROR_TERMS)
        most = min(steps, _ERROR_STEPS * n_path)
        return train_network(features[rows], least_squares(wanted[rows]), sizes, steps=most, rng=rng, batch=512)

    def scores(network: Network, rows: BoolArray) -> FloatArray:
        return np.asarray(missed[rows] / np.exp((network(features[rows])[:, None] @ along[rows])[:, 0]))

    part = np.repeat(rng.permutation(n_path) % _ERROR_PARTS, len(s) // n_path)
    unseen = np.concatenate([scores(trained(part != k), part == k) for k in range(_ERROR_PARTS)])
    scale = float(np.nanquantile(np.abs(unseen), 0.9)) / _Z90
    everything = np.ones(len(s), dtype=bool)
    network = trained(everything)
    score = scores(network, everything)
    last = network.layers[-1].copy()
    last[-1, 0] += np.float32(np.log(scale))

    # A handful of wild paths must not make the correlation.
    clipped = np.clip(score / scale, -4, 4)
    grid = np.linspace(0.0, S_END, 2 * N_DEPTH_TERMS)
    curves = np.array([np.interp(grid, x[np.isfinite(x)], y[np.isfinite(x)]) for x, y in zip(s, clipped, strict=True)])
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
