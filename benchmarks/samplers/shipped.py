"""A sampler and the shipped experiment in, processor seconds of the whole process to effective sample sizes wanted out.

Contenders: `new`, as a calibration samples; `old`, as one did before it knew shapes: 80 walkers round the highest mode, by
differential evolution and jumps alone; and of other people, where they are installed,

- `nuts`: the No-U-Turn sampler of NumPyro (Phan, Pradhan & Jankowiak 2019) with a dense mass matrix on the same posterior
  written for JAX (`samplers.port`), one chain, as warming up four would take four times as long;
- `nautilus`: importance nested sampling with neural networks (Lange 2023);
- `zeus`: ensemble slice sampling (Karamanis, Beutler & Peacock 2021).

Those that walk start round the same mode. All are measured by the bulk effective sample size of the worst unknown
(rank-normalised, Vehtari et al. 2021), an ensemble being one chain; nautilus by how many draws its weights are worth. Ensembles
must pass the whole gate with it, as such sizes are far too large before walkers have forgotten where they were; of the others
nothing else is asked.
"""

from __future__ import annotations

import importlib
import importlib.util
import logging
import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import norm

from calib.experiment import read_experiment
from calib.problem import log_posterior, problem_from
from calib.sampling.archive import effective_sample_size
from calib.sampling.checkpoint import open_checkpoint
from calib.sampling.diagnostics import Convergence, Gate, convergence, shortcomings
from calib.sampling.ensemble import SHAPELESS, EnsembleState, Moves, autocorrelation_time, walk
from calib.sampling.identity import ENSEMBLES, identity_of, usual_walkers
from calib.sampling.sampler import CHECK_FACTOR, sample_target
from calib.sampling.start import find_modes
from calib.sampling.target import Mode, ProblemTarget, target_of
from models.sensor import FloatArray

EXPERIMENT = Path(__file__).parents[2] / "datasets" / "padded_sensor" / "experiment.toml"
#: Contenders with the package that each needs.
CONTENDERS = {"old": "calib", "new": "calib", "nuts": "numpyro", "nautilus": "nautilus", "zeus": "zeus"}

_WALKERS, _WIDER, _KEPT = 80, 1.5, 4000
# Steps before the first look of walkers that know no shape, and of those kept every how many-th.
_FIRST, _STORED = 200, 2
_MAX_TAU_STEPS = 500
# Iterations of the No-U-Turn sampler: to warm up, and from one look to the next.
_WARM_UP, _ITERATIONS = 300, 50
# Seconds from one look at nautilus to the next.
_GLANCE = 10.0

#: More steps of an ensemble: its number and how many steps in, those stored out, (n_stored, n_walker, n).
Steps = Callable[[int, int], FloatArray]


@dataclass(frozen=True)
class Budget:
    """What a contender may spend: steps of each walker, and processor seconds."""

    steps: int
    seconds: float

    @property
    def spent(self) -> bool:
        """Whether the processor seconds are."""
        return time.process_time() >= self.seconds


@dataclass(frozen=True)
class Cost:
    """What an effective sample size cost.

    Attributes
    ----------
    size : wanted.
    seconds : of the processor since the process began until it was reached; where it was not, what it would take at the rate
        of the run, inf if that is not known.
    reached : effective sample size in the end.
    stopped : processor seconds when the budget was spent; 0 if the size was reached.
    """

    size: float
    seconds: float
    reached: float
    stopped: float = 0.0

    def __str__(self) -> str:
        """As columns of a table."""
        if not self.stopped:
            return f"{self.size:.0f} | {self.seconds:.1f} | {self.reached:.0f}"
        guess = f"about {self.seconds:.0f}" if math.isfinite(self.seconds) else f"more than {self.stopped:.0f}"
        return f"{self.size:.0f} | {guess} | {self.reached:.0f} after {self.stopped:.0f} s"


def on_one_core() -> None:
    """Keep this process on one core, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def port_errors(n_draw: int, seed: int) -> tuple[float, float]:
    """How far the posterior written for JAX is off that of `calib.problem`.

    Parameters
    ----------
    n_draw : draws of each kind.
    seed : of the draws.

    Returns
    -------
    The largest difference of the log density at draws round the mode; and at draws of the prior, where it may be -1e9, as a
    share of it. Infinite where only one of them holds a draw possible.
    """
    jax, port = (importlib.import_module(name) for name in ("jax", "samplers.port"))
    target = target_of(problem_from(read_experiment(EXPERIMENT)))
    problem = target.space.problem
    near, _ = target.to_theta(_round_the_mode(target, np.random.SeedSequence(seed), n_draw))
    theta = np.concatenate([near, np.random.default_rng(seed).standard_normal((n_draw, near.shape[1]))])
    ours = log_posterior(problem, theta)
    theirs = np.asarray(jax.jit(jax.vmap(port.log_posterior_of(problem)))(theta), dtype=float)
    both = np.isfinite(ours) & np.isfinite(theirs)
    off = np.where(np.isfinite(ours) == np.isfinite(theirs), 0.0, np.inf)
    off[both] = np.abs(ours[both] - theirs[both])
    share = off.copy()
    share[both] /= np.maximum(np.abs(ours[both]), 1.0)
    return float(np.max(off[:n_draw])), float(np.max(share[n_draw:]))


def is_installed(contender: str) -> bool:
    """Whether the package that a contender needs is there."""
    return importlib.util.find_spec(CONTENDERS[contender]) is not None


def costs(contender: str, sizes: Sequence[float], seed: int, budget: Budget) -> Iterator[Cost]:
    """Sample with a contender until each of the sizes is reached, or the budget is spent.

    Parameters
    ----------
    contender : one of `CONTENDERS`.
    sizes : effective sample sizes wanted, of the worst unknown, rising.
    seed : of the run.
    budget : of steps and processor seconds; nautilus has no steps, and the No-U-Turn sampler only iterations.

    Yields
    ------
    One for each size.
    """
    target = target_of(problem_from(read_experiment(EXPERIMENT)))
    match contender:
        case "new":
            yield from _new(target, sizes, seed, budget)
        case "old":
            yield from _walked(target, _old(target, seed), sizes, budget)
        case "zeus":
            yield from _walked(target, _zeus(target, seed), sizes, budget)
        case "nuts":
            yield from _nuts(target, sizes, seed, budget)
        case _:
            yield from _nautilus(target, sizes, seed, budget)


def _worst(state: Convergence) -> float:
    return float(np.min(state.ess_bulk))


def _new(target: ProblemTarget, sizes: Sequence[float], seed: int, budget: Budget) -> Iterator[Cost]:
    problem = target.space.problem
    with tempfile.TemporaryDirectory() as place:
        folder = open_checkpoint(Path(place), identity_of(problem, seed), resume=False)
        for size in sizes:  # the second goes on from the first
            gate = Gate(ess=size)
            chains = sample_target(
                target,
                folder,
                seed=seed,
                n_ensembles=ENSEMBLES,
                n_walker=usual_walkers(problem),
                gate=gate,
                max_steps=budget.steps,
                processes=0,
            )
            now, passed = time.process_time(), not shortcomings(chains.state, target.names, gate)
            yield Cost(size, now if passed else math.inf, _worst(chains.state), 0.0 if passed else now)


def _walked(target: ProblemTarget, steps: Steps, sizes: Sequence[float], budget: Budget) -> Iterator[Cost]:
    """Let walkers of several ensembles go on from look to look; the first half is burn-in."""
    wanted, done, until = list(sizes), 0, min(_FIRST, budget.steps)
    parts: list[list[FloatArray]] = [[] for _ in range(ENSEMBLES)]
    while wanted:
        for k, part in enumerate(parts):
            part.append(steps(k, until - done))
        done = until
        x = np.stack([np.concatenate(part) for part in parts])
        x = x[:, x.shape[1] // 2 :]
        fine = x[:, :: math.ceil(x.shape[1] / _MAX_TAU_STEPS)]
        tau = autocorrelation_time(fine) * _STORED * math.ceil(x.shape[1] / _MAX_TAU_STEPS)
        kept = x[:, :: math.ceil(x.shape[1] / max(1, _KEPT // x.shape[2]))]
        theta, _ = target.to_theta(kept.reshape(-1, kept.shape[-1]))
        state = convergence(target.columns(theta).reshape(kept.shape), tau, done)
        while wanted and not shortcomings(state, target.names, Gate(ess=wanted[0])):
            yield Cost(wanted.pop(0), time.process_time(), _worst(state))
        if until == budget.steps or budget.spent:
            break
        until = min(budget.steps, 2 * math.ceil(CHECK_FACTOR * until / 2))
    stopped = time.process_time()
    for size in wanted:
        yield Cost(size, stopped * longer(state, Gate(ess=size)), _worst(state), stopped)


def longer(state: Convergence, gate: Gate) -> float:
    """How many times as long a run would have to be to pass a gate, as R-hat less 1 falls as effective sizes rise.

    Parameters
    ----------
    state : of the run.
    gate : that it has not passed.
    """
    short = (gate.ess / np.min(state.ess), gate.length * np.max(state.tau) / state.steps)
    return float(max(*short, (np.max(state.r_hat) - 1) / (gate.r_hat - 1), 1.0))


def _round_the_mode(target: ProblemTarget, seed: np.random.SeedSequence, n_walker: int = _WALKERS) -> FloatArray:
    """Walkers round the highest mode that one ensemble finds, wider than it; those far below are drawn anew from narrower."""
    rng = np.random.default_rng(seed)
    mode: Mode = find_modes(target, seed)[0]
    x = np.tile(mode.x, (n_walker, 1))
    left, width = np.arange(n_walker), _WIDER
    while left.size:
        x[left] = mode.x + width * rng.standard_normal((left.size, mode.x.size)) @ mode.factor.T
        left = left[~(target.log_density(x[left]) > mode.log_density - 5 * mode.x.size)]
        width *= 0.8
    return x


def _old(target: ProblemTarget, seed: int) -> Steps:
    states: dict[int, EnsembleState] = {}
    for k, own in enumerate(np.random.SeedSequence(seed).spawn(ENSEMBLES)):
        x = _round_the_mode(target, own)
        states[k] = EnsembleState.of(x, target.log_density(x), np.random.RandomState(np.random.MT19937(own)))

    def steps(ensemble: int, n_steps: int) -> FloatArray:
        path = walk(target, states[ensemble], Moves(SHAPELESS), n_steps)
        states[ensemble] = path.end
        return path.chain

    return steps


def _zeus(target: ProblemTarget, seed: int) -> Steps:
    zeus = importlib.import_module("zeus")
    logging.disable(logging.WARNING)
    n = len(target.names)
    samplers = [zeus.EnsembleSampler(_WALKERS, n, target.log_density, vectorize=True, verbose=False) for _ in range(ENSEMBLES)]
    ends = {k: _round_the_mode(target, own) for k, own in enumerate(np.random.SeedSequence(seed).spawn(ENSEMBLES))}

    def steps(ensemble: int, n_steps: int) -> FloatArray:
        sampler = samplers[ensemble]
        sampler.reset()
        sampler.run_mcmc(ends[ensemble], n_steps, progress=False)
        ends[ensemble] = sampler.get_last_sample()
        return np.asarray(sampler.get_chain(), dtype=float)[_STORED - 1 :: _STORED]

    return steps


def _nuts(target: ProblemTarget, sizes: Sequence[float], seed: int, budget: Budget) -> Iterator[Cost]:
    """One chain, in the priors' coordinates; what it adapts to in the warm-up is kept."""
    jax, infer, port = (importlib.import_module(name) for name in ("jax", "numpyro.infer", "samplers.port"))
    log_posterior = port.log_posterior_of(target.space.problem)
    first, _ = target.to_theta(_round_the_mode(target, np.random.SeedSequence(seed), 1))

    def potential(z: Any) -> Any:
        return -log_posterior(z)

    kernel = infer.NUTS(potential_fn=potential, dense_mass=True)
    sampler = infer.MCMC(
        kernel, num_warmup=min(_WARM_UP, budget.steps), num_samples=min(_ITERATIONS, budget.steps), progress_bar=False
    )
    sampler.warmup(jax.random.PRNGKey(seed), init_params=jax.numpy.asarray(first[0]))
    warm = time.process_time()
    wanted, parts = list(sizes), []
    reached = 0.0
    while wanted:
        sampler.run(sampler.post_warmup_state.rng_key)
        parts.append(np.asarray(sampler.get_samples(), dtype=float))
        sampler.post_warmup_state = sampler.last_state
        z = np.concatenate(parts)
        reached = min(effective_sample_size(column[None]) for column in target.columns(z).T)
        while wanted and reached > wanted[0]:
            yield Cost(wanted.pop(0), time.process_time(), reached)
        if len(z) >= budget.steps or budget.spent:
            break
    stopped = time.process_time()
    for size in wanted:
        yield Cost(size, warm + (stopped - warm) * max(size / reached, 1.0), reached, stopped)


def _nautilus(target: ProblemTarget, sizes: Sequence[float], seed: int, budget: Budget) -> Iterator[Cost]:
    nautilus = importlib.import_module("nautilus")
    sampler = nautilus.Sampler(
        norm.ppf, partial(_log_likelihood, target), n_dim=len(target.names), vectorized=True, seed=seed, pool=None
    )
    explored = 0.0
    for size in sizes:
        done = False
        while not (done or budget.spent):
            done = sampler.run(n_eff=size, timeout=_GLANCE, verbose=False)
            explored = explored or (time.process_time() if sampler.explored else 0.0)
        now, reached = time.process_time(), float(sampler.n_eff)
        guess = explored + (now - explored) * max(size / reached, 1.0) if explored else math.inf
        yield Cost(size, now, reached) if done else Cost(size, guess, reached, now)


def _log_likelihood(target: ProblemTarget, theta: FloatArray) -> FloatArray:
    value = log_posterior(target.space.problem, theta) + 0.5 * np.sum(theta**2, axis=1)
    return np.asarray(np.nan_to_num(value, nan=-1e300, neginf=-1e300), dtype=float)
