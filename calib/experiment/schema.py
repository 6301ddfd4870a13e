"""The keys that the readers of experiment, design and specification files know in, a JSON Schema for editors out."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import get_args

from calib.catalogue import SPREADS, UNKNOWNS, unknowns_of
from calib.experiment.design import BESIDE, DISC, LAWS, LAYER, REQUIRED, SHAPES, TABLES
from calib.experiment.experiment_file import DISCREPANCIES, KEYS
from calib.experiment.lab_entries import READING_KEYS
from calib.experiment.laboratory import COUNTRY, DAY, INSTRUMENT, LABORATORY
from calib.experiment.lots import CAST
from calib.experiment.plan import MaterialLaw, Model, PaddingMaterial, Pooling
from calib.experiment.schema_values import Schema, choice, prior_of, quantity, quantity_of, table, tables, text
from calib.experiment.signposts import SWEEP_KEYS
from calib.experiment.specification import LIMITED, MOST_STEPS, MOST_VALUES, sides_of
from calib.experiment.specification_file import KEYS as SPECIFICATION_KEYS
from calib.experiment.specification_file import KINDS, MATERIAL, TOLERANCES
from calib.experiment.variants import CANDIDATES
from calib.lab import QUANTITIES, SIGNED, SIGNS, USE_KEYS
from calib.priors import FORMS
from models.sensor import Base

_DRAFT = "https://json-schema.org/draft/2020-12/schema"


def experiment_schema() -> Schema:
    """JSON Schema of an experiment file, for editors: what `read_experiment` takes, as far as a schema can say it.

    What depends on other keys or on files (sizes that do not fit, a lab file that is not there) the reader alone finds.
    """
    top = {
        "name": text("Heading of the report."),
        "model": choice(
            "Forward model: the fast surrogate, the finite elements, or a rough closed form.", get_args(Model), "surrogate"
        ),
        "discrepancy": choice("Whether the model may be a little wrong along a sweep.", DISCREPANCIES, "on"),
        "candidates": {
            "description": "Other models that `calib compare` calibrates and averages; default all that there are.",
            "type": "array",
            "items": choice("A model that differs in one choice.", CANDIDATES),
            "minItems": 1,
            "uniqueItems": True,
        },
        "base": choice("What the padding rests on: glued, or free to slide.", get_args(Base), "bonded"),
        "pooling": choice(
            "Whether all specimens are of one material, or of one lot with modulus, permittivity and thicknesses of their own.",
            get_args(Pooling),
            "complete",
        ),
        "indenter": _only("The ball.", KEYS["indenter"], _INDENTER, ["radius"]),
        "sensor": _only("The sensor's disc.", KEYS["sensor"], _SENSOR, ["radius"]),
        "padding": _only("What the sensor lies on.", KEYS["padding"], _PADDING),
        "priors": table(
            "What is known before the data of material and rig, shared by all specimens. What is left out gets its default.",
            {name: prior_of(name) for name in (*unknowns_of("material", "rig"), *CAST)},
        ),
        "specimens": tables("The sensors that were measured.", _specimen()),
        "laboratory": _laboratory(),
        "instruments": tables("What was measured with, for a certificate.", _instrument()),
    }
    found = _only("Experiment file of `calib calibrate`.", KEYS[""], top, ["indenter", "sensor", "specimens"])
    partial: Schema = {"properties": {"pooling": {"const": "partial"}}, "required": ["pooling"]}
    of_lots: list[Schema] = [{"required": [name]} for name in (*SPREADS, *CAST)]
    needed = [name for name, row in UNKNOWNS.items() if row.required]
    measured: Schema = {
        "properties": {"priors": {"required": needed}},
        "required": ["priors"],
        "not": {"required": ["nominal"]},
    }
    complete: Schema = {"properties": {"priors": {"not": {"anyOf": of_lots}}, "specimens": {"items": measured}}}
    return {"$schema": _DRAFT, "title": "Experiment"} | found | {"if": partial, "else": complete}


_FRICTION: Schema = {
    "description": 'Coulomb\'s coefficient of friction, or "stick" for no slip at all.',
    "anyOf": [{"type": "number", "minimum": 0}, {"const": "stick"}],
    "default": 0,
}
_INDENTER: Mapping[str, Schema] = {
    "radius": quantity_of("indenter_radius"),
    "friction_coefficient": _FRICTION,
}
_SENSOR: Mapping[str, Schema] = {
    "radius": quantity_of("sensor_radius"),
    "law": choice("Law of sensor and padding; Gent's stiffens when stretched far.", get_args(MaterialLaw), "neo-hookean"),
    "electrode_radius": quantity_of("electrode_radius"),
    "dielectric_thickness": quantity_of("dielectric_thickness"),
}
_PADDING: Mapping[str, Schema] = {
    "material": choice(
        "Whether the padding is of the sensor's silicone, of another, or a foam.", get_args(PaddingMaterial), "sensor"
    ),
}


_POISSON_RATIO: Schema = {
    "description": "Poisson's ratio of a foam, which is neo-Hookean; 0.5 for what keeps its volume.",
    "type": "number",
    "minimum": 0,
    "maximum": 0.5,
    "default": 0.5,
}


def _only(description: str, keys: tuple[str, ...], of: Mapping[str, Schema], required: list[str] | None = None) -> Schema:
    """A table of exactly the keys that its reader knows: one that has no schema here is a KeyError, which a test meets."""
    return table(description, {key: of[key] for key in keys}, required or [])


def _specimen() -> Schema:
    priors = {name: prior_of(name) for name in unknowns_of("specimen", "sweep")}
    sweep = _sweep()
    of = {
        "name": text("Name of the specimen, for the report; each has its own."),
        **sweep,
        "sweeps": tables(
            "Several presses of this specimen, each with its files.",
            _only("One press.", ("name", *SWEEP_KEYS), {"name": text("Name of the press."), **sweep}),
        ),
        "priors": table("What is known before the data of this specimen.", priors),
        "nominal": table(
            "What was wanted of this specimen of a lot, where its specimens were not meant to be alike.",
            {name: quantity_of(name) for name in CAST},
        ),
    }
    found = _only("One sensor on its padding.", KEYS["specimens"], of, ["name"])
    return found | {"anyOf": [{"required": [key]} for key in ("force", "capacitance", "sweeps")]}


def _laboratory() -> Schema:
    of = {key: text(said) for key, said in LABORATORY.items()}
    of["country"] |= {"pattern": rf"^\s*{COUNTRY}\s*$"}
    of["email"] |= {"pattern": r"^\s*[^@\s]+@[^@\s]+\s*$"}
    both: Schema = {"type": "array", "items": _day("The first, then the last."), "minItems": 2, "maxItems": 2}
    of["measured"] = {"description": LABORATORY["measured"], "anyOf": [_day("One day."), both]}
    return table("Who measured, where and when, for a certificate.", of)


def _instrument() -> Schema:
    of = {key: _day(said) if key == "calibrated" else text(said) for key, said in INSTRUMENT.items()}
    return table("One instrument.", of, ["kind"])


def _day(description: str) -> Schema:
    return {"description": description, "type": "string", "pattern": rf"^\s*{DAY}\s*$"}


def _sweep() -> dict[str, Schema]:
    use = {
        "max_force": quantity("Rows with more force are left out.", "N", "5 N", signed=True),
        "max_depth": quantity("Rows deeper than this, from where contact is estimated, are left out.", "m", "0.8 mm"),
        "branch": choice("The branch that is used.", ("loading", "unloading"), "loading"),
        "cycles": {
            "description": "The cycles that are used together, counted from 1; default the first.",
            "type": "array",
            "items": {"type": "integer", "minimum": 1},
            "minItems": 1,
            "uniqueItems": True,
        },
    }
    of = {
        "force": _lab_file("File of the testing machine"),
        "capacitance": _lab_file("File of the LCR meter"),
        "indenter_radius": quantity_of("indenter_radius"),
        "use": _only("Which part of the press is used.", USE_KEYS, use),
    }
    return {key: of[key] for key in SWEEP_KEYS}


def _lab_file(what: str) -> Schema:
    name = text(f"{what}, relative to this file.")
    signs = choice("Which way compression is.", tuple(SIGNS))
    of = {
        "units": table(
            "Unit of a quantity, where the file does not say it.", {q: text("Unit, as in the file.") for q in QUANTITIES}
        ),
        "columns": table(
            "Column of a quantity: its header, or its number from 1.",
            {q: {"anyOf": [{"type": "integer"}, text("Header of the column.")]} for q in QUANTITIES},
        ),
        "specimen": {"description": "Which of several specimens in the file.", "type": "integer", "minimum": 1},
        "where": {
            "description": "Only rows that hold this value in a column are read.",
            "type": "object",
            "minProperties": 1,
            "additionalProperties": {"anyOf": [{"type": "number"}, text("Value in the column.")]},
        },
        "sheet": text("Sheet of a workbook, group of a TDMS file or variable of a MAT file."),
        "sign": {"anyOf": [signs, table("Which way compression is, by quantity.", dict.fromkeys(SIGNED, signs))]},
        "scale": choice('"micro" for instruments of nanometres and micronewtons.', ("micro",)),
        "decimal": choice("Decimal mark, where the file leaves it open.", (".", ",")),
    }
    said = _only(f"{what}, and how it is to be read.", ("file", *READING_KEYS), {"file": name, **of}, ["file"])
    return {"description": f"{what}.", "anyOf": [name, said]}


# --- designs ------------------------------------------------------------------------------------------------------------


def design_schema() -> Schema:
    """JSON Schema of a design file, for editors: what `read_design` takes, as far as a schema can say it."""
    beside = {"law": _law(), "poisson_ratio": _POISSON_RATIO}
    sensor, padding = (
        table(
            f"The {name}.",
            {key: quantity_of(parameter) for key, parameter in keys.items()} | {key: beside[key] for key in BESIDE[name]},
            [key for key in keys if (name, key) in REQUIRED],
        )
        for name, keys in TABLES.items()
    )
    disc = {"radius": quantity_of("sensor_radius"), "electrode_radius": quantity_of("electrode_radius")}
    layer = {
        "name": text("Name of the layer."),
        "thickness": quantity("Thickness of the layer.", "m", "0.5 mm"),
        "young_modulus": quantity("Young's modulus of the layer.", "Pa", "0.69 MPa"),
        **beside,
        "relative_permittivity": quantity_of("relative_permittivity"),
    }
    top = {
        "base": choice("What the lowest layer does on the rigid base.", get_args(Base), "bonded"),
        "base_friction_coefficient": _FRICTION,
        "indenter": _indenter(),
        "sensor": sensor,
        "padding": padding,
        "disc": _only("The disc of a stack of layers.", DISC, disc, ["radius"]),
        "layers": tables(
            "The layers of a stack, from the base up.", _only("One layer.", LAYER, layer, ["thickness", "young_modulus"])
        ),
    }
    kinds = [
        {"required": ["sensor", "padding"], "not": {"anyOf": [{"required": ["disc"]}, {"required": ["layers"]}]}},
        {"required": ["disc", "layers"], "not": {"anyOf": [{"required": ["sensor"]}, {"required": ["padding"]}]}},
    ]
    about = "Design file of `calib simulate`: a sensor on its padding, or a disc of any layers."
    return {"$schema": _DRAFT, "title": "Design"} | table(about, top, ["indenter"]) | {"oneOf": kinds}


def _indenter() -> Schema:
    common = ("shape", "friction_coefficient")
    sizes = {
        key: quantity(
            f"{key.replace('_', ' ').capitalize()} of the indenter.", "rad" if key == "half_angle" else "m", example.strip('"')
        )
        for shape in SHAPES.values()
        for key, example in shape.items()
    }
    shape = choice("Shape of the indenter.", tuple(SHAPES), "sphere")
    rules = []
    for name, keys in SHAPES.items():
        is_it: Schema = {"properties": {"shape": {"const": name}}} | ({} if name == "sphere" else {"required": ["shape"]})
        rules.append({"if": is_it, "then": {"required": list(keys), "propertyNames": {"enum": [*common, *keys]}}})
    return table("What presses.", {"shape": shape, "friction_coefficient": _FRICTION, **sizes}) | {"allOf": rules}


def _law() -> Schema:
    """The name of a law that has no shape parameters, or a table of one name and its shape parameters."""
    number: Schema = {"type": "number"}
    laws: dict[str, Schema] = {}
    for name, (make, parameters) in LAWS.items():
        given = inspect.signature(make).parameters
        several = {key for key in parameters if "tuple" in str(given[key].annotation)}
        of = {key: {"type": "array", "items": number} if key in several else number for key in parameters}
        needed = [key for key in parameters if given[key].default is inspect.Parameter.empty]
        laws[name] = table(f"Shape parameters of {name}.", of, needed)
    one = table("A law with its shape parameters.", laws) | {"minProperties": 1, "maxProperties": 1}
    bare = [name for name, (_, parameters) in LAWS.items() if not parameters]
    return {"description": "Hyperelastic law.", "anyOf": [{"enum": bare}, one], "default": "neo-hookean"}


# --- specifications -----------------------------------------------------------------------------------------------------


def specification_schema() -> Schema:
    """JSON Schema of a specification file, for editors: what `read_specification` takes, as far as a schema can say it."""
    limits: dict[str, Schema] = {}
    for name, row in LIMITED.items():
        value = quantity(f"{row.label[0].upper()}{row.label[1:]}.", row.unit, f"20 {row.display_unit}" if row.unit else "0.08")
        at: dict[str, Schema] = {} if name == "height" else {"at": _LOAD}
        sides = sides_of(name)
        limits[name] = table(f"Limits on the {row.label}.", {**dict.fromkeys(sides, value), **at})
        limits[name] |= {"anyOf": [{"required": [side]} for side in sides]}
    sensor = {
        "thickness": _one_or_more("Sensors to choose from; default as measured.", quantity("Thickness.", "m", "0.74 mm")),
        "electrode_radius": _one_or_more("Electrodes to choose from; default as measured.", quantity("Radius.", "m", "8 mm")),
        "thickness_tolerance": _tolerance("Of the sensor's thickness."),
        "dielectric_tolerance": _tolerance("Of the thickness of each dielectric."),
        "electrode_tolerance": _tolerance("Of the electrode's radius."),
    }
    spread = {
        name: quantity(f"Standard deviation of the logarithm of {name}.", "", "0.05") for name in SPECIFICATION_KEYS["spread"]
    }
    top = {
        "name": text("Name of the specification."),
        "probability": quantity("Of conforming, that is asked for: from 0.5 to below 1.", "", "0.95"),
        "loads": _loads(),
        "limits": _only("What must hold.", SPECIFICATION_KEYS["limits"], limits) | {"minProperties": 1},
        "padding": _pads(),
        "sensor": _only("Sensors to choose from, and how they are made.", SPECIFICATION_KEYS["sensor"], sensor),
        "spread": _only("How sensors differ from each other.", SPECIFICATION_KEYS["spread"], spread),
    }
    found = _only("Specification file of `calib recommend --spec`.", SPECIFICATION_KEYS[""], top, ["loads", "limits"])
    return {"$schema": _DRAFT, "title": "Specification"} | found


_LOAD = quantity("Load.", "N", "10 N")


def _loads() -> Schema:
    ends = {"description": "The two ends.", "type": "array", "items": _LOAD, "minItems": 2, "maxItems": 2}
    steps = {"description": "Loads that are looked at.", "type": "integer", "minimum": 2, "maximum": MOST_VALUES}
    span = table("A range of loads, all of which must conform.", {"range": ends, "steps": steps}, ["range"])
    ball, curvature = quantity("Radius of the ball.", "m", "5 mm"), quantity("Curvature of a ball.", "1/m", "0.2 1/mm")
    force = _one_or_more("Loads, all of which must conform, or the distribution of the load in use.", _LOAD, distributed=True)
    keys = {
        "force": force | {"anyOf": [*force["anyOf"], span]},
        "ball": _one_or_more("Balls that press; default that of the run.", ball, distributed=True),
        "curvature": _one_or_more("Curvature of what presses, instead of ball.", curvature, distributed=True),
    }
    both: Schema = {"not": {"required": ["ball", "curvature"]}}
    return _only("Loads and balls.", SPECIFICATION_KEYS["loads"], keys, ["force"]) | both


def _pads() -> Schema:
    thickness, modulus = quantity("Thickness of the padding.", "m", "1 mm"), quantity("Young's modulus.", "Pa", "0.3 MPa")
    material = {
        "name": text("Name of the material."),
        "young_modulus": {"anyOf": [modulus, _distribution(modulus)]},
        "poisson_ratio": _POISSON_RATIO,
    }
    one = _only("One material.", MATERIAL, material, ["name", "young_modulus"])
    ends: Schema = {
        "description": "Paddings to choose from.",
        "type": "array",
        "items": thickness,
        "minItems": 2,
        "maxItems": 2,
    }
    keys = {
        "thickness": ends,
        "steps": {"description": "Thicknesses that are tried.", "type": "integer", "minimum": 3, "maximum": MOST_STEPS},
        "tolerance": _tolerance("Of the padding's thickness about its nominal."),
        "gauge": quantity("Standard uncertainty of a reading of the thickness when pads are inspected.", "m", "0.02 mm"),
        "guard_band": quantity("r of the guard band w = r U, U = 2 gauge.", "", "1.0"),
        "materials": tables("Materials for the padding, beside that of the run.", one),
    }
    return _only("Pads to choose from, and how they are made.", SPECIFICATION_KEYS["padding"], keys)


def _one_or_more(description: str, one: Schema, *, distributed: bool = False) -> Schema:
    """A quantity, a list of them, or a distribution."""
    several: Schema = {"type": "array", "items": one, "minItems": 1, "maxItems": MOST_VALUES}
    return {"description": description, "anyOf": [one, several, *([_distribution(one)] if distributed else [])]}


def _distribution(one: Schema) -> Schema:
    """One kind of distribution, with its numbers in their order."""
    factor: Schema = {"description": "geometric sd", "type": "number", "exclusiveMinimum": 1}
    kinds: dict[str, Schema] = {}
    for kind in KINDS:
        numbers = [factor if name == "geometric sd" else one for name in FORMS[kind]]
        size = {"minItems": len(numbers), "maxItems": len(numbers)}
        kinds[kind] = {"description": f"{kind}: [{', '.join(FORMS[kind])}]", "type": "array", "prefixItems": numbers} | size
    return table("A distribution.", kinds) | {"minProperties": 1, "maxProperties": 1}


def _tolerance(description: str) -> Schema:
    """A kind of tolerance and its size."""
    size = quantity("Standard deviation, or half of the width.", "m", "0.1 mm")
    return table(description, dict.fromkeys(TOLERANCES, size)) | {"minProperties": 1, "maxProperties": 1}
