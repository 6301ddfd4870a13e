"""From a TOML file to its values with the place of every key, and faults that name file, line and column."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from calib.errors import Fault, InputError
from calib.experiment.toml_places import KeyPath, locate_keys
from calib.regular import bytes_of, names_beside, require_shown
from calib.visible import shortened

#: Bytes of the largest file: experiments of a thousand specimens have a third of it.
LARGEST = 1_000_000
# TOML promises no more.
_LARGEST_INTEGER = 2**63
# Headings of tables: five for each of two thousand specimens.
_TABLE, _MOST_TABLES = re.compile(r"^[ \t]*\[", re.MULTILINE), 10_000
_WITH_EXPONENT = "Write it with an exponent: 1e20"
# A key of fifty parts, each begun where a part begins.
_DEEP_KEY = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++[ \t]*+\.[ \t]*+){50}")


@dataclass(frozen=True)
class Toml:
    """A parsed TOML file with the place of every key, which collects the faults that are found in it.

    `faults` is the one thing that grows: checks add to it as they go, so that a user sees all faults of a file at once.

    Attributes
    ----------
    path : of the file; None for tables that were built in Python, which have no places.
    folder : that file names in the tables are relative to.
    data : the tables, as `tomllib` gives them.
    sha256 : hash of the file's bytes.
    places : line and column of every key, counted from 1.
    faults : what has been found wrong so far.
    text : of the file, with LF line ends; "" for tables that were built in Python.
    """

    path: Path | None
    folder: Path
    data: dict[str, Any]
    sha256: str
    places: Mapping[KeyPath, tuple[int, int]]
    faults: list[Fault] = field(default_factory=list)
    text: str = ""

    def place(self, at: KeyPath) -> tuple[int, int]:
        """Line and column of a key; where it is not written down, those of the innermost table around it that is."""
        while at and at not in self.places:
            at = at[:-1]
        return self.places.get(at, (1, 1))

    def fault(self, at: KeyPath, message: str, advice: str = "") -> None:
        """Note one thing that is wrong at a key.

        Parameters
        ----------
        at : path of the key, see `KeyPath`.
        message : what is wrong.
        advice : what to write instead; may be empty.
        """
        self.add(at, (Fault(message, advice=advice),))

    def add(self, at: KeyPath, faults: Iterable[Fault]) -> None:
        """Note faults that were found in the value of a key; they get the key's place in the file.

        Parameters
        ----------
        at : path of the key, see `KeyPath`.
        faults : without a place.
        """
        if self.path is None:
            where = ".".join(str(key) for key in at)
            self.faults.extend(replace(fault, message=f"{where}: {fault.message}" if at else fault.message) for fault in faults)
            return
        line, column = self.place(at)
        self.faults.extend(replace(fault, path=self.path, line=line, column=column) for fault in faults)


def read_toml(path: Path) -> Toml:
    """Read a TOML file with the place of every key.

    Raises
    ------
    InputError
        If it is not there, is no text in UTF-8, or no TOML; with line and column.
    """
    require_shown(path)
    try:
        raw = bytes_of(path, LARGEST, "an experiment or a design")
    except FileNotFoundError:
        raise InputError(Fault(f"file not found: {path.absolute()}", path, advice=names_beside(path))) from None
    except OSError as error:
        raise InputError(Fault(f"cannot be read: {error.strerror or error}", path)) from None
    try:
        text = raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        message = f"is not UTF-8 text, found the byte 0x{raw[error.start]:02x}"
        raise InputError(Fault(message, path, line, column, advice="Save the file as UTF-8")) from None
    if "\0" in text:
        message = "is not UTF-8 text, found a byte of zero, as in UTF-16 or in no text at all"
        raise InputError(Fault(message, path, advice="Save the file as UTF-8"))
    if len(_TABLE.findall(text)) > _MOST_TABLES:
        advice = "Divide it among several files"
        raise InputError(Fault(f"has more than {_MOST_TABLES} tables", path, advice=advice))
    try:
        if _DEEP_KEY.search(text):  # with which Python's parser takes for ever
            raise RecursionError
        data, places = tomllib.loads(text), locate_keys(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(_syntax_fault(path, text, str(error))) from None
    except RecursionError:
        raise InputError(
            Fault("is nested too deeply", path, advice="Look for brackets or braces that are not closed")
        ) from None
    except ValueError as error:  # a number of thousands of digits, a date that there is not
        number = re.search(r"\d{1000}", text)
        if number is None:
            raise InputError(Fault(f"is not valid TOML: {shortened(str(error))}", path)) from None
        line = text.count("\n", 0, number.start()) + 1
        raise InputError(Fault("a number of thousands of digits", path, line, advice=_WITH_EXPONENT)) from None
    toml = Toml(path, path.parent, data, hashlib.sha256(raw).hexdigest(), places, text=text)
    huge = next((at for at, value in _values(data) if isinstance(value, int) and abs(value) > _LARGEST_INTEGER), None)
    if huge is not None:
        line, column = toml.place(huge)
        raise InputError(Fault("a whole number of more than 64 bits", path, line, column, _WITH_EXPONENT))
    return toml


def _values(data: Mapping[str, Any]) -> Iterator[tuple[KeyPath, Any]]:
    """All that stands in tables and arrays, at any depth, with its path."""
    waiting: list[tuple[KeyPath, Any]] = [((), data)]
    while waiting:
        at, value = waiting.pop()
        if isinstance(value, dict):
            waiting += [((*at, key), below) for key, below in value.items()]
        elif isinstance(value, list):
            waiting += [((*at, i), below) for i, below in enumerate(value)]
        else:
            yield at, value


def _syntax_fault(path: Path, text: str, message: str) -> Fault:
    """Turn a TOML syntax error into a fault with its place, found in the text of Python's message, and the usual cause."""
    lines = text.splitlines() or [""]
    match = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    if match is None:
        return Fault(f"is not valid TOML: {message}", path)
    line, column = (int(match[1]), int(match[2])) if match[1] else (len(lines), len(lines[-1]) + 1)
    what = message[: match.start()]
    shown = shortened(lines[line - 1].strip()) if line <= len(lines) else ""
    advice = ""
    if "\\" in shown and '"' in shown:
        advice = 'Write paths with forward slashes: "data/sensor1.csv"'
    elif (what == "Invalid value" and match[1]) or re.search(r"=\s*[-+]?[\d.]+\s*[A-Za-zµμ]", shown):
        advice = 'Texts, file names and quantities stand in quotes: "0.74 mm"'
    elif what.startswith("Cannot overwrite"):
        advice = "A key may be given only once"
    elif what.startswith("Cannot declare"):
        advice = "A table may be given only once; several specimens are each written [[specimens]]"
    elif what.startswith("Illegal character '\\n'"):
        advice = "A text ends on its line, with a quote"
    elif path.suffix.lower() != ".toml":
        advice = "`calib init` writes an experiment file (.toml) from lab files"
    return Fault(f"is not valid TOML: {what}" + (f" in `{shown}`" if shown else ""), path, line, column, advice)
