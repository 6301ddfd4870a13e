"""What the commands share: exit codes, consoles, refusals without a traceback, quantities, run folders, progress."""

from __future__ import annotations

import errno
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

from calib.cli.terminal import Console
from calib.errors import Fault, InputError, in_shell_path
from models.response import ConvergenceError, OutOfRangeError
from models.threads import one_thread

if TYPE_CHECKING:
    from rich.table import Table

    from calib.checks import Colour, Verdict
    from calib.runs import Run

#: Minutes that a calibration may take if nothing else is said.
BUDGET = 10.0
#: All results are written, but the page that shows them could not be made.
NO_PAGE = 1
#: Something is wrong with the input; nothing was written.
BAD_INPUT = 2
#: Everything was written, but the verdict is red: the numbers must not be used.
NOT_USABLE = 3

RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Folder written by `calib calibrate`.")]
Strict = Annotated[bool, typer.Option("--strict", help="Exit code 3 if the verdict is amber, too.")]
Accuracy = Annotated[float, typer.Option(min=1e-5, max=0.1, help="Relative accuracy the finite elements are meshed for.")]
Processes = Annotated[int | None, typer.Option(min=1, help="Worker processes [default: number of CPUs].")]


class _Console(Console):
    """A console that leaves it to `refusing_bad_input` what happens where nobody reads it any more, or it cannot be written."""

    def print(self, *objects: Any, **options: Any) -> None:
        try:
            super().print(*objects, **options)
        except OSError as error:
            name = "standard error" if self.stderr else "standard output"
            raise OSError(error.errno, error.strerror, name) from error

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


def out() -> Console:
    """Console of results (stdout); into a file or a pipe it writes wide enough for every table."""
    console = _Console(highlight=False, emoji=False)
    return console if console.is_terminal else _Console(highlight=False, emoji=False, width=120)


def err() -> Console:
    """Console of progress and messages (stderr)."""
    return _Console(stderr=True, highlight=False, emoji=False)


def say(text: str) -> None:
    """Print one line of a result, as it is."""
    out().print(text, markup=False, soft_wrap=True)


def say_verdict(verdict: Verdict, status: str, colour: Colour | None = None) -> None:
    """Print a verdict: its colour in a sentence, and its reasons, each with what to do.

    Parameters
    ----------
    verdict : to be said.
    status : the sentence.
    colour : of the sentence; None for that of the verdict.
    """
    styles = {"green": "green", "amber": "yellow", "red": "bold red"}
    out().print(status, style=styles[colour or verdict.colour], markup=False, soft_wrap=True)
    for reason in verdict.reasons:
        text = f"  {reason.level}, {reason.gate}: {reason.in_words}"
        out().print(text, style=styles[reason.level], markup=False, soft_wrap=True)


def table(*headings: str) -> Table:
    """An empty table for results, whose cells break rather than lose letters."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    made = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in headings:
        made.add_column(heading, overflow="fold")
    return made


def say_average(run: Run) -> None:
    """Print the models of an average with their weights, and what of the doubt is the choice between them."""
    from rich.markup import escape

    from calib.report import averaged_models, modulus_share, weighting_in_words

    models = run.posterior.diagnostics.models
    shown = table("run", "model", "weight", "90 % of it", "Young's modulus (MPa)")
    for m in averaged_models(models, None):
        shown.add_row(*map(escape, (m.name, m.model, m.weight, m.interval, m.young_modulus)))
    out().print(shown)
    say(f"Weighted {weighting_in_words(run.posterior)}.")
    if share := modulus_share(models):
        say(f"The choice of model is {share} of the variance of Young's modulus.")


def exit_by(verdict: Verdict, strict: bool) -> None:
    """Leave with exit code 3 if the numbers must not be used; otherwise go on.

    Parameters
    ----------
    verdict : on them.
    strict : whether amber is not good enough either.

    Raises
    ------
    Exit
        If so.
    """
    if verdict.colour == "red" or (strict and verdict.colour == "amber"):
        amber = ", which --strict does not accept" if verdict.colour == "amber" else ": do not use the numbers"
        raise not_usable(f"all is written, but the verdict is {verdict.colour}{amber}")


def not_usable(why: str) -> typer.Exit:
    """Say on the last line of standard error why the exit code is 3, and give what leaves with it.

    Parameters
    ----------
    why : without a full stop.
    """
    err().print(f"Exit code {NOT_USABLE}: {why}.", markup=False, soft_wrap=True)
    return typer.Exit(NOT_USABLE)


@contextmanager
def refusing_bad_input() -> Iterator[None]:
    """Turn what is wrong with an input, or cannot be had of the system, into its message on stderr and exit code 2.

    A defect still shows its trace. Linear algebra inside has one thread: the matrices are small, and what is large is spread
    over processes.
    """
    try:
        with one_thread():
            yield
    except InputError as error:
        _refuse([str(fault) for fault in error.faults])
    except (OutOfRangeError, ConvergenceError) as error:
        _refuse([str(error)])
    except BrokenPipeError:
        _refuse(["standard output: its reader ended before all was said. Send it to a file: calib ... > output.txt"])
    except OSError as error:
        _refuse([_os_error_in_words(error)])
    except MemoryError as error:
        _refuse([f"there is not enough memory ({error or 'none left'}). Close other programs, or ask for less at once"])
    except BrokenExecutor:
        advice = "Give fewer --processes, or close other programs"
        _refuse([f"a worker process was ended from outside, as systems do that run out of memory. {advice}"])


def _refuse(messages: list[str], code: int = BAD_INPUT) -> None:
    with suppress(OSError):  # nobody may be there to read them either
        for message in messages:
            err().print(f"Error: {message}", style="red", markup=False, soft_wrap=True)
    for stream in (sys.stdout, sys.stderr):
        _drop_pending(stream)
    raise typer.Exit(code)


def _drop_pending(stream: TextIO | None) -> None:
    """Let what a stream cannot take go nowhere, as Python would complain of it in the end, with an exit code of its own."""
    if stream is None:
        return
    try:
        stream.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)


# What the system says -> what it means, and what to do.
_OS_ERRORS = {
    errno.ENOSPC: ("there is no room left on the disk", "Make room, or choose a place on another disk"),
    errno.EDQUOT: ("your share of the disk is used up", "Make room, or choose a place on another disk"),
    errno.EFBIG: ("the file gets larger than files may be here", "Choose a place on another disk"),
    errno.EROFS: ("the disk can only be read", "Choose a place on another disk"),
    errno.EACCES: ("permission denied", "Choose another place, or ask for the right to use this one"),
    errno.EPERM: ("permission denied", "Choose another place, or ask for the right to use this one"),
    errno.ENOENT: ("there is no such file or folder", "Look at the name"),
    errno.EISDIR: ("this is a folder, and a file is wanted", "Look at the name"),
    errno.ENOTDIR: ("a part of this name is a file, and a folder is wanted", "Look at the name"),
    errno.EEXIST: ("it exists and is not overwritten", "Choose another name"),
    errno.ENAMETOOLONG: ("the name is too long", "Choose a shorter one"),
    errno.ELOOP: ("the link leads in a circle", "Look at where it points"),
    errno.EIO: ("the disk or network drive failed to read or write", "Look at the drive, or choose a place on another"),
    errno.ESTALE: ("the network drive has gone", "Connect it again, or choose another place"),
    errno.EMFILE: ("too many files are open", "Close other programs, or give fewer --processes"),
    errno.ENOMEM: ("there is not enough memory", "Close other programs, or ask for less at once"),
}


def _os_error_in_words(error: OSError) -> str:
    """Say which file something cannot be done with, why, and what to do."""
    said = error.strerror or str(error) or "the system refuses it"
    message, advice = _OS_ERRORS.get(error.errno or 0, (said, "Look at the file and its place, then try again"))
    name = error.filename
    return str(Fault(message, Path(os.fsdecode(name)) if isinstance(name, str | bytes | os.PathLike) else None, advice=advice))


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


def thicknesses(text: str | None) -> tuple[float, float]:
    """Read the option --padding, thinnest and thickest with a colon between, into metres; 0 to 9 mm if it was not given.

    Parameters
    ----------
    text : what was given.

    Raises
    ------
    InputError
        If the text is no such range.
    """
    parts = ("0 mm:9 mm" if text is None else text).split(":")
    if len(parts) != 2:
        advice = 'Write it as "0 mm:9 mm"; about a pad that is there a narrow one, "1.09 mm:1.11 mm"'
        raise InputError(Fault(f'--padding: "{text}" is not a range', advice=advice))
    lower, upper = (quantity(part, "m", "--padding") for part in parts)
    return lower, upper


def loaded(folder: Path) -> Run:
    """Load the finished run in a folder; say on stderr what is no longer as it was when the run was made."""
    from calib.runs import load_run

    run = load_run(folder)
    for note in (*run.notes, *run.gone):
        err().print(f"Note: {note}", markup=False, soft_wrap=True)
    return run


def as_given() -> str:
    """The command line of this process, as it can be pasted."""
    return shlex.join(["calib", *sys.argv[1:]])


def pasted(words: Sequence[str], options: Mapping[str, Path | float | None]) -> str:
    """A command to be pasted into a shell.

    Parameters
    ----------
    words : that it begins with, paths quoted.
    options : name -> value; those that are None are left out.
    """
    given = [(name, value) for name, value in options.items() if value is not None]
    return " ".join([*words, *(f"{n} {in_shell_path(v) if isinstance(v, Path) else f'{v:g}'}" for n, v in given)])


@contextmanager
def paging() -> Iterator[None]:
    """Turn a report that could not be made into its message on stderr and its exit code: all else is written by then.

    Raises
    ------
    Exit
        If that is so.
    """
    from calib.runs import PageError

    try:
        yield
    except PageError as error:
        err().print(f"Error: {error}", style="red", markup=False, soft_wrap=True)
        raise typer.Exit(NO_PAGE) from error


@contextmanager
def telling(folder: Path) -> Iterator[None]:
    """Turn a standard output that takes nothing into its message on stderr and its exit code: the run is whole by then.

    Parameters
    ----------
    folder : of the run.

    Raises
    ------
    Exit
        If that is so.
    """
    try:
        yield
    except OSError as error:
        reason = "its reader ended" if isinstance(error, BrokenPipeError) else error.strerror or str(error)
        _refuse([f"standard output: {reason}. All results are written: calib report {in_shell_path(folder)}"], NO_PAGE)


@contextmanager
def counting() -> Iterator[Callable[[str, int, int], None]]:
    """Show progress on stderr, if that is a terminal; gives a function of what is counted, how many are done, of how many."""
    from rich.progress import Progress, TaskID

    console = err()
    tasks: dict[str, TaskID] = {}
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:

        def show(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what)
            bar.update(tasks[what], completed=done, total=total)

        yield show
