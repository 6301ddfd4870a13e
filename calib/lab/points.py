"""From the readings of one channel to its points, over what ties them to the press: displacement, force, or the clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.clocks import loading_window
from calib.lab.instruments import IntArray
from calib.lab.observations import Observations, usable_rows
from calib.lab.onset import coarse_onset
from calib.lab.part import UNLOADING
from calib.lab.reduction import NoiseEstimate, Reduced, fresh_readings, reduce_channel
from calib.lab.sweep import Points
from calib.lab.use import cycles_in_words
from models.sensor import FloatArray


class Tied(NamedTuple):
    """Points of a channel, and what its readings say about their own errors."""

    points: Points
    estimate: NoiseEstimate


def over_displacement(obs: Observations, channel: str, n_points: int, *, keep_force: bool) -> Tied:
    """Reduce a channel over the displacement in its own file; rows of several cycles go into the same bins.

    Parameters
    ----------
    obs : the file.
    channel : its name.
    n_points : points to make.
    keep_force : whether each point gets the force of the same file.
    """
    assert obs.displacement is not None
    rows = usable_rows(obs, obs.displacement, obs.channels[channel], channel)
    x, y = obs.displacement[rows], obs.channels[channel][rows]
    onset = coarse_onset(x, y)
    reduced = reduce_channel(x, y, n_points, onset)
    force: FloatArray | None = None
    if keep_force and obs.force is not None:
        with_force = rows[np.isfinite(obs.force[rows])]
        if with_force.size >= 5:
            of_force = reduce_channel(obs.displacement[with_force], obs.force[with_force], n_points, onset)
            force = of_force.smooth(reduced.abscissa)
    return Tied(Points(reduced.value, reduced.n_effective, displacement=reduced.abscissa, force=force), reduced.estimate)


def over_force(obs: Observations, channel: str, n_points: int) -> Tied:
    """Reduce a channel over the force in its own file, cycle by cycle.

    Parameters
    ----------
    obs : the file.
    channel : its name.
    n_points : points to make in all.
    """
    assert obs.force is not None
    passes = _passes(obs, usable_rows(obs, obs.force, obs.channels[channel], channel))
    return _joined([_over_force_once(obs, rows, channel, _share(n_points, passes)) for rows in passes])


def over_time(
    tester: Observations, lcr: Observations, channel: str, offset: float, onset: float, n_points: int
) -> tuple[Tied, tuple[str, ...]]:
    """Reduce a channel over the time of its meter, over the times in which the tester's record is used, cycle by cycle.

    Parameters
    ----------
    tester, lcr : the two files.
    channel : its name, in the file of the meter.
    offset : [s], clock of the tester minus clock of the meter.
    onset : [m], where contact begins on the tester's displacement.
    n_points : points to make in all.

    Returns
    -------
    The points, and notes on which rows are left out.

    Raises
    ------
    InputError
        If fewer than five readings fall into these times.
    """
    assert tester.time is not None
    assert tester.displacement is not None
    assert lcr.time is not None
    rows = usable_rows(lcr, lcr.time, lcr.channels[channel], channel)
    on_tester = lcr.time[rows] + offset
    windows = [tester.time[r] for r in _passes(tester, np.flatnonzero(tester.used & np.isfinite(tester.time)), least=1)]
    inside = [rows[(on_tester >= times[0]) & (on_tester <= times[-1])] for times in windows]
    if sum(r.size for r in inside) < 5:
        raise InputError(
            Fault(
                f"only {sum(r.size for r in inside)} {channel} readings fall into the {tester.use.branch} branch, with the "
                f"clock offset {offset:.3g} s",
                lcr.table.path,
                advice="Check that both files are of the same test and that the log covers "
                + cycles_in_words(tester.used_cycles),
            )
        )
    made = [
        _over_time_once(tester, lcr, channel, r, times, offset, onset, _share(n_points, windows))
        for r, times in zip(inside, windows, strict=True)
        if r.size >= 5 or len(windows) == 1
    ]
    used = np.concatenate(inside)
    return _joined(made), _outside_notes(tester, lcr, on_tester, rows, used)


def _outside_notes(
    tester: Observations, lcr: Observations, on_tester: FloatArray, rows: IntArray, used: IntArray
) -> tuple[str, ...]:
    """Which rows of a meter's log are left out, as they lie outside of what is used of the tester's record."""
    begin, end = loading_window(tester)
    out = ~np.isin(rows, used)
    whole = tester.use.branch == "loading" and len(tester.used_cycles) == 1
    early, late = (out & (on_tester < begin), out & (on_tester > end)) if whole else (np.zeros_like(out), np.zeros_like(out))
    counts = (
        (early, "before the loading branch of the tester's record"),
        (late, f"after the turning point (hold and {UNLOADING})"),
        (out & ~early & ~late, "outside of what is used of the tester's record"),
    )
    name = lcr.table.path.name
    return tuple(f"{name}: {int(np.sum(those))} rows left out: {why}" for those, why in counts if np.any(those))


def _passes(obs: Observations, rows: IntArray, least: int = 5) -> list[IntArray]:
    """Rows cycle by cycle; cycles with too few of them are left out, if there are others."""
    parts = [rows[obs.cycle[rows] == cycle] for cycle in obs.used_cycles]
    return [part for part in parts if part.size >= least] or [rows]


def _share(n_points: int, passes: Sequence[object]) -> int:
    return max(8, n_points // len(passes)) if len(passes) > 1 else n_points


def _over_time_once(
    tester: Observations,
    lcr: Observations,
    channel: str,
    rows: IntArray,
    times: FloatArray,
    offset: float,
    onset: float,
    n_points: int,
) -> Tied:
    """Points of a channel in one cycle over the time of its meter; an unloading is gone through backwards."""
    assert tester.time is not None
    assert tester.displacement is not None
    assert lcr.time is not None
    t, c = lcr.time[rows], lcr.channels[channel][rows]
    inside = tester.used & np.isfinite(tester.displacement) & (tester.time >= times[0]) & (tester.time <= times[-1])
    x, clock = tester.displacement[inside], tester.time[inside]
    if tester.use.branch == "unloading":
        t, c, x, clock, offset = -t[::-1], c[::-1], x[::-1], -clock[::-1], -offset
    reached = np.maximum.accumulate(x)
    start = float(clock[min(int(np.searchsorted(reached, onset)), reached.size - 1)]) - offset
    reduced = reduce_channel(t, c, n_points, start)
    stamps = -reduced.abscissa if tester.use.branch == "unloading" else reduced.abscissa
    return Tied(Points(reduced.value, reduced.n_effective, time=stamps), reduced.estimate)


def _over_force_once(obs: Observations, rows: IntArray, channel: str, n_points: int) -> Tied:
    """Points of a channel in one cycle over the force in its own file; an unloading is gone through backwards."""
    assert obs.force is not None
    f, c = obs.force[rows], obs.channels[channel][rows]
    # In the order of reading, not of force: before contact the force is noise, and bins of noise would be biased.
    clock = np.arange(rows.size, dtype=float)
    if obs.time is not None and np.all(np.diff(obs.time[rows]) > 0):
        clock = obs.time[rows] - obs.time[rows][0]
    # The two channels are reduced over the rows in which the channel was read anew, so that their points belong together.
    fresh = fresh_readings(c)
    if obs.use.branch == "unloading":
        clock, f, c, fresh = clock[-1] - clock[::-1], f[::-1], c[::-1], fresh[::-1]
    onset = coarse_onset(clock, f)
    n_row, clock, f, c = rows.size, clock[fresh], f[fresh], c[fresh]
    reduced = reduce_channel(clock, c, n_points, onset, repeats=False)
    estimate = replace(reduced.estimate, n_row=n_row, repeat=n_row / reduced.estimate.n_reading)
    force = reduce_channel(clock, f, n_points, onset, repeats=False)
    force_there = _at_points(force, reduced.abscissa)
    # The force of a point has a noise of its own: dC/dF times it, counted against the point's effective number.
    rise_f = force.smooth(reduced.edges[1:]) - force.smooth(reduced.edges[:-1])
    rise_c = reduced.smooth(reduced.edges[1:]) - reduced.smooth(reduced.edges[:-1])
    slopes = np.where(rise_f > 2 * force.noise, rise_c / np.where(rise_f > 0, rise_f, 1.0), 0.0)
    slope = np.interp(reduced.abscissa, (reduced.edges[1:] + reduced.edges[:-1]) / 2, slopes)
    share = (slope * force.noise) ** 2 / np.interp(reduced.abscissa, force.abscissa, force.n_effective)
    own = reduced.noise**2 / reduced.n_effective
    n_effective = reduced.noise**2 / (own + share)
    return Tied(Points(reduced.value, n_effective, force=force_there), estimate)


def _at_points(reduced: Reduced, abscissa: FloatArray) -> FloatArray:
    """Values of a channel at other points than its own: its smooth, and what the nearest of its points deviate from that."""
    deviation = np.interp(abscissa, reduced.abscissa, reduced.value - reduced.smooth(reduced.abscissa))
    return np.asarray(reduced.smooth(abscissa) + deviation)


def _joined(made: Sequence[Tied]) -> Tied:
    """Points of several cycles as those of one channel: the sd of each point stays, the noise of a reading is one for all."""
    if len(made) == 1:
        return made[0]
    of = [tied.estimate for tied in made]
    n = np.array([e.n_reading for e in of], dtype=float)
    noise = float(np.sqrt(np.sum(n * np.array([e.noise for e in of]) ** 2) / np.sum(n)))
    estimate = NoiseEstimate(
        noise=noise,
        correlation=float(np.sum(n * np.array([e.correlation for e in of])) / np.sum(n)),
        resolution=min(e.resolution for e in of),
        repeat=sum(e.n_row for e in of) / float(np.sum(n)),
        n_row=sum(e.n_row for e in of),
        n_reading=int(np.sum(n)),
        n_point=sum(e.n_point for e in of),
        outliers=sum(e.outliers for e in of),
    )
    parts = [tied.points for tied in made]
    n_effective = np.concatenate([p.n_effective * (noise / e.noise) ** 2 for p, e in zip(parts, of, strict=True)])
    times = [p.time for p in parts if p.time is not None]
    forces = [p.force for p in parts if p.force is not None]
    points = Points(
        value=np.concatenate([p.value for p in parts]),
        n_effective=n_effective,
        force=np.concatenate(forces) if forces else None,
        time=np.concatenate(times) if times else None,
    )
    return Tied(points, estimate)
