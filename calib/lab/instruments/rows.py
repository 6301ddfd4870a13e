"""From a `Sheet` without rows to one with those of one record: blocks, specimens, lines of text between them, a cut end."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress, pairwise

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.header import split_line
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.numbers import is_clock, is_missing, is_numeric, is_over_range, not_clocks, not_numbers, parse_number
from calib.lab.instruments.sheet import Sheet, no_such_specimen, which_specimen
from calib.lab.instruments.vocabulary import understand, unit_of_cell

# Lines of text below a table that may belong to it.
_FOOTER = 50
# Rows without a number at first that are looked at one by one where all others have one: so many, and this share.
_FEW_ODD, _SHARE_ODD = 100, 0.1
#: Rows of a second table that are too many to be left out as one of results.
FEW_ROWS = 10


def with_rows(sheet: Sheet, start: int, reading: Reading, notes: tuple[str, ...]) -> Sheet:
    """The sheet with the rows of one record from the line with index `start` on, and `notes` before those made here.

    Raises
    ------
    SeveralSpecimens
        If blocks below the header are several specimens and `reading` does not say which.
    InputError
        If there are no rows, text stands among them, they do not fit the header, or another table follows.
    """
    keys = [i for i, h in sheet.headings().items() if h.quantity != "status"]
    table = _regular_table(sheet, start, keys)
    if table is None:
        table = _block_table(sheet, start, keys, reading, has_side_by_side=bool(notes))
    elif reading.specimen not in (None, 1) and not notes:
        raise InputError(no_such_specimen(sheet, reading))
    # Rows without anything at the end: the other specimens, or the software's own.
    n_line = len(table.lines)
    n_row = next((n for n in range(n_line, 0, -1) if any(table.columns[k][n - 1].strip() for k in keys)), 0)
    if n_row == 0:
        raise InputError(Fault("all rows are empty", sheet.text.path, sheet.header_line, advice="Export the raw data too"))
    return replace(
        sheet,
        columns=tuple(column[:n_row] for column in table.columns),
        lines=table.lines[:n_row],
        cut_short=n_row == n_line and _is_cut_short(sheet, table.lines),
        notes=(*notes, *table.notes),
    )


@dataclass(frozen=True, eq=False)
class _Table:
    """The rows of one record: columns of cells, as many as the header has, 1-based lines, and notes on what was left out."""

    columns: Sequence[Sequence[str]]
    lines: IntArray
    notes: Sequence[str]


def _regular_table(sheet: Sheet, start: int, keys: Sequence[int]) -> _Table | None:
    """The one block of rows below the header, most with a number at first; None where there may be more to it than that.

    What `_blocks` tells line by line is told here for whole columns, so that a file of a million rows is cut in a second. Rows
    without their first number are looked at one by one; text among the rows, another header or too many such rows are left to
    `_blocks`.
    """
    if not keys:
        return None
    found = _end_of_rows(sheet, start, keys)
    if found is None:
        return None
    end, text_below = found
    lines = sheet.text.lines[start:end]
    columns = _cut_alike(sheet, lines)
    if columns is None:
        return None
    few = _FEW_ODD + int(_SHARE_ODD * len(lines))
    odd = not_numbers(columns[keys[0]], few)
    odd = odd if odd is not None else not_clocks(columns[keys[0]], few)
    if odd is None:
        return None
    kept = np.ones(len(lines), dtype=bool)
    for i in odd:
        row = split_line(lines[i], sheet.delimiter)
        if not any(row):
            kept[i] = False
        elif _kind(row, (), keys, len(columns)) != "row":
            return None
    if not np.all(kept):
        columns = [list(compress(column, kept)) for column in columns]
    return _Table(columns, start + 1 + np.flatnonzero(kept), _left_out(sheet, text_below))


def _cut_alike(sheet: Sheet, lines: Sequence[str]) -> list[list[str]] | None:
    """As many columns of cells as the header has, missing cells empty; None if a row is too wide or the header is."""
    delimiter, width = sheet.delimiter, len(sheet.names)
    rows: Iterator[list[str]] = (line.split(delimiter) for line in lines)
    if delimiter == " ":
        rows = map(str.split, lines)
    elif any('"' in line for line in lines):
        if any(line.count('"') % 2 for line in lines):
            return None
        rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
    cells: list[str] = []
    widest = 0
    try:
        for row in rows:
            n = len(row)
            if n > widest and any(c.strip() for c in row):
                widest = n
            if n != width and ((n > 0 and delimiter == " ") or any(c.strip() for c in row[width:])):
                return None
            cells += row if n == width else (row + [""] * width)[:width]
    except csv.Error:
        return None
    return [cells[i::width] for i in range(width)] if widest >= _n_named(sheet) else None


def _n_named(sheet: Sheet) -> int:
    """Number of columns up to the last that has a name."""
    return max((i + 1 for i, name in enumerate(sheet.names) if name), default=0)


def _end_of_rows(sheet: Sheet, start: int, keys: Sequence[int]) -> tuple[int, list[int]] | None:
    """Index of the line behind the last row, and those of the lines of text below it; None if there is no row or much text."""
    text_below: list[int] = []
    width = len(sheet.names)
    for i in range(len(sheet.text.lines) - 1, start - 1, -1):
        line = sheet.text.lines[i]
        if not line.strip():
            continue
        row = split_line(line, sheet.delimiter)
        if _kind(row, (), keys, width) == "row":
            return i + 1, text_below[::-1]
        if len(text_below) > _FOOTER or _is_other_header(row) or line.count('"') % 2:
            return None
        if any(row):
            text_below.append(i)
    return None


def _block_table(sheet: Sheet, start: int, keys: Sequence[int], reading: Reading, *, has_side_by_side: bool) -> _Table:
    """The rows of the blocks below the header that are one record, told line by line; faults as in `with_rows`."""
    rows = _cells_of(sheet, start)
    blocks, more = _blocks(sheet, rows, start, keys)
    blocks = [b for b in blocks if b.rows]
    if not blocks:
        raise InputError(
            Fault(
                "there is a header but no row of numbers below it",
                sheet.text.path,
                sheet.header_line,
                advice="Export the raw data too",
            )
        )
    kept, block_notes = _one_specimen(sheet, blocks, rows, keys, reading, has_side_by_side=has_side_by_side)
    width = len(sheet.names)
    chosen = [rows[i] for i in kept]
    lines = np.array(kept, dtype=np.int64) + start + 1
    _check_width(sheet, chosen, lines, width)
    full = [row if len(row) == width else (row + [""] * width)[:width] for row in chosen]
    return _Table(tuple(zip(*full, strict=True)), lines, (*block_notes, *more))


def _left_out(sheet: Sheet, indices: Sequence[int]) -> list[str]:
    """The note on lines of text, by their indices in the file, that are left out."""
    if not indices:
        return []
    shown = sheet.text.lines[indices[0]].strip()[:80]
    return [f'{len(indices)} line(s) of text left out, the first is "{shown}" (line {indices[0] + 1})']


def _cells_of(sheet: Sheet, start: int) -> list[list[str]]:
    """Cells of every line from `start` on; faults for quotation marks that are not closed."""
    text, delimiter = sheet.text, sheet.delimiter
    lines = text.lines[start:]
    if delimiter == " ":
        return [line.split() for line in lines]
    if not any('"' in line for line in lines):
        return [line.split(delimiter) for line in lines]
    faults = []
    kept = []
    last = max((i for i, line in enumerate(lines) if line.strip()), default=-1)
    for i, line in enumerate(lines):
        if line.count('"') % 2:
            if i == last and not text.ended:
                line += '"'  # the file ends within this row, which is then left out
            else:
                faults.append(Fault("a quotation mark is not closed", text.path, start + i + 1, advice="Export the file again"))
        kept.append(line)
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))
    try:
        return list(csv.reader(kept, delimiter=delimiter, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(
            Fault(f"the rows cannot be cut into cells: {error}", text.path, advice="Export the file again")
        ) from None


@dataclass(frozen=True)
class _Block:
    """Rows below one header: 1-based line of that header, its label, and the places of its rows."""

    line: int
    label: str
    rows: list[int]


def _blocks(sheet: Sheet, rows: list[list[str]], start: int, keys: Sequence[int]) -> tuple[list[_Block], list[str]]:
    """Rows of numbers below each standing of the header; lines of text below a block are left out, among its rows refused."""
    text, names = sheet.text, list(sheet.names)
    header = split_line(text.lines[sheet.header_line - 1], sheet.delimiter) if sheet.header_line else []
    blocks = [_Block(sheet.header_line, _label(sheet, sheet.header_line - 1), [])]
    faults: list[Fault] = []
    apart: list[int] = []  # lines of text since the last row
    left_out: list[int] = []
    below: list[str] = []
    skip_units = False
    for i, row in enumerate(rows):
        if not any(c.strip() for c in row):
            continue
        kind = _kind(row, header, keys, len(names))
        if skip_units:
            skip_units = False
            if all(unit_of_cell(c) is not None for c in row):
                if sheet.units and [unit_of_cell(c) for c in row] != list(sheet.units):
                    raise InputError(
                        Fault(
                            "the units of this block differ from those of the first",
                            text.path,
                            start + i + 1,
                            advice="Export the file again, one record per file",
                        )
                    )
                continue
        if kind == "header":
            if apart and not blocks[-1].rows:
                line = start + apart[0] + 1
                message = (
                    f'"{text.lines[line - 1].strip()[:80]}" stands where the rows of the header in line {blocks[-1].line} begin'
                )
                raise InputError(Fault(message, text.path, line, 1, advice="Remove the line, or that header"))
            left_out += apart
            blocks.append(_Block(start + i + 1, _label(sheet, start + i), []))
            apart, skip_units = [], sheet.units_line is not None
        elif kind == "text":
            if _is_other_header(row) and _numbers_below(rows, i):
                below = _another_table(sheet, rows, i, start)
                break
            apart.append(i)
        else:
            if apart and blocks[-1].rows:
                faults += [
                    Fault(
                        f'"{text.lines[start + k].strip()[:80]}" stands among the rows',
                        text.path,
                        start + k + 1,
                        1,
                        advice="Remove the line",
                    )
                    for k in apart
                ]
            elif apart:
                left_out += apart
            apart = []
            blocks[-1].rows.append(i)
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))
    left_out += apart
    return blocks, [*_left_out(sheet, [start + i for i in left_out]), *below]


def _kind(row: Sequence[str], header: Sequence[str], keys: Sequence[int], width: int) -> str:
    """What a line is: "header" again, "row", or "text"."""
    key = keys[0] if keys else 0
    if min(width, 2) <= len(row) > key and is_numeric(row[key]):
        return "row"
    cells = [c.strip() for c in row]
    if cells == list(header):
        return "header"
    there = [cells[i] for i in keys if i < len(cells)]
    numbers = sum(is_numeric(c) or is_clock(c) for c in there)
    nothing = sum(is_missing(c) or is_over_range(c) for c in there)
    first = next((c for c in cells if c), "")
    worded = not (is_numeric(first) or is_over_range(first) or is_clock(first) or is_missing(first))
    if worded and len(cells) < width and not any(map(is_numeric, cells[2:])):
        return "text"  # `key,value` below the table
    if numbers == 0 and not (nothing and not worded):
        return "text"
    return "row"


def _is_other_header(row: Sequence[str]) -> bool:
    return sum(understand(c.strip()) is not None for c in row if c.strip()) >= 2


def _numbers_below(rows: list[list[str]], at: int) -> bool:
    below = [r for r in rows[at + 1 : at + 5] if any(c.strip() for c in r)][:2]
    return any(sum(is_numeric(c) for c in r) >= 2 for r in below)


def _another_table(sheet: Sheet, rows: list[list[str]], at: int, start: int) -> list[str]:
    """The note on a table of results below the record; a long one is refused."""
    n = sum(1 for r in rows[at + 1 :] if sum(is_numeric(c) for c in r) >= 2)
    line = start + at + 1
    if n >= FEW_ROWS:
        raise InputError(
            Fault(
                f"another table with other columns begins here, with {n} rows",
                sheet.text.path,
                line,
                advice="Save one record per file",
            )
        )
    return [f"a table of {n} row(s) from line {line} on left out"]


_SPECIMEN = re.compile(
    r"specimen|sample|test ?piece|probe\b|prüfling|prüfkörper|éprouvette|échantillon|probeta|muestra|试样|試験片|サンプル", re.I
)


def _label(sheet: Sheet, header: int) -> str:
    """The nearest line above a header that names a specimen, within eight lines."""
    for line in reversed(sheet.text.lines[max(header - 8, 0) : max(header, 0)]):
        if _SPECIMEN.search(line):
            return re.sub(r"[\t;,]+", " ", line.replace('"', "")).strip()[:60]
    return ""


def _one_specimen(
    sheet: Sheet,
    blocks: list[_Block],
    rows: list[list[str]],
    keys: Sequence[int],
    reading: Reading,
    *,
    has_side_by_side: bool,
) -> tuple[list[int], list[str]]:
    """Rows of the specimen asked for: all blocks if the record only repeats its header, one of them if each is a specimen."""
    if len(blocks) == 1:
        if reading.specimen not in (None, 1) and not has_side_by_side:
            raise InputError(no_such_specimen(sheet, reading))
        return blocks[0].rows, []
    if _time_goes_on(sheet, blocks, rows):
        note = f"the header stands {len(blocks)} times; time goes on from block to block: one record"
        return [i for b in blocks for i in b.rows], [note]
    listed = "; ".join(
        f"{k}: {b.label + ', ' if b.label else ''}header at line {b.line}, {len(b.rows)} rows" for k, b in enumerate(blocks, 1)
    )
    if reading.specimen is None:
        raise which_specimen(sheet, f"the file holds {len(blocks)} specimens ({listed})", len(blocks))
    if not 1 <= reading.specimen <= len(blocks):
        raise which_specimen(sheet, f"there is no specimen {reading.specimen} ({listed})", len(blocks))
    block = blocks[reading.specimen - 1]
    return block.rows, [f"specimen {reading.specimen} of {len(blocks)}: {block.label or f'header at line {block.line}'}"]


def _time_goes_on(sheet: Sheet, blocks: list[_Block], rows: list[list[str]]) -> bool:
    labels = {b.label for b in blocks if b.label}
    time = next((i for i, h in sheet.headings().items() if h.quantity == "time"), None)
    if time is None or len(labels) > 1:
        return False

    def number(row: list[str]) -> float | None:
        cell = row[time] if time < len(row) else ""
        marks = (sheet.declared_decimal,) if sheet.declared_decimal else (".", ",")
        return next((n for mark in marks if (n := parse_number(cell, mark)) is not None), None)

    ends = [(number(rows[b.rows[0]]), number(rows[b.rows[-1]])) for b in blocks]
    return all(last is not None and first is not None and first > last for (_, last), (first, _) in pairwise(ends))


def _check_width(sheet: Sheet, rows: list[list[str]], lines: IntArray, width: int) -> None:
    faults = []
    named = _n_named(sheet)
    widest = max(map(len, rows), default=0)
    if widest < named:
        # A cell too many among the names moves all columns behind it.
        raise InputError(
            Fault(
                f"the header names {named} columns, no row has more than {widest} cells",
                sheet.text.path,
                sheet.header_line or None,
                widest + 1,
                advice="Which names belong to which cells cannot be told: correct the header",
            )
        )
    for row, line in zip(rows, lines.tolist(), strict=True):
        if len(row) > width and any(c.strip() for c in row[width:]):
            advice = (
                "If the decimal mark is a comma too, export with semicolons between the columns"
                if sheet.delimiter == ","
                else "Remove what does not belong to the table"
            )
            faults.append(
                Fault(f"the row has {len(row)} cells, the header has {width}", sheet.text.path, line, width + 1, advice=advice)
            )
        elif sheet.delimiter == " " and len(row) < width:
            # Blanks cannot hold an empty cell's place.
            faults.append(
                Fault(
                    f"the row has {len(row)} cells between blanks, the header has {width}",
                    sheet.text.path,
                    line,
                    advice="Export with semicolons or tabs between the columns",
                )
            )
    if faults and sheet.delimiter == " " and len(faults) == 1 and lines[-1] == faults[0].line and not sheet.text.ended:
        return  # the file ends within its last row
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))


def _is_cut_short(sheet: Sheet, lines: IntArray) -> bool:
    """Whether the file ends within its last row: no line end, and fewer cells or another number of digits than above."""
    text = sheet.text
    if text.ended or any(line.strip() for line in text.lines[int(lines[-1]) :]):
        return False
    if len(lines) < 2 or text.lines[int(lines[-1]) - 1].count('"') % 2:
        return True
    *above, last = (split_line(text.lines[line - 1], sheet.delimiter) for line in lines[-20:].tolist())
    if len(last) != len(above[-1]):
        return True
    form = _digits(last[-1])
    return not form or {_digits(row[-1]) for row in above} != {form}


def _digits(cell: str) -> tuple[str, ...]:
    """The number of digits after each mark and in the exponent, which tells that none is missing; () without any."""
    return tuple("0" * len(part) for part in re.split(r"[.,]|[eE][+-]?", cell)[1:])
