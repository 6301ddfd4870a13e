"""Likelihood: the measurement model, its covariance, what is refused, and the default priors that the data centre."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from calib.errors import InputError
from calib.experiment.experiment_file import read_experiment
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.lab.onset import hertz_onset
from calib.lab.pressing import make_sweep
from calib.lab.sweep import Sweep
from calib.priors.defaults import default_prior
from calib.priors.distributions import Fixed, LogNormal, Normal, Prior, Uniform
from calib.problem.by_name import residuals
from calib.problem.density import given_other_points, log_likelihood_points, log_normal
from calib.problem.likelihood import (
    block_names,
    levels_of_blocks,
    log_likelihood,
    log_likelihood_at,
    log_likelihood_blocks,
    log_posterior,
    predict_sweep,
    range_use,
    without_block,
)
from calib.problem.measurement import model_sweeps
from calib.problem.plan import plan_sweep, plan_sweeps, present
from calib.problem.problem import Problem, build_problem
from calib.problem.readings import PredictedReadings
from calib.problem.repeats import put_together
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.problem.values import columns_at, specimen_design, values_at
from models.analytic import ClosedForm
from models.response import Response
from models.sensor import Design, FloatArray, design_from
from models.surrogate.surrogate import load_surrogate
from models.surrogate.validation import Toleranced

Tie = Literal["clock", "force", "displacement", "none"]

EXACT = ClosedForm(force_error=0.0, capacitance_error=0.0)
RIG = Rig(contact_offset=0.05e-3, machine_compliance=2e-6, load_zero=0.1, parasitic_capacitance=0.3e-12, clock_offset=1.0)
TRUTH: Mapping[str, float] = {
    "indenter_radius": 5e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.7e6,
    "relative_permittivity": 2.8,
    "sensor_thickness": 0.74e-3,
    "padding_thickness": 1.1e-3,
    "dielectric_thickness": 0.16e-3,
}
THICKNESSES: Mapping[str, Prior] = {
    "sensor_thickness": Normal(0.74e-3, 0.02e-3),
    "padding_thickness": Normal(1.1e-3, 0.03e-3),
    "dielectric_thickness": LogNormal(0.16e-3, 1.2),
}


def press(
    seed: int = 0, tie: Tie = "clock", name: str = "", rig: Rig = RIG, depth: float = 0.6e-3, with_force: bool = True
) -> Sweep:
    rng = np.random.default_rng(seed)
    design = design_from(dict(TRUTH))
    return synthetic_sweep(EXACT, design, depth, rig, rng, specimen="sensor 1", name=name, tie=tie, with_force=with_force)


def experiment(
    shared: Mapping[str, Prior] | None = None,
    own: Mapping[str, Prior] | None = None,
    discrepancy: Literal["off", "on"] = "on",
    sweeps: tuple[str, ...] = ("",),
) -> Experiment:
    files = tuple(SweepFiles(name, None, None, 5e-3) for name in sweeps)
    specimen = Specimen("sensor 1", files, {**THICKNESSES, **(own or {})})
    path = Path("experiment.toml")
    return Experiment("test", path, "", 5e-3, 10e-3, "sensor", shared or {}, (specimen,), "closed form", discrepancy)


def true_theta(problem: Problem, rig: Rig = RIG) -> FloatArray:
    """Coordinates of the truth, (1, n_parameter)."""
    truth = {**TRUTH, **{k: getattr(rig, k) for k in rig.__dataclass_fields__}}
    truth |= {"force_discrepancy": 1e-4, "capacitance_discrepancy": 1e-4}
    medians = {p.parameter: float(p.prior.ppf_normal(0.0)) for p in problem.parameters}
    return np.array([[float(p.prior.to_normal({**medians, **truth}[p.parameter])) for p in problem.parameters]])


@dataclass(frozen=True)
class WithError:
    """A forward with error modes that tell apart force and capacitance, to check that they enter the covariance."""

    name: str = "closed form with errors"

    @property
    def identity(self) -> str:
        return self.name

    def max_depth(self, design: Design) -> FloatArray:
        return EXACT.max_depth(design)

    def outside(self, design: Design, depth: FloatArray) -> str:
        return EXACT.outside(design, depth)

    def respond(self, design: Design, depth: FloatArray) -> Response:
        r = EXACT.respond(design, depth)
        change = r.capacitance - np.asarray(r.rest_capacitance)[..., None]
        bump = np.sin(4e3 * r.depth)
        return replace(
            r,
            force_error=0.02 * np.stack([r.force, r.force * bump], axis=-1),
            capacitance_error=0.05 * np.stack([change, change * bump], axis=-1),
        )


def test_every_parameter_is_listed_once_and_named_by_what_it_belongs_to() -> None:
    problem = build_problem(experiment(sweeps=("ball 1", "ball 2")), [press(0, name="ball 1"), press(1, name="ball 2")], EXACT)
    names = problem.names
    assert len(set(names)) == len(names)
    assert {"young_modulus", "sensor_thickness[sensor 1]", "contact_offset[sensor 1, ball 2]"} <= set(names)
    single = build_problem(experiment(), [press()], EXACT)
    assert "contact_offset[sensor 1]" in single.names


def test_what_a_prior_fixes_is_not_sampled_but_used() -> None:
    problem = build_problem(experiment({"machine_compliance": Fixed(2e-6)}), [press()], EXACT)
    assert "machine_compliance" not in problem.names
    assert problem.fixed == {"machine_compliance": 2e-6}
    assert values_at(problem, true_theta(problem))["machine_compliance"] == 2e-6


def test_a_force_only_problem_has_no_electrical_parameters_but_what_a_signal_hangs_on() -> None:
    problem = build_problem(experiment(), [press(tie="none")], EXACT)
    kinds = {p.parameter for p in problem.parameters}
    assert kinds.isdisjoint({"relative_permittivity", "parasitic_capacitance", "capacitance_noise", "clock_offset"})
    # A change of capacitance can be foretold without any having been measured: by the dielectric that is believed in.
    assert "dielectric_thickness" in kinds
    assert np.isfinite(log_likelihood(problem, true_theta(problem)))[0]
    assert np.asarray(specimen_design(problem, values_at(problem, true_theta(problem)), "sensor 1").sensor.thickness).shape == (
        1,
    )


def test_capacitance_with_a_force_column_needs_no_crosshead() -> None:
    problem = build_problem(experiment(), [press(tie="force", with_force=False)], EXACT)
    kinds = {p.parameter for p in problem.parameters}
    assert "load_zero" in kinds
    assert kinds.isdisjoint({"contact_offset", "machine_compliance", "clock_offset", "force_discrepancy"})


@pytest.mark.parametrize(("tie", "with_force"), [("clock", True), ("force", True), ("force", False), ("displacement", True)])
def test_predicted_readings_equal_noiseless_data_at_the_truth(tie: Tie, with_force: bool) -> None:
    quiet = replace(RIG, force_noise=1e-9, capacitance_noise=1e-21)
    sweep = press(tie=tie, rig=quiet, with_force=with_force)
    noises: dict[str, Prior] = {"force_noise": Fixed(5e-3), "capacitance_noise": Fixed(20e-15)}
    problem = build_problem(experiment(noises), [sweep], EXACT)
    model = predict_sweep(problem, values_at(problem, true_theta(problem, quiet)), sweep)
    if "force" in model.channels:
        np.testing.assert_allclose(model.channels["force"].mean[0], model.channels["force"].observed, atol=2e-4)
    assert "capacitance" in model.channels
    np.testing.assert_allclose(model.channels["capacitance"].mean[0], model.channels["capacitance"].observed, atol=2e-15)


def test_the_displacement_of_the_lcr_file_alone_tells_depth_with_the_models_own_force() -> None:
    quiet = replace(RIG, capacitance_noise=1e-21, load_zero=0.0)
    sweep = press(tie="displacement", rig=quiet, with_force=False)
    problem = build_problem(experiment({"capacitance_noise": Fixed(20e-15)}), [sweep], EXACT)
    model = predict_sweep(problem, values_at(problem, true_theta(problem, quiet)), sweep)
    assert "capacitance" in model.channels
    np.testing.assert_allclose(model.channels["capacitance"].mean[0], model.channels["capacitance"].observed, atol=2e-15)


GAINS: Mapping[str, Prior] = {name: LogNormal(1.0, 1.05) for name in ("displacement_gain", "force_gain", "capacitance_gain")}


@pytest.mark.parametrize(("tie", "with_force"), [("clock", True), ("force", True), ("force", False), ("displacement", True)])
def test_readings_of_instruments_with_gains_are_those_of_the_truth(tie: Tie, with_force: bool) -> None:
    rig = replace(RIG, force_noise=0.0, capacitance_noise=0.0, displacement_gain=1.04, force_gain=1.03, capacitance_gain=0.98)
    sweep = press(tie=tie, rig=rig, with_force=with_force)
    problem = build_problem(experiment(GAINS), [sweep], EXACT)
    model = predict_sweep(problem, values_at(problem, true_theta(problem, rig)), sweep)
    for name, channel in model.channels.items():
        np.testing.assert_allclose(channel.mean[0], sweep.channels[name].value, rtol=2e-5, err_msg=name)


@pytest.mark.parametrize("tie", ["clock", "displacement"])
def test_a_load_zero_that_was_set_anew_at_the_touch_is_added_in_contact_alone(tie: Tie) -> None:
    rig = replace(RIG, force_noise=0.0, capacitance_noise=0.0, load_step=-0.04)
    sweep = press(tie=tie, rig=rig)
    problem = build_problem(experiment({"load_step": Normal(0.0, 0.02)}), [sweep], EXACT)
    force = predict_sweep(problem, values_at(problem, true_theta(problem, rig)), sweep).channels["force"]
    # A point within half the distance of points from the touch has a part of the step.
    away = np.abs(force.depth[0]) > 0.5 * np.median(np.diff(force.depth[0]))
    assert np.count_nonzero(~away) <= 1
    np.testing.assert_allclose(force.mean[0][away], force.observed[away], rtol=2e-5, atol=2e-6)
    plain = build_problem(experiment(), [sweep], EXACT)
    without = predict_sweep(plain, values_at(plain, true_theta(plain, rig)), sweep).channels["force"]
    # In a reading that the load moved, what is missing is seen through what the frame gives way by.
    added = np.where(force.depth[0] > 0, 0.04, 0.0)[away]
    np.testing.assert_allclose((without.mean[0] - force.mean[0])[away], added, rtol=0.05, atol=1e-9)


def test_there_is_no_load_step_where_force_ties_the_capacitance_or_where_nobody_names_it() -> None:
    named = build_problem(experiment({"load_step": Normal(0.0, 0.02)}), [press(tie="force")], EXACT)
    unnamed = build_problem(experiment(), [press()], EXACT)
    assert all(p.parameter != "load_step" for problem in (named, unnamed) for p in problem.parameters)


@pytest.mark.parametrize("tie", ["clock", "force", "displacement"])
def test_a_gain_is_worth_as_much_modulus_or_permittivity(tie: Tie) -> None:
    # Force is proportional to the modulus, capacitance to the permittivity: readings alone cannot tell a gain from these.
    sweep = press(tie=tie, rig=replace(RIG, parasitic_capacitance=0.0))
    problem = build_problem(experiment(GAINS), [sweep], EXACT)
    values = values_at(problem, true_theta(problem))
    gains = {"force_gain": 1.03, "capacitance_gain": 0.98}
    with_gain = values | {name: np.array([gain]) for name, gain in gains.items()}
    worth = values | {name: np.array([1.0]) for name in gains}
    worth |= {k: values[k] * g for k, g in (("young_modulus", 1.03), ("relative_permittivity", 0.98))}
    worth["machine_compliance"] = values["machine_compliance"] / 1.03
    one, other = (predict_sweep(problem, v, sweep) for v in (with_gain, worth))
    for name in ("force", "capacitance"):
        a, b = one.channels[name], other.channels[name]
        np.testing.assert_allclose(a.mean, b.mean, rtol=1e-12)
        np.testing.assert_allclose(a.variance, b.variance, rtol=1e-9)
        np.testing.assert_allclose(a.modes, b.modes, rtol=1e-9, atol=1e-12 * np.max(np.abs(b.modes)))


def test_the_radii_of_ball_and_disc_are_used_where_they_are_unknown() -> None:
    sweep = press(rig=replace(RIG, force_noise=0.0, capacitance_noise=0.0))
    radii: Mapping[str, Prior] = {"indenter_radius": Normal(5e-3, 0.05e-3), "sensor_radius": Normal(10e-3, 0.1e-3)}
    nominal = replace(experiment(radii), indenter_radius=4.9e-3, sensor_radius=9.8e-3)
    problem = build_problem(nominal, [replace(sweep, indenter_radius=4.9e-3)], EXACT)
    model = predict_sweep(problem, values_at(problem, true_theta(problem)), problem.sweeps[0])
    for name, channel in model.channels.items():
        np.testing.assert_allclose(channel.mean[0], sweep.channels[name].value, rtol=2e-5, err_msg=name)


def test_log_likelihood_equals_a_dense_gaussian() -> None:
    problem = build_problem(experiment(), [press()], WithError())
    theta = 0.3 * np.random.default_rng(3).standard_normal((5, len(problem.parameters)))
    model = predict_sweep(problem, values_at(problem, theta), problem.sweeps[0])
    assert np.all(model.covered)
    dense = np.zeros(5)
    for c in model.channels.values():
        for k in range(5):
            covariance = np.diag(c.variance[k]) + c.modes[k] @ c.modes[k].T
            dense[k] += multivariate_normal(c.mean[k], covariance).logpdf(c.observed)
    np.testing.assert_allclose(log_likelihood(problem, theta), dense, rtol=1e-9)


def test_covariance_has_noise_the_forwards_error_and_the_discrepancy() -> None:
    sweep = press()
    problem = build_problem(experiment(), [sweep], WithError())
    theta = np.zeros((1, len(problem.parameters)))
    values = values_at(problem, theta)
    c = predict_sweep(problem, values, sweep).channels["force"]
    assert c is not None
    r = WithError().respond(specimen_design(problem, values, "sensor 1"), c.depth)
    assert "force" in sweep.channels
    points = sweep.channels["force"]
    assert points.displacement is not None
    depth = (points.displacement - hertz_onset(points.displacement, points.value - 0.1)).clip(0)
    x = depth / depth.max()
    correlation = np.exp(-0.5 * ((x[:, None] - x) / 0.3) ** 2)
    # What the frame leaves of an error at a given reading of the crosshead: 1 / (1 + c dF/dd).
    share = 1 / (1 + values["machine_compliance"][0] * np.gradient(r.force[0], c.depth[0]))
    g = values["force_discrepancy"][0] * r.force[0] * share
    own = r.force_error[0] * share[:, None]
    expected = np.diag(values["force_noise"][0] ** 2 / sweep.channels["force"].n_effective) + own @ own.T
    expected += correlation * np.outer(g, g)
    found = np.diag(c.variance[0]) + c.modes[0] @ c.modes[0].T
    np.testing.assert_allclose(np.diag(found), np.diag(expected), rtol=0.02)
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(scale, scale), expected / np.outer(scale, scale), atol=0.02)


def test_an_error_of_a_load_does_not_move_what_is_expected_of_it() -> None:
    # The load that was read says how far the frame gave way; what is predicted from the crosshead must not follow it.
    soft = replace(RIG, machine_compliance=2e-5, force_noise=0.0)
    sweep = press(rig=soft)
    points = sweep.channels["force"]
    off = np.where(np.arange(points.value.size) == points.value.size - 5, 0.02, 0.0)
    moved = replace(sweep, channels={**sweep.channels, "force": replace(points, value=points.value + off)})
    means = []
    for one in (sweep, moved):
        problem = build_problem(experiment(), [one], EXACT)
        values = {**values_at(problem, true_theta(problem)), "machine_compliance": np.array([2e-5])}
        means.append(predict_sweep(problem, values, one).channels["force"].mean[0])
    follows = np.max(np.abs(means[1] - means[0])) / 0.02
    assert follows < 0.03  # a quarter without equation (5)


def test_a_smooth_discrepancy_is_not_taken_for_noise() -> None:
    # What the low-rank form leaves to the diagonal must stay below the noise of a quiet lab, at the largest discrepancy.
    problem = build_problem(experiment(), [press()], EXACT)
    for plan in problem.plans:
        for channel in plan.channels.values():
            assert np.max(present(channel.correlation).rest) < 1e-4


def test_discrepancy_off_leaves_its_parameters_and_modes_out() -> None:
    problem = build_problem(experiment(discrepancy="off"), [press()], EXACT)
    assert not {"force_discrepancy", "capacitance_discrepancy"} & set(problem.names)
    model = predict_sweep(problem, values_at(problem, true_theta(problem)), problem.sweeps[0])
    assert all(np.all(c.modes == 0) for c in model.channels.values())


def test_draws_are_independent_of_each_other_in_a_batch() -> None:
    for tie in ("clock", "force"):
        problem = build_problem(experiment(), [press(tie=tie)], EXACT)
        theta = 0.7 * np.random.default_rng(5).standard_normal((40, len(problem.parameters)))
        single = np.concatenate([log_posterior(problem, row[None]) for row in theta])
        np.testing.assert_allclose(log_posterior(problem, theta), single, rtol=1e-9)


def test_law_and_contact_of_the_experiment_reach_the_forward_model() -> None:
    seen: list[Design] = []

    class Stripped(WithError):
        """The closed form whatever the base, law, contact and padding, which it takes down."""

        def _plain(self, design: Design) -> Design:
            seen.append(design)
            plain = {"stiffening": 0.0, "friction_coefficient": 0.0, "padding_poisson_ratio": 0.5}
            return design_from(dict(design.parameters()) | plain)

        def max_depth(self, design: Design) -> FloatArray:
            return EXACT.max_depth(self._plain(design))

        def outside(self, design: Design, depth: FloatArray) -> str:
            return EXACT.outside(self._plain(design), depth)

        def respond(self, design: Design, depth: FloatArray) -> Response:
            return EXACT.respond(self._plain(design), depth)

    plan = replace(experiment({"stiffening": Uniform(0.0, 0.1)}), law="gent", stick=True)
    problem = build_problem(plan, (press(),), Stripped())
    seen.clear()
    theta = np.zeros((3, len(problem.parameters)))
    theta[:, problem.names.index("stiffening")] = [-1.0, 0.0, 1.0]
    log_likelihood(problem, theta)
    assert seen
    for design in seen:
        assert np.all(design.indenter.friction_coefficient == np.inf)
        assert np.all(np.isin(np.round(design.sensor.stiffening, 6), np.round(0.1 * norm.cdf([-1.0, 0.0, 1.0]), 6)))
    assert problem.names[:2] == ("young_modulus", "stiffening")

    foam: Mapping[str, Prior] = {"friction_coefficient": Uniform(0.0, 0.6), "padding_poisson_ratio": Uniform(0.0, 0.4)}
    plan = replace(experiment(foam), base="slippery", padding_material="foam")
    problem = build_problem(plan, (press(),), Stripped())
    seen.clear()
    theta = np.zeros((1, len(problem.parameters)))
    log_likelihood(problem, theta)
    for design in seen:
        assert design.base == "slippery"
        assert np.all(np.isclose(design.indenter.friction_coefficient, 0.3))
        assert np.all(np.isclose(design.padding_poisson_ratio, 0.2))
    assert "padding_young_modulus" in problem.names


def test_log_prior_is_standard_normal_and_values_follow_the_priors() -> None:
    problem = build_problem(experiment(), [press()], EXACT)
    theta = np.vstack([true_theta(problem), true_theta(problem) + 0.01])
    difference = log_posterior(problem, theta) - log_likelihood(problem, theta)
    np.testing.assert_allclose(difference, -0.5 * np.sum(theta**2, axis=1))
    k = problem.names.index("young_modulus")
    np.testing.assert_allclose(columns_at(problem, theta)[0, k], 0.7e6)


def test_the_truth_is_far_likelier_than_a_wrong_clock_or_contact() -> None:
    problem = build_problem(experiment(), [press()], EXACT)
    theta = true_theta(problem)
    values = log_likelihood(problem, theta)[0]
    for name, step in (("clock_offset[sensor 1]", 4.0), ("contact_offset[sensor 1]", 0.1), ("load_zero[sensor 1]", 0.1)):
        wrong = theta.copy()
        wrong[0, problem.names.index(name)] += step
        assert log_likelihood(problem, wrong)[0] < values - 10


def shipped(which: int, name: str, off: FloatArray) -> FloatArray:
    """Log likelihood of a specimen of the shipped data at its truth, but for what is off in one of its unknowns."""
    folder = Path(__file__).parents[3] / "datasets" / "padded_sensor"
    plan, truth = read_experiment(folder / "experiment.toml"), json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    specimen = plan.specimens[which]
    files = specimen.sweeps[0]
    sweep = make_sweep(specimen.name, files.name, files.indenter_radius, files.force, files.capacitance)
    problem = build_problem(plan, (sweep,), load_surrogate())
    own = {**truth["shared"], **truth[specimen.name], "force_discrepancy": 1e-4, "capacitance_discrepancy": 1e-4}
    values = {p.name: np.full(off.size, own[p.parameter]) for p in problem.parameters}
    values |= {key: np.full(off.size, value) for key, value in problem.fixed.items()}
    values[f"{name}[{specimen.name}]"] += off
    return log_likelihood_at(problem, problem.forward, problem.plans, values)


@pytest.mark.parametrize("which", [0, 1])
def test_the_likelihood_is_as_smooth_in_the_clock_offset_as_the_crosshead_moves(which: int) -> None:
    # At constant speed it is a parabola; the noise of the crosshead's record, taken for motion, bends it from -9 to 2.
    bend = np.diff(shipped(which, "clock_offset", np.linspace(-0.3, 0.3, 25)), 2)
    assert np.max(np.abs(bend / np.mean(bend) - 1)) < 0.35


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize(("name", "size"), [("contact_offset", 1e-6), ("load_zero", 3e-3), ("clock_offset", 0.3)])
def test_the_truth_of_the_shipped_data_is_that_of_its_measurement_model(which: int, name: str, size: float) -> None:
    off = np.linspace(-size, size, 9)
    curve = np.polyfit(off, shipped(which, name, off), 2)
    sd = 1 / np.sqrt(-2 * curve[0])
    assert -curve[1] / (2 * curve[0]) == pytest.approx(0.0, abs=3 * sd)


@pytest.mark.parametrize(
    ("name", "value"),
    [("dielectric_thickness[sensor 1]", 0.40e-3), ("electrode_radius", 11e-3), ("contact_offset[sensor 1]", -0.49e-3)],
)
def test_an_invalid_design_or_a_depth_beyond_the_range_has_no_density(name: str, value: float) -> None:
    wide = {"electrode_radius": Normal(9e-3, 1e-3)}
    problem = build_problem(experiment(wide), [press(depth=0.7e-3)], EXACT)
    theta = np.vstack([np.zeros(len(problem.parameters))] * 2)
    column = problem.names.index(name)
    theta[1, column] = problem.parameters[column].prior.to_normal(value)
    found = log_likelihood(problem, theta)
    assert np.isfinite(found[0])
    assert found[1] == -np.inf
    assert np.all(log_likelihood_blocks(problem, theta)[1] == -np.inf)
    assert range_use(problem, theta)[0] < 1 < range_use(problem, theta)[1]


def test_a_force_beyond_the_curve_has_no_density() -> None:
    problem = build_problem(experiment(), [press(tie="force", with_force=False)], EXACT)
    theta = np.zeros((2, len(problem.parameters)))
    theta[1, problem.names.index("young_modulus")] = -5.0
    assert np.isfinite(log_likelihood(problem, theta)[0])
    assert log_likelihood(problem, theta)[1] == -np.inf


def test_noise_whose_square_is_no_number_any_more_has_no_density() -> None:
    problem = build_problem(experiment(), [press()], EXACT)
    theta = np.zeros((3, len(problem.parameters)))
    theta[:, problem.names.index("force_noise")] = 0.0, -700.0, -1e5
    assert np.isfinite(log_likelihood(problem, theta)[0])
    assert np.all(log_likelihood(problem, theta)[1:] == -np.inf)


def test_blocks_add_up_to_the_likelihood_without_correlation() -> None:
    problem = build_problem(experiment(discrepancy="off"), [press()], EXACT)
    theta = 0.3 * np.random.default_rng(3).standard_normal((4, len(problem.parameters)))
    blocks = log_likelihood_blocks(problem, theta)
    assert blocks.shape == (4, len(block_names(problem))) == (4, 10)
    np.testing.assert_allclose(blocks.sum(axis=1), log_likelihood(problem, theta), rtol=1e-10)


def test_without_a_block_the_likelihood_is_that_of_all_other_points() -> None:
    problem = build_problem(experiment(), [press()], WithError())
    theta = 0.3 * np.random.default_rng(3).standard_normal((4, len(problem.parameters)))
    blocks = log_likelihood_blocks(problem, theta)
    for k in range(blocks.shape[1]):
        rest = log_likelihood(without_block(problem, k), theta)
        np.testing.assert_allclose(rest + blocks[:, k], log_likelihood(problem, theta), rtol=1e-9)
    with pytest.raises(IndexError):
        without_block(problem, blocks.shape[1])


def test_a_block_is_conditional_on_all_other_points_of_its_channel() -> None:
    problem = build_problem(experiment(), [press()], WithError())
    theta = 0.3 * np.random.default_rng(4).standard_normal((1, len(problem.parameters)))
    c = predict_sweep(problem, values_at(problem, theta), problem.sweeps[0]).channels["force"]
    assert c is not None
    covariance = np.diag(c.variance[0]) + c.modes[0] @ c.modes[0].T
    rest = np.r_[0:8, 16:40]
    whole = multivariate_normal(c.mean[0], covariance).logpdf(c.observed)
    others = multivariate_normal(c.mean[0, rest], covariance[np.ix_(rest, rest)]).logpdf(c.observed[rest])
    np.testing.assert_allclose(log_likelihood_blocks(problem, theta)[0, 1], whole - others, rtol=1e-8)


def test_the_level_of_a_block_is_held_against_all_other_points_of_its_channel() -> None:
    problem = build_problem(experiment(), [press()], WithError())
    theta = 0.3 * np.random.default_rng(4).standard_normal((1, len(problem.parameters)))
    c = predict_sweep(problem, values_at(problem, theta), problem.sweeps[0]).channels["force"]
    assert c is not None
    covariance = np.diag(c.variance[0]) + c.modes[0] @ c.modes[0].T
    own, rest = np.arange(8, 16), np.r_[0:8, 16:40]
    across = covariance[np.ix_(own, rest)] @ np.linalg.inv(covariance[np.ix_(rest, rest)])
    residual = c.observed - c.mean[0]
    off = np.sum(residual[own] - across @ residual[rest])
    variance = np.sum(covariance[np.ix_(own, own)] - across @ covariance[np.ix_(rest, own)])
    np.testing.assert_allclose(levels_of_blocks(problem, theta)[0, 1], off / np.sqrt(variance), rtol=1e-6)


def test_a_point_is_conditional_on_all_other_points_of_its_channel() -> None:
    problem = build_problem(experiment(), [press()], WithError())
    theta = 0.3 * np.random.default_rng(4).standard_normal((2, len(problem.parameters)))
    for c in predict_sweep(problem, values_at(problem, theta), problem.sweeps[0]).channels.values():
        found = log_likelihood_points(c)
        mean, variance = given_other_points(c)
        assert found.shape == (2, c.observed.size)
        for k in range(2):
            covariance = np.diag(c.variance[k]) + c.modes[k] @ c.modes[k].T
            for i in (0, 17, 39):
                rest = np.delete(np.arange(40), i)
                gain = np.linalg.solve(covariance[np.ix_(rest, rest)], covariance[rest, i])
                expected = c.mean[k, i] + gain @ (c.observed - c.mean[k])[rest]
                left = covariance[i, i] - gain @ covariance[rest, i]
                assert mean[k, i] - expected == pytest.approx(0.0, abs=1e-6 * np.sqrt(left))
                assert variance[k, i] == pytest.approx(left, rel=1e-6)
                assert found[k, i] == pytest.approx(norm(expected, np.sqrt(left)).logpdf(c.observed[i]), rel=1e-6)


def test_points_add_up_to_the_likelihood_without_correlation() -> None:
    problem = build_problem(experiment(discrepancy="off"), [press()], EXACT)
    theta = 0.3 * np.random.default_rng(3).standard_normal((4, len(problem.parameters)))
    model = predict_sweep(problem, values_at(problem, theta), problem.sweeps[0])
    total = np.sum([log_likelihood_points(c).sum(axis=1) for c in model.channels.values()], axis=0)
    np.testing.assert_allclose(total, log_likelihood(problem, theta), rtol=1e-10)


def test_a_record_far_from_zero_centres_the_default_contact_offset_on_its_onset() -> None:
    far = replace(RIG, contact_offset=74.3e-3, load_zero=-3.2)
    problem = build_problem(experiment(), [press(rig=far)], EXACT)
    by_name = {p.parameter: p for p in problem.parameters}
    contact, load = by_name["contact_offset"], by_name["load_zero"]
    assert contact.prior.interval(0.99)[0] < 74.3e-3 < contact.prior.interval(0.99)[1]
    assert "onset" in contact.origin
    assert load.prior.interval(0.5)[0] < -3.2 < load.prior.interval(0.5)[1]
    assert "load before contact" in load.origin
    assert not contact.from_data  # the centre is, how far it may be off is believed
    assert not load.from_data
    near = {p.parameter: p for p in build_problem(experiment(), [press()], EXACT).parameters}
    assert near["contact_offset"].prior == default_prior("contact_offset")
    assert near["contact_offset"].origin == "default"


def test_noise_priors_are_centred_on_the_scatter_of_the_readings() -> None:
    by_name = {p.parameter: p for p in build_problem(experiment(), [press()], EXACT).parameters}
    low, high = by_name["force_noise"].prior.interval(0.6827)
    assert (low, high) == pytest.approx((RIG.force_noise / 2, RIG.force_noise * 2), rel=1e-3)
    given = experiment({"force_noise": LogNormal(1e-3, 1.5)})
    by_name = {p.parameter: p for p in build_problem(given, [press()], EXACT).parameters}
    assert by_name["force_noise"].prior == LogNormal(1e-3, 1.5)


def test_a_thickness_outside_the_models_range_is_refused_with_the_bound() -> None:
    with pytest.raises(InputError, match=r"at the prior medians: the closed form covers depths up to"):
        build_problem(experiment(own={"padding_thickness": Normal(0.1e-3, 0.01e-3)}), [press()], EXACT)
    with pytest.raises(InputError, match=r"dielectric_thickness .* must not exceed half"):
        build_problem(experiment(own={"dielectric_thickness": Normal(0.5e-3, 0.01e-3)}), [press()], EXACT)


def test_a_prior_mostly_outside_the_models_range_is_refused() -> None:
    vague = experiment({"electrode_radius": Normal(9.9e-3, 0.2e-3)}, {"contact_offset": Uniform(-2e-3, 2e-3)})
    with pytest.raises(InputError, match=r"covers for \d+ % of the prior's draws"):
        build_problem(vague, [press(depth=1.0e-3)], EXACT)


def test_capacitance_that_nothing_ties_to_depth_is_refused() -> None:
    with pytest.raises(InputError, match="nothing tells how deep"):
        build_problem(experiment(), [replace(press(), track=None)], EXACT)


def test_model_error_beyond_what_arithmetic_holds_is_impossible_rather_than_a_failure() -> None:
    # A search may come by a modulus of 1e20 Pa: modes of error 1e9 times the noise, alike to the last digit.
    rng = np.random.default_rng(0)
    n = 12
    usual = 0.1 * rng.standard_normal((n, 3))
    absurd = 1e9 * np.outer(np.linspace(1, 2, n), [1.0, 1.1, 0.9])
    rows = np.zeros((3, n))
    channel = PredictedReadings(rows, rows, rows + 1.0, np.stack([usual, absurd, usual]), rng.standard_normal(n))
    found = log_normal(channel)
    assert found[1] == -np.inf
    points = log_likelihood_points(channel)
    assert np.all(np.isfinite(points[[0, 2]]))
    assert not np.any(np.isnan(points))
    covariance = np.eye(n) + usual @ usual.T
    expected = multivariate_normal(np.zeros(n), covariance).logpdf(channel.observed)
    np.testing.assert_allclose(found[[0, 2]], expected, rtol=1e-12)


# --- presses that repeat each other -------------------------------------------------------------------------------------

AGAIN = ("first", "again", "later")


def _repeated(ties: tuple[Tie, ...] = ("clock", "clock", "clock")) -> tuple[Problem, FloatArray]:
    """Presses of one specimen with one ball to different depths, contact elsewhere in each, and draws near the truth."""
    rigs = [replace(RIG, contact_offset=(0.05 + 0.03 * k) * 1e-3) for k in range(len(ties))]
    presses = [
        press(k, tie, name, rig, depth=(0.5 + 0.05 * k) * 1e-3)
        for k, (tie, name, rig) in enumerate(zip(ties, AGAIN, rigs, strict=False))
    ]
    problem = build_problem(experiment(sweeps=AGAIN[: len(ties)]), presses, WithError())
    truth = true_theta(problem)
    for k, parameter in enumerate(problem.parameters):
        if parameter.parameter == "contact_offset":
            truth[0, k] = float(parameter.prior.to_normal(rigs[AGAIN.index(parameter.sweep)].contact_offset))
        if parameter.parameter.endswith("_discrepancy"):
            truth[0, k] = 0.0
    small = np.array(
        [1e-3 if p.parameter in ("contact_offset", "load_zero", "clock_offset") else 0.05 for p in problem.parameters]
    )
    return problem, truth + small * np.random.default_rng(3).standard_normal((4, truth.shape[1]))


def _dense(problem: Problem, theta: FloatArray, channel: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean, covariance and readings of a channel in all sweeps, with the kernel between all depths, nothing of low rank."""
    models = list(model_sweeps(problem, problem.forward, problem.plans, values_at(problem, theta)))
    parts = [model.channels[channel] for model in models]
    depth, mean = np.concatenate([c.depth for c in parts], axis=1), np.concatenate([c.mean for c in parts], axis=1)
    sd = np.concatenate([c.discrepancy.sd for c in parts if c.discrepancy is not None], axis=1)
    plan, compliance = problem.plans[0].channels[channel], values_at(problem, theta)["machine_compliance"][:, None]
    x = np.maximum(depth, 0.0) / (plan.deepest - compliance * plan.deepest_load)
    alike = np.exp(-0.5 * ((x[:, :, None] - x[:, None, :]) / 0.3) ** 2)
    error = np.concatenate([c.error for c in parts], axis=1)
    covariance = sd[:, :, None] * alike * sd[:, None, :] + error @ np.swapaxes(error, 1, 2)
    noise = np.concatenate(
        [c.variance - c.discrepancy.sd**2 * c.discrepancy.correlation.rest for c in parts if c.discrepancy is not None], axis=1
    )
    points = np.arange(mean.shape[1])
    covariance[:, points, points] += noise
    return mean, covariance, np.concatenate([c.observed for c in parts])


@pytest.mark.parametrize("ties", [("clock", "clock", "clock"), ("force", "clock"), ("displacement", "clock")])
def test_presses_of_a_specimen_with_one_ball_are_one_dense_gaussian(ties: tuple[Tie, ...]) -> None:
    problem, theta = _repeated(ties)
    expected = np.zeros(len(theta))
    for channel in ("force", "capacitance"):
        means, covariances, observed = _dense(problem, theta, channel)
        expected += [multivariate_normal(m, c).logpdf(observed) for m, c in zip(means, covariances, strict=True)]
    np.testing.assert_allclose(log_likelihood(problem, theta), expected, rtol=2e-4)


def test_misfit_that_presses_share_ties_their_readings_and_another_ball_has_one_of_its_own() -> None:
    problem, theta = _repeated()
    parts = [log_likelihood_at(problem, problem.forward, [plan], values_at(problem, theta)) for plan in problem.plans]
    assert np.all(np.abs(log_likelihood(problem, theta) - np.sum(parts, axis=0)) > 1.0)
    apart = [replace(s, indenter_radius=5e-3 + k * 1e-6) for k, s in enumerate(problem.sweeps)]
    other = build_problem(problem.experiment, apart, problem.forward)
    values = values_at(other, theta)
    alone = [log_likelihood_at(other, other.forward, [plan_sweep(s)], values) for s in apart]
    np.testing.assert_array_equal(log_likelihood(other, theta), np.sum(alone, axis=0))


def test_the_order_of_presses_does_not_matter() -> None:
    problem, theta = _repeated()
    turned = replace(problem, sweeps=problem.sweeps[::-1], plans=plan_sweeps(problem.sweeps[::-1]))
    np.testing.assert_allclose(log_likelihood(turned, theta), log_likelihood(problem, theta), rtol=1e-10)


def test_blocks_of_presses_are_given_the_others_and_what_is_left_without_them_is_the_rest() -> None:
    problem, theta = _repeated()
    blocks, whole = log_likelihood_blocks(problem, theta), log_likelihood(problem, theta)
    assert blocks.shape[1] == len(block_names(problem))
    assert levels_of_blocks(problem, theta).shape == blocks.shape
    for number in (0, 7, 13, blocks.shape[1] - 1):
        rest = log_likelihood(without_block(problem, number), theta)
        np.testing.assert_allclose(blocks[:, number], whole - rest, atol=1e-6)


def test_points_of_presses_are_given_all_others() -> None:
    problem, theta = _repeated()
    models = list(model_sweeps(problem, problem.forward, problem.plans, values_at(problem, theta)))
    for some in put_together(problem.plans, models):
        c = some.readings
        mean, variance = given_other_points(c)
        covariance = np.diag(c.variance[0]) + c.modes[0] @ c.modes[0].T
        precision = np.linalg.inv(covariance)
        np.testing.assert_allclose(variance[0], 1 / np.diag(precision), rtol=1e-5)
        off = precision @ (c.observed - c.mean[0]) / np.diag(precision)
        np.testing.assert_allclose(c.observed - mean[0], off, atol=1e-6 * np.max(np.abs(off)))


def test_residuals_of_presses_that_share_their_misfit_have_its_chi_square_and_the_order_of_the_readings() -> None:
    problem, theta = _repeated()
    found = residuals(
        problem, {name: float(v) for name, v in zip(problem.names, columns_at(problem, theta[:1])[0], strict=True)}
    )
    expected = 0.0
    for channel in ("force", "capacitance"):
        means, covariances, observed = _dense(problem, theta[:1], channel)
        expected += (observed - means[0]) @ np.linalg.solve(covariances[0], observed - means[0])
    assert np.sum(found**2) == pytest.approx(expected, rel=1e-3)
    assert found.size == sum(c.value.size for s in problem.sweeps for c in s.channels.values())


def test_a_draw_that_one_press_does_not_cover_is_not_covered_and_leaves_the_others_alone() -> None:
    problem, theta = _repeated()
    far = theta.copy()
    far[1, problem.names.index("contact_offset[sensor 1, again]")] = -6.0  # deeper than the closed form goes
    found, before = log_likelihood(problem, far), log_likelihood(problem, theta)
    assert found[1] == -np.inf or found[1] < before[1] - 1e3
    np.testing.assert_array_equal(found[[0, 2, 3]], before[[0, 2, 3]])


def test_presses_that_were_not_planned_together_are_refused() -> None:
    problem, theta = _repeated()
    apart = replace(problem, plans=tuple(plan_sweep(sweep) for sweep in problem.sweeps))
    with pytest.raises(ValueError, match="later repeats another press and was not planned with it"):
        log_likelihood(apart, theta)


def test_errors_from_depth_to_depth_of_a_model_are_not_shared_by_presses_of_as_many_points_or_others() -> None:
    problem, theta = _repeated()
    values = values_at(problem, theta)
    found = []
    for share in (1e-9, 1e-3):
        model = Toleranced(EXACT, share)
        models = list(model_sweeps(problem, model, problem.plans, values))
        (force,) = (some.readings for some in put_together(problem.plans, models) if some.repeats.channel == "force")
        found.append(force)
    added = found[1].variance - found[0].variance
    np.testing.assert_allclose(np.sqrt(added[found[1].depth > 5e-5]), 1e-3 * _ideal(found[1]), rtol=0.1)
    assert found[1].error.shape[-1] == EXACT.respond(design_from(dict(TRUTH)), np.array([1e-4])).force_error.shape[-1]


def _ideal(channel: PredictedReadings) -> FloatArray:
    """Force of the sensor [N] at the points that are well in contact, but for the load zero."""
    return np.asarray((channel.mean - np.min(channel.mean, axis=1, keepdims=True))[channel.depth > 5e-5], dtype=float)
