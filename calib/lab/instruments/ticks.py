"""From the lines beside a table to what they say that one count of a clock lasts: `Tick = 0.5 ms`, `20 fps`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from calib.lab.instruments.units import asked_factor, is_unit_of

_LONGEST = 120
_NUMBER = r"(?P<number>\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_UNIT = r"[\s;,\t\"]*(?P<unit>[^\W\d]+(?:/s(?:ec)?)?|1/s)"
_UNIT_BEFORE = re.compile(r"[\[(]\s*(?P<unit>[^\W\d]+(?:/s)?|1/s)\s*[\])]")
# "Tick = 0.5 ms", "1 count is 100 us", "Counter resolution: 100 us", "Clock frequency: 2000 Hz", "camera frame rate: 20 fps".
_OF = r"(?:counts?|counters?|timers?|clocks?|time ?base|time ?stamps?|frames?|camera|zähler|kamera|bild(?:er)?|takt(?:geber)?)"
_HOW = r"(?:resol\w*|rates?|freq\w*|periods?|intervals?|ticks?|steps?|units?|auflösung|frequenz|periode|intervall|schritt|takt)"
_TICK = tuple(
    re.compile(rf"(?<![^\W_])(?:{what})(?![^\W_])(?P<between>[^\d]*?){_NUMBER}(?:{_UNIT})?", re.IGNORECASE)
    for what in (
        r"ticks?",
        rf"1 ?{_OF}(?= ?(?:=|is|ist|≙|:))",
        rf"{_OF}[ _-]?{_HOW}",
        r"bildrate|zählertakt|abtasttakt|framerate",
    )
)
_A_SECOND = re.compile(
    rf"{_NUMBER}\s*(?:ticks?|counts?|frames?|bilder)\s*(?:/|per|pro)\s*(?:s|sec|seconds?|sekunde)\b|"
    r"\b(?:ticks?|counts?|frames?|bilder)\s*(?:/|per|pro)\s*(?:s|sec|seconds?|sekunde)\b[^\d]*(?P<behind>\d+(?:[.,]\d+)?)|"
    r"(?<![\w.,])(?P<frames>\d+(?:[.,]\d+)?)\s?fps\b",
    re.IGNORECASE,
)
_OFTEN = re.compile(r"(?P<thousand>[kM]?)(?:Hz|fps|1/s|/s)")
_THOUSANDS = {"": 1, "k": 1000, "M": 1_000_000}


@dataclass(frozen=True)
class Tick:
    """What one count lasts: seconds, as a unit that may be asked for, and the line and words that say it."""

    seconds: float
    unit: str
    line: int
    shown: str


def stated_tick(lines: Mapping[int, str]) -> Tick | None:
    """What one count of a clock lasts by what lines say; None if they say nothing.

    Parameters
    ----------
    lines : 1-based line -> what stands there, beside a table.

    >>> [stated_tick({1: line}).unit for line in ("1 tick = 0.5 ms", "Clock frequency: 2 kHz", "# camera: 20 fps")]
    ['0.5 ms', '0.0005 s', '0.05 s']
    >>> stated_tick({1: "Timer: 20 s", 2: "Count: 161", 3: "Clock: 14:05:07"})
    """
    for number, line in sorted(lines.items()):
        found = _lasts(line) if len(line) <= _LONGEST else None
        if found is not None and found[0] > 0:
            return Tick(float(found[0]), found[1], number, " ".join(line.replace('"', "").split()).strip(" #;,")[:60])
    return None


def _lasts(line: str) -> tuple[Decimal, str] | None:
    """Seconds of one count, and the unit of time with its number."""
    often = _A_SECOND.search(line)
    if often is not None:
        number = next(n for n in (often["number"], often["behind"], often["frames"]) if n)
        return _by_rate(Decimal(number.replace(",", ".")))
    for pattern in _TICK:
        match = pattern.search(line)
        if match is None:
            continue
        number, before = match["number"].replace(",", "."), _UNIT_BEFORE.search(match["between"])
        unit = before["unit"] if before is not None else match["unit"] or ""
        rate = _OFTEN.fullmatch(unit)
        if rate is not None:
            return _by_rate(Decimal(number) * _THOUSANDS[rate["thousand"]])
        if unit and is_unit_of(unit, "time"):
            return Decimal(number) * Decimal(repr(asked_factor(unit, "time"))), f"{number} {unit}"
    return None


def _by_rate(rate: Decimal) -> tuple[Decimal, str] | None:
    if not rate:
        return None
    step = 1 / rate
    return step, f"{as_written(step)} s"


def as_written(step: Decimal) -> str:
    """A number of seconds in as few figures as it has, nine at most."""
    return f"{step.normalize():f}" if step == round(step, 9) else f"{float(step):.9g}"
