"""A TOML text and a change of one value in, the text with that change out: comments, order and all else stay as they were."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Item, Table

from calib.errors import Fault, InputError
from calib.experiment import MARK, MEASURED, STANDS, SWEEP_KEYS, KeyPath, locate_keys, quoted_text


def value_at(data: Any, at: KeyPath) -> Any:
    """The value at a path; None where there is none.

    Parameters
    ----------
    data : tables, as `tomllib` gives them.
    at : path of the key.
    """
    for key in at:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def with_value(text: str, at: KeyPath, value: Any) -> str:
    """Put a value at a key, which is made if it is not there; its comment stays.

    Parameters
    ----------
    text : TOML.
    at : path of the key. Tables on the way are made, entries of arrays are not.
    value : texts, numbers, lists, tables; None takes the key out.

    Raises
    ------
    InputError
        If the text is no TOML, or is written so that this cannot be put in without changing something else.
    """
    return _changed(text, at, value)


def with_entry(text: str, at: KeyPath, entry: dict[str, Any]) -> str:
    """Put one more table at the end of an array of tables, which is made if it is not there.

    Parameters
    ----------
    text : TOML.
    at : path of the array.
    entry : texts, numbers, lists, tables.

    Raises
    ------
    InputError
        If the text is no TOML, or is written so that this cannot be put in without changing something else.
    """

    def put(data: Any, made: bool) -> None:
        *way, last = at
        for key in way:
            data = data[key]
        if last not in data:
            data[last] = tomlkit.aot() if made else []
        data[last].append(_table(entry) if made else deepcopy(entry))

    return _remade(text, at, put)


def with_presses(text: str, specimen: int, first: str, entry: dict[str, Any]) -> str:
    """Let a specimen whose own table has the files of its one press have two: [[specimens.sweeps]] of that, and of another.

    Parameters
    ----------
    text : TOML.
    specimen : which, from 0.
    first : name of the press that is there.
    entry : the other one.

    Raises
    ------
    InputError
        As `with_entry`.
    """

    def put(data: Any, made: bool) -> None:
        own = data["specimens"][specimen]
        moved = {key: own.pop(key) for key in SWEEP_KEYS if key in own}
        sweep = tomlkit.table() if made else {}
        sweep["name"] = first
        for key, value in moved.items():
            sweep[key] = value
        own["sweeps"] = tomlkit.aot() if made else []
        own["sweeps"].append(sweep)
        own["sweeps"].append(_table(entry) if made else deepcopy(entry))

    return _remade(text, ("specimens", specimen, "sweeps"), put)


def _table(entry: dict[str, Any]) -> Table:
    made = tomlkit.table()
    for key, value in entry.items():
        made.add(key, _item(value))
    made.add(tomlkit.nl())
    return made


def with_mark(text: str, at: KeyPath, task: str) -> str:
    """Mark the line of a key EDIT, so that nobody takes what stands there for a measurement.

    Parameters
    ----------
    text : TOML.
    at : path of the key.
    task : what is to be put there.
    """
    place = locate_keys(_parsed(text)[1]).get(at)
    if place is None:
        return text
    lines = text.split("\n")
    lines[place[0] - 1] += f"   {MARK} {task}"
    changed = "\n".join(lines)
    return changed if _same(changed, text) else text


def with_note(text: str, at: KeyPath, note: str) -> str:
    """Put a note at the end of the line of a key, in the place of a mark EDIT or of an earlier note on how it is known.

    Parameters
    ----------
    text : TOML.
    at : path of the key.
    note : a comment; "" for none.

    Raises
    ------
    InputError
        If there is no such key, or the line cannot hold it.
    """
    place = locate_keys(_parsed(text)[1]).get(at)
    if place is None:
        raise InputError(_by_hand(at))
    lines = text.split("\n")
    line = lines[place[0] - 1]
    begins = [line.rindex(words) for words in (MARK, MEASURED, STANDS) if words in line]
    kept = line[: min(begins)].rstrip() if begins else line.rstrip()
    lines[place[0] - 1] = f"{kept}   {note}" if note else kept
    changed = "\n".join(lines)
    if not _same(changed, text):
        raise InputError(_by_hand(at))
    return changed


def without_mark(text: str, line: int) -> str:
    """Take the mark EDIT out of a line: what stands there was meant.

    Parameters
    ----------
    text : TOML.
    line : from 1.

    Raises
    ------
    InputError
        If there is no such mark.
    """
    lines = text.split("\n")
    if not 1 <= line <= len(lines) or MARK not in lines[line - 1]:
        raise InputError(Fault(f"line {line} is not marked EDIT any more", advice="Reload the page"))
    lines[line - 1] = lines[line - 1][: lines[line - 1].rindex(MARK)].rstrip()
    changed = "\n".join(lines)
    if not _same(changed, text):
        raise InputError(Fault(f"the mark in line {line} cannot be taken out here", advice="Change it in the text"))
    return changed


def _same(one: str, other: str) -> bool:
    """Whether two texts hold the same values."""
    return _parsed(one)[0] == _parsed(other)[0]


def _parsed(text: str) -> tuple[dict[str, Any], str]:
    try:
        return tomllib.loads(text), text
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(Fault(f"the experiment is not valid TOML: {error}", advice="Mend it in the text first")) from None


def _changed(text: str, at: KeyPath, value: Any) -> str:
    return _remade(text, at, lambda data, made: _put(data, at, value if value is None or not made else _item(value)))


def _remade(text: str, at: KeyPath, put: Callable[[Any, bool], None]) -> str:
    """A text with a change, made in plain tables and in those that keep comments, if both then hold the same."""
    wanted = deepcopy(_parsed(text)[0])
    try:
        put(wanted, False)
        ended = text.endswith("\n")
        document = tomlkit.parse(text if ended else f"{text}\n")  # what is put behind it begins a line
        put(document, True)
        made = tomlkit.dumps(document) if ended else tomlkit.dumps(document).removesuffix("\n")
        right = tomllib.loads(made) == wanted
    except (TOMLKitError, tomllib.TOMLDecodeError, KeyError, IndexError, TypeError, ValueError, AttributeError):
        right, made = False, ""
    if not right:
        raise InputError(_by_hand(at))
    return made


def _item(value: Any) -> Item:
    """A value as one writes it, tables in a line."""
    made: Item = tomlkit.parse(f"value = {_written(value)}\n")["value"]
    made.trivia.trail = "\n"
    return made


def _written(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(key)} = {_written(below)}' for key, below in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_written, value))}]"
    return quoted_text(value) if isinstance(value, str) else str(tomlkit.item(value).as_string())


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else quoted_text(key)


def _put(data: Any, at: KeyPath, value: Any) -> None:
    *way, last = at
    for key in way:
        if isinstance(key, str) and key not in data:
            if value is None:
                return
            data[key] = {} if type(data) is dict else tomlkit.table()
        data = data[key]
    if value is not None:
        old = data.get(last) if isinstance(last, str) else None
        if isinstance(old, Item) and isinstance(value, Item):
            value.trivia.comment, value.trivia.comment_ws = old.trivia.comment, old.trivia.comment_ws
            value.trivia.trail = old.trivia.trail
        data[last] = value
    elif last in data:
        del data[last]


def _by_hand(at: KeyPath) -> Fault:
    where = ".".join(map(str, at))
    return Fault(f"{where} is written in a way that the form cannot change", advice="Change it in the text")
