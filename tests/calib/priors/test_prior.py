"""Priors: the map to the standard normal, the forms of the experiment file, and what is said of wrong ones."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from calib.catalogue import UNKNOWNS
from calib.errors import InputError
from calib.priors.defaults import default_prior
from calib.priors.distributions import Fixed, HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform, prior_from_json
from calib.priors.forms import parse_prior, parse_value

# Each prior beside the same distribution in scipy.stats, an independent implementation.
PRIORS = [
    (Normal(2.8, 0.2), stats.norm(2.8, 0.2)),
    (LogNormal(0.7e6, 1.6), stats.lognorm(s=math.log(1.6), scale=0.7e6)),
    (HalfNormal(5e-6), stats.halfnorm(scale=5e-6)),
    (Uniform(-0.5e-3, 0.5e-3), stats.uniform(-0.5e-3, 1e-3)),
    (TruncatedNormal(2.85, 0.25, 2.0, 12.0), stats.truncnorm(-3.4, 36.6, 2.85, 0.25)),
    (TruncatedNormal(0.0, 1.0, -5.0, 5.0), stats.truncnorm(-5, 5)),
    (TruncatedNormal(0.74e-3, 0.02e-3, 0.0, math.inf), stats.norm(0.74e-3, 0.02e-3)),
    (TruncatedNormal(-2.0, 1.0, 0.0, 0.5), stats.truncnorm(2.0, 2.5, -2.0, 1.0)),
    (TruncatedNormal(3.0, 1.0, -0.5, 0.5), stats.truncnorm(-3.5, -2.5, 3.0, 1.0)),
    (TruncatedNormal(0.1, 1.0, 0.0, 0.2), stats.truncnorm(-0.1, 0.1, 0.1, 1.0)),
]
IDS = [repr(prior) for prior, _ in PRIORS]
FREE = [prior for prior, _ in PRIORS]

each = pytest.mark.parametrize("prior", FREE, ids=IDS)


@pytest.mark.parametrize(("prior", "reference"), PRIORS, ids=IDS)
def test_values_are_the_quantiles_of_the_distribution(prior: Prior, reference: stats.rv_continuous) -> None:
    z = np.linspace(-5, 5, 201)
    scale = reference.ppf(0.84) - reference.ppf(0.16)
    lower, upper = z[z <= 0], z[z > 0]
    expected = np.concatenate([reference.ppf(stats.norm.cdf(lower)), reference.isf(stats.norm.sf(upper))])
    np.testing.assert_allclose(prior.ppf_normal(z), expected, rtol=1e-9, atol=1e-9 * scale)


@pytest.mark.parametrize(("prior", "reference"), PRIORS, ids=IDS)
def test_a_standard_normal_pushed_through_the_prior_has_its_mean(prior: Prior, reference: stats.rv_continuous) -> None:
    z = np.linspace(-9, 9, 20001)
    mean = integrate.simpson(prior.ppf_normal(z) * stats.norm.pdf(z), x=z)
    assert mean == pytest.approx(reference.mean(), rel=1e-6, abs=1e-9 * reference.std())


@each
def test_values_increase_with_z_into_both_tails(prior: Prior) -> None:
    z = np.linspace(-8, 8, 1601)
    x = prior.ppf_normal(z)
    assert np.all(np.isfinite(x))
    assert np.all(np.diff(x) > 0) if not math.isfinite(sum(prior.support)) else np.all(np.diff(x) >= 0)


@each
def test_to_normal_inverts_ppf_normal(prior: Prior) -> None:
    # Near a bound a float cannot hold more of z than the digits of x; 5 sd is what a posterior can reach.
    z = np.linspace(-5, 5, 101)
    np.testing.assert_allclose(prior.to_normal(prior.ppf_normal(z)), z, atol=2e-5)
    middle = np.linspace(-3, 3, 61)
    np.testing.assert_allclose(prior.to_normal(prior.ppf_normal(middle)), middle, atol=1e-9)


@pytest.mark.parametrize(
    "prior",
    [Normal(0, 2e-12), LogNormal(0.8e6, 1.8), HalfNormal(2e-6), TruncatedNormal(0.74e-3, 0.02e-3, 0.0, math.inf)],
    ids=repr,
)
def test_upper_tails_without_a_bound_are_exact_to_eight_sd(prior: Prior) -> None:
    z = np.linspace(0, 8, 81)
    np.testing.assert_allclose(prior.to_normal(prior.ppf_normal(z)), z, rtol=1e-9, atol=1e-9)


def test_the_half_normal_is_exact_close_to_zero() -> None:
    # Close to zero F(x) = x / scale * sqrt(2 / pi), so that x = scale * sqrt(pi / 2) * Phi(z).
    z = np.array([-8.0, -7.0, -6.0])
    np.testing.assert_allclose(HalfNormal(5e-6).ppf_normal(z), 5e-6 * math.sqrt(math.pi / 2) * stats.norm.cdf(z), rtol=1e-12)


@given(
    mean=st.floats(-3, 3),
    sd=st.floats(0.05, 10),
    low=st.floats(-2, 0),
    width=st.floats(0.1, 5),
    z=st.lists(st.floats(-8, 8), min_size=2, max_size=20),
)
def test_truncated_normal_stays_inside_its_bounds_and_keeps_order(
    mean: float, sd: float, low: float, width: float, z: list[float]
) -> None:
    try:
        prior = TruncatedNormal(mean, sd, low, low + width)
    except ValueError:
        return
    x = prior.ppf_normal(np.sort(z))
    assert np.all((x > low) & (x < low + width))
    assert np.all(np.diff(x) >= -1e-12 * sd)


def test_a_thickness_is_never_zero_however_deep_in_the_tail() -> None:
    prior = parse_prior("padding_thickness", {"normal": ["1 mm", "0.3 mm"]})
    assert np.all(prior.ppf_normal(np.array([-8.0, -12.0, -40.0])) > 0)


@each
def test_the_coordinate_is_nan_outside_the_support_and_infinite_at_a_bound(prior: Prior) -> None:
    low, high = prior.support
    if math.isfinite(low):
        assert np.isnan(prior.to_normal(low - 1.0))
        assert float(prior.to_normal(low)) == -math.inf
    if math.isfinite(high):
        assert np.isnan(prior.to_normal(high + 1.0))
        assert float(prior.to_normal(high)) == math.inf


@each
def test_an_array_goes_in_and_an_array_of_the_same_shape_comes_out(prior: Prior) -> None:
    z = np.zeros((3, 2))
    assert prior.ppf_normal(z).shape == (3, 2)
    assert prior.to_normal(prior.ppf_normal(z)).shape == (3, 2)
    assert prior.ppf_normal(np.zeros(0)).shape == (0,)


@pytest.mark.parametrize(("prior", "reference"), PRIORS, ids=IDS)
def test_interval_is_central(prior: Prior, reference: stats.rv_continuous) -> None:
    lo, hi = prior.interval(0.9)
    assert reference.cdf(lo) == pytest.approx(0.05)
    assert reference.sf(hi) == pytest.approx(0.05)


@pytest.mark.parametrize("mass", [0.0, 1.0, 90.0])
def test_interval_of_an_impossible_mass_is_refused(mass: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        Normal(0, 1).interval(mass)


def test_a_fixed_value_is_the_same_at_every_z() -> None:
    prior = Fixed(1.1e-3)
    assert prior.ppf_normal(np.array([-3.0, 0.0, 5.0])).tolist() == [1.1e-3] * 3
    assert prior.interval(0.9) == prior.support == (1.1e-3, 1.1e-3)
    assert float(prior.to_normal(1.1e-3)) == 0


@pytest.mark.parametrize("prior", [*FREE, Fixed(3.0)], ids=repr)
def test_json_brings_the_same_prior_back(prior: Prior) -> None:
    text = json.dumps(prior.to_json(), allow_nan=False)
    assert prior_from_json(json.loads(text)) == prior


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"kind": "cauchy"}, "cauchy"),
        ({"kind": "normal", "mean": 1.0}, "needs a number sd"),
        ({"kind": "normal", "mean": None}, "mean"),
    ],
)
def test_json_of_no_prior_is_refused(data: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        prior_from_json(data)


@pytest.mark.parametrize(
    ("kind", "numbers", "message"),
    [
        (Normal, (0.0, 0.0), "sd of a normal prior must be positive, got 0.0"),
        (Normal, (math.nan, 1.0), "mean of a normal prior must be finite"),
        (LogNormal, (-1.0, 2.0), "median"),
        (LogNormal, (1.0, 1.0), "geometric sd of a log-normal prior must be above 1, got 1.0"),
        (HalfNormal, (-2.0,), "scale"),
        (Uniform, (2.0, 1.0), "low must be below high, got 2.0 and 1.0"),
        (Uniform, (0.0, math.inf), "low must be below high"),
        (TruncatedNormal, (0.0, -1.0, 0.0, 1.0), "sd"),
        (TruncatedNormal, (0.0, 1.0, 1.0, 0.0), "low must be below high"),
        (TruncatedNormal, (0.0, 1.0, 20.0, 30.0), "next to nothing"),
        (TruncatedNormal, (math.inf, 1.0, 0.0, 1.0), "mean"),
        (Fixed, (math.nan,), "finite"),
    ],
)
def test_priors_check_themselves(kind: type[Prior], numbers: tuple[float, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kind(*numbers)


@pytest.mark.parametrize(
    ("parameter", "value", "expected", "words"),
    [
        ("young_modulus", {"lognormal": ["0.7 MPa", 1.6]}, LogNormal(0.7e6, 1.6), "log-normal, median 0.7 MPa, factor 1.6"),
        ("parasitic_capacitance", {"normal": ["0 pF", "2 pF"]}, Normal(0.0, 2e-12), "normal, mean 0 pF, sd 2 pF"),
        (
            "sensor_thickness",
            {"normal": ["0.74 mm", "20 um"]},
            TruncatedNormal(0.74e-3, 20e-6, 0.0, math.inf),
            "normal, mean 0.74 mm, sd 0.02 mm, truncated at zero",
        ),
        ("machine_compliance", {"halfnormal": "5 um/N"}, HalfNormal(5e-6), "half-normal, scale 5 µm/N"),
        ("machine_compliance", {"halfnormal": ["5 um/N"]}, HalfNormal(5e-6), "half-normal, scale 5 µm/N"),
        (
            "contact_offset",
            {"uniform": ["-0.5 mm", "0.5 mm"]},
            Uniform(-0.5e-3, 0.5e-3),
            "uniform between -0.5 mm and 0.5 mm",
        ),
        (
            "relative_permittivity",
            {"truncated_normal": [2.85, 0.25, 2, 12]},
            TruncatedNormal(2.85, 0.25, 2.0, 12.0),
            "normal, mean 2.85, sd 0.25, between 2 and 12",
        ),
        ("padding_thickness", {"fixed": "0 mm"}, Fixed(0.0), "fixed at 0 mm"),
        ("force_discrepancy", {"fixed": 0}, Fixed(0.0), "fixed at 0 %"),
        ("force_discrepancy", {"halfnormal": "1 %"}, HalfNormal(0.01), "half-normal, scale 1 %"),
        ("load_zero", {"fixed": "-0.3 N"}, Fixed(-0.3), "fixed at -0.3 N"),
    ],
)
def test_forms_of_the_experiment_file(parameter: str, value: object, expected: Prior, words: str) -> None:
    prior = parse_prior(parameter, value)
    assert prior == expected
    assert prior.describe(parameter) == words


@pytest.mark.parametrize(
    ("parameter", "value", "parts"),
    [
        ("sensor_thickness", {"normal": ["-0.74 mm", "0.02 mm"]}, ["sensor_thickness must be positive, got -0.74 mm. Give"]),
        ("sensor_thickness", {"fixed": "-0.74 mm"}, ["sensor_thickness must be positive, got -0.74 mm. Give"]),
        ("sensor_thickness", {"fixed": "0 mm"}, ["sensor_thickness must be positive, got 0 mm", '"0.74 mm"']),
        ("padding_thickness", {"fixed": "-1 mm"}, ["padding_thickness must not be negative, got -1 mm"]),
        ("sensor_thickness", {"fixed": 0.74}, ["has no unit, got 0.74", 'Write "0.74 mm"']),
        ("young_modulus", {"fixed": 690000}, ['Write "690000 Pa"']),
        ("indenter_radius", {"fixed": 0.005}, ['Write "5 mm" if it is in metres, "0.005 mm" if in millimetres']),
        ("sensor_thickness", {"normal": [0.74, 0.02]}, ['Write "0.74 mm"', 'Write "0.02 mm"']),
        ("sensor_thickness", {"normal": ["0.74", "0.02 mm"]}, ['"0.74" has no unit']),
        ("sensor_thickness", {"fixed": "0.74 MPa"}, ['sensor_thickness: unit "MPa" cannot be converted to m']),
        ("young_modulus", {"fixed": "0.7 Mpa"}, ['unknown unit "Mpa", did you mean "MPa"?']),
        ("sensor_thickness", {"fixed": "0.74 m"}, ['sensor_thickness cannot be "0.74 m"', "usually given in mm"]),
        ("young_modulus", {"fixed": "0.7 mPa"}, ['young_modulus cannot be "0.7 mPa" (0.0007 Pa)', "usually given in MPa"]),
        ("parasitic_capacitance", {"normal": ["0 pF", "2 PF"]}, ['cannot be "2 PF"', "pF"]),
        ("sensor_thickness", {"fixed": True}, ["must be a quantity in quotes, got true"]),
        ("relative_permittivity", {"fixed": [[2.8]]}, ["must be a number, got a list"]),
        ("relative_permittivity", {"fixed": math.inf}, ["must be finite, got inf"]),
        ("sensor_thickness", {"normal": ["0.74 mm", "0 mm"]}, ["sd of sensor_thickness must be positive", "fixed"]),
        ("sensor_thickness", {"normal": ["0.74 mm", "-0.02 mm"]}, ['must be positive, got "-0.02 mm"']),
        ("machine_compliance", {"halfnormal": "-5 um/N"}, ["scale of machine_compliance must be positive"]),
        ("young_modulus", {"lognormal": ["0.7 MPa", 1]}, ["geometric sd of young_modulus must be above 1, got 1"]),
        ("young_modulus", {"lognormal": ["0.7 MPa", "0.2 MPa"]}, ['a plain number above 1, got "0.2 MPa"']),
        ("young_modulus", {"lognormal": ["-0.7 MPa", 0.9]}, ["must be positive, got -0.7 MPa", "got 0.9"]),
        ("load_zero", {"lognormal": ["-1 N", 2]}, ["median of a log-normal prior must be positive"]),
        ("contact_offset", {"uniform": ["0.5 mm", "-0.5 mm"]}, ['must be below the upper bound, got "0.5 mm" and "-0.5 mm"']),
        ("sensor_thickness", {"uniform": ["-0.1 mm", "1 mm"]}, ['cannot be negative, got a lower bound of "-0.1 mm"']),
        ("sensor_thickness", {"truncated_normal": ["9 mm", "0.1 mm", "0 mm", "1 mm"]}, ["leaves next to nothing"]),
        ("sensor_thickness", {"normal": ["0.74 mm"]}, ["normal takes [mean, sd], got 1 value.", '"mean in mm"']),
        ("machine_compliance", {"halfnormal": ["0 um/N", "5 um/N"]}, ["halfnormal takes scale, got 2 values"]),
        ("young_modulus", {"lognorm": ["0.7 MPa", 1.6]}, ['unknown kind of prior "lognorm"', 'Did you mean "lognormal"?']),
        ("young_modulus", {"gaussian": ["0.7 MPa", "1 MPa"]}, ['Did you mean "normal"?']),
        ("young_modulus", {"half-normal": "1 MPa"}, ['Did you mean "halfnormal"?']),
        ("young_modulus", {"cauchy": "1 MPa"}, ["Known kinds: normal, lognormal"]),
        (
            "young_modulus",
            {"fixed": "1 MPa", "lognormal": ["1 MPa", 2]},
            ["exactly one kind of prior, got fixed and lognormal"],
        ),
        ("young_modulus", {}, ["exactly one kind of prior, got none"]),
        ("young_modulus", "0.7 MPa", ['needs a prior, got "0.7 MPa"', '{ fixed = "0.7 MPa" }']),
        ("young_modulus", 0.7, ["needs a prior, got 0.7", "lognormal"]),
    ],
)
def test_wrong_forms_are_refused_with_the_value_and_advice(parameter: str, value: object, parts: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        parse_prior(parameter, value)
    for part in parts:
        assert part in str(caught.value)


def test_every_fault_of_a_prior_is_reported() -> None:
    with pytest.raises(InputError) as caught:
        parse_prior("sensor_thickness", {"truncated_normal": ["0.74", "0.02 kg", 0, "3 mm"]})
    assert len(caught.value.faults) == 3


def test_a_normal_prior_with_mass_below_zero_is_refused_with_forms_that_are_accepted() -> None:
    with pytest.raises(InputError) as caught:
        parse_prior("sensor_thickness", {"normal": ["0.74 mm", "0.4 mm"]})
    text = str(caught.value)
    assert "cannot be negative, but 3.2 % of the prior lies below zero (mean 0.74 mm, sd 0.4 mm)" in text
    assert '{ truncated_normal = ["0.74 mm", "0.4 mm", "0 mm", "2.34 mm"] }' in text
    assert parse_prior("sensor_thickness", {"truncated_normal": ["0.74 mm", "0.4 mm", "0 mm", "2.34 mm"]}).support[0] == 0


def test_a_mean_next_to_nothing_is_refused_like_any_other_with_mass_below_zero() -> None:
    with pytest.raises(InputError, match="cannot be negative, but 50 % of the prior lies below zero"):
        parse_prior("capacitance_discrepancy", {"normal": [1.1e-308, "0.05 %"]})


def test_a_normal_compliance_around_zero_is_told_to_be_half_normal() -> None:
    with pytest.raises(InputError, match='halfnormal = "5 um/N"'):
        parse_prior("machine_compliance", {"normal": ["0 um/N", "5 um/N"]})


def test_a_normal_prior_of_what_may_be_negative_is_not_truncated() -> None:
    assert parse_prior("load_zero", {"normal": ["0 N", "1 N"]}) == Normal(0.0, 1.0)


def test_a_value_is_read_in_si() -> None:
    assert parse_value("capacitance_noise", "20 fF") == 20e-15
    assert parse_value("relative_permittivity", 3) == 3.0


@pytest.mark.parametrize("parameter", UNKNOWNS)
def test_every_example_in_advice_is_a_prior_that_is_accepted(parameter: str) -> None:
    import tomllib

    assert parse_prior(parameter, tomllib.loads(f"p = {UNKNOWNS[parameter].example}")["p"])


@pytest.mark.parametrize("parameter", [name for name, row in UNKNOWNS.items() if row.default])
def test_every_default_has_a_reason_and_gives_no_impossible_value(parameter: str) -> None:
    prior = default_prior(parameter)
    assert UNKNOWNS[parameter].reason
    if UNKNOWNS[parameter].bounds != "any":
        assert prior.support[0] >= 0


def test_no_stiffening_at_all_is_a_known_value_that_is_accepted() -> None:
    assert parse_prior("stiffening", {"fixed": 0}) == Fixed(0.0)
    with pytest.raises(InputError, match="stiffening must not be negative"):
        parse_prior("stiffening", {"fixed": -0.01})


def test_the_default_modulus_covers_the_silicones_of_its_reason() -> None:
    lo, hi = default_prior("young_modulus").interval(0.95)
    assert lo < 0.26e6
    assert hi > 2.0e6


def test_what_must_be_measured_has_no_default() -> None:
    with pytest.raises(ValueError, match="sensor_thickness has no default prior"):
        default_prior("sensor_thickness")
