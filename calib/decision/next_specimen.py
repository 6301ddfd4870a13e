"""Draws of a posterior in, the same draws of a specimen that nobody has measured out: of its lot, with layers of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.catalogue import POOLED, SPREAD, UnknownName, unknowns_of
from calib.problem import ParameterInfo
from models.sensor import FloatArray


def as_next_specimen(values: Mapping[str, FloatArray], rng: np.random.Generator) -> dict[str, FloatArray]:
    """Give every specimen the modulus of the next one of their lot: L exp(tau z), z standard normal, one for each draw.

    Parameters
    ----------
    values : draws by name, SI (n_draw,), fixed ones included, with the lot's modulus L and its spread tau.
    rng : of the specimen.

    Returns
    -------
    Draws by name, in which the modulus is that of the next specimen, whatever the specimen that it is named for.
    """
    modulus = values[POOLED] * np.exp(values[SPREAD] * rng.standard_normal(values[POOLED].size))
    return {**values, **{name: modulus for name in values if UnknownName.parse(name).parameter == POOLED}}


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
