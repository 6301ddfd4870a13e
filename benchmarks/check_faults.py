"""How often a check finds what was planted in a lab, and objects to a sound one: `python benchmarks/check_faults.py -o FILE`.

A lab is drawn from the priors of its experiment, discrepancies included, and measured by the surrogate. There are four layouts:
the two specimens of the shipped experiment, two of different kinds, one press with a force alone, one specimen under two balls.
Sound labs are checked as they are; in the others one thing is wrong in the experiment or in its files. Printed for each kind:
how many labs come out green, amber and red, how many are refused before, and in how many the thing itself is named.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from simulated.labs import keep_row, kept_rows

from calib.checks import plausibility, scaled, ways_out
from calib.errors import InputError
from calib.experiment import Experiment, Specimen, SweepFiles, forward_of_experiment, read_experiment
from calib.lab import Points, Sweep
from calib.priors import Prior, default_prior, parse_prior
from calib.problem import build_problem, correlation_between
from calib.problem.synthetic import Rig, synthetic_sweep
from models.response import Forward, OutOfRangeError
from models.sensor import design_from
from models.threads import one_thread

EXPERIMENT = Path(__file__).parents[1] / "datasets" / "padded_sensor" / "experiment.toml"
#: Share of the thickness of sensor and padding that the ball is pressed, points of each channel.
DEPTH, POINTS = 0.3, 40
#: Draws of a lab until one is covered by the surrogate.
TRIES = 200
_SHARED = (
    "young_modulus",
    "relative_permittivity",
    "machine_compliance",
    "parasitic_capacitance",
    "force_discrepancy",
    "capacitance_discrepancy",
)

Tie = Literal["clock", "force", "displacement", "none"]


@dataclass(frozen=True)
class Lab:
    """An experiment with its measured sweeps."""

    experiment: Experiment
    sweeps: tuple[Sweep, ...]


def _specimen(name: str, thicknesses: Mapping[str, tuple[str, str]], sweeps: Sequence[tuple[str, float]]) -> Specimen:
    priors = {key: parse_prior(key, {"normal": list(given)}) for key, given in thicknesses.items()}
    return Specimen(name, tuple(SweepFiles(title, None, None, radius) for title, radius in sweeps), priors)


@cache
def layout(name: str) -> Experiment:
    """An experiment by its name: two specimens of one kind or of two, a force alone, two balls."""
    shipped = read_experiment(EXPERIMENT)
    if name == "shipped":
        return shipped
    if name == "two kinds":
        other = {
            "sensor_thickness": ("0.95 mm", "0.02 mm"),
            "padding_thickness": ("1.8 mm", "0.03 mm"),
            "dielectric_thickness": ("0.20 mm", "0.006 mm"),
        }
        return replace(shipped, specimens=(shipped.specimens[0], _specimen("sensor 2", other, [("", 5e-3)])))
    thin = {"sensor_thickness": ("0.74 mm", "0.02 mm"), "padding_thickness": ("1.10 mm", "0.03 mm")}
    if name == "force alone":
        return replace(shipped, specimens=(_specimen("sensor 1", thin, [("", 5e-3)]),), priors={})
    both = thin | {"dielectric_thickness": ("0.16 mm", "0.006 mm")}
    return replace(shipped, specimens=(_specimen("sensor 1", both, [("ball 10", 5e-3), ("ball 6", 3e-3)]),))


@cache
def forward() -> Forward:
    """The surrogate that ships."""
    return forward_of_experiment(layout("shipped"))


def sound(name: str, rng: np.random.Generator) -> Lab:
    """A lab whose truth is drawn from the priors of its layout, measured by the surrogate."""
    experiment = layout(name)
    for _ in range(TRIES):
        try:
            return Lab(experiment, tuple(_measured(experiment, name, rng)))
        except (OutOfRangeError, ValueError):  # the surrogate does not cover this one
            continue
    raise RuntimeError(f"no draw of {name} is covered by the surrogate")


def _measured(experiment: Experiment, name: str, rng: np.random.Generator) -> Iterator[Sweep]:
    def draw(quantity: str, own: Mapping[str, Prior]) -> float:
        prior = own.get(quantity) or default_prior(quantity)
        return float(prior.ppf_normal(rng.standard_normal()))

    shared = {quantity: draw(quantity, experiment.priors) for quantity in _SHARED}
    geometry = {"sensor_radius": experiment.sensor_radius}
    for specimen in experiment.specimens:
        own = {quantity: draw(quantity, specimen.priors) for quantity in specimen.priors}
        for files in specimen.sweeps:
            design = design_from({**shared, **geometry, **own, "indenter_radius": files.indenter_radius})
            contact, zero = rng.uniform(-0.2e-3, 0.2e-3), 0.3 * rng.standard_normal()
            rig = Rig(
                contact,
                shared["machine_compliance"],
                zero,
                shared["parasitic_capacitance"],
                2 * rng.standard_normal(),
                force_noise=5e-3,
                capacitance_noise=10e-15,
            )
            depth = DEPTH * (own["sensor_thickness"] + own["padding_thickness"])
            tie: Tie = "none" if name == "force alone" else "force" if name == "two balls" else "clock"
            sweep = synthetic_sweep(
                forward(), design, depth, rig, rng, specimen=specimen.name, name=files.name, n_points=POINTS, tie=tie
            )
            yield _with_discrepancies(sweep, shared, contact, zero, rng)


def _with_discrepancies(
    sweep: Sweep, shared: Mapping[str, float], contact: float, zero: float, rng: np.random.Generator
) -> Sweep:
    """The sweep with what the model leaves out: shares of force and capacitance change that are alike over 0.3 of the depth."""
    at = np.linspace(0.0, 1.0, POINTS)
    root = np.linalg.cholesky(correlation_between(at, at) + 1e-9 * np.eye(POINTS))
    channels = dict(sweep.channels)
    for name, rest in (("force", zero), ("capacitance", None)):
        if name in channels:
            value = channels[name].value
            share = shared[f"{name}_discrepancy"] * root @ rng.standard_normal(POINTS)
            channels[name] = replace(channels[name], value=value + share * (value - (value[0] if rest is None else rest)))
    return replace(sweep, channels=channels)


# --- what is planted ----------------------------------------------------------------------------------------------------


def _all_sweeps(lab: Lab, change: Callable[[Sweep], Sweep]) -> Lab:
    return replace(lab, sweeps=tuple(change(sweep) for sweep in lab.sweeps))


def _all_priors(lab: Lab, change: Callable[[Mapping[str, Prior]], Mapping[str, Prior]]) -> Lab:
    own = tuple(replace(s, priors={**s.priors, **change(s.priors)}) for s in lab.experiment.specimens)
    return replace(lab, experiment=replace(lab.experiment, specimens=own))


def _channels(sweep: Sweep, change: Callable[[str, Points], Points]) -> Sweep:
    return replace(sweep, channels={name: change(name, points) for name, points in sweep.channels.items()})


def _diameter_of_ball(lab: Lab, _: np.random.Generator) -> Lab:
    return _all_sweeps(lab, lambda sweep: replace(sweep, indenter_radius=2 * sweep.indenter_radius))


def _diameter_of_disc(lab: Lab, _: np.random.Generator) -> Lab:
    return replace(lab, experiment=replace(lab.experiment, sensor_radius=2 * lab.experiment.sensor_radius))


def _kilonewtons(lab: Lab, _: np.random.Generator) -> Lab:
    def change(sweep: Sweep) -> Sweep:
        track = None if sweep.track is None else replace(sweep.track, force=1e3 * sweep.track.force)
        noise = {name: 1e3 * sd if name == "force" else sd for name, sd in sweep.noise.items()}
        changed = _channels(
            sweep,
            lambda name, points: replace(
                points,
                value=1e3 * points.value if name == "force" else points.value,
                force=None if points.force is None else 1e3 * points.force,
            ),
        )
        return replace(changed, track=track, noise=noise)

    return _all_sweeps(lab, change)


def _kilopascals(lab: Lab, _: np.random.Generator) -> Lab:
    prior = parse_prior("young_modulus", {"lognormal": ["0.7 kPa", 1.6]})
    return replace(lab, experiment=replace(lab.experiment, priors={**lab.experiment.priors, "young_modulus": prior}))


def _noise(channel: str) -> Callable[[Lab, np.random.Generator], Lab]:
    def plant(lab: Lab, rng: np.random.Generator) -> Lab:
        def change(sweep: Sweep) -> Sweep:
            def noisy(name: str, points: Points) -> Points:
                if name != channel:
                    return points
                sd = sweep.noise[name] / np.sqrt(points.n_effective)
                return replace(points, value=points.value[0] + sd * rng.standard_normal(POINTS))

            return _channels(sweep, noisy)

        return _all_sweeps(lab, change)

    return plant


def _other_lcr_file(lab: Lab, rng: np.random.Generator) -> Lab:
    """The capacitance of the first specimen is of one that was built otherwise, thicker throughout."""
    other = sound("two kinds", rng).sweeps[1].channels["capacitance"]
    first, *rest = lab.sweeps
    changed = replace(
        first, channels={**first.channels, "capacitance": replace(first.channels["capacitance"], value=other.value)}
    )
    return replace(lab, sweeps=(changed, *rest))


def _specimens_exchanged(lab: Lab, _: np.random.Generator) -> Lab:
    one, other = lab.sweeps
    return replace(lab, sweeps=(replace(other, specimen=one.specimen), replace(one, specimen=other.specimen)))


def _balls_exchanged(lab: Lab, _: np.random.Generator) -> Lab:
    one, other = lab.sweeps
    radii = one.indenter_radius, other.indenter_radius
    return replace(lab, sweeps=(replace(one, indenter_radius=radii[1]), replace(other, indenter_radius=radii[0])))


def _thicknesses_exchanged(lab: Lab, _: np.random.Generator) -> Lab:
    sensor, padding = "sensor_thickness", "padding_thickness"
    return _all_priors(lab, lambda p: {sensor: p[padding], padding: p[sensor]})


def _thickness_times(name: str, k: float) -> Callable[[Lab, np.random.Generator], Lab]:
    def plant(lab: Lab, _: np.random.Generator) -> Lab:
        return _all_priors(lab, lambda p: {name: scaled(p[name], k)})

    return plant


def _total_as_padding(lab: Lab, _: np.random.Generator) -> Lab:
    def change(priors: Mapping[str, Prior]) -> Mapping[str, Prior]:
        total = sum(float(priors[name].ppf_normal(0.0)) for name in ("sensor_thickness", "padding_thickness"))
        return {"padding_thickness": parse_prior("padding_thickness", {"normal": [f"{total} m", "0.03 mm"]})}

    return _all_priors(lab, change)


@dataclass(frozen=True)
class Kind:
    """What is wrong: layouts of the labs, what is planted in them, and the gates of slips that name it, if it can be named."""

    layouts: tuple[str, ...]
    plant: Callable[[Lab, np.random.Generator], Lab]
    gates: tuple[str, ...] = ()


#: What can be planted, by name.
KINDS: Mapping[str, Kind] = {
    "nothing": Kind(("shipped", "two kinds", "force alone", "two balls"), lambda lab, _: lab),
    "ball's diameter": Kind(("shipped", "force alone", "two balls"), _diameter_of_ball, ("ball",)),
    "disc's diameter": Kind(("shipped", "two balls"), _diameter_of_disc, ("sensor's disc",)),
    "N called kN": Kind(("shipped", "force alone", "two balls"), _kilonewtons, ("unit of force",)),
    "modulus in kPa": Kind(("shipped", "force alone", "two balls"), _kilopascals, ("unit of modulus",)),
    "thicknesses exchanged": Kind(("shipped", "two balls"), _thicknesses_exchanged, ("thicknesses",)),
    "total as padding": Kind(("shipped", "force alone", "two balls"), _total_as_padding, ("thicknesses",)),
    "padding ten times": Kind(
        ("shipped", "force alone", "two balls"), _thickness_times("padding_thickness", 10), ("thicknesses",)
    ),
    "padding a tenth": Kind(
        ("shipped", "force alone", "two balls"), _thickness_times("padding_thickness", 0.1), ("thicknesses",)
    ),
    "sensor ten times": Kind(
        ("shipped", "force alone", "two balls"), _thickness_times("sensor_thickness", 10), ("thicknesses",)
    ),
    "dielectric twice": Kind(("shipped", "two balls"), _thickness_times("dielectric_thickness", 2), ("dielectrics",)),
    "another LCR file": Kind(("shipped",), _other_lcr_file),
    "specimens exchanged": Kind(("two kinds",), _specimens_exchanged, ("files",)),
    "balls exchanged": Kind(("two balls",), _balls_exchanged, ("ball",)),
    "noise for capacitance": Kind(("shipped", "two balls"), _noise("capacitance")),
    "noise for force": Kind(("shipped", "force alone"), _noise("force")),
}


def check(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Plant something in a lab and check it."""
    rng = np.random.default_rng([seed, 20190304])
    lab = KINDS[kind].plant(sound(name, rng), rng)
    began = time.process_time()
    found: dict[str, Any] = {"kind": kind, "layout": name, "seed": seed}
    try:
        said = plausibility(build_problem(lab.experiment, lab.sweeps, forward()))
    except InputError as refusal:
        words = [str(fault) for fault in ways_out(refusal.faults, lab.experiment, lab.sweeps, forward())]
        named = any(question in words[-1] for question in _QUESTIONS.get(kind, ()))
        took = round(time.process_time() - began, 2)
        return found | {"colour": "refused", "named": named, "reasons": words, "processor": took}
    words = [f"{r.level} {r.gate}: {r.finding}. {r.action}" for r in said.reasons]
    named = any(r.gate in KINDS[kind].gates or any(q in r.action for q in _QUESTIONS.get(kind, ())) for r in said.reasons)
    took = round(time.process_time() - began, 2)
    return found | {"colour": said.verdict.colour, "named": named, "reasons": words, "processor": took}


#: What an action says that names what was planted.
_QUESTIONS: Mapping[str, tuple[str, ...]] = {
    "ball's diameter": ("diameter was entered",),
    "disc's diameter": ("diameter was entered",),
    "N called kN": ("unit of the force column",),
    "modulus in kPa": ("unit of young_modulus",),
    "thicknesses exchanged": ("were mixed up",),
    "total as padding": ("total thickness",),
    "padding ten times": ("decimal point of padding_thickness",),
    "padding a tenth": ("decimal point of padding_thickness",),
    "sensor ten times": ("decimal point of sensor_thickness",),
    "dielectric twice": ("number of dielectrics",),
    "specimens exchanged": ("which file is of which specimen",),
    "balls exchanged": ("which ball",),
}


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind and layout."""
    yield "| planted | labs | layout | refused | red | amber | green | named | processor, median [s] |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for kind, name in dict.fromkeys((row["kind"], row["layout"]) for row in rows):
        own = [row for row in rows if (row["kind"], row["layout"]) == (kind, name)]
        counts = [sum(row["colour"] == colour for row in own) for colour in ("refused", "red", "amber", "green")]
        named = sum(row["named"] for row in own) if KINDS[kind].gates else "-"
        took = float(np.median([row["processor"] for row in own]))
        yield f"| {kind} | {len(own)} | {name} | {' | '.join(map(str, counts))} | {named} | {took:.1f} |"


def main(words: Sequence[str] | None = None) -> None:
    """Check the labs that are asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"some of: {'; '.join(KINDS)}; default all")
    parser.add_argument("--sound", type=int, default=120, help="labs in which nothing is planted")
    parser.add_argument("--labs", type=int, default=20, help="of each other kind")
    parser.add_argument("-o", "--output", type=Path, help="file for the labs, a line of JSON each; those in it are kept")
    given = parser.parse_args(words)
    rows = kept_rows(given.output)
    known = {(row["kind"], row["layout"], row["seed"]) for row in rows}
    with one_thread():
        for kind in given.kinds or KINDS:
            for name in KINDS[kind].layouts:
                n_lab = given.sound if kind == "nothing" else given.labs
                for seed in range(math.ceil(n_lab / len(KINDS[kind].layouts))):
                    if (kind, name, seed) in known:
                        continue
                    rows.append(check(kind, name, seed))
                    keep_row(given.output, rows[-1])
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()
