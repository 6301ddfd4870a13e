"""JSON of any layout: a file in, its lists of objects, columns and channels as parts out."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.arrays import Around, ArrayColumn, Source, Values, array_part
from calib.lab.instruments.clock_cells import is_clock, is_date
from calib.lab.instruments.forms import is_of_one_form
from calib.lab.instruments.json_lines import cell_text, flat, is_cell
from calib.lab.instruments.part import Format, Part
from calib.lab.instruments.said_inside import is_few, is_unit_key, name_in, sayings, unit_in, units_in, without_units
from calib.lab.instruments.vocabulary import understand

_BEGINNING = re.compile(rb"^\s*[{\[]\s*(?:[{\[]|\"[^\"]*\"\s*:|[}\]])")
_BOM = b"\xef\xbb\xbf"
# First bytes of a file that are given to a format.
_HEAD = 4096
# Objects in each other: no lab's file has more.
_DEEPEST = 12
# A table by row numbers: objects of objects, `{"t_s": {"0": 0.0, "1": 0.1}}`.
_ROW_NUMBER = re.compile(r"\d+")
# Elements of a list by which it is told how long the lists within it are.
_LOOKED_AT = 50
# What a text begins with that holds a number: "0.0023 N", "'0.5".
_BEGINS = re.compile(r"\s*['’]?[-+\u2212(]?\d*[.,]?\d")


def recognise(head: bytes, path: Path) -> bool:
    """Recognise how JSON begins, whatever the ending, but for lines that are read as text: of one form, or above a table.

    Parameters
    ----------
    head : its first bytes.
    path : the file.
    """
    bare = head.removeprefix(_BOM)
    return _BEGINNING.search(bare) is not None and not _is_of_lines(bare)


def _is_of_lines(head: bytes) -> bool:
    """Whether a file that begins like JSON is a text of lines: objects, rows of one form, or a table below settings."""
    text = head.decode("utf-8", errors="replace").lstrip()
    behind, n_value = text, 0
    while behind[:1] in ("{", "["):
        try:
            _, end = json.JSONDecoder().raw_decode(behind)
        except (ValueError, RecursionError):
            break
        if not behind[end:].lstrip(" \t").startswith(("\n", "\r")):
            return n_value > 0
        behind, n_value = behind[end:].strip(), n_value + 1
    if n_value:
        return n_value > 1 or bool(behind)
    lines = [line for line in text.splitlines()[: -1 if len(head) == _HEAD else None] if line.strip()]
    return is_of_one_form(lines) and not lines[0].rstrip().endswith(("{", "[", "{}", "[]")) and _fails_early(text)


def _fails_early(text: str) -> bool:
    """Whether a text is no JSON from a place on that is not its end."""
    try:
        json.loads(text)
    except ValueError as error:
        return getattr(error, "pos", 0) < len(text) - 1 and '"' not in text[: getattr(error, "pos", 0)]
    except RecursionError:
        return False
    return False


def take_apart(path: Path) -> tuple[Part, ...]:
    """Read a document of JSON as tables.

    Lists of objects are tables whose columns are the keys, in the order in which they first stand; an object without one of
    them has an empty cell there. Lists of equal length in one object are columns, a list of objects with a list in each are
    channels, and lists of lists are rows, named by a list of as many words beside them. Texts and single numbers beside a table
    are lines above it.

    Raises
    ------
    InputError
        If the file is no JSON, with the place.
    """
    data = path.read_bytes()
    try:
        text = data.removeprefix(_BOM).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(Fault("the file begins like JSON and is no UTF-8", path, advice="Write it again as UTF-8")) from None
    where = Source(path, hashlib.sha256(data).hexdigest(), "JSON", "table", "")
    document = _document(path, text)
    parts = tuple(_parts("", document, Around(where, {}, (), _longest(document, 0)), 0))
    return parts or (Part("table", "document", None, "it holds no lists of readings"),)


def _document(path: Path, text: str) -> Any:
    """What a text of JSON holds."""
    try:
        return json.loads(text)
    except RecursionError:
        raise InputError(Fault("lists stand in each other by the hundred", path, advice="Write it as a table")) from None
    except json.JSONDecodeError as error:
        message = f"the file is no JSON from here on: {error.msg}"
        advice = "Export it again, if it is cut off, or mend the line"
        raise InputError(Fault(message, path, error.lineno, error.colno, advice)) from None


def _longest(value: Any, depth: int) -> int:
    """How long the longest list is, or block of row numbers, of those that may hold readings."""
    if depth > _DEEPEST or not isinstance(value, (list, dict)):
        return 0
    inner = value.values() if isinstance(value, dict) else value[:_LOOKED_AT]
    of_words = isinstance(value, list) and all(isinstance(one, str) for one in inner)
    own = len(value) if not of_words and (isinstance(value, list) or all(map(_ROW_NUMBER.fullmatch, value))) else 0
    return max(own, max((_longest(one, depth + 1) for one in inner if isinstance(one, (list, dict))), default=0))


def _holds_readings(value: Any, longest: int, depth: int = 0) -> bool:
    """Whether a value is a list or a block that may be readings, or holds one; a few values beside long lists are a setting."""
    if depth > _DEEPEST or not isinstance(value, (list, dict)) or not value:
        return depth > _DEEPEST
    inner = [one for one in (value.values() if isinstance(value, dict) else value) if isinstance(one, (list, dict))]
    if len(value) > 1 and not is_few(len(value), longest):
        of_rows = all(map(_ROW_NUMBER.fullmatch, value)) if isinstance(value, dict) else bool(inner) or _is_column(value)
        if of_rows:
            return True
    return any(_holds_readings(one, longest, depth + 1) for one in inner)


def _parts(name: str, value: Any, around: Around, depth: int) -> Iterator[Part]:
    """The tables that a value holds, under the name of its keys."""
    own = around.named(name or "document")
    if depth > _DEEPEST:
        yield Part("table", own.name, None, "objects stand in each other too often")
    elif isinstance(value, list):
        columns = _of_list(value, around)
        if columns is not None:
            yield array_part(own, columns, above=around.above, named=columns[0].name != "")
        else:
            inside = [_holds_readings(one, around.longest) for one in value]
            beside = [one for one, holds in zip(value, inside, strict=True) if not holds]
            around = replace(around, above=(*around.above, *sayings(beside, (name,) if name else ())))
            for k, one in enumerate(value, 1):
                if inside[k - 1]:
                    yield from _parts(f"{name}({k})", one, around, depth + 1)
    elif isinstance(value, dict):
        yield from _of_object(name, value, around, depth)


def _of_object(name: str, value: Mapping[str, Any], around: Around, depth: int) -> Iterator[Part]:
    own, longest = around.named(name or "document"), around.longest
    by_number, named = _of_row_numbers(value), _named_rows(value, around)
    signals = {k: signal for k, v in value.items() if (signal := _signal(v, k, longest)) is not None}
    lists = {k: v for k, v in value.items() if _is_column(v) and not is_few(len(v), longest)}
    # Words in as many rows as there are readings are a column, as of stages.
    sizes = {len(v) for v in lists.values()}
    lists = {
        k: v for k, v in value.items() if k in lists or (_are_cells(v) and len(v) in sizes and not is_few(len(v), longest))
    }
    of_rows = by_number is not None and not by_number.keys() <= value.keys()  # its keys are the numbers of rows
    read = {*signals, *lists, *(value if of_rows else by_number or ()), *(named.used if named is not None else ())}
    others = {k: v for k, v in value.items() if k not in read}
    inside = {k: v for k, v in others.items() if _holds_readings(v, longest)}
    # The schema of pandas says of its columns what these are themselves.
    beside = {
        k: v for k, v in others.items() if k not in inside and not (k == "schema" and isinstance(v, dict) and "fields" in v)
    }
    units = {**around.units, **units_in(beside)}
    names = {*read, *chain(*map(_names, inside.values()))}
    around = replace(around, units=units, above=(*around.above, *sayings(without_units(beside, names))))
    if by_number is not None:
        columns = [ArrayColumn(k, units.get(k, ""), _values(v)) for k, v in by_number.items()]
        yield array_part(own, columns, above=around.above)
    elif named is not None:
        columns = [replace(column, unit=column.unit or units.get(column.name, "")) for column in named.columns]
        yield array_part(own, columns, above=around.above)
    else:
        found = [
            signals[k] if k in signals else ArrayColumn(k, units.get(k, ""), _values(lists[k]))
            for k in value
            if k in signals or k in lists
        ]
        of_sizes = dict.fromkeys(len(column.values) for column in found)
        for size in of_sizes:
            title = own.name if len(of_sizes) == 1 else f"{own.name}, {size} rows"
            columns = [column for column in found if len(column.values) == size]
            yield array_part(around.named(title), columns, above=around.above)
    for key, one in inside.items():
        yield from _parts(f"{name}.{key}" if name else key, one, around, depth + 1)


def _names(value: Any) -> Iterator[str]:
    """The names that may be those of columns in a value that holds readings."""
    first = value[0] if isinstance(value, list) and value else value
    if isinstance(first, dict):
        yield from first
        yield from chain(*(_names(one) for one in first.values() if isinstance(one, dict)))


# --- from lists and objects to columns ----------------------------------------------------------------------------------


def _of_list(value: Sequence[Any], around: Around) -> list[ArrayColumn] | None:
    """The columns of a list of objects with a value under each key, of channels, or of rows; None of any other."""
    if not value or len(value) < 2:
        return None
    if all(isinstance(one, dict) for one in value):
        channels = [_signal(one, "", around.longest) for one in value]
        if all(channel is not None and channel.name for channel in channels):
            return [channel for channel in channels if channel is not None]
        rows, said = zip(*(flat(one) for one in value), strict=True)
        if not all(is_cell(cell) for row in rows for cell in row.values()):
            return None
        own = dict(chain.from_iterable(units_of.items() for units_of in said))
        if any(own[key] != unit for units_of in said for key, unit in units_of.items()):
            return None
        names = list(dict.fromkeys(chain.from_iterable(rows)))
        return [ArrayColumn(k, own.get(k) or around.units.get(k, ""), _values([row.get(k) for row in rows])) for k in names]
    return _of_rows(value, None, around.units)


def _of_rows(value: Sequence[Any], names: Sequence[str] | None, units: Mapping[str, str]) -> list[ArrayColumn] | None:
    if not all(isinstance(row, list) and row and all(map(is_cell, row)) for row in value):
        return None
    if names is None and all(isinstance(cell, str) for cell in value[0]) and len(value) > 2:
        names, value = value[0], value[1:]
    width = len(names) if names is not None else len(value[0])
    if any(len(row) != width for row in value):
        return None
    called = names if names is not None else [""] * width
    columns = zip(*value, strict=True)
    return [ArrayColumn(n, units.get(n, ""), _values(column)) for n, column in zip(called, columns, strict=True)]


@dataclass(frozen=True, eq=False)
class _Named:
    """Columns of rows that are named beside them, and the keys of the rows, their names and their units."""

    columns: list[ArrayColumn]
    used: tuple[str, ...]


def _named_rows(value: Mapping[str, Any], around: Around) -> _Named | None:
    """The columns of rows that stand beside the one list of as many words, or of as many named blocks; None without one."""
    rows = {k: v for k, v in value.items() if isinstance(v, list) and len(v) > 1 and all(isinstance(row, list) for row in v)}
    if len(rows) != 1:
        return None
    ((key, own_rows),) = rows.items()
    words = {k: v for k, v in value.items() if isinstance(v, list) and v and all(isinstance(w, str) for w in v)}
    fitting = {k: names for k, names in words.items() if len(names) == len(own_rows[0])}
    of_units = {k: v for k, v in fitting.items() if is_unit_key(k)}
    names = {k: v for k, v in fitting.items() if k not in of_units}
    blocks = {
        k: v for k, v in value.items() if k != key and isinstance(v, list) and len(v) == len(own_rows[0]) and k not in words
    }
    described = {k: [name_in(one)[0] if isinstance(one, dict) else "" for one in v] for k, v in blocks.items()}
    names = names or {k: v for k, v in described.items() if all(v)}
    if len(names) != 1:
        return None
    ((name_key, called),) = names.items()
    own = dict(zip(called, next(iter(of_units.values())), strict=True)) if of_units else {}
    columns = _of_rows(own_rows, called, {**around.units, **own})
    used = (key, *of_units, *(() if name_key in described else (name_key,)))  # blocks say more than names
    return None if columns is None else _Named(columns, used)


def _of_row_numbers(value: Mapping[str, Any]) -> dict[str, list[Any]] | None:
    """The columns of objects whose keys, or those of the objects in them, count the rows; None of any other."""
    if all(map(_ROW_NUMBER.fullmatch, value)):
        inner = [v for v in value.values() if isinstance(v, dict)]
        if len(inner) < 2 or len(inner) < len(value) or not all(is_cell(cell) for row in inner for cell in row.values()):
            return None
        return {name: [row.get(name) for row in inner] for name in dict.fromkeys(chain.from_iterable(inner))}
    columns = {k: v for k, v in value.items() if isinstance(v, dict) and v and all(map(_ROW_NUMBER.fullmatch, v))}
    first = next(iter(columns.values()), {})
    whole = all(column.keys() == first.keys() and all(map(is_cell, column.values())) for column in columns.values())
    return {name: list(column.values()) for name, column in columns.items()} if whole and len(columns) > 1 else None


def _signal(value: Any, key: str, longest: int) -> ArrayColumn | None:
    """An object of one list, with its unit or its name beside it, as a column; None if it is another."""
    if not isinstance(value, dict):
        return None
    lists = [k for k, v in value.items() if _is_column(v) and not is_few(len(v), longest)]
    if len(lists) != 1:
        return None
    unit, differing, others = unit_in({k: v for k, v in value.items() if k not in lists})
    has_unit = len(others) < len(value) - 1
    name, rest = name_in(others)
    if key and (understand(key) is not None or understand(name) is None):
        name, rest = key, others if has_unit else rest
    if not (has_unit or len(rest) < len(others)) or any(_holds_readings(v, longest) for v in others.values()):
        return None
    return ArrayColumn(name, unit, _values(value[lists[0]]), tuple(sayings(rest)), differing)


def _are_cells(value: Any) -> bool:
    return isinstance(value, list) and len(value) > 1 and all(map(is_cell, value))


def _is_column(value: Any) -> bool:
    if not _are_cells(value):
        return False
    return not all(isinstance(v, str) and not is_clock(v) and not is_date(v) and not _BEGINS.match(v) for v in value)


def _values(cells: Sequence[Any]) -> Values:
    """Cells of a column as text, as JSON writes them; what is not there is empty."""
    return np.array([cell_text(cell) for cell in cells], dtype=object)


FORMAT = Format("JSON", recognise, take_apart)
