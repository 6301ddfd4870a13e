"""A newcomer of a calibrated lot in, how far it lies off what the lot lets one expect of it, quantity by quantity, out.

What its place in its own posterior tells is too little: that is drawn towards the lot, and where one quantity is off another
takes a part of it. So its readings y are held against what draws j of the lot foretell of a specimen that belongs, with the
specimen's own quantities at what the draw expects of them,

    y | j ~ N(m_j, S_j + D diag(tau_j^2) D^T + N N^T),                                                                 (1)

D the slopes of the readings by the quantities, tau_j their spreads, N the slopes by what nobody foretells (contact, load zero,
clock), m_j and S_j mean and covariance of the readings. The best estimate of a shift of one quantity with slopes D_q, all else
being as foretold, is

    t = D_q^T C^-1 (y - m) / (D_q^T C^-1 D_q) ± (D_q^T C^-1 D_q)^(-1/2),                                               (2)

m and C mean and covariance of (1) over all draws. Where it lies in its distribution, F(t), a mixture of normal ones over the
draws, is even for specimens that belong, so that Phi^-1 of it is standard normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtri_exp

from calib.catalogue import POOLED, UnknownName, unknowns_of
from calib.problem import Newcomer, PredictedReadings, lookup, model_sweeps, put_together
from calib.sampling import FirstEstimate, Stranger
from models.sensor import FloatArray, IntArray

# Draws of the lot, and step of the differences in coordinates and logarithms.
_DRAWS, _STEP = 400, 1e-3


def belongs(newcomer: Newcomer, own: FloatArray) -> tuple[Stranger, ...]:
    """Hold a newcomer against its lot by (2), in every quantity that its readings depend on and specimens may differ in.

    Parameters
    ----------
    newcomer : with its data.
    own : (n_own,), its own coordinates where its posterior lies; those of its presses count.

    Returns
    -------
    One for each quantity, its ratio over what the lot lets one expect; nothing where the forward model covers hardly any of
    what the lot foretells.
    """
    rows = np.unique(np.linspace(0, newcomer.lot.size - 1, _DRAWS).round().astype(np.int64))
    of_press = np.array([one.info.parameter in unknowns_of("sweep") for one in newcomer.own])
    place = np.where(of_press, own, newcomer.means[rows])
    foretold = _readings(newcomer, place, rows)
    if foretold is None or foretold.rows.size < rows.size // 2:
        return ()
    rows, place = foretold.rows, place[foretold.there]
    middle = int(np.argmin(np.sum((foretold.mean - np.median(foretold.mean, axis=0)) ** 2, axis=1)))
    slopes = _slopes(newcomer, place[middle], rows[middle])
    if slopes is None:
        return ()
    by_own, by_value = slopes
    spread = np.where(of_press, 1.0, newcomer.spreads[rows])
    each = foretold.covariance + np.einsum("pk,nk,qk->npq", by_own, spread**2, by_own)
    mean = np.mean(foretold.mean, axis=0)
    whole = np.mean(each, axis=0) + np.cov(foretold.mean, rowvar=False)
    found = []
    for quantity, slope in by_value.items():
        told = np.linalg.solve(whole, slope)
        precision = float(slope @ told)
        if not precision > 0:
            continue
        shift, sd = float(told @ (foretold.observed - mean)) / precision, precision**-0.5
        width = np.sqrt(np.einsum("p,npq,q->n", told, each, told))
        away = (told @ foretold.observed - foretold.mean @ told) / width
        below, above = (float(logsumexp(log_ndtr(side * away))) - np.log(away.size) for side in (1, -1))
        z = float(ndtri_exp(min(below, 0.0))) if below < above else -float(ndtri_exp(min(above, 0.0)))
        ratio = float(np.exp(shift))
        found.append(Stranger(newcomer.name, FirstEstimate(ratio, ratio * sd), z, quantity))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Foretold:
    """Readings of all channels, one after the other, for draws of the lot that are covered: `there` of those asked, `rows`."""

    there: IntArray
    rows: IntArray
    mean: FloatArray
    covariance: FloatArray
    observed: FloatArray


def _readings(newcomer: Newcomer, place: FloatArray, rows: IntArray) -> _Foretold | None:
    models = newcomer.respond(place, rows)
    covered = np.all([model.covered for model in models], axis=0)
    if not np.any(covered):
        return None
    channels = [some.readings.only(covered[some.covered]) for some in put_together(newcomer.plans, models)]
    mean = np.concatenate([c.mean for c in channels], axis=1)
    covariance = np.zeros((*mean.shape, mean.shape[1]))
    first = 0
    for channel in channels:
        part = slice(first, first + channel.observed.size)
        covariance[:, part, part] = _covariance(channel)
        first = part.stop
    there = np.flatnonzero(covered)
    return _Foretold(there, rows[there], mean, covariance, np.concatenate([c.observed for c in channels]))


def _covariance(channel: PredictedReadings) -> FloatArray:
    modes = channel.modes
    return np.asarray(modes @ np.swapaxes(modes, 1, 2) + channel.variance[:, :, None] * np.eye(channel.observed.size))


def _slopes(newcomer: Newcomer, place: FloatArray, row: int) -> tuple[FloatArray, dict[str, FloatArray]] | None:
    """Slopes of the readings by each own coordinate (n_point, n_own), and by the logarithm of each quantity, (n_point,)."""
    n = place.size
    rows = np.full(1 + 2 * n, row)
    steps = _STEP * np.eye(n)
    values = newcomer.values(place + np.concatenate([np.zeros((1, n)), steps, -steps]), rows)
    name = newcomer.name
    found = ((q, lookup(values, q, name)) for q in POOLED)
    known = {q: column for q, column in found if column is not None and np.all(column > 0)}
    more: dict[str, FloatArray] = {key: np.concatenate([v, np.full(2 * len(known), v[0])]) for key, v in values.items()}
    for k, (quantity, value) in enumerate(known.items()):
        column = np.concatenate([value, np.full(2 * len(known), value[0])])
        first = rows.size + 2 * k
        column[first : first + 2] = value[0] * np.exp([_STEP, -_STEP])
        more[str(UnknownName(quantity, name))] = column
    models = list(model_sweeps(newcomer, newcomer.forward, newcomer.plans, more))
    if not all(np.all(model.covered) for model in models):
        return None
    mean = np.concatenate([some.readings.mean for some in put_together(newcomer.plans, models)], axis=1)
    by_own = (mean[1 : n + 1] - mean[n + 1 : 2 * n + 1]).T / (2 * _STEP)
    pairs = mean[2 * n + 1 :].reshape(len(known), 2, -1)
    by_value = {q: (pair[0] - pair[1]) / (2 * _STEP) for q, pair in zip(known, pairs, strict=True)}
    return by_own, {q: slope for q, slope in by_value.items() if np.any(slope != 0)}
