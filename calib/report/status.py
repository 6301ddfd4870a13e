"""A verdict in, what people read of it out: the same words in the page as on the screen."""

from __future__ import annotations

from calib.checks import Verdict

_STATUS = {
    "green": "Green: {what} can be used.",
    "amber": "Amber: {what} can be used for what the reasons below leave.",
    "red": "Red: do not use {what}.",
}


def status_in_words(verdict: Verdict, what: str = "the numbers") -> str:
    """Say in a sentence whether a result may be used, the colour first.

    Parameters
    ----------
    verdict : on the result.
    what : it is, in words.
    """
    return _STATUS[verdict.colour].format(what=what)
