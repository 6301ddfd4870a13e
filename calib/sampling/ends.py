"""Normal scores of a quantity that has an end in, values that others follow in straight lines out; and back.

A quantity with an end (a compliance that is not negative, a coefficient of friction from 0 to 0.6) is sampled as z, the normal
score of its prior's mass below it. Near the end z goes to infinity while the value v hardly changes, and what depends on the
quantity follows v. With low and high, in the sds of a normal density that is cut off there,

    Phi(v) = Phi(low) Phi(-z) + Phi(high) Phi(z),   dv / dz = phi(z) / phi(v) (Phi(high) - Phi(low)).                (1)
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri_exp

from calib.priors import HalfNormal, Prior, TruncatedNormal, Uniform, log_mass
from models.sensor import FloatArray

#: Ends of what has none: v = z.
ENDLESS = (-np.inf, np.inf)

# Half of the width, in sds, of the piece of a normal density that stands for a uniform one: the same to half a percent.
_FLAT = 0.1
# So far, in sds, an end is none: 3e-7 of a normal density is cut off there.
_FAR = 5.0
# So near, in sds, to an end no value is told from it: that far out (z = 6.8) lies 1e-11 of a prior; how far z is taken at most.
_INSIDE, _FARTHEST = 1e-12, 30.0


def ends_of(prior: Prior) -> tuple[float, float]:
    """Where a prior ends, in the sds of a normal density that is cut off there; infinite where it does not.

    Parameters
    ----------
    prior : of a quantity. A log-normal one has no end: its logarithm is what others follow.
    """
    if isinstance(prior, HalfNormal):
        return 0.0, np.inf
    if isinstance(prior, Uniform):
        return -_FLAT, _FLAT
    if isinstance(prior, TruncatedNormal):
        low, high = (prior.low - prior.mean) / prior.sd, (prior.high - prior.mean) / prior.sd
        return (low if low > -_FAR else -np.inf), (high if high < _FAR else np.inf)
    return ENDLESS


def value_at(z: FloatArray, low: FloatArray | float, high: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """The v of (1) at z, and log dv / dz there.

    Parameters
    ----------
    z : (n_draw,), normal scores.
    low, high : of the shape of z, or numbers.
    """
    v = TruncatedNormal.value_at(z, 0.0, 1.0, low, high)
    return v, np.asarray((v**2 - z**2) / 2 + _log_whole(z, low, high), dtype=float)


def score_at(v: FloatArray, low: FloatArray | float, high: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """The z of (1) at v, the inverse of `value_at`, and log dz / dv there.

    Parameters
    ----------
    v : (n_draw,), values between low and high.
    low, high : of the shape of v, or numbers.
    """
    v = np.clip(v, low + _INSIDE, high - _INSIDE)
    whole = _log_whole(v, low, high)
    below = np.minimum(log_mass(np.broadcast_to(low, v.shape), v) - whole, 0.0)
    above = np.minimum(log_mass(v, np.broadcast_to(high, v.shape)) - whole, 0.0)
    z = np.clip(np.where(below < above, ndtri_exp(below), -ndtri_exp(above)), -_FARTHEST, _FARTHEST)
    return np.asarray(z, dtype=float), np.asarray((z**2 - v**2) / 2 - whole, dtype=float)


def _log_whole(like: FloatArray, low: FloatArray | float, high: FloatArray | float) -> FloatArray:
    return log_mass(np.broadcast_to(low, like.shape), np.broadcast_to(high, like.shape))
