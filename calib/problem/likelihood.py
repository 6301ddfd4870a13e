"""An experiment, its sweeps and a forward model in, a vectorised log posterior over the unknowns out.

The measurement model and its covariance are those of `calib.problem.measurement`; equation numbers refer to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from calib.lab import Sweep
from calib.problem.density import blocks_of, level_of_blocks, log_normal_blocks
from calib.problem.measurement import model_sweep, model_sweeps, ways_down
from calib.problem.plan import SweepPlan, without_points
from calib.problem.prior import log_prior
from calib.problem.problem import Problem
from calib.problem.readings import PredictedReadings, SweepModel
from calib.problem.repeats import log_normal_sweeps, put_together, repeats_of
from calib.problem.values import Calibrated, values_at
from models.response import Forward
from models.sensor import FloatArray, IntArray

#: Version of what the log posterior is at given unknowns and data. Raise it with every change that moves its values by more
#: than rounding (measurement model, covariance, priors' coordinates, default priors aside, which are hashed themselves), so
#: that no chain of the earlier density is continued with the later one.
LIKELIHOOD_VERSION = 5

# Draws evaluated together: what is computed of one sweep stays in the processor's cache.
_TOGETHER = 320
# Sweeps that repeat each other of which the models of so many draws are held; of more sweeps, of fewer draws.
_HELD = 20


def log_posterior(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log posterior density of draws of the unknowns: how probable they are after the data, which is what the sampler explores.

    log p(theta | data) = log likelihood - theta^T theta / 2, up to a constant: the prior is standard normal in theta, but for
    what makes specimens of one lot alike (`log_prior`).

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw,); -inf where `log_likelihood` is.
    """
    return np.asarray(log_likelihood(problem, theta) + log_prior(problem, theta), dtype=float)


def log_likelihood(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log likelihood of draws of the unknowns: how probable the readings of all sweeps are under them.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw,); -inf for a draw whose design is invalid (a dielectric thicker than half the sensor, an electrode wider than the
    disc) or whose largest depth or force the forward model does not cover.
    """
    return log_likelihood_at(problem, problem.forward, problem.plans, values_at(problem, theta))


def log_likelihood_sweeps(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log likelihood of draws of the unknowns, sweep by sweep.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw, n_sweep), in the order of `problem.sweeps`; -inf where the draw is not covered at the sweep. Sweeps that repeat
    each other are not independent: the density of a channel in all of them stands at the last.
    """
    return _by_sweep(problem, problem.forward, problem.plans, values_at(problem, theta), None)


def log_likelihood_at(
    known: Calibrated,
    forward: Forward,
    plans: Sequence[SweepPlan],
    values: Mapping[str, FloatArray],
    tables: Sequence[FloatArray | None] | None = None,
) -> FloatArray:
    """Log likelihood of given sweeps at given values under any forward model, such as finite elements for the surrogate.

    Parameters
    ----------
    known : the experiment and all its sweeps: a `Problem` or a `Posterior`.
    forward : the model of the sensor.
    plans : the sweeps to sum over, from `plan_sweeps`.
    values : parameter name -> SI values (n_draw,), fixed ones included.
    tables : one for each plan, see `model_sweep`.

    Returns
    -------
    (n_draw,); -inf as in `log_likelihood`.
    """
    return np.asarray(np.sum(_by_sweep(known, forward, plans, values, tables), axis=1), dtype=float)


def _by_sweep(
    known: Calibrated,
    forward: Forward,
    plans: Sequence[SweepPlan],
    values: Mapping[str, FloatArray],
    tables: Sequence[FloatArray | None] | None,
) -> FloatArray:
    """Log likelihood as in `log_likelihood_sweeps`, (n_draw, n_sweep)."""
    n_draw = next(iter(values.values())).size
    found = np.full((n_draw, len(plans)), -np.inf)
    for first in range(0, n_draw, _TOGETHER):
        part = slice(first, first + _TOGETHER)
        some = values if n_draw <= _TOGETHER else {name: value[part] for name, value in values.items()}
        cut = tables and [None if table is None else table[part] for table in tables]
        for k, column in enumerate(log_normal_sweeps(plans, model_sweeps(known, forward, plans, some, cut))):
            found[part, k] = column
    return found


def log_likelihood_blocks(problem: Problem, theta: FloatArray) -> FloatArray:
    """Log density of each block of about eight neighbouring points given all other data, by which models are compared.

    log p(y_b | y_-b, theta), with the channel's covariance (4): see `calib.problem.density.log_normal_blocks`.
    This is what leave-block-out needs where residuals are correlated; only without correlation do the blocks add up to
    `log_likelihood`.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw, n_block), in the order of `block_names`; -inf for draws that are not covered.
    """
    return _of_blocks(problem, theta, log_normal_blocks, -np.inf)


def levels_of_blocks(problem: Problem, theta: FloatArray) -> FloatArray:
    """How far each block of about eight neighbouring points is off what all other data and a draw foretell.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    (n_draw, n_block), in the order of `block_names`, in standard deviations, see `calib.problem.density.level_of_blocks`; nan
    for draws that are not covered.
    """
    return _of_blocks(problem, theta, level_of_blocks, np.nan)


def _of_blocks(
    problem: Problem,
    theta: FloatArray,
    of_channel: Callable[[PredictedReadings, Sequence[int]], FloatArray],
    uncovered: float,
) -> FloatArray:
    """What a function says of the blocks of a channel, of all of them, (n_draw, n_block)."""
    values = values_at(problem, theta)
    found = np.full((theta.shape[0], len(block_names(problem))), uncovered)
    columns = _columns_of_blocks(problem.plans)
    most = max((len(repeats.places) for repeats in repeats_of(problem.plans)), default=1)
    count = max(1, _TOGETHER * _HELD // max(most, _HELD))
    for first in range(0, theta.shape[0], count):
        part = slice(first, first + count)
        models = model_sweeps(problem, problem.forward, problem.plans, {n: v[part] for n, v in values.items()})
        for some in put_together(problem.plans, models):
            of_presses = [columns[k, some.repeats.channel] for k in some.repeats.places]
            rows = first + np.flatnonzero(some.covered)
            found[rows[:, None], np.concatenate(of_presses)] = of_channel(some.readings, some.presses)
    return found


def _columns_of_blocks(plans: Sequence[SweepPlan]) -> dict[tuple[int, str], IntArray]:
    """Numbers of the blocks of each channel of each sweep, by the number of the sweep and the name of the channel."""
    found: dict[tuple[int, str], IntArray] = {}
    first = 0
    for k, plan in enumerate(plans):
        for name, points in plan.sweep.channels.items():
            n = len(blocks_of(points.value.size))
            found[k, name] = first + np.arange(n)
            first += n
    return found


def block_names(problem: Problem) -> tuple[str, ...]:
    """Names of the blocks of `log_likelihood_blocks`: specimen, sweep, channel and number."""
    names = []
    for plan in problem.plans:
        for channel, points in plan.sweep.channels.items():
            names += [f"{plan.sweep.title}, {channel} {k + 1}" for k in range(len(blocks_of(points.value.size)))]
    return tuple(names)


def channel_of_block(name: str) -> str:
    """Specimen, sweep and channel that a block is of, from its name in `block_names`."""
    return name.rpartition(" ")[0]


def without_block(problem: Problem, number: int) -> Problem:
    """The problem of all data but one block: what is known without it.

    Parameters
    ----------
    problem : from `build_problem`.
    number : of the block, in the order of `block_names`.

    Raises
    ------
    IndexError
        If there are not so many blocks.
    """
    plans = list(problem.plans)
    for k, plan in enumerate(plans):
        for channel, points in plan.sweep.channels.items():
            blocks = blocks_of(points.value.size)
            if number < len(blocks):
                plans[k] = without_points(plan, channel, blocks[number])
                return replace(problem, plans=tuple(plans))
            number -= len(blocks)
    raise IndexError(f"there are not so many blocks of data: {number} too many")


def predict_sweep(problem: Problem, values: Mapping[str, FloatArray], sweep: Sweep) -> SweepModel:
    """Predict what the instruments should read at the points of one sweep, with the forward model of the problem.

    Parameters
    ----------
    problem : from `build_problem`.
    values : parameter name -> SI values (n_draw,), fixed ones included.
    sweep : one of the problem's.
    """
    plan = next(p for p in problem.plans if (p.sweep.specimen, p.sweep.name) == (sweep.specimen, sweep.name))
    return model_sweep(problem, problem.forward, plan, values)


def range_use(problem: Problem, theta: FloatArray) -> FloatArray:
    """How much of the forward model's range draws use: their deepest point over all sweeps relative to the deepest it covers.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    [1], (n_draw,); a draw above 1 is not covered.
    """
    values = values_at(problem, theta)
    uses = [
        model_sweep(problem, problem.forward, way.plan, values).range_use if way.plan.needs_curve else way.range_use
        for way in ways_down(problem, problem.forward, problem.plans, values)
    ]
    return np.asarray(np.max(uses, axis=0), dtype=float)
