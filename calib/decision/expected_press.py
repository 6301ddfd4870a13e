"""A press that nobody has made in, the sweep expected of it and the problem that it would make of a calibration out.

Such a press is one more sweep, of the readings that the calibration expects at the middle of its posterior, reduced as those of
the specimen that it is like. Its contact, load zero and clock are unknowns of its own, its noise and discrepancy those of the
calibration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal, cast

import numpy as np

from calib.catalogue import UNKNOWNS, UnknownName
from calib.decision.extrapolation import Measured
from calib.decision.known import Known
from calib.decision.wanted_presses import WantedPress
from calib.experiment import Experiment
from calib.lab import Points, Sweep
from calib.problem import (
    Problem,
    Rig,
    columns_at,
    list_unknowns,
    lookup,
    plan_sweeps,
    specimen_design,
    synthetic_sweep,
    values_at,
)
from models.curves import predict_design
from models.response import OutOfRangeError
from models.sensor import FloatArray

#: Name of a press that nobody has made yet.
NEXT = "next"
# Draws by which it is told how far the forward model covers a press, and the share of them that may be beyond.
_DRAWS, _NEARLY_ALL = 64, 0.05
#: How far from zero [m] the crosshead may read where the ball touches: so much less of what is believed of its depth is
#: covered.
TOUCH = 0.1e-3


def sweep_like(wanted: WantedPress) -> Sweep:
    """The sweep of a press that is wanted, with the readings of the one that it is like in the place of its own."""
    name = NEXT if wanted.padding is None else ""
    like = replace(wanted.template, specimen=wanted.specimen, name=name, indenter_radius=wanted.ball)
    like = replace(like, files=(), notes=(), grades=())
    if not wanted.electrical or "capacitance" in like.channels:
        return like
    force = like.channels["force"]
    points = Points(np.ones_like(force.value), force.n_effective, displacement=force.displacement, force=force.value)
    return replace(like, channels={**like.channels, "capacitance": points})


def with_sweep(known: Known, experiment: Experiment, sweep: Sweep) -> Problem:
    """The problem with one more sweep: its unknowns first, then those that the sweep brings.

    Parameters
    ----------
    known : the calibration.
    experiment : with the press.
    sweep : its sweep.
    """
    problem = known.problem
    sweeps = (*problem.sweeps, sweep)
    listed, fixed = list_unknowns(experiment, sweeps)

    def brought(name: UnknownName) -> bool:
        own = name.specimen in ("", sweep.specimen) and name.sweep in ("", sweep.name)
        return own and str(name) not in known.names

    new = tuple(info for info in listed if brought(info.key))
    values = {name: value for name, value in fixed.items() if brought(UnknownName.parse(name))}
    plans = plan_sweeps(sweeps)
    return Problem(experiment, sweeps, problem.forward, (*problem.parameters, *new), {**values, **problem.fixed}, plans)


def middle_with(known: Known, problem: Problem, values: Mapping[str, float]) -> FloatArray:
    """The middle (n_unknown,) of a problem with more unknowns than the calibration.

    Parameters
    ----------
    known : the calibration.
    problem : with one more sweep.
    values : [SI], what the unknowns of that sweep are; others are at their priors' medians, those of a lot like their lot.
    """
    more = []
    for info in problem.parameters[known.middle.size :]:
        own = values.get(info.parameter) if UNKNOWNS[info.parameter].scope == "sweep" else None
        z = 0.0 if own is None else float(info.prior.to_normal(np.array(own)))
        more.append(z if math.isfinite(z) else 0.0)
    for lot in problem.table.lots:  # a new specimen is like its lot
        old = np.flatnonzero(lot.columns < known.middle.size)
        at_middle = columns_at(known.problem, known.middle[None])[0]
        references = [float(lot.prior.at(np.zeros(1), int(s))[0]) for s in range(lot.columns.size)]
        share = float(np.mean([at_middle[lot.columns[s]] / references[s] for s in old])) if old.size else 1.0
        for s, k in enumerate(lot.columns):
            if k >= known.middle.size:
                z = float(problem.parameters[k].prior.to_normal(np.array(share * references[s])))
                more[k - known.middle.size] = z if math.isfinite(z) else 0.0
    return np.concatenate([known.middle, more])


def force_covered(known: Known, stub: Problem, like: Sweep) -> float:
    """Force [N] up to which the forward model covers a press for nearly all draws of the posterior; 0 for none.

    Parameters
    ----------
    known : the calibration.
    stub : the problem with the press, whose readings are still those of another.
    like : its sweep.
    """
    middle = middle_with(known, stub, {})
    z = np.tile(middle, (_DRAWS, 1))
    rows = np.linspace(0, len(known.draws) - 1, _DRAWS).astype(int)
    z[:, : known.middle.size] = known.draws[rows]
    design = specimen_design(stub, values_at(stub, z), like.specimen, like.name)
    reach = predict_design(known.problem.forward, design, np.array([1.0])).reach
    return float(np.quantile(np.nan_to_num(reach), _NEARLY_ALL))


def expected_sweep(known: Known, stub: Problem, like: Sweep, force: float) -> tuple[Sweep, dict[str, float], Measured]:
    """The sweep that is expected of a press at the middle of the posterior.

    Parameters
    ----------
    known, stub, like : as in `force_covered`.
    force : [N], up to which it goes.

    Returns
    -------
    The sweep, where its contact and its zeros are [SI], and what is measured at its end.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover it.
    """
    middle = middle_with(known, stub, {})
    values = values_at(stub, middle[None])
    design = specimen_design(stub, values, like.specimen, like.name).draw(0)
    depth = float(predict_design(known.problem.forward, design, np.array([force])).depth[0, 0])
    if not math.isfinite(depth):
        raise OutOfRangeError(f"the {known.problem.forward.name} does not cover it")

    def value(parameter: str, otherwise: float = 0.0) -> float:
        found = lookup(values, parameter, like.specimen, like.name)
        return otherwise if found is None else float(found[0])

    zeros = {name: value(name) for name in ("contact_offset", "load_zero", "load_step", "clock_offset")}
    if any(
        info.parameter == "contact_offset" and info.origin != "experiment file" for info in stub.parameters[known.middle.size :]
    ):
        zeros["contact_offset"] = TOUCH
    tie = cast(Literal["clock", "force", "displacement", "none"], like.tied_by("capacitance") or "none")
    counts = {name: points.value.size for name, points in like.channels.items()}
    rig = Rig(
        **zeros,
        machine_compliance=value("machine_compliance"),
        parasitic_capacitance=value("parasitic_capacitance"),
        displacement_gain=value("displacement_gain", 1.0),
        force_gain=value("force_gain", 1.0),
        capacitance_gain=value("capacitance_gain", 1.0),
        force_noise=value("force_noise", 5e-3),
        capacitance_noise=value("capacitance_noise", 20e-15),
        speed=_speed(like),
    )
    n_points = max(counts.values())
    made = synthetic_sweep(
        known.problem.forward,
        design,
        depth,
        rig,
        np.random.default_rng(0),
        specimen=like.specimen,
        name=like.name,
        n_points=n_points,
        tie=tie,
        with_force="force" in like.channels,
    )
    # As many independent readings in all as the press that it is like.
    channels = {
        name: replace(points, n_effective=np.full(n_points, np.sum(like.channels[name].n_effective) / n_points))
        for name, points in made.channels.items()
    }
    sd = like.clock_offset_sd if tie == "clock" else math.nan
    sensor, padding = (float(np.asarray(layer.thickness)) for layer in (design.sensor, design.padding))
    electrical = "capacitance" in like.channels
    press = Measured(force, depth, padding, sensor + padding, like.indenter_radius, electrical=electrical)
    return replace(made, channels=channels, clock_offset_sd=sd), zeros, press


def _speed(like: Sweep) -> float:
    """Speed of the crosshead [m/s]; of no matter where nothing is tied by time."""
    if like.track is None or like.track.time.size < 2:
        return Rig().speed
    top = int(np.argmax(like.track.displacement))
    start = int(np.argmin(like.track.displacement[: top + 1]))
    elapsed = float(like.track.time[top] - like.track.time[start])
    way = float(like.track.displacement[top] - like.track.displacement[start])
    return way / elapsed if elapsed > 0 and way > 0 else Rig().speed
