"""GW Instek LCR meters, whose logs may be bare replies: lines of MAIN:PRIM and MAIN:SECO in, a sheet out."""

from __future__ import annotations

import re

from calib.errors import Fault, InputError
from calib.lab.instruments.family import InstrumentFamily, capacitance_log, named_above, needs_of_log
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.replies import NUMBER, TIME, reply_table, time_cell
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText

# `MAIN:PRIM 96.8pF` and then `MAIN:SECO .0045`; OV01 or OVER where there is no reading.
_MAIN = re.compile(
    rf"^\s*{TIME}MAIN:(?P<which>PRIM|SECO)\s+(?P<value>{NUMBER}|[A-Z]{{2,5}}\d{{0,2}})[ \t]*(?P<unit>[a-zA-Zµ]{{0,3}})\s*$"
)
_PREFIX = {"p": "e-12", "n": "e-9", "u": "e-6", "µ": "e-6", "m": "e-3", "": ""}


def cut(text: LabText, _: Reading) -> Sheet | None:
    """Cut a log of bare replies into a sheet; None if the text is no such log.

    The primary values are a column, in farad; the secondary ones are left out, as the log does not say what they are.
    """
    return reply_table(text, _MAIN, _cells)


def _cells(match: re.Match[str]) -> dict[str, str] | None:
    if match["which"] == "SECO":
        return None
    value, unit = match["value"], match["unit"]
    if re.fullmatch(NUMBER, value):
        if not unit.endswith("F") or unit[:-1] not in _PREFIX:
            raise InputError(
                Fault(f'the primary value "{value}{unit}" is not a capacitance', advice="Set the meter to C and D")
            )
        value += _PREFIX[unit[:-1]]
    return {**time_cell(match), "Capacitance (F)": value}


def recognise(sheet: Sheet) -> str:
    """Recognise GW Instek by lines of MAIN:PRIM and MAIN:SECO, or by the name of the maker or of a model above the header."""
    if sheet.names[:1] == ("MAIN:PRIM",) or "MAIN:PRIM" in sheet.names:
        return f"readings of MAIN:PRIM from line {sheet.lines[0]} on"
    named = named_above(sheet, r"gw[ -]?instek|\bLCR-?8\d\d\w?\b")
    log = capacitance_log(sheet)
    return f"{named}; {log}" if named and log else ""


FAMILY = InstrumentFamily("GW Instek LCR meter", 30, recognise, needs_of_log, verified=False, cut=cut)
