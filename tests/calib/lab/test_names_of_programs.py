"""Names as programs and loggers write them are read: of runs, of R, with a formula's symbol, with the label of a channel."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, SeveralSpecimens, read_lab_file
from calib.lab.instruments.brackets import tidy
from calib.lab.instruments.vocabulary import heading_as, understand

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))


def read(tmp_path: Path, header: str, *columns: np.ndarray, reading: Reading | None = None) -> LabTable:
    rows = [";".join(f"{column[k]:.4f}" for column in columns) for k in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    "header",
    [
        "Data Set 1:Time(s);Data Set 1:Distance(mm);Data Set 1:Force(N)",
        "Latest: Time (s);Latest: Position (mm);Latest: Force (N)",
        "Run 1: Time (s);Run 1: Position (mm);Run 1: Force (N)",
        "Zeit t [s];Weg s [mm];Kraft F [N]",
        "Time t (s);Indentation depth h (mm);Normal force F_n (N)",
        "Time (s);Displacement/AVE (mm);Force/AVE (N)",
        "Time (s);102 <Disp> (mm);101 <Force> (N)",
        "Time.s;Displacement.mm;Force.N",
        "Time (s);Pd [mm];Fn [N]",
        "Zeit  1 - Standard-Messrate [s];Weg WA10 [mm];Kraft U10M [N]",
        "Temps 1 - fréquence d'échantillonnage par défaut [s];Course [mm];Force [N]",
        "Time;Ax. Displacement;Ax. Force\nSec;mm;N",
        "Time (s);Ax. Disp. (mm);Vert. Load (N)",
        "Time (s);AI 1/displacement (mm);AI 2/force (N)",
        "Time (s);Dev1_ai0 Displacement [mm];Dev1_ai1 Force [N]",
        "Time (s) (since start);Displacement (mm) (crosshead);Force (N) (5 N cell)",
        "t / s;x / mm;F / 10^0 N",
        "Time [s];Displacement [mm];Force (0-5 N) [N]",
        "Zeit;Weg;Kraft\ntime;displacement;force\n[s];[mm];[N]",
        "t_s;disp_mm;force_n",
        '"Full Scale Load Range (N): 10"\nTime (s);Extension (mm);Load (N)',
    ],
)
def test_it_is_read_to_the_right_numbers(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["time"], TIME, atol=1e-4)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "force",
    ["Kraft N [mN]", "Max: Force (N)", "Force/MAX (N)", "Force.A", "Load m (N)", "101 <Force> (N);102 <Force> (N)", "Max.N"],
)
def test_what_is_two_units_a_statistic_or_one_of_two_is_not(tmp_path: Path, force: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, f"Time (s);Extension (mm);{force}", TIME, DEPTH, *[FORCE * (1 + k) for k in range(1 + force.count(";"))])


def test_runs_side_by_side_are_specimens_to_choose_from(tmp_path: Path) -> None:
    header = ";".join(f"Data Set {k}:{name}" for k in (1, 2) for name in ("Time(s)", "Distance(mm)", "Force(N)"))
    columns = (TIME, DEPTH, FORCE, TIME + 0.01, 1.1 * DEPTH, 1.3 * FORCE)
    with pytest.raises(SeveralSpecimens):
        read(tmp_path, header, *columns)
    table = read(tmp_path, header, *columns, reading=Reading(specimen=2))
    assert np.allclose(table.columns["force"], 1.3 * FORCE, atol=1e-4)


def test_a_capacitance_between_the_terminals_of_a_card() -> None:
    heading = understand("Cp_AB", "F")
    assert heading is not None
    assert heading.quantity == "capacitance"


def test_a_factor_of_full_scale_is_still_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="factor"):
        read(tmp_path, "Load scale factor: 10\nTime (s);Extension (mm);Load (N)", TIME, DEPTH, FORCE)


@pytest.mark.parametrize(
    ("header", "factor"),
    [("t / s;x / mm;F / 10^-3 N", 1e-3), ("t / s;x / mm;F / 10⁻³ N", 1e-3), ("t_s;disp_mm;axial_load_kn", 1e3)],
)
def test_a_unit_behind_a_stroke_or_in_small_letters_is_read(tmp_path: Path, header: str, factor: float) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE / factor if factor < 1 else FORCE)
    assert np.allclose(table.columns["force"], FORCE * max(factor, 1.0), atol=1e-4 * factor)


def test_small_letters_are_told(tmp_path: Path) -> None:
    table = read(tmp_path, "t_s;disp_mm;force_n", TIME, DEPTH, FORCE)
    assert '"force_n": in a name of small letters "n" is read as N' in table.notes


@pytest.mark.parametrize("force", ["force_n;force_t", "force_mn", "force n", "1/Force (N)", "AI 1/2 (N)"])
def test_small_letters_that_may_be_a_direction_and_inverses_are_asked_about(tmp_path: Path, force: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, f"t_s;disp_mm;{force}", TIME, DEPTH, *[FORCE] * (1 + force.count(";")))


def test_a_direction_is_settled_by_the_unit_that_is_said(tmp_path: Path) -> None:
    columns = (TIME, DEPTH, FORCE, 0.1 * FORCE)
    table = read(tmp_path, "t_s;disp_mm;force_n;force_t", *columns, reading=Reading(units={"force": "mN"}))
    assert np.allclose(table.columns["force"], 1e-3 * FORCE, atol=1e-7)


def test_metres_in_capitals_are_read_and_told(tmp_path: Path) -> None:
    rows = [f"{t:.6E} {x * 1e-3:.6E} {f:.6E}" for t, x, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.dat"
    path.write_text("\n".join(["TIME (S)  DISP (M)  FORCE (N)", *rows]) + "\n")
    table = read_lab_file(path)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-8)
    assert any('"M" is read as m' in note for note in table.notes)


@pytest.mark.parametrize("name", ["FORCE (M)", "LOAD M", "TIME (M)"])
def test_a_capital_m_of_another_quantity_is_no_metre(tmp_path: Path, name: str) -> None:
    heading = understand(name)
    assert heading is None or heading.unit != "m"


@pytest.mark.parametrize(
    ("names", "dissipation"), [("Elapsed (s);C Parallel (pF);D Factor", True), ("Elapsed (s);Capacitance parallel (pF)", False)]
)
def test_the_circuit_may_stand_behind_the_capacitance(tmp_path: Path, names: str, dissipation: bool) -> None:
    table = read(tmp_path, names, TIME, 97.0 + DEPTH, *([0.001 + 0 * TIME] if dissipation else []))
    assert np.allclose(table.columns["capacitance"], (97.0 + DEPTH) * 1e-12, atol=1e-16)
    assert ("dissipation" in table.columns) is dissipation
    series = understand("C series (pF)")
    assert series is not None
    assert series.quantity == "capacitance_series"


def test_lines_that_labchart_labels_hold_the_units_of_channels(tmp_path: Path) -> None:
    head = [
        "Interval=\t0.1 s",
        "ChannelTitle=\tForce\tDisplacement",
        "Range=\t5.000 N\t2.000 mm",
        "UnitName=\tmN\tmm",
        "TopValue=\t5.0\t2.0",
    ]
    rows = [f"{t:.3f}\t{1e3 * f:.4f}\t{x:.4f}" for t, x, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join([*head, *rows]) + "\n")
    table = read_lab_file(path, Reading(columns={"time": "1"}, units={"time": "s"}))
    assert np.allclose(table.columns["force"], FORCE, atol=1e-6)
    assert len(table.lines) == N


@pytest.mark.parametrize("second", ["time;force;displacement", "time;displacement;force (kN)", "time;displacement;stress"])
def test_a_second_line_of_names_that_says_something_else_is_refused(tmp_path: Path, second: str) -> None:
    with pytest.raises(InputError, match="like another header"):
        read(tmp_path, f"Zeit;Weg;Kraft\n{second}\n[s];[mm];[N]", TIME, DEPTH, FORCE)


def test_quantities_in_lines_are_told_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    named = (("Time (s)", TIME), ("Displacement (mm)", DEPTH), ("Force (N)", FORCE))
    path.write_text("\n".join(",".join([name, *(f"{v:.4f}" for v in values)]) for name, values in named) + "\n")
    for reading in (Reading(), Reading(columns={"time": "1", "displacement": "2", "force": "3"})):
        with pytest.raises(InputError, match="Turn rows and columns"):
            read_lab_file(path, reading)


def test_one_press_in_blocks_side_by_side_is_no_choice_of_specimens(tmp_path: Path) -> None:
    header = "Time (s);Displacement (mm);Force (N)"
    parts = [(TIME[part], DEPTH[part], FORCE[part]) for part in (slice(30), slice(30, N))]
    rows = [";".join(f"{values[k]:.4f}" for values in (*parts[0], *parts[1])) for k in range(30)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"{header};{header}", *rows]) + "\n")
    with pytest.raises(InputError, match="one below the other") as error:
        read_lab_file(path)
    assert not isinstance(error.value, SeveralSpecimens)


@pytest.mark.parametrize(("name", "said"), [("Force (10 mN)", "force=10 mN"), ("Force [0.01 N]", "force=0.01 N")])
def test_a_number_with_a_unit_in_the_place_of_one_is_asked_about_as_both(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(InputError, match="may be what one count stands for, or how far the instrument reaches") as error:
        read(tmp_path, f"Time (s);Displacement (mm);{name}", TIME, DEPTH, FORCE)
    assert f'--units "{said}"' in str(error.value)


def test_a_farad_beside_a_second_is_a_second_unit_and_the_sign_of_a_force_none() -> None:
    for name in ("Epoch (F) (s)", "Weg (F) [mm]"):
        found = understand(name)
        assert found is not None
        assert found.unit_doubt
    plain = understand("Kraft (F) [N]")
    assert plain is not None
    assert not plain.unit_doubt


def test_a_cell_longer_than_any_name_is_left_as_it_is() -> None:
    for cell in ("Load" + " " * 20_000 + "(N)", "Load / 1e-3 " + "N" * 20_000):
        assert tidy(cell) == cell
        assert understand(cell) is None


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("Normal load, P (N)", "force", "N"),
        ("Time, t (s)", "time", "s"),
        ("Normal force, F_n (mN)", "force", "mN"),
        ("Capacitance, C_p (pF)", "capacitance", "pF"),
        ("Capacitance, C_s (pF)", "capacitance_series", "pF"),
        ("Displacement, u_z (µm)", "displacement", "μm"),
        ("time_in_s", "time", "s"),
        ("displacement_in_um", "displacement", "um"),
        ("force_in_mN", "force", "mN"),
        ("cap_in_pF", "capacitance", "pF"),
        ("$t$ (s)", "time", "s"),
        ("$F$ (N)", "force", "N"),
        ("$C_p$ (pF)", "capacitance", "pF"),
        (r"$F_{\mathrm{z}}$ ($\mu$N)", "force", "μN"),
        ("timeMs", "time", "ms"),
        ("timeSec", "time", "sec"),
        ("Primary: Cp (F)", "capacitance", "F"),
        ("displacementMm", "displacement", "mm"),
        ("forceN", "force", "N"),
        ("capacitancePf", "capacitance", "pF"),
        ("Timestamp (s since 01.01.1904)", "time", "s"),
    ],
)
def test_names_as_papers_and_programs_write_them_are_understood_with_their_units(name: str, quantity: str, unit: str) -> None:
    heading = understand(name)
    assert heading is not None
    assert (heading.quantity, heading.unit, heading.unit_doubt, heading.name_doubt) == (quantity, unit, "", "")
    assert heading_as(quantity, name).unit == unit


@pytest.mark.parametrize(
    "name",
    [
        "Position, x (mm)",
        "Force, F_t (N)",
        "Friction force, F (N)",
        "Load, t (N)",
        "max_force_in_N",
        r"$\Delta C$ (pF)",
        r"$\sigma$ (MPa)",
        "forceMn",
        "forceMm",
        "peakN",
        "Force (N since tare)",
    ],
)
def test_names_like_these_of_something_else_are_not_taken_for_them(name: str) -> None:
    heading = understand(name)
    assert heading is None or heading.unit_doubt or heading.name_doubt or heading.unit in (None, "N since tare")


def press(folder: Path, header: str) -> LabTable:
    rows = [f"{3730098067 + 0.1 * i:.1f},{0.01 * i:.3f},{0.01 * i**1.5:.4f}" for i in range(60)]
    path = folder / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_lab_file(path)


@pytest.mark.parametrize("name", ["delta_mm", "u_z (mm)", "delta (mm)", r"$\delta$ (mm)", "Delta_mm"])
def test_an_approach_of_formulas_is_the_displacement_where_it_alone_is_a_length_with_a_note(tmp_path: Path, name: str) -> None:
    table = press(tmp_path, f"Time (s),{name},F (N)")
    assert table.columns["displacement"][10] == pytest.approx(1e-4)
    assert any("the only column" in note for note in table.notes)


@pytest.mark.parametrize("name", ["delta_T", "u_x (mm)", "Delta (%)", "ΔL0 (mm)"])
def test_other_deltas_are_no_displacement(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no displacement column"):
        press(tmp_path, f"Time (s),{name},F (N)")


def test_seconds_since_a_day_that_their_name_says_begin_there(tmp_path: Path) -> None:
    table = press(tmp_path, "Timestamp (s since 01.01.1904),Extension (mm),F (N)")
    assert table.started == datetime(2022, 3, 14, 10, 21, 7)


@pytest.mark.parametrize("symbols", ["t\tF\td", "t\tF\tD", "t\tFn\tdz"])
def test_names_symbols_and_units_below_each_other_are_one_header(tmp_path: Path, symbols: str) -> None:
    above = f"Vernier Format 2\nball.cmbl 3/11/2019 10:12:33 .\nData Set\nTime\tForce\tDisplacement\n{symbols}\ns\tN\tmm\n"
    rows = [f"{t:.2f}\t{f:.3f}\t{d:.3f}" for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text(above + "\n" + "\n".join(rows) + "\n")
    table = read_lab_file(path)
    assert table.columns["displacement"][20] == pytest.approx(1e-3 * DEPTH[20], abs=1e-6)
    assert any("as symbols" in unread.reason for unread in table.unread)


@pytest.mark.parametrize("between", ["t\td\tF", "s\tN\tm"])
def test_symbols_of_other_columns_between_names_and_units_are_refused(tmp_path: Path, between: str) -> None:
    rows = [f"{t:.2f}\t{f:.3f}\t{d:.3f}" for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["Time\tForce\tDisplacement", between, "s\tN\tmm", *rows]) + "\n")
    with pytest.raises(InputError):
        read_lab_file(path)


def test_a_unit_that_a_capital_joins_to_a_name_is_told(tmp_path: Path) -> None:
    table = read(tmp_path, "timeMs;displacementMm;forceN", TIME, DEPTH, FORCE)
    assert table.columns["time"][10] == pytest.approx(1e-3)
    assert sum("the end of the name is read as its unit" in note for note in table.notes) == 3


@pytest.mark.parametrize("across", ["forceT", "forceX"])
def test_a_joined_n_beside_another_direction_is_no_newton(tmp_path: Path, across: str) -> None:
    header = f"timeMs;displacementMm;forceN;{across}"
    with pytest.raises(InputError, match='"N" may be the direction'):
        read(tmp_path, header, TIME, DEPTH, FORCE, FORCE)
    assert "force" in read(tmp_path, header, TIME, DEPTH, FORCE, FORCE, reading=Reading(units={"force": "N"})).columns


@pytest.mark.parametrize(
    ("header", "field", "value"),
    [("_time,_field,_value", "capacitance_pF", "_value"), ("last_changed,entity_id,state", "sensor.capacitance_pf", "state")],
)
def test_the_one_quantity_that_a_database_names_in_each_row_is_asked_for_by_options_that_read_it(
    tmp_path: Path, header: str, field: str, value: str
) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"2026-03-01T10:00:{0.1 * k:06.3f}Z,{field},{97.1 + 0.01 * k:.2f}" for k in range(N)]
    path.write_text("\n".join([header, *rows]) + "\n")
    with pytest.raises(InputError, match=f"--columns capacitance={value} --units capacitance=p[fF]$") as error:
        read_lab_file(path)
    unit = str(error.value).rpartition("=")[2]
    table = read_lab_file(path, Reading(columns={"capacitance": value}, units={"capacitance": unit}))
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * (97.1 + 0.01 * np.arange(N)))
    path.write_text("\n".join([header, *(row.replace(field, ("sensor.force_n", field)[k % 2]) for k, row in enumerate(rows))]))
    with pytest.raises(InputError, match="each row holds one reading"):
        read_lab_file(path)


@pytest.mark.parametrize("name", ["f_mn", "F_mn", "fz_mn", "force_mn"])
def test_a_unit_of_force_in_small_letters_that_may_be_another_is_asked_about(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="did you mean mN"):
        read(tmp_path, f"t_s;z_mm;{name}", TIME, DEPTH, FORCE)
    table = read(tmp_path, f"t_s;z_mm;{name}", TIME, DEPTH, FORCE, reading=Reading(units={"force": "mN"}))
    np.testing.assert_allclose(table.columns["force"], 1e-3 * FORCE, atol=1e-7)


def test_names_of_entities_are_read(tmp_path: Path) -> None:
    table = read(tmp_path, "time_s;sensor.position_mm;sensor.force_n", TIME, DEPTH, FORCE)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


def test_the_tool_of_a_robot_is_asked_for_its_units_along_z_alone(tmp_path: Path) -> None:
    header = "timestamp;actual_TCP_pose_0;actual_TCP_pose_2;actual_TCP_force_0;actual_TCP_force_2"
    columns = (TIME, 0.1 + 0 * DEPTH, DEPTH, 0.01 * FORCE, FORCE)
    with pytest.raises(InputError) as error:
        read(tmp_path, header, *columns)
    assert {fault.choice.key for fault in error.value.faults if fault.choice} <= {"time", "displacement", "force"}
    units = {"time": "s", "displacement": "mm", "force": "N"}
    table = read(tmp_path, header, *columns, reading=Reading(units=units))
    assert table.sources["force"].startswith("actual_TCP_force_2")
    assert any("axis x: not used" in str(part) for part in table.unread)
