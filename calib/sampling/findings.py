"""What was found out about a posterior beside its chains: its numbers, its forward model, other models, other subsets of data.

Each is a small record that is kept with the posterior and says itself whether it speaks against it, and what it says in words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class ParameterSummary:
    """Posterior of one parameter in numbers, SI.

    Attributes
    ----------
    unit : SI, of mean, sd, median and interval.
    mean, sd, median : of the draws.
    interval_90 : central 90 %.
    r_hat : [1], near 1 where the chains agree.
    ess_bulk, ess_tail : as how many independent draws they count, in the middle and towards the ends.
    prior_contraction : 1 - posterior variance / prior variance in the prior's standard-normal coordinate, where every prior has
        variance 1: 0 where the data taught nothing, towards 1 where they taught everything.
    prior_shift : posterior mean in that coordinate: by how many of its standard deviations the data pulled the prior.
    """

    unit: str
    mean: float
    sd: float
    median: float
    interval_90: tuple[float, float]
    r_hat: float
    ess_bulk: float
    ess_tail: float
    prior_contraction: float
    prior_shift: float


#: Largest root mean square of differences from the finite elements, in units of the error that a surrogate states.
SPOT_CHECK_LIMIT = 3.0


@dataclass(frozen=True)
class SpotCheck:
    """How far the forward model is off the finite elements at a few draws of the posterior.

    Attributes
    ----------
    forward_name : the forward model that was looked at.
    n_curve : loading curves compared, draws times sweeps.
    force_error, change_error : largest relative difference of force and of the change of capacitance.
    force_score, change_score : root mean square of the difference in units of the error stated; inf if none is stated.
    failures : curves that the finite elements could not follow to the deepest reading, and why.
    """

    forward_name: str
    n_curve: int
    force_error: float
    change_error: float
    force_score: float
    change_score: float
    failures: tuple[str, ...]

    @property
    def stated(self) -> bool:
        """Whether the forward model states an error of its own."""
        return bool(np.isfinite(self.force_score) and np.isfinite(self.change_score))

    @property
    def passed(self) -> bool:
        """Whether the differences are as small as the forward model states; also if it states no error of its own."""
        return not self.stated or max(self.force_score, self.change_score) <= SPOT_CHECK_LIMIT

    def in_words(self) -> str:
        """Say in one sentence how far the forward model is off, with the numbers."""
        sizes = f"up to {100 * self.force_error:.2f} % in force and {100 * self.change_error:.2f} % in capacitance change"
        said = (
            f"at {self.n_curve} loading curves of the posterior the {self.forward_name} is off the finite elements by {sizes}"
        )
        if not self.stated:
            return said
        scores = f"{self.force_score:.1f} and {self.change_score:.1f} times the error it states"
        return f"{said}, {scores} (root mean square)"


#: Shift of a parameter's mean, in posterior standard deviations, that matters.
SHIFT_LIMIT = 0.1

#: Standard errors that a shift may exceed `SHIFT_LIMIT` by before it is taken for real.
_SHIFT_ERRORS = 2.0


@dataclass(frozen=True)
class Shift:
    """What re-weighting does to one parameter, SI.

    Attributes
    ----------
    mean, sd : of the draws as they are; `weighted_mean`, `weighted_sd` : re-weighted.
    shift : of the mean, in standard deviations of the whole posterior.
    error : its Monte Carlo standard error, in the same.
    """

    mean: float
    sd: float
    weighted_mean: float
    weighted_sd: float
    shift: float
    error: float

    @property
    def matters(self) -> bool:
        """Whether the mean shifts by more than `SHIFT_LIMIT` beyond twice its Monte Carlo error."""
        return abs(self.shift) > SHIFT_LIMIT + _SHIFT_ERRORS * self.error


@dataclass(frozen=True)
class Reweighting:
    """Draws of the posterior re-weighted to the likelihood with finite elements (Pareto-smoothed importance sampling).

    Attributes
    ----------
    n_draw : draws asked, those without weight included.
    k_hat : shape of the tail of the weights.
    ess : effective number of draws, 1 / sum of squared weights.
    shifts : of each parameter; nan if no draw has a weight.
    failures : draws of weight zero, because the finite elements found no equilibrium or do not cover them, and why.
    """

    n_draw: int
    k_hat: float
    ess: float
    shifts: Mapping[str, Shift]
    failures: tuple[str, ...]

    @property
    def k_limit(self) -> float:
        """Largest k-hat at which that many draws can be trusted, min(1 - 1/log10(n), 0.7) (Vehtari et al. 2024)."""
        return min(1 - 1 / math.log10(self.n_draw), 0.7)

    @property
    def trusted(self) -> bool:
        """Whether the weights can be trusted."""
        return self.k_hat <= self.k_limit

    @property
    def shifted(self) -> tuple[str, ...]:
        """Parameters whose mean shifts by more than is tolerable (`Shift.matters`), the largest shift first."""
        found = [name for name, s in self.shifts.items() if s.matters]
        return tuple(sorted(found, key=lambda name: -abs(self.shifts[name].shift)))

    @property
    def passed(self) -> bool:
        """Whether the posterior stands: the weights can be trusted, and no parameter shifts by more than is tolerable."""
        return self.trusted and not self.shifted

    def in_words(self) -> str:
        """Say in one sentence what re-weighting changes, with the numbers."""
        told = f"re-weighted to the finite elements at {self.n_draw} draws (k-hat {self.k_hat:.2f}, {self.ess:.0f} effective)"
        if self.failures:
            told += f", {len(self.failures)} of them without weight as the finite elements found no equilibrium there,"
        if not self.trusted:
            return (
                f"{told} the weights cannot be trusted (k-hat above {self.k_limit:.2f}): the two posteriors differ by too much"
            )
        names = self.shifted or (max(self.shifts, key=lambda name: abs(self.shifts[name].shift)),)
        shifts = ", ".join(f"{n} by {self.shifts[n].shift:+.2f} ± {self.shifts[n].error:.2f}" for n in names)
        if self.shifted:
            return f"{told} means shift by more than {SHIFT_LIMIT:g} posterior standard deviations: {shifts}"
        beyond = f"{SHIFT_LIMIT:g} posterior standard deviations beyond twice its Monte Carlo error"
        more = "; more draws would tell it better" if abs(self.shifts[names[0]].shift) > SHIFT_LIMIT else ""
        return f"{told} no mean shifts by more than {beyond} (the largest, {shifts}{more})"


@dataclass(frozen=True)
class FirstEstimate:
    """Mean and standard deviation of one unknown by a first answer, SI."""

    mean: float
    sd: float


#: A first answer of fewer effective draws than this is called rough.
FEW_EFFECTIVE_DRAWS = 100.0

#: A first answer disagrees with the result where a mean is off by more than this, in standard deviations of the result, or a
#: standard deviation by more than this share of it.
FIRST_MEAN_LIMIT, FIRST_SD_LIMIT = 0.3, 0.3


@dataclass(frozen=True)
class FirstAnswer:
    """What was estimated before anything was sampled, from one mode of the posterior: a first answer, not the result.

    Attributes
    ----------
    parameters : name -> estimate, in the order of the unknowns.
    effective_draws : how many independent draws it is worth, of `calib.sampling.estimate`.
    confirmed : whether its mode describes the readings as expected, or two climbs from different places ended there.
    log_evidence : logarithm of the density of the data under the model and its priors, SI; comparable for the same data.
    """

    parameters: Mapping[str, FirstEstimate]
    effective_draws: float
    confirmed: bool = True
    log_evidence: float = math.nan

    @property
    def means(self) -> dict[str, float]:
        """The mean of each unknown by name, SI."""
        return {name: estimate.mean for name, estimate in self.parameters.items()}

    @property
    def rough(self) -> bool:
        """Whether it rests on so few effective draws, or on a mode that was reached once alone, that it may be far off."""
        return self.effective_draws < FEW_EFFECTIVE_DRAWS or not self.confirmed

    def against(self, result: Mapping[str, ParameterSummary], converged: bool) -> str:
        """Say in one sentence where the result disagrees with it, or that it does not.

        Parameters
        ----------
        result : what was sampled, by name.
        converged : whether that counts.
        """
        off = []
        for name, first in self.parameters.items():
            s = result[name]
            if not s.sd > 0:
                continue
            shift, ratio = (s.mean - first.mean) / s.sd, first.sd / s.sd
            if abs(shift) > FIRST_MEAN_LIMIT:
                off.append((abs(shift), f"{name} (mean by {abs(shift):.1f} of its standard deviations)"))
            elif abs(ratio - 1) > FIRST_SD_LIMIT:
                off.append((abs(ratio - 1), f"{name} (standard deviation {ratio:.1f} times that of the result)"))
        if not off:
            limits = f"means within {FIRST_MEAN_LIMIT:g} standard deviations, these within {100 * FIRST_SD_LIMIT:.0f} %"
            return f"The first answer agrees with the result ({limits})."
        off_for = f"The first answer differs from the result for {', '.join(words for _, words in sorted(off, reverse=True))}"
        return f"{off_for}: the result counts." if converged else f"{off_for}, which has not converged."


@dataclass(frozen=True)
class Departure:
    """How well another model describes the same data, one that differs in a single choice, and what it would change.

    Attributes
    ----------
    name : of the choice, as `calib compare` names its folders; "clock-rate" for clocks of different rates.
    model : the choices of that model in words.
    log_bayes : logarithm of the Bayes factor for it and against the model of the posterior; nan where it is not known, as where
        that model does not cover what was measured.
    young_modulus : what Young's modulus would be under it; None if not known, or fixed.
    """

    name: str
    model: str
    log_bayes: float
    young_modulus: FirstEstimate | None


@dataclass(frozen=True)
class Averaged:
    """One of the models that an average is of: how much it counts, and what it says by itself.

    Attributes
    ----------
    name : of the model, and of its file in the run's folder.
    model : its choices in words.
    forward : the forward model that it was sampled with, by name and content.
    sha256 : hash of its posterior's file; "" if it is not kept.
    weight : [1], share of the draws that are its.
    interval : central 90 % of the weight over what it rests on, see `calib.checks.model_weights`.
    weights : the weight that it would have in each way to weight models.
    young_modulus : what Young's modulus is under it; None if fixed.
    """

    name: str
    model: str
    forward: str
    sha256: str
    weight: float
    interval: tuple[float, float]
    weights: Mapping[str, float]
    young_modulus: FirstEstimate | None


def share_between(weight: npt.ArrayLike, mean: npt.ArrayLike, sd: npt.ArrayLike) -> float:
    """Share of the variance of a mixture that lies between its parts: what of a doubt is the choice of model.

    By the law of total variance, sum_k w_k (m_k - m)^2 / [sum_k w_k s_k^2 + sum_k w_k (m_k - m)^2].

    Parameters
    ----------
    weight : of the parts, (n_part,).
    mean, sd : of each of them, (n_part,).

    Examples
    --------
    >>> share_between([0.5, 0.5], [0.0, 2.0], [1.0, 1.0])
    0.5
    """
    w, m, s = (np.asarray(x, dtype=float) for x in (weight, mean, sd))
    w = w / np.sum(w)
    between = float(w @ (m - w @ m) ** 2)
    total = between + float(w @ s**2)
    return between / total if total > 0 else 0.0


@dataclass(frozen=True)
class Foretold:
    """How well the other specimens predict what was read of one, in one channel.

    Attributes
    ----------
    specimen : its name.
    channel : a key of `calib.catalogue.CHANNELS`.
    ratio : what was read over what the others let one expect, and what is not known of that, spread of a lot included.
    z : how far off that is: standard normal for a specimen that the others predict.
    """

    specimen: str
    channel: str
    ratio: FirstEstimate
    z: float


#: Cumulative Jensen-Shannon distance for each doubling of a power from which a quantity is sensitive (Kallioinen et al. 2023).
SENSITIVE = 0.05
#: Shift of the mean of a normal distribution for each doubling, in its standard deviations, that is as much by itself.
SHIFTED = 0.25

Diagnosis = Literal["none", "prior-driven", "both", "conflict", "not known"]


@dataclass(frozen=True)
class Pull:
    """How one prior by itself bears on a quantity: its name, the quantity's sensitivity to its power, and shift of its mean.

    As in `Sensitivity`.
    """

    unknown: str
    sensitivity: float
    shift: float


@dataclass(frozen=True)
class Sensitivity:
    """How one quantity of a posterior would move if priors, or the likelihood, were taken for a little stronger or weaker.

    Attributes
    ----------
    prior, likelihood : sensitivity to the power of all beliefs together, and to that of the likelihood [1]: cumulative
        Jensen-Shannon distance for each doubling; nan where the weights cannot be trusted.
    shift : of the mean where all beliefs are twice as strong, to first order, in posterior standard deviations.
    z : that shift over what it comes to in sound labs, those whose truth was drawn from the priors (one standard deviation).
    pulls : the priors that it hangs on most by themselves, the foremost first.
    k_hat : shape of the tail of the worse of their weights.
    limit : |z| above which the beliefs contradict the data.
    """

    prior: float
    likelihood: float
    shift: float
    z: float
    pulls: tuple[Pull, ...]
    k_hat: float
    limit: float

    @property
    def foremost(self) -> Pull:
        """The prior that does most of the shift."""
        return max(self.pulls, key=lambda pull: math.copysign(pull.shift, self.shift * pull.shift))

    @property
    def diagnosis(self) -> Diagnosis:
        """What the two sensitivities mean.

        "prior-driven" where the prior counts and the data hardly do, "both" where both do and agree, "conflict" where both do
        and the beliefs pull the mean away from the data, by as much as makes it sensitive and further than they do in sound
        labs, "not known" where weights cannot be trusted.
        """
        if math.isnan(self.prior) or math.isnan(self.likelihood):
            return "not known"
        if self.prior < SENSITIVE:
            return "none"
        if self.likelihood < SENSITIVE:
            return "prior-driven"
        return "conflict" if abs(self.z) > self.limit and abs(self.shift) > SHIFTED else "both"


@dataclass(frozen=True)
class Stranger:
    """How far a specimen lies off what the other specimens of its lot let one expect of it (partial pooling).

    Attributes
    ----------
    specimen : its name.
    ratio : value of the quantity over what is expected of it, and what is not known of that, spread included.
    z : how far off that is: standard normal for a specimen that belongs to the lot.
    quantity : one of `calib.catalogue.POOLED`.
    """

    specimen: str
    ratio: FirstEstimate
    z: float
    quantity: str = "young_modulus"
