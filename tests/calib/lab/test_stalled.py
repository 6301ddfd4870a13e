"""What is told of readings that stand still while others go on, and of those that are one number at the beginning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from turning_press import observed, turning_press

from calib.lab import read_lab_file

PRESS = turning_press()


@pytest.mark.parametrize(("first", "last"), [(60, 65), (40, 59), (80, 98), (90, 99), (30, 36)])
@pytest.mark.parametrize("but", ["", "capacitance"])
def test_a_displacement_that_is_frozen_while_the_load_rises_is_left_out(
    tmp_path: Path, first: int, last: int, but: str
) -> None:
    place = PRESS.columns["displacement"].copy()
    place[first : last + 1] = place[first]
    obs = observed(tmp_path, PRESS.columns | {"displacement": place}, but)
    assert all("displacement stands still" in obs.reason[r] for r in range(first + 1, last + 1))
    assert not any("stands still" in obs.reason[r] for r in (*range(first), *range(last + 2, 200)))
    assert obs.used[first - 1]
    assert last > 95 or obs.used[last + 2]


@pytest.mark.parametrize("top", [0.70, 0.80])
def test_a_displacement_at_the_end_of_its_range_is_no_hold(tmp_path: Path, top: float) -> None:
    place = np.minimum(PRESS.columns["displacement"], top)
    obs = observed(tmp_path, PRESS.columns | {"displacement": place}, "capacitance")
    assert all("end of its range" in obs.reason[r] for r in np.flatnonzero(place == top))


@pytest.mark.parametrize("hold", [5, 12, 40])
@pytest.mark.parametrize("but", ["", "capacitance"])
def test_a_hold_in_which_the_load_relaxes_stays_one(tmp_path: Path, hold: int, but: str) -> None:
    obs = observed(tmp_path, turning_press(hold=hold).columns, but)
    assert not any("stands still in" in r for r in obs.reason)
    assert not any("stands in lines" in note for note in obs.table.notes)


@pytest.mark.parametrize("lag", [1.0, 2.0])
def test_a_load_that_lags_into_a_hold_freezes_no_displacement(tmp_path: Path, lag: float) -> None:
    press = turning_press(hold=30)
    force = press.columns["force"].copy()
    for i in range(1, force.size):
        force[i] = force[i - 1] + (press.columns["force"][i] - force[i - 1]) / (1 + lag)
    obs = observed(tmp_path, press.columns | {"force": force}, "capacitance")
    assert not any("stands still in" in r for r in obs.reason)


@pytest.mark.parametrize("n", [25, 41, 60])
@pytest.mark.parametrize("level", [0.0, 0.0345])
def test_a_load_that_begins_with_a_jump_after_one_number_was_none_before(tmp_path: Path, n: int, level: float) -> None:
    force = PRESS.columns["force"].copy()
    force[:n] = level
    obs = observed(tmp_path, PRESS.columns | {"force": force}, "capacitance")
    assert all("begins with a jump" in r for r in obs.reason[:n])
    assert any("these rows are left out" in note for note in obs.table.notes)
    assert np.all(obs.used[n:95])


@pytest.mark.parametrize("dead", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_load_that_is_clipped_at_zero_and_rises_without_a_jump_is_read(tmp_path: Path, dead: float, noise: float) -> None:
    force = np.clip(5.0 * PRESS.depth**1.5 + noise * (PRESS.columns["force"] - 5.0 * PRESS.depth**1.5) - dead, 0, None)
    force[PRESS.depth == 0] = 0.0
    obs = observed(tmp_path, PRESS.columns | {"force": force}, "capacitance")
    assert np.all(obs.used[:95])


def test_a_load_that_rises_at_once_where_rows_were_not_written_is_read(tmp_path: Path) -> None:
    kept = np.r_[0:9, 26:200]
    force = np.where(np.arange(200) < 9, 0.0, PRESS.columns["force"])
    columns = {q: v[kept] for q, v in (PRESS.columns | {"force": force}).items()}
    obs = observed(tmp_path, columns, "capacitance")
    assert not any("begins with a jump" in r for r in obs.reason)


@pytest.mark.parametrize("quantity", ["displacement", "force", "capacitance"])
@pytest.mark.parametrize("n", [22, 30, 45])
def test_cells_that_were_filled_with_the_next_reading_from_the_beginning_are_left_out(
    tmp_path: Path, quantity: str, n: int
) -> None:
    y = PRESS.columns[quantity].copy()
    y[:n] = y[n]
    obs = observed(tmp_path, PRESS.columns | {quantity: y})
    assert all("at the beginning of the record" in r for r in obs.reason[: n + 1])
    assert any("these rows are left out" in note for note in obs.table.notes)
    assert np.all(obs.used[n + 1 : 95])


@pytest.mark.parametrize("quantity", ["displacement", "force", "capacitance"])
@pytest.mark.parametrize("n", [9, 20, 40])
def test_cells_that_were_filled_with_the_last_reading_to_the_end_are_left_out(tmp_path: Path, quantity: str, n: int) -> None:
    columns = {q: v[:100].copy() for q, v in PRESS.columns.items()}
    columns[quantity][-n:] = columns[quantity][-n]
    obs = observed(tmp_path, columns)
    assert all("at an end of the record" in r for r in obs.reason[-n:])
    assert np.all(obs.used[12 : 100 - n])


@pytest.mark.parametrize("digits", [0.1, 0.02, 0.3])
@pytest.mark.parametrize("quantity", ["force", "capacitance"])
def test_a_channel_that_is_flat_by_its_resolution_stays(tmp_path: Path, quantity: str, digits: float) -> None:
    coarse = np.round(PRESS.columns[quantity] / digits) * digits
    obs = observed(tmp_path, PRESS.columns | {quantity: coarse})
    assert not any("of the record, while" in r for r in obs.reason)


@pytest.mark.parametrize("quantity", ["force", "capacitance"])
def test_a_channel_that_is_flat_out_of_contact_stays(tmp_path: Path, quantity: str) -> None:
    away = PRESS.depth == 0
    flat = np.where(away, 0.004 if quantity == "force" else 97.0, PRESS.columns[quantity])
    obs = observed(tmp_path, PRESS.columns | {quantity: flat})
    assert not any("of the record, while" in r for r in obs.reason)


@pytest.mark.parametrize("n", [20, 60])
def test_a_rest_under_load_before_the_press_freezes_nothing(tmp_path: Path, n: int) -> None:
    columns = {q: np.r_[v[20] + (v[5] - v[20]) * np.linspace(0, -0.1, n), v[20:]] for q, v in PRESS.columns.items()}
    columns["time"] = 0.05 * np.arange(columns["time"].size)
    columns["displacement"][:n] = PRESS.columns["displacement"][20]
    obs = observed(tmp_path, columns)
    assert not any("of the record, while" in r for r in obs.reason)


@pytest.mark.parametrize("digits", [1.0, 0.5])
def test_a_level_of_a_coarse_display_and_a_jump_from_it_are_not_filled_cells(tmp_path: Path, digits: float) -> None:
    coarse = np.where(np.arange(200) < 40, 97.0, 97.0 + digits) + np.where(np.arange(200) < 60, 0.0, digits)
    obs = observed(tmp_path, {q: v[:100] for q, v in (PRESS.columns | {"capacitance": coarse}).items()})
    assert not any("of the record, while" in r for r in obs.reason)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_load_that_reaches_the_end_of_its_range_while_the_ball_goes_on_holds_no_peak(tmp_path: Path, share: float) -> None:
    place = np.linspace(0.0, 0.8e-3, 90)
    load = np.minimum(5.0 * (place / 0.8e-3) ** 1.5, share * 5.0)
    rows = "".join(f"{0.1 * i:.1f},{x * 1e3:.4f},{f:.4f}\n" for i, (x, f) in enumerate(zip(place, load, strict=True)))
    path = tmp_path / "press.csv"
    path.write_text(f"Time (s),Displacement (mm),Force (N)\n{rows}")
    assert any("the end of its range" in note for note in read_lab_file(path).notes)


def test_a_load_that_stands_to_the_end_while_the_ball_goes_back_was_not_measured_there(tmp_path: Path) -> None:
    place = np.concatenate([np.linspace(0.0, 0.8, 60), np.linspace(0.79, 0.0, 60)])
    load = 5.0 * np.clip(place - 0.15, 0.0, None) ** 1.5 + np.random.default_rng(2).normal(0.0, 3e-3, 120)
    load[40:] = load[40]
    rows = "".join(f"{0.1 * i:.1f},{x:.4f},{f:.4f}\n" for i, (x, f) in enumerate(zip(place, load, strict=True)))
    path = tmp_path / "press.csv"
    path.write_text(f"Time (s),Displacement (mm),Force (N)\n{rows}")
    table = read_lab_file(path)
    assert [r for r, why in enumerate(table.reasons) if why] == list(range(41, 120))
    assert any("not measured there" in note for note in table.notes)
    assert not any("the end of its range" in note for note in table.notes)


@pytest.mark.parametrize("quantity", ["force", "capacitance"])
@pytest.mark.parametrize(("before", "behind"), [(6, 4), (8, 5), (5, 3)])
def test_a_channel_that_is_frozen_over_the_turn_and_then_is_farther_on_is_left_out(
    tmp_path: Path, quantity: str, before: int, behind: int
) -> None:
    values = PRESS.columns[quantity].copy()
    turn = int(np.argmax(PRESS.columns["displacement"]))
    values[turn - before : turn + behind + 1] = values[turn - before]
    obs = observed(tmp_path, PRESS.columns | {quantity: values})
    assert all(f"{quantity} stands still" in obs.reason[r] for r in range(turn - before + 1, turn + behind + 1))
    assert not any("stands still" in obs.reason[r] for r in (*range(turn - before), *range(turn + behind + 2, 200)))
