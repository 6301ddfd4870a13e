"""The examination of an installation: what does not work is found, named, and said what to do about; what works is not."""

from __future__ import annotations

import errno
import hashlib
import os
import sys
import tempfile
from base64 import urlsafe_b64encode
from collections.abc import Callable
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
from damaged import calib_with, copy_models
from typer.testing import CliRunner

from calib.cli import app
from calib.report import find_browser
from calib.runs import Examined, examine
from calib.runs.doctor import compared
from models.fem import FiniteElements
from models.layers import LayeredDesign
from models.response import Response
from models.sensor import Design, FloatArray
from models.surrogate import FAMILIES, NEO_HOOKEAN, is_shipped

#: Whether a browser is found beside the search path: where this system installs programs, which no test can change.
INSTALLED = find_browser({**os.environ, "PATH": ""}) is not None


def _found(folder: Path) -> dict[str, Examined]:
    return {one.name: one for one in examine(folder)}


def test_an_installation_that_works_is_said_to_and_nothing_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 0, result.output
    assert "Calibrations work here" in result.stdout
    assert "✗" not in result.stdout
    wanted = ("Python", "packages", "package files", "surrogates", "finite elements", "temporary folder", "disk", "processors")
    assert all(f"✓ {name}" in result.stdout for name in wanted)
    assert list(tmp_path.iterdir()) == []
    assert list(Path(tempfile.gettempdir()).glob("calib-doctor-*")) == []


def test_a_package_below_its_bound_and_one_that_is_not_there_are_named_with_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = metadata.version

    def version(name: str) -> str:
        if name in ("corner", "openpyxl"):
            raise metadata.PackageNotFoundError(name)
        return "3.0.2" if name == "emcee" else known(name)

    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setitem(sys.modules, "pint", None)
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 3
    said = " ".join(result.stdout.split())
    assert "emcee 3.0.2 is installed, >=3.1.6 is needed" in said
    assert 'pip install "emcee>=3.1.6"' in said
    assert "corner is not installed" in said
    assert "pint cannot be loaded" in said
    assert "- extra formats" in said
    assert "openpyxl is not installed" in said
    assert 'pip install "dielectric-elastomer-calibration[formats]"' in said
    assert "3 things do not work here." in said


def test_a_surrogate_whose_file_is_damaged_is_found(tmp_path: Path) -> None:
    file = copy_models(tmp_path) / "neo-hookean.npz"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    ended = calib_with(tmp_path, "doctor")
    assert ended.returncode == 3, ended.stderr
    others = ", ".join(name for name, family in FAMILIES.items() if family is not NEO_HOOKEAN and is_shipped(family))
    assert f"✗ surrogates        {file} is not a surrogate file" in ended.stdout
    assert f"✓ surrogates        {others}: whole, by their checksums" in ended.stdout
    assert "✓ finite elements" in ended.stdout
    assert "✗ forward models    ValueError: " in ended.stdout
    assert "✓ surrogate " not in ended.stdout
    assert ended.stdout.count("pip install --force-reinstall") == 2
    assert "2 things do not work here." in ended.stdout


class _Stiffer(FiniteElements):
    """Finite elements that compute something else."""

    def respond(self, design: Design | LayeredDesign, depth: FloatArray) -> Response:
        response = super().respond(design, depth)
        return replace(response, force=1.02 * response.force)


def test_finite_elements_that_compute_something_else_are_found() -> None:
    found = compared("finite elements", _Stiffer())
    assert found.health == "broken"
    assert "force +1.98 %" in found.finding
    assert "pip install" in found.action
    assert compared("finite elements", FiniteElements()).health == "fine"


def _no_locks(patch: pytest.MonkeyPatch, folder: Path) -> Path:
    def refused(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    patch.setattr("fcntl.flock", refused)
    return folder


def _no_folder(patch: pytest.MonkeyPatch, folder: Path) -> Path:
    return folder / "none"


def _a_file(patch: pytest.MonkeyPatch, folder: Path) -> Path:
    (folder / "file").write_text("", encoding="utf-8")
    return folder / "file"


def _no_temporary_folder(patch: pytest.MonkeyPatch, folder: Path) -> Path:
    patch.setattr(tempfile, "tempdir", str(folder / "none"))
    return folder


def _no_room(patch: pytest.MonkeyPatch, folder: Path) -> Path:
    patch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=1e6))
    return folder


@pytest.mark.skipif(sys.platform == "win32", reason="locks are of another kind there")
@pytest.mark.parametrize(
    ("made", "name", "said"),
    [
        (_no_locks, "this folder", "cannot lock files"),
        (_no_folder, "this folder", ""),
        (_a_file, "this folder", ""),
        (_no_temporary_folder, "temporary folder", "cannot be written"),
        (_no_room, "disk", "0.0 GB free"),
    ],
)
def test_a_place_that_cannot_be_used_is_found(
    made: Callable[[pytest.MonkeyPatch, Path], Path],
    name: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = _found(made(monkeypatch, tmp_path))[name]
    assert found.health == "broken"
    assert said in found.finding
    assert found.action


def test_a_file_of_the_package_that_has_changed_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "calib").mkdir()
    digest = urlsafe_b64encode(hashlib.sha256(b"as it was").digest()).rstrip(b"=").decode()
    for name, content in (("one.py", b"as it was"), ("other.py", b"as it is")):
        (tmp_path / "calib" / name).write_bytes(content)
    info = tmp_path / "dielectric_elastomer_calibration-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Name: dielectric-elastomer-calibration\nVersion: 0.1.0\n", encoding="utf-8")
    names = ("one.py", "other.py", "third.py")
    (info / "RECORD").write_text("".join(f"calib/{n},sha256={digest},9\n" for n in names), encoding="utf-8")
    monkeypatch.setattr(metadata, "distribution", lambda _: metadata.PathDistribution(info))
    found = _found(tmp_path)["package files"]
    assert found.health == "broken"
    assert found.finding == f"{os.path.join('calib', 'other.py')}, {os.path.join('calib', 'third.py')}: not as installed"


@pytest.mark.skipif(INSTALLED, reason="there is one where this system installs programs")
def test_without_a_browser_it_works_and_says_what_for_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 0
    assert "- browser" in result.stdout
    assert "`calib report --pdf`" in result.stdout
