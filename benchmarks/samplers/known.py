"""A density that can be drawn from exactly in, a `Target` with its true moments and the errors of a sample of it out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import kurtosis, norm

from calib.sampling.funnel import Indices
from calib.sampling.target import Mode, Tie
from models.sensor import BoolArray, FloatArray

#: Exact draws that the moments are taken from.
N_EXACT = 200_000
# An unknown with a greater kurtosis (normal: 3) is compared by the normal scores of its values: its sd has errors of its own.
_HEAVY = 5.0
# Step of differences, and of a climb that ends: its gain in log density.
_STEP, _GAIN = 1e-4, 1e-3


@dataclass(frozen=True, eq=False)
class Known:
    """A `Target` in n coordinates that can be drawn from exactly.

    Attributes
    ----------
    name : in words.
    exact : draws of it, (n_draw, n), for a generator and n_draw.
    density : log density (n_draw,) at x (n_draw, n), up to a constant.
    prior : sd and mean of a normal prior, (2, n), that its climbs start from.
    scales : coordinates that set the widths of others.
    modes : number of the mode that each of x (n_draw, n) belongs to, (n_draw,); None if there is one.
    groups : columns that are independent of those of other groups, given those in none.
    parts : log density in parts, (n_draw, 1 + n_group), where there are groups.
    alike : columns of one quantity each, of all groups, where they are tied.
    ends : (n, 2), of values that the coordinates are normal scores of, see `Target`; None if there are none.
    good : whether a sampler is expected to converge on it.
    counted : evaluations so far, one number.
    """

    name: str
    exact: Callable[[np.random.Generator, int], FloatArray]
    density: Callable[[FloatArray], FloatArray]
    prior: FloatArray
    scales: tuple[int, ...] = ()
    modes: Callable[[FloatArray], FloatArray] | None = None
    groups: tuple[Indices, ...] = ()
    parts: Callable[[FloatArray], FloatArray] | None = None
    alike: tuple[Indices, ...] = ()
    ends: FloatArray | None = None
    good: bool = True
    counted: list[int] = field(default_factory=lambda: [0])

    @property
    def n(self) -> int:
        """Unknowns."""
        return int(self.prior.shape[1])

    @property
    def names(self) -> tuple[str, ...]:
        """See `Target`."""
        return tuple(f"x{k}" for k in range(self.n))

    def places(self, rng: np.random.Generator, n_draw: int) -> FloatArray:
        """See `Target`."""
        return np.asarray(self.prior[1] + self.prior[0] * rng.standard_normal((n_draw, self.n)), dtype=float)

    def log_density(self, x: FloatArray) -> FloatArray:
        """See `Target`."""
        self.counted[0] += x.shape[0]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return np.nan_to_num(self.density(x), nan=-np.inf, posinf=-np.inf, neginf=-np.inf)

    def log_parts(self, x: FloatArray) -> FloatArray:
        """See `Target`."""
        if self.parts is None:
            return self.log_density(x)[:, None]
        self.counted[0] += x.shape[0]
        return self.parts(x)

    def tie(self, x: FloatArray, random: np.random.RandomState) -> Tie | None:
        """See `Target`: nothing ties its groups."""
        return None

    def climb(self, x: FloatArray, known: Sequence[Mode]) -> Mode:
        """See `Target`; by Newton steps with derivatives by differences."""
        width = self.prior[0] * _STEP
        value = float(self.log_density(x[None])[0])
        curvature = np.diag(self.prior[0] ** -2.0)
        for _ in range(200):
            gradient, curvature = self._derivatives(x, value, width)
            eigen, axes = np.linalg.eigh(curvature)
            step = axes @ ((axes.T @ gradient) / np.maximum(np.abs(eigen), 1e-12 * np.max(np.abs(eigen)) + 1e-300))
            tried = x + 0.5 ** np.arange(-1, 20)[:, None] * step
            values = self.log_density(tried)
            best = int(np.argmax(values))
            if not values[best] > value + _GAIN:
                break
            x, value = tried[best], float(values[best])
        wide = self.prior[0]
        eigen, axes = np.linalg.eigh(wide[:, None] * curvature * wide)
        factor = wide[:, None] * axes / np.sqrt(np.maximum(eigen, 1.0))  # in no direction wider than the prior
        for mode in known:
            off = np.linalg.solve(mode.factor, x - mode.x)
            if abs(value - mode.log_density) < 0.1 and off @ off < 0.2 * self.n:
                return mode
        return Mode(x, value, factor)

    def sketch(self, mode: Mode, random: np.random.RandomState) -> None:
        """See `Target`: there is none."""

    def _derivatives(self, x: FloatArray, value: float, width: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gradient, and minus the second derivatives, by central differences; across a hard bound those of the prior."""
        n = self.n
        i, j = np.triu_indices(n, 1)
        unit = np.diag(width)
        pairs = unit[i] + unit[j]
        values = self.log_density(x + np.concatenate([unit, -unit, pairs, -pairs]))
        up, down, both, neither = np.split(values, [n, 2 * n, 2 * n + i.size])
        with np.errstate(invalid="ignore"):
            gradient = (up - down) / (2 * width)
            second = np.diag((2 * value - up - down) / width**2)
            mixed = (2 * value - both - neither) / 2 / (width[i] * width[j])
            second[i, j] = mixed - np.diag(second)[i] * width[i] / width[j] / 2 - np.diag(second)[j] * width[j] / width[i] / 2
        second[j, i] = second[i, j]
        free = np.isfinite(gradient) & np.isfinite(np.diag(second))
        gradient = np.where(free, gradient, 0.0)
        held = np.where(np.isfinite(second) & free & free[:, None], second, 0.0)
        return gradient, held + np.diag(np.where(free, 0.0, self.prior[0] ** -2.0))

    def to_theta(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Target`; x as it is."""
        return x.copy(), np.zeros(x.shape[0])

    def from_theta(self, theta: FloatArray) -> FloatArray:
        """See `Target`; theta as it is."""
        return theta.copy()

    def columns(self, theta: FloatArray) -> FloatArray:
        """See `Target`; x as it is."""
        return theta


@dataclass(frozen=True)
class Errors:
    """How far a sample is off the truth: the worst mean [sd], the worst ratio of sds less 1, the share of modes missing."""

    mean: float
    sd: float
    missing: float

    @property
    def wrong(self) -> bool:
        """Whether that is more than a converged sample may be off: 0.2 sd, 15 %, 2 %."""
        return self.mean > 0.2 or self.sd > 0.15 or self.missing > 0.02


@dataclass(frozen=True, eq=False)
class Truth:
    """Exact draws of a target (n_exact, n), each column in order, and which columns are compared by their normal scores."""

    ordered: FloatArray
    heavy: BoolArray
    weights: FloatArray

    def scores(self, x: FloatArray) -> FloatArray:
        """Normal scores (n_draw, n) of draws x (n_draw, n): standard normal if they are right."""
        return np.stack([_score(exact, own) for exact, own in zip(self.ordered.T, x.T, strict=True)], axis=1)

    def errors(self, target: Known, x: FloatArray) -> Errors:
        """Compare a sample with the truth.

        Parameters
        ----------
        target : that is sampled.
        x : (n_draw, n), the sample.
        """
        means, ratios = [], []
        for k, exact in enumerate(self.ordered.T):
            if self.heavy[k]:
                score = _score(exact, x[:, k])
                mean, ratio = float(np.mean(score)), float(np.std(score))
            else:
                mean = float((np.mean(x[:, k]) - np.mean(exact)) / np.std(exact))
                ratio = float(np.std(x[:, k]) / np.std(exact))
            means.append(abs(mean))
            ratios.append(abs(ratio - 1))
        # Of a mode that is there, the weight may be off as a mean may; one is missing as far as less than it is there.
        found = shares(target, x, self.weights.size)
        gone = np.where(found < 0.5 * self.weights, self.weights - found, 0.0)
        return Errors(max(means), max(ratios), float(np.max(gone)))


def _score(exact: FloatArray, x: FloatArray) -> FloatArray:
    return np.asarray(norm.ppf((np.searchsorted(exact, x) + 0.5) / (exact.size + 1)), dtype=float)


def shares(target: Known, x: FloatArray, n_mode: int) -> FloatArray:
    """Share of draws x (n_draw, n) in each mode, (n_mode,)."""
    if target.modes is None:
        return np.ones(n_mode)
    return np.asarray(np.bincount(target.modes(x).astype(int), minlength=n_mode) / x.shape[0], dtype=float)


def truth_of(target: Known) -> Truth:
    """The truth about a target from `N_EXACT` exact draws."""
    x = target.exact(np.random.default_rng(20261122), N_EXACT)
    n_mode = 1 if target.modes is None else int(np.max(target.modes(x))) + 1
    return Truth(np.sort(x, axis=0), np.asarray(kurtosis(x, fisher=False) > _HEAVY), shares(target, x, n_mode))
