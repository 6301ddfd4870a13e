"""From a grid and nodal displacements to internal forces and tangent stiffness, condensed to the border of each element.

Total Lagrangian Q2 displacement, discontinuous P1 pressure (Sussman & Bathe, Comput. Struct. 26 (1987) 357), 3 x 3 Gauss
points. Every integral carries 2 pi r. Trailing axes are (element, quadrature point).

As elements are rectangles before deformation, derivatives of shape functions are those of the reference square over the half
widths. The integrals over all elements are then products of one matrix of coefficients, (n_element, terms), with constant
matrices of products of shape functions, which is several times faster than a product for every element.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.fem import material
from models.fem.material import Material
from models.fem.mesh import Mesh
from models.layers import LayeredDesign
from models.sensor import INCOMPRESSIBLE, FloatArray, IntArray

#: Range of Lame's lambda over mu. What is incompressible gives way as much as the upper end lets it; at the lower end, where
#: p / lambda still is a number, a foam of Poisson's ratio 0 has no pressure that could be seen.
LEAST_LAME_RATIO, LARGEST_LAME_RATIO = 1e-24, 1e4

_GAUSS3, _WEIGHT3 = np.polynomial.legendre.leggauss(3)


def shape_1d(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Quadratic Lagrange shape functions and derivatives at x in [-1, 1], shape (3, ...)."""
    value = np.stack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
    slope = np.stack([x - 0.5, -2 * x, x + 0.5])
    return value, slope


#: Order of the nodes of an element here: the eight on its border, then the inner one.
_NODES = np.array([0, 1, 2, 3, 5, 6, 7, 8, 4])
#: Where the border's components (r of all nodes, then z) have the three nodes of the lower side.
BASE_R = tuple(int(np.flatnonzero(3 * i == _NODES)[0]) for i in range(3))
BASE_Z = tuple(8 + r for r in BASE_R)
#: Quadrature points of the reference square, shape (9,).
_X, _Y = (g.ravel() for g in np.meshgrid(_GAUSS3, _GAUSS3, indexing="ij"))
_W = np.outer(_WEIGHT3, _WEIGHT3).ravel()
(_NX, _DX), (_NY, _DY) = shape_1d(_X), shape_1d(_Y)
#: N, dN/dx and dN/dy of node i at point q, shape (9 q, 9 i).
_N = (_NX[:, None] * _NY[None]).reshape(9, 9)[_NODES].T
_N_X = (_DX[:, None] * _NY[None]).reshape(9, 9)[_NODES].T
_N_Y = (_NX[:, None] * _DY[None]).reshape(9, 9)[_NODES].T
#: Pressure functions 1, x, y at point q, shape (9 q, 3).
PRESSURE_SHAPE = np.stack([np.ones(9), _X, _Y], axis=1)

#: Components of f that u_r enters (rr, rz, hoop) and that u_z enters (zr, zz), with the shape functions they come from.
_R_PARTS = ((0, _N_X), (1, _N_Y), (4, _N))
_Z_PARTS = ((2, _N_X), (3, _N_Y))
_R_TO_F = np.concatenate([b for _, b in _R_PARTS]).T  # (9 i, 27)
_Z_TO_F = np.concatenate([b for _, b in _Z_PARTS]).T


def _pairs(left: tuple[tuple[int, FloatArray], ...], right: tuple[tuple[int, FloatArray], ...]) -> FloatArray:
    """Products B_m,i B_n,j at each point, rows (pair of components, q), columns (i, j); unordered pairs if left is right."""
    rows = []
    for x, (_, b) in enumerate(left):
        for y, (_, c) in enumerate(right):
            if left is not right:
                rows.append(np.einsum("qi,qj->qij", b, c))
            elif y >= x:
                both = np.einsum("qi,qj->qij", b, c)
                rows.append(both if x == y else both + np.swapaxes(both, 1, 2))
    return np.concatenate(rows).reshape(-1, 81)


_RR, _RZ, _ZZ = _pairs(_R_PARTS, _R_PARTS), _pairs(_R_PARTS, _Z_PARTS), _pairs(_Z_PARTS, _Z_PARTS)
_RR_PAIRS = tuple((m, n) for x, m in enumerate((0, 1, 4)) for n in (0, 1, 4)[x:])
_RZ_PAIRS = tuple((m, n) for m in (0, 1, 4) for n in (2, 3))
_ZZ_PAIRS = ((2, 2), (2, 3), (3, 3))
#: Products B_m,i psi_a, rows (component, q), columns (i, a).
_RP = np.concatenate([np.einsum("qi,qa->qia", b, PRESSURE_SHAPE) for _, b in _R_PARTS]).reshape(-1, 27)
_ZP = np.concatenate([np.einsum("qi,qa->qia", b, PRESSURE_SHAPE) for _, b in _Z_PARTS]).reshape(-1, 27)


@dataclass(frozen=True, eq=False)
class Elements:
    """Everything of the elements that does not change while loading.

    Attributes
    ----------
    scale : (5, n_element, n_quad) what turns derivatives on the reference square into those of the components of f.
    weight : (n_element, n_quad) quadrature weight times 2 pi r.
    material : laws and moduli.
    bulk_root : (n_element, 3, 3) lower Cholesky factor of the inverse of the integral of psi psi / lambda.
    border_dofs, inner_dofs : (n_element, 16), (n_element, 2) global displacement components, r of all nodes, then z.
    dofs : (n_element, 18) both.
    """

    scale: FloatArray
    weight: FloatArray
    material: Material
    bulk_root: FloatArray
    border_dofs: IntArray
    inner_dofs: IntArray
    dofs: IntArray


def lame_ratio(poisson_ratio: float) -> float:
    """Lame's lambda over mu, 2 nu / (1 - 2 nu), of a layer that has this Poisson's ratio at small strain, within its range."""
    ratio = np.inf if poisson_ratio >= INCOMPRESSIBLE else 2 * poisson_ratio / (1 - 2 * poisson_ratio)
    return float(np.clip(ratio, LEAST_LAME_RATIO, LARGEST_LAME_RATIO))


def make_elements(mesh: Mesh, design: LayeredDesign) -> Elements:
    """Everything of the elements that does not change while loading: weights, scales and materials.

    Parameters
    ----------
    mesh : the grid.
    design : whose layers they are made of.

    Returns
    -------
    The elements.
    """
    nr, nz = mesh.shape
    half_r = (mesh.r[2::2] - mesh.r[:-2:2]) / 2
    half_z = (mesh.z[2::2] - mesh.z[:-2:2]) / 2
    hr, hz = np.repeat(half_r, nz)[:, None], np.tile(half_z, nr)[:, None]
    radius = np.repeat(mesh.r[1::2], nz)[:, None] + hr * _X
    one = np.ones(9)
    weight = 2 * np.pi * radius * _W * (hr * hz)
    layer = np.tile(mesh.layer, nr)
    ratio = np.array([lame_ratio(x.poisson_ratio) for x in design.layers])[layer][:, None]
    modulus = np.array([x.young_modulus / (2 * (1 + x.poisson_ratio)) for x in design.layers])[layer][:, None]
    laws = tuple(dict.fromkeys(x.law for x in design.layers))
    which = np.array([laws.index(x.law) for x in design.layers])[layer]
    where = tuple(np.flatnonzero(which == k) for k in range(len(laws)))
    gram = np.einsum("eq,qa,qb->eab", weight, PRESSURE_SHAPE, PRESSURE_SHAPE)
    nodes = mesh.elements[:, _NODES]
    border = np.concatenate([2 * nodes[:, :8], 2 * nodes[:, :8] + 1], axis=1)
    inner = np.stack([2 * nodes[:, 8], 2 * nodes[:, 8] + 1], axis=1)
    return Elements(
        scale=np.stack([one / hr, one / hz, one / hr, one / hz, 1 / radius]),
        weight=weight,
        material=Material(laws, where, modulus, ratio * modulus),
        bulk_root=np.linalg.cholesky(np.linalg.inv(gram) * ratio[:, :, None] * modulus[:, :, None]),
        border_dofs=border,
        inner_dofs=inner,
        dofs=np.concatenate([border, inner], axis=1),
    )


def deformation(elements: Elements, u: FloatArray) -> FloatArray:
    """Deformation gradient at every quadrature point.

    Parameters
    ----------
    elements : of the grid.
    u : (n_dof,), displacements.

    Returns
    -------
    Stacked gradient f (see `models.fem.material`), shape (5, n_element, n_quad).
    """
    n = elements.weight.shape[0]
    ub, ui = u[elements.border_dofs], u[elements.inner_dofs]
    f = np.empty((5, n, 9))
    from_r = np.concatenate([ub[:, :8], ui[:, :1]], axis=1) @ _R_TO_F
    from_z = np.concatenate([ub[:, 8:], ui[:, 1:]], axis=1) @ _Z_TO_F
    f[0], f[1], f[4] = from_r[:, :9], from_r[:, 9:18], from_r[:, 18:]
    f[2], f[3] = from_z[:, :9], from_z[:, 9:]
    f *= elements.scale
    f[[0, 3, 4]] += 1
    return f


@dataclass(frozen=True, eq=False)
class Residual:
    """Internal force and volume residual of the elements, and how the pressure enters the force.

    Attributes
    ----------
    force : (n_element, 18), dofs as in `Elements.dofs`.
    coupling : (n_element, 18, 3), d(force)/d(pressure coefficient), times `Elements.bulk_root`.
    volume : (n_element, 3), integral of psi (J - 1 - p / lambda), times the transpose of the same.
    """

    force: FloatArray
    coupling: FloatArray
    volume: FloatArray


def _terms(values: list[FloatArray]) -> FloatArray:
    return np.concatenate(values, axis=1)


def _residual(elements: Elements, point: material.Point, p: FloatArray) -> Residual:
    n, w = elements.weight.shape[0], elements.weight
    scale = elements.scale * w
    s, c = point.stress * scale, point.cofactor * scale
    force, coupling = np.empty((n, 18)), np.empty((n, 18, 3))
    from_r, from_z = _terms([s[m] for m, _ in _R_PARTS]) @ _R_TO_F.T, _terms([s[m] for m, _ in _Z_PARTS]) @ _Z_TO_F.T
    force[:, :8], force[:, 16], force[:, 8:16], force[:, 17] = from_r[:, :8], from_r[:, 8], from_z[:, :8], from_z[:, 8]
    to_r = (_terms([c[m] for m, _ in _R_PARTS]) @ _RP).reshape(n, 9, 3)
    to_z = (_terms([c[m] for m, _ in _Z_PARTS]) @ _ZP).reshape(n, 9, 3)
    coupling[:, :8], coupling[:, 16], coupling[:, 8:16], coupling[:, 17] = to_r[:, :8], to_r[:, 8], to_z[:, :8], to_z[:, 8]
    volume = ((point.jacobian - 1 - p / elements.material.lame) * w) @ PRESSURE_SHAPE
    return Residual(force, coupling @ elements.bulk_root, (volume[:, None, :] @ elements.bulk_root)[:, 0])


@dataclass(frozen=True, eq=False)
class Condensed:
    """Linearised equilibrium of the elements with pressure and inner node eliminated (static condensation).

    Attributes
    ----------
    force, stiffness : (n_element, 16), (n_element, 16, 16) on the border; the stiffness is what Newton's method needs.
    offset, slope : (n_element, 2), (n_element, 2, 16): the inner node moves by -(offset + slope du_border).
    inverse : (n_element, 2, 2) of the inner node's stiffness.
    residual : before condensation, from which `pressure_step` gives the pressure back.
    """

    force: FloatArray
    stiffness: FloatArray
    offset: FloatArray
    slope: FloatArray
    inverse: FloatArray
    residual: Residual


def condense(elements: Elements, f: FloatArray, pressure: FloatArray) -> Condensed:
    """Force and tangent of the elements, their pressure and inner node eliminated.

    The element pressure obeys integral psi (J - 1 - p/lambda) = 0; its linearisation is eliminated exactly, so Newton on the
    displacement is Newton on both.

    Parameters
    ----------
    elements : of the grid.
    f : (5, n_element, n_quad), deformation.
    pressure : (n_element, 3), coefficients of the pressure.

    Returns
    -------
    Force and stiffness on the border of the elements, and what gives inner node and pressure back.
    """
    p = pressure @ PRESSURE_SHAPE.T
    point = material.at_point(elements.material, f, p)
    plain = _residual(elements, point, p)
    n, w, h = elements.weight.shape[0], elements.weight, point.tangent
    scale = elements.scale
    left = scale * w
    rr = (_terms([h[i, j] * left[i] * scale[j] for i, j in _RR_PAIRS]) @ _RR).reshape(n, 9, 9)
    rz = (_terms([h[i, j] * left[i] * scale[j] for i, j in _RZ_PAIRS]) @ _RZ).reshape(n, 9, 9)
    zz = (_terms([h[i, j] * left[i] * scale[j] for i, j in _ZZ_PAIRS]) @ _ZZ).reshape(n, 9, 9)
    k = np.empty((n, 16, 16))
    k[:, :8, :8], k[:, :8, 8:], k[:, 8:, 8:] = rr[:, :8, :8], rz[:, :8, :8], zz[:, :8, :8]
    k[:, 8:, :8] = np.swapaxes(rz[:, :8, :8], 1, 2)
    across = np.empty((n, 16, 2))
    across[:, :8, 0], across[:, 8:, 0] = rr[:, :8, 8], rz[:, 8, :8]
    across[:, :8, 1], across[:, 8:, 1] = rz[:, :8, 8], zz[:, :8, 8]
    # Pressure: K + Q Q^T with Q the coupling, force + Q v with v the volume residual.
    q, v = plain.coupling, plain.volume
    border, inner = q[:, :16], q[:, 16:]
    inner_t = np.swapaxes(inner, 1, 2)
    across += border @ inner_t
    ii = inner @ inner_t
    a, b, c = ii[:, 0, 0] + rr[:, 8, 8], ii[:, 0, 1] + rz[:, 8, 8], ii[:, 1, 1] + zz[:, 8, 8]
    force = plain.force + (q @ v[:, :, None])[:, :, 0]
    inverse = np.empty((n, 2, 2))
    det = a * c - b * b
    inverse[:, 0, 0], inverse[:, 1, 1], inverse[:, 0, 1] = c / det, a / det, -b / det
    inverse[:, 1, 0] = inverse[:, 0, 1]
    slope = inverse @ np.swapaxes(across, 1, 2)
    offset = (inverse @ force[:, 16:, None])[:, :, 0]
    # Both eliminations as one product: K + [Q, -across] [Q, slope^T]^T.
    k += np.concatenate([border, -across], axis=2) @ np.concatenate([np.swapaxes(border, 1, 2), slope], axis=1)
    return Condensed(force[:, :16] - (across @ offset[..., None])[..., 0], k, offset, slope, inverse, plain)


def residual(elements: Elements, f: FloatArray, pressure: FloatArray) -> Residual:
    """Force and volume residual of the elements alone, without the tangent.

    Parameters
    ----------
    elements, f, pressure : as in `condense`.

    Returns
    -------
    Before condensation.
    """
    p = pressure @ PRESSURE_SHAPE.T
    return _residual(elements, material.at_point(elements.material, f, p), p)


def condensed_change(at: Condensed, force: FloatArray, volume: FloatArray) -> tuple[FloatArray, Condensed]:
    """Carry a change of the elements' residual to their border, as the condensed tangent does.

    Parameters
    ----------
    at : condensed elements at an equilibrium.
    force : (n_element, 18), change of the force.
    volume : (n_element, 3), change of the volume residual.

    Returns
    -------
    The change of the border force (n_element, 16), and `at` with the changes in the place of offset and volume residual, for
    `displacement_step` and `pressure_step` to follow them.
    """
    total = force + (at.residual.coupling @ volume[:, :, None])[:, :, 0]
    inner = total[:, 16:, None]
    border = total[:, :16] - (np.swapaxes(at.slope, 1, 2) @ inner)[:, :, 0]
    follow = replace(at, offset=(at.inverse @ inner)[:, :, 0], residual=replace(at.residual, volume=volume))
    return border, follow


def displacement_step(elements: Elements, at: Condensed, du: FloatArray) -> None:
    """Complete a step of the displacements by the inner nodes, which follow the border.

    Parameters
    ----------
    elements : of the grid.
    at : condensed elements that the step came from.
    du : (n_dof,), the step; the inner nodes' part is written into it.
    """
    border = du[elements.border_dofs]
    du[elements.inner_dofs] = -at.offset - (at.slope @ border[:, :, None])[:, :, 0]


def pressure_step(elements: Elements, at: Condensed, du: FloatArray) -> FloatArray:
    """Step of the pressure that goes with a step of the displacements.

    Parameters
    ----------
    elements : of the grid.
    at : condensed elements that the step came from.
    du : (n_dof,), the step, inner nodes included.

    Returns
    -------
    Change of the pressure coefficients, shape (n_element, 3).
    """
    rate = at.residual.volume + (du[elements.dofs][:, None, :] @ at.residual.coupling)[:, 0]
    return np.asarray((elements.bulk_root @ rate[:, :, None])[..., 0])
