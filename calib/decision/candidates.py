"""A calibration and a bench in, the measurements that could follow out: each with the problem that it would make of it.

A press that nobody has made is one more sweep, of the readings that the calibration expects at the middle of its posterior,
reduced as those of the specimen that it is like. Its contact, load zero and clock are unknowns of its own, its noise and
discrepancy those of the calibration; a specimen that nobody has made has thicknesses of its own, known as well as those of the
specimen that it is like were before the data.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Literal, cast

import numpy as np

from calib.catalogue import QUANTITIES, UNKNOWNS, UnknownName, display
from calib.decision.extrapolation import MARGIN, Aim, Measured, pad_to_press
from calib.experiment import READINGS, Bench, Experiment, SweepFiles
from calib.lab import AS_FOUND, FIRST_LOADING, Points, Reading, Sweep
from calib.priors import Fixed, HalfNormal, Normal, Prior, TruncatedNormal
from calib.problem import (
    Problem,
    Rig,
    columns_at,
    list_unknowns,
    lookup,
    outside_faults,
    plan_sweeps,
    specimen_design,
    synthetic_sweep,
    values_at,
)
from models.curves import predict_design
from models.response import OutOfRangeError
from models.sensor import FloatArray

#: Name of a press that nobody has made yet.
NEXT = "next"

# Specimens on which further presses are tried, and draws by which it is told how far the forward model covers one.
_MOST_SPECIMENS, _DRAWS = 4, 64
# A press goes no further than this share of what the model covers for nearly all of these, and is not worth a change below
# this share of what is wanted; a force counts as larger, a ball or a thickness as another, from this factor on. Where less has
# to be tried, it is by this factor.
_SHARE, _NEARLY_ALL, _LEAST, _ANOTHER, _STEP = 0.95, 0.05, 0.4, 1.15, 0.88
# How far from zero [m] the crosshead may read where the ball touches: so much less of what is believed of its depth is covered.
_TOUCH = 0.1e-3
# A reading that has this share of what is known counts alone; a mean further from zero than this, in sds, is not near it.
_ALONE, _CLEAR = 0.995, 3.1
# Quantities that an experiment takes as exact where it does not say otherwise.
_RADII = ("electrode_radius", "sensor_radius", "indenter_radius")
# Of the measured thickness of the padding, those that are tried where the bench says nothing.
_PADDINGS = (0.0, 0.5, 2.0, 3.0)


@dataclass(frozen=True, eq=False)
class Known:
    """A calibration that measurements would follow.

    Attributes
    ----------
    problem : with the forward model that predicts.
    middle : (n_unknown,), mean of the posterior in coordinates z.
    draws : (n_draw, n_unknown), of it.
    """

    problem: Problem
    middle: FloatArray
    draws: FloatArray

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of all unknowns, fixed ones included."""
        return frozenset((*self.problem.names, *self.problem.fixed))

    def value(self, parameter: str, specimen: str, otherwise: float = 0.0) -> float:
        """Value [SI] at the middle of what holds for a specimen.

        Parameters
        ----------
        parameter : the quantity.
        specimen : name.
        otherwise : where there is none.
        """
        found = lookup(values_at(self.problem, self.middle[None]), parameter, specimen)
        return otherwise if found is None else float(found[0])


@dataclass(frozen=True, eq=False)
class Candidate:
    """A measurement that could be made next.

    Attributes
    ----------
    kind : of a press (`calib.experiment.PRESSES`), or the quantity that is read (`calib.experiment.READINGS`).
    what : in words of the lab.
    alike : the same for all that differ in nothing but the specimen.
    minutes : in the lab.
    experiment : with it; files that are still to be made have a name and no folder.
    notes : what is to be put in there, see `calib.experiment.experiment_toml`.
    problem : with one more sweep; None for a quantity that is read by itself.
    middle : (n_unknown,), of the problem.
    reads : number of the unknown that is read by itself, and its sd [SI]; None for a press.
    press : what a press is expected to measure; None for a quantity that is read by itself.
    """

    kind: str
    what: str
    alike: str
    minutes: float
    experiment: Experiment
    notes: Mapping[tuple[str, str], str]
    problem: Problem | None = None
    middle: FloatArray = field(default_factory=lambda: np.empty(0))
    reads: tuple[int, float] | None = None
    press: Measured | None = None


def largest_load(known: Known, bench: Bench, aim: Aim | None = None) -> float:
    """Force [N] that tester, load cell and sensor may see.

    Where nothing is said of them it is twice the largest that was measured, or the load that an advice is for, if that is more.

    Parameters
    ----------
    known : the calibration.
    bench : what the lab has.
    aim : what the advice is for; None for none.
    """
    if bench.load_cell is not None:
        return bench.load_cell
    twice = 2 * max(_largest_force(known, sweep) for sweep in known.problem.sweeps)
    return twice if aim is None else max(twice, aim.force)


def candidates_of(known: Known, bench: Bench, aim: Aim | None = None) -> tuple[list[Candidate], list[str]]:
    """List the measurements that could be made next, and those of which nothing can be said, in words.

    Parameters
    ----------
    known : the calibration.
    bench : what the lab can measure.
    aim : what an advice is for, so that what would confirm it is among them: its padding, ball and load; None for none.
    """
    found: list[Candidate] = []
    unjudged: list[str] = []
    for one in (*_presses(known, bench, aim), *_readings(known, bench)):
        if isinstance(one, str):
            unjudged.append(one)
        else:
            found.append(one)
    return found, list(dict.fromkeys(unjudged))


# --- presses ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Wanted:
    """A press that is to be tried: its kind, words, place, ball, force [N], channels, and thickness of new padding [m]."""

    kind: str
    words: str
    template: Sweep
    specimen: str
    ball: float
    force: float
    electrical: bool
    padding: float | None = None


def _presses(known: Known, bench: Bench, aim: Aim | None) -> Iterator[Candidate | str]:
    templates: dict[str, Sweep] = {}
    for sweep in known.problem.sweeps:
        best = templates.get(sweep.specimen)
        if best is None or len(sweep.channels) > len(best.channels):
            templates[sweep.specimen] = sweep
    if len(templates) > _MOST_SPECIMENS:
        yield f"further presses of {len(templates) - _MOST_SPECIMENS} specimens, which are like those of the first"
    cell = largest_load(known, bench, aim)
    for template in list(templates.values())[:_MOST_SPECIMENS]:
        for wanted in _wanted_on(known, bench, template, cell, aim):
            yield _pressed(known, bench, wanted)
    template = next(iter(templates.values()))
    for new in _wanted_anew(known, bench, template, cell, aim):
        yield new if isinstance(new, str) else _pressed(known, bench, new)
    if "indenter_radius" in known.names and "ball" not in bench.without:
        yield "another ball: the radius of the ball is an unknown here, which one ball alone may have"
    pooled = {lot.quantity for lot in known.problem.table.lots}
    if "padding_thickness" in pooled and not any(s.nominal for s in known.problem.experiment.specimens):
        yield "padding of another thickness: it is pooled here, and `nominal` does not say what was wanted of each specimen"
    yield "slower and faster presses: time is not modelled"


def _wanted_on(known: Known, bench: Bench, template: Sweep, cell: float, aim: Aim | None) -> Iterator[_Wanted]:
    """Further presses of a specimen that is there."""
    name = template.specimen
    force = min(_largest_force(known, template), cell)
    own = [sweep.indenter_radius for sweep in known.problem.sweeps if sweep.specimen == name]
    ball = display("indenter_radius", template.indenter_radius)
    again = _Wanted(
        "repeat",
        f"press {name} once more with the ball of {ball} radius up to {{force:.2g}} N",
        template,
        name,
        template.indenter_radius,
        force,
        "capacitance" in template.channels,
    )
    if "repeat" not in bench.without:
        yield again
    if "force" not in bench.without and cell > _ANOTHER * force:
        words = f"press {name} with the ball of {ball} radius up to {{force:.2g}} N instead of {force:.2g} N"
        yield replace(again, kind="force", words=words, force=cell)
    if "ball" not in bench.without and "indenter_radius" not in known.names:
        for radius in bench.balls:
            if all(max(radius / one, one / radius) > _ANOTHER for one in own):
                words = f"press {name} with a ball of {display('indenter_radius', radius)} radius up to {{force:.2g}} N"
                wanted_there = aim is not None and _alike(radius, aim.ball, MARGIN)
                to = _confirming(force, cell, aim) if wanted_there else force
                yield replace(again, kind="ball", words=words, ball=radius, force=to)
    if "capacitance" not in bench.without and not again.electrical and "force" in template.channels:
        words = f"press {name} once more with the LCR meter connected, up to {{force:.2g}} N"
        yield replace(again, kind="capacitance", words=words, electrical=True)


def _wanted_anew(known: Known, bench: Bench, template: Sweep, cell: float, aim: Aim | None) -> Iterator[_Wanted | str]:
    """Presses of specimens that nobody has made, like one that is there but for its padding."""
    taken = {specimen.name for specimen in known.problem.experiment.specimens}
    name = next(f"sensor {k}" for k in count(len(taken) + 1) if f"sensor {k}" not in taken)
    padding = known.value("padding_thickness", template.specimen)
    like = _Wanted(
        "specimen",
        f"make one more sensor like {template.specimen} and press it up to {{force:.2g}} N",
        template,
        name,
        template.indenter_radius,
        _largest_force(known, template),
        "capacitance" in template.channels,
        padding,
    )
    if "specimen" not in bench.without:
        yield like
    pooled = {lot.quantity for lot in known.problem.table.lots}
    own = next(s for s in known.problem.experiment.specimens if s.name == template.specimen)
    wanted_of_each = "padding_thickness" not in pooled or "padding_thickness" in own.nominal
    if "padding" not in bench.without and wanted_of_each:
        asked = bench.paddings
        if asked is None:
            asked = tuple(round(share * padding, 4) for share in _PADDINGS) if padding > 0 else (1e-3, 3e-3)
        ball, confirming, other = template.indenter_radius, padding, ""
        if aim is not None and not _alike(aim.padding, padding, MARGIN):
            if bench.paddings is not None and not any(_alike(aim.padding, thickness, MARGIN) for thickness in asked):
                at = display("padding_thickness", aim.padding)
                yield f"padding of {at}, which the advice is for: it is not among the paddings of the bench file"
            else:
                confirming = pad_to_press(aim.padding)
                asked = (confirming, *(thickness for thickness in asked if not _alike(thickness, confirming, MARGIN)))
        if aim is not None and not _alike(aim.ball, ball, MARGIN) and _at_hand(known, bench, aim.ball):
            ball = aim.ball
            other = f" with a ball of {display('indenter_radius', ball)} radius"
        for thickness in dict.fromkeys(asked):
            if thickness == padding or (thickness != confirming and _alike(thickness, padding, _ANOTHER)):
                continue
            on = f"on {display('padding_thickness', thickness)} of padding" if thickness > 0 else "without padding"
            under, named = (ball, other) if thickness == confirming else (template.indenter_radius, "")
            words = f"make one more sensor {on} and press it{named} up to {{force:.2g}} N"
            yield replace(
                like, kind="padding", words=words, padding=thickness, ball=under, force=_confirming(like.force, cell, aim)
            )


def _confirming(force: float, cell: float, aim: Aim | None) -> float:
    """Force [N] that confirms what an advice is for; less than was pressed with would tell less, and cost as much."""
    return force if aim is None else min(max(aim.force, force), cell)


def _alike(one: float, other: float, factor: float) -> bool:
    """Whether two lengths differ by less than a factor; none is like none only."""
    return one == other or max(one, other) < factor * min(one, other)


def _at_hand(known: Known, bench: Bench, radius: float) -> bool:
    """Whether a sensor can be pressed with a ball of that radius."""
    possible = "ball" not in bench.without and "indenter_radius" not in known.names
    return possible and any(_alike(radius, ball, MARGIN) for ball in bench.balls)


def _pressed(known: Known, bench: Bench, wanted: _Wanted) -> Candidate | str:
    """The candidate that a press is, as far as the forward model covers it; in words why there is none."""
    experiment = _with_press(known, wanted)
    like = _like(wanted)
    stub = _extended(known, experiment, like)
    try:
        reach = _reach(known, stub, like)
        most = min(wanted.force, _SHARE * reach)
        before = _largest_force(known, wanted.template)
        least = _ANOTHER * before if wanted.kind == "force" else _LEAST * min(wanted.force, before)
        if most < least:
            limit = f"covers this press up to {max(reach, 0.0):.2g} N only" if reach > 0 else "does not cover it"
            return f"{_in_words(wanted, wanted.force)}: the {known.problem.forward.name} {limit}"
        for force in _ladder(most, least):
            sweep, zeros, press = _expected_sweep(known, stub, like, force)
            problem = _extended(known, experiment, sweep)
            # A calibration with it is refused where most of what is believed is not covered.
            faults = outside_faults(replace(problem, plans=problem.plans[-1:]))
            if not faults:
                break
        else:
            return f"{_in_words(wanted, wanted.force)}: {faults[0].message}"
    except (OutOfRangeError, ValueError) as error:
        return f"{_in_words(wanted, wanted.force)}: {error}"
    if len(problem.table.lots) > len(known.problem.table.lots):
        return f"{_in_words(wanted, force)}: it brings a quantity that is pooled, of which nothing is known yet"
    middle = _middle_of(known, problem, zeros)
    words = _in_words(wanted, force)
    touch = f"zero the crosshead within {display('contact_offset', _TOUCH)} of first touch"
    notes = {(wanted.specimen, NEXT): f"files of this press: {words}; {touch}"}
    if wanted.padding is not None:
        notes = {(wanted.specimen, ""): notes[wanted.specimen, NEXT]}
        own = experiment.specimens[-1].priors
        measured = [name for name in own if name != "padding_thickness" or wanted.padding > 0]
        notes |= {(wanted.specimen, name): "put in what you measure of it" for name in measured}
    alike = f"{wanted.kind} {wanted.ball:g} {wanted.padding or 0.0:g}"
    minutes = bench.time(wanted.kind)
    return Candidate(wanted.kind, words, alike, minutes, experiment, notes, problem, middle, press=press)


def _in_words(wanted: _Wanted, force: float) -> str:
    """What is wanted with its force [N]; a specimen's name may have braces of its own, and stands before it."""
    before, _, after = wanted.words.rpartition("{force:.2g}")
    return f"{before}{force:.2g}{after}"


def _ladder(force: float, least: float) -> Iterator[float]:
    """Forces [N] to try, one smaller than the other, down to the least."""
    while force >= least:
        yield force
        force *= _STEP


def _with_press(known: Known, wanted: _Wanted) -> Experiment:
    """The experiment with one more sweep, of a specimen that is there or of a new one."""
    experiment = known.problem.experiment
    own = next(s for s in experiment.specimens if s.name == wanted.template.specimen)
    before = next(f for f in own.sweeps if f.name == wanted.template.name)
    stem = f"{wanted.specimen} {NEXT}".replace(" ", "_")
    files = SweepFiles(
        NEXT,
        Path(f"{stem}_force.csv") if before.force is not None else None,
        Path(f"{stem}_capacitance.csv") if wanted.electrical else None,
        wanted.ball,
        _as_before(before.force_reading),
        _as_before(before.capacitance_reading),
        FIRST_LOADING,
    )
    if wanted.padding is None:
        more = tuple(replace(s, sweeps=(*s.sweeps, files)) if s is own else s for s in experiment.specimens)
        return replace(experiment, specimens=more)
    priors = dict(own.priors)
    nominal = dict(own.nominal)
    if "padding_thickness" in priors:
        priors["padding_thickness"] = _moved(priors["padding_thickness"], wanted.padding)
    if "padding_thickness" in nominal:
        nominal["padding_thickness"] = wanted.padding
    new = replace(own, name=wanted.specimen, sweeps=(replace(files, name=""),), priors=priors, nominal=nominal)
    return replace(experiment, specimens=(*experiment.specimens, new))


def _as_before(reading: Reading) -> Reading:
    """How a file of the same instrument is read: which record in it is left to the file."""
    return replace(reading, specimen=None, sheet="", where=AS_FOUND.where)


def _moved(prior: Prior, value: float) -> Prior:
    """A prior as wide as another, about another thickness; no padding is known."""
    if isinstance(prior, Fixed) or value == 0:
        return Fixed(value)
    low, high = prior.ppf_normal(np.array([-1.0, 1.0]))
    sd = float(high - low) / 2
    return TruncatedNormal(value, min(sd, value / 4), 0.0, math.inf)


def _like(wanted: _Wanted) -> Sweep:
    """A sweep that has all of a press that is wanted but its readings, which are those of another."""
    name = NEXT if wanted.padding is None else ""
    like = replace(wanted.template, specimen=wanted.specimen, name=name, indenter_radius=wanted.ball)
    like = replace(like, files=(), notes=(), grades=())
    if not wanted.electrical or "capacitance" in like.channels:
        return like
    force = like.channels["force"]
    points = Points(np.ones_like(force.value), force.n_effective, displacement=force.displacement, force=force.value)
    return replace(like, channels={**like.channels, "capacitance": points})


def _extended(known: Known, experiment: Experiment, sweep: Sweep) -> Problem:
    """The problem with one more sweep: its unknowns first, then those that the sweep brings."""
    problem = known.problem
    sweeps = (*problem.sweeps, sweep)
    listed, fixed = list_unknowns(experiment, sweeps)

    def brought(name: UnknownName) -> bool:
        own = name.specimen in ("", sweep.specimen) and name.sweep in ("", sweep.name)
        return own and str(name) not in known.names

    new = tuple(info for info in listed if brought(info.key))
    values = {name: value for name, value in fixed.items() if brought(UnknownName.parse(name))}
    plans = plan_sweeps(sweeps)
    return Problem(experiment, sweeps, problem.forward, (*problem.parameters, *new), {**values, **problem.fixed}, plans)


def _middle_of(known: Known, problem: Problem, values: Mapping[str, float]) -> FloatArray:
    """The middle of a problem with more unknowns, which are at their priors' medians if `values` does not say otherwise."""
    more = []
    for info in problem.parameters[known.middle.size :]:
        own = values.get(info.parameter) if UNKNOWNS[info.parameter].scope == "sweep" else None
        z = 0.0 if own is None else float(info.prior.to_normal(np.array(own)))
        more.append(z if math.isfinite(z) else 0.0)
    for lot in problem.table.lots:  # a new specimen is like its lot
        old = np.flatnonzero(lot.columns < known.middle.size)
        at_middle = columns_at(known.problem, known.middle[None])[0]
        references = [float(lot.prior.at(np.zeros(1), int(s))[0]) for s in range(lot.columns.size)]
        share = float(np.mean([at_middle[lot.columns[s]] / references[s] for s in old])) if old.size else 1.0
        for s, k in enumerate(lot.columns):
            if k >= known.middle.size:
                z = float(problem.parameters[k].prior.to_normal(np.array(share * references[s])))
                more[k - known.middle.size] = z if math.isfinite(z) else 0.0
    return np.concatenate([known.middle, more])


def _reach(known: Known, stub: Problem, like: Sweep) -> float:
    """Force [N] up to which the forward model covers a press for nearly all draws of the posterior; 0 for none."""
    middle = _middle_of(known, stub, {})
    z = np.tile(middle, (_DRAWS, 1))
    rows = np.linspace(0, len(known.draws) - 1, _DRAWS).astype(int)
    z[:, : known.middle.size] = known.draws[rows]
    design = specimen_design(stub, values_at(stub, z), like.specimen, like.name)
    reach = predict_design(known.problem.forward, design, np.array([1.0])).reach
    return float(np.quantile(np.nan_to_num(reach), _NEARLY_ALL))


def _expected_sweep(known: Known, stub: Problem, like: Sweep, force: float) -> tuple[Sweep, dict[str, float], Measured]:
    """The sweep expected at the middle of the posterior, up to a force [N], where its contact and zeros are, and its end."""
    middle = _middle_of(known, stub, {})
    values = values_at(stub, middle[None])
    design = specimen_design(stub, values, like.specimen, like.name).draw(0)
    depth = float(predict_design(known.problem.forward, design, np.array([force])).depth[0, 0])
    if not math.isfinite(depth):
        raise OutOfRangeError(f"the {known.problem.forward.name} does not cover it")

    def value(parameter: str, otherwise: float = 0.0) -> float:
        found = lookup(values, parameter, like.specimen, like.name)
        return otherwise if found is None else float(found[0])

    zeros = {name: value(name) for name in ("contact_offset", "load_zero", "load_step", "clock_offset")}
    if any(
        info.parameter == "contact_offset" and info.origin != "experiment file" for info in stub.parameters[known.middle.size :]
    ):
        zeros["contact_offset"] = _TOUCH
    tie = cast(Literal["clock", "force", "displacement", "none"], like.tied_by("capacitance") or "none")
    counts = {name: points.value.size for name, points in like.channels.items()}
    rig = Rig(
        **zeros,
        machine_compliance=value("machine_compliance"),
        parasitic_capacitance=value("parasitic_capacitance"),
        force_gain=value("force_gain", 1.0),
        capacitance_gain=value("capacitance_gain", 1.0),
        force_noise=value("force_noise", 5e-3),
        capacitance_noise=value("capacitance_noise", 20e-15),
        speed=_speed(like),
    )
    n_points = max(counts.values())
    made = synthetic_sweep(
        known.problem.forward,
        design,
        depth,
        rig,
        np.random.default_rng(0),
        specimen=like.specimen,
        name=like.name,
        n_points=n_points,
        tie=tie,
        with_force="force" in like.channels,
    )
    # As many independent readings in all as the press that it is like.
    channels = {
        name: replace(points, n_effective=np.full(n_points, np.sum(like.channels[name].n_effective) / n_points))
        for name, points in made.channels.items()
    }
    sd = like.clock_offset_sd if tie == "clock" else math.nan
    sensor, padding = (float(np.asarray(layer.thickness)) for layer in (design.sensor, design.padding))
    press = Measured(force, depth, padding, sensor + padding, like.indenter_radius)
    return replace(made, channels=channels, clock_offset_sd=sd), zeros, press


def _speed(like: Sweep) -> float:
    """Speed of the crosshead [m/s]; of no matter where nothing is tied by time."""
    if like.track is None or like.track.time.size < 2:
        return Rig().speed
    top = int(np.argmax(like.track.displacement))
    start = int(np.argmin(like.track.displacement[: top + 1]))
    elapsed = float(like.track.time[top] - like.track.time[start])
    way = float(like.track.displacement[top] - like.track.displacement[start])
    return way / elapsed if elapsed > 0 and way > 0 else Rig().speed


def _largest_force(known: Known, sweep: Sweep) -> float:
    """Largest true force [N] of a press, at the middle of the posterior."""
    values = values_at(known.problem, known.middle[None])

    def value(parameter: str, otherwise: float) -> float:
        found = lookup(values, parameter, sweep.specimen, sweep.name)
        return otherwise if found is None else float(found[0])

    loads = [load for name in sweep.channels if (load := sweep.load_at(name)) is not None]
    if loads:
        zero = value("load_zero", 0.0) + value("load_step", 0.0)
        return (max(float(np.max(load)) for load in loads) - zero) / value("force_gain", 1.0)
    reading = max(float(np.max(p.displacement)) for p in sweep.channels.values() if p.displacement is not None)
    design = specimen_design(known.problem, values, sweep.specimen, sweep.name)
    depth = np.array([max(reading - value("contact_offset", 0.0), 0.0)])
    return float(known.problem.forward.respond(design, depth).force.flat[0])


# --- quantities by themselves -------------------------------------------------------------------------------------------


def _readings(known: Known, bench: Bench) -> Iterator[Candidate | str]:
    problem = known.problem
    sampled = {info.parameter for info in problem.parameters}
    for quantity, usual in READINGS.items():
        if quantity in bench.without:
            continue
        if quantity not in sampled:
            taken = [name for name in problem.fixed if UnknownName.parse(name).parameter == quantity]
            if taken:
                value = display(quantity, problem.fixed[taken[0]])
                yield f"{usual.how.format(of='')}: nothing to gain here, as the experiment takes {quantity} as known ({value})"
            elif quantity in _RADII:
                exact = f"the experiment takes {quantity} as exact ({UNKNOWNS[quantity].derived})"
                wanting = "what an error of it does is not in the posterior. Give it a prior to ask"
                yield f"{usual.how.format(of='')}: {exact}; {wanting}"
            continue
        for k, info in enumerate(problem.parameters):
            if info.parameter == quantity:
                yield _read(known, bench, k)


def _read(known: Known, bench: Bench, k: int) -> Candidate:
    """The candidate that reading an unknown by itself is."""
    info = known.problem.parameters[k]
    sd = bench.sd(info.parameter)
    usual = READINGS[info.parameter]
    row = QUANTITIES[info.parameter]
    off = f"{sd * row.display_scale:.3g} {row.display_unit}".rstrip()
    of = f" of {info.specimen}" if info.specimen else ""
    middle = float(columns_at(known.problem, known.middle[None])[0, k])
    experiment = known.problem.experiment
    before: Prior | None = info.prior
    if any(k in lot.columns for lot in known.problem.table.lots):  # what is read is of the specimen, the rest of its lot
        before = next(s for s in experiment.specimens if s.name == info.specimen).priors.get(info.parameter)
    prior, note = with_reading(info.parameter, before, middle, sd)
    if info.specimen:
        more = tuple(
            replace(s, priors={**s.priors, info.parameter: prior}) if s.name == info.specimen else s
            for s in experiment.specimens
        )
        experiment = replace(experiment, specimens=more)
    else:
        experiment = replace(experiment, priors={**experiment.priors, info.parameter: prior})
    what = f"{usual.how.format(of=of)} to {off} (sd)"
    notes = {(info.specimen, info.parameter): note}
    return Candidate(info.parameter, what, info.parameter, bench.time(info.parameter), experiment, notes, reads=(k, sd))


def with_reading(parameter: str, prior: Prior | None, value: float, sd: float) -> tuple[Prior, str]:
    """What is believed of a quantity once it is read by itself, and how to write that down.

    Parameters
    ----------
    parameter : the quantity.
    prior : what was believed before; None for nothing.
    value : SI, what is read.
    sd : SI, how well.

    Returns
    -------
    The product of both for a normal prior (also one that is cut off); else what is read alone. And a note for the file.
    """
    before = None
    match prior:
        case Normal(mean, own) | TruncatedNormal(mean, own, _, _):
            before = (mean, own)
        case HalfNormal(scale):
            before = (0.0, scale)
    if before is None:
        made, note = (value, sd), "put in what you read as mean; its sd takes the place of what was believed"
    else:
        share = before[1] ** 2 / (before[1] ** 2 + sd**2)
        made = ((1 - share) * before[0] + share * value, sd * math.sqrt(share))
        old = display(parameter, before[0])
        note = "put in what you read as mean"
        if share < _ALONE:
            note = (
                f"put in as mean {share:.3f} times what you read, plus {1 - share:.3f} times {old}, which was believed before"
            )
    mean, own = (float(f"{number:.4g}") for number in made)
    low, high = Normal(0.0, 1.0).support if prior is None else prior.support
    if low == 0 and mean < _CLEAR * own:  # a form that says where it is cut off
        top = mean + 8 * own
        return TruncatedNormal(mean, own, 0.0, top), note
    if math.isinf(low):
        return Normal(mean, own), note
    return TruncatedNormal(mean, own, low, high), note
