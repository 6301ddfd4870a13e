"""Every column beside a press is named by `calib read`, as read or not; counts of cycles are held against the readings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from calib.cli import app
from calib.lab import FIRST_LOADING, Reading, observe, read_lab_file

N, PRESSES = 180, 3
HEAD = ["Time (s)", "Displacement (mm)", "Force (N)", "Capacitance (pF)"]
WAY = 1 - np.abs(np.arange(N) * PRESSES / N % 1 * 2 - 1)
PLACE = 0.8 * WAY - 0.05
LOAD = 3.0 * np.clip(PLACE, 0, None) ** 1.5
COLUMNS = [
    [f"{0.1 * i:.1f}" for i in range(N)],
    [f"{x:.4f}" for x in PLACE],
    [f"{f:.4f}" for f in LOAD],
    [f"{97 + f / 2 + 0.003 * (i * 37 % 11 - 5):.3f}" for i, f in enumerate(LOAD)],
]
COUNT = [str(i * PRESSES // N + 1) for i in range(N)]
KINDS = {
    "constant": (["1"] * N, "Flag|Channel|Averages|Bias|Gain|Run|Test|Bin|Specimen no|Trigger|Point count"),
    "in a unit": (
        ["1000"] * N,
        "F (Hz)|Frequency (Hz)|Freq|Freq (kHz)|Test frequency|V (V)|Rp (ohm)|Theta (deg)|Temp (C)|RH (%)",
    ),
    "counting": ([str(i) for i in range(N)], "Index|No.|Row|Counter|Point|Scan|Nr.|Messpunkt"),
    "of cycles": (COUNT, "Cycle|Cycles|Cycle count|Zyklus|Ciclo|Total cycles|Loop|Segment|Stage|Block"),
    "words": (["OK"] * N, "Status|State|Mode|Note|Operator|Sample|Comment|Comparator|Valid|Range|Unit"),
    "codes": (["0"] * N, "Status|Status code|Error|Overload|Alarm|Stat"),
    "dates": (["2026-11-20"] * N, "Date|Datum|Day"),
    "empty": ([""] * N, "Comment|Remark|Spare|Cycle|Status"),
    "losses": (["0.0010"] * N, "D|Dissipation|tan delta|DF"),
    "quality": (["1000"] * N, "Q|Quality factor"),
    "moving": ([f"{np.sin(i / 7):.3f}" for i in range(N)], "xyz|Strain (%)|Stress (MPa)|Energy (J)|Speed (mm/min)|Level (V)"),
}


def write(folder: Path, name: str, cells: Sequence[str]) -> Path:
    path = folder / "press.csv"
    rows = zip(*COLUMNS, cells, strict=True)
    path.write_text("\n".join([",".join([*HEAD, name]), *map(",".join, rows), ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, (_, names) in KINDS.items() for name in names.split("|")])
def test_a_column_beside_a_press_is_named(tmp_path: Path, kind: str, name: str) -> None:
    path = write(tmp_path, name, KINDS[kind][0])
    shown = CliRunner().invoke(app, ["read", str(path)], env={"COLUMNS": "250"})
    assert shown.exit_code == 0, shown.output
    named = [line for line in shown.output.splitlines()[1:] if f'"{name}"' in line or f"│ {name} " in line]
    assert named, shown.output


def notes_on(folder: Path, cells: Sequence[str], name: str = "Cycle", where: str = "") -> list[str]:
    reading = Reading(where={name: where} if where else {})
    seen = observe(read_lab_file(write(folder, name, cells), reading), FIRST_LOADING)
    return [note for note in seen.use_notes if f'"{name}"' in note]


def test_a_count_of_cycles_that_agrees_needs_no_words(tmp_path: Path) -> None:
    assert not notes_on(tmp_path, COUNT)
    assert not notes_on(tmp_path, [f"{c}.0" for c in COUNT])


@pytest.mark.parametrize("begins", [0, 7])
def test_a_count_that_begins_elsewhere_says_what_cycles_means(tmp_path: Path, begins: int) -> None:
    (note,) = notes_on(tmp_path, [str(int(c) - 1 + begins) for c in COUNT])
    assert f"--cycles 1 is its {begins}" in note


@pytest.mark.parametrize(("numbers", "of"), [("1 alone", 1), ("2 numbers (1 to 2)", 2), ("6 numbers (1 to 6)", 6)])
def test_a_count_of_more_or_fewer_cycles_is_told(tmp_path: Path, numbers: str, of: int) -> None:
    cells = [str(i * of // N + 1) for i in range(N)]
    (note,) = notes_on(tmp_path, cells)
    assert numbers in note
    assert "the readings show 3 presses: --cycles counts these" in note
    if of > 1:
        assert "--where Cycle=1" in note
        assert notes_on(tmp_path, cells, where="1") is not None
