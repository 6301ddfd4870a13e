"""Forms of priors: from what stands in an experiment file to a distribution, or to faults that say what to write instead."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtr

from calib.catalogue import QUANTITIES, UNKNOWNS, bounds_of, display
from calib.errors import Fault, InputError
from calib.priors.distributions import PRIORS, Prior, TruncatedNormal, log_mass
from calib.quantity import parse_quantity

#: Largest share of a normal prior's mass below zero that is cut off without asking, for an unknown that cannot be negative.
NEGLIGIBLE_MASS = 1e-3

#: Kind -> names of its numbers, in the order they are written; the geometric sd is a plain number, others have the unit.
FORMS: Mapping[str, tuple[str, ...]] = {
    "normal": ("mean", "sd"),
    "lognormal": ("median", "geometric sd"),
    "halfnormal": ("scale",),
    "uniform": ("low", "high"),
    "truncated_normal": ("mean", "sd", "low", "high"),
    "fixed": ("value",),
}

# Magnitudes [SI] beyond which only a slip of the unit explains a number: "3 PF" for pF, "0.7 mPa" for MPa, "0.74 m" for mm.
_CONCEIVABLE = {"m": (0.0, 0.15), "Pa": (1.0, 1e12), "F": (0.0, 1e-6), "m/N": (0.0, 1e-3), "N": (0.0, 1e5)}

# Radii below this number, without a unit, are rather in metres than in millimetres: a ball of 0.005.
_METRES = 0.05

# What people write who know the distribution by another name.
_SYNONYMS = {
    "gaussian": "normal",
    "gauss": "normal",
    "constant": "fixed",
    "value": "fixed",
    "range": "uniform",
    "flat": "uniform",
}


def parse_value(parameter: str, value: object) -> float:
    """Read one quantity of an experiment or design file into an SI number, with advice where it is not written as it should be.

    Parameters
    ----------
    parameter : name of the quantity, a key of `calib.catalogue.QUANTITIES`.
    value : as TOML gives it: a text such as "0.74 mm" for a quantity with a dimension, a number such as 2.8 for one without.

    Returns
    -------
    The number [SI]. Its sign is not checked, see `sign_fault`.

    Raises
    ------
    InputError
        (a ValueError) if it is not a number, or the unit is missing, unknown or of another dimension.

    Examples
    --------
    >>> parse_value("sensor_thickness", "0.74 mm"), parse_value("relative_permittivity", 2.8)
    (0.00074, 2.8)
    """
    row = QUANTITIES[parameter]
    if isinstance(value, str):
        try:
            number = parse_quantity(value, row.unit)
        except ValueError as error:
            raise InputError(Fault(f"{parameter}: {error}")) from None
        smallest, largest = _CONCEIVABLE.get(row.unit, (0.0, math.inf))
        if number != 0 and not smallest <= abs(number) <= largest:
            advice = f"Check the letters of the unit: {parameter} is usually given in {_plain_unit(parameter)}"
            raise InputError(Fault(f'{parameter} cannot be "{value}" ({number:.3g} {row.unit})', advice=advice))
        return number
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        wanted = "a quantity in quotes" if row.unit else "a number"
        raise InputError(Fault(f"{parameter} must be {wanted}, got {_written(value)}", advice=_example_value(parameter)))
    if not math.isfinite(value):
        raise InputError(Fault(f"{parameter} must be finite, got {value}"))
    if row.unit:
        # The unit people use for the parameter, unless the number is of a size that only SI explains (0.00074, 690000).
        unit = _plain_unit(parameter) if value == 0 or 1e-3 <= abs(value) <= 1e3 else row.unit
        written = value if bounds_of(parameter) == "any" else abs(value)
        advice = f'Write "{written} {unit}"'
        if parameter.endswith("radius") and unit == "mm" and 0 < abs(value) < _METRES:
            advice = f'Write "{1e3 * written:g} mm" if it is in metres, "{written} mm" if in millimetres'
        raise InputError(Fault(f"{parameter} has no unit, got {value}", advice=advice))
    return float(value)


def parse_prior(parameter: str, value: object) -> Prior:
    """Read what an experiment file says of an unknown before the data into a distribution.

    The forms are `{ normal = [mean, sd] }`, `{ lognormal = [median, geometric sd] }`, `{ halfnormal = scale }`,
    `{ uniform = [low, high] }`, `{ truncated_normal = [mean, sd, low, high] }` and `{ fixed = value }`; dimensional numbers
    are texts with a unit. A parameter that cannot be negative gets no mass below zero: a normal prior with at most 0.1 % of it
    there is truncated at zero (and `describe` says so), one with more is refused.

    Parameters
    ----------
    parameter : name of the unknown, a key of `calib.catalogue.UNKNOWNS`.
    value : as TOML gives it: a table of one kind and its numbers.

    Returns
    -------
    The prior, in SI.

    Raises
    ------
    InputError
        (a ValueError) with everything that is wrong: an unknown kind, not exactly one kind, a wrong number of values, a
        missing or wrong unit, a spread that is not positive, bounds in the wrong order, mass below zero.

    Examples
    --------
    >>> parse_prior("young_modulus", {"lognormal": ["0.7 MPa", 1.6]})
    LogNormal(median=700000.0, factor=1.6)
    >>> parse_prior("sensor_thickness", {"normal": ["0.74 mm", "0.02 mm"]}).describe("sensor_thickness")
    'normal, mean 0.74 mm, sd 0.02 mm, truncated at zero'
    """
    if not isinstance(value, Mapping):
        known = isinstance(value, str if QUANTITIES[parameter].unit else (int, float)) and not isinstance(value, bool)
        advice = f"A known value is written {{ fixed = {_toml(value)} }}" if known else _write(parameter)
        raise InputError(Fault(f"{parameter} needs a prior, got {_written(value)}", advice=advice))
    unknown = [str(kind) for kind in value if kind not in FORMS]
    if unknown:
        raise InputError(Fault(_unknown_kind(parameter, kind), advice=_kind_advice(kind)) for kind in unknown)
    if len(value) != 1:
        got = "none" if not value else " and ".join(value)
        raise InputError(Fault(f"{parameter} needs exactly one kind of prior, got {got}", advice=_write(parameter)))
    ((kind, given),) = value.items()
    names = FORMS[kind]
    written: Sequence[object] = given if isinstance(given, list) else [given]
    if len(written) != len(names):
        got = f"{len(written)} value{'s' if len(written) != 1 else ''}"
        raise InputError(Fault(f"{parameter}: {kind} takes {_form(names)}, got {got}", advice=_kind_example(parameter, kind)))
    faults: list[Fault] = []
    numbers: list[float] = []
    for name, entry in zip(names, written, strict=True):
        try:
            numbers.append(_geometric_sd(parameter, entry) if name == "geometric sd" else parse_value(parameter, entry))
        except InputError as error:
            faults.extend(error.faults)
    if not faults:
        faults = _faults(
            parameter, dict(zip(names, numbers, strict=True)), dict(zip(names, map(_written, written), strict=True))
        )
    if faults:
        raise InputError(faults)
    if kind == "normal" and bounds_of(parameter) != "any":
        return TruncatedNormal(numbers[0], numbers[1], 0.0, math.inf)
    return PRIORS[kind](*numbers)


def sign_fault(parameter: str, value: float, written: str) -> Fault | None:
    """Check the sign of a quantity: a thickness must not be negative, a modulus must be positive, a load zero may be either.

    Parameters
    ----------
    parameter : name of the quantity, a key of `calib.catalogue.QUANTITIES`.
    value : the number, SI.
    written : the same as it stands in the file, for the message.

    Returns
    -------
    What is wrong with the sign; None if nothing is.
    """
    if bounds_of(parameter) == "any" or value > 0 or (value == 0 and bounds_of(parameter) == "not negative"):
        return None
    rule = "must not be negative" if bounds_of(parameter) == "not negative" else "must be positive"
    advice = "Give the thickness as measured, without a sign" if parameter.endswith("thickness") and value < 0 else ""
    return Fault(f"{parameter} {rule}, got {written.strip(chr(34))}", advice=advice or _example_value(parameter))


def _faults(parameter: str, number: Mapping[str, float], written: Mapping[str, str]) -> list[Fault]:
    """Find what is wrong with the numbers of a prior; both mappings have the names in `FORMS` as keys."""
    faults = []
    for name in ("sd", "scale"):
        if name in number and not number[name] > 0:
            advice = "A known value is written { fixed = value }" if number[name] == 0 else ""
            faults.append(Fault(f"{name} of {parameter} must be positive, got {written[name]}", advice=advice))
    if "geometric sd" in number and not number["geometric sd"] > 1:
        advice = "1.6 means: two thirds of the mass between median / 1.6 and median * 1.6"
        got = written["geometric sd"]
        faults.append(Fault(f"geometric sd of {parameter} must be above 1, got {got}", advice=advice))
    if "low" in number and not number["low"] < number["high"]:
        got = f"{written['low']} and {written['high']}"
        faults.append(Fault(f"lower bound of {parameter} must be below the upper bound, got {got}"))
    for name in ("value", "median"):
        if name in number and (fault := sign_fault(parameter, number[name], written[name])):
            faults.append(fault)
        elif name == "median" and name in number and not number[name] > 0:
            faults.append(
                Fault(f"median of a log-normal prior must be positive, got {written[name]}", advice=_write(parameter))
            )
    if bounds_of(parameter) != "any" and "low" in number and number["low"] < 0:
        faults.append(Fault(f"{parameter} cannot be negative, got a lower bound of {written['low']}"))
    if faults:
        return faults
    if "mean" in number and "low" not in number and bounds_of(parameter) != "any":
        return _mass_faults(parameter, number["mean"], number["sd"], written)
    if "mean" in number and "low" in number:
        bounds = [(number[k] - number["mean"]) / number["sd"] for k in ("low", "high")]
        if not float(log_mass(np.array(bounds[0]), np.array(bounds[1]))) > math.log(1e-6):
            between = f"between {written['low']} and {written['high']}"
            got = f"mean {written['mean']}, sd {written['sd']}"
            return [Fault(f"truncated normal of {parameter} leaves next to nothing {between}, got {got}")]
    return []


def _mass_faults(parameter: str, mean: float, sd: float, written: Mapping[str, str]) -> list[Fault]:
    """Refuse a normal prior with too much mass below zero, for a quantity that cannot be negative; say what to write."""
    share = float(ndtr(-mean / sd))
    if share <= NEGLIGIBLE_MASS:
        return []
    if mean == 0 and bounds_of(parameter) == "not negative":
        advice = f"Write {{ halfnormal = {written['sd']} }}"
        return [Fault(f"{parameter} cannot be negative, but half of the prior lies below zero", advice=advice)]
    if fault := sign_fault(parameter, mean, written["mean"]):
        return [fault]
    numbers = f"mean {written['mean'].strip(chr(34))}, sd {written['sd'].strip(chr(34))}"
    message = f"{parameter} cannot be negative, but {100 * share:.2g} % of the prior lies below zero ({numbers})"
    high = _toml(display(parameter, mean + 4 * sd)) if QUANTITIES[parameter].unit else f"{mean + 4 * sd:.4g}"
    zero = _toml(f"0 {_plain_unit(parameter)}") if QUANTITIES[parameter].unit else "0"
    # With the same ratio of sd and mean, which of a mean next to nothing is more than squares hold.
    factor = f"{math.exp(math.sqrt(math.log1p(min(sd / mean, 1e100) ** 2))):.3g}"
    return [
        Fault(
            message,
            advice=f"Write {{ truncated_normal = [{written['mean']}, {written['sd']}, {zero}, {high}] }}".replace("µ", "u")
            + f" or {{ lognormal = [{written['mean']}, {factor}] }}",
        )
    ]


def _geometric_sd(parameter: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        advice = "1.6 means: two thirds of the mass between median / 1.6 and median * 1.6"
        raise InputError(
            Fault(f"geometric sd of {parameter} must be a plain number above 1, got {_written(value)}", advice=advice)
        )
    return float(value)


def _unknown_kind(parameter: str, kind: str) -> str:
    return f'{parameter}: unknown kind of prior "{kind}"'


def _kind_advice(kind: str) -> str:
    plain = kind.lower().replace("-", "").replace("_", "").replace(" ", "")
    candidates = {k.replace("_", ""): k for k in FORMS}
    close = difflib.get_close_matches(plain, candidates, n=1, cutoff=0.6)
    guess = _SYNONYMS.get(plain) or candidates.get(plain) or (candidates[close[0]] if close else "")
    return f'Did you mean "{guess}"?' if guess else f"Known kinds: {', '.join(FORMS)}"


def _kind_example(parameter: str, kind: str) -> str:
    row = QUANTITIES[parameter]
    entries = [
        "number" if name == "geometric sd" or not row.unit else f'"{name} in {_plain_unit(parameter)}"' for name in FORMS[kind]
    ]
    return f"Write {{ {kind} = {entries[0] if len(entries) == 1 else '[' + ', '.join(entries) + ']'} }}"


def _form(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _write(parameter: str) -> str:
    """Advice that shows how a prior of this unknown is written."""
    return f"Give for example {parameter} = {UNKNOWNS[parameter].example}"


def _example_value(parameter: str) -> str:
    """Advice that shows how a value is written: the first number of the example prior. Radii have no prior."""
    number = re.search(r'"[^"]*"|[\d.]+', UNKNOWNS[parameter].example if parameter in UNKNOWNS else '"5 mm"')
    return f"Give for example {number[0]}" if number else ""


def _plain_unit(parameter: str) -> str:
    return QUANTITIES[parameter].display_unit.replace("µ", "u")


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _written(value: object) -> str:
    """A value as it stands in a TOML file, good enough for a message."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        return "a list"
    return _toml(value)
