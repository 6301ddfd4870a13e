"""Lines between names and rows that say in words, or as symbols, what the columns are, and words of what was measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file

N = 40
DEPTH = [1e-5 * i for i in range(N)]
FORCE = [0.0005 * i * i for i in range(N)]


def written(folder: Path, above: str, below: str = "") -> Path:
    path = folder / "lab.csv"
    rows = [f"{i * 0.1:.1f},{1e3 * x:.5f},{f:.5f}" for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))]
    path.write_text("\n".join([above, *rows]) + "\n" + below, encoding="utf-8")
    return path


def assert_press(table: LabTable, n: int = N) -> None:
    np.testing.assert_allclose(table.columns["time"][:n], 0.1 * np.arange(n), atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"][:n], DEPTH[:n], atol=1e-9)
    np.testing.assert_allclose(table.columns["force"][:n], FORCE[:n], atol=1e-5)


@pytest.mark.parametrize(
    ("above", "told"),
    [
        ("Time,Position,Force\nt,x,F\ns,mm,N", "as symbols"),
        ("Time,Position,Load\nt,s,F\ns,mm,N", "as symbols"),
        ("t,z,F\nelapsed time,stage position,load cell\n(s),(mm),(N)", ""),
        ("t,z,F\nTime,Displacement,Force\ns,mm,N", ""),
        ("Time,Displacement,Force\ns,mm,N\n,stage,load cell", "comments on the columns"),
    ],
)
def test_a_line_that_says_again_what_the_columns_are_is_passed_by(tmp_path: Path, above: str, told: str) -> None:
    table = read_lab_file(written(tmp_path, above))
    assert_press(table)
    assert not told or any(told in unread.reason for unread in table.unread)


@pytest.mark.parametrize("meter", ["LCR meter", "LCR 1 kHz", "LCR", '"Impedance analyzer, 10 kHz"', "capacitance bridge"])
@pytest.mark.parametrize(
    "head",
    [
        "Time,Displacement,Force,Cp\ns,mm,N,pF\n,stage,load cell,{}",
        "t,z,F,C\nelapsed time,stage position,load cell,{}\ns,mm,N,pF",
    ],
)
def test_what_a_capacitance_is_measured_with_changes_no_name(tmp_path: Path, head: str, meter: str) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{i * 0.1:.1f},{i * 0.01:.3f},{i * i * 0.001:.4f},{97.3 + 0.01 * i:.4f}" for i in range(N)]
    path.write_text("\n".join([head.format(meter), *rows]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH, atol=1e-9)
    np.testing.assert_allclose(table.columns["capacitance"], (97.3 + 0.01 * np.arange(N)) * 1e-12)


@pytest.mark.parametrize(
    "above",
    [
        "Time,Position,Force\nt,F,x\ns,mm,N",
        "t,z,F\ntime,displacement,stress\ns,mm,N",
        "t,z,F\nelapsed time,load cell,stage position\n(s),(mm),(N)",
        "t,z,F\nelapsed time,stage position,setpoint force\n(s),(mm),(N)",
        "t,z,F\nelapsed time,stage position,load cell (kN)\n(s),(mm),(N)",
        "Time,Displacement,Force\ns,mm,N\n,stage,setpoint",
        "Time,Displacement,Force\ns,mm,N\n,stage x1000,load cell",
    ],
)
def test_a_line_that_says_another_thing_of_a_column_is_refused(tmp_path: Path, above: str) -> None:
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, above))


@pytest.mark.parametrize(
    "above",
    [
        "Time (s),Ram position (mm),Force (N)",
        "Zeit (s),Istposition (mm),Kraft (N)",
        "Czas (s),Przemieszczenie zmierzone (mm),Siła (N)",
        "Zeit (s),Weg (mm) [gemittelt],Kraft (N) [gemittelt]",
    ],
)
def test_words_of_what_was_measured_are_read(tmp_path: Path, above: str) -> None:
    assert_press(read_lab_file(written(tmp_path, above)))


@pytest.mark.parametrize("word", ["Range", "Spannweite", "n"])
def test_a_range_beside_the_results_below_a_table_is_one_of_them(tmp_path: Path, word: str) -> None:
    table = read_lab_file(
        written(tmp_path, "Time (s),Displacement (mm),Force (N)", f"Min,0,0\nMax,0.39,0.7605\n{word},0.39,0.7605\n")
    )
    assert_press(table)
    assert [reason[:16] for reason in table.reasons[N:]] == ["a row of results"] * 3


def test_a_unit_in_some_cells_behind_the_first_is_read_with_them(tmp_path: Path) -> None:
    path = written(tmp_path, "Time (s),Displacement (mm),Force (N)")
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [f"{i * 0.1:.1f},{i * 0.01:.5f},{i * i * 0.0005:.5f}{' N' if i > 100 else ''}" for i in range(N, 140)]
    path.write_text("\n".join([*lines, *rows]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["force"], [i * i * 0.0005 for i in range(140)], atol=1e-5)
    assert any("in the unit that stands behind it" in note for note in table.notes)
