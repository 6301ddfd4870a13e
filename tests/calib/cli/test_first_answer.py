"""A first answer on the command line: alone, before a calibration, and beside its result; and what progress says."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from small_run import QUICK, make_lab
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.cli.progress import progress_in_words
from calib.report import moves_in_words
from calib.runs import STAGES, load_run
from calib.runs.calibration import Stages
from calib.sampling.ensemble import KINDS
from calib.sampling.posterior import Posterior
from calib.sampling.sampler import Progress


def _run(*words: object, stages: Stages | None = None) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words], obj=stages)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small experiment."""
    return make_lab(tmp_path_factory.mktemp("lab"))


def test_quick_says_in_every_line_that_it_is_a_first_answer_and_writes_nothing(lab: Path) -> None:
    before = sorted(lab.rglob("*"))
    result = _run("calibrate", lab / "experiment.toml", "--quick")
    assert result.exit_code == 0, result.output
    head, *rows, last = result.stdout.splitlines()
    assert head.startswith("First answer, not the result")
    assert {row.split()[0] for row in rows} >= {"young_modulus", "load_zero[sensor", "contact_offset[sensor"}
    assert all("(first answer" in row for row in rows)
    assert last == f"For the result: calib calibrate {lab / 'experiment.toml'} -o RUN"
    assert sorted(lab.rglob("*")) == before
    # The lab file was drawn with 0.62 MPa.
    value, sd = next(row for row in rows if "young_modulus" in row).split("about ")[1].split(" MPa")[0].split(" ± ")
    assert abs(float(value) - 0.62) < 3 * float(sd)


@pytest.mark.parametrize(
    "options",
    [("-o", "RUN"), ("--seed", 3), ("--resume",), ("--budget", 5), ("--processes", 1), ("--reweight", 200)],
    ids=lambda options: str(options[0]),
)
def test_quick_takes_no_option_that_is_for_sampling(lab: Path, options: tuple[object, ...]) -> None:
    before = sorted(lab.rglob("*"))
    result = _run("calibrate", lab / "experiment.toml", "--quick", *options)
    assert result.exit_code == 2
    assert f"--quick samples and writes nothing: it takes no {options[0]}" in " ".join(result.stderr.split())
    assert sorted(lab.rglob("*")) == before


def test_what_is_wrong_with_an_input_is_said_by_quick_too(lab: Path, tmp_path: Path) -> None:
    text = (lab / "experiment.toml").read_text(encoding="utf-8").replace("force.csv", "gone.csv")
    (tmp_path / "experiment.toml").write_text(text, encoding="utf-8")
    result = _run("calibrate", tmp_path / "experiment.toml", "--quick")
    assert result.exit_code == 2
    assert "gone.csv" in result.stderr
    assert "first answer" not in result.stdout


def test_with_the_finite_elements_quick_says_what_to_do_instead(lab: Path, tmp_path: Path) -> None:
    text = (lab / "experiment.toml").read_text(encoding="utf-8").replace("closed form", "fem")
    (tmp_path / "experiment.toml").write_text(text, encoding="utf-8")
    (tmp_path / "force.csv").write_bytes((lab / "force.csv").read_bytes())
    result = _run("calibrate", tmp_path / "experiment.toml", "--quick")
    assert result.exit_code == 2
    assert 'Leave the line model = "fem" out' in " ".join(result.stderr.split())


def test_without_a_folder_a_calibration_is_refused(lab: Path) -> None:
    result = _run("calibrate", lab / "experiment.toml")
    assert result.exit_code == 2
    assert "-o" in result.stderr
    assert "--quick" in result.stderr


def test_a_calibration_shows_it_first_and_keeps_it_beside_the_result(lab: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    result = _run("calibrate", lab / "experiment.toml", "-o", run, "--processes", 0, stages=QUICK)
    assert result.exit_code == 3, result.output
    head, *rows = result.stderr.splitlines()
    assert head == "First answer, not the result:"
    assert rows[0].split()[0] == "young_modulus"
    assert rows[0].endswith("(first answer)")
    kept = load_run(run).posterior.diagnostics
    assert kept.first_answer is not None
    assert kept.first_answer_in_words in result.stdout
    told = json.loads((run / "summary.json").read_text(encoding="utf-8"))["first_answer"]
    assert told["note"] == "estimated before sampling: not the result"
    assert told["compared"] == kept.first_answer_in_words
    assert told["parameters"]["young_modulus"]["mean"] == pytest.approx(kept.first_answer.parameters["young_modulus"].mean)


# --- progress -----------------------------------------------------------------------------------------------------------


def _progress(**what: Any) -> Progress:
    p = Progress("sampling", 150, 300, math.nan, 150, 9.0, 96000, math.nan, "", 0.0, "", 400.0, 20000)
    return replace(p, **what)


def test_progress_says_no_more_of_the_time_left_than_is_known() -> None:
    assert progress_in_words(_progress(stage="start", done=3, wanted=8)) == ": 3 of 8 done"
    assert progress_in_words(_progress()) == ": 150 steps"
    assert progress_in_words(_progress(seconds_left=11.0)) == ": 150 steps, at least 10 s of it left"
    looked = _progress(seconds_left=130.0, r_hat=1.02, r_hat_parameter="a", ess=210.0, ess_parameter="b")
    said = ": 150 steps, about 2 min of it left, R-hat 1.020 (a), effective draws 210 of 400 (b)"
    assert progress_in_words(looked) == said
    assert progress_in_words(_progress(stage="block likelihoods")) == ""


def test_every_stage_that_sampling_tells_is_one_of_the_calibration() -> None:
    assert {"start", "sampling", "block likelihoods"} < set(STAGES)


def test_every_kind_of_move_has_a_plain_sentence(make_posterior: Callable[..., Posterior]) -> None:
    d = make_posterior().diagnostics
    said = moves_in_words(replace(d, acceptance_by_move=dict.fromkeys(KINDS, 0.01)))
    assert len(said) == len(KINDS)
    assert all("1.0 % accepted" in sentence for sentence in said)
    assert [("too few to help" in sentence) for sentence in said] == [kind != "jump" for kind in KINDS]
    shapeless = moves_in_words(replace(d, acceptance_by_move={"differential evolution": 0.3, "jump": 0.01}))
    assert "as it should be" in shapeless[0]
    assert "No density was found that fits" in shapeless[-1]
    assert moves_in_words(replace(d, acceptance_by_move={})) == ()
