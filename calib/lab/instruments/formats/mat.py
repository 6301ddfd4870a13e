"""Files of MATLAB (.mat, versions 4 to 7.3): a file in, its matrices, structs and columns as parts out."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from calib.lab.instruments.arrays import ArrayColumn, Source, array_part
from calib.lab.instruments.matlab import Unreadable, Variable, variables
from calib.lab.instruments.part import Format, Part, damaged
from calib.lab.instruments.units import looks_like_unit

# "MATLAB 5.0 MAT-file"; of version 7.3 a beta of MATLAB wrote "7.0".
_NAMED = re.compile(rb"MATLAB \d\.\d MAT-file")
_HDF5 = b"\x89HDF\r\n\x1a\n"
# A matrix with at most so many rows, and more columns, holds its columns as rows.
_FEW_ROWS = 20


# What a struct calls the unit of its one column, force.data and force.unit, or those of all: data.units.force.
_UNIT = ("unit", "units", "einheit")
# What each struct of a list calls its name: channels(2).name.
_NAME = ("name", "label", "title", "channel", "signal", "bezeichnung")


def recognise(head: bytes, path: Path) -> bool:
    """Recognise the words at the beginning, or by the ending a file of version 4 or of HDF5 without them.

    Parameters
    ----------
    head : its first bytes.
    path : the file.
    """
    if _NAMED.match(head):
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
        if _HDF5 in data[:4096]:
            from calib.lab.instruments.matlab73 import variables_of_hdf5  # h5py takes its time to load

            found = variables_of_hdf5(data)
        else:
            found = variables(data) if _NAMED.match(data) else _of_version_4(path)
        where = Source(path, hashlib.sha256(data).hexdigest(), "mat", "variable", "")
        return tuple(_parts("", found, where, 0, {}))


def _of_version_4(path: Path) -> dict[str, Variable]:
    from scipy.io import loadmat

    found = loadmat(str(path), chars_as_strings=True)
    return {
        name: value if isinstance(value, np.ndarray) and value.dtype.kind != "U" else Unreadable("it is text, or sparse")
        for name, value in found.items()
        if not name.startswith("__")
    }


# --- from variables to parts --------------------------------------------------------------------------------------------


def _parts(
    name: str, members: Mapping[str, Variable], where: Source, depth: int, above_units: Mapping[str, str]
) -> Iterator[Part]:
    """The parts of a struct, or of the file itself without a name; units are those of a struct beside, else of one above."""
    units = {**above_units, **_units_of_members(members)}
    columns: dict[int, list[ArrayColumn]] = {}
    listed: dict[tuple[str, int], list[ArrayColumn]] = {}
    matrices: dict[str, npt.NDArray[Any]] = {}
    lists: dict[str, list[str]] = {}
    above: list[str] = []
    for key, value in members.items():
        own = f"{name}.{key}" if name else key
        if isinstance(value, dict) and (signal := _signal(key, value)) is not None:
            columns.setdefault(signal.values.size, []).append(signal)
            above += _said_of(key, value)
        elif isinstance(value, dict):
            yield from _parts(own, value, where, depth + 1, units)
        elif isinstance(value, list) and isinstance(value[0], dict) and (channels := _channels(value)):
            for channel, element in zip(channels, value, strict=True):
                listed.setdefault((own, channel.values.size), []).append(channel)
                above += _said_of(channel.name, element)
        elif isinstance(value, list) and isinstance(value[0], dict):
            for k, element in enumerate(value, 1):
                yield from _parts(f"{own}({k})", element, where, depth + 1, units)
        elif isinstance(value, str):
            above.append(f"{key}\t{' '.join(value.split())[:200]}".replace('"', "'"))
        elif isinstance(value, list):
            lists[own] = value
        elif isinstance(value, Unreadable):
            yield _without(where, own, value.reason)
        elif value.dtype.kind not in "fiub":
            yield _without(
                where, own, "its numbers are complex" if value.dtype.kind == "c" else "it is of a kind that is not read"
            )
        elif value.size <= 1:
            yield _without(where, own, "it is a single number" if value.size else "it is empty")
        elif value.size == max(value.shape):
            columns.setdefault(value.size, []).append(ArrayColumn(key, units.get(key, ""), value.ravel()))
        elif value.ndim == 2:
            matrices[own] = value
        else:
            yield _without(where, own, f"it has {value.ndim} dimensions")
    for size, found in columns.items():
        title = name or "columns"
        own = title if len(columns) == 1 else f"{title}, {size} rows"
        yield array_part(_named(where, own), found, above=above)
    for (own, size), found in listed.items():
        title = own if sum(of == own for of, _ in listed) == 1 else f"{own}, {size} rows"
        yield array_part(_named(where, title), found, above=above)
    for own, matrix in matrices.items():
        yield _matrix(_named(where, own), matrix, lists, above)
    used = _names_for(matrices, lists)
    for own in lists.keys() - used:
        yield _without(where, own, "it is a list of words")


def _units_of_members(members: Mapping[str, Variable]) -> dict[str, str]:
    """The units of columns that a struct among them names, under the names of these: data.units.force beside data.force."""
    named = (value for key, value in members.items() if key.lower() in _UNIT and isinstance(value, dict))
    return {name: unit for of in named for name, unit in of.items() if isinstance(unit, str)}


def _signal(key: str, members: Mapping[str, Variable]) -> ArrayColumn | None:
    """A struct of one column, its unit and words about it as that column under the name of the struct; None if it is none."""
    units = [value for member, value in members.items() if member.lower() in _UNIT and isinstance(value, str)]
    others = [value for value in members.values() if not isinstance(value, str)]
    if len(units) != 1 or len(others) != 1 or not isinstance(others[0], np.ndarray):
        return None
    values = others[0]
    if values.dtype.kind not in "fiub" or values.size <= 1 or values.size != max(values.shape):
        return None
    return ArrayColumn(key, units[0], values.ravel())


def _said_of(key: str, members: Mapping[str, Variable]) -> list[str]:
    """The words about a column that stand beside it, as lines."""
    said = ((m, text) for m, text in members.items() if isinstance(text, str) and m.lower() not in (*_UNIT, *_NAME))
    return [f"{key} {member}\t{' '.join(text.split())[:200]}".replace('"', "'") for member, text in said]


def _channels(elements: Sequence[Mapping[str, Variable]]) -> list[ArrayColumn]:
    """The columns that a list of structs holds, one in each with its name, and its unit if it has one; [] if it is another."""
    found: list[ArrayColumn] = []
    for element in elements:
        names = [value for member, value in element.items() if member.lower() in _NAME and isinstance(value, str)]
        unit_there = any(member.lower() in _UNIT for member in element)
        signal = _signal(names[0], element if unit_there else {**element, _UNIT[0]: ""}) if len(names) == 1 else None
        found += [signal] if signal is not None and signal.name else []
    alone = len({column.name for column in found}) == len(found) == len(elements)
    return found if alone else []


def _names_for(matrices: Mapping[str, npt.NDArray[Any]], lists: Mapping[str, list[str]]) -> set[str]:
    return {key for key, words in lists.items() if any(len(words) == _upright(matrix).shape[1] for matrix in matrices.values())}


def _upright(matrix: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return matrix.T if matrix.shape[0] <= _FEW_ROWS < matrix.shape[1] else matrix


def _matrix(where: Source, matrix: npt.NDArray[Any], lists: Mapping[str, list[str]], above: Sequence[str]) -> Part:
    """A matrix as columns, named by the one cell array beside it that has as many words."""
    upright = _upright(matrix)
    notes = ["its rows are taken as columns"] if upright is not matrix else []
    fitting = [(key, words) for key, words in lists.items() if len(words) == upright.shape[1]]
    # `importdata` of MATLAB gives the names of the columns, and the lines above the numbers, which may be the same.
    fitting = [(key, words) for key, words in fitting if key.split(".")[-1] == "colheaders"] or fitting
    # Units beside names: labels and units.
    units = [words for _, words in fitting if all(map(looks_like_unit, filter(None, words))) and any(words)]
    unit = units[0] if len(units) == 1 < len(fitting) else [""] * upright.shape[1]
    fitting = [(key, words) for key, words in fitting if words is not unit]
    fitting = fitting[:1] if len({tuple(words) for _, words in fitting}) == 1 else fitting
    names = [str(k + 1) for k in range(upright.shape[1])]
    if len(fitting) == 1:
        key, names = fitting[0]
        notes.append(f'the columns are named by "{key}"')
    said = unit if len(fitting) == 1 else [""] * len(names)
    columns = [ArrayColumn(own, said[k], upright[:, k]) for k, own in enumerate(names)]
    return array_part(where, columns, above=above if len(fitting) == 1 else (), notes=notes, named=len(fitting) == 1)


def _named(where: Source, name: str) -> Source:
    return Source(where.path, where.sha256, where.format, where.kind, name)


def _without(where: Source, name: str, reason: str) -> Part:
    return Part(where.kind, name, None, reason)


FORMAT = Format("MATLAB (.mat)", recognise, take_apart)
