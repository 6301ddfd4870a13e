"""Columns of raw counts, lines of comments below a header, and a quantity that stands twice, once rounded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 120
PLACE = np.round(0.009 * np.minimum(np.arange(N), N - 1 - np.arange(N)), 4)
LOAD = np.round(3.0 * np.maximum(0.0, PLACE - 0.06) ** 1.5 + 0.001 * (np.arange(N) % 3 - 1), 4)
CAP = np.round(97.4 + LOAD / 3, 4)
T, D, F, C = ([f"{x:.{digits}f}" for x in v] for v, digits in ((0.1 * np.arange(N), 1), (PLACE, 4), (LOAD, 4), (CAP, 4)))
F_COUNTS, D_COUNTS, C_COUNTS = ([f"{x:.0f}" for x in v] for v in (8e6 + 5e4 * LOAD, 800 * PLACE, 1e5 * CAP))


def read(folder: Path, head: Sequence[str], rows: Sequence[Sequence[str]], sep: str = ",", **said: Any) -> LabTable:
    path = folder / "press.csv"
    path.write_text("\n".join([*head, *(sep.join(row) for row in zip(*rows, strict=True)), ""]), encoding="utf-8")
    return read_lab_file(path, Reading(**said))


def refusal(*of: Any, **said: Any) -> str:
    with pytest.raises(InputError) as caught:
        read(*of, **said)
    return str(caught.value)


def assert_right(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * PLACE, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=1e-12)
    np.testing.assert_allclose(table.columns["time"], 0.1 * np.arange(N), atol=1e-12)
    assert not any(table.reasons)


def unread(table: LabTable) -> Mapping[str, str]:
    return {u.what: u.reason for u in table.unread}


# --- counts ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "head",
    [
        ["Time (s),Force (counts),Force (N),Displacement (steps),Displacement (mm)"],
        ["Time (s),Load (raw),Load (N),Position (raw),Position (mm)"],
        ["Time (s),Force (ADC counts),Force (N),Position (encoder ticks),Position (mm)"],
        ["Time [s],Kraft [Digits],Kraft [N],Weg [Schritte],Weg [mm]"],
        ["Time (s),Force (24 bit),Force (N),Travel (pulses),Travel (mm)"],
        ["Time (s),Force_raw,Force_N,Position_raw,Position_mm"],
        ["Time,Force,Force,Displacement,Displacement", "s,counts,N,steps,mm"],
        ["Time,Force,Force,Displacement,Displacement", "s,raw,N,raw,mm"],
        ["Time (s),Force (V),Force (N),Displacement (V),Displacement (mm)"],
        ["Time,Force,Force,Displacement,Displacement", "s,mV,N,V,mm"],
    ],
)
def test_counts_beside_a_quantity_in_its_unit_are_no_second_specimen(tmp_path: Path, head: list[str]) -> None:
    table = read(tmp_path, head, [T, F_COUNTS, F, D_COUNTS, D])
    assert_right(table)
    assert {what[:8] for what in unread(table) if what.startswith("column")} == {"column 2", "column 4"}


def test_counts_of_one_quantity_or_of_three_are_named_as_not_read(tmp_path: Path) -> None:
    names = ["Time (s),Force (counts),Force (N),Stepper (steps),Displacement (mm),C (counts),C (pF)"]
    table = read(tmp_path, names, [T, F_COUNTS, F, D_COUNTS, D, C_COUNTS, C])
    assert_right(table)
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAP, rtol=1e-12)
    told = unread(table)
    assert told['column 2 "Force (counts)"'] == 'counts ("counts"), no force in a unit: "Force (N)" is the force'
    assert 'counts ("counts")' in told['column 6 "C (counts)"']
    assert_right(read(tmp_path, ["Time (s),Force (counts),Force (N),Displacement (mm)"], [T, F_COUNTS, F, D]))


def test_counts_that_the_user_means_are_read_beside_a_column_in_a_unit(tmp_path: Path) -> None:
    names = ["Time (s),Force (counts),Force (N),Displacement (mm)"]
    said, unit = {"force": "Force (counts)"}, {"force": "0.00002 N"}
    table = read(tmp_path, names, [T, F_COUNTS, F, D], columns=said, units=unit)
    np.testing.assert_allclose(table.columns["force"] - 160, LOAD, atol=2e-5)


def test_counts_alone_are_asked_about_and_raw_readings_with_a_unit_are_readings(tmp_path: Path) -> None:
    assert "counts" in refusal(tmp_path, ["Time (s),Force (counts),Displacement (mm)"], [T, F_COUNTS, D])
    assert_right(read(tmp_path, ["Time (s),Force (raw) (N),Displacement (mm)"], [T, F, D]))
    assert_right(read(tmp_path, ["Time,Force (raw),Displacement", "s,N,mm"], [T, F, D]))


def test_two_specimens_side_by_side_are_told_beside_counts(tmp_path: Path) -> None:
    names = ["Time (s),Force (counts),Force (N),Displacement (mm),Time (s),Force (counts),Force (N),Displacement (mm)"]
    assert "specimen" in refusal(tmp_path, names, [T, F_COUNTS, F, D, T, F_COUNTS, F[::-1], D])


# --- lines below the header ----------------------------------------------------------------------------------------------

UNITS_IN_NAMES = ["Time (s)\tDisplacement (mm)\tForce (N)"]
UNITS_BELOW = ["Time\tDisplacement\tForce", "s\tmm\tN"]


@pytest.mark.parametrize("head", [UNITS_IN_NAMES, UNITS_BELOW])
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("press 3\tpress 3\tpress 3", "one comment on all columns"),
        ("\tpress 1\tpress 1", "one comment on all columns"),
        ("foam_12\tfoam_12\tfoam_12", "one comment on all columns"),
        ("pilot run\tpilot run\tpilot run", "one comment on all columns"),
        ("float\tfloat\tfloat", "types of the columns"),
        ("timestamp\tDOUBLE\tDOUBLE", "types of the columns"),
        ("float64\tfloat64\tfloat64", "types of the columns"),
        ("-\tSN 4711\tSN 0815", "serial numbers"),
        ("\tS/N: A1234\tserial no. 00815", "serial numbers"),
    ],
)
def test_a_line_below_names_and_units_that_leaves_columns_what_they_are_is_left_out(
    tmp_path: Path, head: list[str], line: str, said: str
) -> None:
    table = read(tmp_path, [*head, line], [T, D, F], sep="\t")
    assert_right(table)
    assert unread(table)[f"line {len(head) + 1}"].startswith(said)


@pytest.mark.parametrize("head", [UNITS_IN_NAMES, UNITS_BELOW])
@pytest.mark.parametrize(
    "line",
    [
        "Time\tForce\tDisplacement",
        "\tspecimen 1\tspecimen 2",
        "\tSN 1\tSN 2",
        "max\tmax\tmax",
        "x10\tx10\tx10",
        "x100\tx100\tx100",
        "kN\tkN\tkN",
        "setpoint\tsetpoint\tsetpoint",
    ],
)
def test_a_second_line_of_names_or_one_that_may_change_readings_is_refused(tmp_path: Path, head: list[str], line: str) -> None:
    assert "line" in refusal(tmp_path, [*head, line], [T, D, F], sep="\t")


@pytest.mark.parametrize("line", ["Clock\tLeft\tRight", "\t".join(["compression negative"] * 3)])
def test_words_below_names_with_units_that_may_mean_something_else_are_refused(tmp_path: Path, line: str) -> None:
    assert "another header" in refusal(tmp_path, [*UNITS_IN_NAMES, line], [T, D, F], sep="\t")


def test_a_line_below_names_without_units_is_refused_as_another_header(tmp_path: Path) -> None:
    assert "another header" in refusal(
        tmp_path, ["Time\tDisplacement\tForce", "press 1\tpress 1\tpress 1"], [T, D, F], sep="\t"
    )


# --- one quantity, once rounded ------------------------------------------------------------------------------------------


def written(values: Any, factor: float, digits: int) -> list[str]:
    return [f"{x * factor:.{digits}f}" for x in values]


@pytest.mark.parametrize(
    ("name", "column", "finer"),
    [
        ("Load (kN)", written(LOAD, 1e-3, 3), "Load (N)"),
        ("Load (kgf)", written(LOAD, 1 / 9.80665, 2), "Load (N)"),
        ("Force (N)", written(LOAD, 1, 1), "Load (N)"),
        ("Load (N)", written(LOAD, 1, 1), "Load (N)"),
        ("Extension (in)", written(PLACE, 1 / 25.4, 3), "Extension (mm)"),
        ("Position (cm)", written(PLACE, 0.1, 2), "Extension (mm)"),
    ],
)
@pytest.mark.parametrize("at", [1, 3])
def test_of_a_quantity_that_stands_twice_and_once_rounded_the_finer_is_read(
    tmp_path: Path, name: str, column: list[str], finer: str, at: int
) -> None:
    names, columns = ["Time (s)", "Extension (mm)", "Load (N)"], [T, D, F]
    names.insert(at, name)
    columns.insert(at, column)
    table = read(tmp_path, [",".join(names)], columns)
    assert_right(table)
    assert f'column {at + 1} "{name}"' in unread(table)
    assert any(f'is taken from "{finer}"; "{name}" is the same, rounded more coarsely' in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("Force (N)", written(LOAD * 1.2, 1, 1)),
        ("Force (N)", [*written(LOAD[:60], 1, 1), "3.0", *written(LOAD[61:], 1, 1)]),
        ("Force (N)", written(LOAD + 0.12, 1, 1)),
        ("Load (kgf)", written(LOAD, 0.105, 2)),
        ("Position (mm)", written(PLACE + 0.02, 1, 2)),
        ("Force (N)", written(np.floor(10 * LOAD) / 10, 1, 1)),
    ],
)
def test_columns_that_differ_by_more_than_rounding_are_still_a_choice(tmp_path: Path, name: str, column: list[str]) -> None:
    table: LabTable | str
    try:
        table = read(tmp_path, [f"Time (s),Extension (mm),Load (N),{name}"], [T, D, F, column])
    except InputError as error:
        table = str(error)
    assert "2 columns may be" in table if isinstance(table, str) else not any("rounded" in n for n in table.notes)


# --- channels that a list names ------------------------------------------------------------------------------------------

OF_LOGGER = ["Vendor,GRAPHTEC Corporation", "CH,Signal name", "CH1,Disp", "CH2,Force", "Data"]


def logged(folder: Path, head: Sequence[str]) -> LabTable:
    names = [*head, "Number,Date&Time,ms,CH1,CH2", "NO.,Time,ms,mm,N"]
    stamps = [f"2024/12/31 23:59:{40 + i // 10}" for i in range(N)]
    return read(folder, names, [[str(i + 1) for i in range(N)], stamps, [str(100 * (i % 10)) for i in range(N)], D, F])


@pytest.mark.parametrize(
    "head",
    [
        OF_LOGGER,
        [f'"{line.replace(",", chr(34) + "," + chr(34))}"' for line in OF_LOGGER],
        ["CH,Signal name,Input,Range", "CH1,Disp,DC,5V", "CH2,Force,DC,5V", "Data"],
        ["CH1,Weg", "CH2,Kraft"],
    ],
)
def test_a_short_list_of_the_channels_of_a_logger_names_them_and_is_no_header(tmp_path: Path, head: list[str]) -> None:
    table = logged(tmp_path, head)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * PLACE, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=1e-12)
    np.testing.assert_allclose(np.ptp(table.columns["time"]), 11.9, atol=1e-6)
    assert any("the list of them above the header" in note for note in table.notes)


def test_a_list_of_channels_that_names_a_setpoint_makes_no_second_force_of_it(tmp_path: Path) -> None:
    names = ["CH1,Disp", "CH2,Force", "CH3,Force setpoint", "Number,Date&Time,CH1,CH2,CH3", "NO.,Time,mm,N,N"]
    stamps = [f"2024/12/31 23:59:{40 + i // 10}.{i % 10}" for i in range(N)]
    table = read(tmp_path, names, [[str(i + 1) for i in range(N)], stamps, D, F, F[::-1]])
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=1e-12)
    assert "commanded" in unread(table)['column 5 "Force setpoint"']


def test_lists_of_settings_or_two_lists_that_differ_name_no_channel(tmp_path: Path) -> None:
    for head in (["CH1,DC", "CH2,DC"], ["CH1,Disp", "CH2,Force", "CH1,Force", "CH2,Disp"]):
        try:
            notes = logged(tmp_path, head).notes
        except InputError as error:
            notes = (str(error),)
        assert not any("the list of them" in note for note in notes)


@pytest.mark.parametrize("form", ["# {} = {}", "{}: {}", "% {}: {}", "// {}={}", '"{}: {}"'])
@pytest.mark.parametrize("channel", ["CH{}", "Channel {}", "Ch. {}", "Kanal {}"])
@pytest.mark.parametrize("marked", [True, False])
def test_a_key_to_the_channels_one_a_line_names_them(tmp_path: Path, form: str, channel: str, *, marked: bool) -> None:
    names = ["Time [s]", "Displacement [mm]", "Force [N]"]
    keys = [form.format(channel.format(k), name) for k, name in enumerate(names, 1)]
    above = ["# Rig: bench 2, program 3"] if marked else []
    table = read(tmp_path, [*above, *keys, ",".join(channel.format(k) for k in (1, 2, 3))], [T, D, F])
    assert_right(table)
    assert any("the list of them above the header" in note for note in table.notes)


@pytest.mark.parametrize(
    "keys",
    [
        ["CH1 = Time [s]", "CH2 = Displacement [mm]"],
        ["CH1 = Time [s]", "CH2 = Displacement [mm]", "CH3 = Force [N]", "CH3 = Load [kN]"],
        ["CH1: DC, 5 V", "CH2: DC, 5 V", "CH3: DC, 10 V"],
        ["CH1 = Time [s]", "CH2 = Displacement [mm]", "CH3 = Force [N] x10"],
    ],
)
def test_a_key_that_lacks_a_channel_or_names_it_twice_or_with_a_factor_names_no_force(tmp_path: Path, keys: list[str]) -> None:
    with pytest.raises(InputError):
        read(tmp_path, [*keys, "CH1,CH2,CH3"], [T, D, F])


# --- names ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ['"Force [N], tared"', '"Force (N); cell 2"', "Force* (N)", "Force† [N]"])
def test_a_remark_behind_a_unit_and_the_mark_of_a_footnote_leave_a_name_what_it_is(tmp_path: Path, name: str) -> None:
    assert_right(read(tmp_path, [f"Time (s),Displacement (mm),{name}"], [T, D, F]))


@pytest.mark.parametrize(
    "name", ['"Force [N], max"', '"Force [N], kN"', '"Force (N), x10"', "Force*10 (N)", '"Force [N], setpoint"']
)
def test_a_statistic_a_factor_or_another_unit_behind_a_unit_is_none(tmp_path: Path, name: str) -> None:
    assert "force" in refusal(tmp_path, [f"Time (s),Displacement (mm),{name}"], [T, D, F]).lower()


STILL = ["2.00"] * N


@pytest.mark.parametrize("names", ["d [mm],x [mm]", "x [mm],y [mm]", "x (mm),y (mm)", "Thickness (mm),x (mm)"])
def test_of_columns_of_a_length_the_axis_that_alone_moves_is_the_displacement_with_a_note(tmp_path: Path, names: str) -> None:
    table = read(tmp_path, [f"t [s],{names},F [N]"], [T, STILL, D, F])
    assert_right(table)
    assert any("the only column of a length that moves" in note for note in table.notes)
    assert any("column 2" in what for what in unread(table))


@pytest.mark.parametrize(
    ("names", "rows"),
    [
        ("x [mm],y [mm]", [T, D, D[::-1], F]),
        ("x [mm],y [mm]", [T, STILL, STILL, F]),
        ("d [mm],Width [mm]", [T, STILL, D, F]),
        ("y [mm],Note", [T, D, STILL, F]),
    ],
)
def test_two_axes_that_move_or_one_that_is_no_axis_of_a_press_are_asked_about(
    tmp_path: Path, names: str, rows: list[list[str]]
) -> None:
    assert "displacement" in refusal(tmp_path, [f"t [s],{names},F [N]"], rows)


def test_units_in_columns_without_a_name_behind_the_values_are_read(tmp_path: Path) -> None:
    def of(*units: str) -> list[list[str]]:
        return [column for values, unit in zip((T, D, F), units, strict=True) for column in (values, [unit] * N)]

    table = read(tmp_path, ["Time,,Displacement,,Force,"], of("s", "mm", "N"))
    assert_right(table)
    assert '"Force" is in N: column 6 says so in every row' in table.notes
    np.testing.assert_allclose(read(tmp_path, ["Time,,Displacement,,Force,"], of("s", "mm", "mN")).columns["force"], LOAD / 1e3)
    assert "has no unit" in refusal(tmp_path, ["Time,,Displacement,,Force,"], of("s", "mm", "a"))
    mixed = of("s", "mm", "N")
    mixed[5][60:] = ["kN"] * (N - 60)
    assert "Force" in refusal(tmp_path, ["Time,,Displacement,,Force,"], mixed)


def test_two_capacitances_without_a_press_are_a_choice_of_the_capacitance_alone(tmp_path: Path) -> None:
    said = refusal(tmp_path, ["t_s,Cx_pF,Cref_pF"], [T, C, written(0 * CAP + 47.018, 1, 3)])
    assert "no capacitance column among" in said
    assert "--columns capacitance=Cx_pF" in said
    assert "no force" not in said
    assert "no displacement" not in said


# --- titles above pairs of columns -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "head",
    [
        ["Displacement (mm) vs Time (s),,Force (N) vs Time (s),", "X,Y,X,Y"],
        ["Displacement (mm) over Time (s),,Force (N) over Time (s)", "x,y,x,y"],
        ["Displacement (mm),,Force (N),", "Time (s),Value,Time (s),Value"],
        ['"Weg [mm]","","Kraft [N]",""', '"Zeit [s]","Wert","Zeit [s]","Wert"'],
        ["Curves of 12 March", "", "Displacement (mm),,Force (N),", "Time (s),Value,Time (s),Value"],
    ],
)
def test_titles_above_pairs_of_columns_name_them(tmp_path: Path, head: list[str]) -> None:
    table = read(tmp_path, head, [T, D, T, F])
    assert_right(table)
    assert "columns are named by the titles above their pairs" in table.notes


@pytest.mark.parametrize(
    "head",
    [
        ["Displacement (mm),,Force (N),", "X,Y,X,Y"],
        ["Displacement (mm) vs Time (s),,Force setpoint (N) vs Time (s),", "X,Y,X,Y"],
        ["Press 1,,Press 2,", "Time (s),Value,Time (s),Value"],
    ],
)
def test_titles_that_leave_a_column_without_a_name_are_refused(tmp_path: Path, head: list[str]) -> None:
    assert "press.csv" in refusal(tmp_path, head, [T, D, T, F])


def test_pairs_of_two_clocks_below_titles_are_refused(tmp_path: Path) -> None:
    later = [f"{0.13 * i:.2f}" for i in range(N)]
    head = ["Displacement (mm) vs Time (s),,Force (N) vs Time (s),", "X,Y,X,Y"]
    assert "time" in refusal(tmp_path, head, [T, D, later, F]).lower()


def test_the_waves_of_an_igor_text_file_are_columns(tmp_path: Path) -> None:
    def waves(names: str, *more: str) -> list[str]:
        rows = [f"\t{t}\t{d}\t{f}" for t, d, f in zip(T, D, F, strict=True)]
        return ["IGOR", f"WAVES/D\t{names}", "BEGIN", *rows, "END", *more]

    assert_right(read(tmp_path, waves("time_s, disp_mm, force_N"), []))
    scale = 'X SetScale/P x 0,0.1,"s", time_s'
    assert_right(read(tmp_path, waves("'time_s', 'disp_mm', 'force_N'", scale), []))
    assert "press.csv" in refusal(tmp_path, [*waves("time_s, disp_mm, force_N"), *waves("time_s, disp_mm, force_N")], [])


# --- a series capacitance and its resistance --------------------------------------------------------------------------------

RESISTANCE = np.round(150 + 20 * LOAD, 2)
LOSS = 2 * np.pi * 1e6 * RESISTANCE * 1e-12 * CAP
RS = [f"{x:.2f}" for x in RESISTANCE]


@pytest.mark.parametrize(
    ("head", "frequency"),
    [
        (["Time (s),Cs (pF),Rs (ohm),Frequency (kHz)"], ["1000"] * N),
        (["Frequency: 1 MHz, 0.5 V", "Time (s),Cs (pF),Rs (ohm)"], None),
        (["Time (s),Cs @ 1 MHz (pF),ESR (Ω)"], None),
        (["# f = 1000 kHz", "Time,Cs,Rs", "s,pF,ohm"], None),
    ],
)
def test_a_series_resistance_at_a_known_frequency_gives_the_parallel_capacitance(
    tmp_path: Path, head: list[str], frequency: list[str] | None
) -> None:
    table = read(tmp_path, head, [T, C, RS, *([frequency] if frequency else [])])
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAP / (1 + LOSS**2), rtol=1e-9)
    np.testing.assert_allclose(table.columns["dissipation"], LOSS, rtol=1e-9)
    assert any("dissipation is 2 pi f Rs Cs" in note and "1e+06 Hz" in note for note in table.notes)


@pytest.mark.parametrize(
    "head",
    [
        ["Time (s),Cs (pF),Rs (ohm)"],
        ["Frequency: 1 kHz to 1 MHz", "Time (s),Cs (pF),Rs (ohm)"],
        ["Frequency: 1 MHz", "Time (s),Cs (pF),Rp (ohm)"],
        ["Frequency: 1 MHz", "Time (s),Cs (pF),R (ohm)"],
        ["Frequency: 50 MHz", "Time (s),Cs (pF),Rs (ohm)"],
    ],
)
def test_a_resistance_that_is_not_told_to_be_in_series_or_without_a_frequency_is_asked_about(
    tmp_path: Path, head: list[str]
) -> None:
    assert "no column D" in refusal(tmp_path, head, [T, C, RS])
