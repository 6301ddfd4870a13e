"""What is sampled, as the sampler sees it: a log density with its prior, a way up to its modes, and which of it are scales."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calib.catalogue import SCALES
from calib.problem import Problem, columns_at
from calib.sampling.coordinates import CONTACT, Coordinates, coordinates
from calib.sampling.laplace import laplace_density
from calib.sampling.proposal import Density, Indices
from calib.sampling.scoring import inverse_root, score, slopes_at
from models.sensor import FloatArray

# Unknowns that the means and the widths of all others depend on by more than a straight line.
_LEADING = SCALES | {"stiffening", "friction_coefficient", "padding_poisson_ratio"}

# How near to where the readings show it a contact or load zero is drawn, in the priors' standard deviations.
_NEAR_SEEN = 0.02


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
    def groups(self) -> tuple[Indices, ...]:
        """Coordinates of each of many groups that are independent of each other given those in none; () if there are none."""
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

        (n_draw, 1 + n_group); -inf for a group where it has none.
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

    def columns(self, theta: FloatArray) -> FloatArray:
        """Values of the unknowns, (n_draw, n), SI, from theta."""
        ...


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
    def groups(self) -> tuple[Indices, ...]:
        """See `Target`: the unknowns of each specimen, where there are many."""
        return tuple(self.space.scopes.specimens.values())

    def places(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """Draws of the prior, (n_draw, n), contact and load zero of every second one near where the readings show them.

        Of ten climbs from draws of the prior alone three reach the highest mode of the shipped problem, of those seven, in half
        the time. Of many specimens only what they share is drawn, as hardly a draw would suit them all.

        Parameters
        ----------
        rng, n_draw : see `Target`.
        """
        x, seen = self.space.from_theta(rng.standard_normal((n_draw, len(self.names)))), self.space.nominal()
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

    def log_density(self, x: FloatArray) -> FloatArray:
        """See `Target`."""
        return self.space.log_density(x)

    def climb(self, x: FloatArray, known: Sequence[Mode]) -> Mode:
        """Climb by Fisher scoring.

        Parameters
        ----------
        x, known : see `Target`.
        """
        modes = [(m.x, m.log_density) for m in known]
        x, value, met = score(self.space, x, modes)
        if met is not None:
            return known[met]
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
            return laplace_density(self.space, mode.x, random)
        except np.linalg.LinAlgError:
            return None

    def to_theta(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Target`."""
        return self.space.to_theta(x)

    def columns(self, theta: FloatArray) -> FloatArray:
        """See `Target`."""
        return columns_at(self.space.problem, theta)


def target_of(problem: Problem) -> ProblemTarget:
    """The posterior of a problem in the coordinates in which it is sampled."""
    return ProblemTarget(coordinates(problem))
