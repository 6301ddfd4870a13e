"""A look at a posterior in, what the data will tell out: how much of each unknown, and which ones they tell only together."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from calib.catalogue import SCALES, UNKNOWNS, UnknownName, unknowns_of
from calib.errors import InputError
from calib.priors import Fixed
from calib.problem import build_problem, columns_at, of_lot, values_of_lot
from calib.sampling import Look, answer_of, first_answer
from models.sensor import FloatArray

#: Attribute of a posterior that keeps what a load cell that is balanced anew would do, as `tare_to_text` writes it.
TARE = "load balanced anew at the touch"
#: Correlation from which on two unknowns are said to be on a ridge.
RIDGE = 0.6
# Ridges that are told at most, and specimens with which what a tare would do is said, as that takes another first answer.
_MOST, _MOST_TARED = 5, 4
# Of the draws of what is of a lot.
_SEED = 20190304
_SENSOR = frozenset(unknowns_of("material", "specimen"))
_LENGTHS = frozenset({"sensor_thickness", "padding_thickness"})
_MODULI = frozenset({"young_modulus", "padding_young_modulus", "stiffening", "padding_poisson_ratio"})
_OF_FORCE = ("young_modulus", "padding_young_modulus")
_ELECTRICAL = frozenset({"relative_permittivity", "dielectric_thickness", "electrode_radius", "parasitic_capacitance"})
# What breaks a ridge: quantities on its two sides, and the advice.
_ADVICE = (
    (_MODULI, _LENGTHS, "press with a second ball of another radius, or measure the thickness better"),
    (
        _MODULI,
        frozenset({"machine_compliance"}),
        "press the ball onto bare steel and give the slope as prior of machine_compliance",
    ),
    (_MODULI, frozenset({"contact_offset"}), "press deeper, from a record that begins 0.1 mm or more above the sensor"),
    (_MODULI, _MODULI, "press a specimen without padding, too, or with a second ball"),
    (_ELECTRICAL, _ELECTRICAL, "measure one of them by itself, such as the thickness of the dielectric by microscope"),
    (_LENGTHS, _LENGTHS, "measure one of them by itself, by microscope"),
)


@dataclass(frozen=True)
class UnknownOutlook:
    """What the data will tell of one unknown.

    Attributes
    ----------
    name : of the unknown.
    prior_sd : what is not known of it before the data, half of what two thirds of the prior take, SI.
    expected_sd : what will not be known of it after them, SI.
    contraction : share of the prior's variance that the data take away.
    from_data : whether the prior is what the records show.
    """

    name: UnknownName
    prior_sd: float
    expected_sd: float
    contraction: float
    from_data: bool


@dataclass(frozen=True)
class Ridge:
    """Two quantities of which the data tell a combination better than each of them.

    Attributes
    ----------
    names : the two unknowns.
    correlation : of their draws; the largest of all specimens.
    advice : what would tell them apart, in a clause; "" if nothing is known.
    """

    names: tuple[UnknownName, UnknownName]
    correlation: float
    advice: str

    @property
    def in_words(self) -> str:
        """Say in a sentence which combination is known, and what would tell more."""
        one, other = (f"{n.parameter}{f' ({n.specimen})' if n.specimen else ''}" for n in self.names)
        sign = "" if self.correlation > 0 else "one up, the other down, "
        text = (
            f"{one} and {other} go together ({sign}correlation {self.correlation:.2f}): what is left in doubt of one is of both"
        )
        return f"{text}; to know more of each, {self.advice}" if self.advice else text


@dataclass(frozen=True)
class Tare:
    """What a load cell would do that is balanced anew at the touch of every press, by too little to be seen.

    Attributes
    ----------
    step : how much the zero changes, the noise of one reading of the force [N].
    name : the modulus that it moves.
    shift : by how many of its standard deviations.
    """

    step: float
    name: UnknownName
    shift: float

    @property
    def in_words(self) -> str:
        """Say in a sentence what it would do, and what to write where it may happen."""
        return (
            f"if the load cell is balanced anew at the touch of every press, by as little as the noise of one reading "
            f"({self.step * 1e3:.2g} mN), {self.name} moves by {abs(self.shift):.2g} of its standard deviations, and nothing "
            f"shows it; where the machine may do so, give load_step = {UNKNOWNS['load_step'].example} in [specimens.priors]"
        )


def tare_to_text(tare: Tare) -> str:
    """What a balance at the touch would do as a text that is kept with draws; the inverse is `tare_from_text`."""
    return json.dumps({"step": tare.step, "name": str(tare.name), "shift": tare.shift})


def tare_from_text(text: str) -> Tare:
    """What `tare_to_text` wrote."""
    plain = json.loads(text)
    return Tare(plain["step"], UnknownName.parse(plain["name"]), plain["shift"])


@dataclass(frozen=True)
class Outlook:
    """What the data will tell: of each unknown, and which ridges will be left.

    Attributes
    ----------
    unknowns : all but noises and discrepancies, those of a lot first, then in the order of the problem.
    ridges : the sharpest first.
    tare : what a load zero that changes at the touch would do; None where it is an unknown, or can be none.
    """

    unknowns: tuple[UnknownOutlook, ...]
    ridges: tuple[Ridge, ...]
    tare: Tare | None


def outlook_of(look: Look) -> Outlook:
    """Tell from weighted draws near a mode what a calibration will say of each unknown, before it is made."""
    problem, theta, weight = look.problem, look.theta, look.weight
    values = columns_at(problem, theta)
    one_up, one_down = columns_at(problem, np.array([[1.0], [-1.0]]) * np.ones(len(problem.parameters)))
    variance = weight @ (theta - weight @ theta) ** 2
    sd = np.sqrt(weight @ (values - weight @ values) ** 2)
    told = tuple(
        UnknownOutlook(p.key, float((one_up[k] - one_down[k]) / 2), float(sd[k]), float(1 - variance[k]), p.from_data)
        for k, p in enumerate(problem.parameters)
        if p.parameter not in SCALES
    )
    return Outlook((*_of_lot(look), *told), _ridges(look, _correlation(theta, weight)), _tare(look))


def _tare(look: Look) -> Tare | None:
    """How far a step of the load zero at the touch moves the modulus that it moves most, by another first answer.

    A model whose load zero is lower in contact by s, over readings that are as they are, is the model as it is over readings
    that are higher by s there.
    """
    problem = look.problem
    names = {p.parameter for p in problem.parameters} | {UnknownName.parse(name).parameter for name in problem.fixed}
    tied = any(channel.tie == "force" for plan in problem.plans for channel in plan.channels.values())
    moduli = [p.key for p in problem.parameters if p.parameter in _OF_FORCE]
    specimens = problem.experiment.specimens
    if "load_step" in names or "force_noise" not in names or tied or not moduli or len(specimens) > _MOST_TARED:
        return None
    try:
        before = answer_of(look).parameters
        step = before["force_noise"].mean if "force_noise" in before else problem.fixed["force_noise"]
        own = tuple(replace(s, priors={**s.priors, "load_step": Fixed(-step)}) for s in specimens)
        moved = build_problem(replace(problem.experiment, specimens=own), problem.sweeps, problem.forward)
        after = first_answer(moved, {name: estimate.mean for name, estimate in before.items()}).parameters
    except (InputError, ValueError):
        return None  # no first answer, of the one or of the other
    shifts = {key: (after[str(key)].mean - before[str(key)].mean) / before[str(key)].sd for key in moduli}
    most = max(shifts, key=lambda key: abs(shifts[key]))
    return Tare(step, most, shifts[most])


def _of_lot(look: Look) -> tuple[UnknownOutlook, ...]:
    """What the data will tell of values and spreads of a lot."""
    values = values_of_lot(look.problem, look.theta, np.random.default_rng(_SEED))
    found = []
    for info in of_lot(look.problem):
        own = values[info.name]
        z = info.prior.to_normal(own)
        low, high = (float(info.prior.ppf_normal(end)) for end in (-1.0, 1.0))
        variance, sd = (float(look.weight @ (x - look.weight @ x) ** 2) for x in (z, own))
        found.append(UnknownOutlook(info.key, (high - low) / 2, math.sqrt(sd), 1 - variance, info.from_data))
    return tuple(found)


def _correlation(theta: FloatArray, weight: FloatArray) -> FloatArray:
    away = theta - weight @ theta
    covariance = (away.T * weight) @ away
    sd = np.sqrt(np.maximum(np.diagonal(covariance), 1e-300))
    return np.asarray(covariance / np.outer(sd, sd), dtype=float)


def _ridges(look: Look, correlation: FloatArray) -> tuple[Ridge, ...]:
    """The sharpest ridge of each pair of quantities of which one at least is of the sensor."""
    found: dict[tuple[str, str], Ridge] = {}
    keys = [p.key for p in look.problem.parameters]
    for i, j in combinations(range(len(keys)), 2):
        one, other = keys[i], keys[j]
        pair = (one.parameter, other.parameter)
        if (
            not (set(pair) & _SENSOR)
            or set(pair) & (SCALES | {"clock_offset", "load_zero", "load_step"})
            or one.parameter == other.parameter
        ):
            continue
        size = float(correlation[i, j])
        if abs(size) > RIDGE and (pair not in found or abs(size) > abs(found[pair].correlation)):
            found[pair] = Ridge((one, other), size, _advice(*pair))
    return tuple(sorted(found.values(), key=lambda r: -abs(r.correlation))[:_MOST])


def _advice(one: str, other: str) -> str:
    for first, second, advice in _ADVICE:
        if (one in first and other in second) or (one in second and other in first):
            return advice
    return f"give {one} or {other} a narrower prior, if it can be measured" if UNKNOWNS[one].scope != "sweep" else ""
