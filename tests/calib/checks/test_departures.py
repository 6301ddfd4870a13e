"""Other models, specimens that differ, and data without a block, by evidence: what is planted is found, with its size."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib.checks.departures import look_elsewhere
from calib.checks.left_out import blocks_foretold, leave_out_exactly, with_blocks_foretold
from calib.checks.left_out_specimens import foretold
from calib.checks.reasons import judge_posterior
from calib.experiment.experiment_file import read_experiment
from calib.experiment.forward import forward_of_experiment
from calib.experiment.plan import Experiment
from calib.problem.density import blocks_of
from calib.problem.problem import Problem, build_problem
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling.estimate import first_answer
from calib.sampling.posterior import Posterior, leave_out
from calib.sampling.sampler import sample
from models.analytic import ClosedForm
from models.response import Forward
from models.sensor import design_from

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor" / "experiment.toml"


def _problem(experiment: Experiment, forward: Forward, true: Forward, *, ratio: float = 1.0, second: float = 1.0) -> Problem:
    """What an experiment measures if its padding is so much stiffer than the sensor, and its second specimen than the first."""
    sweeps = []
    for k, (specimen, factor) in enumerate(zip(experiment.specimens, (1.0, second), strict=False)):
        modulus = 0.65e6 * factor
        truth = {
            "young_modulus": modulus,
            "padding_young_modulus": ratio * modulus,
            "relative_permittivity": 2.8,
            "sensor_thickness": 0.74e-3,
            "padding_thickness": 1.1e-3,
            "dielectric_thickness": 0.16e-3,
            "indenter_radius": 5e-3,
            "sensor_radius": 10e-3,
        }
        rig = Rig(0.2e-3, 3e-6, 0.2, 0.5e-12, 1.0, capacitance_noise=1e-14)
        rng = np.random.default_rng(20190304 + k)
        sweeps.append(synthetic_sweep(true, design_from(truth), 0.55e-3, rig, rng, specimen=specimen.name, n_points=25))
    return build_problem(experiment, sweeps, forward)


@pytest.fixture(scope="module")
def one() -> Experiment:
    plan = read_experiment(DATASET)
    return replace(plan, specimens=plan.specimens[:1])


@pytest.mark.parametrize("ratio", [1.0, 0.65])
def test_padding_that_is_softer_than_the_sensor_is_asked_for_by_the_data(one: Experiment, ratio: float) -> None:
    forward = forward_of_experiment(one)
    problem = _problem(one, forward, forward, ratio=ratio)
    found = {d.name: d for d in look_elsewhere(problem, first_answer(problem)).departures}
    assert {"gent", "stick", "slippery", "own-padding"} <= set(found)
    assert (found["own-padding"].log_bayes > 1) == (ratio != 1)
    assert found["slippery"].log_bayes < -20
    own = found["own-padding"].young_modulus
    assert own is not None
    assert own.mean == pytest.approx(0.65e6, abs=3 * own.sd)


@pytest.mark.parametrize("rate", [0.0, 0.02])
def test_a_clock_that_runs_fast_is_told_from_padding_that_was_chosen_for_what_it_does(rate: float) -> None:
    forward = ClosedForm(force_error=1e-4, capacitance_error=1e-4)
    plan = replace(read_experiment(DATASET), model="closed form", padding_material="own")
    sweeps = []
    for sweep in _problem(plan, forward, forward).sweeps:
        read = sweep.channels["capacitance"]
        assert read.time is not None
        fast = replace(read, time=read.time[-1] + (read.time - read.time[-1]) * (1 + rate))
        sweeps.append(replace(sweep, channels={**sweep.channels, "capacitance": fast}))
    problem = build_problem(plan, sweeps, forward)
    found = {d.name: d for d in look_elsewhere(problem, first_answer(problem)).departures}
    assert (found["clock-rate"].log_bayes > 1) == (rate != 0)
    if rate:
        assert found["clock-rate"].model.endswith(" % fast")
        assert found["clock-rate"].log_bayes > found["one-silicone"].log_bayes


def test_clocks_are_not_asked_for_where_no_other_model_is_or_none_ties_the_readings(one: Experiment) -> None:
    forward = ClosedForm(force_error=0.002)
    problem = _problem(replace(one, model="closed form"), forward, forward)
    assert [d.name for d in look_elsewhere(problem, first_answer(problem)).departures] == ["own-padding"]
    alone = replace(problem.sweeps[0], channels={"force": problem.sweeps[0].channels["force"]})
    pressed = build_problem(replace(problem.experiment, padding_material="own"), [alone], forward)
    assert [d.name for d in look_elsewhere(pressed, first_answer(pressed)).departures] == ["one-silicone"]


def test_a_hopeless_model_is_answered_after_one_climb_by_what_more_would_say(one: Experiment) -> None:
    forward = forward_of_experiment(one)
    problem = _problem(one, forward, forward)
    own = first_answer(problem)
    near = {name: estimate.mean for name, estimate in own.parameters.items()}
    slippery = replace(problem, experiment=replace(problem.experiment, base="slippery"))
    slippery = build_problem(slippery.experiment, problem.sweeps, forward_of_experiment(slippery.experiment))
    whole, crude = first_answer(slippery, near), first_answer(slippery, near, own.log_evidence - 50.0)
    assert crude.log_evidence < own.log_evidence - 50.0
    assert crude.log_evidence == pytest.approx(whole.log_evidence, abs=5.0)
    of_whole, of_crude = whole.parameters["young_modulus"], crude.parameters["young_modulus"]
    assert of_crude.mean == pytest.approx(of_whole.mean, abs=2 * of_whole.sd)
    assert crude.rough
    # A model that describes the readings is asked to its end, whatever the floor is.
    known = first_answer(problem, near)
    assert first_answer(problem, near, np.inf) == known


@pytest.mark.parametrize("second", [1.0, 1.25])
def test_a_specimen_that_is_stiffer_is_not_predicted_by_the_other_and_by_how_much(second: float) -> None:
    forward = ClosedForm(force_error=0.002, capacitance_error=0.005)
    plan = replace(read_experiment(DATASET), model="closed form")
    problem = _problem(plan, forward, ClosedForm(), second=second)
    found = {(f.specimen, f.channel): f for f in look_elsewhere(problem, first_answer(problem)).foretold}
    assert len(found) == 4
    for name, ratio in (("sensor 1", 1 / second), ("sensor 2", second)):
        force, capacitance = (found[name, channel] for channel in ("force", "capacitance"))
        assert force.ratio.mean == pytest.approx(ratio, abs=3 * force.ratio.sd)
        assert (abs(force.z) > 3) == (second != 1)
        assert abs(capacitance.z) < 3


def test_a_specimen_of_a_lot_is_predicted_less_well_than_one_of_the_same_material() -> None:
    forward = ClosedForm(force_error=0.002, capacitance_error=0.005)
    plan = replace(read_experiment(DATASET), model="closed form")
    found = {}
    for pooling in ("complete", "partial"):
        problem = _problem(replace(plan, pooling=pooling), forward, ClosedForm(), second=1.12)
        found[pooling] = {f.channel: f for f in foretold(problem, {}, "sensor 2")}
    force = {pooling: told["force"] for pooling, told in found.items()}
    assert force["partial"].ratio.sd > 2 * force["complete"].ratio.sd
    assert force["complete"].z > 3 > force["partial"].z > 0
    alone = replace(plan, specimens=plan.specimens[:1])
    assert foretold(_problem(alone, forward, ClosedForm()), {}, "sensor 1") == ()


def test_nothing_is_asked_of_the_finite_elements_and_nothing_known_without_a_first_answer(one: Experiment) -> None:
    forward = ClosedForm(force_error=0.002)
    problem = _problem(replace(one, model="closed form"), forward, ClosedForm())
    unknown = look_elsewhere(problem, None).departures
    assert unknown
    assert all(np.isnan(d.log_bayes) for d in unknown)
    exact = replace(problem, experiment=replace(problem.experiment, model="fem"))
    assert look_elsewhere(exact, first_answer(problem)).departures == ()


def _of_few_unknowns(one: Experiment, forward: Forward, lifted: float = 0.0) -> Posterior:
    """A posterior of four unknowns; the capacitance in the second of its blocks may be read too high [F]."""
    problem = _problem(replace(one, model="closed form"), forward, ClosedForm())
    free = ("young_modulus", "force_noise", "parasitic_capacitance", "contact_offset[sensor 1]")
    known = {name: e.mean for name, e in first_answer(problem).parameters.items() if name not in free}
    (sweep,) = problem.sweeps
    points = sweep.channels["capacitance"]
    value = points.value + np.where(np.isin(np.arange(points.value.size), blocks_of(points.value.size)[1]), lifted, 0.0)
    sweep = replace(sweep, channels={**sweep.channels, "capacitance": replace(points, value=value)})
    problem = build_problem(problem.experiment, [sweep], forward)
    problem = replace(problem, parameters=tuple(p for p in problem.parameters if p.name in free), fixed=known)
    return sample(problem, seed=1, processes=0, max_steps=100)


@pytest.mark.parametrize("lifted", [0.0, 3e-14])
def test_a_part_of_a_press_that_was_read_too_high_is_not_where_all_others_let_one_expect(
    one: Experiment, lifted: float
) -> None:
    forward = ClosedForm(force_error=0.002)
    posterior = _of_few_unknowns(one, forward, lifted)
    z = dict(zip(posterior.blocks, blocks_foretold(posterior, forward), strict=True))
    others = [size for name, size in z.items() if name != "sensor 1, capacitance 2"]
    reasons = [r for r in judge_posterior(with_blocks_foretold(posterior, forward)).reasons if r.gate == "left-out data"]
    if lifted:
        assert z["sensor 1, capacitance 2"] > 5.0
        assert z["sensor 1, capacitance 2"] > np.max(np.abs(others))
        assert [r.level for r in reasons] == ["red"]
        assert "part 2 of 3 of the capacitance of sensor 1 is " in reasons[0].finding
        assert "too high" in reasons[0].finding
    else:
        assert np.max(np.abs(list(z.values()))) < 3.0
        assert not reasons


def test_a_block_whose_weights_cannot_be_trusted_is_fitted_anew(one: Experiment) -> None:
    forward = ClosedForm(force_error=0.002)
    posterior = _of_few_unknowns(one, forward)
    right = leave_out(posterior)
    block = int(np.argmin(right.k_hat))
    wild = posterior.log_likelihood.copy()
    wild[..., block] += 9 * np.random.default_rng(2).standard_normal(wild.shape[:2])
    wrong = replace(posterior, log_likelihood=wild)
    assert blocks_foretold(wrong, forward)[block] == pytest.approx(blocks_foretold(posterior, forward)[block], abs=0.15)
    assert block in leave_out(wrong).doubtful
    found = leave_out_exactly(wrong, forward)
    assert block in found.refitted
    assert found.trusted
    assert found.pointwise[block] == pytest.approx(right.pointwise[block], abs=0.3)
    assert found.elpd == pytest.approx(float(np.sum(found.pointwise)))
