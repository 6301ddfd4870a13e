"""Lines that name each of their values are rows: `t_ms:20 force_N:0.4`, `t=0.10 s, F=0.002 N`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

N = 81
PLACE = [0.01 * min(i, N - 1 - i) for i in range(N)]
LOAD = [1.5 * max(0.0, x - 0.1) ** 1.5 for x in PLACE]


def write(folder: Path, line: Callable[[int, float, float], str], above: Sequence[str] = (), end: str = "\n") -> Path:
    path = folder / "log.txt"
    rows = [line(i, x, f) for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True))]
    path.write_text("\n".join([*above, *rows]) + end, encoding="utf-8")
    return path


def keyed(i: int, x: float, f: float) -> str:
    return f"t_ms:{20 * i} force_N:{f:.3f} disp_mm:{x:.3f}"


def assert_press(table: LabTable, step: float = 0.02) -> None:
    np.testing.assert_allclose(table.columns["time"], step * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=6e-4)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * np.array(PLACE), atol=6e-7)


@pytest.mark.parametrize(
    "line",
    [
        keyed,
        lambda i, x, f: f"t_ms:{20 * i}\tforce_N:{f:.3f}\tdisp_mm:{x:.3f}",
        lambda i, x, f: f"t={0.02 * i:.2f} s, z={x:.3f} mm, F={f:.3f} N",
        lambda i, x, f: f"Time: {0.02 * i:.2f}s; Displacement: {x:.3f}mm; Force: {f:.3f}N",
        lambda i, x, f: f"time_s={0.02 * i:.2f}|disp_um={1e3 * x:.0f}|load_mN={1e3 * f:.1f}".replace("|", " | "),
        lambda i, x, f: f"t_ms:\t{20 * i}\tforce_N:\t{f:.3f}\tdisp_mm:\t{x:.3f}",
        lambda i, x, f: f"t_ms=  {20 * i:5d}  force_N= {f:6.3f}  disp_mm= {x:6.3f}",
        lambda i, x, f: f"time_s={0.02 * i:.2f}; disp_mm={x:.3f}; load_N={f:.3f}".replace(".", ","),
    ],
)
def test_lines_that_name_their_values_are_rows(tmp_path: Path, line: Callable[[int, float, float], str]) -> None:
    table = read_lab_file(write(tmp_path, line))
    assert_press(table)
    assert table.lines.tolist() == list(range(1, N + 1))
    assert any("each line names its values" in note for note in table.notes)


def test_what_the_logger_says_before_the_first_line_is_told(tmp_path: Path) -> None:
    table = read_lab_file(write(tmp_path, keyed, ["HX711 ready", "scale: 420.5"]))
    assert_press(table)
    assert table.lines[0] == 3
    assert any("HX711" in unread.reason for unread in table.unread)


@pytest.mark.parametrize("place", ["q", "q (mm)", "2"])
def test_a_name_that_is_not_understood_is_said_by_name_or_number(tmp_path: Path, place: str) -> None:
    path = write(tmp_path, lambda i, x, f: f"t={0.02 * i:.2f} s q={x:.3f} mm F={f:.3f} N")
    with pytest.raises(InputError, match=r"no displacement column.*q"):
        read_lab_file(path)
    assert_press(read_lab_file(path, Reading(columns={"displacement": place})))


@pytest.mark.parametrize(
    "odd", ["t_ms:200 force_N:0.000", "t_ms:200 disp_mm:0.100 force_N:0.000", "t_ms:200 force_N:0.0 0.1", "overload", "1,2,3"]
)
def test_a_line_among_them_that_names_other_values_is_refused(tmp_path: Path, odd: str) -> None:
    path = write(tmp_path, lambda i, x, f: odd if i == 10 else keyed(i, x, f))
    with pytest.raises(InputError, match="does not name the values") as raised:
        read_lab_file(path)
    assert raised.value.faults[0].line == 11


def test_a_last_line_that_is_cut_is_not_used(tmp_path: Path) -> None:
    path = write(tmp_path, lambda i, x, f: keyed(i, x, f)[:-2] if i == N - 1 else keyed(i, x, f), end="")
    table = read_lab_file(path, AS_FOUND)
    assert "cut short" in table.reasons[-1]
    assert not any(table.reasons[:-1])


def test_a_statistic_among_named_values_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no force column"):
        read_lab_file(write(tmp_path, lambda i, x, f: f"t_ms:{20 * i} force_max_N:{f:.3f} disp_mm:{x:.3f}"))


def test_lines_above_a_table_that_name_values_make_no_rows(tmp_path: Path) -> None:
    above = [*(f"Pad: {k}, Height: {k}.5" for k in range(1, 7)), "Time (s),Extension (mm),Load (N)"]
    assert_press(read_lab_file(write(tmp_path, lambda i, x, f: f"{0.02 * i:.2f},{x:.3f},{f:.3f}", above)))


@pytest.mark.parametrize("stamp", ["14:02:{:06.3f} ", "2024-03-05 14:02:{:06.3f}\t", "05.03.2024 14:02:{:06.3f}, "])
def test_a_time_of_day_before_the_names_is_the_time(tmp_path: Path, stamp: str) -> None:
    table = read_lab_file(write(tmp_path, lambda i, x, f: f"{stamp.format(0.02 * i)}disp={x:.3f} mm F={f:.3f} N"))
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], 0.02 * np.arange(N), atol=1e-6)
    np.testing.assert_allclose(table.columns["force"], LOAD, atol=6e-4)


def test_units_in_capitals_behind_values_are_those_of_names_in_capitals(tmp_path: Path) -> None:
    path = write(tmp_path, lambda i, x, f: f"14:02:{0.02 * i:06.3f} F= 1000.0 HZ C= {97 + f:.5f} PF V= 15.0 V")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["capacitance"], (97 + np.array(LOAD)) * 1e-12, atol=1e-16)
    assert any('"PF" is read as pF' in note for note in table.notes)


def test_a_stamp_before_other_names_than_the_first_lines_have_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, lambda i, x, f: f"14:02:{0.02 * i:06.3f} " * (i != 30) + f"disp={x:.3f} mm F={f:.3f} N")
    with pytest.raises(InputError, match="does not name the values"):
        read_lab_file(path)


@pytest.mark.parametrize("form", ["{} C: {:.4f} pF", "{} Cp={:.4f}pF", "2024-01-19 {}\tC = {:.4f} pF"])
def test_one_value_behind_a_time_of_day_is_named_by_its_line(tmp_path: Path, form: str) -> None:
    table = read_lab_file(write(tmp_path, lambda i, x, f: form.format(f"14:02:{0.02 * i:06.3f}", 97 + f)))
    np.testing.assert_allclose(table.columns["capacitance"], (97 + np.array(LOAD)) * 1e-12, atol=1e-16)
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], 0.02 * np.arange(N), atol=1e-6)


def test_one_value_behind_a_time_that_is_now_one_and_now_another_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, lambda i, x, f: f"14:02:{0.02 * i:06.3f} " + (f"C: {97 + f:.4f} pF" if i % 2 else f"F: {f:.4f} N"))
    with pytest.raises(InputError, match="of 2 in turn"):
        read_lab_file(path)


def test_one_value_behind_a_time_in_lines_above_a_table_makes_no_rows(tmp_path: Path) -> None:
    above = [*(f"14:02:0{k}.000 Step: {k}" for k in range(6)), "Time (s),Extension (mm),Load (N)"]
    assert_press(read_lab_file(write(tmp_path, lambda i, x, f: f"{0.02 * i:.2f},{x:.3f},{f:.3f}", above)))


@pytest.mark.parametrize("mark", [",", ";", "\t", "|"])
def test_names_and_values_in_turn_between_delimiters_are_rows(tmp_path: Path, mark: str) -> None:
    def row(i: int, x: float, f: float) -> str:
        return mark.join(["Time (s)", f"{0.02 * i:.2f}", "Position (mm)", f"{x:.4f}", "Force (N)", f"{f:.4f}"])

    table = read_lab_file(write(tmp_path, row))
    assert_press(table)
    assert any("names and values stand in turn" in note for note in table.notes)


def test_a_line_of_other_names_among_these_is_refused(tmp_path: Path) -> None:
    def row(i: int, x: float, f: float) -> str:
        return f"Time (s),{0.02 * i:.2f},{'Load' if i == 20 else 'Force'} (N),{f:.4f},Position (mm),{x:.4f}"

    with pytest.raises(InputError, match=r":21:1: .*does not name the values"):
        read_lab_file(write(tmp_path, row))
