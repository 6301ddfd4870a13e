"""From the bytes of a MATLAB file of version 7.3, which is HDF5, to its variables."""

from __future__ import annotations

import io
from typing import Any

import h5py
import numpy as np

from calib.lab.instruments.matlab import OBJECT, Described, Unreadable, Variable, words
from calib.lab.instruments.said_inside import is_technical

# Numbers of a variable beyond which no lab's record goes, depth of structs in each other, and elements of a struct array.
_MOST_NUMBERS, _DEEPEST, _MOST_ELEMENTS = 20_000_000, 6, 200
_NUMERIC = ("double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))


def variables_of_hdf5(data: bytes) -> dict[str, Variable]:
    """Read all variables; what is no column says why."""
    with h5py.File(io.BytesIO(data), "r") as file:
        return {**_attributes(file), **_members(file, file, 0)}


def _members(group: h5py.Group, file: h5py.File, depth: int) -> dict[str, Variable]:
    found: dict[str, Variable] = {}
    for name in group:
        if depth == 0 and name.startswith("#"):
            continue
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            found[name] = Unreadable("it is a link to somewhere else")
        else:
            found[name] = _from_hdf5(group[name], file, depth)
    return found


def _from_hdf5(item: Any, file: h5py.File, depth: int) -> Variable:
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if depth >= _DEEPEST:
        return Unreadable("it is a struct within too many others")
    if "MATLAB_object_decode" in item.attrs or kind not in (*_NUMERIC, "", "struct", "cell", "char", "logical"):
        return Unreadable("it is a function" if kind == "function_handle" else OBJECT)
    if "MATLAB_sparse" in item.attrs:
        return Unreadable("it is a sparse matrix")
    if isinstance(item, h5py.Group):
        members = _members(item, file, depth + 1)
        return _elements(item, file, depth) or {**_attributes(item), **members}
    if not isinstance(item, h5py.Dataset) or item.size is None or item.size > _MOST_NUMBERS:
        return Unreadable("it is of a kind or a size that is not read")
    if item.attrs.get("MATLAB_empty", 0):
        return np.zeros((0, 0))
    if item.dtype.kind == "O":
        if kind != "cell" or item.size > 400:
            return Unreadable("it is a cell array" if kind == "cell" else "it is of a kind that is not read")
        return words([_from_hdf5(file[reference], file, depth + 1) for reference in np.asarray(item[()]).ravel()])
    values = np.asarray(item[()])
    if kind == "char":
        return (
            "".join(map(chr, values.ravel().astype(int).tolist()))
            if values.ndim == 2 and 1 in values.shape
            else Unreadable("it is text")
        )
    turned = values.T if kind else values  # MATLAB stores by columns
    said = _attributes(item)
    return Described(turned, said) if said and turned.size > 1 else turned


def _attributes(item: h5py.Group | h5py.Dataset) -> dict[str, Any]:
    """What attributes say that are none of MATLAB's or of HDF5's own: texts and single numbers."""
    found: dict[str, Any] = {}
    for name in item.attrs if len(item.attrs) > 1 or "MATLAB_class" not in item.attrs else ():
        value = item.attrs[name] if not is_technical(name) else None
        plain = value.item() if isinstance(value, np.generic | np.ndarray) and value.size == 1 else value
        found |= {name: plain.decode("utf-8", "replace") if isinstance(plain, bytes) else plain} if plain is not None else {}
    return {name: value for name, value in found.items() if isinstance(value, str | int | float | np.ndarray) and value != ""}


def _elements(group: h5py.Group, file: h5py.File, depth: int) -> list[Variable]:
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
