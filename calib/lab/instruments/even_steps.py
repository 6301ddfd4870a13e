"""From the readings of a record to runs of them that go in even steps to the last digit while all others scatter: filled in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import least_apart, noise_of
from calib.lab.instruments.stalled import judged_columns, last_digit
from calib.lab.instruments.unit_choice import unit_in_words
from calib.lab.stretches import stretches
from models.sensor import FloatArray

# Readings that no drive sets.
_JUDGED = ("force", "capacitance", "capacitance_series")
# Rows that a record has at least, and even steps in succession: fewer may be chance.
_FEWEST, _RUN = 40, 12
# Even is a step that differs from the next by no more than rounding; a channel scatters by so many last digits at least.
_ROUNDED, _SCATTERS = 1.5, 3.0
# What stands still is no course: a step is so many last digits at least.
_STEP = 2.0


def even_steps(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading
) -> dict[str, dict[int, str]]:
    """Find readings between two others that lie on a straight line, to the last digit, in a channel that scatters.

    So a spreadsheet fills a series, and a program what it lacked. Of a channel without noise nothing tells such rows.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.

    Returns
    -------
    Quantity -> row from 0 -> why it is not usable.
    """
    lost: dict[str, dict[int, str]] = {}
    for column, rows in judged_columns(sheet, columns, values, reading, _JUDGED, _FEWEST):
        y = values[column.quantity][rows] / column.factor
        # Numbers may be written with more digits than a converter has.
        digit = max(last_digit(sheet.columns[column.index], rows), least_apart(y))
        if noise_of(y) < _SCATTERS * digit:
            continue
        together = np.diff(rows, 2) == 0
        for first, behind in stretches(together & (np.abs(np.diff(y, 2)) <= _ROUNDED * digit)):
            last = behind + 1
            step = abs(y[last] - y[first]) / (last - first)
            if behind - first < _RUN or step < _STEP * digit:
                continue
            lines = f"lines {int(sheet.lines[rows[first]])} to {int(sheet.lines[rows[last]])}"
            unit = unit_in_words(sheet, column.index, column.heading, reading)
            why = (
                f"{column.quantity.removesuffix('_series')} goes in even steps of {step:.3g} {unit}".rstrip()
                + f" in {lines}, to the last digit, while it scatters elsewhere, as if filled in between two readings"
            )
            lost.setdefault(column.quantity, {}).update(dict.fromkeys(rows[first + 1 : last].tolist(), why))
    return lost
