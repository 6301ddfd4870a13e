"""A ball that sticks for a few rows and lets go is read with a note; spikes, offsets and lone readings stay left out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.sticking import sticking
from models.sensor import FloatArray


def _press(rows: int, pull: float, width: float, *, touch: float = 0.3, hold: int = 0) -> dict[str, FloatArray]:
    """A press of 1 N to 1 mm and back, on which the ball sticks by `pull` [N] over about a `width` [mm] and lets go."""
    up = rows // 2
    depth = np.concatenate([np.linspace(0, 1, up), np.full(hold, 1.0), np.linspace(1, 0, rows - up - hold + 1)[1:]])
    way = depth - touch
    sticks = (np.arange(rows) >= up + hold) & (way > -width)
    force = np.maximum(way / (1 - touch), 0.0) ** 1.5 - np.where(sticks, pull * np.exp(-((way / width) ** 2)), 0.0)
    noise = 0.001 * np.random.default_rng(rows).normal(size=rows)
    return {"displacement": depth, "force": force + noise}


def _read(folder: Path, values: dict[str, FloatArray], signs: Sequence[int], decimals: int = 4) -> LabTable:
    x, f = signs[0] * values["displacement"] + 5, signs[1] * values["force"] + 0.2
    rows = "".join(f"{0.1 * i:.1f},{a:.4f},{b:.{decimals}f}\n" for i, (a, b) in enumerate(zip(x, f, strict=True)))
    path = folder / "press.csv"
    path.write_text("Time (s),Extension (mm),Load (N)\n" + rows, encoding="utf-8")
    return read_lab_file(path, Reading())


def _left_out(table: LabTable) -> list[int]:
    return [row for row, why in enumerate(table.reasons) if why]


@pytest.mark.parametrize("signs", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
@pytest.mark.parametrize(
    ("rows", "pull", "width", "hold"),
    [
        (60, 4.0, 0.06, 12),
        (40, 4.0, 0.06, 0),
        (80, 1.5, 0.04, 12),
        (60, 0.5, 0.05, 0),
        (60, 1.5, 0.08, 12),
    ],
)
def test_a_pull_off_over_a_few_rows_is_read_with_a_note(
    tmp_path: Path, rows: int, pull: float, width: float, hold: int, signs: tuple[int, int]
) -> None:
    values = _press(rows, pull, width, hold=hold)
    table = _read(tmp_path, values, signs)
    assert _left_out(table) == []
    assert np.all(np.isfinite(table.columns["force"]))
    assert sum("read as a ball that sticks" in note for note in table.notes) == 1


@pytest.mark.parametrize(("rows", "pull", "width", "hold"), [(400, 1.5, 0.1, 0), (240, 4.0, 0.02, 12)])
def test_a_load_that_pulls_over_more_rows_needs_no_note(
    tmp_path: Path, rows: int, pull: float, width: float, hold: int
) -> None:
    table = _read(tmp_path, _press(rows, pull, width, hold=hold), (1, 1))
    assert _left_out(table) == []
    assert not any("sticks" in note for note in table.notes)


@pytest.mark.parametrize("rows", [60, 160])
@pytest.mark.parametrize(
    "spike", [(-3.0,), (-3.0, -3.0), (-3.0, -3.0, -3.0), (-3.0, -1.0), (-0.3, -3.0), (1.0, 3.0), (-1.0, 2.0)], ids=str
)
def test_spikes_beside_the_touch_on_the_way_back_are_left_out(tmp_path: Path, rows: int, spike: tuple[float, ...]) -> None:
    values = _press(rows, 0.0, 0.05)
    row = rows - round(0.3 * rows / 2) - 2
    values["force"][row : row + len(spike)] = spike
    assert _left_out(_read(tmp_path, values, (1, 1))) == [*range(row, row + len(spike))]


@pytest.mark.parametrize(("rows", "pull", "width"), [(40, 4.0, 0.03), (24, 3.0, 0.02)])
def test_a_pull_of_a_single_row_may_be_a_spike_and_is_left_out(tmp_path: Path, rows: int, pull: float, width: float) -> None:
    values = _press(rows, pull, width)
    assert int(np.argmin(values["force"])) in _left_out(_read(tmp_path, values, (1, 1)))


@pytest.mark.parametrize("row", [10, 30, 60, 90, 100, 150])
def test_what_grows_elsewhere_is_no_ball_that_sticks(tmp_path: Path, row: int) -> None:
    values = _press(160, 0.0, 0.05)
    values["force"][row : row + 2] -= (1.0, 2.0)
    assert _left_out(_read(tmp_path, values, (1, 1))) == [row, row + 1]


@pytest.mark.parametrize("length", [1, 2, 3])
def test_a_spike_within_a_pull_is_left_out(tmp_path: Path, length: int) -> None:
    values = _press(160, 1.0, 0.1)
    row = int(np.argmin(values["force"])) - 3
    values["force"][row : row + length] = -4.0
    assert _left_out(_read(tmp_path, values, (1, 1))) == [*range(row, row + length)]


def test_an_offset_of_some_rows_is_left_out(tmp_path: Path) -> None:
    values = _press(160, 0.0, 0.1)
    values["force"][122:130] -= 0.5
    assert _left_out(_read(tmp_path, values, (1, 1))) == [*range(122, 130)]


def test_without_a_displacement_or_without_the_whole_run_nothing_is_told() -> None:
    values = _press(60, 4.0, 0.06)
    row = int(np.argmin(values["force"]))
    assert sticking({"force": values["force"]}, [row - 1, row]) == []
    assert sticking(values, []) == []
    assert sticking(values, [row]) == []
