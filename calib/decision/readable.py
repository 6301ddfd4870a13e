"""Draws of the unknowns in, batches of designs out, with what a reading of them needs that is no part of a design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.decision.gripper import Gripper
from calib.problem import Calibrated, Lot, ParameterInfo, as_next_specimen, as_unmeasured_specimen, lookup, specimen_design
from models.response import Forward
from models.sensor import BoolArray, Design, FloatArray, design_from


@dataclass(frozen=True, eq=False)
class SensorDraws:
    """What a sensor may be like, by the draws of one model: arrays (n_draw,), SI.

    Attributes
    ----------
    forward : the model of these draws.
    design : a batch.
    noise : [F], standard deviation of one reading.
    parasitic : [F], what leads add to every reading.
    force_discrepancy, capacitance_discrepancy : [1].
    """

    forward: Forward
    design: Design
    noise: FloatArray
    parasitic: FloatArray
    force_discrepancy: FloatArray
    capacitance_discrepancy: FloatArray

    def on(self, padding: float) -> SensorDraws:
        """The same sensors on padding of another thickness [m]."""
        thickness = np.full(self.noise.size, padding)
        return replace(self, design=replace(self.design, padding=replace(self.design.padding, thickness=thickness)))


def measured_sensor(
    known: Calibrated,
    forward: Forward,
    values: Mapping[str, FloatArray],
    specimen: str,
    gripper: Gripper,
    rng: np.random.Generator,
) -> SensorDraws:
    """A specimen as its own data leave it.

    Parameters
    ----------
    known : the experiment and its sweeps.
    forward : the model that predicts.
    values : name -> SI values (n_draw,), fixed ones included.
    specimen : which one.
    gripper : what reads it.
    rng : of the gripper's leads.
    """
    return _drawn(forward, specimen_design(known, values, specimen).draws(), known, values, specimen, gripper, rng)


def next_sensor(
    known: Calibrated,
    forward: Forward,
    values: Mapping[str, FloatArray],
    parameters: Sequence[ParameterInfo],
    lots: Sequence[Lot],
    gripper: Gripper,
    rng: np.random.Generator,
) -> SensorDraws:
    """One more specimen of the same lot that nobody has measured: of the lot's material, with thicknesses as believed before.

    What is pooled is drawn from the lot's value and spread instead. Each draw is made like one of
    the specimens, picked at random; draws that are no sensor, as a dielectric thicker than half of it, are left out.

    Parameters
    ----------
    known, forward, values, gripper : as in `measured_sensor`.
    parameters : the unknowns with their priors.
    lots : the quantities that are pooled.
    rng : of the specimen.
    """
    pooled = {lot.quantity for lot in lots}
    values = as_unmeasured_specimen(values, [p for p in parameters if p.parameter not in pooled], rng)
    if lots:
        values = as_next_specimen(values, lots, rng)
    specimens = known.experiment.specimens
    n_draw = next(iter(values.values())).size
    turn = rng.permutation(np.arange(n_draw) % len(specimens))
    parts = []
    for k, specimen in enumerate(specimens):
        own = _sensible({name: column[turn == k] for name, column in values.items()}, specimen.name)
        if next(iter(own.values())).size:
            parts.append(measured_sensor(known, forward, own, specimen.name, gripper, rng))
    return _joined(parts, known)


def _sensible(values: Mapping[str, FloatArray], specimen: str) -> dict[str, FloatArray]:
    """The draws whose layers are those of a sensor."""
    good: BoolArray = np.ones(next(iter(values.values())).shape, dtype=bool)
    found = {name: lookup(values, name, specimen) for name in ("sensor_thickness", "padding_thickness", "dielectric_thickness")}
    for name, column in found.items():
        if column is not None:
            good &= (column >= 0) if name == "padding_thickness" else (column > 0)
    total, dielectric = found["sensor_thickness"], found["dielectric_thickness"]
    if total is not None and dielectric is not None:
        good &= dielectric <= total / 2
    return {name: column[good] for name, column in values.items()}


def _joined(parts: Sequence[SensorDraws], known: Calibrated) -> SensorDraws:
    """The draws of several specimens as those of one sensor."""
    designs = [part.design.parameters() for part in parts]
    whole = {name: np.concatenate([np.asarray(design[name]) for design in designs]) for name in designs[0]}
    columns = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("noise", "parasitic", "force_discrepancy", "capacitance_discrepancy")
    }
    return SensorDraws(parts[0].forward, design_from(whole, base=known.experiment.base), **columns)


def _drawn(
    forward: Forward,
    design: Design,
    known: Calibrated,
    values: Mapping[str, FloatArray],
    specimen: str,
    gripper: Gripper,
    rng: np.random.Generator,
) -> SensorDraws:
    n_draw = np.size(design.sensor.thickness)
    sweep = known.experiment.specimens[[s.name for s in known.experiment.specimens].index(specimen)].sweeps[0].name

    def column(name: str) -> FloatArray:
        found = lookup(values, name, specimen, sweep)
        return np.zeros(n_draw) if found is None else found

    leads = column("parasitic_capacitance")
    if gripper.parasitic is not None:
        mean, sd = gripper.parasitic
        leads = np.maximum(mean + sd * rng.standard_normal(n_draw), 0.0)
    return SensorDraws(
        forward,
        design,
        column("capacitance_noise") if gripper.noise is None else np.full(n_draw, gripper.noise),
        leads,
        column("force_discrepancy"),
        column("capacitance_discrepancy"),
    )
