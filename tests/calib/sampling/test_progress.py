"""How far sampling is: what is told of its stages, and how many steps are still needed."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

from samplers.gallery import gallery

from calib.sampling.checkpoint import CheckpointFolder
from calib.sampling.diagnostics import Convergence, Gate
from calib.sampling.sampler import FIRST_CHECK, Progress, sample_target, steps_needed


def _found(steps: int, r_hat: float, ess: float, tau: float, doubts: tuple[str, ...] = ()) -> Convergence:
    one = np.ones(2)
    return Convergence(r_hat * one, ess * one, 2 * ess * one, tau * one, steps, doubts)


def test_steps_that_are_needed_grow_with_what_lacks() -> None:
    gate = Gate(r_hat=1.01, ess=400.0, length=10.0)
    assert steps_needed(_found(100, 1.001, 500.0, 5.0), gate) == 80
    assert 200 <= steps_needed(_found(100, 1.001, 200.0, 5.0), gate) <= 300
    assert 400 <= steps_needed(_found(100, 1.04, 500.0, 5.0), gate) <= 600
    assert 1000 <= steps_needed(_found(500, 1.0, 500.0, 100.0), gate) <= 1400
    assert steps_needed(_found(100, np.nan, np.nan, np.nan), gate) > 1000
    assert steps_needed(_found(100, 1.001, 500.0, 5.0, ("a doubt",)), gate) == 130


def test_progress_tells_how_much_of_each_stage_is_done_and_how_long_the_rest_may_last(tmp_path: Path) -> None:
    target = gallery()["normal, 20"]
    told: list[Progress] = []
    sample_target(
        target,
        CheckpointFolder(tmp_path, "0" * 64),
        seed=1,
        n_ensembles=4,
        n_walker=80,
        gate=Gate(ess=1e9),
        max_steps=150,
        processes=0,
        progress=told.append,
    )
    start = [p for p in told if p.stage == "start"]
    counts = [p.done for p in start]  # twice the same where an ensemble is a block ahead of another's start
    assert counts == sorted(counts)
    assert set(counts) == set(range(8))
    assert {p.wanted for p in start} == {8}
    sampled = told[len(start) :]
    assert {p.stage for p in sampled} == {"sampling"}
    assert all(p.done == p.steps <= p.wanted <= 150 for p in sampled)
    assert all(np.isfinite(p.seconds_left) == (p.steps > 0) for p in sampled)
    assert {p.wanted for p in sampled if p.ess == 0} == {FIRST_CHECK}
    assert sampled[-1].seconds_left == 0
