"""From a TOML file to its values with the place of every key, and faults that name file, line and column."""

from __future__ import annotations

import difflib
import hashlib
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from calib.errors import Fault, InputError
from calib.priors.prior import parse_value, sign_fault

#: Where something stands in a TOML document: ("specimens", 0, "priors", "sensor_thickness").
KeyPath = tuple[str | int, ...]


@dataclass(frozen=True)
class Toml:
    """A parsed TOML file, the places of its keys, and the faults found so far (the one thing here that grows)."""

    path: Path
    data: dict[str, Any]
    sha256: str
    places: Mapping[KeyPath, tuple[int, int]]
    faults: list[Fault] = field(default_factory=list)

    def place(self, at: KeyPath) -> tuple[int, int]:
        """Line and column of a key, or of the innermost table around it that is written down, or else the top of the file."""
        while at and at not in self.places:
            at = at[:-1]
        return self.places.get(at, (1, 1))

    def fault(self, at: KeyPath, message: str, advice: str = "") -> None:
        self.add(at, (Fault(message, advice=advice),))

    def add(self, at: KeyPath, faults: Iterable[Fault]) -> None:
        line, column = self.place(at)
        self.faults.extend(replace(fault, path=self.path, line=line, column=column) for fault in faults)


def read_toml(path: Path) -> Toml:
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        tomls = sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
        advice = f"TOML files in that folder: {', '.join(tomls[:12])}" if tomls else ""
        raise InputError(Fault(f"file not found: {path.absolute()}", path, advice=advice)) from None
    except OSError as error:
        raise InputError(Fault(f"cannot be read: {error.strerror or error}", path)) from None
    try:
        text = raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        message = f"is not UTF-8 text, found the byte 0x{raw[error.start]:02x}"
        raise InputError(Fault(message, path, line, column, advice="Save the file as UTF-8")) from None
    try:
        data, places = tomllib.loads(text), locate_keys(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(_syntax_fault(path, text, str(error))) from None
    except RecursionError:
        raise InputError(Fault("is nested too deeply", path)) from None
    return Toml(path, data, hashlib.sha256(raw).hexdigest(), places)


def _syntax_fault(path: Path, text: str, message: str) -> Fault:
    """A TOML syntax error with its place, which Python only tells in the message, and the usual cause."""
    lines = text.splitlines() or [""]
    match = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    if match is None:
        return Fault(f"is not valid TOML: {message}", path)
    line, column = (int(match[1]), int(match[2])) if match[1] else (len(lines), len(lines[-1]) + 1)
    what = message[: match.start()]
    shown = lines[line - 1].strip() if line <= len(lines) else ""
    advice = ""
    if "\\" in shown and '"' in shown:
        advice = 'Write paths with forward slashes: "data/sensor1.csv"'
    elif (what == "Invalid value" and match[1]) or re.search(r"=\s*[-+]?[\d.]+\s*[A-Za-zµμ]", shown):
        advice = 'Texts, file names and quantities stand in quotes: "0.74 mm"'
    elif what.startswith("Cannot overwrite"):
        advice = "A key may be given only once"
    elif what.startswith("Cannot declare"):
        advice = "A table may be given only once; several specimens are each written [[specimens]]"
    return Fault(f"is not valid TOML: {what}" + (f" in `{shown}`" if shown else ""), path, line, column, advice)


def raise_faults(toml: Toml) -> None:
    """All faults at once, in the order of the file."""
    if toml.faults:
        raise InputError(sorted(dict.fromkeys(toml.faults), key=lambda f: (f.line or 0, f.column or 0)))


def get(toml: Toml, at: KeyPath) -> Any:
    value: Any = toml.data
    for key in at:
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            return None
    return value


def table_at(toml: Toml, at: KeyPath) -> dict[str, Any]:
    """The table at `at`; an empty one if there is none (`check_keys` has the fault for what is not a table)."""
    value = get(toml, at)
    return value if isinstance(value, dict) else {}


def tables_at(toml: Toml, at: KeyPath, *, required: str = "") -> list[KeyPath]:
    """Paths of the tables in the array of tables at `at`."""
    value = get(toml, at)
    name = ".".join(str(key) for key in at if isinstance(key, str))
    if isinstance(value, list) and all(isinstance(entry, dict) for entry in value):
        if not value:
            toml.fault(at, f"[[{name}]] is empty", required)
        return [(*at, i) for i in range(len(value))]
    if isinstance(value, dict):
        toml.fault(at, f"[{name}] must be a list of tables", f"Write [[{name}]] in double brackets above each of them")
    elif value is not None:
        toml.fault(at, f"{name} must be a list of tables, got {quoted(value)}", f"Write [[{name}]] above each of them")
    elif required:
        toml.fault((), f"there is no [[{name}]]", required)
    return []


@dataclass(frozen=True)
class Signposts:
    """Where keys belong that stand in the wrong table: `places` by key, `hints` by heading and key."""

    places: Mapping[str, str] = field(default_factory=dict)
    hints: Mapping[tuple[str, str], str] = field(default_factory=dict)


_NO_SIGNPOSTS = Signposts()


def check_keys(toml: Toml, at: KeyPath, known: Sequence[str], signposts: Signposts = _NO_SIGNPOSTS) -> set[str]:
    """Faults for the keys of the table at `at` that are not `known`; returns those known ones that were probably meant."""
    table = toml.data if not at else get(toml, at)
    where = heading(at)
    if table is None:
        return set()
    if not isinstance(table, dict):
        toml.fault(at, f"{where} must be a table, got {quoted(table)}")
        return set()
    meant = set()
    for key in table:
        if key in known:
            continue
        spelled = key.lower().replace("-", "_").replace(" ", "_")
        close = difflib.get_close_matches(spelled, [*known, *signposts.places], n=1)
        advice = f"Known here: {', '.join(known)}"
        if (where, key) in signposts.hints:
            advice = signposts.hints[where, key]
        elif key in signposts.places:
            advice = f"It belongs {signposts.places[key]}"
        elif close and close[0] in known:
            advice = f'Did you mean "{close[0]}"?'
            meant.add(close[0])
        elif close:
            advice = f'Did you mean "{close[0]}"? It belongs {signposts.places[close[0]]}'
        toml.fault((*at, key), f'unknown key "{key}" {"in " + where if at else "at the top of the file"}', advice)
    return meant


def heading(at: KeyPath) -> str:
    """The TOML heading of a table: [specimens.priors], [[specimens.sweeps]]."""
    name = ".".join(str(key) for key in at if isinstance(key, str))
    return f"[[{name}]]" if at and isinstance(at[-1], int) else f"[{name}]"


def quantity_at(toml: Toml, at: KeyPath, parameter: str, *, required: str = "", quiet: bool = False) -> float:
    """The quantity at `at`, SI, its sign checked; nan and a fault if it is wrong, or missing and `required` and not `quiet`."""
    value = get(toml, at)
    if value is None:
        if required and not quiet and isinstance(get(toml, at[:-1]), dict | None):
            toml.fault(at[:-1], f"{parameter} is missing", f"Give {required}")
        return math.nan
    try:
        number = parse_value(parameter, value)
    except InputError as error:
        toml.add(at, error.faults)
        return math.nan
    if fault := sign_fault(parameter, number, str(value)):
        toml.add(at, (fault,))
        return math.nan
    return number


def text_at(toml: Toml, at: KeyPath, *, default: str = "", required: str = "", quiet: bool = False) -> str:
    """The text at `at`; "" and a fault if it is not one, is empty, or is missing and `required` (unless `quiet`)."""
    value = get(toml, at)
    if value is None:
        if required and not quiet:
            toml.fault(at[:-1], f"{at[-1]} is missing in {heading(at[:-1])}", f"Give {required}")
        return default
    if not isinstance(value, str) or not value.strip():
        toml.fault(at, f"{at[-1]} must be a text in quotes, got {quoted(value)}")
        return ""
    return value.strip()


def choice_at(toml: Toml, at: KeyPath, value: object, choices: Sequence[str]) -> str:
    if isinstance(value, str) and value in choices:
        return value
    close = difflib.get_close_matches(str(value).lower(), choices, n=1)
    one_of = " or ".join(f'"{choice}"' for choice in choices)
    toml.fault(at, f"{at[-1]} must be {one_of}, got {quoted(value)}", f'Did you mean "{close[0]}"?' if close else "")
    return choices[0]


def quoted(value: object) -> str:
    """A value as it stands in a TOML file, good enough for a message."""
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return "without a name"
    return f'"{value}"' if isinstance(value, str) else "a table" if isinstance(value, dict) else str(value)


_BLANK = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PLAIN_VALUE = re.compile(r"[^,\]}#\n]+")
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}(?!")'  # multi-line, basic: up to two quotes may stand before the closing three
    r"|'''.*?'{3,5}(?!')"  # multi-line, literal
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)


def locate_keys(text: str) -> dict[KeyPath, tuple[int, int]]:
    """Line and column (from 1) of every key, table header and array entry of a valid TOML text with LF line ends.

    Entries of arrays are addressed by their index, those of an array of tables by the place of their header.

    >>> locate_keys('[[specimens]]\\nname = "a"\\n  [specimens.priors]\\n  x.y = 1')[("specimens", 0, "priors", "x", "y")]
    (4, 5)
    """
    places: dict[KeyPath, tuple[int, int]] = {}
    counts: dict[KeyPath, int] = {}

    def place(index: int) -> tuple[int, int]:
        return text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index)

    def mark(path: KeyPath, index: int) -> None:
        places.setdefault(path, place(index))

    def table(path: KeyPath) -> KeyPath:
        # A path through an array of tables means the table begun last.
        return (*path, counts[path] - 1) if path in counts else path

    def keys(index: int, path: KeyPath, resolve: Callable[[KeyPath], KeyPath]) -> tuple[int, KeyPath]:
        """A dotted key below `path`; returns the index behind it and the path, of which all but the last key is resolved."""
        while True:
            index = _end(_SPACE, text, index)
            end = _end(_BARE_KEY if text[index] not in "\"'" else _STRING, text, index)
            raw = text[index:end]
            path = (*path, tomllib.loads(f"k = {raw}")["k"] if raw[0] in "\"'" else raw)
            mark(path, index)
            index = _end(_SPACE, text, end)
            if text[index] != ".":
                return index, path
            path, index = resolve(path), index + 1

    def pair(index: int, path: KeyPath) -> int:
        index, path = keys(index, path, lambda below: below)
        return value(_end(_SPACE, text, index + 1), path)  # + 1: the equals sign

    def value(index: int, path: KeyPath) -> int:
        if text[index] in "\"'":
            return _end(_STRING, text, index)
        if text[index] == "[":
            return series(index, "]", lambda at, n: mark_value(at, (*path, n)))
        if text[index] == "{":
            return series(index, "}", lambda at, _: pair(at, path))
        return _end(_PLAIN_VALUE, text, index)

    def mark_value(index: int, path: KeyPath) -> int:
        mark(path, index)
        return value(index, path)

    def series(index: int, close: str, entry: Callable[[int, int], int]) -> int:
        index, number = _end(_BLANK, text, index + 1), 0
        while text[index] != close:
            index, number = _end(_BLANK, text, entry(index, number)), number + 1
            if text[index] == ",":
                index = _end(_BLANK, text, index + 1)
        return index + 1

    here: KeyPath = ()
    index = _end(_BLANK, text, 0)
    while index < len(text):
        if text.startswith("[[", index):
            start = index
            index, here = keys(index + 2, (), table)
            counts[here] = counts.get(here, 0) + 1
            here = table(here)
            places[here] = place(start)
            index += 2
        elif text[index] == "[":
            start = index
            index, here = keys(index + 1, (), table)
            places[here] = place(start)
            index += 1
        else:
            index = pair(index, here)
        index = _end(_BLANK, text, index)
    return places


def _end(pattern: re.Pattern[str], text: str, index: int) -> int:
    match = pattern.match(text, index)
    if match is None:  # cannot be in a text that tomllib has read
        raise ValueError(f"cannot find the keys of the TOML text behind character {index}")
    return match.end()
