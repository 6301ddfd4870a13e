"""From surface positions and a rigid sphere to contact pressure, its force and stiffness; hard and frictionless.

The pressure lambda at two Gauss points an edge is an unknown of its own with lambda = -eps g for gap g < 0, and Newton
steps it by its linearisation (perturbed Lagrangian; Wriggers, "Computational Contact Mechanics", 2006, section 6.3), so that a
compliance 1/eps far below what a penalty method survives costs no convergence: penetration is below 1e-5 of the indentation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.fem.elements import shape_1d
from models.fem.mesh import Mesh
from models.sensor import BoolArray, FloatArray, IntArray

#: Contact stiffness in units of shear modulus over sphere radius.
CONTACT_STIFFNESS = 1e7

_GAUSS2, _WEIGHT2 = np.polynomial.legendre.leggauss(2)


@dataclass(frozen=True, eq=False)
class Surface:
    """The top surface: edges (n_edge, 3) of nodes, Gauss shape functions (3, 2), weights 2 pi r dr (n_edge, 2), radii."""

    edges: IntArray
    shape: FloatArray
    weight: FloatArray
    radius: FloatArray
    height: float


def make_surface(mesh: Mesh) -> Surface:
    """Edges of the top row of elements."""
    nr, _ = mesh.shape
    top = mesh.n_row - 1
    edges = (2 * np.arange(nr)[:, None] + np.arange(3)) * mesh.n_row + top
    half = (mesh.r[2::2] - mesh.r[:-2:2]) / 2
    radius = mesh.r[1::2, None] + half[:, None] * _GAUSS2
    weight = 2 * np.pi * radius * half[:, None] * _WEIGHT2
    return Surface(edges, shape_1d(_GAUSS2)[0], weight, radius, float(mesh.z[-1]))


@dataclass(frozen=True, eq=False)
class Gap:
    """Gap g (n_edge, 2) to the unit sphere, its outward normal n (2, n_edge, 2), distance to the centre, surface radius."""

    gap: FloatArray
    normal: FloatArray
    distance: FloatArray
    radius: FloatArray


def gap(surface: Surface, u: FloatArray, depth: float) -> Gap:
    """Gap between the deformed surface and the unit sphere lowered by `depth` from first touch."""
    ue = u.reshape(-1, 2)[surface.edges]
    x = surface.radius + np.einsum("en,nq->eq", ue[..., 0], surface.shape)
    z = surface.height + np.einsum("en,nq->eq", ue[..., 1], surface.shape)
    to_centre = z - (surface.height + 1 - depth)
    distance = np.hypot(x, to_centre)
    return Gap(distance - 1, np.stack([x, to_centre]) / distance, distance, x)


def contact_system(surface: Surface, state: Gap, pressure: FloatArray, active: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Residual (n_edge, 6) and stiffness (n_edge, 6, 6) of the active points, the stepped pressure already eliminated.

    With lambda' = -eps (g + n.dx): residual eps g n, stiffness eps n n - lambda (1 - n n)/rho.
    """
    w = np.where(active, surface.weight, 0.0)
    n = state.normal
    residual = np.einsum("eq,ceq,nq->enc", w * CONTACT_STIFFNESS * state.gap, n, surface.shape)
    nn = n[:, None] * n[None]
    lateral = np.eye(2)[:, :, None, None] - nn
    block = CONTACT_STIFFNESS * nn - (pressure / state.distance) * lateral
    stiffness = np.einsum("eq,cdeq,nq,mq->encmd", w, block, surface.shape, surface.shape)
    return residual.reshape(-1, 6), stiffness.reshape(-1, 6, 6)


def pressure_after(surface: Surface, state: Gap, active: BoolArray, du: FloatArray) -> FloatArray:
    """Linearised pressure -eps (g + n.dx) of the active points after the displacement step `du`; 0 elsewhere."""
    dx = np.einsum("enc,nq->ceq", du.reshape(-1, 2)[surface.edges], surface.shape)
    return np.where(active, -CONTACT_STIFFNESS * (state.gap + np.sum(state.normal * dx, axis=0)), 0.0)


def sphere_force(surface: Surface, state: Gap, pressure: FloatArray) -> float:
    """Upward force on the sphere, in units of shear modulus times R^2."""
    return float(-np.sum(surface.weight * pressure * state.normal[1]))


def contact_radius(state: Gap, pressure: FloatArray) -> float:
    """Radius at which the contact pressure vanishes, from p^2 linear in r^2 (Hertz) over the last loaded points."""
    p, r = pressure.ravel(), state.radius.ravel()
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
