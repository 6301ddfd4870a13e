"""From the rows of a table to the last ones that are no readings: results drawn from the rows above them, or below a title."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.lab.instruments.brackets import no_record
from calib.lab.instruments.clock_cells import is_reading
from calib.lab.instruments.lines import FEW_ROWS, OF_RESULTS, Table, is_result, kind_of_line
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, numbers_in
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# Rows of results at most, and of the record at least.
_MOST, _FEWEST = 8, 12
# How far a result may be off beside half of its last digit.
_ROUNDED = 1e-6
#: Lines of results below a record at most.
LINES_OF_RESULTS = 60
# Last rows that leap so far, in steps of the rows above them, of which so many are looked at, and as a share of their range.
_FEW_LAST, _SHOWN, _FAR, _OF_RANGE = 3, 200, 12.0, 0.3
# Steps of the clock of a record that are none of the next reading.
_STEPS = 5.0
#: Results that only a row of results holds in all columns; the largest and the smallest of all may be a reading's, too.
_OF_NO_READING = ("mean", "sd", "median", "sum", "range")


def results_below(sheet: Sheet, table: Table) -> dict[int, str]:
    """Find rows at the end that are not of the record: behind a blank line time goes back, or they are results of those above.

    Rows are results if each holds one statistic of every column of numbers, such as the mean, be it behind a blank line, where
    time goes back, or where the ball leaps; the largest and the smallest of all are such only at no later time, or where the
    ball leaps, as the last of a press may be them.

    Parameters
    ----------
    sheet, table : the record, and its rows.

    Returns
    -------
    Row from 0 -> why it is not usable.
    """
    n_row = len(table.lines)
    time = next((i for i in range(len(sheet.names)) if sheet.plain_heading(i).quantity == "time"), None)
    seen = max(n_row - _FEW_LAST - _SHOWN, 0)
    ends = [numbers_in(table.columns[i][seen:], sheet.declared_decimal) for i in sheet.headings]
    for first in range(max(n_row - _MOST, _FEWEST), n_row):
        apart = int(table.lines[first]) > int(table.lines[first - 1]) + 1
        above, below = (
            (0.0, 1.0) if time is None else numbers_in(table.columns[time][first - 1 : first + 1], sheet.declared_decimal)
        )
        back = below < above
        rows = range(first, n_row)
        leaps = n_row - first <= _FEW_LAST and any(_leaps(numbers, n_row - first) for numbers in ends)
        if not (apart or back or leaps):
            continue
        found = _results(table, first, sheet.declared_decimal)
        # The largest of all columns, at no later time than the row above, is no reading either; nor is it where the ball leaps
        # back to where all were the same before.
        earlier = (apart or back or leaps) and not below > above if time is not None else leaps
        if len(found) == len(rows) and (earlier or any(what in _OF_NO_READING for what in found.values())):
            return {row: f"a row of results: the {found[row]} of the rows above" for row in rows}
        if apart and back:
            return dict.fromkeys(rows, "behind a blank line time goes back: no row of the record above")
    return {}


def _leaps(numbers: FloatArray, last: int) -> bool:
    """Whether a column leaps to one of so many last rows of it, by a dozen of its steps and much of its range."""
    above = numbers[:-last]
    steps = np.abs(np.diff(above[np.isfinite(above)]))
    own = np.abs(np.diff(numbers[-last - 1 :]))
    return bool(
        steps.size and np.nanmax(own, initial=0.0) > max(_FAR * float(np.median(steps)), _OF_RANGE * float(np.ptp(above)))
    )


def only_results(sheet: Sheet, rows: Sequence[Sequence[str]], at: int, above: Sequence[int], keys: Sequence[int]) -> bool:
    """Whether a line of text and all that stands below it are results: no row there is a reading of the record.

    Rows are none with a word in the place of the time, or of the number at the beginning of each row above; below a line that
    says so ("Results", "Mean,...") also a few whose time goes back, or is far from that of the last row.

    Parameters
    ----------
    sheet : the record.
    rows : cells of every line.
    at : which of them is the line of text, one of the last `LINES_OF_RESULTS` filled ones.
    above : those that are rows of the record.
    keys : columns that are understood.
    """
    below = [(k, rows[k]) for k in range(at, len(rows)) if any(map(str.strip, rows[k]))]
    width = len(sheet.names)
    after = [row for k, row in below if k > at and kind_of_line(row, (), keys, width) == "row"]
    if not after or len(above) < max(_FEWEST, 2 * len(after)):
        return False
    place = next((i for i, h in sheet.headings.items() if h.quantity == "time"), keys[0])
    shown = [i for i in {0, place} if is_reading(_cell(rows[above[-1]], i)) and is_reading(_cell(rows[above[0]], i))]
    numbers = [row for row in after if not any(_is_word(_cell(row, i)) for i in shown)]
    if not numbers:
        return True
    titles = [cell for k, row in below if row not in after or k == at for cell in row]
    said = any(OF_RESULTS.search(cell) or is_result(cell) for cell in titles if cell.strip() and not is_numeric(cell))
    said = said or any(map(no_record, rows[at]))
    if not said or len(numbers) >= FEW_ROWS or place not in sheet.headings or sheet.headings[place].quantity != "time":
        return said and len(numbers) < FEW_ROWS and all(len(row) != width for row in numbers)
    *_, before, last = numbers_in([_cell(rows[k], place) for k in above[-2:]], sheet.declared_decimal)
    first = numbers_in([_cell(row, place) for row in numbers], sheet.declared_decimal)
    return bool(np.all((first < last) | (first > last + _STEPS * abs(last - before))))


def _cell(row: Sequence[str], index: int) -> str:
    return row[index].strip() if index < len(row) else ""


def _is_word(cell: str) -> bool:
    return bool(cell) and not (is_reading(cell) or is_missing(cell) or is_over_range(cell))


def _results(table: Table, first: int, decimal: str) -> dict[int, str]:
    """The rows from `first` on that hold the same statistic of the rows above in every column of numbers, and which."""
    wanted: dict[int, dict[str, bool]] = {row: {} for row in range(first, len(table.lines))}
    counted = 0
    for column in table.columns:
        numbers = numbers_in(column, decimal)
        above = numbers[:first][np.isfinite(numbers[:first])]
        if above.size < _FEWEST or np.ptp(above) == 0:
            continue
        counted += 1
        drawn = _drawn(above)
        for row, fits in wanted.items():
            for name, values in drawn.items():
                fits[name] = fits.get(name, True) and _is_one_of(column[row], float(numbers[row]), values)
    if counted < 2:
        return {}
    named = {row: next((name for name, fits in found.items() if fits), "") for row, found in wanted.items()}
    return {row: name for row, name in named.items() if name}


def _drawn(values: FloatArray) -> Mapping[str, tuple[float, ...]]:
    """What may be drawn from readings."""
    return {
        "mean": (float(np.mean(values)),),
        "sd": (float(np.std(values)), float(np.std(values, ddof=1))),
        "median": (float(np.median(values)),),
        "sum": (float(np.sum(values)),),
        "range": (float(np.ptp(values)),),
        "maximum": (float(np.max(values)),),
        "minimum": (float(np.min(values)),),
    }


def _is_one_of(cell: str, number: float, values: Sequence[float]) -> bool:
    digits = len(cell.strip().replace(",", ".").rpartition(".")[2]) if ("." in cell or "," in cell) and is_numeric(cell) else 0
    return any(abs(number - value) <= 0.51 * 10.0**-digits + _ROUNDED * abs(value) for value in values)
