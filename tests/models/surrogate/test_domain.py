"""The range of the surrogate in the dimensionless groups: which designs are inside, and what is said of one that is not."""

from collections.abc import Sequence

import numpy as np
import pytest

from models.sensor import FloatArray, design_from
from models.surrogate import FAMILIES, family_of
from models.surrogate.coordinates import electric_features, mechanical_features
from models.surrogate.domain import BOUNDS, LENGTHS, STIFFENING, Bound, groups_of, inside, violated


def lengths_to_groups(lengths: Sequence[float] | FloatArray, modulus: float = 1.0) -> FloatArray:
    radius, h_s, h_p, a = lengths
    return np.array([[h_s / radius, h_p / radius, a / radius, modulus, 0.0, 0.5, 1.0]])


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
    groups = np.exp(rng.normal(size=(4000, 7)) * 3)
    off = groups[[violated(g[None]).startswith(bound.name) for g in groups]]
    assert len(off) > 0
    for g in off[:5]:
        value = bound.of(g[None])[0]
        assert f"{bound.name} from {bound.low:.4g} to {bound.high:.4g}, got {value:.4g}" == violated(g[None])
        assert not bound.low <= value <= bound.high


def test_stiffening_belongs_to_gents_family_and_not_beyond_its_end() -> None:
    groups = lengths_to_groups((5.0, 0.74, 1.1, 10.0))
    for stiffening, neo, gent in ((0.0, True, True), (0.05, False, True), (0.11, False, False)):
        groups[0, STIFFENING] = stiffening
        assert inside(groups)[0] == neo
        assert inside(groups, FAMILIES["gent"])[0] == gent
    assert violated(groups, FAMILIES["gent"]) == "1/J_m from 0 to 0.1, got 0.11"
    assert [family_of(stiffening=a, stick=b) for a in (False, True) for b in (False, True)] == [
        FAMILIES["neo-hookean"],
        FAMILIES["stick"],
        FAMILIES["gent"],
        None,
    ]


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
    np.testing.assert_allclose(groups, [[0.148, 0, 2, 1, 0, 0.5, 1]])
    assert np.all(np.isfinite(electric_features(groups)))
    assert mechanical_features(groups).shape == (1, 8)
