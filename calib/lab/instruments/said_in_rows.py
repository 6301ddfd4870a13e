"""From the columns of a sheet that say one thing in all their cells to what they say, as a line beside the table does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from calib.lab.instruments.circuit import said_circuit
from calib.lab.instruments.column_words import few_kinds, is_seldom
from calib.lab.instruments.declared import declared_units
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import speaks_of_scale, stated_factors

# Rows among which one is looked for whose line nothing else is quoted from.
_SEEN = 2000


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
    gaps = set()
    for name, cell, rows, whole in _constant(sheet):
        if is_numeric(cell) and (not name or name.isdecimal()):
            continue
        words = _named(name, cell)
        line = next((n for n in rows if n not in taken), rows[0])
        texts = (cell, f"factor {cell}") if not name and cell[0] in "x×*" else (words, cell)
        stated = next((found for text in texts if (found := stated_factors([text], line))), {})
        if is_numeric(cell) and not stated:
            continue
        taken.add(line)
        gaps |= set() if whole else {len(said)}
        said.append((line, words))
        factors |= dict.fromkeys(stated, (words[:60], line))
    if not said:
        return sheet
    # A unit that stands in some rows alone is none of all readings.
    whole_words = ["" if k in gaps else words for k, (_, words) in enumerate(said)]
    units = {q: (unit, said[k - 1][0]) for q, (unit, k) in declared_units(whole_words).items()}
    return replace(
        sheet,
        in_every_row=tuple(said),
        beside=(*sheet.beside, *said),
        declared_factors={**factors, **sheet.declared_factors},
        declared_units={**units, **sheet.declared_units},
    )


def _constant(sheet: Sheet) -> Iterator[tuple[str, str, list[int], bool]]:
    """The name, the one content, some lines, and whether no cell is empty, of each column not read that says one thing."""
    for index, column in _not_read(sheet):
        kinds = few_kinds(column)
        if len(kinds - {""}) != 1:
            continue
        (cell,) = kinds - {""}
        if not cell.strip() or is_missing(cell) or (is_seldom(column) and (column[0] != cell or speaks_of_scale(cell))):
            continue
        rows = [int(sheet.lines[r]) for r, c in enumerate(column[:_SEEN]) if c == cell][: len(sheet.columns)]
        yield sheet.names[index], " ".join(cell.split()), rows or [int(sheet.lines[column.index(cell)])], "" not in kinds


def words_in_rows(sheet: Sheet) -> Iterator[tuple[int, str]]:
    """What columns that are not read say in words, a few things each: the line of the first of each, and the words.

    Parameters
    ----------
    sheet : the record.
    """
    own = {words: line for line, words in sheet.in_every_row}
    for index, column in _not_read(sheet):
        seldom = is_seldom(column)
        said = (
            c for c in few_kinds(column) if any(map(str.isalpha, c)) and not (is_missing(c) or (seldom and speaks_of_scale(c)))
        )
        for cell in sorted(said, key=column.index):
            words = _named(sheet.names[index], " ".join(cell.split()))
            yield own.get(words, int(sheet.lines[column.index(cell)])), words


def circuits_in_turn(sheet: Sheet) -> tuple[int, list[str]] | None:
    """The first column not read that names one circuit in some rows and the other in others: its index, and its cells in order.

    Parameters
    ----------
    sheet : the record.
    """
    for index, column in _not_read(sheet):
        cells = sorted(few_kinds(column) - {""}, key=column.index)
        named = {cell: said.word for cell in cells if (said := said_circuit([_named(sheet.names[index], cell)])) is not None}
        if {"series", "parallel"} <= set(named.values()):
            return index, list(named)
    return None


def _not_read(sheet: Sheet) -> Iterator[tuple[int, Sequence[str]]]:
    """The columns whose names are not understood, or that hold words under the name of a quantity."""
    for index, column in enumerate(sheet.columns[: len(sheet.names)]):
        if index not in sheet.headings and index not in sheet.assigned and index not in sheet.set_aside:
            yield index, column


def _named(name: str, cell: str) -> str:
    """What a cell says, behind the name of its column, if that is a name: "Mode: Cs-D"."""
    return cell if not name or name.isdecimal() else f"{name.replace('_', ' ')}: {cell}"
