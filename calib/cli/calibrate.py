"""The command `calibrate`: an experiment file to a run folder, with progress, and what came of it on the screen."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import NOT_USABLE, counting, err, out, paging, refusing_bad_input, say
from calib.cli.stopping import when_stopped
from calib.errors import in_shell_path
from calib.regular import require_shown

if TYPE_CHECKING:
    from calib.experiment import Experiment
    from calib.runs import Run
    from calib.sampling import Progress


#: Minutes that a calibration may take if nothing else is said.
BUDGET = 10.0


def calibrate(
    ctx: typer.Context,
    experiment: Annotated[Path, typer.Argument(help="The experiment file (TOML), see `calib init`.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="RUN", help="Folder for the results; must not exist yet.")],
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
) -> None:
    """Calibrate the sensor model on the lab files of an experiment.

    Reads and checks everything first; bad input leaves nothing behind. Lines of the experiment file that are still marked EDIT
    and hold what `calib init` put there are named, here and in the report: the result rests on them.

    Then samples the posterior with four independent ensembles until they agree (R-hat and effective draws) or the budget is
    spent, and compares the surrogate with the finite elements at a few draws. The budget counts from the start of the command,
    reading and the search for the start of each ensemble included; what comes after sampling is not in it. Stop the command
    with Ctrl-C whenever you like: `--resume` goes on from the last checkpoint, with the same result as if it had never stopped.

    With --reweight it also says what the finite elements themselves would make of the posterior: each of N draws is weighted by
    the ratio of the two likelihoods, and a warning tells if a parameter's mean shifts by what matters or the weights cannot be
    trusted. The draws stay those of the surrogate. Takes two to four seconds per draw, sweep and process, not counted in
    --budget.

    Example: `calib calibrate experiment.toml -o run1 --seed 7 --budget 20`

    Writes: run1/report.html (read this one), summary.json, summary.csv, posterior.nc, checkpoint/.

    Exit codes: 0 done and usable; 1 all results written, but not the page that shows them; 2 bad input, nothing written; 3
    everything written, but the numbers must not be used, and saying why: the chains have not converged (go on with --resume),
    or the surrogate is off the finite elements by more than it states (refine it or use model = "fem"; more sampling cannot
    help), or the budget ended before there was a draw (the checkpoint is kept: go on with --resume); 130 stopped from the
    keyboard, 143 by SIGTERM, the checkpoint kept.
    """
    deadline = time.monotonic() + 60 * budget
    told = shlex.join(["calib", *sys.argv[1:]])
    given = {
        "--seed": seed,
        "--budget": budget if budget != BUDGET else None,
        "--processes": processes,
        "--surrogate": surrogate,
    }
    again = _resuming(experiment, output, {**given, "--reweight": reweight or None})

    def stopped() -> str:
        return f"Stopped. Continue with: {again}" if output.exists() else "Stopped before anything was begun."

    with refusing_bad_input(), when_stopped(stopped):
        from calib.runs import Stages, Watch
        from calib.runs import calibrate as run_calibration
        from calib.sampling import NothingSampled

        for path in (output, *([surrogate] if surrogate is not None else [])):
            require_shown(path)
        stages = ctx.obj if ctx.obj is not None else Stages()
        try:
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
                watch=Watch(partial(_sampling, budget), partial(_reweighting, again), _planned),
                stages=stages,
            )
        except NothingSampled as nothing:
            more = _resuming(experiment, output, {**given, "--budget": BUDGET, "--reweight": reweight or None})
            err().print(f"{nothing} Continue with: {more}", style="red", markup=False, soft_wrap=True)
            raise typer.Exit(NOT_USABLE) from None
        posterior = done.run.posterior
        _say(output, done.run)
        if done.page_error is not None:
            with paging():
                raise done.page_error
    if not posterior.diagnostics.usable:
        raise typer.Exit(NOT_USABLE)


def _resuming(experiment: Path, output: Path, options: Mapping[str, Path | float | None]) -> str:
    """The command that goes on with a run, to be pasted: with the options that it was begun with and that are not None."""
    words = ["calib calibrate", in_shell_path(experiment), "-o", in_shell_path(output), "--resume"]
    for name, value in options.items():
        if value is not None:
            words += [name, in_shell_path(value) if isinstance(value, Path) else f"{value:g}"]
    return " ".join(words)


def _planned(experiment: Experiment) -> None:
    """Say which lines of the experiment file still hold a guess of `calib init`: the result rests on them."""
    from calib.experiment import unedited_in_words

    said = unedited_in_words(experiment.unedited)
    if said:
        out().print(f"Warning: {said}", style="yellow", markup=False, soft_wrap=True)


@contextmanager
def _sampling(budget: float) -> Iterator[Callable[[Progress], None]]:
    """Progress of sampling for `budget` minutes on stderr, if that is a terminal."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = err()
    columns = (TextColumn("sampling"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("looking for the mode ...", total=max(60 * budget, 1e-9))

        def told(p: Progress) -> None:
            words = f"{p.steps} steps"
            if p.ess > 0:
                words += f", R-hat {p.r_hat:.3f} ({p.r_hat_parameter})"
                words += f", effective draws {p.ess:.0f} of {p.target:.0f} ({p.ess_parameter})"
            bar.update(task, completed=p.elapsed, description=words)

        yield told


@contextmanager
def _reweighting(again: str) -> Iterator[Callable[[int, int], None]]:
    """Progress of the re-weighting; if it is stopped, the command `again` does it, and all else is written."""
    words = f"Re-weighting was stopped; all else is written. Do it with: {again}"
    with when_stopped(lambda: words), counting() as told:
        yield partial(told, "draws re-weighted")


def _say(folder: Path, run: Run) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    from calib.report import judge_run, listed, parameter_rows

    posterior = run.posterior
    shown = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("parameter", "posterior", "90 % interval", "learned"):
        shown.add_column(heading, overflow="fold")
    for row in parameter_rows(posterior):
        learned = row.learned if row.doubtful else f"{max(row.contraction, 0.0) * 100:.0f} %"
        shown.add_row(escape(row.name), f"{row.value} {row.unit}", row.interval, learned)
    console = out()
    console.print(shown)
    d, judged = posterior.diagnostics, judge_run(posterior, run.predictions)
    if judged.good:
        console.print("Converged.", style="green")
    elif d.usable:
        console.print(judged.status, style="yellow", soft_wrap=True)
    elif d.converged:
        off = f"Converged, but the {posterior.forward_name} is off the finite elements by more than it states"
        console.print(f"{off}: the numbers are preliminary.", style="yellow")
    else:
        console.print("NOT converged: the numbers are preliminary.", style="yellow")
    for reason in d.reasons_against_use:
        say(f"  {reason}")
    if judged.misfits:
        say(f"  The model does not describe {listed(judged.misfits)} within what it claims.")
    if judged.bad_data:
        say(f"  Quality of the lab data, {judged.bad_data} What a bad file does is not in the uncertainties.")
    if not d.converged:
        console.print("Continue with --resume and a larger --budget.")
    if d.surrogate_honest is False:
        advice = 'calibrate with a better surrogate (`calib surrogate refine`, `calib surrogate train`) or with model = "fem"'
        say(f"More sampling cannot mend the model: {advice}.")
    if d.spot_check is not None and d.surrogate_honest:
        say(f"Spot check: {d.spot_check.in_words()}.")
    if d.reweighting is not None and d.reweighting.passed:
        say(f"Re-weighting: {d.reweighting.in_words()}.")
    for warning in d.warnings:
        console.print(f"Warning: {warning}", style="yellow", markup=False, soft_wrap=True)
    if run.report.exists():
        say(f"Report: {run.report}")
