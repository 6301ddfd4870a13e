"""Finite elements at draws of a posterior: runs kept, errors told, a verdict with its exit code, refusals before any work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from calib.checks.refine import error_rows, require_own_surrogate, training_points
from calib.checks.reweighting import problem_of
from calib.checks.spotcheck import Comparison, compare_draws
from calib.cli import app
from calib.errors import InputError
from calib.problem import model_sweep, plan_sweep
from calib.problem.likelihood import log_posterior
from calib.runs.refinement import Means
from calib.sampling.findings import SpotCheck
from calib.sampling.posterior import Posterior, thin_draws
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm
from models.fem import FiniteElements
from models.layers import LayeredDesign
from models.response import Response
from models.sensor import Design, FloatArray
from models.surrogate.fitting import LEAST_PATHS
from models.surrogate.store import open_store
from models.surrogate.surrogate import Surrogate, load_surrogate
from models.surrogate.training import TrainingSet, run_point, store_settings

MakePosterior = Callable[..., Posterior]
ACCURACY = 5e-2
FAST = load_surrogate()


def _of_surrogate(posterior: Posterior) -> Posterior:
    """The posterior as if the surrogate were its model: readings and densities of the draws are those of the surrogate."""
    p = replace(posterior, forward_name="surrogate", experiment=replace(posterior.experiment, model="surrogate"))
    truth = {q.name: np.array([np.mean(p.draws[..., k])]) for k, q in enumerate(p.parameters)}
    rng, sweeps = np.random.default_rng(8), []
    for sweep in p.sweeps:
        at = model_sweep(p, FAST, plan_sweep(sweep), truth)
        assert "force" in sweep.channels
        assert "capacitance" in sweep.channels
        assert "force" in at.channels
        force = at.channels["force"].mean[0] + rng.normal(0, 0.005, sweep.channels["force"].value.size)
        tied = force if sweep.channels["capacitance"].force is not None else None
        press = replace(sweep.channels["force"], value=force)
        lcr = replace(sweep.channels["capacitance"], force=tied)
        sweep = replace(sweep, channels={"force": press, "capacitance": lcr})
        at = model_sweep(p, FAST, plan_sweep(sweep), truth)
        assert "capacitance" in at.channels
        read = at.channels["capacitance"].mean[0] + rng.normal(0, 2.5e-15, force.size)
        sweeps.append(replace(sweep, channels={"force": press, "capacitance": replace(lcr, value=read)}))
    p = replace(p, sweeps=tuple(sweeps))
    flat = p.draws.reshape(-1, p.draws.shape[-1])
    theta = np.stack([q.prior.to_normal(flat[:, k]) for k, q in enumerate(p.parameters)], axis=1)
    return replace(p, log_prob=log_posterior(problem_of(p, FAST), theta).reshape(p.log_prob.shape))


@pytest.fixture(scope="module")
def posterior(make_posterior: MakePosterior) -> Posterior:
    return _of_surrogate(make_posterior(n_specimen=1))


@pytest.fixture(scope="module")
def saved(posterior: Posterior, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """What the file of that posterior holds."""
    path = tmp_path_factory.mktemp("saved") / "posterior.nc"
    save_posterior(posterior, path)
    return path.read_bytes()


@pytest.fixture
def run(saved: bytes, tmp_path: Path) -> Path:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "posterior.nc").write_bytes(saved)
    return tmp_path / "run"


@contextmanager
def _here(_: int | None) -> Iterator[Executor]:
    """Work in this process."""
    with ThreadPoolExecutor(1) as executor:
        yield executor


@dataclass(frozen=True)
class Instead(FiniteElements):
    """The surrogate with its force off by a factor in place of the finite elements."""

    factor: float = 1.0

    def respond(self, design: Design | LayeredDesign, depth: FloatArray) -> Response:
        assert isinstance(design, Design)
        found = FAST.respond(design, depth)
        return replace(found, force=self.factor * found.force)


def _means(factor: float) -> Means:
    return Means(exact=partial(Instead, factor=factor), workers=_here)


RIGHT = _means(1.0)


def _refine(run: Path, *words: object, means: Means = RIGHT) -> Result:
    options = ("--draws", 2, "--reweight", 60, "--accuracy", ACCURACY, *words)
    return CliRunner().invoke(app, ["surrogate", "refine", str(run), *(str(w) for w in options)], obj=means)


def _line(text: str) -> str:
    return " ".join(text.split())


def _held(path: Path) -> int:
    with open_store(path, store_settings(ACCURACY)) as store:
        return len(store)


def test_a_posterior_stands_where_the_surrogate_is_right(run: Path) -> None:
    result = _refine(run)
    assert result.exit_code == 0, result.output
    said = _line(result.stdout)
    assert "Added to" in said
    assert "The posterior stands: re-weighted to the finite elements at 60 draws" in said
    assert "no mean shifts by more than 0.1" in said
    for told in ("rms of error / stated sd", "capacitance change, 2 curves", "shift of the mean in sd", "young_modulus"):
        assert told in said
    assert _held(run / "refine.sqlite") == 2
    # The same draws once more: nothing new to run.
    assert "0 loading curves, now 2" in _line(_refine(run).stdout)


def test_a_posterior_is_to_be_run_again_where_the_surrogate_is_wrong(run: Path) -> None:
    result = _refine(run, means=_means(1.03))
    assert result.exit_code == 3, result.output
    assert 'Run the posterior again, with a better surrogate (-o) or model = "fem": re-weighted' in _line(result.stdout)
    assert {p.name for p in run.iterdir()} == {"posterior.nc", "refine.sqlite"}


def test_a_posterior_that_has_not_converged_does_not_stand(posterior: Posterior, run: Path) -> None:
    diagnostics = replace(posterior.diagnostics, converged=False, reasons=("R-hat of young_modulus is 1.31, above 1.01",))
    save_posterior(replace(posterior, diagnostics=diagnostics), run / "posterior.nc")
    result = _refine(run)
    assert result.exit_code == 3
    assert "Run the posterior again: it has not converged" in _line(result.stdout)


def test_a_posterior_of_a_dishonest_surrogate_does_not_stand_and_is_not_called_unconverged(
    posterior: Posterior, run: Path
) -> None:
    found = SpotCheck("surrogate", 12, 0.05, 0.01, 9.0, 0.9, ())
    off = replace(posterior, diagnostics=replace(posterior.diagnostics, spot_check=found))
    save_posterior(off, run / "posterior.nc")
    result = _refine(run)
    assert result.exit_code == 3
    said = _line(result.stdout)
    assert 'Run the posterior again, with a better surrogate (-o) or model = "fem": at 12 loading curves' in said
    assert "9.0 and 0.9 times the error it states" in said
    assert "not converged" not in said


class _Interrupting(ThreadPoolExecutor):
    """Two pieces of work are done, at the third somebody presses Ctrl-C."""

    count = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.count += 1
        return super().submit(_interrupt) if self.count == 3 else super().submit(fn, *args, **kwargs)


def _interrupt() -> None:
    raise KeyboardInterrupt


@contextmanager
def _interrupted(_: int | None) -> Iterator[Executor]:
    with _Interrupting(1) as executor:
        yield executor


def test_runs_are_kept_when_it_is_stopped(run: Path, tmp_path: Path) -> None:
    words = ("--store", tmp_path / "mine.sqlite", "--draws", 4)
    result = _refine(run, *words, means=replace(RIGHT, workers=_interrupted))
    assert result.exit_code == 130
    assert "Stopped with 2 curves in" in _line(result.stderr)
    assert _held(tmp_path / "mine.sqlite") == 2
    assert "2 loading curves, now 4" in _line(_refine(run, *words).stdout)


def test_a_surrogate_is_trained_on_what_the_store_holds(run: Path, tmp_path: Path) -> None:
    seen = []

    def fitted(data: TrainingSet, **options: Any) -> Surrogate:
        seen.append((data, options))
        return FAST

    one = run_point(np.array([0.15, 0.2, 2.0, 1.0]), ACCURACY)
    with open_store(tmp_path / "mine.sqlite", store_settings(ACCURACY)) as store:
        for i in range(LEAST_PATHS):
            store.add(np.array([0.15, 0.2, 2.0, 1.0 + i]), one.arrays)
    words = ("--store", tmp_path / "mine.sqlite", "-o", tmp_path / "new.npz", "--steps", 7)
    result = _refine(run, *words, means=replace(RIGHT, fit=fitted))
    assert result.exit_code == 0, result.output
    ((data, options),) = seen
    assert len(data.groups) == LEAST_PATHS + 2
    assert options["steps"] == 7
    assert options["base"] is FAST.base
    assert load_surrogate(tmp_path / "new.npz").provenance == FAST.provenance


# --- refusals -----------------------------------------------------------------------------------------------------------


def _refused(result: Result, message: str) -> None:
    assert result.exit_code == 2, result.output
    assert message in _line(result.stderr)
    assert result.stdout == ""


def test_what_cannot_be_refined_is_refused_before_any_work(posterior: Posterior, run: Path, tmp_path: Path) -> None:
    def refused(*words: object, folder: Path = run) -> Result:
        return _refine(folder, *words, means=Means(workers=lambda _: pytest.fail("work was begun")))

    _refused(refused(folder=tmp_path / "nothing"), "there is no finished calibration in this folder")
    (tmp_path / "no store.sqlite").write_text("a diary, long enough to be looked at as a database " * 20, encoding="utf-8")
    _refused(refused("--store", tmp_path / "no store.sqlite"), "is not a store of finite-element runs")
    with open_store(tmp_path / "coarse.sqlite", store_settings(1e-2)):
        pass
    _refused(refused("--store", tmp_path / "coarse.sqlite"), "accuracy is 0.01 there and 0.05 here")
    _refused(refused("--store", tmp_path / "no" / "s.sqlite"), "does not exist. Create it first")
    _refused(
        refused("-o", tmp_path / "new.npz"),
        f"holds 0 loading curves, too few to train a surrogate (at least {LEAST_PATHS})",
    )
    _refused(refused("-o", run / "posterior.nc"), "not overwritten")
    _refused(refused("-o", tmp_path / "no" / "new.npz"), "does not exist. Create it first")
    assert CliRunner().invoke(app, ["surrogate", "refine", str(run), "--reweight", "10"]).exit_code == 2
    assert {p.name for p in run.iterdir()} == {"posterior.nc"}
    assert not (tmp_path / "new.npz").exists()
    models: tuple[tuple[Literal["fem", "closed form"], str], ...] = (("fem", "finite elements"), ("closed form", "closed form"))
    for model, name in models:
        other = replace(posterior, forward_name=name, experiment=replace(posterior.experiment, model=model))
        save_posterior(other, run / "posterior.nc")
        _refused(refused(), f"the run was calibrated with the {name}. There is nothing to refine")


def test_another_surrogate_than_the_run_was_made_with_is_refused(posterior: Posterior) -> None:
    require_own_surrogate(posterior, FAST)
    with pytest.raises(InputError, match="the surrogate has changed since the run was calibrated with it"):
        require_own_surrogate(replace(posterior, log_prob=posterior.log_prob + 1.0), FAST)
    with pytest.raises(InputError, match="was calibrated with the surrogate"):
        require_own_surrogate(posterior, ClosedForm())


# --- parts --------------------------------------------------------------------------------------------------------------


def test_points_are_those_of_every_specimen_once(make_posterior: MakePosterior) -> None:
    p = make_posterior()
    values = thin_draws(p, 3, np.random.default_rng(1))
    points = training_points(p, values, FAST.family)
    assert points.shape == (6, 4)
    twice = replace(p, sweeps=(*p.sweeps, replace(p.sweeps[0], name="again")))
    np.testing.assert_array_equal(training_points(twice, values, FAST.family), points)
    np.testing.assert_allclose(np.unique(np.round(points[:, 2], 9)), [2.0])
    assert np.any(np.isclose(points[:, 0], values["sensor_thickness[sensor 1]"][0] / 5e-3))


def test_curves_are_compared_sweep_by_sweep_on_any_executor(make_posterior: MakePosterior) -> None:
    p, exact = make_posterior(), FiniteElements(2e-2)
    values = thin_draws(p, 2, np.random.default_rng(1))
    plain = compare_draws(p, FAST, exact, values)
    with ThreadPoolExecutor(1) as executor:
        again = compare_draws(p, FAST, exact, values, executor)
    assert [c.sweep for c in plain] == ["sensor 1", "sensor 2"]
    for a, b in zip(plain, again, strict=True):
        assert a.force_error.shape == (2, 7)
        np.testing.assert_array_equal(a.change_score, b.change_score)


def test_rows_tell_the_errors_of_each_sweep() -> None:
    error = np.array([[0.01, -0.02, 0.03]])
    nothing = np.empty((0, 3))
    rows = error_rows(
        [
            Comparison("sensor 1", error, error / 2, np.full((1, 3), 2.0), np.ones((1, 3)), ()),
            Comparison("sensor 2", nothing, nothing, nothing, nothing, ("stuck",)),
        ]
    )
    assert rows[0] == ("sensor 1", "force, 1 curves", "2.00 %", "2.90 %", "3.00 %", "2.00")
    assert rows[3] == ("sensor 2", "capacitance change, 0 curves", "none", "none", "none", "none")


def test_a_refined_run_stays_as_it_is(run: Path) -> None:
    before = (run / "posterior.nc").read_bytes()
    _refine(run)
    assert (run / "posterior.nc").read_bytes() == before
