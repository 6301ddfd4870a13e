"""From a surrogate to curves that it says itself, beside which its networks can go on learning without forgetting them."""

from __future__ import annotations

import numpy as np

from models.sensor import FloatArray
from models.surrogate.coordinates import electric_features
from models.surrogate.domain import COMPRESSION, PATH, inside
from models.surrogate.points import design_points
from models.surrogate.surrogate import Surrogate
from models.surrogate.training import DIELECTRIC_POINTS, ELECTRODE_POINTS, N_ELECTRIC, TrainingSet, electric_groups

# Designs whose curves are asked for together, each with all electrodes.
_TOGETHER = 64
# Of the rows of `electric_groups` one of each design.
_FIRST = slice(None, None, N_ELECTRIC)


def recalled_curves(surrogate: Surrogate, n: int, seed: int) -> TrainingSet:
    """Curves that a surrogate says, at points between those of new paths, as if they were paths.

    Networks that go on learning from paths of one corner of the range alone lose what they knew of all others; beside curves
    that they said before they keep it (rehearsal; A. Robins, Connection Science 7 (1995) 123).

    Parameters
    ----------
    surrogate : asked.
    n : points all over its range and a little beyond; those beyond are left out.
    seed : of the points.

    Returns
    -------
    Curves to the largest depth that it covers; nothing is known of how layers are thinned along them.
    """
    points = design_points(n, seed, surrogate.family)
    points = points[inside(electric_groups(points)[_FIRST], surrogate.family)]
    parts = [_curves(surrogate, some) for some in np.array_split(points, max(1, len(points) // _TOGETHER))]
    depth, force, radius, change = (np.concatenate(same) for same in zip(*parts, strict=True))
    unknown = np.full(depth.shape, COMPRESSION)
    return TrainingSet(
        groups=points,
        depth=depth,
        force=force,
        contact_radius=radius,
        compression=unknown,
        thinning=np.repeat(unknown[:, :, None], DIELECTRIC_POINTS.size, axis=2),
        capacitance=change,
        failures=("",) * len(points),
        accuracy=np.nan,
        family=surrogate.family,
    )


def _curves(surrogate: Surrogate, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Depth, force and contact radius (n, n_depth), change of all electrodes (n, n_depth, n_dielectric, n_electrode)."""
    groups = electric_groups(points)
    shapes = surrogate.shapes(groups, electric_features(groups))
    at = shapes.places(shapes.limit[:, None] * PATH**2)
    change = shapes.change(at).reshape(len(points), DIELECTRIC_POINTS.size, ELECTRODE_POINTS.size, PATH.size)
    return at.depth[_FIRST], shapes.force(at)[_FIRST], shapes.contact_radius(at)[_FIRST], np.moveaxis(change, 3, 1)
