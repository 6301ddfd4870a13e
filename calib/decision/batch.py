"""Newcomers that were inspected in, what is said of all of them together out: lights, both risks, drift, one verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from calib.catalogue import POOLED
from calib.checks import Colour, Member, Reason, Verdict, verdict_of
from calib.decision.conditions import conditions_of
from calib.decision.guard_band import Risks, risks_of
from calib.decision.inspection import Inspected, hardly_told
from calib.decision.sensors import ModelDraws, sensors_of
from calib.decision.trend import Trend, trend_of
from calib.experiment import Specification
from calib.sampling import Posterior
from models.curves import predict_design
from models.response import Forward
from models.sensor import FloatArray

#: What is looked at for a drift, with its label.
DRIFTING: Mapping[str, str] = {"young_modulus": "Young's modulus", "signal": "the signal"}
# Draws of the next specimen of the lot.
_EXPECTED = 600


@dataclass(frozen=True)
class Batch:
    """All newcomers of a batch.

    Attributes
    ----------
    lot : name of the calibration whose lot they are of.
    pooling : of that.
    like : name of the specimen of the lot that they were meant to be like.
    posterior_sha256 : hash of its posterior.
    specification : that they were held against; None for none.
    force : [N], at which the signal is told.
    rows : the newcomers, in the order of their files.
    expected : quantity -> 5, 50 and 95 % quantiles of the next specimen of the lot, SI.
    left_out : (file, why) of files that are no lab files.
    seed : of all random numbers.
    against : what speaks against the calibration of the lot.
    conditions : what its numbers hold for.
    """

    lot: str
    pooling: str
    like: str
    posterior_sha256: str
    specification: Specification | None
    force: float
    rows: tuple[Inspected, ...]
    expected: Mapping[str, tuple[float, float, float]]
    left_out: tuple[tuple[str, str], ...]
    seed: int
    against: tuple[Reason, ...] = ()
    conditions: tuple[str, ...] = ()

    def count(self, light: Colour) -> int:
        """How many have a light."""
        return sum(row.light == light for row in self.rows)

    @property
    def judged(self) -> tuple[Inspected, ...]:
        """Those that pass or fail."""
        return tuple(row for row in self.rows if row.decision != "none")

    @property
    def counted(self) -> tuple[Inspected, ...]:
        """Those of them whose probability counts in the risks: of one that does not belong it rests on readings in doubt."""
        return tuple(row for row in self.judged if row.belongs != "no")

    @property
    def risks(self) -> Risks | None:
        """Global risks of those that were judged and do not lie outside of the lot; None where none was."""
        found = [(row.decision == "pass", row.conformity.probability) for row in self.counted if row.conformity is not None]
        if not found:
            return None
        accepted, probability = (np.array(column, dtype=float) for column in zip(*found, strict=True))
        return risks_of(accepted, probability)

    @property
    def usable(self) -> tuple[Inspected, ...]:
        """Those whose numbers may be used, whether they pass or not."""
        return tuple(row for row in self.rows if row.verdict.colour != "red")

    @property
    def trends(self) -> tuple[Trend, ...]:
        """Whether modulus and signal drift, over the newcomers whose numbers may be used."""
        rows = self.usable
        place, ordered_by = _places(rows)
        found = []
        for quantity in DRIFTING:
            there = np.array([quantity in row.estimates for row in rows], dtype=bool)
            value = np.array([row.estimates[quantity][0] for row in rows if quantity in row.estimates])
            if np.any(there):
                found.append(trend_of(quantity, place[there], value, ordered_by))
        return tuple(found)

    @property
    def of_lot(self) -> Verdict:
        """On the lot that they rest on: no newcomer has a better light."""
        return verdict_of([*self.against, *_spread(self.rows)])

    @property
    def of_specimens(self) -> Verdict:
        """On the newcomers beyond what is on their lot: what their lights are for, and whether they drift."""
        return verdict_of(_reasons(self))

    @property
    def verdict(self) -> Verdict:
        """On all of it, the newcomers first and then their lot."""
        return verdict_of([*self.of_specimens.reasons, *self.of_lot.reasons])


def _places(rows: Sequence[Inspected]) -> tuple[FloatArray, str]:
    """Time [s] of each newcomer, if all files say when they began and not all at once; else their numbers."""
    if rows and all(row.started for row in rows):
        times = np.array([datetime.fromisoformat(row.started).timestamp() for row in rows])
        if np.ptp(times) > 0:
            return times - np.min(times), "time"
    return np.arange(float(len(rows))), "name"


def _spread(rows: Sequence[Inspected]) -> list[Reason]:
    """That the lot hardly tells who belongs, once: by the newcomer that tells least."""
    hardly = {hardly_told(row.of_another_kind)[1]: r for row in rows for r in row.verdict.reasons if r.gate == "spread"}
    return [hardly[min(hardly)]] if hardly else []


def _reasons(batch: Batch) -> list[Reason]:
    n = len(batch.rows)
    found = []
    unusable = [row.name for row in batch.rows if row.verdict.colour == "red"]
    if unusable:
        finding = f"the numbers of {_of(len(unusable), n)} must not be used: {_few(unusable)}"
        found.append(Reason("specimens", "red", finding, "See the reason of each; they neither pass nor fail"))
    failed = [row.name for row in batch.rows if row.decision == "fail"]
    if failed:
        verb = "are" if len(failed) > 1 else "is"
        finding = f"{_of(len(failed), n)} {verb} not shown to conform to the specification: {_few(failed)}"
        found.append(Reason("specification", "red", finding, "Reject them, or measure them better"))
    aside = [row.name for row in batch.rows if row.set_aside and row.decision == "none" and row.verdict.colour != "red"]
    if aside:
        verb = "do" if len(aside) > 1 else "does"
        finding = f"{_of(len(aside), n)} {verb} not belong to the lot: {_few(aside)}"
        action = "Set it aside until it is known why; what passes a specification (--spec) all the same is amber"
        found.append(Reason("belongs", "red", finding, action))
    amber = [row.name for row in batch.rows if row.light == "amber" and row.own]
    if amber:
        finding = f"something speaks against the numbers of {_of(len(amber), n)}: {_few(amber)}"
        found.append(Reason("specimens", "amber", finding, "See the reason of each"))
    for trend in batch.trends:
        if trend.drifts:
            finding = f"the lot drifts: {trend.in_words(DRIFTING[trend.quantity])}"
            action = "Look what changed in making or measuring them, and calibrate specimens of now as a lot of their own"
            found.append(Reason("drift", "amber", finding, action))
    return found


def _of(some: int, n: int) -> str:
    return f"{some} of {n} specimens" if n > 1 else "the specimen"


def _few(names: Sequence[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more


def expected_of(posterior: Posterior, forward: Forward, force: float, seed: int) -> dict[str, tuple[float, float, float]]:
    """What the lot lets one expect of its next specimen, before it is measured: 5, 50 and 95 % quantiles, SI.

    Parameters
    ----------
    posterior : of the lot.
    forward : its model.
    force : [N], at which the signal is told.
    seed : of the specimen.

    Returns
    -------
    By quantity; the signal is not among them where one in twenty does not carry the load.
    """
    part = _next_ones(posterior, forward, seed)
    values = {name: np.asarray(value, dtype=float) for name, value in part.base.parameters().items() if name in POOLED}
    values["signal"] = predict_design(forward, part.base, np.array([force])).change[:, 0]
    found = {}
    for name, value in values.items():
        there = value[np.isfinite(value)]
        if there.size >= 0.95 * value.size:
            low, median, high = (float(q) for q in np.quantile(there, [0.05, 0.5, 0.95]))
            found[name] = (low, median, high)
    return found


def conditions_of_next(posterior: Posterior, forward: Forward, force: float, seed: int) -> tuple[str, ...]:
    """What the numbers of the next specimens of a lot hold for, in words: what no reading of them would tell.

    Parameters
    ----------
    posterior, forward, force, seed : as of `expected_of`.
    """
    part = _next_ones(posterior, forward, seed)
    balls = [sweep.indenter_radius for sweep in posterior.sweeps]
    padding = float(np.median(np.asarray(part.base.padding.thickness)))
    model = conditions_of([part], padding, sorted({min(balls), max(balls)}), electrode_chosen=True)
    return (_of_instruments(posterior, part, forward, force), *model)


def _of_instruments(posterior: Posterior, part: ModelDraws, forward: Forward, force: float) -> str:
    """That instruments are as they were, with what one that has gone off by a hundredth makes of specimens."""
    load = "a load cell that has come to read 1 % too low makes moduli 1 % too small"
    meter = ""
    if any("capacitance" in sweep.channels for sweep in posterior.sweeps):
        change = predict_design(forward, part.base, np.array([force, 1.01 * force])).change
        carried = np.all(np.isfinite(change), axis=1)
        if np.any(carried):
            more = float(np.median(change[carried, 1] / change[carried, 0])) - 1
            load += f", signals at {force:g} N {100 * more:.2g} % too large"
        meter = "; a meter that reads 1 % too high makes permittivities 1 % too large"
    told = "and up to some per cent no light tells: press a specimen of the lot again from time to time"
    return f"instruments as they were for the lot: {load}{meter}, {told}"


def _next_ones(posterior: Posterior, forward: Forward, seed: int) -> ModelDraws:
    """Draws of the next specimen."""
    member = Member("", posterior, forward, 1.0)
    rng = np.random.default_rng(seed)
    return sensors_of([member], posterior.experiment.pooling, _EXPECTED, None, rng, seed).parts[0]
