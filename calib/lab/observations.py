"""From one lab table to `Observations`: compression positive, branches labelled, a reason at each row that is not used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.ndimage import median_filter

from calib.catalogue import CHANNELS
from calib.errors import Fault, InputError
from calib.lab.instruments import IntArray, LabTable
from calib.lab.signal import excursion, reading_noise, reversals
from models.sensor import BoolArray, FloatArray

UNLOADING = "unloading branch (hysteresis is not modelled)"
HOLD = "hold (crosshead standing still)"
BEFORE = "before the first loading branch"
BACKWARD = "time runs backwards"


@dataclass(frozen=True, eq=False)
class Observations:
    """What was understood of one lab file, row by row: signs, branches, and a reason at each row that is not used.

    `observe` makes one. Compression is positive, nothing is re-zeroed. Arrays of shape (n_row,), None where the file has no
    such column::

        obs = observe(read_lab_file(Path("sensor1_instron.csv")))
        obs.force[obs.used]  # [N], the loading branch

    Attributes
    ----------
    table : what was read.
    time, displacement : [s], [m]; nan where the cell was empty or over-range.
    channels : name of a channel (see `calib.catalogue.CHANNELS`) -> its readings, SI, likewise; those that the file has.
    branch : per row "loading", "unloading", "hold", or "" where neither displacement nor force shows which.
    cycle : per row the loading branch it belongs to or follows, counted from 1; 0 before the first and where none is known.
    n_cycle : loading branches in the file; 0 where none is known.
    used_cycle : the cycle whose loading branch is used; 0 if none is known.
    used : rows that take part in the calibration: the loading branch of the used cycle, from its start before contact.
    reason : per row why it is not used, "" if it is.
    sign_note : which signs were turned, and on what evidence.
    """

    table: LabTable
    time: FloatArray | None
    displacement: FloatArray | None
    channels: Mapping[str, FloatArray]
    branch: tuple[str, ...]
    cycle: IntArray
    n_cycle: int
    used_cycle: int
    used: BoolArray
    reason: tuple[str, ...]
    sign_note: str

    @property
    def force(self) -> FloatArray | None:
        """Load [N], None where the file has no such column."""
        return self.channels.get("force")

    @property
    def capacitance(self) -> FloatArray | None:
        """Capacitance [F], None where the file has no such column."""
        return self.channels.get("capacitance")

    def to_dataframe(self) -> pd.DataFrame:
        """Every row of the file as a table, to look at or to plot.

        Returns
        -------
        SI columns time_s, displacement_m, force_N, capacitance_F (those the file has), and branch, cycle, used, reason.
        """
        named = {"time_s": self.time, "displacement_m": self.displacement}
        named |= {f"{name}_{CHANNELS[name].unit}".rstrip("_"): values for name, values in self.channels.items()}
        frame = pd.DataFrame({name: values for name, values in named.items() if values is not None})
        return frame.assign(branch=list(self.branch), cycle=self.cycle, used=self.used, reason=list(self.reason))


def observe(table: LabTable, cycle: int | None = None) -> Observations:
    """Turn signs so that compression is positive, label the branches, and say which rows are used and why others are not.

    The sign of force is that of its largest excursion from the starting value, the sign of displacement that of its
    excursion where the force is largest (its own largest excursion in a file without force): a ball that is withdrawn
    further than it was pressed does not mislead. Nothing is re-zeroed: load zero and contact point are parameters.
    Branches come from the displacement, or from the force in a file without displacement; a reversal counts from 2 % of
    the range and six times the noise on. A cycle begins with a loading branch that reaches half of the largest excursion:
    a touch before the pressing is none, and a smaller loading later belongs to the cycle that it follows.

    Parameters
    ----------
    table : one lab file, from `read_lab_file`.
    cycle : the loading branch to use, counted from 1; None for the first. The rows of other cycles say which they are of.

    Raises
    ------
    InputError
        If time runs backwards in more than one row of a hundred; if the file does not have the cycle that is asked for.
    """
    good = np.array([not r for r in table.reasons], dtype=bool)
    raw = {name: table.columns.get(name) for name in ("time", "displacement", *CHANNELS)}
    time = raw["time"]
    reasons = list(table.reasons)
    if time is not None:
        _mark_backward_time(table, time, good, reasons)
    signs, sign_note = _signs(raw["displacement"], raw["force"], good)
    displacement = None if raw["displacement"] is None else raw["displacement"] * signs["displacement"]
    channels = {name: values for name in CHANNELS if (values := raw[name]) is not None}
    if "force" in channels:
        channels["force"] = channels["force"] * signs["force"]
    force = channels.get("force")
    driver = displacement if displacement is not None else force
    n = len(reasons)
    branch = np.full(n, "", dtype=object)
    cycles, n_cycle, used_cycle = np.zeros(n, dtype=np.int64), 0, 0
    if driver is not None:
        rows = np.flatnonzero(good & np.isfinite(driver))
        if rows.size >= 2:
            clock = None if time is None else time[rows]
            labels, cycles[rows], repeats = _branches(driver[rows], clock, standstill=displacement is not None)
            n_cycle = int(np.max(cycles))
            used_cycle = min(cycle or 1, n_cycle)
            branch[rows] = labels
            for row, label, repeat in zip(rows.tolist(), labels.tolist(), repeats.tolist(), strict=True):
                reasons[row] = _why_not(label, int(cycles[row]), used_cycle, repeat=repeat)
        for row in np.flatnonzero(good & ~np.isfinite(driver)).tolist():
            reasons[row] = reasons[row] or "no displacement reading"
    if cycle is not None and not 1 <= cycle <= n_cycle:
        raise InputError(_no_such_cycle(table, cycle, n_cycle, told=driver is not None))
    if channels:
        nothing = np.all([~np.isfinite(v) for v in channels.values()], axis=0)
        for row in np.flatnonzero(nothing).tolist():
            reasons[row] = reasons[row] or "no reading"
    used = np.array([not r for r in reasons], dtype=bool)
    return Observations(
        table=table,
        time=time,
        displacement=displacement,
        channels=channels,
        branch=tuple(branch.tolist()),
        cycle=cycles,
        n_cycle=n_cycle,
        used_cycle=used_cycle,
        used=used,
        reason=tuple(reasons),
        sign_note=sign_note,
    )


def usable_rows(obs: Observations, abscissa: FloatArray, values: FloatArray, what: str) -> IntArray:
    """Find the rows of the loading branch in which two columns both hold a reading.

    Parameters
    ----------
    obs : one lab file.
    abscissa, values : columns of it, (n_row,), nan where there is no reading.
    what : name of the channel, for the message.

    Returns
    -------
    Row numbers, in order.

    Raises
    ------
    InputError
        If there are fewer than five.
    """
    rows = np.flatnonzero(obs.used & np.isfinite(abscissa) & np.isfinite(values))
    if rows.size < 5:
        reasons = ", ".join(f"{n} x {r}" for r, n in why_left_out(obs).most_common(3))
        raise InputError(
            Fault(
                f"only {rows.size} usable rows of {what} on the loading branch; left out: {reasons or 'none'}",
                obs.table.path,
                advice="A sweep needs a loading branch of five rows at least",
            )
        )
    return rows


def why_left_out(obs: Observations) -> Counter[str]:
    """Rows that are not used by reason, those of all other cycles counted together."""
    others = sorted({int(c) for c, used in zip(obs.cycle, obs.used, strict=True) if c and not used} - {obs.used_cycle})
    if not others:
        return Counter(r for r in obs.reason if r)
    named = f"cycle {others[0]}" if len(others) == 1 else f"cycles {others[0]} to {others[-1]}"
    together = f"{named} (cycle {obs.used_cycle} is used)"
    of_other = (obs.cycle != obs.used_cycle) & (obs.cycle > 0)
    return Counter(
        together if other and reason.startswith(_OF_CYCLE) else reason
        for other, reason in zip(of_other.tolist(), obs.reason, strict=True)
        if reason
    )


_OF_CYCLE = ("loading branch of cycle", "unloading branch of cycle")


def _why_not(label: str, cycle: int, used: int, *, repeat: bool) -> str:
    """Reason of a row of a branch in a cycle when cycle `used` is used, "" if the row is."""
    if label == "hold":
        return HOLD
    if cycle == 0:
        return BEFORE if used else UNLOADING
    if cycle != used:
        return f"{label} branch of cycle {cycle} (cycle {used} is used)"
    if repeat:
        return f"loading again in cycle {cycle}, to less than half of the largest excursion"
    return UNLOADING if label == "unloading" else ""


def _no_such_cycle(table: LabTable, cycle: int, n_cycle: int, *, told: bool) -> Fault:
    if not told:
        return Fault(
            f"there is no cycle {cycle}: without a displacement or force column nothing tells the cycles of this file",
            table.path,
            advice="Name the cycle of the tester's file, to which this one is tied by time",
        )
    has = f"{n_cycle} loading branch{'' if n_cycle == 1 else 'es'}"
    return Fault(f"there is no cycle {cycle}, the file has {has}", table.path, advice=f"Choose a cycle from 1 to {n_cycle}")


def _mark_backward_time(table: LabTable, time: FloatArray, good: BoolArray, reasons: list[str]) -> None:
    finite = np.where(good & np.isfinite(time), time, -np.inf)
    backward = np.flatnonzero(good & (time < np.maximum.accumulate(finite)))
    if backward.size > max(1, len(time) // 100):
        row = int(backward[0])
        raise InputError(
            Fault(
                f"time runs backwards in {backward.size} rows, first to {time[row]:.6g} s",
                table.path,
                int(table.lines[row]),
                advice="Save one test per file, with the time since its start",
            )
        )
    for row in backward.tolist():
        good[row] = False
        reasons[row] = BACKWARD


def _signs(displacement: FloatArray | None, force: FloatArray | None, good: BoolArray) -> tuple[dict[str, float], str]:
    signs = {"displacement": 1.0, "force": 1.0}
    notes: list[str] = []
    at_peak: int | None = None
    for name, values, unit, scale in (("force", force, "N", 1.0), ("displacement", displacement, "mm", 1e3)):
        if values is None:
            continue
        rows = np.flatnonzero(good & np.isfinite(values))
        if rows.size < 2:
            continue
        away = excursion(values[rows])
        largest = float(away[np.argmax(np.abs(away))])
        if abs(largest) <= 6 * reading_noise(values[rows]) or largest == 0.0:
            notes.append(f"{name}: no excursion beyond its noise, sign kept")
            continue
        deciding, where = largest, "largest excursion from the start"
        if name == "force":
            at_peak = int(rows[np.argmax(np.abs(away))])
        elif at_peak is not None:
            there = float(np.interp(at_peak, rows, away))
            if abs(there) > 0.1 * abs(largest):
                deciding, where = there, "excursion where the force is largest"
        if deciding < 0:
            signs[name] = -1.0
            notes.append(f"{name} negative in compression: sign turned ({where} {deciding * scale:.4g} {unit})")
        else:
            notes.append(f"{name} positive in compression: sign kept ({where} {deciding * scale:+.4g} {unit})")
    return signs, "; ".join(notes)


def _branches(
    values: FloatArray, time: FloatArray | None, *, standstill: bool
) -> tuple[npt.NDArray[np.object_], IntArray, BoolArray]:
    """Per row its label, the cycle it belongs to (0 before the first), and whether it loads again within its cycle.

    A loading branch opens a cycle if it reaches half of the largest excursion.
    """
    n = values.size
    noise = reading_noise(values)
    smooth = median_filter(values, size=5, mode="nearest") if n >= 15 else values
    span = float(np.ptp(smooth))
    labels = np.full(n, "hold", dtype=object)
    cycle = np.zeros(n, dtype=np.int64)
    again = np.zeros(n, dtype=bool)
    share = 0.02 if standstill else 0.05
    if span <= 6 * noise or span == 0.0:
        return labels, cycle, again
    turns = reversals(smooth, max(share * span, 6 * noise))
    clock = np.arange(n, dtype=float) if time is None else time - time[0]
    still = np.zeros(n, dtype=bool)
    count = 0
    top = float(np.max(smooth))
    # From the start, not from the lowest: a ball may be withdrawn further than it is pressed. Unless the record starts pressed.
    base = float(smooth[0]) if top - smooth[0] >= 0.1 * span else float(np.min(smooth))
    for start, stop in pairwise(turns):
        rows = slice(start, stop + 1)
        rising = smooth[stop] > smooth[start]
        opens = bool(rising and smooth[stop] - base >= 0.5 * (top - base))
        count += int(opens)
        labels[rows] = "loading" if rising else "unloading"
        cycle[rows] = count
        again[rows] = rising and not opens and count > 0
        if standstill:
            still[rows] |= _standing(values[rows], clock[rows], noise, span)
    labels[still] = "hold"
    return labels, cycle, again


def _standing(values: FloatArray, clock: FloatArray, noise: float, span: float) -> BoolArray:
    """Rows of one monotone stretch where the crosshead stands still, found by its speed over a few rows."""
    n = values.size
    still = np.zeros(n, dtype=bool)
    duration = float(clock[-1] - clock[0])
    travel = abs(float(values[-1] - values[0]))
    if n < 20 or duration <= 0 or travel == 0:
        return still
    mean_speed = travel / duration
    interval = duration / (n - 1)
    half = 3
    while half < n // 8 and 4 * noise * np.sqrt(2 / half) / (half * interval) > 0.2 * mean_speed:
        half = half * 3 // 2 + 1
    speed_noise = noise * np.sqrt(2 / half) / (half * interval)
    padded = np.concatenate([[0.0], np.cumsum(values - values[0])])
    ticks = np.concatenate([[0.0], np.cumsum(clock - clock[0])])
    i = np.arange(n)
    lo, hi = np.maximum(i - half, 0), np.minimum(i + half, n)
    mid_lo, mid_hi = np.maximum(i, 1), np.minimum(i, n - 1)
    before = (padded[mid_lo] - padded[lo]) / (mid_lo - lo)
    after = (padded[hi] - padded[mid_hi]) / (hi - mid_hi)
    elapsed = (ticks[hi] - ticks[mid_hi]) / (hi - mid_hi) - (ticks[mid_lo] - ticks[lo]) / (mid_lo - lo)
    speed = np.abs(after - before) / np.maximum(elapsed, 1e-12)
    slow = speed < max(4 * speed_noise, 0.05 * mean_speed)
    tolerance = max(3 * noise, 2e-4 * span)
    for begin, end in _runs(slow):
        if end - begin < half:
            continue
        level = float(np.median(values[begin:end]))
        while begin > 0 and abs(values[begin - 1] - level) <= tolerance:
            begin -= 1
        while end < n and abs(values[end] - level) <= tolerance:
            end += 1
        still[begin:end] = True
    # A staircase stands still most of the time and is measured there.
    inner = [(b, e) for b, e in _runs(still) if b > 0 and e < n]
    if sum(e - b for b, e in inner) > n / 2:
        for b, e in inner:
            still[b:e] = False
    return still


def _runs(mask: BoolArray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(b), int(e)) for b, e in zip(edges[::2], edges[1::2], strict=True)]
