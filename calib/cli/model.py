"""Commands on the model of the sensor: `simulate` one loading curve; describe, check and train the fast `surrogate`."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import ModelName, err, load_forward, out, quantity, refusing_bad_input, say, write_whole
from calib.errors import Fault, InputError

if TYPE_CHECKING:
    from models.response import Response
    from models.surrogate import Surrogate

surrogate = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="The fast stand-in for the finite elements: describe it, check it, train another.",
)

#: Columns of a simulated curve.
CURVE_COLUMNS = ("displacement_m", "force_N", "contact_radius_m", "capacitance_F", "capacitance_change")


def simulate(
    design: Annotated[Path, typer.Argument(help="The design file (TOML): ball, sensor, padding.")],
    displacement: Annotated[str | None, typer.Option(help='Indentation to go to, with unit, e.g. "0.7 mm".')] = None,
    force: Annotated[str | None, typer.Option(help='Force to go to instead, e.g. "5 N".')] = None,
    steps: Annotated[int, typer.Option(min=1, max=100000, help="Equal steps up to there.")] = 14,
    model: Annotated[
        ModelName, typer.Option(help="fem is exact and slow, closed-form rough and instant.")
    ] = ModelName.surrogate,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV file to write [default: the screen].")] = None,
    surrogate_file: Annotated[
        Path | None, typer.Option("--surrogate", help="Surrogate file to use instead of the shipped one.")
    ] = None,
) -> None:
    """Simulate the loading curve of one design, up to an indentation or a force.

    Example: `calib simulate design.toml --displacement "0.7 mm" -o curve.csv`

    Another: `calib simulate design.toml --force "5 N" --steps 20 --model fem -o curve.csv`

    Writes: one row per step, the last one at the requested end, columns displacement_m, force_N, contact_radius_m,
    capacitance_F, capacitance_change (C/C0 - 1).

    Exit codes: 0 done; 2 bad input, outside the model's range, or no equilibrium found; nothing written.
    """
    with refusing_bad_input():
        from calib.experiment import read_design
        from calib.predictive import loading_curve

        if (displacement is None) == (force is None):
            raise InputError(Fault("give either --displacement or --force", advice='For example --displacement "0.7 mm"'))
        if output is not None and output.exists() and design.exists() and output.samefile(design):
            raise InputError(Fault("the output would overwrite the design file itself", output, advice="Choose another -o"))
        depth = quantity(displacement, "m", "--displacement") if displacement is not None else None
        load = quantity(force, "N", "--force") if force is not None else None
        for name, value in (("--displacement", depth), ("--force", load)):
            if value is not None and value <= 0:
                raise InputError(Fault(f"{name} must be positive, got {displacement or force}"))
        pressed = read_design(design)
        text = curve_csv(
            loading_curve(load_forward(model, surrogate_file), pressed, displacement=depth, force=load, steps=steps)
        )
        if output is None:
            typer.echo(text, nl=False)
        else:
            write_whole(output, text)
            say(f"Written: {output} ({steps} steps, {model})")


def curve_csv(curve: Response) -> str:
    """A loading curve as CSV with the columns `CURVE_COLUMNS`, SI."""
    import numpy as np

    columns = (curve.depth, curve.force, curve.contact_radius, curve.capacitance, curve.capacitance_change)
    rows = np.stack([np.reshape(c, -1) for c in columns], axis=1)
    return "\n".join([",".join(CURVE_COLUMNS), *(",".join(f"{v:.10g}" for v in row) for row in rows)]) + "\n"


Processes = Annotated[int | None, typer.Option(min=1, help="Worker processes [default: number of CPUs].")]
SurrogateFile = Annotated[Path | None, typer.Option("--surrogate", help="Surrogate file [default: the shipped one].")]


@surrogate.command()
def info(file: SurrogateFile = None) -> None:
    """Say where the surrogate comes from, how far off it is, and what it covers.

    Example: `calib surrogate info`

    Exit codes: 0 done; 2 no such surrogate.
    """
    with refusing_bad_input():
        from rich.markup import escape
        from rich.table import Table

        shown = Table.grid(padding=(0, 2))
        for key, value in _load(file).info().items():
            shown.add_row(escape(key), escape(value))
        out().print(shown)


@surrogate.command()
def validate(
    file: SurrogateFile = None,
    designs: Annotated[int, typer.Option(min=1, help="Fresh random designs to compare on.")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the designs.")] = 1,
    processes: Processes = None,
) -> None:
    """Compare the surrogate with finite elements on fresh random designs over its whole range.

    Takes about a second per design and process. Prints the error of force and of capacitance change, and how often the truth
    lies inside the surrogate's own 90 % band.

    Example: `calib surrogate validate --designs 50 --seed 2`

    Exit codes: 0 done; 2 no such surrogate.
    """
    with refusing_bad_input():
        from rich.table import Table

        from models.validation import random_designs
        from models.validation import validate as compare

        fast = _load(file)
        with _workers(processes) as executor, _counting("designs") as progress:
            found = compare(fast, random_designs(designs, seed), executor, progress=progress)
        columns = ("quantity", "points", "error, median", "95 %", "worst", "share", "inside own 90 % band")
        shown = Table(*columns)
        for row in found.table():
            shown.add_row(*row)
        out().print(shown)
        for failure in found.failures:
            say(f"no equilibrium: {failure}")


@surrogate.command()
def train(
    output: Annotated[Path, typer.Option("-o", "--output", help="Surrogate file to write (npz).")],
    points: Annotated[int, typer.Option(min=1, help="Finite-element loading curves to train on.")] = 2048,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of designs.")] = 1,
    accuracy: Annotated[
        float, typer.Option(min=1e-5, max=0.1, help="Relative accuracy the finite elements are meshed for.")
    ] = 1e-3,
    processes: Processes = None,
) -> None:
    """Train a surrogate on finite-element loading curves spread over the whole range of designs.

    Takes about a second per curve and process. The file is used with `--surrogate FILE` in the other commands; check it first
    with `calib surrogate validate --surrogate FILE`.

    Example: `calib surrogate train -o mine.npz --points 2048 --processes 8`

    Exit codes: 0 done; 2 too few points, or no place to write.
    """
    with refusing_bad_input():
        from models.surrogate import fit_surrogate, least_paths
        from models.training import design_points, run_training

        # Better said before an hour of finite elements than after.
        if points < least_paths():
            raise InputError(Fault(f"--points {points} are too few to train on", advice=f"Give at least {least_paths()}"))
        if output.exists():
            raise InputError(Fault("the file exists and is not overwritten", output, advice="Choose another -o"))
        if not output.absolute().parent.is_dir():
            raise InputError(Fault(f"the folder {output.absolute().parent} does not exist", output, advice="Create it first"))
        with _workers(processes) as executor, _counting("loading curves") as progress:
            data = run_training(design_points(points, seed), executor, accuracy=accuracy, seed=seed, progress=progress)
        try:
            fitted = fit_surrogate(data)
        except ValueError as error:
            raise InputError(Fault(f"--points: {error}")) from None
        fitted.save(output)
        say(f"Written: {output} ({len(data.failures)} of {points} curves found no equilibrium)")


def _load(file: Path | None) -> Surrogate:
    from models.surrogate import Surrogate

    found = load_forward("surrogate", file)
    assert isinstance(found, Surrogate)
    return found


@contextmanager
def _workers(processes: int | None) -> Iterator[Executor]:
    """Processes with one BLAS thread each."""
    # Workers read these when they import NumPy.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(name, "1")
    with ProcessPoolExecutor(processes or os.cpu_count(), mp_context=multiprocessing.get_context("spawn")) as executor:
        yield executor


@contextmanager
def _counting(what: str) -> Iterator[Callable[[int, int], None]]:
    """Progress on stderr, if that is a terminal."""
    from rich.progress import Progress

    console = err()
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
