"""Commands on a calibration: `calibrate` samples it, `recommend` asks it for a padding, `report` writes its page anew."""

from __future__ import annotations

import hashlib
import json
import shlex
import shutil
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import (
    INTERRUPTED,
    NOT_CONVERGED,
    SURROGATE_FILE,
    RunFolder,
    counting,
    err,
    load_forward,
    load_run,
    out,
    quantity,
    refusing_bad_input,
    say,
    workers,
    write_whole,
)
from calib.errors import Fault, InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from calib.decision.padding import Recommendation
    from calib.experiment.plan import Experiment
    from calib.lab.sweep import Sweep
    from calib.sampling.posterior import Posterior
    from calib.sampling.sampler import Progress
    from models.response import Forward

_DEFAULT_SEED = 1


def calibrate(
    experiment: Annotated[Path, typer.Argument(help="The experiment file (TOML), see `calib init`.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="RUN", help="Folder for the results; must not exist yet.")],
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of all random numbers [default: 1, or that of a resumed run].")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue a run that was stopped or has not converged.")] = False,
    budget: Annotated[float, typer.Option(min=0.0, help="Minutes of sampling at most, for this call.")] = 10.0,
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

    Reads and checks everything first; bad input leaves nothing behind. Then samples the posterior with four independent
    ensembles until they agree (R-hat and effective draws) or the budget is spent, and compares the surrogate with the finite
    elements at a few draws. Stop it with Ctrl-C whenever you like:
    `--resume` goes on from the last checkpoint, with the same result as if it had never stopped.

    With --reweight it also says what the finite elements themselves would make of the posterior: each of N draws is weighted by
    the ratio of the two likelihoods, and a warning tells if a parameter's mean shifts by what matters or the weights cannot be
    trusted. The draws stay those of the surrogate. Takes two to four seconds per draw, sweep and process, not counted in
    --budget.

    Example: `calib calibrate experiment.toml -o run1 --seed 7 --budget 20`

    Writes: run1/report.html (read this one), summary.json, summary.csv, posterior.nc, checkpoint/.

    Exit codes: 0 done and converged; 2 bad input, nothing written; 3 done but not converged, everything written and saying so;
    130 stopped from the keyboard.
    """
    with refusing_bad_input():
        from calib.checks.reweight import with_reweighting
        from calib.checks.spotcheck import with_spot_check
        from calib.experiment.plan import read_experiment
        from calib.problem.likelihood import build_problem
        from calib.sampling.sampler import sample
        from calib.sampling.storage import save_posterior

        _check_output(output, resume)
        plan = read_experiment(experiment)
        sweeps = _read_sweeps(plan)
        forward = load_forward(plan.model, surrogate, plan.family)
        if reweight:
            _check_reweight(reweight, plan)
        problem = build_problem(plan, sweeps, forward)
        if not problem.parameters:
            raise InputError(Fault("every parameter is fixed: there is nothing to calibrate", plan.path))
        begun = _begun(output) if resume else {}
        chosen = seed if seed is not None else int(begun.get("seed", _DEFAULT_SEED))
        new = not output.exists()
        output.mkdir(exist_ok=True)
        try:
            attrs = {"command": _command_line()}
            if surrogate is not None:
                attrs[SURROGATE_FILE] = str(surrogate.absolute())
            if new:  # a run says what it is from its first second on, so that --resume needs no seed
                write_whole(output / "run.json", json.dumps({"seed": chosen, **attrs}, indent=1) + "\n")
            with _shown_progress(budget) as progress:
                posterior = sample(
                    problem,
                    seed=chosen,
                    checkpoint=output / "checkpoint",
                    resume=resume,
                    max_seconds=60 * budget,
                    processes=processes,
                    progress=progress,
                    attrs=attrs,
                )
        except InputError:
            if new:
                shutil.rmtree(output)
            raise
        except KeyboardInterrupt:
            err().print(f"Stopped. Continue with: calib calibrate {experiment} -o {output} --resume", markup=False)
            raise typer.Exit(INTERRUPTED) from None
        posterior = with_spot_check(posterior, forward)
        stopped = False
        if reweight:
            try:
                with workers(processes) as executor, counting() as told:
                    posterior = with_reweighting(
                        posterior, forward, reweight, executor, progress=partial(told, "draws re-weighted")
                    )
            except KeyboardInterrupt:
                stopped = True
        save_posterior(posterior, output / "posterior.nc", forward)
        _write_results(output, posterior, forward)
        _say(output, posterior)
        if stopped:
            again = f"calib calibrate {experiment} -o {output} --resume --reweight {reweight}"
            err().print(f"Re-weighting was stopped; the rest is written. Do it with: {again}", markup=False)
            raise typer.Exit(INTERRUPTED)
    if not posterior.diagnostics.converged:
        raise typer.Exit(NOT_CONVERGED)


def recommend(
    run: RunFolder,
    force: Annotated[str, typer.Option(help='Force at which the signal counts, with unit, e.g. "10 N".')],
    padding: Annotated[str, typer.Option(help='Thicknesses to choose from, e.g. "0 mm:9 mm".')] = "0 mm:9 mm",
    steps: Annotated[int, typer.Option(min=3, max=1001, help="Thicknesses to try in that range.")] = 37,
    tolerance: Annotated[
        float, typer.Option(min=0.001, max=0.9, help="Loss of signal that counts as being as good as the best.")
    ] = 0.05,
    ball: Annotated[str | None, typer.Option(help="Ball radius [default: that of the experiment].")] = None,
    draws: Annotated[int, typer.Option(min=50, help="Draws of the posterior to use.")] = 400,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of draws.")] = _DEFAULT_SEED,
) -> None:
    """Recommend a padding thickness for a sensor like those measured, and say how sure that is.

    For each draw of the posterior the capacitance change at the given force is computed for every thickness. The
    recommendation is the thickness that is most probably within 5 % of the best. Thicknesses that the model does not cover are
    shown as such.

    Example: `calib recommend run1 --force "10 N" --padding "0 mm:9 mm"`

    Writes: run1/recommendation.json (SI), and run1/report.html anew with a section on padding.

    Exit codes: 0 done; 2 bad input or a request outside the model's range, nothing written; 3 done, but from a calibration that
    has not converged, and saying so.
    """
    with refusing_bad_input():
        from calib.decision.padding import Requirement, recommendation_to_json
        from calib.decision.padding import recommend as recommend_padding

        lower, upper = _range(padding)
        requirement = Requirement(
            force=quantity(force, "N", "--force"),
            lower=lower,
            upper=upper,
            n_thickness=steps,
            tolerance=tolerance,
            indenter_radius=quantity(ball, "m", "--ball") if ball is not None else None,
            n_draw=draws,
        )
        posterior, forward = load_run(run)
        recommendation = recommend_padding(
            posterior, forward, requirement, seed=seed, posterior_sha256=_sha256(run / "posterior.nc")
        )
        page = _page(run, posterior, forward, recommendation)
        write_whole(run / "recommendation.json", recommendation_to_json(recommendation))
        write_whole(run / "report.html", page)
        say(recommendation.verdict)
        for condition in recommendation.conditions:
            say(f"  holds for: {condition}")
        say(f"Written: {run / 'recommendation.json'}, {run / 'report.html'}")
    if not recommendation.converged:
        raise typer.Exit(NOT_CONVERGED)


def compare(runs: Annotated[list[Path], typer.Argument(help="Folders of two or more calibrations of the same data.")]) -> None:
    """Say which model of the same data predicts them better: neo-Hookean or Gent, frictionless or sticking.

    Leaves out one block of a sweep after the other and asks how well each model predicts it from the rest (PSIS-LOO). A
    difference counts if it is above 4 and above twice its standard error.

    Example: `calib compare run_neo run_gent run_stick`

    Exit codes: 0 done; 2 no usable runs there, or of different data; 3 done, but a run has not converged or a block cannot be
    left out (k-hat), and saying so.
    """
    with refusing_bad_input():
        from rich.box import SIMPLE_HEAD
        from rich.markup import escape
        from rich.table import Table

        from calib.checks.comparison import compare_runs, doubts, verdict

        if len(runs) < 2:
            raise InputError(Fault("give at least two runs to compare"))
        candidates = compare_runs([(str(run), load_run(run)[0]) for run in runs])
        table = Table("run", "model", "elpd behind", "largest k-hat", "Young's modulus", "stiffening", box=SIMPLE_HEAD)
        for candidate in candidates:
            table.add_row(*map(escape, candidate.row))
        out().print(table)
        say(verdict(candidates))
        why = doubts(candidates)
        for doubt in why:
            err().print(f"Warning: {doubt}", style="yellow", markup=False, soft_wrap=True)
    if why:
        raise typer.Exit(NOT_CONVERGED)


def report(run: RunFolder) -> None:
    """Write report.html of a run anew, from its posterior and, if there is one, its recommendation.

    Example: `calib report run1`

    Writes: run1/report.html, a page that needs nothing beside itself and prints well.

    Exit codes: 0 done; 2 no usable run there, nothing written; 3 done, but the calibration has not converged.
    """
    with refusing_bad_input():
        posterior, forward = load_run(run)
        write_whole(run / "report.html", _page(run, posterior, forward, _recommendation(run)))
        say(f"Written: {run / 'report.html'}")
    if not posterior.diagnostics.converged:
        raise typer.Exit(NOT_CONVERGED)


def _check_output(output: Path, resume: bool) -> None:
    if resume:
        if not output.is_dir():
            raise InputError(Fault("there is no run to resume", output, advice="Leave --resume out to start one"))
    elif output.exists():
        advice = "Choose another -o, or continue that run with --resume"
        raise InputError(Fault("the output folder exists and is not overwritten", output, advice=advice))
    elif not output.absolute().parent.is_dir():
        raise InputError(Fault(f"the folder {output.absolute().parent} does not exist", output, advice="Create it first"))


def _check_reweight(n_draw: int, plan: Experiment) -> None:
    from calib.checks.reweight import LEAST_DRAWS

    if plan.model == "fem":
        advice = "Leave --reweight out"
        raise InputError(Fault('model = "fem": there is nothing to re-weight to the finite elements', plan.path, advice=advice))
    if n_draw < LEAST_DRAWS:
        raise InputError(Fault(f"--reweight {n_draw} are too few draws to judge", advice=f"Give at least {LEAST_DRAWS}"))


def _begun(output: Path) -> dict[str, str]:
    try:
        found = json.loads((output / "run.json").read_text(encoding="utf-8"))
        return {k: str(v) for k, v in found.items()}
    except (OSError, ValueError, AttributeError):
        advice = "Start the calibration anew with another -o"
        raise InputError(
            Fault("this folder was not written by `calib calibrate`: no run.json in it", output, advice=advice)
        ) from None


# Share of a prior that is looked at when a file is judged before there is a posterior.
_CERTAIN = 0.99


def _read_sweeps(experiment: Experiment) -> tuple[Sweep, ...]:
    from calib.lab.sweep import make_sweep
    from calib.priors.prior import default_prior

    sweeps: list[Sweep] = []
    faults: list[Fault] = []
    compliance = experiment.priors.get("machine_compliance", default_prior("machine_compliance"))
    for specimen in experiment.specimens:
        clock = specimen.priors.get("clock_offset")
        for files in specimen.sweeps:
            try:
                sweeps.append(
                    make_sweep(
                        specimen.name,
                        files.name,
                        files.indenter_radius,
                        files.force,
                        files.capacitance,
                        force_reading=files.force_reading,
                        capacitance_reading=files.capacitance_reading,
                        cycle=files.cycle,
                        capacitance_cycle=files.capacitance_cycle,
                        clock_range=None if clock is None else clock.interval(_CERTAIN),
                        machine_compliance=compliance.interval(_CERTAIN)[1],
                    )
                )
            except InputError as error:
                faults += error.faults
    if faults:
        raise InputError(faults)
    return tuple(sweeps)


class _shown_progress:
    """Progress of sampling on stderr, if that is a terminal."""

    def __init__(self, budget: float) -> None:
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        console = err()
        self._bar = Bar(
            TextColumn("sampling"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.description}"),
            console=console,
            transient=True,
        )
        self._bar.disable = not console.is_terminal
        self._task = self._bar.add_task("looking for the mode ...", total=max(60 * budget, 1e-9))

    def __enter__(self) -> Callable[[Progress], None]:
        self._bar.start()
        return self._update

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def _update(self, p: Progress) -> None:
        words = f"{p.steps} steps"
        if p.ess > 0:
            words += f", R-hat {p.r_hat:.3f} ({p.r_hat_parameter})"
            words += f", effective draws {p.ess:.0f} of {p.target:.0f} ({p.ess_parameter})"
        self._bar.update(self._task, completed=p.elapsed, description=words)


def _recommendation(run: Path) -> Recommendation | None:
    from calib.decision.padding import recommendation_from_json

    path = run / "recommendation.json"
    return recommendation_from_json(path.read_text(encoding="utf-8"), path) if path.is_file() else None


def _page(run: Path, posterior: Posterior, forward: Forward, recommendation: Recommendation | None) -> str:
    import numpy as np

    from calib.checks.predictive import predict
    from calib.report.page import write_report

    predictions = predict(posterior, forward, np.random.default_rng(posterior.seed))
    return write_report(posterior, predictions, recommendation, posterior_sha256=_sha256(run / "posterior.nc"))


def _write_results(run: Path, posterior: Posterior, forward: Forward) -> None:
    from calib.report.summary import summary_csv, summary_json

    write_whole(run / "summary.json", summary_json(posterior))
    write_whole(run / "summary.csv", summary_csv(posterior))
    write_whole(run / "report.html", _page(run, posterior, forward, _recommendation(run)))


def _say(run: Path, posterior: Posterior) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    from calib.report.page import AGAINST_PRIOR_WORDS, PRIOR_DRIVEN_WORDS, parameter_rows

    shown = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("parameter", "posterior", "90 % interval", "learned"):
        shown.add_column(heading, overflow="fold")
    for row in parameter_rows(posterior):
        told = row.verdict in (PRIOR_DRIVEN_WORDS, AGAINST_PRIOR_WORDS)
        learned = row.verdict if told else f"{max(row.contraction, 0.0) * 100:.0f} %"
        shown.add_row(escape(row.name), f"{row.value} {row.unit}", row.interval, learned)
    console = out()
    console.print(shown)
    d = posterior.diagnostics
    if d.converged:
        console.print("Converged.", style="green")
    else:
        console.print("NOT converged: the numbers are preliminary.", style="yellow")
        for reason in d.reasons:
            say(f"  {reason}")
        if d.spot_check is None or d.spot_check.passed or len(d.reasons) > 1:
            console.print("Continue with --resume and a larger --budget.")
        else:
            console.print('Train a surrogate (`calib surrogate train`) or calibrate with model = "fem".', markup=False)
    if d.spot_check is not None and d.spot_check.stated and d.spot_check.passed:
        say(f"Spot check: {d.spot_check.in_words(posterior.forward_name)}.")
    if d.reweighting is not None and d.reweighting.passed:
        say(f"Re-weighting: {d.reweighting.in_words()}.")
    for warning in d.warnings:
        console.print(f"Warning: {warning}", style="yellow", markup=False, soft_wrap=True)
    say(f"Report: {run / 'report.html'}")


def _range(text: str) -> tuple[float, float]:
    parts = text.split(":")
    if len(parts) != 2:
        raise InputError(Fault(f'--padding: "{text}" is not a range', advice='Write it as "0 mm:9 mm"'))
    lower, upper = (quantity(part, "m", "--padding") for part in parts)
    return lower, upper


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _command_line() -> str:
    return shlex.join(["calib", *sys.argv[1:]])
