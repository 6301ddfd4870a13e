"""From readings and the functions they may be made of to how well these fit: a line's slope, a linear model's evidence."""

from __future__ import annotations

import math

import numpy as np

from calib.lab.signal import integrated_time
from models.sensor import FloatArray


def slope_and_error(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope of the straight line through readings and its standard error, for readings that depend on their neighbours.

    Parameters
    ----------
    x, y : abscissa and readings, shape (n,), in the order of reading, in any units.

    Returns
    -------
    Slope of the least-squares line and its sd, in units of y over x; (0, inf) where x does not change.
    """
    u = x - float(np.mean(x))
    power = float(u @ u)
    if power == 0.0:
        return 0.0, math.inf
    slope = float(u @ y) / power
    residual = y - float(np.mean(y)) - slope * u
    freedom = max(y.size - 2, 1)
    return slope, math.sqrt(float(residual @ residual) / freedom / power * integrated_time(residual, 2))


def log_evidence(y: FloatArray, basis: FloatArray, prior: FloatArray, noise: float) -> FloatArray:
    """How probable readings are if they are a sum of given functions with unknown coefficients, to compare such models.

    Log density, but for a constant, of y = basis a + error, with a_k normal of sd `prior` and integrated over, errors normal,
    independent, of sd `noise`.

    Parameters
    ----------
    y : readings, shape (n,).
    basis : functions at the readings, of any number of models, shape (..., n, k).
    prior : sd of each coefficient, shape (k,).
    noise : sd of one reading, in the unit of y.

    Returns
    -------
    One for each model, shape (...).
    """
    scaled = basis * (prior / noise)
    turned = np.swapaxes(scaled, -1, -2)
    factor = np.linalg.cholesky(np.eye(prior.size) + turned @ scaled)
    half = np.linalg.solve(factor, (turned @ (y / noise))[..., None])[..., 0]
    roots = np.log(np.diagonal(factor, axis1=-2, axis2=-1))
    return np.asarray(0.5 * np.sum(half**2, axis=-1) - np.sum(roots, axis=-1), dtype=float)


def fitted(y: FloatArray, basis: FloatArray, prior: FloatArray, noise: float) -> FloatArray:
    """Draw the most probable curve through readings under the model of `log_evidence`, shape (n,), in the unit of y.

    Parameters
    ----------
    y, basis, prior, noise : as in `log_evidence`.
    """
    scaled = basis * (prior / noise)
    a = np.linalg.solve(np.eye(prior.size) + scaled.T @ scaled, scaled.T @ (y / noise))
    return np.asarray(basis @ (prior * a))
