"""Lab files in, `LabTable` out: cut into a record, recognised as of some instrument, read into columns in SI."""

from __future__ import annotations

from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.columns import read_columns
from calib.lab.instruments.cut import cut
from calib.lab.instruments.labtable import AS_FOUND, Family, IntArray, LabTable, Reading
from calib.lab.instruments.lcr import LCR_METERS, as_parallel
from calib.lab.instruments.replies import replies
from calib.lab.instruments.sheet import SeveralSpecimens, Sheet
from calib.lab.instruments.testers import TESTERS
from calib.lab.instruments.text import read_lab_text
from calib.lab.instruments.units import SI_UNIT

__all__ = [
    "AS_FOUND",
    "FAMILIES",
    "QUANTITIES",
    "Family",
    "IntArray",
    "LabTable",
    "Reading",
    "SeveralSpecimens",
    "read_lab_file",
]

#: What `Reading.units` and `Reading.columns` may name.
QUANTITIES = tuple(q for q in SI_UNIT if q != "capacitance_series")


def _any_table(sheet: Sheet) -> str:
    if not sheet.header_line:
        return "the columns are as asked"
    return f"the header at line {sheet.header_line} names {', '.join(sheet.names[i] for i in sheet.headings())}"


def _enough(found: frozenset[str]) -> tuple[str, ...]:
    if "capacitance" in found:
        return () if found & {"time", "force", "displacement"} else ("displacement", "force", "time")
    if found & {"displacement", "force"}:
        return tuple(q for q in ("displacement", "force") if q not in found)
    return ("displacement", "force", "capacitance")


#: The families in the order in which they are asked; the last recognises everything with a header.
FAMILIES: tuple[Family, ...] = (
    *LCR_METERS,
    *TESTERS,
    Family("table with a header", _any_table, _enough, verified=True),
)


def read_lab_file(path: Path, reading: Reading = AS_FOUND) -> LabTable:
    """Read one record of a file of a testing machine or an LCR meter.

    Encoding, delimiter, decimal mark, header and units are found in the file; what was found is stated in the table.
    Nothing is guessed: a missing or unknown unit, text in a number cell or an ambiguous decimal mark is refused, an empty
    cell or an over-range reading makes its row unusable and says so.

    Parameters
    ----------
    path : a text file (CSV, TSV, TXT).
    reading : what the user says of the file: units, columns, which of several specimens.

    Returns
    -------
    Columns in SI with the signs of the file.

    Raises
    ------
    SeveralSpecimens
        If the file holds several specimens and `reading` does not say which.
    calib.errors.InputError
        With every fault of the file, each with line, column and advice.
    """
    path = Path(path)
    unknown = sorted({*reading.units, *reading.columns} - set(QUANTITIES) - {"capacitance_series"})
    if unknown:
        raise InputError(Fault(f"there is no quantity {', '.join(unknown)}", path, advice=f"There are {', '.join(QUANTITIES)}"))
    text = read_lab_text(path)
    sheet = replies(text) or cut(text, reading)
    for family in FAMILIES:
        reason = family.recognise(sheet)
        if reason:
            return as_parallel(read_columns(sheet, family, reason, reading), sheet.header_line)
    raise AssertionError("every sheet is a table")
