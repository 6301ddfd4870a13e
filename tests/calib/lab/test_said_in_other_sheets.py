"""What a sheet of settings or notes says acts on the record beside it as the same words in lines above the table do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from turning_press import DIGITS, HEADS, turning_press

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

PRESS = turning_press(halves=60).columns
TRUE = {q: np.round(PRESS[q], DIGITS[q]) for q in PRESS}
NAMES = [HEADS[q] for q in PRESS]
CAP = HEADS["capacitance"]


def _write(
    folder: Path,
    said: list[list[Any]],
    *,
    names: list[str] | None = None,
    loss: float | None = None,
    first: bool = False,
    records: int = 1,
) -> Path:
    """A workbook with the press in a sheet "Data", or in several, and what is said in a sheet "Setup"."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for k in range(records):
        sheet = book.create_sheet("Data" if records == 1 else f"Data {k + 1}")
        sheet.append([*(names or NAMES), *(["D"] if loss is not None else [])])
        for row in zip(*TRUE.values(), strict=True):
            sheet.append([*map(float, row), *([loss] if loss is not None else [])])
    setup = book.create_sheet("Setup", 0 if first else None)
    for line in said:
        setup.append(line)
    book.save(folder / "press.xlsx")
    return folder / "press.xlsx"


def _plain() -> list[str]:
    return ["C (pF)" if name == CAP else name for name in NAMES]


def _told(table: LabTable) -> str:
    return " | ".join((*table.notes, *map(str, table.unread)))


USUAL: list[list[Any]] = [["Operator", "kim"], ["Speed", "0.05 mm/s"], ["Level", "1 V"]]


@pytest.mark.parametrize(
    "row",
    [
        ["LCR mode", "Cs-D"],
        ["Mode", "Series"],
        ["Equivalent circuit", "Cs"],
        ["LCR: series mode"],
        ["Ersatzschaltung", "Reihe"],
    ],
)
@pytest.mark.parametrize("first", [True, False])
def test_a_circuit_in_a_sheet_of_settings_is_that_of_the_capacitance(tmp_path: Path, row: list[Any], first: bool) -> None:
    table = read_lab_file(_write(tmp_path, [*USUAL, row], names=_plain(), loss=0.2, first=first))
    np.testing.assert_allclose(table.columns["capacitance"], TRUE["capacitance"] * 1e-12 / 1.04, rtol=1e-9)
    assert 'stands in sheet "Setup"' in _told(table)
    path = _write(tmp_path, [*USUAL, row], names=_plain(), first=first)
    with pytest.raises(InputError, match=r'is a series capacitance.*sheet "Setup"'):
        read_lab_file(path)
    right = read_lab_file(path, Reading(columns={"capacitance": "C (pF)"}))
    np.testing.assert_allclose(right.columns["capacitance"], TRUE["capacitance"] * 1e-12, rtol=1e-9)


@pytest.mark.parametrize(
    "row",
    [
        ["Gain force", 10],
        ["Force factor", 9.81],
        ["Scale", "0.1 (force)"],
        ["Force x10 not applied"],
        ["Note", "gain 10 on force"],
    ],
)
def test_a_factor_in_a_sheet_is_asked_about_and_settled_by_the_unit(tmp_path: Path, row: list[Any]) -> None:
    path = _write(tmp_path, [row, *USUAL])
    with pytest.raises(InputError, match=r'sheet "Setup": .* states a factor') as refused:
        read_lab_file(path)
    assert refused.value.faults[0].line is None
    right = read_lab_file(path, Reading(units={"force": "N"})).columns["force"]
    np.testing.assert_allclose(right, TRUE["force"], atol=1e-9)
    read_lab_file(path, Reading(units={"force": "10 N"}))


@pytest.mark.parametrize(
    "row",
    [
        ["Force unit", "mN"],
        ["NB: force column is in mN, not N"],
        ["Kraft in mN, nicht N"],
        ["Remark", "force is in mN"],
        ["力单位mN"],
    ],
)
@pytest.mark.parametrize("sheet", ["", "Data"])
def test_a_unit_in_a_sheet_that_contradicts_is_refused_and_settled(tmp_path: Path, row: list[Any], sheet: str) -> None:
    path = _write(tmp_path, [*USUAL, row])
    with pytest.raises(InputError, match=r'sheet "Setup"'):
        read_lab_file(path, Reading(sheet=sheet))
    for unit, share in (("N", 1.0), ("mN", 1e-3)):
        values = read_lab_file(path, Reading(units={"force": unit}, sheet=sheet)).columns["force"]
        np.testing.assert_allclose(values, share * TRUE["force"], atol=1e-9)


def test_a_unit_in_a_sheet_is_that_of_a_column_without_one(tmp_path: Path) -> None:
    names = ["Force" if name == HEADS["force"] else name for name in NAMES]
    table = read_lab_file(_write(tmp_path, [["Force unit", "mN"]], names=names))
    np.testing.assert_allclose(table.columns["force"], 1e-3 * TRUE["force"], atol=1e-9)


def test_a_sheet_of_settings_acts_on_the_record_that_is_asked_for_and_no_other_record_does(tmp_path: Path) -> None:
    path = _write(tmp_path, [["Gain force", 10]], records=2)
    with pytest.raises(InputError, match="are records"):
        read_lab_file(path)
    with pytest.raises(InputError, match=r'sheet "Setup": .* states a factor'):
        read_lab_file(path, Reading(sheet="Data 2"))
    read_lab_file(path, Reading(sheet="Data 2", units={"force": "N"}))


@pytest.mark.parametrize(
    "said",
    [
        [],
        USUAL,
        [["Max force (mN)", "Max depth (um)"], [5200, 800]],
        [["Max force (mN)", 5200], ["Preload (mN)", 50], ["Range", "500 N"], ["Gain", 1]],
        [["LCR mode", "Cp-D"], ["Frequency", "1 kHz"], ["Ball (mm)", 10]],
        [["Sample", "silicone 10:1"], ["Thickness", "1 mm"], ["Averages", 10]],
        [["Specimen", "Fmax [mN]", "Depth [um]"], ["S1", 5200, 800], ["S2", 5100, 790]],
    ],
)
def test_settings_and_results_of_other_reasons_change_nothing_and_are_told(tmp_path: Path, said: list[list[Any]]) -> None:
    table = read_lab_file(_write(tmp_path, said))
    np.testing.assert_allclose(table.columns["force"], TRUE["force"], atol=1e-9)
    assert 'sheet "Setup"' in _told(table)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(
    ("row", "quantity", "wrong", "right"),
    [
        (["Max load", f"{TRUE['force'].max():.3f} N"], "force", "mN", "N"),
        (["Maximum displacement (mm)", float(TRUE["displacement"].max())], "displacement", "um", "mm"),
        (["Sampling rate", f"{1 / (TRUE['time'][1] - TRUE['time'][0]):.6g} Hz"], "time", "min", "s"),
        (["Test duration", f"{np.ptp(TRUE['time']):.6g} s"], "time", "ms", "s"),
    ],
)
def test_what_a_sheet_tells_of_the_readings_is_held_against_them(
    tmp_path: Path, row: list[Any], quantity: str, wrong: str, right: str, first: bool
) -> None:
    names = [HEADS[q].replace(f"({right})", f"({wrong})") if q == quantity else HEADS[q] for q in PRESS]
    path = _write(tmp_path, [["Operator", "kim"], row], names=names, first=first)
    with pytest.raises(InputError, match=rf'stands in sheet "Setup".*--units {quantity}={right}\b'):
        read_lab_file(path)
    asked = read_lab_file(path, Reading(units={quantity: right}))
    plain = read_lab_file(_write(tmp_path, [["Operator", "kim"], row], first=first))
    np.testing.assert_allclose(asked.columns[quantity], plain.columns[quantity], rtol=1e-9)
    assert not any("another unit" in note for note in plain.notes)


def test_a_sheet_that_says_what_was_taken_off_the_capacitance_is_told(tmp_path: Path) -> None:
    table = read_lab_file(_write(tmp_path, [["Open correction", "offset 2.5 pF subtracted"]]))
    assert any('sheet "Setup"' in note and "as it is written" in note for note in table.notes)


@pytest.mark.parametrize(
    ("table", "factor"),
    [
        ([["Channel", "Factor"], ["Force", 10]], True),
        ([["Channel", "Unit", "Factor"], ["Force", "N", 10], ["Displacement", "mm", 1]], True),
        ([["Factor", "Force", "Displacement"], [None, 10, 1]], True),
        ([["Channel", "Force", "Displacement"], ["Gain", 10, 1]], True),
        ([["Channel", "Factor"], ["Force", 1], ["Displacement", 1]], False),
        ([["Specimen", "Max force (N)", "Depth (mm)"], ["S1", 5.2, 0.8]], False),
    ],
)
def test_a_factor_in_a_table_of_settings_is_asked_about(tmp_path: Path, table: list[list[Any]], factor: bool) -> None:
    path = _write(tmp_path, table)
    if factor:
        with pytest.raises(InputError, match=r'sheet "Setup": ".*: 10" states a factor.*--units force='):
            read_lab_file(path)
    else:
        np.testing.assert_allclose(read_lab_file(path).columns["force"], TRUE["force"], atol=1e-9)
    asked = read_lab_file(path, Reading(units={"force": "N"}))
    np.testing.assert_allclose(asked.columns["force"], TRUE["force"], atol=1e-9)
