"""A column of a slower instrument that was pasted beside a press is refused; a meter that stopped before the end is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from models.sensor import FloatArray

N = 600


def _depth(n: int, cycles: int = 1) -> FloatArray:
    one = 1.2 * (1 - np.abs(np.linspace(-1, 1, n // cycles)))
    return np.tile(one, cycles)


def _load(depth: FloatArray, seed: int) -> FloatArray:
    return 4 * np.clip(depth - 0.15, 0, None) ** 1.6 + 0.004 * np.random.default_rng(seed).standard_normal(depth.size)


def _cap(depth: FloatArray, seed: int) -> FloatArray:
    return 97 + 1.5 * np.clip(depth - 0.15, 0, None) ** 1.2 + 0.004 * np.random.default_rng(seed).standard_normal(depth.size)


def _read(folder: Path, depth: FloatArray, force: FloatArray, cap: FloatArray, reading: Reading | None = None) -> LabTable:
    cells = [[f"{v:.4f}" for v in column] + [""] * (depth.size - column.size) for column in (depth, force, cap)]
    path = folder / "press.csv"
    rows = [",".join((f"{0.1 * i:.1f}", *row)) for i, row in enumerate(zip(*cells, strict=True))]
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N),Cp (pF)", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize("n", [150, 240, 380, 520])
@pytest.mark.parametrize("quantity", ["force", "capacitance"])
def test_a_column_that_turns_and_ends_before_the_press_is_refused_and_each_way_out_works(
    tmp_path: Path, n: int, quantity: str
) -> None:
    depth, short = _depth(N), _depth(n)
    columns = (_load(short, 1), _cap(depth, 2)) if quantity == "force" else (_load(depth, 1), _cap(short, 2))
    with pytest.raises(InputError) as refused:
        _read(tmp_path, depth, *columns)
    fault = refused.value.faults[0]
    assert "seem to be of other rows" in fault.message
    assert f"ends in line {n + 1}" in fault.message
    assert f"--columns {quantity}=none" in fault.advice
    left = _read(tmp_path, depth, *columns, Reading(columns={quantity: "none"}))
    assert quantity not in left.columns
    unit = {"force": "N", "capacitance": "pF"}[quantity]
    said = _read(tmp_path, depth, *columns, Reading(units={quantity: unit}))
    assert int(np.count_nonzero(np.isfinite(said.columns[quantity]))) == n


@pytest.mark.parametrize("stop", [100, 250, 297, 305, 400, 550])
@pytest.mark.parametrize("cycles", [1, 2, 3])
def test_a_meter_that_stopped_before_the_end_is_read(tmp_path: Path, stop: int, cycles: int) -> None:
    depth = _depth(N, cycles)
    table = _read(tmp_path, depth, _load(depth, 1), _cap(depth, 2)[:stop])
    assert int(np.count_nonzero(np.isfinite(table.columns["capacitance"]))) == stop
