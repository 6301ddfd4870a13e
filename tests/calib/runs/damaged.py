"""A copy of the package `models` that may be damaged, and commands of calib that have it instead of the one that is tested."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import calib
import models


def copy_models(folder: Path) -> Path:
    """Copy the package `models` into a folder; gives where the surrogates of the copy lie."""
    shutil.copytree(Path(models.__file__).parent, folder / "models")
    return folder / "models" / "surrogate" / "data"


def calib_with(folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """Run a command of calib that has the copy in a folder.

    Parameters
    ----------
    folder : that `copy_models` was given, in which the command runs, too.
    words : of the command.
    """
    path = os.pathsep.join([str(folder), str(Path(calib.__file__).parents[1])])
    command = [sys.executable, "-m", "calib", *map(str, words)]
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONUTF8": "1"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, encoding="utf-8", check=False)
