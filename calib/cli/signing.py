"""The file of a secret key in, the key out, its password asked for in the terminal; for the commands that sign."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from calib.cli.common import err
from calib.errors import Fault, InputError, in_shell_path
from calib.signature import PASSWORD

if TYPE_CHECKING:
    from calib.signature import SecretKey


def secret_key(path: Path) -> SecretKey:
    """Read a secret key, and say so if others can.

    Parameters
    ----------
    path : of its file.

    Raises
    ------
    InputError
        If it is no such file, or its password cannot be had or is another.
    """
    from calib.signature import read_secret_key

    key = read_secret_key(path, lambda: _password(path))
    if os.name == "posix" and path.stat().st_mode & (stat.S_IRGRP | stat.S_IROTH):
        err().print(f"Note: others can read {path}: chmod 600 {in_shell_path(path)}", markup=False, soft_wrap=True)
    return key


def _password(path: Path) -> str:
    """The password of a key: from the environment, else from who sits here.

    Raises
    ------
    InputError
        If nobody does.
    """
    if given := os.environ.get(PASSWORD, ""):
        return given
    if not sys.stdin.isatty():
        raise InputError(Fault("this key has a password, and nobody can be asked for it", path, advice=f"Set {PASSWORD}"))
    return str(typer.prompt(f"Password of {path}", hide_input=True, err=True))
