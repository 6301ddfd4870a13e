"""Excel workbooks of 2007 and later (.xlsx, .xlsm): a file in, its sheets as parts out."""

from __future__ import annotations

import hashlib
import html
import io
import posixpath
import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from calib.errors import Fault, InputError
from calib.lab.instruments.grid import SheetOf, Value, column_letters, part_of, with_comments
from calib.lab.instruments.lines import DOUBT
from calib.lab.instruments.part import Cell, Format, Part, damaged, not_installed
from calib.lab.instruments.said_inside import sayings
from calib.lab.instruments.stated import speaks_of_scale
from calib.lab.instruments.zipped import BEGINNING, WORKBOOK, names_inside

if TYPE_CHECKING:
    from openpyxl.worksheet._read_only import ReadOnlyWorksheet

# Bytes that the sheets of a workbook may have once unpacked: a sheet of a million rows has a tenth of it, a bomb more.
_MOST_BYTES = 1_500_000_000
# The namespace by which a workbook says that it is of the strict variant.
_STRICT = b"http://purl.oclc.org/ooxml/"


def recognise(head: bytes, path: Path) -> bool:
    """Recognise a zip archive that holds a workbook.

    Parameters
    ----------
    head : its first bytes.
    path : the file.
    """
    return head.startswith(BEGINNING) and WORKBOOK in names_inside(path)


def take_apart(path: Path) -> tuple[Part, ...]:
    """Read every sheet of a workbook; sheets of charts have no cells, and say so.

    Raises
    ------
    InputError
        If openpyxl is not installed, the file is damaged, or it is larger than any lab's.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise not_installed(path, "workbooks (.xlsx) are read with openpyxl") from None
    with damaged(path, "workbook"):
        data = path.read_bytes()
        _check_size(path, data)
        sha256 = hashlib.sha256(data).hexdigest()
        _check_strict(path, data)
        book = load_workbook(io.BytesIO(data), data_only=True, read_only=True, keep_links=False)
        scans = {sheet.title: _scan(data, sheet._worksheet_path) for sheet in book.worksheets}
        formulas: dict[str, Mapping[Cell, str]] = {}
        if any(scan.formulas for scan in scans.values()):
            written = load_workbook(io.BytesIO(data), data_only=False, read_only=True, keep_links=False)
            formulas = {sheet.title: _formulas(sheet) for sheet in written.worksheets if scans[sheet.title].formulas}
        parts = []
        of_book = tuple(_of_book(data))
        for sheet in book.worksheets:
            where = SheetOf(path, sha256, "xlsx", sheet.title, sheet.sheet_state != "visible")
            part = _part(sheet, where, formulas.get(sheet.title, {}), scans[sheet.title].notes)
            parts.append(with_comments(part, (*_comments(data, sheet._worksheet_path), *of_book)))
        parts += [Part("sheet", sheet.title, None, "it is a chart") for sheet in book.chartsheets]
    return tuple(parts)


def _check_size(path: Path, data: bytes) -> None:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        total = sum(info.file_size for info in archive.infolist())
    if total > _MOST_BYTES:
        message = f"the workbook would unpack to {total / 1e9:.1f} GB"
        raise InputError(Fault(message, path, advice="Export the record as a CSV file"))


def _check_strict(path: Path, data: bytes) -> None:
    """Refuse a workbook of the strict variant of the format, in which openpyxl finds no sheet."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        strict = _STRICT in archive.read(WORKBOOK)[:4096]
    if strict:
        message = "the workbook is saved as Strict Open XML, which is not read"
        raise InputError(Fault(message, path, advice='Save it as "Excel Workbook (*.xlsx)", or export a CSV file'))


def _formulas(sheet: ReadOnlyWorksheet) -> Mapping[Cell, str]:
    sheet.reset_dimensions()
    return {
        (cell.row, cell.column - 1): str(getattr(cell.value, "text", cell.value) or "=")
        for cells in sheet.iter_rows()
        for cell in cells
        if cell.data_type == "f"
    }


def _part(sheet: ReadOnlyWorksheet, where: SheetOf, formulas: Mapping[Cell, str], notes: Sequence[str]) -> Part:
    errors: dict[Cell, str] = {}
    calculated: dict[Cell, str] = {}

    def rows() -> Iterator[Sequence[tuple[Value, str]]]:
        sheet.reset_dimensions()  # some programs state a wrong size, and what lies beyond it would be left out
        for row, cells in enumerate(sheet.iter_rows(), 1):
            line: list[tuple[Value, str]] = []
            for column, cell in enumerate(cells):
                value = cell.value
                if value is None:
                    line.append((None, "General"))
                    continue
                if cell.data_type == "e":
                    errors[row, column] = str(value)
                if (row, column) in formulas:
                    calculated[row, column] = formulas[row, column]
                line.append((value, cell.number_format if cell.has_style else "General"))
            yield line

    part = part_of(where, rows(), errors=errors, uncalculated={}, formulas=calculated, notes=notes)
    uncalculated = {cell: formulas[cell] for cell in formulas.keys() - calculated.keys()}
    return replace(part, types=replace(part.types, uncalculated=uncalculated))


@dataclass(frozen=True)
class _Scan:
    """What the text of a sheet shows that its cells do not: whether there are formulas, and what who opens it does not see."""

    formulas: bool
    notes: tuple[str, ...]


_FORMULA = re.compile(rb"<(?:\w+:)?f[ >/]")
_HIDDEN = re.compile(rb'<(?:\w+:)?(?P<kind>row|col) (?=[^>]*\bhidden="(?:1|true)")(?P<attributes>[^>]*)>')
_MERGED = re.compile(rb'<(?:\w+:)?mergeCell [^>]*ref="([A-Z0-9:]+)"')


_STYLED = re.compile(rb'<(?:\w+:)?c (?=[^>]*\br="[A-Z]+(?P<row>\d+)")(?=[^>]*\bs="(?P<style>\d+)")[^>]*[^/]>')
_FONT = re.compile(rb"<(?:\w+:)?font(?:/>|>.*?</(?:\w+:)?font>)", re.DOTALL)
_STRIKE = re.compile(rb'<(?:\w+:)?strike(?:/>| (?!val="(?:0|false)"))')
_FORMATS = re.compile(rb"<(?:\w+:)?cellXfs.*?</(?:\w+:)?cellXfs>", re.DOTALL)


def _struck(archive: zipfile.ZipFile) -> frozenset[bytes]:
    """The formats of cells that are struck through, by the number that cells have."""
    if "xl/styles.xml" not in archive.namelist():
        return frozenset()
    styles = archive.read("xl/styles.xml")
    fonts = {str(i).encode() for i, font in enumerate(_FONT.findall(styles)) if _STRIKE.search(font)}
    formats = _FORMATS.search(styles) if fonts else None
    of_fonts = re.findall(rb'<(?:\w+:)?xf [^>]*?fontId="(\d+)"', formats[0]) if formats is not None else []
    return frozenset(str(i).encode() for i, font in enumerate(of_fonts) if font in fonts)


def _scan(data: bytes, sheet: str) -> _Scan:
    formulas, hidden_rows, hidden_columns, merged = False, list[int](), list[int](), list[str]()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, archive.open(sheet) as file:
        rest, struck_rows, struck = b"", set[int](), _struck(archive)
        while block := file.read(1 << 22):
            whole, bracket, rest = (rest + block).rpartition(b">")
            whole += bracket
            formulas = formulas or _FORMULA.search(whole) is not None
            styled = _STYLED.finditer(whole) if struck else ()
            struck_rows |= {int(match["row"]) for match in styled if match["style"] in struck}
            merged += [match[1].decode() for match in _MERGED.finditer(whole)]
            for match in _HIDDEN.finditer(whole):
                numbers = {name: int(number) for name, number in re.findall(rb'\b(r|min|max)="(\d+)"', match["attributes"])}
                if match["kind"] == b"row":
                    hidden_rows.append(numbers.get(b"r", 0))
                else:
                    hidden_columns += range(numbers.get(b"min", 1), min(numbers.get(b"max", 1), 400) + 1)
    notes = []
    if hidden_rows:
        notes.append(f"{len(hidden_rows)} hidden row(s) are read as the others, the first is row {min(hidden_rows)}")
    if struck_rows:
        notes.append(
            f"{len(struck_rows)} row(s) with cells struck through are read as the others, the first is row {min(struck_rows)}"
        )
    if hidden_columns:
        letters = ", ".join(column_letters(column - 1) for column in hidden_columns[:8])
        notes.append(f"hidden column(s) {letters}{' and more' if len(hidden_columns) > 8 else ''} are read as the others")
    if merged:
        shown = ", ".join(merged[:5])
        notes.append(f"{len(merged)} merged area(s), such as {shown}: the value stands in the first cell, the others are empty")
    return _Scan(formulas, tuple(notes))


_RELATED = re.compile(rb"<(?:\w+:)?Relationship [^>]*>")
_COMMENT = re.compile(
    rb'<(?:\w+:)?(?:comment|threadedComment) [^>]*?\bref="(?P<ref>[A-Z]+\d+)"[^>]*>(?P<inside>.*?)</(?:\w+:)?(?:comment|'
    rb"threadedComment)>",
    re.S,
)
_BOX = re.compile(rb"<xdr:sp[ >](?P<inside>.*?)</xdr:sp>", re.S)
_WORDS = re.compile(rb"<(?:\w+:)?(?:t|text)(?: [^>]*)?>([^<]+)<")


def _comments(data: bytes, sheet: str) -> Iterator[tuple[Cell | None, str]]:
    """The comments on cells of a sheet, and what its boxes of text say, which stand at no cell."""
    folder, _, name = sheet.rpartition("/")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        there = set(archive.namelist())
        links = f"{folder}/_rels/{name}.rels"
        for link in _RELATED.findall(archive.read(links)) if links in there else ():
            target = re.search(rb'Target="([^"]+)"', link)
            kind = re.search(rb'Type="[^"]*/(comments|threadedComment|drawing)"', link)
            path = (
                posixpath.normpath(posixpath.join(f"/{folder}", target[1].decode())).lstrip("/") if target is not None else ""
            )
            if kind is None or path not in there:
                continue
            for found in (_BOX if kind[1] == b"drawing" else _COMMENT).finditer(archive.read(path)):
                said = html.unescape(b" ".join(_WORDS.findall(found["inside"])).decode("utf-8", "replace"))
                yield (_cell(found["ref"].decode()) if kind[1] != b"drawing" else None), " ".join(said.split())


# Properties of a workbook that somebody filled in, and those that have a name of their own.
_PROPERTIES = (
    (
        "docProps/core.xml",
        re.compile(rb"<(?:\w+:)?(?P<name>title|subject|description|keywords|category)[^>]*>(?P<text>[^<]+)<"),
    ),
    ("docProps/custom.xml", re.compile(rb'<property [^>]*name="(?P<name>[^"]+)"[^>]*>\s*<vt:\w+>(?P<text>[^<]+)<')),
)


def _of_book(data: bytes) -> Iterator[tuple[None, str]]:
    """The properties of a workbook that speak of its readings: of a factor, a unit, or a doubt."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        there = set(archive.namelist())
        for path, pattern in _PROPERTIES:
            for found in pattern.finditer(archive.read(path)) if path in there else ():
                name, text = (html.unescape(found[k].decode("utf-8", "replace")) for k in ("name", "text"))
                for said in sayings(text, (name,)):
                    if DOUBT.search(said.words) or speaks_of_scale(said.line):
                        yield None, said.line.replace("\t", ": ")


def _cell(ref: str) -> Cell:
    letters = ref.rstrip("0123456789")
    column = 0
    for letter in letters:
        column = 26 * column + ord(letter) - 64
    return int(ref[len(letters) :]), column - 1


FORMAT = Format("Excel workbook (.xlsx)", recognise, take_apart)
