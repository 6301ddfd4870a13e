"""Words in a header that leave a column what it is: in brackets, in a line of remarks below units, of a mean of readings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.vocabulary import understand

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))
CAPACITANCE = 97.5 + 0.4 * FORCE


def read(tmp_path: Path, header: str, *columns: np.ndarray) -> LabTable:
    rows = [";".join(f"{column[k]:.4f}" for column in columns) for k in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, Reading())


@pytest.mark.parametrize(
    "name",
    ["Capacitance (mean of 8) (pF)", "Cp mean of 8 (pF)", "Cp (avg of 16 samples) [pF]", "Kapazität (Mittelwert aus 4) (pF)"],
)
def test_a_mean_of_so_many_readings_is_read_with_a_note(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s);{name}", TIME, CAPACITANCE)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)
    assert any("holds a mean of readings in each row" in note for note in table.notes)


@pytest.mark.parametrize(
    "name", ["Cp (mean of 8 specimens) (pF)", "Cp (max of 8) (pF)", "Cp (mean of max) (pF)", "Cp (mean) (pF)"]
)
def test_a_mean_of_specimens_and_another_statistic_are_no_record(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no capacitance column"):
        read(tmp_path, f"Time (s);{name}", TIME, CAPACITANCE)


def test_a_mean_of_readings_gives_way_to_the_readings(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s);Cp (pF);Cp (mean of 8) (pF)", TIME, CAPACITANCE, CAPACITANCE + 0.1)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)


@pytest.mark.parametrize(
    "name", ["Capacitance Cp (pF) @ 1 kHz, 1 V", "Capacitance Cp (pF)", "Capacitance (Cp) (pF)", "C parallel (pF)"]
)
def test_of_a_name_with_cp_in_it_nothing_is_said_to_be_untold(tmp_path: Path, name: str) -> None:
    assert not any("Cp or Cs" in note for note in read(tmp_path, f"Time (s);{name}", TIME, CAPACITANCE).notes)
    assert any("Cp or Cs" in note for note in read(tmp_path, "Time (s);Capacitance (pF)", TIME, CAPACITANCE).notes)


def test_a_row_of_units_in_the_chinese_of_taiwan_is_read(tmp_path: Path) -> None:
    table = read(tmp_path, "時間;位移;荷重\n秒;公釐;牛頓", TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)


@pytest.mark.parametrize(
    "header",
    [
        "Zeit (Systemzeit) [s];Weg (Traverse) [mm];Kraft (Kanal 1) [N]",
        "Time (UTC) [s];Displacement (motor) [mm];Force (S-beam) [N]",
        "Zeit (Messung) [s];Weg (Tauchspule) [mm];Kraft (DMS) [N]",
        "Zeit (relativ);Weg (Druck);Kraft (Messdose)\n(s);(mm);(N)",
    ],
)
def test_words_in_brackets_that_change_nothing_are_passed_by(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["time"], TIME, atol=1e-4)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("in its name is passed by" in note for note in table.notes)


@pytest.mark.parametrize(
    "name",
    [
        "Force (lateral) [N]",
        "Force (simulation) [N]",
        "Kraft (berechnet) [N]",
        "Force (setpoint) [N]",
        "Force (max) [N]",
        "Force (left) [N]",
        "Kraft (umgerechnet) [N]",
        "Kraft (Betrag) [N]",
        "Force (per finger) [N]",
        "Force (temperature) [N]",
        "Force (step) [N]",
        "Force (log) [N]",
        "Force (kN per V) [N]",
    ],
)
def test_words_in_brackets_that_may_change_a_column_are_not_passed_by(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, f"Time (s);Extension (mm);{name}", TIME, DEPTH, FORCE)


def test_words_in_brackets_are_not_passed_by_where_another_column_is_of_the_quantity_or_its_unit(tmp_path: Path) -> None:
    for other in ("Kraft (Messuhr) [N]", "Krag [N]", "Force (max) [N]"):
        with pytest.raises(InputError):
            read(tmp_path, f"Time (s);Extension (mm);Kraft (DMS) [N];{other}", TIME, DEPTH, FORCE, 0.3 * FORCE)


def test_words_in_brackets_are_not_passed_by_of_a_capacitance_or_of_what_does_not_fit(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read(tmp_path, "Time (s);Capacitance (Platte) [pF]", TIME, CAPACITANCE)
    noise = np.random.default_rng(3).normal(size=N)
    with pytest.raises(InputError, match="may be no force"):
        read(tmp_path, "Time (s);Extension (mm);Kraft (DMS) [N]", TIME, DEPTH, noise)


@pytest.mark.parametrize(
    "header",
    [
        "Point;Zeit;Weg;Kraft\n[-];[s];[mm];[N]\nSensor;intern;LVDT-25;KAP-S 10N",
        "Point;Time;Displacement;Force\n;s;mm;N\n;;Tester;Instron cell",
        "No;Time (s);Displacement (mm);Force (N)\n;Logger;Traverse;Messdose",
    ],
)
def test_a_line_of_remarks_below_names_and_units_is_left_out(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, 1.0 + np.arange(N), TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("comments on the columns" in what.reason for what in table.unread)


@pytest.mark.parametrize("serial", ["-;SN 0815;SN 4711", "E4980A;S/N 0815;SN 4711", "Instron 5943;SN 0815;ser no. 4711"])
def test_a_line_of_serial_numbers_and_instruments_below_the_units_is_left_out(tmp_path: Path, serial: str) -> None:
    table = read(tmp_path, f"1;2;3\nZeit;Weg;Kraft\ns;mm;N\n{serial}", TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("serial numbers" in what.reason for what in table.unread)


def test_other_words_beside_serial_numbers_are_refused(tmp_path: Path) -> None:
    for serial in ("SN 0815;SN 4711;max", "SN 0815;kN;SN 4711", "SN 0815;SN 4711;x10"):
        with pytest.raises(InputError):
            read(tmp_path, f"Zeit;Weg;Kraft\ns;mm;N\n{serial}", TIME, DEPTH, FORCE)


@pytest.mark.parametrize(
    ("unit", "factor"), [("Pikofarad", 1e-12), ("Picofarad", 1e-12), ("Nanofarad", 1e-9), ("Femtofarad", 1e-15)]
)
def test_units_of_a_capacitance_that_are_spelled_out_in_german_are_read(tmp_path: Path, unit: str, factor: float) -> None:
    table = read(tmp_path, f"Zeit in Sekunden;Kapazität in {unit}", TIME, CAPACITANCE * 1e-12 / factor * 1.0)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16 + 1e-4 * factor)


def test_the_micro_sign_of_dos_is_read_with_a_note(tmp_path: Path) -> None:
    path = tmp_path / "dos.csv"
    rows = [f"{TIME[k]:.2f};{1e3 * DEPTH[k]:.1f};{FORCE[k]:.3f}" for k in range(N)]
    path.write_bytes("\n".join(["Zeit [s];Weg [µm];Kraft [N]", *rows, ""]).encode("cp850"))
    table = read_lab_file(path, Reading())
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert any("read in cp850" in note for note in table.notes)


@pytest.mark.parametrize(
    "below",
    [
        "intern;Force;Traverse",  # another name
        "intern;Traverse;max",
        "intern;Traverse;x10",
        "intern;Traverse;kN",
        "intern;Traverse;(kN) Dose",
        "intern;thickness;Dose",
        "intern;Traverse;setpoint",
        "intern;Traverse;compression negative",
        "intern;Traverse;scaled",
    ],
)
def test_a_line_that_may_change_a_column_below_names_and_units_is_refused(tmp_path: Path, below: str) -> None:
    with pytest.raises(InputError, match="stands below the header"):
        read(tmp_path, f"Time (s);Displacement (mm);Force (N)\n{below}", TIME, DEPTH, FORCE)


def test_a_line_of_words_that_tell_two_forces_apart_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="stands below the header"):
        read(tmp_path, "Time (s);Displacement (mm);Force (N);Force (N)\nPC;LVDT;Dose;Stempel", TIME, DEPTH, FORCE, 0.5 * FORCE)


@pytest.mark.parametrize("blanks", ["  ", "\t"])
def test_names_and_numbers_apart_by_blanks_among_tabs_are_read(tmp_path: Path, blanks: str) -> None:
    path = tmp_path / "lab.txt"
    rows = [f"{TIME[k]:.2f}{blanks}{DEPTH[k]:.4f}\t{FORCE[k]:.4f}" for k in range(N)]
    path.write_text("\n".join([f"Time[s]{blanks}Disp[mm]\tForce[N]", *rows, ""]))
    table = read_lab_file(path, Reading())
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert np.allclose(table.columns["displacement"], DEPTH * 1e-3, atol=1e-7)


def test_of_a_force_and_a_capacitance_with_a_time_each_the_advice_leads_on(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{TIME[k]:.3f},{FORCE[k]:.4f},{TIME[k] + 0.013:.3f},{CAPACITANCE[k]:.4f}" for k in range(N)]
    path.write_text("\n".join(["Time (s),Force (N),Time (s),Cp (pF)", *rows, ""]))
    with pytest.raises(InputError, match="--columns time=1 or --columns time=3") as refused:
        read_lab_file(path, Reading())
    assert "capacitance=none" not in str(refused.value)
    table = read_lab_file(path, Reading(columns={"time": "1"}))
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)


def written(tmp_path: Path, header: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "lab.csv"
    rows = [f"{TIME[k]:.1f},{DEPTH[k]:.4f},{FORCE[k]:.4f}" for k in range(N)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding=encoding)
    return path


def assert_press(table: LabTable) -> None:
    assert np.allclose(table.columns["time"], TIME, atol=1e-9)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    ("words", "apart"),
    [
        ("Rig1", " "),
        ("E30-1", " "),
        ("Run #3", " "),
        ("UTM", ": "),
        ("Probe7", "_"),
        ("Lauf 2", " "),
        ("myDAQ", "/"),
        ("Quux7 blork", " - "),
    ],
)
@pytest.mark.parametrize("names", [("Time (s)", "Displacement (mm)", "Force (N)"), ("Zeit [s]", "Weg [mm]", "Kraft [N]")])
def test_words_before_all_names_that_say_nothing_of_readings_are_passed_by(
    tmp_path: Path, words: str, apart: str, names: tuple[str, ...]
) -> None:
    table = read_lab_file(written(tmp_path, ",".join(f"{words}{apart}{name}" for name in names)))
    assert_press(table)
    assert any(f'begin with "{words}", which is passed by' in note for note in table.notes)


@pytest.mark.parametrize("words", ["Max", "Target", "Simulated", "x10", "Delta", "Filtered", "Left", "log", "d", "Reference"])
def test_words_before_all_names_that_change_them_are_not_passed_by(tmp_path: Path, words: str) -> None:
    header = ",".join(f"{words} {name}" for name in ("Time (s)", "Displacement (mm)", "Force (N)"))
    try:
        table = read_lab_file(written(tmp_path, header))
    except InputError:
        return
    assert not any("which is passed by" in note for note in table.notes)


def test_of_names_that_are_not_understood_above_rows_of_numbers_it_is_said_what_leads_on(tmp_path: Path) -> None:
    path = written(tmp_path, "XX Time(s),YY Displacement(mm),ZZ Force(N)")
    with pytest.raises(InputError, match="no header row with column names that are understood") as error:
        read_lab_file(path)
    assert "--columns time=1" in str(error.value)
    said = Reading(
        columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    assert_press(read_lab_file(path, said))


@pytest.mark.parametrize(
    ("header", "encodings"),
    [
        ("时间 Time(s),位移 Displacement(mm),力 Force(N)", ("utf-8", "gb18030")),
        ("时间Time(s),位移Displacement(mm),力Force(N)", ("utf-8", "gb18030")),
        ("時間 Time(s),変位 Disp(mm),荷重 Load(N)", ("utf-8", "cp932")),
        ("Time 時間(s),Stroke ストローク(mm),Load 荷重(N)", ("utf-8", "cp932")),
        ("시간 Time(s),변위 Disp(mm),하중 Load(N)", ("utf-8", "cp949")),
        ("時間 Time(s),位移 Displacement(mm),力 Force(N)", ("utf-8", "cp950")),
    ],
)
def test_names_in_a_language_of_the_east_and_in_english_are_read_in_all_encodings(
    tmp_path: Path, header: str, encodings: tuple[str, ...]
) -> None:
    for encoding in encodings:
        assert_press(read_lab_file(written(tmp_path, header, encoding)))


@pytest.mark.parametrize("name", ["最大 Force (N)", "目标 Force (N)", "温度 Force (N)", "时间 Force (N)", "力 max Force (N)"])
def test_a_name_of_which_the_other_language_says_something_else_is_none(name: str) -> None:
    assert understand(name) is None


@pytest.mark.parametrize(
    "header",
    [
        "Time,Compressive,Compressive\n,extension,load\n(s),(mm),(N)",
        "Zeit,Maschine,Messdose\n,Weg,Kraft\ns,mm,N",
        "Time (s),Instron,Instron\n,Extension (mm),Load (N)",
    ],
)
def test_a_name_that_stands_in_the_line_above_the_others_alone_is_taken_with_a_note(tmp_path: Path, header: str) -> None:
    table = read_lab_file(written(tmp_path, header))
    assert_press(table)
    assert any("above those of the others" in note for note in table.notes)


@pytest.mark.parametrize(
    "header",
    ["Specimen,Instron,Instron\n,Extension (mm),Load (N)", "Force,,\n,Extension (mm),Load (N)", ",,\n,Extension (mm),Load (N)"],
)
def test_a_title_above_a_column_without_a_name_is_no_name_of_it(tmp_path: Path, header: str) -> None:
    table = read_lab_file(written(tmp_path, header))
    assert set(table.columns) == {"displacement", "force"}
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "name",
    [
        "Force (N) at 23 (°C)",
        "Load (N) at 2 (mm/min)",
        "Force (N) range (50 N)",
        "Force (N) cell (50 N)",
        "Kraft (N) bei 23 (°C)",
    ],
)
def test_words_with_a_bracket_of_their_own_behind_the_unit_say_how_it_was_measured(tmp_path: Path, name: str) -> None:
    assert np.allclose(read(tmp_path, f"Time (s);Travel (mm);{name}", TIME, DEPTH, FORCE).columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "name", ["Force (N) vs time (s)", "Force (N) on sensor (2)", "Force (N) per area (mm²)", "Force (N) quux (m)"]
)
def test_words_that_nobody_knows_there_are_asked_about_and_the_advice_reads_the_column(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="may be no force") as caught:
        read(tmp_path, f"Time (s);Travel (mm);{name}", TIME, DEPTH, FORCE)
    advice = caught.value.faults[0].advice
    units = {"force": "N"} if "--units force=N" in advice else {}
    table = read_lab_file(tmp_path / "lab.csv", Reading(columns={"force": name}, units=units))
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


def test_of_a_time_in_two_units_no_unit_is_advised(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s) step (ms);Travel (mm);Force (N)", TIME, DEPTH, FORCE)
    note = next(note for note in table.notes if "no time is read" in note)
    assert "time=ms" not in note
    assert "--units time=" in note


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("Force (N) at 23 (°C)", "force"),
        ("Kraft (N) bei 23 (°C)", "force"),
        ("Depth (mm) at 1 (mm/s)", "displacement"),
        ("Cp (pF) at 1 (kHz)", "capacitance"),
        ("Cp (pF) at 23 (°C)", "capacitance"),
        ("Cp (pF, 100 pF range)", "capacitance"),
        ("Cp (100 pF range) [pF]", "capacitance"),
        ("Cp (pF), 1 nF range", "capacitance"),
        ("Force_lp10Hz_N", "force"),
        ("pz_mm", "displacement"),
        ("zpos_mm", "displacement"),
        ("tm_s", "time"),
    ],
)
def test_conditions_and_short_codes_that_leave_no_doubt_are_read(name: str, quantity: str) -> None:
    heading = understand(name)
    assert heading is not None
    assert (heading.quantity, heading.name_doubt, heading.unit_doubt) == (quantity, "", "")


@pytest.mark.parametrize("name", ["Force at 5 (N)", "Temp at 23 (°C)", "Cp at 90 (pF)", "Load at 2 (mm)"])
def test_a_number_with_a_unit_in_brackets_of_another_kind_is_no_condition(name: str) -> None:
    heading = understand(name)
    assert heading is None or heading.index or heading.unit_doubt or heading.name_doubt


def test_a_ball_between_a_name_and_its_unit_is_passed_by(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s);Depth_5mm_ball_mm;Force (N)", TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)


@pytest.mark.parametrize("name", ["C_1nF (pF)", "C_0.1pF", "Cp/100pF"])
def test_a_capacitance_beside_a_press_that_is_left_out_is_named_with_its_option(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s);Depth (mm);Force (N);{name}", TIME, DEPTH, FORCE, CAPACITANCE)
    assert "capacitance" not in table.columns
    (note,) = (note for note in table.notes if note.startswith("no capacitance is read"))
    assert f"capacitance={name}" in note
    said = Reading(columns={"capacitance": name}, units={"capacitance": "pF"})
    table = read_lab_file(tmp_path / "lab.csv", said)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)


@pytest.mark.parametrize("name", ["2F (N)", "10F (N)", "Force (N) (div by 10)", "Force (N) (divided by 2)"])
def test_a_factor_in_a_name_is_asked_about_even_if_the_column_is_said(tmp_path: Path, name: str) -> None:
    path = tmp_path / "lab.csv"
    with pytest.raises(InputError):
        read(tmp_path, f"Time (s);Depth (mm);{name}", TIME, DEPTH, FORCE)
    with pytest.raises(InputError, match="factor"):
        read_lab_file(path, Reading(columns={"force": name}))
    table = read_lab_file(path, Reading(columns={"force": name}, units={"force": "2 N"}))
    assert np.allclose(table.columns["force"], 2 * FORCE, atol=1e-3)


@pytest.mark.parametrize("name", ["Kanal 1 [N]", "AI0 [N]", "Channel 3 (N)", "CH2 (N)"])
def test_a_channel_that_is_taken_by_its_unit_is_noted(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s);Depth (mm);{name}", TIME, DEPTH, FORCE)
    assert any(f'force is taken from "{name}", a channel, by its unit N' in note for note in table.notes)


@pytest.mark.parametrize(("name", "reach"), [("Force 50N (N)", "50N"), ("Load 10 kN (N)", "10 kN")])
def test_how_far_an_instrument_reaches_in_a_name_is_passed_by_with_a_note(tmp_path: Path, name: str, reach: str) -> None:
    table = read(tmp_path, f"Time (s);Depth (mm);{name}", TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any(f'"{reach}" in "{name}" is passed by' in note for note in table.notes)


def test_a_column_without_a_name_that_goes_up_may_be_the_time(tmp_path: Path) -> None:
    table = read(tmp_path, ";Depth (mm);Force (N)", TIME, DEPTH, FORCE)
    assert any('"column 1" rises from row to row' in note and "--columns time=1" in note for note in table.notes)
    again = read_lab_file(tmp_path / "lab.csv", Reading(columns={"time": "1"}, units={"time": "s"}))
    assert np.allclose(again.columns["time"], TIME)


def test_a_row_of_results_with_an_empty_cell_is_called_by_its_word(tmp_path: Path) -> None:
    read(tmp_path, "Time (s);Depth (mm);Force (N)", TIME, DEPTH, FORCE)
    path = tmp_path / "lab.csv"
    path.write_text(path.read_text(encoding="utf-8") + "Mean;;1.2\nMax;;3.4\n", encoding="utf-8")
    reasons = read_lab_file(path).reasons[-2:]
    assert reasons == ('a row of results: "Mean"', 'a row of results: "Max"')


@pytest.mark.parametrize("name", ["Load (N) [Instron 2519-103]", "Force (N) [4-wire]", "Force (N) (two-wire)"])
def test_a_model_and_how_it_is_wired_are_passed_by(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s);Depth (mm);{name}", TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


def test_a_capacitance_by_four_wires_is_read(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s);Depth (mm);Force (N);Cp (pF) [4-wire]", TIME, DEPTH, FORCE, CAPACITANCE)
    assert np.allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, atol=1e-16)


def test_of_a_column_of_words_beside_the_one_in_a_unit_the_choice_alone_is_said(tmp_path: Path) -> None:
    rows = [f"P{1 + i // 10};{t:.2f};{d:.4f};{f:.4f}" for i, (t, d, f) in enumerate(zip(TIME, DEPTH, FORCE, strict=True))]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Position;Time (s);Z (mm);Fz (N)", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    assert len(caught.value.faults) == 1
    assert 'displacement=Z (mm)"' in str(caught.value)


def test_times_to_the_minute_are_refused_with_the_reason_and_a_way_out(tmp_path: Path) -> None:
    rows = [f"11.02.2026 14:{3 + i // 20:02d};{d:.4f};{f:.4f}" for i, (d, f) in enumerate(zip(DEPTH, FORCE, strict=True))]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time;Depth (mm);Force (N)", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="has no seconds"):
        read_lab_file(path)
    assert "time" not in read_lab_file(path, Reading(columns={"time": "none"})).columns
