"""Implicit derivatives of the finite elements against central differences of whole solutions."""

import numpy as np
import pytest

from models.fem import FiniteElements, Solution, capacitance_of
from models.fem.equilibrium import State, equilibrium, on_mesh
from models.fem.mesh import moved
from models.fem.path import walk
from models.fem.sensitivity import Sensitivities, derivatives, sensitivities
from models.laws import Yeoh
from models.layers import Dielectric, Layer, LayeredDesign, layered, sphere
from models.sensor import FloatArray, design_from

VALUES = {
    "indenter_radius": 5e-3,
    "sensor_thickness": 0.74e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.69e6,
    "relative_permittivity": 2.8,
    "padding_thickness": 1.1e-3,
    "padding_young_modulus": 0.4e6,
    "electrode_radius": 8e-3,
    "dielectric_thickness": 0.3e-3,
}
DEPTH = np.array([0.0, 0.15, 0.3, 0.45]) * 1e-3


def solved_anew(solution: Solution, design: LayeredDesign) -> tuple[FloatArray, FloatArray]:
    """Force and capacitance of a changed design on the solution's grid carried over, walked anew to the last digit."""
    units, old = solution.units, solution.model
    scaled = design.scaled(units.length, units.modulus)
    model = on_mesh(scaled, moved(old.mesh, old.design, scaled))
    walked = [s for s in walk(model, DEPTH / units.length) if isinstance(s, State)]
    found = [equilibrium(model, s, s.depth) if s.depth > 0 else s for s in walked]
    states = [s for s in found if isinstance(s, State)]
    assert len(states) == len(DEPTH)
    force = np.array([s.force * units.force for s in states])
    return force, np.array([capacitance_of(design, units, model.mesh, s.u) for s in states])


@pytest.fixture(scope="module")
def paper() -> tuple[Solution, Sensitivities]:
    design = design_from(VALUES)
    solution = FiniteElements(4e-3).solve(design, DEPTH)
    return solution, sensitivities(solution, design)


@pytest.mark.parametrize("name", VALUES)
def test_derivatives_are_those_of_whole_solutions(paper: tuple[Solution, Sensitivities], name: str) -> None:
    solution, found = paper
    up, down = (solved_anew(solution, layered(design_from(VALUES | {name: VALUES[name] * t}))) for t in (1.0005, 0.9995))
    width = 1e-3 * VALUES[name]
    # Another ball shifts the rim of the contact from node to node, which a difference of two solutions feels.
    tolerance = 5e-3 if name == "indenter_radius" else 3e-5
    slope = (up[0] - down[0]) / width
    np.testing.assert_allclose(found.force[name], slope, rtol=tolerance, atol=1e-9 * np.max(np.abs(slope)))
    slope = (up[1] - down[1]) / width
    np.testing.assert_allclose(found.capacitance[name], slope, rtol=tolerance, atol=3e-6 * np.max(np.abs(slope)))


def test_derivative_in_depth_is_the_stiffness_of_the_path(paper: tuple[Solution, Sensitivities]) -> None:
    solution, found = paper
    stiffness = np.array([s.stiffness for s in solution.states]) * solution.units.force / solution.units.length
    np.testing.assert_allclose(found.force["indentation"][1:], stiffness[1:], rtol=1e-4)
    near = FiniteElements(4e-3).solve(design_from(VALUES), np.array([0.3e-3, 0.4499e-3, 0.45e-3])).response
    slope = (near.capacitance[2] - near.capacitance[1]) / 1e-7
    assert found.capacitance["indentation"][-1] == pytest.approx(slope, rel=2e-3)


def test_force_scales_with_both_moduli_and_capacitance_with_permittivity(paper: tuple[Solution, Sensitivities]) -> None:
    solution, found = paper
    response = solution.response
    by_moduli = sum(found.force[k] * VALUES[k] for k in ("young_modulus", "padding_young_modulus"))
    np.testing.assert_allclose(by_moduli, response.force, rtol=1e-6)
    np.testing.assert_allclose(found.capacitance["relative_permittivity"] * 2.8, response.capacitance, rtol=1e-9)


def test_derivatives_at_a_bound_are_taken_from_the_side_there_is() -> None:
    # Electrodes over the whole disc and dielectrics of half the sensor, no padding: none of these can move both ways.
    full = {k: v for k, v in VALUES.items() if k not in ("electrode_radius", "dielectric_thickness")} | {
        "padding_thickness": 0.0
    }
    design = design_from(full)
    solution = FiniteElements(4e-3).solve(design, DEPTH)
    found = sensitivities(solution, design)
    assert "padding_thickness" not in found.force
    c0 = solution.design.rest_capacitance
    assert found.capacitance["electrode_radius"][0] == pytest.approx(2 * c0 / 10e-3, rel=1e-3)
    assert found.capacitance["dielectric_thickness"][0] == pytest.approx(-c0 / 0.37e-3, rel=1e-3)
    smaller = layered(design_from(full | {"dielectric_thickness": 0.37e-3 * 0.9995}))
    slope = (solution.response.capacitance - solved_anew(solution, smaller)[1]) / (0.37e-3 * 0.0005)
    np.testing.assert_allclose(found.capacitance["dielectric_thickness"], slope, rtol=2e-3)


def test_any_family_of_layers_and_laws_has_a_derivative() -> None:
    def design(t: float) -> LayeredDesign:
        layers = (Layer(1.0e-3, 0.5e6), Layer(0.8e-3, 0.6e6, Yeoh(0.2 + t)))
        return LayeredDesign(sphere(5e-3), layers, 10e-3, 10e-3, (Dielectric(1.2e-3, 1.6e-3, 2.8),), base="slippery")

    solution = FiniteElements(4e-3).solve(design(0.0), DEPTH)
    found = derivatives(solution, {"c2": design})
    up, down = (solved_anew(solution, design(t)) for t in (3e-4, -3e-4))
    np.testing.assert_allclose(found.force["c2"][1:], ((up[0] - down[0]) / 6e-4)[1:], rtol=1e-4)
    np.testing.assert_allclose(found.capacitance["c2"][1:], ((up[1] - down[1]) / 6e-4)[1:], rtol=1e-4)


def test_friction_has_no_derivative_at_fixed_depth() -> None:
    design = design_from(VALUES, friction_coefficient=0.2)
    with pytest.raises(ValueError, match="depends on the whole path"):
        sensitivities(FiniteElements(1e-2).solve(design, DEPTH[:2]), design)
