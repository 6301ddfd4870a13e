"""What the commands share: exit codes, refusal of bad input without a traceback, whole files or none, quantities, models."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path

import typer
from rich.console import Console

from calib.errors import Fault, InputError
from calib.files import whole_file
from models.response import Forward, OutOfRangeError

#: Something is wrong with the input; nothing was written.
BAD_INPUT = 2
#: Everything was written, but the calibration has not converged.
NOT_CONVERGED = 3
#: Stopped from the keyboard (128 + SIGINT).
INTERRUPTED = 130


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


def load_forward(model: str, surrogate: Path | None = None) -> Forward:
    """The forward model of that name ("closed-form" or "closed form"); `surrogate`: a file instead of the shipped one."""
    if model == "fem":
        from models.fem import FiniteElements

        return FiniteElements()
    if model.replace("-", " ") == "closed form":
        from models.analytic import ClosedForm

        return ClosedForm()
    from models.surrogate import load_surrogate

    if surrogate is not None and not surrogate.is_file():
        raise InputError(
            Fault("there is no such surrogate file", surrogate, advice="Leave --surrogate out to use the shipped one")
        )
    try:
        return load_surrogate(surrogate)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(Fault(f"not a surrogate that can be read ({error})", surrogate)) from None
