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
from dataclasses import dataclass, replace

import numpy as np

from calib.catalogue import spread_of
from calib.checks import Reason, Verdict, judge_posterior, verdict_of
from calib.decision.candidate import Candidate
from calib.decision.candidates import candidates_of
from calib.decision.choices import choices_of
from calib.decision.conformity import Conformity
from calib.decision.extrapolation import Aim, Measured, exceeded, measured_presses
from calib.decision.gain import CovarianceTimes, covariance, present_knowledge, with_measurement
from calib.decision.hinges import hinges_of
from calib.decision.known import Known
from calib.decision.padding import recommend
from calib.decision.ranking import (
    LINEARISATION,
    Deciding,
    Measurement,
    NextMeasurements,
)
from calib.decision.release import Options, after_reading, known_exactly, options_of
from calib.decision.requirement import Requirement
from calib.decision.specified import answer
from calib.decision.target import LearningTarget, modulus_target, regret, signal_target
from calib.decision.wanted_presses import largest_load
from calib.decision.words import EXTRAPOLATION
from calib.errors import Fault, InputError
from calib.experiment import Bench, Specification
from calib.problem import Problem, coordinates_of, plan_sweeps
from calib.sampling import Posterior
from models.response import Forward, OutOfRangeError
from models.sensor import FloatArray, IntArray

# By more than this share the sd by linearisation may not be off that of the draws.
_NORMAL = 0.2
# A load cell for less than this share of what was measured is a slip of the unit.
_LEAST_CELL = 0.01
# Less than so many standard errors of a loss are chance.
_CHANCE = 2.0
# Draws of the scales, fewer where there are so many unknowns.
_DRAWS, _MANY, _FEW_DRAWS = 64, 100, 16
_STAYING = (
    "the advice staying where it is: a padding that a calibration with the measurement advises instead, more than a tenth off, "
    "would be beyond the data again"
)
# Draws of sensors by which decisions are judged, at least, of several that may be built down to this part of them; and most
# thicknesses of padding among which decisions are made.
_SENSORS, _FEWER, _STEPS = 4000, 4, 91


def next_measurements(
    posterior: Posterior,
    forward: Forward,
    requirement: Requirement | Specification | None = None,
    bench: Bench | None = None,
    *,
    seed: int,
    verdict: Verdict | None = None,
    advised_by: int | None = None,
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
    verdict : on the calibration; None to judge the posterior here, without its predictions.
    advised_by : seed of the recommendation whose padding is meant; None for `seed`.

    Raises
    ------
    InputError
        If the posterior is an average of models, what is asked is fixed, the model covers no thickness of the request, or the
        bench leaves nothing to measure.
    """
    if posterior.of_model is not None:
        advice = "Ask the runs that it averages, one by one"
        raise InputError(Fault("this run is an average: each of its models would learn something else", advice=advice))
    rng = np.random.default_rng(seed)
    known = _known(posterior, forward)
    reasons = list((judge_posterior(posterior) if verdict is None else verdict).reasons)
    decision, aim = None, None
    advising = seed if advised_by is None else advised_by
    if requirement is None:
        target = modulus_target(posterior, known)
    elif isinstance(requirement, Specification):
        decision, conformity, aim = _decision(posterior, known, requirement, advising, verdict_of(reasons))
        target, reasons = decision.target(conformity), list(conformity.verdict.reasons)
    else:
        recommended = recommend(posterior, forward, requirement, seed=advising, verdict=verdict_of(reasons))
        reasons = list(recommended.verdict.reasons)
        target = signal_target(posterior, known, requirement, recommended.best, rng)
        depth = float(np.nan_to_num(recommended.depth_at_best[2]))
        aim = Aim(requirement.force, recommended.best, depth, (recommended.indenter_radius,), recommended.places)
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
    usual = bench or Bench()
    candidates, unjudged = candidates_of(known, usual, aim)
    if bench is not None:
        _require_something(bench, presses, candidates, unjudged)
    along = _along(target, now)
    found: list[tuple[str, Measurement]] = []
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
    if beyond and not any(one.settles == tuple(beyond) for _, one in found):
        reasons = [_not_confirmed(reason) for reason in reasons]
    ranked = tuple(_ranked(found, target.regret, tuple(beyond)))
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
            *_rests_on(target, known, usual, aim, None if decision is None else (decision, ranked)),
            *((_STAYING,) if beyond else ()),
        ),
        verdict_of(reasons),
        forward.name,
        seed,
        posterior.draws_sha256,
        None if decision is None else decision.deciding,
        tuple(beyond),
        sum(reason.gate == EXTRAPOLATION for reason in reasons) > bool(beyond),
    )


def _require_something(
    bench: Bench, presses: Sequence[Measured], candidates: Sequence[Candidate], unjudged: Sequence[str]
) -> None:
    """Refuse a bench that leaves nothing to measure, or a load cell that is a slip of the unit."""
    largest = max(press.force for press in presses)
    if bench.load_cell is not None and bench.load_cell < _LEAST_CELL * largest:
        message = f"load_cell is {bench.load_cell:.3g} N, and this run was pressed to {largest:.2g} N"
        raise InputError(Fault(message, advice="Check its unit"))
    if not candidates:
        why = f" ({'; '.join(unjudged)})" if unjudged else ""
        advice = "Take something out of `without`, or give balls, paddings or a larger load_cell"
        raise InputError(Fault(f"the bench leaves nothing that could be measured{why}", advice=advice))


def _settled(beyond: Iterable[str], presses: Sequence[Measured], candidate: Candidate, aim: Aim | None) -> tuple[str, ...]:
    """In what an advice would no longer go beyond the data with a measurement."""
    if aim is None or candidate.press is None:
        return ()
    left = exceeded([*presses, candidate.press], aim)
    return tuple(kind for kind in beyond if kind not in left)


def _not_confirmed(reason: Reason) -> Reason:
    """A reason that asks for a press to confirm an advice, where none of those that were tried would."""
    if reason.gate != EXTRAPOLATION:
        return reason
    action = (
        "None of the measurements that lab and model allow confirms it by itself: ask for less force, or for padding and balls "
        "like those measured"
    )
    return replace(reason, action=action)


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
    """Decide on a specification by what is known, keep the draws, and say what the advice is for.

    The advice, its verdict and its padding are those of `calib recommend`; the decision is made with more draws.
    """
    advised = answer(posterior, known.problem.forward, specification, seed=seed, verdict=verdict)
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
    return made, advised.conformity, advised.aim


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
    return [Reason(LINEARISATION, "amber", finding, "Take the ranking as a hint, and try the first two or three")]


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


def _ranked(found: Sequence[tuple[str, Measurement]], regret_now: float, beyond: tuple[str, ...]) -> list[Measurement]:
    """The most for an hour first; of those that differ in nothing but the specimen the best one.

    Of an advice beyond the data those that tell nothing come last, and first of them the press that confirms it.
    """

    def by(one: Measurement) -> tuple[float, ...]:
        place = 0 if one.tells or not beyond else 1 if one.settles == beyond else 2
        # Where no decision changes, what padding is chosen may still fall less short.
        less = 0.0 if one.decided is None else (one.regret - regret_now) / one.minutes
        return place, -one.per_hour, less, one.minutes

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
    return [Reason(LINEARISATION, "amber", finding, "Take the ranking as a hint, and try the first two or three")]


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
