"""A posterior in, how far its headlines follow an error of what was put in, thicknesses or permittivity, out.

Each thickness is believed with an error of its own. What one gauge does to all of them, such as a micrometer that presses into
soft silicone, is in no interval, and the data tell little of it, as thinner layers feel as a stiffer silicone. A permittivity
from the data sheet of another silicone is likewise made up for by the thickness of the dielectrics. Beliefs whose medians are
moved by a share e of themselves have coordinates z about mu e, where they were standard normal or, in a lot, normal with the
covariance S. The mean of a quantity h then moves by

    d E[h] / de = cov(h, z^T S^-1 mu),   mu = dz / de at the median,                                                    (1)

over the draws of the posterior: the derivative of its mean by the location of its prior (Gustafson, Ann. Statist. 24 (1996)
174).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from calib.experiment import Experiment
from calib.problem import ParameterInfo, coordinates_of, prior_covariance
from calib.sampling import Posterior

#: Share by which what was put in is taken to be too small, where it is said what that does.
PUT_IN_ERROR = 0.01
#: What is looked at, as far as all specimens share it.
_HEADLINES = ("young_modulus", "padding_young_modulus", "relative_permittivity")
# Step in the medians for the derivative of their coordinates, as a share of them.
_STEP = 1e-4


@dataclass(frozen=True)
class PutInShift:
    """How far the mean of a quantity moves: as a share of it, and in its standard deviations."""

    share: float
    in_sd: float


def put_in_shifts(posterior: Posterior, quantities: Collection[str]) -> Mapping[str, PutInShift]:
    """How far headlines move if all of some quantities were put in too small by `PUT_IN_ERROR`: by (1), to first order.

    Parameters
    ----------
    posterior : of one model; nothing is said of an average, whose members are asked one by one.
    quantities : names, such as those of all thicknesses, which one gauge reads.

    Returns
    -------
    By name of the headline, below zero where it comes out lower; empty where the experiment says nothing of the quantities.
    """
    unknowns = posterior.unknowns
    told = [p.parameter in quantities and _is_put_in(posterior.experiment, p) for p in unknowns]
    if not any(told) or posterior.of_model is not None:
        return {}
    rate = np.array([_rate(p) if is_told else 0.0 for p, is_told in zip(unknowns, told, strict=True)])
    columns = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    z = coordinates_of(posterior, columns)[:, : len(unknowns)]
    there = np.all(np.isfinite(z), axis=1)
    score = z[there] @ np.linalg.solve(prior_covariance(posterior, len(unknowns)), rate)
    found = {}
    for k, p in enumerate(posterior.parameters):
        values = columns[there, k]
        sd = float(np.std(values)) if values.size and p.name in _HEADLINES else 0.0
        if sd > 0:
            mean = float(np.mean(values))
            moved = -PUT_IN_ERROR * float((values - mean) @ (score - np.mean(score))) / values.size  # (1)
            found[p.name] = PutInShift(moved / mean, moved / sd)
    return found


def _is_put_in(experiment: Experiment, unknown: ParameterInfo) -> bool:
    """Whether the experiment says what is believed of it."""
    own = [specimen.priors for specimen in experiment.specimens if specimen.name == unknown.specimen]
    return any(unknown.parameter in priors for priors in (experiment.priors, *own))


def _rate(unknown: ParameterInfo) -> float:
    """The mu of (1)."""
    median = float(unknown.prior.ppf_normal(0.0))
    return float(unknown.prior.to_normal(median * (1 + _STEP))) / _STEP
