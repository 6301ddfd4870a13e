"""The program says what it is, and takes no other clone for its own."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from calib.provenance import PROGRAM, commit, versions

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="no git")


def _git(folder: Path, *words: str) -> str:
    who = ("-c", "user.name=A", "-c", "user.email=a@b.org", "-c", "commit.gpgsign=false")
    return subprocess.run(["git", *who, *words], cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A clone with a package that is tracked."""
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "__init__.py").write_text("")
    _git(tmp_path, "init", "-q")
    _git(tmp_path, "add", "package")
    _git(tmp_path, "commit", "-q", "-m", "first")
    return tmp_path


def test_the_commit_of_a_clone_is_told_and_that_files_of_it_differ(clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GIT_DIR", "/nowhere")
    found = commit.__wrapped__(clone / "package")
    monkeypatch.delenv("GIT_DIR")
    assert found == _git(clone, "rev-parse", "HEAD")
    (clone / "package" / "__init__.py").write_text("changed = True")
    assert commit.__wrapped__(clone / "package") == f"{found} and changes"


def test_a_package_that_lies_in_the_clone_of_something_else_has_no_commit(clone: Path, tmp_path: Path) -> None:
    (clone / "env").mkdir()
    (clone / "env" / "__init__.py").write_text("")
    assert commit.__wrapped__(clone / "env") == ""
    assert commit.__wrapped__(clone / "nowhere") == ""


def test_versions_are_those_of_what_decides() -> None:
    assert versions().keys() >= {"python", PROGRAM, "numpy", "emcee"}
