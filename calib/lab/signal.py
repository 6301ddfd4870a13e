"""From the readings of one channel to their noise, their resolution, their excursion and the rows where they turn."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.signal import savgol_filter

from models.sensor import BoolArray, FloatArray

# Most readings that `quiet` averages over: many more cost time and tell little.
_WIDEST = 401


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


def ahead(time: FloatArray) -> BoolArray:
    """Rows whose stamp comes after all before it."""
    return np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0])


def quiet(time: FloatArray, x: FloatArray, window: int) -> tuple[FloatArray, FloatArray]:
    """A record with the noise of its readings averaged out, stamps alike: what followed the crosshead did not follow its noise.

    Parabolas through `window` readings (Savitzky & Golay, Anal. Chem. 36 (1964) 1627), or fewer where more are no parabola
    (steps, corners): a reading is replaced where the residuals around it are no larger than its noise lets them be, and stays
    where they always are.
    """
    noise = reading_noise(x)
    smooth_time, smooth_x, left = time.copy(), x.copy(), np.ones(x.size, dtype=bool)
    window = (min(window, _WIDEST, x.size) - 1) // 2 * 2 + 1
    while window >= 5:
        smooth = savgol_filter(x, window, 2)
        square = uniform_filter1d((x - smooth) ** 2, window, mode="nearest")
        good = left & (square <= noise**2 * (1 + 4 * math.sqrt(2 / window)))
        smooth_x[good], smooth_time[good] = smooth[good], savgol_filter(time, window, 2)[good]
        left &= ~good
        window = window // 4 * 2 + 1
    return smooth_time, smooth_x


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
