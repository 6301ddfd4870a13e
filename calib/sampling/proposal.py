"""Draws of a posterior in, a density that is close to it and can be drawn from out: a mixture of funnels, one for each mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import logsumexp

from calib.sampling.funnel import Funnel, Indices
from calib.sampling.funnel_fit import fit_funnel
from models.sensor import FloatArray

#: Least share of a mode in a proposal, so that no mode is forgotten.
LEAST_SHARE = 0.02
# Draws for each unknown that a part of a mixture is fitted to, at least.
_LEAST_DRAWS = 10


class Density(Protocol):
    """A density of points x (n_draw, n) that can be drawn from."""

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        ...

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        ...


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of densities, one for each mode of a posterior, with their shares (n_mode,)."""

    parts: tuple[Density, ...]
    shares: FloatArray

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        return np.asarray(logsumexp(self.log_parts(x), axis=0), dtype=float)

    def log_parts(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density of each part, times its share, (n_mode, n_draw)."""
        with np.errstate(divide="ignore"):
            return np.stack([part.log_density(x) for part in self.parts]) + np.log(self.shares)[:, None]

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        which = random.choice(len(self.parts), n_draw, p=self.shares)
        drawn = {int(k): self.parts[k].draw(random, int(np.sum(which == k))) for k in np.unique(which)}
        x = np.empty((n_draw, next(iter(drawn.values())).shape[1]))
        for k, of_part in drawn.items():
            x[which == k] = of_part
        return x


@dataclass(frozen=True, eq=False)
class Proposal(Mixture):
    """A mixture of funnels, one for each mode of a posterior, from each point of which there are steps nearby."""

    parts: tuple[Funnel, ...]

    def step(self, random: np.random.RandomState, x: FloatArray, length: float) -> FloatArray:
        """Step from x (n_draw, n) to points nearby, reversibly with respect to this density: preconditioned Crank-Nicolson.

        Each x belongs to one part, by its share there; its t is a normal vector over the root of a gamma variable, which is
        drawn given t, and the normal vector z becomes sqrt(1 - length^2) z + length times a new one (Cotter, Roberts, Stuart &
        White, Stat. Sci. 28 (2013) 424, Section 4.2, for a normal density; the gamma variable makes it one for Student's t).

        Parameters
        ----------
        random : the source of random numbers.
        x : where the steps begin.
        length : of the steps, in (0, 1]; 1 is a new place independent of x but for the part and the gamma variable.
        """
        log_parts = self.log_parts(x)
        total = np.cumsum(np.exp(log_parts - logsumexp(log_parts, axis=0)), axis=0)
        which = np.minimum(np.sum(random.random_sample(x.shape[0]) > total, axis=0), len(self.parts) - 1)
        y = np.empty_like(x)
        for k, part in enumerate(self.parts):
            y[which == k] = part.at(part.nearby(random, part.residuals(x[which == k]), length))
        return y


def fit_proposal(
    x: FloatArray,
    scales: Sequence[int],
    before: Proposal,
    groups: Sequence[Indices] = (),
    weight: FloatArray | None = None,
    ends: FloatArray | None = None,
) -> Proposal:
    """Fit each part of a mixture anew to the draws that belong to it.

    Parameters
    ----------
    x : (n_draw, n), draws of the posterior.
    scales : columns that set the widths of the others.
    before : the mixture that tells which draw belongs to which part; a part with too few draws for a fit, or all
        in one place, stays as it was.
    groups : columns of each group.
    weight : (n_draw,), of each draw; equal if None.
    ends : (n, 2), of the values whose normal scores the columns are, see `calib.sampling.funnel_fit.fit_funnel`.
    """
    share = np.full(x.shape[0], 1 / x.shape[0]) if weight is None else weight / np.sum(weight)
    which = np.argmax(before.log_parts(x), axis=0)
    least = _LEAST_DRAWS * (x.shape[1] - sum(map(len, groups)) + max(map(len, groups), default=0))
    parts = []
    for k, part in enumerate(before.parts):
        own = share[which == k]
        effective = np.sum(own) ** 2 / np.sum(own**2) if np.any(own > 0) else 0.0
        enough = effective >= least and bool(np.all(np.ptp(x[which == k], axis=0) > 0))
        parts.append(fit_funnel(x[which == k], scales, own, groups, ends) if enough else part)
    shares = np.maximum([np.sum(share[which == k]) for k in range(len(parts))], LEAST_SHARE)
    return Proposal(tuple(parts), shares / np.sum(shares))
