"""From a grid and nodal displacements to internal forces and tangent stiffness, the pressure condensed in each element.

Total Lagrangian Q2 displacement, discontinuous P1 pressure (Sussman & Bathe, Comput. Struct. 26 (1987) 357), 3 x 3 Gauss
points. Every integral carries 2 pi r. Trailing axes are (element, quadrature point).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.fem import material
from models.fem.mesh import Mesh, Stack
from models.sensor import FloatArray

#: Bulk over shear modulus of every layer.
BULK_RATIO = 1e4

_GAUSS3, _WEIGHT3 = np.polynomial.legendre.leggauss(3)


def shape_1d(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Quadratic Lagrange shape functions and derivatives at x in [-1, 1], shape (3, ...)."""
    value = np.stack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
    slope = np.stack([x - 0.5, -2 * x, x + 0.5])
    return value, slope


@dataclass(frozen=True, eq=False)
class Elements:
    """Everything of the elements that does not change while loading.

    Attributes
    ----------
    gradient : (n_element, n_quad * 5, 18) from element displacements (r and z of node 0, of node 1, ...) to f - f_0.
    weight : (n_element, n_quad) quadrature weight times 2 pi r.
    modulus : (n_element, 1) shear modulus.
    pressure_shape : (n_quad, 3) P1 functions 1, x, y.
    bulk_compliance : (n_element, 3, 3) inverse of the integral of psi psi / K.
    dofs : (n_element, 18) global displacement components.
    """

    gradient: FloatArray
    weight: FloatArray
    modulus: FloatArray
    pressure_shape: FloatArray
    bulk_stiffness: FloatArray
    dofs: np.ndarray[tuple[int, int], np.dtype[np.int64]]


def make_elements(mesh: Mesh, stack: Stack) -> Elements:
    """Shape-function gradients and weights of every element; shear modulus 1 in the sensor."""
    nr, nz = mesh.shape
    x, y = (g.ravel() for g in np.meshgrid(_GAUSS3, _GAUSS3, indexing="ij"))
    w = np.outer(_WEIGHT3, _WEIGHT3).ravel()
    (nx, dx), (ny, dy) = shape_1d(x), shape_1d(y)
    half_r = (mesh.r[2::2] - mesh.r[:-2:2]) / 2
    half_z = (mesh.z[2::2] - mesh.z[:-2:2]) / 2
    hr, hz = np.repeat(half_r, nz), np.tile(half_z, nr)
    centre = np.repeat(mesh.r[1::2], nz)
    radius = centre[:, None] + hr[:, None] * x
    n = (nx[:, None] * ny[None]).reshape(9, -1)
    n_r = (dx[:, None] * ny[None]).reshape(9, -1).T[None] / hr[:, None, None]
    n_z = (nx[:, None] * dy[None]).reshape(9, -1).T[None] / hz[:, None, None]
    g = np.zeros((nr * nz, 9, 5, 9, 2))
    g[:, :, 0, :, 0] = n_r
    g[:, :, 1, :, 0] = n_z
    g[:, :, 2, :, 1] = n_r
    g[:, :, 3, :, 1] = n_z
    g[:, :, 4, :, 0] = n.T[None] / radius[..., None]
    weight = 2 * np.pi * radius * w * (hr * hz)[:, None]
    row = np.tile(np.arange(nz), nr)
    modulus = np.where(row >= mesh.sensor_row, 1.0, stack.padding_modulus)[:, None]
    psi = np.stack([np.ones_like(x), x, y], axis=1)
    gram = np.einsum("eq,qa,qb->eab", weight, psi, psi)
    dofs = (2 * mesh.elements[:, :, None] + np.arange(2)).reshape(-1, 18)
    return Elements(
        gradient=g.reshape(nr * nz, 45, 18),
        weight=weight,
        modulus=modulus,
        pressure_shape=psi,
        bulk_stiffness=np.linalg.inv(gram) * BULK_RATIO * modulus[:, :, None],
        dofs=dofs,
    )


_REST = np.array([1.0, 0.0, 0.0, 1.0, 1.0])


def deformation(elements: Elements, u: FloatArray) -> FloatArray:
    """Stacked gradient f at every quadrature point, shape (5, n_element, n_quad)."""
    ue = u[elements.dofs]
    f = (elements.gradient @ ue[..., None]).reshape(ue.shape[0], 9, 5) + _REST
    return np.ascontiguousarray(np.moveaxis(f, 2, 0))


#: Displacement components of the inner node of an element, and of the eight on its border.
INNER = slice(8, 10)
BORDER = np.r_[0:8, 10:18]


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Condensed element forces (n_element, 18), stiffness (n_element, 18, 18), and what gives the pressure back."""

    force: FloatArray
    stiffness: FloatArray
    coupling: FloatArray
    pressure_residual: FloatArray

    def pressure_step(self, elements: Elements, du: FloatArray) -> FloatArray:
        """Change of the pressure coefficients that goes with the displacement change `du`, shape (n_element, 3)."""
        rate = self.pressure_residual + np.einsum("eia,ei->ea", self.coupling, du[elements.dofs])
        return np.asarray(np.einsum("eab,eb->ea", elements.bulk_stiffness, rate))


def linearise(elements: Elements, f: FloatArray, pressure: FloatArray) -> Linearisation:
    """Internal force and tangent at deformation `f` with pressure coefficients `pressure` (n_element, 3).

    The element pressure obeys integral psi (J - 1 - p/K) = 0; its linearisation is eliminated exactly, so Newton on the
    displacement is Newton on both.
    """
    mu, w = elements.modulus, elements.weight
    p = pressure @ elements.pressure_shape.T
    sig = material.stress(f, p, mu) * w
    tan = np.ascontiguousarray(np.moveaxis(material.tangent(f, p, mu) * w, (0, 1), (2, 3)))
    cof = material.cofactor(f) * w
    n_element = w.shape[0]
    g = elements.gradient
    g5 = g.reshape(n_element, 9, 5, 18)
    gt = np.swapaxes(g, 1, 2)
    kuu = gt @ (tan @ g5).reshape(n_element, 45, 18)
    cofq = np.moveaxis(cof, 0, 2)[..., None] * elements.pressure_shape[None, :, None, :]
    kup = gt @ cofq.reshape(n_element, 45, 3)
    ru = (gt @ np.moveaxis(sig, 0, 2).reshape(n_element, 45, 1))[..., 0]
    rp = ((material.jacobian(f) - 1 - p / (BULK_RATIO * mu)) * w) @ elements.pressure_shape
    kb = kup @ elements.bulk_stiffness
    return Linearisation(
        force=ru + np.einsum("eia,ea->ei", kb, rp),
        stiffness=kuu + kb @ np.swapaxes(kup, 1, 2),
        coupling=kup,
        pressure_residual=rp,
    )


@dataclass(frozen=True, eq=False)
class Condensed:
    """A `Linearisation` on the border nodes alone: force (n_element, 16), stiffness (n_element, 16, 16).

    The inner node follows the border: du_inner = -(offset + slope du_border), offset (n_element, 2), slope (n_element, 2, 16).
    """

    force: FloatArray
    stiffness: FloatArray
    offset: FloatArray
    slope: FloatArray


def condense(lin: Linearisation) -> Condensed:
    """Eliminate the inner node of every element (static condensation), which narrows the band of the global tangent."""
    inner = np.linalg.inv(lin.stiffness[:, INNER, INNER])
    across = lin.stiffness[:, BORDER, INNER]
    offset = (inner @ lin.force[:, INNER, None])[..., 0]
    slope = inner @ np.swapaxes(across, 1, 2)
    return Condensed(
        force=lin.force[:, BORDER] - (across @ offset[..., None])[..., 0],
        stiffness=lin.stiffness[:, BORDER[:, None], BORDER] - across @ slope,
        offset=offset,
        slope=slope,
    )
