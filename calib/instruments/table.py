"""Any table with a header whose columns are understood: the reader of last resort."""

from __future__ import annotations

from calib.instruments.columns import headings, read_columns
from calib.instruments.labtable import Family, LabTable
from calib.instruments.lcr import as_parallel
from calib.instruments.sheet import Sheet

NAME = "table with a header"


def recognise(sheet: Sheet) -> str:
    """Everything with a header is a table."""
    return f"the header at line {sheet.header_line} names {', '.join(sheet.names[i] for i in headings(sheet))}"


def _requirement(found: frozenset[str]) -> tuple[str, ...]:
    if "capacitance" in found:
        return () if found & {"time", "force", "displacement"} else ("displacement", "force", "time")
    if found & {"displacement", "force"}:
        return tuple(q for q in ("displacement", "force") if q not in found)
    return ("displacement", "force", "capacitance")


def read(sheet: Sheet, reason: str) -> LabTable:
    """The columns that are understood; force with displacement, or capacitance over anything, or all of them together.

    Of several force columns the raw one is taken: it is what the load cell read, and its zero is a parameter of the model.

    Raises
    ------
    InputError
        As `read_columns` and `lcr.as_parallel`.
    """
    return as_parallel(read_columns(sheet, NAME, reason, _requirement), sheet)


FAMILY = Family(NAME, recognise, read)
