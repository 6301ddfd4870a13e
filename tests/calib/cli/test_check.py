"""The command `check`, and the check before a calibration: colours, exit codes, what is written, what stays in a verdict."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_run import QUICK, make_lab
from typer.testing import CliRunner, Result

import calib
from calib.checks import Plausibility, Reason
from calib.cli import app
from calib.runs import load_run
from calib.runs.before import plausibility_of
from calib.runs.calibration import Stages

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor"
CHECKED = replace(QUICK, check=plausibility_of)
ODD = Reason("ball", "red", "with half this radius all would be well", "Measure the ball")
DOUBT = Reason("thicknesses", "amber", "a thickness is doubtful", "Measure it")


def _run(*words: object, stages: Stages | None = None) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words], obj=stages)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small sound experiment."""
    return make_lab(tmp_path_factory.mktemp("lab"))


@pytest.fixture(scope="module")
def in_kilopascals(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with a prior in a wrong unit."""
    folder = make_lab(tmp_path_factory.mktemp("kilo"))
    plan = folder / "experiment.toml"
    plan.write_text(plan.read_text(encoding="utf-8").replace("0.7 MPa", "0.7 kPa"), encoding="utf-8")
    return folder


def test_a_sound_experiment_is_green_and_nothing_is_written(lab: Path) -> None:
    before = sorted(lab.rglob("*"))
    result = _run("check", lab / "experiment.toml")
    assert result.exit_code == 0, result.output
    head, *rest = result.stdout.splitlines()
    assert head.startswith("Green")
    assert rest[-1] == f"Next: calib calibrate {lab / 'experiment.toml'} -o RUN"
    assert rest[-2].startswith("A calibration will take about")
    assert rest[-2].endswith(" on this machine if nothing else runs on it.")
    assert any(line.split()[:1] == ["young_modulus"] and "settled by the data" in line for line in rest)
    assert sorted(lab.rglob("*")) == before


def test_json_says_the_same_for_programs(lab: Path) -> None:
    result = _run("check", lab / "experiment.toml", "--json")
    assert result.exit_code == 0
    said = json.loads(result.stdout)
    assert said["colour"] == "green"
    assert said["reasons"] == []
    (modulus,) = [u for u in said["unknowns"] if u["name"] == "young_modulus"]
    assert modulus["expected_sd"] < modulus["prior_sd"]
    assert {r["seen"] for r in said["ranges"]} == {"force", "depth"}
    low, high = said["seconds"]
    assert 0 < low < high


def test_python_has_the_same(lab: Path) -> None:
    found = calib.check(lab / "experiment.toml")
    assert found.verdict.colour == "green"
    assert found.outlook is not None
    assert found.to_plain()["colour"] == "green"


def test_what_is_impossible_is_red_with_its_slip_and_exit_code_2(in_kilopascals: Path) -> None:
    result = _run("check", in_kilopascals / "experiment.toml")
    assert result.exit_code == 2
    assert result.stdout.startswith("Red")
    assert "Look at the unit of young_modulus: kPa or MPa" in result.stdout
    assert "What the data will tell is not said" in result.stdout


def test_a_line_that_holds_a_guess_is_amber_and_exit_code_3(tmp_path: Path) -> None:
    plan = make_lab(tmp_path) / "experiment.toml"
    text = plan.read_text(encoding="utf-8").replace('radius = "5 mm"', 'radius = "5 mm"  # EDIT: radius of the ball')
    plan.write_text(text, encoding="utf-8")
    result = _run("check", plan)
    assert result.exit_code == 3
    assert result.stdout.startswith("Amber")
    assert "remove the mark EDIT" in result.stdout


def test_what_is_wrong_with_an_input_is_refused_as_ever(lab: Path, tmp_path: Path) -> None:
    text = (lab / "experiment.toml").read_text(encoding="utf-8").replace("force.csv", "gone.csv")
    (tmp_path / "experiment.toml").write_text(text, encoding="utf-8")
    result = _run("check", tmp_path / "experiment.toml")
    assert result.exit_code == 2
    assert "gone.csv" in result.stderr
    assert not result.stdout


def test_the_surrogate_stands_in_for_the_finite_elements(lab: Path, tmp_path: Path) -> None:
    plan = make_lab(tmp_path) / "experiment.toml"
    plan.write_text(plan.read_text(encoding="utf-8").replace("closed form", "fem"), encoding="utf-8")
    found = calib.check(plan)
    assert found.ranges
    assert found.seconds is None


# --- before a calibration -----------------------------------------------------------------------------------------------


def test_red_stops_a_calibration_before_anything_is_written(in_kilopascals: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    result = _run("calibrate", in_kilopascals / "experiment.toml", "-o", run, "--processes", 0, stages=CHECKED)
    assert result.exit_code == 2
    said = " ".join(result.stderr.split())
    assert "Look at the unit of young_modulus: kPa or MPa" in said
    assert "--anyway calibrates all the same" in said
    assert not run.exists()


def test_with_anyway_red_stays_red_in_the_verdict(lab: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    stages = replace(QUICK, check=lambda _: Plausibility((ODD, DOUBT), (), None, None))
    result = _run("calibrate", lab / "experiment.toml", "-o", run, "--processes", 0, "--anyway", stages=stages)
    assert result.exit_code == 3, result.output
    reasons = load_run(run).verdict.reasons
    assert ODD in reasons
    assert DOUBT in reasons
    told = json.loads((run / "summary.json").read_text(encoding="utf-8"))["verdict"]
    assert {"gate": "ball", "level": "red", "finding": ODD.finding, "action": ODD.action} in told["reasons"]


def test_amber_does_not_stop_a_calibration_and_stays_in_the_verdict(lab: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    stages = replace(QUICK, check=lambda _: Plausibility((DOUBT,), (), None, None))
    _run("calibrate", lab / "experiment.toml", "-o", run, "--processes", 0, stages=stages)
    assert DOUBT in load_run(run).verdict.reasons


def test_a_draft_as_it_was_written_is_amber_for_its_marks_and_says_nothing_else(tmp_path: Path) -> None:
    draft = tmp_path / "draft.toml"
    assert _run("init", *sorted(DATASET.glob("sensor1_*.csv")), "-o", draft).exit_code == 0
    result = _run("check", draft)
    assert result.exit_code == 3, result.output
    assert re.search(
        r"experiment file: 1\d lines marked EDIT are unchanged: line \d+ base, line", " ".join(result.stdout.split())
    )
    assert " ".join(result.stderr.split()) == "Exit code 3: something is doubtful; it may be calibrated all the same."


def _again(lines: list[str], first: int, zero: tuple[float, ...], digits: tuple[int, ...]) -> list[str]:
    """Rows of numbers from the first that is wanted on, with columns zeroed anew."""
    rows = [[float(cell) for cell in line.split(",")[: len(zero)]] for line in lines[first:]]
    return [",".join(f"{x - z:.{d}f}" for x, z, d in zip(row, zero, digits, strict=True)) for row in rows]


def _of_two(folder: Path, *entries: str) -> Path:
    """An experiment file of two specimens with such lines of files, beside those of the shipped example."""
    head = (DATASET / "experiment.toml").read_text(encoding="utf-8").split("[[specimens]]", maxsplit=1)[0]
    priors = '[specimens.priors]\nsensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }\n'
    priors += 'padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }\n'
    priors += 'dielectric_thickness = { normal = ["0.160 mm", "0.006 mm"] }\n'
    parts = [f'[[specimens]]\nname = "{name}"\n{entry}\n{priors}' for name, entry in zip("ab", entries, strict=True)]
    path = folder / "experiment.toml"
    path.write_text(head + "\n".join(parts), encoding="utf-8")
    return path


def test_a_record_that_was_cut_and_zeroed_anew_is_no_second_specimen(tmp_path: Path) -> None:
    tester, meter = ((DATASET / f"sensor1_{name}.csv").read_text(encoding="utf-8").splitlines() for name in ("instron", "lcr"))
    for name, lines, copy in (
        ("instron", tester, tester[4:6] + _again(tester[6:], 130, (5.2, -0.0867, -0.411), (4, 4, 3))),
        ("lcr", meter, meter[1:2] + [f"{float(line.split(',')[0]) - 4:.3f},{line.split(',', 1)[1]}" for line in meter[60:]]),
    ):
        (tmp_path / f"one_{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        (tmp_path / f"two_{name}.csv").write_text("\n".join(copy) + "\n", encoding="utf-8")
    files = [f'force = "{name}_instron.csv"\ncapacitance = "{name}_lcr.csv"' for name in ("one", "two")]
    result = _run("check", _of_two(tmp_path, *files))
    assert result.exit_code == 2, result.output
    assert "red, same readings: Files of a and b hold the same readings" in " ".join(result.output.split())


def test_two_presses_in_one_record_are_asked_whether_they_are_of_one_piece(tmp_path: Path) -> None:
    lines = (DATASET / "sensor1_instron.csv").read_text(encoding="utf-8").splitlines()
    noise = np.random.default_rng(5).normal(0.0, 0.004, len(lines))
    end = float(lines[-1].split(",", maxsplit=1)[0]) + 0.04
    again = []
    for line, off in zip(lines[6:], noise, strict=False):
        time, x, force = (float(cell) for cell in line.split(","))
        again.append(f"{time + end:.4f},{x:.4f},{force + off:.3f}")
    (tmp_path / "both.csv").write_text("\n".join([*lines, *again]) + "\n", encoding="utf-8")
    files = [f'force = "both.csv"\nuse = {{ cycles = [{k}] }}' for k in (1, 2)]
    result = _run("check", _of_two(tmp_path, *files))
    said = " ".join(result.output.split())
    assert result.exit_code == 3, result.output
    assert "A and b are presses in one record, both.csv, as of one piece" in said
    assert "Give presses of one piece as sweeps of one specimen" in said
