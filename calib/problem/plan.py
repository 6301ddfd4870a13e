"""A sweep in, the part of its likelihood that no draw changes out: ties, loads, correlation of the discrepancy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from calib.lab import Points, Sweep, Track
from calib.problem.centred import nominal_zero
from models.curves import force_scale
from models.sensor import FloatArray, IntArray

#: Length over which the model discrepancy stays alike, as a share of the sweep's largest depth.
CORRELATION_LENGTH = 0.3

#: Share of the discrepancy's variance that its low-rank form may leave to the diagonal.
_RANK_TOLERANCE = 1e-6

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation matrix K of (4) at the points of a channel: U U^T + diag(rest), U = `modes` (n_point, n_mode)."""

    modes: FloatArray
    rest: FloatArray


@dataclass(frozen=True, eq=False)
class ChannelPlan:
    """The part of a channel's prediction that is the same for every draw, computed once.

    Attributes
    ----------
    points : the data.
    tie : how their depth is known, see `Sweep.tied_by`.
    load : [N], (n_point,), load at points that are tied by displacement; None where no record has it.
    correlation : of the discrepancy, K of (4).
    slope : [N/m], (n_point,), of the load over the crosshead's reading, s of (5), where the load is the reading; else None.
    """

    points: Points
    tie: str
    load: FloatArray | None
    correlation: Correlation
    slope: FloatArray | None = None

    @property
    def needs_curve(self) -> bool:
        """Whether the points' depth must be looked up on the forward model's loading curve, as the records do not hold it."""
        return not (self.tie == "clock" or (self.tie == "displacement" and self.load is not None))


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """A sweep, and for each of its channels the part of the prediction that is the same for every draw."""

    sweep: Sweep
    channels: Mapping[str, ChannelPlan]

    @property
    def needs_curve(self) -> bool:
        """Whether a channel has to be looked up on the forward model's loading curve."""
        return any(channel.needs_curve for channel in self.channels.values())


def plan_sweep(sweep: Sweep) -> SweepPlan:
    """Compute once what the likelihood of a sweep needs again and again and no draw changes: ties, loads, correlations."""
    onset, load = nominal_zero(sweep)
    if np.isfinite(sweep.contact):
        onset = sweep.contact
    return SweepPlan(sweep, {name: _plan_channel(sweep, name, onset, load) for name in sweep.channels})


def without_points(plan: SweepPlan, channel: str, rows: IntArray) -> SweepPlan:
    """Leave points of a channel out of what the likelihood asks of a sweep; the others stay as correlated as they were.

    Parameters
    ----------
    plan : of the sweep, which itself is not changed.
    channel : its name.
    rows : numbers of the points to leave out; a channel without any left goes.
    """
    known = plan.channels[channel]
    kept = np.setdiff1d(np.arange(known.points.value.size), rows)
    others = {name: other for name, other in plan.channels.items() if name != channel}
    if not kept.size:
        return replace(plan, channels=others)
    columns = {f.name: getattr(known.points, f.name) for f in fields(known.points)}
    points = replace(known.points, **{name: column[kept] for name, column in columns.items() if column is not None})
    load = None if known.load is None else known.load[kept]
    correlation = Correlation(np.ascontiguousarray(known.correlation.modes[kept]), known.correlation.rest[kept])
    slope = None if known.slope is None else known.slope[kept]
    part = replace(known, points=points, load=load, correlation=correlation, slope=slope)
    return replace(plan, channels={name: part if name == channel else plan.channels[name] for name in plan.channels})


def _plan_channel(sweep: Sweep, name: str, onset: float, load: float) -> ChannelPlan:
    points, tie = sweep.channels[name], sweep.tied_by(name)
    tied_load = None
    if tie == "displacement":
        reading = present(points.displacement)
        along = reading - onset
        tied_load = sweep.load_at(name)
        tester = sweep.channels.get("force")
        if tied_load is None and tester is not None:
            at = present(tester.displacement)
            order = np.argsort(at)
            tied_load = np.interp(reading, at[order], tester.value[order])
    elif tie == "force":
        along = force_scale(present(points.force) - load)
    else:
        time = present(points.time) + np.nan_to_num(sweep.clock_offset)
        along = at_time(present(sweep.track), time)[0] - onset
    slope = _slope(present(points.displacement), points.value) if name == "force" and tie == "displacement" else None
    return ChannelPlan(points, tie, tied_load, _correlation(along), slope)


def _slope(reading: FloatArray, load: FloatArray) -> FloatArray:
    """Slope of a load over readings of the crosshead [N/m], (n_point,), by lines through each point and two on each side."""
    order = np.argsort(reading, kind="stable")
    x, y = reading[order], load[order]
    found = np.zeros_like(y)
    for k in range(x.size):
        near = slice(max(0, k - 2), k + 3)
        off = x[near] - np.mean(x[near])
        square = float(np.sum(off**2))
        found[order[k]] = max(float(np.sum(off * y[near])) / square, 0.0) if square > 0 else 0.0
    return found


def _correlation(along: FloatArray) -> Correlation:
    """Squared-exponential correlation over nominal depth (any scale, zero at contact) with its large eigenvectors."""
    deepest = float(np.max(along))
    x = np.clip(along / deepest, 0.0, 1.0) if deepest > 0 else np.zeros(along.size)
    k = np.exp(-0.5 * ((x[:, None] - x) / CORRELATION_LENGTH) ** 2)
    value, vector = np.linalg.eigh(k)
    value, vector = np.maximum(value[::-1], 0.0), vector[:, ::-1]
    rank = 1 + int(np.argmax(np.cumsum(value) >= (1 - _RANK_TOLERANCE) * np.sum(value)))
    modes = vector[:, :rank] * np.sqrt(value[:rank])
    return Correlation(np.ascontiguousarray(modes), np.maximum(1.0 - np.sum(modes**2, axis=1), 0.0))


def present(part: _T | None) -> _T:
    """Return a part of a sweep that must be there, as the tie or the channel requires it; refuse None.

    Raises
    ------
    ValueError
        If it is None.
    """
    if part is None:
        raise ValueError("a part of the sweep that its tie needs is missing")
    return part


def at_time(track: Track, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Crosshead reading [m] and load [N] of the tester's record at `time` [s], any shape.

    Beyond the ends of the record the crosshead stands where it was last seen.

    Parameters
    ----------
    track : the record.
    time : [s], by the clock of the tester, any shape.
    """
    index = np.clip(np.searchsorted(track.time, time) - 1, 0, track.time.size - 2)
    start = track.time[index]
    weight = np.clip((time - start) / (track.time[index + 1] - start), 0.0, 1.0)
    reading, load = (c[index] + weight * (c[index + 1] - c[index]) for c in (track.displacement, track.force))
    return reading, load
