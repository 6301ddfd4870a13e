"""From the readings of one channel to their noise, their resolution, how long they hang together, and where they turn."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.ndimage import correlate1d, median_filter, uniform_filter1d

from models.sensor import BoolArray, FloatArray, IntArray

#: Range of a channel over the noise of one reading up to which there is nothing to calibrate against: the tie of two clocks
#: gives the channel up.
NO_SIGNAL = 10.0
# Most readings that `smoothed_record` averages over: many more cost time and improve little.
_WIDEST = 401
# By how many standard deviations a correlation has to show before readings count as dependent.
_SURE = 2.0
# Readings that come again, at least and as a share of all that differ, where steps are coarser than the last digit; and the
# share of their differences that single strays may make.
_COMES_AGAIN, _OFTEN, _STRAY = 5, 0.05, 0.05


def resolution(values: FloatArray) -> float:
    """The step by which an instrument's readings differ, as its file cuts them off, or its display or converter before that.

    In the unit of the readings; 0 if none is visible (more than nine digits). Readings that happen to be far apart have the
    step of their last digit, not of their differences.

    >>> resolution(np.array([0.125, 0.126, 0.131]))
    0.001
    >>> resolution(np.array([0.125, 0.145, 0.168]))
    0.001
    >>> resolution(np.array([0.125, 0.145, 0.165]))
    0.02
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
            distinct, counts = np.unique(whole, return_counts=True)
            if distinct.size < 2:
                return 0.0
            steps = np.diff(distinct)
            common = float(np.gcd.reduce(steps.astype(np.int64)))
            return max(common, _step_of_most(steps, counts, 1.0)) / float(f"1e{digits}")
    distinct, counts = np.unique(finite, return_counts=True)
    return _step_of_most(np.diff(distinct), counts, 1e-9 * top)


def _step_of_most(steps: FloatArray, counts: IntArray, digit: float) -> float:
    """The step that most differences of neighbouring readings are a multiple of, give or take a digit; 0 if none shows.

    Readings on a curve may leave out what lies between, too; those of a coarse display or converter come again.

    Parameters
    ----------
    steps, counts : of the readings by size, each once: their differences, (n - 1,), and how often each is there, (n,).
    digit : their last digit.
    """
    if steps.size < _COMES_AGAIN or np.count_nonzero(counts > 1) < max(_COMES_AGAIN, _OFTEN * counts.size):
        return 0.0
    least = float(np.quantile(steps, _STRAY, method="lower"))
    if least < 2.5 * digit:
        return 0.0
    near = steps[(steps > 0.5 * least) & (steps < 1.5 * least)]
    middle = float(np.quantile(near, 0.5, method="lower"))
    step = float(np.mean(near[np.abs(near - middle) <= 1.01 * digit + 1e-6 * middle]))
    small = steps[steps < 3.5 * step]
    off = np.abs(small - np.rint(small / step) * step) > 1.01 * digit + 1e-6 * step
    shows = near.size >= _COMES_AGAIN and np.mean(off) <= 2 * _STRAY
    return step if shows else 0.0


def reading_noise(values: FloatArray) -> float:
    """Estimate the noise (sd) of one reading from readings along a smooth curve that is not known.

    It comes from second differences, which a smooth curve hardly moves, and is at least what the resolution alone makes. The
    readings in order, in their unit; 0 for fewer than three.
    """
    if values.size < 3:
        return 0.0
    second = np.diff(values, 2)
    return max(1.4826 * float(np.median(np.abs(second))) / math.sqrt(6.0), resolution(values) / math.sqrt(12.0))


def increasing_rows(time: FloatArray) -> BoolArray:
    """Which rows of a record to keep so that its time strictly increases: those later than all before them, (n_row,)."""
    return np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0])


def smoothed_record(time: FloatArray, x: FloatArray, window: int) -> tuple[FloatArray, FloatArray]:
    """A record of the crosshead with the noise of its readings averaged out, because the sensor never felt that noise.

    Parabolas through `window` readings (Savitzky & Golay, Anal. Chem. 36 (1964) 1627), or fewer where more are no parabola
    (steps, corners): a reading is replaced where the residuals around it are no larger than its noise lets them be, and stays
    where they always are. Its stamp is averaged in the same way.

    Parameters
    ----------
    time : [s], shape (n,), increasing.
    x : readings at these times, shape (n,), in any unit.
    window : readings to average over at most; of more than 401 only so many.

    Returns
    -------
    Time and readings, each of shape (n,).
    """
    noise = reading_noise(x)
    smooth_time, smooth_x, left = time.copy(), x.copy(), np.ones(x.size, dtype=bool)
    window = (min(window, _WIDEST, x.size) - 1) // 2 * 2 + 1
    while window >= 5:
        smooth = _by_parabolas(x, window)
        square = uniform_filter1d((x - smooth) ** 2, window, mode="nearest")
        good = left & (square <= noise**2 * (1 + 4 * math.sqrt(2 / window)))
        smooth_x[good], smooth_time[good] = smooth[good], _by_parabolas(time, window)[good]
        left &= ~good
        window = window // 4 * 2 + 1
    return smooth_time, smooth_x


def _by_parabolas(x: FloatArray, window: int) -> FloatArray:
    """The middle of the parabola through each `window` readings, an odd number; at the ends along the first and last of these.

    What `scipy.signal.savgol_filter(x, window, 2)` gives, whose package takes a third of a second to load.
    """
    half = window // 2
    powers = np.vander(np.arange(-half, half + 1.0), 3, increasing=True)
    fit = np.linalg.pinv(powers)
    smooth = correlate1d(x, fit[0], mode="nearest")
    smooth[:half] = powers[:half] @ (fit @ x[:window])
    smooth[-half:] = powers[-half:] @ (fit @ x[-window:])
    return np.asarray(smooth, dtype=float)


def integrated_time(residual: FloatArray, freedom: int = 0) -> float:
    """How many readings in a row count as one independent reading, because neighbours share their errors.

    The integrated autocorrelation time tau = 1 + 2 sum rho_k in readings, at least 1; the sum ends at 5 tau (Sokal's window).
    White readings give 1 + 2 sum rho_k = 1 give or take sqrt(2 (2 M + 1) / n) for a window of M, as each rho_k scatters by
    1 / sqrt(n) (Bartlett, J. R. Stat. Soc. Suppl. 8 (1946) 27). Where neither this sum is above 1, nor the correlation of
    neighbours above 0, by more than two of their standard deviations, readings count as independent: if only what chance takes
    off were cut away, what it adds would make the noise of white readings, as inferred from their means, come out low.

    Mean over 600 series (300 of the longest), over the true tau; in brackets what it is without that rule. Of series shorter
    than fifty tau it is too small:

        readings    white          tau 1.5        tau 3          tau 10
        100         1.03 (1.13)    0.85 (0.92)    0.78 (0.78)    0.50 (0.50)
        200         1.02 (1.09)    0.92 (0.95)    0.90 (0.90)    0.69 (0.69)
        500         1.02 (1.08)    0.99 (0.99)    0.97 (0.97)    0.93 (0.93)
        1,000       1.01 (1.05)    0.97 (0.97)    0.98 (0.98)    0.95 (0.95)
        5,000       1.00 (1.03)    1.00 (1.00)    1.00 (1.00)    1.00 (1.00)

    Parameters
    ----------
    residual : shape (n,), in the order of reading, without trend.
    freedom : free numbers p of the smooth that was taken off. It took slow noise with it: a share of (2 k + 1) p / n of the
        sum up to lag k, for which tau is corrected (by a factor of two at most).
    """
    n = residual.size
    r = residual - residual.mean()
    power = float(r @ r)
    if n < 8 or power == 0.0:
        return 1.0
    spectrum = np.abs(np.fft.rfft(r, 2 * n)) ** 2
    rho = np.fft.irfft(spectrum)[: n // 2] / power
    tau = 1 + 2 * np.cumsum(rho[1:])
    enough = np.flatnonzero(np.arange(1, tau.size + 1) >= 5 * tau)
    last = int(enough[0]) if enough.size else tau.size - 1
    terms = 2 * (last + 1) + 1
    left = 1 - min(0.5, terms * freedom / n)
    found = float(tau[last]) / left
    if found < 1 + _SURE * math.sqrt(2 * terms / n) / left and rho[1] + freedom / n < _SURE / math.sqrt(n):
        return 1.0
    return max(1.0, found)


def excursion(values: FloatArray) -> FloatArray:
    """How far each reading is from where the record started, (n_row,), in the unit of the readings, without single spikes."""
    smooth: FloatArray = median_filter(values, size=5, mode="nearest") if values.size >= 5 else values
    start = float(np.median(values[: max(1, min(9, values.size // 50))]))
    return np.asarray(smooth - start)


def reversals(values: FloatArray, threshold: float) -> list[int]:
    """Rows where a record turns round, from rising to falling or back, with its first and its last row.

    Parameters
    ----------
    values : readings in order, shape (n_row,).
    threshold : how far the values must come back to count as turned, in their unit.

    Returns
    -------
    Row numbers in order.
    """
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


def _rise(values: FloatArray) -> FloatArray:
    """The excursion, turned so that its largest is a rise."""
    away = excursion(values)
    return np.asarray(away * (float(np.sign(away[np.argmax(np.abs(away))])) or 1.0))


def crests(values: FloatArray) -> list[int]:
    """Rows at which each press is deepest: where a record turns, or ends, after rising by half of its largest excursion."""
    rise = _rise(values)
    top = float(np.max(rise))
    turns = reversals(rise, max(0.1 * top, 6 * reading_noise(values)))
    return [b for a, b in pairwise(turns) if rise[b] - rise[a] > 0.5 * top]


def first_crest(values: FloatArray) -> int:
    """How many rows of a record of capacitance over time alone (n_row,) belong to its first loading, up to its first crest.

    All of them where the record holds no signal.
    """
    noise = reading_noise(values)
    rise = _rise(values)
    top = float(np.max(rise))
    if top <= NO_SIGNAL * noise:
        return int(values.size)
    turns = reversals(rise, max(0.1 * top, 6 * noise))
    crest = next((b for b in turns[1:] if rise[b] >= 0.5 * top), int(np.argmax(rise)))
    # A hold creeps on by less than 2 % and must not count as loading.
    return max(5, int(np.argmax(rise[: crest + 1] >= 0.98 * rise[crest])) + 1)
