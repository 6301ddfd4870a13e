"""Checkpointed steps of all ensembles in, how far they have converged and, in the end, the posterior out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from calib.problem import (
    ParameterInfo,
    Problem,
    block_names,
    columns_at,
    log_likelihood_blocks,
    of_lot,
    range_use,
    values_of_lot,
)
from calib.provenance import commit, platform_in_words, versions
from calib.sampling.checkpoint import CheckpointFolder, load_accepted, load_chain, load_modes, load_proposal
from calib.sampling.diagnostics import (
    RANGE_TOUCH,
    RANGE_TOUCH_SHARE,
    Convergence,
    Diagnostics,
    Gate,
    convergence,
    range_warning,
    shortcomings,
    summarise,
)
from calib.sampling.ensemble import KINDS, STORE_EVERY, autocorrelation_time, standing_time
from calib.sampling.findings import ParameterSummary
from calib.sampling.importance import contradictions, misweighted, nearest, second_opinion
from calib.sampling.posterior import Posterior, leave_out
from calib.sampling.start import distinct_modes
from calib.sampling.target import Mode, Target
from models.sensor import FloatArray

#: Steps of a block, after each of which a checkpoint is written.
BLOCK_STEPS = 10

#: Most draws of an ensemble that a posterior keeps.
MAX_DRAWS = 4000
# Of how many of these one is looked at while a run is too short anyway.
_FEWER = 4

# Most steps of a chain that the autocorrelation time is computed from.
_MAX_TAU_STEPS = 500
_BATCH = 512
# Stream of random numbers beside the seed's for what is of a lot, so that no other draws depend on it.
_OF_LOT = 3
# Batches of draws that a worker computes at a time.
_SHARE = 4


@dataclass(frozen=True, eq=False)
class SamplingRun:
    """A sampling run in progress: the target, the folder of its checkpoints, a seed for each ensemble, and walkers of each."""

    target: Target
    folder: CheckpointFolder
    seeds: list[np.random.SeedSequence]
    n_walker: int


def look(run: SamplingRun, modes: Sequence[Mode], n_block: int, gate: Gate, *, on_the_way: bool = False) -> Convergence:
    """Judge how far a run has converged, from the draws that a posterior would keep of its first blocks.

    Parameters
    ----------
    run : with the checkpoints of these blocks.
    modes : that were found before.
    n_block : blocks of each ensemble.
    gate : what the run has to reach; where it does, a second opinion is asked for.
    on_the_way : whether the run goes on unless it meets the gate: one that is too short to is judged by fewer of its draws,
        as R-hat and effective sizes of hundreds of unknowns take as long as dozens of steps.
    """
    n_stored = n_block * BLOCK_STEPS // STORE_EVERY
    burn_in, thin = _kept(n_stored, run.n_walker)
    every = max(1, math.ceil((n_stored - burn_in) / _MAX_TAU_STEPS))
    ensembles = range(len(run.seeds))
    fine = np.stack([load_chain(run.folder, k, n_block, burn_in, every)[0] for k in ensembles])
    tau = STORE_EVERY * every * np.maximum(autocorrelation_time(fine), standing_time(fine))
    if on_the_way and n_block * BLOCK_STEPS < gate.length * np.max(tau):
        thin *= _FEWER
    chains = np.stack([load_chain(run.folder, k, n_block, burn_in, thin)[0] for k in ensembles])
    theta = chains.reshape(-1, chains.shape[-1])
    state = convergence(run.target.columns(theta).reshape(chains.shape), tau, n_block * BLOCK_STEPS)
    state = replace(state, doubts=_standing(fine))
    return state if shortcomings(state, run.target.names, gate) else replace(state, doubts=_doubts(run, modes, theta, state))


def _standing(chains: FloatArray) -> tuple[str, ...]:
    """Which ensembles of chains (n_ensemble, n_step, n_walker, n_parameter) have walkers that stand still throughout."""
    if chains.shape[1] < 2:
        return ()
    still = np.sum(np.all(chains == chains[:, :1], axis=(1, 3)), axis=1)
    return tuple(
        f"ensemble {k}: {n} of {chains.shape[2]} walkers never moved after the burn-in" for k, n in enumerate(still, 1) if n
    )


def _doubts(run: SamplingRun, modes: Sequence[Mode], theta: FloatArray, state: Convergence) -> tuple[str, ...]:
    """What independent weighted draws say against chains theta (n_draw, n) that agree with each other."""
    if run.target.groups and len(modes) > 1:
        heights = ", ".join(f"{m.log_density - modes[0].log_density:+.1f}" for m in modes[1:])
        return (
            f"{len(modes)} modes were found (log densities beside that of the heaviest: {heights}), between which there are no "
            "steps where specimens are many: which share of the posterior each has is not known",
        )
    proposals = [load_proposal(run.folder, k) for k in range(len(run.seeds))]
    fitting = [proposal for proposal in proposals if proposal is not None]
    rivals = _rivals(run)
    if not fitting and not rivals:
        return ()
    seed = np.random.SeedSequence(run.seeds[0].entropy, spawn_key=(len(run.seeds), state.steps))
    opinion = second_opinion(run.target, fitting, seed, rivals)
    wrong: tuple[str, ...] = ()
    if rivals:
        own = np.bincount(nearest(run.target.from_theta(theta), rivals), minlength=len(rivals)) / len(theta)
        wrong = misweighted(opinion, rivals, own, float(np.min(state.ess)))
    if fitting and not opinion.trusted and len(modes) > 1:
        unconfirmed = f"independent draws cannot confirm their weights (k-hat {opinion.k_hat:.2f})"
        return (f"{len(modes)} modes were found, and {unconfirmed}", *wrong)
    values = run.target.columns(theta)
    return (
        *wrong,
        *contradictions(opinion, run.target.names, np.mean(values, axis=0), np.std(values, axis=0, ddof=1), state.ess),
    )


def _rivals(run: SamplingRun) -> tuple[Mode, ...]:
    """All modes that any climb found with valleys between them, those of hardly any mass too; () if there is one alone."""
    if run.target.groups:
        return ()
    found = distinct_modes(run.target, [m for k in range(len(run.seeds)) for m in load_modes(run.folder, k) or ()])
    return found if len(found) > 1 else ()


def finish(
    problem: Problem,
    run: SamplingRun,
    n_block: int,
    state: Convergence,
    gate: Gate,
    seed: int,
    attrs: Mapping[str, str],
    executor: Executor | None = None,
) -> Posterior:
    """Make the posterior of a run from its first blocks, with its diagnostics.

    Parameters
    ----------
    problem : that was sampled.
    run : of it, with the checkpoints of these blocks.
    n_block : blocks of each ensemble.
    state : what `look` found of them.
    gate : what the run has to reach.
    seed : of the run.
    attrs : texts to keep with the posterior; versions are added.
    executor : for the likelihoods of blocks; None for this process.
    """
    burn_in, thin = _kept(n_block * BLOCK_STEPS // STORE_EVERY, run.n_walker)
    loaded = [load_chain(run.folder, k, n_block, burn_in, thin) for k in range(len(run.seeds))]
    n_ensemble, n_parameter = len(loaded), len(problem.parameters)
    theta = np.stack([chain.reshape(-1, n_parameter) for chain, _ in loaded])
    flat = theta.reshape(-1, n_parameter)
    values = columns_at(problem, flat)
    lot = of_lot(problem)
    of_lots = list(values_of_lot(problem, flat, np.random.default_rng([seed, _OF_LOT])).values())
    parts = np.array_split(flat, max(1, math.ceil(flat.shape[0] / _BATCH)))
    shares = [parts[k : k + _SHARE] for k in range(0, len(parts), _SHARE)]
    likelihoods = (map if executor is None else executor.map)(partial(_blocks, problem), shares)
    blocks = np.concatenate(list(likelihoods))
    first = n_block // 2
    counts = [load_accepted(run.folder, k, n_block, first) for k in range(n_ensemble)]
    tried, accepted = (np.stack(part) for part in zip(*counts, strict=True))
    reasons = shortcomings(state, problem.names, gate)
    summaries = summarise(problem.parameters, values, flat, state)
    summaries |= _summaries_of_lot(lot, of_lots, (n_ensemble, -1, run.n_walker), state)
    diagnostics = Diagnostics(
        converged=not reasons,
        reasons=reasons,
        warnings=_range_warnings(problem, parts),
        parameters=summaries,
        steps=n_block * BLOCK_STEPS,
        burn_in=burn_in * STORE_EVERY,
        thin=thin * STORE_EVERY,
        n_walker=run.n_walker,
        gate=gate,
        acceptance_fraction=tuple(float(a) for a in np.sum(accepted, axis=1) / np.sum(tried, axis=1)),
        acceptance_by_move={
            kind: float(np.sum(accepted[:, k]) / np.sum(tried[:, k])) for k, kind in enumerate(KINDS) if np.any(tried[:, k])
        },
        tau={name: float(t) for name, t in zip(problem.names, state.tau, strict=True)},
    )
    found = Posterior(
        experiment=problem.experiment,
        sweeps=problem.sweeps,
        parameters=(*problem.parameters, *lot),
        fixed=dict(problem.fixed),
        forward_name=problem.forward.name,
        draws=np.column_stack([values, *of_lots]).reshape(n_ensemble, -1, n_parameter + len(lot)),
        log_prob=np.stack([log_prob.reshape(-1) for _, log_prob in loaded]),
        log_likelihood=blocks.reshape(n_ensemble, -1, blocks.shape[1]),
        blocks=block_names(problem),
        n_walkers=run.n_walker,
        seed=seed,
        diagnostics=diagnostics,
        attrs={**_program(), **attrs},
    )
    with np.errstate(over="ignore"):  # ArviZ lets exponentials of hopeless draws overflow on purpose
        influence = tuple(float(k) for k in leave_out(found).k_hat)
    return replace(found, diagnostics=replace(diagnostics, block_k_hat=influence))


def _summaries_of_lot(
    lot: Sequence[ParameterInfo], draws: Sequence[FloatArray], shape: tuple[int, int, int], state: Convergence
) -> dict[str, ParameterSummary]:
    """What is of a lot in numbers, from draws (n,) of each, which are no chains of their own but follow those of specimens."""
    if not lot:
        return {}
    columns = np.column_stack(draws)
    found = convergence(columns.reshape(*shape, len(lot)), np.full(len(lot), np.max(state.tau)), state.steps)
    z = np.column_stack([info.prior.to_normal(column) for info, column in zip(lot, draws, strict=True)])
    return summarise(lot, columns, z, found)


def _blocks(problem: Problem, parts: Sequence[FloatArray]) -> FloatArray:
    """Likelihoods of the blocks of data of draws that come in parts, (n_draw, n_block)."""
    return np.concatenate([log_likelihood_blocks(problem, part) for part in parts])


def _kept(n_stored: int, n_walker: int) -> tuple[int, int]:
    """How many stored steps are burn-in, and every how many-th step of the rest is kept."""
    burn_in = n_stored // 2
    return burn_in, max(1, math.ceil((n_stored - burn_in) / max(1, MAX_DRAWS // n_walker)))


def _range_warnings(problem: Problem, parts: list[FloatArray]) -> tuple[str, ...]:
    """Warn if draws of the posterior lie close to the end of the range that the forward model covers."""
    touching = float(np.mean(np.concatenate([range_use(problem, part) for part in parts]) > RANGE_TOUCH))
    return (range_warning(touching, problem.forward.name),) if touching > RANGE_TOUCH_SHARE else ()


def _program() -> dict[str, str]:
    """What the draws were made with: versions, platform, and the commit of this package, if that can be told."""
    found = {f"version of {name}": number for name, number in versions().items()} | {"platform": platform_in_words()}
    return found | ({"commit": of_clone} if (of_clone := commit()) else {})
