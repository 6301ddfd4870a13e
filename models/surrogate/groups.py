"""The dimensionless groups that some families have beyond geometry and the ratio of moduli: their coordinates and ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from models.sensor import INCOMPRESSIBLE

#: Real, or complex where a derivative is taken by a complex step.
Values = npt.NDArray[Any]


@dataclass(frozen=True)
class Group:
    """A dimensionless group beyond geometry and the ratio of moduli: what a family may have as one unknown more.

    Attributes
    ----------
    parameter : its name among `models.sensor.PARAMETERS`.
    name : of the coordinate in which the networks see it.
    coordinate : from values of the parameter, smooth and finite for all; 0 where the parameter is `plain`.
    value : from the coordinate to the parameter.
    end : largest coordinate covered.
    most : largest that there is to learn from.
    plain : value of the parameter in families without this group.
    plain_words : what has it.
    step : of the parameter, that counts as much.
    """

    parameter: str
    name: str
    coordinate: Callable[[Values], Values] = field(compare=False)  # a partial one is another after pickling
    value: Callable[[Values], Values] = field(compare=False)
    end: float
    most: float
    plain: float
    plain_words: str
    step: float


def _same(values: Values) -> Values:
    return values


#: Friction at which a ball is about half way from one that slides to one that sticks: of thin hard paddings somewhat more, of
#: thick ones less (`docs/surrogate.md`).
FRICTION_SCALE = 0.4


def _saturating(values: Values, scale: float) -> Values:
    # Beyond fifty scales it is 1 to the last digit, and infinity has no complex step.
    most = 50 * scale
    return np.asarray(np.tanh(np.where(np.real(values) < most, values, most) / scale))


def _saturated(coordinate: Values, scale: float) -> Values:
    with np.errstate(divide="ignore"):
        return np.asarray(scale * np.arctanh(coordinate))


#: Friction on the base at which the paper's sensor is about three quarters of the way from a slippery base to a bonded one.
BASE_FRICTION_SCALE = 1.2
# Largest covered, and largest learnt from: beyond, there may be two answers on thin soft padding (`docs/finite_elements.md`).
_BASE_FRICTION = float(np.tanh(1.0 / BASE_FRICTION_SCALE))
_MOST_BASE_FRICTION = float(np.tanh(1.1 / BASE_FRICTION_SCALE))

#: What a padding lacks to incompressible, 1 - 2 nu, at which it is about half way from incompressible to a ratio of 0.
_COMPRESSIBLE = 0.2


def _from_poisson_ratio(values: Values) -> Values:
    lack = 1 - 2 * values
    return np.asarray(lack * (1 + _COMPRESSIBLE) / (lack + _COMPRESSIBLE))


def _to_poisson_ratio(coordinate: Values) -> Values:
    lack = coordinate * _COMPRESSIBLE / (1 + _COMPRESSIBLE - coordinate)
    return np.asarray(np.maximum((1 - lack) / 2, 0.0))


#: 1/J_m of Gent's law. Silicones have a J_m of 10 and more.
STIFFENING = Group("stiffening", "1/J_m", _same, _same, 0.1, np.inf, 0.0, "neo-Hookean layers", 0.1)
#: Coulomb's friction f at the ball, from none to a ball that sticks, f = inf.
FRICTION = Group(
    "friction_coefficient",
    f"tanh(f/{FRICTION_SCALE:g})",
    partial(_saturating, scale=FRICTION_SCALE),
    partial(_saturated, scale=FRICTION_SCALE),
    1.0,
    1.0,
    0.0,
    "frictionless contact",
    FRICTION_SCALE,
)
#: Poisson's ratio of the padding, from 0.5 down to 0.
POISSON_RATIO = Group(
    "padding_poisson_ratio",
    "1.2 (1-2ν_p)/(1.2-2ν_p)",
    _from_poisson_ratio,
    _to_poisson_ratio,
    1.0,
    1.0,
    INCOMPRESSIBLE,
    "incompressible padding",
    0.1,
)
#: Coulomb's friction f_b of the padding on its base, from none to 1.
BASE_FRICTION = Group(
    "base_friction_coefficient",
    f"tanh(f_b/{BASE_FRICTION_SCALE:g})",
    partial(_saturating, scale=BASE_FRICTION_SCALE),
    partial(_saturated, scale=BASE_FRICTION_SCALE),
    _BASE_FRICTION,
    _MOST_BASE_FRICTION,
    0.0,
    "a base without friction",
    BASE_FRICTION_SCALE,
)
#: All there are.
GROUPS = (STIFFENING, FRICTION, POISSON_RATIO, BASE_FRICTION)
