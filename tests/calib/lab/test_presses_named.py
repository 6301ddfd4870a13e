"""Presses below one another in one table: a column of any name that tells them apart is asked about, one of phases is not."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

HALF = 50
WAY = np.round(np.concatenate([np.linspace(0.0, 1.0, HALF), np.linspace(0.98, 0.0, HALF)]), 4)
N = 2 * HALF


def written(tmp_path: Path, name: str, cells: list[str], *, timed: bool = True) -> Path:
    """Presses with a cell each, or cells row by row."""
    lines = [("Time (s)," if timed else "") + f"{name},Displacement (mm),Force (N)"]
    rows = cells if len(cells) > 8 else [cell for cell in cells for _ in range(N)]
    for k, cell in enumerate(rows):
        x = WAY[k % N]
        force = (4.0 + 0.3 * (k // N)) * max(x - 0.15, 0.0) ** 1.5
        lines.append((f"{0.1 * k:.1f}," if timed else "") + f"{cell},{x:.4f},{force:.4f}")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        ("Muster", ["A", "B"]),
        ("试样编号", ["1", "2"]),
        ("Versuch", ["1", "2", "3"]),
        ("Messung Nr.", ["4", "5"]),
        ("source_file", ["run1.csv", "run2.csv"]),
        ("ID", ["PDMS-17", "PDMS-18"]),
        ("образец", ["первый", "второй"]),
        ("", ["left", "right"]),
        ("Operator", ["AB", "CD"]),
    ],
)
@pytest.mark.parametrize("timed", [True, False])
def test_presses_that_a_column_of_any_name_tells_apart_are_asked_about(
    tmp_path: Path, name: str, cells: list[str], timed: bool
) -> None:
    path = written(tmp_path, name, cells, timed=timed)
    with pytest.raises(InputError, match="may belong to several records") as error:
        read_lab_file(path)
    assert "changes where a press begins anew" in str(error.value)
    choice = error.value.faults[0].choice
    assert choice is not None
    assert choice.option == "where"
    table = read_lab_file(path, Reading(where={choice.key: cells[1]}))
    assert [k for k, why in enumerate(table.reasons) if not why] == list(range(N, 2 * N))


def read(tmp_path: Path, name: str, cells: list[str]) -> LabTable:
    return read_lab_file(written(tmp_path, name, cells))


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        ("Zyklus Nr", ["1", "2", "3"]),
        ("cyc", ["1", "2"]),
        ("Label", ["cycle 1", "cycle 2"]),
        ("Remark", ["loading"] * HALF + ["unloading"] * HALF),
        ("Nr", (["1"] * HALF + ["2"] * HALF + ["3"] * HALF + ["4"] * HALF)),
        ("What", ["hin"] * HALF + ["her"] * HALF + ["hin"] * HALF + ["her"] * HALF),
        ("Speed (mm/min)", ["1", "2"]),
        ("flag", ["a"] * 30 + ["b"] * (2 * N - 30)),
    ],
)
def test_phases_and_cycles_of_one_record_are_read_together(tmp_path: Path, name: str, cells: list[str]) -> None:
    table = read(tmp_path, name, cells)
    assert not any(table.reasons)
