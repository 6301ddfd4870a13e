"""One ensemble of walkers as pure functions: a density and walkers in, their next steps out, by moves that may know its shape.

emcee is imported in this module alone. A state holds that of the random number generator too, so that a chain does not depend
on how its steps are split into blocks, nor on which process computes them.

- differential evolution (ter Braak 2006; Nelson et al. 2014) needs no shape: steps 0.7 times as long as recommended for a
  normal density, gamma = 1.67 / sqrt(2 n), along the difference of two other walkers. Jumps, gamma = 1, are whole differences,
  from mode to mode. emcee's snooker move is not used: in emcee 3.1.6 it does not leave the target alone (it makes a standard
  normal in ten dimensions one of variance 0.61).
- proposal: new places independent of the old, drawn from a `Proposal`, one after the other (Metropolis-Hastings). As they do
  not depend on where the walkers are, their densities are computed together, which costs less.
- nearby: a step that leaves the proposal's density alone (preconditioned Crank-Nicolson), accepted more often.
- of many specimens each by itself, and what they share: see `calib.sampling.grouped`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from calib.sampling.grouped import OF_GROUPS, OF_SHARED, TOGETHER, GroupedWalkers
from calib.sampling.proposal import Proposal
from calib.sampling.target import Target
from models.sensor import FloatArray

if TYPE_CHECKING:
    import emcee

#: Shares of the kinds of moves: where the shape of the density is not known, and where it is.
SHAPELESS = {"differential evolution": 0.9, "jump": 0.1}
SHAPELY = {"proposal": 0.6, "nearby": 0.2, "differential evolution": 0.2}

#: Shares of the kinds of moves of many groups that are independent of each other given what they share; and where they are
#: tied to each other besides, as specimens of one lot are, which then all go together, too.
GROUPWISE = dict(zip((*OF_GROUPS, *OF_SHARED), (0.2, 0.1, 0.05, 0.05, 0.2, 0.2, 0.2), strict=True))
OF_LOT = dict(zip((*OF_GROUPS, *OF_SHARED, TOGETHER), (0.1, 0.05, 0.03, 0.07, 0.1, 0.2, 0.2, 0.25), strict=True))

#: All kinds of moves.
KINDS = ("proposal", "nearby", "differential evolution", "jump", *OF_GROUPS, *OF_SHARED, TOGETHER)

#: Of every so many steps one is kept.
STORE_EVERY = 2

# Places that a walker tries in a step of the kind "proposal".
_PLACES = 2
# Length of a step nearby; 1 would be independent of where it starts.
_NEARBY = 0.5


@dataclass(frozen=True, eq=False)
class EnsembleState:
    """Walkers between two steps, and the Mersenne twister's state.

    `coords` (n_walker, n) are those of the density, `log_prob` (n_walker,) is its logarithm there.
    """

    coords: FloatArray
    log_prob: FloatArray
    random_keys: npt.NDArray[np.uint32]
    random_position: int
    random_has_gauss: int
    random_gauss: float

    @staticmethod
    def of(coords: FloatArray, log_prob: FloatArray, random: np.random.RandomState) -> EnsembleState:
        """Walkers with the present state of a generator.

        Parameters
        ----------
        coords, log_prob : see the attributes.
        random : the generator that their next steps go on with.
        """
        return _state(coords, log_prob, tuple(random.get_state(legacy=True)))


@dataclass(frozen=True, eq=False)
class Moves:
    """How walkers move: the kinds of moves with their shares, and the proposal for those that need one."""

    shares: Mapping[str, float]
    proposal: Proposal | None = None


@dataclass(frozen=True, eq=False)
class Path:
    """Steps of walkers, every `STORE_EVERY`-th of them, the last one included.

    Attributes
    ----------
    chain, log_density : (n_stored, n_walker, n) and (n_stored, n_walker).
    tried, accepted : of each kind of move, places that single walkers tried and that were accepted.
    end : the walkers after the last step.
    """

    chain: FloatArray
    log_density: FloatArray
    tried: Mapping[str, int]
    accepted: Mapping[str, int]
    end: EnsembleState

    def accepted_of(self, *kinds: str) -> float:
        """Least share of the places tried by any of these kinds that were accepted; 0 if none were tried."""
        return min((self.accepted[kind] / self.tried[kind] for kind in kinds if self.tried.get(kind)), default=0.0)


def walk(target: Target, state: EnsembleState, moves: Moves, n_steps: int) -> Path:
    """Make the next steps of walkers.

    Parameters
    ----------
    target : what they are to be distributed by.
    state : the walkers to go on from.
    moves : how they move.
    n_steps : a multiple of `STORE_EVERY`.

    Returns
    -------
    The steps, and the walkers after them.
    """
    import emcee  # takes long to load

    n_walker, n = state.coords.shape
    if target.groups and moves.proposal is not None:
        walkers = GroupedWalkers(target, moves.proposal.parts[0])
        made: dict[str, _Counted | _Grouped | _Anywhere] = {kind: _Grouped(kind, walkers) for kind in moves.shares}
    else:
        made = {kind: _made(kind, n, moves.proposal) for kind in moves.shares}
    weighted = [(made[kind], share) for kind, share in moves.shares.items()]
    sampler = emcee.EnsembleSampler(n_walker, n, target.log_density, vectorize=True, moves=weighted)
    random = ("MT19937", state.random_keys, state.random_position, state.random_has_gauss, state.random_gauss)
    begin = emcee.State(state.coords, log_prob=state.log_prob, random_state=random)
    end = sampler.run_mcmc(begin, n_steps // STORE_EVERY, thin_by=STORE_EVERY, skip_initial_state_check=True, progress=False)
    return Path(
        np.asarray(sampler.get_chain(), dtype=float),
        np.asarray(sampler.get_log_prob(), dtype=float),
        {kind: move.tried for kind, move in made.items()},
        {kind: move.accepted for kind, move in made.items()},
        _state(np.asarray(end.coords, dtype=float), np.asarray(end.log_prob, dtype=float), end.random_state),
    )


@dataclass(frozen=True, eq=False)
class Block:
    """Steps of an ensemble as they are kept, every `STORE_EVERY`-th of them, the last one included.

    `chain` (n_stored, n_walker, n_parameter) and `log_prob` (n_stored, n_walker) are those of theta; `tried` and `accepted`
    (n_kind,) count the places that single walkers tried by each of `KINDS`; `end` is the state after the last step.
    """

    chain: FloatArray
    log_prob: FloatArray
    tried: npt.NDArray[np.int64]
    accepted: npt.NDArray[np.int64]
    end: EnsembleState


def advance(target: Target, state: EnsembleState, proposal: Proposal | None, n_steps: int) -> Block:
    """Make the next steps of an ensemble, all by one and the same rule.

    Parameters
    ----------
    target : what is sampled.
    state : the walkers to go on from.
    proposal : that fits the target; None if there is none, for moves that need no shape.
    n_steps : a multiple of `STORE_EVERY`.

    Returns
    -------
    The steps, and the state after them.
    """
    path = walk(target, state, moves_by(target, proposal), n_steps)
    theta, log_jacobian = target.to_theta(path.chain.reshape(-1, path.chain.shape[-1]))
    return Block(
        theta.reshape(path.chain.shape),
        path.log_density - log_jacobian.reshape(path.log_density.shape),
        np.array([path.tried.get(kind, 0) for kind in KINDS], dtype=np.int64),
        np.array([path.accepted.get(kind, 0) for kind in KINDS], dtype=np.int64),
        path.end,
    )


def moves_by(target: Target, proposal: Proposal | None) -> Moves:
    """Choose the moves of a chain: those that use the shape of the target where a proposal has it, else those that need none.

    Parameters
    ----------
    target : what is sampled.
    proposal : None if none fits.
    """
    if proposal is None:
        return Moves(SHAPELESS)
    if not target.groups:
        return Moves(SHAPELY, proposal)
    return Moves(OF_LOT if target.alike else GROUPWISE, proposal)


class _Counted:
    """A move of emcee that counts what it tries and what is accepted."""

    def __init__(self, move: emcee.moves.Move) -> None:
        self.move, self.tried, self.accepted = move, 0, 0

    def propose(self, model: object, state: emcee.State) -> tuple[emcee.State, npt.NDArray[np.bool_]]:
        """See `emcee.moves.Move`."""
        state, accepted = self.move.propose(model, state)
        self.tried += accepted.size
        self.accepted += int(np.sum(accepted))
        return state, accepted


class _Grouped:
    """A step of groups, or of what they share, as a move of emcee that counts what it tries and what is accepted."""

    def __init__(self, kind: str, walkers: GroupedWalkers) -> None:
        self.kind, self.walkers, self.tried, self.accepted = kind, walkers, 0, 0

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, npt.NDArray[np.bool_]]:
        """See `emcee.moves.Move`."""
        state.coords, state.log_prob, accepted = self.walkers.step(self.kind, state.coords, model.random)
        self.tried += accepted.size
        self.accepted += int(np.sum(accepted))
        return state, np.any(accepted, axis=1)


class _Anywhere:
    """Steps to draws of a proposal, as a move of emcee that counts what it tries and what is accepted."""

    def __init__(self, proposal: Proposal) -> None:
        self.proposal, self.tried, self.accepted = proposal, 0, 0

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, npt.NDArray[np.bool_]]:
        """See `emcee.moves.Move`."""
        n_walker = len(state.coords)
        x = self.proposal.draw(model.random, _PLACES * n_walker)
        log_prob, _ = model.compute_log_prob_fn(x)
        gain = log_prob - self.proposal.log_density(x)
        here = state.log_prob - self.proposal.log_density(state.coords)
        moved = np.zeros(n_walker, dtype=bool)
        for place in range(_PLACES):
            rows = np.arange(place * n_walker, (place + 1) * n_walker)
            accepted = np.log(model.random.random_sample(n_walker)) < gain[rows] - here
            state.coords[accepted], state.log_prob[accepted] = x[rows][accepted], log_prob[rows][accepted]
            here = np.where(accepted, gain[rows], here)
            moved |= accepted
            self.tried += n_walker
            self.accepted += int(np.sum(accepted))
        return state, moved


def _made(kind: str, n: int, proposal: Proposal | None) -> _Counted | _Anywhere:
    import emcee  # takes long to load

    if kind in ("differential evolution", "jump"):
        return _Counted(emcee.moves.DEMove(gamma0=1.0 if kind == "jump" else 1.67 / np.sqrt(2 * n)))
    if proposal is None:
        raise ValueError(f"a move {kind!r} needs a proposal")
    if kind == "proposal":
        return _Anywhere(proposal)

    def nearby(x: FloatArray, random: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        y = proposal.step(random, x, _NEARBY)
        return y, proposal.log_density(x) - proposal.log_density(y)

    return _Counted(emcee.moves.MHMove(nearby))


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
    padded = 2 ** (n_step - 1).bit_length()  # a power of two, for the Fourier transform
    tau = np.empty(chains.shape[-1])
    for k in range(tau.size):
        x = chains[..., k] - np.mean(chains[..., k])
        power = np.abs(np.fft.rfft(x, n=2 * padded, axis=1)) ** 2
        covariance = np.fft.irfft(np.mean(power, axis=(0, 2)))[:n_step]
        if not covariance[0] > 0:
            tau[k] = np.nan
            continue
        sums = 2 * np.cumsum(covariance / covariance[0]) - 1
        closed = np.arange(n_step) >= 5 * sums
        tau[k] = max(1.0, sums[np.argmax(closed) if np.any(closed) else -1])
    return tau


def standing_time(chains: FloatArray) -> FloatArray:
    """Measure after how many steps walkers have forgotten where they were, by how far their means lie apart.

    Means over n steps of walkers that each forget within tau vary by tau / n of the walkers' variance. A few that stand still
    in a far corner for the whole chain, which autocorrelations within a chain hardly see, move their own means by much.

    Returns
    -------
    In steps, (n_parameter,), for chains (n_ensemble, n_step, n_walker, n_parameter); n_step at most, about.
    """
    between = np.mean(np.var(np.mean(chains, axis=1), axis=1, ddof=1), axis=0)
    whole = np.mean(np.var(chains, axis=(1, 2)), axis=0)
    return np.asarray(chains.shape[1] * np.divide(between, whole, out=np.full(whole.shape, np.nan), where=whole > 0))
