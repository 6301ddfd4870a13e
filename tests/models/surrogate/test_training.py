"""Training points, the paths run on them, and their file."""

import subprocess
import sys
import textwrap
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from models.fem.equilibrium import DiscreteSensor, Failure, State
from models.fem.path import walk
from models.sensor import FloatArray
from models.surrogate import FAMILIES
from models.surrogate.domain import COMPRESSION, DEPTH, PATH, inside
from models.surrogate.families import Family
from models.surrogate.points import design_points, random_groups
from models.surrogate.store import RunStore, StoreError, open_store
from models.surrogate.training import (
    TrainingRun,
    points_wanted,
    run_point,
    run_training,
    store_settings,
    training_set,
)

COARSE = 2e-2


def _found(store: RunStore, point: FloatArray) -> tuple[dict[str, FloatArray], str]:
    found = store.find(point)
    assert found is not None
    return found


def electric(groups: FloatArray) -> FloatArray:
    return np.concatenate([groups, np.tile([0.3, 0.8], (len(groups), 1))], axis=1)


def test_points_fill_the_range_and_a_little_more() -> None:
    points = design_points(512, seed=1)
    assert points.shape == (512, 4)
    share = np.mean(inside(electric(points)))
    assert 0.6 < share < 0.99
    assert np.all(inside(electric(random_groups(500, np.random.default_rng(0)))))
    np.testing.assert_array_equal(design_points(100, seed=1), points[:100])


def test_a_path_ends_at_half_the_radius_or_at_60_percent_compression() -> None:
    deep = run_point(np.array([0.5, 2.0, 3.0, 1.0]), COARSE)
    np.testing.assert_allclose(deep.depth, DEPTH * PATH**2)
    assert np.all(deep.compression < COMPRESSION)
    thin = run_point(np.array([0.05, 0.1, 3.0, 0.1]), COARSE)
    assert thin.compression[-1] >= COMPRESSION > thin.compression[-2]
    for run in (deep, thin):
        assert not run.failure
        assert np.all(np.diff(run.force) > 0)
        assert np.all(run.capacitance[-1] > 0)


def test_paths_of_the_other_families_are_stiffer() -> None:
    point = np.array([0.15, 0.2, 2.0, 1.0])
    plain = run_point(point, COARSE)
    stick, gent = (run_point(np.append(point, end), COARSE, FAMILIES[f]) for f, end in (("friction", 1.0), ("gent", 0.1)))
    n = min(plain.force.size, stick.force.size, gent.force.size) - 1
    assert 1.03 < gent.force[n] / plain.force[n] < 1.4
    assert 1.1 < stick.force[n] / plain.force[n] < 2.0
    points = design_points(64, seed=1, family=FAMILIES["gent"])
    assert points.shape == (64, 5)
    assert 0 < points[:, 4].min() < 0.01
    assert 0.1 < points[:, 4].max() < 0.111


def test_training_paths_with_friction_go_in_larger_steps_to_nearly_the_same_end() -> None:
    point, family = np.array([0.15, 0.2, 2.0, 1.0, 0.6]), FAMILIES["friction"]
    own, fine = run_point(point, COARSE, family), run_point(point, COARSE, family, partial(walk, friction_step=1 / 80))
    np.testing.assert_allclose(own.force[5:], fine.force[5:], rtol=2e-3)
    np.testing.assert_allclose(own.capacitance[5:], fine.capacitance[5:], rtol=5e-3)
    assert "friction step" in store_settings(COARSE, family)
    assert "friction step" not in store_settings(COARSE)


def test_a_path_without_an_end_is_kept_as_far_as_it_came_and_says_why() -> None:
    def stuck(model: DiscreteSensor, depths: FloatArray) -> Iterator[State | Failure]:
        yield from walk(model, depths[:5])
        yield Failure(0.07, "an element would be inverted (J <= 0)")

    run = run_point(np.array([0.15, 0.2, 2.0, 1.0]), COARSE, path=stuck)
    assert run.depth.size == 5
    assert run.failure == (
        "h_s/R = 0.15, h_p/R = 0.2, a/R = 2, E_p/E = 1: an element would be inverted (J <= 0) at d/R = 0.07 of 0.21"
    )


POINTS = np.array([[0.15, 0.2, 2.0, 1.0], [0.2, 0.0, 1.5, 1.0], [0.1, 0.3, 1.8, 2.0]])


def test_a_campaign_that_was_stopped_goes_on_where_it_was(tmp_path: Path) -> None:
    settings = store_settings(COARSE)
    seen = []
    with ThreadPoolExecutor(1) as executor:
        with open_store(tmp_path / "whole.sqlite", settings) as store:
            run_training(POINTS, executor, store, accuracy=COARSE, progress=lambda done, total: seen.append((done, total)))
            whole = training_set(store, COARSE)
        assert seen == [(1, 3), (2, 3), (3, 3)]
        assert whole.depth.shape == (3, PATH.size)
        assert whole.failures == ("", "", "")

        def interrupted(done: int, total: int) -> None:
            if done == 2:
                raise KeyboardInterrupt

        with open_store(tmp_path / "s.sqlite", settings) as store:
            with pytest.raises(KeyboardInterrupt):
                run_training(POINTS, executor, store, accuracy=COARSE, progress=interrupted)
            assert len(store) == 2
        asked = []

        def counted(point: FloatArray, accuracy: float, family: Family) -> TrainingRun:
            asked.append(point)
            return run_point(point, accuracy, family)

        with open_store(tmp_path / "s.sqlite", settings) as store:
            run_training(POINTS, executor, store, accuracy=COARSE, run=counted)
            assert len(store) == 3
            again = training_set(store, COARSE)
    assert len(asked) == 1
    assert again.digest == whole.digest


def test_failed_runs_are_kept_and_not_made_again(tmp_path: Path) -> None:
    stuck = partial(run_point, path=lambda model, depths: iter([Failure(0.07, "stuck")]))
    with ThreadPoolExecutor(1) as executor, open_store(tmp_path / "s.sqlite", store_settings(COARSE)) as store:
        run_training(POINTS[:1], executor, store, accuracy=COARSE, run=stuck)
        assert "stuck" in _found(store, POINTS[0])[1]
        assert points_wanted(store, POINTS, 1).shape == (0, 4)
        data = training_set(store, COARSE)
    assert "stuck" in data.failures[0]
    np.testing.assert_array_equal(data.n_step, [0])


def test_a_campaign_is_extended_by_points_it_does_not_hold(tmp_path: Path) -> None:
    with open_store(tmp_path / "s.sqlite", store_settings(COARSE)) as store:
        with pytest.raises(ValueError, match="holds no runs"):
            training_set(store, COARSE)
        store.add(POINTS[1], {})
        np.testing.assert_array_equal(points_wanted(store, POINTS, 2), POINTS[:1])
        np.testing.assert_array_equal(points_wanted(store, POINTS, 3), POINTS[[0, 2]])


def test_a_store_of_other_runs_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.sqlite"
    with open_store(path, store_settings(1e-3)) as store:
        assert store.find(POINTS[0]) is None
    with pytest.raises(StoreError, match=r"accuracy is 0\.001 there and 0\.02 here"), open_store(path, store_settings(COARSE)):
        pass
    (tmp_path / "t.txt").write_text("no store at all, but long enough to be looked at as one " * 20)
    with pytest.raises(StoreError, match="is not a store"), open_store(tmp_path / "t.txt", store_settings(COARSE)):
        pass


def test_a_kill_in_the_middle_of_a_campaign_leaves_whole_runs(tmp_path: Path) -> None:
    # The process is killed, not asked to stop, while it writes one run after the other.
    path = tmp_path / "s.sqlite"
    code = f"""
        import itertools, numpy as np
        from pathlib import Path
        from models.surrogate.store import open_store
        with open_store(Path({str(path)!r}), {{"a": 1}}) as store:
            for i in itertools.count():
                store.add(np.full(4, float(i)), {{"force": np.full(4000, float(i))}})
                print(i, flush=True)
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    said = [int(process.stdout.readline()) for _ in range(20)]
    process.kill()
    process.communicate()
    with open_store(path, {"a": 1}) as store:
        assert len(store) >= len(said)
        for i in said:
            np.testing.assert_array_equal(_found(store, np.full(4, float(i)))[0]["force"], np.full(4000, float(i)))


@pytest.mark.filterwarnings("default")
def test_paths_run_on_a_dask_cluster(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
        open_store(tmp_path / "s.sqlite", store_settings(COARSE)) as store,
    ):
        run_training(POINTS[:2], client.get_executor(), store, accuracy=COARSE)
        for point in POINTS[:2]:
            np.testing.assert_allclose(_found(store, point)[0]["force"], run_point(point, COARSE).force, rtol=1e-9)
