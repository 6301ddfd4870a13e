"""A problem in, what its priors expect each sweep to show at a glance out, and how far off the data are: force, capacitance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from calib.problem import Glance, Problem, glances, prior_coordinates
from models.sensor import FloatArray

#: Draws of the prior, and their seed.
N_DRAW, _SEED = 1000, 20190304
#: Distances, in standard deviations of what is expected, beyond which a quantity is out of the way, and beyond which it cannot
#: be: one of a thousand sound sweeps lies beyond the first, and no prior that somebody believes in is six sd off.
UNLIKELY, IMPOSSIBLE = 3.3, 6.0
#: Within this distance lie 99 of 100 sound sweeps: where another reading of the data has to bring them.
USUAL = 2.6
# Quantiles at two standard deviations: what lies further out is told from there, as a thousand draws have no quantile of 1e-9.
_LOW, _MIDDLE, _HIGH = 0.02275, 0.5, 0.97725
# Of fewer draws than this that the forward model covers nothing is said.
_FEW = 50


@dataclass(frozen=True)
class Range:
    """What the priors expect of one quantity of one sweep, beside what was read.

    Attributes
    ----------
    sweep : its title.
    seen : which quantity, see `calib.problem.Glance`.
    observed : SI.
    middle : what is expected, the median, SI.
    low, high : between which 99 % of what is expected lies, SI; high is inf where the forward model ends before the press does.
    away : distance of what was read from the middle of what is expected, in its standard deviations.
    covered : share of the prior's draws that the forward model covers to the end of the press.
    """

    sweep: str
    seen: str
    observed: float
    middle: float
    low: float
    high: float
    away: float
    covered: float

    @property
    def counts(self) -> bool:
        """Whether it is judged: the depth is the force seen from the other side, and is shown beside it."""
        return self.seen != "depth"


def ranges_of(problem: Problem) -> tuple[Range, ...]:
    """Hold what stands out of every sweep against the priors: would a force, a depth, a capacitance as read be expected?"""
    rng = np.random.default_rng(_SEED)
    theta = prior_coordinates(problem, rng, N_DRAW)
    found = (_range(glance) for glance in glances(problem, theta, rng))
    return tuple(r for r in found if r is not None)


def farthest(ranges: Iterable[Range]) -> float:
    """The largest distance of all that is judged."""
    return max((abs(r.away) for r in ranges if r.counts), default=0.0)


def _range(glance: Glance) -> Range | None:
    there = np.isfinite(glance.expected)
    if np.sum(there) < _FEW or not np.isfinite(glance.observed):
        return None
    least = glance.expected[there]
    most = np.where(glance.at_least[there], np.inf, least)
    low, high = float(np.quantile(least, 0.005)), float(np.quantile(most, 0.995, method="higher"))
    away = _away(glance.observed, least, most)
    middle = float(np.median(least))
    return Range(
        glance.sweep.title, glance.seen, glance.observed, middle, low, high, away, float(np.mean(there & ~glance.at_least))
    )


def _away(observed: float, least: FloatArray, most: FloatArray) -> float:
    """Distance from the median over half the way to the quantile at two sd on that side, of logarithms where all are positive.

    Above the median a draw of which only the least is known counts as one that may be anything more.
    """
    low, middle = (float(np.quantile(least, q)) for q in (_LOW, _MIDDLE))
    high = float(np.quantile(most, _HIGH, method="higher"))
    if min(low, observed) > 0:
        low, middle, high, observed = (float(np.log(v)) if np.isfinite(v) else v for v in (low, middle, high, observed))
    side = (high - middle if observed > middle else middle - low) / 2
    return (
        (observed - middle) / side if side > 0 else 0.0 if observed == middle else float(np.copysign(np.inf, observed - middle))
    )
