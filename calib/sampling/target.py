"""What is sampled, as the sampler sees it: a log density with its prior, a way up to its modes, and which of it are scales."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from calib.catalogue import SCALES
from calib.problem import Lot, Problem, columns_at, prior_coordinates
from calib.sampling.coordinates import CONTACT, Coordinates, coordinates
from calib.sampling.ends import ENDLESS, ends_of
from calib.sampling.funnel import Indices
from calib.sampling.laplace import laplace_density
from calib.sampling.proposal import Density
from calib.sampling.scoring import inverse_root, score, slopes_at, tempered
from models.sensor import FloatArray, IntArray

# Unknowns that the means and the widths of all others depend on by more than a straight line.
_LEADING = SCALES | {"stiffening", "friction_coefficient", "base_friction_coefficient", "padding_poisson_ratio"}

# How near to where the readings show it a contact or load zero is drawn, in the priors' standard deviations.
_NEAR_SEEN = 0.02

# Draws near a mode that share their scales: given those all else is drawn from a known normal density, at a third of the cost.
_EACH = 6


@dataclass(frozen=True, eq=False)
class Mode:
    """A summit of a posterior: where it is, (n,), how high, and how wide, as S (n, n) with the covariance S S^T there."""

    x: FloatArray
    log_density: float
    factor: FloatArray

    @property
    def log_mass(self) -> float:
        """Logarithm of the mass of a normal density of this height and width, up to a constant that all modes share."""
        return self.log_density + float(np.linalg.slogdet(self.factor)[1])


class Tie(Protocol):
    """What ties the groups of a target to each other, held for each walker: given it they are independent."""

    def log_parts(self, x: FloatArray, rows: IntArray) -> FloatArray:
        """What it adds to the log density of each group at x, (n_row, n_group).

        Parameters
        ----------
        x : (n_row, n).
        rows : (n_row,), the walkers.
        """
        ...

    def log_density(self, x: FloatArray) -> FloatArray:
        """What it adds to the log density at x, whatever it is, (n_walker,)."""
        ...


class Target(Protocol):
    """A density that can be sampled: in coordinates x (n_draw, n)."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the n unknowns."""
        ...

    @property
    def scales(self) -> tuple[int, ...]:
        """Coordinates that the means and widths of others follow in curves: noises and discrepancies, which set the widths."""
        ...

    @property
    def ends(self) -> FloatArray | None:
        """Ends (n, 2) of the values that coordinates are normal scores of, as `calib.sampling.ends` has them; None if none has.

        Infinite for coordinates that others do not follow by such a value.
        """
        ...

    @property
    def groups(self) -> tuple[Indices, ...]:
        """Coordinates of each of many groups that are independent of each other given those in none and what `tie` draws.

        () if there are none.
        """
        ...

    @property
    def alike(self) -> tuple[Indices, ...]:
        """Coordinates of one quantity each, of all groups that have it, where `tie` ties the groups; () where nothing does."""
        ...

    def places(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """Places to climb from, spread as the prior is, (n_draw, n).

        Parameters
        ----------
        rng : the source of random numbers.
        n_draw : how many.
        """
        ...

    def log_parts(self, x: FloatArray) -> FloatArray:
        """Log density in parts that sum to it: of the coordinates in no group, then of each group given those.

        (n_draw, 1 + n_group); -inf for a group where it has none. What `tie` is of is in no part.
        """
        ...

    def tie(self, x: FloatArray, random: np.random.RandomState) -> Tie | None:
        """Draw what ties the groups given where the walkers are, so that steps of groups are those of a Gibbs sampler.

        Parameters
        ----------
        x : (n_walker, n), the walkers.
        random : the source of random numbers.

        Returns
        -------
        None where nothing ties them.
        """
        ...

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density up to a constant, (n_draw,); -inf where there is none."""
        ...

    def climb(self, x: FloatArray, known: Sequence[Mode]) -> Mode:
        """Climb to a mode.

        Parameters
        ----------
        x : (n,), where to begin; the density is not zero there.
        known : modes that were found before; if the way leads to one of them, it is that one.
        """
        ...

    def sketch(self, mode: Mode, random: np.random.RandomState) -> Density | None:
        """A density that is closer to the target round one of its modes than a normal one is; None if there is none.

        Parameters
        ----------
        mode : of the target.
        random : the source of random numbers.
        """
        ...

    def to_theta(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Turn x into the priors' standard-normal coordinates (n_draw, n), and give log |d theta / d x| (n_draw,)."""
        ...

    def from_theta(self, theta: FloatArray) -> FloatArray:
        """Turn theta (n_draw, n) into x, the inverse of `to_theta`."""
        ...

    def columns(self, theta: FloatArray) -> FloatArray:
        """Values of the unknowns, (n_draw, n), SI, from theta."""
        ...


@dataclass(frozen=True, eq=False)
class _LotTie:
    """Values and spreads of a lot, held for each walker.

    Attributes
    ----------
    lots : each quantity of it.
    groups : the coordinates of each group.
    to_theta : from coordinates of the target to those of the priors.
    held : mean and spread, (n_walker,) each, of each quantity.
    """

    lots: tuple[Lot, ...]
    groups: tuple[Indices, ...]
    to_theta: Callable[[FloatArray], FloatArray]
    held: tuple[tuple[FloatArray, FloatArray], ...]

    def log_parts(self, x: FloatArray, rows: IntArray) -> FloatArray:
        """See `Tie`."""
        theta = self.to_theta(x)
        found = np.zeros((len(x), len(self.groups)))
        for lot, (mean, spread) in zip(self.lots, self.held, strict=True):
            z = theta[:, lot.columns]
            of = [k for column in lot.columns for k, group in enumerate(self.groups) if column in group]
            found[:, of] += 0.5 * z**2 + lot.prior.log_given(z, mean[rows], spread[rows])
        return found

    def log_density(self, x: FloatArray) -> FloatArray:
        """See `Tie`."""
        theta = self.to_theta(x)
        return np.asarray(sum(lot.log_ratio(theta) for lot in self.lots), dtype=float)


def tie_of(
    lots: tuple[Lot, ...],
    groups: tuple[Indices, ...],
    to_theta: Callable[[FloatArray], FloatArray],
    x: FloatArray,
    random: np.random.RandomState,
) -> Tie:
    """Draw values and spreads of a lot given its specimens, to hold them.

    Parameters
    ----------
    lots : each quantity that is pooled, and what is believed of it.
    groups : the coordinates of each group, one of which is a specimen's of each quantity.
    to_theta : from coordinates of the target to those of the priors.
    x : (n_walker, n), the walkers.
    random : the source of random numbers.
    """
    rng = np.random.default_rng(random.randint(2**32, size=4, dtype=np.uint32))
    theta = to_theta(x)
    drawn = (lot.prior.draw_of(theta[:, lot.columns], rng) for lot in lots)
    held = tuple((lot.prior.away_of(value), spread) for lot, (value, spread) in zip(lots, drawn, strict=True))
    return _LotTie(lots, groups, to_theta, held)


@dataclass(frozen=True, eq=False)
class ProblemTarget:
    """The posterior of a calibration problem as a `Target`."""

    space: Coordinates

    @property
    def names(self) -> tuple[str, ...]:
        """See `Target`."""
        return self.space.problem.names

    @property
    def scales(self) -> tuple[int, ...]:
        """See `Target`; with those from whose end at zero on all others depend on them more and more."""
        return tuple(k for k, p in enumerate(self.space.problem.parameters) if p.parameter in _LEADING)

    @property
    def ends(self) -> FloatArray | None:
        """See `Target`: of all priors but those of scales, of what is exchanged and of lots; None for many specimens."""
        if self.groups:
            return None
        plain = {e.column for e in self.space.exchanges}
        plain |= {int(k) for lot in self.space.problem.table.lots for k in lot.columns}
        parameters = enumerate(self.space.problem.parameters)
        return np.array([ENDLESS if k in plain or p.parameter in SCALES else ends_of(p.prior) for k, p in parameters])

    @property
    def groups(self) -> tuple[Indices, ...]:
        """See `Target`: the unknowns of each specimen, where there are many."""
        return tuple(self.space.scopes.specimens.values())

    @property
    def alike(self) -> tuple[Indices, ...]:
        """See `Target`: those of one unknown, of many specimens of one lot."""
        if not self.groups or not self.space.problem.table.lots:
            return ()
        columns: dict[str, list[int]] = {}
        for k in np.concatenate(self.groups):
            columns.setdefault(self.space.problem.parameters[k].parameter, []).append(int(k))
        return tuple(np.array(of_one) for of_one in columns.values())

    def places(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """Draws of the prior, (n_draw, n), contact and load zero of every second one near where the readings show them.

        Of ten climbs from draws of the prior alone three reach the highest mode of the shipped problem, of those seven, in half
        the time. Of many specimens only what they share is drawn, as hardly a draw would suit them all.

        Parameters
        ----------
        rng, n_draw : see `Target`.
        """
        x, seen = self.space.from_theta(prior_coordinates(self.space.problem, rng, n_draw)), self.space.nominal()
        contact = [k for k, p in enumerate(self.space.problem.parameters) if p.parameter in CONTACT]
        near = _NEAR_SEEN * rng.standard_normal((n_draw, len(contact)))[::2]
        x[::2, contact] = seen[contact] + near
        if self.groups:
            own = np.concatenate(self.groups)
            x[:, own] = seen[own]
        return x

    def log_parts(self, x: FloatArray) -> FloatArray:
        """See `Target`."""
        return self.space.log_parts(x)

    def tie(self, x: FloatArray, random: np.random.RandomState) -> Tie | None:
        """See `Target`: values and spreads of a lot.

        Parameters
        ----------
        x, random : see `Target`.
        """
        lots = self.space.problem.table.lots
        return tie_of(lots, self.groups, self._theta, x, random) if lots else None

    def _theta(self, x: FloatArray) -> FloatArray:
        """Coordinates of the priors, 0 where there are none: the other parts of the density are nothing there."""
        theta, _ = self.space.to_theta(x)
        return np.nan_to_num(theta, nan=0.0, posinf=0.0, neginf=0.0)

    def log_density(self, x: FloatArray) -> FloatArray:
        """See `Target`."""
        return self.space.log_density(x)

    def climb(self, x: FloatArray, known: Sequence[Mode]) -> Mode:
        """Climb by Fisher scoring.

        Parameters
        ----------
        x, known : see `Target`.
        """
        of_lot = bool(self.space.problem.table.lots)  # of which a climb knows another density
        modes = [(m.x, float(tempered(self.space, m.x[None], 1.0)[0]) if of_lot else m.log_density) for m in known]
        x, value, met = score(self.space, x, modes)
        if met is not None:
            return known[met]
        value = float(self.log_density(x[None])[0]) if of_lot else value
        slopes = slopes_at(self.space, x, 1.0)
        information = np.eye(x.size) if slopes is None else slopes[1]
        return Mode(x, value, inverse_root(information))

    def sketch(self, mode: Mode, random: np.random.RandomState) -> Density | None:
        """See `Target`: normal given the noises and discrepancies; None for many specimens, of which it would have no weight.

        Parameters
        ----------
        mode, random : see `Target`.
        """
        if self.groups:
            return None
        try:
            return replace(laplace_density(self.space, mode.x, random), each=_EACH)
        except np.linalg.LinAlgError:
            return None

    def to_theta(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Target`."""
        return self.space.to_theta(x)

    def from_theta(self, theta: FloatArray) -> FloatArray:
        """See `Target`."""
        return self.space.from_theta(theta)

    def columns(self, theta: FloatArray) -> FloatArray:
        """See `Target`."""
        return columns_at(self.space.problem, theta)


def target_of(problem: Problem) -> ProblemTarget:
    """The posterior of a problem in the coordinates in which it is sampled."""
    return ProblemTarget(coordinates(problem))
