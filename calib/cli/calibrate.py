"""The command `calibrate`: an experiment file to a run folder, with progress, and what came of it on the screen."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import (
    BUDGET,
    Strict,
    as_given,
    counting,
    err,
    exit_by,
    not_usable,
    out,
    paging,
    pasted,
    refusing_bad_input,
    say,
    say_verdict,
    table,
    telling,
)
from calib.cli.progress import Line, first_answer_lines, progress_line
from calib.cli.stopping import when_stopped
from calib.errors import Fault, InputError, in_shell_path
from calib.regular import require_shown

if TYPE_CHECKING:
    from calib.experiment import Experiment
    from calib.runs import Run


def calibrate(
    ctx: typer.Context,
    experiment: Annotated[Path, typer.Argument(help="The experiment file (TOML), see `calib init`.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="RUN", help="Folder for the results; must not exist yet.")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Show a first answer, in a second or two, and end: nothing is sampled or written.")
    ] = False,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of all random numbers [default: 1, or that of a resumed run].")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue a run that was stopped or has not converged.")] = False,
    budget: Annotated[float, typer.Option(min=0.0, help="Minutes until sampling ends at most, of this call.")] = BUDGET,
    processes: Annotated[
        int | None, typer.Option(min=0, help="Worker processes; 0 for none [default: number of CPUs, at most 4].")
    ] = None,
    surrogate: Annotated[Path | None, typer.Option(help="Surrogate file to use instead of the shipped one.")] = None,
    reweight: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Draws to re-weight to the finite elements in the end, say 200; 0 for none."),
    ] = 0,
    strict: Strict = False,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Calibrate what `calib check` finds red, too; the verdict stays red.")
    ] = False,
) -> None:
    """Calibrate the sensor model on the lab files of an experiment.

    Reads and checks everything first; bad input leaves nothing behind. Lines of the experiment file that are still marked EDIT
    and hold what `calib init` put there are named, here and in the report: the result rests on them.

    Files, geometry and priors are then checked against each other, as `calib check` does: what is red stops the command before
    anything is written, unless --anyway is given.

    Then samples the posterior with four independent ensembles until they agree (R-hat and effective draws) or the budget is
    spent, and compares the surrogate with the finite elements at a few draws. The budget counts from the start of the command,
    reading and the search for the start of each ensemble included; what comes after sampling is not in it. Stop the command
    with Ctrl-C whenever you like: `--resume` goes on from the last checkpoint, with the same result as if it had never stopped.

    With --reweight it also says what the finite elements themselves would make of the posterior: each of N draws is weighted by
    the ratio of the two likelihoods, and a warning tells if a parameter's mean shifts by what matters or the weights cannot be
    trusted. The draws stay those of the surrogate. Takes two to four seconds per draw, sweep and process, not counted in
    --budget.

    Before it samples, it shows a first answer: means and standard deviations from one mode of the posterior, in a second. In
    the end it says where the result differs. `calib calibrate experiment.toml --quick` shows the first answer alone, to try an
    experiment file; it is not the result, and nothing is written.

    Example: `calib calibrate experiment.toml -o run1 --seed 7 --budget 20`

    Writes: run1/report.html (read this one), summary.json, summary.csv, posterior.nc, checkpoint/.

    What came of it is summed up in a verdict: green, amber (the numbers may be used to plan and to try; for anything
    that is signed or released, first settle each reason given or accept it knowingly) or red (they must not be used), with
    what to do about each reason.

    Exit codes: 0 done, the verdict green or amber; 1 all results written, but not the page or the words that show them; 2 bad
    input, nothing written; 3 everything written, but the verdict is red, or with --strict amber, or the budget ended before
    there was a draw (the checkpoint is kept: go on with --resume); 130 stopped from the keyboard, 143 by SIGTERM, the
    checkpoint kept.
    """
    deadline = time.monotonic() + 60 * budget
    told = as_given()
    if quick:
        given = {
            "-o": output,
            "--seed": seed,
            "--resume": resume or None,
            "--budget": budget if budget != BUDGET else None,
            "--processes": processes,
            "--reweight": reweight or None,
            "--anyway": anyway or None,
        }
        _quick(experiment, surrogate, [name for name, value in given.items() if value is not None])
        return
    if output is None:
        raise typer.BadParameter("the folder for the results is missing (--quick does without)", param_hint="-o")
    given = {
        "--seed": seed,
        "--budget": budget if budget != BUDGET else None,
        "--processes": processes,
        "--surrogate": surrogate,
        "--reweight": reweight or None,
    }
    again = _resuming(experiment, output, given)

    def stopped() -> str:
        return f"Stopped. Continue with: {again}" if output.exists() else "Stopped before anything was begun."

    with refusing_bad_input(), when_stopped(stopped):
        from calib.runs import STAGES, Stages, Watch
        from calib.runs import calibrate as run_calibration
        from calib.sampling import NothingSampled

        for path in (output, *([surrogate] if surrogate is not None else [])):
            require_shown(path)
        stages = ctx.obj if ctx.obj is not None else Stages()
        try:
            with progress_line(STAGES) as line:
                watch = Watch(line.sampling, partial(_reweighting, again, line), _planned, line.stage, line.first_answer)
                done = run_calibration(
                    experiment,
                    output,
                    seed=seed,
                    resume=resume,
                    deadline=deadline,
                    processes=processes,
                    surrogate=surrogate,
                    reweight=reweight,
                    command=told,
                    watch=watch,
                    stages=stages,
                    anyway=anyway,
                )
        except NothingSampled as nothing:
            more = _resuming(experiment, output, {**given, "--budget": BUDGET})
            err().print(f"{nothing} Continue with: {more}", style="red", markup=False, soft_wrap=True)
            raise not_usable("the budget ended before there was a result") from None
        with telling(output):
            _say(output, done.run)
            if not done.run.posterior.diagnostics.converged:
                longer = _resuming(experiment, output, {**given, "--budget": 3 * max(budget, BUDGET)})
                say(f"Continue with: {longer}")
        if done.page_error is not None:
            with paging():
                raise done.page_error
    exit_by(done.run.verdict, strict)


def _resuming(experiment: Path, output: Path, options: Mapping[str, Path | float | None]) -> str:
    """The command that goes on with a run, to be pasted, with the options that it was begun with."""
    return pasted(["calib calibrate", in_shell_path(experiment), "-o", in_shell_path(output), "--resume"], options)


def _quick(experiment: Path, surrogate: Path | None, refused: list[str]) -> None:
    """Show a first answer and nothing else; options that are for sampling are refused."""
    with refusing_bad_input(), when_stopped(lambda: "Stopped. Nothing was begun."):
        from calib.runs import quick

        if refused:
            advice = "Leave it out, or leave --quick out to calibrate"
            raise InputError(
                Fault(f"--quick samples and writes nothing: it takes no {' and no '.join(refused)}", advice=advice)
            )
        if surrogate is not None:
            require_shown(surrogate)
        first = quick(experiment, surrogate, _planned)
        say("First answer, not the result: estimated from one mode of the posterior, nothing sampled, nothing checked.")
        for text in first_answer_lines(first):
            say(text)
        if first.rough:
            once = "" if first.confirmed else ", and on a mode that only one climb has reached, which may be a false one"
            say(f"It is rough: it rests on {first.effective_draws:.0f} effective draws{once}.")
        say(f"For the result: calib calibrate {in_shell_path(experiment)} -o RUN")


def _planned(experiment: Experiment) -> None:
    """Say which lines of the experiment file still hold a guess of `calib init`: the result rests on them."""
    from calib.experiment import unedited_in_words

    said = unedited_in_words(experiment.unedited)
    if said:
        out().print(f"Warning: {said}", style="yellow", markup=False, soft_wrap=True)


@contextmanager
def _reweighting(again: str, line: Line) -> Iterator[Callable[[int, int], None]]:
    """Progress of the re-weighting in the place of `line`; if stopped, the command `again` does it, and all else is written."""
    line.bar.stop()
    words = f"Re-weighting was stopped; all else is written. Do it with: {again}"
    with when_stopped(lambda: words), counting() as told:
        yield partial(told, "draws re-weighted")


def _say(folder: Path, run: Run) -> None:
    from rich.markup import escape

    from calib.report import parameter_rows, status_in_words, taken_as_exact

    posterior = run.posterior
    void = run.verdict.colour == "red"
    shown = table("parameter", "no result: of the draws" if void else "posterior", "90 % interval", "learned")
    for row in parameter_rows(posterior):
        learned = row.learned if row.doubtful else f"{max(row.contraction, 0.0) * 100:.0f} %"
        cells = (f"{row.value} {row.unit}", row.interval, learned)
        shown.add_row(escape(row.name), *(f"[dim strike]{cell}[/]" if void else cell for cell in cells))
    out().print(shown)
    d = posterior.diagnostics
    say_verdict(run.verdict, status_in_words(run.verdict))
    if d.spot_check is not None and d.surrogate_honest:
        say(f"Spot check: {d.spot_check.in_words()}.")
    if d.reweighting is not None and d.reweighting.passed:
        say(f"Re-weighting: {d.reweighting.in_words()}.")
    if d.first_answer is not None:
        say(d.first_answer_in_words)
    for condition in [] if void else taken_as_exact(posterior):
        say(f"Holds for {condition}.")
    if run.report.exists():
        say(f"Report: {run.report}")
