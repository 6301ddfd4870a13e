"""A quantity of specimens of one lot in, how probable their values are before the data out; and the lot's value and spread.

Of a quantity of a lot, its modulus say, with the value L and the spread tau each specimen s has a value of its own, v_s. With
m the median of what is believed of L and n_s what was wanted of the specimen over what was wanted of the first one,

    x_s = log(v_s / n_s m)   or   v_s / n_s m - 1,                                                                      (1)

as the prior of L is log-normal or normal, and likewise mu of L,

    x_s ~ N(mu, tau^2),   mu ~ N(0, sigma^2),   tau ~ p(tau).                                                           (2)

What is known of a specimen by itself, such as what a microscope read of its thickness, is r_s = x_s + N(0, e_s^2); nothing is
e_s infinite. The readings of the instruments depend on x alone, so that mu and tau need not be sampled: what is believed of x
is a mixture of normal densities,

    p(x) = int p(tau) N(x; 0, tau^2 1 + sigma^2 J) dtau  prod_s N(r_s; x_s, e_s^2) / Z,                                 (3)
    Z = int p(tau) N(r; 0, tau^2 1 + sigma^2 J + diag e^2) dtau,

J of ones, over the coordinate z of the spread's prior by the trapezoidal rule. The first factor depends on mean and scatter,

    log N = -log v / 2 - mean^2 / 2 v - (n - 1) log tau - sum (x_s - mean)^2 / 2 tau^2,   v = sigma^2 + tau^2 / n,        (4)

but for a constant. Given x, tau has the weights of (4), and mu is normal: both are drawn exactly, afterwards. Given the value
and the spread of their lot specimens are independent, and quantities are so before the data: each has a factor (3) of its own.

Coordinates z_s = (x_s - M_s) / W_s, mean and sd of (3), are as wide as what is believed of one specimen. Climbs and linear
approximations take (3) for the normal density of the same mean and covariance, which has no ridge where specimens are alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from calib.experiment import Experiment, lot_prior, nominal_ratios, own_priors, spread_prior
from calib.priors import Fixed, LogNormal, Normal, Prior, TruncatedNormal
from models.sensor import FloatArray, IntArray

# Coordinates of the spread's prior between which it is summed over, and steps between them: for densities, and for draws.
_END, _STEPS, _FINE = 6.0, 96, 768
# Draws whose spreads are drawn at a time.
_AT_ONCE = 2048
# Nothing is less than this share of what was wanted, whatever a normal distribution says.
_LEAST = 1e-3
_LOG_2_PI = math.log(2 * math.pi)


@dataclass(frozen=True, eq=False)
class LotPrior:
    """What is believed of a quantity of the specimens of one lot: (2) and (3).

    Attributes
    ----------
    value : prior of the lot's, as of its first specimen.
    spread : prior of the spread, as a share: of the value, or of the median of its prior where that is normal.
    known : of each specimen what is known of it by itself, of the kind of `value`; None for nothing.
    nominal : of each specimen what was wanted, over that of the first; all alike by default.
    """

    value: LogNormal | Normal
    spread: Prior
    known: tuple[LogNormal | Normal | None, ...]
    nominal: tuple[float, ...] = ()

    @property
    def n(self) -> int:
        """How many specimens there are."""
        return len(self.known)

    @cached_property
    def sd(self) -> float:
        """How wide the lot's value is believed to be, as a share of it or in its logarithm: sigma of (2)."""
        return math.log(self.value.factor) if isinstance(self.value, LogNormal) else self.value.sd / self.value.mean

    @cached_property
    def specimen_priors(self) -> tuple[Prior, ...]:
        """What is believed of each specimen, by mean and sd of (3): the priors of their coordinates."""
        middle, width = self._moments[0], self._widths
        if isinstance(self.value, LogNormal):
            at = self._reference * np.exp(middle)
            return tuple(LogNormal(float(v), float(f)) for v, f in zip(at, np.exp(width), strict=True))
        at, sd = self._reference * (1 + middle), self._reference * width
        return tuple(as_prior(Normal(float(v), float(s))) for v, s in zip(at, sd, strict=True))

    @cached_property
    def before(self) -> Prior:
        """What is believed of the lot's value given what is known of specimens by themselves, by mean and sd of mu."""
        if not any(self.known):
            return as_prior(self.value)
        spread, log_weight = self._spreads
        weight = np.exp(log_weight + self._log_read(spread) - self._log_evidence)
        precision, expected = self._mean_given(spread)
        middle = float(weight @ expected)
        width = math.sqrt(float(weight @ ((expected - middle) ** 2 + 1 / precision)))
        first = self._reference[0]
        if isinstance(self.value, LogNormal):
            return LogNormal(float(first) * math.exp(middle), math.exp(width))
        return as_prior(Normal(float(first) * (1 + middle), float(first) * width))

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance (n, n) of the coordinates z."""
        return np.asarray(self._moments[1] / np.outer(self._widths, self._widths), dtype=float)

    def away(self, z: FloatArray) -> FloatArray:
        """How far specimens at z are from the middle of what is believed of the lot: x of (1); both (n_draw, n_specimen)."""
        return np.asarray(self._moments[0] + self._widths * z, dtype=float)

    def at(self, away: FloatArray, specimen: int | None = None) -> FloatArray:
        """Values [SI] of specimens that are so far from the middle of what is believed of the lot, by x of (1).

        Parameters
        ----------
        away : (n_draw,).
        specimen : whose; None for the lot's, as of its first specimen.
        """
        share = np.exp(away) if isinstance(self.value, LogNormal) else np.maximum(1 + away, _LEAST)
        return np.asarray(self._reference[0 if specimen is None else specimen] * share, dtype=float)

    def away_of(self, value: FloatArray, specimen: int | None = None) -> FloatArray:
        """How far values are from the middle of what is believed of the lot: x of (1), the inverse of `at`.

        Parameters
        ----------
        value : (n_draw,), SI.
        specimen : whose; None for the lot's.
        """
        share = value / self._reference[0 if specimen is None else specimen]
        return np.asarray(np.log(share) if isinstance(self.value, LogNormal) else share - 1, dtype=float)

    def log_density(self, z: FloatArray) -> FloatArray:
        """Logarithm of (3) as a density of the coordinates z (n_draw, n_specimen), (n_draw,)."""
        n, x = self.n, self.away(z)
        of_lot = logsumexp(self._log_terms(x, *self._spreads), axis=1) - 0.5 * (n * _LOG_2_PI + math.log(n))
        with np.errstate(over="ignore", invalid="ignore"):
            by_itself = np.sum(self._log_known(x), axis=1)
        return np.asarray(of_lot + by_itself - self._log_evidence + np.sum(np.log(self._widths)), dtype=float)

    def log_given(self, z: FloatArray, mean: FloatArray, spread: FloatArray) -> FloatArray:
        """Log density of z (n_draw, n_specimen) specimen by specimen, given mu and tau, but for what these add.

        Parameters
        ----------
        z : coordinates of the specimens.
        mean, spread : mu and tau, (n_draw,).
        """
        x = self.away(z)
        return np.asarray(-0.5 * ((x - mean[:, None]) / spread[:, None]) ** 2 + self._log_known(x), dtype=float)

    def draw_of(self, z: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Draw the lot's value [SI] and spread [1] given the specimens, (n_draw,) each.

        Parameters
        ----------
        z : (n_draw, n_specimen), coordinates of the specimens.
        rng : of the draws.
        """
        x = self.away(z)
        spread = np.concatenate([self._spread_of(x[first : first + _AT_ONCE], rng) for first in range(0, len(x), _AT_ONCE)])
        error = spread**2 / self.n
        share = self.sd**2 / (self.sd**2 + error)
        mean = share * np.mean(x, axis=1) + np.sqrt(share * error) * rng.standard_normal(len(x))
        return self.at(mean), spread

    def draw(self, rng: np.random.Generator, n_draw: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Draw a lot with its specimens from (2), given what is known of each of these.

        Parameters
        ----------
        rng : of the draws.
        n_draw : how many lots.

        Returns
        -------
        Coordinates z of the specimens (n_draw, n), value [SI] and spread [1] of the lot, (n_draw,) each.
        """
        spread = self._spread_before(rng, n_draw)
        precision, expected = self._mean_given(spread)
        mean = expected + rng.standard_normal(n_draw) / np.sqrt(precision)
        gain = self._gains(spread)
        centre = gain * mean[:, None] + (1 - gain) * self._read
        x = centre + np.sqrt(gain) * spread[:, None] * rng.standard_normal((n_draw, self.n))
        return (x - self._moments[0]) / self._widths, self.at(mean), spread

    def another(self, value: FloatArray, away: FloatArray, specimen: int) -> FloatArray:
        """One more specimen for each lot, (n_draw,), SI.

        Parameters
        ----------
        value : of the lot, (n_draw,), SI.
        away : how far it is off that, x - mu of (2), (n_draw,).
        specimen : number of the one that it was meant to be like.
        """
        return self.at(self.away_of(value) + away, specimen)

    # --- arrays of the specimens ---

    @cached_property
    def _reference(self) -> FloatArray:
        """n_s m of (1), (n_specimen,), SI."""
        median = self.value.median if isinstance(self.value, LogNormal) else self.value.mean
        return median * np.array(self.nominal or (1.0,) * self.n)

    @cached_property
    def _read(self) -> FloatArray:
        """r_s of (3), (n_specimen,); 0 where nothing is known."""
        return np.array([self._in_x(known, m)[0] for known, m in zip(self.known, self._reference, strict=True)])

    @cached_property
    def _error(self) -> FloatArray:
        """e_s of (3), (n_specimen,); infinite where nothing is known."""
        return np.array([self._in_x(known, m)[1] for known, m in zip(self.known, self._reference, strict=True)])

    @staticmethod
    def _in_x(known: LogNormal | Normal | None, reference: float) -> tuple[float, float]:
        if known is None:
            return 0.0, math.inf
        if isinstance(known, LogNormal):
            return math.log(known.median / reference), math.log(known.factor)
        return known.mean / reference - 1, known.sd / reference

    @cached_property
    def _widths(self) -> FloatArray:
        return np.sqrt(np.diagonal(self._moments[1]))

    # --- sums over the spread ---

    @cached_property
    def _spreads(self) -> tuple[FloatArray, FloatArray]:
        """Spreads, and logarithms of their weights, which sum to 1, (n_node,) each."""
        if isinstance(self.spread, Fixed):
            return np.array([self.spread.value]), np.zeros(1)
        z = np.linspace(-_END, _END, _STEPS + 1)
        log_weight = -0.5 * z**2
        return self.spread.ppf_normal(z), log_weight - logsumexp(log_weight)

    @cached_property
    def _log_evidence(self) -> float:
        """Log Z of (3)."""
        spread, log_weight = self._spreads
        return float(logsumexp(log_weight + self._log_read(spread)))

    @cached_property
    def _moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean (n,) and covariance (n, n) of x by (3)."""
        spread, log_weight = self._spreads
        weight = np.exp(log_weight + self._log_read(spread) - self._log_evidence)
        precision, expected = self._mean_given(spread)
        gain = self._gains(spread)
        centre = gain * expected[:, None] + (1 - gain) * self._read
        middle = weight @ centre
        off, along = centre - middle, gain / np.sqrt(precision)[:, None]
        scatter = (off.T * weight) @ off + (along.T * weight) @ along
        return middle, scatter + np.diag(weight @ (gain * spread[:, None] ** 2))

    def _gains(self, spread: FloatArray) -> FloatArray:
        """How much a specimen follows its lot rather than what is known of it by itself, (n_spread, n_specimen)."""
        return np.asarray(1 / (1 + (spread[:, None] / self._error) ** 2), dtype=float)

    def _mean_given(self, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Precision and mean of mu given a spread and what is known of the specimens, (n_spread,) each."""
        told = 1 / (spread[:, None] ** 2 + self._error**2)
        precision = 1 / self.sd**2 + np.sum(told, axis=1)
        return precision, told @ self._read / precision

    def _log_read(self, spread: FloatArray) -> FloatArray:
        """Log density of what is known of the specimens given a spread, (n_spread,)."""
        there = np.isfinite(self._error)
        variance = spread[:, None] ** 2 + self._error[there] ** 2
        read = self._read[there]
        precision, expected = self._mean_given(spread)
        square = np.sum(read**2 / variance, axis=1) - precision * expected**2
        log_det = np.sum(np.log(variance), axis=1) + np.log(precision * self.sd**2)
        return np.asarray(-0.5 * (log_det + square + read.size * _LOG_2_PI), dtype=float)

    def _log_known(self, x: FloatArray) -> FloatArray:
        """Log density of what is known of each specimen by itself, at x, (n_draw, n_specimen); 0 for nothing."""
        there = np.isfinite(self._error)
        constant = np.where(there, np.log(np.where(there, self._error, 1.0)) + 0.5 * _LOG_2_PI, 0.0)
        return np.asarray(-0.5 * ((x - self._read) / self._error) ** 2 - constant, dtype=float)

    def _log_terms(self, x: FloatArray, spread: FloatArray, log_weight: FloatArray) -> FloatArray:
        """Equation (4) of each spread but for a constant, with the logarithm of its weight, (n_draw, n_node)."""
        n = self.n
        variance = self.sd**2 + spread**2 / n
        middle = np.mean(x, axis=1, keepdims=True)
        # Far out on a ladder of steps an unknown may be as large as no number is.
        with np.errstate(over="ignore", invalid="ignore"):
            scatter = np.sum((x - middle) ** 2, axis=1)
            constant = log_weight - 0.5 * np.log(variance) - (n - 1) * np.log(spread)
            return np.asarray(
                constant - 0.5 * (np.outer(middle[:, 0] ** 2, 1 / variance) + np.outer(scatter, 1 / spread**2)), dtype=float
            )

    def _spread_of(self, x: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Spreads (n_draw,) given the specimens: even within each of many cells, as many as their weights say."""
        u = rng.random((2, len(x)))
        if isinstance(self.spread, Fixed):
            return np.full(len(x), self.spread.value)
        edges, spread, log_weight = self._cells
        terms = self._log_terms(x, spread, log_weight)
        below = np.cumsum(np.exp(terms - np.max(terms, axis=1, keepdims=True)), axis=1)
        cell = np.minimum(np.sum(below < u[:1].T * below[:, -1:], axis=1), _FINE - 1)
        return self.spread.ppf_normal(edges[cell] + u[1] * (edges[1] - edges[0]))

    def _spread_before(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """Spreads (n_draw,) given what is known of the specimens by itself alone."""
        if isinstance(self.spread, Fixed):
            return np.full(n_draw, self.spread.value)
        edges, spread, log_weight = self._cells
        terms = log_weight + self._log_read(spread)
        below = np.cumsum(np.exp(terms - np.max(terms)))
        cell = np.minimum(np.searchsorted(below, below[-1] * rng.random(n_draw)), _FINE - 1)
        return self.spread.ppf_normal(edges[cell] + (edges[1] - edges[0]) * rng.random(n_draw))

    @cached_property
    def _cells(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Ends of cells of the coordinate of the spread's prior, the spreads in their middles, and their log weights."""
        edges = np.linspace(-_END, _END, _FINE + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        return edges, self.spread.ppf_normal(middles), -0.5 * middles**2


def as_prior(pooled: LogNormal | Normal) -> Prior:
    """A prior of a quantity that is positive: a normal one is cut off at zero, as next to nothing of it lies below."""
    return pooled if isinstance(pooled, LogNormal) else TruncatedNormal(pooled.mean, pooled.sd, 0.0, math.inf)


@dataclass(frozen=True, eq=False)
class Lot:
    """One quantity of the specimens of a lot among the unknowns.

    Attributes
    ----------
    quantity : one of `calib.catalogue.POOLED`.
    prior : what is believed of them.
    columns : (n_specimen,), the numbers of theirs in the order of z.
    """

    quantity: str
    prior: LotPrior
    columns: IntArray

    @cached_property
    def bend(self) -> FloatArray:
        """What the specimens' being alike adds to the curvature of -log prior in their coordinates, (n, n), taken as normal."""
        return np.asarray(np.linalg.inv(self.prior.covariance) - np.eye(self.columns.size), dtype=float)

    def log_ratio(self, z: FloatArray) -> FloatArray:
        """Logarithm of (3) over the standard normal density of the same coordinates, (n_draw,); z has all unknowns."""
        own = z[:, self.columns]
        with np.errstate(over="ignore", invalid="ignore"):
            standard = -0.5 * (np.sum(own**2, axis=1) + own.shape[1] * _LOG_2_PI)
            ratio = self.prior.log_density(own) - standard
            return np.asarray(np.where(np.isnan(ratio), -np.inf, ratio), dtype=float)

    def log_ratio_as_normal(self, z: FloatArray) -> FloatArray:
        """As `log_ratio`, of the normal density of the same covariance, (n_draw,)."""
        own = z[:, self.columns]
        log_det = np.linalg.slogdet(self.prior.covariance)[1]
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(-0.5 * (np.sum(own @ self.bend * own, axis=1) + log_det), dtype=float)


def lot_of(experiment: Experiment, quantity: str, specimens: Sequence[str]) -> LotPrior:
    """What an experiment believes of a quantity of the specimens of its lot.

    Parameters
    ----------
    experiment : under partial pooling.
    quantity : one of `calib.catalogue.POOLED`.
    specimens : names of those that have it.
    """
    value, _ = lot_prior(experiment, quantity, specimens)
    known = own_priors(experiment, quantity, specimens)
    return LotPrior(value, spread_prior(experiment, quantity), known, nominal_ratios(experiment, quantity, specimens))
