"""From the lines of a lab file to a `Sheet`: header cells, units, and the data cells of one record as text, by column."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError
from calib.instruments.labtable import IntArray, Reading
from calib.instruments.numbers import are_all_numbers, is_clock, is_missing, is_numeric, is_over_range, parse_number
from calib.instruments.text import LabText
from calib.instruments.units import is_unit_of
from calib.instruments.vocabulary import EXAMPLE, Heading, understand, understood_names, unit_of_cell, words

#: Delimiters tried, in the order in which a draw is decided; a blank stands for runs of blanks.
DELIMITERS = ("\t", ";", ",", " ")

# The header of a lab file lies near its top; further down only a second block would be found.
_HEADER_WITHIN = 2000
# More columns than any instrument writes.
_WIDEST = 400
# Rows below a header that are looked at to tell a table of results from a record, and rows of a second table that are too many
# to be left out as one of results.
_ROWS_SEEN = 30
_FEW_ROWS = 10


@dataclass(frozen=True, eq=False)
class Sheet:
    """One record of a lab file, cut into cells.

    Attributes
    ----------
    text : the file.
    delimiter : between cells, a blank for runs of blanks.
    header_line, names : 1-based line of the header row and its cells, stripped; line 0 and numbers for a table without header.
    units_line, units : 1-based line of the units row and its units, "" where a cell is empty; None and () without a units row.
    declared_units : quantity -> (unit, 1-based line) as declared above the header.
    declared_decimal : decimal mark as declared above the header, "" if it is not.
    assigned : column -> quantity, as the user asked.
    columns : data cells, a sequence of (n_row,) for each name.
    lines : 1-based line of each row, shape (n_row,).
    cut_short : whether the file ends within the last row.
    n_header : how often the header stands in the record.
    notes : what was left out while cutting.
    """

    text: LabText
    delimiter: str
    header_line: int
    names: tuple[str, ...]
    units_line: int | None
    units: tuple[str, ...]
    declared_units: Mapping[str, tuple[str, int]]
    declared_decimal: str
    assigned: Mapping[int, str]
    columns: tuple[Sequence[str], ...]
    lines: IntArray
    cut_short: bool
    n_header: int
    notes: tuple[str, ...]

    @property
    def prelude(self) -> tuple[str, ...]:
        """The lines above the header."""
        return self.text.lines[: max(self.header_line - 1, 0)]

    def unit_below(self, column: int) -> str:
        """Unit of a column in the units row, "" if there is none."""
        return self.units[column] if column < len(self.units) else ""

    def headings(self) -> dict[int, Heading]:
        """Which columns are understood, and as what: cell index -> heading. What the user assigned goes first."""
        found: dict[int, Heading] = {}
        for index, name in enumerate(self.names):
            if index in self.assigned:
                heading = understand(name, self.unit_below(index))
                unit = heading.unit if heading is not None else _bracketed(name)
                found[index] = Heading(self.assigned[index], 0, words(name), unit)
            elif name:
                understood = understand(name, self.unit_below(index))
                if understood is not None and understood.quantity not in self.assigned.values():
                    found[index] = understood
        return found


def _bracketed(name: str) -> str | None:
    match = re.search(r"[(\[]([^()\[\]]*)[)\]]\s*$", name)
    return match[1].strip() or None if match else None


def split_line(line: str, delimiter: str) -> list[str]:
    """Cells of one line, quotes taken off, stripped; a blank as delimiter stands for runs of blanks.

    >>> split_line('"","1,000.06200","0.5"', ",")
    ['', '1,000.06200', '0.5']
    """
    if delimiter == " ":
        return line.split()
    if '"' in line:
        try:
            return [c.strip() for c in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
        except csv.Error:
            pass
    return [c.strip() for c in line.split(delimiter)]


def cut(text: LabText, reading: Reading) -> Sheet:
    """Find delimiter, header and units row of a lab file and cut one record into cells.

    The header is the line near the top below which most rows of numbers stand in columns that are understood, whatever stands
    above it. Where it stands again, the record goes on if time does; otherwise another specimen begins there. Specimens may
    also stand side by side. A table without a header is read if the user says which of its columns are what, by number.

    Raises
    ------
    InputError
        If no header is found, no row follows it, another table follows, a row is wider than the header, or the file
        holds several specimens and `reading` does not say which.
    """
    found = _find_header(text, reading)
    if found is None:
        if reading.columns and all(c.isdigit() for c in reading.columns.values()):
            return _without_header(text, reading)
        raise InputError(_no_header(text, reading))
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
        _declared_units(text.lines[:header]),
        _declared_decimal(text.lines[:header]),
        MappingProxyType(assigned),
        (),
        np.zeros(0, dtype=np.int64),
        cut_short=False,
        n_header=1,
        notes=(),
    )
    above = _rows_above(sheet, reading)
    sheet, side_notes = _side_by_side(sheet, reading)
    whole = _with_rows(sheet, start, reading, side_notes)
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


# ------------------------------------------------------------------------------------------------------------- the header


def _header_cells(line: str, delimiter: str) -> Iterator[list[str]]:
    """The ways in which a line may be cut into header cells."""
    if delimiter != " ":
        if delimiter in line:
            yield split_line(line, delimiter)
        return
    if re.search(r"\S\s{2,}\S", line.strip()):
        yield [c.strip() for c in re.split(r"\s{2,}", line.strip())]
    # A unit in brackets belongs to the name before it.
    yield re.findall(r"[^\s()\[\]]+(?:\s?[(\[][^()\[\]]*[)\]])?", line)


def _find_header(text: LabText, reading: Reading) -> tuple[str, int, list[str]] | None:
    wanted = set(reading.columns.values())
    best: tuple[int, int] = (0, 0)
    found: tuple[str, int, list[str]] | None = None
    for index, line in enumerate(text.lines[:_HEADER_WITHIN]):
        if not line.strip() or is_numeric(line) or not any(c.isalpha() for c in line):
            continue
        for delimiter in DELIMITERS:
            if delimiter == " " and found is not None and found[0] != " ":
                continue
            for cells in _header_cells(line, delimiter):
                if len(cells) > _WIDEST or any(map(is_numeric, cells[1:])):  # a first number may be the specimen's
                    continue
                known = [i for i, c in enumerate(cells) if c and (c in wanted or understand(c) is not None)]
                if not known:
                    continue
                rows = _rows_below(text, index, delimiter, len(cells), known)
                if len(known) < 2 and rows == 0:
                    continue
                score = (rows, len(known))
                if found is not None and rows and cells == found[2] and best[0]:
                    continue  # the header again
                if score > best and (rows or len(known) > best[1]):
                    best, found = score, (delimiter, index, cells)
    return found


def _rows_below(text: LabText, header: int, delimiter: str, width: int, known: Sequence[int]) -> int:
    """Rows of numbers below a header, at most `_ROWS_SEEN`, up to the next line of words after the first row."""
    rows = 0
    words_since = 0
    for line in text.lines[header + 1 : header + 4 * _ROWS_SEEN]:
        if not line.strip():
            continue
        cells = split_line(line, delimiter)
        numbers = sum(1 for i in known if i < len(cells) and (is_numeric(cells[i]) or is_clock(cells[i])))
        if numbers and (delimiter != " " or len(cells) == width) and len(cells) > 1:
            rows += 1
        elif rows:
            break
        else:
            words_since += 1
            if words_since > 3:
                break
        if rows >= _ROWS_SEEN:
            break
    return rows


def _no_header(text: LabText, reading: Reading) -> Fault:
    seen = _likely_header(text)
    found = f"; found {', '.join(seen[1])}" if seen else ""
    advice = "; ".join(f"{q}: {understood_names(q)}" for q in ("displacement", "force", "capacitance", "time"))
    replies = _reply_lines(text)
    if replies and not seen:
        return Fault(
            f"there is no header; the lines look like replies of {replies}, without a time and without the names of the values",
            text.path,
            advice="Log with a header, or say which column is what: --columns time=1 --columns capacitance=2, with --units",
        )
    return Fault(
        f"no header row with column names that are understood{found}",
        text.path,
        seen[0] if seen else None,
        advice=f'Name the columns for example "{EXAMPLE["time"]}", "{EXAMPLE["force"]}", or say which is what '
        f"(--columns force=2 --units force=N). Understood are {advice}",
    )


_BUS_REPLY = re.compile(
    r"^\s*[+-]?\d\.\d+E[+-]\d+\s*,\s*[+-]?\d\.\d+E[+-]\d+\s*,\s*[+-]?\d+\s*(?:,\s*[+-]?\d+)?\s*$", re.IGNORECASE
)


def _reply_lines(text: LabText) -> str:
    lines = [line for line in text.lines[:20] if line.strip()]
    if lines and all(_BUS_REPLY.match(line) for line in lines):
        return "a Keysight E4980A (value, value, status)"
    return ""


def _likely_header(text: LabText) -> tuple[int, list[str]] | None:
    # The last line of words above the first line of numbers: what the user would call the header.
    above: tuple[int, list[str]] | None = None
    for index, line in enumerate(text.lines[:_HEADER_WITHIN]):
        for delimiter in DELIMITERS[:-1]:
            cells = [c for c in split_line(line, delimiter) if c]
            if len(cells) < 2:
                continue
            if sum(is_numeric(c) for c in cells) >= 2:
                return above
            above = (index + 1, [f'"{c[:40]}"' for c in cells[:12]])
            break
    return above


def _without_header(text: LabText, reading: Reading) -> Sheet:
    """A table of numbers only, with the columns that the user names by number."""
    last = max(int(c) for c in reading.columns.values())
    for index, line in enumerate(text.lines[:_HEADER_WITHIN]):
        for delimiter in DELIMITERS:
            cells = split_line(line, delimiter)
            chosen = [cells[int(c) - 1] for c in reading.columns.values()] if 0 < last <= len(cells) else []
            if chosen and all(is_numeric(c) or is_clock(c) or is_over_range(c) for c in chosen):
                names = tuple(str(i + 1) for i in range(len(cells)))
                sheet = Sheet(
                    text,
                    delimiter,
                    0,
                    names,
                    None,
                    (),
                    MappingProxyType({}),
                    "",
                    MappingProxyType(_assigned(reading, names, text, index + 1)),
                    (),
                    np.zeros(0, dtype=np.int64),
                    cut_short=False,
                    n_header=0,
                    notes=(),
                )
                return _with_rows(sheet, index, reading, ())
    raise InputError(_no_header(text, replace(reading, columns={})))


# ------------------------------------------------------------------------------------------- what stands above the header

_UNIT_WORD = re.compile(
    r"^(?:units?|einheit(?:en)?|unité[s]?|unidad(?:es)?|单位|単位)$|\b(?:unit|units|einheit|unité|unidad)\b|单位|単位", re.I
)


def _declared_units(lines: Sequence[str]) -> Mapping[str, tuple[str, int]]:
    """Units declared above the header: `Units : Force,kN`, `Unit Force;kN`, `Force unit: kN`."""
    declared: dict[str, tuple[str, int]] = {}
    for number, line in enumerate(lines[-200:], max(len(lines) - 200, 0) + 1):
        if not _UNIT_WORD.search(line) or len(line) > 200:
            continue
        parts = [p.strip().strip('"') for p in re.split(r"[\t;,:=]|\s{2,}", line) if p.strip().strip('"')]
        parts = [_UNIT_WORD.sub("", p).strip() for p in parts]
        parts = [p for p in parts if p]
        for name, written in pairwise(parts):
            unit = written[1:-1] if written[:1] + written[-1:] in ("()", "[]") else written
            heading = understand(name) or understand(name, unit)
            if heading is not None and is_unit_of(unit, heading.quantity):
                declared[heading.quantity] = (unit, number)
    return MappingProxyType(declared)


# `MTS793|MPT|DEU|1|0|,|.|:|...`: the sixth field is the decimal mark.
_MTS = re.compile(r"^\ufeff?MTS793\|[^|]*\|[^|]*\|[^|]*\|[^|]*\|(?P<mark>[.,])\|")
_DECIMAL_WORDS = re.compile(
    r"^\W*(?:decimal (?:mark|separator|sign|symbol)|dezimal(?:trennzeichen|zeichen)|séparateur décimal|separador decimal)\W*"
    r"[\s:;,=\t\"]\W*?(?P<mark>[.,]|comma|komma|point|punkt|dot)\"?\s*$",
    re.IGNORECASE,
)


def _declared_decimal(lines: Sequence[str]) -> str:
    for line in lines[-200:]:
        match = _MTS.match(line) or _DECIMAL_WORDS.match(line)
        if match:
            mark = match["mark"].lower()
            return mark if mark in ".," else "," if mark in ("comma", "komma") else "."
    return ""


def _rows_above(sheet: Sheet, reading: Reading) -> tuple[str, ...]:
    """The note on rows of numbers above the header, as of a table of results; many of them, or specimens, are refused."""
    rows = []
    for number, line in enumerate(sheet.prelude, 1):
        cells = [c for c in split_line(line, sheet.delimiter) if c]
        if len(cells) > 1 and all(map(is_numeric, cells)):
            rows.append(number)
    if not rows:
        return ()
    if len(rows) >= _FEW_ROWS or reading.specimen is not None:
        raise InputError(
            Fault(
                f"{len(rows)} rows of numbers stand above the header of line {sheet.header_line}, under none understood",
                sheet.text.path,
                rows[0],
                advice="Save one record per file, or correct the header above these rows",
            )
        )
    return (f"{len(rows)} row(s) of numbers above the header left out, the first in line {rows[0]}",)


# --------------------------------------------------------------------------------------------------------------- specimens


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
    period = min(np.diff(at)[0] for at in repeated.values())
    if any(np.any(np.diff(at) != period) for at in repeated.values()):
        return sheet, ()
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
        raise _which_specimen(sheet, f"{count} specimens stand side by side ({listed})", count)
    if not 1 <= reading.specimen <= count:
        raise _which_specimen(sheet, f"there is no specimen {reading.specimen}, {count} stand side by side", count)
    own = range(first + (reading.specimen - 1) * period, first + reading.specimen * period)
    shared = set(range(len(sheet.names))) - set(range(first, first + count * period))
    names = tuple(n if i in own or i in shared else "" for i, n in enumerate(sheet.names))
    note = f"specimen {reading.specimen} of {count} side by side: columns {own.start + 1} to {own.stop}"
    return replace(sheet, names=names), (note,)


def _no_such_specimen(sheet: Sheet, reading: Reading) -> Fault:
    return Fault(f"there is no specimen {reading.specimen}: the file holds one", sheet.text.path, sheet.header_line or None)


class SeveralSpecimens(InputError):
    """A file that holds `count` specimens, of which none was chosen, or one that is not there."""

    def __init__(self, fault: Fault, count: int) -> None:
        super().__init__(fault)
        self.count = count


def _which_specimen(sheet: Sheet, message: str, count: int) -> SeveralSpecimens:
    advice = (
        f"Say which one: --specimen 1 to --specimen {count} (in an experiment file: specimen = 1), or export one specimen "
        "per file"
    )
    return SeveralSpecimens(Fault(message, sheet.text.path, sheet.header_line, advice=advice), count)


# -------------------------------------------------------------------------------------------------------------------- rows


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


def _even_columns(sheet: Sheet, start: int, keys: Sequence[int]) -> tuple[tuple[Sequence[str], ...], int] | None:
    """Columns, and the number of rows, where every line is a row of numbers as wide as the header; None where one is not.

    The common case, and the only one in which a file of a million rows is cut in a second.
    """
    lines = sheet.text.lines[start:]
    while lines and not lines[-1].strip():
        lines = lines[:-1]
    width, delimiter = len(sheet.names), sheet.delimiter
    if not lines or not keys or delimiter == " ":
        return None
    body = "\n".join(lines)
    if '"' in body:
        if any(line.count('"') % 2 for line in lines):
            return None
        cells: list[str] = []
        try:
            for row in csv.reader(lines, delimiter=delimiter, skipinitialspace=True):
                if len(row) != width:
                    return None
                cells += row
        except csv.Error:
            return None
    else:
        if {line.count(delimiter) for line in lines} != {width - 1}:
            return None
        cells = body.replace(delimiter, "\n").split("\n")
    if not are_all_numbers(cells[keys[0] :: width]):
        return None
    return tuple(cells[i::width] for i in range(width)), len(lines)


def _with_rows(sheet: Sheet, start: int, reading: Reading, notes: tuple[str, ...]) -> Sheet:
    keys = [i for i, h in sheet.headings().items() if h.quantity != "status"]
    even = _even_columns(sheet, start, keys)
    if even is not None:
        columns, n_row = even
        if reading.specimen not in (None, 1) and not notes:
            raise InputError(_no_such_specimen(sheet, reading))
        last = [[column[k] for column in columns] for k in range(max(n_row - 20, 0), n_row)]
        lines = start + 1 + np.arange(n_row, dtype=np.int64)
        return replace(sheet, columns=columns, lines=lines, cut_short=_is_cut_short(sheet, last, lines), notes=notes)
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
    kept, block_notes, n_header = _one_specimen(sheet, blocks, rows, keys, reading, has_side_by_side=bool(notes))
    width = len(sheet.names)
    chosen = [rows[i] for i in kept]
    lines = np.array(kept, dtype=np.int64) + start + 1
    _check_width(sheet, chosen, lines, width)
    short = _is_cut_short(sheet, chosen, lines)
    full = [row[:width] if len(row) >= width else row + [""] * (width - len(row)) for row in chosen]
    # Rows without anything at the end: the other specimens, or the software's own.
    while full and not any(full[-1][i].strip() for i in keys):
        full.pop()
    if not full:
        raise InputError(Fault("all rows are empty", sheet.text.path, sheet.header_line, advice="Export the raw data too"))
    columns = tuple(zip(*full, strict=True))
    return replace(
        sheet,
        columns=columns,
        lines=lines[: len(full)],
        cut_short=short and len(full) == len(lines),
        n_header=n_header,
        notes=(*notes, *block_notes, *more),
    )


def _blocks(sheet: Sheet, rows: list[list[str]], start: int, keys: Sequence[int]) -> tuple[list[_Block], list[str]]:
    """Rows of numbers below each standing of the header; lines of text below a block are left out, among its rows refused."""
    text, names = sheet.text, list(sheet.names)
    header = split_line(text.lines[sheet.header_line - 1], sheet.delimiter) if sheet.header_line else []
    first = keys[0] if keys else 0
    blocks = [_Block(sheet.header_line, _label(sheet, sheet.header_line - 1), [])]
    faults: list[Fault] = []
    apart: list[int] = []  # lines of text since the last row
    left_out: list[int] = []
    skip_units = False
    for i, row in enumerate(rows):
        if not row or not any(c.strip() for c in row):
            continue
        if first < len(row) and is_numeric(row[first]) and len(row) >= min(len(names), 2):
            kind = "row"
        else:
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
                return blocks, _another_table(sheet, rows, i, start, [*left_out, *apart])
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
    notes = []
    if left_out:
        shown = text.lines[start + left_out[0]].strip()[:80]
        notes.append(f'{len(left_out)} line(s) of text left out, the first is "{shown}" (line {start + left_out[0] + 1})')
    return blocks, notes


def _kind(row: Sequence[str], header: Sequence[str], keys: Sequence[int], width: int) -> str:
    """What a line is: "header" again, "row", or "text"."""
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


def _another_table(sheet: Sheet, rows: list[list[str]], at: int, start: int, left_out: list[int]) -> list[str]:
    """The note on a table of results below the record; a long one is refused."""
    n = sum(1 for r in rows[at + 1 :] if sum(is_numeric(c) for c in r) >= 2)
    line = start + at + 1
    if n >= _FEW_ROWS:
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
) -> tuple[list[int], list[str], int]:
    """Rows of the specimen asked for: all blocks if the record only repeats its header, one of them if each is a specimen."""
    if len(blocks) == 1:
        if reading.specimen not in (None, 1) and not has_side_by_side:
            raise InputError(_no_such_specimen(sheet, reading))
        return blocks[0].rows, [], 1
    if _time_goes_on(sheet, blocks, rows):
        note = f"the header stands {len(blocks)} times; time goes on from block to block: one record"
        return [i for b in blocks for i in b.rows], [note], len(blocks)
    listed = "; ".join(
        f"{k}: {b.label + ', ' if b.label else ''}header at line {b.line}, {len(b.rows)} rows" for k, b in enumerate(blocks, 1)
    )
    if reading.specimen is None:
        raise _which_specimen(sheet, f"the file holds {len(blocks)} specimens ({listed})", len(blocks))
    if not 1 <= reading.specimen <= len(blocks):
        raise _which_specimen(sheet, f"there is no specimen {reading.specimen} ({listed})", len(blocks))
    block = blocks[reading.specimen - 1]
    return block.rows, [f"specimen {reading.specimen} of {len(blocks)}: {block.label or f'header at line {block.line}'}"], 1


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
    named = max((i + 1 for i, name in enumerate(sheet.names) if name), default=0)
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


def _is_cut_short(sheet: Sheet, rows: list[list[str]], lines: IntArray) -> bool:
    """Whether the file ends within its last row: no line end, and fewer cells or another number of digits than above."""
    if sheet.text.ended or not len(lines) or any(line.strip() for line in sheet.text.lines[int(lines[-1]) :]):
        return False
    if len(rows) < 2 or sheet.text.lines[int(lines[-1]) - 1].count('"') % 2:
        return True
    last, above = rows[-1], rows[-2]
    if len(last) != len(above):
        return True
    form = _digits(last[-1].strip())
    return not form or {_digits(row[-1].strip()) for row in rows[-20:-1]} != {form}


def _digits(cell: str) -> tuple[str, ...]:
    """The number of digits after each mark and in the exponent, which tells that none is missing; () without any."""
    return tuple("0" * len(part) for part in re.split(r"[.,]|[eE][+-]?", cell)[1:])


def capped(faults: list[Fault], what: str, limit: int = 10) -> list[Fault]:
    """The first `limit` faults; if there are more, one further fault that counts all of them."""
    if len(faults) <= limit:
        return faults
    return [
        *faults[:limit],
        Fault(f"{len(faults)} {what} in all; the first {limit} are listed", faults[0].path, advice="Export the file again"),
    ]
