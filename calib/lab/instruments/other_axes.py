"""From the columns that were chosen and those of other axes to the faults of a press that may be along one of these."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.rivals import readings
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import is_unit_of, lab_factor
from calib.lab.instruments.vocabulary import Heading

# A press along z that slides or is tilted changes no more across than this many times what it does along.
_ACROSS = 2.0
# The share of all readings at each end that may be astray.
_ASTRAY = 0.01


def along_another_axis(sheet: Sheet, chosen: Mapping[str, tuple[int, Heading]], unread: Mapping[int, str]) -> list[Fault]:
    """The fault of a force or a place that changes by far less than that of another axis beside it: `Fz` at rest beside `Fx`.

    Parameters
    ----------
    sheet : the record.
    chosen : quantity -> index of its column and its heading; what the user chose is not doubted.
    unread : index -> why a column is not read.
    """
    faults: list[Fault] = []
    across = [i for i, why in unread.items() if why.startswith("axis ")]
    for quantity in ("force", "displacement") if across else ():
        index = chosen[quantity][0] if quantity in chosen else -1
        if index < 0 or index in sheet.assigned or (own := _change(sheet, index, quantity)) is None:
            continue
        others = {i: by for i in across if (by := _change(sheet, i, quantity)) is not None}
        most = max(others, key=others.__getitem__, default=-1)
        if most < 0 or others[most] <= _ACROSS * own:
            continue
        unit = sheet.unit_written(index)
        along, beside = (by / lab_factor(unit, quantity) for by in (own, others[most]))
        choice = Choice("columns", (sheet.name_for_asking(most), sheet.name_for_asking(index)), quantity)
        faults.append(
            Fault(
                f'"{sheet.names[index]}" changes by {along:.3g} {unit}, "{sheet.names[most]}" of another axis by {beside:.3g}: '
                "along which axis it is pressed is not told",
                sheet.text.path,
                sheet.named_at,
                most + 1,
                advice=f"Say which one is meant: {choice}",
                choice=choice,
            )
        )
    return faults


def _change(sheet: Sheet, index: int, quantity: str) -> float | None:
    """By how much a column changes [SI], but for a few readings at the ends; None without a unit of the quantity."""
    unit = sheet.unit_written(index)
    if not is_unit_of(unit or "?", quantity):
        return None
    (values,) = readings([sheet.columns[index]], [lab_factor(unit, quantity)], sheet.declared_decimal)
    there = values[np.isfinite(values)]
    return float(np.ptp(np.quantile(there, [_ASTRAY, 1 - _ASTRAY]))) if there.size > 1 else None
