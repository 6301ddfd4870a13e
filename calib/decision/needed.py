"""A sensor in draws that was tried in, what stands in its way, and on its drawing, out."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtri

from calib.decision.conformity import Needed
from calib.decision.guard_band import Drawing, crossings, inspected, risks
from calib.decision.trials import Tried
from calib.experiment import Specification
from models.sensor import FloatArray

# Pads over which risks are averaged.
_N_PAD = 2001


def needed_for(best: Tried, grid: FloatArray, s: Specification) -> tuple[tuple[Needed, ...], float]:
    """What each limit alone would have to be, and by which share all of them together, for the probability asked for.

    Parameters
    ----------
    best : the sensor that is advised. If it conforms, limits are tightened at its best thickness, else eased at any.
    grid : [m], (n_thickness,).
    s : the specification.

    Returns
    -------
    The limits that would do alone, the least change first, and the share for all together; infinite if none would do.
    """
    covered = np.flatnonzero(best.built.covered)
    count = math.ceil(s.probability * len(best.worst) - 1e-9)
    columns = covered if best.built.best_probability < s.probability else np.array([best.at])
    found = []
    for index, limit in enumerate(s.limits):
        own = best.margins[:, columns, index]
        others = np.delete(best.margins[:, columns], index, axis=2)
        free = (best.reach[:, columns] >= 0) & np.all(others >= 0, axis=2)
        # The count-th largest margin among draws that keep all else: what must be given way to.
        level = -np.sort(-np.where(free, own, -np.inf), axis=0)[count - 1]
        k = int(np.argmax(level))
        if not math.isfinite(level[k]):
            continue
        value = limit.value * (1 + level[k] if limit.side == "at_least" else 1 - level[k])
        if value > 0 and level[k] != 0:
            found.append((abs(float(level[k])), Needed(index, float(value), float(grid[columns[k]]))))
    smallest = np.where(best.reach[:, columns] >= 0, np.min(best.margins[:, columns], axis=2), -np.inf)
    together = -np.sort(-smallest, axis=0)[count - 1]
    return tuple(n for _, n in sorted(found, key=lambda pair: pair[0])), -float(np.max(together))


def drawing_of(best: Tried, grid: FloatArray, s: Specification) -> Drawing | None:
    """Tolerance, guard bands and risks of the advised pads.

    Parameters
    ----------
    best : the sensor that is advised.
    grid : [m], (n_thickness,).
    s : the specification.

    Returns
    -------
    None where it does not conform with the probability asked for.
    """
    tolerance = crossings(grid, best.built.exact, s.probability, best.at)
    if tolerance is None or best.built.best_probability < s.probability:
        return None
    known = grid[np.isfinite(best.built.exact)]
    open_below = tolerance[0] <= known[0] and known[0] > 0
    open_above = tolerance[1] >= known[-1]
    accepted, w = inspected(tolerance, s.gauge, s.guard_band)
    nominal, nan = float(grid[best.at]), math.nan
    if s.padding_tolerance is None:
        return Drawing(nominal, tolerance, accepted, w, open_below, open_above, nan, nan, nan, nan)
    z = ndtri((np.arange(_N_PAD) + 0.5) / _N_PAD)
    made = s.padding_tolerance.pads(nominal, z) if nominal > 0 else np.zeros(_N_PAD)
    # Where the range begins at no padding no reading is too small.
    within = None if accepted is None else (accepted[0] if accepted[0] > 0 else -math.inf, accepted[1])
    found = risks(made, np.interp(made, best.pads, best.pads_conform), within, s.gauge)
    delivered = found.consumers / found.accepted if found.accepted > 0 else nan
    return Drawing(
        nominal,
        tolerance,
        accepted,
        w,
        open_below,
        open_above,
        found.accepted,
        found.consumers,
        found.producers,
        delivered,
    )
