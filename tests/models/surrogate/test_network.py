"""Small networks: what they learn, that they are smooth, and that complex steps differentiate them."""

import numpy as np
import pytest

from models.sensor import FloatArray
from models.surrogate.network import Network, least_squares, mean_network, network_from, train_network


def wave(x: FloatArray) -> FloatArray:
    return np.stack([np.sin(2 * x[:, 0]) * np.exp(-x[:, 1]), np.tanh(3 * (x[:, 0] + x[:, 1]))], axis=1)


@pytest.fixture(scope="module")
def trained() -> Network:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (2000, 2))
    return train_network(x, least_squares(wave(x)), (24, 24, 2), steps=2500, rng=rng, batch=500)


def test_a_smooth_function_is_learned_to_a_thousandth(trained: Network) -> None:
    x = np.random.default_rng(1).uniform(-1, 1, (500, 2))
    assert np.sqrt(np.mean((trained(x) - wave(x)) ** 2)) < 2e-3


def test_the_same_seed_gives_the_same_network(trained: Network) -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (2000, 2))
    short = [train_network(x, least_squares(wave(x)), (8, 2), steps=20, rng=np.random.default_rng(3)).layers for _ in range(2)]
    for a, b in zip(*short, strict=True):
        np.testing.assert_array_equal(a, b)


def test_points_of_no_weight_are_not_followed() -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (1000, 1))
    wrong = rng.uniform(size=1000) < 0.5
    y = np.where(wrong[:, None], 5.0, x)
    fitted = train_network(x, least_squares(y, np.where(wrong, 0.0, 1.0)), (8, 1), steps=800, rng=rng, batch=200)
    np.testing.assert_allclose(fitted(x), x, atol=0.02)


def test_a_complex_step_is_the_derivative(trained: Network) -> None:
    x = np.array([[0.3, -0.2], [0.0, 0.5]])
    steps = [trained(x + 1e-30j * np.eye(2)[k]).imag / 1e-30 for k in range(2)]
    for k, step in enumerate(steps):
        # Single precision: differences over a wide step.
        h = 0.02 * np.eye(2)[k]
        np.testing.assert_allclose(step, (trained(x + h) - trained(x - h)) / 0.04, rtol=0.02, atol=5e-3)


def test_arrays_give_the_network_back(trained: Network) -> None:
    arrays = trained.arrays("a") | {"b": np.zeros(1)}
    x = np.zeros((3, 2))
    np.testing.assert_array_equal(network_from(arrays, "a")(x), trained(x))
    with pytest.raises(KeyError):
        network_from(arrays, "b")


def test_a_mean_of_networks_says_the_mean_of_what_they_say() -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (700, 2))
    several = [train_network(x, least_squares(wave(x)), (8, 6, 2), steps=20, rng=rng) for _ in range(3)]
    mean = mean_network(several)
    assert (mean.sizes, mean.members, several[0].members) == (several[0].sizes, 3, 1)
    np.testing.assert_allclose(mean(x), np.mean([network(x) for network in several], axis=0), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(mean(x[:1]), mean(x)[:1])
    np.testing.assert_array_equal(network_from(mean.arrays("a"), "a")(x), mean(x))
    h = np.array([1e-5, 0])
    step = mean(x[:3] + 1e-30j * np.eye(2)[0]).imag / 1e-30
    np.testing.assert_allclose(step, (mean(x[:3] + h) - mean(x[:3] - h)) / 2e-5, rtol=1e-5, atol=1e-8)
    assert mean_network(several[:1]) is several[0]
    other = train_network(x, least_squares(wave(x)), (7, 2), steps=2, rng=rng)
    with pytest.raises(ValueError, match=r"networks of .* have no mean"):
        mean_network([several[0], other])
    elsewhere = train_network(x + 1, least_squares(wave(x)), (8, 6, 2), steps=2, rng=rng)
    with pytest.raises(ValueError, match="by different centres or widths have no mean"):
        mean_network([several[0], elsewhere])


def test_training_goes_on_from_a_network_and_not_from_one_of_other_sizes() -> None:
    x = np.random.default_rng(1).uniform(-1, 1, size=(400, 3))
    first = train_network(x, least_squares(wave(x)), (16, 2), steps=600, rng=np.random.default_rng(2))
    second = train_network(x, least_squares(wave(x)), (16, 2), steps=600, rng=np.random.default_rng(3), start=first)
    before, after = (np.sqrt(np.mean((n(x) - wave(x)) ** 2)) for n in (first, second))
    assert after < before
    with pytest.raises(ValueError, match=r"layers of \(3, 16, 2\), wanted are \(3, 8, 2\)"):
        train_network(x, least_squares(wave(x)), (8, 2), steps=1, rng=np.random.default_rng(2), start=first)
