"""From the lines below the header, taken one by one, to the rows of one record: blocks, specimens, text between them."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise, takewhile

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.between import NUMBER_OF_PAGE, RUN, SPECIMEN, is_remark, names_another
from calib.lab.instruments.clock_cells import is_clock, is_reading
from calib.lab.instruments.header import DELIMITERS, split_blanks, split_line, width_of_row
from calib.lab.instruments.labtable import Reading, Unread
from calib.lab.instruments.lines import (
    FEW_ROWS,
    Table,
    is_other_header,
    is_result,
    kind_of_line,
    left_out,
    n_named,
    not_read,
    passed_over,
    says_nothing,
    short_rows,
)
from calib.lab.instruments.no_header import SAID_BY_NUMBER
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, parse_number
from calib.lab.instruments.odd_delimiters import parted_oddly
from calib.lab.instruments.quotes import check_quotes
from calib.lab.instruments.results import LINES_OF_RESULTS, only_results
from calib.lab.instruments.run_on import is_only_words, runs_on
from calib.lab.instruments.sheet import Sheet, which_specimen
from calib.lab.instruments.stated import speaks_of_scale, speaks_of_zero
from calib.lab.instruments.text import LabText
from calib.lab.instruments.titles import units_in_row
from calib.lab.instruments.touching import numbers_in_one
from calib.lab.instruments.unit_cells import unit_cell
from calib.lab.instruments.vocabulary import EXAMPLE, understand
from calib.lab.instruments.widths import check_width, remarks_beside, with_a_stray_cell, with_whole_remarks


def block_table(sheet: Sheet, start: int, keys: Sequence[int], reading: Reading) -> Table:
    """Find the rows of one record, line by line, where several blocks, specimens or lines of text stand below the header.

    Parameters
    ----------
    sheet : without rows.
    start : index of the first line below its header and units.
    keys : columns that are understood, by index.
    reading : what the user says of the file.

    Raises
    ------
    SeveralSpecimens
        If the blocks are several specimens and `reading` does not say which.
    InputError
        If there are no rows, text stands among them, they do not fit the header, or another table follows.
    """
    rows = _cells_of(sheet, start)
    blocks, more, unread = _blocks(sheet, rows, start, keys)
    blocks = [replace(b, label=b.label or _label(sheet, b.line - 1)) for b in blocks if b.rows]
    if not blocks:
        raise InputError(_without_rows(sheet))
    kept, block_notes, specimens = _one_specimen(sheet, blocks, rows, reading)
    other = [start + i for b in blocks if b.rows[0] not in kept for i in b.rows]
    unread += not_read(sheet, other, "rows of another specimen", words=False) if block_notes else []
    width = len(sheet.names)
    results = _labelled_results(rows, kept, width)
    unread += not_read(sheet, [start + i for i in results], "results below the rows, with their names in front", words=False)
    kept = [i for i in kept if i not in results]
    chosen = with_whole_remarks([rows[i] for i in kept], width, sheet.delimiter)
    lines = np.array(kept, dtype=np.int64) + start + 1
    beside = remarks_beside(chosen, width, sheet.delimiter)
    chosen = [row[:width] if i in beside else row for i, row in enumerate(chosen)]
    stray = with_a_stray_cell(chosen, width, sheet.delimiter)
    chosen = [[c for c in row if c.strip()] if i in stray else row for i, row in enumerate(chosen)]
    check_width(sheet, chosen, lines, width)
    short = short_rows({i: len(row) for i, row in enumerate(chosen) if len(row) != width}, len(chosen), width) | stray
    full = [row if len(row) == width else (row + [""] * width)[:width] for row in chosen]
    own = next(b for b in blocks if b.rows[0] in kept)
    units = own.units if own.units is not None and own.units_line != sheet.units_line else None
    notes = [*block_notes, *more]
    columns = [*zip(*full, strict=True)]
    if beside:
        columns.append(tuple(beside.get(i, "") for i in range(len(full))))
        first = min(beside)
        shown = f'the first is "{beside[first][:60]}" (line {lines[first]})'
        notes.append(f"{len(beside)} row(s) have a remark behind their last cell, under no name, which is no reading: {shown}")
    return Table(columns, lines, notes, tuple(unread), short, units, own.units_line, specimens)


def _labelled_results(rows: list[list[str]], kept: Sequence[int], width: int) -> list[int]:
    """The last rows whose cells stand one column to the right, behind a word such as "Mean", in rows without one."""
    found: list[int] = []
    for i in reversed(kept):
        row = rows[i]
        if len(row) != width + 1 or not is_result(row[0]) or not all(is_numeric(c) or is_missing(c) for c in row[1:]):
            break
        found.insert(0, i)
    return found if len(found) < len(kept) and len(rows[kept[-1 - len(found)]]) == width else []


# Lines below a header among which a row of numbers between another mark than its names is looked for.
_NEXT = 20


def _without_rows(sheet: Sheet) -> Fault:
    """The fault of a header without rows, or whose names are not understood as those of the columns of numbers below it."""
    first = sheet.header_line
    if (odd_delimiter := parted_oddly(sheet.text.path, sheet.text.lines)) is not None:
        return odd_delimiter
    widths = {i: width_of_row(line) for i, line in enumerate(sheet.text.lines[first : first + _NEXT], first + 1)}
    row, width = next(((i, n) for i, n in widths.items() if n > 1), (0, 0))
    below = enumerate(sheet.text.lines[first : first + _NEXT], first + 1)
    line, touching = next(((i, found) for i, words in below if (found := numbers_in_one(words))), (0, ""))
    if not row and touching:
        message = (
            f'"{touching}" is several numbers that touch each other, and where each ends cannot be told by the other lines'
        )
        advice = (
            "Export the file again with wider columns or a mark between them; or, if each sign begins a number, put a blank "
        )
        advice += f"before it: sed -E 's/([0-9])([-+])/\\1 \\2/g' {shlex.quote(str(sheet.text.path))} > parted.txt"
        return Fault(message, sheet.text.path, line, advice=advice)
    if not row:
        message, advice = "there is a header but no row of numbers below it", "Export the raw data too"
    else:
        message = f"the names are not understood as those of the {width} columns of numbers that begin in line {row}"
        advice = (
            f"Say of each column by its number what it is, and its unit, for example {SAID_BY_NUMBER}; or write names such as "
            f'{EXAMPLE["time"]}", "{EXAMPLE["displacement"]}", "{EXAMPLE["force"]}", "{EXAMPLE["capacitance"]}"'
        )
    return Fault(message, sheet.text.path, sheet.header_line, advice=advice)


def _cells_of(sheet: Sheet, start: int) -> list[list[str]]:
    """Cells of every line from `start` on; faults for quotation marks that are not closed."""
    text, delimiter = sheet.text, sheet.delimiter
    lines = list(text.lines[start:])
    if delimiter == " ":
        return [split_blanks(line) for line in lines]
    if not any('"' in line for line in lines):
        return [line.split(delimiter) for line in lines]
    last = max((i for i, line in enumerate(lines) if line.strip()), default=-1)
    if last >= 0 and not text.ended and lines[last].count('"') % 2:
        lines[last] += '"'  # the file ends within this row, which is then left out
    check_quotes(text, delimiter, start, lines)
    try:
        return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(
            Fault(f"the rows cannot be cut into cells: {error}", text.path, advice="Export the file again")
        ) from None


@dataclass(frozen=True)
class _Block:
    """Rows below one header: its 1-based line, label, places of its rows, units below it and their line (None without)."""

    line: int
    label: str
    rows: list[int]
    units: tuple[str, ...] | None = None
    units_line: int | None = None


def _blocks(
    sheet: Sheet, rows: list[list[str]], start: int, keys: Sequence[int]
) -> tuple[list[_Block], list[str], list[Unread]]:
    """Rows of numbers below each standing of the header; lines of text below a block are left out, among its rows refused."""
    text, names = sheet.text, list(sheet.names)
    header = split_line(text.lines[sheet.header_line - 1], sheet.delimiter) if sheet.header_line else []
    first_units = sheet.units if sheet.units_line is not None else None
    blocks = [_Block(sheet.header_line, _numbered(header), [], first_units, sheet.units_line)]
    faults: list[Fault] = []
    apart: list[int] = []  # lines of text since the last row
    among_text: list[int] = []
    passed: list[int] = []
    run_on: list[int] = []  # indices of lines across which clock and press run on
    below: list[str] = []
    unread: list[Unread] = []
    skip_units = False
    # Indices of the last lines that hold something, the very last first.
    last = [*islice((k for k in range(len(rows) - 1, -1, -1) if any(c.strip() for c in rows[k])), LINES_OF_RESULTS)]
    head = _of_a_head(rows, [kind_of_line(row, header, keys, len(names)) for row in rows[:_LONGEST_HEAD]])
    for i, row in enumerate(rows):
        if not any(c.strip() for c in row):
            continue
        if says_nothing(row, len(names)):
            passed.append(start + i)
            continue
        of_page = _begins_with_a_word(row) and NUMBER_OF_PAGE.search(" ".join(" ".join(row).split())) is not None
        kind = "text" if i < head or of_page else kind_of_line(row, header, keys, len(names))
        if skip_units:
            skip_units = False
            own = [unit_cell(c) for c in row]
            if all(cell is not None for cell in own):
                units = tuple("" if cell is None else cell.unit for cell in own)
                blocks[-1] = replace(blocks[-1], units=units, units_line=start + i + 1)
                continue
        if kind == "header":
            if apart and not blocks[-1].rows:
                line = start + apart[0] + 1
                message = (
                    f'"{text.lines[line - 1].strip()[:80]}" stands where the rows of the header in line {blocks[-1].line} begin'
                )
                raise InputError(Fault(message, text.path, line, 1, advice="Remove the line, or that header"))
            among_text += apart
            blocks.append(_Block(start + i + 1, _numbered(row), []))
            above = units_in_row(rows[apart[-1]], names) if apart else None
            if above is not None:
                blocks[-1] = replace(blocks[-1], units=above, units_line=start + apart[-1] + 1)
            apart, skip_units = [], sheet.units_line is not None and sheet.units_line > sheet.header_line
        elif kind == "text":
            late = i >= last[-1]
            other = is_other_header(row) or (late and _heads_results(sheet, rows, i, blocks[-1].rows))
            if other and _numbers_below(rows, i):
                _check_other_units(sheet, row, start + i)
                below = _another_table(sheet, rows, i, start)
                unread = not_read(sheet, range(start + i, start + last[0] + 1), "another table", words=False)
                break
            results = late and only_results(sheet, rows, i, blocks[-1].rows, keys)
            if results and not (i + 1 < len(rows) and _heads_results(sheet, rows, i + 1, blocks[-1].rows)):
                first = (apart or [i])[0]
                shown = text.lines[start + first].strip()[:80]
                below = [f'results below the rows are left out, from "{shown}" (line {start + first + 1}) on']
                unread = not_read(sheet, range(start + first, start + last[0] + 1), "results below the rows", words=False)
                apart = []
                break
            apart.append(i)
        else:
            remarks = [k for k in apart if is_remark(text.lines[start + k])]
            if blocks[-1].rows:
                faults += [_of_scale(text, start + k) for k in remarks if speaks_of_scale(text.lines[start + k])]
            if remarks and blocks[-1].rows:
                among_text += remarks
                apart = [k for k in apart if k not in remarks]
            numbers = next((k for k in apart if _is_of_numbers(text.lines[start + k])), None)
            if numbers is not None and blocks[-1].rows:
                raise InputError(_other_names_needed(sheet, start + numbers))
            lone = text.lines[start + apart[0]] if len(apart) == 1 and len(run_on) < _REMARKS else ""
            if lone and blocks[-1].rows and _runs_on(sheet, rows, lone, blocks[-1].rows, i):
                among_text += apart
                run_on.append(start + apart[0])
                apart = []
            if apart and blocks[-1].rows:
                faults += [
                    Fault(
                        f'"{text.lines[start + k].strip()[:80]}" stands among the rows',
                        text.path,
                        start + k + 1,
                        1,
                        advice="If a zero was set anew there, write # before it, and rows of one zero are used together; "
                        "else remove the line"
                        if speaks_of_zero(text.lines[start + k])
                        else _ANOTHER_RUN,
                    )
                    for k in apart
                ]
            elif apart:
                among_text += apart
            apart = []
            blocks[-1].rows.append(i)
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))
    among_text += apart
    lines = [start + i for i in sorted(among_text)]
    require_no_other_rows(sheet, lines, sum(len(b.rows) for b in blocks))
    if run_on:
        shown = f'"{text.lines[run_on[0]].strip()[:80]}" in line {run_on[0] + 1}'
        others = f" and {len(run_on) - 1} more line(s) are taken for remarks" if len(run_on) > 1 else " is taken for a remark"
        below.append(f"{shown}{others}: time goes on across it at its pace, and so do the readings")
    return blocks, [*left_out(sheet, lines), *passed_over(sheet, passed), *below], [*not_read(sheet, lines, "text"), *unread]


def _runs_on(sheet: Sheet, rows: list[list[str]], line: str, above: Sequence[int], first: int) -> bool:
    """Whether a line of words, of no run or specimen, stands among rows that go on: those `above`, and from `first` on."""
    if SPECIMEN.search(line) or RUN.search(line) or not is_only_words(line):
        return False
    quantities = {i: h.quantity for i, h in sheet.headings.items() if h.quantity != "status"}
    key = min(quantities)
    below = takewhile(lambda row: key < len(row) and is_reading(row[key]), rows[first : first + _BESIDE])
    return runs_on(
        quantities,
        [rows[k] for k in above[-_BESIDE:]],
        list(below),
        lambda k: [row[k] for row in rows if k < len(row)],
        sheet.declared_decimal,
    )


def _of_a_head(rows: Sequence[Sequence[str]], kinds: Sequence[str]) -> int:
    """The number of lines above the first row that begins without a word, if one of them is text: `"HOffset",0,0` is no row."""
    n = next((i for i, row in enumerate(rows) if any(c.strip() for c in row) and not _begins_with_a_word(row)), 0)
    return n if n <= _LONGEST_HEAD and "text" in kinds[:n] and "header" not in kinds[:n] else 0


def _begins_with_a_word(row: Sequence[str]) -> bool:
    first = row[0].strip() if row else ""
    return first[:1].isalpha() and not (is_missing(first) or is_over_range(first) or is_clock(first))


def _is_of_numbers(line: str) -> bool:
    """Whether a line holds several numbers and nothing else, however they are parted."""
    cells = [c for c in re.split(r"[\t;,|\s]+", line.strip()) if c]
    return len(cells) > 2 and all(map(is_numeric, cells))


def require_no_other_rows(sheet: Sheet, indices: Sequence[int], n_row: int) -> None:
    """Refuse rows of numbers among lines taken for text or for one cell, as where others part their cells, unless they are few.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0.
    n_row : rows that were read.

    Raises
    ------
    InputError
        If there are ten or more, or two that are a twentieth of the rows.
    """
    width = n_named(sheet)
    found = [
        i for i in indices if any(_is_row_between(sheet.text.lines[i], d, width) for d in DELIMITERS if d != sheet.delimiter)
    ]
    if len(found) < 2 or (len(found) < FEW_ROWS and len(found) < _FEW_OTHERWISE * n_row):
        return
    line = sheet.text.lines[found[0]].strip()
    message = (
        f'"{line[:60]}" and {len(found) - 1} more line(s) are rows of numbers whose cells are parted otherwise than those of '
        "the rows above"
    )
    advice = "Write one delimiter between the cells of all rows, or save the rows of each in a file of their own"
    raise InputError(Fault(message, sheet.text.path, found[0] + 1, advice=advice))


def _is_row_between(line: str, delimiter: str, width: int) -> bool:
    """Whether a line has as many numbers between delimiters as there are columns, and nothing else."""
    cells = split_line(line.strip(), delimiter)
    return (
        _ONE_NUMBER.fullmatch(line.strip()) is None
        and width > 1
        and len(cells) == width
        and all(is_numeric(c) or is_clock(c) for c in cells)
    )


def _other_names_needed(sheet: Sheet, at: int) -> Fault:
    """The refusal of rows that the line taken for the header does not part into cells, so that some seem to be text."""
    header = sheet.text.lines[sheet.header_line - 1].strip()[:60] if sheet.header_line else ""
    n_cell = len([c for c in re.split(r"[\t;,|\s]+", sheet.text.lines[at].strip()) if c])
    return Fault(
        f'"{sheet.text.lines[at].strip()[:80]}" is a row of numbers, and "{header}", taken for the header, names no such',
        sheet.text.path,
        at + 1,
        advice=f"Write one line of names with units above the rows, one for each of their {n_cell} cells, as in "
        '"Displacement (mm),Force (N)" of two, in the place of the lines there',
    )


# Lines between a header and its rows are no more than this.
_LONGEST_HEAD = 40
# Rows on either side of a line that show whether clock and press run on across it, and how many such lines are looked at.
_BESIDE, _REMARKS = 10, 20
# Rows whose cells are parted otherwise are fewer than this share of the others, or refused.
_FEW_OTHERWISE = 0.05
# A number by itself, its thousands set apart by blanks.
_ONE_NUMBER = re.compile(r"[-+]?\d{1,3}(?: \d{3})*(?:[.,]\d+)?|[-+]?\d+[.,]\d+(?:[eE][-+]?\d+)?")
_ANOTHER_RUN = (
    "If the rows below it are of another press or specimen, save them in a file of their own; if they go on, remove the line"
)


def _of_scale(text: LabText, at: int) -> Fault:
    return Fault(
        f'"{text.lines[at].strip()[:80]}" stands among the rows, and may say that those below are in another unit or range',
        text.path,
        at + 1,
        1,
        advice="If they are, write all rows in one unit, or save the rows of each unit in a file of their own; if it means "
        "nothing, remove the line",
    )


def _check_other_units(sheet: Sheet, row: Sequence[str], at: int) -> None:
    """Refuse a header below the rows that names the same quantities as that of the record: it goes on in other units."""
    own = {h.quantity for i, name in enumerate(sheet.names) if (h := understand(name, sheet.unit_below(i))) is not None}
    other = {h.quantity for c in row if (h := understand(c.strip())) is not None}
    if len(own) > 1 and own <= other and len(row) == len(sheet.names):
        shown = sheet.text.lines[at].strip()[:80]
        raise InputError(
            Fault(
                f'"{shown}" stands among the rows, and names the columns otherwise than the header in line {sheet.header_line}',
                sheet.text.path,
                at + 1,
                advice="Write all rows in the columns and units of one header, or save those below each in a file of their own",
            )
        )


def _numbers_below(rows: list[list[str]], at: int) -> bool:
    below = [r for r in rows[at + 1 : at + 5] if any(c.strip() for c in r)][:2]
    return any(sum(is_numeric(c) for c in r) >= 2 for r in below)


def _heads_results(sheet: Sheet, rows: list[list[str]], at: int, above: Sequence[int]) -> bool:
    """Whether a line of words names a few rows at the end of the file that do not go on from the record, behind a blank line.

    Parameters
    ----------
    sheet : the record, whose names are others.
    rows : cells of every line.
    at : which line.
    above : lines of the rows of the record.
    """
    cells = [c.strip() for c in rows[at] if c.strip()]
    filled_below = (rows[k] for k in range(at + 1, len(rows)) if any(c.strip() for c in rows[k]))
    below = list(islice(filled_below, FEW_ROWS))
    if not above or len(cells) < 2 or not 0 < len(below) < FEW_ROWS:
        return False
    time = next((i for i, h in sheet.headings.items() if h.quantity == "time"), None)
    apart = any(not any(c.strip() for c in r) for r in rows[above[-1] + 1 : at])
    words = not any(is_numeric(c) or is_clock(c) or is_missing(c) or is_over_range(c) for c in cells)
    if time is None or not (apart and words) or SPECIMEN.search(" ".join(cells[1:])) or set(cells) & set(sheet.names):
        return False
    filled = [[c for c in r if c.strip()] for r in below]
    numbered = len(cells) + (not rows[at][0].strip())  # rows may be numbered in a column without a name
    if any(len(r) not in (len(cells), numbered) or not any(map(is_numeric, r)) for r in filled):
        return False
    last, first = (_number_of(sheet, r, time) for r in (rows[above[-1]], below[0]))
    return last is not None and (first is None or first < last) and len(below) < len(above)


def _number_of(sheet: Sheet, row: Sequence[str], index: int) -> float | None:
    """The number in a cell of a row, None where there is none."""
    cell = row[index] if index < len(row) else ""
    marks = (sheet.declared_decimal,) if sheet.declared_decimal else (".", ",")
    return next((n for mark in marks if (n := parse_number(cell, mark)) is not None), None)


def _another_table(sheet: Sheet, rows: list[list[str]], at: int, start: int) -> list[str]:
    """The note on a table of results below the record; a long one is refused."""
    n = sum(1 for r in rows[at + 1 :] if sum(map(is_numeric, r)) >= 2)
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


def _numbered(header: Sequence[str]) -> str:
    """The specimen whose number stands in the first cell of a header."""
    return f"specimen {header[0].strip()}" if header and header[0].strip().isdecimal() else ""


def _label(sheet: Sheet, header: int) -> str:
    """The nearest line above a header that names a specimen, a sensor, a file or a run, within eight lines."""
    for line in reversed(sheet.text.lines[max(header - 8, 0) : max(header, 0)]):
        if names_another(line):
            named = re.sub(r"[\t;,]+", " ", line.replace('"', "")).strip()
            return NUMBER_OF_PAGE.sub("", named)[:60]
    return ""


def _one_specimen(
    sheet: Sheet,
    blocks: list[_Block],
    rows: list[list[str]],
    reading: Reading,
) -> tuple[list[int], list[str], int]:
    """Rows of the specimen asked for, and how many there are: all blocks if the record only repeats its header, else one."""
    if len(blocks) == 1:
        return blocks[0].rows, [], 1
    if _time_goes_on(sheet, blocks, rows):
        _check_same_units(sheet, blocks)
        note = f"the header stands {len(blocks)} times; time goes on from block to block: one record"
        return [i for b in blocks for i in b.rows], [note], 1
    listed = "; ".join(
        f"{k}: {b.label + ', ' if b.label else ''}header at line {b.line}, {len(b.rows)} rows" for k, b in enumerate(blocks, 1)
    )
    if reading.specimen is None:
        raise which_specimen(sheet, f"the file holds {len(blocks)} specimens ({listed})", len(blocks))
    if not 1 <= reading.specimen <= len(blocks):
        raise which_specimen(sheet, f"there is no specimen {reading.specimen} ({listed})", len(blocks))
    block = blocks[reading.specimen - 1]
    note = f"specimen {reading.specimen} of {len(blocks)}: {block.label or f'header at line {block.line}'}"
    return block.rows, [note], len(blocks)


def _check_same_units(sheet: Sheet, blocks: Sequence[_Block]) -> None:
    """Refuse blocks of one record in other units."""
    other = next((b for b in blocks if b.units is not None and sheet.units and b.units != sheet.units), None)
    if other is not None:
        raise InputError(
            Fault(
                f"the units of this block differ from those in line {sheet.units_line}, and time goes on from block to block",
                sheet.text.path,
                other.units_line,
                advice="Write all rows of the record in the same units, or save the blocks in files of their own",
            )
        )


def _time_goes_on(sheet: Sheet, blocks: list[_Block], rows: list[list[str]]) -> bool:
    time = next((i for i, h in sheet.headings.items() if h.quantity == "time"), None)
    if time is None or any(b.label not in ("", blocks[0].label) for b in blocks):
        return False

    ends = [(_number_of(sheet, rows[b.rows[0]], time), _number_of(sheet, rows[b.rows[-1]], time)) for b in blocks]
    return all(last is not None and first is not None and first > last for (_, last), (first, _) in pairwise(ends))
