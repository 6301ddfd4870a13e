"""Any table with a header that is understood, whoever wrote it: the family that is asked last and takes every sheet."""

from __future__ import annotations

from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.sheet import Sheet


def recognise(sheet: Sheet) -> str:
    """Accept every sheet, and give the columns that are understood as the reason."""
    if not sheet.header_line and not all(map(str.isdecimal, sheet.names)):
        return f"each line names its values: {', '.join(sheet.names[i] for i in sheet.headings if i >= 0)}"
    if not sheet.header_line:
        return "the columns are as asked"
    return f"the header at line {sheet.header_line} names {', '.join(sheet.names[i] for i in sheet.headings)}"


def _enough(found: frozenset[str]) -> tuple[str, ...]:
    if "capacitance" in found:
        return () if found & {"time", "force", "displacement"} else ("displacement", "force", "time")
    if found & {"displacement", "force"}:
        return tuple(q for q in ("displacement", "force") if q not in found)
    return ("displacement", "force", "capacitance")


FAMILY = InstrumentFamily("table with a header", 1000, recognise, _enough, verified=True)
