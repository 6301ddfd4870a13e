"""From a `Sheet` to the fault of one whose rows hold one reading each, of one quantity or another (`time, channel, value`)."""

from __future__ import annotations

import json
import shlex
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.brackets import unit_of_small_letters
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import stands_for
from calib.lab.instruments.vocabulary import understand
from models.sensor import FloatArray

# Names of quantities that such a column may hold, and how often each does at least.
_MOST, _FEWEST = 64, 4


def one_reading_a_row(sheet: Sheet, found: Collection[str]) -> Fault | None:
    """Find a column that names the quantity of each row, where two or more that a press needs stand below one another, or one.

    Parameters
    ----------
    sheet : the record.
    found : quantities that have a column.

    Returns
    -------
    The fault, with how the rows become those of a press; None if there is no such column.
    """
    for at, column in enumerate(sheet.columns[: len(sheet.names)]):
        first = next((c.strip() for c in column if c.strip()), "")
        if not first or is_numeric(first) or is_missing(first):
            continue
        cells = [c.strip() for c in column]
        named = list(dict.fromkeys(cells))
        if len(named) > _MOST or min(cells.count(name) for name in named) < _FEWEST:
            continue
        if (alone := _of_one(sheet, at, named, found)) is not None:
            return alone
        meant = {stands_for(h.quantity) for name in named if (h := understand(name)) is not None}
        if len((meant & {"force", "displacement", "capacitance"}) - {stands_for(q) for q in found}) < 2:
            continue
        name = sheet.names[at] or f"column {at + 1}"
        listed = ", ".join(f'"{n}"' for n in named)
        return Fault(
            f'each row holds one reading: column "{name}" says of which quantity, {listed}',
            sheet.text.path,
            sheet.named_at,
            at + 1,
            advice=f'Give each a column of its own, with its unit in the name ("Load (N)"), and each time one row: by a '
            f'pivot table of a workbook with "{name}" as its columns, or by DataFrame.pivot(columns="{name}", ...) of pandas',
        )
    return None


def _of_one(sheet: Sheet, at: int, named: Sequence[str], found: Collection[str]) -> Fault | None:
    """The fault of a column that names one quantity in all rows, where one column of numbers alone is not understood."""
    of = understand(named[0]) if len(named) == 1 else None
    values = [i for i, cells in enumerate(sheet.columns[: len(sheet.names)]) if is_numeric(cells[0]) and not sheet.assigned]
    values = [i for i in values if understand(sheet.names[i]) is None]
    if of is None or of.quantity not in ("force", "displacement", "capacitance") or of.quantity in found or len(values) != 1:
        return None
    said = Choice("columns", (sheet.name_for_asking(values[0]),), of.quantity)
    unit = Choice("units", (of.unit or unit_of_small_letters(named[0]) or "...",), of.quantity)
    return Fault(
        f'column "{sheet.names[at]}" says of every row that it is of "{named[0]}", which "{sheet.names[values[0]]}" may hold',
        sheet.text.path,
        sheet.header_line or None,
        at + 1,
        advice=f"If so: {said} {unit}",
    )


def never_together(
    sheet: Sheet, places: Mapping[str, int], values: Mapping[str, FloatArray], *, decimal: str, clock: bool
) -> list[Fault]:
    """Refuse a force and a displacement that never stand in one row, with how readings between others are put beside these.

    Parameters
    ----------
    sheet, places : the record, and quantity -> its column.
    values : in SI, (n_row,) each.
    decimal : mark of its numbers.
    clock : whether the time is one of times of day.
    """
    if not {"force", "displacement"} <= values.keys():
        return []
    there = [np.isfinite(values[quantity]) for quantity in ("displacement", "force")]
    if min(map(np.count_nonzero, there)) < _FEWEST or np.any(there[0] & there[1]):
        return []
    names = [sheet.names[places[quantity]] for quantity in ("displacement", "force")]
    mark, above = sheet.delimiter, sheet.header_line - 1
    table = sheet.header_line and mark in (",", ";", "\t") and sheet.units_line is None and not sheet.text.typed
    file, new, how = json.dumps(sheet.text.path.name), json.dumps(f"new_{sheet.text.path.name}"), f"sep={json.dumps(mark)}"
    how += f', decimal="{decimal}"'
    command = (
        f"import pandas; t = pandas.read_csv({file}, {how}, header={above}, index_col={places['time']}, "
        f'skip_blank_lines=False); t.interpolate("index").dropna().to_csv({new}, {how})'
        if table and "time" in places and not clock
        else ""
    )
    by_python = f"; on straight lines over the time, Python does it: python -c {shlex.quote(command)}" if command else ""
    return [
        Fault(
            f'"{names[0]}" and "{names[1]}" have no reading in the same row, so that no row holds a press',
            sheet.text.path,
            int(sheet.lines[0]),
            advice="Export the record so that each time is one row with all its readings; else write into the empty cells what "
            f"each channel has between its own{by_python}",
        )
    ]
