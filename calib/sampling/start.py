"""A target and a seed in, its modes out; then all modes in, walkers that lie as the target does and their proposal out.

A start takes two steps, as the modes that one ensemble finds are told to all: an ensemble that has missed one would otherwise
be sure of what another contradicts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.sampling.ensemble import SHAPELESS, EnsembleState, Moves, moves_by, walk
from calib.sampling.funnel_fit import normal_funnel
from calib.sampling.laplace import importance_weights
from calib.sampling.nested import nested_draws
from calib.sampling.proposal import Mixture, Proposal, fit_proposal
from calib.sampling.scoring import FAR_BELOW
from calib.sampling.target import Mode, Target
from models.sensor import BoolArray, FloatArray

#: Version of how an ensemble begins: raise it with every change that gives another start for the same seed.
START_VERSION = 12

#: Places among which an ensemble looks for its starts; how many of the best it climbs from, of all that are possible, and
#: of those that the modes known by then explain least.
N_START_DRAWS = 512
N_BEST, N_ANY, N_UNEXPLAINED = 1, 1, 2

#: A mode whose mass, were it normal, is below this share of the greatest one's is left out.
_LEAST_MASS = 1e-3
# A climb has ended on a slope if so far along its width, in its sds, the log density is higher by more than this. It goes on by
# the best of so many steps at random, from so short ones on, most so many times, while one gains.
_ASIDE, _SLOPE = 0.3, 0.5
_SCRAMBLE, _SHORTEST, _MOST_SCRAMBLES, _PACE = 64, 1e-4, 150, 8
# Where its end is not `FAR_BELOW` the highest mode, walkers are let loose there: so many for each unknown, at least so many of
# them within the bounds, from so near, in sds; steps of a round, and most rounds while they rise.
_LOOSE, _LEAST_LOOSE, _NEAR_END, _LOOSE_STEPS, _LOOSE_ROUNDS = 12, 3, 0.01, 60, 20
# A walker lags behind if its log density is further below the highest than hardly any of a normal density is: by this times
# the number of unknowns and this more.
_LAGS = 3.0
# Sides from which it is seen how wide a mode is, and the shares of its width that are tried.
_SIDES, _NARROWER = 64, 2.0 ** (-np.arange(40) / 4)
# Degrees of freedom and width of the first proposal at a mode, and draws of it for each walker.
_FREEDOM, _WIDEN, _TRIES = 5.0, 1.2, 6
# Draws at the modes where a target knows more of them than how wide they are; what they are drawn from is near the target if
# this share of draws is effective: then the proposal is fitted to them, and one round of steps tells whether it is good.
_SKETCHED, _NEAR = 4000, 0.25
# A proposal with ends is fitted to so many of its own draws, at most so often, while so many of them for each unknown are
# effective, and not so large a share of all.
_OWN_DRAWS, _RENEWALS, _RENEWED, _GOOD = 6000, 4, 40, 0.2
# The same of many groups: of each so many draws for each of what they share, and the share of draws for which weights are made
# milder.
_GROUP_RENEWALS, _EACH_GROUP, _GOOD_OF_GROUPS, _MILD = 2, 8, 0.25, 0.5
# How often those that are beyond a bound are drawn anew.
_REDRAWN = 8
# Effective draws among them, as a share of the walkers, for which their weights are made milder.
_EFFECTIVE = 0.6
#: Steps of each round, after which the proposal is fitted anew to those of this and the one before. The last is repeated, up to
#: so many in all, while the mean log density of the walkers drifts by more than this, in its standard deviations: the mode of
#: a funnel is far from where its mass is.
ROUNDS = (16, 16, 24, 40, 56)
MOST_ROUNDS = 20
#: Longer rounds that follow those of so many unknowns and more: a proposal has slopes as many as the square of them, and what
#: draws tell of these too roughly makes it miss the target. Of a lot of four, 38 unknowns, 0.25 of its draws are accepted then,
#: and 0.1 to 0.15 without these rounds.
LONGER_ROUNDS, MANY_UNKNOWNS = (112, 224), 30
_DRIFT = 0.2
#: A proposal of which more draws than this are accepted is as good as can be.
ENOUGH_ACCEPTED = 0.5
#: A proposal of which fewer draws than this are accepted does not fit: the moves that need no shape are made instead.
LEAST_ACCEPTED = 0.1


@dataclass(frozen=True, eq=False)
class Start:
    """Where an ensemble begins: its walkers, and how they move: the proposal, None if none was found that fits."""

    state: EnsembleState
    proposal: Proposal | None


def find_modes(target: Target, seed: np.random.SeedSequence) -> tuple[Mode, ...]:
    """Climb from draws of the prior to the modes of a target, from the most probable and from others.

    A narrow mode beside a wide one is reached from few places, which any draws would hardly hit. But a draw near it is far more
    probable than normal densities at the modes that are known would have it: such draws are climbed from last.

    Parameters
    ----------
    target : what is to be sampled.
    seed : of the draws.

    Returns
    -------
    The modes that were reached, the highest first.

    Raises
    ------
    ValueError
        If no prior draw has a finite posterior density.
    """
    rng = np.random.default_rng(seed)
    x = target.places(rng, N_START_DRAWS)
    log_density = target.log_density(x)
    possible = np.flatnonzero(np.isfinite(log_density))
    if not possible.size:
        raise ValueError(f"none of {N_START_DRAWS} prior draws has a finite posterior density")
    best = possible[np.argsort(-log_density[possible])]
    others = rng.permutation(best[N_BEST:])[:N_ANY]
    found: list[Mode] = []

    def climb(i: int) -> None:
        mode = target.climb(x[i], found)
        if mode not in found:
            found.append(mode)

    for i in [*best[:N_BEST], *others]:
        climb(i)
    left = np.setdiff1d(best[N_BEST:], others)
    for _ in range(min(N_UNEXPLAINED, left.size)):
        i = left[np.argmax(_unexplained(x[left], log_density[left], found))]
        climb(i)
        left = left[left != i]
    if not target.groups:  # of many specimens it would take minutes
        found = _off_slopes(target, found, rng)
    return tuple(sorted(found, key=lambda m: -m.log_density))


def _off_slopes(target: Target, found: Sequence[Mode], rng: np.random.Generator) -> list[Mode]:
    """Let climbs that have ended on a slope go on, if their way could lead to where the others are: all are known by now."""
    modes = list(found)
    for k, mode in enumerate(modes):
        if not _on_a_slope(target, mode):
            continue
        enough = max((m.log_density for m in modes if m is not mode), default=-np.inf) - FAR_BELOW * mode.x.size
        mode = _scrambled(target, mode, enough, rng)
        modes[k] = _let_loose(target, mode, rng) if mode.log_density > enough else mode
    return modes


def _on_a_slope(target: Target, mode: Mode) -> bool:
    """Whether a climb has ended below what is a part of its width away: at a bound that its steps would cross."""
    aside = _ASIDE * np.concatenate([mode.factor.T, -mode.factor.T])
    return bool(np.max(target.log_density(mode.x + aside)) > mode.log_density + _SLOPE)


def _scrambled(target: Target, mode: Mode, enough: float, rng: np.random.Generator) -> Mode:
    """Go on from the end of a climb by steps at random, of all lengths up to its width: they find a way along a bound.

    It is given up where it would not come to a log density that is `enough`, at its pace so far.
    """
    x, value = mode.x, mode.log_density
    for k in range(_MOST_SCRAMBLES):
        length = np.exp(rng.uniform(np.log(_SHORTEST), 0.0, (_SCRAMBLE, 1)))
        tried = x + length * rng.standard_normal((_SCRAMBLE, x.size)) @ mode.factor.T
        density = target.log_density(tried)
        best = int(np.argmax(density))
        if density[best] > value:
            x, value = tried[best], float(density[best])
        if k >= _PACE and value + (value - mode.log_density) / (k + 1) * (_MOST_SCRAMBLES - k) < enough:
            break
    return replace(mode, x=x, log_density=value)


def _let_loose(target: Target, mode: Mode, rng: np.random.Generator) -> Mode:
    """Where walkers go that begin at the end of a climb, and how wide they come to lie there.

    No slope is asked for, so that bounds do not hold them up. They begin so near that they find a way within the bounds. Those
    that lag far behind the highest, or have come to another mode, go on from where others are.
    """
    n = mode.x.size
    begin = mode.x + _NEAR_END * rng.standard_normal((_LOOSE * n, n)) @ mode.factor.T
    density = target.log_density(begin)
    there = np.isfinite(density)
    begin, density = np.concatenate([mode.x[None], begin[there]]), np.append(mode.log_density, density[there])
    if len(begin) < _LEAST_LOOSE * n:
        return mode
    random = np.random.RandomState(np.random.MT19937(int(rng.integers(2**32))))
    state = EnsembleState.of(begin, density, random)
    level = -np.inf
    for _ in range(_LOOSE_ROUNDS):
        end = walk(target, state, Moves(SHAPELESS), _LOOSE_STEPS).end
        near = _round_the_top(target, end)
        level, before = float(np.mean(end.log_prob[near])), level
        if not level > before + _SLOPE:
            break
        rows = np.where(near, np.arange(near.size), rng.choice(np.flatnonzero(near), near.size))
        state = replace(end, coords=end.coords[rows], log_prob=end.log_prob[rows])
    x, log_density = end.coords[near], end.log_prob[near]
    if len(x) < _LEAST_LOOSE * n:
        return mode
    factor = np.linalg.cholesky(np.cov(x.T).reshape(n, n) + 1e-12 * np.diag(np.var(x, axis=0) + 1e-300))
    # A top at a bound has most of what lies round it beyond.
    middle = np.mean(x, axis=0)
    there_too = float(target.log_density(middle[None])[0])
    top = int(np.argmax(log_density))
    if there_too < np.quantile(log_density, 0.25):
        middle, there_too = x[top], float(log_density[top])
    return Mode(middle, there_too, np.asarray(factor, dtype=float))


def _round_the_top(target: Target, state: EnsembleState) -> BoolArray:
    """Which walkers (n_walker,) are not far below the highest of them, and have no valley between it and them."""
    top, n = int(np.argmax(state.log_prob)), state.coords.shape[1]
    near = state.log_prob > state.log_prob[top] - _LAGS * (n + _LAGS)
    for k in np.flatnonzero(near):
        here = Mode(state.coords[k], float(state.log_prob[k]), np.eye(n))
        near[k] = _no_valley(target, here, Mode(state.coords[top], float(state.log_prob[top]), np.eye(n)))
    return np.asarray(near, dtype=bool)


def _unexplained(x: FloatArray, log_density: FloatArray, modes: Sequence[Mode]) -> FloatArray:
    """By how much a log density (n_draw,) at x (n_draw, n) is above the normal densities at modes."""
    squares = [np.sum(np.linalg.solve(m.factor, (x - m.x).T) ** 2, axis=0) for m in modes]
    explained = [m.log_density - square / 2 for m, square in zip(modes, squares, strict=True)]
    return np.asarray(log_density - np.max(explained, axis=0), dtype=float)


def distinct_modes(target: Target, found: Sequence[Mode]) -> tuple[Mode, ...]:
    """Tell which modes of several searches are one and the same, the heaviest first.

    Two are one if no valley lies between them: if the straight way from one to the other never leads far below the lower. Those
    so far below the highest that no width could make up for it are left out.

    Parameters
    ----------
    target : what is to be sampled.
    found : of all searches.
    """
    enough = max((mode.log_density - FAR_BELOW * mode.x.size for mode in found), default=0.0)
    kept: list[Mode] = []
    for mode in sorted(found, key=lambda m: -m.log_mass):
        if mode.log_density >= enough and not any(_no_valley(target, mode, other) for other in kept):
            kept.append(mode)
    return tuple(kept)


def join_modes(target: Target, found: Sequence[Mode]) -> tuple[Mode, ...]:
    """Tell which of the distinct modes of several searches matter, the heaviest first.

    One is left out if its mass, were it normal, is next to nothing beside what another one surely has.

    Parameters
    ----------
    target : what is to be sampled.
    found : of all searches.
    """
    kept: list[Mode] = []
    sure = -np.inf
    for mode in distinct_modes(target, found):
        if mode.log_mass < sure + np.log(_LEAST_MASS):
            break
        kept.append(mode)
        sure = max(sure, _sure_log_mass(target, mode))
    return tuple(kept)


def _sure_log_mass(target: Target, mode: Mode) -> float:
    """Logarithm of the mass of a normal density that is no wider than a mode is on all sides together.

    A normal density of n unknowns has its mass sqrt(n) widths away, n / 2 below its top. The bend of a flat top, which a width
    is told by, says nothing of where it ends: in 20 unknowns it may hold a millionth of what it seems to.
    """
    n = mode.x.size
    aside = np.random.RandomState(n).standard_normal((_SIDES, n))
    aside *= np.sqrt(n) / np.linalg.norm(aside, axis=1, keepdims=True)
    for width in _NARROWER:
        fall = mode.log_density - target.log_density(mode.x + width * aside @ mode.factor.T)
        if np.median(fall) <= n:
            break
    return mode.log_mass + n * float(np.log(width))


def _no_valley(target: Target, a: Mode, b: Mode) -> bool:
    between = a.x + np.linspace(0, 1, 11)[1:-1, None] * (b.x - a.x)
    return bool(np.all(target.log_density(between) > min(a.log_density, b.log_density) - 1.0))


def start(
    target: Target, modes: Sequence[Mode], seed: np.random.SeedSequence, n_walker: int, most_rounds: int = MOST_ROUNDS
) -> Start:
    """Place the walkers of an ensemble as the target lies, and fit the proposal that they will move by.

    Draws of what the target knows of its modes, or of Student densities round them, are weighted to the target, mildly where
    the weights are few; walkers chosen among them then move. Where the draws were near the target, the proposal is fitted to
    them; elsewhere anew to where the walkers were, in `ROUNDS`, until it is good enough and they stay where they are; last,
    where values have an end, to draws of its own. What is learned here is frozen: the chain that follows has the target as its
    limit.

    Parameters
    ----------
    target : what is to be sampled.
    modes : all that are known, from `join_modes`.
    seed : of this ensemble.
    n_walker : how many walkers.
    most_rounds : of steps, even if the walkers still drift after them.
    """
    random = np.random.RandomState(np.random.MT19937(seed))
    mass = np.exp([m.log_mass - modes[0].log_mass for m in modes])
    shares = np.maximum(mass / np.sum(mass), 0.5 / len(modes) if len(modes) > 1 else 1.0)
    shares /= np.sum(shares)
    parts = tuple(normal_funnel(m.x, m.factor, target.scales, _FREEDOM, _WIDEN, target.groups) for m in modes)
    sketches = [target.sketch(m, random) for m in modes]
    known = Mixture(tuple(s or part for s, part in zip(sketches, parts, strict=True)), shares)
    x = known.draw(random, max(_TRIES * n_walker, _SKETCHED if any(sketches) else 0))
    x[: len(modes)] = [m.x for m in modes]  # so that one at least is possible, whatever the bounds
    log_density = target.log_density(x)
    for _ in range(_REDRAWN):
        beyond = np.flatnonzero(~np.isfinite(log_density))
        if not beyond.size:
            break
        x[beyond] = known.draw(random, beyond.size)
        log_density[beyond] = target.log_density(x[beyond])
    proposal = Proposal(parts, shares)
    near, level = False, np.inf
    if target.groups:  # weights of all groups together would be those of chance; each of them soon finds its place
        chosen = np.flatnonzero(np.isfinite(log_density))[:n_walker]
        chosen = np.resize(chosen, n_walker)
    else:
        log_weight = log_density - known.log_density(x)
        chosen = random.choice(log_weight.size, n_walker, p=_mild_weights(log_weight, _EFFECTIVE * n_walker))
        ratio = np.exp(log_weight - np.max(log_weight))
        near = float(np.sum(ratio) ** 2 / np.sum(ratio**2)) >= _NEAR * ratio.size
        if near:
            weight = importance_weights(log_weight)
            proposal = fit_proposal(x, target.scales, proposal, weight=weight, ends=target.ends)
            level = float(weight[weight > 0] @ log_density[weight > 0])
    state = EnsembleState.of(x[chosen], log_density[chosen], random)
    before: FloatArray = np.empty((0, x.shape[1]))
    accepted = 0.0
    rounds = (*ROUNDS, *LONGER_ROUNDS) if x.shape[1] >= MANY_UNKNOWNS and not target.groups else ROUNDS
    for k in range(most_rounds):
        path = walk(target, state, moves_by(target, proposal), rounds[min(k, len(rounds) - 1)])
        state = path.end
        accepted = path.accepted_of("proposal", "specimens", "shared")
        level_before, level = level, float(np.mean(path.log_density))
        drifts = abs(level - level_before) > _DRIFT * np.std(path.log_density)
        if near and not drifts and accepted >= LEAST_ACCEPTED:
            break  # fitted to draws that are independent, it can hardly become better
        near = False
        visited = path.chain.reshape(-1, x.shape[1])
        proposal = fit_proposal(np.concatenate([before, visited]), target.scales, proposal, target.groups, ends=target.ends)
        before = visited
        if not drifts and (accepted >= ENOUGH_ACCEPTED or k + 1 >= len(rounds)):
            break
    if target.groups and not target.alike:
        state, proposal = _renewed_by_groups(target, state, proposal, random)
    elif accepted >= LEAST_ACCEPTED and any(part.ended.size for part in proposal.parts):
        state, proposal = _renewed(target, state, proposal, random)
    # Moves of groups include one that needs no shape, and those of all coordinates together would lead nowhere.
    return Start(state, proposal if target.groups or accepted >= LEAST_ACCEPTED else None)


def _renewed(
    target: Target, state: EnsembleState, proposal: Proposal, random: np.random.RandomState
) -> tuple[EnsembleState, Proposal]:
    """Fit a proposal in which values have an end anew to its own draws, weighted, and place the walkers among them.

    Walkers come to an end late, as it lies far out in their coordinates, and what was fitted to them has too little there.
    """
    for _ in range(_RENEWALS):
        x = proposal.draw(random, _OWN_DRAWS)
        log_density = target.log_density(x)
        log_weight = log_density - proposal.log_density(x)
        weight = importance_weights(log_weight)
        effective = 1 / float(np.sum(weight**2))
        if effective < _RENEWED * x.shape[1]:
            break
        n_walker = len(state.coords)
        chosen = random.choice(weight.size, n_walker, p=_mild_weights(log_weight, _EFFECTIVE * n_walker))
        state = EnsembleState.of(x[chosen], log_density[chosen], random)
        if effective > _GOOD * weight.size:
            break
        proposal = fit_proposal(x, target.scales, proposal, weight=weight, ends=target.ends)
    return state, proposal


def _renewed_by_groups(
    target: Target, state: EnsembleState, proposal: Proposal, random: np.random.RandomState
) -> tuple[EnsembleState, Proposal]:
    """Fit the proposal of many groups anew to its own draws, weighted, and place the walkers among them.

    A noise or discrepancy that they share forgets where it was within hundreds of steps, so that after some rounds walkers are
    not spread as the target is, and what was fitted to them is too narrow. Draws do not walk.
    """
    funnel = proposal.parts[0]
    for _ in range(_GROUP_RENEWALS):
        drawn = nested_draws(target, funnel, random, _OWN_DRAWS, _EACH_GROUP)
        log_weight = drawn.log_marginal - funnel.log_shared(drawn.x[0])
        if np.sum(np.isfinite(log_weight)) < len(state.coords):
            break
        x = drawn.chosen(random)
        chosen = random.choice(len(x), len(state.coords), p=_mild_weights(log_weight, _EFFECTIVE * len(state.coords)))
        state = EnsembleState.of(x[chosen], target.log_density(x[chosen]), random)
        weight = importance_weights(log_weight)
        if 1 / float(np.sum(weight**2)) > _GOOD_OF_GROUPS * len(x):
            break
        mild = _mild_weights(log_weight, _MILD * len(x))
        proposal = fit_proposal(x, target.scales, proposal, target.groups, weight=mild, ends=target.ends)
        funnel = proposal.parts[0]
    return state, proposal


def _mild_weights(log_weight: FloatArray, effective: float) -> FloatArray:
    """Weights to that power, at most 1, that leaves as many effective draws as asked for; they sum to 1, none for -inf."""
    finite = np.isfinite(log_weight)
    highest = np.max(log_weight[finite])

    def at(power: float) -> FloatArray:
        weight = np.zeros(log_weight.shape)
        weight[finite] = np.exp(power * (log_weight[finite] - highest))
        return np.asarray(weight / np.sum(weight), dtype=float)

    low, high = 0.0, 1.0
    if 1 / np.sum(at(high) ** 2) >= effective:
        return at(high)
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if 1 / np.sum(at(middle) ** 2) >= effective else (low, middle)
    return at(low)
