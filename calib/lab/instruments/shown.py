"""From a spreadsheet's number format to how it shows a number otherwise than it is stored: in per cent, scaled, with a unit."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

_DIGITS = "0#?"
_TOKEN = re.compile(
    r'"(?P<quoted>[^"]*)"|\\(?P<escaped>.)|[_*].|\[\$(?P<currency>[^\]-]*)[^\]]*\]|\[[^\]]*\]|(?P<plain>.)', re.DOTALL
)
# Words that stand for "as it is" in the languages of spreadsheet programs.
_GENERAL = re.compile(r"general|standard|estándar|standaard|@", re.IGNORECASE)


@dataclass(frozen=True)
class Shown:
    """How a number is shown: in per cent, over a thousand `thousands` times, with a `literal` beside or inside it."""

    percent: bool
    thousands: int
    literal: str
    inside: bool


@lru_cache(maxsize=4096)
def shown_as(number_format: str) -> Shown | None:
    """Tell how a number format shows numbers; None if as they are stored, but for rounding, signs and colours.

    >>> shown_as("#,##0.00") is None, shown_as('0.0,"k"').thousands, shown_as("0.00 \\\\k\\\\N").literal
    (True, 1, 'kN')
    """
    if _GENERAL.fullmatch(number_format.strip()):
        return None
    pattern, literal, percent = "", "", False
    section = _first_section(number_format)
    for match in _TOKEN.finditer(section):
        words = match["quoted"] or match["escaped"] or match["currency"]
        plain = match["plain"]
        if words:
            literal += words
            pattern += "\0" if words.strip() else ""
        elif plain is None:
            continue
        elif plain in _DIGITS + ".,/":
            pattern += plain
        elif plain == "%":
            percent = True
        elif plain in "Ee" and re.match(r"[Ee][+-]", section[match.start() :]):
            pattern += "E"
        elif plain not in " +-()'\u00a0:":
            literal += plain
            pattern += "\0"
    if _GENERAL.fullmatch(literal.strip()) and not any(c in pattern for c in _DIGITS):
        return None
    literal = _GENERAL.sub("", literal, count=1).strip() if not any(c in pattern for c in _DIGITS) else literal.strip()
    scaled = re.search(rf"[{_DIGITS}.](,+)(?![,.]*[{_DIGITS}])", pattern)
    inside = re.search(rf"[{_DIGITS}.,]\0+[{_DIGITS}.,]", pattern) is not None
    if not (percent or scaled or literal):
        return None
    return Shown(percent, len(scaled[1]) if scaled else 0, literal, inside)


def _first_section(number_format: str) -> str:
    """What applies to positive numbers: up to the first semicolon that is not quoted."""
    for match in _TOKEN.finditer(number_format):
        if match["plain"] == ";":
            return number_format[: match.start()]
    return number_format
