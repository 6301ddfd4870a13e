"""A problem in, the reasons against its files, geometry and priors out, and what its data will tell: nothing is sampled.

Three looks, each of which costs what it must: what the priors expect at a glance (hundredths of a second); a mode of the
posterior, and how far it lies from the priors (tenths); and, only where something is suspicious, the same for every slip that
may have been made (`slips`), a tenth of a second each, and for every other model, a second each: a base that slips looks like
a ball of another size.

A slip is named where the data are a thousand times as probable without it as with it, and so is another model. If the file is
right, that happens in one of a thousand labs at most, whatever the priors and however many unknowns: the expectation of
p(data | slip) / p(data | file) over data that come about as the file says is 1, so that it exceeds K with a probability of at
most 1 / K (Markov; Good, 1950).
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from calib.catalogue import QUANTITIES, SCALES
from calib.checks.departures import problem_under, values_near
from calib.checks.plausible.base_friction import base_friction
from calib.checks.plausible.conflicts import (
    DOUBTFUL,
    HIGH_SCALE,
    WRONG,
    WRONG_SCALE,
    Conflict,
    Conflicts,
    conflicts_in,
)
from calib.checks.plausible.outlook import Outlook, outlook_of
from calib.checks.plausible.ranges import IMPOSSIBLE, UNLIKELY, USUAL, Range, farthest, ranges_of
from calib.checks.plausible.slips import Slip, slips_of
from calib.checks.plausible.unmodelled import unmodelled
from calib.checks.verdict import Level, Reason, Verdict, verdict_of
from calib.errors import Fault, InputError
from calib.experiment import (
    Experiment,
    files_of_others,
    held_twice,
    kinds_of,
    line_of_variant,
    model_in_words,
    readings_of_sweeps,
    variants_of,
)
from calib.lab import Sweep, as_one_piece, check_name, repeated_channels
from calib.problem import Problem, build_problem, columns_at, values_at
from calib.sampling import FirstAnswer, Look, answer_of, climb_from, log_evidence_at, look_at
from models.response import Forward

#: Logarithm of how many times as probable the data must be without a slip for it to be named.
PREFERRED = math.log(1000.0)
#: And for it to be no question any more: nothing is calibrated with it.
DECISIVE = math.log(1e6)
#: Gate of what the checks of the lab files say, which a report has by itself.
FILES = "lab files"
# Sd [m] of a thickness below which no gauge of a lab tells that of a soft layer.
_FINEST = 0.2e-6
_THICKNESSES = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
# Share of the prior's draws that must be covered for a slip to be believed.
_COVERED = 0.5
# Of more unknowns than this a look at a mode takes too long to be taken for every slip.
_MOST_WEIGHED = 60
# Slips and conflicts that are named, and bad grades, at most.
_MOST_SLIPS, _MOST_CONFLICTS, _MOST_GRADES = 2, 3, 4
# What is seen at a glance -> the quantity whose unit it is shown in, and what to look at if it is out of the way.
_SHOWN = {
    "force": (
        "load_zero",
        "Look at the unit of the force, the radius of the ball, the thicknesses and the prior of young_modulus",
    ),
    "depth": ("sensor_thickness", ""),
    "rest capacitance": (
        "parasitic_capacitance",
        "Look at the radius of the electrodes, at thickness and number of the dielectrics, and whether the file is of this "
        "specimen",
    ),
    "capacitance change": (
        "parasitic_capacitance",
        "Look whether this file is of this press, at the radius of the ball and of the electrodes, and at the thicknesses",
    ),
}


@dataclass(frozen=True)
class Plausibility:
    """What can be said of a calibration before anything is sampled.

    Attributes
    ----------
    reasons : what speaks against files, geometry and priors, the worst first.
    ranges : what the priors expect of every sweep at a glance, beside what was read.
    outlook : what the data will tell of each unknown; None where the reasons leave no sense in it, or no mode was looked for.
    first : the first answer; None likewise, or where there is none.
    seconds_of_climb : processor time of the look at a mode [s]; 0 if there was none.
    """

    reasons: tuple[Reason, ...]
    ranges: tuple[Range, ...]
    outlook: Outlook | None
    first: FirstAnswer | None
    seconds_of_climb: float = 0.0

    @property
    def verdict(self) -> Verdict:
        """The reasons with their colour: red if a calibration is not worth its time."""
        return verdict_of(self.reasons)


def plausibility(problem: Problem) -> Plausibility:
    """Find what is implausible in a calibration before anything is sampled, and what its data will tell.

    Parameters
    ----------
    problem : from `build_problem`.

    Returns
    -------
    The reasons for doubt; none for a sound lab but for one in fifty at most (docs/check.md).
    """
    ranges = ranges_of(problem)
    files = (*_of_one_record(problem), *_of_names(problem), *_of_gauges(problem), *_of_files(problem))
    unlikely = farthest(ranges) > UNLIKELY
    began = time.process_time()
    # A posterior of data that cannot be says nothing.
    look = None if farthest(ranges) > IMPOSSIBLE else _look_at(problem)
    seconds = time.process_time() - began
    if look is None:
        repairs = repairs_of(problem.experiment, problem.sweeps, problem.forward) if unlikely else []
        reasons = (*_of_ranges(problem, ranges, repairs), *files, *base_friction(problem, None))
        return Plausibility(verdict_of(reasons).reasons, ranges, None, None)
    conflicts = conflicts_in(look)
    within = list(_within(problem, hidden_only=not (unlikely or conflicts.suspicious)))
    # What contradicts the priors is red, and so is the slip that explains it; by itself a slip is a question up to `DECISIVE`.
    level: Level = "red" if conflicts.wrong else "amber"
    by_gain = _preferred(look, within, level)
    if conflicts.suspicious:  # another model is none that a slip explains the data by far better than
        beaten = by_gain[0][0] - PREFERRED if by_gain else -math.inf
        by_gain += [found for found in _of_models(look, level) if found[0] > beaten]
    preferred = [reason for _, reason in sorted(by_gain, key=lambda found: -found[0])]
    repairs = [slip for slip, _ in within] if unlikely and not preferred else []
    verdict = verdict_of((*preferred, *_of_ranges(problem, ranges, repairs), *_of_conflicts(conflicts), *files))
    try:
        first = answer_of(look)
    except ValueError:
        verdict = verdict_of((*verdict.reasons, *base_friction(problem, None)))
        return Plausibility(verdict.reasons, ranges, None, None, seconds)
    verdict = verdict_of((*verdict.reasons, *unmodelled(problem, first)))
    if verdict.colour != "red":
        verdict = verdict_of((*verdict.reasons, *base_friction(problem, first)))
    return Plausibility(verdict.reasons, ranges, None if verdict.colour == "red" else outlook_of(look), first, seconds)


# --- reasons ------------------------------------------------------------------------------------------------------------


def _of_files(problem: Problem) -> Iterator[Reason]:
    bad = [grade for sweep in problem.sweeps for grade in sweep.grades if grade.level == "bad"]
    for grade in bad[:_MOST_GRADES]:
        more = (
            f" (and {len(bad) - _MOST_GRADES} more that are bad)"
            if grade is bad[:_MOST_GRADES][-1] and len(bad) > _MOST_GRADES
            else ""
        )
        yield Reason(FILES, "amber", f"{grade.file}, {check_name(grade)}: {grade.finding}{more}", grade.advice.rstrip("."))


def _of_gauges(problem: Problem) -> Iterator[Reason]:
    """Thicknesses that are believed to be known better than they can be measured: a unit, or a digit too many."""
    for p in problem.parameters:
        low, high = (float(p.prior.ppf_normal(np.array(z))) for z in (-1.0, 1.0))
        if p.parameter in _THICKNESSES and high - low < 2 * _FINEST:
            finding = f"the prior of {p.name} knows it to {(high - low) / 2e-9:.2g} nm, which no gauge tells of a soft layer"
            yield Reason("prior", "amber", finding, "Look at its sd and the unit of that, and give what the gauge can tell")


# Share of the pairs of a lot that are alike by chance, at most: 0.3 % where layers differ by 1 % (sd), 1 % by half that.
_BY_CHANCE = 0.03
_AS_SWEEPS = "Give presses of one piece as sweeps of one specimen ([[specimens.sweeps]]); two pieces need nothing"


def _of_one_record(problem: Problem) -> Iterator[Reason]:
    """Two sweeps of the same readings, as where one file was entered for two, or saved anew; or two presses in one record."""
    experiment = problem.experiment
    entries = {(s.name, e.name): e for s in experiment.specimens for e in s.sweeps}
    several = len(experiment.specimens) > 1  # or their files need not be read again
    held = list(held_twice(readings_of_sweeps(experiment, problem.sweeps))) if several else []
    told = {frozenset(pair) for pair in held}
    alike: list[str] = []
    for first, second in combinations(problem.sweeps, 2):
        pair = frozenset({first.specimen, second.specimen})
        if same := repeated_channels(first, second):
            finding = f"{first.title} and {second.title} have the same readings of {' and '.join(same)}"
            yield Reason("same readings", "red", finding, "Give each of them its own file, specimen or cycle")
            told.add(pair)
            held = [names for names in held if frozenset(names) != pair]
        if pair in told or len(pair) < 2:
            continue
        one, other = (entries.get((sweep.specimen, sweep.name)) for sweep in (first, second))
        if one is not None and other is not None and one.shares_record_with(other):
            told.add(pair)
            finding = (
                f"{first.title} and {second.title} are presses in one record, {first.files[0][0] if first.files else '?'}, as "
                "of one piece: what all presses of a piece share would count twice, and the modulus come out too sure"
            )
            yield Reason("same readings", "amber", finding, _AS_SWEEPS)
        elif as_one_piece(first, second):
            told.add(pair)
            alike.append(f"{first.specimen} and {second.specimen}")
    for one_name, other_name in held:
        finding = f"files of {one_name} and {other_name} hold the same readings, however they were cut, zeroed or saved"
        yield Reason("same readings", "red", finding, "Give each of them its own file, specimen or cycle")
    if len(alike) > _BY_CHANCE * math.comb(len(experiment.specimens), 2):
        more = f" (and {len(alike) - 1} more pairs)" if len(alike) > 1 else ""
        finding = (
            f"{alike[0]}{more} are alike to the noise of their presses, as one piece that was pressed again: what all presses "
            "of a piece share would count twice, and the modulus come out too sure"
        )
        yield Reason("same readings", "amber", finding, _AS_SWEEPS)


def _of_names(problem: Problem) -> Iterator[Reason]:
    """Files entered for one specimen that say that they are of another: physics tells only where nominals are far apart."""
    strange = files_of_others(problem.experiment)
    if not strange:
        return
    told = "; ".join(
        f"the file {one.file}, entered for {one.specimen}, {one.says} like one of {one.other}" for one in strange[:2]
    )
    more = f" (and {len(strange) - 2} more)" if len(strange) > 2 else ""
    advice = "Enter each file for its own specimen; if all is right, give the specimens the names that their files have"
    yield Reason("names", "amber", f"{told}{more}", advice)


def _of_ranges(problem: Problem, ranges: Sequence[Range], repairs: Sequence[Slip]) -> Iterator[Reason]:
    """One reason for each quantity that is out of the way, of the sweep where it is worst."""
    asked = [*_asked(repairs), *(_of_another_kind(problem) if farthest(ranges) > UNLIKELY else ())]
    for seen, (quantity, advice) in _SHOWN.items():
        out = [r for r in ranges if r.seen == seen and r.counts and abs(r.away) > UNLIKELY]
        if not out:
            continue
        worst = max(out, key=lambda r: abs(r.away))
        level: Level = "red" if abs(worst.away) > IMPOSSIBLE else "amber"
        files = ", ".join(name for sweep in problem.sweeps if sweep.title == worst.sweep for name, _ in sweep.files)
        where = f"{worst.sweep} ({files})" if files else worst.sweep
        finding = f"{where}: a {seen} of {in_units(quantity, worst.observed)} measured, {expected_in_words(worst)} expected"
        if seen == "rest capacitance" and (permittivity := _implied_permittivity(problem, worst)):
            finding += f": it means a relative permittivity of {permittivity:.3g}"
        if len(out) > 1:
            finding += f" (and so in {len(out) - 1} more)"
        yield Reason(seen, level, finding, "; or ".join(asked) or advice)


def _implied_permittivity(problem: Problem, found: Range) -> float:
    values = values_at(problem, np.zeros((1, len(problem.parameters))), ["relative_permittivity"])
    permittivity = values.get("relative_permittivity")
    return 0.0 if permittivity is None else float(permittivity[0]) * found.observed / found.middle


def _asked(slips: Sequence[Slip]) -> list[str]:
    """The questions that slips raise, which would bring all into the way that is expected."""
    named = list({slip.gate: slip for slip in reversed(slips)}.values())[::-1][:_MOST_SLIPS]
    return [f"{slip.question}: with {slip.without} all would be as expected" for slip in named]


def _of_another_kind(problem: Problem) -> Iterator[str]:
    """The question whether the sensor is of another kind, if there are models that expect all that was read."""
    found = []
    for variant in kinds_of(problem.experiment):
        try:
            if farthest(ranges_of(other := problem_under(problem, variant))) < USUAL:
                line = line_of_variant(problem.experiment, variant)
                found.append(_changed(problem, other) + (f", {line}" if line else ""))
        except (InputError, ValueError):
            continue
    if found:
        yield f"look whether the sensor is of another kind, of which all would be as expected: {'; '.join(found)}"


def _of_conflicts(conflicts: Conflicts) -> Iterator[Reason]:
    told = 0
    for c in conflicts.unknowns:
        doubtful, wrong = (HIGH_SCALE, WRONG_SCALE) if c.is_scale else (DOUBTFUL, WRONG)
        if abs(c.away) > doubtful and told < _MOST_CONFLICTS:
            told += 1
            yield Reason("prior", "red" if abs(c.away) > wrong else "amber", _conflict_in_words(c), _advice_on(c))
    yield from conflicts.cut[:_MOST_CONFLICTS]
    if not told and conflicts.together > DOUBTFUL:
        level: Level = "red" if conflicts.together > WRONG else "amber"
        names = " and ".join(c.parameter.name for c in [c for c in conflicts.unknowns if not c.is_scale][:2])
        finding = f"all priors together contradict the data ({conflicts.together:.1f} sd), {names} most"
        yield Reason("prior", level, finding, "Look at the geometry, at thicknesses and their uncertainties, and at the files")
    if conflicts.misfit > DOUBTFUL:
        level = "red" if conflicts.misfit > WRONG else "amber"
        finding = (
            f"no values of the unknowns describe the readings (misfit {conflicts.misfit:.1f} sd above what noise explains)"
        )
        yield Reason("misfit", level, finding, "Look at the lab files, and whether they are of these specimens")


def _conflict_in_words(c: Conflict) -> str:
    name, (low, high) = c.parameter.parameter, c.expected
    bounds = f"{in_units(name, low, unit=False)} to {in_units(name, high)}"
    return f"the data put {c.parameter.name} at about {in_units(name, c.mean)}, {bounds} expected by its prior"


def _advice_on(c: Conflict) -> str:
    if c.parameter.parameter.endswith("_discrepancy"):
        return "Look at the radius of the ball, at the thicknesses, and whether the file is of this press"
    if c.is_scale:
        return "Look at the lab file, whether it is of this press, and at its unit"
    return "Look at this prior and its unit, and whether the files are of these specimens"


def in_units(quantity: str, value: float, *, unit: bool = True) -> str:
    """A value with three digits and no exponent, in the unit for people.

    Parameters
    ----------
    quantity : a key of `calib.catalogue.QUANTITIES`.
    value : SI.
    unit : whether to name it.

    >>> in_units("load_zero", 5001.23), in_units("parasitic_capacitance", 98.41e-12)
    ('5,001 N', '98.4 pF')
    """
    row = QUANTITIES[quantity]
    shown = value * row.display_scale
    digits = 0 if shown == 0 or not math.isfinite(shown) else max(0, 2 - math.floor(math.log10(abs(shown))))
    return f"{shown:,.{min(digits, 9)}f}{f' {row.display_unit}' if unit else ''}".rstrip()


def measured_in_words(found: Range) -> str:
    """What was read, as people read it, and whether that is outside of what is expected."""
    beyond = "" if found.low <= found.observed <= found.high else ", outside"
    return f"{in_units(_SHOWN[found.seen][0], found.observed)}{beyond}"


def expected_in_words(found: Range) -> str:
    """Between which values 99 % of what is expected lies, as people read it."""
    quantity = _SHOWN[found.seen][0]
    if not math.isfinite(found.high):
        return f"{in_units(quantity, found.low)} or more"
    return f"{in_units(quantity, found.low, unit=False)} to {in_units(quantity, found.high)}"


# --- slips --------------------------------------------------------------------------------------------------------------


def ways_out(faults: Sequence[Fault], experiment: Experiment, sweeps: Sequence[Sweep], forward: Forward) -> list[Fault]:
    """Faults for which a problem was refused, and what to do about them: the slips without which it would not be.

    Parameters
    ----------
    faults : as `build_problem` found them.
    experiment, sweeps, forward : what it was given.

    Returns
    -------
    The faults; one more if slips are found.
    """
    asked = "; or ".join(_asked(repairs_of(experiment, sweeps, forward)))
    return [*faults, *([Fault("a slip may be the cause", experiment.path, advice=asked)] if asked else [])]


def repairs_of(experiment: Experiment, sweeps: Sequence[Sweep], forward: Forward) -> list[Slip]:
    """The slips without which all data would be as expected; of those of the same data the ones that explain them by far best.

    Parameters
    ----------
    experiment, sweeps, forward : what a problem is built of.
    """
    found = list(_expected(slips_of(experiment, sweeps), forward))
    weighed = [(slip, other) for slip, other in found if slip.same_data]
    if len(weighed) < 2 or len(weighed[0][1].parameters) > _MOST_WEIGHED:
        return [slip for slip, _ in found]
    evidence = {slip: _evidence(other) for slip, other in weighed}
    best = max(evidence.values())
    return [slip for slip, _ in found if not slip.same_data or evidence[slip] > best - PREFERRED]


def _changed(problem: Problem, other: Problem) -> str:
    own, theirs = (model_in_words(p.experiment).split(", ") for p in (problem, other))
    return ", ".join(word for word in theirs if word not in own)


def _of_models(look: Look, level: Level) -> Iterator[tuple[float, Reason]]:
    """A reason for the model under which the data are by far most probable, if that is not the stated one, and by how much."""
    problem = look.problem
    near = values_near(dict(zip(problem.names, (look.weight @ columns_at(problem, look.theta)).tolist(), strict=True)))
    best, found = look.log_evidence + PREFERRED, None
    for variant in kinds_of(problem.experiment):
        try:
            other = look_at(problem_under(problem, variant), near, best)
        except (InputError, ValueError):
            continue
        if other.confirmed and other.log_evidence > best and not conflicts_in(other).wrong:
            best, found = other.log_evidence, (other, variant)
    if found is not None:
        model, variant = found
        gain = best - look.log_evidence
        times = f"10^{gain / math.log(10):.0f} times as probable"
        finding = f"under another model ({_changed(problem, model.problem)}) the data would be {times}"
        values = dict(zip(model.problem.names, model.weight @ columns_at(model.problem, model.theta), strict=True))
        if (modulus := values.get("young_modulus")) is not None:
            finding += f", and young_modulus about {in_units('young_modulus', float(modulus))}"
        line = line_of_variant(problem.experiment, variant)
        question = "Look whether the sensor is of that kind" + (f", and if it is set {line}" if line else "")
        if variant in variants_of(problem.experiment):
            question += "; `calib compare` calibrates every model that is not ruled out beyond doubt"
        yield gain, Reason("model", level, finding, question)


def _evidence(problem: Problem) -> float:
    look = _look_at(problem)
    return -math.inf if look is None else look.log_evidence


def _look_at(problem: Problem) -> Look | None:
    """A look at a mode; None for too many unknowns, or a matrix that is singular."""
    try:
        return look_at(problem)
    except ValueError:
        return None


def _within(problem: Problem, *, hidden_only: bool) -> Iterator[tuple[Slip, Problem]]:
    slips = slips_of(problem.experiment, problem.sweeps)
    return _expected((slip for slip in slips if slip.hidden or not hidden_only), problem.forward)


def _expected(slips: Iterable[Slip], forward: Forward) -> Iterator[tuple[Slip, Problem]]:
    """Those without which everything would be as expected, and the problems without them."""
    for slip in slips:
        try:
            other = build_problem(slip.experiment, slip.sweeps, forward)
        except (InputError, ValueError):  # without this slip it would be refused, too: it was none
            continue
        ranges = ranges_of(other)
        seen = {r.sweep for r in ranges}
        told = all(sweep.title in seen for sweep in other.sweeps) and all(r.covered > _COVERED for r in ranges if r.counts)
        if other.parameters and told and farthest(ranges) < USUAL:
            yield slip, other


def _are_one(slip: Slip, other: Slip) -> bool:
    """Whether two slips exchange files of the same two specimens: one question, whichever files it is told by."""
    return bool(slip.exchange[0]) and slip.exchange[0] == other.exchange[0]


def _preferred(look: Look, slips: Sequence[tuple[Slip, Problem]], level: Level) -> list[tuple[float, Reason]]:
    """A reason for each slip without which the data are so much more probable that it must be asked for, and by how much."""
    stated = log_evidence_at(look.space, look.mode)
    found = []
    for slip, other in slips:
        if not slip.same_data or other.names != look.problem.names:
            continue
        space, mode = climb_from(other, look.space, look.mode, afresh=level == "red")
        gain = log_evidence_at(space, mode) - stated
        if gain > PREFERRED:
            # The mode of the file as it stands may be a false one: it is also looked for from here.
            gain = min(gain, gain + stated - log_evidence_at(*climb_from(look.problem, space, mode)))
            theta, _ = space.to_theta(mode[None])
            scales = [z for z, p in zip(theta[0], other.parameters, strict=True) if p.parameter in SCALES]
            if gain > PREFERRED and max(scales, default=0.0) < HIGH_SCALE:
                found.append((gain, slip, values_at(other, theta)))
    found.sort(key=lambda f: -f[0])
    reasons = []
    told = [f for k, f in enumerate(found) if not any(_are_one(f[1], before) for _, before, _ in found[:k])]
    for gain, slip, values in told[:_MOST_SLIPS]:
        others = [(g, other.exchange[1]) for g, other, _ in found if other is not slip and _are_one(slip, other)]
        ways = [f"their {what} files instead: 10^{g / math.log(10):.0f} times" for g, what in others]
        same = f" (or {', or '.join(ways)})" if ways else ""
        finding = f"with {slip.without}{same} the data would be 10^{gain / math.log(10):.0f} times as probable"
        if (modulus := values.get("young_modulus")) is not None:
            finding += f", and young_modulus about {in_units('young_modulus', float(modulus[0]))}"
        reasons.append((gain, Reason(slip.gate, "red" if gain > DECISIVE else level, finding, slip.question)))
    return reasons
