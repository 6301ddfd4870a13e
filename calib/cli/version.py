"""The option `--version`: of this package, of Python and of the packages that decide the numbers, and where it runs from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import calib
from calib.cli.common import say
from calib.provenance import PROGRAM, versions


def _show(wanted: bool) -> None:
    if wanted:
        known = versions()
        say(f"calib {known.pop(PROGRAM)} in {Path(calib.__file__).parent}")
        say(f"Python {known.pop('python')}, " + ", ".join(f"{name} {number}" for name, number in known.items()))
        raise typer.Exit


def callback(
    _version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_show, help="Say which version this is, and of what, and exit.")
    ] = False,
) -> None:
    """Take the options that belong to no command."""
