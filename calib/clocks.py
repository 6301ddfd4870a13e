"""From the records of two instruments to the offset of their clocks, with its standard deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.instruments import IntArray
from calib.observations import BACKWARD, Observations, usable_rows
from calib.readings import excursion, reading_noise, reversals
from calib.reduction import find_onset, integrated_time
from models.sensor import FloatArray

#: Share of the capacitance change by which it may creep while the crosshead stands (sd), in the estimate of the clock offset.
CREEP = 0.003


def clock_offset(tester: Observations, lcr: Observations) -> tuple[float, float, list[str]]:
    """Clock of the tester minus clock of the LCR meter [s], its sd, and notes.

    The capacitance around the turning point is a smooth function of displacement on either side of it; the kinks where the
    crosshead stops and starts again tell the offset. Loading and unloading have functions of their own, so hysteresis does
    not. Without a record beyond the turning point only the onset of contact tells, far less sharply.
    """
    assert lcr.time is not None
    assert lcr.capacitance is not None
    rows = usable_rows(lcr, lcr.time, lcr.capacitance, "capacitance")
    t, c = lcr.time[rows], lcr.capacitance[rows]
    time, displacement, force, of_row = record(tester)
    begin, top = loading_window(tester)
    peak = float(np.max(displacement[(time >= begin) & (time <= top)]))
    length = peak - float(np.interp(begin, time, displacement))
    unloading = np.array([tester.branch[r] == "unloading" for r in of_row.tolist()], dtype=bool)
    falling = np.flatnonzero((time > top) & unloading)
    leave = float(time[falling[0]]) if falling.size else float(time[-1])
    away = excursion(c)
    noise = reading_noise(c)
    turn = float(np.sign(away[np.argmax(np.abs(away))]) or 1.0)
    rise = turn * away
    if float(np.max(rise)) < 10 * noise:
        sd = float(t[-1] - t[0]) / 4
        return begin - float(t[0]), sd, ["the capacitance hardly changes: the clock offset is not known from the data"]
    turns = reversals(rise, max(0.1 * float(np.max(rise)), 6 * noise))
    crest = next((b for b in turns[1:] if rise[b] >= 0.5 * np.max(rise)), int(np.argmax(rise)))
    falls = bool(np.any(rise[crest:] < rise[crest] - max(0.1 * rise[crest], 6 * noise)))
    interval = max(float(np.median(np.diff(t))), 1e-3)
    if not falling.size or not falls:
        return _offset_from_onset(tester, t, c, interval)
    x_on = find_onset(displacement[time <= top], force[time <= top])
    fit = _OffsetFit(
        time, displacement, min(x_on, peak - 0.2 * length), peak, top, leave, noise / (CREEP * float(np.max(rise)))
    )
    middle = (top + leave) / 2 - float(t[crest])
    reach = max(3.0, leave - top + 1.0, 10 * interval, 0.05 * (top - begin))
    # Until the record ends; beyond it the crosshead is taken as where it was last, for this first search only.
    whole = t <= float(t[crest]) + float(time[-1]) - leave + reach
    coarse = fit.search(t[whole], c[whole], middle, reach, max(interval / 2, reach / 150))
    found: list[tuple[float, float]] = []
    for share, degree in ((0.3, 3), (0.2, 2), (0.45, 3), (0.3, 2)):
        window = _around_top(time, displacement, peak - share * length, top, leave, 15 * interval)
        result = fit.refine(t, c, coarse, interval, window, degree)
        if result is not None:
            found.append(result)
    if not found:
        return _offset_from_onset(tester, t, c, interval)
    values = np.array([f[0] for f in found])
    # Spread between the fits: what the choice of window and function does. A meter averages over up to one interval, and
    # stamps its begin or its end.
    spread = float(np.max(values) - np.min(values)) / 2
    sd = float(np.sqrt(found[0][1] ** 2 + spread**2 + (0.4 * interval) ** 2))
    note = f"clock offset from the turning point: {values[0]:.3f} s, sd {sd:.3f} s"
    return float(values[0]), sd, [note]


def loading_window(tester: Observations) -> tuple[float, float]:
    assert tester.time is not None
    times = tester.time[tester.used & np.isfinite(tester.time)]
    return float(times[0]), float(times[-1])


def record(tester: Observations) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Time (strictly increasing), displacement and force of the tester up to the end of the first unloading, and the rows."""
    assert tester.time is not None
    assert tester.displacement is not None
    assert tester.force is not None
    finite = np.isfinite(tester.time) & np.isfinite(tester.displacement) & np.isfinite(tester.force)
    sound = np.array([not r for r in tester.table.reasons], dtype=bool) & np.array([r != BACKWARD for r in tester.reason])
    rows = np.flatnonzero(finite & sound & (tester.cycle <= tester.used_cycle))
    time = tester.time[rows]
    ahead = np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0])
    rows = rows[ahead]
    return tester.time[rows], tester.displacement[rows], tester.force[rows], rows


def _around_top(time: FloatArray, x: FloatArray, low: float, top: float, leave: float, least: float) -> tuple[float, float]:
    """Times on either side of the turning point where the crosshead is down at `low`, at least `least` seconds away."""
    below = np.flatnonzero((x < low) & (time < top))
    after = np.flatnonzero((x < low) & (time > leave))
    begin = float(time[below[-1] if below.size else 0])
    end = float(time[after[0] if after.size else -1])
    return max(min(begin, top - least), float(time[0])), min(max(end, leave + least), float(time[-1]))


@dataclass(frozen=True, eq=False)
class _OffsetFit:
    """Least squares of the capacitance as a smooth function of displacement on either side of the turning point.

    Functions of u = (peak - max(x, onset)) / (peak - onset): a polynomial for loading, one for unloading, equal at the top
    but for a creep during the hold, which a prior of sd `CREEP` holds small.
    """

    time: FloatArray
    displacement: FloatArray
    onset: float
    peak: float
    top: float
    leave: float
    creep_stiffness: float

    def residual(self, t: FloatArray, c: FloatArray, offset: float, up_degree: int, down_degree: int) -> FloatArray:
        on_tester = t + offset
        x = np.interp(on_tester, self.time, self.displacement)
        u = (self.peak - np.maximum(x, self.onset)) / (self.peak - self.onset)
        middle = (self.top + self.leave) / 2
        up = np.where(on_tester <= middle, u, 0.0)
        down = np.where(on_tester > middle, u, 0.0)
        columns = [np.ones_like(u), *(up**k for k in range(1, up_degree + 1)), *(down**k for k in range(1, down_degree + 1))]
        prior = np.zeros((0, len(columns)))
        if self.leave - self.top > 0.2:
            columns.append(np.clip((on_tester - self.top) / (self.leave - self.top), 0.0, 1.0))
            prior = np.zeros((1, len(columns)))
            prior[0, -1] = self.creep_stiffness
        basis = np.vstack([np.stack(columns, axis=1), prior])
        target = np.concatenate([c, np.zeros(prior.shape[0])])
        return np.asarray(target - basis @ np.linalg.lstsq(basis, target, rcond=None)[0])

    def search(self, t: FloatArray, c: FloatArray, middle: float, reach: float, step: float) -> float:
        """The offset within `reach` of `middle` that fits best."""
        scaled = (c - c.mean()) / max(float(np.std(c)), 1e-300)
        grid = middle + np.arange(-reach, reach + step / 2, step)
        return float(grid[np.argmin([np.sum(self.residual(t, scaled, g, 3, 3) ** 2) for g in grid])])

    def refine(
        self, t: FloatArray, c: FloatArray, coarse: float, interval: float, window: tuple[float, float], degree: int
    ) -> tuple[float, float] | None:
        """Offset near `coarse` and its sd from the readings in a window around the turning point; None if they do not tell."""
        half = 2 * interval
        best = coarse
        for _ in range(12):
            # The same readings for every offset, so that the sum of squares is one smooth function of it.
            inside = (t + best >= window[0]) & (t + best <= window[1])
            ti, ci = t[inside], c[inside]
            up, down = int(np.sum(ti + best < self.top)), int(np.sum(ti + best > self.leave))
            degrees = min(degree, up // 5), min(degree, down // 5)
            free = sum(degrees) + 3
            if min(degrees) < 1 or ti.size < free + 4:
                return None
            ci = (ci - ci.mean()) / max(float(np.std(ci)), 1e-300)
            fine = best + np.linspace(-half, half, 33)
            sums = np.array([float(np.sum(self.residual(ti, ci, g, *degrees) ** 2)) for g in fine])
            k = int(np.argmin(sums))
            if 4 <= k <= fine.size - 5:
                break
            best = float(fine[k])
        else:
            return None
        # All offsets that the readings do not tell apart, and at least some of the grid, make the parabola.
        variance = float(sums[k]) / (ti.size - free - 2) * integrated_time(self.residual(ti, ci, float(fine[k]), *degrees))
        near = (sums - sums[k] <= 4 * variance) | (np.abs(np.arange(fine.size) - k) <= 6)
        a, b, _ = np.polyfit(fine[near] - fine[k], sums[near], 2)
        if a <= 0:
            return None
        step = float(np.clip(-b / (2 * a), -half, half))
        return float(fine[k]) + step, float(np.sqrt(variance / a))


def _offset_from_onset(tester: Observations, t: FloatArray, c: FloatArray, interval: float) -> tuple[float, float, list[str]]:
    assert tester.time is not None
    assert tester.force is not None
    rows = tester.used & np.isfinite(tester.time) & np.isfinite(tester.force)
    on_tester, on_lcr = find_onset(tester.time[rows], tester.force[rows]), find_onset(t, c)
    begin, end = loading_window(tester)
    # Force and capacitance leave their flat parts with different powers of the depth: some per cent of the branch.
    sd = float(np.hypot(0.03 * (end - begin), interval))
    note = f"clock offset from the onset only, no record beyond the turning point: {on_tester - on_lcr:.2f} s, sd {sd:.2f} s"
    return on_tester - on_lcr, sd, [note]
