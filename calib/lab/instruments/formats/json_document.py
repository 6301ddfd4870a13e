"""JSON of any layout: a file in, its lists of objects, columns and channels as parts out."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.arrays import ArrayColumn, Source, Values, array_part
from calib.lab.instruments.clock_cells import is_clock, is_date
from calib.lab.instruments.forms import is_of_one_form
from calib.lab.instruments.json_lines import UNIT, cell_text, flat, is_cell
from calib.lab.instruments.part import Format, Part

_BEGINNING = re.compile(rb"^\s*[{\[]\s*(?:[{\[]|\"[^\"]*\"\s*:|[}\]])")
_BOM = b"\xef\xbb\xbf"
# First bytes of a file that are given to a format.
_HEAD = 4096
# Objects in each other: no lab's file has more.
_DEEPEST = 12
# What an object calls the name of its one column.
_NAME = ("name", "label", "title", "channel", "signal", "bezeichnung", "key", "id")
_SHOWN = 200
# A table by row numbers: objects of objects, `{"t_s": {"0": 0.0, "1": 0.1}}`.
_ROW_NUMBER = re.compile(r"\d+")
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
    return tuple(_parts("", _document(path, text), where, 0, {}))


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


def _parts(name: str, value: Any, where: Source, depth: int, units: Mapping[str, str]) -> Iterator[Part]:
    """The tables that a value holds, under the name of its keys; units are those that stand beside, or above."""
    own = replace(where, name=name or "document")
    if depth > _DEEPEST:
        yield Part("table", own.name, None, "objects stand in each other too often")
    elif isinstance(value, list):
        columns = _of_list(value, units)
        if columns is not None:
            yield array_part(own, columns, named=columns[0].name != "")
        else:
            for k, one in enumerate(value, 1):
                if isinstance(one, (dict, list)):
                    yield from _parts(f"{name}({k})", one, where, depth + 1, units)
    elif isinstance(value, dict):
        beside: Mapping[str, str] = next((v for k, v in value.items() if k.lower() in UNIT and _is_texts(v)), {})
        yield from _of_object(name, value, where, depth, {**units, **beside})


def _of_object(name: str, value: Mapping[str, Any], where: Source, depth: int, units: Mapping[str, str]) -> Iterator[Part]:
    own = replace(where, name=name or "document")
    above = [f"{k}\t{' '.join(str(v).split())[:_SHOWN]}".replace('"', "'") for k, v in value.items() if is_cell(v)]
    by_number = _of_row_numbers(value)
    named = _named_rows(value, units)
    signals = {k: signal for k, v in value.items() if (signal := _signal(v, k)) is not None}
    if by_number is not None:
        yield array_part(own, [ArrayColumn(k, units.get(k, ""), _values(v)) for k, v in by_number.items()])
        return
    if named is not None:
        yield array_part(own, named, above=above)
        return
    lists = {k: ArrayColumn(k, units.get(k, ""), _values(v)) for k, v in value.items() if _is_column(v)} | signals
    for size in dict.fromkeys(len(column.values) for column in lists.values()):
        columns = [column for column in lists.values() if len(column.values) == size]
        title = own.name if len({len(c.values) for c in lists.values()}) == 1 else f"{own.name}, {size} rows"
        yield array_part(replace(where, name=title), columns, above=above)
    for key, one in value.items():
        if key not in lists and isinstance(one, (dict, list)) and not (key.lower() in UNIT and _is_texts(one)):
            for part in _parts(f"{name}.{key}" if name else key, one, where, depth + 1, units):
                yield part if lists or part.text is None or not above else _with_above(part, above)


def _with_above(part: Part, above: Sequence[str]) -> Part:
    """The same with lines of the object around it above its own."""
    assert part.text is not None
    units_line = part.text.units_line + len(above) if part.text.units_line else 0
    text = replace(part.text, lines=(*above, *part.text.lines), units_line=units_line)
    return replace(part, text=text, above=part.above + len(above))


# --- from lists and objects to columns ----------------------------------------------------------------------------------


def _of_list(value: Sequence[Any], units: Mapping[str, str]) -> list[ArrayColumn] | None:
    """The columns of a list of objects with a value under each key, of channels, or of rows; None of any other."""
    if not value or len(value) < 2:
        return None
    if all(isinstance(one, dict) for one in value):
        channels = [_signal(one, "") for one in value]
        if all(channel is not None and channel.name for channel in channels):
            return [channel for channel in channels if channel is not None]
        rows, said = zip(*(flat(one) for one in value), strict=True)
        if not all(is_cell(cell) for row in rows for cell in row.values()):
            return None
        own = dict(chain.from_iterable(units_of.items() for units_of in said))
        if any(own[key] != unit for units_of in said for key, unit in units_of.items()):
            return None
        names = list(dict.fromkeys(chain.from_iterable(rows)))
        return [ArrayColumn(k, own.get(k) or units.get(k, ""), _values([row.get(k) for row in rows])) for k in names]
    return _of_rows(value, None, units)


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


def _named_rows(value: Mapping[str, Any], units: Mapping[str, str]) -> list[ArrayColumn] | None:
    """The columns of rows that stand beside the one list of as many words; None where there are none."""
    rows = [v for v in value.values() if isinstance(v, list) and len(v) > 1 and all(isinstance(row, list) for row in v)]
    if len(rows) != 1:
        return None
    words = [v for v in value.values() if isinstance(v, list) and v and all(isinstance(w, str) for w in v)]
    fitting = [names for names in words if len(names) == len(rows[0][0])]
    of_units = [v for k, v in value.items() if k.lower() in UNIT and v in fitting]
    names = [names for names in fitting if names not in of_units]
    if len(names) != 1:
        return None
    own = dict(zip(names[0], of_units[0], strict=True)) if of_units else {}
    return _of_rows(rows[0], names[0], {**units, **own})


def _of_row_numbers(value: Mapping[str, Any]) -> dict[str, list[Any]] | None:
    """The columns of objects whose keys, or those of the objects in them, count the rows; None of any other."""
    inner = [v for v in value.values() if isinstance(v, dict)]
    if len(inner) < 2 or len(inner) < len(value) or not all(is_cell(cell) for row in inner for cell in row.values()):
        return None
    if all(map(_ROW_NUMBER.fullmatch, value)):
        return {name: [row.get(name) for row in inner] for name in dict.fromkeys(chain.from_iterable(inner))}
    if all(column.keys() == inner[0].keys() and all(map(_ROW_NUMBER.fullmatch, column)) for column in inner) and inner[0]:
        return {name: list(column.values()) for name, column in value.items()}
    return None


def _signal(value: Any, key: str) -> ArrayColumn | None:
    """An object of one list, with its unit or its name beside it, as a column; None if it is another."""
    if not isinstance(value, dict):
        return None
    lists = [v for v in value.values() if _is_column(v)]
    others = {k.lower(): v for k, v in value.items() if isinstance(v, str)}
    names = [v for k, v in others.items() if k in _NAME]
    units = [v for k, v in others.items() if k in UNIT]
    if len(lists) != 1 or len(units) > 1 or not (units or names) or any(isinstance(v, dict) for v in value.values()):
        return None
    return ArrayColumn(key or "".join(names[:1]), units[0] if units else "", _values(lists[0]))


def _is_texts(value: Any) -> bool:
    return isinstance(value, dict) and bool(value) and all(isinstance(v, str) for v in value.values())


def _is_column(value: Any) -> bool:
    if not isinstance(value, list) or len(value) < 2 or not all(map(is_cell, value)):
        return False
    return not all(isinstance(v, str) and not is_clock(v) and not is_date(v) and not _BEGINS.match(v) for v in value)


def _values(cells: Sequence[Any]) -> Values:
    """Cells of a column as text, as JSON writes them; what is not there is empty."""
    return np.array([cell_text(cell) for cell in cells], dtype=object)


FORMAT = Format("JSON", recognise, take_apart)
