"""A signal to stop in, the end of the command out: within two seconds, with what it has kept and how to go on said.

Ctrl-C, SIGTERM and SIGHUP raise `KeyboardInterrupt` where the command stands, so that files are closed and workers ended. What
does not come to its end so, in a library or in a thread, is ended soon after: files are whole or not there at any moment.

Python runs a handler between two steps of the main thread. A signal that comes just before that thread begins to wait, or to
another thread, does not end the wait: the handler would run when the wait is over, which may be never. So a thread of its own
hears of every signal at once, wakes the main thread, and ends the command if that does not help.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from multiprocessing import active_children
from types import FrameType

import typer

from calib.visible import visible

#: How long a command may take to stop by itself [s].
PATIENCE = 1.0

# After how long the main thread is told again [s].
_STEP = 0.02

_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def _silent(_: object) -> None:
    """Say nothing of an exception that nobody has caught."""


class _Stop:
    """Whether the process has been told to stop, by which signal, and what to say then; there is one, as of signals."""

    def __init__(self) -> None:
        self.signum: int | None = None
        self.text = ""
        self.said = False
        self.saying = threading.Lock()
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
        raise KeyboardInterrupt

    def listen(self, ear: socket.socket, heard: Collection[int]) -> None:
        """Wait for one of these signals, in a thread beside the main one, and see to it that the process ends."""
        signum = None
        while signum is None:
            if not (numbers := ear.recv(64)):
                ear.close()
                return  # the command is over
            signum = next((number for number in numbers if number in heard), None)
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.signum is None and hasattr(signal, "pthread_kill"):
                signal.pthread_kill(threading.main_thread().ident or 0, signum)
            time.sleep(_STEP)
        if self.signum is None:
            self.signum = signum
        self.end()

    def end(self) -> None:
        """End the process, which has not ended by itself."""
        try:
            # Where nobody reads standard error it takes no more.
            saying = threading.Thread(target=self.say, daemon=True)
            saying.start()
            saying.join(PATIENCE / 2)
            for worker in active_children():
                worker.kill()
        finally:
            os._exit(self.code)

    def words(self) -> str:
        """What is to be said at this place."""
        return self.advice[-1]() if self.advice else "Stopped."

    def say(self) -> None:
        """Tell the user how to go on, once."""
        with self.saying:
            if not self.said:
                cursor = "\x1b[?25h" if sys.stderr.isatty() else ""  # which a progress bar may have hidden
                print(f"{cursor}{visible(self.text or self.words())}", file=sys.stderr, flush=True)
                self.said = True


_STOP = _Stop()


@contextmanager
def stoppable() -> Iterator[None]:
    """Run a command so that the signals to stop end it, with the exit code 130 for Ctrl-C and 143 for SIGTERM.

    Raises
    ------
    typer.Exit
        With that code, where a test runs the command.
    """
    _STOP.said = False
    try:
        with _listening():
            yield
    except BaseException as error:
        if _STOP.signum is None and not isinstance(error, KeyboardInterrupt):
            raise
        _STOP.say()
        if _STOP.signum is not None:
            sys.stdout.flush()
            os._exit(_STOP.code)  # everything is closed; to take apart what has been loaded can last for seconds
        raise typer.Exit(_STOP.code) from None


@contextmanager
def _listening() -> Iterator[None]:
    """Have the signals to stop heard in this block, if it runs in the main thread, the one that Python gives signals to."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # What ignores a signal from the start, as under nohup, goes on to.
    heard = [s for s in _SIGNALS if signal.getsignal(s) not in (signal.SIG_IGN, None)]
    ear, mouth = socket.socketpair()
    mouth.setblocking(False)
    fd = signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_STOP.listen, args=(ear, frozenset(heard)), daemon=True).start()
    before = {s: signal.signal(s, _STOP.begin) for s in heard}
    try:
        yield
    finally:
        if _STOP.signum is None:
            for signum, handler in before.items():
                signal.signal(signum, handler)
            signal.set_wakeup_fd(fd)
            mouth.close()


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
