"""Rows in which a display or an export changed its digits: used and told, neither jumps nor stuck nor a range's end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.lab import Observations, judge, observe, read_lab_file
from calib.lab.instruments import rounded_rows
from models.sensor import FloatArray

TURN, N = 122, 240
_QUANTITIES = ("time", "displacement", "force", "capacitance")


def record(folder: Path, first: int, behind: int, digits: int, column: str = "force", unit: str = "N") -> Observations:
    """A press and its way back, of which one column is rounded to fewer digits in some rows."""
    columns = press()
    scale = 1e3 if unit == "mN" else 1.0
    cells = {
        "time": [f"{v:.3f}" for v in columns["time"]],
        "displacement": [f"{v:.4f}" for v in columns["displacement"]],
        "force": [f"{v * scale:.4f}" for v in columns["force"]],
        "capacitance": [f"{v:.4f}" for v in columns["capacitance"]],
    }
    factor = scale if column == "force" else 1.0
    for row in range(first, behind):
        cells[column][row] = f"{columns[column][row] * factor:.{max(digits, 0)}f}"
        if digits < 0:
            cells[column][row] = f"{round(float(columns[column][row]) * factor, digits):.0f}"
    path = folder / "press.csv"
    rows = zip(*cells.values(), strict=True)
    path.write_text(f"Time (s),Displacement (mm),Force ({unit}),Cp (pF)\n" + "".join(",".join(r) + "\n" for r in rows))
    return observe(read_lab_file(path))


def press() -> dict[str, FloatArray]:
    """Time [s], displacement [mm], force [N] and capacitance [pF] of a press."""
    rng = np.random.default_rng(3)
    n = np.arange(N)
    x = 0.0055 * np.minimum(n, 2 * TURN - n) + rng.normal(0, 2e-4, N)
    depth = np.clip(x - 0.08, 0.0, None)
    load = 6.0 * depth**1.5 * np.where(n > TURN, 0.95, 1.0) + rng.normal(0, 3e-3, N)
    sensed = 97.0 + 4.0 * depth + rng.normal(0, 2e-3, N)
    return {q: np.asarray(v, dtype=np.float64) for q, v in zip(_QUANTITIES, (0.1 * n, x, load, sensed), strict=True)}


@pytest.mark.parametrize(
    ("first", "behind", "digits", "unit"),
    [(60, 122, 1, "N"), (90, N, 0, "N"), (0, 100, 1, "N"), (70, 110, 1, "N"), (60, 122, -2, "mN"), (100, 180, 0, "N")],
)
def test_a_force_that_is_rounded_in_some_rows_is_read_and_told(
    tmp_path: Path, first: int, behind: int, digits: int, unit: str
) -> None:
    obs = record(tmp_path, first, behind, digits, unit=unit)
    notes = " ".join(obs.table.notes)
    step = f"{10.0**-digits:g} {unit}"
    assert f"are written in steps of {step}, all others of 0.0001 {unit}" in notes
    for wrong in ("jump", "end of its range", "stands still", "its zero", "stands alone"):
        assert wrong not in " ".join((notes, *obs.reason))
    assert not {r for r in obs.reason[: TURN - 1] if r}
    inside = min(behind, TURN) - max(first, 0) > 0.1 * TURN
    resolution = next(g for g in judge(obs) if g.check == "resolution" and g.channel == "force")
    assert (resolution.level == "good") != inside


def test_a_capacitance_that_is_rounded_in_some_rows_is_told_too(tmp_path: Path) -> None:
    obs = record(tmp_path, 60, 150, 1, "capacitance")
    assert sum("rounded more coarsely" in note for note in obs.table.notes) == 1
    assert not {r for r in obs.reason[: TURN - 1] if r}


def test_a_reading_that_stands_alone_among_rounded_ones_is_left_out(tmp_path: Path) -> None:
    columns = press()
    cells = [f"{f:.4f}" if i < 60 else f"{f:.1f}" for i, f in enumerate(columns["force"].tolist())]
    cells[100] = "7.3"
    path = tmp_path / "press.csv"
    rows = zip(columns["time"], columns["displacement"], cells, columns["capacitance"], strict=True)
    lines = "".join(f"{t:.3f},{x:.4f},{f},{c:.4f}\n" for t, x, f, c in rows)
    path.write_text("Time (s),Displacement (mm),Force (N),Cp (pF)\n" + lines)
    reasons = read_lab_file(path).reasons
    assert [r for r, why in enumerate(reasons) if why] == [100]
    assert "stands alone" in reasons[100]


def test_a_range_that_ends_within_rows_of_all_digits_is_still_told(tmp_path: Path) -> None:
    columns = press()
    columns["force"] = np.minimum(columns["force"], 1.5)
    path = tmp_path / "press.csv"
    rows = zip(*(columns[q] for q in ("time", "displacement", "force")), strict=True)
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(f"{t:.3f},{x:.4f},{f:.4f}\n" for t, x, f in rows))
    notes = read_lab_file(path).notes
    assert any("the end of its range" in note for note in notes)
    assert not any("rounded" in note for note in notes)


def test_a_zero_that_was_set_anew_within_rounded_rows_is_still_a_jump(tmp_path: Path) -> None:
    columns = press()
    columns["force"] = np.where(np.arange(N) >= 90, columns["force"] - 1.0, columns["force"])
    cells = [f"{f:.4f}" if i < 50 else f"{f:.1f}" for i, f in enumerate(columns["force"].tolist())]
    path = tmp_path / "press.csv"
    rows = zip(columns["time"], columns["displacement"], cells, strict=True)
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(f"{t:.3f},{x:.4f},{f}\n" for t, x, f in rows))
    assert any("the readings jump" in note for note in read_lab_file(path).notes)


@pytest.mark.parametrize(
    "values",
    [
        np.zeros(100),
        np.round(np.linspace(0, 3, 200), 1),
        np.round(np.linspace(0, 3, 200), 4),
        np.concatenate([np.zeros(50), np.round(np.linspace(0, 3, 150) ** 1.5, 4)]),
        np.concatenate([np.arange(40) * 0.5, np.round(20 + np.linspace(0, 3, 100) ** 1.5, 4)]),
        np.minimum(np.round(np.linspace(0, 3, 200) ** 1.5, 4), 1.5),
        np.full(60, np.nan),
    ],
    ids=["nothing", "coarse", "fine", "a rest", "steps of a drive", "a range's end", "no reading"],
)
def test_what_has_one_resolution_throughout_is_not_rounded(values: FloatArray) -> None:
    assert rounded_rows(values) == []
