"""From a column of numbers to those that their neighbours contradict by a power of ten: a decimal mark lost or moved."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import repeat

import numpy as np

from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.numbers import SIGNS
from models.sensor import BoolArray, FloatArray

# Steps between neighbours, which are looked at: so many times as large or small.
_JUMP = 2.8
# Numbers with a mark and without beside each other: steps in powers of ten as written, and once the lost mark is put back.
_APART, _TOGETHER = 0.9, 0.3
# A number is off its neighbours by so many times the noise.
_NOISES = 4.0
# Steps on one side of a number so many times as large as on the other are those of another wrong one.
_WILD = 4.0
# How often numbers are looked at once those that were found are taken out.
_PASSES = 4
# How near a number must come to its neighbours once its mark is moved, in steps between these, and how small these must be.
_NEAR, _SMALL_STEPS, _COARSE_STEPS = 2.0, 0.03, 0.5
# A single number may miss its neighbours by this share of them once its mark is moved, by one place or by more.
_NEAR_ALONE, _NEAR_BY_MORE = 0.02, 0.1
# A single number that is off by one power of ten, or by more, may stand among steps as large as this share of its neighbours.
_ONE_POWER, _MORE_POWERS = 0.2, 0.3
# A number at an end of regular steps goes on from them if it misses them by such a share of a step.
_REGULAR = 0.15
# Single numbers in another unit: how far off these are at least, how calm the numbers beside them, how near they must come.
_LEAST_UNIT, _CALM_BESIDE, _NEAR_UNIT = 2.8, 0.1, 0.008
# A whole number among others with decimals is none of them if it lies so many times their range beside them.
_WIDE = 3.0
# Rounding of a number whose mark has moved to the left may add up to this share.
_ROUNDED = 0.1
# A number of so few last digits, among those below such a share of the range, is about zero.
_ABOUT_ZERO, _NEAR_ZERO = 2, 0.1
# Larger shares of contradicted numbers are no single damage: the column is.
_SHARE = 0.05
_SHARE_SURE = 0.5
# Rows in succession with a mark moved alike that are still told from a step of the signal.
_RUN = 3
# Numbers with and without leading zeros have as many decimals if they go on from each other within such a step of log10.
_GOES_ON = 0.3
# Numbers that a column, and the places beside a number, must have at least.
_FEWEST, _FEWEST_BESIDE = 5, 4

# Ratios of units that are no powers of ten, in words, and the quantity and names of these units; in thousands, as of mN and N,
# too.
_BETWEEN_UNITS = tuple(
    (size * 10.0**power, words, quantity, names)
    for quantity, names, ratio in (
        ("force", "N and kgf", 9.80665),
        ("force", "N and lbf", 4.4482216),
        ("displacement", "mm and in", 25.4),
    )
    for size, words in ((ratio, f"{ratio:.5g}"), (1 / ratio, f"1/{ratio:.5g}"))
    for power in (0, 3, -3)
)
# Nines, which loggers write where there is no reading.
_NINES = re.compile(rf"[{SIGNS}]?9{{3,}}", re.ASCII)

_PADDED = re.compile(rf"[ \t]*[{SIGNS}]?0\d+[ \t]*", re.ASCII)
# How such a cell begins, among others.
_ZERO_FIRST = ("0", "-0", "+0", "\u22120", "\u20130", " ", "\t")


@dataclass(frozen=True)
class Doubts:
    """Numbers of a column that cannot be right.

    Attributes
    ----------
    rows : row from 0 -> why it is not usable.
    fault, row : why the whole column is not, with a row that shows it; "" if it is.
    decimals : of numbers that have lost their marks, how many decimals all had; 0 where that cannot be told.
    """

    rows: Mapping[int, str] = field(default_factory=dict)
    fault: str = ""
    row: int = 0
    decimals: int = 0


def doubtful(cells: Sequence[str], values: FloatArray, decimal: str, quantity: str = "", *, whole: bool = False) -> Doubts:
    """Find numbers that their neighbours contradict by a power of ten, as a decimal mark lost or moved leaves them.

    A whole number with leading zeros ("-021000") has lost its mark; in a column of whole numbers alone all have. Whole
    numbers beside numbers with a mark ("97301" beside "99.28") have lost it if, divided by one power of ten, they go on from
    these, and do not as they stand. A single number is doubted if it is off by a power of ten, but then fits between its
    neighbours, or beside them at an end: in a smooth signal by itself, in a coarse one if it also has another number of
    decimals than they. Peaks, steps and resets of a signal are not touched: they fit by no power of ten, or do not come back,
    or are written like all others.

    Parameters
    ----------
    cells : of the column, (n_row,).
    values : as read, in any unit, nan where there is none, (n_row,).
    decimal : the decimal mark of the column.
    quantity : of the column, whose units one may be mistaken for; "" if it is not known.
    whole : whether the numbers of a column without any mark are known to be whole.
    """
    padded = _padded(cells, values)
    marked = np.ones(0, dtype=bool)
    if padded.size:
        marked = np.array([decimal in c for c in cells])
        there = np.isfinite(values)
        if np.any(marked):
            # A mark in a few cells, such as those of a shifted row, is not that of the column.
            without = padded.size if whole else int(np.count_nonzero(there & ~marked))
            if without > _SHARE_SURE * int(np.count_nonzero(there)):
                return _lost(cells, int(padded[0]), marked)
            rows = {int(i): f'"{cells[i].strip()}" seems to have lost its decimal mark' for i in padded}
            rest = values.copy()
            rest[padded] = np.nan
            other = _jumping(cells, rest, decimal, quantity)
            return Doubts({**other.rows, **rows}, other.fault, other.row)
        if not whole:
            row = int(padded[0])
            lost = f'"{cells[row].strip()}" begins with a zero: the numbers seem to have lost their decimal marks'
            return Doubts(fault=lost, row=row, decimals=_decimals_lost(cells, values, padded))
    return _jumping(cells, values, decimal, quantity)


def _padded(cells: Sequence[str], values: FloatArray) -> IntArray:
    """Rows of whole numbers with leading zeros."""
    if not any(map(str.startswith, cells, repeat(_ZERO_FIRST))):
        return np.zeros(0, dtype=np.int64)
    whole = np.flatnonzero((values == np.rint(values)) & (values != 0))
    return np.array([i for i in whole.tolist() if _PADDED.fullmatch(cells[i])], dtype=np.int64)


def _decimals_lost(cells: Sequence[str], values: FloatArray, padded: IntArray) -> int:
    """How many decimals numbers had that have lost their marks, by their leading zeros: 0 where they had not all as many.

    Numbers of as many decimals go on from those with a leading zero to those without; others jump by a power of ten.
    """
    digits = {len(cells[i].strip(f"{SIGNS} \t")) - 1 for i in padded.tolist()}
    rows = np.flatnonzero(np.isfinite(values) & (values != 0))
    level = np.log10(np.abs(values[rows]))
    beside = np.isin(rows[1:], padded) != np.isin(rows[:-1], padded)
    apart = np.abs(np.diff(level))[beside]
    if len(digits) != 1 or (apart.size and float(np.median(apart)) > _GOES_ON) or (not apart.size and padded.size < rows.size):
        return 0
    return digits.pop()


def _lost(cells: Sequence[str], row: int, marked: BoolArray) -> Doubts:
    beside = int(np.flatnonzero(marked)[np.argmin(np.abs(np.flatnonzero(marked) - row))])
    if row == beside + 1 and not np.any(marked[row:]) and cells[row].lstrip(f"{SIGNS} \t")[:1] != "0":
        shown = f'"{cells[row].strip()}", above it "{cells[beside].strip()}"'
        return Doubts(fault=f"from this line on the numbers have no decimal mark, or are in another unit: {shown}", row=row)
    return Doubts(
        fault=f'some cells seem to have lost their decimal mark: "{cells[row].strip()}" beside "{cells[beside].strip()}"',
        row=row,
    )


def _jumping(cells: Sequence[str], values: FloatArray, decimal: str, quantity: str) -> Doubts:
    size = np.abs(values)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = size[1:] / size[:-1]
        jumps = (ratio > _JUMP) | (ratio < 1 / _JUMP)
    if not np.any(jumps) and np.all(np.isfinite(values)):
        return Doubts()
    rows = np.flatnonzero(np.isfinite(values) & (size > 0))
    if rows.size < 2:
        return Doubts()
    at = values[rows]
    level = np.log10(size[rows])
    steps = np.diff(level)
    if not np.any(np.abs(steps) > np.log10(_JUMP)):
        return Doubts()
    population = _without_mark(cells, rows, level, decimal) or _of_other_form(cells, rows, at, steps, decimal)
    if population is not None:
        if population.fault:
            return population
        rest = values.copy()
        rest[list(population.rows)] = np.nan
        other = _jumping(cells, rest, decimal, quantity)
        return Doubts({**other.rows, **population.rows}, other.fault, other.row)
    found: dict[int, str] = {}
    for _ in range(_PASSES):
        # One wrong number may hide another beside it.
        more = _off_by_units(cells, rows, at, decimal, quantity) | _off(cells, rows, at, level, decimal)
        more = _beyond_noise(more, values, rows, at)
        more = {
            row: power
            for row, power in more.items()
            if not (_is_about_zero(cells, values, row, decimal) or _came_off(cells, rows, at, row, decimal))
        }
        found |= more
        kept = ~np.isin(rows, list(more))
        if np.all(kept):
            break
        rows, at, level = rows[kept], at[kept], level[kept]
    # Where no number has a mark, those that are the fewer may be the right ones.
    unmarked = not any(decimal in c for c in cells)
    if len(found) > 1 and (unmarked or len(found) > _SHARE * (rows.size + len(found))):
        row, power = next(iter(found.items()))
        return Doubts(
            fault=f'"{cells[row].strip()}" and {len(found) - 1} more are off by powers of ten, such as {power}', row=row
        )
    return Doubts(
        {row: f'"{cells[row].strip()}" is off by a factor of {power} from its neighbours' for row, power in found.items()}
    )


def _beyond_noise(found: dict[int, str], values: FloatArray, rows: IntArray, at: FloatArray) -> dict[int, str]:
    """Those that are off the middle of their neighbours by more than noise about zero is."""
    if not found or at.size < _FEWEST:
        return found
    noise = float(np.median(np.abs(np.diff(at, 2)))) * 1.4826 / math.sqrt(6.0)
    kept = {}
    for row, power in found.items():
        k = int(np.searchsorted(rows, row))
        beside = float(np.median(at[[i for i in range(max(k - 2, 0), min(k + 3, at.size)) if i != k]]))
        if abs(values[row] - beside) > _NOISES * noise:
            kept[row] = power
    return kept


def _is_about_zero(cells: Sequence[str], values: FloatArray, row: int, decimal: str) -> bool:
    """Whether a number is one or two of its last digit off zero, among numbers near zero that are written alike."""
    beside = [i for i in range(max(row - 2, 0), min(row + 3, values.size)) if i != row and np.isfinite(values[i])]
    if len({_decimals(cells[i], decimal) for i in (row, *beside)}) != 1:
        return False
    counts = cells[row].strip(f"{SIGNS} \t").replace(decimal, "")
    near = max((abs(float(values[i])) for i in beside), default=np.inf)
    small = counts.isdecimal() and int(counts) <= _ABOUT_ZERO
    return small and near < _NEAR_ZERO * float(np.nanmax(values) - np.nanmin(values))


def _came_off(cells: Sequence[str], rows: IntArray, at: FloatArray, row: int, decimal: str) -> bool:
    """Whether the first or the last number is within noise of zero, where a pull ends or begins: any ratio to it is chance.

    The record crosses zero, and the number is written with as many decimals as those beside it.
    """
    if row not in (rows[0], rows[-1]) or at.size < _FEWEST or not (np.any(at > 0) and np.any(at < 0)):
        return False
    own, beside = (at[0], rows[:4]) if row == rows[0] else (at[-1], rows[-4:])
    if len({_decimals(cells[i], decimal) for i in beside.tolist()}) != 1:
        return False
    noise = float(np.median(np.abs(np.diff(at, 2)))) * 1.4826 / math.sqrt(6.0)
    return abs(float(own)) <= _NOISES * noise


def _without_mark(cells: Sequence[str], rows: IntArray, level: FloatArray, decimal: str) -> Doubts | None:
    """Doubts of whole numbers that go on from those with a mark if divided by one power of ten; None if they do as they are."""
    wide = np.flatnonzero(np.abs(np.diff(level)) > _APART)
    if not any((decimal in cells[rows[i]]) != (decimal in cells[rows[i + 1]]) for i in wide[:1000].tolist()):
        return None
    marked = np.array([decimal in cells[i] or "e" in cells[i].lower() for i in rows.tolist()])
    changes = np.flatnonzero(marked[1:] != marked[:-1])
    if not changes.size:
        return None
    steps = (level[1:] - level[:-1])[changes] * np.where(marked[changes], 1.0, -1.0)  # up to the one without a mark
    power = float(np.round(np.median(steps)))
    beside = _decimals(cells[rows[changes[0]] if marked[changes[0]] else rows[changes[0] + 1]], decimal)
    if (
        power < 1
        or (power < 2 and beside != power)
        or np.median(np.abs(steps)) < _APART
        or np.mean(np.abs(steps - power)) > _TOGETHER * np.mean(np.abs(steps))
    ):
        return None
    if np.median(np.abs(steps - power)) > _TOGETHER:
        return None
    whole = rows[~marked]
    if whole.size > _SHARE * rows.size and whole.size > 1:
        every = np.zeros(len(cells), dtype=bool)
        every[rows[marked]] = True
        return _lost(cells, int(rows[changes[0] + 1] if marked[changes[0]] else rows[changes[0]]), every)
    return Doubts({int(i): f"{_lost_mark(cells[i])}: its neighbours have one" for i in whole})


def _lost_mark(cell: str) -> str:
    """What a whole number among others with a mark may be."""
    written = cell.strip()
    nines = "stands for no reading, or " if _NINES.fullmatch(written) else ""
    return f'"{written}" {nines}seems to have lost its decimal mark'


def _of_other_form(cells: Sequence[str], rows: IntArray, at: FloatArray, steps: FloatArray, decimal: str) -> Doubts | None:
    """Doubts of single whole numbers where all others have as many decimals, and go on over them once these are put back."""
    wide = np.flatnonzero(np.abs(steps) > np.log10(_JUMP))
    whole = [
        k
        for k in dict.fromkeys((np.stack((wide, wide + 1), 1).ravel())[:1000].tolist())
        if cells[rows[k]].strip("+- \t").isdecimal()
    ]
    if not whole or rows.size < _FEWEST:
        return None
    marked = np.array([decimal in cells[i] for i in rows.tolist()])
    decimals = {_decimals(cells[i], decimal) for i in rows[marked].tolist()}
    if len(decimals) != 1 or np.count_nonzero(~marked) > max(1, _SHARE * rows.size):
        return None
    power, found = decimals.pop(), {}
    for k in whole:
        beside = at[marked & (np.abs(np.arange(rows.size) - k) <= 2)]
        low, high = float(np.min(beside, initial=np.inf)), float(np.max(beside, initial=-np.inf))
        room = high - low
        if low - room <= at[k] / 10.0**power <= high + room and not low - _WIDE * room <= at[k] <= high + _WIDE * room:
            row = int(rows[k])
            found[row] = f"{_lost_mark(cells[row])}: all others have {power} decimals"
    return Doubts(found) if found else None


def _off(cells: Sequence[str], rows: IntArray, at: FloatArray, level: FloatArray, decimal: str) -> dict[int, str]:
    """Rows of which a power of ten brings the number between its neighbours -> that power."""
    n = rows.size
    if n < _FEWEST:
        return {}
    up = np.diff(level)
    power = np.round(up)
    found: dict[int, str] = {}
    taken: set[int] = set()
    for j, end in _excursions(at, power):
        start = j + 1
        if start in taken:
            continue
        before, after = at[max(start - 3, 0) : start], at[end + 1 : end + 4]
        if before.size + after.size < _FEWEST_BESIDE or len(set(np.sign([*before, *after]))) != 1:
            continue
        mended = at[start : end + 1] / 10 ** power[j]
        low, high = float(min(before[-1], after[0])), float(max(before[-1], after[0]))
        parts = ((before, rows[max(start - 3, 0) : start]), (after, rows[end + 1 : end + 4]))
        beside = [float(np.max(np.abs(np.diff(v)) / np.diff(r), initial=0.0)) for v, r in parts]
        across = (high - low) / float(rows[end + 1] - rows[start - 1])
        step = max(across, *beside)
        # Another row beside it may be wrong, too: then those on the other side tell how large steps are.
        calm = max(across, min(beside))
        told_by = (step, calm) if start > 2 and end + 3 < n and step > _WILD * calm else (step,)
        middle = abs(low + high) / 2
        digits = max(_decimals(cells[i], decimal) for i in rows[start : end + 1].tolist())
        last = min(0.5 * 10.0 ** (-digits - power[j]), _ROUNDED * middle) if power[j] < 0 else 0.0
        alone = _alone(int(power[j])) * middle if end == start else 0.0
        missed = float(max(np.max(low - mended), np.max(mended - high)))
        if missed > max(_NEAR * step, alone) + last:
            continue
        smooth = 0 < step < _SMALL_STEPS * middle
        near = rows[[*range(max(start - 2, 0), start), *range(end + 1, min(end + 3, n))]].tolist()
        odd = all(_decimals(cells[i], decimal) != _decimals(cells[near[0]], decimal) for i in rows[start : end + 1].tolist())
        alike = len({_decimals(cells[i], decimal) for i in near}) == 1
        smalls = [s for s in told_by if missed <= max(_NEAR * s, alone) + last and _is_small(s, middle, int(power[j]))]
        lone = end == start and bool(smalls)
        if lone or (smooth and odd) or (odd and alike and step < _COARSE_STEPS * middle):
            taken.update(range(start, end + 2))
            found.update(dict.fromkeys(rows[start : end + 1].tolist(), _in_words(int(power[j]))))
    return found | {int(rows[at_end]): word for at_end, word in _off_at_ends(at, level) if int(rows[at_end]) not in found}


def _off_at_ends(at: FloatArray, level: FloatArray) -> list[tuple[int, str]]:
    """The first and the last number if they go on from the next three by a power of ten alone, and that power."""
    found = []
    for end, beside in ((0, at[1:4]), (-1, at[-2:-5:-1])):
        power = int(np.round(level[end] - np.log10(abs(beside[0]))))
        steps = np.diff(beside)
        step = float(np.max(np.abs(steps)))
        mended, middle = at[end] / 10.0**power, abs(float(beside[0]))
        alike = len(set(np.sign([at[end], *beside]))) == 1
        near = abs(mended - beside[0]) <= max(_NEAR * step, _NEAR_ALONE * middle)
        goes_on = steps.size > 1 and _goes_on(float(mended), float(beside[0] - steps[0]), float(np.ptp(steps)), step)
        if power and alike and ((near and _is_small(step, middle, power)) or (goes_on and step < _COARSE_STEPS * middle)):
            found.append((end, _in_words(power)))
    return found


def _goes_on(mended: float, expected: float, bend: float, step: float) -> bool:
    """Whether a number stands where numbers at regular steps let it be expected."""
    return bend <= _REGULAR * step and abs(mended - expected) <= _REGULAR * step


def _off_by_units(cells: Sequence[str], rows: IntArray, at: FloatArray, decimal: str, quantity: str) -> dict[int, str]:
    """Single rows that stand between their calm neighbours once the ratio of two units is taken off -> that ratio in words."""
    if rows.size < _FEWEST:
        return {}
    middle = (at[:-2] + at[2:]) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = at[1:-1] / middle
    wide = (ratio > _LEAST_UNIT) | ((ratio > 0) & (ratio < 1 / _LEAST_UNIT))
    calm = np.abs(at[2:] - at[:-2]) <= 2 * _CALM_BESIDE * np.abs(middle)
    found: dict[int, str] = {}
    for j in np.flatnonzero(wide & calm).tolist():
        before, after = at[max(j - 2, 0) : j + 1], at[j + 2 : j + 5]
        step = max(float(np.max(np.abs(np.diff(beside)), initial=0.0)) for beside in (before, after))
        if before.size + after.size < _FEWEST_BESIDE or step > 1.5 * _CALM_BESIDE * abs(middle[j]):
            continue
        digit = 0.5 * 10.0 ** -_decimals(cells[rows[j + 1]], decimal) / abs(at[j + 1])
        for size, words, of, names in _BETWEEN_UNITS:
            if abs(ratio[j] / size - 1) <= _NEAR_UNIT + digit:
                found[int(rows[j + 1])] = f"{words} ({names})" if of == quantity else words
                break
    return found


def _is_small(step: float, middle: float, power: int) -> bool:
    """Whether the steps beside a number are small enough for a single one that is off by this power of ten to be told."""
    return step < (_ONE_POWER if abs(power) == 1 else _MORE_POWERS) * middle


def _alone(power: int) -> float:
    return _NEAR_ALONE if abs(power) == 1 else _NEAR_BY_MORE


def _in_words(power: int) -> str:
    return f"{10**power:,}" if power > 0 else f"1/{10**-power:,}"


def _excursions(at: FloatArray, power: FloatArray) -> list[tuple[int, int]]:
    """Where a signal leaves by a power of ten and comes back by it: the last row before, the last row of it."""
    found = []
    for length in range(1, _RUN + 1):
        leave, back = power[:-length], power[length:]
        before, after = at[: -length - 1], at[length + 1 :]
        comes = (leave != 0) & (back == -leave) & (np.abs(after - before) <= _COARSE_STEPS * np.abs(before))
        found += [(int(j), int(j) + length) for j in np.flatnonzero(comes)]
    return sorted(found)


def _decimals(cell: str, decimal: str) -> int:
    """How many digits stand behind the decimal mark."""
    behind = cell.strip().partition(decimal)[2]
    return len(re.split("[eE]", behind)[0])
