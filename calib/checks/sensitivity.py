"""A posterior in, how much its headline quantities hang on what was believed before the data out: by power-scaling.

Draws get the weights that make them draws under a slightly stronger or weaker prior, or likelihood,

    w_i ~ p(theta_i)^(alpha - 1)   or   w_i ~ p(y | theta_i)^(alpha - 1),                                              (1)

smoothed (PSIS). Sensitivity is how far the distribution of a quantity moves for each doubling of alpha, at alpha = 1, in the
cumulative Jensen-Shannon distance (Kallioinen, Paananen, Buerkner & Vehtari, Stat. Comput. 34 (2024) 57, section 2): above 0.05
it is sensitive. What hangs on both counts as a conflict there. With priors that are measurements, such as a thickness under a
microscope, most quantities hang on both in a sound lab, too. So here the mean has to move as well, and further than it does in
labs whose truth was drawn from the priors. There the posterior means m of the coordinates z vary as what the data taught,
cov(m) = 1 - V, with V their posterior covariance, and the shift of the mean of a quantity h for each factor e in alpha,

    s = -cov(h, z^T z / 2) = -c^T m,   c = cov(h, z),   varies with   c^T (1 - V) c.                                   (2)

Powers are taken of beliefs on sensor and rig, in the coordinate z in which each is standard normal: twice as strong is narrower
by a root of two about its median, whatever its kind. Noises and discrepancies, which say how far readings scatter about a
model, stay as they are, as they have a gate of their own; and so does what is as it happened to be set up: contact, load zero
and clock.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from calib.catalogue import SCALES, UNKNOWNS
from calib.problem import ParameterInfo, coordinates_of, log_prior, prior_covariance
from calib.sampling import K_HAT, Posterior, Pull, Sensitivity, smooth_weights
from models.sensor import FloatArray, IntArray

#: Quantities that a calibration is made for, in the order in which they are looked at.
HEADLINES = (
    "young_modulus",
    "padding_young_modulus",
    "relative_permittivity",
    "sensor_thickness",
    "padding_thickness",
    "dielectric_thickness",
)
# A headline of some specimen is pulled so far in so many sound labs; those of one specimen go together.
_RATE = 2e-2
# By how much powers differ from 1, and how many of the foremost priors are told.
_STEP, _TOLD = 0.01, 3
# Draws that are looked at: more make no difference.
_DRAWS = 4000


def with_sensitivity(posterior: Posterior) -> Posterior:
    """The same draws, with how much headlines hang on what was believed before in the diagnostics."""
    return replace(posterior, diagnostics=replace(posterior.diagnostics, sensitivity=sensitivity_of_headlines(posterior)))


def sensitivity_of_headlines(posterior: Posterior) -> dict[str, Sensitivity]:
    """How much each headline quantity of a posterior hangs on what was believed before the data; empty where nothing was."""
    columns = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    every = max(1, len(columns) // _DRAWS)
    columns, log_prob = columns[::every], posterior.log_prob.reshape(-1)[::every]
    unknowns = posterior.unknowns
    theta = coordinates_of(posterior, columns)[:, : len(unknowns)]
    log_likelihood = log_prob - log_prior(posterior, theta)
    theta = _independent(posterior, theta)
    there = np.isfinite(log_likelihood)
    beliefs = [k for k, p in enumerate(unknowns) if is_belief(p)]
    headlines = {p.name: columns[there, k] for k, p in enumerate(posterior.parameters) if p.parameter in HEADLINES}
    if not beliefs or not headlines or np.count_nonzero(there) < 2:
        return {}
    known = posterior.diagnostics.parameters
    ess = {name: float(np.clip(np.nan_to_num(known[name].ess_bulk), 1.0, np.sum(there))) for name in headlines}
    names = [posterior.parameters[k].name for k in beliefs]
    limit = pull_limit(len(posterior.experiment.specimens))
    return sensitivities(headlines, names, theta[there][:, beliefs], log_likelihood[there], ess, limit)


def _independent(posterior: Posterior, theta: FloatArray) -> FloatArray:
    """Coordinates (n_draw, n) that are independent before the data: those of specimens of one lot are alike."""
    if not posterior.table.lots:
        return theta
    value, vector = np.linalg.eigh(prior_covariance(posterior, theta.shape[1]))
    return np.asarray(theta @ (vector / np.sqrt(value)) @ vector.T, dtype=float)


def pull_limit(n_specimen: int) -> float:
    """How far beliefs may pull a headline, in what they do in sound labs, before they contradict the data.

    >>> round(pull_limit(2), 1)
    2.6
    """
    return -float(ndtri(_RATE / (2 * n_specimen)))


def is_belief(unknown: ParameterInfo) -> bool:
    """Whether the prior of an unknown says what is believed of sensor or rig, and so is one whose power is taken."""
    return UNKNOWNS[unknown.parameter].scope != "sweep" and unknown.parameter not in SCALES


def sensitivities(
    quantities: Mapping[str, FloatArray],
    names: Sequence[str],
    theta: FloatArray,
    log_likelihood: FloatArray,
    ess: Mapping[str, float],
    limit: float,
) -> dict[str, Sensitivity]:
    """How much quantities hang on priors and on the likelihood, from draws of a posterior.

    Parameters
    ----------
    quantities : by name, their values (n_draw,).
    names : of the unknowns whose priors are scaled.
    theta : (n_draw, n_name), draws of these unknowns, in the coordinates z of their priors.
    log_likelihood : (n_draw,), up to a constant.
    ess : effective draws of each quantity, which tell how exact its mean is.
    limit : from `pull_limit`.

    Returns
    -------
    By name of the quantity.
    """
    single = -0.5 * theta**2
    log_prior = np.sum(single, axis=1)
    efficiency = min(1.0, min(ess.values()) / len(theta))
    all_priors, likelihood = (_perturbed(log_density, efficiency) for log_density in (log_prior, log_likelihood))
    centre, spread = np.mean(theta, axis=0), np.atleast_2d(np.cov(theta.T))
    taught = np.eye(len(names)) - spread
    of_single: dict[int, _Perturbed] = {}
    found = {}
    for name, values in quantities.items():
        sd = float(np.std(values))
        if not sd > 0:
            continue
        x = (values - np.mean(values)) / sd
        own = x @ (single - np.mean(single, axis=0)) / len(x)
        wider = 0.5 * (x**2 @ (single - np.mean(single, axis=0))) / len(x)  # relative slope of the standard deviation
        foremost = np.argsort(-np.hypot(own, wider))[:_TOLD]
        for k in foremost:
            if k not in of_single:
                of_single[k] = _perturbed(single[:, k], efficiency)
        order = np.argsort(x)
        slopes = x @ theta / len(x)
        pulled = -float(slopes @ centre)
        # (2), and how far its second term is known from so many draws.
        chance = max(float(slopes @ taught @ slopes), 0.0) + math.sqrt(2 / ess[name]) * float(slopes @ spread @ slopes)
        found[name] = Sensitivity(
            prior=_sensitivity(x, order, all_priors),
            likelihood=_sensitivity(x, order, likelihood),
            shift=math.log(2) * float(np.sum(own)),
            z=pulled / math.sqrt(chance) if chance > 0 else 0.0,
            pulls=tuple(Pull(names[k], _sensitivity(x, order, of_single[k]), math.log(2) * float(own[k])) for k in foremost),
            k_hat=max(all_priors.k_hat, likelihood.k_hat),
            limit=limit,
        )
    return found


@dataclass(frozen=True, eq=False)
class _Perturbed:
    """Weights (n_draw,) by (1) at a power below 1 and at one above, and the worse k-hat of the two."""

    weights: tuple[FloatArray, FloatArray]
    k_hat: float


def _perturbed(log_density: FloatArray, efficiency: float) -> _Perturbed:
    powers = (1 / (1 + _STEP), 1 + _STEP)
    pairs = [smooth_weights((power - 1) * log_density, relative_efficiency=efficiency) for power in powers]
    return _Perturbed((pairs[0][0], pairs[1][0]), max(k_hat for _, k_hat in pairs))


def _sensitivity(x: FloatArray, order: IntArray, perturbed: _Perturbed) -> float:
    """Distance from the draws x for each doubling of a power; nan where the weights cannot be trusted."""
    if not perturbed.k_hat <= K_HAT:
        return math.nan
    distances = [cumulative_distance(x[order], weights[order]) for weights in perturbed.weights]
    return sum(distances) / (2 * math.log2(1 + _STEP))


def cumulative_distance(x: FloatArray, weights: FloatArray) -> float:
    """How far weights move the distribution of draws: the cumulative Jensen-Shannon distance, from 0 to 1.

    With the distribution functions P of the draws and Q of the weighted ones, M their mean, the root of

        int P log2(P / M) + Q log2(Q / M) dx / int P + Q dx,

    the greater of that and the same of -x (Nguyen & Vreeken, ECML PKDD 2015, 173; Kallioinen et al., section 2.4).

    Parameters
    ----------
    x : (n,), the draws, ascending.
    weights : (n,), of sum 1.
    """
    widths = np.diff(x)
    p = np.arange(1, x.size) / x.size
    q = np.clip(np.cumsum(weights)[:-1], 0.0, 1.0)
    return max(_distance(p, q, widths), _distance(1 - p, 1 - q, widths))


def _distance(p: FloatArray, q: FloatArray, widths: FloatArray) -> float:
    m = (p + q) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = [np.where(f > 0, f * np.log2(f / m), 0.0) for f in (p, q)]
    whole = float(widths @ (p + q))
    return math.sqrt(max(float(widths @ (terms[0] + terms[1])), 0.0) / whole) if whole > 0 else 0.0
