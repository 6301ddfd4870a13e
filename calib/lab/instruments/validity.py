"""From the columns of a sheet that say which rows are good to the rows that they say are not, with the reason."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from calib.lab.instruments.lexicon import (
    BAD_CELL,
    BAD_ROW,
    BESIDE_COMPARED,
    BESIDE_MARK,
    COMPARED,
    MARKS_BAD,
    MARKS_GOOD,
    NO,
    SAYS_OF_ROW,
    VALIDITY,
    YES,
)
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.vocabulary import words

# A column of so many different cells at most, of which the good ones stand in more than this share of the rows.
_KINDS, _SHARE = 12, 0.5
# Cells that show at once that a column has more.
_SEEN = 1000


@dataclass(frozen=True)
class Validity:
    """What columns such as "Valid" say: rows from 0 that are not good -> why; index of such a column -> what it is."""

    rows: dict[int, str]
    columns: dict[int, str]


def said_bad(sheet: Sheet) -> Validity:
    """Find the rows that a column of the file itself calls bad.

    FALSE under "Valid", n under "Use", yes under "Excluded" or "Overload", FAULT under "Status", "saturated" under "Remark" or,
    without a name, right behind the named columns.

    Parameters
    ----------
    sheet : the record.
    """
    rows: dict[int, str] = {}
    columns: dict[int, str] = {}
    behind = max((i + 1 for i, name in enumerate(sheet.names) if name), default=-1)
    for index, name in enumerate(sheet.names):
        plain = words(name)
        parts = _parts(name)
        is_status = sheet.plain_heading(index).quantity == "status"
        marks = bool(parts) and all(p in MARKS_BAD | MARKS_GOOD | BESIDE_MARK | SAYS_OF_ROW for p in parts)
        if plain not in VALIDITY and not is_status and not marks and index != behind:
            continue
        cells = sheet.columns[index]
        if len(set(cells[:_SEEN])) > _KINDS:
            continue
        kinds = {c: c.strip().lower() for c in set(cells)}
        if len(kinds) > _KINDS:
            continue
        if plain in VALIDITY:
            bad = {c for c, said in kinds.items() if said not in VALIDITY[plain] | {""}}
        elif parts & MARKS_BAD and not is_status:
            bad = {c for c, said in kinds.items() if said in YES | BAD_CELL or _is_said(said, BAD_ROW | MARKS_BAD)}
        else:
            words_of_bad = BAD_CELL | NO if parts & MARKS_GOOD else BAD_CELL
            bad = {c for c, said in kinds.items() if said in words_of_bad or _is_said(said, BAD_ROW)}
        n_bad = sum(cells.count(c) for c in bad)
        if n_bad >= _SHARE * len(cells) or any("." in c or "," in c for c in bad):
            if n_bad == len(cells) and len(bad) == 1 and not is_status and any(map(str.isalpha, cells[0])):
                columns[index] = f'says "{cells[0].strip()[:20]}" of all rows, which are read all the same'
            continue
        if plain in VALIDITY or (bad and not is_status):
            columns[index] = "says which rows are good"
        for row in (r for r, cell in enumerate(cells) if cell in bad) if bad else ():
            column = f'"{name}"' if name else f"column {index + 1}"
            rows.setdefault(row, f'{column} says "{cells[row].strip()[:20]}"')
    return Validity(rows, columns)


def compares(cells: Sequence[str]) -> bool:
    """Whether a column is a comparator's: which readings are within limits that were set ("IN"), above, or below.

    Parameters
    ----------
    cells : of the column.
    """
    said = {c.strip().lower() for c in set(cells)} - {""}
    return "in" in said and said <= COMPARED | BESIDE_COMPARED


def _parts(name: str) -> frozenset[str]:
    """The words of a name in lower case, also of one written together: "DataQuality", "ok?"."""
    apart = re.sub(r"(?<=[a-zäöüß])(?=[A-Z])", " ", name)
    return frozenset(w for w in re.split(r"[\W_]+", apart.lower()) if w)


def _is_said(said: str, of: Iterable[str]) -> bool:
    """Whether a cell holds one of some words, and does not deny it."""
    parts = [w for w in re.split(r"[\W_]+", said) if w]
    return any(w in of for w in parts) and not any(
        w in ("no", "not", "none", "without", "kein", "keine", "nicht") for w in parts
    )
