"""A command in, a process of its own that outlives the page out; and from its folder back to what it is at and has said.

The process holds the lock on a file of its job as long as it lives, handed down from the page that began it, so that any later
page knows whether it lives, whatever became of the first; numbers of processes alone may be another's by then.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from calib.errors import Fault, InputError, in_shell
from calib.files import write_text
from calib.records import record_from_text, record_to_text
from calib.serve.workspace import Workspace

if sys.platform != "win32":
    import fcntl

_STARTING = threading.Lock()
# Characters of what a command has said that are shown.
_SHOWN = 8000
# Exit code of a command that was refused.
_REFUSED = 2
# Kind and format of what is kept of a job.
_RECORD = "job", 1


@dataclass(frozen=True)
class Job:
    """A command that was begun from the page.

    Attributes
    ----------
    name : of the run that it makes.
    words : the command, `calib` first.
    pid : of its process.
    begun : when, in words.
    said : what it has said, the last of it.
    alive : whether it goes on.
    code : exit code; None while it goes on, or if the page that began it is not there any more.
    """

    name: str
    words: tuple[str, ...]
    pid: int
    begun: str
    said: str
    alive: bool
    code: int | None = None

    @property
    def command(self) -> str:
        """The command as one types it."""
        return " ".join(map(in_shell, self.words))

    @property
    def refused(self) -> bool:
        """Whether it ended because something given to it cannot be used, and has written nothing."""
        return not self.alive and (self.code == _REFUSED if self.code is not None else self.said.startswith("Error: "))


_CHILDREN: dict[Path, subprocess.Popen[bytes]] = {}


def start(space: Workspace, name: str, words: Sequence[str]) -> None:
    """Begin a command of `calib` in the folder of a page, in a process that does not end with it.

    Parameters
    ----------
    space : the folder that it works in.
    name : of the run that it makes.
    words : the command, without `calib`.

    Raises
    ------
    InputError
        If there is one of this name that goes on.
    """
    folder = _folder(space, name)
    with _STARTING:
        if _alive(folder):
            raise InputError(Fault(f'"{name}" is being computed already', advice="Wait until it has ended, or cancel it"))
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "lock").open("wb") as lock, (folder / "said.txt").open("wb") as said:
            fds: tuple[int, ...] = ()
            if sys.platform != "win32":
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                fds = (lock.fileno(),)
            child = subprocess.Popen(
                [sys.executable, "-m", "calib", *words],
                cwd=space.folder,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=fds,
                env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "100"},
            )
        _CHILDREN[folder] = child
        record = {"words": ["calib", *words], "pid": child.pid, "begun": f"{datetime.now():%Y-%m-%d %H:%M:%S}"}
        write_text(folder / "job.json", record_to_text(*_RECORD, record))


def job_of(space: Workspace, name: str) -> Job | None:
    """What was begun under a name from this page or an earlier one; None if nothing was.

    Parameters
    ----------
    space : the folder.
    name : of the run.
    """
    folder = _folder(space, name)
    try:
        record = record_from_text(*_RECORD, (folder / "job.json").read_text(encoding="utf-8"))
        words, pid, begun = tuple(map(str, record["words"])), int(record["pid"]), str(record["begun"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    child = _CHILDREN.get(folder)
    code = child.poll() if child is not None and child.pid == pid else None
    said = ""
    with suppress(OSError):
        said = (folder / "said.txt").read_bytes()[-_SHOWN:].decode("utf-8", errors="replace")
    return Job(name, words, pid, begun, said, _alive(folder) and code is None, code)


def jobs(space: Workspace) -> list[Job]:
    """Everything that was begun and goes on.

    Parameters
    ----------
    space : the folder.
    """
    names = sorted(path.name for path in (space.page_folder / "jobs").glob("*") if path.is_dir())
    return [job for name in names if (job := job_of(space, name)) is not None and job.alive]


def cancel(space: Workspace, name: str) -> None:
    """Tell a command to stop, which keeps what it has computed.

    Parameters
    ----------
    space : the folder.
    name : of the run.

    Raises
    ------
    InputError
        If nothing of this name goes on that was begun from a page.
    """
    job = job_of(space, name)
    if job is None or not job.alive:
        advice = "Stop it with Ctrl-C in the terminal that it was begun in"
        raise InputError(Fault(f'no calibration "{name}" that was begun here goes on', advice=advice))
    with suppress(ProcessLookupError):
        os.kill(job.pid, signal.SIGTERM)


def _folder(space: Workspace, name: str) -> Path:
    return space.page_folder / "jobs" / name


def _alive(folder: Path) -> bool:
    """Whether the process of a job lives."""
    child = _CHILDREN.get(folder)
    if child is not None:
        return child.poll() is None
    if sys.platform == "win32":
        return False  # then `run_state` tells, by the run's own lock
    try:
        with (folder / "lock").open("rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False
