"""One ensemble of walkers as pure functions: a problem and a seed in, a start, and from a state the next block of steps, out.

emcee is imported in this module alone. A state holds that of the random number generator too, so that a chain does not depend
on how its steps are split into blocks, nor on which process computes them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import emcee
import numpy as np
import numpy.typing as npt
from emcee.autocorr import next_pow_two

from calib.problem import Problem, log_posterior
from calib.sampling.coordinates import coordinates
from calib.sampling.scoring import score
from models.sensor import FloatArray

#: A vectorised log density: (n_draw, n_parameter) -> (n_draw,).
Density = Callable[[FloatArray], FloatArray]

#: Kinds of moves and how often each is made; see `advance` for what they are and what was measured.
MOVES = (("differential evolution", 0.9), ("jump", 0.1))

#: Of every so many steps one is kept; autocorrelation times are some tens to hundreds of steps.
STORE_EVERY = 5

#: Factor by which the Gaussian of the start is wider than the posterior at its mode.
OVERDISPERSION = 1.5

#: Prior draws among which an ensemble looks for its start, and how many of the best it climbs from.
N_START_DRAWS = 512
N_CLIMBS = 4


@dataclass(frozen=True, eq=False)
class EnsembleState:
    """Walkers between two steps, and the Mersenne twister's state.

    `coords` (n_walker, n_parameter) are those of `coordinates`, `log_prob` (n_walker,) is the log density in them.
    """

    coords: FloatArray
    log_prob: FloatArray
    random_keys: npt.NDArray[np.uint32]
    random_position: int
    random_has_gauss: int
    random_gauss: float


@dataclass(frozen=True, eq=False)
class Block:
    """Steps of an ensemble, every `STORE_EVERY`-th of them, the last one included.

    `chain` (n_stored, n_walker, n_parameter) and `log_prob` (n_stored, n_walker) are those of theta, `accepted` (n_walker,)
    counts which of the stored steps were accepted (emcee counts no others), `end` is the state after the last one.
    """

    chain: FloatArray
    log_prob: FloatArray
    accepted: npt.NDArray[np.int64]
    end: EnsembleState


def advance(problem: Problem, state: EnsembleState, n_steps: int) -> Block:
    """Make the next steps of an ensemble.

    Moves are differential evolution (ter Braak 2006; Nelson et al. 2014) with steps 0.7 times as long as recommended for a
    Gaussian, gamma = 1.67 / sqrt(2 n), and jumps along whole differences of two walkers, gamma = 1, from mode to mode.

    Measured on 20 parameters of two specimens, 80 walkers, 4000 steps: autocorrelation times of 130 steps in the median and
    500 for force_discrepancy (narrow where it is small); with 40 % of still shorter steps 190 and 520, with 40 % of steps along
    one to three coordinates 210 and 540. Stretch moves alone take about 1.6 times as long as these in shorter runs.
    emcee's snooker move is not used: in emcee 3.1.6 it does not leave the target alone (it makes a standard normal in ten
    dimensions one of variance 0.61).

    Parameters
    ----------
    problem : what is sampled.
    state : the walkers to go on from.
    n_steps : a multiple of `STORE_EVERY`.

    Returns
    -------
    The steps, and the state after them.
    """
    n_walker, n_parameter = state.coords.shape
    space = coordinates(problem)
    moves = [(_move(kind, n_parameter), share) for kind, share in MOVES]
    sampler = emcee.EnsembleSampler(n_walker, n_parameter, space.log_density, vectorize=True, moves=moves)
    random = ("MT19937", state.random_keys, state.random_position, state.random_has_gauss, state.random_gauss)
    begin = emcee.State(state.coords, log_prob=state.log_prob, random_state=random)
    n_stored = n_steps // STORE_EVERY
    end = sampler.run_mcmc(begin, n_stored, thin_by=STORE_EVERY, skip_initial_state_check=True, progress=False)
    chain = np.asarray(sampler.get_chain(), dtype=float)
    theta, log_jacobian = space.to_theta(chain.reshape(-1, n_parameter))
    return Block(
        theta.reshape(chain.shape),
        np.asarray(sampler.get_log_prob(), dtype=float) - log_jacobian.reshape(n_stored, n_walker),
        np.asarray(sampler.backend.accepted, dtype=np.int64),
        _state(np.asarray(end.coords, dtype=float), np.asarray(end.log_prob, dtype=float), end.random_state),
    )


def _move(kind: str, n_parameter: int) -> emcee.moves.Move:
    gamma = {"differential evolution": 1.67 / np.sqrt(2 * n_parameter), "jump": 1.0}[kind]
    return emcee.moves.DEMove(gamma0=gamma)


def _state(coords: FloatArray, log_prob: FloatArray, random_state: tuple[object, ...]) -> EnsembleState:
    _, keys, position, has_gauss, gauss = random_state
    return EnsembleState(
        coords,
        log_prob,
        np.asarray(keys, dtype=np.uint32),
        int(np.asarray(position)),
        int(np.asarray(has_gauss)),
        float(np.asarray(gauss)),
    )


def autocorrelation_time(chains: FloatArray) -> FloatArray:
    """Measure after how many steps the walkers have forgotten where they were: the integrated autocorrelation time.

    The autocorrelation is taken about the mean over all walkers of all ensembles and averaged over them, with Sokal's window
    of five times tau, as in emcee. emcee's own function takes the autocorrelation about each walker's mean, which is far too
    small for a chain of a few tau: 25 steps instead of 150 after 275 steps. Still, too short a chain gives too short a time.

    Returns
    -------
    In steps, (n_parameter,), for chains (n_ensemble, n_step, n_walker, n_parameter).
    """
    n_step = chains.shape[1]
    tau = np.empty(chains.shape[-1])
    for k in range(tau.size):
        x = chains[..., k] - np.mean(chains[..., k])
        power = np.abs(np.fft.rfft(x, n=2 * next_pow_two(n_step), axis=1)) ** 2
        covariance = np.fft.irfft(np.mean(power, axis=(0, 2)))[:n_step]
        if not covariance[0] > 0:
            tau[k] = np.nan
            continue
        sums = 2 * np.cumsum(covariance / covariance[0]) - 1
        closed = np.arange(n_step) >= 5 * sums
        tau[k] = max(1.0, sums[np.argmax(closed) if np.any(closed) else -1])
    return tau


# --- the start ----------------------------------------------------------------------------------------------------------


def start(problem: Problem, seed: np.random.SeedSequence, n_walker: int) -> EnsembleState:
    """Place the walkers of an ensemble around the mode of the posterior, spread wider than the posterior there.

    The best few of `N_START_DRAWS` prior draws climb, each to its end (`calib.sampling.scoring`), as some end in a false mode,
    such as a contact point far off that the discrepancy pays for, hundreds below the true one in log density. At the highest
    mode the inverse Hessian, inflated by `OVERDISPERSION`, gives the walkers. In a direction in which the Hessian
    is flatter than the prior, the prior's width is used. Walkers far below the mode are drawn anew from an ever narrower
    Gaussian, as a walker lost far out in a narrow ridge would take long to come back.

    Parameters
    ----------
    problem : what is to be sampled.
    seed : of this ensemble, which draws from the prior and finds its mode independently of the others.
    n_walker : how many walkers.

    Returns
    -------
    The walkers, and the state of the generator for their moves.

    Raises
    ------
    ValueError
        If no prior draw has a finite posterior density.
    """
    prior_seed, chain_seed = seed.spawn(2)
    rng = np.random.default_rng(prior_seed)
    n = len(problem.parameters)
    space = coordinates(problem)
    theta = rng.standard_normal((N_START_DRAWS, n))
    log_prob = log_posterior(problem, theta)
    x = space.from_theta(theta)
    if not np.any(np.isfinite(log_prob)):
        raise ValueError(f"none of {N_START_DRAWS} prior draws has a finite posterior density")
    best = [i for i in np.argsort(-log_prob)[:N_CLIMBS] if np.isfinite(log_prob[i])]
    mode, top = max((score(space, x[i]) for i in best), key=lambda c: c[1])
    spread = laplace_factor(space.log_density, mode)
    coords, log_prob = _walkers(space.log_density, mode, top, spread, n_walker, rng)
    twister = np.random.RandomState(np.random.MT19937(chain_seed))
    return _state(coords, log_prob, tuple(twister.get_state(legacy=True)))


def laplace_factor(density: Density, mode: FloatArray) -> FloatArray:
    """Estimate how wide the posterior is around its mode, as a square root S of its covariance: S S^T = (-Hessian)^-1.

    Eigenvalues of the negative Hessian below 1 are set to 1: no direction is wider than the prior.

    Parameters
    ----------
    density : log posterior, (n, n_parameter) -> (n,).
    mode : (n_parameter,).

    Returns
    -------
    (n_parameter, n_parameter).
    """
    hessian = _hessian(density, mode, np.full(mode.size, 1e-2))
    for _ in range(2):  # differences over a third of a standard deviation of each parameter given the others
        width = np.clip(0.3 / np.sqrt(np.maximum(-np.diagonal(hessian), 1.0)), 1e-6, 0.3)
        hessian = _hessian(density, mode, width)
    eigenvalue, vector = np.linalg.eigh(-hessian)
    return np.asarray(vector / np.sqrt(np.maximum(eigenvalue, 1.0)), dtype=float)


def _hessian(density: Density, x: FloatArray, width: FloatArray) -> FloatArray:
    """Hessian of the log posterior by central differences, in one call; that of the prior where it is -inf."""
    n = x.size
    i, j = np.triu_indices(n, 1)
    e = np.eye(n) * width
    corners = [e[i] + e[j], e[i] - e[j], -e[i] + e[j], -e[i] - e[j]]
    f = density(x + np.concatenate([np.zeros((1, n)), e, -e, *corners]))
    centre, plus, minus = f[0], f[1 : n + 1], f[n + 1 : 2 * n + 1]
    pp, pm, mp, mm = np.split(f[2 * n + 1 :], 4)
    hessian = np.zeros((n, n))
    with np.errstate(invalid="ignore"):
        np.fill_diagonal(hessian, (plus - 2 * centre + minus) / width**2)
        hessian[i, j] = hessian[j, i] = (pp - pm - mp + mm) / (4 * width[i] * width[j])
    return np.where(np.isfinite(hessian), hessian, -np.eye(n))


def _walkers(
    density: Density, mode: FloatArray, top: float, spread: FloatArray, n_walker: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Walkers (n_walker, n_parameter) around the mode and their log posterior."""
    n = mode.size
    # 99.9 % of an overdispersed Gaussian's draws lie above this, were the posterior a Gaussian.
    lowest = top - 0.5 * OVERDISPERSION**2 * (n + 4.5 * np.sqrt(n) + 5)
    coords, log_prob = np.empty((0, n)), np.empty(0)
    scale = OVERDISPERSION
    while coords.shape[0] < n_walker:
        tried = mode + scale * rng.standard_normal((4 * n_walker, n)) @ spread.T
        values = density(tried)
        good = values > lowest
        coords, log_prob = np.concatenate([coords, tried[good]]), np.concatenate([log_prob, values[good]])
        scale *= 0.7
    return coords[:n_walker], log_prob[:n_walker]
