"""Specimens of one lot: how probable their moduli are, and modulus and spread of the lot given them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from calib.errors import InputError
from calib.experiment.experiment_file import experiment_from
from calib.experiment.record import experiment_from_json, experiment_to_json
from calib.priors.distributions import Fixed, HalfNormal, LogNormal, Prior
from calib.problem.by_name import log_density
from calib.problem.likelihood import log_posterior
from calib.problem.lots import Lot, LotPrior
from calib.problem.prior import (
    log_prior,
    log_prior_as_normal,
    prior_coordinates,
    prior_covariance,
    prior_values,
    values_of_lot,
)
from calib.problem.problem import Problem, build_problem
from calib.problem.values import values_at
from calib.sampling.coordinates import coordinates
from calib.sampling.identity import identity_of
from calib.sampling.posterior import Posterior
from calib.sampling.scoring import slopes_at, tempered
from models.analytic import ClosedForm
from models.sensor import FloatArray

MakePosterior = Callable[..., Posterior]
DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor"
SPREADS: list[Prior] = [LogNormal(0.04, 2.0), HalfNormal(0.05), Fixed(0.03)]
LOT = LotPrior(LogNormal(0.7e6, 1.6), SPREADS[0])


def _problem(posterior: Posterior) -> Problem:
    return build_problem(posterior.experiment, posterior.sweeps, ClosedForm())


def _normal(lot: LotPrior, x: FloatArray, spread: float) -> float:
    """Density of x - m (n,) given a spread, mu integrated out: along the mean, and across it."""
    n, middle = x.size, np.mean(x)
    along = norm.logpdf(np.sqrt(n) * middle, 0, np.sqrt(spread**2 + n * np.log(lot.modulus.factor) ** 2))
    across = -0.5 * (n - 1) * np.log(2 * np.pi * spread**2) - 0.5 * np.sum((x - middle) ** 2) / spread**2
    return float(np.exp(along + across))


# --- (2) ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spread", SPREADS, ids=["lognormal", "halfnormal", "fixed"])
@pytest.mark.parametrize("apart", [0.001, 0.03, 0.3])
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_the_density_is_that_of_an_integral_over_modulus_and_spread(spread: Prior, apart: float, n: int) -> None:
    lot = replace(LOT, spread=spread)
    width = np.log(lot.own.factor)
    x = 0.2 + apart * np.linspace(-1, 1, n)
    if isinstance(spread, Fixed):
        wanted = _normal(lot, x, spread.value)
    else:
        around = [float(spread.to_normal(max(float(np.std(x)), 1e-4))), 0.0]
        # The density given a spread is of a closed form; that it is an integral over the modulus is tested below.
        wanted = quad(
            lambda z: float(norm.pdf(z)) * _normal(lot, x, float(spread.ppf_normal(z))), -8, 8, points=around, limit=200
        )[0]
    assert lot.log_density(x[None] / width)[0] - n * np.log(width) == pytest.approx(np.log(wanted), abs=2e-3)


def test_the_density_given_a_spread_is_an_integral_over_the_modulus_of_the_lot() -> None:
    x, sigma = np.array([0.1, 0.14, 0.05]), np.log(1.6)
    wanted = quad(lambda mu: float(norm.pdf(mu, 0, sigma) * np.prod(norm.pdf(x, mu, 0.03))), -1, 1, points=[0.1])[0]
    assert _normal(LOT, x, 0.03) == pytest.approx(wanted, rel=1e-6)


def test_it_integrates_to_one() -> None:
    # Over two specimens, by draws from a wide normal density.
    rng = np.random.default_rng(1)
    wide = multivariate_normal(cov=np.array([[1.2, 1.15], [1.15, 1.2]]))
    z = wide.rvs(40_000, random_state=rng)
    ratio = LOT.log_density(z) - wide.logpdf(z)
    assert np.exp(logsumexp(ratio)) / len(z) == pytest.approx(1, abs=0.03)


def test_specimens_that_do_not_differ_have_the_modulus_of_the_lot() -> None:
    lot = replace(LOT, spread=Fixed(1e-6))
    z = np.array([[0.4], [0.1]]) * np.ones(3)
    alike, other = lot.log_density(z)
    assert alike - other == pytest.approx(norm.logpdf(0.4) - norm.logpdf(0.1), abs=1e-6)
    modulus, spread = lot.draw_of(np.tile(z[:1], (50, 1)), np.random.default_rng(1))
    np.testing.assert_allclose(modulus, lot.own.ppf_normal(0.4), rtol=1e-5)
    np.testing.assert_array_equal(spread, 1e-6)


def test_draws_lie_as_the_density_says() -> None:
    z, modulus, spread = LOT.draw(3, np.random.default_rng(2), 20_000)
    np.testing.assert_allclose(np.cov(z.T), LOT.covariance(3), atol=0.03)
    assert np.std(np.log(modulus)) == pytest.approx(np.log(1.6), rel=0.02)
    assert np.median(spread) == pytest.approx(0.04, rel=0.03)
    within = np.log(LOT.own.factor) * np.std(z, axis=1, ddof=1)
    assert np.mean(within**2) == pytest.approx(np.mean(spread**2), rel=0.1)


@pytest.mark.parametrize("spread", SPREADS[:2], ids=["lognormal", "halfnormal"])
def test_modulus_and_spread_given_specimens_are_those_of_lots_with_such_specimens(spread: Prior) -> None:
    # Of lots with their specimens (mu, tau, x), the same pairs come out if mu and tau are drawn anew given x.
    lot = replace(LOT, spread=spread)
    rng = np.random.default_rng(3)
    z, modulus, spreads = lot.draw(4, rng, 20_000)
    again, other = lot.draw_of(z, rng)
    scatter = np.std(z, axis=1)
    for found, wanted in ((again, modulus), (other, spreads)):
        np.testing.assert_allclose(np.quantile(found, [0.1, 0.5, 0.9]), np.quantile(wanted, [0.1, 0.5, 0.9]), rtol=0.05)
    shown = [np.corrcoef(np.log(scatter), np.log(s))[0, 1] for s in (other, spreads)]
    assert shown[0] == pytest.approx(shown[1], abs=0.02)
    assert len(np.unique(other)) == len(other)  # no steps of a grid


def test_the_spread_given_specimens_follows_its_density() -> None:
    x = np.array([0.0, 0.05, -0.02, 0.06])
    _, spread = LOT.draw_of(np.tile(x / np.log(LOT.own.factor), (20_000, 1)), np.random.default_rng(4))
    grid = np.linspace(-4, 4, 801)
    weight = norm.pdf(grid) * [_normal(LOT, x, float(LOT.spread.ppf_normal(z))) for z in grid]
    below = np.cumsum(weight) / np.sum(weight)
    for q in (0.05, 0.5, 0.95):
        wanted = float(LOT.spread.ppf_normal(np.interp(q, below, grid)))
        assert np.quantile(spread, q) == pytest.approx(wanted, rel=0.03)


# --- among all unknowns -------------------------------------------------------------------------------------------------


def test_each_specimen_has_a_modulus_and_the_lot_is_no_unknown(make_lot: MakePosterior) -> None:
    problem = _problem(make_lot())
    assert [n for n in problem.names if n.startswith("young")] == ["young_modulus[sensor 1]", "young_modulus[sensor 2]"]
    assert [p.name for p in make_lot().parameters[-2:]] == ["young_modulus", "young_modulus_spread"]
    known = _problem(make_lot(spread=Fixed(0.1)))
    assert known.fixed == {"young_modulus_spread": 0.1}
    assert list(values_of_lot(known, np.zeros((2, len(known.names))), np.random.default_rng(1))) == ["young_modulus"]


def test_what_makes_specimens_alike_is_the_one_term_more_of_the_posterior(make_lot: MakePosterior) -> None:
    problem = _problem(make_lot())
    z = 0.05 * np.random.default_rng(1).standard_normal((4, len(problem.names)))
    lot = problem.table.lot
    assert lot is not None
    apart = replace(problem, experiment=replace(problem.experiment, pooling="complete"))
    np.testing.assert_allclose(log_posterior(problem, z) - log_posterior(apart, z), lot.log_ratio(z), atol=1e-6)
    np.testing.assert_allclose(log_prior(problem, z) + 0.5 * np.sum(z**2, axis=1), lot.log_ratio(z), atol=1e-9)


def test_the_prior_as_normal_has_the_covariance_of_the_prior(make_lot: MakePosterior) -> None:
    problem = _problem(make_lot())
    n = len(problem.names)
    draws = prior_coordinates(problem, np.random.default_rng(2), 20_000)
    np.testing.assert_allclose(np.cov(draws.T), prior_covariance(problem, n), atol=0.05)
    z = draws[:5]
    normal = multivariate_normal(cov=prior_covariance(problem, n)).logpdf(z) + 0.5 * n * np.log(2 * np.pi)
    np.testing.assert_allclose(log_prior_as_normal(problem, z), normal)


def test_values_drawn_before_the_data_are_of_lots_with_their_specimens(make_lot: MakePosterior) -> None:
    values = prior_values(_problem(make_lot(spread=Fixed(0.02))), np.random.default_rng(2), 4000)
    for name in ("sensor 1", "sensor 2"):
        away = np.log(values[f"young_modulus[{name}]"] / values["young_modulus"])
        assert np.std(away) == pytest.approx(0.02, rel=0.05)


def test_climbs_know_the_slope_of_what_they_climb(make_lot: MakePosterior) -> None:
    space = coordinates(_problem(make_lot()))
    x = space.nominal()
    lot = space.problem.table.lot
    assert lot is not None
    x[lot.columns] = [-0.3, -0.2]
    slopes = slopes_at(space, x, 1e-8)  # hardly more than the prior
    assert slopes is not None
    step = 1e-4 * np.eye(x.size)[lot.columns]
    by_difference = (tempered(space, x + step, 1e-8) - tempered(space, x - step, 1e-8)) / 2e-4
    np.testing.assert_allclose(slopes[0][lot.columns], by_difference, rtol=1e-4, atol=1e-4)
    assert np.all(np.linalg.eigvalsh(slopes[1]) > 0)


def test_a_density_by_name_is_that_of_the_values(make_lot: MakePosterior) -> None:
    problem = _problem(make_lot())
    near = {name: float(v[0]) for name, v in values_at(problem, np.full((1, len(problem.names)), 0.05)).items()}
    apart = {**near, "young_modulus[sensor 1]": near["young_modulus[sensor 1]"] * 1.2}
    z = np.array([[float(p.prior.to_normal(v[p.name])) for p in problem.parameters] for v in (near, apart)])
    of_z = log_posterior(problem, z)
    slope = np.log(1.2)  # of a log-normal prior d x / d z is proportional to x
    assert log_density(problem, apart) - log_density(problem, near) == pytest.approx(of_z[1] - of_z[0] - slope, rel=1e-6)


def test_a_chain_is_not_continued_as_that_of_another_lot(make_lot: MakePosterior, make_posterior: MakePosterior) -> None:
    marks = {identity_of(_problem(p), 1).fingerprint for p in (make_lot(), make_lot(spread=HalfNormal(0.05)), make_posterior())}
    assert len(marks) == 3


def test_lots_of_no_specimen_that_is_far_out_break_nothing() -> None:
    lot = Lot(LOT, np.array([0, 1]))
    z = np.array([[1e200, -1e200], [np.nan, 0.0], [40.0, -40.0]])
    found = lot.log_ratio(z)
    assert not np.any(np.isnan(found))
    assert found[0] == -np.inf


# --- the file -----------------------------------------------------------------------------------------------------------


def _tables(**priors: Any) -> dict[str, Any]:
    own = {"sensor_thickness": {"normal": ["0.74 mm", "0.02 mm"]}, "padding_thickness": {"normal": ["1.1 mm", "0.03 mm"]}}
    return {
        "pooling": "partial",
        "indenter": {"radius": "5 mm"},
        "sensor": {"radius": "10 mm"},
        "priors": priors,
        "specimens": [{"name": "a", "force": "sensor1_instron.csv", "priors": own}],
    }


def test_pooling_is_read_and_kept() -> None:
    experiment = experiment_from(_tables(young_modulus_spread={"halfnormal": 0.05}), DATASET)
    assert experiment.pooling == "partial"
    assert experiment_from_json(experiment_to_json(experiment)) == experiment
    assert experiment_from({**_tables(), "pooling": "complete"}, DATASET).pooling == "complete"


@pytest.mark.parametrize(
    ("priors", "said"),
    [
        (
            {"young_modulus": {"normal": ["0.7 MPa", "0.1 MPa"]}},
            r'must be log-normal[^!]*young_modulus = { lognormal = \["0.7 MPa", 1.15\] }, or pooling = "complete"',
        ),
        ({"young_modulus": {"fixed": "0.7 MPa"}}, r'must be log-normal[^!]*lognormal = \["0.7 MPa", 1.1\]'),
        ({"young_modulus_spread": {"fixed": 0}}, r'must be above 0 and at most 1, got 0[^!]*write pooling = "complete"'),
        ({"young_modulus_spread": {"lognormal": [5, 2]}}, r"must be above 0 and at most 1, got 5[^!]*5 % as 0.05"),
    ],
)
def test_what_a_lot_cannot_be_is_refused_with_what_to_write(priors: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        experiment_from(_tables(**priors), DATASET)


def test_a_spread_of_specimens_that_share_a_modulus_is_refused() -> None:
    tables = {**_tables(young_modulus_spread={"halfnormal": 0.05}), "pooling": "complete"}
    with pytest.raises(InputError, match=r'no meaning for specimens that share one modulus[^!]*pooling = "partial"'):
        experiment_from(tables, DATASET)
