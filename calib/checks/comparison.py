"""From posteriors of the same data under different models to which of them predicts these data better."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.catalogue import QUANTITIES
from calib.checks.left_out import leave_out_exactly
from calib.checks.verdict import Verdict
from calib.digits import with_uncertainty
from calib.errors import Fault, InputError
from calib.experiment import model_in_words
from calib.sampling import K_HAT, LeaveOut, Posterior
from models.response import Forward

#: A difference of elpd in units of its standard error, and by itself, above which one model is said to predict better: below 4
#: models predict alike, and the standard error is too small (Sivula, Magnusson, Matamoros & Vehtari, arXiv 2008.10296).
CLEAR, LARGE = 2.0, 4.0


@dataclass(frozen=True, eq=False)
class ComparedModel:
    """One model of the data, as compared with others of the same data.

    Attributes
    ----------
    name : of the run.
    posterior : what it found.
    left_out : how well it predicts each block of data from the others.
    behind, error : elpd of the best candidate minus its own, and the standard error of that, 0 and 0 for the best.
    """

    name: str
    posterior: Posterior
    left_out: LeaveOut
    behind: float
    error: float

    @property
    def model(self) -> str:
        """Law, contact, base, padding and forward model of the candidate in words."""
        return f"{model_in_words(self.posterior.experiment)}; {self.posterior.forward_name}"

    @property
    def young_modulus(self) -> float:
        """Mean of Young's modulus [Pa], or the value that a prior fixes."""
        found = self.posterior.diagnostics.parameters.get("young_modulus")
        return self.posterior.fixed["young_modulus"] if found is None else found.mean

    @property
    def decided(self) -> bool:
        """Whether the best candidate predicts clearly better than this one."""
        return self.behind > max(LARGE, CLEAR * self.error)

    @property
    def row(self) -> tuple[str, ...]:
        """Run, model, elpd behind the best, largest k-hat, and the values of Young's moduli and stiffening, where there are."""
        behind = "best" if self.behind == 0 else f"{self.behind:.1f} ± {self.error:.1f}"
        k_hat = f"{float(np.max(np.delete(self.left_out.k_hat, self.left_out.refitted), initial=-np.inf)):.2f}"
        values = (self.value_of(name) for name in ("young_modulus", "padding_young_modulus", "stiffening"))
        return (self.name, self.model, behind, k_hat, *values)

    def value_of(self, name: str) -> str:
        """Mean and standard deviation of a shared unknown in the unit for people, "-" where it is none of this model."""
        found = self.posterior.diagnostics.parameters.get(name)
        if found is None:
            return "-"
        row = QUANTITIES[name]
        return f"{with_uncertainty(found.mean * row.display_scale, found.sd * row.display_scale)} {row.display_unit}".rstrip()


def compare_runs(named: Sequence[tuple[str, Posterior, Forward]]) -> tuple[ComparedModel, ...]:
    """Rank posteriors of the same data by how well their models predict blocks of data that they were not fitted to.

    Each comes with its name and the forward model that it was sampled with; how blocks are left out is in
    `calib.checks.left_out`. The error of a difference is that of a sum over blocks, sqrt(n var) (Vehtari, Gelman & Gabry, Stat.
    Comput. 27 (2017) 1413, Eq. 24).

    Returns
    -------
    The candidates, best first.

    Raises
    ------
    InputError
        If the runs are of different data, or one is an average of models.
    """
    first, reference, _ = named[0]
    for name, posterior, _ in named:
        if posterior.diagnostics.models:
            raise InputError(Fault(f"{name} is an average of models itself", advice="Compare the runs that it is of"))
    for name, posterior, _ in named[1:]:
        if _data(posterior) != _data(reference):
            advice = "Calibrate both from the same lab files, with the same cycles and units"
            raise InputError(Fault(f"{name} and {first} are of different data, and cannot be compared", advice=advice))
    found = [(name, posterior, leave_out_exactly(posterior, forward)) for name, posterior, forward in named]
    best = max((loo for _, _, loo in found), key=lambda loo: loo.elpd)
    candidates = []
    for name, posterior, loo in found:
        lost = best.pointwise - loo.pointwise
        error = math.sqrt(lost.size * float(np.var(lost, ddof=1))) if loo is not best else 0.0
        candidates.append(ComparedModel(name, posterior, loo, float(np.sum(lost)), error))
    return tuple(sorted(candidates, key=lambda c: c.behind))


def _data(posterior: Posterior) -> tuple[object, ...]:
    """Everything that must be equal for two posteriors to be of the same data."""
    files = tuple((s.specimen, s.name, tuple(sha for _, sha in s.files)) for s in posterior.sweeps)
    points = tuple((name, points.value.tobytes()) for s in posterior.sweeps for name, points in s.channels.items())
    return (posterior.blocks, files, points)


def doubts(candidates: Sequence[ComparedModel]) -> list[str]:
    """List the reasons why a comparison cannot be trusted, in sentences; empty if it can."""
    found = [f"{c.name} has not converged" for c in candidates if not c.posterior.diagnostics.converged]
    found += [f"{c.name}: {reason}" for c in candidates for reason in c.posterior.diagnostics.surrogate_reasons]
    for c in candidates:
        if not c.left_out.trusted:
            bad, n = len(c.left_out.doubtful), c.left_out.k_hat.size
            found.append(f"{c.name}: k-hat is above {K_HAT:g} for {bad} of {n} blocks of data, which could not be fitted anew")
    return found


def comparison_in_words(candidates: Sequence[ComparedModel]) -> str:
    """Say which models predict the data as well as the best, what the choice between them is worth, and which are worse."""
    best, *others = candidates
    alike = [c for c in others if not c.decided]
    worse = [c for c in others if c.decided]
    if not others:
        return f"{best.name} ({best.model}) is the one model that was calibrated."
    ruled_out = "; ".join(f"{c.name} ({c.model}), {c.behind:.1f} ± {c.error:.1f} in elpd behind" for c in worse)
    if not alike:
        return f"{best.name} ({best.model}) predicts these data better than {ruled_out}."
    alike = [best, *alike]
    open_ = ", ".join(f"{c.name} ({c.model})" for c in alike)
    low, high = (choose(alike, key=lambda c: c.young_modulus) for choose in (min, max))
    said = (
        f"These data cannot tell apart {open_}. Young's modulus is {low.value_of('young_modulus')} by {low.name} and "
        f"{high.value_of('young_modulus')} by {high.name}: what is not known of the model is part of what is not known of it."
    )
    return f"{said} Worse: {ruled_out}." if worse else said


def reservations(candidates: Sequence[ComparedModel], verdicts: Mapping[str, Verdict]) -> list[str]:
    """Say what the verdicts have against the models that predict best, in sentences; those that predict worse are out anyway.

    Parameters
    ----------
    candidates : best first.
    verdicts : name of the run -> verdict on it.
    """
    found = []
    for c in candidates:
        verdict = verdicts[c.name]
        if verdict.reasons and not c.decided:
            first, *more = verdict.reasons
            besides = f"; and {len(more)} more" if more else ""
            found.append(f"The verdict on {c.name} is {verdict.colour}: {first.finding}{besides}.")
    return found


def unusable(candidates: Sequence[ComparedModel], verdicts: Mapping[str, Verdict]) -> list[str]:
    """Name those of the models that predict best of which the numbers must not be used, in a sentence each.

    Parameters
    ----------
    candidates, verdicts : as in `reservations`.
    """
    red = [c.name for c in candidates if not c.decided and verdicts[c.name].colour == "red"]
    return [f"the verdict on {name} is red: its numbers must not be used" for name in red]
