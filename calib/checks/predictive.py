"""Posterior and forward model in, predictive bands and checks of every sweep out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc, ndtri

from calib.catalogue import UnknownName
from calib.checks.member import Member, drawn, members_or
from calib.lab import Points, Sweep
from calib.problem import (
    PredictedReadings,
    SweepPlan,
    chi_square,
    lookup,
    model_sweep,
    plan_sweep,
    plan_sweeps,
    specimen_design,
)
from calib.sampling import Posterior
from models.response import Forward, OutOfRangeError
from models.sensor import BoolArray, FloatArray

if TYPE_CHECKING:
    import pandas as pd

#: Quantiles that a band consists of.
BAND_LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
#: Share of draws that may lie outside the model's range before a band is left out (nan).
UNCOVERED_SHARE = 0.05
_N_GRID = 81


@dataclass(frozen=True, eq=False)
class Bands:
    """A curve with its uncertainty: quantiles (`BAND_LEVELS`) over draws, nan where too many of these are not covered.

    Attributes
    ----------
    x : (n_x,), SI.
    model : (5, n_x), SI, of the curve itself.
    reading : (5, n_x), SI, of a new reading, with noise, discrepancy and the forward model's own error.
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
    def off(self) -> tuple[float, ...]:
        """How much of their range the data lie above the model in each third of the points, on the average."""
        span = float(np.ptp(self.mean))
        return tuple(float(np.mean(part)) / span if span > 0 else 0.0 for part in np.array_split(self.y - self.mean, 3))

    @property
    def pattern(self) -> str:
        """The same in a part of a sentence, without thirds in which it is less than a thousandth."""
        told = [
            f"{100 * abs(share):.1f} % too {'high' if share > 0 else 'low'} in the {name} third"
            for name, share in zip(("first", "middle", "last"), self.off, strict=True)
            if abs(share) >= 1e-3
        ]
        return ", ".join(told)

    @property
    def in_words(self) -> str:
        """Say in a sentence whether the model describes the data, with the numbers."""
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
    """What the posterior predicts for one sweep, beside what was read: the figures and the verdict on how well the model fits.

    Attributes
    ----------
    specimen, sweep : names.
    indenter_radius : [m].
    channels : name -> its fit, as read: force against the crosshead [m] (contact offset, compliance and load zero included),
        every other channel against the load cell [N].
    change : C/C0 - 1 [1] against the true force [N], without parasitic capacitance and load zero; None without capacitance.
    change_x, change_y : (n_point,) the data of the capacitance in the coordinates of `change`, at posterior means.
    n_draw : draws used.
    title : name for headings, the specimen and, if it has several, the sweep.
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

    def to_dataframe(self) -> pd.DataFrame:
        """The bands of all channels as a table, to plot.

        Returns
        -------
        One row per channel and abscissa: channel (a measured one, or "change" for C/C0 - 1 over the true force), x, and the
        quantiles model_05 ... model_95 of the curve and reading_05 ... reading_95 of a new reading of it, SI.
        """
        import pandas as pd

        bands = {name: fit.bands for name, fit in self.channels.items()} | ({"change": self.change} if self.change else {})
        frames = []
        for name, found in bands.items():
            columns = {"channel": [name] * found.x.size, "x": found.x}
            for kind, rows in (("model", found.model), ("reading", found.reading)):
                columns |= {f"{kind}_{level * 100:02.0f}": row for level, row in zip(BAND_LEVELS, rows, strict=True)}
            frames.append(pd.DataFrame(columns))
        return pd.concat(frames, ignore_index=True)


def band(values: FloatArray) -> FloatArray:
    """Summarise draws of a curve by their quantiles `BAND_LEVELS`.

    The draws are along the first axis; the result has the shape (5, ...), nan where more than 5 % of the draws are nan.
    """
    missing = np.mean(np.isnan(values), axis=0) > UNCOVERED_SHARE
    filled = np.where(missing, 0.0, values)
    some = np.any(np.isnan(filled), axis=0)
    quantiles = np.empty((len(BAND_LEVELS), *some.shape))
    quantiles[:, ~some] = np.quantile(filled[:, ~some], BAND_LEVELS, axis=0)  # nanquantile goes column by column
    quantiles[:, some] = np.nanquantile(filled[:, some], BAND_LEVELS, axis=0)
    return np.asarray(np.where(missing, np.nan, quantiles), dtype=float)


def predict(
    posterior: Posterior, forward: Forward, rng: np.random.Generator, *, n_draw: int = 400, members: Sequence[Member] = ()
) -> tuple[Prediction, ...]:
    """Predict every sweep from the posterior and hold the prediction against the data: does the model describe what was read?

    Parameters
    ----------
    posterior : as sampled or loaded.
    forward : the model that it was sampled with.
    rng : of the choice of draws and of new readings.
    n_draw : draws to use.
    members : the models that the posterior is an average of, each of which predicts for its own draws; none for one model.

    Returns
    -------
    One prediction for each sweep, in the order of `posterior.sweeps`.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover the draws (it is not the one of the calibration).
    """
    parts = drawn(members_or(members, posterior, forward), n_draw, rng)
    return tuple(_predict_sweep(parts, plan, rng) for plan in plan_sweeps(posterior.sweeps))


# Draws of each model, with the model.
_Parts = Sequence[tuple[Member, Mapping[str, FloatArray]]]


@dataclass(frozen=True, eq=False)
class _Modelled:
    """What instruments should read in a sweep by the draws of all models: which are covered, and of those the channels."""

    covered: BoolArray
    channels: Mapping[str, Sequence[PredictedReadings]]


def _modelled(parts: _Parts, plan: SweepPlan) -> _Modelled:
    found = [model_sweep(member.posterior, member.forward, plan, values) for member, values in parts]
    names = [name for name in plan.channels if any(name in model.channels for model in found)]
    channels = {name: [model.channels[name] for model in found if name in model.channels] for name in names}
    return _Modelled(np.concatenate([model.covered for model in found]), channels)


def _predict_sweep(parts: _Parts, plan: SweepPlan, rng: np.random.Generator) -> Prediction:
    sweep, at_data = plan.sweep, _modelled(parts, plan)
    if np.mean(at_data.covered) < 1 - UNCOVERED_SHARE:
        forwards, sampled = (
            ", ".join(dict.fromkeys(n))
            for n in zip(*((m.forward.name, m.posterior.forward_name) for m, _ in parts), strict=True)
        )
        raise OutOfRangeError(
            f"the {forwards} covers only {np.mean(at_data.covered) * 100:.0f} % of the posterior's draws for "
            f"{sweep.specimen}; the calibration used the {sampled}"
        )
    fits: dict[str, ChannelFit] = {}
    change = None
    change_x, change_y = np.empty(0), np.empty(0)
    for name, points in sweep.channels.items():
        if name not in at_data.channels:
            continue
        if name == "force":
            fits[name] = _force_fit(parts, sweep, points, at_data.channels[name], rng)
            continue
        x = _loads(parts, sweep, name)
        grid = np.linspace(np.min(x), np.max(x), _N_GRID)
        dense = _over_load(parts, sweep, name, grid)
        fits[name] = ChannelFit(_bands(grid, dense.channels.get(name), rng), _check(x, at_data.channels[name]))
        if name == "capacitance":
            c0, zero, parasitic, force_gain, gain = _instruments(parts, sweep)
            change_x = np.median((x - zero[:, None]) / force_gain[:, None], axis=0)
            true_grid = np.linspace(0.0, max(float(np.max(change_x)), 1e-9), _N_GRID)
            dense = _over_load([(m, {**values, **_ideal(values, sweep)}) for m, values in parts], sweep, name, true_grid)
            change = _bands(true_grid, dense.channels.get(name), rng, rest=c0[dense.covered][:, None])
            change_y = np.median((points.value - parasitic[:, None]) / (gain * c0)[:, None] - 1, axis=0)
    several = sum(other.specimen == sweep.specimen for other in parts[0][0].posterior.sweeps) > 1
    title = f"{sweep.specimen}, {sweep.name}" if several else sweep.specimen
    n_draw = at_data.covered.size
    return Prediction(sweep.specimen, sweep.name, sweep.indenter_radius, fits, change, change_x, change_y, n_draw, title)


# Instruments without faults, as which readings are force and capacitance of the sensor.
_IDEAL = {"load_zero": 0.0, "parasitic_capacitance": 0.0, "force_gain": 1.0, "capacitance_gain": 1.0}


def _ideal(values: Mapping[str, FloatArray], sweep: Sweep) -> dict[str, FloatArray]:
    """Draws of such instruments for one sweep."""
    n_draw = next(iter(values.values())).size
    return {str(UnknownName(p, sweep.specimen, sweep.name)): np.full(n_draw, value) for p, value in _IDEAL.items()}


def _force_fit(
    parts: _Parts, sweep: Sweep, points: Points, at_data: Sequence[PredictedReadings], rng: np.random.Generator
) -> ChannelFit:
    assert points.displacement is not None
    grid = np.linspace(np.min(points.displacement), np.max(points.displacement), _N_GRID)
    order = np.argsort(points.displacement)
    # The load matters here only through the machine's compliance: that of the data, interpolated, is good enough.
    load = np.interp(grid, points.displacement[order], points.value[order])
    along = replace(sweep, channels={"force": Points(load, np.ones(_N_GRID), displacement=grid)})
    dense = _modelled(parts, plan_sweep(along))
    return ChannelFit(_bands(grid, dense.channels.get("force"), rng), _check(points.displacement, at_data))


def _over_load(parts: _Parts, sweep: Sweep, channel: str, load: FloatArray) -> _Modelled:
    """Predict a channel of a sweep at given load cell readings [N], in whichever way its own readings were tied to depth."""
    points = Points(np.zeros(load.size), np.ones(load.size), force=load)
    along = replace(sweep, channels={channel: points}, track=None)
    return _modelled(parts, plan_sweep(along))


def _instruments(parts: _Parts, sweep: Sweep) -> tuple[FloatArray, ...]:
    """Draws of C0 [F] of a sweep, and of the faults of its instruments in the order of `_IDEAL`, each (n_draw,)."""
    designs = (specimen_design(member.posterior, values, sweep.specimen, sweep.name) for member, values in parts)
    c0 = np.concatenate([np.atleast_1d(np.asarray(design.rest_capacitance, dtype=float)) for design in designs])
    return c0, *(_all_draws(parts, p, sweep, otherwise) for p, otherwise in _IDEAL.items())


def _all_draws(parts: _Parts, parameter: str, sweep: Sweep, otherwise: float) -> FloatArray:
    """Draws of a quantity of a sweep by all models, (n_draw,), with another value where a model does not have it."""
    found = []
    for _, values in parts:
        own = lookup(values, parameter, sweep.specimen, sweep.name)
        found.append(np.full(next(iter(values.values())).size, otherwise) if own is None else own)
    return np.concatenate(found)


def _loads(parts: _Parts, sweep: Sweep, channel: str) -> FloatArray:
    """Load cell reading [N] at the points of a channel, (n_point,): as read, or by clock or crosshead from the tester's record.

    Where no load was recorded at all, the model's load at the medians of the posterior takes its place, of several models that
    of most weight.
    """
    points = sweep.channels[channel]
    if points.force is not None:
        return points.force
    if sweep.tied_by(channel) == "clock" and points.time is not None and sweep.track is not None:
        late = float(np.median(_all_draws(parts, "clock_offset", sweep, 0.0)))
        return np.asarray(np.interp(points.time + late, sweep.track.time, sweep.track.force), dtype=float)
    assert points.displacement is not None
    tester = sweep.channels.get("force")
    if tester is not None and tester.displacement is not None:
        order = np.argsort(tester.displacement)
        return np.asarray(np.interp(points.displacement, tester.displacement[order], tester.value[order]), dtype=float)
    member, values = max(parts, key=lambda part: part[0].weight)
    middle = {k: np.array([np.median(v)]) for k, v in values.items()}
    offset, gain = (lookup(middle, name, sweep.specimen, sweep.name) for name in ("contact_offset", "displacement_gain"))
    travel = points.displacement - (0.0 if offset is None else float(offset[0]))
    depth = np.maximum(travel / (1.0 if gain is None else float(gain[0])), 0.0)
    response = member.forward.respond(specimen_design(member.posterior, middle, sweep.specimen, sweep.name), depth[None, :])
    return np.asarray(response.force[0], dtype=float)


def _bands(
    x: FloatArray, channel: Sequence[PredictedReadings] | None, rng: np.random.Generator, rest: FloatArray | None = None
) -> Bands:
    """Bands of a channel at x (n_x,); with `rest` C0 (n_draw, 1) those of C/C0 - 1.

    One stratified standard normal per draw: exact at each x, and smooth along x.
    """
    if not channel:
        return Bands(x, np.full((5, x.size), np.nan), np.full((5, x.size), np.nan))
    mean, sd = _moments(channel)
    if rest is not None:
        mean, sd = mean / rest - 1, sd / rest
    n = mean.shape[0]
    normal = ndtri((rng.permutation(n) + 0.5) / n)
    return Bands(x, band(mean), band(mean + sd * normal[:, None]))


def _moments(channel: Sequence[PredictedReadings]) -> tuple[FloatArray, FloatArray]:
    """Mean and standard deviation of each reading under each draw of all models, (n_covered, n_point)."""
    return np.concatenate([part.mean for part in channel]), np.concatenate([part.sd for part in channel])


def _check(x: FloatArray, channel: Sequence[PredictedReadings]) -> FitCheck:
    y, (mean, spread) = channel[0].observed, _moments(channel)
    n = y.size
    p_values = np.concatenate([chdtrc(n, chi_square(part)) for part in channel])
    centre = np.mean(mean, axis=0)
    sd = np.sqrt(np.mean(spread**2, axis=0) + np.var(mean, axis=0))
    residual = (y - centre) / sd
    inside = float(np.mean(np.abs(residual) <= ndtri(0.95)))
    return FitCheck(x, y, centre, sd, residual, inside, float(np.mean(p_values)))
