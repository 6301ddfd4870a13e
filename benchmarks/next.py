"""Measure next what `calib next` says, in simulated labs: `python benchmarks/next.py shipped --labs 30 -o next.jsonl`.

A lab is drawn from what its experiment believes (modulus, thicknesses, rig, contact, noises and discrepancies), measured by the
surrogate with noise and discrepancy, and calibrated by weighted draws of a first answer. What is expected of a measurement of
each kind is then held against what comes of it: it is made in the same lab, with contact, zeros and noise of its own, and all
is calibrated again, by weighted draws, too. Where these cannot be trusted (effective draws below 150) the lab is left out, and
counted. What the model leaves out of a press is a function of depth that every press of the same specimen under the same ball
repeats. Printed for each layout and kind: by how much the sd of the modulus was expected to fall and fell, means over labs; the
ratio of the sd that came to that expected, its mean, its scatter, and in how many labs it is within 20 % of 1; the root mean
square of the error over the sd expected and over that which came. Then how much more an hour for what was ranked first was
expected to bring, and brought, than an hour of pressing once more in the same way. With -o labs are kept, and those that are
there are not repeated.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from simulated.labs import keep_row, kept_rows

from calib.catalogue import UnknownName
from calib.decision.candidate import Candidate
from calib.decision.candidates import candidates_of
from calib.decision.gain import covariance, present_knowledge, with_measurement
from calib.decision.known import Known
from calib.decision.read_by_itself import with_reading
from calib.errors import InputError
from calib.experiment import Bench, forward_of_experiment, read_experiment
from calib.lab import Sweep
from calib.priors import LogNormal
from calib.problem import (
    CORRELATION_LENGTH,
    PredictedReadings,
    Problem,
    build_problem,
    columns_at,
    model_sweeps,
    plan_sweep,
    plan_sweeps,
    prior_values,
    specimen_design,
)
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import Look, look_at
from models.curves import predict_design
from models.response import Forward, OutOfRangeError
from models.sensor import FloatArray, design_from

EXPERIMENT = Path(__file__).parents[1] / "datasets" / "padded_sensor" / "experiment.toml"
#: Layout -> how many of the two specimens of the shipped experiment, and whether there is a meter.
LAYOUTS: Mapping[str, tuple[int, bool]] = {"shipped": (2, True), "one specimen": (1, True), "force alone": (1, False)}
#: How hard the ball is pressed [N], points of each channel, and least worth of weighted draws.
FORCE, POINTS, WORTH = 5.0, 30, 150.0
# Draws of the scales, and of a truth that the model covers, at most.
_DRAWS, _TRUTHS = 64, 300
# Nodes of what the model leaves out, over the depth in correlation lengths.
_NODES = np.linspace(0.0, 12.0, 121)
# What `Rig` takes from the unknowns of a press.
_RIG = (
    *("contact_offset", "load_zero", "clock_offset", "machine_compliance", "parasitic_capacitance"),
    *("force_noise", "capacitance_noise"),
)


def first_problem(layout: str, forward: Forward) -> Problem:
    """A layout with presses in the middle of what is believed, which say which unknowns there are."""
    n, electrical = LAYOUTS[layout]
    experiment = read_experiment(EXPERIMENT)
    # Each reading says how noisy it is; a prior that a lab's own readings centre would be another one in every lab.
    noises = {"force_noise": LogNormal(5e-3, 1.5), "capacitance_noise": LogNormal(1e-14, 1.5)}
    experiment = replace(
        experiment,
        specimens=experiment.specimens[:n],
        priors={**experiment.priors, **(noises if electrical else {"force_noise": noises["force_noise"]})},
    )
    middle = {"young_modulus": 0.7e6, "relative_permittivity": 2.8, "indenter_radius": 5e-3, "sensor_radius": 10e-3}
    middle |= {"sensor_thickness": 0.74e-3, "padding_thickness": 1.1e-3, "dielectric_thickness": 0.16e-3}
    rng = np.random.default_rng(0)
    design = design_from(middle)
    sweeps = [
        synthetic_sweep(
            forward, design, 0.5e-3, Rig(), rng, specimen=s.name, n_points=POINTS, tie="clock" if electrical else "none"
        )
        for s in experiment.specimens
    ]
    return build_problem(experiment, sweeps, forward)


@dataclass(frozen=True, eq=False)
class Left:
    """What the model leaves out of presses, by specimen, ball [m] and channel: always the same function of depth.

    Attributes
    ----------
    seed : of all of it.
    lengths : [m], by specimen and ball, over which it stays alike: by their first press. Of others it is that of the press.
    """

    seed: tuple[int, ...]
    lengths: Mapping[tuple[str, float], float]

    def out_of(self, sweep: Sweep, channel: str, readings: PredictedReadings) -> FloatArray:
        """By how much the readings of a channel are off for it, (n_point,).

        Parameters
        ----------
        sweep : of the press.
        channel : its name.
        readings : what the instrument should read of the true sensor, one draw.
        """
        whose = f"{sweep.specimen} {sweep.indenter_radius:g} {channel}".encode()
        rng = np.random.default_rng([*self.seed, *whose])
        own = readings.error[0] @ rng.standard_normal(readings.error.shape[-1])
        alike = np.exp(-0.5 * (_NODES[:, None] - _NODES) ** 2) + 1e-10 * np.eye(_NODES.size)
        smooth = np.linalg.cholesky(alike) @ rng.standard_normal(_NODES.size)
        sd = 0.0 if readings.discrepancy is None else readings.discrepancy.sd[0]
        of_press = CORRELATION_LENGTH * float(np.max(readings.depth))
        length = self.lengths.get((sweep.specimen, sweep.indenter_radius), of_press)
        return np.asarray(own + sd * np.interp(readings.depth[0] / length, _NODES, smooth), dtype=float)


def measured(
    problem: Problem, truth: Mapping[str, float], like: Sweep, force: float, left: Left, rng: np.random.Generator
) -> tuple[Sweep, ...]:
    """The sweeps of a problem with one of them pressed anew, on the true sensor: with noise, and what the model leaves out.

    Parameters
    ----------
    problem : with the sweep among its own.
    truth : values [SI] of all its unknowns.
    like : the sweep.
    force : [N], how hard.
    left : what the model leaves out.
    rng : of the noise.

    Raises
    ------
    OutOfRangeError
        If the model does not cover it.
    """
    values = {name: np.array([value]) for name, value in truth.items()}
    design = specimen_design(problem, values, like.specimen, like.name).draw(0)
    depth = float(predict_design(problem.forward, design, np.array([force])).depth[0, 0])
    if not np.isfinite(depth):
        raise OutOfRangeError(f"{force:.2g} N are not covered")
    rig = {
        name: next(truth[str(at)] for at in UnknownName(name, like.specimen, like.name).wider if str(at) in truth)
        for name in _RIG
        if any(str(at) in truth for at in UnknownName(name, like.specimen, like.name).wider)
    }
    made = synthetic_sweep(
        problem.forward,
        design,
        depth,
        Rig(**rig, n_effective=float(np.median(next(iter(like.channels.values())).n_effective))),
        rng,
        specimen=like.specimen,
        name=like.name,
        n_points=next(iter(like.channels.values())).value.size,
        tie="clock" if "capacitance" in like.channels else "none",
    )
    made = replace(made, indenter_radius=like.indenter_radius)
    predicted = next(model_sweeps(problem, problem.forward, [plan_sweep(made)], values)).channels
    channels = {
        name: replace(points, value=points.value + left.out_of(made, name, predicted[name]))
        for name, points in made.channels.items()
    }
    place = problem.sweeps.index(like)
    return tuple(replace(made, channels=channels) if k == place else sweep for k, sweep in enumerate(problem.sweeps))


def lab(layout: str, forward: Forward, rng: np.random.Generator) -> tuple[Problem, dict[str, float], Left]:
    """The calibration of a simulated lab that the model covers, the true values [SI] of its unknowns, and what is left out."""
    problem = first_problem(layout, forward)
    seed = tuple(int(number) for number in rng.integers(2**31, size=2))
    for _ in range(_TRUTHS):
        truth = {name: float(value[0]) for name, value in prior_values(problem, rng, 1).items()}
        try:
            values = {name: np.array([value]) for name, value in truth.items()}
            lengths = {}
            for sweep in problem.sweeps:
                first = specimen_design(problem, values, sweep.specimen, "").draw(0)
                depth = float(predict_design(forward, first, np.array([FORCE])).depth[0, 0])
                lengths[sweep.specimen, sweep.indenter_radius] = CORRELATION_LENGTH * depth
            left, made = Left(seed, lengths), problem
            for k in range(len(problem.sweeps)):
                sweeps = measured(made, truth, made.sweeps[k], FORCE, left, rng)
                made = replace(made, sweeps=sweeps, plans=plan_sweeps(sweeps))
            return build_problem(problem.experiment, made.sweeps, forward), truth, left
        except (OutOfRangeError, InputError, ValueError):
            continue
    raise ValueError(f"none of {_TRUTHS} draws of the prior is covered")


def looked(problem: Problem) -> Look | None:
    """Weighted draws of a posterior; None where they cannot be trusted."""
    try:
        look = look_at(problem)
    except ValueError:
        return None
    return look if look.confirmed and look.effective_draws >= WORTH else None


def modulus_of(look: Look) -> tuple[float, float]:
    """Mean and standard deviation of Young's modulus [Pa]."""
    column = columns_at(look.problem, look.theta)[:, look.problem.names.index("young_modulus")]
    mean = float(look.weight @ column)
    return mean, float(np.sqrt(look.weight @ (column - mean) ** 2))


def made(
    candidate: Candidate, problem: Problem, truth: Mapping[str, float], left: Left, rng: np.random.Generator
) -> Problem | None:
    """The calibration with a measurement made in the lab; None where the model does not cover it."""
    if candidate.problem is None:
        return _with_what_is_read(candidate, problem, truth, rng)
    extended = candidate.problem
    own = {name: float(value[0]) for name, value in prior_values(extended, rng, 1).items()}
    like = extended.sweeps[-1]
    force = like.channels["force"].value
    try:
        sweeps = measured(extended, {**own, **truth}, like, float(np.max(force) - np.min(force)), left, rng)
    except OutOfRangeError:
        return None
    return replace(extended, sweeps=sweeps, plans=plan_sweeps(sweeps))


def _with_what_is_read(candidate: Candidate, problem: Problem, truth: Mapping[str, float], rng: np.random.Generator) -> Problem:
    """The calibration with a quantity read by itself, which the prior of it has from then on."""
    assert candidate.reads is not None
    k, sd = candidate.reads
    info = problem.parameters[k]
    prior, _ = with_reading(info.parameter, info.prior, truth[info.name] + sd * rng.standard_normal(), sd)
    infos = tuple(replace(other, prior=prior) if other is info else other for other in problem.parameters)
    return replace(problem, parameters=infos)


def held(layout: str, seed: int, kinds: Sequence[str]) -> dict[str, Any]:
    """One lab: what is expected of a measurement of each of some kinds (none: of all), and what comes of it."""
    began = time.process_time()
    rng = np.random.default_rng([list(LAYOUTS).index(layout), seed])
    problem, truth, left = lab(layout, forward_of_experiment(read_experiment(EXPERIMENT)), rng)
    look = looked(problem)
    row: dict[str, Any] = {"layout": layout, "seed": seed, "kinds": {}}
    if look is None:
        return {**row, "outcome": "not to be trusted"}
    rows = rng.choice(len(look.theta), 4000, p=look.weight)
    known = Known(problem, look.weight @ look.theta, look.theta[rows])
    slope = np.eye(known.middle.size)[problem.names.index("young_modulus")][:, None]
    present = present_knowledge(known, known.draws[:_DRAWS], np.zeros((_DRAWS, 0)))

    def variance(knowledge: Any) -> float:
        return float(np.mean(slope.T @ covariance(knowledge)(slope)))

    true = truth["young_modulus"]
    before, (mean, sd) = variance(present), modulus_of(look)
    row |= {
        "outcome": "done",
        "sd": sd,
        "error": mean - true,
        "linear": float(np.sqrt(before) / np.sqrt(np.var(known.draws @ slope))),
    }
    best: dict[str, tuple[float, float, Candidate]] = {}
    for candidate in candidates_of(known, Bench())[0]:
        if kinds and candidate.kind not in kinds:
            continue
        share = variance(with_measurement(present, candidate)) / before
        rate = (1 - np.sqrt(share)) / candidate.minutes
        if candidate.kind not in best or rate > best[candidate.kind][0]:
            best[candidate.kind] = (float(rate), min(share, 1.0), candidate)
    for kind, (_, share, candidate) in best.items():
        after = made(candidate, problem, truth, left, rng)
        seen = None if after is None else looked(after)
        of = {"minutes": candidate.minutes, "expected": float(np.sqrt(share)) * sd, "came": None, "error": None}
        if seen is not None:
            mean, of["came"] = modulus_of(seen)
            of["error"] = mean - true
        row["kinds"][kind] = of
    return {**row, "seconds": round(time.process_time() - began, 1)}


def tell(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print what was expected and what came, by layout and kind, and what the winner brought."""
    print(
        "| layout | measurement | labs | sd expected to fall by | fell by | sd came / expected | scatter | within 20 % | "
        "error / sd expected | error / sd that came |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for layout in (*LAYOUTS, "all"):
        done = [row for row in rows if layout in (row["layout"], "all") and row["outcome"] == "done"]
        for kind in dict.fromkeys(kind for row in done for kind in row["kinds"]):
            pairs = [(row["sd"], row["kinds"][kind]) for row in done if row["kinds"].get(kind, {}).get("came")]
            if not pairs:
                continue
            expected, came, error = (np.array([of[name] / sd for sd, of in pairs]) for name in ("expected", "came", "error"))
            ratio = came / expected
            falls = f"{100 * (1 - np.mean(expected)):.0f} % | {100 * (1 - np.mean(came)):.0f} %"
            near = f"{100 * np.mean(np.abs(ratio - 1) < 0.2):.0f} %"
            off = " | ".join(f"{np.sqrt(np.mean((error / of) ** 2)):.2f}" for of in (expected, came))
            print(
                f"| {layout} | {kind} | {len(pairs)} | {falls} | {np.mean(ratio):.2f} | {np.std(ratio):.2f} | {near} | {off} |"
            )
        if done:
            now = np.sqrt(np.mean([(row["error"] / row["sd"]) ** 2 for row in done]))
            print(f"| {layout} | nothing | {len(done)} | | | | | | {now:.2f} | {now:.2f} |")
            print_winner(layout, done)
    left_out = sum(row["outcome"] != "done" for row in rows)
    print(f"{len(rows)} labs, {left_out} of them left out")


def print_winner(layout: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Print what an hour of what was ranked first was expected to bring and brought, beside one of pressing again."""
    hours = []
    for row in rows:
        rates = {kind: 60 * (1 - of["expected"] / row["sd"]) / of["minutes"] for kind, of in row["kinds"].items()}
        if "repeat" in rates:
            first = max(rates, key=lambda kind: rates[kind])
            of = row["kinds"][first]
            again = row["kinds"]["repeat"]
            if of["came"] is not None and again["came"] is not None:
                came = [60 * (1 - one["came"] / row["sd"]) / one["minutes"] for one in (of, again)]
                hours.append([rates[first], rates["repeat"], *came])
    if hours:
        winner, repeat, came, again = np.mean(hours, axis=0)
        of_first = f"an hour of the first {100 * winner:.0f} %, came {100 * came:.0f} %"
        print(f"{layout}: {of_first}, of the same {100 * repeat:.0f} %, came {100 * again:.0f} %")


def main(words: Sequence[str] | None = None) -> None:
    """Print a table of what was expected and what came."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("layouts", nargs="*", metavar="LAYOUT", help=f"all, or some of: {'; '.join(LAYOUTS)}")
    parser.add_argument("--labs", type=int, default=30, help="of each layout")
    parser.add_argument("--kinds", nargs="*", default=[], help="of measurements, default all: repeat, ball, ...")
    parser.add_argument("-o", "--output", type=Path, help="file for the labs, a line of JSON each")
    given = parser.parse_args(words)
    layouts = given.layouts or list(LAYOUTS)
    rows = kept_rows(given.output)
    known = {(row["layout"], row["seed"]) for row in rows}
    for seed in range(given.labs):
        for layout in layouts:
            if (layout, seed) not in known:
                rows.append(held(layout, seed, given.kinds))
                keep_row(given.output, rows[-1])
    tell([row for row in rows if row["layout"] in layouts])


if __name__ == "__main__":
    main()
