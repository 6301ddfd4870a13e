"""Draws of an answer and of what it depends on in, which of them its doubt comes from, as shares of its variance, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from models.sensor import FloatArray

#: A share is said to be more than chance above this many of its standard errors.
_SIGNIFICANT = 2.5
# What takes no more values than this is a choice among them, such as that of a model, and no number that chains move.
_CHOICES = 20


@dataclass(frozen=True)
class Cause:
    """One thing that an answer depends on, and the share of its variance that it explains alone [1], with the error of that."""

    name: str
    share: float
    error: float

    @property
    def counts(self) -> bool:
        """Whether the share is more than chance."""
        return self.share > _SIGNIFICANT * self.error


def first_order(x: FloatArray, y: FloatArray) -> Cause:
    """Estimate a first-order Sobol index, S = Var(E[y|x]) / Var(y), from draws of x and y alone.

    By ranks (Gamboa, Gremaud, Klein & Lagnoux, Bernoulli 28 (2022) 2345): with y in the order of x,

        S = (mean(y_j y_(j+1)) - mean(y)^2) / (mean(y^2) - mean(y)^2),                                        (1)

    the last being followed by the first. It needs no other draws than there are, and no model between x and y; for an x that
    depends on others it holds what x tells of y through them. A chain that stayed where it was repeats its draw, and beside
    itself such a draw would tell y by whatever x: draws of the same x are taken together, y_j their mean and followed by that
    of the next x, each by the number of its draws. Of an x that is a choice among a few the share is that of the variance
    between its classes. The standard error is that of (1) where x says nothing, 1/sqrt(n) with n what draws are worth that are
    repeated (Kish), times sqrt(1 - S) where it says something, which is near enough to tell which shares are chance.

    Parameters
    ----------
    x : (n_draw,), what y may depend on.
    y : (n_draw,), the answer.

    Returns
    -------
    The share, not below 0, without a name.

    Examples
    --------
    >>> x = np.linspace(-1, 1, 1001)
    >>> round(first_order(x, x**2).share, 2)
    1.0
    """
    spread = float(np.var(y))
    if spread == 0 or np.ptp(x) == 0:
        return Cause("", 0.0, 0.0)
    values, place, count = np.unique(x, return_inverse=True, return_counts=True)
    means = np.bincount(place, weights=y - np.mean(y)) / count
    if values.size <= _CHOICES:
        within = (values.size - 1) / (y.size - 1)  # of the variance that classes seem to tell by chance
        told = (np.sum(count * means**2) / y.size / spread - within) / (1 - within)
        worth = float(y.size)
    else:
        told = np.sum(count * means * np.roll(means, -1)) / y.size / spread  # (1)
        worth = y.size**2 / float(np.sum(count**2))
    share = float(np.clip(told, 0.0, 1.0))
    return Cause("", share, float(np.sqrt((1 - share) / worth)))


def causes(inputs: Mapping[str, FloatArray], y: FloatArray) -> tuple[Cause, ...]:
    """Say what an answer's doubt comes from, the most of it first.

    Parameters
    ----------
    inputs : name -> draws (n_draw,); those that do not vary are left out.
    y : (n_draw,), the answer. Where it is infinite, as a margin is to a limit that is missed beyond all measure, it counts as
        the farthest of the others.

    Examples
    --------
    >>> x = np.linspace(-1, 1, 1001)
    >>> causes({"x": x}, np.where(x < -0.9, -np.inf, x))[0].name
    'x'
    """
    finite = y[np.isfinite(y)]
    if not finite.size:
        return ()
    y = np.clip(y, np.min(finite), np.max(finite))
    found = [Cause(name, one.share, one.error) for name, x in inputs.items() if np.ptp(x) > 0 for one in [first_order(x, y)]]
    return tuple(sorted(found, key=lambda cause: -cause.share))
