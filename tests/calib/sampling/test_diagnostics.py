"""Diagnostics: R-hat and effective sample sizes over ensembles, the gate's sentences, and leave-block-out."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from calib.catalogue import UnknownName
from calib.priors.distributions import LogNormal, Normal
from calib.problem.unknowns import ParameterInfo
from calib.records import record_to_text
from calib.sampling.archive import leave_blocks_out, rank_r_hat
from calib.sampling.diagnostics import (
    Convergence,
    Diagnostics,
    Gate,
    convergence,
    diagnostics_from_json,
    diagnostics_to_json,
    shortcomings,
    summarise,
)
from calib.sampling.ensemble import autocorrelation_time
from calib.sampling.findings import SpotCheck
from models.sensor import FloatArray

N_STEP, N_WALKER = 120, 20


def walkers(rng: np.random.Generator, rho: float, n_step: int = N_STEP, n_parameter: int = 2) -> FloatArray:
    """Independent autoregressive walkers of unit variance, (4, n_step, N_WALKER, n_parameter)."""
    shape = (4, n_step + 200, N_WALKER, n_parameter)
    noise = np.sqrt(1 - rho**2) * rng.standard_normal(shape)
    return np.asarray(lfilter([1.0], [1.0, -rho], noise, axis=1)[:, 200:], dtype=float)


def look(chains: FloatArray, tau: float = 1.0, steps: int = 10_000) -> Convergence:
    return convergence(chains, np.full(chains.shape[-1], tau), steps)


def test_independent_draws_count_fully() -> None:
    state = look(walkers(np.random.default_rng(1), 0.0))
    assert np.all(state.r_hat < 1.005)
    np.testing.assert_allclose(state.ess_bulk, 4 * N_STEP * N_WALKER, rtol=0.15)
    assert shortcomings(state, ("a", "b"), Gate()) == ()


def test_the_effective_sample_size_predicts_the_scatter_of_the_mean() -> None:
    rng = np.random.default_rng(2)
    runs = [walkers(rng, 0.8, n_parameter=10) for _ in range(6)]
    actual = 1 / np.var([run.mean(axis=(0, 1, 2)) for run in runs])
    claimed = np.mean([look(run).ess_bulk for run in runs])
    theory = 4 * N_STEP * N_WALKER * (1 - 0.8) / (1 + 0.8)
    assert claimed == pytest.approx(theory, rel=0.15)
    assert claimed == pytest.approx(actual, rel=0.6)


def test_step_by_step_order_would_hide_the_autocorrelation() -> None:
    chains = walkers(np.random.default_rng(3), 0.95, n_parameter=1)
    disguised = chains[..., 0].reshape(4, -1)[:, None, :, None].swapaxes(1, 2)  # one walker whose steps are all walkers
    assert look(disguised).ess_bulk[0] > 3 * look(chains).ess_bulk[0]


@pytest.mark.parametrize("n_step", [40, 41])
def test_r_hat_compares_the_early_half_of_the_draws_with_the_late_half(n_step: int) -> None:
    chains = walkers(np.random.default_rng(10), 0.5, n_step=n_step, n_parameter=1)
    chains[:, : n_step // 2] += 0.2
    step_by_step = chains[..., 0].reshape(4, -1)  # its halves are early and late, too
    assert look(chains).r_hat[0] == pytest.approx(rank_r_hat(step_by_step), rel=1e-12)
    assert look(chains).r_hat[0] > 1.005


def test_the_autocorrelation_time_of_an_autoregressive_chain() -> None:
    rng = np.random.default_rng(9)
    assert autocorrelation_time(walkers(rng, 0.8, n_step=800)) == pytest.approx(9.0, rel=0.1)  # (1 + rho) / (1 - rho)
    # Of a chain as short as the time itself it says at least that it is too short.
    assert np.all(autocorrelation_time(walkers(rng, 0.98, n_step=99)) > 99 / 5)


@pytest.mark.parametrize("fault", ["one ensemble elsewhere", "one ensemble wider", "all drift"])
def test_ensembles_that_disagree_or_drift_do_not_pass(fault: str) -> None:
    chains = walkers(np.random.default_rng(4), 0.3)
    if fault == "one ensemble elsewhere":
        chains[0] += 0.5
    elif fault == "one ensemble wider":
        chains[0] *= 2.0
    else:
        chains += np.linspace(-0.5, 0.5, N_STEP)[:, None, None]
    state = look(chains)
    reasons = shortcomings(state, ("a", "b"), Gate())
    assert any(reason.startswith("a: R-hat") for reason in reasons)


def test_reasons_name_parameters_and_numbers() -> None:
    state = Convergence(
        np.array([1.0, 1.023]), np.array([5000.0, 390.0]), np.array([350.0, 900.0]), np.array([10.0, 160.0]), 1000
    )
    assert shortcomings(state, ("young_modulus", "load_zero[s]"), Gate()) == (
        "load_zero[s]: R-hat 1.0230 is not below 1.01",
        "young_modulus: tail effective sample size 350 is not above 400",
        "load_zero[s]: bulk effective sample size 390 is not above 400",
        "load_zero[s]: 1000 steps are fewer than 10 autocorrelation times of 160 steps, too few to have forgotten the start",
    )
    assert (state.worst_r_hat, state.least_ess) == (1, 0)


def test_undefined_numbers_do_not_pass() -> None:
    chains = walkers(np.random.default_rng(5), 0.0)
    chains[..., 1] = 3.0
    state = replace(look(chains), tau=np.array([1.0, np.nan]))
    assert any(reason.startswith("b:") for reason in shortcomings(state, ("a", "b"), Gate()))


def test_contraction_is_zero_for_the_prior_and_near_one_for_sharp_data() -> None:
    rng = np.random.default_rng(6)
    parameters = (
        ParameterInfo(UnknownName("young_modulus"), LogNormal(0.7e6, 1.6)),
        ParameterInfo(UnknownName("load_zero", "s"), Normal(0.0, 1.0)),
    )
    theta = rng.standard_normal((20_000, 2)) * [1.0, 0.01]
    values = np.stack([p.prior.ppf_normal(theta[:, k]) for k, p in enumerate(parameters)], axis=1)
    state = Convergence(np.ones(2), np.full(2, 2e4), np.full(2, 2e4), np.ones(2), 1)
    found = summarise(parameters, values, theta, state)
    assert found["young_modulus"].prior_contraction == pytest.approx(0.0, abs=0.03)
    assert found["load_zero[s]"].prior_contraction == pytest.approx(0.9999, abs=1e-4)
    assert found["young_modulus"].unit == "Pa"
    assert found["young_modulus"].interval_90 == pytest.approx(LogNormal(0.7e6, 1.6).interval(0.9), rel=0.03)


def test_diagnostics_survive_json() -> None:
    state = Convergence(np.ones(1), np.full(1, 2e4), np.full(1, 1.5e4), np.ones(1), 1)
    info = ParameterInfo(UnknownName("load_zero", "s"), Normal(0.0, 1.0))
    theta = np.random.default_rng(0).standard_normal((50, 1))
    summaries = summarise((info,), theta, theta, state)
    written = Diagnostics(
        converged=False,
        reasons=("reason",),
        warnings=("warning",),
        parameters=summaries,
        steps=100,
        burn_in=50,
        thin=2,
        n_walker=64,
        acceptance_fraction=(0.3, 0.31),
        tau={"load_zero[s]": 12.5},
        gate=Gate(r_hat=1.05, ess=100.0, length=5.0),
    )
    assert diagnostics_from_json(diagnostics_to_json(written)) == written


def test_diagnostics_without_the_gate_of_their_run_are_not_judged_by_another() -> None:
    record = json.loads(diagnostics_to_json(_diagnostics()))
    kept = {key: value for key, value in record.items() if key not in ("kind", "format", "checksum", "gate")}
    with pytest.raises(KeyError, match="gate"):
        diagnostics_from_json(record_to_text(record["kind"], record["format"], kept))


def _diagnostics(reasons: tuple[str, ...] = (), force_score: float | None = None) -> Diagnostics:
    """Diagnostics with these shortcomings of the chains and this score of the spot check, None if it was not made."""
    check = None if force_score is None else SpotCheck("surrogate", 12, 0.05, 0.01, force_score, 0.9, ())
    return Diagnostics(not reasons, reasons, (), {}, 100, 50, 2, 64, (0.3,), {}, Gate(), check)


@pytest.mark.parametrize(
    ("reasons", "force_score", "honest", "usable"),
    [
        ((), None, None, True),
        ((), 0.9, True, True),
        ((), 9.0, False, False),
        ((), np.inf, None, True),  # states no error, so that there is nothing to be honest about
        (("R-hat",), None, None, False),
        (("R-hat",), 0.9, True, False),
        (("R-hat",), 9.0, False, False),
    ],
)
def test_convergence_of_the_chains_and_honesty_of_the_surrogate_are_two_facts(
    reasons: tuple[str, ...], force_score: float | None, honest: bool | None, usable: bool
) -> None:
    d = _diagnostics(reasons, force_score)
    assert d.converged == (not reasons)
    assert d.surrogate_honest is honest
    assert d.usable == usable
    assert d.reasons == reasons
    assert len(d.surrogate_reasons) == (honest is False)
    assert d.reasons_against_use == (*reasons, *d.surrogate_reasons)


def test_leave_block_out_matches_the_exact_answer_of_a_normal_mean() -> None:
    # y_b ~ N(mu, 1) with a flat prior on mu: y_b given the others is N(mean of the others, 1 + 1/(n-1)).
    rng = np.random.default_rng(7)
    n = 30
    y = rng.standard_normal(n)
    mu = y.mean() + rng.standard_normal((4, 1000)) / np.sqrt(n)
    log_likelihood = -0.5 * np.log(2 * np.pi) - 0.5 * (y - mu[..., None]) ** 2
    others = (y.sum() - y) / (n - 1)
    variance = 1 + 1 / (n - 1)
    exact = -0.5 * np.log(2 * np.pi * variance) - 0.5 * (y - others) ** 2 / variance
    found = leave_blocks_out(log_likelihood)
    assert found.trusted
    np.testing.assert_allclose(found.pointwise, exact, atol=0.03)
    assert found.elpd == pytest.approx(exact.sum(), abs=0.2)


def test_leave_block_out_says_which_block_it_cannot_be_trusted_for() -> None:
    rng = np.random.default_rng(8)
    mu = rng.standard_normal((4, 500))
    y = np.array([0.0, 40.0])
    found = leave_blocks_out(-0.5 * (y - mu[..., None]) ** 2 / 0.1)
    assert found.k_hat[1] > 0.7
    assert not found.trusted


def test_a_parameter_pulled_far_from_its_prior_is_summarised_with_the_number() -> None:
    infos = [
        ParameterInfo(UnknownName("machine_compliance"), Normal(16e-6, 2e-6)),
        ParameterInfo(UnknownName("load_zero", "s"), Normal(0.0, 1.0)),
    ]
    theta = np.random.default_rng(0).standard_normal((4000, 2)) * 0.9 + np.array([-4.5, 1.0])
    values = np.stack([i.prior.ppf_normal(theta[:, k]) for k, i in enumerate(infos)], axis=1)
    state = Convergence(np.ones(2), np.full(2, 900.0), np.full(2, 900.0), np.ones(2), 1000)
    found = summarise(infos, values, theta, state)
    assert found["machine_compliance"].prior_shift == pytest.approx(-4.5, abs=0.1)
