"""The error that a surrogate states holds what it promises at every depth, however what it misses is distributed there."""

from __future__ import annotations

import numpy as np

from models.sensor import FloatArray
from models.surrogate.coordinates import depth_terms
from models.surrogate.error_fit import Z90, learn_error
from models.surrogate.pressed import N_ERROR_TERMS

_S = np.linspace(0.1, 1.0, 20)


def _missed(n: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Features of paths, and what was missed along them: normal near first touch, of few wild paths at depth."""
    features = rng.uniform(-1, 1, (n, 3))
    even, wild = rng.standard_normal((n, 1)), rng.standard_t(1.5, (n, 1))
    return features, 1e-3 * np.exp(features[:, :1]) * ((1 - _S) * even + _S * wild)


def test_the_band_that_is_stated_holds_as_often_at_every_depth() -> None:
    rng = np.random.default_rng(3)
    features, missed = _missed(900, rng)
    network, _ = learn_error(features, np.tile(_S, (900, 1)), missed, 900, 1500, rng)
    fresh, unseen = _missed(4000, rng)
    sd = np.exp((network(fresh)[:, None] @ depth_terms(_S, N_ERROR_TERMS))[:, 0])
    inside = np.mean(np.abs(unseen) <= Z90 * sd, axis=0)
    assert np.all((inside > 0.86) & (inside < 0.94)), inside
