"""The surrogate against the finite elements at draws of a posterior: honest errors pass, dishonest ones are told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from calib.checks.spotcheck import with_spot_check
from calib.report.sections.convergence import criteria
from calib.sampling.diagnostics import diagnostics_from_json, diagnostics_to_json
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.fem import ConvergenceError, FiniteElements
from models.layers import LayeredDesign
from models.response import Forward, OutOfRangeError, Response
from models.sensor import Design, FloatArray
from models.surrogate.surrogate import load_surrogate

MakePosterior = Callable[..., Posterior]
EXACT = FiniteElements(4e-3)


@dataclass(frozen=True)
class Stiffened:
    """The shipped surrogate with its force off by a factor and the error it states left as it is."""

    factor: float
    inner: Forward
    name: str = "surrogate"

    @property
    def identity(self) -> str:
        return f"{self.inner.identity}, force times {self.factor}"

    def max_depth(self, design: Design) -> FloatArray:
        return self.inner.max_depth(design)

    def outside(self, design: Design, depth: FloatArray) -> str:
        return self.inner.outside(design, depth)

    def respond(self, design: Design, depth: FloatArray) -> Response:
        found = self.inner.respond(design, depth)
        return replace(found, force=self.factor * found.force)


def test_the_shipped_surrogate_passes_where_a_posterior_lies(make_posterior: MakePosterior) -> None:
    posterior = with_spot_check(make_posterior(), load_surrogate(), EXACT)
    found = posterior.diagnostics.spot_check
    assert found is not None
    assert found.passed
    assert found.n_curve == 12
    assert found.force_error < 0.01
    assert found.change_error < 0.05
    assert posterior.diagnostics.surrogate_honest is True
    assert posterior.diagnostics.usable
    assert posterior.diagnostics.reasons_against_use == ()
    (row,) = [c for c in criteria(posterior) if "against finite elements" in c.name]
    assert row.met
    assert "times its own error" in row.found


def test_a_surrogate_that_is_off_by_more_than_it_says_has_not_passed(make_posterior: MakePosterior) -> None:
    posterior = with_spot_check(make_posterior(), Stiffened(1.05, load_surrogate()), EXACT)
    d = posterior.diagnostics
    assert d.spot_check is not None
    assert d.spot_check.force_error == pytest.approx(0.05, abs=0.01)
    assert not d.spot_check.passed
    assert d.surrogate_honest is False
    assert not d.usable
    (reason,) = d.surrogate_reasons
    assert "the surrogate is off the finite elements by up to" in reason
    assert "times the error it states" in reason
    # The chains are none the worse for it, and more of them would not help.
    assert d.converged
    assert d.reasons == ()
    (row,) = [c for c in criteria(posterior) if "against finite elements" in c.name]
    assert not row.met


def test_a_model_that_states_no_error_is_told_how_far_off_it_is(make_posterior: MakePosterior) -> None:
    posterior = with_spot_check(make_posterior(), ClosedForm(force_error=0.0, capacitance_error=0.0), EXACT)
    (warning,) = posterior.diagnostics.warnings
    assert "the closed form is off the finite elements by up to" in warning
    assert "states no error of its own" in warning
    assert posterior.diagnostics.surrogate_honest is None
    assert posterior.diagnostics.usable


def test_finite_elements_are_not_checked_against_themselves(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    assert with_spot_check(posterior, EXACT, EXACT) is posterior


@pytest.mark.parametrize(
    "error",
    [ConvergenceError(1e-4, "contact keeps cycling", None), OutOfRangeError("depths up to 1 mm")],
    ids=["stuck", "deep"],
)
def test_finite_elements_that_never_reach_the_end_leave_a_warning(make_posterior: MakePosterior, error: Exception) -> None:
    class Stuck(FiniteElements):
        def respond(self, design: Design | LayeredDesign, depth: FloatArray) -> Response:
            raise error

    posterior = with_spot_check(make_posterior(), load_surrogate(), Stuck(4e-3))
    assert posterior.diagnostics.spot_check is None
    assert "no spot check" in posterior.diagnostics.warnings[0]
    assert posterior.diagnostics.surrogate_honest is None
    assert posterior.diagnostics.usable


def test_a_spot_check_is_kept_with_the_diagnostics(make_posterior: MakePosterior) -> None:
    d = with_spot_check(make_posterior(), load_surrogate(), EXACT).diagnostics
    again = diagnostics_from_json(diagnostics_to_json(d))
    assert again.spot_check == d.spot_check
    assert np.isfinite(d.spot_check.force_score if d.spot_check else np.nan)
