"""Lines that say that a column is not what its header says are asked about; ordinary remarks stop no file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import openpyxl
import pytest
from turning_press import DIGITS, HEADS, turning_press

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

PRESS = {q: v for q, v in turning_press(halves=60).columns.items() if q != "capacitance"}
NAMES = {"force": "Force (N)", "displacement": "Displacement (mm)"}
BAD = {
    "Lever 5:1, force at the long arm": ("force",),
    "Columns 2 and 3 swapped by mistake": ("force", "displacement"),
    "Kraft und Weg vertauscht": ("force", "displacement"),
    "Header falsch: Spalte 3 ist eigentlich Weg": (),
    "force column is really the setpoint": ("force",),
    "Units in the header are wrong": ("force", "displacement"),
    "colonnes force et déplacement inversées": ("force", "displacement"),
    "La unidad de la fuerza es incorrecta, columna equivocada": ("force",),
    "displacement channel is actually the setpoint": ("displacement",),
}
GOOD = (
    "sample 3, wrong label",
    "no force control",
    "wrong gripper mounted first, replaced",
    "force control instead of displacement control",
    "should be repeated with larger force",
    "Specimen is really soft",
    "swapped ball for 10 mm one",
    "Column of the frame was cleaned",
    "header was wrong in the first export, corrected",
    "Kanal 1: Kraft, Kanal 2: Weg",
    "order of columns: time, displacement, force",
    "columns plotted: force, displacement",
    "channels used: force, displacement, time",
)


def _write(folder: Path, words: str, where: str) -> Path:
    cells = [[f"{x:.{DIGITS[q]}f}" for x in v] for q, v in PRESS.items()]
    if where == "sheet":
        book = openpyxl.Workbook()
        data = book.active
        data.append([HEADS[q] for q in PRESS])
        for row in zip(*cells, strict=True):
            data.append(list(map(float, row)))
        book.create_sheet("Notes").append([words])
        book.save(folder / "press.xlsx")
        return folder / "press.xlsx"
    lines = [",".join(HEADS[q] for q in PRESS), *(",".join(row) for row in zip(*cells, strict=True))]
    lines = [f"# {words}", *lines] if where == "above" else [*lines, f"# {words}"]
    (folder / "press.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "press.csv"


@pytest.mark.parametrize("where", ["above", "below", "sheet"])
@pytest.mark.parametrize("words", BAD)
def test_a_line_that_disowns_a_column_is_asked_about_and_settled_by_what_is_typed(
    tmp_path: Path, words: str, where: str
) -> None:
    path = _write(tmp_path, words, where)
    with pytest.raises(InputError, match="not what the header says") as caught:
        read_lab_file(path)
    of = [q for q in NAMES if f"{q}={NAMES[q]}" in str(caught.value)]
    assert not BAD[words] or of == list(BAD[words])
    table = read_lab_file(path, Reading(columns={q: NAMES[q] for q in of}))
    np.testing.assert_allclose(table.columns["force"], np.round(PRESS["force"], 4))
    numbers = {"force": "3", "displacement": "2"}
    units = {"force": "N", "displacement": "mm"}
    again = read_lab_file(path, Reading(columns={q: numbers[q] for q in of}, units={q: units[q] for q in of}))
    np.testing.assert_allclose(again.columns["force"], table.columns["force"])


@pytest.mark.parametrize("where", ["above", "below", "sheet"])
@pytest.mark.parametrize("words", GOOD)
def test_an_ordinary_remark_stops_no_file(tmp_path: Path, words: str, where: str) -> None:
    table = read_lab_file(_write(tmp_path, words, where))
    np.testing.assert_allclose(table.columns["force"], np.round(PRESS["force"], 4))


def test_a_unit_that_another_sheet_says_is_asked_about(tmp_path: Path) -> None:
    path = _write(tmp_path, "Force channel was in mN, header is wrong!", "sheet")
    with pytest.raises(InputError, match="not what the header says"):
        read_lab_file(path)
    table = read_lab_file(path, Reading(units={"force": "mN"}))
    np.testing.assert_allclose(table.columns["force"], np.round(PRESS["force"], 4) * 1e-3)


@pytest.mark.parametrize(
    "words",
    [
        "columns from left: time, force, displacement",
        "Reihenfolge der Spalten: Zeit, Kraft, Weg",
        "order of columns: 1 = time, 2 = force, 3 = displacement",
    ],
)
def test_a_list_of_all_columns_in_another_order_is_asked_about(tmp_path: Path, words: str) -> None:
    path = _write(tmp_path, words, "above")
    with pytest.raises(InputError, match="not what the header says"):
        read_lab_file(path)
    table = read_lab_file(path, Reading(columns=NAMES))
    assert np.allclose(table.columns["force"], PRESS["force"], atol=1e-4)
    other = read_lab_file(
        path, Reading(columns={"force": "2", "displacement": "3"}, units={"force": "N", "displacement": "mm"})
    )
    assert np.allclose(other.columns["force"], PRESS["displacement"], atol=1e-4)
