"""Training points, the paths run on them, and their file."""

import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from models.fem.equilibrium import Failure
from models.fem.path import walk
from models.store import StoreError, open_store
from models.training import (
    GROUPS,
    PATH,
    design_points,
    from_unit,
    load_training_set,
    reach,
    run_point,
    run_training,
    store_settings,
    to_unit,
)


def test_points_fill_the_box_and_nothing_else():
    points = design_points(256, seed=1)
    low, high = np.array(list(GROUPS.values())).T
    assert points.shape == (256, 4)
    assert np.all(points >= low - 1e-12)
    assert np.all(points <= high + 1e-12)
    assert np.all(np.ptp(to_unit(points), axis=0) > 1.99)


def test_unit_coordinates_are_inverted():
    x = np.random.default_rng(0).uniform(-1, 1, (50, 4))
    np.testing.assert_allclose(to_unit(from_unit(x)), x, atol=1e-12)


def test_reach_is_the_smallest_limit_smoothly():
    np.testing.assert_allclose(reach(0.1, 0.1, 4.0), 0.57 * 0.2, rtol=1e-3)
    np.testing.assert_allclose(reach(0.5, 3.6, 4.0), 0.9, rtol=2e-2)
    np.testing.assert_allclose(reach(0.5, 3.6, 1.25), 0.36 * 1.25**2, rtol=2e-2)


def test_paths_run_on_an_executor_and_round_trip(tmp_path):
    points = np.array([[0.15, 0.2, 2.0, 1.0], [0.2, 0.0, 1.5, 1.0]])
    seen = []
    with ThreadPoolExecutor(2) as executor:
        data = run_training(points, executor, accuracy=5e-3, seed=7, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(1, 2), (2, 2)]
    assert data.failures == ()
    assert data.force.shape == (2, PATH.size)
    assert np.all(np.diff(data.force, axis=1) > 0)
    assert np.all(data.capacitance[:, -1] > 0)
    data.save(tmp_path / "t.npz")
    again = load_training_set(tmp_path / "t.npz")
    assert again.digest == data.digest
    assert (again.seed, again.accuracy, again.failures) == (7, 5e-3, ())


def test_a_path_without_an_end_is_named_not_hidden(monkeypatch):
    def stuck(model, depths):
        if len(model.design.layers) > 1:
            yield Failure(0.07, "an element would be inverted (J <= 0)")
        else:
            yield from walk(model, depths)

    monkeypatch.setattr("models.training.walk", stuck)
    points = np.array([[0.15, 0.2, 2.0, 1.0], [0.2, 0.0, 1.5, 1.0]])
    with ThreadPoolExecutor(2) as executor:
        data = run_training(points, executor, accuracy=5e-3, seed=0)
    np.testing.assert_array_equal(data.groups, points[1:])
    assert data.failures == (
        "h_s/R = 0.15, h_p/R = 0.2, a/R = 2, E_p/E = 1: an element would be inverted (J <= 0) at d/R = 0.07 of 0.1995",
    )


POINTS = np.array([[0.15, 0.2, 2.0, 1.0], [0.2, 0.0, 1.5, 1.0], [0.1, 0.3, 1.8, 2.0]])
COARSE = 2e-2


def test_a_campaign_that_was_stopped_goes_on_where_it_was(tmp_path, monkeypatch):
    settings = store_settings(COARSE)
    with ThreadPoolExecutor(1) as executor:
        whole = run_training(POINTS, executor, accuracy=COARSE, seed=0)

        def interrupted(done, total):
            if done == 2:
                raise KeyboardInterrupt

        with open_store(tmp_path / "s.sqlite", settings) as store:
            with pytest.raises(KeyboardInterrupt):
                run_training(POINTS, executor, accuracy=COARSE, seed=0, store=store, progress=interrupted)
            assert len(store) == 2
        asked = []
        monkeypatch.setattr("models.training.run_point", lambda p, a: asked.append(p) or run_point(p, a))
        with open_store(tmp_path / "s.sqlite", settings) as store:
            again = run_training(POINTS, executor, accuracy=COARSE, seed=0, store=store)
            assert len(store) == 3
    assert len(asked) == 1
    assert again.digest == whole.digest


def test_failed_runs_are_kept_and_not_made_again(tmp_path, monkeypatch):
    monkeypatch.setattr("models.training.walk", lambda model, depths: iter([Failure(0.07, "stuck")]))
    with ThreadPoolExecutor(1) as executor, open_store(tmp_path / "s.sqlite", store_settings(COARSE)) as store:
        with pytest.raises(ValueError, match="need at least one array"):
            run_training(POINTS[:1], executor, accuracy=COARSE, seed=0, store=store)
        assert "stuck" in store.find(POINTS[0])


def test_a_store_of_other_runs_is_refused(tmp_path):
    path = tmp_path / "s.sqlite"
    with open_store(path, store_settings(1e-3)) as store:
        assert store.find(POINTS[0]) is None
    with pytest.raises(StoreError, match=r"accuracy is 0\.001 there and 0\.02 here"), open_store(path, store_settings(COARSE)):
        pass
    (tmp_path / "t.txt").write_text("no store at all, but long enough to be looked at as one " * 20)
    with pytest.raises(StoreError, match="is not a store"), open_store(tmp_path / "t.txt", store_settings(COARSE)):
        pass


def test_a_kill_in_the_middle_of_a_campaign_leaves_whole_runs(tmp_path):
    # The process is killed, not asked to stop, while it writes one run after the other.
    path = tmp_path / "s.sqlite"
    code = f"""
        import itertools, numpy as np
        from pathlib import Path
        from models.store import open_store
        with open_store(Path({str(path)!r}), {{"a": 1}}) as store:
            for i in itertools.count():
                store.add(np.full(4, float(i)), {{"force": np.full(4000, float(i))}})
                print(i, flush=True)
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True)
    said = [int(process.stdout.readline()) for _ in range(20)]
    process.kill()
    process.communicate()
    with open_store(path, {"a": 1}) as store:
        assert len(store) >= len(said)
        for i in said:
            np.testing.assert_array_equal(store.find(np.full(4, float(i)))["force"], np.full(4000, float(i)))


@pytest.mark.filterwarnings("default")
def test_paths_run_on_a_dask_cluster(tmp_path):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
        open_store(tmp_path / "s.sqlite", store_settings(COARSE)) as store,
    ):
        data = run_training(POINTS[:2], client.get_executor(), accuracy=COARSE, seed=0, store=store)
        assert len(store) == 2
    with ThreadPoolExecutor(1) as executor:
        here = run_training(POINTS[:2], executor, accuracy=COARSE, seed=0)
    np.testing.assert_allclose(data.force, here.force, rtol=1e-9)
