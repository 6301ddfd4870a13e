"""From a channel of a file of several presses to whether one of them is a multiple of another, as in another unit or range."""

from __future__ import annotations

import math

import numpy as np

from calib.lab.observations import Observations
from calib.lab.quality.grade import Grade
from calib.lab.quality.loading import LoadingBranch, channel_values
from models.sensor import FloatArray

#: A press is told that is less than the one, or more than the other, of the press beside it: what is filled softens by less.
SOFTER, STIFFER = 0.6, 1.5
#: Of presses that are used together, as one curve, the share by which one may be another: each lies half of it off that curve,
#: as much as a modulus is stated to a press of usual noise; and so many standard deviations of that share.
TOGETHER, SURELY = 0.06, 4.0
#: Readings of a press, places at which two are compared, and the share of the range that must change between these.
FEWEST, PLACES, CHANGES = 12, 40, 0.2
# The least factor whose logarithm is taken: one of a channel that falls where the other rises is none.
_LEAST = 1e-6


def check_presses(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Do all presses of the file show the channel rise alike over the displacement?

    A press is compared with the first that is used, over the places that both have: what is not a level of its own is a factor,
    by least squares. Fillers that soften, and a specimen that was not yet conditioned, make it less by a third at most. Presses
    that are used together are averaged, and have to be alike but for their noise.

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    "bad" if both presses are used, else a warning; None if there is one press, or all are alike, or too little tells.
    """
    if obs.displacement is None or obs.use.branch == "unloading" or obs.n_cycle < 2 or not obs.used_cycles:
        return None
    if obs.table.zeroed.get("displacement"):
        return None  # the same displacement is another place
    values = channel_values(obs, c.name)
    own = _way_in(obs, values, obs.used_cycles[0])
    found: list[tuple[int, float]] = []
    for cycle in range(1, obs.n_cycle + 1):
        told = _factor(own, _way_in(obs, values, cycle), c) if cycle != obs.used_cycles[0] else None
        if told is None:
            continue
        factor, sd = told
        apart = cycle in obs.used_cycles and abs(factor - 1) > max(TOGETHER, SURELY * sd)
        if apart or not SOFTER <= factor <= STIFFER:
            found.append((cycle, factor))
    if not found:
        return None
    used = [item for item in found if item[0] in obs.used_cycles]
    cycle, factor = max(used or found, key=lambda item: abs(math.log(max(item[1], _LEAST))))
    finding = f"in press {cycle} {c.name} changes by {factor:.2g} times what it does in press {obs.used_cycles[0]}"
    finding += " over the same displacement" + (", and both are used, as one curve" if used else "")
    advice = (
        "A unit, a range or a gain changed between them, or the specimen did: find out which press is right, and use presses "
        "that are alike."
    )
    if SOFTER <= factor <= STIFFER:
        advice = (
            "The specimen softens from press to press, or is another one: use one press, or those from which on they agree."
        )
    return c.grade("presses alike", "bad" if used else "warning", factor, "times", finding, advice)


def _way_in(obs: Observations, values: FloatArray, cycle: int) -> tuple[FloatArray, FloatArray]:
    """Places and readings of the way in of a press, in order of the places."""
    place = obs.displacement if obs.displacement is not None else np.full(values.size, np.nan)
    loads = np.array([branch == "loading" for branch in obs.branch])
    rows = np.flatnonzero(loads & (obs.cycle == cycle) & np.isfinite(place) & np.isfinite(values))
    rows = rows[np.argsort(place[rows], kind="stable")]
    return place[rows], values[rows]


def _factor(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray], c: LoadingBranch
) -> tuple[float, float] | None:
    """By how much more a channel changes in another press than in one, and how far noise puts that off.

    None where too little tells. Noise of the one makes the factor smaller besides, by the ratio of the variances.
    """
    if min(one[0].size, other[0].size) < FEWEST:
        return None
    low, high = max(one[0][0], other[0][0]), min(one[0][-1], other[0][-1])
    if low >= high:
        return None
    places = np.linspace(low, high, PLACES)
    y, w = (np.interp(places, *way) for way in (one, other))
    if np.ptp(y) < CHANGES * c.span:
        return None
    factor, spread = float(np.polyfit(y - np.mean(y), w, 1)[0]), float(np.std(y))
    weaker = (c.noise / spread) ** 2
    return factor, float(np.hypot(1, factor)) * c.noise / (spread * np.sqrt(PLACES)) + weaker
