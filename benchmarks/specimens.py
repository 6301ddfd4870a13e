"""Calibrate simulated lots of many specimens: `python benchmarks/specimens.py -n 1 5 20 50 --lots 1 -o lots.jsonl`.

A lot is drawn as an experiment like the shipped one would have it: modulus, permittivity, compliance, parasitic capacitance and
the force's discrepancy from their priors, the capacitance's from half its prior's scale, thicknesses of each specimen from the
microscope's, contact, load zero and clock of each sweep; curves by the surrogate, with noise and discrepancy. Printed for each:
processor and wall seconds, memory, steps, and where truth lies in the posterior of what the specimens share. With -o lots are
kept, and those that are there are not repeated.

With --scores nothing is calibrated: the slope of the log likelihood at the truth, of each unknown that is shared, must be zero
in the mean of lots, and its variance the curvature's mean, if the likelihood is that of the lots.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from simulated.labs import keep_row, kept_rows

from calib.experiment import Experiment, forward_of_experiment, read_experiment
from calib.lab import Sweep
from calib.problem import Problem, build_problem, coordinates_of, log_likelihood, model_sweeps
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import Gate, sample
from models.response import Forward
from models.sensor import design_from

EXPERIMENT = Path(__file__).parents[1] / "datasets" / "padded_sensor" / "experiment.toml"
#: How deep the ball is pressed [m], and points of each channel.
DEPTH, POINTS = 0.55e-3, 25
# Steps of slopes at the truth, in units of the priors: of what the data tell less well a larger one; and of all others.
_SCORE_STEPS = {
    **dict.fromkeys(("young_modulus", "relative_permittivity"), 2e-3),
    **dict.fromkeys(("force_noise", "capacitance_noise"), 2e-2),
    **dict.fromkeys(("force_discrepancy", "capacitance_discrepancy"), 5e-2),
}
_SCORE_STEP = 5e-3
# Draws farther out than this many sds are drawn at it: of many specimens some would be invalid designs.
_FARTHEST = 2.5


def lot(experiment: Experiment, forward: Forward, n: int, seed: int) -> tuple[Problem, dict[str, float]]:
    """The calibration of a simulated lot of n specimens, and the true values [SI] of its unknowns."""
    rng = np.random.default_rng([n, seed])

    def z() -> float:
        return float(np.clip(rng.standard_normal(), -_FARTHEST, _FARTHEST))

    truth = {
        "young_modulus": 0.7e6 * 1.6 ** z(),
        "relative_permittivity": 2.8 + 0.15 * z(),
        "machine_compliance": abs(5e-6 * z()),
        "parasitic_capacitance": 1e-12 * z(),
        "force_noise": 5e-3,
        "capacitance_noise": 1e-14,
        "force_discrepancy": abs(0.01 * z()),
        "capacitance_discrepancy": abs(0.01 * z()),
    }
    specimens = tuple(replace(experiment.specimens[0], name=f"sensor {k}") for k in range(n))
    whole = replace(experiment, specimens=specimens)
    sweeps = []
    for specimen in specimens:
        thicknesses = {
            "sensor_thickness": 0.74e-3 + 0.02e-3 * z(),
            "padding_thickness": 1.1e-3 + 0.03e-3 * z(),
            "dielectric_thickness": 0.16e-3 + 0.006e-3 * z(),
        }
        zeros = {"contact_offset": 0.2e-3 + 0.03e-3 * z(), "load_zero": 0.3 * z(), "clock_offset": 2.0 * z()}
        truth |= {f"{name}[{specimen.name}]": value for name, value in (thicknesses | zeros).items()}
        shared = {name: truth[name] for name in ("young_modulus", "relative_permittivity")}
        design = design_from({**shared, **thicknesses, "indenter_radius": 5e-3, "sensor_radius": whole.sensor_radius})
        rig_names = ("machine_compliance", "parasitic_capacitance", "force_noise", "capacitance_noise")
        rig = Rig(**zeros, **{name: truth[name] for name in rig_names})
        sweeps.append(synthetic_sweep(forward, design, DEPTH, rig, rng, specimen=specimen.name, n_points=POINTS))
    return build_problem(whole, with_discrepancy(build_problem(whole, sweeps, forward), truth, rng), forward), truth


def with_discrepancy(problem: Problem, truth: Mapping[str, float], rng: np.random.Generator) -> list[Sweep]:
    """The sweeps of a problem with what the likelihood calls the errors that neighbouring points share.

    Parameters
    ----------
    problem : with sweeps that have noise alone.
    truth : values of all its unknowns, by name, SI.
    rng : of the errors.
    """
    values = {name: np.array([value]) for name, value in truth.items()}
    models = model_sweeps(problem, problem.forward, problem.plans, values)
    found = []
    for sweep, model in zip(problem.sweeps, models, strict=True):
        channels = dict(sweep.channels)
        for name, predicted in model.channels.items():
            shift = predicted.modes[0] @ rng.standard_normal(predicted.modes.shape[-1])
            channels[name] = replace(channels[name], value=channels[name].value + shift)
        found.append(replace(sweep, channels=channels))
    return found


def calibrate(n: int, seed: int, max_steps: int, processes: int, gate: Gate) -> dict[str, Any]:
    """Calibrate one lot; what it took, and where truth lies."""
    experiment = read_experiment(EXPERIMENT)
    problem, truth = lot(experiment, forward_of_experiment(experiment), n, seed)
    wall, processor = time.monotonic(), _processor_seconds()
    posterior = sample(problem, seed=seed, max_steps=max_steps, processes=processes, gate=gate)
    d = posterior.diagnostics
    draws = posterior.draws.reshape(-1, len(problem.names))
    ranks = {name: float(np.mean(draws[:, k] < truth[name])) for k, name in enumerate(problem.names)}
    own = [rank for name, rank in ranks.items() if "[" in name]
    return {
        "specimens": n,
        "seed": seed,
        "unknowns": len(problem.names),
        "converged": d.converged,
        "reasons": d.reasons,
        "steps": d.steps,
        "wall": round(time.monotonic() - wall, 1),
        "processor": round(_processor_seconds() - processor, 1),
        "memory": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2),
        "tau": round(max(d.tau.values()), 1),
        "accepted": {kind: round(share, 3) for kind, share in d.acceptance_by_move.items()},
        "shared": {name: round(rank, 4) for name, rank in ranks.items() if "[" not in name},
        "own within 90 %": round(float(np.mean([0.05 < rank < 0.95 for rank in own])), 3),
    }


def scores(n: int, seed: int) -> dict[str, Any]:
    """Slope and curvature of the log likelihood at the truth of a lot, by unknown that is shared, in units of its prior."""
    experiment = read_experiment(EXPERIMENT)
    problem, truth = lot(experiment, forward_of_experiment(experiment), n, seed)
    at = coordinates_of(problem, np.array([[truth[name] for name in problem.names]]))[0]
    shared = [k for k, name in enumerate(problem.names) if "[" not in name]
    steps = np.array([_SCORE_STEPS.get(problem.names[k], _SCORE_STEP) for k in shared])
    moved = np.zeros((len(shared), at.size))
    moved[range(len(shared)), shared] = steps
    here, up, down = (log_likelihood(problem, np.atleast_2d(theta)) for theta in (at, at + moved, at - moved))
    found = zip((up - down) / (2 * steps), (2 * here - up - down) / steps**2, strict=True)
    return {
        "specimens": n,
        "seed": seed,
        "scores": {problem.names[k]: [float(s), float(h)] for k, (s, h) in zip(shared, found, strict=True)},
    }


def _print_scores(rows: Sequence[Mapping[str, Any]]) -> None:
    print(
        f"{rows[0]['specimens']} specimens, {len(rows)} lots: mean slope in standard errors, variance of slopes over curvature"
    )
    for name in rows[0]["scores"]:
        slope, curvature = np.array([row["scores"][name] for row in rows]).T
        mean = slope.mean() / (slope.std(ddof=1) / np.sqrt(slope.size))
        print(f"{name:26s} {mean:6.2f} {slope.var(ddof=1) / curvature.mean():6.2f}")


def _processor_seconds() -> float:
    """Of this process and its children that have ended."""
    return sum(sum(resource.getrusage(whose)[:2]) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def main(words: Sequence[str] | None = None) -> None:
    """Print a line for each lot, and the coverage of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, nargs="+", default=[1, 5, 20, 50], help="specimens of a lot")
    parser.add_argument("--lots", type=int, default=1, help="of each size")
    parser.add_argument("--first", type=int, default=0, help="seed of the first lot")
    parser.add_argument("--steps", type=int, default=20_000, help="at most")
    parser.add_argument("--ess", type=float, default=Gate().ess, help="effective draws wanted; fewer ask less of the run")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--scores", action="store_true", help="slopes of the likelihood at the truth instead of calibrations")
    parser.add_argument("-o", "--output", type=Path, help="file for the lots, a line of JSON each")
    given = parser.parse_args(words)
    share = given.ess / Gate().ess
    gate = Gate(r_hat=1 + (Gate().r_hat - 1) / share, ess=given.ess, length=Gate().length * share)
    known = {(row["specimens"], row["seed"]): row for row in kept_rows(given.output) if given.scores == ("scores" in row)}

    def lots_of(n: int, make: Callable[[int, int], dict[str, Any]]) -> Iterator[dict[str, Any]]:
        for seed in range(given.first, given.first + given.lots):
            row = known.get((n, seed))
            if row is None:
                row = make(n, seed)
                keep_row(given.output, row)
            yield row

    if given.scores:
        for n in given.n:
            _print_scores([*lots_of(n, scores)])
        return
    print("specimens seed unknowns steps   wall [s]  processor [s]  memory [GB]  converged   truth of what is shared, as ranks")
    inside = []
    for n in given.n:
        for row in lots_of(n, partial(calibrate, max_steps=given.steps, processes=given.processes, gate=gate)):
            ranks = row["shared"]
            inside += [0.05 < rank < 0.95 for rank in ranks.values()]
            numbers = (
                f"{n:9d} {row['seed']:4d} {row['unknowns']:8d} {row['steps']:5d} {row['wall']:10.1f} {row['processor']:14.1f}"
            )
            print(
                f"{numbers} {row['memory']:12.2f} {row['converged']!s:>10}   "
                + " ".join(f"{name} {rank:.3f}" for name, rank in ranks.items()),
                flush=True,
            )
    print(f"truth of {np.mean(inside):.0%} of {len(inside)} shared unknowns within the 90 % interval")


if __name__ == "__main__":
    main()
