"""Quantities with units: from text such as "0.74 mm" to an SI number, and from a unit name to its SI factor."""

from __future__ import annotations

import math
import re
from functools import cache

import pint

#: SI units of the dimensions the project knows; "" is dimensionless.
SI_UNITS = ("m", "N", "Pa", "F", "s", "m/N", "kg", "Hz", "ohm", "S", "")

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

_NUMBER = re.compile(r"^\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*$")


@cache
def _registry() -> pint.UnitRegistry:
    return pint.UnitRegistry()


def _spelled(unit: str) -> str:
    unit = unit.strip().replace("μ", "µ")
    return _SPELLINGS.get(unit, unit)


def unit_factor(unit: str, si_unit: str) -> float:
    """Factor that turns a number in `unit` into `si_unit`: `unit_factor("kN", "N") == 1000`.

    >>> unit_factor("um/N", "m/N")
    1e-06

    Raises
    ------
    ValueError
        If the unit is unknown, is of another dimension, or has an offset (temperature).
    """
    registry = _registry()
    name = "/".join(_spelled(part) for part in unit.strip().split("/"))
    try:
        quantity = registry.Quantity(1.0, name if name else "dimensionless")
        factor = float(quantity.to(si_unit if si_unit else "dimensionless").magnitude)
    except pint.DimensionalityError:
        raise ValueError(f'unit "{unit}" cannot be converted to {si_unit or "a plain number"}') from None
    except Exception:  # pint raises many kinds, even tokenizer errors, for text that is not a unit
        raise ValueError(f'unknown unit "{unit}"') from None
    # Decimal prefixes are exact powers of ten; pint's products of floats are off by one ulp.
    power = round(math.log10(factor)) if factor > 0 else 0
    return float(f"1e{power}") if math.isclose(factor, 10.0**power, rel_tol=1e-12) else factor


def parse_quantity(text: str, si_unit: str) -> float:
    """SI number of a text such as "0.74 mm"; for a dimensionless quantity (`si_unit` "") "2.8" will do.

    >>> parse_quantity("0.74 mm", "m")
    0.00074

    Raises
    ------
    ValueError
        If the text is not a number and a unit, the unit is missing, unknown or of another dimension, or the number is not finite.
    """
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError(f'"{text}" is not a number with a unit')
    number, unit = float(match[1]), match[2]
    if not math.isfinite(number):
        raise ValueError(f'"{text}" is not a finite number')
    if not unit and si_unit:
        raise ValueError(f'"{text}" has no unit, write for example "{match[1]} {_example_unit(si_unit)}"')
    factor = unit_factor(unit, si_unit)
    # Division by an exact power of ten rounds once, multiplication by its inexact inverse twice.
    return number / (1 / factor) if factor < 1 and (1 / factor).is_integer() else number * factor


def _example_unit(si_unit: str) -> str:
    return {"m": "mm", "Pa": "MPa", "F": "pF", "m/N": "um/N"}.get(si_unit, si_unit)
