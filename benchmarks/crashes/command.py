"""Words of a command line in, a process that runs them out; and how that process ended."""

from __future__ import annotations

import atexit
import gc
import importlib
import io
import os
import pkgutil
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

#: Longest that a command of the small experiment may take before it counts as hanging [s].
LIMIT = 240.0
#: What the pages say a command may end with; 1 if all but the page is written, 130 and 143 after SIGINT and SIGTERM.
CODES = (0, 1, 2, 3, 130, 143)
_ANSI = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
_DRAWN: list[tuple[Any, str, Any]] = []
_WALKERS, _BLOCKS, _BLOCK_STEPS, _EFFECTIVE, _ACCURACY = 8, 3, 20, 200.0, 3e-2
# Of the search for the modes and the start of an ensemble, and of the spot check: its draws.
_SMALL = {
    **{"N_START_DRAWS": 64, "N_BEST": 1, "N_ANY": 1, "N_UNEXPLAINED": 1},
    **{"ROUNDS": (4, 4), "ENOUGH_ACCEPTED": 0.2, "N_DRAW": 1},
}


@dataclass(frozen=True)
class Ended:
    """A command that has ended: exit code (negative for a signal), what it printed, duration [s], whether it hung."""

    code: int
    said: str
    complained: str
    seconds: float
    hung: bool = False

    @property
    def text(self) -> str:
        """All that it printed, without colours."""
        return _ANSI.sub("", self.said + self.complained)

    @property
    def crashed(self) -> str:
        """Why it counts as a crash, or nothing."""
        if self.hung:
            return "hang"
        if "Traceback" in self.text or (self.code == 1 and "Error: " not in self.text):
            return "traceback"
        return "death" if self.code < 0 or self.code not in CODES else ""

    @property
    def last(self) -> str:
        """Its last words, or those where it broke, in a line."""
        lines = [line.strip(" │╭╰─╮╯") for line in self.text.splitlines()]
        return " | ".join(line for line in lines if line)[-300:]


@dataclass(frozen=True)
class Running:
    """A process of its own group that runs a command, the files that take what it prints, and when it began."""

    pid: int
    said: Path
    complained: Path
    begun: float

    def kill(self, number: int = signal.SIGKILL, *, group: bool = True) -> bool:
        """Send a signal to the process, or to all of its group; whether there was something to send it to."""
        try:
            (os.killpg if group else os.kill)(self.pid, number)
        except ProcessLookupError:
            return False
        return True

    def poll(self) -> int | None:
        """The exit code (negative for a signal), or None while it runs."""
        found = os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        if found is None:
            return None
        return found.si_status if found.si_code == os.CLD_EXITED else -found.si_status

    def wait(self, limit: float = LIMIT) -> Ended:
        """Wait until it has ended, once; what takes longer than the limit [s] is killed and counts as hanging."""
        hung = False
        while (code := self.poll()) is None:
            if time.monotonic() - self.begun > limit:
                hung = self.kill()
            time.sleep(0.005)
        seconds = time.monotonic() - self.begun
        os.waitpid(self.pid, 0)
        return Ended(code, _text(self.said), _text(self.complained), seconds, hung)


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8", "replace") if path.exists() else ""


def load_all() -> None:
    """Load every module that a command may load, so that a process forked from here need not."""
    import calib
    import models

    for package in (calib, models):
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
            if not module.name.endswith("__main__"):
                try:
                    importlib.import_module(module.name)
                except ImportError:  # an extra that is not installed
                    continue
    calib.parse_prior("sensor_thickness", {"normal": ["0.7 mm", "1 um"]})  # units and fonts are looked up once
    figure = importlib.import_module("matplotlib.figure").Figure()
    figure.add_subplot().set_title("a")
    figure.savefig(io.BytesIO(), format="svg")


def make_small() -> None:
    """Make calibrations of this process and its children small: short blocks, coarse elements, one picture for all figures.

    Stages, blocks of an ensemble and files are as many as in others; what is less is what is computed for each.
    """
    from matplotlib.figure import Figure

    import calib
    from calib.sampling import Gate
    from models.fem import FiniteElements

    defaults = calib.sample.__kwdefaults__
    assert defaults is not None
    defaults.update(n_walkers=_WALKERS, max_steps=_BLOCKS * _BLOCK_STEPS, gate=Gate(ess=_EFFECTIVE))
    small = {"BLOCK_STEPS": _BLOCK_STEPS, "FIRST_CHECK": (_BLOCKS - 1) * _BLOCK_STEPS, **_SMALL}
    _replaced(lambda module: {name: value for name, value in small.items() if name in vars(module)})
    calib.with_spot_check.__defaults__ = (FiniteElements(accuracy=_ACCURACY), None)
    pictures: dict[str, bytes] = {}
    for form in ("png", "svg"):
        drawn = io.BytesIO()
        Figure(figsize=(1, 1)).savefig(drawn, format=form)
        pictures[form] = drawn.getvalue()

    def save(figure: Figure, target: Any, *, format: str = "png", **_: Any) -> None:
        target.write(pictures[format]) if hasattr(target, "write") else Path(target).write_bytes(pictures[format])

    def empty(*_: Any, **__: Any) -> Figure:
        return Figure(figsize=(1, 1))

    _DRAWN.extend(_replaced(lambda module: dict.fromkeys(_drawing(module), empty)))
    figures: Any = Figure
    _DRAWN.append((figures, "savefig", figures.savefig))
    figures.savefig = save


def _drawing(module: Any) -> list[str]:
    """Names in a module of functions that draw a figure."""
    if not module.__name__.startswith("calib.report"):
        return []
    found = {name: value for name, value in vars(module).items() if hasattr(value, "__wrapped__")}
    return [name for name, value in found.items() if value.__module__.startswith("calib.report.figures")]


def _replaced(others: Callable[[Any], Mapping[str, Any]]) -> list[tuple[Any, str, Any]]:
    """Replace names in the modules of `calib`; gives what was there."""
    before = []
    for module in [m for name, m in sys.modules.items() if name.split(".")[0] == "calib"]:
        for name, value in others(module).items():
            before.append((module, name, vars(module)[name]))
            setattr(module, name, value)
    return before


def draw() -> None:
    """Have the figures of this process drawn again."""
    for owner, name, value in _DRAWN:
        setattr(owner, name, value)


def rehearse(commands: Sequence[Sequence[str]], folder: Path) -> None:
    """Run commands in this process, for what is looked up or compiled when it is first used to be there in its forks.

    Parameters
    ----------
    commands : the words of each, after `calib`.
    folder : to run them in.
    """
    from calib.cli import app

    before = Path.cwd(), sys.argv
    os.chdir(folder)
    try:
        for words in commands:
            sys.argv = ["calib", *words]
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()), suppress(SystemExit):
                app()
    finally:
        os.chdir(before[0])
        sys.argv = before[1]
    gc.freeze()  # what a fork does not touch is not copied


def start(
    words: Sequence[str],
    folder: Path,
    log: Path,
    *,
    cold: bool = False,
    before: Callable[[], None] | None = None,
    environment: Mapping[str, str | None] | None = None,
) -> Running:
    """Start `calib` in a process and a group of its own.

    Parameters
    ----------
    words : after `calib`.
    folder : to run it in.
    log : folder for what it prints.
    cold : whether the installed command is started, rather than a fork of this process that has its modules loaded already.
    before : called in the process before the command is; only for a fork.
    environment : variables to set, or to unset (None).

    Returns
    -------
    The process.
    """
    log.mkdir(parents=True, exist_ok=True)
    stem = f"{os.getpid()}-{threading.get_ident()}-{time.monotonic_ns()}"
    said, complained = log / f"{stem}.out", log / f"{stem}.err"
    begun = time.monotonic()
    if cold:
        own = {k: v for k, v in ({**os.environ} | dict(environment or {})).items() if v is not None}
        with said.open("wb") as out, complained.open("wb") as err:
            program = [str(Path(sys.executable).with_name("calib")), *words]
            child = subprocess.Popen(
                program, cwd=folder, env=own, stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True
            )
        child.returncode = 0  # waited for by its number, here
        return Running(child.pid, said, complained, begun)
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        _run(words, folder, (said, complained), before, environment or {})
    while os.getsid(pid) != pid:  # until it has a group of its own, that group cannot be sent a signal
        time.sleep(0.0005)
    return Running(pid, said, complained, begun)


def run(words: Sequence[str], folder: Path, log: Path, *, limit: float = LIMIT, cold: bool = False) -> Ended:
    """Run `calib` to its end; arguments as of `start` and `Running.wait`."""
    return start(words, folder, log, cold=cold).wait(limit)


def _run(
    words: Sequence[str],
    folder: Path,
    files: tuple[Path, Path],
    before: Callable[[], None] | None,
    environment: Mapping[str, str | None],
) -> None:
    """Be the command, in a process that was forked for it, and end as an interpreter ends."""
    code = 1
    try:
        os.setsid()
        for number, path in enumerate((None, *files)):
            how = os.O_RDONLY if path is None else os.O_WRONLY | os.O_CREAT
            descriptor = os.open(path or os.devnull, how, 0o644)
            os.dup2(descriptor, number)
            os.close(descriptor)
        os.chdir(folder)
        for name, value in environment.items():
            os.environ.pop(name, None) if value is None else os.environ.__setitem__(name, value)
        sys.argv = ["calib", *words]
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if before is not None:
            before()
            sys.stdout, sys.stderr = _stream(1, "surrogateescape"), _stream(2, "backslashreplace")
        from calib.__main__ import main

        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        interpreter: Any = threading
        interpreter._shutdown()
        atexit._run_exitfuncs()
        _flush()
    except BaseException as error:
        code = 130 if isinstance(error, KeyboardInterrupt) else 1
        sys.excepthook(*sys.exc_info())
        _flush()
    finally:
        os._exit(code)


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()


def _stream(number: int, errors: str) -> Any:
    """A standard stream as an interpreter makes it when it begins: None if its descriptor is closed."""
    try:
        os.fstat(number)
    except OSError:
        return None
    return open(number, "w", encoding="utf-8", errors=errors, closefd=False)


def alive(pid: int) -> list[int]:
    """Processes that are still of the session that a process began."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == pid and fields[0] != "Z":
            found.append(int(entry.name))
    return found


def limited(size: int) -> Callable[[], None]:
    """What makes a process unable to write files larger than this [bytes]: as a disk that is full within a file."""

    def before() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return before
