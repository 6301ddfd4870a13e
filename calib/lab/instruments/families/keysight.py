"""LCR meters of Keysight, Agilent and HP: a sheet in, the reason why it is theirs out."""

from __future__ import annotations

from calib.lab.instruments.family import InstrumentFamily, capacitance_log, named_above, needs_of_log
from calib.lab.instruments.sheet import Sheet


def recognise(sheet: Sheet) -> str:
    """Recognise a log of Keysight, Agilent or HP by the name of the maker or of a model above the header."""
    named = named_above(sheet, r"keysight|agilent|hewlett|\bE498\d[A-Z]*\b|\b4284A\b|\b4263B\b")
    log = capacitance_log(sheet)
    return f"{named}; {log}" if named and log else ""


FAMILY = InstrumentFamily("Keysight LCR meter", 20, recognise, needs_of_log, verified=False)
