"""LCR meter log: capacitance (Cp, or Cs with D) over time, force or displacement, with the meter's status."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError
from calib.instruments.columns import headings, names_in, read_columns
from calib.instruments.labtable import Family, LabTable
from calib.instruments.sheet import Sheet
from models.sensor import FloatArray

NAME = "LCR log"


def recognise(sheet: Sheet) -> str:
    """A capacitance column makes an LCR log, unless force and displacement stand beside it."""
    found = {heading.quantity for heading in headings(sheet).values()}
    if not found & {"capacitance", "capacitance_series"} or {"force", "displacement"} <= found:
        return ""
    names = names_in(sheet, ("capacitance", "capacitance_series", "dissipation", "status"))
    return f"the header at line {sheet.header_line} names {', '.join(names)}"


def _requirement(found: frozenset[str]) -> tuple[str, ...]:
    return () if found & {"time", "force", "displacement"} else ("time", "force")


def read(sheet: Sheet, reason: str) -> LabTable:
    """Capacitance as the parallel equivalent Cp [F], over time or a force or displacement column of its own.

    Rows with a status other than 0 and readings such as 9.9E37, 999999, OVER or OV01 are marked as unusable. A series
    capacitance is converted by Cp = Cs / (1 + D^2), row by row.

    Raises
    ------
    InputError
        As `read_columns`; and if there is Cs but no D to convert it.
    """
    return as_parallel(read_columns(sheet, NAME, reason, _requirement), sheet)


def as_parallel(table: LabTable, sheet: Sheet) -> LabTable:
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
                sheet.header_line,
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
    return replace(table, columns=_frozen(columns), sources=MappingProxyType(sources), notes=tuple(notes))


def _frozen(columns: dict[str, FloatArray]) -> Mapping[str, FloatArray]:
    return MappingProxyType(columns)


FAMILY = Family(NAME, recognise, read)
