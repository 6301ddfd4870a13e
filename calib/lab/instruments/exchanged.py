"""From the columns of a record to the row from which on two of them have changed places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# Quantities of which each reading is near to those beside it.
_JUDGED = ("time", "displacement", "force", "capacitance", "capacitance_series")
# Steps of which both columns jump by so many at least, and by so few if they are read across.
_JUMP, _ACROSS = 3.0, 1.5
# Readings on either side whose steps are looked at.
_NEAR = 4


def exchanged(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray]) -> list[Fault]:
    """List the pairs of columns whose readings go on in the other column from a row on.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    """
    written = {
        c: values[c.quantity] / c.factor for c in columns if c.quantity in _JUDGED and c.quantity in values and not c.clock
    }
    faults = []
    for one, other in combinations(written, 2):
        row = _row_of(written[one], written[other])
        if row is not None:
            names = " and ".join(f'"{sheet.names[c.index]}"' for c in (one, other))
            cells = " and ".join(f'"{sheet.columns[c.index][row].strip()[:40]}"' for c in (one, other))
            message = f"the columns {names} have changed places from this line on ({cells}): each goes on in the other"
            advice = "Put the cells of these rows into their columns again, or save the rows below in a file of their own"
            faults.append(Fault(message, sheet.text.path, int(sheet.lines[row]), one.index + 1, advice=advice))
    return faults


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
