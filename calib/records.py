"""From plain values to a JSON record that says what it is, with its checksum, and back; a changed or another one is refused."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

# Keys that say what a record is, and the SHA-256 of all the others.
_KIND, _VERSION, _DIGEST = "kind", "format", "checksum"
_OWN = (_KIND, _VERSION, _DIGEST)


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
    Text that ends in a line feed. Its last key, "checksum", is a SHA-256 of the values of all others.

    Raises
    ------
    ValueError
        If the content has one of the three keys itself.
    """
    if taken := set(_OWN) & set(content):
        raise ValueError(f"a record says its {' and '.join(sorted(taken))} itself")
    record = _plain({_KIND: kind, _VERSION: version, **content}, exact)
    # As a reader will find it: names that are numbers become texts.
    record[_DIGEST] = _digest(json.loads(json.dumps(record)))
    return json.dumps(record, indent=indent, ensure_ascii=False, allow_nan=exact) + "\n"


def record_from_text(kind: str, version: int, text: str) -> dict[str, Any]:
    """Read the content that `record_to_text` wrote; null stays None.

    Parameters
    ----------
    kind, version : what the record must be.
    text : JSON.

    Raises
    ------
    ValueError
        If the text is not JSON, a record of another kind or version, or not as it was written; the message says which.
    """
    try:
        record = json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply to be read") from None
    if not isinstance(record, dict) or _KIND not in record:
        raise ValueError("it does not say what it is")
    if record[_KIND] != kind:
        raise ValueError(f"it is a {record[_KIND]}, not a {kind}")
    if record.get(_VERSION) != version:
        raise ValueError(f"format {record.get(_VERSION)} is not known, this version reads {version}")
    if _DIGEST not in record:
        raise ValueError("it has no checksum: it was changed, or an older version wrote it")
    if record.pop(_DIGEST) != _digest(record):
        raise ValueError("its checksum is not that of its content: it is damaged, or was changed since it was written")
    return {key: value for key, value in record.items() if key not in _OWN}


def exact_record_from_text(kind: str, version: int, text: str) -> dict[str, Any]:
    """Read a record as `record_from_text` does, if its text is to the last byte what `record_to_text` wrote.

    Parameters
    ----------
    kind, version : what the record must be.
    text : JSON.

    Raises
    ------
    ValueError
        As `record_from_text`, and if a blank, or the way a number is written, is another.
    """
    content = record_from_text(kind, version, text)
    if record_to_text(kind, version, content) != text:
        raise ValueError("it is not as it was written: blanks or the way numbers are written have changed")
    return content


def _digest(record: Mapping[str, Any]) -> str:
    """SHA-256 of values, whatever the order of their names and the blanks between them in a text."""
    text = json.dumps(record, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


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
