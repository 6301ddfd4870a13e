"""Files of MATLAB (.mat, versions 4 to 7.3): a file in, its matrices, structs and columns as parts out."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from calib.lab.instruments.arrays import Around, ArrayColumn, Source, array_part
from calib.lab.instruments.matlab import Described, Unreadable, Variable, variables
from calib.lab.instruments.part import Format, Part, damaged
from calib.lab.instruments.said_inside import Saying, is_few, name_in, sayings, unit_in, units_in, without_units
from calib.lab.instruments.units import looks_like_unit

# "MATLAB 5.0 MAT-file"; of version 7.3 a beta of MATLAB wrote "7.0".
_NAMED = re.compile(rb"MATLAB \d\.\d MAT-file")
_HDF5 = b"\x89HDF\r\n\x1a\n"
# A matrix with at most so many rows, and more columns, holds its columns as rows.
_FEW_ROWS = 20


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
        return tuple(_parts("", found, Around(where, {}, (), _longest(found))))


def _of_version_4(path: Path) -> dict[str, Variable]:
    from scipy.io import loadmat

    found = loadmat(str(path), chars_as_strings=True)
    return {
        name: value if isinstance(value, np.ndarray) and value.dtype.kind != "U" else Unreadable("it is text, or sparse")
        for name, value in found.items()
        if not name.startswith("__")
    }


# --- from variables to parts --------------------------------------------------------------------------------------------


def _longest(value: Variable) -> int:
    """How many values the longest column or matrix holds."""
    if isinstance(value, dict | list):
        return max(map(_longest, value.values() if isinstance(value, dict) else value), default=0)
    values = _values(value)
    return max(values.shape, default=0) if values is not None and values.size > 1 else 0


def _holds_readings(value: Variable, longest: int) -> bool:
    """Whether a variable is a column or a matrix, or holds one; a few values beside long columns are a setting."""
    if isinstance(value, dict | list):
        return any(_holds_readings(one, longest) for one in (value.values() if isinstance(value, dict) else value))
    values = _values(value)
    return values is not None and values.size > 1 and (values.ndim > 2 or not is_few(max(values.shape), longest))


def _values(value: Variable) -> npt.NDArray[Any] | None:
    """The numbers of a variable, without what is said of them; None if it has none."""
    own = value.values if isinstance(value, Described) else value
    return own if isinstance(own, np.ndarray) and own.dtype.kind in "fiub" else None


def _parts(name: str, members: Mapping[str, Variable], around: Around) -> Iterator[Part]:
    """The parts of a struct, or of the file itself without a name; units are those of a struct beside, else of one above."""
    columns: dict[int, list[ArrayColumn]] = {}
    listed: dict[tuple[str, int], list[ArrayColumn]] = {}
    matrices: dict[str, npt.NDArray[Any]] = {}
    inside = {key: value for key, value in members.items() if _holds_readings(value, around.longest)}
    beside = {key: value for key, value in members.items() if key not in inside}
    units = {**around.units, **units_in(beside)}
    lists = {f"{name}.{k}" if name else k: v for k, v in beside.items() if isinstance(v, list) and _are_texts(v)}
    naming = _names_for([v for value in inside.values() if (v := _values(value)) is not None], lists)
    said = {k: v for k, v in beside.items() if (f"{name}.{k}" if name else k) not in naming}
    names = {*inside, *(m for v in inside.values() if isinstance(v, dict) for m in v)}
    above = (*around.above, *sayings(without_units(said, names)))
    around = replace(around, units=units, above=above)
    for key, value in members.items():
        own = f"{name}.{key}" if name else key
        values = _values(value)
        if key not in inside:
            yield from _unread(own, value, around)
        elif isinstance(value, dict) and (signal := _signal(key, value, around.longest)) is not None:
            columns.setdefault(signal.values.size, []).append(signal)
        elif isinstance(value, dict):
            yield from _parts(own, value, around)
        elif isinstance(value, list) and (channels := _channels(value, around.longest)):
            for channel in channels:
                listed.setdefault((own, channel.values.size), []).append(channel)
        elif isinstance(value, list):
            for k, element in enumerate(value, 1):
                yield from _parts(f"{own}({k})", element, around)
        elif values is not None and values.size == max(values.shape):
            column = ArrayColumn(key, units.get(key, ""), values.ravel())
            columns.setdefault(values.size, []).append(_described(column, value))
        elif values is not None and values.ndim == 2:
            matrices[own] = values
        elif values is not None:
            yield _without(around, own, f"it has {values.ndim} dimensions")
    for size, found in columns.items():
        title = name or "columns"
        own = title if len(columns) == 1 else f"{title}, {size} rows"
        yield array_part(around.named(own), found, above=above)
    for (own, size), found in listed.items():
        title = own if sum(of == own for of, _ in listed) == 1 else f"{own}, {size} rows"
        yield array_part(around.named(title), found, above=above)
    for own, matrix in matrices.items():
        yield _matrix(around.named(own), matrix, lists, above)


def _unread(name: str, value: Variable, around: Around) -> Iterator[Part]:
    """What is neither a column nor told as words beside one, with the reason."""
    if isinstance(value, Unreadable):
        yield _without(around, name, value.reason)
    elif isinstance(value, np.ndarray) and value.dtype.kind not in "fiub":
        complex_ = value.dtype.kind == "c"
        yield _without(around, name, "its numbers are complex" if complex_ else "it is of a kind that is not read")
    elif isinstance(value, np.ndarray) and not value.size:
        yield _without(around, name, "it is empty")


def _are_texts(value: Sequence[Variable]) -> bool:
    return bool(value) and all(isinstance(one, str) for one in value)


def _signal(key: str, members: Mapping[str, Variable], longest: int, *, with_unit: bool = True) -> ArrayColumn | None:
    """A struct of one column, its unit and words, as that column under the name of the struct; None if it is another."""
    inside = [member for member, value in members.items() if _holds_readings(value, longest)]
    values = _values(members[inside[0]]) if len(inside) == 1 else None
    unit, differing, rest = unit_in({m: v for m, v in members.items() if m not in inside})
    if values is None or values.size != max(values.shape) or (with_unit and len(rest) == len(members) - 1):
        return None
    column = ArrayColumn(key, unit, values.ravel(), tuple(sayings(rest)), differing)
    return _described(column, members[inside[0]])


def _described(column: ArrayColumn, value: Variable) -> ArrayColumn:
    """A column with what its attributes say, if it has any: its unit, where it has none yet, and words."""
    if not isinstance(value, Described):
        return column
    unit, differing, rest = unit_in({**({"unit": column.unit} if column.unit else {}), **value.said})
    return replace(column, unit=unit, differing=column.differing or differing, said=(*column.said, *sayings(rest)))


def _channels(elements: Sequence[Variable], longest: int) -> list[ArrayColumn]:
    """The columns that a list of structs holds, one in each with its name, and its unit if it has one; [] if it is another."""
    found: list[ArrayColumn] = []
    for element in elements:
        name, rest = name_in(element) if isinstance(element, dict) else ("", {})
        signal = _signal(name, rest, longest, with_unit=False) if name else None
        found += [signal] if signal is not None else []
    alone = len({column.name for column in found}) == len(found) == len(elements)
    return found if alone else []


def _names_for(matrices: Sequence[npt.NDArray[Any]], lists: Mapping[str, list[str]]) -> set[str]:
    wide = [_upright(matrix).shape[1] for matrix in matrices if matrix.ndim == 2 and matrix.size != max(matrix.shape)]
    return {key for key, words in lists.items() if len(words) in wide}


def _upright(matrix: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return matrix.T if matrix.shape[0] <= _FEW_ROWS < matrix.shape[1] else matrix


def _matrix(where: Source, matrix: npt.NDArray[Any], lists: Mapping[str, list[str]], above: Sequence[Saying]) -> Part:
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
    return array_part(where, columns, above=above, notes=notes, named=len(fitting) == 1)


def _without(around: Around, name: str, reason: str) -> Part:
    return Part(around.where.kind, name, None, reason)


FORMAT = Format("MATLAB (.mat)", recognise, take_apart)
