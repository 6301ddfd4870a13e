"""A finished calibration in, values and forces at the middle of its posterior out: what further measurements start from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calib.lab import Sweep
from calib.problem import Problem, lookup, specimen_design, values_at
from models.sensor import FloatArray


@dataclass(frozen=True, eq=False)
class Known:
    """A finished calibration to which further measurements would be added.

    Attributes
    ----------
    problem : with the forward model that predicts.
    middle : (n_unknown,), mean of the posterior in coordinates z.
    draws : (n_draw, n_unknown), of it.
    """

    problem: Problem
    middle: FloatArray
    draws: FloatArray

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of all unknowns, fixed ones included."""
        return frozenset((*self.problem.names, *self.problem.fixed))

    def value(self, parameter: str, specimen: str, otherwise: float = 0.0) -> float:
        """Value [SI] at the middle of what holds for a specimen.

        Parameters
        ----------
        parameter : the quantity.
        specimen : name.
        otherwise : where there is none.
        """
        found = lookup(values_at(self.problem, self.middle[None]), parameter, specimen)
        return otherwise if found is None else float(found[0])


def force_reached(known: Known, sweep: Sweep) -> float:
    """Largest true force [N] of a press that was made, at the middle of the posterior.

    Parameters
    ----------
    known : the calibration.
    sweep : the press.
    """
    values = values_at(known.problem, known.middle[None])

    def value(parameter: str, otherwise: float) -> float:
        found = lookup(values, parameter, sweep.specimen, sweep.name)
        return otherwise if found is None else float(found[0])

    loads = [load for name in sweep.channels if (load := sweep.load_at(name)) is not None]
    if loads:
        zero = value("load_zero", 0.0) + value("load_step", 0.0)
        return (max(float(np.max(load)) for load in loads) - zero) / value("force_gain", 1.0)
    reading = max(float(np.max(p.displacement)) for p in sweep.channels.values() if p.displacement is not None)
    design = specimen_design(known.problem, values, sweep.specimen, sweep.name)
    depth = np.array([max((reading - value("contact_offset", 0.0)) / value("displacement_gain", 1.0), 0.0)])
    return float(known.problem.forward.respond(design, depth).force.flat[0])
