"""A model that is asked at thicknesses of padding in, its answers along many of them out, at the price of few."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from models.sensor import BoolArray, FloatArray

#: Thicknesses up to which each is asked of the model, and knots between which more are interpolated.
N_KNOTS = 97
# Knots through which each polynomial goes.
_ORDER = 6
# What is carried, as a share of a load, below which an interpolated reach tells that the load is not.
_SURELY = 0.95

_Indices = npt.NDArray[np.intp]

#: What answers: thicknesses [m] (n_row,), one for each draw that is marked (n_draw,), to quantities at each load, of shape
#: (n_row, n_load, n_quantity). The first is nan where the load is not carried; the last is the largest force that is.
Ask = Callable[[FloatArray, BoolArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Tabulated:
    """Answers at knots h_k, at equal steps of log(h + shift), for every draw.

    Attributes
    ----------
    ask : the model.
    wanted : [N], (n_draw, n_load).
    place, step, shift : of the knots: log(h + shift) of the first, between two, and the shift [m].
    answers : (n_draw, n_knot, n_load, n_quantity).
    known : (n_draw, n_knot, n_load), whether the load is carried there.
    first, last : (n_draw, n_knot, n_load), ends of the unbroken run of knots where it is, about each of them.
    """

    ask: Ask
    wanted: FloatArray
    place: float
    step: float
    shift: float
    answers: FloatArray
    known: BoolArray
    first: _Indices
    last: _Indices

    def at(self, thickness: FloatArray) -> FloatArray:
        """Interpolate by polynomials through six knots at which the load is carried, never beyond them.

        Between a knot where it is and one where it is not the model itself is asked.

        Parameters
        ----------
        thickness : [m], (n_draw,), between the first knot and the last.

        Returns
        -------
        Quantities, (n_draw, n_load, n_quantity).
        """
        n_draw, n_knot, n_load, n_quantity = self.answers.shape
        x = (np.log(thickness + self.shift) - self.place) / self.step
        cell = np.clip(np.floor(x).astype(np.intp), 0, n_knot - 2)
        start = np.clip(cell - _ORDER // 2 + 1, 0, n_knot - _ORDER)
        draw = np.arange(n_draw)
        if np.ptp(thickness) == 0:
            window = slice(int(start[0]), int(start[0]) + _ORDER)
            around, known = self.answers[:, window], self.known[:, window]
        else:
            knots = start[:, None] + np.arange(_ORDER)
            around, known = self.answers[draw[:, None], knots], self.known[draw[:, None], knots]
        flat = around.reshape(n_draw, _ORDER, n_load * n_quantity)
        found = (_lagrange(x - start)[:, None] @ flat).reshape(n_draw, n_load, n_quantity)
        border = np.any(known, axis=1) & ~np.all(known, axis=1)
        # Where the model does not cover the design nothing is carried: a step that no polynomial goes through.
        there = around[..., -1] > 0
        step = ~np.all(there, axis=1)
        if not np.any(border | step):
            return np.asarray(found)
        left, right = self.known[draw, cell], self.known[draw, cell + 1]
        covered = (self.answers[draw, cell, :, -1] > 0).astype(int) + (self.answers[draw, cell + 1, :, -1] > 0)
        found[..., -1] = np.where(step & (covered == 0), 0.0, found[..., -1])
        begin, end = self.first[draw, cell], self.last[draw, cell]
        whole = left & right & (end - begin + 1 >= _ORDER)
        d, b = np.nonzero(border & whole)
        own = np.clip(cell[d] - _ORDER // 2 + 1, begin[d, b], end[d, b] - _ORDER + 1)
        values = self.answers[d[:, None], own[:, None] + np.arange(_ORDER), b[:, None]]
        found[d, b] = (_lagrange(x[d] - own)[:, None] @ values)[:, 0]
        # An interpolated reach tells where a load is far from being carried, if the model covers the design all around.
        beyond = (found[:, :, -1] < _SURELY * self.wanted) & ~step
        asked = np.any((border & (left | right) & ~whole & ~beyond) | (step & (covered > 0) & ~whole), axis=1)
        if np.any(asked):
            found[asked] = self.ask(thickness[asked], asked)
        return np.asarray(found)


@dataclass(frozen=True, eq=False)
class Untabulated:
    """A model that is asked itself, where each draw has one thickness alone: stands in for `Tabulated`."""

    ask: Ask

    def at(self, thickness: FloatArray) -> FloatArray:
        """Quantities, (n_draw, n_load, n_quantity).

        Parameters
        ----------
        thickness : [m], (n_draw,).
        """
        return self.ask(thickness, np.ones(thickness.size, dtype=bool))


def tabulated(ask: Ask, wanted: FloatArray, low: float, high: float, shift: float, n_knot: int = N_KNOTS) -> Tabulated:
    """Ask a model at knots, so that it need not be asked between them.

    Parameters
    ----------
    ask : the model.
    wanted : [N], loads, (n_draw, n_load).
    low, high : [m], the first and the last knot.
    shift : [m], a quarter of the sensor's thickness: designs change with the logarithm of what is far thicker.
    n_knot : how many knots.
    """
    place = np.linspace(np.log(low + shift), np.log(high + shift), n_knot)
    knots = np.clip(np.exp(place) - shift, low, high)
    everyone = np.ones(len(wanted), dtype=bool)
    answers = np.stack([ask(np.full(len(wanted), knot), everyone) for knot in knots], axis=1)
    known = np.isfinite(answers[..., 0])
    index = np.arange(n_knot)[:, None]
    first = np.maximum.accumulate(np.where(known, 0, index + 1), axis=1)
    last = np.minimum.accumulate(np.where(known, n_knot - 1, index - 1)[:, ::-1], axis=1)[:, ::-1]
    return Tabulated(ask, wanted, float(place[0]), float(place[1] - place[0]), shift, answers, known, first, last)


def along(ask: Ask, wanted: FloatArray, grid: FloatArray, shift: float) -> Iterator[FloatArray]:
    """Ask a model at each thickness of an ascending grid; of a fine one, interpolate between `N_KNOTS`.

    Parameters
    ----------
    ask : the model.
    wanted : [N], loads, (n_draw, n_load).
    grid : [m], (n_thickness,).
    shift : as in `tabulated`.

    Yields
    ------
    Quantities (n_draw, n_load, n_quantity), for each thickness of the grid.
    """
    n_draw = len(wanted)
    if grid.size <= N_KNOTS:
        everyone = np.ones(n_draw, dtype=bool)
        yield from (ask(np.full(n_draw, thickness), everyone) for thickness in grid)
        return
    table = tabulated(ask, wanted, float(grid[0]), float(grid[-1]), shift)
    yield from (table.at(np.full(n_draw, thickness)) for thickness in grid)


def _lagrange(x: FloatArray) -> FloatArray:
    """Weights of the values at 0, 1, ... `_ORDER` - 1 in the polynomial through them at x (n,), (n, _ORDER)."""
    nodes = np.arange(_ORDER)
    return np.stack([np.prod([(x - m) / (k - m) for m in nodes if m != k], axis=0) for k in nodes], axis=1)
