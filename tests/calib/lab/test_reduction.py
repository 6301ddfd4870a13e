"""The stated sd of the points against their scatter about the truth, for readings with all kinds of errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from calib.lab.onset import coarse_onset
from calib.lab.pressing import make_sweep
from calib.lab.reduction import NoiseEstimate, Reduced, fresh_readings, reduce_channel
from models.sensor import FloatArray

NOISE = 5e-3  # [N]
ROWS = 3000


def truth(x: FloatArray) -> FloatArray:
    return np.asarray(5 * (np.maximum(x - 0.22, 0) / 0.78) ** 1.8 + 0.31)


def readings(kind: str, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Displacement and force of a branch whose errors have the sd `NOISE`."""
    x = np.linspace(0, 1, ROWS)
    name, _, number = kind.partition(" ")
    value = float(number or 0)
    white = rng.normal(size=ROWS + 500)
    if name == "autoregressive":
        error = lfilter([np.sqrt(1 - value**2)], [1, -value], white)
    elif name == "averaged":
        error = lfilter(np.full(int(value), 1 / np.sqrt(value)), [1], white)
    elif name == "low-passed":  # two poles
        error = lfilter([np.sqrt((1 - value**2) ** 3 / (1 + value**2))], [1, -2 * value, value**2], white)
    else:
        error = white
    y = truth(x) + NOISE * error[500:]
    if name == "repeated":
        y = y[np.arange(ROWS) // int(value) * int(value)]
    if name == "coarse":
        y = np.round(y / (value * NOISE)) * value * NOISE
    return x, y


def reduced(kind: str, seed: int) -> Reduced:
    x, y = readings(kind, np.random.default_rng(seed))
    return reduce_channel(x, y, 40, coarse_onset(x, y))


@pytest.mark.parametrize(
    ("kind", "tau"),
    [
        ("white", 1.0),
        ("autoregressive 0.5", 3.0),
        ("autoregressive 0.9", 19.0),
        ("averaged 5", 5.0),
        ("averaged 20", 20.0),
        ("low-passed 0.8", 19.0),
        ("repeated 2", 1.0),
        ("repeated 5", 1.0),
        ("repeated 20", 1.0),
        ("coarse 0.2", 1.0),
        ("coarse 1", 1.0),
        ("coarse 3", 1.0),
    ],
)
def test_points_scatter_about_the_truth_as_stated(kind: str, tau: float) -> None:
    scores, noises, times = [], [], []
    for seed in range(12):
        r = reduced(kind, seed)
        scores.append((r.value - truth(r.abscissa)) / (r.noise / np.sqrt(r.n_effective)))
        noises.append(r.noise)
        times.append(r.estimate.correlation)
        assert 12 <= r.value.size <= 40
    # 480 points: their root mean square is known to 4 %, somewhat worse where they hang together.
    assert 0.7 < np.sqrt(np.mean(np.concatenate(scores) ** 2)) < 1.15
    assert np.mean(times) == pytest.approx(tau, rel=0.35, abs=0.2)
    assert 0.9 * NOISE < np.mean(noises) < (1.4 if kind == "coarse 3" else 1.15) * NOISE


def on_padding(x: FloatArray) -> FloatArray:
    """Force of finite elements on a padding, to 0.02 %: its rise begins so slowly that the coarse onset is two bins early."""
    w = np.maximum(x - 0.25, 0.0) / 0.75
    return np.asarray(5 * sum(a * w**p for p, a in {1.5: 0.278, 2.0: 0.011, 2.5: 1.116, 3.0: -0.405}.items()) + 0.3)


def scores_near_contact(force: Callable[[FloatArray], FloatArray], noise: float, begin: float, n_seed: int) -> FloatArray:
    """How far points from `begin` on to just behind a contact at 0.25 are off, in their stated sds, of presses with noise."""
    x = np.linspace(0, 1, 1260)
    scores = []
    for seed in range(n_seed):
        y = force(x) + noise * np.random.default_rng(seed).normal(size=x.size)
        r = reduce_channel(x, y, 40, coarse_onset(x, y))
        near = (r.abscissa > begin) & (r.abscissa < 0.28)
        scores.append(((r.value - force(r.abscissa)) / (noise / np.sqrt(r.n_effective)))[near])
    return np.concatenate(scores)


def test_points_next_to_contact_scatter_as_stated_where_force_begins_as_on_a_padding() -> None:
    scores = scores_near_contact(on_padding, NOISE, 0.20, 160)
    # 480 points: the mean of their squares is known to 6 %. A smooth that follows their noise makes it 1.24.
    assert np.mean(scores**2) < 1.12


def test_points_of_wide_bins_scatter_as_stated_though_their_own_noise_looks_like_bend() -> None:
    x = np.linspace(0, 1, 400)
    scores = []
    for seed in range(300):
        r = reduce_channel(x, on_padding(x) + NOISE * np.random.default_rng(seed).normal(size=x.size), 12, 0.25)
        scores.append((r.value - on_padding(r.abscissa)) / (NOISE / np.sqrt(r.n_effective)))
    squares = np.mean(np.square(scores), axis=0)
    # Means of readings less a bend that is taken for known make it 1.2, and 1.7 in the worst bin; 300 curves tell 1 to 8 %.
    assert squares.mean() == pytest.approx(1.0, abs=0.06)
    assert squares.max() < 1.35


def gently(w: FloatArray) -> FloatArray:
    """Twice as stiff at the end, and 1 % more and less on the way."""
    return (1 + w**4) * (1 + 0.01 * np.sin(6 * w))


def suddenly(w: FloatArray) -> FloatArray:
    """Twice as stiff from two thirds of the press on, and 2 % more and less on the way."""
    return (1 + 1 / (1 + np.exp(-12 * (w - 0.66)))) * (1 + 0.02 * np.sin(6 * w))


@pytest.mark.parametrize("stiffens", [gently, suddenly])
def test_quiet_points_next_to_contact_scatter_as_stated_where_the_force_goes_up_by_no_power_of_depth(
    stiffens: Callable[[FloatArray], FloatArray],
) -> None:
    def force(at: FloatArray) -> FloatArray:
        w = np.maximum(at - 0.25, 0.0) / 0.75
        return np.asarray(3 * w**1.5 * stiffens(w))

    scores = scores_near_contact(force, 1e-3, 0.22, 80)
    # An onset that the whole press tells makes it 13 in one, one that always the same part of it tells 6 in the other.
    assert np.mean(scores**2) < (2.2 if stiffens is suddenly else 1.3)


@pytest.mark.parametrize("noise", [3e-4, 1e-3])
@pytest.mark.parametrize("late", [-0.05, 0.0, 0.04])
def test_quiet_readings_do_not_hang_together_where_contact_is_looked_for_in_the_wrong_place(noise: float, late: float) -> None:
    x = np.linspace(0, 1, 1260)
    for seed in range(4):
        y = on_padding(x) + noise * np.random.default_rng(seed).normal(size=x.size)
        found = reduce_channel(x, y, 40, coarse_onset(x, y) + late).estimate
        assert found.correlation < 1.5
        assert found.noise == pytest.approx(noise, rel=0.08)


def test_a_meter_slower_than_its_logger_is_seen_and_a_coarse_or_flat_channel_is_not_taken_for_one() -> None:
    rng = np.random.default_rng(1)
    x = np.linspace(0, 1, 600)
    slow = (3 * x + rng.normal(0, 0.01, 600)).round(4)
    np.testing.assert_array_equal(np.flatnonzero(fresh_readings(np.repeat(slow[::4], 4))), np.arange(0, 600, 4))
    assert fresh_readings(slow).all()
    assert fresh_readings(np.round(slow, 1)).all()
    assert fresh_readings(np.round(3 * x, 1)).all()
    assert fresh_readings(np.maximum(slow - 1, 0.0)).all()
    # 15 rows a second of 10 readings a second: one or two rows each.
    held = slow[np.floor(np.arange(600) / 1.5).astype(int)]
    assert fresh_readings(held).sum() == 400
    assert reduced("repeated 5", 0).estimate.repeat == pytest.approx(5)


def test_an_outlier_is_counted_and_moves_no_estimate() -> None:
    x, y = readings("white", np.random.default_rng(4))
    spoilt = y.copy()
    spoilt[[500, 1700]] += 0.2
    onset = coarse_onset(x, y)
    clean, dirty = (reduce_channel(x, v, 40, onset).estimate for v in (y, spoilt))
    assert (clean.outliers, dirty.outliers) == (0, 2)
    assert dirty.noise == pytest.approx(clean.noise, rel=0.05)
    assert dirty.correlation == pytest.approx(clean.correlation, abs=0.3)


def test_the_sweep_keeps_noise_correlation_and_resolution_as_numbers(tmp_path: Path) -> None:
    x, y = readings("white", np.random.default_rng(2))
    text = "".join(f"{a:.5f},{b:.3f}\n" for a, b in zip(x, y, strict=True))
    (tmp_path / "t.csv").write_text("Extension (mm),Load (N)\n" + text)
    sweep = make_sweep("s", "", 5e-3, tmp_path / "t.csv", None)
    found = sweep.readings["force"]
    assert isinstance(found, NoiseEstimate)
    assert "capacitance" not in sweep.readings
    assert sweep.noise["force"] == found.noise == pytest.approx(NOISE, rel=0.1)
    assert found.resolution == pytest.approx(1e-3)
    assert found.correlation == pytest.approx(1, abs=0.2)
    assert (found.n_row, found.n_reading, found.n_point, found.repeat) == (ROWS, ROWS, 40, 1.0)


def test_readings_written_several_times_count_once_in_a_file_tied_by_force(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    x = np.linspace(0, 1, ROWS)
    f = truth(x) + rng.normal(0, NOISE, ROWS)
    c = (97 + 0.5 * (truth(x) - 0.31) + rng.normal(0, 5e-3, ROWS))[np.arange(ROWS) // 5 * 5]
    rows = "".join(f"{b:.3f},{d:.4f}\n" for b, d in zip(f, c, strict=True))
    (tmp_path / "c.csv").write_text("Force (N),Cp (pF)\n" + rows)
    sweep = make_sweep("s", "", 5e-3, None, tmp_path / "c.csv")
    assert "capacitance" in sweep.readings
    assert sweep.readings["capacitance"].repeat == pytest.approx(5, rel=0.01)
    assert sweep.noise["capacitance"] == pytest.approx(5e-15, rel=0.15)
    points = sweep.channels["capacitance"]
    assert points.force is not None
    deep = points.force > 0.5
    error = points.value[deep] * 1e12 - 97 - 0.5 * (points.force[deep] - 0.31)
    score = error / (5e-3 / np.sqrt(points.n_effective[deep]))
    assert 0.6 < np.sqrt(np.mean(score**2)) < 1.3
