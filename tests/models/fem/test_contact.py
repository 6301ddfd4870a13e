"""Indenters of every shape, friction, bases and layers of the finite elements, against exact solutions and each other."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid

from models.examples import PAPER_SENSOR
from models.fem import FiniteElements, dimensionless
from models.fem.contact import distance, make_surface, nodal
from models.fem.elements import shape_1d
from models.fem.equilibrium import DiscreteSensor, Failure, State, make_model
from models.fem.mesh import make_mesh
from models.fem.path import FRICTION_STEP, walk
from models.laws import Gent, Law, MooneyRivlin
from models.layers import Dielectric, Layer, LayeredDesign, Profile, cone, flat_punch, layered, path_end, sphere
from models.response import OutOfRangeError
from models.sensor import Base, FloatArray, design_from

MODULUS = 0.6e6
NO_BASE: Any = "glued"


def stack(
    profile: Profile,
    *,
    h: float = 1.84e-3,
    a: float = 10e-3,
    base: Base = "bonded",
    friction: float = 0.0,
    law: Law | None = None,
    layers: tuple[Layer, ...] | None = None,
) -> LayeredDesign:
    layers = layers or (Layer(h, MODULUS) if law is None else Layer(h, MODULUS, law),)
    top = sum(x.thickness for x in layers)
    return LayeredDesign(profile, layers, a, a, (Dielectric(0.6 * top, top, 2.8),), friction, base)


def equilibria(model: DiscreteSensor, depths: FloatArray, friction_step: float = FRICTION_STEP) -> list[State]:
    """The equilibria of a path that is known to have them all."""
    found = [s for s in walk(model, depths, friction_step=friction_step) if isinstance(s, State)]
    assert len(found) == len(depths)
    return found


@pytest.mark.parametrize(
    "profile", [sphere(5.0), flat_punch(4.0, 1.0), cone(np.radians(60), 0.5), Profile(1.0, 0.7, 0.9)], ids=repr
)
def test_distance_normal_place_and_curvature_belong_to_one_shape(profile: Profile) -> None:
    # A walk along the meridian: points at a known distance from a known place, on the flat, the arc and the flank.
    b, rho, angle = profile.flat_radius, profile.rounding_radius, profile.flank_angle
    s = np.linspace(0.01, b + rho * angle + 0.4, 400)
    phi = np.clip((s - b) / rho, 0, angle)
    flank = np.maximum(s - b - rho * angle, 0)
    x = np.minimum(s, b) + rho * np.sin(phi) + flank * np.cos(angle)
    z = rho * (1 - np.cos(phi)) + flank * np.sin(angle)
    normal = np.stack([np.sin(phi), -np.cos(phi)])
    for away in (-0.05, 0.0, 0.1):
        at = distance(profile, x + away * normal[0], z + away * normal[1])
        np.testing.assert_allclose(at.gap, away, atol=1e-12)
        np.testing.assert_allclose(at.normal, normal, atol=1e-12)
        np.testing.assert_allclose(at.place, s, atol=1e-12)
    # Derivatives of gap, place and normal, away from where the parts of the meridian meet.
    inside = (np.abs(s - b) > 0.02) & (np.abs(s - b - rho * angle) > 0.02)
    x, z, h = (x + 0.05 * normal[0])[inside], (z + 0.05 * normal[1])[inside], 1e-6
    at = distance(profile, x, z)
    for k, step in enumerate(((h, 0.0), (0.0, h))):
        up, down = distance(profile, x + step[0], z + step[1]), distance(profile, x - step[0], z - step[1])
        np.testing.assert_allclose((up.gap - down.gap) / (2 * h), at.normal[k], atol=1e-8)
        np.testing.assert_allclose((up.place - down.place) / (2 * h), at.rate * at.tangent[k], atol=1e-8)
        np.testing.assert_allclose((up.normal - down.normal) / (2 * h), at.curvature * at.tangent * at.tangent[k], atol=1e-8)


@pytest.mark.parametrize("profile", [sphere(5.0), flat_punch(4.0, 1.0), cone(np.radians(60), 0.5)], ids=repr)
def test_radius_and_height_of_a_profile_are_inverse(profile: Profile) -> None:
    for height in (0.05, 0.2, 0.6):
        assert profile.height_at(profile.radius_at(height)) == pytest.approx(height, rel=1e-12)


@pytest.mark.parametrize("law", [None, MooneyRivlin(0.3), Gent(20.0)], ids=repr)
def test_a_disc_pressed_evenly_on_a_slippery_base_is_in_uniaxial_compression(law: Law) -> None:
    # Flat plate wider than the disc, no friction on either side: F = pi a^2 P(stretch), to the mesh's last digit.
    design = stack(flat_punch(30e-3, 1e-3), h=4e-3, a=5e-3, base="slippery", law=law)
    response = FiniteElements(1e-2).respond(design, np.array([0.4e-3, 0.8e-3, 1.2e-3]))
    stretch = np.array([0.9, 0.8, 0.7])
    pull = stretch - stretch**-2
    if law is not None:
        i1 = stretch**2 + 2 / stretch
        pull = pull * ((0.7 + 0.3 / stretch) if isinstance(law, MooneyRivlin) else 20 / (20 - (i1 - 3)))
    # The volume gives way by p/K with K = 1e4 mu.
    np.testing.assert_allclose(response.force, -np.pi * 5e-3**2 * MODULUS / 3 * pull, rtol=3e-4)


def test_an_even_pressure_pushes_on_the_nodes_as_its_integral_does() -> None:
    # Integrals of 2 pi r N_i over the edges of the mesh, whose radii are not evenly spaced, by Gauss points.
    mesh = make_mesh(dimensionless(stack(sphere(5e-3)))[0], 0.1)
    surface = make_surface(mesh)
    x, w = np.polynomial.legendre.leggauss(3)
    half, middle = (surface.radius[:, 2:] - surface.radius[:, :1]) / 2, surface.radius[:, 1:2]
    exact = 2 * np.pi * (half * (middle + half * x) * w) @ shape_1d(x)[0].T
    np.testing.assert_allclose(nodal(surface, np.ones(surface.weight.shape)), exact, atol=1e-15)
    assert np.all(surface.weight > 0)


@pytest.mark.parametrize("profile", [flat_punch(2e-3, 0.5e-3), cone(np.radians(60), 1e-3)], ids=["punch", "cone"])
def test_punch_and_cone_are_hard_between_the_nodes_too(profile: Profile) -> None:
    for friction in (0.0, 0.3):
        solution = FiniteElements(1e-3).solve(stack(profile, friction=friction), np.array([0.2e-3, 0.4e-3]))
        assert max(s.penetration / s.depth for s in solution.checked().states) < 3e-4


def test_flat_punch_matches_the_exact_layer_at_small_depth() -> None:
    # F = (8/3) E b d of the half space (Boussinesq), stiffened by a bonded base as for every contact: a uniform lift in
    # proportion to F/(E h), 1 + 1.127 b/h + (1.127 b/h)^2. The contact ends on the rounded edge.
    b, edge, h = 1e-3, 0.01e-3, 12.5e-3
    response = FiniteElements(4e-3).respond(stack(flat_punch(b, edge), h=h, a=50e-3), np.array([2e-6]))
    assert b - edge < response.contact_radius[0] < b
    x = 1.127 * response.contact_radius[0] / h
    half_space = 8 / 3 * MODULUS * response.contact_radius[0] * 2e-6
    assert response.force[0] == pytest.approx(half_space * (1 + x + x**2), rel=1e-2)


def test_shallow_cone_matches_sneddon() -> None:
    # F = (8/(3 pi)) E tan(half angle) d^2 for a sharp cone (Sneddon 1965), once the rounded tip is behind.
    half_angle, depth = np.radians(80), 0.2e-3
    response = FiniteElements().respond(stack(cone(half_angle, 0.05e-3), h=25e-3, a=25e-3), np.array([depth]))
    exact = 8 / (3 * np.pi) * MODULUS * np.tan(half_angle) * depth**2
    radius = 2 / np.pi * depth * np.tan(half_angle)
    assert response.force[0] == pytest.approx(exact * (1 + 1.127 * radius / 25e-3), rel=2e-2)
    assert response.contact_radius[0] == pytest.approx(radius, rel=5e-2)


def test_friction_stiffens_between_none_and_stick() -> None:
    depth = np.linspace(0.2e-3, 0.8e-3, 4)
    by_friction = [
        FiniteElements(4e-3).respond(stack(sphere(5e-3), friction=f), depth).force for f in (0.0, 1e-9, 0.1, 0.3, 30.0, np.inf)
    ]
    none, hardly, some, more, much, stick = by_friction
    np.testing.assert_allclose(hardly, none, rtol=1e-5)
    np.testing.assert_allclose(much, stick, rtol=2e-3)  # at the rim of the contact anything slips
    assert np.all(some > none)
    assert np.all(more > some)
    assert np.all(stick >= more * (1 - 1e-6))
    # Both faces held, the thinned layer is squeezed out as a fluid between two walls and not one.
    assert 1.2 < stick[-1] / none[-1] < 1.8


def test_friction_keeps_to_coulombs_law_and_opposes_the_slip() -> None:
    model = make_model(dimensionless(stack(sphere(5e-3), friction=0.15))[0], 0.15, 4e-3)
    for state in walk(model, np.linspace(0.03, 0.15, 4)):
        assert not isinstance(state, Failure)
        on = state.contact.active & (state.contact.pressure > 0.02 * np.max(state.contact.pressure))
        assert np.all(np.abs(state.contact.friction[on]) <= 0.15 * state.contact.pressure[on] * (1 + 1e-6))
        slips = on & (state.contact.slip != 0)
        np.testing.assert_allclose(
            state.contact.friction[slips], -state.contact.slip[slips] * 0.15 * state.contact.pressure[slips], rtol=1e-6
        )
        assert state.penetration < 1e-4 * state.depth
    assert not isinstance(state, Failure)
    assert np.any(slips)
    assert np.any(on & (state.contact.slip == 0))


def test_friction_does_not_depend_on_the_step() -> None:
    def end(n: int) -> float:
        model = make_model(dimensionless(stack(sphere(5e-3), friction=0.2))[0], 0.15, 4e-3)
        return equilibria(model, np.linspace(0, 0.15, n + 1)[1:])[-1].force

    assert end(2) == pytest.approx(end(160), rel=2e-3)


def test_a_point_that_sticks_is_anchored_where_it_touched_and_not_where_the_step_began() -> None:
    # Anchored at either end of its step, these forces differ by 2 to 6 %.
    thin = (Layer(0.5e-3, 6e6, name="padding"), Layer(0.4e-3, 0.6e6, name="sensor"))
    design = dimensionless(stack(sphere(5e-3), friction=np.inf, layers=thin))[0]
    force = {}
    for n in (40, 160):
        path = equilibria(make_model(design, 0.08, 4e-3), 0.08 * np.array([0.4, 0.7, 1.0]), friction_step=1 / n)
        force[n] = [s.force for s in path]
    np.testing.assert_allclose(force[40], force[160], rtol=3e-3)


def test_a_cycle_with_friction_takes_energy_and_one_without_takes_none() -> None:
    up = np.linspace(0.05e-3, 0.7e-3, 14)
    path = np.concatenate([[0.0], up, up[-2::-1], [0.0]])
    lost = {}
    for friction in (0.0, 0.2):
        force = FiniteElements(4e-3).solve(stack(sphere(5e-3), friction=friction), path).response.force
        lost[friction] = trapezoid(force, path) / trapezoid(force[:15], path[:15])
    assert abs(lost[0.0]) < 1e-6
    assert 1e-3 < lost[0.2] < 0.2


def test_a_slippery_base_is_much_softer() -> None:
    depth = np.array([0.6e-3])
    bonded, slippery = (FiniteElements(4e-3).respond(stack(sphere(5e-3), base=b), depth).force for b in ("bonded", "slippery"))
    assert 1.5 < bonded[0] / slippery[0] < 2.2


def test_a_layer_cut_in_three_is_the_same_layer() -> None:
    depth = np.linspace(0.2e-3, 0.8e-3, 3)
    one = FiniteElements().respond(stack(sphere(5e-3)), depth)
    cut = tuple(Layer(h * 1e-3, MODULUS) for h in (0.9, 0.64, 0.3))
    three = FiniteElements().respond(stack(sphere(5e-3), layers=cut), depth)
    np.testing.assert_allclose(three.force, one.force, rtol=1e-3)
    np.testing.assert_allclose(three.capacitance_change, one.capacitance_change, rtol=2e-3)


def test_a_stiff_skin_takes_load_and_a_soft_one_gives_way() -> None:
    depth = np.array([0.5e-3])
    plain = FiniteElements(4e-3).respond(stack(sphere(5e-3)), depth).force[0]
    for factor, low, high in ((20.0, 1.1, 4.0), (0.1, 0.3, 0.95)):
        skin = (Layer(1.7e-3, MODULUS), Layer(0.14e-3, factor * MODULUS, name="encapsulation"))
        assert low < FiniteElements(4e-3).respond(stack(sphere(5e-3), layers=skin), depth).force[0] / plain < high


def test_a_design_and_its_layers_give_the_same() -> None:
    own = {"padding_young_modulus": 0.3e6, "electrode_radius": 8e-3, "dielectric_thickness": 0.2e-3}
    design, depth = design_from(PAPER_SENSOR | own), np.array([0.2e-3, 0.5e-3])
    one, two = FiniteElements(4e-3).respond(design, depth), FiniteElements(4e-3).respond(layered(design), depth)
    np.testing.assert_array_equal(one.force, two.force)
    np.testing.assert_array_equal(one.capacitance, two.capacitance)
    assert two.rest_capacitance == pytest.approx(design.rest_capacitance, rel=1e-12)


def test_an_indenter_wider_than_the_disc_is_refused() -> None:
    with pytest.raises(OutOfRangeError, match="narrower than the disc"):
        FiniteElements().respond(stack(cone(np.radians(80), 0.1e-3), h=20e-3, a=5e-3), np.array([3e-3]))
    assert path_end(stack(sphere(5e-3), h=4e-3, a=3e-3)) == pytest.approx(5e-3 - np.sqrt(25 - 2.91**2) * 1e-3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sphere(0.0), "rounding radius must be positive"),
        (lambda: flat_punch(1e-3, 2e-3), "edge radius 2 mm exceeds the cylinder's 1 mm"),
        (lambda: cone(np.radians(95), 1e-4), "flank angle must lie between 0 and 90 degrees, got -5"),
        (lambda: Layer(-1e-3, MODULUS, name="skin"), "thickness of layer 'skin' must be positive, got -1 mm"),
        (lambda: stack(sphere(5e-3), friction=-0.1), "friction_coefficient must not be negative, got -0.1"),
        (lambda: stack(sphere(5e-3), base=NO_BASE), "base must be bonded or slippery, got 'glued'"),
        (
            lambda: LayeredDesign(sphere(5e-3), (Layer(1e-3, MODULUS),), 0.01, 0.01, (Dielectric(0.5e-3, 1.5e-3, 3.0),)),
            "a dielectric from 0.5 to 1.5 mm does not lie in a stack of 1 mm",
        ),
    ],
)
def test_designs_out_of_range_are_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()


def test_a_sphere_is_covered_to_its_radius_by_design_and_by_layers() -> None:
    deep = design_from(
        {
            "indenter_radius": 1e-3,
            "sensor_thickness": 3e-3,
            "sensor_radius": 10e-3,
            "young_modulus": MODULUS,
            "relative_permittivity": 2.8,
            "padding_thickness": 6e-3,
        }
    )
    assert path_end(layered(deep)) == pytest.approx(1e-3)
    assert FiniteElements().max_depth(deep)[0] == pytest.approx(1e-3)
    with pytest.raises(OutOfRangeError, match="up to 1 mm here"):
        FiniteElements().solve(deep, np.array([1.1e-3]))


def test_a_ball_that_sticks_is_right_at_its_first_depth_too() -> None:
    # In a single step to a hundredth of the largest depth this force was 3 % too large.
    soft = (Layer(2.4e-3, 0.034e6, name="padding"), Layer(0.135e-3, 0.6e6, name="sensor"))
    model = make_model(dimensionless(stack(sphere(5e-3), friction=np.inf, layers=soft))[0], 0.3, 4e-3)
    depths = np.array([0.003, 0.3])
    first, fine = (next(iter(walk(model, depths, friction_step=1 / n))) for n in (40, 400))
    assert isinstance(first, State)
    assert isinstance(fine, State)
    assert first.force == pytest.approx(fine.force, rel=4e-3)


def test_a_simple_design_has_its_base_and_its_friction_in_every_draw() -> None:
    friction = np.array([0.0, 0.3])
    depth, exact = np.array([0.3e-3]), FiniteElements(3e-2)
    batch = design_from(PAPER_SENSOR | {"friction_coefficient": friction}, base="slippery")
    assert batch.is_batch
    found = exact.respond(batch, depth).force[:, 0]
    single = batch.draw(1)
    assert (single.base, single.indenter.friction_coefficient) == ("slippery", 0.3)
    assert layered(single).base == "slippery"
    assert found[1] == exact.respond(layered(single), depth).force[0] > found[0]
    assert found[0] < 0.8 * exact.respond(design_from(PAPER_SENSOR), depth).force[0]
    rest = batch.only(friction > 0)
    assert rest.base == "slippery"
    np.testing.assert_array_equal(rest.indenter.friction_coefficient, [0.3])
    with pytest.raises(ValueError, match="base must be bonded or slippery, got 'glued'"):
        design_from(PAPER_SENSOR, base=NO_BASE)
