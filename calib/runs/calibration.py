"""From an experiment file to a run folder: read and check everything, sample, hold against the finite elements, write."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from calib.checks import LEAST_DRAWS, with_reweighting, with_spot_check
from calib.errors import Fault, InputError
from calib.experiment import Experiment, forward_of_experiment, read_experiment, read_sweeps
from calib.files import require_folder, write_text
from calib.problem import build_problem
from calib.records import record_from_text, record_to_text
from calib.runs.folder import RUN_RECORD, SURROGATE_FILE, Run, write_run
from calib.sampling import Posterior, Progress, sample
from calib.workers import workers

#: Seed of a run that is given none.
DEFAULT_SEED = 1

_KIND, _FORMAT = "run", 1


@dataclass(frozen=True)
class Stages:
    """The steps of a calibration, as functions; a test may put another function in the place of any of them.

    Attributes
    ----------
    sample : as `calib.sampling.sample`.
    spot_check : as `calib.checks.with_spot_check`.
    reweight : as `calib.checks.with_reweighting`.
    """

    sample: Callable[..., Posterior] = sample
    spot_check: Callable[..., Posterior] = with_spot_check
    reweight: Callable[..., Posterior] = with_reweighting


@dataclass(frozen=True)
class Watch:
    """Functions that show a user how far a calibration is.

    Each is a context: it is entered when its stage begins and left when the stage ends, and gives a function to be called with
    the progress, or None if nothing is to be shown.

    Attributes
    ----------
    sampling : gives a function of `Progress`.
    reweighting : gives a function of the draws done and their number.
    planned : no context, but a function that is told the experiment, once all input is checked and before anything is sampled.
    """

    sampling: Callable[[], AbstractContextManager[Callable[[Progress], None] | None]] = nullcontext
    reweighting: Callable[[], AbstractContextManager[Callable[[int, int], None] | None]] = nullcontext
    planned: Callable[[Experiment], None] = lambda _: None


_USUAL, _SILENT = Stages(), Watch()


@dataclass(frozen=True, eq=False)
class Calibration:
    """What `calibrate` gives back: the run, and whether the re-weighting was stopped before its end (and is not in the run)."""

    run: Run
    reweighting_stopped: bool = False


def calibrate(
    experiment: Path,
    folder: Path,
    *,
    seed: int | None = None,
    resume: bool = False,
    max_seconds: float = 600.0,
    processes: int | None = None,
    surrogate: Path | None = None,
    reweight: int = 0,
    command: str = "",
    watch: Watch = _SILENT,
    stages: Stages = _USUAL,
) -> Calibration:
    """Calibrate the sensor model on the lab files of an experiment and write all that comes of it into a folder.

    Everything is read and checked first; bad input leaves nothing behind. Interrupted while it samples, it can be continued
    with `resume`, with the same result as if it had never stopped; interrupted while it re-weights, it writes the rest.

    Parameters
    ----------
    experiment : file, see `calib.experiment.read_experiment`.
    folder : of the run; must not exist yet, unless the run in it is resumed.
    seed : of all random numbers; None for `DEFAULT_SEED`, or that of the run that is resumed.
    resume : whether to go on with a run that was stopped or has not converged.
    max_seconds : [s], of sampling at most.
    processes : worker processes; None for the number of processors, at most 4, and 0 for none.
    surrogate : file of a surrogate to use instead of the shipped one.
    reweight : draws to re-weight to the finite elements in the end; 0 for none.
    command : the command line, kept with the posterior as a record of how it was made.
    watch : shows how far the calibration is.
    stages : what is done, one after the other.

    Returns
    -------
    The run in its folder.

    Raises
    ------
    InputError
        If an input cannot be used, or a run with other inputs is to be resumed.
    """
    _check_folder(folder, resume)
    plan = read_experiment(experiment)
    sweeps = read_sweeps(plan)
    forward = forward_of_experiment(plan, surrogate)
    if reweight:
        _check_reweight(reweight, plan)
    problem = build_problem(plan, sweeps, forward)
    if not problem.parameters:
        raise InputError(Fault("every parameter is fixed: there is nothing to calibrate", plan.path))
    begun = _begun_with(folder) if resume else DEFAULT_SEED
    watch.planned(plan)
    seed = begun if seed is None else seed
    attrs = {"command": command}
    if surrogate is not None:
        attrs[SURROGATE_FILE] = str(surrogate.absolute())
    new = not folder.exists()
    folder.mkdir(exist_ok=True)
    try:
        if new:  # a run says what it is from its first second on, so that it can be resumed without its seed
            write_text(folder / RUN_RECORD, record_to_text(_KIND, _FORMAT, {"seed": seed, **attrs}))
        with watch.sampling() as progress:
            posterior = stages.sample(
                problem,
                seed=seed,
                checkpoint=folder / "checkpoint",
                resume=resume,
                max_seconds=max_seconds,
                processes=processes,
                progress=progress,
                attrs=attrs,
            )
    except InputError:
        if new:
            shutil.rmtree(folder)
        raise
    posterior = stages.spot_check(posterior, forward)
    stopped = False
    if reweight:
        try:
            with workers(processes) as executor, watch.reweighting() as told:
                posterior = stages.reweight(posterior, forward, reweight, executor, progress=told)
        except KeyboardInterrupt:
            stopped = True
    return Calibration(write_run(folder, posterior, forward), stopped)


def _check_folder(folder: Path, resume: bool) -> None:
    if resume:
        if not folder.is_dir():
            raise InputError(Fault("there is no run to resume", folder, advice="Leave --resume out to start one"))
    elif folder.exists():
        advice = "Choose another -o, or continue that run with --resume"
        raise InputError(Fault("the output folder exists and is not overwritten", folder, advice=advice))
    else:
        require_folder(folder, "Create it first")


def _check_reweight(n_draw: int, plan: Experiment) -> None:
    if plan.model == "fem":
        advice = "Leave --reweight out"
        raise InputError(Fault('model = "fem": there is nothing to re-weight to the finite elements', plan.path, advice=advice))
    if n_draw < LEAST_DRAWS:
        raise InputError(Fault(f"--reweight {n_draw} are too few draws to judge", advice=f"Give at least {LEAST_DRAWS}"))


def _begun_with(folder: Path) -> int:
    """Seed of the run that was begun in a folder."""
    try:
        return int(record_from_text(_KIND, _FORMAT, (folder / RUN_RECORD).read_text(encoding="utf-8"))["seed"])
    except (OSError, ValueError, KeyError, TypeError):
        advice = "Start the calibration anew with another -o"
        raise InputError(
            Fault("this folder was not written by `calib calibrate`: no run.json in it", folder, advice=advice)
        ) from None
