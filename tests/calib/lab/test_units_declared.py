"""Units that lines above a table declare, abbreviated names and names in more languages, and "x" as the displacement."""

from pathlib import Path

import numpy as np
import pytest

import calib
from calib.lab import LabTable

ROWS = [f"{0.1 * i:.1f},{10.0 * i:.1f},{0.3 * i**1.5:.4f}" for i in range(40)]


def _read(folder: Path, *lines: str) -> LabTable:
    path = folder / "press.csv"
    path.write_text("\n".join([*lines, *ROWS]) + "\n", encoding="utf-8")
    return calib.read_lab_file(path)


@pytest.mark.parametrize(
    "above",
    [
        ['# force_unit = "mN"', '# displacement_unit = "um"', '# time_unit = "s"'],
        ["All forces are in millinewton, displacements in micrometre, time in seconds."],
        ["Hinweis: Kraft in mN, Weg in µm, Zeit in s"],
        ["# units: s um mN"],
        ["# units [s] [um] [mN]", "# press 12, ball 6 mm"],
        ["# units: s|um|mN"],
        ["% Units s um mN"],
        ["---", "units: {time: s, displacement: um, force: mN}", "---"],
    ],
)
def test_units_that_a_sentence_or_an_assignment_above_declares_are_taken(tmp_path: Path, above: list[str]) -> None:
    table = _read(tmp_path, *above, "time,displacement,force")
    np.testing.assert_allclose(table.columns["displacement"][-1], 390e-6)
    np.testing.assert_allclose(table.columns["force"][-1], 0.3e-3 * 39**1.5, rtol=1e-4)
    assert any("the unit of force (" in note for note in table.notes)


@pytest.mark.parametrize("above", ["Ball in mm, force in mN", "force in mN, pressed in air", "load cell: 10 N, time in s"])
def test_a_sentence_of_which_a_part_states_no_unit_of_a_reading_declares_none(tmp_path: Path, above: str) -> None:
    with pytest.raises(calib.InputError, match="has no unit"):
        _read(tmp_path, above, "time,displacement,force")


@pytest.mark.parametrize(
    "names",
    [
        "เวลา (s),ระยะกด (um),แรง (mN)",
        "زمان (s),جابجایی (um),نیرو (mN)",
        "זמן (s),תזוזה (um),כוח (mN)",
        "t (s),dep (um),F (mN)",
        "tiempo_s,despl_um,fza_mN",
        "t_s,dist_um,F_mN",
    ],
)
def test_abbreviated_names_and_more_languages_are_understood(tmp_path: Path, names: str) -> None:
    table = _read(tmp_path, names)
    np.testing.assert_allclose(table.columns["displacement"][-1], 390e-6)
    np.testing.assert_allclose(table.columns["force"][-1], 0.3e-3 * 39**1.5, rtol=1e-4)


@pytest.mark.parametrize("names", ["t (s),x (um),F (mN)", "t_s,x_um,F_mN", "t [s],x [um],F [mN]"])
def test_x_is_the_displacement_where_no_other_column_is_a_length_and_that_is_told(tmp_path: Path, names: str) -> None:
    table = _read(tmp_path, names)
    np.testing.assert_allclose(table.columns["displacement"][-1], 390e-6)
    assert any("the only column of a length" in note for note in table.notes)


def test_x_is_no_displacement_beside_another_column_of_a_length(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_text("\n".join(["x (um),y (um),F (mN)", *ROWS]) + "\n")
    with pytest.raises(calib.InputError):
        calib.read_lab_file(path)


def test_kilograms_force_in_any_case_are_taken(tmp_path: Path) -> None:
    table = _read(tmp_path, "Time (s),Displacement (um),Force (Kgf)")
    np.testing.assert_allclose(table.columns["force"][-1], 9.80665 * 0.3 * 39**1.5, rtol=1e-4)


@pytest.mark.parametrize("above", ["# units: N m", "# units: s um F mN", "# units: s um", "Unit 5 mN um"])
def test_units_between_blanks_that_are_no_list_of_one_unit_for_each_column_declare_none_in_part(
    tmp_path: Path, above: str
) -> None:
    with pytest.raises(calib.InputError, match="has no unit"):
        _read(tmp_path, above, "time,displacement,force")


@pytest.mark.parametrize(
    "above",
    [
        [
            "# Columns:",
            "#   time: time since start in seconds",
            "#   displacement: indenter displacement in micrometres, positive into the sensor",
            "#   force: normal force in millinewtons (tared)",
        ],
        ["# - time: elapsed time, seconds", "# - displacement: depth, micrometres", "# - force: normal force, millinewtons"],
        ["`time` - seconds since the start, in s", "`displacement` - stage travel [um]", "`force` - normal force (mN), tared"],
        ["time (s): since the start", "displacement (um): of the crosshead", "force (mN): of the 10 N load cell"],
        ["Time = measured in seconds since the start", "Displacement = depth, um", "Force = by the load cell, in mN"],
    ],
)
def test_lines_that_say_what_each_column_is_and_its_unit_give_it_with_a_note(tmp_path: Path, above: list[str]) -> None:
    table = _read(tmp_path, *above, "time,displacement,force")
    np.testing.assert_allclose(table.columns["time"][-1], 3.9)
    np.testing.assert_allclose(table.columns["displacement"][-1], 390e-6)
    np.testing.assert_allclose(table.columns["force"][-1], 0.3e-3 * 39**1.5, rtol=1e-4)
    assert any("the unit of force (" in note for note in table.notes)


@pytest.mark.parametrize(
    "said",
    [
        "force: maximum force, N",
        "force: lateral force, N",
        "force: fitted force in N",
        "force: normal force per length, N/mm",
        "force: times 10, N",
        "force: N or mN, see below, kN, N",
        "force: load cell of 10 N, class 0.5",
        "force: setpoint, N",
        "force: range of the cell (N), see the sheet",
        "load cell: capacity, N",
    ],
)
def test_a_line_of_another_force_or_of_several_units_gives_none(tmp_path: Path, said: str) -> None:
    with pytest.raises(calib.InputError, match='column "force"'):
        _read(tmp_path, f"# {said}", "time (s),displacement (um),force")


def test_a_line_that_says_another_unit_than_the_header_is_asked_about(tmp_path: Path) -> None:
    with pytest.raises(calib.InputError, match='has the unit "N" and "mN" is declared in line 1'):
        _read(tmp_path, "# force: normal force, mN", "time (s),displacement (um),force (N)")


def test_what_a_line_says_of_a_change_of_capacitance_is_no_unit_of_one(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    rows = [f"{0.1 * i:.1f},{97.0 + 0.01 * i:.3f}" for i in range(40)]
    for said in ("change from baseline, pF", "relative to the value at rest, in pF"):
        path.write_text("\n".join([f"# cap: {said}", "time (s),cap", *rows, ""]))
        with pytest.raises(calib.InputError, match=f'no capacitance column among .*"{said.split(",")[0]}'):
            calib.read_lab_file(path)
    path.write_text("\n".join(["# cap: parallel capacitance at 1 kHz, pF", "time (s),cap", *rows, ""]))
    np.testing.assert_allclose(calib.read_lab_file(path).columns["capacitance"][0], 97e-12)


@pytest.mark.parametrize(
    "above",
    [
        ["# force in mN, displacement in um, time in s"],
        ["Force in mN, displacement in µm, time in s"],
        ["# force: mN, displacement: um, time: s"],
        ["# force in mN, displacement in um, time in s", "# press 4, ball 6 mm"],
    ],
)
@pytest.mark.parametrize("header", ["time,displacement,force", "t,disp,force", "time,disp (um),force"])
def test_a_sentence_of_quantities_and_units_above_the_names_is_no_header(tmp_path: Path, above: list[str], header: str) -> None:
    table = _read(tmp_path, *above, header)
    np.testing.assert_allclose(table.columns["displacement"][-1], 390e-6)
    np.testing.assert_allclose(table.columns["force"][-1], 0.3e-3 * 39**1.5, rtol=1e-4)
    assert any("line 1 says the unit of force (mN)" in note for note in table.notes)


def test_such_a_line_over_no_names_is_the_header(tmp_path: Path) -> None:
    table = _read(tmp_path, "# time in s,displacement in um,force in mN")
    np.testing.assert_allclose(table.columns["force"][-1], 0.3e-3 * 39**1.5, rtol=1e-4)


def test_such_a_line_over_names_with_other_units_or_none_that_are_understood_is_asked_about(tmp_path: Path) -> None:
    for header in ("time,displacement,force (N)", "a,b,c"):
        with pytest.raises(calib.InputError):
            _read(tmp_path, "# force in mN, displacement in um, time in s", header)
