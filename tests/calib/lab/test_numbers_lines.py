"""Every line of a file is read or named, and no cell comes under another column's name."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, SeveralSpecimens, read_lab_file

N = 30
ROWS = [(f"{i * 0.1:.2f}", f"{i * 0.0131:.4f}", f"{0.2 + i * i * 0.0123:.3f}") for i in range(N)]
HEAD = ("Time (s)", "Extension (mm)", "Load (N)")


def lab_file(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def joined(rows: Sequence[tuple[str, ...]], sep: str = ",") -> list[str]:
    return [sep.join(row) for row in rows]


def assert_right(table: LabTable, rows: Sequence[tuple[str, ...]] | None = None) -> None:
    for k, (quantity, factor) in enumerate((("time", 1.0), ("displacement", 1e-3), ("force", 1.0))):
        expected = np.array([float(row[k]) for row in rows or ROWS]) * factor
        np.testing.assert_allclose(table.columns[quantity][[not r for r in table.reasons]], expected, rtol=1e-12)


def unread(table: LabTable) -> str:
    return " | ".join(map(str, table.unread))


def refusal(path: Path, reading: Reading | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_lab_file(path, reading or Reading())
    return str(caught.value)


# ----------------------------------------------------------------------------------------------------------- what is named


def test_every_line_is_read_or_named(tmp_path: Path) -> None:
    above = ["Operator,M", "", "Sample rate: 10 Hz"]
    rows = joined(ROWS)
    path = lab_file(tmp_path, *above, ",".join(HEAD), "", *rows[:9], "# a pause", *rows[9:], "", "End of test", "Maximum,9.5")
    table = read_lab_file(path)
    assert_right(table)
    named = {n for u in table.unread for n in _lines(u.what)}
    written = {i for i, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1) if line.strip()}
    assert written <= named | {len(above) + 1} | set(table.lines.tolist())
    assert not named & {len(above) + 1, *table.lines.tolist()}
    assert '"# a pause"' in unread(table)


def _lines(what: str) -> range:
    numbers = [int(n) for n in re.findall(r"\d+", what)] if what.startswith("line") else []
    return range(numbers[0], numbers[-1] + 1) if numbers else range(0)


def test_a_table_of_results_below_and_other_specimens_are_named(tmp_path: Path) -> None:
    record = joined(ROWS)
    table = read_lab_file(lab_file(tmp_path, ",".join(HEAD), *record, "", "Load (N),Extension (mm)", "7.1,0.3"))
    assert "lines 33 to 34: another table" in unread(table)
    two = lab_file(tmp_path, ",".join(HEAD), *record, ",".join(HEAD), *record)
    table = read_lab_file(two, Reading(specimen=2))
    assert "lines 2 to 31: rows of another specimen" in unread(table)


RESULTS = (
    ["", "Results", "Specimen,Extension at max (mm),Max load (N)", "1,0.30,7.1"],
    ["", "Specimen,Max load (N)", "1,7.1"],
    ["", "Ergebnisse", "", "Nr,Fmax (N),W (mJ),Smax (mm)", "1,7.1,0.3,0.30", "Mittel,7.1,0.3,0.30"],
    ["", "Statistics", "Quantity,Value,Unit", "Fmax,7.1,N", "smax,0.3,mm"],
    ["", "Results", "Step,Way,Pull", "99.0,0.30,7.1"],
    ["Results", "Step,Way,Pull", "1,0.30,7.1"],
    ["", "Results", "Step,Way,Pull", "1,0.30,7.1", "", "Step,Way,Pull,Other", "1,0.30,7.1,2"],
)


@pytest.mark.parametrize("results", RESULTS)
def test_a_few_results_under_names_of_their_own_at_the_end_are_left_out_with_a_note(tmp_path: Path, results: list[str]) -> None:
    timed = joined(ROWS)
    table = read_lab_file(lab_file(tmp_path, ",".join(HEAD), *timed, *results))
    assert table.lines.tolist() == list(range(2, len(timed) + 2))
    assert not any(table.reasons)
    assert any("left out" in note for note in table.notes)


@pytest.mark.parametrize(
    "below",
    [
        ["", "Part 2", "Step,Way,Pull", "99.0,0.30,7.1"],  # time goes on
        ["", "Second press", "Step,Way,Pull", *[f"{k},0.30,7.1" for k in range(12)]],  # too many
        ["Part 2", "Step,Way,Pull", "1,0.30,7.1"],  # not set apart
        ["", "Part 2", "Step,Way,Pull", "1,0.30,7.1", "", "Step,Way,Pull,Other", "1,0.30,7.1,2"],  # more than one table
    ],
)
def test_rows_below_other_words_that_may_go_on_are_refused(tmp_path: Path, below: list[str]) -> None:
    timed = joined(ROWS)
    assert "stands among the rows" in refusal(lab_file(tmp_path, ",".join(HEAD), *timed, *below))


@pytest.mark.parametrize("marks", [("1", "2"), ("3", "7")])
def test_headers_that_differ_by_the_number_of_the_specimen_are_specimens(tmp_path: Path, marks: tuple[str, str]) -> None:
    rows = [f",{row}" for row in joined(ROWS)]
    heads = [[f"{mark},Time,Extension,Load", ",(s),(mm),(N)"] for mark in marks]
    path = lab_file(tmp_path, *heads[0], *rows[:20], *heads[1], *rows)
    with pytest.raises(SeveralSpecimens, match=f"specimen {marks[1]}"):
        read_lab_file(path)
    assert_right(read_lab_file(path, Reading(specimen=2)))


# ----------------------------------------------------------------------------------------------------------------- headers


@pytest.mark.parametrize("mark", ["# ", "#", "% ", "%% ", "// ", "! "])
@pytest.mark.parametrize("sep", [",", ";", "\t", " "])
@pytest.mark.parametrize("units", ["in the names", "below"])
def test_a_header_behind_a_comment_mark_is_one(tmp_path: Path, mark: str, sep: str, units: str) -> None:
    names = ("time_s", "displacement_mm", "force_N") if units == "in the names" else ("Time", "Extension", "Load")
    below = [] if units == "in the names" else [mark + sep.join(("s", "mm", "N"))]
    table = read_lab_file(lab_file(tmp_path, mark + "written by a script", mark + sep.join(names), *below, *joined(ROWS, sep)))
    assert_right(table)
    assert any("stands behind" in note for note in table.notes)
    assert "line 1: above the header" in unread(table)


def test_semicolons_before_a_header_are_a_mark_only_where_they_do_not_part_cells(tmp_path: Path) -> None:
    assert_right(read_lab_file(lab_file(tmp_path, "; " + ",".join(HEAD), *joined(ROWS))))
    rows = [("", *row) for row in ROWS]
    assert_right(read_lab_file(lab_file(tmp_path, ";" + ";".join(HEAD), *joined(rows, ";"))))


@pytest.mark.parametrize("line", ["1,2,3", "0,1,2", "CH1,CH2,CH3", "----,----,----", "====="])
@pytest.mark.parametrize("place", ["above units", "below units", "no units"])
def test_counts_and_rulers_below_a_header_are_no_readings(tmp_path: Path, line: str, place: str) -> None:
    head = [",".join(HEAD)] if place == "no units" else ["Time,Extension,Load"]
    units = [] if place == "no units" else ["(s),(mm),(N)"]
    below = [line, *units] if place == "above units" else [*units, line]
    table = read_lab_file(lab_file(tmp_path, *head, *below, *joined(ROWS)))
    assert_right(table)
    assert f"line {len(head) + below.index(line) + 1}:" in unread(table)


@pytest.mark.parametrize("units", [[], ["(s),(mm),(N)"]])
def test_gains_below_a_header_are_no_readings_and_asked_about(tmp_path: Path, units: list[str]) -> None:
    path = lab_file(tmp_path, "Time,Extension,Load" if units else ",".join(HEAD), *units, "1,0.998,2.314", *joined(ROWS))
    with pytest.raises(InputError, match=r"may state a factor of 0\.998.*\n.*may state a factor of 2\.314"):
        read_lab_file(path)
    assert_right(read_lab_file(path, Reading(units={"displacement": "mm", "force": "N"})))


def test_counts_of_many_columns_of_which_two_have_decimals_are_no_readings(tmp_path: Path) -> None:
    rows = [f"{i},{row[1]},{row[2]},7,1" for i, row in enumerate(ROWS)]
    table = read_lab_file(lab_file(tmp_path, "Time (s),Extension (mm),Load (N),Segment ID,Cycle", "1,2,3,4,5", *rows))
    assert len(table.lines) == len(ROWS)
    assert 'line 2: numbers of the columns, "1,2,3,4,5"' in unread(table)


@pytest.mark.parametrize("above", [[], ['"a remark', 'over lines"'], ['the pad is 5" wide']])
def test_cells_of_a_header_may_hold_line_breaks(tmp_path: Path, above: list[str]) -> None:
    table = read_lab_file(lab_file(tmp_path, *above, '"Time', '(s)","Extension', '(mm)","Load', '(N)"', *joined(ROWS)))
    assert_right(table)
    assert table.lines[0] == len(above) + 5


def test_a_units_row_may_stand_below_a_blank_line(tmp_path: Path) -> None:
    assert_right(read_lab_file(lab_file(tmp_path, "Time,Extension,Load", "", "(s),(mm),(N)", "", *joined(ROWS))))


@pytest.mark.parametrize(
    "lines",
    [
        ["Load (N),,Extension (mm),", "X,Y,X,Y"],
        ["Time (s),Extension (mm),Load (N)", "total,measured,setpoint"],
        ["Time,Extension,Load", "total,measured,setpoint", "(s),(mm),(N)"],
    ],
)
def test_a_second_line_of_titles_is_refused(tmp_path: Path, lines: list[str]) -> None:
    rows = [row + (row[1],) * (lines[0].count(",") - 2) for row in ROWS]
    assert "like another header" in refusal(lab_file(tmp_path, *lines, *joined(rows)))


# ----------------------------------------------------------------------------------------------------------- shifted cells


@pytest.mark.parametrize("lost", [0, 1, 2])
@pytest.mark.parametrize("sep", [",", ";", "\t"])
@pytest.mark.parametrize("spare", [False, True])
def test_a_row_that_lost_a_cell_is_left_out_with_a_reason(tmp_path: Path, lost: int, sep: str, spare: bool) -> None:
    rows = [(*row, "23.1") if spare else row for row in ROWS]
    short = {7, 19, 20}
    cut = [tuple(c for k, c in enumerate(row) if k != lost) if i in short else row for i, row in enumerate(rows)]
    head = sep.join((*HEAD, "T_amb") if spare else HEAD)
    table = read_lab_file(lab_file(tmp_path, head, *joined(cut, sep)))
    assert {i for i, reason in enumerate(table.reasons) if reason} == short
    assert any("fewer cells" in note and "line 9" in note for note in table.notes)
    assert_right(table, [row for i, row in enumerate(ROWS) if i not in short])


def test_a_column_that_is_filled_rarely_shortens_most_rows_and_spoils_none(tmp_path: Path) -> None:
    rows = [row if i % 5 else (*row, f"{97 + i / 100:.2f}") for i, row in enumerate(ROWS)]
    table = read_lab_file(lab_file(tmp_path, ",".join((*HEAD, "Cp (pF)")), *joined(rows)))
    assert not any(table.reasons)
    assert_right(table)


@pytest.mark.parametrize("sep", [",", ";", "\t"])
def test_numbers_under_the_empty_end_of_a_header_are_refused_until_all_columns_are_said(tmp_path: Path, sep: str) -> None:
    rows = [(str(i), *row) for i, row in enumerate(ROWS)]
    path = lab_file(tmp_path, sep.join((*HEAD, "")), *joined(rows, sep))
    assert "cannot be told" in refusal(path)
    assert "cannot be told" in refusal(path, Reading(columns={"force": "4"}))
    said = Reading(
        columns={"time": "2", "displacement": "3", "force": "4"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    assert_right(read_lab_file(path, said))


@pytest.mark.parametrize(
    "head", ["Time (s),Cp (pF)", "Time (s),Cp (pF),,", "Time (s),Cp (pF),D,Status", "Time (s),Cp (pF),Remark"]
)
def test_decimal_commas_between_commas_are_refused_however_wide_the_header(tmp_path: Path, head: str) -> None:
    rows = [f"{i // 10},{i % 10}0,{97 + i // 9},{(i * 37) % 1000:03d}" for i in range(N)]
    if "Remark" in head:
        rows = [f"{i},{row.split(',', 2)[2]}" for i, row in enumerate(rows)]
    refusal(lab_file(tmp_path, head, *rows))


def test_a_first_row_of_maxima_is_none_of_the_record(tmp_path: Path) -> None:
    largest = tuple(max((row[k] for row in ROWS), key=float) for k in range(3))
    table = read_lab_file(lab_file(tmp_path, ",".join(HEAD), *joined([largest, *ROWS])))
    assert "none of the record" in table.reasons[0]
    assert_right(table)


def test_the_programs_words_for_a_spreadsheets_error_are_no_comments(tmp_path: Path) -> None:
    rows = [("#REF!", *row[1:]) if i == 7 else row for i, row in enumerate(ROWS)]
    table = read_lab_file(lab_file(tmp_path, ",".join(HEAD), *joined(rows)))
    assert len(table.reasons) == len(ROWS)
    assert [r for r, reason in enumerate(table.reasons) if reason] == [7]


UNSEEN = {"\ufeff": "a byte order mark", "\f": "the end of a page", "\u200b": "a blank of no width"}


@pytest.mark.parametrize("character", UNSEEN)
def test_a_character_that_nobody_sees_is_left_out_with_a_note(tmp_path: Path, character: str) -> None:
    rows = [f"{0.1 * i:.1f},{0.01 * i:.4f},{0.03 * i:.4f}" for i in range(60)]
    rows[30] = character + rows[30]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", *rows]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert not any(table.reasons)
    assert any(f"{UNSEEN[character]}" in note and "line 32" in note for note in table.notes)


@pytest.mark.parametrize("end", [b"\x1a", b"\x1a\x1a\r\n", b"\x1a" * 60])
def test_the_mark_that_ends_a_file_of_dos_is_left_out_with_a_note(tmp_path: Path, end: bytes) -> None:
    rows = [f"{0.1 * i:.1f},{0.01 * i:.4f},{0.03 * i:.4f}" for i in range(60)]
    path = tmp_path / "lab.csv"
    path.write_bytes("\r\n".join(["Time (s),Displacement (mm),Force (N)", *rows, ""]).encode() + end)
    table = read_lab_file(path)
    assert not any(table.reasons)
    assert any("0x1A" in note for note in table.notes)


def test_a_control_character_within_a_row_is_named_with_its_line(tmp_path: Path) -> None:
    rows = [f"{0.1 * i:.1f},{0.01 * i:.4f},{0.03 * i:.4f}" for i in range(60)]
    rows[30] = rows[30].replace(",", ",\x07", 1)
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="0x07") as error:
        read_lab_file(path)
    assert error.value.faults[0].line == 32


@pytest.mark.parametrize("end", [b"\x1a", b"\n\x1a", b"\r\n\x1a", b"\n\x1a\x1a\x1a\n", b"\x1a\r\n", b"\n" + b"\x1a" * 128])
def test_the_sign_by_which_dos_ends_a_text_ends_it(tmp_path: Path, end: bytes) -> None:
    path = tmp_path / "lab.csv"
    path.write_bytes("\n".join([",".join(HEAD), *joined(ROWS)]).encode() + end)
    assert_right(read_lab_file(path))


@pytest.mark.parametrize(("sign", "shown"), [("\x1a", "0x1A"), ("\x05", "0x05"), ("\x7f", "0x7F")])
@pytest.mark.parametrize("line", [1, 7])
def test_a_control_character_within_a_text_is_refused_with_its_line(tmp_path: Path, sign: str, shown: str, line: int) -> None:
    lines = [",".join(HEAD), *joined(ROWS)]
    lines[line - 1] = lines[line - 1][:3] + sign + lines[line - 1][3:]
    said = refusal(lab_file(tmp_path, *lines))
    assert f"lab.csv:{line}: the file is not text: a character that nobody sees ({shown}) stands in this line" in said
