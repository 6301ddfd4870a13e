"""A verdict in, what people read of it out: the same words in the page as on the screen."""

from __future__ import annotations

from collections.abc import Sequence

from calib.checks import Verdict

_STATUS = {
    "green": "Green: the numbers can be used.",
    "amber": "Amber: the numbers can be used for what the reasons below leave.",
    "red": "Red: do not use the numbers.",
}


def status_in_words(verdict: Verdict) -> str:
    """Say in a sentence whether the numbers of a result may be used, the colour first."""
    return _STATUS[verdict.colour]


def listed(words: Sequence[str]) -> str:
    """Words as a part of a sentence: all of them, or the first three and how many more there are."""
    if len(words) > 4:
        words = [*words[:3], f"{len(words) - 3} more"]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
