"""The command `diff`: two runs of different data in, every unknown side by side and what else differs out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import loaded, not_usable, out, refusing_bad_input, say, table
from calib.errors import Fault, InputError
from calib.files import require_writable

if TYPE_CHECKING:
    from calib.checks import Difference


def diff(
    first: Annotated[Path, typer.Argument(metavar="RUN", help="Folder written by `calib calibrate`.")],
    second: Annotated[Path, typer.Argument(metavar="RUN2", help="Another, of other data.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the curves of both (.png, .svg, .pdf).")
    ] = None,
    same_specimens: Annotated[
        bool, typer.Option("--same-specimens", help="Specimens of one name are the same pieces, measured again.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the same as JSON, all numbers SI.")] = False,
) -> None:
    """Compare two calibrations of different data: another lot, day or lab. Models of the same data: `calib compare`.

    Every unknown of both side by side, with z: the difference in its standard deviations. What both believed of material and
    rig before their data counts once. No z is given where data are in both runs, or where neither has learned anything. Then
    all that is not the same in experiments, priors, files, models and versions.

    Example: `calib diff lot1 lot2 -o curves.png`

    Writes: FILE, if it is asked for.

    Exit codes: 0 done; 2 no usable runs there, nothing written; 3 done, but the verdict on one of the runs is red.
    """
    with refusing_bad_input():
        from calib.report import difference_figure, write_figure
        from calib.runs import diff_runs

        if output is not None:
            if output.suffix not in (".png", ".svg", ".pdf"):
                raise InputError(Fault("a picture ends in .png, .svg or .pdf", output))
            require_writable(output)
        found = diff_runs(loaded(first), loaded(second), same_specimens=same_specimens)
        if output is not None:
            write_figure(difference_figure(found.loadings), output)
        if as_json:
            typer.echo(json.dumps(found.to_plain(), indent=1))
        else:
            _show(found)
            if output is not None:
                say(f"Written: {output}")
        red = [name for name, colour in zip(found.names, found.colours, strict=True) if colour == "red"]
    if red:
        raise not_usable(f"the verdict on {' and on '.join(red)} is red: its numbers must not be used")


def _show(found: Difference) -> None:
    from rich.markup import escape

    from calib.report import pair_rows

    one, other = (
        escape(f"{name} (red: no result)" if colour == "red" else name)
        for name, colour in zip(found.names, found.colours, strict=True)
    )
    shown = table("unknown", one, other, "unit", "z")
    for row in pair_rows(found):
        shown.add_row(*map(escape, row))
    out().print(shown)
    say(found.in_words)
    if found.changed:
        changed = table("not the same", one, other)
        for entry in found.changed:
            changed.add_row(*map(escape, (entry.what, entry.first, entry.second)))
        out().print(changed)
    if found.same and not found.shared:
        say(f"Taken for one and the same in both, so that what was believed before counts once: {', '.join(found.same)}.")
