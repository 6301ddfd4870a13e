"""What every forward model takes and gives: `Forward` maps a `Design` and depths to a `Response`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from models.sensor import BoolArray, Design, FloatArray


class OutOfRangeError(ValueError):
    """A design or a depth lies outside what a forward model covers; the message names the bound."""


@dataclass(frozen=True, eq=False)
class Response:
    """Loading curves over depth, arrays of shape (n_depth,), or (n_draw, n_depth) for a design that is a batch of draws.

    Attributes
    ----------
    depth : [m], indentation; zero or less means no contact.
    force : [N].
    contact_radius : [m], in the deformed configuration.
    capacitance : [F], without parasitic capacitance.
    rest_capacitance : [F], C0; shape () or (n_draw,).
    force_error, capacitance_error : [N], [F], shape (..., n_depth, n_mode).
        Factors V of the model's own error: its covariance along the sweep is V V^T. No mode (n_mode = 0) for a model
        that claims no error of its own.
    """

    depth: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    capacitance: FloatArray
    rest_capacitance: FloatArray
    force_error: FloatArray
    capacitance_error: FloatArray

    @property
    def capacitance_change(self) -> FloatArray:
        """C / C0 - 1, shape as `capacitance`."""
        return self.capacitance / self.rest_capacitance[..., None] - 1

    def draw(self, index: int) -> Response:
        """One draw of a batch."""
        return Response(
            self.depth[index],
            self.force[index],
            self.contact_radius[index],
            self.capacitance[index],
            self.rest_capacitance[index],
            self.force_error[index],
            self.capacitance_error[index],
        )


class Forward(Protocol):
    """A model of the sensor: closed form, finite elements, or surrogate. All take the same and give the same."""

    @property
    def name(self) -> str:
        """Short name for tables and reports."""
        ...

    @property
    def identity(self) -> str:
        """Text that two models share only if they answer alike: their settings, or a hash of what they consist of."""
        ...

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] the model covers, per draw, shape (n_draw,); 0 where the design itself is not covered."""
        ...

    def outside(self, design: Design, depth: FloatArray) -> str:
        """Empty if every draw of the design and every depth is covered, else one sentence that names the violated bound."""
        ...

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """Response of `design` at `depth` [m], shape (n_depth,) or (n_draw, n_depth); needs not be sorted.

        Depths of zero or less are before contact: F = 0 and C = C0.

        Raises
        ------
        OutOfRangeError
            If the model does not cover the design or a depth.
        """
        ...


def depth_table(forward: Forward, design: Design, n_depth: int = 64) -> Response:
    """Loading curves from zero to each draw's largest covered depth, shape (n_draw, n_depth), finer near contact.

    Raises
    ------
    OutOfRangeError
        If a draw of the design is not covered at all.
    """
    batch = design.draws()
    end = forward.max_depth(batch)
    if np.any(end <= 0):
        raise OutOfRangeError(forward.outside(batch, np.zeros(1)))
    return forward.respond(batch, table_depths(end, n_depth))


def table_depths(end: FloatArray, n_depth: int = 64) -> FloatArray:
    """Depths from zero to each draw's `end` [m], exactly, finer near contact; shape (n_draw, n_depth)."""
    ramp = np.linspace(0.0, 1.0, n_depth) ** 1.5
    return np.asarray(end[:, None] * ramp, dtype=float)


@dataclass(frozen=True, eq=False)
class Lookup:
    """Where wanted values lie between the nodes of each draw's own table: `at` interpolates any other column there.

    Attributes
    ----------
    index, weight : shape (n_draw, n_wanted); the value lies `weight` of the way from node `index` to the next. The weight is
        0 below the first node (clamped) and nan above the last.
    """

    index: npt.NDArray[np.intp]
    weight: FloatArray

    def at(self, column: FloatArray) -> FloatArray:
        """Column of the table, shape (n_draw, n_node) or (n_draw, n_node, n_mode), interpolated linearly."""
        extra = (...,) + (None,) * (column.ndim - 2)
        index, weight = self.index[extra], self.weight[extra]
        low = np.take_along_axis(column, index, axis=1)
        return np.asarray(low + weight * (np.take_along_axis(column, index + 1, axis=1) - low), dtype=float)


def look_up(nodes: FloatArray, wanted: FloatArray) -> Lookup:
    """Place `wanted`, shape (n_draw, n_wanted), among ascending `nodes`, shape (n_draw, n_node), all draws at once."""
    index = np.sum(nodes[:, None, :] <= wanted[:, :, None], axis=-1) - 1
    index = np.clip(index, 0, nodes.shape[1] - 2)
    low = np.take_along_axis(nodes, index, axis=1)
    width = np.take_along_axis(nodes, index + 1, axis=1) - low
    weight = np.maximum(wanted - low, 0.0) / np.where(width > 0, width, 1.0)
    return Lookup(index, np.where(weight > 1 + 1e-12, np.nan, weight))


def force_scale(force: FloatArray) -> FloatArray:
    """F^(2/3), nearly linear in depth (Hertz): what tables over force are interpolated in. Zero for tension."""
    return np.asarray(np.cbrt(np.maximum(force, 0.0)) ** 2, dtype=float)


def look_up_force(table: Response, force: FloatArray) -> Lookup:
    """Place `force` [N], shape (n_draw, n_force), on the curves of `table` (from `depth_table`), see `depth_at_force`."""
    return look_up(np.maximum.accumulate(force_scale(table.force), axis=-1), force_scale(force))


def depth_at_force(table: Response, force: FloatArray) -> FloatArray:
    """Depth [m] at which each curve of `table` (from `depth_table`) carries `force` [N]: F^-1.

    Parameters
    ----------
    force : shape (n_force,) or (n_draw, n_force). Zero or less gives depth 0: force does not tell how far the ball is away.

    Returns
    -------
    Shape (n_draw, n_force); nan where a curve ends below the force. F^(2/3), nearly linear in depth (Hertz), is interpolated.
    """
    wanted = np.broadcast_to(np.asarray(force, dtype=float), (table.force.shape[0], np.shape(force)[-1]))
    return look_up_force(table, wanted).at(table.depth)


def covered(forward: Forward, design: Design, depth: FloatArray) -> BoolArray:
    """Which draws are covered at their largest depth, shape (n_draw,)."""
    batch = design.draws()
    limit = forward.max_depth(batch)
    deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
    return np.asarray((limit > 0) & (deepest <= limit), dtype=bool)
