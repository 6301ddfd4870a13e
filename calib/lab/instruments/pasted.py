"""From the readings of a record to its rows that stand in it a second time, as those of a block that was pasted twice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from models.sensor import FloatArray

# A block has so many rows at least: fewer may agree by chance where readings are coarse.
_FEWEST = 3
# A time that falls more often is none that a block or two make fall.
_MOST_FALLS = 20


def pasted_rows(values: Mapping[str, FloatArray]) -> dict[int, int]:
    """Find the rows of blocks that repeat rows above, time and all readings, behind which time goes on as if they were not.

    A block in which no reading moves is none of these: a clock that was set back before contact reads so, too.

    Parameters
    ----------
    values : what was read, nan where there is nothing, (n_row,) each.

    Returns
    -------
    Row from 0 -> the row that it repeats.
    """
    if "time" not in values or len(values) < 2:
        return {}
    time = values["time"]
    falls = np.flatnonzero(np.diff(time) < 0) + 1
    if falls.size > _MOST_FALLS:
        return {}
    table = np.array([time, *(v for q, v in values.items() if q != "time")])
    found: dict[int, int] = {}
    for first in falls.tolist():
        highest = np.nanmax(time[:first])
        for above in np.flatnonzero(time[:first] == time[first]).tolist():
            n = _n_alike(table, above, first)
            behind = first + n
            goes_on = behind == time.size or behind in falls or time[behind] > highest
            if n >= _FEWEST and goes_on and np.any(np.diff(table[1:, first:behind], axis=1) != 0):
                found |= {first + k: above + k for k in range(n)}
                break
    return found


def _n_alike(table: FloatArray, above: int, first: int) -> int:
    """How many rows from `first` on are those from `above` on, which end where the others begin."""
    n = min(first - above, table.shape[1] - first)
    one, other = table[:, above : above + n], table[:, first : first + n]
    alike = np.all((one == other) | (np.isnan(one) & np.isnan(other)), axis=0)
    return n if np.all(alike) else int(np.argmin(alike))
