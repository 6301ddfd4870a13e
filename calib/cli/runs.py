"""Commands on finished runs: `recommend` a padding, write the `report` anew."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from calib.cli.common import (
    RunFolder,
    Strict,
    as_given,
    exit_by,
    loaded,
    paging,
    quantity,
    refusing_bad_input,
    say,
    say_verdict,
    thicknesses,
)
from calib.errors import Fault, InputError
from calib.files import require_writable


def recommend(
    run: RunFolder,
    force: Annotated[str | None, typer.Option(help='Force at which the signal counts, with unit, e.g. "10 N".')] = None,
    padding: Annotated[str | None, typer.Option(help='Thicknesses to choose from [default: "0 mm:9 mm"].')] = None,
    spec: Annotated[
        Path | None, typer.Option(help="Specification file, instead of --force: loads, limits, tolerances, paddings.")
    ] = None,
    steps: Annotated[int | None, typer.Option(min=3, max=1001, help="Thicknesses to try in that range [default: 91].")] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(min=0.001, max=0.9, help="Loss of signal that counts as being as good as the best [default: 0.05]."),
    ] = None,
    ball: Annotated[str | None, typer.Option(help="Ball radius [default: that of the experiment].")] = None,
    draws: Annotated[
        int | None, typer.Option(min=50, help="Draws of the posterior to use [default: 400; of a specification 1000].")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of draws.")] = 1,
    strict: Strict = False,
) -> None:
    """Recommend a padding thickness for a sensor like those measured, or the next one of their lot, and say how sure that is.

    For the next one, which nobody has measured, where the experiment has pooling = "partial".

    For each draw of the posterior the capacitance change at the given force is computed for every thickness. The
    recommendation is the thickness that is most probably within 5 % of the best. Thicknesses that the model does not cover are
    shown as such.

    With --spec it says how probably a sensor on padding of each thickness meets a specification, which to build, with which
    tolerance on the drawing, which limit binds and what the doubt comes from. `calib schema specification` describes the file.

    Example: `calib recommend run1 --force "10 N" --padding "0 mm:9 mm"`, `calib recommend run1 --spec spec.toml`

    Writes: run1/recommendation.json (SI), and run1/report.html anew with a section on padding; of a specification
    run1/specification.csv, too.

    The verdict is that of the calibration, and amber at best where the request goes beyond what was measured.

    Exit codes: 0 done, the verdict green or amber; 1 the page could not be made, and saying why; 2 bad input or a request
    outside the model's range, nothing written; 3 done, but the verdict is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.checks import Verdict
        from calib.decision import Requirement
        from calib.experiment import Specification, read_specification
        from calib.report import status_in_words
        from calib.runs import load_recommendation, recommend_in

        wanted: Requirement | Specification
        if spec is not None:
            options = {"--force": force, "--padding": padding, "--steps": steps, "--tolerance": tolerance, "--ball": ball}
            if given := [name for name, value in options.items() if value is not None]:
                said = f"{', '.join(given)} beside --spec: the specification says it"
                raise InputError(Fault(said, advice=f"Leave {', '.join(given)} out, or put it into {spec}"))
            wanted = read_specification(spec, draws or 1000)
        elif force is None:
            advice = 'Give --force "10 N" for the largest signal, or --spec spec.toml for what a specification asks for'
            raise InputError(Fault("nothing says what the padding is for", advice=advice))
        else:
            lower, upper = thicknesses(padding)
            wanted = Requirement(
                force=quantity(force, "N", "--force"),
                lower=lower,
                upper=upper,
                n_thickness=steps or 91,
                tolerance=tolerance or 0.05,
                indenter_radius=quantity(ball, "m", "--ball") if ball is not None else None,
                n_draw=draws or 400,
            )
        found = loaded(run)
        require_writable(run / "recommendation.json")
        earlier = None
        with suppress(InputError):  # a damaged one is written anew
            earlier = load_recommendation(run)
        with paging():
            recommendation = recommend_in(found, wanted, seed=seed, command=as_given())
        conformity = recommendation.conformity
        say(recommendation.in_words if conformity is None else conformity.in_words)
        if earlier is not None and earlier.asked_in_words != recommendation.asked_in_words:
            was = "which was red" if earlier.verdict.colour == "red" else earlier.advised_in_words
            say(f"It takes the place of the advice for {earlier.asked_in_words} that was in {run} ({was}).")
        status, void = status_in_words(recommendation.verdict, "the advice"), recommendation.verdict.colour == "red"
        reasons = [r for r in recommendation.verdict.reasons if r.level == "red" or not void]
        say_verdict(Verdict(tuple(reasons)), status)
        if not void:  # of what is no advice there is no more to say
            for left_out in () if conformity is None else conformity.unserved_in_words:
                say(f"  left out: {left_out}")
            for model in recommendation.open_models:
                say(f"  not ruled out by these data: {model}")
            for condition in recommendation.conditions if conformity is None else conformity.conditions:
                say(f"  holds for: {condition}")
        names = ("recommendation.json", *(("specification.csv",) if conformity is not None else ()), "report.html")
        say(f"Written: {', '.join(str(run / name) for name in names)}")
    exit_by(recommendation.verdict, strict)


def report(
    run: RunFolder,
    pdf: Annotated[bool, typer.Option("--pdf", help="Print it, too, as report.pdf, by a browser on this machine.")] = False,
    strict: Strict = False,
) -> None:
    """Write report.html of a run anew, from its posterior and, if there is one, its recommendation.

    Says, here and on the page, which files the run was made from have changed since.

    With --pdf, Chromium, Chrome or Edge prints it, A4, as it would from its own menu, out of sight and without your profile.

    Example: `calib report run1 --pdf`

    Writes: run1/report.html, a page that needs nothing beside itself and prints well; summary.json and summary.csv anew; with
    --pdf run1/report.pdf. A print of an earlier page is removed.

    Exit codes: 0 done, the verdict green or amber; 1 the page could not be made or printed, and saying why; 2 no usable run
    there, or no browser for --pdf, nothing written; 3 done, but the verdict on the calibration is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.report import BROWSERS, find_browser, status_in_words
        from calib.runs import report_in

        browser = find_browser() if pdf else None
        if pdf and browser is None:
            advice = "Install one of them, or open report.html in any browser and print it from there: that gives the same"
            raise InputError(Fault(f"--pdf needs a browser, and none was found of {', '.join(BROWSERS)}", advice=advice))
        found = loaded(run)
        require_writable(found.report)
        with paging():
            report_in(found, browser, command=as_given())
        say_verdict(found.verdict, status_in_words(found.verdict))
        say(f"Written: {', '.join(str(path) for path in (found.report, *([found.printed] if pdf else [])))}")
    exit_by(found.verdict, strict)
