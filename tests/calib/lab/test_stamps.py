"""Logs of terminals, with the time before each line: `14:05:22.000 -> CH1: 97.3 pF`, `[2024-03-12 14:05:22] 97.3 pF`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
CAP = [97.3 + 0.002 * (i % 7) + 0.03 * max(0, i - 20) for i in range(N)]
FORCE = [0.04 * max(0, i - 20) for i in range(N)]

Stamp = Callable[[str], str]
ARDUINO: Stamp = "{} -> ".format
PLATFORMIO: Stamp = "{} > ".format
MINICOM: Stamp = "[{}] ".format
TERA_TERM: Stamp = "[2024-03-12 {}] ".format


def old_tera_term(clock: str) -> str:
    return f"[Tue Mar 12 {clock} 2024] "


TERMINALS = [ARDUINO, PLATFORMIO, MINICOM, TERA_TERM, old_tera_term]


def _write(folder: Path, stamp: Stamp, lines: Callable[[int], str], above: str = "", end: str = "\n") -> Path:
    path = folder / "terminal.log"
    log = [f"{stamp(f'14:05:{22 + i // 10:02d}.{i % 10}00')}{lines(i)}" for i in range(N)]
    path.write_text(above + "\n".join(log) + end, encoding="utf-8")
    return path


def _assert_log(table: LabTable, first: int = 1) -> None:
    time = table.columns["time"]
    np.testing.assert_allclose(time - time[0], 0.1 * np.arange(N), atol=1e-6)
    np.testing.assert_allclose(table.columns["capacitance"], np.array(CAP) * 1e-12, atol=6e-17)
    assert table.lines.tolist() == list(range(first, first + N))
    assert any("before every line, as a serial monitor writes them" in note for note in table.notes)


@pytest.mark.parametrize("stamp", TERMINALS)
@pytest.mark.parametrize(
    "line",
    [
        lambda i: f"CH1: {CAP[i]:.4f} pF",
        lambda i: f"C={CAP[i]:.4f} pF",
        lambda i: f"C = {CAP[i]:.4f}pF",
        lambda i: f"{CAP[i]:.4f} pF",
        lambda i: f"{CAP[i]:.4f}".replace(".", ",") + " pF",
        lambda i: f"C_pF:{CAP[i]:.4f}",
        lambda i: f"F={FORCE[i]:.3f} N, C={CAP[i]:.4f} pF",
    ],
)
def test_a_value_with_its_unit_behind_the_stamp_is_read(tmp_path: Path, stamp: Stamp, line: Callable[[int], str]) -> None:
    _assert_log(read_lab_file(_write(tmp_path, stamp, line), Reading()))


@pytest.mark.parametrize("stamp", TERMINALS)
@pytest.mark.parametrize("mark", [",", "\t", ";", " ", ", "])
def test_numbers_behind_the_stamp_are_columns_with_names_or_by_number(tmp_path: Path, stamp: Stamp, mark: str) -> None:
    path = _write(tmp_path, stamp, lambda i: mark.join((f"{FORCE[i]:.3f}", f"{CAP[i]:.4f}")))
    asked = Reading(columns={"time": "1", "force": "2", "capacitance": "3"}, units={"force": "N", "capacitance": "pF"})
    table = read_lab_file(path, asked)
    _assert_log(table)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-4)
    head = f"{stamp('14:05:21.900')}{mark.join(('F_N', 'C_pF'))}\n"
    table = read_lab_file(_write(tmp_path, stamp, lambda i: mark.join((f"{FORCE[i]:.3f}", f"{CAP[i]:.4f}")), head), Reading())
    _assert_log(table, first=2)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-4)


@pytest.mark.parametrize("stamp", TERMINALS)
def test_a_bare_number_behind_the_stamp_is_read_where_the_user_says_what_it_is(tmp_path: Path, stamp: Stamp) -> None:
    path = _write(tmp_path, stamp, lambda i: f"{CAP[i]:.4f}")
    with pytest.raises(InputError):
        read_lab_file(path, Reading())
    _assert_log(read_lab_file(path, Reading(columns={"time": "1", "capacitance": "2"}, units={"capacitance": "pF"})))


def test_what_stands_above_and_a_line_that_was_cut_leave_the_rest_as_it_is(tmp_path: Path) -> None:
    above = "Welcome to minicom 2.8\n\n[14:05:21.500] AD7746 ready\n"
    path = _write(tmp_path, MINICOM, lambda i: f"{CAP[i]:.4f} pF", above, "\n[14:0")
    _assert_log(read_lab_file(path, Reading()), first=4)


def test_channels_in_turn_are_asked_about(tmp_path: Path) -> None:
    path = _write(tmp_path, ARDUINO, lambda i: f"CH{1 + i % 2}: {CAP[i]:.4f} pF")
    with pytest.raises(InputError, match='of 2 in turn: "CH1", "CH2"'):
        read_lab_file(path, Reading())
    path = _write(tmp_path, ARDUINO, lambda i: f"CH1: {CAP[i]:.4f} pF, CH2: {CAP[i] + 1:.4f} pF")
    with pytest.raises(InputError, match="CH2"):
        read_lab_file(path, Reading())


@pytest.mark.parametrize("line", [lambda i: f"{CAP[i]:.4f} V", lambda i: f"T={20 + 0.01 * i:.2f} degC"])
def test_a_value_of_another_unit_is_no_capacitance(tmp_path: Path, line: Callable[[int], str]) -> None:
    with pytest.raises(InputError):
        read_lab_file(_write(tmp_path, TERA_TERM, line), Reading())


def test_brackets_without_a_time_are_no_stamp(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    rows = [f"{0.1 * i:.1f},{0.01 * i:.3f},{FORCE[i]:.3f}" for i in range(N)]
    path.write_text("\n".join(["[14:05] started", "Time [s],Extension [mm],Load [N]", *rows, ""]), encoding="utf-8")
    table = read_lab_file(path, Reading())
    assert not any("serial monitor" in note for note in table.notes)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-4)
