"""The command `batch`: a calibrated lot and a folder of lab files in, a light for each specimen and a page for all out."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import (
    Processes,
    RunFolder,
    Strict,
    counting,
    err,
    exit_by,
    loaded,
    not_usable,
    out,
    refusing_bad_input,
    say,
    say_verdict,
    table,
)
from calib.cli.stopping import when_stopped
from calib.digits import with_uncertainty
from calib.enumeration import first_of

if TYPE_CHECKING:
    from calib.decision import Batch

# Rows that are shown on the screen; all are in the files.
_MOST = 60


def batch(
    run: RunFolder,
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the lab files of many more specimens.")],
    spec: Annotated[
        Path | None, typer.Option(help="Specification (TOML) that each is held against, see `calib recommend`.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="DIR", help='Folder for the results; one in it goes on [default: FOLDER and "_batch"].'
        ),
    ] = None,
    like: Annotated[
        str | None, typer.Option(metavar="NAME", help="Specimen of the lot that they were meant to be like [default: any].")
    ] = None,
    budget: Annotated[
        float, typer.Option(min=0.0, help="Minutes for chains of one specimen where weighted draws will not do; 0 for none.")
    ] = 5.0,
    processes: Processes = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")] = 1,
    strict: Strict = False,
) -> None:
    """Inspect many specimens, given the calibration of their lot: what each is, whether it belongs, and whether it passes.

    The lab files are paired as by `calib init` (s001_press.csv with s001_cap.csv) and read as those of the lot were; each pair
    is a new specimen, pressed with the lot's ball on the lot's rig. The lot's posterior is what is believed of it before its
    files: a second or two each. The lot is not updated by them. With --spec each passes or fails, with both risks of JCGM 106.

    A file that cannot be read is a red row and stops no other. Stop it with Ctrl-C whenever you like: the same command goes on
    with what there is, and what has not changed is not computed again.

    Example: `calib batch run1 week47 --spec spec.toml -o week47_batch`

    Writes: batch.csv (a row each, SI), batch.json, batch.html, and inspected.jsonl, from which it goes on.

    Exit codes: 0 done, every light green or amber; 2 bad input, nothing written; 3 done, but a light is red (with --strict:
    amber), or the verdict on the lot's calibration is red and nothing was written; 130 stopped from the keyboard, 143 by
    SIGTERM, what was done is kept.
    """
    into = folder.absolute().with_name(f"{folder.absolute().name}_batch") if output is None else output
    with refusing_bad_input():
        from calib.experiment import read_specification
        from calib.report import duration_in_words, status_in_words
        from calib.runs import NotUsableError, batch_in
        from calib.workers import workers

        wanted = None if spec is None else read_specification(spec)
        found = loaded(run)

        def planned(missing: int, n: int, seconds: float) -> None:
            kept = f", {n - missing} of them kept" if missing < n else ""
            spread = min(processes or os.cpu_count() or 1, max(missing, 1))
            left = f"; the rest will take about {duration_in_words(missing * seconds / spread)}" if missing else ""
            say(f"{n} specimen{'s' if n != 1 else ''}{kept}{left}.")

        try:
            with (
                workers(processes) as executor,
                when_stopped(lambda: f"Stopped; what was done is kept in {into}. The same command goes on."),
                counting() as told,
            ):
                made = batch_in(
                    found,
                    folder,
                    into,
                    executor,
                    specification=wanted,
                    like=like,
                    seed=seed,
                    chain_seconds=60 * budget,
                    planned=planned,
                    progress=partial(told, "specimens"),
                )
        except NotUsableError as error:
            say_verdict(error.verdict, status_in_words(error.verdict))
            err().print(f"Error: {error}", style="red", markup=False, soft_wrap=True)
            raise not_usable("the lot's own run must not be used, and nothing was inspected") from None
        _say(made, into)
    if red := [row.name for row in made.rows if row.light == "red"]:
        raise not_usable(f"all is written, and red {'is' if len(red) == 1 else 'are'} {first_of(red)}: set them aside")
    exit_by(made.verdict, strict)


def _say(made: Batch, folder: Path) -> None:
    from rich.markup import escape

    from calib.decision import DRIFTING, percent
    from calib.report import batch_status, lot_status, risks_of_which

    say_verdict(made.of_lot, lot_status(made))
    judged = made.specification is not None
    of_judged = ["decision", "conforms with"] if judged else []
    headings = ("modulus (MPa)", f"signal at {made.force:g} N (%)", "first reason of its own")
    shown = table("specimen", "light", "belongs", *of_judged, *headings)
    styles = {"green": "green", "amber": "yellow", "red": "bold red"}
    for row in made.rows[:_MOST]:
        cells = [f"[{styles[row.light]}]{row.light}[/]", row.belongs]
        if judged:
            c = row.conformity if row.decision != "none" else None
            cells += ["" if row.decision == "none" else row.decision, "" if c is None else percent(c.probability)]
        for name, scale in (("young_modulus", 1e-6), ("signal", 1e2)):
            mean, sd = row.estimates.get(name, (None, None))[:2]
            cells.append("" if mean is None or sd is None else with_uncertainty(mean * scale, sd * scale))
        reason = row.own[0].finding if row.own else ""
        shown.add_row(escape(row.name), *cells, escape(reason))
    out().print(shown)
    if len(made.rows) > _MOST:
        say(f"and {len(made.rows) - _MOST} more: batch.csv has all of them")
    say_verdict(made.of_specimens, batch_status(made), made.verdict.colour)
    if made.pooling == "complete":
        say(
            "The lot was calibrated as one material: newcomers are held to that of the calibrated specimens, with no spread of "
            'their own. With pooling = "partial" in the experiment file of the lot each has its own.'
        )
    for trend in made.trends:
        say(f"{trend.in_words(DRIFTING[trend.quantity])[:1].upper()}{trend.in_words(DRIFTING[trend.quantity])[1:]}.")
    if (risks := made.risks) is not None:
        told = f"consumer's risk {percent(risks.consumers)}, producer's risk {percent(risks.producers)}"
        passed = sum(row.decision == "pass" for row in made.rows)
        say(f"{passed} of {len(made.judged)} that were judged pass; {told} ({risks_of_which(made)}).")
    say(f"Holds for {made.conditions[0]}.")
    lights = ", ".join(f"{made.count(light)} {light}" for light in ("green", "amber", "red"))
    many = "s" if len(made.rows) != 1 else ""
    say(f"{len(made.rows)} specimen{many}: {lights}. Each by itself given the lot, which they do not update. Written: {folder}")
