"""Models of the same data: which an experiment should be held against, each calibrated in a folder of its own, compared."""

from __future__ import annotations

import json
import math
import re
import shutil
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parent))

from small_run import BLOCK, QUICK, in_small_steps, make_lab

import calib.runs.rivals
from calib.checks import BEYOND_DOUBT, Reason, Verdict, standings
from calib.cli import app
from calib.errors import Fault, InputError
from calib.experiment import AS_GIVEN, Experiment, Variant, candidates_of, read_experiment, variants_of
from calib.priors import Fixed
from calib.problem import Problem
from calib.runs import Run, Watch, calibrate, calibrate_rivals, load_run, verify
from calib.runs.preview import problem_of
from calib.sampling import Posterior, load_posterior, sample
from models.sensor import design_from
from models.surrogate import FAMILIES, load_surrogate


def _sampled(problem: Problem, **options: Any) -> Posterior:
    with in_small_steps():
        return sample(problem, **{**options, "max_steps": 10 * BLOCK})


STAGES = replace(QUICK, sample=_sampled)


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder with the models of a lab's experiment, and what `calib compare` said."""
    lab = make_lab(tmp_path_factory.mktemp("lab"))
    command = ["compare", str(lab / "experiment.toml"), "-o", str(lab / "models"), "--processes", "0"]
    result = CliRunner().invoke(app, command, obj=STAGES, env={"COLUMNS": "300"})
    assert result.exit_code in (0, 3), result.output
    return lab, " ".join(result.output.split())


def test_each_model_has_a_run_of_its_own_that_differs_in_one_choice(compared: tuple[Path, str]) -> None:
    lab, said = compared
    given, own = (load_posterior(lab / "models" / name / "posterior.nc") for name in (AS_GIVEN, "own-padding"))
    assert "padding_young_modulus" not in given.diagnostics.parameters
    assert own.diagnostics.parameters["padding_young_modulus"].sd > 0
    assert replace(own.experiment, padding_material="sensor") == given.experiment
    # One press cannot tell a soft padding from a soft sensor: freeing one modulus must not leave the other as sure as before.
    assert own.diagnostics.parameters["young_modulus"].sd > 3 * given.diagnostics.parameters["young_modulus"].sd
    assert "cannot tell apart" in said


def test_it_is_said_how_long_it_will_take_before_anything_is_sampled(compared: tuple[Path, str], tmp_path: Path) -> None:
    lab, said = compared
    models, _, rest = said.partition("To calibrate: 2 models (")[2].partition("), one after the other; ")
    assert sorted(models.split(", ")) == ["as-given", "own-padding"]
    forecast, _, rest = rest.partition(".")
    time = r"([\d.]+ (?:s|min|h))"
    ((low, high),) = re.findall(rf"^{time} to {time} on this machine if nothing else runs on it, at most 20 min", forecast)
    assert low != high
    assert said.index("first answer of as-given (1 of 2)") < said.index("To calibrate") < said.rindex("(1 of 2)")
    assert "Ctrl-C keeps what is done" in rest
    # What is finished is not counted again.
    shutil.copytree(lab, tmp_path / "lab")
    again = CliRunner().invoke(
        app,
        ["compare", str(tmp_path / "lab" / "experiment.toml"), "-o", str(tmp_path / "lab" / "models")],
        obj=STAGES,
        env={"COLUMNS": "300"},
    )
    told = " ".join(again.output.split())
    run = load_run(lab / "models" / "as-given")
    done = run.posterior.diagnostics.converged
    assert ("Finished already, taken as they are: as-given" in told) is done


def _slippery_lab(folder: Path) -> Path:
    """The lab of a sensor whose base slips, and that the experiment takes for glued."""
    make_lab(folder)
    values = {"young_modulus": 0.9e6, "sensor_thickness": 0.74e-3, "padding_thickness": 1.1e-3, "relative_permittivity": 2.8}
    depth, rng = np.linspace(-0.05e-3, 0.6e-3, 120), np.random.default_rng(7)
    design = design_from({**values, "indenter_radius": 5e-3, "sensor_radius": 10e-3}, base="slippery")
    force = load_surrogate(family=FAMILIES["slippery"]).respond(design, depth).force + rng.normal(0, 0.01, depth.size)
    table = pd.DataFrame({"Displacement (mm)": 1e3 * depth + 0.05, "Force (N)": force})
    table.to_csv(folder / "force.csv", index=False, float_format="%.6f")
    text = (folder / "experiment.toml").read_text(encoding="utf-8").replace('model = "closed form"', 'base = "bonded"')
    text = 'candidates = ["slippery"]\n' + text.lstrip()
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    return folder


def test_what_first_answers_rule_out_beyond_doubt_is_named_with_its_factor_and_not_sampled(tmp_path: Path) -> None:
    lab = _slippery_lab(tmp_path)
    command = ["compare", str(lab / "experiment.toml"), "-o", str(lab / "models"), "--processes", "0"]
    result = CliRunner().invoke(app, command, obj=STAGES, env={"COLUMNS": "300"})
    said = " ".join(result.output.split())
    assert (
        said.index("Reading;")
        < said.index("first answer of as-given (1 of 2)")
        < said.index("To calibrate: 1 model (slippery)")
    )
    ruled_out = re.search(
        r"Ruled out beyond doubt, and not calibrated: as-given \(.*?bonded base.*?data are 10\^(\d+) times", said
    )
    assert ruled_out is not None
    assert int(ruled_out[1]) > BEYOND_DOUBT / math.log(10)
    # In the table, too, whose cells are broken where they are narrow.
    assert re.search(rf"as-given +neo-Hookean, +- +ruled out, 1 : .*?10\^{ruled_out[1]} ", said.replace("\n", " ")), (
        result.output
    )
    assert "slippery surrogate) is the one model that was calibrated" in said
    verdict = load_run(lab / "models" / "slippery").verdict
    going_on = f'calib recommend {lab / "models" / "slippery"} --force "10 N"'
    assert (going_on in said) is (verdict.colour != "red")
    assert said.count("under which the data are 10^") == 1
    assert sorted(path.name for path in (lab / "models").iterdir()) == ["comparison.json", "slippery"]
    kept = json.loads((lab / "models" / "comparison.json").read_text(encoding="utf-8"))
    assert [(row["name"], row["against"]) for row in kept["ruled_out"]] == [("as-given", "slippery")]


def test_nothing_is_ruled_out_against_a_model_that_contradicts_what_was_believed(tmp_path: Path) -> None:
    lab = _slippery_lab(tmp_path)
    text = (lab / "experiment.toml").read_text(encoding="utf-8").replace('["0.7 MPa", 1.6]', '["0.05 MPa", 1.05]')
    (lab / "experiment.toml").write_text(text, encoding="utf-8")
    plan = read_experiment(lab / "experiment.toml")
    found = standings(problem_of(plan, None), candidates_of(plan))
    assert {s.variant.name for s in found} == {AS_GIVEN, "slippery"}
    assert not any(s.ruled_out for s in found)


def test_the_check_of_a_base_that_is_wrong_says_what_to_write_and_where(tmp_path: Path) -> None:
    lab = _slippery_lab(tmp_path)
    result = CliRunner().invoke(app, ["check", str(lab / "experiment.toml")], env={"COLUMNS": "300"})
    assert 'set base = "slippery" (line 3)' in " ".join(result.output.split()), result.output


def test_what_was_said_is_kept(compared: tuple[Path, str]) -> None:
    lab, said = compared
    kept = json.loads((lab / "models" / "comparison.json").read_text(encoding="utf-8"))
    assert kept["said"] in said
    assert {row["name"] for row in kept["candidates"]} == {AS_GIVEN, "own-padding"}


def test_what_the_verdicts_have_against_the_models_that_predict_best_is_said(
    compared: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lab, said = compared
    assert f'To go on, with your load in the place of 10 N: calib recommend {lab / "models" / "average"} --force "10 N"' in said
    red = Verdict((Reason("misfit", "red", "the force falls behind", "Look at it"), Reason("files", "amber", "x", "y")))
    own = lab / "models" / "own-padding"
    usual = vars(Run)["verdict"].func
    monkeypatch.setattr(Run, "verdict", property(lambda run: red if run.folder == own else usual(run)))
    again = CliRunner().invoke(app, ["compare", str(lab / "models" / AS_GIVEN), str(own)], env={"COLUMNS": "300"})
    told = " ".join(again.output.split())
    assert again.exit_code == 3, told
    assert f"The verdict on {own} is red: the force falls behind; and 1 more." in told
    assert f"Warning: the verdict on {own} is red: its numbers must not be used" in told


def test_the_models_are_averaged_into_a_run_of_its_own(compared: tuple[Path, str]) -> None:
    lab, said = compared
    average = load_run(lab / "models" / "average")
    assert {m.name for m in average.members} == {AS_GIVEN, "own-padding"}
    assert sum(m.weight for m in average.members) == pytest.approx(1.0)
    assert "Their average is a run like any other" in said
    assert all(finding.state == "fine" for finding in verify(average.folder))


def test_the_experiment_says_which_models_are_calibrated(tmp_path: Path) -> None:
    lab = make_lab(tmp_path)
    text = 'candidates = ["own-padding", "discrepancy-on"]\n' + (lab / "experiment.toml").read_text(encoding="utf-8")
    (lab / "experiment.toml").write_text(text, encoding="utf-8")

    class Counted(Exception):
        pass

    def counted(_: object, __: int, count: int) -> nullcontext[Watch]:
        raise Counted(count)

    with pytest.raises(Counted, match="3"):
        calibrate_rivals(lab / "experiment.toml", lab / "models", watch=counted)


def test_runs_that_are_finished_are_not_made_again_and_changed_inputs_are(compared: tuple[Path, str]) -> None:
    lab, _ = compared
    files = [lab / "models" / name / "posterior.nc" for name in (AS_GIVEN, "own-padding", "average")]
    before = [file.stat().st_mtime_ns for file in files]
    calibrate_rivals(lab / "experiment.toml", lab / "models", processes=0, stages=STAGES)
    assert [file.stat().st_mtime_ns for file in files] == before
    text = (lab / "experiment.toml").read_text(encoding="utf-8")
    (lab / "experiment.toml").write_text(text.replace('"1.10 mm"', '"1.20 mm"'), encoding="utf-8")
    with pytest.raises(InputError, match=r"the run in this folder is another: .*padding_thickness"):
        calibrate_rivals(lab / "experiment.toml", lab / "models", processes=0, stages=STAGES)
    (lab / "experiment.toml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["experiment.toml"], "the folder for the runs is missing"),
        (["models/as-given", "models/own-padding", "-o", "x"], "-o is for an experiment file"),
        (["models/as-given"], "at least two runs"),
    ],
)
def test_what_cannot_be_compared_is_refused_with_advice(
    compared: tuple[Path, str], monkeypatch: pytest.MonkeyPatch, arguments: list[str], said: str
) -> None:
    monkeypatch.chdir(compared[0])
    result = CliRunner().invoke(app, ["compare", *arguments], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_an_experiment_is_held_against_every_model_that_can_be_had(tmp_path: Path) -> None:
    make_lab(tmp_path)
    closed = read_experiment(tmp_path / "experiment.toml")
    assert [v.name for v in variants_of(closed)] == [AS_GIVEN, "own-padding"]
    plain = replace(closed, model="surrogate")
    others = {"gent", "stick", "slippery", "rubbing-base", "own-padding", "friction"}
    assert {v.name for v in variants_of(plain)} == {AS_GIVEN, *others}
    for variant in variants_of(plain)[1:]:
        assert variant.of(plain).family != plain.family or variant.name == "own-padding"
    rubbing = replace(plain, model="fem", priors={**plain.priors, "friction_coefficient": Fixed(0.3)})
    assert "frictionless" in {v.name for v in variants_of(rubbing)}
    assert "friction" in {v.name for v in variants_of(replace(plain, model="fem"))}
    base_rubs = replace(plain, base="slippery", priors={**plain.priors, "base_friction_coefficient": Fixed(0.3)})
    rubs = {v.name: v.of(base_rubs).base_rubs for v in variants_of(base_rubs)}
    assert rubs == {AS_GIVEN: True, "bonded": False, "slippery": False, "own-padding": True}
    gent = replace(plain, law="gent")
    assert [v.name for v in variants_of(gent)] == [AS_GIVEN, "neo-hookean", "own-padding"]  # none that sticks and stiffens


def test_a_comparison_that_is_stopped_says_how_to_go_on_with_all_that_it_was_given(tmp_path: Path) -> None:
    lab = make_lab(tmp_path)

    def stopped(*_: object, **__: object) -> Posterior:
        raise KeyboardInterrupt

    experiment, models = lab / "experiment.toml", lab / "my models"
    command = ["compare", str(experiment), "-o", str(models), "--seed", "7", "--budget", "3", "--processes", "0"]
    result = CliRunner().invoke(app, command, obj=replace(QUICK, sample=stopped))
    assert result.exit_code == 130, result.output
    said = " ".join(result.stderr.split())
    assert f'Continue with: calib compare {experiment} -o "{models}" --seed 7 --budget 3 --processes 0' in said


def test_a_model_that_cannot_be_calibrated_is_named_before_and_in_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = make_lab(tmp_path)

    def not_of_the_padding(plan: Experiment, surrogate: Path | None) -> Problem:
        if plan.padding_material != "sensor":
            raise InputError(Fault("the sweep lies outside what the surrogate covers"))
        return problem_of(plan, surrogate)

    monkeypatch.setattr(calib.runs.rivals, "problem_of", not_of_the_padding)
    monkeypatch.setattr(calib.runs.rivals, "calibrate", _none_of_the_padding)
    command = ["compare", str(lab / "experiment.toml"), "-o", str(lab / "models"), "--processes", "0"]
    result = CliRunner().invoke(app, command, obj=STAGES, env={"COLUMNS": "300"})
    said = " ".join(result.output.split())
    assert result.exit_code == 3
    assert "Cannot be calibrated: own-padding: the sweep lies outside what the surrogate covers." in said
    assert "To calibrate: 1 model (as-given)" in said
    assert re.search(r"own-padding +see below +- +could not be( made)?", said), result.output


def _none_of_the_padding(*given: Any, variant: Variant, **options: Any) -> Any:
    if variant.changes:
        raise InputError(Fault("the sweep lies outside what the surrogate covers"))
    return calibrate(*given, variant=variant, **options)
