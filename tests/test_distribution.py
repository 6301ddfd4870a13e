"""What is published is what a clone holds: the source distribution all of it, the wheel what a user runs."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DATASET = ROOT / "datasets" / "padded_sensor"


@pytest.fixture(scope="module")
def tracked() -> list[str]:
    """Every file of the project by its path from the root."""
    if not (ROOT / ".git").exists():
        pytest.skip("only a clone knows which files belong to the project")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return sorted(name for name in listed.split("\0") if name and (ROOT / name).is_file())


def _built(kind: str, source: Path, folder: Path) -> Path:
    """Build a distribution of a source folder, as `pip` and `python -m build` do, but with the setuptools that is installed."""
    code = f"from setuptools import build_meta; build_meta.build_{kind}({str(folder)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=source, capture_output=True, check=True)
    (found,) = folder.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return found


@pytest.fixture(scope="module")
def sdist(tracked: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source distribution, unpacked."""
    folder = tmp_path_factory.mktemp("sdist")
    for name in tracked:
        copy = folder / "source" / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes((ROOT / name).read_bytes())
    with tarfile.open(_built("sdist", folder / "source", folder)) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (unpacked,) = (folder / "unpacked").iterdir()
    return unpacked


@pytest.fixture(scope="module")
def installed(sdist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a wheel, built of the source distribution, puts beside other packages."""
    folder = tmp_path_factory.mktemp("wheel")
    with zipfile.ZipFile(_built("wheel", sdist, folder)) as archive:
        archive.extractall(folder / "site-packages")
    return folder / "site-packages"


def _files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_the_source_distribution_holds_what_the_project_has_and_nothing_else(sdist: Path, tracked: list[str]) -> None:
    made = ("PKG-INFO", "setup.cfg")
    found = [name for name in _files(sdist) if name not in made and ".egg-info/" not in name]
    assert found == tracked, "see MANIFEST.in"


def test_the_wheel_holds_the_packages_with_their_data_and_the_example_and_nothing_else(
    installed: Path, tracked: list[str]
) -> None:
    packages = [name for name in tracked if name.startswith(("calib/", "models/"))]
    example = [f"calib/example/{path.name}" for path in DATASET.iterdir() if path.is_file()]
    found = [name for name in _files(installed) if ".dist-info/" not in name]
    assert found == sorted([*packages, *example]), "see setup.py and [tool.setuptools.package-data]"
    assert [name.split("/", 1)[1] for name in _files(installed) if name.endswith("LICENSE")] == ["licenses/LICENSE"]


def test_an_installed_package_writes_the_example_of_the_clone(installed: Path, tmp_path: Path) -> None:
    code = f"import sys; sys.path.insert(0, {str(installed)!r}); from calib.cli import app; app()"
    subprocess.run(
        [sys.executable, "-I", "-c", code, "example", "-o", "my demo"], cwd=tmp_path, check=True, capture_output=True
    )
    made = tmp_path / "my demo"
    assert _files(made) == sorted(path.name for path in DATASET.iterdir() if path.is_file())
    assert all((made / name).read_bytes() == (DATASET / name).read_bytes() for name in _files(made))
