"""What an experiment file says of a lab file and of the part of a press that is used, with a fault where it is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from calib.errors import InputError
from calib.experiment.experiment_file import experiment_from, read_experiment
from calib.experiment.plan import Experiment
from calib.experiment.record import experiment_from_json, experiment_to_json
from calib.experiment.sweeps import read_sweeps
from calib.lab import Reading, Use

HEAD = """\
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[[specimens]]
name = "s"
{}
[specimens.priors]
sensor_thickness = {{ normal = ["0.74 mm", "0.02 mm"] }}
padding_thickness = {{ normal = ["1.10 mm", "0.03 mm"] }}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    x = [i / 200 - 0.2 for i in range(200)]
    x = [*x, *x[::-1]] * 3
    rows = "".join(f"{v:.4f},{5 * max(v, 0) ** 1.8:.5f}\n" for v in x)
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("Extension (mm),Load (N)\n" + rows)
    return tmp_path


def read(folder: Path, text: str) -> Experiment:
    (folder / "e.toml").write_text(HEAD.format(text))
    return read_experiment(folder / "e.toml")


def faults(folder: Path, text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        read(folder, text)
    return [str(fault) for fault in caught.value.faults]


SAID = """\
force = { file = "a.csv", units = { force = "kN" }, columns = { force = 3 }, specimen = 2, where = { "Frequency (Hz)" = 1000, \
Range = "2" }, sheet = "Test 1", sign = { force = "compression negative" }, scale = "micro", decimal = "," }
use = { max_force = "500 mN", max_depth = "0.8 mm", branch = "unloading", cycles = [3, 2] }\
"""


def test_all_that_may_be_said_of_a_file_and_of_its_use_is_read_and_kept(folder: Path) -> None:
    plan = read(folder, SAID)
    sweep = plan.specimens[0].sweeps[0]
    assert sweep.force_reading == Reading(
        units={"force": "kN"},
        columns={"force": "3"},
        specimen=2,
        where={"Frequency (Hz)": "1000", "Range": "2"},
        sheet="Test 1",
        sign={"force": "compression negative"},
        scale="micro",
        decimal=",",
    )
    assert sweep.use == Use(0.5, 0.8e-3, "unloading", (2, 3))
    assert experiment_from_json(experiment_to_json(plan)) == plan


def test_one_sign_is_of_both_quantities(folder: Path) -> None:
    plan = read(folder, 'force = { file = "a.csv", sign = "compression positive" }')
    both = {"force": "compression positive", "displacement": "compression positive"}
    assert plan.specimens[0].sweeps[0].force_reading.sign == both


def test_the_same_may_be_said_in_python(folder: Path) -> None:
    priors = {"sensor_thickness": {"fixed": "0.74 mm"}, "padding_thickness": {"fixed": "1.1 mm"}}
    specimen = {"name": "s", "force": "a.csv", "use": {"cycles": (2,), "max_force": "2 N"}, "priors": priors}
    tables = {"indenter": {"radius": "5 mm"}, "sensor": {"radius": "10 mm"}, "specimens": [specimen]}
    assert experiment_from(tables, folder).specimens[0].sweeps[0].use == Use(max_force=2.0, cycles=(2,))


@pytest.mark.parametrize(
    ("text", "message", "advice"),
    [
        ('force = { file = "a.csv", where = "1000" }', 'where must be a table of column = value, got "1000"', "Frequency (Hz)"),
        ('force = { file = "a.csv", where = { } }', "where must be a table of column = value, got an empty table", "where ="),
        ('force = { file = "a.csv", where = { Range = true } }', '"Range" must be a text or a number, got true', "where ="),
        ('force = { file = "a.csv", sheet = 2 }', "sheet must be a text in quotes, got 2", ""),
        (
            'force = { file = "a.csv", sign = "negative" }',
            '"compression positive" or "compression negative", got "negative"',
            "",
        ),
        ('force = { file = "a.csv", sign = { force = "up" } }', "force must be", ""),
        ('force = { file = "a.csv", sign = { load = "compression positive" } }', 'unknown key "load"', ""),
        ('force = { file = "a.csv", scale = "nano" }', 'scale must be "micro", got "nano"', ""),
        ('force = { file = "a.csv", decimal = ";" }', 'decimal must be "." or ",", got ";"', ""),
        ('force = "a.csv"\nuse = { max_force = 5 }', "max_force must be a quantity with its unit, got 5", '"5 N"'),
        ('force = "a.csv"\nuse = { max_depth = "-1 mm" }', "max_depth must be positive", '"0.8 mm"'),
        ('force = "a.csv"\nuse = { branch = "down" }', 'branch must be "loading" or "unloading"', ""),
        ('force = "a.csv"\nuse = { cycles = 2 }', "cycles must be a list", "[2, 3]"),
        ('force = "a.csv"\nuse = { cycle = [2] }', 'unknown key "cycle" in [specimens.use]', "cycles = [2]"),
        ('force = "a.csv"\nuse = "loading"', "must be a table", ""),
        (
            'force = { file = "a.csv", cycle = 2 }',
            'unknown key "cycle"',
            "beside the files of the sweep, as use = { cycles = [2] }",
        ),
        ('force = "a.csv"\nmax_depth = "1 mm"', 'unknown key "max_depth"', "use = { max_depth ="),
    ],
)
def test_a_fault_is_told_with_its_line_and_what_to_write(folder: Path, text: str, message: str, advice: str) -> None:
    found = faults(folder, text)
    assert len(found) == 1
    assert message in found[0]
    assert advice in found[0]
    assert f"e.toml:{7 + text.count(chr(10))}:" in found[0]


SWEEPS = """\
[[specimens.sweeps]]
force = "a.csv"
use = {{ {} }}
[[specimens.sweeps]]
force = {}
use = {{ {} }}\
"""


@pytest.mark.parametrize(
    ("one", "file", "other", "twice"),
    [
        ("cycles = [1]", '"a.csv"', "cycles = [2, 3]", False),
        ("cycles = [1, 2]", '"a.csv"', "cycles = [2, 3]", True),
        ('max_force = "1 N"', '"a.csv"', "cycles = [1]", True),
        ('branch = "unloading"', '"a.csv"', 'branch = "loading"', False),
        ("cycles = [1]", '"b.csv"', "cycles = [1]", False),
        ("cycles = [1]", '{ file = "a.csv", specimen = 2 }', "cycles = [1]", False),
        ("cycles = [1]", '{ file = "a.csv", where = { Channel = 2 } }', "cycles = [1]", False),
        ("cycles = [1]", '{ file = "a.csv", decimal = "." }', "cycles = [1]", True),
    ],
)
def test_cycles_of_one_file_that_overlap_are_the_same_data_twice(
    folder: Path, one: str, file: str, other: str, twice: bool
) -> None:
    text = SWEEPS.format(one, file, other)
    if twice:
        assert 'a.csv is used twice, it already belongs to specimen "s", sweep "sweep 1"' in faults(folder, text)[0]
    else:
        assert len(read(folder, text).specimens[0].sweeps) == 2


def test_the_sweeps_of_an_experiment_hold_the_part_that_is_used(folder: Path) -> None:
    whole, part = (
        read_sweeps(read(folder, f'force = "a.csv"\n{use}'))[0] for use in ("", 'use = { max_force = "1 N", cycles = [3] }')
    )
    assert max(whole.channels["force"].value) > 3
    assert 0.9 < max(part.channels["force"].value) <= 1
    assert any("cycle 3 is used" in note for note in part.notes)
