"""From a posterior and its forward model to what the finite elements' likelihood makes of its draws.

The draws x_i come from the posterior with the likelihood of a fast model, p_fast. With the finite elements in its place they
get the weights

    w_i ~ p_exact(data | x_i) / p_fast(data | x_i),   sum w_i = 1,                                                        (1)

as the prior is the same, with their largest values smoothed (PSIS: Vehtari, Simpson, Gelman, Yao, Gabry, J. Mach. Learn. Res.
25 (2024) 72). The shift of a parameter's mean is sum (w_i - 1/n) x_i; what the draws have in common cancels in it, so that a
hundred draws are enough to see a small shift. Its Monte Carlo variance, by the delta method, is that of the mean of

    n w_i (x_i - sum w x) - (x_i - sum x / n).                                                                            (2)

The finite elements are exact only to their accuracy: from depth to depth their force scatters by half of it (measured at 1e-3
against 1.5e-4: 4.5e-4, without correlation), which in a sweep reduced from a thousand readings is more than the noise. p_exact
carries that as an error of its own (`models.surrogate.validation.toleranced`), so that the weights do not follow the grid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, as_completed
from dataclasses import replace

import numpy as np

from calib.problem import Problem, SweepPlan, log_likelihood_at, model_sweep, plan_sweeps, specimen_design
from calib.sampling import Posterior, Reweighting, Shift, smooth_weights, thin_draws
from models.curves import table_depths
from models.fem import FiniteElements
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import FloatArray
from models.surrogate.validation import toleranced

#: Fewest draws whose weights have a tail to judge.
LEAST_DRAWS = 25

#: Accuracy of the finite elements that draws are re-weighted to. At 1e-3 their own error, several times the surrogate's on the
#: usual sensor, shifts means by 0.35 sd; at 2.5e-4 by 0.1.
ACCURACY = 2.5e-4

#: How much further than the deepest reading a table for the finite elements goes: they may be softer than the fast model.
_BEYOND = 1.1


def with_reweighting(
    posterior: Posterior,
    forward: Forward,
    n_draw: int,
    executor: Executor,
    *,
    exact: Forward | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Posterior:
    """Check by re-weighting whether a posterior would be another one with finite elements, and keep the finding with it.

    The draws stay what they are. A posterior of the finite elements themselves is returned as it is.

    Parameters
    ----------
    posterior : as sampled.
    forward : the model that it was sampled with.
    n_draw : draws to re-weight, chosen by the posterior's seed.
    executor : to solve draws side by side, any of `concurrent.futures`.
    exact : the model to re-weight to; default finite elements of `ACCURACY`.
    progress : called with the draws done and their number.

    Returns
    -------
    The same draws, with a `Reweighting` in the diagnostics.
    """
    exact = exact if exact is not None else FiniteElements(ACCURACY)
    if forward.name == exact.name:
        return posterior
    values = thin_draws(posterior, n_draw, np.random.default_rng(posterior.seed))
    found = reweight(posterior, forward, exact, values, executor, progress=progress)
    return replace(posterior, diagnostics=replace(posterior.diagnostics, reweighting=found))


def reweight(
    posterior: Posterior,
    forward: Forward,
    exact: Forward,
    values: Mapping[str, FloatArray],
    executor: Executor,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Reweighting:
    """Re-weight draws of a posterior to the likelihood with another model, by (1); one task for each draw.

    Parameters
    ----------
    posterior : as sampled.
    forward : the model that it was sampled with.
    exact : the model to re-weight to.
    values : the draws, at random from the posterior: name -> SI (n_draw,), fixed ones included, as `thin_draws` gives them.
    executor : any of `concurrent.futures`.
    progress : called with the draws done and their number.

    Raises
    ------
    ValueError
        If there are fewer than `LEAST_DRAWS` draws.
    """
    n = next(iter(values.values())).size
    if n < LEAST_DRAWS:
        raise ValueError(f"{n} draws are too few to re-weight; give at least {LEAST_DRAWS}")
    problem = problem_of(posterior, forward)
    if isinstance(exact, FiniteElements):
        exact = toleranced(exact)
    single = ({name: value[i : i + 1] for name, value in values.items()} for i in range(n))
    futures = {executor.submit(log_ratio, problem, exact, draw): i for i, draw in enumerate(single)}
    ratios, reasons = np.empty(n), [""] * n
    try:
        for done, future in enumerate(as_completed(futures), start=1):
            i = futures[future]
            ratios[i], reasons[i] = future.result()
            if progress is not None:
                progress(done, n)
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    efficiency = _efficiency(posterior, n)
    weights, k_hat = smooth_weights(ratios, relative_efficiency=efficiency)
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    shifts = {
        p.name: shift_of(values[p.name], weights, float(np.std(flat[:, k], ddof=1)), efficiency)
        for k, p in enumerate(posterior.parameters)
    }
    ess = float(1 / np.sum(weights**2)) if np.all(np.isfinite(weights)) else 0.0
    return Reweighting(n, k_hat, ess, shifts, tuple(r for r in reasons if r))


def shift_of(x: FloatArray, weights: FloatArray, posterior_sd: float, efficiency: float = 1.0) -> Shift:
    """Compute how far weights move the mean of one parameter and change its sd, by (2).

    Parameters
    ----------
    x : (n,), draws, SI.
    weights : (n,), of sum 1.
    posterior_sd : sd of the whole posterior, the unit of the shift.
    efficiency : effective over nominal number of draws.
    """
    n = x.size
    mean, weighted = float(np.mean(x)), float(weights @ x)
    influence = n * weights * (x - weighted) - (x - mean)  # (2)
    error = float(np.std(influence, ddof=1)) / np.sqrt(n * efficiency)
    spread = float(np.sqrt(weights @ (x - weighted) ** 2 * n / (n - 1)))
    scale = posterior_sd if posterior_sd > 0 else 1.0
    return Shift(mean, float(np.std(x, ddof=1)), weighted, spread, (weighted - mean) / scale, float(error) / scale)


def problem_of(posterior: Posterior, forward: Forward) -> Problem:
    """Build the calibration problem anew whose answer a posterior is.

    Parameters
    ----------
    posterior : as sampled or loaded.
    forward : the model of the problem.
    """
    plans = plan_sweeps(posterior.sweeps)
    return Problem(posterior.experiment, posterior.sweeps, forward, posterior.unknowns, posterior.fixed, plans)


def log_ratio(problem: Problem, exact: Forward, values: Mapping[str, FloatArray]) -> tuple[float, str]:
    """Compute the weight of one draw: the logarithm of the ratio in (1).

    Parameters
    ----------
    problem : of the posterior, with the model that it was sampled with.
    exact : the model to re-weight to.
    values : the draw, name -> SI (1,), fixed ones included.

    Returns
    -------
    The logarithm and "", or -inf and the reason if `exact` finds no equilibrium or does not cover the draw.

    Raises
    ------
    ValueError
        If the problem's own model does not cover the draw, which then is none of its posterior.
    """
    fast = float(log_likelihood_at(problem, problem.forward, problem.plans, values)[0])
    if not np.isfinite(fast):
        raise ValueError(f"the {problem.forward.name} does not cover a draw of its own posterior; was it another one?")
    try:
        tables = [_table(problem, plan, values) for plan in problem.plans]
        precise = float(log_likelihood_at(problem, exact, problem.plans, values, tables)[0])
    except (ConvergenceError, OutOfRangeError) as error:
        return -np.inf, str(error)
    return precise - fast, "" if np.isfinite(precise) else f"the {exact.name} do not cover its readings"


def _table(problem: Problem, plan: SweepPlan, values: Mapping[str, FloatArray]) -> FloatArray | None:
    """Depths (1, n_node) at which the exact model is asked where capacitance is looked up along the loading curve; else None.

    They are those that the fast model is asked at, so that linear interpolation between them is no difference of the two, but
    end soon after the deepest reading: the whole range of the fast model would take the finite elements several times as long
    and may have no equilibrium at its end.
    """
    if not plan.needs_curve:
        return None
    sweep = plan.sweep
    deepest = model_sweep(problem, problem.forward, plan, values).deepest[0]
    nodes = table_depths(problem.forward.max_depth(specimen_design(problem, values, sweep.specimen, sweep.name)))
    # The slope at the node after the last reading takes one more node.
    return nodes[:, : int(np.sum(nodes[0] < _BEYOND * deepest)) + 2]


def _efficiency(posterior: Posterior, n: int) -> float:
    """Effective over nominal number of `n` draws at random out of all: correlated ones add their variance to that of `n`.

    With E effective draws among N the mean of n of them has the variance 1/n - 1/N + 1/E in units of the posterior's.
    """
    ess = min(s.ess_bulk for s in posterior.diagnostics.parameters.values())
    total = posterior.log_prob.size
    return min(1.0, 1 / (n * (1 / n - 1 / total + 1 / max(min(ess, total), 1.0))))
