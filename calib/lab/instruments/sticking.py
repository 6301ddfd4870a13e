"""From the readings of a record to whether rows that leave its course are a ball that sticks as it goes back, and lets go."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from calib.lab.instruments.sheet import Sheet
from calib.lab.stretches import stretches
from models.sensor import FloatArray

# Of the press so much is left at most where the ball begins to pull, and within so many rows before at least so much.
_GONE, _BEFORE, _LEFT = 0.35, 3, 0.01
# Rows that a pull is, at least, and rows in question at most: what is off in more of them is no ball that sticks for a moment.
_FEWEST, _MOST = 2, 5
# Rows at the end of the way back that show the load at rest.
_AT_REST = 3
# Rows beside pull, too, from this share of the largest pull on.
_PULLS = 0.05
# Where the ball has let go the load is as at rest, but for such a share of the press or of the largest pull.
_LET_GO = 0.03
# Readings that stand alone are none of a pull that goes on beside them by more than such a share of it.
_BESIDE = 0.4
# The largest step by which the pull builds up over the largest pull, in a run of few rows, and in a longer one.
_STEP, _FEW, _STEP_OF_MORE = 0.8, 3, 0.65


def sticking(values: Mapping[str, FloatArray], rows: Collection[int], *, apart: bool = False) -> list[tuple[int, int]]:
    """Which runs of rows show a ball that sticks: as it goes back and the press is gone, the load pulls ever more, and lets go.

    One row alone shows nothing of this, and two that are alike, or of which the first is the largest, may be anything.

    Parameters
    ----------
    values : quantity -> readings, nan where there is none, (n_row,).
    rows : rows in question, of the force.
    apart : whether they stand alone, so that the load does not pull nearly as much beside them.

    Returns
    -------
    The first row of each such run, and the one behind it.

    >>> way = np.concatenate([np.arange(12.0), np.arange(12.0)[::-1]])
    >>> load = np.maximum(way - 2, 0) ** 1.5
    >>> load[20:22] = -3.0, -7.0
    >>> sticking({"displacement": way, "force": load}, [20, 21]), sticking({"displacement": way, "force": load}, [21])
    ([(20, 22)], [])
    """
    if not {"displacement", "force"} <= set(values):
        return []
    there = np.flatnonzero(np.isfinite(values["displacement"]) & np.isfinite(values["force"]))
    place, load = values["displacement"][there], values["force"][there]
    asked = np.isin(there, list(rows))
    runs = [
        (a, b)
        for a, b in stretches(asked)
        if _FEWEST <= b - a <= _MOST and _sticks(place, load, a, b, _BESIDE if apart else 1.0)
    ]
    return [(int(there[a]), int(there[b - 1]) + 1) for a, b in runs]


def told_of_sticking(sheet: Sheet, index: int, first: int, behind: int) -> str:
    """What to tell of a run of rows that are read as a ball that sticks.

    Parameters
    ----------
    sheet : the record.
    index : of the column of the force.
    first, behind : first row of the run, from 0, and the one behind it.
    """
    lines, cells = sheet.lines[[first, behind - 1]].tolist(), sheet.columns[index]
    shown = f'("{cells[first].strip()[:40]}" to "{cells[behind - 1].strip()[:40]}")'
    return f"lines {lines[0]} to {lines[1]}: force pulls {shown} and lets go as the ball comes off: read as a ball that sticks"


def _sticks(place: FloatArray, load: FloatArray, first: int, behind: int, most: float) -> bool:
    """Whether a run of rows is one of a ball that sticks, which pulls by at most a share (`most`) of the largest pull beside.

    Each row of the record has a reading of both.
    """
    if first < _BEFORE or behind >= place.size:
        return False
    way = np.sign(place[behind] - place[first - 1])
    goes_on = np.append(np.diff(place) * way >= 0, False)
    if way == 0 or not np.all(goes_on[first - 1 : behind]):
        return False
    turn = first - 1 - int(np.argmin(np.append(goes_on[: first - 1][::-1], False)))
    end = behind + 1 + int(np.argmin(goes_on[behind:]))
    rest = float(np.median(load[max(behind, end - _AT_REST) : end]))
    pulls = (rest - load[turn:end]) * np.sign(load[turn] - rest)
    first, behind = first - turn, behind - turn
    least = _PULLS * float(np.max(pulls[first:behind]))
    # What seems to be off beside the pull, as the last of the press or the first at rest, is none of it.
    of_pull = first + np.flatnonzero(pulls[first:behind] > least)
    if of_pull.size < _FEWEST or np.any(np.diff(pulls[first - 1 : of_pull[0] + 1]) < 0):
        return False
    first, behind = int(of_pull[0]), int(of_pull[-1]) + 1
    asked = np.arange(first, behind)
    first -= int(np.argmin(np.append(pulls[:first][::-1] > least, False)))
    behind += int(np.argmin(np.append(pulls[behind:] > least, False)))
    beside = np.delete(pulls[first:behind], asked - first)
    if first < _BEFORE or least <= 0 or np.max(beside, initial=0.0) > most * float(np.max(pulls[asked])):
        return False
    run, press = pulls[first:behind], -pulls[0]
    gone = -pulls[first - 1] <= _GONE * press and float(np.max(-pulls[first - _BEFORE : first])) >= _LEFT * press
    lets_go = behind < pulls.size and abs(pulls[behind]) <= _LET_GO * max(press, float(np.max(run)))
    peak = int(np.argmax(run))
    step = float(np.max(np.diff(run[: peak + 1], prepend=0.0))) / float(run[peak])
    builds_up = peak > 0 and step <= (_STEP if run.size <= _FEW else _STEP_OF_MORE)
    return bool(gone and lets_go and builds_up and np.min(run) > 0)
