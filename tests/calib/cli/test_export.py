"""The command `export`: files for a gripper from a run, all or none, and never from numbers that must not be used."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from calib.checks import AMBER_ALLOWS
from calib.cli import app
from calib.files import write_text
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm

FILES = ["README.md", "force_tables.csv", "force_tables.h", "force_tables.json", "force_tables.py", "taxels.json"]


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def _said(result: Result) -> str:
    return " ".join((result.stdout + result.stderr).split())


@pytest.fixture(scope="module")
def runs(make_posterior: Callable[..., Posterior], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with runs: one that may be used, and one that has not converged."""
    folder = tmp_path_factory.mktemp("runs")
    for name, converged in (("good", True), ("red", False)):
        (folder / name).mkdir()
        save_posterior(make_posterior(converged), folder / name / "posterior.nc", ClosedForm())
    return folder


def test_export_writes_all_files_with_the_verdict_and_where_they_come_from(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "good", "--padding", "3 mm", "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 0, _said(result)
    assert sorted(path.name for path in tmp_path.glob("gripper/*")) == FILES
    plain = json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))
    assert [t["name"] for t in plain["tables"]] == ["sensor 1", "sensor 2", "next specimen", "next specimen on 3 mm of padding"]
    assert plain["verdict"]["colour"] == "amber"
    assert len(plain["posterior_sha256"]) == 64
    assert f"Amber: the tables {AMBER_ALLOWS}." in _said(result)
    assert "next specimen on 3 mm of padding" in _said(result)


def test_strict_makes_amber_an_exit_code_of_3_with_all_files_written(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "good", "--padding", "3 mm", "--draws", 100, "--strict", "-o", tmp_path / "gripper")
    assert result.exit_code == 3
    assert sorted(path.name for path in tmp_path.glob("gripper/*")) == FILES


def test_a_red_run_is_not_exported(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "red", "-o", tmp_path / "gripper")
    assert result.exit_code == 3
    assert "is red: its numbers must not be used, and nothing is exported" in _said(result)
    assert "red, convergence" in _said(result)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--padding", "5.5"), "--padding"),
        (("--padding", "-1 mm"), "padding thickness must not be negative or infinite, got -1 mm"),
        (("--force", "0 N"), "force must be positive"),
        (("--parasitic", "2 pF"), 'Write "2 pF, 0.2 pF"'),
        (("--parasitic", "2 pF, 1 mm"), "--parasitic"),
        (("--noise", "10 nF"), "no reading of sensor 1 tells that it is pressed"),
    ],
)
def test_what_cannot_be_exported_is_refused_and_nothing_written(
    runs: Path, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    result = _run("export", runs / "good", *words, "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 2, _said(result)
    assert said in _said(result)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_exists_or_has_no_place_is_refused(runs: Path, tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for name, said in (("taken", "exists and is not overwritten"), ("link", "exists"), ("no/where", "does not exist")):
        result = _run("export", runs / "good", "-o", tmp_path / name)
        assert result.exit_code == 2
        assert said in _said(result)
    assert not list((tmp_path / "taken").iterdir())


@pytest.mark.parametrize("files", [0, 5])
def test_a_full_disk_leaves_nothing_behind(runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: int) -> None:
    written: list[Path] = []

    def full(path: Path, text: str) -> None:
        if len(written) == files:
            raise OSError(28, "No space left on device", str(path))
        written.append(path)
        write_text(path, text)

    monkeypatch.setattr("calib.runs.export.write_text", full)
    result = _run("export", runs / "good", "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 2
    assert "gripper: " in _said(result)
    assert not list(tmp_path.iterdir())


def test_a_damaged_run_is_refused(runs: Path, tmp_path: Path) -> None:
    content = bytearray((runs / "good" / "posterior.nc").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "posterior.nc").write_bytes(content)
    result = _run("export", tmp_path, "-o", tmp_path / "gripper")
    assert result.exit_code == 2
    assert "posterior.nc" in _said(result)
    assert not (tmp_path / "gripper").exists()
