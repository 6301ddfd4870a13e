"""Moduli of specimens of one lot in, how probable they are before the data out; and the lot's modulus and spread given them.

Of a lot with the modulus L and the spread tau each specimen s has a modulus of its own, x_s its logarithm,

    x_s ~ N(mu, tau^2),   mu = log L ~ N(m, sigma^2),   tau ~ p(tau).                                                   (1)

The readings depend on x alone, so that mu and tau need not be sampled: what is believed of x is a mixture of normal densities,

    p(x) = int p(tau) N(x; m, tau^2 1 + sigma^2 J) dtau,                                                                (2)

J of ones, over the coordinate z of the spread's prior by the trapezoidal rule. It depends on the mean and the scatter of x,

    log N = -log v / 2 - (mean - m)^2 / 2 v - (n - 1) log tau - sum (x_s - mean)^2 / 2 tau^2,   v = sigma^2 + tau^2 / n,   (3)

but for a constant.

Given x, tau has the weights of (2), and mu is normal: both are drawn exactly, afterwards.

Coordinates z_s = (x_s - m) / w, w^2 = sigma^2 + E tau^2, are as wide as what is believed of one specimen by itself. Climbs and
linear approximations take (2) for the normal density of the same covariance, which has no ridge where specimens are alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from calib.experiment import Experiment, lot_prior, spread_prior
from calib.priors import Fixed, LogNormal, Prior
from models.sensor import FloatArray, IntArray

# Coordinates of the spread's prior between which it is summed over, and steps between them: for densities, and for draws.
_END, _STEPS, _FINE = 6.0, 96, 768
# Draws whose spreads are drawn at a time.
_AT_ONCE = 2048
_LOG_2_PI = math.log(2 * math.pi)


@dataclass(frozen=True, eq=False)
class LotPrior:
    """What is believed of the moduli of specimens of one lot: (1) and (2).

    Attributes
    ----------
    modulus : prior of the lot's.
    spread : prior of the spread.
    """

    modulus: LogNormal
    spread: Prior

    @cached_property
    def sd(self) -> float:
        """Sigma, the standard deviation of the logarithm of the lot's modulus."""
        return math.log(self.modulus.factor)

    @cached_property
    def own(self) -> LogNormal:
        """What is believed of one specimen, by the width of its logarithm: that of its coordinate."""
        spread, log_weight = self._spreads
        return LogNormal(self.modulus.median, math.exp(math.sqrt(self.sd**2 + float(np.exp(log_weight) @ spread**2))))

    @cached_property
    def alike(self) -> float:
        """Correlation of the logarithms of the moduli of two specimens."""
        return (self.sd / math.log(self.own.factor)) ** 2

    def covariance(self, n: int) -> FloatArray:
        """Covariance (n, n) of the coordinates z of n specimens."""
        return np.full((n, n), self.alike) + (1 - self.alike) * np.eye(n)

    def log_density(self, z: FloatArray) -> FloatArray:
        """Logarithm of (2) as a density of the coordinates z (n_draw, n_specimen), (n_draw,)."""
        n = z.shape[1]
        found = logsumexp(self._log_terms(z, *self._spreads), axis=1)
        return np.asarray(found + n * (math.log(math.log(self.own.factor)) - 0.5 * _LOG_2_PI) - 0.5 * math.log(n), dtype=float)

    def draw_of(self, z: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Draw the lot's modulus [Pa] and spread [1] given the specimens, (n_draw,) each.

        Parameters
        ----------
        z : (n_draw, n_specimen), coordinates of the specimens.
        rng : of the draws.
        """
        spread = np.concatenate([self._spread_of(z[first : first + _AT_ONCE], rng) for first in range(0, len(z), _AT_ONCE)])
        error = spread**2 / z.shape[1]
        share = self.sd**2 / (self.sd**2 + error)
        mean = math.log(self.own.factor) * np.mean(z, axis=1)
        away = share * mean + np.sqrt(share * error) * rng.standard_normal(len(z))
        return self.modulus.median * np.exp(away), spread

    def draw(self, n: int, rng: np.random.Generator, n_draw: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Draw a lot with its specimens from (1).

        Parameters
        ----------
        n : how many specimens.
        rng : of the draws.
        n_draw : how many lots.

        Returns
        -------
        Coordinates of the specimens (n_draw, n), modulus [Pa] and spread [1] of the lot, (n_draw,) each.
        """
        of_lot, of_spread = rng.standard_normal((2, n_draw))
        spread = self.spread.ppf_normal(of_spread)
        away = self.sd * of_lot[:, None] + spread[:, None] * rng.standard_normal((n_draw, n))
        return away / math.log(self.own.factor), self.modulus.ppf_normal(of_lot), spread

    @cached_property
    def _spreads(self) -> tuple[FloatArray, FloatArray]:
        """Spreads, and logarithms of their weights, which sum to 1, (n_node,) each."""
        if isinstance(self.spread, Fixed):
            return np.array([self.spread.value]), np.zeros(1)
        z = np.linspace(-_END, _END, _STEPS + 1)
        log_weight = -0.5 * z**2
        return self.spread.ppf_normal(z), log_weight - logsumexp(log_weight)

    def _log_terms(self, z: FloatArray, spread: FloatArray, log_weight: FloatArray) -> FloatArray:
        """Equation (3) of each spread but for a constant, with the logarithm of its weight, (n_draw, n_node)."""
        width, n = math.log(self.own.factor), z.shape[1]
        variance = self.sd**2 + spread**2 / n
        middle = np.mean(z, axis=1, keepdims=True)
        # Far out on a ladder of steps an unknown may be as large as no number is.
        with np.errstate(over="ignore", invalid="ignore"):
            scatter = width**2 * np.sum((z - middle) ** 2, axis=1)
            away = (width * middle[:, 0]) ** 2
            constant = log_weight - 0.5 * np.log(variance) - (n - 1) * np.log(spread)
            return np.asarray(constant - 0.5 * (np.outer(away, 1 / variance) + np.outer(scatter, 1 / spread**2)), dtype=float)

    def _spread_of(self, z: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Spreads (n_draw,) given the specimens: even within each of many cells, as many as their weights say."""
        u = rng.random((2, len(z)))
        if isinstance(self.spread, Fixed):
            return np.full(len(z), self.spread.value)
        edges = np.linspace(-_END, _END, _FINE + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        terms = self._log_terms(z, self.spread.ppf_normal(middles), -0.5 * middles**2)
        below = np.cumsum(np.exp(terms - np.max(terms, axis=1, keepdims=True)), axis=1)
        cell = np.minimum(np.sum(below < u[:1].T * below[:, -1:], axis=1), _FINE - 1)
        return self.spread.ppf_normal(edges[cell] + u[1] * (edges[1] - edges[0]))


@dataclass(frozen=True, eq=False)
class Lot:
    """The specimens of a lot among the unknowns.

    Attributes
    ----------
    prior : what is believed of them.
    columns : (n_specimen,), numbers of their moduli in the order of z.
    """

    prior: LotPrior
    columns: IntArray

    @cached_property
    def bend(self) -> FloatArray:
        """What the specimens' being alike adds to the curvature of -log prior in their coordinates, (n, n), taken as normal."""
        n = self.columns.size
        return np.asarray(np.linalg.inv(self.prior.covariance(n)) - np.eye(n), dtype=float)

    def log_ratio(self, z: FloatArray) -> FloatArray:
        """Logarithm of (2) over the standard normal density of the same coordinates, (n_draw,); z has all unknowns."""
        own = z[:, self.columns]
        with np.errstate(over="ignore", invalid="ignore"):
            standard = -0.5 * (np.sum(own**2, axis=1) + own.shape[1] * _LOG_2_PI)
            ratio = self.prior.log_density(own) - standard
            return np.asarray(np.where(np.isnan(ratio), -np.inf, ratio), dtype=float)

    def log_ratio_as_normal(self, z: FloatArray) -> FloatArray:
        """As `log_ratio`, of the normal density of the same covariance, (n_draw,)."""
        own = z[:, self.columns]
        log_det = np.linalg.slogdet(self.prior.covariance(own.shape[1]))[1]
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(-0.5 * (np.sum(own @ self.bend * own, axis=1) + log_det), dtype=float)


def lot_of(experiment: Experiment) -> LotPrior | None:
    """What an experiment believes of the moduli of its specimens; None where they share one."""
    if experiment.pooling == "complete":
        return None
    return LotPrior(lot_prior(experiment), spread_prior(experiment))
