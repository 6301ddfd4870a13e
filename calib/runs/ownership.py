"""A run folder in, this process as the only one that writes into it out; or who else does.

The lock is one of the operating system on the file `.lock` in the folder, so that it ends with its process, however that ends.
The file says who holds it, for people; that it exists means nothing.
"""

from __future__ import annotations

import errno
import json
import os
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from calib.errors import Fault, InputError
from calib.files import naming, remove_leftovers

_LOCK = ".lock"

# Looking who owns a folder takes its lock for a moment: an owner tries again.
_TRIES, _PAUSE = 5, 0.05

# Where the one locked byte lies on Windows, where nobody else may read what is locked.
_FAR = 1 << 30

_HELD = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)


@contextmanager
def owned(folder: Path, command: str) -> Iterator[None]:
    """Own a run folder inside a `with` block: no other process can own it then. The folder is made if it does not exist.

    Unfinished files that a killed owner left, in it or one below, are removed, and a folder that is empty in the end is, too.

    Parameters
    ----------
    folder : of the run.
    command : what this process does, to be told to others.

    Raises
    ------
    InputError
        If another process owns the folder, or its file system has no locks.
    """
    descriptor = _lock_of_existing(folder)
    try:
        for place in (folder, *(path for path in folder.iterdir() if path.is_dir() and not path.is_symlink())):
            remove_leftovers(place)
        said = {"pid": os.getpid(), "host": socket.gethostname(), "since": f"{datetime.now():%Y-%m-%d %H:%M:%S}"}
        with naming(folder / _LOCK):
            os.ftruncate(descriptor, 0)
            os.write(descriptor, json.dumps({**said, "command": command}).encode())
        yield
    finally:
        _release(folder, descriptor)
        with suppress(OSError):
            folder.rmdir()


def owner_of(folder: Path) -> str:
    """Say in words which process owns a run folder; empty if none does. Needs no permission to write."""
    path = folder / _LOCK
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return ""
    try:
        _lock(descriptor, shared=True)
    except OSError as error:
        return _said(path) if error.errno in _HELD else ""
    finally:
        os.close(descriptor)
    return ""


def is_bare(folder: Path) -> bool:
    """Whether nothing lies in a folder but what a process leaves that was killed before it began a run."""
    return all(path.name == _LOCK or path.name.startswith(".run.") for path in folder.iterdir())


def _lock_of_existing(folder: Path) -> int:
    """Open and lock the lock file of a folder that stays: another owner may remove both as it ends."""
    path = folder / _LOCK
    for left in reversed(range(_TRIES)):
        folder.mkdir(exist_ok=True)
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except FileNotFoundError:
            continue
        try:
            _lock(descriptor, shared=False)
            if _is_still(path, descriptor):
                return descriptor
            os.close(descriptor)
        except OSError as error:
            os.close(descriptor)
            if error.errno not in _HELD:
                with suppress(OSError):
                    path.unlink()
                    folder.rmdir()
                advice = "Keep runs on a disk of this computer"
                message = f"its file system cannot lock files ({error.strerror}), so that two calibrations could mix here"
                raise InputError(Fault(message, folder, advice=advice)) from None
            if not left:
                advice = "Wait until it has ended, or choose another folder"
                raise InputError(Fault(f"this folder is in use by {_said(path)}", folder, advice=advice)) from None
            time.sleep(_PAUSE)
    raise InputError(Fault("this folder is made and removed by another process", folder, advice="Try again"))


def _is_still(path: Path, descriptor: int) -> bool:
    """Whether a path still leads to the open file."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _said(path: Path) -> str:
    """Who holds a lock, by what the file says; it may be read before its owner has written it."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return f"process {found['pid']} on {found['host']} since {found['since']} ({found['command']})"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int, *, shared: bool) -> None:
        os.lseek(descriptor, _FAR, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        if shared:
            msvcrt.locking(descriptor, msvcrt.LK_UNLCK, 1)
        os.lseek(descriptor, 0, os.SEEK_SET)

    def _release(folder: Path, descriptor: int) -> None:
        os.lseek(descriptor, _FAR, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_UNLCK, 1)
        os.close(descriptor)
        with suppress(OSError):  # another process has it open, which Windows does not part with
            (folder / _LOCK).unlink()

else:
    import fcntl

    def _lock(descriptor: int, *, shared: bool) -> None:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)

    def _release(folder: Path, descriptor: int) -> None:
        with suppress(OSError):
            (folder / _LOCK).unlink()
        os.close(descriptor)
