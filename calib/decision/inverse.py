"""A posterior and a gripper in, what force its readings mean out: tables for every specimen, the next one, and a design.

A gripper reads c = C(F) + C_p + error, C_p of its leads. At power-on, unloaded, it keeps c0, the mean of n readings, and takes

    r = c / c0 - 1 = x kappa + error,   x = C(F) / C0 - 1,   kappa = C0 / (C0 + C_p)                                        (1)

so that gain and slow drift of its electronics cancel, and C_p remains in the denominator. Of each draw the reading at a force F
is normal about x kappa, with the standard deviation s_r of

    s_r^2 = kappa^2 [e^2 + (delta_C x)^2 + (x' delta_F F)^2] + s^2 [1 + (1 + x kappa)^2 / n] / (C0 + C_p)^2                 (2)

from the model's own error e, the discrepancies, and the noise s of a reading and of the tare. Over the draws this is a mixture;
with its quantiles q_p(F) a reading r means

    force: first F with q_50(F) >= r;   lower: first F with q_95(F) >= r;   upper: last F with q_5(F) <= r                  (3)

A force lies between lower and upper exactly if its reading lies between q_5 and q_95 at that force: whatever the force is, that
has a probability of 90 %, or more where the reading does not grow with force everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from calib.checks import (
    Member,
    Reason,
    Verdict,
    drawn,
    heaviest,
    judge_posterior,
    members_or,
    verdict_of,
)
from calib.decision.conditions import open_models_of
from calib.decision.extrapolation import MARGIN, Aim, Covered, beyond, largest_on, measured_presses
from calib.decision.force_table import N_ROW, ForceTable, GripperTables, Kind, WorkingPoint
from calib.decision.gripper import LEVEL, Gripper
from calib.decision.readable import SensorDraws, measured_sensor, next_sensor
from calib.decision.retreat import RetreatBand, Retreats, band_of, why_no_band
from calib.digits import with_uncertainty
from calib.errors import Fault, InputError
from calib.sampling import FINGERPRINT, Posterior
from models.analytic import caution
from models.curves import curves_of, predict_design
from models.response import Asked, Forward
from models.sensor import FloatArray, Scalar

#: A force is covered when at least this share of the draws reaches it inside the model's range.
COVERED_SHARE = 0.975
# Forces of a curve, and how many times the rated force it is looked at.
_N_FORCE, _LOOK = 129, 3.0
# Standard deviations of the noise below rest that no noise explains.
_NO_NOISE = 5.0
# Rows lie closer where readings are small: at powers of equal steps.
_POWER = 1.4
# Part of the range that has to lie above the noise, the least signal, and the least step between rows at rest: a table of
# integers counts billionths.
_LEAST_PART, _LEAST_SIGNAL, _LEAST_STEP = 1e-3, 1e-5, 1e-8
# Paddings that differ by more than this factor make sensors that have little in common.
_ALIKE = 1.5
# Leads of so many times the sensor's own capacitance are looked at twice: a unit may be wrong.
_MOST_LEADS = 10.0
# What measuring the padding must take off the error of a force for it to be said.
_WORTH_MEASURING = 0.1
# Shares of the rated force at which a sensor is described.
_POINTS = (0.1, 0.25, 0.5, 0.75, 1.0)
# Stream of random numbers beside the seed's, of specimens that were not measured.
_NEXT = 5
_LOW, _HIGH = (1 - LEVEL) / 2, (1 + LEVEL) / 2


def invert(
    posterior: Posterior,
    forward: Forward,
    gripper: Gripper,
    *,
    seed: int = 1,
    posterior_sha256: str = "",
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
    advised: float | None = None,
    retreats: Retreats | None = None,
) -> GripperTables:
    """Turn a calibration round: what force a reading of a gripper means, and how sure that is.

    There is a table for each specimen that was measured, one for the next of the same lot, and, if the gripper has a padding,
    one for the next on that. Forces and thicknesses that were not measured are allowed, and the verdict says so.

    Parameters
    ----------
    posterior : of the calibration.
    forward : the model that predicts, the one of the calibration.
    gripper : what reads the sensor.
    seed : of the choice of draws.
    posterior_sha256 : hash of the posterior's file, kept with the result.
    verdict : on the calibration; None to judge the posterior here, without its predictions.
    members : the models that the posterior is an average of; none for one model.
    advised : [N], force that a padding was recommended for; the table of a design that ends before it, as nobody asked for more
        than was measured, says so. None if none was.
    retreats : of each press of each specimen its branches compared (`calib.lab.measure_unloading`), or why they could not be;
        None where nobody looked.

    Returns
    -------
    The tables, with a verdict on each and on all of them.

    Raises
    ------
    InputError
        If no capacitance was measured, the model does not cover a sensor, or a signal does not rise above its noise.
    """
    if not any("capacitance" in sweep.channels for sweep in posterior.sweeps):
        advice = "Calibrate with the files of an LCR meter beside those of the tester"
        raise InputError(Fault("no capacitance was measured in this run: nothing tells what its readings mean", advice=advice))
    rng = np.random.default_rng(seed)
    models = members_or(members, posterior, forward)
    chosen = drawn(models, gripper.n_draw, rng)
    known = judge_posterior(posterior) if verdict is None else verdict
    own = np.random.default_rng([seed, _NEXT])

    capacitive = {sweep.specimen for sweep in posterior.sweeps if "capacitance" in sweep.channels}
    sensors: list[tuple[str, Kind, Sequence[SensorDraws]]] = []
    for specimen in posterior.experiment.specimens:
        if specimen.name in capacitive:
            draws = [measured_sensor(m.posterior, m.forward, values, specimen.name, gripper, rng) for m, values in chosen]
            sensors.append((specimen.name, "specimen", draws))
    following = [
        next_sensor(m.posterior, m.forward, values, m.posterior.parameters, m.posterior.table.lots, gripper, own)
        for m, values in chosen
    ]
    name = "next specimen"
    while name in capacitive:  # which is how somebody called one
        name = f"the {name}"
    sensors.append((name, "next", following))
    if gripper.padding is not None:
        built = [draws.on(gripper.padding) for draws in following]
        sensors.append((f"{name} on {gripper.padding * 1e3:.6g} mm of padding", "design", built))
    presses = measured_presses(heaviest(models).posterior)
    tables = []
    for title, sensor, those in sensors:
        padding = _median([d.design.padding.thickness for d in those])
        rated = gripper.force or float(f"{largest_on(presses, padding):.3g}")
        table = table_of(title, sensor, those, gripper, rated)
        depth = table.points[-1].depth
        aim = Aim(rated, table.padding_thickness, depth, (table.indenter_radius,))
        covered = Covered(_covered(title, those))
        farther = beyond(presses, aim, covered)
        less = _less_than_advised(table, advised, covered) if sensor == "design" and gripper.force is None else ()
        mixed = tuple(_of_several(table, [press.padding for press in presses])) if sensor == "next" else ()
        judged = verdict_of([*known.reasons, *less, *farther, *mixed, *_doubts(table)])
        rough = dict.fromkeys(f"a first look alone: {said}" for d in those if (said := caution(d.forward, d.design)))
        left_open = (f"not ruled out by these data: {said}" for said in open_models_of(posterior))
        those_pressed = [title] if sensor == "specimen" else sorted(capacitive)
        band = band_of(retreats or {}, those_pressed)
        measured = _padding_measured(table, those, gripper) if sensor == "next" and not mixed else ()
        conditions = (
            *_conditions([m.posterior for m, _ in chosen], table, gripper),
            *measured,
            *_on_retreat(band, why_no_band(retreats or {}, those_pressed), sensor),
        )
        tables.append(replace(table, verdict=judged, conditions=(*rough, *left_open, *conditions), retreat=band))
    reasons = dict.fromkeys(reason for found in tables for reason in found.verdict.reasons)
    versions = {k.removeprefix("version of "): v for k, v in posterior.attrs.items() if k.startswith("version of ")}
    return GripperTables(
        gripper=gripper,
        tables=tuple(tables),
        verdict=verdict_of(reasons),
        experiment=posterior.experiment.name,
        forward_name=forward.name,
        seed=seed,
        posterior_sha256=posterior_sha256,
        fingerprint=posterior.attrs.get(FINGERPRINT, ""),
        draws_sha256=posterior.draws_sha256,
        versions=tuple(versions.items()),
    )


def table_of(name: str, sensor: Kind, draws: Sequence[SensorDraws], gripper: Gripper, rated: float) -> ForceTable:
    """Invert the readings of one sensor: equations (1) to (3). Nothing is judged.

    Parameters
    ----------
    name, sensor : as in `ForceTable`.
    draws : what it may be like, by each model.
    gripper : what reads it.
    rated : [N], the largest force that matters; readings beyond it are taken in as far as a margin of a tenth and the model go.

    Returns
    -------
    The table, with a verdict without reasons and no conditions.

    Raises
    ------
    InputError
        If the model does not cover the sensor, or its signal does not rise above the noise.
    """
    covered = _covered(name, draws)
    force = min(covered, _LOOK * rated) * np.linspace(0.0, 1.0, _N_FORCE) ** 2
    limit = min(MARGIN * rated, covered)
    force = np.unique(np.append(force, limit))
    curve = _readings(draws, force, gripper.n_tare)
    low, middle, high = (_quantile(curve, level) for level in (_LOW, 0.5, _HIGH))
    asked = int(np.searchsorted(force, limit * (1 - 1e-12), side="left"))
    top = int(np.argmax(low[: asked + 1]))
    end, last, touch = float(force[top]), float(low[top]), float(high[0])
    if not (1 - _LEAST_PART) * last > touch or last < _LEAST_SIGNAL:
        raise InputError(_lost(name, draws, (float(low[top]), float(middle[top]), float(high[top])), touch, end))
    after = np.flatnonzero(low[top + 1 :] < last)
    first = min(float(np.min(low[: top + 1])), -_LEAST_STEP)
    rows = np.concatenate([[first], last * np.linspace(0.0, 1.0, N_ROW - 1) ** _POWER])
    nearest = 1 + int(np.argmin(np.abs(rows[1:-1] - touch)))
    rows[nearest] = touch
    held = slice(0, top + 1)
    c0 = np.concatenate([np.asarray(d.design.rest_capacitance, dtype=float) for d in draws])
    leads, noise = (np.concatenate([getattr(d, column) for d in draws]) for column in ("parasitic", "noise"))
    at_rest = noise * math.sqrt(1 + 1 / gripper.n_tare) / (c0 + leads)
    nanonewtons = 9  # below which nothing but rounding is
    table = ForceTable(
        name=name,
        sensor=sensor,
        padding_thickness=_median([d.design.padding.thickness for d in draws]),
        indenter_radius=_median([d.design.indenter.radius for d in draws]),
        ratio=rows,
        force=np.round(_first_reached(force[held], middle[held], rows), nanonewtons),
        lower=np.round(_first_reached(force[held], high[held], rows), nanonewtons),
        upper=np.round(_last_left(force[held], low[held], rows), nanonewtons),
        below=-_NO_NOISE * float(np.quantile(at_rest, _HIGH)),
        touch=touch,
        rated=rated,
        end=end,
        looked=float(force[-1]),
        turn=float(force[top + 1 + after[0]]) if after.size else math.nan,
        rest_capacitance=np.quantile(c0, [_LOW, 0.5, _HIGH]),
        tare=np.quantile(c0 + leads, [_LOW, 0.5, _HIGH]),
        parasitic=(float(np.mean(leads)), float(np.std(leads))),
        noise=float(np.median(noise)),
        points=(),
        verdict=Verdict(),
        conditions=(),
    )
    return replace(table, points=tuple(_points(table, draws)))


@dataclass(frozen=True, eq=False)
class _Readings:
    """Mean and standard deviation of the reading r under every draw, (n_draw, n_force); nan where it does not reach a force."""

    mean: FloatArray
    sd: FloatArray


def _readings(draws: Sequence[SensorDraws], force: FloatArray, n_tare: int) -> _Readings:
    """Equations (1) and (2)."""
    means, sds = [], []
    for d in draws:
        p = predict_design(d.forward, d.design, force)
        c0 = p.rest_capacitance[:, None]
        tare = c0 + d.parasitic[:, None]
        kappa = c0 / tare
        mean = kappa * p.change  # (1)
        by_force = np.where(force > 0, p.change_slope * d.force_discrepancy[:, None] * force, 0.0)
        model = p.change_error**2 + (d.capacitance_discrepancy[:, None] * p.change) ** 2 + by_force**2
        noise = (d.noise[:, None] / tare) ** 2 * (1 + (1 + mean) ** 2 / n_tare)
        means.append(mean)
        sds.append(np.sqrt(kappa**2 * np.where(force > 0, model, 0.0) + noise))  # (2)
    return _Readings(np.concatenate(means), np.concatenate(sds))


def _quantile(readings: _Readings, level: float) -> FloatArray:
    """A quantile of the mixture over the draws, (n_force,); draws that do not reach a force count as the farther end."""
    there = np.isfinite(readings.mean)
    mean, sd = np.where(there, readings.mean, 0.0), np.where(there, readings.sd, 1.0)
    share = np.mean(there, axis=0)
    wanted = level if level == 0.5 else (level - (1 - share)) / share if level < 0.5 else level / share
    reach = 9.0
    low = np.min(np.where(there, mean - reach * sd, np.inf), axis=0)
    high = np.max(np.where(there, mean + reach * sd, -np.inf), axis=0)
    for _ in range(50):  # halved, to 1e-15 of the width
        half = 0.5 * (low + high)
        beneath = np.sum(np.where(there, ndtr((half - mean) / sd), 0.0), axis=0) / np.sum(there, axis=0) < wanted
        low, high = np.where(beneath, half, low), np.where(beneath, high, half)
    return np.asarray(0.5 * (low + high), dtype=float)


def _first_reached(force: FloatArray, reading: FloatArray, wanted: FloatArray) -> FloatArray:
    """The first force at which a curve reaches readings: (3), force and lower."""
    so_far = np.maximum.accumulate(reading)
    new = np.concatenate([[True], np.diff(so_far) > 0])
    return np.asarray(np.interp(wanted, so_far[new], force[new]), dtype=float)


def _last_left(force: FloatArray, reading: FloatArray, wanted: FloatArray) -> FloatArray:
    """The last force at which a curve is not above readings: (3), upper."""
    to_come = np.minimum.accumulate(reading[::-1])[::-1]
    last = np.concatenate([np.diff(to_come) > 0, [True]])
    return np.asarray(np.interp(wanted, to_come[last], force[last]), dtype=float)


def _covered(name: str, draws: Sequence[SensorDraws]) -> float:
    """The largest force that so many draws as `COVERED_SHARE` reach inside the range of their models.

    Raises
    ------
    InputError
        If too many are not covered at all.
    """
    reach = np.concatenate([predict_design(d.forward, d.design, np.array([1e-6])).reach for d in draws])
    covered = float(np.quantile(reach, 1 - COVERED_SHARE, method="lower"))
    if covered > 0:
        return covered
    why = next(filter(None, (d.forward.outside(d.design, np.zeros(1)) for d in draws)), "too many of its draws are outside")
    message = f"the {draws[0].forward.name} does not cover {name}: {why}"
    raise InputError(Fault(message, advice="Ask for another padding, or calibrate and export with another model"))


def _lost(name: str, draws: Sequence[SensorDraws], signal: tuple[float, float, float], touch: float, force: float) -> Fault:
    """Why no reading tells anything of a sensor."""
    noise = float(np.median(np.concatenate([d.noise for d in draws])))
    low, middle, high = (f"{x * 1e6:.0f}" for x in signal)
    message = (
        f"no reading of {name} tells that it is pressed: up to {force:.3g} N it rises by {middle} ppm (90 %: {low} to {high}), "
        f"and by {touch * 1e6:.0f} ppm through the noise of {noise * 1e15:.3g} fF alone"
    )
    return Fault(message, advice="Read with less noise, or average readings: --noise is that of what the table is given")


def _points(table: ForceTable, draws: Sequence[SensorDraws]) -> Iterator[WorkingPoint]:
    """Describe a sensor at some of its forces."""
    forces = min(table.rated, table.end) * np.array(_POINTS)
    described = [np.concatenate(columns) for columns in zip(*(_described(d, forces) for d in draws), strict=True)]
    for k, force in enumerate(forces):
        depth, stiffness, ratio, gain, by_capacitance, noise = (column[:, k] for column in described)
        yield WorkingPoint(
            force=float(force),
            depth=float(np.nanmedian(depth)),
            stiffness=_three(stiffness),
            ratio=float(np.nanmedian(ratio)),
            gain=_three(gain),
            capacitance_gain=float(np.nanmedian(by_capacitance)),
            noise=float(np.nanmedian(noise)),
            sigma=float(np.interp(force, *_growing(table.force, table.sigma))),
        )


def _described(draws: SensorDraws, force: FloatArray) -> tuple[FloatArray, ...]:
    """Depth [m], stiffness [N/m], reading [1], gains [1/N], [F/N], and the force that is noise [N], each (n_draw, n_force)."""
    p = predict_design(draws.forward, draws.design, force)
    there = np.isfinite(p.depth)
    some = np.any(there, axis=1)
    at = np.where(there, p.depth, np.nanmin(np.where(some[:, None], p.depth, 0.0), axis=1)[:, None])[some]
    (r,) = curves_of(draws.forward, draws.design.only(some)).press([Asked(np.hstack([0.99 * at, at]), ("force",))])
    stiffness = np.full(p.depth.shape, np.nan)
    stiffness[some] = (r.force[:, force.size :] - r.force[:, : force.size]) / (0.01 * at)
    tare = (p.rest_capacitance + draws.parasitic)[:, None]
    rest = p.rest_capacitance[:, None]
    gain = rest / tare * p.change_slope
    noise = draws.noise[:, None] / tare / np.maximum(gain, 1e-30)
    columns = (p.depth, stiffness, rest / tare * p.change, gain, rest * p.change_slope, noise)
    return tuple(np.where(there, column, np.nan) for column in columns)


def _growing(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points of a table that are no repetition of the one before."""
    new = np.concatenate([[True], np.diff(x) > 0])
    return x[new], y[new]


def _three(values: FloatArray) -> tuple[float, float, float]:
    middle, low, high = np.nanquantile(values, [0.5, _LOW, _HIGH])
    return float(middle), float(low), float(high)


def _median(columns: Sequence[Scalar]) -> float:
    return float(np.median(np.concatenate([np.atleast_1d(np.asarray(column)) for column in columns])))


def _doubts(table: ForceTable) -> Iterator[Reason]:
    """What speaks against a table beside the calibration and what was measured."""
    if table.end < table.rated * (1 - 1e-9):
        shown = f"{table.end:.3g} N" if math.isnan(table.turn) else f"{table.end:.3g} N, where the reading stops rising"
        finding = f"{table.name}: {table.rated:.3g} N were asked for, and the table ends at {shown}"
        yield Reason("range", "amber", finding, "Keep the gripper below, or choose another padding")
    if not math.isnan(table.turn):
        finding = f"{table.name}: from {table.turn:.3g} N on a larger force reads like a smaller one"
        yield Reason("turn", "amber", finding, "Keep such forces from the sensor: no reading tells of them")
    leads, rest = table.parasitic[0], float(table.rest_capacitance[1])
    if leads > _MOST_LEADS * rest:
        finding = (
            f"{table.name}: leads of {leads * 1e12:.4g} pF are {leads / rest:.3g} times its own {rest * 1e12:.4g} pF, and make "
            f"readings {1 + leads / rest:.3g} times smaller"
        )
        yield Reason("leads", "amber", finding, "Look at the unit of --parasitic; if it is right, shorten or guard the leads")


def _of_several(table: ForceTable, paddings: Sequence[float]) -> Iterator[Reason]:
    """That the next specimen may be on the padding of any of those that were measured, which is not one sensor."""
    low, high = min(paddings), max(paddings)
    if high > _ALIKE * low:
        finding = (
            f"{table.name}: the specimens were measured on {low * 1e3:.3g} to {high * 1e3:.3g} mm of padding, and the next one "
            "may be on that of any: its bounds hold all of them"
        )
        yield Reason(
            "padding", "amber", finding, "Say the padding of the sensor that is meant (--padding), and use the table of that"
        )


def _padding_measured(table: ForceTable, draws: Sequence[SensorDraws], gripper: Gripper) -> tuple[str, ...]:
    """What it brings to measure the padding of a sensor that nobody has pressed, in words; nothing where that is little."""
    known = table_of(table.name, "design", [d.on(table.padding_thickness) for d in draws], gripper, table.rated)
    force = 0.5 * min(table.rated, table.end, known.end)
    before, after = (float(np.interp(force, *_growing(t.force, t.sigma))) for t in (table, known))
    if after > (1 - _WORTH_MEASURING) * before:
        return ()
    return (
        f"padding as thick as the priors say: {force:.3g} N are known to {before:.2g} N (one standard deviation), or to "
        f"{after:.2g} N where the padding of the very sensor is measured and given (--padding)",
    )


def _less_than_advised(table: ForceTable, advised: float | None, covered: Covered) -> Iterator[Reason]:
    """That the padding was recommended for a larger force than the table is for.

    It is not made for that force unasked: beyond what was measured a table rests on the model alone, and those of the sensors
    that were measured would lose their green for it.
    """
    if advised is not None and advised > table.rated * (1 + 1e-9):
        finding = (
            f"{table.name}: the recommendation in this run is for {advised:.6g} N, and this table is for {table.rated:.3g} N, "
            "the largest force that was measured"
        )
        action = (
            f'Make it for {advised:.6g} N (--force "{advised:.6g} N") if the gripper is to read such forces, or keep it below'
        )
        yield Reason("range", "amber", finding, action if covered.confirms(advised) else covered.on_it(advised))


def _conditions(posteriors: Sequence[Posterior], table: ForceTable, gripper: Gripper) -> tuple[str, ...]:
    """What a table holds for, in words: of the models of an average, too."""
    experiments = [p.experiment for p in posteriors]
    e = experiments[0]
    who = {
        "specimen": f'the measured specimen "{table.name}", with the padding that it was measured on',
        "next": "a specimen of the same lot that nobody has measured: "
        + (
            "what specimens differ in drawn from the lot"
            if e.pooling == "partial"
            else "layers as the priors have them, the modulus that all specimens were taken to share"
        ),
        "design": "that specimen on padding of exactly this thickness",
    }[table.sensor]
    mean, sd = _leads(posteriors, table, gripper)
    on = " or ".join(dict.fromkeys("bonded to" if e.base == "bonded" else "sliding on" for e in experiments))
    leads = "leads of the lab" if gripper.parasitic is None else "leads as stated"
    beyond = f"{table.end:.4g} N" if math.isnan(table.turn) else f"{table.end:.4g} N; from {table.turn:.4g} N on they fold back"
    return (
        f"sensor: {who}",
        f"ball of {table.indenter_radius * 1e3:.4g} mm radius in the middle: another shape or place is another table",
        f"{table.padding_thickness * 1e3:.4g} mm of padding, {on} a rigid base",
        f"{leads}: they add {with_uncertainty(mean * 1e12, sd * 1e12)} pF; 1 pF more makes every force read "
        f"{100 * _share_of_a_picofarad(table):.1f} % too small",
        f"one reading with a noise of {table.noise * 1e15:.3g} fF, tare the mean of {gripper.n_tare} readings without contact",
        f"made for forces up to {table.rated:.4g} N; it goes on to {beyond}, so that a reading of those has both bounds; "
        f"whether a larger one reads alike was looked at up to {table.looked:.4g} N",
        "temperature and humidity as at power-on: tare again when they change",
        "loading, as slowly as in the lab: relaxation and creep are not covered",
    )


def _leads(posteriors: Sequence[Posterior], table: ForceTable, gripper: Gripper) -> tuple[float, float]:
    """What leads add [F] and its standard deviation, of all draws where it is that of the calibration."""
    known = posteriors[0].diagnostics.parameters.get("parasitic_capacitance") if len(posteriors) == 1 else None
    return table.parasitic if gripper.parasitic is not None or known is None else (known.mean, known.sd)


def _on_retreat(band: RetreatBand | None, why: str, sensor: Kind) -> tuple[str, ...]:
    """What holds while a load is let go, in words."""
    if band is None:
        return (f"unloading is not covered, and by how much it is off is not known{f' ({why})' if why else ''}",)
    other = {
        "specimen": "",
        "next": "; another specimen may differ",
        "design": "; other padding may differ",
    }
    return (f"{band.in_words}{other[sensor]}",)


def _share_of_a_picofarad(table: ForceTable) -> float:
    """By how much a force reads too small at half the range if leads add a picofarad more."""
    r, half = table.ratio, 0.5 * table.largest
    at = float(np.interp(half, *_growing(table.force, r)))
    less = at * float(table.tare[1] / (table.tare[1] + 1e-12))
    return 1 - float(np.interp(less, r, table.force)) / half
