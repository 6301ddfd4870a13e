"""Files that were refused without a way out: read, or refused with advice that works as it is typed."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
TIMES = [round(0.1 * i, 1) for i in range(N)]
DEPTH = [round(0.0113 * min(i, 40), 4) for i in range(N)]
FORCE = [round(0.5 * x**1.5 + 0.0001 * (i * 7 % 5), 4) for i, x in enumerate(DEPTH)]
CAP = [round(97.3 + 2 * x * x + 0.0003 * (i * 3 % 7), 4) for i, x in enumerate(DEPTH)]
ROWS = list(zip(TIMES, DEPTH, FORCE, CAP, strict=True))
TRUTH = {"time": (TIMES, 1.0), "displacement": (DEPTH, 1e-3), "force": (FORCE, 1.0), "capacitance": (CAP, 1e-12)}


def read(folder: Path, lines: list[str], reading: Reading | None = None) -> LabTable:
    path = folder / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def refusal(folder: Path, lines: list[str], reading: Reading | None = None) -> InputError:
    with pytest.raises(InputError) as caught:
        read(folder, lines, reading)
    return caught.value


def agree(table: LabTable, *quantities: str) -> None:
    for quantity in quantities:
        values, factor = TRUTH[quantity]
        np.testing.assert_allclose(table.columns[quantity], factor * np.array(values), rtol=1e-9, atol=1e-15)


def typed(error: InputError) -> Reading:
    """What the first advice says to type."""
    advice = error.faults[0].advice
    said = {
        option: dict(pair.split("=", 1) for pair in re.findall(rf"--{option} ([\w]+=[\w.]+)", advice))
        for option in ("columns", "units")
    }
    return Reading(columns=said["columns"], units=said["units"])


@pytest.mark.parametrize("setting", ["Measurement Type,Cp", "Measurement type,Cp", "Parameter,Cp", "Function,Cp-D"])
def test_a_setting_above_is_no_header_where_names_stand_right_above_the_rows(tmp_path: Path, setting: str) -> None:
    rows = [f"{k},03/12/2026 14:05:{t + 10:04.1f},{c}E-12" for k, (t, _, _, c) in enumerate(ROWS, 1)]
    table = read(tmp_path, ["Instrument Name,U1733C", setting, "", "Sample,Date and Time,Primary (F)", *rows])
    agree(table, "capacitance")
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=1e-9)


def test_a_setting_above_that_says_a_series_capacitance_is_heeded(tmp_path: Path) -> None:
    rows = [f"{k},03/12/2026 14:05:{t + 10:04.1f},{c}E-12" for k, (t, _, _, c) in enumerate(ROWS, 1)]
    error = refusal(tmp_path, ["Measurement Type,Cs", "", "Sample,Date and Time,Primary (F)", *rows])
    assert '"Primary (F)" is a series capacitance' in str(error)


@pytest.mark.parametrize("mark", [" ", "  ", ", ", "\t"])
@pytest.mark.parametrize("apart", ["", " "])
def test_numbers_with_their_units_alone_are_read_as_advised(tmp_path: Path, mark: str, apart: str) -> None:
    lines = [mark.join(f"{v}{apart}{unit}" for v, unit in zip(row, ("s", "mm", "N"), strict=False)) for row in ROWS]
    error = refusal(tmp_path, lines)
    assert "there is no header, but numbers with their units" in str(error)
    agree(read(tmp_path, lines, typed(error)), "time", "displacement", "force")


def test_a_letter_between_two_numbers_is_the_name_of_the_second_by_its_unit(tmp_path: Path) -> None:
    said = Reading(columns={"time": "1"}, units={"time": "s"})
    table = read(tmp_path, [f"{t} F {f} N z {x} mm" for t, x, f, _ in ROWS], said)
    agree(table, "time", "displacement", "force")
    lines = [f"{t} C {c} pF" for t, _, _, c in ROWS]
    error = refusal(tmp_path, lines)
    assert "--columns time=1 --units time=s" in error.faults[0].advice
    agree(read(tmp_path, lines, said), "time", "capacitance")


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_readings_in_rows_of_their_own_are_refused_with_a_command_that_puts_them_together(tmp_path: Path, mark: str) -> None:
    rows = [
        mark.join((f"{t:.1f}", str(f) if k % 3 == 0 else "", str(x) if k % 3 == 1 else "", str(c) if k % 3 == 2 else ""))
        for k, (t, x, f, c) in enumerate(ROWS)
    ]
    error = refusal(tmp_path, [mark.join(("time_s", "F (N)", "z (mm)", "C (pF)")), *rows])
    assert "no reading in the same row" in str(error)
    command = shlex.split(error.faults[0].advice.split("Python does it: ")[1])
    subprocess.run([sys.executable, *command[1:]], cwd=tmp_path, check=True)
    table = read_lab_file(tmp_path / "new_lab.csv")
    np.testing.assert_allclose(table.columns["force"], np.interp(table.columns["time"], TIMES[::3], FORCE[::3]), atol=1e-9)
    at, places = TIMES[1::3], np.array(DEPTH[1::3])
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * np.interp(table.columns["time"], at, places), atol=1e-9)


@pytest.mark.parametrize("said", ["N ", "G ", "", "NET "])
def test_weights_as_balances_print_them_are_read(tmp_path: Path, said: str) -> None:
    weights = [round(f - 0.005, 4) for f in FORCE]
    rows = [f"{t};{x};{said}{'-' if w < 0 else '+'} {abs(w):8.4f} g" for (t, x, _, _), w in zip(ROWS, weights, strict=True)]
    table = read(tmp_path, ["t_s;z_mm;weight", *rows])
    np.testing.assert_allclose(table.columns["force"], 9.80665e-3 * np.array(weights), atol=1e-12)
    assert any("weights of a balance" in note for note in table.notes)


def test_a_factor_behind_numbers_is_passed_by_once_the_unit_is_said(tmp_path: Path) -> None:
    lines = [f"t={t}s d={x}mm F={100 * f:.2f} x10mN" for t, x, f, _ in ROWS]
    refusal(tmp_path, lines)
    agree(read(tmp_path, lines, Reading(units={"force": "10 mN"})), "time", "displacement", "force")


@pytest.mark.parametrize("cell", ["{c} ± 0.002", "{c}±0.002", "{c} +/- 2e-3"])
def test_how_far_readings_may_be_off_is_passed_by_with_a_note(tmp_path: Path, cell: str) -> None:
    table = read(tmp_path, ["t/s,C / pF", *(f"{t}," + cell.format(c=c) for t, _, _, c in ROWS)])
    agree(table, "time", "capacitance")
    assert any("how far it may be off behind each number is passed by" in note for note in table.notes)


def test_a_tolerance_in_some_cells_alone_is_refused(tmp_path: Path) -> None:
    rows = [f"{t},{c}" + (" ± 0.002" if k % 3 == 0 else "") for k, (t, _, _, c) in enumerate(ROWS)]
    assert "is not a number" in str(refusal(tmp_path, ["t/s,C / pF", *rows]))


def test_the_name_of_the_column_before_each_number_is_passed_by(tmp_path: Path) -> None:
    rows = [f"{1000 * t:.0f},0,CP {c}E-12,D 0.0012,0" for t, _, _, c in ROWS]
    said = Reading(units={"capacitance": "F"})
    agree(read(tmp_path, ["time_ms,status,Cp,D,judge", *rows], said), "time", "capacitance")
    error = refusal(tmp_path, ["time_ms,status,Cp,D,judge", *(row.replace("CP", "LS") for row in rows)], said)
    assert '"LS 97.3' in str(error)


def test_exponents_of_mathematica_are_read_with_a_note(tmp_path: Path) -> None:
    table = read(tmp_path, ["t/s,d/mm,F/N", *(f"{t},{x},{1000 * f:.4f}*^-3" for t, x, f, _ in ROWS)])
    agree(table, "time", "displacement", "force")
    assert any("Mathematica" in note for note in table.notes)


@pytest.mark.parametrize("before", ["msg.header.stamp.", "header.stamp.", "rig_stamp_", ""])
def test_seconds_and_their_parts_under_one_prefix_are_put_together(tmp_path: Path, before: str) -> None:
    rows = [f"{1773324322 + int(t)},{round(t % 1 * 1e9)},{x},{f}" for t, x, f, _ in ROWS]
    table = read(tmp_path, [f"{before}secs,{before}nsecs,z_mm,F_N", *rows])
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=1e-6)


def test_hours_minutes_seconds_and_milliseconds_are_one_time(tmp_path: Path) -> None:
    rows = [f"14,{5 + int(t + 58) // 60},{int(t + 58) % 60},{round(t % 1 * 1000)},{x},{f}" for t, x, f, _ in ROWS]
    table = read(tmp_path, ["h,m,s,ms,z_mm,F_N", *rows])
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=1e-6)


@pytest.mark.parametrize("before", ["T+{t}s: ", "t+{t} s: ", "t + {t} s "])
def test_a_time_behind_t_and_a_plus_is_the_one_since_the_start(tmp_path: Path, before: str) -> None:
    table = read(tmp_path, [f"{before.format(t=t)}F={f} N, z={x} mm" for t, x, f, _ in ROWS])
    agree(table, "time", "displacement", "force")


def test_a_number_filled_up_with_blanks_in_brackets_is_asked_for_its_meaning(tmp_path: Path) -> None:
    lines = [f"[{t:12.6f}] C: {c} pF" for t, _, _, c in ROWS]
    error = refusal(tmp_path, lines)
    assert "--columns time=1 --units time=s" in error.faults[0].advice
    agree(read(tmp_path, lines, Reading(columns={"time": "1"}, units={"time": "s"})), "time", "capacitance")
