"""How well models predict left-out blocks, or how probable they make the data, in; a weight for each, with its interval, out.

Three ways to weight models of the same data:

- stacking: weights w that maximise sum_b log sum_k w_k p(y_b | y_-b, k) over blocks b of the data (Yao, Vehtari, Simpson &
  Gelman, Bayesian Anal. 13 (2018) 917, Eq. 4). Needs no model to be true; of few blocks it tends to the corners. The usual way:
  what covers is in docs/averaging.md.
- pseudo-BMA+: exp of what the log densities of left-out blocks sum up to, averaged over the Bayesian bootstrap of the blocks
  (the same, Eq. 11).
- evidence: the probability of each model after the data, if all were equally probable before, p(y | k) / sum p(y | j). Right
  where one of them is true; depends on how wide the priors of the unknowns are.

Blocks of one sweep are correlated, so that intervals by the bootstrap are too narrow rather than too wide.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.special import softmax

from models.sensor import FloatArray

Weighting = Literal["stacking", "pseudo-bma", "evidence"]
WEIGHTINGS: tuple[Weighting, ...] = get_args(Weighting)
#: What models are weighted by if nothing else is said.
USUAL: Weighting = "stacking"

# Draws of the Bayesian bootstrap, and the seed of them all.
_N_BOOTSTRAP, _SEED = 400, 20180917
# Steps of expectation and maximisation, each of which raises the sum of logarithms, and the rise at which they end.
_MOST_STEPS, _NO_MORE = 4000, 1e-9


@dataclass(frozen=True, eq=False)
class Weights:
    """A weight of each of several models, arrays (n_model,), with the central 90 % that it has over what it rests on.

    Attributes
    ----------
    value : the weights, which sum to 1.
    low, high : of the Bayesian bootstrap over blocks, or of the numerical error of the evidences.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray


def model_weights(pointwise: FloatArray, log_evidence: FloatArray, error: FloatArray) -> Mapping[Weighting, Weights]:
    """Weight models of the same data in every way that there is.

    Parameters
    ----------
    pointwise : (n_model, n_block), log density of each block given the others.
    log_evidence : (n_model,), log density of all data; nan where it is not known, and then no weights are by it.
    error : (n_model,), standard error of these logarithms.
    """
    rng = np.random.default_rng(_SEED)
    counts = rng.dirichlet(np.ones(pointwise.shape[1]), _N_BOOTSTRAP)
    bootstrapped = softmax(pointwise.shape[1] * counts @ pointwise.T, axis=1)
    found: dict[Weighting, Weights] = {
        "stacking": _with_interval(stacking(pointwise), stacking(pointwise, counts)),
        "pseudo-bma": _with_interval(np.mean(bootstrapped, axis=0), bootstrapped),
    }
    if np.all(np.isfinite(log_evidence)):
        noisy = log_evidence + error * rng.standard_normal((_N_BOOTSTRAP, log_evidence.size))
        found["evidence"] = _with_interval(softmax(log_evidence), softmax(noisy, axis=1))
    return found


def stacking(pointwise: FloatArray, counts: FloatArray | None = None) -> FloatArray:
    """Weights of models whose mixture predicts left-out blocks best, by expectation and maximisation of the concave sum.

    Parameters
    ----------
    pointwise : (n_model, n_block), log density of each block given the others.
    counts : (..., n_block), how often each block counts; default all alike.

    Returns
    -------
    (..., n_model), weights that sum to 1.

    Examples
    --------
    >>> better_by_turns = np.log([[0.9, 0.9, 0.1], [0.1, 0.1, 0.9]])
    >>> stacking(better_by_turns).round(2).tolist()
    [0.71, 0.29]
    """
    n_model, n_block = pointwise.shape
    share = np.ones(n_block) / n_block if counts is None else counts / np.sum(counts, axis=-1, keepdims=True)
    density = np.exp(pointwise - np.max(pointwise, axis=0))
    weight = np.full((*share.shape[:-1], n_model), 1 / n_model)
    for _ in range(_MOST_STEPS):
        risen = weight * ((share / (weight @ density)) @ density.T)
        done = float(np.max(np.abs(risen - weight))) < _NO_MORE
        weight = risen
        if done:
            break
    return np.asarray(weight / np.sum(weight, axis=-1, keepdims=True), dtype=float)


def _with_interval(value: FloatArray, draws: FloatArray) -> Weights:
    low, high = np.quantile(draws, [0.05, 0.95], axis=0)
    return Weights(value, low, high)
