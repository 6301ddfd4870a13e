"""From one lab table to `Observations`: compression positive, branches labelled, a reason at each row that is not used."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.ndimage import median_filter

from calib.errors import Fault, InputError
from calib.instruments import IntArray, LabTable
from calib.readings import excursion, reading_noise, reversals
from models.sensor import BoolArray, FloatArray

UNLOADING = "unloading branch (hysteresis is not modelled)"
HOLD = "hold (crosshead standing still)"
LATER_CYCLE = "loading branch of a later cycle (only the first is used)"
BEFORE = "before the first loading branch"


@dataclass(frozen=True, eq=False)
class Observations:
    """One lab file, compression positive, nothing re-zeroed. Arrays of shape (n_row,), None where the file has no such column.

    Attributes
    ----------
    table : what was read.
    time, displacement, force, capacitance : [s], [m], [N], [F]; nan where the cell was empty or over-range.
    branch : per row "loading", "unloading", "hold", or "" where neither displacement nor force tells.
    used : rows that take part in the calibration: the loading branch of the first cycle, from its start before contact.
    reason : per row why it is not used, "" if it is.
    sign_note : which signs were turned, and on what evidence.
    """

    table: LabTable
    time: FloatArray | None
    displacement: FloatArray | None
    force: FloatArray | None
    capacitance: FloatArray | None
    branch: tuple[str, ...]
    used: BoolArray
    reason: tuple[str, ...]
    sign_note: str


def observe(table: LabTable) -> Observations:
    """Turn signs so that compression is positive, label the branches, and say which rows are used and why others are not.

    The sign of force is that of its largest excursion from the starting value, the sign of displacement that of its
    excursion where the force is largest (its own largest excursion in a file without force): a ball that is withdrawn
    further than it was pressed does not mislead. Nothing is re-zeroed: load zero and contact point are parameters.
    Branches come from the displacement, or from the force in a file without displacement; a reversal counts from 2 % of
    the range and six times the noise on.

    Raises
    ------
    InputError
        If time runs backwards in more than one row of a hundred.
    """
    good = np.array([not r for r in table.reasons], dtype=bool)
    raw = {name: table.columns.get(name) for name in ("time", "displacement", "force", "capacitance")}
    time = raw["time"]
    reasons = list(table.reasons)
    if time is not None:
        _mark_backward_time(table, time, good, reasons)
    signs, sign_note = _signs(raw["displacement"], raw["force"], good)
    displacement = None if raw["displacement"] is None else raw["displacement"] * signs["displacement"]
    force = None if raw["force"] is None else raw["force"] * signs["force"]
    driver = displacement if displacement is not None else force
    n = len(reasons)
    branch = np.full(n, "", dtype=object)
    if driver is not None:
        rows = np.flatnonzero(good & np.isfinite(driver))
        if rows.size >= 2:
            clock = None if time is None else time[rows]
            labels, cycle, first = _branches(driver[rows], clock, standstill=displacement is not None)
            branch[rows] = labels
            for row, label, c in zip(rows.tolist(), labels.tolist(), cycle.tolist(), strict=True):
                if label == "hold":
                    reasons[row] = HOLD
                elif c < first:
                    reasons[row] = BEFORE
                elif label == "unloading":
                    reasons[row] = UNLOADING
                elif c > first:
                    reasons[row] = LATER_CYCLE
        for row in np.flatnonzero(good & ~np.isfinite(driver)).tolist():
            reasons[row] = reasons[row] or "no displacement reading"
    readings = [v for v in (force, raw["capacitance"]) if v is not None]
    if readings:
        nothing = np.all([~np.isfinite(v) for v in readings], axis=0)
        for row in np.flatnonzero(nothing).tolist():
            reasons[row] = reasons[row] or "no reading"
    used = np.array([not r for r in reasons], dtype=bool)
    return Observations(
        table=table,
        time=time,
        displacement=displacement,
        force=force,
        capacitance=raw["capacitance"],
        branch=tuple(branch.tolist()),
        used=used,
        reason=tuple(reasons),
        sign_note=sign_note,
    )


def observations_frame(obs: Observations) -> pd.DataFrame:
    """The observations as a table for people: columns time_s, displacement_m, force_N, capacitance_F (those the file has),
    branch, used, reason.
    """
    named = {"time_s": obs.time, "displacement_m": obs.displacement, "force_N": obs.force, "capacitance_F": obs.capacitance}
    frame = pd.DataFrame({name: values for name, values in named.items() if values is not None})
    return frame.assign(branch=list(obs.branch), used=obs.used, reason=list(obs.reason))


def usable_rows(obs: Observations, abscissa: FloatArray, values: FloatArray, what: str) -> IntArray:
    """Rows of the loading branch where both are readings.

    Raises
    ------
    InputError
        If there are fewer than five.
    """
    rows = np.flatnonzero(obs.used & np.isfinite(abscissa) & np.isfinite(values))
    if rows.size < 5:
        why = Counter(r for r in obs.reason if r).most_common(3)
        reasons = ", ".join(f"{n} x {r}" for r, n in why)
        raise InputError(
            Fault(
                f"only {rows.size} usable rows of {what} on the loading branch; left out: {reasons or 'none'}",
                obs.table.path,
                advice="A sweep needs a loading branch of five rows at least",
            )
        )
    return rows


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
        reasons[row] = "time runs backwards"


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
) -> tuple[npt.NDArray[np.object_], IntArray, int]:
    """Labels, the number of the loading branch each row belongs to (or follows), and the number of the first real one."""
    n = values.size
    noise = reading_noise(values)
    smooth = median_filter(values, size=5, mode="nearest") if n >= 15 else values
    span = float(np.ptp(smooth))
    labels = np.full(n, "hold", dtype=object)
    cycle = np.zeros(n, dtype=np.int64)
    share = 0.02 if standstill else 0.05
    if span <= 6 * noise or span == 0.0:
        return labels, cycle, 0
    turns = reversals(smooth, max(share * span, 6 * noise))
    clock = np.arange(n, dtype=float) if time is None else time - time[0]
    still = np.zeros(n, dtype=bool)
    count, first = 0, -1
    top = float(np.max(smooth))
    for start, stop in pairwise(turns):
        rows = slice(start, stop + 1)
        rising = smooth[stop] > smooth[start]
        count += int(rising)
        labels[rows] = "loading" if rising else "unloading"
        cycle[rows] = count
        if standstill:
            still[rows] |= _standing(values[rows], clock[rows], noise, span)
        if rising and first < 0 and smooth[stop] - smooth[0] >= 0.5 * (top - smooth[0]):
            first = count
    labels[still] = "hold"
    return labels, cycle, max(first, 0)


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
