"""The command `next`: a finished run in, the measurements that would tell most for an hour in the lab out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from calib.cli.common import (
    RunFolder,
    Strict,
    as_given,
    exit_by,
    loaded,
    out,
    paging,
    quantity,
    refusing_bad_input,
    say,
    say_verdict,
    table,
    thicknesses,
)
from calib.errors import Fault, InputError, in_shell_path
from calib.files import require_writable, write_text

if TYPE_CHECKING:
    from calib.decision import NextMeasurements, Requirement
    from calib.experiment import Specification
    from calib.runs import Run


def next_measurement(
    run: RunFolder,
    what: Annotated[
        Literal["modulus", "padding", "spec"],
        typer.Option("--for", help="What is to be known better: the modulus, the signal, or whether a specification is met."),
    ] = "modulus",
    force: Annotated[str | None, typer.Option(help="Force at which the signal counts [default: as recommended for].")] = None,
    padding: Annotated[
        str | None, typer.Option(help='With --force: thicknesses to choose from [default: "0 mm:9 mm"].')
    ] = None,
    spec: Annotated[
        Path | None, typer.Option(help="With --for spec: specification file [default: as recommended for].")
    ] = None,
    bench: Annotated[Path | None, typer.Option(help="TOML file: what your lab can measure, how well, in what time.")] = None,
    draft: Annotated[Path | None, typer.Option(help="Experiment file to draft; never overwritten.")] = None,
    number: Annotated[int, typer.Option(min=1, help="With --draft: which measurement, by its number.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of draws.")] = 1,
    strict: Strict = False,
) -> None:
    """Say what to measure next: which press or reading makes the result surer by most for an hour in the lab.

    For each of them (press once more, deeper, with another ball, one more sensor, other padding; measure a thickness, the
    machine's compliance, ...) it is worked out how sure the modulus, or the signal on the recommended padding, would be after
    it. Nothing is sampled. What the ranking rests on, and what cannot be judged, is said below it: docs/next.md.

    With --for spec it is worked out how often it would be decided wrongly whether sensors are released for a specification, or
    held back, and how much better the padding would be chosen.

    Example: `calib next run1 --for padding --force "10 N" --draft next.toml`, `calib next run1 --for spec --spec spec.toml`

    Writes: run1/next.json (SI), run1/report.html anew with the first three, and the draft of an experiment file with the
    measurement in it, if asked for.

    Exit codes: 0 done, the verdict green or amber; 1 the page could not be made, and saying why; 2 bad input, nothing written;
    3 done, but the verdict is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.experiment import MARK, read_bench
        from calib.report import status_in_words
        from calib.runs import next_in

        if draft is not None:
            if draft.exists():
                raise InputError(Fault("the file exists and is not overwritten", draft, advice="Choose another --draft"))
            require_writable(draft, "Create it, or choose another --draft")
        of_lab = None if bench is None else read_bench(bench)
        found = loaded(run)
        requirement = _requirement(found, what, force, padding, spec)
        require_writable(run / "next.json")
        with paging():
            result = next_in(found, requirement, of_lab, seed=seed, command=as_given())
        text = "" if draft is None else result.draft(number, draft.absolute().parent)
        _say(result)
        say_verdict(result.verdict, status_in_words(result.verdict, "the ranking"))
        for reason in result.unjudged:
            say(f"  not judged: {reason}")
        for condition in result.rests_on:
            say(f"  rests on: {condition}")
        say(f"Written: {run / 'next.json'}, {run / 'report.html'}")
        if draft is not None:
            write_text(draft, text)
            lines = text.count(MARK)
            marked = f"{lines} line{'s' if lines > 1 else ''} marked EDIT"
            say(f"Written: {draft}, with {marked}. Put your files and values there, then:")
            say(f"  calib check {in_shell_path(draft)}")
    exit_by(result.verdict, strict)


def _requirement(
    run: Run, what: str, force: str | None, padding: str | None, spec: Path | None
) -> Requirement | Specification | None:
    from calib.decision import Requirement
    from calib.experiment import read_specification
    from calib.runs import asked_before, specified_before

    if what != "padding" and (force is not None or padding is not None):
        raise InputError(Fault("--force and --padding are of --for padding", advice="Say --for padding, or leave them out"))
    if what != "spec" and spec is not None:
        raise InputError(Fault("--spec is of --for spec", advice="Say --for spec, or leave it out"))
    if what == "modulus":
        return None
    if what == "spec":
        return specified_before(run) if spec is None else read_specification(spec)
    if force is None:
        if padding is not None:
            raise InputError(Fault("--padding goes with --force", advice='Give --force, e.g. "10 N", too'))
        return asked_before(run)
    return Requirement(quantity(force, "N", "--force"), *thicknesses(padding))


def _say(result: NextMeasurements) -> None:
    from rich.markup import escape

    say(result.in_words)
    if result.deciding is not None:
        _say_decisions(result)
        return
    of = "modulus" if result.asked == "modulus" else "signal"
    settled = ("extrapolation",) if result.beyond else ()
    shown = table("", "measurement", f"sd of the {of}", "less", "min", "an hour", *settled)
    for number, one in enumerate(result.ranked, 1):
        less = f"{100 * one.reduction:.0f} %" if one.tells else "nothing"
        rate = f"{100 * one.per_hour:.0f} %" if one.tells else ""
        row = (f"{number}", escape(one.what), f"±{result.relative(one.sd)}", less, f"{one.minutes:.0f}", rate)
        shown.add_row(*row, *(result.settled_in_words(one) for _ in settled))
    out().print(shown)
    now = f"Now: ±{result.relative(result.sd)}"
    say(f"{now}. Less: share of the sd that is taken away; an hour: the same for an hour in the lab.{_what_settles(result)}")


def _what_settles(result: NextMeasurements) -> str:
    """What the column on extrapolation means; "" where there is none."""
    if not result.beyond:
        return ""
    return f" Extrapolation: of what the advice goes beyond the data in ({', '.join(result.beyond)}), what it no longer would."


def _say_decisions(result: NextMeasurements) -> None:
    from rich.markup import escape

    from calib.decision import percent_of_few, shortfall_in_words

    settled = ("extrapolation",) if result.beyond else ()
    heads = ("released wrongly", "held back wrongly", "shortfall", "less", "min", "an hour")
    shown = table("", "measurement", *heads, *settled)
    for number, one in enumerate(result.ranked, 1):
        if one.decided is not None:
            most = "≤ " if one.decided.share < 1 else ""
            wrong = [f"{most}{percent_of_few(share)}" for share in (one.decided.wrong_release, one.decided.wrong_hold)]
            less = f"{100 * one.reduction:.0f} %" if one.tells else "nothing"
            rate = f"{100 * one.per_hour:.0f} %" if one.tells else ""
            short = f"{most}{shortfall_in_words(one.regret)}"
            row = (f"{number}", escape(one.what), *wrong, short, less, f"{one.minutes:.0f}", rate)
            shown.add_row(*row, *(result.settled_in_words(one) for _ in settled))
    out().print(shown)
    if result.deciding is not None:
        now = result.deciding.now
        wrong = [percent_of_few(share) for share in (now.wrong_release, now.wrong_hold)]
        said = f"Now: {wrong[0]} released wrongly, {wrong[1]} held back wrongly, shortfall {shortfall_in_words(now.regret)}"
        say(
            f"{said} of a limit. Less: share of what wrong decisions cost, both kinds weighted as the probability asked for "
            f"says; an hour: the same for an hour in the lab.{_what_settles(result)}"
        )
