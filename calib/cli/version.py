"""The option `--version`: of this package, of Python and of the packages that decide the numbers, and where it runs from."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated

import typer

import calib
from calib.cli.common import say

#: Those that the numbers of a calibration come from, or that write them.
_PACKAGES = ("numpy", "scipy", "pandas", "emcee", "arviz", "h5netcdf")


def _show(wanted: bool) -> None:
    if wanted:
        say(f"calib {_version('dielectric-elastomer-calibration')} in {Path(calib.__file__).parent}")
        say(f"Python {platform.python_version()}, " + ", ".join(f"{name} {_version(name)}" for name in _PACKAGES))
        raise typer.Exit


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def callback(
    _version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_show, help="Say which version this is, and of what, and exit.")
    ] = False,
) -> None:
    """Take the options that belong to no command."""
