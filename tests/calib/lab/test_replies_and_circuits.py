"""What stands before a meter's replies is asked for; the circuit that a file states is found; clocks of messages of robots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.circuit import said_circuit

N = 60
C = 97 + 0.02 * np.minimum(np.arange(N), N - np.arange(N))


def read(path: Path, lines: list[str], **units: str) -> LabTable:
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return read_lab_file(path, Reading(units=units))


@pytest.mark.parametrize(("unit", "step"), [("s", 0.2), ("ms", 200), ("min", 0.003)])
def test_a_number_before_replies_is_asked_for_its_unit(tmp_path: Path, unit: str, step: float) -> None:
    lines = [f"{step * k:g},0,CP {c * 1e-12:.5E},D 0.00120,0" for k, c in enumerate(C)]
    with pytest.raises(InputError, match='"Time" has no unit') as refused:
        read(tmp_path / "lcr.txt", lines)
    assert "--units time=" in str(refused.value)
    table = read(tmp_path / "lcr.txt", lines, time=unit)
    factor = {"s": 1.0, "ms": 1e-3, "min": 60.0}[unit]
    np.testing.assert_allclose(table.columns["time"], [float(f"{step * k:g}") * factor for k in range(N)])
    assert not any("as asked" in note for note in table.notes if "columns are" in note)


def test_a_time_of_day_before_replies_needs_no_unit(tmp_path: Path) -> None:
    lines = [f"2026-03-02 10:00:{0.5 * k:05.2f},0,CP {c * 1e-12:.5E},D 0.00120,0" for k, c in enumerate(C)]
    table = read(tmp_path / "lcr.txt", lines)
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], 0.5 * np.arange(N))


SERIES = (
    "FUNC:IMP CSD",
    "Function,CSD",
    "CSRS",
    "Primary: Cs",
    "Primary,Cs",
    "PRIM: Cs  SEC: D",
    "E4980A CSD 1 kHz",
    "SER.",
    "EQU: SER",
)


@pytest.mark.parametrize("line", [*SERIES, "SER/PAR: SER", "Mode: CSRS", "Equiv. circuit: s"])
def test_a_series_capacitance_is_told_from_the_line_that_says_so(tmp_path: Path, line: str) -> None:
    rows = [f"{0.1 * k:.1f},{c:.4f},0.06" for k, c in enumerate(C)]
    table = read(tmp_path / "lcr.csv", [line, "Time (s),C (pF),D", *rows])
    np.testing.assert_allclose(table.columns["capacitance"], C.round(4) * 1e-12 / (1 + 0.06**2), rtol=1e-9)


@pytest.mark.parametrize("line", ["FUNC:IMP CPD", "CPRP", "Primary: Cp", "SER/PAR: PAR", "PAR.", "Equiv. circuit: p"])
def test_a_parallel_capacitance_stays_what_it_is(tmp_path: Path, line: str) -> None:
    rows = [f"{0.1 * k:.1f},{c:.4f},0.06" for k, c in enumerate(C)]
    table = read(tmp_path / "lcr.csv", [line, "Time (s),C (pF),D", *rows])
    np.testing.assert_allclose(table.columns["capacitance"], C.round(4) * 1e-12)


@pytest.mark.parametrize("name", ["Pojemność szeregowa (pF)", "串聯電容 (pF)", "串联电容 (pF)"])
def test_a_name_says_that_a_capacitance_is_in_series(tmp_path: Path, name: str) -> None:
    rows = [f"{0.1 * k:.1f},{c:.4f},0.06" for k, c in enumerate(C)]
    table = read(tmp_path / "lcr.csv", [f"Time (s),{name},D", *rows])
    np.testing.assert_allclose(table.columns["capacitance"], C.round(4) * 1e-12 / (1 + 0.06**2), rtol=1e-9)


@pytest.mark.parametrize(
    "names", ["header.stamp.sec,header.stamp.nanosec", "header_stamp_secs,header_stamp_nsecs", "stamp.sec,stamp.nanosec"]
)
def test_seconds_and_their_parts_in_the_header_of_a_message_are_one_clock(tmp_path: Path, names: str) -> None:
    t = 0.1 * np.arange(N)
    rows = []
    for k, x in enumerate(t.tolist()):
        depth = 2 - abs(x - 3) / 2
        rows.append(f"{1_772_359_200 + k // 10},{k % 10 * 100_000_000},{depth:.4f},{max(depth - 0.5, 0) ** 2:.4f}")
    table = read(tmp_path / "press.csv", [f"{names},depth (mm),force (N)", *rows])
    np.testing.assert_allclose(table.columns["time"] - table.columns["time"][0], t, atol=2e-6)


@pytest.mark.parametrize(
    "line",
    [
        "CKT: SER",
        "Układ zastępczy: szeregowy",
        "C is series",
        "capacitance is Cs",
        "Cs mode",
        "Modus: seriell",
        "CIRCUIT MODE: S",
    ],
)
def test_more_words_of_a_circuit_in_series(line: str) -> None:
    said = said_circuit([line])
    assert said is not None
    assert said.word == "series"


@pytest.mark.parametrize("line", ["CKT: PAR", "C is Cp", "Cp mode", "Modus: parallel", "Układ: równoległy", "CIRCUIT MODE: P"])
def test_more_words_of_a_circuit_in_parallel(line: str) -> None:
    said = said_circuit([line])
    assert said is not None
    assert said.word == "parallel"


@pytest.mark.parametrize("line", ["Modus: Serie 4", "Test series B", "Operator: S", "Modus: Einzelmessung"])
def test_words_of_no_circuit(line: str) -> None:
    assert said_circuit([line]) is None


def test_the_advice_on_a_series_capacitance_whose_unit_was_said_leads_out(tmp_path: Path) -> None:
    lines = ["Time (s),Cs", *(f"{0.1 * k:.1f},{c:.4f}" for k, c in enumerate(C))]
    with pytest.raises(InputError, match=r"take it as Cp, --columns capacitance=Cs$"):
        read(tmp_path / "lcr.csv", lines, capacitance="pF")
    table = read_lab_file(tmp_path / "lcr.csv", Reading(units={"capacitance": "pF"}, columns={"capacitance": "Cs"}))
    np.testing.assert_allclose(table.columns["capacitance"], C * 1e-12)
