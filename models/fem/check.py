"""From a solution to what is wrong with it: error of the mesh, balance of energy, penetration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from models.fem.equilibrium import State, stored_energy
from models.fem.finite_elements import FiniteElements
from models.fem.solution import Solution
from models.sensor import FloatArray
from models.threads import one_thread


@dataclass(frozen=True, eq=False)
class SolutionCheck:
    """Estimated errors of a solution, arrays of shape (n_state,), nan before contact.

    Attributes
    ----------
    force_error, change_error : of the mesh, relative, signed: force, and change of capacitance.
    energy_error : work of the indenter over stored energy, less one, at the deepest state; nan with friction, which takes its
        share, or on a path of fewer than three states.
    penetration : largest overlap of the deformed surface with the indenter, at 33 points on every edge, as a share of the
        indentation.
    """

    force_error: FloatArray
    change_error: FloatArray
    energy_error: float
    penetration: float


def check(elements: FiniteElements, solution: Solution) -> SolutionCheck:
    """Estimate how wrong a solution is: solve once more at its depths on elements of half the size, and compare.

    As errors fall with the square of the element size, the difference is three quarters of the error of the coarser mesh; as
    the rim of the contact moves from node to node, that is good to a factor of two and not of every single step.

    Parameters
    ----------
    elements : with which the solution was found.
    solution : what to check.

    Returns
    -------
    Estimated errors, step by step.

    Raises
    ------
    ConvergenceError
        If equilibrium is not found on the finer mesh.
    """
    depth = np.array([s.depth * solution.units.length for s in solution.states])
    finer = replace(elements, accuracy=max(elements.accuracy / 4, 1e-5))
    fine, coarse = finer.solve(solution.design, depth).checked().response, solution.response
    share = 1 - finer.accuracy / elements.accuracy
    pressed = depth > 0
    force, change = np.full(depth.shape, np.nan), np.full(depth.shape, np.nan)
    force[pressed] = (coarse.force[pressed] / fine.force[pressed] - 1) / share
    change[pressed] = (coarse.capacitance_change[pressed] / fine.capacitance_change[pressed] - 1) / share
    penetration = max((s.penetration / s.depth for s in solution.states if s.depth > 0), default=0.0)
    return SolutionCheck(force, change, energy_error(solution), penetration)


def energy_error(solution: Solution) -> float:
    """Work of the indenter down to the deepest state over the stored energy there, less one; see `SolutionCheck`."""
    deepest = int(np.argmax([s.depth for s in solution.states]))
    loading = [s for s in solution.states[: deepest + 1] if s.depth > 0]
    if len(loading) < 3 or not solution.model.frictionless:
        return np.nan
    with one_thread():
        return work(loading) / stored_energy(solution.model, loading[-1]) - 1


def taken_by_base(solution: Solution) -> float:
    """What friction on the base takes of the work along all states, in their units: that of its mean at both ends of each step.

    Parameters
    ----------
    solution : along a path of many steps.
    """
    sliding = solution.model.base.r_dofs
    return sum(
        float(np.sum(-(a.sliding.friction + b.sliding.friction) / 2 * (b.u - a.u)[sliding]))
        for a, b in pairwise(solution.states)
    )


def work(states: Sequence[State]) -> float:
    """Integral of the force over the depth along increasing depths, in the units of the states.

    To the first state F ~ d^n with the exponent n = d F'/F found there, then cubic Hermite interpolation with F'.
    """
    first = states[0]
    total = first.force * first.depth / (1 + first.depth * first.stiffness / first.force)
    for a, b in pairwise(states):
        h = b.depth - a.depth
        total += h * (a.force + b.force) / 2 + h**2 * (a.stiffness - b.stiffness) / 12
    return total
