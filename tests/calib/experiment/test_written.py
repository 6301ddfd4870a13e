"""An experiment written as a file, and a bench read from one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from calib.errors import Fault, InputError
from calib.experiment import Bench, experiment_toml, prior_toml, read_bench, read_experiment
from calib.priors import Fixed, HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform, parse_prior

EVERYTHING = """
name = 'A "padded" sensor'
model = "surrogate"
discrepancy = "off"
candidates = ["one-silicone"]
pooling = "partial"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
law = "gent"
electrode_radius = "9.7 mm"
[padding]
material = "own"
[priors]
young_modulus = { lognormal = ["0.7 MPa", 1.6] }
padding_young_modulus = { lognormal = ["0.3 MPa", 1.4] }
stiffening = { uniform = [0, 0.1] }
machine_compliance = { truncated_normal = ["3 um/N", "1 um/N", "0 um/N", "9 um/N"] }
force_gain = { normal = [1, 0.0025] }
[[specimens]]
name = "a"
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { fixed = "0 mm" }
contact_offset = { uniform = ["0.1 mm", "0.3 mm"] }
[[specimens.sweeps]]
name = "large ball"
force = { file = "a.csv", units = { force = "kN" }, columns = { force = "Load 2" }, specimen = 2 }
capacitance = "b.csv"
use = { max_force = "4.5 N", cycles = [2, 3] }
[[specimens.sweeps]]
name = "small ball"
indenter_radius = "3 mm"
force = "c.csv"
use = { max_depth = "0.4 mm", branch = "unloading" }
[[specimens]]
name = "b"
force = "d.csv"
[specimens.priors]
sensor_thickness = { normal = ["0.75 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.1 mm", "0.03 mm"] }
"""


def test_experiment_that_is_written_is_read_as_it_was(tmp_path: Path) -> None:
    for name in "abcd":
        (tmp_path / f"{name}.csv").write_text(name, encoding="utf-8")
    path = tmp_path / "experiment.toml"
    path.write_text(EVERYTHING, encoding="utf-8")
    experiment = read_experiment(path)
    path.write_text(experiment_toml(experiment, tmp_path, {}, ["A file.", ""]), encoding="utf-8")
    assert replace(read_experiment(path), sha256="") == replace(experiment, sha256="")


def test_notes_of_a_written_experiment_are_told_as_not_edited_until_they_are_removed(tmp_path: Path) -> None:
    for name in "abcd":
        (tmp_path / f"{name}.csv").write_text(name, encoding="utf-8")
    path = tmp_path / "experiment.toml"
    path.write_text(EVERYTHING, encoding="utf-8")
    experiment = read_experiment(path)
    notes = {("", "stiffening"): "put this in", ("a", "small ball"): "its file", ("b", "sensor_thickness"): "what you read"}
    text = experiment_toml(experiment, tmp_path, notes)
    path.write_text(text, encoding="utf-8")
    assert [u.what for u in read_experiment(path).unedited] == ["put this in", "its file", "what you read"]
    path.write_text("\n".join(line for line in text.split("\n") if "EDIT" not in line), encoding="utf-8")
    assert not read_experiment(path).unedited


@pytest.mark.parametrize(
    ("parameter", "prior"),
    [
        ("young_modulus", LogNormal(0.7e6, 1.6)),
        ("machine_compliance", HalfNormal(5e-6)),
        ("contact_offset", Uniform(-0.5e-3, 0.5e-3)),
        ("load_zero", TruncatedNormal(0.0, 1.0, -5.0, 5.0)),
        ("sensor_thickness", Fixed(0.74e-3)),
        ("parasitic_capacitance", Normal(0.0, 1e-12)),
    ],
)
def test_prior_that_is_written_is_read_as_it_was(parameter: str, prior: Prior) -> None:
    import tomllib

    assert parse_prior(parameter, tomllib.loads(f"p = {prior_toml(parameter, prior)}")["p"]) == prior


def test_bench_is_read_with_units_and_usual_values_for_the_rest(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(
        'load_cell = "20 N"\nballs = ["1.5 mm"]\npaddings = ["0 mm", "3 mm"]\nwithout = ["specimen"]\n'
        '[minutes]\nball = 30\n[sd]\nsensor_thickness = "3 um"\n',
        encoding="utf-8",
    )
    bench = read_bench(path)
    assert (bench.load_cell, bench.balls, bench.paddings) == (20.0, (1.5e-3,), (0.0, 3e-3))
    assert (bench.time("ball"), bench.time("repeat"), bench.sd("sensor_thickness")) == (30.0, Bench().time("repeat"), 3e-6)
    assert bench.without == {"specimen"}


def test_all_faults_of_a_bench_are_told_with_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(
        'load_cell = "-20 N"\nballs = "1.5 mm"\nwithout = ["magic"]\nbal = 1\n'
        '[minutes]\nball = 0\nrepaet = 5\n[sd]\nsensor_thickness = "0 um"\nforce_gain = "x"\n',
        encoding="utf-8",
    )
    with pytest.raises(InputError) as refused:
        read_bench(path)
    said = {fault.line: str(fault) for fault in refused.value.faults}
    assert sorted(line for line in said if line) == [1, 2, 3, 4, 6, 7, 9, 10]
    assert 'Did you mean "repeat"?' in said[7]
    assert 'Write balls = ["1.5 mm", "5 mm"]' in said[2]


def _only_fault(text: str, folder: Path) -> Fault:
    """The one fault of a bench file."""
    path = folder / "bench.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_bench(path)
    (fault,) = refused.value.faults
    return fault


@pytest.mark.parametrize(
    ("written", "told"),
    [
        ('sensor_thickness = "3 nm"', '"3 nm", and 0.008 mm is usual, 2,667 times as much'),
        ('padding_thickness = "10 mm"', '"10 mm", and 0.01 mm is usual, 1,000 times as little'),
    ],
)
def test_an_sd_that_only_a_slip_of_the_unit_explains_is_refused(written: str, told: str, tmp_path: Path) -> None:
    fault = _only_fault(f"[sd]\n{written}\n", tmp_path)
    assert (fault.line, fault.advice) == (2, "Check its unit")
    assert told in fault.message


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ("10 mm", 'unit "mm" cannot be converted to N'),
        ("1e6 N", "a force that a tester bears"),
        ("0 N", "a force that a tester"),
    ],
)
def test_a_load_cell_that_is_none_is_refused_by_its_own_name(cell: str, told: str, tmp_path: Path) -> None:
    fault = _only_fault(f'load_cell = "{cell}"\n', tmp_path)
    assert fault.message.startswith("load_cell")
    assert told in fault.message
    assert fault.advice == 'Write load_cell = "10 N"'
