"""What the commands share: exit codes, refusals without a traceback, whole files, quantities, models, runs, workers."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from calib.errors import Fault, InputError
from calib.files import whole_file
from models.response import Forward, OutOfRangeError
from models.surrogate.domain import NEO_HOOKEAN, Family

if TYPE_CHECKING:
    from calib.sampling.posterior import Posterior

#: Something is wrong with the input; nothing was written.
BAD_INPUT = 2
#: Everything was written, but the calibration has not converged.
NOT_CONVERGED = 3
#: Stopped from the keyboard (128 + SIGINT).
INTERRUPTED = 130

#: Among the texts kept with a posterior: the surrogate file it was made with, if not the shipped one.
SURROGATE_FILE = "surrogate file"

RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Folder written by `calib calibrate`.")]
Processes = Annotated[int | None, typer.Option(min=1, help="Worker processes [default: number of CPUs].")]


class FamilyName(StrEnum):
    """Which of the shipped surrogates."""

    neo_hookean = "neo-hookean"
    gent = "gent"
    stick = "stick"


class ModelName(StrEnum):
    """Forward models to choose from."""

    surrogate = "surrogate"
    fem = "fem"
    closed_form = "closed-form"


def out() -> Console:
    """Console of results (stdout); into a file or a pipe it writes wide enough for every table."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=120)


def err() -> Console:
    """Console of progress and messages (stderr)."""
    return Console(stderr=True, highlight=False)


def say(text: str) -> None:
    """Print one line of a result, as it is."""
    out().print(text, markup=False, soft_wrap=True)


@contextmanager
def refusing_bad_input() -> Iterator[None]:
    """Turn what is wrong with an input into its message on stderr and exit code 2; a defect still shows its trace."""
    try:
        yield
    except InputError as error:
        _refuse([str(fault) for fault in error.faults])
    except OutOfRangeError as error:
        _refuse([str(error)])
    except (IsADirectoryError, PermissionError, FileExistsError) as error:
        _refuse([f"{error.filename}: {error.strerror}"])
    except RuntimeError as error:
        if type(error).__name__ != "ConvergenceError":
            raise
        _refuse([str(error)])


def _refuse(messages: list[str]) -> None:
    for message in messages:
        err().print(f"Error: {message}", style="red", markup=False, soft_wrap=True)
    raise typer.Exit(BAD_INPUT)


def write_whole(path: Path, text: str) -> None:
    """Write a text file atomically: it is there whole or not at all.

    Raises
    ------
    InputError
        If the folder does not exist.
    """
    with whole_file(path, advice="Create it, or choose another -o") as whole:
        whole.write_text(text, encoding="utf-8", newline="\n")


def quantity(text: str, si_unit: str, option: str) -> float:
    """SI number of an option such as --force "5 N".

    Raises
    ------
    InputError
        If the text is no such quantity.
    """
    from calib.quantity import parse_quantity

    try:
        return parse_quantity(text, si_unit)
    except ValueError as error:
        raise InputError(Fault(f"{option}: {error}")) from None


def load_forward(model: str, surrogate: Path | None = None, family: Family | None = NEO_HOOKEAN) -> Forward:
    """The forward model of that name ("closed-form" or "closed form") for designs of a `family`.

    `surrogate` : a file instead of the shipped one.
    """
    if model == "fem":
        from models.fem import FiniteElements

        return FiniteElements()
    if model.replace("-", " ") == "closed form":
        from models.analytic import ClosedForm

        return ClosedForm()
    from models.surrogate.surrogate import load_surrogate

    if surrogate is not None and not surrogate.is_file():
        raise InputError(
            Fault("there is no such surrogate file", surrogate, advice="Leave --surrogate out to use the shipped one")
        )
    if family is None:
        raise InputError(Fault("there is no surrogate for Gent's law with a ball that sticks", advice="Use the model fem"))
    try:
        return load_surrogate(surrogate, family)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(Fault(f"not a surrogate that can be read ({error})", surrogate)) from None


def load_run(run: Path) -> tuple[Posterior, Forward]:
    """The posterior of a finished run and the forward model that it was sampled with.

    Raises
    ------
    InputError
        If there is no finished run, or the surrogate file it was made with is gone.
    """
    from calib.sampling.storage import load_posterior

    path = run / "posterior.nc"
    if not path.is_file():
        advice = (
            "It was stopped before its end: continue it with --resume"
            if (run / "run.json").exists()
            else "Run `calib calibrate` first"
        )
        raise InputError(Fault("there is no finished calibration in this folder (no posterior.nc)", run, advice=advice))
    posterior = load_posterior(path)
    file = posterior.attrs.get(SURROGATE_FILE)
    forward = load_forward(posterior.experiment.model, Path(file) if file else None, posterior.experiment.family)
    if forward.name != posterior.forward_name:
        err().print(f"Note: calibrated with the {posterior.forward_name}, predicting with the {forward.name}.", markup=False)
    return posterior, forward


@contextmanager
def workers(processes: int | None) -> Iterator[Executor]:
    """Processes with one BLAS thread each; 0 for none but this."""
    if processes == 0:
        with ThreadPoolExecutor(1) as executor:
            yield executor
        return
    # Workers read these when they import NumPy.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(name, "1")
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


@contextmanager
def counting() -> Iterator[Callable[[str, int, int], None]]:
    """Progress on stderr, if that is a terminal: a function of what is counted, how many are done, and of how many."""
    from rich.progress import Progress, TaskID

    console = err()
    tasks: dict[str, TaskID] = {}
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:

        def told(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what)
            bar.update(tasks[what], completed=done, total=total)

        yield told
