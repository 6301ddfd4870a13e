"""What an error of what was put in does to headlines: as draws re-weighted to the moved beliefs say, and where it is said."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from calib.checks import PUT_IN_ERROR, Verdict, put_in_shifts
from calib.checks.verdict import Reason, verdict_of
from calib.priors import Normal
from calib.report.put_in import put_in_conditions, put_in_effects
from calib.report.section import Results
from calib.sampling import Posterior

MakePosterior = Callable[..., Posterior]
THICKNESSES = ("sensor_thickness", "padding_thickness", "dielectric_thickness")


@pytest.fixture(scope="module")
def hanging(make_posterior: MakePosterior) -> Posterior:
    """A posterior whose modulus rises with the thicknesses: as wide in these as the priors are, or half as wide."""
    posterior = make_posterior()
    draws = posterior.draws.copy()
    rng = np.random.default_rng(5)
    column = {p.name: k for k, p in enumerate(posterior.parameters)}
    for p in posterior.parameters:
        if p.parameter in THICKNESSES and isinstance(p.prior, Normal):
            narrower = 1.0 if p.parameter == "sensor_thickness" else 0.5
            draws[..., column[p.name]] = p.prior.mean + narrower * p.prior.sd * rng.standard_normal(draws.shape[:2])
    modulus = draws[..., column["young_modulus"]]
    for p in posterior.parameters:
        if p.parameter in THICKNESSES:
            modulus *= draws[..., column[p.name]] / np.mean(draws[..., column[p.name]])
    return replace(posterior, draws=draws)


def _moved(posterior: Posterior, quantities: Collection[str], error: float) -> float:
    """Mean of the modulus over draws that are weighted to normal priors whose means are larger by a share."""
    log_weight = np.zeros(posterior.draws.shape[:2])
    for k, p in enumerate(posterior.parameters):
        if p.parameter in quantities and isinstance(p.prior, Normal):
            x = posterior.draws[..., k]
            log_weight += norm.logpdf(x, p.prior.mean * (1 + error), p.prior.sd) - norm.logpdf(x, p.prior.mean, p.prior.sd)
    k = [p.name for p in posterior.parameters].index("young_modulus")
    return float(np.average(posterior.draws[..., k], weights=np.exp(log_weight)))


@pytest.mark.parametrize("quantities", [THICKNESSES, ("padding_thickness",)], ids=["all thicknesses", "one of them"])
def test_the_shift_is_that_of_draws_weighted_to_the_moved_beliefs(hanging: Posterior, quantities: tuple[str, ...]) -> None:
    mean, step = _moved(hanging, quantities, 0.0), 1e-4
    slope = (_moved(hanging, quantities, step) - _moved(hanging, quantities, -step)) / (2 * step)
    found = put_in_shifts(hanging, quantities)["young_modulus"]
    assert found.share == pytest.approx(-PUT_IN_ERROR * slope / mean, rel=1e-3)
    k = [p.name for p in hanging.parameters].index("young_modulus")
    assert found.in_sd == pytest.approx(found.share * mean / np.std(hanging.draws[..., k]), rel=1e-6)
    assert found.share < -0.004


def test_what_no_experiment_says_anything_of_moves_nothing(hanging: Posterior) -> None:
    own = tuple(replace(s, priors={}) for s in hanging.experiment.specimens)
    assert not put_in_shifts(replace(hanging, experiment=replace(hanging.experiment, specimens=own)), THICKNESSES)


def test_the_first_page_says_what_one_gauge_does_but_not_where_there_are_no_results(hanging: Posterior) -> None:
    results = Results(hanging, (), Verdict())
    (line,) = [said for said in put_in_conditions(results) if said.startswith("thicknesses as put in")]
    shift = put_in_shifts(hanging, THICKNESSES)["young_modulus"]
    assert f"Young's modulus of the sensor {-shift.share * 100:.2g} % too small ({-shift.in_sd:.1f} of its" in line
    assert line.removeprefix("thicknesses as put in: ") in [effect for _, effect, _ in put_in_effects(results)]
    red = verdict_of([Reason("convergence", "red", "chains do not agree", "Go on")])
    assert not put_in_conditions(replace(results, verdict=red))
