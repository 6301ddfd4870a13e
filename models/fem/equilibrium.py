"""From a layered design and a depth of the indenter to one equilibrium: Newton on a banded tangent.

Lengths in units of the indenter's size, moduli in units of a shear modulus of the stack, see `models.fem.dimensionless`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError

from models.fem import banded, contact, elements, material, sliding
from models.fem.banded import Band, Factor
from models.fem.contact import Contact, Gap, Surface
from models.fem.elements import Elements
from models.fem.mesh import Mesh, make_mesh
from models.fem.sliding import BaseNodes, Sliding
from models.layers import LayeredDesign
from models.sensor import BoolArray, FloatArray

# Of one on whose base nodes slide, which are sorted one by one if they will not settle.
_MAX_NEWTON, _MAX_SLIDING, _ONE_BY_ONE = 30, 60, 20
#: Newton ends when the step to come would be below this share of the depth.
_STEP_TOLERANCE = 1e-7
_STRICT_CONTACT = 9
#: Smallest J that a step may lead to.
_LEAST_JACOBIAN = 0.02


@dataclass(frozen=True, eq=False)
class DiscreteSensor:
    """A discretised design: mesh, elements, contact surface, base, and where each stiffness entry goes in the band."""

    design: LayeredDesign
    mesh: Mesh
    elements: Elements
    surface: Surface
    base: BaseNodes
    band: Band

    @property
    def frictionless(self) -> bool:
        """Whether the tangent is symmetric, and a state does not depend on the path."""
        return self.design.frictionless

    @property
    def base_rubs(self) -> bool:
        """Whether nodes on the base stick and slip by Coulomb's law."""
        return 0 < self.design.base_friction_coefficient < np.inf


def make_model(design: LayeredDesign, depth: float, accuracy: float = 1e-3) -> DiscreteSensor:
    """Discretise a design: the axis keeps its radius, the lateral side is free.

    Parameters
    ----------
    design : in the units of the finite elements, see `models.fem.dimensionless`.
    depth : largest indentation that the grid is made for.
    accuracy : relative, of force and capacitance change.

    Returns
    -------
    The discretised design.
    """
    return on_mesh(design, make_mesh(design, depth, accuracy))


def on_mesh(design: LayeredDesign, mesh: Mesh) -> DiscreteSensor:
    """Discretise a design on a given grid.

    Parameters
    ----------
    design : in the units of the finite elements.
    mesh : the grid, in the same units.

    Returns
    -------
    The discretised design.
    """
    parts = elements.make_elements(mesh, design)
    surface = contact.make_surface(mesh)
    held = np.zeros((mesh.r.size, mesh.n_row, 2), dtype=bool)
    held[:, 0, 1] = True
    held[:, 0, 0] = design.base == "bonded" or design.base_friction_coefficient == np.inf
    held[0, :, 0] = True
    held[1::2, 1::2, :] = True  # inner nodes are condensed
    edge_dofs = (2 * surface.edges[:, :, None] + np.arange(2)).reshape(-1, 6)
    base = sliding.make_base(mesh, parts.border_dofs)
    return DiscreteSensor(design, mesh, parts, surface, base, banded.make_band(held.ravel(), parts.border_dofs, edge_dofs))


@dataclass(frozen=True, eq=False)
class State:
    """An equilibrium: displacement (n_dof,), element pressures (n_element, 3), contact, and the nodes of a base that rubs.

    `force` and `stiffness` dF/dd, `contact_radius` and `depth` are in the model's units. `penetration` is the largest overlap
    of the deformed surface with the indenter, at 33 points on every edge. `newton` lists the sizes of Newton's steps over the
    depth, `positive_definite` says whether the last tangent was (symmetric ones).
    """

    depth: float
    u: FloatArray
    pressure: FloatArray
    contact: Contact
    sliding: Sliding
    force: float = 0.0
    stiffness: float = 0.0
    contact_radius: float = 0.0
    penetration: float = 0.0
    newton: tuple[float, ...] = ()
    positive_definite: bool = True


@dataclass(frozen=True)
class Failure:
    """Newton did not find equilibrium at `depth`, and why."""

    depth: float
    reason: str


def rest(model: DiscreteSensor) -> State:
    """The undeformed stack, indenter at first touch; with the energies used the stress-free state has no pressure."""
    u = np.zeros(2 * model.mesh.n_node)
    at = contact.gap(model.surface, model.design.profile, u, 0.0)
    pressure = np.zeros((model.elements.weight.shape[0], 3))
    return State(0.0, u, pressure, contact.no_contact(at), sliding.at_rest(model.base))


@dataclass(frozen=True, eq=False)
class Linearised:
    """Tangent at a state, factorised, with the condensed elements and the contact it came from.

    `step` and `rate` are the unknowns' Newton step and their change with depth.
    """

    condensed: elements.Condensed
    system: contact.System
    gap: Gap
    factor: Factor
    step: FloatArray
    rate: FloatArray


def linearise(
    model: DiscreteSensor, u: FloatArray, f: FloatArray, gap: Gap, pressure: FloatArray, touching: Contact, below: Sliding
) -> Linearised:
    """Assemble the tangent at a state, factorise it, and find Newton's step and the rate with depth.

    Parameters
    ----------
    model : the discretised design.
    u : (n_dof,), displacements.
    f : (5, n_element, n_quad), deformation.
    gap : where the surface is relative to the indenter.
    pressure : (n_element, 3), of the elements.
    touching : contact.
    below : the nodes on a base that rubs.

    Returns
    -------
    Tangent, step and rate.

    Raises
    ------
    LinAlgError
        If the tangent is singular.
    """
    condensed = elements.condense(model.elements, f, pressure)
    system = contact.contact_system(model.surface, gap, touching, model.design.friction_coefficient)
    residual = model.band.gather(condensed.force, system.residual)
    beside = None
    if model.base_rubs:
        held = sliding.base_system(model.base, condensed, u, below, model.design.base_friction_coefficient)
        residual, beside = residual + model.band.unknowns(held.residual), held.stiffness
    factor = model.band.factorise(condensed.stiffness, system.stiffness, symmetric=model.frictionless, beside=beside)
    right = np.stack([-residual, -model.band.gather(np.zeros_like(condensed.force), system.depth_load)], axis=1)
    solution = factor.solve(right)
    if not np.all(np.isfinite(solution)):
        raise LinAlgError("singular tangent")
    return Linearised(condensed, system, gap, factor, solution[:, 0], solution[:, 1])


def equilibrium(model: DiscreteSensor, guess: State, depth: float) -> State | Failure:
    """Find the equilibrium at a depth by Newton's method.

    Contact points enter when they overlap and leave when they pull, stick until the friction is too much for them and slip
    until they would turn back (primal-dual active set; Hueber & Wohlmuth, Comput. Methods Appl. Mech. Eng. 194 (2005) 3147;
    Hueber, Stadler & Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572). Ends when the sets stay and the step to come, by the
    quadratic rate seen so far, is below 1e-7 of the depth.

    Parameters
    ----------
    model : the discretised design.
    guess : a state near by, from which friction goes on.
    depth : of the indenter, in the model's unit.

    Returns
    -------
    The equilibrium, or why none was found.
    """
    parts, surface, profile = model.elements, model.surface, model.design.profile
    friction, base_friction = model.design.friction_coefficient, model.design.base_friction_coefficient
    u, pressure, touching, below = guess.u, guess.pressure, guess.contact, guess.sliding
    gap = contact.gap(surface, profile, u, depth)
    touching = _entering(touching, touching.active | (gap.control_gap < 0), gap, guess.contact)
    f = elements.deformation(parts, u)
    if not np.all(material.admissible(parts.material, f, 0.0)):
        return Failure(depth, "an element of the predicted state is inverted")
    scale = max(abs(depth), 1e-3)
    seen: list[bytes] = []
    sizes: list[float] = []
    most = _MAX_SLIDING if model.base_rubs else _MAX_NEWTON
    for iteration in range(1, most + 1):
        try:
            at = linearise(model, u, f, gap, pressure, touching, below)
        except LinAlgError:
            return Failure(depth, "the tangent is singular")
        du = model.band.spread(at.step)
        elements.displacement_step(parts, at.condensed, du)
        factor = 1.0
        while True:
            f_new = elements.deformation(parts, u + factor * du)
            if np.all(material.admissible(parts.material, f_new, _LEAST_JACOBIAN)):
                break
            factor /= 2
            if factor < 0.05:
                return Failure(depth, "an element would be inverted, or a chain stretched beyond its limit")
        stepped = contact.stepped(gap, touching, friction, contact.moved_by(surface, du))
        pressure = pressure + factor * elements.pressure_step(parts, at.condensed, du)
        if model.base_rubs:
            below = sliding.stepped(model.base, at.condensed, u, factor * du, below, base_friction)
        u, f = u + factor * du, f_new
        gap = contact.gap(surface, profile, u, depth)
        touching = replace(
            touching,
            pressure=touching.pressure + factor * (stepped.pressure - touching.pressure),
            friction=touching.friction + factor * (stepped.friction - touching.friction),
        )
        slack = 1.0 if iteration > _STRICT_CONTACT else 0.0
        updated = _resort(touching, guess.contact, gap, friction, slack, depth)
        settled = np.array_equal(updated.active, touching.active) and np.array_equal(updated.slip, touching.slip)
        if model.base_rubs:
            one_by_one = iteration > _ONE_BY_ONE
            sorted_anew = sliding.resorted(model.base, u, below, base_friction, 1e-3 * slack, one_by_one=one_by_one)
            settled = settled and sliding.settled(below, sorted_anew, base_friction)
            below = sorted_anew
        before = sizes[-1] if sizes else 0.0
        size = float(np.max(np.abs(du))) / scale
        sizes.append(size)
        if size > 1e3 or not np.isfinite(size):
            return Failure(depth, "Newton diverged")
        # With the quadratic rate |du_next| = c |du|^2, c from the last two steps and not below 1.
        rate = max(1.0, size / before**2 if 0 < before < 1e-2 else np.inf)
        if settled and factor == 1.0 and (size < 3e-7 or rate * size**2 < _STEP_TOLERANCE):
            return _finish(model, State(depth, u, pressure, updated, below), gap, at, sizes)
        if not settled and iteration > (_ONE_BY_ONE + 12 if model.base_rubs else 12):
            mark = updated.active.tobytes() + updated.slip.tobytes() + below.sticks.tobytes() + below.slip.tobytes()
            if seen.count(mark) >= 3:
                return Failure(depth, "contact keeps cycling between two sets of points")
            seen.append(mark)
        touching = updated
    return Failure(depth, f"Newton did not converge in {most} iterations")


def _entering(touching: Contact, active: BoolArray, gap: Gap, before: Contact) -> Contact:
    """The points that are `active` touch; those that did not are anchored where they came in since the equilibrium `before`."""
    anchor = np.where(active & ~touching.active, contact.touched(before, gap), touching.anchor)
    return replace(touching, active=active, anchor=anchor)


def _resort(touching: Contact, before: Contact, gap: Gap, friction: float, slack: float, depth: float) -> Contact:
    """Which points touch, stick and slip after a step; what no longer touches carries nothing."""
    # At the rim of the contact no consistent set of points may exist on a given mesh: after a while a point may pull by a
    # thousandth of the peak pressure, or overlap by 1e-5 of the depth, rather than flip for ever.
    active, pressure = touching.active, touching.pressure
    release = -slack * 1e-3 * float(np.max(pressure))
    new = np.where(active, pressure > release, gap.control_gap < -max(1e-12, slack * 1e-5 * depth))
    # A round indenter touches a disc: inside its rim no point is let go, where the discrete pressure of a strongly compressed
    # layer may swing below zero at single points next to the axis.
    rim = int(np.max(np.flatnonzero(new), initial=-1))
    new = np.where(np.arange(active.size).reshape(active.shape) <= rim, active | new, new)
    slip = np.where(new, touching.slip, 0.0)
    if 0 < friction < np.inf:
        limit = friction * np.maximum(pressure, 0.0)
        starts = (slip == 0) & active & new & (np.abs(touching.friction) > limit * (1 + 1e-9))
        turns = (slip != 0) & (slip * (gap.control_place - touching.anchor) < -1e-13)
        slip = np.where(starts, -np.sign(touching.friction), np.where(turns, 0.0, slip))
    return replace(
        _entering(touching, new, gap, before),
        pressure=np.where(new, pressure, 0.0),
        friction=np.where(new, touching.friction, 0.0),
        slip=slip,
    )


def _finish(model: DiscreteSensor, state: State, gap: Gap, at: Linearised, sizes: list[float]) -> State:
    """Derived numbers of an equilibrium: force, dF/dd along the equilibrium path, contact radius, penetration."""
    surface, touching, friction = model.surface, state.contact, model.design.friction_coefficient
    dx = contact.moved_by(surface, model.band.spread(at.rate))
    dx[1] += 1.0
    # Force of the traction that goes with a small step of the depth, by the derivative of n and t along it. All at the place of
    # the last linearisation: as the contact is stiff, the rate fits its normals and no others.
    n, t = at.gap.normal, at.gap.tangent
    zero = replace(at.gap, gap=np.zeros_like(gap.gap), place=np.zeros_like(gap.place))
    change = contact.stepped(zero, replace(touching, anchor=np.zeros_like(gap.place)), friction, dx)
    turned = at.gap.curvature * np.sum(t * dx, axis=0)
    along_n, along_t = (contact.nodal(surface, x) for x in (change.pressure, change.friction))
    pushed, rubbed = (contact.nodal(surface, x) for x in (touching.pressure, touching.friction))
    up = along_n * n[1] + along_t * t[1] + pushed * turned * t[1] - rubbed * turned * n[1]
    # A point that slips carries its friction on from where it is; one that does not touch will touch where it is.
    place = gap.control_place
    anchor = np.where(touching.slip != 0, place + touching.friction / contact.CONTACT_STIFFNESS, touching.anchor)
    touching = replace(touching, anchor=np.where(touching.active, anchor, place), opening=gap.control_gap)
    return replace(
        state,
        contact=touching,
        sliding=sliding.carried_on(model.base, state.u, state.sliding),
        force=contact.indenter_force(surface, gap, touching),
        stiffness=-float(np.sum(up)),
        contact_radius=contact.contact_radius(surface, gap, touching.pressure),
        penetration=contact.overlap(surface, model.design.profile, state.u, state.depth),
        newton=tuple(sizes),
        positive_definite=at.factor.positive_definite or not model.frictionless,
    )


def stored_energy(model: DiscreteSensor, state: State) -> float:
    """Strain energy of the whole stack.

    Parameters
    ----------
    model : the discretised design.
    state : an equilibrium of it.

    Returns
    -------
    In units of shear modulus times length^3.
    """
    parts = model.elements
    f = elements.deformation(parts, state.u)
    density = material.energy(parts.material, f, state.pressure @ elements.PRESSURE_SHAPE.T)
    return float(np.sum(density * parts.weight))


def compression(model: DiscreteSensor, state: State) -> FloatArray:
    """How much thinner every layer has become on the axis.

    Parameters
    ----------
    model : the discretised design.
    state : an equilibrium of it.

    Returns
    -------
    Thinning as a share of the layer's thickness, shape (n_layer,).
    """
    ends = np.concatenate([[0], 2 * np.cumsum(np.bincount(model.mesh.layer))])
    height = model.mesh.z[ends] + state.u.reshape(model.mesh.r.size, -1, 2)[0, ends, 1]
    return np.asarray(1 - np.diff(height) / np.diff(model.mesh.z[ends]))


def instability(model: DiscreteSensor, state: State) -> str:
    """Say whether the material or the surface has become unstable, which ends a path.

    Parameters
    ----------
    model : the discretised design.
    state : an equilibrium of it.

    Returns
    -------
    What has been lost, strong ellipticity of a layer or positive definiteness of the tangent; empty if nothing.
    """
    f = elements.deformation(model.elements, state.u)
    point = material.at_point(model.elements.material, f, state.pressure @ elements.PRESSURE_SHAPE.T)
    lost: BoolArray = material.least_acoustic(point) <= 0
    if np.any(lost):
        layer = int(model.mesh.layer[int(np.argmax(np.any(lost, axis=1))) % model.mesh.shape[1]])
        name = model.design.layers[layer].name or f"{layer + 1} from the base"
        return f"the material of layer {name} has lost strong ellipticity"
    if not state.positive_definite:
        return "the tangent is no longer positive definite, so the surface may be folding"
    return ""
