"""From what a container says beside its readings, at any depth, to its words, each with its keys; and to names and units."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from datetime import date
from functools import lru_cache
from typing import Any

import numpy as np

from calib.lab.instruments.declared import UNIT_NAMES
from calib.lab.instruments.stated import speaks_of_scale, stated_factors
from calib.lab.instruments.units import SI_UNIT, is_unit_of, lab_factor, looks_like_unit
from calib.lab.instruments.vocabulary import words

# What containers call the name of a column, the surest first.
_NAMES = (
    "name",
    "channelname",
    "signalname",
    "label",
    "title",
    "channel",
    "signal",
    "quantity",
    "measurand",
    "bezeichnung",
    "kanal",
    "nom",
    "nombre",
    "nome",
    "canal",
    "key",
    "id",
)
# What they call its unit: "unit_string", "Units", "NI_UnitDescription", "y_unit_label", "Einheit".
_UNIT = re.compile(
    rf"(?:y|ni|eng(?:ineering)?|phys(?:ical)?|data|channel|signal|scaled)?(?:{UNIT_NAMES}|单位|単位|단위)"
    r"(?:string|label|description|desc|text|symbol|name|str)?|u|uom|eu",
    re.IGNORECASE,
)
_JOINTS = re.compile(r"[\s_.-]+")
# What programs write for themselves: how LabVIEW scales and shows a channel, how HDF5 stores it, the schema of pandas.
_TECHNICAL = re.compile(
    r"NI_(?!.*(?:comment|note|remark))|wf_|MATLAB_|H5PATH$|PYTABLES|FLAVOR$|CLASS$|VERSION$|DIMENSION_LIST$|REFERENCE_LIST$|"
    r"_Netcdf|_NC|Python\.|_ARRAY_DIMENSIONS$|\$schema$|pandas_version$|datatype$|displaytype$|monoton\w+$|novaluekey$|implicit_"
)
# Blocks whose own name says nothing of what is in them.
_ANY_BLOCK = re.compile(
    r"meta(?:data)?|info(?:rmation|s)?|header|kopf|settings?|config(?:uration)?|params?|parameters?|parameter|propert(?:y|ies)|props|"
    r"attributes|attrs|test|document|general|common|context|about|setup|experiment|details|einstellungen|angaben|user_?data",
    re.IGNORECASE,
)
# So many values are few beside so many times as many.
FEW_VALUES, _FEWER = 10, 5
# What a block calls its one value.
_VALUE = re.compile(r"v|val|values?|number|amount|wert|zahl|valeur|valor|valore", re.IGNORECASE)
# Blocks in each other, the numbers of a list that are said in a line, and the longest line.
_DEEPEST, _MOST_NUMBERS, _LONGEST = 12, 40, 200
_SENTENCES = re.compile(r"(?<=[.;!?])\s+")
_HUMPS = re.compile(r"(?<=[a-zäöüß])(?=[A-ZÄÖÜ][a-zäöüß])")
# Keys of a state, in which a single word says much.
_OF_STATE = re.compile(
    r"stat(?:us|e)|valid|quality|error|warn|fault|mode|func|circuit|invert|polarity|sign|gültig|fehler", re.I
)
_PLAIN_WORDS = re.compile(r"[^\W\d_]{2,}\s+[^\W\d_]{2,}")


@dataclass(frozen=True)
class Saying:
    """What stands beside readings: the keys that lead to it, the outermost first, and its words."""

    keys: tuple[str, ...]
    words: str

    @property
    def line(self) -> str:
        """Keys and words as a line of text.

        >>> Saying(("meta", "force_unit"), "mN").line, Saying(("settings", "lcr", "mode"), "Cs-D").line
        ('force unit\\tmN', 'lcr mode\\tCs-D')
        """
        told = [key for key in self.keys[:-1] if not _ANY_BLOCK.fullmatch(key)]
        return f"{' '.join(map(_plain, (*told, *self.keys[-1:])))}\t{self.words}"

    def without(self, name: str) -> Saying:
        """The same without the key that is a name, as it is of what has this name alone."""
        return Saying(tuple(key for key in self.keys if key != name), self.words)


def sayings(value: Any, keys: tuple[str, ...] = ()) -> Iterator[Saying]:
    """List what a value that holds no readings says, block by block and line by line.

    Parameters
    ----------
    value : a text, a number, a list, a block of them; what is none of these says nothing.
    keys : that lead to it.

    >>> [said.line for said in sayings({"scale": {"force": 10}, "notes": ["cell not connected", "x10"]})]
    ['scale force\\t10', 'notes\\tcell not connected', 'notes\\tx10']
    """
    if len(keys) > _DEEPEST or (keys and is_technical(keys[-1])):
        return
    if isinstance(value, Mapping):
        for key, one in _with_units(value).items():
            yield from sayings(one, keys if keys and _VALUE.fullmatch(str(key)) else (*keys, str(key)))
    elif isinstance(value, np.ndarray):
        yield from sayings(value.tolist() if value.ndim else value.item(), keys) if value.dtype.kind in "fiubSUO" else ()
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        if len(value) > 1 and all(isinstance(one, int | float) and not isinstance(one, bool) for one in value):
            yield Saying(keys, "\t".join(map(str, value[:_MOST_NUMBERS])))
            return
        for one in value:
            name, rest = name_in(one) if isinstance(one, Mapping) else ("", one)
            yield from sayings(rest, (*keys, name) if name else keys)
    elif isinstance(value, str | bytes | int | float | np.generic | date):
        text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
        for line in text.splitlines():
            for part in _SENTENCES.split(line) if len(line) > _LONGEST else (line,):
                one_line = " ".join(part.split()).replace('"', "'")
                if one_line:
                    yield Saying(keys, one_line[:_LONGEST])


def _with_units(block: Mapping[str, Any]) -> Mapping[str, Any]:
    """A block with its unit behind its number, if it is of that alone: one value, or a sensitivity ("N/V")."""
    unit, _, rest = unit_in(block)
    numbers = [key for key, one in rest.items() if isinstance(one, int | float) and not isinstance(one, bool)]
    if not unit or not numbers or not ("/" in unit or (len(numbers) == 1 and _VALUE.fullmatch(numbers[0]))):
        return block
    return {key: f"{one} {unit}" if key in numbers else one for key, one in rest.items()}


def is_few(n_value: int, longest: int) -> bool:
    """Whether so many values beside readings of the longest list are a setting, or results, and no readings.

    Parameters
    ----------
    n_value : how many there are.
    longest : how many values the longest list of the file has.

    >>> is_few(3, 80), is_few(12, 80), is_few(3, 5)
    (True, False, False)
    """
    return n_value < FEW_VALUES and _FEWER * n_value <= longest


def is_technical(key: str) -> bool:
    """Whether a key is one that programs write for themselves, and that says nothing of the readings as they stand."""
    return _TECHNICAL.match(key) is not None


def is_unit_key(key: str) -> bool:
    """Whether a key is what a container calls a unit.

    >>> [is_unit_key(key) for key in ("unit", "unit_string", "NI_UnitDescription", "Einheit", "wf_xunit_string", "gain")]
    [True, True, True, True, False, False]
    """
    return _UNIT.fullmatch(_JOINTS.sub("", key)) is not None


def name_in(members: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    """The name that a block gives itself, "" if it gives none, and its other members."""
    called = {_JOINTS.sub("", key.lower()): key for key, value in members.items() if isinstance(value, str) and value.strip()}
    key = next((called[name] for name in _NAMES if name in called), None)
    rest = {k: v for k, v in members.items() if k != key}
    return (str(members[key]).strip(), rest) if key is not None else ("", rest)


def unit_in(members: Mapping[str, Any]) -> tuple[str, tuple[str, ...], dict[str, Any]]:
    """The unit that a block states, "" if none or several; all that it states where they differ; and its other members.

    >>> unit_in({"unit_string": "N", "Unit": "kN", "gain": 10}), unit_in({"unit": "N", "units": "newton"})
    (('', ('N', 'kN'), {'gain': 10}), ('N', (), {}))
    """
    stated = {key: value.strip() for key, value in members.items() if isinstance(value, str) and is_unit_key(key)}
    rest = {key: value for key, value in members.items() if key not in stated}
    units = list(dict.fromkeys(filter(None, stated.values())))
    if len(units) > 1:
        units = [unit for unit in units if looks_like_unit(unit)] or units
        rest |= {key: unit for key, unit in stated.items() if unit and unit not in units}
    alike = all(_are_alike(units[0], unit) for unit in units[1:])
    return (units[0], (), rest) if units and alike else ("", tuple(units), rest)


def units_in(blocks: Mapping[str, Any]) -> dict[str, str]:
    """The units of columns by their names, as blocks state them, also within others.

    >>> units_in({"units": {"F": "N"}, "columns": [{"name": "t", "unit": "s"}], "x": {"unit": "mm", "sensor": "no 3"}})
    {'x': 'mm', 't': 's', 'F': 'N'}
    """
    found: dict[str, str] = {}
    for key, value in blocks.items():
        if is_unit_key(key) and isinstance(value, Mapping):
            found = {**found, **{name: unit for name, unit in value.items() if isinstance(unit, str)}}
        elif isinstance(value, Mapping):
            own = {key: unit} if (unit := unit_in(value)[0]) else {}
            found = {**units_in(value), **own, **found}
        elif isinstance(value, list):
            named = (name_in(one) for one in value if isinstance(one, Mapping))
            found = {**{name: unit for name, rest in named if name and (unit := unit_in(rest)[0])}, **found}
    return found


def without_units(blocks: Mapping[str, Any], names: Set[str]) -> dict[str, Any]:
    """Blocks without the units of columns, which are taken.

    Parameters
    ----------
    blocks : what stands beside columns.
    names : of these.
    """
    found: dict[str, Any] = {}
    for key, value in blocks.items():
        if isinstance(value, Mapping) and is_unit_key(key):
            found[key] = {name: unit for name, unit in value.items() if name not in names}
        else:
            found[key] = without_units(value, names) if isinstance(value, Mapping) else value
    return found


def _are_alike(one: str, other: str) -> bool:
    """Whether two units are the same under two names."""
    return any(is_unit_of(one, q) and is_unit_of(other, q) and lab_factor(one, q) == lab_factor(other, q) for q in SI_UNIT)


def of_column(said: Saying, names: Sequence[str]) -> int | None:
    """The column that a saying names by one of its keys, and whose alone it is; None if it names none, or several do so.

    Parameters
    ----------
    said : beside a table.
    names : of the columns of this.
    """
    called = {words(key) for key in said.keys}
    found = [index for index, name in enumerate(names) if name and words(name) in called]
    return found[0] if len(found) == 1 else None


@lru_cache(maxsize=4096)
def may_change_readings(said: Saying) -> bool:
    """Whether a saying is more than a plain number, word or date: a factor, a unit, a state, or words in succession."""
    line = said.line
    return bool(stated_factors([line]) or speaks_of_scale(line) or _OF_STATE.search(line) or _PLAIN_WORDS.search(said.words))


def _plain(key: str) -> str:
    """A key as words: "force_unit" and "forceUnit" as "force unit"; a unit at its end stays where it is."""
    parts = key.split("_")
    apart = key if looks_like_unit(parts[-1]) else key.replace("_", " ")
    return " ".join(_HUMPS.sub(" ", apart).split()).replace('"', "'")
