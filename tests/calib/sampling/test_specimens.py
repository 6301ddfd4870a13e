"""Many specimens: each moves by itself given what they share, at a cost that grows with their number and no faster."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

from samplers.gallery import specimens
from samplers.known import Known, truth_of
from specimens import EXPERIMENT, lot

from calib.experiment import forward_of_experiment, read_experiment
from calib.priors import LogNormal
from calib.problem import Lot, LotPrior, Problem, Scopes, build_problem, coordinates_of
from calib.sampling.checkpoint import CheckpointFolder, load_chain
from calib.sampling.coordinates import Coordinates, coordinates
from calib.sampling.diagnostics import Gate, shortcomings
from calib.sampling.ensemble import OF_LOT, STORE_EVERY, EnsembleState, Moves, autocorrelation_time, moves_by, walk
from calib.sampling.funnel_fit import fit_funnel
from calib.sampling.identity import usual_walkers
from calib.sampling.importance import second_opinion
from calib.sampling.nested import nested_draws
from calib.sampling.proposal import Proposal
from calib.sampling.sampler import sample_target
from calib.sampling.scoring import score, slopes_at
from calib.sampling.start import find_modes, join_modes, start
from calib.sampling.target import Tie, target_of, tie_of
from models.sensor import FloatArray


@pytest.fixture(scope="module")
def simulated() -> tuple[Problem, dict[str, float]]:
    """A lot of seven and the true values of its unknowns."""
    experiment = read_experiment(EXPERIMENT)
    return lot(experiment, forward_of_experiment(experiment), 7, 3)


@pytest.fixture(scope="module")
def space(simulated: tuple[Problem, dict[str, float]]) -> Coordinates:
    """Its coordinates."""
    return coordinates(simulated[0])


@pytest.fixture(scope="module")
def x(simulated: tuple[Problem, dict[str, float]], space: Coordinates) -> FloatArray:
    """Its true place, (n,)."""
    problem, truth = simulated
    theta = coordinates_of(problem, np.array([[truth[name] for name in problem.names]]))
    return np.asarray(space.from_theta(theta)[0], dtype=float)


def test_parts_sum_to_the_density_and_a_specimen_changes_its_own_alone(space: Coordinates, x: FloatArray) -> None:
    rng = np.random.default_rng(1)
    some = x + 0.02 * rng.standard_normal((7, x.size))
    parts = space.log_parts(some)
    np.testing.assert_allclose(np.sum(parts, axis=1), space.log_density(some), rtol=1e-10)
    for k, own in enumerate(space.scopes.specimens.values(), 1):
        moved = some.copy()
        moved[:, own] += 0.01
        changed = np.any(space.log_parts(moved) != parts, axis=0)
        assert list(np.flatnonzero(changed)) == [k]


def test_a_specimen_that_cannot_be_costs_the_others_nothing(space: Coordinates, x: FloatArray) -> None:
    own = list(space.scopes.specimens.values())[2]
    moved = x.copy()
    moved[own] = 40.0
    before, after = space.log_parts(np.stack([x, moved]))
    assert after[3] == -np.inf
    np.testing.assert_array_equal(np.delete(after, 3), np.delete(before, 3))


def _at_the_end(space: Coordinates, x: FloatArray, specimen: int, unknown: int, way: float) -> FloatArray:
    """X with an unknown of a specimen moved up (1) or down (-1) to the last place that the forward model covers."""
    column = list(space.scopes.specimens.values())[specimen][unknown]
    inside, outside = 0.0, 40.0
    for _ in range(60):
        middle = (inside + outside) / 2
        moved = x.copy()
        moved[column] += way * middle
        covered = np.isfinite(space.log_parts(moved[None])[0, specimen + 1])
        inside, outside = (middle, outside) if covered else (inside, middle)
    moved = x.copy()
    moved[column] += way * inside
    return moved


def test_specimens_at_both_ends_of_the_range_do_not_hide_the_slopes_of_the_others(space: Coordinates, x: FloatArray) -> None:
    unknown = 1
    moved = _at_the_end(space, _at_the_end(space, x, 0, unknown, 1.0), 1, unknown, -1.0)
    before, after = slopes_at(space, x, 1.0), slopes_at(space, moved, 1.0)
    assert before is not None
    assert after is not None
    assert np.all(np.diagonal(after[1]) > 0.5)  # of the prior alone 1, where no reading tells more
    own = list(space.scopes.specimens.values())[2]
    np.testing.assert_allclose(after[0][own], before[0][own], rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(after[1][np.ix_(own, own)], before[1][np.ix_(own, own)], rtol=1e-6)


@pytest.mark.parametrize("power", [1e-3, 1.0])
def test_steps_along_all_specimens_at_once_tell_the_slopes_along_each(space: Coordinates, x: FloatArray, power: float) -> None:
    each = replace(space, scopes=Scopes(np.arange(x.size), {}))
    near = x + 0.01 * np.random.default_rng(0).standard_normal(x.size)
    at_once, apart = slopes_at(space, near, power), slopes_at(each, near, power)
    assert at_once is not None
    assert apart is not None
    for ours, theirs in zip(at_once, apart, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(theirs))))


def test_a_climb_from_what_the_readings_show_ends_where_one_from_the_truth_does(space: Coordinates, x: FloatArray) -> None:
    top = score(space, x)[1]
    strayed = space.nominal()
    strayed[list(space.scopes.specimens.values())[3]] += [0.5, -0.5, 0.0, 0.6, 0.4, 1.0]
    assert score(space, strayed)[1] == pytest.approx(top, abs=0.5)


def test_walkers_of_many_specimens_are_as_many_as_one_specimen_needs(simulated: tuple[Problem, dict[str, float]]) -> None:
    assert usual_walkers(simulated[0]) == 96
    assert len(target_of(simulated[0]).groups) == 7


@pytest.mark.parametrize("kind", OF_LOT)
def test_each_kind_of_move_leaves_the_target_as_it_is_even_with_a_proposal_that_does_not_fit(kind: str) -> None:
    target = specimens("few", 3, 0.3)
    rng = np.random.default_rng(5)
    exact = target.exact(rng, 12_000)
    funnel = fit_funnel(exact[:4000] * 1.3 + 0.2, target.scales, groups=target.groups)
    state = EnsembleState.of(exact, target.log_density(exact), np.random.RandomState(3))
    path = walk(target, state, Moves({kind: 1.0}, Proposal((funnel,), np.ones(1))), 6)
    assert 0.02 < path.accepted_of(kind) < 0.99
    end = path.end.coords
    np.testing.assert_allclose(path.end.log_prob, target.log_density(end), rtol=1e-9, atol=1e-9)
    sd, root = np.std(exact, axis=0), np.sqrt(exact.shape[0])
    assert np.all(np.abs(np.mean(end - exact, axis=0)) <= 5 * np.std(end - exact, axis=0) / root + 1e-9)
    moved = end - np.mean(exact, axis=0), exact - np.mean(exact, axis=0)
    squares = (moved[0] ** 2 - moved[1] ** 2) / sd**2
    assert np.all(np.abs(np.mean(squares, axis=0)) <= 5 * np.std(squares, axis=0) / root + 1e-9)


@dataclass(frozen=True, eq=False)
class Tied(Known):
    """Specimens of one lot of which nothing was read."""

    lots: tuple[Lot, ...] = ()

    def tie(self, x: FloatArray, random: np.random.RandomState) -> Tie | None:
        """See `Target`."""
        return tie_of(self.lots, self.groups, lambda x: x, x, random)


_MEASURED = (None, LogNormal(1.1, 1.05), None, LogNormal(0.95, 1.2), None)
LOT = Lot("young_modulus", LotPrior(LogNormal(1.0, 1.2), LogNormal(0.1, 1.5), _MEASURED), np.arange(2, 7))
TIED = Tied(
    "lot",
    lambda rng, n_draw: np.concatenate([rng.standard_normal((n_draw, 2)), LOT.prior.draw(rng, n_draw)[0]], axis=1),
    lambda x: LOT.log_ratio(x) - 0.5 * np.sum(x**2, axis=1),
    np.array([np.ones(7), np.zeros(7)]),
    scales=(0,),
    groups=tuple(np.array([k], dtype=np.intp) for k in LOT.columns),
    alike=(LOT.columns,),
    parts=lambda x: -0.5 * np.concatenate([np.sum(x[:, :2] ** 2, axis=1, keepdims=True), x[:, 2:] ** 2], axis=1),
    lots=(LOT,),
)


@pytest.mark.parametrize("kind", OF_LOT)
def test_each_kind_of_move_leaves_specimens_of_a_lot_as_they_are(kind: str) -> None:
    exact = TIED.exact(np.random.default_rng(5), 2500)
    funnel = fit_funnel(exact * 1.2 + 0.1, TIED.scales, groups=TIED.groups)
    state = EnsembleState.of(exact, TIED.log_density(exact), np.random.RandomState(3))
    path = walk(TIED, state, Moves({kind: 1.0}, Proposal((funnel,), np.ones(1))), 6)
    assert path.accepted_of(kind) > 0.02
    end = path.end.coords
    np.testing.assert_allclose(path.end.log_prob, TIED.log_density(end), rtol=1e-9, atol=1e-9)

    def seen(x: FloatArray) -> FloatArray:
        """Means, squares, and how far specimens are apart, which the spread decides."""
        own = x[:, 2:]
        scatter = np.log(np.std(own, axis=1, keepdims=True))
        return np.concatenate([x, x**2, np.mean(own, axis=1, keepdims=True) ** 2, scatter, scatter**2], axis=1)

    off = seen(end) - seen(exact)
    assert np.all(np.abs(np.mean(off, axis=0)) <= 4.5 * np.std(off, axis=0) / np.sqrt(len(exact)) + 1e-9)


def test_what_many_specimens_of_a_lot_have_in_common_does_not_creep() -> None:
    # Known to 20 %, and alike within 1 %: given their lot's value, a specimen moves by that 1 %, and all together by less.
    n = 12
    lot = Lot("young_modulus", LotPrior(LogNormal(1.0, 1.2), LogNormal(0.01, 1.5), (None,) * n), np.arange(1, 1 + n))
    together, apart = (
        Tied(
            "alike",
            lambda rng, n_draw: np.concatenate([rng.standard_normal((n_draw, 1)), lot.prior.draw(rng, n_draw)[0]], axis=1),
            lambda x: lot.log_ratio(x) - 0.5 * np.sum(x**2, axis=1),
            np.array([np.ones(1 + n), np.zeros(1 + n)]),
            groups=tuple(np.array([k], dtype=np.intp) for k in lot.columns),
            alike=alike,
            parts=lambda x: -0.5 * x**2,
            lots=(lot,),
        )
        for alike in ((lot.columns,), ())
    )
    times = []
    for target in (together, apart):
        exact = target.exact(np.random.default_rng(5), 2000)
        proposal = Proposal((fit_funnel(exact, (), groups=target.groups),), np.ones(1))
        state = EnsembleState.of(exact[:96], target.log_density(exact[:96]), np.random.RandomState(3))
        moves = moves_by(target, proposal)
        path = walk(target, state, moves, 400)
        means = np.mean(path.chain[..., lot.columns], axis=-1, keepdims=True)
        times.append(STORE_EVERY * float(autocorrelation_time(means[None])[0]))
        assert np.abs(np.mean(means) - np.mean(exact[:, lot.columns])) < 0.3
    assert times[0] < 0.3 * times[1]


def test_independent_draws_say_nothing_of_specimens_that_are_tied() -> None:
    funnel = fit_funnel(TIED.exact(np.random.default_rng(2), 2000), TIED.scales, groups=TIED.groups)
    assert not second_opinion(TIED, [Proposal((funnel,), np.ones(1))] * 4, np.random.SeedSequence(1)).trusted


def test_moduli_of_many_specimens_are_tied_by_their_lot(simulated: tuple[Problem, dict[str, float]]) -> None:
    whole = simulated[0].experiment
    problem = build_problem(replace(whole, pooling="partial"), simulated[0].sweeps, simulated[0].forward)
    target = target_of(problem)
    x = np.tile(target.space.nominal(), (3, 1)) + 0.01 * np.random.default_rng(1).standard_normal((3, len(problem.names)))
    tie = target.tie(x, np.random.RandomState(1))
    assert tie is not None
    assert tie.log_parts(x[:2], np.arange(2)).shape == (2, 7)
    assert target_of(simulated[0]).tie(x, np.random.RandomState(1)) is None
    parts = np.sum(target.log_parts(x), axis=1) + tie.log_density(x)
    np.testing.assert_allclose(parts, target.log_density(x), rtol=1e-9)


def test_up_to_six_specimens_are_sampled_all_at_once(simulated: tuple[Problem, dict[str, float]]) -> None:
    whole, sweeps, forward = simulated[0].experiment, simulated[0].sweeps, simulated[0].forward
    six = build_problem(replace(whole, pooling="partial", specimens=whole.specimens[:6]), sweeps[:6], forward)
    assert target_of(six).groups == ()
    assert usual_walkers(six) == 4 * len(six.names)


def test_specimens_that_are_alike_move_together_where_they_are_sampled_all_at_once(tmp_path: Path) -> None:
    # Known to 20 %, and alike within 1 %: given their lot's value, a specimen moves by that 1 %.
    lot = Lot("young_modulus", LotPrior(LogNormal(1.0, 1.2), LogNormal(0.01, 1.5), (None,) * 4), np.arange(2, 6))
    alike = Known(
        "alike",
        lambda rng, n_draw: np.concatenate([rng.standard_normal((n_draw, 2)), lot.prior.draw(rng, n_draw)[0]], axis=1),
        lambda x: lot.log_ratio(x) - 0.5 * np.sum(x**2, axis=1),
        np.array([np.ones(6), np.zeros(6)]),
        scales=(0,),
    )
    folder = CheckpointFolder(tmp_path, "0" * 64)
    chains = sample_target(alike, folder, seed=7, n_ensembles=4, n_walker=96, gate=Gate(), max_steps=200, processes=0)
    assert not shortcomings(chains.state, alike.names, Gate())
    assert np.max(chains.state.tau) < 10
    draws = np.stack([load_chain(folder, k, chains.n_block, 0, 1)[0] for k in range(4)])
    assert not truth_of(alike).errors(alike, draws[:, draws.shape[1] // 3 :].reshape(-1, alike.n)).wrong


@pytest.mark.parametrize("kind", OF_LOT)
def test_moves_do_without_scales_or_without_anything_else_that_is_shared(kind: str) -> None:
    few = specimens("few", 3, 0.0)
    alike = tuple(np.arange(4 + k, few.n, 3) for k in range(3))
    for target in (replace(few, scales=()), replace(few, scales=(0, 1, 2, 3), alike=alike)):
        exact = target.exact(np.random.default_rng(5), 400)
        funnel = fit_funnel(exact, target.scales, groups=target.groups)
        state = EnsembleState.of(exact, target.log_density(exact), np.random.RandomState(3))
        path = walk(target, state, Moves({kind: 1.0}, Proposal((funnel,), np.ones(1))), 2)
        np.testing.assert_allclose(path.end.log_prob, target.log_density(path.end.coords), rtol=1e-9, atol=1e-9)


def test_independent_draws_of_many_specimens_have_the_means_of_the_target() -> None:
    target = specimens("some", 8, 0.1)
    exact = target.exact(np.random.default_rng(2), 20_000)
    funnel = fit_funnel(exact[:4000], target.scales, groups=target.groups)
    opinion = second_opinion(target, [Proposal((funnel,), np.ones(1))] * 4, np.random.SeedSequence(1))
    assert opinion.trusted
    off = np.abs(opinion.mean - np.mean(exact, axis=0)) / opinion.error
    assert np.max(off) < 4.5
    assert np.max(opinion.error / np.std(exact, axis=0)) < 0.15


def test_draws_of_what_specimens_share_are_weighted_by_what_several_draws_of_each_specimen_say() -> None:
    target = specimens("some", 8, 0.1)
    exact = target.exact(np.random.default_rng(2), 20_000)
    funnel = fit_funnel(exact[:4000] * 1.1 + 0.1 * np.std(exact, axis=0), target.scales, groups=target.groups)
    random = np.random.RandomState(1)
    drawn = nested_draws(target, funnel, random, 6000, 8)
    log_weight = drawn.log_marginal - funnel.log_shared(drawn.x[0])
    weight = np.exp(log_weight - np.max(log_weight))
    weight /= np.sum(weight)
    error = np.std(exact, axis=0) * np.sqrt(np.sum(weight**2))
    chosen = drawn.chosen(random)
    assert np.max(np.abs(weight @ chosen - np.mean(exact, axis=0)) / error) < 4.5
    assert np.max(np.abs(weight @ drawn.mean_of(drawn.x) - np.mean(exact, axis=0)) / error) < 4.5
    np.testing.assert_allclose(weight @ chosen**2 / np.mean(exact**2, axis=0), 1, atol=0.1)
    np.testing.assert_array_equal(chosen[:, :4], drawn.x[0][:, :4])


def test_walkers_of_a_lot_begin_spread_as_the_target_is_though_the_rounds_before_were_too_few() -> None:
    target = specimens("some", 8, 0.1)
    exact = target.exact(np.random.default_rng(2), 20_000)
    (mode,) = join_modes(target, find_modes(target, np.random.SeedSequence(1)))
    begun = start(target, (mode,), np.random.SeedSequence(3), 960, most_rounds=3)  # 0.4 to 1.25 of the spread after these
    assert begun.proposal is not None
    drawn = begun.proposal.draw(np.random.RandomState(1), 20_000)
    for found in (begun.state.coords, drawn):
        spread = np.std(found, axis=0) / np.std(exact, axis=0)
        assert np.min(spread) > 0.6
        assert np.max(spread) < 1.3


def test_a_lot_converges_to_the_truth_and_a_stopped_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    target = specimens("few", 4, 0.1)

    def run(name: str, max_steps: int, gate: Gate) -> tuple[bool, FloatArray]:
        (tmp_path / name).mkdir(exist_ok=True)
        folder = CheckpointFolder(tmp_path / name, "0" * 64)
        chains = sample_target(target, folder, seed=7, n_ensembles=4, n_walker=96, gate=gate, max_steps=max_steps, processes=0)
        return not chains.state.doubts, np.stack([load_chain(folder, k, chains.n_block, 0, 1)[0] for k in range(4)])

    never = Gate(ess=1e9)
    run("stopped", 50, never)
    _, resumed = run("stopped", 150, never)
    undoubted, straight = run("straight", 150, Gate())
    np.testing.assert_array_equal(resumed[:, : straight.shape[1]], straight)
    assert undoubted
    assert not truth_of(target).errors(target, straight[:, straight.shape[1] // 3 :].reshape(-1, target.n)).wrong
