"""From the readings of a record without a clock to whether its rows were sorted by one, which mixes loading with unloading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import noise_of
from models.sensor import FloatArray

_FEWEST = 20
# A column in order while another turns at such a share of its steps.
_TURNS = 0.2
# A displacement in order whose steps differ by such a factor (8 of 10 of them), and a force whose scatter in contact is so many
# times that before it, as of two branches.
_UNEVEN, _SCATTER = 4.0, 6.0


def sorted_rows(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray]) -> list[Fault]:
    """List what shows that the rows of a record without a time were sorted by their displacement or force.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    """
    if "time" in values or not {"displacement", "force"} <= set(values):
        return []
    x, f = values["displacement"], values["force"]
    rows = np.flatnonzero(np.isfinite(x) & np.isfinite(f))
    if rows.size < _FEWEST:
        return []
    x, f = x[rows], f[rows]
    by = ""
    if _in_order(f) and _turning(x) > _TURNS:
        by = "force"
    elif _in_order(x) and _is_of_two(x, f if x[0] < x[-1] else f[::-1]):
        by = "displacement"
    if not by:
        return []
    column = next(c for c in columns if c.quantity == by)
    message = f'the rows are in the order of column "{sheet.names[column.index]}", which mixes loading with unloading'
    advice = "Export them in the order in which they were read, best with their time; or the loading rows alone"
    return [Fault(message, sheet.text.path, int(sheet.lines[rows[0]]), column.index + 1, advice=advice)]


def _in_order(v: FloatArray) -> bool:
    steps = np.diff(v)
    return bool(np.all(steps >= 0) or np.all(steps <= 0)) and v[0] != v[-1]


def _turning(v: FloatArray) -> float:
    """Share of the steps that go the other way than the one before."""
    steps = np.sign(np.diff(v))
    return float(np.mean(steps[1:] * steps[:-1] < 0))


def _is_of_two(x: FloatArray, f: FloatArray) -> bool:
    """Whether steps of a displacement are uneven, and a force scatters where it is large, but not where it begins."""
    steps = np.abs(np.diff(x))
    low, high = np.quantile(steps, [0.1, 0.9])
    few = max(6, f.size // 8)
    before, within = noise_of(f[:few]), noise_of(f[-max(2 * few, f.size // 2) :])
    return bool(high > _UNEVEN * max(low, 1e-300) and within > _SCATTER * before and _turning(f[f.size // 2 :]) > _TURNS)
