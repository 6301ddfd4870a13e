"""What stands beside, above and between the columns of a record, and must neither take rows from it nor give it other times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from models.sensor import FloatArray

N = 120
TIME = np.round(np.arange(N) * 0.1, 6)
DEPTH = np.round(np.minimum(TIME, TIME[-1] - TIME) * 0.16, 4)  # [mm]
FORCE = np.round(0.0013 * np.sin(29.0 * np.arange(N)) + 4.7 * np.maximum(DEPTH - 0.1, 0) ** 1.5, 4)  # [N]
ROWS: list[list[Any]] = [list(map(float, row)) for row in zip(TIME, DEPTH, FORCE, strict=True)]
NAMES = ["Time (s)", "Displacement (mm)", "Force (N)"]
PEAK = int(np.argmax(FORCE))


def as_csv(path: Path, rows: Sequence[Sequence[Any]], mark: str = ",") -> Path:
    path.write_text("".join(mark.join("" if c is None else str(c) for c in row) + "\n" for row in rows))
    return path


def as_book(path: Path, sheets: dict[str, Sequence[Sequence[Any]]]) -> Path:
    book = openpyxl.Workbook()
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(list(row))
    del book[book.sheetnames[0]]
    book.save(path)
    return path


def refusal(path: Path, **said: Any) -> str:
    with pytest.raises(InputError) as refused:
        read_lab_file(path, Reading(**said))
    return str(refused.value)


def assert_press(table: LabTable, rows: slice = slice(None)) -> None:
    """All rows of the press are there and usable."""
    np.testing.assert_allclose(table.columns["time"][rows], TIME, atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"][rows], DEPTH * 1e-3, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"][rows], FORCE, atol=1e-12)
    assert not any(table.reasons[rows])


# --- remarks and results beside the rows -----------------------------------------------------------------------------------


@pytest.mark.parametrize("word", ["max", "max reached", "Max force", "peak max", "mean over 5?", "Total", "Maximum"])
@pytest.mark.parametrize("apart", [0, 1, 3])
@pytest.mark.parametrize("at", [PEAK, 0, 7, N - 1])
def test_a_remark_with_a_word_of_results_takes_no_row_that_goes_on(tmp_path: Path, word: str, apart: int, at: int) -> None:
    rows = [[*row, *[None] * apart, word if r == at else None] for r, row in enumerate(ROWS)]
    header = [*NAMES, *[None] * apart, "Remark"]
    assert_press(read_lab_file(as_book(tmp_path / "a.xlsx", {"Data": [header, *rows]})))
    assert_press(read_lab_file(as_csv(tmp_path / "a.csv", [header, *rows])))


@pytest.mark.parametrize("time", [np.mean(TIME), TIME[-1], None, 0.0])
def test_rows_of_results_are_none_that_go_on(tmp_path: Path, time: float | None) -> None:
    """With their label in a column of remarks, below the rows or above them."""
    result = [time, float(DEPTH.max()), float(FORCE.max()), "Max"]
    rows = [[*row, "ok" if r == 5 else None] for r, row in enumerate(ROWS)]
    below = read_lab_file(as_csv(tmp_path / "a.csv", [[*NAMES, "Remark"], *rows, result]))
    assert_press(below, slice(N))
    assert all(below.reasons[N:])
    above = read_lab_file(as_csv(tmp_path / "b.csv", [[*NAMES, "Remark"], result, *rows]))
    assert_press(above, slice(-N, None))
    assert all(above.reasons[:-N])


@pytest.mark.parametrize("word", ["Max", "Mean"])
def test_results_of_a_cycle_at_the_time_of_its_last_row_are_none_that_go_on(tmp_path: Path, word: str) -> None:
    result = [ROWS[PEAK][0], 0.5 * DEPTH[PEAK], 1.1 * FORCE[PEAK], word]
    rows = [[*row, None] for row in ROWS]
    table = read_lab_file(as_csv(tmp_path / "a.csv", [[*NAMES, "Remark"], *rows[: PEAK + 1], result, *rows[PEAK + 1 :]]))
    assert table.reasons[PEAK + 1]
    assert sum(map(bool, table.reasons)) == 1


def test_the_largest_readings_below_a_record_without_times_are_a_row_of_results(tmp_path: Path) -> None:
    half = [[row[1], row[2], None] for row in ROWS[: N // 2]]
    table = read_lab_file(
        as_csv(tmp_path / "a.csv", [["Displacement (mm)", "Force (N)", "Remark"], *half, [*half[-1][:2], "Max"]])
    )
    assert table.reasons[-1].startswith("a row of results")
    assert not any(table.reasons[:-1])


def test_a_summary_beside_the_table_takes_no_row(tmp_path: Path) -> None:
    summary = {40: ("Max force", 4.0), 41: ("Max travel", 0.95), 42: ("Slope", 4.1), 43: ("n", 120), 44: ("Mean", 1.9)}
    rows = [[*row, None, None, *summary.get(r, ())] for r, row in enumerate(ROWS)]
    table = read_lab_file(as_book(tmp_path / "a.xlsx", {"Data": [NAMES, *rows]}))
    assert_press(table)
    assert {f"column {k}" for k in (6, 7)} <= {part.what for part in table.unread if part.reason.startswith("without a name")}


def with_cells(cells: dict[int, tuple[Any, ...]], names: Sequence[Any] = (), apart: int = 1) -> list[list[Any]]:
    """The press with cells beside some of its rows, as many columns apart from it."""
    return [[*NAMES, *[None] * apart, *names], *([*row, *[None] * apart, *cells.get(r, ())] for r, row in enumerate(ROWS))]


SMALL_TABLES: dict[str, dict[int, tuple[Any, ...]]] = {
    "units in brackets": {3: ("Fmax (mN)", 4100.0), 4: ("at (mm)", 0.9), 5: ("Stiffness (N/mm)", 5.1), 6: ("Cmax [pF]", 99.1)},
    "titled": {2: ("Results",), 3: ("Max. travel, mm", 0.9), 4: ("n", 120)},
    "units behind": {3: ("Fmax", 4100.0, "mN"), 4: ("Travel", 0.9, "mm")},
    "units between": {3: ("Fmax", "mN", 4100.0), 4: ("Travel", "mm", 0.9)},
    "values below": {3: ("Fmax (mN)", "at (mm)"), 4: (4100.0, 0.9)},
    "far down": {100: ("Ball d (mm)", 6)},
}


@pytest.mark.parametrize("layout", SMALL_TABLES)
@pytest.mark.parametrize("names", [(), ("Results",)])
@pytest.mark.parametrize("apart", [1, 2])
def test_units_in_a_small_table_beside_the_rows_are_those_of_its_values(
    tmp_path: Path, layout: str, names: tuple[str, ...], apart: int
) -> None:
    rows = with_cells(SMALL_TABLES[layout], names, apart)
    width = max(map(len, rows))
    for path in (
        as_book(tmp_path / "a.xlsx", {"Data": rows}),
        as_csv(tmp_path / "a.csv", [[*row, *[None] * (width - len(row))] for row in rows], ";"),
    ):
        table = read_lab_file(path)
        assert_press(table)
        assert any(note.startswith("a small table beside the rows is left out") for note in table.notes)


PARAMETERS = [("Ball radius (mm)", 6.35), ("Thickness (mm)", 6), ("Load cell", "10 N"), ("Speed (mm/s)", 0.1)]


@pytest.mark.parametrize("names", [("Parameter", "Value"), ("Setting", "of this test"), PARAMETERS[0]])
@pytest.mark.parametrize("before", [True, False])
def test_parameters_beside_the_table_are_left_out_with_a_note(tmp_path: Path, names: tuple[Any, Any], before: bool) -> None:
    own = [names, *(p for p in PARAMETERS if p != names)]
    table_rows = [list(NAMES), *map(list, ROWS)]
    beside = [[*own[r]] if r < len(own) else [None, None] for r in range(len(table_rows))]
    rows = [[*b, None, *row] if before else [*row, None, *b] for row, b in zip(table_rows, beside, strict=True)]
    for path in (as_book(tmp_path / "a.xlsx", {"Data": rows}), as_csv(tmp_path / "a.csv", rows)):
        table = read_lab_file(path)
        assert_press(table)
        assert any(note.startswith("a small table beside the rows is left out") for note in table.notes)
        assert any(str(names[0]) in part.what for part in table.unread)


@pytest.mark.parametrize("own", [("Load gain", 10), ("Force range", "x10"), ("Units", "mN"), ("Force in mN", 1), ("mN", 1)])
def test_parameters_that_speak_of_the_readings_are_refused_still(tmp_path: Path, own: tuple[Any, Any]) -> None:
    beside = {1: ("Thickness (mm)", 6), 2: own}
    rows = with_cells(beside, ("Parameter", "Value"))
    refusal(as_book(tmp_path / "a.xlsx", {"Data": rows}))


@pytest.mark.parametrize("apart", [0, 1])
def test_remarks_right_beside_the_record_are_no_parameters(tmp_path: Path, apart: int) -> None:
    beside = {1: ("Thickness (mm)", 6), 60: ("Load (mN)",)}
    assert "another unit or range" in refusal(
        as_book(tmp_path / "a.xlsx", {"Data": with_cells(beside, ("Remark", "n"), apart)})
    )


@pytest.mark.parametrize(
    "cells",
    [
        ("mN",),
        ("force now in mN",),
        ("force now in mN", 3),
        ("Load: (mN)", 3),
        ("range (N)", 50),
        ("Gain (mN)", 10),
        ("units (mm)", 1),
        (3, "mN"),
        ("Fmax (mN)",),
        ("Fmax (mN)", "see below", 4100.0),
    ],
)
def test_words_beside_the_rows_that_may_be_of_their_units_are_refused_still(tmp_path: Path, cells: tuple[Any, ...]) -> None:
    assert "another unit or range" in refusal(as_book(tmp_path / "a.xlsx", {"Data": with_cells({60: cells})}))


def test_a_remark_with_a_unit_in_a_column_of_remarks_is_no_label_of_a_reading(tmp_path: Path) -> None:
    rows = [[*NAMES, "Remark", "T (°C)"], *([*row, "Load (mN)" if r == 60 else None, 21.3] for r, row in enumerate(ROWS))]
    assert "another unit or range" in refusal(as_book(tmp_path / "a.xlsx", {"Data": rows}))


def test_a_word_right_behind_the_last_named_column_takes_no_row_that_goes_on(tmp_path: Path) -> None:
    rows = [[*row, "touch" if r == 9 else None] for r, row in enumerate(ROWS)]
    assert_press(read_lab_file(as_book(tmp_path / "a.xlsx", {"Data": [NAMES, *rows]})))


def test_a_row_with_a_cell_too_many_is_left_out_as_before(tmp_path: Path) -> None:
    rows = [list(row) for row in ROWS]
    rows[30].insert(1, 77.7)
    table = read_lab_file(as_book(tmp_path / "a.xlsx", {"Data": [NAMES, *rows]}))
    assert table.reasons[30] == "more cells than the header has names"
    assert not any(table.reasons[:30] + table.reasons[31:])


def test_a_column_that_is_filled_in_most_rows_takes_none_that_goes_on(tmp_path: Path) -> None:
    rows = [[*row, None if r % 5 == 2 else 21.4] for r, row in enumerate(ROWS)]
    assert_press(read_lab_file(as_csv(tmp_path / "a.csv", [[*NAMES, "T (°C)"], *rows])))


@pytest.mark.parametrize("row", [1, 2, 5])
def test_a_row_that_was_moved_by_a_cell_is_left_out_though_it_goes_on_by_chance(tmp_path: Path, row: int) -> None:
    rows: list[list[Any]] = [[*ROWS[r], 0.001 * r] for r in range(N)]
    rows[row] = [*rows[row][1:], None]
    table = read_lab_file(as_csv(tmp_path / "a.csv", [[*NAMES, "Strain (-)"], *rows]))
    assert [k for k, why in enumerate(table.reasons) if why] == [row]


# --- two clocks side by side -----------------------------------------------------------------------------------------------

LATE = np.round(0.35 + 0.16 * np.arange(75), 4)
CP = np.round(97.0 + 2.0 * np.interp(LATE, TIME, FORCE) / 4.0, 4)


def two_clocks(n: int = 75, *, gap: bool = True, names: tuple[str, str] = ("Time (s)", "Time (s)")) -> list[list[Any]]:
    """A press, and beside it a log of capacitance with its own times, of n rows."""
    late, cp = (LATE, CP) if n == 75 else (np.round(0.35 + 0.09 * np.arange(n), 4), np.round(97.0 + 0.01 * np.arange(n), 4))
    between = [None] if gap else []
    rows: list[list[Any]] = [[names[0], "Extension (mm)", "Load (N)", *between, names[1], "Cp (pF)"]]
    for r in range(N):
        rows.append([*ROWS[r], *between, *((float(late[r]), float(cp[r])) if r < n else (None, None))])
    return rows


@pytest.mark.parametrize("gap", [True, False])
@pytest.mark.parametrize("n", [75, N])
@pytest.mark.parametrize("names", [("Time (s)", "Time (s)"), ("Time (s)", "LCR time (s)")])
def test_a_time_is_read_with_the_columns_of_its_block_alone(tmp_path: Path, gap: bool, n: int, names: tuple[str, str]) -> None:
    path = as_book(tmp_path / "a.xlsx", {"Data": two_clocks(n, gap=gap, names=names)})
    last = 5 if gap else 4
    said = refusal(path)
    assert f'--columns time=1 to read "Extension (mm)", "Load (N)", --columns time={last} to read "Cp (pF)"' in said
    for more in ({}, {"capacitance": "none"}):
        table = read_lab_file(path, Reading(columns={"time": "1", **more}))
        assert set(table.columns) == {"time", "displacement", "force"}
        assert_press(table)
    table = read_lab_file(path, Reading(columns={"time": str(last)}))
    assert set(table.columns) == {"time", "capacitance"}
    assert len(table.lines) == n
    assert not any(table.reasons)
    assert "left out" in refusal(path, columns={"time": str(last), "capacitance": "none"})
    assert "are times that differ" in refusal(path, columns={"time": "none"})
    assert "time=1 to read" in refusal(path, columns={"capacitance": "none"})


def test_columns_of_another_block_are_not_read_at_a_time_though_they_are_named(tmp_path: Path) -> None:
    path = as_csv(tmp_path / "a.csv", two_clocks())
    said = refusal(path, columns={"time": "5", "displacement": "2", "force": "3"})
    assert "stands with the time in column 1" in said


def test_blocks_whose_times_agree_are_one_record(tmp_path: Path) -> None:
    rows: list[list[Any]] = [["Time (s)", "Extension (mm)", "Load (N)", None, "Time (s)", "Cp (pF)"]]
    rows += [[*row, None, row[0], 97.0 + row[2]] for row in ROWS]
    table = read_lab_file(as_csv(tmp_path / "a.csv", rows))
    assert set(table.columns) == {"time", "displacement", "force", "capacitance"}
    assert_press(table)
    asked = read_lab_file(tmp_path / "a.csv", Reading(columns={"time": "5", "displacement": "2", "force": "3"}))
    assert_press(asked)


def test_the_test_time_beside_the_total_time_is_no_block(tmp_path: Path) -> None:
    rows: list[list[Any]] = [
        ["Total Time (s)", "Time (s)", "Extension (mm)", "Load (N)"],
        *([row[0] + 9.5, *row] for row in ROWS),
    ]
    path = as_csv(tmp_path / "a.csv", rows)
    assert_press(read_lab_file(path, Reading(columns={"time": "Time (s)"})))


# --- results and sheets beside a record ------------------------------------------------------------------------------------


def _specimens(n_result: int, *, named: bool = True) -> list[list[Any]]:
    above: list[list[Any]] = [["Results Table 1" if named else "Press 4"]]
    above += [["", "Maximum Load", "Extension at Maximum Load"], ["", "(N)", "(mm)"]] if named else []
    above += [[k + 1, 3.9 + 0.01 * k, 0.9] for k in range(n_result)]
    blocks: list[list[Any]] = []
    for k in (1, 2):
        blocks += [[], [f'"Specimen {k}"'], ["Time", "Extension", "Load"], ["(s)", "(mm)", "(N)"]]
        blocks += [[row[0], row[1], k * row[2]] for row in ROWS]
    return [*above, *blocks]


@pytest.mark.parametrize("n", [1, 2, 14])
def test_a_table_of_results_above_specimens_is_named_as_not_read(tmp_path: Path, n: int) -> None:
    path = as_csv(tmp_path / "a.csv", _specimens(n))
    assert "--specimen 1 to --specimen 2" in refusal(path)
    table = read_lab_file(path, Reading(specimen=2))
    np.testing.assert_allclose(table.columns["force"], 2 * FORCE, atol=1e-9)
    assert any('beginning "Results Table 1"' in part.reason for part in table.unread)


def test_many_rows_of_numbers_under_no_names_above_a_header_are_refused_still(tmp_path: Path) -> None:
    assert "under none understood" in refusal(as_csv(tmp_path / "a.csv", _specimens(14, named=False)), specimen=2)


@pytest.mark.parametrize("header", [["Specimen", "Max force (N)", "Max displacement (mm)"], ["No", "Force (N)", "Travel (mm)"]])
@pytest.mark.parametrize("n", [1, 3])
def test_a_sheet_of_results_is_no_record_to_choose_from(tmp_path: Path, header: list[str], n: int) -> None:
    results: list[list[Any]] = [header, *([k + 1, 4.0 + 0.1 * k, 0.95] for k in range(n))]
    table = read_lab_file(as_book(tmp_path / "a.xlsx", {"Results": results, "Raw data": [NAMES, *ROWS]}))
    assert_press(table)
    assert any('sheet "Results"' in part.what for part in table.unread)


@pytest.mark.parametrize(("n", "other"), [(N, 12), (30, 9)])
def test_two_sheets_of_many_rows_are_a_choice_still(tmp_path: Path, n: int, other: int) -> None:
    path = as_book(tmp_path / "a.xlsx", {"A": [NAMES, *ROWS[:n]], "B": [NAMES, *ROWS[:other]]})
    assert "--sheet A or --sheet B" in refusal(path)


# --- lines as spreadsheet programs and scripts write them ------------------------------------------------------------------


def _lines(mark: str = ",") -> list[str]:
    return [mark.join(NAMES), *(mark.join(map(str, row)) for row in ROWS)]


@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("title", ["", "Press 4\n\n"])
def test_lines_that_stand_in_quotes_as_a_whole_are_read_with_a_note(tmp_path: Path, mark: str, title: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(title + "".join(f'"{line}"\n' for line in _lines(mark)))
    table = read_lab_file(path)
    assert_press(table)
    assert any("in quotes as a whole" in note for note in table.notes)


def test_quoted_lines_of_quoted_cells_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    cells = [",".join(f'""{cell}""' for cell in line.split(",")) for line in _lines()]
    path.write_text("".join(f'"{line}"\n' for line in cells))
    assert_press(read_lab_file(path))


def test_one_line_in_quotes_among_others_is_no_row(tmp_path: Path) -> None:
    lines = _lines()
    lines[50] = f'"{lines[50]}"'
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    try:
        table = read_lab_file(path)
    except InputError:
        return
    assert table.reasons[49] or len(table.lines) == N - 1


@pytest.mark.parametrize("form", ['="{}"', '"=""{}"""'])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_cells_written_as_formulas_of_a_spreadsheet_are_read_with_a_note(tmp_path: Path, form: str, mark: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text("".join(mark.join(form.format(c) for c in line.split(mark)) + "\n" for line in _lines(mark)))
    table = read_lab_file(path)
    assert_press(table)
    assert any(f"{3 * N + 3} cells are written as formulas" in note for note in table.notes)


@pytest.mark.parametrize("encoding", ["cp1252", "cp1250", "cp1251"])
def test_a_byte_order_mark_that_was_encoded_twice_is_none_of_the_name(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbf".decode(encoding).encode() + ("\n".join(_lines()) + "\n").encode())
    assert_press(read_lab_file(path))


def test_a_text_that_was_encoded_twice_is_read_as_it_was_written(tmp_path: Path) -> None:
    text = "".join(
        f"{line}\n" for line in [NAMES[0] + ",Displacement (µm),Force (N)", *(f"{t},{1000 * x:.1f},{f}" for t, x, f in ROWS)]
    )
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode("utf-8-sig").decode("cp1252").encode())
    assert_press(read_lab_file(path))


@pytest.mark.parametrize(
    "above",
    [
        "% Time [s], Displ [mm], Force [N]",
        "# time/s; displ/mm; F/N",
        "# time/s   displ/mm   force/N",
        "Time (s),LVDT (mm),Load (N)",
    ],
)
def test_names_between_commas_above_rows_between_blanks_are_read(tmp_path: Path, above: str) -> None:
    path = tmp_path / "a.dat"
    path.write_text("\n".join([above, *(f"{t:.3f} {x:10.4f} {f:10.4f}" for t, x, f in ROWS)]) + "\n")
    assert_press(read_lab_file(path))


INSTRUMENTS = ("run 3\tLVDT\tS2M", "test 3\trun 3\tU9C", "\tKeyence LK-H050\tKistler 9207", "\tchannel 2\tLC-10N")
OTHERWISE = ("run 3\trun 3\trun 4", "\tLVDT\tGAIN10", "\tLVDT\tS2M max")


REACHES = tuple(f"\tstage\tload cell{reach}" for reach in (" 10 N", " up to 500 N", ", 5 kN"))


@pytest.mark.parametrize(
    "comments", ["\tstage\tload cell", "\t\tload cell", "PC clock\tstage\tload cell", *INSTRUMENTS, *REACHES]
)
def test_comments_below_names_and_units_are_no_second_header(tmp_path: Path, comments: str) -> None:
    path = tmp_path / "a.dat"
    rows = ["\t".join(map(str, row)) for row in ROWS]
    path.write_text("\n".join(["Time\tIndentation\tForce", "s\tmm\tN", comments, *rows]) + "\n")
    table = read_lab_file(path)
    assert_press(table)
    assert any("comments on the columns" in part.reason for part in table.unread)


@pytest.mark.parametrize(
    "comments",
    ["\tForce\tExtension", "\tstage\tsetpoint", "\tstage\tx10", "\tstage\tmN", "\tsum\tin mN", "\tstage\tamp 10", *OTHERWISE],
)
def test_a_line_below_the_units_that_says_something_else_is_refused(tmp_path: Path, comments: str) -> None:
    path = tmp_path / "a.dat"
    rows = ["\t".join(map(str, row)) for row in ROWS]
    path.write_text("\n".join(["Time\tIndentation\tForce", "s\tmm\tN", comments, *rows]) + "\n")
    assert "stands below the header" in refusal(path)


# --- what is said of names that are not there ------------------------------------------------------------------------------


def _long_table(names: tuple[str, ...], column: str = "Specimen") -> list[list[Any]]:
    rows: list[list[Any]] = [[column, *NAMES]]
    for name in names:
        rows += [[name, *row] for row in ROWS]
    return rows


@pytest.mark.parametrize("names", [("1", "2"), ("S1", "S2")])
@pytest.mark.parametrize("column", ["Specimen", "Probe", "Sample No"])
def test_specimens_of_a_column_are_asked_for_by_the_column(tmp_path: Path, names: tuple[str, ...], column: str) -> None:
    path = as_csv(tmp_path / "a.csv", _long_table(names, column))
    said = refusal(path, specimen=2)
    assert f'"{column}={names[1]}"' in said.replace(f" {column}={names[1]}", f' "{column}={names[1]}"')
    table = read_lab_file(path, Reading(where={column: names[1]}))
    assert_press(table)


def test_a_specimen_that_no_column_names_is_answered_with_those_there_are(tmp_path: Path) -> None:
    path = as_csv(tmp_path / "a.csv", _long_table(("1", "2")))
    assert 'which names "1", "2"' in refusal(path, specimen=7)
    assert "Leave the specimen out" in refusal(as_csv(tmp_path / "b.csv", [NAMES, *ROWS]), specimen=2)


def test_a_specimen_is_not_passed_over_where_a_header_stands_again_in_one_record(tmp_path: Path) -> None:
    path = as_csv(tmp_path / "a.csv", [NAMES, *ROWS[:60], NAMES, *ROWS[60:]])
    assert_press(read_lab_file(path))
    assert "there is no specimen 2" in refusal(path, specimen=2)


@pytest.mark.parametrize(
    ("header", "wanted", "number"),
    [
        (NAMES, "Lode", "force=3"),
        (["Time (s)", "Load cell A [N]", "Displacement (mm)"], "Lode", "force=2"),
        (["Time (s)", "Displacement (mm)", "Wert 7"], "Lode", "force=3"),
    ],
)
def test_the_number_in_an_advice_is_that_of_no_other_quantity(
    tmp_path: Path, header: list[str], wanted: str, number: str
) -> None:
    order = [0, 2, 1] if header[1].startswith("Load") else [0, 1, 2]
    path = as_csv(tmp_path / "a.csv", [header, *([row[i] for i in order] for row in ROWS)])
    said = refusal(path, columns={"force": wanted})
    assert f"such as --columns {number}" in said
    table = read_lab_file(path, Reading(columns={"force": number[-1]}, units={"force": "N"}))
    assert_press(table)


def test_a_quantity_that_is_misspelled_is_told_with_the_one_that_is_like_it(tmp_path: Path) -> None:
    path = as_csv(tmp_path / "a.csv", [NAMES, *ROWS])
    said = refusal(path, units={"forse": "N"})
    assert 'there is no quantity "forse", did you mean force?' in said
    assert "did you mean" not in refusal(path, units={"xyz": "N"})


def test_a_unit_that_contradicts_the_file_is_obeyed_with_a_note(tmp_path: Path) -> None:
    path = as_csv(tmp_path / "a.csv", [NAMES, *ROWS])
    table = read_lab_file(path, Reading(units={"force": "mN"}))
    np.testing.assert_allclose(table.columns["force"], FORCE * 1e-3, atol=1e-15)
    assert '"Force (N)" is read in mN as asked, though the file says N' in table.notes
    for said in ("N", "newtons"):
        assert not any("though the file says" in note for note in read_lab_file(path, Reading(units={"force": said})).notes)


@pytest.mark.parametrize(
    ("other", "how"),
    [(99 + FORCE, "by a constant"), (97 - FORCE, "by their sign"), (97 + 1.004 * FORCE + 0.3 * DEPTH, "by up to")],
)
def test_columns_that_differ_are_said_to_differ_by_what_they_do(tmp_path: Path, other: np.ndarray, how: str) -> None:
    rows = [[t, round(97 + f, 4), round(float(c), 4)] for (t, _, f), c in zip(ROWS, other, strict=True)]
    said = refusal(as_csv(tmp_path / "a.csv", [["Time (s)", "CH0_pF", "CH1_pF"], *rows]))
    assert f"they differ {how}" in said
    assert "by up to 0 %" not in said


@pytest.mark.parametrize(
    "names", [("Time", "Time LCR"), ("time_instron", "time_lcr"), ("Time (s)", "LCR timestamp"), ("Time", "Time")]
)
def test_two_times_of_which_one_has_no_unit_are_refused_with_what_to_say(tmp_path: Path, names: tuple[str, str]) -> None:
    path = as_csv(tmp_path / "a.csv", two_clocks(gap=False, names=names))
    assert "Say which time is meant" in refusal(path)
    table = read_lab_file(path, Reading(columns={"time": "1"}, units={"time": "s"}))
    assert_press(table)


@pytest.mark.parametrize(
    "names", [("time_s", "time_s.1"), ("time_s_x", "time_s_y"), ("time_s", "time_s_lcr"), ("Time (s)", "LCR clock (s)")]
)
def test_a_time_under_the_name_that_a_program_gives_the_second_is_one(tmp_path: Path, names: tuple[str, str]) -> None:
    path = as_csv(tmp_path / "a.csv", two_clocks(gap=False, names=names))
    said = refusal(path)
    assert any(words in said for words in ("2 columns may be the time", "appears twice", "ends after 75 of"))


@pytest.mark.parametrize("header", ["Force run 1 (N),Force run 2 (N),Mean (N),SD (N)", "Probe 1 (N),Probe 2 (N),MW (N),SD (N)"])
def test_a_standard_deviation_is_no_force(tmp_path: Path, header: str) -> None:
    path = tmp_path / "a.csv"
    rows = [f"{t},{x},{f},{1.02 * f:.4f},{1.01 * f:.4f},{0.01 * f:.4f}" for t, x, f in ROWS]
    path.write_text("\n".join([f"Time (s),Displacement (mm),{header}", *rows]) + "\n")
    assert "SD (N)" in refusal(path)


@pytest.mark.parametrize("units", ["s,mm", "s,mm,N,N"])
def test_comments_below_units_that_are_not_as_many_as_the_names_end_in_no_traceback(tmp_path: Path, units: str) -> None:
    path = tmp_path / "a.csv"
    rows = [",".join(map(str, row)) for row in ROWS]
    path.write_text("\n".join(["Time,Displacement,Force", units, "clock,stage,cell", *rows]) + "\n")
    assert refusal(path)


@pytest.mark.parametrize("gap", [1, 2])
@pytest.mark.parametrize(
    ("words", "value", "other", "factor"),
    [("factor force", 10, "10 N", 10.0), ("Kraft Faktor", 9.81, "9.81 N", 9.81), ("unit force", "mN", "mN", 1e-3)],
)
def test_side_cells_of_the_names_that_speak_of_the_readings_are_asked_about(
    tmp_path: Path, gap: int, words: str, value: Any, other: str, factor: float
) -> None:
    rows = [[*NAMES, *[None] * gap, words, value], *ROWS]
    blank = [[*row, *[None] * (gap + 2)] for row in ROWS]
    for path in (as_book(tmp_path / "a.xlsx", {"Data": rows}), as_csv(tmp_path / "a.csv", [rows[0], *blank])):
        said = refusal(path)
        assert f'"{words}" and "{value}" beside the names' in said
        assert "--units force=N" in said
        assert other in said
        for unit, size in (("N", 1.0), (other, factor)):
            table = read_lab_file(path, Reading(units={"force": unit}))
            np.testing.assert_allclose(table.columns["force"], FORCE * size, rtol=1e-9)


@pytest.mark.parametrize(
    ("words", "value"),
    [("ball radius (mm)", 5), ("Sample", 3), ("max force (mN)", 860), ("operator", "JB"), ("Cp (pF)", "Remark")],
)
def test_other_side_cells_of_the_names_are_named_alone(tmp_path: Path, words: str, value: Any) -> None:
    assert_press(read_lab_file(as_book(tmp_path / "a.xlsx", {"Data": [[*NAMES, None, words, value], *ROWS]})))


@pytest.mark.parametrize(
    "names",
    [
        ("Stage position (mm)", "Piezo position (um)"),
        ("Displacement (mm)", "Displacement fine (um)"),
        ("Weg (mm)", "Feintrieb (um)"),
        ("Stage (mm)", "Nano (um)"),
    ],
)
def test_a_fine_drive_on_a_coarse_one_is_no_part_to_leave_out(tmp_path: Path, names: tuple[str, str]) -> None:
    place = 0.005 * np.concatenate([np.arange(200), np.arange(200)[::-1]])
    coarse = np.floor(np.round(10 * place, 6)) / 10
    force = 4 * np.clip(place - 0.2, 0, None) ** 1.5 + np.random.default_rng(1).normal(0, 0.003, place.size)

    def read(fine: FloatArray, columns: dict[str, str] | None = None) -> LabTable:
        path = tmp_path / "press.csv"
        rows = zip(0.1 * np.arange(place.size), coarse if fine is not place else place, 1000 * fine, force, strict=True)
        cells = "".join(f"{t:.1f},{a:.4f},{b:.2f},{f:.4f}\n" for t, a, b, f in rows)
        path.write_text(f"Time (s),{','.join(names)},Force (N)\n{cells}", encoding="utf-8")
        return read_lab_file(path, Reading(columns=columns or {}))

    with pytest.raises(InputError, match="neither is the way alone") as caught:
        read(place - coarse)
    assert f'--columns "displacement={names[0]}"' in caught.value.faults[0].advice
    said = read(place - coarse, {"displacement": names[0]})
    assert np.allclose(said.columns["displacement"], coarse / 1000)
    if names[0] != "Stage (mm)":  # the same way twice, neither in steps
        assert np.allclose(read(place).columns["displacement"], place / 1000)
