"""What a logger writes before or behind a name, `CH0001 Force [N]`, and the index of a symbol, `F_N [mN]`, cost no column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 40
DEPTH = [0.001 * i for i in range(N)]
FORCE = [-0.0092 + 0.0005 * i * i for i in range(N)]
CAP = [97.301 + 0.0137 * i * i for i in range(N)]


def written(folder: Path, *lines: str) -> Path:
    path = folder / "lab.csv"
    rows = [f"{i * 0.1:.1f};{x:.4f};{f:.4f};{c:.4f}" for i, (x, f, c) in enumerate(zip(DEPTH, FORCE, CAP, strict=True))]
    path.write_text("\n".join([*lines, *rows]) + "\n", encoding="utf-8")
    return path


def is_right(table: LabTable, unit: float = 1.0) -> None:
    np.testing.assert_allclose(table.columns["displacement"], np.array(DEPTH) * 1e-3, atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], np.array(FORCE) * unit, atol=1e-4 * unit)
    np.testing.assert_allclose(table.columns["capacitance"], np.array(CAP) * 1e-12, atol=1e-16)


@pytest.mark.parametrize(
    "names",
    [
        "Time (s);CH0001 Disp (mm);CH0002 Force[N];CH0003 Cp (pF)",
        "Time (s);CH1-1 Disp (mm);CH1-2 Force [N];CH2-1 Cp (pF)",
        "Time (s);U1-1 Disp (mm);U1-2 Force [N];U2-1 Cp (pF)",
        "t (s);param0 z (mm);param1 Force (N);param2 Cp (pF)",
        "Zeit [s];Weg_WA20 [mm];Kraft_S2M10N [N];Kap_E4980A [pF]",
        "Zeit [s];CH 0001 Weg [mm];CH 0002 Kraft [N];Cp [pF]",
    ],
)
def test_a_channel_or_a_model_beside_a_name_is_passed_by_with_a_note(tmp_path: Path, names: str) -> None:
    table = read_lab_file(written(tmp_path, names))
    is_right(table)
    assert sum("is passed by" in note for note in table.notes) >= 2


@pytest.mark.parametrize(
    "names",
    [
        "Time (s);Disp (mm);CH0001 Force (N);CH0002 Force (N)",
        "Time (s);Disp (mm);CH1-1 Force (N);CH1-2 Force (N)",
        "Time (s);Disp (mm);CH0001 Quux (N);CH0002 Krag (N)",
    ],
)
def test_channels_of_one_quantity_are_a_choice_and_others_none(tmp_path: Path, names: str) -> None:
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, names))


@pytest.mark.parametrize(
    ("names", "unit"),
    [
        ("t [s];z [mm];F_N [mN];Cp [pF]", 1e-3),
        ("t [s];z [mm];F_N (N);Cp [pF]", 1.0),
        ("t [s];z [mm];F_n (mN);Cp [pF]", 1e-3),
        ("t [s];z [mm];f_N [mN];Cp [pF]", 1e-3),
        ("t / s;z / mm;F_N / mN;Cp / pF", 1e-3),
        ("t in s;z in mm;F_N in mN;Cp in pF", 1e-3),
        ("t_s;z_mm;F_N_mN;Cp_pF", 1e-3),
        ("$t$ (s);$z$ (mm);$F_N$ (mN);$C_p$ (pF)", 1e-3),
        (r"$t$ (s);$z$ (mm);$F_{\mathrm{N}}$ (mN);$C_p$ (pF)", 1e-3),
        ("t;z;F_N;Cp\ns;mm;mN;pF", 1e-3),
        ("t;z;F_N;Cp\ns;mm;N;pF", 1.0),
        ("t [s];z [mm];F_N;Cp [pF]", 1.0),
    ],
)
def test_the_index_of_a_normal_force_is_no_second_unit(tmp_path: Path, names: str, unit: float) -> None:
    table = read_lab_file(written(tmp_path, *names.split("\n")))
    is_right(table, unit)
    assert any("normal force" in note for note in table.notes) == (unit != 1.0)


@pytest.mark.parametrize("name", ["F_T [mN]", "CH0001 max Force (N)", "CH0001 Force setpoint (N)"])
def test_another_force_behind_a_channel_or_with_another_index_is_not_read(tmp_path: Path, name: str) -> None:
    assert "force" not in read_lab_file(written(tmp_path, f"t [s];z [mm];{name};Cp [pF]")).columns


@pytest.mark.parametrize("name", ["F_kN [N]", "Load_N [mN]", "Force_N (kN)"])
def test_a_unit_behind_a_name_is_no_index(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="force"):
        read_lab_file(written(tmp_path, f"t [s];z [mm];{name};Cp [pF]"))


def test_the_unit_of_a_normal_force_may_be_said(tmp_path: Path) -> None:
    path = written(tmp_path, "t [s];z [mm];F_N [mN];Cp [pF]")
    is_right(read_lab_file(path, Reading(columns={"force": "F_N [mN]"})), 1e-3)
    is_right(read_lab_file(path, Reading(units={"force": "N"})))


@pytest.mark.parametrize("words", ["wf group 1", "Group", "Messung 3", "Rig7", "DAQ task", "gruppe 1"])
def test_a_line_with_the_same_words_in_every_cell_names_no_column(tmp_path: Path, words: str) -> None:
    table = read_lab_file(written(tmp_path, "Time;Displacement;Force;Cp", ";".join([words] * 4), "s;mm;N;pF"))
    is_right(table)
    assert any(words in unread.reason for unread in table.unread)


@pytest.mark.parametrize(
    "words",
    [
        "max",
        "x10",
        "simulated",
        "filtered",
        "Force",
        "delta",
        "Volt",
        "inverted",
        "gain 10",
        "div 10",
        "test max",
        "group mean",
        "raw",
    ],
)
def test_a_line_with_a_word_that_tells_of_the_readings_is_asked_about(tmp_path: Path, words: str) -> None:
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, "Time;Displacement;Force;Cp", ";".join([words] * 4), "s;mm;N;pF"))
