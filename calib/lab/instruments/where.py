"""From what the user says of rows (`Reading.where`) to the rows of a `Sheet` that are read, and what the others are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import compress, islice, pairwise

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.labtable import Reading, Unread
from calib.lab.instruments.numbers import parse_number
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.vocabulary import words
from models.sensor import BoolArray

# Two numbers are one: 1000 and 1.0E3, and a frequency as a meter reads it back.
_SAME = 1e-6
_LISTED = 24


@dataclass(frozen=True, eq=False)
class RowsAsked:
    """The rows that are read, (n_row,), what the others are, notes on what was asked, and the columns asked by."""

    kept: BoolArray
    others: tuple[Unread, ...]
    notes: tuple[str, ...]
    columns: tuple[int, ...]


# Rows that a press has at least.
_FEWEST = 4


def rows_asked(sheet: Sheet, reading: Reading) -> RowsAsked:
    """Choose the rows that hold the values which the user asks for.

    Parameters
    ----------
    sheet : the record.
    reading : with `where`, column -> value; a number may be written in any notation.

    Raises
    ------
    InputError
        If there is no such column or no such value, with those that there are.
    """
    kept = np.ones(len(sheet.lines), dtype=bool)
    others: list[Unread] = []
    notes: list[str] = []
    faults: list[Fault] = []
    by: list[int] = []
    marks = [sheet.declared_decimal] if sheet.declared_decimal else [".", ","]
    for wanted, value in reading.where.items():
        column = column_called(sheet, wanted)
        if column is None:
            there = ", ".join(f'{i + 1} "{name}"' for i, name in enumerate(sheet.names))
            faults.append(
                Fault(
                    f'no column "{wanted}" to choose rows by; the columns are {there}',
                    sheet.text.path,
                    sheet.named_at,
                    advice="Name it as it is written, or by its number: --where 2=...",
                )
            )
            continue
        cells = filled_down(sheet.columns[column])
        exact = {cell for cell in set(cells) if cell == value.strip()}
        holding = exact or {cell for cell in set(cells) if _is_the_same(cell, value.strip(), marks)}
        here = np.array([cell in holding for cell in cells], dtype=bool)
        name = sheet.names[column] or f"column {column + 1}"
        if not here.any():
            faults.append(
                Fault(
                    f'no row holds "{value}" in column "{name}", which holds {listed_values(cells)}',
                    sheet.text.path,
                    int(sheet.lines[0]),
                    column + 1,
                    advice=f'Say one of them: --where "{asked_name(sheet, column)}={next((c for c in cells if c), "...")}"',
                )
            )
            continue
        if int(here.sum()) < _FEWEST <= len(cells) and len(set(cells)) > len(cells) / _FEWEST:
            faults.append(
                Fault(
                    f'column "{name}" tells no records apart: it holds {len(set(cells))} values in {len(cells)} rows, '
                    f'and "{value}" in {int(here.sum())} of them',
                    sheet.text.path,
                    sheet.named_at,
                    column + 1,
                    advice="Name the column whose value is the same in all rows of a press, or correct the header",
                )
            )
            continue
        others += _others(sheet, name, cells, kept & ~here)
        kept &= here
        by.append(column)
        notes.append(f'only rows whose "{name}" is "{value}" are read: {int(here.sum())} of {len(kept)}')
    if not faults and not kept.any():
        said = " and ".join(f'"{k}" is "{v}"' for k, v in reading.where.items())
        faults.append(Fault(f"no row in which {said}", sheet.text.path, int(sheet.lines[0]), advice="Ask for less by --where"))
    if faults:
        raise InputError(faults)
    return RowsAsked(kept, tuple(others), tuple(notes), tuple(by))


def _others(sheet: Sheet, name: str, cells: Sequence[str], left_out: BoolArray) -> list[Unread]:
    """What to say of the rows that are not asked for: how many they are, where, and what they hold in a column."""
    rows = np.flatnonzero(left_out)
    if not rows.size:
        return []
    holding = listed_values([cells[r] for r in rows.tolist()]) or "nothing"
    where = f"in lines {sheet.lines[rows[0]]} to {sheet.lines[rows[-1]]}" if rows.size > 1 else f"line {sheet.lines[rows[0]]}"
    return [Unread(f"{rows.size} row(s), {where}", f'not asked for: "{name}" is {holding}')]


def only_rows(sheet: Sheet, kept: BoolArray) -> Sheet:
    """The sheet with some of its rows.

    Parameters
    ----------
    sheet : the record.
    kept : mask of its rows, (n_row,).
    """
    new_row = np.cumsum(kept) - 1
    return replace(
        sheet,
        columns=tuple(list(compress(column, kept)) for column in sheet.columns),
        lines=sheet.lines[kept],
        cut_short=sheet.cut_short and bool(kept[-1]),
        reasons={int(new_row[r]): why for r, why in sheet.reasons.items() if kept[r]},
    )


def column_called(sheet: Sheet, wanted: str) -> int | None:
    """Find a column by what the user calls it: its name as written, but for case and blanks, without its unit, or its number.

    Parameters
    ----------
    sheet : the record.
    wanted : such as "Frequency (Hz)", "frequency", "3".

    Returns
    -------
    Its index; None if none or more than one is called so.
    """
    ways = (
        [i for i, name in enumerate(sheet.names) if name == wanted],
        [int(wanted) - 1] if wanted.isdecimal() and 1 <= int(wanted) <= len(sheet.names) else [],
        [i for i, name in enumerate(sheet.names) if words(name) == words(wanted)],
        [i for i, name in enumerate(sheet.names) if words(name.split("(")[0].split("[")[0]) == words(wanted) != ""],
    )
    found = next((way for way in ways if way), [])
    return found[0] if len(found) == 1 else None


# A name that stands in the first row of each record only, as in joined cells of a workbook, stands in no more rows than this.
_IN_FIRST_ROWS = 0.1


def filled_down(cells: Sequence[str]) -> list[str]:
    """The cells of a column without blanks around them; names that stand in the first row of each record only in all its rows.

    >>> filled_down(["A", *[""] * 20, "B", *[""] * 20])[19:23]
    ['A', 'A', 'B', 'B']
    """
    tidy = list(map(str.strip, cells))
    rows = [r for r, c in enumerate(tidy) if c]
    apart = rows[:1] == [0] and len(rows) <= _IN_FIRST_ROWS * len(tidy) and all(b - a >= _FEWEST for a, b in pairwise(rows))
    if not apart or len({tidy[r] for r in rows}) < 2:
        return tidy
    return [tidy[a] for a, b in pairwise([*rows, len(tidy)]) for _ in range(a, b)]


def asked_name(sheet: Sheet, column: int) -> str:
    """How the user may name a column in `where`: as it is written, or by its number.

    Parameters
    ----------
    sheet : the record.
    column : index of the column.
    """
    name = sheet.name_for_asking(column)
    return name if column_called(sheet, name) == column else str(column + 1)


def listed_values(cells: Sequence[str]) -> str:
    """Write the different values of a column in the order in which they come, a long list cut."""
    found = list(dict.fromkeys(c for c in cells if c))
    shown = ", ".join(f'"{c}"' for c in islice(found, _LISTED))
    return shown + (f" and {len(found) - _LISTED} more" if len(found) > _LISTED else "")


def _is_the_same(cell: str, value: str, marks: Sequence[str]) -> bool:
    if cell and cell.casefold() == value.casefold():
        return True
    ones = [n for mark in marks if (n := parse_number(cell, mark)) is not None]
    others = [n for mark in ".," if (n := parse_number(value, mark)) is not None]
    return any(abs(a - b) <= _SAME * max(abs(a), abs(b)) for a in ones for b in others)
