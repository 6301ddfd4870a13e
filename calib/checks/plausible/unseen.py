"""A look at a posterior in, what errors of the rig that no check can see would do to a modulus out.

A load cell or a crosshead of another gain, or a ball of another radius, makes just the data of a silicone of another modulus.
What is not named among the priors is taken as exact, and by how much a modulus hangs on it is told by another first answer.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from calib.catalogue import UNKNOWNS, UnknownName
from calib.errors import InputError
from calib.experiment import Experiment
from calib.priors import Fixed, Prior
from calib.problem import Problem, build_problem
from calib.sampling import FirstEstimate, Look, answer_of, first_answer

#: What is taken as exact, or as not there, unless an experiment names it.
Cause = Literal[
    "load_step",
    "force_gain",
    "displacement_gain",
    "indenter_radius",
    "sensor_thickness",
    "padding_thickness",
    "dielectric_thickness",
    "padding_young_modulus",
    "machine_compliance",
    "padding_poisson_ratio",
    "friction_coefficient",
    "base_friction_coefficient",
]

#: Attribute of a posterior that keeps what no check can see, as `unseen_to_text` writes it.
UNSEEN = "not seen in the data"
# An error that is looked at of what is taken as exact: of a load cell of class 1 (ISO 7500-1), of a crosshead of class 1
# (ISO 9513), and of a ball by the caliper.
_SHARE = 0.01
# The same of what is fixed and may be nothing, in its SI unit: the compliance of a frame that was never pressed against bare
# steel, and what a table says of a foam or of a friction.
_MORE: Mapping[Cause, float] = {
    "machine_compliance": 1e-6,
    "padding_poisson_ratio": 0.05,
    "friction_coefficient": 0.05,
    "base_friction_coefficient": 0.05,
}
# Specimens with which it is said, as each takes another first answer.
_MOST_SPECIMENS = 4
_MODULI = ("young_modulus", "padding_young_modulus")
_THICKNESSES: tuple[Cause, ...] = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
_SHARES: tuple[Cause, ...] = (*_THICKNESSES, "padding_young_modulus")
_WHAT = {
    "force_gain": "the load cell reads {} too high",
    "displacement_gain": "the travel reads {} too large",
    "indenter_radius": "the ball is {} larger than said",
    "sensor_thickness": "sensors are {} thicker than fixed",
    "padding_thickness": "paddings are {} thicker than fixed",
    "dielectric_thickness": "dielectrics are {} thicker than fixed",
    "padding_young_modulus": "the padding's modulus is {} larger than fixed",
    "machine_compliance": "the machine gives {} more than fixed",
    "padding_poisson_ratio": "the padding's Poisson's ratio is {} larger than fixed",
    "friction_coefficient": "the ball's friction is {} larger than fixed",
    "base_friction_coefficient": "the base's friction is {} larger than fixed",
}


@dataclass(frozen=True)
class Unseen:
    """What an error would do that no check can see.

    Attributes
    ----------
    cause : the unknown that would have to be named for it to count.
    size : of the error: of a balance at the touch the noise of one reading [N], of a compliance [m/N], a Poisson's ratio and
        frictions what is added, of whatever else is taken as exact a share of it.
    name : the modulus that it moves most.
    shift : by how many of its standard deviations.
    share : by which share of itself.
    """

    cause: Cause
    size: float
    name: UnknownName
    shift: float
    share: float

    @property
    def in_words(self) -> str:
        """Say in a sentence what it would do, and what to write where it may happen."""
        moved = f"{self.name} moves by {abs(self.shift):.1f} of its standard deviations, and nothing shows it"
        prior = f"{self.cause} = {UNKNOWNS[self.cause].example}"
        if self.cause == "load_step":
            return f"if {self.error}, {moved}; where the machine may do so, give {prior} in [specimens.priors]"
        where = "[specimens.priors]" if self.cause in _THICKNESSES else "[priors]"
        return f"if {self.error}, {moved}; where it is not known so well, give a prior in {where}, such as {prior}"

    @property
    def error(self) -> str:
        """The error, in a clause.

        >>> Unseen("force_gain", 0.01, UnknownName("young_modulus"), -1.0, -0.01).error
        'the load cell reads 1 % too high'
        """
        if self.cause == "load_step":
            size = f"{self.size * 1e3:.2g} mN"
            return f"the load cell is balanced anew at the touch of every press, by the noise of one reading ({size})"
        return _WHAT[self.cause].format(self.size_in_words)

    @property
    def size_in_words(self) -> str:
        """The size of an error of what is taken as exact.

        >>> Unseen("machine_compliance", 1e-6, UnknownName("young_modulus"), 2.5, 0.02).size_in_words
        '1 µm/N'
        """
        if self.cause == "machine_compliance":
            return f"{1e6 * self.size:g} µm/N"
        return f"{self.size:g}" if self.cause in _MORE else f"{100 * self.size:g} %"

    def to_plain(self) -> dict[str, Any]:
        """What a program reads of it, SI."""
        return {**asdict(self), "name": str(self.name)}


def unseen_to_text(unseen: Sequence[Unseen]) -> str:
    """What no check can see as a text that is kept with draws; the inverse is `unseen_from_text`."""
    return json.dumps([one.to_plain() for one in unseen])


def unseen_from_text(text: str) -> tuple[Unseen, ...]:
    """What `unseen_to_text` wrote."""
    return tuple(Unseen(**{**plain, "name": UnknownName.parse(plain["name"])}) for plain in json.loads(text))


def unseen_in(look: Look) -> tuple[Unseen, ...]:
    """How far errors that no check can see would move the modulus that each moves most, what moves it most first.

    Parameters
    ----------
    look : at the posterior.

    Returns
    -------
    For what is not named among the priors; of few specimens.
    """
    problem = look.problem
    moduli = [p.key for p in problem.parameters if p.parameter in _MODULI]
    if not moduli or len(problem.experiment.specimens) > _MOST_SPECIMENS:
        return ()
    try:
        near = answer_of(look).means
        before = first_answer(problem, near).parameters  # by the same random numbers as those after it
    except ValueError:
        return ()
    found = []
    for cause, size, moved in _errors(problem, before):
        try:
            after = first_answer(build_problem(moved, problem.sweeps, problem.forward), near).parameters
        except (InputError, ValueError):  # a design that no surrogate covers, or no first answer
            continue
        most, shift = most_moved(moduli, before, after)
        was = before[str(most)]
        found.append(Unseen(cause, size, most, shift, shift * was.sd / was.mean))
    return tuple(sorted(found, key=lambda one: -abs(one.shift)))


def most_moved(
    names: Sequence[UnknownName], before: Mapping[str, FirstEstimate], after: Mapping[str, FirstEstimate]
) -> tuple[UnknownName, float]:
    """Which unknown comes out farthest from where it was, and by how many of its standard deviations.

    Parameters
    ----------
    names : of the unknowns, at least one.
    before, after : what is found of them.
    """
    by = {name: (after[str(name)].mean - before[str(name)].mean) / before[str(name)].sd for name in names}
    most = max(by, key=lambda name: abs(by[name]))
    return most, by[most]


def _errors(problem: Problem, before: Mapping[str, FirstEstimate]) -> Iterator[tuple[Cause, float, Experiment]]:
    """Errors that may be, each with its size and with the experiment that takes it for granted."""
    experiment = problem.experiment
    named = {p.parameter for p in problem.parameters} | {UnknownName.parse(name).parameter for name in problem.fixed}
    if "force_noise" not in named:
        return
    tied = any(channel.tie == "force" for plan in problem.plans for channel in plan.channels.values())
    if "load_step" not in named and not tied:
        # A model whose load zero is lower in contact by s, over readings that are as they are, is the model as it is over
        # readings that are higher by s there.
        step = before["force_noise"].mean if "force_noise" in before else problem.fixed["force_noise"]
        own = tuple(replace(s, priors={**s.priors, "load_step": Fixed(-step)}) for s in experiment.specimens)
        yield "load_step", step, replace(experiment, specimens=own)
    if "force_gain" not in named:
        yield "force_gain", _SHARE, _with(experiment, "force_gain", 1 + _SHARE)
    if "displacement_gain" not in named and "machine_compliance" in named:  # which a crosshead has, where it tells a depth
        yield "displacement_gain", _SHARE, _with(experiment, "displacement_gain", 1 + _SHARE)
    radii = {sweep.indenter_radius for sweep in problem.sweeps}
    if "indenter_radius" not in named and len(radii) == 1:
        yield "indenter_radius", _SHARE, _with(experiment, "indenter_radius", (1 + _SHARE) * radii.pop())
    for name, more in _MORE.items():
        if isinstance(fixed := experiment.priors.get(name), Fixed):
            yield name, more, _with(experiment, name, fixed.value + more)
    for name in _SHARES:
        if (moved := _larger(experiment, name)) != experiment:
            yield name, _SHARE, moved


def _larger(experiment: Experiment, name: str) -> Experiment:
    """The experiment with what is fixed of a quantity larger."""

    def larger(priors: Mapping[str, Prior]) -> Mapping[str, Prior]:
        match priors.get(name):
            case Fixed(value):
                return {**priors, name: Fixed((1 + _SHARE) * value)}
        return priors

    own = tuple(replace(s, priors=larger(s.priors)) for s in experiment.specimens)
    return replace(experiment, priors=larger(experiment.priors), specimens=own)


def _with(experiment: Experiment, name: str, value: float) -> Experiment:
    return replace(experiment, priors={**experiment.priors, name: Fixed(value)})
