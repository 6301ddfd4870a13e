"""Hold tables of a gripper against sweeps that they have not seen: `python benchmarks/gripper.py --labs 60 -o gripper.jsonl`.

A lab has two specimens as the shipped experiment has them: all that is unknown is drawn from its prior, curves are those of
the finite elements. In the kind `as believed` they are off by a discrepancy, as the likelihood takes for granted, in `exact`
they are not. Posteriors are the weighted draws of a first answer where these can be trusted (k-hat below 0.7, 200 effective
draws); the other labs are left out and counted. Then the same specimen, one more of the lot, and that on 5.5 mm of padding are
pressed to 25 forces up to the largest that was measured, by the finite elements, each with a discrepancy, a tare and noise of
its own; those of the one more of the lot are read once more by the table for its padding as a caliper measures it. Printed for
each: how often bounds of 90 % hold the force, how far the force is off in shares of the full scale, and how many readings are
said to be valid.

From the largest force the load is let go again. The finite elements are elastic, so a hysteresis of force and capacitance is
planted, of a size drawn for the lab and a tenth more or less for each press, of the lab and on the gripper. Rows of `unloading`
are readings of the way back with the table as it is, `with the band` with what `calib export` states of unloading added to the
bounds, from presses of the lab.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from simulated.answered import trusted_look
from simulated.discrepant import curve_off, drawn_widths
from simulated.faulty import ACCURACY, DEPTH, EXPERIMENT, POINTS, SPEED, Curve, curve_of
from simulated.labs import print_labs

from calib.decision import ForceReading, Gripper, Status
from calib.decision.inverse import table_of
from calib.decision.readable import measured_sensor, next_sensor
from calib.decision.retreat import band_of
from calib.experiment import Experiment, forward_of_experiment, read_experiment
from calib.lab import Unloading
from calib.lab.unloading import compare_branches
from calib.priors import Prior, default_prior
from calib.problem import build_problem, values_at
from calib.problem.synthetic import Rig, synthetic_sweep
from models.fem import FiniteElements
from models.response import ConvergenceError, OutOfRangeError
from models.sensor import Design, FloatArray, design_from
from models.threads import one_thread

#: What is planted.
KINDS = ("as believed", "exact")
#: Forces of a held-out press, padding of a design [m].
N_FORCE, PADDING = 25, 5.5e-3
_SENSORS = ("specimen", "next", "design")
# The next one with its padding measured, and the standard deviation of that [m]: a caliper's.
_MEASURED, _CALIPER = "next, padding measured", 2e-5
_BACK, _BANDED = "unloading", "unloading, with the band"
# Most that force lacks halfway back, and that capacitance keeps too much, as shares; how far presses of one lab differ in it;
# readings of a branch of the lab.
_MOST_HYSTERESIS, _MOST_LAG, _DIFFERENT, _READINGS = 0.15, 0.03, 0.1, 400
_OF_SPECIMEN = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
_FORCE_NOISE, _CAPACITANCE_NOISE = 5e-3, 1e-14
_FARTHEST = 2.5


def answer(kind: str, seed: int, n_draw: int) -> dict[str, Any]:
    """Simulate and calibrate one lab, and read its sensors on a gripper."""
    with one_thread():
        return _answer(kind, seed, n_draw)


def _answer(kind: str, seed: int, n_draw: int) -> dict[str, Any]:
    began = time.process_time()
    row: dict[str, Any] = {"kind": kind, "seed": seed, "by": "none"}
    experiment = read_experiment(EXPERIMENT)
    forward = forward_of_experiment(experiment)
    rng = np.random.default_rng([seed, 20190306])
    shared = {name: _of(prior, rng) for name, prior in experiment.priors.items()}
    width = drawn_widths(rng, kind != "exact")
    designs = [_design(experiment, shared, k, rng) for k in (0, 1, 0)]
    designs.append(replace(designs[2], padding=replace(designs[2].padding, thickness=PADDING)))
    try:
        curves = [curve_of(design, 1.01 * DEPTH) for design in designs[:2]]
        rated = float(curves[0].force(np.sqrt(DEPTH)))
        pressed = [_pressed(design, rated) for design in (designs[0], *designs[2:])]
    except (OutOfRangeError, ConvergenceError) as error:
        return {**row, "why": str(error)}
    lost = np.random.default_rng([seed, 20190310])
    hysteresis = np.array([_MOST_HYSTERESIS, _MOST_LAG]) * lost.uniform(0.0, 1.0, 2)
    sweeps, retreats = [], {}
    for specimen, design, curve in zip(experiment.specimens, designs[:2], curves, strict=True):
        rig = Rig(
            0.2 * _of(default_prior("contact_offset"), rng),
            shared["machine_compliance"],
            0.3 * rng.standard_normal(),
            shared["parasitic_capacitance"],
            rng.standard_normal(),
            force_noise=_FORCE_NOISE,
            capacitance_noise=_CAPACITANCE_NOISE,
            speed=SPEED,
        )
        off = curve_off(curve, width, rng)
        sweep = synthetic_sweep(off, design, DEPTH, rig, rng, specimen=specimen.name, n_points=POINTS)
        retreats[specimen.name] = [_both_ways(off, design, hysteresis, lost)]
        estimated = sweep.clock_offset + sweep.clock_offset_sd * rng.standard_normal()
        sweeps.append(replace(sweep, clock_offset=estimated))
    problem = build_problem(experiment, sweeps, forward)
    try:
        worth, look = trusted_look(problem)
    except ValueError as error:
        return {**row, "why": str(error)}
    row |= worth
    if look is None:
        return {**row, "why": "its weighted draws cannot be trusted"}
    chosen = rng.choice(len(look.weight), n_draw, p=look.weight)
    values = values_at(problem, look.theta[chosen])
    gripper = Gripper(padding=PADDING)
    following = next_sensor(problem, forward, values, problem.parameters, problem.table.lots, gripper, rng)
    draws = [
        measured_sensor(problem, forward, values, experiment.specimens[0].name, gripper, rng),
        following,
        following.on(PADDING),
    ]
    band = band_of(retreats, list(retreats))
    for sensor, one, curve, design in zip(_SENSORS, draws, pressed, (designs[0], *designs[2:]), strict=True):
        table = table_of(sensor, "next", [one], gripper, rated)
        off = curve_off(curve, width, rng)
        force = rated * (np.arange(N_FORCE) + 0.5) / N_FORCE
        depth = np.linspace(0.0, float(curve.force.x[-1]) ** 2, 4001)
        there = off.respond(design, depth)
        capacitance = np.interp(force, there.force, there.capacitance) + shared["parasitic_capacitance"]
        at_rest = float(there.rest_capacitance) + shared["parasitic_capacitance"]
        tare = at_rest + _CAPACITANCE_NOISE * rng.standard_normal() / np.sqrt(gripper.n_tare)
        reading = capacitance + _CAPACITANCE_NOISE * rng.standard_normal(N_FORCE)
        row[sensor] = _held(table.force_at(reading, tare), force, rated)
        depth = np.linspace(0.0, float(np.interp(rated, there.force, depth)), 4001)
        force_back, there_back = _let_go(off, design, depth, hysteresis * (1 + _DIFFERENT * lost.standard_normal(2)))
        capacitance = np.interp(force, force_back, there_back) + shared["parasitic_capacitance"]
        found = table.force_at(capacitance + _CAPACITANCE_NOISE * lost.standard_normal(N_FORCE), tare)
        row[f"{sensor}, {_BACK}"] = _held(found, force, rated)
        if band is not None:
            low, high = band.around(found.force, rated)
            wider = replace(found, lower=np.maximum(found.lower + low, 0.0), upper=found.upper + high)
            row[f"{sensor}, {_BANDED}"] = _held(wider, force, rated)
        if sensor == "next":
            own = np.random.default_rng([seed, 20190311])
            read = float(design.padding.thickness) + _CALIPER * own.standard_normal()
            measured = table_of(_MEASURED, "design", [one.on(read)], gripper, rated)
            row[_MEASURED] = _held(measured.force_at(reading, tare), force, rated)
    row["hysteresis"] = [round(float(x), 4) for x in hysteresis]
    return {**row, "by": "first answer", "rated": rated, "processor": round(time.process_time() - began, 1)}


def _held(found: ForceReading, force: FloatArray, rated: float) -> dict[str, Any]:
    """How readings of known forces came out."""
    inside = (found.lower <= force) & (force <= found.upper)
    return {
        "inside": round(float(np.mean(inside[found.status < Status.BEYOND_RANGE])), 4),
        "valid": round(float(np.mean(found.status == Status.VALID)), 4),
        "off": [round(float(x), 5) for x in (found.force - force) / rated],
        "width": round(float(np.mean(found.upper - found.lower)) / rated, 5),
    }


def _let_go(curve: Curve, design: Design, depth: FloatArray, hysteresis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force [N] and capacitance [F] at depths on the way back from the last of them."""
    there, back = curve.respond(design, depth), 1 - depth / depth[-1]
    missing, kept = hysteresis
    rise = there.capacitance - float(there.rest_capacitance)
    force = there.force * (1 - missing * 4 * back * (1 - back))
    return np.asarray(np.maximum.accumulate(force)), np.asarray(there.capacitance + kept * rise * 4 * back * (1 - back))


def _both_ways(curve: Curve, design: Design, hysteresis: FloatArray, rng: np.random.Generator) -> Unloading | str:
    """What a lab finds that compares both branches of a press of its own."""
    depth = np.linspace(0.0, DEPTH, _READINGS)
    there = curve.respond(design, depth)
    own = hysteresis * (1 + _DIFFERENT * rng.standard_normal(2))

    def noisy(force: FloatArray, capacitance: FloatArray) -> tuple[FloatArray, FloatArray]:
        noise = rng.standard_normal((2, depth.size))
        return force + _FORCE_NOISE * noise[0], capacitance + _CAPACITANCE_NOISE * noise[1]

    back = tuple(column[::-1] for column in _let_go(curve, design, depth, own))
    return compare_branches([(noisy(there.force, there.capacitance), noisy(back[0], back[1]))], 0.0, 0.0)


def _of(prior: Prior, rng: np.random.Generator) -> float:
    return float(prior.ppf_normal(np.clip(rng.standard_normal(), -_FARTHEST, _FARTHEST)))


def _design(experiment: Experiment, shared: Mapping[str, float], k: int, rng: np.random.Generator) -> Design:
    own = {name: _of(experiment.specimens[k].priors[name], rng) for name in _OF_SPECIMEN}
    whole = {**shared, **own, "indenter_radius": experiment.indenter_radius, "sensor_radius": experiment.sensor_radius}
    return design_from(whole)


def _pressed(design: Design, force: float) -> Curve:
    """The loading curve by finite elements, a little beyond a force."""
    end = FiniteElements(ACCURACY).respond_to_force(design, np.array([1.1 * force])).depth[0]
    return curve_of(design, float(end))


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind and sensor."""
    heads = ("labs", "left out", "in 90 % bounds", "their width", "off, rms", "off, 95 %", "within 1.7 %", "valid")
    yield f"| planted | sensor | {' | '.join(heads)} |"
    yield "|---" * (len(heads) + 2) + "|"
    for kind in dict.fromkeys(row["kind"] for row in rows):
        every = [row for row in rows if row["kind"] == kind]
        own = [row for row in every if row["by"] != "none"]
        ways = [f"{sensor}{way}" for sensor in _SENSORS for way in ("", f", {_BACK}", f", {_BANDED}")]
        for sensor in (*ways, _MEASURED):
            found = [row[sensor] for row in own if sensor in row]
            if not found:
                continue
            off = np.abs(np.concatenate([f["off"] for f in found]))
            inside = np.array([f["inside"] for f in found])
            error = np.std(inside) / np.sqrt(len(found))
            squares = np.array([np.mean(np.square(f["off"])) for f in found])
            rms = np.sqrt(np.mean(squares))
            numbers = [
                f"{np.mean(inside):.1%} ± {error:.1%}",
                f"{np.mean([f['width'] for f in found]):.1%}",
                f"{rms:.2%} ± {np.std(squares) / np.sqrt(len(found)) / (2 * rms):.2%}",
                f"{np.quantile(off, 0.95):.2%}",
                f"{np.mean(off <= 0.017):.1%}",
                f"{np.mean([f['valid'] for f in found]):.0%}",
            ]
            yield f"| {kind} | {sensor} | {len(found)} | {len(every) - len(found)} | {' | '.join(numbers)} |"


def main(words: Sequence[str] | None = None) -> None:
    """Answer the labs that are asked for and print the table of all."""
    print_labs(words, __doc__, KINDS, answer, table, labs=60, limit=("--draws", 1000, "of each posterior"))


if __name__ == "__main__":
    main()
