"""From the lab files of one press to its `Sweep`: files read and judged, clocks tied, every channel reduced to points."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from calib.catalogue import CHANNELS
from calib.errors import Fault, InputError
from calib.files import real_path
from calib.lab.clocks import ClockOffset, beside_tester, clock_offset, loading_window, record
from calib.lab.instruments import AS_FOUND, LabTable, Reading, read_lab_file
from calib.lab.limits import contact_of
from calib.lab.observations import Observations, observe, usable_rows, why_left_out
from calib.lab.onset import coarse_onset
from calib.lab.points import over_displacement, over_force, over_time
from calib.lab.quality import judge, judge_return
from calib.lab.reduction import NoiseEstimate, reduce_channel
from calib.lab.signal import first_crest, increasing_rows, smoothed_record
from calib.lab.sweep import TRACK_MARGIN, TRACK_NODES, Points, Sweep, Track
from calib.lab.use import FIRST_LOADING, Use, cycles_in_words, use_in_words

# A log whose two ends are so far apart, as a share of its range, does not come back to where it began.
_NOT_BACK = 0.05


def make_sweep(
    specimen: str,
    name: str,
    indenter_radius: float,
    force_file: Path | str | None,
    capacitance_file: Path | str | None,
    n_points: int = 40,
    *,
    force_reading: Reading = AS_FOUND,
    capacitance_reading: Reading = AS_FOUND,
    use: Use = FIRST_LOADING,
    clock_range: tuple[float, float] | None = None,
    machine_compliance: float | None = None,
    believed_compliance: float | None = None,
) -> Sweep:
    """Read the files of a sweep and reduce each channel to about `n_points` points of the part of the press that is used.

    A quarter of the points at most lies before the estimated onset of contact, the others in equal steps after it. A point
    is the mean of its bin, less the bias that the curve's bend has on a mean (from a smooth over the branch). Its
    n_effective is the number of readings over the integrated autocorrelation time of the residuals of that smooth.

    Capacitance is tied to the crosshead by its own displacement column, else its own force column, else by the clock:
    then the offset of the two clocks is estimated from the turning point and the onset (`calib.lab.clocks`). An offset on which
    the data say nothing gets an sd as wide as what is possible, which becomes its prior. Where it is ambiguous by discrete
    steps (whole periods of equal cycles) no normal prior is honest, and the sweep is refused.

    Parameters
    ----------
    specimen, name : of the specimen and the sweep, as results shall have them.
    indenter_radius : [m].
    force_file : force over displacement, with time if the capacitance is to be tied by clock; None if there is none.
    capacitance_file : LCR log; may be the same file as `force_file`; None if there is none.
    n_points : points per channel; fewer where the file has fewer rows.
    force_reading, capacitance_reading : what the user says of the files, see `Reading`.
    use : which part of the press is used, in both files; in a log tied by the clock it is the tester's.
    clock_range : [s], range in which the offset of the clocks is known to lie; it can decide between alternatives.
    machine_compliance, believed_compliance : [m/N], for the grades alone, see `calib.lab.quality.judge`.

    Returns
    -------
    The sweep, with the grades on its files.

    Raises
    ------
    InputError
        With the faults of both files; if nothing ties capacitance to the crosshead; if too few rows are usable; if a cycle is
        asked for that is not there, or a limit of something that neither file has; if a channel reads the same in every row;
        if the clock offset is ambiguous by discrete steps.
    """
    if force_file is None and capacitance_file is None:
        raise InputError(Fault(f"sweep {name} of {specimen} has neither a force nor a capacitance file"))
    tester, lcr = read_press(
        force_file, capacitance_file, force_reading=force_reading, capacitance_reading=capacitance_reading, use=use
    )
    same = tester is lcr
    sources = [obs for obs in ((tester,) if same else (tester, lcr)) if obs is not None]
    notes = [note for obs in sources for note in _file_notes(obs)]
    if lcr is not None and lcr.use not in (use, FIRST_LOADING):
        notes.append(f"{lcr.table.path.name}: its limit is that at which the tester's record is cut off")
    grades = tuple(v for obs in sources for v in judge(obs, machine_compliance, believed_compliance=believed_compliance))
    channels: dict[str, Points] = {}
    readings: dict[str, NoiseEstimate] = {}
    offset = offset_sd = float("nan")
    onset: float | None = None
    if tester is not None and tester.displacement is not None and tester.force is not None:
        rows = usable_rows(tester, tester.displacement, tester.force, "force")
        x, f = tester.displacement[rows], tester.force[rows]
        onset = coarse_onset(x, f)
        reduced = reduce_channel(x, f, n_points, onset)
        channels["force"] = Points(reduced.value, reduced.n_effective, displacement=reduced.abscissa)
        _require_change("force", channels["force"], tester)
        readings["force"] = reduced.estimate
        notes.append(_noise_note("force", "force", reduced.estimate))
    track: Track | None = None
    clock: ClockOffset | None = None
    if lcr is not None and lcr.capacitance is not None:
        if (
            lcr.displacement is None
            and lcr.force is None
            and tester is not None
            and tester.time is not None
            and onset is not None
        ):
            clock = clock_offset(tester, lcr, clock_range)
            if clock.alternatives:
                raise InputError(_discrete(clock, tester, lcr))
            offset, offset_sd = clock.value, clock.sd
            notes += clock.evidence
            grades += judge_return(beside_tester(tester, lcr, offset))
            track = _track(tester, max(TRACK_MARGIN, 4 * offset_sd))
        for channel in lcr.channels:
            if channel == "force":
                continue
            if lcr.displacement is not None:
                tied, over = over_displacement(lcr, channel, n_points, keep_force=not same), "its own displacement"
            elif lcr.force is not None:
                tied, over = over_force(lcr, channel, n_points), "its own force"
            elif tester is not None and onset is not None and track is not None:
                tied, left_out = over_time(tester, lcr, channel, offset, onset, n_points)
                over, notes = "the meter's time", [*notes, *left_out]
            else:
                continue
            channels[channel], readings[channel] = tied
            _require_change(channel, channels[channel], lcr)
            notes.append(_noise_note(channel, f"{channel} over {over}", tied.estimate))
        if tester is None and lcr.force is not None and lcr.displacement is not None:
            notes.append(f"{lcr.table.path.name}: its force column is not calibrated against; name the file under force too")
    seen = dict.fromkeys((obs.table.path.name, obs.table.sha256) for obs in sources)
    return Sweep(
        specimen=specimen,
        name=name,
        indenter_radius=float(indenter_radius),
        channels=channels,
        track=track,
        noise={channel: found.noise for channel, found in readings.items()},
        clock_offset=offset,
        clock_offset_sd=offset_sd,
        files=tuple(seen),
        notes=tuple(notes),
        grades=grades,
        clock=clock,
        readings=readings,
        contact=_contact(tester, lcr),
    )


def read_press(
    force_file: Path | str | None,
    capacitance_file: Path | str | None,
    *,
    force_reading: Reading = AS_FOUND,
    capacitance_reading: Reading = AS_FOUND,
    use: Use = FIRST_LOADING,
) -> tuple[Observations | None, Observations | None]:
    """Read the files of one press and find the part that is used, as the first and quick part of `make_sweep`.

    Parameters
    ----------
    force_file, capacitance_file, force_reading, capacitance_reading, use : see `make_sweep`.

    Returns
    -------
    What the tester and what the LCR meter has observed, None without such a file; the same object twice if it is one record.

    Raises
    ------
    InputError
        With the faults of both files, or of what they hold together.
    """
    force_file, capacitance_file = (None if file is None else Path(file) for file in (force_file, capacitance_file))
    same = force_file is not None and capacitance_file is not None and _same_file(force_file, capacitance_file)
    # Of a workbook another sheet is another record.
    same = same and capacitance_reading in ((force_reading,) if force_reading.sheet else (AS_FOUND, force_reading))
    tester = lcr = None
    faults: list[Fault] = []
    try:
        tester = None if force_file is None else observe(read_lab_file(force_file, force_reading), use)
    except InputError as error:
        faults += error.faults
    try:
        if same or capacitance_file is None:
            lcr = tester if same else None
        else:
            lcr = _observe_capacitance(read_lab_file(capacitance_file, capacitance_reading), use, tester)
    except InputError as error:
        faults += error.faults
    if faults:
        raise InputError(faults)
    _check_columns(tester, lcr)
    return tester, lcr


def readings_of(obs: Observations) -> dict[str, NoiseEstimate]:
    """Estimate noise, correlation and resolution of every channel of one file, along the used branch.

    A capacitance log without displacement and force is looked at over its time, to its first crest. A channel with fewer than
    five such readings is left out.
    """
    found: dict[str, NoiseEstimate] = {}
    for name, values in obs.channels.items():
        across = obs.displacement if obs.displacement is not None else obs.force if name != "force" else None
        rows = np.flatnonzero(obs.used & np.isfinite(values))
        if across is not None and across is obs.displacement:
            rows = rows[np.isfinite(across[rows])]
            x = across[rows]
        else:
            x = np.arange(rows.size, dtype=float) if obs.time is None else obs.time[rows]
            if across is None and rows.size >= 5:
                rows = rows[: first_crest(values[rows])]
                x = x[: rows.size]
        if rows.size >= 5 and np.all(np.isfinite(x)) and np.ptp(x) > 0:
            found[name] = reduce_channel(x, values[rows], 40, coarse_onset(x, values[rows])).estimate
    return found


def _contact(*files: Observations | None) -> float:
    """Reading of the crosshead where contact begins [m], from the first file with a displacement; nan without one."""
    for obs in files:
        if obs is not None and obs.displacement is not None:
            found = contact_of(obs.displacement, obs.channels, np.flatnonzero(obs.loading if np.any(obs.loading) else obs.used))
            return float("nan") if found is None else found.reading
    return float("nan")


def _observe_capacitance(table: LabTable, use: Use, tester: Observations | None) -> Observations:
    """Observe a capacitance log; one with time alone is used by the tester's, and a limit it knows nothing of is translated."""
    if not {"displacement", "force"} & set(table.columns):
        return observe(table)
    if tester is None or tester.force is None or tester.displacement is None or not np.any(tester.used):
        return observe(table, use)
    if use.max_force is not None and "force" not in table.columns:
        contact = contact_of(tester.displacement, tester.channels, np.flatnonzero(tester.loading))
        reached = float(np.nanmax(tester.displacement[tester.used]))
        if contact is not None and reached > contact.reading:
            depth = min(reached - contact.reading, use.max_depth or np.inf)
            use = replace(use, max_force=None, max_depth=depth)
    elif use.max_depth is not None and "displacement" not in table.columns:
        reached = float(np.nanmax(tester.force[tester.used]))
        if np.isfinite(reached):
            use = replace(use, max_depth=None, max_force=reached if use.max_force is None else min(reached, use.max_force))
    return observe(table, use)


def _require_change(channel: str, points: Points, obs: Observations) -> None:
    """Refuse a channel that reads the same throughout: nothing was measured, and noise of zero would be believed."""
    if points.value.size and np.ptp(points.value) == 0:
        reading = f"{points.value[0]:g} {CHANNELS[channel].unit}"
        advice = "Look whether it was connected and logged, and leave the file out if it was not"
        raise InputError(Fault(f"{channel} reads {reading} in every row that is used", obs.table.path, advice=advice))


def _discrete(clock: ClockOffset, tester: Observations, lcr: Observations) -> Fault:
    many = f" of {tester.n_cycle}" if tester.n_cycle > 1 else ""
    return Fault(
        f"{clock.evidence[0]}; {cycles_in_words(tester.used_cycles)}{many} of {tester.table.path.name} is wanted"
        f"{_does_not_come_back(lcr)}",
        lcr.table.path,
        advice="Save both logs over the same cycles, from before the first to after the last; or cut both files to one cycle; "
        "or state the offset of the clocks",
    )


def _does_not_come_back(lcr: Observations) -> str:
    """That a log ends at another level than it begins at, if it does: a drift hides where the ball leaves the sensor."""
    for name, values in lcr.channels.items():
        there = values[np.isfinite(values)]
        few = max(there.size // 50, 1)
        change = float(np.median(there[-few:]) - np.median(there[:few]))
        if abs(change) > _NOT_BACK * float(np.ptp(there)):
            side = "higher" if change > 0 else "lower"
            k, unit = CHANNELS[name].display_scale, CHANNELS[name].display_unit
            return f". The log ends {abs(change) * k:.3g} {unit} {side} than it begins: a meter that drifts may be the cause"
    return ""


def _same_file(a: Path, b: Path) -> bool:
    return real_path(Path(a)) == real_path(Path(b))


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


def _file_notes(obs: Observations) -> list[str]:
    name = obs.table.path.name
    unread = [f"not read: {part}" for part in obs.table.unread if part.what.startswith("column")]
    notes = [f"{name}: {note}" for note in (*obs.table.notes, *unread, obs.sign_note, *obs.use_notes) if note]
    if obs.n_cycle > 1 or obs.use.branch != "loading":
        count = f"{obs.n_cycle} cycles, " if obs.n_cycle > 1 else ""
        notes.append(f"{name}: {count}{use_in_words(obs.use, obs.used_cycles)}")
    out = why_left_out(obs)
    if out:
        counts = ", ".join(f"{n} {r}" for r, n in out.most_common(8))
        more = f", and {len(out) - 8} other reasons" if len(out) > 8 else ""
        notes.append(f"{name}: {int(np.sum(obs.used))} of {len(obs.reason)} rows used; left out: {counts}{more}")
    return notes


def _noise_note(channel: str, what: str, readings: NoiseEstimate) -> str:
    r, unit, scale = readings, CHANNELS[channel].fine_unit, CHANNELS[channel].fine_scale
    seen = f"resolution {r.resolution * scale:.3g} {unit}" if r.resolution else "no visible resolution"
    far = f"; {r.outliers} reading(s) further than 6 sd from the curve are kept" if r.outliers else ""
    of = f" ({r.n_row} rows, each reading is written {r.repeat:.3g} times)" if r.repeat > 1 else ""
    return (
        f"{what}: {r.n_reading} readings{of} in {r.n_point} points, noise of one reading "
        f"{r.noise * scale:.2g} {unit}, {seen}, neighbours correlated over {r.correlation:.2g} readings{far}"
    )


def _track(tester: Observations, margin: float) -> Track:
    time, displacement, force, _ = record(tester)
    assert tester.time is not None
    begin, end = loading_window(tester)
    used = tester.time[tester.used & np.isfinite(tester.time)]
    inside = (time >= min(begin, used[0]) - margin) & (time <= max(end, used[-1]) + margin)
    groups = np.array_split(np.flatnonzero(inside), min(TRACK_NODES, int(np.sum(inside))))
    stamps, reading, load = (np.array([v[g].mean() for g in groups]) for v in (time, displacement, force))
    stamps, reading = smoothed_record(stamps, reading, int(np.sum((stamps >= begin) & (stamps <= end))) // 20)
    kept = increasing_rows(stamps)
    return Track(stamps[kept], reading[kept], load[kept])
