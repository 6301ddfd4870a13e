"""A press and a capacitance in one file, each at a time of its own: of names that are not all understood, too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from calib.errors import InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

N = 90


def read(folder: Path, press: str, meter: str, clock: Callable[[float], float], reading: Reading = AS_FOUND) -> LabTable:
    rows = [f"{press};disp (mm);force (N);{meter};Cp (pF)"]
    for i in range(N):
        t, x = 0.1 * i, 0.01 * min(i, N - 1 - i)
        load = 1.5 * max(0.0, x - 0.05) ** 1.5
        rows.append(f"{t:.2f};{x:.4f};{load:.4f};{clock(t):.2f};{98 + load:.4f}")
    path = folder / "lab.csv"
    path.write_text("\n".join(rows) + "\n")
    return read_lab_file(path, reading)


@pytest.mark.parametrize(
    ("press", "meter"),
    [
        ("t_press (s)", "t_lcr (s)"),
        ("Time press (s)", "Time LCR (s)"),
        ("time_utm (s)", "time_lcr (s)"),
        ("Time Instron (s)", "Time Hioki (s)"),
        ("t_mecmesin (s)", "t_C (s)"),
        ("Time machine (s)", "Time meter (s)"),
    ],
)
@pytest.mark.parametrize("clock", [lambda t: t + 1.37, lambda t: 1.01 * t + 1.37], ids=["begun later", "faster"])
def test_a_second_clock_of_any_name_is_asked_about(
    tmp_path: Path, press: str, meter: str, clock: Callable[[float], float]
) -> None:
    with pytest.raises(InputError, match="may be a time of its own beside") as raised:
        read(tmp_path, press, meter, clock)
    assert "--columns capacitance=none" in str(raised.value)
    alone = Reading(columns={"time": press, "capacitance": "none"})
    table = read(tmp_path, press, meter, clock, alone)
    assert table.columns["time"][[0, 10]] == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize(
    ("name", "clock"),
    [
        ("Step Time lap (s)", lambda t: t % 3.0),  # begins anew
        ("Dwell (s)", lambda t: 5.0),
        ("Time left (s)", lambda t: 9.0 - t),
        ("Uptime box (s)", lambda t: t),  # the same
        ("Heater on (s)", lambda t: 0.1 * t),
    ],
)
def test_another_column_in_seconds_that_is_no_clock_of_the_record_changes_nothing(
    tmp_path: Path, name: str, clock: Callable[[float], float]
) -> None:
    table = read(tmp_path, "Time (s)", name, clock)
    assert table.columns["time"][10] == pytest.approx(1.0)
    assert {"force", "capacitance"} <= set(table.columns)
