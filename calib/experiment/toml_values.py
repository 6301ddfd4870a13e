"""From a parsed TOML file to its values, each checked, with a fault at its place where it is wrong."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from calib.errors import InputError, capped
from calib.experiment.toml_file import Toml
from calib.experiment.toml_places import KeyPath
from calib.priors import parse_value, sign_fault
from calib.quantity import parse_quantity
from calib.visible import shortened

# Most faults, or unknown keys of a table, that are listed.
_MOST = 100


#: Most tables of an array, such as [[specimens]].
MOST_TABLES = 2000


def raise_faults(toml: Toml) -> None:
    """Refuse a file in which faults have been noted, all of them at once, in the order of the file.

    Raises
    ------
    InputError
        If there are any.
    """
    if toml.faults:
        faults = sorted(dict.fromkeys(toml.faults), key=lambda f: (f.line or 0, f.column or 0))
        raise InputError(capped(faults, "faults", _MOST))


def get(toml: Toml, at: KeyPath) -> Any:
    """Look up what stands at a path of keys in a TOML file, whatever its type.

    Parameters
    ----------
    toml : the file.
    at : path of the key, see `KeyPath`.

    Returns
    -------
    The value; None if nothing stands there.
    """
    value: Any = toml.data
    for key in at:
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            return None
    return value


def table_at(toml: Toml, at: KeyPath) -> dict[str, Any]:
    """Look up a table in a TOML file, to read its keys.

    Parameters
    ----------
    toml : the file.
    at : path of the table.

    Returns
    -------
    The table; an empty one if there is none. (`check_keys` notes the fault of what should be a table and is not.)
    """
    value = get(toml, at)
    return value if isinstance(value, dict) else {}


def tables_at(toml: Toml, at: KeyPath, *, required: str = "") -> list[KeyPath]:
    """Look up the tables of an array such as [[specimens]], and note a fault if it is written in another way.

    Parameters
    ----------
    toml : the file.
    at : path of the array of tables.
    required : advice for a user who has left the array out; "" if it may be left out.

    Returns
    -------
    Paths of the tables, in order; empty if there are none.
    """
    value = get(toml, at)
    name = ".".join(str(key) for key in at if isinstance(key, str))
    if isinstance(value, list) and all(isinstance(entry, dict) for entry in value):
        if not value:
            toml.fault(at, f"[[{name}]] is empty", required)
        if len(value) > MOST_TABLES:
            message = f"{len(value)} times [[{name}]], more than {MOST_TABLES}"
            toml.fault(at, message, "Divide them among several files")
            raise_faults(toml)
        return [(*at, i) for i in range(len(value))]
    if isinstance(value, dict):
        toml.fault(at, f"[{name}] must be a list of tables", f"Write [[{name}]] in double brackets above each of them")
    elif value is not None:
        toml.fault(at, f"{name} must be a list of tables, got {quoted(value)}", f"Write [[{name}]] above each of them")
    elif required:
        toml.fault((), f"there is no [[{name}]]", required)
    return []


@dataclass(frozen=True)
class Signposts:
    """Advice for keys that stand in the wrong table: where they belong.

    Attributes
    ----------
    places : key -> where it belongs, in words that follow "It belongs".
    hints : (heading of a table, key) -> a whole sentence of advice, for keys that need more than a place.
    """

    places: Mapping[str, str] = field(default_factory=dict)
    hints: Mapping[tuple[str, str], str] = field(default_factory=dict)


_NO_SIGNPOSTS = Signposts()


def check_keys(toml: Toml, at: KeyPath, known: Sequence[str], signposts: Signposts = _NO_SIGNPOSTS) -> set[str]:
    """Note a fault for each key of a table that is not known there, with the key that was probably meant.

    Parameters
    ----------
    toml : the file.
    at : path of the table; () for the top of the file.
    known : keys that the table may have.
    signposts : where keys belong that users write here by mistake.

    Returns
    -------
    Those of the known keys that were probably meant by a misspelled one. They need not be reported as missing as well.
    """
    table = toml.data if not at else get(toml, at)
    where = heading(at)
    if table is None:
        return set()
    if not isinstance(table, dict):
        toml.fault(at, f"{where} must be a table, got {quoted(table)}")
        return set()
    unknown = [key for key in table if key not in known]
    if len(unknown) > _MOST:
        message = f"{len(unknown)} unknown keys {'in ' + where if at else 'at the top of the file'}"
        toml.fault((*at, unknown[0]), message, f"Known here: {', '.join(known)}")
        return set()
    meant = set()
    for key in unknown:
        spelled = key.lower().replace("-", "_").replace(" ", "_")
        close = difflib.get_close_matches(spelled, [*known, *signposts.places], n=1)
        advice = f"Known here: {', '.join(known)}"
        if (where, key) in signposts.hints:
            advice = signposts.hints[where, key]
        elif key in signposts.places:
            advice = f"It belongs {signposts.places[key]}"
        elif close and close[0] in known:
            advice = f'Did you mean "{close[0]}"?'
            meant.add(close[0])
        elif close:
            advice = f'Did you mean "{close[0]}"? It belongs {signposts.places[close[0]]}'
        toml.fault((*at, key), f'unknown key "{shortened(key)}" {"in " + where if at else "at the top of the file"}', advice)
    return meant


def heading(at: KeyPath) -> str:
    """The TOML heading of a table: [specimens.priors], [[specimens.sweeps]]."""
    name = ".".join(str(key) for key in at if isinstance(key, str))
    return f"[[{name}]]" if at and isinstance(at[-1], int) else f"[{name}]"


def quantity_at(toml: Toml, at: KeyPath, parameter: str, *, required: str = "", quiet: bool = False) -> float:
    """Read a quantity with its unit from a TOML file, check its sign, and note a fault if it is wrong.

    Parameters
    ----------
    toml : the file.
    at : path of the key.
    parameter : name of the quantity, a key of `calib.catalogue.QUANTITIES`.
    required : what to write if the key is missing; "" if it may be missing.
    quiet : whether to note no fault for a missing key, as another fault speaks of it already (a misspelled key).

    Returns
    -------
    The number [SI]; nan if it is wrong or missing.
    """
    value = get(toml, at)
    if value is None:
        if required and not quiet and isinstance(get(toml, at[:-1]), dict | None):
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


def positive_at(toml: Toml, at: KeyPath, unit: str, example: str, *, quiet: bool, zero_allowed: bool = False) -> float:
    """Read a positive quantity that the catalogue does not have, and note a fault if it is wrong or missing.

    Parameters
    ----------
    toml : the file.
    at : path of the key.
    unit : SI unit of the number, one of `calib.quantity.SI_UNITS`.
    example : of what may stand there, as it is written.
    quiet : whether to note no fault for a missing key.
    zero_allowed : whether it may be zero.

    Returns
    -------
    The number [unit]; nan if it is wrong or missing.
    """
    key, value = at[-1], get(toml, at)
    if isinstance(key, int):  # an entry of a list is called by the list's name
        key = next(name for name in reversed(at) if isinstance(name, str))
    if value is None:
        if not quiet:
            toml.fault(at[:-1], f"{key} is missing", f"Give {key} = {example}")
        return math.nan
    if not unit and isinstance(value, int | float) and not isinstance(value, bool):
        value = repr(value)
    if not isinstance(value, str):
        wanted = "a quantity in quotes" if unit else "a number"
        toml.fault(at, f"{key} must be {wanted}, got {quoted(value)}", f"For example {key} = {example}")
        return math.nan
    try:
        number = parse_quantity(value, unit)
    except ValueError as error:
        toml.fault(at, f"{key}: {error}", f"For example {key} = {example}")
        return math.nan
    if not (number > 0 or (zero_allowed and number == 0)):
        rule = "must not be negative" if zero_allowed else "must be positive"
        toml.fault(at, f"{key} {rule}, got {value}", f"For example {key} = {example}")
        return math.nan
    return number


def text_at(toml: Toml, at: KeyPath, *, default: str = "", required: str = "", quiet: bool = False) -> str:
    """Read a text from a TOML file, and note a fault if it is none or empty.

    Parameters
    ----------
    toml : the file.
    at : path of the key.
    default : what a missing key stands for.
    required : what to write if the key is missing; "" if it may be missing.
    quiet : as in `quantity_at`.

    Returns
    -------
    The text without blanks around it; "" if it is wrong.
    """
    value = get(toml, at)
    if value is None:
        if required and not quiet:
            toml.fault(at[:-1], f"{at[-1]} is missing in {heading(at[:-1])}", f"Give {required}")
        return default
    if not isinstance(value, str) or not value.strip():
        toml.fault(at, f"{at[-1]} must be a text in quotes, got {quoted(value)}")
        return ""
    return value.strip()


def choice_at(toml: Toml, at: KeyPath, value: object, choices: Sequence[str]) -> str:
    """Check that a value is one of the words that a key may have, and note a fault with the nearest of them if not.

    Parameters
    ----------
    toml : the file.
    at : path of the key.
    value : what stands there.
    choices : the words; the first stands in for a wrong value.

    Returns
    -------
    One of `choices`.
    """
    if isinstance(value, str) and value in choices:
        return value
    close = difflib.get_close_matches(value.lower(), choices, n=1) if isinstance(value, str) else []
    one_of = " or ".join(f'"{choice}"' for choice in choices)
    toml.fault(at, f"{at[-1]} must be {one_of}, got {quoted(value)}", f'Did you mean "{close[0]}"?' if close else "")
    return choices[0]


def quoted(value: object) -> str:
    """Write a value as it stands in a TOML file, for a message."""
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return "without a name"
    if isinstance(value, str):
        return f'"{shortened(value)}"'
    return "a table" if isinstance(value, dict) else shortened(str(value))
