"""A stage in, a command out that stays in it for ever and says so on stdout, to be told to stop: stays.py STAGE WORDS...

A stage that `Stages` knows is given; in the place of any other a function of its room is put, in the process of the command: no
file and no argument makes reading a lab file or saving a posterior last until a signal comes.
"""

from __future__ import annotations

import io
import math
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from types import FrameType
from typing import Any, NoReturn

import pytest
from small_run import BLOCK, in_small_steps

from calib.checks import Elsewhere
from calib.cli import app
from calib.problem import Problem
from calib.runs import Stages, calibration, preview, renewed, written
from calib.sampling import Gate, assess, sample
from calib.sampling.posterior import Posterior
from calib.workers import workers
from models.fem import FiniteElements


def _stay(*_: object, **__: object) -> Any:
    print("there", flush=True)
    while True:
        time.sleep(0.01)


def _stay_deaf(*_: object, **__: object) -> Any:
    print("there", flush=True)
    while True:
        with suppress(BaseException):
            time.sleep(60)


def _wait_while_another_thread_hears(*_: object, **__: object) -> Any:
    # The handler is due in the main thread, which waits, and is not woken: as if the signal came just before it began to.
    other = threading.Thread(target=time.sleep, args=(600,), daemon=True)
    other.start()
    threading.Timer(0.2, signal.pthread_kill, (other.ident or 0, signal.SIGINT)).start()
    print("there", flush=True)
    threading.Event().wait()


def _with_workers(*_: object, **__: object) -> Any:
    with workers(int(os.environ["PROCESSES"])) as executor:
        executor.submit(os.getpid).result()
        _wait_for_work(None, None, 0, executor)


def _wait_for_work(_: object, __: object, ___: int, executor: Executor, **____: object) -> Any:
    running = [executor.submit(time.sleep, 600) for _ in range(3)]
    print("there", flush=True)
    running[0].result()


def _brief(problem: Problem, **options: Any) -> Posterior:
    brief = {"max_steps": BLOCK, "max_seconds": math.inf, "processes": 0, "gate": Gate(ess=1e9)}
    with in_small_steps():
        return sample(problem, **{**options, **brief})


def _look_nowhere(_: Problem, __: object, executor: Executor | None) -> Elsewhere:
    """Begin with the workers, as a look at other models does, and give them nothing to load."""
    if executor is not None:
        for asked in [executor.submit(os.getpid) for _ in range(2)]:
            asked.result()
    return Elsewhere()


def _tell_of(function: Callable[..., object]) -> None:
    def watch(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code is function.__code__:
            sys.setprofile(None)
            print("there", flush=True)

    sys.setprofile(watch)


def run(stage: str, words: Sequence[str]) -> None:
    """Run a command of calib that stays in one of its stages; ends with SystemExit.

    Parameters
    ----------
    stage : where it stays.
    words : the command.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests themselves run in the background
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    stages: dict[str, Any] = {
        "spot_check": lambda posterior, _: posterior,
        "page": lambda *_: "a page",
        "look_elsewhere": _look_nowhere,
        "check": lambda _: None,
    }
    patch = pytest.MonkeyPatch()
    if stage == "reading":
        patch.setattr(preview, "read_sweeps", _stay)
    elif stage == "writing":
        stages["sample"] = _brief
        patch.setattr(calibration, "write_run", _stay)
    elif stage == "saving":
        stages["sample"] = _brief
        patch.setattr(written, "save_posterior", _stay)
    elif stage == "spot check":
        stages |= {"sample": _brief, "spot_check": _stay}
    elif stage == "block likelihoods":
        patch.setattr(assess, "log_likelihood_blocks", _stay)
        stages["sample"] = _brief
    elif stage == "re-weighting":
        stages |= {"sample": _brief, "reweight": _wait_for_work}
    elif stage == "the report":
        stages |= {"sample": _brief, "page": _stay}
    elif stage == "simulating":
        _tell_of(FiniteElements.solve)
    elif stage == "recommending":
        patch.setattr(renewed, "recommend_for", _stay)
    else:
        stages["sample"] = {
            "sampling": _with_workers,
            "something deaf": _stay_deaf,
            "a wait": _wait_while_another_thread_hears,
            "nothing": _brief,
        }[stage]
    app(list(words), obj=Stages(**stages))


def run_forked(stage: str, words: Sequence[str]) -> NoReturn:
    """Run it in a process that was forked of pytest's as if it were one of its own.

    Parameters
    ----------
    stage, words : see `run`.
    """
    sys.stdout, sys.stderr = (io.TextIOWrapper(io.FileIO(number, "w", closefd=False), "utf-8") for number in (1, 2))
    sys.unraisablehook, threading.excepthook = sys.__unraisablehook__, threading.__excepthook__
    code: object = 1
    try:
        run(stage, words)
        code = 0
    except SystemExit as end:
        code = end.code or 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 1)


if __name__ == "__main__":
    run(sys.argv[1], sys.argv[2:])
