"""From the columns of a record to the blocks of one of them whose cells stand in reversed order, as pasted upside down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import median_filter

from calib.errors import Choice, Fault
from calib.lab.instruments.jumps import CAPACITANCES
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import SMOOTH, least_apart, noise_of
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from models.sensor import BoolArray, FloatArray

# Readings of a record, and of a block, at least.
_FEWEST, _LEAST = 40, 8
# A block begins and ends with a leap of so many noises and such a share of the range, so many times the steps beside it; of so
# many steps beside it the middle one is how the channel goes on. Where more leap, nothing is told.
_NOISES, _SHARE, _STEPS, _BESIDE, _MOST = 8.0, 0.01, 2.0, 9, 60
# Put round, the block goes on within so many noises and such a share of a step; the leaps are so many times as large, and as
# any within it.
_GOES_ON, _OF_STEP, _FARTHER = 4.0, 0.5, 2.5
# The last digit is told by so many readings on either side, as rows may be rounded.
_DIGIT = 12
# Another channel leaps by less than such a share of its range where this one does, and goes with it outside of the block.
_SHOWS, _GOES_WITH = 0.3, 0.5
# Over so many readings on either side of a leap it does not turn, by such a share of its range.
_NEAR, _STILL = 4, 0.005
# It moves by such a share of its range within the block, and ends by such a share of that from where it began, or comes back.
_MOVES, _NET = 0.1, 0.3


def upside_down(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading) -> list[Fault]:
    """List the columns of which a block of cells stands in reversed order, while the others go on.

    Such a block begins and ends with a leap that no other channel shows, and either is gone if the block is put round. A load
    that slips and builds up again leaps the other way than the ball goes, and so is none.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    judged = [c for c in columns if c.quantity in SMOOTH and c.quantity in values]
    faults = []
    for column in judged:
        beside = [values[q] for q in SMOOTH if q in values and stands_for(q) != stands_for(column.quantity)]
        block = _block_of(values[column.quantity], beside)
        if block is not None and not is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            faults.append(_fault(sheet, [column], block, reading))
    ball = [values["displacement"]] if "displacement" in values and not faults else []
    forces, others = ([c for c in judged if (c.quantity == "force") == of_force] for of_force in (True, False))
    for one, other in ((a, b) for a in forces for b in others if b.quantity in CAPACITANCES and ball):
        # Load and capacitance that were put round together each seem to be shown by the other.
        blocks = [_block_of(values[c.quantity], ball) for c in (one, other)]
        said = any(is_confirmed(sheet, c.index, c.heading, c.factor, reading) for c in (one, other))
        if blocks[0] is not None and blocks[0] == blocks[1] and not said:
            faults.append(_fault(sheet, [one, other], blocks[0], reading))
    return faults


def _block_of(own: FloatArray, beside: Sequence[FloatArray]) -> tuple[int, int] | None:
    """The first and the last row of a block of a channel that stands in reversed order beside others; None without one."""
    rows = np.flatnonzero(np.isfinite(own))
    if rows.size < _FEWEST or not _leaps(own[rows], np.diff(own[rows])):
        return None
    there = [np.flatnonzero(np.isfinite(other)) for other in beside]
    others = [np.interp(rows, at, other[at]) for at, other in zip(there, beside, strict=True) if at.size]
    block = _block(own[rows], others) if others else None
    return (int(rows[block[0]]), int(rows[block[1]])) if block is not None else None


def _fault(sheet: Sheet, columns: Sequence[ReadColumn], block: tuple[int, int], reading: Reading) -> Fault:
    """What to say of columns of which the same block stands in reversed order."""
    first, last = block
    column, lines = columns[0], (int(sheet.lines[first]), int(sheet.lines[last]))
    cells, quantity = sheet.columns[column.index], stands_for(column.quantity)
    names = " and ".join(f'"{sheet.names[c.index]}"' for c in columns)
    message = (
        f"column{'s' if len(columns) > 1 else ''} {names}: the cells of lines {lines[0]} to {lines[1]} seem to stand in "
        f'reversed order ("{cells[first].strip()[:40]}" to "{cells[last].strip()[:40]}"): put round, they go on from those '
        "before and behind"
    )
    unit = unit_in_words(sheet, column.index, column.heading, reading)
    leave = f"leave the column out: {Choice('columns', ('none',), quantity)}" if len(columns) == 1 else "remove these lines"
    advice = (
        f"Put these cells round again, or export the record again, or {leave}; if they are right, let the header name the unit "
        f"and say it once more: --units {quantity}={unit}"
    )
    return Fault(message, sheet.text.path, lines[0], column.index + 1, advice=advice)


def _block(y: FloatArray, others: Sequence[FloatArray]) -> tuple[int, int] | None:
    """The first and the last reading of a block that stands in reversed order; None if there is none."""
    steps = np.diff(y)
    if not _leaps(y, steps):
        return None
    usual = median_filter(steps, size=_BESIDE, mode="nearest")
    off = steps - usual
    noise = max(min(noise_of(y), noise_of(y, 3)), least_apart(y) / 2)
    floor = max(_NOISES * noise, _SHARE * float(np.ptp(y)))
    at = np.flatnonzero((np.abs(off) > floor) & (np.abs(off) > _STEPS * np.abs(usual)))
    at = at[(at >= _BESIDE) & (at < steps.size - _BESIDE)]
    if at.size < 2 or at.size > _MOST:
        return None
    at = at[~_shown(at, off, float(np.ptp(y)), others)]
    for k, i in enumerate(at.tolist()):
        ends = at[k + 1 :]
        ends = ends[(ends - i >= _LEAST) & (off[ends] * off[i] > 0)]
        for j in ends.tolist():
            ahead, behind = float(np.median(steps[i - 5 : i])), float(np.median(steps[j + 1 : j + 6]))
            digit = max(least_apart(y[max(e - _DIGIT, 0) : e + _DIGIT]) for e in (i, j))
            near = _GOES_ON * max(noise, digit / 2) + _OF_STEP * max(abs(ahead), abs(behind))
            across = abs(y[j] - y[i] - ahead), abs(y[i + 1] - y[j + 1] + behind)
            if (
                max(across) < near
                and min(abs(off[i]), abs(off[j])) > _FARTHER * max(near, float(np.max(np.abs(off[i + 1 : j]))))
                and _contrary(y, i, j, others, alone=at.size == 2)
            ):
                return i + 1, j
    return None


def _leaps(y: FloatArray, steps: FloatArray) -> bool:
    """Whether two steps may be ends of a block, which is told at once of most columns."""
    return bool(np.count_nonzero(np.abs(steps) > _SHARE * float(np.ptp(y)) / 2) > 1)


def _shown(at: IntArray, off: FloatArray, span: float, others: Sequence[FloatArray]) -> BoolArray:
    """Whether another channel leaps where one does, in the shares of their ranges."""
    seen = np.zeros(at.size, dtype=bool)
    for other in others:
        steps = np.diff(other)
        bend = np.abs(steps[at] - median_filter(steps, size=_BESIDE, mode="nearest")[at])
        seen |= bend / max(float(np.ptp(other)), 1e-300) > _SHOWS * np.abs(off[at]) / span
    return seen


def _contrary(y: FloatArray, i: int, j: int, others: Sequence[FloatArray], *, alone: bool) -> bool:
    """Whether all other channels go on at the ends of a block, and move over it as it would if it were put round."""
    outside = np.concatenate([np.arange(i + 1), np.arange(j + 1, y.size)])
    for other in others:
        with_it = float(np.corrcoef(y[outside], other[outside])[0, 1]) if np.ptp(other[outside]) > 0 else 0.0
        moved, net = float(np.ptp(other[i : j + 2])), float(other[j + 1] - other[i])
        if abs(with_it) < _GOES_WITH or moved < _MOVES * float(np.ptp(other)):
            return False
        still = _STILL * float(np.ptp(other))
        ways = [(other[e] - other[e - _NEAR], other[e + 1 + _NEAR] - other[e + 1]) for e in (i, j)]
        if any(ahead * behind < 0 and min(abs(ahead), abs(behind)) > still for ahead, behind in ways):
            return False  # a press may leap by itself where the ball turns
        again = sum(ways[0]) * sum(ways[1]) >= 0
        if abs(net) <= _NET * moved and (again or not alone):
            return False  # what comes back in each of several cycles
        if abs(net) > _NET * moved and net * with_it * (y[i + 1] - y[i]) < 0:
            return False
    return True
