"""A target with many groups and a funnel in, draws of what the groups share out, with several draws of every group to each.

No draw of fifty specimens at once would have a weight to speak of. But given what they share the groups are independent of
each other: of several draws of each the mean weight stands for the group, an unbiased estimate of what it adds to the density
of the shared coordinates (pseudo-marginal importance sampling: Andrieu & Roberts, Ann. Stat. 37 (2009) 697), and one of them,
chosen by its weight, is a draw of the group.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from calib.sampling.funnel import Funnel, Indices
from calib.sampling.target import Target
from models.sensor import FloatArray

# Draws whose densities are computed at a time.
_BATCH = 512


@dataclass(frozen=True, eq=False)
class NestedDraws:
    """Draws of what groups share, each with several of every group.

    Attributes
    ----------
    x : (n_each, n_draw, n), the shared coordinates the same in all of the first axis.
    log_ratio : (n_each, n_draw, n_group), log density of each group's draw, given what is shared, over the funnel's.
    log_shared : (n_draw,), log density of the target's part that is in no group.
    group : (n,), number of the group of each column, from 1; 0 for those in none.
    """

    x: FloatArray
    log_ratio: FloatArray
    log_shared: FloatArray
    group: Indices

    @property
    def log_marginal(self) -> FloatArray:
        """Estimates of the log density of the shared coordinates, all others integrated out, (n_draw,)."""
        total = self.log_shared + np.sum(logsumexp(self.log_ratio, axis=0) - np.log(len(self.x)), axis=1)
        return np.asarray(np.where(np.isfinite(total), total, -np.inf), dtype=float)

    @property
    def share(self) -> FloatArray:
        """Weight of each draw of a group among those with the same shared coordinates, (n_each, n_draw, n_group)."""
        top = np.max(self.log_ratio, axis=0)
        weight = np.exp(self.log_ratio - np.where(np.isfinite(top), top, 0.0))
        total = np.sum(weight, axis=0)
        return np.asarray(np.divide(weight, total, out=np.zeros_like(weight), where=total > 0), dtype=float)

    def mean_of(self, values: FloatArray) -> FloatArray:
        """Weighted means over the first axis of values (n_each, n_draw, n) that belong to the columns, (n_draw, n)."""
        each = np.full((*self.x.shape[:2], 1), 1 / len(self.x))
        weight = np.concatenate([each, self.share], axis=2)
        return np.asarray(np.sum(weight[:, :, self.group] * values, axis=0), dtype=float)

    def chosen(self, random: np.random.RandomState) -> FloatArray:
        """One draw of each group for each of the shared ones, chosen by its weight, (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        """
        total = np.cumsum(self.share, axis=0)
        which = np.minimum(np.sum(random.random_sample(total.shape[1:]) > total, axis=0), len(self.x) - 1)
        which = np.concatenate([np.zeros((len(which), 1), dtype=np.intp), which], axis=1)[:, self.group]
        return np.asarray(np.take_along_axis(self.x, which[None], axis=0)[0], dtype=float)


def nested_draws(target: Target, funnel: Funnel, random: np.random.RandomState, n_draw: int, n_each: int) -> NestedDraws:
    """Draw what groups share from a funnel, and every group several times given that.

    Parameters
    ----------
    target : with groups that nothing ties to each other.
    funnel : to draw from.
    random : the source of random numbers.
    n_draw : how many draws of what is shared.
    n_each : how many of every group for each of these.
    """
    shared = funnel.fresh(random, n_draw)
    own = funnel.block > 0
    n_group = funnel.freedom.size - 1
    found, log_ratios = [], []
    log_shared: FloatArray = np.empty(0)
    log_volumes: FloatArray = np.empty(0)
    for k in range(n_each):
        t = np.where(own, funnel.fresh(random, n_draw), shared)
        x = funnel.at(t)
        parts = np.concatenate([target.log_parts(x[i : i + _BATCH]) for i in range(0, n_draw, _BATCH)])
        if k == 0:  # widths follow what is shared alone
            log_shared, widths = parts[:, 0], funnel.log_widths(x)
            log_volumes = np.stack([np.sum(widths[:, funnel.block == g], axis=1) for g in range(1, n_group + 1)], axis=1)
        found.append(x)
        log_ratios.append(parts[:, 1:] - (funnel.log_blocks(t)[:, 1:] - log_volumes))
    return NestedDraws(np.stack(found), np.stack(log_ratios), log_shared, funnel.block_of_columns)
