"""From a deformed mesh to the capacitance of each dielectric by annular rings between its deformed electrodes.

C / (eps_0 eps_r) = integral 2 pi r ds / t over the surface m = (x_up + x_low)/2 half way between the electrodes, with ds its
arc length and t = (x_up - x_low) . n the distance of the electrodes along its normal n (Zhu et al., SPIE EAPAD 2019, Eq. 1,
with the normal thickness in place of the vertical one); rings one element wide with three Gauss points each. In terms of the
material radius, with m' = dm/dr,

    C / (eps_0 eps_r) = integral 2 pi m_r |m'|^2 / (m' x (x_up - x_low)) dr.                                            (1)

Fringe fields are left out. `models.fem.laplace` checks what the rings leave out of the field between the electrodes.
"""

from __future__ import annotations

import numpy as np

from models.fem.elements import shape_1d
from models.fem.mesh import Mesh, through_layers
from models.sensor import FloatArray

_GAUSS3, _WEIGHT3 = np.polynomial.legendre.leggauss(3)


def row_positions(mesh: Mesh, u: FloatArray, heights: FloatArray) -> FloatArray:
    """Deformed positions of material lines that were level, at the node columns (see `through_layers`).

    Parameters
    ----------
    mesh, u : grid and displacements.
    heights : (n_height,) of the lines above the base, undeformed.

    Returns
    -------
    r and z, (n_height, 2, n_column), in the unit of length of the grid.
    """
    moved = np.einsum("cnk,hn->hkc", u.reshape(mesh.r.size, mesh.n_row, 2), through_layers(mesh, heights))
    return np.stack([mesh.r + moved[:, 0], heights[:, None] + moved[:, 1]], axis=1)


def largest_thinning(mesh: Mesh, u: FloatArray, middle: float, gaps: FloatArray) -> FloatArray:
    """How much thinner a dielectric beside a mid-plane becomes where it becomes thinnest.

    On the axis the larger thinning of the dielectrics below and above the mid-plane; off it, where a thin stack bulges, that
    times the ratio in which the thinning of the distance across both is larger than on the axis.

    Parameters
    ----------
    mesh, u : grid and displacements.
    middle : height of the mid-plane above the base, undeformed.
    gaps : (n_dielectric,) thickness of a dielectric, undeformed.

    Returns
    -------
    1 - t / t_d there, (n_dielectric,).
    """
    heights = middle + np.concatenate([-gaps, np.zeros(1), gaps])
    z = row_positions(mesh, u, heights)[:, 1]
    low, at, high = z[: gaps.size], z[gaps.size], z[gaps.size + 1 :]
    across = 1 - (high - low) / (2 * gaps[:, None])
    on_axis = 1 - np.minimum(at[0] - low[:, 0], high[:, 0] - at[0]) / gaps
    return np.asarray(on_axis * np.max(across, axis=1) / across[:, 0])


def _on_line(line: FloatArray, mesh: Mesh, r: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions and derivatives d/dr, shape (2, ...), of a deformed material line at reference radii `r`."""
    ends = mesh.r[::2]
    e = np.clip(np.searchsorted(ends, r, side="right") - 1, 0, ends.size - 2)
    width = ends[e + 1] - ends[e]
    value, slope = shape_1d(2 * (r - ends[e]) / width - 1)
    nodes = line[:, 2 * e + np.arange(3).reshape((3,) + (1,) * r.ndim)]
    return np.sum(nodes * value, axis=1), np.sum(nodes * slope, axis=1) * 2 / width


def ring_capacitance(mesh: Mesh, u: FloatArray, lower: FloatArray, upper: FloatArray, electrode: FloatArray) -> FloatArray:
    """Capacitance of every dielectric for every electrode radius at once, by rings.

    Parameters
    ----------
    mesh, u : grid and displacements.
    lower, upper : (n_dielectric,) heights of the electrodes of each dielectric above the base, undeformed.
    electrode : (n_electrode,) electrode radius, a material radius of the undeformed disc.

    Returns
    -------
    C / (eps_0 eps_r), (n_dielectric, n_electrode), in the unit of length of the grid. Undeformed: pi a_e^2 / (upper - lower).
    """
    ends = mesh.r[::2]
    # Rings are cut at every electrode radius, so that each electrode is a whole number of rings.
    cuts = np.unique(np.concatenate([ends, electrode]))
    cuts = cuts[cuts <= np.max(electrode) * (1 + 1e-12)]
    half = np.diff(cuts) / 2
    r = (cuts[1:] + cuts[:-1])[:, None] / 2 + half[:, None] * _GAUSS3
    result = np.empty((lower.size, electrode.size))
    lines = row_positions(mesh, u, np.concatenate([lower, upper]))
    for k, (low, high) in enumerate(zip(lines[: lower.size], lines[lower.size :], strict=True)):
        below, d_below = _on_line(low, mesh, r)
        above, d_above = _on_line(high, mesh, r)
        middle, along, across = (below + above) / 2, (d_below + d_above) / 2, above - below
        area = along[0] * across[1] - along[1] * across[0]
        density = 2 * np.pi * middle[0] * np.sum(along**2, axis=0) / area  # Eq. (1)
        total = np.concatenate([[0.0], np.cumsum(np.sum(density * _WEIGHT3, axis=1) * half)])
        result[k] = total[np.searchsorted(cuts, electrode * (1 - 1e-12))]
    return result
