"""The commands as a lab engineer meets them: results, messages, exit codes, and nothing left behind after bad input."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import typer
from damaged import calib_with, copy_models
from small_run import BLOCK, QUICK, in_small_steps
from typer.testing import CliRunner, Result

from calib.catalogue import UNKNOWNS
from calib.checks import Elsewhere
from calib.cli import app, common
from calib.cli.common import refusing_bad_input
from calib.cli.surrogate import STEPS, FamilyName
from calib.decision.requirement import Requirement
from calib.experiment.experiment_file import read_experiment
from calib.problem.problem import Problem
from calib.runs.calibration import Stages, calibrate
from calib.runs.folder import load_recommendation, load_run
from calib.runs.page import page_of
from calib.runs.renewed import recommend_in
from calib.sampling.diagnostics import Gate
from calib.sampling.posterior import Posterior
from calib.sampling.sampler import sample
from models.analytic import ClosedForm
from models.examples import PAPER_SENSOR
from models.response import ConvergenceError
from models.sensor import FloatArray, design_from
from models.surrogate import FAMILIES, fitting
from models.surrogate.points import design_points, random_groups
from models.surrogate.store import open_store
from models.surrogate.surrogate import load_surrogate
from models.surrogate.training import run_point, store_settings

pytestmark = pytest.mark.usefixtures("all_undrawn")

DESIGN = """
[indenter]
radius = "5 mm"
[sensor]
thickness = "0.74 mm"
radius = "10 mm"
young_modulus = "0.69 MPa"
relative_permittivity = 2.8
[padding]
thickness = "1.10 mm"
"""
EXPERIMENT = """
name = "One specimen"
model = "closed form"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[priors]
young_modulus = { lognormal = ["0.7 MPa", 1.6] }
[[specimens]]
name = "sensor 1"
force = "force.csv"
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
"""


def _run(*words: object, stages: Stages | None = None) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words], obj=stages)


def _said(result: Result) -> str:
    """What was said on stderr, on one line."""
    return " ".join(result.stderr.split())


def test_no_command_leaves_with_3_but_by_saying_why() -> None:
    # That is `not_usable`, whose sentence is the last on standard error; what the sentences say is tested with each command.
    texts = {path.name: path.read_text(encoding="utf-8") for path in Path(common.__file__).parent.glob("*.py")}
    assert [name for name, text in texts.items() if "NOT_USABLE" in text] == ["common.py"]
    assert texts["common.py"].count("Exit(NOT_USABLE)") == 1


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an experiment and its lab files, drawn from the closed form."""
    folder = tmp_path_factory.mktemp("lab")
    rng = np.random.default_rng(5)
    values = {"young_modulus": 0.62e6, "sensor_thickness": 0.74e-3, "padding_thickness": 1.1e-3, "relative_permittivity": 2.8}
    design = design_from({**values, "indenter_radius": 5e-3, "sensor_radius": 10e-3})
    depth = np.linspace(-0.05e-3, 0.6e-3, 240)
    r = ClosedForm().respond(design, depth)
    force = r.force + 0.03 + rng.normal(0, 0.01, depth.size)
    capacitance = r.capacitance + rng.normal(0, 5e-15, depth.size)
    table = pd.DataFrame({"Displacement (mm)": 1e3 * depth + 0.05, "Force (N)": force})
    table.to_csv(folder / "force.csv", index=False, float_format="%.6f")
    lcr = pd.DataFrame({"Force (N)": force, "Capacitance (pF)": 1e12 * capacitance})
    lcr.to_csv(folder / "lcr.csv", index=False, float_format="%.6f")
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")
    (folder / "design.toml").write_text(DESIGN, encoding="utf-8")
    return folder


@pytest.fixture
def lab(made: Path, tmp_path: Path) -> Path:
    """A fresh copy of that folder."""
    for file in made.iterdir():
        if file.is_file():
            (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def _brief(steps: int) -> Stages:
    """Stages of a calibration that is not allowed more steps, however long they take."""

    def sampled(problem: Problem, **options: Any) -> Posterior:
        with in_small_steps():
            return sample(problem, **{**options, "max_steps": steps, "max_seconds": math.inf, "gate": Gate(ess=1e9)})

    return Stages(sample=sampled, check=lambda _: None)


def _made(sample: Callable[..., Posterior], **others: Any) -> Stages:
    """Stages of a calibration that is given its posterior, of which nothing else is asked."""
    return replace(QUICK, **{"sample": sample, "page": page_of, **others})


@pytest.fixture(scope="module")
def finished(made: Path) -> tuple[Path, Result]:
    """A calibration that had no time to converge."""
    run = made / "run"
    return run, _run("calibrate", made / "experiment.toml", "-o", run, "--processes", 0, "--seed", 4, stages=_brief(BLOCK))


# --- calibrate, report, recommend ---------------------------------------------------------------------------------------


def test_unconverged_calibration_exits_with_3_writes_everything_and_says_so(finished: tuple[Path, Result]) -> None:
    run, result = finished
    assert result.exit_code == 3, result.output
    assert {p.name for p in run.iterdir()} == {
        *("as_calibrated.toml", "posterior.nc", "summary.json", "summary.csv", "report.html", "run.json", "checkpoint")
    }
    longer = f"calib calibrate {run.parent / 'experiment.toml'} -o {run} --resume --seed 4 --budget 30 --processes 0"
    assert result.stdout.splitlines()[-1] == f"Continue with: {longer}"
    summary = json.loads((run / "summary.json").read_text())
    assert summary["converged"] is False
    assert summary["surrogate_honest"] is not False
    assert summary["reasons"]
    assert summary["seed"] == 4
    assert summary["verdict"]["colour"] == "red"
    assert "red, convergence: The chains have not converged" in result.stdout
    assert "no result: of the draws" in " ".join(result.stdout.split())
    assert "the chains have not converged" in (run / "report.html").read_text(encoding="utf-8")


def test_recommend_writes_json_and_a_section_in_the_report(finished: tuple[Path, Result]) -> None:
    run, _ = finished
    result = _run("recommend", run, "--force", "3 N", "--padding", "0.5 mm:3 mm", "--steps", 6, "--draws", 60)
    assert result.exit_code == 3, result.output
    recommendation = json.loads((run / "recommendation.json").read_text(encoding="utf-8"))
    assert recommendation["thickness"][0] == pytest.approx(0.5e-3)
    assert len(recommendation["thickness"]) == 6
    assert recommendation["verdict"]["colour"] == "red"
    assert result.stdout.startswith("Do not build on this: the chains have not converged")
    assert " mm" not in result.stdout  # no thickness that one might build
    assert "MPa" not in result.stdout
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "No padding is recommended" in page
    assert "What padding to build next" not in page


SPEC = """
name = "Finger tip"
[loads]
force = ["1 N", "3 N"]
[limits]
signal = { at_least = 0.01, at = "3 N" }
stroke = { at_most = "0.9 mm" }
[padding]
thickness = ["0.5 mm", "3 mm"]
steps = 6
tolerance = { uniform = "0.05 mm" }
gauge = "0.01 mm"
"""


def test_recommend_for_a_specification_writes_json_a_table_and_a_section(finished: tuple[Path, Result], tmp_path: Path) -> None:
    run, _ = finished
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC, encoding="utf-8")
    result = _run("recommend", run, "--spec", spec, "--draws", 60)
    assert result.exit_code == 3, result.output
    assert result.stdout.startswith("Do not build on this: the chains have not converged")
    kept = json.loads((run / "recommendation.json").read_text(encoding="utf-8"))
    assert kept["conformity"]["specification"]["name"] == "Finger tip"
    assert kept["requirement"]["force"] == 3
    assert kept["verdict"] == kept["conformity"]["verdict"]
    table = pd.read_csv(run / "specification.csv")
    assert table["thickness_m"].tolist() == pytest.approx(np.linspace(0.5e-3, 3e-3, 6))
    page = (run / "report.html").read_text(encoding="utf-8")
    assert " mm" not in result.stdout.replace("0.5 to 3 mm of padding that was in", "")  # but in what was asked before
    assert "No padding is recommended" in page
    assert "Specification: Finger tip" not in page
    assert _run("verify", run).exit_code == 0
    again = _run("recommend", run, "--force", "3 N", "--padding", "0.5 mm:3 mm", "--steps", 6, "--draws", 60)
    assert again.exit_code == 3
    assert "It takes the place of the advice for a specification (signal" in again.stdout
    assert not (run / "specification.csv").exists()
    assert "Specification: Finger tip" not in (run / "report.html").read_text(encoding="utf-8")


def test_recommend_says_what_is_missing_or_doubled(finished: tuple[Path, Result], tmp_path: Path) -> None:
    run, _ = finished
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC.replace("at_least = 0.01", "at_least = 8"), encoding="utf-8")
    for words, message in (
        ((), "nothing says what the padding is for"),
        (("--spec", spec, "--force", "3 N"), "--force beside --spec: the specification says it. Leave --force out"),
        (("--spec", spec, "--padding", "0 mm:3 mm", "--steps", "5"), "--padding, --steps beside --spec"),
        (("--spec", spec), "spec.toml:6:1: signal must be below 1, got 800 %"),
        (("--spec", tmp_path / "none.toml"), "file not found"),
    ):
        result = _run("recommend", run, *words)
        assert result.exit_code == 2
        assert message in _said(result)


def test_next_ranks_measurements_keeps_them_and_drafts_an_experiment_that_is_never_overwritten(
    finished: tuple[Path, Result],
) -> None:
    run, _ = finished
    draft = run.parent / "next.toml"
    result = _run("next", run, "--draft", draft)
    assert result.exit_code == 3, result.output
    assert result.stdout.startswith("Do not plan by this: the chains have not converged")
    record = json.loads((run / "next.json").read_text(encoding="utf-8"))
    assert record["verdict"]["colour"] == "red"
    assert record["ranked"][0]["what"] in " ".join(draft.read_text(encoding="utf-8").split())
    assert "not judged: slower and faster presses" in result.stdout
    assert _run("verify", run).exit_code == 0
    again = _run("next", run, "--draft", draft)
    assert again.exit_code == 2
    assert "is not overwritten" in _said(again)
    draft.unlink()


def test_next_for_padding_needs_a_load_and_takes_that_of_the_recommendation(finished: tuple[Path, Result]) -> None:
    run, _ = finished
    (run / "recommendation.json").unlink(missing_ok=True)
    refused = _run("next", run, "--for", "padding")
    assert refused.exit_code == 2
    assert "nothing says at which load the signal counts" in _said(refused)
    assert _run("next", run, "--for", "padding", "--force", "3 N", "--padding", "1 mm").exit_code == 2
    assert "--padding goes with --force" in _run("next", run, "--for", "padding", "--padding", "0 mm:1 mm").stderr
    assert "are of --for padding" in _run("next", run, "--force", "3 N").stderr
    assert _run("recommend", run, "--force", "3 N", "--padding", "0.5 mm:3 mm", "--steps", 6, "--draws", 60).exit_code == 3
    asked = _run("next", run, "--for", "padding")
    assert asked.exit_code == 3, asked.output
    assert "ignal at 3 N on" in asked.stdout


def test_next_for_a_specification_takes_its_file_or_that_of_the_recommendation(
    finished: tuple[Path, Result], tmp_path: Path
) -> None:
    run, _ = finished
    (run / "recommendation.json").unlink(missing_ok=True)
    refused = _run("next", run, "--for", "spec")
    assert refused.exit_code == 2
    assert "nothing says which specification is to be met" in _said(refused)
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC, encoding="utf-8")
    assert "--spec is of --for spec" in _said(_run("next", run, "--spec", spec))
    asked = _run("next", run, "--for", "spec", "--spec", spec)
    assert asked.exit_code == 3, asked.output
    assert "held back" in asked.stdout
    assert "rests on: a sensor that is released and does not conform costing" in asked.stdout
    record = json.loads((run / "next.json").read_text(encoding="utf-8"))
    assert record["for"] == "spec"


def test_report_can_be_made_anew(finished: tuple[Path, Result]) -> None:
    run, _ = finished
    (run / "report.html").unlink()
    assert _run("report", run).exit_code == 3
    assert "sensor 1" in (run / "report.html").read_text(encoding="utf-8")


def test_resumed_run_goes_on_with_its_seed(finished: tuple[Path, Result]) -> None:
    run, _ = finished
    steps = len(list((run / "checkpoint").iterdir()))
    experiment = run.parent / "experiment.toml"
    result = _run("calibrate", experiment, "-o", run, "--resume", "--processes", 0, stages=_brief(2 * BLOCK))
    assert result.exit_code == 3, result.output
    assert len(list((run / "checkpoint").iterdir())) >= steps
    assert json.loads((run / "summary.json").read_text())["seed"] == 4


def test_converged_calibration_exits_with_0(lab: Path, make_posterior: Callable[..., Posterior]) -> None:
    stages = Stages(sample=lambda *_, **__: make_posterior(n_specimen=1), check=lambda _: None)
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run", "--processes", 0, stages=stages)
    assert result.exit_code == 0, result.output
    assert json.loads((lab / "run" / "summary.json").read_text())["converged"] is True
    assert "sensor_thickness[sensor 1]" in result.stdout


def test_a_dishonest_surrogate_exits_with_3_and_advice_that_can_help(
    lab: Path, make_posterior: Callable[..., Posterior]
) -> None:
    stages = _made(lambda *_, **__: make_posterior(n_specimen=1, honest=False))
    run = lab / "run"
    result = _run("calibrate", lab / "experiment.toml", "-o", run, stages=stages)
    assert result.exit_code == 3, result.output
    said = " ".join(result.stdout.split())
    assert "Red: do not use the numbers." in said
    assert "9.0 and 0.9 times the error it states" in said
    assert "calib surrogate refine" in said
    assert 'model = "fem"' in said
    assert "--resume" not in said
    summary = json.loads((run / "summary.json").read_text())
    assert summary["converged"] is True
    assert summary["surrogate_honest"] is False
    assert len(summary["reasons"]) == 1
    assert _run("report", run).exit_code == 3
    recommended = _run("recommend", run, "--force", "3 N", "--padding", "0.5 mm:3 mm", "--steps", 6, "--draws", 60)
    assert recommended.exit_code == 3, recommended.output
    assert recommended.stdout.startswith("Do not build on this: at 12 loading curves of the posterior the closed form is off")


def test_a_run_that_neither_converged_nor_has_an_honest_model_gets_both_pieces_of_advice(
    lab: Path, make_posterior: Callable[..., Posterior]
) -> None:
    unmet = make_posterior(converged=False, n_specimen=1, honest=False)
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run", stages=_made(lambda *_, **__: unmet))
    assert result.exit_code == 3, result.output
    said = " ".join(result.stdout.split())
    assert all(words in said for words in ("chains have not converged", "--resume", "calib surrogate refine"))


def test_lines_still_marked_edit_are_told_before_sampling_and_kept(lab: Path, make_posterior: Callable[..., Posterior]) -> None:
    path = lab / "experiment.toml"
    marked = EXPERIMENT.replace('radius = "5 mm"', 'radius = "5 mm"  # EDIT: half its diameter')
    path.write_text(marked.replace('"0.7 MPa", 1.6] }', '"0.7 MPa", 1.6] }  # EDIT: from the datasheet'), encoding="utf-8")

    def sampled(problem: Problem, **_: object) -> Posterior:
        return replace(make_posterior(n_specimen=1), experiment=problem.experiment)

    stages = _made(sampled)
    result = _run("calibrate", path, "-o", lab / "run", stages=stages)
    assert result.exit_code == 0, result.output
    words = "1 line marked EDIT is unchanged: line 5 indenter radius"
    assert result.stdout.startswith(f"Warning: {words}\n")
    verdict = json.loads((lab / "run" / "summary.json").read_text())["verdict"]
    assert verdict["colour"] == "amber"
    assert [r["finding"] for r in verdict["reasons"] if r["gate"] == "experiment file"] == [words]
    report = (lab / "run" / "report.html").read_text(encoding="utf-8")
    assert "Guesses of the draft are taken as measured" in report
    assert f"In experiment.toml {words}" in report
    path.write_text(EXPERIMENT, encoding="utf-8")  # a run knows what it was made from
    assert _run("report", lab / "run").exit_code == 0
    assert words in (lab / "run" / "report.html").read_text(encoding="utf-8")
    result = _run("calibrate", path, "-o", lab / "run2", stages=stages)
    assert "EDIT" not in result.stdout
    assert "EDIT" not in (lab / "run2" / "summary.json").read_text()


def _stopped(*_: object, **__: object) -> Posterior:
    raise KeyboardInterrupt


def test_stopping_from_the_keyboard_keeps_the_run_and_says_how_to_go_on(lab: Path) -> None:
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run", "--seed", 9, stages=_made(_stopped))
    assert result.exit_code == 130
    assert "--resume" in _said(result)
    record = json.loads((lab / "run" / "run.json").read_text())
    assert (record["kind"], record["format"], record["seed"]) == ("run", 2, 9)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--force", "3"), '--force: "3" has no unit'),
        (("--force", "3 mm"), "--force"),
        (("--force", "3 N", "--padding", "5 mm"), 'not a range. Write it as "0 mm:9 mm"'),
        (("--force", "3 N", "--padding", "5 mm:1 mm"), "padding range is empty: 5 mm to 1 mm"),
        (("--force", "900 N"), "reaches 900 N at no padding from 0 to 9 mm"),
    ],
)
def test_recommend_refuses_a_request_it_cannot_answer(
    finished: tuple[Path, Result], words: tuple[str, ...], message: str
) -> None:
    run, _ = finished
    before = {p: p.stat().st_mtime_ns for p in run.iterdir()}
    result = _run("recommend", run, *words, "--draws", 60, "--steps", 5)
    assert result.exit_code == 2
    assert message in _said(result)
    assert {p: p.stat().st_mtime_ns for p in run.iterdir()} == before


def test_recommend_and_report_say_when_there_is_no_calibration(tmp_path: Path) -> None:
    for words in (("report", tmp_path), ("recommend", tmp_path, "--force", "3 N")):
        result = _run(*words)
        assert result.exit_code == 2
        assert "no finished calibration in this folder (no posterior.nc). Run `calib calibrate` first" in _said(result)


# --- bad input ----------------------------------------------------------------------------------------------------------


def _replace(file: str, old: str, new: str, lab: Path) -> None:
    path = lab / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


BAD = {
    "missing file": (("experiment.toml", "force.csv", "forze.csv"), "forze.csv"),
    "missing column": (("force.csv", "Displacement (mm)", "Mood"), "displacement"),
    "unknown unit": (("force.csv", "Force (N)", "Force (Nn)"), "Nn"),
    "negative thickness": (("experiment.toml", '"0.74 mm", "0.02', '"-0.74 mm", "0.02'), "-0.74 mm"),
    "prior outside the model's range": (("experiment.toml", '"1.10 mm", "0.03 mm"', '"0.10 mm", "0.003 mm"'), "covers"),
    "text in a number": (("force.csv", "\n", "\n0.1,sensor fell off\n"), "sensor fell off"),
    "unreadable TOML": (("experiment.toml", "[sensor]", "[sensor"), "experiment.toml:6"),
    "unknown key": (("experiment.toml", "young_modulus", "yuong_modulus"), "young_modulus"),
    "bare number": (("experiment.toml", '"5 mm"', "5"), "mm"),
    "no unit in a prior": (("experiment.toml", '"0.7 MPa"', "0.7"), "MPa"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_exits_with_2_says_what_to_do_and_leaves_nothing_behind(lab: Path, kind: str) -> None:
    (file, old, new), message = BAD[kind]
    _replace(file, old, new, lab)
    before = set(lab.rglob("*"))
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run")
    assert result.exit_code == 2, result.output
    assert _said(result).startswith("Error: ")
    assert message in _said(result)
    assert "Traceback" not in result.stderr
    assert set(lab.rglob("*")) == before


def test_empty_lab_file_exits_with_2(lab: Path) -> None:
    (lab / "force.csv").write_text("", encoding="utf-8")
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run")
    assert result.exit_code == 2
    assert "force.csv" in _said(result)
    assert "empty" in _said(result)
    assert not (lab / "run").exists()


def test_all_faults_of_an_experiment_are_said_at_once(lab: Path) -> None:
    _replace("experiment.toml", '"5 mm"', '"-5 mm"', lab)
    _replace("experiment.toml", '"0.74 mm", "0.02', '"0.74", "0.02', lab)
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run")
    assert result.exit_code == 2
    assert result.stderr.count("Error: ") == 2


def test_existing_output_folder_is_not_touched(lab: Path) -> None:
    run = lab / "run"
    run.mkdir()
    (run / "precious.txt").write_text("keep", encoding="utf-8")
    result = _run("calibrate", lab / "experiment.toml", "-o", run)
    assert result.exit_code == 2
    assert "this folder holds other files" in _said(result)
    assert f"exists and is not overwritten. Choose another -o, such as {run / 'run1'}" in _said(result)
    assert "--resume" not in _said(result)
    assert [p.name for p in run.iterdir()] == ["precious.txt"]


def test_existing_run_is_not_touched_and_can_be_resumed(finished: tuple[Path, Result], lab: Path) -> None:
    run, _ = finished
    result = _run("calibrate", lab / "experiment.toml", "-o", run)
    assert result.exit_code == 2
    assert "exists and is not overwritten. Choose another -o, or continue that run with --resume" in _said(result)


def test_resuming_what_was_never_begun_is_refused(lab: Path) -> None:
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run", "--resume")
    assert result.exit_code == 2
    assert "there is no run to resume" in _said(result)
    (lab / "run").mkdir()
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run", "--resume")
    assert result.exit_code == 2
    assert "not written by `calib calibrate`" in _said(result)


def test_resuming_with_other_data_is_refused_and_keeps_the_run(finished: tuple[Path, Result], lab: Path) -> None:
    run, _ = finished
    before = {p: p.read_bytes() for p in run.rglob("*") if p.is_file()}
    _replace("experiment.toml", '"0.7 MPa"', '"0.8 MPa"', lab)
    result = _run("calibrate", lab / "experiment.toml", "-o", run, "--resume", "--budget", 0.001, "--processes", 0)
    assert result.exit_code == 2
    was, now = (f'"log-normal, median {median} MPa, factor 1.6"' for median in (0.7, 0.8))
    assert f"prior of young_modulus was {was} and is {now} now" in _said(result)
    assert {p: p.read_bytes() for p in run.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize("model", ["closed form", "fem"])
def test_a_surrogate_file_that_the_model_would_not_use_is_refused(lab: Path, model: str) -> None:
    _replace("experiment.toml", '"closed form"', f'"{model}"', lab)
    load_surrogate().save(lab / "mine.npz")
    result = _run("calibrate", lab / "experiment.toml", "-o", lab / "run", "--surrogate", lab / "mine.npz")
    assert result.exit_code == 2
    said = f'a surrogate file is given, but the model is "{model}", which uses none. Leave --surrogate out, or choose the model'
    assert said in _said(result)
    assert not (lab / "run").exists()
    words = ("simulate", lab / "design.toml", "--force", "1 N", "-o", lab / "c.csv", "--model", model.replace(" ", "-"))
    result = _run(*words, "--surrogate", lab / "mine.npz")
    assert result.exit_code == 2
    assert "a surrogate file is given" in _said(result)
    assert not (lab / "c.csv").exists()


def test_a_closed_form_asked_of_thick_layers_says_that_it_is_rough(finished: tuple[Path, Result], lab: Path) -> None:
    run, _ = finished
    rough = "the errors that it states hold up to a total thickness of 0.25 disc radii"
    for padding, said in (("0.5 mm:1.5 mm", False), ("0.5 mm:2 mm", True), ("20 mm:30 mm", True)):
        _run("recommend", run, "--force", "2 N", "--padding", padding, "--steps", 3, "--draws", 50)
        assert (rough in (run / "recommendation.json").read_text(encoding="utf-8")) is said
        assert (rough in (run / "report.html").read_text(encoding="utf-8")) is said
    words = ("simulate", lab / "design.toml", "--force", "1 N", "-o", lab / "c.csv", "--model", "closed-form")
    assert rough not in _said(_run(*words))
    _replace("design.toml", '"1.10 mm"', '"20 mm"', lab)
    assert f"Warning: the closed form takes the layers as far wider than thick, and {rough}" in _said(_run(*words))


def test_a_lab_file_that_is_not_there_is_answered_with_those_that_are(lab: Path) -> None:
    result = _run("read", lab / "fource.csv")
    assert result.exit_code == 2
    assert "No such file or directory. CSV files in that folder: force.csv, lcr.csv" in _said(result)
    assert "There is no folder" in _said(_run("read", lab / "nowhere" / "force.csv"))


def test_resuming_with_another_surrogate_is_refused_with_a_sentence(lab: Path) -> None:
    _replace("experiment.toml", 'model = "closed form"\n', "", lab)
    shipped = load_surrogate()
    replace(shipped, force_modes=1.01 * shipped.force_modes).save(lab / "other.npz")
    begin = ("calibrate", lab / "experiment.toml", "-o", lab / "run", "--budget", 0, "--processes", 0)
    # Stopped as soon as the checkpoint is there.
    brief = replace(_brief(BLOCK), look_elsewhere=lambda *_: Elsewhere(), spot_check=_stopped)
    assert _run(*begin, stages=brief).exit_code == 130
    before = {p: p.read_bytes() for p in (lab / "run").rglob("*") if p.is_file()}
    result = _run(*begin, "--resume", "--surrogate", lab / "other.npz")
    assert result.exit_code == 2
    assert f"the run in this folder is another: forward model was {shipped.name}" in _said(result)
    assert {p: p.read_bytes() for p in (lab / "run").rglob("*") if p.is_file()} == before


def test_a_calibration_can_be_run_without_the_command_line(lab: Path, make_posterior: Callable[..., Posterior]) -> None:
    seen: list[tuple[Any, ...]] = []

    def sampled(problem: Problem, **options: object) -> Posterior:
        seen.append((problem.forward.name, options["seed"], options["max_seconds"], options["attrs"]))
        return make_posterior(n_specimen=1)

    begin = time.monotonic()
    done = calibrate(
        lab / "experiment.toml",
        lab / "run",
        seed=5,
        deadline=begin + 90,
        command="by hand",
        stages=_made(sampled),
    )
    assert seen == [("closed form", 5, pytest.approx(90, abs=time.monotonic() - begin), {"command": "by hand"})]
    assert seen[0][2] < 90  # reading is in it
    assert done.page_error is None
    again = load_run(lab / "run")
    np.testing.assert_array_equal(again.posterior.draws, done.run.posterior.draws)
    assert again.posterior_sha256 == done.run.posterior_sha256
    assert again.forward == ClosedForm()
    assert again.notes == ()
    assert load_recommendation(lab / "run") is None
    found = recommend_in(again, Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50), seed=1)
    assert found.draws_sha256 == again.posterior.draws_sha256
    kept = load_recommendation(lab / "run")
    assert kept is not None
    np.testing.assert_array_equal(kept.probability, found.probability)


# --- read, init ---------------------------------------------------------------------------------------------------------


def test_read_shows_and_writes_what_was_understood(lab: Path) -> None:
    result = _run("read", lab / "force.csv", "-o", lab / "observations.csv")
    assert result.exit_code == 0, result.output
    assert "240 rows" in result.stdout
    assert "Displacement (mm)" in result.stdout
    rows = pd.read_csv(lab / "observations.csv", keep_default_na=False)
    assert list(rows.columns) == ["displacement_m", "force_N", "branch", "cycle", "used", "reason"]
    assert rows["displacement_m"].iloc[-1] == pytest.approx(0.65e-3)
    assert len(rows) == 240


def test_read_never_overwrites_the_lab_file(lab: Path) -> None:
    before = (lab / "force.csv").read_bytes()
    result = _run("read", lab / "force.csv", "-o", lab / "force.csv")
    assert result.exit_code == 2
    assert "overwrite the lab file" in _said(result)
    assert (lab / "force.csv").read_bytes() == before


def test_read_of_a_missing_file_exits_with_2(tmp_path: Path) -> None:
    result = _run("read", tmp_path / "nothing.csv", "-o", tmp_path / "o.csv")
    assert result.exit_code == 2
    assert "nothing.csv" in _said(result)
    assert list(tmp_path.iterdir()) == []


def test_init_writes_an_experiment_that_can_be_read(lab: Path) -> None:
    result = _run("init", lab / "lcr.csv", lab / "force.csv", "-o", lab / "new.toml")
    assert result.exit_code == 0, result.output
    experiment = read_experiment(lab / "new.toml")
    (specimen,) = experiment.specimens
    assert specimen.sweeps[0].force == lab / "force.csv"
    assert specimen.sweeps[0].capacitance == lab / "lcr.csv"
    assert "EDIT" in (lab / "new.toml").read_text(encoding="utf-8")


def test_init_pairs_files_by_their_names(lab: Path) -> None:
    (lab / "sub").mkdir()
    names = [f"{kind}/s{k}_{what}.csv" for kind, what in (("sub", "lcr"), (".", "instron")) for k in (2, 10, 1)]
    for name in names:
        source = lab / ("lcr.csv" if "lcr" in name else "force.csv")
        (lab / name).write_bytes(source.read_bytes())
    result = _run("init", *(lab / n for n in names), "-o", lab / "new.toml")
    assert result.exit_code == 0, result.output
    experiment = read_experiment(lab / "new.toml")
    assert [s.name for s in experiment.specimens] == ["s2", "s10", "s1"]
    for specimen in experiment.specimens:
        sweep = specimen.sweeps[0]
        assert sweep.force is not None
        assert sweep.capacitance is not None
        assert sweep.force.stem.split("_")[0] == sweep.capacitance.stem.split("_")[0]


def test_init_refuses_to_overwrite_and_files_it_does_not_understand(lab: Path) -> None:
    before = (lab / "experiment.toml").read_bytes()
    result = _run("init", lab / "force.csv", "-o", lab / "experiment.toml")
    assert result.exit_code == 2
    assert "not overwritten" in _said(result)
    assert (lab / "experiment.toml").read_bytes() == before
    (lab / "times.csv").write_text("Time (s)\n1\n2\n3\n", encoding="utf-8")
    result = _run("init", lab / "times.csv", "-o", lab / "new.toml")
    assert result.exit_code == 2
    assert "times.csv" in _said(result)
    assert not (lab / "new.toml").exists()


# --- simulate, surrogate ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("target", "column", "end"), [(("--displacement", "0.7 mm"), 0, 0.7e-3), (("--force", "5 N"), 1, 5.0)])
def test_simulate_writes_steps_up_to_the_asked_end(lab: Path, target: tuple[str, str], column: int, end: float) -> None:
    result = _run("simulate", lab / "design.toml", *target, "--steps", 7, "--model", "closed-form", "-o", lab / "curve.csv")
    assert result.exit_code == 0, result.output
    rows = pd.read_csv(lab / "curve.csv")
    assert list(rows.columns) == ["displacement_m", "force_N", "contact_radius_m", "capacitance_F", "capacitance_change"]
    assert len(rows) == 7
    assert rows.iloc[:, column].to_numpy() == pytest.approx(end * np.arange(1, 8) / 7)


def test_simulate_prints_without_an_output_file(lab: Path) -> None:
    result = _run("simulate", lab / "design.toml", "--displacement", "0.7 mm", "--steps", 2, "--model", "closed-form")
    assert result.stdout.startswith("displacement_m,force_N")
    assert len(result.stdout.splitlines()) == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "give either --displacement or --force"),
        (("--displacement", "0.7 mm", "--force", "5 N"), "give either --displacement or --force"),
        (("--displacement", "0.7"), "has no unit"),
        (("--displacement", "-0.7 mm"), "must be positive, got -0.7 mm"),
        (("--displacement", "7 mm"), "covers depths up to"),
        (("--force", "700 N"), "reaches forces up to"),
    ],
)
def test_simulate_refuses_what_it_cannot_do(lab: Path, words: tuple[str, ...], message: str) -> None:
    result = _run("simulate", lab / "design.toml", *words, "--model", "closed-form", "-o", lab / "curve.csv")
    assert result.exit_code == 2
    assert message in _said(result)
    assert not (lab / "curve.csv").exists()


FEM = ("--model", "fem", "--accuracy", 0.01)


def test_simulate_by_finite_elements_goes_there_and_back_and_checks_itself(lab: Path) -> None:
    result = _run(
        "simulate", lab / "design.toml", "--force", "3 N", "--steps", 4, *FEM, "--unload", "--check", "-o", lab / "curve.csv"
    )
    assert result.exit_code == 0, result.output
    rows = pd.read_csv(lab / "curve.csv")
    assert rows["force_N"].to_numpy() == pytest.approx([0.75, 1.5, 2.25, 3.0, 2.25, 1.5, 0.75], rel=1e-6)
    said = _said(result)
    for part in ("Estimated error of the mesh", "capacitance change", "stored energy", "Largest penetration"):
        assert part in said


LAYERED = """
[indenter]
shape = "flat punch"
radius = "3 mm"
edge_radius = "0.5 mm"
[disc]
radius = "10 mm"
[[layers]]
name = "foam"
thickness = "1 mm"
young_modulus = "0.3 MPa"
law = { yeoh = { c2 = -0.25 } }
[[layers]]
name = "dielectric"
thickness = "0.3 mm"
young_modulus = "0.7 MPa"
relative_permittivity = 3.0
"""


def test_simulate_takes_layers_to_the_finite_elements_alone(lab: Path) -> None:
    (lab / "layers.toml").write_text(LAYERED, encoding="utf-8")
    result = _run("simulate", lab / "layers.toml", "--displacement", "0.1 mm", "-o", lab / "curve.csv")
    assert result.exit_code == 2
    assert "the surrogate covers a ball on a sensor and padding of one law" in _said(result)
    assert "Add --model fem" in _said(result)
    result = _run("simulate", lab / "layers.toml", "--displacement", "0.1 mm", *FEM, "-o", lab / "curve.csv")
    assert result.exit_code == 0, result.output
    assert len(pd.read_csv(lab / "curve.csv")) == 14


def test_a_path_that_ends_early_is_written_as_far_as_it_came_and_says_why(lab: Path) -> None:
    (lab / "layers.toml").write_text(LAYERED, encoding="utf-8")
    result = _run("simulate", lab / "layers.toml", "--displacement", "0.8 mm", "--steps", 16, *FEM, "-o", lab / "curve.csv")
    assert result.exit_code == 3
    said = _said(result)
    assert "Ended early: no equilibrium beyond an indentation of" in said
    assert "the material of layer foam has lost strong ellipticity" in said
    rows = pd.read_csv(lab / "curve.csv")
    assert 1 <= len(rows) < 16
    assert f"{rows['displacement_m'].iloc[-1] * 1e3:.4g} mm" in said


@pytest.mark.parametrize(
    "option", [("--unload",), ("--check",), ("--picture", "p.png"), ("--vtk", "p.pvd"), ("--accuracy", 0.01)]
)
def test_options_of_the_finite_elements_are_refused_without_them(
    lab: Path, option: tuple[object, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(lab)
    result = _run("simulate", lab / "design.toml", "--displacement", "0.1 mm", *option)
    assert result.exit_code == 2
    assert f"{option[0]} needs the finite elements. Add --model fem" in _said(result)


def test_a_picture_that_cannot_be_made_leaves_nothing_written(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyvista", None)
    words = ("--displacement", "0.1 mm", "--steps", 2, *FEM, "--view", lab / "v.png", "-o", lab / "curve.csv")
    result = _run("simulate", lab / "design.toml", *words)
    assert result.exit_code == 2
    assert "needs the package pyvista" in _said(result)
    assert not (lab / "curve.csv").exists()
    assert not (lab / "v.png").exists()


def test_pictures_are_refused_before_the_work_if_they_cannot_be_written(lab: Path) -> None:
    for option, path, message in (
        ("--picture", lab / "p.doc", "--picture must end in .png or .pdf or .svg"),
        ("--picture", lab / "p.PNG", "--picture must end in .png or .pdf or .svg"),
        ("--vtk", lab / "nowhere" / "p.pvd", "does not exist"),
        ("--picture", lab / "design.toml", "would overwrite the design file"),
    ):
        result = _run("simulate", lab / "design.toml", "--displacement", "0.1 mm", *FEM, option, path)
        assert result.exit_code == 2
        assert message in _said(result)


def test_surrogate_commands_refuse_a_missing_file_too_few_points_and_an_existing_output(lab: Path) -> None:
    result = _run("surrogate", "info", "--surrogate", lab / "nothing.npz")
    assert result.exit_code == 2
    assert "no such surrogate file" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "new.npz", "--points", 4)
    assert result.exit_code == 2
    assert "--points 4 are too few to train on. Give at least" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "force.csv")
    assert result.exit_code == 2
    assert "not overwritten" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "new.npz", "--store", lab / "force.csv")
    assert result.exit_code == 2
    assert "force.csv: is not a store of finite-element runs. Choose another --store" in _said(result)
    assert not (lab / "new.npz").exists()


def _fill(path: Path, accuracy: float, points: FloatArray) -> None:
    """A store of runs, in which the path of one design is told of all, which is enough to be fitted."""
    path_of_one = run_point(np.array([0.15, 0.2, 2.0, 1.0]), accuracy)
    with open_store(path, store_settings(accuracy)) as store:
        for point in points:
            store.add(point, path_of_one.arrays)


def test_a_surrogate_is_trained_extended_and_used(lab: Path) -> None:
    quick = ("--steps", 60, "--accuracy", 0.1, "--processes", 1, "--store", lab / "runs.sqlite")
    _fill(lab / "runs.sqlite", 0.1, design_points(62, seed=1))
    result = _run("surrogate", "train", "-o", lab / "one.npz", "--points", 64, *quick)
    assert result.exit_code == 0, result.output
    assert "(64 curves, " in " ".join(result.stdout.split())
    # Those that are there are not run again; four more go where the first one states the largest errors.
    words = ("-o", lab / "two.npz", "--points", 68, "--improve", lab / "one.npz", *quick)
    result = _run("surrogate", "train", *words)
    assert result.exit_code == 0, result.output
    assert "(68 curves, " in " ".join(result.stdout.split())
    result = _run("surrogate", "info", "--surrogate", lab / "two.npz")
    assert "range of h_p/h_s" in result.stdout
    assert "of them without equilibrium to their end" in " ".join(result.stdout.split())
    result = _run("simulate", lab / "design.toml", "--displacement", "0.5 mm", "--steps", 2, "--surrogate", lab / "two.npz")
    assert result.exit_code == 0, result.output
    assert len(result.stdout.splitlines()) == 3
    # The capacitance alone is learnt anew, on the mechanics of the first.
    more = ("--points", 68, "--keep", "mechanics", *quick)
    result = _run("surrogate", "train", "-o", lab / "kept.npz", *more)
    assert result.exit_code == 2
    assert "--keep mechanics has nothing to keep. Give --start FILE" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "kept.npz", "--start", lab / "one.npz", *more)
    assert result.exit_code == 0, result.output
    assert "kept from a surrogate of" in _run("surrogate", "info", "--surrogate", lab / "kept.npz").stdout
    design, depth = design_from(PAPER_SENSOR), np.array([0.2e-3, 0.5e-3])
    one, kept = (load_surrogate(lab / f"{name}.npz").respond(design, depth) for name in ("one", "kept"))
    np.testing.assert_array_equal(kept.force, one.force)
    assert np.all(kept.capacitance_change != one.capacitance_change)
    result = _run("surrogate", "train", "-o", lab / "recalls.npz", "--recall", 64, *more)
    assert result.exit_code == 2
    assert "--keep mechanics has nothing to keep" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "recalls.npz", "--recall", 64, "--points", 68, *quick)
    assert result.exit_code == 2
    assert "--recall 64 has no networks to go on, or not from fine curves alone. Give it with --start FILE" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "recalls.npz", "--recall", 64, "--start", lab / "one.npz", *more)
    assert result.exit_code == 0, result.output
    assert "curves that they said before" in " ".join(
        _run("surrogate", "info", "--surrogate", lab / "recalls.npz").stdout.split()
    )
    # Both go on, and what it states of its error stays.
    on = ("-o", lab / "on.npz", "--start", lab / "one.npz", "--keep", "error", "--points", 68, *quick)
    result = _run("surrogate", "train", *on)
    assert result.exit_code == 0, result.output
    assert "error kept from a surrogate of" in " ".join(_run("surrogate", "info", "--surrogate", lab / "on.npz").stdout.split())
    assert np.all(load_surrogate(lab / "on.npz").respond(design, depth).force != one.force)
    # Of both the error alone is learnt anew, from other designs than those in the store, which its networks have seen.
    both = ("-o", lab / "stated.npz", "--start", lab / "one.npz", "--keep", "both", "--points", 64, *quick)
    result = _run("surrogate", "train", *both, "--improve", lab / "two.npz")
    assert result.exit_code == 2
    assert "Leave --improve and --coarse out" in _said(result)
    _fill(lab / "runs.sqlite", 0.1, random_groups(64, np.random.default_rng(1)))
    result = _run("surrogate", "train", *both)
    assert result.exit_code == 0, result.output
    assert "(64 curves, " in " ".join(result.stdout.split())
    stated = load_surrogate(lab / "stated.npz")
    np.testing.assert_array_equal(stated.respond(design, depth).force, one.force)
    assert stated.provenance["paths of the error"].startswith("64, ")
    result = _run("surrogate", "train", "-o", lab / "three.npz", "--family", "gent", "--improve", lab / "two.npz")
    assert result.exit_code == 2
    assert "it is a surrogate of the family neo-hookean. Give one of gent" in _said(result)
    result = _run("surrogate", "train", "-o", lab / "three.npz", "--family", "gent", *quick)
    assert result.exit_code == 2
    assert "family is neo-hookean there and gent here" in _said(result)


def test_a_design_of_another_family_gets_its_surrogate(lab: Path) -> None:
    text = (lab / "design.toml").read_text()
    law = "law = { gent = { locking = 20 } }\n"
    gent = text.replace("[sensor]\n", f"[sensor]\n{law}").replace("[padding]\n", f"[padding]\n{law}")
    (lab / "gent.toml").write_text(gent)
    (lab / "stick.toml").write_text(text.replace("[indenter]\n", '[indenter]\nfriction_coefficient = "stick"\n'))
    last = {}
    for name in ("design", "gent", "stick"):
        result = _run("simulate", lab / f"{name}.toml", "--displacement", "0.5 mm", "--steps", 2)
        assert result.exit_code == 0, result.output
        last[name] = float(result.stdout.splitlines()[-1].split(",")[1])
    assert 1.001 < last["gent"] / last["design"] < 1.2
    assert 1.02 < last["stick"] / last["design"] < 2
    assert "Gent sensor" in _run("surrogate", "info", "--family", "gent").stdout
    result = _run("simulate", lab / "gent.toml", "--displacement", "0.5 mm", "--model", "closed-form")
    assert result.exit_code == 2
    assert "stiffening must be 0" in _said(result)


def test_a_family_without_a_surrogate_in_the_package_is_refused_with_what_to_do(lab: Path) -> None:
    text = (lab / "design.toml").read_text()
    (lab / "rubs.toml").write_text(text.replace("[indenter]\n", "[indenter]\nfriction_coefficient = 0.3\n"))
    (copy_models(lab) / "friction.npz").unlink()
    for words in (
        ("surrogate", "info", "--family", "friction"),
        ("simulate", lab / "rubs.toml", "--displacement", "0.1 mm"),
    ):
        ended = calib_with(lab, *words)
        assert ended.returncode == 2
        said = " ".join(ended.stderr.split())
        assert "no surrogate of the family friction" in said
        assert "calib surrogate train --family friction -o friction.npz" in said
        assert "There are surrogates of neo-hookean (" in said
    law = "law = { gent = { locking = 20 } }\n"
    both = (lab / "rubs.toml").read_text().replace("[sensor]\n", f"[sensor]\n{law}").replace("[padding]\n", f"[padding]\n{law}")
    (lab / "both.toml").write_text(both)
    result = _run("simulate", lab / "both.toml", "--displacement", "0.1 mm")
    assert result.exit_code == 2
    assert "there is no surrogate for this combination of base, law, friction and padding. Use the model fem" in _said(result)
    assert "There are surrogates of neo-hookean (" in _said(result)


def test_what_help_texts_say_of_the_training_is_what_it_does() -> None:
    assert fitting.STEPS == STEPS
    assert [name.value for name in FamilyName] == list(FAMILIES)


# --- help ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    ["init", "read", "calibrate", "recommend", "export", "diff", "report", "simulate", "surrogate train", "surrogate refine"],
)
def test_help_teaches_with_an_example_and_the_exit_codes(command: str) -> None:
    result = _run(*command.split(), "--help")
    assert result.exit_code == 0
    said = " ".join(result.stdout.split())
    assert "Example: calib" in said
    assert "Exit codes: 0" in said


def test_help_starts_without_loading_the_heavy_libraries() -> None:
    code = "import sys, calib.cli; print([m for m in ('arviz', 'emcee', 'matplotlib', 'scipy', 'pandas') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_model_that_finds_no_equilibrium_is_known_by_its_class_and_not_by_a_name(capsys: pytest.CaptureFixture[str]) -> None:
    class Stuck(ConvergenceError):
        """Another kind of the same."""

    with pytest.raises(typer.Exit) as refused, refusing_bad_input():
        raise Stuck(0.4e-3, "Newton diverged", None)
    assert refused.value.exit_code == 2
    assert "no equilibrium beyond an indentation of 0.4 mm: Newton diverged" in capsys.readouterr().err
    namesake = type("ConvergenceError", (RuntimeError,), {})
    with pytest.raises(namesake), refusing_bad_input():
        raise namesake("of a library that has its own")


def test_every_unknown_is_listed_with_what_stands_in_for_its_prior() -> None:
    said = _run("unknowns")
    assert said.exit_code == 0
    entries = dict(entry.split(" (", 1) for entry in said.stdout.rstrip().split("\n\n"))
    assert list(entries) == list(UNKNOWNS)
    for name, row in UNKNOWNS.items():
        expected = row.default or ("must be given" if row.required else row.derived)
        assert expected
        assert expected in " ".join(entries[name].split())
    assert "one per specimen, positive" in entries["sensor_thickness"]
