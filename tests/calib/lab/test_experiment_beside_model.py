"""A column of the experiment beside one of a model or a fit: which is read, and what is advised where none is sure."""

from pathlib import Path

import numpy as np
import pytest

import calib
from calib.lab import LabTable, Reading

N = 60
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))
MODEL = 6.0 * DEPTH**1.5


def _read(folder: Path, header: str, *columns: np.ndarray, **said: str) -> LabTable:
    path = folder / "press.csv"
    rows = [",".join(f"{column[k]:.4f}" for column in columns) for k in range(N)]
    path.write_text("\n".join([header, *rows, ""]))
    return calib.read_lab_file(path, Reading(columns=said))


@pytest.mark.parametrize(
    "name",
    ["Force exp (N)", "F_exp (N)", "Force (exp.) [N]", "exp. force (N)", "Force_exp_N", "F_exp/N"],
)
def test_exp_beside_a_force_and_its_unit_is_the_experiment_and_that_is_told(tmp_path: Path, name: str) -> None:
    model = name.replace("exp", "model")
    for header, columns in (
        (f"Displacement (mm),{model},{name}", (DEPTH, MODEL, FORCE)),
        (f"Displacement (mm),{name}", (DEPTH, FORCE)),
    ):
        table = _read(tmp_path, header, *columns)
        np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
        assert any('"exp" is read as of the experiment' in note for note in table.notes)
    table = _read(tmp_path, f"Displacement (mm),{model},{name}", DEPTH, MODEL, FORCE, force=name)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize("name", ["Experimental force (N)", "Force experimental [N]", "Kraft experimentell [N]"])
def test_a_word_for_the_experiment_leaves_a_force_what_it_is(tmp_path: Path, name: str) -> None:
    table = _read(tmp_path, f"Displacement (mm),Force simulated (N),{name}", DEPTH, MODEL, FORCE)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize("name", ["exp(F)", "exp(F) (N)", "Force exp (V)", "Force exp max (N)", "Exp (N)", "F*exp(-t) (N)"])
def test_an_exponential_a_statistic_or_another_unit_is_no_force(tmp_path: Path, name: str) -> None:
    with pytest.raises(calib.InputError, match="no force column"):
        _read(tmp_path, f"Displacement (mm),{name}", DEPTH, FORCE)


@pytest.mark.parametrize("name", ["Exp time (s)", "Exp. time (ms)", "time exp (s)"])
def test_the_exposure_of_a_camera_is_no_time(tmp_path: Path, name: str) -> None:
    table = _read(tmp_path, f"{name},Displacement (mm),Force (N)", np.arange(N) * 0.1, DEPTH, FORCE)
    assert "time" not in table.columns


def test_the_advice_for_a_column_of_a_model_names_the_others_in_its_unit(tmp_path: Path) -> None:
    with pytest.raises(calib.InputError, match="what is model is no record") as refused:
        _read(tmp_path, "Displacement (mm),Force model (N),Krag 2 (N),Rest (V)", DEPTH, MODEL, FORCE, DEPTH)
    assert '"force=Force model (N)"; if another is: --columns "force=Krag 2 (N)"' in str(refused.value)
    table = _read(tmp_path, "Displacement (mm),Force model (N),Krag 2 (N)", DEPTH, MODEL, FORCE, force="Krag 2 (N)")
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


def test_two_forces_of_which_one_may_be_expected_are_asked_about(tmp_path: Path) -> None:
    with pytest.raises(calib.InputError, match="columns may be the force"):
        _read(tmp_path, "Displacement (mm),Force (N),Force exp (N)", DEPTH, MODEL, FORCE)
