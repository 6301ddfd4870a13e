"""Draws of a posterior in, the same draws of a specimen that nobody has measured out: of its lot, with layers of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.catalogue import UnknownName, spread_of, unknowns_of
from calib.problem.lots import Lot
from calib.problem.unknowns import ParameterInfo
from models.sensor import BoolArray, FloatArray

# How often a specimen that cannot be is drawn again.
_AGAIN = 100


def as_next_specimen(values: Mapping[str, FloatArray], lots: Sequence[Lot], rng: np.random.Generator) -> dict[str, FloatArray]:
    """Give every specimen what is pooled of the next one of their lot, drawn from the lot's value and spread of each quantity.

    Parameters
    ----------
    values : draws by name, SI (n_draw,), fixed ones included, with values and spreads of the lot.
    lots : the quantities that are pooled.
    rng : of the specimen.

    Returns
    -------
    Draws by name, in which every specimen is the next one, meant to be like it: the same one if all were meant to be alike.

    Raises
    ------
    ValueError
        If hardly a specimen of the lot could be, as two dielectrics do not fit into its sensor.
    """
    of_next = dict(values)
    names = {name: UnknownName.parse(name) for name in values}
    again = np.ones(next(iter(values.values())).size, dtype=bool)
    for _ in range(_AGAIN):
        for lot in lots:
            value, spread = values[lot.quantity], values[spread_of(lot.quantity)]
            own = [name for name, key in names.items() if key.parameter == lot.quantity and key.specimen]
            away = spread * rng.standard_normal(value.size)
            for k, name in enumerate(own):
                of_next[name] = np.where(again, lot.prior.another(value, away, k), of_next[name])
        again = _impossible(of_next)
        if not np.any(again):
            return of_next
    raise ValueError("two dielectrics do not fit into a sensor of this lot: check the priors of their thicknesses and spreads")


def _impossible(values: Mapping[str, FloatArray]) -> BoolArray:
    """Draws in which the two dielectrics of a specimen are thicker than its sensor, (n_draw,)."""
    found = np.zeros(next(iter(values.values())).size, dtype=bool)
    for name, dielectric in values.items():
        key = UnknownName.parse(name)
        if key.parameter == "dielectric_thickness" and key.specimen:
            found |= dielectric > values[str(UnknownName("sensor_thickness", key.specimen))] / 2
    return found


def padding_about_mean(values: Mapping[str, FloatArray], of_next: Mapping[str, FloatArray], lots: Sequence[Lot]) -> FloatArray:
    """How thick the padding of the next specimen comes out, over what comes out on average where the same is wanted, (n_draw,).

    Parameters
    ----------
    values, of_next, lots : into and out of `as_next_specimen`.
    """
    for lot in lots:
        if lot.quantity == "padding_thickness":
            first = next(n for n in of_next if (key := UnknownName.parse(n)).parameter == lot.quantity and key.specimen)
            return np.asarray(of_next[first] / values[lot.quantity], dtype=float)
    return np.ones(next(iter(values.values())).size)


def as_unmeasured_specimen(
    values: Mapping[str, FloatArray], parameters: Sequence[ParameterInfo], rng: np.random.Generator
) -> dict[str, FloatArray]:
    """Give every specimen the layers of one that nobody has measured: what was believed of its own before the data.

    Parameters
    ----------
    values : draws by name, SI (n_draw,), fixed ones included.
    parameters : the unknowns with their priors.
    rng : of the specimen.

    Returns
    -------
    Draws by name, in which thicknesses, and whatever else each specimen has of its own, are drawn from its priors; what a prior
    fixes stays.
    """
    n_draw = next(iter(values.values())).size
    own = [p for p in parameters if p.specimen and not p.sweep and p.parameter in unknowns_of("specimen")]
    return {**values, **{p.name: p.prior.ppf_normal(rng.standard_normal(n_draw)) for p in own}}
