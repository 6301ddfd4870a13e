"""A force without its sign bounces off zero as the ball goes on, and is refused; what comes near zero alone is read."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from turning_press import DIGITS, HEADS, Turning, turning_press

from calib.errors import InputError
from calib.lab import LabTable, Observations, Reading, observe, read_lab_file
from models.sensor import FloatArray

COLUMNS = {
    "all": ("time", "displacement", "force", "capacitance"),
    "no capacitance": ("time", "displacement", "force"),
    "no time": ("displacement", "force"),
    "no displacement": ("time", "force", "capacitance"),
}


def _read(folder: Path, press: Turning, force: FloatArray, layout: str = "all", sign: str = "") -> Observations:
    """Read a press with another force [N] in the place of its own."""
    columns = {**press.columns, "force": force}
    rows = [",".join(f"{columns[q][i]:.{DIGITS[q]}f}" for q in COLUMNS[layout]) for i in range(force.size)]
    path = folder / "press.csv"
    path.write_text("\n".join([",".join(HEADS[q] for q in COLUMNS[layout]), *rows]) + "\n", encoding="utf-8")
    table: LabTable = read_lab_file(path, Reading(sign={"force": sign} if sign else {}))
    return observe(table)


@pytest.mark.parametrize("layout", list(COLUMNS))
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("share", [0.02, 0.1, 0.2, 0.3, 0.45])
def test_a_force_without_its_sign_is_refused(tmp_path: Path, share: float, sense: int, layout: str) -> None:
    press = turning_press()
    force = press.columns["force"]
    with pytest.raises(InputError, match="the force comes to zero at line") as caught:
        _read(tmp_path, press, sense * np.abs(force - share * float(np.max(force))), layout)
    lines = [int(n) for n in re.findall(r"lines? ([\d, ]+)", str(caught.value))[0].split(",")]
    crossing = np.flatnonzero(np.diff(np.sign(force - share * float(np.max(force)))))
    assert all(np.min(np.abs(crossing + 3 - line)) <= 4 for line in lines)


@pytest.mark.parametrize("shape", [{"hold": 30}, {"halves": 400}, {"halves": 40}, {"seed": 5}])
def test_so_it_is_with_a_hold_and_with_many_or_few_rows(tmp_path: Path, shape: dict[str, int]) -> None:
    press = turning_press(**shape)
    force = press.columns["force"]
    with pytest.raises(InputError, match="as one without its sign would"):
        _read(tmp_path, press, np.abs(force - 0.2 * float(np.max(force))))


def test_with_a_minus_out_of_contact_it_is_read_as_advised(tmp_path: Path) -> None:
    press = turning_press()
    force = press.columns["force"] - 0.2 * float(np.max(press.columns["force"]))
    with pytest.raises(InputError) as caught:
        _read(tmp_path, press, np.abs(force))
    first, second = (int(n) - 2 for n in re.findall(r"lines (\d+), (\d+)", str(caught.value))[0])
    row = np.arange(force.size)
    obs = _read(tmp_path, press, np.where((row < first) | (row >= second), -1, 1) * np.abs(force))
    assert obs.force is not None
    assert np.max(np.abs(obs.force - force)) < 0.1


def test_if_its_sign_is_said_it_is_read_and_told(tmp_path: Path) -> None:
    press = turning_press()
    force = np.abs(press.columns["force"] - 0.2 * float(np.max(press.columns["force"])))
    obs = _read(tmp_path, press, force, sign="compression positive")
    assert "as stated" in obs.signs["force"].note
    assert "leaves it at the same pace" in obs.signs["force"].note
    assert obs.force is not None
    assert np.allclose(obs.force, force, atol=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_what_only_comes_near_zero_is_read_without_a_word_of_it(tmp_path: Path, seed: int) -> None:
    press = turning_press(seed)
    force, place = press.columns["force"], press.columns["displacement"]
    back = np.arange(force.size) > np.argmax(place)
    sticks = np.where(back, -0.8 * np.exp(-(((place - 0.06) / 0.03) ** 2)), 0.0)
    leaps = np.where(press.depth > 0, -0.5 * np.exp(-press.depth / 0.1), 0.0)
    scatter = np.random.default_rng(seed).normal(0, 0.002, force.size)
    for other in (
        np.maximum(force, 0.0),  # clipped
        force - np.min(force),  # tared to its smallest
        force + sticks - np.min(force + sticks),  # a ball that sticks, and a zero at its pull
        force + leaps + sticks,
        force + 0.5,
        force + 0.002 * np.arange(force.size),  # a drift
        np.abs(0.003 * np.sin(place) + scatter) + np.where(press.depth > 0, force, 0.0),
    ):
        obs = _read(tmp_path, press, other, "all", "compression positive")
        assert "leaves it at the same pace" not in obs.sign_note


def test_a_ball_that_turns_round_at_zero_load_is_no_bounce(tmp_path: Path) -> None:
    press = turning_press()
    swing: FloatArray = 0.5 + np.abs(((np.arange(200, dtype=np.float64) + 25) % 50) - 25) / 50
    time = 0.05 * np.arange(200, dtype=np.float64)
    columns: dict[str, FloatArray] = {"time": time, "displacement": swing, "force": 4 * swing - 2, "capacitance": swing + 97}
    assert "pace" not in _read(tmp_path, Turning(press.depth, columns), columns["force"], sign="compression positive").sign_note


def _sticky(pull: float, shape: str, snap: bool = False) -> tuple[Turning, FloatArray]:
    """A press of a ball that comes off with a pull [N], sharp or smooth, and snaps into contact with half of it, if at all."""
    press = turning_press(halves=200)
    place = press.columns["displacement"]
    back = np.arange(place.size) > np.argmax(place)
    x = (place - 0.3) / 0.15
    course = (
        np.where((x < 1) & (x > -0.5), pull * (1 - x) / 1.5, 0.0)
        if shape == "sharp"
        else pull * np.exp(-(((x + 0.2) / 0.5) ** 2))
    )
    load = 5.0 * np.clip(place - 0.3, 0, None) ** 1.5
    pulled = np.where(back, course, 0.5 * course * snap)
    return press, load - pulled + np.random.default_rng(4).normal(0, 0.002, place.size)


@pytest.mark.parametrize("layout", ["all", "no time"])
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("shape", ["sharp", "smooth"])
@pytest.mark.parametrize(("pull", "tare"), [(0.2, 0.0), (0.8, 0.0), (4.0, 0.0), (0.8, 0.0016)])
def test_a_pull_without_its_sign_is_refused(
    tmp_path: Path, pull: float, tare: float, shape: str, sense: int, layout: str
) -> None:
    press, force = _sticky(pull, shape)
    with pytest.raises(InputError, match="as a pull without its sign would") as caught:
        _read(tmp_path, press, sense * (np.abs(force) - tare), layout)
    first, last = (int(n) - 2 for n in re.findall(r"lines (\d+) to (\d+)", str(caught.value))[0])
    pulled = np.flatnonzero(force < -0.3 * pull)
    assert first <= pulled[0] <= pulled[-1] <= last
    row = np.arange(force.size)
    repaired = _read(tmp_path, press, np.where((row >= first) & (row <= last), -1, 1) * np.abs(force))
    assert repaired.force is not None
    assert np.nanmax(np.abs(repaired.force - force)) < 0.1
    assert np.count_nonzero(np.isnan(repaired.force)) <= 2
    said = _read(tmp_path, press, sense * np.abs(force), sign="compression positive" if sense > 0 else "compression negative")
    assert "as a pull without its sign" in said.signs["force"].note


def test_so_is_one_before_the_press(tmp_path: Path) -> None:
    press, force = _sticky(0.8, "smooth", snap=True)
    with pytest.raises(InputError, match=r"in lines \d+ to \d+, \d+ to \d+ as the ball goes on"):
        _read(tmp_path, press, np.abs(force))


@pytest.mark.parametrize("shape", ["sharp", "smooth"])
def test_a_pull_with_its_sign_or_clipped_and_humps_of_holds_and_other_presses_are_read(tmp_path: Path, shape: str) -> None:
    press, force = _sticky(0.8, shape)
    place = press.columns["displacement"]
    hold = np.full(40, 0.2)
    longer = np.concatenate([place[place.size // 2 :][place[place.size // 2 :] > 0.2], hold, np.linspace(0.2, 0, 40)])
    longer = np.concatenate([place[: place.size // 2], longer])
    grows = np.where(np.abs(longer - 0.2) < 1e-9, 0.3 * np.sin(np.pi * np.cumsum(np.abs(longer - 0.2) < 1e-9) / 41), 0.0)
    again = np.concatenate([place, 0.4 * np.sin(np.linspace(0, np.pi, 80))])
    for way, load in (
        (place, force),
        (place, np.maximum(force, 0.0)),
        (longer, np.abs(5.0 * np.clip(longer - 0.3, 0, None) ** 1.5 + grows)),
        (again, np.round(5.0 * np.clip(again - 0.3, 0, None) ** 1.5, 2)),
    ):
        other = Turning(way, {"displacement": way, "force": load})
        assert "without its sign" not in _read(tmp_path, other, load, "no time", "compression positive").sign_note
