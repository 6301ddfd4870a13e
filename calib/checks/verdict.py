"""Reasons against using the numbers of a result in, one verdict on them out: green, amber or red, and what to do."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

Colour = Literal["green", "amber", "red"]
Level = Literal["amber", "red"]

#: What an amber verdict allows, after what it is on.
AMBER_ALLOWS = (
    "may be used to plan and to try; for anything that is signed or released, first settle each reason given or accept it "
    "knowingly"
)

#: The worse first.
LEVELS: tuple[Level, ...] = ("red", "amber")


@dataclass(frozen=True)
class Reason:
    """One thing that speaks against using the numbers of a result.

    Attributes
    ----------
    gate : what was looked at, in a word or two, such as "extrapolation".
    level : "amber" if it has to be settled or accepted first, see `AMBER_ALLOWS`; "red" if the numbers must not be used.
    finding : what was found, with its numbers, in a sentence without a full stop.
    action : the one thing to do about it, likewise.
    """

    gate: str
    level: Level
    finding: str
    action: str

    @property
    def in_words(self) -> str:
        """Finding and action in two sentences."""
        return f"{_sentence(self.finding)} {_sentence(self.action)}"


@dataclass(frozen=True)
class Verdict:
    """Whether the numbers of a result may be used: the same on the screen, in the exit code, in files and in the report.

    Attributes
    ----------
    reasons : what speaks against it, the worst first.
    """

    reasons: tuple[Reason, ...] = ()

    @property
    def colour(self) -> Colour:
        """Red if a reason is, else amber if there are any, else green; what amber allows says `AMBER_ALLOWS`."""
        return min((r.level for r in self.reasons), key=LEVELS.index) if self.reasons else "green"

    def to_plain(self) -> dict[str, Any]:
        """What files hold of it: the colour, and the reasons with gate, level, finding and action."""
        return {"colour": self.colour, "reasons": [asdict(r) for r in self.reasons]}


@dataclass(frozen=True)
class Light:
    """One gate that a result was held against, whether it passed or not.

    Attributes
    ----------
    gate : what was looked at, in a word or two.
    light : "green" if nothing speaks against it, else the level of the reason.
    reason : what was found, in a sentence without a full stop.
    action : the one thing to do about it, likewise; empty where it is green.
    """

    gate: str
    light: Colour
    reason: str
    action: str = ""


def lights_of(verdict: Verdict, passed: Mapping[str, str]) -> tuple[Light, ...]:
    """Every gate with its light: the reasons of a verdict in their order, and then what is green.

    Parameters
    ----------
    verdict : on the result.
    passed : gates that were looked at -> what it means that they are green; one that the verdict has a reason of is left out.
    """
    against = tuple(Light(r.gate, r.level, r.finding, r.action) for r in verdict.reasons)
    named = {light.gate for light in against}
    return (*against, *(Light(gate, "green", meaning) for gate, meaning in passed.items() if gate not in named))


def verdict_from_plain(plain: Mapping[str, Any]) -> Verdict:
    """The verdict that `Verdict.to_plain` wrote."""
    return Verdict(tuple(Reason(**reason) for reason in plain["reasons"]))


def reasons_to_text(reasons: Sequence[Reason]) -> str:
    """Reasons as a text that is kept with draws; the inverse is `reasons_from_text`."""
    return json.dumps([asdict(reason) for reason in reasons])


def reasons_from_text(text: str) -> tuple[Reason, ...]:
    """The reasons that `reasons_to_text` wrote."""
    return tuple(Reason(**plain) for plain in json.loads(text))


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """Sum reasons up, the red ones first, each level in the order given."""
    return Verdict(tuple(sorted(reasons, key=lambda r: LEVELS.index(r.level))))


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
