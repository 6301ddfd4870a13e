"""From a posterior and a specification to its `Conformity`: which padding conforms, how probably, and what is in the way."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median

import numpy as np

from calib.checks import (
    Member,
    Reason,
    Verdict,
    heaviest,
    judge_posterior,
    members_or,
    verdict_of,
)
from calib.decision.causes import causes
from calib.decision.choices import Coordinates, choices_of, coordinates_of, require_spread_once
from calib.decision.conditions import COVERED_SHARE, conditions_of, open_models_of, require_within_range
from calib.decision.conformity import Built, Conformity, OfMember
from calib.decision.enough_draws import left_open, left_open_in_words, what_would_tell
from calib.decision.extrapolation import MARGIN, Aim, Covered, beyond_the_measured, measured_presses, pad_to_press
from calib.decision.guard_band import Drawing
from calib.decision.needed import drawing_of, needed_for
from calib.decision.padding import recommend, unresolved
from calib.decision.performance import ElectrodeGroup, Errors, Refused, pressed
from calib.decision.recommendation import Recommendation
from calib.decision.requirement import Requirement
from calib.decision.sensors import ModelDraws, Sensors, sensors_of, smooth_normals
from calib.decision.trials import Tried, left_out, try_all
from calib.decision.words import EXTRAPOLATION, TOLERANCE_KEY, about, percent, sensor_in_words, spans_in_words
from calib.digits import span_text
from calib.errors import Fault, InputError
from calib.experiment import Specification, limited_in_words
from calib.priors import Prior
from calib.sampling import Posterior
from models.response import Forward
from models.sensor import FloatArray

# Streams of random numbers beside the seed's: of what scatters, of the errors of the model.
_SCATTER, _ERRORS = 5, 6
# A limit is a slip of its unit where all but this share of the draws on any padding are so many times inside it.
_NEARLY_NONE, _FAR = 1e-3, 100.0
# Of fewer draws a model of an average is not said to have a best thickness of its own; fewer altogether are no answer.
_FEW, _FEWEST = 20, 50
# Share of loads that have a distribution that is told.
_MOST_OF_THEM = 0.9
# Share of the pads that are made to a thickness of which the drawing accepts less is too few.
_MANY = 0.5
# Draws for the padding of the largest signal.
_SIGNAL_DRAWS = 400


@dataclass(frozen=True, eq=False)
class Answered:
    """An answer to a specification with the draws that it was read off.

    Attributes
    ----------
    conformity : the answer.
    tried : the sensors that may be built, that which is advised first.
    sensors : what they are made of.
    aim : what the advice is for, to be held against what was measured.
    """

    conformity: Conformity
    tried: tuple[Tried, ...]
    sensors: Sensors
    aim: Aim


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
    functions of thickness. It conforms if every limit holds at every load and under every ball. A draw that does not carry a
    load inside the model's range fails.

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
    The result, with a verdict of its own: what speaks against the calibration, what was not measured, what is not met.

    Raises
    ------
    InputError
        If the specification does not fit the run, there are too few draws, no thickness of no sensor is covered by a model, or
        none carries the load.
    """
    return answer(posterior, forward, specification, seed=seed, verdict=verdict, members=members).conformity


def answer(
    posterior: Posterior,
    forward: Forward,
    specification: Specification,
    *,
    seed: int,
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
) -> Answered:
    """Do what `conform` does, and keep the draws.

    Parameters
    ----------
    posterior, forward, specification, seed, verdict, members : as in `conform`.

    Raises
    ------
    InputError
        As in `conform`.
    """
    pooling = posterior.experiment.pooling
    require_spread_once(specification, [lot.quantity for lot in posterior.table.lots])
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
    require_within_range(sensors.parts[0], grid)
    errors = _errors(sensors, grid, n_draw, np.random.default_rng([seed, _ERRORS]))
    rows = _rows(sensors.parts)
    n_effective = _effective(posterior, n_draw)
    n_all = posterior.draws.shape[0] * posterior.draws.shape[1]
    found: list[Tried] = []
    unserved: list[Built] = []
    for choices in choices_of(specification):
        groups = [
            pressed(part, specification, choices, {name: own[r] for name, own in z.items()})
            for part, r in zip(sensors.parts, rows, strict=True)
        ]
        refused = next((group for group in groups if isinstance(group, Refused)), None)
        if refused is not None:
            unserved += [left_out(choice, refused.why, grid, specification) for choice in choices]
            continue
        for tried in try_all([g for g in groups if isinstance(g, ElectrodeGroup)], choices, grid, errors, rows, n_effective):
            if math.isfinite(tried.built.best):
                found.append(tried)
            else:
                unserved.append(tried.built)
    if not found:
        raise InputError(_nothing(unserved, specification))
    if all(np.all(tried.built.not_carried[tried.built.covered] == 1) for tried in found):
        raise InputError(_not_carried(found, grid, specification))
    order = sorted(found, key=lambda tried: (-tried.built.best_probability, tried.built.shortfall[tried.at]))
    best = order[0]
    needed, all_needed = needed_for(best, grid, specification, n_effective)
    known = judge_posterior(posterior) if verdict is None else verdict
    aim = _aim(specification, best)
    drawing = drawing_of(best, grid, specification)
    beyond = [
        *_beyond(models, aim, best, grid, specification),
        *_open_or_unmet(best.built, specification, n_draw, n_effective, _effective(posterior, n_all)),
        *_not_drawn(best.built, drawing, specification),
        *_idle(best, specification),
        *(
            unresolved(_shown(best, sensors.parts), best.built.best, specification.smallest_force)
            if specification.electrical
            else ()
        ),
    ]
    conformity = Conformity(
        specification=specification,
        thickness=grid,
        built=(*(tried.built for tried in order), *unserved),
        drawing=drawing,
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
    return Answered(conformity, tuple(order), sensors, aim)


def recommend_for(
    posterior: Posterior,
    forward: Forward,
    wanted: Requirement | Specification,
    *,
    seed: int,
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
) -> Recommendation:
    """Recommend a padding for a requirement, or for a specification.

    For a specification what conforms, and beside it which padding gives the largest signal at the largest load.

    Parameters
    ----------
    posterior, forward : of the calibration.
    wanted : of the padding.
    seed : of the choice of draws.
    verdict, members : as in `recommend` and `conform`.

    Returns
    -------
    The recommendation; for a specification with its `conformity`, whose verdict it has.

    Raises
    ------
    InputError
        If `conform` or `recommend` refuses: no thickness carries the largest load inside the model's range.
    """

    def largest_signal(requirement: Requirement) -> Recommendation:
        return recommend(
            posterior,
            forward,
            requirement,
            seed=seed,
            verdict=verdict,
            members=members,
        )

    if isinstance(wanted, Requirement):
        return largest_signal(wanted)
    conformity = conform(posterior, forward, wanted, seed=seed, verdict=verdict, members=members)
    found = largest_signal(
        Requirement(
            force=wanted.largest_force,
            lower=wanted.lower,
            upper=wanted.upper,
            n_thickness=wanted.steps,
            indenter_radius=wanted.ball[0] if isinstance(wanted.ball, tuple) else None,
            n_draw=min(wanted.n_draw, _SIGNAL_DRAWS),
        )
    )
    return replace(found, conformity=conformity, verdict=conformity.verdict)


def _require_noise(specification: Specification, parts: Sequence[ModelDraws]) -> None:
    wanted = any(limit.quantity == "force_resolution" for limit in specification.limits)
    if wanted and not all(np.all(np.isfinite(part.own.noise)) for part in parts):
        message = "force_resolution is limited, but the run knows no noise of a capacitance meter"
        raise InputError(Fault(message, advice="Leave it out, or calibrate with capacitance"))


def _rows(parts: Sequence[ModelDraws]) -> list[slice]:
    ends = np.cumsum([0, *(part.size for part in parts)])
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def _errors(sensors: Sensors, grid: FloatArray, n_draw: int, rng: np.random.Generator) -> Errors:
    sensor = np.concatenate([np.asarray(part.base.sensor.thickness) for part in sensors.parts])
    total = float(np.median(sensor)) + grid
    return Errors(*(smooth_normals(total, n_draw, rng) for _ in range(3)))


def _effective(posterior: Posterior, n_draw: int) -> int:
    """How many independent draws those of a posterior are worth."""
    known = [s.ess_bulk for s in posterior.diagnostics.parameters.values() if math.isfinite(s.ess_bulk)]
    return max(1, min(n_draw, round(min(known)))) if known else n_draw


# --- what stands in the way ---------------------------------------------------------------------------------------------


def _inputs(best: Tried, parts: Sequence[ModelDraws], z: Coordinates, errors: Errors) -> dict[str, FloatArray]:
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
        "friction_coefficient": "friction of the ball",
        "base_friction_coefficient": "friction of the base",
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
    for label, columns in (
        ("noise of the capacitance meter", [part.own.noise for part in parts]),
        ("force discrepancy", [part.own.force_discrepancy for part in parts]),
        ("capacitance discrepancy", [part.own.capacitance_discrepancy for part in parts]),
    ):
        column = np.concatenate(columns)
        if np.all(np.isfinite(column)):
            inputs[label] = column
    inputs |= {"error of the model in force": errors.force[:, best.at]}
    inputs |= {"error of the model in capacitance": errors.capacitance[:, best.at]}
    if len(parts) > 1:
        inputs["choice of model"] = np.concatenate([np.full(part.size, float(i)) for i, part in enumerate(parts)])
    return inputs | dict(z)


def _of_models(
    best: Tried, models: Sequence[Member], parts: Sequence[ModelDraws], rows: Sequence[slice], grid: FloatArray
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


def _nothing(unserved: Sequence[Built], s: Specification) -> list[Fault]:
    """Why nothing of what is asked for can be told."""
    asked = f"padding from {s.lower * 1e3:.3g} to {s.upper * 1e3:.3g} mm"
    advice = "Ask for other thicknesses, balls or sensors, or calibrate with another model"
    if s.padding_tolerance is not None and any(np.any(np.isfinite(b.exact)) for b in unserved):
        advice = f"Give a smaller {TOLERANCE_KEY}, or leave it out: pads of exactly such a thickness are covered"
    return [Fault(f"{b.name}, {asked}: {b.left_out}", advice=advice) for b in unserved]


def _not_carried(found: Sequence[Tried], grid: FloatArray, s: Specification) -> Fault:
    """That no draw carries the load, on whatever padding."""
    force, at = max(
        (float(reached[k]), k)
        for tried in found
        for reached in [_reached(tried, s.largest_force)]
        for k in np.flatnonzero(tried.built.covered)
    )
    message = (
        f"no sensor carries {s.largest_force:.4g} N on any padding from {span_text(grid[0] * 1e3, grid[-1] * 1e3)} mm inside "
        f"the model's range; the most is {force:.3g} N, on {grid[at] * 1e3:.3g} mm"
    )
    return Fault(message, advice=f"Ask for a load below {force:.3g} N or for other paddings")


def _reached(tried: Tried, load: float) -> FloatArray:
    """Largest force [N] that nearly all draws carry at each thickness, where `load` is the largest wanted, (n_thickness,)."""
    return np.asarray(load * (1 + np.quantile(tried.reach, 1 - COVERED_SHARE, axis=0)))


# --- what it holds for --------------------------------------------------------------------------------------------------


def _aim(s: Specification, best: Tried) -> Aim:
    """What the advice is for: of loads and balls that have a distribution, at its ends."""
    scatters = isinstance(s.force, Prior) or isinstance(s.ball, Prior)
    stroke = best.built.stroke[4 if scatters else 2, best.at]
    return Aim(
        s.largest_force,
        best.built.best,
        float(np.nan_to_num(stroke)),
        _balls(best, s),
        signal=s.electrical,
        sensor=best.choice.sensor_thickness,
    )


def _balls(best: Tried, s: Specification) -> tuple[float, ...]:
    """Radii [m] of the smallest and the largest ball that press, or of the one."""
    return s.outermost_balls or (float(np.median(np.asarray(best.designs[0].indenter.radius))),)


def _beyond(models: Sequence[Member], aim: Aim, best: Tried, grid: FloatArray, s: Specification) -> Iterator[Reason]:
    """What of the answer was held against no data."""
    posterior = heaviest(models).posterior
    to_press = float(np.interp(pad_to_press(aim), grid, _reached(best, aim.force)))
    yield from beyond_the_measured(posterior, aim, Covered(to_press, spans_in_words(grid, best.built.covered)))
    other = []
    if best.choice.material is not None:
        other.append(f"padding of {best.choice.material.name}")
    thickness = best.choice.sensor_thickness
    measured = median(press.total - press.padding for press in measured_presses(posterior))
    off = 0.0 if s.sensor_tolerance is None else float(s.sensor_tolerance.offset(np.array(1.645)))
    if thickness is not None and not 1 / MARGIN < thickness / measured < MARGIN:
        other.append(f"a sensor of {thickness * 1e3:.3g} mm")
    elif off > (MARGIN - 1) * measured:
        thick = measured if thickness is None else thickness
        other.append(f"sensors of {(thick - off) * 1e3:.3g} to {(thick + off) * 1e3:.3g} mm")
    if best.choice.electrode_radius is not None:
        other.append(f"electrodes of {best.choice.electrode_radius * 1e3:.3g} mm radius")
    if other:
        finding = f"the advice is for {' and '.join(other)}, which was not measured"
        yield Reason(EXTRAPOLATION, "amber", finding, "Build one such sensor and press it, to confirm")


def _open_or_unmet(made: Built, s: Specification, n_draw: int, n_effective: int, of_all: int) -> Iterator[Reason]:
    """That it is not met, or that the draws do not tell whether it is; `of_all`: what all draws of the posterior are worth."""
    if left_open(made.best_probability, s.probability, made.best_error):
        told = left_open_in_words(about(made.best_probability, made.best_error), s.probability)
        worth = "" if n_effective == n_draw else f", worth {n_effective} independent ones,"
        action = what_would_tell(made.best_probability, s.probability, of_all)
        yield Reason("specification", "amber", f"{n_draw} draws{worth} {told}", action)
    elif made.best_probability < s.probability:
        most = 100 * made.best_probability
        kind = "" if s.padding_tolerance is None else "nominal "
        finding = f"no {kind}thickness conforms with a probability of {100 * s.probability:g} %: at best {most:.0f} %"
        yield Reason("specification", "amber", finding, "Change what the advice names, or build and accept that share")


def _not_drawn(made: Built, drawing: Drawing | None, s: Specification) -> Iterator[Reason]:
    """That the drawing of what is advised accepts no pad that is made to it, or few."""
    if made.best_probability < s.probability:
        return
    action = (
        "Read pads better (gauge) or make them more exactly (tolerance), or ask for a range of padding about what is accepted"
    )
    if drawing is None or not drawing.accepts_nominal:
        finding = f"no drawing accepts pads of the {made.best * 1e3:.2f} mm that conform best"
        yield Reason("specification", "amber", finding, action)
    elif drawing.accepted_share < _MANY:
        told = f"of pads made to {made.best * 1e3:.2f} mm the drawing accepts {percent(drawing.accepted_share)}"
        yield Reason("specification", "amber", told, action)


def _idle(best: Tried, s: Specification) -> Iterator[Reason]:
    """Limits so far from anything that a sensor does on any padding asked for that a unit of theirs must be wrong."""
    for limit, margin in zip(s.limits, np.moveaxis(best.margins[:, best.built.covered], 2, 0), strict=True):
        known = margin[np.isfinite(margin)]
        if not known.size:
            continue
        nearest = float(np.quantile(known, _NEARLY_NONE))
        least = limit.side == "at_least"
        if nearest > limit.margin(np.array(limit.value * (_FAR if least else 1 / _FAR))):
            finding = (
                f"{limit.in_words} cannot bind: on any of these paddings it is {'above' if least else 'below'} "
                f"{limited_in_words(limit.quantity, limit.value_with(nearest))}"
            )
            yield Reason("limits", "amber", finding, "Check its unit; leave out a limit that nothing comes near")


def _shown(best: Tried, parts: Sequence[ModelDraws]) -> list[ModelDraws]:
    """The draws with the sensors of an answer."""
    return [replace(part, base=design) for part, design in zip(parts, best.designs, strict=True)]


def _conditions(best: Tried, parts: Sequence[ModelDraws], s: Specification, grid: FloatArray) -> tuple[str, ...]:
    chosen = best.choice
    found = conditions_of(
        _shown(best, parts),
        float(np.max(grid[best.built.covered])),
        _balls(best, s),
        electrode_chosen=chosen.electrode_radius is not None,
        material="" if chosen.material is None else chosen.material.name,
    )
    if isinstance(s.force, Prior):
        found = (*found, f"loads as they are distributed: nine in ten from {span_text(*s.force.interval(_MOST_OF_THEM))} N")
    elif len(s.force) > 1:
        found = (*found, f"loads of {', '.join(f'{f:g}' for f in s.force)} N, at each of which the limits were looked at")
    if isinstance(s.ball, Prior):
        found = (*found, "balls as they are distributed, nine in ten of them between these radii")
    elif s.ball is not None and len(s.ball) > 1:
        radii = ", ".join(f"{radius * 1e3:.4g}" for radius in sorted(s.ball))
        found = (*found, f"balls of {radii} mm radius, under each of which the limits were looked at")
    return found
