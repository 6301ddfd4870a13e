"""Excel workbooks before 2007 (.xls): a file in, its sheets as parts out; an encrypted workbook of any age is refused."""

from __future__ import annotations

import hashlib
import io
import struct
from collections.abc import Iterator, Sequence
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from calib.errors import Fault, InputError
from calib.lab.instruments.grid import SheetOf, Value, column_letters, part_of
from calib.lab.instruments.part import Cell, Format, Part, damaged, not_installed

if TYPE_CHECKING:
    from xlrd.book import Book
    from xlrd.sheet import Sheet as OldSheet

_COMPOUND = bytes.fromhex("d0cf11e0a1b11ae1")
# Largest file that is read: the format has room for 65,536 rows in a sheet.
_MOST_BYTES = 500_000_000
# Types of cells and of sheets, records of formulas and their sheets, as Microsoft's description of the format numbers them.
_TEXT, _NUMBER, _DATE, _BOOLEAN, _ERROR = 1, 2, 3, 4, 5
_FORMULAS, _SHEET, _BEGIN = (0x0006, 0x0206, 0x0406), 0x0085, (0x0009, 0x0209, 0x0409, 0x0809)
_KINDS = {0x01: "it is a macro sheet", 0x02: "it is a chart", 0x06: "it is a module of macros"}


def recognise(head: bytes, _: Path) -> bool:
    """Recognise the container of Microsoft's older formats; what is in it, `take_apart` tells."""
    return head.startswith(_COMPOUND)


def take_apart(path: Path) -> tuple[Part, ...]:
    """Read every sheet of a workbook.

    Raises
    ------
    InputError
        If xlrd is not installed, the file is damaged, protected by a password, or holds something else than a workbook.
    """
    with damaged(path, "file"):
        if path.stat().st_size > _MOST_BYTES:
            message = f"the workbook is larger than {_MOST_BYTES / 1e6:.0f} MB"
            raise InputError(Fault(message, path, advice="Export the record as a CSV file"))
        data = path.read_bytes()
    if "EncryptedPackage".encode("utf-16-le") in data:
        raise _protected(path)
    if not any(name.encode("utf-16-le") in data for name in ("Workbook", "Book")):
        message = "the file is no workbook, but another of Microsoft's older formats or of a program that uses their container"
        raise InputError(Fault(message, path, advice="Export a CSV file or a workbook from the instrument's software"))
    try:
        import xlrd
    except ImportError:
        raise not_installed(path, "workbooks (.xls) are read with xlrd") from None
    with damaged(path, "workbook"):
        try:
            book = xlrd.open_workbook(file_contents=data, formatting_info=True, on_demand=True, logfile=io.StringIO())
        except xlrd.XLRDError as error:
            if "encrypt" in str(error).lower() or "password" in str(error).lower():
                raise _protected(path) from None
            raise
        kinds, formulas = _records(book)
        sha256 = hashlib.sha256(data).hexdigest()
        parts = []
        for index, sheet in enumerate(book.sheets()):
            where = SheetOf(path, sha256, "xls", sheet.name, sheet.visibility != 0)
            parts.append(_part(book, sheet, where, formulas.get(index, {})))
        return (*parts, *(Part("sheet", name, None, reason) for name, reason in kinds))


def _protected(path: Path) -> InputError:
    advice = "Open it with the password and save it without one, or export a CSV file"
    return InputError(Fault("the workbook is protected by a password", path, advice=advice))


def _records(book: Book) -> tuple[list[tuple[str, str]], dict[int, dict[Cell, str]]]:
    """Sheets that are none of cells, each with the reason, and the cells that are formulas, by number of the sheet of cells."""
    stream = book.mem[book.base : book.base + book.stream_len]
    others: list[tuple[str, str]] = []
    begins: list[int] = []
    names = iter(book.sheet_names())
    for code, at, length in _walk(stream, 0):
        if code == _SHEET and length >= 8:
            (start,) = struct.unpack_from("<I", stream, at)
            kind = stream[at + 5]
            if kind == 0:
                begins.append(start)
                next(names, None)
            elif kind in _KINDS:
                others.append((_name_of(stream[at + 6 : at + length]), _KINDS[kind]))
    found: dict[int, dict[Cell, str]] = {}
    for index, start in enumerate(begins):
        depth = 0
        for code, at, length in _walk(stream, start):
            depth += code in _BEGIN
            if code == 0x000A:
                depth -= 1
                if depth <= 0:
                    break
            elif code in _FORMULAS and depth == 1 and length >= 4:
                row, column = struct.unpack_from("<HH", stream, at)
                found.setdefault(index, {})[row + 1, column] = ""
    return others, found


def _walk(stream: bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """Code, place of the content and its length of each record from a place on, to the end of the stream."""
    while at + 4 <= len(stream):
        code, length = struct.unpack_from("<HH", stream, at)
        yield code, at + 4, length
        at += 4 + length
        if code == 0 and length == 0:
            return


def _name_of(field: bytes) -> str:
    if len(field) < 3:
        return "?"
    size, wide = field[0], field[1] & 1
    return field[2 : 2 + 2 * size].decode("utf-16-le", "replace") if wide else field[2 : 2 + size].decode("latin-1")


def _part(book: Book, sheet: OldSheet, where: SheetOf, formulas: dict[Cell, str]) -> Part:
    from xlrd import error_text_from_code

    errors: dict[Cell, str] = {}
    # An empty text as result: of a formula that was never calculated, or of one that gives it.
    uncalculated = {cell: "" for cell in formulas if sheet.cell_value(cell[0] - 1, cell[1]) == ""}
    calculated = {cell: "" for cell in formulas if cell not in uncalculated}
    formats = [book.format_map[style.format_key].format_str for style in book.xf_list]

    def rows() -> Iterator[Sequence[tuple[Value, str]]]:
        for row in range(sheet.nrows):
            line: list[tuple[Value, str]] = []
            for column, (kind, value, style) in enumerate(
                zip(sheet.row_types(row), sheet.row_values(row), _styles(sheet, row), strict=False)
            ):
                own = formats[style] if 0 <= style < len(formats) else "General"
                if kind == _ERROR:
                    errors[row + 1, column] = error_text_from_code.get(value, f"error {value}")
                line.append((_value(kind, value, book.datemode), own))
            yield line

    return part_of(where, rows(), errors=errors, uncalculated=uncalculated, formulas=calculated, notes=_notes(sheet))


def _styles(sheet: OldSheet, row: int) -> Sequence[int]:
    return [sheet.cell_xf_index(row, column) for column in range(sheet.row_len(row))]


def _value(kind: int, value: str | float, datemode: int) -> Value:
    if kind == _TEXT:
        return str(value)
    if kind == _BOOLEAN:
        return bool(value)
    if kind == _DATE:
        return _date(float(value), datemode)
    return float(value) if kind == _NUMBER else None


def _date(days: float, datemode: int) -> datetime | time | str:
    """The time of a number of days; below one a time of day. Without the two days by which old programs count wrongly."""
    if 0 <= days < 1:
        seconds = timedelta(microseconds=round(days * 86400e6))
        return (datetime(1904, 1, 1) + seconds).time() if seconds < timedelta(days=1) else repr(days)
    epoch = datetime(1904, 1, 1) if datemode else datetime(1899, 12, 30)
    if not 61 <= days < 2_958_466:
        return f"{days!r} days"  # no date that a record has, nor a number that it could be read as
    return epoch + timedelta(milliseconds=round(days * 86400e3))


def _notes(sheet: OldSheet) -> list[str]:
    hidden = [row + 1 for row, info in sheet.rowinfo_map.items() if info.hidden]
    columns = [
        column_letters(column) for column, info in sorted(sheet.colinfo_map.items()) if info.hidden and column < sheet.ncols
    ]
    notes = []
    if hidden:
        notes.append(f"{len(hidden)} hidden row(s) are read as the others, the first is row {min(hidden)}")
    if columns:
        notes.append(f"hidden column(s) {', '.join(columns[:8])} are read as the others")
    if sheet.merged_cells:
        first, _, column, _ = sheet.merged_cells[0]
        notes.append(
            f"{len(sheet.merged_cells)} merged area(s), the first at {column_letters(column)}{first + 1}: the value stands in "
            "the first cell, the others are empty"
        )
    return notes


FORMAT = Format("Excel workbook (.xls)", recognise, take_apart)
