"""From the dates of rows, as written, to the days between them; refusing where day and month cannot be told apart."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from itertools import compress

import numpy as np

from calib.lab.instruments.clock_words import in_figures
from calib.lab.instruments.labtable import IntArray
from models.sensor import FloatArray

_DAY = 86400.0


@dataclass(frozen=True, eq=False)
class Days:
    """Days since the first date, (n_row,), None without dates or within one; a note on how they are read, or why not."""

    days: FloatArray | None
    note: str = ""
    conflict: str = ""


def days_since(dates: Sequence[str], values: FloatArray) -> Days:
    """Count the days between the dates of rows.

    Where day and month may be either, they are read so that time goes on by less than a day, if only one way does that.

    Parameters
    ----------
    dates : of each row, as written; () without dates.
    values : seconds since midnight, nan where there is no time, (n_row,).
    """
    if len(set(dates)) - ("" in dates) < 2:
        return Days(None)
    there = np.isfinite(values)
    if any(not d.strip() for d in compress(dates, there)):
        return Days(None, conflict="some times have a date and some have none")
    index: dict[str, int] = {}
    codes = np.array([index.setdefault(d.strip(), len(index)) for d in dates])
    figures = [in_figures(d).text for d in index]
    readings = {order: days for order in ("ymd", "dmy", "mdy") if (days := _ordinals(figures, order)) is not None}
    if not readings:
        return Days(None, conflict=f'"{next(iter(index))}" is no date')
    counted = {}
    for order, ordinals in readings.items():
        days = ordinals[codes].astype(np.float64)
        days -= days[there][0]
        counted[order] = days
    distinct = {days[there].tobytes(): order for order, days in reversed(counted.items())}
    if len(distinct) == 1:
        return Days(next(iter(counted.values())))
    largest = {o: float(np.max(np.abs(np.diff((_DAY * counted[o] + values)[there])))) for o in distinct.values()}
    going_on = [o for o, step in largest.items() if step < _DAY]
    if len(going_on) != 1:
        return Days(None, conflict="day and month of the dates cannot be told apart")
    words = {"ymd": "year, month, day", "dmy": "day, month, year", "mdy": "month, day, year"}
    return Days(counted[going_on[0]], f"dates are read as {words[going_on[0]]}: otherwise time would jump by months")


def _ordinals(dates: Sequence[str], order: str) -> IntArray | None:
    found = []
    for text in dates:
        fields = re.split(r"[-/.]", text)
        year = order.index("y")
        if len(fields) != 3 or any(len(f) > 2 for i, f in enumerate(fields) if i != year) or len(fields[year]) not in (2, 4):
            return None
        if "." in text and order == "mdy":
            return None
        y, m, d = (int(fields[order.index(k)]) for k in "ymd")
        try:
            found.append(date(y + 2000 if y < 100 else y, m, d).toordinal())
        except ValueError:
            return None
    return np.array(found, dtype=np.int64)
