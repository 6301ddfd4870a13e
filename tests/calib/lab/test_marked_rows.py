"""Columns that mark rows: those that a file itself calls bad are left out, whatever the column is called."""

from pathlib import Path

import numpy as np
import pytest

from calib.lab import LabTable, read_lab_file

N = 120
TIME = np.round(0.1 * np.arange(N), 3)
DEPTH = np.round(np.concatenate([np.linspace(0.0, 1.0, N // 2), np.linspace(1.0, 0.0, N // 2)]), 4)
FORCE = np.round(4.0 * np.clip(DEPTH - 0.15, 0, None) ** 1.5, 4)
BAD = range(40, 46)


def read(tmp_path: Path, name: str, good: str, bad: str, *, glitch: float = 1.06) -> LabTable:
    lines = [f"Time (s),Displacement (mm),Force (N),{name}"]
    for k in range(N):
        force = FORCE[k] * (glitch if k in BAD else 1.0)
        lines.append(f"{TIME[k]:.3f},{DEPTH[k]:.4f},{force:.4f},{bad if k in BAD else good}")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("exclude", "no", "yes"),
        ("Excluded", "", "x"),
        ("quality", "good", "bad"),
        ("DataQuality", "Good", "Bad"),
        ("Overload", "FALSE", "TRUE"),
        ("Status", "OK", "OVER"),
        ("Status", "", "ERR"),
        ("OK", "1", "0"),
        ("ok?", "yes", "no"),
        ("Use", "y", "n"),
        ("bad", "0", "1"),
        ("skip", "", "x"),
        ("is_outlier", "False", "True"),
        ("Ausreißer", "nein", "ja"),
        ("Mask", "0", "1"),
        ("Saturated", "no", "yes"),
        ("Remark", "", "saturated"),
        ("Comment", "", "sensor clipped"),
        ("Limit", "", "OVER"),
        ("Force overload", "0", "1"),
    ],
)
def test_rows_that_a_column_of_the_file_calls_bad_are_left_out(tmp_path: Path, name: str, good: str, bad: str) -> None:
    table = read(tmp_path, name, good, bad)
    assert [k for k, why in enumerate(table.reasons) if why] == list(BAD)
    assert all(f'"{name}" says "{bad}"' in table.reasons[k] for k in BAD)
    assert not any("zero was set" in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("Relay", "off", "on"),
        ("Light", "0", "1"),
        ("Remark", "", "max"),
        ("Comment", "", "no overload"),
        ("Remark", "", "turn"),
        ("Status", "Loading", "Unloading"),
        ("Mode", "A", "B"),
    ],
)
def test_columns_of_something_else_take_no_rows(tmp_path: Path, name: str, good: str, bad: str) -> None:
    table = read(tmp_path, name, good, bad, glitch=1.0)
    assert not any(table.reasons)


def test_a_mark_in_most_rows_is_none(tmp_path: Path) -> None:
    table = read(tmp_path, "Mask", "1", "0", glitch=1.0)
    assert not any(table.reasons)
