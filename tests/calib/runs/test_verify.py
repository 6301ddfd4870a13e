"""What of a run and its inputs has changed is found, to the byte, and refused where it would be built on."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_run import QUICK, make_lab, quick
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.decision.requirement import Requirement
from calib.errors import InputError
from calib.runs import PageError, load_recommendation, load_run, members, recommend_in, renewed, report_in, verify
from calib.runs.calibration import Stages
from calib.runs.folder import Run
from calib.runs.ownership import owned
from calib.runs.page import page_of
from calib.sampling import FINGERPRINT
from models.surrogate.surrogate import load_surrogate

pytestmark = pytest.mark.usefixtures("all_undrawn")

REQUIREMENT = Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50)
RUN_FILES = ("run.json", "posterior.nc", "summary.json", "summary.csv", "recommendation.json", "report.html")
CHECKPOINT_FILES = ("checkpoint/manifest.json", "checkpoint/ensemble-0-start.npz", "checkpoint/ensemble-3-00000.npz")
#: Bytes of each file that are changed, one after the other.
N_CHANGE = 3
INPUTS = ("../experiment.toml", "../force.csv", "../mine.npz")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lab folder with a finished run that has a recommendation."""
    lab = make_lab(tmp_path_factory.mktemp("lab"))
    plan = lab / "experiment.toml"
    plan.write_text(plan.read_text(encoding="utf-8").replace('"closed form"', '"surrogate"'), encoding="utf-8")
    load_surrogate().save(lab / "mine.npz")
    done = quick(lab, seed=4, surrogate=lab / "mine.npz")
    recommend_in(done.run, REQUIREMENT, seed=1)
    return lab


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    """The run in a fresh copy of that folder."""
    shutil.copytree(made, tmp_path / "lab")
    return tmp_path / "lab" / "run"


def _command(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def _wrong(run: Path) -> dict[str, str]:
    return {Path(f.name).name: f.state for f in verify(run) if f.state != "fine"}


def test_everything_is_fine_as_it_was_written_also_where_run_and_inputs_moved_together(run: Path) -> None:
    assert _wrong(run) == {}
    done = _command("verify", run)
    assert done.exit_code == 0, done.output
    assert "files are as they were" in done.stdout
    names = {f.name for f in verify(run)}
    assert {*RUN_FILES, *CHECKPOINT_FILES, "forward model"} <= names
    assert {Path(name).name for name in names} >= {"experiment.toml", "force.csv", "mine.npz"}


def test_every_file_of_a_run_says_the_same_fingerprint(run: Path) -> None:
    mark = json.loads((run / "run.json").read_text())["fingerprint"]
    assert len(mark) == 64
    assert json.loads((run / "recommendation.json").read_text())["fingerprint"] == mark
    assert json.loads((run / "checkpoint" / "manifest.json").read_text())["fingerprint"] == mark
    assert load_run(run).posterior.attrs[FINGERPRINT] == mark
    assert mark in (run / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("file", [*RUN_FILES, *CHECKPOINT_FILES, *INPUTS])
def test_any_single_changed_byte_is_found(run: Path, file: str) -> None:
    path = run / file
    whole = path.read_bytes()
    rng = np.random.default_rng(len(file))
    for place in rng.integers(0, len(whole), N_CHANGE):
        damaged = bytearray(whole)
        damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        assert _wrong(run).get(path.name) == "changed", (file, place)
    path.write_bytes(whole[: len(whole) // 2])
    done = _command("verify", run)
    assert done.exit_code == 3, done.output
    assert path.name in done.stdout
    path.write_bytes(whole)


def test_what_was_moved_away_is_missing_and_not_changed(run: Path, made: Path) -> None:
    for file in ("summary.csv", "checkpoint/ensemble-3-00000.npz"):
        (run / file).unlink()
    moved = run.rename(run.parents[1] / "alone")
    assert _wrong(moved) == {"summary.csv": "missing", "ensemble-3-00000.npz": "missing"}  # inputs are where they were
    listing = json.loads((moved / "run.json").read_text())
    assert [Path(entry["file"]).parent for entry in listing["inputs"]] == [made] * 3
    assert verify(made / "run")


def test_inputs_that_are_nowhere_are_missing_and_commands_say_so(lab: Path) -> None:
    quick(lab)
    assert load_run(lab / "run").gone == ()
    (lab / "force.csv").rename(lab / "elsewhere.csv")
    assert _wrong(lab / "run") == {"force.csv": "missing"}
    said = " ".join(_command("report", lab / "run").stderr.split())
    assert "Note: Of the files that this calibration was made from force.csv cannot be found" in said


def test_a_result_copied_from_another_run_is_refused_where_it_would_be_built_on(run: Path) -> None:
    lab = run.parent
    quick(lab, "other", seed=5)
    recommend_in(load_run(lab / "other"), REQUIREMENT, seed=1)
    for file in ("posterior.nc", "recommendation.json"):
        own = (run / file).read_bytes()
        shutil.copy(lab / "other" / file, run / file)
        assert _wrong(run)[file] == "changed"
        for words in (("report", run), *([("recommend", run, "--force", "2 N")] if file == "posterior.nc" else [])):
            refused = _command(*words)
            assert refused.exit_code == 2, refused.output
            assert file in " ".join(refused.stderr.split())
        (run / file).write_bytes(own)
    (lab / "other" / "recommendation.json").unlink()
    shutil.copy(run / "recommendation.json", lab / "other")
    with pytest.raises(InputError, match="this recommendation is of another run"):
        load_recommendation(lab / "other")
    assert _wrong(lab / "other")["recommendation.json"] == "changed"


def test_a_run_is_not_gone_on_with_as_another(run: Path) -> None:
    before = {p: p.read_bytes() for p in run.rglob("*") if p.is_file()}
    with pytest.raises(InputError, match="the run in this folder is another: seed was 4 and is 6 now"):
        quick(run.parent, resume=True, seed=6)
    (run.parent / "experiment.toml").write_text((run.parent / "experiment.toml").read_text().replace('"0.7 MPa"', '"0.8 MPa"'))
    with pytest.raises(
        InputError, match=r"another: prior of young_modulus was .*0\.7 MPa.* and is .*0\.8 MPa.* now\. Put the inputs"
    ):
        quick(run.parent, resume=True)
    assert {p: p.read_bytes() for p in run.rglob("*") if p.is_file()} == before


def test_report_says_on_screen_and_page_what_has_changed_since(run: Path) -> None:
    with (run.parent / "force.csv").open("a") as file:
        file.write("\n")
    said = _command("report", run)
    assert said.exit_code == 3, said.output  # it has not converged
    words = "The lab file force.csv has changed since this calibration, which is of what it was before."
    assert words in " ".join(said.stderr.split())
    assert words in (run / "report.html").read_text(encoding="utf-8")
    assert _wrong(run) == {"force.csv": "changed"}


@pytest.mark.parametrize("name", ["run.json", "recommendation.json"])
def test_a_command_says_what_it_does_without(run: Path, name: str) -> None:
    assert load_run(run).gone == ()
    (run / name).unlink()
    assert len(load_run(run).gone) == 1
    assert f"Note: {run / name} is not there" in _command("report", run).stderr


def test_another_forward_model_is_said_and_nothing_is_recommended_with_it(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = load_run(run)
    assert found.notes == ()
    listing = json.loads((run / "run.json").read_text())
    assert listing["identity"]["forward model"] == f"{found.forward.name}, {found.forward.identity}"

    def retrained(*_: object) -> object:
        return replace(load_surrogate(), force_modes=1.01 * load_surrogate().force_modes)

    monkeypatch.setattr(members, "forward_of_experiment", retrained)
    again = load_run(run)
    assert again.notes == ("The surrogate is no longer the one that this run was calibrated with: its numbers have changed.",)
    with pytest.raises(InputError, match="no longer the one that this run was calibrated with"):
        recommend_in(again, REQUIREMENT, seed=1)
    assert _wrong(run) == {"forward model": "changed"}


def test_a_page_that_fails_leaves_its_reason_the_results_and_the_way_to_write_it(lab: Path) -> None:
    def broken(*_: object) -> str:
        raise RuntimeError("mathtext: $x^$")

    result = CliRunner().invoke(
        app,
        [*("calibrate", str(lab / "experiment.toml"), "-o", str(lab / "my run"), "--processes", "0")],
        obj=Stages(QUICK.sample, QUICK.spot_check, page=broken),
    )
    assert result.exit_code == 1, result.output
    said = " ".join(result.stderr.split())
    assert "the report could not be written (RuntimeError: mathtext: $x^$)" in said
    assert f'calib report "{lab / "my run"}"' in said
    assert "The chains have not converged" in result.stdout
    assert {p.name for p in (lab / "my run").iterdir()} == {
        *("run.json", "as_calibrated.toml", "checkpoint", "posterior.nc", "summary.json", "summary.csv")
    }
    assert _wrong(lab / "my run") == {}
    assert _command("report", lab / "my run").exit_code == 3
    assert (lab / "my run" / "report.html").is_file()
    assert _wrong(lab / "my run") == {}


def test_a_failing_page_keeps_the_recommendation_and_takes_the_old_page_away(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(run: Run, _: object, **__: object) -> str:
        raise ValueError("no font")

    monkeypatch.setattr(renewed, "page_of", broken)
    with pytest.raises(PageError, match="no font"):
        recommend_in(load_run(run), REQUIREMENT, seed=2)
    kept = load_recommendation(run)
    assert kept is not None
    assert kept.seed == 2
    assert not (run / "report.html").exists()
    assert _wrong(run) == {}
    done = _command("recommend", run, "--force", "2 N", "--padding", "0.5 mm:3 mm", "--steps", 5, "--draws", 50)
    assert done.exit_code == 1
    assert "calib report" in " ".join(done.stderr.split())


def test_a_command_killed_between_a_file_and_its_hash_is_told_and_led_out_of(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: object, **__: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(renewed, "page_of", killed)
    with pytest.raises(KeyboardInterrupt):
        recommend_in(load_run(run), REQUIREMENT, seed=2)
    assert _wrong(run) == {"run.json": "not finished", "recommendation.json": "not finished", "report.html": "not finished"}
    assert "calib recommend" in _command("verify", run).stdout
    monkeypatch.setattr(renewed, "page_of", page_of)
    report_in(load_run(run))
    assert _wrong(run) == {}


def test_writing_does_not_make_good_what_was_changed_before(run: Path) -> None:
    (run / "checkpoint" / "ensemble-0-00000.npz").write_bytes(b"changed")
    with (run / "recommendation.json").open("a") as file:
        file.write("\n")
    assert _command("report", run).exit_code == 2
    recommend_in(load_run(run), REQUIREMENT, seed=1)
    assert _wrong(run) == {"ensemble-0-00000.npz": "changed"}


def test_a_folder_in_use_is_neither_verified_nor_written(run: Path) -> None:
    found = load_run(run)
    with owned(run, "calib calibrate"):
        for words in (("verify", run), ("report", run), ("recommend", run, "--force", "2 N")):
            refused = _command(*words)
            assert refused.exit_code == 2, refused.output
            assert "this folder is in use by process" in refused.stderr
        load_run(run)  # reading needs no lock
    report_in(found)


def test_verify_of_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        refused = _command("verify", folder)
        assert refused.exit_code == 2
        assert "there is no run in this folder" in refused.stderr


def test_a_posterior_put_in_place_since_it_was_loaded_is_not_recommended_from(lab: Path) -> None:
    quick(lab)
    found = load_run(lab / "run")
    quick(lab, resume=True)
    with pytest.raises(InputError, match="was written anew while it was read"):
        recommend_in(found, REQUIREMENT, seed=1)
