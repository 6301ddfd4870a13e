"""LCR meters: how their logs are known, and capacitance as the parallel equivalent whatever the meter was set to."""

from __future__ import annotations

import re
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.labtable import Family, LabTable
from calib.lab.instruments.sheet import Sheet


def _requirement(found: frozenset[str]) -> tuple[str, ...]:
    missing = () if "capacitance" in found else ("capacitance",)
    return missing + (() if found & {"time", "force", "displacement"} else ("time", "force"))


def is_log(sheet: Sheet) -> str:
    """A capacitance column makes an LCR log, unless force and displacement stand beside it."""
    found = sheet.headings()
    quantities = {h.quantity for h in found.values()}
    if not quantities & {"capacitance", "capacitance_series"} or {"force", "displacement"} <= quantities:
        return ""
    shown = ("capacitance", "capacitance_series", "dissipation", "status")
    names = [sheet.names[i] for i, h in found.items() if h.quantity in shown]
    where = f"the header at line {sheet.header_line} names" if sheet.header_line else "as asked, the columns are"
    return f"{where} {', '.join(names)}"


def _named(pattern: str, sheet: Sheet) -> str:
    """Where the maker or the model is named above the header, "" if it is not."""
    for i, line in enumerate(sheet.prelude):
        match = re.search(pattern, line, re.IGNORECASE)
        if match:
            return f'"{match[0]}" in line {i + 1}'
    return ""


# The impedance analysers' way of writing a header: number of the sweep point, parameter[unit].
_HIOKI_NAMES = re.compile(r"^(?:FREQ|Z|PHASE|CS|CP|D|LS|LP|Q|RS|RP|G|X|B|Y)\[[^\]]*\]$")


def hioki(sheet: Sheet) -> str:
    """Hioki: its name or a model above the header, or the parameter[unit] names of its impedance analysers."""
    if not is_log(sheet):
        return ""
    named = _named(r"hioki|\bIM35\d\d\b|\bIM75\d\d\b|\b35(?:06|22|32|04)-?\d*\b", sheet)
    if named:
        return f"{named}; {is_log(sheet)}"
    own = [n for n in sheet.names if _HIOKI_NAMES.match(n)]
    numbered = sheet.names[0].strip().lower().rstrip(".") == "no"
    return f"{is_log(sheet)}, numbered and written as {own[0]}" if own and numbered else ""


def keysight(sheet: Sheet) -> str:
    """Keysight, Agilent or HP: its name or a model above the header."""
    named = _named(r"keysight|agilent|hewlett|\bE498\d[A-Z]*\b|\b4284A\b|\b4263B\b", sheet)
    return f"{named}; {is_log(sheet)}" if named and is_log(sheet) else ""


def gwinstek(sheet: Sheet) -> str:
    """GW Instek: lines of MAIN:PRIM and MAIN:SECO (see `calib.lab.instruments.replies`), or its name above the header."""
    if sheet.names[:1] == ("MAIN:PRIM",) or "MAIN:PRIM" in sheet.names:
        return f"readings of MAIN:PRIM from line {sheet.lines[0]} on"
    named = _named(r"gw[ -]?instek|\bLCR-?8\d\d\w?\b", sheet)
    return f"{named}; {is_log(sheet)}" if named and is_log(sheet) else ""


LCR_METERS = (
    Family("Hioki LCR meter", hioki, _requirement, verified=False),
    Family("Keysight LCR meter", keysight, _requirement, verified=False),
    Family("GW Instek LCR meter", gwinstek, _requirement, verified=False),
    Family("LCR log", is_log, _requirement, verified=True),
)


def as_parallel(table: LabTable, header_line: int) -> LabTable:
    """The table with its capacitance as the parallel equivalent: Cs = Cp (1 + D^2).

    Raises
    ------
    InputError
        If there is Cs but no D.
    """
    columns = dict(table.columns)
    sources = dict(table.sources)
    series = columns.pop("capacitance_series", None)
    source = sources.pop("capacitance_series", "")
    notes = list(table.notes)
    if series is None:
        if "capacitance" in columns and not sources["capacitance"].lower().startswith(("cp", "parallel")):
            notes.append(f'"{sources["capacitance"]}" does not say whether it is Cp or Cs; taken as Cp')
    elif "capacitance" in columns:
        notes.append(f'capacitance is taken from "{sources["capacitance"]}", not from "{source}"')
    elif "dissipation" not in columns:
        raise InputError(
            Fault(
                f'"{source}" is a series capacitance, and there is no column D to convert it to Cp',
                table.path,
                header_line or None,
                advice="Log D too, or set the meter to Cp. If D is known to be below 0.01, Cs and Cp differ by less than "
                '0.01 %: then the column may be renamed to "Cp"',
            )
        )
    else:
        parallel = series / (1 + columns["dissipation"] ** 2)  # Cs = Cp (1 + D^2)
        parallel.flags.writeable = False
        columns["capacitance"] = parallel
        sources["capacitance"] = source
        share = float(np.nanmax(columns["dissipation"] ** 2, initial=0.0))
        notes.append(f'"{source}" converted to Cp by Cs = Cp (1 + D^2), which changes it by {share:.2g} at most')
    return replace(table, columns=MappingProxyType(columns), sources=MappingProxyType(sources), notes=tuple(notes))
