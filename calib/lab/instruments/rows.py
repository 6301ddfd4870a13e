"""From a `Sheet` without rows to one with those of one record: as whole columns where they are alike, and a cut end."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import compress, repeat
from operator import contains

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.between import SPECIMEN
from calib.lab.instruments.blocks import block_table, require_no_other_rows
from calib.lab.instruments.clock_cells import is_clock, not_clocks
from calib.lab.instruments.going_on import in_blocks, rows_going_on
from calib.lab.instruments.header import split_blanks, split_line
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.lines import (
    Table,
    is_other_header,
    is_result,
    kind_of_line,
    left_out,
    n_named,
    n_needed,
    not_read,
    passed_over,
    says_nothing,
    short_rows,
)
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, not_numbers, parse_number
from calib.lab.instruments.quotes import is_misquoted
from calib.lab.instruments.remarks_apart import with_remarks_apart
from calib.lab.instruments.results import results_below
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.shifted import shifted_rows
from calib.lab.instruments.vocabulary import understand
from calib.lab.instruments.where import asked_name, listed_values
from calib.lab.instruments.widths import OF_STRAY
from calib.lab.instruments.worded import worded_rows

# A last column that is empty in so many rows is one that is not always filled.
_OFTEN = 0.05

# Lines of text below a table that may belong to it.
_FOOTER = 50
# Rows without a number at first that are looked at one by one where all others have one: so many, and this share.
_FEW_ODD, _SHARE_ODD = 100, 0.1
# Rows of results that may stand among or below those of a record.
_FEW_RESULTS = 8
# What the number of readings and their range are called beside their mean.
_BESIDE_RESULTS = ("range", "spannweite", "étendue", "rango", "n", "count", "counts", "number", "anzahl", "nombre")
#: How the reason of a row with a word such as "Mean" begins.
OF_RESULTS = "a row of results"
# A column without a name behind all others that has a cell in a larger share of the rows is one of the table.
_SHARE_BEYOND = 0.1
# A last column that is empty in a larger share of the rows is one that is filled more rarely.
_SHARE_OPEN = 0.4

#: The reason of a row whose last cell is missing.
NO_LAST_CELL = "no cell in the last column"


def with_rows(sheet: Sheet, start: int, reading: Reading, notes: tuple[str, ...]) -> Sheet:
    """Cut the lines below a header into the rows of one record.

    Parameters
    ----------
    sheet : without rows.
    start : index of the first line below its header and units.
    reading : what the user says of the file.
    notes : on a specimen chosen among columns, to stand before those made here; () if none was.

    Returns
    -------
    The sheet with its rows.

    Raises
    ------
    SeveralSpecimens
        If blocks below the header are several specimens and `reading` does not say which.
    InputError
        If there are no rows, text stands among them, they do not fit the header, or another table follows.
    """
    sheet = with_remarks_apart(sheet, start)
    keys = [i for i, h in sheet.headings.items() if h.quantity != "status"]
    table = _regular_table(sheet, start, keys)
    if table is None:
        table = block_table(sheet, start, keys, reading)
    sheet = replace(sheet, names=(*sheet.names, *[""] * (len(table.columns) - len(sheet.names))))
    if reading.specimen not in (None, 1) and not notes and table.specimens == 1:
        raise InputError(_no_such_specimen(sheet, table, reading))
    # Rows without anything at the end: the other specimens, or the software's own.
    n_line = len(table.lines)
    n_row = next((n for n in range(n_line, 0, -1) if any(table.columns[k][n - 1].strip() for k in keys)), 0)
    if n_row == 0:
        raise InputError(Fault("all rows are empty", sheet.text.path, sheet.header_line, advice="Export the raw data too"))
    beyond, ended, results = _beyond_the_names(sheet, table), _without_an_end(sheet, table), _of_results(table)
    moved = beyond | ended
    sound = rows_going_on(sheet, table, moved, whole=True)
    # What is empty in a row now and then may have been its first cell: it goes on by chance. Of many, all do or none. A block
    # is told by its ends.
    alone = ended.keys() - in_blocks(ended)
    sound -= alone if len(alone) < _OFTEN * len(table.lines) or not ended.keys() <= sound else set()
    # A word of results where a reading stands is no remark on a row that goes on.
    named = [
        table.columns[i] for i, heading in sheet.headings.items() if heading.quantity != "status" and i < len(table.columns)
    ]
    in_place = {r for r in results if any(is_result(column[r]) and not is_numeric(column[r]) for column in named)}
    sound |= rows_going_on(sheet, table, results.keys() - in_place, whole=False) - (ended.keys() - sound)
    worded = worded_rows(sheet, table, {*moved, *results})
    wide = shifted_rows(sheet, worded.without) | {r: why for r, why in (moved | results).items() if r not in sound}
    wide |= worded.reasons
    below = {r: why for r, why in results_below(sheet, table).items() if r not in wide}
    wide |= below
    tail = [
        f"{len(below)} row(s) at the end are left out: line {int(table.lines[r])}, {why}" for r, why in [*below.items()][:1]
    ]
    n_short = len(table.reasons)
    require_no_other_rows(sheet, [int(table.lines[r]) - 1 for r in table.reasons], n_line - n_short)
    first = int(table.lines[min(table.reasons)]) if n_short else 0
    fewer = "fewer or more" if any(OF_STRAY in why for why in table.reasons.values()) else "fewer"
    short = [f"{n_short} row(s) with {fewer} cells than most are left out, the first in line {first}"] if n_short else []
    if table.units is not None:
        sheet = replace(sheet, units=table.units, units_line=table.units_line)
    return replace(
        sheet,
        columns=tuple(column[:n_row] for column in table.columns),
        lines=table.lines[:n_row],
        cut_short=n_row == n_line and _is_cut_short(sheet, table.lines),
        notes=(*notes, *table.notes, *short, *tail, *worded.notes),
        reasons={r: why for r, why in (wide | dict(table.reasons)).items() if r < n_row},
        unread=(*sheet.unread, *table.unread),
    )


def _no_such_specimen(sheet: Sheet, table: Table, reading: Reading) -> Fault:
    """The fault of asking for another specimen than the one there is; where a column names specimens, how to choose by it."""
    message = f"there is no specimen {reading.specimen}: the file holds one"
    for index, name in enumerate(sheet.names):
        if not SPECIMEN.search(name) or understand(name) is not None:
            continue
        named = [c for c in dict.fromkeys(map(str.strip, table.columns[index])) if c]
        own = [c for c in named if parse_number(re.sub(r".*?(?=\d+\Z)", "", c), ".") == reading.specimen]
        if len(named) > 1:
            choice = Choice("where", tuple(own[:1] or named), asked_name(replace(sheet, columns=tuple(table.columns)), index))
            message = f'specimens are told apart by the column "{name}", which names {listed_values(named)}'
            advice = f"Leave the specimen out, and say it by the column: {choice}"
            return Fault(message, sheet.text.path, sheet.named_at, index + 1, advice, choice)
    return Fault(message, sheet.text.path, sheet.named_at, advice="Leave the specimen out")


def _beyond_the_names(sheet: Sheet, table: Table) -> dict[int, str]:
    """Rows with a cell behind the last named column where most have none: their cells may stand one place too far.

    Behind an empty cell it is a note beside the table, in whose columns nothing is missing.
    """
    found: dict[int, str] = {}
    n = n_named(sheet)
    for k, column in enumerate(table.columns[n:]):
        if not any(map(str.strip, set(column))):
            continue
        rows = [r for r, cell in enumerate(column) if cell.strip()]
        if k and len(rows) <= _SHARE_BEYOND * len(column):
            rows = [r for r in rows if not all(c[r].strip() for c in table.columns[:n])]
        if len(rows) <= _SHARE_BEYOND * len(column):
            found |= dict.fromkeys(rows, "more cells than the header has names")
    return found


def _without_an_end(sheet: Sheet, table: Table) -> dict[int, str]:
    """Rows without a cell in the last column with a name, where nearly all have one: theirs may stand one place too near.

    The cells of a workbook stand where they are.
    """
    if sheet.text.typed:
        return {}
    n = max((i + 1 for i, name in enumerate(sheet.names) if name and i not in sheet.set_aside), default=0)
    column = table.columns[n - 1] if n else []
    if not 0 < column.count("") <= _SHARE_OPEN * len(column):
        return {}
    without = np.flatnonzero(~np.fromiter(map(bool, map(str.strip, column)), np.bool_, len(column))).tolist()
    rows = [r for r in without if any(c[r].strip() for c in table.columns)]
    return dict.fromkeys(rows, NO_LAST_CELL) if len(rows) <= _SHARE_OPEN * len(column) else {}


def _of_results(table: Table) -> dict[int, str]:
    """Rows with a word such as "Mean" in one of their cells, where few have one: they were computed from the others."""
    found: dict[int, str] = {}
    for column in table.columns:
        wordy = any(c.strip() and not is_numeric(c) for c in column[:_FOOTER])
        start = 0 if wordy else max(len(column) - _FOOTER, 0)
        # Times of day and numbers, of which a column may have a million, have no letter, or begin and end with a digit.
        text = "\n".join(column[start:])
        lettered = not text.isascii() or text.lower() != text.upper()
        words = {c for c in column[start:] if not (c[:1].isdigit() and c[-1:].isdigit())} if lettered else set()
        result = {c for c in words if c.strip().isprintable() and is_result(c)}
        rows = [r for r in range(start, len(column)) if column[r] in result] if result else []
        # Of how many readings they were computed, and their range, stands beside them alone: "n" among "Mean" and "SD".
        for beside in (*rows, *reversed(rows)):
            near = (r for r in (beside - 1, beside + 1) if start <= r < len(column) and r not in rows)
            rows += [r for r in near if column[r].strip(" .:=").lower() in _BESIDE_RESULTS]
        rows = sorted(rows)
        if len(rows) <= max(_FEW_RESULTS, int(_SHARE_BEYOND * len(column))) and 2 * len(rows) < len(column):
            found |= {r: f'{OF_RESULTS}: "{column[r].strip()[:40]}"' for r in rows}
    return found


def _regular_table(sheet: Sheet, start: int, keys: Sequence[int]) -> Table | None:
    """Cut the one block of rows below the header, column by column; None where there may be more than one block.

    `block_table` looks at every line by itself; here whole columns are looked at, so that a file of a million rows is cut in a
    second. Rows without their first number are looked at one by one; text among the rows, another header or too many such rows
    are left to `block_table`.
    """
    if not keys:
        return None
    found = _end_of_rows(sheet, start, keys)
    if found is None:
        return None
    end, text_below = found
    lines = sheet.text.lines[start:end]
    alike = _cut_alike(sheet, lines)
    if alike is None:
        return None
    columns, lengths = alike
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
        elif kind_of_line(row, (), keys, len(columns)) != "row":
            return None
    if not np.all(kept):
        columns = [list(compress(column, kept.tolist())) for column in columns]
    places = np.cumsum(kept) - 1
    short = {int(places[i]): why for i, why in short_rows(lengths, len(lines), len(columns)).items() if kept[i]}
    require_no_other_rows(sheet, text_below, len(lines))
    without_words = [i for i in text_below if says_nothing(split_line(sheet.text.lines[i], sheet.delimiter), len(columns))]
    words = [i for i in text_below if i not in without_words]
    below = not_read(sheet, words, "text below the rows")
    notes = [*left_out(sheet, words), *passed_over(sheet, without_words)]
    return Table(columns, start + 1 + np.flatnonzero(kept), notes, below, short)


def _cut_alike(sheet: Sheet, lines: Sequence[str]) -> tuple[list[list[str]], dict[int, int]] | None:
    """As many columns of cells as the header has, missing cells empty, and the number of cells of rows with another number.

    None if a row is too wide or the header is.
    """
    delimiter, width = sheet.delimiter, len(sheet.names)
    if delimiter == " ":
        return _cut_each(map(split_blanks, lines), delimiter, width, n_needed(sheet))
    if not any(map(contains, lines, repeat('"'))):
        return _cut_at_once(lines, delimiter, width, n_needed(sheet))
    if width >= n_needed(sheet) and (quoted := _cut_at_quotes(lines, delimiter, width)) is not None:
        return quoted, {}
    if any(n % 2 for n in set(map(str.count, lines, repeat('"')))):
        return None
    rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True)
    alike = _cut_each(rows, delimiter, width, n_needed(sheet))
    # A cell whose quotation mark is open goes on in the next line.
    return alike if alike is not None and rows.line_num == len(lines) == len(alike[0][0]) else None


def _cut_at_quotes(lines: Sequence[str], delimiter: str, width: int) -> list[list[str]] | None:
    """The columns of lines of as many cells as the header has, all of them in quotes, with none within; None of any others."""
    between, text = f'"{delimiter}"', "\n".join(lines)
    if not text.startswith('"') or not text.endswith('"') or text.count('"\n"') != len(lines) - 1:
        return None
    if set(map(str.count, lines, repeat('"'))) != {2 * width} or set(map(str.count, lines, repeat(between))) != {width - 1}:
        return None
    inner = text[1:-1].replace('"\n"', between)
    if inner.count('"') != 2 * inner.count(between):
        return None
    cells = inner.split(between)
    return [cells[i::width] for i in range(width)] if any(map(str.strip, cells)) else None


def _cut_at_once(lines: Sequence[str], delimiter: str, width: int, least: int) -> tuple[list[list[str]], dict[int, int]] | None:
    """The columns of lines without quotes, as one text made as wide as the header in every line."""
    delimiters = list(map(str.count, lines, repeat(delimiter)))
    kinds = set(delimiters)
    lengths: dict[int, int] = {}
    if kinds != {width - 1}:
        others = np.flatnonzero(np.array(delimiters) != width - 1).tolist()
        lengths = {i: delimiters[i] + 1 for i in others}
        whole = list(lines)
        for i, n in lengths.items():
            if n < width:
                whole[i] += delimiter * (width - n)
                continue
            row = lines[i].split(delimiter)
            if any(map(str.strip, row[width:])):
                return None
            whole[i] = delimiter.join(row[:width])
        lines = whole
    # As wide as the widest line that is not blank.
    if not any(n + 1 >= least and line.replace(delimiter, "").strip() for n, line in zip(delimiters, lines, strict=True)):
        return None
    cells = delimiter.join(lines).split(delimiter)
    return [cells[i::width] for i in range(width)], lengths


def _cut_each(
    rows: Iterable[list[str]], delimiter: str, width: int, least: int
) -> tuple[list[list[str]], dict[int, int]] | None:
    """The columns of rows that are cut one by one."""
    cells: list[str] = []
    lengths: dict[int, int] = {}
    widest = 0
    try:
        for i, row in enumerate(rows):
            n = len(row)
            if n > widest and any(c.strip() for c in row):
                widest = n
            if n == width:
                cells += row
                continue
            if (n > 0 and delimiter == " ") or any(c.strip() for c in row[width:]):
                return None
            cells += (row + [""] * width)[:width]
            lengths[i] = n
    except csv.Error:
        return None
    return ([cells[i::width] for i in range(width)], lengths) if widest >= least else None


def _end_of_rows(sheet: Sheet, start: int, keys: Sequence[int]) -> tuple[int, list[int]] | None:
    """Index of the line behind the last row, and those of the lines of text below it; None if there is no row or much text."""
    text_below: list[int] = []
    width = len(sheet.names)
    for i in range(len(sheet.text.lines) - 1, start - 1, -1):
        line = sheet.text.lines[i]
        if not line.strip():
            continue
        row = split_line(line, sheet.delimiter)
        if kind_of_line(row, (), keys, width) == "row" and not _begins_otherwise(sheet, row, i, start):
            return i + 1, text_below[::-1]
        if len(text_below) > _FOOTER or is_other_header(row) or is_misquoted(line, sheet.delimiter):
            return None
        if any(row):
            text_below.append(i)
    return None


def _begins_otherwise(sheet: Sheet, row: Sequence[str], at: int, start: int) -> bool:
    """Whether a line begins with a word and that above it with a number, as a line of averages below the rows does."""
    above = next((line for line in reversed(sheet.text.lines[max(start, at - 8) : at]) if line.strip()), "")
    first = next(iter(split_line(above, sheet.delimiter)), "")
    word = row[0].strip()
    return word.isalpha() and not is_missing(word) and not is_over_range(word) and (is_numeric(first) or is_clock(first))


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
    """The number of digits after each mark and in the exponent, which shows that none is missing; () without any."""
    return tuple("0" * len(part) for part in re.split(r"[.,]|[eE][+-]?", cell)[1:])
