"""A curve of conformance over thickness and how pads are made and inspected in, acceptance limits and both risks out.

The words are those of JCGM 106:2012. The property is the padding's thickness, its tolerance interval [T_L, T_U] (3.3.5) the
thicknesses that conform with the probability that was asked for. Pads are inspected by a gauge of standard uncertainty u. What
is accepted must read within the acceptance interval [A_L, A_U] (3.3.9), which guard bands w on both sides make narrower
(guarded acceptance, clause 8.3.2):

    A_L = T_L + w,   A_U = T_U - w,   w = r U,   U = 2 u.                                                               (1)

r = 1 is the usual choice: where a reading stands at A_U, the pad is thicker than T_U with 2.3 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from models.sensor import BoolArray, FloatArray

# Steps of a caliper and of a thickness gauge [m].
_CALIPER, _GAUGE = 0.01e-3, 0.001e-3
# Lengths [m] that differ by less are the same but for rounding errors.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Drawing:
    """What stands on the drawing of a pad, [m], and what becomes of pads that are made to it.

    Attributes
    ----------
    nominal : thickness that is made.
    tolerance : thicknesses that conform with the probability asked for, T_L and T_U.
    accepted : readings that are accepted, A_L and A_U; None where the guard bands leave nothing.
    guard_band : w.
    open_below, open_above : whether the tolerance ends only because no thinner, or thicker, padding was asked for or covered.
    accepted_share : [1], pads that are accepted; nan where it is not known how pads scatter.
    consumers_risk : [1], global: that a pad is accepted and its sensor does not conform.
    producers_risk : [1], global: that a pad is rejected and its sensor would conform.
    delivered : [1], share of the accepted pads whose sensor does not conform.
    """

    nominal: float
    tolerance: tuple[float, float]
    accepted: tuple[float, float] | None
    guard_band: float
    open_below: bool
    open_above: bool
    accepted_share: float
    consumers_risk: float
    producers_risk: float
    delivered: float

    @property
    def limits(self) -> tuple[float, float, float] | None:
        """Nominal thickness, least and largest reading that are accepted [m], as a drawing has them.

        Limits are rounded inwards, see `step_of`, so that nothing is accepted that `accepted` does not have; None where that
        leaves nothing.
        """
        if self.accepted is None:
            return None
        ends = read_within(self.accepted)
        if ends is None:
            return None
        step = step_of(self.accepted)
        return min(max(round(self.nominal / step) * step, ends[0]), ends[1]), *ends

    @property
    def accepts_nominal(self) -> bool:
        """Whether a pad that has just the nominal thickness is accepted."""
        ends = None if self.accepted is None else read_within(self.accepted)
        return ends is not None and ends[0] - _ROUNDING <= self.nominal <= ends[1] + _ROUNDING


def step_of(ends: tuple[float, float]) -> float:
    """The step [m] of what reads lengths in an interval: of a caliper, if it has ten of them there, else of a thickness gauge.

    Parameters
    ----------
    ends : of the interval [m].
    """
    return _CALIPER if ends[1] - ends[0] >= 10 * _CALIPER else _GAUGE


def inwards(ends: tuple[float, float], step: float) -> tuple[float, float]:
    """Round the ends of an interval to steps, inwards, so that it becomes no wider.

    Parameters
    ----------
    ends : of the interval [m].
    step : [m].

    Examples
    --------
    >>> first, last = inwards((4.1301e-3, 7.4899e-3), 0.01e-3)
    >>> f"{first * 1e3:.2f} to {last * 1e3:.2f} mm"
    '4.14 to 7.48 mm'
    """
    # A limit that is a step but for rounding errors stays.
    return math.ceil(ends[0] / step - 1e-6) * step, math.floor(ends[1] / step + 1e-6) * step


def read_within(accepted: tuple[float, float]) -> tuple[float, float] | None:
    """Least and largest reading [m] that are accepted, rounded inwards to steps that are read; None where that leaves nothing.

    Parameters
    ----------
    accepted : [m], A_L and A_U.
    """
    low, high = inwards(accepted, step_of(accepted))
    return (low, high) if low < high else None


@dataclass(frozen=True)
class Risks:
    """Shares of all pads that are made [1], see `risks`."""

    accepted: float
    consumers: float
    producers: float


def guarded(tolerance: tuple[float, float], gauge: float, factor: float) -> tuple[tuple[float, float] | None, float]:
    """Narrow a tolerance interval by guard bands, equation (1).

    Parameters
    ----------
    tolerance : [m], T_L and T_U; infinite on a side without a limit.
    gauge : [m], standard uncertainty u of a reading.
    factor : r.

    Returns
    -------
    The acceptance interval, None where it is empty, and the guard band w [m].

    Examples
    --------
    >>> guarded((4.0, 6.0), 0.1, 1.0)
    ((4.2, 5.8), 0.2)
    """
    w = factor * 2 * gauge  # (1)
    low, high = tolerance[0] + w, tolerance[1] - w
    return ((low, high) if low < high else None), w


def open_at_nothing(ends: tuple[float, float]) -> tuple[float, float]:
    """The same range [m], without a lower end where that is no padding at all: no pad and no reading is too thin then.

    Parameters
    ----------
    ends : [m], the first not negative.
    """
    return (ends[0] if ends[0] > 0 else -math.inf), ends[1]


def inspected(tolerance: tuple[float, float], gauge: float, factor: float) -> tuple[tuple[float, float] | None, float]:
    """What is accepted of pads, `guarded`: a tolerance that begins at no padding needs no guard there, as none is thinner.

    Parameters
    ----------
    tolerance : [m], T_L and T_U, not negative.
    gauge, factor : as in `guarded`.

    Returns
    -------
    A_L and A_U [m], neither negative; None where nothing is left. And the guard band w [m].

    Examples
    --------
    >>> inspected((0.0, 2.0), 0.1, 1.0), inspected((0.0, 0.1), 0.1, 1.0)
    (((0.0, 1.8), 0.2), (None, 0.2))
    """
    accepted, w = guarded(open_at_nothing(tolerance), gauge, factor)
    if accepted is None or accepted[1] <= 0:
        return None, w
    return (max(accepted[0], 0.0), accepted[1]), w


def within_its_drawing(
    grid: FloatArray, exact: FloatArray, wanted: float, among: BoolArray, gauge: float, factor: float
) -> int | None:
    """Of nominal thicknesses the one nearest to the middle of what its own drawing accepts, of several drawings of the widest.

    Parameters
    ----------
    grid : [m], (n,).
    exact : [1], (n,), probability that a pad of exactly this thickness conforms; nan where it is not known.
    wanted : [1], that is asked for.
    among : (n,), thicknesses to choose from.
    gauge, factor : as in `guarded`.

    Returns
    -------
    Index of it; None where no drawing accepts the thickness that it is of.
    """
    found: tuple[float, int] | None = None
    end = -math.inf
    for k in np.flatnonzero(among):
        if grid[k] <= end:  # on the drawing of one before it
            continue
        tolerance = crossings(grid, exact, wanted, int(k))
        if tolerance is None:
            continue
        end = tolerance[1]
        accepted = inspected(tolerance, gauge, factor)[0]
        ends = None if accepted is None else read_within(accepted)
        if ends is None:
            continue
        inside = np.flatnonzero(among & (grid >= ends[0] - _ROUNDING) & (grid <= ends[1] + _ROUNDING))
        if inside.size and (found is None or ends[1] - ends[0] > found[0]):
            found = ends[1] - ends[0], int(inside[np.argmin(np.abs(grid[inside] - (ends[0] + ends[1]) / 2))])
    return None if found is None else found[1]


def acceptance(thickness: FloatArray, accepted: tuple[float, float], gauge: float) -> FloatArray:
    """Probability that a pad is accepted: that a normal reading of it lies within the acceptance interval.

    Parameters
    ----------
    thickness : [m], true ones, any shape.
    accepted : [m], A_L and A_U.
    gauge : [m], standard uncertainty of a reading; 0 for one that is exact.
    """
    low, high = accepted
    if gauge == 0:
        return np.asarray((thickness >= low) & (thickness <= high), dtype=float)
    return np.asarray(ndtr((high - thickness) / gauge) - ndtr((low - thickness) / gauge))


def nominals(
    accepted: tuple[float, float], made_to: Callable[[float], FloatArray], gauge: float, share: float
) -> tuple[float, float] | None:
    """Nominal thicknesses whose pads a drawing accepts: of those made to each at least a share is.

    Parameters
    ----------
    accepted : [m], A_L and A_U; where the first is none no pad is too thin.
    made_to : nominal thickness [m] to equally probable thicknesses of pads that are made to it [m], (n,).
    gauge : [m], standard uncertainty of a reading.
    share : [1], that is to be accepted.

    Returns
    -------
    First and last [m], both steps of what reads them; None for fewer than two.

    Examples
    --------
    >>> first, last = nominals((4e-3, 5e-3), lambda h: h + np.array([-0.1e-3, 0.0, 0.1e-3]), 0.0, 0.9)
    >>> f"{first * 1e3:.2f} to {last * 1e3:.2f} mm"
    '4.10 to 4.90 mm'
    """
    step = step_of(accepted)
    low, high = (round(end / step) for end in inwards(accepted, step))
    ends = open_at_nothing(accepted)
    widened = (ends[0] - _ROUNDING, ends[1] + _ROUNDING)  # a pad that is a limit but for rounding errors is within it
    made = [n * step for n in range(low, high + 1)]
    good = [h for h in made if np.mean(acceptance(made_to(h), widened, gauge)) >= share]
    return (good[0], good[-1]) if len(good) > 1 else None


def risks(made: FloatArray, conformance: FloatArray, accepted: tuple[float, float] | None, gauge: float) -> Risks:
    """Global consumer's and producer's risk of pads that are made, inspected, and accepted or rejected.

    With g0 how pads are made, alpha the probability that one is accepted, and p_c that of conforming,

        R_C = int g0(h) alpha(h) (1 - p_c(h)) dh,        R_P = int g0(h) (1 - alpha(h)) p_c(h) dh,                     (2)

    which are the integrals of JCGM 106:2012, clause 9.5, where p_c is 1 inside the tolerance interval and 0 outside; here the
    rest of the sensor decides, too, whether it conforms.

    Parameters
    ----------
    made : [m], (n,), thicknesses that are equally probable under g0.
    conformance : p_c [1] of these.
    accepted : [m], A_L and A_U; None if no pad is.
    gauge : [m], standard uncertainty of a reading.
    """
    alpha = np.zeros(made.size) if accepted is None else acceptance(made, accepted, gauge)
    return risks_of(alpha, conformance)


def risks_of(accepted: FloatArray, conformance: FloatArray) -> Risks:
    """Global risks (2) of items of which each is accepted with a probability, or is or is not.

    Parameters
    ----------
    accepted : alpha [1], (n,).
    conformance : p_c [1], (n,).

    Examples
    --------
    Of two accepted items one conforms with 98 %; of the rejected one conforms with 10 %:

    >>> found = risks_of(np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.98, 0.10]))
    >>> round(found.consumers, 4), round(found.producers, 4)
    (0.0067, 0.0333)
    """
    return Risks(
        float(np.mean(accepted)),
        float(np.mean(accepted * (1 - conformance))),  # (2)
        float(np.mean((1 - accepted) * conformance)),
    )


def crossings(grid: FloatArray, probability: FloatArray, wanted: float, at: int) -> tuple[float, float] | None:
    """The unbroken run about a thickness in which a probability is at least what is wanted, its ends by interpolation.

    Parameters
    ----------
    grid : [m], (n,).
    probability : [1], (n,), nan where it is not known.
    wanted : [1].
    at : index of the thickness.

    Returns
    -------
    First and last [m]; None if the probability there is less.
    """
    good = np.nan_to_num(probability, nan=-1.0) >= wanted
    if not good[at]:
        return None
    low = high = at
    while low > 0 and good[low - 1]:
        low -= 1
    while high < grid.size - 1 and good[high + 1]:
        high += 1
    ends = []
    for inner, outer in ((low, low - 1), (high, high + 1)):
        end = float(grid[inner])
        if 0 <= outer < grid.size and math.isfinite(probability[outer]):
            share = (probability[inner] - wanted) / (probability[inner] - probability[outer])
            end += float(share * (grid[outer] - grid[inner]))
        ends.append(end)
    return ends[0], ends[1]
