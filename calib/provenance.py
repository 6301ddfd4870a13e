"""From the program that runs to what it is: version and commit of this package, Python, libraries that decide, platform."""

from __future__ import annotations

import os
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

#: The distribution that this package is of.
PROGRAM = "dielectric-elastomer-calibration"

#: Those that the numbers of a calibration come from, or that read or write them.
LIBRARIES = ("numpy", "scipy", "pandas", "emcee", "arviz", "h5netcdf")

# What git has to answer in [s].
_PATIENCE = 5.0


def version_of(package: str) -> str:
    """Version of an installed package; "not installed" if it is none."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def versions() -> dict[str, str]:
    """Versions of Python, of this package and of the libraries that decide, by name."""
    return {"python": platform.python_version()} | {name: version_of(name) for name in (PROGRAM, *LIBRARIES)}


def platform_in_words() -> str:
    """Operating system and processor.

    >>> "," in platform_in_words()
    True
    """
    return ", ".join(part for part in (platform.platform(), platform.machine()) if part)


@cache
def commit(package: Path | None = None) -> str:
    """The commit of this package where it runs from a clone, with "and changes" if files of it differ; "" where that is not so.

    Parameters
    ----------
    package : folder of a package, this one by default.

    Returns
    -------
    Forty hexadecimal digits, or "" for what was installed from a distribution, or where there is no git.
    """
    folder = Path(__file__).parent if package is None else package
    found = _git(folder, "rev-parse", "HEAD")
    # A clone of something else may have this package among its ignored files.
    if found is None or _git(folder, "ls-files", "--error-unmatch", "__init__.py") is None:
        return ""
    changes = _git(folder.parent, "status", "--porcelain", "--untracked-files=no", "--", folder.name, "models")
    return f"{found} and changes" if changes else found


def _git(folder: Path, *words: str) -> str | None:
    """What git says of a folder; None if it refuses, or is not there."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        done = subprocess.run(
            ["git", *words],
            cwd=folder,
            env={**kept, "GIT_OPTIONAL_LOCKS": "0"},
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            stdin=subprocess.DEVNULL,
            check=False,
        )
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
