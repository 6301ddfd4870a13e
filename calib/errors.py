"""The error that every bad input becomes: all faults at once, each with where it is and what to do."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from calib.visible import visible

# Characters that are shown of each end of a long message.
_SHOWN = 1000
# What ends a sentence, behind which no point is written.
_STOPS = ("?", "!", ".")


@dataclass(frozen=True)
class Choice:
    """What an input leaves open and its user must say: which option, and the values that it may have.

    Printed as options of the command line that work as they stand, for advice.

    >>> print(Choice("where", ("1000", "10000"), "Frequency (Hz)"))
    --where "Frequency (Hz)=1000" or --where "Frequency (Hz)=10000"
    >>> print(Choice("specimen", tuple("12345678")))
    --specimen 1, --specimen 2, --specimen 3 or another of 8

    Attributes
    ----------
    option : name of the option, which is a field of `calib.lab.Reading`.
    alternatives : the values that may be said, as text, the likeliest first.
    key : what the value is said of, where the option has a table of them: a quantity or a column; else "".
    """

    option: str
    alternatives: tuple[str, ...]
    key: str = ""

    def __str__(self) -> str:
        said = [f"{self.key}={value}" if self.key else value for value in self.alternatives]
        options = [f"--{self.option} {in_shell(text)}" for text in said]
        if len(options) > 4:
            return f"{', '.join(options[:3])} or another of {len(options)}"
        return " or ".join([*([", ".join(options[:-1])] if options[1:] else []), *options[-1:]])


def in_shell(word: str) -> str:
    """One word of a command line that can be pasted, in double quotes where that is enough, which every shell understands.

    >>> print(in_shell("run 1"), in_shell("cost $1"))
    "run 1" 'cost $1'
    """
    if visible(word) != word:
        written = visible(word.replace("\\", "\\\\").replace("'", "\\'"))
        return f"$'{written}'"
    plain = shlex.quote(word)
    return f'"{word}"' if plain != word and not set(word) & set('"\\$`!\n') else plain


def in_shell_path(path: Path) -> str:
    """The name of a file or a folder as one word of a command line, which is taken for no option."""
    word = str(path)
    return in_shell(f"./{word}" if word.startswith("-") else word)


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
    choice : what may be said of the input to be rid of the fault; None if it is not for its user to choose.
    """

    message: str
    path: Path | None = None
    line: int | None = None
    column: int | None = None
    advice: str = ""
    choice: Choice | None = None

    def __str__(self) -> str:
        column = self.column if self.line is not None else None
        place = ":".join(str(p) for p in (self.path, self.line, column) if p is not None)
        return f"{place}: {self.sentences}" if place else self.sentences

    @property
    def sentences(self) -> str:
        """What is wrong and what to do, without the place."""
        message, advice = _cut(self.message), _cut(self.advice)
        stop = "" if message[-1:] in _STOPS else "."
        return f"{message}{stop} {advice}" if advice else message


def _cut(text: str) -> str:
    """A text for a screen, which what is quoted from a file of one endless word would fill."""
    return text if len(text) <= 2 * _SHOWN else f"{text[:_SHOWN]} ... {text[-_SHOWN:]}"


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
