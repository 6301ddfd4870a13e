"""What stands in lines, columns and sheets that are not read is told in its own words, or asked about."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import openpyxl
import pytest
from openpyxl.styles import Font
from turning_press import DIGITS, HEADS, turning_press

from calib.errors import InputError
from calib.lab import LabTable, Reading, observe, read_lab_file

PRESS = turning_press(halves=60).columns
CELLS = [[f"{x:.{DIGITS[q]}f}" for x in v] for q, v in PRESS.items()]
NAMES = [HEADS[q] for q in PRESS]
N_ROW = len(CELLS[0])


def _write(
    folder: Path, above: tuple[str, ...] = (), name: str = "", cells: dict[int, str] | None = None, times: int = 1
) -> Path:
    """The press below some lines, with one more column of which some rows have a cell, and again as often as asked."""
    rows = [list(row) for _ in range(times) for row in zip(*CELLS, strict=True)]
    step = float(PRESS["time"][1] - PRESS["time"][0])
    for i, row in enumerate(rows):
        row[[*PRESS].index("time")] = f"{i * step:.3f}"
    more = [[(cells or {}).get(i, "")] if name else [] for i in range(len(rows))]
    lines = [",".join([*NAMES, *([name] if name else [])]), *(",".join(r + m) for r, m in zip(rows, more, strict=True))]
    (folder / "press.csv").write_text("\n".join([*above, *lines]) + "\n", encoding="utf-8")
    return folder / "press.csv"


def _not_read(table: LabTable) -> str:
    return " | ".join(map(str, table.unread))


@pytest.mark.parametrize(
    "words",
    [
        "# force channel was not connected, values are those of the last test",
        "# capacitance is of the reference capacitor",
        "Load cell;not connected",
        "Data source;simulation",
        "# peak hold was on",
        "# Kraftsensor defekt",
        "# capteur de force en panne",
    ],
)
def test_a_line_of_a_short_block_above_a_header_is_quoted(tmp_path: Path, words: str) -> None:
    assert words in _not_read(read_lab_file(_write(tmp_path, ("# setup", words))))


def test_of_a_long_block_the_lines_that_name_a_channel_or_a_doubt_are_quoted(tmp_path: Path) -> None:
    usual = tuple(f"Setting {chr(65 + i)}: on" for i in range(20))
    told = _not_read(read_lab_file(_write(tmp_path, (*usual, "Load cell: U9C", *usual, "# ABORTED by the user", *usual))))
    assert '"Load cell: U9C" (line 21)' in told
    assert '"# ABORTED by the user" (line 42)' in told
    assert "Setting B" not in told


def test_no_more_than_eight_lines_of_a_block_are_quoted(tmp_path: Path) -> None:
    told = _not_read(read_lab_file(_write(tmp_path, tuple(f"# force warning {chr(65 + i)}" for i in range(20)))))
    assert told.count("# force warning") == 9
    assert "and 11 more line(s)" in told


@pytest.mark.parametrize(
    "words",
    [
        "Mult force: 10",
        "Coefficient force: 10",
        "Teiler Kraft: 10",
        "F x 10 !!!",
        "Kraft mal 10 nehmen",
        "Kraftaufnehmer;Werte mal 10",
        "Correction;force = 10 x reading",
        "force fois 10",
    ],
)
def test_a_factor_of_a_quantity_in_any_words_is_asked_about_and_settled_by_its_unit(tmp_path: Path, words: str) -> None:
    path = _write(tmp_path, ("Test 5", words))
    with pytest.raises(InputError, match="states a factor"):
        read_lab_file(path)
    right = read_lab_file(path, Reading(units={"force": "N"})).columns["force"]
    np.testing.assert_allclose(right, np.round(PRESS["force"], DIGITS["force"]), atol=1e-9)
    larger = read_lab_file(path, Reading(units={"force": "10 N"})).columns["force"]
    np.testing.assert_allclose(larger, 10 * right)


@pytest.mark.parametrize(
    "words",
    [
        "Coefficient of variation: 10",
        "Slope force/displacement: 12.5",
        "Correlation coefficient of force: 0.99",
        "Test mal 3 wiederholt",
        "Kapazität mal 10 s gemittelt",
        "Slope of force 3 N/mm",
    ],
)
def test_results_and_counts_are_no_factors(tmp_path: Path, words: str) -> None:
    read_lab_file(_write(tmp_path, ("Test 5", words)))


def test_remarks_in_a_column_are_quoted_with_their_lines(tmp_path: Path) -> None:
    remarks = {9: "LCR: Cs mode", 20: "ab hier falsch", 30: "peak hold on", 40: "ignore the next 10 rows", 50: "lights off"}
    told = _not_read(read_lab_file(_write(tmp_path, name="Remark", cells=remarks)))
    assert '"LCR: Cs mode" (line 11), "ab hier falsch" (line 22)' in told
    assert "and 1 more" in told


@pytest.mark.parametrize("words", ["changed sample", "new ball 8 mm", "neue Probe", "Kugel gewechselt", "force x2 from here"])
def test_a_remark_that_changes_the_rig_among_the_rows_is_refused_in_a_column_and_in_a_line(tmp_path: Path, words: str) -> None:
    path = _write(tmp_path, name="Remark", cells={50: words})
    with pytest.raises(InputError, match=words):
        read_lab_file(path)
    lines = _write(tmp_path).read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([*lines[:50], f"# {words}", *lines[50:]]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_lab_file(path)


@pytest.mark.parametrize("words", ["sample touched", "ball in contact", "hold", "new ramp", "Probe berührt"])
def test_a_remark_on_the_course_of_a_press_in_a_column_is_told_alone(tmp_path: Path, words: str) -> None:
    assert words in _not_read(read_lab_file(_write(tmp_path, name="Remark", cells={50: words})))


@pytest.mark.parametrize(
    ("name", "first", "then"), [("Phase", "precondition", "test"), ("Vac (mV)", "100", "1000"), ("Chamber (°C)", "23", "60")]
)
def test_what_a_column_says_of_the_cycle_that_is_used_and_of_others_is_told(
    tmp_path: Path, name: str, first: str, then: str
) -> None:
    cells = {i: first if i < N_ROW else then for i in range(3 * N_ROW)}
    path = _write(tmp_path, name=name, cells=cells, times=3)
    table = read_lab_file(path)
    assert f'"{first}" in lines 2 to {N_ROW + 1}, "{then}" in lines {N_ROW + 2} to {3 * N_ROW + 1}' in _not_read(table)
    told = observe(table).use_notes
    assert any(f'"{name}" says "{first}" in cycle 1, used here, and "{then}" from cycle 2 on' in note for note in told)
    others = read_lab_file(path, Reading(where={name: then}))
    assert len(others.lines) == 2 * N_ROW
    assert not any("used here" in note for note in observe(others).use_notes)


@pytest.mark.parametrize(
    ("name", "first", "then"), [("Ball (mm)", "5", "8"), ("Kugel", "klein", "groß"), ("Pad (mm)", "1", "2")]
)
def test_two_balls_or_pads_are_asked_about_and_settled_by_a_choice(tmp_path: Path, name: str, first: str, then: str) -> None:
    path = _write(tmp_path, name=name, cells={i: first if i < N_ROW else then for i in range(2 * N_ROW)}, times=2)
    with pytest.raises(InputError, match="names several"):
        read_lab_file(path)
    for value in (first, then):
        assert len(read_lab_file(path, Reading(where={name: value})).lines) == N_ROW


def _book(folder: Path, title: str = "Data", struck: int = 0, note: str = "") -> Path:
    book = openpyxl.Workbook()
    data = book.active
    data.title = title
    data.append(NAMES)
    for row in zip(*CELLS, strict=True):
        data.append(list(map(float, row)))
    for cell in data[struck] if struck else ():
        cell.font = Font(strike=True)
    if note:
        book.create_sheet("Notes").append(["Remark", note])
    book.save(folder / "press.xlsx")
    return folder / "press.xlsx"


def test_a_sheet_that_is_called_by_another_unit_is_asked_about(tmp_path: Path) -> None:
    path = _book(tmp_path, "Force in mN")
    with pytest.raises(InputError, match="Force in mN"):
        read_lab_file(path)
    newton = read_lab_file(path, Reading(units={"force": "N"})).columns["force"]
    np.testing.assert_allclose(read_lab_file(path, Reading(units={"force": "mN"})).columns["force"], 1e-3 * newton)
    read_lab_file(_book(tmp_path, "Force in N"))


def test_a_row_that_is_struck_through_is_told(tmp_path: Path) -> None:
    assert any("struck through" in note and "row 20" in note for note in read_lab_file(_book(tmp_path, struck=20)).notes)
    assert not any("struck through" in note for note in read_lab_file(_book(tmp_path)).notes)


def test_a_sheet_of_notes_is_quoted(tmp_path: Path) -> None:
    assert "force channel dead" in _not_read(read_lab_file(_book(tmp_path, note="force channel dead")))
