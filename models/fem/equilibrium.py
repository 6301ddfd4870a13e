"""From a stack and depths (or forces) to equilibrium states: Newton on a banded tangent, adaptive steps.

Units: sphere radius R, shear modulus of the sensor. Unknowns are numbered column by column, so the tangent is banded with a
width of two node columns and a Cholesky band solve does it; where the tangent is not positive definite, LU takes over.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, solve_banded, solveh_banded

from models.fem import contact, elements, material
from models.fem.contact import Gap, Surface
from models.fem.elements import Elements
from models.fem.mesh import Mesh, Stack, make_mesh
from models.sensor import BoolArray, FloatArray, IntArray

_MAX_NEWTON = 25
_STEP_TOLERANCE = 3e-7
_STRICT_CONTACT = 9


@dataclass(frozen=True, eq=False)
class Model:
    """A discretised stack: mesh, elements, contact surface and where each stiffness entry goes in the band.

    Attributes
    ----------
    free : (n_dof,) number of the unknown of a displacement component, -1 where it is held or belongs to an inner node.
    band : half bandwidth; `n_free` unknowns.
    element_entries, element_slots : flat positions in the (n_element, 16, 16) stiffness and in the band (band + 1, n_free).
    edge_entries, edge_slots : the same for (n_edge, 6, 6).
    """

    stack: Stack
    mesh: Mesh
    elements: Elements
    surface: Surface
    free: IntArray
    n_free: int
    band: int
    border_dofs: IntArray
    inner_dofs: IntArray
    element_entries: IntArray
    element_slots: IntArray
    edge_entries: IntArray
    edge_slots: IntArray
    edge_dofs: IntArray


def make_model(stack: Stack, depth: float, refinement: float = 1.0) -> Model:
    """Discretise `stack` for indentations up to `depth`. The base is bonded, the axis keeps its radius, the rim is free."""
    mesh = make_mesh(stack, depth, refinement)
    parts = elements.make_elements(mesh, stack)
    surface = contact.make_surface(mesh)
    held = np.zeros((mesh.r.size, mesh.n_row, 2), dtype=bool)
    held[:, 0, :] = True
    held[0, :, 0] = True
    held[1::2, 1::2, :] = True  # inner nodes are condensed
    free = np.where(held.ravel(), -1, np.cumsum(~held.ravel()) - 1)
    n_free = int(np.sum(~held))
    edge_dofs = (2 * surface.edges[:, :, None] + np.arange(2)).reshape(-1, 6)
    border_dofs = parts.dofs[:, elements.BORDER]
    rows = free[border_dofs]
    band = int(np.max(np.max(rows, axis=1) - np.min(np.where(rows < 0, n_free, rows), axis=1)))

    def slots(dofs: IntArray) -> tuple[IntArray, IntArray]:
        number = free[dofs]
        i, j = np.broadcast_arrays(number[:, :, None], number[:, None, :])
        take = (i >= j) & (j >= 0)
        return np.flatnonzero(take), (i - j)[take] * n_free + j[take]

    return Model(
        stack,
        mesh,
        parts,
        surface,
        free,
        n_free,
        band,
        border_dofs,
        parts.dofs[:, elements.INNER],
        *slots(border_dofs),
        *slots(edge_dofs),
        edge_dofs,
    )


@dataclass(frozen=True, eq=False)
class State:
    """An equilibrium: displacement (n_dof,), element pressures (n_element, 3), contact pressure and activity (n_edge, 2).

    `force` is in units of shear modulus times R^2, `depth` and `contact_radius` in units of R; `stiffness` is dF/dd.
    `penetration` is the largest overlap with the sphere, `iterations` counts Newton steps.
    """

    depth: float
    u: FloatArray
    pressure: FloatArray
    contact_pressure: FloatArray
    active: BoolArray
    force: float = 0.0
    stiffness: float = 0.0
    contact_radius: float = 0.0
    penetration: float = 0.0
    iterations: int = 0


@dataclass(frozen=True)
class Failure:
    """Newton did not find equilibrium at `depth`, and why."""

    depth: float
    reason: str


def rest(model: Model) -> State:
    """The undeformed stack, sphere at first touch."""
    edge = model.surface.weight.shape
    return State(
        0.0,
        np.zeros(2 * model.mesh.n_node),
        # With this energy the stress-free state has p = 0 in every layer.
        np.zeros((model.elements.weight.shape[0], 3)),
        np.zeros(edge),
        np.zeros(edge, dtype=bool),
    )


def _solve(ab: FloatArray, rhs: FloatArray) -> FloatArray:
    """Symmetric band solve, lower form; LU where the matrix is not positive definite."""
    try:
        return np.asarray(solveh_banded(ab, rhs, lower=True, check_finite=False))
    except LinAlgError:
        band, n = ab.shape[0] - 1, ab.shape[1]
        full = np.zeros((2 * band + 1, n))
        full[band:] = ab
        for k in range(1, band + 1):
            full[band - k, k:] = ab[k, : n - k]
        return np.asarray(solve_banded((band, band), full, rhs, check_finite=False))


def _scatter(model: Model, element_values: FloatArray, edge_values: FloatArray) -> FloatArray:
    n = 2 * model.mesh.n_node
    inner = np.bincount(model.border_dofs.ravel(), element_values.ravel(), n)
    outer = np.bincount(model.edge_dofs.ravel(), edge_values.ravel(), n)
    return np.asarray((inner + outer)[model.free >= 0], dtype=float)


def _band(model: Model, element_stiffness: FloatArray, edge_stiffness: FloatArray) -> FloatArray:
    size = (model.band + 1) * model.n_free
    inner = np.bincount(model.element_slots, element_stiffness.ravel()[model.element_entries], size)
    outer = np.bincount(model.edge_slots, edge_stiffness.ravel()[model.edge_entries], size)
    return np.asarray((inner + outer).reshape(model.band + 1, model.n_free), dtype=float)


def _depth_load(surface: Surface, gap: Gap, active: BoolArray, pressure: FloatArray) -> FloatArray:
    """d(residual)/d(depth) of the edges at fixed displacement, (n_edge, 6): the sphere moves down by a unit."""
    # dg/dd = n_z and dn/dd = (e_z - n n_z)/rho, since the distance vector grows by e_z.
    n = gap.normal
    lateral = np.stack([-n[0] * n[1], 1 - n[1] ** 2]) / gap.distance
    density = contact.CONTACT_STIFFNESS * n[1] * n - pressure * lateral
    edges = np.einsum("eq,ceq,nq->enc", np.where(active, surface.weight, 0.0), density, surface.shape)
    return np.asarray(edges.reshape(-1, 6))


def equilibrium(model: Model, guess: State, depth: float) -> State | Failure:
    """Newton from `guess` to equilibrium with the sphere at `depth`.

    Contact points enter when they overlap and leave when they pull (primal-dual active set; Hueber & Wohlmuth, Comput.
    Methods Appl. Mech. Eng. 194 (2005) 3147). Ends when the active set stays and the step is below 3e-7 of the depth.
    """
    parts, surface = model.elements, model.surface
    u, pressure, lam = guess.u, guess.pressure, guess.contact_pressure
    gap = contact.gap(surface, u, depth)
    active = guess.active | (gap.gap < 0)
    f = elements.deformation(parts, u)
    if np.min(material.jacobian(f)) <= 0:
        return Failure(depth, "an element of the predicted state is inverted")
    scale = max(depth, 1e-3)
    seen: list[bytes] = []
    is_free = model.free >= 0
    for iteration in range(1, _MAX_NEWTON + 1):
        lin = elements.linearise(parts, f, pressure)
        residual, stiffness = contact.contact_system(surface, gap, lam, active)
        border = elements.condense(lin)
        ab = _band(model, border.stiffness, stiffness)
        rhs = np.stack(
            [
                -_scatter(model, border.force, residual),
                -_scatter(model, np.zeros_like(border.force), _depth_load(surface, gap, active, lam)),
            ],
            axis=1,
        )
        try:
            step = _solve(ab, rhs)
        except LinAlgError:
            return Failure(depth, "the tangent is singular")
        du = np.zeros_like(u)
        du[is_free] = step[:, 0]
        du[model.inner_dofs] = -border.offset - np.einsum("eib,eb->ei", border.slope, du[model.border_dofs])
        if not np.all(np.isfinite(du)):
            return Failure(depth, "the tangent is singular")
        factor = 1.0
        while True:
            f_new = elements.deformation(parts, u + factor * du)
            if np.min(material.jacobian(f_new)) > 0.02:
                break
            factor /= 2
            if factor < 0.05:
                return Failure(depth, "an element would be inverted (J <= 0)")
        lam_step = contact.pressure_after(surface, gap, active, du)
        pressure = pressure + factor * lin.pressure_step(parts, du)
        u, f = u + factor * du, f_new
        gap = contact.gap(surface, u, depth)
        lam = np.where(active, lam + factor * (lam_step - lam), 0.0)
        # At the rim of the contact no consistent set of points may exist on a given mesh: after a while a point may pull by
        # a thousandth of the peak pressure, or overlap by 1e-5 of the depth, rather than flip for ever.
        slack = 1.0 if iteration > _STRICT_CONTACT else 0.0
        release = -slack * 1e-3 * float(np.max(lam))
        new_active = np.where(active, lam > release, gap.gap < -max(1e-12, slack * 1e-5 * depth))
        # A sphere touches a disc: inside its rim no point is let go, where the discrete pressure of a strongly compressed
        # layer may swing below zero at single points next to the axis.
        rim = int(np.max(np.flatnonzero(new_active), initial=-1))
        new_active = np.where(np.arange(active.size).reshape(active.shape) <= rim, active | new_active, new_active)
        lam = np.where(new_active, lam, 0.0)
        settled = bool(np.array_equal(new_active, active))
        size = float(np.max(np.abs(du))) / scale
        if size > 1e3 or not np.isfinite(size):
            return Failure(depth, "Newton diverged")
        if settled and factor == 1.0 and size < _STEP_TOLERANCE:
            # A quadratic step of 3e-7 leaves an error of the order of its square.
            return _finish(model, State(depth, u, pressure, lam, active), gap, step[:, 1], is_free, iteration)
        if not settled and iteration > 12:
            mark = new_active.tobytes()
            if seen.count(mark) >= 3:
                return Failure(depth, "contact keeps cycling between two sets of points")
            seen.append(mark)
        active = new_active
    return Failure(depth, f"Newton did not converge in {_MAX_NEWTON} iterations")


def _finish(model: Model, state: State, gap: Gap, depth_step: FloatArray, is_free: BoolArray, iterations: int) -> State:
    """Derived numbers of an equilibrium: force, dF/dd along the equilibrium path, contact radius, penetration."""
    surface, lam = model.surface, state.contact_pressure
    force = contact.sphere_force(surface, gap, lam)
    rate = np.zeros_like(state.u)
    rate[is_free] = depth_step
    dx = np.einsum("enc,nq->ceq", rate.reshape(-1, 2)[surface.edges], surface.shape)
    dx[1] += 1.0
    n = gap.normal
    dg = np.sum(n * dx, axis=0)
    dn_z = (dx[1] - n[1] * dg) / gap.distance
    dlam = np.where(state.active, -contact.CONTACT_STIFFNESS * dg, 0.0)
    stiffness = -float(np.sum(surface.weight * (dlam * n[1] + lam * dn_z)))
    return replace(
        state,
        force=force,
        stiffness=stiffness,
        contact_radius=contact.contact_radius(gap, lam),
        penetration=float(max(0.0, -np.min(gap.gap))),
        iterations=iterations,
    )


def _extrapolate(last: State, before: State | None, depth: float) -> State:
    """Secant predictor along the path."""
    if before is None or last.depth == before.depth:
        return last
    s = (depth - last.depth) / (last.depth - before.depth)
    return replace(
        last,
        u=last.u + s * (last.u - before.u),
        pressure=last.pressure + s * (last.pressure - before.pressure),
        contact_pressure=np.maximum(last.contact_pressure + s * (last.contact_pressure - before.contact_pressure), 0.0),
    )


def walk(model: Model, depths: FloatArray, smallest_step: float = 1e-3) -> Iterator[State | Failure]:
    """Equilibria at each of the increasing `depths`; substeps where Newton needs them; ends with a `Failure` if stuck.

    `smallest_step` is the smallest substep as a share of the largest depth.
    """
    last, before = rest(model), None
    least = smallest_step * float(np.max(depths))
    for target in depths:
        result = _advance(model, last, before, float(target), least)
        if isinstance(result, Failure):
            yield result
            return
        last, before = result
        yield last


def _advance(
    model: Model, last: State, before: State | None, target: float, least: float
) -> tuple[State, State | None] | Failure:
    """From `last` to depth `target` in as many substeps as Newton needs, none below `least`; the last two states."""
    step = target - last.depth
    while last.depth < target:
        goal = target if target - last.depth - step < 1e-9 * target else last.depth + step
        result = equilibrium(model, _extrapolate(last, before, goal), goal)
        if isinstance(result, Failure) and before is not None:
            result = equilibrium(model, last, goal)
        if isinstance(result, Failure):
            step = (goal - last.depth) / 2
            if step < least:
                return result
            continue
        last, before = result, last
    return last, before


def walk_to_forces(model: Model, forces: FloatArray, deepest: float) -> Iterator[State | Failure]:
    """Equilibria at each of the increasing positive `forces` (units of shear modulus times R^2), found by depth.

    F^(2/3), nearly linear in depth, is stepped by Newton's method with the consistent dF/dd until the force is met to 1e-7.
    Ends with a `Failure` if that takes the sphere below `deepest`.
    """
    last, before = rest(model), None
    least = 1e-3 * deepest
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
            if goal > deepest:
                yield Failure(deepest, f"the force is not reached above the largest depth covered, {deepest:.4g} R")
                return
            if goal > last.depth:
                result = _advance(model, last, before, goal, least)
            else:
                back = equilibrium(model, last, goal)
                result = back if isinstance(back, Failure) else (back, None)
            if isinstance(result, Failure):
                yield result
                return
            last, before = result
        else:
            yield Failure(last.depth, "the force was not met in 40 steps of depth")
            return
        yield last
