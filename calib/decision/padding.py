"""From a posterior and a requirement to the padding to build: which thickness is most probably near the best, and how sure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from calib.checks import (
    BAND_LEVELS,
    Member,
    Reason,
    Verdict,
    band,
    heaviest,
    judge_posterior,
    members_or,
    verdict_of,
)
from calib.decision.along import along
from calib.decision.conditions import COVERED_SHARE, conditions_of, open_models_of, require_within_range
from calib.decision.extrapolation import Aim, Covered, beyond_the_covered, beyond_the_measured, pad_to_press
from calib.decision.recommendation import INTERVAL_PROBABILITY, OfModel, Recommendation, places_of_thickness
from calib.decision.requirement import Requirement
from calib.decision.sensors import ModelDraws, sensors_of, smooth_normals, with_padding
from calib.decision.words import spans_in_words
from calib.digits import span_text
from calib.errors import Fault, InputError
from calib.sampling import Posterior
from models.curves import DesignPrediction, predict_design
from models.response import Forward
from models.sensor import BoolArray, FloatArray, Scalar

# Of fewer draws a model is not said to have a best thickness of its own.
_FEW = 20


def recommend(
    posterior: Posterior,
    forward: Forward,
    requirement: Requirement,
    *,
    seed: int,
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
) -> Recommendation:
    """Recommend a padding thickness for a sensor like those measured, or the next one of their lot, and say how sure that is.

    Each draw of the posterior takes the thicknesses of one specimen (picked at random), so that the spread from specimen to
    specimen is part of the answer; its padding is replaced by each thickness of the grid. Under partial pooling its modulus is
    that of a specimen that was not measured, drawn from lot and spread. The model's own error and the
    discrepancy found in calibration are added as a smooth random function of thickness (correlation exp(-x^2/2) with
    x = ln(h_i/h_j) / ln 1.5, h the total thickness).

    Parameters
    ----------
    posterior : of the calibration.
    forward : the model that predicts, the one of the calibration.
    requirement : what is wanted.
    seed : of the choice of draws and specimens.
    verdict : on the calibration; None to judge the posterior here, without its predictions.
    members : the models that the posterior is an average of, each of which predicts for its own draws; none for one model.

    Returns
    -------
    The recommendation, with a verdict of its own: what speaks against the calibration, and what was not measured.

    Raises
    ------
    InputError
        If no thickness of the request is covered by the model; the message names the range it covers.
    """
    rng = np.random.default_rng(seed)
    models = members_or(members, posterior, forward)
    pooling = posterior.experiment.pooling
    sensors = sensors_of(models, pooling, requirement.n_draw, requirement.indenter_radius, rng, seed)
    measured, parts = sensors.measured, sensors.parts
    grid = np.linspace(requirement.lower, requirement.upper, requirement.n_thickness)
    require_within_range(parts[0], grid)
    # The padding of the measured specimens comes last: its error is the same random function.
    present, sensor = (
        np.concatenate([np.asarray(layer.thickness) for layer in layers])
        for layers in zip(*((part.base.padding, part.base.sensor) for part in measured), strict=True)
    )
    n_draw = present.size
    paddings = np.append(grid, np.median(present))
    error = smooth_normals(float(np.median(sensor)) + paddings, n_draw, rng)
    smooth = ndtri((rng.permutation(n_draw) + 0.5) / n_draw)
    error_now, change = error[:, -1].copy(), error[:, :-1]
    coverage, reach = np.empty(grid.size), np.empty(grid.size)
    bands = {name: np.full((len(BAND_LEVELS), grid.size), np.nan) for name in ("change", "depth", "resolution")}
    for k, at in _along_all(parts, grid, requirement.force):
        coverage[k] = np.mean(np.isfinite(at.change))
        reach[k] = np.quantile(at.reach, 1 - COVERED_SHARE)
        # At each thickness by itself one stratified normal per draw has the same distribution, and the bands come out smooth.
        bands["change"][:, k] = band(at.change + at.sd * smooth)
        bands["depth"][:, k] = band(at.depth)
        with np.errstate(divide="ignore"):  # a signal that does not rise with force resolves nothing: inf
            bands["resolution"][:, k] = 1 / band(at.sensitivity)[::-1]
        change[:, k] = at.change + at.sd * change[:, k]
    covered = coverage >= COVERED_SHARE
    if not np.any(covered):
        raise InputError(_not_covered(requirement, grid, coverage, reach, parts[0]))

    masked = change
    for column in (masked, *bands.values()):
        column[:, ~covered] = np.nan
    best_of_draw = np.max(np.where(np.isfinite(masked), masked, -np.inf), axis=1)
    near = masked >= (best_of_draw - requirement.tolerance * np.abs(best_of_draw))[:, None]  # nan compares as False
    probability = np.where(covered, np.mean(near, axis=0), np.nan)
    share = np.where(covered, np.nanmean(np.where(covered, masked, 0.0) / best_of_draw[:, None], axis=0), -np.inf)
    ties = covered & (np.nan_to_num(probability, nan=-1.0) >= np.nanmax(probability) - 0.5 / n_draw)
    pick = int(np.argmax(np.where(ties, share, -np.inf)))

    now = _joined([_at_padding(part, part.base.padding.thickness, requirement.force) for part in measured])
    change_now = now.change + now.sd * error_now
    gain = band(change[:, pick] / np.where(change_now > 0, change_now, np.nan))
    open_models = open_models_of(posterior)
    radius = float(np.asarray(parts[0].base.indenter.radius)[0])
    depth = float(bands["depth"][2, pick])
    known_best = heaviest(models).posterior
    interval = _run(grid, np.nan_to_num(probability, nan=0.0) >= INTERVAL_PROBABILITY, pick)
    aim = Aim(requirement.force, float(grid[pick]), depth, (radius,), places_of_thickness(interval))
    to_press = float(np.interp(pad_to_press(aim), grid, reach))
    beyond = beyond_the_measured(known_best, aim, Covered(to_press, spans_in_words(grid, covered)))
    unknown = beyond_the_covered(grid, covered, probability, requirement.force, float(np.min(reach)))
    known = judge_posterior(posterior) if verdict is None else verdict
    return Recommendation(
        requirement=requirement,
        indenter_radius=radius,
        thickness=grid,
        coverage=coverage,
        covered=covered,
        change=bands["change"],
        depth=bands["depth"],
        resolution=bands["resolution"],
        probability=probability,
        optimum=_optimum(grid, masked),
        best=float(grid[pick]),
        best_probability=float(probability[pick]),
        interval=interval,
        change_at_best=bands["change"][:, pick],
        depth_at_best=bands["depth"][:, pick],
        resolution_at_best=bands["resolution"][:, pick],
        present_padding=float(np.median(present)),
        present_change=band(now.change + now.sd * smooth),
        gain=gain,
        border=_border(grid, covered, pick),
        conditions=conditions_of(parts, float(np.max(grid[covered])), (radius,)),
        open_models=open_models,
        of_models=tuple(_of_models(posterior, parts, change[:, pick], near, grid)),
        verdict=verdict_of([*known.reasons, *beyond, *unknown, *unresolved(parts, float(grid[pick]), requirement.force)]),
        forward_name=forward.name,
        sensor="next" if sensors.of_next else "measured",
        seed=seed,
        draws_sha256=posterior.draws_sha256,
    )


@dataclass(frozen=True, eq=False)
class _AtPadding:
    """Prediction at one padding thickness, arrays (n_draw,) at one force, or (n_draw, n_load) at several."""

    change: FloatArray
    sd: FloatArray  # of the change, from the model's own error and discrepancy
    depth: FloatArray
    sensitivity: FloatArray  # [1/N], one over the smallest force that one reading distinguishes from noise
    reach: FloatArray  # largest force [N] inside the model's range

    @property
    def columns(self) -> tuple[FloatArray, ...]:
        return self.change, self.sd, self.depth, self.sensitivity, self.reach


def _at_padding(part: ModelDraws, thickness: Scalar, force: float) -> _AtPadding:
    at = at_loads(part, thickness, np.array([force]))
    return _AtPadding(at.change[:, 0], at.sd[:, 0], at.depth[:, 0], at.sensitivity[:, 0], at.reach)


def at_loads(part: ModelDraws, thickness: Scalar, force: FloatArray) -> _AtPadding:
    """Predict what the sensors of a model do on padding of one thickness under several loads.

    Parameters
    ----------
    part : draws of one model.
    thickness : [m], one for all or (n_draw,); where pads are not cast as wanted it is what was wanted.
    force : [N], (n_load,).

    Returns
    -------
    Arrays of shape (n_draw, n_load), `reach` (n_draw,).
    """
    design, own = with_padding(part.base, thickness if part.cast is None else thickness * part.cast), part.own
    p: DesignPrediction = predict_design(part.member.forward, design, force)
    change, slope, error = p.change, p.change_slope, p.change_error
    # Discrepancy of the force at given depth moves the depth at given force, and with it the capacitance.
    sd = np.sqrt(
        error**2 + (own.capacitance_discrepancy[:, None] * change) ** 2 + (slope * own.force_discrepancy[:, None] * force) ** 2
    )
    rise = np.maximum(slope, 0.0) * p.rest_capacitance[:, None]  # dC/dF [F/N]; nan stays nan
    return _AtPadding(change, sd, p.depth, rise / np.maximum(own.noise, 1e-30)[:, None], p.reach)


def unresolved(parts: Sequence[ModelDraws], thickness: float, force: float) -> Iterator[Reason]:
    """Say that a load is less than what one reading of the capacitance tells from none.

    Parameters
    ----------
    parts : draws of each model.
    thickness : [m], of the padding.
    force : [N], the load.
    """
    sensitivity = np.concatenate([_at_padding(part, thickness, force).sensitivity for part in parts])
    told = 1 / float(np.median(sensitivity)) if np.all(sensitivity > 0) else math.nan
    if told > force:
        finding = f"at {force:.4g} N no reading tells that it is pressed: one tells {told:.2g} N from nothing"
        yield Reason("resolution", "amber", finding, "Check the unit of the load; else read with less noise")


def _along_all(parts: Sequence[ModelDraws], grid: FloatArray, force: float) -> Iterator[tuple[int, _AtPadding]]:
    """Predict at each thickness by all models, each for its own draws."""
    for k, columns in enumerate(zip(*(_along(part, grid, force) for part in parts), strict=True)):
        yield k, _AtPadding(*np.concatenate(columns)[:, 0].T)


def _along(part: ModelDraws, grid: FloatArray, force: float) -> Iterator[FloatArray]:
    """Predict at each thickness of an ascending grid: the change to 1e-7, depth and slope to the 5e-5 that a table leaves."""

    def ask(thickness: FloatArray, rows: BoolArray) -> FloatArray:
        some = part if np.all(rows) else part.only(rows)
        return np.stack(_at_padding(some, thickness, force).columns, axis=1)[:, None]

    shift = 0.25 * float(np.median(np.asarray(part.base.sensor.thickness)))
    return along(ask, np.full((part.size, 1), force), grid, shift)


def _joined(at: Sequence[_AtPadding]) -> _AtPadding:
    """The draws of all models, one after the other."""
    return _AtPadding(*(np.concatenate(columns) for columns in zip(*(one.columns for one in at), strict=True)))


def _optimum(grid: FloatArray, change: FloatArray) -> FloatArray:
    """Thickness [m] of the largest change of each draw, by the parabola through the grid's maximum and its neighbours."""
    filled = np.where(np.isfinite(change), change, -np.inf)
    i = np.argmax(filled, axis=1)
    beside = np.stack([filled[np.arange(i.size), np.clip(i + k, 0, grid.size - 1)] for k in (-1, 0, 1)])
    inner = np.flatnonzero((i > 0) & (i < grid.size - 1) & np.all(np.isfinite(beside), axis=0))
    left, middle, right = beside[:, inner]
    bend = left - 2 * middle + right
    shift = np.zeros(i.size)
    shift[inner] = np.divide(0.5 * (left - right), bend, out=np.zeros(inner.size), where=bend < 0)
    return np.asarray(grid[i] + shift * (grid[1] - grid[0]), dtype=float)


def _run(grid: FloatArray, good: BoolArray, at: int) -> tuple[float, float] | None:
    """The unbroken run of `good` around index `at`."""
    if not good[at]:
        return None
    lo = hi = at
    while lo > 0 and good[lo - 1]:
        lo -= 1
    while hi < grid.size - 1 and good[hi + 1]:
        hi += 1
    return float(grid[lo]), float(grid[hi])


def _border(grid: FloatArray, covered: BoolArray, pick: int) -> str:
    mm = grid * 1e3
    for end, step, side in ((0, -1, "thinner"), (grid.size - 1, 1, "thicker")):
        if pick == end:
            tail = (
                "no padding is the end of what can be built."
                if mm[end] == 0
                else f"{side} padding may do better: ask for a wider range."
            )
            return f"It lies at the border of the asked range ({mm[0]:.3g} to {mm[-1]:.3g} mm); {tail}"
        if not covered[pick + step]:
            return (
                f"It lies at the border of what the model covers ({mm[covered][0]:.3g} to {mm[covered][-1]:.3g} mm at this "
                f"force); {side} padding may do better, the model cannot tell."
            )
    return ""


def _not_covered(
    requirement: Requirement,
    grid: FloatArray,
    coverage: FloatArray,
    reach: FloatArray,
    part: ModelDraws,
) -> Fault:
    mm, forward, base = grid * 1e3, part.member.forward, part.base
    ends = float(mm[0]), float(mm[-1])
    top = int(np.argmax(reach))
    if reach[top] <= 0:
        why = forward.outside(with_padding(base, grid[grid.size // 2]), np.zeros(1)) or "the sensor itself lies outside"
        message = f"the {forward.name} covers no padding from {span_text(*ends)} mm for this sensor: {why}"
        return Fault(message, advice="Ask for other thicknesses, or calibrate and recommend with another model.")
    message = (
        f"the {forward.name} reaches {requirement.force:g} N at no padding from {span_text(*ends)} mm that was "
        f"tried for this sensor; it covers forces up to {reach[0]:.3g} N at {mm[0]:.3g} mm and up to "
        f"{reach[-1]:.3g} N at {mm[-1]:.3g} mm "
        f"(most: {reach[top]:.3g} N at {mm[top]:.3g} mm), counting thicknesses where {COVERED_SHARE * 100:g} % of the draws "
        f"are covered (here at best {np.max(coverage) * 100:.0f} %)"
    )
    return Fault(message, advice=f"Ask for a force below {reach[top]:.3g} N or for other thicknesses.")


def _of_models(
    posterior: Posterior, parts: Sequence[ModelDraws], change: FloatArray, near: BoolArray, grid: FloatArray
) -> Iterator[OfModel]:
    """What each model of an average says by itself: nothing for one model.

    `change` (n_draw,) is that at the recommended thickness, `near` (n_draw, n_thickness) whether a thickness is near the best.
    """
    draws = np.split(np.arange(change.size), np.cumsum([np.size(part.base.sensor.thickness) for part in parts])[:-1])
    rows = {part.member.name: own for part, own in zip(parts, draws, strict=True)}
    for model in posterior.diagnostics.models:
        own = rows.get(model.name, np.empty(0, dtype=int))
        known = own[np.isfinite(change[own])]
        told = known.size >= _FEW
        found = model.young_modulus
        yield OfModel(
            name=model.name,
            model=model.model,
            weight=model.weight,
            n_draw=int(known.size),
            change=(float(np.mean(change[known])), float(np.std(change[known]))) if known.size else (math.nan, math.nan),
            best=float(grid[np.argmax(np.mean(near[known], axis=0))]) if told else math.nan,
            young_modulus=(math.nan, math.nan) if found is None else (found.mean, found.sd),
        )
