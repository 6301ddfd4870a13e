"""A press along another axis than z is asked about; loads across that are no larger than that along, and drifts, are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 100
_DEPTH = 1 - np.abs(np.linspace(-1, 1, N))
_FORCE = 4 * np.maximum(_DEPTH - 0.1, 0.0) ** 1.5


def _read(folder: Path, heads: str, scales: list[float], reading: Reading | None = None) -> LabTable:
    """A press whose columns of force and place are these times a press's own, with the names of `heads` behind the time."""
    rng = np.random.default_rng(2)
    columns = [
        scale * (_FORCE if "N)" in name or name.endswith("_N") else _DEPTH) + 0.002 * rng.normal(size=N)
        for name, scale in zip(heads.split(","), scales, strict=True)
    ]
    rows = [",".join([f"{0.1 * i:.1f}", *(f"{v:.4f}" for v in row)]) for i, row in enumerate(zip(*columns, strict=True))]
    path = folder / "axes.csv"
    path.write_text("\n".join([f"Time (s),{heads}", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    ("heads", "scales", "other"),
    [
        ("Position (mm),Fx (N),Fy (N),Fz (N)", [1.0, 1.0, 0.0, 0.0], "Fx (N)"),
        ("Position (mm),Fx (N),Fy (N),Fz (N)", [1.0, 0.0, -1.0, 0.03], "Fy (N)"),
        ("Position (mm),Fx_N,Fz_N", [1.0, 1.0, 0.1], "Fx_N"),
        ("Position x (mm),Position z (mm),Fz (N)", [1.0, 0.01, 1.0], "Position x (mm)"),
    ],
)
def test_a_press_along_another_axis_is_asked_about(tmp_path: Path, heads: str, scales: list[float], other: str) -> None:
    with pytest.raises(InputError, match="along which axis it is pressed is not told") as refused:
        _read(tmp_path, heads, scales)
    (fault,) = refused.value.faults
    assert fault.choice is not None
    assert other in fault.choice.alternatives[0]
    quantity = fault.choice.key
    table = _read(tmp_path, heads, scales, Reading(columns={quantity: other}))
    assert np.nanmax(np.abs(table.columns[quantity])) > 0.9 * (1e-3 if quantity == "displacement" else 3.0)


@pytest.mark.parametrize(
    ("heads", "scales"),
    [
        ("Position (mm),Fx (N),Fy (N),Fz (N)", [1.0, 0.3, 0.1, 1.0]),
        ("Position (mm),Fx (N),Fz (N)", [1.0, 1.5, 1.0]),
        ("Position x (mm),Position z (mm),Fz (N)", [0.0, 1.0, 1.0]),
    ],
)
def test_a_press_along_z_is_read_whatever_little_happens_across(tmp_path: Path, heads: str, scales: list[float]) -> None:
    table = _read(tmp_path, heads, scales)
    assert np.nanmax(table.columns["force"]) > 3.0
