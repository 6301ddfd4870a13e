"""From the readings of a record without a clock to whether its rows were sorted by one, which mixes loading with unloading."""

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
from calib.lab.instruments.units import IN_PLACE_OF
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
    """List what shows that the rows of a record without a time were sorted by a column of their readings.

    A column of measured readings never goes back where rows were sorted by it; the rows of both ways of the ball then stand in
    turn, so that another channel goes to and fro between two levels, and what was measured out of contact is shuffled.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    judged = [c for c in columns if c.quantity in _CHANNELS and c.quantity in values]
    if "time" in values or len(judged) < 2:
        return []
    there = np.all([np.isfinite(values[c.quantity]) for c in judged], axis=0)
    rows = np.flatnonzero(there)
    if rows.size < _FEWEST:
        return []
    held = {c: values[c.quantity][rows] for c in judged}
    for by in judged:
        if not _in_order(held[by]):
            continue
        for other in judged:
            if other is by or not _mixed(by, held[by], other, held[other]):
                continue
            if is_confirmed(sheet, other.index, other.heading, other.factor, reading):
                continue
            quantity = IN_PLACE_OF.get(other.quantity, other.quantity)
            unit = unit_in_words(sheet, other.index, other.heading, reading)
            message = (
                f'the rows are in the order of column "{sheet.names[by.index]}", and "{sheet.names[other.index]}" goes to and '
                "fro along them, as if they were sorted, which mixes loading with unloading"
            )
            advice = (
                "Export them in the order in which they were read, best with their time; or the loading rows alone; if they "
                f"are in that order, let the header name the unit and say it once more: --units {quantity}={unit}"
            )
            return [Fault(message, sheet.text.path, int(sheet.lines[rows[0]]), by.index + 1, advice=advice)]
    return []


def _mixed(by: ReadColumn, v: FloatArray, other: ReadColumn, y: FloatArray) -> bool:
    """Whether another channel shows that rows in the order of one are of two ways of the ball."""
    if by.quantity == "force" and other.quantity == "displacement" and _turning(y) > _TURNS:
        return True
    if by.quantity == "displacement":
        if other.quantity == "force" and _is_of_two(v, y if v[0] < v[-1] else y[::-1]):
            return True
        return _of_two_levels(v, y)
    return _of_two_levels(v, y) or (other.quantity == "displacement" and _shuffled(v, y))


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
    if not off.grows or np.median(off.scatter[at]) < max(float(np.median(np.abs(steps))), least_apart(x)):
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
