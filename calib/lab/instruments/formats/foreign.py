"""Formats of other kinds, each refused with what to do instead: databases, archives, pictures, documents, web pages."""

from __future__ import annotations

import re
from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.part import Format, Part
from calib.lab.instruments.zipped import BEGINNING, WORKBOOK, names_inside

_CSV = "Export a CSV file or an Excel workbook (.xlsx)"
# First bytes that are looked at.
_HEAD = 4096
_UNPACK = "Unpack it and name the file inside"
_PICTURE = "A picture holds no readings: export the data behind it as a CSV file"

# First bytes -> what the file is, and what to do.
_BEGINNINGS: tuple[tuple[bytes, str, str], ...] = (
    (b"SQLite format 3\x00", "an SQLite database", "Export its table as a CSV file"),
    (b"\x00\x01\x00\x00Standard ", "an Access database", "Export its table as a CSV file"),
    (b"PAR1", "a Parquet file", "Write it as CSV: pandas.read_parquet(file).to_csv(...)"),
    (b"ARROW1", "a Feather or Arrow file", "Write it as CSV: pandas.read_feather(file).to_csv(...)"),
    (b"FEA1", "a Feather file", "Write it as CSV: pandas.read_feather(file).to_csv(...)"),
    (b"\x93NUMPY", "a NumPy array", "Write it as CSV, with the names of the columns and their units in the header"),
    (b"TDSh", "the index of a TDMS file", "Name the .tdms file beside it"),
    (b"CDF\x01", "a NetCDF file", _CSV),
    (b"CDF\x02", "a NetCDF file", _CSV),
    (b"\x1f\x8b", "a gzip archive", _UNPACK),
    (b"BZh", "a bzip2 archive", _UNPACK),
    (b"\xfd7zXZ\x00", "an xz archive", _UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", _UNPACK),
    (b"Rar!\x1a\x07", "a RAR archive", _UNPACK),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", _UNPACK),
    (b"%PDF", "a PDF document", _PICTURE.replace("picture", "document")),
    (b"\x89PNG", "a picture", _PICTURE),
    (b"\xff\xd8\xff", "a picture", _PICTURE),
    (b"GIF8", "a picture", _PICTURE),
    (b"II*\x00", "a picture", _PICTURE),
    (b"MM\x00*", "a picture", _PICTURE),
    (b"{\\rtf", "an RTF document", _CSV),
    (b"# Created by Octave", "a text of Octave's own", "Save it by: save -v7 press.mat; or write a CSV file"),
)
_INSIDE: tuple[tuple[str, str, str], ...] = (
    ("xl/workbook.bin", "a binary workbook (.xlsb)", "Save it as an Excel workbook (.xlsx), or export a CSV file"),
    ("content.xml", "an OpenDocument file (.ods, .odt)", "Save it as an Excel workbook (.xlsx), or export a CSV file"),
    ("Index/Document.iwa", "a Numbers or Pages document", "Export it as an Excel workbook (.xlsx) or as a CSV file"),
    ("word/document.xml", "a Word document", _CSV),
    ("ppt/presentation.xml", "a presentation", _CSV),
    (".npy", "an archive of NumPy arrays (.npz)", "Write the arrays as the columns of a CSV file, with names and units"),
    ("", "a zip archive", _UNPACK),
)
_MARKUP: tuple[tuple[re.Pattern[bytes], str, str], ...] = (
    (
        re.compile(rb"urn:schemas-microsoft-com:office:spreadsheet"),
        "a workbook as XML (of 2003)",
        "Open it in a spreadsheet program and save it as an Excel workbook (.xlsx)",
    ),
    (
        re.compile(rb"^\s*(?:<!doctype html|<html|<table|<head|<meta)", re.IGNORECASE),
        "a web page, whatever its ending",
        "Open it in a spreadsheet program and save it as an Excel workbook (.xlsx), or export a CSV file",
    ),
    (re.compile(rb"^\s*<\?xml"), "an XML file", _CSV),
)


def _kind(head: bytes, path: Path) -> tuple[str, str] | None:
    """What a file is, and what to do; None if it is of none of these kinds."""
    if head.startswith(b"\x89HDF\r\n\x1a\n") and path.suffix.lower() != ".mat":
        return "an HDF5 file", _CSV
    for beginning, what, advice in _BEGINNINGS:
        if head.startswith(beginning):
            return what, advice
    if head.startswith((BEGINNING, b"PK\x05\x06")):
        names = names_inside(path)
        if WORKBOOK in names:
            return None
        if not names:
            return "a zip archive or workbook (.xlsx) that is damaged or cut short", "Save it again, or export a CSV file"
        return next((what, advice) for inside, what, advice in _INSIDE if not inside or any(n.endswith(inside) for n in names))
    bare = head.removeprefix(b"\xef\xbb\xbf")
    return next(((what, advice) for pattern, what, advice in _MARKUP if pattern.search(bare)), None)


def recognise(head: bytes, path: Path) -> bool:
    """Recognise by the first bytes, whatever the ending, a format that holds no readings or is not read.

    Parameters
    ----------
    head : its first bytes.
    path : the file.
    """
    return _kind(head, path) is not None


def take_apart(path: Path) -> tuple[Part, ...]:
    """Refuse the file.

    Raises
    ------
    InputError
        Always, with what the file is and what to do.
    """
    with path.open("rb") as file:
        kind = _kind(file.read(_HEAD), path)
    what, advice = kind if kind is not None else ("of another kind", _CSV)
    beginning = "" if what in (kind for _, kind, _ in _MARKUP) else "not text but "
    raise InputError(Fault(f"the file is {beginning}{what}, which is not read", path, advice=advice))


FORMAT = Format("foreign", recognise, take_apart)
