"""A sweep, a forward model and draws of the unknowns in, what the instruments should read and its covariance out.

Measurement model of a sweep, readings i of the tester and j of the LCR meter:

    d_i = reading_i - d_0 - c_m f_i                 true indentation; before contact F = 0 and C = C0              (1)
    f_i = F(d_i) + F_0 + error                                                                                    (2)
    C_j = C(d_j) + C_p + error                                                                                    (3)

with d_j from (1) at the tester's record at time t_j + clock offset; or from F^-1(f_j - F_0), where the LCR file has a force
column; or from (1) at its own displacement column. The errors of a channel (n points) are normal with covariance

    diag(s^2 / n_effective) + V V^T + delta^2 diag(g) K diag(g)                                                   (4)

s is the noise of one reading, V the forward model's own error, the last term the model discrepancy: a Gaussian process along
the sweep of sd delta g, g = F(d) or C(d) - C0, with a squared-exponential correlation K over the depth at the sweep's nominal
points and the fixed length `CORRELATION_LENGTH`. K is used as U U^T + diag(rest) with its few large eigenvectors, so that (4)
is diagonal plus low rank.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from calib.catalogue import bounds_of
from calib.lab import Points, Sweep, Track
from calib.problem.centred import nominal_zero
from calib.problem.channels import CHANNEL_MODELS
from calib.problem.values import Calibrated, design_values, lookup
from models.curves import Lookup, force_scale, look_up, look_up_force, table_depths
from models.response import Forward, Response
from models.sensor import BoolArray, Design, FloatArray, design_from

#: Length over which the model discrepancy stays alike, as a share of the sweep's largest depth.
CORRELATION_LENGTH = 0.3

#: Share of the discrepancy's variance that its low-rank form may leave to the diagonal.
_RANK_TOLERANCE = 1e-3

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
    """

    points: Points
    tie: str
    load: FloatArray | None
    correlation: Correlation

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


@dataclass(frozen=True, eq=False)
class PredictedReadings:
    """What an instrument should read at the points of a channel, and how far readings may lie from that, for many draws.

    The covariance of the readings of one draw is diag(variance) + modes modes^T: noise of single readings, and errors that
    neighbouring points share (of the forward model, and the discrepancy). Draws outside the forward model's range are left out.

    Attributes
    ----------
    depth : [m], (n_covered, n_point), true indentation at each point.
    mean : (n_covered, n_point), SI, expected reading.
    variance : (n_covered, n_point), SI, independent part of the covariance.
    modes : (n_covered, n_point, n_mode), SI, factors of its correlated part.
    observed : (n_point,), SI, what was read.
    """

    depth: FloatArray
    mean: FloatArray
    variance: FloatArray
    modes: FloatArray
    observed: FloatArray

    @property
    def sd(self) -> FloatArray:
        """Standard deviation of each reading by itself, independent and correlated part together, (n_covered, n_point)."""
        return np.asarray(np.sqrt(self.variance + np.sum(self.modes**2, axis=-1)), dtype=float)


@dataclass(frozen=True, eq=False)
class SweepModel:
    """What the instruments should read in one sweep, channel by channel, for a batch of draws of the unknowns.

    Attributes
    ----------
    covered : (n_draw,), draws whose design is valid and whose depths the forward model covers; the channels hold these only.
    range_use : (n_draw,), deepest point over the deepest the forward model covers; inf where the design is not covered.
    channels : name -> predicted readings, in the order of the sweep's channels; empty if no draw is covered.
    """

    covered: BoolArray
    range_use: FloatArray
    channels: Mapping[str, PredictedReadings]

    @property
    def deepest(self) -> FloatArray:
        """Largest true indentation [m] at a reading, (n_covered,)."""
        return np.asarray(np.max([np.max(c.depth, axis=1) for c in self.channels.values()], axis=0), dtype=float)


# --- before any draw is known -------------------------------------------------------------------------------------------


def plan_sweep(sweep: Sweep) -> SweepPlan:
    """Compute once what the likelihood of a sweep needs again and again and no draw changes: ties, loads, correlations."""
    onset, load = nominal_zero(sweep)
    return SweepPlan(sweep, {name: _plan_channel(sweep, name, onset, load) for name in sweep.channels})


def _plan_channel(sweep: Sweep, name: str, onset: float, load: float) -> ChannelPlan:
    points, tie = sweep.channels[name], sweep.tied_by(name)
    tied_load = None
    if tie == "displacement":
        reading = _present(points.displacement)
        along = reading - onset
        tied_load = sweep.load_at(name)
        tester = sweep.channels.get("force")
        if tied_load is None and tester is not None:
            at = _present(tester.displacement)
            order = np.argsort(at)
            tied_load = np.interp(reading, at[order], tester.value[order])
    elif tie == "force":
        along = force_scale(_present(points.force) - load)
    else:
        time = _present(points.time) + np.nan_to_num(sweep.clock_offset)
        along = _at_time(_present(sweep.track), time)[0] - onset
    return ChannelPlan(points, tie, tied_load, _correlation(along))


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


# --- the measurement model ----------------------------------------------------------------------------------------------


def model_sweep(
    known: Calibrated,
    forward: Forward,
    plan: SweepPlan,
    values: Mapping[str, FloatArray],
    table: FloatArray | None = None,
) -> SweepModel:
    """Predict what the instruments should read in one sweep, with the errors that readings may have, for a batch of draws.

    Equations (1) to (4), in one call of the forward model.

    Parameters
    ----------
    known : the experiment and all its sweeps: a `Problem` or a `Posterior`.
    forward : the model of the sensor.
    plan : the sweep, from `plan_sweep`.
    values : name of an unknown -> SI values (n_draw,), fixed ones included.
    table : depths [m] (n_draw, n_node) of the loading curve along which a channel that is not tied to depth directly is
        looked up, from zero upwards; default `table_depths` to the end of what the forward model covers. A draw whose
        readings lie beyond its last node is not covered.

    Returns
    -------
    The prediction, for the draws that are covered.

    Raises
    ------
    ValueError
        If the forward model gives something that is not finite inside the range it says it covers.
    """
    sweep = plan.sweep
    own = _SweepValues(values, sweep)
    design = design_values(known, values, sweep.specimen, sweep.name)
    n_draw = next(iter(design.values())).size
    valid = _valid(design)
    use = np.full(n_draw, np.inf)
    direct = {name: _direct_depth(own, sweep, c) for name, c in plan.channels.items() if not c.needs_curve}
    limit = np.zeros(n_draw)
    friction = known.experiment.friction_coefficient
    batch = _batch(design, valid, friction) if np.any(valid) else None
    if batch is not None:
        limit[valid] = forward.max_depth(batch)
    inside = limit > 0
    deepest = np.max([np.max(d, axis=1) for d in direct.values()], axis=0) if direct else np.zeros(n_draw)
    use[inside] = np.maximum(deepest[inside], 0.0) / limit[inside]
    covered = inside & (deepest <= limit)
    if batch is None or not np.any(covered):
        return SweepModel(covered, use, {})
    batch = batch if np.array_equal(covered, valid) else _batch(design, covered, friction)
    own = own.of(covered)
    depths = [d[covered] for d in direct.values()]
    if plan.needs_curve:
        depths.append(table_depths(limit[covered]) if table is None else table[covered])
    response = forward.respond(batch, np.concatenate(depths, axis=1))
    _require_finite(forward, response)

    ends = np.cumsum([d.shape[1] for d in depths])
    parts = [_points(response, slice(end - d.shape[1], end)) for end, d in zip(ends, depths, strict=True)]
    at = dict(zip(direct, parts, strict=False))
    places: dict[str, Lookup] = {}
    reached = np.ones(int(np.sum(covered)), dtype=bool)
    for name, channel in plan.channels.items():
        if channel.needs_curve:
            at[name], places[name] = parts[-1], _look_up_tied(own, channel, parts[-1])
            reached &= ~np.any(np.isnan(places[name].weight), axis=1)
    for name, place in places.items():
        looked_up = np.max(place.at(at[name].depth), axis=1) / limit[covered]
        use[covered] = np.where(reached, np.maximum(use[covered], looked_up), np.inf)
    predicted = {name: _predict(own, name, c, at[name], places.get(name)) for name, c in plan.channels.items()}
    if not np.all(reached):
        predicted = {name: _some(readings, reached) for name, readings in predicted.items()}
        covered[covered] = reached
    return SweepModel(covered, use, predicted)


def why_outside(known: Calibrated, forward: Forward, plan: SweepPlan, values: Mapping[str, FloatArray]) -> str:
    """Say in a sentence why the forward model does not cover a draw at a sweep's readings: a broken rule or a violated bound.

    Parameters
    ----------
    known, forward, plan : as in `model_sweep`.
    values : of the one draw, (1,).
    """
    sweep = plan.sweep
    try:
        given = design_values(known, values, sweep.specimen, sweep.name)
        design = design_from(given, friction_coefficient=known.experiment.friction_coefficient)
    except ValueError as error:
        return str(error)
    own = _SweepValues(values, sweep)
    depths = [_direct_depth(own, sweep, channel) for channel in plan.channels.values() if not channel.needs_curve]
    if reason := forward.outside(design, np.concatenate([np.zeros((1, 1)), *depths], axis=1)):
        return reason
    table = forward.respond(design, table_depths(forward.max_depth(design)))
    return f"its loading curve ends at {np.max(table.force):.4g} N ({table.depth[0, -1] * 1e3:.4g} mm), short of the readings"


def reach(
    known: Calibrated, forward: Forward, plan: SweepPlan, values: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Find how far the forward model covers a press, in terms of what the instruments read: crosshead and load.

    Parameters
    ----------
    known, forward, plan, values : as in `model_sweep`.

    Returns
    -------
    Reading of the crosshead [m] (at no less, as the machine gives), and load [N], (n_draw,); -inf where it does not cover the
    design.
    """
    own = _SweepValues(values, plan.sweep)
    design = design_values(known, values, plan.sweep.specimen, plan.sweep.name)
    valid = _valid(design)
    reading, load = np.full(valid.size, -np.inf), np.full(valid.size, -np.inf)
    if not np.any(valid):
        return reading, load
    limit = np.zeros(valid.size)
    limit[valid] = forward.max_depth(_batch(design, valid, known.experiment.friction_coefficient))
    inside = limit > 0
    if np.any(inside):
        ends = forward.respond(_batch(design, inside, known.experiment.friction_coefficient), limit[inside][:, None])
        some = own.of(inside)
        reading[inside] = (limit[inside][:, None] + some["contact_offset"])[:, 0]
        load[inside] = (ends.force + some["load_zero"])[:, 0]
    return reading, load


def _present(part: _T | None) -> _T:
    """Return a part of a sweep that must be there, as the tie or the channel requires it; refuse None."""
    if part is None:
        raise ValueError("a part of the sweep that its tie needs is missing")
    return part


class _SweepValues:
    """Values of the unknowns that hold for one sweep, as columns (n_draw, 1); zero for an unknown that does not exist."""

    def __init__(self, values: Mapping[str, FloatArray], sweep: Sweep, rows: BoolArray | None = None) -> None:
        self._values, self._sweep, self._rows = values, sweep, rows

    def of(self, rows: BoolArray) -> _SweepValues:
        """The same for a selection of the draws."""
        return _SweepValues(self._values, self._sweep, rows)

    def __getitem__(self, parameter: str) -> FloatArray:
        column = lookup(self._values, parameter, self._sweep.specimen, self._sweep.name)
        if column is None:
            column = np.zeros(next(iter(self._values.values())).shape)
        return (column if self._rows is None else column[self._rows])[:, None]


def _crosshead_depth(own: _SweepValues, reading: FloatArray, force: FloatArray) -> FloatArray:
    """True indentation [m] by (1), (n_draw, n_point)."""
    return np.asarray(reading - own["contact_offset"] - own["machine_compliance"] * force, dtype=float)


def _direct_depth(own: _SweepValues, sweep: Sweep, channel: ChannelPlan) -> FloatArray:
    """True indentation [m] at the points of a channel whose crosshead reading and load are known without the forward model."""
    if channel.tie == "clock":
        return _crosshead_depth(own, *_at_time(_present(sweep.track), _present(channel.points.time) + own["clock_offset"]))
    return _crosshead_depth(own, _present(channel.points.displacement), _present(channel.load))


def _at_time(track: Track, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Crosshead reading [m] and load [N] of the tester's record at `time` [s], any shape.

    Beyond the ends of the record the crosshead stands where it was last seen.
    """
    index = np.clip(np.searchsorted(track.time, time) - 1, 0, track.time.size - 2)
    start = track.time[index]
    weight = np.clip((time - start) / (track.time[index + 1] - start), 0.0, 1.0)
    reading, load = (c[index] + weight * (c[index + 1] - c[index]) for c in (track.displacement, track.force))
    return reading, load


def _look_up_tied(own: _SweepValues, channel: ChannelPlan, table: Response) -> Lookup:
    """Where on each draw's loading curve the points of a channel were read, known by force or by crosshead alone."""
    if channel.tie == "force":
        return look_up_force(table, _present(channel.points.force) - own["load_zero"])
    # No load was read here: (1) with the model's own force, which grows with depth.
    crosshead = np.maximum.accumulate(table.depth + own["machine_compliance"] * table.force, axis=-1)
    return look_up(crosshead, _present(channel.points.displacement) - own["contact_offset"])


def _predict(own: _SweepValues, name: str, channel: ChannelPlan, at: Response, place: Lookup | None) -> PredictedReadings:
    """Equations (2) to (4) of one channel, directly at its points or interpolated in a table along the loading curve."""
    model, points = CHANNEL_MODELS[name], channel.points
    depth, ideal, error = at.depth, model.ideal(at), model.error(at)
    variance = own[f"{name}_noise"] ** 2 / points.n_effective
    if place is not None:
        if channel.tie == "force":
            # A force reading stands for depth here: its noise shows as its own slope over force times it.
            slope = np.gradient(ideal, axis=-1) / np.maximum(np.gradient(at.force, axis=-1), 1e-12)
            variance = variance + (place.at(slope) * own["force_noise"]) ** 2 / points.n_effective
        depth, ideal, error = place.at(depth), place.at(ideal), place.at(error)
    discrepancy = own[f"{name}_discrepancy"] * model.signal(ideal, at)
    variance = variance + discrepancy**2 * channel.correlation.rest
    modes = np.concatenate([error, discrepancy[..., None] * channel.correlation.modes], axis=-1)
    return PredictedReadings(depth, ideal + own[model.zero], variance, modes, points.value)


def _points(response: Response, part: slice) -> Response:
    """Select some of the depths of a batch response."""
    return Response(
        response.depth[:, part],
        response.force[:, part],
        response.contact_radius[:, part],
        response.capacitance[:, part],
        response.rest_capacitance,
        response.force_error[:, part],
        response.capacitance_error[:, part],
    )


def _some(readings: PredictedReadings, rows: BoolArray) -> PredictedReadings:
    """Select some of the draws."""
    r = readings
    return PredictedReadings(r.depth[rows], r.mean[rows], r.variance[rows], r.modes[rows], r.observed)


def _require_finite(forward: Forward, response: Response) -> None:
    for name, column in (("force", response.force), ("capacitance", response.capacitance)):
        if not np.isfinite(column).all():
            raise ValueError(f"the {forward.name} gave a {name} that is not finite inside the range it says it covers")


def _valid(design: Mapping[str, FloatArray]) -> BoolArray:
    """Draws whose design breaks no rule of `models.sensor`, (n_draw,)."""
    good = np.ones(next(iter(design.values())).shape, dtype=bool)
    for name, value in design.items():
        good &= np.isfinite(value) & ((value >= 0) if bounds_of(name) == "not negative" else (value > 0))
    slack = 1 + 1e-9
    if "dielectric_thickness" in design:
        good &= design["dielectric_thickness"] <= design["sensor_thickness"] / 2 * slack
    if "electrode_radius" in design:
        good &= design["electrode_radius"] <= design["sensor_radius"] * slack
    return good


def _batch(design: Mapping[str, FloatArray], rows: BoolArray, friction: float) -> Design:
    return design_from({name: value[rows] for name, value in design.items()}, friction_coefficient=friction)
