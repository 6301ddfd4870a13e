"""The lab files of one press in, by how much less force there is at a reading of capacitance while the ball retreats, out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calib.files import real_path
from calib.lab.instruments import AS_FOUND, Reading, read_lab_file
from calib.lab.observations import Observations, observe
from calib.lab.onset import coarse_onset
from calib.lab.use import FIRST_LOADING, Use
from models.sensor import BoolArray, FloatArray

#: Force [N] and capacitance [F] in the order of the rows, going down and going up.
Branches = tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

#: Shares of the largest force of a press at which its branches are compared.
SHARES = np.linspace(0.05, 0.95, 19)

# Readings are averaged in so many groups along a branch, and of fewer on one of them nothing is said.
_GROUPS, _FEWEST = 60, 24
# Unloading has to be there down to this share of the largest force.
_DOWN_TO = 0.5


@dataclass(frozen=True, eq=False)
class Unloading:
    """By how much force and capacitance of a press do not go back the way they came: arrays (n_share,), over `SHARES`.

    Attributes
    ----------
    off : [N], force on unloading less that on loading at the same capacitance; nan where it was not unloaded so far.
    error : [N], standard deviation of that, by noise and by the offset of the clocks.
    peak : [N], largest force, from which it was unloaded.
    hold : [s], how long the crosshead stood there; nan where there is no time.
    """

    off: FloatArray
    error: FloatArray
    peak: float
    hold: float


def measure_unloading(
    force_file: Path | None,
    capacitance_file: Path | None,
    *,
    force_reading: Reading = AS_FOUND,
    capacitance_reading: Reading = AS_FOUND,
    use: Use = FIRST_LOADING,
    clock_offset: tuple[float, float] | None = None,
) -> Unloading | str:
    """Compare the two branches of a press: what force a capacitance is read at going down, and going up again.

    Capacitance is tied to the force by the force column of its own file, else by its displacement column, branch by branch,
    else by the clocks. Readings are averaged in groups along each branch, F(C) of both is interpolated. Nothing is fitted.

    Parameters
    ----------
    force_file, capacitance_file : of the press; may be the same file.
    force_reading, capacitance_reading : what the user says of the files.
    use : whose first cycle is looked at, whatever its limits are.
    clock_offset : [s], clock of the tester minus clock of the meter, and its standard deviation; None where none ties them.

    Returns
    -------
    The comparison, or in words why there is none.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    if use.branch == "unloading":
        return "it is calibrated by unloading"
    if capacitance_file is None:
        return "no capacitance was measured"
    whole = replace(use, max_depth=None, max_force=None)
    meter = observe(read_lab_file(capacitance_file, capacitance_reading))
    if meter.displacement is not None or meter.force is not None:
        meter = observe(meter.table, whole)
    tester = meter
    if force_file is not None and real_path(force_file) != real_path(capacitance_file):
        tester = observe(read_lab_file(force_file, force_reading), whole)
    if meter.capacitance is None:
        return "no capacitance was measured"
    if meter.force is not None:
        return compare_branches([_branches_of(meter, meter.force, meter.capacitance)], _zero(meter), _hold(meter))
    if tester.force is None:
        return "nothing ties its capacitance to a force"
    if meter.displacement is not None:
        return compare_branches([_over_displacement(tester, meter)], _zero(tester), _hold(tester))
    if clock_offset is None or meter.time is None or tester.time is None:
        return "nothing ties its capacitance to a force"
    offset, sd = clock_offset
    traces = [_over_time(tester, meter, offset + shift) for shift in (0.0, -sd, sd)]
    return compare_branches(traces, _zero(tester), _hold(tester))


def _rows(obs: Observations) -> tuple[BoolArray, BoolArray]:
    """Rows of the loading branch that is used, and of the retreat after it."""
    number, branch = np.arange(len(obs.branch)), np.array(obs.branch, dtype=object)
    if not np.any(obs.loading):
        return obs.loading, obs.loading
    last = int(np.flatnonzero(obs.loading)[-1])
    again = np.flatnonzero((number > last) & (branch == "loading") & (obs.cycle != obs.cycle[last]))
    end = int(again[0]) if again.size else branch.size
    sound = np.array([not reason for reason in obs.table.reasons], dtype=bool)
    return obs.loading, sound & (branch == "unloading") & (number > last) & (number < end)


def _branches_of(obs: Observations, force: FloatArray, capacitance: FloatArray) -> Branches:
    known = np.isfinite(force) & np.isfinite(capacitance)
    down, up = (rows & known for rows in _rows(obs))
    return (force[down], capacitance[down]), (force[up], capacitance[up])


def _over_displacement(tester: Observations, meter: Observations) -> Branches:
    """The force at each reading of the meter, by the tester's branch over the displacement that both have."""
    assert tester.displacement is not None
    assert tester.force is not None
    assert meter.displacement is not None
    assert meter.capacitance is not None
    found = []
    for at, there in zip(_rows(tester), _rows(meter), strict=True):
        rows = np.flatnonzero(at & np.isfinite(tester.displacement) & np.isfinite(tester.force))
        order = rows[np.argsort(tester.displacement[rows], kind="stable")]
        own = there & np.isfinite(meter.displacement) & np.isfinite(meter.capacitance)
        if order.size:
            x, force = tester.displacement[order], tester.force[order]
            own &= (meter.displacement >= x[0]) & (meter.displacement <= x[-1])
            found.append((np.interp(meter.displacement[own], x, force), meter.capacitance[own]))
        else:
            found.append((np.empty(0), np.empty(0)))
    return found[0], found[1]


def _over_time(tester: Observations, meter: Observations, offset: float) -> Branches:
    """The force at each reading of the meter, by the tester's clock."""
    assert tester.time is not None
    assert tester.force is not None
    assert meter.time is not None
    assert meter.capacitance is not None
    time = meter.time + offset
    found = []
    for at in _rows(tester):
        rows = np.flatnonzero(at & np.isfinite(tester.time) & np.isfinite(tester.force))
        if rows.size < 2:
            found.append((np.empty(0), np.empty(0)))
            continue
        stamps, force = tester.time[rows], tester.force[rows]
        own = np.isfinite(time) & np.isfinite(meter.capacitance) & (time >= stamps[0]) & (time <= stamps[-1])
        found.append((np.interp(time[own], stamps, force), meter.capacitance[own]))
    return found[0], found[1]


def _zero(obs: Observations) -> float:
    """Load [N] before contact; nan where that is not known."""
    assert obs.force is not None
    rows = np.flatnonzero(obs.loading & np.isfinite(obs.force))
    if obs.displacement is not None:
        rows = rows[np.isfinite(obs.displacement[rows])]
        if rows.size < _FEWEST:
            return float("nan")
        before = rows[obs.displacement[rows] < coarse_onset(obs.displacement[rows], obs.force[rows])]
        return float(np.median(obs.force[before])) if before.size >= 3 else float(np.min(obs.force[rows]))
    return float(np.min(obs.force[rows])) if rows.size else float("nan")


def _hold(obs: Observations) -> float:
    """Time [s] that the crosshead stood between the branches; nan where there is none."""
    down, up = (np.flatnonzero(rows) for rows in _rows(obs))
    if obs.time is None or not (down.size and up.size):
        return float("nan")
    held = [k for k in range(int(down[-1]) + 1, int(up[0])) if obs.branch[k] == "hold"]
    return float(obs.time[held[-1]] - obs.time[held[0]]) if len(held) > 1 else 0.0


def compare_branches(traces: Sequence[Branches], zero: float, hold: float) -> Unloading | str:
    """Compare the branches of a press whose force is known at every reading of capacitance.

    Parameters
    ----------
    traces : both branches, then as they would be with other clocks.
    zero : [N], load before contact.
    hold : [s], time between them.

    Returns
    -------
    The comparison, or in words why there is none.
    """
    (down, up), *others = traces
    if len(down[0]) < _FEWEST or len(up[0]) < _FEWEST:
        return "it was not recorded while the ball retreats"
    if not np.isfinite(zero):
        return "it begins in contact"
    # A single reading may be an outlier; of three neighbours the middle one is none.
    peak = float(np.max(np.median(np.lib.stride_tricks.sliding_window_view(down[0], 3), axis=1))) - zero
    off = _off(down, up, zero, peak)
    if not np.any(np.isfinite(off[SHARES >= _DOWN_TO])) or np.isnan(off[np.argmin(np.abs(SHARES - _DOWN_TO))]):
        return f"it was not recorded while the ball retreats to {100 * _DOWN_TO:.0f} % of its force"
    halves = [_off((down[0][k::2], down[1][k::2]), (up[0][k::2], up[1][k::2]), zero, peak) for k in (0, 1)]
    noise = float(np.sqrt(np.nanmean((halves[0] - halves[1]) ** 2))) / 2
    by_clock = [np.abs(_off(*other, zero, peak) - off) for other in others]
    clock = np.max(by_clock, axis=0) if by_clock else np.zeros(off.size)
    return Unloading(off, np.hypot(np.nan_to_num(clock), noise), peak, hold)


def _off(down: tuple[FloatArray, FloatArray], up: tuple[FloatArray, FloatArray], zero: float, peak: float) -> FloatArray:
    """Force on unloading less that on loading at the same capacitance, over `SHARES`; nan where there is none."""
    force, capacitance = _grouped(*down)
    back, there = _grouped(*up)
    order, of_up = np.argsort(force, kind="stable"), np.argsort(there, kind="stable")
    wanted = zero + SHARES * peak
    at = np.interp(wanted, force[order], capacitance[order], left=np.nan, right=np.nan)
    return np.asarray(np.interp(at, there[of_up], back[of_up], left=np.nan, right=np.nan) - wanted, dtype=float)


def _grouped(force: FloatArray, capacitance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means of neighbouring readings along a branch."""
    groups = np.array_split(np.arange(force.size), min(_GROUPS, max(force.size // 2, 1)))
    means = [np.array([column[g].mean() for g in groups]) for column in (force, capacitance)]
    return means[0], means[1]
