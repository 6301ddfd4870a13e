"""From the bytes of a lab file to a `Sheet`: header cells, units row and data cells as text, each row with its line number."""

from __future__ import annotations

import codecs
import csv
import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib.errors import Fault, InputError
from calib.instruments.labtable import IntArray
from calib.instruments.numbers import is_numeric, is_over_range
from calib.instruments.vocabulary import EXAMPLE, understand, understood_names, unit_of_cell

#: Delimiters tried, in the order in which a draw is decided.
DELIMITERS = ("\t", ";", ",")

# The header of a lab file lies near its top; further down only a second block would be found.
_HEADER_WITHIN = 400


@dataclass(frozen=True, eq=False)
class LabText:
    """A lab file as lines of text, with the hash of its bytes and the encoding that was used."""

    path: Path
    sha256: str
    encoding: str
    lines: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Sheet:
    """A lab file cut into cells.

    Attributes
    ----------
    text : the file.
    delimiter : between cells.
    header_line, names : 1-based line of the header row and its cells, stripped.
    units_line, units : 1-based line of the units row and its units, "" where a cell is empty; None and () without a units row.
    rows : data cells, one list per row, as wide as the header at most; quotes taken off, stripped.
    lines : 1-based line of each row, shape (n_row,).
    notes : what was left out while cutting.
    """

    text: LabText
    delimiter: str
    header_line: int
    names: tuple[str, ...]
    units_line: int | None
    units: tuple[str, ...]
    rows: list[list[str]]
    lines: IntArray
    notes: tuple[str, ...]

    @property
    def prelude(self) -> tuple[str, ...]:
        """The lines above the header."""
        return self.text.lines[: self.header_line - 1]

    def unit_below(self, column: int) -> str:
        """Unit of a column in the units row, "" if there is none."""
        return self.units[column] if column < len(self.units) else ""


def read_lab_text(path: Path) -> LabText:
    """The file as text: a byte order mark decides, then UTF-8, UTF-16 by its zero bytes, at last Latin-1.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, or is not text.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(Fault(f"cannot read the file: {error.strerror or error}", path)) from None
    if not data.strip(b"\r\n\t ,;\x00\xef\xbb\xbf\xff\xfe"):
        raise InputError(Fault("the file is empty", path, advice="Export it again from the instrument's software"))
    encoding, text = _decode(path, data)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return LabText(path, hashlib.sha256(data).hexdigest(), encoding, tuple(lines))


def _decode(path: Path, data: bytes) -> tuple[str, str]:
    if data.startswith(codecs.BOM_UTF8):
        order = ["utf-8-sig"]
    elif data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        order = ["utf-16"]
    elif b"\x00" in data[:1000]:
        order = ["utf-16-le" if data[1:2] == b"\x00" else "utf-16-be"]
    else:
        order = ["utf-8", "latin-1"]
    for encoding in order:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\x00" not in text:
            return encoding, text
    raise InputError(Fault("the file is not text", path, advice="Export a CSV file; workbooks and databases are not read"))


def split_line(line: str, delimiter: str) -> list[str]:
    """Cells of one line, quotes taken off, stripped.

    >>> split_line('"","1,000.06200","0.5"', ",")
    ['', '1,000.06200', '0.5']
    """
    if '"' in line:
        return [c.strip() for c in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
    return [c.strip() for c in line.split(delimiter)]


def cut(text: LabText) -> Sheet:
    """Find delimiter, header and units row of a lab file and cut it into cells.

    The header is the line near the top with the most names that are understood, whatever stands above it.

    Raises
    ------
    InputError
        If no header is found, no row follows it, a second header follows, or a row is wider than the header.
    """
    delimiter, header = _find_header(text)
    names = split_line(text.lines[header], delimiter)
    start = header + 1
    units_line: int | None = None
    units: list[str] = []
    following = next((i for i in range(start, len(text.lines)) if text.lines[i].strip()), None)
    if following is not None:
        cells = [unit_of_cell(c) for c in split_line(text.lines[following], delimiter)]
        if any(cells) and all(c is not None for c in cells):
            units_line, units, start = following + 1, [c or "" for c in cells], following + 1
    rows, lines, notes = _data_rows(text, delimiter, names, start)
    if not rows:
        raise InputError(
            Fault("there is a header but no row of numbers below it", text.path, header + 1, advice="Export the raw data too")
        )
    return Sheet(
        text, delimiter, header + 1, tuple(names), units_line, tuple(units), rows, np.array(lines, dtype=np.int64), tuple(notes)
    )


def _understood(cells: list[str]) -> int:
    return sum(understand(c) is not None for c in cells if c)


def _find_header(text: LabText) -> tuple[str, int]:
    best = (0, "", -1)
    for index, line in enumerate(text.lines[:_HEADER_WITHIN]):
        if not line.strip() or is_numeric(line):
            continue
        for delimiter in DELIMITERS:
            if delimiter not in line:
                continue
            cells = split_line(line, delimiter)
            if any(map(is_numeric, cells[1:])):  # a first number may be the specimen's
                continue
            score = _understood(cells)
            if score > best[0]:
                best = (score, delimiter, index)
    score, delimiter, index = best
    if score >= 2 or (score == 1 and _numbers_follow(text, delimiter, index)):
        return delimiter, index
    seen = _likely_header(text)
    found = f"; found {', '.join(seen[1])}" if seen else ""
    advice = "; ".join(f"{q}: {understood_names(q)}" for q in ("displacement", "force", "capacitance", "time"))
    raise InputError(
        Fault(
            f"no header row with column names that are understood{found}",
            text.path,
            seen[0] if seen else None,
            advice=f'Name the columns for example "{EXAMPLE["time"]}", "{EXAMPLE["force"]}". Understood are {advice}',
        )
    )


def _numbers_follow(text: LabText, delimiter: str, index: int) -> bool:
    below = [line for line in text.lines[index + 1 : index + 6] if line.strip()][:2]
    return any(sum(is_numeric(c) for c in split_line(line, delimiter)) >= 2 for line in below)


def _likely_header(text: LabText) -> tuple[int, list[str]] | None:
    # The last line of words above the first line of numbers: what the user would call the header.
    above: tuple[int, list[str]] | None = None
    for index, line in enumerate(text.lines[:_HEADER_WITHIN]):
        for delimiter in DELIMITERS:
            cells = [c for c in split_line(line, delimiter) if c]
            if len(cells) < 2:
                continue
            if sum(is_numeric(c) for c in cells) >= 2:
                return above
            above = (index + 1, [f'"{c}"' for c in cells[:12]])
            break
    return above


def _data_rows(text: LabText, delimiter: str, names: list[str], start: int) -> tuple[list[list[str]], list[int], list[str]]:
    rows: list[list[str]] = []
    lines: list[int] = []
    faults: list[Fault] = []
    notes: list[str] = []
    width = len(names)
    footer: list[int] = []
    for index in range(start, len(text.lines)):
        line = text.lines[index]
        if not line.strip():
            continue
        if '"' in line:
            cells = split_line(line, delimiter)
            if line.count('"') % 2:
                faults.append(Fault("a quotation mark is not closed", text.path, index + 1, advice="Export the file again"))
                continue
        else:
            cells = line.split(delimiter)
        if len(cells) > width:
            if any(c.strip() for c in cells[width:]):
                faults.append(
                    Fault(
                        f"the row has {len(cells)} cells, the header has {width}",
                        text.path,
                        index + 1,
                        width + 1,
                        advice=(
                            "If the decimal mark is a comma too, export with semicolons between the columns"
                            if delimiter == ","
                            else "Remove what does not belong to the table"
                        ),
                    )
                )
                continue
            cells = cells[:width]
        first = cells[0].strip()
        note = first and not is_numeric(first) and not is_over_range(first)
        if note and len(cells) < width and not any(map(is_numeric, cells[2:])):
            footer.append(index)  # `key,value`: legitimate below the table only
            continue
        if footer:
            faults += [
                Fault(f'"{text.lines[i].strip()}" stands among the rows', text.path, i + 1, 1, advice="Remove the line")
                for i in footer
            ]
            footer = []
        if note and [c.strip() for c in cells] == names:
            raise InputError(
                Fault(
                    f"a second header: the table begins again (the first began at line {start})",
                    text.path,
                    index + 1,
                    advice="Save one specimen and one test per file",
                )
            )
        rows.append(cells)
        lines.append(index + 1)
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))
    while rows and not any(c.strip() for c in rows[-1]):
        rows.pop()
        lines.pop()
    if footer:
        notes.append(f'{len(footer)} line(s) below the table left out, the first is "{text.lines[footer[0]].strip()}"')
    return rows, lines, notes


def capped(faults: list[Fault], what: str, limit: int = 10) -> list[Fault]:
    """The first `limit` faults; if there are more, one further fault that counts all of them."""
    if len(faults) <= limit:
        return faults
    return [
        *faults[:limit],
        Fault(f"{len(faults)} {what} in all; the first {limit} are listed", faults[0].path, advice="Export the file again"),
    ]
