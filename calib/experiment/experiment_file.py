"""Experiment files: from TOML text (or the same tables in Python) to a checked `Experiment`, all faults at once."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any, cast, get_args

from calib.catalogue import UNKNOWNS, display, unknowns_of
from calib.errors import InputError
from calib.experiment.edits import unedited_lines
from calib.experiment.lab_paths import check_name, read_sweeps_of
from calib.experiment.laboratory import instruments_in, laboratory_in
from calib.experiment.lots import CAST, lot_faults, wanted_faults
from calib.experiment.plan import Discrepancy, Experiment, MaterialLaw, Model, PaddingMaterial, Pooling, Specimen, SweepFiles
from calib.experiment.signposts import SIGNPOSTS, SWEEP_KEYS
from calib.experiment.toml_file import Toml, read_toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import check_keys, choice_at, quantity_at, quoted, raise_faults, table_at, tables_at, text_at
from calib.experiment.variants import model_in_words, possible_candidates, variants_of
from calib.priors import Fixed, Prior, parse_prior
from calib.visible import name_fault, shortened
from models.sensor import Base
from models.surrogate import shipped_in_words

#: Keys that a table of an experiment file may have; those of priors are the unknowns.
KEYS: Mapping[str, tuple[str, ...]] = {
    "": (
        "name",
        "model",
        "discrepancy",
        "candidates",
        "base",
        "pooling",
        "indenter",
        "sensor",
        "padding",
        "priors",
        "specimens",
        "laboratory",
        "instruments",
    ),
    "indenter": ("radius", "friction_coefficient"),
    "sensor": ("radius", "law", "electrode_radius", "dielectric_thickness"),
    "padding": ("material",),
    "specimens": ("name", *SWEEP_KEYS, "sweeps", "priors", "nominal"),
}

#: What `discrepancy` may be: "compare" stands for on, and off among the candidates.
_COMPARE = "compare"
DISCREPANCIES = (*get_args(Discrepancy), _COMPARE)

# How far the median of a radius' prior may lie from the radius that is given: what is further is a diameter, or a mistake.
_RADIUS_SLACK = 0.1


def read_experiment(path: Path | str) -> Experiment:
    """Read and check an experiment file; lab files are looked for relative to it, and must exist, but are not opened.

    Parameters
    ----------
    path : TOML file in UTF-8, of the form::

        name = "Padded sensor"
        model = "surrogate"              # optional: surrogate, fem, closed form
        discrepancy = "on"               # optional: on, off, or compare: on, with "discrepancy-off" among the candidates
        candidates = ["stick", "gent"]   # optional: models that `calib compare` calibrates beside this one, by the names of
                                         # the folders that it gives them; default all that differ in one other choice
        base = "bonded"                  # optional: what the padding rests on: glued (bonded) or free to slide (slippery)
        pooling = "partial"              # optional: complete (one material for all specimens), or partial (they are of one lot,
                                         # each with a modulus, a permittivity and thicknesses about those of the lot)
        [indenter]
        radius = "5 mm"
        friction_coefficient = 0         # optional: Coulomb's, or "stick" for a ball that the sensor sticks to; where it is
                                         # unknown give it a prior in [priors] instead
        [sensor]
        radius = "10 mm"
        law = "neo-hookean"              # optional: neo-hookean, or gent with the unknown stiffening; of the padding, too
        electrode_radius = "9 mm"        # optional, known; or a prior in [priors]; default the disc radius
        dielectric_thickness = "0.16 mm" # optional, known for all specimens; or a prior in [specimens.priors]
        [padding]
        material = "sensor"              # optional: "sensor" (same silicone), "own" (another modulus), or "foam" (another
                                         # modulus and Poisson's ratio)
        [priors]
        young_modulus = { lognormal = ["0.7 MPa", 1.6] }
        [[specimens]]
        name = "sensor 1"
        force = "sensor1_instron.csv"    # at least one of force and capacitance, or [[specimens.sweeps]] with them
        capacitance = "sensor1_lcr.csv"  # or a table that says how to read it, all but file optional:
                                         # { file = "lcr.csv", units = { capacitance = "pF" }, columns = { time = "T" },
                                         #   specimen = 2, where = { "Frequency (Hz)" = 1000 }, sheet = "Test 1",
                                         #   sign = "compression negative", scale = "micro", decimal = "," }
        use = { max_force = "5 N" }      # optional, the part of the press that is used; also max_depth = "0.8 mm" (from where
                                         # contact is estimated), branch = "unloading", cycles = [2, 3]; default the loading
                                         # of the first cycle. In [[specimens.sweeps]] for each of them
        [specimens.priors]
        sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
        padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
        [specimens.nominal]              # optional, under partial pooling: what was wanted, where specimens were not meant to
        padding_thickness = "1 mm"       # be alike
        [laboratory]                     # optional, for a certificate, as all of its keys
        name = "Soft Sensors"
        operator = "A. Person"
        email = "lab@example.org"
        city = "Auckland"
        country = "NZ"
        customer = "Soft Grippers"
        measured = "2026-03-17"          # or the first and the last day
        [[instruments]]                  # optional, one for each instrument, all of its keys but kind optional
        kind = "load cell"
        maker = "Instron"
        model = "2530-50N"
        serial = "12345"
        calibrated = "2026-01-12"
        class = "0.5"

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    path = Path(path)
    return _experiment(read_toml(path), path.stem)


def experiment_from(tables: Mapping[str, Any], folder: Path | str = ".") -> Experiment:
    """An experiment built in Python, from the same tables that an experiment file has, with the same checks.

    Parameters
    ----------
    tables : what `tomllib.load` would give of an experiment file, see `read_experiment`.
    folder : that lab files are relative to.

    Raises
    ------
    InputError
        With every fault, each with the keys that lead to it.

    >>> experiment_from({"indenter": {"radius": "5 mm"}, "sensor": {"radius": "10 mm"}, "specimens": [{"name": "a"}]})
    Traceback (most recent call last):
    ...
    calib.errors.InputError: specimens.0.priors: sensor_thickness of specimen "a" is missing...
    """
    written = json.dumps(tables, sort_keys=True, default=str)
    data = json.loads(json.dumps(tables, default=_plain))
    toml = Toml(None, Path(folder), data, hashlib.sha256(written.encode()).hexdigest(), {})
    return _experiment(toml, "experiment")


def _plain(value: object) -> object:
    """Turn paths, days and numbers of NumPy into texts and numbers, as TOML would have them."""
    return str(value) if isinstance(value, Path | date) else float(cast(Any, value))


def _experiment(toml: Toml, name: str) -> Experiment:
    meant = check_keys(toml, (), KEYS[""], SIGNPOSTS)
    indenter_radius = _radius(toml, "indenter", "5 mm", quiet="indenter" in meant)
    sensor_radius = _radius(toml, "sensor", "10 mm", quiet="sensor" in meant)

    padding = table_at(toml, ("padding",))
    check_keys(toml, ("padding",), KEYS["padding"], SIGNPOSTS)
    material = choice_at(toml, ("padding", "material"), padding.get("material", "sensor"), get_args(PaddingMaterial))

    pooling = choice_at(toml, ("pooling",), toml.data.get("pooling", "complete"), get_args(Pooling))
    of_lot = CAST if pooling == "partial" else ()
    priors = _priors(toml, ("priors",), (*unknowns_of("material", "rig"), *of_lot))
    if material == "sensor" and "padding_young_modulus" in priors:
        message = 'padding_young_modulus has no meaning for padding of the material "sensor"'
        toml.fault(("priors", "padding_young_modulus"), message, 'Write material = "own" in [padding] or leave the prior out')
    if material != "foam" and "padding_poisson_ratio" in priors:
        message = f'padding_poisson_ratio has no meaning for padding of the material "{material}", which keeps its volume'
        toml.fault(("priors", "padding_poisson_ratio"), message, 'Write material = "foam" in [padding] or leave the prior out')
    if material == "foam" and "padding_young_modulus" not in priors:
        message = "foams differ by a factor of a hundred: padding_young_modulus needs a prior of its own"
        advice = (
            'Give padding_young_modulus = { lognormal = ["0.1 MPa", 2] } in [priors], as its maker or a compression test says'
        )
        toml.fault(("padding", "material"), message, advice)
    model = choice_at(toml, ("model",), toml.data.get("model", "surrogate"), get_args(Model))
    law = choice_at(toml, ("sensor", "law"), table_at(toml, ("sensor",)).get("law", "neo-hookean"), get_args(MaterialLaw))
    stick, friction = _contact(toml)
    if (stick or friction is not None) and "friction_coefficient" in priors:
        message = "friction_coefficient is given twice, here and in [indenter]"
        toml.fault(("priors", "friction_coefficient"), message, "Keep one of the two")
        del priors["friction_coefficient"]  # which is one fault, and no combination of the model's
    elif friction is not None:
        priors["friction_coefficient"] = friction
    discrepancy = choice_at(toml, ("discrepancy",), toml.data.get("discrepancy", "on"), DISCREPANCIES)
    base = choice_at(toml, ("base",), toml.data.get("base", "bonded"), get_args(Base))
    if "base_friction_coefficient" in priors and base != "slippery":
        message = f'base_friction_coefficient has no meaning with base = "{base}", on which nothing slides'
        toml.fault(("priors", "base_friction_coefficient"), message, 'Write base = "slippery" or leave the prior out')
        del priors["base_friction_coefficient"]  # likewise
    if "stiffening" in priors and law != "gent":
        toml.fault(
            ("priors", "stiffening"),
            f"stiffening has no meaning for the law {law}",
            'Write law = "gent" in [sensor] or leave it out',
        )
    _check_radii(toml, priors, {"indenter_radius": indenter_radius, "sensor_radius": sensor_radius})
    known = _known_geometry(toml)
    for parameter in priors.keys() & known.keys():
        toml.fault(("priors", parameter), f"{parameter} is given twice, here and in [sensor]", "Keep one of the two")
    if "electrode_radius" in known:
        priors["electrode_radius"] = known["electrode_radius"]
    if (electrode := priors.get("electrode_radius")) is not None and _median(electrode) > sensor_radius * (1 + 1e-9):
        place = ("sensor", "electrode_radius") if "electrode_radius" in known else ("priors", "electrode_radius")
        got = f"{display('electrode_radius', _median(electrode))} on a disc of {display('sensor_radius', sensor_radius)}"
        toml.fault(place, f"electrode_radius must not exceed the disc radius, got {got}")

    needed = [name for name, row in UNKNOWNS.items() if row.required and name not in priors]
    specimens = _specimens(toml, indenter_radius, known.get("dielectric_thickness"), needed, quiet="specimens" in meant)
    balls = {sweep.indenter_radius for specimen in specimens for sweep in specimen.sweeps}
    if "indenter_radius" in priors and len(balls) > 1:
        message = f"one prior of indenter_radius cannot hold for balls of {len(balls)} radii"
        toml.fault(("priors", "indenter_radius"), message, "Leave it out, or calibrate the presses of one ball alone")
    title = text_at(toml, ("name",), default=name)
    if toml.data.get("name") is not None and (fault := name_fault(title)):
        toml.fault(("name",), f'name "{shortened(title)}" {fault}', "It is the heading of the report")
    experiment = Experiment(
        name=title,
        path=None if toml.path is None else toml.path.absolute(),
        sha256=toml.sha256,
        indenter_radius=indenter_radius,
        sensor_radius=sensor_radius,
        padding_material=cast(PaddingMaterial, material),
        priors=priors,
        specimens=specimens,
        model=cast(Model, model),
        discrepancy=cast(Discrepancy, "on" if discrepancy == _COMPARE else discrepancy),
        law=cast(MaterialLaw, law),
        stick=stick,
        base=cast(Base, base),
        pooling=cast(Pooling, pooling),
        unedited=unedited_lines(toml.text, toml.data, toml.places),
        laboratory=laboratory_in(toml),
        instruments=instruments_in(toml),
    )
    _check_model(toml, experiment)
    for where, wrong in lot_faults(experiment):
        toml.add(where, [wrong])
    experiment = replace(experiment, candidates=_candidates(toml, experiment, discrepancy == _COMPARE))
    raise_faults(toml)
    return experiment


def _candidates(toml: Toml, e: Experiment, discrepancy: bool) -> tuple[str, ...]:
    """Read which models are to be compared, none for all; note a fault for those that there are not."""
    at = ("candidates",)
    named = toml.data.get("candidates")
    possible = [variant.name for variant in possible_candidates(e)][1:]
    usual = [variant.name for variant in variants_of(e)][1:]
    beside = [name for name in possible if name not in usual] if discrepancy else []
    if named is None:
        return (*usual, *beside) if discrepancy else ()
    advice = f"Models that there are beside this one: {', '.join(possible)}"
    if not isinstance(named, list) or not named:
        toml.fault(at, f"candidates must be a list of models in quotes, got {quoted(named)}", advice)
        return ()
    for name in named:
        if name not in possible:
            message = f"candidates names {quoted(name)}, which this experiment has no model for or is itself"
            toml.fault(at, message, advice)
    return tuple(dict.fromkeys([*(name for name in named if name in possible), *beside]))


def _check_radii(toml: Toml, priors: Mapping[str, Prior], nominal: Mapping[str, float]) -> None:
    """Note a fault if the prior of a radius is about another radius than the one given as its nominal value."""
    for parameter, radius in nominal.items():
        prior = priors.get(parameter)
        if prior is not None and not abs(_median(prior) - radius) <= _RADIUS_SLACK * radius and math.isfinite(radius):
            where = parameter.removesuffix("_radius")
            got = f"{display(parameter, _median(prior))}, and radius in [{where}] {display(parameter, radius)}"
            toml.fault(
                ("priors", parameter), f"the median of {parameter} is {got}", "Give the same radius (not diameter) in both"
            )


def _contact(toml: Toml) -> tuple[bool, Fixed | None]:
    """Read whether the sensor sticks to the ball, and the friction of one that slides, None where that is 0 or not given."""
    at = ("indenter", "friction_coefficient")
    value = table_at(toml, at[:1]).get(at[1], 0)
    if value == "stick":
        return True, None
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < math.inf:
        return False, Fixed(float(value)) if value else None
    advice = "Where it is unknown, leave it out here and give it a prior in [priors]"
    toml.fault(at, f'friction_coefficient must be a plain number of zero or more, or "stick", got {quoted(value)}', advice)
    return False, None


def _check_model(toml: Toml, e: Experiment) -> None:
    """Note a fault for a combination of base, law, friction and padding that the chosen forward model does not have."""
    others = {
        ("priors", "base_friction_coefficient"): e.base_rubs,
        ("base",): e.base != "bonded",
        ("indenter", "friction_coefficient") if e.stick else ("priors", "friction_coefficient"): e.stick or e.rubs,
        ("padding", "material"): e.padding_material == "foam",
        ("sensor", "law"): e.law != "neo-hookean",
    }
    place = next((at for at, other in others.items() if other), ("model",))
    if e.padding_material == "foam" and e.law == "gent":
        toml.fault(("sensor", "law"), "a foam is neo-Hookean and does not stiffen with the sensor", "Leave one of the two out")
    elif e.model == "closed form" and place != ("model",):
        message = "the closed form knows neo-Hookean layers that keep their volume, a bonded base and a ball without friction"
        toml.fault(place, message, 'Write model = "surrogate"')
    elif e.model == "surrogate" and e.family is None:
        advice = 'Leave one of these choices out, or write model = "fem" and have patience. '
        message = f"there is no surrogate for all of this together: {model_in_words(e)}"
        toml.fault(place, message, f"{advice}There are surrogates of {shipped_in_words()}")


def _radius(toml: Toml, name: str, example: str, *, quiet: bool) -> float:
    """Read the required radius in the table `name`, and check its keys; nan and a fault (none if `quiet`) without a radius."""
    meant = check_keys(toml, (name,), KEYS[name], SIGNPOSTS)
    required = f'radius = "{example}" in [{name}]'
    return quantity_at(toml, (name, "radius"), f"{name}_radius", required=required, quiet=quiet or "radius" in meant)


def _known_geometry(toml: Toml) -> dict[str, Fixed]:
    """Read the dimensions that [sensor] gives as known numbers."""
    known: dict[str, Fixed] = {}
    for parameter in ("electrode_radius", "dielectric_thickness"):
        if parameter in table_at(toml, ("sensor",)):
            value = quantity_at(toml, ("sensor", parameter), parameter)
            if math.isfinite(value):
                known[parameter] = Fixed(value)
    return known


def _specimens(
    toml: Toml, radius: float, dielectric: Fixed | None, needed: Sequence[str], *, quiet: bool
) -> tuple[Specimen, ...]:
    required = "" if quiet else 'Give at least one, with name = "sensor 1" and its force or capacitance file'
    tables = tables_at(toml, ("specimens",), required=required)
    specimens: list[Specimen] = []
    lines: dict[str, int] = {}
    seen: list[tuple[SweepFiles, str]] = []
    for at in tables:
        meant = check_keys(toml, at, KEYS["specimens"], SIGNPOSTS)
        name = text_at(toml, (*at, "name"), required='name = "sensor 1"', quiet="name" in meant)
        check_name(toml, (*at, "name"), name)
        if name and name in lines:
            toml.fault(
                (*at, "name"), f'specimen "{name}" is given twice, first in line {lines[name]}', "Give each its own name"
            )
        lines.setdefault(name, toml.place((*at, "name"))[0])
        priors = _priors(toml, (*at, "priors"), unknowns_of("specimen", "sweep"), required=needed)
        nominal = _nominal(toml, (*at, "nominal"))
        if dielectric is not None and "dielectric_thickness" in priors:
            message = "dielectric_thickness is given twice, here and in [sensor]"
            toml.fault((*at, "priors", "dielectric_thickness"), message, "Keep one of the two")
        elif dielectric is not None:
            priors["dielectric_thickness"] = dielectric
        _check_dielectric(toml, at, priors)
        sweeps = read_sweeps_of(toml, at, radius, meant)
        for sweep, place in sweeps:
            main = sweep.force or sweep.capacitance
            twice = next((who for other, who in seen if sweep.shares_press_with(other)), None)
            if main is not None and twice is not None:
                message = f"{main.name} is used twice, it already belongs to {twice}"
                advice = "give each press its own file, or cycles of its own: use = { cycles = [2] }"
                toml.fault(place, message, f"Data counted twice make the result too certain: {advice}")
            else:
                seen.append((sweep, f'specimen "{name}"' + (f', sweep "{sweep.name}"' if sweep.name else "")))
        specimens.append(Specimen(name, tuple(sweep for sweep, _ in sweeps), priors, nominal))
    return tuple(specimens)


def _nominal(toml: Toml, at: KeyPath) -> dict[str, float]:
    """Read the thicknesses that were wanted of a specimen."""
    table = table_at(toml, at)
    check_keys(toml, at, CAST, SIGNPOSTS)
    found = {q: value for q in CAST if q in table and math.isfinite(value := quantity_at(toml, (*at, q), q))}
    for quantity, wrong in wanted_faults(found):
        toml.add((*at, quantity), [wrong])
    return found


def _check_dielectric(toml: Toml, at: KeyPath, priors: Mapping[str, Prior]) -> None:
    """Note a fault if the two dielectrics do not fit into the sensor at the medians of the priors."""
    dielectric, sensor = priors.get("dielectric_thickness"), priors.get("sensor_thickness")
    if dielectric is None or sensor is None or _median(dielectric) <= _median(sensor) / 2 * (1 + 1e-9):
        return
    got = (
        f"{display('dielectric_thickness', _median(dielectric))} in a sensor of {display('sensor_thickness', _median(sensor))}"
    )
    own = (*at, "priors", "dielectric_thickness")
    place = own if own in toml.places else ("sensor", "dielectric_thickness")
    toml.fault(place, f"dielectric_thickness (of each of the two) must not exceed half the sensor thickness, got {got}")


def _priors(toml: Toml, at: KeyPath, known: Sequence[str], required: Sequence[str] = ()) -> dict[str, Prior]:
    table = table_at(toml, at)
    meant = check_keys(toml, at, known, SIGNPOSTS)
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
            advice = f"Give {parameter} = {UNKNOWNS[parameter].example} in [specimens.priors], as measured"
            toml.fault(at, f"{parameter} of {where} is missing", advice)
    return priors


def _median(prior: Prior) -> float:
    return float(prior.ppf_normal(0.0))
