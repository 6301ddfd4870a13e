"""From a TOML text to the places of its keys and its comments, which Python's own parser does not give."""

from __future__ import annotations

import re
import tomllib
from bisect import bisect
from collections.abc import Callable

#: Where something stands in a TOML document: ("specimens", 0, "priors", "sensor_thickness").
KeyPath = tuple[str | int, ...]

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
_STRING_OR_COMMENT = re.compile(rf"{_STRING.pattern}|#[^\n]*", re.DOTALL)


def locate_keys(text: str) -> dict[KeyPath, tuple[int, int]]:
    """Find line and column (from 1) of every key, table header and array entry of a valid TOML text with LF line ends.

    Entries of arrays are addressed by their index, those of an array of tables by the place of their header.

    >>> locate_keys('[[specimens]]\\nname = "a"\\n  [specimens.priors]\\n  x.y = 1')[("specimens", 0, "priors", "x", "y")]
    (4, 5)
    """
    places: dict[KeyPath, tuple[int, int]] = {}
    counts: dict[KeyPath, int] = {}

    ends = [match.start() for match in re.finditer("\n", text)]

    def place(index: int) -> tuple[int, int]:
        return bisect(ends, index - 1) + 1, index - text.rfind("\n", 0, index)

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


def comments_in(text: str) -> list[tuple[int, str]]:
    """Find the comments of a valid TOML text with LF line ends: the line of each, from 1, and its text from the # on.

    >>> comments_in('a = "# none"  # one\\n# two')
    [(1, '# one'), (2, '# two')]
    """
    found = (match for match in _STRING_OR_COMMENT.finditer(text) if match[0].startswith("#"))
    return [(text.count("\n", 0, match.start()) + 1, match[0]) for match in found]


def _end(pattern: re.Pattern[str], text: str, index: int) -> int:
    match = pattern.match(text, index)
    if match is None:  # cannot be in a text that tomllib has read
        raise ValueError(f"cannot find the keys of the TOML text behind character {index}")
    return match.end()
