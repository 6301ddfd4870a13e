"""From a path to a file that is there whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from calib.errors import Fault, InputError


@contextmanager
def whole_file(path: Path, advice: str = "Create it, or choose another") -> Iterator[Path]:
    """A name beside `path` to write to, which becomes `path` when all went well and is gone when not.

    Raises
    ------
    InputError
        If the folder does not exist, with `advice`.
    """
    require_folder(path, advice)
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=path.suffix)
    os.close(descriptor)
    try:
        yield Path(name)
        open_up(Path(name), 0o666)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def require_folder(path: Path, advice: str = "Create it, or choose another") -> None:
    """Refuse a file whose folder does not exist.

    Raises
    ------
    InputError
        If so, with `advice`.
    """
    if not path.absolute().parent.is_dir():
        raise InputError(Fault(f"the folder {path.parent} does not exist", path, advice=advice))


def open_up(path: Path, mode: int) -> None:
    """Give a file or folder that was made for its owner alone the permissions that others have."""
    umask = os.umask(0)
    os.umask(umask)
    path.chmod(mode & ~umask)
