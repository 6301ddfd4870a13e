"""From a posterior and the forward model it was sampled with to how far that model is off the finite elements right there.

A surrogate states its own error, which the likelihood carries. Whether it is right where the posterior lies is looked at here:
at a few draws, for every sweep, the finite elements are solved at depths down to the deepest reading, and the difference is put
in units of the error stated, z = (finite elements - surrogate) / sd. If the error is honest, the root mean square of z is about
1 or, with so few draws, below 2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calib.diagnostics import SpotCheck
from calib.measurement import model_sweep, plan_sweep
from calib.parameters import specimen_design, sweep_title
from calib.posterior import Posterior, thin_draws
from models.fem import ConvergenceError, FiniteElements
from models.response import Forward, OutOfRangeError
from models.sensor import FloatArray
from models.validation import compare

#: Draws that are looked at, and depths of each, d = deepest * DEPTHS.
N_DRAW = 6
DEPTHS = (np.arange(2, 9) / 8) ** 2


def with_spot_check(posterior: Posterior, forward: Forward, exact: FiniteElements | None = None) -> Posterior:
    """The posterior with a `SpotCheck` in its diagnostics, and among its reasons or warnings what that found wrong.

    Nothing is done for a posterior of the finite elements themselves. A model that states no error of its own gets a warning
    that tells how far off it is; one that states too small an error has not passed, and the posterior counts as not converged.
    """
    exact = exact if exact is not None else FiniteElements()
    if forward.name == exact.name:
        return posterior
    found = spot_check(posterior, forward, exact)
    d = posterior.diagnostics
    reasons = d.reasons if found is None or found.passed else (*d.reasons, found.in_words(forward.name))
    warnings = d.warnings
    if found is None:
        warnings = (*warnings, "the finite elements could not be asked at any draw looked at: no spot check")
    elif not found.stated:
        warnings = (*warnings, f"{found.in_words(forward.name)}, and it states no error of its own")
    diagnostics = replace(d, spot_check=found, reasons=reasons, warnings=warnings, converged=not reasons)
    return replace(posterior, diagnostics=diagnostics)


def spot_check(posterior: Posterior, forward: Forward, exact: FiniteElements) -> SpotCheck | None:
    """Compare at `N_DRAW` draws, chosen by the posterior's seed; None if the finite elements got to the end for none."""
    values = thin_draws(posterior, N_DRAW, np.random.default_rng(posterior.seed))
    compared: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]] = []
    failures: list[str] = []
    for sweep in posterior.sweeps:
        model = model_sweep(posterior, forward, plan_sweep(sweep), values)
        rows = np.flatnonzero(model.covered)
        if rows.size == 0:
            continue
        deepest = np.max([np.max(channel.depth, axis=1) for channel in model.channels], axis=0)
        design = specimen_design(posterior, values, sweep.specimen, sweep.name)
        for row, depth in zip(rows, deepest, strict=True):
            if depth <= 0:
                continue
            single = design.draw(int(row))
            fast = forward.respond(single, depth * DEPTHS)
            try:
                truth = exact.respond(single, depth * DEPTHS)
            except (ConvergenceError, OutOfRangeError) as error:
                failures.append(f"{sweep_title(sweep)}: {error}")
                continue
            compared.append(compare(fast, truth))
    if not compared:
        return None
    worst = [float(np.max(np.abs([c[k] for c in compared]))) for k in (0, 1)]
    rms = [float(np.sqrt(np.mean(np.square([c[k] for c in compared])))) for k in (2, 3)]
    return SpotCheck(len(compared), worst[0], worst[1], rms[0], rms[1], tuple(failures))
