"""A problem for other optimisers and samplers: values by name and unit in, residuals, readings or a log density out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from calib.catalogue import UnknownName
from calib.errors import Fault, InputError
from calib.priors import parse_value
from calib.problem.likelihood import log_likelihood_at
from calib.problem.measurement import model_sweeps, why_outside
from calib.problem.prior import log_prior
from calib.problem.problem import Problem
from calib.problem.readings import PredictedReadings, SweepModel
from calib.problem.repeats import put_together
from calib.problem.values import coordinates_of
from models.response import OutOfRangeError
from models.sensor import FloatArray

if TYPE_CHECKING:
    import pandas as pd

#: A value in SI, or a text with its unit such as "0.7 MPa".
Value = float | str


def medians(problem: Problem) -> dict[str, float]:
    """Where to start a search: the median of every unknown's prior.

    Returns
    -------
    Name -> SI value, in the order of `problem.names`; fixed unknowns are not in it.
    """
    return {p.name: float(p.prior.ppf_normal(0.0)) for p in problem.parameters}


def residuals(problem: Problem, values: Mapping[str, Value]) -> FloatArray:
    """Misfits for a least-squares search: independent and of variance one if the values are the truth.

    For each channel of each sweep L^-1 (y - m), with y the readings, m what the instrument should read, and L L^T the
    covariance of noise, discrepancy and the forward model's own error (equation (4) of `calib.problem.measurement`) at the same
    values. Sweeps that repeat each other are taken as one, as they share errors. Where these belong to what is searched, add
    their log determinant: `log_density` has it.

    Parameters
    ----------
    problem : what is to be calibrated.
    values : name of an unknown -> its value, SI or a text with a unit; those that are not named are at their prior's median.

    Returns
    -------
    (n_point,), all points of all sweeps, in the order of `readings`.

    Raises
    ------
    InputError
        If a name is none of the problem's, or a text is no quantity of the right dimension.
    OutOfRangeError
        If the forward model does not cover these values.

    Examples
    --------
    With SciPy: ``least_squares(lambda x: residuals(problem, {"young_modulus": x[0]}), [0.7e6], x_scale=[1e5])``.
    """
    found: dict[tuple[int, str], FloatArray] = {}
    for some in put_together(problem.plans, _models(problem, values)):
        of_presses = np.split(_whitened(some.readings), np.cumsum(some.presses)[:-1])
        found |= {(k, some.repeats.channel): white for k, white in zip(some.repeats.places, of_presses, strict=True)}
    return np.concatenate([found[k, name] for k, plan in enumerate(problem.plans) for name in plan.channels])


def readings(problem: Problem, values: Mapping[str, Value]) -> pd.DataFrame:
    """What was read beside what should have been read at given values, one row for each point.

    Parameters
    ----------
    problem : what is to be calibrated.
    values : as in `residuals`.

    Returns
    -------
    Columns specimen, sweep, channel, depth (true indentation [m]), observed, predicted and sd (of one point) in the SI unit of
    the channel, and residual = (observed - predicted) / sd.

    Raises
    ------
    InputError, OutOfRangeError
        As in `residuals`.
    """
    import pandas as pd

    frames = []
    for plan, model in zip(problem.plans, _models(problem, values), strict=True):
        for name, c in model.channels.items():
            frame = {"depth": c.depth[0], "observed": c.observed, "predicted": c.mean[0], "sd": c.sd[0]}
            where = {"specimen": plan.sweep.specimen, "sweep": plan.sweep.name, "channel": name}
            frames.append(pd.DataFrame({**{k: [v] * c.observed.size for k, v in where.items()}, **frame}))
    found = pd.concat(frames, ignore_index=True)
    return found.assign(residual=(found["observed"] - found["predicted"]) / found["sd"])


def log_density(problem: Problem, values: Mapping[str, Value]) -> float:
    """Log posterior density at given values, for samplers that move in the unknowns themselves.

    log p(data | values) + log p(values) up to a constant, the prior as a density of the values in SI: log phi(z) + log |dz/dx|
    for each unknown, by central differences.

    Parameters
    ----------
    problem : what is to be calibrated.
    values : as in `residuals`.

    Returns
    -------
    -inf where a prior or the forward model does not allow the values.

    Raises
    ------
    InputError
        As in `residuals`.
    """
    columns = _columns(problem, values)
    x = np.array([[float(columns[p.name][0]) for p in problem.parameters]])
    z = coordinates_of(problem, x)
    if not np.all(np.isfinite(z)):
        return -np.inf
    steps = 1e-5
    around = [
        (p.prior.ppf_normal(z[0, k] - steps), p.prior.ppf_normal(z[0, k] + steps)) for k, p in enumerate(problem.parameters)
    ]
    slopes = np.array([float(high - low) / (2 * steps) for low, high in around])
    log_density_of_z = float(log_prior(problem, z)[0])
    return (
        log_density_of_z
        - float(np.sum(np.log(slopes)))
        + float(log_likelihood_at(problem, problem.forward, problem.plans, columns)[0])
    )


def _columns(problem: Problem, values: Mapping[str, Value]) -> dict[str, FloatArray]:
    """All values (1,) by name: those given, medians for the others, and the fixed ones."""
    known = [*problem.names, *problem.fixed]
    faults = [
        Fault(f"there is no unknown {name!r} in this problem", advice=f"There are {', '.join(known)}")
        for name in values
        if name not in known
    ]
    found = {**medians(problem), **problem.fixed}
    for name, value in values.items():
        if name in known:
            try:
                found[name] = parse_value(UnknownName.parse(name).parameter, value) if isinstance(value, str) else float(value)
            except InputError as error:
                faults += error.faults
    if faults:
        raise InputError(faults)
    return {name: np.array([value]) for name, value in found.items()}


def _models(problem: Problem, values: Mapping[str, Value]) -> list[SweepModel]:
    columns = _columns(problem, values)
    models = list(model_sweeps(problem, problem.forward, problem.plans, columns))
    for plan, model in zip(problem.plans, models, strict=True):
        if not model.covered[0]:
            why = why_outside(problem, problem.forward, plan, columns)
            raise OutOfRangeError(f"the sweep of {plan.sweep.title} is not covered at these values: {why}")
    return models


def _whitened(c: PredictedReadings) -> FloatArray:
    modes = c.modes[0]
    covariance = np.diag(c.variance[0]) + modes @ modes.T
    return np.asarray(solve_triangular(cholesky(covariance, lower=True), c.observed - c.mean[0], lower=True), dtype=float)
