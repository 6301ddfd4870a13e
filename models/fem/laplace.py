"""From a deformed mesh to the capacitance of each dielectric by Laplace's equation: the check on the ring formula.

C / eps = integral |grad phi|^2 2 pi r dA over the deformed dielectric, phi harmonic, 0 and 1 on its electrodes and without flux
through its side and the axis, which is where fringe fields are left out. As phi minimises that integral, a coarse grid gives
too large a capacitance.
"""

from __future__ import annotations

import itertools

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from models.fem.elements import shape_1d
from models.fem.mesh import Mesh, through_layers, with_midpoints
from models.sensor import FloatArray

_GAUSS3, _WEIGHT3 = np.polynomial.legendre.leggauss(3)
#: Rows of elements that a dielectric is solved on at the least.
_ROWS = 4


def _cut(ends: FloatArray, low: float, high: float, least: int) -> FloatArray:
    """Ends of intervals from `low` to `high` that lie within those of `ends`, at least `least` of them."""
    tiny = 1e-9 * (high - low)
    cuts = np.concatenate([[low], ends[(ends > low + tiny) & (ends < high - tiny)], [high]])
    parts = int(np.ceil(least / (cuts.size - 1)))
    inner = [np.linspace(a, b, parts, endpoint=False) for a, b in itertools.pairwise(cuts)]
    return np.concatenate([*inner, [high]])


def _shapes(ends: FloatArray, x: FloatArray) -> FloatArray:
    """Values of all quadratic shape functions of a line of elements at x, shape (x.size, 2 n + 1)."""
    e = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, ends.size - 2)
    value, _ = shape_1d(2 * (x - ends[e]) / (ends[e + 1] - ends[e]) - 1)
    out = np.zeros((x.size, 2 * ends.size - 1))
    for k in range(3):
        out[np.arange(x.size), 2 * e + k] = value[k]
    return out


def positions(mesh: Mesh, u: FloatArray, r: FloatArray, z: FloatArray) -> FloatArray:
    """Where material points have gone.

    Parameters
    ----------
    mesh : the grid, undeformed.
    u : (n_dof,), displacements.
    r, z : (n_r,), (n_z,), undeformed coordinates.

    Returns
    -------
    Deformed r and z of the points of their grid, (2, n_r, n_z).
    """
    grid = u.reshape(mesh.r.size, mesh.n_row, 2)
    moved = np.einsum("im,mnc,jn->cij", _shapes(mesh.r[::2], r), grid, through_layers(mesh, z), optimize=True)
    return np.stack([r[:, None] + moved[0], z[None, :] + moved[1]])


def laplace_capacitance(mesh: Mesh, u: FloatArray, lower: float, upper: float, electrode: float) -> float:
    """Capacitance of one dielectric from the electric field in it, to check the rings against.

    Q2 elements, each within one of the mesh; positions between its nodes as the rings have them.

    Parameters
    ----------
    mesh : the grid, undeformed.
    u : (n_dof,), displacements.
    lower, upper : heights of its electrodes above the base, undeformed.
    electrode : material radius of the electrodes.

    Returns
    -------
    C / (eps_0 eps_r) in the mesh's unit of length; undeformed pi a_e^2 / (upper - lower).
    """
    columns, rows = _cut(mesh.r[::2], 0.0, electrode, 1), _cut(mesh.z[::2], lower, upper, _ROWS)
    x = positions(mesh, u, with_midpoints(columns), with_midpoints(rows))
    n_r, n_z = x.shape[1:]
    i, j = np.meshgrid(np.arange(columns.size - 1), np.arange(rows.size - 1), indexing="ij")
    element = (2 * i * n_z + 2 * j).ravel()[:, None] + (np.arange(3)[:, None] * n_z + np.arange(3)).ravel()
    a, b = (g.ravel() for g in np.meshgrid(_GAUSS3, _GAUSS3, indexing="ij"))
    (na, da), (nb, db) = shape_1d(a), shape_1d(b)
    shape = (na[:, None] * nb[None]).reshape(9, 9)
    slope = np.stack([(da[:, None] * nb[None]).reshape(9, 9), (na[:, None] * db[None]).reshape(9, 9)])
    at = x.reshape(2, -1)[:, element]
    jacobian = np.einsum("ken,dnq->kdeq", at, slope)
    det = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
    weight = 2 * np.pi * (at[0] @ shape) * det * np.outer(_WEIGHT3, _WEIGHT3).ravel()
    # Rows of the inverse Jacobian turn derivatives on the reference square into those in r and z.
    inverse = np.stack([np.stack([jacobian[1, 1], -jacobian[0, 1]]), np.stack([-jacobian[1, 0], jacobian[0, 0]])]) / det
    gradient = np.einsum("dkeq,dnq->kenq", inverse, slope)
    stiffness = np.einsum("eq,kenq,kemq->enm", weight, gradient, gradient, optimize=True)
    n = n_r * n_z
    where = np.repeat(element, 9, axis=1).ravel(), np.tile(element, (1, 9)).ravel()
    matrix = sp.csr_array((stiffness.ravel(), where), shape=(n, n))
    row = np.arange(n) % n_z
    phi = np.where(row == n_z - 1, 1.0, 0.0)
    free = np.flatnonzero((row > 0) & (row < n_z - 1))
    phi[free] = spsolve(matrix[free][:, free].tocsc(), -(matrix @ phi)[free])
    return float(phi @ (matrix @ phi))
