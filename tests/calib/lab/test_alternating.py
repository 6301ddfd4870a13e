"""What is told of columns that hold two channels or more in turn, and of sound ones that only look so."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from turning_press import observed, turning_press

from calib.errors import InputError
from calib.lab import Reading, read_lab_file
from models.sensor import FloatArray

PRESS = turning_press()
ROWS = np.arange(200)


@pytest.mark.parametrize("factor", [1.05, 0.9, 1.3])
def test_two_load_cells_in_turn_are_refused(tmp_path: Path, factor: float) -> None:
    force = np.where(ROWS % 2, factor, 1.0) * PRESS.columns["force"]
    with pytest.raises(InputError, match=r'"Force .N." goes to and fro between two levels') as caught:
        observed(tmp_path, PRESS.columns | {"force": force}, "capacitance")
    assert "column or a file of its own" in caught.value.faults[0].advice


@pytest.mark.parametrize("levels", [(0.0, 0.05), (0.3, 0.0), (0.0, 0.2, 0.5), (0.0, 0.2, 0.1, 0.5)])
@pytest.mark.parametrize("alone", [False, True])
def test_frequencies_in_turn_are_refused(tmp_path: Path, levels: tuple[float, ...], alone: bool) -> None:
    capacitance = PRESS.columns["capacitance"] + np.array(levels)[ROWS % len(levels)]
    columns = {"time": PRESS.columns["time"]} if alone else PRESS.columns
    with pytest.raises(InputError, match=r"goes to and fro between (two|three|four) levels"):
        observed(tmp_path, columns | {"capacitance": capacitance})


def test_rows_of_two_specimens_sorted_by_displacement_are_refused(tmp_path: Path) -> None:
    place, force = PRESS.columns["displacement"][:100], PRESS.columns["force"][:100]
    columns = {
        "time": PRESS.columns["time"],
        "displacement": np.repeat(place, 2),
        "force": np.stack([force, 0.8 * force], axis=1).ravel(),
    }
    with pytest.raises(InputError, match="goes to and fro"):
        observed(tmp_path, columns)


def test_readings_that_the_user_says_are_right_are_read(tmp_path: Path) -> None:
    force = np.where(ROWS % 2, 1.3, 1.0) * PRESS.columns["force"]
    with pytest.raises(InputError, match="say it once more: --units force="):
        observed(tmp_path, PRESS.columns | {"force": force})
    assert read_lab_file(tmp_path / "press.csv", Reading(units={"force": "N"})).columns["force"].size == 200


def _said(folder: Path, columns: Mapping[str, FloatArray]) -> str:
    """The refusal of a file without capacitance, "" if it is read."""
    try:
        observed(folder, columns, "capacitance")
    except InputError as error:
        return str(error)
    return ""


def _noisy(sd: float) -> FloatArray:
    return PRESS.columns["force"] + np.random.default_rng(3).normal(0, sd, 200)


@pytest.mark.parametrize(
    "force",
    [
        _noisy(0.05),
        _noisy(0.3),
        np.repeat(PRESS.columns["force"][::2], 2),
        np.repeat(PRESS.columns["force"][::4], 4),
        PRESS.columns["force"] + 0.01 * (-1.0) ** ROWS,
        np.round(PRESS.columns["force"], 1),
    ],
    ids=["noise", "much noise", "a slower cell", "a much slower cell", "a hum of few mN", "few digits"],
)
def test_noise_and_slower_channels_are_not_channels_in_turn(tmp_path: Path, force: FloatArray) -> None:
    assert "to and fro" not in _said(tmp_path, PRESS.columns | {"force": force})


def test_a_ball_that_goes_by_uneven_steps_is_read(tmp_path: Path) -> None:
    place = PRESS.columns["displacement"] + 0.003 * (ROWS % 2)
    force = 5.0 * np.clip(place - 0.08, 0, None) ** 1.5
    assert np.any(observed(tmp_path, PRESS.columns | {"displacement": place, "force": force}, "capacitance").used)


def test_peaks_and_valleys_of_cycles_are_not_channels_in_turn(tmp_path: Path) -> None:
    place = PRESS.columns["displacement"] - 0.05 * (ROWS % 2)
    force = 5.0 * np.clip(place - 0.08, 0, None) ** 1.5
    assert "to and fro" not in _said(tmp_path, PRESS.columns | {"displacement": place, "force": force})
