"""What the commands share: exit codes, consoles, refusals without a traceback, quantities, run folders, progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.terminal import Console
from calib.errors import Fault, InputError
from models.response import ConvergenceError, OutOfRangeError
from models.threads import one_thread

if TYPE_CHECKING:
    from calib.runs import Run

#: Something is wrong with the input; nothing was written.
BAD_INPUT = 2
#: Everything was written, but the calibration has not converged, or its surrogate is off by more than it states.
NOT_USABLE = 3
#: Stopped from the keyboard (128 + SIGINT).
INTERRUPTED = 130

RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Folder written by `calib calibrate`.")]
Processes = Annotated[int | None, typer.Option(min=1, help="Worker processes [default: number of CPUs].")]


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
    """Turn what is wrong with an input into its message on stderr and exit code 2; a defect still shows its trace.

    Linear algebra inside has one thread: the matrices are small, and what is large is spread over processes.
    """
    try:
        with one_thread():
            yield
    except InputError as error:
        _refuse([str(fault) for fault in error.faults])
    except (OutOfRangeError, ConvergenceError) as error:
        _refuse([str(error)])
    except (IsADirectoryError, PermissionError, FileExistsError) as error:
        _refuse([f"{error.filename}: {error.strerror}"])


def _refuse(messages: list[str]) -> None:
    for message in messages:
        err().print(f"Error: {message}", style="red", markup=False, soft_wrap=True)
    raise typer.Exit(BAD_INPUT)


def quantity(text: str, si_unit: str, option: str) -> float:
    """Read the quantity of an option such as --force "5 N" into an SI number.

    Parameters
    ----------
    text : what was given.
    si_unit : in which the number is wanted.
    option : its name, for the refusal.

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


def loaded(folder: Path) -> Run:
    """Load the finished run in a folder; say on stderr if it was sampled with another model than is here now."""
    from calib.runs import load_run

    run = load_run(folder)
    if run.note:
        err().print(f"Note: {run.note}", markup=False)
    return run


@contextmanager
def counting() -> Iterator[Callable[[str, int, int], None]]:
    """Show progress on stderr, if that is a terminal; gives a function of what is counted, how many are done, of how many."""
    from rich.progress import Progress, TaskID

    console = err()
    tasks: dict[str, TaskID] = {}
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:

        def told(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what)
            bar.update(tasks[what], completed=done, total=total)

        yield told
