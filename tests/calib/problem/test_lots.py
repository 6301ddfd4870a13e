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
from calib.priors.distributions import Fixed, HalfNormal, LogNormal, Normal, Prior
from calib.problem.by_name import log_density
from calib.problem.likelihood import log_posterior
from calib.problem.lots import Lot, LotPrior, lot_of
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
VALUES: list[LogNormal | Normal] = [LogNormal(0.7e-3, 1.2), Normal(0.7e-3, 0.14e-3)]
#: What a microscope reads of four specimens, of the last of which nothing is known, in the two kinds.
READ: list[tuple[LogNormal | Normal | None, ...]] = [
    (LogNormal(0.75e-3, 1.03), LogNormal(0.7e-3, 1.03), LogNormal(0.8e-3, 1.08), None),
    (Normal(0.75e-3, 0.02e-3), Normal(0.7e-3, 0.02e-3), Normal(0.8e-3, 0.05e-3), None),
]


def _lot(n: int, spread: Prior = SPREADS[0]) -> LotPrior:
    """Moduli of n specimens, of which nothing is known by themselves."""
    return LotPrior(LogNormal(0.7e6, 1.6), spread, (None,) * n)


def _read(kind: int, spread: Prior = SPREADS[0]) -> LotPrior:
    """Thicknesses of four specimens, some of them measured, the third meant to be 1.1 times as thick."""
    return LotPrior(VALUES[kind], spread, READ[kind], (1.0, 1.0, 1.1, 1.0))


def _problem(posterior: Posterior) -> Problem:
    return build_problem(posterior.experiment, posterior.sweeps, ClosedForm())


def _normal(x: FloatArray, spread: float, sigma: float) -> float:
    """Density of x (n,) given a spread, mu integrated out: along the mean, and across it."""
    n, middle = x.size, np.mean(x)
    along = norm.logpdf(np.sqrt(n) * middle, 0, np.sqrt(spread**2 + n * sigma**2))
    across = -0.5 * (n - 1) * np.log(2 * np.pi * spread**2) - 0.5 * np.sum((x - middle) ** 2) / spread**2
    return float(np.exp(along + across))


# --- (3) ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spread", SPREADS, ids=["lognormal", "halfnormal", "fixed"])
@pytest.mark.parametrize("apart", [0.001, 0.03, 0.3])
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_the_density_is_that_of_an_integral_over_modulus_and_spread(spread: Prior, apart: float, n: int) -> None:
    lot = _lot(n, spread)
    (width,) = set(np.log([own.factor for own in lot.specimen_priors if isinstance(own, LogNormal)]))
    x = 0.2 + apart * np.linspace(-1, 1, n)
    if isinstance(spread, Fixed):
        wanted = _normal(x, spread.value, np.log(1.6))
    else:
        around = [float(spread.to_normal(max(float(np.std(x)), 1e-4))), 0.0]
        # The density given a spread is of a closed form; that it is an integral over the modulus is tested below.
        wanted = quad(
            lambda z: float(norm.pdf(z)) * _normal(x, float(spread.ppf_normal(z)), np.log(1.6)), -8, 8, points=around, limit=200
        )[0]
    assert lot.log_density(x[None] / width)[0] - n * np.log(width) == pytest.approx(np.log(wanted), abs=2e-3)


def test_the_density_given_a_spread_is_an_integral_over_the_modulus_of_the_lot() -> None:
    x, sigma = np.array([0.1, 0.14, 0.05]), np.log(1.6)
    wanted = quad(lambda mu: float(norm.pdf(mu, 0, sigma) * np.prod(norm.pdf(x, mu, 0.03))), -1, 1, points=[0.1])[0]
    assert _normal(x, 0.03, sigma) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("kind", [0, 1], ids=["log-normal", "normal"])
@pytest.mark.parametrize("spread", SPREADS[::2], ids=["lognormal", "fixed"])
def test_what_was_measured_of_specimens_multiplies_what_is_believed_of_their_lot(kind: int, spread: Prior) -> None:
    lot, value = _read(kind, spread), VALUES[kind]
    thickness = 1e-3 * np.array([[0.74, 0.70, 0.79, 0.73], [0.76, 0.72, 0.85, 0.70], [0.60, 0.75, 0.80, 0.75]])
    z = np.stack([own.to_normal(v) for own, v in zip(lot.specimen_priors, thickness.T, strict=True)], axis=1)
    share = thickness / (0.7e-3 * np.array([1.0, 1.0, 1.1, 1.0]))
    by_factor = isinstance(value, LogNormal)
    x, sigma = (np.log(share), np.log(1.2)) if by_factor else (share - 1, 0.2)
    wanted = []
    for row, measured in zip(x, thickness, strict=True):
        if isinstance(spread, Fixed):
            of_lot = _normal(row, spread.value, sigma)
        else:
            of_lot = quad(
                lambda z, row=row: float(norm.pdf(z)) * _normal(row, float(spread.ppf_normal(z)), sigma), -8, 8, limit=200
            )[0]
        told = np.log(of_lot)
        for own, v in zip(READ[kind], measured, strict=True):
            if isinstance(own, LogNormal):
                told += norm.logpdf(np.log(own.median), np.log(v), np.log(own.factor))
            elif own is not None:
                told += norm.logpdf(own.mean, v, own.sd)
        wanted.append(told)
    found = lot.log_density(z)
    np.testing.assert_allclose(np.diff(found), np.diff(wanted), atol=5e-3)


@pytest.mark.parametrize("lot", [_lot(2), _read(0), _read(1)], ids=["not measured", "log-normal", "normal"])
def test_it_integrates_to_one(lot: LotPrior) -> None:
    # By draws from a wider normal density.
    wide = multivariate_normal(cov=1.5 * lot.covariance)
    z = wide.rvs(60_000, random_state=np.random.default_rng(1))
    assert np.exp(logsumexp(lot.log_density(z) - wide.logpdf(z))) / len(z) == pytest.approx(1, abs=0.03)


def test_specimens_that_do_not_differ_have_the_modulus_of_the_lot() -> None:
    lot = _lot(3, Fixed(1e-6))
    z = np.array([[0.4], [0.1]]) * np.ones(3)
    alike, other = lot.log_density(z)
    assert alike - other == pytest.approx(norm.logpdf(0.4) - norm.logpdf(0.1), abs=1e-6)
    modulus, spread = lot.draw_of(np.tile(z[:1], (50, 1)), np.random.default_rng(1))
    np.testing.assert_allclose(modulus, lot.specimen_priors[0].ppf_normal(0.4), rtol=1e-5)
    np.testing.assert_array_equal(spread, 1e-6)


@pytest.mark.parametrize("lot", [_lot(3), _read(0), _read(1)], ids=["not measured", "log-normal", "normal"])
def test_draws_lie_as_the_density_says(lot: LotPrior) -> None:
    z, value, _ = lot.draw(np.random.default_rng(2), 20_000)
    np.testing.assert_allclose(np.mean(z, axis=0), 0, atol=0.03)
    np.testing.assert_allclose(np.cov(z.T), lot.covariance, atol=0.04)
    before = lot.before.to_normal(value)
    assert np.mean(before) == pytest.approx(0, abs=0.03)
    assert np.std(before) == pytest.approx(1, rel=0.03)


def test_draws_of_specimens_of_which_nothing_is_known_scatter_by_the_spread() -> None:
    lot = _lot(3)
    z, modulus, spread = lot.draw(np.random.default_rng(2), 20_000)
    assert np.std(np.log(modulus)) == pytest.approx(np.log(1.6), rel=0.02)
    assert np.median(spread) == pytest.approx(0.04, rel=0.03)
    within = np.std(lot.away(z), axis=1, ddof=1)
    assert np.mean(within**2) == pytest.approx(np.mean(spread**2), rel=0.1)


@pytest.mark.parametrize("spread", SPREADS[:2], ids=["lognormal", "halfnormal"])
@pytest.mark.parametrize("measured", [False, True], ids=["not measured", "measured"])
def test_value_and_spread_given_specimens_are_those_of_lots_with_such_specimens(spread: Prior, measured: bool) -> None:
    # Of lots with their specimens (mu, tau, x), the same pairs come out if mu and tau are drawn anew given x.
    lot = _read(1, spread) if measured else _lot(4, spread)
    rng = np.random.default_rng(3)
    z, value, spreads = lot.draw(rng, 20_000)
    again, other = lot.draw_of(z, rng)
    scatter = np.std(lot.away(z), axis=1)
    for found, wanted in ((again, value), (other, spreads)):
        np.testing.assert_allclose(np.quantile(found, [0.1, 0.5, 0.9]), np.quantile(wanted, [0.1, 0.5, 0.9]), rtol=0.05)
    shown = [np.corrcoef(np.log(scatter), np.log(s))[0, 1] for s in (other, spreads)]
    assert shown[0] == pytest.approx(shown[1], abs=0.03)
    assert len(np.unique(other)) == len(other)  # no steps of a grid


def test_the_spread_given_specimens_follows_its_density() -> None:
    x, lot = np.array([0.0, 0.05, -0.02, 0.06]), _lot(4)
    (width,) = set(np.log([own.factor for own in lot.specimen_priors if isinstance(own, LogNormal)]))
    _, spread = lot.draw_of(np.tile(x / width, (20_000, 1)), np.random.default_rng(4))
    grid = np.linspace(-4, 4, 801)
    weight = norm.pdf(grid) * [_normal(x, float(lot.spread.ppf_normal(z)), np.log(1.6)) for z in grid]
    below = np.cumsum(weight) / np.sum(weight)
    for q in (0.05, 0.5, 0.95):
        wanted = float(lot.spread.ppf_normal(np.interp(q, below, grid)))
        assert np.quantile(spread, q) == pytest.approx(wanted, rel=0.03)


@pytest.mark.parametrize("kind", [0, 1], ids=["log-normal", "normal"])
def test_lots_hold_what_was_drawn_where_a_microscope_reads_their_specimens(kind: int) -> None:
    # Lot, specimens and what is read of them are drawn; the lot given what is read alone has to hold them as often as it says.
    rng, value = np.random.default_rng(5), VALUES[kind]
    inside = []
    for _ in range(150):
        spread, mu = float(SPREADS[0].ppf_normal(rng.standard_normal())), (np.log(1.2), 0.2)[kind] * rng.standard_normal()
        x = mu + spread * rng.standard_normal(4)
        error = np.array([0.03, 0.02, 0.05, 0.03])
        read = x + error * rng.standard_normal(4)
        known: tuple[LogNormal | Normal, ...]
        if isinstance(value, LogNormal):
            known = tuple(LogNormal(0.7e-3 * np.exp(r), np.exp(e)) for r, e in zip(read, error, strict=True))
        else:
            known = tuple(Normal(0.7e-3 * (1 + r), 0.7e-3 * e) for r, e in zip(read, error, strict=True))
        lot = LotPrior(value, SPREADS[0], known)
        z, of_lot, spreads = lot.draw(rng, 400)
        truths = [(lot.away(z)[:, k], x[k]) for k in range(4)] + [(lot.away_of(of_lot), mu), (spreads, spread)]
        inside.append([0.05 < np.mean(drawn < truth) < 0.95 for drawn, truth in truths])
    assert np.mean(inside) == pytest.approx(0.9, abs=0.03)
    assert np.all(np.mean(inside, axis=0) > 0.82)


# --- among all unknowns -------------------------------------------------------------------------------------------------


def test_each_specimen_has_a_modulus_and_the_lot_is_no_unknown(make_lot: MakePosterior) -> None:
    problem = _problem(make_lot())
    assert [n for n in problem.names if n.startswith("young")] == ["young_modulus[sensor 1]", "young_modulus[sensor 2]"]
    pooled = ("young_modulus", "relative_permittivity", "sensor_thickness", "padding_thickness")
    of_lots = [name for quantity in pooled for name in (quantity, f"{quantity}_spread")]
    assert [p.name for p in make_lot().parameters[-8:]] == of_lots
    assert not set(of_lots) & set(problem.names)
    known = _problem(make_lot(spread=Fixed(0.1)))
    assert known.fixed == {"young_modulus_spread": 0.1}
    assert list(values_of_lot(known, np.zeros((2, len(known.names))), np.random.default_rng(1)))[:2] == list(pooled[:2])


def test_what_makes_specimens_alike_is_the_one_term_more_of_the_posterior(make_lot: MakePosterior) -> None:
    problem = _problem(make_lot())
    z = 0.05 * np.random.default_rng(1).standard_normal((4, len(problem.names)))
    assert len(problem.table.lots) == 4
    ratio = np.sum([lot.log_ratio(z) for lot in problem.table.lots], axis=0)
    apart = replace(problem, experiment=replace(problem.experiment, pooling="complete"))
    np.testing.assert_allclose(log_posterior(problem, z) - log_posterior(apart, z), ratio, atol=1e-6)
    np.testing.assert_allclose(log_prior(problem, z) + 0.5 * np.sum(z**2, axis=1), ratio, atol=1e-9)


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
    columns = np.concatenate([lot.columns for lot in space.problem.table.lots])
    exchanged = [e.column for e in space.exchanges]
    assert set(exchanged) <= set(columns)  # of which coordinates are not those of theta
    x[columns] += np.random.default_rng(1).normal(0, 0.3, columns.size)
    x[exchanged] = space.nominal()[exchanged]
    slopes = slopes_at(space, x, 1e-8)  # hardly more than the prior
    assert slopes is not None
    step = 1e-4 * np.eye(x.size)[columns]
    by_difference = (tempered(space, x + step, 1e-8) - tempered(space, x - step, 1e-8)) / 2e-4
    np.testing.assert_allclose(slopes[0][columns], by_difference, rtol=1e-3, atol=1e-3)
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
    problems = [_problem(p) for p in (make_lot(), make_lot(spread=HalfNormal(0.05)), make_posterior())]
    experiment = make_lot().experiment
    first, second = experiment.specimens
    read = replace(second, priors={**second.priors, "sensor_thickness": Normal(0.75e-3, 0.03e-3)})
    meant = [replace(s, nominal={"padding_thickness": wanted}) for s, wanted in ((first, 1.1e-3), (second, 1.3e-3))]
    for specimens in ((first, read), tuple(meant)):
        problems.append(build_problem(replace(experiment, specimens=specimens), make_lot().sweeps, ClosedForm()))
    assert len({identity_of(problem, 1).fingerprint for problem in problems}) == 5


def test_lots_of_no_specimen_that_is_far_out_break_nothing() -> None:
    lot = Lot("young_modulus", _lot(2), np.array([0, 1]))
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
            {"young_modulus": {"uniform": ["0.5 MPa", "0.9 MPa"]}},
            r'must be log-normal or normal[^!]*young_modulus = { lognormal = \["0.7 MPa", 1.22\] }, or pooling = "complete"',
        ),
        (
            {"relative_permittivity": {"truncated_normal": [2.8, 0.5, 2.5, 12]}},
            r"must be log-normal or normal[^!]*relative_permittivity = { lognormal = \[2.98, 1.13\] }",
        ),
        ({"young_modulus_spread": {"fixed": 0}}, r'must be above 0 and at most 1, got 0[^!]*write pooling = "complete"'),
        ({"padding_thickness_spread": {"lognormal": [5, 2]}}, r"must be above 0 and at most 1, got 5[^!]*5 % as 0.05"),
        (
            {"sensor_thickness": {"lognormal": ["0.7 mm", 1.1]}},
            r"of one kind, here log-normal[^!]*lognormal = \[\"0.74 mm\", 1.03\]",
        ),
    ],
)
def test_what_a_lot_cannot_be_is_refused_with_what_to_write(priors: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        experiment_from(_tables(**priors), DATASET)


@pytest.mark.parametrize(
    "tables",
    [
        _tables(young_modulus_spread={"halfnormal": 0.05}),
        _tables(padding_thickness_spread={"halfnormal": 0.05}),
        {**_tables(), "specimens": [{**_tables()["specimens"][0], "nominal": {"padding_thickness": "1 mm"}}]},
    ],
)
def test_what_is_of_a_lot_has_no_meaning_for_specimens_that_are_of_none(tables: dict[str, Any]) -> None:
    assert experiment_from(tables, DATASET).pooling == "partial"
    with pytest.raises(InputError, match=r'no meaning for specimens that are not of one lot[^!]*pooling = "partial"'):
        experiment_from({**tables, "pooling": "complete"}, DATASET)


def _two(second: str, **nominal: str) -> dict[str, Any]:
    """Two specimens, the padding of the second of which is so thick, and what was wanted of each."""
    tables = _tables()
    (first,) = tables["specimens"]
    own = {**first["priors"], "padding_thickness": {"normal": [second, "0.03 mm"]}}
    other = {"name": "b", "force": "sensor2_instron.csv", "priors": own}
    specimens = [
        {**s, "nominal": {"padding_thickness": nominal[s["name"]]}} if s["name"] in nominal else s for s in (first, other)
    ]
    return {**tables, "specimens": specimens}


def test_paddings_that_were_hardly_meant_to_be_alike_are_asked_about() -> None:
    assert experiment_from(_two("1.3 mm"), DATASET)
    with pytest.raises(InputError, match=r'from 1.1 mm to 3 mm[^!]*nominal = { padding_thickness = "3 mm" }'):
        experiment_from(_two("3 mm"), DATASET)
    with pytest.raises(InputError, match=r'nominal padding_thickness of specimen "a" is missing'):
        experiment_from(_two("3 mm", b="3 mm"), DATASET)
    with pytest.raises(InputError, match=r"nominal padding_thickness must be positive, got 0 mm"):
        experiment_from(_two("3 mm", a="1 mm", b="0 mm"), DATASET)
    experiment = experiment_from(_two("3 mm", a="1 mm", b="3 mm"), DATASET)
    assert experiment_from_json(experiment_to_json(experiment)) == experiment
    lot = lot_of(experiment, "padding_thickness", ["a", "b"])
    assert lot.value == Normal(1e-3, 0.2e-3)
    assert lot.nominal == pytest.approx((1.0, 3.0))
    # As the first came out a tenth thicker than wanted, the second is believed to be a little thicker than was read.
    first, second = (float(own.ppf_normal(0.0)) for own in lot.specimen_priors)
    assert 1.06e-3 < first < 1.1e-3
    assert 3.0e-3 < second < 3.05e-3


def test_a_thickness_of_the_lot_may_be_given_in_place_of_those_of_its_specimens() -> None:
    tables = _tables(sensor_thickness={"normal": ["0.75 mm", "0.05 mm"]})
    del tables["specimens"][0]["priors"]["sensor_thickness"]
    lot = lot_of(experiment_from(tables, DATASET), "sensor_thickness", ["a"])
    (own,) = lot.specimen_priors
    low, high = own.interval(0.68)
    assert (high - low) / 2 > 0.05e-3  # the lot, and the spread about it
    with pytest.raises(InputError, match=r'sensor_thickness of specimen "a" is missing'):
        experiment_from({**tables, "pooling": "complete", "priors": {}}, DATASET)


def test_what_is_fixed_is_known_and_not_pooled(make_lot: MakePosterior) -> None:
    experiment = make_lot().experiment
    first, second = experiment.specimens
    first = replace(first, priors={**first.priors, "padding_thickness": Fixed(1.1e-3)})
    known = replace(experiment, specimens=(first, second), priors={**experiment.priors, "relative_permittivity": Fixed(2.8)})
    problem = build_problem(known, make_lot().sweeps, ClosedForm())
    assert problem.fixed == {"relative_permittivity": 2.8, "padding_thickness[sensor 1]": 1.1e-3}
    assert [lot.quantity for lot in problem.table.lots] == ["young_modulus", "sensor_thickness", "padding_thickness"]
    assert problem.table.lots[-1].columns.size == 1
