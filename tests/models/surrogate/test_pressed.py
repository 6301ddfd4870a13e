"""Curves that are asked for one column at a time, by some of their designs, or in any number together."""

from __future__ import annotations

import numpy as np

from models.analytic import ClosedForm
from models.curves import curves_of
from models.examples import PAPER_SENSOR
from models.response import Asked
from models.sensor import Design, FloatArray, design_from
from models.surrogate import load_surrogate

FAST = load_surrogate()
N = 300


def designs() -> tuple[Design, FloatArray]:
    rng = np.random.default_rng(0)
    varied = {"sensor_thickness": rng.normal(0.74e-3, 0.02e-3, N), "padding_thickness": rng.uniform(0, 2e-3, N)}
    return design_from(PAPER_SENSOR | varied), np.linspace(-0.05e-3, 0.3e-3, 12) * rng.uniform(0.5, 1, (N, 1))


def test_a_column_asked_by_itself_is_that_of_the_whole_response() -> None:
    design, depth = designs()
    whole = FAST.respond(design, depth)
    force, capacitance = FAST.curves(design).press([Asked(depth, ("force",)), Asked(depth[:, :5], ("capacitance",))])
    np.testing.assert_array_equal(force.force, whole.force)
    np.testing.assert_array_equal(force.force_error, whole.force_error)
    np.testing.assert_array_equal(capacitance.capacitance, whole.capacitance[:, :5])
    np.testing.assert_allclose(capacitance.capacitance_error, whole.capacitance_error[:, :5], rtol=1e-12)
    assert np.all(np.isnan(force.capacitance))
    assert force.capacitance_error.shape[-1] == 0


def test_some_designs_have_the_curves_that_they_have_among_all() -> None:
    design, depth = designs()
    rows = np.random.default_rng(1).random(N) < 0.3
    for forward in (FAST, ClosedForm()):
        curves = curves_of(forward, design)
        np.testing.assert_array_equal(curves.limit, forward.max_depth(design))
        (all_,), (some,) = curves.press([Asked(depth)]), curves.only(rows).press([Asked(depth[rows])])
        np.testing.assert_allclose(some.force, all_.force[rows], rtol=1e-14)
        np.testing.assert_allclose(some.capacitance, all_.capacitance[rows], rtol=1e-14)
        (part,) = curves.only(slice(3, 9)).press([Asked(depth[3:9])])
        np.testing.assert_allclose(part.force, all_.force[3:9], rtol=1e-14)
