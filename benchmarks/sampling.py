"""What the sampler costs and whether it can be believed: `python benchmarks/sampling.py targets`, `sticky`, `shipped`, `port`.

- `targets`: on densities whose moments are known, does a run that says it has converged have them right, and does one on a
  density that can be sampled converge? A mean off by more than 0.2 standard deviations, a standard deviation off by more than
  15 %, or a mode of more than 2 % that is missing is wrong. Unknowns with a kurtosis above 5 are compared by normal scores.
- `sticky`: where the tails of a target are heavier than the proposals', is the effective sample size that is claimed true?
  Means of normal scores of many runs scatter by one over its root.
- `shipped`: processor seconds of a whole process, imports included, to worst effective sample sizes of 400 and 4,000 on
  `datasets/padded_sensor`: as a calibration samples, as one did before it knew shapes, and with peers. Each runs in a process
  of its own, on one core; peers that are not installed (`pip install ".[benchmark]"`) are skipped. Ratios are what to look at.
- `port`: whether the posterior that NumPyro samples, written for JAX, is that of this program.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys

import numpy as np
from samplers.gallery import gallery, student_each
from samplers.known import truth_of
from samplers.shipped import CONTENDERS, Budget, costs, is_installed, on_one_core, port_errors
from samplers.traps import traps
from samplers.trial import Trial, try_target

from calib.sampling.diagnostics import Gate


def main() -> None:
    """Run the part that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="part", required=True)
    known = parts.add_parser("targets")
    known.add_argument("names", nargs="*", help="those whose names hold one of these words [all]")
    known.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    known.add_argument("--steps", type=int, default=5000, help="most steps of each walker [5000]")
    sticky = parts.add_parser("sticky")
    sticky.add_argument("--runs", type=int, default=30, help="independent runs of each target [30]")
    sticky.add_argument("--freedom", type=float, nargs="+", default=[2.2, 3.0, 5.0], help="degrees of freedom [2.2 3 5]")
    shipped = parts.add_parser("shipped")
    shipped.add_argument("--contenders", nargs="+", choices=CONTENDERS, default=list(CONTENDERS))
    shipped.add_argument("--sizes", type=float, nargs="+", default=[400.0, 4000.0], help="effective sizes [400 4000]")
    shipped.add_argument("--seed", type=int, default=1)
    shipped.add_argument("--steps", type=int, default=20_000, help="most steps of each walker [20000]")
    shipped.add_argument("--seconds", type=float, default=600.0, help="most processor seconds of each contender [600]")
    shipped.add_argument("--alone", action="store_true", help="one contender, in this process")
    port = parts.add_parser("port")
    port.add_argument("--draws", type=int, default=200, help="of each kind [200]")
    port.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.part == "targets":
        print_targets(options.names, options.seeds, options.steps)
    elif options.part == "sticky":
        print_sticky(options.freedom, options.runs)
    elif options.part == "port":
        near, prior = port_errors(options.draws, options.seed)
        print(f"log posterior at {options.draws} draws round the mode: off by {near:.1e}; of the prior: by {prior:.1e} of it")
    elif options.alone:
        on_one_core()
        for cost in costs(options.contenders[0], options.sizes, options.seed, Budget(options.steps, options.seconds)):
            print(f"| {options.contenders[0]} | {cost} |", flush=True)
    else:
        print_shipped(options.contenders, options.sizes, options.seed, Budget(options.steps, options.seconds))


def print_targets(words: list[str], seeds: list[int], max_steps: int) -> None:
    """A row for each target: how its runs ended, what they cost, and how far the worst of them is off."""
    chosen = [t for name, t in (gallery() | traps()).items() if not words or any(word in name for word in words)]
    print("| target | unknowns | converged | steps | evaluations | s | worst mean [sd] | worst sd | weights | wrong |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    wrong = refused = runs = 0
    for target in chosen:
        truth = truth_of(target)
        trials = [try_target(target, truth, seed, max_steps) for seed in seeds]
        print(f"| {target.name} | {target.n} | {_row(trials)} |", flush=True)
        wrong += sum(t.falsely_green for t in trials)
        refused += sum(bool(t.reasons) for t in trials) if target.good else 0
        runs += len(trials) if target.good else 0
    print(f"\n{wrong} converged and wrong; {refused} of {runs} runs on targets that can be sampled refused")


def _row(trials: list[Trial]) -> str:
    done = [t for t in trials if not t.reasons] or trials
    weights = "; ".join(" ".join(f"{w:.3f}" for w in t.weights) for t in done) if done[0].weights.size > 1 else ""
    cells = [
        f"{sum(not t.reasons for t in trials)} of {len(trials)}",
        ", ".join(str(t.steps) for t in trials),
        f"{np.median([t.evaluations for t in trials]):.2g}",
        f"{np.median([t.seconds for t in trials]):.1f}",
        f"{max(t.errors.mean for t in done):.3f}",
        f"{max(t.errors.sd for t in done):.1%}",
        weights,
        str(sum(t.falsely_green for t in trials)),
    ]
    return " | ".join(cells)


def print_sticky(freedoms: list[float], n_run: int) -> None:
    """A row for each target: by how much the effective sample sizes of runs that say they have converged are overstated."""
    print("| degrees of freedom | converged | effective size claimed | true | overstated |")
    print("|---|---|---|---|---|")
    for freedom in freedoms:
        target = student_each("tails", 6, freedom)
        truth = truth_of(target)
        trials = [try_target(target, truth, seed, 3000, Gate()) for seed in range(n_run)]
        done = [t for t in trials if not t.reasons]
        claimed, true = (np.nan, np.nan) if len(done) < 3 else _sizes(done)
        print(f"| {freedom:g} | {len(done)} of {n_run} | {claimed:.0f} | {true:.0f} | {claimed / true:.2f} |", flush=True)


def _sizes(trials: list[Trial]) -> tuple[float, float]:
    """Effective sizes claimed, and true by the scatter of mean scores; of all unknowns, harmonic means."""
    claimed = 1 / np.mean([1 / t.ess for t in trials])
    return float(claimed), float(1 / np.mean([t.score**2 for t in trials]))


def print_shipped(contenders: list[str], sizes: list[float], seed: int, budget: Budget) -> None:
    """A row for each contender and size, as it comes, on one core."""
    print("| contender | effective size wanted | processor seconds | effective size reached |")
    print("|---|---|---|---|", flush=True)
    words = ["--sizes", *map(str, sizes), "--seed", str(seed)]
    words += ["--steps", str(budget.steps), "--seconds", str(budget.seconds), "--alone"]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    for contender in contenders:
        if not is_installed(contender):
            print(f"{contender} is left out: it is not installed", flush=True)
            continue
        command = [sys.executable, __file__, "shipped", "--contenders", contender, *words]
        subprocess.run(command, env=environment, check=True)


if __name__ == "__main__":
    main()
