"""How thin dielectrics become, against the finite elements, and where it is not known."""

from __future__ import annotations

import numpy as np
import pytest

from models.fem import FiniteElements
from models.fem.capacitance import largest_thinning
from models.sensor import design_from
from models.surrogate.thinning import load_thinning, thinning_refusal

SENSOR = {
    "indenter_radius": 5e-3,
    "sensor_radius": 10e-3,
    "sensor_thickness": 0.74e-3,
    "dielectric_thickness": 0.16e-3,
    "young_modulus": 0.62e6,
    "relative_permittivity": 2.8,
}


@pytest.mark.parametrize("padding", [1.1e-3, 4e-3])
def test_thinning_is_that_of_the_finite_elements(padding: float) -> None:
    design = design_from({**SENSOR, "padding_thickness": padding})
    solution = FiniteElements().solve_to_force(design, np.array([2.0, 8.0]))
    unit, mesh = solution.units.length, solution.model.mesh
    middle, t_d = (padding + 0.37e-3) / unit, 0.16e-3 / unit
    for state in solution.states:
        exact = float(largest_thinning(mesh, state.u, middle, np.array([t_d]))[0])
        found, sd = load_thinning().of(design.draws(), np.array([[state.depth * unit]]))
        assert found[0, 0] == pytest.approx(exact, abs=4 * sd[0, 0])
        assert 1e-4 < sd[0, 0] / found[0, 0] < 3e-3


def test_thinning_vanishes_with_depth_and_is_not_known_outside_the_range() -> None:
    design = design_from({**SENSOR, "padding_thickness": np.array([1e-3, 50e-3])})
    thin, _ = load_thinning().of(design.draws(), np.array([[0.0, 1e-6, np.nan]] * 2))
    assert thin[0, 0] == 0
    assert 0 < thin[0, 1] < 0.01
    assert np.isnan(thin[0, 2])
    assert np.all(np.isnan(thin[1]))


def test_other_physics_is_refused() -> None:
    values = {**SENSOR, "padding_thickness": 1e-3}
    assert thinning_refusal(design_from(values)) == ""
    for other in (
        design_from(values, base="slippery"),
        design_from({**values, "stiffening": 0.02}),
        design_from(values, friction_coefficient=np.inf),
    ):
        assert thinning_refusal(other).startswith("the thinning of the dielectric is trained for")
