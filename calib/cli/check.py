"""The command `check`: an experiment file in, what is implausible in it and what its data will tell out; nothing is sampled."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import BAD_INPUT, BUDGET, not_usable, out, pasted, refusing_bad_input, say, say_verdict, table
from calib.cli.stopping import when_stopped
from calib.errors import in_shell_path
from calib.regular import require_shown

if TYPE_CHECKING:
    from calib.checks import Outlook, Range
    from calib.runs import Check


def check(
    experiment: Annotated[Path, typer.Argument(help="The experiment file (TOML), see `calib init`.")],
    surrogate: Annotated[Path | None, typer.Option(help="Surrogate file to use instead of the shipped one.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the same as JSON, all numbers SI.")] = False,
) -> None:
    """Check an experiment before it is calibrated: files, geometry and priors, in seconds; nothing is sampled or written.

    What the priors expect of force, depth and capacitance is held against what was read. A mode of the posterior is looked for,
    and how far it lies from the priors. Then slips are tried that happen to careful people: a diameter entered for a radius, kN
    for N, kPa for MPa, two files or two thicknesses mixed up. One is named if the data would be a thousand times as probable
    without it.

    It also says what the data will tell: how much of each unknown, which ones only together, and what would part them.

    `calib calibrate` begins with the same check, and stops if it is red.

    Example: `calib check experiment.toml`

    Writes: nothing.

    Exit codes: 0 green; 3 amber: something is doubtful; 2 red, or something is wrong with the input.
    """
    with refusing_bad_input(), when_stopped(lambda: "Stopped. Nothing was begun."):
        from calib.runs import check as run_check

        if surrogate is not None:
            require_shown(surrogate)
        found = run_check(experiment, surrogate)
        if as_json:
            typer.echo(json.dumps(found.to_plain(), indent=1))
        else:
            _say(found, experiment)
    colour = found.verdict.colour
    if colour == "amber":
        raise not_usable("something is doubtful; it may be calibrated all the same")
    if colour == "red":
        raise typer.Exit(BAD_INPUT)


def _say(found: Check, path: Path) -> None:
    from calib.report import check_status_in_words, duration_in_words

    say_verdict(found.verdict, check_status_in_words(found.verdict))
    if found.ranges:
        _say_ranges(found.ranges)
    if found.outlook is None:
        say("What the data will tell is not said: this stands in the way, or there is no first answer.")
    else:
        _say_outlook(found.outlook)
    budget = budget_for(found.seconds)
    if found.seconds is not None:
        low, high = (duration_in_words(seconds) for seconds in found.seconds)
        text = f"A calibration will take about {low} to {high} on this machine if nothing else runs on it."
        if budget is not None:
            text += f" Its budget is {BUDGET:g} min unless --budget says otherwise; --resume goes on where it ended."
        say(text)
    if found.verdict.colour == "green":
        say(f"Next: {pasted(['calib calibrate', in_shell_path(path), '-o RUN'], {'--budget': budget})}")


def budget_for(seconds: tuple[float, float] | None) -> float | None:
    """The budget that a calibration may need [min], in multiples of the usual one; None where that is enough.

    Parameters
    ----------
    seconds : what it will take at least and at most [s]; None if that is not known.

    Examples
    --------
    >>> budget_for((30, 500)), budget_for((30, 1210)), budget_for(None)
    (None, 30.0, None)
    """
    if seconds is None or seconds[1] <= 60 * BUDGET:
        return None
    return BUDGET * math.ceil(seconds[1] / (60 * BUDGET))


def _say_ranges(ranges: tuple[Range, ...]) -> None:
    from rich.markup import escape

    from calib.checks import expected_in_words, measured_in_words

    shown = table("sweep", "seen", "measured", "expected (99 % of the priors)")
    for r in ranges:
        shown.add_row(escape(r.sweep), r.seen, measured_in_words(r), expected_in_words(r))
    out().print(shown)


def _say_outlook(outlook: Outlook) -> None:
    from rich.markup import escape

    from calib.report import outlook_rows

    shown = table("what the data will tell", "known before (sd)", "after (sd)", "learned")
    for name, *told in outlook_rows(outlook):
        shown.add_row(escape(name), *told)
    out().print(shown)
    for ridge in outlook.ridges:
        say(f"Ridge: {ridge.in_words}.")
    for one in outlook.unseen:
        say(f"Not seen: {one.in_words}.")
