"""Walkers of a target with many groups in, their next steps out: each group by itself, then what all share, groups going along.

Given what they share, the groups (specimens) are independent of each other. So a proposal for all of them at once is accepted
or not for each by itself, in one evaluation, and stays as good for fifty as for one. What they share is moved with the
residuals t of the funnel held: groups go along, as their means and widths given the shared coordinates say. That is accepted
or not for all together, so here the errors of the funnel add up over the groups, but not their widths. The scales (noises,
discrepancies), which fifty specimens tell as well as fifty times the readings of one, are also moved one by one, with the
specimens going along or with all else held.

What specimens of one lot have in common without sharing it, their moduli say, no step of single ones moves by more than they
differ. So all of them are moved together, too, by the same in each quantity: by how far the means over the specimens of two
other walkers are apart, and by as much as these two differ in what is shared.

Specimens of one lot are independent given its modulus and spread, too. Those are drawn anew, given where the walkers are,
before each step (`Target.tie`), and held in it; but for the steps of all together, which are of the density as it is without.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from calib.sampling.funnel import Funnel, Indices
from calib.sampling.target import Target, Tie
from models.sensor import BoolArray, FloatArray, IntArray

#: Kinds of moves of groups one by one, and of what they share.
OF_GROUPS = ("specimens", "specimens nearby")
OF_SHARED = ("shared", "shared nearby", "shared differential evolution", "scales", "scales alone")

#: The kind of move of all groups by the same.
TOGETHER = "specimens together"

# Length of a step nearby; 1 would be independent of where it starts.
_NEARBY = 0.5
# Factors of the usual length of differential evolution, one of which is drawn for each step: given all else, or all errors of a
# funnel, coordinates are less free than their spread says.
_LENGTHS = (1.0, 0.5, 0.25)


class GroupedWalkers:
    """Moves of walkers of one target by one funnel; keeps the parts of the log density where the walkers are.

    Parameters
    ----------
    target : with groups.
    funnel : fitted to it.
    """

    def __init__(self, target: Target, funnel: Funnel) -> None:
        self._target, self._funnel = target, funnel
        self._group = funnel.block_of_columns
        shared = np.flatnonzero(funnel.block == 0)
        self._scales, self._others = shared[: funnel.n_scale], shared[funnel.n_scale :]  # lines of y
        self._common = _common(target, funnel.order[self._others])
        self._seen: tuple[FloatArray, FloatArray] | None = None
        self._tie: Tie | None = None

    def step(
        self, kind: str, x: FloatArray, random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
        """Make one step.

        Parameters
        ----------
        kind : of `OF_GROUPS` or `OF_SHARED`, or `TOGETHER`.
        x : (n_walker, n).
        random : the source of random numbers.

        Returns
        -------
        The walkers, their log density (n_walker,), and what was accepted: (n_walker, n_group), or (n_walker, 1).
        """
        if self._seen is None or not np.array_equal(self._seen[0], x):
            self._seen = x, self._target.log_parts(x)
        self._tie = self._target.tie(x, random)
        every = np.arange(len(x))
        parts = self._seen[1]
        if kind in OF_GROUPS:
            x, parts, accepted = self._step_of_groups(kind, x, parts, random)
        elif kind == "shared differential evolution":
            x, parts, accepted = self._differential_evolution(self._others, False, x, parts, random)
        elif kind == TOGETHER:
            x, parts, accepted = self._step_together(x, parts, random)
        elif kind in ("scales", "scales alone"):
            one = self._scales[[random.randint(self._scales.size)]] if self._scales.size else self._scales
            x, parts, accepted = self._differential_evolution(one, kind == "scales alone", x, parts, random)
        else:
            t = self._funnel.residuals(x)
            new = self._new(kind == "shared", t, random)
            ratio = (self._funnel.log_blocks(t) - self._funnel.log_blocks(new))[:, 0]
            x, parts, accepted = self._step_of_shared(x, parts, t, new, ratio, random, every)
        self._seen = x, parts
        log_density = np.sum(parts, axis=1) + (0.0 if self._tie is None else self._tie.log_density(x))
        return x, np.asarray(log_density, dtype=float), accepted

    def _tied(self, x: FloatArray, rows: IntArray) -> FloatArray:
        """What ties the groups adds to the parts of the log density of some walkers, (n_row, 1 + n_group)."""
        if self._tie is None:
            return np.zeros((len(x), 1))
        return np.concatenate([np.zeros((len(x), 1)), self._tie.log_parts(x, rows)], axis=1)

    def _new(self, fresh: bool, t: FloatArray, random: np.random.RandomState) -> FloatArray:
        return self._funnel.fresh(random, t.shape[0]) if fresh else self._funnel.nearby(random, t, _NEARBY)

    def _step_of_groups(
        self, kind: str, x: FloatArray, parts: FloatArray, random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """New residuals for every group, those of what they share held."""
        funnel = self._funnel
        t = funnel.residuals(x)
        new = np.where(funnel.block > 0, self._new(kind == "specimens", t, random), t)
        y = np.where(self._group > 0, funnel.at(new), x)
        every = np.arange(len(x))
        parts_there = self._target.log_parts(y)
        ratio = (
            parts_there + self._tied(y, every) - parts - self._tied(x, every) + funnel.log_blocks(t) - funnel.log_blocks(new)
        )[:, 1:]
        accepted = np.log(random.random_sample(ratio.shape)) < ratio
        of = np.concatenate([np.zeros((x.shape[0], 1), dtype=bool), accepted], axis=1)
        return np.where(of[:, self._group], y, x), np.where(of, parts_there, parts), accepted

    def _step_of_shared(
        self,
        x: FloatArray,
        parts: FloatArray,
        t: FloatArray,
        new: FloatArray,
        log_ratio: FloatArray,
        random: np.random.RandomState,
        rows: IntArray,
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """New residuals of what groups share, those of the groups held; with the ratio of the proposal's densities there."""
        funnel = self._funnel
        y = funnel.at(np.where(funnel.block > 0, t, new))
        return self._accept(x, parts, y, log_ratio + funnel.log_volume(y) - funnel.log_volume(x), random, rows)

    def _differential_evolution(
        self, moving: Indices, alone: bool, x: FloatArray, parts: FloatArray, random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Steps of each half of the walkers along differences of two of the other half, in some lines of y; all else held.

        Held are the residuals, so that the groups go along, or, for steps `alone`, the coordinates themselves.
        """
        x, parts = x.copy(), parts.copy()
        accepted = np.zeros((x.shape[0], 1), dtype=bool)
        if not moving.size:
            return x, parts, accepted
        length = 2.38 / np.sqrt(2 * moving.size) * random.choice(_LENGTHS)
        columns = self._funnel.order[moving] if alone else moving
        for own, first, second in _pairs(len(x), random):
            here, one, another = (x[rows] if alone else self._funnel.residuals(x[rows]) for rows in (own, first, second))
            new = here.copy()
            new[:, columns] += length * (one - another)[:, columns]
            if alone:
                made = self._accept(x[own], parts[own], new, np.zeros(own.size), random, own)
            else:
                made = self._step_of_shared(x[own], parts[own], here, new, np.zeros(own.size), random, own)
            x[own], parts[own], accepted[own] = made
        return x, parts, accepted

    def _step_together(
        self, x: FloatArray, parts: FloatArray, random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Steps of each half of the walkers by the same in all groups, and in what they share, as two others differ."""
        x, parts = x.copy(), parts.copy()
        accepted = np.zeros((x.shape[0], 1), dtype=bool)
        length = 2.38 / np.sqrt(2 * max(1, np.linalg.matrix_rank(self._common))) * random.choice(_LENGTHS)
        for own, first, second in _pairs(len(x), random):
            y = x[own] + length * (x[first] - x[second]) @ self._common
            parts_there = self._target.log_parts(y)
            gain = np.sum(parts_there, axis=1) - np.sum(parts[own], axis=1)
            if self._tie is not None:
                gain += self._tie.log_density(y) - self._tie.log_density(x[own])
            accepted[own] = (np.log(random.random_sample(gain.size)) < gain)[:, None]
            x[own], parts[own] = np.where(accepted[own], y, x[own]), np.where(accepted[own], parts_there, parts[own])
        return x, parts, accepted

    def _accept(
        self,
        x: FloatArray,
        parts: FloatArray,
        y: FloatArray,
        log_ratio: FloatArray,
        random: np.random.RandomState,
        rows: IntArray,
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Go from x to y, or not, each walker with all its groups; with what the ratio of densities is to be multiplied by."""
        parts_there = self._target.log_parts(y)
        gain = np.sum(parts_there, axis=1) - np.sum(parts, axis=1) + log_ratio
        gain += np.sum(self._tied(y, rows) - self._tied(x, rows), axis=1)
        accepted = (np.log(random.random_sample(gain.size)) < gain)[:, None]
        return np.where(accepted, y, x), np.where(accepted, parts_there, parts), accepted


def _common(target: Target, shared: Indices) -> FloatArray:
    """What turns a difference of walkers (n,) into a shift by the same in all groups; as it is in shared columns."""
    found = np.zeros((len(target.names), len(target.names)))
    found[shared, shared] = 1.0
    for columns in target.alike:
        found[np.ix_(columns, columns)] = 1 / columns.size
    return found


def _pairs(n_walker: int, random: np.random.RandomState) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
    """Each half of the walkers by their numbers, and for each of them two different ones of the other half."""
    shuffled = random.permutation(n_walker)
    halves = shuffled[::2], shuffled[1::2]
    for own, other in (halves, halves[::-1]):
        first = random.randint(other.size, size=own.size)
        second = (first + 1 + random.randint(other.size - 1, size=own.size)) % other.size
        yield own, other[first], other[second]
