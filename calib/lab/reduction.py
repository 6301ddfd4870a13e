"""From a channel of a sweep to tens of bin means, with the noise of one reading and how many readings are independent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from calib.lab.signal import integrated_time, resolution
from models.sensor import BoolArray, FloatArray

# Groups of readings in which the onset of the curve's bend is looked for; as far beyond a coarse one as such shares of the
# abscissa, the first in which further powers add less than so many variances, if so many groups are there; and pieces of the
# spline of that curve. How unsure the onset is tells a curvature over so much of the abscissa, and this is the most.
_GROUPS, _NEAR, _POWERS, _UNSEEN, _FEWEST, _STIFF = 300, (1.0, 0.5, 0.35, 0.25, 0.18), (1.5, 2.0, 2.5), 9.0, 30, 6
_ASIDE, _WIDEST = 0.002, 0.05
# Pieces, at most, of the splines among which the smooth is chosen.
_PIECES = (12, 6, 3, 1)


@dataclass(frozen=True)
class NoiseEstimate:
    """What the readings of a channel say about their own errors.

    Attributes
    ----------
    noise : sd of one reading about a smooth curve, at least resolution / sqrt(12), in the unit of the channel.
    correlation : integrated autocorrelation time tau = 1 + 2 sum rho_k in readings; n of them count as n / tau.
    resolution : smallest step between readings, in the unit of the channel; 0 if none is visible.
    repeat : rows per reading, 1 unless a meter slower than its logger is written several times: only the first row counts.
    n_row, n_reading, n_point : rows of the branch, readings among them, points they were reduced to.
    outliers : readings further than six sd from the curve; they are kept.
    """

    noise: float
    correlation: float
    resolution: float
    repeat: float
    n_row: int
    n_reading: int
    n_point: int
    outliers: int


@dataclass(frozen=True, eq=False)
class Reduced:
    """A channel reduced to a few dozen points, each the mean of the readings in a bin of the abscissa.

    Attributes
    ----------
    abscissa, value : mean abscissa and reading of each bin, shape (n_point,), less what the curve's bend adds to the latter.
    n_effective : independent readings in each: its sd is `noise` / sqrt(n_effective).
    estimate : what the readings say about their own errors.
    smooth : abscissa -> a smooth curve through all readings.
    edges : of the bins on the abscissa, shape (n_bin + 1,).
    """

    abscissa: FloatArray
    value: FloatArray
    n_effective: FloatArray
    estimate: NoiseEstimate
    smooth: Callable[[FloatArray], FloatArray]
    edges: FloatArray

    @property
    def noise(self) -> float:
        """Standard deviation of one reading, in the unit of the channel."""
        return self.estimate.noise


def fresh_readings(values: FloatArray) -> BoolArray:
    """Which rows hold a new reading and no copy of the one before, (n,): a logger may write a slow meter several times.

    Values that stand still for several rows and then move by several steps of the resolution were not read anew. A channel of
    coarse resolution stands still too, but moves by one step; a flat stretch stands still once. Rows in the order of reading.

    >>> int(fresh_readings(np.repeat([1.0, 1.5, 1.2, 1.9, 2.3, 1.1, 1.7], 3)).sum())
    7
    """
    every = np.ones(values.size, dtype=bool)
    if values.size < 12:
        return every
    first = np.concatenate([[True], np.diff(values) != 0])
    starts = np.flatnonzero(first)
    lengths = np.sort(np.diff(np.append(starts, values.size)))
    typical = float(np.mean(lengths[: max(1, math.ceil(0.95 * lengths.size))]))
    moves = np.abs(np.diff(values[starts]))
    if lengths.size < 6 or typical < 1.25 or float(np.median(moves)) < 2.5 * resolution(values):
        return every
    return first


class _Means(NamedTuple):
    """Means of abscissa and readings in some hundred groups of neighbours on the abscissa, (n_group,)."""

    x: FloatArray
    y: FloatArray


def _means_of(x: FloatArray, y: FloatArray) -> _Means:
    groups = np.array_split(np.argsort(x, kind="stable"), min(_GROUPS, x.size))
    return _Means(np.array([np.mean(x[g]) for g in groups]), np.array([np.mean(y[g]) for g in groups]))


def _smooth_basis(x: FloatArray, onset: float, most: int) -> Callable[[FloatArray], FloatArray]:
    """What smooths over x consist of, at -> (n_at, n_term): powers of the distance from the onset, and a cubic spline.

    The spline, for what powers leave, has `most` pieces at most.
    """
    from scipy.interpolate import BSpline  # a quarter of a second, which those do not wait for who read no lab file

    lo, length = float(np.min(x)), max(float(np.ptp(x)), 1e-300)
    u0 = float(np.clip((onset - lo) / length, 0.0, 0.95))
    pieces = int(np.clip(np.sum(x > lo + u0 * length) // 15, 1, most))
    inner = np.linspace(u0, 1.0, pieces + 1)[1 if u0 < 0.02 else 0 : -1]
    knots = np.concatenate([np.zeros(4), inner, np.ones(4)])

    def basis(at: FloatArray) -> FloatArray:
        u = np.clip((at - lo) / length, 0.0, 1.0)
        w = np.maximum(u - u0, 0.0)
        powers = np.stack([w**1.5, w**2, w**2.5], axis=1)
        return np.hstack([powers, BSpline.design_matrix(u, knots, 3).toarray()])

    return basis


def _fit_smooth(x: FloatArray, y: FloatArray, onset: float, most: int) -> tuple[Callable[[FloatArray], FloatArray], int]:
    """The smooth of y over x by least squares, and its freedom."""
    basis = _smooth_basis(x, onset, most)
    shift, scale = float(np.mean(y)), max(float(np.std(y)), 1e-300)
    coefficients, _, rank, _ = np.linalg.lstsq(basis(x), (y - shift) / scale, rcond=1e-9)
    return (lambda at: np.asarray(basis(np.atleast_1d(at)) @ coefficients * scale + shift)), int(rank)


def _onset_of_bend(means: _Means, onset: float, variance: float) -> tuple[float, float]:
    """Where the curve leaves its flat part, and the standard deviation of that, from the readings next to it.

    A smooth whose onset is off by a bin bends where the curve does not, which makes the square of a point's error there up to
    50 % larger than is stated. Powers of the distance from the onset tell where it is, from as much of the press as they
    describe: further on a layer stiffens.

    `variance` is that of a mean of `means`.
    """
    length = max(float(np.ptp(means.x)), 1e-300)
    best = onset / length
    for share in _NEAR:
        near = means.x <= max(onset, means.x[0]) + share * length
        if share < 1.0 and np.count_nonzero(near) < _FEWEST:
            break
        u, v = means.x[near] / length, means.y[near] - np.mean(means.y[near])
        best = _onset_of_powers(u, v, onset / length)
        more = _explained(u, v, np.array([best]), (*_POWERS, 3.0, 3.5))
        if float(np.sum(more[:, -2:] ** 2)) <= _UNSEEN * variance:
            break
    onsets = best + _ASIDE * np.array([-1.0, 0.0, 1.0])
    around = np.sum(_explained(u, v, onsets, _POWERS) ** 2, axis=1)
    lost = around[1] - (around[0] + around[2]) / 2
    sd = min(_ASIDE * math.sqrt(variance / lost), _WIDEST) if lost > 0 else _WIDEST
    return best * length, sd * length


def _bend_of_bins(
    x: FloatArray, y: FloatArray, mean: Callable[[FloatArray], FloatArray], onset: float
) -> tuple[FloatArray, FloatArray]:
    """What the curve's bend adds to the means over bins, (n_bin,), and what taking it off does to their variances.

    The bend is that of a stiff smooth, as one that fits tens of readings follows their noise next to the onset. It takes some
    of the noise of each bin for bend all the same, and the more the wider a bin is: means less the bend have a variance that is
    larger by the second, (n_bin,), if that of a reading is 1.

    `mean` takes readings, (n_reading,) or (n_reading, m), to their means over the bins.
    """
    basis = _smooth_basis(x, onset, _STIFF)
    terms = basis(x)
    inverse = np.linalg.pinv(terms, rcond=1e-9)
    means = mean(terms)
    bends = means - basis(mean(x))
    covariance = inverse @ inverse.T
    variance = np.einsum("bi,ij,bj->b", bends - 2 * means, covariance, bends)
    return bends @ (inverse @ (y - np.mean(y))), variance


def _onset_of_powers(u: FloatArray, v: FloatArray, onset: float) -> float:
    """The onset next to a coarse one from which powers explain most of v over u, which begins where no onset is before."""
    for steps in (np.arange(-0.1, 0.15, 0.005), np.arange(-0.004, 0.0045, 0.0005)):
        onsets = np.clip(onset + steps, u[0], u[0] + 0.85)
        onset = float(onsets[np.argmax(np.sum(_explained(u, v, onsets, _POWERS) ** 2, axis=1))])
    return onset


def _explained(u: FloatArray, v: FloatArray, onsets: FloatArray, powers: tuple[float, ...]) -> FloatArray:
    """Components of v along a constant, a line and powers of the distance of u from onsets, (n_onset, n_term), orthonormal."""
    w = np.maximum(u - onsets[:, None], 0.0)
    line = np.broadcast_to(u - u[0], w.shape)
    basis = np.stack([np.ones_like(w), line, *(w**power for power in powers)], axis=2)
    return np.asarray(np.einsum("oij,i->oj", np.linalg.qr(basis).Q, v))


def _onset_of_fit(means: _Means, onset: float, most: int) -> float:
    """The onset next to a coarse one from which a smooth of so many pieces at most fits best.

    One that is off by a bin leaves a wiggle beside it, which in quiet readings passes for noise that hangs together.
    """
    length = max(float(np.ptp(means.x)), 1e-300)
    for steps in (np.arange(-0.1, 0.15, 0.02), np.arange(-0.015, 0.02, 0.005)):
        onsets = np.clip(onset + length * steps, means.x[0], means.x[0] + 0.85 * length)
        smooths = (_fit_smooth(means.x, means.y, float(at), most)[0] for at in onsets)
        onset = float(onsets[np.argmin([np.sum((means.y - smooth(means.x)) ** 2) for smooth in smooths])])
    return onset


def _edges(lo: float, hi: float, onset: float, n_points: int) -> FloatArray:
    """Bin edges: a quarter of the bins at most before the onset and never finer than after it."""
    share = float(np.clip((onset - lo) / (hi - lo), 0.0, 1.0)) if hi > lo else 0.0
    before = min(n_points // 4, round(n_points * share))
    if share > 0.02 and n_points >= 8:
        before = max(before, 2)
    if before == 0:
        return np.linspace(lo, hi, n_points + 1)
    return np.concatenate([np.linspace(lo, onset, before + 1)[:-1], np.linspace(onset, hi, n_points - before + 1)])


def _smooth_and_time(
    x: FloatArray, y: FloatArray, means: _Means, onset: float, floor: float
) -> tuple[Callable[[FloatArray], FloatArray], float, float]:
    """The smooth, the noise of a reading about it, and the autocorrelation time.

    Slow noise looks like shape: where the readings hang together, a stiffer smooth is preferred unless it fits significantly
    worse, by the Bayesian information criterion for n / tau independent readings.
    """
    chosen, widest = None, 0.0
    for most in _PIECES:
        smooth, powers = _fit_smooth(x, y, _onset_of_fit(means, onset, most), most)
        freedom = powers + 1
        residual = y - smooth(x)
        spread = max(1.4826 * float(np.median(np.abs(residual - np.median(residual)))), floor)
        tau = integrated_time(np.clip(residual, -4 * spread, 4 * spread), freedom)
        # An outlier must not drown what the stiffer smooth misses, nor must what it misses be taken for outliers.
        widest = widest or 10 * spread
        power = max(float(np.mean(np.clip(residual, -widest, widest) ** 2)), floor**2)
        if chosen is not None:
            independent = x.size / math.sqrt(tau * chosen[2])
            gain = independent * math.log(power / chosen[4]) - (chosen[3] - freedom) * math.log(max(independent, 2.0))
            if gain > 0:
                break
        chosen = smooth, spread, tau, freedom, power
        if tau < 2:
            break
    assert chosen is not None
    smooth, spread, tau, freedom, _ = chosen
    # Each free number of the smooth takes the variance of one independent reading, which is tau of those there are.
    noise = spread * math.sqrt(1 / (1 - min(0.5, freedom * tau / x.size)))
    return smooth, max(noise, floor), tau


def reduce_channel(x: FloatArray, y: FloatArray, n_points: int, onset: float, *, repeats: bool = True) -> Reduced:
    """Reduce a channel of thousands of readings to a few dozen points that say as much, with honest errors.

    The points are the means of y in bins of x; their sd is noise / sqrt(n_effective), n_effective = readings / tau. Tested for
    white, autoregressive, averaged, low-passed, repeated and coarsely resolved readings: stated sd at most 15 % too small while
    the branch holds fifty times tau, and up to 30 % too large at a coarse resolution.

    Parameters
    ----------
    x, y : abscissa and readings, shape (n_row,), in the order of reading.
    n_points : bins. Those that hold less than one independent reading hang together, which n_effective, 1 at least, leaves out.
    onset : on x, where the channel leaves its flat part.
    repeats : whether to look for readings that are written several times and to leave out all but the first row of each.
    """
    n_row = x.size
    if repeats:
        fresh = fresh_readings(y)
        x, y = x[fresh], y[fresh]
    n = x.size
    step = resolution(y)
    floor = max(step / math.sqrt(12.0), 1e-6 * float(np.ptp(y)), 1e-12 * float(np.max(np.abs(y))), 1e-300)
    if n <= max(n_points, 12):
        order = np.argsort(x, kind="stable")
        xs, ys = x[order], y[order]
        degree = min(3, n - 3)
        u = (xs - xs.mean()) / max(float(np.std(xs)), 1e-300)
        basis = np.vander(u, degree + 1)
        residual = ys - basis @ np.linalg.lstsq(basis, ys, rcond=None)[0]
        noise = max(float(np.sqrt(residual @ residual / (n - degree - 1))), floor)
        middles = (xs[1:] + xs[:-1]) / 2
        edges = np.concatenate([xs[:1], middles, xs[-1:]])
        estimate = NoiseEstimate(noise, 1.0, step, n_row / n, n_row, n, n, 0)
        return Reduced(xs, ys, np.ones(n), estimate, lambda at: np.interp(at, xs, ys), edges)
    means = _means_of(x, y)
    smooth, noise, tau = _smooth_and_time(x, y, means, onset, floor)
    fitted = smooth(x)
    outliers = int(np.sum(np.abs(y - fitted) > 6 * noise))
    edges = _edges(float(np.min(x)), float(np.max(x)), onset, n_points)
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    _, which, count = np.unique(which, return_inverse=True, return_counts=True)
    order, starts = np.argsort(which, kind="stable"), np.cumsum(count) - count

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray((np.add.reduceat(values[order], starts, axis=0).T / count).T)

    mean_x, mean_y = mean(x), mean(y)
    # A bent curve's mean is not its value at the mean abscissa: take the difference off. It is as unsure as the bend's onset.
    at, sd = _onset_of_bend(means, onset, noise**2 * tau * means.x.size / n)
    (bend, taken), (less, _), (more, _) = (_bend_of_bins(x, y, mean, at + aside) for aside in (0.0, -sd, sd))
    variance = tau * (1 / count + taken) + ((more - less) / (2 * noise)) ** 2
    n_effective = np.maximum(1 / variance, 1.0)
    if step > 0:
        # Readings that stay on one or two levels do not average the resolution away.
        levels = np.array([np.unique(y[which == b]).size for b in range(count.size)])
        n_effective = np.where(levels < 3, 1.0, n_effective)
    estimate = NoiseEstimate(noise, tau, step, n_row / n, n_row, n, mean_x.size, outliers)
    return Reduced(mean_x, mean_y - bend, n_effective, estimate, smooth, edges)
