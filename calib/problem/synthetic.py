"""A forward model, a true design and the faults of two instruments in, the sweep that a lab would have measured out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib.lab import Points, Sweep, Track
from models.response import Forward
from models.sensor import Design, FloatArray

_NAN = float("nan")


@dataclass(frozen=True)
class Rig:
    """The faults of testing machine and LCR meter in a simulated experiment, SI; see `calib.problem.measurement`.

    Attributes
    ----------
    contact_offset, machine_compliance, load_zero, parasitic_capacitance, clock_offset, displacement_gain, force_gain,
        capacitance_gain : true values of these unknowns.
    force_noise, capacitance_noise : [N], [F], sd of one reading.
    n_effective : [1], independent readings behind each point.
    speed : [m/s], of the crosshead.
    load_step : true value of this unknown.
    """

    contact_offset: float = 0.0
    machine_compliance: float = 0.0
    load_zero: float = 0.0
    parasitic_capacitance: float = 0.0
    clock_offset: float = 0.0
    displacement_gain: float = 1.0
    force_gain: float = 1.0
    capacitance_gain: float = 1.0
    force_noise: float = 5e-3
    capacitance_noise: float = 20e-15
    n_effective: float = 10.0
    speed: float = 1e-5
    load_step: float = 0.0


def synthetic_sweep(
    forward: Forward,
    design: Design,
    depth: float,
    rig: Rig,
    rng: np.random.Generator,
    *,
    specimen: str,
    name: str = "",
    n_points: int = 40,
    approach: float = 0.1e-3,
    tie: Literal["clock", "force", "displacement", "none"] = "clock",
    with_force: bool = True,
) -> Sweep:
    """Simulate the sweep that a lab would have measured on a sensor whose true properties are known, to test a calibration.

    Parameters
    ----------
    forward : the model that stands for the true sensor.
    design : its true properties, plain numbers.
    depth : [m], how deep the ball is pressed.
    rig : the faults of the instruments.
    rng : of the noise.
    specimen, name : of the specimen and the sweep.
    n_points : points of each channel.
    approach : [m], travel before contact.
    tie : how the depth of the capacitance readings is known; "none" for a sweep without them.
    with_force : whether there is a tester's file; without it the tie must not be the clock.

    Returns
    -------
    The sweep, as `make_sweep` would reduce it.

    Raises
    ------
    ValueError
        If the capacitance is to be tied to a tester's clock without a tester's file.
    """
    if tie == "clock" and not with_force:
        raise ValueError("a tie by clock needs the tester's file")
    path = np.linspace(-approach, depth, 1500)
    response = forward.respond(design, path)
    force = rig.force_gain * response.force + rig.load_zero + rig.load_step * (path > 0)
    reading = rig.displacement_gain * (path + rig.machine_compliance * force / rig.force_gain) + rig.contact_offset
    time = (reading - reading[0]) / rig.speed
    capacitance = rig.capacitance_gain * response.capacitance + rig.parasitic_capacitance
    at = np.linspace(-0.95 * approach, 0.99 * depth, n_points)
    n = np.full(n_points, rig.n_effective)

    def column(values: FloatArray, noise: float = 0.0, shift: float = 0.0) -> FloatArray:
        exact = np.interp(at + shift, path, values)
        return np.asarray(exact + noise / np.sqrt(n) * rng.standard_normal(n_points), dtype=float)

    shift = -0.25 * (at[1] - at[0])  # the two instruments do not read at the same moments; none after the end
    channels: dict[str, Points] = {}
    noise: dict[str, float] = {}
    capacitance_points = None
    if tie != "none":
        capacitance_points = Points(
            column(capacitance, rig.capacitance_noise, shift),
            n,
            time=column(time, 0.0, shift) - rig.clock_offset if tie == "clock" else None,
            force=column(force, rig.force_noise, shift) if tie == "force" else None,
            displacement=column(reading, 0.0, shift) if tie == "displacement" else None,
        )
    if with_force:
        displacement, load = column(reading), column(force, rig.force_noise)
        channels["force"] = Points(load, n, displacement=displacement)
    if with_force or tie == "force":
        noise["force"] = rig.force_noise
    if capacitance_points is not None:
        channels["capacitance"], noise["capacitance"] = capacitance_points, rig.capacitance_noise
    # As lab files have it, within some micrometres: along which depths discrepancies go together hangs on it.
    touch = float(np.interp(0.0, path, reading)) if with_force or tie == "displacement" else _NAN
    return Sweep(
        specimen=specimen,
        name=name,
        indenter_radius=float(np.asarray(design.indenter.radius)),
        channels=channels,
        track=Track(time, reading, force) if with_force else None,
        noise=noise,
        clock_offset=rig.clock_offset if tie == "clock" else _NAN,
        clock_offset_sd=0.1 if tie == "clock" else _NAN,
        files=(),
        notes=(),
        contact=touch,
    )
