"""From the rows of a branch and the limits of a `Use` to those that lie beyond, with reasons, and where depth counts from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import median_filter

from calib.errors import Fault, InputError
from calib.lab.instruments import IntArray, LabTable
from calib.lab.onset import fine_onset, flat_part
from calib.lab.use import Branch, Use
from models.sensor import BoolArray, FloatArray


@dataclass(frozen=True)
class ContactOnset:
    """Where contact is taken to begin on the crosshead's reading [m], and in words what shows it."""

    reading: float
    words: str


@dataclass(frozen=True)
class Beyond:
    """Rows that a limit leaves out with the reason of each, and in words what the limits mean in this file."""

    reasons: Mapping[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def contact_of(displacement: FloatArray, channels: Mapping[str, FloatArray], loading: IntArray) -> ContactOnset | None:
    """Estimate where contact begins, from the channel that shows it on a loading branch: the force if there is one.

    Parameters
    ----------
    displacement : [m], (n_row,), compression positive.
    channels : name -> readings, (n_row,).
    loading : rows of a loading branch, in the order of reading.

    Returns
    -------
    None without five readings of a channel.
    """
    name = next((n for n in ("force", "capacitance") if n in channels), None)
    if name is None:
        return None
    rows = loading[np.isfinite(displacement[loading]) & np.isfinite(channels[name][loading])]
    if rows.size < 5:
        return None
    x, y = displacement[rows], channels[name][rows]
    if name != "force" and np.mean(y[-(rows.size // 5 + 1) :]) < np.mean(y[: rows.size // 5 + 1]):
        y = -y
    found = fine_onset(x, y)
    if found is not None:
        return ContactOnset(found[0], f"where {name} leaves its flat part")
    flat = flat_part(x, y)
    if np.any(flat):
        return ContactOnset(float(np.max(x[flat])), f"where {name} leaves its flat part")
    return ContactOnset(float(x[0]), "its first reading, as the record starts in contact: the true depth is larger")


def limits_of(
    use: Use,
    table: LabTable,
    displacement: FloatArray | None,
    channels: Mapping[str, FloatArray],
    stretches: Sequence[IntArray],
    contact: ContactOnset | None,
) -> Beyond:
    """Find the rows that the limits of a use leave out.

    Parameters
    ----------
    use : with or without limits.
    table : the file, for refusals.
    displacement, channels : [m] and SI, (n_row,), compression positive; None for a file without displacement.
    stretches : rows of the branch that is used, cycle by cycle, in the order of reading.
    contact : where depth counts from.

    Raises
    ------
    InputError
        If the file has no column that a limit speaks of, or a limit is not positive, though the load at rest is not below it.
    """
    if use.max_depth is not None and not use.max_depth > 0:
        shown = f"{use.max_depth * 1e3:.6g} mm"
        raise InputError(
            Fault(f"max_depth must be positive, got {shown}", table.path, advice="Leave max_depth out for no limit")
        )
    if use.max_force is not None and not use.max_force > 0 and "force" in channels:
        _check_against_rest(use.max_force, table, channels["force"], displacement, stretches, contact)
    reasons: dict[int, str] = {}
    notes: list[str] = []
    if use.max_force is not None:
        if "force" not in channels:
            raise InputError(_nothing_to_limit(table, "max_force", "force", "max_depth", "0.5 mm"))
        limit = f"{use.max_force:.6g} N"
        out = np.flatnonzero(_rows_beyond(channels["force"], use.max_force, stretches, use.branch))
        reasons |= dict.fromkeys(out.tolist(), f"more force than max_force = {limit}")
        notes.append(f"used up to {limit} of force as read, its zero not taken off: {_rows(out.size)} beyond")
    if use.max_depth is not None:
        if displacement is None or contact is None:
            raise InputError(_nothing_to_limit(table, "max_depth", "displacement", "max_force", "5 N"))
        limit = f"{use.max_depth * 1e3:.6g} mm"
        out = np.flatnonzero(_rows_beyond(displacement - contact.reading, use.max_depth, stretches, use.branch))
        reasons = dict.fromkeys(out.tolist(), f"deeper than max_depth = {limit} after contact") | reasons
        notes.append(
            f"used up to a depth of {limit}, counted from contact at {contact.reading * 1e3:.5g} mm ({contact.words}): "
            f"{_rows(out.size)} beyond"
        )
    return Beyond(reasons, tuple(notes))


# The load at rest is that of the lowest readings, of this share of a branch; a limit is above it by this share of the range.
_AT_REST, _ABOVE_REST = 0.1, 0.02


def _check_against_rest(
    limit: float,
    table: LabTable,
    force: FloatArray,
    displacement: FloatArray | None,
    stretches: Sequence[IntArray],
    contact: ContactOnset | None,
) -> None:
    """Refuse a limit of the force that is not positive where the load at rest is not below it: it would leave no press.

    A load that was not tared may be below zero as long as the ball is, and a limit of it, too.
    """
    rows = np.concatenate([*stretches, np.zeros(0, dtype=np.int64)])
    readings = np.sort(force[rows][np.isfinite(force[rows])])
    if not readings.size:
        return
    rest, largest = float(np.median(readings[: max(1, round(_AT_REST * readings.size))])), float(readings[-1])
    if limit > rest + _ABOVE_REST * (largest - rest):
        return
    asked = "must be positive" if rest + _ABOVE_REST * (largest - rest) >= 0 else "must be above the load at rest"
    ways = [f'max_force = "{rest + 0.5 * (largest - rest):.3g} N"']
    if displacement is not None and contact is not None:
        deepest = float(np.nanmax(displacement[rows])) - contact.reading
        ways += [f'max_depth = "{0.5e3 * deepest:.3g} mm"'] if deepest > 0 else []
    listed = " or ".join(f"{way} ({way.replace('max_', '--max-', 1).replace(' = ', ' ')})" for way in ways)
    raise InputError(
        Fault(
            f"max_force {asked}, got {limit:.6g} N: the load at rest is {rest:.4g} N, the largest {largest:.4g} N",
            table.path,
            advice=f"Leave max_force out for no limit; or say how far it is used, as by {listed}",
        )
    )


def _rows(n: int) -> str:
    return f"{n} row{'' if n == 1 else 's'}"


def columns_in_words(table: LabTable) -> str:
    """Name the columns that are read of a file, as they are written in it."""
    return ", ".join(f'"{source}"' for source in table.sources.values()) or "no column"


def _nothing_to_limit(table: LabTable, key: str, column: str, other: str, example: str) -> Fault:
    option = f'--{other.replace("_", "-")} "{example}"'
    return Fault(
        f"{key} says nothing of this file, which has no {column} column: it has {columns_in_words(table)}",
        table.path,
        advice=f'Say how far it is used by {other} (use = {{ {other} = "{example}" }}, or {option})',
    )


def _rows_beyond(values: FloatArray, limit: float, stretches: Sequence[IntArray], branch: Branch) -> BoolArray:
    """Rows of the branch beyond a limit: all from where it is passed, and single readings above it.

    A limit that only took out readings above it would keep the low ones among the noise at the limit, and bias the last points.
    """
    found = np.zeros(values.size, dtype=bool)
    for rows in stretches:
        own = rows[np.isfinite(values[rows])]
        if own.size == 0:
            continue
        reading = values[own]
        level = median_filter(reading, size=5, mode="nearest") if own.size >= 5 else reading
        passed = np.flatnonzero(level > limit)
        if passed.size:
            edge = int(own[passed[0 if branch == "loading" else -1]])
            found[rows[rows >= edge] if branch == "loading" else rows[rows <= edge]] = True
        found[own[reading > limit]] = True
    return found
