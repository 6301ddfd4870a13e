"""Files of MATLAB (.mat, versions 4 to 7.3): a file in, its matrices, structs and columns as parts out."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from calib.lab.instruments.arrays import ArrayColumn, Source, array_part
from calib.lab.instruments.part import Format, Part, damaged

_HDF5 = b"\x89HDF\r\n\x1a\n"
# Numbers of a variable beyond which no lab's record goes, depth of structs in each other, and elements of a struct array.
_MOST_NUMBERS, _DEEPEST, _MOST_ELEMENTS = 100_000_000, 6, 200
# A matrix with at most so many rows, and more columns, holds its columns as rows.
_FEW_ROWS = 20
_OBJECT = (
    "it is a MATLAB object (a table, a timetable, a string, ...): save it as a struct, s = table2struct(T, 'ToScalar', true)"
)


@dataclass(frozen=True)
class _Unreadable:
    """A variable that holds no columns, and why."""

    reason: str


# A variable of either version: an array, a text, a cell array of texts, a struct, an array of structs, or neither.
_Value = Any


def recognise(head: bytes, path: Path) -> bool:
    """Recognise the words at the beginning, or by the ending a file of version 4 or of HDF5 without them."""
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return True
    return path.suffix.lower() == ".mat" and (head.startswith(_HDF5) or b"\x00" in head[:20])


def take_apart(path: Path) -> tuple[Part, ...]:
    """Read every variable: structs of columns, matrices, and columns that are variables of their own.

    Columns of the same length are one part; the names of variables and fields are those of the columns. A matrix has no names,
    unless a cell array beside it holds as many.

    Raises
    ------
    InputError
        If the file is damaged.
    """
    with damaged(path, "MAT file"):
        data = path.read_bytes()
        version = "7.3" if _HDF5 in data[:4096] else "5"
        variables = _of_hdf5(data) if version == "7.3" else _of_scipy(data)
        where = Source(path, hashlib.sha256(data).hexdigest(), "mat", "variable", "")
        return tuple(_parts("", variables, where, 0))


# --- from either version to variables -----------------------------------------------------------------------------------


def _of_scipy(data: bytes) -> dict[str, _Value]:
    from scipy.io import loadmat

    found = loadmat(io.BytesIO(data), chars_as_strings=True)
    return {name or "unnamed": _from_scipy(value, 0) for name, value in found.items() if not name.startswith("__")}


def _from_scipy(value: Any, depth: int) -> _Value:
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque
    from scipy.sparse import issparse

    if issparse(value):
        return _Unreadable("it is a sparse matrix")
    if isinstance(value, MatlabFunction):
        return _Unreadable("it is a function")
    if isinstance(value, MatlabOpaque | MatlabObject):
        return _Unreadable(_OBJECT)
    if not isinstance(value, np.ndarray):
        return _Unreadable("it is of a kind that is not read")
    if value.dtype.names is not None:
        if depth >= _DEEPEST or value.size > _MOST_ELEMENTS or value.size == 0:
            return _Unreadable(f"it is a struct array of {value.size} elements, or one within too many others")
        elements = [
            {name: _from_scipy(element[name], depth + 1) for name in value.dtype.names} for element in value.ravel(order="F")
        ]
        return elements[0] if len(elements) == 1 else elements
    if value.dtype.kind == "U":
        return str(value.ravel()[0]) if value.size == 1 else [str(text) for text in value.ravel()]
    if value.dtype.kind == "O":
        return _words([_from_scipy(cell, depth + 1) for cell in value.ravel(order="F")] if value.size <= 400 else [])
    return value


def _words(cells: Sequence[_Value]) -> _Value:
    """A cell array of texts as a list; of something else, unreadable."""
    return list(cells) if cells and all(isinstance(cell, str) for cell in cells) else _Unreadable("it is a cell array")


def _of_hdf5(data: bytes) -> dict[str, _Value]:
    with h5py.File(io.BytesIO(data), "r") as file:
        return _members(file, file, 0)


def _members(group: h5py.Group, file: h5py.File, depth: int) -> dict[str, _Value]:
    found: dict[str, _Value] = {}
    for name in group:
        if depth == 0 and name.startswith("#"):
            continue
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            found[name] = _Unreadable("it is a link to somewhere else")
        else:
            found[name] = _from_hdf5(group[name], file, depth)
    return found


def _from_hdf5(item: Any, file: h5py.File, depth: int) -> _Value:
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if depth >= _DEEPEST:
        return _Unreadable("it is a struct within too many others")
    if "MATLAB_object_decode" in item.attrs or kind not in (*_NUMERIC, "", "struct", "cell", "char", "logical"):
        return _Unreadable("it is a function" if kind == "function_handle" else _OBJECT)
    if "MATLAB_sparse" in item.attrs:
        return _Unreadable("it is a sparse matrix")
    if isinstance(item, h5py.Group):
        members = _members(item, file, depth + 1)
        return _elements(item, file, depth) or members
    if not isinstance(item, h5py.Dataset) or item.size is None or item.size > _MOST_NUMBERS:
        return _Unreadable("it is of a kind or a size that is not read")
    if item.attrs.get("MATLAB_empty", 0):
        return np.zeros((0, 0))
    if item.dtype.kind == "O":
        if kind != "cell" or item.size > 400:
            return _Unreadable("it is a cell array" if kind == "cell" else "it is of a kind that is not read")
        return _words([_from_hdf5(file[reference], file, depth + 1) for reference in np.asarray(item[()]).ravel()])
    values = np.asarray(item[()])
    if kind == "char":
        return (
            "".join(map(chr, values.ravel().astype(int).tolist()))
            if values.ndim == 2 and 1 in values.shape
            else _Unreadable("it is text")
        )
    return values.T if kind else values  # MATLAB stores by columns


_NUMERIC = ("double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))


def _elements(group: h5py.Group, file: h5py.File, depth: int) -> list[_Value]:
    """The structs of an array of them, whose fields are references to the values of each; [] if the group is a single one."""
    fields = [group[name] for name in group]
    is_array = fields and all(
        isinstance(field, h5py.Dataset) and field.dtype == h5py.ref_dtype and "MATLAB_class" not in field.attrs
        for field in fields
    )
    if not is_array or len({field.shape for field in fields}) != 1 or not 1 <= fields[0].size <= _MOST_ELEMENTS:
        return []
    references = {name: np.asarray(group[name][()]).ravel() for name in group}
    return [
        {name: _from_hdf5(file[own[k]], file, depth + 1) for name, own in references.items()} for k in range(fields[0].size)
    ]


# --- from variables to parts --------------------------------------------------------------------------------------------


def _parts(name: str, members: Mapping[str, _Value], where: Source, depth: int) -> Iterator[Part]:
    """The parts of a struct, or of the file itself without a name."""
    columns: dict[int, list[ArrayColumn]] = {}
    matrices: dict[str, npt.NDArray[Any]] = {}
    lists: dict[str, list[str]] = {}
    above: list[str] = []
    for key, value in members.items():
        own = f"{name}.{key}" if name else key
        if isinstance(value, dict):
            yield from _parts(own, value, where, depth + 1)
        elif isinstance(value, list) and isinstance(value[0], dict):
            for k, element in enumerate(value, 1):
                yield from _parts(f"{own}({k})", element, where, depth + 1)
        elif isinstance(value, str):
            above.append(f"{key}\t{' '.join(value.split())[:200]}".replace('"', "'"))
        elif isinstance(value, list):
            lists[own] = value
        elif isinstance(value, _Unreadable):
            yield _without(where, own, value.reason)
        elif value.dtype.kind not in "fiub":
            yield _without(
                where, own, "its numbers are complex" if value.dtype.kind == "c" else "it is of a kind that is not read"
            )
        elif value.size <= 1:
            yield _without(where, own, "it is a single number" if value.size else "it is empty")
        elif value.size == max(value.shape):
            columns.setdefault(value.size, []).append(ArrayColumn(key, "", value.ravel()))
        elif value.ndim == 2:
            matrices[own] = value
        else:
            yield _without(where, own, f"it has {value.ndim} dimensions")
    for size, found in columns.items():
        title = name or "columns"
        own = title if len(columns) == 1 else f"{title}, {size} rows"
        yield array_part(_named(where, own), found, above=above)
    for own, matrix in matrices.items():
        yield _matrix(_named(where, own), matrix, lists, above)
    used = _names_for(matrices, lists)
    for own in lists.keys() - used:
        yield _without(where, own, "it is a list of words")


def _names_for(matrices: Mapping[str, npt.NDArray[Any]], lists: Mapping[str, list[str]]) -> set[str]:
    return {key for key, words in lists.items() if any(len(words) == _upright(matrix).shape[1] for matrix in matrices.values())}


def _upright(matrix: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return matrix.T if matrix.shape[0] <= _FEW_ROWS < matrix.shape[1] else matrix


def _matrix(where: Source, matrix: npt.NDArray[Any], lists: Mapping[str, list[str]], above: Sequence[str]) -> Part:
    """A matrix as columns, named by the one cell array beside it that has as many words."""
    upright = _upright(matrix)
    notes = ["its rows are taken as columns"] if upright is not matrix else []
    fitting = [(key, words) for key, words in lists.items() if len(words) == upright.shape[1]]
    names = [str(k + 1) for k in range(upright.shape[1])]
    if len(fitting) == 1:
        key, names = fitting[0]
        notes.append(f'the columns are named by "{key}"')
    columns = [ArrayColumn(own, "", upright[:, k]) for k, own in enumerate(names)]
    return array_part(where, columns, above=above if len(fitting) == 1 else (), notes=notes, named=len(fitting) == 1)


def _named(where: Source, name: str) -> Source:
    return Source(where.path, where.sha256, where.format, where.kind, name)


def _without(where: Source, name: str, reason: str) -> Part:
    return Part(where.kind, name, None, reason)


FORMAT = Format("MATLAB (.mat)", recognise, take_apart)
