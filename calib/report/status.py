"""A verdict in, what people read of it out: the same words in the page as on the screen."""

from __future__ import annotations

from calib.checks import AMBER_ALLOWS, Verdict

_STATUS = {
    "green": "Green: {what} can be used.",
    "amber": f"Amber: {{what}} {AMBER_ALLOWS}.",
    "red": "Red: do not use {what}.",
}


_BEFORE = {
    "green": "Green: nothing speaks against calibrating this.",
    "amber": "Amber: something is doubtful. Look at it first; the calibration will say so, too.",
    "red": "Red: do not calibrate this before it is put right.",
}


def check_status_in_words(verdict: Verdict) -> str:
    """Say in a sentence whether an experiment is worth calibrating, the colour first."""
    return _BEFORE[verdict.colour]


def duration_in_words(seconds: float) -> str:
    """A time in words, as exact as an estimate deserves.

    >>> duration_in_words(17.0), duration_in_words(130.0), duration_in_words(9000.0)
    ('20 s', '2 min', '2.5 h')
    """
    if seconds < 90:
        return f"{max(10, round(seconds / 10) * 10)} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def status_in_words(verdict: Verdict, what: str = "the numbers") -> str:
    """Say in a sentence whether a result may be used, the colour first.

    Parameters
    ----------
    verdict : on the result.
    what : it is, in words.
    """
    return _STATUS[verdict.colour].format(what=what)
