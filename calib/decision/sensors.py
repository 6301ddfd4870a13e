"""Draws of posteriors in, designs of the sensors that an answer is for, those measured or the next of their lot, out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.checks import Member, drawn
from calib.problem import as_next_specimen, lookup, padding_about_mean, specimen_design
from calib.sampling import Posterior
from models.sensor import BoolArray, Design, FloatArray, Scalar, design_from

# Stream of random numbers beside the seed's, for the specimen that was not measured.
_NEXT = 3
# The error of a model is alike for alike designs: its correlation falls off over this factor in total thickness.
_ERROR_FACTOR = 1.5


@dataclass(frozen=True, eq=False)
class NoiseDraws:
    """Draws of what is not part of a design: capacitance noise [F] and discrepancies [1], each (n_draw,)."""

    noise: FloatArray
    force_discrepancy: FloatArray
    capacitance_discrepancy: FloatArray

    def only(self, rows: BoolArray) -> NoiseDraws:
        """Those of some draws."""
        return NoiseDraws(self.noise[rows], self.force_discrepancy[rows], self.capacitance_discrepancy[rows])


@dataclass(frozen=True, eq=False)
class ModelDraws:
    """The draws of one model: a design of each, what is not part of it, and its padding over what was wanted, (n_draw,)."""

    member: Member
    base: Design
    own: NoiseDraws
    cast: FloatArray | None = None  # None: as wanted

    @property
    def size(self) -> int:
        """How many draws."""
        return int(np.size(self.base.sensor.thickness))

    def only(self, rows: BoolArray) -> ModelDraws:
        """Those of some draws."""
        return ModelDraws(
            self.member, self.base.only(rows), self.own.only(rows), None if self.cast is None else self.cast[rows]
        )


@dataclass(frozen=True, eq=False)
class Sensors:
    """Sensors in draws: those that were measured, and those that an answer is for.

    Attributes
    ----------
    measured : sensors like those measured, a part for each model.
    parts : what the answer is for: the same, or under partial pooling the next sensor of the lot.
    of_next : whether it is that.
    values : the posterior's draws that they are made of, by name, SI (n_draw,), for each model.
    """

    measured: tuple[ModelDraws, ...]
    parts: tuple[ModelDraws, ...]
    of_next: bool
    values: tuple[Mapping[str, FloatArray], ...]


def sensors_of(
    models: Sequence[Member], pooling: str, n_draw: int, indenter_radius: float | None, rng: np.random.Generator, seed: int
) -> Sensors:
    """Draw sensors: each draw of a posterior takes the thicknesses of one specimen, picked at random.

    Under partial pooling what is pooled is that of a specimen that was not measured, drawn from lot and spread.

    Parameters
    ----------
    models : of each as many draws as its weight says.
    pooling : of the experiment.
    n_draw : how many in all.
    indenter_radius : [m] of the ball; None for that of the experiment.
    rng : of the choice of draws and specimens.
    seed : of the specimen that was not measured.
    """
    chosen = drawn(models, n_draw, rng)
    measured = tuple(ModelDraws(m, *_like_those_measured(m.posterior, values, indenter_radius, rng)) for m, values in chosen)
    of_models = tuple(values for _, values in chosen)
    if pooling != "partial":
        return Sensors(measured, measured, False, of_models)
    own = np.random.default_rng([seed, _NEXT])
    parts = []
    for member, values in chosen:
        lots = member.posterior.table.lots
        following = as_next_specimen(values, lots, own)
        made = _like_those_measured(member.posterior, following, indenter_radius, own)
        parts.append(ModelDraws(member, *made, padding_about_mean(values, following, lots)))
    return Sensors(measured, tuple(parts), True, of_models)


def _like_those_measured(
    posterior: Posterior, values: Mapping[str, FloatArray], indenter_radius: float | None, rng: np.random.Generator
) -> tuple[Design, NoiseDraws]:
    """Make one design per draw, with the thicknesses of one specimen, and collect the draw's noise and discrepancies."""
    specimens = posterior.experiment.specimens
    n_draw = next(iter(values.values())).size
    turn = rng.permutation(np.arange(n_draw) % len(specimens))
    picked: dict[str, FloatArray] = {}
    carried = {k: np.zeros(n_draw) for k in ("capacitance_noise", "force_discrepancy", "capacitance_discrepancy")}
    for i, specimen in enumerate(specimens):
        sweep = specimen.sweeps[0].name
        design = specimen_design(posterior, values, specimen.name, sweep).draws()
        for name, value in design.parameters().items():
            column = np.broadcast_to(np.asarray(value, dtype=float), (n_draw,))
            picked[name] = np.where(turn == i, column, picked.get(name, column))
        for name in carried:
            known = lookup(values, name, specimen.name, sweep)
            column = np.full(n_draw, np.nan) if known is None else known
            carried[name] = np.where(turn == i, column, carried[name])
    if indenter_radius is not None:
        picked["indenter_radius"] = np.full(n_draw, indenter_radius)
    own = NoiseDraws(
        carried["capacitance_noise"],
        np.nan_to_num(carried["force_discrepancy"]),
        np.nan_to_num(carried["capacitance_discrepancy"]),
    )
    return design_from(picked, base=posterior.experiment.base), own


def with_padding(design: Design, thickness: Scalar) -> Design:
    """The same sensors on padding of another thickness.

    Parameters
    ----------
    design : a batch of draws.
    thickness : [m], one for all or (n_draw,).
    """
    n_draw = np.size(design.sensor.thickness)
    return replace(design, padding=replace(design.padding, thickness=np.broadcast_to(np.asarray(thickness, float), (n_draw,))))


def smooth_normals(total_thickness: FloatArray, n_draw: int, rng: np.random.Generator) -> FloatArray:
    """Draw standard normals that are smooth along thickness, for errors that are alike for alike designs.

    Their correlation is exp(-x^2/2) with x = ln(h_i/h_j) / ln 1.5.

    Parameters
    ----------
    total_thickness : h [m], of sensor and padding, (n_thickness,).
    n_draw : how many functions of it.
    rng : they are drawn with.

    Returns
    -------
    (n_draw, n_thickness).
    """
    x = np.log(np.maximum(total_thickness, 1e-9)) / np.log(_ERROR_FACTOR)
    value, vector = np.linalg.eigh(np.exp(-0.5 * (x[:, None] - x[None, :]) ** 2))
    root = vector * np.sqrt(np.maximum(value, 0.0))
    return np.asarray(rng.standard_normal((n_draw, x.size)) @ root.T, dtype=float)
