"""A posterior and its predictions in, whether its numbers may be used out: every gate of a calibration, in one verdict.

Each gate is a function of the posterior that gives its reasons, none where there is nothing to say. Limits are set so that a
lab in which all is as the model has it, its unknowns drawn from their priors, is green in nineteen of twenty cases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from scipy.special import ndtri

from calib.catalogue import QUANTITIES, SCALES, UnknownName, display
from calib.checks.departures import BAYES_LIMITS, MOVED_LIMIT, moved_by
from calib.checks.ends import ends_that_cut
from calib.checks.predictive import Prediction
from calib.checks.verdict import LEVELS, Level, Reason, Verdict, reasons_from_text, verdict_of
from calib.digits import with_uncertainty
from calib.experiment import Experiment, unedited_in_words
from calib.problem import channel_of_block
from calib.sampling import Departure, Foretold, ParameterSummary, Posterior, Sensitivity, Stranger

#: Of n numbers that are standard normal in a sound lab, posterior means in the coordinates of their priors or ratios of the
#: moduli of specimens, one comes further than is tolerable in so many labs: amber, and red.
RATES: Mapping[Level, float] = {"amber": 1e-2, "red": 1e-5}
#: A discrepancy this far up in its prior, in the prior's standard-normal coordinate (of a half-normal prior: 2.3 and 3.7 times
#: its scale), is more than the model was believed to leave out.
DISCREPANCY_LIMITS: Mapping[Level, float] = {"amber": 2.0, "red": 3.5}
#: A model is ruled out by the data below this logarithm of its Bayes factor.
RULED_OUT = -5.0
#: Least share of the variance of its prior that a headline quantity must have lost, or it is the prior that is shown.
LEARNED = 0.5
#: Attribute of a posterior that keeps the reasons that were found before it was sampled.
BEFORE_SAMPLING = "reasons before sampling"
#: Attribute of a posterior that keeps the reasons against the models that it is an average of.
OF_MODELS = "reasons of the models"
#: Gates of a calibration -> what it means that one is green.
GREEN: Mapping[str, str] = {
    "convergence": "the chains meet the gate of the run",
    "prior": "no posterior mean contradicts what was believed before, and no prior's end cuts one",
    "fit": "the model describes every channel within what it claims",
    "left-out data": "each part of a press lies where all other data let one expect",
    "lab data": "no check of a lab file speaks against its use",
    "learned": "Young's modulus is not mostly its prior",
    "range": "the draws stay within what the model covers",
    "experiment file": "no line of it still holds a guess of the draft",
    "surrogate": "it agrees with the finite elements as well as it must",
    "finite elements": "weighting the draws by finite elements moves no mean by much",
    "discrepancy": "what the model leaves out is no more than was believed possible",
    "model": "no other model that was asked is more probable, or would move Young's modulus by much",
    "specimens": "each is as the others let one expect",
    "prior sensitivity": "no belief pulls a headline away from the data by much",
}
# Models whose Bayes factors differ by less, as a logarithm (by a factor of 20), describe the data about as well.
_AS_WELL = 3.0
_WHAT_TELLS = (
    "Take none of these on its odds alone: look for what is wrong (bond of the base, ball, thicknesses, travel, times that "
    "were counted and not measured), and settle it by a press or a measurement that is not among these data."
)
# Of parts of a press that are foretold: rarer, as little is found by them that no other gate finds.
_RATES_OF_BLOCKS: Mapping[Level, float] = {"amber": 1e-3, "red": 1e-5}
# What a calibration is made for, if it is unknown.
_HEADLINES = ("young_modulus",)
# Gates whose reasons are each a cause of priors and data that disagree, which is then said once.
_CAUSES = ("convergence", "prior", "discrepancy", "model", "specimens", "fit", "left-out data")
_ADVICE_PRIOR = "Check that prior and the files, or what the model leaves out, before using the rest"


def judge_posterior(posterior: Posterior, predictions: Sequence[Prediction] = (), more: Sequence[Reason] = ()) -> Verdict:
    """Judge a calibration by all that is known of it: whether its numbers may be used, and what speaks against it.

    Parameters
    ----------
    posterior : the result.
    predictions : of its sweeps; without them it is not looked at whether the model describes the data.
    more : what speaks against it besides.
    """
    gates = (_convergence, _surrogate, _conflict, _cut, _departures, _specimens, _left_out, _quality, _prior_driven, _range)
    found = [reason for gate in gates for reason in gate(posterior)]
    found += [*unedited_reasons(posterior.experiment), *_discrepancy(posterior, predictions), *_predictive(predictions)]
    found += [*_kept(posterior, found), *more]
    return verdict_of([*found, *_pulled(posterior, found)])


def passed_gates(posterior: Posterior, verdict: Verdict) -> dict[str, str]:
    """What was looked at and found to be all right: each gate in a word or two, and what that means, in a sentence.

    Parameters
    ----------
    posterior : the result.
    verdict : on it.
    """
    d = posterior.diagnostics
    not_looked_at = {
        "surrogate": d.surrogate_honest is None,
        "finite elements": d.reweighting is None,
        "discrepancy": not any(UnknownName.parse(n).parameter.endswith("_discrepancy") for n in d.parameters),
        "model": not (d.departures or d.models),
        "specimens": not (d.foretold or d.strangers),
        "left-out data": not d.block_z or any(math.isnan(z) for z in d.block_z),
        "prior sensitivity": not d.sensitivity,
    }
    against = {reason.gate for reason in verdict.reasons}
    return {gate: said for gate, said in GREEN.items() if gate not in against and not not_looked_at.get(gate, False)}


def conflict_limit(n: int, level: Level = "amber") -> float:
    """How far a posterior mean may be from its prior's median before it contradicts the prior, in its standard deviations.

    Parameters
    ----------
    n : how many unknowns there are.
    level : that is wanted of the contradiction.

    Examples
    --------
    >>> round(conflict_limit(20), 1), round(conflict_limit(20, "red"), 1)
    (3.5, 5.0)
    """
    return _rare_limits(n)[level]


def _rare_limits(n: int, rates: Mapping[Level, float] = RATES) -> Mapping[Level, float]:
    """How far the farthest of n standard-normal numbers comes, on either side, as rarely as `RATES` says."""
    return {level: float(-ndtri(rate / (2 * max(n, 1)))) for level, rate in rates.items()}


def _convergence(posterior: Posterior) -> Iterator[Reason]:
    reasons = posterior.diagnostics.reasons
    if not posterior.diagnostics.converged:
        finding = f"the chains have not converged: {_first(reasons)}" if reasons else "the chains have not converged"
        yield Reason("convergence", "red", finding, "Continue the run with --resume and a larger --budget")


def _surrogate(posterior: Posterior) -> Iterator[Reason]:
    d = posterior.diagnostics
    better = 'Calibrate with a better surrogate (`calib surrogate refine`, `calib surrogate train`) or with model = "fem"'
    if d.surrogate_honest is False:
        yield Reason("surrogate", "red", _first(d.surrogate_reasons), better)
    if d.reweighting is not None and not d.reweighting.passed:
        yield Reason("finite elements", "amber", d.reweighting.in_words(), better)


def _conflict(posterior: Posterior) -> Iterator[Reason]:
    summaries = {n: s for n, s in posterior.diagnostics.parameters.items() if UnknownName.parse(n).parameter not in SCALES}
    limits = _rare_limits(len(posterior.parameters))
    found = [(n, level) for n, s in summaries.items() if (level := _level(abs(s.prior_shift), limits)) is not None]
    for level in LEVELS:
        names = sorted((n for n, own in found if own == level), key=lambda n: -abs(summaries[n].prior_shift))
        if names:
            told = _first([_conflict_in_words(n, summaries[n]) for n in names], "; ")
            yield Reason("prior", level, f"the data contradict what was believed before: {told}", _ADVICE_PRIOR)


def _cut(posterior: Posterior) -> Iterator[Reason]:
    """Unknowns that lean on the end of a prior."""
    for parameter in posterior.parameters:
        s = posterior.diagnostics.parameters.get(parameter.name)
        if s is not None and s.prior_contraction > LEARNED:
            yield from ends_that_cut(parameter, s.mean, s.sd)


def _conflict_in_words(name: str, s: ParameterSummary) -> str:
    unknown = UnknownName.parse(name)
    value = display(unknown.parameter, float(f"{s.mean:.3g}"))
    return f"{unknown.label} would be {value}, {abs(s.prior_shift):.1f} standard deviations of its prior away"


def _discrepancy(posterior: Posterior, predictions: Sequence[Prediction]) -> Iterator[Reason]:
    for name, s in posterior.diagnostics.parameters.items():
        unknown = UnknownName.parse(name)
        level = _level(s.prior_shift, DISCREPANCY_LIMITS) if unknown.parameter.endswith("_discrepancy") else None
        if level is not None:
            size = display(unknown.parameter, float(f"{s.mean:.2g}"))
            pattern = _patterns(predictions, unknown.parameter.removesuffix("_discrepancy"))
            finding = f"{unknown.label} is {size}, more than was believed possible{pattern}"
            action = "Look at the residuals; hold other models against the data with `calib compare`, and check files and radii"
            yield Reason("discrepancy", level, finding, action)


def _departures(posterior: Posterior) -> Iterator[Reason]:
    compare = "`calib compare EXPERIMENT -o FOLDER`"
    asked = posterior.diagnostics.departures
    if asked and all(math.isnan(d.log_bayes) for d in asked):
        finding = "other models were not held against these data, as there is no first answer to compare with"
        yield Reason("model", "amber", finding, f"Calibrate with both and compare them: {compare}")
    known = sorted((d for d in asked if not math.isnan(d.log_bayes)), key=lambda d: -d.log_bayes)
    own = posterior.diagnostics.parameters.get("young_modulus")
    mattering = [d for d in known if d.log_bayes > BAYES_LIMITS["amber"] or moved_by(d, own) > MOVED_LIMIT]
    if mattering:
        best = mattering[0].log_bayes
        alike = [d for d in mattering if d.log_bayes > best - _AS_WELL]
        told = "; or ".join(departure_in_words(d, posterior) for d in alike)
        which = "other models describe" if len(alike) > 1 else "another model describes"
        apart = ", which do not tell them apart" if len(alike) > 1 else ""
        how = "better than" if best > BAYES_LIMITS["amber"] else "at least as well as" if best > 0 else "about as well as"
        finding = (
            f"{which} these data {how} the one given{apart}: {told}. Odds are among the models that were asked: what "
            "none of them has (a part of the base that is not bonded, dirt on the ball, play in the holder, a travel that "
            "reads wrongly, thicknesses that are taken as surer than they are) may look like one of them"
        )
        yield Reason(
            "model", _level(best, BAYES_LIMITS) or "amber", finding, f"{_WHAT_TELLS} Compare the models with {compare}"
        )


def departure_in_words(departure: Departure, posterior: Posterior) -> str:
    """Say how much better or worse another model describes the data, and what Young's modulus would be under it.

    Parameters
    ----------
    departure : the other model.
    posterior : under the model as given.
    """
    size = abs(departure.log_bayes)
    factor = f"{math.exp(size):.2g}" if size < 11 else f"more than 10^{int(size / math.log(10))}"
    odds = f"{factor} times as probable" if departure.log_bayes >= 0 else f"odds 1 : {factor}"
    told = f"{departure.model} ({odds})"
    own = posterior.diagnostics.parameters.get("young_modulus")
    if departure.young_modulus is None or own is None:
        return told
    row = QUANTITIES["young_modulus"]
    k, other = row.display_scale, departure.young_modulus
    return (
        f"{told}, with a Young's modulus of {with_uncertainty(other.mean * k, other.sd * k)} instead of "
        f"{with_uncertainty(own.mean * k, own.sd * k)} {row.display_unit}"
    )


def _specimens(posterior: Posterior) -> Iterator[Reason]:
    """Specimens that do not belong to the others: those that are not of their lot, else those that they do not predict.

    How far a specimen of a lot may lie off what the others predict has wider tails than a normal distribution, as the spread is
    hardly known: that alone is amber at most.
    """
    d = posterior.diagnostics
    of_lot = posterior.experiment.pooling == "partial"
    n = len({s.specimen for s in d.strangers} | {f.specimen for f in d.foretold})
    which = ", and of two specimens the data do not tell which one does not belong" if n == 2 else ""
    strangers, limits = sorted(d.strangers, key=lambda s: -abs(s.z)), _rare_limits(len(d.strangers))
    if strangers and (level := _level(abs(strangers[0].z), limits)) is not None:
        told = _first([stranger_in_words(s) for s in strangers if abs(s.z) > limits["amber"]])
        action = "Check its files, its thicknesses and what it was cast from; if it is of another lot calibrate it by itself"
        if strangers[0].quantity.endswith("_thickness"):
            action += ", and if it was not meant to be like the others say what was wanted of each (`nominal`)"
        finding = f"not all specimens are of one lot: {told} than the others let one expect{which}"
        yield Reason("specimens", level, finding, action)
        return
    predicted, limits = sorted(d.foretold, key=lambda f: -abs(f.z)), _rare_limits(len(d.foretold))
    if not predicted or (level := _level(abs(predicted[0].z), limits)) is None:
        return
    told = _first([_foretold_in_words(f) for f in predicted if abs(f.z) > limits["amber"]])
    advice = "Check its files and thicknesses"
    more = '; if these are right, pooling = "partial" gives each specimen a material and thicknesses about those of their lot'
    yield Reason("specimens", "amber" if of_lot else level, f"{told}{which}", advice if of_lot else advice + more)


def _foretold_in_words(found: Foretold) -> str:
    """Say how far what was read of a specimen lies off what the others predict."""
    side = "higher" if found.ratio.mean > 1 else "lower"
    off = f"{with_uncertainty(100 * abs(found.ratio.mean - 1), 100 * found.ratio.sd)} %"
    return (
        f"{found.specimen} is not predicted by the others: its {found.channel} is {off} {side} than expected, "
        f"{abs(found.z):.1f} standard deviations"
    )


def stranger_in_words(s: Stranger) -> str:
    """Say by how much a specimen lies off what is expected of it, and on which side; goes on with "than ..."."""
    size = f"{with_uncertainty(100 * abs(s.ratio.mean - 1), 100 * s.ratio.sd)} %"
    if s.quantity == "young_modulus":
        return f"{s.specimen} is {size} {'stiffer' if s.z > 0 else 'softer'}"
    sides = ("higher", "lower") if s.quantity == "relative_permittivity" else ("larger", "smaller")
    return f"{QUANTITIES[s.quantity].label} of {s.specimen} is {size} {sides[0] if s.z > 0 else sides[1]}"


def _left_out(posterior: Posterior) -> Iterator[Reason]:
    """Parts of a press that do not lie where all other data let one expect, or of which that cannot be told."""
    of_blocks = dict(zip(posterior.blocks, posterior.diagnostics.block_z, strict=False))
    known = {name: z for name, z in of_blocks.items() if not math.isnan(z)}
    limits = _rare_limits(len(known), _RATES_OF_BLOCKS)
    off = sorted((name for name, z in known.items() if _level(abs(z), limits)), key=lambda name: -abs(known[name]))
    if off and (level := _level(abs(known[off[0]]), limits)) is not None:
        told = _first([f"{_part_in_words(name, posterior.blocks)} {_off_in_words(known[name])}" for name in off])
        finding = f"not all parts of a press are where all other data let one expect: {told}"
        yield Reason(
            "left-out data", level, finding, "Look at the residuals there, and for what happened in that part of the press"
        )
    elif len(known) < len(of_blocks) and posterior.experiment.model != "fem":
        unknown = _first([_part_in_words(name, posterior.blocks) for name in of_blocks if name not in known], ", ")
        finding = f"it cannot be told whether all other data foretell {unknown}: without it the posterior is another, or none"
        yield Reason("left-out data", "amber", finding, "Look at the residuals there, and press again")


def _part_in_words(name: str, blocks: Sequence[str]) -> str:
    """Say which part of a channel a block of `block_names` is."""
    channel = channel_of_block(name)
    together = [other for other in blocks if channel_of_block(other) == channel]
    title, _, kind = channel.rpartition(", ")
    return f"part {together.index(name) + 1} of {len(together)} of the {kind} of {title}"


def _off_in_words(z: float) -> str:
    return f"is {abs(z):.1f} standard deviations too {'high' if z > 0 else 'low'}"


def _quality(posterior: Posterior) -> Iterator[Reason]:
    bad = [(s.title, grade) for s in posterior.sweeps for grade in s.grades if grade.level == "bad"]
    for level in LEVELS:
        own = [(t, g) for t, g in bad if (g.check == "signal") == (level == "red")]
        if own:
            told = _first([f"{g.check} of the {g.channel} of {title}: {g.finding}" for title, g in own], "; ")
            yield Reason(
                "lab data",
                level,
                f"what flaws of the lab files do is not in the uncertainties: {told}",
                own[0][1].advice.rstrip("."),
            )


def _predictive(predictions: Sequence[Prediction]) -> Iterator[Reason]:
    found = [(kind, p) for p in predictions for kind, c in p.channels.items() if not c.check.passed]
    if found:
        finding = (
            f"the model does not describe {_first([f'the {k} of {p.title}' for k, p in found], ', ')} within what it claims"
        )
        finding += _patterns([found[0][1]], found[0][0])
        yield Reason("fit", "red", finding, "Look at the residuals before using any number")


def _patterns(predictions: Sequence[Prediction], kind: str) -> str:
    """Where along the press a channel lies beside the model, as the end of a sentence: of the sweep that is furthest off."""
    checks = {p.title: p.channels[kind].check for p in predictions if kind in p.channels}
    told = {title: check for title, check in checks.items() if check.pattern}
    if not told:
        return ""
    title = max(told, key=lambda t: max(map(abs, told[t].off)))
    return f"; of its range the {kind} of {title} lies {told[title].pattern}"


def _prior_driven(posterior: Posterior) -> Iterator[Reason]:
    for name in _HEADLINES:
        s = posterior.diagnostics.parameters.get(name)
        if s is not None and s.prior_contraction < LEARNED:
            share = f"{100 * max(s.prior_contraction, 0.0):.0f} %"
            finding = (
                f"the data taught {share} of what could be learned of {UnknownName.parse(name).label}: it is mostly its prior"
            )
            yield Reason("learned", "amber", finding, "Press harder, or with a second ball, or measure the thicknesses")


def _pulled(posterior: Posterior, found: Sequence[Reason]) -> Iterator[Reason]:
    """Headlines that priors pull away from the data, unless what was found already is a cause of that."""
    if any(reason.gate in _CAUSES for reason in found):
        return
    d = posterior.diagnostics
    pulled = [(n, s) for n, s in d.sensitivity.items() if s.diagnosis == "conflict"]
    if pulled:
        pulled.sort(key=lambda pair: -abs(pair[1].z))
        told = _first([pull_in_words(n, s, d.parameters[n]) for n, s in pulled])
        unknown = UnknownName.parse(pulled[0][1].foremost.unknown)
        action = f"Measure {unknown.label} again, or say in its prior how uncertain it is; `calib check` tells what is expected"
        yield Reason("prior sensitivity", "amber", f"the data pull against what was believed before: {told}", action)


def pull_in_words(name: str, sensitivity: Sensitivity, summary: ParameterSummary) -> str:
    """Say which prior moves a quantity most, and what the quantity would be if all beliefs were half as strong.

    Parameters
    ----------
    name : of the quantity.
    sensitivity : of it.
    summary : of it.
    """
    unknown, by = UnknownName.parse(name), UnknownName.parse(sensitivity.foremost.unknown)
    weaker = display(unknown.parameter, float(f"{summary.mean - sensitivity.shift * summary.sd:.3g}"))
    now = display(unknown.parameter, float(f"{summary.mean:.3g}"))
    whose = "its own prior" if by == unknown else f"the prior of {by.label}"
    return f"{whose} moves {unknown.label} most, which would be {weaker} instead of {now} with beliefs half as strong"


def _kept(posterior: Posterior, found: Sequence[Reason]) -> Iterator[Reason]:
    """What spoke against it before it was sampled, or against its models, unless the result says as much of the same."""
    said = {(reason.gate, reason.level) for reason in found}
    for key in (BEFORE_SAMPLING, OF_MODELS):
        for reason in reasons_from_text(posterior.attrs.get(key, "[]")):
            if (reason.gate, reason.level) not in said and (reason.gate, "red") not in said:
                yield reason


def _range(posterior: Posterior) -> Iterator[Reason]:
    for warning in posterior.diagnostics.warnings:
        yield Reason("range", "amber", warning, 'Use less of the sweep (`use = { max_depth = ... }`), or model = "fem"')


def unedited_reasons(experiment: Experiment) -> Iterator[Reason]:
    """What speaks against a result if lines of its experiment file still hold a guess of the draft: one reason, or none."""
    said = unedited_in_words(experiment.unedited)
    if said:
        standing = all(u.stands for u in experiment.unedited)
        advice = "Measure what stands as exact" if standing else "Replace them by what you know, and remove the mark EDIT"
        yield Reason("experiment file", "amber", said, advice)


def _level(value: float, limits: Mapping[Level, float]) -> Level | None:
    """The worse level whose limit a value is above; None for none, nan included."""
    return "red" if value > limits["red"] else "amber" if value > limits["amber"] else None


def _first(words: Sequence[str], between: str = "; ") -> str:
    """The first two of several findings, and how many more there are."""
    more = [f"and {len(words) - 2} more"] if len(words) > 2 else []
    return between.join([*words[:2], *more])
