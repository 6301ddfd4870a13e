"""From the observations of tester and meter to the two records whose clocks are compared, and the shape of the used press."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.lab.clocks.way_back import creep_times
from calib.lab.instruments import IntArray
from calib.lab.observations import BACKWARD, Observations, usable_rows
from calib.lab.onset import fine_onset
from calib.lab.signal import excursion, increasing_rows, reading_noise, resolution, smoothed_record
from models.sensor import FloatArray


def loading_window(tester: Observations) -> tuple[float, float]:
    """Find when the loading branch of the first used cycle begins and ends [s], on the tester's clock, used or not."""
    assert tester.time is not None
    times = tester.time[tester.loading & np.isfinite(tester.time)]
    return float(times[0]), float(times[-1])


def record(tester: Observations, *, whole: bool = False) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """What the tester wrote of crosshead and force over time, in rows of strictly increasing time without any that is unsound.

    Parameters
    ----------
    tester : with time, displacement and force.
    whole : whether to go on beyond the end of the last used cycle.

    Returns
    -------
    Time [s], displacement [m], force [N] and the rows in the file, each of shape (n_row,).
    """
    assert tester.time is not None
    assert tester.displacement is not None
    assert tester.force is not None
    finite = np.isfinite(tester.time) & np.isfinite(tester.displacement) & np.isfinite(tester.force)
    sound = np.array([not r for r in tester.table.reasons], dtype=bool) & np.array([r != BACKWARD for r in tester.reason])
    rows = np.flatnonzero(finite & sound & (whole | (tester.cycle <= max(tester.used_cycles, default=0))))
    rows = rows[increasing_rows(tester.time[rows])]
    return tester.time[rows], tester.displacement[rows], tester.force[rows], rows


def beside_tester(tester: Observations, meter: Observations, offset: float) -> Observations:
    """A meter's log with times alone as one that has the crosshead's displacement, and the parts of the press, beside it.

    Parameters
    ----------
    tester : of the same press, with time, displacement and force.
    meter : the log.
    offset : [s], clock of the tester minus clock of the meter.

    Returns
    -------
    The log; where the tester recorded nothing its displacement is nan, and nothing is used.
    """
    assert meter.time is not None
    time, displacement, _, rows = record(tester, whole=True)
    at = meter.time + offset
    there = (at >= time[0]) & (at <= time[-1])
    beside = rows[np.searchsorted(time, np.where(there, at, time[0]))]
    return replace(
        meter,
        displacement=np.where(there, np.interp(at, time, displacement), np.nan),
        branch=tuple(tester.branch[k] if inside else "" for k, inside in zip(beside, there, strict=True)),
        cycle=np.where(there, tester.cycle[beside], 0),
        n_cycle=tester.n_cycle,
        use=tester.use,
        used_cycles=tester.used_cycles,
        loading=there & tester.loading[beside],
        used=there & tester.used[beside] & meter.used,
        reason=tuple(tester.reason[k] if inside else "beside no record" for k, inside in zip(beside, there, strict=True)),
    )


@dataclass(frozen=True, eq=False)
class MeterRecord:
    """The LCR meter's readings of capacitance over its own time, arrays of shape (n,).

    Attributes
    ----------
    time : [s], strictly increasing.
    capacitance : [F].
    noise, change : [F], sd of one reading, and the largest change of the capacitance.
    interval : [s], between readings.
    systematic : [s], how far the stamps may lie from the middle of their readings.
    """

    time: FloatArray
    capacitance: FloatArray
    noise: float
    change: float
    interval: float
    systematic: float

    @classmethod
    def of(cls, lcr: Observations) -> MeterRecord:
        """The whole log of a meter; refused, as `usable_rows` says, if it has fewer than five readings."""
        assert lcr.time is not None
        assert lcr.capacitance is not None
        rows = usable_rows(lcr, lcr.time, lcr.capacitance, "capacitance")
        rows = rows[increasing_rows(lcr.time[rows])]
        time, capacitance = lcr.time[rows], lcr.capacitance[rows]
        steps = np.diff(time)
        interval = max(float(np.median(steps)) if steps.size else 0.0, 1e-4)
        change = float(np.max(np.abs(excursion(capacitance))))
        noise = max(reading_noise(capacitance), 1e-5 * change)
        stamp = resolution(time - np.floor(time[0]))
        return cls(time, capacitance, noise, change, interval, 0.5 * max(interval, stamp))


@dataclass(frozen=True, eq=False)
class CrossheadRecord:
    """The testing machine's whole record of the crosshead, arrays of shape (n,), and what its used press looks like.

    Attributes
    ----------
    time : [s], strictly increasing.
    displacement : [m], crosshead reading.
    back : 1 on an unloading branch, else 0.
    begin, top, leave, end : [s], start and end of the loading branch, end of the hold, end of the unloading.
    peak : [m], crosshead reading at the end of loading.
    contact, contact_sd : [m], crosshead reading at the onset of force; its first reading and nan where it shows none.
    returns : whether the record shows the crosshead on its way back.
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
        """How long the loading takes [s]."""
        return self.top - self.begin

    @property
    def depth(self) -> float:
        """How far the crosshead presses [m]."""
        return self.peak - self.contact

    @property
    def interval(self) -> float:
        """Time [s] between readings."""
        return float(np.median(np.diff(self.time)))

    @property
    def creep_times(self) -> FloatArray:
        """Times [s] in which the capacitance may creep and which the record after the top can hold."""
        return creep_times(self.end - self.top)

    @property
    def speed_at_contact(self) -> float:
        """Speed [m/s] of the crosshead where the force sets in, over a tenth of the depth."""
        loading = (self.time >= self.begin) & (self.time <= self.top)
        time, x = self.time[loading], np.maximum.accumulate(self.displacement[loading])
        near = 0.05 * self.depth
        i, j = np.searchsorted(x, [self.contact - near, self.contact + near])
        i, j = min(int(i), time.size - 2), min(max(int(j), int(i) + 1), time.size - 1)
        return max(float(x[j] - x[i]) / max(float(time[j] - time[i]), 1e-9), 1e-3 * self.depth / self.duration)

    @classmethod
    def of(cls, tester: Observations) -> CrossheadRecord:
        """The record of a tester with time, displacement and force, its corners sharpened and its noise averaged out."""
        time, displacement, _, rows = record(tester, whole=True)
        begin, top = loading_window(tester)
        cycle = tester.cycle[rows]
        branch = np.array([tester.branch[r] for r in rows.tolist()], dtype=object)
        back = (branch == "unloading").astype(float)
        # A hold keeps the branch before it.
        known = np.maximum.accumulate(np.where(branch == "hold", 0, np.arange(branch.size)))
        back = back[known]
        falling = np.flatnonzero((time > top) & (branch == "unloading") & (cycle == tester.used_cycles[0]))
        leave = float(time[falling[0]]) if falling.size else float(time[-1])
        end = float(time[falling[-1]]) if falling.size else float(time[-1])
        loading = (time >= begin) & (time <= top)
        peak = float(np.max(displacement[loading]))
        contact, contact_sd = _contact(tester)
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
                time, displacement, back = _smoothed(time, displacement, back, [(begin, top), (leave, end)])
        return cls(time, displacement, back, begin, top, leave, end, peak, contact, contact_sd, returns)


def _contact(tester: Observations) -> tuple[float, float]:
    """Crosshead reading [m] at which the force leaves its flat part, and its sd; the first reading and nan without one."""
    assert tester.displacement is not None
    assert tester.force is not None
    rows = usable_rows(tester, tester.displacement, tester.force, "force", tester.loading)
    x = tester.displacement[rows]
    return fine_onset(x, tester.force[rows]) or (float(x[0]), float("nan"))


def _smoothed(
    time: FloatArray, x: FloatArray, back: FloatArray, stretches: Sequence[tuple[float, float]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The record with the noise of its displacement averaged out over a twentieth of each stretch, stamps alike.

    The capacitance follows the crosshead, not the noise of its reading, which would make the fit rough in the offset.
    """
    time, x = time.copy(), x.copy()
    for start, stop in stretches:
        rows = np.flatnonzero((time > start) & (time < stop))
        time[rows], x[rows] = smoothed_record(time[rows], x[rows], rows.size // 20)
    kept = increasing_rows(time)
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
