"""What is said of lab files is read as it was written, and a first experiment goes by it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from calib.cli import app
from calib.errors import InputError
from calib.experiment import Said, read_experiment, read_said, said_toml
from calib.lab import Reading, Use

PRESS = "Displacement,Load\n" + "\n".join(f"{0.01 * k:.2f},{max(0.0, 0.01 * k - 0.2) ** 1.5:.4f}" for k in range(100)) + "\n"


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    said = {
        tmp_path / "lab" / 'a "b".csv': Said(
            Reading({"force": "kN"}, {"time": "3"}, 2, {"Frequency (Hz)": "1000"}, "Test 1", {"force": "compression negative"}),
            Use(5.0, 0.8e-3, "unloading", (2, 3)),
        ),
        tmp_path / "c.csv": Said(Reading(scale="micro", decimal=",")),
    }
    (tmp_path / "said.toml").write_text(said_toml(said, tmp_path), encoding="utf-8")
    assert read_said(tmp_path / "said.toml") == said


def test_every_fault_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "said.toml").write_text('[files."a.csv"]\nunit = "N"\nuse = { cycles = "two" }\n', encoding="utf-8")
    with pytest.raises(InputError) as refusal:
        read_said(tmp_path / "said.toml")
    assert [fault.line for fault in refusal.value.faults] == [2, 3]


def test_a_first_experiment_goes_by_what_is_said(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text(PRESS, encoding="utf-8")
    lines = '[files."press.csv"]\nunits = { displacement = "mm", force = "N" }\nuse = { max_force = "0.5 N" }\n'
    (tmp_path / "said.toml").write_text(lines, encoding="utf-8")
    words = ["init", str(tmp_path / "press.csv"), "--said", str(tmp_path / "said.toml"), "-o", str(tmp_path / "e.toml")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    sweep = read_experiment(tmp_path / "e.toml").specimens[0].sweeps[0]
    assert sweep.force_reading.units == {"displacement": "mm", "force": "N"}
    assert sweep.use == Use(max_force=0.5)
