"""From the sheets of a workbook that are no records, as of settings and notes, to what they say, and to where it is told."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from calib.errors import Fault
from calib.lab.instruments.brackets import says_sense
from calib.lab.instruments.circuit import said_circuit
from calib.lab.instruments.contrary import unit_against
from calib.lab.instruments.declared import declared_units
from calib.lab.instruments.labtable import LabTable
from calib.lab.instruments.level_told import tells_of_a_level
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.part import Part
from calib.lab.instruments.stated import stated_factors
from calib.lab.instruments.told import tells_of_readings

# A sheet of settings is short; each of its lines is a remark, or a name and its value.
_MOST_LINES, _LONGEST, _CELLS = 400, 200, 2
# A table of settings has a row for each of a few channels, or a column.
_MOST_CHANNELS = 20
_QUANTITIES = ("force", "displacement", "capacitance", "time")
_LINE = re.compile(r"\bline -(\d+)\b")


def said_in_sheets(parts: Sequence[Part]) -> tuple[tuple[str, str], ...]:
    """List what sheets say that may change how a record beside them is read: the sheet and the words of each line.

    Parameters
    ----------
    parts : that are no records.
    """
    found = []
    for part in parts:
        if not part.hidden:
            rows = _rows(part)
            found += [(part.title, words) for words in _lines(rows) if _may_change(words)]
            found += [(part.title, words) for words in _crossed(rows) if stated_factors([words])]
    return tuple(found)


def _rows(part: Part) -> list[list[str]]:
    """The rows of a sheet in which something stands."""
    rows = [[" ".join(cell.split()).strip('"') for cell in line.split("\t")] for line in part.text.lines] if part.text else []
    return [row for row in rows if any(row)][: _MOST_LINES + 1]


def _crossed(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """The numbers of a table of settings, each with what its column and its row are called: "Factor Force: 10"."""
    if not 1 < len(rows) <= _MOST_CHANNELS + 1:
        return
    above = rows[0]
    for row in rows[1:]:
        called = row[0] if row[0] and not is_numeric(row[0]) else above[0]
        for name, cell in zip(above[1:], row[1:], strict=False):
            if name and is_numeric(cell) and not is_numeric(name):
                yield f"{name} {called}: {cell}"[:_LONGEST]


def _lines(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """The lines of a sheet that are a remark, or a name and its value, and none of a table."""
    rows = [[cell for cell in row if cell] for row in rows]
    for row, below in zip(rows, [*rows, []][1:], strict=True):
        if len(row) <= _CELLS and not (len(row) == len(below) > 1 and all(map(is_numeric, below))):
            yield ": ".join(cell.rstrip(" :=") for cell in row)[:_LONGEST]


def _may_change(words: str) -> bool:
    acts = bool(stated_factors([words]) or declared_units([words]) or said_circuit([words]) or says_sense(words))
    acts |= tells_of_readings(words) or tells_of_a_level(words)
    return acts or any(unit_against(words, quantity, math.nan) for quantity in _QUANTITIES)


def with_its_sheet(fault: Fault, said: Sequence[tuple[str, str]]) -> tuple[Fault, str]:
    """A fault with the sheets of what was said there in place of lines, and the sheet where it stands, "" for the record's own.

    Parameters
    ----------
    fault : of a record read with what other sheets say, of which the k-th has the line -k.
    said : sheet and words of each.
    """
    fault = replace(fault, message=_placed(fault.message, said), advice=_placed(fault.advice, said))
    return (replace(fault, line=None), said[-fault.line - 1][0]) if fault.line is not None and fault.line < 0 else (fault, "")


def with_their_sheets(table: LabTable, said: Sequence[tuple[str, str]]) -> LabTable:
    """A table with the sheets of what was said there in place of lines in its notes.

    Parameters
    ----------
    table : as read.
    said : sheet and words of each, the k-th of the line -k.
    """
    return replace(table, notes=tuple(_placed(note, said) for note in table.notes)) if said else table


def _placed(text: str, said: Sequence[tuple[str, str]]) -> str:
    return _LINE.sub(lambda match: said[int(match[1]) - 1][0], text) if said and text else text
