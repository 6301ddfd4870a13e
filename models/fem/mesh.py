"""From the dimensionless shape of a stack to a structured grid of nine-node (Q2) elements, fine under the contact.

Lengths are in units of the sphere radius R. Coordinates (r, z), z up, base at z = 0, axis at r = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.sensor import FloatArray, IntArray


@dataclass(frozen=True)
class Stack:
    """Shape of sensor on padding in units of the sphere radius, moduli in units of the sensor's."""

    sensor_thickness: float
    padding_thickness: float
    radius: float
    padding_modulus: float

    @property
    def thickness(self) -> float:
        """Total thickness."""
        return self.sensor_thickness + self.padding_thickness


@dataclass(frozen=True, eq=False)
class Mesh:
    """A structured Q2 grid, nodes numbered column by column from the axis outwards, from the base up.

    Attributes
    ----------
    r, z : node coordinates of the columns (2 nr + 1,) and of the rows (2 nz + 1,).
    elements : (n_element, 9) node numbers, local node 3 i + j at column i, row j of the element.
    mid_row : row of nodes on the mid-plane of the sensor.
    sensor_row : first row of elements that belongs to the sensor.
    """

    r: FloatArray
    z: FloatArray
    elements: IntArray
    mid_row: int
    sensor_row: int

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


def _graded(length: float, first: float, growth: float, largest: float) -> FloatArray:
    """Ends of intervals that fill `length`, the first about `first`, each next `growth` times larger up to `largest`."""
    sizes = [first]
    while sum(sizes) < length:
        sizes.append(min(sizes[-1] * growth, largest))
    return np.cumsum(np.asarray(sizes)) * (length / sum(sizes))


def _with_midpoints(ends: FloatArray) -> FloatArray:
    nodes = np.empty(2 * ends.size - 1)
    nodes[::2] = ends
    nodes[1::2] = (ends[1:] + ends[:-1]) / 2
    return nodes


def make_mesh(stack: Stack, depth: float, refinement: float = 1.0) -> Mesh:
    """Grid for indentations up to `depth` (units of R).

    Columns are fine where the contact will be (a power-law spacing keeps the resolution of a small contact early in the
    path), then grow geometrically. Rows are uniform in the sensor and grow downwards in the padding. Element sizes scale
    with 1 / `refinement`.
    """
    h = stack.thickness
    contact = min(np.sqrt(2 * depth), 0.95, 0.95 * stack.radius)
    fine = min(1.15 * contact, 0.97 * stack.radius)
    # Element size asked for by the contact and by the layer, whichever is smaller, in the middle of the fine zone.
    coarse = min(contact / 20, 0.22 * h)
    size = coarse / refinement
    n_fine = max(8, round(fine / size))
    ends = fine * (np.arange(n_fine + 1) / n_fine) ** 1.5
    last = ends[-1] - ends[-2]
    outer = stack.radius - fine
    if outer > 0.5 * last:
        far = _graded(outer, last * 1.1, 1.22 ** (1 / refinement), max(0.5 * h / refinement, last))
        # The free rim bends over about one thickness: end the last elements small there.
        ends = np.concatenate([ends, fine + far])
    else:
        ends = np.append(ends[:-1], stack.radius)
    # Rows in each half of the sensor: elements at most about six columns high.
    n_half = max(2, round(refinement * min(1.6 + 0.175 * stack.sensor_thickness / coarse, 6.0)))
    sensor = stack.padding_thickness + np.linspace(0, stack.sensor_thickness, 2 * n_half + 1)
    rows = sensor
    n_padding = 0
    if stack.padding_thickness > 0:
        first = min(stack.sensor_thickness / (2 * n_half), stack.padding_thickness / (2 * refinement))
        down = _graded(stack.padding_thickness, first, 1.3 ** (1 / refinement), max(0.2 * h / refinement, first))
        rows = np.concatenate([stack.padding_thickness - down[::-1], sensor])
        rows[0] = 0.0
        n_padding = down.size
    r, z = _with_midpoints(ends), _with_midpoints(rows)
    nr, nz = ends.size - 1, rows.size - 1
    i, j = np.meshgrid(np.arange(nr), np.arange(nz), indexing="ij")
    corner = (2 * i * z.size + 2 * j).ravel()
    offsets = (np.arange(3)[:, None] * z.size + np.arange(3)).ravel()
    return Mesh(r, z, corner[:, None] + offsets, mid_row=2 * (n_padding + n_half), sensor_row=n_padding)
