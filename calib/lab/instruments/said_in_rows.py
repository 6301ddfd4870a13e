"""From the columns of a sheet that say one thing in all their cells to what they say, as a line beside the table does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from calib.lab.instruments.header import declared_units
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import speaks_of_scale, stated_factors

# Cells that show at once that a column says several things, and how many of these are looked at.
_SEEN, _KINDS = 2000, 6
# A column with words in no more than this share of its rows is one of remarks.
_SELDOM = 0.2


def with_said_in_rows(sheet: Sheet) -> Sheet:
    """Take what a column that is not read says in all its cells as a line beside the table: "Mode: Cs-D", "Gain: 10".

    Of a column that is empty but for a few cells only what its first row says; a number says something as a factor alone. So
    is taken what other sheets of the file say.

    Parameters
    ----------
    sheet : the record, of the rows that are read.
    """
    said = [(-number, words) for number, words in enumerate(sheet.text.elsewhere, 1)]
    factors = {q: (words[:60], line) for line, words in said for q in stated_factors([words])}
    taken = {line for line, _ in sheet.beside}
    for name, cell, rows in _constant(sheet):
        if is_numeric(cell) and (not name or name.isdecimal()):
            continue
        words = _named(name, cell)
        line = next((n for n in rows if n not in taken), rows[0])
        texts = (cell, f"factor {cell}") if not name and cell[0] in "x×*" else (words, cell)
        stated = next((found for text in texts if (found := stated_factors([text], line))), {})
        if is_numeric(cell) and not stated:
            continue
        taken.add(line)
        said.append((line, words))
        factors |= dict.fromkeys(stated, (words[:60], line))
    if not said:
        return sheet
    # A unit that stands in some rows alone is none of all readings.
    gaps = {_named(sheet.names[i], " ".join(c.split())) for i, column in _not_read(sheet) if "" in column for c in set(column)}
    units = {
        q: (unit, said[k - 1][0])
        for q, (unit, k) in declared_units(["" if words in gaps else words for _, words in said]).items()
    }
    return replace(
        sheet,
        in_every_row=tuple(said),
        beside=(*sheet.beside, *said),
        declared_factors={**factors, **sheet.declared_factors},
        declared_units={**units, **sheet.declared_units},
    )


def _constant(sheet: Sheet) -> Iterator[tuple[str, str, list[int]]]:
    """The name, the one content, and some lines of each column that is not read and says one thing."""
    for index, column in _not_read(sheet):
        if len(column) == 0 or len(kinds := set(column[:_SEEN]) - {""}) > 1 or len(kinds := set(column) - {""}) != 1:
            continue
        cell = next(iter(kinds))
        seldom = column.count(cell) <= _SELDOM * len(column)
        if not cell.strip() or is_missing(cell) or (seldom and (column[0] != cell or speaks_of_scale(cell))):
            continue
        rows = [int(sheet.lines[r]) for r, c in enumerate(column[:_SEEN]) if c == cell][: len(sheet.columns)]
        yield sheet.names[index], " ".join(cell.split()), rows or [int(sheet.lines[column.index(cell)])]


def words_in_rows(sheet: Sheet) -> Iterator[tuple[int, str]]:
    """What columns that are not read say in words, a few things each: the line of the first of each, and the words.

    Parameters
    ----------
    sheet : the record.
    """
    own = {words: line for line, words in sheet.in_every_row}
    for index, column in _not_read(sheet):
        if len(set(column[:_SEEN])) > _KINDS or len(kinds := set(column)) > _KINDS:
            continue
        seldom = column.count("") >= (1 - _SELDOM) * len(column)
        said = (c for c in kinds if any(map(str.isalpha, c)) and not (is_missing(c) or (seldom and speaks_of_scale(c))))
        for cell in sorted(said, key=column.index):
            words = _named(sheet.names[index], " ".join(cell.split()))
            yield own.get(words, int(sheet.lines[column.index(cell)])), words


def _not_read(sheet: Sheet) -> Iterator[tuple[int, list[str]]]:
    """The columns whose names are not understood, or that hold words under the name of a quantity."""
    for index, column in enumerate(sheet.columns[: len(sheet.names)]):
        if index not in sheet.headings and index not in sheet.assigned and index not in sheet.set_aside:
            yield index, list(column)


def _named(name: str, cell: str) -> str:
    """What a cell says, behind the name of its column, if that is a name: "Mode: Cs-D"."""
    return cell if not name or name.isdecimal() else f"{name.replace('_', ' ')}: {cell}"
