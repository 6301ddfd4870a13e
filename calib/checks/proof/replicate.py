"""An experiment and a number in, a replicate of it out: a truth drawn, its lab simulated and calibrated, where the truth lies.

A truth is drawn from the prior, and its lab pressed as the experiment was; where the forward model of the calibration does not
cover it, another is drawn, as the posterior leaves such sensors out, too. The files go through the readers, and defaults that
the data centre are centred on theirs. Posteriors are the weighted draws of a first answer where these can be trusted, which
takes seconds, and else chains (Talts et al., arXiv 1804.06788; Modrak et al., Bayesian Anal. 20 (2025) 461, for the rank
of the likelihood). Drawn from the posterior of the experiment, the truth is ranked in the posterior of both its data and the
simulated ones, in which its rank is uniform (Saeilynoja, Schmitt, Buerkner & Vehtari, arXiv 2502.03279).
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np

from calib.catalogue import UnknownName, unknowns_of
from calib.checks.proof.presses import SimulatedPress
from calib.checks.proof.simulation import TrueSweep, true_sweeps, write_lab
from calib.errors import InputError
from calib.experiment import Experiment, forward_of_experiment, read_sweeps
from calib.lab import Sweep
from calib.problem import (
    Problem,
    as_next_specimen,
    build_problem,
    columns_at,
    log_likelihood_at,
    of_lot,
    prior_values,
    values_of_lot,
)
from calib.sampling import K_HAT, Gate, NothingSampled, look_at, sample
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import FloatArray
from models.threads import one_thread

#: Name under which the rank of the truth's likelihood is kept.
LIKELIHOOD = "log likelihood"

#: In the place of the specimen's name, in the name of a quantity of the next specimen of a lot.
NEXT = "next specimen"

#: What a calibration has to reach here, less than for its numbers to be used: draws enough to rank the truth among so many.
GATE, RANKED = Gate(r_hat=1.02, ess=200.0), 399

#: Weighted draws of a first answer stand for chains if they are worth so many independent ones, and k-hat is good.
WORTH = 200.0

#: Steps of each walker after which a calibration is left as it is.
MAX_STEPS = 4000

# Truths that are drawn at most to find one that the forward model covers.
_DRAWN = 500

Outcome = Literal["done", "done by chains", "not converged", "not covered", "no equilibrium", "refused"]


@dataclass(frozen=True, eq=False)
class ReplicateSetting:
    """What every replicate of an experiment needs, and can be sent to a worker.

    Attributes
    ----------
    experiment, sweeps : as read.
    presses : how each of the sweeps was pressed.
    surrogate : file of a surrogate instead of the shipped one.
    seed : of all replicates.
    chains : whether to sample every calibration by chains, also where weighted draws of the first answer will do.
    draws : of the posterior of these sweeps that truths are taken from, (n_draw, n_unknown), SI, in the order of the problem's
        unknowns; None to draw truths from the prior.
    """

    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    presses: tuple[SimulatedPress, ...]
    surrogate: Path | None
    seed: int
    chains: bool = False
    draws: FloatArray | None = None


@dataclass(frozen=True)
class Place:
    """Where the truth of one quantity lies in a posterior.

    Attributes
    ----------
    truth : SI.
    rank : share of the draws below it, 0 to 1; uniform if all is right.
    inside : whether it lies in the central 90 %.
    off : mean of the posterior minus truth, in its standard deviations.
    """

    truth: float
    rank: float
    inside: bool
    off: float


@dataclass(frozen=True)
class Replicate:
    """What came of one replicate.

    Attributes
    ----------
    number : which one.
    outcome : "done", by weighted draws or by chains, or why it says nothing, or less.
    why : the latter in words.
    places : name of an unknown, of a quantity of the `NEXT` specimen, or `LIKELIHOOD` -> where its truth lies; empty if nothing
        was sampled.
    seconds : of processor time.
    """

    number: int
    outcome: Outcome
    why: str
    places: Mapping[str, Place] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def counts(self) -> bool:
        """Whether there is a posterior to rank a truth in."""
        return bool(self.places)


def attempt(setting: ReplicateSetting, number: int) -> Replicate:
    """Draw a truth, simulate its lab, calibrate it, and see where the truth lies.

    Parameters
    ----------
    setting : the experiment.
    number : of the replicate; each has random numbers of its own.
    """
    began = time.process_time()
    with one_thread():
        outcome, why, places = _attempt(setting, number)
    return Replicate(number, outcome, why, places, time.process_time() - began)


def _attempt(setting: ReplicateSetting, number: int) -> tuple[Outcome, str, Mapping[str, Place]]:
    rng = np.random.default_rng([setting.seed, number])
    forward = forward_of_experiment(setting.experiment, setting.surrogate)
    problem = build_problem(setting.experiment, setting.sweeps, forward)
    truth = draw_truth(problem, setting.presses, rng, setting.draws)
    if truth is None:
        return "not covered", f"none of {_DRAWN} draws of the prior is covered by the {forward.name}", {}
    values, sweeps = truth
    try:
        curves = [sweep.curve() for sweep in sweeps]
    except (ConvergenceError, OutOfRangeError) as error:
        return "no equilibrium", str(error), {}
    try:
        with TemporaryDirectory(prefix="calib-proof-") as folder:
            experiment = write_lab(setting.experiment, sweeps, curves, Path(folder), rng)
            if setting.draws is None:
                again = build_problem(experiment, read_sweeps(experiment), forward)
            else:
                beside = pressed_again(experiment)
                again = build_problem(beside, (*setting.sweeps, *read_sweeps(beside)), forward)
    except InputError as error:
        return "refused", error.faults[0].message, {}
    return _ranked(again, values, setting.chains, rng)


def _ranked(
    problem: Problem, truth: Mapping[str, float], chains: bool, rng: np.random.Generator
) -> tuple[Outcome, str, Mapping[str, Place]]:
    """Calibrate, by weighted draws where these will do, and rank the truth."""
    found = None if chains else _weighted(problem)
    if found is not None:
        return "done", "", places_of(problem, *found, truth, rng)
    try:
        posterior = sample(problem, seed=int(rng.integers(2**31)), processes=0, gate=GATE, max_steps=MAX_STEPS)
    except NothingSampled as error:
        return "not converged", str(error), {}
    draws = posterior.draws.reshape(-1, len(posterior.parameters))
    chosen = draws[rng.choice(len(draws), min(RANKED, len(draws)), replace=False)]
    places = places_of(problem, chosen, np.full(len(chosen), 1 / len(chosen)), truth, rng)
    diagnostics = posterior.diagnostics
    outcome: Outcome = "done by chains" if diagnostics.converged else "not converged"
    return outcome, "; ".join(diagnostics.reasons), places


def _weighted(problem: Problem) -> tuple[FloatArray, FloatArray] | None:
    """Draws of the posterior (n_draw, n_unknown), SI, and their weights; None where these cannot be trusted."""
    try:
        look = look_at(problem)
    except ValueError:
        return None
    weight, k_hat = look.smoothed
    if not look.confirmed or look.effective_draws < WORTH or k_hat > K_HAT:
        return None
    of_lots = values_of_lot(problem, look.theta, np.random.default_rng(0)).values()
    return np.column_stack([columns_at(problem, look.theta), *of_lots]), weight / np.sum(weight)


def draw_truth(
    problem: Problem, presses: tuple[SimulatedPress, ...], rng: np.random.Generator, draws: FloatArray | None = None
) -> tuple[dict[str, float], tuple[TrueSweep, ...]] | None:
    """Draw a truth that the forward model covers, pressed as the experiment was; None if none is found.

    Parameters
    ----------
    problem : the experiment with its sweeps.
    presses : how they were pressed.
    rng : of the truth.
    draws : of the posterior, that truths are taken from, (n_draw, n_unknown), SI; None to draw them from the prior. The
        same sensors are pressed again then: with contacts, load zeros and clocks of their own, from the prior.

    Returns
    -------
    Name of an unknown -> SI value, fixed ones included, and what is true of every press.
    """
    for _ in range(_DRAWN):
        pressed = truth = {name: float(value[0]) for name, value in prior_values(problem, rng, 1).items()}
        if draws is not None:
            own = {p.key: pressed[p.name] for p in problem.parameters if p.parameter in unknowns_of("sweep")}
            known = {**problem.fixed, **dict(zip(_names(problem), draws[rng.integers(len(draws))].tolist(), strict=True))}
            pressed = {**known, **{str(key): value for key, value in own.items()}}
            truth = {**known, **{str(replace(key, sweep=_again(key.sweep))): value for key, value in own.items()}}
        try:
            sweeps = true_sweeps(problem, pressed, presses)
        except ValueError:
            continue
        if all(_covered(problem.forward, sweep) for sweep in sweeps):
            return truth, sweeps
    return None


def pressed_again(experiment: Experiment) -> Experiment:
    """The experiment with the names that sweeps have as those of a second visit of the same sensors."""
    specimens = (replace(s, sweeps=tuple(replace(f, name=_again(f.name)) for f in s.sweeps)) for s in experiment.specimens)
    return replace(experiment, specimens=tuple(specimens))


def _again(name: str) -> str:
    return f"{name} again".strip()


def _covered(forward: Forward, sweep: TrueSweep) -> bool:
    limit = float(forward.max_depth(sweep.design)[0])
    if (depth := sweep.depth) is not None:
        return 0 < depth <= limit
    force = sweep.force
    if limit <= 0 or force is None:
        return False
    return force <= float(forward.respond(sweep.design.draws(), np.array([[limit]])).force[0, 0])


def places_of(
    problem: Problem, draws: FloatArray, weight: FloatArray, truth: Mapping[str, float], rng: np.random.Generator
) -> dict[str, Place]:
    """Find where the truth lies in a posterior, by every unknown, by the next specimen of a lot and by the likelihood.

    Parameters
    ----------
    problem : whose posterior it is.
    draws : of it, (n_draw, n_unknown), SI.
    weight : of each, (n_draw,); they sum to 1.
    truth : name of an unknown -> SI value, fixed ones included.
    rng : for ties, and of the next specimen.
    """
    names = _names(problem)
    found = {name: _place(truth[name], draws[:, k], weight, rng) for k, name in enumerate(names) if name in truth}
    values = {name: draws[:, k] for k, name in enumerate(names)}
    values |= {name: np.full(len(draws), value) for name, value in problem.fixed.items()}
    found |= _of_next(problem, values, weight, truth, rng)
    if all(name in truth for name in values):
        one = {name: np.array([truth[name]]) for name in values}
        at_truth = float(log_likelihood_at(problem, problem.forward, problem.plans, one)[0])
        if math.isfinite(at_truth):
            of_draws = log_likelihood_at(problem, problem.forward, problem.plans, values)
            found[LIKELIHOOD] = _place(at_truth, of_draws, weight, rng)
    return found


def _of_next(
    problem: Problem, values: Mapping[str, FloatArray], weight: FloatArray, truth: Mapping[str, float], rng: np.random.Generator
) -> dict[str, Place]:
    """Where the next specimen of the true lot lies among those of the lots of the draws; nothing under complete pooling."""
    lots = problem.table.lots
    if not lots:
        return {}
    of_draws = as_next_specimen(values, lots, rng)
    of_truth = as_next_specimen({name: np.array([truth[name]]) for name in values if name in truth}, lots, rng)
    found = {}
    for lot in lots:
        first = problem.names[int(lot.columns[0])]
        found[str(UnknownName(lot.quantity, NEXT))] = _place(float(of_truth[first][0]), of_draws[first], weight, rng)
    return found


def _names(problem: Problem) -> tuple[str, ...]:
    """Names of the columns of draws: the unknowns, then what is of a lot."""
    return (*problem.names, *(info.name for info in of_lot(problem)))


def _place(truth: float, draws: FloatArray, weight: FloatArray, rng: np.random.Generator) -> Place:
    # The truth is one more draw, with the weight of a usual one.
    own = float(np.sum(weight**2))
    rank = (float(np.sum(weight[draws < truth])) + rng.random() * own) / (1 + own)
    mean = float(weight @ draws)
    sd = math.sqrt(float(weight @ (draws - mean) ** 2))
    return Place(truth, rank, 0.05 <= rank <= 0.95, (mean - truth) / sd if sd > 0 else 0.0)


def replicate_to_plain(replicate: Replicate) -> dict[str, Any]:
    """What a file holds of a replicate; the inverse is `replicate_from_plain`."""
    places = {name: [p.truth, p.rank, p.inside, p.off] for name, p in replicate.places.items()}
    row = {"number": replicate.number, "outcome": replicate.outcome, "why": replicate.why}
    return {**row, "places": places, "seconds": round(replicate.seconds, 2)}


def replicate_from_plain(row: Mapping[str, Any]) -> Replicate:
    """The replicate that `replicate_to_plain` wrote."""
    return Replicate(**{**row, "places": {name: Place(*numbers) for name, numbers in row["places"].items()}})
