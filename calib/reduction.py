"""From a channel of a sweep to tens of bin means, with the noise of one reading and how many readings are independent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from calib.readings import resolution
from models.sensor import FloatArray


@dataclass(frozen=True, eq=False)
class Reduced:
    """A channel over an abscissa in bins: means, readings per bin, effective number, noise of one reading, and the smooth."""

    abscissa: FloatArray
    value: FloatArray
    n_effective: FloatArray
    noise: float
    correlation: float
    outliers: int
    smooth: Callable[[FloatArray], FloatArray]
    edges: FloatArray


def find_onset(x: FloatArray, y: FloatArray) -> float:
    """Where y leaves its flat beginning, for placing bins only: least squares of c + sum a_k (x - x_on)_+^p_k over x_on."""
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


def _fit_smooth(x: FloatArray, y: FloatArray, onset: float) -> tuple[Callable[[FloatArray], FloatArray], int]:
    """A smooth of y over x: powers of the distance from the onset, and a cubic spline for what they leave. With its freedom."""
    lo, length = float(np.min(x)), max(float(np.ptp(x)), 1e-300)
    u0 = float(np.clip((onset - lo) / length, 0.0, 0.95))
    pieces = int(np.clip(np.sum(x > lo + u0 * length) // 15, 1, 12))
    inner = np.linspace(u0, 1.0, pieces + 1)[1 if u0 < 0.02 else 0 : -1]
    knots = np.concatenate([np.zeros(4), inner, np.ones(4)])
    shift, scale = float(np.mean(y)), max(float(np.std(y)), 1e-300)

    def basis(at: FloatArray) -> FloatArray:
        u = np.clip((at - lo) / length, 0.0, 1.0)
        w = np.maximum(u - u0, 0.0)
        powers = np.stack([w**1.5, w**2, w**2.5], axis=1)
        return np.hstack([powers, BSpline.design_matrix(u, knots, 3).toarray()])

    coefficients, _, rank, _ = np.linalg.lstsq(basis(x), (y - shift) / scale, rcond=1e-9)
    return (lambda at: np.asarray(basis(np.atleast_1d(at)) @ coefficients * scale + shift)), int(rank)


def integrated_time(residual: FloatArray, freedom: int = 0) -> float:
    """Integrated autocorrelation time tau = 1 + 2 sum rho_k in readings, at least 1; the sum ends at 5 tau (Sokal's window).

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
    return max(1.0, float(tau[last]) / (1 - min(0.5, (2 * (last + 1) + 1) * freedom / n)))


def _edges(lo: float, hi: float, onset: float, n_points: int) -> FloatArray:
    """Bin edges: a quarter of the bins at most before the onset and never finer than after it."""
    share = float(np.clip((onset - lo) / (hi - lo), 0.0, 1.0)) if hi > lo else 0.0
    before = min(n_points // 4, round(n_points * share))
    if share > 0.02 and n_points >= 8:
        before = max(before, 2)
    if before == 0:
        return np.linspace(lo, hi, n_points + 1)
    return np.concatenate([np.linspace(lo, onset, before + 1)[:-1], np.linspace(onset, hi, n_points - before + 1)])


def reduce_channel(x: FloatArray, y: FloatArray, n_points: int, onset: float) -> Reduced:
    """Bin means of y over x, rows in the order of reading."""
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
        return Reduced(xs, ys, np.ones(n), noise, 1.0, 0, lambda at: np.interp(at, xs, ys), edges)
    smooth, freedom = _fit_smooth(x, y, onset)
    fitted = smooth(x)
    residual = y - fitted
    noise = 1.4826 * float(np.median(np.abs(residual - np.median(residual)))) * np.sqrt(n / max(n - freedom, 1))
    noise = max(noise, floor)
    tau = integrated_time(np.clip(residual, -4 * noise, 4 * noise), freedom)
    outliers = int(np.sum(np.abs(residual) > 6 * noise))
    edges = _edges(float(np.min(x)), float(np.max(x)), onset, n_points)
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    count = np.bincount(which, minlength=edges.size - 1)
    full = count > 0
    mean_x = np.bincount(which, x, edges.size - 1)[full] / count[full]
    mean_y = np.bincount(which, y, edges.size - 1)[full] / count[full]
    # A bent curve's mean is not its value at the mean abscissa: take the difference, known from the smooth, off.
    bend = np.bincount(which, fitted, edges.size - 1)[full] / count[full] - smooth(mean_x)
    n_effective = np.maximum(count[full] / tau, 1.0)
    if step > 0:
        # Readings that stay on one or two levels do not average the resolution away.
        levels = np.array([np.unique(y[which == b]).size for b in np.flatnonzero(full)])
        n_effective = np.where(levels < 3, 1.0, n_effective)
    return Reduced(mean_x, mean_y - bend, n_effective, noise, tau, outliers, smooth, edges)
