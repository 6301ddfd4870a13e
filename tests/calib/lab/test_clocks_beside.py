"""Clocks of names that are not known beside the time, ticks of many digits, axes side by side, files of Campbell's loggers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 120
PLACE = [0.008 * min(i, N - 1 - i) for i in range(N)]
LOAD = [3.0 * max(0.0, x - 0.06) ** 1.5 for x in PLACE]
TIME = [0.1 * i for i in range(N)]
X, F = [f"{x:.4f}" for x in PLACE], [f"{f:.4f}" for f in LOAD]


def seconds(times: Sequence[float]) -> list[str]:
    return [f"{t:.3f}" for t in times]


def read(
    folder: Path,
    head: str,
    columns: Sequence[Sequence[str]],
    below: Sequence[str] = (),
    above: Sequence[str] = (),
    said: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> LabTable:
    path = folder / "press.csv"
    rows = map(",".join, zip(*columns, strict=True))
    path.write_text("\n".join([*above, head, *below, *rows, ""]), encoding="utf-8")
    return read_lab_file(path, Reading(columns=said or {}, units=units or {}))


def why(table: LabTable, name: str) -> str:
    return next(unread.reason for unread in table.unread if f'"{name}"' in unread.what)


# ------------------------------------------------------------------------------------------------------- clocks beside


def test_a_clock_that_goes_on_otherwise_is_told_with_the_option_that_reads_it(tmp_path: Path) -> None:
    head, columns = (
        "PC time (s),Instrument time (s),Displacement (mm),Force (N)",
        [seconds(TIME), seconds([1.05 * t for t in TIME]), X, F],
    )
    table = read(tmp_path, head, columns)
    assert "another clock" in why(table, "Instrument time (s)")
    (note,) = [n for n in table.notes if "is a clock, too" in n]
    assert '--columns "time=Instrument time (s)"' in note
    other = read(tmp_path, head, columns, said={"time": "Instrument time (s)"})
    np.testing.assert_allclose(other.columns["time"], [1.05 * t for t in TIME], atol=1e-3)


@pytest.mark.parametrize(("zero", "words"), [(0.0, "the same times as"), (5.0, "but for their zero")])
def test_a_clock_that_agrees_is_called_so(tmp_path: Path, zero: float, words: str) -> None:
    columns = [seconds(TIME), seconds([t + zero for t in TIME]), X, F]
    table = read(tmp_path, "PC time (s),Instrument time (s),Displacement (mm),Force (N)", columns)
    assert words in why(table, "Instrument time (s)")
    assert not any("a clock, too" in note for note in table.notes)


@pytest.mark.parametrize("first", ["Run Time (s)", "Step Time (s)"])
def test_a_time_that_begins_anew_is_named_beside_one_that_goes_on(tmp_path: Path, first: str) -> None:
    of = {"Run Time (s)": seconds(TIME), "Step Time (s)": seconds([t % 4 for t in TIME])}
    names = sorted(of, key=lambda name: name != first)
    table = read(tmp_path, f"{names[0]},{names[1]},Displacement (mm),Force (N)", [of[names[0]], of[names[1]], X, F])
    np.testing.assert_allclose(table.columns["time"], TIME)
    assert 'begins anew, 2 time(s), while "Run Time (s)" goes on' in why(table, "Step Time (s)")
    assert not any("again and again" in note for note in table.notes)


def test_a_time_that_begins_anew_alone_is_not_read_and_told(tmp_path: Path) -> None:
    table = read(tmp_path, "Step Time (s),Displacement (mm),Force (N)", [seconds([t % 4 for t in TIME]), X, F])
    assert "time" not in table.columns
    assert any("where a clock begins anew" in note for note in table.notes)


def test_a_clock_beside_a_time_without_numbers_is_no_crash(tmp_path: Path) -> None:
    head = "Time (s),Instrument time (s),Displacement (mm),Force (N)"
    with pytest.raises(InputError, match="is not a number"):
        read(tmp_path, head, [["abc"] * N, seconds(TIME), X, F])


# ------------------------------------------------------------------------------------------------------ ticks to the last


@pytest.mark.parametrize(
    ("begin", "words"), [(638_000_000_000_000_000, "the year 1"), (134_000_000_000_000_000, "1601 (FILETIME)")]
)
def test_ticks_keep_their_digits(tmp_path: Path, begin: int, words: str) -> None:
    ticks = [begin + 10_007 * i for i in range(N)]
    table = read(tmp_path, "Time,Displacement (mm),Force (N)", [list(map(str, ticks)), X, F], units={"time": "100 ns"})
    # Seconds since 1970 as numbers of double precision are 0.24 us apart.
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.0010007, atol=3e-7)
    assert any(f"since {words} are read as seconds since 1970" in note for note in table.notes)
    assert table.started is not None
    assert datetime(2010, 1, 1) < table.started < datetime(2036, 1, 1)


# ------------------------------------------------------------------------------------------------ axes by number, units below


@pytest.mark.parametrize("time", ["1", "3"])
@pytest.mark.parametrize("units", ["s,mN,s,um", "[s],[mN],[s],[um]"])
def test_axes_side_by_side_are_read_by_number_in_the_units_below(tmp_path: Path, time: str, units: str) -> None:
    said = {"time": time, "force": "2", "displacement": "4"}
    table = read(tmp_path, "X,Y,X,Y", [seconds(TIME), F, seconds(TIME), X], [units], said=said)
    np.testing.assert_allclose(table.columns["force"], np.array(F, dtype=float) / 1e3)
    np.testing.assert_allclose(table.columns["displacement"], np.array(X, dtype=float) / 1e6)
    assert "the same times" in why(table, "3" if time == "1" else "1")


def test_an_axis_that_differs_is_told_though_columns_are_named(tmp_path: Path) -> None:
    said = {"time": "1", "force": "2", "displacement": "4"}
    columns = [seconds(TIME), F, seconds([0.1 + 1.3 * t for t in TIME]), X]
    table = read(tmp_path, "X,Y,X,Y", columns, ["s,N,s,mm"], said=said)
    assert any('"3" is a clock, too' in note for note in table.notes)


# -------------------------------------------------------------------------------------------------------- Campbell's loggers


def toa5(folder: Path, names: str, units: str, made: str, columns: Sequence[Sequence[str]]) -> LabTable:
    def quoted(cells: str) -> str:
        return ",".join(f'"{cell}"' for cell in cells.split(","))

    stamps = [f'"2026-11-20 10:00:{i // 10:02d}' + (f'.{i % 10}"' if i % 10 else '"') for i in range(N)]
    above = [quoted("TOA5,Rig1,CR6,1234,CR6.Std.10,CPU:press.CR6,4567,Press")]
    below = [quoted(f"TS,RN,{units}"), quoted(f",,{made}")]
    return read(folder, quoted(f"TIMESTAMP,RECORD,{names}"), [stamps, list(map(str, range(N))), *columns], below, above)


@pytest.mark.parametrize(
    ("names", "units", "made"),
    [
        ("Displacement,Force,Batt_V", "um,mN,Volts", "Smp,Smp,Smp"),
        ("Disp_Avg,Force_Avg,PTemp_C", "um,mN,Deg C", "Avg,Avg,Smp"),
        ("Disp(1),Load(1),RH", "um,mN,%", "Smp,Smp,Max"),
        ("Disp,Load,Note", "um,mN,", "Smp,Smp,Smp"),
    ],
)
def test_a_file_of_a_logger_is_read_in_the_units_of_its_third_line(tmp_path: Path, names: str, units: str, made: str) -> None:
    table = toa5(tmp_path, names, units, made, [X, F, ["12.1"] * N])
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], TIME, atol=1e-6)
    np.testing.assert_allclose(table.columns["displacement"], np.array(X, dtype=float) / 1e6)
    np.testing.assert_allclose(table.columns["force"], np.array(F, dtype=float) / 1e3)
    assert not any(table.reasons)
    assert any("what the logger made of its readings" in unread.reason for unread in table.unread)
    assert why(table, names.split(",")[2])


def test_a_statistic_under_a_name_of_readings_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='"Max" stands below "Force"') as error:
        toa5(tmp_path, "Displacement,Force", "mm,N", "Smp,Max", [X, F])
    assert "Empty that cell" in str(error.value)
    table = toa5(tmp_path, "Displacement,Force", "mm,N", "Smp,", [X, F])
    np.testing.assert_allclose(table.columns["force"], np.array(F, dtype=float))
