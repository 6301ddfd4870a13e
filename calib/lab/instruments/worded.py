"""From rows with a word where the others have a number, or nothing, to those of them that are no readings, and why."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.lab.instruments.between import SPECIMEN
from calib.lab.instruments.clock_cells import is_clock, is_date
from calib.lab.instruments.going_on import rows_going_on
from calib.lab.instruments.lexicon import EVENTS
from calib.lab.instruments.lines import Table
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, not_numbers, numbers_in
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# Rows with a word that may stand in a record: so many, or this share.
_FEW, _SHARE = 8, 0.1
# A column counts if so many of its steps are the same.
_MOSTLY = 0.9
_LETTER = re.compile(r"[^\W\d_]")


@dataclass(frozen=True, eq=False)
class Worded:
    """Row from 0 -> why it is not usable, notes on these and on rows that are used, and the table without such words."""

    reasons: Mapping[int, str]
    notes: tuple[str, ...]
    without: Table


def worded_rows(sheet: Sheet, table: Table, known: Collection[int]) -> Worded:
    """Find rows such as "Offset", "Target" or "Écart type", whose word stands where the others are counted or have no cell.

    A column that counts tells a mark on a reading, which is counted, from a row that is none. A word in a column without a
    name, before readings, marks one if these go on over it. The first and the last rows are left out unless the word is of
    an event.

    Parameters
    ----------
    sheet : the record.
    table : its rows.
    known : rows that are judged by something else.
    """
    headings = sheet.headings
    keys = [i for i, h in headings.items() if h.quantity != "status"]
    found: dict[int, str] = {}
    marks: dict[int, str] = {}
    columns = list(table.columns)
    for index, column in enumerate(table.columns):
        if not keys or index in headings or index in sheet.set_aside:
            continue
        worded = _worded(column)
        if not worded:
            continue
        numbers = numbers_in(column, sheet.declared_decimal)
        step = _step(numbers, worded)
        if not step and (sheet.names[index] or index > max(keys)):
            continue
        where = f"in column {index + 1}{f' {sheet.names[index]!r}' if sheet.names[index] else ''}".replace("'", '"')
        columns[index] = ["" if r in worded and not step else cell for r, cell in enumerate(column)]
        for run in _runs([r for r in worded if r not in known]):
            if _are_readings(sheet, table, column, numbers, run, step):
                marks |= {r: f'"{column[r].strip()[:40]}" (line {table.lines[r]}) {where}' for r in run}
                continue
            others = "the others are counted" if step else "the others have no word"
            found |= {r: f'no reading: "{column[r].strip()[:40]}" {where}, where {others}' for r in run}
    notes = []
    if found:
        first = min(found)
        notes.append(f"{len(found)} row(s) are left out as no readings: line {table.lines[first]}, {found[first]}")
    if marks:
        notes.append(f"{len(marks)} row(s) with a word beside the readings are used: {marks[min(marks)]}")
    return Worded(found, tuple(notes), replace(table, columns=columns))


def _worded(column: Sequence[str]) -> list[int]:
    """The rows whose cell is a word, where few are and the others are all numbers or mostly empty; else none."""
    few, n_filled = max(_FEW, int(_SHARE * len(column))), len(column) - column.count("")
    if not n_filled:
        return []
    if n_filled <= few:
        odd: list[int] | None = [r for r, cell in enumerate(column) if cell and cell.strip() and not is_numeric(cell)]
    else:
        odd = not_numbers(column, few)
    worded = [r for r in odd or [] if _is_word(column[r].strip())]
    return worded if 2 * len(worded) < len(column) else []


def _is_word(cell: str) -> bool:
    if not _LETTER.search(cell) or is_missing(cell) or is_over_range(cell):
        return False
    return not is_clock(cell) and not is_date(cell)


def _step(numbers: FloatArray, worded: Sequence[int]) -> float:
    """By how much a column counts from row to row, 0 if it does not."""
    steps = np.diff(np.delete(numbers, worded))
    steps = steps[np.isfinite(steps)]
    if steps.size < max(2, _MOSTLY * (numbers.size - len(worded) - 1)):
        return 0.0
    step = float(np.median(steps))
    return step if step >= 1 and step == round(step) and np.mean(np.abs(steps - step) < step / 2) >= _MOSTLY else 0.0


def _runs(rows: Sequence[int]) -> list[list[int]]:
    """Rows in succession together."""
    return [run.tolist() for run in np.split(np.array(rows, dtype=np.int64), np.flatnonzero(np.diff(rows) > 1) + 1) if run.size]


def _are_readings(
    sheet: Sheet, table: Table, column: Sequence[str], numbers: FloatArray, run: Sequence[int], step: float
) -> bool:
    """Whether rows with a word are readings that it marks."""
    first, last = run[0], run[-1]
    event = all(map(_is_event, (column[r] for r in run)))
    if first > 0 and last < len(column) - 1:
        if step:
            return bool(abs(numbers[last + 1] - numbers[first - 1] - step * (len(run) + 1)) < step / 2)
        return event or len(rows_going_on(sheet, table, run, whole=True)) == len(run)
    timed = any(h.quantity == "time" for h in sheet.headings.values())
    return event and (not timed or len(rows_going_on(sheet, table, run, whole=True)) == len(run))


def _is_event(cell: str) -> bool:
    """Whether a word says what the machine or the ball does, or which specimen it is, as beside the first reading of it."""
    words = [w for w in re.split(r"[\W\d_]+", cell.lower()) if w]
    return SPECIMEN.search(cell) is not None or (bool(words) and all(w in EVENTS for w in words))
