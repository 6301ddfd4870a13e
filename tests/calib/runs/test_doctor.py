"""The examination of an installation: what does not work is found, named, and said what to do about; what works is not."""

from __future__ import annotations

import errno
import hashlib
import os
import sys
import tempfile
from base64 import urlsafe_b64encode
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from calib.cli import app
from calib.runs import Examined, examine
from models.fem import FiniteElements
from models.response import Response
from models.sensor import Design, FloatArray
from models.surrogate import FAMILIES, Family
from models.surrogate import surrogate as of_surrogate


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


def test_a_surrogate_whose_file_is_damaged_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = of_surrogate._shipped
    data = bytearray(Path(str(shipped(FAMILIES["neo-hookean"]))).read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "damaged.npz").write_bytes(data)

    def damaged(family: Family) -> object:
        return tmp_path / "damaged.npz" if family.name == "neo-hookean" else shipped(family)

    monkeypatch.setattr(of_surrogate, "_shipped", damaged)
    found = _found(tmp_path)
    assert found["forward models"].health == "broken"
    wrong = [one for one in examine(tmp_path) if one.name == "surrogates" and one.health == "broken"]
    assert [("damaged.npz" in one.finding, "pip install" in one.action) for one in wrong] == [(True, True)]


def test_finite_elements_that_compute_something_else_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    respond = FiniteElements.respond

    def off(self: FiniteElements, design: Design, depth: FloatArray) -> Response:
        response = respond(self, design, depth)
        return Response(**{**vars(response), "force": 1.02 * response.force})

    monkeypatch.setattr(FiniteElements, "respond", off)
    found = _found(tmp_path)
    assert found["finite elements"].health == "broken"
    assert "force +1.96 %" in found["finite elements"].finding
    assert found["surrogate"].health == "fine"


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


def test_without_a_browser_it_works_and_says_what_for_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("calib.report.browser._APPLICATIONS", ())
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 0
    assert "- browser" in result.stdout
    assert "`calib report --pdf`" in result.stdout
