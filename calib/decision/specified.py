"""From a posterior and a specification to its `Conformity`: which padding conforms, how probably, and what stands in the way."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.checks import (
    Member,
    Reason,
    Verdict,
    band,
    heaviest,
    judge_posterior,
    members_or,
    verdict_of,
)
from calib.decision.causes import causes
from calib.decision.choices import Choice, Coordinates, balls_of, choices_of, coordinates_of, require_spread_once
from calib.decision.conditions import COVERED_SHARE, conditions_of, open_models_of
from calib.decision.conformity import Built, Conformity, Needed, OfMember
from calib.decision.extrapolation import MARGIN, beyond_the_measured
from calib.decision.guard_band import Drawing, crossings, guarded, risks
from calib.decision.performance import Errors, Group, Refused, pressed
from calib.decision.recommendation import sensor_in_words
from calib.decision.sensors import Part, Sensors, sensors_of, smooth_normals, with_padding
from calib.errors import Fault, InputError
from calib.experiment import Specification
from calib.sampling import Posterior
from models.response import Forward
from models.sensor import BoolArray, Design, FloatArray

# Streams of random numbers beside the seed's: of what scatters, of the errors of the model.
_SCATTER, _ERRORS = 5, 6
# Of fewer draws a model of an average is not said to have a best thickness of its own; fewer altogether are no answer.
_FEW, _FEWEST = 20, 50
# Pads over which risks are averaged.
_N_PAD = 2001


def conform(
    posterior: Posterior,
    forward: Forward,
    specification: Specification,
    *,
    seed: int,
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
) -> Conformity:
    """Say how probably a sensor on padding of each thickness conforms to a specification, and which to build.

    A draw is one sensor of the posterior, as it would be built: with the tolerances and the spread of the specification, on its
    pad, under its load and its ball, with the model's own error and the discrepancy found in calibration as smooth random
    functions of thickness. It conforms if every limit holds at every load and under every ball. A draw that does not carry a load
    inside the model's range fails.

    Parameters
    ----------
    posterior : of the calibration.
    forward : the model of the calibration.
    specification : what is asked.
    seed : of the choice of draws and of all that scatters.
    verdict : on the calibration; None to judge the posterior here, without its predictions.
    members : the models that the posterior is an average of, each of which predicts for its own draws; none for one model.

    Returns
    -------
    The result, with a verdict of its own: what speaks against the calibration, what was not measured, and an unmet specification.

    Raises
    ------
    InputError
        If the specification does not fit the run, there are too few draws, or no thickness of no sensor is covered by a model.
    """
    pooling = posterior.experiment.pooling
    require_spread_once(specification, pooling)
    rng = np.random.default_rng(seed)
    models = members_or(members, posterior, forward)
    sensors = sensors_of(models, pooling, specification.n_draw, None, rng, seed)
    n_draw = sum(part.size for part in sensors.parts)
    if n_draw < _FEWEST:
        message = f"the posterior has {n_draw} draws, too few to tell a probability of conformity (at least {_FEWEST})"
        raise InputError(Fault(message, advice="Calibrate with more draws"))
    _require_noise(specification, sensors.parts)
    z = coordinates_of(specification, n_draw, np.random.default_rng([seed, _SCATTER]))
    grid = np.linspace(specification.lower, specification.upper, specification.steps)
    errors = _errors(sensors, grid, n_draw, np.random.default_rng([seed, _ERRORS]))
    rows = _rows(sensors.parts)
    n_effective = _effective(posterior, n_draw)
    found: list[_Tried] = []
    left_out: list[Built] = []
    for choices in choices_of(specification):
        groups = [
            pressed(part, specification, choices, {name: own[r] for name, own in z.items()})
            for part, r in zip(sensors.parts, rows, strict=True)
        ]
        refused = next((group for group in groups if isinstance(group, Refused)), None)
        if refused is not None:
            left_out += [_left_out(choice, refused.why, grid, specification) for choice in choices]
            continue
        for tried in _tried([g for g in groups if isinstance(g, Group)], choices, grid, errors, rows, n_effective):
            if math.isfinite(tried.built.best):
                found.append(tried)
            else:
                left_out.append(tried.built)
    if not found:
        raise InputError(_nothing(left_out, specification))
    order = sorted(found, key=lambda tried: (-tried.built.best_probability, tried.built.shortfall[tried.at]))
    best = order[0]
    needed, all_needed = _needed(best, specification)
    known = judge_posterior(posterior) if verdict is None else verdict
    beyond = [*_beyond(models, specification, best, z), *_unmet(best.built, specification)]
    return Conformity(
        specification=specification,
        thickness=grid,
        built=(*(tried.built for tried in order), *left_out),
        drawing=_drawing(best, grid, specification),
        needed=needed,
        all_needed=all_needed,
        causes=causes(_inputs(best, sensors.parts, z, errors), best.worst[:, best.at]),
        of_models=tuple(_of_models(best, models, sensors.parts, rows, grid)) if members else (),
        open_models=open_models_of(posterior),
        conditions=_conditions(best, sensors.parts, specification, grid),
        sensor_in_words=sensor_in_words(of_next=sensors.of_next, spread=specification.modulus_spread > 0),
        n_draw=n_draw,
        n_effective=n_effective,
        seed=seed,
        verdict=verdict_of([*known.reasons, *beyond]),
    )


@dataclass(frozen=True, eq=False)
class _Tried:
    """One sensor that may be built, with its draws.

    Attributes
    ----------
    choice, built : what is chosen, and what is said of it.
    designs : of each model's draws.
    margins : (n_draw, n_thickness, n_limit), see `Performance`.
    reach : (n_draw, n_thickness).
    worst : (n_draw, n_thickness), the smallest margin; where a load is not carried, `reach`. Not below nothing: conforms.
    at : index of the best thickness.
    """

    choice: Choice
    built: Built
    designs: Sequence[Design]
    margins: FloatArray
    reach: FloatArray
    worst: FloatArray
    at: int


def _require_noise(specification: Specification, parts: Sequence[Part]) -> None:
    wanted = any(limit.quantity == "force_resolution" for limit in specification.limits)
    if wanted and not all(np.all(np.isfinite(part.own.noise)) for part in parts):
        message = "force_resolution is limited, but the run knows no noise of a capacitance meter"
        raise InputError(Fault(message, advice="Leave it out, or calibrate with capacitance"))


def _rows(parts: Sequence[Part]) -> list[slice]:
    ends = np.cumsum([0, *(part.size for part in parts)])
    return [slice(int(a), int(b)) for a, b in zip(ends[:-1], ends[1:], strict=True)]


def _errors(sensors: Sensors, grid: FloatArray, n_draw: int, rng: np.random.Generator) -> Errors:
    sensor = np.concatenate([np.asarray(part.base.sensor.thickness) for part in sensors.parts])
    total = float(np.median(sensor)) + grid
    return Errors(*(smooth_normals(total, n_draw, rng) for _ in range(3)))


def _effective(posterior: Posterior, n_draw: int) -> int:
    """How many independent draws those of a posterior are worth."""
    known = [s.ess_bulk for s in posterior.diagnostics.parameters.values() if math.isfinite(s.ess_bulk)]
    return max(1, min(n_draw, round(min(known)))) if known else n_draw


def _tried(
    groups: Sequence[Group],
    choices: Sequence[Choice],
    grid: FloatArray,
    errors: Errors,
    rows: Sequence[slice],
    n_effective: int,
) -> Iterator[_Tried]:
    """Go through the thicknesses, for all choices of a group at once."""
    s = groups[0].specification
    n_draw, shape = rows[-1].stop, (len(choices), rows[-1].stop, grid.size)
    margins, reach = np.empty((*shape, len(s.limits))), np.empty(shape)
    inside, signal, stroke = np.empty(shape, dtype=bool), np.empty(shape), np.empty(shape)
    exact = np.empty((len(choices), grid.size))
    thinnest = min(float(np.min(group.offset)) for group in groups)
    buildable = (grid == 0) | (grid + thinnest >= 0)
    for k, thickness in enumerate(grid):
        if not buildable[k]:
            margins[:, :, k], reach[:, :, k], inside[:, :, k] = np.nan, -1.0, False
            signal[:, :, k], stroke[:, :, k], exact[:, k] = np.nan, np.nan, np.nan
            continue
        for group, own in zip(groups, rows, strict=True):
            for i, at in enumerate(group.at(float(thickness), errors.only(own), k)):
                margins[i, own, k], reach[i, own, k], inside[i, own, k] = at.margins, at.reach, at.inside
                signal[i, own, k], stroke[i, own, k] = at.signal, at.stroke
        if s.padding_tolerance is None:
            exact[:, k] = np.mean(_worst(margins[:, :, k], reach[:, :, k]) >= 0, axis=1)
        else:
            each = [
                [_worst(a.margins, a.reach) for a in g.at(float(thickness), errors.only(own), k, exact=True)]
                for g, own in zip(groups, rows, strict=True)
            ]
            exact[:, k] = [np.mean(np.concatenate(one) >= 0) for one in zip(*each, strict=True)]
    for i, choice in enumerate(choices):
        worst = _worst(margins[i], reach[i])
        covered = np.mean(inside[i], axis=0) >= COVERED_SHARE
        made, at = _summary(
            choice.name, s, grid, covered, margins[i], reach[i], worst, exact[i], signal[i], stroke[i], min(n_effective, n_draw)
        )
        if at is None:
            made = replace(made, left_out=_why_not_covered(groups, i, grid))
        yield _Tried(choice, made, [group.designs[i] for group in groups], margins[i], reach[i], worst, 0 if at is None else at)


def _worst(margins: FloatArray, reach: FloatArray) -> FloatArray:
    """The smallest margin, and where a load is not carried how far that is off."""
    return np.asarray(np.where(reach < 0, reach, np.min(margins, axis=-1)))


def _summary(
    name: str,
    s: Specification,
    grid: FloatArray,
    covered: BoolArray,
    margins: FloatArray,
    reach: FloatArray,
    worst: FloatArray,
    exact: FloatArray,
    signal: FloatArray,
    stroke: FloatArray,
    n_effective: int,
) -> tuple[Built, int | None]:
    """What is said of one sensor, and the index of its best thickness; None where no thickness is covered."""
    known = np.where(covered, 1.0, np.nan)
    conforms = worst >= 0
    probability = np.mean(conforms, axis=0) * known
    # Agresti & Coull's standard error, which is not zero where all draws agree.
    p = (np.mean(conforms, axis=0) * n_effective + 2) / (n_effective + 4)
    error = np.sqrt(p * (1 - p) / (n_effective + 4)) * known
    outside = np.isfinite(margins) & (margins < 0)
    kept = np.sum(outside, axis=2) == 1
    short = np.maximum(-worst, 0.0)
    least = np.min(np.where(covered, short, np.inf), axis=1, initial=np.inf)
    anywhere = np.any(conforms & covered, axis=1)
    left = short - least[:, None] if np.any(covered) else short
    at = None
    if np.any(covered):
        # Of thicknesses that are as probable, the one with most room for the worst draw in twenty.
        room = np.quantile(worst, 0.05, axis=0)
        tied = covered & (np.nan_to_num(probability, nan=-1.0) >= np.nanmax(probability) - 0.5 / len(worst))
        at = int(np.argmax(np.where(tied, room, -np.inf)))
    span = None if at is None else crossings(grid, probability, s.probability, at)
    bands = [np.full((5, grid.size), np.nan) for _ in range(2)]
    for into, value in zip(bands, (signal, stroke), strict=True):
        carried = covered & (np.mean(np.isfinite(value), axis=0) >= COVERED_SHARE)
        into[:, carried] = band(value[:, carried])
    return (
        Built(
            name=name,
            left_out="",
            covered=covered,
            probability=probability,
            error=error,
            exact=exact * known,
            not_carried=np.mean(reach < 0, axis=0) * known,
            fails=np.mean(outside, axis=0).T * known,
            alone=np.mean(outside & kept[:, :, None] & (reach >= 0)[:, :, None], axis=0).T * known,
            shortfall=np.mean(short, axis=0) * known,
            regret=np.mean(left, axis=0) * known,
            avoidable=np.mean(~conforms & anywhere[:, None], axis=0) * known,
            signal=bands[0],
            stroke=bands[1],
            best=math.nan if at is None else float(grid[at]),
            best_probability=math.nan if at is None else float(probability[at]),
            best_error=math.nan if at is None else float(error[at]),
            interval=span,
        ),
        at,
    )


def _left_out(choice: Choice, why: str, grid: FloatArray, s: Specification) -> Built:
    nothing, several = np.full(grid.size, np.nan), np.full((len(s.limits), grid.size), np.nan)
    five = np.full((5, grid.size), np.nan)
    nan = math.nan
    return Built(
        choice.name,
        why,
        np.zeros(grid.size, dtype=bool),
        *(nothing,) * 4,
        several,
        several,
        *(nothing,) * 3,
        five,
        five,
        nan,
        nan,
        nan,
        None,
    )


def _why_not_covered(groups: Sequence[Group], i: int, grid: FloatArray) -> str:
    middle = with_padding(groups[0].designs[i], float(grid[grid.size // 2]))
    forward = groups[0].part.member.forward
    why = forward.outside(middle, np.zeros(1))
    return f"the {forward.name} covers none of these thicknesses for 95 % of the draws" + (f": {why}" if why else "")


def _nothing(left_out: Sequence[Built], s: Specification) -> list[Fault]:
    """Why nothing of what is asked for can be told."""
    asked = f"padding from {s.lower * 1e3:.3g} to {s.upper * 1e3:.3g} mm"
    advice = "Ask for other thicknesses, balls or sensors, or calibrate with another model"
    return [Fault(f"{b.name}, {asked}: {b.left_out}", advice=advice) for b in left_out]


# --- what stands in the way ---------------------------------------------------------------------------------------------


def _needed(best: _Tried, s: Specification) -> tuple[tuple[Needed, ...], float]:
    """What each limit alone would have to be, and by which share all of them together, for the probability asked for."""
    covered = np.flatnonzero(best.built.covered)
    count = math.ceil(s.probability * len(best.worst) - 1e-9)
    columns = covered if best.built.best_probability < s.probability else np.array([best.at])
    found = []
    for index, limit in enumerate(s.limits):
        own = best.margins[:, columns, index]
        others = np.delete(best.margins[:, columns], index, axis=2)
        free = (best.reach[:, columns] >= 0) & np.all(others >= 0, axis=2)
        # The count-th largest margin among draws that keep all else: what must be given way to.
        level = -np.sort(-np.where(free, own, -np.inf), axis=0)[count - 1]
        k = int(np.argmax(level))
        if not math.isfinite(level[k]):
            continue
        value = limit.value * (1 + level[k] if limit.side == "at_least" else 1 - level[k])
        if value > 0 and level[k] != 0:
            found.append((abs(float(level[k])), Needed(index, float(value), float(_grid_of(best, s)[columns[k]]))))
    together = -np.sort(-np.where(best.reach[:, columns] >= 0, np.min(best.margins[:, columns], axis=2), -np.inf), axis=0)[
        count - 1
    ]
    return tuple(n for _, n in sorted(found, key=lambda pair: pair[0])), -float(np.max(together))


def _grid_of(best: _Tried, s: Specification) -> FloatArray:
    return np.linspace(s.lower, s.upper, best.built.probability.size)


def _drawing(best: _Tried, grid: FloatArray, s: Specification) -> Drawing | None:
    """Tolerance, guard bands and risks of the advised pads."""
    tolerance = crossings(grid, best.built.exact, s.probability, best.at)
    if tolerance is None or best.built.best_probability < s.probability:
        return None
    covered = grid[best.built.covered]
    open_below = tolerance[0] <= covered[0] and covered[0] > 0
    open_above = tolerance[1] >= covered[-1]
    # Nothing ends a tolerance at no padding at all.
    accepted, w = guarded(tolerance, s.gauge, s.guard_band)
    nan = math.nan
    if s.padding_tolerance is None:
        return Drawing(float(grid[best.at]), tolerance, accepted, w, open_below, open_above, nan, nan, nan, nan)
    from scipy.special import ndtri

    made = grid[best.at] + s.padding_tolerance.offset(ndtri((np.arange(_N_PAD) + 0.5) / _N_PAD))
    exact = best.built.exact[best.built.covered]
    found = risks(made, np.interp(made, covered, exact), accepted, s.gauge)
    delivered = found.consumers / found.accepted if found.accepted > 0 else nan
    return Drawing(
        float(grid[best.at]),
        tolerance,
        accepted,
        w,
        open_below,
        open_above,
        found.accepted,
        found.consumers,
        found.producers,
        delivered,
    )


def _inputs(best: _Tried, parts: Sequence[Part], z: Coordinates, errors: Errors) -> dict[str, FloatArray]:
    """What the worst margin of a draw depends on, by name."""
    names = {
        "young_modulus": "Young's modulus",
        "padding_young_modulus": "Young's modulus of the padding",
        "padding_poisson_ratio": "Poisson's ratio of the padding",
        "stiffening": "stiffening",
        "relative_permittivity": "relative permittivity",
        "sensor_thickness": "sensor thickness",
        "dielectric_thickness": "dielectric thickness",
        "electrode_radius": "electrode radius",
        "friction_coefficient": "friction",
    }
    inputs: dict[str, FloatArray] = {}
    for name, label in names.items():
        values = np.concatenate([np.asarray(part.base.parameters()[name], dtype=float) for part in parts])
        same = name == "padding_young_modulus" and all(
            p.member.posterior.experiment.padding_material == "sensor" for p in parts
        )
        replaced = (
            (name.startswith("padding") and best.choice.material is not None)
            or (name == "sensor_thickness" and best.choice.sensor_thickness is not None)
            or (name == "electrode_radius" and best.choice.electrode_radius is not None)
        )
        if not same and not replaced and np.all(np.isfinite(values)):
            inputs[label] = values
    for label, values in (
        ("noise of the capacitance meter", [part.own.noise for part in parts]),
        ("force discrepancy", [part.own.force_discrepancy for part in parts]),
        ("capacitance discrepancy", [part.own.capacitance_discrepancy for part in parts]),
    ):
        column = np.concatenate(values)
        if np.all(np.isfinite(column)):
            inputs[label] = column
    inputs |= {"error of the model in force": errors.force[:, best.at]}
    inputs |= {"error of the model in capacitance": errors.capacitance[:, best.at]}
    if len(parts) > 1:
        inputs["choice of model"] = np.concatenate([np.full(part.size, float(i)) for i, part in enumerate(parts)])
    return inputs | dict(z)


def _of_models(
    best: _Tried, models: Sequence[Member], parts: Sequence[Part], rows: Sequence[slice], grid: FloatArray
) -> Iterator[OfMember]:
    """What each model of an average says by itself."""
    own = {part.member.name: r for part, r in zip(parts, rows, strict=True)}
    conforms = best.worst >= 0
    for member in models:
        r = own.get(member.name, slice(0, 0))
        n = r.stop - r.start
        if n < _FEW:
            yield OfMember(member.name, n, math.nan, math.nan, math.nan)
            continue
        p = np.where(best.built.covered, np.mean(conforms[r], axis=0), -1.0)
        k = int(np.argmax(p))
        yield OfMember(member.name, n, float(p[best.at]), float(grid[k]), float(p[k]))


# --- what it holds for --------------------------------------------------------------------------------------------------


def _beyond(models: Sequence[Member], s: Specification, best: _Tried, z: Coordinates) -> Iterator[Reason]:
    """What of the answer was held against no data."""
    posterior = heaviest(models).posterior
    base = best.designs[0]
    radii = np.concatenate(
        [
            np.atleast_1d(np.median(ball))
            for ball in balls_of(s, base, {k: v[: np.size(base.sensor.thickness)] for k, v in z.items()})
        ]
    )
    known = posterior.experiment.indenter_radius
    radius = float(radii[np.argmax(np.abs(np.log(radii / known)))])
    stroke = best.built.stroke[2, best.at]
    yield from beyond_the_measured(posterior, s.largest_force, best.built.best, float(np.nan_to_num(stroke)), radius)
    other = []
    if best.choice.material is not None:
        other.append(f"padding of {best.choice.material.name}")
    thickness = best.choice.sensor_thickness
    if thickness is not None:
        measured = np.median(np.asarray(models[0].posterior.draws[..., _column(models[0].posterior, "sensor_thickness")]))
        if not 1 / MARGIN < thickness / measured < MARGIN:
            other.append(f"a sensor of {thickness * 1e3:.3g} mm")
    if best.choice.electrode_radius is not None:
        other.append(f"electrodes of {best.choice.electrode_radius * 1e3:.3g} mm radius")
    if other:
        finding = f"the advice is for {' and '.join(other)}, which was not measured"
        yield Reason("extrapolation", "amber", finding, "Build one such sensor and press it, to confirm")


def _column(posterior: Posterior, parameter: str) -> list[int]:
    return [k for k, info in enumerate(posterior.parameters) if info.parameter == parameter]


def _unmet(made: Built, s: Specification) -> Iterator[Reason]:
    if made.best_probability < s.probability:
        finding = f"no thickness conforms with a probability of {100 * s.probability:g} %: at best {100 * made.best_probability:.0f} %"
        yield Reason("specification", "amber", finding, "Change what the advice names, or build and accept that share")


def _conditions(best: _Tried, parts: Sequence[Part], s: Specification, grid: FloatArray) -> tuple[str, ...]:
    shown = [replace(part, base=design) for part, design in zip(parts, best.designs, strict=True)]
    chosen = best.choice
    found = conditions_of(
        shown,
        float(np.max(grid[best.built.covered])),
        electrode_chosen=chosen.electrode_radius is not None,
        material="" if chosen.material is None else chosen.material.name,
    )
    if isinstance(s.force, tuple) and len(s.force) > 1:
        found = (*found, f"loads of {', '.join(f'{f:g}' for f in s.force)} N, at each of which the limits were looked at")
    return found
