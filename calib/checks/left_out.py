"""A posterior in, how well its model predicts each block of data from the others out: by weights, or by fitting anew.

Weights of the draws (PSIS) tell what the posterior would be without a block, where it does not pull too hard (k-hat at most
0.7). Where it does, the density of the block given the others is the ratio of two evidences,

    p(y_b | y_-b) = p(y) / p(y_-b),                                                                                     (1)

each computed by importance sampling from a density fitted to its own posterior (`calib.sampling.first_answer`).

What a fitted discrepancy has swallowed shows where data are foretold that were not there to be fitted. Of each block it is
asked how probable a lower level than that read was, u_b = P(1^T y_b < 1^T y_b,read | y_-b), by the same weights, or by draws of
the posterior without it: uniform before the data whatever the truth, as the priors say (the probability integral transform;
Gelfand, Dey & Chang, Bayesian Statistics 4 (1992) 147).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import ndtr, ndtri

from calib.checks.reweighting import problem_of
from calib.problem import Problem, coordinates_of, levels_of_blocks, without_block
from calib.sampling import K_HAT, LeaveOut, Posterior, first_answer, leave_out, look_at, smooth_weights
from calib.workers import given_to
from models.response import Forward
from models.sensor import FloatArray

# Draws that are looked at, how far from 0 and 1 a probability is told, and up to which z a few hundred draws resolve it.
_DRAWS, _LEAST, _RESOLVED = 1000, 1e-12, 2.0


def leave_out_exactly(posterior: Posterior, forward: Forward) -> LeaveOut:
    """As `calib.sampling.leave_out`, with the blocks that its weights cannot be trusted for computed by (1).

    About a second of processor time for each of them. A block for which there is no evidence, as the posterior without it is
    not nearly normal given its scales, stays as it was, and doubtful. So do all with the finite elements, which would take
    hours.

    Parameters
    ----------
    posterior : as sampled.
    forward : the model that it was sampled with.
    """
    found = leave_out(posterior)
    if found.trusted or posterior.experiment.model == "fem":
        return found
    problem = problem_of(posterior, forward)
    near = {name: s.mean for name, s in posterior.diagnostics.parameters.items()}
    pointwise, refitted = found.pointwise.copy(), []
    try:
        whole = first_answer(problem, near).log_evidence
        for number in found.doubtful:
            pointwise[number] = whole - first_answer(without_block(problem, number), near).log_evidence
            refitted.append(number)
    except ValueError:
        pass
    se = math.sqrt(pointwise.size * float(np.var(pointwise)))
    return replace(found, elpd=float(np.sum(pointwise)), se=se, pointwise=pointwise, refitted=tuple(refitted))


def with_blocks_foretold(posterior: Posterior, forward: Forward, executor: Executor | None = None) -> Posterior:
    """The same draws, with how far each block of data is off what all others foretell in the diagnostics.

    Parameters
    ----------
    posterior : as sampled, of one model.
    forward : the model that it was sampled with.
    executor : fits without blocks side by side, half a second of processor time for each that has to; None to do so here.
    """
    found = tuple(float(z) for z in blocks_foretold(posterior, forward, executor))
    return replace(posterior, diagnostics=replace(posterior.diagnostics, block_z=found))


def blocks_foretold(posterior: Posterior, forward: Forward, executor: Executor | None = None) -> FloatArray:
    """How far each block of data is off what all others foretell, z_b with Phi(z_b) = u_b, (n_block,).

    Parameters
    ----------
    posterior, forward, executor : as in `with_blocks_foretold`.

    Returns
    -------
    In standard deviations, in the order of `posterior.blocks`; nan where it is not known: where weights cannot be trusted and
    the posterior without the block is not nearly normal, or the model is the finite elements, which would take hours.
    """
    problem = problem_of(posterior, forward)
    columns = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    every = max(1, len(columns) // _DRAWS)
    theta = coordinates_of(posterior, columns[::every])[:, : len(problem.parameters)]
    log_density = posterior.log_likelihood.reshape(len(columns), -1)[::every]
    levels = levels_of_blocks(problem, theta)
    found, doubtful = np.full(len(posterior.blocks), np.nan), []
    for number in range(found.size):
        weight, k_hat = smooth_weights(-log_density[:, number])
        if k_hat <= K_HAT:
            found[number] = _foretold(levels[:, number], weight)
        else:
            doubtful.append(number)
    if doubtful and posterior.experiment.model != "fem":
        near = {name: s.mean for name, s in posterior.diagnostics.parameters.items()}
        asked: list[Callable[[], float]] = [partial(_fitted_without, problem, number, near) for number in doubtful]
        answers = asked if executor is None else given_to(executor, asked)
        found[doubtful] = [answer() for answer in answers]
    return found


def _fitted_without(problem: Problem, number: int, near: dict[str, float]) -> float:
    """How far a block is off by the posterior without it; nan if that is not nearly normal."""
    try:
        look = look_at(without_block(problem, number), near)
    except ValueError:
        return math.nan
    weight, k_hat = look.smoothed
    return _foretold(levels_of_blocks(problem, look.theta)[:, number], weight) if k_hat <= K_HAT else math.nan


def _foretold(level: FloatArray, weight: FloatArray) -> float:
    """The z of a block from its levels (n_draw,) and the weights that make the draws those of the posterior without it."""
    there = np.isfinite(level) & (weight > 0)
    if not np.any(there):
        return math.nan
    level, share = level[there], weight[there] / np.sum(weight[there])
    z = float(ndtri(np.clip(share @ ndtr(level), _LEAST, 1 - _LEAST)))
    if abs(z) <= _RESOLVED:
        return z
    # Farther out a few draws decide: no farther than a normal prediction of the same mean and variance would have it.
    mean = float(share @ level)
    return min(z, mean / math.sqrt(1 + float(share @ (level - mean) ** 2)), key=abs)
