"""A problem as other people's optimisers and samplers see it: values by name and unit, residuals of variance one, densities."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from calib.errors import InputError
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.priors.distributions import Fixed, LogNormal, Normal, Prior
from calib.problem.by_name import log_density, medians, readings, residuals
from calib.problem.likelihood import log_likelihood, log_posterior
from calib.problem.problem import Problem, build_problem
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.problem.values import coordinates_of
from models.analytic import ClosedForm
from models.examples import PAPER_SENSOR
from models.response import OutOfRangeError
from models.sensor import FloatArray, design_from

TRUTH = {"young_modulus": 0.69e6, "contact_offset[s]": 0.03e-3, "load_zero[s]": 0.05}
EXACT = ClosedForm(force_error=0.0, capacitance_error=0.0)


@pytest.fixture(scope="module")
def problem() -> Problem:
    rig = Rig(contact_offset=0.03e-3, load_zero=0.05, parasitic_capacitance=0.2e-12, force_noise=5e-3, capacitance_noise=5e-15)
    sweep = synthetic_sweep(EXACT, design_from(PAPER_SENSOR), 0.6e-3, rig, np.random.default_rng(5), specimen="s", tie="force")
    priors: dict[str, Prior] = {
        "young_modulus": LogNormal(0.8e6, 1.5),
        "relative_permittivity": Normal(2.8, 0.2),
        "parasitic_capacitance": Fixed(0.2e-12),
        "machine_compliance": Fixed(0.0),
        "force_noise": Fixed(5e-3),
        "capacitance_noise": Fixed(5e-15),
    }
    thickness: dict[str, Prior] = {
        "sensor_thickness": Fixed(PAPER_SENSOR["sensor_thickness"]),
        "padding_thickness": Fixed(PAPER_SENSOR["padding_thickness"]),
    }
    specimen = Specimen("s", (SweepFiles("", Path("a.csv"), Path("b.csv"), 5e-3),), thickness)
    experiment = Experiment(
        "by name", None, "", 5e-3, 10e-3, "sensor", priors, (specimen,), model="closed form", discrepancy="off"
    )
    return build_problem(experiment, [sweep], EXACT)


def test_residuals_at_the_truth_are_independent_and_of_variance_one(problem: Problem) -> None:
    found = residuals(problem, TRUTH)
    assert found.shape == (80,)
    assert np.std(found) == pytest.approx(1.0, abs=0.2)
    assert abs(np.corrcoef(found[:-1], found[1:])[0, 1]) < 0.3


def test_values_are_numbers_in_si_or_texts_with_a_unit(problem: Problem) -> None:
    by_text = {"young_modulus": "0.69 MPa", "contact_offset[s]": "30 um", "load_zero[s]": "50 mN"}
    np.testing.assert_allclose(residuals(problem, by_text), residuals(problem, TRUTH), atol=1e-9)
    assert residuals(problem, {}) == pytest.approx(residuals(problem, medians(problem)))


def test_another_optimiser_finds_the_modulus_through_residuals(problem: Problem) -> None:
    start = medians(problem)
    scale = np.array([1e5, 0.1, 1e-5, 1e-2])

    def off(x: FloatArray) -> FloatArray:
        return residuals(problem, dict(zip(problem.names, x * scale, strict=True)))

    found = least_squares(off, np.array(list(start.values())) / scale, diff_step=np.full(scale.size, 1e-4))
    fitted = dict(zip(problem.names, found.x * scale, strict=True))
    assert fitted["young_modulus"] == pytest.approx(0.69e6, rel=0.01)
    assert fitted["contact_offset[s]"] == pytest.approx(0.03e-3, abs=2e-6)


def test_residuals_and_log_determinant_are_the_likelihood(problem: Problem) -> None:
    z = coordinates_of(problem, np.array([[{**medians(problem), **TRUTH}[name] for name in problem.names]]))
    table = readings(problem, TRUTH)
    density = -0.5 * np.sum(residuals(problem, TRUTH) ** 2) - np.sum(np.log(table["sd"])) - 40 * np.log(2 * np.pi)
    assert density == pytest.approx(log_likelihood(problem, z)[0], rel=1e-9)


def test_the_log_density_is_the_posterior_times_the_change_of_coordinates(problem: Problem) -> None:
    one, other = TRUTH, {**TRUTH, "young_modulus": 0.68e6, "load_zero[s]": 0.06}
    x = np.array([[{**medians(problem), **v}[name] for name in problem.names] for v in (one, other)])
    z = coordinates_of(problem, x)
    # The modulus is log-normal: |dz/dx| goes like 1/x. The other priors here have constant or equal slopes, but for the zero.
    slope = np.log(0.68 / 0.69)
    zero = next(p.prior for p in problem.parameters if p.parameter == "load_zero")
    widths = [
        float(zero.ppf_normal(float(zero.to_normal(v)) + 1e-4) - zero.ppf_normal(float(zero.to_normal(v)) - 1e-4))
        for v in (0.05, 0.06)
    ]
    expected = np.diff(log_posterior(problem, z))[0] - slope - np.log(widths[1] / widths[0])
    assert log_density(problem, other) - log_density(problem, one) == pytest.approx(expected, abs=1e-4)


def test_readings_are_a_table_with_what_was_read_and_what_should_have_been(problem: Problem) -> None:
    table = readings(problem, TRUTH)
    assert list(table.columns) == ["specimen", "sweep", "channel", "depth", "observed", "predicted", "sd", "residual"]
    assert table.groupby("channel", sort=False).size().to_dict() == {"force": 40, "capacitance": 40}
    assert np.sqrt(np.mean(table["residual"] ** 2)) == pytest.approx(1.0, abs=0.2)


def test_a_wrong_name_unit_or_size_is_refused_with_what_there_is(problem: Problem) -> None:
    with pytest.raises(InputError) as caught:
        residuals(problem, {"youngs_modulus": 1.0, "load_zero[s]": "3 mm"})
    assert "no unknown 'youngs_modulus'" in str(caught.value)
    assert "young_modulus, relative_permittivity" in str(caught.value)
    assert 'unit "mm" cannot be converted to N' in str(caught.value)
    with pytest.raises(OutOfRangeError, match="not covered at these values"):
        residuals(problem, {"contact_offset[s]": -3e-3})
    assert log_density(problem, {"contact_offset[s]": -3e-3}) == -np.inf
    assert log_density(replace(problem), {"young_modulus": -1.0}) == -np.inf
