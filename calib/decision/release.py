"""Draws of what may be built and a measurement in, what would be decided after it, and how often wrongly, out.

Whether sensors on the most promising padding are released or held back is decided by their probability of conforming P:
released if that is at least the p that the specification asks for. That is the best that can be decided where a sensor that is
released and does not conform costs p / (1 - p) times as much as one that would have conformed, on some padding (with
probability A), and is not released on it: the loss

    L = p (1 - P) + (1 - p) (A - P)  if released,   (1 - p) A  if held back,                                        (1)

which is (1 - p) A less what is won, P - p or nothing, is least so. Before a measurement nobody knows what will be read. With T
what the margins hang on (`calib.decision.hinges`), C what is not known of it now and C' after the measurement, in coordinates
in which C = 1, a measurement is as good as a reading

    t = T + e,   e ~ N(0, J^-1),   J = C'^-1 - 1,                                                                   (2)

and what it makes of the draws are the weights w_d ~ exp(-(t - T_d)^T J (t - T_d) / 2). For each of many t, of draws picked as
truth, it is decided anew, by P and by the expected shortfall. What is expected of these decisions is the pre-posterior analysis
of Raiffa and Schlaifer (Applied Statistical Decision Theory, 1961), by importance sampling of the draws there are. So that a
decision is not judged by the draws that it was made with, it is made with one half of them and judged by the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.decision.trials import Tried
from models.sensor import BoolArray, FloatArray

# Readings that are tried, and the seed by which they are the same for all measurements.
_READINGS, _SEED = 800, 20
# In nine of ten readings at least so many draws of a half must count; what a measurement tells is weakened by this factor till
# they do, and no further than to this share. What is known exactly tells so much of each direction.
_COUNT, _TENTH, _WEAKER, _WEAKEST, _EXACTLY = 60.0, 0.1, 0.7, 1e-3, 400.0
# Thicknesses times sensors that a decision is made among, about, and least thicknesses of each sensor.
_OPTIONS, _LEAST = 600, 21
# A shortfall of a limit weighs as much as this share of draws that fail, where thicknesses conform alike.
_TIE = 1e-3


@dataclass(frozen=True)
class Decided:
    """How often it is decided wrongly whether, and on which padding, a sensor is built: shares of all sensors [1].

    Attributes
    ----------
    wrong_release : it is released, and does not conform: the consumer's risk.
    wrong_hold : it is held back, and would conform on some padding: the producer's risk.
    regret : expected shortfall, as a share of a limit, beyond that of the padding which is best for each sensor.
    loss : (1), what a wrong release, a wrong hold and padding that is wrong for a sensor weigh together.
    error : of the loss, standard error by the readings that were tried.
    overturned : [1], share of readings after which what is held back now is released, or the other way round.
    share : of what the measurement tells, that the draws carry; below 1 it is worth at least what is said.
    """

    wrong_release: float
    wrong_hold: float
    regret: float
    loss: float
    error: float = 0.0
    overturned: float = 0.0
    share: float = 1.0


@dataclass(frozen=True, eq=False)
class Options:
    """What may be decided for, with draws.

    Attributes
    ----------
    conforms : (n_draw, n_option), 1 where a sensor conforms on such padding, else 0.
    anywhere : (n_draw,), 1 where it conforms on some padding, else 0.
    short : (n_draw, n_option), by which share of a limit it falls short.
    asked : p.
    first : (n_half,), the draws of one half; the others are the rest.
    hinges : (n_draw, n_direction), T, of unit covariance.
    now : by what is known.
    best : number of the option that is decided for now.
    """

    conforms: FloatArray
    anywhere: FloatArray
    short: FloatArray
    asked: float
    first: BoolArray
    hinges: FloatArray
    now: Decided
    best: int

    @property
    def released(self) -> bool:
        """Whether it is released now."""
        return self.probability >= self.asked

    @property
    def probability(self) -> float:
        """P [1] of the option that is decided for now."""
        return float(np.mean(self.conforms[:, self.best]))


def options_of(tried: Sequence[Tried], hinges: FloatArray, asked: float) -> Options:
    """What may be decided for: sensors that may be built, on padding that the model covers.

    Parameters
    ----------
    tried : the sensors.
    hinges : (n_draw, n_direction), T of unit covariance; draws that are not there are nan.
    asked : p.
    """
    there = np.all(np.isfinite(hinges), axis=1)
    each = max(_LEAST, _OPTIONS // len(tried))
    columns = []
    for one in tried:
        covered = np.flatnonzero(one.built.covered)
        some = covered[np.linspace(0, covered.size - 1, min(each, covered.size)).round().astype(int)]
        columns.append(one.worst[there][:, np.union1d(some, [one.at])])
    worst = np.concatenate(columns, axis=1)
    conforms, short = (worst >= 0).astype(float), np.maximum(-worst, 0.0)
    mean, fall = np.mean(conforms, axis=0), np.mean(short, axis=0)
    best = int(np.argmax(mean - _TIE * fall))
    anywhere = np.max(conforms, axis=1)
    p, some = float(mean[best]), float(np.mean(anywhere))
    fails, holds, won = (1 - p, 0.0, p - asked) if p >= asked else (0.0, some, 0.0)
    regret = float(np.min(fall) - np.mean(np.min(short, axis=1)))
    now = Decided(fails, holds, regret, (1 - asked) * some - won)
    first = np.arange(len(worst)) % 2 == 0
    return Options(conforms, anywhere, short, asked, first, hinges[there], now, best)


def after_reading(options: Options, left: FloatArray) -> Decided:
    """What is expected to be decided after a measurement.

    Parameters
    ----------
    options : what may be decided for.
    left : C' of (2), (n_direction, n_direction).

    Returns
    -------
    Of a measurement that tells more than the draws carry what a weaker one would bring, which is not more.
    """
    if not left.size:
        return options.now
    value, vector = np.linalg.eigh(0.5 * (left + left.T))
    told = np.maximum(1 / np.clip(value, 1 / _EXACTLY, 1.0) - 1, 0.0)
    if not np.any(told > 1e-9):
        return options.now
    rng = np.random.default_rng(_SEED)
    truths = np.sort(rng.choice(len(options.hinges), min(_READINGS, len(options.hinges)), replace=False))
    noise = rng.standard_normal((truths.size, len(value)))
    share = 1.0
    while True:
        root = (vector * np.sqrt(share * told)) @ vector.T
        seen = options.hinges @ root
        away = seen[truths] + noise
        halves = [_weights(seen[half], away) for half in (options.first, ~options.first)]
        counted = [1 / np.sum(weight**2, axis=1) for weight in halves]
        if min(float(np.quantile(count, _TENTH)) for count in counted) >= _COUNT or share < _WEAKEST:
            break
        share *= _WEAKER
    return _judged(options, halves, share) if share >= _WEAKEST else replace(options.now, share=share)


def known_exactly(options: Options) -> Decided:
    """What is expected to be decided once all is known of the unknowns, as far as the draws carry that: scatter is left.

    Parameters
    ----------
    options : what may be decided for.
    """
    n = options.hinges.shape[1]
    return after_reading(options, np.eye(n) / _EXACTLY)


def _weights(seen: FloatArray, away: FloatArray) -> FloatArray:
    """Weights of draws (n_reading, n_draw) after each reading; each row sums to 1."""
    square = np.sum(away**2, axis=1)[:, None] - 2 * away @ seen.T + np.sum(seen**2, axis=1)
    weight = np.exp(-0.5 * (square - np.min(square, axis=1, keepdims=True)))
    return np.asarray(weight / np.sum(weight, axis=1, keepdims=True), dtype=float)


def _judged(options: Options, halves: Sequence[FloatArray], share: float) -> Decided:
    """Decide with one half of the draws, judge by the other, and the other way round."""
    sides = (options.first, ~options.first)
    known = [
        tuple(weight @ column[side] for column in (options.conforms, options.anywhere, options.short))
        for weight, side in zip(halves, sides, strict=True)
    ]
    least, now = int(np.argmin(np.mean(options.short, axis=0))), options.now
    gains = []
    for (conforms, _, short), (of_others, anywhere, short_of_others) in (known, known[::-1]):
        row = np.arange(len(conforms))
        best = np.argmax(conforms - _TIE * short, axis=1)
        released = conforms[row, best] >= options.asked
        p_now, p_then = of_others[:, options.best], of_others[row, best]
        more_fail = np.where(released, 1 - p_then, 0.0) - (1 - p_now if options.released else 0.0)
        more_held = np.where(released, 0.0, anywhere) - (0.0 if options.released else anywhere)
        more_won = np.where(released, p_then - options.asked, 0.0) - (p_now - options.asked if options.released else 0.0)
        longer = short_of_others[row, np.argmin(short, axis=1)] - short_of_others[:, least]
        gains.append(np.column_stack([more_fail, more_held, more_won, longer, released != options.released]))
    of_readings = np.mean(gains, axis=0)  # (n_reading, 5)
    fails, holds, won, longer_by, overturned = (float(mean) for mean in np.mean(of_readings, axis=0))
    error = float(np.std(of_readings[:, 2]) / np.sqrt(len(of_readings)))
    if won <= 0:
        # What is judged by a half of the draws may come out worse than what all of them decide now, which one would stay with.
        fails = holds = won = 0.0
    return Decided(
        max(now.wrong_release + fails, 0.0),
        max(now.wrong_hold + holds, 0.0),
        max(now.regret + min(longer_by, 0.0), 0.0),
        max(now.loss - won, 0.0),
        error,
        overturned,
        share,
    )
