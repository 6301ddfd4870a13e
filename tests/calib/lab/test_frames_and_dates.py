"""Rows in the frame of another notation, dates as programs write them, and channels that only some lines name."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
TIMES = [round(0.1 * i, 1) for i in range(N)]
DEPTH = [round(0.0113 * min(i, 40), 4) for i in range(N)]
FORCE = [round(0.5 * x**1.5 + 0.0001 * (i * 7 % 5), 4) for i, x in enumerate(DEPTH)]
ROWS = list(zip(TIMES, DEPTH, FORCE, strict=True))
SAID = Reading(
    columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
)


def read(folder: Path, lines: list[str], reading: Reading | None = None) -> LabTable:
    path = folder / "lab.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def is_press(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], TIMES, atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * np.array(DEPTH), atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert not any(table.reasons)


def test_a_table_of_a_wiki_is_read(tmp_path: Path) -> None:
    rows = [line for t, x, f in ROWS for line in ("|-", f"| {t} || {x} || {f}")]
    table = read(tmp_path, ['{| class="wikitable"', "! Time (s) !! Depth (mm) !! Force (N)", *rows, "|}"])
    is_press(table)
    assert any("a wiki" in note for note in table.notes)


@pytest.mark.parametrize("head", ["columns: t [s], d [mm], F [N]", "# t [s]  d [mm]  F [N]", "Time (s), Depth (mm), Force (N)"])
@pytest.mark.parametrize("mark", ["  ", ", ", ","])
def test_a_printed_array_is_read_without_its_brackets(tmp_path: Path, head: str, mark: str) -> None:
    end = "]," if "," in mark else "]"
    rows = [f" [{mark.join(map(str, row))}{end}" for row in ROWS]
    table = read(tmp_path, [head, "[" + rows[0].strip(), *rows[1:-1], rows[-1].rstrip(",") + "]"])
    is_press(table)
    assert any("printed array" in note for note in table.notes)


def test_a_printed_array_without_names_is_asked_for_them(tmp_path: Path) -> None:
    lines = ["data = [", *(f"[{t}, {x}, {f}]," for t, x, f in ROWS), "]"]
    with pytest.raises(InputError, match="of one form"):
        read(tmp_path, lines)
    is_press(read(tmp_path, lines, SAID))


def test_an_array_of_which_rows_are_left_out_is_refused(tmp_path: Path) -> None:
    rows = [f" [{t} {x} {f}]" for t, x, f in ROWS]
    with pytest.raises(InputError, match=r"\.\.\."):
        read(tmp_path, ["t_s d_mm F_N", *rows[:20], " ...", *rows[40:]])


@pytest.mark.parametrize(("head", "each"), [("HEAD: ", "DATA: "), ("HDR:", "VAL:"), ("DATA: ", "DATA: "), ("H : ", "D : ")])
@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_a_word_before_the_cells_of_each_line_is_passed_by(tmp_path: Path, head: str, each: str, mark: str) -> None:
    lines = [head + mark.join(("t_s", "z_mm", "F_N")), *(each + mark.join(map(str, row)) for row in ROWS)]
    is_press(read(tmp_path, lines))


def test_a_word_before_rows_without_names_is_asked_for_them(tmp_path: Path) -> None:
    lines = [f"DATA: {t},{x},{f}" for t, x, f in ROWS]
    with pytest.raises(InputError, match="no name of a quantity"):
        read(tmp_path, lines)
    is_press(read(tmp_path, lines, SAID))


START = datetime(2026, 11, 27, 2, 34, 43)
FORMS = {
    "of date": "%a %b %d %H:%M:%S UTC %Y",
    "of date, with its offset": "%a %b %d %H:%M:%S +0100 %Y",
    "of date, in halves of the day": "%a %b %d %I:%M:%S %p CET %Y",
    "of date, day first": "%a %d %b %H:%M:%S CET %Y",
    "of the week": "%G-W%V-%uT%H:%M:%S",
    "of the week, with a blank": "%G-W%V-%u %H:%M:%S",
    "of the year": "%Y-%jT%H:%M:%S",
    "of the year, with a blank": "%Y-%j %H:%M:%S",
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS.keys())
@pytest.mark.parametrize("step", [1, 600])
def test_dates_as_programs_write_them_are_read(tmp_path: Path, form: str, step: int) -> None:
    stamps = [(START + timedelta(seconds=step * i)).strftime(form) for i in range(N)]
    lines = ["Time;Depth (mm);Force (N)", *(f"{s};{x};{f}" for s, (_, x, f) in zip(stamps, ROWS, strict=True))]
    table = read(tmp_path, lines)
    np.testing.assert_allclose(np.diff(table.columns["time"]), step)


@pytest.mark.parametrize("behind", [" {x} {f}", ": {x} {f}"])
def test_dates_in_words_before_cells_between_blanks_are_read(tmp_path: Path, behind: str) -> None:
    stamps = [(START + timedelta(seconds=i)).strftime("%a %b %d %H:%M:%S UTC %Y") for i in range(N)]
    rows = [s + behind.format(x=x, f=f) for s, (_, x, f) in zip(stamps, ROWS, strict=True)]
    table = read(tmp_path, ["Time z_mm F_N", *rows])
    np.testing.assert_allclose(np.diff(table.columns["time"]), 1.0)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)


def test_dates_in_words_before_named_values_are_read(tmp_path: Path) -> None:
    stamps = [(START + timedelta(seconds=i)).strftime("%a %b %d %H:%M:%S UTC %Y") for i in range(N)]
    table = read(tmp_path, [f"{s} F={f} N z={x} mm" for s, (_, x, f) in zip(stamps, ROWS, strict=True)])
    np.testing.assert_allclose(np.diff(table.columns["time"]), 1.0)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)


@pytest.mark.parametrize("cell", ["2026-W54-1T02:34:43", "2026-399T02:34:43"])
def test_a_day_that_is_none_is_no_date(tmp_path: Path, cell: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, ["Time;Depth (mm);Force (N)", *(f"{cell};{x};{f}" for _, x, f in ROWS)])


@pytest.mark.parametrize("every", [2, 5, 7])
@pytest.mark.parametrize("begin", [0, 1])
def test_a_channel_that_only_some_lines_name_is_read_where_it_is(tmp_path: Path, every: int, begin: int) -> None:
    lines = [
        f"t={t} s F={f} N z={x} mm" + (f" C={97 + f:.4f} pF" if i % every == begin else "") for i, (t, x, f) in enumerate(ROWS)
    ]
    table = read(tmp_path, lines)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    found = np.isfinite(table.columns["capacitance"])
    assert np.array_equal(np.flatnonzero(found) % every, np.full(np.count_nonzero(found), begin))
    np.testing.assert_allclose(table.columns["capacitance"][found], 1e-12 * (97 + np.array(FORCE)[found]), atol=1e-16)


def test_a_line_that_names_another_value_is_still_refused(tmp_path: Path) -> None:
    lines = [f"t={t} s F={f} N z={x} mm" for t, x, f in ROWS]
    lines[30] = "t=3.0 s G=0.2 N z=0.3 mm"
    with pytest.raises(InputError, match="does not name the values"):
        read(tmp_path, lines)


def test_a_table_of_an_issue_tracker_is_read(tmp_path: Path) -> None:
    is_press(read(tmp_path, ["||Time (s)||Depth (mm)||Force (N)||", *(f"|{t}|{x}|{f}|" for t, x, f in ROWS)]))


def test_a_table_as_r_prints_it_is_read_without_its_line_of_types(tmp_path: Path) -> None:
    rows = [f"{k:3d} {t:6.1f} {x:8.4f} {f:8.4f}" for k, (t, x, f) in enumerate(ROWS, 1)]
    head = ["# A tibble: 60 x 3", "    time_s  disp_mm  force_N", "     <dbl>    <dbl>    <dbl>"]
    is_press(read(tmp_path, [*head, *rows]))
