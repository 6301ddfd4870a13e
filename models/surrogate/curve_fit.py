"""From curves along paths to a network that says, for any design, the coefficients of polynomials that follow them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from models.sensor import BoolArray, FloatArray, IntArray
from models.surrogate.coordinates import N_DEPTH_TERMS, S_END, depth_terms
from models.surrogate.domain import PATH
from models.surrogate.network import Network, train_network

# From the end of a path to `S_END`, where it has no steps, its curves go on as a quadratic through so many of its last steps,
# at these shares of the way, with little weight: a polynomial left to itself would be wild.
_LAST_STEPS = 6
_ONWARD = np.array([0.5, 1.0])
_ONWARD_WEIGHT = 0.1


def curve(coefficients: FloatArray, s: FloatArray, power: int) -> FloatArray:
    """Curves that coefficients stand for.

    Parameters
    ----------
    coefficients : (n, N_DEPTH_TERMS).
    s : places along the path, (n, n_depth).
    power : of s that the polynomial is multiplied with.

    Returns
    -------
    Shape (n, n_depth); nan where s is.
    """
    values = s**power * (coefficients[:, None] @ depth_terms(np.nan_to_num(s, nan=1.0)))[:, 0]
    return np.where(np.isfinite(s), values, np.nan)  # nan to the power of nothing is one


@dataclass(frozen=True, eq=False)
class PathCurves:
    """Curves along paths that a network is to follow, in single precision.

    Attributes
    ----------
    terms : (n_path, N_DEPTH_TERMS, n_point), s^power and what fades times the polynomials' terms, turned so that these are
        orthonormal.
    turn : (N_DEPTH_TERMS, N_DEPTH_TERMS), from coefficients of the turned terms to those of the terms.
    values, weight : (n, n_curve, n_point), what to follow, and the factor of what is missed of it; n a multiple of n_path.
    """

    terms: npt.NDArray[np.float32]
    turn: FloatArray
    values: npt.NDArray[np.float32]
    weight: npt.NDArray[np.float32]


def curves_along(
    s: FloatArray,
    values: FloatArray,
    weight: FloatArray,
    power: int,
    fade: Callable[[FloatArray], FloatArray] = np.ones_like,
) -> PathCurves:
    """Prepare curves for the training: on from where they end to `S_END`, weighted, in single precision.

    The first steps, where few elements touch, hold what noise there is and weigh less.

    Parameters
    ----------
    s : places along the paths, (n_path, n_depth), nan where they have ended.
    values : (n, n_curve, n_depth), the curves; n a multiple of n_path, rows of one path together.
    weight : (n, n_curve, n_depth), of what is missed of them.
    power : of s that the polynomials are multiplied with.
    fade : from places along the paths (n_path, n_point) to what the polynomials are multiplied with there beside it.

    Returns
    -------
    What `train_curves` takes.
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
    terms = turn.T @ depth_terms(points) * points[:, None] ** power * fade(points)[:, None]
    return PathCurves(terms.astype(np.float32), turn, at, sizes)


def train_curves(
    features: FloatArray,
    curves: PathCurves,
    fitted: BoolArray,
    share: FloatArray,
    emphasis: FloatArray | None,
    hidden: tuple[int, ...],
    steps: int,
    rng: np.random.Generator,
    progress: Callable[[int, int], None] | None,
    start: Network | None = None,
) -> Network:
    """Train a network that says, for a design, the coefficients of polynomials which follow its curves.

    All curves weigh the same at first, then, in a second half, as `emphasis` has it; a network that goes on has that half
    alone. The network learns what is left of the mean curve, as coefficients of the turned terms; its last layer is then turned
    to those of the terms themselves.

    Parameters
    ----------
    features : (n, n_feature), of the designs.
    curves : of the designs.
    fitted : (n,), which take part.
    share : (n,), by which what the network says is multiplied.
    emphasis : (n,), weights of the second half; None for no second half.
    hidden : sizes of the hidden layers.
    steps : of each half.
    rng : of the network's start and the order of the points.
    progress : called with the steps done and their number.
    start : network of these sizes, of curves along the same places, to go on from; a random one if None.

    Returns
    -------
    A network to coefficients (n, n_curve * N_DEPTH_TERMS), to be multiplied by the share.

    Raises
    ------
    ValueError
        If `start` is of other sizes.
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

    def slope(out: npt.NDArray[Any], points: IntArray, weights: npt.NDArray[Any]) -> npt.NDArray[Any]:
        rows = rows_fitted[points]
        terms, values, weight = parts(rows)
        coefficients = scale[rows] * (out.reshape(-1, n_curve, N_DEPTH_TERMS) + mean)
        missed = weights[rows] * weight * weight * (coefficients @ terms - values)
        slopes = scale[rows] * (missed @ np.swapaxes(terms, 1, 2))
        return np.asarray(slopes.reshape(len(rows), -1) * np.float32(2 / len(rows) / n_point))

    sizes = (*hidden, n_curve * N_DEPTH_TERMS)
    back = np.asarray(np.linalg.inv(curves.turn), dtype=float)
    network = None if start is None else _moved(start, 0 * mean, back, -mean)
    halves = [np.ones(len(curves.values))] if start is None or emphasis is None else []
    halves += [] if emphasis is None else [emphasis]
    for half, weights in enumerate(halves):
        network = train_network(
            features[rows_fitted],
            partial(slope, weights=weights.astype(np.float32)[:, None, None]),
            sizes,
            steps=steps,
            rng=rng,
            progress=None if progress is None else _counted_on(progress, half * steps, len(halves) * steps),
            start=network,
        )
    assert network is not None
    return _moved(network, mean, curves.turn, 0 * mean)


def _moved(network: Network, before: FloatArray, turn: FloatArray, after: FloatArray) -> Network:
    """A network of coefficients (n_curve, N_DEPTH_TERMS) with something added to them before they are turned, and after."""
    last = network.layers[-1].astype(float)
    last[-1] += before.ravel()
    last = np.concatenate([part @ turn.T for part in np.split(last, len(before), axis=1)], axis=1)
    last[-1] += after.ravel()
    return Network(network.centre, network.width, (*network.layers[:-1], last.astype(np.float32)))


def _counted_on(progress: Callable[[int, int], None], done: int, total: int) -> Callable[[int, int], None]:
    return lambda n, _: progress(done + n, total)
