"""Columns of a fixed width in which a full cell touches the next are parted where the cells of the other lines end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 120
T = 0.1 * np.arange(N)
X = 1.2 * np.sin(np.pi * T / T[-1])
F = 9.0 + 3.0 * np.abs(X) ** 1.5


def _read(folder: Path, rows: list[str], reading: Reading | None = None) -> LabTable:
    path = folder / "press.txt"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def _is_press(table: LabTable, force: float = -1.0, zero: float = 0.0, way: float = -1.0) -> None:
    assert len(table.lines) == N
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], T, atol=1e-3)
    np.testing.assert_allclose(table.columns["force"], force * F, atol=1e-3)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * (zero + way * X), atol=1e-6)


FORMATS = {
    "decimals": ("{:8.3f}{:8.4f}{:9.4f}", -9.0),
    "exponents": ("{:11.4E}{:11.4E}{:11.4E}", 0.0),
    "plus signs": ("{:+8.3f}{:+8.4f}{:+8.4f}", 0.0),
}


@pytest.mark.parametrize(("form", "zero"), FORMATS.values(), ids=FORMATS)
@pytest.mark.parametrize("named", [True, False])
def test_touching_numbers_are_parted_and_told(tmp_path: Path, form: str, zero: float, named: bool) -> None:
    rows = [form.format(t, -f, zero - x) for t, f, x in zip(T, F, X, strict=True)]
    assert any(len(row.split()) < 3 for row in rows)
    widths = [len(f"{part}}}".format(0.0)) for part in form.split("}")[:3]]
    header = "".join(name.rjust(width) for name, width in zip(("t_s", "F_N", "x_mm"), widths, strict=True))
    reading = Reading(
        columns={"time": "1", "force": "2", "displacement": "3"}, units={"time": "s", "force": "N", "displacement": "mm"}
    )
    table = _read(tmp_path, [header, *rows]) if named else _read(tmp_path, rows, reading)
    _is_press(table, zero=zero)
    assert any("numbers touch each other in" in note for note in table.notes)


def test_lines_in_which_all_cells_touch_are_parted_below_the_ends_of_names(tmp_path: Path) -> None:
    rows = [f"{1000 + t:9.4f}{1000 * f:10.4f}{1000 + x:9.4f}" for t, f, x in zip(T, F, X, strict=True)]
    rows = [row.replace(" ", "0") for row in rows]
    assert all(len(row.split()) == 1 for row in rows)
    table = _read(tmp_path, [f"{'t_s':>9}{'F_mN':>10}{'x_mm':>9}", *rows])
    _is_press(table, force=1.0, zero=1000.0, way=1.0)


def test_a_line_whose_points_stand_elsewhere_is_refused(tmp_path: Path) -> None:
    rows = [f"{t:8.3f}{-f:8.4f}{-9.0 - x:9.4f}" for t, f, x in zip(T, F, X, strict=True)]
    rows[60] = rows[60].replace(".", "", 1).replace("-", "-0.", 1)
    with pytest.raises(InputError, match=r"press.txt:62:"):
        _read(tmp_path, [f"{'t_s':>8}{'F_N':>8}{'x_mm':>9}", *rows])


def test_rows_whose_touching_numbers_cannot_be_parted_are_named(tmp_path: Path) -> None:
    rows = [f"{t:8.3f}{-100 - x:9.4f}{f - 1010.5:9.4f}" for t, x, f in zip(T, X, F, strict=True)]
    with pytest.raises(InputError, match="several numbers that touch each other") as caught:
        _read(tmp_path, ["     t_s    x_mm      F_N", *rows])
    assert caught.value.faults[0].line == 2
    assert "sed -E" in caught.value.faults[0].advice
