"""Experiment and design files: what is read, and that everything wrong is said at once, with line and column."""

from __future__ import annotations

import hashlib
import math
import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib.errors import InputError
from calib.experiment.experiment_file import read_experiment
from calib.experiment.plan import Experiment
from calib.experiment.record import experiment_from_json, experiment_to_json
from calib.experiment.toml_places import KeyPath, locate_keys
from calib.experiment.variants import candidates_of, model_in_words, variants_of
from calib.priors.distributions import Fixed, HalfNormal, LogNormal, Normal, TruncatedNormal, Uniform
from calib.problem.unknowns import list_unknowns

GOOD = """\
name = "Padded sensor, two specimens"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[padding]
material = "sensor"               # same silicone: one modulus; "own" frees padding_young_modulus
[priors]                          # material and rig: shared by all specimens
young_modulus = { lognormal = ["0.7 MPa", 1.6] }          # median, geometric sd
relative_permittivity = { normal = [2.8, 0.2] }           # mean, sd
machine_compliance = { halfnormal = "5 um/N" }
parasitic_capacitance = { normal = ["0 pF", "2 pF"] }     # also: uniform = [lo, hi], truncated_normal, fixed = value
[[specimens]]
name = "sensor 1"
force = "sensor1_instron.csv"     # either file may be missing
capacitance = "sensor1_lcr.csv"
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
[[specimens]]
name = "sensor 2"
force = "data/sensor2.csv"
[specimens.priors]
sensor_thickness = { normal = ["0.75 mm", "0.02 mm"] }
padding_thickness = { fixed = "1.10 mm" }
contact_offset = { uniform = ["-0.2 mm", "0.2 mm"] }
"""

SWEEPS = """\
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[[specimens]]
name = "sensor 1"
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
[[specimens.sweeps]]
force = "sensor1_instron.csv"
capacitance = "sensor1_lcr.csv"
[[specimens.sweeps]]
name = "small ball"
force = "small.csv"
indenter_radius = "2.5 mm"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "data").mkdir()
    for name in ("sensor1_instron.csv", "sensor1_lcr.csv", "small.csv", "data/sensor2.csv", "notes.txt"):
        (tmp_path / name).write_text("")
    return tmp_path


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "experiment.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def read(folder: Path, text: str) -> Experiment:
    return read_experiment(write(folder, text))


def faults(folder: Path, text: str | bytes) -> list[str]:
    """What is said of a file, one line per fault, without the folder."""
    with pytest.raises(InputError) as caught:
        read_experiment(write(folder, text))
    assert all(f.line is not None and f.column is not None for f in caught.value.faults)
    return [str(f).removeprefix(f"{folder}{os.sep}") for f in caught.value.faults]


def only_fault(folder: Path, text: str | bytes) -> str:
    (fault,) = faults(folder, text)
    return fault


# --- what is read -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "family"),
    [
        ("[sensor]", "[sensor]", "neo-hookean"),
        ("[sensor]", 'friction_coefficient = "stick"\n[sensor]', "friction"),
        ("[sensor]", 'friction_coefficient = 0\n[sensor]\nlaw = "gent"', "gent"),
    ],
)
def test_law_and_contact_choose_the_family(folder: Path, old: str, new: str, family: str) -> None:
    experiment = read(folder, GOOD.replace(old, new, 1))
    assert experiment.family is not None
    assert experiment.family.name == family
    assert experiment_from_json(experiment_to_json(experiment)) == experiment


def test_stiffening_is_an_unknown_of_gents_law(folder: Path) -> None:
    text = GOOD.replace("[sensor]", '[sensor]\nlaw = "gent"', 1)
    assert "stiffening" in [p.name for p in list_unknowns(read(folder, text), ())[0]]
    assert "stiffening" not in [p.name for p in list_unknowns(read(folder, GOOD), ())[0]]
    known = text.replace("[priors]", "[priors]\nstiffening = { fixed = 0.02 }", 1)
    assert list_unknowns(read(folder, known), ())[1] == {"stiffening": 0.02}


def test_gents_law_with_a_ball_that_sticks_takes_finite_elements(folder: Path) -> None:
    text = GOOD.replace("[sensor]", 'friction_coefficient = "stick"\n[sensor]\nlaw = "gent"', 1)
    assert "no surrogate for all of this together: Gent, sticking, bonded base" in only_fault(folder, text)
    assert read(folder, 'model = "fem"\n' + text).family is None
    for old, new in (("[sensor]", 'friction_coefficient = "stick"\n[sensor]'), ("[sensor]", '[sensor]\nlaw = "gent"')):
        text = 'model = "closed form"\n' + GOOD.replace(old, new, 1)
        assert "the closed form knows neo-Hookean layers" in only_fault(folder, text)


def test_base_friction_and_padding_say_which_surrogate_is_meant(folder: Path) -> None:
    foam = 'material = "foam"\n[priors]\npadding_young_modulus = { lognormal = ["0.1 MPa", 2] }'
    rubbing = GOOD.replace("machine_", "friction_coefficient = { uniform = [0, 0.6] }\nmachine_")
    known = GOOD.replace("[sensor]", "friction_coefficient = 0.3\n[sensor]")
    base_rubs = GOOD.replace("machine_", "base_friction_coefficient = { uniform = [0, 1] }\nmachine_")
    for text, family in (
        (GOOD, "neo-hookean"),
        ('base = "slippery"\n' + GOOD, "slippery"),
        (rubbing, "friction"),
        (known, "friction"),
        ('base = "slippery"\n' + rubbing, "slippery-friction"),
        ('base = "slippery"\n' + base_rubs, "rubbing-base"),
        (re.sub(r'material = "sensor".*\n\[priors\].*', foam, GOOD), "foam"),
    ):
        experiment = read(folder, text)
        assert experiment.family is not None
        assert experiment.family.name == family
        assert experiment_from_json(experiment_to_json(experiment)) == experiment
    assert read(folder, known).priors["friction_coefficient"] == Fixed(0.3)
    assert 'no meaning with base = "bonded", on which nothing slides' in only_fault(folder, base_rubs)
    at_top = 'base_friction_coefficient = 0.3\nbase = "slippery"\n' + GOOD
    assert "It belongs in [priors], shared by all specimens" in only_fault(folder, at_top)
    slides = read(folder, 'model = "fem"\nbase = "slippery"\n' + base_rubs)
    assert model_in_words(slides) == "neo-Hookean, frictionless, slippery base with friction, padding of the same silicone"
    (glued,) = (variant.of(slides) for variant in variants_of(slides) if variant.name == "bonded")
    assert (glued.base, glued.base_rubs) == ("bonded", False)
    for twice in ("0.3", '"stick"'):
        assert "given twice" in only_fault(folder, rubbing.replace("[sensor]", f"friction_coefficient = {twice}\n[sensor]"))
    both = 'base = "slippery"\n' + GOOD.replace("[sensor]", '[sensor]\nlaw = "gent"', 1)
    assert "no surrogate for all of this together: Gent, frictionless, slippery base" in only_fault(folder, both)
    stiffens = re.sub(r'material = "sensor".*\n\[priors\].*', foam, GOOD).replace("[sensor]", '[sensor]\nlaw = "gent"', 1)
    for model in ("surrogate", "fem"):
        assert "a foam is neo-Hookean" in only_fault(folder, f'model = "{model}"\n' + stiffens)


def test_the_documented_form_is_read(folder: Path) -> None:
    experiment = read(folder, GOOD)
    assert experiment.name == "Padded sensor, two specimens"
    assert (experiment.indenter_radius, experiment.sensor_radius) == (5e-3, 10e-3)
    assert (experiment.padding_material, experiment.model, experiment.discrepancy) == ("sensor", "surrogate", "on")
    assert experiment.priors == {
        "young_modulus": LogNormal(0.7e6, 1.6),
        "relative_permittivity": TruncatedNormal(2.8, 0.2, 0.0, math.inf),
        "machine_compliance": HalfNormal(5e-6),
        "parasitic_capacitance": Normal(0.0, 2e-12),
    }
    first, second = experiment.specimens
    assert first.sweeps[0].name == ""
    assert first.sweeps[0].force == folder / "sensor1_instron.csv"
    assert first.sweeps[0].capacitance == folder / "sensor1_lcr.csv"
    assert second.sweeps[0].force == folder / "data" / "sensor2.csv"
    assert second.sweeps[0].capacitance is None
    assert second.priors["padding_thickness"] == Fixed(1.1e-3)
    assert second.priors["contact_offset"] == Uniform(-0.2e-3, 0.2e-3)


def test_the_file_is_remembered_with_its_hash(folder: Path) -> None:
    experiment = read(folder, GOOD)
    assert experiment.path == folder / "experiment.toml"
    assert experiment.sha256 == hashlib.sha256(GOOD.encode()).hexdigest()


def test_lab_files_are_relative_to_the_experiment_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(folder, GOOD)
    monkeypatch.chdir(folder / "data")
    assert read_experiment(Path("../experiment.toml")).specimens[0].sweeps[0].force == folder / "sensor1_instron.csv"
    assert read_experiment(path).specimens == read_experiment(Path("..", "experiment.toml")).specimens


def test_a_specimen_may_carry_several_sweeps(folder: Path) -> None:
    (specimen,) = read(folder, SWEEPS).specimens
    assert [sweep.name for sweep in specimen.sweeps] == ["sweep 1", "small ball"]
    assert [sweep.indenter_radius for sweep in specimen.sweeps] == [5e-3, 2.5e-3]
    assert specimen.sweeps[1].capacitance is None


def test_name_defaults_to_the_name_of_the_file(folder: Path) -> None:
    assert read(folder, SWEEPS).name == "experiment"


def test_one_file_may_hold_force_and_capacitance(folder: Path) -> None:
    text = GOOD.replace("sensor1_lcr.csv", "sensor1_instron.csv")
    (sweep,) = read(folder, text).specimens[0].sweeps
    assert sweep.force == sweep.capacitance


def test_an_experiment_without_capacitance_needs_no_electrical_priors(folder: Path) -> None:
    lines = [line for line in GOOD.splitlines() if not line.startswith(("capacitance", "relative", "parasitic"))]
    experiment = read(folder, "\n".join(lines))
    assert all(sweep.capacitance is None for specimen in experiment.specimens for sweep in specimen.sweeps)
    assert set(experiment.priors) == {"young_modulus", "machine_compliance"}


def test_capacitance_alone_is_legitimate(folder: Path) -> None:
    text = GOOD.replace('force = "sensor1_instron.csv"', "")
    assert read(folder, text).specimens[0].sweeps[0].force is None


def test_optional_keys_are_read(folder: Path) -> None:
    text = 'model = "closed form"\ndiscrepancy = "off"\n' + GOOD.replace('"sensor"  ', '"own"  ')
    text = text.replace("[priors]", '[priors]\npadding_young_modulus = { lognormal = ["0.3 MPa", 2] }')
    experiment = read(folder, text)
    assert (experiment.model, experiment.discrepancy, experiment.padding_material) == ("closed form", "off", "own")
    assert experiment.priors["padding_young_modulus"] == LogNormal(0.3e6, 2.0)


def test_models_to_compare_are_named_by_the_choice_in_which_they_differ(folder: Path) -> None:
    assert read(folder, GOOD).candidates == ()
    assert candidates_of(read(folder, GOOD)) == variants_of(read(folder, GOOD))
    named = read(folder, 'candidates = ["stick", "own-padding"]\n' + GOOD)
    assert [v.name for v in candidates_of(named)] == ["as-given", "stick", "own-padding"]
    assert experiment_from_json(experiment_to_json(named)) == named


def test_comparing_the_discrepancy_is_on_with_a_candidate_without_it(folder: Path) -> None:
    for head, names in (("", [v.name for v in variants_of(read(folder, GOOD))][1:]), ('candidates = ["stick"]\n', ["stick"])):
        experiment = read(folder, head + 'discrepancy = "compare"\n' + GOOD)
        assert experiment.discrepancy == "on"
        *others, last = candidates_of(experiment)[1:]
        assert [v.name for v in others] == names
        assert (last.name, last.of(experiment).discrepancy) == ("discrepancy-off", "off")
        assert model_in_words(last.of(experiment)).endswith("no discrepancy")
    off = read(folder, 'discrepancy = "off"\ncandidates = ["discrepancy-on"]\n' + GOOD)
    assert candidates_of(off)[1].of(off).discrepancy == "on"


@pytest.mark.parametrize("named", ['["sticky"]', '["bonded"]', '"stick"', "[]", "[3]"])
def test_models_that_there_are_not_are_refused_with_those_that_there_are(folder: Path, named: str) -> None:
    said = only_fault(folder, f"candidates = {named}\n" + GOOD)
    assert said.startswith("experiment.toml:1:1: candidates ")
    assert "beside this one: gent, stick, " in said
    assert "own-padding, rubbing-base, friction, discrepancy-off" in said


def test_known_dimensions_of_the_sensor_are_fixed_priors(folder: Path) -> None:
    text = GOOD.replace("[padding]", 'electrode_radius = "9 mm"\ndielectric_thickness = "0.16 mm"\n[padding]')
    experiment = read(folder, text)
    assert experiment.priors["electrode_radius"] == Fixed(9e-3)
    assert [s.priors["dielectric_thickness"] for s in experiment.specimens] == [Fixed(0.16e-3)] * 2


def test_padding_may_be_left_out(folder: Path) -> None:
    text = GOOD.replace('[padding]\nmaterial = "sensor" ', "# ")
    assert read(folder, text).padding_material == "sensor"


def test_windows_line_ends_and_byte_order_mark_change_nothing(folder: Path) -> None:
    plain = read(folder, GOOD)
    windows = read_experiment(write(folder, b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()))
    assert windows.specimens == plain.specimens
    text = GOOD.replace("1.6]", "1.0]").replace("\n", "\r\n")
    assert only_fault(folder, text).startswith("experiment.toml:9:1: geometric sd")


@pytest.mark.parametrize("text", [GOOD, SWEEPS, 'model = "fem"\n' + GOOD])
def test_json_brings_the_same_experiment_back(folder: Path, text: str) -> None:
    experiment = read(folder, text)
    assert experiment_from_json(experiment_to_json(experiment)) == experiment


def test_json_of_another_version_is_refused() -> None:
    with pytest.raises(ValueError, match="format 99"):
        experiment_from_json('{"kind": "experiment", "format": 99}')


# --- what is wrong ------------------------------------------------------------------------------------------------------


def test_a_negative_thickness_is_refused_with_its_place_and_advice(folder: Path) -> None:
    message = only_fault(folder, GOOD.replace('"0.74 mm", "0.02', '"-0.74 mm", "0.02'))
    assert message.startswith("experiment.toml:18:1: sensor_thickness must be positive, got -0.74 mm. Give ")


def test_all_faults_are_reported_at_once_in_the_order_of_the_file(folder: Path) -> None:
    text = GOOD.replace('"5 mm"', "5").replace("lognormal", "lognorm").replace("sensor1_lcr", "sensor1_lrc")
    text = text.replace("padding_thickness = { fixed", "padding_thicknes = { fixed")
    found = faults(folder, text)
    assert [message.split(": ")[0] for message in found] == [f"experiment.toml:{line}:1" for line in (3, 9, 16, 25)]
    for part, message in zip(['Write "5 mm"', '"lognormal"', "sensor1_lcr.csv", '"padding_thickness"'], found, strict=True):
        assert part in message


@pytest.mark.parametrize(
    ("old", "new", "place", "parts"),
    [
        ("[indenter]", "[indentor]", "2:1", ['unknown key "indentor" at the top of the file', '"indenter"']),
        (
            "[padding]",
            'thickness = "1 mm"\n[padding]',
            "6:1",
            ['"thickness" in [sensor]', "sensor_thickness", "[specimens.priors]"],
        ),
        (
            "[padding]",
            'padding_thicknes = "1 mm"\n[padding]',
            "6:1",
            ['mean "padding_thickness"? It belongs in [specimens.priors]'],
        ),
        ("[padding]", '[padding]\nmodel = "fem"', "7:1", ['"model" in [padding]', "at the top of the file, before the first"]),
        ("[sensor]", "friction_coefficient = -0.2\n[sensor]", "4:1", ['zero or more, or "stick", got -0.2', "in [priors]"]),
        ("name = ", 'base = "glued"\nname = ', None, ['base must be "bonded" or "slippery"']),
        ("machine_", "padding_poisson_ratio = { fixed = 0.3 }\nmachine_", "11:1", ['material = "foam"']),
        ('material = "sensor"', 'material = "foam"', "7:1", ["padding_young_modulus needs a prior of its own"]),
        ("[sensor]", '[sensor]\nlaw = "yeoh"', "5:1", ['"yeoh"', "neo-hookean", "gent"]),
        ("[sensor]", 'law = "gent"\n[sensor]', "4:1", ["in [sensor]"]),
        (
            "relative_permittivity",
            "stiffening = { fixed = 0.02 }\nrelative_permittivity",
            "10:1",
            ["no meaning", 'law = "gent"'],
        ),
        (
            'material = "sensor"',
            'material = "senzor"',
            "7:1",
            ['"own" or "foam", got "senzor"', 'mean "sensor"'],
        ),
        ("name = ", "discrepancy = true\nname = ", None, ['discrepancy must be "off" or "on" or "compare", got true']),
        ("name = ", 'model = "FEM"\nname = ', None, ["model must be", 'Did you mean "fem"?']),
        ("machine_", "load_zero = { fixed = '0 N' }\nmachine_", "11:1", ['"load_zero" in [priors]', "in [specimens.priors]"]),
        ("machine_", "dielectric_thickness = { fixed = '0.1 mm' }\nmachine_", "11:1", ["in [specimens.priors]"]),
        (
            "machine_",
            "padding_young_modulus = { fixed = '1 MPa' }\nmachine_",
            "11:1",
            ['material "sensor"', 'material = "own"'],
        ),
        ("machine_", "electrode_radius = { fixed = '11 mm' }\nmachine_", "11:1", ["disc radius, got 11 mm on a disc of 10 mm"]),
        ('radius = "10 mm"', 'radius = "10 mm"\nelectrode_radius = "11 mm"', "6:1", ["got 11 mm on a disc of 10 mm"]),
        ('radius = "10 mm"', "", "4:1", ["sensor_radius is missing", 'Give radius = "10 mm" in [sensor]']),
        ('radius = "10 mm"', 'radius = "0 mm"', "5:1", ["sensor_radius must be positive, got 0 mm"]),
        ('radius = "10 mm"', 'radius = "10 MPa"', "5:1", ['unit "MPa" cannot be converted to m']),
        ('[indenter]\nradius = "5 mm"', 'indenter = "5 mm"', "2:1", ['[indenter] must be a table, got "5 mm"']),
        ('name = "sensor 1"', "", "13:1", ["name is missing in [[specimens]]", 'Give name = "sensor 1"']),
        ('name = "sensor 1"', 'name = ""', "14:1", ['name must be a text in quotes, got ""']),
        ('name = "sensor 1"', 'name = "a[1]"', "14:1", ["brackets"]),
        ('name = "sensor 2"', 'name = "sensor 1"', "21:1", ['specimen "sensor 1" is given twice, first in line 14']),
        ('force = "data/sensor2.csv"', "", "20:1", ['specimen "sensor 2" has neither a force nor a capacitance file']),
        ('"data/sensor2.csv"', '"sensor1_instron.csv"', "22:1", ["used twice", 'specimen "sensor 1"', "its own file"]),
        ('"data/sensor2.csv"', "7", "22:1", ["force must be a text in quotes, got 7"]),
        ('"data/sensor2.csv"', '"data"', "22:1", ["is a folder", "CSV files in that folder: sensor2.csv"]),
        ('"data/sensor2.csv"', '"date/sensor2.csv"', "22:1", ["there is no folder"]),
        ('"data/sensor2.csv"', "'data\\sensor2.csv'", "22:1", ["forward slashes"]),
        ('"data/sensor2.csv"', '"a\\u0000b"', "22:1", ["not the name of a file"]),
        (
            'padding_thickness = { fixed = "1.10 mm" }',
            "",
            "23:1",
            ['padding_thickness of specimen "sensor 2" is missing', "Give"],
        ),
        (
            "contact_offset",
            "young_modulus = { fixed = '1 MPa' }\ncontact_offset",
            "26:1",
            ["in [priors], shared by all specimens"],
        ),
        (
            "contact_offset",
            "dielectric_thickness = { fixed = '0.4 mm' }\ncontact_offset",
            "26:1",
            ["got 0.4 mm in a sensor of 0.75 mm"],
        ),
        ("contact_offset = {", "contact_offset = 3 #", "26:1", ["contact_offset needs a prior, got 3"]),
    ],
)
def test_a_fault_is_told_with_its_place_and_what_to_do(
    folder: Path, old: str, new: str, place: str | None, parts: list[str]
) -> None:
    assert old in GOOD
    message = only_fault(folder, GOOD.replace(old, new, 1))
    assert message.startswith(f"experiment.toml:{place or '1:1'}: ")
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("prior", "parts"),
    [
        ('indenter_radius = { normal = ["10 mm", "0.05 mm"] }', ["10 mm, and radius in [indenter] 5 mm", "not diameter"]),
        ('sensor_radius = { normal = ["20 mm", "0.05 mm"] }', ["20 mm, and radius in [sensor] 10 mm", "not diameter"]),
        ("force_gain = { normal = [0, 1] }", ["force_gain"]),
        ('capacitance_gain = { normal = ["1 pF", "1 pF"] }', ["capacitance_gain"]),
    ],
)
def test_a_radius_or_gain_that_cannot_be_is_refused(folder: Path, prior: str, parts: list[str]) -> None:
    message = only_fault(folder, GOOD.replace("machine_", f"{prior}\nmachine_"))
    assert message.startswith("experiment.toml:11:1: ")
    for part in parts:
        assert part in message


def test_one_prior_of_the_balls_radius_does_not_hold_for_two_balls(folder: Path) -> None:
    text = SWEEPS.replace("[[specimens]]", '[priors]\nindenter_radius = { normal = ["5 mm", "0.01 mm"] }\n[[specimens]]', 1)
    assert "balls of 2 radii" in only_fault(folder, text)


def test_a_missing_file_is_named_with_the_csv_files_that_are_there(folder: Path) -> None:
    message = only_fault(folder, GOOD.replace("sensor1_lcr.csv", "sensor1_LCR.csv"))
    assert f"capacitance file not found: {folder / 'sensor1_LCR.csv'}" in message
    assert message.endswith("CSV files in that folder: sensor1_lcr.csv, sensor1_instron.csv, small.csv")


def test_a_dimension_given_twice_is_refused(folder: Path) -> None:
    text = GOOD.replace("[padding]", 'electrode_radius = "9 mm"\ndielectric_thickness = "0.16 mm"\n[padding]')
    text = text.replace("machine_", "electrode_radius = { fixed = '9 mm' }\nmachine_")
    text = text.replace("contact_offset", "dielectric_thickness = { fixed = '0.1 mm' }\ncontact_offset")
    found = faults(folder, text)
    assert ["electrode_radius is given twice" in found[0], "dielectric_thickness is given twice" in found[1]] == [True, True]
    assert [message.split(": ")[0] for message in found] == ["experiment.toml:13:1", "experiment.toml:29:1"]


@pytest.mark.parametrize(
    ("old", "new", "place", "parts"),
    [
        ('name = "sensor 1"', 'name = "sensor 1"\nforce = "small.csv"', "7:1", ["both force and [[specimens.sweeps]]"]),
        ('name = "small ball"', 'name = "sweep 1"', "14:1", ['sweep "sweep 1" of specimen "sensor 1" is given twice']),
        ('"2.5 mm"', '"-2.5 mm"', "16:1", ["indenter_radius must be positive, got -2.5 mm"]),
        ('"small.csv"', '"sensor1_instron.csv"', "15:1", ['specimen "sensor 1", sweep "sweep 1"']),
        ('force = "small.csv"', "", "13:1", ['sweep "small ball" has neither a force nor a capacitance file']),
        ('force = "small.csv"', 'forces = "small.csv"', "15:1", ['unknown key "forces" in [[specimens.sweeps]]', '"force"']),
        ('"2.5 mm"', '"2.5 mm"\n[specimens.sweeps.priors]', "17:1", ["in [specimens.priors], where they hold for every sweep"]),
    ],
)
def test_faults_of_sweeps(folder: Path, old: str, new: str, place: str, parts: list[str]) -> None:
    assert old in SWEEPS
    message = only_fault(folder, SWEEPS.replace(old, new, 1))
    assert message.startswith(f"experiment.toml:{place}: ")
    for part in parts:
        assert part in message


def test_an_empty_file_is_told_what_it_needs(folder: Path) -> None:
    found = faults(folder, "")
    assert [part in message for part, message in zip(["[indenter]", "[sensor]", "[[specimens]]"], found, strict=True)] == [
        True
    ] * 3


def test_a_single_bracket_around_specimens_is_told(folder: Path) -> None:
    text = GOOD[: GOOD.index('[[specimens]]\nname = "sensor 2')].replace("[[specimens]]", "[specimens]")
    assert "Write [[specimens]] in double brackets" in only_fault(folder, text)


@pytest.mark.parametrize(
    ("text", "place", "part"),
    [
        ('name = "x"\nforce = sensor1.csv\n', "2:9", "quotes"),
        ("[indenter]\nradius = 5 mm\n", "2:12", 'stand in quotes: "0.74 mm"'),
        ('force = "C:\\Users\\x.csv"\n', "1:14", "forward slashes"),
        ("a = 1\na = 2\n", "2:6", "only once"),
        ("[priors]\n[priors]\n", "2:8", "only once"),
        ("a = [1,\n", "1:8", "not valid TOML"),
        ("[priors\n", "1:8", "not valid TOML"),
        (b'name = "caf\xe9"\n', "1:12", "not UTF-8 text, found the byte 0xe9"),
        (GOOD.encode("utf-16"), "1:1", "Save the file as UTF-8"),
    ],
)
def test_a_file_that_is_not_toml_is_refused_at_its_line_and_column(
    folder: Path, text: str | bytes, place: str, part: str
) -> None:
    message = only_fault(folder, text)
    assert message.startswith(f"experiment.toml:{place}: ")
    assert part in message


def test_a_file_that_is_not_there_or_is_a_folder_is_refused(folder: Path) -> None:
    write(folder, GOOD)
    with pytest.raises(InputError, match=r"file not found: .*TOML files in that folder: experiment.toml"):
        read_experiment(folder / "experimnt.toml")
    with pytest.raises(InputError, match=r"file not found: .*Nearest to that name is experiment.toml"):
        read_experiment(folder / "experiment.tml")
    with pytest.raises(InputError, match="file not found"):
        read_experiment(folder / "nowhere" / "experiment.toml")
    with pytest.raises(InputError, match="cannot be read"):
        read_experiment(folder)


# --- where keys stand ---------------------------------------------------------------------------------------------------

TRICKY = '''\
# [not.a.table] = 1
top = 1 # comment with [brackets] and key = 2
"quoted key" = "a # no comment, ] no end"
'literal.key' = 'C:\\x'
a.b . "c d".e = { x = 1, y.z = [1, { w = "}" }, "]"], s = 'it' }
multi = """
[fake]
fake = 1 \\""" still inside
"""
empty = """"""
quotes = """two "" and five"""""
lines = \'\'\'
# fake
[[fake]]\'\'\'
date = 1979-05-27 07:32:00
array = [
  1, # one ]
  [2, 3], "x,y",

  { k = 3 },
]

  [ spaced . "out" ]   # comment
  key=-1.5e3
[[specimens]]
name = "one"
[specimens.priors]
x = { normal = ["1 mm", 2] }
[[specimens.sweeps]]
f = 1
[[specimens.sweeps]]
f = 2
[specimens.sweeps.deep]
g = 3
[[ specimens ]]
name = "two"
[[specimens.sweeps]]
f = 4
[late.parent.child]
v = true
[late]
w = false'''


def walk(value: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    if path:
        yield path
    for key, below in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from walk(below, (*path, key))


def test_every_key_is_found_where_it_is_written() -> None:
    places = locate_keys(TRICKY)
    lines = TRICKY.splitlines()
    paths = set(walk(tomllib.loads(TRICKY)))
    assert set(places) - {("specimens",)} >= paths - {("specimens",)}
    for path in paths:
        line, column = places[path]
        written = lines[line - 1][column - 1 :]
        if isinstance(path[-1], str):
            assert written.lstrip("[ ").lstrip("\"'").startswith(path[-1]) or written.startswith("[")


@pytest.mark.parametrize(
    ("path", "place"),
    [
        (("top",), (2, 1)),
        (("a", "b", "c d", "e", "y", "z", 1, "w"), (5, 38)),
        (("array", 1, 1), (18, 7)),
        (("spaced", "out"), (23, 3)),
        (("spaced", "out", "key"), (24, 3)),
        (("specimens", 0), (25, 1)),
        (("specimens", 0, "priors"), (27, 1)),
        (("specimens", 0, "priors", "x"), (28, 1)),
        (("specimens", 0, "sweeps", 0, "f"), (30, 1)),
        (("specimens", 0, "sweeps", 1, "f"), (32, 1)),
        (("specimens", 0, "sweeps", 1, "deep", "g"), (34, 1)),
        (("specimens", 1, "name"), (36, 1)),
        (("specimens", 1, "sweeps", 0), (37, 1)),
        (("specimens", 1, "sweeps", 0, "f"), (38, 1)),
        (("late",), (41, 1)),
        (("late", "w"), (42, 1)),
    ],
)
def test_keys_stand_where_an_editor_shows_them(path: KeyPath, place: tuple[int, int]) -> None:
    assert locate_keys(TRICKY)[path] == place


def test_specimens_may_be_written_inline(folder: Path) -> None:
    thicknesses = 'priors.sensor_thickness.fixed = "0.74 mm", priors.padding_thickness = { fixed = "-1 mm" }'
    text = f"""\
indenter.radius = "5 mm"
sensor = {{ radius = "10 mm" }}
specimens = [
  {{ name = "a", force = "small.csv", {thicknesses} }},
]
"""
    message = only_fault(folder, text)
    assert message.startswith(f"experiment.toml:4:{text.splitlines()[3].index('padding_thickness') + 1}: padding_thickness")


VALUES = st.recursive(
    st.sampled_from(["1", "true", '"a]b}#"', "'c,d'", '"""x\n"y"""', "1.5", "07:32:00"]),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda entries: "[" + ", ".join(entries) + "]"),
        st.lists(inner, max_size=3).map(lambda entries: "{" + ", ".join(f"k{i} = {e}" for i, e in enumerate(entries)) + "}"),
    ),
    max_leaves=8,
)


@given(values=st.lists(VALUES, max_size=4), blank=st.sampled_from(["\n", "\n\n# [x]\n", " # c = 1\n"]))
def test_no_value_hides_the_keys_behind_it(values: list[str], blank: str) -> None:
    text = blank.join(f"key{i} = {value}" for i, value in enumerate([*values, "1"]))
    assert set(locate_keys(text)) == set(walk(tomllib.loads(text)))
