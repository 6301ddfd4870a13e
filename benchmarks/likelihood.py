"""Time the likelihood on the shipped experiment on one core: `python benchmarks/likelihood.py [--draws 640] [--sweeps 1000]`.

Prints processor time (median of repeats): a draw of the log posterior by the size of its batch, an evaluation by the number of
specimens and of sweeps, and the blocks that models are compared by. Set OMP_NUM_THREADS=1 for one core. Measured on one core of
an AMD EPYC (Zen 4) that other work shared, before and after designs, networks and priors were worked out once for all sweeps:

    draws in a batch                 1     40    160    320    640
    before [us a draw]            2307    130     96     85     82
    after                         1553     82     58     54     49

Presses of one specimen with one ball share what the model leaves out, at depths that differ from draw to draw. The last table
says what that costs, beside as many presses that are taken one by one.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from calib.experiment import Experiment, forward_of_experiment, read_experiment, read_sweeps
from calib.lab import Sweep
from calib.problem import (
    Problem,
    SweepPlan,
    build_problem,
    log_likelihood_at,
    log_likelihood_blocks,
    log_posterior,
    plan_sweep,
    range_use,
    values_at,
)
from models.sensor import FloatArray

EXPERIMENT = Path(__file__).parents[1] / "datasets" / "padded_sensor" / "experiment.toml"
#: Draws lie within so many prior sds of the medians, where most are covered.
WIDTH = 0.3


def milliseconds(job: Callable[[], object], repeats: int) -> float:
    """Median processor time of `job` in milliseconds after one warm-up."""
    job()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        job()
        times.append(time.process_time() - start)
    return 1e3 * float(np.median(times))


def draws(problem: Problem, n: int) -> FloatArray:
    """Coordinates of n draws."""
    return WIDTH * np.random.default_rng(0).standard_normal((n, len(problem.parameters)))


def with_specimens(experiment: Experiment, sweep: Sweep, n: int) -> tuple[Experiment, list[Sweep]]:
    """An experiment of n specimens that were read alike."""
    specimens = tuple(replace(experiment.specimens[0], name=f"sensor {k}") for k in range(n))
    return replace(experiment, specimens=specimens), [replace(sweep, specimen=s.name) for s in specimens]


def with_sweeps(experiment: Experiment, sweep: Sweep, n: int) -> tuple[Experiment, list[Sweep]]:
    """An experiment of one specimen that was pressed n times."""
    first = experiment.specimens[0]
    files = tuple(replace(first.sweeps[0], name=f"press {k}") for k in range(n))
    whole = replace(experiment, specimens=(replace(first, sweeps=files),))
    return whole, [replace(sweep, name=f.name) for f in files]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=640, help="most draws of a batch")
    parser.add_argument("--specimens", type=int, default=50, help="most specimens")
    parser.add_argument("--sweeps", type=int, default=1000, help="most sweeps of a specimen")
    parser.add_argument("--repeats", type=int, default=15)
    given = parser.parse_args()
    experiment = read_experiment(EXPERIMENT)
    sweeps, forward = read_sweeps(experiment), forward_of_experiment(experiment)
    problem = build_problem(experiment, sweeps, forward)
    print("draws in a batch     log posterior [us a draw]")
    for n in [n for n in (1, 40, 160, 320, 640) if n <= given.draws]:
        theta = draws(problem, n)
        print(f"{n:16d}     {1e3 / n * milliseconds(partial(log_posterior, problem, theta), given.repeats):10.1f}")
    theta = draws(problem, min(320, given.draws))
    for name, job in (("blocks for comparing models", log_likelihood_blocks), ("use of the range", range_use)):
        print(f"{name:30s} {1e3 / len(theta) * milliseconds(partial(job, problem, theta), given.repeats):8.1f} us a draw")
    for what, made, sizes in (
        ("specimens", with_specimens, (1, 5, 20, given.specimens)),
        ("sweeps of one specimen", with_sweeps, (1, 5, 10, 100, given.sweeps)),
    ):
        n = min(40, given.draws)
        print(f"\n{what:24s} unknowns   build [s]   log posterior of {n} draws [ms]")
        for size in sorted({s for s in sizes if s <= sizes[-1]}):
            start = time.process_time()
            many = build_problem(*made(experiment, sweeps[0], size), forward)
            built = time.process_time() - start
            theta = draws(many, n)
            spent = milliseconds(partial(log_posterior, many, theta), max(1, given.repeats // size))
            print(f"{size:24d} {len(many.parameters):8d} {built:11.2f} {spent:12.1f}")
    many = build_problem(*with_sweeps(experiment, sweeps[0], 5), forward)
    values = values_at(many, draws(many, min(320, given.draws)))
    alone = [[plan_sweep(sweep)] for sweep in many.sweeps]
    print("\nfive presses, a draw of the likelihood [us]")
    for what, parts in (("one by one", alone), ("together", [many.plans])):
        spent = milliseconds(partial(_likelihoods, many, parts, values), given.repeats)
        print(f"{what:24s} {1e3 / values['young_modulus'].size * spent:8.1f}")


def _likelihoods(problem: Problem, parts: Sequence[Sequence[SweepPlan]], values: Mapping[str, FloatArray]) -> list[FloatArray]:
    return [log_likelihood_at(problem, problem.forward, plans, values) for plans in parts]


if __name__ == "__main__":
    main()
