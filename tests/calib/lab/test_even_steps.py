"""Readings that lie on a straight line to the last digit in a channel that scatters are left out, and no others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from turning_press import observed, turning_press

from models.sensor import FloatArray

PRESS = turning_press()


def _filled(quantity: str, first: int, last: int) -> dict[str, FloatArray]:
    values = PRESS.columns[quantity].copy()
    values[first : last + 1] = np.linspace(values[first], values[last], last + 1 - first)
    return PRESS.columns | {quantity: values}


@pytest.mark.parametrize("quantity", ["force", "capacitance"])
@pytest.mark.parametrize(("first", "last"), [(40, 60), (60, 95), (120, 150)])
def test_a_series_that_a_spreadsheet_filled_in_is_left_out_with_the_reason(
    tmp_path: Path, quantity: str, first: int, last: int
) -> None:
    obs = observed(tmp_path, _filled(quantity, first, last))
    told = [r for r, why in enumerate(obs.reason) if "in even steps of" in why]
    assert set(range(first + 2, last - 1)) <= set(told) <= set(range(first, last + 1))
    assert all(quantity in obs.reason[r] for r in told)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("hold", [0, 30])
def test_a_press_has_no_such_rows(tmp_path: Path, seed: int, hold: int) -> None:
    obs = observed(tmp_path, turning_press(seed, hold, halves=400).columns)
    assert not any("even steps" in why for why in obs.reason)


@pytest.mark.parametrize("count", [0.005, 0.02, 0.05])
def test_counts_of_a_converter_that_go_up_one_by_one_are_none(tmp_path: Path, count: float) -> None:
    rng = np.random.default_rng(3)
    force = np.round((PRESS.columns["force"] + rng.normal(0, 0.2 * count, 200)) / count) * count
    obs = observed(tmp_path, PRESS.columns | {"force": force}, "capacitance")
    assert not any("even steps" in why for why in obs.reason)


def test_of_a_channel_without_noise_nothing_tells_them(tmp_path: Path) -> None:
    depth = np.clip(np.concatenate([np.linspace(0, 1, 150), np.linspace(1, 0, 150)]) - 0.1, 0, None)
    force: FloatArray = np.asarray(np.round(4 * depth, 4), dtype=float)
    time: FloatArray = 0.1 * np.arange(300.0)
    obs = observed(tmp_path, {"time": time, "displacement": depth + 0.1, "force": force})
    assert not any("even steps" in why for why in obs.reason)
