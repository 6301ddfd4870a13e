"""From a table with a series capacitance to one with the parallel equivalent."""

from __future__ import annotations

import re
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.labtable import LabTable, Reading, Unread
from models.sensor import FloatArray

# Share of Cs by which Cp may differ from what Cs and D make of it.
_ALIKE = 0.2
# Columns that are not read and from which the loss follows.
# What a note says that a circuit is named beside the record.
_AS_SAID = "is a series capacitance: "
_TELLS_LOSS = ("a resistance or impedance", "an angle")


def as_parallel(table: LabTable, header_line: int, reading: Reading) -> LabTable:
    """Give a table its capacitance as the parallel equivalent, which the model predicts, whatever the meter was set to.

    Cs = Cp (1 + D^2).

    Parameters
    ----------
    table : what was read, with "capacitance_series" among its columns if the file holds a series capacitance.
    header_line : 1-based line of the header, for faults; 0 without one.
    reading : what the user says of the file.

    Returns
    -------
    The table without "capacitance_series", and with a note on what was taken.

    Raises
    ------
    InputError
        If there is Cs but no D, a D above 1 in no unit, or a Cp beside it that is of another capacitor.
    """
    columns = dict(table.columns)
    sources = dict(table.sources)
    written = dict(table.written)
    series = columns.pop("capacitance_series", None)
    source = sources.pop("capacitance_series", "")
    notes = list(table.notes)
    unread = table.unread
    if series is None:
        return table
    if "capacitance" in columns:
        if "capacitance" not in reading.columns:
            _check_alike(table, columns["capacitance"], series, header_line)
        notes.append(f'capacitance is taken from "{sources["capacitance"]}", not from "{source}"')
        unread = (*unread, Unread(f'column "{source}"', f'a series capacitance: "{sources["capacitance"]}" is preferred'))
    elif "dissipation" not in columns:
        told = next((u.what for u in unread if u.reason.startswith(_TELLS_LOSS)), "")
        as_cp = (
            "If D is known to be below 0.01, Cs and Cp differ by less than 0.01 %: then take it as Cp, "
            f"{Choice('columns', (_as_written(source),), 'capacitance')}"
        )
        of_told = (
            f"It follows from {told}: D = 2 pi f Rs Cs, or 1/tan of the angle's size; write it into a column D of the file"
        )
        said = next((note.split(_AS_SAID, 1)[1] for note in table.notes if _AS_SAID in note), "")
        raise InputError(
            Fault(
                f'"{source}" is a series capacitance, and there is no column D to convert it to Cp'
                + (f" ({said})" if said else ""),
                table.path,
                header_line or None,
                advice=f"Log D too, or set the meter to Cp. {of_told if told else as_cp}",
            )
        )
    else:
        _check_loss(table, columns["dissipation"], header_line, reading)
        parallel = series / (1 + columns["dissipation"] ** 2)  # Cs = Cp (1 + D^2)
        parallel.flags.writeable = False
        columns["capacitance"] = parallel
        written["capacitance"] = written.pop("capacitance_series", parallel)
        sources["capacitance"] = source
        share = float(np.nanmax(columns["dissipation"] ** 2, initial=0.0))
        notes.append(f'"{source}" converted to Cp by Cs = Cp (1 + D^2), which changes it by {share:.2g} at most')
    written.pop("capacitance_series", None)
    return replace(
        table,
        columns=MappingProxyType(columns),
        sources=MappingProxyType(sources),
        notes=tuple(notes),
        unread=unread,
        written=MappingProxyType(written),
    )


def _check_loss(table: LabTable, loss: FloatArray, header_line: int, reading: Reading) -> None:
    """Refuse a D above 1, with which a capacitor is a resistance: it may be in per cent, which the name does not say."""
    there, name = loss[np.isfinite(loss)], table.sources.get("dissipation", "D")
    if not there.size or float(np.median(there)) <= 1 or "dissipation" in reading.units or "%" in name:
        return
    choice = Choice("units", ("%", "1"), "dissipation")
    raise InputError(
        Fault(
            f'column "{name}" is {float(np.median(there)):.3g} in most rows, a loss above 1 that would make less than half of '
            f'"{table.sources["capacitance_series"]}": it may be in per cent',
            table.path,
            header_line or None,
            advice=f"Say which: {choice}",
            choice=choice,
        )
    )


def _check_alike(table: LabTable, parallel: FloatArray, series: FloatArray, header_line: int) -> None:
    """Refuse a Cp beside a Cs that is not of the same capacitor."""
    loss = table.columns.get("dissipation", np.zeros(series.size))
    expected = series / (1 + np.where(np.isfinite(loss), loss, 0.0) ** 2)
    off = np.abs(parallel - expected) / np.abs(expected)
    there = off[np.isfinite(off)]
    if not there.size or float(np.median(there)) <= _ALIKE:
        return
    percent = 100 * float(np.median(there))
    names = table.sources["capacitance"], table.sources["capacitance_series"]
    first = Choice("columns", (_as_written(names[0]),), "capacitance")
    second = Choice("columns", (_as_written(names[1]),), "capacitance_series")
    raise InputError(
        Fault(
            f'"{names[0]}" and "{names[1]}" are not of the same capacitor: they differ by {percent:.2g} %',
            table.path,
            header_line or None,
            advice=f"Say which one is meant: {first} or {second}",
            choice=first,
        )
    )


# What the name of a column is shown with where it, or its unit, is the user's or stands elsewhere.
_SHOWN_WITH = re.compile(r"(?:column (?P<number>\d+)|(?P<name>.+?)) \((?:read as .*|.*, declared above|(?P<unit>[^()]*))\)")


def _as_written(source: str) -> str:
    """The name of a column as it may be typed, of one as it is shown.

    >>> [_as_written(shown) for shown in ("Cp (read as pF)", "column 3 (pF)", "Cp (pF, declared above)", "Cp (pF)")]
    ['Cp', '3', 'Cp', 'Cp (pF)']
    """
    match = _SHOWN_WITH.fullmatch(source)
    if match is None or (match["name"] and match["unit"] is not None):
        return source.removeprefix("column ") if re.fullmatch(r"column \d+", source) else source
    return match["number"] or match["name"]
