"""Quantities, priors and words of experiment and design files in, the JSON Schema of each out."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from calib.catalogue import QUANTITIES, UNKNOWNS, bounds_of
from calib.priors import FORMS

#: A JSON Schema, or part of one.
Schema = dict[str, Any]

#: Number, then a unit: what `calib.quantity.parse_quantity` takes, short of knowing which units there are. A unit does not
#: begin as an exponent does, or a number without unit would be one; 1/mm is one.
_DIGITS = r"(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?"
_UNIT = r"(1/|[^\s\d.,eE]|[eE]([^-+\d]|$)).*"

#: Numbers of a prior that may be negative although the quantity may not: a mean that a bound cuts off.
_ANY_SIGN = ("mean", "high")


def text(description: str) -> Schema:
    """A text that is not blank, as `toml_values.text_at` reads it."""
    return {"description": description, "type": "string", "pattern": r"\S"}


def choice(description: str, words: Sequence[object], default: object = None) -> Schema:
    """One of several words.

    Parameters
    ----------
    description : what it decides.
    words : that may be written.
    default : what a missing key stands for; None if there is no such thing.
    """
    return {"description": description, "enum": list(words)} | ({} if default is None else {"default": default})


def table(description: str, properties: Mapping[str, Schema], required: Iterable[str] = ()) -> Schema:
    """A table that has no other keys than these.

    Parameters
    ----------
    description : what it is of.
    properties : key -> schema of its value.
    required : keys that must be there.
    """
    found = {"description": description, "type": "object", "properties": dict(properties), "additionalProperties": False}
    needed = list(required)
    return found | ({"required": needed} if needed else {})


def tables(description: str, entry: Schema) -> Schema:
    """An array of tables, such as [[specimens]], with at least one.

    Parameters
    ----------
    description : what they are.
    entry : schema of each.
    """
    return {"description": description, "type": "array", "minItems": 1, "items": entry}


def quantity(description: str, unit: str, example: str, *, signed: bool = False) -> Schema:
    """A quantity: a text of number and unit, or a number where it has no dimension.

    Parameters
    ----------
    description : what it is.
    unit : SI; "" for one without dimension.
    example : of a value, as it is written.
    signed : whether it may be negative.
    """
    sign = "[-+−]?" if signed else r"\+?"
    described = {"description": description, "examples": [example if unit else float(example)]}
    if unit:
        return described | {"type": "string", "pattern": rf"^\s*{sign}{_DIGITS}\s*{_UNIT}$"}
    number: Schema = {"type": "number"} if signed else {"type": "number", "minimum": 0}
    return described | {"anyOf": [number, {"type": "string", "pattern": rf"^\s*{sign}{_DIGITS}\s*({_UNIT})?$"}]}


def quantity_of(name: str) -> Schema:
    """A known quantity, by its name in the catalogue."""
    row = QUANTITIES[name]
    return quantity(_described(name), row.unit, _example(name), signed=bounds_of(name) == "any")


def prior_of(name: str) -> Schema:
    """The prior of an unknown: a table of one kind and its numbers; with its default and why, as `calib unknowns` says them."""
    row = UNKNOWNS[name]
    about = [f"{_described(name)}; one per {row.scope}. Exists: {row.when}."]
    if row.default:
        about.append(f"Default: {row.default}" + (f", because: {row.reason}." if row.reason else "."))
    elif row.derived:
        about.append(f"Default: {row.derived}.")
    found = table(" ".join(about), {kind: _numbers(name, kind) for kind in FORMS})
    found |= {"minProperties": 1, "maxProperties": 1, "examples": [_toml(row.example)]}
    return found | ({"default": _toml(row.default)} if row.default else {})


def _numbers(name: str, kind: str) -> Schema:
    """The numbers of one kind of prior, in their order; a single one stands alone or in a list."""
    numbers = [_number(name, number) for number in FORMS[kind]]
    if len(numbers) == 1:
        only = numbers[0]
        return {"anyOf": [only, {"type": "array", "items": only, "minItems": 1, "maxItems": 1}]}
    described = f"{kind}: [{', '.join(FORMS[kind])}]"
    return {
        "description": described,
        "type": "array",
        "prefixItems": numbers,
        "minItems": len(numbers),
        "maxItems": len(numbers),
    }


def _number(name: str, number: str) -> Schema:
    if number == "geometric sd":
        return {"description": number, "type": "number", "exclusiveMinimum": 1}
    spread = number in ("sd", "scale")
    signed = not spread and (bounds_of(name) == "any" or number in _ANY_SIGN)
    example = _example(name)
    return quantity(number, QUANTITIES[name].unit, example if signed else example.lstrip("-"), signed=signed)


def _described(name: str) -> str:
    row = QUANTITIES[name]
    return f"{row.label[0].upper()}{row.label[1:]}" + (f', with its unit, such as "{_example(name)}"' if row.unit else "")


def _example(name: str) -> str:
    """A value of a quantity as it is written: the first of its example prior."""
    if name not in UNKNOWNS:
        return f"5 {QUANTITIES[name].display_unit}"
    (numbers,) = _toml(UNKNOWNS[name].example).values()
    return str(numbers[0] if isinstance(numbers, list) else numbers)


def _toml(written: str) -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads(f"value = {written}")["value"]
    return found
