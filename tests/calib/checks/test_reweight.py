"""Draws of a posterior re-weighted to another forward model: weights, shifts, what is said of them, and what is kept."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from calib.checks.departures import Elsewhere
from calib.checks.reasons import judge_posterior
from calib.checks.reweighting import log_ratio, problem_of, reweight, shift_of, with_reweighting
from calib.checks.verdict import Verdict
from calib.cli import app
from calib.problem.likelihood import log_likelihood_at
from calib.problem.measurement import model_sweep
from calib.report.sections.convergence import criteria
from calib.report.summary import summary_json
from calib.runs.calibration import Stages
from calib.sampling.archive import smooth_weights
from calib.sampling.diagnostics import diagnostics_from_json, diagnostics_to_json
from calib.sampling.findings import Reweighting, Shift
from calib.sampling.posterior import Posterior, thin_draws
from calib.sampling.storage import load_posterior, save_posterior
from models.analytic import ClosedForm
from models.fem import ConvergenceError, FiniteElements
from models.layers import LayeredDesign
from models.response import Forward, Response
from models.sensor import Design, FloatArray
from models.surrogate.surrogate import load_surrogate
from models.surrogate.validation import Toleranced

MakePosterior = Callable[..., Posterior]
FAST = ClosedForm(force_error=0.01, capacitance_error=0.01)


@dataclass(frozen=True)
class Stiffened:
    """A model with its force off by a factor, which gets stuck below a modulus."""

    factor: float = 1.0
    inner: Forward = FAST
    name: str = "finite elements"
    stuck_below: float = 0.0

    @property
    def identity(self) -> str:
        return f"{self.inner.identity} times {self.factor!r}"

    def max_depth(self, design: Design) -> FloatArray:
        return self.inner.max_depth(design)

    def outside(self, design: Design, depth: FloatArray) -> str:
        return self.inner.outside(design, depth)

    def respond(self, design: Design, depth: FloatArray) -> Response:
        if np.any(np.asarray(design.sensor.young_modulus) < self.stuck_below):
            raise ConvergenceError(1e-4, "contact keeps cycling", None)
        found = self.inner.respond(design, depth)
        return replace(found, force=self.factor * found.force)


@pytest.fixture
def here() -> Iterator[Executor]:
    with ThreadPoolExecutor(1) as executor:
        yield executor


# --- weights ------------------------------------------------------------------------------------------------------------


def test_weights_from_one_normal_to_another_give_its_mean_and_sd() -> None:
    # N(0, 1) re-weighted to N(0.3, 0.9): log ratio and moments are known.
    rng = np.random.default_rng(3)
    x = rng.standard_normal(4000)
    weights, k_hat = smooth_weights(-0.5 * ((x - 0.3) / 0.9) ** 2 + 0.5 * x**2)
    found = shift_of(x, weights, 1.0)
    assert np.sum(weights) == pytest.approx(1.0)
    assert k_hat < 0.5
    assert found.weighted_mean == pytest.approx(0.3, abs=0.04)
    assert found.weighted_sd == pytest.approx(0.9, abs=0.04)
    assert found.shift == pytest.approx(0.3, abs=4 * found.error)


def test_stated_error_of_a_shift_is_its_scatter_over_repetitions() -> None:
    rng = np.random.default_rng(4)
    found = []
    for _ in range(400):
        x = rng.standard_normal(150)
        found.append(shift_of(x, smooth_weights(0.2 * x)[0], 1.0))
    scatter = np.std([f.shift for f in found])
    assert np.mean([f.error for f in found]) == pytest.approx(scatter, rel=0.15)
    # Exponential tilting by 0.2 x moves the mean of N(0, 1) by 0.2.
    assert np.mean([f.shift for f in found]) == pytest.approx(0.2, abs=0.01)


def test_draws_that_depend_on_each_other_tell_a_shift_less_well() -> None:
    x = np.random.default_rng(5).standard_normal(100)
    weights, _ = smooth_weights(0.1 * x)
    assert shift_of(x, weights, 1.0, 0.25).error == pytest.approx(2 * shift_of(x, weights, 1.0).error)


def test_weights_far_from_the_draws_have_a_large_k_hat() -> None:
    x = np.random.default_rng(6).standard_normal(200)
    _, k_hat = smooth_weights(5 * x)
    assert k_hat > 0.7


def test_ratios_that_are_alike_give_equal_weights_and_impossible_draws_none() -> None:
    ratio = np.zeros(40)
    weights, k_hat = smooth_weights(ratio)
    np.testing.assert_allclose(weights, 1 / 40)
    assert k_hat == 0
    ratio[:4] = -np.inf
    np.testing.assert_allclose(smooth_weights(ratio)[0], np.repeat([0, 1 / 36], [4, 36]))
    weights, k_hat = smooth_weights(ratio + 0.1 * np.random.default_rng(7).standard_normal(40))
    np.testing.assert_array_equal(weights[:4], 0)
    assert np.sum(weights) == pytest.approx(1.0)
    assert np.isfinite(k_hat)
    weights, k_hat = smooth_weights(np.full(40, -np.inf))
    assert np.all(np.isnan(weights))
    assert k_hat == np.inf


def test_the_limit_of_k_hat_depends_on_the_number_of_draws() -> None:
    for n, limit in ((100, 0.5), (1000, 2 / 3), (100_000, 0.7)):
        assert Reweighting(n, 0.0, n, {}, ()).k_limit == pytest.approx(limit)


# --- draws of a posterior -----------------------------------------------------------------------------------------------


def test_the_same_model_leaves_the_posterior_as_it_is_whatever_ties_the_capacitance(
    make_posterior: MakePosterior, here: Executor
) -> None:
    # Sensor 1 is tied by force, sensor 2 by the clock.
    posterior = with_reweighting(make_posterior(), FAST, 60, here, exact=Stiffened())
    found = posterior.diagnostics.reweighting
    assert found is not None
    assert found.k_hat == 0
    assert found.ess == pytest.approx(60)
    assert found.passed
    assert max(abs(s.shift) for s in found.shifts.values()) < 1e-9
    assert posterior.diagnostics.warnings == ()
    assert "no mean shifts by more than 0.1" in found.in_words()


def test_a_stiffer_truth_makes_the_modulus_smaller(make_posterior: MakePosterior, here: Executor) -> None:
    p = make_posterior()
    values = thin_draws(p, 400, np.random.default_rng(1))
    softer, stiffer = (reweight(p, FAST, Stiffened(f), values, here).shifts["young_modulus"] for f in (0.999, 1.001))
    assert softer.shift - 2 * softer.error > 0
    assert stiffer.shift + 2 * stiffer.error < 0
    assert stiffer.weighted_mean < stiffer.mean


def test_weights_are_the_ratio_of_likelihoods(make_posterior: MakePosterior, here: Executor) -> None:
    p = make_posterior(n_specimen=1)
    problem, exact = problem_of(p, FAST), Stiffened(1.002)
    values = thin_draws(p, 3, np.random.default_rng(2))
    wanted = log_likelihood_at(p, exact, problem.plans, values) - log_likelihood_at(p, FAST, problem.plans, values)
    for i in range(3):
        ratio, reason = log_ratio(problem, exact, {k: v[i : i + 1] for k, v in values.items()})
        assert ratio == pytest.approx(wanted[i], abs=1e-9)
        assert reason == ""


def test_a_model_that_is_far_off_is_told_by_k_hat(make_posterior: MakePosterior, here: Executor) -> None:
    posterior = with_reweighting(make_posterior(), FAST, 60, here, exact=Stiffened(1.1))
    d = posterior.diagnostics
    assert d.reweighting is not None
    assert not d.reweighting.trusted
    (reason,) = judge_posterior(posterior).reasons
    assert (reason.gate, reason.level) == ("finite elements", "amber")
    assert "the weights cannot be trusted (k-hat above 0.44)" in reason.finding
    assert "`calib surrogate refine`" in reason.action
    assert 'model = "fem"' in reason.action
    assert d.converged
    (row,) = [c for c in criteria(posterior) if "posterior against finite elements" in c.name]
    assert row.advice
    assert not row.met


def test_a_shift_is_told_with_its_error_only_where_it_matters() -> None:
    far, near = Shift(1.0, 0.1, 1.03, 0.1, 0.3, 0.05), Shift(1.0, 0.1, 1.015, 0.1, 0.15, 0.05)
    found = Reweighting(100, 0.2, 80.0, {"young_modulus": far, "load_zero": near}, ())
    assert found.trusted
    assert found.shifted == ("young_modulus",)
    assert not found.passed
    assert "by more than 0.1 posterior standard deviations: young_modulus by +0.30 ± 0.05" in found.in_words()
    within = replace(found, shifts={"load_zero": near})
    assert within.passed
    assert "(the largest, load_zero by +0.15 ± 0.05; more draws would tell it better)" in within.in_words()


def test_draws_without_equilibrium_have_no_weight_and_are_counted(make_posterior: MakePosterior, here: Executor) -> None:
    p = make_posterior()
    values = thin_draws(p, 60, np.random.default_rng(p.seed))
    stuck = Stiffened(stuck_below=float(np.quantile(values["young_modulus"], 0.1)))
    found = reweight(p, FAST, stuck, values, here)
    assert len(found.failures) == 6
    assert "contact keeps cycling" in found.failures[0]
    assert found.ess == pytest.approx(54)
    assert found.shifts["young_modulus"].shift > 0.05
    assert "6 of them without weight" in found.in_words()
    none = reweight(p, FAST, Stiffened(stuck_below=1e9), values, here)
    assert not none.trusted
    assert none.ess == 0
    summary = summary_json(replace(p, diagnostics=replace(p.diagnostics, reweighting=none)), Verdict())
    assert json.loads(summary)["reweighting"]["k_hat"] is None


def test_too_few_draws_and_a_model_of_another_posterior_are_refused(make_posterior: MakePosterior, here: Executor) -> None:
    p = make_posterior()
    with pytest.raises(ValueError, match="24 draws are too few to re-weight; give at least 25"):
        with_reweighting(p, FAST, 24, here, exact=Stiffened())
    deep = {k: v - 2e-3 * k.startswith("contact_offset") for k, v in thin_draws(p, 25, np.random.default_rng(1)).items()}
    with pytest.raises(ValueError, match="does not cover a draw of its own posterior"):
        reweight(p, FAST, Stiffened(), deep, here)


def test_a_posterior_of_the_finite_elements_is_left_alone(make_posterior: MakePosterior, here: Executor) -> None:
    p = make_posterior()
    assert with_reweighting(p, FiniteElements(), 100, here) is p


def test_a_reweighting_is_kept_with_the_posterior(make_posterior: MakePosterior, here: Executor, tmp_path: Path) -> None:
    p = with_reweighting(make_posterior(), FAST, 30, here, exact=Stiffened(1.001))
    assert diagnostics_from_json(diagnostics_to_json(p.diagnostics)).reweighting == p.diagnostics.reweighting
    save_posterior(p, tmp_path / "posterior.nc")
    assert load_posterior(tmp_path / "posterior.nc").diagnostics.reweighting == p.diagnostics.reweighting
    told = json.loads(summary_json(p, Verdict()))["reweighting"]
    assert told["n_draw"] == 30
    assert set(told["shifts"]["young_modulus"]) == {"mean", "sd", "weighted_mean", "weighted_sd", "shift", "error"}


# --- finite elements ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", [0, 1], ids=["by force", "by clock"])
def test_finite_elements_answer_for_either_tie_of_the_capacitance(make_posterior: MakePosterior, which: int) -> None:
    # A surrogate that is the finite elements to within its error has the same likelihood to within what that makes of it.
    p = make_posterior()
    fast, exact = load_surrogate(), FiniteElements(1e-2)
    problem = replace(problem_of(p, fast), plans=problem_of(p, fast).plans[which : which + 1])
    values = thin_draws(p, 1, np.random.default_rng(1))
    ratio, reason = log_ratio(problem, Toleranced(exact, 0.01), values)
    assert np.isfinite(ratio)
    assert reason == ""


def test_a_table_for_the_finite_elements_ends_soon_after_the_readings(make_posterior: MakePosterior) -> None:
    p = make_posterior(n_specimen=1)
    fast, asked = load_surrogate(), []
    deepest = model_sweep(p, fast, problem_of(p, fast).plans[0], thin_draws(p, 1, np.random.default_rng(1))).deepest[0]

    class Watched(FiniteElements):
        def respond(self, design: Design | LayeredDesign, depth: FloatArray) -> Response:
            asked.append(depth)
            return super().respond(design, depth)

    log_ratio(problem_of(p, fast), Watched(2e-2), thin_draws(p, 1, np.random.default_rng(1)))
    (depth,) = asked
    assert deepest < np.max(depth) < 1.4 * deepest
    assert depth.size < 40 + 64


def test_numerical_error_is_independent_and_in_proportion(make_posterior: MakePosterior) -> None:
    p = make_posterior(n_specimen=1)
    plan, values = problem_of(p, FAST).plans[0], thin_draws(p, 2, np.random.default_rng(1))
    values = {**values, "machine_compliance": np.zeros(2)}
    bare = ClosedForm(force_error=0.0, capacitance_error=0.0)
    without, with_error = (model_sweep(p, m, plan, values).channels["force"] for m in (bare, Toleranced(bare, 0.01)))
    added = with_error.sd**2 - without.sd**2
    np.testing.assert_allclose(added, (0.01 * (with_error.mean - values["load_zero[sensor 1]"][:, None])) ** 2, atol=1e-12)


# --- command line -------------------------------------------------------------------------------------------------------

LAB = """
name = "One specimen"
model = "MODEL"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[[specimens]]
name = "sensor 1"
force = "force.csv"
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
"""


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    depth = np.linspace(0, 0.5, 60)
    rows = "\n".join(f"{d:.5f},{6 * d**1.5 + 0.001 * (-1) ** i:.5f}" for i, d in enumerate(depth))
    (tmp_path / "force.csv").write_text(f"Displacement (mm),Force (N)\n{rows}\n", encoding="utf-8")
    for model in ("closed form", "fem"):
        (tmp_path / f"{model}.toml").write_text(LAB.replace("MODEL", model), encoding="utf-8")
    return tmp_path


def _calibrate(lab: Path, model: str, n: int, stages: Stages | None = None) -> tuple[int, str, str]:
    words = ["calibrate", lab / f"{model}.toml", "-o", lab / "run", "--reweight", n, "--processes", 0, "--anyway"]
    result = CliRunner().invoke(app, [str(w) for w in words], obj=stages)
    return result.exit_code, " ".join(result.stdout.split()), " ".join(result.stderr.split())


def _stages(make_posterior: MakePosterior, reweight: Callable[..., Posterior]) -> Stages:
    """A posterior made by hand, of which nothing else is asked."""
    made = make_posterior(n_specimen=1)
    return Stages(
        lambda *_, **__: made,
        lambda posterior, _: posterior,
        reweight,
        look_elsewhere=lambda *_: Elsewhere(),
        foretell_blocks=lambda posterior, *_: posterior,
    )


@pytest.mark.usefixtures("undrawn")
def test_calibrate_reweights_if_asked_and_says_so(lab: Path, make_posterior: MakePosterior) -> None:
    exact = Stiffened(inner=ClosedForm())
    code, said, told = _calibrate(lab, "closed form", 30, _stages(make_posterior, partial(with_reweighting, exact=exact)))
    assert code == 0, told
    assert "Re-weighting: re-weighted to the finite elements at 30 draws" in said
    summary = json.loads((lab / "run" / "summary.json").read_text(encoding="utf-8"))
    assert summary["reweighting"]["n_draw"] == 30
    assert "closed form posterior against finite elements" in (lab / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("undrawn")
def test_stopping_the_reweighting_leaves_the_rest_written(lab: Path, make_posterior: MakePosterior) -> None:
    def stopped(*_: object, **__: object) -> Posterior:
        raise KeyboardInterrupt

    code, _, told = _calibrate(lab, "closed form", 30, _stages(make_posterior, stopped))
    assert code == 130
    assert "--resume --processes 0 --reweight 30" in told
    assert json.loads((lab / "run" / "summary.json").read_text(encoding="utf-8"))["reweighting"] is None


@pytest.mark.parametrize(
    ("model", "n", "message"),
    [("fem", 100, "there is nothing to re-weight"), ("closed form", 10, "--reweight 10 are too few draws to judge")],
)
def test_a_reweighting_that_cannot_be_is_refused_before_any_work(lab: Path, model: str, n: int, message: str) -> None:
    code, _, told = _calibrate(lab, model, n)
    assert code == 2
    assert message in told
    assert not (lab / "run").exists()
