"""A look at a posterior in, what the data will tell out: how much of each unknown, and which ones they tell only together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from calib.catalogue import SCALES, UNKNOWNS, UnknownName, unknowns_of
from calib.checks.plausible.unseen import Unseen, unseen_in
from calib.problem import columns_at, of_lot, values_of_lot
from calib.sampling import Look
from models.sensor import FloatArray

#: Correlation from which on two unknowns are said to be on a ridge.
RIDGE = 0.6
# Ridges that are told at most.
_MOST = 5
# Of the draws of what is of a lot.
_SEED = 20190304
_SENSOR = frozenset(unknowns_of("material", "specimen"))
_LENGTHS = frozenset({"sensor_thickness", "padding_thickness"})
_MODULI = frozenset({"young_modulus", "padding_young_modulus", "stiffening", "padding_poisson_ratio"})
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
class Outlook:
    """What the data will tell: of each unknown, and which ridges will be left.

    Attributes
    ----------
    unknowns : all but noises and discrepancies, those of a lot first, then in the order of the problem.
    ridges : the sharpest first.
    unseen : what would move a modulus and shows in nothing, what moves it most first.
    """

    unknowns: tuple[UnknownOutlook, ...]
    ridges: tuple[Ridge, ...]
    unseen: tuple[Unseen, ...]


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
    return Outlook((*_of_lot(look), *told), _ridges(look, _correlation(theta, weight)), unseen_in(look))


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
