"""Cells between marks that no program uses as delimiter, or one value a line: read where names show the cells, else refused."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
WAY = np.round(np.concatenate([np.linspace(0.0, 0.6, N // 2), np.linspace(0.6, 0.0, N // 2)]), 4)
TIME = 0.1 * np.arange(N)
FORCE = np.round(8.0 * np.maximum(WAY - 0.05, 0.0) ** 1.5, 4)
NAMES = ["Time (s)", "Displacement (mm)", "Force (N)"]
ROWS = [[f"{t:.2f}", f"{x:.4f}", f"{f:.4f}"] for t, x, f in zip(TIME, WAY, FORCE, strict=True)]


def read(tmp_path: Path, lines: list[str], reading: Reading | None = None) -> LabTable:
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def check(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"], TIME, atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * WAY, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert not any(table.reasons)
    assert not table.unread


MARKS = ["~", ":", "^", "¦", "::", "/", " / ", " - ", " : ", "&", "@", "#", "\\", "_", " -> ", " => ", " * ", "§", "~~"]


@pytest.mark.parametrize("mark", MARKS)
def test_a_mark_that_parts_names_and_rows_into_as_many_is_a_delimiter_with_a_note(tmp_path: Path, mark: str) -> None:
    table = read(tmp_path, [mark.join(cells) for cells in (NAMES, *ROWS)])
    check(table)
    assert any(f'between "{mark.strip()}"' in note for note in table.notes)
    assert table.lines[0] == 2


@pytest.mark.parametrize("mark", ["~", ":", "^"])
def test_titles_above_and_units_below_the_names_change_nothing_of_it(tmp_path: Path, mark: str) -> None:
    lines = ["Press 3", "Note: 3^4 ~ 81", "", *(mark.join(cells) for cells in (["Time", "Displacement", "Force"], *ROWS))]
    lines.insert(4, mark.join(["s", "mm", "N"]))
    table = read(tmp_path, lines)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert table.lines[0] == 6


def test_decimal_commas_and_times_of_day_may_stand_between_such_marks(tmp_path: Path) -> None:
    rows = [[f"10:00:{t:05.2f}", x.replace(".", ","), f.replace(".", ",")] for t, (_, x, f) in zip(TIME, ROWS, strict=True)]
    table = read(tmp_path, ["~".join(cells) for cells in (["Time", *NAMES[1:]], *rows)])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    np.testing.assert_allclose(table.columns["time"] - 36000.0, TIME, atol=1e-6)


def test_colons_that_times_of_day_hold_as_well_are_refused_with_what_to_write(tmp_path: Path) -> None:
    lines = [":".join([f"10:00:{t:05.2f}", *row[1:]]) for t, row in zip(TIME, ROWS, strict=True)]
    with pytest.raises(InputError, match='5 cells between ":"') as error:
        read(tmp_path, [":".join(["Time", *NAMES[1:]]), *lines])
    assert "semicolon" in error.value.faults[0].advice
    as_told = [";".join(["Time", *NAMES[1:]]), *(";".join(line.rsplit(":", 2)) for line in lines)]
    np.testing.assert_allclose(read(tmp_path, as_told).columns["force"], FORCE, atol=1e-9)


def test_names_of_another_number_than_the_cells_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no line above names as many") as error:
        read(tmp_path, ["~".join(NAMES[:2]), *("~".join(row) for row in ROWS)])
    assert error.value.faults[0].line == 2


def test_rows_without_names_are_read_by_number(tmp_path: Path) -> None:
    columns = {"time": "1", "displacement": "2", "force": "3"}
    said = Reading(columns=columns, units={"time": "s", "displacement": "mm", "force": "N"})
    lines = ["~".join(row) for row in ROWS]
    check(read(tmp_path, lines, said))
    with pytest.raises(InputError) as error:
        read(tmp_path, lines)
    assert "--columns time=1 --columns displacement=2 --columns force=3" in error.value.faults[0].advice


Way = Callable[[int, list[str]], list[str]]
UNITS = ("s", "mm", "N")
RECORDS: dict[str, Way] = {
    "equal signs": lambda k, row: [f"Time={row[0]} s", f"Displacement={row[1]} mm", f"Force={row[2]} N"],
    "units in names": lambda k, row: [f"{name}: {cell}" for name, cell in zip(NAMES, row, strict=True)],
    "blank lines": lambda k, row: [*(f"{name} = {cell}" for name, cell in zip(NAMES, row, strict=True)), ""],
    "pairs of a comma file": lambda k, row: [f"{name},{cell}" for name, cell in zip(NAMES, row, strict=True)],
    "counted records": lambda k, row: [f"Reading {k}", *(f"  {n}: {c}" for n, c in zip(NAMES, row, strict=True))],
    "dashes": lambda k, row: [*(f"{n}: {c}" for n, c in zip(NAMES, row, strict=True)), "-----"],
    "German": lambda k, row: [
        f"{n}: {c} {u}".replace(".", ",") for n, c, u in zip(("Zeit", "Weg", "Kraft"), row, UNITS, strict=True)
    ],
}


@pytest.mark.parametrize("way", RECORDS)
def test_values_one_a_line_behind_their_names_are_rows(tmp_path: Path, way: str) -> None:
    lines = [line for k, row in enumerate(ROWS) for line in RECORDS[way](k, row)]
    table = read(tmp_path, ["Press of sensor 3", *lines])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * WAY, atol=1e-12)
    assert any("one a line, 3 of each record" in note for note in table.notes)
    assert table.lines[0] == 2 + (way == "counted records")


def test_a_record_that_lacks_a_value_is_refused_with_its_line(tmp_path: Path) -> None:
    lines = [line for k, row in enumerate(ROWS) for line in RECORDS["units in names"](k, row)]
    del lines[31]
    with pytest.raises(InputError, match=r"stands where the value of Displacement \(mm\) would") as error:
        read(tmp_path, lines)
    assert error.value.faults[0].line == 32


def test_a_record_that_is_cut_off_is_told(tmp_path: Path) -> None:
    lines = [line for k, row in enumerate(ROWS) for line in RECORDS["units in names"](k, row)]
    table = read(tmp_path, lines[:-1])
    assert len(table.lines) == N - 1
    assert any("is cut off and left out" in note for note in table.notes)


def test_results_of_some_specimens_above_a_table_are_no_records(tmp_path: Path) -> None:
    results = [line for k in range(6) for line in (f"Max load (N): {k + 1}.5", f"Extension (mm): {k}.3")]
    table = read(tmp_path, [*results, "", *(";".join(cells) for cells in (NAMES, *ROWS))])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)


@pytest.mark.parametrize("names", [[], NAMES])
@pytest.mark.parametrize("between", [[], [""]])
def test_one_number_a_line_is_refused_with_a_command_that_puts_them_in_rows(
    tmp_path: Path, names: list[str], between: list[str]
) -> None:
    lines = [*names, *(line for row in ROWS for line in (*row, *between))]
    with pytest.raises(InputError, match="each line holds one number") as error:
        read(tmp_path, lines)
    advice = error.value.faults[0].advice
    command = advice[advice.index("grep") : advice.index(". Where one column")]
    subprocess.run(command, shell=True, cwd=tmp_path, check=True)
    said = Reading(
        columns={} if names else {"time": "1", "displacement": "2", "force": "3"},
        units={} if names else {"time": "s", "displacement": "mm", "force": "N"},
    )
    check(read_lab_file(tmp_path / "new_lab.txt", said))
