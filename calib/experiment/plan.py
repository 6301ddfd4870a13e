"""Experiment files: from TOML text to a checked `Experiment`, all faults at once with their places."""

from __future__ import annotations

import difflib
import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

from calib.errors import InputError
from calib.experiment.toml_file import (
    KeyPath,
    Signposts,
    Toml,
    check_keys,
    choice_at,
    quantity_at,
    quoted,
    raise_faults,
    read_toml,
    table_at,
    tables_at,
    text_at,
)
from calib.lab.instruments import AS_FOUND, QUANTITIES, Reading
from calib.priors.prior import EXAMPLES, Fixed, Prior, display, parse_prior, prior_from_json
from models.surrogate.families import Family, family_of

Model = Literal["surrogate", "fem", "closed form"]
Discrepancy = Literal["off", "on"]
PaddingMaterial = Literal["sensor", "own"]
MaterialLaw = Literal["neo-hookean", "gent"]

#: Parameters of material and rig, shared by all specimens: [priors].
SHARED_PARAMETERS = (
    "young_modulus",
    "padding_young_modulus",
    "stiffening",
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
    force_reading, capacitance_reading : what is said of the files: units, columns, which specimen in them.
    cycle, capacitance_cycle : which loading branch is used, counted from 1; None for the first, see `make_sweep`.
    """

    name: str
    force: Path | None
    capacitance: Path | None
    indenter_radius: float
    force_reading: Reading = AS_FOUND
    capacitance_reading: Reading = AS_FOUND
    cycle: int | None = None
    capacitance_cycle: int | None = None

    @property
    def own(self) -> tuple[Path | None, int | None, int | None]:
        """What no other sweep may be: the record that is counted."""
        if self.force is not None:
            return self.force.resolve(), self.force_reading.specimen, self.cycle
        path = None if self.capacitance is None else self.capacitance.resolve()
        return path, self.capacitance_reading.specimen, self.capacitance_cycle


@dataclass(frozen=True)
class Specimen:
    """One sensor on its padding: its sweeps and the priors named for it, by parameter (see `SPECIMEN_PARAMETERS`)."""

    name: str
    sweeps: tuple[SweepFiles, ...]
    priors: Mapping[str, Prior]


@dataclass(frozen=True)
class Experiment:
    """What an experiment file says, checked; what it does not name is not in it (see `calib.priors.prior.DEFAULT_PRIORS`).

    Attributes
    ----------
    path : absolute path of the file; sha256 : hash of its bytes.
    indenter_radius, sensor_radius : [m].
    padding_material : "sensor" for the sensor's silicone (one modulus), "own" for a modulus of its own.
    priors : shared by all specimens, by parameter (see `SHARED_PARAMETERS`).
    model : the forward model to calibrate with.
    discrepancy : whether the residuals of a sweep are modelled as correlated.
    law : of sensor and padding; Gent's has an unknown of its own, `stiffening`.
    stick : whether the sensor sticks to the ball, or slides on it without friction.
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
    law: MaterialLaw = "neo-hookean"
    stick: bool = False

    @property
    def family(self) -> Family | None:
        """Whose surrogate serves the specimens; None if there is none."""
        return family_of(stiffening=self.law == "gent", stick=self.stick)

    @property
    def friction_coefficient(self) -> float:
        """As in `models.sensor.Indenter`."""
        return math.inf if self.stick else 0.0


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
    "law": 'in [sensor], as law = "gent"',
    "friction_coefficient": 'in [indenter], as friction_coefficient = "stick"',
    "sensor_radius": 'in [sensor], as radius = "10 mm"',
    "indenter_radius": 'in [indenter], as radius = "5 mm"',
    "radius": "in [indenter] (of the ball) or [sensor] (of the disc)",
}

# Keys that are right elsewhere or under another name, by table.
_HINTS: Mapping[tuple[str, str], str] = {
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
_SIGNPOSTS = Signposts(_PLACES, _HINTS)


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
        friction_coefficient = 0         # optional: 0, or "stick" for a ball that the sensor sticks to
        [sensor]
        radius = "10 mm"
        law = "neo-hookean"              # optional: neo-hookean, or gent with the unknown stiffening; of the padding, too
        electrode_radius = "9 mm"        # optional, known; or a prior in [priors]; default the disc radius
        dielectric_thickness = "0.16 mm" # optional, known for all specimens; or a prior in [specimens.priors]
        [padding]
        material = "sensor"              # optional: "sensor" (same silicone) or "own"
        [priors]
        young_modulus = { lognormal = ["0.7 MPa", 1.6] }
        [[specimens]]
        name = "sensor 1"
        force = "sensor1_instron.csv"    # at least one of force and capacitance, or [[specimens.sweeps]] with them
        capacitance = "sensor1_lcr.csv"  # or a table that says how to read it, all but file optional:
                                         # { file = "lcr.csv", units = { capacitance = "pF" }, columns = { time = "T" },
                                         #   specimen = 2, cycle = 3 }
        [specimens.priors]
        sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
        padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    toml = read_toml(path)
    meant = check_keys(toml, (), _TOP, _SIGNPOSTS)
    indenter_radius = _radius(toml, "indenter", ("radius", "friction_coefficient"), "5 mm", quiet="indenter" in meant)
    known_sensor = ("radius", "law", "electrode_radius", "dielectric_thickness")
    sensor_radius = _radius(toml, "sensor", known_sensor, "10 mm", quiet="sensor" in meant)

    padding = table_at(toml, ("padding",))
    check_keys(toml, ("padding",), ("material",), _SIGNPOSTS)
    material = choice_at(toml, ("padding", "material"), padding.get("material", "sensor"), ("sensor", "own"))

    priors = _priors(toml, ("priors",), SHARED_PARAMETERS)
    if material == "sensor" and "padding_young_modulus" in priors:
        message = 'padding_young_modulus has no meaning for padding of the material "sensor"'
        toml.fault(("priors", "padding_young_modulus"), message, 'Write material = "own" in [padding] or leave the prior out')
    model = choice_at(toml, ("model",), toml.data.get("model", "surrogate"), ("surrogate", "fem", "closed form"))
    law = choice_at(toml, ("sensor", "law"), table_at(toml, ("sensor",)).get("law", "neo-hookean"), ("neo-hookean", "gent"))
    stick = _sticks(toml)
    if "stiffening" in priors and law != "gent":
        toml.fault(
            ("priors", "stiffening"),
            f"stiffening has no meaning for the law {law}",
            'Write law = "gent" in [sensor] or leave it out',
        )
    _check_model(toml, model, law, stick)
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
        name=text_at(toml, ("name",), default=path.stem),
        path=path.absolute(),
        sha256=toml.sha256,
        indenter_radius=indenter_radius,
        sensor_radius=sensor_radius,
        padding_material=cast(PaddingMaterial, material),
        priors=priors,
        specimens=_specimens(toml, indenter_radius, known.get("dielectric_thickness"), quiet="specimens" in meant),
        model=cast(Model, model),
        discrepancy=cast(Discrepancy, choice_at(toml, ("discrepancy",), toml.data.get("discrepancy", "on"), ("off", "on"))),
        law=cast(MaterialLaw, law),
        stick=stick,
    )
    raise_faults(toml)
    return experiment


def _sticks(toml: Toml) -> bool:
    """Whether the ball is one that the sensor sticks to."""
    at = ("indenter", "friction_coefficient")
    value = table_at(toml, at[:1]).get(at[1], 0)
    if value == "stick" or (not isinstance(value, bool) and value == 0):
        return bool(value == "stick")
    advice = "Calibrate with both and compare them: the truth lies between (`calib compare`)"
    toml.fault(at, f'friction_coefficient of a calibration must be 0 or "stick", got {quoted(value)}', advice)
    return False


def _check_model(toml: Toml, model: str, law: str, stick: bool) -> None:
    """Laws and contacts that the forward model does not know."""
    place = ("indenter", "friction_coefficient") if stick else ("sensor", "law")
    if model == "closed form" and (stick or law != "neo-hookean"):
        toml.fault(place, "the closed form knows neo-Hookean layers and a ball without friction", 'Write model = "surrogate"')
    elif model == "surrogate" and family_of(stiffening=law == "gent", stick=stick) is None:
        message = f'there is no surrogate for the law "{law}" with a ball that sticks'
        toml.fault(place, message, 'Leave one of the two out, or write model = "fem" and have patience')


def _radius(toml: Toml, name: str, known: Sequence[str], example: str, *, quiet: bool) -> float:
    """The required radius in the table `name`, which has the keys `known`; nan and a fault (unless `quiet`) without one."""
    meant = check_keys(toml, (name,), known, _SIGNPOSTS)
    required = f'radius = "{example}" in [{name}]'
    return quantity_at(toml, (name, "radius"), f"{name}_radius", required=required, quiet=quiet or "radius" in meant)


def _known_geometry(toml: Toml) -> dict[str, Fixed]:
    """Dimensions that [sensor] gives as known numbers."""
    known: dict[str, Fixed] = {}
    for parameter in ("electrode_radius", "dielectric_thickness"):
        if parameter in table_at(toml, ("sensor",)):
            value = quantity_at(toml, ("sensor", parameter), parameter)
            if math.isfinite(value):
                known[parameter] = Fixed(value)
    return known


def _specimens(toml: Toml, radius: float, dielectric: Fixed | None, *, quiet: bool) -> tuple[Specimen, ...]:
    required = "" if quiet else 'Give at least one, with name = "sensor 1" and its force or capacitance file'
    tables = tables_at(toml, ("specimens",), required=required)
    specimens: list[Specimen] = []
    lines: dict[str, int] = {}
    files: dict[tuple[Path | None, int | None, int | None], str] = {}
    for at in tables:
        meant = check_keys(toml, at, ("name", *_SHORT_FORM, "sweeps", "priors"), _SIGNPOSTS)
        name = text_at(toml, (*at, "name"), required='name = "sensor 1"', quiet="name" in meant)
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
            if main is not None and sweep.own in files:
                message = f"{main.name} is used twice, it already belongs to {files[sweep.own]}"
                toml.fault(place, message, "Data counted twice make the result too certain: give each press its own file")
            elif main is not None:
                files[sweep.own] = f'specimen "{name}"' + (f', sweep "{sweep.name}"' if sweep.name else "")
        specimens.append(Specimen(name, tuple(sweep for sweep, _ in sweeps), priors))
    return tuple(specimens)


def _check_dielectric(toml: Toml, at: KeyPath, priors: Mapping[str, Prior]) -> None:
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


def _sweeps(toml: Toml, at: KeyPath, radius: float, meant: set[str]) -> list[tuple[SweepFiles, KeyPath]]:
    """The sweeps of the specimen at `at`, each with the place of its files, for faults found later."""
    specimen = table_at(toml, at)
    short = [key for key in _SHORT_FORM if key in specimen]
    if "sweeps" not in specimen:
        if not short and meant.isdisjoint(_SHORT_FORM) and "sweeps" not in meant:
            message = f"specimen {quoted(specimen.get('name'))} has neither a force nor a capacitance file"
            toml.fault(at, message, 'Give for example force = "sensor1_instron.csv"')
            return []
        return [_sweep(toml, at, "", radius, quiet=not meant.isdisjoint(_SHORT_FORM))]
    if short:
        message = f"specimen {quoted(specimen.get('name'))} has both {short[0]} and [[specimens.sweeps]]"
        toml.fault((*at, short[0]), message, "Move it into a [[specimens.sweeps]] of its own, or leave the sweeps out")
    sweeps: list[tuple[SweepFiles, KeyPath]] = []
    for number, place in enumerate(tables_at(toml, (*at, "sweeps")), start=1):
        found = check_keys(toml, place, ("name", *_SHORT_FORM), _SIGNPOSTS)
        name = text_at(toml, (*place, "name"), default=f"sweep {number}")
        _check_name(toml, (*place, "name"), name)
        if name in (sweep.name for sweep, _ in sweeps):
            message = f'sweep "{name}" of specimen {quoted(specimen.get("name"))} is given twice'
            toml.fault((*place, "name"), message, "Give each its own name")
        sweeps.append(_sweep(toml, place, name, radius, quiet=not found.isdisjoint(_SHORT_FORM)))
    return sweeps


def _sweep(toml: Toml, at: KeyPath, name: str, radius: float, *, quiet: bool) -> tuple[SweepFiles, KeyPath]:
    table = table_at(toml, at)
    if "indenter_radius" in table:
        radius = quantity_at(toml, (*at, "indenter_radius"), "indenter_radius")
    if "force" not in table and "capacitance" not in table and not quiet:
        what = f'sweep "{name}"' if name else f"specimen {quoted(table.get('name'))}"
        toml.fault(at, f"{what} has neither a force nor a capacitance file", 'Give for example force = "sensor1_instron.csv"')
    nothing = (None, AS_FOUND, None)
    force, capacitance = (_lab_file(toml, (*at, key)) if key in table else nothing for key in ("force", "capacitance"))
    files = SweepFiles(name, force[0], capacitance[0], radius, force[1], capacitance[1], force[2], capacitance[2])
    return files, (*at, "force" if "force" in table else "capacitance")


def _lab_file(toml: Toml, at: KeyPath) -> tuple[Path | None, Reading, int | None]:
    """The lab file at `at`, absolute, how it is to be read, and the cycle; None and a fault if the file is not there."""
    if not isinstance(table_at(toml, at[:-1])[str(at[-1])], Mapping):
        return _path(toml, at), AS_FOUND, None
    table = table_at(toml, at)
    check_keys(toml, at, ("file", "units", "columns", "specimen", "cycle"), _SIGNPOSTS)
    units, columns = (_by_quantity(toml, (*at, key)) for key in ("units", "columns"))
    specimen, cycle = (_count(toml, (*at, key)) if key in table else None for key in ("specimen", "cycle"))
    if "file" not in table:
        toml.fault(at, f"{at[-1]} names no file", 'Give { file = "sensor1_instron.csv", ... }')
        return None, AS_FOUND, None
    return _path(toml, (*at, "file")), Reading(units, columns, specimen), cycle


def _by_quantity(toml: Toml, at: KeyPath) -> dict[str, str]:
    """A table of quantity = "text", or a number for a column."""
    found: dict[str, str] = {}
    check_keys(toml, at, QUANTITIES, _SIGNPOSTS)
    for quantity, value in table_at(toml, at).items():
        if isinstance(value, int) and not isinstance(value, bool) and at[-1] == "columns":
            found[quantity] = str(value)
        elif quantity in QUANTITIES:
            found[quantity] = text_at(toml, (*at, quantity))
    return found


def _count(toml: Toml, at: KeyPath) -> int | None:
    value = table_at(toml, at[:-1])[str(at[-1])]
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    toml.fault(at, f"{at[-1]} must be a whole number from 1, got {quoted(value)}")
    return None


def _path(toml: Toml, at: KeyPath) -> Path | None:
    text = text_at(toml, at)
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


def _priors(toml: Toml, at: KeyPath, known: Sequence[str], required: Sequence[str] = ()) -> dict[str, Prior]:
    table = table_at(toml, at)
    meant = check_keys(toml, at, known, _SIGNPOSTS)
    priors: dict[str, Prior] = {}
    for parameter, value in table.items():
        if parameter in known:
            try:
                priors[parameter] = parse_prior(parameter, value)
            except InputError as error:
                toml.add((*at, parameter), error.faults)
    for parameter in required:
        if parameter not in table and parameter not in meant:
            where = f"specimen {quoted(table_at(toml, at[:-1]).get('name'))}"
            advice = f"Give {parameter} = {EXAMPLES[parameter]} in [specimens.priors], as measured"
            toml.fault(at, f"{parameter} of {where} is missing", advice)
    return priors


def _check_name(toml: Toml, at: KeyPath, name: str) -> None:
    """Names stand in brackets behind parameters, as in contact_offset[sensor 1, ball 2]."""
    if any(c in name for c in "[],\n\r"):
        toml.fault(at, f'name "{name}" must not contain brackets, commas or line breaks')


def _median(prior: Prior) -> float:
    return float(prior.ppf_normal(0.0))


# --- JSON ---------------------------------------------------------------------------------------------------------------

_JSON_VERSION = 3


def experiment_to_json(experiment: Experiment) -> str:
    """The whole experiment as JSON text, SI; the inverse is `experiment_from_json`."""

    def priors(given: Mapping[str, Prior]) -> dict[str, object]:
        return {parameter: prior.to_json() for parameter, prior in given.items()}

    def file(path: Path | None) -> str | None:
        return None if path is None else str(path)

    def reading(how: Reading) -> dict[str, object]:
        return {"units": dict(how.units), "columns": dict(how.columns), "specimen": how.specimen}

    specimens = [
        {
            "name": specimen.name,
            "sweeps": [
                {
                    "name": sweep.name,
                    "force": file(sweep.force),
                    "capacitance": file(sweep.capacitance),
                    "indenter_radius": sweep.indenter_radius,
                    "force_reading": reading(sweep.force_reading),
                    "capacitance_reading": reading(sweep.capacitance_reading),
                    "cycle": sweep.cycle,
                    "capacitance_cycle": sweep.capacitance_cycle,
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
        "law": experiment.law,
        "stick": experiment.stick,
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
                SweepFiles(
                    sweep["name"],
                    file(sweep["force"]),
                    file(sweep["capacitance"]),
                    float(sweep["indenter_radius"]),
                    Reading(**sweep["force_reading"]),
                    Reading(**sweep["capacitance_reading"]),
                    sweep["cycle"],
                    sweep["capacitance_cycle"],
                )
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
        law=document["law"],
        stick=document["stick"],
    )
