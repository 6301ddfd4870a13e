"""A calibration problem in, a posterior out: independent ensembles are advanced and looked at until they agree."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import nullcontext
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np

from calib.problem import Problem
from calib.sampling.assess import BLOCK_STEPS, SamplingRun, finish, look
from calib.sampling.checkpoint import (
    CheckpointFolder,
    load_modes,
    load_proposal,
    load_state,
    open_checkpoint,
    save_block,
    save_modes,
    save_start,
)
from calib.sampling.diagnostics import Convergence, Gate, shortcomings
from calib.sampling.ensemble import Block, advance
from calib.sampling.identity import ENSEMBLES, FINGERPRINT, identity_of, usual_walkers
from calib.sampling.posterior import Posterior
from calib.sampling.start import Start, find_modes, join_modes, start
from calib.sampling.target import Mode, Target, target_of
from calib.workers import Crew, workers
from models.threads import one_thread

#: Steps after which convergence is first looked at, and the largest factor from one look to the next.
FIRST_CHECK = 80
CHECK_FACTOR = 1.3
# The least factor, where the last look tells that little is lacking.
_LEAST_FACTOR = 1.05
# What can be lacking at most, as a factor of the steps made.
_MOST_LACKING = 1e4


@dataclass(frozen=True)
class Progress:
    """How far a sampling run is, for a progress bar.

    Attributes
    ----------
    stage : "start" while modes are looked for and walkers placed, "sampling", or "block likelihoods", the last thing done.
    done, wanted : of the start, how many of its pieces of work; of sampling, steps of each walker, and how many are needed as
        far as is known, see `steps_needed`: at least so many before the first look at convergence.
    seconds_left : that sampling will take for them at the pace of this call, nan as long as nothing tells [s].
    steps : of each walker so far.
    elapsed : [s].
    draws : of all ensembles.
    r_hat, r_hat_parameter : the largest R-hat at the last look, nan before the first, and whose it is.
    ess, ess_parameter : the least effective sample size at the last look, zero before the first, and whose it is.
    target : the effective sample size wanted.
    max_steps : budget of steps.
    """

    stage: str
    done: int
    wanted: int
    seconds_left: float
    steps: int
    elapsed: float
    draws: int
    r_hat: float
    r_hat_parameter: str
    ess: float
    ess_parameter: str
    target: float
    max_steps: int


class NothingSampled(Exception):
    """The budget ended before every ensemble had made its first steps; the message says how far they came."""


class _OutOfTime(Exception):
    """The budget is spent: what workers are at is dropped."""


def sample(
    problem: Problem,
    *,
    seed: int,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    n_ensembles: int = ENSEMBLES,
    n_walkers: int | None = None,
    gate: Gate | None = None,
    max_steps: int = 20_000,
    max_seconds: float = math.inf,
    processes: int | None = None,
    crew: Crew | None = None,
    progress: Callable[[Progress], None] | None = None,
    attrs: Mapping[str, str] | None = None,
) -> Posterior:
    """Sample the posterior with independent ensembles until the gate is met or the budget is spent.

    Each ensemble has its own start and its own stream of random numbers, so that the draws depend on the seed alone: not on the
    number of processes, on interruptions, or on time, unless `max_seconds` ends the run. The first half of a run is discarded
    as burn-in; as the gate asks for 10 autocorrelation times, that is at least 5 of them. Of the second half every n-th step
    is kept, so that an ensemble has at most `assess.MAX_DRAWS` draws; the diagnostics are those of these draws.

    Parameters
    ----------
    problem : what is to be calibrated.
    seed : of all random numbers, not negative.
    checkpoint : folder of checkpoints; without `resume` it is emptied of earlier ones. None keeps none: such a run cannot be
        resumed.
    resume : whether to go on with the run in the folder.
    n_ensembles : at least four, to judge convergence.
    n_walkers : of each ensemble, default `usual_walkers`: four for each unknown, and at least 96.
    gate : what the run has to reach; default `Gate()`.
    max_steps, max_seconds : budget, of each walker over the whole run and of this call; steps that are not done in time are
        dropped, and made again when the run is resumed.
    processes : worker processes (one BLAS thread each); default the number of CPUs up to 4. 0 samples in this process. A
        script whose own forward model they are to use needs its `if __name__ == "__main__":`, any other does not.
    crew : workers that are there already, instead of those.
    progress : called after every block.
    attrs : texts to keep with the posterior, such as the command.

    Returns
    -------
    The posterior; its diagnostics say whether it has converged.

    Raises
    ------
    InputError
        If a run with other inputs is to be resumed.
    NothingSampled
        If there is no draw when the budget ends.
    ValueError
        If there are fewer than four ensembles, nothing to sample, or nothing to resume.
    """
    if n_ensembles < 4:
        raise ValueError(f"at least four independent ensembles are needed to judge convergence, got {n_ensembles}")
    if not problem.parameters:
        raise ValueError("every parameter is fixed: there is nothing to sample")
    if checkpoint is None and resume:
        raise ValueError("there is nothing to resume without a folder of checkpoints")
    gate = gate or Gate()
    n_walker = n_walkers or usual_walkers(problem)
    begin = datetime.now(UTC)
    clock = time.monotonic()
    with TemporaryDirectory(prefix="calib-") if checkpoint is None else nullcontext(str(checkpoint)) as path:
        folder = open_checkpoint(Path(path), identity_of(problem, seed, n_ensembles, n_walker), resume=resume)
        chains = sample_target(
            target_of(problem),
            folder,
            seed=seed,
            n_ensembles=n_ensembles,
            n_walker=n_walker,
            gate=gate,
            max_steps=max_steps,
            deadline=clock + max_seconds,
            processes=processes,
            crew=crew,
            progress=progress,
        )
        if progress is not None:
            elapsed, n = time.monotonic() - clock, n_ensembles * n_walker
            last = _progress(problem.names, chains.state, chains.n_block, n, elapsed, gate, max_steps)
            progress(replace(last, stage="block likelihoods"))
        times = {"started": begin.isoformat(timespec="seconds"), "ended": datetime.now(UTC).isoformat(timespec="seconds")}
        kept = {FINGERPRINT: folder.fingerprint, **times}
        with one_thread():
            return finish(problem, chains.run, chains.n_block, chains.state, gate, seed, {**kept, **(attrs or {})}, crew)


@dataclass(frozen=True, eq=False)
class Chains:
    """What sampling a target gives: its checkpoints, how many blocks of each ensemble there are, and what was found of them."""

    run: SamplingRun
    n_block: int
    state: Convergence


def sample_target(
    target: Target,
    folder: CheckpointFolder,
    *,
    seed: int,
    n_ensembles: int,
    n_walker: int,
    gate: Gate,
    max_steps: int,
    deadline: float = math.inf,
    processes: int | None = None,
    crew: Crew | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Chains:
    """Sample any target with independent ensembles until the gate is met or the budget is spent; see `sample`.

    Parameters
    ----------
    target : what is sampled.
    folder : of its checkpoints, opened.
    seed, n_ensembles, gate, max_steps, processes, crew, progress : as in `sample`.
    n_walker : of each ensemble.
    deadline : moment of `time.monotonic` at which the budget ends.

    Raises
    ------
    NothingSampled
        If there is no draw when the budget ends.
    """
    clock = time.monotonic()
    run = SamplingRun(target, folder, np.random.SeedSequence(seed).spawn(n_ensembles), n_walker)
    state: Convergence | None = None

    begun = 0  # modes of ensembles that are known, and ensembles that have their walkers
    since: tuple[int, float] | None = None  # steps, and the time, when this call began to sample

    def report(n_block: int, more_begun: int = 0) -> None:
        nonlocal begun, since
        begun += more_begun
        if progress is None:
            return
        elapsed = time.monotonic() - clock
        told = _progress(target.names, state, n_block, n_ensembles * n_walker, elapsed, gate, max_steps)
        if n_block == 0 and begun < 2 * n_ensembles:
            progress(replace(told, stage="start", done=begun, wanted=2 * n_ensembles))
            return
        since = since or (told.steps, elapsed)
        made = told.steps - since[0]
        pace = (elapsed - since[1]) / made if made else math.nan
        progress(replace(told, seconds_left=pace * (told.wanted - told.steps)))

    last = max(1, max_steps // BLOCK_STEPS)
    next_look = min(last, FIRST_CHECK // BLOCK_STEPS)
    n_process = 0 if processes == 0 else min(4, n_ensembles, processes or os.cpu_count() or 1)  # more would idle
    modes: tuple[Mode, ...] = ()
    try:
        with one_thread(), nullcontext(crew) if crew is not None else workers(n_process) as executor:
            modes = _modes(run, executor, deadline, report)
            while True:
                n_block = _advance_to(run, modes, executor, next_look, deadline, report)
                state = look(run, modes, n_block, gate, on_the_way=next_look < last)
                report(n_block)
                if next_look == last or not shortcomings(state, target.names, gate):
                    break
                next_look = min(last, _next_look(state, gate))
    except _OutOfTime:
        if crew is not None:
            crew.drop()
        n_block = _blocks_of_all(run)
        with one_thread():
            state = look(run, modes, n_block, gate)
        report(n_block)
    return Chains(run, n_block, state)


# --- advancing ----------------------------------------------------------------------------------------------------------

_R = TypeVar("_R")


def _modes(run: SamplingRun, executor: Executor, deadline: float, report: Callable[[int, int], None]) -> tuple[Mode, ...]:
    """The modes that all ensembles together have found, or find now."""
    found = {k: modes for k in range(len(run.seeds)) if (modes := load_modes(run.folder, k)) is not None}
    missing = [k for k in range(len(run.seeds)) if k not in found]
    report(0, len(found))
    if missing:
        _require_time(deadline)
    pending = {executor.submit(find_modes, run.target, _seed_of(run, k, 0)): k for k in missing}
    for ensemble, modes in _as_done(pending, deadline):
        save_modes(run.folder, ensemble, modes)
        found[ensemble] = modes
        report(0, 1)
    return join_modes(run.target, [mode for _, modes in sorted(found.items()) for mode in modes])


def _require_time(deadline: float) -> None:
    """Begin nothing after the deadline: to start workers, only to drop their work, takes seconds where others compute, too."""
    if time.monotonic() >= deadline:
        raise _OutOfTime


def _seed_of(run: SamplingRun, ensemble: int, stage: int) -> np.random.SeedSequence:
    """Seed of a stage of an ensemble: 0 for its modes, 1 for its start and all that follows."""
    own = run.seeds[ensemble]
    return np.random.SeedSequence(own.entropy, spawn_key=(*own.spawn_key, stage))


def _as_done(pending: dict[Future[_R], int], deadline: float) -> Iterator[tuple[int, _R]]:
    """Ensembles and their results as they come, until nothing is pending (more may be put in); raises at the deadline."""
    while pending:
        left = deadline - time.monotonic()
        done, _ = wait(pending, None if math.isinf(left) else max(left, 0.0), FIRST_COMPLETED)
        if not done:
            raise _OutOfTime
        for future in sorted(done, key=lambda f: pending[f]):
            yield pending.pop(future), future.result()


def _advance_to(
    run: SamplingRun,
    modes: tuple[Mode, ...],
    executor: Executor,
    n_block: int,
    deadline: float,
    report: Callable[[int, int], None],
) -> int:
    """Advance all ensembles to `n_block` blocks; gives the number of blocks that all of them have. Raises at the deadline."""
    count: dict[int, int] = {}
    pending: dict[Future[Start | Block], int] = {}

    def submit(ensemble: int) -> None:
        state, count[ensemble] = load_state(run.folder, ensemble, count.get(ensemble, 0))
        work: Callable[[], Start | Block]
        if state is None:
            work = partial(start, run.target, modes, _seed_of(run, ensemble, 1), run.n_walker)
        elif count[ensemble] >= n_block:
            return
        else:
            work = partial(advance, run.target, state, load_proposal(run.folder, ensemble), BLOCK_STEPS)
        if not pending:
            _require_time(deadline)
        pending[executor.submit(work)] = ensemble

    for ensemble in range(len(run.seeds)):
        submit(ensemble)
    for ensemble, result in _as_done(pending, deadline):
        if isinstance(result, Block):
            save_block(run.folder, ensemble, count[ensemble], result)
            count[ensemble] += 1
        else:
            save_start(run.folder, ensemble, result)
        submit(ensemble)
        report(min(n_block, *count.values()), int(isinstance(result, Start)))
    return min(n_block, *count.values())


def _blocks_of_all(run: SamplingRun) -> int:
    """How many blocks all ensembles have; it is refused that there is none."""
    states = [load_state(run.folder, ensemble) for ensemble in range(len(run.seeds))]
    n_block = min(count for _, count in states)
    if n_block == 0:
        begun = sum(state is not None for state, _ in states)
        raise NothingSampled(
            f"The budget ended before there was a draw: {begun} of {len(states)} ensembles have found where to start."
        )
    return n_block


def _progress(
    names: Sequence[str], state: Convergence | None, n_block: int, n_walker: int, elapsed: float, gate: Gate, max_steps: int
) -> Progress:
    steps = n_block * BLOCK_STEPS
    drawn, needed = steps * n_walker, min(max_steps, FIRST_CHECK if state is None else max(steps, steps_needed(state, gate)))
    if state is None:
        return Progress("sampling", steps, needed, math.nan, steps, elapsed, drawn, math.nan, "", 0.0, "", gate.ess, max_steps)
    worst, least = state.worst_r_hat, state.least_ess
    r_hat, ess = float(state.r_hat[worst]), float(state.ess[least])
    found = (r_hat, names[worst], ess, names[least])
    return Progress("sampling", steps, needed, math.nan, steps, elapsed, drawn, *found, gate.ess, max_steps)


def steps_needed(state: Convergence, gate: Gate) -> int:
    """Estimate after how many steps of each walker a run will meet its gate, from what was found at its last look.

    Effective draws grow as the steps do, and R-hat comes near 1 as one over them. A run that meets the gate and is doubted all
    the same is looked at again next time. Rounded up to whole blocks.

    Parameters
    ----------
    state : at the last look.
    gate : what is to be reached.
    """
    lacking = max(
        gate.ess / max(float(np.min(np.nan_to_num(state.ess))), 1.0),
        float(np.max(np.nan_to_num(state.r_hat, nan=2.0)) - 1) / (gate.r_hat - 1),
        gate.length * float(np.max(np.nan_to_num(state.tau))) / state.steps,
    )
    needed = state.steps * min(lacking if lacking > 1 or not state.doubts else CHECK_FACTOR, _MOST_LACKING)
    return math.ceil(needed / BLOCK_STEPS) * BLOCK_STEPS


def _next_look(state: Convergence, gate: Gate) -> int:
    """After how many blocks to look again: when as many are there as seem to be needed, but not much later than last time."""
    n_block = state.steps // BLOCK_STEPS
    wanted = max(steps_needed(state, gate) // BLOCK_STEPS, math.ceil(_LEAST_FACTOR * n_block))
    return min(wanted, math.ceil(CHECK_FACTOR * n_block))
