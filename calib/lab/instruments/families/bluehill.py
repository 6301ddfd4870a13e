"""Instron Bluehill: a sheet in, the reason why it is one of its raw data exports out."""

from __future__ import annotations

from calib.lab.instruments.family import InstrumentFamily, channel_names, channels, holds_capacitance, line_above, needs
from calib.lab.instruments.sheet import Sheet

_DISPLACEMENT = (
    *("extension", "displacement", "compressive extension", "compressive displacement"),
    *("traversenweg", "extensión", "位移", "変位"),
)
_FORCE = (
    *("load", "force", "compressive load", "compressive force"),
    *("last", "kraft", "charge", "carga", "载荷", "力", "荷重"),
)
_BLOCK = (
    r"text inputs|specimen label|bluehill|^\"?(general|dimension|method|sample|number inputs)\s*:|is_[tc](?:omp|ens|cyclic)"
)


def recognise(sheet: Sheet) -> str:
    """Recognise Bluehill by its channel names with units in brackets below, its header block, or a specimen number."""
    if holds_capacitance(sheet):
        return ""
    named = channel_names(sheet)
    if not any(n in _DISPLACEMENT or n in _FORCE for n in named):
        return ""
    shown = channels(sheet)
    first = sheet.names[0].strip('"')
    if first.isdigit() and sheet.units_line is not None:
        return f"{shown} after the specimen number {first}, units in line {sheet.units_line} (Bluehill Universal export)"
    block = line_above(sheet, _BLOCK)
    if block is not None:
        return f'{shown}, header block with "{block[1]}" in line {block[0]}'
    if sheet.units_line is not None and "(" in sheet.text.lines[sheet.units_line - 1]:
        return f"{shown}, units in brackets in line {sheet.units_line}"
    both = any(n in _DISPLACEMENT for n in named) and any(n in _FORCE for n in named)
    if both and sheet.units_line is None:
        return f"{shown}, units in the names"
    return ""


FAMILY = InstrumentFamily("Instron Bluehill raw data", 90, recognise, needs("displacement", "force"), verified=True)
