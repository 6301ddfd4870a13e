"""Runs averaged into a run folder, which the commands on runs take like any other or refuse with advice."""

from __future__ import annotations

import json
import math
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parent))

from averages import believed, with_own_padding
from small_run import make_lab, quick

from calib.cli import app
from calib.errors import InputError
from calib.problem import specimen_design
from calib.runs import load_recommendation, load_run
from calib.sampling import Posterior, save_posterior, thin_draws

MakePosterior = Callable[..., Posterior]


def calib(*words: str | Path, code: int = 0) -> str:
    """What a command says."""
    result = CliRunner().invoke(app, list(map(str, words)), env={"COLUMNS": "200"})
    assert result.exit_code == code, result.output
    return " ".join(result.output.split())


@pytest.fixture(scope="module")
def runs(make_posterior: MakePosterior, tmp_path_factory: pytest.TempPathFactory, all_undrawn: None) -> Path:
    """A folder with two runs of the same data, one of other data, and the average of the two."""
    folder = tmp_path_factory.mktemp("runs")
    given = believed(make_posterior(n_specimen=1), 0.0)
    force = given.sweeps[0].channels["force"]
    moved = replace(given.sweeps[0], channels={**given.sweeps[0].channels, "force": replace(force, value=force.value + 0.1)})
    made = {
        "as-given": given,
        "own-padding": with_own_padding(given, 1.2, math.log(3.0)),
        "elsewhere": replace(given, sweeps=(moved,)),
    }
    for name, posterior in made.items():
        (folder / name).mkdir()
        save_posterior(posterior, folder / name / "posterior.nc")
    shutil.copytree(folder / "as-given", folder / "copied")
    said = calib("average", folder / "as-given", folder / "own-padding", "-o", folder / "average", "--by", "evidence")
    assert "Weighted by evidence" in said
    return folder


def test_the_folder_names_the_models_with_their_hashes_and_is_whole(runs: Path) -> None:
    said = calib("verify", runs / "average")
    for name in ("members/as-given.nc", "members/own-padding.nc", "posterior.nc", "summary.json"):
        assert f"fine {name}" in said
    summary = json.loads((runs / "average" / "summary.json").read_text(encoding="utf-8"))
    assert {m["name"]: round(m["weight"], 2) for m in summary["models"]} == {"as-given": 0.25, "own-padding": 0.75}
    assert all(
        len(m["sha256"]) == 64 and set(m["weights"]) == {"evidence", "stacking", "pseudo-bma"} for m in summary["models"]
    )
    assert "padding_young_modulus" in summary["parameters"]


def test_the_recommendation_is_of_both_models_and_says_what_of_its_doubt_is_their_choice(runs: Path) -> None:
    said = calib("recommend", runs / "average", "--force", "2 N", "--padding", "1 mm:1.2 mm", "--steps", "3")
    made = load_recommendation(runs / "average")
    assert made is not None
    assert {m.name: m.n_draw for m in made.of_models} == {"as-given": 100, "own-padding": 300}
    share = made.share_of_choice
    # Moduli a fifth apart, each known to a hundredth.
    assert share["young_modulus"] > 0.9
    assert f"The choice of model is {100 * share['change']:.0f} % of the variance of the signal" in said
    plain = json.loads((runs / "average" / "recommendation.json").read_text(encoding="utf-8"))
    assert plain["share_of_the_choice_of_model"] == pytest.approx(share)
    assert "padding of the sensor's own silicone or padding of its own material" in " ".join(made.conditions)


def test_a_specification_is_answered_by_both_models_and_by_each(runs: Path, tmp_path: Path) -> None:
    # Stiffer by a fifth, on padding of 0.9 of that: at 2 N it gives way by less.
    spec = tmp_path / "spec.toml"
    limits = '[limits]\nstroke = { at_most = "0.42 mm" }\n[padding]\nthickness = ["1 mm", "1.2 mm"]\nsteps = 3\n'
    text = f'[loads]\nforce = "2 N"\n{limits}'
    spec.write_text(text, encoding="utf-8")
    said = calib("recommend", runs / "average", "--spec", spec, "--draws", "400")
    made = load_recommendation(runs / "average")
    assert made is not None
    assert made.conformity is not None
    own = {m.name: (m.n_draw, m.probability) for m in made.conformity.of_models}
    assert {name: n for name, (n, _) in own.items()} == {"as-given": 100, "own-padding": 300}
    assert own["own-padding"][1] > own["as-given"][1]
    both = 0.25 * own["as-given"][1] + 0.75 * own["own-padding"][1]
    assert made.conformity.best.best_probability == pytest.approx(both)
    assert "choice of model" in {cause.name for cause in made.conformity.causes}
    assert "By model: as-given" in said


def test_the_report_lists_the_models(runs: Path) -> None:
    calib("report", runs / "average")
    page = (runs / "average" / "report.html").read_text(encoding="utf-8")
    assert "Models that were averaged" in page
    assert page.index("padding of its own modulus") < page.index("padding of the same silicone</td>")  # by weight
    assert "One silicone for sensor and padding" not in page  # which one model alone takes for granted


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["average", "as-given", "elsewhere", "-o", "new"], "are of different data"),
        (["average", "as-given", "as-given", "-o", "new"], "each once"),
        (["average", "as-given", "-o", "new"], "at least two runs"),
        (
            ["average", "as-given", "copied", "-o", "new"],
            "is a copy of as-given, which would count twice. Give each model once",
        ),
        (["average", "as-given", "average", "-o", "new"], "is an average itself. Give the runs that it is of"),
        (["average", "as-given", "own-padding", "-o", "as-given"], "not overwritten"),
        (["compare", "average", "as-given"], "Compare the runs that it is of"),
        (["calibrate", "experiment.toml", "-o", "average", "--resume"], "Resume the runs that it is of"),
        (["surrogate", "refine", "average"], "Refine the runs that it is of"),
    ],
)
def test_what_makes_no_average_is_refused_with_advice(
    runs: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: str
) -> None:
    monkeypatch.chdir(runs)
    assert said in calib(*words, code=2)
    assert not (runs / "new").exists()


def test_nobody_predicts_by_one_forward_model_for_all(runs: Path) -> None:
    run = load_run(runs / "average")
    assert [m.name for m in run.members] == ["as-given", "own-padding"]
    member = run.members[0].posterior
    design = specimen_design(member, thin_draws(member, 2, np.random.default_rng(1)), "sensor 1")
    with pytest.raises(InputError, match="each with a forward model of its own"):
        run.forward.respond(design, np.zeros(1))


def test_a_model_that_was_changed_is_found(runs: Path) -> None:
    path = runs / "average" / "members" / "as-given.nc"
    whole = path.read_bytes()
    try:
        path.write_bytes((runs / "elsewhere" / "posterior.nc").read_bytes())
        assert "changed members/as-given.nc" in calib("verify", runs / "average", code=3)
        assert "is not the one that was averaged" in calib("report", runs / "average", code=2)
        path.unlink()
        assert "missing members/as-given.nc" in calib("verify", runs / "average", code=3)
        assert "Average the runs again" in calib("report", runs / "average", code=2)
    finally:
        path.write_bytes(whole)


def test_a_run_keeps_its_experiment_which_may_be_edited_for_another_one_of_the_average(tmp_path: Path) -> None:
    file = make_lab(tmp_path) / "experiment.toml"
    first = file.read_text(encoding="utf-8")
    quick(tmp_path, "one", seed=1)
    file.write_text(first.replace('"0.7 MPa", 1.6', '"0.7 MPa", 1.8'), encoding="utf-8")
    quick(tmp_path, "two", seed=1)
    assert (tmp_path / "one" / "as_calibrated.toml").read_text(encoding="utf-8") == first
    one, two = (load_run(tmp_path / name) for name in ("one", "two"))
    assert (len(one.changed_inputs), len(two.changed_inputs)) == (1, 0)
    assert "as_calibrated.toml" in one.changed_inputs[0]

    def gates(average: str) -> list[str]:
        return [reason.gate for reason in load_run(tmp_path / average).verdict.reasons]

    calib("average", tmp_path / "one", tmp_path / "two", "-o", tmp_path / "both", "--by", "stacking", code=3)  # of a few steps
    assert "inputs" not in gates("both")
    assert "changed" not in calib("verify", tmp_path / "both")
    file.write_text(file.read_text(encoding="utf-8") + "# once more\n", encoding="utf-8")
    assert "changed" not in calib("verify", tmp_path / "both")
    calib("average", tmp_path / "one", tmp_path / "two", "-o", tmp_path / "later", "--by", "stacking", code=3)
    assert "inputs" in gates("later")
    (tmp_path / "one" / "as_calibrated.toml").write_text("\n", encoding="utf-8")
    assert "changed one/as_calibrated.toml" in calib("verify", tmp_path / "both", code=3).replace(f"{tmp_path}/", "").replace(
        "both/../", ""
    )
