"""From rows that something beside them puts in doubt to those that continue the record, and are readings all the same."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import numpy as np

from calib.lab.instruments.clock import read_clock
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.lines import Table
from calib.lab.instruments.numbers import parse_number
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# Rows on either side with which a row is compared, and a block of rows at each of its ends, by the middle of a few of its own.
_NEAR, _BESIDE_BLOCK, _OF_BLOCK = 3, 8, 3
# So many rows in succession are a block.
_BLOCK = 10


def rows_going_on(sheet: Sheet, table: Table, rows: Collection[int], *, whole: bool) -> set[int]:
    """Find those of some rows whose time and readings go on from the rows beside them, with a cell wherever these have one.

    Rows in succession go on together or not at all, so that where the cells of many stand in other columns, none is held
    against another of them alone. Of a block each time has to be in order, and its readings to go on from those beside it at
    both ends: among many rows noise takes one of them farther.

    Parameters
    ----------
    sheet : the record.
    table : its rows.
    rows : that are in doubt, from 0.
    whole : whether every reading has to be near those beside it, as where a row may be moved by a column; of a row of results
        between two others the time is enough, as a spike may be a reading.
    """
    headings = {i: h for i, h in sheet.headings.items() if h.quantity != "status" and 0 <= i < len(table.columns)}
    if not rows or not headings:
        return set()
    n_row = len(table.lines)
    seen = sorted({n for r in rows for n in range(max(r - _BESIDE_BLOCK, 0), min(r + _BESIDE_BLOCK + 1, n_row))})
    place = {r: k for k, r in enumerate(seen)}
    values = {i: values_of([table.columns[i][r].strip() for r in seen], sheet.declared_decimal) for i in headings}
    times = [values[i] for i, h in headings.items() if h.quantity == "time"]
    others = [values[i] for i, h in headings.items() if h.quantity != "time"]

    def goes_on(row: int, *, within: bool = False) -> bool:
        at = place[row]
        before, after = list(range(at - min(_NEAR, row), at)), list(range(at + 1, at + 1 + min(_NEAR, n_row - 1 - row)))
        if not times and not (before and after):
            return False  # the largest readings of a record that ends with them go on, too
        beside = [*before[-1:], *after[:1]]
        if any(not np.isfinite(v[at]) and np.all(np.isfinite(v[beside])) for v in (*times, *others)):
            return False
        if not all(_is_in_order(v, at, before, after) for v in times):
            return False
        if within:
            return True
        near = [_is_near(v, at, before + after) for v in others]
        between = bool(before and after) and all(v[at - 1] < v[at] < v[at + 1] for v in times)
        if whole or not times or not between:
            return all(near) and all(_is_near(v, at, before + after) for v in times)
        return any(near) or not near

    def block_goes_on(run: Sequence[int]) -> bool:
        first, behind = place[run[0]], place[run[-1]] + 1
        before, after = (
            range(first - min(_BESIDE_BLOCK, run[0]), first),
            range(behind, behind + min(_BESIDE_BLOCK, n_row - 1 - run[-1])),
        )
        ends = ((before, range(first, first + _OF_BLOCK)), (after, range(behind - _OF_BLOCK, behind)))
        near = all(_is_near_in_the_middle(v, own, beside) for v in others for beside, own in ends)
        return near and all(goes_on(row, within=True) for row in run)

    of_block = {r for run in _runs(rows) if len(run) >= _BLOCK and times and block_goes_on(run) for r in run}
    return of_block | {r for run in _runs(rows) if len(run) < _BLOCK or not times if all(map(goes_on, run)) for r in run}


def in_blocks(rows: Iterable[int]) -> set[int]:
    """Those of some rows that stand in blocks of many in succession.

    >>> len(in_blocks([3, 7, *range(20, 40)]))
    20
    """
    return {r for run in _runs(rows) if len(run) >= _BLOCK for r in run}


def _runs(rows: Iterable[int]) -> list[list[int]]:
    """Rows in succession together."""
    runs: list[list[int]] = []
    for row in sorted(rows):
        if runs and row == runs[-1][-1] + 1:
            runs[-1].append(row)
        else:
            runs.append([row])
    return runs


def values_of(cells: Sequence[str], decimal: str) -> FloatArray:
    """Read cells as times of day if any is one, else as numbers, by the decimal mark that more of them have; NaN where none is.

    Parameters
    ----------
    cells : of one column.
    decimal : the decimal mark, "" if it is not known.
    """
    if any(map(is_clock, cells)):
        return read_clock(cells).seconds
    tried = [np.array([_number(cell, mark) for cell in cells]) for mark in ([decimal] if decimal else [".", ","])]
    return max(tried, key=lambda found: int(np.isfinite(found).sum()))


def _number(cell: str, mark: str) -> float:
    number = parse_number(cell, mark)
    return np.nan if number is None else number


def _is_in_order(values: FloatArray, at: int, before: Sequence[int], after: Sequence[int]) -> bool:
    """Whether a time stands between those beside it; at an end of the record, beyond the last."""
    if not np.isfinite(values[at]):
        return not np.isfinite(values[[*before, *after]]).any()
    early, late = [v for v in values[list(before)] if np.isfinite(v)], [v for v in values[list(after)] if np.isfinite(v)]
    if early and late:
        return bool(early[-1] <= values[at] <= late[0]) and early[-1] < late[0]
    return bool((not early or early[-1] < values[at]) and (not late or values[at] < late[0]))


def _is_near_in_the_middle(values: FloatArray, own: Sequence[int], beside: Sequence[int]) -> bool:
    """Whether the middle of a few readings is no farther from those beside them than these are from each other."""
    there = values[list(own)]
    there = there[np.isfinite(there)]
    return not there.size or _is_near(np.append(values[list(beside)], np.median(there)), len(beside), range(len(beside)))


def _is_near(values: FloatArray, at: int, beside: Sequence[int]) -> bool:
    """Whether a reading is no farther from those beside it than these are from each other."""
    near = values[list(beside)]
    near = np.unique(near[np.isfinite(near)])
    if not np.isfinite(values[at]) or not near.size:
        return not near.size or not np.isfinite(values[at])
    room = float(np.ptp(near)) + 2 * float(np.min(np.diff(near), initial=np.inf) if near.size > 1 else 0.0)
    return bool(near[0] - room <= values[at] <= near[-1] + room)
