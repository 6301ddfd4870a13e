"""A sampler and the shipped experiment in, processor seconds of the whole process to effective sample sizes wanted out.

Contenders: `new`, as a calibration samples; `old`, as one did before it knew shapes: 80 walkers round the highest mode, by
differential evolution and jumps alone; and of other people, where they are installed, nautilus (importance nested sampling with
neural networks, Lange 2023) and zeus (ensemble slice sampling, Karamanis, Beutler & Peacock 2021). Those that walk, zeus too,
start round the same mode and pass the same gate; nautilus says itself how many draws its weights are worth.
"""

from __future__ import annotations

import importlib.util
import logging
import math
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import norm

from calib.experiment import read_experiment
from calib.problem import log_posterior, problem_from
from calib.sampling.checkpoint import open_checkpoint
from calib.sampling.diagnostics import Gate, convergence, shortcomings
from calib.sampling.ensemble import SHAPELESS, EnsembleState, Moves, autocorrelation_time, walk
from calib.sampling.identity import ENSEMBLES, identity_of, usual_walkers
from calib.sampling.sampler import CHECK_FACTOR, sample_target
from calib.sampling.start import find_modes
from calib.sampling.target import Mode, ProblemTarget, target_of
from models.sensor import FloatArray

EXPERIMENT = Path(__file__).parents[2] / "datasets" / "padded_sensor" / "experiment.toml"
#: Contenders with the package that each needs.
CONTENDERS = {"old": "calib", "new": "calib", "nautilus": "nautilus", "zeus": "zeus"}

_WALKERS, _WIDER, _KEPT = 80, 1.5, 4000
# Steps before the first look of walkers that know no shape, and of those kept every how many-th.
_FIRST, _STORED = 200, 2
_MAX_TAU_STEPS = 500

#: More steps of an ensemble: its number and how many steps in, those stored out, (n_stored, n_walker, n).
Steps = Callable[[int, int], FloatArray]


def is_installed(contender: str) -> bool:
    """Whether the package that a contender needs is there."""
    return importlib.util.find_spec(CONTENDERS[contender]) is not None


def times(contender: str, sizes: Sequence[float], seed: int, max_steps: int) -> Iterator[tuple[float, float, float]]:
    """Sample with a contender until each of the sizes is reached, or the steps are spent.

    Parameters
    ----------
    contender : one of `CONTENDERS`.
    sizes : effective sample sizes wanted, of the worst unknown, rising.
    seed : of the run.
    max_steps : budget of each walker; for nautilus, of a thousand evaluations each.

    Yields
    ------
    For each size it, the processor seconds since this process began, and the size reached.
    """
    target = target_of(problem_from(read_experiment(EXPERIMENT)))
    if contender == "new":
        yield from _new(target, sizes, seed, max_steps)
    elif contender == "nautilus":
        yield from _nautilus(target, sizes, seed, max_steps)
    else:
        yield from _walked(target, {"old": _old, "zeus": _zeus}[contender](target, seed), sizes, max_steps)


def _new(target: ProblemTarget, sizes: Sequence[float], seed: int, max_steps: int) -> Iterator[tuple[float, float, float]]:
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
                max_steps=max_steps,
                processes=0,
            )
            passed = not shortcomings(chains.state, target.names, gate)
            yield size, time.process_time() if passed else math.inf, float(np.min(chains.state.ess))


def _walked(
    target: ProblemTarget, steps: Steps, sizes: Sequence[float], max_steps: int
) -> Iterator[tuple[float, float, float]]:
    """Let walkers of several ensembles go on from look to look; the first half is burn-in."""
    wanted, done, until = list(sizes), 0, min(_FIRST, max_steps)
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
            yield wanted.pop(0), time.process_time(), float(np.min(state.ess))
        if until == max_steps:
            break
        until = min(max_steps, 2 * math.ceil(CHECK_FACTOR * until / 2))
    for size in wanted:
        yield size, math.inf, float(np.min(state.ess))


def _round_the_mode(target: ProblemTarget, seed: np.random.SeedSequence) -> FloatArray:
    """Walkers round the highest mode that one ensemble finds, wider than it; those far below are drawn anew from narrower."""
    rng = np.random.default_rng(seed)
    mode: Mode = find_modes(target, seed)[0]
    x = np.tile(mode.x, (_WALKERS, 1))
    left, width = np.arange(_WALKERS), _WIDER
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
        path = walk(target.log_density, states[ensemble], Moves(SHAPELESS), n_steps)
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


def _nautilus(target: ProblemTarget, sizes: Sequence[float], seed: int, max_steps: int) -> Iterator[tuple[float, float, float]]:
    nautilus = importlib.import_module("nautilus")
    sampler = nautilus.Sampler(
        norm.ppf, partial(_log_likelihood, target), n_dim=len(target.names), vectorized=True, seed=seed, pool=None
    )
    for size in sizes:
        done = sampler.run(n_eff=size, n_like_max=1000 * max_steps, verbose=False)
        yield size, time.process_time() if done else math.inf, float(sampler.n_eff)


def _log_likelihood(target: ProblemTarget, theta: FloatArray) -> FloatArray:
    value = log_posterior(target.space.problem, theta) + 0.5 * np.sum(theta**2, axis=1)
    return np.asarray(np.nan_to_num(value, nan=-1e300, neginf=-1e300), dtype=float)
