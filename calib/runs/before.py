"""An experiment file in, what can be said of it before anything is sampled out: what is implausible, what data will tell."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calib.checks import FILES, Outlook, Plausibility, Range, Reason, Verdict, plausibility, unedited_reasons, verdict_of
from calib.errors import Fault, InputError
from calib.experiment import Experiment, forward_of_experiment, read_experiment
from calib.problem import Problem, build_problem, log_posterior
from calib.runs.preview import problem_of
from calib.sampling import ENSEMBLES, MANY_SPECIMENS, usual_walkers

# What a calibration takes, in the processor times of what is timed here: sixteen climbs, steps of the ensembles until they
# usually agree, draws of the spot check [s], and what it reads and draws [s]. See docs/check.md.
_CLIMBS, _STEPS, _SPOT_CHECK, _REST = 16.0, 200, 2.0, 8.0
# It may take so many times less or more than that.
_LEAST, _MOST = 0.7, 4.0
# A lot of many specimens may take longer yet: what they have in common creeps where they are alike. One of four, sampled as
# these are, took 7,200 steps, 36 times the usual ones.
_MOST_OF_LOT = 30.0
# Draws by which an evaluation is timed.
_TIMED = 320


@dataclass(frozen=True)
class Check:
    """What can be said of an experiment before it is calibrated.

    Attributes
    ----------
    experiment : that was checked.
    verdict : green if nothing speaks against it, amber if something is doubtful, red if a calibration is not worth its time.
    ranges : what the priors expect of every sweep at a glance, beside what was read.
    outlook : what the data will tell of each unknown; None where that cannot be said.
    seconds : between which times [s] a calibration will probably take here; None where that cannot be said.
    """

    experiment: Experiment
    verdict: Verdict
    ranges: tuple[Range, ...]
    outlook: Outlook | None
    seconds: tuple[float, float] | None

    def to_plain(self) -> dict[str, Any]:
        """What a program reads of it, all numbers SI: verdict, ranges, unknowns, ridges, what no check sees, seconds."""
        outlook = self.outlook
        unknowns = [] if outlook is None else [{**asdict(told), "name": str(told.name)} for told in outlook.unknowns]
        ridges = [] if outlook is None else [{"names": [str(n) for n in r.names], "said": r.in_words} for r in outlook.ridges]
        ranges = [{**asdict(r), "high": r.high if np.isfinite(r.high) else None} for r in self.ranges]
        unseen = [] if outlook is None else [{**one.to_plain(), "said": one.in_words} for one in outlook.unseen]
        seconds = None if self.seconds is None else list(self.seconds)
        return {
            **self.verdict.to_plain(),
            "ranges": ranges,
            "unknowns": unknowns,
            "ridges": ridges,
            "unseen": unseen,
            "seconds": seconds,
        }


def check(experiment: Path | str, surrogate: Path | str | None = None) -> Check:
    """Check an experiment before it is calibrated: files, geometry and priors, and what its data will tell; nothing is sampled.

    Parameters
    ----------
    experiment : file, see `calib.experiment.read_experiment`.
    surrogate : file of a surrogate to use instead of the shipped one.

    Returns
    -------
    In a few seconds. With `model = "fem"` the surrogate stands in for the finite elements.

    Raises
    ------
    InputError
        If an input cannot be used: with every fault, and with the slip of the pen that may be behind it.
    """
    plan = read_experiment(experiment)
    problem = problem_of(plan, surrogate)
    found = plausibility_of(problem)
    edits = unedited_reasons(plan)
    if found is None:
        return Check(plan, verdict_of(edits), (), None, None)
    verdict = verdict_of([*found.reasons, *edits])
    return Check(plan, verdict, found.ranges, found.outlook, _seconds(problem, found))


def plausibility_of(problem: Problem) -> Plausibility | None:
    """The plausibility of a problem, by the surrogate in the place of the finite elements; None if none covers it.

    Parameters
    ----------
    problem : as it is to be sampled.
    """
    if problem.experiment.model != "fem":
        return plausibility(problem)
    quick = replace(problem.experiment, model="surrogate")
    try:
        found = plausibility(build_problem(quick, problem.sweeps, forward_of_experiment(quick)))
    except InputError:
        return None
    return replace(found, first=None)


def require_plausible(found: Plausibility | None, path: Path | None) -> None:
    """Refuse what is not worth sampling.

    Parameters
    ----------
    found : about the problem.
    path : of the experiment.

    Raises
    ------
    InputError
        With every reason that is red, and how to go on all the same.
    """
    red = [] if found is None else [reason for reason in found.reasons if reason.level == "red"]
    if red:
        faults = [Fault(f"{reason.gate}: {reason.finding}", path, advice=reason.action) for reason in red]
        advice = "See all of it with `calib check`; --anyway calibrates all the same, and keeps these reasons with the result"
        raise InputError([*faults, Fault("nothing was sampled", path, advice=advice)])


def kept_reasons(found: Plausibility | None) -> tuple[Reason, ...]:
    """The reasons that a run keeps for its verdict: those that only a look before sampling finds."""
    return () if found is None else tuple(reason for reason in found.reasons if reason.gate != FILES)


def seconds_of_evaluation(problem: Problem) -> float:
    """Processor time [s] that the posterior of one draw takes here, as draws of the prior take together."""
    theta = np.random.default_rng(0).standard_normal((_TIMED, len(problem.parameters)))
    began = time.process_time()
    log_posterior(problem, theta)
    return (time.process_time() - began) / _TIMED


def seconds_of(problems: Sequence[Problem], processes: int | None = None) -> tuple[float, float] | None:
    """Between which times [s] calibrations, one after the other, will probably take on this machine; None if it cannot be said.

    Parameters
    ----------
    problems : of the same data under other models; how long a climb takes is taken from the first.
    processes : that they may have; None for the number of processors.
    """
    found = plausibility_of(problems[0]) if problems else None
    each = [] if found is None else [_seconds(problem, found, processes) for problem in problems]
    known = [seconds for seconds in each if seconds is not None]
    return (sum(low for low, _ in known), sum(high for _, high in known)) if known and len(known) == len(problems) else None


def _seconds(problem: Problem, found: Plausibility, processes: int | None = None) -> tuple[float, float] | None:
    """Between which times a calibration will probably take on this machine."""
    if problem.experiment.model == "fem" or found.outlook is None:
        return None
    each = seconds_of_evaluation(problem)
    spread = min(ENSEMBLES, os.cpu_count() or 1, max(processes, 1) if processes is not None else ENSEMBLES)
    steps = ENSEMBLES * usual_walkers(problem) * _STEPS * each
    work = (_CLIMBS * found.seconds_of_climb + steps + _SPOT_CHECK * len(problem.sweeps)) / spread + _REST
    creeps = bool(problem.table.lots) and len({sweep.specimen for sweep in problem.sweeps}) >= MANY_SPECIMENS
    return _LEAST * work, (_MOST_OF_LOT if creeps else _MOST) * work
