"""Replicates of an experiment in, whether its calibrations may be believed out: ranks, coverage, and a verdict."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from calib.catalogue import UnknownName, unknowns_of
from calib.checks.proof.ranks import coverage_interval, probability_of
from calib.checks.proof.replicate import LIKELIHOOD, Replicate
from calib.checks.verdict import Level, Reason, Verdict, verdict_of
from models.sensor import FloatArray

#: Probability of a sound proof to have any quantity that is said to stray.
CHANCE = 0.01

#: Replicates below which a proof says little.
FEW = 100

#: Shares of replicates that did not converge, or could not be made, above which a proof is doubtful, or none.
LOST, MANY_LOST = 0.05, 0.25


@dataclass(frozen=True)
class Tested:
    """How well posteriors hold the truth of one quantity.

    Attributes
    ----------
    name : of the unknown, of a quantity of the next specimen, or `LIKELIHOOD`.
    n : how many truths.
    mean_rank : 0.5 if all is well; above it posteriors lie too low.
    probability : with which uniform ranks would stray as far anywhere.
    covered : share of the central 90 % intervals that hold the truth.
    interval : between which the true coverage lies, with 95 %.
    off : root mean square of the error of the mean in standard deviations; 1 if all is well and normal.
    """

    name: str
    n: int
    mean_rank: float
    probability: float
    covered: float
    interval: tuple[float, float]
    off: float


@dataclass(frozen=True, eq=False)
class Proof:
    """What replicates say of the calibrations of an experiment.

    Attributes
    ----------
    replicates : all of them, by number.
    """

    replicates: tuple[Replicate, ...]

    @cached_property
    def outcomes(self) -> Mapping[str, int]:
        """How many replicates ended how."""
        return dict(Counter(replicate.outcome for replicate in self.replicates))

    @cached_property
    def counted(self) -> tuple[Replicate, ...]:
        """The replicates in which a truth is ranked, converged or not."""
        return tuple(replicate for replicate in self.replicates if replicate.counts)

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities that are ranked, in the order of the unknowns."""
        return tuple(dict.fromkeys(name for replicate in self.counted for name in replicate.places))

    def ranks(self, name: str) -> FloatArray:
        """Rank of the truth of a quantity in every replicate that has it, (n,)."""
        return np.array([replicate.places[name].rank for replicate in self.counted if name in replicate.places])

    @cached_property
    def tested(self) -> tuple[Tested, ...]:
        """Every quantity, tested."""
        return tuple(self._tested(name) for name in self.names)

    def _tested(self, name: str) -> Tested:
        places = [replicate.places[name] for replicate in self.counted if name in replicate.places]
        ranks = self.ranks(name)
        inside = sum(place.inside for place in places)
        off = float(np.sqrt(np.mean([place.off**2 for place in places])))
        return Tested(
            name,
            len(places),
            float(np.mean(ranks)),
            probability_of(ranks),
            inside / len(places),
            coverage_interval(inside, len(places)),
            off,
        )

    def strays(self, tested: Tested) -> bool:
        """Whether the ranks of a quantity stray farther than those of any of its quantities would by `CHANCE`."""
        return tested.probability < CHANCE / len(self.tested)

    @cached_property
    def verdict(self) -> Verdict:
        """Whether calibrations of this experiment may be believed."""
        return verdict_of(_reasons(self))

    def to_plain(self) -> dict[str, Any]:
        """What a program reads of it: the verdict, how replicates ended, and every quantity."""
        quantities = {t.name: {k: v for k, v in asdict(t).items() if k != "name"} for t in self.tested}
        counts = {"replicates": len(self.replicates), "outcomes": dict(self.outcomes)}
        return {"verdict": self.verdict.to_plain(), **counts, "quantities": quantities}


def in_words(tested: Tested) -> str:
    """How posteriors miss the truth of a quantity that strays, with its numbers."""
    way = "too low" if tested.mean_rank > 0.5 else "too high"
    width = "are too narrow" if tested.off > 1.1 else "are too wide" if tested.off < 0.9 else ""
    how = [f"posteriors lie {way} (mean rank {tested.mean_rank:.2f})"] if abs(tested.mean_rank - 0.5) > 0.03 else []
    how += [f"posteriors {width}"] if width else []
    low, high = tested.interval
    share = f"{tested.covered * 100:.0f} % of {tested.n} intervals of 90 % hold it ({low * 100:.0f} to {high * 100:.0f} %)"
    return f"{tested.name}: {' and '.join(how) or 'ranks are not uniform'}; {share}"


def _reasons(proof: Proof) -> list[Reason]:
    n, counted = len(proof.replicates), len(proof.counted)
    if not counted:
        why = next((replicate.why for replicate in proof.replicates if replicate.why), "there is none")
        return [Reason("replicates", "red", f"no replicate could be calibrated: {why}", "see to that first")]
    reasons = []
    gone = n - counted
    if gone > LOST * n:
        why, times = Counter(replicate.why for replicate in proof.replicates if not replicate.counts).most_common(1)[0]
        finding = f"{gone} of {n} replicates could not be calibrated, {times} of them as: {why}"
        level: Level = "red" if gone > MANY_LOST * n else "amber"
        reasons.append(Reason("replicates", level, finding, "what is proved holds for the others alone; narrow the priors"))
    loose = proof.outcomes.get("not converged", 0)
    if loose > LOST * n:
        level = "red" if loose > MANY_LOST * n else "amber"
        finding = f"{loose} of {n} replicates did not converge"
        reasons.append(Reason("convergence", level, finding, "their posteriors are ranked as they are; look at one of them"))
    reasons += [_of(tested) for tested in proof.tested if proof.strays(tested)]
    if counted < FEW:
        low, high = coverage_interval(round(0.9 * counted), counted)
        finding = f"{counted} replicates tell a coverage of 90 % from {low * 100:.0f} or {high * 100:.0f} % at best"
        reasons.append(Reason("replicates", "amber", finding, f"go on to {FEW} or more: the same command with --replicates"))
    return reasons


def _of(tested: Tested) -> Reason:
    """The reason for a quantity that strays: red where a number of the material comes out surer than it is."""
    finding = in_words(tested)
    if tested.name == LIKELIHOOD:
        return Reason("ranks", "amber", finding, "the noise or the discrepancy is not as the data of the replicates have it")
    headline = UnknownName.parse(tested.name).parameter in unknowns_of("material")
    sure = tested.interval[1] < 0.9
    action = "take its interval for wider than it is said" if sure else "do not read more from its interval than its ends"
    return Reason("ranks", "red" if headline and sure else "amber", finding, action)
