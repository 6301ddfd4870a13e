"""A column of a name in no language that is known is read, with a note, where it alone has a unit of a quantity and fits it."""

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
CAPACITANCE = 97.5 + 0.4 * FORCE


def read(tmp_path: Path, header: str, *columns: np.ndarray) -> LabTable:
    sep = ";" if ";" in header else ","
    rows = [sep.join(f"{column[k]:.4f}" for column in columns) for k in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_lab_file(path, Reading())


@pytest.mark.parametrize(
    "header",
    [
        "Tyd (s),Verplasing (mm),Krag (N),Kapasitansie (pF)",
        "Tyd;Verplasing;Krag;Kapasitansie\ns;mm;N;pF",
        "Tyd;Verplasing;Krag;Kapasitansie\n(s);(mm);(N);(pF)",
        "s,mm,N,pF",
        "Amser_s,Dadleoliad_mm,Grym_N,Cynhwysiant_pF",
    ],
)
def test_each_alone_in_its_unit_is_read_with_a_note(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE, CAPACITANCE)
    assert np.allclose(table.columns["time"], TIME, atol=1e-4)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)
    assert sum("the only column in" in note for note in table.notes) >= 3


def test_a_name_that_is_not_understood_among_others_that_are(tmp_path: Path) -> None:
    table = read(tmp_path, "Tempo (s);Extensão de compressão (mm);Carga de compressão (N)", TIME, DEPTH, FORCE)
    assert any(
        'force is taken from "Carga de compressão (N)", the only column in N' in note and "--columns force=none" in note
        for note in table.notes
    )


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Extension (mm),Krag (N),Wrywing (N)",  # which of two
        "Time (s),Extension (mm),Load,Krag (N)",  # another is the force
        "Time (s),Extension (mm),Krag max (N),A",
        "Time (s),Extension (mm),Krag 2 (N),A",  # one of several
        "Time (s),Extension (mm),offset krag (N),A",
    ],
)
def test_what_may_be_another_thing_is_not_taken(tmp_path: Path, header: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, header, TIME, DEPTH, FORCE, FORCE / 3)


def test_a_column_that_does_not_go_with_the_others_is_not_taken(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).normal(size=N)
    for odd in (noise, np.full(N, 12.0)):
        with pytest.raises(InputError, match="no force column"):
            read(tmp_path, "Time (s),Extension (mm),Krag (N)", TIME, DEPTH, odd)


def test_a_time_of_unknown_name_that_falls_is_none(tmp_path: Path) -> None:
    table = read(tmp_path, "Tyd (s),Extension (mm),Load (N)", np.concatenate([TIME[:30], TIME[:30]]), DEPTH, FORCE)
    assert "time" not in table.columns


def test_every_reading_with_its_unit_behind_it(tmp_path: Path) -> None:
    rows = [f"{t:.1f} s\t{d:.4f} mm\t{f:.4f} N" for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["Time\tDisplacement\tForce", *rows]) + "\n")
    table = read_lab_file(path, Reading())
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert table.reasons == ("",) * N


def test_a_few_results_beside_a_table_cost_it_no_units(tmp_path: Path) -> None:
    rows = [f"{t:.1f};{d:.4f};{f:.4f};;;" for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Tempo;Deslocamento;Força;;Média;2.31", "s;mm;N;;Máx;4.87", *rows]) + "\n")
    table = read_lab_file(path, Reading())
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert any("Máx" in unread.reason for unread in table.unread)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *((name, "N") for name in ("Kraftvorgabe", "Kraftsollwert", "Zielkraft", "ForceSetpoint", "заданная нагрузка")),
        *((name, "N") for name in ("Forza nominale", "Kraft Grenzwert", "Nennkraft", "Kraftgrenzwert", "Fuerza límite")),
        *(
            (name, "N")
            for name in ("Shear force", "Lateral force", "Reibkraft", "Friction", "Querkraft", "Haltekraft", "Side load")
        ),
        *(
            (name, "N")
            for name in ("Clamping force", "Effort de cisaillement", "Fuerza de corte", "Siła tarcia", "摩擦力", "log F")
        ),
    ],
)
def test_what_was_commanded_or_is_another_force_is_not_taken(tmp_path: Path, name: str, unit: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, f"Time (s),Extension (mm),{name} ({unit})", TIME, DEPTH, FORCE)


@pytest.mark.parametrize(
    "name",
    [
        *(
            "Wegvorgabe",
            "Zielposition",
            "Führungsgröße Weg",
            "TargetPosition",
            "Lateral displacement",
            "Probendicke",
            "épaisseur",
        ),
        *("Thickness", "Kugeldurchmesser", "试样厚度", "Grubość", "Slip", "Roughness"),
    ],
)
def test_what_was_commanded_or_is_another_length_is_not_taken(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),{name} (mm),Force (N),Cp (pF)", TIME, DEPTH, FORCE, CAPACITANCE)
    assert "displacement" not in table.columns
    commanded = ("vorgabe", "Ziel", "Führung", "Target")
    assert any("was commanded" in r.reason for r in table.unread) == any(word in name for word in commanded)


@pytest.mark.parametrize("name", ["Cable capacitance", "Kabelkapazität X", "Stray", "ёмкость кабеля", "寄生电容"])
def test_another_capacitance_is_not_taken(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Extension (mm),Force (N),{name} (pF)", TIME, DEPTH, FORCE, CAPACITANCE)
    assert "capacitance" not in table.columns


@pytest.mark.parametrize("names", [("/press/displacement_mm", "/press/force_N"), ("Stage displacement/mm", "Reaction force/N")])
def test_a_path_of_a_topic_and_a_unit_behind_a_stroke_are_read_with_a_note(tmp_path: Path, names: tuple[str, str]) -> None:
    table = read(tmp_path, f"Time/s,{names[0]},{names[1]},Cap/pF", TIME, DEPTH, FORCE, CAPACITANCE)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any(names[0] in note and "the only column in mm" in note for note in table.notes)


@pytest.mark.parametrize(
    "name", ["Rate N/mm", "Counts/mm", "Pulses/mm", "Force/mm", "/press/target_mm", "/press/max_mm", "/press/thickness_mm"]
)
def test_what_is_counted_or_commanded_per_millimetre_is_no_displacement(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time/s,{name},Force/N,Cap/pF", TIME, DEPTH, FORCE, CAPACITANCE)
    assert "displacement" not in table.columns


@pytest.mark.parametrize("name", ["Reaction force/N", "Reaction force in gram", "Reaktionskraft (N)"])
def test_a_reaction_is_a_force(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time/s,Depth/mm,{name},Cap/pF", TIME, DEPTH, FORCE, CAPACITANCE)
    np.testing.assert_allclose(table.columns["force"], FORCE * (9.80665e-3 if "gram" in name else 1.0), atol=1e-4)


@pytest.mark.parametrize(
    "names",
    [
        ("Querhauptweg (mm)", "Cx (pF)"),
        ("横梁升降 (mm)", "Cx (pF)"),
        ("PI stage position (mm)", "Kapasitansie (pF)"),
        ("Pd (mm)", "Kap X (pF)"),
    ],
)
def test_a_crosshead_in_other_words_and_symbols_of_instruments_are_taken(tmp_path: Path, names: tuple[str, str]) -> None:
    table = read(tmp_path, f"Time (s),{names[0]},Force (N),{names[1]}", TIME, DEPTH, FORCE, CAPACITANCE)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert any(names[0] in note and "the only column in mm" in note for note in table.notes)


@pytest.mark.parametrize("path", ["dev3456/imps/0/sample.param1", "/dev1/demods/2/sample.x", "rig/adc/3/c"])
def test_the_path_of_a_signal_says_nothing_and_holds_no_factor(tmp_path: Path, path: str) -> None:
    rows = [f"{t:.1f},{c * 1e-12:.6e},{1e6 + f:.3f}" for t, c, f in zip(TIME, CAPACITANCE, FORCE, strict=True)]
    file = tmp_path / "lab.csv"
    file.write_text("\n".join([f"Time (s),{path} (F),{path}b (Ohm)", *rows, ""]))
    for reading in (Reading(), Reading(columns={"capacitance": "2"})):
        table = read_lab_file(file, reading)
        assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, rtol=1e-6)
    assert any("the only column in F" in note for note in read_lab_file(file, Reading()).notes)


@pytest.mark.parametrize("names", [("dev1/imps/0/a", "dev1/imps/1/a"), ("dev1/imps/0/max", "T"), ("C/10", "T")])
def test_two_paths_in_one_unit_and_what_is_computed_are_asked_about(tmp_path: Path, names: tuple[str, str]) -> None:
    file = tmp_path / "lab.csv"
    rows = [f"{t:.1f},{c:.4f},{c + 1:.4f}" for t, c in zip(TIME, CAPACITANCE, strict=True)]
    units = ("pF", "pF" if names[1] != "T" else "K")
    file.write_text("\n".join([f"Time (s),{names[0]} ({units[0]}),{names[1]} ({units[1]})", *rows, ""]))
    with pytest.raises(InputError):
        read_lab_file(file, Reading())


@pytest.mark.parametrize(
    "header",
    [
        "t (s),u (mm),W [N]",
        "T (s),w [mm],L (N)",
        "t_s,u_mm,P_N",
        "t (s),u (mm),K (N)",
        "t (s),u (mm),Ld (N)",
        "t (s),u (mm),Force high range (N)",
        "t;u;R\ns;mm;N",
        "% t (s),u (mm),F (N)",
    ],
)
def test_a_letter_alone_in_a_unit_of_length_or_force_is_read_with_a_note(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("the only column in" in note for note in table.notes)


@pytest.mark.parametrize("letter", ["t (mm)", "r (mm)", "a (mm)", "l (mm)", "y (mm)", "e (mm)"])
def test_a_letter_for_a_dimension_or_an_axis_is_no_displacement(tmp_path: Path, letter: str) -> None:
    with pytest.raises(InputError, match="no displacement column"):
        read(tmp_path, f"Time (s),{letter},Load (N)", TIME, DEPTH, FORCE)


@pytest.mark.parametrize("letter", ["T (N)", "V (N)", "Q (N)", "x (N)"])
def test_a_letter_for_a_force_across_is_no_force(tmp_path: Path, letter: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, f"Time (s),Extension (mm),{letter}", TIME, DEPTH, FORCE)


def test_a_letter_that_stands_still_or_is_one_of_two_is_no_displacement(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no displacement column"):
        read(tmp_path, "t (s),w (mm),F (N)", TIME, np.full(N, 2.0), FORCE)
    with pytest.raises(InputError, match="no displacement column"):
        read(tmp_path, "t (s),u (mm),v (mm),F (N)", TIME, DEPTH, 0.4 * DEPTH, FORCE)


@pytest.mark.parametrize("name", ["dCp", "dCap", "dcp", "dKap", "Kap - Ref", "Cmeas - Cref", "Cmeas-Cref", "ΔCp"])
def test_a_change_or_a_difference_of_capacitances_is_not_taken(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Extension (mm),Force (N),{name} (pF)", TIME, DEPTH, FORCE, CAPACITANCE - 97)
    assert "capacitance" not in table.columns
    assert any(name in row.what for row in table.unread)


@pytest.mark.parametrize("name", ["dForce", "dKraft", "dLoad"])
def test_a_change_of_a_force_is_not_taken(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Extension (mm),{name} (N),Cp (pF)", TIME, DEPTH, FORCE, CAPACITANCE)
    assert "force" not in table.columns


@pytest.mark.parametrize("name", ["druk", "Kap-Wert", "dadleoliad"])
def test_a_word_that_begins_with_d_or_has_a_hyphen_is_no_change(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Extension (mm),Force (N),{name} (pF)", TIME, DEPTH, FORCE, CAPACITANCE)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)


@pytest.mark.parametrize(
    "name",
    [
        "Cp - 90 (pF)",
        "Capacitance - 90 pF",
        "C-90 (pF)",
        "C (pF) - 90",
        "Cp −90 [pF]",
        "Cp measured - 90 (pF)",
        "Cp_-_90_pF",
        "Cp - 5 (pF)",
    ],
)
def test_a_capacitance_of_which_a_number_was_taken_off_is_asked_about(tmp_path: Path, name: str) -> None:
    header = f"Time (s),Extension (mm),Force (N),{name}"
    with pytest.raises(InputError, match=r"taken off it is a difference and no capacitance, to which .* has to be added again"):
        read(tmp_path, header, TIME, DEPTH, FORCE, CAPACITANCE - 90)
    table = read_lab_file(tmp_path / "lab.csv", Reading(columns={"capacitance": name}))
    assert "capacitance" in table.columns


@pytest.mark.parametrize(
    ("force", "capacitance"),
    [
        ("Load-2 (N)", "C-1 (pF)"),
        ("Force - 12 (N)", "C-01 (pF)"),
        ("Force-10 (N)", "Cap-2 (pF)"),
        ("Load 12 (N)", "Cp-1kHz (pF)"),
    ],
)
def test_the_number_of_a_channel_a_model_or_a_force_is_not_taken_off(tmp_path: Path, force: str, capacitance: str) -> None:
    table = read(tmp_path, f"Time (s),Extension (mm),{force},{capacitance}", TIME, DEPTH, FORCE, CAPACITANCE)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "said", ["# Columns: Time (s),Depth (mm),Force (N),Cp (pF)", "# Time (s),Depth (mm),Force (N),Cp (pF)"]
)
@pytest.mark.parametrize("between", ["", "# License: CC BY 4.0\n#\n", "# 1, 2, 3 refer to samples in Table 2\n"])
def test_a_comment_that_says_the_header_before_it_comes_is_none(tmp_path: Path, said: str, between: str) -> None:
    header = f"# A record\n{said}\n{between}Time (s),Depth (mm),Force (N),Cp (pF)"
    table = read(tmp_path, header, TIME, DEPTH, FORCE, CAPACITANCE)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    assert len(table.columns["time"]) == N


def test_a_header_that_says_other_units_than_the_comment_above_it_is_asked_about(tmp_path: Path) -> None:
    header = "# Columns: Time (s),Depth (mm),Force (N)\n# CC BY\nTime (s),Depth (mm),Force (mN)"
    with pytest.raises(InputError):
        read(tmp_path, header, TIME, DEPTH, FORCE)


@pytest.mark.parametrize(
    "header",
    [
        "Zeit [s],s_Kugel [mm],F_Kugel [N],C_Sensor [pF]",
        "Time (s),u_ball (mm),F_ball (N),C_sensor (pF)",
        "Time (s),z_robot (mm),F_robot (N),Cp (pF)",
        "Time (s),w_plunger_mm,P_plunger_N,Cp_pF",
        "Time (s),s-Stempel/mm,F-Stempel/N,Cp (pF)",
        "Time (s),z ball tip (mm),F ball tip (N),Cp (pF)",
    ],
)
@pytest.mark.parametrize("capacitance", [True, False])
def test_a_letter_of_formulas_before_a_word_is_its_quantity_with_a_note(
    tmp_path: Path, header: str, *, capacitance: bool
) -> None:
    columns = (TIME, DEPTH, FORCE, CAPACITANCE)[: 4 if capacitance else 3]
    table = read(tmp_path, header if capacitance else header.rpartition(",")[0], *columns)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert sum("the only column in" in note for note in table.notes) == 2


@pytest.mark.parametrize(
    "name",
    [
        "d_ball (mm)",
        "h_ball (mm)",
        "x_robot (mm)",
        "r_ball (mm)",
        "u_err (mm)",
        "s_lateral (mm)",
        "z_ref (mm)",
        "u_ball (m)",
    ],
)
def test_a_size_of_a_ball_or_another_axis_is_no_place(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no displacement column"):
        read(tmp_path, f"Time (s),{name},F_ball (N),z_two (mm)", TIME, DEPTH, FORCE, DEPTH[::-1])


@pytest.mark.parametrize("name", ["F_friction (N)", "F_tang (N)", "F_max (N)", "F_soll (N)", "F_norm (N)"])
def test_another_force_behind_a_letter_is_not_taken(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no force column"):
        read(tmp_path, f"Time (s),u_ball (mm),{name}", TIME, DEPTH, FORCE)


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("Time (s),WA/10 Displacement [mm],U9C Force [N],Cp (pF)", ['--columns "displacement=WA/10 Displacement [mm]"']),
        ("t (s),x2b (mm),U9x (N),Cp (pF)", ['--columns "displacement=x2b (mm)"', '--columns "force=U9x (N)"']),
        ("t (s),z,F,Cp (pF)", ["--columns displacement=z --units displacement=...", "--columns force=F --units force=..."]),
    ],
)
def test_a_capacitance_read_without_the_press_beside_it_says_by_which_options_that_is_read(
    tmp_path: Path, header: str, said: list[str]
) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE, CAPACITANCE)
    told = [note for note in table.notes if " is read; " in note]
    assert [note.partition("as it was measured, ")[2] for note in told] == said


@pytest.mark.parametrize(
    "header", ["Time (s),Cp (pF),x2b (mm)", "Time (s),Cp (pF),Temperature (C)", "Time (s),Cp (pF),Bias (V)"]
)
def test_of_a_column_that_stands_still_or_is_in_another_unit_nothing_is_said(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, TIME, CAPACITANCE, np.full(N, 3.0) if "mm" in header else FORCE)
    assert not any(" is read; " in note for note in table.notes)


@pytest.mark.parametrize(
    "header",
    [
        "Time,s  Load,N  Ext,mm",
        "Tyd|s  Krag|N  Verplasing|mm",
        "Time:s  Load:N  Reise:mm",
        '"Time,s","Load,N","Ext,mm"',
        "Elapsed (s),FUTEK LSB200 (N),Stage M-406 (mm)",
        "Zeit [s],Krag U9C [N],Tisch M-227.10 [mm]",
        "t_s,F_N,Tisch LK-H050_mm",
    ],
)
def test_a_unit_behind_a_mark_and_a_model_beside_a_word_leave_a_column_the_only_one_in_its_unit(
    tmp_path: Path, header: str
) -> None:
    sep = "  " if "  " in header else ","
    rows = [sep.join(f"{column[k]:.4f}" for column in (TIME, FORCE, DEPTH)) for k in range(N)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join([header, *rows, ""]))
    table = read_lab_file(path, Reading())
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("displacement is taken from" in note and "the only column in mm" in note for note in table.notes)


@pytest.mark.parametrize(
    "name",
    [
        "Lateral M-406 (mm)",
        "Target M-406 (mm)",
        "Tisch 2 (mm)",
        "Tisch S-101 (mm)",
        "Thickness,mm",
        "Rate,N/mm",
        "Verplasing max,mm",
    ],
)
def test_a_specimen_another_length_or_a_rate_is_no_displacement(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no displacement column"):
        read(tmp_path, f"Time (s);Load (N);{name}", TIME, FORCE, DEPTH)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Representation Parameter 2", "F"),
        ("Capacitance C1", "F"),
        ("Param 2", "pF"),
        ("Trace1", "nF"),
        ("Sensor element 4", "fF"),
    ],
)
def test_a_numbered_value_of_a_meter_alone_in_farads_is_read_with_a_note(tmp_path: Path, name: str, unit: str) -> None:
    size = {"F": 1e-12, "pF": 1.0, "nF": 1e-3, "fF": 1e3}[unit]
    rows = [f"{t:.1f},{c * size:.6e},{1e6 + t:.3f}" for t, c in zip(TIME, CAPACITANCE, strict=True)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"Time (s),{name} ({unit}),{name[:-1]}3 (Ohm)", *rows, ""]))
    table = read_lab_file(path, Reading())
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, rtol=1e-5)
    assert any("capacitance is taken from" in note and f"the only column in {unit}" in note for note in table.notes)


def test_a_numbered_series_capacitance_stays_one(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Series capacitance C1 (pF),D", TIME, CAPACITANCE, 0.1 + 0 * TIME)
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE / 1.01, rtol=1e-5)


@pytest.mark.parametrize(
    "name",
    [
        "Capacitance C0 (F)",
        "Stray capacitance 1 (F)",
        "Range 2 (F)",
        "Cable C1 (F)",
        "Ref 1 (F)",
        "Delta Cap 1 (F)",
        "Temperature 2 (F)",
        "Force 1 (F)",
    ],
)
def test_what_is_numbered_and_no_capacitance_of_a_sample_is_not_taken(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, f"Time (s),{name}", TIME, CAPACITANCE)


def test_a_numbered_temperature_in_fahrenheit_beside_a_press_is_passed_by(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Extension (mm),Force (N),Oven 2 (F)", TIME, DEPTH, FORCE, 70 + FORCE)
    assert "capacitance" not in table.columns
    assert any("Oven 2 (F)" in row.what for row in table.unread)


def test_a_numbered_value_beside_another_capacitance_is_not_taken(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Cp (pF),Parameter 2 (pF)", TIME, CAPACITANCE, 2 * CAPACITANCE)
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)
    with pytest.raises(InputError, match="no capacitance column"):
        read(tmp_path, "Time (s),Parameter 1 (pF),Parameter 2 (pF)", TIME, CAPACITANCE, 2 * CAPACITANCE)


@pytest.mark.parametrize("names", ["Primary (Cp),Unit,Secondary (D)", "Param 1: Cp,Unit,Param 2: D", "Cp,Unit,D"])
def test_a_value_of_a_meter_is_what_its_brackets_say_and_its_unit_stands_in_each_row(tmp_path: Path, names: str) -> None:
    rows = [f"{t:.1f},{c * 1e-12:.5e},F,0.0012" for t, c in zip(TIME, CAPACITANCE, strict=True)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"Time (s),{names}", *rows, ""]))
    table = read_lab_file(path, Reading())
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, rtol=1e-4)
    np.testing.assert_allclose(table.columns["dissipation"], 0.0012)


def test_a_series_value_of_a_meter_is_one_and_a_resistance_is_none(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Primary (Cs) (pF),Secondary (D)", TIME, CAPACITANCE, 0.1 + 0 * TIME)
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE / 1.01, rtol=1e-5)
    with pytest.raises(InputError):
        read(tmp_path, "Time (s),Primary (Rp)", TIME, CAPACITANCE)
