"""Models of the same data in, the likely ones first and which are ruled out beyond doubt out: nothing is sampled."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.checks.departures import problem_under, values_near
from calib.checks.plausible.conflicts import conflicts_in
from calib.errors import InputError
from calib.experiment import Variant, model_in_words
from calib.problem import Problem, columns_at
from calib.sampling import Look, log_evidence_at, look_at

#: A model is ruled out beyond doubt where the data are so many times less probable under it, as a logarithm (10^22 times), than
#: under one whose first answer can be trusted: second climbs gained 11 at most, in 14 labs of `benchmarks/simulated`.
BEYOND_DOUBT = 50.0
# Effective draws from which an evidence can be trusted.
_TRUSTED = 100.0


@dataclass(frozen=True)
class Standing:
    """How a model stands with the data before it is sampled.

    Attributes
    ----------
    variant : the model.
    model : in words.
    log_bayes : logarithm of how many times as probable the data are under it as under the foremost; nan where not known.
    foremost : name of the model that it is held against; "" where no first answer can be trusted.
    ruled_out : whether it is not worth sampling.
    """

    variant: Variant
    model: str
    log_bayes: float
    foremost: str
    ruled_out: bool

    @property
    def in_words(self) -> str:
        """Its name, what it is, and the factor."""
        told = f"{self.variant.name} ({self.model})"
        if math.isnan(self.log_bayes) or self.log_bayes == 0:
            return told
        size = -self.log_bayes
        factor = f"{math.exp(size):.2g}" if size < 11 else f"10^{size / math.log(10):.0f}"
        return f"{told}, under which the data are {factor} times less probable than under {self.foremost}"


def standings(
    problem: Problem, variants: Sequence[Variant], told: Callable[[Variant, int, int], None] = lambda *_: None
) -> tuple[Standing, ...]:
    """Hold models against the data by their first answers, each of which takes seconds.

    The evidence of each is that of the first answer. A model is ruled out if it has less by `BEYOND_DOUBT` than the foremost
    one that can be trusted: its mode describes the readings or was met by two climbs, contradicts nothing that was believed,
    and has a hundred effective draws. The hopeless one has as little from the foremost one's values and by Laplace's method.

    Parameters
    ----------
    problem : of the experiment as it is given.
    variants : the models.
    told : called before each with the model, its number and how many there are.

    Returns
    -------
    The likely first, then those of which nothing is known, then what is ruled out. With the finite elements, of which a first
    answer takes hours, all in the order given.
    """
    named = {variant.name: model_in_words(variant.of(problem.experiment)) for variant in variants}
    if problem.experiment.model == "fem":
        return tuple(Standing(variant, named[variant.name], math.nan, "", False) for variant in variants)
    looks: dict[str, Look] = {}
    near: Mapping[str, float] | None = None
    for k, variant in enumerate(variants, 1):
        told(variant, k, len(variants))
        if (look := _looked(problem, variant, near)) is not None:
            looks[variant.name] = look
            near = _values(look) if near is None else near
    trusted = {name: look for name, look in looks.items() if _can_be_trusted(look)}
    known = {name: look.log_evidence for name, look in looks.items()}
    if not trusted:
        order = sorted(variants, key=lambda v: -known.get(v.name, -math.inf))
        return tuple(Standing(variant, named[variant.name], math.nan, "", False) for variant in order)
    foremost = max(trusted, key=lambda name: known[name])
    found = []
    for variant in variants:
        most = _most(problem, variant, looks, trusted[foremost], known[foremost])
        log_bayes = most - known[foremost]
        out = log_bayes < -BEYOND_DOUBT
        found.append(Standing(variant, named[variant.name], log_bayes, foremost, out))
    return tuple(sorted(found, key=lambda s: (s.ruled_out, math.isnan(s.log_bayes), -np.nan_to_num(s.log_bayes))))


def _looked(problem: Problem, variant: Variant, near: Mapping[str, float] | None) -> Look | None:
    """A look at the data under a model; None if there is none, as where the model does not cover what was measured."""
    try:
        return look_at(problem if not variant.changes else problem_under(problem, variant), near)
    except (InputError, ValueError):
        return None


def _values(look: Look) -> dict[str, float]:
    mean = look.weight @ columns_at(look.problem, look.theta)
    return values_near(dict(zip(look.problem.names, mean.tolist(), strict=True)))


def _can_be_trusted(look: Look) -> bool:
    return look.confirmed and look.effective_draws >= _TRUSTED and not conflicts_in(look).wrong


def _most(problem: Problem, variant: Variant, looks: Mapping[str, Look], foremost: Look, top: float) -> float:
    """The most that the log evidence of a model may be, by a second look at what seems hopeless; nan where it is not known."""
    look = looks.get(variant.name)
    if look is None:
        return math.nan
    if look is foremost or look.log_evidence > top - BEYOND_DOUBT:
        return look.log_evidence
    again = _looked(problem, variant, _values(foremost))
    both = [one for one in (look, again) if one is not None]
    return max(value for one in both for value in (one.log_evidence, log_evidence_at(one.space, one.mode)))
