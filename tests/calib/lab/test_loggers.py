"""Lines of named values behind what a logging library writes before each: Arduino and ESP-IDF, Python, syslog."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))

Prefix = Callable[[int], str]


def clock(i: int, mark: str = ".") -> str:
    return f"10:22:{31 + i // 10:02d}{mark}{i % 10}00"


WITHOUT_TIME: list[Prefix] = [lambda i: "INFO:rig:"]
PREFIXES: list[Prefix] = [
    lambda i: f"[{100 * i + 3:6d}][I][main.cpp:42] loop(): ",
    lambda i: f"I ({100 * i + 300}) RIG: ",
    lambda i: f"I ({clock(i)}) RIG: ",
    lambda i: f"2023-04-12 {clock(i, ',')} INFO rig: ",
    lambda i: f"2023-04-12 {clock(i, ',')} - rig.press - INFO - ",
    lambda i: f"2023-04-12 {clock(i, ',')} [INFO] rig: ",
    lambda i: f"[2023-04-12 {clock(i, ',')}] INFO: ",
    lambda i: f"Apr 12 {clock(i)} rpi rig[812]: ",
    lambda i: f"2023-04-12T{clock(i)}00+02:00 rpi rig[812]: ",
]


def read(tmp_path: Path, prefix: Prefix, *, own_time: bool = False, above: str = "", end: str = "", text: str = "") -> LabTable:
    path = tmp_path / "rig.log"
    own = [f"t_ms={100 * i} " if own_time else "" for i in range(N)]
    rows = [f"{prefix(i)}{own[i]}disp_mm={DEPTH[i]:.4f} force_N={FORCE[i]:.4f}{end}\n" for i in range(N)]
    rows.insert(30, text)
    path.write_text(above + "".join(rows), encoding="utf-8")
    return read_lab_file(path, Reading())


@pytest.mark.parametrize("prefix", PREFIXES)
def test_the_times_of_the_logger_are_those_of_the_values(tmp_path: Path, prefix: Prefix) -> None:
    table = read(tmp_path, prefix)
    time = table.columns["time"]
    np.testing.assert_allclose(time - time[0], 0.1 * np.arange(N), atol=1e-6)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=6e-8)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-5)
    assert any("what a logger writes before every line" in note and "whose times are a column" in note for note in table.notes)


@pytest.mark.parametrize("prefix", [*PREFIXES, *WITHOUT_TIME])
def test_a_time_among_the_values_goes_before_that_of_the_logger(tmp_path: Path, prefix: Prefix) -> None:
    table = read(tmp_path, prefix, own_time=True)
    np.testing.assert_allclose(table.columns["time"], 0.1 * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-5)


def test_lines_of_a_boot_stand_above_and_colours_are_left_out(tmp_path: Path) -> None:
    boot = "ets Jun  8 2016 00:22:57\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\nI (28) boot: ESP-IDF v5.1\n"
    table = read(tmp_path, lambda i: f"\x1b[0;32mI ({100 * i + 300}) RIG: ", above=boot, end="\x1b[0m")
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-5)
    assert table.lines.tolist() == list(range(4, 4 + N))
    assert any("colours of a terminal" in note for note in table.notes)


def test_a_line_of_words_among_them_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not name the values"):
        read(tmp_path, lambda i: f"I ({100 * i + 300}) RIG: ", text="W (3299) wifi: connected\n")


@pytest.mark.parametrize(
    "prefix",
    [
        lambda i: f"Force ({i}) N: ",
        lambda i: "INFO:rig:" if i % 3 == 0 else "",  # of some lines alone
    ],
)
def test_what_is_no_prefix_of_a_logger_is_not_taken_off(tmp_path: Path, prefix: Prefix) -> None:
    with pytest.raises(InputError):
        read(tmp_path, prefix)


@pytest.mark.parametrize("prefix", [lambda i: f"I ({i}) ", lambda i: f"[{i}][F] "])
def test_a_number_in_a_prefix_of_no_logger_is_a_column_of_its_own(tmp_path: Path, prefix: Prefix) -> None:
    table = read(tmp_path, prefix)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-5)
    assert "time" not in table.columns
    assert any(unread.what.startswith("column 1 ") for unread in table.unread)


def test_a_table_with_a_line_of_a_logger_above_is_read_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    rows = [f"{0.1 * i:.1f},{DEPTH[i]:.4f},{FORCE[i]:.4f}" for i in range(N)]
    above = ["2023-04-12 10:22:31,000 INFO rig: n=60", "Time [s],Extension [mm],Load [N]"]
    path.write_text("\n".join([*above, *rows, ""]), encoding="utf-8")
    table = read_lab_file(path, Reading())
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=6e-5)
    assert not any("logger" in note for note in table.notes)
