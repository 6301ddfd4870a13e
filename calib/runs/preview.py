"""An experiment file in, its problem and a first answer out, read and checked as for a calibration; nothing is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from calib.checks import ways_out
from calib.errors import Fault, InputError
from calib.experiment import Experiment, forward_of_experiment, read_experiment, read_sweeps
from calib.problem import Problem, build_problem
from calib.sampling import FirstAnswer, first_answer


def quick(
    experiment: Path, surrogate: Path | None = None, planned: Callable[[Experiment], None] = lambda _: None
) -> FirstAnswer:
    """A first answer for the lab files of an experiment, read and checked as for a calibration; nothing is written.

    Parameters
    ----------
    experiment : file, see `calib.experiment.read_experiment`.
    surrogate : file of a surrogate to use instead of the shipped one.
    planned : told the experiment, once all input is checked.

    Raises
    ------
    InputError
        If an input cannot be used, or its forward model is the finite elements, which take too long for a first answer.
    """
    plan = read_experiment(experiment)
    if plan.model == "fem":
        advice = 'Leave the line model = "fem" out for a first answer with the surrogate'
        raise InputError(Fault('model = "fem": there is no quick answer with the finite elements', plan.path, advice=advice))
    problem = problem_of(plan, surrogate)
    planned(plan)
    try:
        return first_answer(problem)
    except ValueError as error:
        raise InputError(Fault(str(error), plan.path, advice="Calibrate without --quick")) from error


def problem_of(plan: Experiment, surrogate: Path | str | None) -> Problem:
    """The problem of an experiment, all of whose files are read here.

    Parameters
    ----------
    plan : the experiment.
    surrogate : file of a surrogate to use instead of the shipped one.

    Raises
    ------
    InputError
        If a file cannot be used, or nothing is unknown.
    """
    sweeps, forward = read_sweeps(plan), forward_of_experiment(plan, surrogate)
    try:
        problem = build_problem(plan, sweeps, forward)
    except InputError as refusal:
        raise InputError(ways_out(refusal.faults, plan, sweeps, forward)) from refusal
    if not problem.parameters:
        advice = 'Give one of them a prior, such as young_modulus = { lognormal = ["0.7 MPa", 1.6] }'
        raise InputError(Fault("every parameter is fixed: there is nothing to calibrate", plan.path, advice=advice))
    return problem


def first_answer_of(problem: Problem) -> FirstAnswer | None:
    """The first answer of a problem; None where it would take long, or cannot be had, which is no reason not to sample."""
    if problem.experiment.model == "fem":
        return None
    try:
        return first_answer(problem)
    except ValueError:  # a matrix that is singular is one
        return None
