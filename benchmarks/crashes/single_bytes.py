"""A number in, whether `calib verify` finds the one byte that was changed accordingly out."""

from __future__ import annotations

from crashes.case import Case
from crashes.damages import single_bytes
from crashes.lab import Lab


def size(lab: Lab, asked: int) -> int:
    """As many as asked for; none where there is no such command."""
    return asked if lab.verifies else 0


def case(lab: Lab, number: int) -> Case:
    """Change one byte of a file that the run rests on or has written.

    Parameters
    ----------
    lab : where.
    number : decides the file and the byte.

    Returns
    -------
    What came of it.
    """
    return single_bytes(lab, number)
