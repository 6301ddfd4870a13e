"""From a name without its unit to all that it may mean: a plain name, one with a number, an axis or words beside it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from calib.lab.instruments.lexicon import (
    COMMANDED,
    DERIVED,
    NAMES,
    PROCESSED,
    QUALIFIERS,
    RELATIVE,
    SECOND,
    SENSORS,
    STATISTIC,
)
from calib.lab.instruments.units import is_unit_of

#: Ranks below are of names that stand in the lists of names; words, numbers or letters beside a name put it behind these.
PLAIN = 200

# Names with a number or a letter behind or before them: "load 2", "cap2", "force b", "load .1", "c 1 force", "ch3 load".
_NUMBERED = re.compile(r"^(?P<name>.*[^\W\d])[ #.-]*(?P<index>\d{1,3})$")
# A number that is taken off: "cp - 90", "c-90"; a channel has one digit close behind its name, or a zero first: "c-1", "c-01".
_TAKEN_OFF = re.compile(r"(?<=[^\W\d])(?:\s+-\s*\d+|-\s*[1-9]\d+|-\s+\d+)(?![\w.,])")
_LETTERED = re.compile(r"^(?P<name>.+) (?P<index>[a-f]|ii|iii)$")
_LEADING = re.compile(r"^(?:[a-z]|ch|chan|channel|kanal|sensor|ai)? ?(?P<index>\d{1,3}) (?P<name>.+)$")
_AT_FREQUENCY = re.compile(r"^(?P<name>.+?)[ @]+(?:at )?(?P<index>\d+(?:[.,]\d+)? ?[km]?hz)$")
_AXIS = re.compile(r"^(?:(?P<name>.+?)[ -]?(?P<axis>[xyz])|(?P<first>[xyz])[ -](?P<rest>.+))$")
# A channel by its number only, whose unit says what it measures.
_CHANNEL = re.compile(
    r"^(?!s[de]$)(?:ch|chan|channel|kanal|canal|canale|kanał|sensor|electrode|elektrode|taxel|pad|pixel|node|port|mux|input|ai|e|s|通道|채널)"
    r"[ #.-]*(?P<index>\d{1,3}|[a-f])$"
)
# At which of its rates a program sampled what has this time: "zeit 1 - standard-messrate", "time 2 - default sample rate".
_SAMPLED = re.compile(
    r"^(?P<name>.+?)(?: (?P<index>\d{1,2}))?(?: ?[-–:])? (?:(?:\w+[ -])?\w*(?:messrate|abtastrate)|"
    r"(?:(?:default|standard|fast|slow)[ -])?(?:sampl(?:e|ing)|data|scan|fast|slow|default)[ -]rate|"
    r"(?:[^\W\d]+ ){0,3}(?:d')?(?:[ée]chantillonnage|muestreo|campionamento|amostragem)(?: [^\W\d]+){0,2})$"
)
# The pair that a meter is set to, before its first value: "Cp-D", "Cs-Rs".
_BOTH_VALUES = re.compile(r"^(?P<first>c[ps])[-/](?:d|q|g|rs|rp|esr)$")
_BY_UNIT = ("capacitance", "force", "displacement")
#: What the doubt of a capacitance says whose name has a number behind a minus.
TAKEN_OFF = "taken off"


@dataclass(frozen=True)
class Meaning:
    """One thing that a name may mean."""

    quantity: str
    rank: int
    index: str = ""
    processed: bool = False
    doubt: str = ""
    letter: bool = False


def meanings(name: str, inside: Sequence[str], unit_below: str) -> Iterator[Meaning]:
    """All that a name may mean: as it stands, else with an index, an axis or words beside it, else a channel by its unit.

    Parameters
    ----------
    name : in lower case, without brackets and unit.
    inside, unit_below : what stands in its brackets, and the unit below it.
    """
    both = _BOTH_VALUES.match(name)
    name = both["first"] if both is not None else name
    plain = list(plain_meanings(name))
    if plain:
        yield from plain
        return
    turned = _turned(name)
    if turned:
        yield from turned
        return
    twice = list(_in_two_languages(name.split("/"), (*inside, unit_below))) if "/" in name else []
    if twice:
        yield from twice
        return
    match = _SAMPLED.match(name)
    if match is not None and match["name"] in NAMES["time"]:
        if any(u and is_unit_of(u, "time") for u in (*inside, unit_below)):
            yield Meaning("time", NAMES["time"].index(match["name"]) + PLAIN, match["index"] or "")
        return
    for pattern in (_AT_FREQUENCY, _NUMBERED, _LETTERED, _LEADING):
        match = pattern.match(name)
        if match is not None:
            found = list(plain_meanings(match["name"].strip(" .#-"))) or list(_qualified(match["name"].strip(" .#-")))
            if found:
                for m in found:
                    doubt = m.doubt or _difference(m.quantity, name)
                    yield Meaning(m.quantity, m.rank + PLAIN, match["index"], m.processed, doubt)
                return
    match = _AXIS.match(name)
    if match is not None and (match["axis"] or match["first"]) == "z":
        found = list(plain_meanings(match["name"] or match["rest"])) or list(_qualified(match["name"] or match["rest"]))
        found = [m for m in found if m.quantity in ("force", "displacement")]
        if match["name"] == "p" and any(u and is_unit_of(u, "displacement") for u in (*inside, unit_below)):
            found = [Meaning("displacement", 0)]  # a position along z
        if found:
            yield from (Meaning(m.quantity, m.rank + PLAIN, m.index, m.processed) for m in found)
            return
    found = list(_qualified(name))
    if found:
        yield from found
        return
    match = _CHANNEL.match(name)
    if match is not None:
        units = [*inside, unit_below]
        for quantity in _BY_UNIT:
            if any(u and is_unit_of(u, quantity) for u in units):
                yield Meaning(quantity, 3 * PLAIN, match["index"])


def is_channel(name: str) -> bool:
    """Whether a name in lower case says nothing but which channel it is.

    >>> is_channel("ch1"), is_channel("load 1")
    (True, False)
    """
    return _CHANNEL.match(name) is not None


def _turned(name: str) -> list[Meaning]:
    """What a name means whose sensor stands beside the word for a place: "displacement crosshead", "lvdt displacement"."""
    parts = name.split(" ")
    if len(parts) < 2 or not {parts[0], parts[-1]} & SENSORS:
        return []
    sensor, place = (parts[-1], " ".join(parts[:-1])) if parts[-1] in SENSORS else (parts[0], " ".join(parts[1:]))
    of_place = [m for m in plain_meanings(place) if m.quantity == "displacement"] if len(place) > 1 else []
    named = [*plain_meanings(f"{sensor} {place}"), *plain_meanings(sensor)]
    return [m for m in named if m.quantity == "displacement"][:1] if of_place else []


def _in_two_languages(names: Sequence[str], units: Sequence[str]) -> Iterator[Meaning]:
    """What names of one quantity with a stroke between them mean, in a unit of it: "kraft/force"; of two it is a ratio."""
    found = [{m.quantity: m.rank for m in plain_meanings(part)} if len(part := name.strip()) > 1 else {} for name in names]
    for quantity, rank in found[0].items():
        if all(quantity in others for others in found) and any(unit and is_unit_of(unit, quantity) for unit in units):
            yield Meaning(quantity, rank + PLAIN)


def plain_meanings(name: str) -> Iterator[Meaning]:
    """What a name in the lists of names means."""
    for quantity, names in NAMES.items():
        if name in names:
            yield Meaning(quantity, names.index(name), processed=name.startswith("corrected"))


def _qualified(name: str) -> Iterator[Meaning]:
    """A name without the words beside it that leave it what it is, or say how it was worked on."""
    parts = [w for w in re.split(r"[ ./-]+", name) if w]
    if any(w in STATISTIC or w in COMMANDED for w in parts):
        return
    beside = QUALIFIERS | PROCESSED | DERIVED | RELATIVE | SECOND
    left = [w for w in parts if w not in beside]
    if len(left) == len(parts) or not left:
        return
    processed = any(w in PROCESSED for w in parts)
    index = next((w for w in parts if w in SECOND), "")
    rest = " ".join(left)
    for m in list(plain_meanings(rest)) or list(_indexed(rest)):
        doubt = doubt_of(m.quantity, parts) or _difference(m.quantity, name)
        yield Meaning(m.quantity, m.rank + PLAIN, index or m.index, processed or m.processed, doubt, letter=len(rest) == 1)


def doubt_of(quantity: str, parts: Sequence[str]) -> str:
    """Why words beside a name make it doubtful that the column is a record of the quantity; "" if they do not.

    Parameters
    ----------
    quantity, parts : what the name means, and the words beside it.
    """
    if quantity.startswith("capacitance") and any(w in RELATIVE for w in parts):
        return "a change of a capacitance is no capacitance"
    computed = next((w for w in parts if w in DERIVED), "")
    if computed and not any(w in PROCESSED for w in parts):
        return f"what is {computed} is no record"
    return ""


def _indexed(name: str) -> Iterator[Meaning]:
    for pattern in (_NUMBERED, _LETTERED):
        match = pattern.match(name)
        if match is not None:
            yield from (Meaning(m.quantity, m.rank, match["index"]) for m in plain_meanings(match["name"].strip(" .#-")))


def _difference(quantity: str, name: str) -> str:
    """Why a capacitance with a number behind a minus is in doubt; "" if it is not, as a force, which has a zero anyway."""
    taken = _TAKEN_OFF.search(name)
    if taken is None or not quantity.startswith("capacitance"):
        return ""
    number = taken[0].strip("- ")
    return f"with {number} {TAKEN_OFF} it is a difference and no capacitance, to which {number} has to be added again"


def other_axis(name: str) -> str:
    """Which axis other than z a name is of: "x" of "force x", "fx"; "" if of none."""
    match = _AXIS.match(name)
    axis, rest = (match["axis"] or match["first"], match["name"] or match["rest"]) if match is not None else ("", "")
    known = any(m.quantity in ("force", "displacement") for m in plain_meanings(rest)) or rest in ("f", "m", "t")
    return axis if axis in ("x", "y") and known else ""
