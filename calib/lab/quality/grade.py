"""What one check says of one channel of a lab file: `Grade`, its level, and which come first."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Level = Literal["good", "warning", "bad"]

# The levels in the order in which people should read them.
LEVELS: tuple[Level, ...] = ("bad", "warning", "good")


@dataclass(frozen=True)
class Grade:
    """What one check found in one channel of one lab file.

    Attributes
    ----------
    check : what was looked at, such as "hysteresis".
    level : "good", "warning" (look at it: the result may carry it) or "bad" (repeat the test if at all possible).
    number : what was found, in `unit`; always finite.
    unit : "N", "m", "s"; "1" for a share; "times" for a ratio; "readings" or "steps" for a count.
    finding : the number in a sentence, with what it is compared to.
    advice : what to do about it; "" where nothing is to be done.
    channel : "force" or "capacitance".
    file : name of the lab file.
    """

    check: str
    level: Level
    number: float
    unit: str
    finding: str
    advice: str
    channel: str
    file: str


def worst_first(grades: Iterable[Grade]) -> list[Grade]:
    """Grades in the order in which people should read them: bad ones, warnings, good ones; as given within a level."""
    return sorted(grades, key=lambda v: LEVELS.index(v.level))


def level_beyond(value: float, warning: float, bad: float) -> Level:
    """Grade a number of which a larger one is worse.

    Parameters
    ----------
    value : what was found.
    warning, bad : limits above which it is a warning, and bad.
    """
    return "bad" if value > bad else "warning" if value > warning else "good"
