"""From the branches of a record and a `Use` to the cycles that are used, why another row is not, and what a refusal says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from calib.errors import Fault, InputError
from calib.lab.instruments import IntArray, LabTable
from calib.lab.limits import ContactOnset, columns_in_words
from calib.lab.use import Use
from models.sensor import BoolArray, FloatArray

LOADING = "loading branch (unloading is used)"
UNLOADING = "unloading branch (hysteresis is not modelled)"
HOLD = "hold (crosshead standing still)"
BEFORE = "before the first loading branch"
#: Rows of a channel without which there is no sweep.
FEWEST_ROWS = 5
#: How the reason of a row of a cycle that is not used begins.
OF_CYCLE = ("loading branch of cycle", "unloading branch of cycle")


def why_not(label: str, cycle: int, used: Sequence[int], use: Use, which: str, *, repeat: bool) -> str:
    """Say why a sound row is not used: its branch, or its cycle.

    Parameters
    ----------
    label, cycle, repeat : of the row: its branch, the cycle it belongs to, whether it loads again within that.
    used : cycles that are used.
    use : the part that is used.
    which : the cycles that are used, in words.
    """
    if label in ("hold", ""):
        return HOLD if label else "a single reading"
    if cycle == 0 and cycle not in used:
        return BEFORE if used else UNLOADING
    if cycle not in used:
        return f"{label} branch of cycle {cycle} ({which})"
    if repeat:
        return f"loading again in cycle {cycle}, to less than half of the largest excursion"
    return UNLOADING if label == "unloading" else LOADING


def used_cycles(table: LabTable, use: Use, n_cycle: int, branch: npt.NDArray[np.object_], cycles: IntArray) -> tuple[int, ...]:
    """Find which cycles are used; 0 for the unloading of a record that starts pressed, and where nothing tells cycles.

    Parameters
    ----------
    table : the file, for refusals.
    use : the part that is wanted.
    n_cycle : cycles in the file.
    branch, cycles : of each row, (n_row,).

    Raises
    ------
    InputError
        If a cycle is asked for that is not there.
    """
    missing = [c for c in use.cycles if not 1 <= c <= n_cycle]
    if missing:
        has = f"{n_cycle} loading branch{'' if n_cycle == 1 else 'es'}"
        choice = "Choose cycle 1" if n_cycle == 1 else f"Choose cycles from 1 to {n_cycle}"
        otherwise = "; a file that counts them otherwise can be a sweep of its own"
        advice = choice + otherwise if n_cycle else "Leave the cycles out"
        raise InputError(Fault(f"there is no cycle {missing[0]}, the file has {has}", table.path, advice=advice))
    if use.cycles:
        return use.cycles
    if use.branch == "unloading":
        there = np.unique(cycles[branch == "unloading"])
        return (1,) if 1 in there or there.size == 0 else (int(there[0]),)
    if n_cycle:
        return (1,)
    return () if np.any(branch != "") else (0,)


def nothing_left(
    table: LabTable, use: Use, channels: Mapping[str, FloatArray], chosen: BoolArray, branch: npt.NDArray[np.object_]
) -> Fault:
    """Refuse a use that leaves no row of a file.

    Parameters
    ----------
    table, channels : the file, and its readings, compression positive.
    use : the part that is wanted.
    chosen : rows of its branch and cycles, before any limit, (n_row,).
    branch : of each row, (n_row,).
    """
    rows = np.flatnonzero(chosen)
    if rows.size == 0:
        there = [f"{int(np.sum(branch == b))} rows of {b}" for b in ("loading", "unloading", "hold") if np.any(branch == b)]
        found = f"the record has no {use.branch} branch to use, but {', '.join(there) or 'no branch at all'}"
        other = "loading" if use.branch == "unloading" else "unloading"
        return Fault(found, table.path, advice=f'Leave the branch out, or say branch = "{other}" if that is what is wanted')
    least = f", where the force is {np.nanmin(channels['force'][rows]):.4g} N and more" if "force" in channels else ""
    return Fault(
        f"{_limits(use)} none of the {rows.size} rows of the {use.branch} branch{least}",
        table.path,
        int(table.lines[rows[0]]),
        advice="Give larger limits, or leave them out",
    )


def _limits(use: Use) -> str:
    """The limits of a use as the beginning of what they leave."""
    said = [f"max_force = {use.max_force:.6g} N"] if use.max_force is not None else []
    said += [f"max_depth = {use.max_depth * 1e3:.6g} mm"] if use.max_depth is not None else []
    return f"{' and '.join(said)} {'leaves' if len(said) == 1 else 'leave'}"


def check_contact(table: LabTable, use: Use, contact: ContactOnset, displacement: FloatArray, kept: IntArray) -> None:
    """Refuse limits that end before the press begins: what they leave holds nothing of the sensor.

    Parameters
    ----------
    table : the file, for refusals.
    use : with a limit.
    contact : where contact begins.
    displacement : [m], (n_row,), compression positive.
    kept : rows that the limits leave.

    Raises
    ------
    InputError
        If fewer rows than a sweep needs lie beyond contact.
    """
    n = int(np.sum(displacement[kept] > contact.reading))
    if n < FEWEST_ROWS:
        deepest = f"; what is left ends at {np.nanmax(displacement[kept]) * 1e3:.5g} mm"
        raise InputError(
            Fault(
                f"{_limits(use)} {n or 'no'} row{'' if n == 1 else 's'} in contact, which begins at "
                f"{contact.reading * 1e3:.5g} mm ({contact.words}){deepest}",
                table.path,
                int(table.lines[kept[-1]]),
                advice=f"Give larger limits: a sweep needs {FEWEST_ROWS} rows in contact, and lives on a hundred and more",
            )
        )


def nothing_tells(table: LabTable) -> Fault:
    """Refuse to look for a part in a file that tells nothing of branches."""
    return Fault(
        "without a displacement or force column nothing tells the cycles and branches of this file, nor how deep its rows are: "
        f"it has {columns_in_words(table)}",
        table.path,
        advice="Say which part is used of the tester's file, to which this one is tied by time",
    )
