"""The command `average`: runs of the same data under different models to a run that is an average over them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from calib.cli.common import Strict, as_given, exit_by, loaded, paging, refusing_bad_input, say, say_average, say_verdict


def average(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN RUN...", help="Runs of the same data, the experiment's own first.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="RUN", help="Folder for the average.")],
    by: Annotated[
        Literal["stacking", "pseudo-bma", "evidence"], typer.Option(help="What the models are weighted by.")
    ] = "stacking",
    strict: Strict = False,
) -> None:
    """Average runs of the same data under different models, so that what is not known of the model is in the uncertainty.

    Draws of each run are taken in proportion to its weight: how well the mixture (stacking), or it alone (pseudo-BMA+),
    predicts blocks of data that were left out, or how probable the data are under its model (evidence). The average is a run
    like any other for `calib recommend`, `calib report` and `calib verify`; recommendations say how much of their doubt is the
    choice of model.

    Example: `calib average models/as-given models/own-padding -o averaged`

    Writes: averaged/posterior.nc, summary.json, summary.csv, report.html, run.json, and the posterior of each run in
    averaged/members.

    Exit codes: 0 done, the verdict green or amber; 1 the page could not be made, and saying why; 2 no usable runs there, or of
    different data, nothing written; 3 done, but the verdict is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.report import status_in_words
        from calib.runs import average_runs

        made, page_error = average_runs([loaded(run) for run in runs], output, by=by, command=as_given())
        say_average(made)
        say_verdict(made.verdict, status_in_words(made.verdict))
        say(f"Written: {output / 'posterior.nc'}, {made.report}")
        with paging():
            if page_error is not None:
                raise page_error
    exit_by(made.verdict, strict)
