"""From stiffness of elements and of contact edges to a factorised banded matrix: Cholesky, or LU where that does not do.

With unknowns numbered column by column from the rim to the axis, the tangent is banded with a width of two columns of nodes,
and friction at the indenter, which makes it unsymmetric, is in its last columns alone. With the unknowns 1 outside of the
contact and 2 beneath it,

    A = [A_11  A_21^T]     A_11 = L L^T,     X = A_21 L^-T,     S = A_22 - X X^T,                                      (1)
        [A_21  A_22  ]

takes a Cholesky factorisation of A_11 and LU, four times as dear, of S alone. X has nothing beyond a bandwidth from the rim of
the contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import LinAlgError, lapack, solve_triangular

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
        out = np.empty(self.n)
        kept = self.number >= 0
        out[self.number[kept]] = values[kept]
        return out

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
        """Assemble the tangent and factorise it: Cholesky where it is symmetric and positive definite, else LU.

        Parameters
        ----------
        elements : (n_element, 16, 16), stiffness of the elements.
        edges : (n_edge, 6, 6), stiffness of the contact edges.
        symmetric : whether that of the edges is; with friction it is not.
        beside : more of the stiffness, anywhere, that is not symmetric.

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
        kept = (i >= 0) & (j >= 0) & (edges != 0)
        i, j, value = i[kept], j[kept], edges[kept]
        if symmetric:
            below, whole = i >= j, self._lower(elements)
            np.add.at(whole, ((i - j)[below], j[below]), value[below])
            factor, info = lapack.dpbtrf(whole, lower=1, overwrite_ab=1)
            if info == 0:
                return Factor(self.width, factor, None)
        lower = self._lower(elements)
        more = [Entries(i, j, value)]
        if beside is not None:
            i, j = self.number[beside.rows], self.number[beside.columns]
            kept = (i >= 0) & (j >= 0)
            more.append(Entries(i[kept], j[kept], beside.values[kept]))
        start = 0 if beside is not None else self._before(more[0])
        outside = coupling = None
        if start:
            factor, info = lapack.dpbtrf(lower[:, :start], lower=1)
            if info == 0:
                outside = factor
                coupling = _coupling(lower, factor, start, self.width)
            else:
                start = 0
        inside, pivots = _lu(lower, self.width, start, coupling, more)
        return Factor(self.width, outside, Inside(inside, pivots, coupling))

    def _before(self, contact: Entries) -> int:
        """Number of unknowns before all of the contact's, 0 unless a bandwidth of them stand on either side."""
        start = int(np.min(contact.rows, initial=self.n))
        return start if self.width <= start <= self.n - self.width else 0


def _coupling(lower: FloatArray, outside: FloatArray, start: int, width: int) -> FloatArray:
    """X of Eq. (1), (width, width): of the first unknowns from `start` on and the last before it."""
    row, column = np.tril_indices(width)
    last, across = np.zeros((width, width)), np.zeros((width, width))
    last[row, column] = outside[row - column, start - width + column]
    # Unknown start + r is coupled with start - width + c where these are no more than the width apart.
    across[column, row] = lower[width + column - row, start - width + row]
    return np.asarray(solve_triangular(last, across.T, lower=True, check_finite=False).T)


def _lu(lower: FloatArray, w: int, start: int, coupling: FloatArray | None, more: list[Entries]) -> tuple[FloatArray, IntArray]:
    """LU factors, and their pivots, of the columns of the band from `start` on, less the coupling's square and with `more`."""
    own = lower[:, start:]
    n = own.shape[1]
    # Rows 0 to w - 1 are room for pivoting, the diagonal is row 2 w.
    full = np.zeros((3 * w + 1, n), order="F")
    full[2 * w :] = own
    for k in range(1, w + 1):
        full[2 * w - k, k:] = own[k, : n - k]
    if coupling is not None:
        row, column = np.indices((w, w))
        full[2 * w + row - column, column] -= coupling @ coupling.T
    for entries in more:
        np.add.at(full, (2 * w + entries.rows - entries.columns, entries.columns - start), entries.values)
    factor, pivots, info = lapack.dgbtrf(full, w, w, overwrite_ab=1)
    if info != 0 or not np.all(np.isfinite(factor[2 * w])):
        raise LinAlgError("singular tangent")
    return factor, pivots


@dataclass(frozen=True, eq=False)
class Inside:
    """LU factors of S of Eq. (1), their pivots, and X; no X where nothing stands outside."""

    factor: FloatArray
    pivots: IntArray
    coupling: FloatArray | None


@dataclass(frozen=True, eq=False)
class Factor:
    """A factorised tangent.

    Attributes
    ----------
    width : half bandwidth.
    outside : Cholesky factor of the first unknowns, or None of none.
    inside : of the others; None if there are none, and the tangent is symmetric and positive definite.
    """

    width: int
    outside: FloatArray | None
    inside: Inside | None

    @property
    def positive_definite(self) -> bool:
        """Whether the tangent was found symmetric and positive definite."""
        return self.inside is None

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution for right-hand sides (n,) or (n, m)."""
        if self.inside is None:
            x, _ = lapack.dpbtrs(self.outside, right, lower=1)
            return np.asarray(x)
        w, own = self.width, self.inside
        if self.outside is None:
            x, _ = lapack.dgbtrs(own.factor, w, w, right, own.pivots)
            return np.asarray(x)
        start = self.outside.shape[1]
        assert own.coupling is not None
        first, _ = lapack.dtbtrs(self.outside, right[:start], uplo="L")
        second = np.array(right[start:])
        second[:w] -= own.coupling @ first[-w:]
        second, _ = lapack.dgbtrs(own.factor, w, w, second, own.pivots)
        first[-w:] -= own.coupling.T @ second[:w]
        first, _ = lapack.dtbtrs(self.outside, first, uplo="L", trans="T")
        return np.concatenate([first, second])


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
    number = np.where(held, -1, n - np.cumsum(~held))
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
