"""Design files: from TOML text to a checked `Design`, or to a `LayeredDesign` where it asks for more, all faults at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from calib.catalogue import display
from calib.experiment.toml_file import Toml, read_toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import (
    Signposts,
    check_keys,
    choice_at,
    get,
    positive_at,
    quantity_at,
    quoted,
    raise_faults,
    table_at,
    tables_at,
    text_at,
)
from models.laws import Gent, Law, MooneyRivlin, NeoHookean, Ogden, Yeoh
from models.layers import LARGEST_BASE_FRICTION, Dielectric, Layer, LayeredDesign, Profile, cone, flat_punch, layered, sphere
from models.sensor import INCOMPRESSIBLE, Base, Design, Indenter, Padding, Sensor

#: Tables of a design with their keys, and the quantity that each is; keys that are none stand in `BESIDE`.
TABLES: Mapping[str, Mapping[str, str]] = {
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
#: Their keys of another kind.
BESIDE: Mapping[str, tuple[str, ...]] = {"sensor": ("law",), "padding": ("law", "poisson_ratio")}
#: Those that a design must have, with an example.
REQUIRED: Mapping[tuple[str, str], str] = {
    ("sensor", "thickness"): '"0.74 mm"',
    ("sensor", "radius"): '"10 mm"',
    ("sensor", "young_modulus"): '"0.69 MPa"',
    ("sensor", "relative_permittivity"): "2.8",
    ("padding", "thickness"): '"1.10 mm", or "0 mm" for none',
}

#: Keys of the disc and of each layer of a stack.
DISC = ("radius", "electrode_radius")
LAYER = ("name", "thickness", "young_modulus", "poisson_ratio", "law", "relative_permittivity")

_BASE_FRICTION = "base_friction_coefficient"

#: Shapes of indenters, with the keys that give their size and an example of each.
SHAPES: Mapping[str, Mapping[str, str]] = {
    "sphere": {"radius": '"5 mm"'},
    "flat punch": {"radius": '"5 mm"', "edge_radius": '"0.2 mm"'},
    "cone": {"half_angle": '"60 deg"', "tip_radius": '"0.5 mm"'},
}
_PROFILES: Mapping[str, Callable[..., Profile]] = {"sphere": sphere, "flat punch": flat_punch, "cone": cone}

#: Hyperelastic laws and their shape parameters.
LAWS: Mapping[str, tuple[Callable[..., Law], tuple[str, ...]]] = {
    "neo-hookean": (NeoHookean, ()),
    "mooney-rivlin": (MooneyRivlin, ("c01_share",)),
    "yeoh": (Yeoh, ("c2", "c3")),
    "gent": (Gent, ("locking",)),
    "ogden": (Ogden, ("shares", "exponents")),
}
_SOFT_SENSOR = Signposts(
    {}, {("[sensor]", "poisson_ratio"): "The sensor keeps its volume; a foam may stand in [padding] or among [[layers]]"}
)
_LAW_EXAMPLE = 'Write for example law = "neo-hookean", { gent = { locking = 40 } } or { yeoh = { c2 = 0.02, c3 = 0.001 } }'


def read_design(path: Path | str) -> Design | LayeredDesign:
    """Read and check a design file.

    Parameters
    ----------
    path : TOML file in UTF-8, of the form::

        base = "bonded"                   # optional, or "slippery"
        base_friction_coefficient = 0.0   # optional, of a slippery base; "stick" for no slip at all
        [indenter]
        radius = "5 mm"
        friction_coefficient = 0.0        # optional; "stick" for no slip at all
        [sensor]
        thickness = "0.74 mm"
        radius = "10 mm"
        young_modulus = "0.69 MPa"
        relative_permittivity = 2.8
        electrode_radius = "10 mm"        # optional, default the disc radius
        dielectric_thickness = "0.37 mm"  # optional, default half the sensor thickness
        law = { gent = { locking = 40 } } # optional, default "neo-hookean"
        [padding]
        thickness = "1.10 mm"
        young_modulus = "0.69 MPa"        # optional, default the sensor's
        poisson_ratio = 0.3               # optional, for a foam, which is neo-Hookean; default 0.5, incompressible
        law = "neo-hookean"               # optional

    Other indenters have shape = "flat punch" with radius and edge_radius, or shape = "cone" with half_angle (between axis and
    flank) and tip_radius. Any stack of bonded layers stands in the place of [sensor] and [padding] as::

        [disc]
        radius = "10 mm"
        electrode_radius = "10 mm"        # optional
        [[layers]]                        # from the base up
        name = "padding"                  # optional
        thickness = "1.10 mm"
        young_modulus = "0.69 MPa"
        poisson_ratio = 0.3               # optional, as above
        law = "neo-hookean"               # optional
        [[layers]]
        name = "dielectric"
        thickness = "0.2 mm"
        young_modulus = "0.69 MPa"
        relative_permittivity = 2.8       # a layer with one lies between two electrodes

    Returns
    -------
    A `Design` if that says it all (a sphere on sensor and padding of one law, neo-Hookean or Gent's), else a `LayeredDesign`.

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    path = Path(path)
    toml = read_toml(path)
    stacked = "layers" in toml.data or "disc" in toml.data
    parts = ("disc", "layers") if stacked else ("sensor", "padding")
    meant = check_keys(toml, (), ("base", _BASE_FRICTION, "indenter", *parts))
    base = cast(Base, choice_at(toml, ("base",), toml.data.get("base", "bonded"), get_args(Base)))
    shape, sizes = _indenter(toml, quiet="indenter" in meant)
    friction = _friction(toml, ("indenter", "friction_coefficient"))
    on_base = _friction(toml, (_BASE_FRICTION,))
    if LARGEST_BASE_FRICTION < on_base < math.inf:
        message = f'{_BASE_FRICTION} must not be above {LARGEST_BASE_FRICTION:g}, or "stick", got {on_base:g}'
        toml.fault((_BASE_FRICTION,), message, "From there on nothing slides")
    if on_base > 0 and base != "slippery":
        message = f'{_BASE_FRICTION} is that of a slippery base, got {quoted(toml.data[_BASE_FRICTION])} with base = "{base}"'
        toml.fault((_BASE_FRICTION,), message, 'Write base = "slippery", or take it out')
    if stacked:
        disc, electrode, layers, dielectrics = _stack(toml)
        raise_faults(toml)
        return _checked(
            toml,
            lambda: LayeredDesign(
                _PROFILES[shape](*sizes),
                layers,
                disc,
                electrode,
                dielectrics,
                friction,
                base,
                on_base,
            ),
        )
    values, laws, poisson_ratio = _sensor_and_padding(toml, meant)
    raise_faults(toml)
    design = Design(
        Indenter(sizes[0], friction),
        Sensor(**{key: values["sensor", key] for key in TABLES["sensor"] if ("sensor", key) in values}),
        Padding(
            **{key: values["padding", key] for key in TABLES["padding"] if ("padding", key) in values},
            poisson_ratio=poisson_ratio,
            base_friction_coefficient=on_base,
        ),
        base,
    )
    stiffening = _one_stiffening(laws["sensor"], laws["padding"], bare=np.max(design.padding.thickness) == 0)
    if shape == "sphere" and stiffening is not None:
        return replace(design, sensor=replace(design.sensor, stiffening=stiffening))
    plain = layered(design)
    by_name = {"sensor": laws["sensor"], "padding": laws["padding"]}
    return _checked(
        toml,
        lambda: LayeredDesign(
            _PROFILES[shape](*sizes),
            tuple(replace(x, law=by_name[x.name]) for x in plain.layers),
            plain.radius,
            plain.electrode_radius,
            plain.dielectrics,
            friction,
            base,
            on_base,
        ),
    )


def _one_stiffening(sensor: Law, padding: Law, *, bare: bool) -> float | None:
    """1/J_m that holds for sensor and padding alike, 0 for neo-Hookean ones; None if no single number describes both laws."""
    if not bare and padding != sensor:
        return None
    if isinstance(sensor, Gent):
        return 1 / sensor.locking
    return 0.0 if sensor == NeoHookean() else None


def _checked(toml: Toml, make: Callable[[], LayeredDesign]) -> LayeredDesign:
    try:
        return make()
    except ValueError as error:
        toml.fault((), str(error))
    raise_faults(toml)
    raise AssertionError("unreachable: the fault above is raised")


def _sensor_and_padding(toml: Toml, meant_tables: set[str]) -> tuple[dict[tuple[str, str], float], dict[str, Law], float]:
    """Quantities of both by table and key, their laws, and Poisson's ratio of the padding."""
    values: dict[tuple[str, str], float] = {}
    laws: dict[str, Law] = {}
    for name, keys in TABLES.items():
        meant = check_keys(toml, (name,), (*keys, *BESIDE[name]), _SOFT_SENSOR)
        laws[name] = _law(toml, (name, "law"))
        for key, parameter in keys.items():
            at = (name, key)
            example = REQUIRED.get(at, "")
            if example or key in table_at(toml, (name,)):
                required = f"{key} = {example} in [{name}]"
                values[at] = quantity_at(toml, at, parameter, required=required, quiet=key in meant or name in meant_tables)
    radius, thickness = (values.get(("sensor", key), math.nan) for key in ("radius", "thickness"))
    electrode, dielectric = (values.get(("sensor", k), math.nan) for k in ("electrode_radius", "dielectric_thickness"))
    if electrode > radius * (1 + 1e-9):
        got = f"{display('electrode_radius', electrode)} on a disc of {display('sensor_radius', radius)}"
        toml.fault(("sensor", "electrode_radius"), f"electrode_radius must not exceed the disc radius, got {got}")
    if dielectric > thickness / 2 * (1 + 1e-9):
        got = f"{display('dielectric_thickness', dielectric)} in a sensor of {display('sensor_thickness', thickness)}"
        message = f"dielectric_thickness (of each of the two) must not exceed half the sensor thickness, got {got}"
        toml.fault(("sensor", "dielectric_thickness"), message)
    return values, laws, _poisson_ratio(toml, ("padding",), laws["padding"])


def _stack(toml: Toml) -> tuple[float, float, tuple[Layer, ...], tuple[Dielectric, ...]]:
    """Radii of disc and electrodes, layers from the base up, and the dielectrics among them."""
    check_keys(toml, ("disc",), DISC)
    radius = quantity_at(toml, ("disc", "radius"), "sensor_radius", required='radius = "10 mm" in [disc]')
    electrode = radius
    if "electrode_radius" in table_at(toml, ("disc",)):
        electrode = quantity_at(toml, ("disc", "electrode_radius"), "electrode_radius")
        if electrode > radius * (1 + 1e-9):
            got = f"{display('electrode_radius', electrode)} on a disc of {display('sensor_radius', radius)}"
            toml.fault(("disc", "electrode_radius"), f"electrode_radius must not exceed the disc radius, got {got}")
    layers: list[Layer] = []
    dielectrics: list[Dielectric] = []
    height = 0.0
    for at in tables_at(toml, ("layers",), required="Describe each layer, from the base up, below a line [[layers]]"):
        meant = check_keys(toml, at, LAYER)
        name = text_at(toml, (*at, "name")) or f"layer {len(layers) + 1}"
        thickness = positive_at(toml, (*at, "thickness"), "m", '"0.5 mm"', quiet="thickness" in meant)
        modulus = positive_at(toml, (*at, "young_modulus"), "Pa", '"0.69 MPa"', quiet="young_modulus" in meant)
        law = _law(toml, (*at, "law"))
        poisson_ratio = _poisson_ratio(toml, at, law)
        if "relative_permittivity" in table_at(toml, at):
            permittivity = quantity_at(toml, (*at, "relative_permittivity"), "relative_permittivity")
            if thickness > 0 and permittivity > 0:
                dielectrics.append(Dielectric(height, height + thickness, permittivity))
        if thickness > 0 and modulus > 0:
            layers.append(Layer(thickness, modulus, law, name, poisson_ratio))
            height += thickness
    if not dielectrics and not toml.faults:
        advice = "Give relative_permittivity = 2.8 in the [[layers]] that lie between two electrodes"
        toml.fault(("layers",), "no layer is a dielectric", advice)
    return radius, electrode, tuple(layers), tuple(dielectrics)


def _indenter(toml: Toml, *, quiet: bool) -> tuple[str, tuple[float, ...]]:
    """Read the shape of the indenter and its sizes, SI; a missing size is no fault of its own if `quiet`."""
    table = table_at(toml, ("indenter",))
    shape = choice_at(toml, ("indenter", "shape"), table["shape"], tuple(SHAPES)) if "shape" in table else "sphere"
    sizes = SHAPES[shape]
    meant = check_keys(toml, ("indenter",), ("shape", "friction_coefficient", *sizes))
    if shape == "sphere":
        missing = quiet or "radius" in meant
        return shape, (
            quantity_at(
                toml, ("indenter", "radius"), "indenter_radius", required='radius = "5 mm" in [indenter]', quiet=missing
            ),
        )
    values = tuple(
        positive_at(toml, ("indenter", key), "rad" if key == "half_angle" else "m", example, quiet=quiet or key in meant)
        for key, example in sizes.items()
    )
    if all(v > 0 for v in values):
        try:
            _PROFILES[shape](*values)
        except ValueError as error:
            toml.fault(("indenter",), str(error))
    return shape, values


def _law(toml: Toml, at: KeyPath) -> Law:
    """The optional hyperelastic law: a name, or a table of one name and its shape parameters."""
    value = get(toml, at)
    if value is None:
        return NeoHookean()
    if isinstance(value, str):
        value = {value: {}}
    if not isinstance(value, dict) or len(value) != 1:
        toml.fault(at, f"law must be one name, with its shape parameters in a table, got {quoted(value)}", _LAW_EXAMPLE)
        return NeoHookean()
    name, given = next(iter(value.items()))
    spelled = str(name).lower().replace("_", "-").replace(" ", "-")
    if spelled not in LAWS:
        toml.fault(at, f'unknown law "{name}"', f"Known are {', '.join(LAWS)}. {_LAW_EXAMPLE}")
        return NeoHookean()
    make, parameters = LAWS[spelled]
    if not isinstance(given, dict):
        toml.fault(at, f"shape parameters of {spelled} must be a table, got {quoted(given)}", _LAW_EXAMPLE)
        return NeoHookean()
    unknown = [key for key in given if key not in parameters]
    if unknown:
        known = f"It has {', '.join(parameters)}" if parameters else "It has none"
        toml.fault(at, f'unknown shape parameter "{unknown[0]}" of {spelled}', known)
        return NeoHookean()
    try:
        return make(**{key: _shape_parameter(key, v) for key, v in given.items()})
    except TypeError:
        missing = [key for key in parameters if key not in given]
        toml.fault(at, f"{spelled} needs {' and '.join(missing)}", _LAW_EXAMPLE)
    except ValueError as error:
        toml.fault(at, f"{spelled}: {error}")
    return NeoHookean()


def _poisson_ratio(toml: Toml, at: KeyPath, law: Law) -> float:
    """The optional Poisson's ratio of the padding or a layer of this law; 0.5, incompressible, by default or if wrong."""
    value = get(toml, (*at, "poisson_ratio"))
    if value is None:
        return INCOMPRESSIBLE
    advice = "Leave it out for rubber, which keeps its volume (0.5); an open foam has 0 to 0.3"
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value <= INCOMPRESSIBLE:
        toml.fault((*at, "poisson_ratio"), f"poisson_ratio must be a plain number from 0 to 0.5, got {quoted(value)}", advice)
        return INCOMPRESSIBLE
    if value < INCOMPRESSIBLE and law != NeoHookean():
        message = f"a foam (poisson_ratio = {value:g}) is neo-hookean, got {law.name}"
        toml.fault((*at, "law"), message, "Leave out its law, or its poisson_ratio")
        return INCOMPRESSIBLE
    return float(value)


def _shape_parameter(key: str, value: Any) -> float | tuple[float, ...]:
    def number(v: Any) -> float:
        if isinstance(v, bool) or not isinstance(v, (int, float)) or not math.isfinite(v):
            raise ValueError(f"{key} must be a plain number{'s' if isinstance(value, list) else ''}, got {quoted(v)}")
        return float(v)

    if key in ("shares", "exponents"):
        if not isinstance(value, list):
            raise ValueError(f"{key} must be a list of plain numbers, got {quoted(value)}")
        return tuple(number(v) for v in value)
    return number(value)


def _friction(toml: Toml, at: KeyPath) -> float:
    """The optional friction coefficient, a plain number that is not negative, or "stick"."""
    value = (table_at(toml, at[:-1]) if at[:-1] else toml.data).get(str(at[-1]), 0.0)
    if value == "stick":
        return math.inf
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < 0:
        toml.fault(at, f'{at[-1]} must be a plain number of zero or more, or "stick", got {quoted(value)}')
        return 0.0
    return float(value)
