"""Names as programs and loggers write them are read: of runs, of R, with a formula's symbol, with the label of a channel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, SeveralSpecimens, read_lab_file
from calib.lab.instruments.vocabulary import understand

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))


def read(tmp_path: Path, header: str, *columns: np.ndarray, reading: Reading | None = None) -> LabTable:
    rows = [";".join(f"{column[k]:.4f}" for column in columns) for k in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    "header",
    [
        "Data Set 1:Time(s);Data Set 1:Distance(mm);Data Set 1:Force(N)",
        "Latest: Time (s);Latest: Position (mm);Latest: Force (N)",
        "Run 1: Time (s);Run 1: Position (mm);Run 1: Force (N)",
        "Zeit t [s];Weg s [mm];Kraft F [N]",
        "Time t (s);Indentation depth h (mm);Normal force F_n (N)",
        "Time (s);Displacement/AVE (mm);Force/AVE (N)",
        "Time (s);102 <Disp> (mm);101 <Force> (N)",
        "Time.s;Displacement.mm;Force.N",
        "Time (s);Pd [mm];Fn [N]",
        '"Full Scale Load Range (N): 10"\nTime (s);Extension (mm);Load (N)',
    ],
)
def test_it_is_read_to_the_right_numbers(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, TIME, DEPTH, FORCE)
    assert np.allclose(table.columns["time"], TIME, atol=1e-4)
    assert np.allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "force",
    ["Kraft N [mN]", "Max: Force (N)", "Force/MAX (N)", "Force.A", "Load m (N)", "101 <Force> (N);102 <Force> (N)", "Max.N"],
)
def test_what_is_two_units_a_statistic_or_one_of_two_is_not(tmp_path: Path, force: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, f"Time (s);Extension (mm);{force}", TIME, DEPTH, *[FORCE * (1 + k) for k in range(1 + force.count(";"))])


def test_runs_side_by_side_are_specimens_to_choose_from(tmp_path: Path) -> None:
    header = ";".join(f"Data Set {k}:{name}" for k in (1, 2) for name in ("Time(s)", "Distance(mm)", "Force(N)"))
    columns = (TIME, DEPTH, FORCE, TIME + 0.01, 1.1 * DEPTH, 1.3 * FORCE)
    with pytest.raises(SeveralSpecimens):
        read(tmp_path, header, *columns)
    table = read(tmp_path, header, *columns, reading=Reading(specimen=2))
    assert np.allclose(table.columns["force"], 1.3 * FORCE, atol=1e-4)


def test_a_capacitance_between_the_terminals_of_a_card() -> None:
    heading = understand("Cp_AB", "F")
    assert heading is not None
    assert heading.quantity == "capacitance"


def test_a_factor_of_full_scale_is_still_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="factor"):
        read(tmp_path, "Load scale factor: 10\nTime (s);Extension (mm);Load (N)", TIME, DEPTH, FORCE)
