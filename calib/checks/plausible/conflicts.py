"""A look at a posterior in, how far it lies from the priors out: each unknown, each scale, and all of them together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtri_exp

from calib.catalogue import SCALES
from calib.checks.ends import ends_that_cut
from calib.checks.verdict import Reason
from calib.problem import ParameterInfo, prior_covariance
from calib.sampling import Look
from models.sensor import FloatArray

#: Distances, in standard deviations, beyond which something is in the way of the priors, and beyond which they are wrong.
DOUBTFUL, WRONG = 3.9, 6.0
#: The same for scales, that is, noises and discrepancies, as z of their priors.
HIGH_SCALE, WRONG_SCALE = 3.0, 5.0
#: Distance from which on other readings of the data are tried: as of one in twenty sound labs.
SUSPICIOUS, SUSPICIOUS_ALONE, SUSPICIOUS_SCALE = 1.6, 2.5, 1.5
# An unknown or a direction is learned if its variance is less than this share of the prior's.
_LEARNED = 0.5


@dataclass(frozen=True)
class Conflict:
    """One unknown that comes out where its prior did not expect it.

    Attributes
    ----------
    parameter : which unknown.
    mean : of its posterior, SI.
    expected : between which values 95 % of its prior lie, SI.
    away : how far it is out of the way, in standard deviations of what may be found if its prior is right.
    """

    parameter: ParameterInfo
    mean: float
    expected: tuple[float, float]
    away: float

    @property
    def is_scale(self) -> bool:
        """Whether it is a noise or a discrepancy."""
        return self.parameter.parameter in SCALES


@dataclass(frozen=True)
class Conflicts:
    """How far a posterior lies from its priors.

    Attributes
    ----------
    unknowns : of each unknown that the data tell something of, the worst first.
    cut : what is said of unknowns whose posterior is cut by the end of a prior.
    together : distance of all unknowns but the scales at once, as standard deviations of one normal number.
    misfit : distance of the misfit at the mode from its expectation, likewise.
    """

    unknowns: tuple[Conflict, ...]
    cut: tuple[Reason, ...]
    together: float
    misfit: float

    @property
    def wrong(self) -> bool:
        """Whether data and priors cannot both be right."""
        limits = ((WRONG_SCALE if c.is_scale else WRONG, abs(c.away)) for c in self.unknowns)
        return max(self.together, self.misfit) > WRONG or any(away > limit for limit, away in limits)

    @property
    def suspicious(self) -> bool:
        """Whether other readings of the data are worth a look."""
        scales = max((c.away for c in self.unknowns if c.is_scale), default=0.0)
        others = max((abs(c.away) for c in self.unknowns if not c.is_scale), default=0.0)
        together = max(self.together, self.misfit)
        return bool(self.cut) or together > SUSPICIOUS or scales > SUSPICIOUS_SCALE or others > SUSPICIOUS_ALONE


def conflicts_in(look: Look) -> Conflicts:
    """Measure how surprising a posterior is for those who believed in the priors.

    The coordinates z of the truth are standard normal before the data (of specimens of one lot, which are alike, others are
    taken for them that are). If the priors are right, posterior means m of z, with
    posterior covariance S, are therefore normal with covariance 1 - S (the law of total variance). So in a direction v that the
    data tell of, v.m / sqrt(v.(1 - S) v) is a standard-normal number, and the squares over all such directions add up to a
    chi square. Scales count on one side alone: a sound lab may well be less noisy than was feared.
    """
    problem, theta, weight = look.problem, look.theta, look.weight
    mean = weight @ theta
    away = theta - mean
    covariance = (away.T * weight) @ away
    variance = np.diagonal(covariance)
    scale = np.array([p.parameter in SCALES for p in problem.parameters])
    believed = prior_covariance(problem, mean.size)
    found: list[Conflict] = []
    cut: list[Reason] = []
    for k, parameter in enumerate(problem.parameters):
        told = 1 - variance[k]
        if scale[k]:
            found.append(_conflict(parameter, mean[k], max(mean[k], 0.0)))
        elif told > _LEARNED:
            found.append(_conflict(parameter, mean[k], mean[k] / np.sqrt(told)))
            values = parameter.prior.ppf_normal(theta[:, k])
            middle = float(weight @ values)
            cut += ends_that_cut(parameter, middle, float(np.sqrt(weight @ (values - middle) ** 2)))
    rest = np.flatnonzero(~scale)
    among = np.ix_(rest, rest)
    together = _together(mean[rest], covariance[among], believed[among]) if rest.size else 0.0
    by_size = tuple(sorted(found, key=lambda c: -abs(c.away)))
    return Conflicts(by_size, tuple(cut), together, _as_normal(look.misfit, look.n_point))


def _conflict(parameter: ParameterInfo, z: float, away: float) -> Conflict:
    low, high = parameter.prior.interval(0.95)
    return Conflict(parameter, float(parameter.prior.ppf_normal(z)), (low, high), float(away))


def _together(mean: FloatArray, covariance: FloatArray, believed: FloatArray) -> float:
    if not np.array_equal(believed, np.eye(mean.size)):  # in coordinates that are independent before the data
        root = np.linalg.cholesky(believed)
        mean = np.linalg.solve(root, mean)
        covariance = np.linalg.solve(root, np.linalg.solve(root, covariance).T)
    value, vector = np.linalg.eigh(covariance)
    told = value < _LEARNED
    along = (vector.T @ mean)[told]
    return _as_normal(float(np.sum(along**2 / (1 - value[told]))), int(np.sum(told)))


def _as_normal(chi_square: float, n: int) -> float:
    """The standard-normal number that is as rarely exceeded as a chi square of n degrees of freedom."""
    if n == 0:
        return 0.0
    rarity = max(float(chdtrc(n, chi_square)), 1e-300)
    return float(-ndtri_exp(np.log(rarity)))
