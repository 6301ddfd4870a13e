"""From a layered design and a depth to a structured grid of nine-node (Q2) elements, fine under the contact.

Coordinates (r, z), z up, base at z = 0, axis at r = 0, in any unit of length.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from models.layers import LayeredDesign
from models.sensor import FloatArray, IntArray

#: Least width of an element at the surface as a share of its height. At 0.25 the first step of a deep path, with one or two
#: edges in contact, overlaps by 2e-4 of the indentation between the nodes.
_LEAST_WIDTH = 0.12
# Least rows of elements in a layer at 0.1 % accuracy, which follow the refinement, and at any.
_LEAST_ROWS, _FEWEST_ROWS = 4, 3


@dataclass(frozen=True, eq=False)
class Mesh:
    """A structured Q2 grid, nodes numbered column by column from the axis outwards, from the base up.

    Attributes
    ----------
    r, z : node coordinates of the columns (2 nr + 1,) and of the rows (2 nz + 1,).
    elements : (n_element, 9) node numbers, local node 3 i + j at column i, row j of the element.
    layer : (nz,) which layer each row of elements belongs to.
    fine_radius : columns within are sized for the contact.
    """

    r: FloatArray
    z: FloatArray
    elements: IntArray
    layer: IntArray
    fine_radius: float

    @property
    def n_row(self) -> int:
        """Nodes in a column."""
        return self.z.size

    @property
    def n_node(self) -> int:
        """Number of nodes."""
        return self.r.size * self.z.size

    @property
    def shape(self) -> tuple[int, int]:
        """Elements along r and along z."""
        return (self.r.size - 1) // 2, (self.z.size - 1) // 2


def with_midpoints(ends: FloatArray) -> FloatArray:
    """Nodes of the quadratic elements between `ends`."""
    nodes = np.empty(2 * ends.size - 1)
    nodes[::2] = ends
    nodes[1::2] = (ends[1:] + ends[:-1]) / 2
    return nodes


def _fill(low: float, high: float, size: Callable[[FloatArray], FloatArray], refinement: float, least: int) -> FloatArray:
    """Ends of intervals from `low` to `high` whose lengths follow `size` / `refinement`, at least `least` of them."""
    # Points crowd at both ends, so that a size that vanishes there like a power is integrated well.
    x = low + (high - low) * (1 - np.cos(np.pi * np.linspace(0, 1, 2001))) / 2
    middle = (x[1:] + x[:-1]) / 2
    count = np.concatenate([[0.0], np.cumsum(np.diff(x) / size(middle))])
    n = max(least, int(np.ceil(count[-1] * refinement - 1e-6)))
    ends = np.interp(np.linspace(0, count[-1], n + 1), count, x)
    ends[0], ends[-1] = low, high
    return np.asarray(ends)


def make_mesh(design: LayeredDesign, depth: float, accuracy: float = 1e-3) -> Mesh:
    """Make the grid of a design, fine where the contact will be.

    Columns are fine where the contact will be and, as the contact of a round indenter grows from a point, finer towards
    where it begins; they grow geometrically beyond and end fine at the free rim, over which the disc bulges. Rows are fine
    at the base and under the contact, where the first is no higher than the contact is wide from a hundredth of the depth on:
    three times as high, the force of thick layers was up to 1.5 % too large there. No layer has fewer than four at 0.1 %
    accuracy: with two, a thin sensor on thick padding had the force within 0.1 %, and the change of capacitance of a thin
    dielectric within 2 %.

    Parameters
    ----------
    design : in any unit of length.
    depth : largest indentation that it is for, in the same unit.
    accuracy : relative, of force and capacitance change.

    Returns
    -------
    The grid.
    """
    # Errors fall with the square of the element size; the sizes below are for 0.1 %.
    refinement = float(np.sqrt(1e-3 / accuracy))
    h, a, flat = design.thickness, design.radius, design.profile.flat_radius
    # Incompressible layers bulge around the indenter: the contact is wider than half-space theory has it.
    contact = min(design.profile.radius_at(1.1 * depth), 0.97 * a)
    flat = flat if flat < contact else 0.0  # a plate wider than the disc has no edge on it
    width = contact - flat
    fine = min(contact + 0.1 * width, 0.98 * a)
    finest = 0.052 * width

    def row_size(z: FloatArray) -> FloatArray:
        top = min(0.10 * h, 0.05 * width) + 0.25 * (h - z)
        return np.asarray(np.minimum(np.minimum(top, 0.2 * h), 0.08 * h + 0.3 * z))

    edges = np.concatenate([[0.0], np.cumsum([layer.thickness for layer in design.layers])])
    least = max(_FEWEST_ROWS, int(np.ceil(_LEAST_ROWS * refinement)))
    parts = [_fill(low, high, row_size, refinement, least) for low, high in itertools.pairwise(edges)]
    rows = np.concatenate([[0.0], *(p[1:] for p in parts)])
    # Elements much higher than wide fold at the surface of strongly compressed layers before the material does.
    narrowest = _LEAST_WIDTH * (rows[-1] - rows[-2]) * refinement

    def column_size(r: FloatArray) -> FloatArray:
        near = np.maximum(finest * np.sqrt(np.abs(r - flat) / width), min(narrowest, finest))
        inside = np.where(r < flat, np.minimum(near + 0.2 * np.maximum(flat - width - r, 0.0), 0.22 * h), near)
        inside = np.minimum(inside, 0.25 * h)
        outside = finest + 0.2 * (r - fine)
        rim = 0.06 * h + 0.3 * (a - r)
        size = np.where(r > fine, np.minimum(outside, 0.5 * h), inside)
        return np.asarray(np.minimum(size, np.maximum(rim, finest)))

    columns = _fill(0.0, a, column_size, refinement, 12)
    r, z = with_midpoints(columns), with_midpoints(rows)
    nr, nz = columns.size - 1, rows.size - 1
    i, j = np.meshgrid(np.arange(nr), np.arange(nz), indexing="ij")
    corner = (2 * i * z.size + 2 * j).ravel()
    offsets = (np.arange(3)[:, None] * z.size + np.arange(3)).ravel()
    layer = np.repeat(np.arange(len(parts)), [p.size - 1 for p in parts])
    return Mesh(r, z, corner[:, None] + offsets, layer, fine)


def through_layers(mesh: Mesh, heights: FloatArray) -> FloatArray:
    """Weights of the nodes of a column in what is at given heights: a cubic spline through all nodes of the layer there.

    Nodes are far more exact than the strains of elements, and the thickness of a thin dielectric, a difference within one or
    two of them, is a strain: by the elements' own shape functions it would be several times as far off.

    Parameters
    ----------
    mesh : the grid.
    heights : (n_height,) above the base, undeformed.

    Returns
    -------
    (n_height, 2 nz + 1), each row with a sum of one.
    """
    weights = np.zeros((heights.size, mesh.n_row))
    ends = mesh.z[::2]
    layer = mesh.layer[np.clip(np.searchsorted(ends, heights, side="right") - 1, 0, ends.size - 2)]
    for own in np.unique(layer):
        rows, lines = np.flatnonzero(mesh.layer == own), np.flatnonzero(layer == own)
        nodes = slice(2 * rows[0], 2 * rows[-1] + 3)
        weights[lines, nodes] = CubicSpline(mesh.z[nodes], np.eye(mesh.z[nodes].size))(heights[lines])
    return weights


def moved(mesh: Mesh, old: LayeredDesign, new: LayeredDesign) -> Mesh:
    """Carry a grid over to a design that differs a little, so that derivatives see no other elements.

    Parameters
    ----------
    mesh : the grid of
    old : this design.
    new : one with the same layers, of other thicknesses, and another radius.

    Returns
    -------
    The grid of the new design: rows follow their layer, columns follow the rim beyond the fine part and stay within it.
    """
    below, above = (np.concatenate([[0.0], np.cumsum([x.thickness for x in d.layers])]) for d in (old, new))
    beyond = np.clip((mesh.r - mesh.fine_radius) / (old.radius - mesh.fine_radius), 0.0, 1.0)
    return replace(mesh, r=mesh.r + (new.radius - old.radius) * beyond, z=np.interp(mesh.z, below, above))
