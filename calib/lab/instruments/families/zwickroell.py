"""ZwickRoell testXpert: a sheet in, the reason why it is one of its exports out."""

from __future__ import annotations

from calib.lab.instruments.family import InstrumentFamily, channel_names, channels, named_above, needs
from calib.lab.instruments.sheet import Sheet

_NAMES = ("standardkraft", "standardweg", "standard force", "standard travel", "prüfzeit", "traversenweg absolut")


def recognise(sheet: Sheet) -> str:
    """Recognise ZwickRoell testXpert by its channel names, or by its name above them."""
    above = named_above(sheet, r"testxpert|zwick")
    if above:
        return f"{channels(sheet)}, {above}"
    own = [n for n in channel_names(sheet) if n in _NAMES]
    if not own:
        return ""
    where = f", units in line {sheet.units_line}" if sheet.units_line is not None else ""
    return f'{channels(sheet)}, "{own[0]}" among them{where}'


FAMILY = InstrumentFamily("ZwickRoell testXpert", 60, recognise, needs("displacement", "force"), verified=True)
