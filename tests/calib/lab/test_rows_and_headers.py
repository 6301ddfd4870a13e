"""Rows that are none, and headers elsewhere: results below the rows, columns listed in comments, names of rows, remarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import openpyxl
import pytest

from calib.errors import InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

N = 81
PLACE = [0.01 * min(i, N - 1 - i) for i in range(N)]
PRESS = np.array([(0.1 * i, x, 1.5 * max(0.0, x - 0.1) ** 1.5, 97 + max(0.0, x - 0.1)) for i, x in enumerate(PLACE)])
HEAD = "Time (s),Extension (mm),Load (N),Cp (pF)"
BY_NUMBER = Reading(
    columns={"time": "1", "displacement": "2", "force": "3", "capacitance": "4"},
    units={"time": "s", "displacement": "mm", "force": "N", "capacitance": "pF"},
)


def lines(rows: npt.ArrayLike, sep: str = ",") -> list[str]:
    return [sep.join(f"{v:.4f}" for v in row) for row in np.asarray(rows)]


def read(folder: Path, written: Sequence[str], reading: Reading = AS_FOUND) -> LabTable:
    path = folder / "lab.txt"
    path.write_text("\n".join([*written, ""]), encoding="utf-8")
    return read_lab_file(path, reading)


def assert_press(table: LabTable, n: int = N, *, time: bool = True) -> None:
    for k, (quantity, unit) in enumerate((("time", 1.0), ("displacement", 1e-3), ("force", 1.0), ("capacitance", 1e-12))):
        if time or quantity != "time":
            np.testing.assert_allclose(table.columns[quantity][:n], unit * PRESS[:n, k], atol=1e-4 * unit)
    assert not any(table.reasons[:n])


# --- headers that are quoted once more, and rows without any ---------------------------------------------------------


@pytest.mark.parametrize("quotes", ['"""{}"""', '""{}""'])
@pytest.mark.parametrize(("sep", "cell"), [(",", "{}"), (";", '"{}"'), ("\t", "{}"), (",", '"""{}"""')])
def test_cells_that_were_quoted_once_more_are_read_with_a_note(tmp_path: Path, quotes: str, sep: str, cell: str) -> None:
    head = sep.join(quotes.format(name) for name in HEAD.split(","))
    rows = [sep.join(cell.format(c) for c in row.split(",")) for row in lines(PRESS)]
    table = read(tmp_path, [head, *rows])
    assert_press(table)
    assert any("quoted once more" in note for note in table.notes)


def test_an_empty_cell_in_quotes_and_a_quote_within_a_cell_are_none_that_was_quoted_once_more(tmp_path: Path) -> None:
    table = read(tmp_path, [f'{HEAD},"Rod 5"" (wide)"', *(f'{row},""' for row in lines(PRESS))])
    assert_press(table)
    assert not any("quoted once more" in note for note in table.notes)


@pytest.mark.parametrize("sep", [";", ","])
def test_rows_with_a_time_of_day_and_without_a_header_are_refused_with_the_numbers_of_their_columns(
    tmp_path: Path, sep: str
) -> None:
    rows = [f"14:03:{20 + t:06.3f}{sep}{c:.4f}" for t, _, _, c in PRESS]
    with pytest.raises(InputError) as refused:
        read(tmp_path, rows)
    (fault,) = refused.value.faults
    assert fault.line == 1
    assert "--columns time=1 --columns capacitance=2 --units capacitance=..." in fault.advice
    table = read(tmp_path, rows, Reading(columns={"time": "1", "capacitance": "2"}, units={"capacitance": "pF"}))
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * PRESS[:, 3], rtol=1e-6)


# --- results below the rows ------------------------------------------------------------------------------------------

RESULTS = [PRESS.mean(0), PRESS.std(0, ddof=1), PRESS.max(0), PRESS.min(0)]


@pytest.mark.parametrize(("gap", "time"), [([""], "1"), ([""], "none"), ([], "1"), ([], "none")])
def test_results_without_a_word_below_the_rows_are_named_and_not_used(tmp_path: Path, gap: list[str], time: str) -> None:
    reading = AS_FOUND if time == "1" else Reading(columns={"time": "none"})
    table = read(tmp_path, [HEAD, *lines(PRESS), *gap, *lines(RESULTS)], reading)
    assert_press(table, time=time == "1")
    assert [reason.split(": the ")[1].split()[0] for reason in table.reasons[N:]] == ["mean", "sd", "maximum", "minimum"]
    assert any("4 row(s) at the end are left out" in note for note in table.notes)


def test_results_behind_a_blank_line_are_known_without_a_time(tmp_path: Path) -> None:
    table = read(tmp_path, [HEAD.split(",", 1)[1], *lines(PRESS[:, 1:]), "", *lines([r[1:] for r in RESULTS[:2]])])
    assert all(reason.startswith("a row of results") for reason in table.reasons[N:])
    assert not any(table.reasons[:N])


def test_few_rows_behind_a_blank_line_where_time_goes_back_are_left_out(tmp_path: Path) -> None:
    table = read(tmp_path, [HEAD, *lines(PRESS), "", *lines(PRESS[:3])])
    assert set(table.reasons[N:]) == {"behind a blank line time goes back: no row of the record above"}


@pytest.mark.parametrize("title", [["Results Table 1"], []])
@pytest.mark.parametrize("behind", [["1,4.123,0.987"], ["1,4.123,0.987", "Mean,4.123,0.987"]])
def test_a_table_of_results_whose_rows_are_numbered_is_left_out(tmp_path: Path, title: list[str], behind: list[str]) -> None:
    table = read(tmp_path, [HEAD, *lines(PRESS), "", *title, ",Maximum Load (N),Extension at Max (mm)", *behind])
    assert_press(table)
    assert not any(table.reasons)
    assert any(f"a table of {len(behind)} row(s)" in note for note in table.notes)


def test_a_table_below_the_rows_whose_rows_are_wider_than_its_names_is_left_out_below_a_title(tmp_path: Path) -> None:
    table = read(
        tmp_path,
        [HEAD, *lines(PRESS), "", "Results", ",Maximum Load (N),Extension at Max (mm)", "1,4.1,0.9,3.3", "2,4.0,0.8,3.1"],
    )
    assert_press(table)
    assert any("results below the rows are left out" in note for note in table.notes)


def test_last_readings_behind_a_blank_line_are_readings(tmp_path: Path) -> None:
    for n_behind in (1, 2):
        rows = lines(PRESS[:41])
        for head, written in ((HEAD, rows), (HEAD.split(",", 1)[1], [row.split(",", 1)[1] for row in rows])):
            table = read(tmp_path, [head, *written[:-n_behind], "", *written[-n_behind:]])
            assert not any(table.reasons)


def test_a_second_record_behind_a_blank_line_is_refused_and_leaving_the_time_out_is_not_advised(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"begins anew.*as two files") as error:
        read(tmp_path, [HEAD, *lines(PRESS), "", *lines(PRESS * [1, 1, 1.1, 1])])
    assert "time=none" not in str(error.value)


# --- columns listed by number ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("sep", [" ", "\t", ","])
@pytest.mark.parametrize(
    "listed",
    [
        ["# Ball press of 20.11.2026", "# Columns: 1: time (s) 2: z (mm) 3: force (N) 4: C (pF)"],
        ["# 1:time_s 2:z_mm 3:force_N 4:C_pF"],
        ["% columns = [1] time (s), [2] z (mm), [3] Load 2 (N), [4] C (pF)"],
        ["# col 1: time, s", "# col 2: displacement, mm", "# col 3: force, N", "# col 4: capacitance, pF"],
        ["# 0 time [s]", "# 1 displacement [mm]", "# 2 force [N]", "# 3 C [pF]", "#", "# begin of the data"],
        ["column 1 = Time (s)", "column 2 = Extension (mm)", "column 3 = Load (N)", "column 4 = Cp (pF)"],
    ],
)
def test_columns_that_comments_list_by_number_have_these_names(tmp_path: Path, sep: str, listed: list[str]) -> None:
    table = read(tmp_path, [*listed, *lines(PRESS, sep)])
    assert_press(table)
    assert any("by number" in note for note in table.notes)


@pytest.mark.parametrize(
    "listed",
    [
        ["# Columns: 1: time (s) 2: z (mm) 3: force (N)"],
        ["# col 1: time, s", "# col 2: displacement, mm", "# col 3: force, N"],
        ["# 1. ball", "# 2. time (s)", "# 3. sensor"],
    ],
)
def test_a_list_of_another_number_of_columns_is_refused_and_numbers_lead_out(tmp_path: Path, listed: list[str]) -> None:
    written = [*listed, *lines(PRESS, " ")]
    with pytest.raises(InputError):
        read(tmp_path, written)
    assert_press(read(tmp_path, written, BY_NUMBER))


def test_numbered_remarks_above_a_header_are_no_names(tmp_path: Path) -> None:
    table = read(tmp_path, ["# 1: time of the day (s)", "# 2: force of habit (N)", HEAD, *lines(PRESS)])
    assert_press(table)
    assert table.sources["force"] == "Load (N)"


def test_a_number_means_the_place_where_no_column_has_it_as_its_name(tmp_path: Path) -> None:
    head = "4: time (s),3. place (mm),2: x (N),1: c (pF)"
    assert_press(read(tmp_path, [head, *lines(PRESS)], BY_NUMBER))


# --- names of rows ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sep", [" ", ",", "\t"])
@pytest.mark.parametrize("name", ["{}", "ball {}", "r{}"])
def test_names_of_rows_as_r_writes_them_have_no_name_in_the_header(tmp_path: Path, sep: str, name: str) -> None:
    head = sep.join(f'"{word}"' for word in ("time_s", "disp_mm", "force_N", "cap_pF"))
    rows = [f'"{name.format(k)}"{sep}{row}' for k, row in enumerate(lines(PRESS, sep), 1)]
    table = read(tmp_path, [head, *rows])
    assert_press(table)
    assert any(unread.what == 'column 1 "row names"' for unread in table.unread)
    assert any("as R and pandas write them" in note for note in table.notes)


@pytest.mark.parametrize("quote", ["", '"'])
def test_a_cell_more_than_names_is_refused_where_nothing_sets_the_first_apart(tmp_path: Path, quote: str) -> None:
    rows = [",".join(f"{quote}{cell}{quote}" for cell in (str(k), *row.split(","))) for k, row in enumerate(lines(PRESS), 1)]
    with pytest.raises(InputError, match="has 5 cells, the header has 4"):
        read(tmp_path, [HEAD, *rows])


def test_names_of_rows_that_are_clocks_are_the_time(tmp_path: Path) -> None:
    rows = [f'"2026-11-20 14:{i // 60:02d}:{i % 60:02d}" {row}' for i, row in enumerate(lines(PRESS[:, 1:], " "))]
    table = read(tmp_path, ['"disp_mm" "force_N" "cap_pF"', *rows])
    np.testing.assert_array_equal(np.diff(table.columns["time"]), 1.0)


# --- remarks and signs -----------------------------------------------------------------------------------------------


def test_a_remark_with_a_delimiter_in_it_is_put_together(tmp_path: Path) -> None:
    rows = [f"{row};{'turn; unload; slow' if i == 40 else ''}" for i, row in enumerate(lines(PRESS, ";"))]
    assert_press(read(tmp_path, [f"{HEAD.replace(',', ';')};Comment", *rows]))


@pytest.mark.parametrize("remark", ["max;3.9", "0.5;max"])
def test_a_surplus_cell_that_is_a_number_is_no_part_of_a_remark(tmp_path: Path, remark: str) -> None:
    rows = [f"{row};{remark if i == 40 else ''}" for i, row in enumerate(lines(PRESS, ";"))]
    with pytest.raises(InputError, match="has 6 cells, the header has 5"):
        read(tmp_path, [f"{HEAD.replace(',', ';')};Comment", *rows])


@pytest.mark.parametrize("form", ["{}-", "({})", "\u2013{}", "\u2212{}", "-{}"])
def test_negative_numbers_are_read_with_any_minus(tmp_path: Path, form: str) -> None:
    rows = [",".join([t, x, form.format(f) if float(f) else f, c]) for t, x, f, c in (row.split(",") for row in lines(PRESS))]
    table = read(tmp_path, [HEAD, *rows])
    np.testing.assert_allclose(table.columns["force"], -PRESS[:, 2], atol=1e-4)
    assert any("is read as -" in note for note in table.notes) == (form in ("{}-", "({})"))


def test_a_bracket_beside_another_odd_cell_is_no_sign(tmp_path: Path) -> None:
    rows = [row.split(",") for row in lines(PRESS)]
    for i in (30, 31, 32, 33):
        rows[i][2] = f"({rows[i][2]})" if i < 33 else "1.2.34"
    with pytest.raises(InputError, match="is not a number"):
        read(tmp_path, [HEAD, *map(",".join, rows)])


# --- units above the names -------------------------------------------------------------------------------------------

PLAIN = ["Time", "Extension", "Load", "Cp"]
UNITS = ["s", "mm", "N", "pF"]


def in_book(folder: Path, written: Sequence[str], sep: str = ";") -> LabTable:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    for line in written:
        sheet.append([float(c) if c.replace(".", "").isdecimal() else c or None for c in line.split(sep)])
    book.save(folder / "lab.xlsx")
    return read_lab_file(folder / "lab.xlsx")


@pytest.mark.parametrize(
    "above",
    [
        ["s;mm;N;pF"],
        ["[s];[mm];[N];[pF]"],
        ["Test of May;;;", "s;mm;N;pF"],
        ["s;mm;N;pF", ";;;"],
    ],
)
def test_units_above_the_names_are_read_with_a_note(tmp_path: Path, above: list[str]) -> None:
    written = [*above, ";".join(PLAIN), *lines(PRESS, ";")]
    for table in (read(tmp_path, written), in_book(tmp_path, written)):
        assert_press(table)
        assert any("above their names: s, mm, N, pF" in note for note in table.notes)


@pytest.mark.parametrize("sep", [",", ";", "\t"])
def test_units_above_some_of_the_names_are_those_of_these(tmp_path: Path, sep: str) -> None:
    names = ["Time", "Extension (mm)", "Load", "Cp (pF)"]
    assert_press(read(tmp_path, [sep.join(["s", "", "N", ""]), sep.join(names), *lines(PRESS, sep)]))


def test_units_above_and_below_the_names_that_agree_are_read(tmp_path: Path) -> None:
    assert_press(read(tmp_path, [";".join(UNITS), ";".join(PLAIN), ";".join(UNITS), *lines(PRESS, ";")]))


@pytest.mark.parametrize("below", [["Time;Extension;Load;Cp", "s;mm;N;pF"], ["Time;Extension;Load (N);Cp"]])
def test_units_above_the_names_that_contradict_others_are_refused(tmp_path: Path, below: list[str]) -> None:
    with pytest.raises(InputError, match='"kN" above'):
        read(tmp_path, ["s;mm;kN;pF", *below, *lines(PRESS, ";")])


@pytest.mark.parametrize("above", ["mm;N;pF;", "N;mm;s;pF", "s;mm;N", "s;mm;N;pF;s", "s;mm;N or kN;pF", "s;5;N;pF", ";;N;"])
def test_a_row_above_the_names_that_is_not_their_units_gives_them_none(tmp_path: Path, above: str) -> None:
    with pytest.raises(InputError, match="has no unit"):
        read(tmp_path, [above, ";".join(PLAIN), *lines(PRESS, ";")])


@pytest.mark.parametrize("first", [["s;mm;N;pF", "Time;Extension;Load;Cp"], ["Time;Extension;Load;Cp", "s;mm;N;pF"]])
def test_units_above_the_names_of_a_further_specimen_are_its_own(tmp_path: Path, first: list[str]) -> None:
    other = PRESS * [1, 1, 1e3, 1]
    written = [*first, *lines(PRESS, ";"), "s;mm;mN;pF", ";".join(PLAIN), *lines(other, ";")]
    for specimen in (1, 2):
        assert_press(read(tmp_path, written, Reading(specimen=specimen)))


def test_blocks_of_one_record_with_other_units_above_their_names_are_refused(tmp_path: Path) -> None:
    later = PRESS * [1, 1, 1e3, 1] + [20, 0, 0, 0]
    with pytest.raises(InputError, match="units of this block differ"):
        read(tmp_path, ["s;mm;N;pF", ";".join(PLAIN), *lines(PRESS, ";"), "s;mm;mN;pF", ";".join(PLAIN), *lines(later, ";")])


# --- remarks behind the last cell ------------------------------------------------------------------------------------


def with_remarks(remarks: Mapping[int, str], sep: str = ",", rows: npt.ArrayLike = PRESS) -> list[str]:
    """The press with cells behind some of its rows, by the number of the row."""
    return [
        HEAD.replace(",", sep),
        *(row + sep + remarks[i] if i in remarks else row for i, row in enumerate(lines(rows, sep))),
    ]


@pytest.mark.parametrize("sep", [",", ";", "\t"])
@pytest.mark.parametrize(
    "remarks",
    [
        {30: "touched here"},
        {0: "start", N - 1: "end"},
        {5: "# door closed", 40: "highest, then back", 41: "? noise"},
        {30: '"touched, then held"'},
    ],
)
def test_a_remark_behind_the_last_cell_of_a_row_is_left_out_with_a_note(
    tmp_path: Path, sep: str, remarks: dict[int, str]
) -> None:
    table = read(tmp_path, with_remarks(remarks, sep))
    assert_press(table)
    assert any(note.startswith(f"{len(remarks)} row(s) have a remark behind their last cell") for note in table.notes)
    assert any(part.what == "column 5" for part in table.unread)


def test_a_remark_may_stand_behind_empty_cells(tmp_path: Path) -> None:
    assert_press(read(tmp_path, with_remarks({30: ",,touched here"})))


@pytest.mark.parametrize(
    "surplus", ["3.1", "3.1 N", "-0,4", "max,3.1", "3.1,max", "nan", "OVER", "12:30:05", "mN", "x10", "---", "1e", "N"]
)
def test_a_surplus_cell_that_may_be_a_reading_is_no_remark(tmp_path: Path, surplus: str) -> None:
    with pytest.raises(InputError, match="cells, the header has 4"):
        read(tmp_path, with_remarks({30: surplus}))


@pytest.mark.parametrize("row", ["0.1,x,0.2,0.3,97.1", "0.1,0.2,touched,0.3,held", "a,0.1,0.2,0.3,held"])
def test_a_row_whose_cells_may_be_moved_is_refused_though_words_stand_behind_it(tmp_path: Path, row: str) -> None:
    written = with_remarks({})
    with pytest.raises(InputError):
        read(tmp_path, [*written[:31], row, *written[31:]])


def test_words_behind_many_rows_are_a_column_without_a_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cells, the header has 4"):
        read(tmp_path, with_remarks(dict.fromkeys(range(N // 2), "ok")))


def test_remarks_behind_the_last_cell_are_obeyed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="another unit or range"):
        read(tmp_path, with_remarks({30: "load now in mN"}))
    table = read(tmp_path, with_remarks({30: "saturated", 50: "fine"}))
    assert {i: why for i, why in enumerate(table.reasons) if why} == {30: 'column 5 says "saturated"'}
    assert any("a zero was set anew" in note for note in read(tmp_path, with_remarks({3: "load zeroed"})).notes)


# --- rows below the header that are readings, and none of units --------------------------------------------------------


@pytest.mark.parametrize("first", ["1,0;1,200;1,102", "1;1,2;1,1", "1;1;1"])
def test_a_first_row_of_ones_is_one_of_readings_and_not_of_units(tmp_path: Path, first: str) -> None:
    rows = [f"{2 + 0.1 * i:.1f};{1.2 + 0.01 * i:.3f};{1.1 + 0.02 * i:.4f}".replace(".", ",") for i in range(40)]
    table = read(tmp_path, ["Zeit [s];Position [mm];Kraft [N]", first, *rows])
    assert len(table.reasons) == 41
    assert table.columns["time"][0] == 1.0
    assert table.unread == ()


@pytest.mark.parametrize("blank", [";;", "; ;", ";;;"])
def test_a_row_of_delimiters_between_names_and_units_is_a_blank_one(tmp_path: Path, blank: str) -> None:
    rows = ["Time;Extension;Load;Cp", blank, "[s];[mm];[N];[pF]", *lines(PRESS, ";")]
    assert_press(read(tmp_path, rows))


@pytest.mark.parametrize("blank", ["\u00a0", "\u202f", "\u2007\u00a0"])
def test_hard_blanks_that_pad_cells_are_no_part_of_a_number(tmp_path: Path, blank: str) -> None:
    padded = [f";{blank}".join(f"{cell}{blank}" for cell in row.split(";")) for row in lines(PRESS, ";")]
    assert_press(read(tmp_path, [HEAD.replace(",", ";"), *padded]))


@pytest.mark.parametrize("sep", [",", ";"])
def test_two_lines_that_have_run_together_are_said_to_have(tmp_path: Path, sep: str) -> None:
    rows = lines(PRESS, sep)
    joined = [HEAD.replace(",", sep), *rows[:20], rows[20] + rows[21], *rows[22:]]
    with pytest.raises(InputError, match=r"22.*If two lines have run together"):
        read(tmp_path, joined)


@pytest.mark.parametrize("n", ["n", "N", "Count", "Anzahl"])
@pytest.mark.parametrize("at", [0, 2])
def test_how_many_readings_there_were_beside_their_mean_is_a_row_of_results(tmp_path: Path, n: str, at: int) -> None:
    below = ["Mean,0.4000,0.5000,97.3000", "SD,0.2000,0.3000,0.2000"]
    below.insert(at, f"{n},81,81,81")
    table = read(tmp_path, [HEAD, *lines(PRESS), *below])
    assert_press(table)
    assert all(reason.startswith("a row of results") for reason in table.reasons[N:])


def test_an_n_that_stands_beside_no_mean_is_no_row_of_results_by_its_name(tmp_path: Path) -> None:
    table = read(tmp_path, [HEAD, *lines(PRESS), "n,81,81,81"])
    assert_press(table)
    assert 'a row of results: "n"' not in table.reasons[-1]


def test_a_letter_without_a_unit_may_be_left_out_where_there_is_a_press(tmp_path: Path) -> None:
    written = ["t (s),x (mm),F (N),C", *(f"{a:.1f},{b:.4f},{c:.4f},{1 + k // 41}" for k, (a, b, c, _) in enumerate(PRESS))]
    with pytest.raises(InputError, match="--columns capacitance=none"):
        read(tmp_path, written)
    table = read(tmp_path, written, Reading(columns={"capacitance": "none"}))
    np.testing.assert_allclose(table.columns["force"], PRESS[:, 2], atol=1e-4)


@pytest.mark.parametrize(("rate", "more"), [(1.0, False), (1.008, True)])
def test_two_clocks_differ_by_a_constant_alone_only_at_one_rate(tmp_path: Path, rate: float, more: bool) -> None:
    rows = [f"{a:.2f},{b:.4f},{c:.4f},{rate * a + 3:.3f},{d:.4f}" for a, b, c, d in PRESS]
    with pytest.raises(InputError, match="by a constant") as refused:
        read(tmp_path, ["t_tester_s,disp_mm,force_N,t_lcr_s,cp_pF", *rows])
    assert ("by a constant, but for" in str(refused.value)) == more


@pytest.mark.parametrize("option", ["columns", "units"])
def test_a_number_where_the_reading_wants_text_is_refused_with_the_text(tmp_path: Path, option: str) -> None:
    said: dict[str, Any] = {option: {"time": 1}}
    with pytest.raises(InputError, match=rf'{option}: time = 1 is no text. Write it in quotes: {option} = \{{"time": "1"\}}'):
        read(tmp_path, [HEAD, *lines(PRESS)], Reading(**said))


@pytest.mark.parametrize("loss", [1.23, 3.0])
def test_a_loss_above_1_beside_a_series_capacitance_may_be_in_per_cent(tmp_path: Path, loss: float) -> None:
    written = ["Time (s),Cs (pF),tan d", *(f"{a:.1f},{d:.4f},{loss:.3f}" for a, _, _, d in PRESS)]
    with pytest.raises(InputError, match=r"may be in per cent. Say which: --units dissipation=% or --units dissipation=1"):
        read(tmp_path, written)
    for unit, d in (("%", loss / 100), ("1", loss)):
        table = read(tmp_path, written, Reading(units={"dissipation": unit}))
        np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * PRESS[:, 3] / (1 + d**2), rtol=1e-5)


@pytest.mark.parametrize(("name", "loss"), [("D", 0.9), ("D (%)", 1.5), ("D (%)", 123.0)])
def test_a_loss_below_1_and_one_that_says_per_cent_are_taken(tmp_path: Path, name: str, loss: float) -> None:
    written = [f"Time (s),Cs (pF),{name}", *(f"{a:.1f},{d:.4f},{loss:.3f}" for a, _, _, d in PRESS)]
    assert "converted to Cp" in " ".join(read(tmp_path, written).notes)


@pytest.mark.parametrize(("above", "between"), [(";", ","), ("\t", ","), ("|", ","), (",", "\t"), (",", ";"), (";", "\t")])
def test_names_between_one_mark_above_rows_between_another_are_read(tmp_path: Path, above: str, between: str) -> None:
    place = np.concatenate([np.linspace(0, 1, 40), np.linspace(1, 0, 40)])
    force = 3 * np.clip(place - 0.1, 0, None) ** 1.5
    rows = [between.join([f"{0.1 * k:.1f}", f"{x:.4f}", f"{f:.4f}"]) for k, (x, f) in enumerate(zip(place, force, strict=True))]
    path = tmp_path / "press.csv"
    path.write_text("\n".join([above.join(["Time (s)", "Displacement (mm)", "Force (N)"]), *rows]) + "\n")
    table = read_lab_file(path)
    assert np.allclose(table.columns["force"], force, atol=1e-4)
    path.write_text("\n".join([above.join(["Time (s)", "Displacement (mm)"]), *rows]) + "\n")
    with pytest.raises(InputError):
        read_lab_file(path)
