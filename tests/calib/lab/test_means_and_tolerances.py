"""Names that say of how many readings a value is, how far it may be off, or with which ball: read where they are clear."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file

N = 100
TIME = 0.1 * np.arange(N)
PLACE = np.round(np.concatenate([np.linspace(0.0, 1.0, N // 2), np.linspace(0.98, 0.0, N // 2)]), 4)
LOAD = np.round(4 * np.clip(PLACE - 0.15, 0.0, None) ** 1.5, 4)
OTHER = np.round(0.9 * LOAD + 0.03 * np.sin(TIME), 4)


def read(tmp_path: Path, names: Sequence[str], *columns: np.ndarray) -> LabTable:
    path = tmp_path / "lab.csv"
    rows = [";".join(f"{v:.4f}" for v in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([";".join(names), *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path)


def press(tmp_path: Path, force: str, *more: str, place: str = "Displacement (mm)") -> LabTable:
    others = [OTHER * (1 + 0.1 * k) for k in range(len(more))]
    return read(tmp_path, ["Time (s)", place, force, *more], TIME, PLACE, LOAD, *others)


def assert_read(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=1e-12)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * PLACE, atol=1e-12)


@pytest.mark.parametrize(
    "name",
    [
        *("Mean force (N)", "Avg. Force (N)", "Force avg (N)", "Kraft Mittelwert [N]", "Average Load (N)", "Force (N, mean)"),
        *("Force (N, avg of 10)", "Force (N, mean of 5)", "Force (mean of 8) (N)"),
    ],
)
def test_a_mean_is_the_reading_where_no_other_column_is_the_force(tmp_path: Path, name: str) -> None:
    table = press(tmp_path, name)
    assert_read(table)
    assert any("holds a mean of readings in each row" in note for note in table.notes)


@pytest.mark.parametrize("others", [("Force std (N)", "Force max (N)"), ("Force std (N)",), ("Force min (N)", "Force max (N)")])
def test_a_mean_is_the_reading_beside_what_else_was_drawn_from_the_same(tmp_path: Path, others: tuple[str, ...]) -> None:
    table = press(tmp_path, "Force mean (N)", *others)
    assert_read(table)
    assert sum("is a statistic" in u.reason for u in table.unread) == len(others)


def test_means_of_several_quantities_are_read_beside_a_deviation_of_one(tmp_path: Path) -> None:
    table = press(tmp_path, "Force mean (N)", "Force std (N)", "Force max (N)", place="Disp mean (mm)")
    assert_read(table)
    assert sum("holds a mean of readings" in note for note in table.notes) == 2


@pytest.mark.parametrize("name", ["Force max (N)", "Peak force (N)", "Force min (N)", "Force setpoint (N)", "Force std (N)"])
def test_another_statistic_or_what_was_commanded_is_no_force(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        press(tmp_path, name)


def test_two_means_are_no_force_and_one_beside_a_force_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no force column"):
        press(tmp_path, "Mean force left (N)", "Mean force (N)", "Mean load (N)")
    assert_read(press(tmp_path, "Force (N)", "Mean force (N)"))


def test_means_without_a_time_are_results(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read(tmp_path, ["Displacement (mm)", "Mean force (N)"], PLACE, LOAD)


@pytest.mark.parametrize(
    ("place", "force"),
    [
        ("Displacement (mm ±0.002)", "Force (N ±0.5%)"),
        ("Displacement (mm)", "Force (N) ± 0.01"),
        ("Displacement [mm ± 2 µm]", "Force ±0.01 (N)"),
        ("Displacement (mm +/- 0.002)", "Force (N) +/-0.5 %"),
    ],
)
def test_how_far_readings_may_be_off_changes_nothing_of_them(tmp_path: Path, place: str, force: str) -> None:
    assert_read(press(tmp_path, force, place=place))


@pytest.mark.parametrize("force", ["Force (N) x10 ± 0.1", "Force ± (N) x10", "Force (±10 mN)"])
def test_a_factor_beside_it_is_still_asked_about(tmp_path: Path, force: str) -> None:
    with pytest.raises(InputError):
        press(tmp_path, force)


@pytest.mark.parametrize(
    "force",
    ["Force (N) [4 mm ball]", "Force 6mm ball (N)", "Kraft (Kugel 6 mm) [N]", "Force (N) (Ø6 mm sphere)", "Force [N] (n=10)"],
)
def test_the_ball_and_how_many_readings_there_were_are_passed_by(tmp_path: Path, force: str) -> None:
    table = press(tmp_path, force)
    assert_read(table)
    assert any("in its name is passed by" in note for note in table.notes)


def test_forces_of_two_balls_are_a_choice(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        press(tmp_path, "Force 4mm ball (N)", "Force 6mm ball (N)")


def test_a_change_of_length_is_the_displacement_where_no_other_column_is_in_such_a_unit(tmp_path: Path) -> None:
    table = read(tmp_path, ["Prüfzeit [s]", "dL [mm]", "F [N]"], TIME, PLACE, LOAD)
    assert_read(table)
    assert any("the only column in mm" in note for note in table.notes)
    with pytest.raises(InputError):
        read(tmp_path, ["Prüfzeit [s]", "dL [mm]", "dW [mm]", "F [N]"], TIME, PLACE, OTHER, LOAD)
    with pytest.raises(InputError):
        read(tmp_path, ["Prüfzeit [s]", "dC [pF]", "F [N]"], TIME, PLACE, LOAD)
