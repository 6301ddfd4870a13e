"""From a forward model and designs to loading curves: tables over depth, look-ups by depth or force, predictions at forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from models.response import Asked, Curves, Forward, OutOfRangeError, Response, WithCurves
from models.sensor import BoolArray, Design, FloatArray


@dataclass(frozen=True, eq=False)
class DesignPrediction:
    """What designs do at given forces, arrays (n_draw, n_force); nan where the force lies outside the model's range.

    Attributes
    ----------
    depth : [m].
    change : C/C0 - 1 [1].
    change_slope : its derivative with respect to force [1/N].
    change_error : sd [1] of `change` from the forward model's own error, of capacitance and of force.
    rest_capacitance : C0 [F], (n_draw,).
    reach : largest force [N] inside the model's range, (n_draw,), 0 if none.
    """

    depth: FloatArray
    change: FloatArray
    change_slope: FloatArray
    change_error: FloatArray
    rest_capacitance: FloatArray
    reach: FloatArray


@runtime_checkable
class ForceControlled(Protocol):
    """A forward model that finds the depths for given forces itself."""

    def respond_to_force(self, design: Design, force: FloatArray) -> Response:
        """Press until given forces are met.

        Parameters
        ----------
        design : one, not a batch.
        force : [N], positive, shape (n_force,).

        Returns
        -------
        At the depths found, arrays of shape (n_force,).
        """
        ...


def curves_of(forward: Forward, design: Design) -> Curves:
    """The loading curves of a batch of designs, of any forward model.

    Parameters
    ----------
    forward : the model; one that is not `WithCurves` is called once for all that is asked together.
    design : a batch of draws.
    """
    return forward.curves(design) if isinstance(forward, WithCurves) else _Called(forward, design, forward.max_depth(design))


@dataclass(frozen=True, eq=False)
class _Called:
    """Curves of a model that takes designs and depths together."""

    forward: Forward
    design: Design
    limit: FloatArray

    def only(self, rows: slice | BoolArray) -> Curves:
        mask = np.zeros(self.limit.shape, dtype=bool)
        mask[rows] = True
        return _Called(self.forward, self.design.only(mask), self.limit[mask])

    def press(self, asked: Sequence[Asked]) -> list[Response]:
        ends = np.cumsum([a.depth.shape[1] for a in asked])
        whole = self.forward.respond(self.design, np.concatenate([a.depth for a in asked], axis=1))
        return [whole.at(slice(end - a.depth.shape[1], end)) for a, end in zip(asked, ends, strict=True)]


def depth_table(forward: Forward, design: Design, n_depth: int = 64) -> Response:
    """Tabulate the loading curve of every draw, from zero to the largest depth covered: what look-ups by force start from.

    Parameters
    ----------
    forward : the model.
    design : one, or a batch of draws.
    n_depth : rows of the table, finer near contact (`table_depths`).

    Returns
    -------
    Arrays of shape (n_draw, n_depth), also for one design.

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
    """Choose the depths of a table, finer near contact, where curves bend most.

    Parameters
    ----------
    end : [m], (n_draw,), the last depth of each draw.
    n_depth : number of depths.

    Returns
    -------
    From zero to `end` exactly [m], shape (n_draw, n_depth).
    """
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
    """Find wanted values in the tables of all draws at once.

    Parameters
    ----------
    nodes : ascending along the table, shape (n_draw, n_node).
    wanted : shape (n_draw, n_wanted).

    Returns
    -------
    Their places, with which `Lookup.at` interpolates other columns.
    """
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
    """Find forces on tabulated loading curves.

    Parameters
    ----------
    table : from `depth_table`.
    force : [N], shape (n_draw, n_force). Zero or less is at depth 0: force does not depend on how far the ball is away.

    Returns
    -------
    Their places; F^(2/3) is interpolated (`force_scale`).
    """
    return look_up(np.maximum.accumulate(force_scale(table.force), axis=-1), force_scale(force))


def depth_at_force(table: Response, force: FloatArray) -> FloatArray:
    """Depth at which each curve of a table carries a force: F^-1.

    Parameters
    ----------
    table : from `depth_table`.
    force : [N], shape (n_force,) or (n_draw, n_force). Zero or less gives depth 0, see `look_up_force`.

    Returns
    -------
    Depth [m], shape (n_draw, n_force); nan where a curve ends below the force.
    """
    wanted = np.broadcast_to(np.asarray(force, dtype=float), (table.force.shape[0], np.shape(force)[-1]))
    return look_up_force(table, wanted).at(table.depth)


def covered(forward: Forward, design: Design, depth: FloatArray) -> BoolArray:
    """Which draws a model covers down to their largest depth.

    Parameters
    ----------
    forward : the model.
    design : one, or a batch of draws.
    depth : [m], shape (n_depth,) or (n_draw, n_depth).

    Returns
    -------
    Shape (n_draw,).
    """
    batch = design.draws()
    limit = forward.max_depth(batch)
    deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
    return np.asarray((limit > 0) & (deepest <= limit), dtype=bool)


def predict_design(forward: Forward, design: Design, force: FloatArray) -> DesignPrediction:
    """Predict what a design does at given forces: how deep the ball goes, how much the capacitance changes, how steeply.

    The depth comes from a table of 64 depths (`depth_table`); the change is corrected to first order for what the table's
    interpolation leaves, slopes are central differences over 2 % of the depth.

    Parameters
    ----------
    forward : the model.
    design : one, or a batch of draws; a draw that the model does not cover gives nan.
    force : [N], shape (n_force,), or (n_draw, n_force).

    Returns
    -------
    Arrays of shape (n_draw, n_force), also for one design.
    """
    batch = design.draws()
    curves = curves_of(forward, batch)
    found = press_to(curves, force)
    at = signal_at(found)
    error = np.hypot(at.change_error, at.change_slope * found.force_error)
    c0 = np.asarray(batch.rest_capacitance, dtype=float)
    return DesignPrediction(found.depth, at.change, at.change_slope, error, c0, found.reach)


@dataclass(frozen=True, eq=False)
class PressedTo:
    """Where designs carry given forces, arrays (n_draw, n_force); nan where the force lies outside the model's range.

    It is mechanics alone: designs that differ in their electrodes or dielectrics share it.

    Attributes
    ----------
    depth : [m].
    compliance : dd/dF, its derivative with respect to force [m/N].
    force_error : sd [N] of the forward model's own error in the force at that depth.
    reach : largest force [N] inside the model's range, (n_draw,), 0 if none.
    inside : (n_draw,), designs that the model covers; the following are of these alone, (n_inside, n_force).
    before, at, after : [m], depths about the one that is meant, between which slopes are taken.
    wanted : [N], the forces.
    response : at `before`, `at` and `after` side by side, with the capacitance of the designs themselves.
    """

    depth: FloatArray
    compliance: FloatArray
    force_error: FloatArray
    reach: FloatArray
    inside: BoolArray
    before: FloatArray
    at: FloatArray
    after: FloatArray
    wanted: FloatArray
    response: Response | None


@dataclass(frozen=True, eq=False)
class SignalAt:
    """What designs give where they carry given forces, arrays (n_draw, n_force).

    Attributes
    ----------
    change : C/C0 - 1 [1].
    change_slope : its derivative with respect to force [1/N].
    change_error : sd [1] of the forward model's own error in the change at given depth.
    """

    change: FloatArray
    change_slope: FloatArray
    change_error: FloatArray


def press_to(curves: Curves, force: FloatArray) -> PressedTo:
    """Find the depths at which designs carry given forces, see `predict_design`.

    Parameters
    ----------
    curves : of the designs.
    force : [N], shape (n_force,), or (n_draw, n_force).
    """
    limit = curves.limit
    wanted = np.broadcast_to(np.asarray(force, dtype=float), (limit.size, np.shape(force)[-1]))
    inside = np.asarray(limit > 0, dtype=bool)
    depth, compliance, error = (np.full(wanted.shape, np.nan) for _ in range(3))
    reach = np.zeros(limit.size)
    if not np.any(inside):
        nothing = np.empty((0, wanted.shape[1]))
        return PressedTo(depth, compliance, error, reach, inside, nothing, nothing, nothing, nothing, None)
    some, own = (curves if np.all(inside) else curves.only(inside)), wanted[inside]
    (table,) = some.press([Asked(table_depths(limit[inside]), ("force",))])
    reach[inside] = np.max(table.force, axis=1)
    found = depth_at_force(table, own)
    last = table.depth[:, -1:]
    at = np.where(np.isnan(found), 0.5 * last, np.maximum(found, 1e-3 * last))
    before, after = 0.99 * at, np.minimum(1.01 * at, last)
    n = wanted.shape[1]
    (r,) = some.press([Asked(np.concatenate([before, at, after], axis=1), ("force", "capacitance"))])
    rise = (r.force[:, 2 * n :] - r.force[:, :n]) / (after - before)
    with np.errstate(divide="ignore"):
        compliance[inside] = np.where(rise > 0, 1 / rise, np.nan) + 0 * found
    error[inside] = _sd(r.force_error[:, n : 2 * n]) + 0 * found
    depth[inside] = found
    return PressedTo(depth, compliance, error, reach, inside, before, at, after, own, r)


def signal_at(pressed: PressedTo, curves: Curves | None = None) -> SignalAt:
    """Read capacitances at the depths at which designs carry forces, see `predict_design`.

    Parameters
    ----------
    pressed : from `press_to`.
    curves : of other designs that differ from those in electrodes or dielectrics alone; None for the same.
    """
    change, slope, error = (np.full(pressed.depth.shape, np.nan) for _ in range(3))
    inside, r = pressed.inside, pressed.response
    if r is not None:
        n, between = pressed.wanted.shape[1], pressed.after - pressed.before
        miss = pressed.wanted - r.force[:, n : 2 * n]
        known = np.zeros(len(r.depth))
        if curves is not None:
            some = curves if np.all(inside) else curves.only(inside)
            known = np.where(some.limit > 0, 0.0, np.nan)
            (r,) = some.press([Asked(r.depth, ("capacitance",))])
        c = r.capacitance_change + known[:, None]
        rise = (c[:, 2 * n :] - c[:, :n]) / between * pressed.compliance[inside]
        slope[inside] = rise
        change[inside] = np.where(pressed.wanted > 0, c[:, n : 2 * n] + rise * miss, 0.0) + 0 * rise
        error[inside] = _sd(r.capacitance_error[:, n : 2 * n]) / r.rest_capacitance[:, None] + 0 * rise
    return SignalAt(change, slope, error)


def loading_curve(
    forward: Forward, design: Design, *, displacement: float | None = None, force: float | None = None, steps: int = 14
) -> Response:
    """Press one design in equal steps up to an indentation or up to a force, as a tester would.

    Parameters
    ----------
    forward : the model.
    design : one, not a batch.
    displacement : [m], the last indentation; or
    force : [N], the last force.
    steps : how many, the last one at the target.

    Returns
    -------
    Arrays of shape (steps,).

    Raises
    ------
    ValueError
        If not exactly one target is given, or it or `steps` is not positive.
    OutOfRangeError
        If the model does not cover the target; the message names how far it reaches.
    """
    target, unit = (displacement, "m") if displacement is not None else (force, "N")
    if target is None or (displacement is not None and force is not None):
        raise ValueError("give either a displacement or a force, not both")
    if target <= 0 or not np.isfinite(target):
        raise ValueError(f"{'displacement' if unit == 'm' else 'force'} must be positive, got {target:.6g} {unit}")
    if steps < 1:
        raise ValueError(f"steps must be at least 1, got {steps}")
    ramp = np.linspace(0.0, target, steps + 1)[1:]
    if displacement is not None:
        return forward.respond(design, ramp)
    if isinstance(forward, ForceControlled):
        return forward.respond_to_force(design, ramp)
    table = depth_table(forward, design, 128)
    depth = depth_at_force(table, ramp)[0]
    if np.any(np.isnan(depth)):
        raise OutOfRangeError(
            f"the {forward.name} reaches forces up to {np.max(table.force):.4g} N "
            f"(a depth of {table.depth[0, -1] * 1e3:.4g} mm) for this design, got {target:.6g} N"
        )
    for _ in range(4):  # Newton on F(d) = force by secants of 1 %: the table alone is good to about 1e-4
        near = forward.respond(design, np.concatenate([0.99 * depth, depth]))
        slope = (near.force[steps:] - near.force[:steps]) / (0.01 * depth)
        depth = np.minimum(depth + (ramp - near.force[steps:]) / slope, table.depth[0, -1])
    return forward.respond(design, depth)


def _sd(modes: FloatArray) -> FloatArray:
    """Marginal sd of V V^T: modes (..., n_depth, n_mode) -> (..., n_depth)."""
    return np.asarray(np.sqrt(np.sum(modes**2, axis=-1)), dtype=float)
