"""Friction between stack and base, against the friction hill in closed form, its ends, Coulomb's law, balance of energy."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.fem.check import check, taken_by_base, work
from models.fem.equilibrium import stored_energy
from models.fem.path import walk
from models.fem.sensitivity import derivatives
from models.fem.solution import Solution
from models.layers import Dielectric, Layer, LayeredDesign, flat_punch, layered
from models.sensor import design_from
from models.surrogate import FAMILIES, load_surrogate

PAPER = layered(design_from(PAPER_SENSOR, base="slippery"))
DEPTH = np.linspace(0, 0.5e-3, 11)[1:]


def pressed(coefficient: float, design: LayeredDesign = PAPER, accuracy: float = 4e-3) -> Solution:
    solution = FiniteElements(accuracy).solve(replace(design, base_friction_coefficient=coefficient), DEPTH)
    assert solution.failure is None
    return solution


@pytest.mark.parametrize("friction", [0.01, 0.02, 0.03, 0.05])
@pytest.mark.parametrize("slenderness", [5, 10, 20])
def test_a_plate_on_a_disc_that_slides_everywhere_meets_the_friction_hill(friction: float, slenderness: int) -> None:
    # Of a thin disc between a plate without friction and a base on which all of it slides, h dp/dr = -f p with p(a) that of the
    # free disc: F/F_0 = 2 (exp(k) - 1 - k)/k^2, k = f a/h (the slab method; E. Siebel, Stahl u. Eisen 45 (1925) 1563). It
    # neglects how the friction shears the layer, which is of the order of f^2 a/h.
    h, e = 1e-3, 0.6e6
    a = slenderness * h
    disc = LayeredDesign(flat_punch(6 * a, 1e-3), (Layer(h, e),), a, a, (Dielectric(0.6 * h, h, 2.8),), 0.0, "slippery")
    depth = np.array([1e-3, 2e-3, 4e-3]) * h
    free, rubs = (
        FiniteElements(2e-3).respond(replace(disc, base_friction_coefficient=f), depth).force for f in (0.0, friction)
    )
    k = friction * slenderness
    np.testing.assert_allclose(rubs / free, 2 * (np.exp(k) - 1 - k) / k**2, rtol=3.5e-3)


def test_it_goes_from_slippery_to_bonded_as_friction_grows() -> None:
    slippery, bonded = (FiniteElements(4e-3).respond(replace(PAPER, base=base), DEPTH) for base in ("slippery", "bonded"))
    by_friction = [pressed(f).response for f in (0.0, 1e-6, 0.1, 0.5, 2.0, 10.0, np.inf)]
    for end, found, rtol in ((slippery, 0, 0.0), (slippery, 1, 1e-5), (bonded, -2, 1e-2), (bonded, -1, 0.0)):
        np.testing.assert_allclose(by_friction[found].force, end.force, rtol=rtol)
        np.testing.assert_allclose(by_friction[found].capacitance_change, end.capacitance_change, rtol=10 * rtol)
    for less, more in pairwise(by_friction):
        assert np.all(more.force >= less.force)
    # A pad that lies on its base unglued is neither, whatever silicone rubs on: at 0.5 it is nearly half way in force.
    assert 1.2 < by_friction[3].force[-1] / slippery.force[-1] < 1.35
    assert by_friction[4].force[-1] < 0.95 * bonded.force[-1]


@pytest.mark.parametrize(("sensor", "padding", "disc", "ratio"), [(0.338, 3.64, 4.93, 0.2), (0.109, 4.55, 1.98, 0.58)])
def test_little_friction_under_thick_padding_has_its_equilibria_from_first_touch_on(
    sensor: float, padding: float, disc: float, ratio: float
) -> None:
    radius = PAPER_SENSOR["indenter_radius"]
    values = {
        "sensor_thickness": sensor * radius,
        "padding_thickness": padding * radius,
        "sensor_radius": disc * radius,
        "padding_young_modulus": ratio * PAPER_SENSOR["young_modulus"],
        "base_friction_coefficient": 0.15,
    }
    design = design_from({**PAPER_SENSOR, "electrode_radius": 0.8 * disc * radius, **values}, base="slippery")
    solution = FiniteElements(1e-3).solve(layered(design), np.array([0.00125, 0.005]) * radius)
    assert solution.failure is None
    assert np.mean(solution.states[-1].sliding.slip == 1) > 0.9  # outwards


@pytest.mark.parametrize("ball", [0.0, 0.2])
def test_friction_on_the_base_keeps_to_coulombs_law_opposes_the_slip_and_takes_its_share_of_the_work(ball: float) -> None:
    solution = pressed(0.3, replace(PAPER, friction_coefficient=ball), 2e-3)
    states, base = solution.states, solution.model.base
    for before, state in pairwise(states):
        nodes = state.sliding
        assert np.all(np.abs(nodes.friction) <= 0.3 * np.maximum(nodes.push, 0) * (1 + 1e-6))
        moved = (state.u - before.u)[base.r_dofs]
        assert np.all(nodes.slip[nodes.slip != 0] * moved[nodes.slip != 0] > -1e-12)
        assert np.all(
            nodes.friction[nodes.sticks & before.sliding.sticks] * moved[nodes.sticks & before.sliding.sticks] <= 1e-12
        )
        assert np.sum(nodes.push) == pytest.approx(state.force, rel=1e-5)
    assert 0.2 < np.mean(nodes.slip != 0) < 0.9
    assert np.any(nodes.sticks[1:])
    if ball == 0:
        taken = taken_by_base(solution)
        stored = stored_energy(solution.model, states[-1])
        assert taken > 0.05 * stored
        assert work(states) == pytest.approx(stored + taken, rel=2e-3)
    assert np.isnan(check(FiniteElements(4e-3), solution).energy_error)


def test_it_does_not_depend_on_the_step_and_a_cycle_loses_energy() -> None:
    solution = pressed(0.3)
    model, depths = solution.model, np.array([0.05, 0.1])
    coarse, fine = ([s.force for s in walk(model, depths, friction_step=step)] for step in (1 / 10, 1 / 160))  # type: ignore[union-attr]
    np.testing.assert_allclose(coarse, fine, rtol=2e-3)
    down = DEPTH[-2::-1]
    back = FiniteElements(4e-3).solve(solution.design, np.concatenate([DEPTH, down])).response.force
    up = back[: DEPTH.size]
    np.testing.assert_array_less(back[DEPTH.size :], up[-2::-1])


def test_a_design_and_its_layers_have_the_same_friction_on_the_base() -> None:
    design = design_from(PAPER_SENSOR | {"base_friction_coefficient": 0.3}, base="slippery")
    found = FiniteElements(4e-3).respond(design, DEPTH)
    np.testing.assert_array_equal(found.force, pressed(0.3).response.force)
    assert np.all(load_surrogate(family=FAMILIES["slippery"]).max_depth(design) == 0)


def test_friction_on_the_base_is_refused_where_it_cannot_be() -> None:
    with pytest.raises(ValueError, match="base_friction_coefficient must not be negative, got -1"):
        replace(PAPER, base_friction_coefficient=-1.0)
    with pytest.raises(ValueError, match=r"must not be above 10 unless it is inf, .* got 11"):
        replace(PAPER, base_friction_coefficient=11.0)
    with pytest.raises(ValueError, match=r"is that of a slippery base, got 0\.3 on one that is bonded"):
        replace(PAPER, base="bonded", base_friction_coefficient=0.3)
    solution = pressed(0.3)
    with pytest.raises(ValueError, match="depends on the whole path"):
        derivatives(solution, {})
