"""Closed forms against exact solutions and against each other."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from models.analytic import (
    CHI_MAX,
    ball_on_bonded_layer,
    bonded_layer_factor,
    hertz_force,
    layer_weight,
    plate_capacitance_change,
)
from models.response import OutOfRangeError
from models.sensor import FloatArray


def bonded_kernel(x: FloatArray) -> FloatArray:
    """L(x) of an incompressible layer bonded to a rigid base, kappa = 3 - 4 nu = 1 (Hayes et al. 1972)."""
    # (2 sinh 2x - 4x) / (2 cosh 2x + 2 + 4 x^2), written without overflow.
    e = np.exp(-2 * x)
    return np.asarray((1 - e**2 - 4 * x * e) / (1 + e**2 + 2 * e + 4 * x**2 * e))


def exact_layer_factor(chi: FloatArray) -> FloatArray:
    """F / F_Hertz by the Fredholm equation of the paraboloid on a bonded layer (nu = 1/2), with h = 1 and a as unknown scale.

    phi(t) - (1/pi) int_0^a [K(t-s) + K(t+s)] phi(s) ds = (E*/pi) (d - t^2/R), K(u) = int_0^inf (1 - L(x)) cos(x u) dx, and
    phi(a) = 0 fixes d; F = 2 pi int_0^a phi. Linear in d and in 1/R: solve for both right-hand sides.
    """
    x, wx = np.polynomial.legendre.leggauss(400)
    x, wx = 20 * (x + 1), 20 * wx

    def kernel(u: FloatArray) -> FloatArray:
        return np.cos(np.multiply.outer(u, x)) @ (wx * (1 - bonded_kernel(x)))

    def factor(a: float) -> tuple[float, float]:
        t, w = np.polynomial.legendre.leggauss(48)
        t, w = a * (t + 1) / 2, a * w / 2
        edge = np.append(t, a)
        k = (kernel(edge[:, None] - t) + kernel(edge[:, None] + t)) / np.pi * w
        system = np.eye(48) - k[:48]
        flat, parabola = np.linalg.solve(system, np.stack([np.ones(48), -(t**2)], axis=1)).T
        flat_edge, parabola_edge = 1 + k[48] @ flat, -(a**2) + k[48] @ parabola
        depth = -parabola_edge / flat_edge  # R = 1, E*/pi = 1
        force = 2 * np.pi * w @ (depth * flat + parabola)
        return np.sqrt(depth), force / (4 / 3 * np.pi * depth**1.5)

    a = np.linspace(0.02, 3.0, 150)
    table = np.array([factor(v) for v in a])
    return np.asarray(np.interp(chi, table[:, 0], table[:, 1]))


def test_bonded_layer_factor_solves_the_integral_equation() -> None:
    chi = np.array([0.0962, 0.3444, 0.7479, 1.0544, 1.3489, 1.65])
    exact = exact_layer_factor(chi)
    # The table of the same equation by an independent script: 1.1235, 1.6355, 3.3711, 5.5632, 8.4680.
    np.testing.assert_allclose(exact[:5], [1.1235, 1.6355, 3.3711, 5.5632, 8.4680], rtol=2e-3)
    np.testing.assert_allclose(bonded_layer_factor(chi), exact, rtol=4e-3)


def test_a_ball_on_a_bonded_layer_is_between_hertz_and_confined_compression() -> None:
    for nu in (0.0, 0.3, 0.45):
        # A layer much thicker than the contact: Hertz, stiffened by the base in proportion to the contact.
        for a, tolerance in ((0.02, 0.04), (0.005, 0.01)):
            depth, force = ball_on_bonded_layer(a, 10.0, nu)
            assert force == pytest.approx(4 / 3 / (1 - nu**2) * np.sqrt(10) * depth**1.5, rel=tolerance)
        # Much thinner: every column is pressed on its own, F = pi R M d^2 with the modulus M of confined compression.
        confined = (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        wide = [ball_on_bonded_layer(a, 1e4, nu) for a in (2.0, 4.0)]
        ratio = [force / (np.pi * 1e4 * confined * depth**2) for depth, force in wide]
        assert abs(ratio[1] - 1) < abs(ratio[0] - 1) < 0.6
    # An incompressible one, by the fit to the equation of a paraboloid above.
    for a in (0.3, 1.0, 2.0):
        depth, force = ball_on_bonded_layer(a, 1e3, 0.5)
        factor = force / (16 / 9 * np.sqrt(1e3) * depth**1.5)
        assert factor == pytest.approx(bonded_layer_factor(np.array([np.sqrt(1e3 * depth)]))[0], rel=4e-3)


def test_bonded_layer_factor_is_one_for_a_half_space_and_refuses_beyond_its_fit() -> None:
    assert bonded_layer_factor(np.zeros(1)) == 1.0
    with pytest.raises(OutOfRangeError, match=r"0\.\.1\.69, got 2"):
        bonded_layer_factor(np.array([CHI_MAX, 2.0]))


def test_hertz_force_of_a_known_case() -> None:
    # (16/9) 1 MPa sqrt(5 mm) (0.1 mm)^1.5 = 0.1257 N
    assert hertz_force(1e6, 5e-3, np.array([1e-4]))[0] == pytest.approx(16 / 9 * 1e6 * (5e-3) ** 0.5 * 1e-6)
    assert hertz_force(1e6, 5e-3, np.array([-1e-4]))[0] == 0.0


def test_layer_weight_goes_from_nothing_to_all() -> None:
    weight = layer_weight(np.array([1e-6, 1.0, 1e6]))
    assert weight[0] == pytest.approx(0, abs=1e-5)
    assert weight[1] == pytest.approx(0.5 - 0.5 / np.pi)
    assert weight[2] == pytest.approx(1, abs=1e-5)


def test_plate_capacitance_change_is_the_integral_over_rings() -> None:
    h, radius, electrode, depth = 1.84e-3, 5e-3, 10e-3, 0.6e-3
    r = np.linspace(0, np.sqrt(2 * radius * depth), 200_001)
    gap = h - (depth - r**2 / (2 * radius))
    rings = trapezoid((h / gap - 1) * 2 * r / electrode**2, r)
    assert plate_capacitance_change(h, radius, electrode, np.array([depth]))[0] == pytest.approx(rings, rel=1e-6)
