"""What is believed of a capacitance once the crosshead turns round, and draws of it for simulated labs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.lab.stretches import stretches
from models.sensor import FloatArray

#: Share of the capacitance change by which it may creep after the crosshead stops (sd, of each rate).
CREEP = 0.007
# Times [s] of that creep.
_CREEP_TIMES = (0.3, 1.0, 3.0, 10.0, 30.0)
#: Powers of the distance from the turning point, in depths, of which loading and what unloading differs by are sums there.
DEGREE = 5
#: Sd of their coefficients for the difference between unloading and loading, and the share of the change by which capacitance
#: may step where the crosshead leaves: hardly any hysteresis, as much as there may be, and that with friction that turns round.
RETURN = ((0.03, 1e-6), (0.5, 1e-6), (0.5, 0.01))
#: Share of the depth on either side of the turning point in which the capacitance is taken as such a function.
WINDOW = 0.5
# Share of the way from contact to the turning point within which the crosshead stands there.
_AT_TOP = 1e-3
# Hysteresis of a draw at most, as a share of the capacitance change: it is the shape of a sensor that tells its capacitance.
_MOST = 0.05


@dataclass(frozen=True, eq=False)
class WayBack:
    """What capacitance differs by from that of loading at the same place, in capacitance changes, once the crosshead stops.

    Attributes
    ----------
    hysteresis : (`DEGREE`,), coefficients of the powers of the distance from the turning point, in depths.
    step : where the crosshead leaves.
    creep, creep_times : (n,), of each rate, and its time [s].
    """

    hysteresis: FloatArray
    step: float
    creep: FloatArray
    creep_times: FloatArray

    def of_hysteresis(self, distance: FloatArray) -> FloatArray:
        """Hysteresis at distances from the turning point, in depths, any shape; beyond `WINDOW` it goes back to none at 1."""
        powers = np.minimum(distance, WINDOW)[..., None] ** np.arange(1, DEGREE + 1)
        return np.asarray(_fading(distance) * (powers @ self.hysteresis), dtype=float)

    def at(self, distance: FloatArray, since_top: FloatArray, since_leaving: FloatArray) -> FloatArray:
        """All of it together, (n,).

        Parameters
        ----------
        distance : (n,), of the crosshead from where it turns, in depths.
        since_top, since_leaving : (n,) [s], since the crosshead stopped, and since it left; negative before.
        """
        crept = (1 - np.exp(-np.maximum(since_top, 0.0)[:, None] / self.creep_times)) @ self.creep
        gone = np.where(since_leaving > 0, self.of_hysteresis(distance) + _fading(distance) * self.step, 0.0)
        return np.asarray(_fading(distance) * crept + gone, dtype=float)


def draw_once_turned(
    time: FloatArray, times: FloatArray, reading: FloatArray, contact: float, rng: np.random.Generator
) -> FloatArray:
    """Draw what readings of a meter differ by from those of loading at the same place, in capacitance changes, (n,).

    Parameters
    ----------
    time : [s], (n,), of the readings, by the clock of the tester.
    times, reading : [s], [m], (n_row,), the tester's record of the crosshead; of several cycles the first counts.
    contact : [m], its reading where contact begins.
    rng : of the draw.
    """
    top = float(np.max(reading))
    begin, end = stretches(reading > top - _AT_TOP * (top - contact))[0]
    stops, leaves = times[begin], times[end - 1]
    below = np.flatnonzero((reading <= contact) & (times > leaves))
    gone = times[below[0]] if below.size else times[-1]
    drawn = draw_way_back(float(times[-1] - stops), rng)
    distance = np.clip((top - np.interp(time, times, reading)) / (top - contact), 0.0, 1.0)
    return np.where(time < gone, drawn.at(distance, time - stops, time - leaves), 0.0)


def draw_way_back(after: float, rng: np.random.Generator) -> WayBack:
    """Draw one that the estimate of a clock offset takes for possible, with no more hysteresis than a sensor may have.

    Parameters
    ----------
    after : [s], how long the crosshead is recorded after it stops.
    rng : of the draw.
    """
    times = creep_times(after)
    distance = np.linspace(0.0, WINDOW, 51)
    while True:
        hysteresis, step = RETURN[rng.integers(len(RETURN))]
        drawn = WayBack(
            hysteresis * rng.standard_normal(DEGREE),
            step * float(rng.standard_normal()),
            CREEP * rng.standard_normal(times.size),
            times,
        )
        if np.max(np.abs(drawn.of_hysteresis(distance))) < _MOST:
            return drawn


def creep_times(after: float) -> FloatArray:
    """Times [s] in which a capacitance may creep and which a record can hold.

    Parameters
    ----------
    after : [s], how long that goes on after the crosshead stops.
    """
    return np.array([t for t in _CREEP_TIMES if t < after] or [0.35 * after])


def _fading(distance: FloatArray) -> FloatArray:
    # Square, as capacitance leaves its rest at contact faster than in a line, which a kink there would look like.
    return np.asarray(np.clip((1 - distance) / (1 - WINDOW), 0.0, 1.0) ** 2, dtype=float)
