"""A `Problem`: experiment, reduced data and forward model put together, checked, with its unknowns listed."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calib.errors import Fault, InputError
from calib.experiment import Experiment, forward_of_experiment, read_sweeps
from calib.lab import Sweep
from calib.problem.measurement import model_sweep, reach, ways_down, why_outside
from calib.problem.plan import SweepPlan, plan_sweeps
from calib.problem.prior import prior_coordinates
from calib.problem.unknowns import ParameterInfo, UnknownTable, list_unknowns, table_of
from calib.problem.values import values_at
from models.response import Forward

# Of a press that is too deep so much is advised of what is covered at the medians, and for all but this share of the prior.
_FITS, _FITTING_SHARE = 0.9, 0.35
# How far [m] the estimates of contact from the whole press and from its beginning may lie apart.
_CONTACT_SHIFTS = 0.03e-3
#: Prior draws with which `build_problem` checks what the forward model covers.
_N_PRIOR_CHECK = 512


@dataclass(frozen=True, eq=False)
class Problem:
    """A calibration ready to be sampled: the data, the forward model, and the unknowns with their priors.

    `build_problem` makes one. The sampler sees a vector theta of one coordinate z for each unknown, standard normal under the
    prior: value = prior.ppf_normal(z), log prior = -z^2/2 summed; specimens of one lot are alike, see `calib.problem.lots`.
    `values_at` gives the values by name.

    Attributes
    ----------
    experiment : what is to be calibrated.
    sweeps : the data, reduced to points.
    forward : the model of the sensor.
    parameters : the unknowns, in the order of theta.
    fixed : name -> value [SI] of the unknowns that a prior fixes; they are not part of theta.
    plans : for each sweep the part of the likelihood that no draw changes.
    """

    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    forward: Forward
    parameters: tuple[ParameterInfo, ...]
    fixed: Mapping[str, float]
    plans: tuple[SweepPlan, ...]

    @cached_property
    def table(self) -> UnknownTable:
        """The unknowns made ready to be given values, see `values_at`."""
        return table_of(self.parameters, self.experiment)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, in the order of theta."""
        return tuple(p.name for p in self.parameters)


def problem_from(experiment: Experiment, forward: Forward | None = None) -> Problem:
    """The calibration problem of an experiment: its lab files are read, its forward model is loaded, and all is checked.

    Parameters
    ----------
    experiment : from a file or built in Python.
    forward : the model of the sensor; by default the one that the experiment names.

    Raises
    ------
    InputError
        With every fault of the lab files; or as in `build_problem`.
    """
    sweeps = read_sweeps(experiment)
    return build_problem(experiment, sweeps, forward_of_experiment(experiment) if forward is None else forward)


def build_problem(experiment: Experiment, sweeps: Sequence[Sweep], forward: Forward) -> Problem:
    """Put experiment, data and forward model together, list the unknowns, and check that the model covers what was measured.

    Parameters
    ----------
    experiment : what is to be calibrated, with the priors that it names.
    sweeps : its data, from `read_sweeps`.
    forward : the model of the sensor, from `forward_of_experiment`.

    Returns
    -------
    A problem that can be sampled.

    Raises
    ------
    InputError
        If a sweep has no readings or nothing that ties its capacitance to depth; if at the prior medians a design is
        invalid, or a design or its sweep's depth lies outside what the forward model covers; or if more than half of the
        prior's draws do.
    """
    faults = [Fault(problem, experiment.path, advice=advice) for s in sweeps for problem, advice in _unusable(s)]
    if not sweeps:
        faults.append(Fault("there is no sweep to calibrate with", experiment.path))
    if faults:
        raise InputError(faults)
    parameters, fixed = list_unknowns(experiment, sweeps)
    problem = Problem(experiment, tuple(sweeps), forward, parameters, fixed, plan_sweeps(sweeps))
    if faults := outside_faults(problem):
        raise InputError(faults)
    return problem


def _unusable(sweep: Sweep) -> list[tuple[str, str]]:
    where = f"sweep of {sweep.title}"
    if not sweep.channels:
        return [(f"{where} has neither force nor capacitance readings", "Leave it out")]
    if any(not sweep.tied_by(channel) for channel in sweep.channels):
        return [
            (
                f"{where}: nothing tells how deep the ball was at the capacitance readings",
                "Give a force file with a time column beside it, or a force or displacement column in the capacitance file",
            )
        ]
    return []


def outside_faults(problem: Problem) -> list[Fault]:
    """Find the sweeps of a problem's plans that the model does not cover, at the medians or for most draws of the prior."""
    n = len(problem.parameters)
    draws = prior_coordinates(problem, np.random.default_rng(20190304), _N_PRIOR_CHECK)
    faults = []
    for theta, share_allowed in ((np.zeros((1, n)), 0.0), (draws, 0.5)):
        values = values_at(problem, theta)
        for way in ways_down(problem, problem.forward, problem.plans, values):
            plan, covered = way.plan, way.covered
            if plan.needs_curve:
                covered = model_sweep(problem, problem.forward, plan, values).covered
            share = 1 - float(np.mean(covered))
            if share <= share_allowed:
                continue
            where = f"the sweep of {plan.sweep.title}"
            first = int(np.argmin(covered))
            single = {name: value[first : first + 1] for name, value in values.items()}
            reason = why_outside(problem, problem.forward, plan, single)
            at = "at the prior medians" if share_allowed == 0 else f"for {100 * share:.0f} % of the prior's draws"
            beyond = [p.name for p in problem.parameters if re.search(rf"\b{p.parameter}\b", reason)]
            advice = (
                f"Give {' and '.join(beyond)} a prior within that"
                if beyond
                else _what_fits(problem, plan) + "check thicknesses, ball radius and contact_offset, or narrow their priors"
            )
            says = f"{where} lies outside what the {problem.forward.name} covers {at}: {reason}"
            faults.append(Fault(says, problem.experiment.path, advice=advice))
        if faults:
            break
    return faults


def _what_fits(problem: Problem, plan: SweepPlan) -> str:
    """How much of a press the forward model would cover, as the use that says so; no number where another thing is wrong."""
    n = len(problem.parameters)
    draws = prior_coordinates(problem, np.random.default_rng(20190304), _N_PRIOR_CHECK)
    reached = reach(problem, problem.forward, plan, values_at(problem, np.concatenate([np.zeros((1, n)), draws])))
    # At the medians, and for more of the prior than must be; less what the contact and the default priors shift with the data.
    reading, load = (_FITS * min(float(of[0]), float(np.quantile(of[1:], _FITTING_SHARE, method="lower"))) for of in reached)
    by_force = all(channel.tie == "force" for channel in plan.channels.values())
    use = ""
    if by_force and load > 0:
        use = f'max_force = "{_floored(load):g} N"'
    depth = reading / _FITS - plan.sweep.contact
    if not by_force and np.isfinite(depth) and _FITS * depth - _CONTACT_SHIFTS > 0:
        use = f'max_depth = "{_floored((_FITS * depth - _CONTACT_SHIFTS) * 1e3):g} mm"'
    return f"Use less of this press: use = {{ {use} }} beside its files; or " if use else "Use less of the press, or "


def _floored(value: float) -> float:
    """A positive number with two digits, not above it."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.floor(value / step) * step, 12)
