"""From the cells of a table to the rows that go on from those beside them only once they are moved by one column."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.lines import Table, n_named
from calib.lab.instruments.numbers import parse_number
from calib.lab.instruments.sheet import Sheet

#: How the reason of a row begins whose cells are those of the columns beside them.
MOVED = "its cells stand one column too far"

_EMPTY = ("", " ")
# A number speaks for a column if it is so many times nearer to what stands beside it there.
_NEARER = 3.0
# Of many rows with an empty end so many runs are looked at first, among the first rows.
_SEEN, _FIRST = 400, 10_000


def shifted_rows(sheet: Sheet, table: Table) -> dict[int, str]:
    """Find the rows whose first or last cell is empty since all others stand one column too far.

    A row of a log of two rates, whose slower column is empty, goes on from the full rows beside it as it stands; a shifted one
    does where each of its cells is held against the next column.

    Parameters
    ----------
    sheet : the record.
    table : its rows.

    Returns
    -------
    Row from 0 -> why its cells cannot be trusted.

    Raises
    ------
    InputError
        If as many rows are shifted against the others as are not, or the others lack a cell at the other end, as where a first
        column without readings is filled by the shift: which of them are right cannot be told.
    """
    n, n_row = n_named(sheet), len(table.lines)
    if n < 2 or n_row < 2:
        return {}
    columns = list(table.columns[:n])
    for end in (0, -1):  # what is empty throughout, as for the number of a specimen, is none that a row could have left
        while len(columns) > 2 and columns[end][0] in _EMPTY and sum(map(columns[end].count, _EMPTY)) == n_row:
            columns.pop(end)
    n = len(columns)
    found: dict[int, str] = {}
    for end, step, side in ((n - 1, 1, "left"), (0, -1, "right")):
        if not any(empty in columns[end] for empty in _EMPTY):
            continue
        first = _runs(columns[end][:_FIRST])
        if not any(_is_run_shifted(columns, run, step) for run in first[:: max(1, len(first) // _SEEN)]) and (
            2 * sum(map(columns[end].count, _EMPTY)) > n_row
        ):
            continue  # a column that is filled more rarely
        runs = _runs(columns[end])
        rows = [r for run in runs if _is_run_shifted(columns, run, step) for r in range(*run)]
        others = n_row - len(rows)
        lacking = sum(map(columns[n - 1 - end].count, _EMPTY))  # the cell at the other end, which shifted rows have
        if rows and (len(rows) >= others or 2 * lacking >= others):
            raise InputError(
                Fault(
                    f"in {len(rows)} of {n_row} rows, this the first, the cells stand one column further to the {side} "
                    "than in the others: which are right cannot be told",
                    sheet.text.path,
                    int(table.lines[rows[0]]),
                    advice="Write every row with as many cells as the header has, or remove those that lack one",
                )
            )
        found |= dict.fromkeys(rows, f"{MOVED} to the {side}")
    return found


def _runs(column: Sequence[str]) -> list[tuple[int, int]]:
    """Where cells in succession are empty: the first row of them, and the first behind them."""
    found: list[int] = []
    for empty in _EMPTY:
        row = -1
        for _ in range(column.count(empty)):
            row = column.index(empty, row + 1)
            found.append(row)
    rows = np.sort(np.array(found, dtype=np.int64))
    cuts = np.flatnonzero(np.diff(rows) > 1)
    firsts, lasts = np.concatenate((rows[:1], rows[cuts + 1])), np.concatenate((rows[cuts], rows[-1:]))
    return list(zip(firsts.tolist(), (lasts + 1).tolist(), strict=True))


def _is_run_shifted(columns: Sequence[Sequence[str]], run: tuple[int, int], step: int) -> bool:
    """Whether the rows of a run are shifted, as its first and its last row show beside the full rows next to them."""
    beside = [(row, near) for row, near in ((run[0], run[0] - 1), (run[1] - 1, run[1])) if 0 <= near < len(columns[0])]
    beside = [(row, near) for row, near in beside if _tells(columns, row, near)]
    return bool(beside) and all(_is_shifted(columns, row, near, step) for row, near in beside)


def _tells(columns: Sequence[Sequence[str]], row: int, near: int) -> bool:
    """Whether a row near one with an empty end is full, or lacks the other end where that one has it."""
    own, other = ((bool(columns[0][r].strip()), bool(columns[-1][r].strip())) for r in (row, near))
    return all(other) or (own != other and any(own) and any(other))


def _is_shifted(columns: Sequence[Sequence[str]], row: int, near: int, step: int) -> bool:
    """Whether the cells of a row are like those of the next columns in a row near it, and not like those of their own."""
    moved = stays = 0
    for c in range(max(0, -step), len(columns) - max(0, step)):
        own, here, there = columns[c][row], columns[c][near], columns[c + step][near]
        apart = [_apart(own, other) for other in (here, there)]
        if not own.strip() or apart[0] == apart[1]:
            continue
        stays += apart[0] * _NEARER < apart[1]
        moved += apart[1] * _NEARER < apart[0]
    return moved > stays


def _apart(one: str, other: str) -> float:
    """How far two cells are apart: their difference, infinite for a number and a cell of another kind, else nothing."""
    if is_clock(one) or is_clock(other):
        return 0.0 if is_clock(one) and is_clock(other) else np.inf
    numbers = [next((n for mark in ".," if (n := parse_number(c.strip(), mark)) is not None), None) for c in (one, other)]
    if numbers[0] is None or numbers[1] is None:
        return 0.0 if numbers[0] is numbers[1] else np.inf
    return abs(numbers[0] - numbers[1])
