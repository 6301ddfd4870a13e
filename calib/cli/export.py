"""The command `export`: a run in, what the firmware of a gripper needs to turn capacitance into force out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import (
    NOT_USABLE,
    RunFolder,
    Strict,
    err,
    exit_by,
    loaded,
    out,
    quantity,
    refusing_bad_input,
    say,
    say_verdict,
    table,
)
from calib.errors import Fault, InputError

if TYPE_CHECKING:
    from calib.decision import GripperTables


def export(
    run: RunFolder,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder to write; must not exist yet.")],
    padding: Annotated[
        str | None, typer.Option(help='Padding of the sensor that is to be built, e.g. "5.5 mm" [default: no such table].')
    ] = None,
    force: Annotated[
        str | None, typer.Option(help='Largest force to be read, e.g. "5 N" [default: the largest that was measured].')
    ] = None,
    parasitic: Annotated[
        str | None,
        typer.Option(
            metavar="MEAN,SD",
            help='What the leads of the gripper add, read without sensor, e.g. "2 pF, 0.2 pF" [default: the leads of the lab].',
        ),
    ] = None,
    noise: Annotated[
        str | None, typer.Option(help='Noise of one reading (sd), e.g. "5 fF" [default: that of the meter of the lab].')
    ] = None,
    tare: Annotated[int, typer.Option(min=1, help="Readings at power-on that the tare is the mean of.")] = 64,
    draws: Annotated[int, typer.Option(min=100, help="Draws of the posterior to use.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of draws.")] = 1,
    strict: Strict = False,
) -> None:
    """Export capacitance to force for a gripper, with bounds and a status: C header, Python file, tables, simulated taxels.

    There is a table for each specimen that was measured, for the next of the same lot, and for the next on the padding given.
    A reading is c / c0 - 1, c0 the mean of readings at power-on without contact. The 90 % bounds hold what the calibration
    does not know, the noise, and the error of the tare. Loading only; unloading and temperature are not covered.

    Example: `calib export run1 --padding "5.5 mm" -o gripper`

    Writes: gripper/README.md, force_tables.h, force_tables.py, force_tables.csv, force_tables.json, taxels.json; all or none.

    The verdict is that of the calibration, amber at best beyond what was measured, and stands in every file.

    Exit codes: 0 done, the verdict green or amber; 2 bad input, or a sensor outside the model's range, nothing written; 3 the
    verdict on the calibration is red, nothing written; or done, with --strict, but it is amber.
    """
    with refusing_bad_input():
        from calib.decision import Gripper
        from calib.report import status_in_words
        from calib.runs import NotUsableError, export_in

        gripper = Gripper(
            force=None if force is None else quantity(force, "N", "--force"),
            padding=None if padding is None else quantity(padding, "m", "--padding"),
            parasitic=None if parasitic is None else _mean_and_sd(parasitic),
            noise=None if noise is None else quantity(noise, "F", "--noise"),
            n_tare=tare,
            n_draw=draws,
        )
        found = loaded(run)
        try:
            made = export_in(found, gripper, output, seed=seed)
        except NotUsableError as error:
            say_verdict(error.verdict, status_in_words(error.verdict))
            err().print(f"Error: {error}", style="red", markup=False, soft_wrap=True)
            raise typer.Exit(NOT_USABLE) from None
        _show(made)
        say_verdict(made.verdict, status_in_words(made.verdict, "the tables"))
        say(f"Written: {output}; begin with {output / 'README.md'}")
    exit_by(made.verdict, strict)


def _show(made: GripperTables) -> None:
    from rich.markup import escape

    shown = table("sensor", "readings (ppm)", "forces (N)", "90 % at half of it (N)", "verdict")
    for found in made.tables:
        at = found.read(found.ratio)
        half = int(abs(at.force - 0.5 * found.largest).argmin())
        shown.add_row(
            escape(found.name),
            f"{found.touch * 1e6:.0f} to {found.ratio[-1] * 1e6:.0f}",
            f"up to {found.largest:.3g}",
            f"{at.force[half]:.3f} ({at.lower[half]:.3f} to {at.upper[half]:.3f})",
            found.verdict.colour,
        )
    out().print(shown)


def _mean_and_sd(text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(Fault(f'--parasitic: "{text}" is not a mean and a standard deviation', advice='Write "2 pF, 0.2 pF"'))
    mean, sd = (quantity(part, "F", "--parasitic") for part in parts)
    return mean, sd
