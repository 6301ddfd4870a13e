"""Draws of a posterior in, the funnel that is fitted to them out; or the funnel of a density whose covariance is known.

Each line of a funnel, (1) of `calib.sampling.funnel`, is a regression with unequal variances on the draws. Its widths are
bounded, because widths that shrank with the scales for ever would leave the proposal far too narrow where the posterior's have
long become constant: chains stuck there. With groups a few draws tell the few slopes that are left, and the tails of one group
do not stretch another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from calib.sampling.ends import ENDLESS
from calib.sampling.funnel import Funnel, Indices, followed_values, has_ends, log_student, scale_terms
from calib.sampling.skew import fit_skew
from models.sensor import FloatArray

# Degrees of freedom of t to choose from; heavier tails than the draws show cost little and keep chains from sticking.
_FREEDOM = (3.0, 4.0, 6.0, 8.0, 12.0)
# Factor by which the proposal is wider than the draws it is fitted to.
_WIDEN = 1.05
# Rounds of the two regressions of a line; squared residuals above this, in variances, count as this in that of the widths.
_ROUNDS, _OUTLIER = 3, 12.0
# Others follow a value with an end, where so much of its variance is not in a straight line of x.
_LEAST_BEND = 0.003
# Weight of the assumption that slopes are zero, in draws: of the means, of the logarithms of the widths.
_PULL, _WIDTH_PULL = 0.03, 60.0


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
    lead = [*scales, *np.setdiff1d(np.flatnonzero(has_ends(ends)), scales)]
    order, block = _ordered(n, lead, groups)
    n_scale, n_lead = len(scales), len(lead)
    values, _ = followed_values(x, ends)
    centre = share @ values
    spread = np.sqrt(share @ (values - centre) ** 2)
    y = ((values - centre) / spread)[:, order]
    phi = scale_terms(y[:, :n_scale])
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
        skew[line] = fit_skew(r[:, line], share, effective)
    for line in plain.ended:
        middle, log_width = plain.line(line, y, phi)
        r_line = (y[:, line] - middle) * np.exp(-log_width)
        skew[line] = fit_skew(r_line, share, effective, plain.ends_of_r(line, y, phi))
    plain = replace(plain, skew=skew)
    t = plain.residuals(x)
    freedom, scale = np.transpose(
        [_fit_tails(np.sum(t[:, block == k] ** 2, axis=1), int(np.sum(block == k)), share) for k in range(n_block)]
    )
    return replace(plain, freedom=freedom, scale=_WIDEN * scale)


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


def _bending(x: FloatArray, share: FloatArray, ends: FloatArray) -> FloatArray:
    """The ends (n, 2) of those columns of x (n_draw, n) whose values bend at them, infinite for the others."""
    values, _ = followed_values(x, ends)
    x, values = x - share @ x, values - share @ values
    squares = (share @ x**2) * (share @ values**2)
    bend = 1 - np.divide((share @ (x * values)) ** 2, squares, out=np.ones_like(squares), where=squares > 0)
    return np.where((bend > _LEAST_BEND)[:, None], ends, ENDLESS)


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
