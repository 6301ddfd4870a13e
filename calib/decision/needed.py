"""A sensor in draws that was tried in, what stands in its way, and on its drawing, out."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtri

from calib.decision.conformity import Needed
from calib.decision.guard_band import Drawing, crossings, inspected, open_at_nothing, risks
from calib.decision.trials import Tried
from calib.experiment import Limit, Specification
from models.sensor import FloatArray

# Pads over which risks are averaged.
_N_PAD = 2001


def needed_for(best: Tried, grid: FloatArray, s: Specification, n_effective: int) -> tuple[tuple[Needed, ...], float]:
    """What each limit alone would have to be, and by which share all of them together, for the probability asked for.

    Parameters
    ----------
    best : the sensor that is advised. If it conforms, limits are tightened at its best thickness, else eased at any.
    grid : [m], (n_thickness,).
    s : the specification.
    n_effective : how many independent draws they are worth.

    Returns
    -------
    The limits that would do alone, the least change first, and the share for all together at the advised thickness; infinite
    if none would do there.
    """
    covered = np.flatnonzero(best.built.covered)
    n = len(best.worst)
    count = math.ceil(s.probability * n - 1e-9)
    # Where the quantile may lie as well, by a standard error of its probability.
    more = math.ceil(n * math.sqrt(s.probability * (1 - s.probability) / n_effective))
    columns = covered if best.built.best_probability < s.probability else np.array([best.at])
    found = []
    for index, limit in enumerate(s.limits):
        own = best.margins[:, columns, index]
        others = np.delete(best.margins[:, columns], index, axis=2)
        free = (best.reach[:, columns] >= 0) & np.all(others >= 0, axis=2)
        # The count-th largest margin among draws that keep all else: what must be given way to.
        ordered = -np.sort(-np.where(free, own, -np.inf), axis=0)
        level = ordered[count - 1]
        k = int(np.argmax(level))
        if not math.isfinite(level[k]):
            continue
        value = _at_level(limit, float(level[k]))
        if 0 < value < math.inf and level[k] != 0:
            beside = [_at_level(limit, float(ordered[j, k])) for j in (max(count - 1 - more, 0), min(count - 1 + more, n - 1))]
            error = max(abs(one - value) for one in beside if math.isfinite(one))
            found.append((abs(float(level[k])), Needed(index, value, error, float(grid[columns[k]]))))
    smallest = np.where(best.reach[:, best.at] >= 0, np.min(best.margins[:, best.at], axis=1), -np.inf)
    return tuple(n for _, n in sorted(found, key=lambda pair: pair[0])), float(np.sort(-smallest)[count - 1])


def _at_level(limit: Limit, level: float) -> float:
    """What a limit would be [SI] that a margin of this level just keeps; infinite where none would."""
    if not level > -1:
        return math.inf
    if limit.side == "at_least":
        return limit.value * (1 + level)
    return limit.value * (1 - level) if level >= 0 else limit.value / (1 + level)


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
    made = s.padding_tolerance.pads(nominal, z)
    within = None if accepted is None else open_at_nothing(accepted)
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
