"""Training points, the paths run on them, and their file."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from models.fem.equilibrium import Failure
from models.fem.path import walk
from models.training import GROUPS, PATH, design_points, from_unit, load_training_set, reach, run_training, to_unit


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
