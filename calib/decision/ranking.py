"""Possible measurements with what each would tell in, words, next.json and the experiment file of the next lab out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from calib.checks import Verdict
from calib.decision.release import Decided
from calib.decision.target import Asked
from calib.decision.words import percent
from calib.digits import two_digits, with_uncertainty
from calib.errors import Fault, InputError
from calib.experiment import Experiment, experiment_toml
from calib.records import exact_record_from_text, record_to_text

#: Layout version of next.json.
FORMAT = 4
_KIND = "next measurements"
#: Gate of a ranking that is a hint only.
LINEARISATION = "linearisation"
#: Gate of a specification that no thickness meets.
UNMET = "specification"

# Less than this share of the sd is nothing.
_NOTHING = 0.005
# A decision that is wrong less often than this is sure.
_SURE = 0.001
# Shares of a limit below this are not told apart.
_SHORT = 1e-5
# From this share of the loss on nothing is decided better by knowing all unknowns.
_SAME = 0.97
# Measurements that a report shows.
_SHOWN = 3


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
    ranked : the measurements, by what they take away of the sd, or of the loss of deciding, for an hour in the lab; of those
        that take away nothing first what confirms an advice beyond the data.
    unjudged : measurements of which nothing is said, each with the reason.
    rests_on : what the ranking takes for granted, in words.
    verdict : on the calibration, and on whether linearisation does.
    forward_name : the model that predicted.
    seed : of the choice of draws.
    draws_sha256 : of the draws that it follows from, see `calib.Posterior.draws_sha256`.
    deciding : on a specification; None where none is asked for.
    beyond : in what the advice goes beyond the data: force, padding, depth, ball, capacitance; none of a modulus.
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
    draws_sha256: str = field(default="")
    deciding: Deciding | None = None
    beyond: tuple[str, ...] = ()
    else_beyond: bool = False

    def relative(self, sd: float) -> str:
        """A standard deviation as people read it: in per cent of the mean, with the digits that it deserves."""
        return f"{two_digits(100 * sd / abs(self.mean))} %"

    def brings(self, one: Measurement) -> str:
        """What a measurement would bring, in words."""
        if self.settles_all(one) and not one.tells:
            return f"holds the model against data where the advice goes beyond them ({', '.join(self.beyond)})"
        if self.deciding is not None and one.decided is not None:
            return f"{wrong_in_words(one.decided)} instead of {wrong_in_words(self.deciding.now)}"
        name = "modulus" if self.asked == "modulus" else "signal"
        then, now = self.relative(one.sd), self.relative(self.sd)
        return (
            f"{name} ±{then} instead of ±{now}"
            if then != now
            else f"{name} ±{now}, narrower by {100 * one.reduction:.1g} % of it"
        )

    def confirms(self, one: Measurement) -> bool:
        """Whether the advice would go beyond the data in nothing with it: the gate extrapolation of its verdict green."""
        return bool(self.beyond) and not self.else_beyond and one.settles == self.beyond

    def settles_all(self, one: Measurement) -> bool:
        """Whether it holds the model against data in all that the advice goes beyond them in."""
        return bool(self.beyond) and one.settles == self.beyond

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
        done = [(k, one) for k, one in enumerate(self.ranked, 1) if self.settles_all(one)]
        if done:
            number, one = min(done, key=lambda pair: pair[1].minutes)
            if not one.tells:
                rest = f"; not for what the draws would tell of it, but as no reading there speaks for the advice yet{rest}"
            what = "Green on extrapolation" if not self.else_beyond else "Within the measured force, padding, depth and ball"
            return f"{what} with number {number} of all: {one.what}{rest}. "
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
            if one.tells or self.settles_all(one)
        )
        doubts = tuple(reason.finding for reason in self.verdict.reasons if reason.gate == LINEARISATION)
        return NextInShort(self.asked, self.label, self.in_words, first, doubts=doubts)

    @property
    def in_words(self) -> str:
        """What to measure next, in a few sentences."""
        if self.deciding is not None:
            return f"{self._warning}{self._decision_in_words(self.deciding)}{self._confirming_in_words}".strip()
        scale, unit = (1e-6, "MPa") if self.asked == "modulus" else (100.0, "%")
        known = f"{with_uncertainty(self.mean * scale, self.sd * scale)} {unit} (±{self.relative(self.sd)} of it)"
        text = f"{self.label[0].upper()}{self.label[1:]} is {known}. "
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
            if math.isfinite(self.regret) and self.regret > 0:
                after = f", {percent_of_few(useful[0].regret)} after it" if useful else ""
                lost = f"{percent_of_few(self.regret)} of its signal{after}"
                text += f"For not knowing the sensor better the padding is expected to lose {lost}. "
        return f"{self._warning}{text}{self._confirming_in_words}".strip()

    @property
    def _warning(self) -> str:
        return f"Do not plan by this: {self.verdict.reasons[0].finding}. " if self.verdict.colour == "red" else ""

    @property
    def _in_doubt(self) -> tuple[str, ...]:
        """Gates that are not green.

        That the specification is not met is no doubt but a finding; what speaks against one that is met, as draws that leave it
        open do, is a doubt.
        """
        met = self.deciding is not None and self.deciding.released
        return tuple(dict.fromkeys(reason.gate for reason in self.verdict.reasons if met or reason.gate != UNMET))

    def _decision_in_words(self, d: Deciding) -> str:
        """What is decided now, how often wrongly, and what would change that; nothing where the verdict is red."""
        what = f"{self.label[0].upper()}{self.label[1:]}"
        if self.verdict.colour == "red":
            return f"{what}: nothing is decided on it. Settle what is red first, then ask again. "
        useful = [one for one in self.ranked if one.tells]
        text = f"{what}: {self._decided_in_words(d)}{self._worth_in_words(d, useful)}"
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

    def _decided_in_words(self, d: Deciding) -> str:
        """What is decided, and how often wrongly; with a verdict that is not green nothing is decided in favour."""
        asked, share = f"{100 * d.asked:g} % asked for", percent(d.probability)
        if not d.released:
            return (
                f"held back, as sensors on the best padding conform with {share} only ({asked}). Of all, "
                f"{percent_of_few(d.now.wrong_hold)} would be held back wrongly. "
            )
        wrong = percent_of_few(d.now.wrong_release)
        if self._in_doubt:
            return (
                f"not decided yet, as the verdict is {self.verdict.colour} ({', '.join(self._in_doubt)}). By the draws alone "
                f"sensors on the best padding conform with {share} ({asked}), and {wrong} of all would be passed wrongly. "
            )
        told = f"released, as sensors on the best padding conform with {share} ({asked})"
        return f"{told}. Of all, {wrong} would be released wrongly. "

    def _worth_in_words(self, d: Deciding, useful: Sequence[Measurement]) -> str:
        """Which measurement is worth its time; none is only said where nothing is in doubt."""
        if useful and not d.nothing_to_gain:
            text = f"Most for an hour in the lab: {self.in_lab_terms(useful[0])}. "
            most = max(useful, key=lambda one: one.reduction)
            return text if most is useful[0] else f"{text}Most in all: {self.in_lab_terms(most)}. "
        if self._in_doubt:
            return (
                "By the draws alone none of the measurements that were tried would change that: settle first what is in doubt "
                f"({', '.join(self._in_doubt)}). "
            )
        if self.verdict.colour != "green":
            return "No measurement that was tried turns that: change what the specification asks for, or the sensor. "
        if d.nothing_to_gain:
            return "So sure is that already that no measurement is worth its time for this decision. "
        return "No measurement that was tried is worth its time for this decision: none makes it wrong less often. "

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
        "draws_sha256": found.draws_sha256,
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


def next_from_json(text: str, path: Path | None = None, draws_sha256: str | None = None) -> NextInShort | None:
    """Read as much as a report shows of what `next_to_json` wrote.

    Parameters
    ----------
    text : of the file.
    path : of the file, to be named if it is refused.
    draws_sha256 : of the draws that it must be of; None for any.

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
        if draws_sha256 is not None and record["draws_sha256"] != draws_sha256:
            return None
        first = tuple(
            ShortMeasurement(*(one[f.name] for f in fields(ShortMeasurement)))
            for one in record["ranked"][:_SHOWN]
            if one["reduction"] >= _NOTHING or (one["settles"] and one["settles"] == record["beyond_the_data_in"])
        )
        doubts = tuple(one["finding"] for one in record["verdict"]["reasons"] if one["gate"] == LINEARISATION)
        return NextInShort(record["for"], record["target"]["label"], record["said"], first, doubts=doubts)
    except (ValueError, KeyError, TypeError) as error:
        message = f"this is not what `calib next` has written ({error})"
        raise InputError(Fault(message, path, advice="Delete it, or run `calib next` again")) from None


def _files_in(experiment: Experiment, folder: Path) -> Experiment:
    """The experiment with the files that are still to be made in a folder."""

    def moved(path: Path | None) -> Path | None:
        return path if path is None or path.is_absolute() else folder / path

    specimens = tuple(
        replace(s, sweeps=tuple(replace(f, force=moved(f.force), capacitance=moved(f.capacitance)) for f in s.sweeps))
        for s in experiment.specimens
    )
    return replace(experiment, specimens=specimens)
