"""Readings that a counter without a sign wrote below zero, and readings at both ends of a record that stand alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import calib
from calib.lab import LabTable

N = 161
TIME = 0.1 * np.arange(N)
WAY = np.concatenate([np.arange(0.0, 81.0), np.arange(79.0, -1.0, -1.0)])
LOAD = 0.01 * np.clip(WAY - 10.0, 0.0, None) ** 1.5


def read(path: Path, place: list[str], load: list[str], header: str = "Displacement (µm),Force (N)") -> LabTable:
    rows = [f"{t:.1f},{x},{f}" for t, x, f in zip(TIME, place, load, strict=True)]
    file = path / "counter.csv"
    file.write_text("\n".join([f"Time (s),{header}", *rows]) + "\n", encoding="utf-8")
    return calib.read_lab_file(file)


def wrapped(numbers: np.ndarray, bits: int, decimals: int = 0) -> list[str]:
    counts = np.rint(numbers * 10**decimals).astype(int)
    return [f"{(c % 2**bits) / 10**decimals:.{decimals}f}" for c in counts.tolist()]


@pytest.mark.parametrize("bits", [8, 16, 24, 32])
@pytest.mark.parametrize("below", [{0: -4}, {N - 1: -5}, {0: -4, N - 1: -5}, {0: -1, 1: -3, 2: -2, 3: -1, 4: -2}, {3: -1}])
@pytest.mark.parametrize("seconds", [True, False])
def test_a_place_that_a_counter_without_a_sign_wrote_below_zero_is_left_out(
    tmp_path: Path, bits: int, below: dict[int, int], *, seconds: bool
) -> None:
    place = WAY + 2.0 if seconds else WAY.copy()
    place[list(below)] = list(below.values())
    table = read(tmp_path, wrapped(place, bits), [f"{f:.4f}" for f in LOAD])
    left_out = np.flatnonzero(np.isnan(table.columns["displacement"])).tolist()
    assert left_out == sorted(below)
    factor = "is off by a factor of 1"
    assert all(f"counter of {bits} bits" in table.reasons[r] or factor in table.reasons[r] for r in left_out)
    assert np.nanmax(table.columns["displacement"]) < 1e-4


def test_a_load_in_decimals_that_a_counter_wrote_below_zero_is_left_out(tmp_path: Path) -> None:
    load = LOAD.copy()
    load[[2, 5, N - 3]] = -0.003, -0.001, -0.002
    table = read(tmp_path, [f"{x:.0f}" for x in WAY], wrapped(load, 16, 3))
    assert np.flatnonzero(np.isnan(table.columns["force"])).tolist() == [2, 5, N - 3]
    assert '"65.533" is -0.003' in table.reasons[2]


def test_a_column_of_which_many_readings_are_below_zero_is_refused(tmp_path: Path) -> None:
    load = np.where(WAY > 40, 0.01 * np.clip(WAY - 40.0, 0.0, None) ** 1.5, -0.002 * (np.arange(N) % 2))
    with pytest.raises(calib.InputError, match="16 bits without a sign that went below zero, as in 39 rows"):
        read(tmp_path, [f"{x:.0f}" for x in WAY], wrapped(load, 16, 3))


@pytest.mark.parametrize("first", [12.5, -40.0, 6500.0])
def test_readings_at_both_ends_far_beyond_all_others_are_left_out(tmp_path: Path, first: float) -> None:
    place = [f"{first:.3f}", *(f"{x / 1000:.3f}" for x in WAY[1:-1]), f"{first * 1.01:.3f}"]
    table = read(tmp_path, place, [f"{f:.4f}" for f in LOAD], "Displacement (mm),Force (N)")
    assert np.flatnonzero(np.isnan(table.columns["displacement"])).tolist() == [0, N - 1]
    assert all("stands alone" in table.reasons[r] for r in (0, N - 1))


@pytest.mark.parametrize("largest", [250, 255, 120])
def test_whole_numbers_of_a_press_that_come_near_a_power_of_two_are_readings(tmp_path: Path, largest: int) -> None:
    place = WAY * largest / WAY.max()
    table = read(tmp_path, [f"{x:.0f}" for x in place], [f"{f:.4f}" for f in LOAD])
    assert not np.any(np.isnan(table.columns["displacement"]))


@pytest.mark.filterwarnings("error")
def test_a_cell_of_hundreds_of_decimals_is_read_as_any_other(tmp_path: Path) -> None:
    load = [f"{f:.4f}" for f in LOAD]
    load[80] = f"{LOAD[80]:.4f}" + "0" * 400
    table = read(tmp_path, [f"{x:.0f}" for x in WAY], load)
    assert table.columns["force"][80] == pytest.approx(LOAD[80], abs=1e-4)
