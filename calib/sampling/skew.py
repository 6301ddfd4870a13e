"""Residuals of lines that are long on one side in, residuals with tails alike on both out; back, and what makes them so.

The scales are long on one side, as what is nearly zero has no end in its logarithm, and there walkers would stick. With r the
residual of such a line, the one with tails alike on both sides is (Jones & Pewsey, Biometrika 96 (2009) 761, equation (2))

    t = sinh(delta arsinh((r - xi) / eta) - epsilon).                                                                 (1)

Its constants stand in an array `skew`: epsilon, log delta, xi and log eta; all zero for t = r.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from calib.priors import log_mass
from models.sensor import FloatArray

# Bounds of epsilon, log delta, xi and log eta of (1), and the weight, in draws, of the assumption that the first two are zero.
_SKEWED, _SKEW_PULL = (1.0, 0.5, 1.0, 0.7), 20.0
# The same bounds for a line with an end, of whose density a part may be cut off; where arsinh of (1) counts as that of no end.
_CUT, _ENDLESS = (1.0, 0.5, 3.0, 1.2), 20.0


def straightened(r: FloatArray, skew: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Turn residuals that are long on one side into such with tails alike on both, t of (1), and give its slope.

    Parameters
    ----------
    r : (n_draw, k), residuals of k lines.
    skew : (k, 4).

    Returns
    -------
    t and log dt / dr, (n_draw, k) each.
    """
    epsilon, log_delta, xi, log_eta = skew.T
    s = (r - xi) * np.exp(-log_eta)
    z = np.exp(log_delta) * np.arcsinh(s) - epsilon
    return np.sinh(z), log_delta - log_eta + np.log(np.cosh(z)) - 0.5 * np.log1p(s**2)


def skewed(t: FloatArray, skew: FloatArray) -> FloatArray:
    """Turn residuals with tails alike on both sides into such that are long on one: r of (1), the inverse of `straightened`.

    Parameters
    ----------
    t : (n_draw, k), residuals of k lines.
    skew : (k, 4).
    """
    epsilon, log_delta, xi, log_eta = skew.T
    return np.asarray(xi + np.exp(log_eta) * np.sinh((np.arcsinh(t) + epsilon) * np.exp(-log_delta)), dtype=float)


def straight_ends(ends: FloatArray, skew: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where a line that ends in r ends in t of (1), (n_draw,) each; far out where it has no end.

    Parameters
    ----------
    ends : (2, n_draw), of r; infinite where there is none.
    skew : (4,).
    """
    epsilon, log_delta, xi, log_eta = skew
    arc = np.exp(log_delta) * np.arcsinh((ends - xi) * np.exp(-log_eta)) - epsilon
    low, high = np.sinh(np.clip(arc, -_ENDLESS, _ENDLESS))
    return low, high


def fit_skew(r: FloatArray, share: FloatArray, effective: float, ends: FloatArray | None = None) -> FloatArray:
    """Fit the constants (4,) of (1) to the residuals of a line, as if t were normal: (1) takes the tails, too.

    Parameters
    ----------
    r : (n_draw,), the residuals.
    share : (n_draw,), weight of each draw; their sum is 1.
    effective : how many draws of equal weight would tell as much.
    ends : (2, n_draw), between which r lies in a line with an end, whose density is cut off there; None for no end.
    """
    pull = np.array([0.5, 0.5, 0.0, 0.0]) * _SKEW_PULL / effective

    def misfit(skew: FloatArray) -> tuple[float, FloatArray]:
        epsilon, log_delta, xi, log_eta = skew
        s = (r - xi) * np.exp(-log_eta)
        arc, root, delta = np.arcsinh(s), np.sqrt(1 + s**2), np.exp(log_delta)
        z = delta * arc - epsilon
        t, c = np.sinh(z), np.cosh(z)
        log_density = log_delta - log_eta + np.log(c / root) - t**2 / 2
        by_z = t / c - t * c
        by_s = by_z * delta / root - s / root**2
        slopes = np.array([-by_z, 1 + by_z * delta * arc, -by_s * np.exp(-log_eta), -1 - by_s * s]) @ share
        value, by_skew = float(pull @ skew**2 - share @ log_density), 2 * pull * skew - slopes
        if ends is None:
            return value, by_skew
        log_kept, slopes = _kept(ends, skew)
        return value + float(share @ log_kept), by_skew + slopes @ share

    bounds = [(-most, most) for most in (_SKEWED if ends is None else _CUT)]
    found = minimize(misfit, np.zeros(4), jac=True, method="L-BFGS-B", bounds=bounds)
    return np.asarray(found.x, dtype=float)


def _kept(ends: FloatArray, skew: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithm of the mass between `ends` (2, n_draw) of r by (1), (n_draw,), and its slopes by the constants, (4, n_draw)."""
    _, log_delta, xi, log_eta = skew
    t = np.stack(straight_ends(ends, skew))
    log_kept = log_mass(t[0], t[1])
    by_t = np.array([[-1.0], [1.0]]) * np.exp(-(t**2) / 2 - 0.5 * np.log(2 * np.pi) - log_kept)
    by_z = by_t * np.sqrt(1 + t**2)
    s = np.where(np.isfinite(ends), (ends - xi) * np.exp(-log_eta), 0.0)
    by_s = by_z * np.exp(log_delta) / np.sqrt(1 + s**2)
    slopes = np.stack([-by_z, by_z * np.exp(log_delta) * np.arcsinh(s), -by_s * np.exp(-log_eta), -by_s * s])
    return log_kept, np.asarray(np.sum(slopes, axis=1), dtype=float)
