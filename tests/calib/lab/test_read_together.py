"""Rows in which force and capacitance are both wrong while the ball goes on are left out, or the file is refused."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file
from models.sensor import FloatArray

N = 600
FIRST, BEHIND = 150, 180


def _press(seed: int, hold: int = 0) -> dict[str, FloatArray]:
    """A press with noise: s, mm, N, pF."""
    rng = np.random.default_rng(seed)
    half = np.linspace(0, 1.15, N // 2)
    d = np.concatenate([half, np.full(hold, half[-1]), half[::-1]])
    f = 5.0 * np.clip(d - 0.1, 0, None) ** 1.8
    noise = rng.normal(size=(3, d.size))
    c = 97 + 0.4 * f + 0.004 * noise[2]
    return {"t": 0.125 * np.arange(d.size), "d": d + 2e-4 * noise[0], "f": f + 0.004 * noise[1], "c": c}


def _read(folder: Path, press: Mapping[str, FloatArray]) -> LabTable:
    path = folder / "press.csv"
    decimals = {"t": 3, "d": 4, "f": 4, "c": 3}
    rows = zip(*([f"{v:.{decimals[q]}f}" for v in press[q]] for q in decimals), strict=True)
    text = "\n".join(["Time (s),Displacement (mm),Force (N),Cp (pF)", *map(",".join, rows)])
    path.write_text(text + "\n", encoding="utf-8")
    return read_lab_file(path)


BLOCKS: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "zeros": lambda y: 0 * y[FIRST:BEHIND],
    "a mark": lambda y: 0 * y[FIRST:BEHIND] + 999.0,
    "at rest": lambda y: y[: BEHIND - FIRST],
    "of before": lambda y: y[FIRST - 60 : BEHIND - 60],
    "as if read at once": lambda y: 0 * y[FIRST:BEHIND] + y[FIRST - 60],
}


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_block_in_which_both_are_elsewhere_is_left_out_as_contradicting_the_displacement(
    tmp_path: Path, block: str, seed: int
) -> None:
    press = _press(seed)
    for q in "fc":
        press[q][FIRST:BEHIND] = BLOCKS[block](press[q].copy())
    table = _read(tmp_path, press)
    assert [r for r, why in enumerate(table.reasons) if why] == list(range(FIRST, BEHIND))
    assert table.reasons[FIRST].startswith("force, as capacitance does, contradicts displacement in lines 152 to 181")
    assert not table.zeroed


@pytest.mark.parametrize("length", [8, 20, 40])
def test_both_that_stand_still_while_the_ball_goes_on_and_catch_up_are_left_out(tmp_path: Path, length: int) -> None:
    press = _press(3)
    for q in "fc":
        press[q][FIRST : FIRST + length] = press[q][FIRST - 1]
    table = _read(tmp_path, press)
    left = [r for r, why in enumerate(table.reasons) if why]
    assert set(range(FIRST, FIRST + length)) <= set(left) <= set(range(FIRST - 1, FIRST + length))
    assert "stands still in lines" in table.reasons[FIRST]
    assert "while only the ball goes on" in table.reasons[FIRST]


def test_both_that_go_on_late_from_where_they_stood_are_refused(tmp_path: Path) -> None:
    press = _press(4)
    for q in "fc":
        press[q][FIRST + 30 :] = press[q][FIRST:-30].copy()
        press[q][FIRST : FIRST + 30] = press[q][FIRST]
    with pytest.raises(InputError) as refused:
        _read(tmp_path, press)
    assert "they may be late by as many rows" in refused.value.faults[0].message


def test_both_that_were_put_upside_down_together_are_refused_with_both_names_and_the_lines(tmp_path: Path) -> None:
    press = _press(5)
    for q in "fc":
        press[q][FIRST : FIRST + 60] = press[q][FIRST : FIRST + 60][::-1].copy()
    with pytest.raises(InputError) as refused:
        _read(tmp_path, press)
    fault = refused.value.faults[0]
    assert fault.line == FIRST + 2
    assert 'columns "Force (N)" and "Cp (pF)": the cells of lines 152 to 211 seem to stand in reversed order' in fault.message


@pytest.mark.parametrize("seed", [6, 7, 8])
def test_a_hold_a_slip_and_a_pull_off_that_both_show_keep_all_their_rows(tmp_path: Path, seed: int) -> None:
    press = _press(seed, hold=60)
    n = press["d"].size
    behind = np.clip(np.arange(n) - N // 2, 0, 60)
    relaxed = 1 - 0.15 * (1 - np.exp(-behind / 12))
    slip = np.where(np.arange(n) < 200, 0.0, np.exp(-(np.arange(n) - 200) / 25.0))
    down = -0.6 * slip * (np.arange(n) >= 200)
    stuck = np.where((np.arange(n) > n - 27) & (np.arange(n) < n - 15), -0.4, 0.0)
    press["f"] = press["f"] * relaxed + down + stuck
    press["c"] = 97 + (press["c"] - 97) * relaxed + 0.4 * down + 0.4 * stuck
    assert not any(_read(tmp_path, press).reasons)
