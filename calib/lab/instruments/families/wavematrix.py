"""Instron WaveMatrix: a sheet in, the reason why it is one of its exports out."""

from __future__ import annotations

import re

from calib.lab.instruments.family import InstrumentFamily, channels, holds_capacitance, line_above, needs
from calib.lab.instruments.sheet import Sheet

# A channel with its wiring in brackets, "Position(Linear:Digital Position) (mm)", or counters only WaveMatrix writes.
_CHANNEL = re.compile(r"^\w[\w ]*\([^()]*:[^()]*\)\s*\(")
_COUNTERS = ("elapsed cycles", "cycle elapsed time")


def recognise(sheet: Sheet) -> str:
    """Recognise WaveMatrix by units inside the names, with torque, elapsed cycles, or a channel's wiring in brackets."""
    if holds_capacitance(sheet) or sheet.units_line is not None:
        return ""
    telling = [
        n
        for n in sheet.names
        if _CHANNEL.match(n)
        or re.match(r"torque\s*\(", n, re.IGNORECASE)
        or re.sub(r"\s*\(.*", "", n).strip().lower() in _COUNTERS
    ]
    above = line_above(sheet, r"wavematrix")
    if above is not None:
        return f"{channels(sheet)}, WaveMatrix named in line {above[0]}"
    return f'{channels(sheet)}, with "{telling[0]}" among them, units in the names' if telling else ""


FAMILY = InstrumentFamily("Instron WaveMatrix", 80, recognise, needs("displacement", "force"), verified=False)
