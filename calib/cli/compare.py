"""The command `compare`: an experiment file, or runs of the same data, to which model predicts them better."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import BUDGET, as_given, err, loaded, not_usable, out, pasted, refusing_bad_input, say, say_average
from calib.cli.progress import progress_line
from calib.cli.stopping import when_stopped
from calib.errors import Fault, InputError, in_shell_path
from calib.regular import require_shown

if TYPE_CHECKING:
    from calib.checks import ComparedModel, Standing, Verdict
    from calib.experiment import Variant
    from calib.runs import Forecast, Watch

_COLUMNS = ("run", "model", "verdict", "elpd behind", "largest k-hat", "Young's modulus", "of the padding", "stiffening")


def compare(
    ctx: typer.Context,
    paths: Annotated[
        list[Path], typer.Argument(metavar="EXPERIMENT | RUN RUN...", help="Experiment file, or runs of the same data.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for the runs, with an experiment file.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")] = 1,
    budget: Annotated[float, typer.Option(min=0.0, help="Minutes that each calibration samples at most.")] = BUDGET,
    processes: Annotated[
        int | None, typer.Option(min=0, help="Worker processes; 0 for none [default: number of CPUs, at most 4].")
    ] = None,
) -> None:
    """Say which model of the same data predicts them better: friction, law, a padding of its own. Other data: `calib diff`.

    With an experiment file it calibrates the experiment as it is and every model that differs from it in one of these choices,
    or those that its `candidates` name, each into a run of its own in FOLDER: what one of them says with certainty another may
    contradict. The likely ones come first, by their first answers; what these rule out beyond doubt is only named.
    Runs that are finished there already are taken as they are, those that were stopped go on. In the end they are averaged into
    a run of its own, FOLDER/average, which holds what is not known of the model. With runs it compares these.

    Leaves out one block of a sweep after the other and asks how well each model predicts it from the rest (PSIS-LOO). A
    difference counts if it is above 4 and above twice its standard error.

    Examples: `calib compare experiment.toml -o models`, `calib compare run_neo run_gent run_stick`

    Writes, with an experiment file: FOLDER/comparison.json, for each model FOLDER/NAME as `calib calibrate` does, and
    FOLDER/average as `calib average` does.

    Exit codes: 0 done; 2 no usable experiment or runs there, or of different data; 3 done, but a run has not converged, its
    surrogate is off by more than it states, a block cannot be left out (k-hat), or the verdict on one of the models that
    predict best is red, and saying so; 130 stopped from the
    keyboard, 143 by SIGTERM, what was computed is kept.
    """
    given = {
        "-o": output,
        "--seed": seed if seed != 1 else None,
        "--budget": budget if budget != BUDGET else None,
        "--processes": processes,
    }
    again = pasted(["calib compare", *map(in_shell_path, paths)], given)
    with refusing_bad_input(), when_stopped(lambda: f"Stopped. Continue with: {again}"):
        if len(paths) == 1 and paths[0].suffix == ".toml":
            doubts = _rivals(ctx, paths[0], output, seed, budget, processes)
        else:
            doubts = _runs(paths, output)
        for doubt in doubts:
            err().print(f"Warning: {doubt}", style="yellow", markup=False, soft_wrap=True)
    if doubts:
        raise not_usable("all is written, but see the warnings above")


def _runs(paths: Sequence[Path], output: Path | None) -> Sequence[str]:
    """Compare runs that are there; the reasons why the comparison cannot be trusted."""
    from calib.checks import compare_runs, comparison_in_words, doubts, reservations, unusable

    if output is not None:
        raise InputError(Fault("-o is for an experiment file: runs are compared where they are", advice="Leave it out"))
    if len(paths) < 2:
        raise InputError(Fault("give at least two runs to compare, or one experiment file (.toml)"))
    runs = {str(path): loaded(path) for path in paths}
    candidates = compare_runs([(name, run.posterior, run.forward) for name, run in runs.items()])
    verdicts = {name: run.verdict for name, run in runs.items()}
    _show(candidates, verdicts)
    say(comparison_in_words(candidates))
    for reservation in reservations(candidates, verdicts):
        say(reservation)
    say(f"To average them: {pasted(['calib average', *map(in_shell_path, paths)], {'-o': Path('averaged')})}")
    return [*doubts(candidates), *unusable(candidates, verdicts)]


def _rivals(
    ctx: typer.Context, experiment: Path, output: Path | None, seed: int, budget: float, processes: int | None
) -> Sequence[str]:
    """Calibrate the models of an experiment and compare them; the reasons why the comparison cannot be trusted."""
    from calib.checks import comparison_in_words
    from calib.report import duration_in_words
    from calib.runs import STAGES, Stages, Watch, calibrate_rivals
    from calib.sampling import NothingSampled

    if output is None:
        raise InputError(Fault("the folder for the runs is missing", advice="Give it with -o"))
    require_shown(output)

    def planned(forecast: Forecast) -> None:
        """Say what is ruled out and how long the rest will take, before anything is sampled."""
        for standing in forecast.ruled_out:
            say(f"Ruled out beyond doubt, and not calibrated: {standing.in_words}.")
        for name, why in forecast.impossible.items():
            say(f"Cannot be calibrated: {name}: {why}.")
        n, most = len(forecast.names), duration_in_words(forecast.most)
        if forecast.finished:
            say(f"Finished already, taken as they are: {', '.join(forecast.finished)}.")
        if not n:
            return
        takes = "how long cannot be told"
        if forecast.seconds is not None:
            takes = f"{' to '.join(map(duration_in_words, forecast.seconds))} on this machine if nothing else runs on it"
        models = f"{n} model{'s' if n > 1 else ''} ({', '.join(forecast.names)})"
        say(f"To calibrate: {models}, one after the other; {takes}, at most {most} of sampling by --budget.")
        say("Ctrl-C keeps what is done; the same command goes on. `candidates` in the experiment file names fewer models.")

    def looking(variant: Variant, number: int, count: int) -> None:
        err().print(f"first answer of {variant.name} ({number} of {count})", markup=False)

    say("Reading; then each model is held against the data by its first answer, some seconds each, before any is calibrated.")

    @contextmanager
    def watched(variant: Variant, number: int, count: int) -> Iterator[Watch]:
        err().print(f"{variant.name} ({number} of {count})", markup=False)
        with progress_line(STAGES) as line:
            yield Watch(line.sampling, stage=line.stage)

    try:
        rivalry = calibrate_rivals(
            experiment,
            output,
            seed=seed,
            seconds=60 * budget,
            processes=processes,
            command=as_given(),
            planned=planned,
            looking=looking,
            watch=watched,
            stages=ctx.obj if ctx.obj is not None else Stages(),
        )
    except NothingSampled as nothing:
        err().print(f"{nothing} Give it a larger --budget.", style="red", markup=False, soft_wrap=True)
        raise not_usable("the budget ended before there was a result") from None
    _show(rivalry.candidates, {name: run.verdict for name, run in rivalry.runs.items()}, rivalry.ruled_out, rivalry.failed)
    say(comparison_in_words(rivalry.candidates))
    for reservation in rivalry.reservations:
        say(reservation)
    if rivalry.average is not None:
        say_average(rivalry.average)
        say(f"Their average is a run like any other: {rivalry.average.folder}")
    if rivalry.chosen.verdict.colour != "red":
        going_on = pasted(["calib recommend", in_shell_path(rivalry.chosen.folder), '--force "10 N"'], {})
        say(f"To go on, with your load in the place of 10 N: {going_on}")
    return rivalry.doubts


def _show(
    candidates: Sequence[ComparedModel],
    verdicts: Mapping[str, Verdict],
    ruled_out: Sequence[Standing] = (),
    failed: Iterable[str] = (),
) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    table = Table(*_COLUMNS, box=SIMPLE_HEAD)
    for candidate in candidates:
        name, model, *rest = candidate.row
        table.add_row(*map(escape, (name, model, verdicts[candidate.name].colour, *rest)))
    for standing in ruled_out:
        factor = f"ruled out, 1 : 10^{-standing.log_bayes / math.log(10):.0f}"
        table.add_row(*map(escape, (standing.variant.name, standing.model, "-", factor, *["-"] * 4)))
    for name in failed:
        table.add_row(escape(name), "see below", "-", "could not be made", *["-"] * 4)
    out().print(table)
