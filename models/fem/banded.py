"""From stiffness of elements and of contact edges to a factorised banded matrix: Cholesky, or LU where that does not do.

With unknowns numbered column by column from the axis, the tangent is banded with a width of two columns of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import LinAlgError, lapack

from models.sensor import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Entries:
    """Single entries of a stiffness, all of shape (n_entry,): `rows` and `columns` are displacement components."""

    rows: IntArray
    columns: IntArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class Band:
    """Where every entry of the element and edge matrices goes.

    Attributes
    ----------
    n : number of unknowns.
    width : half bandwidth.
    number : (n_dof,) unknown of a displacement component, -1 where it is held or not an unknown.
    elements : sparse, from element stiffnesses (flattened) to the lower band, Fortran order of (width + 1, n).
    element_forces, edge_forces : sparse, from element and edge forces (flattened) to the unknowns.
    edge_dofs : (n_edge, 6).
    """

    n: int
    width: int
    number: IntArray
    elements: sp.csr_array
    element_forces: sp.csr_array
    edge_forces: sp.csr_array
    edge_dofs: IntArray

    def spread(self, solution: FloatArray) -> FloatArray:
        """Values (n_dof,) of all displacement components from those of the unknowns (n,), 0 where held."""
        return np.where(self.number >= 0, solution[self.number], 0.0)

    def unknowns(self, values: FloatArray) -> FloatArray:
        """Those of the values (n_dof,) that belong to unknowns, (n,)."""
        return values[self.number >= 0]

    def gather(self, elements: FloatArray, edges: FloatArray) -> FloatArray:
        """Sum the forces of elements and of contact edges at the unknowns.

        Parameters
        ----------
        elements : (n_element, 16), forces on the border of the elements.
        edges : (n_edge, 6), forces on the contact edges.

        Returns
        -------
        Shape (n,).
        """
        return np.asarray(self.element_forces @ elements.ravel() + self.edge_forces @ edges.ravel())

    def _lower(self, elements: FloatArray) -> FloatArray:
        """Lower band (width + 1, n) of the element stiffnesses, Fortran order."""
        return np.asarray(self.elements @ elements.ravel()).reshape(self.n, self.width + 1).T

    def factorise(self, elements: FloatArray, edges: FloatArray, *, symmetric: bool, beside: Entries | None = None) -> Factor:
        """Assemble the tangent and factorise it: Cholesky if it is symmetric and positive definite, else LU.

        Parameters
        ----------
        elements : (n_element, 16, 16), stiffness of the elements.
        edges : (n_edge, 6, 6), stiffness of the contact edges.
        symmetric : whether Cholesky is worth trying; with friction the tangent is not symmetric.
        beside : more of the stiffness; only of one that is not symmetric.

        Returns
        -------
        The factorised tangent, to be solved with.

        Raises
        ------
        LinAlgError
            If the matrix is singular.
        """
        number = self.number[self.edge_dofs]
        i, j = np.broadcast_arrays(number[:, :, None], number[:, None, :])
        kept = (i >= 0) & (j >= 0)
        i, j, value = i[kept], j[kept], edges[kept]
        if symmetric:
            below, banded = i >= j, self._lower(elements)
            np.add.at(banded, ((i - j)[below], j[below]), value[below])
            factor, info = lapack.dpbtrf(banded, lower=1, overwrite_ab=1)
            if info == 0:
                return Factor(True, self.width, factor, None)
        # LU: rows 0 to width - 1 are room for pivoting, the diagonal is row 2 width.
        w, n, lower = self.width, self.n, self._lower(elements)
        full = np.zeros((3 * w + 1, n), order="F")
        full[2 * w :] = lower
        for k in range(1, w + 1):
            full[2 * w - k, k:] = lower[k, : n - k]
        np.add.at(full, (2 * w + i - j, j), value)
        if beside is not None:
            i, j = self.number[beside.rows], self.number[beside.columns]
            kept = (i >= 0) & (j >= 0)
            np.add.at(full, (2 * w + (i - j)[kept], j[kept]), beside.values[kept])
        factor, pivots, info = lapack.dgbtrf(full, w, w, overwrite_ab=1)
        if info != 0 or not np.all(np.isfinite(factor[2 * w])):
            raise LinAlgError("singular tangent")
        return Factor(False, w, factor, pivots)


@dataclass(frozen=True, eq=False)
class Factor:
    """A factorised tangent; `pivots` is None for Cholesky, which is what `positive_definite` says."""

    positive_definite: bool
    width: int
    factor: FloatArray
    pivots: IntArray | None

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution for right-hand sides (n,) or (n, m)."""
        if self.pivots is None:
            x, _ = lapack.dpbtrs(self.factor, right, lower=1)
        else:
            x, _ = lapack.dgbtrs(self.factor, self.width, self.width, right, self.pivots)
        return np.asarray(x)


def make_band(held: BoolArray, border_dofs: IntArray, edge_dofs: IntArray) -> Band:
    """Number the unknowns and place every entry of the element and edge matrices among them.

    Parameters
    ----------
    held : (n_dof,), displacement components that are no unknowns.
    border_dofs : (n_element, 16), components on the border of each element.
    edge_dofs : (n_edge, 6), components of each contact edge.

    Returns
    -------
    Where everything goes.
    """
    n = int(np.sum(~held))
    number = np.where(held, -1, np.cumsum(~held) - 1)
    rows = number[border_dofs]
    width = int(np.max(np.max(rows, axis=1) - np.min(np.where(rows < 0, n, rows), axis=1)))
    i, j = np.broadcast_arrays(rows[:, :, None], rows[:, None, :])
    taken = np.flatnonzero((i >= j) & (j >= 0))
    slot = j.ravel()[taken] * (width + 1) + (i - j).ravel()[taken]
    elements = sp.csr_array((np.ones(taken.size), (slot, taken)), shape=(n * (width + 1), i.size))

    def forces(dofs: IntArray) -> sp.csr_array:
        at = number[dofs].ravel()
        good = np.flatnonzero(at >= 0)
        return sp.csr_array((np.ones(good.size), (at[good], good)), shape=(n, at.size))

    return Band(n, width, number, elements, forces(border_dofs), forces(edge_dofs), edge_dofs)
