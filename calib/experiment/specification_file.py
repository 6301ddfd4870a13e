"""From a specification file (TOML), or the same tables in Python, to a checked `Specification`, all faults at once."""

from __future__ import annotations

import difflib
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from calib.experiment.specification import (
    LIMITED,
    MOST_VALUES,
    SIDES,
    CandidateMaterial,
    Limit,
    Specification,
    Tolerance,
    faults_of,
)
from calib.experiment.toml_file import Toml, read_toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import (
    Signposts,
    check_keys,
    get,
    positive_at,
    quoted,
    raise_faults,
    table_at,
    tables_at,
    text_at,
)
from calib.priors import FORMS, PRIORS, Normal, Prior, TruncatedNormal

#: Table -> its keys; "" is the top of the file.
KEYS: Mapping[str, tuple[str, ...]] = {
    "": ("name", "probability", "loads", "limits", "padding", "sensor", "spread"),
    "loads": ("force", "ball", "curvature"),
    "limits": tuple(LIMITED),
    "padding": ("thickness", "steps", "tolerance", "gauge", "guard_band", "materials"),
    "sensor": ("thickness", "electrode_radius", "thickness_tolerance", "dielectric_tolerance", "electrode_tolerance"),
    "spread": ("young_modulus", "relative_permittivity"),
}
#: Keys of a material.
MATERIAL = ("name", "young_modulus", "poisson_ratio")
#: Kinds of distribution that loads, balls and moduli may have.
KINDS = ("uniform", "normal", "lognormal", "truncated_normal")
#: Kinds of tolerance.
TOLERANCES = ("normal", "uniform")
#: Loads at which a range is gone through if nothing is said.
RANGE_STEPS = 5

_LAW = "A material has the law of the run: a law of its own is served by no surrogate"
_SIGNPOSTS = Signposts(
    {
        "force": "in [loads]",
        "ball": "in [loads]",
        "curvature": "in [loads]",
        "signal": "in [limits]",
        "stroke": "in [limits]",
        "height": "in [limits]",
        "force_resolution": "in [limits]",
        "dielectric_strain": "in [limits]",
        "tolerance": "in [padding]",
        "materials": "below a line [[padding.materials]]",
    },
    {("[[padding.materials]]", "law"): _LAW, ("[padding]", "law"): _LAW},
)
_FORCE, _BALL, _CURVATURE, _MODULUS = '"10 N"', '"5 mm"', '"0.2 1/mm"', '"0.3 MPa"'
_TOLERANCE = 'Write { uniform = "0.1 mm" } for anywhere within ± 0.1 mm, { normal = "0.05 mm" } for a standard deviation'


def read_specification(path: Path | str, n_draw: int = 1000) -> Specification:
    """Read and check a specification file.

    Parameters
    ----------
    path : TOML file in UTF-8, of the form::

        name = "Finger tip"                          # optional
        probability = 0.95                           # of conforming that is asked for; default 0.95
        [loads]
        force = "10 N"                               # a list ["1 N", "10 N"], { range = ["1 N", "10 N"], steps = 5 }: all of
                                                     # them must conform; or of the load in use { uniform = ["5 N", "10 N"] }
        ball = "5 mm"                                # optional, default that of the run; a list, a distribution, or curvature
        [limits]                                     # at_least and at_most; with at = "10 N" at one load, else at every load
        signal = { at_least = 0.08, at = "10 N" }    # C/C0 - 1
        force_resolution = { at_most = "20 mN" }     # noise of a reading over dC/dF
        stroke = { at_most = "2 mm" }                # indentation at the load
        dielectric_strain = { at_most = 0.3 }        # thinning of the dielectric under the ball
        height = { at_most = "7 mm" }                # sensor and padding
        [padding]                                    # optional
        thickness = ["0 mm", "9 mm"]                 # to choose from
        steps = 181
        tolerance = { uniform = "0.1 mm" }           # of what is built about its nominal; { normal = "0.05 mm" } is an sd
        gauge = "0.02 mm"                            # standard uncertainty of a reading when pads are inspected
        guard_band = 1.0                             # r in w = r U, U = 2 gauge
        [[padding.materials]]                        # optional, others than that of the run, as often as there are
        name = "soft silicone"
        young_modulus = "0.3 MPa"                    # or a distribution { lognormal = ["0.3 MPa", 1.1] }
        poisson_ratio = 0.5                          # optional, below 0.5 for a foam
        [sensor]                                     # optional
        thickness = ["0.74 mm", "1 mm"]              # to choose from; default as measured
        electrode_radius = ["8 mm", "10 mm"]         # to choose from; default as measured
        thickness_tolerance = { normal = "0.02 mm" }
        dielectric_tolerance = { normal = "0.004 mm" }
        electrode_tolerance = { uniform = "0.1 mm" }
        [spread]                                     # optional, from sensor to sensor: sd of the logarithm
        young_modulus = 0.05
        relative_permittivity = 0.01

    n_draw : how many draws of the posterior are to be used.

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    return _specification(read_toml(Path(path)), n_draw)


def specification_from(tables: Mapping[str, Any], n_draw: int = 1000) -> Specification:
    """A specification built in Python, from the same tables that a specification file has, with the same checks.

    Parameters
    ----------
    tables : what `tomllib.load` would give of a specification file, see `read_specification`.
    n_draw : how many draws of the posterior are to be used.

    Raises
    ------
    InputError
        With every fault, each with the keys that lead to it.

    >>> spec = specification_from({"loads": {"force": "10 N"}, "limits": {"signal": {"at_least": 0.08}}})
    >>> spec.force, spec.limits[0].in_words
    ((10.0,), 'signal at least 8 %')
    """
    data = json.loads(json.dumps(tables, default=float))
    digest = hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
    return _specification(Toml(None, Path(), data, digest, {}), n_draw)


def _specification(toml: Toml, n_draw: int) -> Specification:
    meant = check_keys(toml, (), KEYS[""], _SIGNPOSTS)
    for table, keys in KEYS.items():
        if table:
            check_keys(toml, (table,), keys, _SIGNPOSTS)
    values: dict[str, Any] = {f.name: f.default for f in fields(Specification) if f.default is not MISSING}
    values |= {"n_draw": n_draw, "name": text_at(toml, ("name",))}
    values["probability"] = _share(toml, ("probability",), 0.95)
    values["force"] = _force(toml, quiet="loads" in meant)
    values["ball"], values["by_curvature"] = _ball(toml)
    values["limits"] = _limits(toml, quiet="limits" in meant)
    values |= _padding(toml)
    values |= _sensor(toml)
    for name, key in (("modulus_spread", "young_modulus"), ("permittivity_spread", "relative_permittivity")):
        values[name] = _share(toml, ("spread", key), 0.0)
    raise_faults(toml)
    for at, fault in faults_of(values):
        toml.add(at, (fault,))
    raise_faults(toml)
    return Specification(**values)


def _share(toml: Toml, at: KeyPath, default: float) -> float:
    value = get(toml, at)
    return default if value is None else positive_at(toml, at, "", str(default or 0.05), quiet=True, zero_allowed=True)


def _force(toml: Toml, *, quiet: bool) -> tuple[float, ...] | Prior:
    at = ("loads", "force")
    value = get(toml, at)
    if isinstance(value, dict) and "range" in value:
        return _range(toml, at, value)
    if value is None:
        if not quiet:
            toml.fault(("loads",), "force is missing", f"Give force = {_FORCE} in [loads]")
        return ()
    return _numbers(toml, at, "N", _FORCE)


def _range(toml: Toml, at: KeyPath, value: Mapping[str, Any]) -> tuple[float, ...]:
    """Evenly spaced loads of a range, both ends among them."""
    check_keys(toml, at, ("range", "steps"))
    ends, steps = value["range"], value.get("steps", RANGE_STEPS)
    example = 'Write { range = ["1 N", "10 N"], steps = 5 }'
    if not isinstance(ends, list) or len(ends) != 2:
        toml.fault((*at, "range"), f"range takes two forces, got {quoted(ends)}", example)
        return ()
    low, high = (positive_at(toml, (*at, "range", i), "N", _FORCE, quiet=True) for i in (0, 1))
    if low >= high:
        toml.fault(
            (*at, "range"), f"the range of forces is upside down or empty: {low:g} N to {high:g} N", "The smaller one is first"
        )
        return ()
    if isinstance(steps, bool) or not isinstance(steps, int) or not 2 <= steps <= MOST_VALUES:
        toml.fault((*at, "steps"), f"steps must be a whole number from 2 to {MOST_VALUES}, got {quoted(steps)}", example)
        return ()
    return tuple(float(f) for f in np.linspace(low, high, steps)) if math.isfinite(low + high) else ()


def _ball(toml: Toml) -> tuple[tuple[float, ...] | Prior | None, bool]:
    """Radii of balls, or their distribution or that of their curvature, and which of the two it is."""
    loads = table_at(toml, ("loads",))
    if "ball" in loads and "curvature" in loads:
        toml.fault(("loads", "curvature"), "ball and curvature say the same", "Leave one of them out")
        return None, False
    if "ball" in loads:
        return _numbers(toml, ("loads", "ball"), "m", _BALL), False
    if "curvature" not in loads:
        return None, False
    found = _numbers(toml, ("loads", "curvature"), "1/m", _CURVATURE)
    return (found, True) if isinstance(found, Prior) else (tuple(1 / k for k in found), False)


def _numbers(toml: Toml, at: KeyPath, unit: str, example: str) -> tuple[float, ...] | Prior:
    """One quantity, a list of them, or a distribution."""
    value = get(toml, at)
    if isinstance(value, dict):
        return _distribution(toml, at, unit, example) or ()
    if not isinstance(value, list):
        return (positive_at(toml, at, unit, example, quiet=True),)
    if not value:
        toml.fault(at, f"{at[-1]} is an empty list", f"Give for example [{example}]")
    if len(value) > MOST_VALUES:
        toml.fault(at, f"{len(value)} values of {at[-1]}, more than {MOST_VALUES}", "Give fewer, or a distribution")
        return ()
    return tuple(positive_at(toml, (*at, i), unit, example, quiet=True) for i in range(len(value)))


def _distribution(toml: Toml, at: KeyPath, unit: str, example: str) -> Prior | None:
    """A distribution of a quantity that is positive."""
    value = get(toml, at)
    name = at[-1]
    advice = f"Write {{ uniform = [low, high] }} with each as {example} is written, or one of {', '.join(KINDS)}"
    if len(value) != 1 or next(iter(value)) not in KINDS:
        got = " and ".join(f'"{key}"' for key in list(value)[:5]) or "none"
        close = difflib.get_close_matches(str(next(iter(value), "")).lower(), KINDS, n=1)
        toml.fault(at, f"{name} takes one kind of distribution, got {got}", f'Did you mean "{close[0]}"?' if close else advice)
        return None
    ((kind, given),) = value.items()
    names = FORMS[kind]
    if not isinstance(given, list) or len(given) != len(names):
        toml.fault((*at, kind), f"{kind} of {name} takes [{', '.join(names)}], got {quoted(given)}", advice)
        return None
    numbers = []
    for i, part in enumerate(names):
        plain, low = part == "geometric sd", kind == "truncated_normal" and part == "low"
        shown = "1.2" if plain else example
        numbers.append(positive_at(toml, (*at, kind, i), "" if plain else unit, shown, quiet=True, zero_allowed=low))
    if any(math.isnan(number) for number in numbers):
        return None
    below = float(Normal(numbers[0], numbers[1]).to_normal(0.0)) if kind == "normal" else -math.inf
    if below > -3.0:
        message = f"{name} is positive, but {numbers[1]:.3g} is too wide a standard deviation about {numbers[0]:.3g} {unit}"
        toml.fault(at, message, "Write { lognormal = [median, factor] } or { uniform = [low, high] }")
        return None
    try:
        if kind == "normal":
            return TruncatedNormal(numbers[0], numbers[1], 0.0, math.inf)
        return PRIORS[kind](*numbers)
    except ValueError as error:
        toml.fault(at, f"{name}: {error}", advice)
        return None


def _limits(toml: Toml, *, quiet: bool) -> tuple[Limit, ...]:
    table = table_at(toml, ("limits",))
    if not table:
        if not quiet:
            toml.fault(
                ("limits",), "there are no limits", "Give for example signal = { at_least = 0.08 } below a line [limits]"
            )
        return ()
    found: list[Limit] = []
    for quantity, row in LIMITED.items():
        if quantity not in table:
            continue
        at = ("limits", quantity)
        example = "0.08" if not row.unit else f'"20 {row.display_unit}"'
        usual = "at_least" if quantity == "signal" else "at_most"
        value = table[quantity]
        if not isinstance(value, dict):
            toml.fault(at, f"{quantity} must say at_least or at_most, got {quoted(value)}", f"Write {{ {usual} = {example} }}")
            continue
        check_keys(toml, at, (*SIDES, "at"))
        load = positive_at(toml, (*at, "at"), "N", _FORCE, quiet=True) if "at" in value else None
        sides = [side for side in SIDES if side in value]
        if not sides:
            toml.fault(at, f"{quantity} says neither at_least nor at_most", f"Write {{ {usual} = {example} }}")
        found += [Limit(quantity, side, positive_at(toml, (*at, side), row.unit, example, quiet=True), load) for side in sides]
    return tuple(found)


def _padding(toml: Toml) -> dict[str, Any]:
    table = table_at(toml, ("padding",))
    values: dict[str, Any] = {}
    if "thickness" in table:
        ends = table["thickness"]
        if isinstance(ends, list) and len(ends) == 2:
            values["lower"], values["upper"] = (
                positive_at(toml, ("padding", "thickness", i), "m", '"1 mm"', quiet=True, zero_allowed=True) for i in (0, 1)
            )
        else:
            message = f"thickness of the padding takes the two ends of a range, got {quoted(ends)}"
            toml.fault(("padding", "thickness"), message, 'Write ["0 mm", "9 mm"]')
    steps = table.get("steps", 181)
    if isinstance(steps, bool) or not isinstance(steps, int):
        toml.fault(("padding", "steps"), f"steps must be a whole number, got {quoted(steps)}", "Leave it out for 181")
        steps = 181
    values |= {"steps": steps, "padding_tolerance": _tolerance(toml, ("padding", "tolerance"))}
    if "gauge" in table:
        values["gauge"] = positive_at(toml, ("padding", "gauge"), "m", '"0.02 mm"', quiet=True, zero_allowed=True)
    values["guard_band"] = _share(toml, ("padding", "guard_band"), 1.0)
    values["materials"] = tuple(_material(toml, at) for at in tables_at(toml, ("padding", "materials")))
    return values


def _material(toml: Toml, at: KeyPath) -> CandidateMaterial:
    meant = check_keys(toml, at, MATERIAL, _SIGNPOSTS)
    name = text_at(toml, (*at, "name"), required='name = "soft silicone"', quiet="name" in meant)
    where = (*at, "young_modulus")
    if isinstance(get(toml, where), dict):
        modulus: float | Prior = _distribution(toml, where, "Pa", _MODULUS) or math.nan
    else:
        modulus = positive_at(toml, where, "Pa", _MODULUS, quiet="young_modulus" in meant)
    ratio = get(toml, (*at, "poisson_ratio"))
    if ratio is None:
        return CandidateMaterial(name, modulus)
    return CandidateMaterial(name, modulus, positive_at(toml, (*at, "poisson_ratio"), "", "0.3", quiet=True, zero_allowed=True))


def _sensor(toml: Toml) -> dict[str, Any]:
    table = table_at(toml, ("sensor",))
    values: dict[str, Any] = {}
    for name, key, example in (
        ("sensor_thicknesses", "thickness", '"0.74 mm"'),
        ("electrode_radii", "electrode_radius", '"8 mm"'),
    ):
        if key in table:
            found = _numbers(toml, ("sensor", key), "m", example)
            if isinstance(found, Prior):
                message = f"{key} of the sensor is chosen among values, not distributed"
                toml.fault(("sensor", key), message, f"Write [{example}], and how it scatters as {key.split('_')[0]}_tolerance")
                found = ()
            values[name] = found
    for name, key in (
        ("sensor_tolerance", "thickness_tolerance"),
        ("dielectric_tolerance", "dielectric_tolerance"),
        ("electrode_tolerance", "electrode_tolerance"),
    ):
        values[name] = _tolerance(toml, ("sensor", key))
    return values


def _tolerance(toml: Toml, at: KeyPath) -> Tolerance | None:
    value = get(toml, at)
    if value is None:
        return None
    if not isinstance(value, dict) or len(value) != 1 or next(iter(value)) not in TOLERANCES:
        toml.fault(at, f"{at[-1]} must say which kind of tolerance it is, got {quoted(value)}", _TOLERANCE)
        return None
    (kind,) = value
    return Tolerance(kind, positive_at(toml, (*at, kind), "m", '"0.1 mm"', quiet=True))
