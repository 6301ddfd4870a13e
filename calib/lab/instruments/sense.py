"""From a column of words such as "C" and "T" beside a load without signs to the sign of each reading, or why it tells none."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.vocabulary import words
from models.sensor import FloatArray

_PUSH = frozenset(
    [
        "c",
        "comp",
        "compr",
        "compress",
        "compression",
        "compressive",
        "push",
        "pushing",
        "pressure",
        "druck",
        "d",
        "kompression",
        "stauchung",
        "compresión",
        "compresion",
        "compressione",
        "compressão",
        "ściskanie",
        "压缩",
        "圧縮",
        "压",
        "压力",
        "압축",
        "+",
        "+1",
        "pos",
        "positive",
        "plus",
    ]
)
_PULL = frozenset(
    [
        "t",
        "tens",
        "tension",
        "tensile",
        "pull",
        "pulling",
        "zug",
        "z",
        "traction",
        "tracción",
        "traccion",
        "trazione",
        "tração",
        "rozciąganie",
        "拉伸",
        "引張",
        "拉",
        "拉力",
        "인장",
        "-",
        "-1",
        "neg",
        "negative",
        "minus",
        "−",
    ]
)
# Words that are these of a load only in a column of such a name; letters and signs may mean other things elsewhere.
_OF_SIGNS = frozenset(["+", "+1", "pos", "positive", "plus", "-", "-1", "neg", "negative", "minus", "−"])
_LETTERS = frozenset(["c", "t", "d", "z"])
_NAME = re.compile(
    r"\b(?:sign|signe|signo|segno|vorzeichen|sense|sens|direction|dir|richtung|lastrichtung|kraftrichtung|dirección|direzione|"
    r"mode|modus|type|typ|polarity|c/t|t/c|comp(?:ression)?/tens(?:ion)?|load dir|force dir)\b|方向|方向",
    re.IGNORECASE,
)
# A load crosses zero where its sense changes: there it is smaller than this share of its largest, at half of the changes.
_NEAR_ZERO = 0.1
_FEWEST = 3


@dataclass(frozen=True, eq=False)
class Sense:
    """What a column of such words says of a load.

    Attributes
    ----------
    index : of the column, -1 if there is none.
    signs : 1 of compression, -1 of tension, nan where nothing is said, (n_row,); None where the load has its signs already.
    reason : what is said of the column among those that are not read.
    notes, faults : on the load.
    """

    index: int = -1
    signs: FloatArray | None = None
    reason: str = ""
    notes: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()


def sense_of_load(sheet: Sheet, force: FloatArray, load: int, used: Collection[int], said: Mapping[str, str]) -> Sense:
    """Find the column that says of each reading of a load without signs whether it is compression or tension.

    Parameters
    ----------
    sheet : the record.
    force : the load as read, nan where there is none, (n_row,).
    load : index of its column.
    used : indices of the columns that are read.
    said : the columns that the user names, by quantity: who names the load's may leave the words aside.
    """
    for index, name in enumerate(sheet.names):
        if index in used or index in sheet.set_aside:
            continue
        signs = _signs(sheet, index)
        if signs is None:
            continue
        shown = f'"{name or index + 1}"'
        there = np.isfinite(force)
        if not np.any(signs[there] < 0):
            return Sense(index, None, "says compression in all rows")
        if np.any(force[there] < 0):
            return Sense(index, None, f'says compression or tension, as the signs of "{sheet.names[load]}" do')
        large = float(np.max(force[there]))
        changes = np.flatnonzero(np.diff(np.where(np.isfinite(signs), signs, 0.0)) != 0)
        near = np.fmin(np.abs(force[changes]), np.abs(force[changes + 1]))
        near = near[np.isfinite(near)]
        if near.size and 2 * np.count_nonzero(near <= _NEAR_ZERO * large) < near.size:
            return _of_the_way(sheet, index, load, said)
        note = (
            f'the sign of "{sheet.names[load]}", which is never below zero, is taken from {shown}: tension is read as negative'
        )
        return Sense(index, signs, f'the sense of "{sheet.names[load]}", whose sign is taken from it', (note,))
    return Sense()


def _of_the_way(sheet: Sheet, index: int, load: int, said: Mapping[str, str]) -> Sense:
    """What is said of a column that changes where the load is far from zero, as the way of the machine does."""
    shown, name = f'"{sheet.names[index] or index + 1}"', sheet.names[load]
    if "force" in said:
        note = f'{shown} changes where "{name}" is far from zero: no sign is taken from it, as the load was asked for'
        return Sense(index, None, "changes where the load is far from zero", (note,))
    choice = Choice("columns", (sheet.name_for_asking(load),), "force")
    message = (
        f'"{name}" is never below zero, and {shown} says compression or tension, but changes where the load is far from zero, '
        "as the way of the machine does, not the sign of a load"
    )
    advice = f"If the load was compression throughout, name its column, and it is read as it stands: {choice}"
    fault = Fault(message, sheet.text.path, sheet.named_at, index + 1, advice=advice, choice=choice)
    return Sense(index, faults=(fault,))


def _signs(sheet: Sheet, index: int) -> FloatArray | None:
    """What the cells of a column say: 1, -1 or nan; None for a column of other things."""
    cells = sheet.columns[index]
    if not all(_is_word(cell) for cell in cells[:_FEWEST]):
        return None
    kinds = {cell: _sign(cell) for cell in set(cells)}
    plain = {words(cell) or cell.strip() for cell in kinds if cell.strip()}
    if not plain or any(sign is None for sign in kinds.values()):
        return None
    if plain <= _OF_SIGNS | _LETTERS and not _NAME.search(sheet.names[index].replace("_", " ")):
        return None
    if plain <= _LETTERS and not (plain <= {"c", "t"} or plain <= {"d", "z"}):
        return None
    return np.array([np.nan if (sign := kinds[cell]) is None else sign for cell in cells])


def _is_word(cell: str) -> bool:
    return not cell.strip() or _sign(cell) is not None


def _sign(cell: str) -> float | None:
    """1 of a word of compression, -1 of one of tension, nan of an empty cell, None of anything else."""
    word = cell.strip().lower()
    return np.nan if not word else 1.0 if word in _PUSH else -1.0 if word in _PULL else None
