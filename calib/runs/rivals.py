"""An experiment file in, a calibration of each model that its data should be held against and their comparison out."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from calib.checks import (
    BEYOND_DOUBT,
    ComparedModel,
    Standing,
    compare_runs,
    comparison_in_words,
    doubts,
    reservations,
    standings,
    unusable,
)
from calib.errors import InputError
from calib.experiment import Experiment, Variant, candidates_of, read_experiment
from calib.files import require_folder, write_text
from calib.records import record_to_text
from calib.runs.average import AVERAGE, average_runs
from calib.runs.before import seconds_of
from calib.runs.calibration import DEFAULT_SECONDS, DEFAULT_SEED, Stages, Watch, calibrate
from calib.runs.folder import Run, load_run
from calib.runs.listing import CHECKPOINT, LISTING
from calib.runs.preview import problem_of
from calib.sampling import FINGERPRINT, NothingSampled, identity_of, is_begun

#: Name of the file that holds a comparison.
COMPARISON = "comparison.json"

_USUAL = Stages()


@dataclass(frozen=True)
class Forecast:
    """What is to be calibrated for a comparison, and how long that will take.

    Attributes
    ----------
    names : of the models that are calibrated now.
    finished : of those that are finished in the folder already, and taken as they are.
    seconds : between which times [s] it will probably take here; None where that cannot be said.
    most : [s], that all of them may read and sample.
    ruled_out : how those stand that are not calibrated, as the data rule them out beyond doubt.
    impossible : name of a model that cannot be calibrated -> why.
    """

    names: tuple[str, ...]
    finished: tuple[str, ...]
    seconds: tuple[float, float] | None
    most: float
    ruled_out: tuple[Standing, ...] = ()
    impossible: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Rivalry:
    """How models of the same data compare.

    Attributes
    ----------
    candidates : the models that were calibrated, best first.
    runs : name of each of them -> its run.
    failed : name of a model that could not be -> why.
    average : over those that were; None if there is one alone, or it could not be made.
    ruled_out : how those stand that were not calibrated, as the data rule them out beyond doubt.
    """

    candidates: tuple[ComparedModel, ...]
    runs: Mapping[str, Run]
    failed: Mapping[str, str]
    average: Run | None = None
    ruled_out: tuple[Standing, ...] = ()

    @property
    def in_words(self) -> str:
        """Which of the models predict the data best, and which are ruled out, in a sentence or two."""
        said = comparison_in_words(self.candidates)
        if not self.ruled_out:
            return said
        return f"{said} Ruled out by first answers, and not calibrated: {'; '.join(s.in_words for s in self.ruled_out)}."

    @property
    def reservations(self) -> list[str]:
        """What the verdicts have against the models that predict best, in sentences."""
        return reservations(self.candidates, {name: run.verdict for name, run in self.runs.items()})

    @property
    def chosen(self) -> Run:
        """The run to go on with: the average, or the only one."""
        return self.average or self.runs[self.candidates[0].name]

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the comparison cannot be trusted, in sentences; none if it can."""
        verdicts = {name: run.verdict for name, run in self.runs.items()}
        not_made = (f"{name} was not made: {why}" for name, why in self.failed.items())
        return (*doubts(self.candidates), *unusable(self.candidates, verdicts), *not_made)


def calibrate_rivals(
    experiment: Path,
    folder: Path,
    *,
    seed: int = DEFAULT_SEED,
    seconds: float = DEFAULT_SECONDS,
    processes: int | None = None,
    command: str = "",
    planned: Callable[[Forecast], None] | None = None,
    looking: Callable[[Variant, int, int], None] = lambda *_: None,
    watch: Callable[[Variant, int, int], AbstractContextManager[Watch]] = lambda *_: nullcontext(Watch()),
    stages: Stages = _USUAL,
) -> Rivalry:
    """Calibrate every model that the data of an experiment should be held against, compare them, and average them.

    First each is held against the data by its first answer: the likely ones are calibrated first, and what is ruled out
    beyond doubt (`calib.checks.standings`) not at all, unless they are finished already. Each has a run folder of its own, like
    any other, in `folder`, and so has the average (`average`). Those that have converged are not calibrated again, those that
    were stopped go on.

    Parameters
    ----------
    experiment : file, see `calib.experiment.read_experiment`.
    folder : of the run folders, which may be there already.
    seed : of each calibration.
    seconds : that each may read and sample.
    processes : worker processes; None for the number of processors, at most 4, and 0 for none.
    command : the command line, kept with each posterior.
    planned : told what is to be calibrated and how long it will take, before anything is; None to work that out for nobody.
    looking : told each model before its first answer, with its number and how many there are.
    watch : gives the watch of the calibration of a variant, which is told its number and how many there are.
    stages : what is done in each, one after the other.

    Returns
    -------
    The comparison, also written to `comparison.json` in the folder.

    Raises
    ------
    InputError
        If an input cannot be used.
    NothingSampled
        If there is no draw of the experiment's own model when the time is over.
    """
    plan = read_experiment(experiment)
    variants = candidates_of(plan)
    runs: dict[str, Run] = {}
    failed: dict[str, str] = {}
    finished = {variant.name: _finished(variant.of(plan), folder / variant.name, seed) for variant in variants}
    ruled_out: tuple[Standing, ...] = ()
    if any(run is None for run in finished.values()):
        standing = standings(problem_of(plan, None), variants, looking)
        ruled_out = tuple(s for s in standing if s.ruled_out and finished[s.variant.name] is None)
        variants = tuple(s.variant for s in standing if s not in ruled_out)
    if planned is not None:
        left = [v for v in variants if finished[v.name] is None]
        planned(_forecast(plan, left, finished, seconds, processes, ruled_out))
    for k, variant in enumerate(variants, 1):
        own = folder / variant.name
        run = finished[variant.name]
        if run is None:
            if not folder.exists():
                require_folder(folder, "Create it first")
                folder.mkdir()
            resume = (own / LISTING).exists() or is_begun(own / CHECKPOINT)
            try:
                with watch(variant, k, len(variants)) as told:
                    done = calibrate(
                        experiment,
                        own,
                        seed=seed,
                        resume=resume,
                        deadline=time.monotonic() + seconds,
                        processes=processes,
                        command=command,
                        watch=told,
                        stages=stages,
                        variant=variant,
                        anyway=True,  # what is implausible stays in the verdict of each of them
                    )
            except (InputError, NothingSampled) as error:
                if not variant.changes or len(variants) == 1:
                    raise
                failed[variant.name] = error.faults[0].message if isinstance(error, InputError) else str(error)
                continue
            run = done.run
        runs[variant.name] = run
    candidates = compare_runs([(name, run.posterior, run.forward) for name, run in runs.items()])
    average = None
    if len(runs) > 1:
        own = folder / AVERAGE
        average, page_error = average_runs(
            list(runs.values()), own, candidates=candidates, anew=True, command=command, page=stages.page
        )
        if page_error is not None:
            failed["the page of the average"] = str(page_error)
    rivalry = Rivalry(candidates, runs, failed, average, ruled_out)
    rows = [{"name": c.name, "model": c.model, "behind": c.behind, "error": c.error} for c in rivalry.candidates]
    out = [{"name": s.variant.name, "model": s.model, "log_bayes": s.log_bayes, "against": s.foremost} for s in ruled_out]
    content = {
        "said": rivalry.in_words,
        "reservations": rivalry.reservations,
        "doubts": list(rivalry.doubts),
        "candidates": rows,
        "ruled_out": out,
        "beyond_doubt": -BEYOND_DOUBT,
    }
    write_text(folder / COMPARISON, record_to_text("comparison", 1, content))
    return rivalry


def _forecast(
    plan: Experiment,
    left: Sequence[Variant],
    finished: Mapping[str, Run | None],
    seconds: float,
    processes: int | None,
    ruled_out: tuple[Standing, ...],
) -> Forecast:
    """How long the calibrations that are left will take, and which of them cannot be made."""
    problems, impossible = {}, {}
    for variant in left:
        try:
            problems[variant.name] = problem_of(variant.of(plan), None)
        except InputError as error:
            if not variant.changes:
                raise
            impossible[variant.name] = error.faults[0].message
    done = tuple(name for name, run in finished.items() if run is not None)
    takes = seconds_of(list(problems.values()), processes)
    return Forecast(tuple(problems), done, takes, seconds * len(problems), ruled_out, impossible)


def _finished(plan: Experiment, folder: Path, seed: int) -> Run | None:
    """The run of a variant in its folder, if it has converged and is still that of these inputs."""
    if not (folder / LISTING).exists():
        return None
    try:
        run = load_run(folder)
    except InputError:
        return None
    mine = identity_of(problem_of(plan, None), seed)
    same = run.posterior.attrs.get(FINGERPRINT) == mine.fingerprint
    return run if same and run.posterior.diagnostics.converged else None
