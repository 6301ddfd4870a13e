"""The commands `export` and `force`: a run in, what turns capacitance into force out, for firmware and for one reading."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from calib.cli.common import (
    RunFolder,
    Strict,
    err,
    exit_by,
    loaded,
    not_usable,
    out,
    quantity,
    refusing_bad_input,
    say,
    say_verdict,
    table,
)
from calib.errors import Fault, InputError, in_shell

if TYPE_CHECKING:
    from calib.decision import ForceTable, GripperTables


Padding = Annotated[
    str | None, typer.Option(help='Padding of the sensor that is to be built, e.g. "5.5 mm" [default: no such sensor].')
]
LargestForce = Annotated[
    str | None, typer.Option(help='Largest force to be read, e.g. "5 N" [default: the largest that was measured].')
]
Parasitic = Annotated[
    str | None,
    typer.Option(
        metavar="MEAN,SD",
        help='What the leads of the gripper add, read without sensor, e.g. "2 pF, 0.2 pF" [default: the leads of the lab].',
    ),
]
Noise = Annotated[
    str | None, typer.Option(help='Noise of one reading (sd), e.g. "5 fF" [default: that of the meter of the lab].')
]
Draws = Annotated[int, typer.Option(min=100, help="Draws of the posterior to use.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the choice of draws.")]


def export(
    run: RunFolder,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder to write; must not exist yet.")],
    padding: Padding = None,
    force: LargestForce = None,
    parasitic: Parasitic = None,
    noise: Noise = None,
    tare_readings: Annotated[int, typer.Option(min=1, help="Readings at power-on that the tare is the mean of.")] = 64,
    tare: Annotated[str | None, typer.Option(hidden=True)] = None,
    draws: Draws = 1000,
    seed: Seed = 1,
    strict: Strict = False,
) -> None:
    """Export capacitance to force for a gripper, with bounds and a status: C header, Python file, tables, simulated taxels.

    There is a table for each specimen that was measured, for the next of the same lot, and for the next on the padding given.
    A reading is c / c0 - 1, c0 the mean of readings at power-on without contact. The 90 % bounds hold what the calibration
    does not know, the noise, and the error of the tare. They are of loading: by how much they are off while a load is let go is
    said where the lab files have it. Temperature is not covered.

    Tables are for the largest force that was measured. If the recommendation in the run is for a larger one, that is said, with
    the --force to give. For what one reading means see `calib force`.

    Example: `calib export run1 --padding "5.5 mm" -o gripper`

    Writes: gripper/README.md, force_tables.h, force_tables.py, force_tables.csv, force_tables.json, taxels.json; all or none.

    The verdict is that of the calibration, amber at best beyond what was measured, and stands in every file.

    Exit codes: 0 done, the verdict green or amber; 2 bad input, or a sensor outside the model's range, nothing written; 3 the
    verdict on the calibration is red, nothing written; or done, with --strict, but it is amber.
    """
    with refusing_bad_input():
        from calib.decision import Gripper
        from calib.report import status_in_words
        from calib.runs import export_in

        if tare is not None:
            advice = "Say --tare-readings 64 for how many readings the tare is the mean of; a tare goes with `calib force`"
            raise InputError(Fault("--tare is a capacitance, which tables are made without", advice=advice))
        gripper = Gripper(**_asked(padding, force, parasitic, noise), n_tare=tare_readings, n_draw=draws)
        found = loaded(run)
        with _usable():
            made = export_in(found, gripper, output, seed=seed)
        _show(made)
        say_verdict(made.verdict, status_in_words(made.verdict, "the tables"))
        say(f"Written: {output}; begin with {output / 'README.md'}")
    exit_by(made.verdict, strict)


def force_of(
    run: RunFolder,
    readings: Annotated[list[str], typer.Argument(metavar="CAPACITANCE...", help='One reading or several, e.g. "100 pF".')],
    tare: Annotated[
        str | None,
        typer.Option(help='Reading without contact, at power-on, e.g. "97.5 pF"; without it nothing can be told.'),
    ] = None,
    sensor: Annotated[str | None, typer.Option(help="The sensor, by its name [default: each, or that on --padding].")] = None,
    padding: Padding = None,
    force: LargestForce = None,
    parasitic: Parasitic = None,
    noise: Noise = None,
    draws: Draws = 1000,
    seed: Seed = 1,
    strict: Strict = False,
) -> None:
    """Say what force a capacitance means, between what bounds in 9 of 10 cases, and over what range that holds.

    A sensor is read as c / c0 - 1, with c0 its tare, what it reads without contact. A capacitance alone means nothing, as no
    two sensors have the same c0: without --tare the command says what tare to expect. One that is far off that is a reason for
    amber, and sensors that it cannot well be of are left out. All else is as in `calib export`, whose tables are read.

    Example: `calib force run1 "100 pF" --tare "97.5 pF" --padding "5.5 mm"`

    Writes: nothing.

    Exit codes: 0 done, the verdict green or amber (a reading beyond the range or below rest is amber); 2 bad input, or no tare;
    3 the verdict on the calibration is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.checks import verdict_of
        from calib.decision import Gripper
        from calib.report import range_in_words, reading_in_words, status_in_words
        from calib.runs import force_tables

        gripper = Gripper(**_asked(padding, force, parasitic, noise), n_draw=draws)
        read = [(text, _positive(text, "CAPACITANCE")) for text in readings]
        c0 = None if tare is None else (tare, _positive(tare, "--tare"))
        found = loaded(run)
        with _usable():
            made = force_tables(found, gripper, seed=seed, so="nothing is read from it")
        tables = _chosen(made, sensor)
        if sensor is not None and gripper.padding is not None and tables[0].sensor != "design":
            own = next(table for table in made.tables if table.sensor == "design")
            lies = f"which lies on {tables[0].padding_thickness * 1e3:.3g} mm"
            advice = f"Leave one of them out: on --padding lies {in_shell(own.name)}"
            raise InputError(Fault(f'--padding "{padding}" beside --sensor "{sensor}", {lies}', advice=advice))
        if c0 is None:
            expected = "; ".join(f"{table.name}, {table.tare_in_words}" for table in tables)
            message = (
                f"{readings[0]} alone means nothing: a sensor is read against its own tare, the capacitance without contact. "
                f"To be expected of {expected}"
            )
            raise InputError(Fault(message, advice='Read it without contact, and give it: --tare "97.5 pF"'))
        doubted = {table.name: doubt for table in tables if (doubt := table.tare_doubt(c0[1])) is not None}
        if len(doubted) < len(tables):
            for name in doubted:
                say(f"{name}: left out, {doubted[name].finding.removeprefix(f'{name}: ')}.")
            tables = tuple(table for table in tables if table.name not in doubted)
        for table in tables:
            for one in read:
                say(reading_in_words(table, one, c0))
            say(f"  holds for {range_in_words(table, c0[1])}; tare to be expected: {table.tare_in_words}")
        doubts = [doubted[table.name] for table in tables if table.name in doubted]
        doubts += [d for table in tables for _, c in read if (d := table.reading_doubt(c, c0[1])) is not None]
        verdict = verdict_of(dict.fromkeys((*doubts, *(r for table in tables for r in table.verdict.reasons))))
        say_verdict(verdict, status_in_words(verdict, "the forces" if len(read) * len(tables) > 1 else "the force"))
        for condition in dict.fromkeys(c for table in tables for c in table.conditions):
            if condition.startswith("not ruled out"):
                say(f"  {condition}")
            elif len(tables) == 1:
                say(f"  holds for: {condition}")
        if len(tables) > 1:
            say(f"One sensor alone: --sensor {in_shell(tables[0].name)}")
    exit_by(verdict, strict)


def _chosen(made: GripperTables, sensor: str | None) -> tuple[ForceTable, ...]:
    """The tables that are asked for: of a sensor by its name, else of the design, else all."""
    if sensor is None:
        return tuple(table for table in made.tables if table.sensor == "design") or made.tables
    if chosen := tuple(table for table in made.tables if table.name == sensor):
        return chosen
    names = ", ".join(in_shell(table.name) for table in made.tables)
    raise InputError(Fault(f'--sensor: there is no "{sensor}" in this run', advice=f"Choose one of {names}"))


def _positive(text: str, name: str) -> float:
    """A capacitance [F] that somebody read."""
    value = quantity(text, "F", name)
    if not 0 < value < math.inf:
        raise InputError(Fault(f'{name}: a capacitance is positive, got "{text}"', advice='Write for example "100 pF"'))
    return value


def _asked(padding: str | None, force: str | None, parasitic: str | None, noise: str | None) -> dict[str, Any]:
    """What is known of a gripper, as `Gripper` takes it."""
    return {
        "force": None if force is None else quantity(force, "N", "--force"),
        "padding": None if padding is None else quantity(padding, "m", "--padding"),
        "parasitic": None if parasitic is None else _mean_and_sd(parasitic),
        "noise": None if noise is None else quantity(noise, "F", "--noise"),
    }


@contextmanager
def _usable() -> Iterator[None]:
    """Turn a run whose numbers must not be used into its verdict, its message and its exit code.

    Raises
    ------
    Exit
        If it is one.
    """
    from calib.report import status_in_words
    from calib.runs import NotUsableError

    try:
        yield
    except NotUsableError as error:
        say_verdict(error.verdict, status_in_words(error.verdict))
        err().print(f"Error: {error}", style="red", markup=False, soft_wrap=True)
        raise not_usable("the run must not be used, and nothing was written") from None


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
    for text in dict.fromkeys(found.retreat.in_words for found in made.tables if found.sensor == "next" and found.retreat):
        say(f"Tables are of loading; {text}.")


def _mean_and_sd(text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(Fault(f'--parasitic: "{text}" is not a mean and a standard deviation', advice='Write "2 pF, 0.2 pF"'))
    mean, sd = (quantity(part, "F", "--parasitic") for part in parts)
    return mean, sd
