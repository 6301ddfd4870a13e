"""From a lab file to its `LabTable`: cut into a record, recognised as of some instrument, read into columns in SI."""

from __future__ import annotations

from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.columns import read_columns
from calib.lab.instruments.cut import cut
from calib.lab.instruments.families import FAMILIES
from calib.lab.instruments.labtable import AS_FOUND, LabTable, Reading
from calib.lab.instruments.parallel import as_parallel
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText, read_lab_text
from calib.lab.instruments.units import IN_PLACE_OF, SI_UNIT

#: What `Reading.units` and `Reading.columns` may name.
QUANTITIES = tuple(q for q in SI_UNIT if q not in IN_PLACE_OF)


def read_lab_file(path: Path, reading: Reading = AS_FOUND) -> LabTable:
    """Read one record of a file of a testing machine or an LCR meter into columns in SI.

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
    unknown = sorted({*reading.units, *reading.columns} - set(QUANTITIES) - set(IN_PLACE_OF))
    if unknown:
        raise InputError(Fault(f"there is no quantity {', '.join(unknown)}", path, advice=f"There are {', '.join(QUANTITIES)}"))
    for name, said, known in (("decimal", reading.decimal, (".", ",")), ("scale", reading.scale, ("micro",))):
        if said and said not in known:
            listed = " or ".join(f'"{word}"' for word in known)
            raise InputError(Fault(f'{name} "{said}" is none that there is', path, advice=f"Write {name} = {listed}"))
    text = read_lab_text(path)
    sheet = _own_sheet(text, reading) or cut(text, reading)
    for family in FAMILIES:
        reason = family.recognise(sheet)
        if reason:
            return as_parallel(read_columns(sheet, family, reason, reading), sheet.header_line)
    raise AssertionError("every sheet is a table")


def _own_sheet(text: LabText, reading: Reading) -> Sheet | None:
    """Cut a text in the way of its family, if that has one; None if no family does."""
    sheets = (family.cut(text, reading) for family in FAMILIES if family.cut is not None)
    return next((sheet for sheet in sheets if sheet is not None), None)
