"""What is told of sound presses of uneven steps, and of resets, blocks and outliers in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from uneven_presses import DRIVES, Uneven, uneven

from calib.lab import Observations, observe, read_lab_file
from calib.lab.instruments.doubts import doubtful
from calib.lab.instruments.offset_blocks import offset_blocks

SEEDS = range(600, 606)
_ALLOWED = ("unloading branch", "loading branch", "hold", "before the first")


def _observed(folder: Path, press: Uneven) -> Observations:
    path = folder / "press.csv"
    path.write_text(press.text, encoding="utf-8")
    return observe(read_lab_file(path))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("drive", [d for d in DRIVES if d != "events"])
def test_nothing_is_told_of_a_sound_press_however_uneven_its_steps(tmp_path: Path, drive: str, seed: int) -> None:
    obs = _observed(tmp_path, uneven(drive, seed))
    assert [r for r in obs.reason if r and not r.startswith(_ALLOWED)] == []
    assert not any("jump" in note for note in obs.table.notes)
    assert not obs.table.zeroed
    assert np.any(obs.used)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("drive", ["smooth", "fast", "jerky", "load only"])
def test_a_load_that_is_set_to_zero_is_found_among_uneven_steps(tmp_path: Path, drive: str, seed: int) -> None:
    press = uneven(drive, seed, "reset")
    (row,) = press.wrong
    obs = _observed(tmp_path, press)
    assert obs.table.zeroed == {"force": (row,)}
    assert not (np.any(obs.used[:row]) and np.any(obs.used[row:]))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("drive", ["smooth", "crank", "jerky", "load only"])
def test_only_the_rows_of_a_block_with_an_offset_are_left_out(tmp_path: Path, drive: str, seed: int) -> None:
    press = uneven(drive, seed, "block")
    obs = _observed(tmp_path, press)
    odd = {i for i, r in enumerate(obs.reason) if r and not r.startswith(_ALLOWED)}
    assert odd == set(press.wrong)
    assert all("comes back, as by an offset" in obs.reason[i] or " contradicts " in obs.reason[i] for i in odd)
    assert not obs.table.zeroed


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("drive", ["smooth", "crank", "load only"])
def test_an_outlier_is_left_out_of_an_uneven_press(tmp_path: Path, drive: str, seed: int) -> None:
    press = uneven(drive, seed, "outlier")
    obs = _observed(tmp_path, press)
    assert not np.any(obs.used[list(press.wrong)])
    assert "stands alone" in obs.reason[press.wrong[0]]


def test_a_step_on_both_sides_of_a_turn_is_no_block() -> None:
    place = np.concatenate([np.linspace(0, 1, 60), np.linspace(1, 0, 60)])
    force = 5 * np.clip(place - 0.1, 0, None) ** 1.5 - np.where(place > 0.8, 0.6, 0.0)
    assert offset_blocks({"force": force, "displacement": place}) == {}


@pytest.mark.parametrize("beside", [["0.00", "0.01", "0.00", "0.00"], ["0.02", "0.01", "0.00", "0.00"]])
def test_one_last_digit_is_no_factor_of_ten(beside: list[str]) -> None:
    cells = [*beside, *(f"{0.12 + 0.03 * i:.2f}" for i in range(60))]
    assert doubtful(cells, np.array(cells, dtype=float), ".").rows == {}


def test_a_mark_moved_near_zero_is_told_all_the_same() -> None:
    cells = [f"{0.12 + 0.003 * i:.3f}" for i in range(60)]
    cells[5] = "0.014"
    assert set(doubtful(cells, np.array(cells, dtype=float), ".").rows) == {5}
