"""Columns that are named by the instrument beside the quantity are read with a note where no other column may be meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))


def read(tmp_path: Path, *names: str, sep: str = ",") -> LabTable:
    """A press under some names: time, displacement, force, and half of that force for each name more."""
    columns = [TIME, DEPTH, FORCE, *(FORCE / 2 for _ in names[3:])]
    rows = [sep.join(f"{column[k]:.4f}" for column in columns) for k in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([sep.join(names), *rows]) + "\n")
    return read_lab_file(path, Reading())


@pytest.mark.parametrize(
    ("place", "load", "passed_by"),
    [
        ("Weg WA20 [mm]", "Kraft U9C [N]", "U9C"),
        ("Disp LVDT1 (mm)", "Force LC-10N (N)", "LC-10N"),
        ("Dev1/ai0 Displacement (mm)", "Dev1/ai1 Force (N)", "Dev1/ai1"),
        ("AI 2: Displacement (mm)", "AI 1: Force (N)", "AI 1"),
        ("Displacement ch2 (mm)", "Force ch1 (N)", "ch1"),
        ("Displacement_ch2_mm", "Force_ch1_N", "ch1"),
        ("Keyence LK-H050 [mm]", "Kistler 9207 [N]", "Kistler 9207"),
        ("WA2 Weg [mm]", "U9C_10N [N]", "U9C 10N"),
        ("Extension (mm)", "hx711 load (gf)", "hx711"),
    ],
)
def test_a_channel_or_a_model_beside_the_word_of_a_quantity_is_passed_by_with_a_note(
    tmp_path: Path, place: str, load: str, passed_by: str
) -> None:
    table = read(tmp_path, "Time (s)", place, load)
    assert table.sources["force"] == load
    assert table.sources["displacement"] == place
    assert any(load in note and f'"{passed_by}" in its name is passed by' in note for note in table.notes)
    assert np.max(np.abs(table.columns["time"] - TIME)) < 1e-9


def test_names_with_channels_make_a_header_where_no_other_name_is_understood(tmp_path: Path) -> None:
    table = read(tmp_path, "AI 0: Time (s)", "AI 2: Displacement (mm)", "AI 1: Force (N)")
    assert set(table.columns) == {"time", "displacement", "force"}


@pytest.mark.parametrize(
    "load",
    [
        "Force S2 (N)",
        "Force P10 (N)",
        "Force RUN3 (N)",
        "Force MAX1 (N)",
        "Force ch1 max (N)",
        "Force SP1 (N)",
        "Force ch1 setpoint (N)",
        "Force SD2 (N)",
        "Force x10 (N)",
        "Force X100 (N)",
        "Force GAIN10 (N)",
        "Force MA10 (N)",
        "Force P2P (N)",
        "Dev1/ao1 Force (N)",
        "Kistler peak (N)",
        "Force ch1 left (N)",
    ],
)
def test_a_statistic_a_setpoint_a_factor_or_a_specimen_is_not_passed_by(tmp_path: Path, load: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, "Time (s)", "Extension (mm)", load)


@pytest.mark.parametrize(
    ("load", "other"),
    [
        ("Force ch1 (N)", "Force ch2 (N)"),
        ("Kraft U9C [N]", "Kraft U2B [kN]"),
        ("Force ch1 (N)", "Sum (N)"),
        ("Force ch1 (N)", "Force setpoint (N)"),
        ("Kistler 9207 [N]", "Kistler 9317 [N]"),
    ],
)
def test_of_two_columns_of_a_quantity_none_is_taken_by_its_instrument(tmp_path: Path, load: str, other: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, "Time (s)", "Extension (mm)", load, other)


def test_the_plain_name_is_taken_beside_one_with_an_instrument(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s)", "Extension (mm)", "Load (N)", "Force U9C (N)")
    assert table.sources["force"] == "Load (N)"
    assert any("Force U9C (N)" in note for note in table.notes)


def test_names_in_two_languages_with_a_stroke_between_them_are_read(tmp_path: Path) -> None:
    table = read(tmp_path, "Zeit/Time [s]", "Weg/Displacement [mm]", "Kraft/Force [N]", sep=";")
    assert set(table.columns) == {"time", "displacement", "force"}


@pytest.mark.parametrize("load", ["Force/Displacement (N)", "F/f (N)", "Load/Max (N)", "Force/Stress (N)"])
def test_names_of_two_quantities_with_a_stroke_between_them_are_not_read(tmp_path: Path, load: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, "Time (s)", "Extension (mm)", load)


def test_names_that_matlab_made_of_those_with_units_in_brackets_are_read(tmp_path: Path) -> None:
    table = read(tmp_path, "TestTime_s_", "Displacement_mm_", "CompressiveLoad_N_")
    assert set(table.columns) == {"time", "displacement", "force"}
    assert np.max(np.abs(table.columns["displacement"] - 1e-3 * DEPTH)) < 1e-6


@pytest.mark.parametrize("load", ["Load_10_N_", "LoadX10_N_", "LoadMax_N_", "Load_N_mm_", "Load_setpoint_N_", "Load__N_"])
def test_a_factor_a_statistic_or_another_unit_in_a_name_of_matlab_is_not_passed_by(tmp_path: Path, load: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, "Time_s_", "Displacement_mm_", load)
