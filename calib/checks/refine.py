"""From a posterior sampled with a surrogate to what finite elements at its draws say: points to run, error, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.catalogue import QUANTITIES
from calib.checks.reweighting import problem_of
from calib.checks.spotcheck import Comparison, rms
from calib.digits import with_uncertainty
from calib.errors import Fault, InputError
from calib.problem import coordinates_of, log_posterior, specimen_design
from calib.sampling import Posterior, Reweighting
from models.response import Forward
from models.sensor import FloatArray
from models.surrogate.domain import group_names, groups_of
from models.surrogate.families import Family
from models.surrogate.surrogate import Surrogate

#: Log densities of draws may be off by this much where the same surrogate computes them again.
_SAME = 0.05

# Draws at which that is looked at.
_N_SAME = 16


def require_own_surrogate(posterior: Posterior, forward: Forward) -> Surrogate:
    """Make sure that a forward model is the surrogate that a posterior was sampled with: only then do weights mean anything.

    Parameters
    ----------
    posterior : as loaded.
    forward : the model that is said to be its.

    Returns
    -------
    `forward`, as a surrogate.

    Raises
    ------
    InputError
        If the posterior is that of another model, or `forward` gives its draws another density than they were sampled with.
    """
    path = posterior.experiment.path
    if posterior.diagnostics.models:
        raise InputError(Fault(f"the run is an {posterior.forward_name}", path, advice="Refine the runs that it is of"))
    if not isinstance(forward, Surrogate) or posterior.forward_name != forward.name:
        advice = 'There is nothing to refine; only model = "surrogate" has a surrogate'
        raise InputError(Fault(f"the run was calibrated with the {posterior.forward_name}", path, advice=advice))
    flat, sampled = posterior.draws.reshape(-1, posterior.draws.shape[-1]), posterior.log_prob.ravel()
    some = np.linspace(0, len(flat) - 1, _N_SAME).astype(int)
    problem = problem_of(posterior, forward)
    theta = coordinates_of(problem, flat[some, : len(problem.parameters)])
    off = np.abs(log_posterior(problem, theta) - sampled[some])
    if not np.all(off < _SAME):
        told = f"up to {np.max(off):.3g} off in log density" if np.all(np.isfinite(off)) else "some draws are not covered"
        advice = "Calibrate again with this surrogate, or put the earlier file back"
        message = f"the surrogate has changed since the run was calibrated with it ({told})"
        raise InputError(Fault(message, path, advice=advice))
    return forward


def training_points(posterior: Posterior, values: Mapping[str, FloatArray], family: Family) -> FloatArray:
    """Find where in its groups a surrogate has to be refined for a posterior: the points that draws stand for.

    Parameters
    ----------
    posterior : whose specimens and balls count.
    values : draws, parameter name -> SI values (n_draw,), fixed ones included.
    family : that of the surrogate.

    Returns
    -------
    (n, n_group), in the coordinates of `models.surrogate.training`: every draw of every specimen under every ball, each once.
    """
    pressed = {(s.specimen, s.indenter_radius): s for s in posterior.sweeps}.values()
    designs = (specimen_design(posterior, values, s.specimen, s.name).draws() for s in pressed)
    groups = [groups_of(design, family)[:, : len(group_names(family))] for design in designs]
    return np.unique(np.concatenate(groups), axis=0)


def error_rows(comparisons: Sequence[Comparison]) -> list[tuple[str, str, str, str, str, str]]:
    """List how far the surrogate is off the finite elements, as rows of a table for people.

    Columns: sweep, quantity and curves, median, 95 % and worst absolute relative error, rms of error over stated sd.
    """
    rows = []
    for c in comparisons:
        for name, error, score in (
            ("force", c.force_error, c.force_score),
            ("capacitance change", c.change_error, c.change_score),
        ):
            size = np.abs(error)
            median, most, worst = (f"{100 * np.quantile(size, q):.2f} %" if size.size else "none" for q in (0.5, 0.95, 1.0))
            score_rms = f"{rms(score):.2f}" if size.size else "none"
            rows.append((c.sweep, f"{name}, {len(error)} curves", median, most, worst, score_rms))
    return rows


def shift_rows(posterior: Posterior, found: Reweighting) -> list[tuple[str, str, str, str, str]]:
    """List what re-weighting does to each parameter, as rows of a table for people.

    Parameters
    ----------
    posterior : whose parameters are listed.
    found : its re-weighting.

    Returns
    -------
    Columns: parameter, mean and sd as they are and re-weighted, their unit, shift of the mean in sd with its error.
    """
    rows = []
    for p in posterior.parameters:
        s, unit = found.shifts[p.name], QUANTITIES[p.parameter]
        k = unit.display_scale
        before, after = (with_uncertainty(m * k, sd * k) for m, sd in ((s.mean, s.sd), (s.weighted_mean, s.weighted_sd)))
        rows.append((p.name, before, after, unit.display_unit, f"{s.shift:+.2f} ± {s.error:.2f}"))
    return rows


def stands(posterior: Posterior, found: Reweighting) -> bool:
    """Whether a posterior need not be sampled again with a better model.

    Parameters
    ----------
    posterior : with its diagnostics.
    found : its re-weighting.
    """
    return posterior.diagnostics.usable and found.passed


def refinement_in_words(posterior: Posterior, found: Reweighting) -> str:
    """Say in one sentence whether to sample the posterior again, and why.

    Parameters
    ----------
    posterior, found : as in `stands`.
    """
    if stands(posterior, found):
        return f"The posterior stands: {found.in_words()}."
    if not posterior.diagnostics.converged:
        return f"Run the posterior again: it has not converged; {found.in_words()}."
    why = "; ".join((*posterior.diagnostics.surrogate_reasons, found.in_words()))
    return f'Run the posterior again, with a better surrogate (-o) or model = "fem": {why}.'
