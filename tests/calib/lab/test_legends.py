"""Lines that say what columns of bare names are, beside their header, are read as that with a note, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 40
DEPTH = [round(0.0113 * i, 4) for i in range(N)]
FORCE = [round(0.0021 * i * i, 4) for i in range(N)]
TIMES = [f"{0.1 * i:.1f}" for i in range(N)]


def read(folder: Path, *head: str, mark: str = ",", micro: bool = False, reading: Reading | None = None) -> LabTable:
    factor = 1000 if micro else 1
    rows = [mark.join((t, f"{factor * x:.4f}", f"{factor * f:.4f}")) for t, x, f in zip(TIMES, DEPTH, FORCE, strict=True)]
    path = folder / "lab.txt"
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def is_press(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"], [float(t) for t in TIMES], atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * np.array(DEPTH), atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)


@pytest.mark.parametrize(
    "head",
    [
        ("# t: time [s]", "# F: force [N]", "# s: displacement [mm]", "t,s,F"),
        ("# 1 | time | s", "# 2 | displacement | mm", "# 3 | force | N", "t,s,F"),
        ("# t - time, s", "# x - displacement, mm", "# F - force, N", "t,x,F"),
        ("t = time (s), F = force (N), d = travel (mm)", "t,d,F"),
        ("Column,Quantity,Unit", "1,time,s", "2,displacement,mm", "3,force,N", "", "t,s,F"),
        ("Symbol,Meaning,Unit", "t,time,s", "s,displacement,mm", "F,force,N", "", "t,s,F"),
        ("Column,Unit", "t,s", "s,mm", "F,N", "", "t,s,F"),
        ("# t: Zeit [s]", "# s: Weg [mm]", "# F: Kraft [N]", "t,s,F"),
        ("% t [s]; s [mm]; F [N]", "t,s,F"),
        ("# column 1: t, time in s", "# column 2: s, displacement in mm", "# column 3: F, force in N", "t,s,F"),
        ("t,s,F", "# t: time [s]", "# s: displacement [mm]", "# F: force [N]"),
        ("# a: temps (s)", "# b: enfoncement (mm)", "# c: effort (N)", "a,b,c"),
        ("# F: normal force of the load cell, in N", "# d: travel of the ball, in mm", "# t: time since start, in s", "t,d,F"),
        ("# x - displacement, mm", "Time (s),x,Force (N)"),
        ("# t   time           s", "# s   displacement   mm", "# F   force          N", "t,s,F"),
        ("# t [s] - time", "# s [mm] - displacement", "# F [N] - force", "t,s,F"),
        ("# time is t (s), displacement is s (mm), force is F (N)", "t,s,F"),
        ("# `F`: **force** (N)", "# `s`: **displacement** (mm)", "# `t`: **time** (s)", "t,s,F"),
        ("| symbol | meaning | unit |", "|---|---|---|", "| t | time | s |", "| d | depth | mm |", "| F | load | N |", "t,d,F"),
        ("# t is time in seconds", "# s is displacement in millimetres", "# F is force in newtons", "t,s,F"),
        ("# units: t=s s=mm F=N", "t,s,F"),
        ("# F: force [N], compression positive", "# s: displacement [mm]", "# t: time [s]", "t,s,F"),
    ],
)
def test_lines_that_say_each_column_are_its_name_and_unit_with_a_note(tmp_path: Path, head: tuple[str, ...]) -> None:
    table = read(tmp_path, *head)
    is_press(table)
    assert any("what the columns of line" in note for note in table.notes)


@pytest.mark.parametrize("head", ["# t in s, s in um, F in mN", "# t [s]  s [um]  F [mN]", "# units: s, um, mN"])
def test_one_line_with_the_unit_of_each_symbol_is_read(tmp_path: Path, head: str) -> None:
    is_press(read(tmp_path, head, "t,s,F", micro=True))


def test_a_symbol_that_is_a_unit_has_the_one_that_a_line_says(tmp_path: Path) -> None:
    is_press(read(tmp_path, "# N: force, normal", "# Units: N in mN, s in um, t in s", "t,s,N", micro=True))


@pytest.mark.parametrize("mark", ["\t", " ", ";"])
def test_a_legend_stands_above_any_delimiter(tmp_path: Path, mark: str) -> None:
    is_press(read(tmp_path, "# t: time [s]", "# F: force [N]", "# s: displacement [mm]", f"t{mark}s{mark}F", mark=mark))


@pytest.mark.parametrize("line", ["# All data in SI units (s, m, N)", "# SI units throughout", "# Alle Werte in SI-Einheiten"])
def test_units_of_the_si_are_taken_for_columns_without_one(tmp_path: Path, line: str) -> None:
    rows = [f"{t},{1e-3 * x:.7f},{f:.4f}" for t, x, f in zip(TIMES, DEPTH, FORCE, strict=True)]
    for names in ("t,s,F", "time,displacement,force"):
        (path := tmp_path / "si.csv").write_text("\n".join([line, names, *rows]) + "\n", encoding="utf-8")
        is_press(read_lab_file(path))


@pytest.mark.parametrize(
    "head",
    [
        ("# All data in SI units (s, m, N)", "time (s),displacement (mm),force (N)"),
        ("# s: force [N]", "t (s),s (mm),F (N)"),
        ("# F: force [mN]", "t (s),s (mm),F (N)"),
    ],
)
def test_a_line_that_contradicts_the_header_is_refused_until_a_unit_is_said(tmp_path: Path, head: tuple[str, str]) -> None:
    with pytest.raises(InputError):
        read(tmp_path, *head)
    is_press(read(tmp_path, *head, reading=Reading(units={"displacement": "mm", "force": "N"})))


def test_symbols_that_are_said_to_be_each_other_are_asked_about(tmp_path: Path) -> None:
    head = ("# F: displacement [mm]", "# s: force [N]", "t (s),s,F")
    with pytest.raises(InputError, match="changed places") as caught:
        read(tmp_path, *head)
    assert "--columns displacement=s --units displacement=mm --columns force=F --units force=N" in str(caught.value)
    columns, units = {"displacement": "s", "force": "F"}, {"displacement": "mm", "force": "N"}
    is_press(read(tmp_path, *head, reading=Reading(columns=columns, units=units)))


@pytest.mark.parametrize(
    "head",
    [
        ("# t: time [s]", "# F: force [N]", "# F: force [mN]", "# s: displacement [mm]", "t,s,F"),
        ("# t: time [s]", "# F: max force [N]", "# s: displacement [mm]", "t,s,F"),
        ("# t: time [s]", "# F: force [N]", "# s: strain [mm]", "t,s,F"),
        ("# F: force [mN]", "t,s,F", "s,mm,N"),
        ("# All values in SI units", "time,displacement,force"),
    ],
)
def test_what_contradicts_itself_or_is_no_record_is_refused(tmp_path: Path, head: tuple[str, ...]) -> None:
    with pytest.raises(InputError):
        read(tmp_path, *head)


@pytest.mark.parametrize("said", ["lateral position, mm", "thickness of the sample, mm", "strain, mm", "max. depth, mm"])
def test_what_is_said_to_be_another_thing_is_not_taken_for_its_symbol(tmp_path: Path, said: str) -> None:
    with pytest.raises(InputError, match="no displacement column"):
        read(tmp_path, f"# d: {said}", "# F: force [N]", "# t: time [s]", "t,d,F")


@pytest.mark.parametrize("said", ["force x10 [N]", "force [N], gain 10", "force [10 mN]"])
def test_a_factor_in_a_legend_is_not_lost(tmp_path: Path, said: str) -> None:
    with pytest.raises(InputError, match='column "F"'):
        read(tmp_path, f"# F: {said}", "# s: displacement [mm]", "# t: time [s]", "t,s,F")


def test_two_lines_of_different_units_are_settled_by_one_that_is_said(tmp_path: Path) -> None:
    head = ("# t: time [s]", "# F: force [N]", "# F: force [mN]", "# s: displacement [mm]", "t,s,F")
    with pytest.raises(InputError, match="--units force=N or --units force=mN"):
        read(tmp_path, *head)
    is_press(read(tmp_path, *head, reading=Reading(units={"force": "N"})))


def test_a_column_may_be_named_as_it_is_written(tmp_path: Path) -> None:
    head = ("# t: time [s]", "# F: force [N]", "# s: displacement [mm]", "t,s,F")
    is_press(read(tmp_path, *head, reading=Reading(columns={"force": "F", "displacement": "2"})))


@pytest.mark.parametrize("said", ["capacitance, series, pF", "series capacitance [pF]"])
def test_how_a_capacitance_is_taken_is_not_lost_in_a_legend(tmp_path: Path, said: str) -> None:
    rows = [f"{t},{97.3 + 0.01 * i:.4f},0.1000" for i, t in enumerate(TIMES)]
    lines = [f"# C: {said}", "# D: dissipation factor", "# t: time, s", "t,C,D", *rows]
    (path := tmp_path / "lcr.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    expected = [1e-12 * (97.3 + 0.01 * i) / 1.01 for i in range(N)]
    np.testing.assert_allclose(read_lab_file(path).columns["capacitance"], expected, rtol=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "Kompressive Ausdehnung",
        "Druckausdehnung",
        "Extension en compression",
        "Desplazamiento compresivo",
        "Estensione a compressione",
        "Extensão de compressão",
        "压缩扩展",
        "圧縮伸び",
    ],
)
def test_extensions_under_compression_are_displacements_beside_another_length(tmp_path: Path, name: str) -> None:
    rows = [f"{t},{x},{f},{x / 2:.4f}" for t, x, f in zip(TIMES, DEPTH, FORCE, strict=True)]
    (path := tmp_path / "press.csv").write_text("\n".join([f"Time (s),{name} (mm),Load (N),quux (mm)", *rows, ""]), "utf-8")
    is_press(read_lab_file(path))


@pytest.mark.parametrize(
    ("set_to", "measured"),
    [
        ("Axial Command", "Axial Feedback"),
        ("Position SP", "Position PV"),
        ("Setpoint position", "Process value position"),
        ("Consigne de position", "Position réelle"),
        ("Consigna posición", "Posición real"),
        ("Position_cmd", "Position_fbk"),
        ("Achse Sollwert", "Achse Istwert"),
        ("SP", "PV"),
    ],
)
def test_what_was_measured_is_read_beside_what_was_commanded(tmp_path: Path, set_to: str, measured: str) -> None:
    rows = [f"{t},{0.011 * i:.3f},{x},{f}" for i, (t, x, f) in enumerate(zip(TIMES, DEPTH, FORCE, strict=True))]
    (path := tmp_path / "press.csv").write_text(
        "\n".join([f"Time (s),{set_to} (mm),{measured} (mm),Load (N)", *rows, ""]), "utf-8"
    )
    table = read_lab_file(path)
    is_press(table)
    assert any(set_to in str(unread) for unread in table.unread)


def test_names_that_a_legend_explains_are_not_said_to_have_units_beside_them(tmp_path: Path) -> None:
    table = read(tmp_path, "# t: time [s]", "# z: depth [mm]", "# F: force [N]", "t z F", mark=" ")
    is_press(table)
    assert not any("cell of its own" in note for note in table.notes)
    table = read(tmp_path, "Time;s;Depth;mm;Force;N", mark=";")
    assert any("in line 1 the unit of each column stands in a cell of its own" in note for note in table.notes)
