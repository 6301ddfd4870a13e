"""Ranks of truths in posteriors in, whether they are uniform out: a simultaneous band, a probability, and coverage.

The empirical distribution of N uniform numbers leaves, with a given probability, no band at any point (Saeilynoja, Buerkner &
Vehtari, Stat. Comput. 32 (2022) 32, Sec. 2): at each point z the count of numbers below it is binomial, and what is simulated
is how improbable the most improbable of these counts is.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from models.sensor import FloatArray, IntArray

#: Points between 0 and 1 at which distributions are compared.
POINTS = 50

_SIMULATED = 20_000
_SEED = 20220222


def rank_points() -> FloatArray:
    """Where distributions are compared, (POINTS,), between 0 and 1."""
    return np.arange(1, POINTS + 1) / (POINTS + 1)


def probability_of(ranks: FloatArray) -> float:
    """Probability with which as many uniform numbers would stray from uniformity anywhere at least as far as ranks do.

    Parameters
    ----------
    ranks : between 0 and 1, (n,).
    """
    rarest = np.min(_tails(ranks.size)[np.arange(POINTS), _counts(ranks[None])[0]])
    return float(np.mean(_null(ranks.size) <= rarest * (1 + 1e-9)))


def rank_band(n: int, level: float) -> tuple[FloatArray, FloatArray]:
    """Between what the distribution of uniform numbers stays at all points at once.

    Parameters
    ----------
    n : how many numbers.
    level : probability with which it does.

    Returns
    -------
    Least and largest share of the numbers below each of `rank_points`.
    """
    limit = float(np.quantile(_null(n), 1 - level))
    tails = _tails(n)
    inside = tails >= limit
    low = np.argmax(inside, axis=1)
    high = n - np.argmax(inside[:, ::-1], axis=1)
    return low / n, high / n


def rank_shares(ranks: FloatArray) -> FloatArray:
    """Share of ranks (n,) below each of `rank_points`."""
    return np.asarray(_counts(ranks[None])[0] / ranks.size)


def coverage_interval(inside: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Between what the true coverage lies, if so many truths of n lay inside (Clopper and Pearson's interval).

    Parameters
    ----------
    inside, n : counts.
    level : of the interval.
    """
    from scipy.stats import beta  # takes long to load

    tail = (1 - level) / 2
    low = float(beta.ppf(tail, inside, n - inside + 1)) if inside else 0.0
    high = float(beta.ppf(1 - tail, inside + 1, n - inside)) if inside < n else 1.0
    return low, high


def _counts(ranks: FloatArray) -> IntArray:
    """How many of each row lie below each point, (n_row, POINTS)."""
    bins = np.minimum((ranks * (POINTS + 1)).astype(np.int64), POINTS)
    rows = np.arange(ranks.shape[0])[:, None]
    flat = np.bincount((rows * (POINTS + 1) + bins).ravel(), minlength=ranks.shape[0] * (POINTS + 1))
    return np.asarray(np.cumsum(flat.reshape(ranks.shape[0], POINTS + 1), axis=1)[:, :POINTS])


@cache
def _tails(n: int) -> FloatArray:
    """Probability of a count at least as far out on its side, doubled, at each point, (POINTS, n + 1)."""
    from scipy.stats import binom  # takes long to load

    count, z = np.arange(n + 1), rank_points()[:, None]
    return np.asarray(2 * np.minimum(binom.cdf(count, n, z), binom.sf(count - 1, n, z)))


@cache
def _null(n: int) -> FloatArray:
    """The rarest count of each of many sets of n uniform numbers."""
    rng = np.random.default_rng(_SEED)
    tails = _tails(n)
    found = []
    for _ in range(_SIMULATED // 1000):
        counts = _counts(rng.random((1000, n)))
        found.append(np.min(tails[np.arange(POINTS), counts], axis=1))
    return np.concatenate(found)
