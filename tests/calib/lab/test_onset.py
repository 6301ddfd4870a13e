"""The estimators of the onset of contact on curves whose onset is known: how far each is off, and what each says of none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from calib.lab.instruments.reader import read_lab_file
from calib.lab.observations import observe, usable_rows
from calib.lab.onset import coarse_onset, departure, fine_onset, flat_part, hertz_onset, level_before_contact
from models.sensor import FloatArray

DATA = Path(__file__).parents[3] / "datasets" / "padded_sensor"
CONTACT, DEPTH, RANGE, NOISE = 0.2e-3, 0.7e-3, 5.0, 5e-3


def press(power: float, contact: float = CONTACT, n: int = 600, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Crosshead reading [m] from zero and force [N] of a power of the depth, with a load zero of 0.31 N."""
    x = np.linspace(0.0, contact + DEPTH, n)
    force = 0.31 + RANGE * (np.maximum(x - contact, 0.0) / DEPTH) ** power
    return x, force + np.random.default_rng(seed).normal(0, NOISE, n)


@pytest.mark.parametrize("power", [1.5, 1.8, 2.1])
def test_coarse_and_fine_onset_of_a_power_law(power: float) -> None:
    x, force = press(power)
    assert coarse_onset(x, force) == pytest.approx(CONTACT, abs=25e-6)
    found = fine_onset(x, force)
    assert found is not None
    assert found[0] == pytest.approx(CONTACT, abs=3 * found[1])
    assert 0 < found[1] < 10e-6


def test_the_stated_sd_of_the_fine_onset_is_its_error() -> None:
    scores = []
    for seed in range(60):
        x, force = press(np.random.default_rng(seed).uniform(1.5, 2.1), seed=seed)
        found = fine_onset(x, force)
        assert found is not None
        scores.append((found[0] - CONTACT) / found[1])
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.4


@pytest.mark.parametrize(("name", "sensor"), [("sensor1_instron.csv", "sensor 1"), ("sensor2_instron.csv", "sensor 2")])
def test_fine_is_right_where_coarse_is_off_by_some_tens_of_micrometres(name: str, sensor: str) -> None:
    known = json.loads((DATA / "truth.json").read_text())
    # Where the crosshead stands at first touch: the frame gives way by the load zero, too.
    truth = known[sensor]["contact_offset"] + known["shared"]["machine_compliance"] * known[sensor]["load_zero"]
    obs = observe(read_lab_file(DATA / name))
    assert obs.displacement is not None
    assert obs.force is not None
    rows = usable_rows(obs, obs.displacement, obs.force, "force")
    x, force = obs.displacement[rows], obs.force[rows]
    found = fine_onset(x, force)
    assert found is not None
    assert found[0] == pytest.approx(truth, abs=3 * found[1])
    assert coarse_onset(x, force) == pytest.approx(truth, abs=50e-6)
    assert float(np.max(x[flat_part(x, force)])) == pytest.approx(truth, abs=50e-6)


def test_a_record_that_starts_in_contact_has_no_fine_onset_and_no_flat_part() -> None:
    x, force = press(1.5, contact=0.0)
    assert fine_onset(x, force) is None
    assert not np.any(flat_part(x, force))


def test_a_channel_that_does_not_rise_has_no_fine_onset() -> None:
    x = np.linspace(0.0, 1e-3, 100)
    assert fine_onset(x, np.full(100, 0.3)) is None
    assert coarse_onset(x[:5], np.zeros(5)) == 0.0


def test_the_flat_part_ends_at_the_onset() -> None:
    x, force = press(1.8)
    flat = flat_part(x, force)
    assert float(np.max(x[flat])) == pytest.approx(CONTACT, abs=15e-6)
    assert np.array_equal(flat, np.arange(x.size) < np.sum(flat))


def test_a_departure_is_found_on_any_abscissa() -> None:
    # As between two clocks: the offset that puts the rise of one record where the other one's is.
    time = np.linspace(0.0, 6.5, 400)
    y = (np.maximum(time - 4.0, 0.0) / 5) ** 1.7 + np.random.default_rng(3).normal(0, 1e-3, 400)
    found = departure(lambda g: (time + g - 9.0) / 5, y, 1e-3, 2.0, 7.0)
    assert found is not None
    assert found[0] == pytest.approx(5.0, abs=3 * found[1])
    assert found[1] < 0.05


def test_the_points_of_a_sweep_tell_level_and_onset_for_a_prior() -> None:
    x = np.linspace(0.0, CONTACT + DEPTH, 40)
    force = 0.31 + RANGE * (np.maximum(x - CONTACT, 0.0) / DEPTH) ** 1.5
    level = level_before_contact(x, force, np.full(40, 1e-3))
    assert level == pytest.approx(0.31, abs=1e-3)
    assert hertz_onset(x, force - level) == pytest.approx(CONTACT, abs=1e-6)


def test_points_that_start_in_contact_have_no_level() -> None:
    x = np.linspace(0.0, 1e-3, 40)
    assert np.isnan(level_before_contact(x, 5 * x, np.zeros(40)))


def test_the_hertz_onset_stays_near_the_points() -> None:
    x = np.linspace(0.0, 1e-3, 40)
    assert hertz_onset(x, 1 + 1e-3 * x) == -0.5e-3
    assert hertz_onset(x, np.zeros(40)) == 0.0
