"""Finite elements at draws of a posterior: runs kept, errors told, a verdict with its exit code, refusals before any work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from calib.checks.refine import error_rows, require_own_surrogate, training_points
from calib.checks.reweight import problem_of
from calib.checks.spotcheck import Comparison, compare_draws
from calib.cli import app
from calib.errors import InputError
from calib.problem.likelihood import log_posterior
from calib.problem.measurement import model_sweep, plan_sweep
from calib.sampling.posterior import Posterior, thin_draws
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm
from models.fem import FiniteElements
from models.response import Response
from models.sensor import Design, FloatArray
from models.surrogate.domain import Family
from models.surrogate.fitting import LEAST_PATHS
from models.surrogate.store import open_store
from models.surrogate.surrogate import Surrogate, load_surrogate
from models.surrogate.training import Run, run_point, store_settings

MakePosterior = Callable[..., Posterior]
ACCURACY = 1e-4  # as the store has it; the runs of these tests are coarser
FAST = load_surrogate()


def _of_surrogate(posterior: Posterior) -> Posterior:
    """The posterior as if the surrogate were its model: readings and densities of the draws are those of the surrogate."""
    p = replace(posterior, forward_name="surrogate", experiment=replace(posterior.experiment, model="surrogate"))
    truth = {q.name: np.array([np.mean(p.draws[..., k])]) for k, q in enumerate(p.parameters)}
    rng, sweeps = np.random.default_rng(8), []
    for sweep in p.sweeps:
        at = model_sweep(p, FAST, plan_sweep(sweep), truth)
        assert sweep.force is not None
        assert sweep.capacitance is not None
        assert at.force is not None
        force = at.force.mean[0] + rng.normal(0, 0.005, sweep.force.force.size)
        tied = force if sweep.capacitance.force is not None else None
        sweep = replace(
            sweep,
            force=replace(sweep.force, force=force),
            capacitance=replace(sweep.capacitance, force=tied),
            track=sweep.track,
        )
        at = model_sweep(p, FAST, plan_sweep(sweep), truth)
        assert at.capacitance is not None
        read = at.capacitance.mean[0] + rng.normal(0, 2.5e-15, force.size)
        sweeps.append(replace(sweep, capacitance=replace(sweep.capacitance, capacitance=read)))
    p = replace(p, sweeps=tuple(sweeps))
    flat = p.draws.reshape(-1, p.draws.shape[-1])
    theta = np.stack([q.prior.to_normal(flat[:, k]) for k, q in enumerate(p.parameters)], axis=1)
    return replace(p, log_prob=log_posterior(problem_of(p, FAST), theta).reshape(p.log_prob.shape))


@pytest.fixture(scope="module")
def posterior(make_posterior: MakePosterior) -> Posterior:
    return _of_surrogate(make_posterior(n_specimen=1))


@pytest.fixture
def run(posterior: Posterior, tmp_path: Path) -> Path:
    (tmp_path / "run").mkdir()
    save_posterior(posterior, tmp_path / "run" / "posterior.nc")
    return tmp_path / "run"


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Function that puts the surrogate with its force off by a factor in place of the finite elements, in this process."""

    @contextmanager
    def here(_: int | None) -> Iterator[Executor]:
        with ThreadPoolExecutor(1) as executor:
            yield executor

    def coarse(point: FloatArray, _: float, family: Family) -> Run:
        return run_point(point, 5e-2, family)

    def put(factor: float) -> None:
        def respond(_: FiniteElements, design: Design, depth: FloatArray) -> Response:
            found = FAST.respond(design, depth)
            return replace(found, force=factor * found.force)

        monkeypatch.setattr(FiniteElements, "respond", respond)

    monkeypatch.setattr("calib.cli.model.workers", here)
    monkeypatch.setattr("models.surrogate.training.run_point", coarse)
    return put


def _refine(run: Path, *words: object) -> Result:
    options = ("--draws", 2, "--reweight", 60, "--accuracy", ACCURACY, *words)
    return CliRunner().invoke(app, ["surrogate", "refine", str(run), *(str(w) for w in options)])


def _line(text: str) -> str:
    return " ".join(text.split())


def _held(path: Path) -> int:
    with open_store(path, store_settings(ACCURACY)) as store:
        return len(store)


def test_a_posterior_stands_where_the_surrogate_is_right(run: Path, quick: Callable[[float], None]) -> None:
    quick(1.0)
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


def test_a_posterior_is_to_be_run_again_where_the_surrogate_is_wrong(run: Path, quick: Callable[[float], None]) -> None:
    quick(1.03)
    result = _refine(run)
    assert result.exit_code == 3, result.output
    assert 'Run the posterior again, with a better surrogate (-o) or model = "fem": re-weighted' in _line(result.stdout)
    assert {p.name for p in run.iterdir()} == {"posterior.nc", "refine.sqlite"}


def test_a_posterior_that_has_not_converged_does_not_stand(
    posterior: Posterior, run: Path, quick: Callable[[float], None]
) -> None:
    quick(1.0)
    diagnostics = replace(posterior.diagnostics, converged=False, reasons=("R-hat of young_modulus is 1.31, above 1.01",))
    save_posterior(replace(posterior, diagnostics=diagnostics), run / "posterior.nc")
    result = _refine(run)
    assert result.exit_code == 3
    assert "Run the posterior again: it has not converged" in _line(result.stdout)


def test_runs_are_kept_when_it_is_stopped(
    run: Path, tmp_path: Path, quick: Callable[[float], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    quick(1.0)
    count = 0

    def stopped(point: FloatArray, _: float, family: Family) -> Run:
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt
        return run_point(point, 5e-2, family)

    with monkeypatch.context() as patch:
        patch.setattr("models.surrogate.training.run_point", stopped)
        result = _refine(run, "--store", tmp_path / "mine.sqlite", "--draws", 4)
    assert result.exit_code == 130
    assert "Stopped with 2 curves in" in _line(result.stderr)
    assert _held(tmp_path / "mine.sqlite") == 2
    assert "2 loading curves, now 4" in _line(_refine(run, "--store", tmp_path / "mine.sqlite", "--draws", 4).stdout)


def test_a_surrogate_is_trained_on_what_the_store_holds(
    run: Path, tmp_path: Path, quick: Callable[[float], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    quick(1.0)
    seen = []

    def fitted(data: object, **options: object) -> Surrogate:
        seen.append((data, options))
        return FAST

    monkeypatch.setattr("models.surrogate.fitting.fit_surrogate", fitted)
    one = run_point(np.array([0.15, 0.2, 2.0, 1.0, 0.0]), 5e-2)
    arrays = {name: getattr(one, name) for name in ("depth", "force", "contact_radius", "compression", "capacitance")}
    with open_store(tmp_path / "mine.sqlite", store_settings(ACCURACY)) as store:
        for i in range(LEAST_PATHS):
            store.add(np.array([0.15, 0.2, 2.0, 1.0 + i, 0.0]), arrays)
    result = _refine(run, "--store", tmp_path / "mine.sqlite", "-o", tmp_path / "new.npz", "--steps", 7)
    assert result.exit_code == 0, result.output
    ((data, options),) = seen
    assert len(data.groups) == LEAST_PATHS + 2  # type: ignore[attr-defined]
    assert options["steps"] == 7
    assert load_surrogate(tmp_path / "new.npz").provenance == FAST.provenance


# --- refusals -----------------------------------------------------------------------------------------------------------


def _refused(result: Result, message: str) -> None:
    assert result.exit_code == 2, result.output
    assert message in _line(result.stderr)
    assert result.stdout == ""


def test_what_cannot_be_refined_is_refused_before_any_work(
    posterior: Posterior, run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("models.surrogate.training.run_training", lambda *_, **__: pytest.fail("work was begun"))
    _refused(_refine(tmp_path / "nothing"), "there is no finished calibration in this folder")
    (tmp_path / "no store.sqlite").write_text("a diary, long enough to be looked at as a database " * 20, encoding="utf-8")
    _refused(_refine(run, "--store", tmp_path / "no store.sqlite"), "is not a store of finite-element runs")
    with open_store(tmp_path / "coarse.sqlite", store_settings(1e-2)):
        pass
    _refused(_refine(run, "--store", tmp_path / "coarse.sqlite"), "accuracy is 0.01 there and 0.0001 here")
    _refused(_refine(run, "--store", tmp_path / "no" / "s.sqlite"), "does not exist. Create it first")
    _refused(
        _refine(run, "-o", tmp_path / "new.npz"),
        f"holds 0 loading curves, too few to train a surrogate (at least {LEAST_PATHS})",
    )
    _refused(_refine(run, "-o", run / "posterior.nc"), "not overwritten")
    _refused(_refine(run, "-o", tmp_path / "no" / "new.npz"), "does not exist. Create it first")
    assert CliRunner().invoke(app, ["surrogate", "refine", str(run), "--reweight", "10"]).exit_code == 2
    assert {p.name for p in run.iterdir()} == {"posterior.nc"}
    assert not (tmp_path / "new.npz").exists()
    for model, name in (("fem", "finite elements"), ("closed form", "closed form")):
        other = replace(posterior, forward_name=name, experiment=replace(posterior.experiment, model=model))
        save_posterior(other, run / "posterior.nc")
        _refused(_refine(run), f"the run was calibrated with the {name}. There is nothing to refine")


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
    points = training_points(p, values)
    assert points.shape == (6, 5)
    twice = replace(p, sweeps=(*p.sweeps, replace(p.sweeps[0], name="again")))
    np.testing.assert_array_equal(training_points(twice, values), points)
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
    assert rows[0] == ("sensor 1", "force, 1 curves", "2.00%", "2.90%", "3.00%", "2.00")
    assert rows[3] == ("sensor 2", "capacitance change, 0 curves", "none", "none", "none", "none")


def test_a_refined_run_stays_as_it_is(run: Path, quick: Callable[[float], None]) -> None:
    quick(1.0)
    before = (run / "posterior.nc").read_bytes()
    _refine(run)
    assert (run / "posterior.nc").read_bytes() == before
