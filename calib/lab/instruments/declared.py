"""From the lines above the header of a lab file to the units and the decimal mark that they declare."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType

from calib.lab.instruments.stated import explained_units, stated_units
from calib.lab.instruments.units import RECORDED, is_unit_of, lab_factor, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import Heading, understand

#: What a unit is called, for patterns.
UNIT_NAMES = (
    r"units?|einheit(?:en)?|unités?|unidad(?:es)?|unità|eenhe(?:id|den)|enhet(?:er)?|enhed(?:er)?|jednostk[ai]|yksik(?:kö|öt)"
)
_UNIT_WORD = re.compile(rf"\b(?:{UNIT_NAMES})\b|单位|単位|단위", re.I)


# Between the names and units that a line above the header declares, and words between one and its unit.
_APART = re.compile(r"[\t;,|:=]|\s{2,}")
_FILLERS = frozenset(["in", "is", "are", "as", "of", "en"])
# The mark of a comment at the beginning of a line, and how many units between blanks are a list: "N m" is one of a torque.
_MARK, _LISTED = re.compile(r"^\s*(?:#|//|%|!)+"), 3
# What the unit of a displacement may be declared as, beside those of force or time.
_LENGTH = re.compile(r"lengths?|länge|longueur|longitud|lunghezza|comprimento|lengte|długość|长度|長さ|길이", re.IGNORECASE)


def declared_units(lines: Sequence[str]) -> Mapping[str, tuple[str, int]]:
    """Units declared above: `Units : Force,kN`, `Units Time s Load kN`, `Load;kN`, `Force in kN`, `Units: s, mm, kN`.

    Of lines that contradict each other all units are given, as "kN or N", which is none. A unit of length is that of the
    displacement where units of force or time are declared, too.

    >>> dict(declared_units(["Units : Time ms", "Load|kN"]))
    {'time': ('ms', 1), 'force': ('kN', 2)}
    >>> dict(declared_units(["# units: s mm N"])), dict(declared_units(["Units: N m"]))
    ({'time': ('s', 1), 'displacement': ('mm', 1), 'force': ('N', 1)}, {})
    >>> dict(declared_units(["Units: time in s, displacement in um"]))
    {'time': ('s', 1), 'displacement': ('um', 1)}
    """
    declared: dict[str, tuple[str, int]] = {}
    lengths: dict[str, tuple[str, int]] = {}
    for number, line in enumerate(lines[-200:], max(len(lines) - 200, 0) + 1):
        parts = [p for part in _APART.split(_MARK.sub("", line)) if (p := part.strip(' \t"{}'))]
        if not _UNIT_WORD.search(line) or len(line) > 200:
            own = (
                list(stated_units(line))
                or stated_each(line)
                or (list(_named_units(parts)) if len(parts) == 2 and _is_plain(parts[0]) else [])
                or list(explained_units(line))
            )
            _declare(declared, own, number)
            continue
        sentence = _UNIT_WORD.sub("", line).strip(" \t:=")
        if own := (stated_each(sentence) or list(stated_units(sentence))):
            _declare(declared, own, number)
            continue
        parts = [p for part in parts if (p := _UNIT_WORD.sub("", part).strip())]
        if parts and all(map(looks_like_unit, parts)):
            _declare(declared, _listed_units(parts), number)
            continue
        apart = " ".join(parts).split()
        strokes = apart[0].split("/") if len(apart) == 1 else []
        if len(strokes) >= _LISTED and all(map(looks_like_unit, strokes)):
            _declare(declared, _listed_units(strokes), number)
            continue
        if _is_list_of_units(apart):
            _declare(declared, _listed_units([unit.strip("()[]") for unit in apart]), number)
            continue
        found = [*_named_units(parts), *_named_units(apart)]
        _declare(declared, found, number)
        _declare(lengths, _named_lengths(parts), number)
    beside = "displacement" not in declared and ("force" in declared or "time" in declared)
    return MappingProxyType(declared | lengths if beside else declared)


def _is_list_of_units(words: Sequence[str]) -> bool:
    """Whether words are units alone, and not each second one that of the letter before it, as in "s mm F N"."""
    bare = [word.strip("()[]") for word in words]
    if len(bare) < _LISTED or not all(map(looks_like_unit, bare)):
        return False
    pairs = list(zip(bare[::2], bare[1::2], strict=False))
    named = [(h := _named(name, unit)) is not None and is_unit_of(unit, h.quantity) for name, unit in pairs]
    return len(bare) % 2 == 1 or not all(named)


def stated_each(line: str) -> list[tuple[str, str]]:
    """Quantity and unit of each part of a sentence that states one in every part: "Load in mN, travel in um, time in s"."""
    stated = [list(stated_units(part)) for part in re.split(r"[,;]\s+|\s(?:and|und|et|y|e|en|i)\s", line) if part.strip()]
    return [own for part in stated for own in part] if len(stated) > 1 and all(stated) else []


def _declare(declared: dict[str, tuple[str, int]], found: Iterable[tuple[str, str]], line: int) -> None:
    """Add what a line declares; another unit of the same quantity than before leaves both."""
    for named, unit in found:
        quantity = stands_for(named)
        before = declared[quantity][0].split(" or ") if quantity in declared else []
        others = [u for u in before if lab_factor(u, quantity) != lab_factor(unit, quantity)]
        declared[quantity] = " or ".join([*others, unit]), line


def _named_units(parts: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Quantity and unit of names with a unit of theirs behind each; a name may be several parts long."""
    name: list[str] = []
    for part in parts:
        unit = part[1:-1] if part[:1] + part[-1:] in ("()", "[]") else part
        heading = next((h for n in range(len(name)) if (h := _named(" ".join(name[n:]), unit)) is not None), None)
        if heading is not None and is_unit_of(unit, heading.quantity):
            yield heading.quantity, unit
            name = []
        elif part.lower() not in _FILLERS:
            name.append(part)


def _named_lengths(parts: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The units that stand behind nothing but a word for length: "Length mm", not "Gauge length mm"."""
    pairs = [*pairwise(parts), *(tuple(part.split()) for part in parts if len(part.split()) == 2)]
    for name, unit in pairs:
        if _LENGTH.fullmatch(name) and is_unit_of(unit.strip("()[]"), "displacement"):
            yield "displacement", unit.strip("()[]")


def _is_plain(name: str) -> bool:
    heading = understand(name)
    return heading is not None and not heading.index and heading.unit is None


def _named(name: str, unit: str) -> Heading | None:
    return understand(name) or understand(name, unit)


def _listed_units(units: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Quantity and unit of units that stand without names, of those that are of one quantity each."""
    for quantity in RECORDED:
        own = {unit for unit in units if is_unit_of(unit, quantity)}
        if len(own) == 1:
            yield quantity, own.pop()


# `MTS793|MPT|DEU|1|0|,|.|:|...`: the sixth field is the decimal mark.
_MTS = re.compile(r"^\ufeff?MTS793\|[^|]*\|[^|]*\|[^|]*\|[^|]*\|(?P<mark>[.,])\|")
_DECIMAL_WORDS = re.compile(
    r"^\W*(?:decimal (?:mark|separator|sign|symbol)|dezimal(?:trennzeichen|zeichen)|séparateur décimal|separador decimal)\W*"
    r"[\s:;,=\t\"]\W*?(?P<mark>[.,]|comma|komma|point|punkt|dot)\"?\s*$",
    re.IGNORECASE,
)


def declared_decimal(lines: Sequence[str]) -> str:
    """The decimal mark declared above the header: by MTS's first line, or in words; "" if it is not."""
    for line in lines[-200:]:
        match = _MTS.match(line) or _DECIMAL_WORDS.match(line)
        if match:
            mark = match["mark"].lower()
            return mark if mark in ".," else "," if mark in ("comma", "komma") else "."
    return ""
