"""From the cells of a column near zero to those that a counter without a sign wrote below zero: 65532 for -4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from models.sensor import BoolArray, FloatArray

# Counters, by their bits; so near to their ends, as a share of what they hold, are numbers below zero, and so near to zero
# those beside them; all others are below such a share.
_BITS = (8, 16, 24, 32)
_NEAR, _OTHERS = 0.05, 0.5
# Readings of a record at least; a number is whole within so much.
_FEWEST, _WHOLE = 12, 1e-3
# More decimals has no counter, and a number with an exponent.
_DECIMALS = 9
# Where a larger share is below zero, what is left of the readings about zero is none of their mean.
_SHARE = 0.1
_ABOUT_ZERO = ("displacement", "force")


def counted_below_zero(
    sheet: Sheet,
    columns: Sequence[ReadColumn],
    cells: Mapping[str, Sequence[str]],
    values: Mapping[str, FloatArray],
    decimals: Mapping[str, str],
) -> tuple[dict[str, dict[int, str]], list[Fault]]:
    """Why readings of a force or a place are left out that a counter without a sign wrote below zero; a fault where many are.

    Parameters
    ----------
    sheet, columns : the record, and those of its columns that are read.
    cells, values, decimals : quantity -> cells, readings in SI, nan where there is none that can be used, and decimal mark.

    Returns
    -------
    Quantity -> row -> reason; and faults.
    """
    lost: dict[str, dict[int, str]] = {}
    faults = []
    for column in (c for c in columns if c.quantity in _ABOUT_ZERO and c.quantity in values):
        own, mark = cells[column.quantity], decimals.get(column.quantity, ".")
        found = below_zero(own, values[column.quantity] / column.factor, mark)
        words = {
            r: f'"{own[r].strip()[:40]}" is {number}: as of a counter of {bits} bits without a sign that went below zero'
            for r, (bits, number) in found.items()
        }
        if len(found) <= max(1, _SHARE * np.count_nonzero(np.isfinite(values[column.quantity]))):
            lost[column.quantity] = words
            continue
        row = next(iter(words))
        message = f'column "{sheet.names[column.index]}": {words[row]}, as in {len(words) - 1} rows more'
        advice = "Export the numbers with their signs, or take the largest number of the counter off these cells"
        faults.append(Fault(message, sheet.text.path, int(sheet.lines[row]), column.index + 1, advice=advice))
    return lost, faults


def below_zero(cells: Sequence[str], values: FloatArray, decimal: str) -> dict[int, tuple[int, str]]:
    """Find readings that are just below a power of two among readings about zero, in the last digit of the column.

    An unsigned counter of 16 bits goes from 0 to 65535 where the reading falls below zero; the readings next to it that did not
    are about zero, and none is near the middle of what it holds.

    Parameters
    ----------
    cells : of the column, (n_row,).
    values : as written, nan where there is none, (n_row,).
    decimal : the decimal mark of the column.

    Returns
    -------
    Row -> bits of the counter, and the number below zero as it would be written.
    """
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < _FEWEST or np.any(values[rows] < 0):
        return {}
    decimals = max(len(cells[r].strip().partition(decimal)[2]) for r in rows[:: max(1, rows.size // 1000)].tolist())
    if decimals > _DECIMALS:
        return {}
    last = 10.0**-decimals
    counts = values[rows] / last
    if np.any(np.abs(counts - np.rint(counts)) > _WHOLE):
        return {}
    for bits in _BITS:
        size = 2.0**bits
        wrapped = (counts >= (1 - _NEAR) * size) & (counts < size)
        if np.any(wrapped) and np.all(counts[~wrapped] < _OTHERS * size) and _among_zeros(counts, wrapped, size):
            at = np.flatnonzero(wrapped).tolist()
            return {int(rows[k]): (bits, f"{(counts[k] - size) * last:.{decimals}f}") for k in at}
    return {}


def _among_zeros(counts: FloatArray, wrapped: BoolArray, size: float) -> bool:
    """Whether the nearest readings on each side of those that are just below a power of two are about zero."""
    others: IntArray = np.flatnonzero(~wrapped)
    if not others.size:
        return False
    at = np.flatnonzero(wrapped)
    place = np.searchsorted(others, at)
    before, behind = counts[others[np.maximum(place - 1, 0)]], counts[others[np.minimum(place, others.size - 1)]]
    near = (np.where(place > 0, before, behind) < _NEAR * size) & (np.where(place < others.size, behind, before) < _NEAR * size)
    return bool(np.all(near))
