"""A calibrated lot and the lab files of one newcomer in, what it is, whether it belongs and whether it conforms, out."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import combinations, product
from typing import Any, Literal

import numpy as np

from calib.catalogue import CHANNELS, POOLED, QUANTITIES
from calib.checks import (
    LEVELS,
    OFF,
    Belonging,
    Colour,
    Prediction,
    Reason,
    Verdict,
    belongs,
    conflict_limit,
    drift_by_share,
    drift_of_meter,
    judge_posterior,
    predict,
    stranger_in_words,
    verdict_from_plain,
    verdict_of,
)
from calib.decision.as_built import AsBuilt, as_built, signal_as_built
from calib.decision.enough_draws import left_open, left_open_in_words, most_in_percent
from calib.decision.extrapolation import Aim, Covered, beyond_the_measured
from calib.decision.words import about
from calib.errors import Fault, InputError
from calib.experiment import (
    Experiment,
    Press,
    Pressed,
    Specification,
    Specimen,
    SweepFiles,
    read_sweeps,
)
from calib.lab import Sweep, repeated_channels
from calib.problem import CalibratedLot, Newcomer, lookup, newcomer_experiment, newcomer_of, outside_faults, specimen_design
from calib.sampling import (
    FirstEstimate,
    Gate,
    GivenLot,
    NothingSampled,
    Posterior,
    Stranger,
    given_chains,
    given_lot,
    joined_problem,
    posterior_of,
    quantiles,
    sample,
)
from models.curves import predict_design
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import FloatArray
from models.threads import one_thread

#: What chains have to reach where weights cannot be trusted.
CHAINS = Gate(r_hat=1.02, ess=200.0)

# Draws for the predictions of a newcomer's own readings, and share of draws that must carry a load for its signal to be told.
_PREDICTED, _CARRIED = 200, 0.95

# Standard deviations within which two newcomers have to agree in every unknown for their presses to be held against each other.
_AS_ONE = 0.5

_ONE_PRESS = "Check that they are of one press"

#: Gates of what speaks against the lot, and so against every newcomer: said once, as the lot's light.
OF_LOT = ("lot", "spread")

How = Literal["weighted draws", "chains", "none"]
Decision = Literal["pass", "fail", "none"]
Belongs = Literal["yes", "no", "not told"]


@dataclass(frozen=True)
class Inspected:
    """What was found of one newcomer.

    Attributes
    ----------
    name : of the specimen.
    files : (name, sha256) of each of its lab files.
    started : when its record began as the file states it, ISO 8601; "" if it does not.
    verdict : whether its numbers may be used, and what speaks against that, be it its own or its lot's (`OF_LOT`).
    how : by weighted draws of the lot, by chains of the lot with the newcomer in it, or not at all.
    k_hat, effective : of the weights: shape of their tail, and how many independent draws they are worth.
    estimates : quantity -> mean, sd, and ends of the central 90 %, SI; with "signal" and "stroke" at the load `force`. None
        where the verdict is red: what must not be used is not stated.
    force : [N], at which the signal is told.
    strangers : how far it lies off what the lot lets one expect.
    of_another_kind : quantity of the material -> how far one that is 25 % off in it would lie off: `Belonging`.
    fits : channel -> posterior predictive p-value, of the worst press.
    conformity : to the specification; None without one, and where nothing is known of the specimen.
    seconds : of processor time.
    """

    name: str
    files: tuple[tuple[str, str], ...]
    started: str
    verdict: Verdict
    how: How = "none"
    k_hat: float = math.nan
    effective: float = 0.0
    estimates: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    force: float = math.nan
    strangers: tuple[Stranger, ...] = ()
    of_another_kind: Mapping[str, float] = field(default_factory=dict)
    fits: Mapping[str, float] = field(default_factory=dict)
    conformity: AsBuilt | None = None
    seconds: float = 0.0

    @property
    def decision(self) -> Decision:
        """Whether it passes; "none" without a specification, and where its numbers must not be used."""
        if self.conformity is None or self.verdict.colour == "red":
            return "none"
        return "pass" if self.conformity.accepted else "fail"

    @property
    def own(self) -> tuple[Reason, ...]:
        """What speaks against it alone, not against all of its lot; where it is set aside, that it does not belong is red."""
        own = (reason for reason in self.verdict.reasons if reason.gate not in OF_LOT)
        return tuple(replace(r, level="red") if self.set_aside and r.gate == "belongs" else r for r in own)

    @property
    def belongs(self) -> Belongs:
        """Whether it belongs to its lot; "not told" where it was not measured so, or one of another kind could pass for it."""
        gates = {reason.gate for reason in self.verdict.reasons}
        if "belongs" in gates:
            return "no"
        return "not told" if gates & {"spread", "channels"} or not self.strangers or self.verdict.colour == "red" else "yes"

    @property
    def set_aside(self) -> bool:
        """Whether it does not belong to its lot and passes no specification, which would show that it is fit all the same."""
        return self.belongs == "no" and self.decision != "pass"

    @property
    def light(self) -> Colour:
        """Red where it must not be used, fails or is set aside, else amber where anything speaks against it or its lot."""
        return "red" if self.decision == "fail" or self.set_aside else self.verdict.colour


@dataclass(frozen=True, eq=False)
class Inspection:
    """What all newcomers of a batch are inspected by.

    Attributes
    ----------
    lot : the calibrated lot in draws.
    sweeps : that it was calibrated with, for chains where weights cannot be trusted.
    template : the specimen of the lot that newcomers were meant to be like.
    forward : the model of the sensor, a fast one.
    specification : that they are held against; None for none.
    force : [N], at which the signal is told.
    reasons : what speaks against all of them: what does against the lot.
    seed : of all random numbers.
    chain_seconds : that chains may take for one newcomer; 0 for no chains.
    """

    lot: CalibratedLot
    sweeps: tuple[Sweep, ...]
    template: Specimen
    forward: Forward
    specification: Specification | None
    force: float
    reasons: tuple[Reason, ...]
    seed: int
    chain_seconds: float


@dataclass(frozen=True)
class Presented:
    """One newcomer before it is inspected.

    Attributes
    ----------
    name : for people.
    sweeps : its lab files.
    files, started : as in `Inspected`.
    reasons : what speaks against it already, such as a copy of another's file.
    """

    name: str
    sweeps: tuple[SweepFiles, ...]
    files: tuple[tuple[str, str], ...]
    started: str
    reasons: tuple[Reason, ...] = ()


def presented(pressed: Pressed, template: Specimen, experiment: Experiment, reasons: Sequence[Reason] = ()) -> Presented:
    """A newcomer from the lab files that were found of it, which are read as those of the lot were.

    Parameters
    ----------
    pressed : from `calib.experiment.pair`.
    template : the specimen of the lot that it was meant to be like.
    experiment : of the lot.
    reasons : what speaks against it already.
    """
    found = list(reasons)
    sweeps, files, started = [], {}, []
    names = {sweep.name: sweep for sweep in template.sweeps}
    for press in pressed.presses:
        like = names.get(press.name, template.sweeps[0])
        if press.name not in names and len({sweep.indenter_radius for sweep in template.sweeps}) > 1:
            known = ", ".join(names)
            finding = f"nothing tells with which ball it was pressed: the lot has presses of several balls ({known})"
            found.append(Reason("files", "red", finding, "Name its files as those of the lot"))
        elif press.ball or press.perhaps:
            finding = f'the names of its files may tell a ball of its own ("{press.perhaps or press.name}")'
            radius = f"{like.indenter_radius * 1e3:g} mm radius"
            found.append(Reason("files", "amber", finding, f"Make sure that it was the ball of the lot, of {radius}"))
        found += _alone(press)
        of_press = [(like.force_reading, press.force), (like.capacitance_reading, press.capacitance)]
        readings = [replace(said, specimen=None if r is None else r.reading.specimen, sheet="") for said, r in of_press]
        force, capacitance = (None if r is None else r.table.path for _, r in of_press)
        of_force, of_capacitance = readings
        ball = like.indenter_radius
        sweeps.append(SweepFiles(press.name, force, capacitance, ball, of_force, of_capacitance, like.use))
        for _, record in of_press:
            if record is not None:
                files[record.shown] = record.table.sha256
                started += [record.table.started] if record.table.started is not None else []
        found += [Reason("files", "amber", note, "Look at its files") for note in press.notes]
        if press.why.endswith("check"):
            found.append(
                Reason(
                    "files", "amber", f"its files were {press.why.removesuffix(': check')}", "Check that they are of one press"
                )
            )
    return Presented(
        pressed.name,
        tuple(sweeps),
        tuple(files.items()),
        min(started).isoformat() if started else "",
        tuple(found),
    )


def inspect(inspection: Inspection, one: Presented) -> Inspected:
    """Say of one newcomer what it is, whether it belongs to its lot, and whether it conforms.

    Whatever is wrong with its files is a reason against it, and stops nothing.

    Parameters
    ----------
    inspection : what it is inspected by.
    one : the newcomer.
    """
    began = time.process_time()
    blank = Inspected(one.name, one.files, one.started, verdict_of(one.reasons))
    try:
        with one_thread():
            found = _inspected(inspection, one, blank)
    except InputError as error:
        faults = error.faults
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        reason = Reason(
            "files", "red", f"{_where(faults[0])}{faults[0].message}{more}", faults[0].advice or "Look at its files"
        )
        found = replace(blank, verdict=verdict_of([*one.reasons, reason]))
    except OSError as error:
        finding = f"a file cannot be read ({error.strerror or error})"
        found = replace(blank, verdict=verdict_of([*one.reasons, Reason("files", "red", finding, "Look at the file")]))
    except (OutOfRangeError, ConvergenceError, np.linalg.LinAlgError, ValueError) as error:
        reason = Reason("range", "red", f"it could not be computed: {error}", "Calibrate it by itself to see why")
        found = replace(blank, verdict=verdict_of([*one.reasons, reason]))
    return replace(found, seconds=time.process_time() - began)


def _where(fault: Fault) -> str:
    return "" if fault.path is None else f"{fault.path.name}{f', line {fault.line}' if fault.line else ''}: "


def _inspected(inspection: Inspection, one: Presented, blank: Inspected) -> Inspected:
    if not one.sweeps or any(reason.gate == "files" and reason.level == "red" for reason in one.reasons):
        return blank
    lot, seed, like = inspection.lot, inspection.seed, inspection.template.name
    experiment = _experiment_of(inspection, one)
    sweeps = read_sweeps(experiment)
    if {digest for sweep in sweeps for _, digest in sweep.files} != {digest for _, digest in one.files}:
        raise InputError(Fault("its files have changed since they were looked at", advice="Run the command again"))
    if again := _of_the_lot(inspection.sweeps, sweeps):
        return replace(blank, verdict=verdict_of([*one.reasons, again]))
    newcomer = newcomer_of(lot, experiment, sweeps, inspection.forward, like)
    found = given_lot(newcomer, seed)
    if not found.weight.size:
        faults = [*outside_faults(newcomer.given(0))]
        why = faults[0].message if faults else f"the {newcomer.forward.name} covers nothing that explains its readings"
        reason = Reason("range", "red", why, "Check its files, the ball and the thicknesses; or use less of the press")
        return replace(blank, verdict=verdict_of([*one.reasons, reason, *inspection.reasons]))
    weighted = found
    held = belongs(newcomer, found.weight @ found.own)
    strangers = tuple(replace(s, specimen=one.name) for s in held.strangers)
    strays = list(_strays(replace(held, strangers=strangers)))
    known = [*one.reasons, *_unpaired(newcomer), *(strays or _could_pass_for_the_lot(held))]
    posterior, predictions, verdict = _judged(inspection, found, known)
    how: How = "weighted draws"
    effective = found.effective_draws
    if not found.trusted:
        told = f"the weights of its draws cannot be trusted (k-hat {found.k_hat:.2f}, {found.effective_draws:.0f} effective)"
        if verdict.colour == "red" or inspection.chain_seconds == 0:
            beside = ", and chains would not mend the rest" if verdict.colour == "red" else ""
            known.append(Reason("weights", "red", told + beside, "Calibrate it together with the lot"))
        else:
            chains = _chains(inspection, newcomer)
            if isinstance(chains, str):
                known.append(
                    Reason("weights", "red", f"{told}, and chains have not converged: {chains}", "Give a larger --budget")
                )
            else:
                (found, effective), how = chains, "chains"
        posterior, predictions, verdict = _judged(inspection, found, known)
    signal, stroke = signal_as_built(posterior, newcomer.forward, inspection.force, seed=seed)
    conformity = None
    beyond: list[Reason] = []
    if inspection.specification is not None:
        s = inspection.specification
        conformity = as_built(posterior, newcomer.forward, s, n_effective=effective, seed=seed)
        beyond = [*_beyond(posterior, s, newcomer.forward, seed), *_left_open(conformity, s, effective)]
    estimates = _estimates(found, newcomer.name)
    described = not strangers or not _beyond_belief(max(strangers, key=lambda s: abs(s.z)))
    modulus = estimates.get("young_modulus")
    shown = _of_draws(signal, stroke)
    mean, sd, *_ = shown.get("signal", (1.0, math.inf))
    drifts = list(drift_of_meter(sweeps, sd / abs(mean)))
    if modulus is not None:
        drifts += drift_by_share(sweeps, FirstEstimate(*modulus[:2]))
    verdict = verdict_of([*_its_own(verdict.reasons, strays, inspection.reasons, described), *drifts, *beyond])
    usable = verdict.colour != "red"
    return replace(
        blank,
        verdict=verdict,
        how=how,
        k_hat=weighted.k_hat,
        effective=effective,
        estimates=estimates | shown if usable else {},
        force=inspection.force,
        strangers=strangers,
        of_another_kind=held.of_another_kind,
        fits=_fits(predictions),
        conformity=conformity if usable else None,
    )


def _experiment_of(inspection: Inspection, one: Presented) -> Experiment:
    """The experiment of the lot with a newcomer as its one specimen."""
    lot = inspection.lot
    experiment = newcomer_experiment(lot, inspection.template, _plain_name(one.name, lot.experiment))
    return replace(experiment, specimens=(replace(experiment.specimens[0], sweeps=one.sweeps),))


def without_copies(inspection: Inspection, ones: Sequence[Presented], found: Sequence[Inspected]) -> tuple[Inspected, ...]:
    """What was found of newcomers, of which those that are one and the same press, saved in another way, must not be used.

    Files with the same readings are told before anything is inspected (`presented`). Readings that were thinned out or
    resampled are others, but make the same sensor: where two newcomers agree in all unknowns far within their uncertainty, as
    hardly any two sensors do, their presses are held against each other.

    Parameters
    ----------
    inspection : what they were inspected by.
    ones : the newcomers.
    found : of each.
    """
    reasons: dict[int, list[Reason]] = {}
    for j, k in combinations(range(len(found)), 2):
        if not _as_one(found[j], found[k]):
            continue
        first, second = (read_sweeps(_experiment_of(inspection, ones[i])) for i in (j, k))
        channels = next((c for a, b in product(first, second) if (c := repeated_channels(a, b))), ())
        for own, other in ((j, k), (k, j)) if channels else ():
            what = f"its {' and '.join(channels)} readings are those of {found[other].name}, saved in another way"
            reasons.setdefault(own, []).append(held_by_another(what))
    return tuple(
        replace(one, verdict=verdict_of([*one.verdict.reasons, *reasons[i]]), estimates={}, conformity=None)
        if i in reasons
        else one
        for i, one in enumerate(found)
    )


def _as_one(first: Inspected, second: Inspected) -> bool:
    """Whether two newcomers agree in every unknown within a share of its standard deviation."""
    one, other = first.estimates, second.estimates
    unknowns = one.keys() - {"signal", "stroke"}
    return (
        bool(unknowns)
        and one.keys() == other.keys()
        and all(abs(one[name][0] - other[name][0]) <= _AS_ONE * max(one[name][1], other[name][1]) for name in unknowns)
    )


def _of_the_lot(lot: Sequence[Sweep], sweeps: Sequence[Sweep]) -> Reason | None:
    """That a newcomer is no new one: its readings, or a part of them, are those of a specimen of the lot."""
    for known in lot:
        for sweep in sweeps:
            if channels := repeated_channels(known, sweep):
                return counted_already(known.specimen, f"{' and '.join(channels)} readings")
    return None


def counted_already(specimen: str, what: str = "readings") -> Reason:
    """What speaks against a newcomer that is a specimen of its lot.

    Parameters
    ----------
    specimen : of the lot.
    what : is the same.
    """
    finding = f"its {what} are those of {specimen} of the lot, which counts them already"
    return Reason("files", "red", finding, "Leave it out: `calib report` has what is known of it")


def held_by_another(what: str) -> Reason:
    """What speaks against newcomers of which one is a copy of the other.

    Parameters
    ----------
    what : in words, which readings it has of which other.
    """
    finding = f"{what}: of which of them they are is not known"
    return Reason("files", "red", finding, "Leave out the copy, or put the right file in its place")


def _its_own(
    reasons: Sequence[Reason], strays: Sequence[Reason], of_lot: Sequence[Reason], described: bool
) -> Iterator[Reason]:
    """Reasons of a newcomer, first that it does not belong, with what follows from that; without what the lot says already."""
    known = {reason.finding for reason in of_lot}
    rest = [r for r in reasons if r not in strays and (r.gate in OF_LOT or r.finding not in known)]
    # Where it does not belong the spread of its lot would be large, or its own contact odd: no second thing to be done about,
    # nor a word, where nothing describes it.
    follows = [r for r in rest if strays and r.gate == "prior"]
    said = follows if described else []
    for reason in strays:
        worst = next((r.level for r in follows if r.level == "red"), reason.level)
        yield replace(reason, level=worst, finding="; ".join([reason.finding, *(r.finding for r in said)]))
    yield from (r for r in rest if r not in follows)


def _plain_name(name: str, experiment: Experiment) -> str:
    """A name that an experiment may have beside those of its specimens, whatever a file is called."""
    plain = re.sub(r"[\[\](),\x00-\x1f]+", " ", name).strip() or "newcomer"
    return f"{plain} of the batch" if plain in {s.name for s in experiment.specimens} else plain


def _judged(
    inspection: Inspection, found: GivenLot, known: Sequence[Reason]
) -> tuple[Posterior, tuple[Prediction, ...], Verdict]:
    """The posterior of a newcomer in draws of equal weight, what it predicts of its own readings, and the verdict on it."""
    posterior = posterior_of(found, inspection.lot, inspection.seed)
    rng = np.random.default_rng([inspection.seed, 2])
    predictions = predict(posterior, found.newcomer.forward, rng, n_draw=_PREDICTED)
    return posterior, predictions, judge_posterior(posterior, predictions, [*known, *inspection.reasons])


def _chains(inspection: Inspection, newcomer: Newcomer) -> tuple[GivenLot, float] | str:
    """The posterior of a newcomer by chains of the whole calibration with it in, and how many independent draws it is worth.

    Or why there is none, in words.
    """
    problem = joined_problem(inspection.lot, inspection.sweeps, newcomer)
    try:
        sampled = sample(problem, seed=inspection.seed, processes=0, gate=CHAINS, max_seconds=inspection.chain_seconds)
    except NothingSampled as error:
        return str(error)
    if not sampled.diagnostics.converged:
        return sampled.diagnostics.reasons[0]
    effective = min(summary.ess_bulk for summary in sampled.diagnostics.parameters.values())
    return given_chains(sampled, newcomer, inspection.template.name), effective


def _unpaired(newcomer: Newcomer) -> Iterator[Reason]:
    """Channels that the lot was measured in and the newcomer was not: what they would tell is the lot's."""
    there = {channel for sweep in newcomer.sweeps for channel in sweep.channels}
    for channel in CHANNELS:
        if f"{channel}_noise" in newcomer.lot.values and channel not in there:
            finding = f"there is no {channel} of it: what that would tell is what the lot lets one expect"
            yield Reason(
                "channels", "amber", finding, "Put its file beside the other, with the same name but for the instrument's"
            )


def _alone(press: Press) -> Iterator[Reason]:
    """A meter's file that belongs to no press: nothing ties its readings to a depth."""
    meter = press.capacitance
    if press.force is None and meter is not None and not {"force", "displacement"} & set(meter.table.columns):
        finding = f"{meter.shown} belongs to no press: there is no file of the tester with its name, or of its time"
        yield Reason("files", "red", finding, "Put that beside it, with the same name but for the instrument's, or move it out")


# Beyond such a factor a quantity is no finding of what a specimen is, but a sign that something else is the matter.
_BEYOND_BELIEF: Mapping[str, float] = {"young_modulus": 5.0}
_OF_OTHERS = 1.4


def _beyond_belief(s: Stranger) -> bool:
    """Whether no specimen of anything like the lot has such a value."""
    return abs(math.log(s.ratio.mean)) > math.log(_BEYOND_BELIEF.get(s.quantity, _OF_OTHERS))


def _strays(held: Belonging) -> Iterator[Reason]:
    """Whether a newcomer does not belong to its lot."""
    ordered = sorted(held.strangers, key=lambda s: -abs(s.z))
    for level in LEVELS:
        limit = conflict_limit(len(ordered), level)
        off = [s for s in ordered if abs(s.z) > limit]
        if off and _beyond_belief(off[0]):
            told = " and ".join(f"{name} is up to {_percent(share)}" for name, share in held.off.items())
            finding = (
                f"it does not belong to the lot, and nothing that is believed of the lot describes it: its {told} off what is "
            )
            finding += "foretold, with contact, load zero and clock where they suit it best"
            action = "Check its files and their units, the ball, its thicknesses and what it was cast from"
            yield Reason("belongs", level, finding, f"{action}; if all is right, calibrate it by itself")
            return
        if off:
            told = "; ".join(stranger_in_words(s) for s in off[:2])
            more = f"; and {len(off) - 2} more" if len(off) > 2 else ""
            action = "Set it aside until its files, the ball, its thicknesses and what it was cast from are checked"
            action += "; where one quantity is off another looks so, too. If all is right, calibrate it by itself"
            yield Reason("belongs", level, f"it does not belong to the lot: {told}{more} than the lot lets one expect", action)
            return


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 1 else f"{100 * share:.0f} %"


def _could_pass_for_the_lot(held: Belonging) -> Iterator[Reason]:
    """Whether a newcomer of another material could pass for one of its lot, by the very test that it is held to."""
    if not held.strangers:
        finding = "whether it belongs to the lot is not told: the model covers hardly any of what the lot lets one expect of it"
        yield Reason("range", "amber", finding, "Use less of the press, or calibrate it by itself")
    quantity, z = hardly_told(held.of_another_kind)
    limit = conflict_limit(len(held.strangers))
    if z <= limit:
        finding = (
            f"whether a specimen belongs to the lot is hardly told: one whose {QUANTITIES[quantity].label} is "
            f"{100 * OFF:.0f} % off would lie {z:.1f} standard deviations off what the lot lets one expect, and is named "
            f"beyond {limit:.1f}, so that one of another kind may pass for it"
        )
        action = "Calibrate the lot with more specimens, or say in [priors] how much its specimens differ, as you know it"
        yield Reason("spread", "amber", finding, action)


def hardly_told(of_another_kind: Mapping[str, float]) -> tuple[str, float]:
    """Which quantity of the material tells least of one of another kind, and how far [1] that would lie off; "" for none.

    Parameters
    ----------
    of_another_kind : as in `Inspected`.
    """
    return min(of_another_kind.items(), key=lambda one: one[1], default=("", math.inf))


def _left_open(found: AsBuilt, s: Specification, effective: float) -> Iterator[Reason]:
    """That its draws do not tell whether it conforms with the probability that is asked for."""
    if left_open(found.probability, s.probability, found.error):
        finding = (
            f"{effective:.0f} independent draws {left_open_in_words(about(found.probability, found.error), s.probability)}"
        )
        most = most_in_percent(effective)
        action = "Measure it better, or ask for a lower probability"
        if s.probability * 100 > most:
            action = f"Ask for {most:g} % at most, which so many draws can tell, or calibrate it together with the lot"
        yield Reason("specification", "amber", finding, action)


def _beyond(posterior: Posterior, s: Specification, forward: Forward, seed: int) -> Iterator[Reason]:
    """What of the specification this specimen was not measured at."""
    middle = {p.name: np.array([posterior.diagnostics.parameters[p.name].median]) for p in posterior.parameters}
    middle |= {name: np.array([value]) for name, value in posterior.fixed.items()}
    design = specimen_design(posterior, middle, posterior.experiment.specimens[0].name, posterior.sweeps[0].name)
    radii = s.outermost_balls or (float(np.asarray(design.indenter.radius).flat[0]),)
    _, stroke = signal_as_built(posterior, forward, s.largest_force, seed=seed)
    depth = float(np.nanmedian(stroke)) if np.any(np.isfinite(stroke)) else 0.0
    padding = float(np.asarray(design.padding.thickness).flat[0])
    pressed = [replace(design.draws(), indenter=replace(design.indenter, radius=np.array([radius]))) for radius in radii]
    reaches = [predict_design(forward, one, np.array([s.largest_force])).reach[0] for one in pressed]
    covered = Covered(float(np.min(np.nan_to_num(reaches))))
    aim = Aim(s.largest_force, padding, depth, radii, signal=s.electrical)
    for reason in beyond_the_measured(posterior, aim, covered, "the specification asks for"):
        under = "that ball" if len(radii) == 1 else "these balls"
        action = f"Press specimens up to {s.largest_force:g} N with {under}"
        yield replace(reason, action=action) if covered.confirms(aim.force) else reason


def _estimates(found: GivenLot, name: str) -> dict[str, tuple[float, float, float, float]]:
    values = found.values
    there = {quantity: lookup(values, quantity, name) for quantity in POOLED}
    return {q: _summary(v, found.weight) for q, v in there.items() if v is not None and np.ptp(v) > 0}


def _of_draws(signal: FloatArray, stroke: FloatArray) -> dict[str, tuple[float, float, float, float]]:
    """Signal and stroke in numbers; nothing where a draw in twenty does not carry the load."""
    found = {}
    for name, values in (("signal", signal), ("stroke", stroke)):
        there = np.isfinite(values)
        if np.mean(there) > _CARRIED:
            found[name] = _summary(values[there], np.full(int(np.sum(there)), 1 / np.sum(there)))
    return found


def _summary(values: FloatArray, weight: FloatArray) -> tuple[float, float, float, float]:
    mean = float(weight @ values)
    ends = quantiles(values, weight, {"low": 0.05, "high": 0.95})
    return mean, math.sqrt(float(weight @ (values - mean) ** 2)), ends["low"], ends["high"]


def _fits(predictions: Sequence[Prediction]) -> dict[str, float]:
    found: dict[str, float] = {}
    for prediction in predictions:
        for channel, fit in prediction.channels.items():
            found[channel] = min(found.get(channel, 1.0), fit.check.p_value)
    return found


# --- rows ---------------------------------------------------------------------------------------------------------------


def inspected_to_plain(one: Inspected) -> dict[str, Any]:
    """A newcomer as plain values; the inverse is `inspected_from_plain`."""
    plain = {f.name: getattr(one, f.name) for f in fields(one)}
    plain["verdict"] = one.verdict.to_plain()
    plain["strangers"] = [asdict(s) for s in one.strangers]
    plain["conformity"] = None if one.conformity is None else {**asdict(one.conformity), "fails": dict(one.conformity.fails)}
    for name in ("estimates", "fits", "of_another_kind"):
        plain[name] = dict(getattr(one, name))
    return plain


def inspected_from_plain(plain: Mapping[str, Any]) -> Inspected:
    """The newcomer that `inspected_to_plain` wrote.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it did not.
    """
    read = dict(plain)
    read["files"] = tuple((name, sha256) for name, sha256 in read["files"])
    read["verdict"] = verdict_from_plain(read["verdict"])
    read["strangers"] = tuple(Stranger(**{**s, "ratio": FirstEstimate(**s["ratio"])}) for s in read["strangers"])
    read["estimates"] = {name: tuple(values) for name, values in read["estimates"].items()}
    read["conformity"] = None if read["conformity"] is None else AsBuilt(**read["conformity"])
    return Inspected(**read)
