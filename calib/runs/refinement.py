"""From a run and a store of loading curves to what finite elements say at the run's draws: errors, shifts, a fuller store."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial

import numpy as np

from calib.checks import ACCURACY, Comparison, compare_draws, reweight, training_points
from calib.sampling import Posterior, Reweighting, thin_draws
from calib.workers import workers
from models.fem import FiniteElements
from models.surrogate.fitting import fit_surrogate
from models.surrogate.store import RunStore
from models.surrogate.surrogate import Surrogate
from models.surrogate.training import run_training


@dataclass(frozen=True)
class Means:
    """What surrogates are refined with; others may stand in.

    Attributes
    ----------
    exact : gives the finite elements of an accuracy.
    workers : as `calib.workers.workers`.
    fit : as `models.surrogate.fitting.fit_surrogate`.
    """

    exact: Callable[[float], FiniteElements] = FiniteElements
    workers: Callable[[int | None], AbstractContextManager[Executor]] = workers
    fit: Callable[..., Surrogate] = fit_surrogate


@dataclass(frozen=True, eq=False)
class Refinement:
    """What finite elements showed at draws of a run: how far the surrogate is off in each sweep, and the draws re-weighted."""

    comparisons: tuple[Comparison, ...]
    reweighting: Reweighting


def refine(
    posterior: Posterior,
    fast: Surrogate,
    store: RunStore,
    executor: Executor,
    *,
    n_draw: int,
    n_reweight: int,
    accuracy: float,
    seed: int,
    exact: Callable[[float], FiniteElements] = FiniteElements,
    added: Callable[[int], None] | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Refinement:
    """Solve finite elements at draws of a posterior, keep their loading curves, and see how far off the surrogate is there.

    Parameters
    ----------
    posterior : of the run.
    fast : the surrogate it was sampled with.
    store : open; takes the new loading curves one by one.
    executor : any of `concurrent.futures`.
    n_draw : draws to run and to compare at.
    n_reweight : draws to re-weight.
    accuracy : relative, of the finite elements in the store; those that draws are re-weighted to are `reweight.ACCURACY` fine.
    seed : of the choice of draws.
    exact : gives the finite elements of an accuracy.
    added : called with the number of new curves, before the comparison begins.
    progress : called with what is counted, how many are done, and of how many.
    """
    rng = np.random.default_rng(seed)
    values = thin_draws(posterior, n_draw, rng)
    before = len(store)
    curves, draws = (None if progress is None else partial(progress, what) for what in ("loading curves", "draws re-weighted"))
    points = training_points(posterior, values, fast.family)
    run_training(points, executor, store, accuracy=accuracy, family=fast.family, progress=curves)
    if added is not None:
        added(len(store) - before)
    compared = compare_draws(posterior, fast, exact(accuracy), values, executor)
    weighed = thin_draws(posterior, n_reweight, rng)
    found = reweight(posterior, fast, exact(min(accuracy, ACCURACY)), weighed, executor, progress=draws)
    return Refinement(tuple(compared), found)
