"""A problem and draws in, their log posterior out in parts: of what all specimens share, and of each specimen by itself.

Given the unknowns that all share, the specimens are independent of each other: a sampler may move those of each specimen as if
there were no others, for all specimens in one evaluation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.problem.likelihood import log_likelihood_sweeps
from calib.problem.problem import Problem
from models.sensor import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Scopes:
    """Which unknowns belong to what, as columns of theta; every column is in one of them.

    Attributes
    ----------
    shared : of the unknowns of material and rig.
    specimens : name -> those of a specimen and its sweeps, in the order in which the specimens come in the data.
    """

    shared: IntArray
    specimens: dict[str, IntArray]


@dataclass(frozen=True, eq=False)
class LogPosteriorParts:
    """Log posterior of draws in parts, up to the same constant as `log_posterior`.

    What makes specimens of one lot alike is in none of them: it ties them to each other.

    Attributes
    ----------
    prior_shared : of the shared unknowns, (n_draw,).
    prior : of each specimen's own unknowns, (n_draw, n_specimen).
    likelihood : of each specimen's sweeps, which depends on the shared and on its own unknowns alone, (n_draw, n_specimen);
        -inf where `log_likelihood` of them is.
    """

    prior_shared: FloatArray
    prior: FloatArray
    likelihood: FloatArray

    @property
    def total(self) -> FloatArray:
        """Log posterior, (n_draw,)."""
        return np.asarray(self.prior_shared + np.sum(self.prior + self.likelihood, axis=1), dtype=float)


def scopes_of(problem: Problem) -> Scopes:
    """Sort the unknowns of a problem by what they belong to."""
    specimens: dict[str, list[int]] = {sweep.specimen: [] for sweep in problem.sweeps}
    shared: list[int] = []
    for k, parameter in enumerate(problem.parameters):
        (specimens[parameter.specimen] if parameter.specimen else shared).append(k)
    return Scopes(np.array(shared, dtype=np.int64), {name: np.array(own, dtype=np.int64) for name, own in specimens.items()})


def log_posterior_parts(problem: Problem, theta: FloatArray) -> LogPosteriorParts:
    """Log posterior density of draws, specimen by specimen, at the cost of one `log_posterior`.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.

    Returns
    -------
    Its parts; the specimens in the order of `scopes_of`.
    """
    scopes = scopes_of(problem)
    by_sweep = log_likelihood_sweeps(problem, theta)
    squares = -0.5 * theta**2
    likelihood = np.zeros((theta.shape[0], len(scopes.specimens)))
    order = {name: k for k, name in enumerate(scopes.specimens)}
    for column, sweep in zip(by_sweep.T, problem.sweeps, strict=True):
        likelihood[:, order[sweep.specimen]] += column
    prior = np.stack([np.sum(squares[:, own], axis=1) for own in scopes.specimens.values()], axis=1)
    return LogPosteriorParts(np.sum(squares[:, scopes.shared], axis=1), prior, likelihood)
