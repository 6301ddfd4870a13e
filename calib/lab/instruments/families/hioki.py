"""Hioki LCR meters and impedance analysers: a sheet in, the reason why it is theirs out."""

from __future__ import annotations

import re

from calib.lab.instruments.family import InstrumentFamily, capacitance_log, named_above, needs_of_log
from calib.lab.instruments.sheet import Sheet

# The impedance analysers' way of writing a header: number of the sweep point, parameter[unit].
_NAMES = re.compile(r"^(?:FREQ|Z|PHASE|CS|CP|D|LS|LP|Q|RS|RP|G|X|B|Y)\[[^\]]*\]$")


def recognise(sheet: Sheet) -> str:
    """Recognise Hioki by its name or a model above the header, or by the parameter[unit] names of impedance analysers."""
    log = capacitance_log(sheet)
    if not log:
        return ""
    named = named_above(sheet, r"hioki|\bIM35\d\d\b|\bIM75\d\d\b|\b35(?:06|22|32|04)-\d\d\b")
    if named:
        return f"{named}; {log}"
    own = [n for n in sheet.names if _NAMES.match(n)]
    numbered = sheet.names[0].strip().lower().rstrip(".") == "no"
    return f"{log}, numbered and written as {own[0]}" if own and numbered else ""


FAMILY = InstrumentFamily("Hioki LCR meter", 10, recognise, needs_of_log, verified=False)
