"""A problem and its first answer in, what else its data would say out: under other models, and of specimens that differ.

A posterior is sure within its model. Whether the data would rather have another one is asked of each model that differs in one
choice (`calib.experiment.variants_of`), by the evidence p(data | model), the integral of the likelihood over the priors: models
are compared by its ratio, the Bayes factor, which holds against a model what it has to be told to fit. It is computed as the
first answer is, by importance sampling near the mode, in about a second of processor time for each model, and nothing is
sampled. Likewise specimens that share a material may each have a modulus of their own; those of one lot, which
have, are held against each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from calib.catalogue import UnknownName
from calib.checks.reweighting import problem_of
from calib.checks.strangers import strangers_of
from calib.errors import InputError
from calib.experiment import Variant, forward_of_experiment, model_in_words, variants_of
from calib.lab import Sweep
from calib.priors import Prior, parse_prior
from calib.problem import ParameterInfo, Problem, build_problem
from calib.sampling import Apart, Departure, FirstAnswer, Posterior, Stranger, first_answer
from models.response import Forward

# What is believed of how much stiffer one specimen of a lot is than another: 20 % either way.
_RATIO: Prior = parse_prior("force_gain", {"lognormal": [1, 1.2]})
# A model whose first climb ends with a Bayes factor of which this is the logarithm is not asked further: ten times the limit at
# which it is ruled out. Second climbs gained 11 at most in 14 labs of `benchmarks/simulated`.
_HOPELESS = -50.0


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """What the data would say under other models, and of specimens that differ; see `Departure`, `Apart` and `Stranger`."""

    departures: tuple[Departure, ...] = ()
    apart: tuple[Apart, ...] = ()
    strangers: tuple[Stranger, ...] = ()


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
    near = {name: estimate.mean for name, estimate in own.parameters.items()}
    floor = own.log_evidence + _HOPELESS
    if executor is None:
        specimens = _specimens(problem, near)
        answers = [_under(problem, variant, near, floor) for variant in variants]
    else:
        asked = [executor.submit(_under, problem, variant, near, floor) for variant in variants]
        waited = executor.submit(_specimens, problem, near)
        answers, specimens = [future.result() for future in asked], waited.result()
    departures = tuple(_departure(problem, v, own, a) for v, a in zip(variants, answers, strict=True))
    return replace(specimens, departures=departures)


def with_elsewhere(posterior: Posterior, found: Elsewhere) -> Posterior:
    """The same draws, with what else the data would say in the diagnostics.

    Parameters
    ----------
    posterior : as sampled.
    found : of its problem.
    """
    d = posterior.diagnostics
    kept = replace(d, departures=found.departures, apart=found.apart, strangers=found.strangers)
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


def _under(problem: Problem, variant: Variant, near: Mapping[str, float], floor: float) -> FirstAnswer | None:
    """The first answer under another model; None if there is none, as where the model does not cover what was measured."""
    experiment = variant.of(problem.experiment)
    begin = {"padding_young_modulus": near.get("young_modulus", np.nan), **near}
    try:
        # The forward model of the problem where it serves, so that a surrogate of one's own is used.
        same = experiment.family == problem.experiment.family
        forward = problem.forward if same else forward_of_experiment(experiment)
        return first_answer(build_problem(experiment, problem.sweeps, forward), begin, floor)
    except (InputError, ValueError):
        return None


def _departure(problem: Problem, variant: Variant, own: FirstAnswer | None, found: FirstAnswer | None) -> Departure:
    model = model_in_words(variant.of(problem.experiment))
    if own is None or found is None:
        return Departure(variant.name, model, float("nan"), None)
    return Departure(variant.name, model, found.log_evidence - own.log_evidence, found.parameters.get("young_modulus"))


def _specimens(problem: Problem, near: Mapping[str, float]) -> Elsewhere:
    """How specimens differ: those that share a material, or those of one lot."""
    if problem.table.lot is not None:
        return Elsewhere(strangers=strangers_of(problem, near))
    return Elsewhere(apart=_apart(problem, near))


def _apart(problem: Problem, near: Mapping[str, float]) -> tuple[Apart, ...]:
    """How much stiffer each specimen is than the first; nothing where that cannot be told.

    The modulus scales the force of a specimen, and so does a gain of the load cell that holds for this specimen alone.
    """
    pressed = [s.name for s in problem.experiment.specimens if any(_loaded(sweep, s.name) for sweep in problem.sweeps)]
    reference, *others = pressed or [""]
    gains = [ParameterInfo(UnknownName("force_gain", name), _RATIO) for name in others]
    if not gains:
        return ()
    try:
        found = first_answer(replace(problem, parameters=(*problem.parameters, *gains)), near)
    except ValueError:
        return ()
    return tuple(Apart(g.specimen, reference, found.parameters[g.name]) for g in gains)


def _loaded(sweep: Sweep, specimen: str) -> bool:
    by_force = "force" in sweep.channels or any(sweep.tied_by(channel) == "force" for channel in sweep.channels)
    return by_force and sweep.specimen == specimen
