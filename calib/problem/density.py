"""What a channel should read in, the log density of what was read out: of all points, and of some given the others.

The covariance is D + W W^T, diagonal plus low rank, W the modes of the forward model's own error and of the discrepancy. With r
the residuals and

    A = 1 + [W r]^T D^-1 [W r] = L L^T                                                                            (1)

the last diagonal element of L is the root of 1 + r^T (D + W W^T)^-1 r (Woodbury), and the product of the others squared is
det(D + W W^T) / det D. A is a sum over points, so that some of them are left out by leaving out their terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate
from operator import add

import numpy as np

from calib.problem.readings import PredictedReadings
from models.rows import whole_groups
from models.sensor import BoolArray, FloatArray, IntArray

#: Points of a block of `log_normal_blocks`, about.
BLOCK_POINTS = 8

_LOG_2_PI = float(np.log(2 * np.pi))


def log_normal(channel: PredictedReadings) -> FloatArray:
    """Log density of the observed readings, (n_draw,).

    The density is -inf where the model error exceeds the noise by so much (1e8 times) that A is not positive definite in double
    precision. A search may pass there, at a modulus of 1e20 Pa; no posterior holds such a draw.
    """
    return log_normal_of(terms_of(channel))


@dataclass(frozen=True, eq=False)
class Terms:
    """What some points of a channel add to (1), so that all points need not be there at once.

    Attributes
    ----------
    gram : in A, (n_draw, k, k), of which only the lower triangle counts.
    log_variance : (n_draw,), in the logarithm of det D.
    n_point : how many they are.
    """

    gram: FloatArray
    log_variance: FloatArray
    n_point: int

    def only(self, rows: BoolArray) -> Terms:
        """Of some of the draws."""
        return self if np.all(rows) else Terms(self.gram[rows], self.log_variance[rows], self.n_point)

    def __add__(self, other: Terms) -> Terms:
        return Terms(self.gram + other.gram, self.log_variance + other.log_variance, self.n_point + other.n_point)


def terms_of(channel: PredictedReadings, part: slice = slice(None)) -> Terms:
    """What the points of a channel, or some of them, add to (1).

    Parameters
    ----------
    channel : what should be read.
    part : which points; default all.
    """
    variance = channel.variance[:, part]
    with np.errstate(divide="ignore", invalid="ignore"):  # of noise so small that its square is zero there is no density
        return Terms(_gram(channel, part), np.sum(np.log(variance), axis=1), variance.shape[1])


def log_normal_of(terms: Terms) -> FloatArray:
    """Log density (n_draw,) of all points whose terms in (1) are summed up here; -inf as in `log_normal`."""
    return _density(terms.gram, terms.log_variance, terms.n_point)


def log_normal_blocks(channel: PredictedReadings, presses: Sequence[int] = ()) -> FloatArray:
    """Log density of each block of neighbouring points given the rest of the channel, (n_draw, n_block).

    log p(y_b | y_-b) = log p(y) - log p(y_-b), by (1) of all points and of all but the block. -inf as in `log_normal`.

    Parameters
    ----------
    channel : what should be read.
    presses : numbers of points of each of the presses that it is of, one after the other; default one press. Of several, each
        has its own blocks, and what repeats a block in the others is among the rest.
    """
    if len(presses) < 2:
        return _blocks_of_press(channel, slice(0, channel.observed.size), None)
    parts = _parts_of(presses)
    terms = [terms_of(channel, part) for part in parts]
    before, after = list(accumulate(terms)), list(accumulate(reversed(terms)))[::-1]
    columns = []
    for k, part in enumerate(parts):
        others = [*before[k - 1 : k], *after[k + 1 : k + 2]] if k else after[1:2]
        columns.append(_blocks_of_press(channel, part, reduce(add, others)))
    return np.concatenate(columns, axis=1)


def _blocks_of_press(channel: PredictedReadings, press: slice, others: Terms | None) -> FloatArray:
    """The same for the blocks of one press, given also what the points of other presses add."""
    terms = [terms_of(channel, part) for part in _blocks_in(press)]
    nothing = Terms(np.zeros_like(terms[0].gram), np.zeros_like(terms[0].log_variance), 0)

    def density(some: Sequence[Terms]) -> FloatArray:
        of_press = reduce(add, some, nothing)
        return log_normal_of(of_press if others is None else of_press + others)

    whole = density(terms)
    columns = []
    for k in range(len(terms)):
        # What remains is summed anew: a difference would lose the digits of what a block is much of.
        rest = density([*terms[:k], *terms[k + 1 :]])
        columns.append(
            np.where(np.isfinite(whole) & np.isfinite(rest), whole - np.where(np.isfinite(rest), rest, 0.0), -np.inf)
        )
    return np.stack(columns, axis=1)


def _parts_of(presses: Sequence[int]) -> list[slice]:
    """Where presses of so many points each stand, one after the other."""
    return [slice(int(end) - n, int(end)) for end, n in zip(np.cumsum(presses), presses, strict=True)]


def _blocks_in(press: slice) -> list[slice]:
    """Where the blocks of a press stand."""
    return [
        slice(press.start + int(block[0]), press.start + int(block[-1]) + 1) for block in blocks_of(press.stop - press.start)
    ]


def level_of_blocks(channel: PredictedReadings, presses: Sequence[int] = ()) -> FloatArray:
    """How far the sum of each block of neighbouring points is off what the rest of the channel foretells, (n_draw, n_block).

    With Q the inverse of the covariance and r the residuals, those of a block b are normal given all others, with the
    covariance Q_bb^-1, and off their mean by Q_bb^-1 (Q r)_b (Buerkner, Gabry, Vehtari, Comput. Stat. 36 (2021) 1243). Hence
    1^T Q_bb^-1 (Q r)_b / sqrt(1^T Q_bb^-1 1), which is standard normal where the draw is what the readings come from.

    Parameters
    ----------
    channel, presses : as in `log_normal_blocks`.

    Returns
    -------
    In standard deviations, above zero where the readings are; nan where Q_bb is lost in rounding.
    """
    scale = np.sqrt(channel.variance)
    modes, gain, weighted = _weighted(channel, scale)
    every = [slice(0, channel.observed.size)] if len(presses) < 2 else _parts_of(presses)
    columns = []
    for part in (block for press in every for block in _blocks_in(press)):
        own = np.eye(part.stop - part.start) - np.matmul(modes[:, part], gain[..., part])
        level = _solve(own, scale[:, part, None])[..., 0]
        variance = np.sum(level * scale[:, part], axis=1)
        columns.append(np.sum(level * weighted[:, part], axis=1) / np.sqrt(np.where(variance > 0, variance, np.nan)))
    return np.stack(columns, axis=1)


def _weighted(channel: PredictedReadings, scale: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """In units of the noise W, G = (1 + W^T W)^-1 W^T and Q r, where Q = 1 - W G (Woodbury)."""
    residual = (channel.observed - channel.mean) / scale
    modes = channel.modes / scale[..., None]
    across = np.swapaxes(modes, 1, 2)
    gain = _solve(np.eye(modes.shape[-1]) + np.matmul(across, modes), across)
    return modes, gain, residual - np.matmul(modes, np.matmul(gain, residual[..., None]))[..., 0]


def given_other_points(channel: PredictedReadings) -> tuple[FloatArray, FloatArray]:
    """What each point of a channel should read if all its other points are known: mean and variance, (n_covered, n_point).

    With Q the inverse of the covariance and r the residuals it is normal with mean y_i - (Q r)_i / Q_ii and variance
    1 / Q_ii (Buerkner, Gabry, Vehtari, Comput. Stat. 36 (2021) 1243, Eq. 10-13).

    Returns
    -------
    mean, variance : SI; nan where Q_ii is lost in rounding, as in `log_normal`.
    """
    scale = np.sqrt(channel.variance)
    modes, gain, weighted = _weighted(channel, scale)
    q = 1 - np.sum(modes * np.swapaxes(gain, 1, 2), axis=-1)
    q = np.where(q > 0, q, np.nan)
    return channel.observed - scale * weighted / q, channel.variance / q


def log_likelihood_points(channel: PredictedReadings) -> FloatArray:
    """Log density of each point of a channel given all its other points and the draw, (n_covered, n_point).

    log p(y_i | y_-i, theta), what leave-one-out needs where residuals are correlated, see `given_other_points`: blocks of one
    point of `log_normal_blocks`. -inf where rounding leaves nothing of it.
    """
    return point_densities(channel.observed, *given_other_points(channel))


def point_densities(observed: FloatArray, mean: FloatArray, variance: FloatArray) -> FloatArray:
    """Log densities of what was read (n_point,), each normal with this mean and variance (n_draw, n_point); -inf for nan.

    Parameters
    ----------
    observed : SI.
    mean, variance : from `given_other_points`.
    """
    density = -0.5 * ((observed - mean) ** 2 / variance + np.log(variance) + _LOG_2_PI)
    return np.where(np.isfinite(density), density, -np.inf)


def chi_square(channel: PredictedReadings) -> FloatArray:
    """Misfit r^T (D + W W^T)^-1 r of the observed readings, (n_draw,): of as many degrees of freedom as there are points."""
    gram = _gram(channel, slice(None))
    return np.asarray(_cholesky_diagonal(_plus_one(gram))[:, -1] ** 2 - 1.0, dtype=float)


def blocks_of(n_point: int) -> list[IntArray]:
    """Indices of neighbouring points, about `BLOCK_POINTS` in each block."""
    return list(np.array_split(np.arange(n_point), max(1, round(n_point / BLOCK_POINTS)))) if n_point else []


def _gram(channel: PredictedReadings, part: slice) -> FloatArray:
    """The terms of some points in A of (1), (n_draw, k, k), of which only the lower triangle counts.

    The columns of W come in the order discrepancy, own error. Where a factor is the same for all draws, as the correlation of
    the discrepancy is, one product of matrices serves them all.
    """
    weight = 1.0 / channel.variance[:, part]
    n_draw, n_point = weight.shape
    if channel.discrepancy is not None and channel.discrepancy.correlation.modes.ndim == 3:
        of_discrepancy = channel.discrepancy.sd[:, part, None] * channel.discrepancy.correlation.modes[:, part]
        residual = channel.observed[part] - channel.mean[:, part]
        wide = np.concatenate([of_discrepancy, channel.error[:, part], residual[..., None]], axis=-1)
        return np.asarray(np.matmul(np.swapaxes(wide * weight[..., None], 1, 2), wide), dtype=float)
    n_error = channel.error.shape[-1]
    columns = np.empty((n_error + 1, n_draw, n_point))
    columns[:n_error] = channel.error[:, part].transpose(2, 0, 1)
    np.subtract(channel.observed[part], channel.mean[:, part], out=columns[n_error])
    weighted = columns * weight
    own = np.matmul(weighted.transpose(1, 0, 2), columns.transpose(1, 2, 0))
    if channel.discrepancy is None:
        return np.asarray(own, dtype=float)
    sd, modes = channel.discrepancy.sd[:, part], channel.discrepancy.correlation.modes[part]
    rank = modes.shape[1]
    gram = np.zeros((n_draw, rank + n_error + 1, rank + n_error + 1))
    pairs = (modes[:, :, None] * modes[:, None, :]).reshape(n_point, -1)
    gram[:, :rank, :rank] = (whole_groups(sd * sd * weight) @ pairs)[:n_draw].reshape(n_draw, rank, rank)
    weighted *= sd
    across = (whole_groups(weighted.reshape(-1, n_point)) @ modes)[: len(columns) * n_draw]
    gram[:, rank:, :rank] = across.reshape(len(columns), n_draw, rank).transpose(1, 0, 2)
    gram[:, rank:, rank:] = own
    return gram


def _plus_one(gram: FloatArray) -> FloatArray:
    return gram + np.eye(gram.shape[-1])


def _density(gram: FloatArray, log_variance: FloatArray, n_point: int) -> FloatArray:
    """Log density (n_draw,) of points with these terms in A, and this sum of the logarithms of D."""
    diagonal = _cholesky_diagonal(_plus_one(gram))
    log_det = log_variance + 2 * np.sum(np.log(diagonal[:, :-1]), axis=1)
    density = -0.5 * (log_det + diagonal[:, -1] ** 2 - 1.0 + n_point * _LOG_2_PI)
    return np.where(np.isfinite(density), density, -np.inf)


def _cholesky_diagonal(matrices: FloatArray) -> FloatArray:
    """Diagonals (n, k) of the Cholesky factors of (n, k, k) matrices; inf for one that is not positive definite."""
    try:
        return np.diagonal(np.linalg.cholesky(matrices), axis1=1, axis2=2)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(matrices.shape[:2], np.inf)
        half = len(matrices) // 2
        return np.concatenate([_cholesky_diagonal(matrices[:half]), _cholesky_diagonal(matrices[half:])])


def _solve(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions (n, k, m) of systems (n, k, k) with right sides (n, k, m); nan for one whose matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right), dtype=float)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan)
        half = len(matrices) // 2
        return np.concatenate([_solve(matrices[:half], right[:half]), _solve(matrices[half:], right[half:])])
