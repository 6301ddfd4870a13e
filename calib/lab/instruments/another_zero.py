"""From the jumps that one channel of a record makes alone to what is done about them: faults, notes, rows that are left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.jumps import CAPACITANCES, Jump, jumps_of
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.unit_choice import is_confirmed
from calib.lab.instruments.units import IN_PLACE_OF
from models.sensor import FloatArray

# A displacement that was set to zero reads this share of the jump at most.
_AT_ZERO = 0.03


def another_zero(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading
) -> tuple[list[str], list[Fault], dict[str, dict[int, str]]]:
    """Refuse a record of which one channel jumps from a row on, as no press does, or tell of it where it may have happened.

    A displacement that was set to zero is noted, as rows of one zero can be used. Of a capacitance that leaves its course and
    comes back the rows between are left out. A unit that stands in the file and that the user says once more settles the rest.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.

    Returns
    -------
    Notes, faults, and quantity -> row from 0 -> why it is not usable.
    """
    notes: list[str] = []
    faults: list[Fault] = []
    left_out: dict[str, dict[int, str]] = {}
    found = jumps_of(values)
    for column in columns:
        jumps = found.get(column.quantity, [])
        confirmed = bool(jumps) and is_confirmed(sheet, column.index, column.heading, column.factor, reading)
        lost = [] if confirmed else [j for j in jumps if j.back]
        for jump in lost:
            rows = [r for r in range(jump.row, jump.back) if np.isfinite(values[column.quantity][r])]
            why = _why_lost(sheet, column, jump)
            left_out.setdefault(column.quantity, {}).update(dict.fromkeys(rows, why))
        sure = [j for j in jumps if j.sure and j not in lost]
        anew = [j for j in sure if _is_set_to_zero(column.quantity, j, values[column.quantity])]
        wrong = [] if len(anew) == len(sure) or confirmed else sure
        if wrong:
            line = int(sheet.lines[wrong[0].row])
            quantity = IN_PLACE_OF.get(column.quantity, column.quantity)
            advice = (
                "Save the rows before and behind it in files of their own, or export them from the instrument's own record; if "
                f"the jump is real, let the header name the unit and say it once more: --units {quantity}=..."
            )
            message = f"{_in_words(sheet, column, wrong, values)}: {wrong[0].why}"
            faults.append(Fault(message, sheet.text.path, line, column.index + 1, advice=advice))
            continue
        for told, ending in (
            (sure if confirmed else [], "read as it stands, as asked"),
            ([] if confirmed else anew, "its zero was set anew there"),
            ([j for j in jumps if not j.sure], ""),
        ):
            if told:
                lines = f" (line {int(sheet.lines[told[0].row])})"
                notes.append(f"{_in_words(sheet, column, told, values)}{lines}: {ending or told[0].why}")
    return notes, faults, left_out


def _is_set_to_zero(quantity: str, jump: Jump, values: FloatArray) -> bool:
    return quantity == "displacement" and abs(float(values[jump.row])) <= _AT_ZERO * abs(jump.size)


def _why_lost(sheet: Sheet, column: ReadColumn, jump: Jump) -> str:
    cells = sheet.columns[column.index]
    shown = f'"{cells[jump.last].strip()}", then "{cells[jump.row].strip()}"'
    return f"{_name(column)} alone leaves its course in line {int(sheet.lines[jump.row])} ({shown}) and comes back: {jump.why}"


def _name(column: ReadColumn) -> str:
    return IN_PLACE_OF.get(column.quantity, column.quantity)


def _in_words(sheet: Sheet, column: ReadColumn, jumps: Sequence[Jump], values: Mapping[str, FloatArray]) -> str:
    cells, first = sheet.columns[column.index], jumps[0]
    more = f", and so in {len(jumps) - 1} more places, such as line {int(sheet.lines[jumps[1].row])}" if len(jumps) > 1 else ""
    kind = {"force": ("displacement", *CAPACITANCES), "displacement": ("force", *CAPACITANCES)}
    beside = [q for q in kind.get(column.quantity, ("force", "displacement")) if q in values and q != column.quantity]
    others = " and ".join(dict.fromkeys(IN_PLACE_OF.get(q, q) for q in beside))
    alone = f", which {others} do{'es' if len(set(others.split(' and '))) == 1 else ''} not show" if others else ""
    return (
        f'column "{sheet.names[column.index]}": from this line on the readings have jumped by {first.size / column.factor:.5g} '
        f'("{cells[first.last].strip()}", then "{cells[first.row].strip()}"){alone}{more}'
    )
