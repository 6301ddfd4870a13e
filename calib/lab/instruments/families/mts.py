"""MTS 793 and TestSuite: a sheet in, the reason why it is one of their exports out."""

from __future__ import annotations

from calib.lab.instruments.family import InstrumentFamily, channels, named_above, needs
from calib.lab.instruments.sheet import Sheet


def recognise(sheet: Sheet) -> str:
    """Recognise MTS 793 by a first line that declares language and marks, and TestSuite by its words."""
    first = sheet.text.lines[0].lstrip("\ufeff") if sheet.text.lines else ""
    if sheet.header_line > 1 and first.startswith("MTS793|"):
        mark = f', decimal mark "{sheet.declared_decimal}" declared there' if sheet.declared_decimal else ""
        return f'line 1 is "{first[:40]}"{mark}; {channels(sheet)}'
    above = named_above(sheet, r"\bMTS\b|multipurpose testware|testsuite|testworks")
    return f"{channels(sheet)}, {above}" if above else ""


FAMILY = InstrumentFamily("MTS", 50, recognise, needs("displacement", "force"), verified=False)
