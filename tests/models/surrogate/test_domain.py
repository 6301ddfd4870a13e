"""The range of the surrogate in the dimensionless groups: which designs are inside, and what is said of one that is not."""

from collections.abc import Sequence

import numpy as np
import pytest

from models.examples import PAPER_SENSOR
from models.sensor import FloatArray, design_from
from models.surrogate import FAMILIES, Family, family_of, family_of_design
from models.surrogate.coordinates import electric_features, mechanical_features
from models.surrogate.domain import BOUNDS, GAP, LENGTHS, OWN, Bound, groups_of, inside, violated
from models.surrogate.groups import GROUPS, Group
from models.surrogate.training import values_beyond
from models.surrogate.validation import random_designs


def lengths_to_groups(lengths: Sequence[float] | FloatArray, modulus: float = 1.0) -> FloatArray:
    radius, h_s, h_p, a = lengths
    return np.array([[h_s / radius, h_p / radius, a / radius, modulus, 0.5, 1.0]])


def random_lengths(rng: np.random.Generator, n: int) -> FloatArray:
    low, high = np.array(list(LENGTHS.values())).T
    lengths = low + (high - low) * rng.uniform(size=(n, 4))
    return np.asarray(lengths[lengths[:, 3] >= lengths[:, 0]])


def test_every_lab_of_the_stated_lengths_is_inside_at_any_scale() -> None:
    for lengths in random_lengths(np.random.default_rng(0), 500):
        for scale in (0.1, 1.0, 7.0):
            assert inside(lengths_to_groups(scale * lengths))[0], lengths


def test_a_design_is_inside_only_if_some_scale_brings_all_lengths_inside() -> None:
    low, high = np.array(list(LENGTHS.values())).T
    rng = np.random.default_rng(1)
    scales = np.geomspace(1e-2, 1e2, 20001)[:, None]
    seen = [0, 0]
    for _ in range(300):
        lengths = np.exp(rng.uniform(np.log(np.maximum(low, 0.02) / 4), np.log(high * 4)))
        fits = np.any(np.all((scales * lengths >= low * (1 - 1e-3)) & (scales * lengths <= high * (1 + 1e-3)), axis=1))
        fits = fits and lengths[3] >= lengths[0]
        assert inside(lengths_to_groups(lengths))[0] == fits
        seen[int(fits)] += 1
    assert min(seen) > 30


@pytest.mark.parametrize("bound", BOUNDS, ids=lambda b: b.name)
def test_each_bound_is_named_with_its_value(bound: Bound) -> None:
    rng = np.random.default_rng(2)
    groups = np.exp(rng.normal(size=(4000, 6)) * 3)
    off = groups[[violated(g[None]).startswith(bound.name) for g in groups]]
    assert len(off) > 0
    for g in off[:5]:
        value = bound.of(g[None])[0]
        assert f"{bound.name} from {bound.low:.4g} to {bound.high:.4g}, got {value:.4g}" == violated(g[None])
        assert not bound.low <= value <= bound.high


PAPER = PAPER_SENSOR | {"young_modulus": 0.62e6}


def test_stiffening_belongs_to_gents_family_and_not_beyond_its_end() -> None:
    neo, gent = FAMILIES["neo-hookean"], FAMILIES["gent"]
    for stiffening, plain, inside_gent in ((0.0, True, True), (0.05, False, True), (0.11, False, False)):
        design = design_from(PAPER | {"stiffening": stiffening}).draws()
        assert neo.serves(design)[0] == plain
        assert gent.serves(design)[0]
        assert inside(groups_of(design, gent), gent)[0] == inside_gent
    assert violated(groups_of(design, gent), gent) == "stiffening from 0 to 0.1, got 0.11"


@pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda f: f.name)
def test_designs_of_a_family_are_its_own_and_no_others(family: Family) -> None:
    assert family_of({group.parameter for group in family.own}, base=family.base) is family
    for design in random_designs(5, 1, family):
        found = [other for other in FAMILIES.values() if other.serves(design.draws())[0]]
        # Nothing of a group is the beginning of a family that has it.
        assert found == [f for f in FAMILIES.values() if f is family or (f.base == family.base and not family.own)]
        assert family_of_design(design) is family
        assert not family.refusal(design.draws())
        groups = groups_of(design.draws(), family)
        assert inside(groups, family)[0]
        again = values_beyond(groups[0, :GAP], family)
        for parameter, value in again.items():
            assert value == pytest.approx(float(design.parameters()[parameter]), rel=1e-9)
        for other in FAMILIES.values():
            assert bool(other.refusal(design.draws())) == (other not in found)


def test_no_family_serves_two_kinds_of_physics_at_once() -> None:
    assert family_of({"stiffening", "friction_coefficient"}) is None
    assert family_of({"stiffening"}, base="slippery") is None
    design = design_from(PAPER | {"stiffening": 0.02}, friction_coefficient=0.3)
    assert family_of_design(design) is None
    assert FAMILIES["gent"].refusal(design) == "is trained for frictionless contact; friction_coefficient must be 0, got 0.3"
    assert FAMILIES["friction"].refusal(design) == "is trained for neo-Hookean layers; stiffening must be 0, got 0.02"


@pytest.mark.parametrize("group", GROUPS, ids=lambda g: g.parameter)
def test_a_group_vanishes_where_it_is_plain_and_rises_smoothly_to_its_end(group: Group) -> None:
    assert group.coordinate(np.array(group.plain)) == 0
    coordinates = np.linspace(0, group.end, 30)
    np.testing.assert_allclose(group.coordinate(group.value(coordinates)), coordinates, atol=1e-12)
    steps = np.diff(group.value(coordinates[:-1]))
    assert np.all(steps > 0) or np.all(steps < 0)
    step = np.imag(group.coordinate(np.array(group.plain) + 1e-30j * group.step)) / 1e-30
    assert 0.1 < abs(step) / group.end < 10


def test_friction_goes_up_to_a_ball_that_sticks() -> None:
    friction = np.array([0.0, 0.3, 1.0, np.inf])
    design = design_from({k: np.full(4, v) for k, v in PAPER.items()} | {"friction_coefficient": friction})
    groups = groups_of(design, FAMILIES["friction"])
    np.testing.assert_allclose(groups[:, OWN], np.tanh(friction / 0.4))
    assert groups[-1, OWN] == 1
    np.testing.assert_array_equal(FAMILIES["neo-hookean"].serves(design), [True, False, False, False])
    assert np.all(FAMILIES["friction"].serves(design))


def test_features_are_finite_without_padding_and_on_the_borders() -> None:
    paper = {
        "indenter_radius": 5e-3,
        "sensor_thickness": 0.74e-3,
        "sensor_radius": 10e-3,
        "young_modulus": 0.62e6,
        "relative_permittivity": 2.8,
        "padding_thickness": 0.0,
        "padding_young_modulus": 1e9,
    }
    groups = groups_of(design_from(paper).draws())
    np.testing.assert_allclose(groups, [[0.148, 0, 2, 1, 0.5, 1]])
    assert np.all(np.isfinite(electric_features(groups)))
    assert mechanical_features(groups).shape == (1, 8)
