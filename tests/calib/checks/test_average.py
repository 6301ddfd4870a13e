"""Models averaged instead of chosen: their weights, the mixture of their draws, and what its verdict holds against it."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import logsumexp, softmax

sys.path.insert(0, str(Path(__file__).parents[1] / "runs"))

from averages import believed, with_own_padding

from calib.checks import AverageMember, ComparedModel, Reason, Verdict, Weighting, average_models, judge_posterior, predict
from calib.checks.weights import model_weights, stacking
from calib.errors import InputError
from calib.experiment import model_in_words
from calib.sampling import Departure, FirstAnswer, FirstEstimate, LeaveOut, Posterior, load_posterior, save_posterior
from models.analytic import ClosedForm

MakePosterior = Callable[..., Posterior]
FORWARD = ClosedForm(force_error=0.002, capacitance_error=0.005)
RNG = np.random.default_rng(5)


def averaged(*posteriors: Posterior, by: Weighting = "evidence", verdicts: Sequence[Verdict] = ()) -> Posterior:
    """The average of posteriors named a, b, ..., whose blocks are predicted alike."""
    models = [AverageMember("abc"[k], p, FORWARD, verdicts[k] if verdicts else Verdict()) for k, p in enumerate(posteriors)]
    alike = LeaveOut(0.0, 0.0, 0.0, np.zeros(8), np.zeros(8))
    return average_models(models, [ComparedModel(m.name, m.posterior, alike, 0.0, 0.0) for m in models], by)[0]


@pytest.fixture(scope="module")
def given(make_posterior: MakePosterior) -> Posterior:
    return believed(make_posterior(n_specimen=1), 0.0)


def test_stacking_finds_the_weights_that_a_general_optimiser_finds() -> None:
    for _ in range(5):
        pointwise = RNG.normal(0, 2, (4, 20))

        def lost(x: np.ndarray, pointwise: np.ndarray = pointwise) -> float:
            return -float(np.sum(logsumexp(np.log(softmax(x))[:, None] + pointwise, axis=0)))

        other = minimize(lost, np.zeros(4))
        own = float(np.sum(np.log(stacking(pointwise) @ np.exp(pointwise))))
        assert own >= -other.fun - 1e-4


def test_each_block_of_a_bootstrap_counts_as_often_as_it_is_drawn() -> None:
    pointwise = RNG.normal(0, 1, (3, 6))
    twice = np.array([2.0, 0, 1, 1, 0, 2])
    drawn = np.repeat(pointwise, twice.astype(int), axis=1)
    assert stacking(pointwise, twice) == pytest.approx(stacking(drawn), abs=1e-3)


def test_a_model_that_is_better_at_every_block_has_all_the_weight_and_equal_models_share_it() -> None:
    better = np.stack([np.zeros(20), np.full(20, -2.0)])
    for own in model_weights(better, np.array([0.0, -40.0]), np.full(2, 0.1)).values():
        assert own.value == pytest.approx([1, 0], abs=1e-6)
    for own in model_weights(np.zeros((2, 20)), np.zeros(2), np.full(2, 0.1)).values():
        assert own.value == pytest.approx([0.5, 0.5])


def test_few_blocks_that_disagree_leave_the_weights_open() -> None:
    pointwise = np.stack([np.zeros(10), np.tile([-1.0, 1.0], 5)])
    ways = model_weights(pointwise, np.full(2, math.nan), np.full(2, math.nan))
    assert set(ways) == {"stacking", "pseudo-bma"}  # there is no evidence
    for own in ways.values():
        assert np.all(own.low <= own.value)
        assert np.all(own.value <= own.high)
        assert own.high[0] - own.low[0] > 0.5


def test_draws_of_each_model_are_there_by_its_weight_and_the_moments_are_those_of_the_mixture(given: Posterior) -> None:
    other = with_own_padding(given, 1.2, math.log(3.0))
    mixed = averaged(given, other)
    assert [m.weight for m in mixed.diagnostics.models] == pytest.approx([0.25, 0.75])
    assert mixed.of_model is not None
    assert np.mean(mixed.of_model, axis=1) == pytest.approx(0.75)
    modulus = mixed.draws[..., [p.name for p in mixed.parameters].index("young_modulus")]
    for k, p in enumerate((given, other)):
        own = p.diagnostics.parameters["young_modulus"]
        assert np.mean(modulus[mixed.of_model == k]) == pytest.approx(own.mean, abs=0.3 * own.sd)
    summary = mixed.diagnostics.parameters["young_modulus"]
    means = np.array([p.diagnostics.parameters["young_modulus"].mean for p in (given, other)])
    between = 0.25 * 0.75 * np.ptp(means) ** 2
    within = sum(w * p.diagnostics.parameters["young_modulus"].sd ** 2 for w, p in ((0.25, given), (0.75, other)))
    assert summary.sd**2 == pytest.approx(between + within, rel=0.02)


def test_the_padding_of_a_model_with_one_silicone_has_the_modulus_of_the_sensor(given: Posterior) -> None:
    mixed = averaged(given, with_own_padding(given))
    names = [p.name for p in mixed.parameters]
    assert set(names) == {p.name for p in given.parameters} | {"padding_young_modulus"}
    ratio = mixed.draws[..., names.index("padding_young_modulus")] / mixed.draws[..., names.index("young_modulus")]
    assert ratio[mixed.of_model == 0] == pytest.approx(1.0)
    assert ratio[mixed.of_model == 1] == pytest.approx(0.9)


def test_an_average_is_kept_to_the_last_bit(given: Posterior, tmp_path: Path) -> None:
    mixed = averaged(given, with_own_padding(given))
    save_posterior(mixed, tmp_path / "posterior.nc")
    again = load_posterior(tmp_path / "posterior.nc")
    assert again.diagnostics.models == mixed.diagnostics.models
    assert np.array_equal(again.draws, mixed.draws)
    assert again.of_model is not None
    assert mixed.of_model is not None
    assert np.array_equal(again.of_model, mixed.of_model)


def test_an_average_tells_what_the_draws_of_its_models_were_made_with(given: Posterior) -> None:
    one, other = (
        replace(given, attrs={"version of calib": "0.1.0", "platform": "Linux", "commit": commit}) for commit in ("abc", "def")
    )
    attrs = averaged(one, other).attrs
    assert (attrs["version of calib"], attrs["platform"], attrs["commit"]) == ("0.1.0", "Linux", "abc; def")


@pytest.mark.parametrize(("log_evidence", "colour"), [(0.0, "red"), (-9.0, "green")])
def test_a_red_model_makes_the_average_red_if_it_counts(given: Posterior, log_evidence: float, colour: str) -> None:
    bad = Verdict((Reason("fit", "red", "the model does not describe the force", "Look at the residuals"),))
    mixed = averaged(given, with_own_padding(given, 1.0, log_evidence), verdicts=(Verdict(), bad))
    verdict = judge_posterior(mixed)
    assert verdict.colour == colour
    if colour == "red":
        assert verdict.reasons[0].finding == "under b: the model does not describe the force"


def test_what_speaks_against_every_model_is_said_once(given: Posterior) -> None:
    bad = Verdict((Reason("lab data", "amber", "the load drifts", "Measure again"),))
    mixed = averaged(given, with_own_padding(given), verdicts=(bad, bad))
    assert [r.finding for r in judge_posterior(mixed).reasons] == ["the load drifts"]


def test_a_model_that_has_not_converged_is_named(given: Posterior) -> None:
    d = given.diagnostics
    unfinished = replace(given, diagnostics=replace(d, converged=False, reasons=("R-hat is 1.3",)))
    reasons = judge_posterior(averaged(with_own_padding(given), unfinished)).reasons
    assert [(r.gate, r.level) for r in reasons] == [("convergence", "red")]
    assert "b: R-hat is 1.3" in reasons[0].finding


def test_only_models_beside_those_averaged_are_held_against_the_average(given: Posterior) -> None:
    other = with_own_padding(given, 1.0, math.log(3.0))
    inside = Departure("own-padding", model_in_words(other.experiment), math.log(3.0), None)
    beside = Departure("gent", "Gent, frictionless", 3.0, None)
    departing = replace(given, diagnostics=replace(given.diagnostics, departures=(inside, beside)))
    (left,) = averaged(departing, other).diagnostics.departures
    # The average is twice as probable as the first model, which has a quarter of its evidence.
    assert left.model == beside.model
    assert left.log_bayes == pytest.approx(3.0 - math.log(2.0))


def test_a_first_answer_at_another_mode_than_the_draws_has_no_say(given: Posterior) -> None:
    own = given.diagnostics.parameters["young_modulus"]
    elsewhere = FirstEstimate(own.mean + 5 * own.sd, own.sd)
    first = FirstAnswer({"young_modulus": elsewhere}, 400.0, log_evidence=500.0)
    misled, without = (replace(given, diagnostics=replace(given.diagnostics, first_answer=f)) for f in (first, None))
    weights = [m.weights["evidence"] for m in averaged(without, misled).diagnostics.models]
    assert weights == pytest.approx([0.5, 0.5])  # both are asked once more


def test_without_evidence_the_models_are_weighted_by_blocks_or_refused(given: Posterior, make_posterior: MakePosterior) -> None:
    dear = replace(given.experiment, model="fem")  # of which none is computed
    without = replace(make_posterior(n_specimen=1), experiment=dear)
    for way in ("pseudo-bma", "stacking"):
        assert averaged(given, without, by=way).attrs["averaged by"] == way
    with pytest.raises(InputError, match="no evidence of all of them"):
        averaged(given, without, by="evidence")


def test_weights_that_rest_on_blocks_which_cannot_be_left_out_are_doubted(given: Posterior) -> None:
    models = [AverageMember(name, p, FORWARD, Verdict()) for name, p in (("a", given), ("b", with_own_padding(given)))]
    pulls = LeaveOut(0.0, 0.0, 0.0, np.zeros(8), np.array([0.9, *np.zeros(7)]))
    candidates = [ComparedModel(m.name, m.posterior, pulls, 0.0, 0.0) for m in models]
    found = judge_posterior(average_models(models, candidates, "stacking")[0]).reasons
    assert [(r.gate, r.level) for r in found] == [("weights", "amber")]
    assert "1 block of data under a" in found[0].finding
    assert judge_posterior(average_models(models, candidates, "evidence")[0]).colour == "green"


def test_predictions_are_those_of_both_models(given: Posterior) -> None:
    # Twice the modulus in half of the draws: bands that hold both curves.
    other = with_own_padding(given, 2.0)
    models = [AverageMember(name, p, FORWARD, Verdict()) for name, p in (("a", given), ("b", other))]
    alike = LeaveOut(0.0, 0.0, 0.0, np.zeros(8), np.zeros(8))
    mixed, members = average_models(models, [ComparedModel(m.name, m.posterior, alike, 0.0, 0.0) for m in models])
    (both,) = predict(mixed, FORWARD, np.random.default_rng(1), members=members, n_draw=100)
    (soft,), (stiff,) = (predict(p, FORWARD, np.random.default_rng(1), n_draw=100) for p in (given, other))
    band, low, high = (p.channels["force"].bands.model[:, -1] for p in (both, soft, stiff))
    assert band[0] == pytest.approx(low[1], rel=0.02)
    assert band[-1] == pytest.approx(high[-2], rel=0.02)


def test_what_is_of_a_lot_comes_last_in_an_average_of_lots(make_lot: MakePosterior) -> None:
    lot = believed(make_lot(), 0.0)
    found = averaged(lot, with_own_padding(lot))
    of_lots = [p.name for p in found.parameters[len(found.unknowns) :]]
    assert of_lots == [p.name for p in lot.parameters[len(lot.unknowns) :]]
    assert of_lots[:2] == ["young_modulus", "young_modulus_spread"]
    own = {p.name: found.draws[..., k] for k, p in enumerate(found.parameters)}
    assert np.mean(own["young_modulus"]) == pytest.approx(1.1 * np.mean(lot.draws[..., len(lot.unknowns)]), rel=0.02)
    assert np.isfinite(found.diagnostics.parameters["young_modulus_spread"].r_hat)
