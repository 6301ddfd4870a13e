"""A known target and a seed in, what sampling it gave out: whether it says that it converged, its cost, how far it is off."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib.sampling.assess import BLOCK_STEPS
from calib.sampling.checkpoint import CheckpointFolder, load_chain, load_proposal
from calib.sampling.diagnostics import Gate, shortcomings
from calib.sampling.ensemble import STORE_EVERY
from calib.sampling.sampler import sample_target
from models.sensor import FloatArray
from samplers.known import Errors, Known, Truth, shares


@dataclass(frozen=True, eq=False)
class Trial:
    """One run on a known target.

    Attributes
    ----------
    reasons : why it has not converged, none if it says that it has.
    steps, evaluations, seconds : of each walker, of the density, of the processor.
    shapely : ensembles that move by a proposal.
    errors : of its draws.
    weights : share of its draws in each mode.
    score, ess : (n,), mean of the normal scores of its draws, and their least effective sample size.
    """

    reasons: tuple[str, ...]
    steps: int
    evaluations: int
    seconds: float
    shapely: int
    errors: Errors
    weights: FloatArray
    score: FloatArray
    ess: FloatArray

    @property
    def falsely_green(self) -> bool:
        """Whether it says that it has converged, and is wrong."""
        return not self.reasons and self.errors.wrong


def try_target(target: Known, truth: Truth, seed: int, max_steps: int = 5000, gate: Gate | None = None) -> Trial:
    """Sample a known target as a calibration is sampled, in this process.

    Parameters
    ----------
    target : to be sampled.
    truth : of it.
    seed : of the run.
    max_steps : budget.
    gate : what the run has to reach; the usual one if None.
    """
    gate = gate or Gate()
    target.counted[0] = 0
    clock = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        chains = sample_target(
            target,
            CheckpointFolder(Path(folder), "0" * 64),
            seed=seed,
            n_ensembles=4,
            n_walker=max(160, 4 * target.n),
            gate=gate,
            max_steps=max_steps,
            processes=0,
        )
        n_stored = chains.n_block * BLOCK_STEPS // STORE_EVERY
        kept = [load_chain(chains.run.folder, k, chains.n_block, n_stored // 2, 1)[0] for k in range(4)]
        shapely = sum(load_proposal(chains.run.folder, k) is not None for k in range(4))
    seconds = time.process_time() - clock
    x = np.concatenate([chain.reshape(-1, target.n) for chain in kept])
    return Trial(
        shortcomings(chains.state, target.names, gate),
        chains.n_block * BLOCK_STEPS,
        target.counted[0],
        seconds,
        shapely,
        truth.errors(target, x),
        shares(target, x, truth.weights.size),
        np.mean(truth.scores(x), axis=0),
        chains.state.ess,
    )
