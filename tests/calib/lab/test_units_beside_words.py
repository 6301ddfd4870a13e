"""Rows of units with words in them, tables without names, numbers for names: read as written, or refused with a way out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, observe, read_lab_file
from calib.lab.instruments.stated import stated_factors
from calib.lab.instruments.unit_cells import UnitCell, begins_with_unit, unit_cell
from calib.lab.instruments.vocabulary import heading_as, understand

N = 80
TIME = np.round(np.arange(N) * 0.1, 3)
DEPTH = np.round(np.arange(N) * 0.01, 4)
FORCE = np.round(0.21 + 5.0 * np.clip(DEPTH - 0.1, 0, None) ** 1.5, 4)
CAPACITANCE = np.round(97.3 + 0.5 * FORCE, 4)
PRESS = (TIME, DEPTH, FORCE)
UNITS = {"time": "s", "displacement": "mm", "force": "N"}
NUMBERED = {"time": "1", "displacement": "2", "force": "3"}


def rows(*columns: np.ndarray) -> list[str]:
    return [",".join(f"{v:.4f}" for v in row) for row in zip(*columns, strict=True)]


def read(tmp_path: Path, lines: Sequence[str], encoding: str = "utf-8", **said: Any) -> LabTable:
    path = tmp_path / "lab.csv"
    path.write_bytes(("\n".join(lines) + "\n").encode(encoding))
    return read_lab_file(path, Reading(**said))


def refusal(tmp_path: Path, lines: Sequence[str], **said: Any) -> str:
    with pytest.raises(InputError) as caught:
        read(tmp_path, lines, **said)
    assert all(f.advice for f in caught.value.faults)
    return str(caught.value)


def assert_press(table: LabTable, force: np.ndarray = FORCE) -> None:
    for name, wanted in (("time", TIME), ("displacement", DEPTH * 1e-3), ("force", force)):
        np.testing.assert_allclose(table.columns[name], wanted, rtol=1e-12, atol=1e-15)
    assert not any(table.reasons)


def unread(table: LabTable) -> Mapping[str, str]:
    return {u.what: u.reason for u in table.unread}


# --------------------------------------------------------------------------------------------------- remarks within names


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Displacement (mm, crosshead),Force (N, tared)",
        "Time (s),Displacement (mm),Force (N; tared)",
        "Time..s.,Displacement..mm.,Force..N.",
        "Time.s.,Crosshead.displacement..mm.,Compressive.load..N.",
        "Time (s),Displacement (mm),Force (N) filtered 10 Hz",
        "Time (s),Displacement (mm),Force (N) low-pass @ 1 kHz",
        "Time (s),Displacement (mm),Force (N, compression positive)",
        "Time (s),Displacement (mm),Force (N, tension = negative)",
    ],
)
def test_a_remark_beside_a_unit_in_a_name_leaves_the_column_what_it_is(tmp_path: Path, header: str) -> None:
    assert_press(read(tmp_path, [header, *rows(*PRESS)]))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Force (N, lbf)", 'two units, "N" and "lbf"'),
        ("Force (N, peak)", '"peak" is a statistic'),
        ("Force (N, x10)", 'the factor "x10"'),
        ("Force (N, setpoint)", '"setpoint" was commanded'),
        ("Force (N, quux)", "is not understood"),
    ],
)
def test_a_remark_beside_a_unit_that_changes_the_column_is_none(tmp_path: Path, name: str, said: str) -> None:
    lines = [line.replace(",", ";") for line in rows(*PRESS)]
    assert said in refusal(tmp_path, [f"Time (s);Displacement (mm);{name}", *lines])


def test_a_bracket_that_is_not_closed_joins_nothing(tmp_path: Path) -> None:
    lines = ["Time (s),Displacement (mm),Load (N,Note (a)", *(f"{row},0" for row in rows(*PRESS))]
    assert '"Load (N", "Note (a)"' in refusal(tmp_path, lines)


@pytest.mark.parametrize(("sense", "words"), [(1, "compression positive"), (-1, "compression negative"), (-1, "tension: +")])
def test_a_name_that_says_which_way_compression_is_counts_as_evidence_and_the_record_more(
    tmp_path: Path, sense: int, words: str
) -> None:
    lines = [f"Time (s),Displacement (mm),Force (N, {words})", *rows(TIME, DEPTH, sense * FORCE)]
    note = observe(read(tmp_path, lines)).signs["force"].note
    assert f'; force is called "Force (N, {words})"' in note
    assert ("sign kept" in note) == (sense > 0)
    against = observe(read(tmp_path, [lines[0], *rows(TIME, DEPTH, -sense * FORCE)])).signs["force"].note
    assert "although force is called" in against
    assert ("sign kept" in against) == (sense < 0)


def test_row_names_of_r_have_no_name_in_the_header_and_are_told_by_their_quotes(tmp_path: Path) -> None:
    lines = ['"time_s","depth_mm","force_N"', *(f'"{k}",{row}' for k, row in enumerate(rows(*PRESS), 1))]
    table = read(tmp_path, lines)
    assert_press(table)
    assert unread(table)['column 1 "row names"'] == "names of the rows: not used"
    assert any("as R and pandas write them" in note for note in table.notes)
    # Without quotes the fourth cell may as well be what has no name.
    assert "the row has 4 cells, the header has 3" in refusal(tmp_path, [line.replace('"', "") for line in lines])


@pytest.mark.parametrize(("first", "unit", "day"), [(46110.4, "d", "2026-03-29"), (1774742370.0, "s", "2026-03-28")])
def test_a_time_that_is_a_date_says_when_the_record_began(tmp_path: Path, first: float, unit: str, day: str) -> None:
    step = 86400 if unit == "d" else 1
    lines = [f"{first + t / step:.9f},{d:.4f},{f:.4f}" for t, d, f in zip(*PRESS, strict=True)]
    started = read(tmp_path, ["Time,Extension (mm),Load (N)", *lines], units={"time": unit}).started
    assert started is not None
    assert started.date().isoformat() == day


# ----------------------------------------------------------------------------------------------------- words beside units


@pytest.mark.parametrize(
    ("below", "words"),
    [
        ("(s),(mm) crosshead,(N) compression positive", "compression positive"),
        ("s,mm [crosshead],N [100 N cell]", "[100 N cell]"),
        ("sec,mm (from LVDT),N (filtered)", "(filtered)"),
        ("[s],[mm]*,[N]**", ""),
        ("(s),(mm),(N) *zeroed at start", "zeroed at start"),
        ("in s,in mm,in N", ""),
        ("unit: s,unit: mm,unit: N", ""),
        ('s,"mm, crosshead","N, cell 2"', "cell 2"),
        ('s,"(mm, crosshead)","(N, tared)"', "tared"),
    ],
)
def test_words_beside_a_unit_are_told_and_change_nothing(tmp_path: Path, below: str, words: str) -> None:
    table = read(tmp_path, ["Time,Extension,Load", below, *rows(*PRESS)])
    assert_press(table)
    assert not words or any(words in u.reason for u in table.unread), table.unread


@pytest.mark.parametrize(
    "cell",
    [
        *("(N) x10", "(N)/10", "N *10", "N ×10³", "N 10^-1", "N [0.1]", "N (thousandths)", "N E3", "N per mm", "N in tens"),
        *("N or kN", "(N) or (kN)", "N (kN)", "N = 0.102 kgf", "N max", "N (peak hold)", "N error", "N m torque"),
    ],
)
def test_words_that_may_change_a_unit_leave_the_column_without_one(tmp_path: Path, cell: str) -> None:
    lines = ["Time,Extension,Load", f"s,mm,{cell}", *rows(*PRESS)]
    assert 'column "Load" has no unit' in refusal(tmp_path, lines)
    table = read(tmp_path, lines, units={"force": "N"})
    assert_press(table)
    assert any(cell[:40] in u.reason for u in table.unread)
    # Where it is so of several columns the row is one of units all the same.
    several = ["Time,Extension,Load", f"s,mm x10,{cell}", *rows(*PRESS)]
    assert "has no unit" in refusal(tmp_path, several)
    assert_press(read(tmp_path, several, units={"force": "N", "displacement": "mm"}))


def test_words_beside_the_unit_of_a_capacitance_say_its_circuit(tmp_path: Path) -> None:
    loss = np.full(N, 0.4)
    table = read(tmp_path, ["Time,C,D", "s,pF (series),-", *rows(TIME, CAPACITANCE, loss)])
    np.testing.assert_allclose(table.columns["capacitance"], CAPACITANCE * 1e-12 / 1.16, rtol=1e-12)
    assert any("series capacitance" in note and "line 2" in note for note in table.notes)
    alone = ["Time,C", "s,pF (series)", *rows(TIME, CAPACITANCE)]
    said = refusal(tmp_path, alone)
    assert '--columns "capacitance=C (pF)"' in said
    np.testing.assert_allclose(read(tmp_path, alone, columns={"capacitance": "C (pF)"}).columns["capacitance"][0], 97.405e-12)
    assert "may be a series or a parallel" in refusal(tmp_path, ["Time,Cp", "s,pF (series)", *rows(TIME, CAPACITANCE)])
    assert 'column "C" has no unit' in refusal(tmp_path, ["Time,C", "s,pF rel.", *rows(TIME, CAPACITANCE)])


def test_a_clocks_form_is_no_unit_with_words_behind_it() -> None:
    assert unit_cell("h:min:s") is None
    assert unit_cell("N (ch 2)") == UnitCell("N", "(ch 2)")
    assert [begins_with_unit(c) for c in ("N or kN", "A sensor", "Load", "(C) cell")] == [True, False, False, True]


# ------------------------------------------------------------------------------------------------- tables without names


@pytest.mark.parametrize(
    "above",
    [
        ["s,mm,N"],
        ["(s),(mm),(N)"],
        ["1,2,3", "s,mm,N"],
        ["0,1,2", "[s],[mm],[N]"],
        ["# a remark", "s,mm,N"],
        ["Time,Extension,Load", "T1,D1,F1", "s,mm,N"],
    ],
)
def test_units_above_a_table_without_names_are_taken(tmp_path: Path, above: list[str]) -> None:
    assert_press(read(tmp_path, [*above, *rows(*PRESS)], columns=NUMBERED))


@pytest.mark.parametrize("above", ["0,1,2", "1,2,3", "1,2,3,"])
@pytest.mark.parametrize("decimals", [True, False])
def test_a_row_that_counts_the_columns_is_no_reading(tmp_path: Path, above: str, decimals: bool) -> None:
    columns = PRESS if decimals else tuple(np.round(v * f) for v, f in zip(PRESS, (10, 100, 1000), strict=True))
    lines = [above, *([f"{a:.{4 * decimals}f}" for a in row] for row in zip(*columns, strict=True))]
    written = [line if isinstance(line, str) else ",".join(line) + "," * (above.count(",") - 2) for line in lines]
    units = UNITS if decimals else {"time": "0.1 s", "displacement": "10 um", "force": "mN"}
    table = read(tmp_path, written, columns=NUMBERED, units=units)
    assert len(table.lines) == N
    assert unread(table)["line 1"].startswith("numbers of the columns")
    if decimals:
        assert_press(table)


def test_the_index_of_a_data_frame_and_its_numbers_of_columns_are_no_readings(tmp_path: Path) -> None:
    indexed = [f"{i},{line}" for i, line in enumerate(rows(*PRESS))]
    table = read(tmp_path, [",0,1,2", *indexed], columns={q: str(int(c) + 1) for q, c in NUMBERED.items()}, units=UNITS)
    assert_press(table)


def test_a_number_of_a_column_that_is_not_there_or_named_twice_is_refused(tmp_path: Path) -> None:
    assert "there is no column 9: the rows have 3" in refusal(tmp_path, rows(*PRESS), columns={**NUMBERED, "force": "9"})
    assert "there is no column 0" in refusal(tmp_path, rows(*PRESS), columns={**NUMBERED, "time": "0"})
    twice = refusal(tmp_path, rows(*PRESS), columns={**NUMBERED, "displacement": "3"})
    assert 'column "3" is named for displacement and for force' in twice
    refusal(tmp_path, rows(*PRESS), columns={**NUMBERED, "force": "²"})


def test_superscript_digits_below_a_header_are_no_crash(tmp_path: Path) -> None:
    assert "another header" in refusal(tmp_path, ["Time (s),Extension (mm),Load (N)", "²,³,¹", *rows(*PRESS)])


def test_names_that_are_numbers_are_chosen_as_the_refusal_says(tmp_path: Path) -> None:
    for lines in (
        ["Time (s),1000,10000", *rows(TIME, CAPACITANCE, CAPACITANCE - 1)],
        ["Time (s),1000,10000", ",Hz,Hz", *rows(TIME, CAPACITANCE, CAPACITANCE - 1)],
    ):
        said = refusal(tmp_path, lines)
        assert "numbers stand where names of columns would: 1000, 10000" in said
        assert "--columns capacitance=1000 --units capacitance=..." in said
        for name in ("1000", "2"):
            table = read(tmp_path, lines, columns={"capacitance": name}, units={"capacitance": "pF"})
            np.testing.assert_allclose(table.columns["capacitance"], CAPACITANCE * 1e-12, rtol=1e-12)
            np.testing.assert_array_equal(table.columns["time"], TIME)


def test_a_result_above_a_table_without_names_is_no_header_of_it(tmp_path: Path) -> None:
    table = read(
        tmp_path,
        ["Load (N),500", *rows(DEPTH, FORCE)],
        columns={"displacement": "1", "force": "2"},
        units={"displacement": "mm", "force": "N"},
    )
    np.testing.assert_allclose(table.columns["force"], FORCE, rtol=1e-12)
    assert "line 1" in unread(table)


# ---------------------------------------------------------------------------------------------------------- other causes


def test_specimens_below_each_other_have_units_of_their_own(tmp_path: Path) -> None:
    first = ["1,Time,Displacement,Force", ",(s),(mm),(N)", *(f",{line}" for line in rows(*PRESS))]
    second = ["2,Time,Displacement,Force", ",(s),(mm),(kN)", *(f",{line}" for line in rows(TIME, DEPTH, FORCE))]
    for between in ([], [""]):
        lines = [*first, *between, *second]
        assert "holds 2 specimens" in refusal(tmp_path, lines)
        assert_press(read(tmp_path, lines, specimen=1))
        assert_press(read(tmp_path, lines, specimen=2), FORCE * 1e3)


def test_one_record_whose_header_is_repeated_in_other_units_is_refused(tmp_path: Path) -> None:
    head = ["Time,Displacement,Force", "(s),(mm),(N)"]
    other = ["Time,Displacement,Force", "(s),(mm),(kN)"]
    said = refusal(tmp_path, [*head, *rows(*PRESS)[:40], *other, *rows(*PRESS)[40:]])
    assert "the units of this block differ from those in line 2" in said
    assert "lab.csv:44" in said
    assert_press(read(tmp_path, [*head, *rows(*PRESS)[:40], *head, *rows(*PRESS)[40:]]))


def test_a_testers_status_among_the_rows_is_named_and_other_text_refused(tmp_path: Path) -> None:
    head, press = "Time (s),Extension (mm),Load (N)", rows(*PRESS)
    table = read(tmp_path, [head, *press[:40], "Status: Running", *press[40:], "Status: Stopped"])
    assert_press(table)
    assert unread(table)["line 42"].endswith('"Status: Running"')
    for line in ("Status: load cell tared", "Status: x10", "State: range 2"):
        assert "stands among the rows" in refusal(tmp_path, [head, *press[:40], line, *press[40:]])


def test_the_range_of_a_meter_is_no_statistic_and_a_key_is_used(tmp_path: Path) -> None:
    once = [f"{t:.1f},100,{c:.4f}" for t, c in zip(TIME, CAPACITANCE, strict=True)]
    table = read(tmp_path, ["Time (s),Range,Cp (pF)", *once])
    assert unread(table)['column 2 "Range"'] == "a range of the instrument: not used"
    swept = [f"{t + 0.02 * k:.2f},{100 * 10**k},{c + k:.4f}" for t, c in zip(TIME, CAPACITANCE, strict=True) for k in (0, 1)]
    assert '"100", "1000"' in refusal(tmp_path, ["Time (s),Range,Cp (pF)", *swept])
    chosen = read(tmp_path, ["Time (s),Range,Cp (pF)", *swept], where={"Range": "100"})
    assert unread(chosen)['column 2 "Range"'] == "rows are chosen by it"


def test_a_nominal_strain_is_a_strain(tmp_path: Path) -> None:
    table = read(tmp_path, ["Time (s),Extension (mm),Load (N),Nominal strain (%)", *rows(*PRESS, DEPTH * 50)])
    assert unread(table)['column 4 "Nominal strain (%)"'] == "a strain: not used"


def test_of_two_loads_that_agree_the_finer_is_read(tmp_path: Path) -> None:
    pounds = np.round(FORCE / 4.4482216, 2)
    lines = [f"{t:.1f},{d:.4f},{p:.2f},{f:.4f}" for t, d, p, f in zip(TIME, DEPTH, pounds, FORCE, strict=True)]
    table = read(tmp_path, ["Time (s),Extension (mm),Load (lbf),Load (N)", *lines])
    assert_press(table)
    assert "the same readings" in unread(table)['column 3 "Load (lbf)"']


def test_a_time_without_a_unit_beside_the_same_with_one_is_no_choice(tmp_path: Path) -> None:
    table = read(tmp_path, ["Time (s),T (degC),Zeit,Cp (pF)", *rows(TIME, TIME * 0 + 22, TIME, CAPACITANCE)])
    np.testing.assert_array_equal(table.columns["time"], TIME)
    said = refusal(tmp_path, ["Time (s),Zeit,Cp (pF)", *rows(TIME, TIME * 3 + 0.5, CAPACITANCE)])
    assert '"Zeit" has no unit that is known' in said


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("temps [s],Position verin [mm],Force cellule [N]", "utf-8"),
        ("Czas [s],Droga [mm],Siła ściskająca [N]", "iso8859-2"),
        ("Czas [s],Droga [mm],Siła ściskająca [N]", "cp1250"),
        ("Czas (s),Zagłębienie (mm),Nacisk (N)", "utf-8"),
        ("Czas (s),Skrócenie (mm),Siła (N)", "cp1250"),
        ('"Prüfzeit  ","Standardwe (mm)","Standardkr (N)"', "latin-1"),
        ("Time (s),Displaceme (mm),Compressiv (N)", "utf-8"),
    ],
)
def test_names_of_more_languages_and_names_cut_to_a_width(tmp_path: Path, header: str, encoding: str) -> None:
    assert_press(read(tmp_path, [header.replace("Prüfzeit  ", "Prüfzeit (s)"), *rows(*PRESS)], encoding))


def test_a_cut_name_that_may_be_of_several_quantities_is_none(tmp_path: Path) -> None:
    assert "no force column" in refusal(tmp_path, ["Time (s),Extension (mm),Compressiv", *rows(*PRESS)])


def test_a_column_in_the_unit_of_what_is_missing_is_offered(tmp_path: Path) -> None:
    lines = ["Time (s),E1-E2 (pF),E1-E3 (pF)", *rows(TIME, CAPACITANCE, CAPACITANCE + 1)]
    assert '--columns "capacitance=E1-E2 (pF)" or --columns "capacitance=E1-E3 (pF)"' in refusal(tmp_path, lines)
    table = read(tmp_path, lines, columns={"capacitance": "E1-E2 (pF)"})
    np.testing.assert_allclose(table.columns["capacitance"], CAPACITANCE * 1e-12, rtol=1e-12)
    named = ["Time (s),pF", *rows(TIME, CAPACITANCE)]
    table = read(tmp_path, named, columns={"capacitance": "2"})
    np.testing.assert_allclose(table.columns["capacitance"], CAPACITANCE * 1e-12, rtol=1e-12)


def test_a_strain_alone_is_refused_with_how_it_is_read_by_a_height(tmp_path: Path) -> None:
    lines = ["Time (s),Compression (%),Load (N)", *rows(TIME, DEPTH * 50, FORCE)]
    assert '--columns "displacement=Compression (%)" --units "displacement=0.02 mm"' in refusal(tmp_path, lines)
    table = read(tmp_path, lines, columns={"displacement": "Compression (%)"}, units={"displacement": "0.02 mm"})
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3, rtol=1e-9)


# ------------------------------------------------------------------------------------------------ what is said above a header


@pytest.mark.parametrize(
    "line",
    [
        "# NOTE: multiply Load column by 2 (bridge calibration 2024)",
        "Force values must be divided by 1000",
        "Kraft mit 2,5 multiplizieren: multiplizieren mit 2,5",
    ],
)
def test_a_factor_that_is_to_be_applied_is_asked_for(tmp_path: Path, line: str) -> None:
    said = refusal(tmp_path, [line, "Time (s),Displacement (mm),Load (N)", *rows(*PRESS)])
    assert "states a factor" in said
    twice = read(tmp_path, [line, "Time (s),Displacement (mm),Load (N)", *rows(*PRESS)], units={"force": "2 N"})
    assert_press(twice, 2 * FORCE)


@pytest.mark.parametrize(
    ("line", "of"),
    [
        ("# scale factors: displacement 0.001, force 0.001", ("displacement", "force")),
        ("Gains: Load 2, Disp 1", ("force",)),
        ("Scale;Load;0.01;Extension;1", ("force",)),
        ("Load x 0.001; Displacement x 0.001", ("force", "displacement")),
        ("Skalierungsfaktoren: Kraft 0,001; Weg 0,001", ("force", "displacement")),
        ("amplification 10 (force), 1 (displacement)", ("force",)),
        ("force_scale: 2.0 # N per count", ("force",)),
        ("values are scaled by 1000", ("",)),
        ("all forces times 2", ("force",)),
        ("Note: Force readings are 10x too large", ("force",)),
        ("1 unit = 10 mN", ("force",)),
        ("Load in units of 10 mN", ("force",)),
        ("true force = column / 10", ("force",)),
        ("data recorded at 1/10 scale", ("",)),
        ("Umrechnungsfaktor Kraft: 9.81", ("force",)),
        ("Kraftwerte x10", ("force",)),
        ("Messwerte der Kraft mit 10 multiplizieren", ("force",)),
        ("Kraft /10 rechnen", ("force",)),
        ("factor 0.1 on load channel", ("force",)),
        ("gain 10 on force", ("force",)),
        ("Force reading is 1/10 of real load", ("force",)),
        ("Lever arm ratio 5", ("force",)),
        ("Lever 5:1, force at the long arm", ("force",)),
        ("Hebel: 120/40", ("force",)),
        ("Hebelverhältnis 1:5", ("force",)),
        ("Sensitivity 2 N/V not applied", ("",)),
    ],
)
def test_every_factor_of_a_line_is_known_with_what_it_is_of(line: str, of: tuple[str, ...]) -> None:
    assert tuple(stated_factors([line])) == of


@pytest.mark.parametrize(
    "line",
    [
        *("Start times 10:30", "repeated 3 times", "Load cell range: 50 N", "Gain: 1, Channel 2", "Scale: linear, 5 mm/div"),
        *("Test scale factors: none", "PID gains: P 2, I 0.1, D 0", "Step: 0.01 mm", "Number of units: 3", "multiplier 1x"),
        *("Load scale: 0-10 N", "Speed reduced by 10", "Load cell: 10 kg, HX711 gain 128", "Resolution: 1 digit = 0.01 N"),
        *("A = 2*pi*R", "Scale Kern PCB 1000, max 1000 g, d=0.01 g", "Date: 12/03/2026, Operator 2"),
        *(
            "Lever arm 120 mm",
            "Hebelarm 5 cm",
            "Lever 1:1",
            "gain 100 on thermocouple",
            "thermocouple gain 10",
            "Force is 1/3 of the stroke",
        ),
        *("Kraft mit 10 N", "Sensitivity 2 mV/V", "Range 10 N of load", "Factor 2 for sample A"),
    ],
)
def test_a_line_with_numbers_of_something_else_states_no_factor(line: str) -> None:
    assert not stated_factors([line])


@pytest.mark.parametrize("line", ["Deviation mode: ABS, REF 90.000 pF", "DEV,%", "Abweichung: ein", "Delta mode = REL"])
def test_a_meter_that_shows_deviations_has_no_capacitance(tmp_path: Path, line: str) -> None:
    table = [line, "Time (s),Cp (pF),D", *rows(TIME, CAPACITANCE - 90, 0.004 + 0 * TIME)]
    assert "how far it is from a reference" in refusal(tmp_path, table)


@pytest.mark.parametrize("line", ["Deviation mode: OFF", "Standard deviation (%): 0.1", "Station: Dev 2", "deviation: 0.3 %"])
def test_a_meter_that_shows_none_is_read(tmp_path: Path, line: str) -> None:
    table = read(tmp_path, [line, "Time (s),Cp (pF),D", *rows(TIME, CAPACITANCE, 0.004 + 0 * TIME)])
    np.testing.assert_allclose(table.columns["capacitance"], CAPACITANCE * 1e-12, rtol=1e-9)


def test_exponents_as_fortran_writes_them_are_read(tmp_path: Path) -> None:
    lines = [",".join(f"{v:.10E}".replace("E", "D") for v in row) for row in zip(*PRESS, strict=True)]
    assert_press(read(tmp_path, ["Time (s),Displacement (mm),Force (N)", *lines]))


@pytest.mark.parametrize("cell", ["#N/A", "#NV", "#VALUE!", "#DIV/0!", "n.a.", "—"])
def test_a_cell_of_a_spreadsheet_without_a_number_is_empty(tmp_path: Path, cell: str) -> None:
    lines = rows(*PRESS)
    lines[20] = ",".join([*lines[20].split(",")[:2], cell])
    table = read(tmp_path, ["Time (s),Displacement (mm),Force (N)", *lines])
    assert [k for k, why in enumerate(table.reasons) if why] == [20]


@pytest.mark.parametrize(
    "name", ["x10 Force (N)", "X100_Load (N)", "x 10 Kraft [N]", "x1000  Force", "/10 Force (N)", ":10 Load (N)"]
)
def test_a_factor_before_a_name_is_no_number_of_a_channel(name: str) -> None:
    assert understand(name) is None
    assert "factor" in heading_as("force", name, "").unit_doubt
    assert understand("X1 Force (N)") is not None
    assert understand("C_1_Force[kN]") is not None


@pytest.mark.parametrize(
    ("names", "encoding"),
    [
        (("Zeit (s)", "Weg (µm)", "Kraft (mN)", "T (°C)"), "cp1252"),
        (("Zeit [s]", "Weg [µm]", "Kraft [mN]", "T [°C]"), "cp1252"),
        (("时间(s)", "位移(µm)".replace("µ", "μ"), "力(mN)", "温度(℃)"), "gbk"),
        (("時間(s)", "変位(μm)", "荷重(mN)", "温度(℃)"), "shift_jis"),
        (("Время (с)", "Перемещение (мкм)", "Сила (мН)", "Температура"), "cp1251"),
    ],
)
def test_a_unit_with_a_sign_of_no_ascii_is_read_in_its_encoding(tmp_path: Path, names: Sequence[str], encoding: str) -> None:
    header = ";".join(names)
    lines = [f"{t:.3f};{1e3 * d:.1f};{1e3 * f:.2f};22.5" for t, d, f in zip(*PRESS, strict=True)]
    table = read(tmp_path, [header, *lines], encoding)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3, atol=1e-10)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-5)


@pytest.mark.parametrize("cell", ["N (5N cell; tared)", "N (tared; 5 N)", "mm (stage encoder, 10 mm)", "N (5N cell, tared)"])
def test_the_reach_of_an_instrument_beside_other_words_leaves_a_unit(cell: str) -> None:
    found = unit_cell(cell)
    assert found is not None
    assert found.unit == cell.split()[0]


@pytest.mark.parametrize("cell", ["N (5N cell; x10)", "N (tared; peak)", "N (5N; kN)", "mm (10 mm; fitted)"])
def test_another_word_beside_a_reach_that_changes_the_readings_does_not(cell: str) -> None:
    assert unit_cell(cell) is None


def test_the_mark_of_a_footnote_behind_a_unit_is_passed_by(tmp_path: Path) -> None:
    assert_press(read(tmp_path, ["Time (s),Displacement (mm),Force (N)*", *rows(*PRESS)]))


# ------------------------------------------------------------------------------- words beside a table that are not of it


@pytest.mark.parametrize(("unit", "factor"), [("N", 1.0), ("mN", 1e-3)])
@pytest.mark.parametrize("named", ["Maximum Compressive load ({})", "Maximum Compressive force [{}]"])
def test_a_table_of_results_above_has_units_of_its_own(tmp_path: Path, named: str, unit: str, factor: float) -> None:
    results = ["Results", f'"","{named.format(unit)}","Extension at maximum (mm)"', f'"1",{FORCE.max() / factor:.4f},0.79', ""]
    raw = ["Time,Extension,Load", "(s),(mm),(kN)", *rows(TIME, DEPTH, FORCE / 1000)]
    table = read(tmp_path, [*results, *raw])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=0.06)
    assert any("are results, in units of their own" in note for note in table.notes)


def test_a_table_of_results_that_names_its_specimens_has_units_of_its_own(tmp_path: Path) -> None:
    results = ["Results", '"","Specimen label","Maximum Load (N)"', f'"1","S-01",{FORCE.max():.4f}', ""]
    table = read(tmp_path, [*results, "Time,Extension,Load", "(s),(mm),(kN)", *rows(TIME, DEPTH, FORCE / 1000)])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=0.06)
    assert any("are results, in units of their own" in note for note in table.notes)
    assert "says that the unit" in refusal(tmp_path, [*results, "Time,Extension,Load", "(s),(mm),(kN)", *rows(*PRESS)])


def test_results_that_are_none_of_the_readings_contradict_their_unit(tmp_path: Path) -> None:
    results = ["Results", '"","Maximum Compressive load (N)","Extension at maximum (mm)"', f'"1",{FORCE.max():.4f},0.79', ""]
    assert "says that the unit" in refusal(tmp_path, [*results, "Time,Extension,Load", "(s),(mm),(kN)", *rows(*PRESS)])


@pytest.mark.parametrize(
    "line",
    ["Tare done, offset -83422, scale 412.7", "offset=123456 scale: 2280", "Tare: 84512; scale -7050.0"],
)
@pytest.mark.parametrize("unit", ["g", "N"])
def test_what_the_counts_of_a_converter_are_divided_by_is_no_factor_of_readings_in_a_unit(
    tmp_path: Path, line: str, unit: str
) -> None:
    table = read(tmp_path, ["HX711 init...", line, f"t_ms,pos_mm,load_{unit}", *rows(1000 * TIME, DEPTH, FORCE)])
    np.testing.assert_allclose(table.columns["force"], FORCE * (9.80665e-3 if unit == "g" else 1.0), rtol=1e-12)
    assert any("what the raw counts of a converter were divided by" in note for note in table.notes)


@pytest.mark.parametrize("line", ["Load scale 10", "offset 0.2, scale 412.7", "Tare done, offset -83422, scale 10"])
def test_another_scale_is_a_factor(tmp_path: Path, line: str) -> None:
    assert "states a factor" in refusal(tmp_path, ["ready", line, "t_ms,pos_mm,load_g", *rows(1000 * TIME, DEPTH, FORCE)])


def test_readings_without_decimals_may_be_the_counts(tmp_path: Path) -> None:
    whole = [f"{1000 * t:.0f},{d:.3f},{1e4 * f:.0f}" for t, d, f in zip(*PRESS, strict=True)]
    said = refusal(tmp_path, ["ready", "Tare done, offset -83422, scale 412.7", "t_ms,pos_mm,load_g", *whole])
    assert "states a factor" in said


@pytest.mark.parametrize("time", ["Time  1 - default sample rate", "Zeit  1 - Standard-Messrate"])
def test_names_that_are_understood_by_the_units_below_them_are_a_header(tmp_path: Path, time: str) -> None:
    names = [f"{time},MX440A_CH1_Force,MX440A_CH2_Displacement", "s,N,mm"]
    table = read(tmp_path, ["T0=12.03.2024 14:11:05", *names, *rows(TIME, FORCE, DEPTH)])
    assert_press(table)


@pytest.mark.parametrize("name", ["C0 [pF]", "C0 (pF)"])
def test_a_capacitance_c0_that_moves_is_a_channel_and_one_that_rests_or_drifts_is_not(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, [f"Time (s),C0/Cref,{name}", *rows(TIME, CAPACITANCE / 47, CAPACITANCE)])
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * CAPACITANCE, rtol=1e-12)
    assert any("it is not the capacitance at rest" in note for note in table.notes)
    noise = np.round(97.3 + 0.01 * np.sin(7.3 * np.arange(N) ** 1.3), 4)
    for still in (np.full(N, 97.3), noise):
        assert "capacitance at rest" in refusal(tmp_path, [f"Time (s),C0/Cref,{name}", *rows(TIME, still / 47, still)])
    there_and_back = np.concatenate([DEPTH[: N // 2], DEPTH[: N // 2][::-1]])
    drift = np.round(97.3 + 0.4 * TIME / TIME[-1], 4)
    assert "capacitance at rest" in refusal(tmp_path, [f"Time (s),Extension (mm),{name}", *rows(TIME, there_and_back, drift)])


def test_units_in_cells_of_their_own_behind_the_names_are_theirs_where_rows_have_half_as_many(tmp_path: Path) -> None:
    table = read(tmp_path, ["Time, s,Extension, mm,Load, N", *rows(*PRESS)])
    assert_press(table)
    assert any("the unit of each column stands in a cell of its own" in note for note in table.notes)
    for names in ("Time, s,Extension, mm,Load", "Time, s,Extension, mm,Load, left"):
        assert refusal(tmp_path, [names, *rows(*PRESS)])


@pytest.mark.parametrize("line", ["# units: time s; disp um; force mN", "# Units: s, um, mN"])
def test_units_declared_in_a_comment_that_ends_the_file_are_those_of_the_columns(tmp_path: Path, line: str) -> None:
    table = read(tmp_path, ["time,disp,force", *rows(TIME, 1e3 * DEPTH, 1e3 * FORCE), line])
    assert_press(table)
    assert any(f"line {N + 2} says the unit of time (s)" in note for note in table.notes)


def test_units_that_end_the_file_and_contradict_those_of_the_names_are_asked_about(tmp_path: Path) -> None:
    said = refusal(tmp_path, ["Time (s),Disp (mm),Force (N)", *rows(*PRESS), "# units: time s; disp mm; force mN"])
    assert "mN" in said


@pytest.mark.parametrize("unit", ["N·10⁻³", "N·10^-3", "N ⋅ 10⁻³"])
def test_a_power_of_ten_behind_a_unit_and_a_point_is_one_unit_with_it(tmp_path: Path, unit: str) -> None:
    table = read(tmp_path, [f"Time (s),Extension (mm),Load ({unit})", *rows(TIME, DEPTH, 1e3 * FORCE)])
    assert_press(table)
    assert any("is read as numbers of" in note for note in table.notes)


@pytest.mark.parametrize("unit", ["N·m", "N·10", "N·10^3", "N x 10^-3"])
def test_another_product_behind_a_unit_is_none(tmp_path: Path, unit: str) -> None:
    assert refusal(tmp_path, [f"Time (s),Extension (mm),Load ({unit})", *rows(*PRESS)])


@pytest.mark.parametrize("tare", ["tare 0.35 N", "tara = 0.35 N", ", tara 0,35"])
def test_what_was_taken_off_is_passed_by_in_the_name_of_a_force(tmp_path: Path, tare: str) -> None:
    table = read(tmp_path, [f'Time (s),Extension (mm),"Load (N) {tare}"', *rows(*PRESS)])
    assert_press(table)
    assert any("is passed by" in note for note in table.notes)
