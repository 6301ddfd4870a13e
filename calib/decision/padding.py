"""From a posterior and a requirement to the padding to build: which thickness is most probably near the best, and how sure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from calib.checks import (
    BAND_LEVELS,
    RULED_OUT,
    Member,
    Verdict,
    band,
    departure_in_words,
    drawn,
    heaviest,
    judge_posterior,
    members_or,
    verdict_of,
)
from calib.decision.extrapolation import beyond_the_measured
from calib.decision.next_specimen import as_next_specimen, padding_about_mean
from calib.decision.recommendation import INTERVAL_PROBABILITY, OfModel, Recommendation
from calib.decision.requirement import Requirement
from calib.errors import Fault, InputError
from calib.experiment import Experiment
from calib.problem import lookup, specimen_design
from calib.sampling import Posterior
from models.analytic import caution
from models.curves import DesignPrediction, predict_design
from models.response import Forward
from models.sensor import BoolArray, Design, FloatArray, Scalar, design_from

#: A thickness is covered when at least this share of the draws stays inside the model's range.
COVERED_SHARE = 0.95
# Stream of random numbers beside the seed's, for the specimen that was not measured.
_NEXT = 3
# The error of a model is alike for alike designs: its correlation falls off over this factor in total thickness.
_ERROR_FACTOR = 1.5

# Thicknesses of a grid up to which each is asked of the model; knots between which a finer one is interpolated, with
# polynomials through so many of them; thicknesses held at once.
_N_KNOTS = 97
_ORDER = 6
_COLUMNS = 64

# Of fewer draws a model is not said to have a best thickness of its own.
_FEW = 20


def recommend(
    posterior: Posterior,
    forward: Forward,
    requirement: Requirement,
    *,
    seed: int,
    posterior_sha256: str = "",
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
) -> Recommendation:
    """Recommend a padding thickness for a sensor like those measured, or the next one of their lot, and say how sure that is.

    Each draw of the posterior takes the thicknesses of one specimen (picked at random), so that the spread from specimen to
    specimen is part of the answer; its padding is replaced by each thickness of the grid. Under partial pooling it is one
    that was not measured: its modulus, permittivity and thicknesses are drawn from lot and spread, and its padding is as thick
    as the grid says on average, and scatters as that of the lot does. The model's own error and the
    discrepancy found in calibration are added as a smooth random function of thickness (correlation exp(-x^2/2) with
    x = ln(h_i/h_j) / ln 1.5, h the total thickness).

    Parameters
    ----------
    posterior : of the calibration.
    forward : the model that predicts, the one of the calibration.
    requirement : what is wanted.
    seed : of the choice of draws and specimens.
    posterior_sha256 : hash of the posterior's file, kept with the result as a mark of the posterior that it follows from.
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
    chosen = drawn(models, requirement.n_draw, rng)
    measured = [
        _Part(member, *_sensors_like_those_measured(member.posterior, values, requirement, rng)) for member, values in chosen
    ]
    parts, of_next = measured, posterior.experiment.pooling == "partial"
    if of_next:
        own = np.random.default_rng([seed, _NEXT])
        parts = []
        for member, values in chosen:
            lots = member.posterior.table.lots
            following = as_next_specimen(values, lots, own)
            made = _sensors_like_those_measured(member.posterior, following, requirement, own)
            parts.append(_Part(member, *made, padding_about_mean(values, following, lots)))
    grid = np.linspace(requirement.lower, requirement.upper, requirement.n_thickness)
    # The padding of the measured specimens comes last: its error is the same random function.
    present, sensor = (
        np.concatenate([np.asarray(layer.thickness) for layer in layers])
        for layers in zip(*((part.base.padding, part.base.sensor) for part in measured), strict=True)
    )
    n_draw = present.size
    paddings = np.append(grid, np.median(present))
    error = _smooth_normals(float(np.median(sensor)) + paddings, n_draw, rng)
    smooth = ndtri((rng.permutation(n_draw) + 0.5) / n_draw)[:, None]
    error_now, change = error[:, -1].copy(), error[:, :-1]
    coverage, reach = np.empty(grid.size), np.empty(grid.size)
    bands = {name: np.full((len(BAND_LEVELS), grid.size), np.nan) for name in ("change", "depth", "resolution")}
    for columns, at in _along_all(parts, grid, requirement.force):
        coverage[columns] = np.mean(np.isfinite(at.change), axis=0)
        reach[columns] = np.quantile(at.reach, 1 - COVERED_SHARE, axis=0)
        # At each thickness by itself one stratified normal per draw has the same distribution, and the bands come out smooth.
        bands["change"][:, columns] = band(at.change + at.sd * smooth)
        bands["depth"][:, columns] = band(at.depth)
        with np.errstate(divide="ignore"):  # a signal that does not rise with force resolves nothing: inf
            bands["resolution"][:, columns] = 1 / band(at.sensitivity)[::-1]
        change[:, columns] = at.change + at.sd * change[:, columns]
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
    open_models = _open_models(posterior)
    radius = float(np.asarray(parts[0].base.indenter.radius)[0])
    depth = float(bands["depth"][2, pick])
    known_best = heaviest(models).posterior
    beyond = beyond_the_measured(known_best, requirement.force, float(grid[pick]), depth, radius)
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
        interval=_run(grid, np.nan_to_num(probability, nan=0.0) >= INTERVAL_PROBABILITY, pick),
        change_at_best=bands["change"][:, pick],
        depth_at_best=bands["depth"][:, pick],
        resolution_at_best=bands["resolution"][:, pick],
        present_padding=float(np.median(present)),
        present_change=band(now.change + now.sd * smooth[:, 0]),
        gain=gain,
        border=_border(grid, covered, pick),
        conditions=_conditions(parts, float(np.max(grid[covered]))),
        open_models=open_models,
        of_models=tuple(_of_models(posterior, parts, change[:, pick], near, grid)),
        verdict=verdict_of([*known.reasons, *beyond]),
        forward_name=forward.name,
        sensor="next" if of_next else "measured",
        seed=seed,
        posterior_sha256=posterior_sha256,
    )


@dataclass(frozen=True, eq=False)
class _Own:
    """Draws of what is not part of a design: capacitance noise [F] and discrepancies [1], each (n_draw,)."""

    noise: FloatArray
    force_discrepancy: FloatArray
    capacitance_discrepancy: FloatArray

    def only(self, rows: BoolArray) -> _Own:
        return _Own(self.noise[rows], self.force_discrepancy[rows], self.capacitance_discrepancy[rows])


@dataclass(frozen=True, eq=False)
class _Part:
    """The draws of one model: a design of each, what is not part of it, and its padding over what was wanted, (n_draw,)."""

    member: Member
    base: Design
    own: _Own
    cast: FloatArray | None = None  # None: as wanted

    def only(self, rows: BoolArray) -> _Part:
        return _Part(self.member, self.base.only(rows), self.own.only(rows), None if self.cast is None else self.cast[rows])


@dataclass(frozen=True, eq=False)
class _AtPadding:
    """Prediction at one force and one padding thickness, arrays (n_draw,), or at several, (n_draw, n_thickness)."""

    change: FloatArray
    sd: FloatArray  # of the change, from the model's own error and discrepancy
    depth: FloatArray
    sensitivity: FloatArray  # [1/N], one over the smallest force that one reading distinguishes from noise
    reach: FloatArray  # largest force [N] inside the model's range

    @property
    def columns(self) -> tuple[FloatArray, ...]:
        return self.change, self.sd, self.depth, self.sensitivity, self.reach


def _sensors_like_those_measured(
    posterior: Posterior, values: Mapping[str, FloatArray], requirement: Requirement, rng: np.random.Generator
) -> tuple[Design, _Own]:
    """Make one design per draw, with the thicknesses of one specimen, and collect the draw's noise and discrepancies."""
    specimens = posterior.experiment.specimens
    n_draw = next(iter(values.values())).size
    turn = rng.permutation(np.arange(n_draw) % len(specimens))
    picked: dict[str, FloatArray] = {}
    carried = {k: np.zeros(n_draw) for k in ("capacitance_noise", "force_discrepancy", "capacitance_discrepancy")}
    for i, specimen in enumerate(specimens):
        sweep = specimen.sweeps[0].name
        design = specimen_design(posterior, values, specimen.name, sweep).draws()
        for name, value in design.parameters().items():
            column = np.broadcast_to(np.asarray(value, dtype=float), (n_draw,))
            picked[name] = np.where(turn == i, column, picked.get(name, column))
        for name in carried:
            known = lookup(values, name, specimen.name, sweep)
            column = np.full(n_draw, np.nan) if known is None else known
            carried[name] = np.where(turn == i, column, carried[name])
    if requirement.indenter_radius is not None:
        picked["indenter_radius"] = np.full(n_draw, requirement.indenter_radius)
    own = _Own(
        carried["capacitance_noise"],
        np.nan_to_num(carried["force_discrepancy"]),
        np.nan_to_num(carried["capacitance_discrepancy"]),
    )
    return design_from(picked, base=posterior.experiment.base), own


def _with_padding(design: Design, thickness: Scalar) -> Design:
    n_draw = np.size(design.sensor.thickness)
    return replace(design, padding=replace(design.padding, thickness=np.broadcast_to(np.asarray(thickness, float), (n_draw,))))


def _at_padding(part: _Part, thickness: Scalar, force: float) -> _AtPadding:
    design, own = _with_padding(part.base, thickness if part.cast is None else thickness * part.cast), part.own
    p: DesignPrediction = predict_design(part.member.forward, design, np.array([force]))
    change, slope, error = p.change[:, 0], p.change_slope[:, 0], p.change_error[:, 0]
    # Discrepancy of the force at given depth moves the depth at given force, and with it the capacitance.
    sd = np.sqrt(error**2 + (own.capacitance_discrepancy * change) ** 2 + (slope * own.force_discrepancy * force) ** 2)
    rise = np.maximum(slope, 0.0) * p.rest_capacitance  # dC/dF [F/N]; nan stays nan
    return _AtPadding(change, sd, p.depth[:, 0], rise / np.maximum(own.noise, 1e-30), p.reach)


def _along_all(parts: Sequence[_Part], grid: FloatArray, force: float) -> Iterator[tuple[slice, _AtPadding]]:
    """Predict at each thickness by all models, each for its own draws."""
    for found in zip(*(_along(part, grid, force) for part in parts), strict=True):
        yield found[0][0], _joined([at for _, at in found])


def _along(part: _Part, grid: FloatArray, force: float) -> Iterator[tuple[slice, _AtPadding]]:
    """Predict at each thickness of an ascending grid, some columns of it at a time.

    Where the grid is finer than designs change along it, they are asked at `_N_KNOTS` thicknesses h_k, at equal steps of
    log(h + h_s / 4), and what lies between follows by polynomials through six of them: the change to 1e-7, depth and slope to
    the 5e-5 that the table of forces leaves. Draws of which some of the six are covered and others not are asked there.
    """
    if grid.size <= _N_KNOTS:
        for k, thickness in enumerate(grid):
            yield slice(k, k + 1), _stacked([_at_padding(part, thickness, force)])
        return
    shift = 0.25 * float(np.median(np.asarray(part.base.sensor.thickness)))
    along = np.linspace(np.log(grid[0] + shift), np.log(grid[-1] + shift), _N_KNOTS)
    knots = np.clip(np.exp(along) - shift, grid[0], grid[-1])
    at_knots = _stacked([_at_padding(part, thickness, force) for thickness in knots])
    place = (np.log(grid + shift) - along[0]) / (along[1] - along[0])
    first = np.clip(np.floor(place).astype(int) - _ORDER // 2 + 1, 0, _N_KNOTS - _ORDER)
    for begin in range(0, grid.size, _COLUMNS):
        columns = slice(begin, min(begin + _COLUMNS, grid.size))
        found = []
        for k in range(columns.start, columns.stop):
            around = slice(first[k], first[k] + _ORDER)
            weights = _lagrange(place[k] - first[k])
            one = _AtPadding(*(column[:, around] @ weights for column in at_knots.columns))
            known = np.isfinite(at_knots.change[:, around])
            border = np.any(known, axis=1) & ~np.all(known, axis=1)
            found.append(_with_border(one, border, part, grid[k], force) if np.any(border) else one)
        yield columns, _stacked(found)


def _with_border(one: _AtPadding, border: BoolArray, part: _Part, thickness: float, force: float) -> _AtPadding:
    """The same prediction with the draws at the `border` of what is covered asked of the model."""
    exact = _at_padding(part.only(border), thickness, force)
    columns = []
    for column, known in zip(one.columns, exact.columns, strict=True):
        whole = column.copy()
        whole[border] = known
        columns.append(whole)
    return _AtPadding(*columns)


def _stacked(at: Sequence[_AtPadding]) -> _AtPadding:
    return _AtPadding(*(np.stack(columns, axis=1) for columns in zip(*(one.columns for one in at), strict=True)))


def _joined(at: Sequence[_AtPadding]) -> _AtPadding:
    """The draws of all models, one after the other."""
    return _AtPadding(*(np.concatenate(columns) for columns in zip(*(one.columns for one in at), strict=True)))


def _lagrange(x: float) -> FloatArray:
    """Weights of the values at 0, 1, ... `_ORDER` - 1 in the polynomial through them at x."""
    nodes = np.arange(_ORDER)
    return np.array([np.prod([(x - m) / (k - m) for m in nodes if m != k]) for k in nodes])


def _smooth_normals(total_thickness: FloatArray, n_draw: int, rng: np.random.Generator) -> FloatArray:
    """Standard normals smooth along thickness, (n_draw, n_thickness)."""
    x = np.log(np.maximum(total_thickness, 1e-9)) / np.log(_ERROR_FACTOR)
    value, vector = np.linalg.eigh(np.exp(-0.5 * (x[:, None] - x[None, :]) ** 2))
    root = vector * np.sqrt(np.maximum(value, 0.0))
    return np.asarray(rng.standard_normal((n_draw, x.size)) @ root.T, dtype=float)


def _optimum(grid: FloatArray, change: FloatArray) -> FloatArray:
    """Thickness [m] of the largest change of each draw, by the parabola through the grid's maximum and its neighbours."""
    filled = np.where(np.isfinite(change), change, -np.inf)
    i = np.argmax(filled, axis=1)
    row = np.arange(i.size)
    left, middle, right = (filled[row, np.clip(i + k, 0, grid.size - 1)] for k in (-1, 0, 1))
    inner = (i > 0) & (i < grid.size - 1) & np.isfinite(left) & np.isfinite(right)
    with np.errstate(invalid="ignore"):  # of a draw of which no thickness is covered
        bend = np.where(inner, left - 2 * middle + right, -1.0)
    shift = np.where(inner & (bend < 0), 0.5 * (np.where(inner, left - right, 0.0)) / np.where(bend < 0, bend, -1.0), 0.0)
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
    part: _Part,
) -> Fault:
    mm, forward, base = grid * 1e3, part.member.forward, part.base
    top = int(np.argmax(reach))
    if reach[top] <= 0:
        why = forward.outside(_with_padding(base, grid[grid.size // 2]), np.zeros(1)) or "the sensor itself lies outside"
        message = f"the {forward.name} covers no padding from {mm[0]:.3g} to {mm[-1]:.3g} mm for this sensor: {why}"
        return Fault(message, advice="Ask for other thicknesses, or calibrate and recommend with another model.")
    message = (
        f"the {forward.name} reaches {requirement.force:g} N at no padding from {mm[0]:.3g} to {mm[-1]:.3g} mm for this "
        f"sensor; it covers forces up to {reach[0]:.3g} N at {mm[0]:.3g} mm and up to {reach[-1]:.3g} N at {mm[-1]:.3g} mm "
        f"(most: {reach[top]:.3g} N at {mm[top]:.3g} mm), counting thicknesses where {COVERED_SHARE * 100:g} % of the draws "
        f"are covered (here at best {np.max(coverage) * 100:.0f} %)"
    )
    return Fault(message, advice=f"Ask for a force below {reach[top]:.3g} N or for other thicknesses.")


def _open_models(posterior: Posterior) -> tuple[str, ...]:
    """Models that the data have not ruled out, if any were held against them: what an answer under this one cannot know."""
    return tuple(departure_in_words(d, posterior) for d in posterior.diagnostics.departures if d.log_bayes > RULED_OUT)


def _of_models(
    posterior: Posterior, parts: Sequence[_Part], change: FloatArray, near: BoolArray, grid: FloatArray
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


def _conditions(parts: Sequence[_Part], thickest: float) -> tuple[str, ...]:
    """What the recommendation holds for: what all models take for granted, and in what they differ."""
    radius = np.concatenate([np.asarray(part.base.electrode_radius) for part in parts]) * 1e3
    spread = f"{np.median(radius):.3g} mm"
    if np.ptp(radius) > 1e-6:
        spread = (
            f"{np.median(radius):.3g} mm (90 % interval {np.quantile(radius, 0.05):.3g} to {np.quantile(radius, 0.95):.3g} mm)"
        )
    rough = [caution(part.member.forward, _with_padding(part.base, thickest)) for part in parts]
    ball = f"ball radius {float(np.asarray(parts[0].base.indenter.radius)[0]) * 1e3:.3g} mm"
    choices = [_choices(part.member.posterior.experiment) for part in parts]
    base, contact, padding = (" or ".join(dict.fromkeys(words)) for words in zip(*choices, strict=True))
    return (
        *dict.fromkeys(f"a first look alone: {words}" for words in rough if words),
        base,
        f"electrode radius {spread}: another electrode needs its own recommendation",
        f"{ball}, {contact}",
        padding,
    )


def _choices(e: Experiment) -> tuple[str, str, str]:
    """Base, contact and padding of an experiment as conditions."""
    base = (
        "padding bonded to the rigid base: on a slippery base the sensor is softer and the optimum moves"
        if e.base == "bonded"
        else "padding that slides on the rigid base: on a bonded one the sensor is stiffer and the optimum moves"
    )
    contact = "sticking to the sensor" if e.stick else "pressed with friction" if e.rubs else "pressed without friction"
    padding = (
        "padding of the sensor's own silicone"
        if e.padding_material == "sensor"
        else "padding of its own material, with the modulus found for it"
    )
    return base, contact, padding
