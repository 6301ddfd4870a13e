"""From the cells of a column to those that were cut to fewer digits than the others, and that their neighbours contradict."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from calib.lab.instruments.labtable import IntArray
from models.sensor import BoolArray, FloatArray

# Share of the cells that have as many decimals as the column, and as many at least.
_USUAL, _LEAST = 0.9, 2
# Of so many cells some end in a zero, if zeros at the end are written.
_TELLS_ZEROS = 40
# Cells with fewer that are looked at, and others on either side that tell.
_MOST, _NEAR = 5000, 3
# A cut cell is off the line between the others by so many times what these scatter about theirs, and last digits.
_SCATTER, _DIGITS = 3.0, 2.0
# It is off by what rounding or cutting it off may make, in its own last digit, with room for the curve.
_ITS_DIGIT = 1.1
# What no fixed format prints, and the largest share of cells that may be so by mistake.
_BARE, _LEADING = re.compile(r"[-+]?\d+\."), re.compile(r"[-+]?0\d+\.\d*")
_PADDED, _FEW = "a zero before its first digit, where no other has", 0.01
# Cells that a column must have, and how near to whole is whole.
_FEWEST, _WHOLE = 12, 1e-4
# Cells that show how many decimals a column has.
_SEEN = 150


def cut_short(cells: Sequence[str], values: FloatArray, decimal: str) -> dict[int, str]:
    """Find numbers with fewer decimals than their column has that are off the course of those beside them by what was cut off.

    A number that lost zeros, or whose neighbours do not tell, stays: it is as good as they are.

    Parameters
    ----------
    cells : of the column, (n_row,).
    values : as read, in any unit, nan where there is none, (n_row,).
    decimal : the decimal mark of the column.

    Returns
    -------
    Row from 0 -> why it is not usable.

    >>> cells = [f"{0.0317 * i:.4f}" for i in range(20)]
    >>> cut_short([*cells[:9], "0.3", *cells[10:]], np.array([*map(float, cells[:9]), 0.3, *map(float, cells[10:])]), ".")
    {9: '"0.3" has fewer decimals than the 4 of the others, which pass 0.2853 there'}
    """
    if len(cells) < _FEWEST or not decimal:
        return {}
    own = _usual_decimals(cells, decimal)
    if own < _LEAST:
        return {}
    rows = np.flatnonzero(_may_be_cut(values, own) if not _exponent(cells[0]) else np.isfinite(values))
    written = {cells[r] for r in rows.tolist()}
    fewer = {cell for cell in written if _decimals(cell, decimal) < own}
    few = [r for r in rows.tolist() if cells[r] in fewer] if fewer else []
    if not few or len(few) > max(1, (1 - _USUAL) * len(cells)):
        return {}
    if len(cells) > _TELLS_ZEROS and not any(_decimals(c, decimal) == own and _digits(c).endswith("0") for c in cells):
        return {}  # zeros at the end are not written at all, as by a spreadsheet program
    fine = np.isfinite(values)
    fine[few] = False
    beside = np.flatnonzero(fine)
    found = {}
    for r in few[:_MOST]:
        expected, scatter = _course(beside, values, r)
        off = abs(float(values[r]) - expected)
        digits = _decimals(cells[r], decimal)
        exponent = _exponent(cells[r])
        if _SCATTER * scatter + _DIGITS * _power(exponent - own) < off <= _ITS_DIGIT * _power(exponent - digits):
            found[r] = (
                f'"{cells[r].strip()[:40]}" has fewer decimals than the {own} of the others, which pass {expected:.4g} there'
            )
    return found


def misprinted(cells: Sequence[str], decimal: str) -> dict[int, str]:
    """Find single numbers that no format prints which printed the others: "10." or "02.5" in a column of "10.8" and "9.0".

    Only where all have as many decimals, zeros at their ends, too: programs that print as few digits as they can write "10.".

    Parameters
    ----------
    cells : of the column, (n_row,).
    decimal : the decimal mark of the column.

    Returns
    -------
    Row from 0 -> why it is not usable.

    >>> misprinted([f"{0.3 * i:.1f}" for i in range(20)] + ["10."], ".")
    {20: '"10." has nothing behind its decimal mark, where all others have 1 decimals'}
    """
    if not _FEWEST <= len(cells) <= _MOST or not decimal:
        return {}
    own = _usual_decimals(cells, decimal)
    if not own or not any(_decimals(c, decimal) == own and c.rstrip().endswith("0") for c in cells):
        return {}
    found = {}
    for why, form in ((f"nothing behind its decimal mark, where all others have {own} decimals", _BARE), (_PADDED, _LEADING)):
        rows = [r for r, cell in enumerate(cells) if form.fullmatch(cell.strip().replace(decimal, "."))]
        if len(rows) <= max(1, _FEW * len(cells)):
            found.update({r: f'"{cells[r].strip()[:40]}" has {why}' for r in rows})
    return found


def _may_be_cut(values: FloatArray, own: int) -> BoolArray:
    """Numbers whose last decimal is a zero, off the middle of those beside them by more than that digit counts."""
    with np.errstate(over="ignore", invalid="ignore"):
        shifted = values * _power(own - 1)
        zero = np.abs(shifted - np.rint(shifted)) < _WHOLE
        off = np.ones(values.size, dtype=bool)
        off[1:-1] = ~(np.abs(2 * values[1:-1] - values[:-2] - values[2:]) <= 2 * _DIGITS * _power(-own))
    return np.asarray(zero & off & np.isfinite(values))


def _usual_decimals(cells: Sequence[str], decimal: str) -> int:
    """How many decimals nearly all cells have; 0 if they differ."""
    some = cells[:: 1 + len(cells) // _SEEN]
    counts = Counter(_decimals(c, decimal) for c in some if c.strip())
    if not counts:
        return 0
    most, n = counts.most_common(1)[0]
    return most if n >= _USUAL * sum(counts.values()) else 0


def _course(beside: IntArray, values: FloatArray, row: int) -> tuple[float, float]:
    """What the readings beside a row let expect in it, and how far these are off what they let expect of each other."""
    at = int(np.searchsorted(beside, row))
    near = beside[max(at - _NEAR, 0) : at + _NEAR]
    if near.size < _NEAR:
        return float(values[row]), 0.0
    places, y = near - row, values[near]
    before, after = near[near < row], near[near > row]
    ends = (before[-1], after[0]) if before.size and after.size else (before[-2:] if before.size else after[:2])
    a, b = (int(e) for e in ends)
    expected = float(values[a] + (values[b] - values[a]) * (row - a) / (b - a))
    scatter = 0.0
    for k in range(1, near.size - 1):
        line = y[k - 1] + (y[k + 1] - y[k - 1]) * (places[k] - places[k - 1]) / (places[k + 1] - places[k - 1])
        scatter = max(scatter, abs(float(y[k] - line)))
    return expected, scatter if before.size and after.size else 3 * scatter


def _power(exponent: int) -> float:
    """A power of ten; infinite where it is as large as no number is."""
    return float(f"1e{exponent}")


def _decimals(cell: str, decimal: str) -> int:
    return len(cell.strip().partition(decimal)[2].lower().partition("e")[0])


def _digits(cell: str) -> str:
    return cell.strip().lower().partition("e")[0]


def _exponent(cell: str) -> int:
    power = re.search(r"[eE]([-+]?\d{1,3})\s*$", cell)
    return int(power[1]) if power else 0
