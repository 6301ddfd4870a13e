"""From the readings of one channel to where contact begins: the one place where that onset is estimated, coarse and fine.

Callers need the onset for different purposes, so that there are several estimates; each uses the first where it can.

- `coarse_onset`, for the bins of a sweep: any abscissa, any number of readings, no error. A bin edge may be off by a reading.
- `fine_onset`, for the clocks: posterior mean and sd, the exponent of the rise integrated over; takes readings in order.
  `departure` is the same on another abscissa, such as an offset of clocks that moves the readings along the crosshead.
- `flat_part`, for grades and their load zero: the rows before the coarse onset, if they are flat; it may say that there are
  none, which an estimate of the onset cannot.
- `hertz_onset` and `level_before_contact`, for the centres of priors: from the few dozen points of a sweep, when the readings
  are gone. Too coarse for anything else, as a sensor on a padding does not follow Hertz.

How far they differ: on 300 simulated presses (force as a power of 1.5 to 2.1 of the depth, 0.7 mm deep, noise 0.1 % of the
range, 20 to 100 readings/s, 0.6 to 45 mm/min) the error of the onset [um], its median and 95 % of its size, is 3 and 11
(coarse), 0 and 10 (fine, stated sd 4, within two sd in 92 of 100), 1 and 14 (end of the flat part), 40 and 76 (Hertz). On the
two sensors of the project's data set, whose force is of finite elements and begins more slowly, the errors are -41 and -38
(coarse, flat part), -2 and -1 (fine, sd 4), 61 and 61 (Hertz): bins and grades stand that, a tie of clocks would not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from calib.lab.linear import fitted, log_evidence, slope_and_error
from calib.lab.signal import excursion, integrated_time, reading_noise
from models.sensor import BoolArray, FloatArray

# Share of the whole rise up to which a channel is looked at for its onset by `fine_onset`.
_ONSET_SHARE = 0.4
# Exponents with which force and capacitance may leave their flat parts.
_EXPONENTS = (1.2, 1.35, 1.5, 1.65, 1.8, 1.95, 2.1, 2.3, 2.6)
#: Readings before contact: from fewer than three no level can be estimated, from ten a good one.
FEW_BEFORE, TOO_FEW_BEFORE = 10, 3
# Slope of a beginning over the mean slope after it, above which it is no flat part but contact.
_FLAT_SLOPE = 0.1
#: Rise of a beginning, as a share of the range, above which it is contact too, and no drift.
FLAT_RISE = 0.05
#: Force, as a share of the range, up to which the ball touches the sensor lightly.
LIGHT_TOUCH = 0.01


# --- coarse: for bins ----------------------------------------------------------------------------------------------------


def coarse_onset(x: FloatArray, y: FloatArray) -> float:
    """Where a channel leaves its flat beginning, good enough to place bins; for a value with an error take `fine_onset`.

    Least squares of c + sum a_k (x - x_on)_+^p_k, p = 1.5, 2, 3, over x_on in steps of 0.001 of the range of x.

    Parameters
    ----------
    x, y : abscissa and readings, shape (n_row,), in any order and units.

    Returns
    -------
    On x; its first value where there are fewer than eight readings.
    """
    order = np.argsort(x, kind="stable")
    groups = np.array_split(order, min(300, x.size))
    xs = np.array([x[g].mean() for g in groups])
    ys = np.array([y[g].mean() for g in groups])
    length = float(np.ptp(xs))
    if length == 0 or xs.size < 8:
        return float(xs[0])
    u, v = (xs - xs[0]) / length, (ys - ys[0]) / max(float(np.ptp(ys)), 1e-300)

    def misfit(u0: float) -> float:
        w = np.maximum(u - u0, 0.0)
        basis = np.stack([np.ones_like(w), w**1.5, w**2, w**3], axis=1)
        residual = v - basis @ np.linalg.lstsq(basis, v, rcond=None)[0]
        return float(residual @ residual)

    grid = np.linspace(0.0, 0.85, 86)
    best = float(grid[np.argmin([misfit(g) for g in grid])])
    fine = np.clip(np.linspace(best - 0.01, best + 0.01, 21), 0.0, None)
    best = float(fine[np.argmin([misfit(g) for g in fine])])
    return float(xs[0] + best * length)


# --- fine: a value with its error ------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Beginning:
    """The first part of a channel's rise, in which its onset lies, as means of groups of neighbouring readings.

    Attributes
    ----------
    groups : rows of each group, in the order of reading.
    y : mean of each group less the first one, in shares of the channel's range.
    noise : sd of such a mean, likewise.
    """

    groups: list[npt.NDArray[np.intp]]
    y: FloatArray
    noise: float

    def means(self, values: FloatArray) -> FloatArray:
        """Means of the groups of something else that was read in the same rows (n_row,)."""
        return np.array([values[g].mean() for g in self.groups])


def beginning(values: FloatArray, rise: FloatArray, noise: float, scale: float) -> Beginning | None:
    """The first two fifths of a channel's rise, prepared for `departure`; None if it has fewer than twelve readings.

    Parameters
    ----------
    values : readings, shape (n_row,).
    rise : the largest excursion so far, shape (n_row,), never falling.
    noise : sd of one reading.
    scale : range of the channel, which `y` is given in. All in the unit of the readings.
    """
    end = int(np.searchsorted(rise, _ONSET_SHARE * rise[-1])) + 1
    if end < 12:
        return None
    groups = np.array_split(np.arange(end), min(end, 300))
    means = np.array([values[g].mean() for g in groups])
    sd = max(noise / np.sqrt(end / len(groups)), 1e-5 * scale) / scale
    return Beginning(groups, (means - means[0]) / scale, float(sd))


def departure(
    depth: Callable[[float], FloatArray], y: FloatArray, noise: float, low: float, high: float
) -> tuple[float, float] | None:
    """Where a channel leaves its flat part, with its error: posterior mean and sd of an onset g between two limits.

    From y = c + w^p (a + b w + d w^2) + error, w = max(depth(g), 0). c, a, b, d and the exponent p (1.2 to 2.6) are
    integrated over, so that the law with which the channel rises need not be known.

    Parameters
    ----------
    depth : an onset g -> how far each reading lies behind it, shape (n,), of order one, negative before it. The caller decides
        what g is, such as a reading of the crosshead or an offset of clocks.
    y : readings, shape (n,), in shares of their range.
    noise : sd of one of them, likewise.
    low, high : limits between which g is looked for.

    Returns
    -------
    None if the mean lies at an end of the range: then the readings hold no onset.
    """
    least, most = low, high
    prior = np.array([1.0, 3.0, 3.0, 3.0])
    raised = False
    for _ in range(10):
        grid = np.linspace(least, most, 41)
        scores = np.empty((len(_EXPONENTS), grid.size))
        for i, g in enumerate(grid):
            scores[:, i] = log_evidence(y, _powers(np.maximum(depth(float(g)), 0.0)), prior, noise)
        density = np.sum(np.exp(scores - np.max(scores)), axis=0)
        density /= np.sum(density)
        mean = float(density @ grid)
        sd = float(np.sqrt(density @ (grid - mean) ** 2))
        step = float(grid[1] - grid[0])
        if sd < 3 * step:
            reach = max(6 * sd, 4 * step)
            least, most = max(low, mean - reach), min(high, mean + reach)
            continue
        if not raised:
            # The residuals say whether the readings' errors are larger than their noise, or hang together.
            w = np.maximum(depth(mean), 0.0)
            p = _EXPONENTS[int(np.argmax(np.max(scores, axis=1)))]
            residual = y - fitted(y, np.stack([np.ones_like(w), w**p, w ** (p + 1), w ** (p + 2)], axis=1), prior, noise)
            actual = float(np.sqrt(np.mean(residual**2) * integrated_time(residual, 4)))
            raised = True
            if actual > 1.15 * noise:
                noise, least, most = actual, low, high
                continue
        break
    if mean - low < max(2 * sd, 0.01 * (high - low)) or high - mean < 2 * sd:
        return None
    return mean, sd


def _powers(w: FloatArray) -> FloatArray:
    """The functions of `departure` for each exponent, (n_exponent, n, 4)."""
    power = w ** np.array(_EXPONENTS)[:, None]
    return np.stack([np.ones_like(power), power, power * w, power * w**2], axis=-1)


def fine_onset(x: FloatArray, y: FloatArray) -> tuple[float, float] | None:
    """Where a rising channel leaves its flat part, and the sd of that: the estimate to take where the onset itself is used.

    Parameters
    ----------
    x : crosshead reading [m], shape (n_row,), of the loading branch in the order of reading.
    y : readings of a channel that rises in contact, shape (n_row,), in any unit.

    Returns
    -------
    Onset and sd [m]; None if the readings hold none, as in a record that starts in contact.
    """
    rise = np.maximum.accumulate(excursion(y))
    if rise[-1] <= 0:
        return None
    first = beginning(y, rise, reading_noise(y), float(rise[-1]))
    if first is None:
        return None
    xs = first.means(x)
    length = float(np.ptp(xs))
    if length <= 0:
        return None
    return departure(lambda g: (xs - g) / length, first.y, first.noise, float(xs[0]), float(xs[-1]))


# --- the rows before contact -----------------------------------------------------------------------------------------------


def flat_part(x: FloatArray, y: FloatArray) -> BoolArray:
    """Which rows lie before contact, (n_row,): those before the onset, if they are flat against what follows.

    The onset of a curve that stiffens is found far from its start even if it is in contact all along; what lies before is then
    no flat part, and the search goes on in it.

    Parameters
    ----------
    x, y : abscissa and readings that rise in contact, shape (n_row,), of the loading branch in the order of reading.

    Returns
    -------
    No row at all for a record that starts in contact.
    """
    rows, span = np.arange(x.size), float(np.ptp(y))
    while rows.size >= 8:
        onset = coarse_onset(x[rows], y[rows])
        flat = rows[x[rows] < onset]
        if flat.size < TOO_FEW_BEFORE:
            break
        end = float(np.max(x[rows]))
        tail = rows[x[rows] > end - 0.05 * (end - onset)]
        after = (float(np.mean(y[tail])) - float(np.mean(y[flat]))) / max(end - onset, 1e-300)
        slope, error = slope_and_error(x[flat], y[flat])
        level = abs(slope) - 2 * error <= min(_FLAT_SLOPE * abs(after), FLAT_RISE * span / max(float(np.ptp(x[flat])), 1e-300))
        if level and not _bends_up(x[flat], y[flat], span):
            return np.isin(np.arange(x.size), flat)
        rows = flat
    # Noise may hide the onset in a flat beginning as well as in a slow one; it is flat if nothing shows that it is not.
    order = np.arange(x.size)
    rise = float(np.ptp(np.sort(y)[x.size // 50 : x.size - x.size // 50])) / max(float(np.ptp(x)), 1e-300)
    for share in (0.5, 0.3, 0.2, 0.1, 0.05):
        first = order < share * x.size
        if np.sum(first) >= FEW_BEFORE:
            slope, error = slope_and_error(x[first], y[first])
            if abs(slope) <= 2 * error and abs(slope) + error <= _FLAT_SLOPE * rise:
                return first
    return np.zeros(x.size, dtype=bool)


def _bends_up(x: FloatArray, y: FloatArray, span: float) -> bool:
    """Whether y rises in the second half by half as much again as in the first, and by more than a light touch.

    That is contact: a drift goes on evenly or settles.
    """
    middle = (float(np.min(x)) + float(np.max(x))) / 2
    late = x > middle
    if min(np.sum(late), np.sum(~late)) < 5:
        return False
    (first, error), (second, other) = slope_and_error(x[~late], y[~late]), slope_and_error(x[late], y[late])
    rises = second * float(np.ptp(x[late])) > LIGHT_TOUCH * span
    return rises and second > 1.5 * first and second - first > 3 * math.hypot(error, other)


# --- from points, for the centre of a prior --------------------------------------------------------------------------------


def level_before_contact(x: FloatArray, y: FloatArray, sd: FloatArray) -> float:
    """What a channel reads before contact, estimated from the points of a sweep: the median of those before it begins to rise.

    Before contact: the leading points that stay within five sd, or 1 % of the range, of the first; at least three.

    Parameters
    ----------
    x : crosshead reading [m], shape (n_point,), in any order.
    y, sd : value of each point and its sd, shape (n_point,), in the unit of the channel; sd 0 where it is not known.

    Returns
    -------
    In the unit of y; nan if the sweep starts in contact.
    """
    order = np.argsort(x)
    level, spread = y[order], sd[order]
    close = np.abs(level - level[0]) <= np.maximum(5 * spread, 0.01 * np.ptp(level))
    n_before = int(np.argmin(close)) if not np.all(close) else level.size
    return float(np.median(level[:n_before])) if n_before >= 3 else float("nan")


def hertz_onset(x: FloatArray, force: FloatArray) -> float:
    """Crosshead reading [m] at first touch, estimated from the points of a sweep well enough to centre a prior.

    A line through F^(2/3) (Hertz: F ~ depth^(3/2)) of the first half of the loading, where it meets zero load. Off by some tens
    of micrometres for a sensor that stiffens faster than Hertz.

    Parameters
    ----------
    x : crosshead reading [m], shape (n_point,), in any order.
    force : load [N], shape (n_point,), its zero taken off.

    Returns
    -------
    At most half a millimetre before the first point; the first point where there are no three points in contact.
    """
    pressed = np.maximum(force, 0.0)
    top = float(np.max(pressed))
    part = (pressed > 0.03 * top) & (pressed < 0.5 * top)
    if np.count_nonzero(part) < 3:
        part = pressed > 0
    if np.count_nonzero(part) < 3 or np.ptp(x[part]) == 0:
        return float(np.min(x))
    slope, intercept = np.polyfit(x[part], np.cbrt(pressed[part]) ** 2, 1)
    onset = -intercept / slope if slope > 0 else np.min(x)
    return float(np.clip(onset, np.min(x) - 0.5e-3, np.max(x)))
