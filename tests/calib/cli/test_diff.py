"""The command `diff`: two runs side by side on the screen, as JSON and as a picture."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def _said(result: Result) -> str:
    return " ".join((result.stdout + result.stderr).split())


@pytest.fixture(scope="module")
def runs(make_posterior: Callable[..., Posterior], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with runs: two of other data, and one that has not converged."""
    folder = tmp_path_factory.mktemp("runs")
    first, single, red = make_posterior(), make_posterior(n_specimen=1), make_posterior(converged=False)
    # Other readings, of which the same is found.
    other = tuple(
        replace(sweep, files=tuple((f"new {name}", "12" * 32) for name, _ in sweep.files))
        for sweep in make_posterior(n_specimen=1, seed=5).sweeps
    )
    second = replace(single, sweeps=other, experiment=replace(single.experiment, law="gent"))
    second = replace(second, experiment=replace(second.experiment, law="neo-hookean", name="Another lot"))
    for name, posterior in (("lot 1", first), ("lot [2]", second), ("red", red)):
        (folder / name).mkdir()
        save_posterior(posterior, folder / name / "posterior.nc", ClosedForm())
    return folder


def test_diff_shows_unknowns_and_all_that_is_not_the_same(runs: Path, tmp_path: Path) -> None:
    result = _run("diff", runs / "lot 1", runs / "lot [2]", "-o", tmp_path / "curves.png")
    assert result.exit_code == 0, _said(result)
    said = _said(result)
    assert "lot [2]" in said
    assert "in one run only" in said  # the second specimen
    assert "Another lot" in said
    assert "file of sensor 1: new sensor 1_force.csv" in said
    assert "Taken for one and the same in both" in said
    assert (tmp_path / "curves.png").stat().st_size > 10_000


def test_runs_of_one_name_are_told_apart_by_their_folders_and_a_press_of_one_alone_is_one_line(
    runs: Path, tmp_path: Path
) -> None:
    for lab, name in (("monday", "lot 1"), ("friday", "lot [2]")):
        shutil.copytree(runs / name, tmp_path / lab / "run")
    result = _run("diff", tmp_path / "monday" / "run", tmp_path / "friday" / "run")
    said = _said(result)
    assert Path("monday", "run").as_posix() in said
    assert str(tmp_path) not in result.stdout
    table = result.stdout[result.stdout.index("not the same") :]
    assert "press sensor 2" in table
    assert " of sensor 2" not in table
    assert "null" not in table


def test_diff_prints_json_for_programs(runs: Path) -> None:
    result = _run("diff", runs / "lot 1", runs / "lot [2]", "--json")
    plain = json.loads(result.stdout)
    assert [run["name"] for run in plain["runs"]] == ["lot 1", "lot [2]"]
    modulus = plain["unknowns"]["young_modulus"]
    assert modulus["unit"] == "Pa"
    assert abs(modulus["z"]) < 3
    assert modulus["first"]["sd"] > 0
    assert plain["unknowns"]["sensor_thickness[sensor 2]"]["second"] is None


def test_diff_of_a_run_with_itself_weighs_nothing(runs: Path) -> None:
    result = _run("diff", runs / "lot 1", runs / "lot 1")
    assert result.exit_code == 0
    assert "No difference is weighed" in _said(result)
    assert "lot 1 (second)" in _said(result)


def test_diff_with_a_red_run_exits_with_3_and_says_which(runs: Path) -> None:
    result = _run("diff", runs / "lot [2]", runs / "red")
    assert result.exit_code == 3
    assert result.stderr.splitlines()[-1] == "Exit code 3: the verdict on red is red: its numbers must not be used."


@pytest.mark.parametrize(
    ("output", "said"), [("a.txt", "a picture ends in .png, .svg or .pdf"), ("no/a.png", "does not exist")]
)
def test_diff_refuses_a_picture_that_it_cannot_write(runs: Path, tmp_path: Path, output: str, said: str) -> None:
    result = _run("diff", runs / "lot 1", runs / "lot [2]", "-o", tmp_path / output)
    assert result.exit_code == 2
    assert said in _said(result)
    assert not list(tmp_path.iterdir())


def test_diff_refuses_what_is_no_run(runs: Path, tmp_path: Path) -> None:
    result = _run("diff", runs / "lot 1", tmp_path)
    assert result.exit_code == 2
    assert "there is no finished calibration in this folder" in _said(result)


@pytest.mark.parametrize(("command", "other"), [("diff", "calib compare"), ("compare", "calib diff")])
def test_each_help_says_what_the_other_is_for(command: str, other: str) -> None:
    assert other in " ".join(_run(command, "--help").stdout.split())
