"""Densities whose moments are known: what has converged is right, all modes are there, and good ones are not refused."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

from samplers.gallery import banana, gallery, mixture, specimens
from samplers.known import Known, truth_of
from samplers.traps import traps
from samplers.trial import try_target

from calib.sampling.diagnostics import Gate
from calib.sampling.ends import ENDLESS
from calib.sampling.funnel_fit import fit_funnel, normal_funnel
from calib.sampling.importance import contradictions, misweighted, nearest, second_opinion
from calib.sampling.proposal import Proposal, fit_proposal
from calib.sampling.start import distinct_modes, find_modes, join_modes, start
from calib.sampling.target import Mode
from models.sensor import FloatArray

GALLERY = gallery()
#: A few that take a second or two each; all of them: `python benchmarks/sampling.py targets`, in docs/sampling.md.
FAST = (
    "normal, 20",
    "ridge of 1e4",
    "Student t, 3 degrees, 10",
    "two modes 14 sd apart, 0.9",
    "wide 0.9 beside narrow, higher",
    "three modes",
    "flat up to a bound, normal scores",
    "others follow two values at their ends",
    "skewed marginals",
)


@pytest.mark.parametrize("name", FAST)
def test_a_run_converges_and_has_means_widths_and_modes_right(name: str) -> None:
    target = GALLERY[name]
    trial = try_target(target, truth_of(target), seed=11, max_steps=600)
    assert not trial.reasons
    assert not trial.errors.wrong, trial.errors


def test_what_was_stopped_early_says_so() -> None:
    target = banana("banana", 4, 1.0, 1.0, thin=0.2)
    trial = try_target(target, truth_of(target), seed=1, max_steps=100)
    assert trial.reasons


@pytest.mark.parametrize("name", [name for name, target in GALLERY.items() if target.modes is not None])
@pytest.mark.parametrize("seed", range(4))
def test_every_mode_is_found_and_none_is_joined_to_another(name: str, seed: int) -> None:
    target = GALLERY[name]
    assert target.modes is not None
    found = [m for own in np.random.SeedSequence(seed).spawn(4) for m in find_modes(target, own)]
    there = target.modes(np.stack([m.x for m in join_modes(target, found)]))
    assert set(there) == set(target.modes(target.exact(np.random.default_rng(1), 5000)))


def test_two_modes_of_what_many_specimens_share_are_never_called_converged() -> None:
    target = specimens("two modes of a shared unknown", 6, 0.0, apart=12.0)
    trial = try_target(target, truth_of(target), seed=1, max_steps=100, gate=Gate(r_hat=1.5, ess=10, length=0.5))
    assert any("2 modes were found" in reason for reason in trial.reasons)


def test_draws_that_all_lie_in_one_place_tell_no_shape() -> None:
    known = Proposal((normal_funnel(np.zeros(3), np.eye(3), (), 5.0, 1.2),), np.ones(1))
    assert fit_proposal(np.ones((500, 3)), (), known).parts == known.parts


def test_a_proposal_follows_scales_that_are_long_on_one_side_and_has_the_density_of_its_draws() -> None:
    rng = np.random.default_rng(4)

    def draws(n_draw: int) -> FloatArray:
        u = np.log(rng.gamma(1.5, size=(n_draw, 1)))
        return np.concatenate([u, np.exp(u / 2) * rng.standard_normal((n_draw, 2))], axis=1)

    fitted, fresh = fit_funnel(draws(4000), (0,)), draws(4000)
    normal = replace(fitted, skew=np.zeros((1, 4)))
    assert np.mean(fitted.log_density(fresh) - normal.log_density(fresh)) > 0.04
    t = fitted.fresh(np.random.RandomState(1), 20)
    x = fitted.at(t)
    np.testing.assert_allclose(fitted.residuals(x), t, atol=1e-9)
    step = 1e-5 * np.eye(3)
    slopes = np.stack([(fitted.at(t + d) - fitted.at(t - d)) / 2e-5 for d in step], axis=1)
    np.testing.assert_allclose(np.linalg.slogdet(slopes)[1], fitted.log_volume(x), atol=1e-6)
    # For draws x of a density p, p(x + d) / p(x) is 1 in the mean, whatever d is.
    drawn = fitted.draw(np.random.RandomState(2), 20_000)
    ratio = np.exp(fitted.log_density(drawn + np.array([0.05, 0.02, 0.0])) - fitted.log_density(drawn))
    assert np.mean(ratio) == pytest.approx(1, abs=4.5 * np.std(ratio) / np.sqrt(ratio.size))


def test_a_proposal_follows_values_to_their_ends_and_has_the_density_of_its_draws() -> None:
    target = GALLERY["others follow two values at their ends"]
    assert target.ends is not None
    x, fresh = (target.exact(np.random.default_rng(seed), 4000) for seed in (1, 2))
    fitted, plain = fit_funnel(x, (), ends=target.ends), fit_funnel(x, ())
    assert list(fitted.order[fitted.ended]) == [0, 1]
    assert np.mean(fitted.log_density(fresh) - plain.log_density(fresh)) > 1
    # As far out as one draw in a thousand lies, the density is that of the target but for a factor.
    off = target.log_density(fresh) - fitted.log_density(fresh)
    far = np.any(fresh[:, :2] < np.quantile(x[:, :2], 1e-3, axis=0), axis=1)
    assert np.any(far)
    assert np.max(np.abs(off[far] - np.median(off))) < 3.5
    t = fitted.fresh(np.random.RandomState(1), 20)
    at = fitted.at(t)
    np.testing.assert_allclose(fitted.residuals(at), t, atol=1e-7)
    step = 1e-5 * np.eye(target.n)
    slopes = np.stack([(fitted.at(t + d) - fitted.at(t - d)) / 2e-5 for d in step], axis=1)
    np.testing.assert_allclose(np.linalg.slogdet(slopes)[1], fitted.log_volume(at), atol=1e-6)
    drawn = fitted.draw(np.random.RandomState(2), 20_000)
    aside = np.r_[0.05, 0.1, np.zeros(target.n - 2)]
    aside[2:] = 0.05 * np.std(x[:, 2:], axis=0)
    for step_of in (np.r_[aside[:2], np.zeros(target.n - 2)], np.r_[0.0, 0.0, aside[2:] / 10]):
        ratio = np.exp(fitted.log_density(drawn + step_of) - fitted.log_density(drawn))
        assert np.mean(ratio) == pytest.approx(1, abs=4.5 * np.std(ratio) / np.sqrt(ratio.size))


def test_values_that_do_not_bend_where_the_draws_are_leave_a_proposal_as_it_is_to_the_bit() -> None:
    rng = np.random.default_rng(5)
    x = rng.standard_normal((2000, 3)) * [1.0, 0.05, 0.1]
    x[:, 2] += 2 * x[:, 1]
    plain, fitted = fit_funnel(x, (0,)), fit_funnel(x, (0,), ends=np.array([ENDLESS, (0.0, np.inf), (-0.1, 0.1)]))
    np.testing.assert_array_equal(plain.log_density(x), fitted.log_density(x))


def test_walkers_start_where_the_mass_of_a_funnel_is_and_not_at_its_mode() -> None:
    target = GALLERY["funnel, 10"]
    modes = join_modes(target, find_modes(target, np.random.SeedSequence(1)))
    assert modes[0].x[0] < -9  # the logarithm of the width has mean 0 and sd 1.5
    begun = start(target, modes, np.random.SeedSequence(1), 160)
    assert abs(np.mean(begun.state.coords[:, 0])) < 0.75
    assert begun.proposal is not None


def test_walkers_start_within_hard_bounds_even_where_few_draws_are() -> None:
    target = GALLERY["corner of hard bounds"]
    modes = join_modes(target, find_modes(target, np.random.SeedSequence(1)))
    begun = start(target, modes, np.random.SeedSequence(1), 64)
    assert np.all(np.isfinite(begun.state.log_prob))


@pytest.mark.parametrize("target", GALLERY.values(), ids=GALLERY)
def test_exact_draws_of_a_target_are_those_of_its_density(target: Known) -> None:
    # For draws x of a density p that is nowhere zero, p(x + d) / p(x) is 1 in the mean, whatever d is.
    x = target.exact(np.random.default_rng(3), 20_000)
    if target.name == "corner of hard bounds":
        assert np.all(np.isfinite(target.log_density(x)))
        return
    step = 0.1 * np.linalg.cholesky(np.cov(x.T)) @ np.full(target.n, target.n**-0.5)
    if target.scales or "unnamed" in target.name:
        step = step * np.r_[np.ones(max(1, len(target.scales))), np.zeros(target.n - max(1, len(target.scales)))]
    ratio = np.exp(target.log_density(x + step) - target.log_density(x))
    error = np.std(ratio) / np.sqrt(ratio.size)
    assert np.mean(ratio) == pytest.approx(1, abs=4.5 * error + 1e-3)


def test_draws_that_lack_a_mode_are_wrong_though_their_means_are_near() -> None:
    target = mixture("two", np.array([[0.0, 0.0], [9.0, 0.0]]), [1, 1], [0.96, 0.04])
    truth = truth_of(target)
    x = target.exact(np.random.default_rng(1), 20_000)
    assert not truth.errors(target, x).wrong
    assert truth.errors(target, x[x[:, 0] < 4.5]).missing == pytest.approx(0.04, abs=0.003)


def test_a_mode_that_was_found_is_not_left_out_for_a_flat_top_that_seems_to_hold_all_the_mass() -> None:
    target = traps()["flat top beside a normal mode, 20"]
    assert target.modes is not None
    found = [m for own in np.random.SeedSequence(1).spawn(4) for m in find_modes(target, own)]
    assert min(m.log_mass for m in found) < max(m.log_mass for m in found) - 10  # of two that have half of it each
    assert set(target.modes(np.stack([m.x for m in join_modes(target, found)]))) == {0, 1}


@pytest.mark.parametrize("seed", range(3))
def test_a_mode_in_a_corner_is_found_though_every_climb_to_it_ends_on_a_slope(seed: int) -> None:
    target = traps()["mode in a corner of bounds"]
    assert target.modes is not None
    found = [m for own in np.random.SeedSequence(seed).spawn(4) for m in find_modes(target, own)]
    assert set(target.modes(np.stack([m.x for m in join_modes(target, found)]))) == {0, 1}


def test_a_mode_in_a_corner_has_the_weight_that_is_its_own() -> None:
    target = traps()["mode in a corner of bounds"]
    trial = try_target(target, truth_of(target), seed=1, max_steps=150)
    np.testing.assert_allclose(trial.weights, 0.5, atol=0.07)


@pytest.mark.parametrize("wider", [0.1, 1.0, 3.0])
def test_a_mode_that_all_chains_and_proposals_lack_is_seen_by_draws_round_it(wider: float) -> None:
    target = mixture("two", np.array([[0.0] * 6, [9.0] * 6]), [1, 0.1], [0.96, 0.04])
    there = [Mode(np.full(6, 9.0 * k), value, width * np.eye(6)) for k, value, width in ((0, 0.0, 1.0), (1, 10.0, 0.1 * wider))]
    lacking = [Proposal((normal_funnel(np.zeros(6), np.eye(6), (), 8.0, 1.05),), np.ones(1))] * 4
    blind = second_opinion(target, lacking, np.random.SeedSequence(1))
    assert blind.trusted
    assert not contradictions(blind, target.names, np.zeros(6), np.ones(6), np.full(6, 4000.0))
    for proposals in (lacking, []):
        opinion = second_opinion(target, proposals, np.random.SeedSequence(1), there)
        reason = misweighted(opinion, there, np.array([1.0, 0.0]), 4000.0)[-1]
        assert "has 0.0 % of the chains' draws" in reason


def test_chains_that_weigh_modes_rightly_are_not_contradicted() -> None:
    target = mixture("two", np.array([[0.0] * 6, [9.0] * 6]), [1, 0.1], [0.96, 0.04])
    x = target.exact(np.random.default_rng(1), 4000)
    modes = [Mode(np.full(6, 9.0 * k), 0.0, width * np.eye(6)) for k, width in ((0, 1.0), (1, 0.1))]
    fitted = fit_proposal(x, (), Proposal(tuple(normal_funnel(m.x, m.factor, (), 5.0, 1.2) for m in modes), np.full(2, 0.5)))
    opinion = second_opinion(target, [fitted] * 4, np.random.SeedSequence(1), modes)
    share = np.bincount(nearest(x, modes)) / len(x)
    assert share[1] == pytest.approx(0.04, abs=0.01)
    assert opinion.trusted
    assert not misweighted(opinion, modes, share, 4000.0)


def test_a_mode_that_seems_to_hold_next_to_nothing_is_among_those_that_are_looked_at_again() -> None:
    target = mixture("two", np.array([[0.0] * 6, [9.0] * 6]), [1, 0.1], [0.96, 0.04])
    at = target.log_density(np.array([[0.0] * 6, [9.0] * 6, [9.01] * 6]))
    light = [Mode(np.full(6, 9.0 + 0.01 * k), float(at[1 + k]), 1e-3 * np.eye(6)) for k in range(2)]
    found = [Mode(np.zeros(6), float(at[0]), np.eye(6)), *light]
    assert len(join_modes(target, found)) == 1
    assert [m.x[0] for m in distinct_modes(target, found)] == [0.0, 9.0]


def test_a_mode_at_the_edge_of_uniform_priors_has_the_weight_that_is_its_own() -> None:
    target = traps()["mode at the edge of uniform priors"]
    trial = try_target(target, truth_of(target), seed=1, max_steps=600)
    assert not trial.reasons
    assert not trial.errors.wrong, trial.errors
