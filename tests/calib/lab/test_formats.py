"""Workbooks, files of LabVIEW and MATLAB, and what is no lab file: written by other tools than those that read them.

| format | read by | written here by |
|---|---|---|
| .xlsx, .xlsm | openpyxl | XlsxWriter |
| .xls | xlrd | xlwt |
| .lvm | this project | text by hand, from the description of National Instruments |
| .tdms | npTDMS | bytes by hand, from the description of National Instruments |
| .mat, version 4 | scipy | bytes by hand, from the description of MathWorks |
| .mat, versions 5 to 7 | this project | scipy; bytes by hand, from the description of MathWorks |
| .mat, version 7.3 | h5py | PyTables; a file of MATLAB itself, among what scipy is tested with |
| .TRA, and text | this project | text by hand, as instruments write it; datasets of other labs where they are on the machine |
"""

from __future__ import annotations

import io
import sqlite3
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import pytest
import scipy.io.matlab
import tables
import xlsxwriter
import xlwt
from scipy.io import savemat
from scipy.sparse import coo_array
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.errors import Choice, InputError
from calib.experiment.experiment_file import read_experiment
from calib.experiment.sweeps import read_sweeps
from calib.lab import LabTable, Reading, SeveralSpecimens, make_sweep, read_lab_file
from calib.lab.instruments.matlab73 import variables_of_hdf5

N = 120
TIME = np.round(np.arange(N) * 0.1, 6)
DEPTH = np.round(TIME * 0.05, 6)  # [mm]
FORCE = np.round(0.013 + 4.7 * np.maximum(DEPTH - 0.1, 0) ** 1.5, 6)  # [N]
CAPACITANCE = np.round(96.3 + 2.1 * FORCE**0.7, 5)  # [pF]
HEADER = ("Time (s)", "Extension (mm)", "Load (N)")
ROWS = [tuple(map(float, row)) for row in zip(TIME, DEPTH, FORCE, strict=True)]
LOG = [tuple(map(float, row)) for row in zip(TIME, CAPACITANCE, strict=True)]

Cells = Sequence[Sequence[Any]]


def assert_truth(table: LabTable, force: np.ndarray = FORCE) -> None:
    """The table holds the press as it was written, in SI."""
    np.testing.assert_allclose(table.columns["time"], TIME, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(table.columns["force"], force, rtol=1e-12)


def refusal(path: Path, reading: Reading | None = None) -> str:
    """The refusal of a file as it is printed."""
    with pytest.raises(InputError) as refused:
        read_lab_file(path, reading or Reading())
    return str(refused.value)


# --- workbooks -----------------------------------------------------------------------------------------------------------


def new_workbook(
    path: Path, sheets: dict[str, Cells], styles: dict[tuple[str, int], str] | None = None, **options: Any
) -> Path:
    """Write an .xlsx by xlsxwriter: cells row by row, and a number format for a column of a sheet from the second row on."""
    book = xlsxwriter.Workbook(str(path), {"nan_inf_to_errors": True, **options})
    for name, rows in sheets.items():
        sheet = book.add_worksheet(name)
        formats = {c: book.add_format({"num_format": f}) for (own, c), f in (styles or {}).items() if own == name}
        for r, row in enumerate(rows):
            for c, cell in enumerate(row):
                style = formats.get(c) if r else None
                if isinstance(cell, tuple):
                    sheet.write_formula(r, c, cell[0], style, cell[1])
                elif isinstance(cell, datetime | timedelta):
                    sheet.write_datetime(r, c, cell, style)
                elif isinstance(cell, str):
                    sheet.write_string(r, c, cell, style)
                elif cell is not None:
                    sheet.write(r, c, cell, style)
    book.close()
    return path


def old_workbook(
    path: Path, sheets: dict[str, Cells], styles: dict[tuple[str, int], str] | None = None, **options: Any
) -> Path:
    """Write the same as .xls by xlwt."""
    book = xlwt.Workbook()
    book.dates_1904 = bool(options.get("date_1904"))
    for name, rows in sheets.items():
        sheet = book.add_sheet(name)
        formats = {c: xlwt.easyxf(num_format_str=f) for (own, c), f in (styles or {}).items() if own == name}
        for r, row in enumerate(rows):
            for c, cell in enumerate(row):
                style = formats.get(c, xlwt.Style.default_style) if r else xlwt.Style.default_style
                if isinstance(cell, tuple):
                    cell = xlwt.Formula(cell[0].lstrip("="))
                if isinstance(cell, datetime):
                    style = style if c in formats else xlwt.easyxf(num_format_str="d.mmm")
                    cell = (cell - (datetime(1904, 1, 1) if book.dates_1904 else datetime(1899, 12, 30))) / timedelta(days=1)
                if isinstance(cell, timedelta):
                    cell = cell / timedelta(days=1)
                if cell is not None:
                    sheet.write(r, c, cell, style)
    book.save(str(path))
    return path


Writer = Callable[..., Path]
both = pytest.mark.parametrize(("write", "ending"), [(new_workbook, "xlsx"), (old_workbook, "xls")], ids=["xlsx", "xls"])


@both
def test_a_workbook_is_read_to_the_numbers_that_are_stored_in_it(tmp_path: Path, write: Writer, ending: str) -> None:
    table = read_lab_file(write(tmp_path / f"press.{ending}", {"Data": [HEADER, *ROWS]}))
    assert_truth(table)
    assert table.encoding == f"{ending}, sheet Data"
    assert table.decimal == "."
    assert table.lines[0] == 2
    assert table.lines[-1] == N + 1
    assert table.unread == ()
    assert table.reasons == ("",) * N


@both
def test_numbers_of_three_decimals_in_a_workbook_are_no_thousands(tmp_path: Path, write: Writer, ending: str) -> None:
    force = np.round(FORCE, 3)
    force[:20] = np.linspace(0.0123, 0.0571, 20)  # below one more decimals, above it three: as a damaged text would have
    rows = [(t, x, float(f)) for (t, x, _), f in zip(ROWS, force, strict=True)]
    assert_truth(read_lab_file(write(tmp_path / f"press.{ending}", {"Data": [HEADER, *rows]})), force)


@both
def test_empty_rows_and_columns_before_a_table_keep_its_rows_and_columns_numbered_as_in_the_sheet(
    tmp_path: Path, write: Writer, ending: str
) -> None:
    rows = [(), ("", "", "Sample 7"), (), (None, None, *HEADER), *((None, None, *row) for row in ROWS)]
    path = write(tmp_path / f"press.{ending}", {"Data": rows})
    table = read_lab_file(path)
    assert_truth(table)
    assert table.lines[0] == 5
    rows[10] = (None, None, 0.5, "broken", 0.2)
    path = write(tmp_path / f"broken.{ending}", {"Data": rows})
    assert f"{path}:11:4: " in refusal(path)


@both
def test_the_sheet_that_is_a_record_is_found_and_the_others_are_named(tmp_path: Path, write: Writer, ending: str) -> None:
    sheets = {
        "Notes": [("Operator", "J. Doe"), ("Ball", "5 mm")],
        "Data": [HEADER, *ROWS],
        "Results": [("Specimen", "Modulus (MPa)"), (1, 0.31)],
        "Empty": [],
    }
    table = read_lab_file(write(tmp_path / f"press.{ending}", sheets))
    assert_truth(table)
    assert 'read from sheet "Data"' in table.notes
    assert {part.what for part in table.unread} >= {'sheet "Notes"', 'sheet "Results"', 'sheet "Empty"'}


@both
def test_several_sheets_that_are_records_are_a_choice(tmp_path: Path, write: Writer, ending: str) -> None:
    other = [(t, x, 2 * f) for t, x, f in ROWS]
    path = write(tmp_path / f"press.{ending}", {"Ball 1": [HEADER, *ROWS], "Ball 2": [HEADER, *other]})
    with pytest.raises(InputError) as refused:
        read_lab_file(path)
    assert refused.value.faults[0].choice == Choice("sheet", ("Ball 1", "Ball 2"))
    assert '--sheet "Ball 1"' in str(refused.value)
    assert_truth(read_lab_file(path, Reading(sheet="Ball 1")))
    table = read_lab_file(path, Reading(sheet="ball 2"))
    assert_truth(table, 2 * FORCE)
    assert [str(part) for part in table.unread] == ['sheet "Ball 1": sheet "Ball 2" was asked for']
    assert 'there is no sheet "Ball 3"' in refusal(path, Reading(sheet="Ball 3"))


def test_a_record_with_a_fault_is_not_passed_over_for_another_sheet(tmp_path: Path) -> None:
    faulty = [*ROWS[:50], (5.0, 0.25, "broken"), *ROWS[51:]]
    path = new_workbook(tmp_path / "press.xlsx", {"Good": [HEADER, *ROWS], "Faulty": [HEADER, *faulty]})
    assert "2 sheets of the file are records" in refusal(path)
    assert 'sheet "Faulty": "broken"' in refusal(path, Reading(sheet="Faulty"))


def test_a_hidden_sheet_is_read_only_where_no_other_is_a_record(tmp_path: Path) -> None:
    def write(path: Path, with_other: bool) -> Path:
        book = xlsxwriter.Workbook(str(path))
        sheet = book.add_worksheet("Old")
        other = book.add_worksheet("Data")
        other.activate()
        sheet.hide()
        for r, row in enumerate([HEADER, *ROWS]):
            sheet.write_row(r, 0, row)
            if with_other:
                other.write_row(r, 0, row)
        book.close()
        return path

    table = read_lab_file(write(tmp_path / "both.xlsx", with_other=True))
    assert table.encoding == "xlsx, sheet Data"
    assert 'hidden sheet "Old": it is hidden' in map(str, table.unread)
    table = read_lab_file(write(tmp_path / "one.xlsx", with_other=False))
    assert 'read from hidden sheet "Old"' in table.notes


@both
def test_a_text_among_numbers_is_refused_with_its_cell_and_read_as_the_user_says(
    tmp_path: Path, write: Writer, ending: str
) -> None:
    rows: list[tuple[Any, ...]] = [HEADER, *ROWS]
    rows[77] = (*ROWS[76][:2], f"{ROWS[76][2]:.6f}".replace(".", ","))
    path = write(tmp_path / f"press.{ending}", {"Data": rows})
    assert "C78" in refusal(path)
    assert "--decimal" in refusal(path)
    table = read_lab_file(path, Reading(decimal=","))
    assert_truth(table)
    assert any("decimal comma" in note and "C78" in note for note in table.notes)


@pytest.mark.parametrize("text", ["1,243", "1.243", "0,21", "0.21", "1 243", "1'243.5", "97,301"])
def test_no_text_that_looks_like_a_number_is_read_silently_among_numbers(tmp_path: Path, text: str) -> None:
    rows: list[tuple[Any, ...]] = [HEADER, *ROWS]
    for row in (1, 60, N):
        rows[row] = (*ROWS[row - 1][:2], text)
    assert "is text" in refusal(new_workbook(tmp_path / "press.xlsx", {"Data": rows}))


def test_whole_numbers_beside_texts_with_decimals_were_changed_by_a_spreadsheet_program(tmp_path: Path) -> None:
    # "1.243" typed into a German program is 1243, "0.21" stays text.
    rows: list[tuple[Any, ...]] = [HEADER]
    rows += [(t, x, float(f"{f:.3f}".replace(".", "")) if f >= 1 else f"{f:.3f}") for t, x, f in ROWS]
    path = new_workbook(tmp_path / "press.xlsx", {"Data": rows})
    assert "is text" in refusal(path)
    assert "one of thousands" in refusal(path, Reading(decimal="."))


@both
def test_a_column_of_numbers_written_as_text_is_read_if_its_mark_is_clear(tmp_path: Path, write: Writer, ending: str) -> None:
    def rows(mark: str, digits: int) -> list[tuple[Any, ...]]:
        return [HEADER, *((t, x, f"{f:.{digits}f}".replace(".", mark)) for t, x, f in ROWS)]

    assert_truth(read_lab_file(write(tmp_path / f"a.{ending}", {"Data": rows(",", 6)})))
    assert_truth(read_lab_file(write(tmp_path / f"b.{ending}", {"Data": rows(".", 6)})))
    unclear = [HEADER, *((t, x, f"{1 + i},{250 + i}") for i, (t, x, _) in enumerate(ROWS))]
    path = write(tmp_path / f"c.{ending}", {"Data": unclear})
    assert "decimal mark cannot be told" in refusal(path)
    table = read_lab_file(path, Reading(decimal=","))
    np.testing.assert_allclose(table.columns["force"], [1 + i + (250 + i) / 1000 for i in range(N)])


def in_texts(rows: Cells, digits: Sequence[int], mark: str = ",") -> list[tuple[str, ...]]:
    """Rows of numbers as texts with a decimal mark and so many decimals in each column."""
    return [tuple(f"{v:.{d}f}".replace(".", mark) for v, d in zip(row, digits, strict=True)) for row in rows]


LARGE = np.round(97.2 + 0.011 * np.arange(N), 3)
ALL_THREE = [(1 + t, 1 + x, c) for (t, x, _), c in zip(ROWS, LARGE, strict=True)]
METER = ("Time (s)", "Extension (mm)", "Cp (pF)")


@both
@pytest.mark.parametrize("mark", [",", "."])
def test_texts_of_exactly_three_decimals_have_the_mark_that_other_texts_show(
    tmp_path: Path, write: Writer, ending: str, mark: str
) -> None:
    table = read_lab_file(write(tmp_path / f"a.{ending}", {"Data": [METER, *in_texts(ALL_THREE, (2, 4, 3), mark)]}))
    np.testing.assert_allclose(table.columns["capacitance"], LARGE * 1e-12, rtol=1e-9)
    assert any("column C are text" in note for note in table.notes)


@both
@pytest.mark.parametrize("mark", [",", "."])
def test_texts_that_all_have_three_decimals_are_read_as_the_user_says(
    tmp_path: Path, write: Writer, ending: str, mark: str
) -> None:
    path = write(tmp_path / f"a.{ending}", {"Data": [METER, *in_texts(ALL_THREE, (3, 3, 3), mark)]})
    with pytest.raises(InputError) as refused:
        read_lab_file(path)
    assert refused.value.faults[0].choice == Choice("decimal", (",", "."))
    table = read_lab_file(path, Reading(decimal=mark))
    np.testing.assert_allclose(table.columns["time"], 1 + TIME, rtol=1e-9)
    np.testing.assert_allclose(table.columns["capacitance"], LARGE * 1e-12, rtol=1e-9)


def test_the_mark_of_texts_is_said_beside_numbers_and_beside_a_second_column_of_the_quantity(tmp_path: Path) -> None:
    header = ("Time (s)", "Extension (mm)", "Load (N)", "Load (mN)", "Cp (pF)")
    rows = [(*row, row[2] * 1e3, f"{c:.3f}".replace(".", ",")) for row, c in zip(ROWS, LARGE, strict=True)]
    path = new_workbook(tmp_path / "a.xlsx", {"Data": [header, *rows]})
    assert "--decimal" in refusal(path)
    assert_truth(table := read_lab_file(path, Reading(decimal=",")))
    np.testing.assert_allclose(table.columns["capacitance"], LARGE * 1e-12, rtol=1e-9)


def test_whole_numbers_among_texts_are_texts_where_no_cell_is_a_number(tmp_path: Path) -> None:
    rows = [(f"{t:g}".replace(".", ","), f"{x:.4f}".replace(".", ","), f"{f:.6f}".replace(".", ",")) for t, x, f in ROWS]
    assert_truth(read_lab_file(new_workbook(tmp_path / "a.xlsx", {"Data": [HEADER, *rows]})))


@pytest.mark.parametrize("decimal", ["", ",", "."])
def test_texts_that_contradict_each_other_are_refused_whatever_mark_is_said(tmp_path: Path, decimal: str) -> None:
    rows = in_texts(ROWS, (2, 4, 5))
    rows[70] = (*rows[70][:2], rows[70][2].replace(",", "."))
    assert "mark" in refusal(new_workbook(tmp_path / "a.xlsx", {"Data": [HEADER, *rows]}), Reading(decimal=decimal))


def test_texts_of_three_decimals_with_another_mark_than_the_others_show_are_refused(tmp_path: Path) -> None:
    rows = [(*a[:2], b[2]) for a, b in zip(in_texts(ALL_THREE, (2, 4, 3)), in_texts(ALL_THREE, (2, 4, 3), "."), strict=True)]
    assert "cannot be told" in refusal(new_workbook(tmp_path / "a.xlsx", {"Data": [METER, *rows]}))


def test_a_text_file_put_into_the_first_column_is_read_as_text(tmp_path: Path) -> None:
    lines = [(";".join(HEADER),), *((";".join(f"{v:.6f}".replace(".", ",") for v in row),) for row in ROWS)]
    table = read_lab_file(new_workbook(tmp_path / "press.xlsx", {"Data": lines}))
    assert_truth(table)
    assert table.decimal == ","


@both
def test_dates_and_times_are_read_as_clocks(tmp_path: Path, write: Writer, ending: str) -> None:
    begun = datetime(2024, 5, 2, 23, 59, 55)
    rows: list[tuple[Any, ...]] = [("Time", *HEADER[1:])]
    rows += [(begun + timedelta(seconds=t), x, f) for t, x, f in ROWS]
    path = write(tmp_path / f"press.{ending}", {"Data": rows}, {("Data", 0): "yyyy-mm-dd hh:mm:ss.000"})
    table = read_lab_file(path)
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=2e-3)
    assert table.started == begun
    path = write(tmp_path / f"1904.{ending}", {"Data": rows}, {("Data", 0): "yyyy-mm-dd hh:mm:ss.000"}, date_1904=True)
    assert read_lab_file(path).started == begun


@both
def test_times_of_day_are_read_as_clocks(tmp_path: Path, write: Writer, ending: str) -> None:
    rows: list[tuple[Any, ...]] = [("Time", *HEADER[1:])]
    rows += [(timedelta(hours=9, seconds=t), x, f) for t, x, f in ROWS]
    table = read_lab_file(write(tmp_path / f"press.{ending}", {"Data": rows}, {("Data", 0): "hh:mm:ss.000"}))
    np.testing.assert_allclose(table.columns["time"], 32400 + TIME, atol=1e-5)


@both
def test_durations_are_read_as_clocks(tmp_path: Path, write: Writer, ending: str) -> None:
    rows: list[tuple[Any, ...]] = [("Time", *HEADER[1:]), *((timedelta(seconds=t), x, f) for t, x, f in ROWS)]
    table = read_lab_file(write(tmp_path / f"press.{ending}", {"Data": rows}, {("Data", 0): "[h]:mm:ss.000"}))
    np.testing.assert_allclose(table.columns["time"], TIME, atol=1e-5)


@both
def test_a_date_among_forces_is_refused_with_its_cell(tmp_path: Path, write: Writer, ending: str) -> None:
    rows: list[tuple[Any, ...]] = [HEADER, *ROWS]
    rows[40] = (*ROWS[39][:2], datetime(2024, 12, 3))
    path = write(tmp_path / f"press.{ending}", {"Data": rows}, **({"default_date_format": "d.mmm"} if ending == "xlsx" else {}))
    assert "is a date" in refusal(path)
    assert f"{path}:41:3" in refusal(path)


def test_seconds_shown_as_dates_are_refused(tmp_path: Path) -> None:
    path = new_workbook(tmp_path / "press.xlsx", {"Data": [HEADER, *ROWS]}, {("Data", 0): "dd.mm.yyyy"})
    assert "is a date" in refusal(path)


@both
@pytest.mark.parametrize(
    "number_format", ["0.00", "#,##0.00", "0.00E+00", "0.0;[Red]-0.0", "General", "_-* #,##0.00_-", "0.0 ?/?"]
)
def test_a_number_format_that_only_rounds_changes_nothing(
    tmp_path: Path, write: Writer, ending: str, number_format: str
) -> None:
    path = write(tmp_path / f"press.{ending}", {"Data": [HEADER, *ROWS]}, {("Data", 2): number_format})
    assert_truth(read_lab_file(path))


@both
@pytest.mark.parametrize("number_format", ['0.00 "kN"', '0.0,"k"', "0.0,", "0%", '0"."00', '0.0 "mN"', "0.0 \\g"])
def test_a_number_that_is_shown_otherwise_than_its_header_says_is_refused(
    tmp_path: Path, write: Writer, ending: str, number_format: str
) -> None:
    path = write(tmp_path / f"press.{ending}", {"Data": [HEADER, *ROWS]}, {("Data", 2): number_format})
    assert "C2" in refusal(path)
    table = read_lab_file(path, Reading(units={"force": "N"}))
    assert_truth(table)
    assert any("is shown as" in note for note in table.notes)


@both
def test_a_number_format_with_the_unit_of_the_header_or_instead_of_one_is_read(
    tmp_path: Path, write: Writer, ending: str
) -> None:
    path = write(tmp_path / f"a.{ending}", {"Data": [HEADER, *ROWS]}, {("Data", 2): '0.00 "N"'})
    assert_truth(read_lab_file(path))
    path = write(tmp_path / f"b.{ending}", {"Data": [(*HEADER[:2], "Load"), *ROWS]}, {("Data", 2): '0.00 "mN"'})
    table = read_lab_file(path)
    assert_truth(table, FORCE / 1e3)
    assert any('number format "0.00 "mN""' in note for note in table.notes)


@both
@pytest.mark.parametrize("name", ["D", "D (%)"])
def test_dissipation_shown_in_per_cent_is_the_stored_fraction(tmp_path: Path, write: Writer, ending: str, name: str) -> None:
    rows = [("Time (s)", "Cp (pF)", name), *((t, c, 0.0123) for t, c in LOG)]
    table = read_lab_file(write(tmp_path / f"log.{ending}", {"Log": rows}, {("Log", 2): "0.00%"}))
    np.testing.assert_allclose(table.columns["dissipation"], 0.0123, rtol=1e-12)


def test_cells_with_errors_make_their_rows_unusable_with_the_reason(tmp_path: Path) -> None:
    rows: list[tuple[Any, ...]] = [HEADER, *ROWS]
    rows[30] = (*ROWS[29][:2], ("=1/0", "#DIV/0!"))
    rows[31] = (*ROWS[30][:2], ("=NA()", "#N/A"))
    table = read_lab_file(new_workbook(tmp_path / "press.xlsx", {"Data": rows}))
    assert table.reasons[29] == "error #DIV/0! in C31"
    assert table.reasons[30] == "error #N/A in C32"
    assert np.isnan(table.columns["force"][[29, 30]]).all()
    assert sum(map(bool, table.reasons)) == 2


@pytest.mark.parametrize(
    "name", ["Force 2 (N)", "Force corrected (N)", "Stiffness (N/mm)", "D", "Cycle", "Displacement 2 (mm)"]
)
@pytest.mark.parametrize("wrong", [slice(0, 30), slice(1, None, 2), slice(3, 8)])
def test_an_error_in_a_column_that_is_not_read_takes_no_row(tmp_path: Path, name: str, wrong: slice) -> None:
    cells: list[Any] = [0.5 + 0.001 * i for i in range(len(ROWS))]
    cells[wrong] = [("=1/0", "#DIV/0!")] * len(cells[wrong])
    rows = [(*HEADER, name), *((*row, cell) for row, cell in zip(ROWS, cells, strict=True))]
    table = read_lab_file(new_workbook(tmp_path / "press.xlsx", {"Data": rows}))
    assert not any(table.reasons)
    assert np.isfinite(table.columns["force"]).all()


def test_many_errors_of_one_column_are_told_together(tmp_path: Path) -> None:
    rows: list[tuple[Any, ...]] = [HEADER, *ROWS]
    rows[11:16] = [(*row[:2], ("=1/0", "#DIV/0!")) for row in rows[11:16]]
    table = read_lab_file(new_workbook(tmp_path / "press.xlsx", {"Data": rows}))
    assert {reason for reason in table.reasons if reason} == {"error #DIV/0! in column C"}


def test_formulas_with_results_are_read(tmp_path: Path) -> None:
    rows = [HEADER, *((t, x, (f"=A{i}*1", f)) for i, (t, x, f) in enumerate(ROWS, 2))]
    assert_truth(read_lab_file(new_workbook(tmp_path / "press.xlsx", {"Data": rows})))


@pytest.mark.parametrize("result", [0, ""])
def test_formulas_without_results_are_refused(tmp_path: Path, result: Any) -> None:
    rows = [HEADER, *((t, x, (f"=A{i}*1", result)) for i, (t, x, _) in enumerate(ROWS, 2))]
    assert "Open the file in a spreadsheet program" in refusal(new_workbook(tmp_path / "press.xlsx", {"Data": rows}))


def test_formulas_of_an_old_workbook_that_were_never_calculated_are_refused(tmp_path: Path) -> None:
    rows = [HEADER, *((t, x, (f"=A{i}*1", 0)) for i, (t, x, _) in enumerate(ROWS, 2))]
    assert "have no result" in refusal(old_workbook(tmp_path / "press.xls", {"Data": rows}))


@both
def test_a_mean_below_a_column_of_numbers_is_no_reading(tmp_path: Path, write: Writer, ending: str) -> None:
    rows: list[tuple[Any, ...]] = [HEADER, *ROWS, (12.0, 0.6, ("=AVERAGE(C2:C121)", 1.23))]
    table = read_lab_file(write(tmp_path / f"press.{ending}", {"Data": rows}))
    assert "formula" in table.reasons[-1]
    assert "C122" in table.reasons[-1]


def test_hidden_rows_and_columns_and_merged_cells_are_named(tmp_path: Path) -> None:
    book = xlsxwriter.Workbook(str(tmp_path / "press.xlsx"))
    sheet = book.add_worksheet("Data")
    sheet.merge_range(0, 0, 0, 2, "Press 1")
    for r, row in enumerate([HEADER, *ROWS]):
        sheet.write_row(r + 1, 0, row)
    for hidden in range(20, 25):
        sheet.set_row(hidden, None, None, {"hidden": True})
    sheet.set_column(2, 2, None, None, {"hidden": True})
    book.close()
    table = read_lab_file(tmp_path / "press.xlsx")
    assert_truth(table)
    notes = " / ".join(table.notes)
    assert "5 hidden row(s) are read as the others, the first is row 21" in notes
    assert "hidden column(s) C are" in notes
    assert "A1:C1" in notes


def test_a_size_that_a_workbook_states_wrongly_cuts_nothing_off(tmp_path: Path) -> None:
    new_workbook(tmp_path / "right.xlsx", {"Data": [HEADER, *ROWS]})
    path = rezipped(
        tmp_path / "right.xlsx",
        tmp_path / "wrong.xlsx",
        lambda name, data: data.replace(b'ref="A1:C121"', b'ref="A1"') if "worksheets" in name else data,
    )
    assert_truth(read_lab_file(path))


def test_a_workbook_of_charts_alone_is_refused(tmp_path: Path) -> None:
    book = xlsxwriter.Workbook(str(tmp_path / "chart.xlsx"))
    book.add_worksheet("Data")
    chart = book.add_chart({"type": "line"})
    chart.add_series({"values": "=Data!A1:A9"})
    book.add_chartsheet("Chart").set_chart(chart)
    book.close()
    said = refusal(tmp_path / "chart.xlsx")
    assert 'sheet "Data": it is empty' in said
    assert 'sheet "Chart": it is a chart' in said


@both
def test_several_specimens_of_a_sheet_are_a_choice(tmp_path: Path, write: Writer, ending: str) -> None:
    other = [(t, x, 2 * f) for t, x, f in ROWS]
    rows = [HEADER * 2, *((*a, *b) for a, b in zip(ROWS, other, strict=True))]
    path = write(tmp_path / f"press.{ending}", {"Data": rows, "Notes": [("x",)]})
    with pytest.raises(SeveralSpecimens):
        read_lab_file(path)
    assert_truth(read_lab_file(path, Reading(specimen=2)), 2 * FORCE)


@both
def test_a_column_without_a_name_beside_a_table_is_named_as_not_read(tmp_path: Path, write: Writer, ending: str) -> None:
    rows = [HEADER, *((*row, None, 7.5 + i) for i, row in enumerate(ROWS))]
    table = read_lab_file(write(tmp_path / f"press.{ending}", {"Data": rows}))
    assert_truth(table)
    assert any("column 5" in part.what for part in table.unread)


@both
def test_columns_without_header_are_read_as_the_user_says(tmp_path: Path, write: Writer, ending: str) -> None:
    path = write(tmp_path / f"press.{ending}", {"Data": ROWS})
    said = Reading(
        columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    assert "no header row" in refusal(path)
    assert_truth(read_lab_file(path, said))


def rezipped(source: Path, target: Path, change: Callable[[str, bytes], bytes]) -> Path:
    """Write an archive anew with its entries changed."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, change(name, old.read(name)))
    return target


def test_a_workbook_of_the_strict_variant_is_refused_as_one(tmp_path: Path) -> None:
    new_workbook(tmp_path / "usual.xlsx", {"Data": [HEADER, *ROWS]})
    new = b"http://purl.oclc.org/ooxml/"
    strict = rezipped(
        tmp_path / "usual.xlsx",
        tmp_path / "strict.xlsx",
        lambda name, data: data.replace(
            b"http://schemas.openxmlformats.org/spreadsheetml/2006/main", new + b"spreadsheetml/main"
        ).replace(
            b"http://schemas.openxmlformats.org/officeDocument/2006/relationships", new + b"officeDocument/relationships"
        ),
    )
    assert 'strict.xlsx: the workbook is saved as Strict Open XML, which is not read. Save it as "Excel Workbook' in refusal(
        strict
    )


def test_an_empty_workbook_is_refused_with_its_name_and_advice(tmp_path: Path) -> None:
    path = new_workbook(tmp_path / "empty.xlsx", {"Leer": []})
    assert 'empty.xlsx: sheet "Leer" is no table: it is empty. Give a file' in refusal(path)


def test_a_workbook_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    new_workbook(tmp_path / "small.xlsx", {"Data": [HEADER, *ROWS]})
    far = rezipped(
        tmp_path / "small.xlsx",
        tmp_path / "far.xlsx",
        lambda name, data: data.replace(b'<c r="C121"', b'<c r="XFD121"') if "worksheets" in name else data,
    )
    rows = "".join(f'<row r="{r}"><c r="XFD{r}"><v>1</v></c></row>' for r in range(122, 1200)).encode()
    far = rezipped(
        far,
        tmp_path / "farther.xlsx",
        lambda name, data: data.replace(b"</sheetData>", rows + b"</sheetData>") if "worksheets" in name else data,
    )
    assert "cells" in refusal(far) or "reaches to" in refusal(far)
    with zipfile.ZipFile(tmp_path / "small.xlsx", "a") as bomb:
        bomb.writestr("xl/bomb.xml", bytes(1000))
        bomb.getinfo("xl/bomb.xml").file_size = 1_600_000_000  # as its directory says: to pack that much takes seconds
    assert "would unpack to" in refusal(tmp_path / "small.xlsx")


@both
def test_a_damaged_workbook_is_refused(tmp_path: Path, write: Writer, ending: str) -> None:
    path = write(tmp_path / f"press.{ending}", {"Data": [HEADER, *ROWS]})
    data = path.read_bytes()
    for size in (600, len(data) // 2, len(data) - 30):
        path.write_bytes(data[:size])
        if ending == "xlsx" or size < len(data) - 30:
            assert refusal(path)


def test_a_workbook_with_a_password_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "locked.xlsx"
    path.write_bytes(bytes.fromhex("d0cf11e0a1b11ae1") + bytes(1000) + "EncryptedPackage".encode("utf-16-le") + bytes(3000))
    assert "password" in refusal(path)


@pytest.mark.parametrize(("library", "write", "ending"), [("openpyxl", new_workbook, "xlsx"), ("xlrd", old_workbook, "xls")])
def test_without_the_library_it_is_said_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str, write: Writer, ending: str
) -> None:
    path = write(tmp_path / f"press.{ending}", {"Data": [HEADER, *ROWS]})
    monkeypatch.setitem(sys.modules, library, None)
    assert 'pip install "dielectric-elastomer-calibration[formats]"' in refusal(path)


# --- what is no lab file -------------------------------------------------------------------------------------------------


def _archive(*names: str) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in names:
            archive.writestr(name, "x")
    return out.getvalue()


def _database(folder: Path) -> bytes:
    connection = sqlite3.connect(folder / "made.db")
    connection.execute("create table press (time real, force real)")
    connection.commit()
    connection.close()
    return (folder / "made.db").read_bytes()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("press.ods", _archive("mimetype", "content.xml"), "OpenDocument"),
        ("press.numbers", _archive("Index/Document.iwa"), "Numbers"),
        ("press.xlsb", _archive("xl/workbook.bin"), "xlsb"),
        ("press.docx", _archive("word/document.xml"), "Word"),
        ("press.npz", _archive("time.npy"), "NumPy"),
        ("press.zip", _archive("press.csv"), "zip archive"),
        ("press.csv.gz", b"\x1f\x8b\x08\x00", "gzip"),
        ("press.parquet", b"PAR1\x15\x04", "Parquet"),
        ("press.feather", b"ARROW1\x00\x00", "Feather"),
        ("press.xls", b"<html><table><tr><td>Time (s)</td></tr></table></html>", "web page"),
        ("press.xls", b'<?xml version="1.0"?>\n<Workbook xmlns="urn:schemas-microsoft-com:office:spreadsheet">', "2003"),
        ("press.png", b"\x89PNG\r\n\x1a\n", "picture"),
        ("press.pdf", b"%PDF-1.7\n", "PDF"),
        ("press.npy", b"\x93NUMPY\x01\x00", "NumPy"),
        ("press.db", None, "SQLite"),
    ],
)
def test_other_formats_are_refused_with_what_to_do(tmp_path: Path, name: str, content: bytes | None, said: str) -> None:
    path = tmp_path / name
    path.write_bytes(_database(tmp_path) if content is None else content)
    with pytest.raises(InputError) as refused:
        read_lab_file(path)
    assert said in str(refused.value)
    assert refused.value.faults[0].advice


@pytest.mark.parametrize("above", ['{"rig": "desk", "v": 3}', '{\n "rig": "desk",\n "notes": ["a", "b"]\n}\n', '[{"rig": 1}]'])
def test_json_above_a_table_does_not_make_it_a_json_file(tmp_path: Path, above: str) -> None:
    path = tmp_path / "press.csv"
    path.write_text("\n".join([above, ",".join(HEADER), *(",".join(map(repr, row)) for row in ROWS)]) + "\n")
    assert_truth(read_lab_file(path))


def test_a_text_file_with_the_ending_of_a_workbook_is_read_as_text(tmp_path: Path) -> None:
    path = tmp_path / "press.xls"
    path.write_text("\n".join(["\t".join(HEADER), *("\t".join(map(repr, row)) for row in ROWS)]) + "\n")
    assert_truth(read_lab_file(path))
    assert "the file is text" in refusal(path, Reading(sheet="Data"))


# --- LabVIEW's text ------------------------------------------------------------------------------------------------------


def lvm(
    rows: Sequence[Sequence[str]],
    *,
    names: Sequence[str],
    units: Sequence[str],
    x_columns: str = "One",
    decimal: str | None = ".",
    separator: str = "Tab",
    segment: Sequence[str] = (),
    first: bool = True,
    clock: str = "14:03:20.25",
    time_pref: str = "Relative",
    x_dimension: str = "Time",
) -> str:
    """A segment, by default with the header of its file, as National Instruments describes the format."""
    n = len(units)
    file = [
        "LabVIEW Measurement",
        "Writer_Version\t2",
        "Reader_Version\t2",
        f"Separator\t{separator}",
        *([] if decimal is None else [f"Decimal_Separator\t{decimal}"]),
        "Multi_Headings\tYes",
        f"X_Columns\t{x_columns}",
        f"Time_Pref\t{time_pref}",
        "Operator\tlab",
        "Description\tpress of sensor 1",
        "Date\t2024/05/02",
        "Time\t14:03:20.25",
        "***End_of_Header***",
        "",
    ]
    header = [
        f"Channels\t{n}",
        "\t".join(["Samples", *[str(len(rows))] * n]),
        "\t".join(["Date", *["2024/05/02"] * n]),
        "\t".join(["Time", *[clock] * n]),
        "\t".join(["Y_Unit_Label", *units]),
        "\t".join(["X_Dimension", *[x_dimension] * n]),
        *segment,
        "***End_of_Header***",
        "\t".join(names),
    ]
    lines = [*(file if first else []), *header, *("\t".join(row) for row in rows), ""]
    text = "\r\n".join(lines) + "\r\n"
    return text.replace("\t", ",") if separator == "Comma" else text


def written(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


LVM_NAMES = ("X_Value", "Extension", "Load", "Comment")


def _row(*values: float, mark: str = ".") -> list[str]:
    return [f"{value:.6f}".replace(".", mark) for value in values]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
@pytest.mark.parametrize("mark", [".", ","])
def test_lvm_with_one_column_of_x(tmp_path: Path, mark: str, encoding: str) -> None:
    rows = [_row(*row, mark=mark) for row in ROWS]
    table = read_lab_file(written(tmp_path / "a.lvm", lvm(rows, names=LVM_NAMES, units=("mm", "N"), decimal=mark), encoding))
    assert_truth(table)
    assert table.decimal == mark
    assert table.started == datetime(2024, 5, 2, 14, 3, 20)
    assert table.lines[0] == 23  # below 14 lines of the file's header, 7 of the segment's and the names


def test_lvm_with_commas_between_the_columns(tmp_path: Path) -> None:
    text = lvm([_row(*row) for row in ROWS], names=LVM_NAMES, units=("mm", "N"), separator="Comma")
    assert_truth(read_lab_file(written(tmp_path / "a.lvm", text)))
    assert "cannot be obeyed" in refusal(
        written(tmp_path / "b.lvm", text.replace("Decimal_Separator,.", "Decimal_Separator,,"))
    )


def test_lvm_obeys_the_decimal_mark_of_its_header(tmp_path: Path) -> None:
    rows = [
        [f"{t:.6f}".replace(".", ","), f"{x:.6f}".replace(".", ","), f"{1 + i},{250 + i}"] for i, (t, x, _) in enumerate(ROWS)
    ]
    path = written(tmp_path / "a.lvm", lvm(rows, names=LVM_NAMES, units=("mm", "N"), decimal=","))
    np.testing.assert_allclose(read_lab_file(path).columns["force"], [1 + i + (250 + i) / 1000 for i in range(N)])
    path = written(tmp_path / "b.lvm", lvm([_row(*row, mark=",") for row in ROWS], names=LVM_NAMES, units=("mm", "N")))
    assert "decimal mark" in refusal(path)


def test_lvm_of_the_first_version_states_no_decimal_mark(tmp_path: Path) -> None:
    rows = [_row(*row, mark=",") for row in ROWS]
    assert_truth(read_lab_file(written(tmp_path / "a.lvm", lvm(rows, names=LVM_NAMES, units=("mm", "N"), decimal=None))))


@pytest.mark.parametrize("mark", [".", ","])
def test_lvm_without_x_makes_the_time_from_its_beginning_and_step(tmp_path: Path, mark: str) -> None:
    rows = [["", *_row(*row[1:], mark=mark)] for row in ROWS]
    segment = (f"X0\t0{mark}5\t0{mark}5", f"Delta_X\t0{mark}100000\t0{mark}100000")
    text = lvm(rows, names=LVM_NAMES, units=("mm", "N"), x_columns="No", segment=segment, decimal=mark)
    table = read_lab_file(written(tmp_path / "a.lvm", text))
    np.testing.assert_allclose(table.columns["time"], TIME + 0.5, atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE)
    assert any("Delta_X 0.1" in note for note in table.notes)
    broken = text.replace(f"\r\n\t{rows[7][1]}", f"\r\n1\t{rows[7][1]}")
    assert "the first column is not empty" in refusal(written(tmp_path / "b.lvm", broken))
    assert "no Delta_X" in refusal(written(tmp_path / "c.lvm", text.replace("Delta_X", "Delta_Y")))


def test_lvm_with_an_x_for_each_channel(tmp_path: Path) -> None:
    names = ("X_Value", "Extension", "X_Value", "Load", "Comment")
    same = [_row(t, x, t, f) for t, x, f in ROWS]
    assert_truth(read_lab_file(written(tmp_path / "a.lvm", lvm(same, names=names, units=("mm", "N"), x_columns="Multi"))))
    other = [_row(t, x, t + 0.05, f) for t, x, f in ROWS]
    path = written(tmp_path / "b.lvm", lvm(other, names=names, units=("mm", "N"), x_columns="Multi"))
    said = refusal(path)
    assert '"1: Extension"' in said
    assert '"1: Load"' in said
    cap = lvm([_row(t, c, t + 0.05, f) for (t, c), f in zip(LOG, FORCE, strict=True)],
              names=("X_Value", "Cp", "X_Value", "Load"), units=("pF", "N"), x_columns="Multi")  # fmt: skip
    table = read_lab_file(written(tmp_path / "c.lvm", cap))
    np.testing.assert_allclose(table.columns["capacitance"], CAPACITANCE * 1e-12)
    assert any('segment "1: Load"' in str(part) for part in table.unread)


NAMES_OF_THREE = ("X_Value", "Extension", "X_Value", "Target", "X_Value", "Load", "Comment")


def _of_three(tags: dict[str, str], names: Sequence[str] = NAMES_OF_THREE) -> str:
    """A segment of three channels with a column of x each, whose header has these lines for its tags."""
    rows = [_row(t, x, t, 0.3, t, f) for t, x, f in ROWS]
    text = lvm(rows, names=names, units=("", "", ""), x_columns="Multi")
    lines = [
        line for line in text.split("\r\n") if line.partition("\t")[0] not in ("Samples", "Date", "Y_Unit_Label", "X_Dimension")
    ]
    lines = [line for line in lines if not line.startswith("Time\t") or line.count("\t") == 1]
    at = lines.index("Channels\t3")
    return "\r\n".join([*lines[: at + 1], *(f"{tag}\t{values}" for tag, values in tags.items()), *lines[at + 1 :]])


@pytest.mark.parametrize("units", ["mm\t\tN\t\tmN\t", "mm\t\t\t\tmN\t", "mm\tN\tmN\t", "mm\t\tmN\t\t\t"])
@pytest.mark.parametrize("dates", ["2024/05/02\t\t2024/05/02\t\t2024/05/02\t", "2024/05/02\t2024/05/02\t2024/05/02\t"])
def test_units_of_an_lvm_file_are_those_that_stand_above_their_channels(tmp_path: Path, units: str, dates: str) -> None:
    """Two fields apart as National Instruments writes them, or one, as every line of the header shows; else they are open."""
    path = written(tmp_path / "a.lvm", _of_three({"Date": dates, "Y_Unit_Label": units}))
    fields = units.split("\t")
    stride = 2 if "\t\t" in dates else 1
    fits = all(i % stride == 0 and i < 3 * stride for i, unit in enumerate(fields) if unit)
    if fits and fields[2 * stride] == "mN":
        assert_truth(read_lab_file(path), FORCE * 1e-3)
    else:
        assert "--units force=" in refusal(path)
        said = {"displacement": "mm", "force": "mN"}
        assert_truth(read_lab_file(path, Reading(units=said)), FORCE * 1e-3)


def test_units_of_an_lvm_file_whose_places_fit_both_layouts_are_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path / "a.lvm", _of_three({"Y_Unit_Label": "mm\t\tmN"}))
    assert "--units force=" in refusal(path)
    named = ("X_Value", "Extension (mm)", "X_Value", "Target", "X_Value", "Load (mN)")
    table = read_lab_file(written(tmp_path / "b.lvm", _of_three({"Y_Unit_Label": "mm\t\tmN"}, named)))
    assert_truth(table, FORCE * 1e-3)
    assert any("cannot be told: they are not taken" in note for note in table.notes)


def test_channels_of_an_lvm_file_that_began_at_different_times_are_no_one_record(tmp_path: Path) -> None:
    clocks = "14:03:20.25\t\t14:03:20.25\t\t{}\t"
    tags = {"Date": "2024/05/02\t\t2024/05/02\t\t2024/05/02\t", "Y_Unit_Label": "mm\t\tN\t\tN\t"}
    said = refusal(written(tmp_path / "a.lvm", _of_three({**tags, "Time": clocks.format("14:03:20.75")})))
    assert '"1: Load"' in said
    assert "displacement interpolated to these times" in said
    assert_truth(read_lab_file(written(tmp_path / "b.lvm", _of_three({**tags, "Time": clocks.format("14:03:20.2503")}))))


def test_lvm_with_lines_of_separators_alone(tmp_path: Path) -> None:
    text = lvm([_row(*row) for row in ROWS], names=LVM_NAMES, units=("mm", "N"), separator="Comma")
    text = text.replace("***End_of_Header***\r\n", "***End_of_Header***,\r\n,\r\n,,,,\r\n")
    assert_truth(read_lab_file(written(tmp_path / "a.lvm", text)))


def test_lvm_times_that_count_from_midnight_are_no_times_since_1904(tmp_path: Path) -> None:
    rows = [_row(50707.25 + t, x, f) for t, x, f in ROWS]
    text = lvm(rows, names=("X_Value", "LVDT", "Load"), units=("mm", "N"), time_pref="Absolute")
    table = read_lab_file(written(tmp_path / "a.lvm", text))
    np.testing.assert_allclose(np.diff(table.columns["time"]), np.diff(TIME), atol=1e-6)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3, rtol=1e-12)
    assert table.started is None or table.started.year == 2024
    assert not any("absolute" in note for note in table.notes)


def test_lvm_segments_whose_times_go_on_are_one_record(tmp_path: Path) -> None:
    rows = [_row(*row) for row in ROWS]
    pieces = (rows[:50], rows[50:90], rows[90:])
    text = "".join(lvm(p, names=LVM_NAMES, units=("mm", "N"), first=not k) for k, p in enumerate(pieces))
    table = read_lab_file(written(tmp_path / "a.lvm", text))
    assert_truth(table)
    assert any("3 segments" in note for note in table.notes)


def test_lvm_segments_that_count_anew_are_put_together_by_their_clocks_or_are_a_choice(tmp_path: Path) -> None:
    rows = [_row(*row) for row in ROWS]
    anew = [_row(t - 5.0, x, f) for t, x, f in ROWS[50:]]

    def text(clock: str) -> str:
        return lvm(rows[:50], names=LVM_NAMES, units=("mm", "N")) + lvm(
            anew, names=LVM_NAMES, units=("mm", "N"), first=False, clock=clock
        )

    table = read_lab_file(written(tmp_path / "a.lvm", text("14:03:25.25")))
    assert_truth(table)
    assert any("by their dates and times" in note for note in table.notes)
    path = written(tmp_path / "b.lvm", text("14:03:20.25"))
    assert "2 segments of the file are records" in refusal(path)
    assert len(read_lab_file(path, Reading(sheet="2")).lines) == N - 50


def test_lvm_with_absolute_times(tmp_path: Path) -> None:
    begun = (datetime(2024, 5, 2, 14, 3, 20) - datetime(1904, 1, 1)).total_seconds()
    rows = [_row(begun + t, x, f) for t, x, f in ROWS]
    table = read_lab_file(written(tmp_path / "a.lvm", lvm(rows, names=LVM_NAMES, units=("mm", "N"), time_pref="Absolute")))
    assert_truth(table)
    assert table.started == datetime(2024, 5, 2, 14, 3, 20)
    assert any("UTC" in note for note in table.notes)


def test_lvm_with_special_blocks_and_comments(tmp_path: Path) -> None:
    rows = [_row(*row) for row in ROWS]
    rows[0] = [*rows[0], "begin"]
    text = lvm(rows, names=LVM_NAMES, units=("mm", "N"))
    block = "***Start_Special***\r\nsetup\t7\t8\t9\r\n***End_Special***\r\n"
    assert_truth(read_lab_file(written(tmp_path / "a.lvm", text.replace("Channels\t", block + "Channels\t"))))


@pytest.mark.parametrize(
    "change",
    ["X_Columns\tOne>X_Columns\tMulti", "X_Value\tExt>X\tExt", "***End_of_Header***>", "Tab>Pipe", "Channels\t2>Channels\t1"],
)
def test_lvm_that_contradicts_its_header_is_refused(tmp_path: Path, change: str) -> None:
    old, new = change.split(">")
    text = lvm([_row(*row) for row in ROWS], names=LVM_NAMES, units=("mm", "N"))
    assert refusal(written(tmp_path / "a.lvm", text.replace(old, new)))


def test_lvm_over_something_else_than_time_has_no_time(tmp_path: Path) -> None:
    rows = [_row(*row) for row in ROWS]
    text = lvm(rows, names=LVM_NAMES, units=("mm", "N"), x_dimension="Frequency")
    assert "time" not in read_lab_file(written(tmp_path / "a.lvm", text)).columns


# --- LabVIEW's binary format ---------------------------------------------------------------------------------------------


def _string(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _property(name: str, value: object) -> bytes:
    if isinstance(value, str):
        return _string(name) + struct.pack("<I", 0x20) + _string(value)
    if isinstance(value, datetime):
        seconds = int((value - datetime(1904, 1, 1)).total_seconds())
        return _string(name) + struct.pack("<IQq", 0x44, 0, seconds)
    return _string(name) + struct.pack("<Id", 10, value)


def _object(path: str, index: bytes, properties: dict[str, object]) -> bytes:
    packed = b"".join(_property(name, value) for name, value in properties.items())
    return _string(path) + index + struct.pack("<I", len(properties)) + packed


Channels = dict[str, tuple[np.ndarray, dict[str, object]]]


def tdms(groups: dict[str, Channels], *, of_file: dict[str, object] | None = None, version: int = 4713) -> bytes:
    """One segment of contiguous doubles, singles or whole numbers, as National Instruments describes the format."""
    kinds = {"f8": 10, "f4": 9, "i4": 3}
    objects = [_object("/", b"\xff\xff\xff\xff", of_file or {})]
    raw = b""
    for group, channels in groups.items():
        objects.append(_object(f"/'{group}'", b"\xff\xff\xff\xff", {}))
        for name, (values, properties) in channels.items():
            kind = kinds[values.dtype.str[1:]]
            objects.append(_object(f"/'{group}'/'{name}'", struct.pack("<IIIQ", 20, kind, 1, values.size), properties))
            raw += values.tobytes()
    meta = struct.pack("<I", len(objects)) + b"".join(objects)
    contents = 1 << 1 | 1 << 2 | 1 << 3  # metadata, a new list of objects, raw data
    return b"TDSm" + struct.pack("<IIQQ", contents, version, len(meta) + len(raw), len(meta)) + meta + raw


def _wave(step: float, offset: float = 0.0) -> dict[str, object]:
    return {
        "wf_start_time": datetime(2024, 5, 2, 12, 3, 20),
        "wf_start_offset": offset,
        "wf_increment": step,
        "wf_samples": 1.0,
    }


PRESS: Channels = {"Extension": (DEPTH, {"unit_string": "mm"}), "Load": (FORCE, {"unit_string": "N"})}


def test_tdms_with_a_channel_of_times(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    path.write_bytes(tdms({"Press": {"Time": (TIME, {"unit_string": "s"}), **PRESS}}, of_file={"Operator": "lab"}))
    table = read_lab_file(path)
    assert_truth(table)
    assert table.encoding == "tdms, group Press"
    assert table.lines[0] == 1
    assert table.lines[-1] == N


def test_tdms_with_waveforms(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    channels = {name: (values, {**said, **_wave(0.1, 0.5)}) for name, (values, said) in PRESS.items()}
    path.write_bytes(tdms({"Press": channels}))
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["time"], TIME + 0.5, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], FORCE)
    assert table.started == datetime(2024, 5, 2, 12, 3, 20)
    assert any("made from the waveform" in note for note in table.notes)


def test_tdms_channels_of_other_rates_or_lengths_are_other_parts(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    channels = {name: (values, {**said, **_wave(0.1)}) for name, (values, said) in PRESS.items()}
    channels["Temperature"] = (np.full(30, 21.5), {"unit_string": "°C", **_wave(0.4)})
    channels["Serial"] = (np.arange(3.0), {})
    path.write_bytes(tdms({"Press": channels, "Empty": {}}))
    table = read_lab_file(path)
    assert_truth(table)
    unread = " / ".join(map(str, table.unread))
    assert 'group "Press: Temperature"' in unread
    assert 'group "Press: Serial"' in unread
    assert 'group "Empty"' in unread


@pytest.mark.parametrize(("step", "after"), [(0.1, 0.7), (0.2, 0.0), (0.2, 0.35)])
def test_tdms_force_and_displacement_with_times_of_their_own_are_to_be_put_to_the_same(
    tmp_path: Path, step: float, after: float
) -> None:
    (place, load), path = PRESS, tmp_path / "a.tdms"
    own = {place: {**PRESS[place][1], **_wave(0.1)}, load: {**PRESS[load][1], **_wave(step, after)}}
    path.write_bytes(tdms({"Press": {name: (PRESS[name][0], said) for name, said in own.items()}}))
    said = refusal(path)
    assert "parts of the file that have times of their own" in said
    assert f'"Press: {place}" (displacement, time, {N} rows); group "Press: {load}" (force, time, {N} rows)' in said
    assert "--sheet" not in said


def test_tdms_channels_of_another_length_than_their_times_are_told_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    channels: Channels = {"Time (s)": (TIME, {}), "Load (N)": (FORCE, {}), "Extension (mm)": (DEPTH[:-7], {})}
    path.write_bytes(tdms({"Press": channels}))
    assert f'{len(TIME) - 7} readings, and "Time (s)" has {len(TIME)}: which of them belong together is not told' in refusal(
        path
    )


def test_tdms_groups_that_are_records_are_a_choice(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    one: Channels = {"Time": (TIME, {"unit_string": "s"}), **PRESS}
    two: Channels = {**one, "Load": (2 * FORCE, {"unit_string": "N"})}
    path.write_bytes(tdms({"Ball 1": one, "Ball 2": two}))
    assert "2 groups of the file are records" in refusal(path)
    assert_truth(read_lab_file(path, Reading(sheet="Ball 2")), 2 * FORCE)


def test_tdms_without_units_asks_for_them_and_two_units_are_none(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    path.write_bytes(tdms({"Press": {**PRESS, "Load": (FORCE, {})}}))
    assert '"Load" has no unit' in refusal(path)
    table = read_lab_file(path, Reading(units={"force": "mN"}))
    np.testing.assert_allclose(table.columns["force"], FORCE / 1e3)
    path.write_bytes(tdms({"Press": {**PRESS, "Load": (FORCE, {"unit_string": "V", "NI_UnitDescription": "N"})}}))
    assert 'unknown unit "V or N"' in refusal(path)


def test_tdms_singles_and_whole_numbers_are_read_as_stored(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    channels: Channels = {
        "Time": (np.arange(N, dtype="<i4"), {"unit_string": "s"}),
        "Extension": (DEPTH.astype("<f4"), {"unit_string": "mm"}),
        "Load": (FORCE.astype("<f4"), {"unit_string": "N"}),
    }
    path.write_bytes(tdms({"Press": channels}))
    table = read_lab_file(path)
    np.testing.assert_array_equal(table.columns["time"], np.arange(N))
    np.testing.assert_array_equal(table.columns["force"], FORCE.astype("<f4").astype(float))


def test_tdms_that_was_not_closed_says_that_readings_are_missing(tmp_path: Path) -> None:
    path = tmp_path / "a.tdms"
    data = tdms({"Press": {"Time": (TIME, {"unit_string": "s"}), **PRESS}})
    open_end = data[:12] + b"\xff" * 8 + data[20:]
    path.write_bytes(open_end + data[len(data) - 500 :])
    table = read_lab_file(path)
    assert_truth(table)
    assert any("not closed" in note for note in table.notes)


@pytest.mark.parametrize("size", [4, 20, 60, 200])
def test_a_damaged_tdms_file_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "a.tdms"
    path.write_bytes(tdms({"Press": PRESS})[:size])
    assert refusal(path)


def test_without_nptdms_it_is_said_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.tdms"
    path.write_bytes(tdms({"Press": PRESS}))
    monkeypatch.setitem(sys.modules, "nptdms", None)
    assert 'pip install "dielectric-elastomer-calibration[formats]"' in refusal(path)


# --- MATLAB --------------------------------------------------------------------------------------------------------------

FIELDS = {"time_s": TIME, "extension_mm": DEPTH, "load_N": FORCE}


def mat5(variables: dict[str, np.ndarray], *, packed: bool = False, order: str = "<") -> bytes:
    """Version 5 by hand, from the description of MathWorks: double matrices, whole or compressed, in either byte order."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack(f"{order}II", kind, len(data)) + data + bytes(-len(data) % 8)

    body = b""
    for name, values in variables.items():
        matrix = element(6, struct.pack(f"{order}II", 6, 0))
        matrix += element(5, struct.pack(f"{order}ii", *values.shape)) + element(1, name.encode())
        matrix += element(9, values.astype(f"{order}f8").tobytes(order="F"))
        whole = element(14, matrix)
        if packed:
            data = zlib.compress(whole)
            whole = struct.pack(f"{order}II", 15, len(data)) + data
        body += whole
    return (
        b"MATLAB 5.0 MAT-file, by hand".ljust(116)
        + bytes(8)
        + struct.pack(f"{order}H", 0x0100)
        + (b"IM" if order == "<" else b"MI")
        + body
    )


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("upright", [False, True])
def test_mat_with_columns_as_variables(tmp_path: Path, packed: bool, upright: bool, order: str) -> None:
    path = tmp_path / "a.mat"
    variables = {name: values.reshape(-1, 1) if upright else values.reshape(1, -1) for name, values in FIELDS.items()}
    path.write_bytes(mat5({**variables, "rate": np.array([[10.0]])}, packed=packed, order=order))
    table = read_lab_file(path)
    assert_truth(table)
    assert 'line 1: above the header, beginning "rate 10.0"' in map(str, table.unread)
    assert table.lines[0] == 1


def test_mat_with_a_matrix_is_read_by_the_numbers_of_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(mat5({"data": np.column_stack([TIME, DEPTH, FORCE])}))
    assert "--columns" in refusal(path)
    said = Reading(
        columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    assert_truth(read_lab_file(path, said))
    path.write_bytes(mat5({"data": np.vstack([TIME, DEPTH, FORCE])}))
    table = read_lab_file(path, said)
    assert_truth(table)
    assert "its rows are taken as columns" in table.notes


@pytest.mark.parametrize("beside", [False, True])
def test_mat_units_of_a_struct_are_those_of_the_columns_of_these_names(tmp_path: Path, beside: bool) -> None:
    columns = {"t": TIME, "d": DEPTH, "F": FORCE}
    units = {"t": "s", "d": "mm", "F": "N"}
    path = tmp_path / "a.mat"
    savemat(path, {"data": columns, "units": units} if beside else {"data": {**columns, "units": units}})
    assert_truth(read_lab_file(path))
    savemat(path, {**columns, "Units": {**units, "F": "mN"}})
    np.testing.assert_allclose(read_lab_file(path).columns["force"], FORCE * 1e-3, rtol=1e-12)
    savemat(path, {**columns, "units": {"t": "s", "d": "mm"}})
    assert 'column "F" has no unit' in refusal(path)


@pytest.mark.parametrize("form", ["5", "4"])
def test_mat_as_scipy_writes_it(tmp_path: Path, form: Literal["5", "4"]) -> None:
    path = tmp_path / "a.mat"
    savemat(path, FIELDS, format=form)
    assert_truth(read_lab_file(path))


def test_mat_with_structs_in_structs_and_arrays_of_them(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"test": {"raw": FIELDS, "operator": "lab", "date": "2024-05-02 14:03:20"}})
    table = read_lab_file(path)
    assert_truth(table)
    assert table.encoding == "mat, variable test.raw"
    two = np.empty((1, 2), dtype=object)
    two[0, 0], two[0, 1] = FIELDS, {**FIELDS, "load_N": 2 * FORCE}
    savemat(path, {"press": np.array([tuple(FIELDS.values()), tuple(two[0, 1].values())], dtype=[(k, "O") for k in FIELDS])})
    assert "2 variables of the file are records" in refusal(path)
    assert_truth(read_lab_file(path, Reading(sheet="press(2)")), 2 * FORCE)


def test_mat_with_names_beside_a_matrix(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    names = np.array(HEADER, dtype=object)
    savemat(path, {"press": {"data": np.column_stack([TIME, DEPTH, FORCE]), "colheaders": names}})
    table = read_lab_file(path)
    assert_truth(table)
    assert 'the columns are named by "press.colheaders"' in table.notes


@pytest.mark.parametrize("above", [HEADER, ["a press", "at 20 °C", "by hand"]])
def test_mat_as_importdata_of_matlab_gives_it_is_named_by_the_headers_of_its_columns(tmp_path: Path, above: list[str]) -> None:
    path = tmp_path / "a.mat"
    texts = {name: np.array(words, dtype=object) for name, words in (("textdata", above), ("colheaders", HEADER))}
    savemat(path, {"A": {"data": np.column_stack([TIME, DEPTH, FORCE]), **texts}})
    table = read_lab_file(path)
    assert_truth(table)
    assert 'the columns are named by "A.colheaders"' in table.notes


@pytest.mark.parametrize("nested", [False, True])
def test_mat_with_names_and_units_beside_a_matrix(tmp_path: Path, nested: bool) -> None:
    path = tmp_path / "a.mat"
    names, units = (np.array(words, dtype=object) for words in (["Time", "Extension", "Force"], ["s", "mm", "mN"]))
    members = {"data": np.column_stack([TIME, DEPTH, FORCE * 1e3]), "units": units, "labels": names}
    savemat(path, {"press": members} if nested else members)
    table = read_lab_file(path)
    assert_truth(table)
    assert any("the columns are named by" in note and 'labels"' in note for note in table.notes)


@pytest.mark.parametrize("member", ["name", "label"])
def test_mat_with_a_list_of_structs_of_one_named_column_each(tmp_path: Path, member: str) -> None:
    path = tmp_path / "a.mat"
    columns = [("Time", "s", TIME), ("Extension", "mm", DEPTH), ("Force", "mN", FORCE * 1e3)]
    kinds = [(member, "O"), ("unit", "O"), ("data", "O")]
    channels = np.array(columns, dtype=kinds)
    savemat(path, {"channels": channels, "operator": "A. B."})
    assert_truth(read_lab_file(path))
    whole = [(f"{name} ({unit})", values) for name, unit, values in columns]
    savemat(path, {"rec": {"ch": np.array(whole, dtype=[kinds[0], kinds[2]])}})
    assert_truth(read_lab_file(path))


def test_mat_with_a_list_of_structs_of_which_two_have_one_name_is_not_joined_and_a_factor_is_asked_about(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.mat"
    for columns, message in (
        ([("Time", "s", 1.0, TIME), ("Extension", "mm", 1.0, DEPTH), ("Force", "N", 10.0, FORCE)], '"gain" of "Force"'),
        (
            [("Time", "s", "a", TIME), ("Extension", "mm", "b", DEPTH), ("Time", "N", "c", FORCE)],
            "parts of the file is a record",
        ),
    ):
        kinds = [("name", "O"), ("unit", "O"), ("gain", "O"), ("data", "O")]
        savemat(path, {"channels": np.array(columns, dtype=kinds)})
        assert message in refusal(path)


def test_mat_with_two_lists_of_names_that_differ_is_named_by_none(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    other = np.array([HEADER[0], HEADER[2], HEADER[1]], dtype=object)
    savemat(path, {"data": np.column_stack([TIME, DEPTH, FORCE]), "names": np.array(HEADER, dtype=object), "labels": other})
    assert "no header row" in refusal(path)


@pytest.mark.parametrize(("data", "unit"), [("data", "unit"), ("values", "Units")])
def test_mat_with_a_struct_for_each_column_and_its_unit(tmp_path: Path, data: str, unit: str) -> None:
    path = tmp_path / "a.mat"
    columns = {"time": (TIME, "s"), "extension": (DEPTH, "mm"), "force": (FORCE * 1e3, "mN")}
    structs = {name: {data: values, unit: own, "sensor": "no 3"} for name, (values, own) in columns.items()}
    for variables in (structs, {"test": structs}):
        savemat(path, variables)
        assert_truth(read_lab_file(path))


@pytest.mark.parametrize("more", [{"scale": 2.0}, {"raw": FORCE}])
def test_mat_with_a_factor_or_a_second_column_beside_a_unit_is_not_read_by_it(tmp_path: Path, more: dict[str, object]) -> None:
    path = tmp_path / "a.mat"
    columns = {"time": (TIME, "s"), "extension": (DEPTH, "mm")}
    structs: dict[str, object] = {name: {"data": values, "unit": unit} for name, (values, unit) in columns.items()}
    savemat(path, {**structs, "force": {"data": FORCE, "unit": "N", **more}})
    assert "force" in refusal(path)


def test_mat_names_every_variable_that_it_does_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    more = {
        "spectrum": np.arange(4) * 1j,
        "cube": np.zeros((2, 3, 4)),
        "cells": np.array([1.0, "a", 3.0], dtype=object),
        "sparse": coo_array(np.eye(3)),
        "none": np.zeros((0, 0)),
        "short": np.arange(7.0),
    }
    savemat(path, {**FIELDS, **more})
    table = read_lab_file(path)
    assert_truth(table)
    unread = " / ".join(map(str, table.unread))
    for name, reason in {
        "spectrum": "complex",
        "cube": "3 dimensions",
        "cells": "cell array",
        "sparse": "sparse",
        "none": "empty",
    }.items():
        assert f'variable "{name}": ' in unread
        assert reason in unread
    assert 'beginning "short 0.0 1.0 2.0' in unread


def mat4(variables: dict[str, np.ndarray]) -> bytes:
    """Version 4 by hand, from the description of MathWorks: full matrices of doubles, column by column."""
    return b"".join(
        struct.pack("<5i", 0, *values.shape, 0, len(name) + 1)
        + name.encode()
        + b"\x00"
        + values.astype("<f8").tobytes(order="F")
        for name, values in variables.items()
    )


def test_mat_of_version_4(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(mat4({name: values[:, None] for name, values in FIELDS.items()}))
    assert_truth(read_lab_file(path))


def mat73(path: Path, variables: dict[str, np.ndarray], struct_name: str = "") -> Path:
    """Version 7.3 by PyTables: HDF5 behind 512 bytes, arrays turned and packed as MATLAB does, each with its class."""
    with tables.open_file(str(path), "w", user_block_size=512, pytables_sys_attrs=False) as file:
        group = file.create_group("/", struct_name) if struct_name else file.root
        if struct_name:
            group._v_attrs.MATLAB_class = np.bytes_("struct")
        packed = tables.Filters(complevel=3, complib="zlib", shuffle=False)
        for name, values in variables.items():
            turned = np.ascontiguousarray(values.T if values.ndim == 2 else values.reshape(1, -1))
            file.create_carray(group, name, obj=turned, filters=packed).attrs.MATLAB_class = np.bytes_("double")
        note = file.create_array(group, "note", obj=np.array([[ord(c)] for c in "ball 5 mm"], dtype=np.uint16))
        note.attrs.MATLAB_class = np.bytes_("char")
        note.attrs.MATLAB_int_decode = np.int32(2)
        empty = file.create_array(group, "none", obj=np.array([0, 0], dtype=np.uint64))
        empty.attrs.MATLAB_class = np.bytes_("double")
        empty.attrs.MATLAB_empty = np.uint8(1)
        if not struct_name:
            table = file.create_array(group, "T", obj=np.zeros((1, 6), dtype=np.uint32))
            table.attrs.MATLAB_class = np.bytes_("table")
            table.attrs.MATLAB_object_decode = np.int32(3)
            file.create_external_link(group, "elsewhere", "other.mat:/x")
    data = path.read_bytes()
    head = b"MATLAB 7.3 MAT-file, by hand".ljust(124) + struct.pack("<H", 0x0200) + b"IM"
    path.write_bytes(head + data[len(head) :])
    return path


@pytest.mark.parametrize("struct_name", ["", "press"])
def test_mat_of_version_73(tmp_path: Path, struct_name: str) -> None:
    table = read_lab_file(mat73(tmp_path / "a.mat", FIELDS, struct_name))
    assert_truth(table)
    unread = " / ".join(map(str, table.unread))
    assert "note" in unread or struct_name
    if not struct_name:
        assert 'variable "none": it is empty' in unread
        assert 'variable "T": it is a MATLAB object' in unread
        assert 'variable "elsewhere": it is a link' in unread


def test_mat_of_version_73_that_matlab_wrote() -> None:
    """One array in the user block and HDF5 of MATLAB 7.4, among what scipy (BSD) is tested with: no record of a press."""
    sample = Path(scipy.io.matlab.__file__).parent / "tests" / "data" / "testhdf5_7.4_GLNX86.mat"
    if not sample.exists():
        pytest.skip("this scipy has no tests beside it")
    (own,) = (v for name, v in variables_of_hdf5(sample.read_bytes()).items() if name == "testdouble")
    np.testing.assert_allclose(own, np.linspace(0, 2 * np.pi, 9)[None])
    assert 'variable "columns"' in refusal(sample)


def test_mat_of_version_73_with_a_matrix(tmp_path: Path) -> None:
    path = mat73(tmp_path / "a.mat", {"data": np.column_stack([TIME, DEPTH, FORCE])})
    said = Reading(
        columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    assert_truth(read_lab_file(path, replace(said, sheet="data")))


@pytest.mark.parametrize("size", [4, 130, 600, 1500])
def test_a_damaged_mat_file_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(mat5({"data": np.column_stack([TIME, DEPTH, FORCE])})[:size])
    assert refusal(path)
    data = mat73(tmp_path / "b.mat", FIELDS).read_bytes()
    path.write_bytes(data[:size])
    assert refusal(path)


# --- testXpert's text ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mark", [".", ","])
def test_tra_as_testxpert_exports_it(tmp_path: Path, mark: str) -> None:
    delimiter = ";" if mark == "," else ","
    rows = [["Prüfzeit", "Standardweg", "Standardkraft"], ["s", "mm", "N"], *(_row(*row, mark=mark) for row in ROWS)]
    lines = ['"Probe 1"', "", *(delimiter.join(f'"{c}"' if r < 2 else c for c in row) for r, row in enumerate(rows))]
    table = read_lab_file(written(tmp_path / "PROBE1.TRA", "\r\n".join(lines) + "\r\n", "latin-1"))
    assert_truth(table)
    assert table.recognised_as == "ZwickRoell testXpert"


# --- workbooks in an experiment -------------------------------------------------------------------------------------------


def test_force_and_capacitance_may_stand_in_two_sheets_of_one_workbook(tmp_path: Path) -> None:
    log = [("Time (s)", "Cp (pF)"), *LOG]
    path = new_workbook(tmp_path / "press.xlsx", {"Press": [HEADER, *ROWS], "LCR": log})
    for capacitance in (Reading(sheet="LCR"), Reading(sheet="lcr")):
        sweep = make_sweep("s", "a", 5e-3, path, path, force_reading=Reading(sheet="Press"), capacitance_reading=capacitance)
        assert set(sweep.channels) == {"force", "capacitance"}
    with pytest.raises(InputError, match="2 sheets of the file are records"):
        make_sweep("s", "a", 5e-3, path, path, force_reading=Reading(sheet="Press"))


def test_calib_read_takes_a_sheet_and_says_which_there_are(tmp_path: Path) -> None:
    other = [(t, x, 2 * f) for t, x, f in ROWS]
    path = new_workbook(tmp_path / "press.xlsx", {"Ball 1": [HEADER, *ROWS], "Ball 2": [HEADER, *other]})

    def read(*words: str) -> Result:
        return CliRunner().invoke(app, ["read", str(path), *words])

    refused = read()
    assert refused.exit_code == 2
    assert '--sheet "Ball 1" or --sheet "Ball 2"' in " ".join(refused.output.split())
    shown = read("--sheet", "Ball 2", "-o", str(tmp_path / "rows.csv"))
    assert shown.exit_code == 0, shown.output
    assert "sheet Ball 2" in shown.output
    np.testing.assert_allclose(pd.read_csv(tmp_path / "rows.csv")["force_N"], 2 * FORCE)


def test_an_experiment_file_names_two_sheets_of_one_workbook(tmp_path: Path) -> None:
    new_workbook(tmp_path / "press.xlsx", {"Press": [HEADER, *ROWS], "LCR": [("Time (s)", "Cp (pF)"), *LOG]})
    (tmp_path / "experiment.toml").write_text(
        """
        [indenter]
        radius = "5 mm"
        [sensor]
        radius = "10 mm"
        [padding]
        material = "sensor"
        [priors]
        young_modulus = { lognormal = ["0.8 MPa", 1.8] }
        relative_permittivity = { normal = [2.8, 0.2] }
        [[specimens]]
        name = "s1"
        force = { file = "press.xlsx", sheet = "Press" }
        capacitance = { file = "press.xlsx", sheet = "LCR" }
        [specimens.priors]
        sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
        padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
        """
    )
    (sweep,) = read_sweeps(read_experiment(tmp_path / "experiment.toml"))
    assert set(sweep.channels) == {"force", "capacitance"}
