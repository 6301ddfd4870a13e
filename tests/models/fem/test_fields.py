"""Fields of an equilibrium on the nodes of every layer: exact solutions, balance of volume, jumps where layers meet."""

from functools import cache

import numpy as np
import pytest

from models.fem import FiniteElements, Solution, dimensionless
from models.fem.elements import shape_1d
from models.fem.equilibrium import State, make_model
from models.fem.fields import fields_of, sheet
from models.fem.path import walk
from models.layers import Dielectric, Layer, LayeredDesign, Profile, flat_punch, sphere
from models.sensor import Base

MODULUS = 0.6e6


def stack(profile: Profile, layers: tuple[Layer, ...], *, a: float = 10e-3, base: Base = "bonded") -> LayeredDesign:
    top = sum(x.thickness for x in layers)
    return LayeredDesign(profile, layers, a, a, (Dielectric(0.6 * top, top, 2.8),), base=base)


@cache
def pressed(below: float = MODULUS, above: float = MODULUS, depth: float = 0.7e-3, accuracy: float = 4e-3) -> Solution:
    layers = (Layer(1.1e-3, below, name="padding"), Layer(0.74e-3, above, name="sensor"))
    return FiniteElements(accuracy).solve(stack(sphere(5e-3), layers), np.array([depth]))


def test_even_compression_gives_even_fields() -> None:
    # Flat plate wider than the disc, no friction on either side: sigma_zz = mu (s^2 - 1/s), all other stresses are zero.
    design = stack(flat_punch(30e-3, 1e-3), (Layer(1.5e-3, MODULUS), Layer(2.5e-3, MODULUS)), a=5e-3, base="slippery")
    scaled, units = dimensionless(design)
    depths = np.array([0.4e-3, 1.2e-3]) / units.length
    model = make_model(scaled, depths[-1], 1e-2)
    states = tuple(s for s in walk(model, depths) if isinstance(s, State))
    solution = Solution(design, units, model, states, None)
    for step, stretch in enumerate((0.9, 0.7)):
        fields = fields_of(solution, step)
        mean = MODULUS / 3 * (1 / stretch - stretch**2) / 3
        np.testing.assert_allclose(fields.pressure, mean, rtol=3e-4)  # the volume gives way by p/K, K = 1e4 mu
        np.testing.assert_allclose(fields.pressure, fields.pressure[0], rtol=1e-5)
        np.testing.assert_allclose(fields.thickness_stretch, stretch, rtol=1e-6)
        np.testing.assert_allclose(fields.largest_stretch, stretch**-0.5, rtol=3e-5)
        np.testing.assert_allclose(fields.z, stretch * fields.rest_z, rtol=1e-6)
        np.testing.assert_allclose(fields.r, stretch**-0.5 * fields.rest_r, rtol=3e-5, atol=1e-12)


def test_at_rest_nothing_is_stressed_or_stretched() -> None:
    solution = FiniteElements(4e-3).solve(pressed().design, np.array([0.0]))
    fields = fields_of(solution)
    np.testing.assert_allclose(fields.pressure, 0, atol=1e-6)
    np.testing.assert_allclose(fields.thickness_stretch, 1, rtol=1e-12)
    np.testing.assert_allclose(fields.largest_stretch, 1, rtol=1e-7)  # a root of the round-off of a difference
    np.testing.assert_array_equal(fields.r, fields.rest_r)


def test_pressure_under_a_ball_on_a_half_space_is_hertz() -> None:
    # On the surface of an incompressible half space the mean stress is the contact pressure, p0 sqrt(1 - r^2/a^2) with
    # p0 = 3 F/(2 pi a^2) (Johnson, Contact Mechanics, 1985, section 3.4, at nu = 1/2).
    radius, depth = 5e-3, 0.02e-3
    solution = FiniteElements(1e-3).solve(stack(sphere(radius), (Layer(25e-3, MODULUS),), a=25e-3), np.array([depth]))
    fields, edge = fields_of(solution), np.sqrt(radius * depth)
    r, pressure = (sheet(fields, v, 0)[:, -1] for v in (fields.r, fields.pressure))
    inside = r < 0.8 * edge
    peak = 3 * solution.response.force[0] / (2 * np.pi * edge**2)
    assert np.count_nonzero(inside) > 8
    np.testing.assert_allclose(pressure[inside], peak * np.sqrt(1 - (r[inside] / edge) ** 2), rtol=0.05)
    assert np.all(np.abs(pressure[r > 1.3 * edge]) < 0.03 * peak)


def test_layers_of_unlike_modulus_jump_by_what_the_axial_stress_asks_for() -> None:
    # On the axis F = diag(s^-1/2, s, s^-1/2) with the same s on both sides, as the faces stay together, and
    # sigma_zz = -p + (2/3) mu (s^2 - 1/s) has no jump.
    below, above = 0.2e6, 1.2e6
    fields = fields_of(pressed(below, above))
    (p0, p1), (s0, s1) = (
        [sheet(fields, v, 0)[0, -1], sheet(fields, v, 1)[0, 0]] for v in (fields.pressure, fields.thickness_stretch)
    )
    assert s1 == pytest.approx(s0, rel=0.01)
    assert p1 - p0 == pytest.approx(2 / 3 * (above - below) / 3 * (s0**2 - 1 / s0), rel=0.02)


def test_layers_of_one_material_do_not_jump() -> None:
    fields = fields_of(pressed())
    for values in (fields.pressure, fields.thickness_stretch, fields.largest_stretch):
        jump = sheet(fields, values, 1)[:, 0] - sheet(fields, values, 0)[:, -1]
        assert np.max(np.abs(jump)) < 0.04 * np.ptp(values)


def test_fields_settle_as_the_grid_is_refined() -> None:
    coarse, fine = fields_of(pressed()), fields_of(pressed(accuracy=5e-4))
    for name in ("pressure", "thickness_stretch", "largest_stretch"):
        for row in (0, -1):  # both faces of the sensor, out to where the contact ends and the pressure has an edge
            r = np.linspace(0, 1.8e-3, 30)
            one, two = (
                np.interp(r, sheet(f, f.rest_r, 1)[:, row], sheet(f, getattr(f, name), 1)[:, row]) for f in (coarse, fine)
            )
            np.testing.assert_allclose(one, two, atol=0.01 * np.ptp(getattr(fine, name)))


def test_points_on_an_interface_are_there_twice_in_one_place() -> None:
    fields = fields_of(pressed(0.2e6, 1.2e6))
    for values in (fields.r, fields.z, fields.rest_r, fields.rest_z):
        np.testing.assert_array_equal(sheet(fields, values, 0)[:, -1], sheet(fields, values, 1)[:, 0])
    assert fields.r.size == sum(columns * rows for columns, rows in fields.shapes)
    np.testing.assert_array_equal(np.unique(fields.cells), np.arange(fields.r.size))
    np.testing.assert_allclose(sheet(fields, fields.rest_z, 0)[0, [0, -1]], [0, 1.1e-3], atol=1e-15)


def test_cells_keep_their_volume_and_turn_counterclockwise() -> None:
    # The nine functions in VTK's order: corners, middles of the sides, middle; 3 x 3 Gauss points.
    fields = fields_of(pressed(0.2e6, 1.2e6))
    x, w = np.polynomial.legendre.leggauss(3)
    (n, d), at = shape_1d(x), ([0, 2, 2, 0, 1, 2, 1, 0, 1], [0, 0, 2, 2, 0, 1, 2, 1, 1])
    value, dx, dy = (
        np.stack([np.outer(f[i], g[j]).ravel() for i, j in zip(*at, strict=True)]) for f, g in ((n, n), (d, n), (n, d))
    )
    volume = []
    for r, z in ((fields.rest_r, fields.rest_z), (fields.r, fields.z)):
        r, z = r[fields.cells], z[fields.cells]
        area = (r @ dx) * (z @ dy) - (r @ dy) * (z @ dx)
        assert np.all(area > 0)
        volume.append(np.sum(2 * np.pi * (r @ value) * area * np.outer(w, w).ravel(), axis=1))
    np.testing.assert_allclose(volume[1], volume[0], rtol=1e-3)  # p/K is up to 7e-4 in the soft layer
    for layer, thickness in enumerate((1.1e-3, 0.74e-3)):
        assert np.sum(volume[0][fields.layer == layer]) == pytest.approx(np.pi * 0.01**2 * thickness, rel=1e-12)


def test_the_surface_follows_the_ball() -> None:
    solution = pressed()
    fields = fields_of(solution)
    r, z = (sheet(fields, v, 1)[:, -1] for v in (fields.r, fields.z))
    tip = 1.84e-3 - 0.7e-3
    touching = r < 0.98 * solution.response.contact_radius[0]
    np.testing.assert_allclose(z[touching], tip + 5e-3 - np.sqrt(25e-6 - r[touching] ** 2), atol=1e-8)


def test_a_step_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="there is no step 1: the solution has 1"):
        fields_of(pressed(), 1)
