"""From lab tables to what the likelihood eats: compression positive, branches, masks with reasons, tens of points per sweep."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.interpolate import BSpline
from scipy.ndimage import median_filter

from calib.errors import Fault, InputError
from calib.instruments import IntArray, LabTable, read_lab_file
from models.sensor import BoolArray, FloatArray

UNLOADING = "unloading branch (hysteresis is not modelled)"
HOLD = "hold (crosshead standing still)"
LATER_CYCLE = "loading branch of a later cycle (only the first is used)"
BEFORE = "before the first loading branch"

#: Largest number of nodes of a `Track`.
TRACK_NODES = 2000
#: Time [s] a `Track` reaches beyond the loading branch on both sides, so that the clock offset may move.
TRACK_MARGIN = 5.0
#: Share of the capacitance change by which it may creep while the crosshead stands (sd), in the estimate of the clock offset.
CREEP = 0.003


# ---------------------------------------------------------------------------------------------------------- one file


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


def _excursion(values: FloatArray) -> FloatArray:
    """Excursion from the starting value, without single spikes."""
    smooth: FloatArray = median_filter(values, size=5, mode="nearest") if values.size >= 5 else values
    start = float(np.median(values[: max(1, min(9, values.size // 50))]))
    return np.asarray(smooth - start)


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
        excursion = _excursion(values[rows])
        largest = float(excursion[np.argmax(np.abs(excursion))])
        if abs(largest) <= 6 * _reading_noise(values[rows]) or largest == 0.0:
            notes.append(f"{name}: no excursion beyond its noise, sign kept")
            continue
        deciding, where = largest, "largest excursion from the start"
        if name == "force":
            at_peak = int(rows[np.argmax(np.abs(excursion))])
        elif at_peak is not None:
            there = float(np.interp(at_peak, rows, excursion))
            if abs(there) > 0.1 * abs(largest):
                deciding, where = there, "excursion where the force is largest"
        if deciding < 0:
            signs[name] = -1.0
            notes.append(f"{name} negative in compression: sign turned ({where} {deciding * scale:.4g} {unit})")
        else:
            notes.append(f"{name} positive in compression: sign kept ({where} {deciding * scale:+.4g} {unit})")
    return signs, "; ".join(notes)


def resolution(values: FloatArray) -> float:
    """Smallest step between readings, 0 if none is visible (more than nine digits).

    >>> resolution(np.array([0.125, 0.126, 0.131]))
    0.001
    """
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return 0.0
    top = float(np.max(np.abs(finite)))
    if top == 0.0:
        return 0.0
    first = -math.floor(math.log10(top))
    for digits in range(first, first + 10):
        scaled = finite * 10.0**digits
        whole = np.rint(scaled)
        if np.all(np.abs(scaled - whole) <= 1e-6 + 1e-12 * np.abs(scaled)):
            steps = np.diff(np.unique(whole))
            return float(np.min(steps)) / float(f"1e{digits}") if steps.size else 0.0
    return 0.0


def _reading_noise(values: FloatArray) -> float:
    """Noise (sd) of one reading from second differences, which a smooth curve does not move; at least its resolution's."""
    if values.size < 3:
        return 0.0
    second = np.diff(values, 2)
    return max(1.4826 * float(np.median(np.abs(second))) / math.sqrt(6.0), resolution(values) / math.sqrt(12.0))


def _reversals(values: FloatArray, threshold: float) -> list[int]:
    """Rows where the values turn by more than `threshold`, with the first and the last row."""
    turns = [0]
    direction = 0
    low = high = 0
    for i, v in enumerate(values.tolist()):
        if v > values[high]:
            high = i
        if v < values[low]:
            low = i
        if direction >= 0 and v < values[high] - threshold:
            if direction > 0 or values[high] - values[0] > threshold:
                turns.append(high)
            direction, low, high = -1, i, i
        elif direction <= 0 and v > values[low] + threshold:
            if direction < 0 or values[0] - values[low] > threshold:
                turns.append(low)
            direction, low, high = 1, i, i
    last = len(values) - 1
    return turns if turns[-1] == last else [*turns, last]


def _branches(
    values: FloatArray, time: FloatArray | None, *, standstill: bool
) -> tuple[npt.NDArray[np.object_], IntArray, int]:
    """Labels, the number of the loading branch each row belongs to (or follows), and the number of the first real one."""
    n = values.size
    noise = _reading_noise(values)
    smooth = median_filter(values, size=5, mode="nearest") if n >= 15 else values
    span = float(np.ptp(smooth))
    labels = np.full(n, "hold", dtype=object)
    cycle = np.zeros(n, dtype=np.int64)
    share = 0.02 if standstill else 0.05
    if span <= 6 * noise or span == 0.0:
        return labels, cycle, 0
    turns = _reversals(smooth, max(share * span, 6 * noise))
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


# ----------------------------------------------------------------------------------------------------------- a sweep


@dataclass(frozen=True, eq=False)
class ForcePoints:
    """Bin means of the loading branch, arrays of shape (n_point,), in order of displacement.

    Attributes
    ----------
    displacement : [m], crosshead reading. force : [N], cell reading, both not zeroed, compression positive.
    n_effective : independent readings in the point: its sd is force_noise / sqrt(n_effective).
    """

    displacement: FloatArray
    force: FloatArray
    n_effective: FloatArray


@dataclass(frozen=True, eq=False)
class CapacitancePoints:
    """Bin means of the capacitance on the loading branch, arrays of shape (n_point,), in order of loading.

    Attributes
    ----------
    capacitance : [F], parallel equivalent. n_effective : as in `ForcePoints`.
    time : [s], clock of the LCR meter, when tied by clock to the tester's `Track`; else None.
    force : [N], the file's own force column, not zeroed, compression positive, when tied by force; else None.
    displacement : [m], the file's own displacement column. Where it is there, it is the tie; else None.
    """

    capacitance: FloatArray
    n_effective: FloatArray
    time: FloatArray | None
    force: FloatArray | None
    displacement: FloatArray | None


@dataclass(frozen=True, eq=False)
class Track:
    """The tester's record over its own time [s], strictly increasing: displacement [m] and force [N] of shape (n_node,).

    Group means of at most `TRACK_NODES` nodes over the loading branch and `TRACK_MARGIN` on both sides.
    """

    time: FloatArray
    displacement: FloatArray
    force: FloatArray


@dataclass(frozen=True, eq=False)
class Sweep:
    """One pressing of one specimen with one ball, reduced to what the likelihood eats.

    Attributes
    ----------
    specimen, name : of the specimen and the sweep. indenter_radius : [m].
    force, capacitance, track : points and the tester's record, None where absent.
    force_noise, capacitance_noise : [N], [F], sd of one reading as estimated from the data; nan if absent.
    clock_offset, clock_offset_sd : [s], clock of the tester minus clock of the LCR meter; nan if not tied by clock.
    files : (file name, sha256) of each file.
    notes : what the report must say: rows left out with counts and reasons, signs turned, resolution.
    """

    specimen: str
    name: str
    indenter_radius: float
    force: ForcePoints | None
    capacitance: CapacitancePoints | None
    track: Track | None
    force_noise: float
    capacitance_noise: float
    clock_offset: float
    clock_offset_sd: float
    files: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Reduced:
    """A channel over an abscissa in bins: means, readings per bin, effective number, noise of one reading, and the smooth."""

    abscissa: FloatArray
    value: FloatArray
    n_effective: FloatArray
    noise: float
    correlation: float
    outliers: int
    smooth: Callable[[FloatArray], FloatArray]
    edges: FloatArray


def make_sweep(
    specimen: str,
    name: str,
    indenter_radius: float,
    force_file: Path | None,
    capacitance_file: Path | None,
    n_points: int = 40,
) -> Sweep:
    """Read the files of a sweep and reduce each channel to about `n_points` points of the first loading branch.

    A quarter of the points at most lies before the estimated onset of contact, the others in equal steps after it. A point
    is the mean of its bin, less the bias that the curve's bend has on a mean (from a smooth over the branch). Its
    n_effective is the number of readings over the integrated autocorrelation time of the residuals of that smooth.

    Capacitance is tied to the crosshead by its own displacement column, else its own force column, else by the clock:
    then the offset of the two clocks is estimated from the turning point.

    Parameters
    ----------
    indenter_radius : [m].
    force_file : force over displacement, with time if the capacitance is to be tied by clock; None if there is none.
    capacitance_file : LCR log; may be the same file as `force_file`; None if there is none.
    n_points : points per channel; fewer where the file has fewer rows.

    Raises
    ------
    InputError
        With the faults of both files; if nothing ties capacitance to the crosshead; if too few rows are usable.
    """
    if force_file is None and capacitance_file is None:
        raise InputError(Fault(f"sweep {name} of {specimen} has neither a force nor a capacitance file"))
    same = force_file is not None and capacitance_file is not None and _same_file(force_file, capacitance_file)
    tester = lcr = None
    faults: list[Fault] = []
    try:
        tester = None if force_file is None else observe(read_lab_file(force_file))
    except InputError as error:
        faults += error.faults
    try:
        lcr = tester if same else None if capacitance_file is None else observe(read_lab_file(capacitance_file))
    except InputError as error:
        faults += error.faults
    if faults:
        raise InputError(faults)
    _check_columns(tester, lcr)

    notes: list[str] = []
    for obs in (tester,) if same else (tester, lcr):
        notes += [] if obs is None else _file_notes(obs)
    force_points: ForcePoints | None = None
    force_noise = capacitance_noise = offset = offset_sd = float("nan")
    onset: float | None = None
    if tester is not None and tester.displacement is not None and tester.force is not None:
        rows = _usable(tester, tester.displacement, tester.force, "force")
        x, f = tester.displacement[rows], tester.force[rows]
        onset = _onset(x, f)
        reduced = _reduce(x, f, n_points, onset)
        force_points = ForcePoints(reduced.abscissa, reduced.value, reduced.n_effective)
        force_noise = reduced.noise
        notes.append(_noise_note("force", reduced, f, "N", 1.0))
    points: CapacitancePoints | None = None
    track: Track | None = None
    if lcr is not None and lcr.capacitance is not None:
        if lcr.displacement is not None:
            points, capacitance_noise = _over_displacement(lcr, n_points, notes, keep_force=not same)
        elif lcr.force is not None:
            points, capacitance_noise = _over_force(lcr, n_points, notes)
        elif tester is not None and tester.time is not None and onset is not None:
            track = _track(tester)
            offset, offset_sd, clock_notes = _clock_offset(tester, lcr)
            notes += clock_notes
            points, capacitance_noise = _over_time(tester, lcr, offset, onset, n_points, notes)
        if tester is None and lcr.force is not None and lcr.displacement is not None:
            notes.append(f"{lcr.table.path.name}: its force column is not calibrated against; name the file under force too")
    seen = {obs.table.path.name: obs.table.sha256 for obs in (tester, lcr) if obs is not None}
    return Sweep(
        specimen=specimen,
        name=name,
        indenter_radius=float(indenter_radius),
        force=force_points,
        capacitance=points,
        track=track,
        force_noise=force_noise,
        capacitance_noise=capacitance_noise,
        clock_offset=offset,
        clock_offset_sd=offset_sd,
        files=tuple(seen.items()),
        notes=tuple(notes),
    )


def _same_file(a: Path, b: Path) -> bool:
    return Path(a).resolve() == Path(b).resolve()


def _check_columns(tester: Observations | None, lcr: Observations | None) -> None:
    faults: list[Fault] = []
    if tester is not None:
        missing = [n for n, v in (("displacement", tester.displacement), ("force", tester.force)) if v is None]
        if missing:
            have = ", ".join(f'"{s}"' for s in tester.table.sources.values())
            faults.append(
                Fault(
                    f"the force file has no {' and no '.join(missing)} column, it has {have}",
                    tester.table.path,
                    advice="A force file holds force over displacement",
                )
            )
    if lcr is not None:
        have = ", ".join(f'"{s}"' for s in lcr.table.sources.values())
        if lcr.capacitance is None:
            faults.append(Fault(f"the capacitance file has no capacitance column, it has {have}", lcr.table.path))
        elif lcr.displacement is None and lcr.force is None:
            ties = (
                "Capacitance is tied to the crosshead by a displacement or a force column in its own file, or by time "
                "columns in both files"
            )
            if tester is None:
                faults.append(
                    Fault("nothing ties the capacitance to the indentation: no force file", lcr.table.path, advice=ties)
                )
            elif tester.time is None:
                faults.append(
                    Fault("nothing ties the capacitance to the force: this file has no time", tester.table.path, advice=ties)
                )
    if faults:
        raise InputError(faults)


def _usable(obs: Observations, abscissa: FloatArray, values: FloatArray, what: str) -> IntArray:
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


def _file_notes(obs: Observations) -> list[str]:
    name = obs.table.path.name
    notes = [f"{name}: {note}" for note in (*obs.table.notes, obs.sign_note) if note]
    out = Counter(r for r in obs.reason if r)
    if out:
        counts = ", ".join(f"{n} {r}" for r, n in out.most_common(8))
        more = f", and {len(out) - 8} other reasons" if len(out) > 8 else ""
        notes.append(f"{name}: {int(np.sum(obs.used))} of {len(obs.reason)} rows used; left out: {counts}{more}")
    return notes


def _noise_note(what: str, reduced: _Reduced, values: FloatArray, unit: str, scale: float) -> str:
    step = resolution(values)
    seen = f"resolution {step * scale:.3g} {unit}" if step else "no visible resolution"
    far = f"; {reduced.outliers} reading(s) further than 6 sd from the curve are kept" if reduced.outliers else ""
    return (
        f"{what}: {values.size} readings in {reduced.value.size} points, noise of one reading "
        f"{reduced.noise * scale:.3g} {unit}, {seen}, neighbours correlated over {reduced.correlation:.2g} readings{far}"
    )


# ----------------------------------------------------------------------------------------------------- the reduction


def _onset(x: FloatArray, y: FloatArray) -> float:
    """Where y leaves its flat beginning, for placing bins only: least squares of c + sum a_k (x - x_on)_+^p_k over x_on."""
    order = np.argsort(x, kind="stable")
    groups = np.array_split(order, min(300, x.size))
    xs = np.array([x[g].mean() for g in groups])
    ys = np.array([y[g].mean() for g in groups])
    length = float(np.ptp(xs))
    if length == 0 or xs.size < 8:
        return float(xs[0])
    u, v = (xs - xs[0]) / length, (ys - ys[0]) / max(float(np.ptp(ys)), 1e-300)

    def misfit(u0: float) -> float:
        w = np.maximum(u - u0, 0.0)
        basis = np.stack([np.ones_like(w), w**1.5, w**2, w**3], axis=1)
        residual = v - basis @ np.linalg.lstsq(basis, v, rcond=None)[0]
        return float(residual @ residual)

    grid = np.linspace(0.0, 0.85, 86)
    best = float(grid[np.argmin([misfit(g) for g in grid])])
    fine = np.clip(np.linspace(best - 0.01, best + 0.01, 21), 0.0, None)
    best = float(fine[np.argmin([misfit(g) for g in fine])])
    return float(xs[0] + best * length)


def _fit_smooth(x: FloatArray, y: FloatArray, onset: float) -> tuple[Callable[[FloatArray], FloatArray], int]:
    """A smooth of y over x: powers of the distance from the onset, and a cubic spline for what they leave. With its freedom."""
    lo, length = float(np.min(x)), max(float(np.ptp(x)), 1e-300)
    u0 = float(np.clip((onset - lo) / length, 0.0, 0.95))
    pieces = int(np.clip(np.sum(x > lo + u0 * length) // 15, 1, 12))
    inner = np.linspace(u0, 1.0, pieces + 1)[1 if u0 < 0.02 else 0 : -1]
    knots = np.concatenate([np.zeros(4), inner, np.ones(4)])
    shift, scale = float(np.mean(y)), max(float(np.std(y)), 1e-300)

    def basis(at: FloatArray) -> FloatArray:
        u = np.clip((at - lo) / length, 0.0, 1.0)
        w = np.maximum(u - u0, 0.0)
        powers = np.stack([w**1.5, w**2, w**2.5], axis=1)
        return np.hstack([powers, BSpline.design_matrix(u, knots, 3).toarray()])

    coefficients, _, rank, _ = np.linalg.lstsq(basis(x), (y - shift) / scale, rcond=1e-9)
    return (lambda at: np.asarray(basis(np.atleast_1d(at)) @ coefficients * scale + shift)), int(rank)


def integrated_time(residual: FloatArray, freedom: int = 0) -> float:
    """Integrated autocorrelation time tau = 1 + 2 sum rho_k in readings, at least 1; the sum ends at 5 tau (Sokal's window).

    Parameters
    ----------
    residual : shape (n,), in the order of reading, without trend.
    freedom : free numbers p of the smooth that was taken off. It took slow noise with it: a share of (2 k + 1) p / n of the
        sum up to lag k, for which tau is corrected (by a factor of two at most).
    """
    n = residual.size
    r = residual - residual.mean()
    power = float(r @ r)
    if n < 8 or power == 0.0:
        return 1.0
    spectrum = np.abs(np.fft.rfft(r, 2 * n)) ** 2
    rho = np.fft.irfft(spectrum)[: n // 2] / power
    tau = 1 + 2 * np.cumsum(rho[1:])
    enough = np.flatnonzero(np.arange(1, tau.size + 1) >= 5 * tau)
    last = int(enough[0]) if enough.size else tau.size - 1
    return max(1.0, float(tau[last]) / (1 - min(0.5, (2 * (last + 1) + 1) * freedom / n)))


def _edges(lo: float, hi: float, onset: float, n_points: int) -> FloatArray:
    """Bin edges: a quarter of the bins at most before the onset and never finer than after it."""
    share = float(np.clip((onset - lo) / (hi - lo), 0.0, 1.0)) if hi > lo else 0.0
    before = min(n_points // 4, round(n_points * share))
    if share > 0.02 and n_points >= 8:
        before = max(before, 2)
    if before == 0:
        return np.linspace(lo, hi, n_points + 1)
    return np.concatenate([np.linspace(lo, onset, before + 1)[:-1], np.linspace(onset, hi, n_points - before + 1)])


def _reduce(x: FloatArray, y: FloatArray, n_points: int, onset: float) -> _Reduced:
    """Bin means of y over x, rows in the order of reading."""
    n = x.size
    step = resolution(y)
    floor = max(step / math.sqrt(12.0), 1e-6 * float(np.ptp(y)), 1e-12 * float(np.max(np.abs(y))), 1e-300)
    if n <= max(n_points, 12):
        order = np.argsort(x, kind="stable")
        xs, ys = x[order], y[order]
        degree = min(3, n - 3)
        u = (xs - xs.mean()) / max(float(np.std(xs)), 1e-300)
        basis = np.vander(u, degree + 1)
        residual = ys - basis @ np.linalg.lstsq(basis, ys, rcond=None)[0]
        noise = max(float(np.sqrt(residual @ residual / (n - degree - 1))), floor)
        middles = (xs[1:] + xs[:-1]) / 2
        edges = np.concatenate([xs[:1], middles, xs[-1:]])
        return _Reduced(xs, ys, np.ones(n), noise, 1.0, 0, lambda at: np.interp(at, xs, ys), edges)
    smooth, freedom = _fit_smooth(x, y, onset)
    fitted = smooth(x)
    residual = y - fitted
    noise = 1.4826 * float(np.median(np.abs(residual - np.median(residual)))) * np.sqrt(n / max(n - freedom, 1))
    noise = max(noise, floor)
    tau = integrated_time(np.clip(residual, -4 * noise, 4 * noise), freedom)
    outliers = int(np.sum(np.abs(residual) > 6 * noise))
    edges = _edges(float(np.min(x)), float(np.max(x)), onset, n_points)
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    count = np.bincount(which, minlength=edges.size - 1)
    full = count > 0
    mean_x = np.bincount(which, x, edges.size - 1)[full] / count[full]
    mean_y = np.bincount(which, y, edges.size - 1)[full] / count[full]
    # A bent curve's mean is not its value at the mean abscissa: take the difference, known from the smooth, off.
    bend = np.bincount(which, fitted, edges.size - 1)[full] / count[full] - smooth(mean_x)
    n_effective = np.maximum(count[full] / tau, 1.0)
    if step > 0:
        # Readings that stay on one or two levels do not average the resolution away.
        levels = np.array([np.unique(y[which == b]).size for b in np.flatnonzero(full)])
        n_effective = np.where(levels < 3, 1.0, n_effective)
    return _Reduced(mean_x, mean_y - bend, n_effective, noise, tau, outliers, smooth, edges)


def _over_displacement(
    lcr: Observations, n_points: int, notes: list[str], *, keep_force: bool
) -> tuple[CapacitancePoints, float]:
    assert lcr.displacement is not None
    assert lcr.capacitance is not None
    rows = _usable(lcr, lcr.displacement, lcr.capacitance, "capacitance")
    x, c = lcr.displacement[rows], lcr.capacitance[rows]
    onset = _onset(x, c)
    force: FloatArray | None = None
    reduced = _reduce(x, c, n_points, onset)
    if keep_force and lcr.force is not None:
        with_force = rows[np.isfinite(lcr.force[rows])]
        if with_force.size >= 5:
            force = _reduce(lcr.displacement[with_force], lcr.force[with_force], n_points, onset).smooth(reduced.abscissa)
    notes.append(_noise_note("capacitance over its own displacement", reduced, c, "fF", 1e15))
    return CapacitancePoints(reduced.value, reduced.n_effective, None, force, reduced.abscissa), reduced.noise


def _over_force(lcr: Observations, n_points: int, notes: list[str]) -> tuple[CapacitancePoints, float]:
    assert lcr.force is not None
    assert lcr.capacitance is not None
    rows = _usable(lcr, lcr.force, lcr.capacitance, "capacitance")
    f, c = lcr.force[rows], lcr.capacitance[rows]
    # In the order of reading, not of force: before contact the force is noise, and bins of noise would be biased.
    clock = np.arange(rows.size, dtype=float)
    if lcr.time is not None and np.all(np.diff(lcr.time[rows]) > 0):
        clock = lcr.time[rows] - lcr.time[rows][0]
    onset = _onset(clock, f)
    capacitance, force = _reduce(clock, c, n_points, onset), _reduce(clock, f, n_points, onset)
    # The force of a point has a noise of its own: dC/dF times it, counted against the point's effective number.
    rise_f = force.smooth(capacitance.edges[1:]) - force.smooth(capacitance.edges[:-1])
    rise_c = capacitance.smooth(capacitance.edges[1:]) - capacitance.smooth(capacitance.edges[:-1])
    slopes = np.where(rise_f > 2 * force.noise, rise_c / np.where(rise_f > 0, rise_f, 1.0), 0.0)
    slope = np.interp(capacitance.abscissa, (capacitance.edges[1:] + capacitance.edges[:-1]) / 2, slopes)
    share = (slope * force.noise) ** 2 / force.n_effective
    own = capacitance.noise**2 / capacitance.n_effective
    n_effective = capacitance.noise**2 / (own + share)
    notes.append(_noise_note("capacitance over its own force", capacitance, c, "fF", 1e15))
    return CapacitancePoints(capacitance.value, n_effective, None, force.value, None), capacitance.noise


def _loading_window(tester: Observations) -> tuple[float, float]:
    assert tester.time is not None
    times = tester.time[tester.used & np.isfinite(tester.time)]
    return float(times[0]), float(times[-1])


def _over_time(
    tester: Observations, lcr: Observations, offset: float, onset: float, n_points: int, notes: list[str]
) -> tuple[CapacitancePoints, float]:
    assert tester.time is not None
    assert tester.displacement is not None
    assert lcr.time is not None
    assert lcr.capacitance is not None
    rows = _usable(lcr, lcr.time, lcr.capacitance, "capacitance")
    begin, end = _loading_window(tester)
    on_tester = lcr.time[rows] + offset
    early, late = int(np.sum(on_tester < begin)), int(np.sum(on_tester > end))
    rows = rows[(on_tester >= begin) & (on_tester <= end)]
    name = lcr.table.path.name
    if early:
        notes.append(f"{name}: {early} rows left out: before the loading branch of the tester's record")
    if late:
        notes.append(f"{name}: {late} rows left out: after the turning point (hold and {UNLOADING})")
    if rows.size < 5:
        raise InputError(
            Fault(
                f"only {rows.size} capacitance readings fall into the loading branch, with the clock offset {offset:.3g} s",
                lcr.table.path,
                advice="Check that both files are of the same test",
            )
        )
    t, c = lcr.time[rows], lcr.capacitance[rows]
    used = tester.used & np.isfinite(tester.displacement)
    reached = np.maximum.accumulate(tester.displacement[used])
    start = float(tester.time[used][min(int(np.searchsorted(reached, onset)), reached.size - 1)]) - offset
    reduced = _reduce(t, c, n_points, start)
    notes.append(_noise_note("capacitance over the meter's time", reduced, c, "fF", 1e15))
    return CapacitancePoints(reduced.value, reduced.n_effective, reduced.abscissa, None, None), reduced.noise


def _record(tester: Observations) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Time (strictly increasing), displacement and force of the tester up to the end of the first unloading, and the rows."""
    assert tester.time is not None
    assert tester.displacement is not None
    assert tester.force is not None
    finite = np.isfinite(tester.time) & np.isfinite(tester.displacement) & np.isfinite(tester.force)
    ends = ("empty", "over-range", "time runs")
    sound = np.array([not r.startswith(ends) and r != LATER_CYCLE for r in tester.reason], dtype=bool)
    rows = np.flatnonzero(finite & sound)
    last_used = int(np.flatnonzero(tester.used)[-1])
    later = [i for i, r in enumerate(tester.reason) if r == LATER_CYCLE and i > last_used]
    rows = rows[rows < later[0]] if later else rows
    time = tester.time[rows]
    ahead = np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0])
    rows = rows[ahead]
    return tester.time[rows], tester.displacement[rows], tester.force[rows], rows


def _track(tester: Observations) -> Track:
    time, displacement, force, _ = _record(tester)
    begin, end = _loading_window(tester)
    inside = (time >= begin - TRACK_MARGIN) & (time <= end + TRACK_MARGIN)
    groups = np.array_split(np.flatnonzero(inside), min(TRACK_NODES, int(np.sum(inside))))
    return Track(*(np.array([v[g].mean() for g in groups]) for v in (time, displacement, force)))


# -------------------------------------------------------------------------------------------------------- two clocks


def _clock_offset(tester: Observations, lcr: Observations) -> tuple[float, float, list[str]]:
    """Clock of the tester minus clock of the LCR meter [s], its sd, and notes.

    The capacitance around the turning point is a smooth function of displacement on either side of it; the kinks where the
    crosshead stops and starts again tell the offset. Loading and unloading have functions of their own, so hysteresis does
    not. Without a record beyond the turning point only the onset of contact tells, far less sharply.
    """
    assert lcr.time is not None
    assert lcr.capacitance is not None
    rows = _usable(lcr, lcr.time, lcr.capacitance, "capacitance")
    t, c = lcr.time[rows], lcr.capacitance[rows]
    time, displacement, force, of_row = _record(tester)
    begin, top = _loading_window(tester)
    peak = float(np.max(displacement[(time >= begin) & (time <= top)]))
    length = peak - float(np.interp(begin, time, displacement))
    unloading = np.array([tester.branch[r] == "unloading" for r in of_row.tolist()], dtype=bool)
    falling = np.flatnonzero((time > top) & unloading)
    leave = float(time[falling[0]]) if falling.size else float(time[-1])
    excursion = _excursion(c)
    noise = _reading_noise(c)
    turn = float(np.sign(excursion[np.argmax(np.abs(excursion))]) or 1.0)
    rise = turn * excursion
    if float(np.max(rise)) < 10 * noise:
        sd = float(t[-1] - t[0]) / 4
        return begin - float(t[0]), sd, ["the capacitance hardly changes: the clock offset is not known from the data"]
    turns = _reversals(rise, max(0.1 * float(np.max(rise)), 6 * noise))
    crest = next((b for b in turns[1:] if rise[b] >= 0.5 * np.max(rise)), int(np.argmax(rise)))
    falls = bool(np.any(rise[crest:] < rise[crest] - max(0.1 * rise[crest], 6 * noise)))
    interval = max(float(np.median(np.diff(t))), 1e-3)
    if not falling.size or not falls:
        return _offset_from_onset(tester, t, c, interval)
    x_on = _onset(displacement[time <= top], force[time <= top])
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
    on_tester, on_lcr = _onset(tester.time[rows], tester.force[rows]), _onset(t, c)
    begin, end = _loading_window(tester)
    # Force and capacitance leave their flat parts with different powers of the depth: some per cent of the branch.
    sd = float(np.hypot(0.03 * (end - begin), interval))
    note = f"clock offset from the onset only, no record beyond the turning point: {on_tester - on_lcr:.2f} s, sd {sd:.2f} s"
    return on_tester - on_lcr, sd, [note]


# --------------------------------------------------------------------------------------------------------------- JSON


def sweeps_to_json(sweeps: Sequence[Sweep]) -> str:
    """Sweeps as JSON text; numbers come back to the last bit, nan included."""
    return json.dumps([_to_plain(s) for s in sweeps])


def _to_plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Sweep | ForcePoints | CapacitancePoints | Track):
        return {f.name: _to_plain(getattr(value, f.name)) for f in fields(value)}
    return value


def sweeps_from_json(text: str) -> tuple[Sweep, ...]:
    """The inverse of `sweeps_to_json`."""
    return tuple(_sweep(plain) for plain in json.loads(text))


def _full(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=np.float64)


def _array(values: Sequence[float] | None) -> FloatArray | None:
    return None if values is None else _full(values)


def _sweep(plain: Mapping[str, Any]) -> Sweep:
    force, capacitance, track = plain["force"], plain["capacitance"], plain["track"]
    return Sweep(
        specimen=plain["specimen"],
        name=plain["name"],
        indenter_radius=plain["indenter_radius"],
        force=None if force is None else ForcePoints(**{k: _full(v) for k, v in force.items()}),
        capacitance=None
        if capacitance is None
        else CapacitancePoints(
            capacitance=_full(capacitance["capacitance"]),
            n_effective=_full(capacitance["n_effective"]),
            time=_array(capacitance["time"]),
            force=_array(capacitance["force"]),
            displacement=_array(capacitance["displacement"]),
        ),
        track=None if track is None else Track(**{k: _full(v) for k, v in track.items()}),
        force_noise=plain["force_noise"],
        capacitance_noise=plain["capacitance_noise"],
        clock_offset=plain["clock_offset"],
        clock_offset_sd=plain["clock_offset_sd"],
        files=tuple((file, sha256) for file, sha256 in plain["files"]),
        notes=tuple(plain["notes"]),
    )
