"""From a surrogate, a design and depths to the derivatives of force and capacitance by everything the design is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from models.response import OutOfRangeError
from models.sensor import VACUUM_PERMITTIVITY, Design, FloatArray
from models.surrogate.coordinates import electric_features
from models.surrogate.domain import groups_from
from models.surrogate.groups import GROUPS, Values
from models.surrogate.shapes import FIRST_TOUCH
from models.surrogate.surrogate import Surrogate


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives by parameter name, in SI: [N] and [F] per unit of the parameter, of the shape of the response's arrays.

    `indentation` is among the names. A parameter that is zero (no padding) has the derivative zero here. What all designs of
    the family have alike (no friction) is not among them: the surrogate does not know what becomes of it elsewhere.
    """

    force: dict[str, FloatArray]
    capacitance: dict[str, FloatArray]


def gradients(surrogate: Surrogate, design: Design, depth: FloatArray) -> Gradients:
    """Differentiate force and capacitance with respect to every parameter and to the indentation, to rounding.

    By complex steps (Squire & Trapp, SIAM Rev. 40 (1998) 110) through closed forms, networks and polynomials.

    Parameters
    ----------
    surrogate : whose curves they are.
    design : one, or a batch of draws; its parameters are taken as independent of each other, given or not.
    depth : [m], shape (n_depth,) or (n_draw, n_depth).

    Returns
    -------
    By parameter, arrays of shape (n_depth,) for one design, (n_draw, n_depth) for a batch.

    Raises
    ------
    OutOfRangeError
        If the surrogate does not cover the design or a depth.
    """
    if why := surrogate.outside(design, depth):
        raise OutOfRangeError(why)
    own = {group.parameter: group.step for group in surrogate.family.own}
    elsewhere = {group.parameter for group in GROUPS} - {*own}
    values = {k: np.asarray(v, dtype=float) for k, v in design.draws().parameters().items() if k not in elsewhere}
    n_draw = values["indenter_radius"].size
    depths = np.broadcast_to(np.asarray(depth, dtype=float), (n_draw, np.shape(depth)[-1]))
    force: dict[str, FloatArray] = {}
    capacitance: dict[str, FloatArray] = {}
    # Each step in units of what it changes: a padding of nothing has no modulus to change.
    sizes = values | {name: np.full(n_draw, step) for name, step in own.items()}
    for name in (*values, "indentation"):
        size = depths if name == "indentation" else np.broadcast_to(sizes[name][:, None], depths.shape)
        moved = values if name == "indentation" else values | {name: values[name] + 1e-30j * sizes[name]}
        f, c = _dimensional(surrogate, moved, depths + (1e-30j * depths if name == "indentation" else 0j))
        for found, into in ((f, force), (c, capacitance)):
            into[name] = np.divide(np.imag(found) / 1e-30, size, out=np.zeros(depths.shape), where=size > 0)
    if not design.is_batch:
        force, capacitance = ({k: v[0] for k, v in d.items()} for d in (force, capacitance))
    return Gradients(force, capacitance)


def _dimensional(surrogate: Surrogate, values: Mapping[str, Values], depth: Values) -> tuple[Values, Values]:
    """Force [N] and capacitance [F] (n_draw, n_depth) in complex arithmetic."""
    radius = values["indenter_radius"][:, None]
    groups = groups_from(values, surrogate.family).astype(complex)
    touching = np.real(depth) > 0
    features = electric_features(groups)
    over_radius = np.where(touching, depth / radius, FIRST_TOUCH)
    shapes = surrogate.shapes(groups, features)
    at = shapes.places(over_radius)
    area = np.pi * values["electrode_radius"] ** 2
    c0 = 2 * VACUUM_PERMITTIVITY * values["relative_permittivity"] * area / values["dielectric_thickness"]
    force = values["young_modulus"][:, None] / 3 * radius**2 * np.where(touching, shapes.force(at), 0.0)
    return force, c0[:, None] * (1 + np.where(touching, shapes.change(at), 0.0))
