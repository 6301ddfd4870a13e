"""Instron WaveMatrix: a sheet in, the reason why it is one of its exports out."""

from __future__ import annotations

import re

from calib.lab.instruments.family import InstrumentFamily, channels, holds_capacitance, named_above, needs
from calib.lab.instruments.sheet import Sheet

# A channel with its wiring in brackets, "Position(Linear:Digital Position) (mm)", or the clocks and counters of its own.
_CHANNEL = re.compile(r"^\w[\w ]*\([^()]*:[^()]*\)\s*\(")
_COUNTERS = ("elapsed cycles", "cycle elapsed time")
_TOTALS = ("total time", "total cycles")


def recognise(sheet: Sheet) -> str:
    """Recognise WaveMatrix by its name above, or by its counters, or a channel's wiring in brackets, among names with units."""
    if holds_capacitance(sheet) or sheet.units_line is not None:
        return ""
    plain = [re.sub(r"\s*\(.*", "", n).strip().lower() for n in sheet.names]
    counters = (*_COUNTERS, *(_TOTALS if all(n in plain for n in _TOTALS) else ()))
    telling = [n for n, bare in zip(sheet.names, plain, strict=True) if _CHANNEL.match(n) or bare in counters]
    above = named_above(sheet, r"wavematrix")
    if above:
        return f"{channels(sheet)}, {above}"
    return f'{channels(sheet)}, with "{telling[0]}" among them, units in the names' if telling else ""


FAMILY = InstrumentFamily("Instron WaveMatrix", 80, recognise, needs("displacement", "force"), verified=False)
