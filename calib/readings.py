"""From the readings of one channel to their noise, their resolution, their excursion and the rows where they turn."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import median_filter

from models.sensor import FloatArray


def resolution(values: FloatArray) -> float:
    """Smallest step between readings, 0 if none is visible (more than nine digits).

    >>> resolution(np.array([0.125, 0.126, 0.131]))
    0.001
    """
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return 0.0
    top = float(np.max(np.abs(finite)))
    if top == 0.0:
        return 0.0
    first = -math.floor(math.log10(top))
    for digits in range(first, first + 10):
        scaled = finite * 10.0**digits
        whole = np.rint(scaled)
        if np.all(np.abs(scaled - whole) <= 1e-6 + 1e-12 * np.abs(scaled)):
            steps = np.diff(np.unique(whole))
            return float(np.min(steps)) / float(f"1e{digits}") if steps.size else 0.0
    return 0.0


def reading_noise(values: FloatArray) -> float:
    """Noise (sd) of one reading from second differences, which a smooth curve does not move; at least its resolution's."""
    if values.size < 3:
        return 0.0
    second = np.diff(values, 2)
    return max(1.4826 * float(np.median(np.abs(second))) / math.sqrt(6.0), resolution(values) / math.sqrt(12.0))


def excursion(values: FloatArray) -> FloatArray:
    """Excursion from the starting value, without single spikes."""
    smooth: FloatArray = median_filter(values, size=5, mode="nearest") if values.size >= 5 else values
    start = float(np.median(values[: max(1, min(9, values.size // 50))]))
    return np.asarray(smooth - start)


def reversals(values: FloatArray, threshold: float) -> list[int]:
    """Rows where the values turn by more than `threshold`, with the first and the last row."""
    turns = [0]
    direction = 0
    low = high = 0
    for i, v in enumerate(values.tolist()):
        if v > values[high]:
            high = i
        if v < values[low]:
            low = i
        if direction >= 0 and v < values[high] - threshold:
            if direction > 0 or values[high] - values[0] > threshold:
                turns.append(high)
            direction, low, high = -1, i, i
        elif direction <= 0 and v > values[low] + threshold:
            if direction < 0 or values[0] - values[low] > threshold:
                turns.append(low)
            direction, low, high = 1, i, i
    last = len(values) - 1
    return turns if turns[-1] == last else [*turns, last]
