"""The folder of a proof: made one by one, gone on with, taken for no other; what is damaged is refused or made again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Executor
from pathlib import Path

import numpy as np
import pytest
from small_run import make_lab, quick
from typer.testing import CliRunner

from calib.checks import LIKELIHOOD, Replicate, ReplicateSetting
from calib.checks.proof.replicate import Place
from calib.cli import app
from calib.errors import InputError
from calib.runs.proof import PICTURE, PROOF, REPLICATES, prove
from calib.workers import workers

DATA = Path(__file__).parents[3] / "datasets" / "padded_sensor"

EXPERIMENT = f"""
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[priors]
young_modulus = {{ lognormal = ["0.7 MPa", 1.6] }}
[[specimens]]
name = "a"
force = "{(DATA / "sensor1_instron.csv").as_posix()}"
[specimens.priors]
sensor_thickness = {{ normal = ["0.74 mm", "0.02 mm"] }}
padding_thickness = {{ normal = ["1.10 mm", "0.03 mm"] }}
"""


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    path = tmp_path / "experiment.toml"
    path.write_text(EXPERIMENT, encoding="utf-8")
    return path


@pytest.fixture
def executor() -> Iterator[Executor]:
    with workers(0) as found:
        yield found


def _uniform(setting: ReplicateSetting, number: int) -> Replicate:
    """A replicate whose ranks are spread evenly, without a calibration."""
    rank = (number * 0.618 + 0.5) % 1.0
    place = Place(1.0, rank, 0.05 <= rank <= 0.95, 0.0)
    return Replicate(number, "done", "", {"young_modulus": place, LIKELIHOOD: place}, 2.0)


def _never(setting: ReplicateSetting, number: int) -> Replicate:
    raise AssertionError("nothing was to be made")


def _stopped(setting: ReplicateSetting, number: int) -> Replicate:
    if number == 3:
        raise KeyboardInterrupt
    return _uniform(setting, number)


def test_a_proof_is_written_with_its_picture_and_gone_on_with(experiment: Path, tmp_path: Path, executor: Executor) -> None:
    folder = tmp_path / "proof"
    told: list[tuple[int, int]] = []
    prove(experiment, folder, executor, replicates=5, seed=1, replicate=_uniform)
    proof = prove(
        experiment,
        folder,
        executor,
        replicates=8,
        seed=1,
        replicate=_uniform,
        progress=lambda done, of: told.append((done, of)),
    )
    assert told == [(5, 8), (6, 8), (7, 8), (8, 8)]
    assert [replicate.number for replicate in proof.replicates] == [*range(8)]
    kept = json.loads((folder / PROOF).read_text(encoding="utf-8"))
    assert kept["replicates"] == 8
    assert kept["verdict"]["colour"] == "amber"  # so few
    assert kept["quantities"]["young_modulus"]["n"] == 8
    assert (folder / PICTURE).stat().st_size > 10_000
    fewer = prove(experiment, folder, executor, replicates=3, seed=1, replicate=_never)
    assert len(fewer.replicates) == 3
    assert len((folder / REPLICATES).read_text(encoding="utf-8").splitlines()) == 1 + 8


def test_stopped_in_the_middle_nothing_is_lost_and_nothing_counted_twice(
    experiment: Path, tmp_path: Path, executor: Executor
) -> None:
    folder = tmp_path / "proof"
    with pytest.raises(KeyboardInterrupt):
        prove(experiment, folder, executor, replicates=6, seed=1, replicate=_stopped)
    path = folder / REPLICATES
    before = path.read_text(encoding="utf-8")
    path.write_text(before + '{"number": 3, "outco', encoding="utf-8")  # as a power cut leaves it
    with workers(0) as again:
        proof = prove(experiment, folder, again, replicates=6, seed=1, replicate=_uniform)
    assert [replicate.number for replicate in proof.replicates] == [*range(6)]
    numbers = [json.loads(line)["number"] for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    assert sorted(numbers) == [*range(6)]


@pytest.mark.parametrize("change", ["seed", "prior", "chains"])
def test_another_proof_in_the_folder_is_refused_by_what_differs(
    experiment: Path, tmp_path: Path, executor: Executor, change: str
) -> None:
    folder = tmp_path / "proof"
    prove(experiment, folder, executor, replicates=2, seed=1, replicate=_uniform)
    if change == "prior":
        experiment.write_text(EXPERIMENT.replace("1.6", "1.7"), encoding="utf-8")
    with pytest.raises(InputError, match="prior of young_modulus" if change == "prior" else change):
        prove(experiment, folder, executor, replicates=2, seed=2 if change == "seed" else 1, chains=change == "chains")


def test_other_things_and_damaged_replicates_are_refused(experiment: Path, tmp_path: Path, executor: Executor) -> None:
    folder = tmp_path / "proof"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="other files"):
        prove(experiment, folder, executor, replicates=2, seed=1, replicate=_never)
    (folder / "notes.txt").rename(folder / REPLICATES)
    with pytest.raises(InputError, match="cannot be read"):
        prove(experiment, folder, executor, replicates=2, seed=1, replicate=_never)


def test_the_command_says_how_long_it_will_take_what_came_of_it_and_when_it_is_red(
    experiment: Path, tmp_path: Path, executor: Executor
) -> None:
    folder = tmp_path / "proof"
    prove(experiment, folder, executor, replicates=4, seed=1, replicate=_uniform)
    lines = (folder / REPLICATES).read_text(encoding="utf-8").splitlines()
    done = CliRunner().invoke(app, ["prove", str(experiment), "-o", str(folder), "--replicates", "4"])
    assert done.exit_code == 0
    assert "Amber" in done.stdout
    assert "young_modulus" in done.stdout
    assert "4 replicates: 4 done" in done.stdout
    strict = CliRunner().invoke(app, ["prove", str(experiment), "-o", str(folder), "--replicates", "4", "--strict"])
    assert strict.exit_code == 3
    # All truths below all draws: as wrong as can be.
    rows = [json.loads(line) for line in lines[1:]]
    off = [{**row, "number": k, "places": {"young_modulus": [1.0, 0.001, False, 5.0]}} for k, row in enumerate(rows * 10)]
    (folder / REPLICATES).write_text("\n".join([lines[0], *map(json.dumps, off)]) + "\n", encoding="utf-8")
    red = CliRunner().invoke(app, ["prove", str(experiment), "-o", str(folder), "--replicates", "40"])
    assert red.exit_code == 3
    assert "too high" in red.stdout


def test_around_takes_the_posterior_of_this_experiment_and_of_no_other(tmp_path: Path, executor: Executor) -> None:
    lab = make_lab(tmp_path) / "experiment.toml"
    run = quick(tmp_path).run
    told: list[ReplicateSetting] = []

    def seen(setting: ReplicateSetting, number: int) -> Replicate:
        told.append(setting)
        return _uniform(setting, number)

    prove(lab, tmp_path / "proof", executor, replicates=1, seed=1, around=run.folder, replicate=seen)
    draws = told[0].draws
    assert draws is not None
    assert np.mean(draws[:, 0]) == pytest.approx(run.posterior.diagnostics.parameters["young_modulus"].mean, rel=0.05)
    with pytest.raises(InputError, match="truths are drawn from"):
        prove(lab, tmp_path / "proof", executor, replicates=1, seed=1, replicate=_never)
    lab.write_text(lab.read_text(encoding="utf-8").replace("1.6", "1.7"), encoding="utf-8")
    with pytest.raises(InputError, match="of another experiment"):
        prove(lab, tmp_path / "other", executor, replicates=1, seed=1, around=run.folder, replicate=_never)


def test_finite_elements_in_the_place_of_the_surrogate_are_refused(
    experiment: Path, tmp_path: Path, executor: Executor
) -> None:
    experiment.write_text('model = "fem"\n' + EXPERIMENT, encoding="utf-8")
    with pytest.raises(InputError, match="weeks"):
        prove(experiment, tmp_path / "proof", executor, replicates=1, seed=1)
    assert not (tmp_path / "proof").exists()
