"""Targets whose moments are known: normal, funnel, banana, ridge, heavy tails, several modes, bounds, skewness."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln, logsumexp
from scipy.stats import norm, special_ortho_group, truncnorm

from calib.priors import HalfNormal, Uniform
from calib.sampling.ends import ENDLESS, ends_of
from models.sensor import FloatArray
from samplers.known import Known

# How much wider than the target a prior is that climbs start from.
_WIDE = 3.0


def gallery() -> dict[str, Known]:
    """All targets by name."""
    far = np.array([[-7.0] + [0.0] * 9, [7.0] + [0.0] * 9])
    near = np.array([[-2.5] + [0.0] * 9, [2.5] + [0.0] * 9])
    three = np.zeros((3, 8))
    three[1, 0], three[2, 1] = 10.0, 12.0
    shifted = np.array([[0.0] * 5, [8.0] + [0.0] * 4])
    slim = np.array([[0.0] * 20, [12.0] + [0.0] * 19])
    targets = [
        normal("normal, 20", 20, 1e3),
        normal("normal, 60", 60, 1e4),
        ridge("ridge of 1e4", 10, 1e4),
        funnel("funnel, 10", 10, 1.5),
        funnel("funnel, 20", 20, 1.5),
        funnel("Neal's funnel, 10", 10, 3.0, good=False),
        funnel("funnel of an unnamed scale", 10, 1.0, named=False, good=False),
        floors("two noises near a floor", 14),
        banana("banana", 10, 0.1, 3.0),
        banana("thin banana", 4, 1.0, 1.0, thin=0.2),
        student("Student t, 5 degrees, 20", 20, 5.0),
        student("Student t, 3 degrees, 10", 10, 3.0),
        student_each("Student t of each, 4 degrees", 12, 4.0),
        mixture("two modes 14 sd apart, 0.5", far, [1, 1], [0.5, 0.5]),
        mixture("two modes 14 sd apart, 0.9", far, [1, 1], [0.9, 0.1]),
        mixture("two modes 12 sd apart, 0.97, 20", slim, [1, 1], [0.97, 0.03]),
        mixture("two modes 5 sd apart", near, [1, 1], [0.5, 0.5]),
        mixture("wide 0.9 beside narrow, higher", shifted, [1.0, 0.25], [0.9, 0.1]),
        mixture("three modes", three, [1.0, 0.5, 1.5], [0.5, 0.3, 0.2]),
        corner("corner of hard bounds", 6),
        bounded("flat up to a bound, normal scores", 10),
        following("others follow two values at their ends", 10),
        skewed("skewed marginals", 10),
        groups("half-normal scale near zero", 8),
        prior_dominated("prior-dominated", 15),
        specimens("12 specimens, alike", 12, 0.0),
        specimens("12 specimens, bent", 12, 0.1),
    ]
    return {target.name: target for target in targets}


def _around(mean: FloatArray, sd: FloatArray) -> FloatArray:
    return np.stack([_WIDE * np.broadcast_to(sd, mean.shape), mean])


def normal(name: str, n: int, scaling: float) -> Known:
    """A normal density with widths from 1 to `scaling`, correlated by a random rotation of a condition of 100."""
    rng = np.random.default_rng(n)
    axes = special_ortho_group.rvs(n, random_state=n)
    factor = np.logspace(0, np.log10(scaling), n)[:, None] * (axes * np.logspace(-1, 1, n))
    mean = rng.standard_normal(n) * np.sqrt(np.sum(factor**2, axis=1))
    inverse = np.linalg.inv(factor)
    return Known(
        name,
        lambda r, m: mean + r.standard_normal((m, n)) @ factor.T,
        lambda x: -0.5 * np.sum(((x - mean) @ inverse.T) ** 2, axis=1),
        _around(mean, np.sqrt(np.sum(factor**2, axis=1))),
    )


def ridge(name: str, n: int, ratio: float) -> Known:
    """A normal density `ratio` times as long in one oblique direction as across."""
    axes = special_ortho_group.rvs(n, random_state=n)
    sd = np.r_[ratio, np.ones(n - 1)]
    return Known(
        name,
        lambda r, m: (r.standard_normal((m, n)) * sd) @ axes.T,
        lambda x: -0.5 * np.sum((x @ axes / sd) ** 2, axis=1),
        _around(np.zeros(n), np.full(n, ratio)),
    )


def funnel(name: str, n: int, sd: float, *, named: bool = True, good: bool = True) -> Known:
    """Neal's: u normal of a given sd, the others normal of the sd exp(u / 2)."""

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        u = sd * r.standard_normal((m, 1))
        return np.concatenate([u, np.exp(u / 2) * r.standard_normal((m, n - 1))], axis=1)

    def density(x: FloatArray) -> FloatArray:
        u, rest = x[:, 0], x[:, 1:]
        return np.asarray(-0.5 * (u / sd) ** 2 - 0.5 * (n - 1) * u - 0.5 * np.sum(rest**2, axis=1) * np.exp(-u), dtype=float)

    wide = np.r_[sd, np.full(n - 1, np.exp(sd / 2))]
    return Known(name, exact, density, _around(np.zeros(n), wide), (0,) if named else (), good=good)


def floors(name: str, n: int) -> Known:
    """Two scales u, v, normal; of the others half have the sd hypot(0.1, exp(u)), half hypot(0.2, exp(v)), on a slope in u."""
    half = (n - 2) // 2

    def widths(x: FloatArray) -> FloatArray:
        return np.repeat(np.hypot([0.1, 0.2], np.exp(x[:, :2])), half, axis=1)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        u = r.standard_normal((m, 2)) * [1.2, 0.8] + [-2.0, -1.0]
        return np.concatenate([u, 0.05 * u[:, :1] + widths(u) * r.standard_normal((m, 2 * half))], axis=1)

    def density(x: FloatArray) -> FloatArray:
        ahead = -0.5 * np.sum(((x[:, :2] - [-2.0, -1.0]) / [1.2, 0.8]) ** 2, axis=1)
        width = widths(x)
        rest = (x[:, 2:] - 0.05 * x[:, :1]) / width
        return np.asarray(ahead - np.sum(0.5 * rest**2 + np.log(width), axis=1), dtype=float)

    return Known(name, exact, density, _around(np.r_[-2.0, -1.0, np.zeros(2 * half)], np.array([1.0])), (0, 1))


def banana(name: str, n: int, bend: float, sd: float, thin: float = 1.0) -> Known:
    """x0 normal, x1 normal about bend (x0^2 - sd^2), of the sd `thin`; the others standard normal."""

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        x: FloatArray = r.standard_normal((m, n)) * np.r_[sd, thin, np.ones(n - 2)]
        x[:, 1] += bend * (x[:, 0] ** 2 - sd**2)
        return x

    def density(x: FloatArray) -> FloatArray:
        across = (x[:, 1] - bend * (x[:, 0] ** 2 - sd**2)) / thin
        return np.asarray(-0.5 * ((x[:, 0] / sd) ** 2 + across**2 + np.sum(x[:, 2:] ** 2, axis=1)), dtype=float)

    return Known(name, exact, density, _around(np.zeros(n), np.r_[sd, 1.0, np.ones(n - 2)]))


def student(name: str, n: int, freedom: float) -> Known:
    """A multivariate Student density, widths from 0.1 to 10, oblique."""
    axes = special_ortho_group.rvs(n, random_state=n)
    factor = axes * np.logspace(-1, 1, n)
    inverse = np.linalg.inv(factor)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        return np.asarray(r.standard_normal((m, n)) @ factor.T / np.sqrt(r.chisquare(freedom, (m, 1)) / freedom), dtype=float)

    def density(x: FloatArray) -> FloatArray:
        return np.asarray(-(freedom + n) / 2 * np.log1p(np.sum((x @ inverse.T) ** 2, axis=1) / freedom), dtype=float)

    return Known(name, exact, density, _around(np.zeros(n), np.full(n, 5.0)))


def student_each(name: str, n: int, freedom: float) -> Known:
    """Independent Student variables."""

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        return np.asarray(r.standard_t(freedom, (m, n)), dtype=float)

    def density(x: FloatArray) -> FloatArray:
        return np.asarray(-(freedom + 1) / 2 * np.sum(np.log1p(x**2 / freedom), axis=1), dtype=float)

    return Known(name, exact, density, _around(np.zeros(n), np.ones(n)))


def mixture(name: str, mean: FloatArray, sd: list[float], weight: list[float]) -> Known:
    """Round normal densities at `mean` (n_mode, n), with their sds and weights."""
    n = mean.shape[1]

    def log_parts(x: FloatArray) -> FloatArray:
        off = np.sum((x[:, None] - mean) ** 2, axis=2) / np.square(sd)
        return np.asarray(np.log(weight) - 0.5 * off - n * np.log(sd), dtype=float)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        which = r.choice(len(weight), m, p=weight)
        return np.asarray(mean[which] + np.asarray(sd)[which, None] * r.standard_normal((m, n)), dtype=float)

    wide = np.maximum(np.ptp(mean, axis=0) / _WIDE, np.max(sd))
    return Known(
        name,
        exact,
        lambda x: np.asarray(logsumexp(log_parts(x), axis=1), dtype=float),
        _around(np.mean(mean, axis=0), wide),
        modes=lambda x: np.argmax(log_parts(x), axis=1).astype(float),
    )


def corner(name: str, n: int) -> Known:
    """Uniform on a cube in half of the unknowns, exponential from a bound at zero in the others; none beyond."""
    half = n // 2

    def density(x: FloatArray) -> FloatArray:
        inside = np.all(x > 0, axis=1) & np.all(x[:, :half] < 1, axis=1)
        return np.where(inside, -np.sum(x[:, half:], axis=1), -np.inf)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        return np.concatenate([r.random((m, half)), r.standard_exponential((m, n - half))], axis=1)

    return Known(name, exact, density, np.stack([np.full(n, 1.0), np.full(n, 0.5)]))


def bounded(name: str, n: int) -> Known:
    """Uniform priors on (0, 1) in their normal scores, with data that push half of the unknowns exponentially to a bound."""
    half, rate = n // 2, 8.0

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        pushed = -np.log1p(-r.random((m, half)) * (1 - np.exp(-rate))) / rate
        return np.asarray(np.concatenate([norm.ppf(pushed), r.standard_normal((m, n - half))], axis=1), dtype=float)

    def density(x: FloatArray) -> FloatArray:
        return np.asarray(-0.5 * np.sum(x**2, axis=1) - rate * np.sum(norm.cdf(x[:, :half]), axis=1), dtype=float)

    ends = np.tile(ends_of(Uniform(0.0, 1.0)), (n, 1))
    return Known(name, exact, density, np.stack([np.ones(n), np.zeros(n)]), ends=ends)


def following(name: str, n: int) -> Known:
    """Normal scores of two values that data push to their ends at zero, and others that follow the values, not the scores.

    v half-normal, seen as 0.32 with error 0.17; w uniform on (0, 1), pushed exponentially to 0; the others normal about
    combinations of both, a hundredth of them wide at least.
    """
    rng = np.random.default_rng(n)
    seen, error, rate = 0.32, 0.17, 50.0
    slopes, width = rng.standard_normal((n - 2, 2)) * [1 / error, rate], np.linspace(0.1, 1.0, n - 2)
    of_both = 1 + error**2  # of the half-normal prior and what is seen: cut off at zero, too
    middle, sd = seen / of_both, error / np.sqrt(of_both)
    prior = HalfNormal(1.0), Uniform(0.0, 1.0)

    def values(x: FloatArray) -> FloatArray:
        return np.stack([p.ppf_normal(x[:, k]) for k, p in enumerate(prior)], axis=1)

    def density(x: FloatArray) -> FloatArray:
        both = values(x)
        data = -0.5 * ((both[:, 0] - seen) / error) ** 2 - rate * both[:, 1]
        rest = (x[:, 2:] - both @ slopes.T) / width
        return np.asarray(data - 0.5 * np.sum(x[:, :2] ** 2, axis=1) - 0.5 * np.sum(rest**2, axis=1), dtype=float)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        v = truncnorm.rvs(-middle / sd, np.inf, middle, sd, size=m, random_state=r)
        w = -np.log1p(-r.random(m) * (1 - np.exp(-rate))) / rate
        both = np.stack([v, w], axis=1)
        scores = [p.to_normal(both[:, k]) for k, p in enumerate(prior)]
        rest = both @ slopes.T + width * r.standard_normal((m, n - 2))
        return np.asarray(np.column_stack([*scores, rest]), dtype=float)

    ends = np.array([*(ends_of(p) for p in prior), *[ENDLESS] * (n - 2)])
    wide = _around(np.zeros(n), np.r_[1.0, 1.0, 2 * np.sum(np.abs(slopes) * [error, 1 / rate], axis=1)] / _WIDE)
    return Known(name, exact, density, wide, ends=ends)


def skewed(name: str, n: int) -> Known:
    """Logarithms of gamma variables, long to the left; and some the other way round."""
    shape, sign = np.linspace(0.8, 4.0, n), np.where(np.arange(n) % 2, 1.0, -1.0)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        return np.asarray(sign * np.log(r.gamma(shape, size=(m, n))), dtype=float)

    def density(x: FloatArray) -> FloatArray:
        y = sign * x
        return np.asarray(np.sum(shape * y - np.exp(y) - gammaln(shape), axis=1), dtype=float)

    return Known(name, exact, density, _around(sign * np.log(shape), np.ones(n)))


def groups(name: str, n: int) -> Known:
    """Groups with means normal of the sd s, s half-normal, each seen once with error 1: Rubin's schools, s in normal scores.

    Where all means are the same its density has no bound, as s goes to 0: a funnel whose neck never ends.
    """
    seen = np.random.default_rng(8).standard_normal(n)

    def spread(z: FloatArray) -> FloatArray:
        return np.asarray(2.0 * norm.ppf(0.5 + 0.5 * norm.cdf(z)), dtype=float)

    def density(x: FloatArray) -> FloatArray:
        s, mean = spread(x[:, :1]), x[:, 1:]
        own = np.sum(-0.5 * (mean / s) ** 2 - np.log(s) - 0.5 * (seen - mean) ** 2, axis=1)
        return np.asarray(-0.5 * x[:, 0] ** 2 + own, dtype=float)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        z = np.linspace(-7, 7, 20_001)
        total = 1 + spread(z) ** 2
        log_weight = -0.5 * z**2 - 0.5 * n * np.log(total) - 0.5 * np.sum(seen**2) / total
        cumulative = np.cumsum(np.exp(log_weight - np.max(log_weight)))
        drawn = np.interp(r.random(m), cumulative / cumulative[-1], z)[:, None]
        share = spread(drawn) ** 2 / (1 + spread(drawn) ** 2)
        return np.asarray(
            np.concatenate([drawn, share * seen + np.sqrt(share) * r.standard_normal((m, n))], axis=1), dtype=float
        )

    return Known(name, exact, density, np.stack([np.r_[1.0, np.full(n, 2.0)], np.zeros(n + 1)]), (0,), good=False)


def prior_dominated(name: str, n: int) -> Known:
    """Standard normal priors, and data that know the sum of all unknowns to 1e-3, and nothing else."""
    direction, known = np.ones(n) / np.sqrt(n), 0.5

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        x = r.standard_normal((m, n))
        share = 1 / (1 + 1e-6)
        along = share * known + 1e-3 * np.sqrt(share) * r.standard_normal(m)
        return np.asarray(x + (along - x @ direction)[:, None] * direction, dtype=float)

    def density(x: FloatArray) -> FloatArray:
        return np.asarray(-0.5 * np.sum(x**2, axis=1) - 0.5 * ((x @ direction - known) / 1e-3) ** 2, dtype=float)

    return Known(name, exact, density, np.stack([np.ones(n), np.zeros(n)]))


def specimens(name: str, n_group: int, bend: float, apart: float = 0.0) -> Known:
    """Groups of three unknowns that are normal given four shared ones: means that follow those, and widths that one sets.

    Means of each group are linear in the shared unknowns but for `bend` times a square. The last of these has two modes `apart`
    from each other, with 0.7 and 0.3 of the mass.
    """
    rng = np.random.default_rng(n_group)
    slopes = rng.standard_normal((n_group, 4, 3))
    axes = rng.standard_normal((n_group, 3, 3)) + 2 * np.eye(3)
    back = np.linalg.inv(axes)
    n = 4 + 3 * n_group

    def mean_and_width(shared: FloatArray) -> tuple[FloatArray, FloatArray]:
        bent = bend * (shared[:, None, 1, None] ** 2 - 1)
        return np.einsum("di,gij->dgj", shared, slopes) + bent, np.exp(0.3 * shared[:, 0])

    def exact(rng: np.random.Generator, n_draw: int) -> FloatArray:
        shared = rng.standard_normal((n_draw, 4))
        shared[:, 3] += apart * (rng.random(n_draw) < 0.3)
        mean, width = mean_and_width(shared)
        own = mean + width[:, None, None] * np.einsum("dgi,gij->dgj", rng.standard_normal((n_draw, n_group, 3)), axes)
        return np.concatenate([shared, own.reshape(n_draw, -1)], axis=1)

    def parts(x: FloatArray) -> FloatArray:
        mean, width = mean_and_width(x[:, :4])
        away = np.einsum("dgi,gij->dgj", x[:, 4:].reshape(-1, n_group, 3) - mean, back) / width[:, None, None]
        own = -0.5 * np.sum(away**2, axis=2) - 3 * np.log(width)[:, None]
        first, second = -0.5 * x[:, 3:4] ** 2 + np.log(0.7), -0.5 * (x[:, 3:4] - apart) ** 2 + np.log(0.3)
        shared = np.logaddexp(first, second) - 0.5 * np.sum(x[:, :3] ** 2, axis=1, keepdims=True)
        return np.concatenate([shared, own], axis=1)

    spread = np.std(exact(rng, 4000), axis=0)
    return Known(
        name,
        exact,
        lambda x: np.sum(parts(x), axis=1),
        _around(np.zeros(n), spread),
        scales=(0,),
        groups=tuple(np.arange(4 + 3 * k, 7 + 3 * k) for k in range(n_group)),
        parts=parts,
    )
