"""Lab files in, `LabTable` out: one reader per instrument family, the first that recognises a file reads it."""

from __future__ import annotations

from pathlib import Path

from calib.instruments import bluehill, lcr, table
from calib.instruments.labtable import Family, IntArray, LabTable
from calib.instruments.sheet import cut, read_lab_text

__all__ = ["FAMILIES", "Family", "IntArray", "LabTable", "read_lab_file"]

#: The families in the order in which they are asked; the last recognises everything with a header.
FAMILIES: tuple[Family, ...] = (lcr.FAMILY, bluehill.FAMILY, table.FAMILY)


def read_lab_file(path: Path) -> LabTable:
    """Read one file of a testing machine or an LCR meter.

    Encoding, delimiter, decimal mark, header and units are found in the file; what was found is stated in the table.
    Nothing is guessed: a missing or unknown unit, text in a number cell or an ambiguous decimal mark is refused, an empty
    cell or an over-range reading makes its row unusable and says so.

    Parameters
    ----------
    path : a text file (CSV, TSV, TXT) of one specimen.

    Returns
    -------
    Columns in SI with the signs of the file.

    Raises
    ------
    calib.errors.InputError
        With every fault of the file, each with line, column and advice.
    """
    path = Path(path)
    sheet = cut(read_lab_text(path))
    for family in FAMILIES:
        reason = family.recognise(sheet)
        if reason:
            return family.read(sheet, reason)
    raise AssertionError("the table family recognises every sheet")
