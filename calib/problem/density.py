"""What a channel should read in, the log density of what was read out: of all points, and of some given the others.

The covariance is D + W W^T, diagonal plus low rank, W the modes of the forward model's own error and of the discrepancy. With r
the residuals and

    A = 1 + [W r]^T D^-1 [W r] = L L^T                                                                            (1)

the last diagonal element of L is the root of 1 + r^T (D + W W^T)^-1 r (Woodbury), and the product of the others squared is
det(D + W W^T) / det D. A is a sum over points, so that some of them are left out by leaving out their terms.

Presses p that repeat each other share the errors W and differ by a discrepancy of their own, with modes O_p, o of (1) of
`calib.problem.plan` times as much as the shared one has. A is then the sum over presses of

    [W_p r_p]^T (D_p + O_p O_p^T)^-1 [W_p r_p],   (D + O O^T)^-1 = D^-1 - D^-1 O (1 + O^T D^-1 O)^-1 O^T D^-1         (2)

so that their density costs as much as those of as many presses by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.problem.readings import PredictedReadings, Readings
from models.rows import whole_groups
from models.sensor import BoolArray, FloatArray, IntArray

#: Points of a block of `log_normal_blocks`, about.
BLOCK_POINTS = 8

_LOG_2_PI = float(np.log(2 * np.pi))


def log_normal(readings: Readings) -> FloatArray:
    """Log density of the observed readings, (n_draw,).

    The density is -inf where the model error exceeds the noise by so much (1e8 times) that A is not positive definite in double
    precision. A search may pass there, at a modulus of 1e20 Pa; no posterior holds such a draw.

    Parameters
    ----------
    readings : of one press, or of presses that repeat each other.
    """
    return density_of_terms([terms_of_press(press, alone=len(readings.presses) == 1) for press in readings.presses])


@dataclass(frozen=True, eq=False)
class Terms:
    """What some points of a press add to a log density.

    Attributes
    ----------
    gram : in A of (1), (n_draw, k, k), of which only the lower triangle counts.
    log_det : (n_draw,), logarithm of the determinant of what is not shared of their covariance.
    n_point : how many they are.
    """

    gram: FloatArray
    log_det: FloatArray
    n_point: int

    def only(self, rows: BoolArray) -> Terms:
        """Of some of the draws."""
        return self if np.all(rows) else Terms(self.gram[rows], self.log_det[rows], self.n_point)

    def __add__(self, other: Terms) -> Terms:
        return Terms(self.gram + other.gram, self.log_det + other.log_det, self.n_point + other.n_point)


def terms_of_press(press: PredictedReadings, *, alone: bool) -> Terms:
    """What a press adds to the log density of all that repeat each other.

    Parameters
    ----------
    press : what should be read in it.
    alone : whether no other press repeats it, or none is asked for: all of its discrepancy is one then.
    """
    log_variance = np.sum(np.log(press.variance), axis=1)
    terms = Terms(_gram(press, slice(None)), log_variance, press.observed.size)
    return terms if alone else _of_one_among_others(terms, press)


def density_of_terms(terms: Sequence[Terms]) -> FloatArray:
    """Log density (n_draw,) of presses that repeat each other, or of one press, from what each of them adds.

    Parameters
    ----------
    terms : of each press, for the same draws.
    """
    whole = terms[0]
    for other in terms[1:]:
        whole = whole + other
    return _density(whole.gram, whole.log_det, whole.n_point)


def _of_one_among_others(terms: Terms, press: PredictedReadings) -> Terms:
    """Equation (2): terms of a press, or of some of its points, without what its own discrepancy takes of them."""
    if press.discrepancy is None:
        return terms
    own, rank = press.discrepancy.correlation.own, press.discrepancy.correlation.modes.shape[1]
    # All of the discrepancy has the columns U; the own one has those times root of o, the shared one times root of 1 - o.
    of_modes, across = terms.gram[:, :rank, :rank], terms.gram[:, rank:, :rank]
    inner = _plus_one(own * of_modes)
    solved = _solve(inner, np.concatenate([of_modes, np.swapaxes(across, 1, 2)], axis=2))
    gram = np.zeros_like(terms.gram)
    gram[:, :rank, :rank] = (1 - own) * solved[:, :, :rank]
    gram[:, rank:, :rank] = np.sqrt(1 - own) * np.swapaxes(solved[:, :, rank:], 1, 2)
    gram[:, rank:, rank:] = terms.gram[:, rank:, rank:] - own * across @ solved[:, :, rank:]
    log_det = terms.log_det + 2 * np.sum(np.log(_cholesky_diagonal(inner)), axis=1)
    return Terms(gram, log_det, terms.n_point)


def log_normal_blocks(readings: Readings) -> FloatArray:
    """Log density of each block of neighbouring points given all other readings, (n_draw, n_block).

    log p(y_b | y_-b) = log p(y) - log p(y_-b), by (1) of all points and of all but the block. -inf as in `log_normal`.

    Parameters
    ----------
    readings : of one press; or of presses that repeat each other, block after block of one after the other: a block is then
        given those of the other presses, too.
    """
    alone = len(readings.presses) == 1
    if alone:
        return _blocks_of_press(readings.presses[0], None, None)
    whole = [terms_of_press(press, alone=False) for press in readings.presses]
    before, after = [whole[0]], [whole[-1]]  # sums from the first press on, and to the last
    for k in range(1, len(whole)):
        before.append(before[-1] + whole[k])
        after.append(whole[-1 - k] + after[-1])
    density, columns = density_of_terms(whole), []
    for k, press in enumerate(readings.presses):
        others = [*([before[k - 1]] if k else []), *([after[len(whole) - 2 - k]] if k + 1 < len(whole) else [])]
        columns.append(_blocks_of_press(press, others[0] if len(others) == 1 else others[0] + others[1], density))
    return np.concatenate(columns, axis=1)


def _blocks_of_press(press: PredictedReadings, others: Terms | None, density: FloatArray | None) -> FloatArray:
    """Blocks of one press, (n_draw, n_block): by itself, or beside what others add, all of the density `density` (n_draw,)."""
    parts = [slice(int(block[0]), int(block[-1]) + 1) for block in blocks_of(press.observed.size)]
    grams = [_gram(press, part) for part in parts]
    log_variances = [np.sum(np.log(press.variance[:, part]), axis=1) for part in parts]
    sizes = [part.stop - part.start for part in parts]
    whole = density
    if whole is None:
        whole = _density(np.sum(grams, axis=0), np.sum(log_variances, axis=0), sum(sizes))
    columns = []
    for k in range(len(parts)):
        # What remains is summed anew: a difference would lose the digits of what a block is much of.
        gram, log_variance = np.zeros_like(grams[k]), np.zeros_like(log_variances[k])
        for other in range(len(parts)):
            if other != k:
                gram += grams[other]
                log_variance += log_variances[other]
        left = Terms(gram, log_variance, sum(sizes) - sizes[k])
        if others is not None:
            left = _of_one_among_others(left, press) + others
        rest = _density(left.gram, left.log_det, left.n_point)
        columns.append(
            np.where(np.isfinite(whole) & np.isfinite(rest), whole - np.where(np.isfinite(rest), rest, 0.0), -np.inf)
        )
    return np.stack(columns, axis=1)


def given_other_points(readings: Readings) -> tuple[FloatArray, FloatArray]:
    """What each point should read if all others are known: mean and variance, (n_covered, n_point).

    With Q the inverse of the covariance and r the residuals it is normal with mean y_i - (Q r)_i / Q_ii and variance
    1 / Q_ii (Buerkner, Gabry, Vehtari, Comput. Stat. 36 (2021) 1243, Eq. 10-13).

    Parameters
    ----------
    readings : of one press; or of presses that repeat each other, one after the other: a point is then given all of theirs.

    Returns
    -------
    mean, variance : SI; nan where Q_ii is lost in rounding, as in `log_normal`.
    """
    if len(readings.presses) > 1:
        return _given_all_presses(readings.presses)
    channel = readings.presses[0]
    scale = np.sqrt(channel.variance)
    residual = (channel.observed - channel.mean) / scale
    modes = channel.modes / scale[..., None]
    across = np.swapaxes(modes, 1, 2)
    # Woodbury, in units of the noise: Q = 1 - W (1 + W^T W)^-1 W^T.
    gain = _solve(np.eye(modes.shape[-1]) + np.matmul(across, modes), across)
    q = 1 - np.sum(modes * np.swapaxes(gain, 1, 2), axis=-1)
    q = np.where(q > 0, q, np.nan)
    weighted = residual - np.matmul(modes, np.matmul(gain, residual[..., None]))[..., 0]
    return channel.observed - scale * weighted / q, channel.variance / q


def _given_all_presses(presses: Sequence[PredictedReadings]) -> tuple[FloatArray, FloatArray]:
    scales = [np.sqrt(press.variance) for press in presses]
    parts = []
    inner: FloatArray | float = 0.0
    for press, scale in zip(presses, scales, strict=True):
        own, shared = (modes / scale[..., None] for modes in own_and_shared_modes(press))
        residual = ((press.observed - press.mean) / scale)[..., None]
        wide = np.concatenate([shared, residual], axis=2)
        gain = _solve(_plus_one(np.swapaxes(own, 1, 2) @ own), np.swapaxes(own, 1, 2))
        parts.append((wide - own @ (gain @ wide), 1 - np.sum(own * np.swapaxes(gain, 1, 2), axis=-1)))
        inner = inner + np.swapaxes(wide, 1, 2) @ parts[-1][0]
    whole = np.asarray(inner, dtype=float)
    matrix, right = _plus_one(whole[:, :-1, :-1]), whole[:, :-1, -1:]
    means, variances = [], []
    for press, scale, (weighted, diagonal) in zip(presses, scales, parts, strict=True):
        shared, residual = weighted[..., :-1], weighted[..., -1]
        gain = _solve(matrix, np.concatenate([np.swapaxes(shared, 1, 2), right], axis=2))
        q = diagonal - np.sum(shared * np.swapaxes(gain[..., :-1], 1, 2), axis=-1)
        q = np.where(q > 0, q, np.nan)
        means.append(press.observed - scale * (residual - (shared @ gain[..., -1:])[..., 0]) / q)
        variances.append(press.variance / q)
    return np.concatenate(means, axis=1), np.concatenate(variances, axis=1)


def own_and_shared_modes(press: PredictedReadings) -> tuple[FloatArray, FloatArray]:
    """Factors of what is a press's own of its correlated errors, and of what it shares with the presses that repeat it.

    Returns
    -------
    O_p and W_p of (2), (n_covered, n_point, n_mode), SI, the latter with the forward model's own error first.
    """
    if press.discrepancy is None:
        return np.zeros((*press.mean.shape, 0)), press.error
    own, modes = press.discrepancy.correlation.own, press.discrepancy.correlation.modes
    discrepancy = press.discrepancy.sd[..., None] * modes
    return np.sqrt(own) * discrepancy, np.concatenate([press.error, np.sqrt(1 - own) * discrepancy], axis=-1)


def weighed(readings: Readings, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products of columns by the inverse of the covariance S of readings, which is of low rank (Woodbury).

    Parameters
    ----------
    readings : with S of each draw.
    columns : C, (n_point, k) for all draws or (n_draw, n_point, k).

    Returns
    -------
    C^T S^-1 C (n_draw, k, k), and log det S (n_draw,).
    """
    if len(readings.presses) > 1:
        return _weighed_together(readings.presses, columns)
    channel = readings.presses[0]
    modes, across = channel.modes, np.swapaxes(columns, -1, -2)
    weighted = modes / channel.variance[..., None]
    inner = np.asarray(np.linalg.cholesky(np.eye(modes.shape[-1]) + np.swapaxes(modes, 1, 2) @ weighted), dtype=float)
    shared = np.linalg.solve(inner, np.swapaxes(weighted, 1, 2) @ columns)
    own = (across / channel.variance[:, None, :]) @ columns
    log_det = np.sum(np.log(channel.variance), axis=1) + 2 * _log_diagonal(inner)
    return own - np.swapaxes(shared, 1, 2) @ shared, log_det


def _weighed_together(presses: Sequence[PredictedReadings], columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    whole: FloatArray | float = 0.0
    log_det: FloatArray | float = 0.0
    first = 0
    for press in presses:
        scale = np.sqrt(press.variance)
        own, shared = (modes / scale[..., None] for modes in own_and_shared_modes(press))
        of_press = columns[..., first : first + press.observed.size, :]
        first += press.observed.size
        wide = np.concatenate([shared, of_press / scale[..., None]], axis=2)
        inner = np.asarray(np.linalg.cholesky(_plus_one(np.swapaxes(own, 1, 2) @ own)), dtype=float)
        taken = np.linalg.solve(inner, np.swapaxes(own, 1, 2) @ wide)
        whole = whole + np.swapaxes(wide, 1, 2) @ wide - np.swapaxes(taken, 1, 2) @ taken
        log_det = log_det + np.sum(np.log(press.variance), axis=1) + 2 * _log_diagonal(inner)
    k = columns.shape[-1]
    product = np.asarray(whole, dtype=float)
    inner = np.asarray(np.linalg.cholesky(_plus_one(product[:, :-k, :-k])), dtype=float)
    taken = np.linalg.solve(inner, product[:, :-k, -k:])
    return product[:, -k:, -k:] - np.swapaxes(taken, 1, 2) @ taken, np.asarray(log_det + 2 * _log_diagonal(inner), dtype=float)


def covariance_of(readings: Readings) -> FloatArray:
    """Covariances S of readings, in full, (n_draw, n_point, n_point): for a few draws of a few presses."""
    if len(readings.presses) == 1:
        press = readings.presses[0]
        found = np.asarray(press.modes @ np.swapaxes(press.modes, 1, 2), dtype=float)
        points = np.arange(found.shape[-1])
        found[:, points, points] += press.variance
        return found
    modes = np.concatenate([own_and_shared_modes(press)[1] for press in readings.presses], axis=1)
    found, first = np.asarray(modes @ np.swapaxes(modes, 1, 2), dtype=float), 0
    for press in readings.presses:
        own, _ = own_and_shared_modes(press)
        part = np.arange(first, first + press.observed.size)
        found[:, part[:, None], part] += own @ np.swapaxes(own, 1, 2)
        found[:, part, part] += press.variance
        first += part.size
    return found


def log_likelihood_points(readings: Readings) -> FloatArray:
    """Log density of each point given all others and the draw, (n_covered, n_point).

    log p(y_i | y_-i, theta), what leave-one-out needs where residuals are correlated, see `given_other_points`: blocks of one
    point of `log_normal_blocks`. -inf where rounding leaves nothing of it.
    """
    return point_densities(readings.observed, *given_other_points(readings))


def point_densities(observed: FloatArray, mean: FloatArray, variance: FloatArray) -> FloatArray:
    """Log densities of what was read (n_point,), each normal with this mean and variance (n_draw, n_point); -inf for nan.

    Parameters
    ----------
    observed : SI.
    mean, variance : from `given_other_points`.
    """
    density = -0.5 * ((observed - mean) ** 2 / variance + np.log(variance) + _LOG_2_PI)
    return np.where(np.isfinite(density), density, -np.inf)


def chi_square(readings: Readings) -> FloatArray:
    """Misfit r^T S^-1 r of the observed readings, (n_draw,): of as many degrees of freedom as there are points."""
    alone = len(readings.presses) == 1
    gram = sum(terms_of_press(press, alone=alone).gram for press in readings.presses)
    return np.asarray(_cholesky_diagonal(_plus_one(np.asarray(gram)))[:, -1] ** 2 - 1.0, dtype=float)


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


def _log_diagonal(factors: FloatArray) -> FloatArray:
    """Sums of the logarithms on the diagonals of triangular factors (n, k, k), (n,)."""
    return np.asarray(np.sum(np.log(np.diagonal(factors, axis1=1, axis2=2)), axis=1), dtype=float)


def _solve(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions (n, k, m) of systems (n, k, k) with right sides (n, k, m); nan for one whose matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right), dtype=float)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan)
        half = len(matrices) // 2
        return np.concatenate([_solve(matrices[:half], right[:half]), _solve(matrices[half:], right[half:])])
