"""From the bytes of a MATLAB file of version 5 (of 6 and 7, too) to its variables; nothing in a damaged file is trusted."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

#: A variable: an array, one that is `Described`, a text, a list of texts, a struct (dict), a list of structs, or `Unreadable`.
Variable = Any

# Depth of structs in each other, elements of a struct array, and bytes of an unpacked variable: no lab's file has more.
_DEEPEST, _MOST_ELEMENTS, _MOST_BYTES = 6, 200, 800_000_000
# How numbers are stored, and what matrices are, as numbered in MathWorks' description of the format.
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "utf-8", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_MATRIX, _PACKED = 14, 15
_CELL, _STRUCT, _CHAR, _SPARSE, _NUMBERS, _FUNCTION = 1, 2, 4, 5, range(6, 16), 16
_COMPLEX = 0x0800

OBJECT = (
    "it is a MATLAB object (a table, a timetable, a string, ...): save it as a struct, s = table2struct(T, 'ToScalar', true)"
)


@dataclass(frozen=True)
class Unreadable:
    """A variable that holds no columns, and why."""

    reason: str


@dataclass(frozen=True, eq=False)
class Described:
    """Numbers with what the file says of them, as attributes of HDF5."""

    values: np.ndarray[Any, np.dtype[Any]]
    said: Mapping[str, Any]


def variables(data: bytes) -> dict[str, Variable]:
    """Read all variables.

    Raises
    ------
    ValueError
        If an element goes beyond its end, or does not fit its description.
    """
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise ValueError("the header does not tell the order of bytes")
    found: dict[str, Variable] = {}
    for kind, content in _elements(data[128:], order):
        if kind == _PACKED:
            unpacking = zlib.decompressobj()
            whole = unpacking.decompress(content, _MOST_BYTES)
            if unpacking.unconsumed_tail or not unpacking.eof:
                raise ValueError("a variable is cut short, or larger than any lab's")
            kind, content = next(_elements(whole, order), (0, b""))
        if kind != _MATRIX:
            raise ValueError(f"an element of kind {kind} stands where a variable is expected")
        name, value = _matrix(content, order, 0)
        if name:  # the last one, without a name, belongs to objects
            found[name] = value
    return found


def words(cells: Sequence[Variable]) -> Variable:
    """A cell array of texts as a list; of something else, unreadable."""
    return list(cells) if cells and all(isinstance(cell, str) for cell in cells) else Unreadable("it is a cell array")


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Kind and content of each element of a run of them."""
    at = 0
    while at < len(data):
        if at + 8 > len(data):
            if any(data[at:]):
                raise ValueError("an element is cut short")
            return
        kind, size = struct.unpack_from(f"{order}II", data, at)
        start, step = at + 8, 8 + size + (-size % 8 if kind != _PACKED else 0)
        if kind >> 16:  # a small one: size and kind in one number
            kind, size, start, step = kind & 0xFFFF, kind >> 16, at + 4, 8
            if size > 4:
                raise ValueError("a small element is too large")
        if start + size > len(data):
            raise ValueError("an element is cut short")
        yield kind, data[start : start + size]
        at += step


def _matrix(content: bytes, order: str, depth: int) -> tuple[str, Variable]:
    """Name and value of a matrix of any class."""
    parts = _elements(content, order)
    flags = _numbers(next(parts, None), order)
    if flags.size == 0:
        return "", np.zeros((0, 0))
    kind = int(flags[0]) & 0xFF
    if kind > _FUNCTION:
        return _text(next(parts, None), order), Unreadable(OBJECT)
    shape = tuple(int(size) for size in _numbers(next(parts, None), order))
    name = _text(next(parts, None), order)
    if len(shape) < 2 or min(shape) < 0:
        raise ValueError(f"a variable has the shape {shape}")
    count = int(np.prod(shape, dtype=object))
    if depth > _DEEPEST:
        return name, Unreadable("it is a struct within too many others")
    if kind in _NUMBERS:
        values = _numbers(next(parts, None), order)
        if values.size != count:
            raise ValueError(f'"{name}" has {values.size} numbers for the shape {shape}')
        return name, Unreadable("its numbers are complex") if int(flags[0]) & _COMPLEX else values.reshape(shape, order="F")
    if kind == _CHAR:
        text = _text(next(parts, None), order)
        return name, text if shape[0] <= 1 and len(shape) == 2 else Unreadable("it is text")
    if kind == _CELL:
        return name, words([_matrix(own, order, depth + 1)[1] for _, own in parts] if 0 < count <= 400 else [])
    if kind == _STRUCT:
        return name, _struct(parts, order, count, depth)
    return name, Unreadable({_SPARSE: "it is a sparse matrix", _FUNCTION: "it is a function"}.get(kind, OBJECT))


def _struct(parts: Iterator[tuple[int, bytes]], order: str, count: int, depth: int) -> Variable:
    """A struct, or a list of them: names of equal length one behind the other, then the fields of one after the other."""
    length = _numbers(next(parts, None), order)
    _, data = next(parts, (0, b""))
    if not 0 < count <= _MOST_ELEMENTS or length.size != 1 or not 0 < int(length[0]) <= 1000:
        return Unreadable(f"it is a struct array of {count} elements")
    step = int(length[0])
    names = [data[at : at + step].split(b"\0")[0].decode("latin-1") for at in range(0, len(data), step)]
    values = [_matrix(own, order, depth + 1)[1] for _, own in parts]
    if len(values) != count * len(names):
        raise ValueError(f"a struct has {len(values)} values for {count} times {len(names)} fields")
    found = [dict(zip(names, values[k * len(names) : (k + 1) * len(names)], strict=True)) for k in range(count)]
    return found[0] if count == 1 else found


def _numbers(element: tuple[int, bytes] | None, order: str) -> np.ndarray[Any, np.dtype[Any]]:
    if element is None:
        return np.zeros(0)
    kind, data = element
    if kind not in _STORED:
        raise ValueError(f"numbers are stored as kind {kind}, which there is not")
    return np.frombuffer(data, dtype=np.dtype(order + _STORED[kind]))


def _text(element: tuple[int, bytes] | None, order: str) -> str:
    if element is None:
        return ""
    kind, data = element
    if kind not in _TEXTS:
        raise ValueError(f"a text is stored as kind {kind}, which there is not")
    wide = {"utf-16", "utf-32"} & {_TEXTS[kind]}
    return data.decode(_TEXTS[kind] + (("-le" if order == "<" else "-be") if wide else ""), "replace")
