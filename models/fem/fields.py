"""From an equilibrium to fields a person can look at, on a grid of points of every layer.

The gradient of a Q2 displacement and a discontinuous P1 pressure are an order better at the 2 x 2 Gauss points of an element
than anywhere else in it. Gradient and mean stress are taken there and carried to the nodes by quadratics fitted to the points
of two neighbouring elements along each direction, never across the face of a layer (Zienkiewicz & Zhu, Int. J. Numer. Methods
Eng. 33 (1992) 1331, which for a structured grid is a product with two small matrices); stretches follow from the gradient.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.fem import material
from models.fem.elements import shape_1d
from models.fem.mesh import with_midpoints
from models.fem.solution import Solution
from models.sensor import FloatArray, IntArray

_GAUSS2 = np.polynomial.legendre.leggauss(2)[0]
#: Local nodes 3 i + j (column i, row j) of an element in VTK's order: corners, middles of the sides, middle.
_VTK = np.array([0, 6, 8, 2, 3, 7, 5, 1, 4])


@dataclass(frozen=True, eq=False)
class Fields:
    """One equilibrium on the nodes of every layer; a point on the face between two layers is there twice, once for each.

    Points are numbered layer by layer from the base up, within a layer column by column from the axis, from its lower face up.

    Attributes
    ----------
    r, z : deformed position [m], (n_point,).
    rest_r, rest_z : undeformed position [m], (n_point,).
    pressure : -tr(sigma)/3 [Pa] of the Cauchy stress, positive in compression, (n_point,).
    thickness_stretch : |F e_z| [1], of material lines that were normal to the layers, (n_point,).
    largest_stretch : largest principal stretch [1], (n_point,).
    cells : points of the biquadratic quadrilaterals in VTK's order, (n_cell, 9).
    layer : which layer each of them belongs to, counted from the base, (n_cell,).
    shapes : columns and rows of points of every layer.
    """

    r: FloatArray
    z: FloatArray
    rest_r: FloatArray
    rest_z: FloatArray
    pressure: FloatArray
    thickness_stretch: FloatArray
    largest_stretch: FloatArray
    cells: IntArray
    layer: IntArray
    shapes: tuple[tuple[int, int], ...]


def sheet(fields: Fields, values: FloatArray, layer: int) -> FloatArray:
    """Values of one layer as a rectangle of columns and rows.

    Parameters
    ----------
    fields : which the values belong to.
    values : (n_point,).
    layer : counted from the base.

    Returns
    -------
    Shape (n_column, n_row), columns from the axis outwards, rows from the base up.
    """
    sizes = [columns * rows for columns, rows in fields.shapes]
    start = sum(sizes[:layer])
    return values[start : start + sizes[layer]].reshape(fields.shapes[layer])


def fields_of(solution: Solution, step: int = -1) -> Fields:
    """Stress, stretch and position everywhere in one state of a solution.

    Parameters
    ----------
    solution : the path.
    step : index into `solution.states`; negative ones count from the end.

    Returns
    -------
    On the nodes of every layer, SI.

    Raises
    ------
    ValueError
        If there is no such state.
    """
    if not -len(solution.states) <= step < len(solution.states):
        raise ValueError(f"there is no step {step}: the solution has {len(solution.states)}")
    model, state, units = solution.model, solution.states[step], solution.units
    mesh = model.mesh
    rows = [np.flatnonzero(mesh.layer == k) for k in range(len(model.design.layers))]
    spans = [slice(2 * int(row[0]), 2 * int(row[-1]) + 3) for row in rows]
    shapes = tuple((mesh.r.size, span.stop - span.start) for span in spans)

    even, odd = _recovery(mesh.r[::2], "even"), _recovery(mesh.r[::2], "odd")
    across = np.stack([even, even, odd, odd, even, even])  # pressure, rr, rz, zr, zz, tt
    up = [_recovery(mesh.z[span][::2]) for span in spans]
    # Samples along z are two for each row of elements.
    sampled = across @ _sampled(solution, step)
    nodal = [sampled[:, :, 2 * row[0] : 2 * row[-1] + 2] @ to_nodes.T for row, to_nodes in zip(rows, up, strict=True)]
    pressure, *f = np.concatenate([x.reshape(6, -1) for x in nodal], axis=1)
    # Largest singular value of the in-plane part, from its invariants, against the hoop stretch.
    square, det = f[0] ** 2 + f[1] ** 2 + f[2] ** 2 + f[3] ** 2, f[0] * f[3] - f[1] * f[2]
    in_plane = (np.sqrt(square + 2 * det) + np.sqrt(np.maximum(square - 2 * det, 0.0))) / 2

    rest = np.stack(np.meshgrid(mesh.r, mesh.z, indexing="ij"))
    now = rest + np.moveaxis(state.u.reshape(mesh.r.size, mesh.n_row, 2), 2, 0)
    points = np.concatenate([np.concatenate([rest, now])[:, :, span].reshape(4, -1) for span in spans], axis=1) * units.length
    starts = np.concatenate([[0], np.cumsum([columns * rows for columns, rows in shapes])])[:-1]
    cells = [_cells(shape) + start for shape, start in zip(shapes, starts, strict=True)]
    return Fields(
        r=points[2],
        z=points[3],
        rest_r=points[0],
        rest_z=points[1],
        pressure=pressure * units.modulus,
        thickness_stretch=np.hypot(f[1], f[3]),
        largest_stretch=np.maximum(in_plane, f[4]),
        cells=np.concatenate(cells),
        layer=np.repeat(np.arange(len(cells)), [c.shape[0] for c in cells]),
        shapes=shapes,
    )


def _sampled(solution: Solution, step: int) -> FloatArray:
    """Pressure (in the model's unit) and deformation gradient rr, rz, zr, zz, tt at the 2 x 2 points, (6, 2 nr, 2 nz)."""
    model, state = solution.model, solution.states[step]
    mesh = model.mesh
    (in_r, d_r), (in_z, d_z) = _at_gauss(mesh.r[::2]), _at_gauss(mesh.z[::2])
    u = np.moveaxis(state.u.reshape(mesh.r.size, mesh.n_row, 2), 2, 0)
    along_r, along_z = d_r @ u @ in_z.T, in_r @ u @ d_z.T
    hoop = 1 + in_r @ u[0] @ in_z.T / (in_r @ mesh.r)[:, None]
    f = np.stack([1 + along_r[0], along_z[0], along_r[1], 1 + along_z[1], hoop])

    nr, nz = mesh.shape
    by_element = np.ascontiguousarray(f.reshape(5, nr, 2, nz, 2).swapaxes(2, 3)).reshape(5, nr * nz, 4)
    x, y = (g.ravel() for g in np.meshgrid(_GAUSS2, _GAUSS2, indexing="ij"))
    point = material.at_point(model.elements.material, by_element, state.pressure @ np.stack([np.ones(4), x, y]))
    # sigma = P F^T / J, so tr(sigma) = P : F / J.
    mean = np.sum(point.stress * by_element, axis=0) / (3 * point.jacobian)
    pressure = -mean.reshape(nr, nz, 2, 2).swapaxes(1, 2).reshape(2 * nr, 2 * nz)
    return np.concatenate([pressure[None], f])


def _at_gauss(ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Matrices (2 n, 2 n + 1) from the nodes of n quadratic elements to values and slopes at their two Gauss points."""
    n = ends.size - 1
    value, slope = np.zeros((2, 2 * n, 2 * n + 1))
    shape, derivative = shape_1d(_GAUSS2)
    for e, width in enumerate(np.diff(ends)):
        value[2 * e : 2 * e + 2, 2 * e : 2 * e + 3] = shape.T
        slope[2 * e : 2 * e + 2, 2 * e : 2 * e + 3] = derivative.T * 2 / width
    return value, slope


def _recovery(ends: FloatArray, parity: Literal["none", "even", "odd"] = "none") -> FloatArray:
    """Matrix (2 n + 1, 2 n) from the two Gauss points of each of n >= 2 elements to their nodes, exact for quadratics.

    A corner takes the quadratic fitted to the four points of the elements on both its sides, the first and the last corner
    that of their neighbour, a middle node the mean of those of its two corners. With a `parity` the first corner is at 0 and
    takes what has that parity there.
    """
    n = ends.size - 1
    nodes = with_midpoints(ends)
    points = ((ends[1:] + ends[:-1])[:, None] / 2 + np.diff(ends)[:, None] / 2 * _GAUSS2).ravel()
    matrix, patches = np.zeros((2 * n + 1, 2 * n)), np.zeros(2 * n + 1)

    def fit(at: IntArray, to: IntArray, powers: tuple[int, ...], centre: float, size: float) -> None:
        from_points = np.linalg.pinv(np.stack([((points[at] - centre) / size) ** k for k in powers], axis=1))
        to_nodes = np.stack([((nodes[to] - centre) / size) ** k for k in powers], axis=1)
        matrix[np.ix_(to, at)] += to_nodes @ from_points
        patches[to] += 1

    if parity != "none":
        fit(np.array([0, 1]), np.array([0, 1]), (0, 2) if parity == "even" else (1, 3), 0.0, ends[1])
    for k in range(1, n):
        first, last = 2 * k - 1, 2 * k + 1
        if k == 1 and parity == "none":
            first -= 1
        if k == n - 1:
            last += 1
        fit(np.arange(2 * k - 2, 2 * k + 2), np.arange(first, last + 1), (0, 1, 2), ends[k], ends[k + 1] - ends[k - 1])
    return matrix / patches[:, None]


def _cells(shape: tuple[int, int]) -> IntArray:
    """Points of the elements of a grid of (columns, rows) points in VTK's order, (n_cell, 9)."""
    columns, rows = shape
    corners = [2 * i * rows + 2 * j for i, j in itertools.product(range(columns // 2), range(rows // 2))]
    offsets = (np.arange(3)[:, None] * rows + np.arange(3)).ravel()[_VTK]
    return np.asarray(np.array(corners)[:, None] + offsets, dtype=np.int64)
