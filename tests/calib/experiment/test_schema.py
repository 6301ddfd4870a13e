"""The JSON Schema takes whatever the readers take, knows the keys that they know, and refuses the usual mistakes."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from copy import deepcopy
from inspect import cleandoc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from calib.catalogue import UNKNOWNS, bounds_of
from calib.errors import InputError
from calib.experiment.design import read_design
from calib.experiment.draft import experiment_text
from calib.experiment.experiment_file import experiment_from, read_experiment
from calib.experiment.lab_files import look_through
from calib.experiment.pairing import pair
from calib.experiment.schema import design_schema, experiment_schema, specification_schema
from calib.experiment.toml_places import KeyPath
from calib.priors.forms import FORMS

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor"
SCHEMAS = {"experiment": experiment_schema(), "design": design_schema(), "specification": specification_schema()}
EXPERIMENT, DESIGN, _ = (Draft202012Validator(schema) for schema in SCHEMAS.values())


def _documented(reader: object) -> dict[str, Any]:
    """The TOML form in the docstring of a reader."""
    text = cleandoc(str(reader.__doc__)).split("of the form::")[1]
    block = re.split(r"\n(?=\S)", text, maxsplit=1)[0]
    return tomllib.loads("\n".join(line.strip() for line in block.splitlines()))


def _parts(schema: Any) -> Iterator[dict[str, Any]]:
    """Every schema inside a schema."""
    if isinstance(schema, dict):
        yield schema
        for inner in schema.values():
            yield from _parts(inner)
    elif isinstance(schema, list):
        for inner in schema:
            yield from _parts(inner)


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def _full() -> dict[str, Any]:
    """An experiment with everything that may be said in it."""
    tables = _documented(read_experiment) | {"pooling": "partial"}
    tables["padding"]["material"] = "own"
    specimen = tables["specimens"][0]
    said = {"units": {"capacitance": "pF"}, "columns": {"time": 1, "capacitance": "Cp (pF)"}, "specimen": 2, "sheet": "1"}
    more = {"where": {"Frequency (Hz)": 1000}, "sign": "compression negative", "scale": "micro", "decimal": ","}
    specimen["capacitance"] = {"file": "sensor1_lcr.csv", **said, **more}
    specimen["use"] = {"max_force": "5 N", "max_depth": "0.8 mm", "branch": "unloading", "cycles": [2, 3]}
    other = deepcopy(specimen) | {"name": "sensor 2", "sweeps": [{"name": "ball 2", "indenter_radius": "2 mm"}]}
    for key in ("force", "capacitance", "use"):
        other["sweeps"][0][key] = other.pop(key)
    other["sweeps"][0]["force"] = {"file": "sensor2_instron.csv", "sign": {"force": "compression positive"}}
    other["sweeps"][0]["capacitance"] = "sensor2_lcr.csv"
    tables["specimens"].append(other)
    return tables


@pytest.mark.parametrize("kind", SCHEMAS)
def test_it_is_a_schema_of_draft_2020_12_whose_defaults_and_examples_hold(kind: str) -> None:
    Draft202012Validator.check_schema(SCHEMAS[kind])
    for part in _parts(SCHEMAS[kind]):
        default = [part["default"]] if isinstance(part.get("type", part.get("enum")), (str, list)) and "default" in part else []
        for value in [*default, *_list(part.get("examples"))]:
            assert Draft202012Validator(part).is_valid(value), (value, part)


def test_what_is_shipped_and_documented_is_accepted(tmp_path: Path) -> None:
    for tables in (tomllib.loads((DATASET / "experiment.toml").read_text(encoding="utf-8")), _full()):
        assert not list(EXPERIMENT.iter_errors(tables))
        assert experiment_from(tables, DATASET).specimens
    assert not list(DESIGN.iter_errors(_documented(read_design)))


def test_what_init_writes_is_accepted() -> None:
    looked, _ = look_through([DATASET])
    text = experiment_text(pair([record for file in looked for record in file.records]), DATASET, looked)
    assert not list(EXPERIMENT.iter_errors(tomllib.loads(text)))
    uncommented = re.sub(r"^# (?=\w+ = )", "", text, flags=re.MULTILINE)
    assert uncommented.count("\n#") < text.count("\n#") - 3
    assert not list(EXPERIMENT.iter_errors(tomllib.loads(uncommented)))


# --- it cannot go stale -------------------------------------------------------------------------------------------------


def _tables(schema: dict[str, Any], example: Any, at: KeyPath = ()) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Every table of an example with the schemas of its keys."""
    options = [option for option in (schema, *schema.get("anyOf", ())) if Draft202012Validator(option).is_valid(example)]
    for option in options:
        if isinstance(example, list) and "items" in option:
            for i, entry in enumerate(example):
                yield from _tables(option["items"], entry, (*at, i))
        if isinstance(example, dict) and option.get("additionalProperties") is False and "maxProperties" not in option:
            yield at, option["properties"]
            for key, value in example.items():
                yield from _tables(option["properties"][key], value, (*at, key))


def _with(tables: dict[str, Any], at: KeyPath, key: str, value: object) -> dict[str, Any]:
    changed: Any = deepcopy(tables)
    inner = changed
    for step in at:
        inner = inner[step]
    inner[key] = value
    return dict(changed)


PLACES = list(_tables(SCHEMAS["experiment"], _full()))


@pytest.mark.parametrize(("at", "keys"), PLACES, ids=[".".join(map(str, at)) for at, _ in PLACES])
def test_it_knows_the_keys_that_the_reader_knows(at: KeyPath, keys: dict[str, Any]) -> None:
    with pytest.raises(InputError) as caught:
        experiment_from(_with(_full(), at, "zzzz", 1), DATASET)
    (advice,) = (fault.advice for fault in caught.value.faults if 'unknown key "zzzz"' in fault.message)
    assert set(advice.removeprefix("Known here: ").split(", ")) == keys.keys()


def test_a_spread_is_allowed_where_the_reader_allows_it() -> None:
    tables = _with(_full(), ("priors",), "young_modulus_spread", {"lognormal": [0.04, 2]})
    assert EXPERIMENT.is_valid(tables)
    assert _read(tables)
    for complete in (tables | {"pooling": "complete"}, {key: value for key, value in tables.items() if key != "pooling"}):
        assert not EXPERIMENT.is_valid(complete)
        assert not _read(complete)


def test_all_tables_of_an_experiment_are_compared_with_the_reader() -> None:
    named = {".".join(step for step in at if isinstance(step, str)) for at, _ in PLACES}
    inner = {"specimens.priors", "specimens.use", "specimens.sweeps", "specimens.sweeps.use", "specimens.capacitance"}
    read = {"specimens.capacitance.units", "specimens.capacitance.columns", "specimens.sweeps.force.sign"}
    assert {"", "indenter", "sensor", "padding", "priors", "specimens", *inner, *read} <= named


@pytest.mark.parametrize("name", UNKNOWNS)
def test_every_unknown_is_described_with_its_default_and_why(name: str) -> None:
    top = SCHEMAS["experiment"]["properties"]
    priors = {**top["priors"]["properties"], **top["specimens"]["items"]["properties"]["priors"]["properties"]}
    row, said = UNKNOWNS[name], priors[name]["description"]
    assert row.quantity.label[1:] in said
    assert row.when in said
    assert row.default in said
    assert row.reason in said


# --- whatever the reader takes, the schema takes ------------------------------------------------------------------------

NUMBERS = ("1", "0.74", ".5", "5.", "1e-3", "0", "-1", "+2", " 3 ", "−4")
UNITS = ("mm", "um", " mm", " MPa", " kgf", " pF", " um/N", " s", " N", "", " %", " lbf/in**2", "e", " erg/N")
VALUES = st.one_of(
    st.builds("".join, st.tuples(st.sampled_from(NUMBERS), st.sampled_from(UNITS))),
    st.floats(-2, 20),
    st.integers(-1, 3),
    st.booleans(),
    st.sampled_from(["", "stick", "gent", "own", "fem", "two", "0,74 mm"]),
)


@st.composite
def _priors(draw: st.DrawFn) -> tuple[str, dict[str, Any]]:
    """A prior of any unknown, of any kind, with numbers that fit, spelled in any way; now and then one that does not."""
    name = draw(st.sampled_from(sorted(UNKNOWNS)))
    kind = draw(st.sampled_from(sorted(FORMS)))
    unit = UNKNOWNS[name].quantity.display_unit.replace("µ", "u")
    size = draw(st.sampled_from([0.02, 0.1, 0.25])) * (draw(st.sampled_from([1, -1])) if bounds_of(name) == "any" else 1)
    fits = {"sd": 0.05, "geometric sd": 1.6, "scale": abs(size), "low": size - abs(size) / 2, "high": size + abs(size)}
    forms = ["{:.4g} {}", "{:.4g}{}", " {:+.4f} {} ", "{:.3e} {}"] if fits["low"] > 0 else ["{:.4g} {}", "{:.3e} {}"]

    def written(number: str) -> object:
        value = fits.get(number, size)
        plain = number == "geometric sd" or (not unit and draw(st.booleans()))
        return value if plain else draw(st.sampled_from(forms)).format(value, unit)

    numbers = [written(number) if draw(st.integers(0, 9)) else draw(VALUES) for number in FORMS[kind]]
    return name, {kind: numbers[0] if len(numbers) == 1 and draw(st.booleans()) else numbers}


def _read(tables: dict[str, Any]) -> bool:
    try:
        experiment_from(tables, DATASET)
    except InputError:
        return False
    return True


@settings(max_examples=150, deadline=None)
@given(_priors())
def test_every_prior_that_is_read_is_accepted(prior: tuple[str, dict[str, Any]]) -> None:
    name, value = prior
    top = SCHEMAS["experiment"]["properties"]
    properties = {**top["priors"]["properties"], **top["specimens"]["items"]["properties"]["priors"]["properties"]}
    tables = _full()
    tables["sensor"] = {"radius": "0.15 m", "law": "gent"}
    where = tables["priors"] if UNKNOWNS[name].scope in ("material", "rig") else tables["specimens"][0]["priors"]
    where[name] = value
    if _read(tables):
        assert Draft202012Validator(properties[name]).is_valid(value)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(PLACES), st.data())
def test_every_value_that_is_read_is_accepted(place: tuple[KeyPath, dict[str, Any]], data: st.DataObject) -> None:
    at, keys = place
    key = data.draw(st.sampled_from(sorted(keys)))
    shown = [value for part in _parts(keys[key]) for name in ("enum", "examples") for value in _list(part.get(name))]
    value = data.draw(st.one_of(VALUES, st.lists(VALUES, max_size=2), st.sampled_from(shown or ["pF", 1])))
    tables = _with(_full(), at, key, value)
    if _read(tables):
        assert not list(EXPERIMENT.iter_errors(tables))


# --- what it refuses ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("at", "keys"), PLACES, ids=[".".join(map(str, at)) for at, _ in PLACES])
def test_a_key_that_is_unknown_is_refused_in_every_table(at: KeyPath, keys: dict[str, Any]) -> None:
    assert not EXPERIMENT.is_valid(_with(_full(), at, f"{min(keys)}s_", 1))


@pytest.mark.parametrize("name", [name for name, row in UNKNOWNS.items() if row.quantity.unit])
@pytest.mark.parametrize("kind", FORMS)
def test_a_number_without_its_unit_is_refused(name: str, kind: str) -> None:
    top = SCHEMAS["experiment"]["properties"]
    of = {**top["priors"]["properties"], **top["specimens"]["items"]["properties"]["priors"]["properties"]}[name]
    unit = UNKNOWNS[name].quantity.display_unit.replace("µ", "u")
    good: list[Any] = [1.6 if number == "geometric sd" else f"{i + 1} {unit}" for i, number in enumerate(FORMS[kind])]
    validator = Draft202012Validator(of)
    assert validator.is_valid({kind: good})
    for wrong in (1.0, "1", "1e3", "0,74 mm", "mm"):
        assert not validator.is_valid({kind: [wrong, *good[1:]]})
    if bounds_of(name) != "any" and kind in ("fixed", "lognormal"):
        assert not validator.is_valid({kind: [f"-1 {unit}", *good[1:]]})
    assert not validator.is_valid({kind: [*good, good[0]]})
    assert not validator.is_valid({f"{kind}s": good})
    assert not validator.is_valid({kind: good, "fixed" if kind != "fixed" else "normal": good})


@pytest.mark.parametrize(
    ("at", "key", "value"),
    [
        (("sensor",), "radius", 10),
        (("indenter",), "radius", "5"),
        (("indenter",), "friction_coefficient", -0.3),
        ((), "base", "glued"),
        ((), "model", "surogate"),
        ((), "specimens", {"name": "sensor 1"}),
        ((), "specimens", []),
        (("specimens", 0), "name", " "),
        (("specimens", 0), "use", {"cycles": [0]}),
        (("specimens", 0), "use", {"max_force": 5}),
        (("specimens", 0), "capacitance", {"units": {"capacitance": "pF"}}),
        (("specimens", 0, "capacitance"), "sign", "down"),
        (("specimens", 0, "priors"), "padding_thickness", "1.1 mm"),
    ],
)
def test_a_wrong_value_is_refused(at: KeyPath, key: str, value: object) -> None:
    assert not EXPERIMENT.is_valid(_with(_full(), at, key, value))


@pytest.mark.parametrize("missing", ["indenter", "sensor", "specimens"])
def test_what_must_be_there_is_asked_for(missing: str) -> None:
    tables = _full()
    del tables[missing]
    assert not EXPERIMENT.is_valid(tables)


# --- designs ------------------------------------------------------------------------------------------------------------

STACK = """
[indenter]
radius = "5 mm"
[disc]
radius = "10 mm"
[[layers]]
thickness = "0.2 mm"
young_modulus = "0.69 MPa"
relative_permittivity = 2.8
"""


@pytest.mark.parametrize(
    ("old", "new", "good"),
    [
        ("", "", True),
        ('base = "bonded"', 'base = "slippery"', True),
        ("base_friction_coefficient = 0.0", "base_friction_coefficient = -0.4", False),
        ('base = "bonded"', 'base = "slipery"', False),
        ('radius = "5 mm"', 'shape = "flat punch"\nradius = "4 mm"\nedge_radius = "0.2 mm"', True),
        ('radius = "5 mm"', 'shape = "cone"\nhalf_angle = "60 deg"\ntip_radius = "0.5 mm"', True),
        ('radius = "5 mm"', 'shape = "cone"\nradius = "5 mm"', False),
        ('radius = "5 mm"', 'shape = "sphere"\nradius = "5 mm"', True),
        ('radius = "5 mm"', "radius = 5", False),
        ("\nfriction_coefficient = 0.0", '\nfriction_coefficient = "stick"', True),
        ("\nfriction_coefficient = 0.0", "\nfriction_coefficient = -1", False),
        ("{ gent = { locking = 40 } }", "{ mooney-rivlin = { c01_share = 0.2 } }", True),
        ("{ gent = { locking = 40 } }", "{ yeoh = { c2 = 0.02 } }", True),
        ("{ gent = { locking = 40 } }", "{ yeoh = { c3 = 0.02 } }", False),
        ("{ gent = { locking = 40 } }", "{ ogden = { shares = [1.2, -0.2], exponents = [1.3, -2] } }", True),
        ("{ gent = { locking = 40 } }", "{ ogden = { shares = 1, exponents = [1.3, -2] } }", False),
        ("{ gent = { locking = 40 } }", '"gent"', False),
        ("{ gent = { locking = 40 } }", '"rubber"', False),
        ("relative_permittivity = 2.8", "permittivity = 2.8", False),
        ("relative_permittivity = 2.8", 'relative_permittivity = "2.8"', True),
    ],
)
def test_designs_are_accepted_and_refused_as_by_the_reader(tmp_path: Path, old: str, new: str, good: bool) -> None:
    block = cleandoc(str(read_design.__doc__)).split("of the form::")[1].split("Other indenters")[0]
    text = "\n".join(line.strip() for line in block.splitlines())
    assert old in text
    _compare_design(tmp_path, text.replace(old, new, 1), good=good)


@pytest.mark.parametrize(
    ("text", "good"),
    [
        (STACK, True),
        (STACK + 'name = "cover"\nlaw = "neo-hookean"\n', True),
        (STACK + "poisson_ratio = 0.3\n", True),
        (STACK + "poisson_ratio = 0.51\n", False),
        (STACK + 'poisson_ratio = "0.3"\n', False),
        (STACK.replace('"0.2 mm"', "0.2"), False),
        (STACK.replace('[disc]\nradius = "10 mm"\n', ""), False),
        (STACK + '[padding]\nthickness = "1 mm"\n', False),
        (STACK.replace('young_modulus = "0.69 MPa"\n', ""), False),
    ],
)
def test_stacks_are_accepted_and_refused_as_by_the_reader(tmp_path: Path, text: str, good: bool) -> None:
    _compare_design(tmp_path, text, good=good)


def _compare_design(folder: Path, text: str, *, good: bool) -> None:
    path = folder / "design.toml"
    path.write_text(text, encoding="utf-8")
    if good:
        read_design(path)
    else:
        with pytest.raises(InputError):
            read_design(path)
    assert DESIGN.is_valid(tomllib.loads(text)) == good
