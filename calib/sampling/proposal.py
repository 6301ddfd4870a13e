"""Draws of a posterior in, a density that is close to it, can be drawn from and is known exactly, out.

A posterior of this kind of problem is a funnel: the noises and discrepancies u set how wide everything else is, and where they
are small it is narrow. So the proposal takes the scales first, then the rest given them. With y the coordinates, centred and
scaled, u ahead, and phi = (u, u u^T) bent so that it stays bounded,

    y_k = a_k + sum_{j<k} l_kj y_j + b_k phi + exp(c_k + d_k phi) r_k,                                               (1)

r_k = t_k of all but the scales, t multivariate Student. The scales are long on one side, as what is nearly zero has no end in
its logarithm, and there walkers would stick. So theirs is (Jones & Pewsey, Biometrika 96 (2009) 761, equation (2))

    t_k = sinh(delta_k arsinh((r_k - xi_k) / eta_k) - epsilon_k).                                                    (2)

Where draws come to an end of what is believed of a coordinate, a normal score z that has no end itself, the others follow its
value v (`calib.sampling.ends`), and so none of them moves as z goes on. There y is that of v, in its own line and in those of
others; it comes right after the scales; and as v ends at v_low and v_high, its t is the normal score of that of (2)
between theirs,

    Phi(t_k) = (Phi(s(v)) - Phi(s(v_low))) / (Phi(s(v_high)) - Phi(s(v_low))), s(v) the right-hand side of (2).        (3)

Each line is a regression with unequal variances on the draws. Bounded, because widths that shrank with
u for ever would leave the proposal far too narrow where the posterior's widths have long become constant: chains stuck there.
Several modes are a mixture of such densities, one for each.

Where groups of coordinates (those of each specimen) are independent of each other given the rest, (1) has no terms between
groups, and t is multivariate Student within each group: a few draws tell the few slopes that are left, and the tails of one
group do not stretch another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize
from scipy.special import gammaln, logsumexp

from calib.priors import log_mass
from calib.sampling.ends import ENDLESS, score_at, value_at
from models.sensor import BoolArray, FloatArray

#: Columns, or their numbers.
Indices = np.ndarray[tuple[int], np.dtype[np.intp]]

# Where u, in standard deviations, is bent to a constant: it enters (1) as _BEND tanh(u / _BEND).
_BEND = 2.0
# Degrees of freedom of t to choose from; heavier tails than the draws show cost little and keep chains from sticking.
_FREEDOM = (3.0, 4.0, 6.0, 8.0, 12.0)
# Factor by which the proposal is wider than the draws it is fitted to.
_WIDEN = 1.05
# Rounds of the two regressions of a line; squared residuals above this, in variances, count as this in that of the widths.
_ROUNDS, _OUTLIER = 3, 12.0
#: Least share of a mode in a proposal, so that no mode is forgotten.
LEAST_SHARE = 0.02
# Draws for each unknown that a part of a mixture is fitted to, at least.
_LEAST_DRAWS = 10
# Bounds of epsilon, log delta, xi and log eta of (2), and the weight, in draws, of the assumption that the first two are zero.
_SKEWED, _SKEW_PULL = (1.0, 0.5, 1.0, 0.7), 20.0
# The same bounds for a line with an end, of whose density a part may be cut off; where arsinh of (2) counts as that of no end.
_CUT, _ENDLESS = (1.0, 0.5, 3.0, 1.2), 20.0
# Others follow a value with an end, where so much of its variance is not in a straight line of x.
_LEAST_BEND = 0.003
# Weight of the assumption that slopes are zero, in draws: of the means, of the logarithms of the widths.
_PULL, _WIDTH_PULL = 0.03, 60.0


@dataclass(frozen=True, eq=False)
class Funnel:
    """One density of the form (1), n coordinates of which `order` names first the scales, n_phi terms of phi.

    Attributes
    ----------
    order : (n,), columns of x in the order of y.
    n_scale : how many of them are scales.
    centre, spread : (n,), y = (x - centre) / spread, in the order of x; of a value with an end, y = (v - centre) / spread.
    constant, linear, bent : a (n,), l (n, n) strictly lower, b (n, n_phi) of (1).
    width : (n, 1 + n_phi), c and d of (1).
    skew : (n_lead, 4) of the scales and of values with an end, which come right after them: epsilon, log delta, xi and log eta
        of (2); all zero for a density that is not skewed.
    ends : (n, 2), between which the value of each column of x lies that others follow, in its order; infinite where it is x
        itself. See `calib.sampling.ends`.
    block : (n,), number of the group that each of y belongs to, from 1; 0 for those that are in none, which come first.
    freedom, scale : (n_block,), of each group, the first of those in none: degrees of freedom of t, and the factor that it is
        wider by than standard.
    """

    order: Indices
    n_scale: int
    centre: FloatArray
    spread: FloatArray
    constant: FloatArray
    linear: FloatArray
    bent: FloatArray
    width: FloatArray
    skew: FloatArray
    ends: FloatArray
    block: Indices
    freedom: FloatArray
    scale: FloatArray

    @property
    def block_of_columns(self) -> Indices:
        """Number of the group of each column of x, (n,); 0 for those in none."""
        found = np.empty_like(self.block)
        found[self.order] = self.block
        return found

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        t, log_widths = self._lines(x)
        return np.asarray(np.sum(self.log_blocks(t), axis=1) - np.sum(log_widths, axis=1), dtype=float)

    def log_blocks(self, t: FloatArray) -> FloatArray:
        """Logarithm of the density of the residuals t (n_draw, n) of each group, (n_draw, n_block)."""
        square = np.stack([np.sum(t[:, self.block == k] ** 2, axis=1) for k in range(self.freedom.size)], axis=1)
        return log_student(square, np.bincount(self.block, minlength=self.freedom.size), self.freedom, self.scale)

    def log_widths(self, x: FloatArray) -> FloatArray:
        """Logarithms of the widths of all lines, |dx / dt|, at x (n_draw, n), (n_draw, n), in the order of y."""
        return self._lines(x)[1]

    def log_volume(self, x: FloatArray) -> FloatArray:
        """Logarithm of |dx / dt|, the volume of a unit of t at x (n_draw, n), (n_draw,)."""
        return np.asarray(np.sum(self.log_widths(x), axis=1), dtype=float)

    def log_shared(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n) of the coordinates in no group, (n_draw,)."""
        t, log_widths = self._lines(x)
        return np.asarray(self.log_blocks(t)[:, 0] - np.sum(log_widths[:, self.block == 0], axis=1), dtype=float)

    def residuals(self, x: FloatArray) -> FloatArray:
        """Residuals t of (1) and (2) at x (n_draw, n), (n_draw, n)."""
        return self._lines(x)[0]

    def _lines(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The residuals t at x (n_draw, n), and the logarithms of |dx / dt| of each line, (n_draw, n)."""
        values, log_slopes = _followed(x, self.ends)
        y = ((values - self.centre) / self.spread)[:, self.order]
        phi = _bent(y[:, : self.n_scale])
        log_widths = self._log_widths(phi)
        t = (y - self.constant - y @ self.linear.T - phi @ self.bent.T) * np.exp(-log_widths)
        lead = slice(self.n_lead)
        t[:, lead], log_bends = _straightened(t[:, lead], self.skew)
        for k in self.ended:
            t[:, k], log_bend = score_at(t[:, k], *self._ends_of(k, y, phi))  # (3)
            log_bends[:, k] += log_bend
        log_widths[:, lead] -= log_bends
        return t, log_widths + np.log(self.spread)[self.order] - log_slopes[:, self.order]

    def at(self, t: FloatArray) -> FloatArray:
        """Point x (n_draw, n) at which `residuals` gives t (n_draw, n)."""
        y = np.zeros_like(t)
        r = t.copy()
        lead, rest = slice(self.n_lead), slice(self.n_lead, None)
        r[:, lead] = _skewed(t[:, lead], self.skew)
        ended = self.ended
        for k in range(self.n_lead):  # one after the other, as each changes phi
            phi = _bent(y[:, : self.n_scale])
            if k in ended:
                held, _ = value_at(t[:, k], *self._ends_of(k, y, phi))  # (3)
                r[:, k] = _skewed(held[:, None], self.skew[k : k + 1])[:, 0]
            middle, log_width = self.line(k, y, phi)
            y[:, k] = middle + np.exp(log_width) * r[:, k]
        phi = _bent(y[:, : self.n_scale])
        right = self.constant + phi @ self.bent.T + np.exp(self._log_widths(phi)) * r
        right[:, rest] += y[:, lead] @ self.linear[rest, lead].T
        lower = np.eye(self.constant.size - self.n_lead) - self.linear[rest, rest]
        y[:, rest] = solve_triangular(lower, right[:, rest].T, lower=True, unit_diagonal=True).T
        values = np.empty_like(y)
        values[:, self.order] = y
        values = self.centre + self.spread * values
        for column in self.order[ended]:
            values[:, column], _ = score_at(values[:, column], *self.ends[column])
        return values

    @property
    def n_lead(self) -> int:
        """How many lines come first: those of scales and of values with an end."""
        return len(self.skew)

    @property
    def ended(self) -> Indices:
        """Lines of what others follow by a value with an end."""
        return np.flatnonzero(_has_ends(self.ends[self.order]))

    def line(self, k: int | np.intp, y: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where the r of a line in (1) is zero, and its log width, (n_draw,), given those before it.

        Parameters
        ----------
        k : its number.
        y : (n_draw, n), as far as it is known.
        phi : (n_draw, n_phi), of these.
        """
        return self.constant[k] + y @ self.linear[k] + phi @ self.bent[k], self._log_widths(phi)[:, k]

    def ends_of_r(self, k: int | np.intp, y: FloatArray, phi: FloatArray) -> FloatArray:
        """Between which the r of a line with an end in (1) lies, (2, n_draw).

        Parameters
        ----------
        k, y, phi : see `line`.
        """
        middle, log_width = self.line(k, y, phi)
        column = self.order[k]
        ends = (self.ends[column] - self.centre[column]) / self.spread[column]
        return np.asarray((ends[:, None] - middle) * np.exp(-log_width), dtype=float)

    def _ends_of(self, k: int | np.intp, y: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Between which the t of line k in (2) lies, (n_draw,) each."""
        return _straight_ends(self.ends_of_r(k, y, phi), self.skew[k])

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        return self.at(self.fresh(random, n_draw))

    def fresh(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws of the residuals t, (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        scale = self.scale / np.sqrt(random.chisquare(self.freedom, (n_draw, self.freedom.size)) / self.freedom)
        return np.asarray(random.standard_normal((n_draw, self.constant.size)) * scale[:, self.block], dtype=float)

    def nearby(self, random: np.random.RandomState, t: FloatArray, length: float) -> FloatArray:
        """Residuals near t (n_draw, n), a step that leaves their density alone; see `Proposal.step`.

        Parameters
        ----------
        random : the source of random numbers.
        t : where the steps begin.
        length : of the steps, in (0, 1].
        """
        t = t / self.scale[self.block]
        size = np.bincount(self.block, minlength=self.freedom.size)
        square = np.stack([np.sum(t[:, self.block == k] ** 2, axis=1) for k in range(size.size)], axis=1)
        root = np.sqrt(random.gamma((self.freedom + size) / 2, 2 / (self.freedom + square)))[:, self.block]
        new = np.sqrt(1 - length**2) * t + length * random.standard_normal(t.shape) / root
        return np.asarray(self.scale[self.block] * new, dtype=float)

    def _log_widths(self, phi: FloatArray) -> FloatArray:
        return np.asarray(self.width[:, 0] + phi @ self.width[:, 1:].T, dtype=float)


def log_student(square: FloatArray, n: Indices | int, freedom: FloatArray | float, scale: FloatArray | float) -> FloatArray:
    """Log density of the n-dimensional Student distribution at points whose squared length is given.

    Parameters
    ----------
    square : squared lengths.
    n : number of dimensions.
    freedom : degrees of freedom.
    scale : factor that it is wider by than standard.
    """
    norm = gammaln((freedom + n) / 2) - gammaln(freedom / 2) - n / 2 * np.log(freedom * np.pi) - n * np.log(scale)
    return np.asarray(norm - (freedom + n) / 2 * np.log1p(square / (freedom * scale**2)), dtype=float)


def _straightened(r: FloatArray, skew: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The t of (2) at r (n_draw, k), and log dt / dr there, for `skew` (k, 4) as in `Funnel`."""
    epsilon, log_delta, xi, log_eta = skew.T
    s = (r - xi) * np.exp(-log_eta)
    z = np.exp(log_delta) * np.arcsinh(s) - epsilon
    return np.sinh(z), log_delta - log_eta + np.log(np.cosh(z)) - 0.5 * np.log1p(s**2)


def _skewed(t: FloatArray, skew: FloatArray) -> FloatArray:
    """The r of (2) at which `_straightened` gives t (n_draw, k)."""
    epsilon, log_delta, xi, log_eta = skew.T
    return np.asarray(xi + np.exp(log_eta) * np.sinh((np.arcsinh(t) + epsilon) * np.exp(-log_delta)), dtype=float)


def _fit_skew(r: FloatArray, share: FloatArray, effective: float, ends: FloatArray | None = None) -> FloatArray:
    """Constants (4,) of (2) that make residuals r (n_draw,) of a line most probable, t normal: (2) takes the tails, too.

    A line with an end is cut off at `ends` (2, n_draw) of r.
    """
    pull = np.array([0.5, 0.5, 0.0, 0.0]) * _SKEW_PULL / effective

    def misfit(skew: FloatArray) -> tuple[float, FloatArray]:
        epsilon, log_delta, xi, log_eta = skew
        s = (r - xi) * np.exp(-log_eta)
        arc, root, delta = np.arcsinh(s), np.sqrt(1 + s**2), np.exp(log_delta)
        z = delta * arc - epsilon
        t, c = np.sinh(z), np.cosh(z)
        log_density = log_delta - log_eta + np.log(c / root) - t**2 / 2
        by_z = t / c - t * c
        by_s = by_z * delta / root - s / root**2
        slopes = np.array([-by_z, 1 + by_z * delta * arc, -by_s * np.exp(-log_eta), -1 - by_s * s]) @ share
        value, by_skew = float(pull @ skew**2 - share @ log_density), 2 * pull * skew - slopes
        if ends is None:
            return value, by_skew
        log_kept, slopes = _kept(ends, skew)
        return value + float(share @ log_kept), by_skew + slopes @ share

    bounds = [(-most, most) for most in (_SKEWED if ends is None else _CUT)]
    found = minimize(misfit, np.zeros(4), jac=True, method="L-BFGS-B", bounds=bounds)
    return np.asarray(found.x, dtype=float)


def _kept(ends: FloatArray, skew: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithm of the mass between `ends` (2, n_draw) of r by (2), (n_draw,), and its slopes by the constants, (4, n_draw)."""
    _, log_delta, xi, log_eta = skew
    t = np.stack(_straight_ends(ends, skew))
    log_kept = log_mass(t[0], t[1])
    by_t = np.array([[-1.0], [1.0]]) * np.exp(-(t**2) / 2 - 0.5 * np.log(2 * np.pi) - log_kept)
    by_z = by_t * np.sqrt(1 + t**2)
    s = np.where(np.isfinite(ends), (ends - xi) * np.exp(-log_eta), 0.0)
    by_s = by_z * np.exp(log_delta) / np.sqrt(1 + s**2)
    slopes = np.stack([-by_z, by_z * np.exp(log_delta) * np.arcsinh(s), -by_s * np.exp(-log_eta), -by_s * s])
    return log_kept, np.asarray(np.sum(slopes, axis=1), dtype=float)


def _straight_ends(ends: FloatArray, skew: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The t of (2) at ends (2, n_draw) of r, for `skew` (4,); far out where there is none."""
    epsilon, log_delta, xi, log_eta = skew
    arc = np.exp(log_delta) * np.arcsinh((ends - xi) * np.exp(-log_eta)) - epsilon
    low, high = np.sinh(np.clip(arc, -_ENDLESS, _ENDLESS))
    return low, high


def _bending(x: FloatArray, share: FloatArray, ends: FloatArray) -> FloatArray:
    """The ends (n, 2) of those columns of x (n_draw, n) whose values bend at them, infinite for the others."""
    values, _ = _followed(x, ends)
    x, values = x - share @ x, values - share @ values
    squares = (share @ x**2) * (share @ values**2)
    bend = 1 - np.divide((share @ (x * values)) ** 2, squares, out=np.ones_like(squares), where=squares > 0)
    return np.where((bend > _LEAST_BEND)[:, None], ends, ENDLESS)


def _has_ends(ends: FloatArray) -> BoolArray:
    return np.asarray(np.any(np.isfinite(ends), axis=-1), dtype=bool)


def _followed(x: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The values v that lines follow at x (n_draw, n), and log dv / dx of each, (n_draw, n)."""
    ended = np.flatnonzero(_has_ends(ends))
    values, log_slopes = x.copy() if ended.size else x, np.zeros_like(x)
    for k in ended:
        values[:, k], log_slopes[:, k] = value_at(x[:, k], *ends[k])
    return values, log_slopes


def _bent(u: FloatArray) -> FloatArray:
    """Terms phi of (1): u and its products, bounded, (n_draw, n_phi)."""
    bounded = _BEND * np.tanh(u / _BEND)
    i, j = np.triu_indices(u.shape[1])
    return np.concatenate([bounded, bounded[:, i] * bounded[:, j]], axis=1)


def _terms_of(n_scale: int, k: int) -> Indices:
    """Terms of phi that coordinate k may depend on: those of scales before it."""
    i, j = np.triu_indices(n_scale)
    last = np.concatenate([np.arange(n_scale), np.maximum(i, j)])
    return np.flatnonzero(last < k)


def _ordered(n: int, scales: Sequence[int], groups: Sequence[Indices]) -> tuple[Indices, Indices]:
    """Columns in the order of y, scales first and groups last, and the number of the group of each."""
    grouped = [int(k) for group in groups for k in group]
    order = [*scales, *np.setdiff1d(np.arange(n), [*scales, *grouped]), *grouped]
    block = np.zeros(n, dtype=np.intp)
    block[n - len(grouped) :] = np.repeat(np.arange(1, len(groups) + 1), [len(group) for group in groups])
    return np.array(order, dtype=np.intp), block


def fit_funnel(
    x: FloatArray,
    scales: Sequence[int],
    weight: FloatArray | None = None,
    groups: Sequence[Indices] = (),
    ends: FloatArray | None = None,
) -> Funnel:
    """Fit a proposal to draws of a posterior.

    Parameters
    ----------
    x : (n_draw, n), many more than the largest group and those in none have.
    scales : columns that set the widths of the others, in no group.
    weight : (n_draw,), of each draw; equal if None.
    groups : columns of each group.
    ends : (n, 2), of the values whose normal scores the columns are, infinite where they have none; None if none has. Those
        whose values bend where the draws are come right after the scales.
    """
    n_draw, n = x.shape
    share = np.full(n_draw, 1 / n_draw) if weight is None else weight / np.sum(weight)
    effective = 1 / float(np.sum(share**2))
    ends = _bending(x, share, np.tile(ENDLESS, (n, 1)) if ends is None else ends)
    lead = [*scales, *np.setdiff1d(np.flatnonzero(_has_ends(ends)), scales)]
    order, block = _ordered(n, lead, groups)
    n_scale, n_lead = len(scales), len(lead)
    values, _ = _followed(x, ends)
    centre = share @ values
    spread = np.sqrt(share @ (values - centre) ** 2)
    y = ((values - centre) / spread)[:, order]
    phi = _bent(y[:, :n_scale])
    constant, linear, bent = np.zeros(n), np.zeros((n, n)), np.zeros((n, phi.shape[1]))
    width = np.zeros((n, 1 + phi.shape[1]))
    one = np.ones((n_draw, 1))
    for k in range(n):
        terms = _terms_of(n_scale, k)
        before = np.flatnonzero((block[:k] == 0) | (block[:k] == block[k]))
        means = np.concatenate([one, y[:, before], phi[:, terms]], axis=1)
        widths = np.concatenate([one, phi[:, terms]], axis=1)
        slopes, log_width = _fit_line(y[:, k], means, widths, share, effective)
        constant[k], linear[k, before], bent[k, terms] = slopes[0], slopes[1 : 1 + before.size], slopes[1 + before.size :]
        width[k, 0], width[k, 1 + terms] = log_width[0], log_width[1:]
    n_block = 1 + len(groups)
    tails = np.full(n_block, np.inf), np.ones(n_block)
    plain = Funnel(order, n_scale, centre, spread, constant, linear, bent, width, np.zeros((n_lead, 4)), ends, block, *tails)
    r = plain.residuals(x)
    skew = np.zeros((n_lead, 4))
    for line in np.setdiff1d(np.arange(n_lead), plain.ended):
        skew[line] = _fit_skew(r[:, line], share, effective)
    for line in plain.ended:
        middle, log_width = plain.line(line, y, phi)
        r_line = (y[:, line] - middle) * np.exp(-log_width)
        skew[line] = _fit_skew(r_line, share, effective, plain.ends_of_r(line, y, phi))
    plain = replace(plain, skew=skew)
    t = plain.residuals(x)
    freedom, scale = np.transpose(
        [_fit_tails(np.sum(t[:, block == k] ** 2, axis=1), int(np.sum(block == k)), share) for k in range(n_block)]
    )
    return replace(plain, freedom=freedom, scale=_WIDEN * scale)


def _fit_tails(square: FloatArray, n: int, share: FloatArray) -> tuple[float, float]:
    """Degrees of freedom and scale of the n-dimensional Student distribution of residuals whose squared lengths are given."""
    return max(
        ((f, float(s * np.sqrt((f - 2) / f))) for f in _FREEDOM for s in (0.8, 0.9, 1.0, 1.1, 1.2)),
        key=lambda c: float(share @ log_student(square, n, *c)),
    )


def _fit_line(
    y: FloatArray, means: FloatArray, widths: FloatArray, share: FloatArray, effective: float
) -> tuple[FloatArray, FloatArray]:
    """Slopes of the mean and of the logarithm of the width of one coordinate: least squares and a gamma regression in turn."""
    pull, width_pull = np.full(means.shape[1], _PULL / effective), np.full(widths.shape[1], _WIDTH_PULL / effective)
    pull[0] = width_pull[0] = 0.0
    slopes: FloatArray = np.zeros(means.shape[1])
    log_width: FloatArray = np.zeros(widths.shape[1])
    for turn in range(_ROUNDS):
        precision = share * np.exp(-2 * widths @ log_width)
        normal = (means * precision[:, None]).T @ means
        held = normal + np.diag(pull * np.sum(precision) + 1e-12 * np.trace(normal))
        slopes = np.asarray(np.linalg.solve(held, means.T @ (precision * y)), dtype=float)
        residual = y - means @ slopes
        if turn == 0:
            log_width[0] = 0.5 * np.log(share @ residual**2 + 1e-300)
        for _ in range(2):
            square = np.minimum((residual * np.exp(-widths @ log_width)) ** 2, _OUTLIER)
            gradient = widths.T @ (share * (square - 1)) - width_pull * log_width
            curvature = 2 * (widths * (share * np.maximum(square, 0.2))[:, None]).T @ widths + np.diag(width_pull + 1e-9)
            log_width = log_width + np.clip(np.linalg.solve(curvature, gradient), -1.0, 1.0)
    # Residuals of a fit are smaller than errors, by the share of the draws that its terms use up.
    log_width[0] -= 0.5 * np.log(max(1 - means.shape[1] / effective, 0.5))
    return slopes, log_width


def normal_funnel(
    centre: FloatArray,
    factor: FloatArray,
    scales: Sequence[int],
    freedom: float,
    widen: float,
    groups: Sequence[Indices] = (),
) -> Funnel:
    """Proposal of a Student density with given covariance, in the form of a funnel whose widths do not change.

    Parameters
    ----------
    centre : (n,), its mode.
    factor : (n, n), S with the covariance S S^T.
    scales : columns that come first.
    freedom : degrees of freedom.
    widen : factor by which it is wider than S.
    groups : columns of each group, given the others independent of each other in S S^T.
    """
    n = centre.size
    order, block = _ordered(n, scales, groups)
    covariance = factor @ factor.T
    spread = np.sqrt(np.diagonal(covariance))
    lower = np.linalg.cholesky((covariance / np.outer(spread, spread))[np.ix_(order, order)])
    # y = C t with C lower: y_k = sum of l_kj y_j + C_kk t_k, l = (D C^-1 - 1) negated off its diagonal.
    inverse = solve_triangular(lower, np.eye(n), lower=True) * np.diagonal(lower)[:, None]
    n_scale = len(scales)
    n_phi = n_scale + n_scale * (n_scale + 1) // 2
    width = np.zeros((n, 1 + n_phi))
    width[:, 0] = np.log(np.diagonal(lower))
    linear = np.where((block[:, None] == block) | (block == 0), np.eye(n) - inverse, 0.0)
    tails = np.full(1 + len(groups), freedom), np.full(1 + len(groups), widen)
    none, straight, endless = np.zeros((n, n_phi)), np.zeros((n_scale, 4)), np.tile(ENDLESS, (n, 1))
    return Funnel(order, n_scale, centre, spread, np.zeros(n), linear, none, width, straight, endless, block, *tails)


class Density(Protocol):
    """A density of points x (n_draw, n) that can be drawn from."""

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        ...

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        ...


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of densities, one for each mode of a posterior, with their shares (n_mode,)."""

    parts: tuple[Density, ...]
    shares: FloatArray

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        return np.asarray(logsumexp(self.log_parts(x), axis=0), dtype=float)

    def log_parts(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density of each part, times its share, (n_mode, n_draw)."""
        with np.errstate(divide="ignore"):
            return np.stack([part.log_density(x) for part in self.parts]) + np.log(self.shares)[:, None]

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        which = random.choice(len(self.parts), n_draw, p=self.shares)
        drawn = {int(k): self.parts[k].draw(random, int(np.sum(which == k))) for k in np.unique(which)}
        x = np.empty((n_draw, next(iter(drawn.values())).shape[1]))
        for k, of_part in drawn.items():
            x[which == k] = of_part
        return x


@dataclass(frozen=True, eq=False)
class Proposal(Mixture):
    """A mixture of funnels, one for each mode of a posterior, from each point of which there are steps nearby."""

    parts: tuple[Funnel, ...]

    def step(self, random: np.random.RandomState, x: FloatArray, length: float) -> FloatArray:
        """Step from x (n_draw, n) to points nearby, reversibly with respect to this density: preconditioned Crank-Nicolson.

        Each x belongs to one part, by its share there; its t is a normal vector over the root of a gamma variable, which is
        drawn given t, and the normal vector z becomes sqrt(1 - length^2) z + length times a new one (Cotter, Roberts, Stuart &
        White, Stat. Sci. 28 (2013) 424, Section 4.2, for a normal density; the gamma variable makes it one for Student's t).

        Parameters
        ----------
        random : the source of random numbers.
        x : where the steps begin.
        length : of the steps, in (0, 1]; 1 is a new place independent of x but for the part and the gamma variable.
        """
        log_parts = self.log_parts(x)
        total = np.cumsum(np.exp(log_parts - logsumexp(log_parts, axis=0)), axis=0)
        which = np.minimum(np.sum(random.random_sample(x.shape[0]) > total, axis=0), len(self.parts) - 1)
        y = np.empty_like(x)
        for k, part in enumerate(self.parts):
            y[which == k] = part.at(part.nearby(random, part.residuals(x[which == k]), length))
        return y


def fit_proposal(
    x: FloatArray,
    scales: Sequence[int],
    before: Proposal,
    groups: Sequence[Indices] = (),
    weight: FloatArray | None = None,
    ends: FloatArray | None = None,
) -> Proposal:
    """Fit each part of a mixture anew to the draws that belong to it.

    Parameters
    ----------
    x : (n_draw, n), draws of the posterior.
    scales : columns that set the widths of the others.
    before : the mixture that tells which draw belongs to which part; a part with too few draws for a fit, or all
        in one place, stays as it was.
    groups : columns of each group.
    weight : (n_draw,), of each draw; equal if None.
    ends : (n, 2), of the values whose normal scores the columns are, see `fit_funnel`.
    """
    share = np.full(x.shape[0], 1 / x.shape[0]) if weight is None else weight / np.sum(weight)
    which = np.argmax(before.log_parts(x), axis=0)
    least = _LEAST_DRAWS * (x.shape[1] - sum(map(len, groups)) + max(map(len, groups), default=0))
    parts = []
    for k, part in enumerate(before.parts):
        own = share[which == k]
        effective = np.sum(own) ** 2 / np.sum(own**2) if np.any(own > 0) else 0.0
        enough = effective >= least and bool(np.all(np.ptp(x[which == k], axis=0) > 0))
        parts.append(fit_funnel(x[which == k], scales, own, groups, ends) if enough else part)
    shares = np.maximum([np.sum(share[which == k]) for k in range(len(parts))], LEAST_SHARE)
    return Proposal(tuple(parts), shares / np.sum(shares))
