"""From plain values to the text of a JSON record that says what it is, and back; another kind or version is refused."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

# Keys that say what a record is.
_KIND, _VERSION = "kind", "format"


def record_to_text(kind: str, version: int, content: Mapping[str, Any], *, indent: int | None = 1, exact: bool = False) -> str:
    """Write values as JSON that other programs can read and that says what it is.

    Parameters
    ----------
    kind : what the record is of, such as "recommendation"; its key is "kind".
    version : of its layout, counted up whenever a reader of the earlier one would misread it; its key is "format".
    content : names to numbers, texts, truth values, None, NumPy arrays, and lists, tuples and mappings of them. What is not a
        finite number becomes null, as JSON has no word for it.
    indent : blanks by which each level is moved in; None for one line.
    exact : write NaN and Infinity as such, for records that only this program reads.

    Returns
    -------
    Text that ends in a line feed.

    Raises
    ------
    ValueError
        If the content has one of the two keys itself.
    """
    if taken := {_KIND, _VERSION} & set(content):
        raise ValueError(f"a record says its {' and '.join(sorted(taken))} itself")
    record = {_KIND: kind, _VERSION: version, **content}
    return json.dumps(_plain(record, exact), indent=indent, ensure_ascii=False, allow_nan=exact) + "\n"


def record_from_text(kind: str, version: int, text: str) -> dict[str, Any]:
    """Read the content that `record_to_text` wrote; null stays None.

    Parameters
    ----------
    kind, version : what the record must be.
    text : JSON.

    Raises
    ------
    ValueError
        If the text is not JSON, or a record of another kind or version; the message says which.
    """
    record = json.loads(text)
    if not isinstance(record, dict) or _KIND not in record:
        raise ValueError("it does not say what it is")
    if record[_KIND] != kind:
        raise ValueError(f"it is a {record[_KIND]}, not a {kind}")
    if record.get(_VERSION) != version:
        raise ValueError(f"format {record.get(_VERSION)} is not known, this version reads {version}")
    return {key: value for key, value in record.items() if key not in (_KIND, _VERSION)}


def _plain(value: Any, exact: bool) -> Any:
    """Turn arrays, tuples and mappings into what JSON can hold; nan and infinity become None unless `exact`."""
    if isinstance(value, Mapping):
        return {key: _plain(v, exact) for key, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist(), exact)
    if isinstance(value, list | tuple):
        return [_plain(v, exact) for v in value]
    if isinstance(value, float):
        return value if exact or math.isfinite(value) else None
    return value
