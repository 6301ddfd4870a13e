"""Compressible layers of the finite elements, against closed forms, exact layers, another code, and incompressible ones."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from models.analytic import ball_on_bonded_layer
from models.examples import PAPER_SENSOR
from models.fem import FiniteElements, dimensionless
from models.fem.check import energy_error
from models.fem.elements import deformation, make_elements, residual
from models.fem.equilibrium import State, make_model, on_mesh, stored_energy
from models.fem.fields import fields_of
from models.fem.mesh import make_mesh, moved
from models.fem.path import walk
from models.fem.sensitivity import sensitivities
from models.fem.solution import Solution
from models.laws import Gent
from models.layers import Dielectric, Layer, LayeredDesign, Profile, flat_punch, layered, sphere
from models.sensor import Base, FloatArray, design_from

RATIOS = (0.0, 0.15, 0.3, 0.45, 0.49)


# Golden numbers: FElupe 11.3 (displacement elements of order 3, the energy differentiated automatically, penalty contact taken
# to infinity, two meshes within 0.06 %; benchmarks/peers/felupe_layers.py) of sensors of modulus 0.69 MPa and Poisson's ratio
# 0.49 on foam: h_s, h_p, disc, ball [mm], E_p/E, nu_p; depths [mm], forces [N], capacitance changes.
GOLDEN = (
    ((0.74, 1.10, 10, 5, 1.0, 0.3), (0.28, 0.56, 0.7), (0.86440, 3.28983, 5.13960), (0.001491, 0.007137, 0.012087)),
    ((0.74, 1.10, 10, 5, 0.2, 0.0), (0.28, 0.56, 0.7), (0.24753, 0.84678, 1.31912), (0.000969, 0.004393, 0.007299)),
    ((0.5, 0.5, 8, 4, 1.0, 0.45), (0.12, 0.24, 0.3), (0.27249, 1.15376, 1.86505), (0.000470, 0.002571, 0.004590)),
)


def stack(profile: Profile, poisson_ratio: float, h: float, a: float, base: Base = "bonded") -> LayeredDesign:
    """One compressible layer of modulus 1 MPa."""
    layer = Layer(h, 1e6, poisson_ratio=poisson_ratio)
    return LayeredDesign(profile, (layer,), a, a, (Dielectric(0.5 * h, h, 2.8),), 0.0, base)


def lame(nu: float) -> tuple[float, float]:
    """Both of Lame's constants, mu and lambda, for Young's modulus 1."""
    return 1 / (2 * (1 + nu)), nu / ((1 + nu) * (1 - 2 * nu))


def energy(stretches: FloatArray, nu: float) -> float:
    """W = mu/2 (I1 - 3) - mu ln J + lambda/2 (J - 1)^2 for Young's modulus 1."""
    (mu, lambda_), j = lame(nu), np.prod(stretches)
    return float(mu / 2 * (np.sum(stretches**2) - 3) - mu * np.log(j) + lambda_ / 2 * (j - 1) ** 2)


@pytest.mark.parametrize("nu", RATIOS)
def test_a_foam_pressed_evenly_on_a_slippery_base_is_in_uniaxial_compression(nu: float) -> None:
    design = stack(flat_punch(30e-3, 1e-3), nu, 4e-3, 5e-3, "slippery")
    solution = FiniteElements(1e-2).solve(design, np.array([0.8e-3, 1.6e-3, 2.4e-3]))
    mu, lambda_ = lame(nu)
    for stretch, force in zip((0.8, 0.6, 0.4), solution.response.force, strict=True):
        side = float(brentq(lambda r, z=stretch: mu * (r - 1 / r) + lambda_ * (r**2 * z - 1) * r * z, 0.5, 2.0, xtol=1e-15))
        pull = mu * (stretch - 1 / stretch) + lambda_ * (side**2 * stretch - 1) * side**2
        assert force == pytest.approx(-np.pi * 5e-3**2 * 1e6 * pull, rel=4e-6)
    found = fields_of(solution)
    np.testing.assert_allclose(found.pressure, -pull / side**2 / 3 * 1e6, rtol=4e-6)
    np.testing.assert_allclose(found.r, side * found.rest_r, rtol=1e-5, atol=1e-9)
    stored = stored_energy(solution.model, solution.states[-1]) * solution.units.force * solution.units.length
    assert stored == pytest.approx(np.pi * 5e-3**2 * 4e-3 * 1e6 * energy(np.array([side, side, 0.4]), nu), rel=4e-6)


@pytest.mark.parametrize("nu", RATIOS)
def test_a_confined_foam_is_in_balance_and_pushes_on_its_walls(nu: float) -> None:
    # Columns that cannot give way sideways: P_zz = mu (L - 1/L) + lambda (L - 1), P_rr = lambda (L - 1) L.
    design = dimensionless(layered(design_from(PAPER_SENSOR | {"padding_poisson_ratio": nu})))[0]
    design = replace(design, layers=tuple(replace(x, young_modulus=1.0, poisson_ratio=nu) for x in design.layers))
    mesh = make_mesh(design, 0.1)
    parts = make_elements(mesh, design)
    mu, lambda_ = lame(nu)
    for stretch in (1.2, 0.6, 0.3):
        u = np.zeros((mesh.r.size, mesh.n_row, 2))
        u[..., 1] = mesh.z * (stretch - 1)
        pressure = np.zeros((mesh.elements.shape[0], 3))
        pressure[:, 0] = lambda_ * (stretch - 1)
        found = residual(parts, deformation(parts, u.ravel()), pressure)
        assert np.max(np.abs(found.volume)) < 1e-11
        force = np.bincount(parts.dofs.ravel(), found.force.ravel(), u.size).reshape(u.shape)
        assert np.max(np.abs(force[:-1, 1:-1])) < 1e-12
        area = np.pi * design.radius**2
        assert np.sum(force[:, -1, 1]) == pytest.approx(
            area * (mu * (stretch - 1 / stretch) + lambda_ * (stretch - 1)), rel=1e-9
        )
        wall = 2 * np.pi * design.radius * design.thickness * lambda_ * (stretch - 1) * stretch
        assert np.sum(force[-1, :, 0]) == pytest.approx(wall, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("a", [0.5, 2.0])
def test_force_on_a_compressible_layer_is_that_of_the_exact_integral_equation(a: float) -> None:
    for nu in (0.0, 0.3, 0.45):
        ball = 1000 * a
        depth, force = ball_on_bonded_layer(a, ball, nu)
        design = stack(sphere(ball * 1e-3), nu, 1e-3, (a + 8) * 1e-3)
        found = FiniteElements(1e-3).respond(design, np.array([depth * 1e-3]))
        assert found.force[0] == pytest.approx(force, rel=2e-3)
        assert found.contact_radius[0] == pytest.approx(a * 1e-3, rel=1e-2)


@pytest.mark.parametrize(("values", "depth", "force", "change"), GOLDEN, ids=["0.3", "0", "0.45"])
def test_a_sensor_on_foam_agrees_with_an_independent_code(
    values: tuple[float, ...], depth: tuple[float, ...], force: tuple[float, ...], change: tuple[float, ...]
) -> None:
    h_s, h_p, disc, ball, ratio, nu = values
    own = {"sensor_thickness": h_s, "padding_thickness": h_p, "sensor_radius": disc, "indenter_radius": ball}
    own = {name: length * 1e-3 for name, length in own.items()}
    own |= {"young_modulus": 0.69e6, "padding_young_modulus": ratio * 0.69e6, "padding_poisson_ratio": nu}
    design = layered(design_from(PAPER_SENSOR | own))
    sensor = replace(design.layers[1], poisson_ratio=0.49)
    found = FiniteElements().respond(replace(design, layers=(design.layers[0], sensor)), np.array(depth) * 1e-3)
    np.testing.assert_allclose(found.force, force, rtol=1.5e-3)
    np.testing.assert_allclose(found.capacitance_change, change, rtol=2e-3)


def test_a_poisson_ratio_of_a_half_is_no_poisson_ratio_bit_for_bit() -> None:
    depth = np.array([0.2e-3, 0.5e-3])
    one, other = (
        FiniteElements(4e-3).respond(design_from(PAPER_SENSOR | x), depth) for x in ({}, {"padding_poisson_ratio": 0.5})
    )
    for name in ("force", "capacitance", "contact_radius"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_force_and_capacitance_go_over_into_those_of_an_incompressible_padding() -> None:
    depth = np.array([0.3e-3, 0.6e-3])
    solutions = [
        FiniteElements(4e-3).solve(design_from(PAPER_SENSOR | {"padding_poisson_ratio": nu}), depth)
        for nu in (0.5, 0.49999, 0.499, 0.49, 0.4, 0.2)
    ]
    force, change = (
        np.stack([getattr(s.checked().response, name) for s in solutions]) for name in ("force", "capacitance_change")
    )
    np.testing.assert_allclose(force[1], force[0], rtol=1e-5)
    # What is missing goes as 1 - 2 nu, and the padding is the softer the smaller it is, down to 0.2.
    np.testing.assert_allclose((1 - force[3] / force[0]) / (1 - force[2] / force[0]), 10, rtol=0.25)
    assert np.all(np.diff(force[1:], axis=0) < 0)
    assert np.all(np.diff(change[1:], axis=0) < 0)


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_work_of_the_ball_is_the_energy_that_sensor_and_foam_store(nu: float) -> None:
    depth = 0.8e-3 * (np.arange(1, 13) / 12) ** 2
    values = PAPER_SENSOR | {"padding_poisson_ratio": nu, "padding_young_modulus": 0.2e6}
    solution = FiniteElements(1e-3).solve(design_from(values), depth).checked()
    assert abs(energy_error(solution)) < 5e-4
    assert max(s.penetration / s.depth for s in solution.states) < 1e-4
    assert max(len(s.newton) for s in solution.states) <= 9


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_errors_on_a_foam_stay_within_the_accuracy_asked_for(nu: float) -> None:
    design, depth = design_from(PAPER_SENSOR | {"padding_poisson_ratio": nu}), np.linspace(0.2e-3, 0.6e-3, 5)
    exact = FiniteElements(2.5e-4).respond(design, depth)
    for accuracy in (1.6e-2, 4e-3, 1e-3):
        found = FiniteElements(accuracy).respond(design, depth)
        for value, truth in ((found.force, exact.force), (found.capacitance_change, exact.capacitance_change)):
            assert np.sqrt(np.mean((value / truth - 1) ** 2)) < accuracy


def test_a_soft_foam_is_pressed_to_little_below_a_stiff_sensor() -> None:
    values = PAPER_SENSOR | {"padding_poisson_ratio": 0.0, "padding_young_modulus": 0.035e6, "padding_thickness": 3e-3}
    depth = np.linspace(0.2e-3, 2.4e-3, 8)
    solution = FiniteElements(4e-3).solve(design_from(values), depth).checked()
    assert np.all(np.diff(solution.response.force) > 0)
    assert np.min(fields_of(solution).thickness_stretch) < 0.35


def test_the_derivative_in_poisson_ratio_is_that_of_whole_solutions() -> None:
    values = PAPER_SENSOR | {"padding_poisson_ratio": 0.3, "padding_young_modulus": 0.5e6}
    depth = np.array([0.2e-3, 0.45e-3])
    design = design_from(values)
    solution = FiniteElements(4e-3).solve(design, depth)
    found = sensitivities(solution, design)

    def anew(nu: float) -> tuple[FloatArray, FloatArray]:
        units, old = solution.units, solution.model
        other = layered(design_from(values | {"padding_poisson_ratio": nu}))
        scaled = other.scaled(units.length, units.modulus)
        model = on_mesh(scaled, moved(old.mesh, old.design, scaled))
        states = tuple(s for s in walk(model, depth / units.length) if isinstance(s, State))
        response = Solution(other, units, model, states, None).response
        return response.force, response.capacitance

    up, down = anew(0.3 + 1e-4), anew(0.3 - 1e-4)
    np.testing.assert_allclose(found.force["padding_poisson_ratio"], (up[0] - down[0]) / 2e-4, rtol=1e-4)
    np.testing.assert_allclose(found.capacitance["padding_poisson_ratio"], (up[1] - down[1]) / 2e-4, rtol=1e-4)
    # At 0 there is the side that is left; where it is 0.5 there is none.
    loose = design_from(values | {"padding_poisson_ratio": 0.0})
    at_zero = sensitivities(FiniteElements(4e-3).solve(loose, depth), loose)
    assert np.all(at_zero.force["padding_poisson_ratio"] < 0)
    tight = design_from(PAPER_SENSOR)
    assert "padding_poisson_ratio" not in sensitivities(FiniteElements(4e-3).solve(tight, depth), tight).force


def test_a_layer_that_is_no_foam_is_refused() -> None:
    with pytest.raises(ValueError, match=r"poisson_ratio of layer 'top' must lie between 0 and 0\.5, got 0\.6"):
        Layer(1e-3, 1e6, name="top", poisson_ratio=0.6)
    with pytest.raises(ValueError, match=r"must be neo-hookean, but layer 'top' is gent with 0\.3"):
        Layer(1e-3, 1e6, Gent(40.0), "top", 0.3)


def test_layers_know_what_a_design_says_of_its_padding() -> None:
    below, above = layered(design_from(PAPER_SENSOR | {"padding_poisson_ratio": 0.25})).layers
    assert (below.poisson_ratio, above.poisson_ratio) == (0.25, 0.5)
    model = make_model(dimensionless(layered(design_from(PAPER_SENSOR | {"padding_poisson_ratio": 0.25})))[0], 0.1, 1e-2)
    ratio = (model.elements.material.lame / model.elements.material.modulus).reshape(model.mesh.shape)
    np.testing.assert_allclose(ratio[0], np.where(model.mesh.layer == 0, 1.0, 1e4))
