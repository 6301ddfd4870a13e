"""From one lab table to `Observations`: compression positive, branches labelled, a reason at each row that is not used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.catalogue import CHANNELS
from calib.errors import Fault, InputError
from calib.lab.branches import label_branches
from calib.lab.cycles_told import cycles_told
from calib.lab.instruments import IntArray, LabTable
from calib.lab.limits import contact_of, limits_of
from calib.lab.part import FEWEST_ROWS, OF_CYCLE, check_contact, nothing_left, nothing_tells, used_cycles, why_not
from calib.lab.resets import of_another_zero, resets_of, without_jumps
from calib.lab.signs import SignDecision, decide_signs
from calib.lab.stages_told import stages_told
from calib.lab.use import FIRST_LOADING, Use, use_in_words
from models.sensor import BoolArray, FloatArray

if TYPE_CHECKING:
    import pandas as pd

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
    use : which part is used, as it was said.
    used_cycles : the cycles that this comes to; 0 stands for what is before the first, and for a file that tells no cycles.
    loading : rows of the loading branch of the first of them, whether they are used or lie beyond a limit.
    used : rows that take part in the calibration: the branches that are used, from their start before contact.
    reason : per row why it is not used, "" if it is.
    signs : quantity -> which way compression is in the file, and on what evidence.
    use_notes : what the limits of the use mean in this file, such as where depth counts from.
    """

    table: LabTable
    time: FloatArray | None
    displacement: FloatArray | None
    channels: Mapping[str, FloatArray]
    branch: tuple[str, ...]
    cycle: IntArray
    n_cycle: int
    use: Use
    used_cycles: tuple[int, ...]
    loading: BoolArray
    used: BoolArray
    reason: tuple[str, ...]
    signs: Mapping[str, SignDecision]
    use_notes: tuple[str, ...]

    @property
    def sign_note(self) -> str:
        """Which signs were turned, and on what evidence; "" for a file without force and displacement."""
        return "; ".join(decision.note for decision in self.signs.values())

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
        import pandas as pd

        named = {"time_s": self.time, "displacement_m": self.displacement}
        named |= {f"{name}_{CHANNELS[name].unit}".rstrip("_"): values for name, values in self.channels.items()}
        frame = pd.DataFrame({name: values for name, values in named.items() if values is not None})
        return frame.assign(branch=list(self.branch), cycle=self.cycle, used=self.used, reason=list(self.reason))


def observe(table: LabTable, use: Use = FIRST_LOADING) -> Observations:
    """Turn signs so that compression is positive, label the branches, and say which rows are used and why others are not.

    Signs come from the whole record (`calib.lab.signs`), or from what was said of them; a doubtful one is refused. Nothing is
    re-zeroed: load zero and contact point are parameters. Branches come from the displacement, or from the force in a file
    without displacement; a reversal counts from 2 % of the travel over which the force changes and six times the noise on. A
    cycle begins with a loading branch that reaches half of the largest indentation, or is one of the presses that grow up to
    there: a touch before the pressing is none, and a smaller loading later belongs to the cycle that it follows.

    Parameters
    ----------
    table : one lab file, from `read_lab_file`.
    use : which part of it is used: the loading branch of the first cycle, unless another is said. Other rows say what they are.

    Raises
    ------
    InputError
        If a sign is doubtful; if time runs backwards in more than one row of a hundred; if the file does not have a cycle or a
        column that the use speaks of.
    """
    good = np.array([not r for r in table.reasons], dtype=bool)
    raw = {name: table.columns.get(name) for name in ("time", "displacement", *CHANNELS)}
    time = raw["time"]
    reasons = list(table.reasons)
    if time is not None:
        _mark_backward_time(table, time, good, reasons)
    anew = resets_of(raw["displacement"], raw["force"], time, good)
    anew = np.union1d(anew, table.zeroed.get("displacement", ())).astype(np.int64)
    tared = np.array(table.zeroed.get("force", ()), dtype=np.int64)
    # Only to see how crosshead and load moved: the readings stay as they are.
    moved = None if raw["displacement"] is None else without_jumps(raw["displacement"], anew)
    load = None if raw["force"] is None else without_jumps(raw["force"], tared)
    signs = decide_signs(table, moved, load, good)
    factor = {name: signs[name].factor if name in signs else 1.0 for name in ("displacement", "force")}
    displacement = None if raw["displacement"] is None else raw["displacement"] * factor["displacement"]
    channels = {name: values for name in CHANNELS if (values := raw[name]) is not None}
    if "force" in channels:
        channels["force"] = channels["force"] * factor["force"]
    force = channels.get("force")
    n = len(reasons)
    branch = np.full(n, "", dtype=object)
    cycles, repeats = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    driver = moved * factor["displacement"] if moved is not None else None if load is None else load * factor["force"]
    if driver is not None:
        rows = np.flatnonzero(good & np.isfinite(driver))
        if rows.size >= 2:
            clock = None if time is None else time[rows]
            beside = None if moved is None or force is None else _filled(force[rows])
            branch[rows], cycles[rows], repeats[rows] = label_branches(
                driver[rows], clock, beside, standstill=displacement is not None
            )
        for row in np.flatnonzero(good & ~np.isfinite(driver)).tolist():
            reasons[row] = reasons[row] or "no displacement reading"
    elif use != FIRST_LOADING:
        raise InputError(nothing_tells(table))
    if channels:
        nothing = np.all([~np.isfinite(v) for v in channels.values()], axis=0)
        for row in np.flatnonzero(nothing).tolist():
            reasons[row] = reasons[row] or "no reading"
    n_cycle = int(np.max(cycles, initial=0))
    taken = used_cycles(table, use, n_cycle, branch, cycles)
    sound = np.array([not r for r in reasons], dtype=bool)
    in_press = (branch == "loading") & ~repeats & (cycles > 0) | ((branch == "") if driver is None else False)
    chosen = sound & (in_press if use.branch == "loading" else branch == "unloading") & np.isin(cycles, taken)
    zeros = np.union1d(anew, tared)
    other_zero = of_another_zero(chosen, zeros, driver)
    anchor = taken[0] if taken else 0
    loading = sound & in_press & (cycles == anchor)
    loading &= ~of_another_zero(loading, zeros, driver)
    chosen &= ~other_zero
    contact = None
    if (use.max_depth is not None or use.max_force is not None) and displacement is not None:
        contact = contact_of(displacement, channels, np.flatnonzero(loading if np.any(loading) else chosen))
    stretches = [np.flatnonzero(chosen & (cycles == c)) for c in taken]
    beyond = limits_of(use, table, displacement, channels, stretches, contact)
    if driver is not None:
        which = use_in_words(use, taken) if taken else ""
        for row in np.flatnonzero(sound & ~chosen).tolist():
            reasons[row] = (
                _why_other_zero(table, anew, tared)
                if other_zero[row]
                else why_not(str(branch[row]), int(cycles[row]), taken, use, which, repeat=bool(repeats[row]))
            )
    for row, reason in beyond.reasons.items():
        reasons[row] = reason
    if use != FIRST_LOADING and all(reasons):
        raise InputError(nothing_left(table, use, channels, chosen, branch))
    if beyond.reasons and contact is not None and displacement is not None:
        check_contact(table, use, contact, displacement, np.flatnonzero([not r for r in reasons]))
    notes = list(beyond.notes)
    if anew.size:
        notes.insert(
            0, f"the displacement jumps in {_lines(table, anew)}, as if set to zero anew: rows of one zero are used together"
        )
    if tared.size:
        notes.insert(
            0, f"the force seems to have another zero from {_lines(table, tared)} on: rows of one zero are used together"
        )
    notes += cycles_told(table, branch.tolist(), cycles)
    notes += stages_told(table, cycles, taken)
    return Observations(
        table=table,
        time=time,
        displacement=displacement,
        channels=channels,
        branch=tuple(branch.tolist()),
        cycle=cycles,
        n_cycle=n_cycle,
        use=use,
        used_cycles=taken,
        loading=loading,
        used=np.array([not r for r in reasons], dtype=bool),
        reason=tuple(reasons),
        signs=signs,
        use_notes=tuple(notes),
    )


def usable_rows(
    obs: Observations, abscissa: FloatArray, values: FloatArray, what: str, among: BoolArray | None = None
) -> IntArray:
    """Find the used rows in which two columns both hold a reading.

    Parameters
    ----------
    obs : one lab file.
    abscissa, values : columns of it, (n_row,), nan where there is no reading.
    what : name of the channel, for the message.
    among : rows to choose from, (n_row,); None for those that are used.

    Returns
    -------
    Row numbers, in order.

    Raises
    ------
    InputError
        If there are fewer than five.
    """
    rows = np.flatnonzero((obs.used if among is None else among) & np.isfinite(abscissa) & np.isfinite(values))
    if rows.size < FEWEST_ROWS:
        reasons = ", ".join(f"{n} x {r}" for r, n in why_left_out(obs).most_common(3))
        unloads = obs.use.branch == "loading" and obs.branch.count("unloading") >= 5
        back = ': if the press is on record only on its way back, say use = { branch = "unloading" }' if unloads else ""
        raise InputError(
            Fault(
                f"only {rows.size} usable rows of {what} on the {obs.use.branch} branch; left out: {reasons or 'none'}",
                obs.table.path,
                advice=f"A sweep needs five rows of a {obs.use.branch} branch at least{back}",
            )
        )
    return rows


def why_left_out(obs: Observations) -> Counter[str]:
    """Rows that are not used by reason, those of all other cycles counted together."""
    others = sorted({int(c) for c, used in zip(obs.cycle, obs.used, strict=True) if c and not used} - set(obs.used_cycles))
    if not others:
        return Counter(r for r in obs.reason if r)
    named = f"cycle {others[0]}" if len(others) == 1 else f"cycles {others[0]} to {others[-1]}"
    together = f"{named} ({use_in_words(obs.use, obs.used_cycles)})"
    of_other = ~np.isin(obs.cycle, obs.used_cycles) & (obs.cycle > 0)
    return Counter(
        together if other and reason.startswith(OF_CYCLE) else reason
        for other, reason in zip(of_other.tolist(), obs.reason, strict=True)
        if reason
    )


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
                advice="Remove rows that stand twice, and put those that were moved back into the order of their time; if the "
                "clock was set back, or the rows are of two tests, save what is before and behind it as two files",
            )
        )
    for row in backward.tolist():
        good[row] = False
        reasons[row] = BACKWARD


def _why_other_zero(table: LabTable, anew: IntArray, tared: IntArray) -> str:
    """Why a row is not used that has not the zeros of those that are."""
    found = [(q, rows) for q, rows in (("displacement", anew), ("force", tared)) if rows.size]
    return "; ".join(
        f"its {quantity} seems to have another zero, as if set anew in {_lines(table, rows)}" for quantity, rows in found
    )


def _lines(table: LabTable, rows: IntArray) -> str:
    shown = ", ".join(str(int(table.lines[r])) for r in rows[:3].tolist())
    more = f" and {rows.size - 3} others" if rows.size > 3 else ""
    return f"line{'s' if rows.size > 1 else ''} {shown}{more}"


def _filled(values: FloatArray) -> FloatArray:
    """Readings with those between for rows without one."""
    there = np.isfinite(values)
    if np.all(there) or not np.any(there):
        return np.where(there, values, 0.0)
    rows = np.arange(values.size)
    return np.interp(rows, rows[there], values[there])
