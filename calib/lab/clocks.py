"""From the records of two instruments to the offset of their clocks: its value, its errors, and whether the data tell it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from calib.lab.instruments import IntArray
from calib.lab.observations import BACKWARD, Observations, usable_rows
from calib.lab.reduction import integrated_time
from calib.lab.signal import ahead, excursion, quiet, reading_noise, resolution, reversals
from models.sensor import FloatArray

Confidence = Literal["clear", "weak", "ambiguous"]
_Estimate = tuple[float, float]

#: Share of the capacitance change by which it may creep after the crosshead stops (sd, of each rate), and times [s] of creep.
CREEP, CREEP_TIMES = 0.007, (0.3, 1.0, 3.0, 10.0, 30.0)
#: Sd of the loading function's Taylor coefficients around the turning point, in capacitance changes over depths.
CURVE = 2.0
#: The same for the difference between unloading and loading, and the share of the change by which capacitance may step where
#: the crosshead leaves: hardly any hysteresis, as much as there may be, and that with friction that turns round.
RETURN = ((0.03, 1e-6), (0.5, 1e-6), (0.5, 0.01))
#: Share of the depth on either side of the turning point in which the capacitance is taken as such a function.
WINDOW = 0.5
#: Share of the whole rise up to which a channel is looked at for its onset.
ONSET_SHARE = 0.4
#: Exponents with which force and capacitance may leave their flat parts.
EXPONENTS = (1.2, 1.35, 1.5, 1.65, 1.8, 1.95, 2.1, 2.3, 2.6)
#: Where between two readings of the tester or of the meter something happens is known to this share of the interval (sd).
BETWEEN = 0.02
#: Share of the depth within which force and capacitance leave their flat parts together (sd): roughness, adhesion.
SAME_ONSET = 0.005
#: An offset is clear if it is told within 10 ms, twice this sd [s].
CLEAR_SD = 0.005
#: Alternatives whose misfit is below this many times the best one's are not excluded: models of creep and hysteresis are rough.
MISFIT_RATIO = 2.0


@dataclass(frozen=True)
class ClockOffset:
    """Clock of the tester minus clock of the LCR meter.

    `sd` is what the tie needs: the error of the offset that, added to the meter's stamps, gives the tester's time at the middle
    of each reading. A meter averages over up to one interval and stamps begin or end of that: against its clock proper the
    offset may be off by another `systematic`, which moves no reading along the curve and is therefore not in `sd`.

    Attributes
    ----------
    value, sd : [s]. Where the data do not tell, the middle of what is possible and an sd as wide as that.
    systematic : [s], largest further difference to the clock proper (half an interval, or half the step of coarse stamps).
    confidence : "clear": from the turning point, one solution, told within 10 ms, and the onset does not contradict. "weak":
        less sharp than that, as the press is slow or the noise large; or from the onset only; or the two disagree.
        "ambiguous": the data do not tell.
    turning_point, onset : (value, sd) [s] from either feature alone; None where it does not tell.
    alternatives : [s], offsets that fit about as well, far from `value`; empty unless ambiguous by discrete steps.
    evidence : sentences for the report.
    """

    value: float
    sd: float
    systematic: float
    confidence: Confidence
    turning_point: tuple[float, float] | None
    onset: tuple[float, float] | None
    alternatives: tuple[float, ...]
    evidence: tuple[str, ...]


def clock_offset(tester: Observations, lcr: Observations, within: tuple[float, float] | None = None) -> ClockOffset:
    """The offset of the two clocks from the used cycle of the tester's record and the whole log of the meter.

    A survey of all possible offsets fits the whole log as a function of the crosshead's reading, one curve for loading and one
    for unloading; offsets far apart that fit about as well make the answer ambiguous. Around the best, the turning point tells
    the offset: the log is a smooth function of the reading on either side of it, with creep after the crosshead stops, all
    coefficients integrated over (normal priors), so that hysteresis and creep widen the sd but do not shift the value. The
    onset of contact, seen in force and in capacitance, tells it again, less sharply, and is compared.

    Parameters
    ----------
    tester : with time, displacement and force. lcr : with time and capacitance.
    within : [s], the range in which the offset is known to lie, None for any; it can decide between alternatives.

    Assumptions: both clocks run at the same rate; capacitance grows with compression (unless only the opposite fits); stamps
    keep the same distance to the middle of their readings. Range: loading in more than ten intervals of the meter.

    Measured on 500 random pairs (tester of 20-100 Hz, meter of 5-50 readings/s and 2-10 fF, change of 2-4 pF, with and without
    hold, hysteresis and creep), |error| median and 95 %: 10 and 47 ms from 0.5 to 2 mm/min, 3 and 17 ms from 2 to 10 mm/min, 1
    and 7 ms from there to 0.75 mm/s; within two stated sd in 97 of 100, within three in 99; within 10 ms in all whose stated sd
    is below 4 ms. A capacitance that jumps by a per cent or more where the crosshead leaves looks like another offset.

    Alternatives by discrete steps are not averaged: no normal prior between two periods is honest, so `make_sweep` refuses them
    unless `within` decides. An offset that is merely unknown gets an sd as wide as what is possible, as its prior.

    Raises
    ------
    InputError
        If the log has fewer than five readings.
    """
    assert lcr.time is not None
    assert lcr.capacitance is not None
    rows = usable_rows(lcr, lcr.time, lcr.capacitance, "capacitance")
    rows = rows[ahead(lcr.time[rows])]
    log = _Log.of(lcr.time[rows], lcr.capacitance[rows])
    pressing = _Pressing.of(tester)
    low, high = float(pressing.time[0] - log.time[-1]), float(pressing.time[-1] - log.time[0])
    if within is not None:
        low, high = max(low, within[0]), min(high, within[1])
    if high <= low:
        why = "no offset in the range given lets the log overlap the tester's record"
        low, high = within or (low, high)
        return _unknown(log, low, high, (), why)
    if log.change < 10 * log.noise or log.change == 0.0:
        why = f"the capacitance changes by {log.change * 1e15:.3g} fF, its noise is {log.noise * 1e15:.3g} fF"
        together = float(np.clip(pressing.time[0] - log.time[0], low, high))
        return _unknown(log, low, high, (), why, together)
    if not pressing.returns:
        return _from_loading_only(log, pressing, low, high)
    areas = _survey(log, pressing, low, high)
    best = areas[0]
    if len(areas) > 1:
        return _several(log, pressing, areas)
    turning = _turning_point(log, pressing, best)
    centre, reach = (turning[0], 0.25 * pressing.duration) if turning else (best.value, 0.5 * pressing.duration + best.width)
    onset = _onset_offset(log, pressing, centre, reach)
    return _combined(log, pressing, best, turning, onset)


def loading_window(tester: Observations) -> tuple[float, float]:
    """Times [s] between which the used loading branch lies."""
    assert tester.time is not None
    times = tester.time[tester.used & np.isfinite(tester.time)]
    return float(times[0]), float(times[-1])


def record(tester: Observations, *, whole: bool = False) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Time (strictly increasing), displacement and force of the tester, and the rows, up to the end of the used cycle."""
    assert tester.time is not None
    assert tester.displacement is not None
    assert tester.force is not None
    finite = np.isfinite(tester.time) & np.isfinite(tester.displacement) & np.isfinite(tester.force)
    sound = np.array([not r for r in tester.table.reasons], dtype=bool) & np.array([r != BACKWARD for r in tester.reason])
    rows = np.flatnonzero(finite & sound & (whole | (tester.cycle <= tester.used_cycle)))
    rows = rows[ahead(tester.time[rows])]
    return tester.time[rows], tester.displacement[rows], tester.force[rows], rows


# --- what the two records hold -------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Log:
    """The meter's readings with their noise, their largest change, and the interval between them."""

    time: FloatArray
    capacitance: FloatArray
    noise: float
    change: float
    interval: float
    systematic: float

    @classmethod
    def of(cls, time: FloatArray, capacitance: FloatArray) -> _Log:
        steps = np.diff(time)
        interval = max(float(np.median(steps)) if steps.size else 0.0, 1e-4)
        change = float(np.max(np.abs(excursion(capacitance))))
        noise = max(reading_noise(capacitance), 1e-5 * change)
        stamp = resolution(time - np.floor(time[0]))
        return cls(time, capacitance, noise, change, interval, 0.5 * max(interval, stamp))


@dataclass(frozen=True, eq=False)
class _Pressing:
    """The tester's whole record and what its used cycle looks like.

    begin, top, leave, end : [s], start and end of the loading branch, end of the hold, end of the unloading.
    contact, contact_sd, peak : [m], crosshead readings. back : per node 1 on an unloading branch, else 0.
    """

    time: FloatArray
    displacement: FloatArray
    back: FloatArray
    begin: float
    top: float
    leave: float
    end: float
    peak: float
    contact: float
    contact_sd: float
    returns: bool

    @property
    def duration(self) -> float:
        return self.top - self.begin

    @property
    def depth(self) -> float:
        return self.peak - self.contact

    @property
    def interval(self) -> float:
        return float(np.median(np.diff(self.time)))

    @property
    def creep_times(self) -> FloatArray:
        """Times [s] of `CREEP_TIMES` that the record after the top can hold."""
        after = self.end - self.top
        return np.array([t for t in CREEP_TIMES if t < after] or [0.35 * after])

    @classmethod
    def of(cls, tester: Observations) -> _Pressing:
        time, displacement, _, rows = record(tester, whole=True)
        begin, top = loading_window(tester)
        cycle = tester.cycle[rows]
        branch = np.array([tester.branch[r] for r in rows.tolist()], dtype=object)
        back = (branch == "unloading").astype(float)
        # A hold keeps the branch before it.
        known = np.maximum.accumulate(np.where(branch == "hold", 0, np.arange(branch.size)))
        back = back[known]
        falling = np.flatnonzero((time > top) & (branch == "unloading") & (cycle == tester.used_cycle))
        leave = float(time[falling[0]]) if falling.size else float(time[-1])
        end = float(time[falling[-1]]) if falling.size else float(time[-1])
        loading = (time >= begin) & (time <= top)
        peak = float(np.max(displacement[loading]))
        contact, contact_sd = _onset_of_force(tester)
        lowest = float(np.min(displacement[falling])) if falling.size else peak
        returns = falling.size >= 5 and peak - lowest > 0.1 * (peak - contact)
        if returns:
            corners = _corners(time, displacement, top, leave, peak - contact)
            if corners is not None:
                (top, leave), peak = corners
                keep = (time < top) | (time > leave)
                at = int(np.searchsorted(time[keep], top))
                time = np.insert(time[keep], at, [top, leave] if leave > top else [top])
                displacement = np.insert(displacement[keep], at, peak if leave <= top else [peak, peak])
                back = np.insert(back[keep], at, 0.0 if leave <= top else [0.0, 0.0])
                time, displacement, back = _quiet(time, displacement, back, [(begin, top), (leave, end)])
        return cls(time, displacement, back, begin, top, leave, end, peak, contact, contact_sd, returns)


def _quiet(
    time: FloatArray, x: FloatArray, back: FloatArray, stretches: Sequence[tuple[float, float]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The record with the noise of its displacement averaged out over a twentieth of each stretch, stamps alike.

    The capacitance follows the crosshead, not the noise of its reading, which would make the fit rough in the offset.
    """
    time, x = time.copy(), x.copy()
    for start, stop in stretches:
        rows = np.flatnonzero((time > start) & (time < stop))
        time[rows], x[rows] = quiet(time[rows], x[rows], rows.size // 20)
    kept = ahead(time)
    return time[kept], x[kept], back[kept]


def _corners(
    time: FloatArray, x: FloatArray, top: float, leave: float, depth: float
) -> tuple[tuple[float, float], float] | None:
    """When the crosshead stops and when it leaves [s], and where it stands [m], between the tester's readings.

    From straight lines through the readings before and after and the level between them; without a hold, where the lines meet.
    None if there are too few readings for lines.
    """
    noise = reading_noise(x)
    between = x[(time >= top) & (time <= leave)]
    level = float(np.median(between)) if between.size >= 10 else float(np.max(between))
    clear = level - 3 * noise - 0.002 * depth
    lines = []
    for side in (np.flatnonzero((time <= top) & (x < clear))[::-1], np.flatnonzero((time >= leave) & (x < clear))):
        near = side[: max(4, int(np.sum(x[side] > level - 0.05 * depth)))]
        if near.size < 3 or np.ptp(time[near]) == 0:
            return None
        middle = float(np.mean(time[near]))
        slope, height = np.polyfit(time[near] - middle, x[near], 1)
        lines.append((float(slope), float(height) - float(slope) * middle))
    (up, up0), (down, down0) = lines
    if up <= 0 or down >= 0:
        return None
    meet = (down0 - up0) / (up - down)
    height = up * meet + up0
    nearest = int(np.argmin(np.abs(time - meet)))
    expected = height - max(up * (meet - time[nearest]), down * (meet - time[nearest]))
    if leave - top < 3 * float(np.median(np.diff(time))) and abs(expected - x[nearest]) < 4 * noise + 0.003 * depth:
        return (meet, meet), height
    stops, leaves = (level - up0) / up, (level - down0) / down
    return ((stops, leaves), level) if leaves > stops else ((meet, meet), height)


# --- the survey ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Area:
    """Offsets [s] that fit: the best of them, and how far they reach."""

    value: float
    low: float
    high: float

    @property
    def width(self) -> float:
        return self.high - self.low


def _survey(log: _Log, pressing: _Pressing, low: float, high: float) -> list[_Area]:
    """Areas of offsets at which the whole log fits about as well as at the best, the best first.

    Two misfits count: that of the readings within the tester's record, as a function of its displacement, and that of those
    outside, where nothing is known to have moved, as a constant. Cycles that the record does not hold are the same misfit at
    each offset of a whole period, so that these remain alternatives.
    """
    shortest = min(pressing.duration, max(pressing.end - pressing.leave, 1e-9))
    groups = np.array_split(np.arange(log.time.size), min(log.time.size, 700))
    t, c = (np.array([v[g].mean() for g in groups]) for v in (log.time, log.capacitance))
    root = np.sqrt(np.array([g.size for g in groups], dtype=float))
    y = (c - np.average(c, weights=root**2)) / log.change
    step = max(shortest / 60, (high - low) / 1500)
    grid = low + np.arange(0.0, high - low + step, step)

    def misfit(offset: float, *, rising: bool) -> tuple[float, float]:
        at = t + offset
        inside = (at >= pressing.time[0]) & (at <= pressing.time[-1])
        rest = float(np.quantile(y, 0.05 if rising else 0.95))
        outside = float(np.sum((root * (y - rest))[~inside] ** 2))
        target = (root * y)[inside]
        x = np.interp(at[inside], pressing.time, pressing.displacement)
        back = np.interp(at[inside], pressing.time, pressing.back)
        v = np.clip((x - pressing.contact) / pressing.depth, 0.0, 1.1)
        bulge = back * v * (1 - v)
        basis = np.stack([np.ones_like(v), v, v**2, v**3, bulge, bulge * v], axis=1) * root[inside, None]
        a = np.linalg.solve(basis.T @ basis + 1e-6 * t.size * np.eye(6), basis.T @ target)
        residual = target - basis @ a
        if (a[1] + a[2] + a[3] < 0) == rising:
            residual = (root * (y - rest))[inside]
        return float(residual @ residual), outside

    rising = True
    sums = np.array([misfit(g, rising=True) for g in grid])
    if np.min(np.sum(sums, axis=1)) > 0.5 * np.max(np.sum(sums, axis=1)):
        other = np.array([misfit(g, rising=False) for g in grid])
        if np.min(np.sum(other, axis=1)) < 0.5 * np.min(np.sum(sums, axis=1)):
            rising, sums = False, other
    # The grid may step over a sharp minimum: look closer at the lowest of them.
    total = np.sum(sums, axis=1)
    lows = [i for i in range(grid.size) if total[i] == np.min(total[max(i - 1, 0) : i + 2])]
    lows = sorted(lows, key=lambda i: total[i])[:25]
    near = np.concatenate([grid[i] + step * np.linspace(-1, 1, 21) for i in lows])
    fine = np.unique(np.concatenate([grid, near[(near >= low) & (near <= high)]]))
    sums = np.array([misfit(g, rising=rising) for g in fine])
    total = np.sum(sums, axis=1)
    within, outside = sums[int(np.argmin(total))]
    slack = MISFIT_RATIO * float(within) + 30 * (log.noise / log.change) ** 2
    fits = (sums[:, 0] <= slack) & (sums[:, 1] <= 1.2 * outside + slack)
    areas = []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fits, [False]]).astype(np.int8)))
    for b, e in zip(edges[::2], edges[1::2], strict=True):
        k = b + int(np.argmin(total[b:e]))
        areas.append((float(total[k]), _Area(float(fine[k]), float(fine[b]), float(fine[e - 1]))))
    areas.sort(key=lambda a: a[0])
    best = areas[0][1]
    # Two dips on one slope are one area: alternatives are those that lie further off than the survey resolves.
    apart = max(0.05 * shortest, 4 * log.interval, 2 * step)
    return [best, *(a for _, a in areas[1:] if max(a.low - best.high, best.low - a.high) > apart)]


# --- the turning point -----------------------------------------------------------------------------------------------------


def _log_evidence(y: FloatArray, basis: FloatArray, prior: FloatArray, noise: float) -> float:
    """Log density, but for a constant, of y = basis a + error with a_k normal of sd `prior` and errors of sd `noise`."""
    scaled = basis * (prior / noise)
    matrix = np.eye(prior.size) + scaled.T @ scaled
    factor = np.linalg.cholesky(matrix)
    half = np.linalg.solve(factor, scaled.T @ (y / noise))
    return float(0.5 * half @ half - np.sum(np.log(np.diag(factor))))


def _turning_basis(t: FloatArray, pressing: _Pressing, degree: int) -> tuple[FloatArray, FloatArray]:
    """Columns of the capacitance around the turning point; of each: level 0, curve 1, hysteresis 2, creep 3, step 4.

    C = C_top + sum a_k u^k + sum h_k u^k (on the way back) + sum c_j (1 - exp(-(t - top) / tau_j)) + a step
    where the crosshead leaves (friction turns round), u = (peak - x) / depth.
    """
    x = np.interp(t, pressing.time, pressing.displacement)
    u = np.clip((pressing.peak - np.maximum(x, pressing.contact)) / pressing.depth, 0.0, 1.0)
    powers = u[:, None] ** np.arange(1, degree + 1)
    back = np.where(t > (pressing.top + pressing.leave) / 2, 1.0, 0.0)[:, None]
    since = np.maximum(t - pressing.top, 0.0)[:, None]
    left = np.where(t > pressing.leave, 1.0, 0.0)[:, None]
    basis = np.hstack([np.ones((t.size, 1)), powers, back * powers, 1 - np.exp(-since / pressing.creep_times), left])
    kind = np.array([0] + [1] * degree + [2] * degree + [3] * pressing.creep_times.size + [4])
    return basis, kind


def _turning_point(log: _Log, pressing: _Pressing, area: _Area) -> tuple[float, float] | None:
    """Offset and sd from the readings around the turning point; None if they do not tell."""
    share, degree = WINDOW, 5
    low = pressing.peak - share * pressing.depth
    time, x = pressing.time, pressing.displacement
    below = np.flatnonzero((x < low) & (time < pressing.top))
    after = np.flatnonzero((x < low) & (time > pressing.leave))
    least = 12 * log.interval
    begin = max(min(float(time[below[-1] if below.size else 0]), pressing.top - least), float(time[0]), pressing.begin)
    stop = min(max(float(time[after[0]]) if after.size else pressing.end, pressing.leave + least), pressing.end)
    best, half = area.value, max(2 * log.interval, 0.5 * area.width, 0.01 * pressing.duration)
    noise = log.noise
    for _ in range(16):
        # The same readings for every offset, so that the evidence is one smooth function of it.
        inside = (log.time + best >= begin) & (log.time + best <= stop)
        t, c = log.time[inside], log.capacitance[inside]
        if int(np.sum(t + best < pressing.top)) < 4 or int(np.sum(t + best > pressing.leave)) < 4:
            return None
        y = (c - c[np.argmax(c)]) / log.change
        fine = best + half * np.linspace(-1, 1, 25)
        scores = np.empty((2 * len(RETURN), fine.size))
        for i, g in enumerate(fine):
            for j, width in enumerate((0.0, log.interval)):
                shifts = width / math.sqrt(12.0) * np.array([-1.0, 1.0]) if width else np.zeros(1)
                parts = [_turning_basis(t + g + s, pressing, degree) for s in shifts]
                basis, kind = np.mean([p[0] for p in parts], axis=0), parts[0][1]
                for k, (hysteresis, jump) in enumerate(RETURN):
                    prior = np.array([1.0, CURVE, hysteresis, CREEP, jump])[kind]
                    scores[len(RETURN) * j + k, i] = _log_evidence(y, basis, prior, noise / log.change)
        weight = np.exp(scores - np.max(scores))
        density = np.sum(weight, axis=0)
        mean = float(np.sum(density * fine) / np.sum(density))
        sd = float(np.sqrt(np.sum(density * (fine - mean) ** 2) / np.sum(density)))
        k = int(np.argmax(density))
        if k < 3 or k > fine.size - 4:
            best = float(fine[k])
            half *= 1.5
            continue
        if sd < half / 8:
            best, half = mean, max(5 * sd, half / 6)
            continue
        if sd > 0.4 * half:
            best, half = mean, 2 * half
            continue
        # The residuals say whether the readings' errors are larger than their noise, or hang together.
        basis, kind = _turning_basis(t + mean, pressing, degree)
        prior = np.array([1.0, CURVE, RETURN[-1][0], CREEP, RETURN[-1][1]])[kind]
        fitted = _fitted(y, basis, prior, noise / log.change)
        residual = y - fitted
        actual = float(np.sqrt(np.mean(residual**2) * integrated_time(residual, 8))) * log.change
        if actual > 1.15 * noise:
            noise, best = actual, mean
            continue
        sd = float(np.linalg.norm([sd, BETWEEN * log.interval, BETWEEN * pressing.interval]))
        return (mean, sd) if sd < 0.2 * pressing.duration else None
    return None


def _fitted(y: FloatArray, basis: FloatArray, prior: FloatArray, noise: float) -> FloatArray:
    scaled = basis * (prior / noise)
    a = np.linalg.solve(np.eye(prior.size) + scaled.T @ scaled, scaled.T @ (y / noise))
    return np.asarray(basis @ (prior * a))


# --- the onset -----------------------------------------------------------------------------------------------------------


def _leaving(depth: Callable[[float], FloatArray], y: FloatArray, noise: float, low: float, high: float) -> _Estimate | None:
    """Posterior mean and sd of g in [low, high] from y = c + w^p (a + b w + d w^2) + error, w = max(depth(g), 0).

    c, a, b, d and the exponent p (of `EXPONENTS`) are integrated over. y and depth are of order one, errors of sd `noise`.
    None if the mean lies at an end of the range: then the readings hold no onset.
    """
    least, most = low, high
    prior = np.array([1.0, 3.0, 3.0, 3.0])
    raised = False
    for _ in range(10):
        grid = np.linspace(least, most, 41)
        scores = np.empty((len(EXPONENTS), grid.size))
        for i, g in enumerate(grid):
            w = np.maximum(depth(float(g)), 0.0)
            for j, p in enumerate(EXPONENTS):
                power = w**p
                scores[j, i] = _log_evidence(
                    y, np.stack([np.ones_like(w), power, power * w, power * w**2], axis=1), prior, noise
                )
        density = np.sum(np.exp(scores - np.max(scores)), axis=0)
        density /= np.sum(density)
        mean = float(density @ grid)
        sd = float(np.sqrt(density @ (grid - mean) ** 2))
        step = float(grid[1] - grid[0])
        if sd < 3 * step:
            reach = max(6 * sd, 4 * step)
            least, most = max(low, mean - reach), min(high, mean + reach)
            continue
        if not raised:
            w = np.maximum(depth(mean), 0.0)
            p = EXPONENTS[int(np.argmax(np.max(scores, axis=1)))]
            residual = y - _fitted(y, np.stack([np.ones_like(w), w**p, w ** (p + 1), w ** (p + 2)], axis=1), prior, noise)
            actual = float(np.sqrt(np.mean(residual**2) * integrated_time(residual, 4)))
            raised = True
            if actual > 1.15 * noise:
                noise, least, most = actual, low, high
                continue
        break
    if mean - low < max(2 * sd, 0.01 * (high - low)) or high - mean < 2 * sd:
        return None
    return mean, sd


def _onset_of_force(tester: Observations) -> tuple[float, float]:
    """Crosshead reading [m] at which the force leaves its flat part, and its sd; the first reading and nan without one."""
    assert tester.displacement is not None
    assert tester.force is not None
    rows = usable_rows(tester, tester.displacement, tester.force, "force")
    x, f = tester.displacement[rows], tester.force[rows]
    rise = np.maximum.accumulate(excursion(f))
    end = int(np.searchsorted(rise, ONSET_SHARE * rise[-1])) + 1
    start = float(x[0])
    if end < 12 or rise[-1] <= 0:
        return start, float("nan")
    groups = np.array_split(np.arange(end), min(end, 300))
    xs, fs = (np.array([v[g].mean() for g in groups]) for v in (x, f))
    length, scale = float(np.ptp(xs)), float(rise[-1])
    if length <= 0:
        return start, float("nan")
    noise = max(reading_noise(f) / np.sqrt(end / len(groups)), 1e-5 * scale)
    y = (fs - fs[0]) / scale
    found = _leaving(lambda g: (xs - g) / length, y, noise / scale, float(xs[0]), float(xs[-1]))
    return (start, float("nan")) if found is None else found


def _onset_offset(log: _Log, pressing: _Pressing, centre: float, reach: float) -> _Estimate | None:
    """The offset within `reach` of `centre` that makes the capacitance leave its flat part where the force does."""
    if not np.isfinite(pressing.contact_sd):
        return None
    on_tester = log.time + centre
    inside = (on_tester > pressing.begin - reach) & (on_tester < pressing.top)
    t, c = log.time[inside], log.capacitance[inside]
    if t.size < 12:
        return None
    rise = np.maximum.accumulate(excursion(c) if np.sum(excursion(c)) > 0 else -excursion(c))
    end = int(np.searchsorted(rise, ONSET_SHARE * rise[-1])) + 1
    if end < 12 or rise[-1] < 10 * log.noise:
        return None
    groups = np.array_split(np.arange(end), min(end, 300))
    ts, cs = (np.array([v[g].mean() for g in groups]) for v in (t, c))
    before = pressing.time <= pressing.top
    time, x = pressing.time[before], pressing.displacement[before]

    def depth(g: float) -> FloatArray:
        return np.asarray((np.interp(ts + g, time, x) - pressing.contact) / pressing.depth)

    noise = max(log.noise / np.sqrt(end / len(groups)), 1e-5 * log.change) / log.change
    low = centre - reach
    high = min(centre + reach, pressing.top - float(ts[-1]))
    found = _leaving(depth, (cs - cs[0]) / log.change, noise, low, high) if high > low else None
    if found is None:
        return None
    # The tester's own onset is not known exactly: its error in time is the error in displacement over the speed there.
    speed = _speed_at_contact(pressing)
    sd = float(np.linalg.norm([found[1], pressing.contact_sd / speed, SAME_ONSET * pressing.depth / speed]))
    return (found[0], sd) if sd < 0.08 * pressing.duration else None


def _speed_at_contact(pressing: _Pressing) -> float:
    loading = (pressing.time >= pressing.begin) & (pressing.time <= pressing.top)
    time, x = pressing.time[loading], np.maximum.accumulate(pressing.displacement[loading])
    near = 0.05 * pressing.depth
    i, j = np.searchsorted(x, [pressing.contact - near, pressing.contact + near])
    i, j = min(int(i), time.size - 2), min(max(int(j), int(i) + 1), time.size - 1)
    return max(float(x[j] - x[i]) / max(float(time[j] - time[i]), 1e-9), 1e-3 * pressing.depth / pressing.duration)


# --- what is concluded ---------------------------------------------------------------------------------------------------


def _unknown(
    log: _Log, low: float, high: float, alternatives: Sequence[float], why: str, value: float | None = None
) -> ClockOffset:
    """No offset can be told between `low` and `high`: the middle or `value`, as wide as a uniform distribution, and why."""
    value = (low + high) / 2 if value is None else value
    sd = max((high - low) / np.sqrt(12.0), abs(value - (low + high) / 2), log.interval)
    said = f"the clock offset is ambiguous: {why}; anything from {low:.3g} to {high:.3g} s is possible"
    return ClockOffset(value, float(sd), log.systematic, "ambiguous", None, None, tuple(alternatives), (said,))


def _several(log: _Log, pressing: _Pressing, areas: Sequence[_Area]) -> ClockOffset:
    """Offsets far apart fit about as well: the best of them, an sd that spans them all, and the others."""
    values = [a.value for a in areas]
    turning = _turning_point(log, pressing, areas[0])
    best = turning[0] if turning else values[0]
    steps = np.diff(np.sort(values))
    periods = [*np.diff(_crests(pressing.displacement, pressing.time)), *np.diff(_crests(log.capacitance, log.time))]
    equal = any(np.all(np.abs(steps / p - np.rint(steps / p)) < 0.05) for p in periods if p > 0)
    what = f"whole periods of {np.min(steps):.3g} s (several equal cycles)" if equal else "separate offsets"
    listed = ", ".join(f"{v:.2f}" for v in sorted(values)[:8])
    said = f"the clock offset is ambiguous by {what}: {listed} s fit the capacitance about equally well"
    sd = max(float(np.std(np.array(values))), turning[1] if turning else 0.0)
    return ClockOffset(best, sd, log.systematic, "ambiguous", turning, None, tuple(values[1:]), (said,))


def _crests(values: FloatArray, time: FloatArray) -> list[float]:
    """Times [s] at which the values turn, or end, after rising by half of their largest excursion."""
    rise = excursion(values)
    rise = rise * np.sign(rise[np.argmax(np.abs(rise))])
    top = float(np.max(rise))
    turns = reversals(rise, max(0.1 * top, 6 * reading_noise(values)))
    return [float(time[b]) for a, b in pairwise(turns) if rise[b] - rise[a] > 0.5 * top]


def _from_loading_only(log: _Log, pressing: _Pressing, low: float, high: float) -> ClockOffset:
    """The tester's record ends at the top: the first rise of the capacitance is its loading, of which the onset tells."""
    crests = _crests(log.capacitance, log.time)
    if len(crests) > 1:
        values = [pressing.top - crest for crest in crests]
        values = [v for v in values if low <= v <= high]
        if len(values) > 1:
            return _several(log, pressing, [_Area(v, v, v) for v in values])
    crest = crests[0] if crests else float(log.time[-1])
    kept = log.time <= crest
    shorter = _Log(log.time[kept], log.capacitance[kept], log.noise, log.change, log.interval, log.systematic)
    middle = pressing.top - crest
    onset = _onset_offset(shorter, pressing, middle, 0.5 * pressing.duration)
    if onset is None:
        # The top of the log lies within the loading branch, no more is known.
        low, high = max(low, pressing.begin - float(shorter.time[0])), min(high, middle)
        return _unknown(log, min(low, high), max(low, high), (), "no turning point in the tester's record and no clear onset")
    said = f"clock offset from the onset only, no record beyond the turning point: {onset[0]:.3f} s, sd {onset[1]:.3f} s"
    return ClockOffset(onset[0], onset[1], log.systematic, "weak", None, onset, (), (said,))


def _combined(log: _Log, pressing: _Pressing, area: _Area, turning: _Estimate | None, onset: _Estimate | None) -> ClockOffset:
    stamps = f"stamps at the beginning or end of a reading move the clock itself by up to {log.systematic:.3f} s, not the tie"
    if turning is None and onset is None:
        both = [np.sum(log.time + area.value < pressing.top), np.sum(log.time + area.value > pressing.leave)]
        if area.width < 0.2 * pressing.duration and min(both) >= 3:
            sd = max(area.width / 2, log.interval / 4)
            said = (
                f"clock offset from a fit of the whole log only, too few readings at the turning point: {area.value:.3f} s, "
                f"sd {sd:.3f} s"
            )
            return ClockOffset(area.value, sd, log.systematic, "weak", None, None, (), (said, stamps))
        why = "no turning point within the log and no clear onset of the capacitance"
        widen = max(0.0, 0.3 * pressing.duration - area.width) / 2
        return _unknown(log, area.low - widen, area.high + widen, (), why)
    if turning is None:
        assert onset is not None
        said = (
            f"clock offset from the onset only, the log does not show the turning point: {onset[0]:.3f} s, sd {onset[1]:.3f} s"
        )
        return ClockOffset(onset[0], onset[1], log.systematic, "weak", None, onset, (), (said, stamps))
    value, sd = turning
    evidence = [f"clock offset from the turning point: {value:.3f} s, sd {sd:.4f} s", stamps]
    sharp = sd <= CLEAR_SD
    agrees = True
    if onset is not None:
        apart = onset[0] - value
        agrees = abs(apart) <= 3 * float(np.hypot(onset[1], sd))
        evidence.append(f"the onset tells {onset[0]:.3f} s, sd {onset[1]:.3f} s: {'agrees' if agrees else 'DISAGREES'}")
        if not agrees:
            sd = abs(apart)
            evidence.append(
                f"onset and turning point disagree by {abs(apart):.3f} s, more than their errors allow (clocks of different "
                f"rate, or a capacitance that leaves its flat part apart from the force): the sd is taken as large as that"
            )
    confidence: Confidence = "clear" if sharp and agrees else "weak"
    if not sharp:
        travel = 2 * sd * _speed_at_contact(pressing)
        evidence.append(
            f"the data do not tell the offset within 10 ms, but within {2 * sd:.2g} s (two sd), in which the crosshead moves "
            f"by {travel * 1e6:.2g} um"
        )
    return ClockOffset(value, sd, log.systematic, confidence, turning, onset, (), tuple(evidence))
