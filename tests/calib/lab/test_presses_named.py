"""Presses below one another in one table: a column of any name that tells them apart is asked about, one of phases is not."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

HALF = 50
WAY = np.round(np.concatenate([np.linspace(0.0, 1.0, HALF), np.linspace(0.98, 0.0, HALF)]), 4)
N = 2 * HALF


def written(tmp_path: Path, name: str, cells: list[str], *, timed: bool = True) -> Path:
    """Presses with a cell each, or cells row by row."""
    lines = [("Time (s)," if timed else "") + f"{name},Displacement (mm),Force (N)"]
    rows = cells if len(cells) > 8 else [cell for cell in cells for _ in range(N)]
    for k, cell in enumerate(rows):
        x = WAY[k % N]
        force = (4.0 + 0.3 * (k // N)) * max(x - 0.15, 0.0) ** 1.5
        lines.append((f"{0.1 * k:.1f}," if timed else "") + f"{cell},{x:.4f},{force:.4f}")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        ("Muster", ["A", "B"]),
        ("试样编号", ["1", "2"]),
        ("Versuch", ["1", "2", "3"]),
        ("Messung Nr.", ["4", "5"]),
        ("source_file", ["run1.csv", "run2.csv"]),
        ("ID", ["PDMS-17", "PDMS-18"]),
        ("образец", ["первый", "второй"]),
        ("", ["left", "right"]),
        ("Operator", ["AB", "CD"]),
    ],
)
@pytest.mark.parametrize("timed", [True, False])
def test_presses_that_a_column_of_any_name_tells_apart_are_asked_about(
    tmp_path: Path, name: str, cells: list[str], timed: bool
) -> None:
    path = written(tmp_path, name, cells, timed=timed)
    with pytest.raises(InputError, match="may belong to several records") as error:
        read_lab_file(path)
    assert "changes where a press begins anew" in str(error.value)
    choice = error.value.faults[0].choice
    assert choice is not None
    assert choice.option == "where"
    table = read_lab_file(path, Reading(where={choice.key: cells[1]}))
    assert table.lines.tolist() == list(range(N + 2, 2 * N + 2))
    assert not any(table.reasons)


def read(tmp_path: Path, name: str, cells: list[str]) -> LabTable:
    return read_lab_file(written(tmp_path, name, cells))


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        ("Zyklus Nr", ["1", "2", "3"]),
        ("cyc", ["1", "2"]),
        ("Label", ["cycle 1", "cycle 2"]),
        ("Remark", ["loading"] * HALF + ["unloading"] * HALF),
        ("Nr", (["1"] * HALF + ["2"] * HALF + ["3"] * HALF + ["4"] * HALF)),
        ("What", ["hin"] * HALF + ["her"] * HALF + ["hin"] * HALF + ["her"] * HALF),
        ("Speed (mm/min)", ["1", "2"]),
        ("flag", ["a"] * 30 + ["b"] * (2 * N - 30)),
    ],
)
def test_phases_and_cycles_of_one_record_are_read_together(tmp_path: Path, name: str, cells: list[str]) -> None:
    table = read(tmp_path, name, cells)
    assert not any(table.reasons)


def swept(tmp_path: Path, name: str, listed: list[str], slope: float, *, staircase: bool = False) -> Path:
    """A press whose capacitance is measured at each value of a list, and goes with it by so much from one to the next."""
    rng = np.random.default_rng(3)
    lines = [f"Time (s),{name},Displacement (mm),Cp (pF)"]
    for k in range(600):
        at = k - k % len(listed) if staircase else k
        x = max(min(at, 600 - at) / 300, 0.0)
        c = 97 + 2 * max(x - 0.2, 0) ** 1.5 + slope * (k % len(listed)) + 0.002 * rng.standard_normal()
        lines.append(f"{0.1 * k:.1f},{listed[k % len(listed)]},{x:.4f},{c:.4f}")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


VOLTAGES = [f"{v:.1f}" for v in range(10)]
HALVES = [f"{v / 2:.1f}" for v in range(-5, 6)]
LOOP = ["0", "1", "2", "1", "0", "-1", "-2", "-1"]


@pytest.mark.parametrize(
    ("name", "listed"),
    [("DC Bias (V)", VOLTAGES), ("Vdc (V)", ["-1.00", "0.00", "1.00"]), ("Bias", HALVES), ("Vorspannung", ["off", "on"])],
)
@pytest.mark.parametrize("slope", [-0.05, 0.08])
def test_a_capacitance_that_goes_with_a_list_is_asked_about(tmp_path: Path, name: str, listed: list[str], slope: float) -> None:
    path = swept(tmp_path, name, listed, slope)
    with pytest.raises(InputError, match="may belong to several records") as error:
        read_lab_file(path)
    choice = error.value.faults[0].choice
    assert choice is not None
    assert set(choice.alternatives) == set(listed)
    table = read_lab_file(path, Reading(where={choice.key: listed[1]}))
    assert sum(not why for why in table.reasons) in (600 // len(listed), 600 // len(listed) + 1)


@pytest.mark.parametrize("listed", [VOLTAGES, HALVES, LOOP, ["1", "2", "3"]])
@pytest.mark.parametrize("staircase", [False, True])
def test_a_column_that_counts_and_shows_in_no_reading_asks_nothing(tmp_path: Path, listed: list[str], staircase: bool) -> None:
    table = read_lab_file(swept(tmp_path, "sub", listed, 0.0, staircase=staircase))
    assert sum(not why for why in table.reasons) >= 600 - len(listed)


def test_a_jump_is_told_with_the_column_that_changes_there(tmp_path: Path) -> None:
    lines = ["Time (s),Guard (V),Cp (pF)"]
    rng = np.random.default_rng(5)
    for k in range(400):
        x = max(min(k, 400 - k) / 200, 0.0)
        c = 97 + 2 * max(x - 0.2, 0) ** 1.5 - (0.5 if k >= 90 else 0.0) + 0.002 * rng.standard_normal()
        lines.append(f"{0.1 * k:.1f},{0.5 * (k >= 90) + 0.001 * (k % 7 + k % 13):.3f},{c:.4f}")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    told = [note for note in read_lab_file(path).notes if "readings jump by" in note]
    assert told
    assert 'what column "Guard (V)" shows, which changes there from "0.016" to "0.518"' in told[0]


@pytest.mark.parametrize(
    ("name", "listed"),
    [
        ("id", ["1", "2", "3"]),
        ("Serial", ["SN001", "SN002"]),
        ("Node", ["A", "B"]),
        ("Input", ["1", "2"]),
        ("Pin", ["A0", "A1"]),
        ("Nr.", ["1", "2", "3", "4"]),
    ],
)
def test_sensors_in_turn_that_read_alike_are_asked_about(tmp_path: Path, name: str, listed: list[str]) -> None:
    path = swept(tmp_path, name, listed, 0.0)
    with pytest.raises(InputError, match=r"may belong to several records.* in turn, row by row") as error:
        read_lab_file(path)
    choice = error.value.faults[0].choice
    assert choice is not None
    assert choice.option == "where"
    assert len(read_lab_file(path, Reading(where={choice.key: listed[0]})).lines) == 600 // len(listed)


@pytest.mark.parametrize(
    ("name", "listed"), [("Blork", ["1", "2", "3"]), ("heartbeat", ["0", "1"]), ("Flip", ["tick", "tock"])]
)
def test_a_list_of_another_name_that_no_reading_shows_is_told(tmp_path: Path, name: str, listed: list[str]) -> None:
    table = read_lab_file(swept(tmp_path, name, listed, 0.0))
    assert not any(table.reasons)
    assert any(f'"{name}" runs through' in note and f"--where {name}={listed[0]}" in note for note in table.notes)


@pytest.mark.parametrize("name", ["Specimen", "Muster", "PDMS"])
@pytest.mark.parametrize("timed", [True, False])
def test_a_name_in_the_first_row_of_each_press_only_is_that_of_all_its_rows(tmp_path: Path, name: str, timed: bool) -> None:
    joined = [("AB"[k // N] if k % N == 0 else "") for k in range(2 * N)]
    path = written(tmp_path, name, joined, timed=timed)
    with pytest.raises(InputError, match="may belong to several records") as error:
        read_lab_file(path)
    choice = error.value.faults[0].choice
    assert choice is not None
    table = read_lab_file(path, Reading(where={choice.key: "B"}))
    assert table.lines.tolist() == list(range(N + 2, 2 * N + 2))


@pytest.mark.parametrize(
    ("name", "said"),
    [("Test", {0: "started", HALF: "reversal"}), ("Point", {0: "1", 20: "2", 70: "3"}), ("Remark", {0: "A", 35: "B"})],
)
def test_a_word_in_some_rows_of_one_press_parts_no_record(tmp_path: Path, name: str, said: dict[int, str]) -> None:
    table = read(tmp_path, name, [said.get(k, "") for k in range(N)])
    assert not any(table.reasons)
