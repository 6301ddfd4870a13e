"""Sweeps in, the part of their likelihood that no draw changes out: ties, loads, correlation of the discrepancy.

Presses of one specimen under one ball repeat each other, however many days lie between them: what the model leaves out of one
it leaves out of the others, too. Their discrepancy is one function of depth, with the correlation

    k(x, x') = exp(-(x - x')^2 / 2 l^2)                                                                               (1)

of any two of their points, at depths x and x' as shares of the deepest of them, l the correlation length. A press that nobody
repeated has it over its nominal depths. Those of several presses are off by as much as contact was found wrongly in each, which
would tell the model from what it leaves out; so the depths of (1) are then the true ones of each draw.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import TypeVar

import numpy as np

from calib.lab import Points, Sweep, Track
from calib.problem.centred import nominal_zero
from models.curves import force_scale
from models.sensor import BoolArray, FloatArray, IntArray

#: Length over which the model discrepancy stays alike, as a share of the largest depth of a sweep and of those that repeat it.
CORRELATION_LENGTH = 0.3

#: Share of the discrepancy's variance that its low-rank form may leave to the diagonal.
_RANK_TOLERANCE = 1e-6

# Largest share of depth for which (1) is tabulated, deeper points being taken as there, and steps of that table; nodes through
# which its modes are computed, and the least share of the largest eigenvalue that is used of them.
_END, _STEPS, _NODES, _LEAST_EIGENVALUE = 1.25, 640, 41, 1e-13

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation matrix K of (4) at the points of a channel: U U^T + diag(rest), with U' of points of a repeat U U'^T.

    Attributes
    ----------
    modes : U, (n_point, n_mode) for all draws or (n_draw, n_point, n_mode).
    rest : (n_point,) or (n_draw, n_point).
    """

    modes: FloatArray
    rest: FloatArray

    def only(self, rows: BoolArray | IntArray) -> Correlation:
        """Of some of the draws."""
        return self if self.modes.ndim == 2 else replace(self, modes=self.modes[rows], rest=self.rest[rows])


@dataclass(frozen=True, eq=False)
class ChannelPlan:
    """The part of a channel's prediction that is the same for every draw, computed once.

    Attributes
    ----------
    points : the data.
    tie : how their depth is known, see `Sweep.tied_by`.
    load : [N], (n_point,), load at points that are tied by displacement; None where no record has it.
    correlation : of the discrepancy, K of (4); None where it is that of the true depths of a draw.
    deepest : largest nominal depth of the presses that repeat each other, which are taken together; nan of a press by itself.
        In metres, or as `models.curves.force_scale` where all are tied by force: their loads are known as they are.
    deepest_load : [N], load there, by which the frame gives way; 0 where it is not known.
    slope : [N/m], (n_point,), of the load over the crosshead's reading, s of (5), where the load is the reading; else None.
    """

    points: Points
    tie: str
    load: FloatArray | None
    correlation: Correlation | None
    deepest: float
    deepest_load: float
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
    """Compute once what the likelihood of a sweep by itself needs again and again and no draw changes: see `plan_sweeps`."""
    return plan_sweeps([sweep])[0]


def plan_sweeps(sweeps: Sequence[Sweep]) -> tuple[SweepPlan, ...]:
    """Compute once what the likelihood of sweeps needs again and again and no draw changes: ties, loads, correlations.

    Parameters
    ----------
    sweeps : all that are calibrated together: those of one specimen under one ball share what the model leaves out.

    Returns
    -------
    One for each, in their order.
    """
    drafts = [_draft(sweep) for sweep in sweeps]
    found: dict[tuple[int, str], ChannelPlan] = {}
    for name, places in repeating((sweep, sweep.channels) for sweep in sweeps):
        known = [drafts[k][name] for k in places]
        deepest, load = _deepest_of(known) if len(places) > 1 else (np.nan, 0.0)
        for k, draft in zip(places, known, strict=True):
            if len(places) == 1:
                correlation: Correlation | None = _correlation(draft.along)
            else:
                by_load = all(other.tie == "force" for other in known)
                correlation = shared_correlation(draft.along / deepest) if by_load else None
            found[k, name] = ChannelPlan(draft.points, draft.tie, draft.load, correlation, deepest, load, draft.slope)
    return tuple(SweepPlan(sweep, {name: found[k, name] for name in sweep.channels}) for k, sweep in enumerate(sweeps))


def specimen_and_ball(sweep: Sweep) -> tuple[str, float]:
    """Name of the specimen and radius of the ball [m] of a press: those of which both are the same repeat each other."""
    return sweep.specimen, sweep.indenter_radius


def repeating(sweeps: Iterable[tuple[Sweep, Iterable[str]]]) -> list[tuple[str, list[int]]]:
    """Sort channels of sweeps by whose errors go together, in the order of the first sweep of each.

    Parameters
    ----------
    sweeps : each with the names of its channels.

    Returns
    -------
    Name of a channel, and the numbers of the sweeps in which it repeats itself, which may be one alone.
    """
    found: dict[tuple[str, float, str], list[int]] = {}
    for k, (sweep, names) in enumerate(sweeps):
        for name in names:
            found.setdefault((*specimen_and_ball(sweep), name), []).append(k)
    return [(name, places) for (_, _, name), places in found.items()]


def shared_correlation(x: FloatArray) -> Correlation:
    """Correlation of the discrepancy in presses that repeat each other, (1), by modes that are the same functions for all.

    Parameters
    ----------
    x : depths as shares of the largest of all of them, (n_point,) or (n_draw, n_point).
    """
    table, steps = _table()
    place = np.clip(x, 0.0, _END) * (_STEPS / _END)
    below = np.minimum(place.astype(np.int64), _STEPS - 1)
    modes = table[below] + (place - below)[..., None] * steps[below]
    return Correlation(modes, np.maximum(1.0 - np.sum(modes**2, axis=-1), 0.0))


@cache
def _table() -> tuple[FloatArray, FloatArray]:
    """The modes of (1) over the share of depth, (n_step + 1, n_mode), and from each row to the next, (n_step, n_mode)."""
    nodes, x = np.linspace(0.0, _END, _NODES), np.linspace(0.0, _END, _STEPS + 1)
    value, vector = np.linalg.eigh(correlation_between(nodes, nodes))
    kept = value > _LEAST_EIGENVALUE * value[-1]
    features = correlation_between(x, nodes) @ (vector[:, kept] / np.sqrt(value[kept]))
    value, vector = np.linalg.eigh(features.T @ features)
    value, vector = np.maximum(value[::-1], 0.0), vector[:, ::-1]
    rank = 1 + int(np.argmax(np.cumsum(value) >= (1 - _RANK_TOLERANCE) * np.sum(value)))
    table = np.ascontiguousarray(features @ vector[:, :rank])
    return table, np.diff(table, axis=0)


def correlation_between(x: FloatArray, others: FloatArray) -> FloatArray:
    """Correlation (1) of the discrepancy at depths and at others, (..., n_x, n_other).

    Parameters
    ----------
    x, others : depths as shares of the largest, (..., n_x) and (..., n_other).
    """
    return np.asarray(np.exp(-0.5 * ((x[..., :, None] - others[..., None, :]) / CORRELATION_LENGTH) ** 2), dtype=float)


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
    correlation = known.correlation
    if correlation is not None:
        modes, rest = np.ascontiguousarray(correlation.modes[kept]), correlation.rest[kept]
        correlation = replace(correlation, modes=modes, rest=rest)
    slope = None if known.slope is None else known.slope[kept]
    part = replace(known, points=points, load=load, correlation=correlation, slope=slope)
    return replace(plan, channels={name: part if name == channel else plan.channels[name] for name in plan.channels})


@dataclass(frozen=True, eq=False)
class _Draft:
    """What is known of a channel of a sweep by itself: a `ChannelPlan` but for the correlation.

    `along` (n_point,) are nominal depths on a scale that is zero at contact: of the crosshead [m], or, tied by force, as
    `models.curves.force_scale`; `deepest_load` is the load [N] at the largest, 0 where it is not known.
    """

    points: Points
    tie: str
    load: FloatArray | None
    along: FloatArray
    deepest_load: float
    slope: FloatArray | None


def _draft(sweep: Sweep) -> dict[str, _Draft]:
    onset, load = nominal_zero(sweep)
    if np.isfinite(sweep.contact):
        onset = sweep.contact
    return {name: _draft_channel(sweep, name, onset, load) for name in sweep.channels}


def _draft_channel(sweep: Sweep, name: str, onset: float, load: float) -> _Draft:
    points, tie = sweep.channels[name], sweep.tied_by(name)
    tied_load, at_reading = None, None
    if tie == "displacement":
        reading = present(points.displacement)
        along = reading - onset
        tied_load = sweep.load_at(name)
        tester = sweep.channels.get("force")
        if tied_load is None and tester is not None:
            at = present(tester.displacement)
            order = np.argsort(at)
            tied_load = np.interp(reading, at[order], tester.value[order])
        at_reading = tied_load
    elif tie == "force":
        along = force_scale(present(points.force) - load)
    else:
        time = present(points.time) + np.nan_to_num(sweep.clock_offset)
        reading, at_reading = at_time(present(sweep.track), time)
        along = reading - onset
    slope = _slope(present(points.displacement), points.value) if name == "force" and tie == "displacement" else None
    deepest_load = 0.0 if at_reading is None else max(float(at_reading[np.argmax(along)] - load), 0.0)
    return _Draft(points, tie, tied_load, along, deepest_load, slope)


def _deepest_of(drafts: Sequence[_Draft]) -> tuple[float, float]:
    """Largest nominal depth of presses, of those that the crosshead tells, if any, never quite zero; and the load [N] there."""
    by_crosshead = [draft for draft in drafts if draft.tie != "force"]
    deepest = max(by_crosshead or drafts, key=lambda draft: float(np.max(draft.along)))
    return max(float(np.max(deepest.along)), 1e-9), deepest.deepest_load


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
    value, vector = np.linalg.eigh(correlation_between(x, x))
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
