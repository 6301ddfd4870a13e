"""Models that are averaged in, so many draws of each as its weight says out, and what stands for their forward models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from calib.errors import Fault, InputError
from calib.sampling import Posterior, thin_draws
from models.response import Forward
from models.sensor import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Member:
    """One of the models that an average is of: what it found, with which forward model, and how much it counts [1]."""

    name: str
    posterior: Posterior
    forward: Forward
    weight: float


@dataclass(frozen=True)
class OfEach:
    """What stands for the forward model of an average: it refuses to answer, as each draw has that of its own model."""

    name: str

    @property
    def identity(self) -> str:
        """See `models.response.Forward`."""
        return self.name

    def max_depth(self, *_: object) -> NoReturn:
        """See `models.response.Forward`."""
        self._refuse()

    def outside(self, *_: object) -> NoReturn:
        """See `models.response.Forward`."""
        self._refuse()

    def respond(self, *_: object) -> NoReturn:
        """See `models.response.Forward`."""
        self._refuse()

    def _refuse(self) -> NoReturn:
        message = f"this is an {self.name}, each with a forward model of its own"
        raise InputError(
            Fault(message, advice="Give the models themselves, `members` of the run, or do this with each of them")
        )


def members_or(members: Sequence[Member], posterior: Posterior, forward: Forward) -> Sequence[Member]:
    """The models of an average, or the one model that there is.

    Parameters
    ----------
    members : none if it is no average.
    posterior, forward : of the one model.
    """
    return members or (Member("", posterior, forward, 1.0),)


def drawn(members: Sequence[Member], n: int, rng: np.random.Generator) -> list[tuple[Member, dict[str, FloatArray]]]:
    """Pick draws of models at random, of each as many as its weight says.

    Parameters
    ----------
    members : the models.
    n : how many draws in all; fewer if a model has not so many.
    rng : of the choice.

    Returns
    -------
    Each model that has any, with name -> SI values (n_draw,), fixed ones included.
    """
    counts = shares(np.array([member.weight for member in members]), n)
    return [(m, thin_draws(m.posterior, int(own), rng)) for m, own in zip(members, counts, strict=True) if own]


def shares(weight: FloatArray, n: int) -> IntArray:
    """Share a number out by weights, what rounding leaves to the largest remainders.

    Parameters
    ----------
    weight : (n_part,).
    n : to be shared out.

    Returns
    -------
    (n_part,), which sum to n.

    Examples
    --------
    >>> shares(np.array([0.5, 0.3, 0.2]), 9).tolist()
    [4, 3, 2]
    """
    exact = n * weight / np.sum(weight)
    found = np.floor(exact).astype(np.int64)
    last = np.argsort(-(exact - found), kind="stable")[: n - int(np.sum(found))]
    found[last] += 1
    return found


def heaviest(members: Sequence[Member]) -> Member:
    """The model of most weight."""
    return max(members, key=lambda member: member.weight)
