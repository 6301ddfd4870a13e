"""A posterior and what is asked of it in, the measurements that would tell most of it for an hour in the lab out.

By linearisation, with u the noises, the discrepancies and the spread of a lot, at draws of the posterior:

    A(u) = P(u) + I(u),   A'(u) = A(u) + I'(u),   sd'^2 = sd^2 - s^2 (1 - E g^T A'^-1 g / E g^T A^-1 g)                 (1)

P what is believed before the data, I and I' what the readings tell that there are and those of a measurement
(`calib.decision.gain`), g the slope of the target, sd what is not known of it, and s the part of that which the unknowns
cause, both by the draws of the posterior. All unknowns that a measurement brings are among those of A'. E is over u: on average
over what may be read the variance that is left is that mean, whatever u turns out to be.

Of a specification what is asked is the decision itself: g are the directions that its margins hang on
(`calib.decision.hinges`), and of the draws of sensors that may be built it is told what would be decided after a measurement
that leaves g^T A'^-1 g of g^T A^-1 g, and how often wrongly (`calib.decision.release`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from calib.catalogue import spread_of
from calib.checks import Reason, Verdict, judge_posterior, verdict_of
from calib.decision.candidates import Candidate, Known, candidates_of, largest_load
from calib.decision.choices import choices_of
from calib.decision.conformity import Conformity
from calib.decision.extrapolation import EXTRAPOLATION, Aim, Measured, exceeded, measured_presses
from calib.decision.gain import CovarianceTimes, covariance, present_knowledge, with_measurement
from calib.decision.hinges import hinges_of
from calib.decision.padding import recommend
from calib.decision.release import Decided, Options, after_reading, known_exactly, options_of
from calib.decision.requirement import Requirement
from calib.decision.specified import answer
from calib.decision.target import Asked, LearningTarget, modulus_target, regret, signal_target
from calib.decision.words import percent
from calib.errors import Fault, InputError
from calib.experiment import Bench, Experiment, Specification, experiment_toml
from calib.problem import Problem, coordinates_of, plan_sweeps
from calib.records import exact_record_from_text, record_to_text
from calib.sampling import Posterior
from models.response import Forward, OutOfRangeError
from models.sensor import FloatArray, IntArray

#: Layout version of next.json.
FORMAT = 3
_KIND = "next measurements"

# Draws of the scales, fewer where there are so many unknowns.
_DRAWS, _MANY, _FEW_DRAWS = 64, 100, 16
# By more than this share the sd by linearisation may not be off that of the draws; less than this share of the sd is nothing.
_NORMAL, _NOTHING = 0.2, 0.005
# A decision that is wrong less often than this is sure; less than so many standard errors of a loss are chance.
_SURE, _CHANCE = 0.001, 2.0
# Shares of a limit below this are not told apart.
_SHORT = 1e-5
# From this share of the loss on nothing is decided better by knowing all unknowns.
_SAME = 0.97
# Gate of a ranking that is a hint only.
_LINEARISATION = "linearisation"
_STAYING = (
    "the advice staying where it is: a padding that a calibration with the measurement advises instead, more than a tenth off, "
    "would be beyond the data again"
)
# Measurements that a report shows.
_SHOWN = 3
# Draws of sensors by which decisions are judged, at least, of several that may be built down to this part of them; and most
# thicknesses of padding among which decisions are made.
_SENSORS, _FEWER, _STEPS = 4000, 4, 91


@dataclass(frozen=True, eq=False)
class Measurement:
    """What one measurement would tell.

    Attributes
    ----------
    kind : of a press (`calib.experiment.PRESSES`), or the quantity that is read (`calib.experiment.READINGS`).
    what : in words of the lab.
    minutes : in the lab.
    sd : SI, of the target after it; nan where that is a specification.
    reduction : share of the target's sd that it takes away; of a specification of the loss of deciding (`Decided`), 0 where
        that is no more than chance.
    per_hour : [1/h], the same for an hour in the lab.
    regret : share of the best signal that is expected to be lost after it, of a specification that of `Decided`; nan where the
        target is a modulus.
    experiment : with it, lab files to be put in.
    notes : what is to be put in there.
    decided : what is expected to be decided after it on a specification, and how often wrongly; None where there is none.
    settles : of what the advice goes beyond the data in (`NextMeasurements.beyond`), what it no longer would with it.
    """

    kind: str
    what: str
    minutes: float
    sd: float
    reduction: float
    per_hour: float
    regret: float
    experiment: Experiment
    notes: dict[tuple[str, str], str]
    decided: Decided | None = None
    settles: tuple[str, ...] = ()

    @property
    def tells(self) -> bool:
        """Whether it takes away anything to speak of."""
        return self.reduction >= _NOTHING


@dataclass(frozen=True, eq=False)
class Deciding:
    """What is decided on a specification by what is known now, and what would be if all unknowns were known.

    Attributes
    ----------
    asked : [1], the probability of conforming that the specification asks for.
    probability : [1], of conforming on the padding that does so most probably.
    released : whether that is enough, and such sensors are released.
    now : how often that is wrong.
    exactly : what is expected of deciding once all unknowns are known: scatter, noise and the model's own error are left.
    """

    asked: float
    probability: float
    released: bool
    now: Decided
    exactly: Decided

    @property
    def nothing_to_gain(self) -> bool:
        """Whether it is hardly ever wrong: as good as all such sensors conform, or none."""
        return max(self.now.wrong_release, self.now.wrong_hold) < _SURE


@dataclass(frozen=True)
class ShortMeasurement:
    """One measurement as a report shows it: what to do, what it brings in words, minutes, reduction and that per hour [1]."""

    what: str
    brings: str
    minutes: float
    reduction: float
    per_hour: float


@dataclass(frozen=True)
class NextInShort:
    """What to measure next as a report shows it.

    Attributes
    ----------
    asked, label, said : as of `NextMeasurements`, the last in words.
    first : the first three that tell anything.
    why_not : why nothing is said, in words; "" if something is.
    doubts : what makes the ranking a hint, in words.
    """

    asked: Asked
    label: str
    said: str
    first: tuple[ShortMeasurement, ...]
    why_not: str = ""
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class NextMeasurements:
    """What to measure next; `next_measurements` makes it. SI throughout.

    Attributes
    ----------
    asked : "modulus" or "padding": what is to be known better; or "spec": on what it is to be decided more surely.
    label : of that, for people.
    mean, sd : of it now; of a specification the probability of conforming, and nan.
    by_unknowns : the part of `sd` that the unknowns cause, and measurements can take away; nan of a specification.
    regret : share of the best signal that is expected to be lost now, of a specification that of `Decided`; nan of a modulus.
    ranked : the measurements, by what they take away of the sd, or of the loss of deciding, for an hour in the lab.
    unjudged : measurements of which nothing is said, each with the reason.
    rests_on : what the ranking takes for granted, in words.
    verdict : on the calibration, and on whether linearisation does.
    forward_name : the model that predicted.
    seed : of the choice of draws.
    posterior_sha256 : hash of the posterior's file, empty if there is none.
    deciding : on a specification; None where none is asked for.
    beyond : in what the advice goes beyond the data: force, padding, depth, ball; none of a modulus.
    else_beyond : whether it goes beyond them in something else, too, such as another material.
    """

    asked: Asked
    label: str
    mean: float
    sd: float
    by_unknowns: float
    regret: float
    ranked: tuple[Measurement, ...]
    unjudged: tuple[str, ...]
    rests_on: tuple[str, ...]
    verdict: Verdict
    forward_name: str
    seed: int
    posterior_sha256: str = field(default="")
    deciding: Deciding | None = None
    beyond: tuple[str, ...] = ()
    else_beyond: bool = False

    def relative(self, sd: float) -> str:
        """A standard deviation as people read it: in per cent of the mean."""
        return f"{100 * sd / abs(self.mean):.3g} %"

    def brings(self, one: Measurement) -> str:
        """What a measurement would bring, in words."""
        if self.deciding is not None and one.decided is not None:
            return f"{wrong_in_words(one.decided)} instead of {wrong_in_words(self.deciding.now)}"
        name = "modulus" if self.asked == "modulus" else "signal"
        return f"{name} ±{self.relative(one.sd)} instead of ±{self.relative(self.sd)}"

    def confirms(self, one: Measurement) -> bool:
        """Whether the advice would go beyond the data in nothing with it: the gate extrapolation of its verdict green."""
        return bool(self.beyond) and not self.else_beyond and one.settles == self.beyond

    def settled_in_words(self, one: Measurement) -> str:
        """What of the verdict's extrapolation it takes away: "all: green", or "force" and the like; "" for nothing."""
        if self.confirms(one):
            return "all: green"
        return ", ".join(one.settles)

    @property
    def _confirming_in_words(self) -> str:
        """Which measurement takes the extrapolation from the verdict, in a sentence; "" where there is none to take."""
        if not self.beyond:
            return ""
        rest = "; the rest of it is left" if self.else_beyond else ""
        done = [(k, one) for k, one in enumerate(self.ranked, 1) if one.settles == self.beyond]
        if done:
            number, one = min(done, key=lambda pair: pair[1].minutes)
            what = "Green on extrapolation" if not rest else "Within the measured force, padding, depth and ball"
            return f"{what} with number {number}: {one.what}{rest}. "
        most = max(self.ranked, key=lambda one: len(one.settles), default=None)
        if most is None or not most.settles:
            return "None of them takes the extrapolation from the verdict. "
        left = " and ".join(kind for kind in self.beyond if kind not in most.settles)
        return f"None of them by itself takes all of the extrapolation from the verdict: {most.what} leaves {left}. "

    def in_lab_terms(self, one: Measurement) -> str:
        """One measurement in a line: what to do, what it would bring, and how long it takes."""
        return f"{one.what}: {self.brings(one)}, {one.minutes:.0f} min"

    @property
    def in_short(self) -> NextInShort:
        """The first three, for a report."""
        first = tuple(
            ShortMeasurement(one.what, self.brings(one), one.minutes, one.reduction, one.per_hour)
            for one in self.ranked[:_SHOWN]
            if one.tells
        )
        doubts = tuple(reason.finding for reason in self.verdict.reasons if reason.gate == _LINEARISATION)
        return NextInShort(self.asked, self.label, self.in_words, first, doubts=doubts)

    @property
    def in_words(self) -> str:
        """What to measure next, in a few sentences."""
        if self.deciding is not None:
            return f"{self._warning}{self._decision_in_words(self.deciding)}{self._confirming_in_words}".strip()
        mean = f"{self.mean * 1e-6:.4g} MPa" if self.asked == "modulus" else f"{self.mean * 100:.3g} %"
        text = f"{self.label[0].upper()}{self.label[1:]} is {mean} ± {self.relative(self.sd)}. "
        useful = [one for one in self.ranked if one.tells]
        if useful:
            text += f"Most for an hour in the lab: {self.in_lab_terms(useful[0])}. "
            most = min(useful, key=lambda one: one.sd)
            if most is not useful[0]:
                text += f"Most in all: {self.in_lab_terms(most)}. "
            repeat = next((one for one in self.ranked if one.kind == "repeat"), None)
            if repeat is not None and repeat is not useful[0]:
                gain = useful[0].per_hour / repeat.per_hour if repeat.per_hour > 0 else math.inf
                times = f"{gain:.1f} times as much for an hour" if gain < 100 else "far more for an hour"
                text += f"That is {times} as pressing once more in the same way. "
        else:
            text += "Nothing that was tried would make it narrower by half a per cent. "
        if self.asked == "padding":
            left = math.sqrt(max(1 - (self.by_unknowns / self.sd) ** 2, 0.0))
            rest = self.relative(left * self.sd)
            text += f"Discrepancy, model error and differences between sensors, ±{rest}, are left by all. "
            if math.isfinite(self.regret):
                after = f", {100 * useful[0].regret:.2g} % after it" if useful else ""
                text += (
                    f"For not knowing the sensor better the padding is expected to lose {100 * self.regret:.2g} % of its signal"
                    f"{after}. "
                )
        return f"{self._warning}{text}{self._confirming_in_words}".strip()

    @property
    def _warning(self) -> str:
        return f"Do not plan by this: {self.verdict.reasons[0].finding}. " if self.verdict.colour == "red" else ""

    def _decision_in_words(self, d: Deciding) -> str:
        """What is decided now, how often wrongly, and what would change that."""
        asked, what = f"{100 * d.asked:g} %", f"{self.label[0].upper()}{self.label[1:]}"
        if d.released:
            text = (
                f"{what}: released, as sensors on the best padding conform with {percent(d.probability)} ({asked} asked for). "
            )
            text += f"Of all, {percent_of_few(d.now.wrong_release)} would be released wrongly. "
        else:
            text = (
                f"{what}: held back, as sensors on the best padding conform with {percent(d.probability)} only ({asked} "
                f"asked for). Of all, {percent_of_few(d.now.wrong_hold)} would be held back wrongly. "
            )
        useful = [one for one in self.ranked if one.tells]
        if d.nothing_to_gain:
            text += "So sure is that already that no measurement is worth its time for this decision. "
        elif useful:
            text += f"Most for an hour in the lab: {self.in_lab_terms(useful[0])}. "
            most = max(useful, key=lambda one: one.reduction)
            if most is not useful[0]:
                text += f"Most in all: {self.in_lab_terms(most)}. "
        else:
            text += "No measurement that was tried is worth its time for this decision: none makes it wrong less often. "
        if not d.nothing_to_gain and d.exactly.loss > _SAME * d.now.loss:
            text += (
                "As far as the draws tell it would not be decided better if all unknowns were known: the doubt is in "
                "tolerances, spread, noise, and what the model leaves out. "
            )
        elif not d.nothing_to_gain:
            text += f"With all unknowns known it would be {wrong_in_words(d.exactly)}, for what scatters. "
        after = f", {shortfall_in_words(useful[0].regret)} after the first" if useful else ""
        return (
            f"{text}For not knowing the sensors better the padding falls short by {shortfall_in_words(self.regret)} of a limit "
            f"more than that which is best for each{after}. "
        )

    def draft(self, number: int, folder: Path) -> str:
        """The experiment file with a measurement in it, to be completed where it is marked EDIT.

        Parameters
        ----------
        number : of the measurement in the ranking, from 1.
        folder : absolute, of the file, which lab files are named relative to.

        Raises
        ------
        InputError
            If there is no measurement of this number.
        """
        if not 1 <= number <= len(self.ranked):
            raise InputError(Fault(f"there is no measurement {number}, only 1 to {len(self.ranked)}"))
        one = self.ranked[number - 1]
        experiment = _files_in(one.experiment, folder)
        head = ("Experiment file with one more measurement, drafted by `calib next`:", f"  {self.in_lab_terms(one)}.", *_HEAD)
        return experiment_toml(experiment, folder, one.notes, head)


def wrong_in_words(decided: Decided) -> str:
    """Both ways of deciding wrongly, such as "4.1 % released wrongly and 0.2 % held back wrongly"."""
    shares = [(decided.wrong_release, "released wrongly"), (decided.wrong_hold, "held back wrongly")]
    told = " and ".join(f"{percent_of_few(share)} {words}" for share, words in shares)
    return f"{told} at most" if decided.share < 1 else told


def shortfall_in_words(share: float) -> str:
    """A shortfall in per cent of a limit.

    >>> shortfall_in_words(0.0014), shortfall_in_words(1e-7)
    ('0.14 %', 'below 0.001 %')
    """
    return percent_of_few(share, _SHORT)


def percent_of_few(share: float, least: float = 0.001) -> str:
    """Write a share that may be small in per cent.

    Parameters
    ----------
    share : [1].
    least : [1], below which no number is given.

    Examples
    --------
    >>> percent_of_few(0.0413), percent_of_few(0.0002), percent_of_few(0.9955)
    ('4.1 %', 'below 0.1 %', 'more than 99 %')
    """
    if share >= 0.0995:
        return percent(share)
    return f"{100 * share:.2g} %" if share >= least else f"below {100 * least:g} %"


_HEAD = (
    "Comments of the file that it follows from are left out. Put in what is marked EDIT and remove the mark, then:",
    "  calib check FILE",
)


def next_measurements(
    posterior: Posterior,
    forward: Forward,
    requirement: Requirement | Specification | None = None,
    bench: Bench | None = None,
    *,
    seed: int,
    posterior_sha256: str = "",
    verdict: Verdict | None = None,
) -> NextMeasurements:
    """Say which measurement would make Young's modulus, or the signal on padding, better known, or a decision more often right.

    Presses (once more, deeper, another ball, another specimen or padding) and quantities that are read by themselves (a
    thickness, the machine's compliance, ...) are ranked by how much of the standard deviation each is expected to take away for
    an hour in the lab: (1); for a specification by how much of the loss of deciding on it wrongly. Nothing is sampled.

    Parameters
    ----------
    posterior : of the calibration, of one model.
    forward : the model that predicts, a surrogate or a closed form.
    requirement : the load and the thicknesses to choose from, or the specification that is to be met; None for the modulus.
    bench : what the lab can measure; usual values by default.
    seed : of the choice of draws.
    posterior_sha256 : hash of the posterior's file, kept with the result.
    verdict : on the calibration; None to judge the posterior here, without its predictions.

    Raises
    ------
    InputError
        If the posterior is an average of models, what is asked is fixed, or the model covers no thickness of the request.
    """
    if posterior.of_model is not None:
        advice = "Ask the runs that it averages, one by one"
        raise InputError(Fault("this run is an average: each of its models would learn something else", advice=advice))
    rng = np.random.default_rng(seed)
    known = _known(posterior, forward)
    reasons = list((judge_posterior(posterior) if verdict is None else verdict).reasons)
    decision, aim = None, None
    if requirement is None:
        target = modulus_target(posterior, known)
    elif isinstance(requirement, Specification):
        decision, conformity, aim = _decision(posterior, known, requirement, seed, verdict_of(reasons))
        target, reasons = decision.target(conformity), list(conformity.verdict.reasons)
    else:
        recommended = recommend(posterior, forward, requirement, seed=seed, verdict=verdict_of(reasons))
        reasons = list(recommended.verdict.reasons)
        target = signal_target(posterior, known, requirement, recommended.best, rng)
        depth = float(np.nan_to_num(recommended.depth_at_best[2]))
        aim = Aim(requirement.force, recommended.best, depth, recommended.indenter_radius)
    n_draw = _FEW_DRAWS if known.middle.size > _MANY else _DRAWS
    rows = rng.choice(len(known.draws), min(n_draw, len(known.draws)), replace=False)
    spread = _spread_of(posterior, known, rows)
    try:
        present = present_knowledge(known, known.draws[rows], spread)
    except OutOfRangeError as error:
        message = f"the middle of the posterior lies at the end of what the model covers ({error})"
        raise InputError(Fault(message, advice="Use less of the sweep, see `calib check`")) from None
    now = covariance(present)
    before = target.variance(now) if decision is None else math.nan
    reasons += _not_normal(target, before) if decision is None else _not_normal_along(decision, now)
    presses = measured_presses(posterior)
    beyond = {} if aim is None else exceeded(presses, aim)
    candidates, unjudged = candidates_of(known, bench or Bench(), aim)
    along = _along(target, now)
    found = []
    for candidate in candidates:
        try:
            after = covariance(with_measurement(present, candidate))
        except (OutOfRangeError, np.linalg.LinAlgError) as error:
            unjudged.append(f"{candidate.what}: {error}")
            continue
        made = (
            _measurement(target, candidate, after, before, along)
            if decision is None
            else _deciding_measurement(decision, candidate, after, now)
        )
        found.append((candidate.alike, replace(made, settles=_settled(beyond, presses, candidate, aim))))
    ranked = tuple(_ranked(found, target.regret))
    return NextMeasurements(
        target.asked,
        target.label,
        target.mean,
        target.sd,
        target.by_unknowns,
        target.regret,
        ranked,
        tuple(unjudged),
        (
            *_rests_on(target, known, bench or Bench(), aim, None if decision is None else (decision, ranked)),
            *((_STAYING,) if beyond else ()),
        ),
        verdict_of(reasons),
        forward.name,
        seed,
        posterior_sha256,
        None if decision is None else decision.deciding,
        tuple(beyond),
        sum(reason.gate == EXTRAPOLATION for reason in reasons) > bool(beyond),
    )


def _settled(beyond: Iterable[str], presses: Sequence[Measured], candidate: Candidate, aim: Aim | None) -> tuple[str, ...]:
    """In what an advice would no longer go beyond the data with a measurement."""
    if aim is None or candidate.press is None:
        return ()
    left = exceeded([*presses, candidate.press], aim)
    return tuple(kind for kind in beyond if kind not in left)


def next_to_json(found: NextMeasurements, fingerprint: str = "") -> str:
    """Write what to measure next for other programs: SI, nan as null, and in words.

    Parameters
    ----------
    found : to be written.
    fingerprint : of the run that it is of; empty if it is of none.
    """

    def plain(one: Measurement) -> dict[str, Any]:
        names = ("kind", "what", "minutes", "sd", "reduction", "per_hour", "regret")
        said = {"said": found.in_lab_terms(one), "brings": found.brings(one), **{name: getattr(one, name) for name in names}}
        said |= {"settles": list(one.settles), "confirms": found.confirms(one)}
        if one.decided is None:
            return said
        less = (found.regret - one.regret) / (one.minutes / 60)
        return {**said, "decided": asdict(one.decided), "regret_per_hour": less}

    content = {
        "fingerprint": fingerprint,
        "posterior_sha256": found.posterior_sha256,
        "verdict": found.verdict.to_plain(),
        "said": found.in_words,
        "for": found.asked,
        "target": {
            "label": found.label,
            "unit": "Pa" if found.asked == "modulus" else "",
            "mean": found.mean,
            "sd": found.sd,
            "sd_by_unknowns": found.by_unknowns,
            "regret": found.regret,
        },
        **({} if found.deciding is None else {"deciding": asdict(found.deciding)}),
        "beyond_the_data_in": list(found.beyond),
        "beyond_otherwise": found.else_beyond,
        "ranked": [plain(one) for one in found.ranked],
        "not_judged": list(found.unjudged),
        "rests_on": list(found.rests_on),
        "forward_name": found.forward_name,
        "seed": found.seed,
    }
    return record_to_text(_KIND, FORMAT, content)


def next_from_json(text: str, path: Path | None = None, posterior_sha256: str | None = None) -> NextInShort | None:
    """Read as much as a report shows of what `next_to_json` wrote.

    Parameters
    ----------
    text : of the file.
    path : of the file, to be named if it is refused.
    posterior_sha256 : of the posterior that it must be of; None for any.

    Returns
    -------
    None where it is of another posterior.

    Raises
    ------
    InputError
        If the text is not, to the last byte, what was written in this format.
    """
    try:
        record = exact_record_from_text(_KIND, FORMAT, text)
        if posterior_sha256 is not None and record["posterior_sha256"] != posterior_sha256:
            return None
        first = tuple(
            ShortMeasurement(*(one[f.name] for f in fields(ShortMeasurement)))
            for one in record["ranked"][:_SHOWN]
            if one["reduction"] >= _NOTHING
        )
        doubts = tuple(one["finding"] for one in record["verdict"]["reasons"] if one["gate"] == _LINEARISATION)
        return NextInShort(record["for"], record["target"]["label"], record["said"], first, doubts=doubts)
    except (ValueError, KeyError, TypeError) as error:
        message = f"this is not what `calib next` has written ({error})"
        raise InputError(Fault(message, path, advice="Delete it, or run `calib next` again")) from None


# --- what is known ------------------------------------------------------------------------------------------------------


def _known(posterior: Posterior, forward: Forward) -> Known:
    """The calibration as a problem, and its posterior in coordinates."""
    plans = plan_sweeps(posterior.sweeps)
    infos = posterior.unknowns
    problem = Problem(posterior.experiment, posterior.sweeps, forward, infos, posterior.fixed, plans)
    draws = coordinates_of(problem, posterior.draws.reshape(-1, posterior.draws.shape[-1])[:, : len(infos)])
    draws = draws[np.all(np.isfinite(draws), axis=1)]
    if len(draws) < 2 * len(infos):
        raise InputError(Fault("the posterior has too few draws", advice="Sample for longer: --resume with a larger --budget"))
    return Known(problem, np.asarray(np.mean(draws, axis=0), dtype=float), draws)


def _spread_of(posterior: Posterior, known: Known, rows: IntArray) -> FloatArray:
    """Draws of the spread of each quantity of a lot, (n_draw, n_lot)."""
    names = [info.name for info in posterior.parameters]
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])[rows]
    spreads = [spread_of(lot.quantity) for lot in known.problem.table.lots]
    columns = [flat[:, names.index(s)] if s in names else np.full(rows.size, posterior.fixed[s]) for s in spreads]
    return np.stack(columns, axis=1) if columns else np.zeros((rows.size, 0))


# --- deciding on a specification ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Decision:
    """A decision on a specification: what it is on, the draws it is made with, and what these hang on.

    `directions` (n_state, n_direction) are those of the unknowns, `width` (n_direction, n_direction) is the covariance of the
    draws along them, `error` [1] that of the probability of conforming, for as many draws as the posterior's are worth.
    """

    specification: Specification
    options: Options
    directions: FloatArray
    width: FloatArray
    deciding: Deciding
    error: float

    def target(self, conformity: Conformity) -> LearningTarget:
        """What is asked, for people."""
        name = f"specification {self.specification.name}" if self.specification.name else "specification"
        nothing = np.empty((0, 0))
        p = conformity.best.best_probability
        return LearningTarget("spec", name, p, math.nan, math.nan, nothing, nothing, np.empty(0), self.deciding.now.regret)

    def left(self, before: CovarianceTimes, after: CovarianceTimes) -> FloatArray:
        """What a measurement leaves unknown along the directions, where it is 1 before, (n_direction, n_direction)."""
        now, then = (_along_directions(self.directions, times) for times in (before, after))
        narrow = _root(now, -0.5)
        return np.asarray(narrow @ then @ narrow, dtype=float)


def _along_directions(directions: FloatArray, times: CovarianceTimes) -> FloatArray:
    """Covariance along directions, the mean over the scales, (n_direction, n_direction)."""
    return np.asarray(np.mean(directions.T @ times(directions), axis=0), dtype=float)


def _root(covariance: FloatArray, power: float) -> FloatArray:
    """A power of a symmetric matrix, (n, n)."""
    value, vector = np.linalg.eigh(0.5 * (covariance + covariance.T))
    least = 1e-12 * np.max(value, initial=1e-300)
    return np.asarray((vector * np.maximum(value, least) ** power) @ vector.T, dtype=float)


def _decision(
    posterior: Posterior, known: Known, specification: Specification, seed: int, verdict: Verdict
) -> tuple[_Decision, Conformity, Aim]:
    """Decide on a specification by what is known, keep the draws, and say what the advice is for."""
    n_choice = sum(len(group) for group in choices_of(specification))
    n_draw = max(specification.n_draw, _SENSORS // min(n_choice, _FEWER))
    more = replace(specification, n_draw=n_draw, steps=min(specification.steps, _STEPS))
    answered = answer(posterior, known.problem.forward, more, seed=seed, verdict=verdict)
    hinges = hinges_of(posterior, known, more, answered.tried, answered.sensors.values[0])
    width = np.atleast_2d(np.cov(hinges.draws[hinges.there], rowvar=False)) if hinges.draws.shape[1] else np.zeros((0, 0))
    along = np.where(hinges.there[:, None], hinges.draws @ _root(width, -0.5), np.nan)
    options = options_of(answered.tried, along, specification.probability)
    deciding = Deciding(specification.probability, options.probability, options.released, options.now, known_exactly(options))
    error = answered.conformity.best.best_error
    made = _Decision(specification, options, hinges.directions, width, deciding, error)
    return made, answered.conformity, answered.aim


def _deciding_measurement(
    decision: _Decision, candidate: Candidate, after: CovarianceTimes, before: CovarianceTimes
) -> Measurement:
    now = decision.deciding.now
    decided = after_reading(decision.options, decision.left(before, after)) if decision.width.size else now
    gain = now.loss - decided.loss
    if decision.deciding.nothing_to_gain or not gain > _CHANCE * decided.error:
        gain, decided = 0.0, replace(now, regret=decided.regret, error=decided.error, share=decided.share)
    reduction = gain / now.loss if gain > 0 else 0.0
    per_hour = reduction / (candidate.minutes / 60)
    notes = dict(candidate.notes)
    return Measurement(
        candidate.kind,
        candidate.what,
        candidate.minutes,
        math.nan,
        reduction,
        per_hour,
        decided.regret,
        candidate.experiment,
        notes,
        decided,
    )


def _not_normal_along(decision: _Decision, now: CovarianceTimes) -> list[Reason]:
    """A reason for doubt where along what margins hang on the sd by linearisation is not that of the draws."""
    if not decision.width.size:
        return []
    narrow = _root(decision.width, -0.5)
    ratio = np.sqrt(np.linalg.eigvalsh(narrow @ _along_directions(decision.directions, now) @ narrow))
    worst = float(ratio[np.argmax(np.abs(np.log(ratio)))])
    if abs(worst - 1) <= _NORMAL:
        return []
    finding = (
        f"by linearisation the sd of what the margins of the specification hang on is {worst:.2f} times that of the draws: the "
        "posterior is not nearly normal"
    )
    return [Reason(_LINEARISATION, "amber", finding, "Take the ranking as a hint, and try the first two or three")]


# --- what is said of it -------------------------------------------------------------------------------------------------


def _along(target: LearningTarget, now: CovarianceTimes) -> FloatArray:
    """Covariance of the signals on padding of each thickness, the mean over the scales; empty for a modulus."""
    if not target.along.size:
        return np.empty((0, 0))
    return np.asarray(np.mean(target.along @ now(target.along.T), axis=0), dtype=float)


def _measurement(
    target: LearningTarget, candidate: Candidate, after: CovarianceTimes, before: float, along: FloatArray
) -> Measurement:
    share = min(target.variance(after) / before, 1.0) if before > 0 else 1.0
    sd = math.sqrt(max(target.sd**2 - target.by_unknowns**2 * (1 - share), 0.0))
    reduction = 1 - sd / target.sd if target.sd > 0 else 0.0
    left = regret(target, along, _along(target, after)) if along.size else math.nan
    per_hour = reduction / (candidate.minutes / 60)
    notes = dict(candidate.notes)
    return Measurement(
        candidate.kind, candidate.what, candidate.minutes, sd, reduction, per_hour, left, candidate.experiment, notes
    )


def _ranked(found: Sequence[tuple[str, Measurement]], regret_now: float) -> list[Measurement]:
    """The most for an hour first; of those that differ in nothing but the specimen the best one."""

    def by(one: Measurement) -> tuple[float, float, float]:
        # Where no decision changes, what padding is chosen may still fall less short.
        less = 0.0 if one.decided is None else (one.regret - regret_now) / one.minutes
        return -one.per_hour, less, one.minutes

    best: dict[str, Measurement] = {}
    for alike, one in sorted(found, key=lambda pair: by(pair[1])):
        best.setdefault(alike, one)
    return sorted(best.values(), key=by)


def _not_normal(target: LearningTarget, before: float) -> list[Reason]:
    """A reason for doubt where the sd by linearisation is not that of the draws."""
    linear = math.sqrt(max(before, 0.0))
    if target.by_unknowns > 0 and abs(linear / target.by_unknowns - 1) <= _NORMAL:
        return []
    finding = (
        f"by linearisation the sd of {target.label} is {linear / target.by_unknowns if target.by_unknowns else math.inf:.2f} "
        "times that of the draws: the posterior is not nearly normal"
    )
    return [Reason(_LINEARISATION, "amber", finding, "Take the ranking as a hint, and try the first two or three")]


def _rests_on(
    target: LearningTarget,
    known: Known,
    bench: Bench,
    aim: Aim | None,
    decided: tuple[_Decision, Sequence[Measurement]] | None,
) -> tuple[str, ...]:
    """What the ranking takes for granted."""
    experiment = known.problem.experiment
    load = largest_load(known, bench, aim)
    asked_for = aim is not None and load == aim.force
    why = "" if bench.load_cell is not None else "the load that is asked for" if asked_for else "twice what was measured"
    said = [
        "readings linear in the unknowns near the middle of the posterior, and what is not known of them nearly normal",
        "the model of this run being right, as far as its discrepancy says",
        "priors of the contact, load zero and clock of a press as in this run, its noise and discrepancy, too",
        (f"tester, load cell and sensor bearing up to {load:.3g} N" + (f", {why}, as nothing was said of them" if why else "")),
        "times in the lab, and how well a quantity is read by itself, as in docs/next.md or in the bench file",
    ]
    if experiment.discrepancy == "on":
        said.append(
            "a press of the same specimen under the same ball repeating what the model left out of the earlier ones, and "
            "another ball, specimen or padding having a misfit of its own"
        )
    if experiment.pooling == "complete" and len(experiment.specimens) >= 1:
        said.append("one modulus for all specimens, those that are still to be made included")
    if target.asked == "padding":
        said.append("new padding of the same material, and a thickness that is met exactly")
    if decided is not None:
        said += _decision_rests_on(*decided)
    return tuple(said)


def _decision_rests_on(decision: _Decision, ranked: Sequence[Measurement]) -> list[str]:
    p = decision.specification.probability
    said = [
        (
            f"a sensor that is released and does not conform costing {p / (1 - p):.3g} times as much as one that is held back "
            f"and would, which is what {100 * p:g} % asks for"
        ),
        "what a measurement tells of noise and discrepancy themselves being nothing; both scatter as they do now",
    ]
    if any(one.kind in ("specimen", "padding") for one in ranked):
        said.append("deciding for sensors like those measured now, not for one that is made to learn from")
    if abs(decision.deciding.probability - p) < 2 * decision.error:
        said.append(
            f"a probability of conforming that the draws leave open by ± {200 * decision.error:.2g} %: on which side of "
            f"{100 * p:g} % it lies, and with it what a measurement turns"
        )
    weak = [(one, one.decided.share) for one in ranked if one.decided is not None and one.decided.share < 1]
    if weak:
        told = "; ".join(f"{one.what} ({100 * share:.2g} %)" for one, share in weak[:5])
        said.append(
            "measurements that tell more than re-weighted draws carry being weakened to this share of what they tell, so that "
            f"they bring at least what is said: {told}"
        )
    return said


def _files_in(experiment: Experiment, folder: Path) -> Experiment:
    """The experiment with the files that are still to be made in a folder."""

    def moved(path: Path | None) -> Path | None:
        return path if path is None or path.is_absolute() else folder / path

    specimens = tuple(
        replace(s, sweeps=tuple(replace(f, force=moved(f.force), capacitance=moved(f.capacitance)) for f in s.sweeps))
        for s in experiment.specimens
    )
    return replace(experiment, specimens=specimens)
