"""A kind of fault and a seed in, a simulated lab with that fault out: what it measured, what its experiment says, the truth.

A lab is the shipped experiment with files of its own: two specimens of one lot, each unknown drawn from its prior, curves by
the finite elements, the noise and the faults of the instruments. Each press is logged as labs do, from before contact down and
up again, by a tester and a meter with clocks of their own, and the files go through the readers. In each kind one thing is not
as the experiment takes for granted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from calib.experiment import Experiment, read_experiment, read_sweeps
from calib.lab import AS_FOUND, Sweep
from calib.priors import parse_prior
from calib.problem.synthetic import Rig
from models.fem import FiniteElements
from models.laws import Law, Yeoh
from models.layers import LayeredDesign, layered
from models.response import ConvergenceError, OutOfRangeError, Response
from models.sensor import Base, Design, FloatArray, design_from

EXPERIMENT = Path(__file__).parents[2] / "datasets" / "padded_sensor" / "experiment.toml"
#: How deep the ball is pressed [m], points of each channel, steps of the finite elements on the way and their accuracy.
DEPTH, POINTS, STEPS, ACCURACY = 0.55e-3, 25, 48, 5e-4
#: Speed of the crosshead [m/s], its way before contact [m], readings of tester and meter in a second.
SPEED, APPROACH, OF_TESTER, OF_METER = 1e-5, 0.1e-3, 10, 5
# Nothing is further from its prior's median than this, in its standard deviations.
_FARTHEST = 2.5
_STEEL = 5e-3
# Rounds in which the way of the crosshead is parted into depth and what the machine gives, a third of the rest in each.
_ROUNDS = 20


@dataclass(frozen=True)
class Fault:
    """What is not as the experiment takes for granted.

    Attributes
    ----------
    physics : of the true sensor, by the names of `Physics`.
    told : attributes of the experiment that are wrong or special.
    padding : [m], of each specimen as its prior has it.
    tampered : what becomes of the records on the way to the calibration, given those of a simulated lab of other sensors.
    """

    physics: Mapping[str, Any] = field(default_factory=dict)
    told: Mapping[str, Any] = field(default_factory=dict)
    padding: tuple[float, float] = (1.1e-3, 1.1e-3)
    tampered: Callable[[list[Record], Callable[[], list[Record]], np.random.Generator], list[Record]] = lambda own, *_: own


@dataclass(frozen=True)
class Physics:
    """What the true sensors are like, beside the values of the experiment's unknowns.

    Attributes
    ----------
    ratio : modulus of the padding over that of the sensor.
    friction : coefficient at the ball.
    slippery : whether the padding slides on its base.
    base_friction : coefficient there; 0 for none, inf for a padding that is held.
    law : of both materials; None for neo-Hookean.
    ball : true radius of the ball over the one of the experiment.
    second : modulus of the second specimen over that of the first.
    relaxation : share of the force that relaxes, within a time [s].
    drift : [N], of the load cell while the ball is pressed in.
    dielectric : thickness of the dielectric over what is believed.
    """

    ratio: float = 1.0
    friction: float = 0.0
    slippery: bool = False
    base_friction: float = 0.0
    law: Law | None = None
    ball: float = 1.0
    second: float = 1.0
    relaxation: tuple[float, float] = (0.0, 1.0)
    drift: float = 0.0
    dielectric: float = 1.0


@dataclass(frozen=True, eq=False)
class Record:
    """What tester and meter wrote of one press.

    Attributes
    ----------
    tester, meter : columns by their headers, in the units of these.
    """

    tester: Mapping[str, FloatArray]
    meter: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Lab:
    """A simulated lab: its experiment, what it measured, and the true design of each specimen with the law of its layers."""

    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    designs: tuple[Design, ...]
    law: Law | None


@dataclass(frozen=True)
class Curve:
    """The loading curve of one design as a `Forward` for it alone: finite elements at some depths, and between them."""

    force: CubicSpline
    capacitance: CubicSpline
    name: str = "finite elements, interpolated"

    @property
    def identity(self) -> str:
        """See `models.response.Forward`."""
        return self.name

    def max_depth(self, design: Design) -> FloatArray:
        """See `models.response.Forward`."""
        return np.full(np.shape(design.draws().sensor.thickness), float(self.force.x[-1] ** 2))

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `models.response.Forward`."""
        return "" if np.all(np.max(depth) <= self.max_depth(design)) else "deeper than the curve"

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `models.response.Forward`."""
        s = np.sqrt(np.maximum(depth, 0.0))
        none = np.empty((*np.shape(depth), 0))
        c0 = np.asarray(design.rest_capacitance)
        return Response(np.asarray(depth, float), self.force(s), 0 * s, self.capacitance(s), c0, none, none)


def stack_of(design: Design, law: Law | None) -> LayeredDesign:
    """The layers of a design, all of one law; None for that of the design."""
    stack = layered(design)
    return stack if law is None else replace(stack, layers=tuple(replace(layer, law=law) for layer in stack.layers))


def curve_of(design: Design, end: float, law: Law | None = None) -> Curve:
    """Press a design with the finite elements, to an end.

    Parameters
    ----------
    design : the sensor.
    end : depth [m].
    law : of all layers; None for that of the design.
    """
    s = np.linspace(0.0, math.sqrt(end), STEPS + 1)
    r = FiniteElements(ACCURACY).respond(stack_of(design, law), s[1:] ** 2)
    at_rest = float(np.asarray(design.rest_capacitance))
    force, capacitance = (np.concatenate([[first], rest]) for first, rest in ((0.0, r.force), (at_rest, r.capacitance)))
    return Curve(CubicSpline(s, force), CubicSpline(s, capacitance))


_TIME, _WAY, _LOAD, _READ = "Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)"


def _in_kilonewton(own: list[Record], *_: Any) -> list[Record]:
    """A load in newtons under a header in kilonewtons."""
    return [replace(r, tester={k.replace("(N)", "(kN)"): column for k, column in r.tester.items()}) for r in own]


def _noise_only(own: list[Record], _: Any, rng: np.random.Generator) -> list[Record]:
    """Channels that were not connected: noise about a constant."""

    def alone(columns: Mapping[str, FloatArray], name: str, noise: float) -> Mapping[str, FloatArray]:
        return {**columns, name: columns[name][0] + noise * rng.standard_normal(columns[name].size)}

    return [Record(alone(r.tester, _LOAD, 5e-3), alone(r.meter, _READ, 1e-2)) for r in own]


def _another_meter_file(own: list[Record], others: Callable[[], list[Record]], _: Any) -> list[Record]:
    """The first specimen with the capacitance of a sensor of another lot."""
    return [replace(own[0], meter=others()[0].meter), *own[1:]]


def _swapped(own: list[Record], *_: Any) -> list[Record]:
    """The files of the two specimens under each other's names."""
    return own[::-1]


#: What can be planted, by name.
KINDS: Mapping[str, Fault] = {
    "sound": Fault(),
    "friction 0.3": Fault({"friction": 0.3}),
    "slippery base": Fault({"slippery": True}),
    "base rubs 0.2, as slippery": Fault({"slippery": True, "base_friction": 0.2}, {"base": "slippery"}),
    "base rubs 0.5, as slippery": Fault({"slippery": True, "base_friction": 0.5}, {"base": "slippery"}),
    "base rubs 1, as bonded": Fault({"slippery": True, "base_friction": 1.0}),
    "base rubs 2, as bonded": Fault({"slippery": True, "base_friction": 2.0}),
    "Yeoh, c2 0.1": Fault({"law": Yeoh(0.1)}),
    "relaxation": Fault({"relaxation": (0.15, 20.0)}),
    "ball 2 % larger": Fault({"ball": 1.02}),
    "diameter for radius": Fault(told={"indenter_radius": 2 * _STEEL}),
    "meter file of another lot": Fault(tampered=_another_meter_file),
    "swapped specimens": Fault(padding=(1.1e-3, 1.6e-3), tampered=_swapped),
    "kN for N": Fault(tampered=_in_kilonewton),
    "padding 20 % softer": Fault({"ratio": 0.8}),
    "padding 30 % harder": Fault({"ratio": 1.3}),
    "moduli 8 % apart": Fault({"second": 1.08}),
    "drift": Fault({"drift": 0.1}),
    "noise only": Fault(tampered=_noise_only),
}


def lab_of(name: str, seed: int) -> Lab:
    """Simulate a lab.

    Parameters
    ----------
    name : of its kind, a key of `KINDS`.
    seed : of all that is drawn.
    """
    fault = KINDS[name]
    experiment = _as_said(read_experiment(EXPERIMENT), fault)
    rng = np.random.default_rng([seed, 20190304])
    physics = Physics(**fault.physics)
    records, designs = _measured(experiment, fault.padding, physics, rng)

    def others() -> list[Record]:
        other = np.random.default_rng([seed, 20190305])
        return _measured(experiment, fault.padding, replace(physics, dielectric=1 + other.choice([-0.12, 0.12])), other)[0]

    sweeps = _read(experiment, fault.tampered(records, others, rng))
    return Lab(experiment, sweeps, tuple(designs), physics.law)


def _read(experiment: Experiment, records: Sequence[Record]) -> tuple[Sweep, ...]:
    """Write the files of a lab and read them, without being told anything of them."""
    with TemporaryDirectory() as folder:
        specimens = []
        for k, (specimen, record) in enumerate(zip(experiment.specimens, records, strict=True), 1):
            tester, meter = written(record, Path(folder) / f"sensor{k}")
            files = replace(
                specimen.sweeps[0],
                indenter_radius=experiment.indenter_radius,
                force=tester,
                capacitance=meter,
                force_reading=AS_FOUND,
                capacitance_reading=AS_FOUND,
            )
            specimens.append(replace(specimen, sweeps=(files,)))
        return read_sweeps(replace(experiment, specimens=tuple(specimens)))


def written(record: Record, stem: Path) -> tuple[Path, Path]:
    """Write what tester and meter wrote of a press.

    Parameters
    ----------
    record : of the press.
    stem : path of the files, less what tells them apart.
    """
    paths = []
    for what, columns in (("tester", record.tester), ("meter", record.meter)):
        paths.append(stem.with_name(f"{stem.name}_{what}.csv"))
        rows = np.column_stack(list(columns.values()))
        np.savetxt(paths[-1], rows, fmt="%.4f", delimiter=",", header=",".join(columns), comments="")
    return paths[0], paths[1]


def _as_said(experiment: Experiment, fault: Fault) -> Experiment:
    specimens = tuple(
        replace(s, priors={**s.priors, "padding_thickness": _padding_prior(h)})
        for s, h in zip(experiment.specimens, fault.padding, strict=True)
    )
    return replace(experiment, specimens=specimens, **fault.told)


def _padding_prior(thickness: float) -> Any:
    return parse_prior("padding_thickness", {"normal": [f"{thickness * 1e3} mm", "0.03 mm"]})


def _measured(
    experiment: Experiment, padding: tuple[float, float], physics: Physics, rng: np.random.Generator
) -> tuple[list[Record], list[Design]]:
    def z() -> float:
        return float(np.clip(rng.standard_normal(), -_FARTHEST, _FARTHEST))

    shared = {"young_modulus": 0.7e6 * 1.6 ** z(), "relative_permittivity": 2.8 + 0.15 * z(), "sensor_radius": 10e-3}
    shared["indenter_radius"] = _STEEL * physics.ball
    compliance, parasitic = abs(5e-6 * z()), 1e-12 * z()
    records, designs = [], []
    for _, thickness, factor in zip(experiment.specimens, padding, (1.0, physics.second), strict=True):
        own = {
            **shared,
            "young_modulus": factor * shared["young_modulus"],
            "sensor_thickness": 0.74e-3 + 0.02e-3 * z(),
            "padding_thickness": thickness + 0.03e-3 * z(),
            "dielectric_thickness": physics.dielectric * (0.16e-3 + 0.006e-3 * z()),
        }
        own["padding_young_modulus"] = physics.ratio * own["young_modulus"]
        own["base_friction_coefficient"] = physics.base_friction
        base: Base = "slippery" if physics.slippery else "bonded"
        design = design_from(own, friction_coefficient=physics.friction, base=base)
        rig = Rig(0.2e-3 + 0.03e-3 * z(), compliance, 0.3 * z(), parasitic, 2 * z(), capacitance_noise=1e-14, speed=SPEED)
        records.append(pressed(curve_of(design, 1.05 * DEPTH, physics.law), rig, physics, rng))
        designs.append(design)
    return records, designs


def pressed(curve: Curve, rig: Rig, physics: Physics, rng: np.random.Generator) -> Record:
    """Press a sensor: the crosshead goes down at constant speed, and up again to where it began.

    Parameters
    ----------
    curve : of the sensor.
    rig : tester and meter, and where the press begins.
    physics : of the sensor, for what relaxes, and of the load cell, for what drifts.
    rng : of the noise.
    """
    deepest = DEPTH + rig.machine_compliance * (float(curve.force(math.sqrt(DEPTH))) + rig.load_zero)
    down = np.arange(0.0, (APPROACH + deepest) / SPEED, 1 / OF_TESTER)
    time = np.concatenate([down, down[-1] + 1 / OF_TESTER + down])
    way = SPEED * np.concatenate([down, down[::-1]]) - APPROACH
    drift = physics.drift * time / down[-1]
    depth, load = way, np.zeros_like(way)
    for _ in range(_ROUNDS):
        depth = np.minimum(way - rig.machine_compliance * (load + rig.load_zero), 1.05 * DEPTH)
        load = _relaxed(curve.force(np.sqrt(np.maximum(depth, 0.0))), time, *physics.relaxation)
    read = curve.capacitance(np.sqrt(np.maximum(depth, 0.0))) + rig.parasitic_capacitance
    force = load + rig.load_zero + drift + rig.force_noise * rng.standard_normal(time.size)
    at = np.arange(0.05, time[-1], 1 / OF_METER)
    capacitance = np.interp(at, time, read) + rig.capacitance_noise * rng.standard_normal(at.size)
    tester = {_TIME: time, _WAY: (way + rig.contact_offset) * 1e3, _LOAD: force}
    return Record(tester, {_TIME: at - rig.clock_offset + 10.0, _READ: capacitance * 1e12})


def _relaxed(elastic: FloatArray, time: FloatArray, share: float, constant: float) -> FloatArray:
    """The force of a linear viscoelastic sensor of which a share g relaxes as exp(-t / tau): nothing pulls at the ball.

    F(t) = F_e(t) - g int (1 - exp(-(t - s) / tau)) F_e'(s) ds, which is F = (1 - g) F_e + g q, q' = F_e' - q / tau.
    """
    if share == 0:
        return elastic
    fade = np.exp(-np.diff(time) / constant)
    q = np.zeros_like(elastic)
    for k in range(1, q.size):
        q[k] = q[k - 1] * fade[k - 1] + (elastic[k] - elastic[k - 1]) * math.sqrt(fade[k - 1])
    return np.maximum((1 - share) * elastic + share * q, 0.0)


def true_signal(lab: Lab, specimen: int, padding: float, force: float) -> float:
    """The true change of capacitance of a specimen on another padding; nan where the finite elements do not come so far.

    Parameters
    ----------
    lab : with its true designs.
    specimen : which of them.
    padding : its thickness [m].
    force : [N].
    """
    design = lab.designs[specimen]
    stack = stack_of(replace(design, padding=replace(design.padding, thickness=padding)), lab.law)
    try:
        capacitance = float(FiniteElements(ACCURACY).respond_to_force(stack, np.array([force])).capacitance[0])
    except (OutOfRangeError, ConvergenceError):
        return math.nan
    return capacitance / float(np.asarray(design.rest_capacitance)) - 1
