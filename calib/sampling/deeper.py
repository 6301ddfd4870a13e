"""A calibration's discrepancies in, what a calibration with a deeper press will take them to be out, if the first is right.

What a model leaves out of presses stays alike over a share of the deepest of those that repeat each other
(`calib.problem.plan`). A calibration with a deeper one so takes the misfit of the same sensor to be smoother than the first
does, finds it rougher, and therefore larger. Readings with the covariance S_1 = B + W_1 W_1^T, taken to have that of
S_2(c) = B + c^2 W_2 W_2^T, W_2 W_2^T the discrepancy as large as now, are most probable in the mean with the c that makes

    log det S_2(c) + tr(S_2(c)^-1 S_1)                                                                                (1)

least, which is 1 if the two are the same (the Kullback-Leibler divergence; White, Econometrica 50 (1982) 1).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calib.catalogue import SCALES
from calib.problem import Problem, Together, correlation_between, model_sweeps, put_together, values_at
from calib.sampling.laplace import weighed
from models.response import OutOfRangeError
from models.sensor import FloatArray

# Factors c that are tried, 1 among them: 0.5 to 20.
_FACTORS = np.exp(0.05 * np.arange(-14, 61))
# No discrepancy is found beyond where its prior hardly goes, in its standard deviations.
_MOST = 4.0
# Added to the diagonal of a correlation so that it has a root.
_JITTER = 1e-9


def discrepancies_with(problem: Problem, at: FloatArray, draws: FloatArray) -> FloatArray:
    """Say how large discrepancies will be found with the last sweep of a problem, by draws that do without it.

    Parameters
    ----------
    problem : with the sweep, which is deeper than those that it repeats.
    at : (n_unknown,), coordinates z of all that are no scales.
    draws : (n_draw, n_unknown), of which the scales alone are taken.

    Returns
    -------
    The draws with other discrepancies, (n_draw, n_unknown); the same if the sweep repeats none, or is no deeper.

    Raises
    ------
    OutOfRangeError
        If the forward model does not cover a sweep.
    """
    last = len(problem.plans) - 1
    scales = np.array([info.parameter in SCALES for info in problem.parameters])
    values = values_at(problem, np.where(scales, draws, at))
    models = model_sweeps(problem, problem.forward, problem.plans, values)
    divergence: dict[str, FloatArray] = {}
    for some in put_together(problem.plans, models):
        if not np.all(some.covered):
            raise OutOfRangeError(f"the {problem.forward.name} does not cover the presses")
        if some.readings.discrepancy is not None:
            name = some.repeats.channel
            own = _divergence(some, deeper=some.repeats.places[-1] == last and len(some.presses) > 1)
            divergence[name] = divergence.get(name, 0.0) + own
    found = draws.copy()
    for k, info in enumerate(problem.parameters):
        for name, of_factors in divergence.items():
            if info.parameter == f"{name}_discrepancy":
                factor = _FACTORS[np.argmin(of_factors, axis=1)]
                larger = info.prior.to_normal(factor * info.prior.ppf_normal(draws[:, k]))
                most = np.maximum(draws[:, k], _MOST)
                found[:, k] = np.where(factor == 1, draws[:, k], np.fmin(larger, most))
    return found


def _divergence(some: Together, *, deeper: bool) -> FloatArray:
    """(1) but for what does not hang on c, (n_draw, n_factor); of readings whose correlation stays as it is if not `deeper`."""
    own = some.readings.discrepancy
    assert own is not None
    taken = own.sd[..., None] * own.correlation.modes
    n = taken.shape[-1]
    is_so = own.sd[..., None] * _roots_by_the_others(some) if deeper else taken
    without = replace(some.readings, discrepancy=None, variance=some.readings.variance - own.sd**2 * own.correlation.rest)
    product = weighed(without, np.concatenate([taken, is_so], axis=-1))[0]
    value, vector = np.linalg.eigh(product[:, :n, :n])
    value = np.maximum(value, 0.0)
    across = np.sum((np.swapaxes(vector, 1, 2) @ product[:, :n, n:]) ** 2, axis=-1)
    squared = _FACTORS[:, None] ** 2
    inner = 1 + squared * value[:, None]
    return np.asarray(np.sum(np.log(inner) - squared * (value + across)[:, None] / inner, axis=-1), dtype=float)


def _roots_by_the_others(some: Together) -> FloatArray:
    """Triangular roots of the correlation at all points, over the length by the presses but the last, (n_draw, n, n)."""
    depth = some.readings.depth
    share = depth / np.max(depth[:, : -some.presses[-1]], axis=1, keepdims=True)
    correlation = correlation_between(share, share)
    return np.asarray(np.linalg.cholesky(correlation + _JITTER * np.eye(depth.shape[1])), dtype=float)
