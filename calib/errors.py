"""The error that every bad input becomes: all faults at once, each with where it is and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input: what, in which file, where in it, and what to do about it."""

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
    """The first `limit` faults; if there are more, one further fault that counts all of them."""
    if len(faults) <= limit:
        return faults
    return [
        *faults[:limit],
        Fault(f"{len(faults)} {what} in all; the first {limit} are listed", faults[0].path, advice="Export the file again"),
    ]
