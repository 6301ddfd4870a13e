"""Mecmesin: a sheet in, the reason why it is an export of VectorPro or Emperor out."""

from __future__ import annotations

from calib.lab.instruments.family import InstrumentFamily, channels, named_above, needs
from calib.lab.instruments.sheet import Sheet


def recognise(sheet: Sheet) -> str:
    """Recognise Mecmesin by its name above, or by event flags beside load and displacement over minutes."""
    above = named_above(sheet, r"mecmesin|vectorpro|emperor")
    if above:
        return f"{channels(sheet)}, {above}"
    events = any(n.strip().lower() in ("event", "events") for n in sheet.names)
    minutes = any(h.quantity == "time" and h.unit in ("min", "mins", "minutes") for h in sheet.headings.values())
    if events and minutes:
        return f"{channels(sheet)}, event flags, time in minutes"
    return ""


FAMILY = InstrumentFamily("Mecmesin", 70, recognise, needs("displacement", "force"), verified=False)
