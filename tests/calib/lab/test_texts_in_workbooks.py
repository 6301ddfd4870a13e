"""Cells of text in workbooks and JSON are read as the same cells of a CSV file are."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from turning_press import DIGITS, HEADS, turning_press

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

PRESS = {q: np.round(v, DIGITS[q]) for q, v in turning_press(halves=60).columns.items()}
WAYS: dict[str, Callable[[float], str]] = {
    "unit": lambda x: f"{x:.4f} N",
    "smaller unit": lambda x: f"{1e3 * x:.1f} mN",
    "unit behind commas": lambda x: f"{x:.4f} N".replace(".", ","),
    "Fortran": lambda x: f"{x:.5E}".replace("E", "D"),
    "power of ten": lambda x: f"{1e3 * x:.1f}×10^-3",
    "apostrophe": lambda x: f"'{x:.4f}",
    "minus behind": lambda x: f"{abs(x):.4f}-" if x < 0 else f"{x:.4f}",
}


def _workbook(path: Path, way: Callable[[float], str | float]) -> Path:
    book = openpyxl.Workbook()
    book.active.append([HEADS[q] for q in PRESS])
    for row in zip(*(v.tolist() for v in PRESS.values()), strict=True):
        book.active.append([way(x) if q == "force" else x for q, x in zip(PRESS, row, strict=True)])
    book.save(path)
    return path


def _document(path: Path, way: Callable[[float], str | float]) -> Path:
    columns = {HEADS[q]: [way(x) if q == "force" else x for x in v.tolist()] for q, v in PRESS.items()}
    path.write_text(json.dumps(columns), encoding="utf-8")
    return path


@pytest.mark.parametrize("way", WAYS)
def test_a_workbook_reads_text_cells_as_a_text_file_does(tmp_path: Path, way: str) -> None:
    table = read_lab_file(_workbook(tmp_path / "a.xlsx", WAYS[way]))
    np.testing.assert_allclose(table.columns["force"], PRESS["force"], atol=1e-9)
    assert table.notes


@pytest.mark.parametrize("way", ["unit", "smaller unit", "unit behind commas", "Fortran", "power of ten"])
def test_a_document_reads_text_cells_as_a_text_file_does(tmp_path: Path, way: str) -> None:
    table = read_lab_file(_document(tmp_path / "a.json", WAYS[way]))
    np.testing.assert_allclose(table.columns["force"], PRESS["force"], atol=1e-9)


def test_keys_without_units_have_those_of_their_cells(tmp_path: Path) -> None:
    units = {"time": "s", "displacement": "mm", "force": "N", "capacitance": "pF"}
    names = {"time": "Time", "displacement": "Displacement", "force": "Force", "capacitance": "Cp"}
    rows = [
        {names[q]: f"{x} {units[q]}" for q, x in zip(PRESS, row, strict=True)}
        for row in zip(*(v.tolist() for v in PRESS.values()), strict=True)
    ]
    (tmp_path / "a.json").write_text(json.dumps(rows), encoding="utf-8")
    table = read_lab_file(tmp_path / "a.json")
    np.testing.assert_allclose(table.columns["force"], PRESS["force"])


def test_three_decimals_behind_a_comma_are_asked_for_and_read(tmp_path: Path) -> None:
    path = _workbook(tmp_path / "a.xlsx", lambda x: f"{x + 2:.3f} N".replace(".", ","))
    with pytest.raises(InputError, match='--decimal ","'):
        read_lab_file(path)
    for mark, factor in ((",", 1.0), (".", 1e3)):
        force = read_lab_file(path, Reading(decimal=mark)).columns["force"]
        np.testing.assert_allclose(force, [factor * float(f"{x + 2:.3f}") for x in PRESS["force"].tolist()])


def test_a_single_odd_cell_of_a_workbook_is_refused(tmp_path: Path) -> None:
    largest = max(PRESS["force"].tolist())
    path = _workbook(tmp_path / "a.xlsx", lambda x: f"{x:.4f} N" if x == largest else x)
    with pytest.raises(InputError, match="not a number"):
        read_lab_file(path)
