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

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from calib.catalogue import QUANTITIES
from calib.problem import ParameterInfo
from calib.records import record_from_text, record_to_text
from calib.sampling.archive import LeaveOut, effective_sample_size, leave_blocks_out, rank_r_hat
from calib.sampling.findings import (
    Averaged,
    Departure,
    FirstAnswer,
    FirstEstimate,
    Foretold,
    ParameterSummary,
    Pull,
    Reweighting,
    Sensitivity,
    Shift,
    SpotCheck,
    Stranger,
)
from calib.sampling.layout import chain_order
from models.sensor import FloatArray

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Convergence", "Diagnostics", "Gate", "LeaveOut", "convergence", "leave_blocks_out", "summarise"]


#: A draw whose deepest point lies beyond this share of the forward model's range touches its end; more than this share of such
#: draws is worth a warning.
RANGE_TOUCH = 0.98
RANGE_TOUCH_SHARE = 0.01


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
    departures : how well models that differ in one choice describe the data; empty if that was not looked at.
    without_discrepancy : how well noise alone describes what the model leaves; None if it has no discrepancy, or not looked at.
    foretold : how well specimens are predicted by the others; empty if there is one specimen, or it was not looked at.
    models : that the draws are an average over; empty for those of one model.
    strangers : how far specimens lie off the others of their lot; empty under complete pooling, and as for `foretold`.
    block_k_hat : how much each block of data pulls the posterior by itself, k-hat of leaving it out (PSIS); empty if not known.
    block_z : how far each block of data is off what all others foretell, in standard deviations; empty if not looked at.
    sensitivity : how much headline quantities hang on what was believed before, by name; empty if that was not looked at.
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
    departures: tuple[Departure, ...] = ()
    without_discrepancy: Departure | None = None
    foretold: tuple[Foretold, ...] = ()
    models: tuple[Averaged, ...] = ()
    strangers: tuple[Stranger, ...] = ()
    block_k_hat: tuple[float, ...] = ()
    block_z: tuple[float, ...] = ()
    sensitivity: Mapping[str, Sensitivity] = field(default_factory=dict)

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


def range_warning(touching: float, forward: str) -> str:
    """Warn that draws of a posterior lie close to the end of the range that the forward model covers.

    Parameters
    ----------
    touching : share of the draws that do.
    forward : name of the model.
    """
    return (
        f"in {100 * touching:.0f} % of the draws the deepest point lies within 2 % of the end of what the {forward} covers: "
        "the posterior may be cut off there"
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
        key: tuple(data[key]) for key in ("reasons", "warnings", "acceptance_fraction", "block_k_hat", "block_z") if key in data
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
        read["first_answer"] = FirstAnswer(**{**first, "parameters": estimates})
    read["departures"] = tuple(Departure(**{**d, **_modulus(d)}) for d in data.get("departures", ()))
    if plain := data.get("without_discrepancy"):
        read["without_discrepancy"] = Departure(**{**plain, **_modulus(plain)})
    read["models"] = tuple(Averaged(**{**m, **_modulus(m), "interval": tuple(m["interval"])}) for m in data.get("models", ()))
    read["foretold"] = tuple(Foretold(**{**f, "ratio": FirstEstimate(**f["ratio"])}) for f in data.get("foretold", ()))
    read["sensitivity"] = {
        name: Sensitivity(**{**s, "pulls": tuple(Pull(**pull) for pull in s["pulls"])})
        for name, s in data.get("sensitivity", {}).items()
    }
    read["strangers"] = tuple(Stranger(**{**s, "ratio": FirstEstimate(**s["ratio"])}) for s in data.get("strangers", ()))
    kept = {key: value for key, value in data.items() if key != "apart"}  # which earlier versions had in place of `foretold`
    return Diagnostics(**{**kept, **tuples, **read})


def _modulus(data: Mapping[str, Any]) -> dict[str, FirstEstimate | None]:
    """Young's modulus under a model, as it is kept with it."""
    found = data["young_modulus"]
    return {"young_modulus": None if found is None else FirstEstimate(**found)}
