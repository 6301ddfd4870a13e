"""From an experiment file to a run folder: read and check everything, sample, hold against the finite elements, write."""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from calib.checks import (
    BEFORE_SAMPLING,
    LEAST_DRAWS,
    UNSEEN,
    Elsewhere,
    Plausibility,
    look_elsewhere,
    reasons_to_text,
    unseen_to_text,
    with_blocks_foretold,
    with_elsewhere,
    with_reweighting,
    with_sensitivity,
    with_spot_check,
)
from calib.decision import Recommendation
from calib.errors import Fault, InputError, in_shell_path
from calib.experiment import Experiment, Variant, read_experiment
from calib.files import require_folder, whole_file
from calib.problem import Problem
from calib.runs.before import kept_reasons, plausibility_of, require_plausible
from calib.runs.folder import Run
from calib.runs.listing import (
    CHECKPOINT,
    EXPERIMENT,
    LISTING,
    MEMBERS,
    Listing,
    inputs_of,
    read_listing,
    with_command,
    write_listing,
)
from calib.runs.members import SURROGATE_FILE
from calib.runs.ownership import is_bare, owned, owner_of
from calib.runs.page import PageError, page_of
from calib.runs.preview import first_answer_of, problem_of
from calib.runs.progress import Teller, telling
from calib.runs.written import write_run
from calib.sampling import (
    FirstAnswer,
    Identity,
    Posterior,
    Progress,
    differences,
    identity_of,
    is_begun,
    kept_identity,
    sample,
)
from calib.workers import Crew, workers

#: Seed of a run that is given none.
DEFAULT_SEED = 1

#: How long a calibration that is given no deadline reads and samples at most [s].
DEFAULT_SECONDS = 600.0


#: What a calibration does, one after the other, as `Watch` is told it; the fourth to sixth by `Progress.stage`.
STAGES = (
    "reading",
    "first answer",
    "other models",
    "start",
    "sampling",
    "block likelihoods",
    "left-out data",
    "spot check",
    "report",
)


@dataclass(frozen=True)
class Stages:
    """The steps of a calibration, as functions; a test may put another function in the place of any of them.

    Attributes
    ----------
    sample : as `calib.sampling.sample`.
    spot_check : as `calib.checks.with_spot_check`.
    reweight : as `calib.checks.with_reweighting`.
    page : as `calib.runs.page.page_of`.
    look_elsewhere : as `calib.checks.look_elsewhere`.
    foretell_blocks : as `calib.checks.with_blocks_foretold`.
    check : as `calib.runs.before.plausibility_of`.
    """

    sample: Callable[..., Posterior] = sample
    spot_check: Callable[..., Posterior] = with_spot_check
    reweight: Callable[..., Posterior] = with_reweighting
    page: Callable[[Run, Recommendation | None], str] = page_of
    look_elsewhere: Callable[..., Elsewhere] = look_elsewhere
    foretell_blocks: Callable[..., Posterior] = with_blocks_foretold
    check: Callable[[Problem], Plausibility | None] = plausibility_of


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
    stage : likewise told which of `STAGES` begins; those of sampling are told by its progress.
    first_answer : likewise told the first answer, before anything is sampled; None if there is none.
    """

    sampling: Callable[[], AbstractContextManager[Callable[[Progress], None] | None]] = nullcontext
    reweighting: Callable[[], AbstractContextManager[Callable[[int, int], None] | None]] = nullcontext
    planned: Callable[[Experiment], None] = lambda _: None
    stage: Callable[[str], None] = lambda _: None
    first_answer: Callable[[FirstAnswer | None], None] = lambda _: None


_USUAL, _SILENT = Stages(), Watch()


@dataclass(frozen=True, eq=False)
class Calibration:
    """What `calibrate` gives back.

    Attributes
    ----------
    run : in its folder.
    page_error : why the report could not be written; None if it was.
    """

    run: Run
    page_error: PageError | None = None


def calibrate(
    experiment: Path | str,
    folder: Path | str,
    *,
    seed: int | None = None,
    resume: bool = False,
    deadline: float | None = None,
    processes: int | None = None,
    surrogate: Path | str | None = None,
    reweight: int = 0,
    command: str = "",
    watch: Watch = _SILENT,
    stages: Stages = _USUAL,
    variant: Variant | None = None,
    anyway: bool = False,
) -> Calibration:
    """Calibrate the sensor model on the lab files of an experiment and write all that comes of it into a folder.

    Everything is read and checked first; bad input leaves nothing behind. Interrupted while it samples, it can be continued
    with `resume`, with the same result as if it had never stopped. What is found is written before it is re-weighted, and again
    after that: interrupted in between, the run is finished but for its re-weighting.

    Parameters
    ----------
    experiment : file, see `calib.experiment.read_experiment`.
    folder : of the run; must be empty or not exist yet, unless the run in it is resumed.
    seed : of all random numbers; None for `DEFAULT_SEED`, or that of the run that is resumed.
    resume : whether to go on with a run that was stopped or has not converged.
    deadline : moment of `time.monotonic` at which sampling ends, however long reading takes; None for ten minutes from now.
    processes : worker processes; None for the number of processors, at most 4, and 0 for none.
    surrogate : file of a surrogate to use instead of the shipped one.
    reweight : draws to re-weight to the finite elements in the end; 0 for none.
    command : the command line, kept with the posterior as a record of how it was made.
    watch : shows how far the calibration is.
    stages : what is done, one after the other.
    variant : which choice of the experiment is made otherwise, see `calib.experiment.variants_of`; None for none.
    anyway : whether to sample what is implausible, see `calib.check`; the reasons stay in the verdict of the run.

    Returns
    -------
    The run in its folder.

    Raises
    ------
    InputError
        If an input cannot be used, files or priors are implausible, a run with other inputs is to be resumed, or another
        process writes into the folder.
    """
    experiment, folder, surrogate = Path(experiment), Path(folder), Path(surrogate) if surrogate is not None else None
    deadline = time.monotonic() + DEFAULT_SECONDS if deadline is None else deadline
    if said := owner_of(folder):
        advice = "Wait until it has ended, or choose another folder"
        raise InputError(Fault(f"this folder is in use by {said}", folder, advice=advice))
    _check_folder(folder, resume)
    watch.stage("reading")
    plan = read_experiment(experiment)
    plan = plan if variant is None else variant.of(plan)
    if reweight:
        _check_reweight(reweight, plan)
    crew = Crew(0 if processes == 0 else min(4, processes or os.cpu_count() or 1))
    with crew:
        spread = stages.sample is sample  # over workers, who get ready while files are read
        if spread:
            crew.load("calib.sampling.sampler")
            stages = replace(stages, sample=partial(sample, crew=crew))
            if stages.spot_check is with_spot_check:
                stages = replace(stages, spot_check=partial(with_spot_check, executor=crew))
        drawing = crew if spread and crew.processes else None
        problem = problem_of(plan, surrogate)
        sweeps, forward = problem.sweeps, problem.forward
        watch.planned(plan)
        watch.stage("first answer")
        plausible = stages.check(problem)
        if not (anyway or resume):
            require_plausible(plausible, plan.path)
        attrs = {"command": command}
        if before := kept_reasons(plausible):
            attrs[BEFORE_SAMPLING] = reasons_to_text(before)
        if plausible is not None and plausible.outlook is not None and plausible.outlook.unseen:
            attrs[UNSEEN] = unseen_to_text(plausible.outlook.unseen)
        if surrogate is not None:
            attrs[SURROGATE_FILE] = str(surrogate.absolute())
        inputs = inputs_of(folder, plan, sweeps, None if surrogate is None else surrogate.absolute())
        doing = command or "calib.calibrate"
        with owned(folder, doing), telling(folder) as teller:
            _check_folder(folder, resume)  # another process may have begun or ended a run there
            known, seed = _begun(folder, seed) if resume else (None, DEFAULT_SEED if seed is None else seed)
            mine = identity_of(problem, seed)
            if known is not None:
                _require_same(known, mine, folder)
            listing = Listing(seed, attrs, mine.parts, mine.fingerprint, inputs, {}, doing)
            if known is not None:
                known = replace(known, files={name: digest for name, digest in known.files.items() if name != EXPERIMENT})
            if not resume:  # a run says what it is from its first second on, so that it can be resumed without its seed
                listing = with_command(listing, doing)
                write_listing(folder, listing)
            elif known is not None:  # also of a command that is killed
                listing = replace(listing, commands=with_command(known, doing).commands)
                write_listing(folder, replace(known, commands=listing.commands))
            _keep_experiment(plan, folder)
            first = first_answer_of(problem) if plausible is None or plausible.first is None else plausible.first
            watch = _also(watch, teller)
            watch.first_answer(first)
            watch.stage("other models")
            elsewhere = stages.look_elsewhere(problem, first, crew if crew.processes else None)
            try:
                with watch.sampling() as progress:
                    posterior = stages.sample(
                        problem,
                        seed=seed,
                        checkpoint=folder / CHECKPOINT,
                        resume=resume,
                        max_seconds=deadline - time.monotonic(),
                        processes=processes,
                        progress=progress,
                        attrs=attrs,
                    )
            except InputError:
                if not resume and not is_begun(folder / CHECKPOINT):
                    _remove_begun(folder)
                raise
            posterior = replace(posterior, diagnostics=replace(posterior.diagnostics, first_answer=first))
            posterior = with_sensitivity(with_elsewhere(posterior, elsewhere))
            watch.stage("left-out data")
            posterior = stages.foretell_blocks(posterior, forward, crew if crew.processes else None)
            watch.stage("spot check")
            posterior = stages.spot_check(posterior, forward)
            watch.stage("report")
            listing = replace(listing, files={} if known is None else known.files)
            run, page_error = write_run(folder, posterior, forward, listing, doing, stages.page, drawing)
            if reweight:  # for minutes to hours: what it may fail of, or be stopped, leaves a finished run without it
                with workers(processes) as executor, watch.reweighting() as told:
                    posterior = stages.reweight(posterior, forward, reweight, executor, progress=told)
                run, page_error = write_run(folder, posterior, forward, listing, doing, stages.page, drawing)
    return Calibration(run, page_error)


def _also(watch: Watch, teller: Teller) -> Watch:
    """Show how far a calibration is, and let the folder of the run tell it, too."""

    def stage(name: str) -> None:
        watch.stage(name)
        teller.stage(name)

    def first_answer(first: FirstAnswer | None) -> None:
        watch.first_answer(first)
        teller.first_answer(first)

    @contextmanager
    def sampling() -> Iterator[Callable[[Progress], None]]:
        with watch.sampling() as shown:

            def tell_both(p: Progress) -> None:
                if shown is not None:
                    shown(p)
                teller.sampling(p)

            yield tell_both

    return replace(watch, stage=stage, first_answer=first_answer, sampling=sampling)


def _check_folder(folder: Path, resume: bool) -> None:
    if resume:
        if not folder.is_dir():
            raise InputError(Fault("there is no run to resume", folder, advice="Leave --resume out to start one"))
        if (folder / MEMBERS).is_dir():
            advice = "Resume the runs that it is of, and average them again with `calib average`"
            raise InputError(Fault("the run in this folder is an average, which is not sampled", folder, advice=advice))
        if not _is_run(folder):
            advice = "Leave --resume out to start one here" if is_bare(folder) else "Start the calibration anew with another -o"
            message = "this folder was not written by `calib calibrate`: no run.json in it"
            raise InputError(Fault(message, folder, advice=advice))
    elif not folder.exists():
        require_folder(folder, "Create it first")
    elif not folder.is_dir():
        raise InputError(Fault("a file of this name exists and is not overwritten", folder, advice="Choose another -o"))
    elif not is_bare(folder):
        if _is_run(folder):
            message, advice = "there is a run in this folder", "Choose another -o, or continue that run with --resume"
        else:
            inside = in_shell_path(folder / "run1")
            message = "this folder holds other files, and a run wants one of its own"
            advice = f"Choose another -o, such as {inside}, or empty it"
        raise InputError(Fault(f"{message}: the output folder exists and is not overwritten", folder, advice=advice))


def _is_run(folder: Path) -> bool:
    return (folder / LISTING).exists() or is_begun(folder / CHECKPOINT)


def _check_reweight(n_draw: int, plan: Experiment) -> None:
    if plan.model == "fem":
        advice = "Leave --reweight out"
        raise InputError(Fault('model = "fem": there is nothing to re-weight to the finite elements', plan.path, advice=advice))
    if n_draw < LEAST_DRAWS:
        raise InputError(Fault(f"--reweight {n_draw} are too few draws to judge", advice=f"Give at least {LEAST_DRAWS}"))


def _begun(folder: Path, seed: int | None) -> tuple[Listing | None, int]:
    """What the `run.json` of a folder says, None if it is damaged, and the seed to go on with: as asked for, else the run's."""
    why = "run.json is not there"
    try:
        known = read_listing(folder)
    except InputError as error:
        known, why = None, error.faults[0].message
    if seed is not None:
        return known, seed
    if known is not None:
        return known, known.seed
    kept = kept_identity(folder / CHECKPOINT)
    if kept is None:
        advice = "Give it with --seed, or start anew with another -o"
        raise InputError(Fault(f"nothing tells with which seed this run was begun ({why})", folder, advice=advice))
    return None, int(kept["seed"])


def _require_same(known: Listing, mine: Identity, folder: Path) -> None:
    """Refuse to go on with a run as another: of its draws, and of all that was made of them."""
    if said := differences(known.identity, mine.parts) if known.identity else "":
        advice = "Put the inputs back to go on with that run, or start anew with another -o"
        raise InputError(Fault(f"the run in this folder is another: {said}", folder, advice=advice))


def _keep_experiment(plan: Experiment, folder: Path) -> None:
    """Copy the experiment file into its run; it is refused that it is another by now than it was when it was read."""
    if plan.path is None:
        return
    content = plan.path.read_bytes()
    if hashlib.sha256(content).hexdigest() != plan.sha256:
        raise InputError(Fault("this file was written anew while it was read", plan.path, advice="Run the command again"))
    with whole_file(folder / EXPERIMENT) as part:
        part.write_bytes(content)


def _remove_begun(folder: Path) -> None:
    """Remove a run in which nothing was sampled; what says that it is one goes last."""
    shutil.rmtree(folder / CHECKPOINT, ignore_errors=True)
    (folder / EXPERIMENT).unlink(missing_ok=True)
    (folder / LISTING).unlink(missing_ok=True)
