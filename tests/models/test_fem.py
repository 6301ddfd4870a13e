"""The finite-element model against independent codes, exact solutions, and its own invariants."""

import json
from pathlib import Path

import numpy as np
import pytest

from models.analytic import bonded_layer_factor, hertz_force
from models.fem import ConvergenceError, FiniteElements, material
from models.fem.capacitance import ring_capacitance
from models.fem.elements import BULK_RATIO, deformation, linearise, make_elements
from models.fem.equilibrium import Failure, equilibrium, make_model, rest, walk
from models.fem.mesh import Stack, make_mesh
from models.response import OutOfRangeError
from models.sensor import design_from

REFERENCES = Path(__file__).parents[3] / "shared" / "references"

PAPER = {
    "indenter_radius": 5e-3,
    "sensor_thickness": 0.74e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.69e6,
    "relative_permittivity": 2.8,
    "padding_thickness": 1.1e-3,
}

# Golden numbers: an independent axisymmetric Q2/P1 finite-element code (K/mu 1e4, hard contact by augmentation, bonded base,
# frictionless sphere, a = 10 mm, electrodes over the disc, two dielectrics of half the sensor). Its mechanics of the first case
# agree with a second code within 0.01 % and with CalculiX 2.20 within 0.15 %.
# Columns: R, h_s, h_p, mu_s, mu_p, d (mm, MPa), F (N), C/C0 - 1.
GOLDEN = np.array(
    [
        (5, 0.74, 1.1, 0.23, 0.23, 0.1, 0.15013507, 2.1901031e-4),
        (5, 0.74, 1.1, 0.23, 0.23, 0.36, 1.8553263, 4.0845352e-3),
        (5, 0.74, 1.1, 0.23, 0.23, 0.62, 5.9289927, 1.6862055e-2),
        (5, 0.74, 1.1, 0.40, 0.08, 0.09, 0.10122993, 3.4592617e-4),
        (5, 0.74, 1.1, 0.40, 0.08, 0.33, 1.0927316, 4.6153183e-3),
        (5, 0.74, 1.1, 0.40, 0.08, 0.6, 3.9287846, 1.8527284e-2),
        (5, 1.0, 5.0, 0.23, 0.23, 0.22363636, 0.35133678, 2.847383e-3),
        (5, 1.0, 5.0, 0.23, 0.23, 0.82, 3.0047969, 2.8809821e-2),
        (5, 1.0, 5.0, 0.23, 0.23, 1.64, 9.9573124, 1.1192243e-1),
        (2.5, 0.74, 1.1, 0.23, 0.23, 0.1, 0.087120705, 1.388396e-4),
        (2.5, 0.74, 1.1, 0.23, 0.23, 0.3, 0.61952014, 1.5954287e-3),
        (2.5, 0.74, 1.1, 0.23, 0.23, 0.5, 1.6440581, 5.5263655e-3),
        (10, 0.74, 1.1, 0.23, 0.23, 0.1, 0.28418239, 3.7215155e-4),
        (10, 0.74, 1.1, 0.23, 0.23, 0.3, 2.8981058, 4.9122685e-3),
        (10, 0.74, 1.1, 0.23, 0.23, 0.5, 9.2693129, 1.8921019e-2),
    ]
)


def design_of(radius, h_s, h_p, mu_s, mu_p, a=10):
    return design_from(
        {
            "indenter_radius": radius * 1e-3,
            "sensor_thickness": h_s * 1e-3,
            "sensor_radius": a * 1e-3,
            "young_modulus": 3e6 * mu_s,
            "relative_permittivity": 2.8,
            "padding_thickness": h_p * 1e-3,
            "padding_young_modulus": 3e6 * mu_p,
        }
    )


@pytest.mark.parametrize(
    "case", np.split(GOLDEN, 5), ids=["paper", "soft padding", "thick padding", "small ball", "large ball"]
)
def test_force_and_capacitance_agree_with_an_independent_code(case):
    depth, force, change = case[:, 5:].T
    response = FiniteElements().respond(design_of(*case[0, :5]), depth * 1e-3)
    np.testing.assert_allclose(response.force, force, rtol=5e-3)
    np.testing.assert_allclose(response.capacitance_change, change, rtol=1.5e-2)


@pytest.mark.skipif(not REFERENCES.is_dir(), reason="the full reference curves lie beside the checkout, not in it")
def test_every_listed_reference_point_is_met():
    for case in json.loads((REFERENCES / "index.json").read_text()):
        d = case["design"]
        depth, force, change = np.loadtxt(REFERENCES / case["file"], delimiter=",", skiprows=1).T
        response = FiniteElements().respond(design_of(d["R"], d["h_s"], d["h_p"], d["mu_s"], d["mu_p"], d["a"]), depth * 1e-3)
        np.testing.assert_allclose(response.force, force, rtol=1e-2, err_msg=case["name"])
        np.testing.assert_allclose(response.capacitance_change, change, rtol=2e-2, err_msg=case["name"])


def test_force_matches_hertz_with_bonded_layer_at_small_depth():
    # A hundredth of R deep, a disc much wider than the stack is thick: small strain, layer by the exact factor.
    design = design_of(5, 1.0, 4.0, 0.2, 0.2, a=20)
    depth = np.array([0.03e-3, 0.05e-3])
    exact = hertz_force(0.6e6, 5e-3, depth) * bonded_layer_factor(np.sqrt(5e-3 * depth) / 5e-3)
    np.testing.assert_allclose(FiniteElements().respond(design, depth).force, exact, rtol=1e-2)


def test_force_matches_the_exact_thin_bonded_layer_at_small_strain():
    design = design_of(20, 0.5, 0.5, 0.2, 0.2, a=20)
    depth = np.array([0.02e-3, 0.03e-3])
    exact = hertz_force(0.6e6, 20e-3, depth) * bonded_layer_factor(np.sqrt(20e-3 * depth) / 1e-3)
    np.testing.assert_allclose(FiniteElements().respond(design, depth).force, exact, rtol=2e-2)


def test_finer_meshes_converge():
    design, depth = design_from(PAPER), np.linspace(0.1e-3, 0.6e-3, 8)
    coarse, medium, fine = (FiniteElements(k).respond(design, depth) for k in (0.5, 1.0, 2.0))
    error = [np.sqrt(np.mean((r.force / fine.force - 1) ** 2)) for r in (coarse, medium)]
    assert error[1] < 0.6 * error[0]
    np.testing.assert_allclose(medium.force, fine.force, rtol=1.5e-3)
    np.testing.assert_allclose(medium.capacitance_change, fine.capacitance_change, rtol=3e-3)


def test_stress_is_the_gradient_of_the_energy_and_tangent_of_the_stress():
    rng = np.random.default_rng(0)
    f = np.array([1.0, 0, 0, 1, 1])[:, None] + 0.2 * rng.normal(size=(5, 20))
    p, mu, bulk, h = rng.normal(size=20), np.full(20, 0.7), np.full(20, 1e4), 1e-6
    stress, tangent = material.stress(f, p, mu), material.tangent(f, p, mu)
    for k in range(5):
        step = np.zeros((5, 1))
        step[k] = h
        slope = (material.energy(f + step, p, mu, bulk) - material.energy(f - step, p, mu, bulk)) / (2 * h)
        np.testing.assert_allclose(stress[k], slope, atol=1e-7)
        slope = (material.stress(f + step, p, mu) - material.stress(f - step, p, mu)) / (2 * h)
        np.testing.assert_allclose(tangent[:, k], slope, atol=1e-6)
    np.testing.assert_allclose(tangent, np.swapaxes(tangent, 0, 1), atol=1e-14)


def test_energy_does_not_change_under_rotation():
    rng = np.random.default_rng(1)
    f = np.array([1.0, 0.1, -0.2, 0.9, 1.05])
    c, s = np.cos(0.7), np.sin(0.7)
    turned = np.array([c * f[0] - s * f[2], c * f[1] - s * f[3], s * f[0] + c * f[2], s * f[1] + c * f[3], f[4]])
    p, one, bulk = rng.normal(), np.array(1.0), np.array(1e4)
    assert material.energy(turned, p, one, bulk) == pytest.approx(material.energy(f, p, one, bulk), rel=1e-13)


def test_patch_of_elements_in_uniform_stretch_is_in_balance():
    # Uniaxial tension of an incompressible cylinder: no net force on any inner node, P_zz = mu (L - 1/L^2).
    stack = Stack(0.2, 0.3, 1.5, 1.0)
    mesh = make_mesh(stack, 0.1)
    parts = make_elements(mesh, stack)
    stretch = 1.3
    r, z = (g.ravel() for g in np.meshgrid(mesh.r, mesh.z, indexing="ij"))
    u = np.stack([(stretch**-0.5 - 1) * r, (stretch - 1) * z], axis=1).ravel()
    # With mu (F - F^-T / J) + p cof F, zero lateral stress asks for p = mu (1 - 1/L).
    pressure = np.zeros((mesh.elements.shape[0], 3))
    pressure[:, 0] = 1 - 1 / stretch
    lin = linearise(parts, deformation(parts, u), pressure)
    # The element force carries the pressure's own small residual p/K times the bulk stiffness: compare without it.
    force = np.bincount(
        parts.dofs.ravel(),
        (lin.force - np.einsum("eia,eab,eb->ei", lin.coupling, parts.bulk_stiffness, lin.pressure_residual)).ravel(),
    ).reshape(mesh.r.size, mesh.n_row, 2)
    assert np.max(np.abs(force[:, 1:-1])) < 1e-12
    total = np.pi * stack.radius**2 * (stretch - 1 / stretch**2)
    assert np.sum(force[:, -1, 1]) == pytest.approx(total, rel=1e-12)
    assert np.sum(force[:, 0, 1]) == pytest.approx(-total, rel=1e-12)


def test_element_stiffness_is_symmetric_and_the_slope_of_the_force():
    stack = Stack(0.2, 0.3, 1.5, 0.5)
    mesh = make_mesh(stack, 0.1, 0.5)
    parts = make_elements(mesh, stack)
    rng = np.random.default_rng(2)
    u = 2e-3 * rng.normal(size=2 * mesh.n_node)
    pressure = 0.1 * rng.normal(size=(mesh.elements.shape[0], 3))
    lin = linearise(parts, deformation(parts, u), pressure)
    np.testing.assert_allclose(lin.stiffness, np.swapaxes(lin.stiffness, 1, 2), atol=1e-9 * np.max(np.abs(lin.stiffness)))
    direction, h = rng.normal(size=u.size), 1e-6

    def bare(step):
        """Displacement part of the force at fixed pressure, by removing the condensed pressure's share."""
        there = linearise(parts, deformation(parts, u + step * direction), pressure)
        return there.force - np.einsum("eia,eab,eb->ei", there.coupling, parts.bulk_stiffness, there.pressure_residual)

    slope = (bare(h) - bare(-h)) / (2 * h)
    condensed = np.einsum("eia,eab,ejb->eij", lin.coupling, parts.bulk_stiffness, lin.coupling)
    predicted = np.einsum("eij,ej->ei", lin.stiffness - condensed, direction[parts.dofs])
    np.testing.assert_allclose(slope, predicted, atol=2e-5 * np.max(np.abs(predicted)))


def test_work_of_the_sphere_is_the_stored_energy():
    stack = Stack(0.148, 0.22, 2.0, 0.6)
    depths = np.linspace(0, 0.13, 60)[1:]
    model = make_model(stack, depths[-1])
    states = [s for s in walk(model, depths) if not isinstance(s, Failure)]
    force = np.array([0.0] + [s.force for s in states])
    depth = np.concatenate([[0.0], depths])
    work = np.trapezoid(force, depth) - np.sum(np.diff(depth) ** 3 * np.gradient(np.gradient(force, depth), depth)[1:]) / 12
    f, last = deformation(model.elements, states[-1].u), states[-1]
    mu = model.elements.modulus
    p = last.pressure @ model.elements.pressure_shape.T
    stored = np.sum(material.energy(f, p, mu, BULK_RATIO * mu) * model.elements.weight)
    assert work == pytest.approx(stored, rel=1e-3)


def test_contact_is_hard_and_never_pulls():
    stack = Stack(0.148, 0.22, 2.0, 1.0)
    model = make_model(stack, 0.14)
    for state in walk(model, np.linspace(0.01, 0.14, 8)):
        assert not isinstance(state, Failure)
        assert state.penetration < 1e-4 * state.depth
        assert np.min(state.contact_pressure) >= -2e-3 * np.max(state.contact_pressure)


def test_newton_converges_in_a_few_steps_and_quadratically_small():
    model = make_model(Stack(0.148, 0.22, 2.0, 1.0), 0.1)
    first = equilibrium(model, rest(model), 0.02)
    assert not isinstance(first, Failure)
    again = equilibrium(model, first, 0.02)
    assert not isinstance(again, Failure)
    assert again.iterations == 1
    assert again.force == pytest.approx(first.force, rel=1e-9)


def test_stiffness_is_the_slope_of_the_force():
    model = make_model(Stack(0.148, 0.22, 2.0, 1.0), 0.12)
    a, b = (s for s in walk(model, np.array([0.1, 0.1 + 1e-6])))
    assert not isinstance(a, Failure)
    assert not isinstance(b, Failure)
    assert a.stiffness == pytest.approx((b.force - a.force) / 1e-6, rel=1e-4)


def test_modulus_scales_force_and_permittivity_scales_capacitance_exactly():
    depth = np.array([0.3e-3])
    one = FiniteElements(0.7).respond(design_from(PAPER), depth)
    two = FiniteElements(0.7).respond(design_from(PAPER | {"young_modulus": 3 * 0.69e6, "relative_permittivity": 5.6}), depth)
    assert two.force == pytest.approx(3 * one.force, rel=1e-12)
    assert two.capacitance == pytest.approx(2 * one.capacitance, rel=1e-12)


def test_undeformed_rings_give_the_parallel_plates_for_every_electrode_and_dielectric():
    mesh = make_mesh(Stack(0.148, 0.22, 2.0, 1.0), 0.1)
    dielectric, electrode = np.array([0.02, 0.074]), np.array([0.7, 1.37, 2.0])
    rings = ring_capacitance(mesh, np.zeros(2 * mesh.n_node), 0.148, dielectric, electrode)
    np.testing.assert_allclose(rings, 2 * np.pi * electrode**2 / dielectric[:, None], rtol=1e-12)


def test_force_control_ends_at_the_force_and_agrees_with_displacement_control():
    design = design_from(PAPER)
    by_force = FiniteElements().respond_to_force(design, np.array([1.0, 3.0, 5.0]))
    np.testing.assert_allclose(by_force.force, [1, 3, 5], rtol=1e-6)
    by_depth = FiniteElements().respond(design, by_force.depth)
    np.testing.assert_allclose(by_depth.force, by_force.force, rtol=2e-3)


def test_a_force_out_of_reach_is_refused_with_the_depth_covered():
    with pytest.raises(OutOfRangeError, match=r"500 N is not reached .* up to 1\.196 mm"):
        FiniteElements(0.5).respond_to_force(design_from(PAPER), np.array([1.0, 500.0]))


def test_a_path_that_ends_early_says_where_and_why_and_keeps_what_it_has():
    # A soft sensor on padding four times stiffer, pressed to 64 % of the stack: elements would turn inside out.
    design = design_of(5, 0.56, 1.315, 0.2, 0.85, a=7.1)
    depth = np.linspace(0.1, 0.64, 10) * 1.875e-3
    with pytest.raises(ConvergenceError, match=r"no equilibrium beyond an indentation of .* mm: ") as caught:
        FiniteElements().respond(design, depth)
    assert caught.value.response is not None
    assert caught.value.response.force.size >= 6


def test_depths_beyond_the_stack_and_friction_are_refused():
    with pytest.raises(OutOfRangeError, match=r"cover depths up to 1\.196 mm"):
        FiniteElements().respond(design_from(PAPER), np.array([1.5e-3]))
    with pytest.raises(OutOfRangeError, match=r"friction_coefficient must be 0, got 0\.3"):
        FiniteElements().respond(design_from(PAPER, friction_coefficient=0.3), np.array([0.1e-3]))
