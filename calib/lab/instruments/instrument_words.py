"""From the words of a name to those that are of an instrument: a channel, a model, a maker."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from calib.lab.instruments.brackets import no_record
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

#: What stands between the parts of a name.
APART = r"[\s_:;,|]+"
_NOT_BESIDE = KEYS | PHASES | PROCESSED | DERIVED | RELATIVE | SECOND | NUMBERED_OTHERWISE
# "LVDT1", "Laser2", but no letter: "S2" and "P1" are specimens.
_NUMBERED = CHANNELS | {name for name in ONLY_WITH_UNIT - PHASES - KEYS if len(name) > 2}
# An input of a board: "Dev1/ai1", "cDAQ1Mod2/ai0"; "ao" is an output.
_INPUT = re.compile(r"\w+/ai\d{1,3}", re.IGNORECASE)
# The board of an input that stands behind it: "Dev1_ai0".
_BOARD = re.compile(r"(?:c?daq\d{1,2})?(?:dev|mod)\d{1,2}", re.IGNORECASE)
# A channel by its number, of loggers with many with zeros before it, "CH0001", or by unit and input, "CH1-1", "U1-2".
_CHANNEL = re.compile(r"(?P<word>[^\W\d]+)[-.#]?(?:\d{1,3}|0\d{3,4})")
_UNIT_AND_INPUT = re.compile(r"(?:ch|u)\d{1,2}-\d{1,2}", re.IGNORECASE)
# A model: "U9C", "S2M10N", "WA20", "LC-10N", "LK-H050", "M-406", "L-509.20", "E4980", "HX711", "4284A"; "S2", "P10" and
# "S-101" may be specimens, "x10" a factor, "C-100" a difference.
_MODEL = re.compile(
    r"(?!P2P)[A-Z]\d{1,3}[A-Z]{1,2}|[A-Z]{2,}-?\d{1,5}[A-Z]{0,2}|[A-Z]{2,}-[A-Z]{1,2}\d{2,4}[A-Z]?|"
    r"[A-Z]\d{1,2}[A-Z]\d{1,4}[A-Z]|[a-z]{2,}\d{3,5}|"
    r"(?![XGKNTPSCD])[A-Z]-[1-9]\d{2}(?:\.[\dA-Z]{1,4})?|(?![XGKNTVF])[A-Z]\d{4,5}[A-Z]?|(?![xgkntvf])[a-z]\d{4,5}|\d{4}[AB]"
)
# How far a load cell reaches, behind its model: "U9C_10N".
_CAPACITY = re.compile(r"\d{1,4}[mkµ]?N")
_NUMBER = re.compile(r"\d{3,5}(?:-\d{1,4})?")


def instrument_words(parts: Sequence[str]) -> list[bool]:
    """Tell which parts of a name are a maker, a model, or a channel with its number, be it a part of its own.

    Parameters
    ----------
    parts : of a name, in order, as written.

    >>> instrument_words(["Kraft", "U9C"]), instrument_words(["AI", "1", "Weg"]), instrument_words(["Force", "S2"])
    ([False, True], [True, True, False], [False, False])
    """
    return [*_told(parts)]


def _told(parts: Sequence[str]) -> Iterator[bool]:
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
            or _UNIT_AND_INPUT.fullmatch(part) is not None
            or (_BOARD.fullmatch(part) is not None and re.fullmatch(r"ai\d{1,3}", after, re.IGNORECASE) is not None)
            or _is_model(part)
            or (_CAPACITY.fullmatch(part) is not None and _is_model(before))
        )


def _is_index(part: str) -> bool:
    return part.strip("#.").isdecimal() and (len(part) < 4 or (part[0] == "0" and len(part) < 6))


def _is_model(part: str) -> bool:
    said = [word.lower() for word in re.findall(r"[^\W\d]+", part)]
    return _MODEL.fullmatch(part) is not None and not any(word in _NOT_BESIDE or no_record(word) for word in said)
