"""Presses compared going down and up in, the band by which a reading taken while a load is let go misses its force, out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.decision.gripper import WIDTH_IN_SD
from calib.enumeration import all_of
from calib.lab import SHARES, Unloading
from models.sensor import FloatArray

#: Of each press of a specimen: its branches compared, or why they could not be.
Retreats = Mapping[str, Sequence[Unloading | str]]

# Below this share of the largest force nothing is said to differ.
_NOTHING = 0.001


@dataclass(frozen=True, eq=False)
class RetreatBand:
    """How much the force differs between loading and unloading at the same reading, in shares of the largest force.

    Attributes
    ----------
    share : [1], (n_share,), what the reading means going down.
    low, high : [1], (n_share,), force on the way up less that, 90 %, over all presses that are told of; nan where none went.
    peak : [N], smallest and largest force that these presses turned back at.
    hold : [s], longest time that they stood there; nan where it is not known.
    of : names of their specimens.
    """

    share: FloatArray
    low: FloatArray
    high: FloatArray
    peak: tuple[float, float]
    hold: float
    of: tuple[str, ...]

    @property
    def widest(self) -> tuple[float, float]:
        """The lowest and the highest value of the band [1]."""
        return float(np.nanmin(self.low)), float(np.nanmax(self.high))

    @property
    def in_words(self) -> str:
        """The band in a sentence, with the remark that the bounds of a force table do not hold it."""
        low, high = (f"{peak:.3g}" for peak in self.peak)
        stood = f", where the crosshead stood for {self.hold:.2g} s" if self.hold > 0 else ""
        start = f"unloading from {low if low == high else f'{low} to {high}'} N{stood}"
        on = f"(90 %, measured on {all_of(self.of)}); the bounds do not hold that"
        least, most = self.widest
        if max(-least, most) < _NOTHING:
            return f"{start}: no difference to loading {on}"
        at = 100 * self.share[int(np.nanargmax(np.maximum(-self.low, self.high)))]
        return f"{start}: at the same reading the force is {_between(least, most)}, most so at {at:.0f} % of it {on}"

    def around(self, force: FloatArray, peak: float) -> tuple[FloatArray, FloatArray]:
        """What is to be added to the bounds [N] of readings that mean a force, while a load is let go that was at most `peak`.

        Parameters
        ----------
        force : [N], what readings mean going down.
        peak : [N], from which the load is let go.
        """
        share = np.clip(np.asarray(force, dtype=float) / peak, 0.0, 1.0)
        known = np.isfinite(self.low)
        low, high = (np.interp(share, self.share[known], column[known]) for column in (self.low, self.high))
        return np.asarray(np.minimum(low, 0.0) * peak), np.asarray(np.maximum(high, 0.0) * peak)


def band_of(retreats: Retreats, specimens: Sequence[str]) -> RetreatBand | None:
    """The band of all presses of some specimens together: the widest that any of them has.

    Parameters
    ----------
    retreats : of all specimens.
    specimens : that count.

    Returns
    -------
    None where no press of them was recorded both ways.
    """
    told = [(name, one) for name in specimens for one in retreats.get(name, ()) if isinstance(one, Unloading)]
    if not told:
        return None
    ends = np.array([[(one.off + side * WIDTH_IN_SD * one.error) / one.peak for _, one in told] for side in (-1, 1)])
    there = np.any(np.isfinite(ends[0]), axis=0)
    low = np.where(there, np.min(np.where(np.isfinite(ends[0]), ends[0], np.inf), axis=0), np.nan)
    high = np.where(there, np.max(np.where(np.isfinite(ends[1]), ends[1], -np.inf), axis=0), np.nan)
    peaks = [one.peak for _, one in told]
    holds = [one.hold for _, one in told if np.isfinite(one.hold)]
    names = tuple(dict.fromkeys(name for name, _ in told))
    return RetreatBand(SHARES, low, high, (min(peaks), max(peaks)), max(holds, default=float("nan")), names)


def why_no_band(retreats: Retreats, specimens: Sequence[str]) -> str:
    """Why nothing is known of unloading, in words; "" where nobody looked.

    Parameters
    ----------
    retreats, specimens : as in `band_of`.
    """
    why = dict.fromkeys(f"{name}: {one}" for name in specimens for one in retreats.get(name, ()) if isinstance(one, str))
    return "; ".join(why)


def _between(least: float, most: float) -> str:
    """A band about zero in words, in per cent of the largest force."""

    def in_per_cent(share: float) -> str:
        return f"{abs(100 * share):.2g} % of it {'less' if share < 0 else 'more'}"

    if least < -_NOTHING and most > _NOTHING:
        return f"from {in_per_cent(least)} to {in_per_cent(most)} than loading makes it"
    if most <= _NOTHING:
        return f"up to {in_per_cent(least)} than loading makes it"
    return f"up to {in_per_cent(most)} than loading makes it"
