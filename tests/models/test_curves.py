"""Look-ups on loading curves, and what designs do at given forces, against the models they are of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from models.analytic import ClosedForm
from models.curves import depth_at_force, depth_table, loading_curve, predict_design
from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.response import Forward, OutOfRangeError, Response
from models.sensor import Design, FloatArray, design_from
from models.surrogate import load_surrogate

EXACT = ClosedForm(force_error=0.0, capacitance_error=0.0)
DESIGN = design_from(PAPER_SENSOR)


@pytest.mark.parametrize("forward", [ClosedForm(), FiniteElements(2e-3), load_surrogate()], ids=lambda f: f.name)
def test_depth_at_force_inverts_the_curve(forward: Forward) -> None:
    design = design_from(PAPER_SENSOR | {"young_modulus": 0.62e6, "dielectric_thickness": 0.16e-3})
    table = depth_table(forward, design, 96)
    force = np.array([-1.0, 0.0, 0.01, 0.5, 5.0, 1e6])
    depth = depth_at_force(table, force)[0]
    np.testing.assert_array_equal(depth[:2], 0)
    assert np.isnan(depth[-1])
    np.testing.assert_allclose(forward.respond(design, depth[2:5]).force, force[2:5], rtol=1e-2)


def test_prediction_of_a_design_inverts_the_loading_curve() -> None:
    depth = np.array([0.1e-3, 0.3e-3, 0.6e-3])
    r = EXACT.respond(DESIGN, depth)
    p = predict_design(EXACT, DESIGN, r.force)
    assert p.depth[0] == pytest.approx(depth, rel=1e-3)
    assert p.change[0] == pytest.approx(r.capacitance_change, rel=2e-4)


def test_slope_of_the_change_matches_differences_of_the_change() -> None:
    p = predict_design(EXACT, DESIGN, np.array([1.98, 2.0, 2.02]))
    assert p.change_slope[0, 1] == pytest.approx((p.change[0, 2] - p.change[0, 0]) / 0.04, rel=2e-3)


def test_forces_out_of_reach_are_nan_and_zero_force_gives_no_change() -> None:
    p = predict_design(EXACT, DESIGN, np.array([0.0, 1.0, 1e4]))
    assert p.change[0, 0] == 0
    assert np.isfinite(p.change[0, 1])
    assert np.isnan([p.change[0, 2], p.depth[0, 2], p.change_slope[0, 2], p.change_error[0, 2]]).all()
    assert p.reach[0] < 1e4


def test_loading_curve_ends_exactly_at_the_asked_displacement_or_force() -> None:
    by_depth = loading_curve(EXACT, DESIGN, displacement=0.7e-3, steps=7)
    assert by_depth.depth == pytest.approx(np.arange(1, 8) * 1e-4)
    by_force = loading_curve(EXACT, DESIGN, force=5.0, steps=5)
    assert by_force.force == pytest.approx([1, 2, 3, 4, 5], rel=1e-9)


def test_loading_curve_uses_force_control_where_the_model_has_it() -> None:
    @dataclass(frozen=True)
    class Controlled(ClosedForm):
        def respond_to_force(self, design: Design, force: FloatArray) -> Response:
            return replace(self.respond(design, np.full(force.shape, 1e-4)), force=force)

    assert loading_curve(Controlled(), DESIGN, force=2.0, steps=2).force == pytest.approx([1.0, 2.0])


def test_loading_curve_names_the_largest_force_it_reaches() -> None:
    with pytest.raises(OutOfRangeError, match=r"reaches forces up to 24.44 N .*got 500 N"):
        loading_curve(EXACT, DESIGN, force=500.0)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({}, "either a displacement or a force"),
        ({"displacement": 1e-3, "force": 1.0}, "not both"),
        ({"displacement": -1e-3}, "displacement must be positive, got -0.001 m"),
        ({"force": 1.0, "steps": 0}, "steps must be at least 1, got 0"),
    ],
)
def test_loading_curve_says_what_is_wrong_with_its_target(kwargs: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        loading_curve(EXACT, DESIGN, **kwargs)


def test_draws_that_are_not_covered_are_nan_and_leave_the_others_alone() -> None:
    @dataclass(frozen=True)
    class ThinOnly(ClosedForm):
        def max_depth(self, design: Design) -> FloatArray:
            return np.where(np.asarray(design.draws().padding.thickness) > 2e-3, 0.0, ClosedForm.max_depth(self, design))

    padding = np.array([1e-3, 5e-3, 1.5e-3])
    force = np.array([1.0, 2.0])
    found = predict_design(ThinOnly(), design_from(PAPER_SENSOR | {"padding_thickness": padding}), force)
    assert np.all(np.isnan(found.change[1]))
    assert found.reach[1] == 0
    for k in (0, 2):
        alone = predict_design(ClosedForm(), design_from(PAPER_SENSOR | {"padding_thickness": padding[k]}), force)
        np.testing.assert_array_equal(found.change[k], alone.change[0])
        np.testing.assert_array_equal(found.change_error[k], alone.change_error[0])
