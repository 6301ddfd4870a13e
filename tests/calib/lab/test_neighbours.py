"""Single rows that the rows beside them contradict, rows of results, and columns that stand in for one that is put aside."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N_ROW = 60
TIME = 0.5 * np.arange(N_ROW)
DEPTH = 0.02 * np.arange(N_ROW)
FORCE = 0.2 + 3.0 * np.maximum(DEPTH - 0.3, 0.0) ** 1.5


def _rows(**changed: dict[int, str]) -> list[list[str]]:
    cells = {
        "time": [f"{v:.2f}" for v in TIME],
        "depth": [f"{v:.4f}" for v in DEPTH],
        "force": [f"{v:.4f}" for v in FORCE],
    }
    for name, texts in changed.items():
        for row, text in texts.items():
            cells[name][row] = text
    return [list(row) for row in zip(*cells.values(), strict=True)]


def _read(
    folder: Path, rows: list[list[str]], header: str = "Time (s),Extension (mm),Load (N)", reading: Reading | None = None
) -> LabTable:
    path = folder / "press.csv"
    path.write_text("\n".join([header, *(",".join(row) for row in rows)]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def _refusal(folder: Path, rows: list[list[str]], header: str) -> str:
    with pytest.raises(InputError) as caught:
        _read(folder, rows, header)
    return str(caught.value)


@pytest.mark.parametrize("row", [1, 2, 30, N_ROW - 3, N_ROW - 2])
def test_a_number_off_by_a_power_of_ten_is_left_out_beside_the_ends_too(tmp_path: Path, row: int) -> None:
    table = _read(tmp_path, _rows(force={row: f"{1000 * FORCE[row]:.4f}"}))
    assert "off by a factor" in table.reasons[row]
    assert sum(map(bool, table.reasons)) == 1


@pytest.mark.parametrize("size", [9.85, 10.15, 98.5, 0.0985])
def test_a_number_that_comes_only_near_its_still_neighbours_is_left_out_too(tmp_path: Path, size: float) -> None:
    table = _read(tmp_path, _rows(force={8: f"{size * FORCE[8]:.4f}"}))
    assert [r for r, why in enumerate(table.reasons) if why] == [8]


@pytest.mark.parametrize("swapped", [38, 42])
def test_a_number_off_by_a_power_of_ten_is_left_out_beside_a_row_out_of_order(tmp_path: Path, swapped: int) -> None:
    rows = _rows(depth={40: f"{DEPTH[40] / 10:.4f}"})
    rows[swapped], rows[20] = rows[20], rows[swapped]
    table = _read(tmp_path, rows)
    assert "off by a factor" in table.reasons[40]
    assert {r for r, why in enumerate(table.reasons) if why} <= {20, 21, 40, swapped, swapped + 1}


def test_a_peak_that_no_power_of_ten_explains_stands_alone(tmp_path: Path) -> None:
    table = _read(tmp_path, _rows(force={8: f"{5 * FORCE[8]:.4f}"}))
    assert [r for r, why in enumerate(table.reasons) if why] == [8]
    assert table.reasons[8] == '"1.0000" stands alone: the readings beside it are near 0.2 N'


def test_a_lost_mark_does_not_hide_a_number_off_by_a_power_of_ten(tmp_path: Path) -> None:
    table = _read(tmp_path, _rows(depth={20: "4000", 40: f"{DEPTH[40] / 10:.4f}"}))
    assert [r for r, why in enumerate(table.reasons) if why] == [20, 40]


@pytest.mark.parametrize("row", [5, N_ROW - 2])
def test_a_time_far_ahead_is_left_out_and_not_the_row_behind_it(tmp_path: Path, row: int) -> None:
    table = _read(tmp_path, _rows(time={row: "777.77"}))
    assert [r for r, why in enumerate(table.reasons) if why] == [row]


@pytest.mark.parametrize("word", ["Mean", "Average", "Std. dev.", "Mittelwert", "Max", "平均"])
@pytest.mark.parametrize("key", ["A", ""])
def test_a_row_of_results_below_a_column_of_words_is_no_reading(tmp_path: Path, word: str, key: str) -> None:
    rows = [[key, *row] for row in _rows()]
    table = _read(tmp_path, [*rows, [word, "14.75", "0.59", "0.61"]], "Specimen,Time (s),Extension (mm),Load (N)")
    kept = [not why for why in table.reasons]
    assert sum(kept) == N_ROW
    np.testing.assert_allclose(table.columns["force"][kept], FORCE, atol=1e-4)
    assert len(kept) == N_ROW or f'a row of results: "{word}"' in table.reasons[-1]


@pytest.mark.parametrize("name", ["Load [*10] (N)", "Load (max) (N)", "Load setpoint (N)", "Load (foo) (N)"])
def test_a_second_load_is_a_choice_where_the_plain_one_is_put_aside(tmp_path: Path, name: str) -> None:
    rows = [[*row, row[-1]] for row in _rows()]
    said = _refusal(tmp_path, rows, f"Time (s),Extension (mm),{name},Load 2 (N)")
    assert '"force=Load 2 (N)"' in said
    table = _read(tmp_path, rows, f"Time (s),Extension (mm),{name},Load 2 (N)", Reading(columns={"force": "Load 2 (N)"}))
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


def test_a_second_load_is_a_choice_where_the_plain_one_stands_still(tmp_path: Path) -> None:
    rows = [[*row[:2], "0.975", row[-1]] for row in _rows()]
    assert "stands still" in _refusal(tmp_path, rows, "Time (s),Extension (mm),Load (N),Load 2 (N)")


def test_a_last_column_of_comments_may_have_no_cells(tmp_path: Path) -> None:
    table = _read(tmp_path, _rows(), "Time (s),Extension (mm),Load (N),Comment")
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


def test_numbers_without_a_header_are_no_header_by_another_delimiter(tmp_path: Path) -> None:
    path = tmp_path / "log.lvm"
    rows = [f"{t:.6E}\t{x:.6f}\t{f:.6f}\tNaN".replace(".", ",") for t, x, f in zip(TIME + 1, DEPTH, FORCE, strict=True)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="--columns time=1 --columns displacement=2 --columns force=3"):
        read_lab_file(path)
    columns = {"time": "1", "displacement": "2", "force": "3"}
    table = read_lab_file(path, Reading(columns=columns, units={"time": "s", "displacement": "mm", "force": "N"}))
    np.testing.assert_allclose(table.columns["time"], TIME + 1)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-6)


@pytest.mark.parametrize("unit", ["Volts", "m/s^2", "Lux", "Deg C"])
def test_units_of_an_lvm_file_need_not_be_known(tmp_path: Path, unit: str) -> None:
    head = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tOne", "***End_of_Header***", ""]
    tags = ["Channels\t2\t", f"Y_Unit_Label\tmm\t{unit}", "X_Dimension\tTime\tTime", "***End_of_Header***"]
    names = ["X_Value\tExtension\tVoltage_0\tComment"]
    path = tmp_path / "log.lvm"
    path.write_text("\n".join([*head, *tags, *names, *("\t".join(row) for row in _rows())]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="no force column among"):
        read_lab_file(path)
    table = read_lab_file(path, Reading(columns={"force": "Voltage_0"}, units={"force": "N"}))
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


# ------------------------------------------------------------------------------- rows whose cells stand one column too far


SHIFTED: dict[str, tuple[range, Callable[[list[str]], list[str]]]] = {
    "every second row to the left": (range(20, N_ROW, 2), lambda row: [*row[1:], ""]),
    "a block to the left": (range(30, 38), lambda row: [*row[1:], ""]),
    "one row to the right": (range(25, 26), lambda row: ["", *row[:-1]]),
    "every third row to the right": (range(9, N_ROW, 3), lambda row: ["", *row[:-1]]),
}


@pytest.mark.parametrize("first", ["Zeitpunkt des Tages", "No"])
@pytest.mark.parametrize("which", SHIFTED)
def test_rows_that_go_on_only_once_they_are_moved_are_left_out(tmp_path: Path, first: str, which: str) -> None:
    chosen, shift = SHIFTED[which]
    begin = [f"09:30:{k:02d}" for k in range(N_ROW)] if first != "No" else [str(k + 1) for k in range(N_ROW)]
    rows = [[begin[k], *row[1:], "0.5"] for k, row in enumerate(_rows())]
    rows = [shift(row) if k in chosen else row for k, row in enumerate(rows)]
    table = _read(tmp_path, rows, f"{first},Extension (mm),Load (N),Aux")
    assert [k for k, why in enumerate(table.reasons) if why] == list(chosen)
    kept = [k for k in range(N_ROW) if k not in chosen]
    np.testing.assert_allclose(table.columns["displacement"][kept], np.round(DEPTH[kept], 4) * 1e-3)
    assert np.all(np.isnan(table.columns["displacement"][list(chosen)]))


def test_rows_of_which_most_are_shifted_are_refused(tmp_path: Path) -> None:
    rows = [[f"09:30:{k:02d}", *row[1:], "0.5"] for k, row in enumerate(_rows())]
    rows = [[*row[1:], ""] if k % 3 else row for k, row in enumerate(rows)]
    assert "one column further to the left" in _refusal(tmp_path, rows, "Zeitpunkt des Tages,Extension (mm),Load (N),Aux")


@pytest.mark.parametrize("every", [2, 3, 17])
def test_rows_that_are_shifted_into_a_first_column_without_readings_are_refused(tmp_path: Path, every: int) -> None:
    rows = [["", *row, "0.5"] for row in _rows()]
    rows = [[*row[1:], ""] if k % every == 1 else row for k, row in enumerate(rows)]
    assert "one column further to the" in _refusal(tmp_path, rows, "Specimen,Time (s),Extension (mm),Load (N),Aux")


@pytest.mark.parametrize("every", [2, 5])
def test_slower_first_and_last_columns_that_take_turns_shift_no_row(tmp_path: Path, every: int) -> None:
    rows = [["20.9" if k % every else "", *row, "" if k % every else "21.5"] for k, row in enumerate(_rows())]
    table = _read(tmp_path, rows, "T1 (°C),Time (s),Extension (mm),Load (N),T2 (°C)")
    assert not any("too far" in why for why in table.reasons)


@pytest.mark.parametrize("every", [2, 5])
def test_a_slower_last_column_shifts_no_row(tmp_path: Path, every: int) -> None:
    rows = [[*row, "21.5" if k % every == 0 else ""] for k, row in enumerate(_rows())]
    table = _read(tmp_path, rows, "Time (s),Extension (mm),Load (N),T (°C)")
    assert not any("too far" in why for why in table.reasons)


def test_a_key_column_is_seen_beside_rows_that_are_short(tmp_path: Path) -> None:
    rows = [["s1" if k % 2 else "s2", *row] for k, row in enumerate(_rows())]
    rows = [row[1:] if k > 40 and k % 2 else row for k, row in enumerate(rows)]
    assert "may belong to several records" in _refusal(tmp_path, rows, "Sample ID,Time (s),Extension (mm),Load (N)")


@pytest.mark.parametrize("power", [100, 1000])
def test_a_reading_off_by_more_than_one_place_may_scatter(tmp_path: Path, power: int) -> None:
    force = 0.19 + 0.002 * np.sin(5.0 * np.arange(N_ROW))
    texts = {k: f"{f:.3f}" for k, f in enumerate(force)} | {30: f"{0.175 * power:.3f}"}
    table = _read(tmp_path, _rows(force=texts))
    assert [k for k, why in enumerate(table.reasons) if why] == [30]
