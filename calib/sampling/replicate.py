"""Draws of the unknowns and a forward model in, new readings of every channel and how likely the actual ones are, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from calib.problem import (
    Calibrated,
    PredictedReadings,
    given_other_points,
    model_sweep,
    plan_sweeps,
    point_densities,
    put_together,
)
from models.response import Forward
from models.sensor import BoolArray, FloatArray, IntArray

# Draws that are modelled at once: what bounds the memory.
_BATCH = 512


@dataclass(frozen=True, eq=False)
class Replicates:
    """What the instruments may read if the experiment is made again, and log densities of what they did read.

    Attributes
    ----------
    covered : (n_draw,), draws that the forward model covers in every sweep.
    readings : channel -> (n_draw, n_point) [SI], one new reading at each point of all sweeps, one after the other; nan for a
        sweep that is not covered. In single precision, far finer than any noise.
    given_others : the same where the other points of the sweep, and of those that repeat it, read what they did: what leaving
        out one point is judged by, as residuals are correlated.
    log_density : channel -> (n_draw, n_point), see `point_densities`; -inf for a sweep that is not covered.
    """

    covered: BoolArray
    readings: Mapping[str, npt.NDArray[np.float32]]
    given_others: Mapping[str, npt.NDArray[np.float32]]
    log_density: Mapping[str, FloatArray]


def replicate(known: Calibrated, forward: Forward, values: Mapping[str, FloatArray], rng: np.random.Generator) -> Replicates:
    """Make the experiment again, once for each draw, with the measurement model of `calib.problem.measurement`.

    Parameters
    ----------
    known : a `Problem` or a `Posterior`.
    forward : the forward model.
    values : parameter name -> SI values (n_draw,), fixed ones included.
    rng : for the noise, the discrepancy and the forward model's own error.
    """
    n_draw = next(iter(values.values())).size
    size: dict[str, int] = {}
    for sweep in known.sweeps:
        for name, points in sweep.channels.items():
            size[name] = size.get(name, 0) + points.value.size
    covered = np.ones(n_draw, dtype=bool)
    drawn = {name: np.full((n_draw, n), np.nan, dtype=np.float32) for name, n in size.items()}
    left_out = {name: values.copy() for name, values in drawn.items()}
    density = {name: np.full((n_draw, n), -np.inf) for name, n in size.items()}
    plans = plan_sweeps(known.sweeps)
    place: dict[tuple[int, str], IntArray] = {}
    start = dict.fromkeys(size, 0)
    for k, plan in enumerate(plans):
        for name, points in plan.sweep.channels.items():
            place[k, name] = start[name] + np.arange(points.value.size)
            start[name] += points.value.size
    for begin in range(0, n_draw, _BATCH):
        part = {name: column[begin : begin + _BATCH] for name, column in values.items()}
        models = [model_sweep(known, forward, plan, part) for plan in plans]
        for model in models:
            covered[begin : begin + _BATCH] &= model.covered
        for some in put_together(plans, models):
            name, channel = some.repeats.channel, some.readings
            rows = (begin + np.flatnonzero(some.covered))[:, None]
            columns = np.concatenate([place[k, name] for k in some.repeats.places])
            drawn[name][rows, columns] = new_readings(channel, rng)
            mean, variance = given_other_points(channel)
            density[name][rows, columns] = point_densities(channel.observed, mean, variance)
            left_out[name][rows, columns] = mean + np.sqrt(variance) * rng.standard_normal(mean.shape)
    return Replicates(covered, drawn, left_out, density)


def new_readings(channel: PredictedReadings, rng: np.random.Generator) -> FloatArray:
    """Draw what an instrument may read if the sweep is made again: one new reading of each point of a channel for each draw.

    mean + W u + sqrt(D) v with u, v standard normal has the mean and the covariance D + W W^T of the channel.

    Parameters
    ----------
    channel : what should be read.
    rng : for the errors.

    Returns
    -------
    (n_covered, n_point), SI.
    """
    n_draw, _, n_mode = channel.modes.shape
    together = rng.standard_normal((n_draw, n_mode, 1))
    each = rng.standard_normal(channel.mean.shape)
    correlated = np.matmul(channel.modes, together)[..., 0]
    return np.asarray(channel.mean + correlated + np.sqrt(channel.variance) * each, dtype=float)
