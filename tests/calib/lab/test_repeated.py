"""The same readings are known again however their file was cut; those of two presses of one machine are not taken for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calib.lab import SAME, Points, Sweep, as_one_piece, repeated_channels, rows_of, share_in_both, thinned_rows_of
from calib.lab.reduction import NoiseEstimate
from calib.problem.synthetic import Rig, synthetic_sweep
from models.analytic import ClosedForm
from models.sensor import FloatArray, design_from


def _press(seed: int, digits: int = 3, noise: float = 0.005) -> FloatArray:
    rng, depth = np.random.default_rng(seed), np.linspace(-0.1, 1.0, 1500)
    force: FloatArray = np.round(5 * np.maximum(depth, 0) ** 1.5 + noise * rng.standard_normal(depth.size), digits)
    return force


def _share(first: FloatArray, second: FloatArray) -> float:
    return share_in_both(rows_of(first), rows_of(second))


@pytest.mark.parametrize("part", [slice(1, None), slice(300, None), slice(None, 900), slice(500, 800)])
def test_a_part_of_a_record_is_known_again_in_any_unit(part: slice) -> None:
    force = _press(1)
    assert _share(force, force[part]) == 1.0
    assert _share(force, 1e-3 * (1e3 * force[part])) > 0.99


@pytest.mark.parametrize("kept", [slice(None, None, 2), slice(1, None, 3), slice(307, 1200, 10)])
def test_what_is_left_of_a_record_is_known_again(kept: slice) -> None:
    force = _press(1)
    assert share_in_both(rows_of(force[kept]), thinned_rows_of(force)) == 1.0
    assert share_in_both(rows_of(force[kept]), rows_of(force)) == 0.0
    for digits, noise in ((3, 0.005), (3, 0.001), (2, 0.005), (2, 0.001), (1, 0.01)):
        thinned = rows_of(_press(1, digits, noise)[kept])
        assert share_in_both(thinned, thinned_rows_of(_press(2, digits, noise))) < 0.2 * SAME


def test_what_is_left_of_a_long_record_is_known_again_by_a_few_of_its_rows() -> None:
    rng = np.random.default_rng(4)
    force = np.round(np.linspace(0, 5, 60_000) + 0.01 * rng.standard_normal(60_000), 4)
    other = np.round(np.linspace(0, 5, 60_000) + 0.01 * rng.standard_normal(60_000), 4)
    few = thinned_rows_of(force, few=True)
    assert few.size < 0.1 * thinned_rows_of(force).size
    for kept in (force[3::5], force[20_000:24_000:2]):
        assert share_in_both(rows_of(kept, few=True), few) == 1.0
        assert share_in_both(rows_of(kept, few=True), thinned_rows_of(other, few=True)) < 0.1


@pytest.mark.parametrize(("digits", "noise"), [(3, 0.005), (3, 0.001), (2, 0.005), (2, 0.001), (1, 0.01)])
def test_two_presses_of_one_machine_are_not_the_same(digits: int, noise: float) -> None:
    assert _share(_press(1, digits, noise), _press(2, digits, noise)) < 0.2 * SAME


def test_points_of_readings_coarser_than_their_noise_tell_nothing() -> None:
    means = np.round(np.linspace(97.0, 98.5, 40), 2)

    def sweep(noise: float, cut: int, file: str = "") -> Sweep:
        n = np.full(40 - cut, 30.0)
        found = NoiseEstimate(noise, 1.0, 0.01, 1.0, 1200, 1200, 40, 0)
        points = {"capacitance": Points(means[cut:], n)}
        files = (("log.csv", file),) if file else ()
        return Sweep(
            "s", "", 5e-3, points, None, {"capacitance": noise}, np.nan, np.nan, files, (), readings={"capacitance": found}
        )

    assert repeated_channels(sweep(0.02, 0), sweep(0.02, 2)) == ("capacitance",)
    assert repeated_channels(sweep(0.003, 0), sweep(0.003, 2)) == ()
    assert repeated_channels(sweep(0.003, 0), sweep(0.003, 0)) == ()
    assert repeated_channels(sweep(0.003, 0, "ab" * 32), sweep(0.003, 0, "ab" * 32)) == ("capacitance",)


def test_ramps_that_a_machine_follows_and_what_stands_still_are_nobodys_own() -> None:
    for commanded in (np.round(np.linspace(0, 5, 1500), 3), np.round(np.linspace(0, 5, 1500), 2), np.full(1500, 0.2)):
        assert _share(commanded, commanded) == 0.0


def test_long_records_are_known_again_by_some_of_their_rows() -> None:
    rng = np.random.default_rng(3)
    force = np.round(np.linspace(0, 5, 200_000) + 0.01 * rng.standard_normal(200_000), 4)
    assert _share(force, force[777:150_000]) == 1.0
    assert _share(force, force[::-1].copy()) < 0.01


def _piece(seed: int, thicker: float = 1.0, shift: float = 0.0, noise: float = 0.005) -> Sweep:
    """A press of a piece whose layers are thicker by a factor, with contact and load zero of its own."""
    design = design_from(
        {
            **{"young_modulus": 0.62e6, "relative_permittivity": 2.8, "sensor_radius": 10e-3, "indenter_radius": 5e-3},
            **{"sensor_thickness": 0.75e-3 * thicker, "padding_thickness": 1.1e-3, "dielectric_thickness": 0.16e-3 * thicker},
        }
    )
    rng = np.random.default_rng(seed)
    rig = Rig(0.1e-3 + shift, 2e-6, rng.normal(0.0, 0.2), 1e-12, force_noise=noise, capacitance_noise=5e-15)
    sweep = synthetic_sweep(ClosedForm(), design, 0.5e-3, rig, rng, specimen=f"{seed}", tie="force", n_points=30)
    return replace(sweep, contact=0.1e-3 + shift)


@pytest.mark.parametrize("shift", [0.0, 0.13e-3])
def test_presses_of_one_piece_are_alike_and_those_of_another_of_the_lot_are_not(shift: float) -> None:
    assert as_one_piece(_piece(1), _piece(2, shift=shift))
    for thicker in (0.97, 0.99, 1.01):
        assert not as_one_piece(_piece(1), _piece(2, thicker, shift))
    assert not as_one_piece(_piece(1, noise=0.2), _piece(2, noise=0.2))  # too coarse to tell


def test_curves_without_noise_are_compared_as_others_are() -> None:
    one, again, other = (_piece(seed, thicker, noise=0.0) for seed, thicker in ((1, 1.0), (1, 1.0), (2, 1.01)))
    assert "force" in repeated_channels(one, again)
    assert not as_one_piece(one, other)
    assert "force" not in repeated_channels(one, other)
