"""The likelihood in parts and in batches: every draw by itself, every specimen by itself, many sweeps, priors of every kind."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from calib.experiment.experiment_file import read_experiment
from calib.experiment.plan import Experiment
from calib.experiment.sweeps import read_sweeps
from calib.lab import Sweep
from calib.priors import Fixed, HalfNormal, LogNormal, Normal, TruncatedNormal, Uniform, stack_priors
from calib.problem import (
    Problem,
    build_problem,
    chi_square,
    log_likelihood,
    log_likelihood_at,
    log_likelihood_blocks,
    log_posterior,
    log_posterior_parts,
    model_sweep,
    scopes_of,
    values_at,
)
from models.analytic import ClosedForm
from models.sensor import FloatArray
from models.surrogate import load_surrogate

EXPERIMENT = Path(__file__).parents[3] / "datasets" / "padded_sensor" / "experiment.toml"
FAST = load_surrogate()


@pytest.fixture(scope="module")
def lab() -> tuple[Experiment, tuple[Sweep, ...]]:
    experiment = read_experiment(EXPERIMENT)
    return experiment, read_sweeps(experiment)


@pytest.fixture(scope="module")
def problem(lab: tuple[Experiment, tuple[Sweep, ...]]) -> Problem:
    return build_problem(*lab, FAST)


def draws(problem: Problem, n: int, width: float = 1.0) -> FloatArray:
    return width * np.random.default_rng(1).standard_normal((n, len(problem.parameters)))


def many_specimens(lab: tuple[Experiment, tuple[Sweep, ...]], n: int) -> Problem:
    experiment, sweeps = lab
    specimens = tuple(replace(experiment.specimens[0], name=f"sensor {k}") for k in range(n))
    return build_problem(
        replace(experiment, specimens=specimens), [replace(sweeps[0], specimen=s.name) for s in specimens], FAST
    )


def many_sweeps(lab: tuple[Experiment, tuple[Sweep, ...]], n: int) -> Problem:
    experiment, sweeps = lab
    files = tuple(replace(experiment.specimens[0].sweeps[0], name=f"press {k}") for k in range(n))
    specimen = replace(experiment.specimens[0], sweeps=files)
    return build_problem(replace(experiment, specimens=(specimen,)), [replace(sweeps[0], name=f.name) for f in files], FAST)


def test_the_likelihood_of_the_shipped_problem_is_that_of_dense_covariances(problem: Problem) -> None:
    theta = draws(problem, 40)
    expected = np.zeros(len(theta))
    for plan in problem.plans:
        model = model_sweep(problem, FAST, plan, values_at(problem, theta))
        expected[~model.covered] = -np.inf
        for c in model.channels.values():
            covariances = [np.diag(v) + m @ m.T for v, m in zip(c.variance, c.modes, strict=True)]
            pairs = zip(c.mean, covariances, strict=True)
            expected[model.covered] += [multivariate_normal(m, s, allow_singular=True).logpdf(c.observed) for m, s in pairs]
            residuals = c.observed - c.mean
            misfit = [r @ np.linalg.solve(s, r) for r, s in zip(residuals, covariances, strict=True)]
            np.testing.assert_allclose(chi_square(c), misfit, rtol=1e-7)
    assert np.any(np.isfinite(expected))
    np.testing.assert_allclose(log_likelihood(problem, theta), expected, rtol=1e-9)


def test_blocks_are_what_the_points_say_given_all_others(problem: Problem) -> None:
    theta = draws(problem, 3, 0.2)
    blocks = log_likelihood_blocks(problem, theta)
    c = model_sweep(problem, FAST, problem.plans[0], values_at(problem, theta)).channels["force"]
    for k in range(len(theta)):
        covariance = np.diag(c.variance[k]) + c.modes[k] @ c.modes[k].T
        whole = multivariate_normal(c.mean[k], covariance).logpdf(c.observed)
        for b, gone in enumerate(np.array_split(np.arange(c.observed.size), 5)):
            left = np.setdiff1d(np.arange(c.observed.size), gone)
            others = multivariate_normal(c.mean[k][left], covariance[np.ix_(left, left)]).logpdf(c.observed[left])
            assert blocks[k, b] == pytest.approx(whole - others, rel=1e-7)


def test_a_draw_has_the_same_density_in_every_batch(problem: Problem) -> None:
    theta = draws(problem, 400)
    together = log_posterior(problem, theta)
    assert 0.3 < np.mean(np.isfinite(together)) < 1
    rng = np.random.default_rng(2)
    for n in (1, 2, 3, 5, 7, 8, 31, 64, 321, 399):
        some = rng.choice(len(theta), n, replace=False)
        np.testing.assert_allclose(log_posterior(problem, theta[some]), together[some], rtol=1e-13)


def test_the_parts_of_specimens_add_up_to_the_posterior(lab: tuple[Experiment, tuple[Sweep, ...]]) -> None:
    p = many_specimens(lab, 3)
    theta = draws(p, 30)
    parts = log_posterior_parts(p, theta)
    np.testing.assert_allclose(parts.total, log_posterior(p, theta), rtol=1e-12)
    scopes = scopes_of(p)
    assert list(scopes.specimens) == ["sensor 0", "sensor 1", "sensor 2"]
    every = np.concatenate([scopes.shared, *scopes.specimens.values()])
    assert sorted(every) == list(range(len(p.parameters)))
    moved = theta.copy()
    moved[:, scopes.specimens["sensor 1"]] += 0.1
    after = log_posterior_parts(p, moved)
    np.testing.assert_array_equal(after.likelihood[:, [0, 2]], parts.likelihood[:, [0, 2]])
    assert np.all((after.likelihood[:, 1] != parts.likelihood[:, 1]) | ~np.isfinite(parts.likelihood[:, 1]))


def test_sweeps_of_unlike_specimens_are_pressed_together(lab: tuple[Experiment, tuple[Sweep, ...]]) -> None:
    # One specimen gives the thickness of its dielectric, of the other it follows from the sensor's.
    experiment, sweeps = lab
    one, two = experiment.specimens
    plain = {name: prior for name, prior in two.priors.items() if name != "dielectric_thickness"}
    unlike = replace(experiment, specimens=(one, replace(two, priors=plain)))
    for forward in (FAST, ClosedForm()):
        p = build_problem(unlike, sweeps, forward)
        theta = draws(p, 12, 0.3)
        values = values_at(p, theta)
        alone = np.sum([log_likelihood_at(p, forward, [plan], values) for plan in p.plans], axis=0)
        np.testing.assert_allclose(log_likelihood(p, theta), alone, rtol=1e-12)


def test_hundreds_of_sweeps_are_built_and_evaluated_within_seconds(lab: tuple[Experiment, tuple[Sweep, ...]]) -> None:
    start = time.process_time()
    p = many_sweeps(lab, 300)
    density = log_posterior(p, draws(p, 8, 0.1))
    assert np.any(np.isfinite(density))
    assert time.process_time() - start < 15  # a tenth of it where nothing else runs


def test_priors_stacked_by_kind_give_what_each_gives() -> None:
    priors = [
        Normal(1.0, 0.5),
        Uniform(-1.0, 2.0),
        TruncatedNormal(0.74e-3, 0.02e-3, 0.0, np.inf),
        LogNormal(0.7e6, 1.6),
        HalfNormal(5e-6),
        TruncatedNormal(2.85, 0.25, 2.0, 12.0),
        Fixed(3.0),
        Normal(-2.0, 1e-3),
    ]
    z = np.random.default_rng(0).normal(scale=4, size=(len(priors), 50))
    expected = np.stack([prior.ppf_normal(row) for prior, row in zip(priors, z, strict=True)])
    np.testing.assert_allclose(stack_priors(priors).ppf_normal(z), expected, rtol=1e-14)
