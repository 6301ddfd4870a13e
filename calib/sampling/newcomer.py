"""A newcomer of a calibrated lot in, weighted draws of its posterior, and of the lot's, in a second, out.

The draws of the lot stay what they are. Given one of them, j, what is the newcomer's own is nearly normal in coordinates u in
which its capacitance at rest stands for one of them (`calib.sampling.coordinates`): with readings linear about a point u_0,

    A_j = T^T D_j^-2 T + M^T S_j^-1 M,   b_j = T^T D_j^-2 (mu_j - y(u_0)) + M^T S_j^-1 (r - m_j(u_0)),                  (1)
    log Z_j = log p(r, u_0 | j) + (b_j^T A_j^-1 b_j - log det A_j) / 2,

mu_j and D_j of (1) of `calib.problem.newcomer`, y its coordinates there and T their slopes, m_j the readings and M their
slopes, S_j their covariance. Z_j says how well draw j of the lot foretells the newcomer. So draws are proposed: j by Z_j, with
a part that takes all alike, and u from a Student density about u_0 + A_j^-1 b_j. Each is weighted by what it should be over
what it was proposed with (importance sampling), which mends all that is not linear; k-hat of the weights tells whether that
can be trusted (Vehtari et al., J. Mach. Learn. Res. 25 (2024) 72).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaln

from calib.catalogue import QUANTITIES, UnknownName
from calib.lab import Sweep
from calib.problem import CalibratedLot, Newcomer, Problem, build_problem, log_normal_sweeps, newcomer_of, put_together
from calib.sampling.archive import K_HAT, smooth_weights
from calib.sampling.coordinates import Exchange, capacitance_at_rest, coordinates
from calib.sampling.diagnostics import RANGE_TOUCH, RANGE_TOUCH_SHARE, Diagnostics, Gate, range_warning
from calib.sampling.estimate import highest_mode
from calib.sampling.findings import ParameterSummary
from calib.sampling.laplace import weighed
from calib.sampling.posterior import Posterior
from calib.sampling.scoring import STEP, central_slope
from models.sensor import BoolArray, FloatArray, IntArray

#: Draws of a lot that are taken, and draws of equal weight that stand for the posterior of a newcomer.
LOT_DRAWS, KEPT = 2000, 800

# Draws that are proposed, and degrees of freedom of their density.
_DRAWS, _FREEDOM = 1600, 7.0
# Share of the draws of the lot that are taken whatever Z_j says.
_ALIKE = 0.1
# Draws of the lot given which a mode is looked for, at most.
_TRIED = 5
# Times that the point about which readings are linear is moved to the mean of the weighted draws, at most.
_ROUNDS = 3
# Effective draws that are enough, and the fewest that say anything.
_ENOUGH, FEWEST = 300.0, 100.0


@dataclass(frozen=True, eq=False)
class GivenLot:
    """The posterior of a newcomer given its lot, in weighted draws.

    Attributes
    ----------
    newcomer : whose it is.
    rows : draws of the lot, (n_draw,).
    own : coordinates of its own unknowns, (n_draw, n_own).
    weight : (n_draw,), that make these draws of the posterior; they sum to 1.
    k_hat : shape of the tail of the weights; inf where no draw has any.
    range_use : (n_draw,), how much of the forward model's range each of them uses.
    """

    newcomer: Newcomer
    rows: IntArray
    own: FloatArray
    weight: FloatArray
    k_hat: float
    range_use: FloatArray

    @property
    def effective_draws(self) -> float:
        """How many independent draws it is worth."""
        return 1 / float(np.sum(self.weight**2)) if self.weight.size else 0.0

    @property
    def trusted(self) -> bool:
        """Whether the weights can be trusted, and are of enough draws."""
        return self.k_hat <= K_HAT and self.effective_draws >= FEWEST

    @property
    def values(self) -> dict[str, FloatArray]:
        """Values [SI] of all unknowns by name, (n_draw,)."""
        return self.newcomer.values(self.own, self.rows)


def given_lot(newcomer: Newcomer, seed: int) -> GivenLot:
    """Find the posterior of a newcomer, its lot's posterior being its prior: about a second of processor time.

    Parameters
    ----------
    newcomer : with its data.
    seed : of the draws.

    Returns
    -------
    Weighted draws, which say themselves whether they can be trusted; none where the forward model does not cover its readings.
    """
    rng = np.random.default_rng(seed)
    space = _Space.of(newcomer)
    place, middle = _first_place(newcomer, space, np.random.RandomState(np.random.MT19937(seed)))
    best: GivenLot | None = None
    for _ in range(_ROUNDS):
        found = None if place is None else _proposed(newcomer, space, place, middle, rng)
        if found is None:
            break
        if best is None or found.effective_draws > best.effective_draws:
            best = found
        if best.trusted and best.effective_draws >= _ENOUGH:
            break
        weight = found.weight
        place = weight @ space.from_own(found.own, found.rows)
        middle = int(found.rows[np.argmax(weight)])
    if best is None:
        nothing = np.empty(0)
        return GivenLot(newcomer, np.empty(0, dtype=np.int64), np.empty((0, len(newcomer.own))), nothing, np.inf, nothing)
    return best


@dataclass(frozen=True, eq=False)
class _Space:
    """Coordinates u: those of the newcomer's own unknowns, one of them exchanged for its capacitance at rest."""

    newcomer: Newcomer
    exchange: Exchange | None

    @classmethod
    def of(cls, newcomer: Newcomer) -> _Space:
        found = coordinates(newcomer.given(0)).exchanges
        return cls(newcomer, found[0] if found else None)

    def to_own(self, u: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """Own coordinates (n, n_own), nan where there are none, and log |dy / du|, (n,)."""
        e = self.exchange
        if e is None:
            return u, np.zeros(len(u))
        own = self.newcomer.own[e.column]
        y = u.copy()
        y[:, e.column] = own.mean[rows]
        at, parasitic = self._at_rest(y, rows)
        value = own.value(y[:, e.column])
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            total = e.seen * np.exp(u[:, e.column] * e.width)
            wanted = total - parasitic
            reached = value * (np.where(wanted > 0, wanted, np.nan) / at) ** e.power
            found = own.coordinate(reached)
            log_slope = np.log(np.abs(own.slope(found)) * total / wanted * e.width)
        there = np.isfinite(found) & np.isfinite(log_slope)
        y[:, e.column] = np.where(there, found, np.nan)
        return y, np.where(there, log_slope, -np.inf)

    def from_own(self, y: FloatArray, rows: IntArray) -> FloatArray:
        """The inverse of `to_own`."""
        e = self.exchange
        if e is None:
            return y
        u = y.copy()
        at, parasitic = self._at_rest(y, rows)
        u[:, e.column] = np.log((at + parasitic) / e.seen) / e.width
        return u

    def _at_rest(self, y: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        newcomer = self.newcomer
        return capacitance_at_rest(newcomer.values(y, rows), newcomer.name, newcomer.experiment.sensor_radius)


def _from_the_middle(newcomer: Newcomer) -> IntArray:
    """Draws of the lot, the nearest to the mean of all first, in standard deviations."""
    columns = np.stack([v for v in newcomer.lot.values.values() if np.ptp(v) > 0], axis=1)
    away = (columns - np.mean(columns, axis=0)) / np.std(columns, axis=0)
    return np.argsort(np.sum(away**2, axis=1), kind="stable")


def _first_place(newcomer: Newcomer, space: _Space, random: np.random.RandomState) -> tuple[FloatArray | None, int]:
    """A mode given one draw of the lot, as u (n_own,), and that draw; None where the forward model covers none.

    Given a draw its noises and discrepancies are what they are, and a climb to the mode may end where nothing is described: in
    one case of fifty to a hundred. Then it is tried given others; one that nothing describes ends at the most probable.
    """
    rows = _from_the_middle(newcomer)[:_TRIED]
    best, top, of = None, -np.inf, int(rows[0])
    for row in rows:
        problem = newcomer.given(int(row))
        of_problem = coordinates(problem)
        start = of_problem.from_theta(np.zeros((1, len(problem.parameters))))
        if not np.any(np.isfinite(of_problem.log_density(np.concatenate([start, of_problem.nominal()[None]])))):
            continue
        mode, confirmed = highest_mode(of_problem, random)
        theta, _ = of_problem.to_theta(mode[None])
        density = float(of_problem.log_density(mode[None])[0])
        if not np.all(np.isfinite(theta)) or density <= top:
            continue
        reached = zip(newcomer.own, problem.parameters, theta[0], strict=True)
        y = np.array([[float(own.coordinate(info.prior.ppf_normal(z))) for own, info, z in reached]])
        best, top, of = np.asarray(space.from_own(y, np.array([row]))[0], dtype=float), density, int(row)
        if confirmed:
            break
    return best, of


@dataclass(frozen=True, eq=False)
class _Linear:
    """Equations (1) for draws of the lot: which are covered, log Z_j, the centres and triangular roots of A_j."""

    there: BoolArray
    log_evidence: FloatArray
    centre: FloatArray
    factor: FloatArray


def _proposed(newcomer: Newcomer, space: _Space, place: FloatArray, middle: int, rng: np.random.Generator) -> GivenLot | None:
    """Draws proposed about a place u (n_own,), with their weights; None where no draw of the lot is covered."""
    linear = _linearised(newcomer, space, place, middle)
    if linear is None or not np.any(linear.there):
        return None
    n, k = newcomer.lot.size, place.size
    top = np.max(linear.log_evidence[linear.there])
    likely = np.where(linear.there, np.exp(np.minimum(linear.log_evidence - top, 0.0)), 0.0)
    chance = (1 - _ALIKE) * likely / np.sum(likely) + _ALIKE * linear.there / np.sum(linear.there)
    chance = chance / np.sum(chance)
    # Systematic: of each draw as many as its share says, up to one.
    rows = np.searchsorted(np.cumsum(chance), (np.arange(_DRAWS) + rng.random()) / _DRAWS)
    rows = np.minimum(rows, n - 1)
    normal = rng.standard_normal((_DRAWS, k)) / np.sqrt(rng.chisquare(_FREEDOM, _DRAWS) / _FREEDOM)[:, None]
    u = linear.centre[rows] + np.linalg.solve(np.swapaxes(linear.factor[rows], 1, 2), normal[..., None])[..., 0]
    log_proposed = (
        np.log(chance[rows])
        + np.sum(np.log(np.diagonal(linear.factor[rows], axis1=1, axis2=2)), axis=1)
        - 0.5 * (_FREEDOM + k) * np.log1p(np.sum(normal**2, axis=1) / _FREEDOM)
        + gammaln((_FREEDOM + k) / 2)
    )
    own, log_jacobian = space.to_own(u, rows)
    log_density, range_use = _log_density(newcomer, own, log_jacobian, rows)
    log_ratio = log_density - log_proposed
    if not np.any(np.isfinite(log_ratio)):
        return None
    weight, k_hat = smooth_weights(log_ratio)
    there = weight > 0
    return GivenLot(newcomer, rows[there], own[there], weight[there] / np.sum(weight[there]), k_hat, range_use[there])


def _log_density(
    newcomer: Newcomer, own: FloatArray, log_jacobian: FloatArray, rows: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Logarithm of prior times likelihood in the coordinates u, up to a constant, and the range that is used, (n,) each."""
    there = np.isfinite(log_jacobian) & np.all(np.isfinite(own), axis=1)
    found, range_use = np.full(rows.size, -np.inf), np.full(rows.size, np.inf)
    if not np.any(there):
        return found, range_use
    range_use[there] = 0.0
    value = log_jacobian[there] + newcomer.log_prior(own[there], rows[there])
    models = newcomer.respond(own[there], rows[there])
    for model, part in zip(models, log_normal_sweeps(newcomer.plans, models), strict=True):
        value = value + part
        range_use[there] = np.maximum(range_use[there], model.range_use)
    found[there] = value
    return found, range_use


def _linearised(newcomer: Newcomer, space: _Space, place: FloatArray, middle: int) -> _Linear | None:
    """Equations (1) at a place u, with slopes at one draw of the lot."""
    k, n = place.size, newcomer.lot.size
    step = STEP * np.eye(k)
    around = place + np.concatenate([np.zeros((1, k)), step, -step])
    at_middle = np.full(len(around), middle)
    own, log_jacobian = space.to_own(around, at_middle)
    there = np.isfinite(log_jacobian)
    if not there[0]:
        return None
    own = np.where(there[:, None], own, own[0])
    models = newcomer.respond(own, at_middle)
    for model in models:
        there &= model.covered
    if not there[0]:
        return None
    across = central_slope(own, there)  # (k, n_own): row of u, column of y
    slopes = [
        central_slope(some.readings.mean[np.maximum(np.cumsum(some.covered) - 1, 0)], there).T
        for some in put_together(newcomer.plans, models)
    ]
    rows = np.arange(n)
    own_here, _ = space.to_own(np.tile(place, (n, 1)), rows)
    covered = np.all(np.isfinite(own_here), axis=1)
    own_here = np.where(covered[:, None], own_here, own[0])
    away = newcomer.means - own_here
    precise = 1 / newcomer.spreads**2
    a = np.einsum("ky,ny,ly->nkl", across, precise, across)
    b = np.einsum("ky,ny->nk", across, precise * away)
    log_evidence = -0.5 * np.sum(precise * away**2, axis=1) - np.sum(np.log(newcomer.spreads), axis=1)
    models = newcomer.respond(own_here, rows)
    for model in models:
        covered &= model.covered
    every = iter(slopes)
    for some in put_together(newcomer.plans, models):
        kept = some.readings.only(covered[some.covered])
        misfit = kept.observed - kept.mean
        slope = np.broadcast_to(next(every), (*misfit.shape, k))
        product, log_det = weighed(kept, np.concatenate([slope, misfit[..., None]], axis=2))
        a[covered] += product[:, :-1, :-1]
        b[covered] += product[:, :-1, -1]
        log_evidence[covered] -= 0.5 * (product[:, -1, -1] + log_det)
    factor = np.tile(np.eye(k), (n, 1, 1))
    centre = np.tile(place, (n, 1))
    factor[covered] = np.linalg.cholesky(a[covered])
    white = np.linalg.solve(factor[covered], b[covered][..., None])[..., 0]
    centre[covered] += np.linalg.solve(np.swapaxes(factor[covered], 1, 2), white[..., None])[..., 0]
    log_evidence[covered] += 0.5 * np.sum(white**2, axis=1)
    log_evidence[covered] -= np.sum(np.log(np.diagonal(factor[covered], axis1=1, axis2=2)), axis=1)
    return _Linear(covered, log_evidence, centre, factor)


def lot_of(posterior: Posterior, n_draw: int = LOT_DRAWS) -> CalibratedLot:
    """What a calibration says of its lot, in draws taken evenly from its posterior.

    Parameters
    ----------
    posterior : of one model.
    n_draw : how many, at most.
    """
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    rows = np.unique(np.linspace(0, len(flat) - 1, n_draw).round().astype(np.int64))
    shared = {p.name: np.ascontiguousarray(flat[rows, k]) for k, p in enumerate(posterior.parameters) if not p.specimen}
    known = {n: np.full(rows.size, v) for n, v in posterior.fixed.items() if not UnknownName.parse(n).specimen}
    infos = tuple(p for p in posterior.parameters if not p.specimen)
    return CalibratedLot(posterior.experiment, {**shared, **known}, infos, posterior.table.lots)


def joined_problem(lot: CalibratedLot, sweeps: Sequence[Sweep], newcomer: Newcomer) -> Problem:
    """The calibration of a lot with a newcomer in it, all unknowns of all of them at once: what weights stand in for.

    Parameters
    ----------
    lot : as it was calibrated.
    sweeps : that it was calibrated with.
    newcomer : whose specimen has a name of its own.

    Raises
    ------
    InputError
        As `build_problem`.
    """
    together = (*lot.experiment.specimens, newcomer.experiment.specimens[0])
    experiment = replace(lot.experiment, specimens=together)
    return build_problem(experiment, (*sweeps, *newcomer.sweeps), newcomer.forward)


def given_chains(posterior: Posterior, newcomer: Newcomer, like: str) -> GivenLot:
    """What chains of the calibration of a lot with a newcomer in it say of that, in draws of equal weight.

    Parameters
    ----------
    posterior : of `joined_problem`.
    newcomer : that was joined.
    like : name of the specimen that it was meant to be like.
    """
    lot = lot_of(posterior)
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    rows = np.unique(np.linspace(0, len(flat) - 1, LOT_DRAWS).round().astype(np.int64))
    columns = {p.name: flat[rows, k] for k, p in enumerate(posterior.parameters)}
    again = newcomer_of(replace(lot, lots=newcomer.lot.lots), newcomer.experiment, newcomer.sweeps, newcomer.forward, like)
    own = np.stack([one.coordinate(columns[one.info.name]) for one in again.own], axis=1)
    draws = np.arange(rows.size)
    models = again.respond(own, draws)
    range_use = np.max([model.range_use for model in models], axis=0)
    return GivenLot(again, draws, own, np.full(rows.size, 1 / rows.size), 0.0, range_use)


def posterior_of(found: GivenLot, before: CalibratedLot, seed: int, n_draw: int = KEPT) -> Posterior:
    """The posterior of a newcomer in draws of equal weight, for all that is asked of the posterior of a calibration.

    What is told of how far the data moved an unknown is against what was believed of the newcomer given its lot; of what is
    pooled that is left to `calib.checks.belongs`.

    Parameters
    ----------
    found : of at least one draw.
    before : the lot as it was calibrated.
    seed : of the choice of draws.
    n_draw : how many.
    """
    newcomer, rng = found.newcomer, np.random.default_rng([seed, 1])
    below = np.cumsum(found.weight) / np.sum(found.weight)
    chosen = rng.permutation(np.minimum(np.searchsorted(below, (np.arange(n_draw) + rng.random()) / n_draw), below.size - 1))
    values = found.values
    infos = (*newcomer.lot.parameters, *(one.info for one in newcomer.own))
    shared = {p.name for p in newcomer.lot.parameters}
    fixed = {name: float(column[0]) for name, column in values.items() if name not in {i.name for i in infos}}
    ess = min(found.effective_draws, float(n_draw))
    parameters = {}
    for k, info in enumerate(infos):
        x, weight = values[info.name], found.weight
        mean = float(weight @ x)
        level = quantiles(x, weight, {"low": 0.05, "median": 0.5, "high": 0.95})
        shift, contraction = np.nan, np.nan
        own = None if info.name in shared else newcomer.own[k - len(shared)]
        if own is None:
            known = before.values[info.name]
            shift = (mean - float(np.mean(known))) / float(np.std(known))
        elif own.of_lot is None:
            z = found.own[:, k - len(shared)]
            shift = float(weight @ z)
            contraction = 1 - float(weight @ (z - shift) ** 2)
        parameters[info.name] = ParameterSummary(
            QUANTITIES[info.parameter].unit,
            mean,
            float(np.sqrt(weight @ (x - mean) ** 2)),
            level["median"],
            (level["low"], level["high"]),
            1.0,
            ess,
            ess,
            contraction,
            shift,
        )
    near_end = float(found.weight @ (found.range_use > RANGE_TOUCH))
    diagnostics = Diagnostics(
        converged=True,
        reasons=(),
        warnings=(range_warning(near_end, newcomer.forward.name),) if near_end > RANGE_TOUCH_SHARE else (),
        parameters=parameters,
        steps=0,
        burn_in=0,
        thin=1,
        n_walker=1,
        acceptance_fraction=(),
        tau={},
        gate=Gate(),
    )
    return Posterior(
        experiment=replace(newcomer.experiment, unedited=()),
        sweeps=newcomer.sweeps,
        parameters=infos,
        fixed=fixed,
        forward_name=newcomer.forward.name,
        draws=np.stack([values[i.name][chosen] for i in infos], axis=1)[None],
        log_prob=np.zeros((1, n_draw)),
        log_likelihood=np.empty((1, n_draw, 0)),
        blocks=(),
        n_walkers=1,
        seed=seed,
        diagnostics=diagnostics,
        attrs={},
    )


def quantiles(values: FloatArray, weight: FloatArray, levels: Mapping[str, float]) -> dict[str, float]:
    """Quantiles of weighted draws.

    Parameters
    ----------
    values, weight : (n_draw,).
    levels : name -> level.
    """
    order = np.argsort(values)
    below = np.cumsum(weight[order]) - 0.5 * weight[order]
    return {name: float(np.interp(level, below, values[order])) for name, level in levels.items()}
