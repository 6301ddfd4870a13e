"""A calibration problem in, draws of its posterior from independent ensembles with their diagnostics, saved and loaded, out."""

from __future__ import annotations

import importlib.metadata
import json
import math
import os
import platform
import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np

from calib.catalogue import UnknownName
from calib.experiment import Experiment, experiment_from_json, experiment_to_json
from calib.lab import Sweep, sweeps_from_json, sweeps_to_json
from calib.priors import prior_from_json
from calib.problem import ParameterInfo, Problem, block_names, columns_at, log_likelihood_blocks, range_use, specimen_design
from calib.sampling.archive import Archive, LeaveOut, leave_blocks_out, read_archive, write_archive
from calib.sampling.checkpoint import (
    fingerprint,
    load_accepted,
    load_chain,
    load_state,
    open_checkpoint,
    save_block,
    save_start,
)
from calib.sampling.diagnostics import (
    Convergence,
    Diagnostics,
    Gate,
    convergence,
    diagnostics_from_json,
    diagnostics_to_json,
    prior_conflicts,
    shortcomings,
    summarise,
)
from calib.sampling.ensemble import STORE_EVERY, Block, EnsembleState, advance, autocorrelation_time, start
from calib.workers import workers
from models.sensor import FloatArray

__all__ = [
    "Gate",
    "Posterior",
    "Progress",
    "leave_out",
    "load_posterior",
    "sample",
    "save_posterior",
    "specimen_design",
    "thin_draws",
]

#: Steps of a block, after each of which a checkpoint is written.
BLOCK_STEPS = 50

#: Steps after which convergence is first looked at, and the factor from one look to the next.
FIRST_CHECK = 200
CHECK_FACTOR = 1.3

#: Most draws of an ensemble that a posterior keeps.
MAX_DRAWS = 4000

#: A draw whose deepest point lies beyond this share of the forward model's range touches its end; more than this share of such
#: draws is worth a warning.
RANGE_TOUCH = 0.98
RANGE_TOUCH_SHARE = 0.01

# Most steps of a chain that the autocorrelation time is computed from.
_MAX_TAU_STEPS = 500
_BATCH = 512


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of a posterior, complete with what they are of.

    Attributes
    ----------
    parameters : the unknowns, in the order of the last axis of `draws`; `fixed` : what a prior fixed.
    draws : (n_ensemble, n_draw, n_parameter), SI, all walkers of one step, then of the next kept step.
    log_prob : (n_ensemble, n_draw), log posterior density in the priors' coordinates, up to a constant.
    log_likelihood : (n_ensemble, n_draw, n_block), see `log_likelihood_blocks`; `blocks` : their names.
    n_walkers : of each ensemble.
    attrs : versions, command, start and end time, ...
    """

    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    parameters: tuple[ParameterInfo, ...]
    fixed: Mapping[str, float]
    forward_name: str
    draws: FloatArray
    log_prob: FloatArray
    log_likelihood: FloatArray
    blocks: tuple[str, ...]
    n_walkers: int
    seed: int
    diagnostics: Diagnostics
    attrs: Mapping[str, str]


@dataclass(frozen=True)
class Progress:
    """How far a run is: steps of each walker, seconds, draws of all ensembles, and at the last look the worst parameters.

    `r_hat` is nan and `ess` zero before the first look. `target` is the effective sample size wanted, `max_steps` the budget.
    """

    steps: int
    elapsed: float
    draws: int
    r_hat: float
    r_hat_parameter: str
    ess: float
    ess_parameter: str
    target: float
    max_steps: int


def sample(
    problem: Problem,
    *,
    seed: int,
    checkpoint: Path,
    resume: bool = False,
    n_ensembles: int = 4,
    n_walkers: int | None = None,
    gate: Gate | None = None,
    max_steps: int = 20_000,
    max_seconds: float = math.inf,
    processes: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    attrs: Mapping[str, str] | None = None,
) -> Posterior:
    """Sample the posterior with independent ensembles until the gate is met or the budget is spent.

    Each ensemble has its own start and its own stream of random numbers, so that the draws depend on the seed alone: not on the
    number of processes, on interruptions, or on time, unless `max_seconds` ends the run. The first half of a run is discarded
    as burn-in; as the gate asks for 10 autocorrelation times, that is at least 5 of them. Of the second half every n-th step
    is kept, so that an ensemble has at most `MAX_DRAWS` draws; the diagnostics are those of these draws.

    Parameters
    ----------
    seed : not negative.
    checkpoint : folder of checkpoints. Without `resume` it is emptied of earlier ones.
    n_walkers : of each ensemble, default four per parameter and at least 64.
    max_steps, max_seconds : budget, of each walker over the whole run and of this call.
    processes : worker processes (one BLAS thread each); default the number of CPUs up to 4. 0 samples in this process.
    progress : called after every block.
    attrs : texts to keep with the posterior, such as the command.

    Raises
    ------
    InputError
        If a run with other inputs is to be resumed.
    """
    if n_ensembles < 4:
        raise ValueError(f"at least four independent ensembles are needed to judge convergence, got {n_ensembles}")
    if not problem.parameters:
        raise ValueError("every parameter is fixed: there is nothing to sample")
    gate = gate or Gate()
    n_walker = n_walkers or max(64, 4 * len(problem.parameters))
    begin = datetime.now(UTC)
    clock = time.monotonic()
    open_checkpoint(checkpoint, fingerprint(problem, seed, n_ensembles, n_walker), resume=resume)
    run = _Run(problem, checkpoint, np.random.SeedSequence(seed).spawn(n_ensembles), n_walker)
    state: Convergence | None = None

    def report(n_block: int) -> None:
        if progress is not None:
            progress(_progress(problem, state, n_block, n_ensembles * n_walker, time.monotonic() - clock, gate, max_steps))

    last = max(1, max_steps // BLOCK_STEPS)
    look = min(last, FIRST_CHECK // BLOCK_STEPS)
    # More processes than ensembles would idle.
    with workers(0 if processes == 0 else min(4, n_ensembles, processes or os.cpu_count() or 1)) as executor:
        while True:
            n_block = _advance_to(run, executor, look, clock + max_seconds, report)
            state = _look(run, n_block)
            report(n_block)
            if n_block < look or look == last or not shortcomings(state, problem.names, gate):
                break
            look = min(last, math.ceil(CHECK_FACTOR * look))
    kept = {"started": begin.isoformat(timespec="seconds"), "ended": datetime.now(UTC).isoformat(timespec="seconds")}
    return _posterior(run, n_block, state, gate, seed, {**_versions(), **kept, **(attrs or {})})


# --- advancing ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Run:
    problem: Problem
    folder: Path
    seeds: list[np.random.SeedSequence]
    n_walker: int


def _advance_to(run: _Run, executor: Executor, n_block: int, deadline: float, report: Callable[[int], None]) -> int:
    """Advance all ensembles to `n_block` blocks or until the deadline; the number of blocks that all of them have."""
    count: dict[int, int] = {}
    pending: dict[Future[EnsembleState | Block], int] = {}

    def submit(ensemble: int) -> None:
        state, count[ensemble] = load_state(run.folder, ensemble)
        work: Callable[[], EnsembleState | Block]
        if state is None:
            work = partial(start, run.problem, run.seeds[ensemble], run.n_walker)
        elif count[ensemble] >= n_block:
            return
        else:
            work = partial(advance, run.problem, state, BLOCK_STEPS)
        pending[executor.submit(work)] = ensemble

    for ensemble in range(len(run.seeds)):
        submit(ensemble)
    while pending:
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        for future in sorted(done, key=lambda f: pending[f]):
            ensemble, result = pending.pop(future), future.result()
            if isinstance(result, Block):
                save_block(run.folder, ensemble, count[ensemble], result)
                count[ensemble] += 1
            else:
                save_start(run.folder, ensemble, result)
            if time.monotonic() < deadline or min(count.values()) == 0:
                submit(ensemble)
        report(min(n_block, *count.values()))
    return min(n_block, *count.values())


# --- looking ------------------------------------------------------------------------------------------------------------


def _kept(n_stored: int, n_walker: int) -> tuple[int, int]:
    """Stored steps of burn-in, and every how many-th of the rest is kept."""
    burn_in = n_stored // 2
    return burn_in, max(1, math.ceil((n_stored - burn_in) / max(1, MAX_DRAWS // n_walker)))


def _look(run: _Run, n_block: int) -> Convergence:
    """Convergence of the first `n_block` blocks."""
    n_stored = n_block * BLOCK_STEPS // STORE_EVERY
    burn_in, thin = _kept(n_stored, run.n_walker)
    every = max(1, math.ceil((n_stored - burn_in) / _MAX_TAU_STEPS))
    ensembles = range(len(run.seeds))
    fine = np.stack([load_chain(run.folder, k, n_block, burn_in, every)[0] for k in ensembles])
    tau = STORE_EVERY * every * autocorrelation_time(fine)
    chains = np.stack([load_chain(run.folder, k, n_block, burn_in, thin)[0] for k in ensembles])
    return convergence(chains, tau, n_block * BLOCK_STEPS)


def _progress(
    problem: Problem, state: Convergence | None, n_block: int, n_walker: int, elapsed: float, gate: Gate, max_steps: int
) -> Progress:
    steps = n_block * BLOCK_STEPS
    if state is None:
        return Progress(steps, elapsed, steps * n_walker, math.nan, "", 0.0, "", gate.ess, max_steps)
    worst, least = state.worst_r_hat, state.least_ess
    r_hat, ess = float(state.r_hat[worst]), float(state.ess[least])
    names = problem.names
    return Progress(steps, elapsed, steps * n_walker, r_hat, names[worst], ess, names[least], gate.ess, max_steps)


def _posterior(run: _Run, n_block: int, state: Convergence, gate: Gate, seed: int, attrs: Mapping[str, str]) -> Posterior:
    problem = run.problem
    burn_in, thin = _kept(n_block * BLOCK_STEPS // STORE_EVERY, run.n_walker)
    loaded = [load_chain(run.folder, k, n_block, burn_in, thin) for k in range(len(run.seeds))]
    n_ensemble, n_parameter = len(loaded), len(problem.parameters)
    theta = np.stack([chain.reshape(-1, n_parameter) for chain, _ in loaded])
    flat = theta.reshape(-1, n_parameter)
    values = columns_at(problem, flat)
    parts = np.array_split(flat, max(1, math.ceil(flat.shape[0] / _BATCH)))
    blocks = np.concatenate([log_likelihood_blocks(problem, part) for part in parts])
    first = n_block // 2
    accepted = [float(np.mean(load_accepted(run.folder, k, n_block, first))) for k in range(n_ensemble)]
    still = [_n_still(chain) for chain, _ in loaded]
    reasons = [*shortcomings(state, problem.names, gate)]
    reasons += [
        f"ensemble {k + 1}: {n} of {run.n_walker} walkers never moved after the burn-in" for k, n in enumerate(still) if n
    ]
    summaries = summarise(problem.parameters, values, flat, state)
    diagnostics = Diagnostics(
        converged=not reasons,
        reasons=tuple(reasons),
        warnings=(*_range_warnings(problem, parts), *prior_conflicts(summaries)),
        parameters=summaries,
        steps=n_block * BLOCK_STEPS,
        burn_in=burn_in * STORE_EVERY,
        thin=thin * STORE_EVERY,
        n_walker=run.n_walker,
        acceptance_fraction=tuple(a / ((n_block - first) * BLOCK_STEPS) for a in accepted),
        tau={name: float(t) for name, t in zip(problem.names, state.tau, strict=True)},
        gate=gate,
    )
    return Posterior(
        experiment=problem.experiment,
        sweeps=problem.sweeps,
        parameters=problem.parameters,
        fixed=dict(problem.fixed),
        forward_name=problem.forward.name,
        draws=values.reshape(theta.shape),
        log_prob=np.stack([log_prob.reshape(-1) for _, log_prob in loaded]),
        log_likelihood=blocks.reshape(n_ensemble, -1, blocks.shape[1]),
        blocks=block_names(problem),
        n_walkers=run.n_walker,
        seed=seed,
        diagnostics=diagnostics,
        attrs=dict(attrs),
    )


def _n_still(chain: FloatArray) -> int:
    """Walkers of a chain (n_step, n_walker, n_parameter) that stand still throughout."""
    return int(np.count_nonzero(np.all(chain == chain[:1], axis=(0, 2)))) if chain.shape[0] > 1 else 0


def _range_warnings(problem: Problem, parts: list[FloatArray]) -> tuple[str, ...]:
    """Whether the posterior touches the end of what the forward model covers."""
    touching = float(np.mean(np.concatenate([range_use(problem, part) for part in parts]) > RANGE_TOUCH))
    if touching <= RANGE_TOUCH_SHARE:
        return ()
    return (
        f"in {touching:.0%} of the draws the deepest point lies within 2 % of the end of what the {problem.forward.name} "
        "covers: the posterior may be cut off there",
    )


def _versions() -> dict[str, str]:
    packages = ("dielectric-elastomer-calibration", "numpy", "scipy", "emcee", "arviz")
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return {f"version of {name}": version for name, version in found.items()}


# --- using a posterior --------------------------------------------------------------------------------------------------


def thin_draws(posterior: Posterior, n: int, rng: np.random.Generator) -> dict[str, FloatArray]:
    """`n` draws at random without repetition (all, if there are fewer): parameter name -> SI values (n,), fixed included."""
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    chosen = flat[rng.choice(flat.shape[0], size=min(n, flat.shape[0]), replace=False)]
    values = {p.name: np.ascontiguousarray(chosen[:, k]) for k, p in enumerate(posterior.parameters)}
    return values | {name: np.full(chosen.shape[0], value) for name, value in posterior.fixed.items()}


def leave_out(posterior: Posterior) -> LeaveOut:
    """PSIS-LOO over the blocks of the sweeps, to compare models of the same data and to find blocks that fit badly."""
    n = posterior.log_prob.size
    ess = min(s.ess_bulk for s in posterior.diagnostics.parameters.values())
    return leave_blocks_out(posterior.log_likelihood, relative_efficiency=min(1.0, ess / n))


def save_posterior(posterior: Posterior, path: Path) -> None:
    """Write a posterior to one NetCDF file, atomically: draws, experiment, data, diagnostics and versions."""
    observed: dict[str, FloatArray] = {}
    for s in posterior.sweeps:
        observed |= {f"{channel}[{s.title}]": points.value for channel, points in s.channels.items()}
    attrs = {
        "experiment": experiment_to_json(posterior.experiment),
        "sweeps": sweeps_to_json(posterior.sweeps),
        "parameters": json.dumps([_parameter_to_json(p) for p in posterior.parameters]),
        "fixed": json.dumps(dict(posterior.fixed)),
        "blocks": json.dumps(posterior.blocks),
        "diagnostics": diagnostics_to_json(posterior.diagnostics),
        "forward": posterior.forward_name,
        "seed": str(posterior.seed),
        "n_walkers": str(posterior.n_walkers),
        "attrs": json.dumps(dict(posterior.attrs)),
    }
    draws = {p.name: posterior.draws[..., k] for k, p in enumerate(posterior.parameters)}
    write_archive(Archive(draws, posterior.log_prob, posterior.log_likelihood, observed, attrs), path)


def load_posterior(path: Path) -> Posterior:
    """The posterior that `save_posterior` wrote.

    Raises
    ------
    InputError
        If the file does not exist or is not such a posterior.
    """
    archive = read_archive(path)
    attrs = archive.attrs
    parameters = tuple(_parameter_from_json(p) for p in json.loads(attrs["parameters"]))
    return Posterior(
        experiment=experiment_from_json(attrs["experiment"]),
        sweeps=sweeps_from_json(attrs["sweeps"]),
        parameters=parameters,
        fixed=json.loads(attrs["fixed"]),
        forward_name=attrs["forward"],
        draws=np.stack([archive.posterior[p.name] for p in parameters], axis=-1),
        log_prob=archive.log_prob,
        log_likelihood=archive.log_likelihood,
        blocks=tuple(json.loads(attrs["blocks"])),
        n_walkers=int(attrs["n_walkers"]),
        seed=int(attrs["seed"]),
        diagnostics=diagnostics_from_json(attrs["diagnostics"]),
        attrs=json.loads(attrs["attrs"]),
    )


def _parameter_to_json(p: ParameterInfo) -> dict[str, object]:
    return {"name": p.name, "prior": p.prior.to_json(), "origin": p.origin}


def _parameter_from_json(data: Mapping[str, object]) -> ParameterInfo:
    prior = data["prior"]
    if not isinstance(prior, dict):
        raise ValueError(f"a prior must be an object, got {prior!r}")
    return ParameterInfo(UnknownName.parse(str(data["name"])), prior_from_json(prior), str(data["origin"]))
