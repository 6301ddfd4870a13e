"""A kind of fault and a seed in, a simulated lab with that fault out: what it measured, what its experiment says, the truth.

A lab is the shipped experiment with data of its own: two specimens of one lot, each unknown drawn from its prior, curves by the
finite elements, the noise and the faults of the instruments. In each kind one thing is not as the experiment takes for granted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from calib.experiment import Experiment, read_experiment
from calib.lab import Sweep
from calib.priors import parse_prior
from calib.problem.synthetic import Rig, synthetic_sweep
from models.fem import FiniteElements
from models.laws import Law, Yeoh
from models.layers import layered
from models.response import ConvergenceError, OutOfRangeError, Response
from models.sensor import Base, Design, FloatArray, design_from

EXPERIMENT = Path(__file__).parents[2] / "datasets" / "padded_sensor" / "experiment.toml"
#: How deep the ball is pressed [m], points of each channel, steps of the finite elements on the way and their accuracy.
DEPTH, POINTS, STEPS, ACCURACY = 0.55e-3, 25, 48, 5e-4
#: Speed of the crosshead [m/s].
SPEED = 1e-5
# Nothing is further from its prior's median than this, in its standard deviations.
_FARTHEST = 2.5
_STEEL = 5e-3


@dataclass(frozen=True)
class Fault:
    """What is not as the experiment takes for granted.

    Attributes
    ----------
    physics : of the true sensor, by the names of `Physics`.
    told : attributes of the experiment that are wrong or special.
    padding : [m], of each specimen as its prior has it.
    tampered : what becomes of the sweeps on the way to the calibration, given a simulated lab of other sensors.
    """

    physics: Mapping[str, Any] = field(default_factory=dict)
    told: Mapping[str, Any] = field(default_factory=dict)
    padding: tuple[float, float] = (1.1e-3, 1.1e-3)
    tampered: Callable[[list[Sweep], Callable[[], list[Sweep]], np.random.Generator], list[Sweep]] = lambda own, *_: own


@dataclass(frozen=True)
class Physics:
    """What the true sensors are like, beside the values of the experiment's unknowns.

    Attributes
    ----------
    ratio : modulus of the padding over that of the sensor.
    friction : coefficient at the ball.
    slippery : whether the padding slides on its base.
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
    law: Law | None = None
    ball: float = 1.0
    second: float = 1.0
    relaxation: tuple[float, float] = (0.0, 1.0)
    drift: float = 0.0
    dielectric: float = 1.0


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


def curve_of(design: Design, end: float, law: Law | None = None, relaxation: tuple[float, float] = (0.0, 1.0)) -> Curve:
    """Press a design with the finite elements, to an end.

    Parameters
    ----------
    design : the sensor.
    end : depth [m].
    law : of all layers; None for that of the design.
    relaxation : share of the force that relaxes, and the time in which it does [s], at the `SPEED` of the crosshead.
    """
    s = np.linspace(0.0, math.sqrt(end), STEPS + 1)
    stack = layered(design)
    if law is not None:
        stack = replace(stack, layers=tuple(replace(layer, law=law) for layer in stack.layers))
    r = FiniteElements(ACCURACY).respond(stack, s[1:] ** 2)
    at_rest = float(np.asarray(design.rest_capacitance))
    force, capacitance = (np.concatenate([[first], rest]) for first, rest in ((0.0, r.force), (at_rest, r.capacitance)))
    curve = Curve(CubicSpline(s, force), CubicSpline(s, capacitance))
    share, time = relaxation
    return curve if share == 0 else replace(curve, force=_relaxed(curve.force, share, time))


def _relaxed(force: CubicSpline, share: float, time: float) -> CubicSpline:
    """The force of a linear viscoelastic sensor pressed at constant speed: a share g relaxes as exp(-t / tau).

    F(t) = F_e(t) - g int (1 - exp(-(t - s) / tau)) F_e'(s) ds, which is F = (1 - g) F_e + g q, q' = F_e' - q / tau.
    """
    depth = np.linspace(0.0, float(force.x[-1]) ** 2, 4001)
    elastic = force(np.sqrt(depth))
    fade = math.exp(-(depth[1] / SPEED) / time)
    q = np.zeros_like(elastic)
    for k in range(1, q.size):
        q[k] = q[k - 1] * fade + (elastic[k] - elastic[k - 1]) * math.sqrt(fade)
    relaxed = (1 - share) * elastic + share * q
    return CubicSpline(force.x, np.interp(force.x**2, depth, relaxed))


def _in_kilonewton(own: list[Sweep], *_: Any) -> list[Sweep]:
    """A load in newtons under a header in kilonewtons."""
    return [_with_force(s, lambda f: 1e3 * f, 1e3) for s in own]


def _with_force(sweep: Sweep, change: Callable[[FloatArray], FloatArray], noise: float = 1.0) -> Sweep:
    points = replace(sweep.channels["force"], value=change(sweep.channels["force"].value))
    track = None if sweep.track is None else replace(sweep.track, force=change(sweep.track.force))
    kept = {**sweep.noise, "force": noise * sweep.noise["force"]}
    return replace(sweep, channels={**sweep.channels, "force": points}, track=track, noise=kept)


def _noise_only(own: list[Sweep], _: Any, rng: np.random.Generator) -> list[Sweep]:
    """Channels that were not connected: noise about a constant."""
    noisy = []
    for sweep in own:
        spread = {name: 3 * sweep.noise[name] / np.sqrt(p.n_effective) for name, p in sweep.channels.items()}
        channels = {
            name: replace(p, value=p.value[0] + spread[name] * rng.standard_normal(p.value.size))
            for name, p in sweep.channels.items()
        }
        noisy.append(replace(sweep, channels=channels))
    return noisy


def _another_meter_file(own: list[Sweep], others: Callable[[], list[Sweep]], _: Any) -> list[Sweep]:
    """The first specimen with the capacitance of a sensor of another lot."""
    found = others()[0]
    return [replace(own[0], channels={**own[0].channels, "capacitance": found.channels["capacitance"]}), *own[1:]]


def _swapped(own: list[Sweep], *_: Any) -> list[Sweep]:
    """The files of the two specimens under each other's names."""
    a, b = own
    return [replace(b, specimen=a.specimen), replace(a, specimen=b.specimen)]


#: What can be planted, by name.
KINDS: Mapping[str, Fault] = {
    "sound": Fault(),
    "friction 0.3": Fault({"friction": 0.3}),
    "slippery base": Fault({"slippery": True}),
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
    sweeps, designs = _measured(experiment, fault.padding, physics, rng)

    def others() -> list[Sweep]:
        other = np.random.default_rng([seed, 20190305])
        return _measured(experiment, fault.padding, replace(physics, dielectric=1 + other.choice([-0.12, 0.12])), other)[0]

    sweeps = fault.tampered(sweeps, others, rng)
    sweeps = [replace(s, indenter_radius=experiment.indenter_radius) for s in sweeps]
    return Lab(experiment, tuple(sweeps), tuple(designs), physics.law)


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
) -> tuple[list[Sweep], list[Design]]:
    def z() -> float:
        return float(np.clip(rng.standard_normal(), -_FARTHEST, _FARTHEST))

    shared = {"young_modulus": 0.7e6 * 1.6 ** z(), "relative_permittivity": 2.8 + 0.15 * z(), "sensor_radius": 10e-3}
    shared["indenter_radius"] = _STEEL * physics.ball
    compliance, parasitic = abs(5e-6 * z()), 1e-12 * z()
    sweeps, designs = [], []
    for specimen, thickness, factor in zip(experiment.specimens, padding, (1.0, physics.second), strict=True):
        own = {
            **shared,
            "young_modulus": factor * shared["young_modulus"],
            "sensor_thickness": 0.74e-3 + 0.02e-3 * z(),
            "padding_thickness": thickness + 0.03e-3 * z(),
            "dielectric_thickness": physics.dielectric * (0.16e-3 + 0.006e-3 * z()),
        }
        own["padding_young_modulus"] = physics.ratio * own["young_modulus"]
        base: Base = "slippery" if physics.slippery else "bonded"
        design = design_from(own, friction_coefficient=physics.friction, base=base)
        rig = Rig(0.2e-3 + 0.03e-3 * z(), compliance, 0.3 * z(), parasitic, 2 * z(), capacitance_noise=1e-14, speed=SPEED)
        curve = curve_of(design, 1.01 * DEPTH, physics.law, physics.relaxation)
        sweep = synthetic_sweep(curve, design, DEPTH, rig, rng, specimen=specimen.name, n_points=POINTS)
        sweeps.append(_drifted(sweep, physics.drift))
        designs.append(design)
    return sweeps, designs


def _drifted(sweep: Sweep, drift: float) -> Sweep:
    """A sweep whose load zero has moved by so much [N] when the ball is deepest."""
    if drift == 0 or sweep.track is None:
        return sweep
    at = sweep.channels["force"].displacement
    reading = sweep.track.displacement
    assert at is not None
    span = reading[-1] - reading[0]
    moved = _with_force(sweep, lambda f: f)
    points = replace(moved.channels["force"], value=moved.channels["force"].value + drift * (at - reading[0]) / span)
    track = replace(sweep.track, force=sweep.track.force + drift * (reading - reading[0]) / span)
    return replace(moved, channels={**moved.channels, "force": points}, track=track)


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
    stack = layered(replace(design, padding=replace(design.padding, thickness=padding)))
    if lab.law is not None:
        stack = replace(stack, layers=tuple(replace(layer, law=lab.law) for layer in stack.layers))
    try:
        capacitance = float(FiniteElements(ACCURACY).respond_to_force(stack, np.array([force])).capacitance[0])
    except (OutOfRangeError, ConvergenceError):
        return math.nan
    return capacitance / float(np.asarray(design.rest_capacitance)) - 1
