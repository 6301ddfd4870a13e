"""From a table with a series capacitance to one with the parallel equivalent."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.labtable import LabTable, Unread


def as_parallel(table: LabTable, header_line: int) -> LabTable:
    """Give a table its capacitance as the parallel equivalent, which the model predicts, whatever the meter was set to.

    Cs = Cp (1 + D^2).

    Parameters
    ----------
    table : what was read, with "capacitance_series" among its columns if the file holds a series capacitance.
    header_line : 1-based line of the header, for faults; 0 without one.

    Returns
    -------
    The table without "capacitance_series", and with a note on what was taken.

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
    unread = table.unread
    if series is None:
        return table
    if "capacitance" in columns:
        notes.append(f'capacitance is taken from "{sources["capacitance"]}", not from "{source}"')
        unread = (*unread, Unread(f'column "{source}"', f'a series capacitance: "{sources["capacitance"]}" is preferred'))
    elif "dissipation" not in columns:
        raise InputError(
            Fault(
                f'"{source}" is a series capacitance, and there is no column D to convert it to Cp',
                table.path,
                header_line or None,
                advice="Log D too, or set the meter to Cp. If D is known to be below 0.01, Cs and Cp differ by less than "
                f'0.01 %: then take it as Cp, --columns "capacitance={source}"',
            )
        )
    else:
        parallel = series / (1 + columns["dissipation"] ** 2)  # Cs = Cp (1 + D^2)
        parallel.flags.writeable = False
        columns["capacitance"] = parallel
        sources["capacitance"] = source
        share = float(np.nanmax(columns["dissipation"] ** 2, initial=0.0))
        notes.append(f'"{source}" converted to Cp by Cs = Cp (1 + D^2), which changes it by {share:.2g} at most')
    return replace(
        table, columns=MappingProxyType(columns), sources=MappingProxyType(sources), notes=tuple(notes), unread=unread
    )
