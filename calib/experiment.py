"""Experiment and design files: from TOML text to a checked `Experiment` or `Design`, all faults at once with their places."""

from __future__ import annotations

import difflib
import hashlib
import json
import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, cast

from calib.errors import Fault, InputError
from calib.prior import EXAMPLES, Fixed, Prior, display, parse_prior, parse_value, prior_from_json, sign_fault
from models.sensor import Design, Indenter, Padding, Sensor

Model = Literal["surrogate", "fem", "closed form"]
Discrepancy = Literal["off", "on"]
PaddingMaterial = Literal["sensor", "own"]

#: Parameters of material and rig, shared by all specimens: [priors].
SHARED_PARAMETERS = (
    "young_modulus",
    "padding_young_modulus",
    "relative_permittivity",
    "machine_compliance",
    "parasitic_capacitance",
    "electrode_radius",
    "force_noise",
    "capacitance_noise",
    "force_discrepancy",
    "capacitance_discrepancy",
)
#: Parameters of one specimen, [specimens.priors]; the first two must be given.
SPECIMEN_PARAMETERS = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
REQUIRED_PARAMETERS = SPECIMEN_PARAMETERS[:2]
#: Parameters of one sweep, also written in [specimens.priors], where they hold for each sweep of the specimen.
SWEEP_PARAMETERS = ("contact_offset", "load_zero", "clock_offset")


@dataclass(frozen=True)
class SweepFiles:
    """The lab files of one press of a ball into a specimen; one of the two may be missing.

    Attributes
    ----------
    name : "" for the only sweep of a specimen in the short form.
    force, capacitance : absolute paths; both may be the same file.
    indenter_radius : [m].
    """

    name: str
    force: Path | None
    capacitance: Path | None
    indenter_radius: float


@dataclass(frozen=True)
class Specimen:
    """One sensor on its padding: its sweeps and the priors named for it, by parameter (see `SPECIMEN_PARAMETERS`)."""

    name: str
    sweeps: tuple[SweepFiles, ...]
    priors: Mapping[str, Prior]


@dataclass(frozen=True)
class Experiment:
    """What an experiment file says, checked; what it does not name is not in it (see `calib.prior.DEFAULT_PRIORS`).

    Attributes
    ----------
    path : absolute path of the file; sha256 : hash of its bytes.
    indenter_radius, sensor_radius : [m].
    padding_material : "sensor" for the sensor's silicone (one modulus), "own" for a modulus of its own.
    priors : shared by all specimens, by parameter (see `SHARED_PARAMETERS`).
    model : the forward model to calibrate with.
    discrepancy : whether the residuals of a sweep are modelled as correlated.
    """

    name: str
    path: Path
    sha256: str
    indenter_radius: float
    sensor_radius: float
    padding_material: PaddingMaterial
    priors: Mapping[str, Prior]
    specimens: tuple[Specimen, ...]
    model: Model = "surrogate"
    discrepancy: Discrepancy = "on"


# --- experiment.toml ----------------------------------------------------------------------------------------------------

_TOP = ("name", "model", "discrepancy", "indenter", "sensor", "padding", "priors", "specimens")
_SHORT_FORM = ("force", "capacitance", "indenter_radius")

# Where a key belongs that stands in the wrong table.
_PLACES: Mapping[str, str] = {
    **dict.fromkeys(("model", "discrepancy"), "at the top of the file, before the first [table]"),
    **dict.fromkeys(SHARED_PARAMETERS, "in [priors], shared by all specimens"),
    **dict.fromkeys((*SPECIMEN_PARAMETERS, *SWEEP_PARAMETERS), "in [specimens.priors], below its [[specimens]]"),
    **dict.fromkeys(("force", "capacitance", "sweeps"), "in [[specimens]]"),
    "material": "in [padding]",
    "sensor_radius": 'in [sensor], as radius = "10 mm"',
    "indenter_radius": 'in [indenter], as radius = "5 mm"',
    "radius": "in [indenter] (of the ball) or [sensor] (of the disc)",
}

# Keys that are right elsewhere or under another name, by table.
_HINTS: Mapping[tuple[str, str], str] = {
    ("[indenter]", "friction_coefficient"): "A calibration is frictionless; only a design file takes a friction_coefficient",
    ("[indenter]", "diameter"): "Give the radius",
    ("[sensor]", "diameter"): "Give the radius",
    ("[sensor]", "thickness"): f"Give sensor_thickness = {EXAMPLES['sensor_thickness']} in [specimens.priors] of each specimen",
    (
        "[padding]",
        "thickness",
    ): f"Give padding_thickness = {EXAMPLES['padding_thickness']} in [specimens.priors] of each specimen",
    ("[padding]", "young_modulus"): 'Write material = "own" and give padding_young_modulus in [priors]',
    ("[[specimens.sweeps]]", "priors"): "Give them in [specimens.priors], where they hold for every sweep of the specimen",
}


def read_experiment(path: Path) -> Experiment:
    """Read and check an experiment file; lab files are looked for relative to it, and must exist, but are not opened.

    Parameters
    ----------
    path : TOML file in UTF-8, of the form::

        name = "Padded sensor"
        model = "surrogate"              # optional: surrogate, fem, closed form
        discrepancy = "on"               # optional: on, off
        [indenter]
        radius = "5 mm"
        [sensor]
        radius = "10 mm"
        electrode_radius = "9 mm"        # optional, known; or a prior in [priors]; default the disc radius
        dielectric_thickness = "0.16 mm" # optional, known for all specimens; or a prior in [specimens.priors]
        [padding]
        material = "sensor"              # optional: "sensor" (same silicone) or "own"
        [priors]
        young_modulus = { lognormal = ["0.7 MPa", 1.6] }
        [[specimens]]
        name = "sensor 1"
        force = "sensor1_instron.csv"    # at least one of force and capacitance, or [[specimens.sweeps]] with them
        capacitance = "sensor1_lcr.csv"
        [specimens.priors]
        sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
        padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    toml = _read_toml(path)
    meant = _check_keys(toml, (), _TOP)
    indenter_radius = _radius(toml, "indenter", ("radius",), "5 mm", quiet="indenter" in meant)
    known_sensor = ("radius", "electrode_radius", "dielectric_thickness")
    sensor_radius = _radius(toml, "sensor", known_sensor, "10 mm", quiet="sensor" in meant)

    padding = _table(toml, ("padding",))
    _check_keys(toml, ("padding",), ("material",))
    material = _choice(toml, ("padding", "material"), padding.get("material", "sensor"), ("sensor", "own"))

    priors = _priors(toml, ("priors",), SHARED_PARAMETERS)
    if material == "sensor" and "padding_young_modulus" in priors:
        message = 'padding_young_modulus has no meaning for padding of the material "sensor"'
        toml.fault(("priors", "padding_young_modulus"), message, 'Write material = "own" in [padding] or leave the prior out')
    known = _known_geometry(toml)
    for parameter in priors.keys() & known.keys():
        toml.fault(("priors", parameter), f"{parameter} is given twice, here and in [sensor]", "Keep one of the two")
    if "electrode_radius" in known:
        priors["electrode_radius"] = known["electrode_radius"]
    if (electrode := priors.get("electrode_radius")) is not None and _median(electrode) > sensor_radius * (1 + 1e-9):
        place = ("sensor", "electrode_radius") if "electrode_radius" in known else ("priors", "electrode_radius")
        got = f"{display('electrode_radius', _median(electrode))} on a disc of {display('sensor_radius', sensor_radius)}"
        toml.fault(place, f"electrode_radius must not exceed the disc radius, got {got}")

    experiment = Experiment(
        name=_text(toml, ("name",), default=path.stem),
        path=path.absolute(),
        sha256=toml.sha256,
        indenter_radius=indenter_radius,
        sensor_radius=sensor_radius,
        padding_material=cast(PaddingMaterial, material),
        priors=priors,
        specimens=_specimens(toml, indenter_radius, known.get("dielectric_thickness"), quiet="specimens" in meant),
        model=cast(Model, _choice(toml, ("model",), toml.data.get("model", "surrogate"), ("surrogate", "fem", "closed form"))),
        discrepancy=cast(Discrepancy, _choice(toml, ("discrepancy",), toml.data.get("discrepancy", "on"), ("off", "on"))),
    )
    _raise(toml)
    return experiment


def _radius(toml: _Toml, name: str, known: Sequence[str], example: str, *, quiet: bool) -> float:
    """The required radius in the table `name`, which has the keys `known`; nan and a fault (unless `quiet`) without one."""
    meant = _check_keys(toml, (name,), known)
    required = f'radius = "{example}" in [{name}]'
    return _value(toml, (name, "radius"), f"{name}_radius", required=required, quiet=quiet or "radius" in meant)


def _known_geometry(toml: _Toml) -> dict[str, Fixed]:
    """Dimensions that [sensor] gives as known numbers."""
    known: dict[str, Fixed] = {}
    for parameter in ("electrode_radius", "dielectric_thickness"):
        if parameter in _table(toml, ("sensor",)):
            value = _value(toml, ("sensor", parameter), parameter)
            if math.isfinite(value):
                known[parameter] = Fixed(value)
    return known


def _specimens(toml: _Toml, radius: float, dielectric: Fixed | None, *, quiet: bool) -> tuple[Specimen, ...]:
    required = "" if quiet else 'Give at least one, with name = "sensor 1" and its force or capacitance file'
    tables = _tables(toml, ("specimens",), required=required)
    specimens: list[Specimen] = []
    lines: dict[str, int] = {}
    files: dict[Path, str] = {}
    for at in tables:
        meant = _check_keys(toml, at, ("name", *_SHORT_FORM, "sweeps", "priors"))
        name = _text(toml, (*at, "name"), required='name = "sensor 1"', quiet="name" in meant)
        _check_name(toml, (*at, "name"), name)
        if name and name in lines:
            toml.fault(
                (*at, "name"), f'specimen "{name}" is given twice, first in line {lines[name]}', "Give each its own name"
            )
        lines.setdefault(name, toml.place((*at, "name"))[0])
        priors = _priors(toml, (*at, "priors"), (*SPECIMEN_PARAMETERS, *SWEEP_PARAMETERS), required=REQUIRED_PARAMETERS)
        if dielectric is not None and "dielectric_thickness" in priors:
            message = "dielectric_thickness is given twice, here and in [sensor]"
            toml.fault((*at, "priors", "dielectric_thickness"), message, "Keep one of the two")
        elif dielectric is not None:
            priors["dielectric_thickness"] = dielectric
        _check_dielectric(toml, at, priors)
        sweeps = _sweeps(toml, at, radius, meant)
        for sweep, place in sweeps:
            main = sweep.force or sweep.capacitance
            if main is not None and main.resolve() in files:
                message = f"{main.name} is used twice, it already belongs to {files[main.resolve()]}"
                toml.fault(place, message, "Data counted twice make the result too certain: give each press its own file")
            elif main is not None:
                files[main.resolve()] = f'specimen "{name}"' + (f', sweep "{sweep.name}"' if sweep.name else "")
        specimens.append(Specimen(name, tuple(sweep for sweep, _ in sweeps), priors))
    return tuple(specimens)


def _check_dielectric(toml: _Toml, at: KeyPath, priors: Mapping[str, Prior]) -> None:
    """Two dielectrics must fit into the sensor, at least at the medians of the priors."""
    dielectric, sensor = priors.get("dielectric_thickness"), priors.get("sensor_thickness")
    if dielectric is None or sensor is None or _median(dielectric) <= _median(sensor) / 2 * (1 + 1e-9):
        return
    got = (
        f"{display('dielectric_thickness', _median(dielectric))} in a sensor of {display('sensor_thickness', _median(sensor))}"
    )
    own = (*at, "priors", "dielectric_thickness")
    place = own if own in toml.places else ("sensor", "dielectric_thickness")
    toml.fault(place, f"dielectric_thickness (of each of the two) must not exceed half the sensor thickness, got {got}")


def _sweeps(toml: _Toml, at: KeyPath, radius: float, meant: set[str]) -> list[tuple[SweepFiles, KeyPath]]:
    """The sweeps of the specimen at `at`, each with the place of its files, for faults found later."""
    specimen = _table(toml, at)
    short = [key for key in _SHORT_FORM if key in specimen]
    if "sweeps" not in specimen:
        if not short and meant.isdisjoint(_SHORT_FORM) and "sweeps" not in meant:
            message = f"specimen {_quoted(specimen.get('name'))} has neither a force nor a capacitance file"
            toml.fault(at, message, 'Give for example force = "sensor1_instron.csv"')
            return []
        return [_sweep(toml, at, "", radius, quiet=not meant.isdisjoint(_SHORT_FORM))]
    if short:
        message = f"specimen {_quoted(specimen.get('name'))} has both {short[0]} and [[specimens.sweeps]]"
        toml.fault((*at, short[0]), message, "Move it into a [[specimens.sweeps]] of its own, or leave the sweeps out")
    sweeps: list[tuple[SweepFiles, KeyPath]] = []
    for number, place in enumerate(_tables(toml, (*at, "sweeps")), start=1):
        found = _check_keys(toml, place, ("name", *_SHORT_FORM))
        name = _text(toml, (*place, "name"), default=f"sweep {number}")
        _check_name(toml, (*place, "name"), name)
        if name in (sweep.name for sweep, _ in sweeps):
            message = f'sweep "{name}" of specimen {_quoted(specimen.get("name"))} is given twice'
            toml.fault((*place, "name"), message, "Give each its own name")
        sweeps.append(_sweep(toml, place, name, radius, quiet=not found.isdisjoint(_SHORT_FORM)))
    return sweeps


def _sweep(toml: _Toml, at: KeyPath, name: str, radius: float, *, quiet: bool) -> tuple[SweepFiles, KeyPath]:
    table = _table(toml, at)
    if "indenter_radius" in table:
        radius = _value(toml, (*at, "indenter_radius"), "indenter_radius")
    if "force" not in table and "capacitance" not in table and not quiet:
        what = f'sweep "{name}"' if name else f"specimen {_quoted(table.get('name'))}"
        toml.fault(at, f"{what} has neither a force nor a capacitance file", 'Give for example force = "sensor1_instron.csv"')
    force, capacitance = (_lab_file(toml, (*at, key)) if key in table else None for key in ("force", "capacitance"))
    return SweepFiles(name, force, capacitance, radius), (*at, "force" if "force" in table else "capacitance")


def _lab_file(toml: _Toml, at: KeyPath) -> Path | None:
    """The lab file named at `at`, absolute; None and a fault if it is not there."""
    text = _text(toml, at)
    if not text:
        return None
    if "\0" in text:
        toml.fault(at, f"{at[-1]} is not the name of a file, got {text!r}")
        return None
    path = Path(os.path.abspath(toml.path.parent / text))  # not resolve(): a symbolic link keeps its name
    if path.is_file():
        return path
    what = f"{at[-1]} file"
    if path.is_dir():
        toml.fault(at, f"{what} {path} is a folder", _neighbours(path, path.name))
    elif "\\" in text:
        toml.fault(at, f"{what} not found: {path}", "Write paths with forward slashes")
    elif not path.parent.is_dir():
        advice = "Write paths relative to the experiment file"
        toml.fault(at, f"{what} not found, there is no folder {path.parent}", advice)
    else:
        toml.fault(at, f"{what} not found: {path}", _neighbours(path.parent, path.name))
    return None


def _neighbours(folder: Path, wanted: str) -> str:
    """Advice that names the CSV files of a folder, those spelled most like the wanted one first."""
    suffixes = {".csv", Path(wanted).suffix.lower()} - {""}
    try:
        names = sorted(p.name for p in folder.iterdir() if p.suffix.lower() in suffixes and p.is_file())
    except OSError as error:
        return f"The folder cannot be listed: {error.strerror}"
    if not names:
        return "There are no CSV files in that folder"
    likely = difflib.get_close_matches(wanted, names, n=3, cutoff=0.6)
    names = likely + [name for name in names if name not in likely]
    more = f" and {len(names) - 12} more" if len(names) > 12 else ""
    return f"CSV files in that folder: {', '.join(names[:12])}{more}"


def _priors(toml: _Toml, at: KeyPath, known: Sequence[str], required: Sequence[str] = ()) -> dict[str, Prior]:
    table = _table(toml, at)
    meant = _check_keys(toml, at, known)
    priors: dict[str, Prior] = {}
    for parameter, value in table.items():
        if parameter in known:
            try:
                priors[parameter] = parse_prior(parameter, value)
            except InputError as error:
                toml.add((*at, parameter), error.faults)
    for parameter in required:
        if parameter not in table and parameter not in meant:
            where = f"specimen {_quoted(_table(toml, at[:-1]).get('name'))}"
            advice = f"Give {parameter} = {EXAMPLES[parameter]} in [specimens.priors], as measured"
            toml.fault(at, f"{parameter} of {where} is missing", advice)
    return priors


def _check_name(toml: _Toml, at: KeyPath, name: str) -> None:
    """Names stand in brackets behind parameters, as in contact_offset[sensor 1, ball 2]."""
    if any(c in name for c in "[],\n\r"):
        toml.fault(at, f'name "{name}" must not contain brackets, commas or line breaks')


def _median(prior: Prior) -> float:
    return float(prior.ppf_normal(0.0))


# --- design.toml --------------------------------------------------------------------------------------------------------

_DESIGN_TABLES: Mapping[str, Mapping[str, str]] = {
    "indenter": {"radius": "indenter_radius", "friction_coefficient": ""},
    "sensor": {
        "thickness": "sensor_thickness",
        "radius": "sensor_radius",
        "young_modulus": "young_modulus",
        "relative_permittivity": "relative_permittivity",
        "electrode_radius": "electrode_radius",
        "dielectric_thickness": "dielectric_thickness",
    },
    "padding": {"thickness": "padding_thickness", "young_modulus": "padding_young_modulus"},
}
_DESIGN_REQUIRED: Mapping[tuple[str, str], str] = {
    ("indenter", "radius"): '"5 mm"',
    ("sensor", "thickness"): '"0.74 mm"',
    ("sensor", "radius"): '"10 mm"',
    ("sensor", "young_modulus"): '"0.69 MPa"',
    ("sensor", "relative_permittivity"): "2.8",
    ("padding", "thickness"): '"1.10 mm", or "0 mm" for none',
}


def read_design(path: Path) -> Design:
    """Read and check a design file.

    Parameters
    ----------
    path : TOML file in UTF-8, of the form::

        [indenter]
        radius = "5 mm"
        friction_coefficient = 0.0        # optional
        [sensor]
        thickness = "0.74 mm"
        radius = "10 mm"
        young_modulus = "0.69 MPa"
        relative_permittivity = 2.8
        electrode_radius = "10 mm"        # optional, default the disc radius
        dielectric_thickness = "0.37 mm"  # optional, default half the sensor thickness
        [padding]
        thickness = "1.10 mm"
        young_modulus = "0.69 MPa"        # optional, default the sensor's

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    toml = _read_toml(path)
    tables = _check_keys(toml, (), tuple(_DESIGN_TABLES), misplaced=False)
    value: dict[tuple[str, str], float] = {}
    for name, keys in _DESIGN_TABLES.items():
        meant = _check_keys(toml, (name,), tuple(keys), misplaced=False)
        for key, parameter in keys.items():
            at = (name, key)
            example = _DESIGN_REQUIRED.get(at, "")
            if not parameter:
                value[at] = _friction(toml, at)
            elif example or key in _table(toml, (name,)):
                required = f"{key} = {example} in [{name}]"
                value[at] = _value(toml, at, parameter, required=required, quiet=key in meant or name in tables)
    radius, thickness = value.get(("sensor", "radius"), math.nan), value.get(("sensor", "thickness"), math.nan)
    electrode, dielectric = (value.get(("sensor", k), math.nan) for k in ("electrode_radius", "dielectric_thickness"))
    if electrode > radius * (1 + 1e-9):
        got = f"{display('electrode_radius', electrode)} on a disc of {display('sensor_radius', radius)}"
        toml.fault(("sensor", "electrode_radius"), f"electrode_radius must not exceed the disc radius, got {got}")
    if dielectric > thickness / 2 * (1 + 1e-9):
        got = f"{display('dielectric_thickness', dielectric)} in a sensor of {display('sensor_thickness', thickness)}"
        message = f"dielectric_thickness (of each of the two) must not exceed half the sensor thickness, got {got}"
        toml.fault(("sensor", "dielectric_thickness"), message)
    _raise(toml)
    return Design(
        Indenter(value["indenter", "radius"], value["indenter", "friction_coefficient"]),
        Sensor(**{key: value["sensor", key] for key in _DESIGN_TABLES["sensor"] if ("sensor", key) in value}),
        Padding(**{key: value["padding", key] for key in _DESIGN_TABLES["padding"] if ("padding", key) in value}),
    )


def _friction(toml: _Toml, at: tuple[str, str]) -> float:
    """The optional friction coefficient, a plain number that is not negative."""
    value = _table(toml, at[:1]).get(at[1], 0.0)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < 0:
        toml.fault(at, f"friction_coefficient must be a plain number of zero or more, got {_quoted(value)}")
        return 0.0
    return float(value)


# --- JSON ---------------------------------------------------------------------------------------------------------------

_JSON_VERSION = 1


def experiment_to_json(experiment: Experiment) -> str:
    """The whole experiment as JSON text, SI; the inverse is `experiment_from_json`."""

    def priors(given: Mapping[str, Prior]) -> dict[str, object]:
        return {parameter: prior.to_json() for parameter, prior in given.items()}

    def file(path: Path | None) -> str | None:
        return None if path is None else str(path)

    specimens = [
        {
            "name": specimen.name,
            "sweeps": [
                {
                    "name": sweep.name,
                    "force": file(sweep.force),
                    "capacitance": file(sweep.capacitance),
                    "indenter_radius": sweep.indenter_radius,
                }
                for sweep in specimen.sweeps
            ],
            "priors": priors(specimen.priors),
        }
        for specimen in experiment.specimens
    ]
    document = {
        "version": _JSON_VERSION,
        "name": experiment.name,
        "path": str(experiment.path),
        "sha256": experiment.sha256,
        "indenter_radius": experiment.indenter_radius,
        "sensor_radius": experiment.sensor_radius,
        "padding_material": experiment.padding_material,
        "model": experiment.model,
        "discrepancy": experiment.discrepancy,
        "priors": priors(experiment.priors),
        "specimens": specimens,
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False)


def experiment_from_json(text: str) -> Experiment:
    """The experiment that `experiment_to_json` wrote; the files it names need not exist any more.

    Raises
    ------
    ValueError
        If the text is not of the version that this program writes.
    """
    document: dict[str, Any] = json.loads(text)
    if document.get("version") != _JSON_VERSION:
        raise ValueError(f"experiment of version {document.get('version')!r}, this program reads version {_JSON_VERSION}")

    def priors(given: Mapping[str, Mapping[str, object]]) -> dict[str, Prior]:
        return {parameter: prior_from_json(prior) for parameter, prior in given.items()}

    def file(path: str | None) -> Path | None:
        return None if path is None else Path(path)

    specimens = tuple(
        Specimen(
            specimen["name"],
            tuple(
                SweepFiles(sweep["name"], file(sweep["force"]), file(sweep["capacitance"]), float(sweep["indenter_radius"]))
                for sweep in specimen["sweeps"]
            ),
            priors(specimen["priors"]),
        )
        for specimen in document["specimens"]
    )
    return Experiment(
        name=document["name"],
        path=Path(document["path"]),
        sha256=document["sha256"],
        indenter_radius=float(document["indenter_radius"]),
        sensor_radius=float(document["sensor_radius"]),
        padding_material=document["padding_material"],
        priors=priors(document["priors"]),
        specimens=specimens,
        model=document["model"],
        discrepancy=document["discrepancy"],
    )


# --- TOML with places ---------------------------------------------------------------------------------------------------

#: Where something stands in a TOML document: ("specimens", 0, "priors", "sensor_thickness").
KeyPath = tuple[str | int, ...]


@dataclass(frozen=True)
class _Toml:
    """A parsed TOML file, the places of its keys, and the faults found so far (the one thing here that grows)."""

    path: Path
    data: dict[str, Any]
    sha256: str
    places: Mapping[KeyPath, tuple[int, int]]
    faults: list[Fault] = field(default_factory=list)

    def place(self, at: KeyPath) -> tuple[int, int]:
        """Line and column of a key, or of the innermost table around it that is written down, or else the top of the file."""
        while at and at not in self.places:
            at = at[:-1]
        return self.places.get(at, (1, 1))

    def fault(self, at: KeyPath, message: str, advice: str = "") -> None:
        self.add(at, (Fault(message, advice=advice),))

    def add(self, at: KeyPath, faults: Iterable[Fault]) -> None:
        line, column = self.place(at)
        self.faults.extend(replace(fault, path=self.path, line=line, column=column) for fault in faults)


def _read_toml(path: Path) -> _Toml:
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        tomls = sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
        advice = f"TOML files in that folder: {', '.join(tomls[:12])}" if tomls else ""
        raise InputError(Fault(f"file not found: {path.absolute()}", path, advice=advice)) from None
    except OSError as error:
        raise InputError(Fault(f"cannot be read: {error.strerror or error}", path)) from None
    try:
        text = raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        message = f"is not UTF-8 text, found the byte 0x{raw[error.start]:02x}"
        raise InputError(Fault(message, path, line, column, advice="Save the file as UTF-8")) from None
    try:
        data, places = tomllib.loads(text), locate_keys(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(_syntax_fault(path, text, str(error))) from None
    except RecursionError:
        raise InputError(Fault("is nested too deeply", path)) from None
    return _Toml(path, data, hashlib.sha256(raw).hexdigest(), places)


def _syntax_fault(path: Path, text: str, message: str) -> Fault:
    """A TOML syntax error with its place, which Python only tells in the message, and the usual cause."""
    lines = text.splitlines() or [""]
    match = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    if match is None:
        return Fault(f"is not valid TOML: {message}", path)
    line, column = (int(match[1]), int(match[2])) if match[1] else (len(lines), len(lines[-1]) + 1)
    what = message[: match.start()]
    shown = lines[line - 1].strip() if line <= len(lines) else ""
    advice = ""
    if "\\" in shown and '"' in shown:
        advice = 'Write paths with forward slashes: "data/sensor1.csv"'
    elif (what == "Invalid value" and match[1]) or re.search(r"=\s*[-+]?[\d.]+\s*[A-Za-zµμ]", shown):
        advice = 'Texts, file names and quantities stand in quotes: "0.74 mm"'
    elif what.startswith("Cannot overwrite"):
        advice = "A key may be given only once"
    elif what.startswith("Cannot declare"):
        advice = "A table may be given only once; several specimens are each written [[specimens]]"
    return Fault(f"is not valid TOML: {what}" + (f" in `{shown}`" if shown else ""), path, line, column, advice)


def _raise(toml: _Toml) -> None:
    """All faults at once, in the order of the file."""
    if toml.faults:
        raise InputError(sorted(dict.fromkeys(toml.faults), key=lambda f: (f.line or 0, f.column or 0)))


def _get(toml: _Toml, at: KeyPath) -> Any:
    value: Any = toml.data
    for key in at:
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            return None
    return value


def _table(toml: _Toml, at: KeyPath) -> dict[str, Any]:
    """The table at `at`; an empty one if there is none (`_check_keys` has the fault for what is not a table)."""
    value = _get(toml, at)
    return value if isinstance(value, dict) else {}


def _tables(toml: _Toml, at: KeyPath, *, required: str = "") -> list[KeyPath]:
    """Paths of the tables in the array of tables at `at`."""
    value = _get(toml, at)
    name = ".".join(str(key) for key in at if isinstance(key, str))
    if isinstance(value, list) and all(isinstance(entry, dict) for entry in value):
        if not value:
            toml.fault(at, f"[[{name}]] is empty", required)
        return [(*at, i) for i in range(len(value))]
    if isinstance(value, dict):
        toml.fault(at, f"[{name}] must be a list of tables", f"Write [[{name}]] in double brackets above each of them")
    elif value is not None:
        toml.fault(at, f"{name} must be a list of tables, got {_quoted(value)}", f"Write [[{name}]] above each of them")
    elif required:
        toml.fault((), f"there is no [[{name}]]", required)
    return []


def _check_keys(toml: _Toml, at: KeyPath, known: Sequence[str], *, misplaced: bool = True) -> set[str]:
    """Faults for the keys of the table at `at` that are not `known`; returns those known ones that were probably meant.

    With `misplaced`, a key that is known elsewhere in an experiment file is told where it belongs.
    """
    table = toml.data if not at else _get(toml, at)
    where = _heading(at)
    if table is None:
        return set()
    if not isinstance(table, dict):
        toml.fault(at, f"{where} must be a table, got {_quoted(table)}")
        return set()
    meant = set()
    for key in table:
        if key in known:
            continue
        spelled = key.lower().replace("-", "_").replace(" ", "_")
        close = difflib.get_close_matches(spelled, [*known, *_PLACES] if misplaced else known, n=1)
        advice = f"Known here: {', '.join(known)}"
        if misplaced and (where, key) in _HINTS:
            advice = _HINTS[where, key]
        elif misplaced and key in _PLACES:
            advice = f"It belongs {_PLACES[key]}"
        elif close and close[0] in known:
            advice = f'Did you mean "{close[0]}"?'
            meant.add(close[0])
        elif close:
            advice = f'Did you mean "{close[0]}"? It belongs {_PLACES[close[0]]}'
        toml.fault((*at, key), f'unknown key "{key}" {"in " + where if at else "at the top of the file"}', advice)
    return meant


def _heading(at: KeyPath) -> str:
    """The TOML heading of a table: [specimens.priors], [[specimens.sweeps]]."""
    name = ".".join(str(key) for key in at if isinstance(key, str))
    return f"[[{name}]]" if at and isinstance(at[-1], int) else f"[{name}]"


def _value(toml: _Toml, at: KeyPath, parameter: str, *, required: str = "", quiet: bool = False) -> float:
    """The quantity at `at`, SI, its sign checked; nan and a fault if it is wrong, or missing and `required` and not `quiet`."""
    value = _get(toml, at)
    if value is None:
        if required and not quiet and isinstance(_get(toml, at[:-1]), dict | None):
            toml.fault(at[:-1], f"{parameter} is missing", f"Give {required}")
        return math.nan
    try:
        number = parse_value(parameter, value)
    except InputError as error:
        toml.add(at, error.faults)
        return math.nan
    if fault := sign_fault(parameter, number, str(value)):
        toml.add(at, (fault,))
        return math.nan
    return number


def _text(toml: _Toml, at: KeyPath, *, default: str = "", required: str = "", quiet: bool = False) -> str:
    """The text at `at`; "" and a fault if it is not one, is empty, or is missing and `required` (unless `quiet`)."""
    value = _get(toml, at)
    if value is None:
        if required and not quiet:
            toml.fault(at[:-1], f"{at[-1]} is missing in {_heading(at[:-1])}", f"Give {required}")
        return default
    if not isinstance(value, str) or not value.strip():
        toml.fault(at, f"{at[-1]} must be a text in quotes, got {_quoted(value)}")
        return ""
    return value.strip()


def _choice(toml: _Toml, at: KeyPath, value: object, choices: Sequence[str]) -> str:
    if isinstance(value, str) and value in choices:
        return value
    close = difflib.get_close_matches(str(value).lower(), choices, n=1)
    one_of = " or ".join(f'"{choice}"' for choice in choices)
    toml.fault(at, f"{at[-1]} must be {one_of}, got {_quoted(value)}", f'Did you mean "{close[0]}"?' if close else "")
    return choices[0]


def _quoted(value: object) -> str:
    """A value as it stands in a TOML file, good enough for a message."""
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return "without a name"
    return f'"{value}"' if isinstance(value, str) else "a table" if isinstance(value, dict) else str(value)


# --- locator ------------------------------------------------------------------------------------------------------------

_BLANK = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PLAIN_VALUE = re.compile(r"[^,\]}#\n]+")
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}(?!")'  # multi-line, basic: up to two quotes may stand before the closing three
    r"|'''.*?'{3,5}(?!')"  # multi-line, literal
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)


def locate_keys(text: str) -> dict[KeyPath, tuple[int, int]]:
    """Line and column (from 1) of every key, table header and array entry of a valid TOML text with LF line ends.

    Entries of arrays are addressed by their index, those of an array of tables by the place of their header.

    >>> locate_keys('[[specimens]]\\nname = "a"\\n  [specimens.priors]\\n  x.y = 1')[("specimens", 0, "priors", "x", "y")]
    (4, 5)
    """
    places: dict[KeyPath, tuple[int, int]] = {}
    counts: dict[KeyPath, int] = {}

    def place(index: int) -> tuple[int, int]:
        return text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index)

    def mark(path: KeyPath, index: int) -> None:
        places.setdefault(path, place(index))

    def table(path: KeyPath) -> KeyPath:
        # A path through an array of tables means the table begun last.
        return (*path, counts[path] - 1) if path in counts else path

    def keys(index: int, path: KeyPath, resolve: Callable[[KeyPath], KeyPath]) -> tuple[int, KeyPath]:
        """A dotted key below `path`; returns the index behind it and the path, of which all but the last key is resolved."""
        while True:
            index = _end(_SPACE, text, index)
            end = _end(_BARE_KEY if text[index] not in "\"'" else _STRING, text, index)
            raw = text[index:end]
            path = (*path, tomllib.loads(f"k = {raw}")["k"] if raw[0] in "\"'" else raw)
            mark(path, index)
            index = _end(_SPACE, text, end)
            if text[index] != ".":
                return index, path
            path, index = resolve(path), index + 1

    def pair(index: int, path: KeyPath) -> int:
        index, path = keys(index, path, lambda below: below)
        return value(_end(_SPACE, text, index + 1), path)  # + 1: the equals sign

    def value(index: int, path: KeyPath) -> int:
        if text[index] in "\"'":
            return _end(_STRING, text, index)
        if text[index] == "[":
            return series(index, "]", lambda at, n: mark_value(at, (*path, n)))
        if text[index] == "{":
            return series(index, "}", lambda at, _: pair(at, path))
        return _end(_PLAIN_VALUE, text, index)

    def mark_value(index: int, path: KeyPath) -> int:
        mark(path, index)
        return value(index, path)

    def series(index: int, close: str, entry: Callable[[int, int], int]) -> int:
        index, number = _end(_BLANK, text, index + 1), 0
        while text[index] != close:
            index, number = _end(_BLANK, text, entry(index, number)), number + 1
            if text[index] == ",":
                index = _end(_BLANK, text, index + 1)
        return index + 1

    here: KeyPath = ()
    index = _end(_BLANK, text, 0)
    while index < len(text):
        if text.startswith("[[", index):
            start = index
            index, here = keys(index + 2, (), table)
            counts[here] = counts.get(here, 0) + 1
            here = table(here)
            places[here] = place(start)
            index += 2
        elif text[index] == "[":
            start = index
            index, here = keys(index + 1, (), table)
            places[here] = place(start)
            index += 1
        else:
            index = pair(index, here)
        index = _end(_BLANK, text, index)
    return places


def _end(pattern: re.Pattern[str], text: str, index: int) -> int:
    match = pattern.match(text, index)
    if match is None:  # cannot be in a text that tomllib has read
        raise ValueError(f"cannot find the keys of the TOML text behind character {index}")
    return match.end()
