"""From the readings around the turning point of the press to the offset of the clocks, with its error."""

from __future__ import annotations

import math

import numpy as np

from calib.lab.clocks.records import CrossheadRecord, MeterRecord
from calib.lab.clocks.survey import OffsetRange
from calib.lab.clocks.way_back import CREEP, DEGREE, RETURN, WINDOW
from calib.lab.linear import fitted, log_evidence
from calib.lab.signal import integrated_time
from models.sensor import FloatArray

# Sd of the loading function's Taylor coefficients around the turning point, in capacitance changes over depths.
_CURVE = 2.0
# Where between two readings of the tester or of the meter something happens is known to this share of the interval (sd).
_BETWEEN = 0.02


def offset_from_turning_point(meter: MeterRecord, tester: CrossheadRecord, near: OffsetRange) -> tuple[float, float] | None:
    """The offset at which the log turns round when the crosshead does, the sharpest feature that both records share.

    The log is a smooth function of the crosshead's reading on either side of the turning point, with creep after it stops; all
    coefficients are integrated over (normal priors), so that hysteresis and creep widen the sd but do not shift the value.

    Parameters
    ----------
    meter, tester : the two records.
    near : the offsets that the survey found.

    Returns
    -------
    Offset and sd [s]; None if the readings do not determine it, as in a log with fewer than four of them on either side.
    """
    begin, stop = _window(meter, tester)
    best, half = near.value, max(2 * meter.interval, 0.5 * near.width, 0.01 * tester.duration)
    noise = meter.noise
    for _ in range(16):
        # The same readings for every offset, so that the evidence is one smooth function of it.
        inside = (meter.time + best >= begin) & (meter.time + best <= stop)
        t, c = meter.time[inside], meter.capacitance[inside]
        if int(np.sum(t + best < tester.top)) < 4 or int(np.sum(t + best > tester.leave)) < 4:
            return None
        y = (c - c[np.argmax(c)]) / meter.change
        fine = best + half * np.linspace(-1, 1, 25)
        density = _density(fine, t, y, meter, tester, noise / meter.change)
        mean = float(np.sum(density * fine) / np.sum(density))
        sd = float(np.sqrt(np.sum(density * (fine - mean) ** 2) / np.sum(density)))
        k = int(np.argmax(density))
        if k < 3 or k > fine.size - 4:
            best = float(fine[k])
            half *= 1.5
            continue
        if sd < half / 8:
            best, half = mean, max(5 * sd, half / 6)
            continue
        if sd > 0.4 * half:
            best, half = mean, 2 * half
            continue
        # The residuals say whether the readings' errors are larger than their noise, or hang together.
        basis, kind = _basis(t + mean, tester)
        residual = y - fitted(y, basis, _prior(*RETURN[-1])[kind], noise / meter.change)
        actual = float(np.sqrt(np.mean(residual**2) * integrated_time(residual, 8))) * meter.change
        if actual > 1.15 * noise:
            noise, best = actual, mean
            continue
        sd = float(np.linalg.norm([sd, _BETWEEN * meter.interval, _BETWEEN * tester.interval]))
        return (mean, sd) if sd < 0.2 * tester.duration else None
    return None


def _window(meter: MeterRecord, tester: CrossheadRecord) -> tuple[float, float]:
    """Between which times [s] of the tester the readings around the turning point lie."""
    low = tester.peak - WINDOW * tester.depth
    time, x = tester.time, tester.displacement
    below = np.flatnonzero((x < low) & (time < tester.top))
    after = np.flatnonzero((x < low) & (time > tester.leave))
    least = 12 * meter.interval
    begin = max(min(float(time[below[-1] if below.size else 0]), tester.top - least), float(time[0]), tester.begin)
    stop = min(max(float(time[after[0]]) if after.size else tester.end, tester.leave + least), tester.end)
    return begin, stop


def _density(
    offsets: FloatArray, t: FloatArray, y: FloatArray, meter: MeterRecord, tester: CrossheadRecord, noise: float
) -> FloatArray:
    """Posterior density, but for a factor, at each offset: over meters that average and that do not, and over `RETURN`."""
    scores = np.empty((2 * len(RETURN), offsets.size))
    for i, g in enumerate(offsets):
        for j, width in enumerate((0.0, meter.interval)):
            shifts = width / math.sqrt(12.0) * np.array([-1.0, 1.0]) if width else np.zeros(1)
            parts = [_basis(t + g + s, tester) for s in shifts]
            basis, kind = np.mean([p[0] for p in parts], axis=0), parts[0][1]
            for k, (hysteresis, jump) in enumerate(RETURN):
                scores[len(RETURN) * j + k, i] = log_evidence(y, basis, _prior(hysteresis, jump)[kind], noise)
    return np.asarray(np.sum(np.exp(scores - np.max(scores)), axis=0))


def _prior(hysteresis: float, jump: float) -> FloatArray:
    """Sd of the coefficients of each kind of column of `_basis`."""
    return np.array([1.0, _CURVE, hysteresis, CREEP, jump])


def _basis(t: FloatArray, tester: CrossheadRecord) -> tuple[FloatArray, FloatArray]:
    """Columns of the capacitance around the turning point; of each: level 0, curve 1, hysteresis 2, creep 3, step 4.

    C = C_top + sum a_k u^k + sum h_k u^k (on the way back) + sum c_j (1 - exp(-(t - top) / tau_j)) + a step
    where the crosshead leaves (friction turns round), u = (peak - x) / depth.
    """
    x = np.interp(t, tester.time, tester.displacement)
    u = np.clip((tester.peak - np.maximum(x, tester.contact)) / tester.depth, 0.0, 1.0)
    powers = u[:, None] ** np.arange(1, DEGREE + 1)
    back = np.where(t > (tester.top + tester.leave) / 2, 1.0, 0.0)[:, None]
    since = np.maximum(t - tester.top, 0.0)[:, None]
    left = np.where(t > tester.leave, 1.0, 0.0)[:, None]
    basis = np.hstack([np.ones((t.size, 1)), powers, back * powers, 1 - np.exp(-since / tester.creep_times), left])
    kind = np.array([0] + [1] * DEGREE + [2] * DEGREE + [3] * tester.creep_times.size + [4])
    return basis, kind
