"""From the readings of a record to whether its rows were sorted by one of them, which mixes loading with unloading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from calib.errors import Fault
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import least_apart, noise_of
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from calib.lab.stretches import stretches
from models.sensor import FloatArray

_CHANNELS = ("displacement", "force", "capacitance", "capacitance_series")
_FEWEST = 20
# A column in order while another turns at such a share of its steps.
_TURNS = 0.2
# A displacement in order whose steps differ by such a factor (8 of 10 of them), and a force whose scatter in contact is so many
# times that before it, as of two branches.
_UNEVEN, _SCATTER = 4.0, 6.0
# Readings are held against a line through those beside them, and their scatter is told over so many; rows without ends.
_BESIDE, _NEAR, _FEWEST_HELD = 11, 25, 24
# The scatter where it is large is so many times that where it is least; the share of its largest from which on rows are judged.
_GROWS, _LARGE = 2.5, 0.5
# Two levels: the bimodality of what is off (1 of two points, 0.33 of noise, 0.56 of a saw, 0.67 of a wave), and how far a row
# may go with the next one. Rows in turn: how far they go against the next one (0.1 of noise). The share of rows that are as the
# next one, and what is left of the scatter from row to row, where the channels differ in pace.
_TWO_LEVELS, _WITH, _IN_TURN, _HELD, _EVENLY = 0.6, 0.15, -0.45, 0.2, 0.5
# Places that are shuffled turn at such a share of so many steps at least (two thirds by chance).
_SHUFFLED, _FEWEST_SHUFFLED = 0.35, 10

# Beside a clock: steps of shuffled places, in shares of their range; two levels apart by so many last digits; how many rows are
# the top, and the share of the scatter that is left there; of two curves each scatters by such a share of both together, holds
# such a share of the rows, and is left for the other by such a share of them.
_FAR, _DIGITS, _AT_TOP, _MEET, _SMOOTHER, _HALF, _CHANGES = 0.01, 3.0, 6, 0.4, 0.45, 0.4, 0.35

# Beside a channel that comes back by such a share of its range, one that was sorted alone goes on by such a share of its own on
# either side of the turn, in readings of which such a share differ. Over such a share of the rows its paces before and behind
# it differ by such a share of their sum at most, or of what they differ by somewhere else.
_COMES_BACK, _ON, _DIFFER, _NEAR_TURN, _SAME_PACE, _NO_CORNER = 0.5, 0.1, 0.5, 0.15, 0.2, 0.3


@dataclass(frozen=True, eq=False)
class _Off:
    """How far readings are off those beside them, and how they scatter about there, (n_row,); which of them scatter most."""

    by: FloatArray
    scatter: FloatArray

    @property
    def large(self) -> IntArray:
        return np.flatnonzero(self.scatter > _LARGE * np.quantile(self.scatter, 0.95))

    @property
    def grows(self) -> bool:
        low, high = np.quantile(self.scatter, [0.1, 0.95])
        return bool(high > _GROWS * low)


def sorted_rows(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading) -> list[Fault]:
    """List what shows that the rows of a record were sorted by a column of their readings, with or without a time beside them.

    A column of measured readings never goes back where rows were sorted by it; the rows of both ways of the ball then stand in
    turn, so that another channel goes to and fro between two levels, and what was measured out of contact is shuffled. Beside a
    time, which may not have been sorted with them, less is taken for it: steps in which the load relaxes, and one that sticks
    and slips, go to and fro, too, but not on two curves that meet at the top.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    judged = [c for c in columns if c.quantity in _CHANNELS and c.quantity in values]
    if len(judged) < 2:
        return []
    there = np.all([np.isfinite(values[c.quantity]) for c in judged], axis=0)
    rows = np.flatnonzero(there)
    if rows.size < _FEWEST:
        return []
    held = {c: values[c.quantity][rows] for c in judged}
    mixed = _mixed_beside_a_clock if "time" in values else _mixed
    clock = ", and the time was not sorted with them" if "time" in values else ""
    apart = [
        (by, other)
        for by in judged
        if _in_order(held[by])
        for other in judged
        if other is not by and mixed(by, held[by], other, held[other])
    ]
    # Whoever says one of them once more says that the rows are in order.
    if not apart:
        return _sorted_alone(sheet, rows, held, reading)
    if any(is_confirmed(sheet, c.index, c.heading, c.factor, reading) for _, c in apart):
        return []
    by, other = apart[0]
    quantity = stands_for(other.quantity)
    unit = unit_in_words(sheet, other.index, other.heading, reading)
    message = (
        f'the rows are in the order of column "{sheet.names[by.index]}", and "{sheet.names[other.index]}" goes to and '
        f"fro along them, as if they were sorted{clock}, which mixes loading with unloading"
    )
    advice = (
        "Export them in the order in which they were read, best with their own time; or the loading rows alone; if they "
        f"are in that order, let the header name the unit and say it once more: --units {quantity}={unit}"
    )
    return [Fault(message, sheet.text.path, int(sheet.lines[rows[0]]), by.index + 1, advice=advice)]


def _sorted_alone(sheet: Sheet, rows: IntArray, held: Mapping[ReadColumn, FloatArray], reading: Reading) -> list[Fault]:
    """List a force or a capacitance that was sorted while the others, and their clock, were not.

    A force beside a displacement is judged with their signs.
    """
    for by, v in held.items():
        if by.quantity == "displacement" or not _in_order(v) or np.unique(v).size < _DIFFER * v.size:
            continue
        beside = [
            c
            for c in held
            if c is not by and _goes_on_as_it_turns(v, held[c]) and {c.quantity, by.quantity} != {"displacement", "force"}
        ]
        if not beside or is_confirmed(sheet, by.index, by.heading, by.factor, reading):
            continue
        quantity = stands_for(by.quantity)
        unit = unit_in_words(sheet, by.index, by.heading, reading)
        message = (
            f'column "{sheet.names[by.index]}" goes one way from the first row to the last, while "'
            f'{sheet.names[beside[0].index]}" goes there and comes back: it was sorted alone, or its drift hides the press'
        )
        left = {c.quantity for c in held if c is not by}
        enough = (
            left >= {"displacement", "force"}
            if quantity == "capacitance"
            else bool(left & {"capacitance", "capacitance_series"})
        )
        out = f"leave it out: --columns {quantity}=none; or, " if enough else ""
        advice = (
            f"Export the file again, and sort no column alone; or {out}if it was read so, let the header name the unit and say "
            f"it once more: --units {quantity}={unit}"
        )
        return [Fault(message, sheet.text.path, int(sheet.lines[rows[0]]), by.index + 1, advice=advice)]
    return []


def _goes_on_as_it_turns(v: FloatArray, y: FloatArray) -> bool:
    """Whether readings go on at their pace wherever another channel, which goes there and comes back, turns round."""
    away = np.abs(y - y[0])
    tops = [first + int(np.argmax(away[first:end])) for first, end in stretches(away > _COMES_BACK * np.ptp(y))]
    on = _ON * np.ptp(v)
    inner = [
        k
        for k in tops
        if min(abs(v[k] - v[0]), abs(v[-1] - v[k])) > on and away[k] - np.min(away[k:]) > _COMES_BACK * np.ptp(y)
    ]
    return bool(inner) and all(_has_no_corner(v, k) for k in inner)


def _has_no_corner(v: FloatArray, turn: int) -> bool:
    """Whether readings go on at their pace over a row, or change it by less there than elsewhere."""
    near = max(round(_NEAR_TURN * min(turn, v.size - 1 - turn)), 2)
    if min(turn, v.size - 1 - turn) < near:
        return False
    corners = np.abs(v[2 * near :] - 2 * v[near:-near] + v[: -2 * near])
    at = turn - near
    elsewhere = np.concatenate([corners[: max(at - near, 0)], corners[at + near + 1 :]])
    both = abs(float(v[turn + near] - v[turn - near]))
    return bool(corners[at] <= max(_SAME_PACE * both, _NO_CORNER * float(np.max(elsewhere, initial=0.0))))


def _mixed(by: ReadColumn, v: FloatArray, other: ReadColumn, y: FloatArray) -> bool:
    """Whether another channel shows that rows in the order of one are of two ways of the ball."""
    if by.quantity == "force" and other.quantity == "displacement" and _turning(y) > _TURNS:
        return True
    if by.quantity == "displacement":
        if other.quantity == "force" and _is_of_two(v, y if v[0] < v[-1] else y[::-1]):
            return True
        return _of_two_levels(v, y)
    return _of_two_levels(v, y) or (other.quantity == "displacement" and _shuffled(v, y))


def _mixed_beside_a_clock(by: ReadColumn, v: FloatArray, other: ReadColumn, y: FloatArray) -> bool:
    """The same where a time goes on from row to row, which is evidence that they are in order, unless much says otherwise."""
    if y.size < _FEWEST_HELD:
        return False
    by_top = slice(None, None, 1 if abs(v[-1] - np.median(v)) > abs(v[0] - np.median(v)) else -1)
    v, y = v[by_top], y[by_top]
    far = other.quantity == "displacement" and _shuffled(v, y) and _goes_far(v, y)
    return far or _on_two_curves(v, y)


def _goes_far(v: FloatArray, x: FloatArray) -> bool:
    """Whether places that are shuffled are as far apart as those of a ball that goes to and fro out of contact."""
    off = _off(v, x)
    return float(np.median(np.abs(np.diff(x))[off.large[off.large < x.size - 1]])) > _FAR * float(np.ptp(x))


def _on_two_curves(v: FloatArray, y: FloatArray) -> bool:
    """Whether readings lie on two curves, each by far smoother than both together, that meet at the top."""
    off = _off(v, y)
    at = off.large
    scatter = float(np.median(off.scatter[at])) if off.grows else 0.0
    if at.size < _FEWEST_HELD // 2 or scatter < _DIGITS * least_apart(y):
        return False
    there, rest = (a[-_AT_TOP:] - np.mean(a[-_AT_TOP:]) for a in (v, y))
    spread = float(there @ there)
    rest = rest - there * (float(there @ rest) / spread if spread > 0 else 0.0)
    if float(np.sqrt(np.mean(rest**2))) > _MEET * float(np.max(off.scatter)):
        return False
    above = off.by[at] > 0
    if np.mean(above[1:] != above[:-1]) < _CHANGES:
        return False
    own = []
    for way in (at[above], at[~above]):
        if way.size < max(_BESIDE, _HALF * at.size):
            return False
        own.append(_off(v[way], y[way]).by[_BESIDE // 2 : -(_BESIDE // 2)])
    return float(np.sqrt(np.mean(np.concatenate(own) ** 2))) < _SMOOTHER * float(np.sqrt(np.mean(off.by[at] ** 2)))


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


def _of_two_levels(v: FloatArray, y: FloatArray) -> bool:
    """Whether readings lie on two levels along those in order, where they scatter more than elsewhere.

    A channel that was written in several rows lies on levels, too: it stands still from row to row. One that is written beside
    a slower one goes on evenly from row to row.
    """
    if y.size < _FEWEST_HELD:
        return False
    off, by_row = _off(v, y), _off(np.arange(y.size, dtype=np.float64), y)
    at = off.large
    if not at.size:
        return False
    scatter = float(np.median(off.scatter[at]))
    evenly = float(np.median(by_row.scatter[at])) < _EVENLY * scatter
    if not off.grows or evenly or at.size < _FEWEST_HELD // 2 or scatter < least_apart(y):
        return False
    ahead = at[at < y.size - 1]
    if np.mean(y[ahead] == y[ahead + 1]) > _HELD:
        return False
    z = off.by / np.maximum(off.scatter, 1e-300)
    with_next = float(np.mean(z[ahead] * z[ahead + 1])) / max(float(np.mean(z[ahead] ** 2)), 1e-300)
    return with_next < _IN_TURN or (with_next < _WITH and _bimodality(z[at]) > _TWO_LEVELS)


def _shuffled(v: FloatArray, x: FloatArray) -> bool:
    """Whether places go to and fro from row to row somewhere, by far more than elsewhere, as those out of contact do."""
    if x.size < _FEWEST_HELD:
        return False
    off = _off(v, x)
    at = off.large[off.large < x.size - 1]
    steps = np.diff(x)
    if not at.size or not off.grows or np.median(off.scatter[at]) < max(float(np.median(np.abs(steps))), least_apart(x)):
        return False
    ways = np.sign(steps[at])
    ways = ways[ways != 0]
    turns = ways[1:] != ways[:-1]
    return turns.size >= _FEWEST_SHUFFLED and float(np.mean(turns)) > _SHUFFLED


def _off(v: FloatArray, y: FloatArray) -> _Off:
    """How far readings are off a line through those beside them, over the values of another column in order."""
    v, y = (a - np.mean(a) for a in (v, y))

    def mean(a: FloatArray) -> FloatArray:
        return np.asarray(uniform_filter1d(a, _BESIDE, mode="nearest"))

    mv, my = mean(v), mean(y)
    spread = mean(v * v) - mv * mv
    flat = spread <= 1e-9 * np.max(spread)
    slope = np.where(flat, 0.0, (mean(v * y) - mv * my) / np.where(flat, 1.0, spread))
    by = y - my - slope * (v - mv)
    inner = slice(_BESIDE // 2, y.size - _BESIDE // 2)
    scatter = np.sqrt(np.maximum(uniform_filter1d(by[inner] ** 2, _NEAR, mode="nearest"), 0.0))
    edge = (inner.start, y.size - inner.stop)
    return _Off(np.where(np.arange(y.size) < inner.start, 0.0, by), np.pad(scatter, edge, mode="edge"))


def _bimodality(z: FloatArray) -> float:
    """Sarle's coefficient: 1 plus the square of the skewness, over the kurtosis."""
    z = z - np.mean(z)
    square = max(float(np.mean(z**2)), 1e-300)
    return (1 + float(np.mean(z**3)) ** 2 / square**3) * square**2 / max(float(np.mean(z**4)), 1e-300)
