"""What headlines rest on: exact for normal posteriors, silent in sound labs, named in the verdict where a prior pulls."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr, ndtri

from calib.checks.reasons import judge_posterior, passed_gates
from calib.checks.sensitivity import cumulative_distance, pull_limit, sensitivities, sensitivity_of_headlines, with_sensitivity
from calib.checks.verdict import Reason
from calib.report.section import Results
from calib.report.sections.sensitivity import section, sensitivity_rows
from calib.report.summary import summary_json
from calib.sampling import Posterior, Pull, Sensitivity
from calib.sampling.diagnostics import diagnostics_from_json, diagnostics_to_json

MakePosterior = Callable[..., Posterior]

LIMIT = pull_limit(1)
QUANTILES = ndtri((np.arange(4000) + 0.5) / 4000)


def of_normal(mean: float, variance: float) -> Sensitivity:
    """A quantity with a standard-normal prior, and a normal posterior of this mean and variance."""
    z = mean + math.sqrt(variance) * QUANTILES
    precision = 1 / variance - 1
    reading = mean / variance / precision if precision > 0 else 0.0
    log_likelihood = -0.5 * precision * (z - reading) ** 2
    return sensitivities({"h": 3 * z + 7}, ["z"], z[:, None], log_likelihood, {"h": 1e9}, LIMIT)["h"]


@pytest.mark.parametrize(("mean", "variance"), [(0.0, 0.5), (1.5, 0.3), (-2.0, 0.7)])
def test_shift_and_its_size_in_sound_labs_are_exact_for_a_normal_posterior(mean: float, variance: float) -> None:
    found = of_normal(mean, variance)
    # At a power a of the prior the posterior's mean is m / v / (1 / v - 1 + a).
    assert found.shift == pytest.approx(-math.log(2) * mean * math.sqrt(variance), abs=2e-3)
    assert found.z == pytest.approx(-mean / math.sqrt(1 - variance), rel=2e-3, abs=1e-6)
    assert (found.pulls[0].sensitivity, found.pulls[0].shift) == pytest.approx((found.prior, found.shift))


@pytest.mark.parametrize(
    ("mean", "variance", "diagnosis"),
    [(0.5, 0.01, "none"), (0.0, 0.999, "prior-driven"), (0.3, 0.5, "both"), (2.2, 0.5, "conflict"), (4.5, 0.01, "conflict")],
)
def test_the_diagnosis_tells_who_counts_and_whether_they_disagree(mean: float, variance: float, diagnosis: str) -> None:
    assert of_normal(mean, variance).diagnosis == diagnosis


def test_the_distance_is_that_of_the_distribution_functions() -> None:
    off = 0.4
    weights = np.exp(off * QUANTILES)

    def part(p: float, q: float) -> float:
        m = (p + q) / 2
        return (p * math.log2(p / m) if p > 0 else 0.0) + (q * math.log2(q / m) if q > 0 else 0.0)

    below = quad(lambda x: part(ndtr(x), ndtr(x - off)), -8, 3.6)[0] / quad(lambda x: ndtr(x) + ndtr(x - off), -8, 3.6)[0]
    above = quad(lambda x: part(ndtr(-x), ndtr(off - x)), -3.6, 8)[0] / quad(lambda x: ndtr(-x) + ndtr(off - x), -3.6, 8)[0]
    found = cumulative_distance(QUANTILES, weights / np.sum(weights))
    assert found == pytest.approx(math.sqrt(max(below, above)), rel=0.02)
    assert cumulative_distance(QUANTILES, np.full(4000, 1 / 4000)) == pytest.approx(0.0, abs=1e-6)


def test_a_quarter_of_a_standard_deviation_for_each_doubling_is_the_threshold() -> None:
    weights = np.exp(0.01 * QUANTILES)
    assert cumulative_distance(QUANTILES, weights / np.sum(weights)) / 0.01 == pytest.approx(0.05 / 0.25, rel=0.06)


def test_pulls_in_sound_labs_spread_as_stated() -> None:
    rng, scores = np.random.default_rng(4), []
    slopes = np.array([[1.0, 0.8, 0.1], [0.2, 1.0, 0.7]])  # of two readings by three unknowns
    for _ in range(60):
        truth = rng.standard_normal(3)
        readings = slopes @ truth + 0.7 * rng.standard_normal(2)
        covariance = np.linalg.inv(np.eye(3) + slopes.T @ slopes / 0.49)
        mean = covariance @ slopes.T @ readings / 0.49
        z = mean + rng.standard_normal((800, 3)) @ np.linalg.cholesky(covariance).T
        log_likelihood = -0.5 * np.sum((readings - z @ slopes.T) ** 2, axis=1) / 0.49
        scores.append(sensitivities({"h": z[:, 0]}, ["a", "b", "c"], z, log_likelihood, {"h": 800.0}, LIMIT)["h"].z)
    assert 0.7 < math.sqrt(np.mean(np.square(scores))) < 1.3


def test_weights_that_cannot_be_trusted_say_nothing() -> None:
    z = np.linspace(-1, 1, 12)[:, None]  # too few to judge their tail
    assert sensitivities({"h": z[:, 0]}, ["z"], z, z[:, 0], {"h": 12.0}, LIMIT)["h"].diagnosis == "not known"


def test_a_quantity_that_does_not_vary_hangs_on_nothing() -> None:
    z = QUANTILES[:, None]
    assert sensitivities({"h": np.full(4000, 2.0)}, ["z"], z, z[:, 0], {"h": 4000.0}, LIMIT) == {}


def test_beliefs_on_sensor_and_rig_are_scaled_and_neither_scales_nor_what_belongs_to_a_press(
    make_posterior: MakePosterior,
) -> None:
    found = sensitivity_of_headlines(make_posterior())
    assert {"young_modulus", "relative_permittivity", "sensor_thickness[sensor 1]"} <= set(found)
    told = {pull.unknown.split("[")[0] for s in found.values() for pull in s.pulls}
    assert not told & {"force_noise", "force_discrepancy", "contact_offset", "load_zero", "clock_offset"}


def _conflicting(posterior: Posterior, name: str = "young_modulus") -> Posterior:
    pulls = (Pull("machine_compliance", 0.1, -0.3), Pull("padding_thickness[sensor 1]", 0.09, 0.8))
    found = {name: Sensitivity(0.2, 0.3, 0.5, 3.1, pulls, 0.2, LIMIT)}
    return replace(posterior, diagnostics=replace(posterior.diagnostics, sensitivity=found))


def test_a_conflict_takes_the_green_away_and_names_the_prior(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    (reason,) = judge_posterior(_conflicting(posterior)).reasons
    assert (reason.gate, reason.level) == ("prior sensitivity", "amber")
    assert "the prior of padding thickness (sensor 1) moves Young's modulus of the sensor most" in reason.finding
    assert "0.618 MPa instead of 0.62 MPa" in reason.finding
    assert "padding thickness (sensor 1)" in reason.action
    own = judge_posterior(_conflicting(posterior, "padding_thickness[sensor 1]"))
    assert "its own prior moves padding thickness (sensor 1)" in own.reasons[0].finding


@pytest.mark.parametrize("gate", ["prior", "model", "discrepancy", "specimens", "fit"])
def test_a_conflict_with_a_known_cause_is_not_said_twice(make_posterior: MakePosterior, gate: str) -> None:
    cause = Reason(gate, "amber", "something else", "Look")
    assert judge_posterior(_conflicting(make_posterior()), more=[cause]).reasons == (cause,)
    other = replace(cause, gate="range")
    assert len(judge_posterior(_conflicting(make_posterior()), more=[other]).reasons) == 2


def test_what_was_found_is_kept_and_passed_and_in_the_summary(make_posterior: MakePosterior) -> None:
    posterior = with_sensitivity(make_posterior())
    d = _conflicting(posterior).diagnostics
    assert diagnostics_from_json(diagnostics_to_json(d)).sensitivity == d.sensitivity
    verdict = judge_posterior(posterior)
    assert "prior sensitivity" in {*passed_gates(posterior, verdict), *(r.gate for r in verdict.reasons)}
    assert "prior sensitivity" not in passed_gates(make_posterior(), verdict)
    summary = json.loads(summary_json(_conflicting(posterior), verdict))["prior_sensitivity"]
    assert summary["young_modulus"]["diagnosis"] == "conflict"
    assert summary["young_modulus"]["pulls"][1]["unknown"] == "padding_thickness[sensor 1]"


def test_the_report_says_what_each_headline_rests_on(make_posterior: MakePosterior) -> None:
    posterior = _conflicting(make_posterior())
    (row,) = sensitivity_rows(posterior)
    assert (row.rests_on, row.doubtful) == ("beliefs that pull away from the data", True)
    assert row.foremost == "machine compliance"
    assert section(Results(make_posterior(), ())) is None
