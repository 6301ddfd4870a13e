"""From depths (or forces) in the order they are gone through to equilibria along the path, with substeps as needed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from models.fem.equilibrium import DiscreteSensor, Failure, State, equilibrium, instability, rest
from models.sensor import FloatArray

#: With friction the result depends on the path: substeps of depth, and those of its square root, in which the contact grows
#: about evenly, are at most this share of the largest.
FRICTION_STEP = 1 / 40


def _extrapolate(last: State, before: State | None, depth: float) -> State:
    """Secant predictor along the path."""
    if before is None or last.depth == before.depth:
        return last
    s = (depth - last.depth) / (last.depth - before.depth)
    pressure = last.contact.pressure + s * (last.contact.pressure - before.contact.pressure)
    return replace(
        last,
        u=last.u + s * (last.u - before.u),
        pressure=last.pressure + s * (last.pressure - before.pressure),
        contact=replace(last.contact, pressure=np.maximum(pressure, 0.0)),
    )


def walk(
    model: DiscreteSensor, depths: FloatArray, smallest_step: float = 1e-3, friction_step: float = FRICTION_STEP
) -> Iterator[State | Failure]:
    """Go through depths in their order, deeper or shallower, from equilibrium to equilibrium.

    Parameters
    ----------
    model : the discretised design.
    depths : in the model's units, shape (n_depth,). Zero or less is first touch again.
    smallest_step : smallest substep as a share of the largest depth; Newton's failure there is the path's.
    friction_step : largest substep with friction, see `FRICTION_STEP`.

    Yields
    ------
    A state for each depth; a `Failure` as the last if stuck.
    """
    last, before = rest(model), None
    deepest = float(np.max(depths))
    step = np.inf if model.frictionless else friction_step
    for target in depths:
        result = _advance(model, last, before, _stops(last.depth, float(target), deepest, step), smallest_step * deepest)
        if isinstance(result, Failure):
            yield result
            return
        last, before = result
        yield last


def _stops(start: float, target: float, deepest: float, step: float) -> FloatArray:
    """Depths from `start` to `target` so near to each other that friction does not depend on them, see `FRICTION_STEP`."""
    if target <= 0:
        return np.array([target])
    even = np.linspace(start, target, 1 + max(1, int(np.ceil(abs(target - start) / deepest / step - 1e-9))))
    roots = np.sqrt(even / deepest)
    n_root = [max(1, int(np.ceil(abs(b - a) / step - 1e-9))) for a, b in pairwise(roots)]
    between = [np.linspace(a, b, n + 1)[1:-1] ** 2 * deepest for a, b, n in zip(roots[:-1], roots[1:], n_root, strict=True)]
    return np.concatenate([np.append(more, stop) for more, stop in zip(between, even[1:], strict=True)])


def _advance(
    model: DiscreteSensor, last: State, before: State | None, stops: FloatArray, least: float
) -> tuple[State, State | None] | Failure:
    """From `last` through all `stops`, in as many substeps as Newton needs, none below `least`; the last two states."""
    for stop in stops:
        result = _reach(model, last, before, float(stop), least)
        if isinstance(result, Failure):
            return result
        last, before = result
    return last, before


def _reach(
    model: DiscreteSensor, last: State, before: State | None, target: float, least: float
) -> tuple[State, State | None] | Failure:
    """From `last` to depth `target` in as many substeps as Newton needs, none below `least`; the last two states."""
    if target <= 0:
        return rest(model), None
    step = abs(target - last.depth)
    while last.depth != target:
        left = target - last.depth
        goal = target if abs(left) - step < 1e-9 * target else last.depth + float(np.copysign(step, left))
        result = equilibrium(model, _extrapolate(last, before, goal), goal)
        if isinstance(result, Failure) and before is not None:
            result = equilibrium(model, last, goal)
        if isinstance(result, Failure):
            step = abs(goal - last.depth) / 2
            if step < least:
                why = instability(model, last) if last.depth > 0 else ""
                return replace(result, reason=result.reason + (f"; {why}" if why else ""))
            continue
        last, before = result, last
    return last, before


def walk_to_forces(model: DiscreteSensor, forces: FloatArray, deepest: float) -> Iterator[State | Failure]:
    """Go through forces in their order, from equilibrium to equilibrium, finding the depth of each.

    F^(2/3), nearly linear in depth for a sphere, is stepped by Newton's method with the consistent dF/dd until the force is met
    to 1e-7.

    Parameters
    ----------
    model : the discretised design.
    forces : positive, in the model's units, shape (n_force,).
    deepest : largest depth allowed, in the model's units.

    Yields
    ------
    A state for each force; a `Failure` as the last if stuck, or if a force takes the indenter below `deepest`.
    """
    last, before = rest(model), None
    least = 1e-3 * deepest
    step = np.inf if model.frictionless else FRICTION_STEP
    for target in forces:
        for _ in range(40):
            if last.force <= 0:
                goal = 0.02 * deepest
            else:
                missing = (float(target) / last.force) ** (2 / 3) - 1
                if abs(missing) < 1e-7:
                    break
                goal = last.depth + missing * 1.5 * last.force / last.stiffness
                goal = min(goal, last.depth + 0.2 * deepest)
                goal = max(goal, 0.5 * last.depth)
            if goal > deepest:
                yield Failure(deepest, f"the force is not reached above the largest depth covered, {deepest:.4g}")
                return
            result = _advance(model, last, before, _stops(last.depth, goal, deepest, step), least)
            if isinstance(result, Failure):
                yield result
                return
            last, before = result
        else:
            yield Failure(last.depth, "the force was not met in 40 steps of depth")
            return
        yield last
