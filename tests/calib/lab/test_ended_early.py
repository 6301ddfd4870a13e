"""A meter that stopped before the end leaves cells empty: what else these rows hold is used, whichever column it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.lab import LabTable, read_lab_file

N = 200
RNG = np.random.default_rng(3)
TIME = 0.1 * np.arange(N)
DEPTH = np.minimum(np.arange(N), N - 1 - np.arange(N)) * 0.0083 + RNG.normal(0, 1e-4, N)
FORCE = 0.6 * np.clip(DEPTH, 0, None) ** 1.5 + RNG.normal(0, 4e-3, N)
CAP = 97.7 + 3 * np.clip(DEPTH, 0, None) ** 2 + RNG.normal(0, 2e-3, N)
COLUMNS = {"disp_mm": [f"{x:.4f}" for x in DEPTH], "force_N": [f"{f:.4f}" for f in FORCE], "cap_pF": [f"{c:.4f}" for c in CAP]}


def read(folder: Path, columns: dict[str, list[str]]) -> LabTable:
    path = folder / "lab.csv"
    rows = [",".join((f"{t:.2f}", *cells)) for t, *cells in zip(TIME, *columns.values(), strict=True)]
    path.write_text("\n".join([",".join(("time_s", *columns)), *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("stop", [120, 130, 150, 170, 185])
def test_rows_behind_the_end_of_a_meter_are_used_but_for_its_readings(tmp_path: Path, stop: int, place: int) -> None:
    names = ["disp_mm", "force_N"]
    names.insert(place, "cap_pF")
    table = read(tmp_path, {n: COLUMNS[n][:stop] + [""] * (N - stop) if n == "cap_pF" else COLUMNS[n] for n in names})
    assert all(not why for why in table.reasons)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3, atol=1e-7)
    assert np.isfinite(table.columns["capacitance"]).tolist() == [i < stop for i in range(N)]
    assert any("what else these rows hold is used" in note for note in table.notes)


@pytest.mark.parametrize("stop", [150, 185])
@pytest.mark.parametrize("lost", ["disp_mm", "force_N"])
def test_rows_that_lost_another_cell_and_moved_by_one_are_left_out(tmp_path: Path, stop: int, lost: str) -> None:
    cells = list(zip(*COLUMNS.values(), strict=True))
    at = list(COLUMNS).index(lost)
    moved = [(*row[:at], *row[at + 1 :], "") if i >= stop else row for i, row in enumerate(cells)]
    table = read(tmp_path, dict(zip(COLUMNS, map(list, zip(*moved, strict=True)), strict=True)))
    assert all("no cell in the last column" in why for why in table.reasons[stop:])


def test_one_cell_that_is_empty_at_the_end_of_a_row_now_and_then_leaves_the_row_out(tmp_path: Path) -> None:
    cap = ["" if i in (30, 90) else cell for i, cell in enumerate(COLUMNS["cap_pF"])]
    table = read(tmp_path, {**COLUMNS, "cap_pF": cap})
    assert [i for i, why in enumerate(table.reasons) if why] == [30, 90]
