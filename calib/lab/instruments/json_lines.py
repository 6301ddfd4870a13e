"""From lines that are each an object of JSON to a `Sheet` by their keys, whatever their order and whether some are missing."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from itertools import chain, islice
from typing import Any

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.lines import not_read
from calib.lab.instruments.said_inside import is_unit_key, sayings
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText

# What an object calls its value.
_VALUE = re.compile(
    r"v|val|values?|readings?|data|measurements?|measured|state|wert|messwert|valeur|valor|valore", re.IGNORECASE
)
# Lines that show the form of a file; the share of them, and of all lines, that are objects.
_FEWEST, _NEARLY_ALL = 5, 0.8


def json_lines(text: LabText) -> Sheet | None:
    """Cut a file of an object a line into a sheet with a column for each key, in the order in which they first stand.

    An object without one of the keys has an empty cell there. Objects that share none of their numbers' keys with most of the
    others are named as not read.

    Parameters
    ----------
    text : the file.

    Returns
    -------
    The record; None of a file of any other kind.

    Raises
    ------
    InputError
        If a line among the objects is none.
    """
    first = list(islice((line for line in text.lines if line.strip()), _FEWEST))
    if len(first) < _FEWEST or sum(flat_object(line) is not None for line in first) < _NEARLY_ALL * _FEWEST:
        return None
    written = [(number, line) for number, line in enumerate(text.lines, 1) if line.strip()]
    found = {number: flat for number, line in written if line.lstrip().startswith("{") and (flat := flat_object(line))}
    if len(found) < _NEARLY_ALL * len(written):
        return None
    cut_short = not text.ended and written[-1][0] not in found
    last = max(found)
    for number, line in written:
        if number not in found and line.lstrip().startswith("{") and not (cut_short and number == written[-1][0]):
            message = f'"{line.strip()[:60]}" is no object of JSON, as the other lines are'
            raise InputError(Fault(message, text.path, number, 1, "Mend the line, or take it out of the file"))
    common = Counter(key for cells, _ in found.values() for key, value in cells.items() if _is_number(value))
    usual = {key for key, n in common.items() if 2 * n > len(found)}
    rows = {number: flat for number, flat in found.items() if any(_is_number(flat[0].get(key)) for key in usual)}
    if len(rows) < _FEWEST:
        return None
    names = list(dict.fromkeys(chain.from_iterable(cells for cells, _ in rows.values())))
    units: dict[str, str] = {}
    for number, (_, said) in rows.items():
        for key, unit in said.items():
            if units.setdefault(key, unit) != unit:
                message = f'"{key}" is in {unit}, and in {units[key]} before'
                raise InputError(Fault(message, text.path, number, 1, "Write all lines in one unit"))
    sheet = Sheet(
        text,
        "\t",
        0,
        tuple(names),
        units=tuple(units.get(name, "") for name in names) if units else (),
        declared_decimal=".",
        columns=tuple([cell_text(cells.get(name)) for cells, _ in rows.values()] for name in names),
        lines=np.array([*rows], dtype=np.int64),
    )
    others = [number - 1 for number, _ in written if number not in rows]
    beside = tuple((i + 1, said.line) for i in others if (own := _loaded(text.lines[i])) for said in sayings(own))
    note = f"each line is an object of JSON, from line {min(rows)} on; the columns are its keys: {', '.join(names)}"
    why = "cut off" if cut_short and others == [written[-1][0] - 1] and written[-1][0] > last else "no object with a reading"
    return replace(sheet, notes=(note,), unread=tuple(not_read(sheet, others, why)), beside=beside)


def _loaded(line: str) -> Any:
    """What a line of JSON holds, None if it is none."""
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def flat_object(line: str) -> tuple[dict[str, Any], dict[str, str]] | None:
    """Take an object of JSON apart that holds single values, also within objects in it.

    Parameters
    ----------
    line : of text.

    Returns
    -------
    The values by their keys, those of an object in it as "force.peak", and the units of those that have one beside them; None
    of anything else.

    >>> flat_object('{"t": 0.1, "force": {"value": 1.5, "unit": "N"}}')
    ({'t': 0.1, 'force': 1.5}, {'force': 'N'})
    """
    value = _loaded(line)
    if not isinstance(value, dict) or not value:
        return None
    cells, units = flat(value)
    return (cells, units) if all(map(is_cell, cells.values())) else None


def flat(value: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Lay out an object with the objects in it.

    Parameters
    ----------
    value : the object.

    Returns
    -------
    The same without objects in it, and units of keys that have one.
    """
    cells: dict[str, Any] = {}
    units: dict[str, str] = {}
    for key, one in value.items():
        if not isinstance(one, dict):
            cells[key] = one
            continue
        inner, inner_units = flat(one)
        said = [k for k, v in inner.items() if is_unit_key(k) and isinstance(v, str)]
        others = [k for k in inner if k not in said]
        if len(said) == 1 and len(others) == 1:
            name = key if _VALUE.fullmatch(others[0]) else f"{key}.{others[0]}"
            cells[name], units[name] = inner[others[0]], inner[said[0]]
            continue
        cells |= {f"{key}.{k}": v for k, v in inner.items()}
        units |= {f"{key}.{k}": v for k, v in inner_units.items()}
    return cells, units


def is_cell(value: Any) -> bool:
    """Tell whether a value of JSON is a single one.

    Parameters
    ----------
    value : of JSON.
    """
    return value is None or isinstance(value, (str, int, float))


def cell_text(value: Any) -> str:
    """Write a single value as the text of a cell; what is not there is empty.

    Parameters
    ----------
    value : of JSON.
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return str(int(value)) if isinstance(value, bool) else value if isinstance(value, str) else repr(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
