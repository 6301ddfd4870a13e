"""The proposals of all ensembles in, a second opinion on what their chains say out: fresh draws, weighted to the target.

Chains that move by proposals can agree with each other and be wrong together, where walkers stick or a mode is weighted
wrongly. Independent draws of the proposals, weighted by target over proposal (Pareto-smoothed, Vehtari et al. 2024), know
nothing of the chains. Where their weights can be trusted, the means must be the same.

But proposals may all lack a mode, as chains do, and then draws of them lack it, too, with the best of weights. So where there
are several modes, a part of the draws is of Student densities round each that any climb found, of several widths, as the bend
at a summit may tell another than its mass has. They show what lies there whatever the proposals know of it.

Of many groups no draw of all at once would have a weight to speak of. There each draw is of what they share, with several of
each group given that (`calib.sampling.nested`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, ndtri

from calib.digits import with_uncertainty
from calib.sampling.archive import K_HAT, smooth_weights
from calib.sampling.funnel import Funnel, Indices, log_student
from calib.sampling.nested import nested_draws
from calib.sampling.proposal import Proposal
from calib.sampling.target import Mode, Target
from models.sensor import FloatArray

# Fresh draws of each ensemble's proposal; of what many groups share, and of each group for each of those.
_DRAWS, _SHARED_DRAWS, _GROUP_DRAWS = 500, 100, 12
# Fresh draws round each of several modes at each of these widths, in those of the mode, and degrees of freedom of them.
_ROUND, _WIDTHS, _FREEDOM = 64, 2.0 ** np.arange(2, -6, -1), 5.0
# Two-sided probability that a mean is refused though it is right, over all unknowns together: that of three standard errors.
_DOUBT = 0.0027
# Means that are nearer than this, in posterior standard deviations, are the same whatever their errors are.
_NEAR = 0.05
# Shares of a mode that are nearer than this are the same.
_NEAR_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class SecondOpinion:
    """What fresh draws of the proposals, weighted to the target, say of the posterior.

    Attributes
    ----------
    k_hat : shape of the tail of their weights; above `K_HAT` they say nothing.
    mean, error : (n_parameter,), SI, mean of each unknown and its Monte Carlo standard error.
    share, share_error : (n_mode,), share of each mode and its error; () where it was not asked for.
    """

    k_hat: float
    mean: FloatArray
    error: FloatArray
    share: FloatArray
    share_error: FloatArray

    @property
    def trusted(self) -> bool:
        """Whether the weights can be trusted."""
        return self.k_hat < K_HAT


def second_opinion(
    target: Target, proposals: Sequence[Proposal], seed: np.random.SeedSequence, modes: Sequence[Mode] = ()
) -> SecondOpinion:
    """Draw afresh from the proposals of all ensembles and round each mode, as one mixture, and weight the draws to the target.

    Parameters
    ----------
    target : what is sampled.
    proposals : one of each ensemble; of those alone that have one, none only where there are modes.
    seed : of the draws.
    modes : whose shares are asked for; of many groups none.
    """
    random = np.random.RandomState(np.random.MT19937(seed))
    if target.groups:
        nothing = np.full(len(target.names), np.nan)
        if target.tie(target.places(np.random.default_rng(0), 1), random) is not None:
            return SecondOpinion(np.inf, nothing, nothing, np.empty(0), np.empty(0))  # draws of each are none of groups tied
        return _opinion_on_groups(target, [proposal.parts[0] for proposal in proposals], random)
    drawn = [proposal.draw(random, _DRAWS) for proposal in proposals]
    x = np.concatenate([*drawn, *(_draws_round(mode, random) for mode in modes)])
    log_parts = [proposal.log_density(x) + np.log(_DRAWS) for proposal in proposals]
    log_parts += [part + np.log(_ROUND) for mode in modes for part in _log_densities_round(mode, x, _WIDTHS.tolist())]
    weight, k_hat = smooth_weights(target.log_density(x) - logsumexp(log_parts, axis=0))
    theta, _ = target.to_theta(x)
    there = np.all(np.isfinite(theta), axis=1) & (weight > 0)
    values, weight = target.columns(theta[there]), weight[there] / np.sum(weight[there])
    mean = weight @ values
    error = np.sqrt(weight**2 @ (values - mean) ** 2)
    if not modes:
        return SecondOpinion(k_hat, mean, error, np.empty(0), np.empty(0))
    belongs = np.equal.outer(nearest(x[there], modes), np.arange(len(modes))).astype(float)
    share = weight @ belongs
    return SecondOpinion(k_hat, mean, error, share, np.sqrt(weight**2 @ (belongs - share) ** 2))


def nearest(x: FloatArray, modes: Sequence[Mode]) -> Indices:
    """Number of the mode that each draw is nearest to, by the densities round them, (n_draw,).

    Parameters
    ----------
    x : the draws, (n_draw, n).
    modes : among which.
    """
    as_wide = [_log_densities_round(mode, x, (1.0,))[0] for mode in modes]
    return np.asarray(np.argmax(as_wide, axis=0), dtype=np.intp)


def _draws_round(mode: Mode, random: np.random.RandomState) -> FloatArray:
    """Draws of Student densities of all `_WIDTHS` round a mode."""
    n = mode.x.size
    width = np.repeat(_WIDTHS, _ROUND)[:, None] / np.sqrt(random.chisquare(_FREEDOM, (_WIDTHS.size * _ROUND, 1)) / _FREEDOM)
    return np.asarray(mode.x + width * random.standard_normal((len(width), n)) @ mode.factor.T, dtype=float)


def _log_densities_round(mode: Mode, x: FloatArray, widths: Sequence[float]) -> list[FloatArray]:
    """Log densities at x (n_draw, n) of Student densities round a mode, one of each width, in that of the mode."""
    square = np.sum(np.linalg.solve(mode.factor, (x - mode.x).T) ** 2, axis=0)
    log_volume = float(np.linalg.slogdet(mode.factor)[1])
    return [log_student(square, mode.x.size, _FREEDOM, width) - log_volume for width in widths]


def _opinion_on_groups(target: Target, funnels: Sequence[Funnel], random: np.random.RandomState) -> SecondOpinion:
    """The second opinion on many groups: draws of what they share, each with several draws of every group."""
    log_weights, values = zip(*(_weighted_groups(target, funnel, funnels, random) for funnel in funnels), strict=True)
    weight, k_hat = smooth_weights(np.concatenate(log_weights))
    there = weight > 0
    found, share = np.concatenate(values)[there], weight[there] / np.sum(weight[there])
    mean = share @ found
    return SecondOpinion(k_hat, mean, np.sqrt(share**2 @ (found - mean) ** 2), np.empty(0), np.empty(0))


def _weighted_groups(
    target: Target, funnel: Funnel, funnels: Sequence[Funnel], random: np.random.RandomState
) -> tuple[FloatArray, FloatArray]:
    """Log weights (n_draw,) of draws of one funnel's shared coordinates, under those of all, and values there (n_draw, n)."""
    drawn = nested_draws(target, funnel, random, _SHARED_DRAWS, _GROUP_DRAWS)
    theta, _ = target.to_theta(drawn.x.reshape(-1, drawn.x.shape[-1]))
    values = target.columns(np.where(np.isfinite(theta), theta, 0.0)).reshape(drawn.x.shape)
    log_mixture = logsumexp([f.log_shared(drawn.x[0]) for f in funnels], axis=0)
    return drawn.log_marginal - log_mixture, drawn.mean_of(values)


def contradictions(
    opinion: SecondOpinion, names: Sequence[str], mean: FloatArray, sd: FloatArray, ess: FloatArray
) -> tuple[str, ...]:
    """Say in sentences which means of the chains the second opinion contradicts; none if it cannot be trusted.

    Parameters
    ----------
    opinion : from `second_opinion`.
    names : of the unknowns.
    mean, sd, ess : (n_parameter,), of the draws of all chains: mean and standard deviation [SI], and effective draws.
    """
    if not opinion.trusted:
        return ()
    error = np.hypot(opinion.error, sd / np.sqrt(ess))
    limit = -float(ndtri(_DOUBT / 2 / len(names)))
    off = np.abs(mean - opinion.mean)
    return tuple(
        f"{name}: the chains' mean is {far / s:.2f} standard deviations off that of independent weighted draws "
        f"({far / e:.1f} standard errors): a part of the posterior is weighted wrongly"
        for name, far, s, e in zip(names, off, sd, error, strict=True)
        if far > max(limit * e, _NEAR * s)
    )


def misweighted(opinion: SecondOpinion, modes: Sequence[Mode], share: FloatArray, ess: float) -> tuple[str, ...]:
    """Say in sentences of which modes the chains have another share than the second opinion gives them.

    Weights that cannot be trusted may give a mode too small a share, but not one that is not there: what they say of one that
    the chains lack counts all the same.

    Parameters
    ----------
    opinion : from `second_opinion`, on these modes.
    modes : all that any climb found, between which there are valleys.
    share : (n_mode,), of the draws of all chains, by `nearest`.
    ess : effective draws of the chains.
    """
    if not modes:
        return ()
    error = np.hypot(opinion.share_error, np.sqrt(share * (1 - share) / ess))
    limit = -float(ndtri(_DOUBT / 2 / len(modes)))
    highest = max(mode.log_density for mode in modes)
    return tuple(
        f"a mode (log density {mode.log_density - highest:+.1f} beside the highest of {len(modes)}) has {100 * own:.1f} % of "
        f"the chains' draws, and {with_uncertainty(100 * weighted, 100 * e)} % of independent weighted ones: it is "
        "weighted wrongly"
        for mode, own, weighted, e in zip(modes, share, opinion.share, error, strict=True)
        if abs(weighted - own) > max(limit * e, _NEAR_SHARE) and (opinion.trusted or weighted > own)
    )
