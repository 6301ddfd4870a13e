"""The command `figures`: a run in, every figure of its report as a file for a paper out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from calib.cli.common import RunFolder, Strict, exit_by, loaded, refusing_bad_input, say, say_verdict


def figures(
    run: RunFolder,
    kind: Annotated[
        Literal["pdf", "svg", "png"], typer.Option("--format", help="Lines and letters (pdf, svg), or dots (png).")
    ] = "pdf",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder to write into [default: RUN/figures].")
    ] = None,
    strict: Strict = False,
) -> None:
    """Write every figure of a report as a file for a paper, and captions.md with what each shows.

    Figures are 117 mm wide with letters of 9 points, which are in the files; over one column of a journal these have 6.5. Names
    follow from what is shown, and the same run gives the same bytes.

    Example: `calib figures run1 --format svg -o paper/figures`

    Writes: one file for each figure, and captions.md, in place of earlier ones of the same names.

    Exit codes: 0 done, the verdict green or amber; 2 bad input or no usable run there; 3 done, but the verdict on the
    calibration is red, which captions.md says, too, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.report import status_in_words
        from calib.runs import figures_in

        found = loaded(run)
        written = figures_in(found, output, kind=kind)
        say_verdict(found.verdict, status_in_words(found.verdict))
        say(f"Written: {len(written) - 1} figures in {written[-1].parent}, {written[-1].name} says what they show")
    exit_by(found.verdict, strict)
