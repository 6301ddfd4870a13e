"""Draws of a posterior of a lot in, the same draws of a specimen of that lot that nobody has measured out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calib.catalogue import POOLED, SPREAD, UnknownName
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
