"""Instron Bluehill raw data and Bluehill Universal exports: time, displacement and force of one specimen."""

from __future__ import annotations

import re

from calib.instruments.columns import headings, needs, read_columns
from calib.instruments.labtable import Family, LabTable
from calib.instruments.sheet import Sheet, split_line

NAME = "Instron Bluehill raw data"

# How Bluehill names its channels; a table with other words for them was made elsewhere.
_DISPLACEMENT = ("extension", "displacement", "compressive extension", "compressive displacement", "traversenweg", "位移")
_FORCE = ("load", "force", "compressive load", "compressive force", "last", "kraft", "载荷", "力")
_BLOCK = re.compile(
    r"text inputs|specimen label|bluehill|^\"?(general|dimension|method|sample|number inputs)\s*:", re.IGNORECASE
)


def recognise(sheet: Sheet) -> str:
    """Bluehill's channel names, with a units row below them, its header block above, or a specimen number before them."""
    found = headings(sheet)
    if any(h.quantity.startswith("capacitance") for h in found.values()):
        return ""
    words = [h.name for h in found.values() if h.name in _DISPLACEMENT or h.name in _FORCE]
    if not words:
        return ""
    block = next((i + 1 for i, line in enumerate(sheet.prelude) if _BLOCK.search(line)), None)
    channels = f"channels {', '.join(sheet.names[i] for i in found)} in line {sheet.header_line}"
    first = sheet.names[0].strip('"')
    if first.isdigit() and sheet.units_line is not None:
        return f"{channels} after the specimen number {first}, units in line {sheet.units_line} (Bluehill Universal export)"
    if block is not None:
        label = split_line(sheet.prelude[block - 1], sheet.delimiter)[0]
        return f'{channels}, header block with "{label}" in line {block}'
    if sheet.units_line is not None:
        return f"{channels}, units in line {sheet.units_line}"
    if any(h.name in _DISPLACEMENT for h in found.values()) and any(h.name in _FORCE for h in found.values()):
        return f"{channels}, units in the names"
    return ""


def read(sheet: Sheet, reason: str) -> LabTable:
    """Time [s], displacement [m], force [N] and the cycle count with the file's own signs: compression is often negative.

    Raises
    ------
    InputError
        As `read_columns`; displacement and force are needed.
    """
    return read_columns(sheet, NAME, reason, needs("displacement", "force"))


FAMILY = Family(NAME, recognise, read)
