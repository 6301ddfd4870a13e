"""From surface positions and a rigid indenter to contact pressure and friction, their forces and stiffness.

Pressure lambda and friction tau at the nodes of the surface, with the weights of Simpson's rule, are unknowns of their own with
lambda = -eps g for gap g < 0, and Newton steps them by their linearisation (perturbed Lagrangian; Wriggers, "Computational
Contact Mechanics", 2006, section 6.3), so that a compliance 1/eps far below what a penalty method survives costs no
convergence: penetration of the nodes is below 1e-5 of the indentation (between them a quadratic edge and the indenter part by
what a finer mesh takes away). Friction is Coulomb's: a point sticks where it touched, tau = -eps (s - s_0) with s its place
along the indenter's meridian, or slips, tau = -+ f lambda.

At nodes and not at Gauss points, since a bulge of an edge that vanishes at its two Gauss points is seen by no contact
pressure there, and folds the surface of a thin layer that is pressed hard.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.fem.mesh import Mesh
from models.layers import Profile
from models.sensor import BoolArray, FloatArray, IntArray

#: Contact stiffness in units of shear modulus over size of the indenter.
CONTACT_STIFFNESS = 1e8

#: Simpson's rule on [-1, 1]; each corner node is a point of both its edges.
_POINTS, _WEIGHTS = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3
#: The node on the axis carries as if it lay this share of an edge away from it, or nothing would hold it.
_AXIS = 0.05


@dataclass(frozen=True, eq=False)
class Surface:
    """The top surface: edges (n_edge, 3) of nodes, weights 2 pi r dr and undeformed radii of their nodes (n_edge, 3)."""

    edges: IntArray
    weight: FloatArray
    radius: FloatArray


def make_surface(mesh: Mesh) -> Surface:
    """Edges of the top row of elements."""
    nr, _ = mesh.shape
    top = mesh.n_row - 1
    edges = (2 * np.arange(nr)[:, None] + np.arange(3)) * mesh.n_row + top
    half = (mesh.r[2::2] - mesh.r[:-2:2]) / 2
    radius = mesh.r[1::2, None] + half[:, None] * _POINTS
    weight = 2 * np.pi * np.maximum(radius, 2 * _AXIS * half[0]) * half[:, None] * _WEIGHTS
    return Surface(edges, weight, radius)


@dataclass(frozen=True, eq=False)
class Gap:
    """Where the surface is relative to the indenter, arrays (n_edge, 3) or (2, n_edge, 3).

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


def distance(profile: Profile, x: FloatArray, z: FloatArray) -> Gap:
    """Nearest point of the indenter's meridian to points at radius `x` and height `z` above its lowest point."""
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
    """Gap between the deformed surface and the indenter lowered by `depth` from first touch."""
    ue = u.reshape(-1, 2)[surface.edges]
    return distance(profile, surface.radius + ue[..., 0], ue[..., 1] + depth)


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact unknowns at the surface points, all of shape (n_edge, 3).

    Attributes
    ----------
    active : whether the point touches; `pressure` : lambda, 0 elsewhere.
    slip : 0 where the point sticks, else the sign of its slip; `friction` : tau along the meridian.
    anchor : place s_0 at which the point touched, or last slipped to.
    """

    active: BoolArray
    pressure: FloatArray
    slip: FloatArray
    friction: FloatArray
    anchor: FloatArray


def no_contact(surface: Surface) -> Contact:
    """Nothing touches."""
    zero = np.zeros(surface.weight.shape)
    return Contact(zero > 0, zero, zero, zero, zero)


def traction(contact: Contact, state: Gap, coefficient: float) -> tuple[FloatArray, FloatArray]:
    """Pressure and friction the current positions ask for: -eps g, and -eps (s - s_0) or -+ f lambda; 0 where inactive."""
    pressure = np.where(contact.active, -CONTACT_STIFFNESS * state.gap, 0.0)
    if coefficient == 0:
        return pressure, np.zeros_like(pressure)
    stick = -CONTACT_STIFFNESS * (state.place - contact.anchor)
    # A product of an infinite coefficient with no slip is meant to be nothing.
    limit = coefficient * pressure if np.isfinite(coefficient) else 0.0 * pressure
    return pressure, np.where(contact.active, np.where(contact.slip == 0, stick, -contact.slip * limit), 0.0)


@dataclass(frozen=True, eq=False)
class System:
    """Residual (n_edge, 6) and stiffness (n_edge, 6, 6) of the edges, and d(residual)/d(depth), (n_edge, 6)."""

    residual: FloatArray
    stiffness: FloatArray
    depth_load: FloatArray


def contact_system(surface: Surface, state: Gap, contact: Contact, coefficient: float) -> System:
    """Linearisation of the active points with the stepped traction already eliminated.

    The traction on the body is lambda n + tau t. With dn = k t (t.dx), dt = -k n (t.dx), k the curvature, and lambda, tau
    stepped to -eps (g + n.dx) and their friction law, the residual is eps g n - tau' t and the stiffness
    eps n n - lambda k t t + tau k n t, plus eps s' t t where sticking and -+ f eps t n where slipping. The indenter moving
    down is the surface moving up.
    """
    w = np.where(contact.active, surface.weight, 0.0)
    n, t = state.normal, state.tangent
    pressure, friction = traction(contact, state, coefficient)
    eps, k = CONTACT_STIFFNESS, state.curvature
    block = eps * n[:, None] * n[None] - (contact.pressure * k) * t[:, None] * t[None]
    force = -pressure * n
    if coefficient > 0:
        force = force - friction * t
        block += (contact.friction * k) * n[:, None] * t[None]
        block += np.where(contact.slip == 0, eps * state.rate, 0.0) * t[:, None] * t[None]
        if np.isfinite(coefficient):
            block -= (contact.slip * coefficient * eps) * t[:, None] * n[None]
    n_edge = w.shape[0]
    stiffness = np.zeros((n_edge, 3, 2, 3, 2))
    for node in range(3):
        stiffness[:, node, :, node, :] = np.moveaxis(w * block, (0, 1), (2, 3))[:, node]
    return System(
        np.moveaxis(w * force, 0, 2).reshape(n_edge, 6),
        stiffness.reshape(n_edge, 6, 6),
        np.moveaxis(w * block[:, 1], 0, 2).reshape(n_edge, 6),
    )


def moved_by(surface: Surface, du: FloatArray) -> FloatArray:
    """Displacement of the surface points, shape (2, n_edge, 3)."""
    return np.moveaxis(du.reshape(-1, 2)[surface.edges], 2, 0)


def stepped(state: Gap, contact: Contact, coefficient: float, dx: FloatArray) -> Contact:
    """Linearised traction after the displacement `dx` (2, n_edge, 3) of the points relative to the indenter."""
    along, across = np.sum(state.normal * dx, axis=0), np.sum(state.tangent * dx, axis=0)
    there = replace(state, gap=state.gap + along, place=state.place + state.rate * across)
    pressure, friction = traction(contact, there, coefficient)
    return replace(contact, pressure=pressure, friction=friction)


def indenter_force(surface: Surface, state: Gap, contact: Contact) -> float:
    """Upward force on the indenter, in units of shear modulus times length^2."""
    up = contact.pressure * state.normal[1] + contact.friction * state.tangent[1]
    return float(-np.sum(surface.weight * up))


def contact_radius(state: Gap, pressure: FloatArray) -> float:
    """Radius at which the contact pressure vanishes, from p^2 linear in r^2 (Hertz) over the last loaded points."""
    # Every node once: the first two of each edge.
    p, r = pressure[:, :2].ravel(), state.radius[:, :2].ravel()
    loaded = np.flatnonzero(p > 0)
    if loaded.size == 0:
        return 0.0
    last = loaded[-1]
    outer = float(r[min(last + 1, r.size - 1)])
    if last < 2:
        return float((r[last] + outer) / 2)
    x, y = r[last - 2 : last + 1 : 2] ** 2, p[last - 2 : last + 1 : 2] ** 2
    if y[1] >= y[0]:
        return float((r[last] + outer) / 2)
    edge = np.sqrt(x[1] + y[1] * (x[1] - x[0]) / (y[0] - y[1]))
    return float(np.clip(edge, r[last], outer))
