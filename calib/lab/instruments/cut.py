"""From the lines of a lab file to the `Sheet` of one record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from calib.errors import Fault, InputError
from calib.lab.instruments.header import (
    DELIMITERS,
    HEADER_WITHIN,
    declared_decimal,
    declared_units,
    find_header,
    no_header,
    split_line,
)
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.lines import FEW_ROWS
from calib.lab.instruments.numbers import is_clock, is_numeric, is_over_range
from calib.lab.instruments.rows import with_rows
from calib.lab.instruments.sheet import Sheet, which_specimen
from calib.lab.instruments.text import LabText
from calib.lab.instruments.vocabulary import unit_of_cell, words


def cut(text: LabText, reading: Reading) -> Sheet:
    """Find delimiter, header and units row of a lab file, and cut one record into cells.

    The header is the line near the top below which most rows of numbers stand in columns that are understood, whatever stands
    above it. Where it stands again, the record goes on if time does; otherwise another specimen begins there. Specimens may
    also stand side by side. A table without a header is read if the user says which of its columns are what, by number.

    Parameters
    ----------
    text : the file.
    reading : what the user says of it.

    Returns
    -------
    One record, as text.

    Raises
    ------
    InputError
        If no header is found, no row follows it, another table follows, a row is wider than the header, or the file
        holds several specimens and `reading` does not say which.
    """
    found = find_header(text, reading)
    if found is None:
        if reading.columns and all(c.isdigit() for c in reading.columns.values()):
            return _without_header(text, reading)
        raise InputError(no_header(text))
    delimiter, header, names = found
    start = header + 1
    units_line: int | None = None
    units: list[str] = []
    following = next((i for i in range(start, len(text.lines)) if text.lines[i].strip()), None)
    if following is not None:
        cells = [unit_of_cell(c) for c in split_line(text.lines[following], delimiter)]
        if any(cells) and all(c is not None for c in cells):
            units_line, units, start = following + 1, [c or "" for c in cells], following + 1
    assigned = _assigned(reading, names, text, header + 1)
    sheet = Sheet(
        text,
        delimiter,
        header + 1,
        tuple(names),
        units_line,
        tuple(units),
        declared_units(text.lines[:header]),
        text.decimal or declared_decimal(text.lines[:header]),
        assigned,
    )
    above = _rows_above(sheet, reading)
    sheet, side_notes = _side_by_side(sheet, reading)
    whole = with_rows(sheet, start, reading, side_notes)
    return replace(whole, notes=(*above, *whole.notes))


def _assigned(reading: Reading, names: Sequence[str], text: LabText, line: int) -> dict[int, str]:
    """Columns by the user's word: index -> quantity."""
    assigned: dict[int, str] = {}
    for quantity, wanted in reading.columns.items():
        matching = [i for i, name in enumerate(names) if name == wanted] or [
            i for i, name in enumerate(names) if words(name) == words(wanted)
        ]
        if not matching and wanted.isdigit() and 1 <= int(wanted) <= len(names):
            matching = [int(wanted) - 1]
        if len(matching) != 1:
            there = ", ".join(f'{i + 1} "{n}"' for i, n in enumerate(names))
            raise InputError(
                Fault(
                    f'{"no" if not matching else "more than one"} column "{wanted}" for {quantity}; the columns are {there}',
                    text.path,
                    line,
                    advice=f"Name it by its number, such as {quantity}=2",
                )
            )
        assigned[matching[0]] = quantity
    return assigned


def _without_header(text: LabText, reading: Reading) -> Sheet:
    """A table of numbers only, with the columns that the user names by number."""
    last = max(int(c) for c in reading.columns.values())
    for index, line in enumerate(text.lines[:HEADER_WITHIN]):
        for delimiter in DELIMITERS:
            cells = split_line(line, delimiter)
            chosen = [cells[int(c) - 1] for c in reading.columns.values()] if 0 < last <= len(cells) else []
            if chosen and all(is_numeric(c) or is_clock(c) or is_over_range(c) for c in chosen):
                names = tuple(str(i + 1) for i in range(len(cells)))
                assigned = _assigned(reading, names, text, index + 1)
                sheet = Sheet(text, delimiter, 0, names, declared_decimal=text.decimal, assigned=assigned)
                return with_rows(sheet, index, reading, ())
    raise InputError(no_header(text))


def _rows_above(sheet: Sheet, reading: Reading) -> tuple[str, ...]:
    """The note on rows of numbers above the header, as of a table of results; many of them, or specimens, are refused."""
    rows = []
    for number, line in enumerate(sheet.prelude, 1):
        cells = [c for c in split_line(line, sheet.delimiter) if c]
        if len(cells) > 1 and all(map(is_numeric, cells)):
            rows.append(number)
    if not rows:
        return ()
    if len(rows) >= FEW_ROWS or reading.specimen is not None:
        raise InputError(
            Fault(
                f"{len(rows)} rows of numbers stand above the header of line {sheet.header_line}, under none understood",
                sheet.text.path,
                rows[0],
                advice="Save one record per file, or correct the header above these rows",
            )
        )
    return (f"{len(rows)} row(s) of numbers above the header left out, the first in line {rows[0]}",)


def _side_by_side(sheet: Sheet, reading: Reading) -> tuple[Sheet, tuple[str, ...]]:
    """The sheet with the columns of one specimen, where several stand side by side with the same names."""
    found = sheet.headings()
    places: dict[tuple[str, str], list[int]] = {}
    for index, heading in found.items():
        if index not in sheet.assigned and heading.quantity != "status":
            places.setdefault((heading.quantity, heading.name), []).append(index)
    repeated = {key: at for key, at in places.items() if len(at) > 1}
    counts = {len(at) for at in repeated.values()}
    if len(repeated) < 2 or len(counts) != 1:
        return sheet, ()
    count = counts.pop()
    steps = {b - a for at in repeated.values() for a, b in pairwise(at)}
    if len(steps) != 1:
        return sheet, ()
    period = steps.pop()
    first = min(at[0] for at in repeated.values())
    groups = [sheet.names[first + k * period : first + (k + 1) * period] for k in range(count)]
    groups = [(*group, *[""] * (period - len(group))) for group in groups]
    alone = [i for i, h in found.items() if i < first and h.quantity != "time"]
    if len(set(groups)) != 1 or alone:
        raise InputError(
            Fault(
                f"{count} specimens seem to stand side by side, but their columns differ: "
                + " / ".join(", ".join(f'"{n}"' for n in group) for group in groups),
                sheet.text.path,
                sheet.header_line,
                first + 1,
                advice="Export one specimen per file, or correct the header",
            )
        )
    if reading.specimen is None:
        listed = "; ".join(
            f"{k + 1}: columns {first + k * period + 1} to {min(first + (k + 1) * period, len(sheet.names))}"
            for k in range(count)
        )
        raise which_specimen(sheet, f"{count} specimens stand side by side ({listed})", count)
    if not 1 <= reading.specimen <= count:
        raise which_specimen(sheet, f"there is no specimen {reading.specimen}, {count} stand side by side", count)
    own = range(first + (reading.specimen - 1) * period, first + reading.specimen * period)
    shared = set(range(len(sheet.names))) - set(range(first, first + count * period))
    names = tuple(n if i in own or i in shared else "" for i, n in enumerate(sheet.names))
    note = f"specimen {reading.specimen} of {count} side by side: columns {own.start + 1} to {own.stop}"
    return replace(sheet, names=names), (note,)
