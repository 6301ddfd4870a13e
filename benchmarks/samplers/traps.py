"""Targets with known moments that are built to fool a search for modes, a proposal or a gate; some cannot be sampled here."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import gammaln, logsumexp
from scipy.stats import norm

from models.sensor import FloatArray
from samplers.known import Known

#: Of one part of a mixture: log density (n_draw,) at x (n_draw, n), normalised; and draws of it.
_Part = tuple[Callable[[FloatArray], FloatArray], Callable[[np.random.Generator, int], FloatArray]]


def traps() -> dict[str, Known]:
    """All of them by name."""
    plain = np.zeros(20)
    far = np.r_[12.0, np.zeros(19)]
    targets = [
        # Without curvature at its top the first seems as wide as the prior, and to hold all the mass.
        _mixed("flat top beside a normal mode, 20", [_flat(plain, 3.0), _normal(far, 1.0)], [0.5, 0.5], 20, 3.0),
        # At a bound a climb may end on a slope, far below the top that it leads to.
        _mixed("mode in a corner of bounds", [_corner(6, 0.01), _normal(np.full(6, 0.6), 0.03)], [0.5, 0.5], 6, 0.4, 0.5),
        _scores("mode at the edge of uniform priors", [_corner(6, 0.01), _normal(np.full(6, 0.6), 0.03)], [0.5, 0.5], 6),
        _mixed("narrow spike in a broad mode", [_normal(np.zeros(6), 1.0), _normal(np.full(6, 0.8), 0.03)], [0.995, 0.005], 6),
        _mixed("spike with wide tails", [_normal(np.zeros(5), 1.0), _student(np.full(5, 2.0), 0.01, 1.5)], [0.9, 0.1], 5),
        _ring("ring", 6, 10.0, 0.5),
        _ring("thin ring", 6, 10.0, 0.1),
        _mixed("two funnels", [_funnel(8, 0.0, 1.0), _funnel(8, 30.0, -1.0)], [0.6, 0.4], 8, 15.0, 15.0, scales=(0,)),
    ]
    return {target.name: target for target in targets}


def _mixed(
    name: str,
    parts: list[_Part],
    weight: list[float],
    n: int,
    wide: float = 9.0,
    mean: float = 0.0,
    scales: tuple[int, ...] = (),
) -> Known:
    """A mixture, its climbs starting from a normal density of this sd about this mean."""

    def log_parts(x: FloatArray) -> FloatArray:
        return np.stack([np.log(w) + density(x) for w, (density, _) in zip(weight, parts, strict=True)], axis=1)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        which = r.choice(len(weight), m, p=weight)
        drawn = np.stack([draw(r, m) for _, draw in parts])
        return np.asarray(drawn[which, np.arange(m)], dtype=float)

    return Known(
        name,
        exact,
        lambda x: np.asarray(logsumexp(log_parts(x), axis=1), dtype=float),
        np.stack([np.full(n, wide), np.full(n, mean)]),
        scales,
        modes=lambda x: np.argmax(log_parts(x), axis=1).astype(float),
        good=False,
    )


def _scores(name: str, parts: list[_Part], weight: list[float], n: int) -> Known:
    """A mixture in n unknowns between 0 and 1, seen in their normal scores, as bounded unknowns are sampled."""
    plain = _mixed(name, parts, weight, n, 1.0)
    assert plain.modes is not None
    modes = plain.modes
    return Known(
        name,
        lambda r, m: np.asarray(norm.ppf(np.clip(plain.exact(r, m), 1e-300, 1 - 1e-16)), dtype=float),
        lambda x: np.asarray(plain.density(norm.cdf(x)) - 0.5 * np.sum(x**2, axis=1), dtype=float),
        plain.prior,
        modes=lambda x: modes(norm.cdf(x)),
        good=False,
    )


def _normal(mean: FloatArray, sd: float) -> _Part:
    n = mean.size

    def density(x: FloatArray) -> FloatArray:
        return np.asarray(-0.5 * np.sum(((x - mean) / sd) ** 2, axis=1) - n * np.log(sd * np.sqrt(2 * np.pi)), dtype=float)

    return density, lambda r, m: mean + sd * r.standard_normal((m, n))


def _flat(mean: FloatArray, radius: float) -> _Part:
    """Density exp(-(r / radius)^4 / 2) of the distance r to its mean."""
    n = mean.size
    area = np.log(2) + n / 2 * np.log(np.pi) - gammaln(n / 2)
    log_mass = area + n * np.log(radius) + n / 4 * np.log(2) + gammaln(n / 4) - np.log(4)

    def density(x: FloatArray) -> FloatArray:
        return np.asarray(-0.5 * (np.sum((x - mean) ** 2, axis=1) / radius**2) ** 2 - log_mass, dtype=float)

    def draw(r: np.random.Generator, m: int) -> FloatArray:
        direction = r.standard_normal((m, n))
        far = radius * (2 * r.gamma(n / 4, size=(m, 1))) ** (1 / 4)
        return np.asarray(mean + far * direction / np.linalg.norm(direction, axis=1, keepdims=True), dtype=float)

    return density, draw


def _corner(n: int, width: float) -> _Part:
    """Exponential in each coordinate, none below zero."""

    def density(x: FloatArray) -> FloatArray:
        inside = np.all(x >= 0, axis=1)
        return np.where(inside, -np.sum(x, axis=1) / width - n * np.log(width), -np.inf)

    return density, lambda r, m: r.exponential(width, (m, n))


def _student(mean: FloatArray, width: float, freedom: float) -> _Part:
    n = mean.size
    constant = gammaln((freedom + n) / 2) - gammaln(freedom / 2) - n / 2 * np.log(freedom * np.pi) - n * np.log(width)

    def density(x: FloatArray) -> FloatArray:
        square = np.sum(((x - mean) / width) ** 2, axis=1)
        return np.asarray(constant - (freedom + n) / 2 * np.log1p(square / freedom), dtype=float)

    def draw(r: np.random.Generator, m: int) -> FloatArray:
        scale = np.sqrt(r.chisquare(freedom, (m, 1)) / freedom)
        return np.asarray(mean + width * r.standard_normal((m, n)) / scale, dtype=float)

    return density, draw


def _funnel(n: int, mean: float, sign: float) -> _Part:
    """Log width u standard normal, the others about `mean` of the sd exp(sign u / 2)."""

    def density(x: FloatArray) -> FloatArray:
        u, off = x[:, 0], x[:, 1:] - mean
        square = np.sum(off**2, axis=1) * np.exp(-sign * u)
        return np.asarray(-0.5 * (u**2 + square + (n - 1) * sign * u + n * np.log(2 * np.pi)), dtype=float)

    def draw(r: np.random.Generator, m: int) -> FloatArray:
        u = r.standard_normal((m, 1))
        return np.concatenate([u, mean + np.exp(sign * u / 2) * r.standard_normal((m, n - 1))], axis=1)

    return density, draw


def _ring(name: str, n: int, radius: float, width: float) -> Known:
    """Two coordinates on a ring, normal across it; the others standard normal."""

    def density(x: FloatArray) -> FloatArray:
        away = np.hypot(x[:, 0], x[:, 1])
        # Over the distance, as the ring of twice the radius is twice as long.
        ring = -0.5 * ((away - radius) / width) ** 2 - np.log(away)
        return np.asarray(ring - 0.5 * np.sum(x[:, 2:] ** 2, axis=1), dtype=float)

    def exact(r: np.random.Generator, m: int) -> FloatArray:
        angle, away = r.uniform(0, 2 * np.pi, (m, 1)), np.abs(radius + width * r.standard_normal((m, 1)))
        return np.concatenate([away * np.cos(angle), away * np.sin(angle), r.standard_normal((m, n - 2))], axis=1)

    def quarter(x: FloatArray) -> FloatArray:
        return np.asarray((x[:, 0] > 0) + 2.0 * (x[:, 1] > 0), dtype=float)

    wide = np.r_[radius, radius, np.full(n - 2, 3.0)]
    return Known(name, exact, density, np.stack([wide, np.zeros(n)]), modes=quarter, good=False)
