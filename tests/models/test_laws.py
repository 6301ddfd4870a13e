"""Hyperelastic laws against their own energy, against uniaxial tension in closed form, and in the finite elements."""

from collections.abc import Callable

import numpy as np
import pytest

from models.fem import dimensionless, material
from models.fem.elements import deformation, make_elements
from models.fem.equilibrium import DiscreteSensor, Failure, State, instability, make_model
from models.fem.material import Material, at_point, least_acoustic
from models.fem.path import walk
from models.laws import Gent, Law, MooneyRivlin, NeoHookean, Ogden, Yeoh
from models.layers import Dielectric, Layer, LayeredDesign, sphere
from models.sensor import FloatArray

LAWS = [
    NeoHookean(),
    MooneyRivlin(0.3),
    Yeoh(0.05, 0.01),
    Gent(30.0),
    Ogden((1.2, -0.2), (1.6, -2.4)),
    Ogden((0.5, 0.4, 0.1), (1.3, 5.0, -2.0)),
]
all_laws = pytest.mark.parametrize("law", LAWS, ids=repr)


def solid(law: Law, n: int = 1, modulus: float = 1.0) -> Material:
    mu = np.full((n, 1), modulus)
    return Material((law,), (np.arange(n),), mu, 1e4 * mu)


def random_gradients(n: int, size: float = 0.2, seed: int = 0) -> FloatArray:
    """Gradients (5, 1, n) around the undeformed state, the first of them undeformed."""
    f = np.array([1.0, 0, 0, 1, 1])[:, None, None] + size * np.random.default_rng(seed).normal(size=(5, 1, n))
    f[:, 0, 0] = [1, 0, 0, 1, 1]
    return f


@all_laws
def test_stress_is_the_gradient_of_the_energy_and_tangent_of_the_stress(law: Law) -> None:
    # Equal and nearly equal in-plane stretches, where formulas in principal stretches break down, are among the gradients.
    f = np.concatenate([random_gradients(20), random_gradients(10, 1e-5, seed=1), random_gradients(10, 3e-2, seed=2)], axis=2)
    p, h, solid_ = np.random.default_rng(3).normal(size=f.shape[1:]), 1e-6, solid(law, modulus=0.7)
    at = at_point(solid_, f, p)
    for k in range(5):
        step = np.zeros((5, 1, 1))
        step[k] = h
        slope = (material.energy(solid_, f + step, p) - material.energy(solid_, f - step, p)) / (2 * h)
        np.testing.assert_allclose(at.stress[k], slope, atol=2e-7)
        slope = (at_point(solid_, f + step, p).stress - at_point(solid_, f - step, p).stress) / (2 * h)
        np.testing.assert_allclose(at.tangent[:, k], slope, atol=1e-6)
    np.testing.assert_allclose(at.tangent, np.swapaxes(at.tangent, 0, 1), atol=1e-14)


@all_laws
def test_undeformed_solid_is_free_of_stress_with_unit_shear_modulus(law: Law) -> None:
    f = random_gradients(1)
    at = at_point(solid(law), f, np.zeros((1, 1)))
    np.testing.assert_allclose(at.stress, 0, atol=1e-12)
    shear = np.array([0, 1, 0, 0, 0.0])
    assert np.einsum("m,mnij,n->", shear, at.tangent, shear) == pytest.approx(1, rel=1e-9)


@all_laws
def test_energy_does_not_change_under_rotation(law: Law) -> None:
    f, angle = random_gradients(8), 0.7
    c, s = np.cos(angle), np.sin(angle)
    turned = np.stack([c * f[0] - s * f[2], c * f[1] - s * f[3], s * f[0] + c * f[2], s * f[1] + c * f[3], f[4]])
    p = np.random.default_rng(4).normal(size=f.shape[1:])
    one = material.energy(solid(law), f, p)
    np.testing.assert_allclose(material.energy(solid(law), turned, p), one, rtol=1e-11, atol=1e-13)


def engineering_stress(law: Law, stretch: float) -> float:
    """P/mu of an incompressible bar in uniaxial tension, each law's own textbook formula."""
    i1 = stretch**2 + 2 / stretch
    pull = stretch - stretch**-2
    match law:
        case NeoHookean():
            return pull
        case MooneyRivlin(c01_share=c):
            return pull * ((1 - c) + c / stretch)
        case Yeoh(c2=c2, c3=c3):
            return pull * (1 + 2 * c2 * (i1 - 3) + 3 * c3 * (i1 - 3) ** 2)
        case Gent(locking=jm):
            return pull * jm / (jm - (i1 - 3))
        case Ogden(shares=shares, exponents=exponents):
            terms = zip(shares, exponents, strict=True)
            return float(sum(2 * m / a * (stretch ** (a - 1) - stretch ** (-a / 2 - 1)) for m, a in terms))
        case _:
            raise NotImplementedError(f"the textbook formula of {law!r}")


@all_laws
@pytest.mark.parametrize("stretch", [0.5, 0.999, 1.3, 2.0])
def test_uniaxial_tension_gives_the_textbook_stress(law: Law, stretch: float) -> None:
    side = stretch**-0.5
    f = np.array([side, 0, 0, stretch, side]).reshape(5, 1, 1)
    bare = at_point(solid(law), f, np.zeros((1, 1)))
    # The pressure that frees the sides: P_rr + p cof_rr = 0.
    stress = bare.stress - bare.stress[0] / bare.cofactor[0] * bare.cofactor
    assert stress[4, 0, 0] == pytest.approx(0, abs=1e-12)
    assert stress[3, 0, 0] == pytest.approx(engineering_stress(law, stretch), rel=1e-9)


def pressed(law: Law, depth: float = 0.1) -> tuple[DiscreteSensor, list[State], Failure | None]:
    half = Dielectric(0.25, 0.3, 2.8)
    design = LayeredDesign(sphere(1.0), (Layer(0.2, 3.0), Layer(0.1, 3.0, law)), 1.5, 1.5, (half,))
    model = make_model(dimensionless(design)[0], depth, 4e-3)
    path = list(walk(model, np.linspace(0.25, 1, 4) * depth))
    failures = [s for s in path if isinstance(s, Failure)]
    return model, [s for s in path if isinstance(s, State)], failures[0] if failures else None


@pytest.mark.parametrize(
    "law", [MooneyRivlin(0.0), Yeoh(0.0), Gent(1e9), Ogden((1.0,), (2.0,)), Ogden((0.4, 0.6), (2.0, 2.0))], ids=repr
)
def test_laws_with_trivial_shape_parameters_are_neo_hookean(law: Law) -> None:
    _, exact, _ = pressed(NeoHookean())
    _, same, _ = pressed(law)
    assert [s.force for s in same] == pytest.approx([s.force for s in exact], rel=1e-6)


def test_stiffening_laws_take_more_force_and_newton_stays_short() -> None:
    _, plain, _ = pressed(NeoHookean(), 0.13)
    for law in (Yeoh(0.2), Gent(6.0), Ogden((0.7, 0.3), (2.0, 6.0))):
        _, states, failure = pressed(law, 0.13)
        assert failure is None
        assert states[-1].force > 1.01 * plain[-1].force
        assert max(len(s.newton) for s in states) <= 9


def test_a_gent_layer_is_never_stretched_beyond_its_limit() -> None:
    model, states, _ = pressed(Gent(1.5), 0.16)
    f = deformation(model.elements, states[-1].u)
    top = np.tile(model.mesh.layer == 1, model.mesh.shape[0])
    assert 0.5 < np.max(np.sum(f**2, axis=0)[top] - 3) < 1.5


def test_loss_of_ellipticity_is_found_where_a_law_softens() -> None:
    # Yeoh with a negative second term: in simple shear k the stress k (1 + 2 c2 k^2) peaks at k^2 = -1/(6 c2).
    law = Yeoh(-0.05)
    for k, lost in ((1.7, False), (1.95, True)):
        f = np.array([1, k, 0, 1, 1.0]).reshape(5, 1, 1)
        assert bool(np.any(least_acoustic(at_point(solid(law), f, np.zeros((1, 1)))) <= 0)) is lost
    # Neo-Hookean never loses it.
    f = random_gradients(50, 0.5)
    f = f[:, :, (f[0, 0] * f[3, 0] - f[1, 0] * f[2, 0] > 0.1) & (f[4, 0] > 0.1)]
    assert np.min(least_acoustic(at_point(solid(NeoHookean()), f, np.zeros(f.shape[1:])))) > 0


def test_a_path_that_loses_ellipticity_says_so() -> None:
    model, states, failure = pressed(Yeoh(-0.25), 0.17)
    assert isinstance(failure, Failure)
    assert "lost strong ellipticity" in failure.reason
    assert instability(model, states[0]) == ""


def test_layers_of_different_laws_are_told_apart() -> None:
    design = LayeredDesign(
        sphere(1.0),
        (Layer(0.2, 3.0, Gent(20.0)), Layer(0.1, 6.0), Layer(0.1, 1.5, Gent(20.0))),
        1.5,
        1.5,
        (Dielectric(0, 0.2, 1),),
    )
    model = make_model(design, 0.1, 1e-2)
    parts = make_elements(model.mesh, design)
    assert parts.material.laws == (Gent(20.0), NeoHookean())
    layer = np.tile(model.mesh.layer, model.mesh.shape[0])
    np.testing.assert_array_equal(parts.material.where[1], np.flatnonzero(layer == 1))
    np.testing.assert_allclose(parts.material.modulus[:, 0], np.array([1.0, 2.0, 0.5])[layer])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: MooneyRivlin(1.5), "c01_share must lie between -1 and 1, got 1.5"),
        (lambda: Gent(0), "locking must be positive, got 0"),
        (lambda: Ogden((0.5,), (2.0, 3.0)), "same length"),
        (lambda: Ogden((0.5, 0.4), (2.0, 3.0)), "sum to one, got 0.9"),
        (lambda: Ogden((1.0,), (0.0,)), "exponents must not be zero"),
    ],
)
def test_shape_parameters_out_of_range_are_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()
