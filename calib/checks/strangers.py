"""A problem of a lot in, how far each specimen lies off what the others of its lot let one expect of it out.

Its value in the posterior does not tell a specimen that does not belong: it widens the spread, and so looks like one that
does. So each is held against the others alone, in one quantity after the other, the modulus say. Of a lot whose spread of it is
held, so wide that specimens say little of each other, their coordinates x (`calib.problem.lots`) are normal before anything is
known of a specimen, with the covariance C and the mean 0, and after the readings, by one first answer, with the mean m and the
covariance V. What is known of specimens by themselves, by the readings and by a microscope, says y ± U then, and given a spread
y is normal, too:

    U = (V^-1 - C^-1)^-1,   y = U V^-1 m,   y ~ N(0, U + tau^2 1 + sigma^2 J),                                         (1)

sigma of the lot's prior, and so is y_s given the others. The spread is taken over what the others leave of its prior.
Where a specimen lies in this predictive distribution, F(y_s), is even for those that belong, so that Phi^-1 of it is standard
normal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtri, ndtri_exp

from calib.catalogue import spread_of
from calib.checks.looks import look_near
from calib.priors import Fixed
from calib.problem import Lot, Problem, list_unknowns
from calib.sampling import FirstEstimate, Stranger
from models.sensor import FloatArray

# Spread of a lot whose specimens say little of each other.
_WIDE = 0.3
# Equal parts of the prior of a spread.
_PARTS = 200


def strangers_of(problem: Problem, near: Mapping[str, float], quantity: str) -> tuple[Stranger, ...]:
    """Hold every specimen of a lot against the others.

    Parameters
    ----------
    problem : under partial pooling.
    near : values [SI] by name, where to look for a mode first.
    quantity : that is pooled.

    Returns
    -------
    Nothing of a specimen that is alone, or where there is no first answer.
    """
    lot = next(lot for lot in problem.table.lots if lot.quantity == quantity)
    if lot.columns.size < 2:
        return ()
    experiment = replace(problem.experiment, priors={**problem.experiment.priors, spread_of(quantity): Fixed(_WIDE)})
    parameters, fixed = list_unknowns(experiment, problem.sweeps)
    loose = replace(problem, experiment=experiment, parameters=parameters, fixed=fixed)
    look = look_near(loose, near)
    if look is None:
        return ()
    before = next(lot for lot in loose.table.lots if lot.quantity == quantity)
    x = before.prior.away(look.theta[:, before.columns])
    mean = look.weight @ x
    after = ((x - mean).T * look.weight) @ (x - mean)
    of_lot = before.prior.sd**2 + _WIDE**2 * np.eye(mean.size)
    told = np.linalg.inv(after) - np.linalg.inv(of_lot)
    if np.min(np.linalg.eigvalsh(told)) <= 0:  # of some specimen nothing is known
        return ()
    error = np.linalg.inv(told)
    names = [parameters[k].specimen for k in before.columns]
    return tuple(held_against_others(lot, names, error @ np.linalg.solve(after, mean), error))


def held_against_others(lot: Lot, names: Sequence[str], away: FloatArray, error: FloatArray) -> Iterator[Stranger]:
    """Hold each specimen against the others by (1).

    Parameters
    ----------
    lot : what is believed of it.
    names : of the specimens.
    away, error : y (n_specimen,) and U (n_specimen, n_specimen).

    Yields
    ------
    One for each specimen.
    """
    prior = lot.prior
    spread = prior.spread.ppf_normal(ndtri((np.arange(_PARTS) + 0.5) / _PARTS))
    whole = error + prior.sd**2 + spread[:, None, None] ** 2 * np.eye(len(names))
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
        value, wanted, above_it = (float(v) for v in prior.at(np.array([away[s], middle, middle + sd])))
        yield Stranger(name, FirstEstimate(value / wanted, value / wanted * (above_it / wanted - 1)), z, lot.quantity)
