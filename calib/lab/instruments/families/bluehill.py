"""Instron Bluehill: a sheet in, the reason why it is one of its raw data exports out."""

from __future__ import annotations

from calib.lab.instruments.family import (
    InstrumentFamily,
    channel_names,
    channels,
    holds_capacitance,
    line_above,
    named_above,
    needs,
)
from calib.lab.instruments.sheet import Sheet

_DISPLACEMENT = ("extension", "displacement", "traversenweg", "extensión", "位移", "変位")
_FORCE = ("load", "force", "last", "kraft", "charge", "carga", "载荷", "力", "荷重")
# Names that nothing but Bluehill gives its channels.
_OWN = ("compressive extension", "compressive load", "compressive displacement", "compressive force")
# Of the others those in pairs that many programs write: Bluehill's only by what stands around them.
_COMMON = ("displacement", "force")
# Lines of its header block, each with a group before the name of an item, and the endings of its methods.
_BLOCK = (
    r"^\W*(?:(?:text|number|choice) inputs : |general : start date|dimension : [\w ]+\W+\d|rate : rate \d)"
    r"|\.is_[tc](?:omp|ens|cyclic)"
)


def recognise(sheet: Sheet) -> str:
    """Recognise Bluehill by its own marks: header block, specimen number, channel names, units in brackets in a row below.

    A table of time, displacement and force without one of these is anybody's.
    """
    if holds_capacitance(sheet):
        return ""
    named = channel_names(sheet)
    if not any(n in (*_DISPLACEMENT, *_FORCE, *_OWN) for n in named):
        return ""
    shown = channels(sheet)
    first = sheet.names[0].strip('"')
    if first.isdecimal() and sheet.units_line is not None:
        return f"{shown} after the specimen number {first}, units in line {sheet.units_line} (Bluehill Universal export)"
    block = line_above(sheet, _BLOCK)
    if block is not None:
        return f'{shown}, header block with "{block[1]}" in line {block[0]}'
    if program := named_above(sheet, "(?:instron )?bluehill"):
        return f"{shown}, {program}"
    own = next((sheet.names[i] for i, h in sheet.headings.items() if h.name in _OWN), "")
    if own:
        return f'{shown}, "{own}" among them'
    pair = any(n in _DISPLACEMENT for n in named) and any(n in _FORCE for n in named)
    below = sheet.text.lines[sheet.units_line - 1] if sheet.units_line is not None else ""
    if pair and not all(n in _COMMON for n in named if n in (*_DISPLACEMENT, *_FORCE)) and below.count("(") > 2:
        return f"{shown}, units in brackets in line {sheet.units_line}"
    return ""


FAMILY = InstrumentFamily("Instron Bluehill raw data", 90, recognise, needs("displacement", "force"), verified=True)
