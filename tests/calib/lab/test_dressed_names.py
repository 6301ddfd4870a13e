"""What stands around every name of a header, letters, quotes, pairs, units behind a dash, is no part of the names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 40
DEPTH = [1e-5 * i for i in range(N)]
FORCE = [0.0005 * i * i for i in range(N)]


def written(folder: Path, names: Sequence[str], sep: str = ",") -> Path:
    path = folder / "lab.csv"
    rows = [
        sep.join((f"{i * 0.1:.1f}", f"{1e3 * x:.5f}", f"{f:.5f}")) for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))
    ]
    path.write_text("\n".join([sep.join(names), *rows]) + "\n", encoding="utf-8")
    return path


def assert_press(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"], 0.1 * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH, atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-5)


@pytest.mark.parametrize("sep", [",", ";", "\t"])
@pytest.mark.parametrize(
    "names",
    [
        ["X: Time (s)", "A: Displacement (mm)", "B: Force (N)"],
        ["A: Time (s)", "B: Displacement (mm)", "C: Force (N)"],
        ['"A: Time (s)"', '"B: Displacement (mm)"', '"C: Force (N)"'],
        ["'Time (s)'", "'Displacement (mm)'", "'Force (N)'"],
        ["'time_s'", "'disp_mm'", "'force_N'"],
        ["`time_s`", "`disp_mm`", "`force_N`"],
        ["\"('Time', 's')\"", "\"('Displacement', 'mm')\"", "\"('Force', 'N')\""],
        ["Time-s", "Disp-mm", "Force-N"],
        ["s_time", "mm_displacement", "N_force"],
    ],
)
def test_names_are_taken_without_what_stands_around_each_of_them(tmp_path: Path, names: list[str], sep: str) -> None:
    table = read_lab_file(written(tmp_path, names, sep))
    assert_press(table)
    assert any("taken without what is written around each" in note for note in table.notes)


@pytest.mark.parametrize(
    "names",
    [
        ["X: Displacement (mm)", "Y: Displacement (mm)", "Z: Displacement (mm)"],
        ["C: Time (s)", "A: Displacement (mm)", "B: Force (N)"],
        ["Time (s)", "'Displacement (mm)'", "B: Force (N)"],
        ["Time-s", "Displacement-N", "Force-mm"],
        ["s_time", "mm_displacement", "g_force"],
    ],
)
def test_what_stands_around_some_names_or_may_mean_another_thing_is_left_there(tmp_path: Path, names: list[str]) -> None:
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, names))


@pytest.mark.parametrize(
    "names",
    [
        ["Foo: Time (s)", "Bar: Displacement (mm)", "Baz: Force (N)"],
        ["E: Time (s)", "F: Displacement (mm)", "G: Force (N)"],
    ],
)
def test_names_that_are_not_understood_above_rows_of_numbers_are_shown_and_can_be_said(
    tmp_path: Path, names: list[str]
) -> None:
    path = written(tmp_path, names)
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    assert "no row of numbers" not in str(caught.value)
    assert names[2] in str(caught.value)
    assert "by name or number: --columns time=1" in str(caught.value)
    quantities = ("time", "displacement", "force")
    units = {"time": "s", "displacement": "mm", "force": "N"}
    assert_press(read_lab_file(path, Reading(columns=dict(zip(quantities, names, strict=True)), units=units)))
    assert_press(read_lab_file(path, Reading(columns=dict(zip(quantities, "123", strict=True)), units=units)))


def test_a_name_as_it_stands_there_can_be_said_too(tmp_path: Path) -> None:
    path = written(tmp_path, ["'time_s'", "'disp_mm'", "'force_N'"])
    columns = {"time": "'time_s'", "displacement": "'disp_mm'", "force": "'force_N'"}
    assert_press(read_lab_file(path, Reading(columns=columns, units={"time": "s", "displacement": "mm", "force": "N"})))
