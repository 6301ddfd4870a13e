"""A problem of a lot in, how far each specimen lies off what the others of its lot let one expect of it out.

Its modulus in the posterior does not tell a specimen that does not belong: it widens the spread, and so looks like one that
does. So each is held against the others alone. Of a lot whose spread is held, so wide that specimens say little of each
other, the logarithms x of their moduli are normal before the readings, with the covariance C, and after them, by one first
answer, with the mean m and the covariance V. The readings by themselves say y ± U then, and given a spread y is normal, too:

    U = (V^-1 - C^-1)^-1,   y = mu + U V^-1 (m - mu),   y ~ N(mu, U + tau^2 1 + sigma^2 J),                            (1)

mu and sigma of the lot's prior, and so is y_s given the others. The spread is taken over what the others leave of its prior.
Where a specimen lies in this predictive distribution, F(y_s), is even for those that belong, so that Phi^-1 of it is standard
normal.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtri, ndtri_exp

from calib.catalogue import SPREAD
from calib.priors import Fixed
from calib.problem import LotPrior, Problem, list_unknowns
from calib.sampling import FirstEstimate, Stranger, look_at
from models.sensor import FloatArray

# Spread of a lot whose specimens say little of each other.
_WIDE = 0.3
# Equal parts of the prior of a spread.
_PARTS = 200


def strangers_of(problem: Problem, near: Mapping[str, float]) -> tuple[Stranger, ...]:
    """Hold every specimen of a lot against the others.

    Parameters
    ----------
    problem : under partial pooling.
    near : values [SI] by name, where to look for a mode first.

    Returns
    -------
    Nothing of a specimen that is alone, or where there is no first answer.
    """
    lot = problem.table.lot
    if lot is None or lot.columns.size < 2:
        return ()
    experiment = replace(problem.experiment, priors={**problem.experiment.priors, SPREAD: Fixed(_WIDE)})
    parameters, fixed = list_unknowns(experiment, problem.sweeps)
    loose = replace(problem, experiment=experiment, parameters=parameters, fixed=fixed)
    try:
        look = look_at(loose, near)
    except ValueError:
        return ()
    before = loose.table.lot
    if before is None:
        return ()
    width = math.log(before.prior.own.factor)
    z = look.theta[:, before.columns]
    mean = look.weight @ z
    after = ((z - mean).T * look.weight) @ (z - mean)
    told = np.linalg.inv(after) - np.linalg.inv(before.prior.covariance(mean.size))
    if np.min(np.linalg.eigvalsh(told)) <= 0:  # of some specimen the readings say nothing
        return ()
    error = np.linalg.inv(told)
    names = [parameters[k].specimen for k in before.columns]
    return tuple(held_against_others(lot.prior, names, width * error @ np.linalg.solve(after, mean), width**2 * error))


def held_against_others(lot: LotPrior, names: Sequence[str], away: FloatArray, error: FloatArray) -> Iterator[Stranger]:
    """Hold each specimen against the others by (1).

    Parameters
    ----------
    lot : what is believed of it.
    names : of the specimens.
    away, error : y - mu (n_specimen,) and U (n_specimen, n_specimen).

    Yields
    ------
    One for each specimen.
    """
    spread = lot.spread.ppf_normal(ndtri((np.arange(_PARTS) + 0.5) / _PARTS))
    whole = error + lot.sd**2 + spread[:, None, None] ** 2 * np.eye(len(names))
    for s, name in enumerate(names):
        others = np.delete(np.arange(len(names)), s)
        known, across = whole[:, others[:, None], others], whole[:, others, s]
        gain = np.linalg.solve(known, across[..., None])[..., 0]
        expected = gain @ away[others]
        width = np.sqrt(whole[:, s, s] - np.sum(gain * across, axis=1))
        told = np.linalg.solve(known, np.broadcast_to(away[others], (_PARTS, others.size))[..., None])[..., 0]
        log_weight = -0.5 * (told @ away[others] + np.linalg.slogdet(known)[1])
        log_weight -= logsumexp(log_weight)
        below, above = (float(logsumexp(log_weight + log_ndtr(side * (away[s] - expected) / width))) for side in (1, -1))
        z = float(ndtri_exp(min(below, 0.0))) if below < above else -float(ndtri_exp(min(above, 0.0)))
        weight = np.exp(log_weight)
        middle = float(weight @ expected)
        sd = float(np.sqrt(weight @ (width**2 + (expected - middle) ** 2)))
        ratio = float(np.exp(away[s] - middle))
        yield Stranger(name, FirstEstimate(ratio, ratio * sd), z)
