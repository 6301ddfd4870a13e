"""Quantities with units: from text such as "0.74 mm" to an SI number, and from a unit name to its SI factor."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from functools import cache
from importlib import import_module

from calib.visible import shortened

#: SI units of the dimensions the project knows; "" is dimensionless.
SI_UNITS = ("m", "N", "Pa", "F", "s", "m/N", "1/m", "kg", "Hz", "ohm", "S", "")

# Spellings seen in lab files and experiment files that pint does not know or reads as something else.
_SPELLINGS = {
    "sec": "s",
    "secs": "s",
    "msec": "ms",
    "minutes": "min",
    "inch": "in",
    "um": "µm",
    "μm": "µm",  # Greek mu to micro sign
    "gf": "gram_force",
    "kgf": "kilogram_force",
    "lbf": "pound_force",
    "Ω": "ohm",
    "Ohm": "ohm",
    "-": "",
    "1": "",
}

# Units that people use, for hints.
_USUAL = {
    "m": ("mm", "um", "cm", "nm", "m"),
    "N": ("N", "mN", "kN"),
    "Pa": ("MPa", "kPa", "Pa", "GPa"),
    "F": ("pF", "nF", "fF", "uF", "F"),
    "m/N": ("um/N", "mm/N", "m/N"),
    "1/m": ("1/mm", "1/m"),
    "s": ("s", "ms", "min"),
    "Hz": ("Hz", "kHz", "MHz"),
}

# Powers of ten by which prefixes multiply these units.
_PREFIXES = {"f": -15, "p": -12, "n": -9, "u": -6, "µ": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
_PREFIXED = ("m", "N", "Pa", "F", "s", "m/N", "Hz")

# Longer is no quantity that somebody wrote; and a power of a hundred, or of a power, may take for ever to compute.
_LONGEST = 100
_LARGE_POWER = re.compile(r"(?:\*\*|\^)[\s(+-]*(?:\d{3}|\d+[\s)]*(?:\*\*|\^))")

# What units are written with; pint leaves out all else, with what is behind it ("mm;", "mm€"), and takes per cent of a unit.
_OF_UNITS = re.compile(r"%|(?:[\w\s*/^()°·⁻-]|\.(?=\w))*")

_NUMBER = re.compile(r"^\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*$")


def _spelled(unit: str) -> str:
    unit = unit.strip().replace("μ", "µ")
    return _SPELLINGS.get(unit, unit)


@cache
def _factor(name: str, si_unit: str) -> float:
    """What pint says, which is loaded, in half a second, for other units than those of the SI with a prefix."""
    prefix = name.removesuffix(si_unit)
    if si_unit in _PREFIXED and name.endswith(si_unit) and prefix in _PREFIXES:
        return float(f"1e{_PREFIXES[prefix]}")
    factor: float = import_module("calib.of_pint").factor_of_pint(name, si_unit)
    return factor


def unit_factor(unit: str, si_unit: str) -> float:
    """Find the number by which values in one unit are multiplied to have them in SI: 1000 from "kN" to "N".

    Parameters
    ----------
    unit : name of a unit as people write it in lab files and experiment files, such as "mm", "kgf" or "um/N".
    si_unit : one of `SI_UNITS`; "" for a plain number.

    Returns
    -------
    The factor [si_unit / unit]; exact for decimal prefixes.

    Raises
    ------
    ValueError
        If the unit is unknown, is of another dimension, or has an offset (temperature).

    Examples
    --------
    >>> unit_factor("um/N", "m/N")
    1e-06
    """
    if len(unit) > _LONGEST or _LARGE_POWER.search(unit) or not _OF_UNITS.fullmatch(unit.strip()):
        raise ValueError(f'unknown unit "{shortened(unit)}"')
    try:
        over, *under = (_spelled(part) for part in unit.strip().split("/"))
        factor = _factor("/".join([over or "1", *under]) if under else over, si_unit)
    except TypeError:
        wanted = si_unit or "a plain number"
        raise ValueError(f'unit "{unit}" cannot be converted to {wanted}{_case_hint(unit, si_unit)}') from None
    except ValueError:
        raise ValueError(f'unknown unit "{unit}"{_case_hint(unit, si_unit)}') from None
    # Decimal prefixes are exact powers of ten; pint's products of floats are off by one ulp.
    power = round(math.log10(factor)) if factor > 0 else 0
    return float(f"1e{power}") if math.isclose(factor, 10.0**power, rel_tol=1e-12) else factor


def parse_quantity(text: str, si_unit: str) -> float:
    """Read a quantity as people write it, number and unit, into an SI number.

    Parameters
    ----------
    text : such as "0.74 mm"; a plain number such as "2.8" for a quantity without dimension.
    si_unit : one of `SI_UNITS`, the unit of the result; "" for a quantity without dimension.

    Returns
    -------
    The number [si_unit]; a decimal prefix does not change its digits.

    Raises
    ------
    ValueError
        If the text is not a number and a unit, the unit is missing, unknown or of another dimension, or the number is not
        finite.

    Examples
    --------
    >>> parse_quantity("0.74 mm", "m")
    0.00074
    """
    if len(text) > _LONGEST:
        raise ValueError(f'"{shortened(text)}" is not a number with a unit')
    match = _NUMBER.match(text.replace("−", "-"))  # the minus sign of typeset text
    if match is None:
        raise ValueError(f'"{text}" is not a number with a unit')
    number, unit = float(match[1]), match[2]
    if re.match(r",\d", unit):
        raise ValueError(f'"{text}" has a decimal comma, write a point')
    if not math.isfinite(number):
        raise ValueError(f'"{text}" is not a finite number')
    if not unit and si_unit:
        raise ValueError(f'"{text}" has no unit, write for example "{match[1]} {_example_unit(si_unit)}"')
    factor = unit_factor(unit, si_unit)
    # A decimal prefix moves the decimal point before the number is rounded: "0.03 mm" is 3e-05 m to the last digit.
    power = round(math.log10(factor))
    value = float(Decimal(match[1]).scaleb(power)) if factor == float(f"1e{power}") else number * factor
    if not math.isfinite(value):
        raise ValueError(f'"{text}" is not a finite number')
    return value


def _case_hint(unit: str, si_unit: str) -> str:
    """Hint at a usual unit of the same dimension that differs in upper and lower case only: "MPa" for "Mpa"; else empty."""
    usual = next((u for u in _USUAL.get(si_unit, ()) if u.lower() == unit.strip().lower()), None)
    return f', did you mean "{usual}"?' if usual and usual != unit.strip() else ""


def _example_unit(si_unit: str) -> str:
    return {"m": "mm", "Pa": "MPa", "F": "pF", "m/N": "um/N", "1/m": "1/mm"}.get(si_unit, si_unit)
