"""The command `prove`: an experiment file in, whether its calibrations hold the truth as often as they say out."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.cluster import Scheduler, executor_of
from calib.cli.common import Processes, Strict, counting, exit_by, out, refusing_bad_input, say, say_verdict, table
from calib.cli.stopping import when_stopped

if TYPE_CHECKING:
    from calib.checks import Proof

_STATUS = {
    "green": "Green: these calibrations hold the truth as often as they say.",
    "amber": "Amber: they do, but for what follows.",
    "red": "Red: these calibrations are surer than they ought to be.",
}


def prove(
    experiment: Annotated[Path, typer.Argument(help="The experiment file (TOML), see `calib init`.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the proof; one in it goes on.")],
    replicates: Annotated[int, typer.Option(min=1, help="Simulated labs, with those that are kept.")] = 500,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")] = 1,
    surrogate: Annotated[Path | None, typer.Option(help="Surrogate file to use instead of the shipped one.")] = None,
    chains: Annotated[bool, typer.Option("--chains", help="Sample every calibration by chains.")] = False,
    around: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Draw truths from the posterior of this run, not from the prior.")
    ] = None,
    processes: Processes = None,
    scheduler: Scheduler = None,
    strict: Strict = False,
) -> None:
    """Prove by simulation that calibrations of this very experiment hold the truth as often as they say.

    Each replicate draws all that is unknown from the priors, presses that sensor by finite elements as yours was pressed,
    writes the files with the noise and the faults of the instruments, reads and calibrates them, and looks where the truth
    lies. If all is well its ranks are uniform and intervals of 90 % hold it 9 times in 10.

    With --around they are drawn from the posterior of a run of the same experiment, and ranked in what the lab knows after both
    its data and the simulated ones: whether it is right for sensors like yours, rather than for all that the priors allow.

    A replicate takes some seconds of a processor: chains are sampled only where weighted draws round a mode cannot be trusted.
    With --chains they always are, ten times as long. Stop it with Ctrl-C whenever you like: the same command goes on with what
    there is, and one with more --replicates adds to it.

    Example: `calib prove experiment.toml --replicates 500 -o proof`

    Writes: replicates.jsonl, proof.json and proof.png in the folder.

    Exit codes: 0 proved (green or amber); 2 bad input; 3 red (with --strict also amber); 130 stopped from the keyboard, 143 by
    SIGTERM, what was done is kept.
    """
    with refusing_bad_input():
        from calib.report import duration_in_words
        from calib.runs import prove as make

        def planned(n: int, seconds: float) -> None:
            spread = processes or os.cpu_count() or 1
            if n and scheduler is None:
                on = "one processor" if spread == 1 else f"{spread} processors"
                say(f"{n} replicates will take about {duration_in_words(n * seconds / spread)} on {on}.")

        with (
            executor_of(processes, scheduler) as executor,
            when_stopped(lambda: f"Stopped; what was done is kept in {output}. The same command goes on."),
            counting() as told,
        ):
            proof = make(
                experiment,
                output,
                executor,
                replicates=replicates,
                seed=seed,
                surrogate=surrogate,
                chains=chains,
                around=around,
                planned=planned,
                progress=partial(told, "replicates"),
            )
        _say(proof, output)
    exit_by(proof.verdict, strict)


def _say(proof: Proof, folder: Path) -> None:
    from rich.markup import escape

    say_verdict(proof.verdict, _STATUS[proof.verdict.colour])
    shown = table("quantity", "in 90 % intervals (%)", "mean rank", "error in sd", "as far by chance (%)")
    for t in proof.tested:
        covered = f"{t.covered * 100:.0f} ({t.interval[0] * 100:.0f} to {t.interval[1] * 100:.0f})"
        shown.add_row(escape(t.name), covered, f"{t.mean_rank:.2f}", f"{t.off:.2f}", f"{t.probability * 100:.2g}")
    if proof.tested:
        out().print(shown)
    ended = ", ".join(f"{n} {outcome}" for outcome, n in proof.outcomes.items())
    say(f"{len(proof.replicates)} replicates: {ended}. Written: {folder}")
