"""From the readings of a record to the columns that hold two or more channels, written in turn from row to row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import least_apart
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from models.sensor import FloatArray

_JUDGED = ("force", "capacitance", "capacitance_series")
# In turn by so many rows; readings of a window, of which every other overlaps the one before; windows that must show it.
_PERIODS, _WINDOW, _WINDOWS = (2, 3, 4), 24, 2
# Levels are apart by so many scatters about them, of which chance makes one; by so much more than the channel changes over
# one turn; by so many last digits; and by a share of the range.
_SCATTERS, _PACES, _DIGITS, _SHARE = 4.0, 2.0, 4.0, 0.02
# Where levels are so far apart, steps from row to row are so large a share of that, in so many of a window.
_STEP, _LARGE_STEPS = 1 / 8, 4
_IN_WORDS = {2: "two", 3: "three", 4: "four"}


@dataclass(frozen=True, eq=False)
class _Levels:
    """Windows of a channel, (n_window,): how far the levels of its turns are apart, its scatter, pace, and upper level."""

    apart: FloatArray
    scatter: FloatArray
    pace: FloatArray
    upper: IntArray


def alternating(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading) -> list[Fault]:
    """List the columns whose readings go to and fro between levels, row by row, by far more than by chance.

    Two load cells, ranges or frequencies that are read in turn, or two specimens whose rows are mixed, look like noise but have
    a period of two rows. A slower channel that is written in each row, and uneven steps, change by no more than the channel
    does over a turn. Where the ball goes to and fro from row to row the load does, too.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    driver = values.get("displacement")
    found: dict[ReadColumn, tuple[int, int, float]] = {}
    for column in columns:
        if column.quantity not in _JUDGED or column.quantity not in values:
            continue
        there = np.isfinite(values[column.quantity])
        rows = np.flatnonzero(there if driver is None else there & np.isfinite(driver))
        shown = _in_turn(values[column.quantity][rows], None if driver is None else driver[rows])
        if shown is not None and not is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            period, first, apart = shown
            found[column] = period, int(rows[first]), apart
    # Without a displacement, what all channels show is how the ball goes: peaks and valleys of cycles.
    if driver is None and len(found) > 1:
        return []
    return [_fault(sheet, column, *shown, reading) for column, shown in found.items()]


def _fault(sheet: Sheet, column: ReadColumn, period: int, row: int, apart: float, reading: Reading) -> Fault:
    unit = unit_in_words(sheet, column.index, column.heading, reading)
    cells = ", ".join(f'"{cell.strip()[:40]}"' for cell in sheet.columns[column.index][row : row + 4])
    count = _IN_WORDS[period]
    message = (
        f'column "{sheet.names[column.index]}" goes to and fro between {count} levels, {apart / column.factor:.3g} {unit} '
        f"apart, from row to row ({cells}), as {count} channels, ranges, frequencies or specimens in turn would, and no noise"
    )
    quantity = stands_for(column.quantity)
    advice = (
        "Give each a column or a file of its own; or add a column that tells which row is of which, and choose one: --where "
        f"COLUMN=VALUE; if the readings are right, let the header name the unit and say it once more: --units {quantity}=..."
    )
    return Fault(message, sheet.text.path, int(sheet.lines[row]), column.index + 1, advice=advice)


def _in_turn(v: FloatArray, place: FloatArray | None) -> tuple[int, int, float] | None:
    """The period of readings that take turns, the first of them, and how far they are apart; None if they do not."""
    if v.size < _WINDOW + _WINDOW // 2:
        return None
    least = max(_DIGITS * least_apart(v), _SHARE * float(np.ptp(v)))
    large = np.concatenate([[0], np.cumsum(np.abs(np.diff(v)) > _STEP * least)])
    begins = np.arange(0, v.size - _WINDOW + 1, _WINDOW // 2)
    begins = begins[large[begins + _WINDOW - 1] - large[begins] >= _LARGE_STEPS]
    if begins.size < _WINDOWS:
        return None
    for period in _PERIODS:
        own = _levels(v, period, begins)
        shown = (own.apart > np.maximum(_SCATTERS * own.scatter, _PACES * (period - 1) * own.pace)) & (own.apart > least)
        if place is not None and np.any(shown):
            drive = _levels(place, period, begins)
            to_and_fro = drive.apart > np.maximum(_SCATTERS * drive.scatter, 1.5 * (period - 1) * drive.pace)
            shown &= ~to_and_fro
        at = np.flatnonzero(shown)
        at = at[own.upper[at] == np.bincount(own.upper[at], minlength=period).argmax()]
        if at.size >= _WINDOWS:
            return period, int(begins[at[0]]), float(np.median(own.apart[at]))
    return None


def _levels(v: FloatArray, period: int, begins: IntArray) -> _Levels:
    """Fit, in windows of a channel that begin at these rows, a bend and for each turn of a period a straight level."""
    t = np.arange(_WINDOW) - (_WINDOW - 1) / 2
    turn = np.stack([np.arange(_WINDOW) % period == k for k in range(1, period)], axis=1).astype(np.float64)
    design = np.concatenate([np.stack([np.ones(_WINDOW), t, t**2], axis=1), turn, turn * t[:, None]], axis=1)
    windows = np.lib.stride_tricks.sliding_window_view(v, _WINDOW)[begins]
    fitted = windows @ np.linalg.pinv(design).T
    scatter = np.sqrt(np.sum((windows - fitted @ design.T) ** 2, axis=1) / (_WINDOW - design.shape[1]))
    levels = np.concatenate([np.zeros((len(windows), 1)), fitted[:, 3 : 2 + period]], axis=1)
    pace = np.abs(fitted[:, 1] + np.sum(fitted[:, 2 + period :], axis=1) / period)
    return _Levels(np.ptp(levels, axis=1), scatter, pace, np.argmax(levels, axis=1))
