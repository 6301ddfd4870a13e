"""From all names of a header to columns named by an instrument: `Force ch1 (N)`, `Kraft U9C [N]`, `Kistler 9207 [N]`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

from calib.lab.instruments.brackets import no_record, tidy, without_brackets
from calib.lab.instruments.lexicon import (
    CHANNELS,
    DERIVED,
    KEYS,
    MAKERS,
    NUMBERED_OTHERWISE,
    ONLY_WITH_UNIT,
    PHASES,
    PROCESSED,
    RELATIVE,
    SECOND,
)
from calib.lab.instruments.meanings import PLAIN
from calib.lab.instruments.together import unit_in
from calib.lab.instruments.units import IN_PLACE_OF, is_unit_of, looks_like_unit
from calib.lab.instruments.vocabulary import NEEDS_UNIT, Heading, as_a_record, understand

_NOT_BESIDE = KEYS | PHASES | PROCESSED | DERIVED | RELATIVE | SECOND | NUMBERED_OTHERWISE
# "LVDT1", "Laser2", but no letter: "S2" and "P1" are specimens.
_NUMBERED = CHANNELS | {name for name in ONLY_WITH_UNIT if len(name) > 2}
_APART = r"[\s_:;,|]+"
# An input of a board: "Dev1/ai1", "cDAQ1Mod2/ai0"; "ao" is an output.
_INPUT = re.compile(r"\w+/ai\d{1,3}", re.IGNORECASE)
_CHANNEL = re.compile(r"(?P<word>[^\W\d]+)[-.#]?\d{1,3}")
# A model: "U9C", "WA20", "LC-10N", "LK-H050", "E4980", "HX711", "4284A"; "S2" and "P10" may be specimens, "x10" a factor.
_MODEL = re.compile(
    r"(?!P2P)[A-Z]\d{1,3}[A-Z]{1,2}|[A-Z]{2,}-?\d{1,5}[A-Z]{0,2}|[A-Z]{2,}-[A-Z]{1,2}\d{2,4}[A-Z]?|[a-z]{2,}\d{3,5}|"
    r"(?![XGKNTVF])[A-Z]\d{4,5}[A-Z]?|(?![xgkntvf])[a-z]\d{4,5}|\d{4}[AB]"
)
_NUMBER = re.compile(r"\d{3,5}")
_BY_UNIT = ("force", "displacement", "capacitance")


@lru_cache(maxsize=256)
def designated(names: tuple[str, ...], below: tuple[str, ...]) -> dict[int, tuple[Heading, str]]:
    """The columns whose names hold a channel or a model beside the one word of a quantity, or a maker and a model in its place.

    Such a column is one only where no other is of the quantity by its name, or has a unit of it.

    Parameters
    ----------
    names, below : of all columns, and the units below them, "" where there is none.

    Returns
    -------
    Index of a column -> what it holds, and the words in its name that are passed by.

    >>> found = designated(("Kraft U9C [N]", "AI 2: Weg [mm]", "C S2 (pF)"), ("",) * 3)
    >>> [(index, heading.quantity, words) for index, (heading, words) in found.items()]
    [(0, 'force', 'U9C'), (1, 'displacement', 'AI 2')]
    >>> designated(("Force ch1 (N)", "Force ch2 (N)"), ("",) * 2), designated(("Force MAX1 (N)",), ("",))
    ({}, {})
    """
    columns = list(zip(names, below, strict=True))
    found = {i: f for i, (name, unit) in enumerate(columns) if name and (f := _designated(name, unit)) is not None}
    if not found:
        return {}
    plain = [understand(name, unit) or as_a_record(name, unit) if name else None for name, unit in columns]
    units = [unit or unit_in(name) for name, unit in columns]

    def of(index: int, quantity: str) -> bool:
        heading = found[index][0] if index in found else plain[index]
        named = heading is not None and IN_PLACE_OF.get(heading.quantity, heading.quantity) == quantity
        return named or is_unit_of(units[index], quantity)

    shown = {i: IN_PLACE_OF.get(heading.quantity, heading.quantity) for i, (heading, _) in found.items()}
    return {i: f for i, f in found.items() if not any(of(k, shown[i]) for k in range(len(names)) if k != i)}


def _designated(name: str, below: str) -> tuple[Heading, str] | None:
    """What a name holds without the words for an instrument in it, and these; None if it has none, or others beside them."""
    if understand(name, below) is not None or no_record(name):
        return None
    cut = without_brackets(tidy(name))
    if cut is None or not all(looks_like_unit(bracket) for bracket in cut[1]):
        return None
    outside, brackets = cut
    parts = [part for part in re.split(_APART, outside) if part]
    passed = list(_passed_by(parts))
    left = [part for part, is_passed in zip(parts, passed, strict=True) if not is_passed]
    words = " ".join(part for part, is_passed in zip(parts, passed, strict=True) if is_passed)
    unit = below or unit_in(name)
    if not words or not unit:
        return None
    heading = understand(" ".join([*left, *(f"({bracket})" for bracket in brackets)]), below) if left else None
    if heading is not None:
        doubtful = heading.name_doubt or heading.unit_doubt or heading.index or heading.processed or heading.letter
        fits = heading.quantity in NEEDS_UNIT and is_unit_of(unit, heading.quantity)
        return (heading, words) if fits and not doubtful else None
    if [part for part in left if part != unit] or not any(part.lower() in MAKERS for part in parts):
        return None
    quantity = next((quantity for quantity in _BY_UNIT if is_unit_of(unit, quantity)), "")
    return (Heading(quantity, 3 * PLAIN, words.lower(), None if below else unit), words) if quantity else None


def _passed_by(parts: Sequence[str]) -> Iterator[bool]:
    """Which parts of a name are a maker, a model, or a channel with its number, be it a part of its own."""
    for before, part, after in zip(["", *parts], parts, [*parts[1:], ""], strict=False):
        plain = part.strip(".#").lower()
        channel = _CHANNEL.fullmatch(part)
        yield (
            plain in MAKERS
            or (plain in CHANNELS and _is_index(after))
            or (_is_index(part) and before.strip(".#").lower() in CHANNELS)
            or (_NUMBER.fullmatch(part) is not None and before.lower() in MAKERS)
            or (channel is not None and channel["word"].lower() in _NUMBERED)
            or _INPUT.fullmatch(part) is not None
            or _is_model(part)
        )


def _is_index(part: str) -> bool:
    return part.strip("#.").isdecimal() and len(part) < 4


def _is_model(part: str) -> bool:
    said = [word.lower() for word in re.findall(r"[^\W\d]+", part)]
    return _MODEL.fullmatch(part) is not None and not any(word in _NOT_BESIDE or no_record(word) for word in said)
