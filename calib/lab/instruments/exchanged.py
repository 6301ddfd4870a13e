"""From the columns of a record to the rows in which, or from which on, two of them have changed places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import least_apart, noise_of
from models.sensor import FloatArray

# Quantities of which each reading is near to those beside it.
_JUDGED = ("time", "displacement", "force", "capacitance", "capacitance_series")
# Steps of which both columns jump by so many at least, and by so few if they are read across.
_JUMP, _ACROSS = 3.0, 1.5
# Readings on either side whose steps are looked at.
_NEAR = 4
# Rows in succession that changed places and were put back, and by how many noises and last digits they show it.
_MOST_ROWS, _NOISES, _DIGITS = 40, 8.0, 4.0


def exchanged_rows(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray]) -> dict[int, str]:
    """Find rows whose cells of two columns have changed places: each goes on, before and behind, in the other column.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).

    Returns
    -------
    Row from 0 -> why it is not usable.
    """
    found: dict[int, str] = {}
    for one, other in combinations(_written(columns, values).items(), 2):
        for row in _rows_of(one[1], other[1]):
            names = " and ".join(f'"{sheet.names[c.index]}"' for c in (one[0], other[0]))
            cells = " and ".join(f'"{sheet.columns[c.index][row].strip()[:40]}"' for c in (one[0], other[0]))
            found.setdefault(row, f"the cells of {names} seem to have changed places ({cells}): each goes on in the other")
    return found


def exchanged(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray]) -> list[Fault]:
    """List the pairs of columns whose readings go on in the other column from a row on.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    """
    written = _written(columns, values)
    faults = []
    for one, other in combinations(written, 2):
        row = _row_of(written[one], written[other])
        if row is not None:
            names = " and ".join(f'"{sheet.names[c.index]}"' for c in (one, other))
            cells = " and ".join(f'"{sheet.columns[c.index][row].strip()[:40]}"' for c in (one, other))
            message = f"the columns {names} seem to have changed places from this line on ({cells}): each goes on in the other"
            advice = "Put the cells of these rows into their columns again, or save the rows below in a file of their own"
            faults.append(Fault(message, sheet.text.path, int(sheet.lines[row]), one.index + 1, advice=advice))
    return faults


def _written(columns: Sequence[ReadColumn], values: Mapping[str, FloatArray]) -> dict[ReadColumn, FloatArray]:
    """The readings of columns as numbers in their own units."""
    return {c: values[c.quantity] / c.factor for c in columns if c.quantity in _JUDGED and c.quantity in values and not c.clock}


def _rows_of(a: FloatArray, b: FloatArray) -> list[int]:
    """The rows in which two columns hold each other's readings, between others in which they do not."""
    rows = np.flatnonzero(np.isfinite(a) & np.isfinite(b))
    if rows.size < 4 * _NEAR:
        return []
    both = np.stack([a[rows], b[rows]])
    steps, at = np.abs(np.diff(both)), np.arange(rows.size - 1)
    for y, step in zip(both, steps, strict=True):
        # In most records no step of one of them is large, which ends it.
        at = at[step[at] > max(_NOISES * noise_of(y), _DIGITS * least_apart(y))] if at.size else at
    across = np.abs(both[::-1, at + 1] - both[:, at])
    at = at[np.all(across * _JUMP < steps[:, at], axis=0)]
    found: list[int] = []
    for i, j in pairwise(at[: 2 * _MOST_ROWS].tolist()):
        low, high = max(i - _NEAR + 1, 0), j + _NEAR + 1
        if j - i > _MOST_ROWS or (found and int(rows[i]) <= found[-1]):
            continue
        mended = both[:, low:high].copy()
        mended[:, i + 1 - low : j + 1 - low] = mended[::-1, i + 1 - low : j + 1 - low]
        own = np.max(np.abs(np.diff(mended)), axis=1)
        if np.all(np.minimum(steps[:, i], steps[:, j]) > _JUMP * own):
            found += rows[i + 1 : j + 1].tolist()
    return found


def _row_of(a: FloatArray, b: FloatArray) -> int | None:
    """The first row from which on two columns go on in each other's place."""
    rows = np.flatnonzero(np.isfinite(a) & np.isfinite(b))
    if rows.size < 4 * _NEAR:
        return None
    if rows.size < a.size:
        a, b = a[rows], b[rows]
    first = np.abs(np.diff(a))
    # A step that is large beside all near it is so beside the one before.
    at = 1 + np.flatnonzero(first[1:] > _JUMP * first[:-1])
    near = np.abs(b[at + 1] - a[at]) * _JUMP < first[at] * _ACROSS
    near &= np.abs(a[at + 1] - b[at]) * _JUMP < np.abs(b[at + 1] - b[at]) * _ACROSS
    both = at[near]
    if not both.size:
        return None
    steps = first, np.abs(np.diff(b))
    across = np.abs(b[1:] - a[:-1]), np.abs(a[1:] - b[:-1])
    for j in both[:100].tolist():
        if j < 2 or j + 3 > steps[0].size:
            continue
        # Steps of what stands in the first column before and in the second behind, and the other way round.
        own = [max(np.max(s[max(j - _NEAR, 0) : j]), np.max(t[j + 1 : j + 1 + _NEAR])) for s, t in (steps, steps[::-1])]
        if all(across[k][j] <= _ACROSS * own[k] and steps[k][j] > _JUMP * own[k] for k in (0, 1)):
            return int(rows[j + 1])
    return None
