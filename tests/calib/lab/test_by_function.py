"""Columns `Primary` and `Secondary` of a meter, which a line above says; and lines of settings that are no header."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

N = 60
TIME = np.round(0.2 * np.arange(N), 2)
CP = np.round(97.1 + 2.0 * np.maximum(np.sin(TIME / 4), 0) ** 1.4, 4)
LOSS = np.round(0.002 + 0.0001 * np.sin(TIME), 6)


def written(tmp_path: Path, above: list[str], header: str) -> Path:
    path = tmp_path / "lab.csv"
    rows = [f"{t:.2f},{c * 1e-12:.6E},{d:.6f}" for t, c, d in zip(TIME, CP, LOSS, strict=True)]
    path.write_text("\n".join([*above, header, *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    "line", ["FUNC,Cp-D", "Function: Cp-D", "MODE = Cp/D", "# Measurement function; CP-D", "Parameter,Cp - D"]
)
@pytest.mark.parametrize("header", ["Time(s),Primary,Secondary", "Time (s),PRI,SEC", "Time (s),Primary value,Secondary value"])
def test_a_function_names_what_is_primary_and_secondary(tmp_path: Path, line: str, header: str) -> None:
    path = written(tmp_path, [line, "FREQ,100.000kHz"], header)
    with pytest.raises(InputError, match="has no unit") as error:
        read_lab_file(path)
    assert [fault.message.rpartition('"')[2] for fault in error.value.faults] == [" has no unit"]
    table = read_lab_file(path, Reading(units={"capacitance": "F"}))
    np.testing.assert_allclose(table.columns["capacitance"], CP * 1e-12, rtol=1e-6)
    np.testing.assert_allclose(table.columns["dissipation"], LOSS)
    assert any(note.startswith("capacitance is taken from") and "above says" in note for note in table.notes)


def test_a_series_function_is_converted_by_its_loss(tmp_path: Path) -> None:
    path = written(tmp_path, ["FUNC,Cs-D"], "Time(s),Primary (F),Secondary")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["capacitance"], CP * 1e-12 / (1 + LOSS**2), rtol=1e-6)


@pytest.mark.parametrize("above", [[], ["FUNC,Z-theta"], ["FUNC,Cp-D", "FUNC,Cs-D"], ["FUNC,Ls-Q"]])
def test_without_one_function_nothing_is_known_of_primary(tmp_path: Path, above: list[str]) -> None:
    with pytest.raises(InputError, match=r"no capacitance column|no header"):
        read_lab_file(written(tmp_path, above, "Time(s),Primary,Secondary"))


def test_a_second_head_of_a_block_with_a_label_is_no_row(tmp_path: Path) -> None:
    head = [
        "Data Header:\tTime:\t{}\tSec\t3/12/2024 2:11:05 PM",
        "Station Name: A.cfg",
        "Time\tAxial Force\tAxial Displacement",
        "s\tN\tmm",
    ]
    way = 0.5 - 0.6 * np.cos(np.linspace(0, 2 * np.pi, N))
    rows = [f"{t:.3f}\t{3 * max(x, 0) ** 1.5:.5f}\t{x:.5f}" for t, x in zip(TIME, way, strict=True)]
    path = tmp_path / "press.dat"
    blocks = [[line.format(first) for line in head] + rows[a:b] for first, a, b in (("0.1", 0, 30), ("6.000", 30, N))]
    path.write_text("\n".join(["MTS793|BTW|ENU|1|0|.|/|:|1|0|0|A", "", *blocks[0], "", *blocks[1]]) + "\n")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["time"], TIME)
    assert not any(table.reasons)
    again = [line.format("0.1") for line in head] + rows
    path.write_text("\n".join(["MTS793|BTW|ENU|1|0|.|/|:|1|0|0|A", "", *again, "", *again]) + "\n")
    with pytest.raises(InputError, match=f"1: header at line 5, {N} rows; 2: header at line {N + 10}, {N} rows"):
        read_lab_file(path)
    for specimen in (1, 2):
        assert len(read_lab_file(path, Reading(specimen=specimen)).lines) == N
