"""A signal to stop in, the end of the command out: within two seconds, with what it has kept and how to go on said.

Ctrl-C, SIGTERM and SIGHUP raise `KeyboardInterrupt` where the command stands, so that files are closed and workers ended. What
does not come to its end so, in a library or in a thread, is ended soon after: files are whole or not there at any moment.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import active_children
from types import FrameType

import typer

from calib.visible import visible

#: How long a command may take to stop by itself [s].
PATIENCE = 1.0

_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def _silent(_: object) -> None:
    """Say nothing of an exception that nobody has caught."""


class _Stop:
    """Whether the process has been told to stop, by which signal, and what to say then; there is one, as of signals."""

    def __init__(self) -> None:
        self.signum: int | None = None
        self.text = ""
        self.said = False
        self.advice: list[Callable[[], str]] = []

    @property
    def code(self) -> int:
        """Exit code, by the shells' convention."""
        return 128 + (signal.SIGINT if self.signum is None else self.signum)

    def begin(self, signum: int, frame: FrameType | None) -> None:
        """Stop the main thread where it stands; that it has been told once is enough."""
        if self.signum is not None:
            return
        self.signum = signum
        self.text = self.words()  # here, in the thread that knows how far it is
        # What fails only because it is being stopped is no news.
        sys.unraisablehook = threading.excepthook = _silent
        threading.Thread(target=self.end, daemon=True).start()
        raise KeyboardInterrupt

    def end(self) -> None:
        """End the process if it has not ended by itself."""
        time.sleep(PATIENCE)
        self.say()
        for worker in active_children():
            worker.kill()
        os._exit(self.code)

    def words(self) -> str:
        """What is to be said at this place."""
        return self.advice[-1]() if self.advice else "Stopped."

    def say(self) -> None:
        """Tell the user how to go on, once."""
        if not self.said:
            self.said = True
            cursor = "\x1b[?25h" if sys.stderr.isatty() else ""  # which a progress bar may have hidden
            print(f"{cursor}{visible(self.text or self.words())}", file=sys.stderr, flush=True)


_STOP = _Stop()


@contextmanager
def stoppable() -> Iterator[None]:
    """Run a command so that the signals to stop end it, with the exit code 130 for Ctrl-C and 143 for SIGTERM."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        # What ignores a signal from the start, as under nohup, goes on to.
        heard = [s for s in _SIGNALS if signal.getsignal(s) not in (signal.SIG_IGN, None)]
        before = {s: signal.signal(s, _STOP.begin) for s in heard}
    _STOP.said = False
    try:
        yield
    except BaseException as error:
        if _STOP.signum is None and not isinstance(error, KeyboardInterrupt):
            raise
        _STOP.say()
        if _STOP.signum is not None:
            sys.stdout.flush()
            os._exit(_STOP.code)  # everything is closed; to take apart what has been loaded can last for seconds
        raise typer.Exit(_STOP.code) from None
    finally:
        if _STOP.signum is None:
            for signum, handler in before.items():
                signal.signal(signum, handler)


@contextmanager
def when_stopped(advice: Callable[[], str]) -> Iterator[None]:
    """Say how to go on if the command is told to stop in this block.

    Parameters
    ----------
    advice : gives what is said, in a sentence or two.
    """
    _STOP.advice.append(advice)
    try:
        yield
    except KeyboardInterrupt:
        _STOP.say()
        raise
    finally:
        _STOP.advice.pop()
