"""Results in, how reasons stand on the first sheet of paper out: in full where there is room, else each in a line."""

from __future__ import annotations

import math

from calib.checks import Reason
from calib.report.section import Results

#: Specimens that the first sheet has room for.
MOST_SPECIMENS = 8

# Lines that the reasons of two specimens may have, characters of a line, and what another specimen takes away of them.
_LINES, _LINE, _OF_SPECIMEN = 16, 92, 1.2
# Lines of reasons that are shortened to one each, at the least and at the most, how many of them are of the advice alone where
# they are too many, and characters of an action in such a line.
_LEAST, _MOST, _OF_ADVICE, _ACTION = 4, 9, 2, 86


def crowded(results: Results) -> bool:
    """Whether the reasons are more than the first sheet has room for in full.

    Parameters
    ----------
    results : of a calibration.
    """
    return sum(math.ceil((len(r.finding) + len(r.action) + 4) / _LINE) for r in results.reasons) > _room(results)


def in_lines(results: Results) -> tuple[tuple[tuple[Reason, str], ...], int]:
    """The reasons as the first sheet has room for them: each with its action in a line.

    Parameters
    ----------
    results : of a calibration.

    Returns
    -------
    lines : of the first of them, what speaks against the advice alone at the end.
    left_out : how many more there are.
    """
    of_advice, reasons = results.against_advice[:_OF_ADVICE], results.verdict.reasons
    most = max(min(_MOST, math.floor(_room(results))), _LEAST)
    shown = results.reasons
    if len(shown) > most:  # one line says how many are left out
        shown = (*reasons[: most - 1 - len(of_advice)], *of_advice)
    return tuple((r, in_a_line(r.action)) for r in shown), len(results.reasons) - len(shown)


def in_a_line(action: str) -> str:
    """An action up to where a line ends, cut where it comes to a rest if that is not too early.

    >>> in_a_line("Press harder, or measure the thicknesses")
    'Press harder, or measure the thicknesses'
    >>> in_a_line("Look at the residuals; hold other models against the data with `calib compare`, and check files and radii")
    'Look at the residuals; hold other models against the data with `calib compare` …'

    Parameters
    ----------
    action : one sentence or two, without the last full stop.
    """
    if len(action) <= _ACTION:
        return action
    start = action[: _ACTION - 1]
    rest = max(start.rfind(mark) for mark in (", ", "; ", ": ", ". "))
    return f"{start[:rest] if rest > _ACTION // 3 else start[: start.rfind(' ')]} …"


def _room(results: Results) -> float:
    """Lines that the first sheet has room for."""
    more = min(len(results.posterior.experiment.specimens), MOST_SPECIMENS) - 2
    return _LINES - _OF_SPECIMEN * max(more, 0)
