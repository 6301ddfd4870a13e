"""Priors of many unknowns in, their values at standard-normal coordinates out: one computation for each kind of prior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from calib.priors.distributions import Prior
from models.sensor import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class StackedPriors:
    """Priors of many unknowns, sorted by their kind, as a sampler asks for the values of all of them thousands of times.

    Attributes
    ----------
    kinds : for each kind its class, the numbers of its unknowns, and their parameters (n_number, n_unknown, 1).
    """

    kinds: tuple[tuple[type[Prior], IntArray, FloatArray], ...]

    def ppf_normal(self, z: FloatArray) -> FloatArray:
        """Values [SI] at coordinates z, both (n_unknown, n_draw); see `Prior.ppf_normal`."""
        values = np.empty(z.shape)
        for kind, rows, numbers in self.kinds:
            values[rows] = kind.value_at(z[rows], *numbers)
        return values


def stack_priors(priors: Sequence[Prior]) -> StackedPriors:
    """Sort priors by their kind."""
    found: dict[type[Prior], list[int]] = {}
    for k, prior in enumerate(priors):
        found.setdefault(type(prior), []).append(k)
    numbers = {kind: np.array([astuple(priors[k]) for k in rows], dtype=float).T[..., None] for kind, rows in found.items()}
    return StackedPriors(tuple((kind, np.array(rows), numbers[kind]) for kind, rows in found.items()))
