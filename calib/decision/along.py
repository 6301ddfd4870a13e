"""A model that is asked at thicknesses of padding in, its answers along many of them out, at the price of few."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from models.sensor import BoolArray, FloatArray

#: Thicknesses up to which each is asked of the model, and knots between which more are interpolated.
N_KNOTS = 97
# Knots through which each polynomial goes.
_ORDER = 6

#: What answers: thicknesses [m] (n_row,), one for each draw that is marked (n_draw,), to columns (n_row, n_column), nan where
#: not covered.
Ask = Callable[[FloatArray, BoolArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Tabled:
    """Answers at knots h_k, at equal steps of log(h + shift), for every draw.

    Attributes
    ----------
    ask : the model.
    place, step, shift : of the knots: log(h + shift) of the first, between two, and the shift [m].
    columns : (n_draw, n_knot, n_column).
    """

    ask: Ask
    place: float
    step: float
    shift: float
    columns: FloatArray

    def at(self, thickness: FloatArray) -> FloatArray:
        """Interpolate by polynomials through six knots; draws of which some of the six are covered and others not are asked.

        Parameters
        ----------
        thickness : [m], (n_draw,), between the first knot and the last.

        Returns
        -------
        Columns, (n_draw, n_column).
        """
        n_draw, n_knot, _ = self.columns.shape
        x = (np.log(thickness + self.shift) - self.place) / self.step
        first = np.clip(np.floor(x).astype(int) - _ORDER // 2 + 1, 0, n_knot - _ORDER)
        if np.ptp(thickness) == 0:
            around = self.columns[:, first[0] : first[0] + _ORDER]
        else:
            around = self.columns[np.arange(n_draw)[:, None], first[:, None] + np.arange(_ORDER)]
        found = np.asarray((_lagrange(x - first)[:, None] @ around)[:, 0])
        finite = np.isfinite(around)
        border = np.any(np.any(finite, axis=1) & ~np.all(finite, axis=1), axis=1)
        if np.any(border):
            found[border] = self.ask(thickness[border], border)
        return found


def tabled(ask: Ask, low: float, high: float, n_draw: int, shift: float, n_knot: int = N_KNOTS) -> Tabled:
    """Ask a model at knots, so that it need not be asked between them.

    Parameters
    ----------
    ask : the model.
    low, high : [m], the first and the last knot.
    n_draw : number of draws.
    shift : [m], a quarter of the sensor's thickness: designs change with the logarithm of what is far thicker.
    n_knot : how many knots.
    """
    place = np.linspace(np.log(low + shift), np.log(high + shift), n_knot)
    knots = np.clip(np.exp(place) - shift, low, high)
    everyone = np.ones(n_draw, dtype=bool)
    columns = np.stack([ask(np.full(n_draw, knot), everyone) for knot in knots], axis=1)
    return Tabled(ask, float(place[0]), float(place[1] - place[0]), shift, columns)


def along(ask: Ask, grid: FloatArray, n_draw: int, shift: float) -> Iterator[FloatArray]:
    """Ask a model at each thickness of an ascending grid; of a fine one, interpolate between `N_KNOTS`.

    Parameters
    ----------
    ask : the model.
    grid : [m], (n_thickness,).
    n_draw : number of draws.
    shift : as in `tabled`.

    Yields
    ------
    Columns (n_draw, n_column), for each thickness of the grid.
    """
    if grid.size <= N_KNOTS:
        everyone = np.ones(n_draw, dtype=bool)
        yield from (ask(np.full(n_draw, thickness), everyone) for thickness in grid)
        return
    table = tabled(ask, float(grid[0]), float(grid[-1]), n_draw, shift)
    yield from (table.at(np.full(n_draw, thickness)) for thickness in grid)


def _lagrange(x: FloatArray) -> FloatArray:
    """Weights of the values at 0, 1, ... `_ORDER` - 1 in the polynomial through them at x (n,), (n, _ORDER)."""
    nodes = np.arange(_ORDER)
    return np.stack([np.prod([(x - m) / (k - m) for m in nodes if m != k], axis=0) for k in nodes], axis=1)
