"""Rows in which one instrument has no reading are used for what the other one has, with a note."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.lab import LabTable, Reading, observe, read_lab_file
from calib.lab.observations import Observations
from calib.lab.unused import nothing_used

N = 120
DEPTH = 1.2 * (1 - np.abs(np.linspace(-1, 1, N)))
FORCE = 3 * np.maximum(DEPTH - 0.2, 0) ** 1.5
CAP = 97 + FORCE


def _read(folder: Path, cap: Callable[[int], str | None], force: Callable[[int], str | None] = lambda _: None) -> LabTable:
    rows = [
        f"{0.1 * i:.1f},{d:.4f},{f:.4f},{c:.4f}"
        if cap(i) is None and force(i) is None
        else f"{0.1 * i:.1f},{d:.4f},{f'{f:.4f}' if force(i) is None else force(i)},{f'{c:.4f}' if cap(i) is None else cap(i)}"
        for i, (d, f, c) in enumerate(zip(DEPTH, FORCE, CAP, strict=True))
    ]
    path = folder / "press.csv"
    path.write_text("\n".join(["Time (s),Extension (mm),Load (N),Cp (pF)", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, Reading())


def _used(folder: Path, cap: Callable[[int], str | None]) -> Observations:
    return observe(_read(folder, cap))


@pytest.mark.parametrize("mark", ["", "---", "--", "------", "nan", "NULL"])
@pytest.mark.parametrize("every", [3, 5])
def test_marks_between_the_readings_of_a_slow_meter_leave_no_row_out(tmp_path: Path, mark: str, every: int) -> None:
    obs = _used(tmp_path, lambda i: mark if i % every else None)
    assert np.count_nonzero(obs.used) == np.count_nonzero(_used(tmp_path, lambda _: None).used)
    assert any('"Cp (pF)" has a value in' in note for note in obs.table.notes)


@pytest.mark.parametrize("mark", ["---", "OL", "OVER", "****"])
def test_a_few_dashes_and_words_for_over_range_are_over_range(tmp_path: Path, mark: str) -> None:
    table = _read(tmp_path, lambda i: mark if 40 <= i < 44 else None)
    assert [(r, why) for r, why in enumerate(table.reasons) if why] == [(r, f"over-range {mark}") for r in range(40, 44)]


def test_a_meter_without_any_reading_is_over_range(tmp_path: Path) -> None:
    assert set(_read(tmp_path, lambda _: "---").reasons) == {"over-range ---"}


@pytest.mark.parametrize("mark", ["##", "########"])
def test_a_column_too_narrow_in_a_spreadsheet_is_called_that(tmp_path: Path, mark: str) -> None:
    table = _read(tmp_path, lambda i: mark if i in (40, 70) else None)
    why = f"the column was too narrow in the spreadsheet for its number: {mark}"
    assert [(r, told) for r, told in enumerate(table.reasons) if told] == [(40, why), (70, why)]


@pytest.mark.parametrize("block", [(0, 15), (100, 120), (70, 120), (30, 45)])
@pytest.mark.parametrize("channel", ["Cp (pF)", "Load (N)"])
def test_where_one_instrument_pauses_the_rows_are_used_for_the_other(
    tmp_path: Path, block: tuple[int, int], channel: str
) -> None:
    def paused(i: int) -> str | None:
        return "" if block[0] <= i < block[1] else None

    own = (paused, lambda _: None) if channel == "Cp (pF)" else (lambda _: None, paused)
    table = _read(tmp_path, *own)
    assert not any(table.reasons)
    said = f'"{channel}" has no value in lines {block[0] + 2} to {block[1] + 1}: what else these rows hold is used'
    assert said in table.notes
    assert np.array_equal(observe(table).used, _used(tmp_path, lambda _: None).used)


def test_single_empty_cells_leave_their_rows_out(tmp_path: Path) -> None:
    table = _read(tmp_path, lambda i: "" if i in (20, 21, 22, 80) or i > 105 else None)
    assert [r for r, why in enumerate(table.reasons) if why == "empty cell: capacitance"] == [20, 21, 22, 80]
    assert any("in lines 108 to 121" in note for note in table.notes)


def test_a_force_that_was_too_wide_for_its_column_is_exported_from_a_wider_one(tmp_path: Path) -> None:
    table = _read(tmp_path, lambda _: None, lambda _: "#####")
    assert "wider in the spreadsheet" in nothing_used(observe(table)).advice
