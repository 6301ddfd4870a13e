"""From the readings of a record to its rows that stand in it a second time, as those of a block that was pasted twice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray, IntArray

# A block has so many rows at least: fewer may agree by chance where readings are coarse.
_FEWEST = 3
# A time that falls, or a displacement that leaps, more often is none that a block or two make so.
_MOST = 20
# Without a time a displacement leaps by so many steps beside, and as many usual ones, where a block begins that has so many
# rows, and goes on behind it by no more than so many of them.
_LEAP, _FEWEST_WITHOUT, _GOES_ON = 2.5, 4, 1.5


def pasted_rows(values: Mapping[str, FloatArray]) -> dict[int, int]:
    """Find the rows of blocks that repeat rows above, time and all readings, behind which time goes on as if they were not.

    Without a time the displacement leaps where they begin, and goes on behind them as if they were not. A block in which no
    reading moves is none of these: a clock that was set back before contact reads so, too.

    Parameters
    ----------
    values : what was read, nan where there is nothing, (n_row,) each.

    Returns
    -------
    Row from 0 -> the row that it repeats.
    """
    by = next((q for q in ("time", "displacement") if q in values), "")
    if not by or len(values) < 2:
        return {}
    course, timed = values[by], by == "time"
    begins = np.flatnonzero(np.diff(course) < 0) + 1 if timed else _leaps(course)
    if begins.size > _MOST:
        return {}
    table = np.array([course, *(v for q, v in values.items() if q != by)])
    found: dict[int, int] = {}
    for first in begins.tolist():
        for above in np.flatnonzero(course[:first] == course[first]).tolist():
            n = _n_alike(table, above, first)
            behind = first + n
            on = behind == course.size or behind in begins or _goes_on(course, first, behind, timed=timed)
            fewest = _FEWEST if timed else _FEWEST_WITHOUT
            if n >= fewest and on and np.any(np.diff(table[1:, first:behind], axis=1) != 0):
                found |= {first + k: above + k for k in range(n)}
                break
    return found


def pasted_beside_clock(sheet: Sheet, values: Mapping[str, FloatArray]) -> list[Fault]:
    """Refuse a record whose readings stand in it a second time while its clock goes on: behind them it is of other rows.

    Parameters
    ----------
    sheet : the record.
    values : as of `pasted_rows`.
    """
    if "time" not in values or not np.all(np.diff(values["time"]) > 0):
        return []
    again = pasted_rows({q: v for q, v in values.items() if q != "time"})
    behind = max(again, default=-1) + 1
    if not again or behind == len(sheet.lines):
        return []  # cycles that are alike to the last digit, as simulated ones, end with the record
    first, last, above = (int(sheet.lines[r]) for r in (min(again), max(again), again[min(again)]))
    message = (
        f"lines {first} to {last} hold the readings of the lines from {above} on once more, to the last digit, and the "
        "readings go on behind them as if they were not there, but the clock does not: it was not moved with them"
    )
    advice = "Take these readings out and move those below up, or leave the time out: --columns time=none"
    return [Fault(message, sheet.text.path, first, advice=advice)]


def _leaps(x: FloatArray) -> IntArray:
    """The rows from 0 to which a displacement leaps."""
    steps = np.abs(np.diff(x))
    moves = steps[steps > 0]
    if steps.size < _FEWEST_WITHOUT or not moves.size:
        return np.zeros(0, dtype=np.int64)
    beside = np.maximum(np.append(0, steps[:-1]), np.append(steps[1:], 0))
    return np.flatnonzero(steps > _LEAP * np.maximum(beside, np.median(moves))) + 1


def _goes_on(course: FloatArray, first: int, behind: int, *, timed: bool) -> bool:
    """Whether a time, or a displacement, goes on behind a block as if it were not there."""
    if timed:
        return bool(course[behind] > np.nanmax(course[:first]))
    steps = np.abs(np.diff(course))
    usual = float(np.nanmax(np.concatenate([steps[max(first - 4, 0) : first - 1], steps[behind : behind + 3]]), initial=0.0))
    return bool(abs(course[behind] - course[first - 1]) <= _GOES_ON * usual)


def _n_alike(table: FloatArray, above: int, first: int) -> int:
    """How many rows from `first` on are those from `above` on, which end where the others begin."""
    n = min(first - above, table.shape[1] - first)
    one, other = table[:, above : above + n], table[:, first : first + n]
    alike = np.all((one == other) | (np.isnan(one) & np.isnan(other)), axis=0)
    return n if np.all(alike) else int(np.argmin(alike))
