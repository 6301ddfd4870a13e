"""From a path to a file that is there whole or not at all, and from a file to its hash."""

from __future__ import annotations

import errno
import hashlib
import os
import re
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from calib.errors import Fault, InputError

# What the names of unfinished files have in common: a dot in front, and this before the ending.
_PART = ".part"
_UNFINISHED = re.compile(rf"\..*\.[0-9a-f]{{8}}{re.escape(_PART)}")


@contextmanager
def whole_file(path: Path, advice: str = "Create it, or choose another", *, mode: int = 0o666) -> Iterator[Path]:
    """Write a file so that at any moment, power cuts included, it is there whole or not at all.

    What is written to the name that this gives becomes `path` when the block ends well: flushed to the disk first, then named,
    in place of an earlier `path` if there was one. When the block fails, nothing is left behind.

    Parameters
    ----------
    path : the file to be.
    advice : what to do if its folder does not exist.
    mode : who may read and write it, from its first byte on; the system's mask takes away from it.

    Yields
    ------
    A name beside `path`, with the same ending, of an empty file with the permissions that new files have.

    Raises
    ------
    InputError
        If the folder does not exist.
    OSError
        If the file cannot be written, with its name, whatever could not be done.
    """
    require_folder(path, advice)
    part = _part(path)
    with naming(path, part):
        part.touch(mode, exist_ok=False)
        try:
            yield part
            _flush(part)
            os.replace(part, path)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
    _flush_folder(path.parent)


def write_text(path: Path, text: str, advice: str = "Create it, or choose another -o", *, mode: int = 0o666) -> None:
    """Write a text file in UTF-8, whole or not at all.

    Parameters
    ----------
    path : the file to be.
    text : its content; lines end in a line feed on every system.
    advice : what to do if the folder does not exist.
    mode : as of `whole_file`.

    Raises
    ------
    InputError
        If the folder does not exist.
    """
    with whole_file(path, advice, mode=mode) as whole:
        whole.write_text(text, encoding="utf-8", newline="\n")


def remove_leftovers(folder: Path) -> None:
    """Remove the unfinished files that killed processes left in a folder."""
    for leftover in folder.glob(f".*{_PART}*"):
        ours = _UNFINISHED.match(leftover.name) is not None
        if ours and (not leftover.is_dir() or leftover.is_symlink()):
            leftover.unlink(missing_ok=True)


def require_folder(path: Path, advice: str = "Create it, or choose another") -> None:
    """Refuse to write a file whose folder does not exist, before anything long is computed for it.

    Parameters
    ----------
    path : the file that is to be written.
    advice : what the message tells the user to do.

    Raises
    ------
    InputError
        If the folder of `path` does not exist.
    """
    if not path.absolute().parent.is_dir():
        raise InputError(Fault(f"the folder {path.absolute().parent} does not exist", path, advice=advice))


def require_writable(path: Path, advice: str = "Create it, or choose another") -> None:
    """Refuse to write a file that cannot be written, before anything long is computed for it; leaves nothing behind.

    Parameters
    ----------
    path : the file that is to be written.
    advice : what the message tells the user to do if its folder does not exist.

    Raises
    ------
    InputError
        If the folder does not exist, or `path` is a folder itself.
    OSError
        If no file can be made there.
    """
    require_folder(path, advice)
    if path.is_dir():
        raise InputError(Fault("this is a folder, and a file is to be written", path, advice="Choose another name"))
    part = _part(path)
    with naming(path, part):
        part.open("xb").close()
        part.unlink()


def open_up(path: Path, mode: int) -> None:
    """Give a file or folder that was made for its owner alone the permissions that others have.

    Parameters
    ----------
    path : the file or folder.
    mode : what is asked for, such as 0o777; the system's mask takes away from it.
    """
    umask = os.umask(0)
    os.umask(umask)
    path.chmod(mode & ~umask)


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal digits.

    Raises
    ------
    OSError
        If it cannot be read, or is no file but a pipe, which would be waited for.
    """
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "no regular file", str(path))
    return hashlib.sha256(path.read_bytes()).hexdigest()


def real_path(path: Path) -> Path:
    """Where a path leads, all links followed; one that leads round in a circle stays as it is, for who opens it to say so.

    >>> real_path(Path("/tmp/../tmp")) == real_path(Path("/tmp"))
    True
    """
    return Path(os.path.realpath(path))


def _part(path: Path) -> Path:
    """A new name for the unfinished file."""
    return path.with_name(f".{path.stem}.{secrets.token_hex(4)}{_PART}{path.suffix}")


@contextmanager
def naming(path: Path, part: Path | None = None) -> Iterator[None]:
    """Let what the system cannot do with a file be said of its path: of one that is open the system names none.

    Parameters
    ----------
    path : of the file.
    part : name of the unfinished file that is written in its place, if there is one.

    Raises
    ------
    OSError
        What was raised inside, with that name.
    """
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(part)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def _flush(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _flush_folder(folder: Path) -> None:
    """Make the names in a folder last, where the system has a way to; some network drives have none and say so."""
    if hasattr(os, "O_DIRECTORY"):
        with suppress(OSError):
            descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
