"""From what a fit missed on paths kept out of it to its error: a network of its size, and the modes of its correlation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from models.sensor import BoolArray, FloatArray, IntArray
from models.surrogate.coordinates import N_DEPTH_TERMS, S_END, depth_terms
from models.surrogate.network import Network, least_squares, train_network
from models.surrogate.pressed import N_ERROR_MODES, N_ERROR_TERMS, N_MODE_TERMS

#: Windows in s over which what a fit missed is averaged: their middles, and how far they reach to either side.
_WINDOWS = np.array([0.19, 0.37, 0.55, 0.73, 0.91])
_REACH = (_WINDOWS[1] - _WINDOWS[0]) / 2

# Most steps of the training of the error's networks, for each path, and parts of the paths that are left out in turn.
_ERROR_STEPS = 15
_ERROR_PARTS = 4

#: Half width of a normal 90 % interval in standard deviations.
Z90 = 1.645


def scaled(
    trained: Callable[[BoolArray], Network], scores: Callable[[Network, BoolArray], FloatArray], path: IntArray
) -> tuple[Network, FloatArray]:
    """Train a network of an error, with the scale at which 90 % of scores by networks that had not seen them are in its band.

    Parameters
    ----------
    trained : from rows (n,) to a network whose first output is the logarithm of the error's sd.
    scores : of a network and rows (n,), what was missed there over the sd.
    path : (n,), numbers of the paths that rows are of, in a random order: a part of them at a time is left out.

    Returns
    -------
    The network, and the scores of all rows by networks trained without their path, at that scale.
    """
    part = path % _ERROR_PARTS
    parts = [scores(trained(part != k), part == k) for k in range(_ERROR_PARTS)]
    unseen = np.empty((len(part), *parts[0].shape[1:]))
    for k, own in enumerate(parts):
        unseen[part == k] = own
    scale = float(np.nanquantile(np.abs(unseen), 0.9)) / Z90
    network = trained(np.ones(len(part), dtype=bool))
    return _raised(network, np.array([np.log(scale)])), unseen / scale


def _raised(network: Network, by: FloatArray) -> Network:
    """The network with so much more (n,) in the first of its outputs, whatever goes in."""
    last = network.layers[-1].copy()
    last[-1, : by.size] += by.astype(np.float32)
    return Network(network.centre, network.width, (*network.layers[:-1], last))


def _through_windows(values: FloatArray) -> FloatArray:
    """Terms along the path (..., N_ERROR_TERMS) through values (..., n_window): three through five, no wild ends."""
    return np.asarray(values @ np.linalg.pinv(depth_terms(_WINDOWS, N_ERROR_TERMS).T).T)


def learn_error(
    features: FloatArray, s: FloatArray, missed: FloatArray, n_path: int, steps: int, rng: np.random.Generator
) -> tuple[Network, FloatArray]:
    """Learn from what a fit missed how large its error is for any design, and how it goes along the path.

    The network's scale along the path is that of the scores of paths by networks trained without them, a quarter of the paths
    at a time.

    Parameters
    ----------
    features : (n, n_feature), of the designs; rows of one path together, paths one after the other.
    s : places along the paths, (n, n_depth), nan where they have ended.
    missed : curve less fit there, (n, n_depth).
    n_path : number of paths.
    steps : most steps of the training.
    rng : of the networks' start and the parts left out.

    Returns
    -------
    A network to the N_ERROR_TERMS of the logarithm of the error's sd, and the modes (n_mode, N_MODE_TERMS) of its correlation.
    """
    squares = np.full((len(s), _WINDOWS.size), np.nan)
    for k, middle in enumerate(_WINDOWS):
        near = np.abs(s - middle) <= _REACH
        total = np.sum(np.where(near, missed, 0.0) ** 2, axis=1)
        np.divide(total, near.sum(axis=1), out=squares[:, k], where=near.any(axis=1))
    logs = np.log(np.maximum(squares, 1e-12)) / 2
    logs = np.where(np.isfinite(logs), logs, np.nanmean(logs, axis=1, keepdims=True))
    wanted = _through_windows(logs)
    along = depth_terms(np.nan_to_num(s, nan=1.0), N_ERROR_TERMS)

    def trained(rows: BoolArray) -> Network:
        sizes = (16, 16, N_ERROR_TERMS)
        most = min(steps, _ERROR_STEPS * n_path)
        return train_network(features[rows], least_squares(wanted[rows]), sizes, steps=most, rng=rng, batch=512)

    def scores(network: Network, rows: BoolArray) -> FloatArray:
        return np.asarray(missed[rows] / np.exp((network(features[rows])[:, None] @ along[rows])[:, 0]))

    network = _even_along(*scaled(trained, scores, np.repeat(rng.permutation(n_path), len(s) // n_path)), s)

    # A handful of wild paths must not make the correlation.
    clipped = np.clip(scores(network, np.ones(len(s), dtype=bool)), -4, 4)
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
    return network, np.asarray(smooth.T)


def _even_along(network: Network, scores: FloatArray, s: FloatArray) -> Network:
    """The network with the scale at which 90 % of scores (n, n_depth) at places s are in its band all along the path.

    Logarithms of what is missed say how large it is in the middle of many, not how far the largest lie out, and these do not
    lie out as far at every depth.
    """
    sizes = np.abs(scores)
    scales = np.array([np.nanquantile(sizes[np.abs(s - middle) <= _REACH], 0.9) for middle in _WINDOWS]) / Z90
    change = _through_windows(np.log(scales))
    left = sizes / np.exp(change @ depth_terms(np.nan_to_num(s, nan=1.0), N_ERROR_TERMS))
    change[0] += np.log(np.nanquantile(left, 0.9) / Z90)
    return _raised(network, change)
