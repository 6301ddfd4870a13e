"""From a column that ends before the others to whether its readings are of other rows, as of a slower meter pasted beside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import median_filter

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import SMOOTH, noise_of
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from models.sensor import FloatArray

# A column ends before the others by so many rows and such a share of them, has so many readings, and hardly any gap above.
_ROWS, _SHARE, _FEWEST, _FULL = 10, 0.02, 24, 0.95
# Its readings go back by so many noises and such a share of their range, while the ball goes in by such a share of its way.
_NOISES, _GOES_BACK, _GOES_IN = 8.0, 0.03, 0.01
# The ball is at the end of its way from such a share of it on; readings that are looked at together, so that none alone counts.
_AT_END, _TOGETHER = 0.99, 5


def of_other_rows(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading
) -> list[Fault]:
    """Refuse a load or a capacitance that ends before the displacement and goes back while the ball still goes in.

    The readings of a slower meter that were pasted beside those of a machine fill the first rows only, and turn before the
    press does. A meter that stopped before the end has readings of the press in its rows, and is none of this.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    faults: list[Fault] = []
    for column in columns if "displacement" in values else ():
        if column.quantity not in SMOOTH[1:] or column.quantity not in values:
            continue
        turns = _turns_early(values[column.quantity], values["displacement"])
        if turns is None or is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            continue
        quantity, cells = stands_for(column.quantity), sheet.columns[column.index]
        first, last, end = (int(sheet.lines[r]) for r in turns)
        message = (
            f'column "{sheet.names[column.index]}" ends in line {end}, and goes back from "{cells[turns[0]].strip()[:40]}" '
            f'in line {first} to "{cells[turns[1]].strip()[:40]}" in line {last} while the displacement still goes in: its '
            "readings seem to be of other rows, as those of a slower meter that were pasted beside"
        )
        unit = unit_in_words(sheet, column.index, column.heading, reading)
        advice = (
            "Write its readings into the rows of their times, or leave the column out: "
            f"{Choice('columns', ('none',), quantity)}; if they are of these rows, let the header name the unit and say it "
            f"once more: --units {quantity}={unit}"
        )
        faults.append(Fault(message, sheet.text.path, first, column.index + 1, advice=advice))
    return faults


def _turns_early(values: FloatArray, place: FloatArray) -> tuple[int, int, int] | None:
    """Rows from which and to which readings go back while the ball goes in, and the last reading; None if they do not."""
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < _FEWEST or rows.size < _FULL * (rows[-1] + 1):
        return None
    end = int(rows[-1])
    if np.count_nonzero(np.isfinite(place[end + 1 :])) < max(_ROWS, _SHARE * place.size):
        return None
    there = np.flatnonzero(np.isfinite(place))
    x = np.interp(np.arange(place.size), there, median_filter(place[there], size=_TOGETHER, mode="nearest"))
    y = median_filter(values[rows], size=_TOGETHER, mode="nearest")
    few = max(1, min(9, rows.size // 10))
    y, x = np.abs(y - np.median(y[:few])), np.abs(x - np.median(x[:few]))
    top = int(np.argmax(x > _AT_END * float(np.max(x))))
    # From its largest reading of the way in on: the ball may have gone there and come back before.
    last = min(int(np.searchsorted(rows, top, side="right")), rows.size) - 1
    largest = int(np.argmax(y[: last + 1])) if last >= 0 else 0
    back, went_in = float(y[largest] - y[last]), float(x[rows[last]] - x[rows[largest]])
    least = max(_NOISES * noise_of(values[rows]), _GOES_BACK * float(np.ptp(y)))
    if back <= least or went_in <= _GOES_IN * float(np.max(x)):
        return None
    return int(rows[largest]), int(rows[last]), end
