"""The error that every bad input becomes: all faults at once, each with where it is and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with an input, so that a user can find it and mend it.

    Printed as ``file:line:column: message. advice``, without the parts that are not known.

    >>> str(Fault("sensor_thickness has no unit, got 0.74", advice='Write "0.74 mm"'))
    'sensor_thickness has no unit, got 0.74. Write "0.74 mm"'

    Attributes
    ----------
    message : what is wrong, with the number or word that was found.
    path : file with the fault; None if the input is no file.
    line, column : place in the file, counted from 1; None if not known.
    advice : what to do about the fault; may be empty.
    """

    message: str
    path: Path | None = None
    line: int | None = None
    column: int | None = None
    advice: str = ""

    def __str__(self) -> str:
        place = ":".join(str(p) for p in (self.path, self.line, self.column) if p is not None)
        text = f"{place}: {self.message}" if place else self.message
        return f"{text}. {self.advice}" if self.advice else text


class InputError(ValueError):
    """Input that cannot be used. `faults` holds everything that was found wrong; the command line turns it into exit code 2."""

    def __init__(self, faults: Fault | Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__("\n".join(str(f) for f in self.faults))


def capped(faults: list[Fault], what: str, limit: int = 10) -> list[Fault]:
    """Shorten a long list of faults, so that a file with thousands of bad cells does not fill the screen.

    Parameters
    ----------
    faults : all that were found.
    what : the plural noun that the last line counts, such as "cells that are not numbers".
    limit : how many faults are kept.

    Returns
    -------
    The first `limit` faults; if there were more, one further fault that counts all of them.
    """
    if len(faults) <= limit:
        return faults
    return [
        *faults[:limit],
        Fault(f"{len(faults)} {what} in all; the first {limit} are listed", faults[0].path, advice="Export the file again"),
    ]
