"""A problem in, its posterior out: weighted draws of a first answer, in a second, or where these cannot be trusted chains."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from calib.problem import Problem, block_names, columns_at
from calib.sampling import K_HAT, Convergence, Diagnostics, Gate, Look, Posterior, answer_of, look_at, sample, summarise

#: First answers of fewer effective draws are made again where models are averaged.
FEW = 100.0
#: Chains and draws of each to which importance draws are resampled.
CHAINS, DRAWS = 4, 500
#: Effective draws from which a first answer is taken for the posterior.
WORTH = 200.0


def calibrated(problem: Problem, seed: int, max_steps: int, *, chains: bool = False) -> tuple[dict[str, Any], Posterior]:
    """How a lab was calibrated, for its row, and its posterior.

    Parameters
    ----------
    problem : of the lab.
    seed : of the choice among weighted draws.
    max_steps : of each walker of the chains.
    chains : always, not only where the weighted draws cannot be trusted (k-hat above 0.7, fewer than `WORTH` effective).
    """
    row, look = trusted_look(problem)
    if chains or look is None:
        posterior = sample(problem, seed=1, processes=0, max_steps=max_steps)
        return {**row, "by": "chains", "converged": posterior.diagnostics.converged}, posterior
    return {**row, "by": "first answer"}, weighted_posterior(problem, look, np.random.default_rng([seed, 1]))


def trusted_look(problem: Problem) -> tuple[dict[str, Any], Look | None]:
    """How far a look at a posterior can be trusted, for the row of a lab, and that look with smoothed weights; None if not.

    Parameters
    ----------
    problem : of the lab.

    Raises
    ------
    ValueError
        As `look_at`.
    """
    look = look_at(problem)
    weight, k_hat = look.smoothed
    row = {"k_hat": round(float(k_hat), 2), "effective": round(look.effective_draws)}
    if not look.confirmed or look.effective_draws < WORTH or k_hat > K_HAT:
        return row, None
    return row, replace(look, weight=weight / np.sum(weight))


def weighted_posterior(problem: Problem, look: Look, rng: np.random.Generator) -> Posterior:
    """Importance draws as a posterior: resampled to so many of equal weight.

    Parameters
    ----------
    problem : of a lab.
    look : at it.
    rng : of the choice among its draws.
    """
    # As it is, even if rough: nothing is computed again.
    first = replace(answer_of(look), effective_draws=max(look.effective_draws, FEW), confirmed=True)
    picked = rng.choice(look.weight.size, CHAINS * DRAWS, p=look.weight)
    theta, values = look.theta[picked], columns_at(problem, look.theta[picked])
    n = len(problem.names)
    effective = np.full(n, first.effective_draws)
    state = Convergence(np.ones(n), effective, effective, np.ones(n), 1)
    diagnostics = Diagnostics(
        True, (), (), summarise(problem.parameters, values, theta, state), 1, 0, 1, 1, (), {}, Gate(), first_answer=first
    )
    zeros = np.zeros((CHAINS, DRAWS))
    blocks = block_names(problem)
    return Posterior(
        problem.experiment,
        problem.sweeps,
        problem.parameters,
        problem.fixed,
        problem.forward.name,
        values.reshape(CHAINS, DRAWS, n),
        zeros,
        np.zeros((CHAINS, DRAWS, len(blocks))),
        blocks,
        1,
        1,
        diagnostics,
        {},
    )
