"""A posterior and what is asked of it in, the measurements that would tell most of it for an hour in the lab out.

By linearisation, with u the noises, the discrepancies and the spread of a lot, at draws of the posterior:

    A(u) = P(u) + I(u),   A'(u) = A(u) + I'(u),   sd'^2 = sd^2 - s^2 (1 - E g^T A'^-1 g / E g^T A^-1 g)                 (1)

P what is believed before the data, I and I' what the readings tell that there are and those of a measurement
(`calib.decision.gain`), g the slope of the target, sd what is not known of it, and s the part of that which the unknowns
cause, both by the draws of the posterior. All unknowns that a measurement brings are among those of A'. E is over u: on average
over what may be read the variance that is left is that mean, whatever u turns out to be.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from calib.catalogue import spread_of
from calib.checks import Reason, Verdict, judge_posterior, verdict_of
from calib.decision.candidates import Candidate, Known, candidates_of, largest_load
from calib.decision.gain import CovarianceTimes, covariance, present_knowledge, with_measurement
from calib.decision.padding import recommend
from calib.decision.requirement import Requirement
from calib.decision.target import Asked, Target, modulus_target, regret, signal_target
from calib.errors import Fault, InputError
from calib.experiment import Bench, Experiment, experiment_toml
from calib.problem import Problem, coordinates_of, plan_sweep
from calib.records import record_to_text
from calib.sampling import Posterior
from models.response import Forward, OutOfRangeError
from models.sensor import FloatArray, IntArray

#: Layout version of next.json.
FORMAT = 1
_KIND = "next measurements"

# Draws of the scales, fewer where there are so many unknowns.
_DRAWS, _MANY, _FEW_DRAWS = 64, 100, 16
# By more than this share the sd by linearisation may not be off that of the draws; less than this share of the sd is nothing.
_NORMAL, _NOTHING = 0.2, 0.005


@dataclass(frozen=True, eq=False)
class Measurement:
    """What one measurement would tell.

    Attributes
    ----------
    kind : of a press (`calib.experiment.PRESSES`), or the quantity that is read (`calib.experiment.READINGS`).
    what : in words of the lab.
    minutes : in the lab.
    sd : SI, of the target after it.
    reduction : share of the target's sd that it takes away.
    per_hour : [1/h], the same for an hour in the lab.
    regret : share of the best signal that is expected to be lost after it; nan where the target is no padding.
    experiment : with it, lab files to be put in.
    notes : what is to be put in there.
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

    @property
    def tells(self) -> bool:
        """Whether it takes away anything to speak of."""
        return self.reduction >= _NOTHING


@dataclass(frozen=True, eq=False)
class NextMeasurements:
    """What to measure next; `next_measurements` makes it. SI throughout.

    Attributes
    ----------
    asked : "modulus" or "padding": what is to be known better.
    label : of that, for people.
    mean, sd : of it now.
    by_unknowns : the part of `sd` that the unknowns cause, and measurements can take away.
    regret : share of the best signal that is expected to be lost now; nan where no padding is asked for.
    ranked : the measurements, by what they take away of the sd for an hour in the lab.
    unjudged : measurements of which nothing is said, each with the reason.
    rests_on : what the ranking takes for granted, in words.
    verdict : on the calibration, and on whether linearisation does.
    forward_name : the model that predicted.
    seed : of the choice of draws.
    posterior_sha256 : hash of the posterior's file, empty if there is none.
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

    def relative(self, sd: float) -> str:
        """A standard deviation as people read it: in per cent of the mean."""
        return f"{100 * sd / abs(self.mean):.3g} %"

    def in_lab_terms(self, one: Measurement) -> str:
        """One measurement in a line: what to do, what it would bring, and how long it takes."""
        name = "modulus" if self.asked == "modulus" else "signal"
        return f"{one.what}: {name} ±{self.relative(one.sd)} instead of ±{self.relative(self.sd)}, {one.minutes:.0f} min"

    @property
    def in_words(self) -> str:
        """What to measure next, in a few sentences."""
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
        if self.verdict.colour == "red":
            text = f"Do not plan by this: {self.verdict.reasons[0].finding}. {text}"
        return text.strip()

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


_HEAD = (
    "Comments of the file that it follows from are left out. Put in what is marked EDIT and remove the mark, then:",
    "  calib check FILE",
)


def next_measurements(
    posterior: Posterior,
    forward: Forward,
    requirement: Requirement | None = None,
    bench: Bench | None = None,
    *,
    seed: int,
    posterior_sha256: str = "",
    verdict: Verdict | None = None,
) -> NextMeasurements:
    """Say which measurement would make Young's modulus, or the signal on the recommended padding, better known.

    Presses (once more, deeper, another ball, another specimen or padding) and quantities that are read by themselves (a
    thickness, the machine's compliance, ...) are ranked by how much of the standard deviation each is expected to take away for
    an hour in the lab: (1). Nothing is sampled.

    Parameters
    ----------
    posterior : of the calibration, of one model.
    forward : the model that predicts, a surrogate or a closed form.
    requirement : the load and the thicknesses to choose from; None to ask for the modulus.
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
    if requirement is None:
        target = modulus_target(posterior, known)
    else:
        recommended = recommend(posterior, forward, requirement, seed=seed, verdict=verdict_of(reasons))
        reasons = list(recommended.verdict.reasons)
        target = signal_target(posterior, known, requirement, recommended.best, rng)
    n_draw = _FEW_DRAWS if known.middle.size > _MANY else _DRAWS
    rows = rng.choice(len(known.draws), min(n_draw, len(known.draws)), replace=False)
    spread = _spread_of(posterior, known, rows)
    try:
        present = present_knowledge(known, known.draws[rows], spread)
    except OutOfRangeError as error:
        message = f"the middle of the posterior lies at the end of what the model covers ({error})"
        raise InputError(Fault(message, advice="Use less of the sweep, see `calib check`")) from None
    now = covariance(present)
    before = target.variance(now)
    reasons += _not_normal(target, before)
    candidates, unjudged = candidates_of(known, bench or Bench())
    along = _along(target, now)
    found = []
    for candidate in candidates:
        try:
            after = covariance(with_measurement(present, candidate))
        except (OutOfRangeError, np.linalg.LinAlgError) as error:
            unjudged.append(f"{candidate.what}: {error}")
            continue
        found.append((candidate.alike, _measurement(target, candidate, after, before, along)))
    return NextMeasurements(
        target.asked,
        target.label,
        target.mean,
        target.sd,
        target.by_unknowns,
        target.regret,
        tuple(_ranked(found)),
        tuple(unjudged),
        _rests_on(target, known, bench or Bench()),
        verdict_of(reasons),
        forward.name,
        seed,
        posterior_sha256,
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
        return {"said": found.in_lab_terms(one), **{name: getattr(one, name) for name in names}}

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
        "ranked": [plain(one) for one in found.ranked],
        "not_judged": list(found.unjudged),
        "rests_on": list(found.rests_on),
        "forward_name": found.forward_name,
        "seed": found.seed,
    }
    return record_to_text(_KIND, FORMAT, content)


# --- what is known ------------------------------------------------------------------------------------------------------


def _known(posterior: Posterior, forward: Forward) -> Known:
    """The calibration as a problem, and its posterior in coordinates."""
    plans = tuple(plan_sweep(sweep) for sweep in posterior.sweeps)
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


# --- what is said of it -------------------------------------------------------------------------------------------------


def _along(target: Target, now: CovarianceTimes) -> FloatArray:
    """Covariance of the signals on padding of each thickness, the mean over the scales; empty for a modulus."""
    if not target.along.size:
        return np.empty((0, 0))
    return np.asarray(np.mean(target.along @ now(target.along.T), axis=0), dtype=float)


def _measurement(target: Target, candidate: Candidate, after: CovarianceTimes, before: float, along: FloatArray) -> Measurement:
    share = min(target.variance(after) / before, 1.0) if before > 0 else 1.0
    sd = math.sqrt(max(target.sd**2 - target.by_unknowns**2 * (1 - share), 0.0))
    reduction = 1 - sd / target.sd if target.sd > 0 else 0.0
    left = regret(target, along, _along(target, after)) if along.size else math.nan
    per_hour = reduction / (candidate.minutes / 60)
    notes = dict(candidate.notes)
    return Measurement(
        candidate.kind, candidate.what, candidate.minutes, sd, reduction, per_hour, left, candidate.experiment, notes
    )


def _ranked(found: Sequence[tuple[str, Measurement]]) -> list[Measurement]:
    """The most for an hour first; of those that differ in nothing but the specimen the best one."""
    best: dict[str, Measurement] = {}
    for alike, one in sorted(found, key=lambda pair: -pair[1].per_hour):
        best.setdefault(alike, one)
    return sorted(best.values(), key=lambda one: (-one.per_hour, one.minutes))


def _not_normal(target: Target, before: float) -> list[Reason]:
    """A reason for doubt where the sd by linearisation is not that of the draws."""
    linear = math.sqrt(max(before, 0.0))
    if target.by_unknowns > 0 and abs(linear / target.by_unknowns - 1) <= _NORMAL:
        return []
    finding = (
        f"by linearisation the sd of {target.label} is {linear / target.by_unknowns if target.by_unknowns else math.inf:.2f} "
        "times that of the draws: the posterior is not nearly normal"
    )
    return [Reason("linearisation", "amber", finding, "Take the ranking as a hint, and try the first two or three")]


def _rests_on(target: Target, known: Known, bench: Bench) -> tuple[str, ...]:
    """What the ranking takes for granted."""
    experiment = known.problem.experiment
    said = [
        "readings linear in the unknowns near the middle of the posterior, and what is not known of them nearly normal",
        "the model of this run being right, as far as its discrepancy says",
        "priors of the contact, load zero and clock of a press as in this run, its noise and discrepancy, too",
        (
            f"tester, load cell and sensor bearing up to {largest_load(known, bench):.3g} N"
            + (", twice what was measured, as nothing was said of them" if bench.load_cell is None else "")
        ),
        "times in the lab, and how well a quantity is read by itself, as in docs/next.md or in the bench file",
    ]
    if experiment.discrepancy == "on":
        said.append(
            "a discrepancy of its own for every press: pressing the same specimen once more in the same way may repeat that of "
            "the first, and then brings less"
        )
    if experiment.pooling == "complete" and len(experiment.specimens) >= 1:
        said.append("one modulus for all specimens, those that are still to be made included")
    if target.asked == "padding":
        said.append("new padding of the same material, and a thickness that is met exactly")
    return tuple(said)


def _files_in(experiment: Experiment, folder: Path) -> Experiment:
    """The experiment with the files that are still to be made in a folder."""

    def moved(path: Path | None) -> Path | None:
        return path if path is None or path.is_absolute() else folder / path

    specimens = tuple(
        replace(s, sweeps=tuple(replace(f, force=moved(f.force), capacitance=moved(f.capacitance)) for f in s.sweeps))
        for s in experiment.specimens
    )
    return replace(experiment, specimens=specimens)
