"""Posterior and forward model in, predictive bands and checks of every sweep, and predictions of new designs, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from scipy import stats
from scipy.linalg import cho_factor, cho_solve

from calib.catalogue import UnknownName
from calib.lab import Points, Sweep
from calib.problem import PredictedReadings, SweepModel, lookup, model_sweep, plan_sweep, specimen_design
from calib.sampling import Posterior, thin_draws
from models.response import Forward, OutOfRangeError, Response, depth_at_force, depth_table
from models.sensor import BoolArray, Design, FloatArray, design_from

#: Quantiles that a band consists of.
BAND_LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
#: Share of draws that may lie outside the model's range before a band is left out (nan).
UNCOVERED_SHARE = 0.05
_N_GRID = 81


@dataclass(frozen=True, eq=False)
class Bands:
    """Quantiles (`BAND_LEVELS`) of a curve: x (n_x,), model and reading (5, n_x), SI.

    `model` is the curve itself under the posterior; `reading` one new reading of it, with noise, discrepancy and the forward
    model's own error. nan where more than 5 % of the draws lie outside the model's range.
    """

    x: FloatArray
    model: FloatArray
    reading: FloatArray


@dataclass(frozen=True, eq=False)
class FitCheck:
    """Data of one channel of a sweep against the posterior, at the points the likelihood uses, arrays (n_point,), SI.

    Attributes
    ----------
    x, y : the data as they were read (x: crosshead [m] or load cell [N]; y: load cell [N] or capacitance [F]).
    mean, sd : of a point's posterior prediction, with noise, discrepancy and the forward model's own error.
    residual : (y - mean) / sd.
    inside_90 : share of the points inside the central 90 % of their prediction.
    p_value : posterior predictive p-value of the realised discrepancy T = r^T S^-1 r, with r and its covariance S of each
        draw: mean over draws of P(chi^2_n >= T) (Gelman, Meng, Stern, Statistica Sinica 6 (1996) 733). Near 0: the model
        does not fit; near 1: the claimed noise is too large.
    """

    x: FloatArray
    y: FloatArray
    mean: FloatArray
    sd: FloatArray
    residual: FloatArray
    inside_90: float
    p_value: float

    @property
    def passed(self) -> bool:
        """Whether the model describes the data: a p-value of at least 1 %."""
        return self.p_value >= 0.01

    @property
    def in_words(self) -> str:
        """The check in a sentence."""
        share = f"{self.inside_90 * 100:.0f} % of the {self.y.size} points lie inside their 90 % band"
        if not self.passed:
            return f"{share}; p = {self.p_value:.1g}: the model does not describe these data, look at the residuals"
        if self.p_value > 0.99:
            return f"{share}; p = {self.p_value:.2f}: the points scatter less than the model expects"
        return f"{share}; p = {self.p_value:.2f}: the data look like what the model predicts"


@dataclass(frozen=True, eq=False)
class ChannelFit:
    """One measured channel of a sweep against the posterior: bands along the sweep and the check at its points."""

    bands: Bands
    check: FitCheck


@dataclass(frozen=True, eq=False)
class Prediction:
    """What the posterior predicts for one sweep.

    Attributes
    ----------
    channels : name -> its fit, as read: force against the crosshead [m] (contact offset, compliance and load zero included),
        every other channel against the load cell [N].
    change : C/C0 - 1 [1] against the true force [N], without parasitic capacitance and load zero, or none.
    change_x, change_y : (n_point,) the data of the capacitance in the coordinates of `change`, at posterior means.
    n_draw : draws used. title : name for headings, the specimen and, if it has several, the sweep.
    """

    specimen: str
    sweep: str
    indenter_radius: float
    channels: Mapping[str, ChannelFit]
    change: Bands | None
    change_x: FloatArray
    change_y: FloatArray
    n_draw: int
    title: str


@dataclass(frozen=True, eq=False)
class DesignPrediction:
    """Prediction of designs at given forces, arrays (n_draw, n_force); nan where the force lies outside the model's range.

    Attributes
    ----------
    depth : [m]. change : C/C0 - 1 [1]. change_slope : its derivative with respect to force [1/N].
    change_error : sd [1] of `change` from the forward model's own error, of capacitance and of force.
    rest_capacitance : C0 [F], (n_draw,). reach : largest force [N] inside the model's range, (n_draw,), 0 if none.
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
        """Response of `design` at `force` [N], shape (n_force,)."""
        ...


def band(values: FloatArray) -> FloatArray:
    """Quantiles `BAND_LEVELS` over the first axis (draws), shape (5, ...); nan where more than 5 % of the draws are nan."""
    missing = np.mean(np.isnan(values), axis=0) > UNCOVERED_SHARE
    quantiles = np.nanquantile(np.where(missing, 0.0, values), BAND_LEVELS, axis=0)
    return np.asarray(np.where(missing, np.nan, quantiles), dtype=float)


def predict_design(forward: Forward, design: Design, force: FloatArray) -> DesignPrediction:
    """Depth, capacitance change and its slope of each draw of `design` at `force` [N], shape (n_force,).

    The depth comes from a table of 64 depths (`models.response.depth_table`); the change is corrected to first order for what
    the table's interpolation leaves, slopes are central differences over 2 % of the depth.
    """
    batch = design.draws()
    wanted = np.asarray(force, dtype=float)
    limit = forward.max_depth(batch)
    n_draw = limit.size
    inside = limit > 0
    depth, change, slope, error = (np.full((n_draw, wanted.size), np.nan) for _ in range(4))
    reach = np.zeros(n_draw)
    if np.any(inside):
        some = _subset(batch, inside)
        table = depth_table(forward, some)
        reach[inside] = np.max(table.force, axis=1)
        found = depth_at_force(table, wanted)
        safe = np.where(np.isnan(found), 0.5 * table.depth[:, -1:], np.maximum(found, 1e-3 * table.depth[:, -1:]))
        before, after = 0.99 * safe, np.minimum(1.01 * safe, table.depth[:, -1:])
        n = wanted.size
        r = forward.respond(some, np.concatenate([before, safe, after], axis=1))
        c = r.capacitance_change
        with np.errstate(divide="ignore", invalid="ignore"):
            df_dd = (r.force[:, 2 * n :] - r.force[:, :n]) / (after - before)
            dc_dd = (c[:, 2 * n :] - c[:, :n]) / (after - before)
            rise = np.where(df_dd > 0, dc_dd / df_dd, np.nan)
        middle = slice(n, 2 * n)
        nothing = np.where(np.isnan(found), np.nan, 0.0)
        slope[inside] = rise + nothing
        positive = np.broadcast_to(wanted > 0, found.shape)
        change[inside] = np.where(positive, c[:, middle] + rise * (wanted - r.force[:, middle]), 0.0) + nothing
        by_capacitance = _sd(r.capacitance_error[:, middle]) / r.rest_capacitance[:, None]
        error[inside] = np.hypot(by_capacitance, rise * _sd(r.force_error[:, middle])) + nothing
        depth[inside] = found
    c0 = np.asarray(batch.rest_capacitance, dtype=float)
    return DesignPrediction(depth, change, slope, error, c0, reach)


def predict(posterior: Posterior, forward: Forward, rng: np.random.Generator, *, n_draw: int = 400) -> tuple[Prediction, ...]:
    """Predictions for every sweep of the posterior, in the order of `posterior.sweeps`.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover the draws (it is not the one of the calibration).
    """
    values = thin_draws(posterior, n_draw, rng)
    return tuple(_predict_sweep(posterior, forward, values, sweep, rng) for sweep in posterior.sweeps)


def _predict_sweep(
    posterior: Posterior, forward: Forward, values: Mapping[str, FloatArray], sweep: Sweep, rng: np.random.Generator
) -> Prediction:
    at_data = model_sweep(posterior, forward, plan_sweep(sweep), values)
    if np.mean(at_data.covered) < 1 - UNCOVERED_SHARE:
        raise OutOfRangeError(
            f"the {forward.name} covers only {np.mean(at_data.covered) * 100:.0f} % of the posterior's draws for "
            f"{sweep.specimen}; the calibration used the {posterior.forward_name}"
        )
    fits: dict[str, ChannelFit] = {}
    change = None
    change_x, change_y = np.empty(0), np.empty(0)
    for name, points in sweep.channels.items():
        if name not in at_data.channels:
            continue
        if name == "force":
            fits[name] = _force_fit(posterior, forward, values, sweep, points, at_data.channels[name], rng)
            continue
        x = _loads(forward, posterior, values, sweep, name)
        grid = np.linspace(np.min(x), np.max(x), _N_GRID)
        dense = _over_load(posterior, forward, values, sweep, name, grid)
        fits[name] = ChannelFit(_bands(grid, dense.channels.get(name), rng), _check(x, at_data.channels[name]))
        if name == "capacitance":
            zero, parasitic, c0 = _zeros(posterior, values, sweep)
            true_grid = np.linspace(0.0, max(float(np.max(x - np.median(zero))), 1e-9), _N_GRID)
            none = np.zeros_like(zero)
            bare = {**values, **{str(UnknownName(p, sweep.specimen, sweep.name)): none for p in _ZEROS}}
            dense = _over_load(posterior, forward, bare, sweep, name, true_grid)
            change = _bands(true_grid, dense.channels.get(name), rng, rest=c0[dense.covered][:, None])
            change_x = x - float(np.median(zero))
            change_y = np.median((points.value - parasitic[:, None]) / c0[:, None] - 1, axis=0)
    several = sum(other.specimen == sweep.specimen for other in posterior.sweeps) > 1
    title = f"{sweep.specimen}, {sweep.name}" if several else sweep.specimen
    n_draw = at_data.covered.size
    return Prediction(sweep.specimen, sweep.name, sweep.indenter_radius, fits, change, change_x, change_y, n_draw, title)


# What is taken off where readings become force and capacitance of the sensor.
_ZEROS = ("load_zero", "parasitic_capacitance")


def _force_fit(
    posterior: Posterior,
    forward: Forward,
    values: Mapping[str, FloatArray],
    sweep: Sweep,
    points: Points,
    at_data: PredictedReadings,
    rng: np.random.Generator,
) -> ChannelFit:
    assert points.displacement is not None
    grid = np.linspace(np.min(points.displacement), np.max(points.displacement), _N_GRID)
    order = np.argsort(points.displacement)
    # The load matters here only through the machine's compliance: the data's own, interpolated, will do.
    load = np.interp(grid, points.displacement[order], points.value[order])
    along = replace(sweep, channels={"force": Points(load, np.ones(_N_GRID), displacement=grid)})
    dense = model_sweep(posterior, forward, plan_sweep(along), values)
    return ChannelFit(_bands(grid, dense.channels.get("force"), rng), _check(points.displacement, at_data))


def _over_load(
    posterior: Posterior, forward: Forward, values: Mapping[str, FloatArray], sweep: Sweep, channel: str, load: FloatArray
) -> SweepModel:
    """A channel of a sweep at given load cell readings [N], however its own readings were tied to depth."""
    points = Points(np.zeros(load.size), np.ones(load.size), force=load)
    along = replace(sweep, channels={channel: points}, track=None)
    return model_sweep(posterior, forward, plan_sweep(along), values)


def _zeros(posterior: Posterior, values: Mapping[str, FloatArray], sweep: Sweep) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draws of load zero [N], parasitic capacitance [F] and C0 [F] of a sweep, each (n_draw,)."""
    c0 = np.atleast_1d(np.asarray(specimen_design(posterior, values, sweep.specimen, sweep.name).rest_capacitance, dtype=float))
    load, parasitic = (lookup(values, p, sweep.specimen, sweep.name) for p in _ZEROS)
    nothing = np.zeros_like(c0)
    return nothing if load is None else load, nothing if parasitic is None else parasitic, c0


def _loads(forward: Forward, posterior: Posterior, values: Mapping[str, FloatArray], sweep: Sweep, channel: str) -> FloatArray:
    """Load cell reading [N] at the points of a channel, (n_point,): as read, or by clock or crosshead from the tester's record.

    Where no load was recorded at all it is the model's, at the medians of the posterior.
    """
    points = sweep.channels[channel]
    if points.force is not None:
        return points.force
    if sweep.tied_by(channel) == "clock" and points.time is not None and sweep.track is not None:
        offset = lookup(values, "clock_offset", sweep.specimen, sweep.name)
        late = 0.0 if offset is None else float(np.median(offset))
        return np.asarray(np.interp(points.time + late, sweep.track.time, sweep.track.force), dtype=float)
    assert points.displacement is not None
    tester = sweep.channels.get("force")
    if tester is not None and tester.displacement is not None:
        order = np.argsort(tester.displacement)
        return np.asarray(np.interp(points.displacement, tester.displacement[order], tester.value[order]), dtype=float)
    middle = {k: np.array([np.median(v)]) for k, v in values.items()}
    offset = lookup(middle, "contact_offset", sweep.specimen, sweep.name)
    depth = np.maximum(points.displacement - (0.0 if offset is None else float(offset[0])), 0.0)
    response = forward.respond(specimen_design(posterior, middle, sweep.specimen, sweep.name), depth[None, :])
    return np.asarray(response.force[0], dtype=float)


def _bands(
    x: FloatArray, channel: PredictedReadings | None, rng: np.random.Generator, rest: FloatArray | float | None = None
) -> Bands:
    """Bands of a channel at x (n_x,); with `rest` C0 (n_draw, 1) those of C/C0 - 1.

    One stratified standard normal per draw: exact at each x, and smooth along x.
    """
    if channel is None:
        return Bands(x, np.full((5, x.size), np.nan), np.full((5, x.size), np.nan))
    mean, sd = (channel.mean, channel.sd) if rest is None else (channel.mean / rest - 1, channel.sd / rest)
    n = mean.shape[0]
    normal = stats.norm.ppf((rng.permutation(n) + 0.5) / n)
    return Bands(x, band(mean), band(mean + sd * normal[:, None]))


def _check(x: FloatArray, channel: PredictedReadings) -> FitCheck:
    y, mean = channel.observed, channel.mean
    n = y.size
    p_values = []
    for r, variance, modes in zip(y - mean, channel.variance, channel.modes, strict=True):
        factor = cho_factor(np.diag(variance) + modes @ modes.T, lower=True)
        p_values.append(float(stats.chi2.sf(r @ cho_solve(factor, r), n)))
    centre = np.mean(mean, axis=0)
    sd = np.sqrt(np.mean(channel.sd**2, axis=0) + np.var(mean, axis=0))
    residual = (y - centre) / sd
    inside = float(np.mean(np.abs(residual) <= stats.norm.ppf(0.95)))
    return FitCheck(x, y, centre, sd, residual, inside, float(np.mean(p_values)))


def loading_curve(
    forward: Forward, design: Design, *, displacement: float | None = None, force: float | None = None, steps: int = 14
) -> Response:
    """Loading curve of one design in `steps` equal steps up to an indentation [m] or a force [N], the last one at the target.

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


def _subset(batch: Design, rows: BoolArray) -> Design:
    values = {k: np.asarray(v)[rows] for k, v in batch.parameters().items()}
    return design_from(values, friction_coefficient=batch.indenter.friction_coefficient)


def _sd(modes: FloatArray) -> FloatArray:
    """Marginal sd of V V^T: modes (..., n_depth, n_mode) -> (..., n_depth)."""
    return np.asarray(np.sqrt(np.sum(modes**2, axis=-1)), dtype=float)
