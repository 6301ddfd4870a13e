"""What every forward model owes its users, checked over all of them."""

import numpy as np
import pytest

from models.analytic import ClosedForm
from models.fem import FiniteElements
from models.response import Forward, OutOfRangeError, covered, depth_at_force, depth_table
from models.sensor import design_from
from models.surrogate.surrogate import load_surrogate

PAPER = {
    "indenter_radius": 5e-3,
    "sensor_thickness": 0.74e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.62e6,
    "relative_permittivity": 2.8,
    "dielectric_thickness": 0.16e-3,
    "padding_thickness": 1.10e-3,
}

FORWARDS = [ClosedForm(), FiniteElements(2e-3), load_surrogate()]


@pytest.mark.parametrize("forward", FORWARDS, ids=lambda f: f.name)
def test_forward_keeps_the_protocol(forward: Forward):
    design = design_from(PAPER)
    depth = np.array([0.2e-3, -0.1e-3, 0.0, 0.05e-3, 0.4e-3])
    single = forward.respond(design, depth)
    n = depth.size
    assert single.force.shape == single.capacitance.shape == single.contact_radius.shape == (n,)
    assert single.force_error.shape[0] == single.capacitance_error.shape[0] == n
    assert single.rest_capacitance.shape == ()

    # Before contact: no force, C0, and nothing to be wrong about.
    np.testing.assert_array_equal(single.force[[1, 2]], 0)
    np.testing.assert_array_equal(single.contact_radius[[1, 2]], 0)
    np.testing.assert_array_equal(single.capacitance[[1, 2]], single.rest_capacitance)
    assert not np.any(single.force_error[[1, 2]])
    assert not np.any(single.capacitance_error[[1, 2]])
    assert single.rest_capacitance == pytest.approx(design.rest_capacitance)

    # Deeper is more force, more contact, more capacitance.
    order = np.argsort(depth)
    for values in (single.force, single.contact_radius, single.capacitance):
        assert np.all(np.diff(values[order])[1:] > 0)

    # A batch is its draws.
    modulus = np.array([0.62e6, 1.24e6])
    batch = forward.respond(design_from(PAPER | {"young_modulus": modulus}), depth)
    assert batch.force.shape == (2, n)
    # (Networks in single precision round differently with the place in a batch.)
    np.testing.assert_allclose(batch.draw(0).force, single.force, rtol=1e-5)
    # Force scales with the modulus, and nothing else does.
    np.testing.assert_allclose(batch.force[1], 2 * batch.force[0], rtol=1e-5)
    np.testing.assert_allclose(batch.capacitance[1], batch.capacitance[0], rtol=1e-5)
    # One depth row for each draw.
    rows = forward.respond(design_from(PAPER | {"young_modulus": modulus}), np.stack([depth, depth / 2]))
    np.testing.assert_allclose(rows.force[0], single.force, rtol=1e-5)


@pytest.mark.parametrize("forward", FORWARDS, ids=lambda f: f.name)
def test_forward_refuses_what_it_does_not_cover(forward: Forward):
    design = design_from(PAPER)
    limit = forward.max_depth(design)
    assert limit.shape == (1,)
    assert 0.5e-3 < limit[0] < 1.5e-3
    beyond = np.array([limit[0] * 1.01])
    assert forward.outside(design, limit * 0.999) == ""
    assert f"{limit[0] * 1e3:.4g} mm" in forward.outside(design, beyond)
    np.testing.assert_array_equal(covered(forward, design, beyond), [False])
    with pytest.raises(OutOfRangeError, match="depths up to"):
        forward.respond(design, beyond)
    if not isinstance(forward, FiniteElements):
        with pytest.raises(OutOfRangeError, match="friction"):
            forward.respond(design_from(PAPER, friction_coefficient=0.2), np.array([1e-4]))


@pytest.mark.parametrize("forward", FORWARDS, ids=lambda f: f.name)
def test_depth_at_force_inverts_the_curve(forward: Forward):
    design = design_from(PAPER)
    table = depth_table(forward, design, 96)
    force = np.array([-1.0, 0.0, 0.01, 0.5, 5.0, 1e6])
    depth = depth_at_force(table, force)[0]
    np.testing.assert_array_equal(depth[:2], 0)
    assert np.isnan(depth[-1])
    np.testing.assert_allclose(forward.respond(design, depth[2:5]).force, force[2:5], rtol=1e-2)
