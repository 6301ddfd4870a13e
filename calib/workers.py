"""From a number of processes to an executor whose workers compute on one thread each and end with this process."""

from __future__ import annotations

import os
import pickle
import runpy
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from multiprocessing import active_children, parent_process, resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from queue import Empty, SimpleQueue
from types import FrameType, TracebackType
from typing import Any, Literal, ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")

# Libraries for linear algebra read these when they are loaded.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def workers(processes: int | None = None) -> Iterator[Executor]:
    """Run work on several processors, by an executor to which pieces of work are given.

    Each worker has one thread for linear algebra, so that n workers use n processors. They end with the block, and also if
    this process is killed. When the block fails or is interrupted, work is dropped, begun or not, and nobody waits for it.
    Ctrl-C, which a terminal sends to all processes, is left to this one.

    A script that calls this is not run again by the workers, unless they are given what it defines itself, such as a function:
    it then needs its `if __name__ == "__main__":`.

    Parameters
    ----------
    processes : worker processes; the number of processors if None. 0 computes in this process, one piece of work after the
        other in the order given, in a thread beside the caller's: interrupted, the caller need not wait for it.

    Yields
    ------
    The executor.

    Raises
    ------
    RuntimeError
        If a worker comes here, as it runs a script without that line.
    """
    if _SCRIPT.is_run:
        line = 'if __name__ == "__main__":'
        raise RuntimeError(f"a script that gives workers what it defines itself needs `{line}` before it calls them")
    if processes == 0:
        with _in_this_process() as executor:
            yield executor
        return
    before = {name: os.environ.get(name) for name in _THREADS}
    # Workers read these when they import NumPy, and they start while this context is open.
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    _begin_tracker()
    others = active_children()
    pool = ProcessPoolExecutor(processes, mp_context=_Context(), initializer=_begin_worker, initargs=(_main(),))
    try:
        yield pool
    except BaseException:
        # The executor's own thread is not waited for: an exception that came while a lock was taken may have left it locked.
        pool.shutdown(wait=False, cancel_futures=True)
        begun = [worker for worker in active_children() if worker not in others]
        for worker in begun:
            worker.kill()
        # Asked, not joined: the executor's thread waits for them, too, and who hears second is told a moment later.
        until = time.monotonic() + 2.0
        while any(worker.is_alive() for worker in begun) and time.monotonic() < until:
            time.sleep(0.002)
        raise
    else:
        pool.shutdown()
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


class _Dropped(Exception):
    """What workers are at is dropped."""


class Crew(Executor):
    """Workers as by `workers`, begun when they are needed first, of whom what they are at can be dropped.

    Attributes
    ----------
    processes : how many; the number of processors if None, 0 for a thread of this process.
    """

    def __init__(self, processes: int | None = None) -> None:
        self.processes = processes
        self._begun: tuple[AbstractContextManager[Executor], Executor] | None = None

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Give the workers, who are begun now at the latest, a piece of work.

        Parameters
        ----------
        fn, *args, **kwargs : see `concurrent.futures.Executor.submit`.
        """
        if self._begun is None:
            context = workers(self.processes)
            self._begun = context, context.__enter__()
        return self._begun[1].submit(fn, *args, **kwargs)

    def load(self, module: str) -> None:
        """Let every worker load a module, beside what goes on here."""
        for _ in range(os.cpu_count() or 1 if self.processes is None else self.processes):
            self.submit(import_module, module)

    def drop(self, because: BaseException | None = None) -> None:
        """End the workers, whatever they are at; what is submitted next is done by new ones.

        Parameters
        ----------
        because : what has failed, if something has.
        """
        if self._begun is not None:
            context, self._begun = self._begun[0], None
            failure = _Dropped() if because is None else because
            context.__exit__(type(failure), failure, failure.__traceback__)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the workers end.

        Parameters
        ----------
        wait, cancel_futures : see `concurrent.futures.Executor.shutdown`; their work is always waited for.
        """
        if self._begun is not None:
            context, self._begun = self._begun[0], None
            context.__exit__(None, None, None)

    def __exit__(
        self, kind: type[BaseException] | None, failure: BaseException | None, trace: TracebackType | None
    ) -> Literal[False]:
        """Let the workers end; where the block fails, drop what they are at."""
        if failure is None:
            self.shutdown()
        else:
            self.drop(failure)
        return False


def given_to(executor: Executor, works: Sequence[Callable[[], _T]]) -> list[Callable[[], _T]]:
    """Give an executor pieces of work, of what they hold at this moment, and say how to get the answers.

    An executor of processes pickles what it is given later, in a thread of its own, piece by piece as workers take them. This
    process may compute with the same values meanwhile, and what they keep of it (`functools.cached_property`) would change them
    under that thread's hands, which fails. Here all are pickled now, and at once: what they share is held once.

    Parameters
    ----------
    executor : of processes or of a thread.
    works : functions without arguments that can be pickled.
    """
    kept = pickle.dumps(list(works))
    return [executor.submit(_done, kept, k).result for k in range(len(works))]


def _done(works: bytes, k: int) -> Any:
    return pickle.loads(works)[k]()


class _Worker(SpawnProcess):
    """A process that is born, and stays, without an ear for the signals that a terminal sends to all of its processes."""

    def start(self) -> None:
        """See `multiprocessing.Process.start`."""
        with _undisturbed(), _main_kept_back():
            super().start()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Start a process without signals of the terminal: not in it, and not in its start here.

    A process half started is one that nobody knows, nor ends. To hold signals back is not enough for that: another thread hears
    them, and Python runs their handlers in the main one all the same.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # What is held back here is held back in the process that is started, from its first instruction on.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        with _handlers_waiting():
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextmanager
def _handlers_waiting() -> Iterator[None]:
    """Run handlers of signals that come in this block after it, if this is the main thread, in which they run."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before: dict[int, Callable[[int, FrameType | None], Any]] = {}
    try:
        for signum in _SIGNALS:
            handler = signal.getsignal(signum)
            if callable(handler):
                before[signum] = handler
                signal.signal(signum, lambda number, _: came.append(number))
        yield
    finally:
        for signum, handler in before.items():
            signal.signal(signum, handler)
        for number in came:
            before[number](number, None)


def _begin_tracker() -> None:
    """Start the process by which Python clears away after killed ones: silently, and before any worker."""
    before = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = ",".join([*([before] if before else []), "ignore:resource_tracker"])
    try:
        with _undisturbed():
            resource_tracker.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = before


class _Context(SpawnContext):
    """Starts such processes, each anew."""

    Process = _Worker


@dataclass(frozen=True)
class _Main:
    """The script that this process runs: the name of its module if it was started by `python -m`, or its file; or neither."""

    module: str | None
    file: str | None


def _main() -> _Main:
    main = sys.modules["__main__"]
    name = getattr(main.__spec__, "name", None)  # of a folder that is run "__main__", which is no module to be found
    return _Main(None if name == "__main__" else name, getattr(main, "__file__", None))


@contextmanager
def _main_kept_back() -> Iterator[None]:
    """Start a process that does not run the script of this one, as Python lets it do by what the script says of itself."""
    own = sys.modules["__main__"].__dict__
    kept: dict[str, Any] = {name: own[name] for name in ("__file__", "__spec__") if name in own}
    own.pop("__file__", None)
    own["__spec__"] = None
    try:
        yield
    finally:
        own.update(kept)


class _Script:
    """The parent's script in a worker, which runs it when something that it defines is asked for; there is one."""

    def __init__(self) -> None:
        self.is_run = False

    def begin(self, main: _Main) -> None:
        """Let a name that is not known here be looked for in the script.

        Parameters
        ----------
        main : the script.
        """
        here = vars(sys.modules["__main__"])

        def look_for(name: str) -> Any:
            if not self.is_run and not name.startswith("__"):
                here.update({key: value for key, value in self._defined(main).items() if not key.startswith("__")})
            if name not in here:
                raise AttributeError(f"module '__main__' has no attribute {name!r}")
            return here[name]

        here["__getattr__"] = look_for

    def _defined(self, main: _Main) -> dict[str, Any]:
        """All that the script defines, as of the name by which `multiprocessing` knows it in both processes."""
        self.is_run = True
        try:
            if main.module is not None:
                return runpy.run_module(main.module, run_name="__mp_main__")
            return runpy.run_path(main.file, run_name="__mp_main__") if main.file is not None else {}
        finally:
            self.is_run = False


_SCRIPT = _Script()


def _begin_worker(main: _Main) -> None:
    """Let this worker find what the script of its parent defines, and end with its parent: it would wait for work for ever."""
    _SCRIPT.begin(main)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it could not be held back from the start

    def watch() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _in_this_process() -> Iterator[Executor]:
    executor = _OneThread()
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        raise
    executor.shutdown()


class _OneThread(Executor):
    """An executor of one thread that, unlike that of the standard library, does not keep the process from ending."""

    def __init__(self) -> None:
        self._work: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """See `concurrent.futures.Executor.submit`."""
        future: Future[_T] = Future()
        self._work.put((future, partial(fn, *args, **kwargs)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """See `concurrent.futures.Executor.shutdown`."""
        while cancel_futures:
            try:
                waiting = self._work.get_nowait()
            except Empty:
                break
            if waiting is not None:
                waiting[0].cancel()
        self._work.put(None)
        if wait:
            self._thread.join()

    def _run(self) -> None:
        while (next_one := self._work.get()) is not None:
            future, work = next_one
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(work())
                except BaseException as error:
                    future.set_exception(error)
