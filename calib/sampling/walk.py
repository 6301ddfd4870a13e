"""Walkers and a log density in, the next steps of the walkers out, by emcee's moves and two that know the shape of the density.

emcee is imported in this module alone. Walkers hold the state of the random number generator too, so that a chain does not
depend on how its steps are split into blocks, nor on which process computes them.

- differential evolution (ter Braak 2006; Nelson et al. 2014) needs no shape: steps 0.7 times as long as recommended for a normal
  density, gamma = 1.67 / sqrt(2 n), along the difference of two other walkers. Jumps, gamma = 1, are whole differences, from
  mode to mode. emcee's snooker move is not used: in emcee 3.1.6 it does not leave the target alone (it makes a standard normal
  in ten dimensions one of variance 0.61).
- proposal: a new place independent of the old, drawn from a `Proposal` (Metropolis-Hastings).
- nearby: a step that leaves the proposal's density alone (preconditioned Crank-Nicolson), accepted more often.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import emcee
import numpy as np
import numpy.typing as npt

from calib.sampling.proposal import Proposal
from models.sensor import FloatArray

#: A vectorised log density: (n_draw, n) -> (n_draw,).
Density = Callable[[FloatArray], FloatArray]

#: Shares of the kinds of moves: where the shape of the density is not known, and where it is.
SHAPELESS = {"differential evolution": 0.9, "jump": 0.1}
SHAPELY = {"proposal": 0.6, "nearby": 0.2, "differential evolution": 0.2}

#: Of every so many steps one is kept.
STORE_EVERY = 2

# Length of a step nearby; 1 would be independent of where it starts.
_NEARBY = 0.5


@dataclass(frozen=True, eq=False)
class Walkers:
    """Walkers between two steps, and the Mersenne twister's state.

    `coords` (n_walker, n), `log_density` (n_walker,).
    """

    coords: FloatArray
    log_density: FloatArray
    random_keys: npt.NDArray[np.uint32]
    random_position: int
    random_has_gauss: int
    random_gauss: float

    @staticmethod
    def of(coords: FloatArray, log_density: FloatArray, random: np.random.RandomState) -> Walkers:
        """Walkers with the present state of a generator."""
        return _walkers(coords, log_density, tuple(random.get_state(legacy=True)))


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
    tried, accepted : of each kind of move, steps of single walkers that were tried and that were accepted.
    end : the walkers after the last step.
    """

    chain: FloatArray
    log_density: FloatArray
    tried: Mapping[str, int]
    accepted: Mapping[str, int]
    end: Walkers

    def accepted_of(self, kind: str) -> float:
        """Share of the steps of a kind that were accepted; 0 if none were tried."""
        return self.accepted[kind] / self.tried[kind] if self.tried[kind] else 0.0


def walk(density: Density, walkers: Walkers, moves: Moves, n_steps: int) -> Path:
    """Make the next steps of walkers.

    Parameters
    ----------
    density : what they are to be distributed by.
    walkers : where they are.
    moves : how they move.
    n_steps : a multiple of `STORE_EVERY`.

    Returns
    -------
    The steps, and the walkers after them.
    """
    n_walker, n = walkers.coords.shape
    made = {kind: _Counted(_move(kind, n, moves.proposal)) for kind in moves.shares}
    weighted = [(made[kind], share) for kind, share in moves.shares.items()]
    sampler = emcee.EnsembleSampler(n_walker, n, density, vectorize=True, moves=weighted)
    random = ("MT19937", walkers.random_keys, walkers.random_position, walkers.random_has_gauss, walkers.random_gauss)
    begin = emcee.State(walkers.coords, log_prob=walkers.log_density, random_state=random)
    end = sampler.run_mcmc(
        begin, n_steps // STORE_EVERY, thin_by=STORE_EVERY, skip_initial_state_check=True, progress=False
    )
    return Path(
        np.asarray(sampler.get_chain(), dtype=float),
        np.asarray(sampler.get_log_prob(), dtype=float),
        {kind: move.tried for kind, move in made.items()},
        {kind: move.accepted for kind, move in made.items()},
        _walkers(np.asarray(end.coords, dtype=float), np.asarray(end.log_prob, dtype=float), end.random_state),
    )


class _Counted(emcee.moves.Move):
    """A move that counts what it tries and what is accepted."""

    def __init__(self, move: emcee.moves.Move) -> None:
        self.move, self.tried, self.accepted = move, 0, 0

    def propose(self, model: object, state: emcee.State) -> tuple[emcee.State, npt.NDArray[np.bool_]]:
        """See `emcee.moves.Move`."""
        state, accepted = self.move.propose(model, state)
        self.tried += accepted.size
        self.accepted += int(np.sum(accepted))
        return state, accepted


def _move(kind: str, n: int, proposal: Proposal | None) -> emcee.moves.Move:
    if kind in ("differential evolution", "jump"):
        return emcee.moves.DEMove(gamma0=1.0 if kind == "jump" else 1.67 / np.sqrt(2 * n))
    if proposal is None:
        raise ValueError(f"a move {kind!r} needs a proposal")

    def new_places(x: FloatArray, random: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        y = proposal.draw(random, x.shape[0]) if kind == "proposal" else proposal.step(random, x, _NEARBY)
        return y, proposal.log_density(x) - proposal.log_density(y)

    return emcee.moves.MHMove(new_places)


def _walkers(coords: FloatArray, log_density: FloatArray, random_state: tuple[object, ...]) -> Walkers:
    _, keys, position, has_gauss, gauss = random_state
    return Walkers(
        coords,
        log_density,
        np.asarray(keys, dtype=np.uint32),
        int(np.asarray(position)),
        int(np.asarray(has_gauss)),
        float(np.asarray(gauss)),
    )
