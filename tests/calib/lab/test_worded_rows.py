"""Rows with a word where the others are counted or have no cell: no readings, unless the word marks what happens at one."""

import re
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file

N = 120
TIME = np.round(0.1 * np.arange(N), 3)
DEPTH = np.round(np.concatenate([np.linspace(0.0, 1.0, N // 2), np.linspace(1.0, 0.0, N // 2)]), 4)
FORCE = np.round(4.0 * np.clip(DEPTH - 0.15, 0, None) ** 1.5, 4)
WORDS = ("Nullpunkt", "Tare", "Upper limit", "Setpoint", "Écart type", "Среднее", "Sensitivität", "Grenzwert 2", "目標値")


def rows(first: str = "{count}", *, timed: bool = True) -> list[str]:
    """The rows of a press, each behind a cell that counts, or as asked."""
    cells = [f"{t:.2f},{x:.4f},{f:.4f}" if timed else f"{x:.4f},{f:.4f}" for t, x, f in zip(TIME, DEPTH, FORCE, strict=True)]
    return [f"{first.format(count=k)},{c}" for k, c in enumerate(cells, 1)]


def read(tmp_path: Path, name: str, lines: list[str], *, timed: bool = True) -> LabTable:
    path = tmp_path / "lab.csv"
    header = f"{name},Time (s),Displacement (mm),Force (N)" if timed else f"{name},Displacement (mm),Force (N)"
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return read_lab_file(path)


def left_out(table: LabTable) -> list[int]:
    return [int(line) for line, why in zip(table.lines, table.reasons, strict=True) if why]


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize(("name", "cell"), [("No", "{count}"), ("", ""), ("Punkt", "{count}"), ("", "{count}")])
@pytest.mark.parametrize("timed", [True, False])
def test_a_row_with_a_word_at_the_top_is_no_reading(tmp_path: Path, word: str, name: str, cell: str, timed: bool) -> None:
    wrong = f"{word},0,0.0040,0.0125" if timed else f"{word},0.0040,0.0125"
    table = read(tmp_path, name, [wrong, *rows(cell, timed=timed)], timed=timed)
    assert left_out(table) == [2]
    assert f'"{word}"' in table.reasons[0]
    assert any("no reading" in note and f'"{word}"' in note for note in table.notes)


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize(("name", "cell"), [("No", "{count}"), ("", "")])
def test_a_row_with_a_word_at_the_end_is_never_used(tmp_path: Path, word: str, name: str, cell: str) -> None:
    table = read(tmp_path, name, [*rows(cell), f"{word},12.0,0.0310,0.0055"])
    used = [int(line) for line, why in zip(table.lines, table.reasons, strict=True) if not why]
    assert used == list(range(2, N + 2))


def test_a_row_between_two_counted_ones_is_no_reading_unless_it_is_counted(tmp_path: Path) -> None:
    counted = rows()
    counted[49] = counted[49].replace("50,", "Ereignis,", 1)
    table = read(tmp_path, "No", counted)
    assert left_out(table) == []
    assert any('"Ereignis" (line 51)' in note for note in table.notes)
    between = rows()
    between.insert(50, "Limit,5.0,0.9,3.9")
    assert left_out(read(tmp_path, "No", between)) == [52]


@pytest.mark.parametrize(("row", "word"), [(0, "start"), (10, "contact"), (30, "Marke 1"), (60, "unloading"), (N - 1, "Ende")])
def test_a_mark_in_a_column_without_a_name_leaves_its_reading_used(tmp_path: Path, row: int, word: str) -> None:
    marked = rows("")
    marked[row] = word + marked[row]
    table = read(tmp_path, "", marked)
    assert left_out(table) == []
    assert any(f'"{word}"' in note for note in table.notes)


def test_remarks_behind_the_readings_leave_their_rows_used(tmp_path: Path) -> None:
    lines = [f"{t:.2f},{x:.4f},{f:.4f}," for t, x, f in zip(TIME, DEPTH, FORCE, strict=True)]
    lines[0] += "Herr Meier"
    lines[70] += "door opened"
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N),", *lines]) + "\n", encoding="utf-8")
    assert left_out(read_lab_file(path)) == []


def test_lines_of_a_head_between_names_and_rows_are_no_readings(tmp_path: Path) -> None:
    head = [
        '"VUnit","mm","N"',
        '"SampleRate",2.5,2.5',
        '"HOffset",0.0,0.0',
        '"HUnit","s","s"',
        '"Date","2024/03/14","2024/03/14"',
    ]
    lines = ['"BlockNumber",1', '"TraceName","Displacement","Force"', *head, *rows("", timed=False)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert left_out(table) == []
    assert len(table.lines) == N
    assert any("line(s) of text left out" in note for note in table.notes)


@pytest.mark.parametrize("word", ["OK", "FAIL", "limit reached", "Überlast", "*"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("every", [7, 40, 200])
def test_a_word_put_among_the_readings_of_rows_is_named_once_and_the_ways_out_work(
    tmp_path: Path, word: str, mark: str, place: int, every: int
) -> None:
    cells = [[f"{t:.2f}", f"{x:.4f}", f"{f:.4f}"] for t, x, f in zip(TIME, DEPTH, FORCE, strict=True)]
    marked = range(5, N, every)

    def as_file(table: list[list[str]], *names: str) -> LabTable:
        path = tmp_path / "lab.csv"
        lines = [mark.join(row) for row in [["Time (s)", "Displacement (mm)", "Force (N)", *names], *table]]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return read_lab_file(path)

    with pytest.raises(InputError, match=f'"{re.escape(word)}" stands among its readings') as caught:
        as_file([[*row[:place], word, *row[place:]] if i in marked else row for i, row in enumerate(cells)])
    (fault,) = caught.value.faults
    assert (fault.line, fault.column) == (7, place + 1)
    assert "one more name at the end of the header, such as Remark; or take th" in fault.advice
    moved = as_file([[*row, word] if i in marked else [*row, ""] for i, row in enumerate(cells)], "Remark")
    left = as_file([row for i, row in enumerate(cells) if i not in marked])
    out = [bool(reason) for reason in moved.reasons]
    assert np.flatnonzero(out).tolist() == (list(marked) if word == "FAIL" else [])
    assert np.allclose(moved.columns["force"], np.where(out, np.nan, FORCE), equal_nan=True)
    assert np.allclose(left.columns["force"], np.delete(FORCE, list(marked)))
