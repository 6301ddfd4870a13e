"""Minutes with seconds behind their point are read as such where they prove it, and decimals of a minute as decimals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from models.sensor import FloatArray

N = 150
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 90), np.linspace(1.0, 0.02, 60)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))


def read(tmp_path: Path, time: Sequence[str], name: str = "Time (min)", reading: Reading | None = None) -> LabTable:
    rows = [f"{t};{d:.4f};{f:.4f}" for t, d, f in zip(time, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"{name};Extension (mm);Load (N)", *rows]) + "\n")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize("step", [1, 2, 5, 10, 20])
def test_minutes_and_seconds_are_read_with_a_note(tmp_path: Path, step: int) -> None:
    seconds = step * np.arange(N)
    time = [f"{s // 60}.{s % 60:02d}" for s in seconds]
    table = read(tmp_path, time)
    assert np.array_equal(table.columns["time"] - table.columns["time"][0], seconds)
    assert any("is read as minutes and seconds" in note for note in table.notes)
    decimal = read(tmp_path, time, reading=Reading(units={"time": "min"}))
    assert np.allclose(decimal.columns["time"], 60.0 * np.array(time, float))


@pytest.mark.parametrize("rate", [2, 5, 10])
def test_minutes_and_seconds_of_several_rows_a_second_are_read_with_a_note(tmp_path: Path, rate: int) -> None:
    seconds = 50.0 + np.arange(N) / rate
    whole = [f"{int(s) // 60}.{int(s) % 60:02d}" for s in seconds]
    table = read(tmp_path, whole)
    assert np.array_equal(table.columns["time"] - table.columns["time"][0], seconds // 1 - 50.0)
    assert any("is read as minutes and seconds" in note for note in table.notes)
    if rate == 10:
        table = read(tmp_path, [f"{w}{k % 10}" for k, w in enumerate(whole)])
        assert np.allclose(table.columns["time"] - table.columns["time"][0], seconds - 50.0)


@pytest.mark.parametrize("begin", [0, 35_990, 36_000])
@pytest.mark.parametrize("step", [1, 2, 5, 20])
def test_hours_with_minutes_and_seconds_are_read_with_a_note(tmp_path: Path, step: int, begin: int) -> None:
    seconds = begin + step * np.arange(N)
    time = [f"{s // 3600}.{s // 60 % 60:02d}{s % 60:02d}" for s in seconds]
    for name in ("Time (h)", "Zeit [h]"):
        table = read(tmp_path, time, name)
        assert np.array_equal(table.columns["time"] - table.columns["time"][0], seconds - begin)
        assert any("is read as hours, minutes and seconds" in note for note in table.notes)
    decimal = read(tmp_path, time, reading=Reading(units={"time": "h"}))
    assert np.allclose(decimal.columns["time"], 3600.0 * np.array(time, float))


@pytest.mark.parametrize("step", [0.0001, 0.0002, 0.0005, 0.0025])
def test_decimals_of_an_hour_stay_decimals(tmp_path: Path, step: float) -> None:
    time = 10 + step * np.arange(N)
    assert np.allclose(read(tmp_path, [f"{t:.4f}" for t in time], "Time (h)").columns["time"], 3600.0 * time)


@pytest.mark.parametrize("step", [0.01, 0.02, 0.1, 0.2, 0.25, 0.5])
def test_decimals_of_a_minute_stay_decimals(tmp_path: Path, step: float) -> None:
    time = step * np.arange(N)
    table = read(tmp_path, [f"{t:.2f}" for t in time])
    assert np.allclose(table.columns["time"], 60.0 * time)


def test_seconds_are_no_minutes(tmp_path: Path) -> None:
    time = [f"{k // 60}.{k % 60:02d}" for k in range(N)]
    assert np.allclose(read(tmp_path, time, "Time (s)").columns["time"], np.array(time, float))


def test_hundredths_behind_seconds_are_read_where_the_header_says_so(tmp_path: Path) -> None:
    time = [f"00:{k // 4:02d}:{25 * (k % 4):02d}" for k in range(N)]
    table = read(tmp_path, time, "Time (mm:ss:cs)")
    assert np.allclose(table.columns["time"] - table.columns["time"][0], 0.25 * np.arange(N))


# ------------------------------------------------------------------------------------------- seconds, then minutes and seconds


def _stopwatch(seconds: float) -> str:
    return f"{seconds:.1f}" if seconds < 60 else f"{int(seconds // 60)}:{seconds % 60:04.1f}"


@pytest.mark.parametrize("name", ["Time", "Time (s)", "t"])
@pytest.mark.parametrize("mark", [".", ","])
def test_seconds_that_go_on_as_minutes_and_seconds_are_those_of_a_stopwatch(tmp_path: Path, name: str, mark: str) -> None:
    seconds = 0.5 * np.arange(N)
    table = read(tmp_path, [_stopwatch(s).replace(".", mark) for s in seconds], name)
    assert np.allclose(table.columns["time"] - table.columns["time"][0], seconds)
    assert any("reach a full minute there" in note for note in table.notes)


@pytest.mark.parametrize(
    ("seconds", "name"),
    [
        (np.concatenate([0.5 * np.arange(100), 80.0 + 0.5 * np.arange(50)]), "Time"),
        (np.concatenate([0.1 * np.arange(100), 60.0 + 0.1 * np.arange(50)]), "Time (s)"),
        (0.5 * np.arange(N), "Time (min)"),
    ],
)
def test_seconds_that_do_not_reach_a_full_minute_where_minutes_begin_are_not(
    tmp_path: Path, seconds: FloatArray, name: str
) -> None:
    with pytest.raises(InputError):
        read(tmp_path, [_stopwatch(s) for s in seconds], name)


def test_seconds_with_marks_between_thousands_are_none_of_a_stopwatch(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    cells = [*(f"{k}.5" for k in range(50, 59)), "338,1899.786", "1:00.04", "1:01.04"]
    rows = [f"{t};{0.01 * k:.3f};{0.02 * k:.3f}" for k, t in enumerate(cells)]
    path.write_text("\n".join(["Time (s);Displacement (mm);Force (N)", *rows, ""]), encoding="utf-8")
    with pytest.raises(InputError):
        read_lab_file(path)


# ------------------------------------------------------------------------------------------------- where the unit says so


@pytest.mark.parametrize("name", ["Time (min.s)", "Time (min:s)", "Zeit [mm.ss]", "Time (min,s)", "Time (minutes.seconds)"])
def test_minutes_and_seconds_behind_a_point_are_read_as_their_unit_says(tmp_path: Path, name: str) -> None:
    seconds = np.arange(N) // 3
    table = read(tmp_path, [f"{s // 60}.{s % 60:02d}" for s in seconds], name)
    assert np.array_equal(table.columns["time"], seconds)
    assert any("is read as minutes and seconds" in note for note in table.notes)


@pytest.mark.parametrize("unit", ["min.s", "min:s"])
def test_minutes_and_seconds_behind_a_point_are_read_as_asked(tmp_path: Path, unit: str) -> None:
    seconds = 40 * np.arange(N)
    time = [f"{s // 60}.{s % 60:02d}" for s in seconds]
    for name in ("Time (min)", "Time (min.s)", "Time"):
        assert np.array_equal(read(tmp_path, time, name, Reading(units={"time": unit})).columns["time"], seconds)


def test_hours_and_minutes_behind_a_point_are_read_as_their_unit_says(tmp_path: Path) -> None:
    minutes = 7 * np.arange(N)
    table = read(tmp_path, [f"{m // 60}.{m % 60:02d}" for m in minutes], "Time (h.min)")
    assert np.array_equal(table.columns["time"], 60 * minutes)


def test_what_is_no_minute_with_seconds_is_refused_with_advice_that_works(tmp_path: Path) -> None:
    time = [f"{0.07 * k:.2f}" for k in range(N)]
    with pytest.raises(InputError, match=r'"0\.63" is no time of minutes and two digits of seconds.*--units time=min; else'):
        read(tmp_path, time, "Time (min.s)")
    decimal = read(tmp_path, time, "Time (min.s)", Reading(units={"time": "min"}))
    assert np.allclose(decimal.columns["time"], 60.0 * np.array(time, float))


def test_digits_that_a_spreadsheet_dropped_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="two digits of seconds"):
        read(tmp_path, [f"{s // 60}.{s % 60:02d}".rstrip("0") for s in 5 * np.arange(1, N + 1)], "Time (min.s)")
