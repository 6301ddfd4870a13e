"""From a posterior and the forward model it was sampled with to how far that model is off the finite elements right there.

A surrogate states its own error, which the likelihood carries. Whether it is right where the posterior lies is looked at here:
at a few draws, for every sweep, the finite elements are solved at depths down to the deepest reading, and the difference is put
in units of the error stated, z = (finite elements - surrogate) / sd, with the numerical error of the finite elements in sd.
The draws of one posterior are alike, and so is the surrogate's error at them: if what it states is honest, the root mean square
of z is about the size of one normal number, below 2 in 95 % and below 3 in 99.7 % of posteriors.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from calib.problem import model_sweep, plan_sweep, specimen_design
from calib.sampling import Posterior, SpotCheck, thin_draws
from models.fem import FiniteElements
from models.response import Forward
from models.sensor import FloatArray
from models.surrogate.validation import compare, response_or_why, toleranced

#: Draws that are looked at after a calibration, and depths of each, d = deepest * DEPTHS.
N_DRAW = 6
DEPTHS = (np.arange(2, 9) / 8) ** 2


@dataclass(frozen=True, eq=False)
class Comparison:
    """Forward model against finite elements for one sweep, arrays (n_curve, n_depth) as `compare_draws` has them.

    Attributes
    ----------
    sweep : its title.
    force_error, change_error : relative.
    force_score, change_score : in units of the sd stated.
    failures : of the curves that the finite elements could not follow to the deepest reading.
    """

    sweep: str
    force_error: FloatArray
    change_error: FloatArray
    force_score: FloatArray
    change_score: FloatArray
    failures: tuple[str, ...]


def with_spot_check(
    posterior: Posterior, forward: Forward, exact: FiniteElements | None = None, executor: Executor | None = None
) -> Posterior:
    """Solve finite elements at a few draws of a posterior, and keep with it how far the forward model is off them.

    A model that states too small an error makes the posterior unusable (`Diagnostics.surrogate_honest`), however well the
    chains agree. For one that states no error of its own a warning says how far off it is. A posterior of the finite elements
    themselves is returned as it is.

    Parameters
    ----------
    posterior : as sampled.
    forward : the model that it was sampled with.
    exact : the finite elements to compare with, by default `FiniteElements()`.
    executor : to solve draws side by side; None for one after the other.

    Returns
    -------
    Posterior
        The same draws, with a `SpotCheck` in the diagnostics and perhaps a warning more.
    """
    exact = exact if exact is not None else FiniteElements()
    if forward.name == exact.name:
        return posterior
    found = spot_check(posterior, forward, exact, executor)
    d = posterior.diagnostics
    warnings = d.warnings
    if found is None:
        warnings = (*warnings, "the finite elements could not be asked at any draw looked at: no spot check")
    elif not found.stated:
        warnings = (*warnings, f"{found.in_words()}, and it states no error of its own")
    return replace(posterior, diagnostics=replace(d, spot_check=found, warnings=warnings))


def spot_check(
    posterior: Posterior, forward: Forward, exact: FiniteElements, executor: Executor | None = None
) -> SpotCheck | None:
    """Ask the finite elements how far the forward model is off at `N_DRAW` draws, chosen by the posterior's seed.

    Parameters
    ----------
    posterior : whose draws are looked at.
    forward : the model that it was sampled with.
    exact : the finite elements to ask.
    executor : as in `with_spot_check`.

    Returns
    -------
    SpotCheck or None
        None if the finite elements got to the deepest reading for no draw.
    """
    values = thin_draws(posterior, N_DRAW, np.random.default_rng(posterior.seed))
    found = compare_draws(posterior, forward, exact, values, executor)
    n_curve = sum(len(c.force_error) for c in found)
    if n_curve == 0:
        return None

    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(c, name) for c in found])

    force, change = (float(np.max(np.abs(joined(name)))) for name in ("force_error", "change_error"))
    force_score, change_score = (rms(joined(name)) for name in ("force_score", "change_score"))
    failures = tuple(f"{c.sweep}: {why}" for c in found for why in c.failures)
    return SpotCheck(forward.name, n_curve, force, change, force_score, change_score, failures)


def compare_draws(
    posterior: Posterior,
    forward: Forward,
    exact: FiniteElements,
    values: Mapping[str, FloatArray],
    executor: Executor | None = None,
) -> list[Comparison]:
    """Compare forward model and finite elements sweep by sweep, down to the deepest reading.

    Draws that the forward model does not cover and those before contact are left out.

    Parameters
    ----------
    posterior : for its sweeps.
    forward : the model to judge.
    exact : the finite elements to ask.
    values : draws in SI by parameter, (n_draw,) each, fixed ones included.
    executor : to solve draws side by side; None for one after the other.

    Returns
    -------
    list of Comparison
        One of each sweep.
    """
    found = []
    for sweep in posterior.sweeps:
        model = model_sweep(posterior, forward, plan_sweep(sweep), values)
        designs, depths = [], []
        if np.any(model.covered):
            batch = specimen_design(posterior, values, sweep.specimen, sweep.name)
            pressed = model.deepest > 0
            designs = [batch.draw(int(row)) for row in np.flatnonzero(model.covered)[pressed]]
            depths = [depth * DEPTHS for depth in model.deepest[pressed]]
        solve = executor.map if executor is not None else map
        compared, failures = [], []
        for design, depth, truth in zip(
            designs, depths, solve(response_or_why, [toleranced(exact)] * len(designs), designs, depths), strict=True
        ):
            if isinstance(truth, str):
                failures.append(truth)
            else:
                compared.append(compare(forward.respond(design, depth), truth))
        force, change, force_score, change_score = (
            np.reshape([c[k] for c in compared], (-1, DEPTHS.size)).astype(float) for k in range(4)
        )
        found.append(Comparison(sweep.title, force, change, force_score, change_score, tuple(failures)))
    return found


def rms(score: FloatArray) -> float:
    """Root mean square of scores of any shape [1]."""
    return float(np.sqrt(np.mean(np.square(score))))
