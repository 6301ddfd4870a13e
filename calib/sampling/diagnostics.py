"""Chains of several ensembles in, convergence, effective sample sizes, summaries and reasons for doubt, out.

The walkers of one ensemble depend on each other, so an ensemble is one chain, and only ensembles are independent. Its draws are
taken in the order of `calib.sampling.layout.chain_order`, in which `posterior.nc` keeps them too: `az.rhat` and `az.ess` of the
file are the numbers here.

- ArviZ splits each chain in the middle, so that R-hat (rank-normalised) compares the early half with the late half.
- Within a half each walker's draws stand together, so that the effective sample size sees the autocorrelation of the chain.
  Correlations across the ends of these stretches are not seen: for autoregressive walkers a quarter too much is claimed
  where a stretch is 2.5 autocorrelation times long, the least that the default gate lets through, and a tenth at 5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from calib.catalogue import QUANTITIES
from calib.problem import ParameterInfo
from calib.records import record_from_text, record_to_text
from calib.sampling.archive import LeaveOut, effective_sample_size, leave_blocks_out, rank_r_hat
from calib.sampling.layout import chain_order
from models.sensor import FloatArray

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Convergence", "Diagnostics", "Gate", "LeaveOut", "ParameterSummary", "convergence", "leave_blocks_out", "summarise"]


#: A posterior mean further than this from its prior's median, in the prior's standard deviations, contradicts the prior.
PRIOR_CONFLICT = 3.0


@dataclass(frozen=True)
class Gate:
    """What a run has to reach before it counts as converged.

    Attributes
    ----------
    r_hat : [1], limit below which every parameter's R-hat must lie.
    ess : effective sample size, bulk and tail, that every parameter must reach.
    length : least length of the run in autocorrelation times.
    """

    r_hat: float = 1.01
    ess: float = 400.0
    length: float = 10.0


@dataclass(frozen=True, eq=False)
class Convergence:
    """How far a run has converged, parameter by parameter, arrays (n_parameter,).

    Attributes
    ----------
    r_hat, ess_bulk, ess_tail : over ensembles.
    tau : integrated autocorrelation time in steps.
    steps : of each walker, burn-in included.
    doubts : what speaks against the chains although they agree, one sentence each.
    """

    r_hat: FloatArray
    ess_bulk: FloatArray
    ess_tail: FloatArray
    tau: FloatArray
    steps: int
    doubts: tuple[str, ...] = ()

    @property
    def worst_r_hat(self) -> int:
        """Index of the parameter with the largest R-hat."""
        return int(np.argmax(np.nan_to_num(self.r_hat, nan=np.inf)))

    @property
    def least_ess(self) -> int:
        """Index of the parameter with the least effective sample size."""
        return int(np.argmin(np.nan_to_num(self.ess, nan=0.0)))

    @property
    def ess(self) -> FloatArray:
        """The lesser of bulk and tail effective sample size."""
        return np.minimum(self.ess_bulk, self.ess_tail)


@dataclass(frozen=True)
class ParameterSummary:
    """Posterior of one parameter in numbers, SI.

    Attributes
    ----------
    interval_90 : central 90 %.
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
        sizes = f"up to {self.force_error:.2%} in force and {self.change_error:.2%} in capacitance change"
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
    """

    parameters: Mapping[str, FirstEstimate]
    effective_draws: float
    confirmed: bool = True

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
            limits = f"means within {FIRST_MEAN_LIMIT:g} standard deviations, these within {FIRST_SD_LIMIT:.0%}"
            return f"The first answer agrees with the result ({limits})."
        off_for = f"The first answer differs from the result for {', '.join(words for _, words in sorted(off, reverse=True))}"
        return f"{off_for}: the result counts." if converged else f"{off_for}, which has not converged."


@dataclass(frozen=True)
class Diagnostics:
    """Whether the numbers of a posterior may be used, and if not, why not.

    These are two facts: `converged` says that the chains agree, which more sampling can bring about; `surrogate_honest` says
    that the forward model is as close to the finite elements as it states, which more sampling cannot mend.

    Attributes
    ----------
    converged : whether the chains met the `gate`; `reasons` says where they did not, one sentence each.
    warnings : what may be wrong with the result although the chains agree.
    parameters : the posterior of each parameter in numbers, by name.
    steps, burn_in, thin : steps of each walker in the run, the first of them discarded, and every how many-th of the rest kept.
    n_walker : walkers of each ensemble.
    acceptance_fraction : share of accepted steps after the burn-in, per ensemble.
    tau : integrated autocorrelation time in steps, by parameter.
    gate : what the chains had to reach in this run.
    spot_check : of the forward model against the finite elements; None if it was not made.
    reweighting : of draws to the likelihood with finite elements; None if it was not made.
    acceptance_by_move : share of accepted steps after the burn-in of each kind of move, over all ensembles.
    first_answer : what was estimated before sampling; None if nothing was.
    block_k_hat : how much each block of data pulls the posterior by itself, k-hat of leaving it out (PSIS); empty if not known.
    """

    converged: bool
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    parameters: Mapping[str, ParameterSummary]
    steps: int
    burn_in: int
    thin: int
    n_walker: int
    acceptance_fraction: tuple[float, ...]
    tau: Mapping[str, float]
    gate: Gate
    spot_check: SpotCheck | None = None
    reweighting: Reweighting | None = None
    acceptance_by_move: Mapping[str, float] = field(default_factory=dict)
    first_answer: FirstAnswer | None = None
    block_k_hat: tuple[float, ...] = ()

    @property
    def surrogate_honest(self) -> bool | None:
        """Whether the forward model is as close to the finite elements as it states; None if not known or it states nothing."""
        return self.spot_check.passed if self.spot_check is not None and self.spot_check.stated else None

    @property
    def surrogate_reasons(self) -> tuple[str, ...]:
        """What the spot check found wrong, one sentence each; more sampling cannot mend it."""
        return (self.spot_check.in_words(),) if self.spot_check is not None and self.surrogate_honest is False else ()

    @property
    def first_answer_in_words(self) -> str:
        """Where the result disagrees with the first answer, in one sentence; "" if there was none."""
        return "" if self.first_answer is None else self.first_answer.against(self.parameters, self.converged)

    @property
    def usable(self) -> bool:
        """Whether the numbers may be built on: the chains have converged, and the forward model was not found dishonest."""
        return self.converged and self.surrogate_honest is not False

    @property
    def reasons_against_use(self) -> tuple[str, ...]:
        """Everything that speaks against `usable`, that of the chains first."""
        return self.reasons + self.surrogate_reasons

    def to_dataframe(self) -> pd.DataFrame:
        """The summary of every unknown as a table, one row each, by name.

        Returns
        -------
        Columns unit, mean, sd, median, low and high (of the central 90 %), r_hat, ess_bulk, ess_tail, prior_contraction,
        prior_shift; values in SI.
        """
        import pandas as pd

        rows = {name: asdict(summary) for name, summary in self.parameters.items()}
        for row in rows.values():
            row["low"], row["high"] = row.pop("interval_90")
        first = ["unit", "mean", "sd", "median", "low", "high"]
        frame = pd.DataFrame.from_dict(rows, orient="index")
        return frame[[*first, *(c for c in frame.columns if c not in first)]]


def convergence(chains: FloatArray, tau: FloatArray, steps: int) -> Convergence:
    """Judge whether independent ensembles found the same answer, and how many independent draws theirs are worth.

    Parameters
    ----------
    chains : (n_ensemble, n_step, n_walker, n_parameter), after the burn-in, possibly thinned; SI, as R-hat's look at the
        spread of the draws depends on the scale.
    tau : (n_parameter,), autocorrelation time in steps.
    steps : of each walker so far, burn-in included.
    """
    n_ensemble, n_step, n_walker, n_parameter = chains.shape
    order = chain_order(n_step * n_walker, n_walker)
    r_hat, bulk, tail = np.empty(n_parameter), np.empty(n_parameter), np.empty(n_parameter)
    for k in range(n_parameter):
        ordered = np.take(chains[..., k].reshape(n_ensemble, -1), order, axis=1)
        r_hat[k] = rank_r_hat(ordered)
        bulk[k] = effective_sample_size(ordered)
        tail[k] = effective_sample_size(ordered, tail=True)
    return Convergence(r_hat, bulk, tail, np.asarray(tau, dtype=float), steps)


def shortcomings(state: Convergence, names: Sequence[str], gate: Gate) -> tuple[str, ...]:
    """Say in sentences which requirements of the gate a run has not met yet.

    Parameters
    ----------
    state : of the run.
    names : of the parameters, in the order of its arrays.
    gate : what is to be reached.

    Returns
    -------
    tuple of str
        One sentence each with parameter and numbers; empty if converged.
    """
    found = []
    for name, r_hat in zip(names, state.r_hat, strict=True):
        if not r_hat < gate.r_hat:
            found.append(f"{name}: R-hat {r_hat:.4f} is not below {gate.r_hat:g}")
    for name, bulk, tail in zip(names, state.ess_bulk, state.ess_tail, strict=True):
        for kind, ess in (("bulk", bulk), ("tail", tail)):
            if not ess > gate.ess:
                found.append(f"{name}: {kind} effective sample size {ess:.0f} is not above {gate.ess:.0f}")
    slowest = int(np.argmax(np.nan_to_num(state.tau, nan=np.inf)))
    if not state.steps >= gate.length * state.tau[slowest]:
        times = f"{gate.length:g} autocorrelation times of {state.tau[slowest]:.0f} steps"
        found.append(f"{names[slowest]}: {state.steps} steps are fewer than {times}, too few to have forgotten the start")
    return (*found, *state.doubts)


def summarise(
    parameters: Sequence[ParameterInfo], values: FloatArray, theta: FloatArray, state: Convergence
) -> dict[str, ParameterSummary]:
    """Put the posterior of every parameter in a few numbers.

    Parameters
    ----------
    parameters : in the order of the columns.
    values : (n, n_parameter), draws in SI.
    theta : (n, n_parameter), the same draws in the priors' standard-normal coordinates.
    state : of the run that they are from.

    Returns
    -------
    dict
        `ParameterSummary` by name.
    """
    found = {}
    for k, p in enumerate(parameters):
        x = values[:, k]
        low, median, high = (float(q) for q in np.quantile(x, [0.05, 0.5, 0.95]))
        found[p.name] = ParameterSummary(
            unit=QUANTITIES[p.parameter].unit,
            mean=float(np.mean(x)),
            sd=float(np.std(x, ddof=1)),
            median=median,
            interval_90=(low, high),
            r_hat=float(state.r_hat[k]),
            ess_bulk=float(state.ess_bulk[k]),
            ess_tail=float(state.ess_tail[k]),
            prior_contraction=float(1 - np.var(theta[:, k], ddof=1)),
            prior_shift=float(np.mean(theta[:, k])),
        )
    return found


def prior_conflicts(parameters: Mapping[str, ParameterSummary]) -> tuple[str, ...]:
    """Warnings on parameters that the data pull further than `PRIOR_CONFLICT` away from their prior's median."""
    return tuple(
        f"{name}: the data pull it {abs(s.prior_shift):.1f} standard deviations of its prior away from the prior's median; the "
        "prior, or something the model leaves out, is wrong"
        for name, s in parameters.items()
        if abs(s.prior_shift) > PRIOR_CONFLICT
    )


# Layout of diagnostics as JSON.
_FORMAT = 1


def diagnostics_to_json(diagnostics: Diagnostics) -> str:
    """Write diagnostics as JSON text; the inverse is `diagnostics_from_json`."""
    return record_to_text("diagnostics", _FORMAT, asdict(diagnostics), indent=None, exact=True)


def diagnostics_from_json(text: str) -> Diagnostics:
    """Read the diagnostics that `diagnostics_to_json` wrote.

    Raises
    ------
    ValueError
        If the text is another record, or of another format.
    """
    data = record_from_text("diagnostics", _FORMAT, text)
    parameters = {
        name: ParameterSummary(**{**summary, "interval_90": tuple(summary["interval_90"])})
        for name, summary in data["parameters"].items()
    }
    tuples: dict[str, Any] = {
        key: tuple(data[key]) for key in ("reasons", "warnings", "acceptance_fraction", "block_k_hat") if key in data
    }
    checked = data.get("spot_check")
    spot_check = SpotCheck(**{**checked, "failures": tuple(checked["failures"])}) if checked else None
    weighed = data.get("reweighting")
    reweighting = None
    if weighed:
        shifts = {name: Shift(**shift) for name, shift in weighed["shifts"].items()}
        reweighting = Reweighting(**{**weighed, "shifts": shifts, "failures": tuple(weighed["failures"])})
    read: dict[str, Any] = {
        "parameters": parameters,
        "gate": Gate(**data["gate"]),
        "spot_check": spot_check,
        "reweighting": reweighting,
    }
    if first := data.get("first_answer"):
        estimates = {name: FirstEstimate(**estimate) for name, estimate in first["parameters"].items()}
        read["first_answer"] = FirstAnswer(estimates, first["effective_draws"], first["confirmed"])
    return Diagnostics(**{**data, **tuples, **read})
