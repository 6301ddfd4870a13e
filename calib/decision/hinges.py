"""A calibration and what may be built of it in, the few directions of the unknowns that its margins hang on out.

Margins m_l of a specification (`calib.decision.performance`), without what scatters, are differentiated at the middle of the
posterior: for every limit l, some thicknesses h of the padding, and every specimen s. Of these slopes, each weighted by the
share w_lh of draws in which that limit is the nearest at that thickness, the principal directions

    T = G^T (z - z_0),   G = H v,   H = [sqrt(w_lh) dm_lhs/dz],   v the leading right singular vectors of Z H,              (1)

Z draws of the posterior, hold nearly all that the unknowns do to the margins. Under partial pooling the lot's values are more
coordinates, as in `calib.decision.target`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.catalogue import SCALES
from calib.checks import Member
from calib.decision.known import Known
from calib.decision.performance import ElectrodeGroup, Errors, pressed
from calib.decision.sensors import ModelDraws, NoiseDraws
from calib.decision.target import all_as_lot, slopes_at_middle
from calib.decision.trials import Tried
from calib.experiment import Specification
from calib.priors import Prior
from calib.problem import coordinates_of, specimen_design
from calib.sampling import Posterior
from models.sensor import BoolArray, FloatArray

# Sensors that may be built, of those that are tried, and thicknesses of each, at which margins are differentiated.
_SENSORS, _THICKNESSES = 3, 5
# Directions are kept until they hold this share of what the unknowns do, and no more of them than this.
_KEPT, _MOST = 0.99, 3


@dataclass(frozen=True, eq=False)
class Hinges:
    """What the margins of a specification hang on.

    Attributes
    ----------
    directions : G of (1), (n_state, n_direction).
    draws : T - T_0 of (1), (n_draw, n_direction), of the draws whose sensors were tried.
    there : (n_draw,), whether the draw has coordinates.
    """

    directions: FloatArray
    draws: FloatArray
    there: BoolArray


def hinges_of(
    posterior: Posterior, known: Known, specification: Specification, tried: Sequence[Tried], values: Mapping[str, FloatArray]
) -> Hinges:
    """Find the directions of the unknowns that margins hang on, and where draws lie along them.

    Parameters
    ----------
    posterior : of the calibration, of one model.
    known : the same.
    specification : what is asked.
    tried : sensors that may be built, that which is advised first.
    values : the posterior's draws that these are made of, by name, SI (n_draw,).

    Returns
    -------
    No direction at all where no margin hangs on an unknown, such as that of a height alone without any thickness unknown.
    """
    states = _states(known, values)
    there = np.all(np.isfinite(states), axis=1)
    away = np.where(there[:, None], states - np.mean(states[there], axis=0), 0.0)
    plain = _without_scatter(specification)
    rows = [row for one in tried[:_SENSORS] for row in _weighted_slopes(posterior, known, plain, one)]
    n_state = states.shape[1]
    h = np.stack(rows, axis=1) if rows else np.zeros((n_state, 0))
    h[: known.middle.size][[p.parameter in SCALES for p in known.problem.parameters]] = 0.0
    _, size, v = np.linalg.svd(away[there] @ h, full_matrices=False)
    if not size.size or not size[0] > 0:
        return Hinges(np.zeros((n_state, 0)), np.zeros((len(states), 0)), there)
    held = np.cumsum(size**2) / np.sum(size**2)
    n = min(_MOST, 1 + int(np.argmax(held >= _KEPT)))
    directions = h @ v[:n].T
    return Hinges(directions, away @ directions, there)


def _states(known: Known, values: Mapping[str, FloatArray]) -> FloatArray:
    """Coordinates of draws: z of the unknowns, then mu of each quantity of a lot, (n_draw, n_state)."""
    z = coordinates_of(known.problem, np.stack([values[name] for name in known.problem.names], axis=1))
    means = [lot.prior.away_of(values[lot.quantity]) for lot in known.problem.table.lots]
    return np.concatenate([z, *(mean[:, None] for mean in means)], axis=1)


def _without_scatter(s: Specification) -> Specification:
    """The specification of what is built as it was wanted, under loads and balls as they are in the middle."""
    force = (float(s.force.ppf_normal(0.0)), s.largest_force) if isinstance(s.force, Prior) else s.force
    ball = s.ball
    if isinstance(ball, Prior):
        middle = float(ball.ppf_normal(0.0))
        ball = (1 / middle if s.by_curvature else middle,)
    materials = tuple(
        replace(
            m, young_modulus=float(m.young_modulus.ppf_normal(0.0)) if isinstance(m.young_modulus, Prior) else m.young_modulus
        )
        for m in s.materials
    )
    return replace(
        s,
        force=force,
        ball=ball,
        by_curvature=False,
        materials=materials,
        padding_tolerance=None,
        sensor_tolerance=None,
        dielectric_tolerance=None,
        electrode_tolerance=None,
        modulus_spread=0.0,
        permittivity_spread=0.0,
    )


def _weighted_slopes(posterior: Posterior, known: Known, s: Specification, tried: Tried) -> list[FloatArray]:
    """Columns of H of (1), (n_state,) each, of one sensor that may be built; those that are not known are left out."""
    choice = tried.choice
    if choice.material is not None:
        choice = replace(choice, material=next(m for m in s.materials if m.name == choice.material.name))
    covered = np.flatnonzero(tried.built.covered)
    at = np.unique(covered[np.linspace(0, covered.size - 1, min(covered.size, _THICKNESSES)).round().astype(int)])
    at = np.union1d(at, [tried.at])
    grid = np.linspace(s.lower, s.upper, s.steps)
    specimens = tuple(dict.fromkeys((sweep.specimen, sweep.name) for sweep in known.problem.sweeps))
    first = dict(reversed(specimens))
    member = Member("", posterior, known.problem.forward, 1.0)

    def margins(values: Mapping[str, FloatArray]) -> FloatArray:
        """(n_draw, n_specimen, n_thickness, n_limit + 1): of the limits, and how far the load is carried."""
        of_lot = all_as_lot(values, known.problem.table.lots)
        found = []
        for specimen, sweep in first.items():
            design = specimen_design(posterior, of_lot, specimen, sweep).draws()
            n = int(np.size(design.sensor.thickness))
            noise = of_lot.get("capacitance_noise", np.full(n, np.nan))
            part = ModelDraws(member, design, NoiseDraws(np.broadcast_to(noise, (n,)), np.zeros(n), np.zeros(n)))
            group = pressed(part, s, [choice], {})
            if not isinstance(group, ElectrodeGroup):
                return np.full((n, len(first), at.size, len(s.limits) + 1), np.nan)
            exact = Errors(*(np.zeros((n, grid.size)) for _ in range(3)))
            each = [next(group.at(float(grid[k]), exact, int(k))) for k in at]
            found.append(np.stack([np.column_stack([one.margins, one.reach]) for one in each], axis=1))
        return np.stack(found, axis=1)

    with np.errstate(invalid="ignore"):
        slopes = slopes_at_middle(known, margins)
    nearest = np.where(tried.reach < 0, len(s.limits), np.argmin(tried.margins, axis=2))
    rows = []
    for j, k in enumerate(at):
        for limit in range(len(s.limits) + 1):
            weight = float(np.mean(nearest[:, k] == limit))
            for specimen in range(len(first)):
                column = slopes[:, specimen, j, limit]
                if weight > 0 and np.all(np.isfinite(column)):
                    rows.append(np.sqrt(weight) * column)
    return rows
