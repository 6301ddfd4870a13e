"""The number of a file operation in, what comes of a calibration that dies there, or for which it fails, out."""

from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

from crashes.case import Case, failed, recovered, with_verdict
from crashes.command import limited, start
from crashes.lab import Lab

#: What happens at the operation: the process dies, or the operation fails: from there on, or once.
WAYS = {"death": None, "disk full": errno.ENOSPC, "no permission": errno.EACCES, "input/output error": errno.EIO}
_ONCE = ("input/output error",)
_RENAMING = ("os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.link", "os.symlink", "os.truncate")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
#: Free space of disks that are full [kB] and sizes that no file may exceed [kB].
DISKS = (0, 4, 8, 16, 24, 40, 60, 80, 100, 120, 150, 200, 240, 280, 300, 320, 340, 360, 400, 440, 480, 520, 560, 600, 700, 800)
LIMITS = (0, 1, 4, 8, 20, 60, 120, 240)


def watch(act: Callable[[int, str], None]) -> None:
    """Call `act` with number and name of each operation of this process that changes files, before it is done.

    Seen are those that Python does: opening for writing, renaming, removing, making folders, locking, flushing to disk.
    """
    count = 0

    def tell(name: str) -> None:
        nonlocal count
        count += 1
        act(count, name)

    def audit(event: str, args: tuple[Any, ...]) -> None:
        if event == "open":
            path, _, flags = args
            quiet = (
                isinstance(path, int) or str(os.fsdecode(path)).startswith(("/dev/", "/proc/")) or "__pycache__" in str(path)
            )
            if not quiet and isinstance(flags, int) and flags & _WRITING:
                tell(f"open {os.fsdecode(path)}")
        elif event in _RENAMING:
            tell(f"{event[3:]} {args[0] if isinstance(args[0], int) else os.fsdecode(args[0])}")
        elif event in ("fcntl.flock", "fcntl.lockf", "sqlite3.connect"):
            tell(event)

    def flush(descriptor: Any) -> None:
        tell("fsync")
        _fsync(descriptor)

    system: Any = os
    _fsync, system.fsync = os.fsync, flush
    sys.addaudithook(audit)


@cache
def operations(lab: Lab) -> tuple[str, ...]:
    """Names of all operations of an undisturbed calibration, in their order."""
    place = lab.fresh("operations")
    listing = place / "listing"
    descriptor = os.open(listing, os.O_WRONLY | os.O_CREAT, 0o644)

    def note(number: int, name: str) -> None:
        os.write(descriptor, f"{name}\n".encode())

    start(lab.calibrate(), place, lab.log, before=lambda: watch(note)).wait()
    os.close(descriptor)
    return tuple(listing.read_text().splitlines())


def can_mount() -> bool:
    """Whether this user may mount a small disk."""
    return os.geteuid() == 0 and subprocess.run(["which", "mount"], capture_output=True, check=False).returncode == 0


def _plan(lab: Lab) -> list[tuple[str, int]]:
    """All cases, way and number of the operation or way and size: all deaths in any order, then all errors."""
    count = len(operations(lab))
    deaths = [("death", n) for n in range(1, count + 1)]
    errors = [("full disk of kB", size) for size in DISKS if can_mount()] + [("files of kB at most", size) for size in LIMITS]
    errors += [(way, n) for way in list(WAYS)[1:] for n in range(1, count + 1)]
    return random.Random(1).sample(deaths, count) + random.Random(1).sample(errors, len(errors))


def size(lab: Lab, asked: int) -> int:
    """All there are, or as many as asked for if that is less."""
    return min(asked, len(_plan(lab))) if asked else len(_plan(lab))


def case(lab: Lab, number: int) -> Case:
    """Disturb one operation of a calibration, then go on.

    Parameters
    ----------
    lab : where.
    number : of the case.

    Returns
    -------
    What came of it.
    """
    way, which = _plan(lab)[number]
    place = lab.fresh(f"operations-{number}")
    if way == "full disk of kB":
        return _full_disk(lab, number, place, which)
    if way == "files of kB at most":
        done = Case("operations", number, f"no file may be larger than {which} kB")
        ended = start(lab.calibrate(), place, lab.log, before=limited(1024 * which)).wait()
        names = _NAMES if which else ("",)  # what is said goes into a file, too: where none may grow, the exit code is all
        return failed(done, ended, names) or recovered(_with(done, ended.code, ended.last), lab, place)
    name = operations(lab)[which - 1]
    done = Case("operations", number, f"{way} before operation {which}, {name}")
    ended = start(lab.calibrate(), place, lab.log, before=lambda: watch(_act(way, which))).wait()
    if way == "death":
        if ended.code != -signal.SIGKILL:
            return with_verdict(done, "wrong", f"not killed, {ended.code}: {ended.last}")
        return recovered(done, lab, place)
    return failed(done, ended, _NAMES) or recovered(_with(done, ended.code, ended.last), lab, place)


_NAMES = ("RUN", "posterior.nc", "summary", "report.html", "run.json", "checkpoint", "ensemble", "manifest")


def _with(case: Case, code: int, said: str) -> Case:
    return Case(case.part, case.number, case.what, case.outcome, f"[{code}] {said[-160:]}")


def _act(way: str, which: int) -> Callable[[int, str], None]:
    number = WAYS[way]

    def act(count: int, name: str) -> None:
        if count < which or (way in _ONCE and count > which):
            return
        if number is None:
            _die()
        if name.split()[0] in ("remove", "rmdir") and way == "disk full":
            return  # a full disk lets files be removed
        what = name.partition(" ")[2]
        raise OSError(number, os.strerror(number), None if what.isdigit() else what or None)  # of an open file none is said

    return act


def _die() -> NoReturn:
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError("killed")


def _full_disk(lab: Lab, number: int, place: Path, kilobytes: int) -> Case:
    """A disk with this much room for the run, really full; then larger."""
    done = Case("operations", number, f"disk with {kilobytes} kB free")
    disk = place / "disk"
    disk.mkdir()
    # The folder and pages of 4 kB take room of their own; the least that can be mounted is one page.
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={4 + kilobytes}k", "calib-crash", str(disk)], check=True)
    try:
        output = "disk/RUN"
        ended = start(lab.calibrate(output=output), place, lab.log).wait()
        if bad := failed(done, ended, _NAMES):
            return bad
        subprocess.run(["mount", "-o", "remount,size=64m", str(disk)], check=True)
        return recovered(_with(done, ended.code, ended.last), lab, place, output=output)
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
