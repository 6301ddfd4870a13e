"""What is odd about a folder, a name or a process in, how to make it so out."""

from __future__ import annotations

import ctypes
import errno
import os
import resource
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

_NOBODY, _KEEP_CAPABILITIES, _MAY_READ = 65534, 8, 1 << 2
CALIBRATE = ("calibrate", "experiment.toml", "-o", "RUN", "--seed", "5", "--processes", "0")


def _nothing(place: Path) -> None:
    """Nothing to prepare."""


def _no_more() -> None:
    """Nothing to do in the process."""


@dataclass(frozen=True)
class Oddity:
    """What is odd: how the folder is prepared, the command, its process and environment, and which exit codes are right.

    `refused` ones must end soon; `same` ones must give the draws of the undisturbed run; of `finished` ones the folder holds a
    run already; `cold` ones are of the installed command, as they are of how it starts; one of `names` must be in a refusal.
    """

    name: str
    words: tuple[str, ...] = CALIBRATE
    prepare: Callable[[Path], None] = _nothing
    before: Callable[[], None] = _no_more
    environment: Mapping[str, str | None] = field(default_factory=dict)
    codes: tuple[int, ...] = (0, 2, 3)
    refused: bool = False
    same: bool = False
    finished: bool = False
    cold: bool = False
    output: str = "RUN"
    names: tuple[str, ...] = ()


def named(name: str) -> Callable[[Path], None]:
    """Give experiment and specimen a name, as TOML writes it."""

    def prepare(place: Path) -> None:
        path = place / "experiment.toml"
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace('"crash"', f'"{name}"').replace('name = "a"', f'name = "{name}"'), encoding="utf-8")

    return prepare


def lab_file(make: Callable[[Path], None]) -> Callable[[Path], None]:
    """The lab file is made by this, rather than as it should be."""

    def prepare(place: Path) -> None:
        (place / "press.csv").unlink()
        make(place / "press.csv")

    return prepare


def experiment_file(make: Callable[[Path], None]) -> Callable[[Path], None]:
    """The experiment file is made by this, rather than as it should be."""

    def prepare(place: Path) -> None:
        (place / "experiment.toml").unlink()
        make(place / "experiment.toml")

    return prepare


def of_text(text: str) -> Callable[[Path], None]:
    """A file with this text."""

    def make(path: Path) -> None:
        path.write_text(text, encoding="utf-8")

    return make


def link(target: str) -> Callable[[Path], None]:
    """A symbolic link to this."""

    def make(path: Path) -> None:
        path.symlink_to(target)

    return make


def at(name: str, make: Callable[[Path], None]) -> Callable[[Path], None]:
    """Make something of this name in the folder."""
    return lambda place: make(place / name)


def folder(path: Path) -> None:
    """A folder."""
    path.mkdir()


def folder_of_others(path: Path) -> None:
    """A folder with somebody's file in it."""
    path.mkdir()
    (path / "thesis.txt").write_text("the only copy")


def read_only(place: Path) -> None:
    """Nobody may write into the folder."""
    place.chmod(0o555)


def nobody() -> None:
    """The process is of a user who may read all, as the interpreter may lie in root's folder, and write nothing of root's."""
    system = ctypes.CDLL(None, use_errno=True)
    system.prctl(_KEEP_CAPABILITIES, 1, 0, 0, 0)
    os.setgid(_NOBODY)
    os.setuid(_NOBODY)
    head, sets = (ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)(_MAY_READ, _MAY_READ)
    if system.capset(head, sets):
        raise OSError(ctypes.get_errno(), "this user's rights cannot be chosen")


def everybody(place: Path) -> None:
    """Every user may write into the folder, and get to it."""
    place.chmod(0o777)
    for parent in place.parents[:3]:
        parent.chmod(parent.stat().st_mode | 0o011)


def backwards() -> None:
    """The process has a clock that runs backwards, an hour in a second."""
    begun, real = time.time(), time.monotonic()
    time.time = lambda: begun - 3600 * (time.monotonic() - real)


def full(path: str) -> Callable[[], None]:
    """Standard output is this file."""

    def before() -> None:
        descriptor = os.open(path, os.O_WRONLY)
        os.dup2(descriptor, 1)

    return before


def broken_pipe() -> None:
    """Standard output is a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.dup2(writing, 1)
    os.close(writing)
    os.close(reading)


def closed(number: int) -> Callable[[], None]:
    """A descriptor is closed."""
    return lambda: os.close(number)


def umask(mask: int) -> Callable[[], None]:
    """The process makes files without these rights."""

    def before() -> None:
        os.umask(mask)

    return before


def memory() -> None:
    """The process may have 4 GB: what reads an endless file must not take all there is from others."""
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))


def few_files() -> None:
    """The process may have few files open."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (24, 24))


def no_locks() -> None:
    """A file system that has no locks, as some network disks."""

    def audit(event: str, args: tuple[object, ...]) -> None:
        if event.startswith("fcntl.") and "lock" in event:
            raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    sys.addaudithook(audit)


def both(*steps: Callable[..., None]) -> Callable[..., None]:
    """One after the other."""

    def together(*place: Path) -> None:
        for step in steps:
            step(*place)

    return together


def to(output: str) -> tuple[str, ...]:
    """The words that calibrate into this folder."""
    return (*CALIBRATE[:3], output, *CALIBRATE[4:])
