"""A problem and a look at its posterior in, that as a `Posterior` out, in a second instead of the minute of chains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calib.problem import Problem, block_names, columns_at
from calib.sampling import Convergence, Diagnostics, Gate, Look, Posterior, answer_of, summarise

#: First answers of fewer effective draws are made again where models are averaged.
FEW = 100.0
#: Chains and draws of each to which importance draws are resampled.
CHAINS, DRAWS = 4, 500


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
