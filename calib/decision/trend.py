"""Values of a quantity of one specimen after the other in, whether it drifts, and by how much, out.

Specimens differ, and one may be far off, so that a trend is told by ranks: whether values go up with their order more often
than chance lets them is Kendall's tau (Biometrika 30 (1938) 81), how steeply the median of the slopes of all pairs (Theil and
Sen), with the interval of J. Am. Stat. Assoc. 63 (1968) 1379; of logarithms, as a share falls by no more than all of it. What
all specimens share, such as what is not known of the lot's permittivity, moves all values alike, and no trend.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.sensor import FloatArray

#: Trends are named that chance makes as often as this, where there is none.
BY_CHANCE = 0.01
#: Fewer specimens than this show no trend, whatever they do.
FEWEST = 6
# Two-sided probability of the interval of the slope.
_LEVEL = 0.90


@dataclass(frozen=True)
class Trend:
    """How a quantity went from the first specimen to the last.

    Attributes
    ----------
    quantity : its name.
    n : how many specimens it is of.
    change : share by which it goes up from the first to the last [1]; nan where there are too few.
    interval : central 90 % of that.
    chance : probability that values without a trend are ordered as much by chance [1].
    ordered_by : "time" by when the files say that they began, else "name".
    """

    quantity: str
    n: int
    change: float
    interval: tuple[float, float]
    chance: float
    ordered_by: str

    @property
    def drifts(self) -> bool:
        """Whether it is more than chance."""
        return self.chance < BY_CHANCE

    def in_words(self, label: str) -> str:
        """Say in a sentence what was found.

        Parameters
        ----------
        label : of the quantity.
        """
        if math.isnan(self.change):
            return f"{label}: {self.n} specimen{'s are' if self.n != 1 else ' is'} too few to tell a trend (at least {FEWEST})"
        way = "up" if self.change > 0 else "down"
        ends = f"{100 * self.interval[0]:+.1f} % to {100 * self.interval[1]:+.1f} %"
        size = f"{100 * abs(self.change):.1f} %"
        said = f"from the first of {self.n} specimens to the last {label} goes {way} by {size} (90 %: {ends})"
        if self.drifts:
            return f"{said}: more than chance, which orders values so in {_rarely(self.chance)}"
        return f"{said}: no more than chance, which orders values so in {_rarely(self.chance)}"


def _rarely(chance: float) -> str:
    return f"{100 * chance:.0f} % of lots without a trend" if chance >= 0.01 else "less than 1 % of lots without one"


def trend_of(quantity: str, place: FloatArray, value: FloatArray, ordered_by: str) -> Trend:
    """Look for a trend.

    Parameters
    ----------
    quantity : name of what it is of.
    place : (n,), of each specimen: its time [s], or its number.
    value : (n,), SI; those that are not positive have no share and are not counted.
    ordered_by : what the places are.

    Examples
    --------
    >>> found = trend_of("young_modulus", np.arange(12.0), 6e5 * (1 + 0.01 * np.arange(12.0)), "name")
    >>> found.drifts, round(found.change, 3)
    (True, 0.11)
    """
    from scipy.stats import kendalltau, theilslopes  # takes long to load

    place, value = place[value > 0], value[value > 0]
    n = int(value.size)
    if n < FEWEST or np.ptp(place) == 0 or np.ptp(value) == 0:
        return Trend(quantity, n, math.nan, (math.nan, math.nan), 1.0, ordered_by)
    found = theilslopes(np.log(value), place, alpha=_LEVEL)
    slopes = (float(found.slope), float(found.low_slope), float(found.high_slope))
    change, low, high = (math.expm1(slope * float(np.ptp(place))) for slope in slopes)
    chance = float(kendalltau(place, value).pvalue)
    return Trend(quantity, n, change, (low, high), chance, ordered_by)
