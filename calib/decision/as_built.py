"""A specimen that was measured and a specification in, how probably it conforms as it was built, and what it does, out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib.checks import Member
from calib.decision.choices import coordinates_of
from calib.decision.enough_draws import monte_carlo_error
from calib.decision.performance import Errors, Refused, pressed_as_built
from calib.decision.sensors import ModelDraws, NoiseDraws
from calib.errors import Fault, InputError
from calib.experiment import Specification
from calib.problem import lookup, specimen_design
from calib.sampling import Posterior, thin_draws
from models.curves import predict_design
from models.response import Forward
from models.sensor import FloatArray

# Streams of random numbers beside the seed's: of loads and balls, of the errors of the model.
_SCATTER, _ERRORS = 7, 8


@dataclass(frozen=True)
class AsBuilt:
    """Whether a specimen conforms to a specification as it was built.

    Attributes
    ----------
    probability : [1], of conformity, p_c.
    error : its Monte Carlo standard error [1].
    accepted : whether it is: whether p_c is at least what the specification asks for.
    fails : limit in words -> share of draws outside it [1].
    not_carried : share of draws in which a load is not carried inside the model's range [1].
    consumers_risk : [1], specific: that it does not conform though it is accepted; nan if it is rejected.
    producers_risk : [1], specific: that it conforms though it is rejected; nan if it is accepted.
    """

    probability: float
    error: float
    accepted: bool
    fails: Mapping[str, float]
    not_carried: float
    consumers_risk: float
    producers_risk: float


def as_built(posterior: Posterior, forward: Forward, specification: Specification, *, n_effective: float, seed: int) -> AsBuilt:
    """Say how probably a specimen conforms, on the padding that it has, and whether it is accepted (JCGM 106:2012).

    A draw conforms if every limit holds at every load and under every ball, with the model's own error and the discrepancy as
    in `conform`. Accepted is what conforms at least as probably as was asked for, p_c >= p: the specific consumer's risk of
    what is accepted, 1 - p_c (clause 9.3.2), is then at most 1 - p. For one limit and a normal estimate of standard uncertainty
    u that is a guard band w = r U, U = 2 u, r = z_p / 2 (clause 8.3.2), 0.82 at 95 %. Tolerances, spreads and what may be
    chosen say what would be built, and do not count for what was.

    Parameters
    ----------
    posterior : of the one specimen.
    forward : its model.
    specification : what is asked.
    n_effective : how many independent draws those of the posterior are worth.
    seed : of loads and balls, and of the errors.

    Raises
    ------
    InputError
        If no model serves what is asked, or resolution is limited and no noise of a capacitance meter is known.
    """
    part = _part(posterior, forward, np.random.default_rng(seed))
    n_draw = part.size
    if any(limit.quantity == "force_resolution" for limit in specification.limits) and not np.all(np.isfinite(part.own.noise)):
        message = "force_resolution is limited, but no noise of a capacitance meter is known"
        raise InputError(Fault(message, advice="Leave it out, or calibrate the lot with capacitance"))
    z = coordinates_of(specification, n_draw, np.random.default_rng([seed, _SCATTER]))
    group = pressed_as_built(part, specification, z)
    if isinstance(group, Refused):
        raise InputError(Fault(f"no model serves what the specification asks of it: {group.why}"))
    found = next(group.at(_nominal(part), _errors(n_draw, seed), 0))
    conforms = (found.reach >= 0) & np.all(found.margins >= 0, axis=1)
    probability = float(np.mean(conforms))
    accepted = probability >= specification.probability
    outside = np.isfinite(found.margins) & (found.margins < 0)
    return AsBuilt(
        probability,
        float(monte_carlo_error(probability, n_effective)),
        accepted,
        {limit.in_words: float(share) for limit, share in zip(specification.limits, np.mean(outside, axis=0), strict=True)},
        float(np.mean(found.reach < 0)),
        1 - probability if accepted else math.nan,
        math.nan if accepted else probability,
    )


def signal_as_built(posterior: Posterior, forward: Forward, force: float, *, seed: int) -> tuple[FloatArray, FloatArray]:
    """Signal C/C0 - 1 [1] and stroke [m] of a specimen at a load, on the padding that it has, (n_draw,); nan where not carried.

    With the model's own error and the discrepancy.

    Parameters
    ----------
    posterior : of the one specimen.
    forward : its model.
    force : [N].
    seed : of the errors.
    """
    part = _part(posterior, forward, np.random.default_rng(seed))
    found = predict_design(forward, part.base, np.array([force]))
    z = np.random.default_rng([seed, _ERRORS]).standard_normal((2, part.size))
    gap = z[0] * part.own.force_discrepancy * force
    change = found.change[:, 0]
    error = np.hypot(found.change_error[:, 0], part.own.capacitance_discrepancy * change)
    return np.asarray(change - found.change_slope[:, 0] * gap + z[1] * error), np.asarray(found.depth[:, 0])


def _part(posterior: Posterior, forward: Forward, rng: np.random.Generator) -> ModelDraws:
    """The specimen in draws, with its padding over the mean of its draws."""
    n_draw = posterior.draws.shape[0] * posterior.draws.shape[1]
    values = thin_draws(posterior, n_draw, rng)
    name = posterior.experiment.specimens[0].name
    sweep = posterior.sweeps[0].name
    design = specimen_design(posterior, values, name, sweep).draws()

    def carried(parameter: str) -> FloatArray:
        known = lookup(values, parameter, name, sweep)
        return np.full(n_draw, np.nan) if known is None else known

    own = NoiseDraws(
        carried("capacitance_noise"),
        np.nan_to_num(carried("force_discrepancy")),
        np.nan_to_num(carried("capacitance_discrepancy")),
    )
    padding = np.broadcast_to(np.asarray(design.padding.thickness, dtype=float), (n_draw,))
    middle = float(np.mean(padding))
    cast = padding / middle if middle > 0 else np.ones(n_draw)
    return ModelDraws(Member("", posterior, forward, 1.0), design, own, cast)


def _nominal(part: ModelDraws) -> float:
    return float(np.mean(np.asarray(part.base.padding.thickness, dtype=float)))


def _errors(n_draw: int, seed: int) -> Errors:
    rng = np.random.default_rng([seed, _ERRORS])
    return Errors(*(rng.standard_normal((n_draw, 1)) for _ in range(3)))
