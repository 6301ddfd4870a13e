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

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtri_exp

from calib.catalogue import POOLED, UnknownName, unknowns_of
from calib.problem import Newcomer, PredictedReadings, lookup, model_sweeps, put_together
from calib.sampling import FirstEstimate, Stranger
from models.sensor import FloatArray, IntArray

#: Share [1] by which a quantity of the material of a specimen of another kind is off, which has to be told from the lot.
OFF = 0.25
# Draws of the lot, and step of the differences in coordinates and logarithms.
_DRAWS, _STEP = 400, 1e-3
# Logarithm beyond which a ratio is as good as nought or infinite.
_FARTHEST = 50.0


@dataclass(frozen=True)
class Belonging:
    """How far a newcomer lies off its lot, and how far one of another kind would.

    Attributes
    ----------
    strangers : of each quantity, how far it is off; nothing where the model covers hardly any of what the lot foretells.
    off : channel -> how far its readings are off what is foretold of them, the farthest as a share of the largest [1].
    of_another_kind : quantity of the material -> the largest z [1] by (2), of all quantities, of one whose readings are those
        foretold but for that quantity, which is off by `OFF`; of more and less the one that stands out less.
    """

    strangers: tuple[Stranger, ...] = ()
    off: Mapping[str, float] = field(default_factory=dict)
    of_another_kind: Mapping[str, float] = field(default_factory=dict)


def belongs(newcomer: Newcomer, own: FloatArray) -> Belonging:
    """Hold a newcomer against its lot by (2), in every quantity that its readings depend on and specimens may differ in.

    Parameters
    ----------
    newcomer : with its data.
    own : (n_own,), its own coordinates where its posterior lies; those of its presses count.

    Returns
    -------
    Quantity by quantity, the ratio over what the lot lets one expect, and whether (2) would tell one of another kind.
    """
    rows = np.unique(np.linspace(0, newcomer.lot.size - 1, _DRAWS).round().astype(np.int64))
    of_press = np.array([one.info.parameter in unknowns_of("sweep") for one in newcomer.own])
    place = np.where(of_press, own, newcomer.means[rows])
    foretold = _readings(newcomer, place, rows)
    if foretold is None or foretold.rows.size < rows.size // 2:
        return Belonging()
    rows, place = foretold.rows, place[foretold.there]
    middle = int(np.argmin(np.sum((foretold.mean - np.median(foretold.mean, axis=0)) ** 2, axis=1)))
    slopes = _slopes(newcomer, place[middle], rows[middle])
    if slopes is None:
        return Belonging()
    by_own, by_value = slopes
    spread = np.where(of_press, 1.0, newcomer.spreads[rows])
    each = foretold.covariance + np.einsum("pk,nk,qk->npq", by_own, spread**2, by_own)
    mean = np.mean(foretold.mean, axis=0)
    whole = np.mean(each, axis=0) + np.cov(foretold.mean, rowvar=False)
    tests = list(_tests(by_value, whole, each, foretold.mean))
    strangers = []
    for test in tests:
        ratio = float(np.exp(np.clip(test.told @ (foretold.observed - mean) / test.precision, -_FARTHEST, _FARTHEST)))
        shift = FirstEstimate(ratio, ratio * test.precision**-0.5)
        strangers.append(Stranger(newcomer.name, shift, test.z(foretold.observed), test.quantity))
    # Force and capacitance are proportional to what they are of: to first order in the quantity, not its logarithm.
    off = {q: OFF * by_value[q] for q in by_value if q in unknowns_of("material")}
    ways = {q: [max(abs(test.z(mean + way * step)) for test in tests) for way in (1, -1)] for q, step in off.items() if tests}
    return Belonging(tuple(strangers), _off(foretold, mean), {q: min(both) for q, both in ways.items()})


def _off(foretold: _Foretold, mean: FloatArray) -> dict[str, float]:
    """How far the readings of each channel are off, the farthest over the largest that is foretold."""
    found = {}
    for name in dict.fromkeys(foretold.channels):
        there = np.array([one == name for one in foretold.channels])
        largest = float(np.max(np.abs(mean[there])))
        found[name] = float(np.max(np.abs(foretold.observed - mean)[there])) / largest if largest > 0 else 0.0
    return found


@dataclass(frozen=True, eq=False)
class _Test:
    """The test (2) of a shift of one quantity: C^-1 D_q, D_q^T C^-1 D_q, and mean and sd of D_q^T C^-1 y by each draw."""

    quantity: str
    told: FloatArray
    precision: float
    middle: FloatArray
    width: FloatArray

    def z(self, readings: FloatArray) -> float:
        """How far readings (n_point,) lie off what is foretold: standard normal for a specimen that belongs."""
        away = (self.told @ readings - self.middle) / self.width
        below, above = (float(logsumexp(log_ndtr(side * away))) - np.log(away.size) for side in (1, -1))
        return float(ndtri_exp(min(below, 0.0))) if below < above else -float(ndtri_exp(min(above, 0.0)))


def _tests(by_value: Mapping[str, FloatArray], whole: FloatArray, each: FloatArray, mean: FloatArray) -> Iterator[_Test]:
    for quantity, slope in by_value.items():
        told = np.linalg.solve(whole, slope)
        precision = float(slope @ told)
        if precision > 0:
            width = np.sqrt(np.einsum("p,npq,q->n", told, each, told))
            yield _Test(quantity, np.asarray(told), precision, np.asarray(mean @ told), width)


@dataclass(frozen=True, eq=False)
class _Foretold:
    """Readings of all channels, one after the other, for draws of the lot that are covered: `there` of those asked, `rows`."""

    channels: tuple[str, ...]  # of each reading

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
    together = list(put_together(newcomer.plans, models))
    channels = [some.readings.only(covered[some.covered]) for some in together]
    names = tuple(some.repeats.channel for some in together for _ in range(some.readings.observed.size))
    mean = np.concatenate([c.mean for c in channels], axis=1)
    covariance = np.zeros((*mean.shape, mean.shape[1]))
    first = 0
    for channel in channels:
        part = slice(first, first + channel.observed.size)
        covariance[:, part, part] = _covariance(channel)
        first = part.stop
    there = np.flatnonzero(covered)
    return _Foretold(names, there, rows[there], mean, covariance, np.concatenate([c.observed for c in channels]))


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
