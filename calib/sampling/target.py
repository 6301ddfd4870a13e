"""What is sampled, as the sampler sees it: a log density with its prior, a way up to its modes, and which of it are scales."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calib.catalogue import SCALES
from calib.problem import Problem, columns_at
from calib.sampling.coordinates import Coordinates, coordinates
from calib.sampling.scoring import inverse_root, score, slopes_at
from models.sensor import FloatArray


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
        """Coordinates that set the widths of others: noises and discrepancies."""
        ...

    def prior_draws(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """Draws of the prior, (n_draw, n)."""
        ...

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density up to a constant, (n_draw,); -inf where there is none."""
        ...

    def climb(self, x: FloatArray, known: Sequence[Mode]) -> Mode:
        """Climb from x (n,) to a mode; to one of those known if the way leads there."""
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
        """See `Target`."""
        return tuple(k for k, p in enumerate(self.space.problem.parameters) if p.parameter in SCALES)

    def prior_draws(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """See `Target`."""
        return self.space.from_theta(rng.standard_normal((n_draw, len(self.names))))

    def log_density(self, x: FloatArray) -> FloatArray:
        """See `Target`."""
        return self.space.log_density(x)

    def climb(self, x: FloatArray, known: Sequence[Mode]) -> Mode:
        """See `Target`; by Fisher scoring."""
        modes = [(m.x, m.log_density) for m in known]
        x, value, met = score(self.space, x, modes)
        if met is not None:
            return known[met]
        slopes = slopes_at(self.space, x, 1.0)
        information = np.eye(x.size) if slopes is None else slopes[1]
        return Mode(x, value, inverse_root(information))

    def to_theta(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Target`."""
        return self.space.to_theta(x)

    def columns(self, theta: FloatArray) -> FloatArray:
        """See `Target`."""
        return columns_at(self.space.problem, theta)


def target_of(problem: Problem) -> ProblemTarget:
    """The posterior of a problem in the coordinates in which it is sampled."""
    return ProblemTarget(coordinates(problem))
