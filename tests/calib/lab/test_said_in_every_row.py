"""What a column says in all its rows acts as the same words in a line above the table do, and no more than these."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from turning_press import DIGITS, HEADS, turning_press

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

PRESS = turning_press(halves=60).columns
N_ROW = len(PRESS["time"])
CELLS = [[f"{x:.{DIGITS[q]}f}" for x in v] for q, v in PRESS.items()]
NAMES = [HEADS[q] for q in PRESS]
TRUE = {q: np.round(PRESS[q], DIGITS[q]) for q in PRESS}
FORCE, PLACE, CAP = (HEADS[q] for q in ("force", "displacement", "capacitance"))


def _write(folder: Path, name: str, cells: str | list[str], names: list[str] | None = None, loss: str = "") -> Path:
    """The press with one more column, and a dissipation if it is given."""
    more = [[cells] * N_ROW if isinstance(cells, str) else cells, *([[loss] * N_ROW] if loss else [])]
    head = [*(names or NAMES), name, *(["D"] if loss else [])]
    lines = [",".join(head), *(",".join(row) for row in zip(*CELLS, *more, strict=True))]
    (folder / "press.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "press.csv"


def _plain(names: list[str]) -> list[str]:
    return ["C (pF)" if name == CAP else name for name in names]


def _told(table: LabTable) -> str:
    return " | ".join((*table.notes, *map(str, table.unread)))


SERIES = [
    ("Mode", "Cs-D"),
    ("Function", "CSD"),
    ("FUNC", "CSRS"),
    ("LCR_mode", "Cs"),
    ("Circuit", "series"),
    ("Equivalent circuit", "Serial"),
    ("模式", "串联"),
    ("Type", "SER"),
    ("Bemerkung", "Serienschaltung"),
    ("Remark", "Cs"),
    ("", "Cs-D"),
]


@pytest.mark.parametrize(("name", "cell"), SERIES)
def test_a_circuit_in_every_row_is_that_of_the_capacitance(tmp_path: Path, name: str, cell: str) -> None:
    table = read_lab_file(_write(tmp_path, name, cell, _plain(NAMES), loss="0.2"))
    np.testing.assert_allclose(table.columns["capacitance"], TRUE["capacitance"] * 1e-12 / 1.04, rtol=1e-9)
    assert cell in _told(table)


@pytest.mark.parametrize(("name", "cell"), SERIES[:3])
def test_a_series_capacitance_without_a_loss_is_refused_and_taken_as_it_is_said(tmp_path: Path, name: str, cell: str) -> None:
    path = _write(tmp_path, name, cell, _plain(NAMES))
    with pytest.raises(InputError, match="is a series capacitance") as refused:
        read_lab_file(path)
    assert '--columns "capacitance=C (pF)"' in refused.value.faults[0].advice
    right = read_lab_file(path, Reading(columns={"capacitance": "C (pF)"}))
    np.testing.assert_allclose(right.columns["capacitance"], TRUE["capacitance"] * 1e-12, rtol=1e-9)


def test_a_circuit_against_the_name_is_asked_about(tmp_path: Path) -> None:
    path = _write(tmp_path, "Mode", "Cs-D", ["Cp (pF)" if name == CAP else name for name in NAMES], loss="0.2")
    with pytest.raises(InputError, match="series or a parallel"):
        read_lab_file(path)
    for quantity, share in (("capacitance_series", 1.04), ("capacitance", 1.0)):
        values = read_lab_file(path, Reading(columns={quantity: "Cp (pF)"})).columns["capacitance"]
        np.testing.assert_allclose(values, TRUE["capacitance"] * 1e-12 / share, rtol=1e-9)


def test_a_circuit_in_the_rows_that_are_chosen_is_theirs(tmp_path: Path) -> None:
    cells = ["Cs-D" if r >= N_ROW // 2 else "Cp-D" for r in range(N_ROW)]
    path = _write(tmp_path, "Mode", cells, _plain(NAMES), loss="0.2")
    table = read_lab_file(path, Reading(where={"Mode": "Cs-D"}))
    expected = TRUE["capacitance"][N_ROW // 2 :] * 1e-12 / 1.04
    np.testing.assert_allclose(table.columns["capacitance"], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("Force gain", "10"),
        ("Load range", "x10"),
        ("Comment", "Kraft x10"),
        ("Note", "gain 10 on force"),
        ("Hinweis", "Verstärkung 10 für Kraft"),
        ("Lastfaktor Kraft", "0.1"),
    ],
)
def test_a_factor_in_every_row_is_asked_about_and_settled_by_the_unit(tmp_path: Path, name: str, cell: str) -> None:
    path = _write(tmp_path, name, cell)
    with pytest.raises(InputError, match=r"may state a factor|states a factor"):
        read_lab_file(path)
    right = read_lab_file(path, Reading(units={"force": "N"})).columns["force"]
    np.testing.assert_allclose(right, TRUE["force"], atol=1e-9)
    larger = read_lab_file(path, Reading(units={"force": "10 N"})).columns["force"]
    np.testing.assert_allclose(larger, 10 * right)


@pytest.mark.parametrize("name", ["Gain", "Scale factor", "Multiplier", "Faktor", "Attenuation", "Amp gain", "Amp_gain"])
def test_a_factor_of_nothing_in_particular_may_be_of_the_force_or_the_capacitance(tmp_path: Path, name: str) -> None:
    path = _write(tmp_path, name, "10")
    with pytest.raises(InputError) as refused:
        read_lab_file(path)
    assert len(refused.value.faults) == 2
    read_lab_file(path, Reading(units={"force": "N", "capacitance": "pF"}))


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("Remark", "force in mN"),
        ("", "force in mN"),
        ("Comment", "values are mN"),
        ("Hinweis", "Kraft in mN"),
        ("备注", "力单位mN"),
        ("F_unit", "mN"),
        ("F unit", "mN"),
        ("Units", "s/mm/mN/pF"),
    ],
)
def test_a_unit_in_every_row_that_contradicts_is_refused_and_settled(tmp_path: Path, name: str, cell: str) -> None:
    path = _write(tmp_path, name, cell)
    with pytest.raises(InputError, match="mN"):
        read_lab_file(path)
    for unit, share in (("N", 1.0), ("mN", 1e-3)):
        values = read_lab_file(path, Reading(units={"force": unit})).columns["force"]
        np.testing.assert_allclose(values, share * TRUE["force"], atol=1e-9)


def test_a_unit_in_every_row_is_that_of_a_column_without_one(tmp_path: Path) -> None:
    names = ["Force" if name == FORCE else name for name in NAMES]
    table = read_lab_file(_write(tmp_path, "Remark", "force in mN", names))
    np.testing.assert_allclose(table.columns["force"], 1e-3 * TRUE["force"], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "cell"),
    [("Comment", "columns swapped"), ("Note", "F and z swapped"), ("Note", "units are wrong")],
)
@pytest.mark.parametrize("all_rows", [True, False])
def test_columns_that_are_disowned_in_a_column_are_refused(tmp_path: Path, name: str, cell: str, all_rows: bool) -> None:
    in_rows = all_rows or "units" in cell  # a single one of these is a remark on the scale
    path = _write(tmp_path, name, cell if in_rows else ["", "", cell, *[""] * (N_ROW - 3)])
    with pytest.raises(InputError, match="not what the header says"):
        read_lab_file(path)
    columns = {"force": FORCE, "displacement": PLACE, "capacitance": CAP}
    np.testing.assert_allclose(read_lab_file(path, Reading(columns=columns)).columns["force"], TRUE["force"], atol=1e-9)


def test_what_the_first_row_alone_says_acts_and_another_row_is_quoted(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a series capacitance"):
        read_lab_file(_write(tmp_path, "Mode", ["Cs-D", *[""] * (N_ROW - 1)], _plain(NAMES)))
    table = read_lab_file(_write(tmp_path, "Mode", ["", "", "Cs-D", *[""] * (N_ROW - 3)], _plain(NAMES)))
    assert '"Cs-D" (line 4)' in _told(table)


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("Operator", "kim"),
        ("Specimen", "S1"),
        ("Series", "3"),
        ("Measurement", "Series 3"),
        ("Test mode", "Serie 2"),
        ("Frequency", "1000"),
        ("Level", "1 V"),
        ("Gain", "1"),
        ("Gain", "1.0"),
        ("Gauge factor", "2.1"),
        ("Averages", "10"),
        ("Load cell", "500 N"),
        ("LCR range", "1 nF"),
        ("Ball (mm)", "10"),
        ("Speed unit", "mm/min"),
        ("Instrument", "E4980A"),
        ("Firmware", "v2.10"),
        ("Mode", "compression"),
        ("Mode", "Cp-D"),
        ("Comparator", "OFF"),
        ("Material", "silicone 10:1"),
        ("Mixing ratio", "10:1"),
        ("Magnification", "x10"),
        ("File", "press_N_mm_02.csv"),
        ("Date", "20 Nov 2026"),
        ("Trigger", "INT"),
        ("Temperature", "23 C"),
        ("Sample size", "10 mm x 10 mm x 1 mm"),
    ],
)
def test_what_is_said_in_every_row_for_other_reasons_changes_nothing(tmp_path: Path, name: str, cell: str) -> None:
    table = read_lab_file(_write(tmp_path, name, cell, _plain(NAMES)))
    for quantity, unit in (("force", 1.0), ("capacitance", 1e-12)):
        np.testing.assert_allclose(table.columns[quantity], unit * TRUE[quantity], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "cell"),
    [("Valid", "FALSE"), ("Use", "n"), ("Remark", "sensor unplugged"), ("Note", "ball glued on"), ("", "new cable")],
)
def test_a_remark_or_a_verdict_in_every_row_is_told(tmp_path: Path, name: str, cell: str) -> None:
    assert f'"{cell}"' in _told(read_lab_file(_write(tmp_path, name, cell)))


@pytest.mark.parametrize("circuits", [("Cp-D", "Cs-D"), ("parallel", "series"), ("Cs-Rs", "Cp-Rp")])
def test_a_capacitance_of_two_circuits_is_read_in_one_that_is_said(tmp_path: Path, circuits: tuple[str, str]) -> None:
    lines = [",".join(["Mode", *NAMES])]
    for k, circuit in enumerate(circuits):
        lines += [",".join([circuit, f"{float(row[0]) + 1000.0 * k:.2f}", *row[1:]]) for row in zip(*CELLS, strict=True)]
    path = tmp_path / "modes.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=rf"of two circuits.*--where Mode={circuits[0]} or --where Mode={circuits[1]}"):
        read_lab_file(path)
    series, parallel = sorted(circuits, key=lambda circuit: "s" not in circuit.lower()[:2])
    table = read_lab_file(path, Reading(where={"Mode": parallel}))
    np.testing.assert_allclose(table.columns["capacitance"], TRUE["capacitance"] * 1e-12, rtol=1e-9)
    with pytest.raises(InputError, match=r"a series or a parallel capacitance|no column D"):
        read_lab_file(path, Reading(where={"Mode": series}))
    assert len(read_lab_file(path, Reading(columns={"capacitance": CAP})).lines) == 2 * N_ROW
