"""A problem and its first answer in, what else its data would say out: under other models, and of specimens that differ.

A posterior is sure within its model. Whether the data would rather have another one is asked of each model that differs in one
choice (`calib.experiment.variants_of`), by the evidence p(data | model), the integral of the likelihood over the priors: models
are compared by its ratio, the Bayes factor, which holds against a model what it has to be told to fit. It is computed as the
first answer is, by importance sampling near the mode, in about a second of processor time for each model, and nothing is
sampled. Where one of them is asked for, so may be a fault that it looks like, and clocks of other rates are asked in the same
way. Likewise each specimen is left out and predicted by the others, and those of one lot are held against each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from scipy.special import expit

from calib.checks.clock_rates import RATES, at_rate, is_tied_by_clock, rate_departure
from calib.checks.left_out_specimens import foretold
from calib.checks.reweighting import problem_of
from calib.checks.strangers import strangers_of
from calib.checks.verdict import Level
from calib.errors import InputError
from calib.experiment import (
    Variant,
    beyond_simplest,
    forward_of_experiment,
    model_in_words,
    variants_of,
    without_discrepancy,
)
from calib.problem import Problem, build_problem
from calib.sampling import Departure, FirstAnswer, FirstEstimate, Foretold, ParameterSummary, Posterior, Stranger, first_answer
from calib.workers import given_to
from models.response import Forward

#: Logarithms of Bayes factors above which another model speaks against the one given: "positive" and "very strong" (Kass &
#: Raftery, J. Am. Stat. Assoc. 90 (1995) 773, section 3.2).
BAYES_LIMITS: Mapping[Level, float] = {"amber": 1.0, "red": 5.0}

#: Standard deviations of Young's modulus by which its mean may move if another model is weighed with the one given, both as
#: likely before. Of 98 sound labs one is above it; of 28 whose padding was 20 % softer or 30 % harder all are, the least by
#: 1.67, though three of them made the padding's own modulus a little less probable (docs/verdict.md).
MOVED_LIMIT = 1.3

# A model whose first climb ends with a Bayes factor of which this is the logarithm is not asked further: ten times the limit at
# which it is ruled out. Second climbs gained 11 at most in 14 labs of `benchmarks/simulated`.
_HOPELESS = -50.0

_Found = TypeVar("_Found")


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """What the data would say under other models, and of specimens that differ; see `Departure`, `Foretold` and `Stranger`.

    Attributes
    ----------
    departures, foretold, strangers : as in the diagnostics of a posterior.
    without_discrepancy : the same model with noise alone between it and the readings; None where it has no discrepancy.
    """

    departures: tuple[Departure, ...] = ()
    foretold: tuple[Foretold, ...] = ()
    strangers: tuple[Stranger, ...] = ()
    without_discrepancy: Departure | None = None


def look_elsewhere(problem: Problem, own: FirstAnswer | None, executor: Executor | None = None) -> Elsewhere:
    """Hold other models against the data of a problem, and its specimens against each other.

    Parameters
    ----------
    problem : from `build_problem`.
    own : its first answer; None for none, and then nothing is known of any other model.
    executor : asks models and specimens side by side; None to ask one after the other.

    Returns
    -------
    Nothing of a model that is the finite elements, which would take hours.
    """
    if problem.experiment.model == "fem":
        return Elsewhere()
    variants = variants_of(problem.experiment)[1:]
    if own is None:
        return Elsewhere(tuple(_departure(problem, variant, own, None) for variant in variants))
    near = own.means
    floor = own.log_evidence + _HOPELESS
    names = dict.fromkeys(sweep.specimen for sweep in problem.sweeps)
    predicted = _all_of([partial(foretold, problem, near, name) for name in names], executor)
    strangers = _all_of([partial(strangers_of, problem, near, lot.quantity) for lot in problem.table.lots], executor)
    plain = without_discrepancy(problem.experiment)
    asked = [*variants, *([] if plain is None else [plain])]
    answers = _all_of([partial(answer_under, problem, variant, near, floor) for variant in asked], executor)
    answered = [_departure(problem, variant, own, answer()) for variant, answer in zip(asked, answers, strict=True)]
    departures = answered[: len(variants)]
    # A model that was chosen because the data asked for it has what a clock's rate does to them in its own unknowns.
    modulus = own.parameters.get("young_modulus")
    asked_for = bool(beyond_simplest(problem.experiment)) or any(
        d.log_bayes > BAYES_LIMITS["amber"] or moved_by(d, modulus) > MOVED_LIMIT for d in departures
    )
    if asked_for and is_tied_by_clock(problem):
        rates = _all_of([partial(at_rate, problem, near, floor, rate) for rate in RATES], executor)
        departures.append(rate_departure(model_in_words(problem.experiment), own, [answer() for answer in rates]))
    return Elsewhere(
        tuple(departures),
        tuple(one for found in predicted for one in found()),
        tuple(one for found in strangers for one in found()),
        None if plain is None else answered[-1],
    )


def moved_by(departure: Departure, modulus: FirstEstimate | ParameterSummary | None) -> float:
    """How far Young's modulus moves if another model is weighed with the one given, in the standard deviations stated of it.

    Parameters
    ----------
    departure : the other model, as likely as the one given before the data were seen.
    modulus : under the model as given; None where it is no unknown.

    Returns
    -------
    |E' - E| / sd times the probability K / (1 + K) that the data leave the other model, K its Bayes factor; 0 where unknown.
    """
    other = departure.young_modulus
    if modulus is None or other is None or modulus.sd <= 0 or math.isnan(departure.log_bayes):
        return 0.0
    return float(expit(departure.log_bayes)) * abs(other.mean - modulus.mean) / modulus.sd


def _all_of(asked: Sequence[Callable[[], _Found]], executor: Executor | None) -> list[Callable[[], _Found]]:
    """Begin with all that is asked, side by side if there is an executor, and say how to get the answers."""
    return list(asked) if executor is None else given_to(executor, asked)


def with_elsewhere(posterior: Posterior, found: Elsewhere) -> Posterior:
    """The same draws, with what else the data would say in the diagnostics.

    Parameters
    ----------
    posterior : as sampled.
    found : of its problem.
    """
    d = posterior.diagnostics
    kept = replace(
        d,
        departures=found.departures,
        foretold=found.foretold,
        strangers=found.strangers,
        without_discrepancy=found.without_discrepancy,
    )
    return replace(posterior, diagnostics=kept)


def with_departures(posterior: Posterior, forward: Forward, executor: Executor | None = None) -> Posterior:
    """Look for what else the data of a posterior would say, and keep it in its diagnostics; the draws stay what they are.

    Parameters
    ----------
    posterior : as sampled.
    forward : the model that it was sampled with.
    executor : as in `look_elsewhere`.
    """
    problem = problem_of(posterior, forward)
    try:
        own = first_answer(problem)
    except ValueError:
        own = None
    return with_elsewhere(posterior, look_elsewhere(problem, own, executor))


def problem_under(problem: Problem, variant: Variant) -> Problem:
    """The same data and priors under another model.

    Parameters
    ----------
    problem : from `build_problem`.
    variant : of its experiment.

    Raises
    ------
    InputError, ValueError
        If there is no forward model, or it does not cover what was measured.
    """
    experiment = variant.of(problem.experiment)
    # The forward model of the problem where it serves, so that a surrogate of one's own is used.
    same = experiment.family == problem.experiment.family
    return build_problem(experiment, problem.sweeps, problem.forward if same else forward_of_experiment(experiment))


def values_near(values: Mapping[str, float]) -> dict[str, float]:
    """Where a climb under another model begins, by the values of the unknowns at the mode of a model."""
    return {"padding_young_modulus": values.get("young_modulus", np.nan), **values}


def answer_under(problem: Problem, variant: Variant, near: Mapping[str, float], floor: float = -math.inf) -> FirstAnswer | None:
    """The first answer under another model.

    Parameters
    ----------
    problem : from `build_problem`.
    variant : of its experiment.
    near : values of the unknowns that a climb begins at.
    floor : see `first_answer`.

    Returns
    -------
    None if there is none, as where the model does not cover what was measured.
    """
    try:
        return first_answer(problem_under(problem, variant), values_near(near), floor)
    except (InputError, ValueError):
        return None


def _departure(problem: Problem, variant: Variant, own: FirstAnswer | None, found: FirstAnswer | None) -> Departure:
    model = model_in_words(variant.of(problem.experiment))
    if own is None or found is None:
        return Departure(variant.name, model, float("nan"), None)
    return Departure(variant.name, model, found.log_evidence - own.log_evidence, found.parameters.get("young_modulus"))
