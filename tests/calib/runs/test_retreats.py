"""What the lab files of a run say of unloading: those that are as they were are read again, others are named."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib.experiment import read_experiment, read_sweeps
from calib.lab import SHARES, Unloading
from calib.runs.retreats import retreats_of
from calib.sampling import Posterior

SHIPPED = Path(__file__).parents[3] / "datasets" / "padded_sensor"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The lab files of the shipped experiment."""
    place = tmp_path_factory.mktemp("lab")
    for path in (*SHIPPED.glob("*.csv"), SHIPPED / "experiment.toml"):
        shutil.copy(path, place)
    return place


@pytest.fixture(scope="module")
def posterior(folder: Path, make_posterior: Callable[..., Posterior]) -> Posterior:
    """Of the shipped experiment, whose clocks are tied as its files say."""
    experiment = read_experiment(folder / "experiment.toml")
    made = make_posterior()
    facts = replace(made.diagnostics, parameters={})
    return replace(made, experiment=experiment, sweeps=read_sweeps(experiment), diagnostics=facts, fixed={})


def test_lab_files_tell_the_hysteresis_that_they_were_made_with(posterior: Posterior) -> None:
    found = retreats_of(posterior)
    assert list(found) == ["sensor 1", "sensor 2"]
    for (one,) in found.values():
        assert isinstance(one, Unloading)
        # 7 % less force and 1.5 % of the change more halfway down are 2 to 6 % of the largest force at the same reading.
        half = (SHARES > 0.4) & (SHARES < 0.7)
        assert np.all((one.off[half] < -0.02 * one.peak) & (one.off[half] > -0.06 * one.peak))
        assert one.hold == pytest.approx(2.0, abs=0.2)


def test_files_that_are_gone_or_were_changed_are_named_and_not_read(posterior: Posterior, folder: Path) -> None:
    changed, gone = folder / "sensor1_lcr.csv", folder / "sensor2_instron.csv"
    kept = changed.read_bytes(), gone.read_bytes()
    changed.write_bytes(kept[0] + b"\n")
    gone.unlink()
    assert retreats_of(posterior) == {
        "sensor 1": ["sensor1_lcr.csv is no longer what it was at the calibration"],
        "sensor 2": ["sensor2_instron.csv is no longer where it was at the calibration"],
    }
    changed.write_bytes(kept[0])
    gone.write_bytes(kept[1])
