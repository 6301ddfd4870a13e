"""Names of specimens, experiments, files and folders, from the first command to the last: kept as they are, or refused."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_run import BLOCK, QUICK, in_small_steps
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.problem import Problem
from calib.runs import Stages
from calib.runs.page import page_of
from calib.sampling import sample
from calib.sampling.posterior import Posterior

SPECIMENS = (r"a $x^$ b $\frac{$ %s", "<script>'{{ 7 }}'</script> 😀 שלום")
EXPERIMENT = r"\ % {# </title><script> "
FILES = ("a $x^$ %s <b> 'q' \"r\".csv", "-o `ls` 日本.csv")
FOLDER = "fo $x^$ %d <b> 'q' \"r\" \\ ü 😀"


pytestmark = pytest.mark.usefixtures("all_undrawn")


def _brief(steps: int) -> Stages:
    def sampled(problem: Problem, **options: Any) -> Posterior:
        with in_small_steps():
            return sample(problem, **{**options, "max_steps": steps, "max_seconds": math.inf, "processes": 0})

    return _made(sampled)


def _made(sampled: Callable[..., Posterior]) -> Stages:
    """Stages of a calibration of which nothing else is asked."""
    return replace(QUICK, sample=sampled, page=page_of)


def _run(*words: object, stages: Stages | None = None) -> Result:
    """Run a command, of which nothing may reach the terminal that moves its cursor, and no warning of Python."""
    result = CliRunner().invoke(app, [str(word) for word in words], obj=stages)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert not any(c in result.output for c in "\x1b\x07\x00\r\u202e")
    assert re.search(r"\w+Warning:", result.stderr) is None
    return result


def _lab(folder: Path, specimens: tuple[str, ...] = ("s",), files: tuple[str, ...] = ("f.csv",), name: str = "x") -> Path:
    """Write an experiment in which little is unknown; gives its file."""
    rng = np.random.default_rng(1)
    depth = np.arange(120) * 0.004
    force = 10 * np.maximum(0, depth - 0.03) ** 1.5 + 0.03 + rng.normal(0, 0.01, depth.size)
    text = f"""name = {json.dumps(name, ensure_ascii=False)}
model = "closed form"
discrepancy = "off"
indenter.radius = "5 mm"
sensor.radius = "10 mm"
[priors]
machine_compliance = {{ fixed = "0 um/N" }}
force_noise = {{ fixed = "0.01 N" }}
"""
    for specimen, file in zip(specimens, files, strict=True):
        if "\0" not in file:
            rows = "".join(f"{d:.4f},{f:.5f}\n" for d, f in zip(depth, force, strict=True))
            (folder / file).write_text(f"Displacement (mm),Force (N)\n{rows}", encoding="utf-8")
        text += f"""[[specimens]]
name = {json.dumps(specimen, ensure_ascii=False)}
force = {json.dumps(file, ensure_ascii=False)}
priors.sensor_thickness = {{ normal = ["0.74 mm", "0.02 mm"] }}
priors.padding_thickness = {{ fixed = "1.10 mm" }}
priors.load_zero = {{ fixed = "0.03 N" }}
"""
    path = folder / "e 'x' $y.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.skipif(os.name == "nt", reason="such names of files there are not there")
def test_no_name_is_lost_from_the_first_command_to_the_last(tmp_path: Path) -> None:
    folder = tmp_path / FOLDER
    folder.mkdir()
    experiment, run, other = _lab(folder, SPECIMENS, FILES, EXPERIMENT), folder / "run $(1)", folder / "run 2"
    begun = _run("calibrate", experiment, "-o", run, stages=_brief(BLOCK))
    assert begun.exit_code in (0, 3), begun.output
    assert all(name in "".join(begun.stdout.split()) for name in ("$x^$", "'{{7}}'", "😀"))
    assert _run("calibrate", experiment, "-o", run, "--resume", stages=_brief(2 * BLOCK)).exit_code in (0, 3)
    shutil.copytree(run, other)
    words = ("--force", "2 N", "--padding", "0.5 mm:3 mm", "--steps", 4, "--draws", 50)
    recommended = _run("recommend", run, *words)
    assert recommended.exit_code in (0, 3), recommended.output
    assert str(run / "recommendation.json") in recommended.stdout
    assert _run("report", run).exit_code in (0, 3)
    verified = _run("verify", run)
    assert verified.exit_code == 0, verified.output
    assert _run("compare", run, other).exit_code in (0, 3)
    parameters = json.loads((run / "summary.json").read_text(encoding="utf-8"))["parameters"]
    rows = [row[0] for row in csv.reader((run / "summary.csv").read_text(encoding="utf-8").splitlines())]
    for name in SPECIMENS:
        assert f"sensor_thickness[{name}]" in parameters
        assert f"sensor_thickness[{name}]" in rows
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "$x^$ b $\\frac{$" in page


BAD = ("a\0b", "a\nb", "a\tb", "a\x1b[31mb", "a\u202eb", "a\u200fb", "x" * 10_000, "a[b", "a, b", "", " ", "\ufeffx", "\u2028")


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_shown_is_no_name_of_a_specimen(tmp_path: Path, name: str) -> None:
    result = _run("calibrate", _lab(tmp_path, (name,)), "-o", tmp_path / "run")
    assert result.exit_code == 2, result.output
    assert ".toml:10:1: " in result.stderr
    assert len(result.stderr) < 500
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(os.name == "nt", reason="such names of files there are not there")
@pytest.mark.parametrize("name", ["a\nb.csv", "a\x1b[31mb.csv", "a\u202eb.csv"])
def test_what_cannot_be_shown_is_no_name_of_a_lab_file(tmp_path: Path, name: str) -> None:
    result = _run("calibrate", _lab(tmp_path, files=(name,)), "-o", tmp_path / "run")
    assert result.exit_code == 2, result.output
    assert ".toml:11:1: force is not the name of a file" in result.stderr
    for command in (("read", tmp_path / name), ("init", tmp_path / name, "-o", tmp_path / "new.toml")):
        assert _run(*command).exit_code in (0, 2)


@pytest.mark.skipif(sys.platform != "linux", reason="such names of folders there are not everywhere")
@pytest.mark.parametrize("name", [b"fo \x1b]0;owned\x07", b"fo \n x", b"fo \xff x", "fo \u202e".encode()])
def test_a_folder_that_cannot_be_shown_is_refused_before_any_work(tmp_path: Path, name: bytes) -> None:
    folder = tmp_path / os.fsdecode(name)
    folder.mkdir()
    for words in ((_lab(folder), "-o", tmp_path / "run"), (_lab(tmp_path), "-o", folder / "run")):
        result = _run("calibrate", *words)
        assert result.exit_code == 2, result.output
        assert "Rename it, or the folder that it is in" in result.stderr
        assert not (tmp_path / "run").exists()
        assert not (folder / "run").exists()


# --- what the screen says and what the page says ------------------------------------------------------------------------


def _judged(folder: Path, experiment: Path, stages: Stages) -> tuple[bool, bool, int]:
    """Whether a calibration is good on the screen, whether it is on its page, and its exit code."""
    result = _run("calibrate", experiment, "-o", folder / "run", stages=stages)
    assert result.exit_code in (0, 3), result.output
    page = (folder / "run" / "report.html").read_text(encoding="utf-8")
    (colour,) = [c for c in ("green", "amber", "red") if f'class="verdict {c}"' in page]
    green = "Green: the numbers can be used." in result.stdout.splitlines()
    return green, colour == "green", result.exit_code


@pytest.mark.parametrize(
    ("options", "level", "good"),
    [
        ({}, "good", True),
        ({}, "warning", True),
        ({}, "bad", False),
        ({"converged": False}, "good", False),
        ({"honest": False}, "good", False),
        ({"honest": True}, "good", True),
    ],
)
def test_the_screen_judges_a_calibration_as_its_page_does(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make_posterior: Callable[..., Posterior],
    options: dict[str, bool],
    level: Any,
    good: bool,
) -> None:
    from calib.lab import Grade

    monkeypatch.setattr("calib.runs.calibration.first_answer_of", lambda _: None)  # that of the lab would not be this one's
    made = make_posterior(n_specimen=1, **options)
    grade = Grade("signal", level, 0.9, "times", "the signal is 0.9 times the noise", "Look", "force", "f.csv")
    made = replace(made, sweeps=tuple(replace(sweep, grades=(grade,)) for sweep in made.sweeps))
    stages = _made(lambda *_, **__: made)
    on_screen, on_page, _ = _judged(tmp_path, _lab(tmp_path), stages)
    assert on_screen == on_page == good


@pytest.mark.parametrize("noise", ["white", "wandering", "rounded"])
def test_noise_is_never_good_however_well_its_chains_agree(tmp_path: Path, noise: str) -> None:
    rng = np.random.default_rng(3)
    force = {"white": rng.normal(0, 0.02, 120), "wandering": np.cumsum(rng.normal(0, 0.02, 120))}.get(noise, np.empty(0))
    force = force if force.size else np.round(rng.normal(0, 0.02, 120), 2)
    experiment = _lab(tmp_path)
    rows = "".join(f"{0.004 * i:.4f},{f:.6f}\n" for i, f in enumerate(force))
    (tmp_path / "f.csv").write_text(f"Displacement (mm),Force (N)\n{rows}")
    experiment.write_text("".join(line for line in experiment.read_text().splitlines(True) if 'fixed = "0.0' not in line))

    def sampled(problem: Problem, **options: Any) -> Posterior:
        posterior = _brief(BLOCK).sample(problem, **options)
        return replace(posterior, diagnostics=replace(posterior.diagnostics, converged=True, reasons=()))

    words = ["calibrate", str(experiment), "-o", str(tmp_path / "looked at"), "--budget", "0", "--processes", "0"]
    result = CliRunner().invoke(app, words)
    if result.exit_code == 2 and "nothing was sampled" not in result.stderr:  # the file is refused, which is better still
        assert "f.csv" in result.stderr
        return
    on_screen, on_page, _ = _judged(tmp_path, experiment, _made(sampled))
    assert not on_screen
    assert not on_page


def test_a_line_number_between_colons_is_no_pictogram(tmp_path: Path) -> None:
    file = tmp_path / "e.toml"
    file.write_text("\n" * 99 + "model = 3\n", encoding="utf-8")
    assert "e.toml:100:" in _run("check", file).stderr.replace("\n", "")
