"""From surface positions and a rigid indenter to contact pressure and friction, their forces and stiffness.

The gap along a quadratic edge is g = sum_i b_i B_i with the Bernstein polynomials B_i >= 0 and, from the gaps at its nodes,

    b_0 = g_0,      b_1 = 2 g_1 - (g_0 + g_2)/2,      b_2 = g_2.                                                       (1)

Contact holds b_i >= 0, and so g >= 0 everywhere on the edge and not at its nodes alone: where the rim of the contact lies
within an edge, an edge held at its middle node would dip into the indenter. (What is left is the cubic part of the gap to a
round indenter.) Pressure lambda and friction tau at these control points, with the weights of the integrals of 2 pi r B_i,
are unknowns of their own with lambda = -eps b for b < 0, and Newton steps them by their linearisation (perturbed Lagrangian;
Wriggers, "Computational Contact Mechanics", 2006, section 6.3), so that a compliance 1/eps far below what a penalty method
survives costs no convergence. Friction is Coulomb's: a point sticks where it touched, tau = -eps (s - s_0) with s its place
along the indenter's meridian, by (1) like the gap, or slips, tau = -+ f lambda.

As many control points as nodes: with two Gauss points an edge, a bulge that vanishes at both is seen by no contact pressure
there, and folds the surface of a thin layer that is pressed hard.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.fem.elements import shape_1d
from models.fem.mesh import Mesh
from models.layers import Profile
from models.sensor import BoolArray, FloatArray, IntArray

#: Contact stiffness in units of shear modulus over size of the indenter.
CONTACT_STIFFNESS = 1e8

_POINTS = np.array([-1.0, 0.0, 1.0])
#: Eq. (1): control values of a quadratic from its values at the nodes.
_CONTROL = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])
#: Integral of B_i B_j over [-1, 1].
_BERNSTEIN = np.array([[12.0, 6.0, 2.0], [6.0, 8.0, 6.0], [2.0, 6.0, 12.0]]) / 30
#: Quadratic shape functions where the overlap of an edge is looked for, (3, n_point).
_SAMPLES = shape_1d(np.linspace(-1, 1, 33))[0]


@dataclass(frozen=True, eq=False)
class Surface:
    """The top surface, arrays (n_edge, 3): nodes of the edges, weights of their control points, undeformed radii of nodes."""

    edges: IntArray
    weight: FloatArray
    radius: FloatArray


def make_surface(mesh: Mesh) -> Surface:
    """Pick the edges of the top row of elements, where the indenter may touch."""
    nr, _ = mesh.shape
    top = mesh.n_row - 1
    edges = (2 * np.arange(nr)[:, None] + np.arange(3)) * mesh.n_row + top
    half = (mesh.r[2::2] - mesh.r[:-2:2]) / 2
    radius = mesh.r[1::2, None] + half[:, None] * _POINTS
    weight = 2 * np.pi * half[:, None] * (radius @ _BERNSTEIN)  # r is linear: its own control values
    return Surface(edges, weight, radius)


@dataclass(frozen=True, eq=False)
class Gap:
    """Where the nodes of the surface are relative to the indenter, arrays (n_edge, 3) or (2, n_edge, 3).

    Attributes
    ----------
    gap, normal : distance g to the indenter, negative inside; outward normal n of the indenter there.
    curvature : of the surface of equal distance in the plane, dn/dx = curvature t t with t = (-n_z, n_r).
    place, rate : arc length s along the meridian from the axis, and ds/dx . t.
    radius : deformed radius of the surface point.
    """

    gap: FloatArray
    normal: FloatArray
    curvature: FloatArray
    place: FloatArray
    rate: FloatArray
    radius: FloatArray

    @property
    def tangent(self) -> FloatArray:
        """Direction of growing s."""
        return np.stack([-self.normal[1], self.normal[0]])

    @property
    def control_gap(self) -> FloatArray:
        """Control values b of the gap, Eq. (1)."""
        return np.asarray(self.gap @ _CONTROL.T)

    @property
    def control_place(self) -> FloatArray:
        """Control values of the place s, likewise."""
        return np.asarray(self.place @ _CONTROL.T)


def distance(profile: Profile, x: FloatArray, z: FloatArray) -> Gap:
    """Nearest point of the indenter's meridian to each of given points.

    Parameters
    ----------
    profile : of the indenter.
    x : radius of the points, (n_edge, 3) or any other shape.
    z : their height above the lowest point of the indenter, of the same shape.

    Returns
    -------
    Distance, normal, curvature and place on the meridian.
    """
    b, rho, angle = profile.flat_radius, profile.rounding_radius, profile.flank_angle
    cos, sin = np.cos(angle), np.sin(angle)
    phi = np.arctan2(x - b, rho - z)
    on_flat, on_flank = (x < b) & (b > 0), phi > angle
    length = np.hypot(x - b, rho - z)
    length = np.where(length > 0, length, 1.0)
    n_r, n_z = (x - b) / length, (z - rho) / length
    end_x, end_z = x - (b + rho * sin), z - rho * (1 - cos)
    pick = (on_flat, on_flank)
    return Gap(
        gap=np.select(pick, (-z, end_x * sin - end_z * cos), length - rho),
        normal=np.stack([np.select(pick, (0.0 * x, 0.0 * x + sin), n_r), np.select(pick, (0.0 * x - 1, 0.0 * x - cos), n_z)]),
        curvature=np.where(on_flat | on_flank, 0.0, 1 / length),
        place=np.select(pick, (x, b + rho * angle + end_x * cos + end_z * sin), b + rho * phi),
        rate=np.where(on_flat | on_flank, 1.0, rho / length),
        radius=x,
    )


def gap(surface: Surface, profile: Profile, u: FloatArray, depth: float) -> Gap:
    """Where the deformed surface is relative to the indenter.

    Parameters
    ----------
    surface : the top surface.
    profile : of the indenter.
    u : (n_dof,), displacements.
    depth : of the indenter below first touch.

    Returns
    -------
    At the nodes of the surface, (n_edge, 3).
    """
    ue = u.reshape(-1, 2)[surface.edges]
    return distance(profile, surface.radius + ue[..., 0], ue[..., 1] + depth)


def overlap(surface: Surface, profile: Profile, u: FloatArray, depth: float) -> float:
    """How far the deformed surface reaches into the indenter at the worst: a hard contact has none.

    Parameters
    ----------
    surface, profile, u, depth : as in `gap`.

    Returns
    -------
    Largest overlap at 33 points on every edge, between the nodes too; 0 if there is none.
    """
    ue = u.reshape(-1, 2)[surface.edges]
    x, z = (surface.radius + ue[..., 0]) @ _SAMPLES, ue[..., 1] @ _SAMPLES + depth
    return float(max(0.0, -np.min(distance(profile, x, z).gap)))


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact unknowns at the control points of the edges, all of shape (n_edge, 3).

    Attributes
    ----------
    active : whether the point touches.
    pressure : lambda, 0 elsewhere.
    slip : 0 where the point sticks, else the sign of its slip.
    friction : tau along the meridian.
    anchor : place s_0 at which the point touched, or last slipped to; of one that does not touch, where it is.
    opening : gap of a point that does not touch, at the last equilibrium.
    """

    active: BoolArray
    pressure: FloatArray
    slip: FloatArray
    friction: FloatArray
    anchor: FloatArray
    opening: FloatArray


def no_contact(at: Gap) -> Contact:
    """Make the contact of a surface that nothing touches yet."""
    zero = np.zeros(at.gap.shape)
    return Contact(zero > 0, zero, zero, zero, at.control_place, at.control_gap)


def touched(before: Contact, gap: Gap) -> FloatArray:
    """Where on the indenter points came into contact that did not touch at the last equilibrium.

    The first touch lies within a step of the depth; to anchor a point where the step began, or where it ends, would be an error
    of first order in the step.

    Parameters
    ----------
    before : contact at the last equilibrium.
    gap : where the surface is now; the way from there to here is taken as straight.

    Returns
    -------
    Places s_0 along the meridian, (n_edge, 3).
    """
    closing = before.opening - gap.control_gap
    share = np.divide(before.opening, closing, out=np.ones_like(closing), where=closing > 0)
    return np.asarray(before.anchor + np.clip(share, 0.0, 1.0) * (gap.control_place - before.anchor))


def traction(contact: Contact, gap: FloatArray, place: FloatArray, coefficient: float) -> tuple[FloatArray, FloatArray]:
    """Pressure and friction that the laws of contact ask for: -eps b, and -eps (s - s_0) or -+ f lambda.

    Parameters
    ----------
    contact : which points touch, slip, and where they are anchored.
    gap : control values b of the gap, (n_edge, 3).
    place : control values of the place s, (n_edge, 3).
    coefficient : f, of friction.

    Returns
    -------
    Pressure and friction, each (n_edge, 3); 0 where nothing touches.
    """
    pressure = np.where(contact.active, -CONTACT_STIFFNESS * gap, 0.0)
    if coefficient == 0:
        return pressure, np.zeros_like(pressure)
    stick = -CONTACT_STIFFNESS * (place - contact.anchor)
    # A product of an infinite coefficient with no slip is meant to be nothing.
    limit = coefficient * pressure if np.isfinite(coefficient) else 0.0 * pressure
    return pressure, np.where(contact.active, np.where(contact.slip == 0, stick, -contact.slip * limit), 0.0)


def nodal(surface: Surface, values: FloatArray) -> FloatArray:
    """Turn tractions at control points into forces at nodes that do the same work.

    Parameters
    ----------
    surface : the top surface.
    values : tractions at the control points, (n_edge, 3).

    Returns
    -------
    Forces at the nodes of the edges, (n_edge, 3).
    """
    return np.asarray((surface.weight * values) @ _CONTROL)


@dataclass(frozen=True, eq=False)
class System:
    """Residual (n_edge, 6) and stiffness (n_edge, 6, 6) of the edges, and d(residual)/d(depth), (n_edge, 6)."""

    residual: FloatArray
    stiffness: FloatArray
    depth_load: FloatArray


def contact_system(surface: Surface, state: Gap, contact: Contact, coefficient: float) -> System:
    """Linearise the contact for Newton's method, with the stepped traction already eliminated.

    The control gap b_i moves with sum_j C_ij n_j . dx_j, C the matrix of (1) and j the nodes, so lambda_i presses on node j by
    C_ij lambda_i n_j; place and friction likewise, with t. With dn = k t (t.dx), dt = -k n (t.dx), k the curvature, and lambda,
    tau stepped by their laws, the stiffness is eps (C n)(C n) + eps (C t)(C s' t) where sticking, -+ f eps (C t)(C n) where
    slipping, and at the nodes -lambda k t t + tau k n t. The indenter moving down is the surface moving up.

    Parameters
    ----------
    surface : the top surface.
    state : where it is relative to the indenter.
    contact : which points touch and slip, and their tractions.
    coefficient : f, of friction.

    Returns
    -------
    Residual and stiffness of the edges; points that do not touch give nothing.
    """
    weight, eps = np.where(contact.active, surface.weight, 0.0), CONTACT_STIFFNESS
    n, t, k = state.normal, state.tangent, state.curvature
    pressure, friction = traction(contact, state.control_gap, state.control_place, coefficient)
    force = -nodal(surface, pressure) * n
    across = _rows(n)
    stiffness = np.swapaxes(across, 1, 2) @ (eps * weight[..., None] * across)
    block = -(nodal(surface, contact.pressure) * k) * t[:, None] * t[None]
    if coefficient > 0:
        force = force - nodal(surface, friction) * t
        block = block + (nodal(surface, contact.friction) * k) * n[:, None] * t[None]
        along = np.swapaxes(_rows(t), 1, 2)
        stiffness += along @ ((weight * np.where(contact.slip == 0, eps, 0.0))[..., None] * _rows(state.rate * t))
        if np.isfinite(coefficient):
            stiffness -= along @ ((weight * contact.slip * coefficient * eps)[..., None] * across)
    for node in range(3):
        stiffness[:, 2 * node : 2 * node + 2, 2 * node : 2 * node + 2] += np.moveaxis(block[..., node], 2, 0)
    return System(_by_edge(force), stiffness, np.sum(stiffness[:, :, 1::2], axis=2))


def _by_edge(vectors: FloatArray) -> FloatArray:
    """Components first (2, n_edge, 3) to dofs last (n_edge, 6)."""
    return np.moveaxis(vectors, 0, 2).reshape(-1, 6)


def _rows(vectors: FloatArray) -> FloatArray:
    """C_ij v_j as (n_edge, 3, 6): control points, dofs of the nodes."""
    return np.repeat(_CONTROL, 2, axis=1) * _by_edge(vectors)[:, None, :]


def moved_by(surface: Surface, du: FloatArray) -> FloatArray:
    """Pick the displacements of the surface out of all.

    Parameters
    ----------
    surface : the top surface.
    du : (n_dof,), displacements.

    Returns
    -------
    Of its nodes, (2, n_edge, 3).
    """
    return np.moveaxis(du.reshape(-1, 2)[surface.edges], 2, 0)


def stepped(state: Gap, contact: Contact, coefficient: float, dx: FloatArray) -> Contact:
    """Contact after a small displacement, by the linearised laws of traction.

    Parameters
    ----------
    state : where the surface is relative to the indenter.
    contact : the contact there.
    coefficient : f, of friction.
    dx : (2, n_edge, 3), displacement of the nodes relative to the indenter.

    Returns
    -------
    The contact with stepped pressure and friction; which points touch or slip stays.
    """
    along, across = np.sum(state.normal * dx, axis=0), np.sum(state.tangent * dx, axis=0)
    there = replace(state, gap=state.gap + along, place=state.place + state.rate * across)
    pressure, friction = traction(contact, there.control_gap, there.control_place, coefficient)
    return replace(contact, pressure=pressure, friction=friction)


def indenter_force(surface: Surface, state: Gap, contact: Contact) -> float:
    """Force of the surface on the indenter.

    Parameters
    ----------
    surface : the top surface.
    state : where it is relative to the indenter.
    contact : the tractions.

    Returns
    -------
    Upwards, in units of shear modulus times length^2.
    """
    up = nodal(surface, contact.pressure) * state.normal[1] + nodal(surface, contact.friction) * state.tangent[1]
    return float(-np.sum(up))


def contact_radius(surface: Surface, state: Gap, pressure: FloatArray) -> float:
    """Deformed radius of the rim of the contact, found between the nodes.

    Of a pressure as Hertz's that carries what the last two loaded edges carry: with
    p = p_s ((rho^2 - r^2) / (rho^2 - s^2))^(1/2) beyond the undeformed radius s, the load beyond it is
    Q = (2 pi / 3) p_s (rho^2 - s^2).

    Parameters
    ----------
    surface : the top surface.
    state : where it is relative to the indenter.
    pressure : at the control points, (n_edge, 3).

    Returns
    -------
    In the model's unit of length; 0 without contact.
    """
    if not np.any(pressure > 0):
        return 0.0
    r, loaded = surface.radius, np.flatnonzero(pressure[:, 1] > 0)
    last = int(loaded[-1]) if loaded.size else 0
    first = max(last - 1, 0)
    load, start = float(np.sum((surface.weight * pressure)[first:])), float(pressure[first, 0])
    rim = np.sqrt(r[first, 0] ** 2 + 3 * load / (2 * np.pi * start)) if start > 0 else 0.0
    rim = np.clip(rim, r[last, 0], r[min(last + 1, r.shape[0] - 1), 2])
    return float(np.interp(rim, r.ravel(), state.radius.ravel()))
