"""A column of units whose word changes from row to row, as of a meter that chooses its range, gives each row its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
DEPTH = np.minimum(np.arange(N), N - 1 - np.arange(N)) * 0.0131
FORCE = 0.9 * DEPTH**1.5 * 8
CAP = 97.3 + 60 * DEPTH**2


def of_range(value: float, units: tuple[str, str], limit: float) -> str:
    """A value as a meter shows it: in the first unit up to a limit, in thousands of it, the second, above."""
    return f"{value / 1000:.6f},{units[1]}" if value > limit else f"{value:.3f},{units[0]}"


def written(folder: Path, caps: list[str], names: str = "Cp,Unit") -> Path:
    path = folder / "lab.csv"
    rows = [f"{i * 0.1:.1f},{x:.4f},{f:.4f},{c}" for i, (x, f, c) in enumerate(zip(DEPTH, FORCE, caps, strict=True))]
    path.write_text("\n".join([f"Time (s),Displacement (mm),Force (N),{names}", *rows]) + "\n", encoding="utf-8")
    return path


def is_right(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12, atol=2e-15)
    assert all(not why for why in table.reasons)
    assert any("each row is read in the unit" in note for note in table.notes)


@pytest.mark.parametrize("names", ["Cp,Unit", "Cp,", "Cp,Cp unit", "Cp,Einheit"])
@pytest.mark.parametrize("units", [("pF", "nF"), ("PF", "NF")])
def test_each_row_is_read_in_its_unit(tmp_path: Path, names: str, units: tuple[str, str]) -> None:
    is_right(read_lab_file(written(tmp_path, [of_range(c, units, 100) for c in CAP], names)))


def test_a_unit_that_changes_in_a_single_row_gives_it_its_own(tmp_path: Path) -> None:
    caps = [f"{c / 1000:.6f},nF" if i == 17 else f"{c:.3f},pF" for i, c in enumerate(CAP)]
    is_right(read_lab_file(written(tmp_path, caps)))


def test_numbers_with_exponents_are_read_so_too(tmp_path: Path) -> None:
    is_right(read_lab_file(written(tmp_path, [f"{c / 1000:.6E},nF" if c > 100 else f"{c:.6E},pF" for c in CAP])))


def test_a_force_that_changes_its_range_is_read_so(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    rows = [
        f"{i * 0.1:.1f},{x:.4f},{f:.4f},N" if f > 1 else f"{i * 0.1:.1f},{x:.4f},{f * 1000:.1f},mN"
        for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))
    ]
    path.write_text("\n".join(["Time (s),Displacement (mm),Force,Unit", *rows]) + "\n", encoding="utf-8")
    np.testing.assert_allclose(read_lab_file(path).columns["force"], FORCE, atol=6e-5)


def test_a_unit_that_changes_a_row_late_is_refused_and_mended_it_is_read(tmp_path: Path) -> None:
    caps = [of_range(c, ("pF", "nF"), 100).split(",") for c in CAP]
    late = [f"{value},{caps[max(i - 1, 0)][1]}" for i, (value, _) in enumerate(caps)]
    with pytest.raises(InputError, match=r"do not go on there.*Write the right unit into column 5"):
        read_lab_file(written(tmp_path, late))
    is_right(read_lab_file(written(tmp_path, [",".join(cap) for cap in caps])))


def test_units_of_rows_that_are_all_in_one_are_emptied_and_the_unit_said(tmp_path: Path) -> None:
    caps = [f"{c:.3f},{'nF' if i > 30 else 'pF'}" for i, c in enumerate(CAP)]
    with pytest.raises(InputError, match="empty that column and say the unit: --units capacitance="):
        read_lab_file(written(tmp_path, caps))
    emptied = [f"{cap.split(',')[0]}," for cap in caps]
    table = read_lab_file(written(tmp_path, emptied), Reading(units={"capacitance": "pF"}))
    np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12, atol=2e-15)


@pytest.mark.parametrize("word", ["", "V", "OVER", "MF"])
def test_a_row_without_a_known_unit_leaves_the_column_in_doubt(tmp_path: Path, word: str) -> None:
    caps = [of_range(c, ("pF", "nF"), 100) for c in CAP]
    caps[25] = f"{caps[25].split(',')[0]},{word}"
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, caps))


def test_units_of_rows_beside_a_unit_in_the_name_are_asked_about(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, [of_range(c, ("pF", "nF"), 100) for c in CAP], "Cp (pF),Unit"))


def test_rows_of_one_unit_can_still_be_chosen(tmp_path: Path) -> None:
    path = written(tmp_path, [of_range(c, ("pF", "nF"), 100) for c in CAP])
    table = read_lab_file(path, Reading(where={"Unit": "pF"}))
    np.testing.assert_allclose(table.columns["capacitance"], CAP[CAP <= 100] * 1e-12, atol=2e-15)
