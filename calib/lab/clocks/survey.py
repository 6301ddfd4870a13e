"""From the two records to the ranges of offsets at which the whole log fits the crosshead's motion, the best first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calib.lab.clocks.records import CrossheadRecord, MeterRecord
from calib.lab.stretches import stretches
from models.sensor import FloatArray

# Alternatives whose misfit is below this many times the best one's are not excluded: models of creep and hysteresis are rough.
_MISFIT_RATIO = 2.0
# What noise alone makes of it is known and counts once, but for chance: so many of its standard deviations.
_BY_CHANCE = 4.0


@dataclass(frozen=True)
class OffsetRange:
    """Neighbouring offsets of the clocks [s] that all fit the log: the best of them, and from where to where they reach."""

    value: float
    low: float
    high: float

    @property
    def width(self) -> float:
        """How far the range reaches from its lower to its upper end [s]."""
        return self.high - self.low


def survey(meter: MeterRecord, tester: CrossheadRecord, low: float, high: float) -> list[OffsetRange]:
    """Look through all possible offsets for those at which the whole log fits about as well as at the best.

    Two misfits count: that of the readings within the tester's record, as a function of its displacement, and that of those
    outside, where nothing is known to have moved, as a constant. Cycles that the record does not hold are the same misfit at
    each offset of a whole period, so that these remain alternatives. What noise alone makes of the misfit within is the same
    wherever the log lies, and makes no alternative of what fits far worse than it does.

    Parameters
    ----------
    meter, tester : the two records.
    low, high : [s], between which the offset lies.

    Returns
    -------
    Ranges of offsets that lie further apart than the survey resolves, the best first; one at least.
    """
    shortest = min(tester.duration, max(tester.end - tester.leave, 1e-9))
    step = max(shortest / 60, (high - low) / 1500)
    grid = low + np.arange(0.0, high - low + step, step)
    misfit = _misfit(meter, tester)
    rising = True
    sums = np.array([misfit(g, True) for g in grid])
    total = np.sum(sums[:, :2], axis=1)
    if np.min(total) > 0.5 * np.max(total):
        other = np.sum([misfit(g, False)[:2] for g in grid], axis=1)
        if np.min(other) < 0.5 * np.min(total):
            rising, total = False, other
    # The grid may step over a sharp minimum: look closer at the lowest of them.
    lows = [i for i in range(grid.size) if total[i] == np.min(total[max(i - 1, 0) : i + 2])]
    lows = sorted(lows, key=lambda i: total[i])[:25]
    near = np.concatenate([grid[i] + step * np.linspace(-1, 1, 21) for i in lows])
    fine = np.unique(np.concatenate([grid, near[(near >= low) & (near <= high)]]))
    sums = np.array([misfit(g, rising) for g in fine])
    total = np.sum(sums[:, :2], axis=1)
    least = int(np.argmin(total))
    within, outside, _ = sums[least]
    variance = (meter.noise / meter.change) ** 2
    slack = _MISFIT_RATIO * float(within) + 30 * variance
    fits = (sums[:, 0] <= slack) & (sums[:, 1] <= 1.2 * outside + slack)
    shape = sums[:, 0] - sums[:, 2] * variance
    by_chance = _BY_CHANCE * np.sqrt(2 * sums[:, 2]) * variance
    as_well = shape <= _MISFIT_RATIO * max(float(shape[least]), 0.0) + 30 * variance + by_chance
    ranges = []
    for b, e in stretches(fits):
        k = b + int(np.argmin(total[b:e]))
        if np.any(as_well[b:e]):
            ranges.append((float(total[k]), OffsetRange(float(fine[k]), float(fine[b]), float(fine[e - 1]))))
    ranges.sort(key=lambda a: a[0])
    best = ranges[0][1]
    # Two dips on one slope are one range: alternatives are those that lie further off than the survey resolves.
    apart = max(0.05 * shortest, 4 * meter.interval, 2 * step)
    return [best, *(a for _, a in ranges[1:] if max(a.low - best.high, best.low - a.high) > apart)]


def _misfit(meter: MeterRecord, tester: CrossheadRecord) -> Callable[[float, bool], tuple[float, float, int]]:
    """A function of an offset and of whether the capacitance rises in contact.

    It gives the misfits within and outside the record, and of how many groups of readings that within is.
    """
    groups = np.array_split(np.arange(meter.time.size), min(meter.time.size, 700))
    t, c = (np.array([v[g].mean() for g in groups]) for v in (meter.time, meter.capacitance))
    root = np.sqrt(np.array([g.size for g in groups], dtype=float))
    y: FloatArray = (c - np.average(c, weights=root**2)) / meter.change
    low, high = (float(q) for q in np.quantile(y, [0.05, 0.95]))

    def misfit(offset: float, rising: bool) -> tuple[float, float, int]:
        at = t + offset
        inside = (at >= tester.time[0]) & (at <= tester.time[-1])
        rest = low if rising else high
        outside = float(np.sum((root * (y - rest))[~inside] ** 2))
        target = (root * y)[inside]
        x = np.interp(at[inside], tester.time, tester.displacement)
        back = np.interp(at[inside], tester.time, tester.back)
        v = np.clip((x - tester.contact) / tester.depth, 0.0, 1.1)
        bulge = back * v * (1 - v)
        basis = np.stack([np.ones_like(v), v, v**2, v**3, bulge, bulge * v], axis=1) * root[inside, None]
        a = np.linalg.solve(basis.T @ basis + 1e-6 * t.size * np.eye(6), basis.T @ target)
        residual = target - basis @ a
        if (a[1] + a[2] + a[3] < 0) == rising:
            residual = (root * (y - rest))[inside]
        return float(residual @ residual), outside, residual.size

    return misfit
