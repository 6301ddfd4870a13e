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
    "Columns 2 and 3 swapped by mistake": ("force", "displacement"),
    "Kraft und Weg vertauscht": ("force", "displacement"),
    "Header falsch: Spalte 3 ist eigentlich Weg": (),
    "force column is really the setpoint": ("force",),
    "Units in the header are wrong": ("force", "displacement"),
    "colonnes force et déplacement inversées": ("force", "displacement"),
    "La unidad de la fuerza es incorrecta, columna equivocada": ("force",),
    "displacement channel is actually the setpoint": ("displacement",),
    "ATTENTION: col 2 = force, col 3 = displacement": ("force", "displacement"),
    "Spalte 2 = Kraft": ("force", "displacement"),
    "sign of force inverted": ("force",),
    "Vorzeichen der Kraft umgekehrt": ("force",),
    "signe de la force inversé": ("force",),
    "fuerza multiplicada por -1": ("force",),
    "Force is per cell": ("force",),
    "Force values are peak hold": ("force",),
    "Load is the peak value of each interval": ("force",),
    "Force is the setpoint": ("force",),
    "Displacement from setpoint": ("displacement",),
    "Force not measured, calculated from model": ("force",),
    "Kraft ist berechnet": ("force",),
    "Kraft pro Sensor": ("force",),
}
OF_NUMBERS = ("ATTENTION: col 2 = force, col 3 = displacement", "Spalte 2 = Kraft")
GOOD = (
    "sample 3, wrong label",
    "no force control",
    "stiffness is calculated from force and displacement",
    "peak force is 5 N",
    "force was measured, temperature not measured",
    "work of the force over the displacement is calculated",
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
    "col 0: time, col 1: displacement, col 2: force",
    "col 1 = time, col 2 = displacement",
    "col 5: force of the second cell",
    "sign convention: compression positive",
    "displacement reversed at the top",
    "Force zeroed before test",
    "load cell two, 50 N",
    "speed 2 mm/min",
    "force range doubled",
    "Force doubled during the hold to check creep",
    "half bridge load cell, force checked twice",
    "press repeated two times to the same force",
    "displacement resolution in 1/1000 mm",
    "number of force cycles is 3x",
    "Sample is half the thickness, force up to 5 N",
    "Amplifier 10:1 for the microphone, load cell 50 N",
    "error due to load, rounded to 1/10 mm",
)
FACTORS = {
    "Values of force are doubled": "force",
    "Kraftwerte halbiert": "force",
    "force doublée par erreur": "force",
    "fuerza duplicada por error": "force",
    "load reads twice the true value": "force",
    "Force must be divided by two": "force",
    "La force est divisée par deux": "force",
    "La fuerza debe dividirse por dos": "force",
    "Kraft durch zehn teilen": "force",
    "Force too high by 9.81": "force",
    "Kraft zu hoch um Faktor 9,81": "force",
    "force trop élevée d'un facteur 10": "force",
    "Attenuator 10:1 on load": "force",
    "Spannungsteiler Kraft 10:1": "force",
    "true force = 2x": "force",
    "time in 1/10 s": "time",
    "Zeit in Zehntelsekunden": "time",
    "temps en dixièmes de seconde": "time",
    "tiempo en décimas de segundo": "time",
    "displacement in hundredths of mm": "displacement",
}


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


# A sheet of notes may count the columns of another sheet.
PLACES = [
    (words, where) for words in BAD for where in ("above", "below", "sheet") if where != "sheet" or words not in OF_NUMBERS
]


@pytest.mark.parametrize(("words", "where"), PLACES)
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
    with pytest.raises(InputError, match=r'sheet "Notes": .* says that the unit of column "Force \(N\)" is mN'):
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


@pytest.mark.parametrize("where", ["above", "below"])
@pytest.mark.parametrize("words", FACTORS)
def test_a_factor_in_words_is_asked_about_and_settled_by_a_unit(tmp_path: Path, words: str, where: str) -> None:
    path, quantity = _write(tmp_path, words, where), FACTORS[words]
    with pytest.raises(InputError, match="states a factor") as caught:
        read_lab_file(path)
    assert f"--units {quantity}=" in str(caught.value)
    unit = {"force": "N", "time": "s", "displacement": "mm"}[quantity]
    tenfold = read_lab_file(path, Reading(units={quantity: f"10 {unit}"})).columns[quantity]
    np.testing.assert_allclose(tenfold, 10 * read_lab_file(path, Reading(units={quantity: unit})).columns[quantity])


@pytest.mark.parametrize(("row", "quantity"), [(",,x10", "force"), (",/2,", "displacement"), ("x1,x1,10x", "force")])
def test_a_row_of_factors_with_their_sign_over_the_names_is_asked_about(tmp_path: Path, row: str, quantity: str) -> None:
    path = _write(tmp_path, "", "above")
    names = path.read_text(encoding="utf-8").splitlines()[1:]
    path.write_text("\n".join([row, *names]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="states a factor") as caught:
        read_lab_file(path)
    assert f"--units {quantity}=" in str(caught.value)
    table = read_lab_file(path, Reading(units={quantity: {"force": "N", "displacement": "mm"}[quantity]}))
    np.testing.assert_allclose(table.columns["force"], np.round(PRESS["force"], 4))


def test_columns_that_are_said_to_be_swapped_by_their_names_as_written_are_asked_about(tmp_path: Path) -> None:
    names = {"time": "t_s", "displacement": "x_mm", "force": "F_N"}
    rows = [
        ",".join(f"{value:.{DIGITS[q]}f}" for q, value in zip(PRESS, row, strict=True))
        for row in zip(*PRESS.values(), strict=True)
    ]
    path = tmp_path / "press.csv"
    path.write_text("\n".join(["x_mm and F_N swapped", ",".join(names[q] for q in PRESS), *rows]) + "\n")
    with pytest.raises(InputError, match=r'"F_N" and "x_mm" are not what the header says'):
        read_lab_file(path)
    asked = Reading(columns={"force": "F_N", "displacement": "x_mm"})
    np.testing.assert_allclose(read_lab_file(path, asked).columns["force"], PRESS["force"], atol=1e-3)


@pytest.mark.parametrize("line", ["Force and capacitance swapped", "F and C swapped", "capacitance is calculated"])
def test_what_is_said_of_a_series_capacitance_is_asked_about(tmp_path: Path, line: str) -> None:
    press = turning_press(halves=60).columns
    heads = [HEADS[q].replace("Cp", "Cs") for q in press]
    rows = [
        ",".join([*(f"{v:.{DIGITS[q]}f}" for q, v in zip(press, row, strict=True)), "0.01"])
        for row in zip(*press.values(), strict=True)
    ]
    path = tmp_path / "press.csv"
    path.write_text("\n".join([line, ",".join([*heads, "D"]), *rows]) + "\n")
    with pytest.raises(InputError, match="not what the header says") as refused:
        read_lab_file(path)
    series = next(head for head in heads if "Cs" in head)
    assert f'--columns "capacitance_series={series}"' in str(refused.value)
    asked = {"capacitance_series": series, **({"force": HEADS["force"]} if "swapped" in line else {})}
    assert read_lab_file(path, Reading(columns=asked)).lines.size == len(rows)
