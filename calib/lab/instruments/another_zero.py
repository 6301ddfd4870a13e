"""From jumps of one channel alone, and remarks on a zero, to what is done about them: faults, notes, rows that are left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.jumps import CAPACITANCES, OVERFLOW, SCALED, UNSHOWN, ZERO, Jump, jumps_of
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import numbers_in
from calib.lab.instruments.offset_blocks import offset_blocks
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.sticking import sticking, told_of_sticking
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from calib.lab.instruments.zero_remarks import Remark, zero_remarks
from models.sensor import FloatArray

# Quantities whose zero is any, so that rows of one zero can be used.
_ZEROED = ("displacement", "force")
# Jumps of rows that come back.
_THERE_AND_BACK = 2
_OFFSET = "an offset, which ends as it began"


@dataclass(frozen=True)
class AnotherZero:
    """What is done about the jumps of a record.

    Attributes
    ----------
    notes, faults : of which readings stay, and for which the record is refused.
    lost : quantity -> row from 0 -> why it is not usable.
    rows : quantity -> rows from 0 from which on its readings have another zero than above.
    """

    notes: list[str]
    faults: list[Fault]
    lost: dict[str, dict[int, str]]
    rows: dict[str, tuple[int, ...]]


def another_zero(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading
) -> AnotherZero:
    """Refuse a record of which one channel jumps from a row on, as no press does, or tell of it where some of it can be used.

    A counter that overflowed, a range or a sign that changed and a capacitance of another offset are refused. A zero that was
    set anew is noted with its row, as rows of one zero can be used together. Of a channel that leaves its course and comes back
    the rows between are left out. A unit that stands in the file and that the user says once more settles it.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    told = AnotherZero([], [], {}, {})
    values = dict(values)
    for quantity, blocks in offset_blocks(values).items():
        column = next(c for c in columns if c.quantity == quantity)
        if is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            continue
        left = values[quantity].copy()
        for last, row, back in blocks:
            if quantity == "force" and sticking(values, range(row, back)):
                told.notes.append(told_of_sticking(sheet, column.index, row, back))
                continue
            rows = [r for r in range(row, back) if np.isfinite(left[r])]
            told.lost.setdefault(quantity, {}).update(dict.fromkeys(rows, _why_lost(sheet, column, last, row, _OFFSET)))
            left[row:back] = np.nan
        values[quantity] = left
    found = jumps_of(values)
    for column in columns:
        jumps = found.get(column.quantity, [])
        if not jumps:
            continue
        confirmed = is_confirmed(sheet, column.index, column.heading, column.factor, reading)
        sure = [j for j in jumps if j.kind in (OVERFLOW, SCALED, ZERO) and not confirmed]
        for jump in sure if column.quantity in CAPACITANCES else ():
            if jump.back:
                rows = [r for r in range(jump.row, jump.back) if np.isfinite(values[column.quantity][r])]
                why = _why_lost(sheet, column, jump.last, jump.row, jump.why)
                told.lost.setdefault(column.quantity, {}).update(dict.fromkeys(rows, why))
        wrong = [j for j in sure if j.kind in (OVERFLOW, SCALED) and not j.back]
        if wrong:
            quantity = stands_for(column.quantity)
            between = ""
            if len(wrong) == _THERE_AND_BACK:
                lines = int(sheet.lines[wrong[0].row]), int(sheet.lines[wrong[1].last])
                between = f"or remove lines {lines[0]} to {lines[1]}, which are then missing; "
            advice = (
                "Save the rows before and behind it in files of their own, or export them from the instrument's own record; "
                f"{between}if the jump is real, let the header name the unit and say it once more: --units {quantity}=..."
            )
            message, line = _in_words(sheet, column, wrong, values, reading), int(sheet.lines[wrong[0].row])
            told.faults.append(Fault(message, sheet.text.path, line, column.index + 1, advice=advice))
            continue
        anew = [j for j in sure if j.kind == ZERO]
        if anew:
            told.rows[column.quantity] = tuple(j.row for j in anew)
        open_ = [j for j in jumps if j not in sure]
        at_open = _changes_there(sheet, [c.index for c in columns], open_)
        told.notes.extend(
            _in_words(sheet, column, jumps, values, reading).replace(UNSHOWN, at_open or UNSHOWN)
            for jumps in (anew, open_)
            if jumps
        )
    _heed(zero_remarks(sheet, [c.index for c in columns]), told, sheet, columns, values, reading)
    return told


def _heed(
    remarks: Sequence[Remark],
    told: AnotherZero,
    sheet: Sheet,
    columns: Sequence[ReadColumn],
    values: Mapping[str, FloatArray],
    reading: Reading,
) -> None:
    """Hold remarks on a zero against the readings: rows of one zero are used together, a capacitance with two is refused."""
    said: dict[str, list[str]] = {}
    for remark in remarks:
        own = [c for c in columns if remark.quantity == _name(c)]
        own = own or ([] if remark.quantity else [c for c in columns if c.quantity in _ZEROED])
        if not own and not remark.quantity and "force" not in values and "displacement" not in values:
            own = [c for c in columns if c.quantity in CAPACITANCES]
        for column in own:
            there = np.isfinite(values[column.quantity])
            if not (np.any(there[: remark.row]) and np.any(there[remark.row :])):
                continue
            if column.quantity in _ZEROED:
                told.rows[column.quantity] = tuple(sorted({*told.rows.get(column.quantity, ()), remark.row}))
                said.setdefault(str(remark), []).append(column.quantity)
            elif is_confirmed(sheet, column.index, column.heading, column.factor, reading):
                told.notes.append(
                    f"{remark} speaks of another zero: the {_name(column)} is read as it is, as its unit was said"
                )
            elif not any(fault.line == remark.line for fault in told.faults):
                message = f"{remark} says that the {_name(column)} may have another zero from there on"
                advice = "Save the rows before and behind it in files of their own; if it means nothing, remove it"
                told.faults.append(Fault(message, sheet.text.path, remark.line, advice=advice))
    told.notes.extend(
        f"{words} says that a zero was set anew: rows of one zero of {' and '.join(dict.fromkeys(of))} are used together"
        for words, of in said.items()
    )


# A column changes at jumps if each of its steps there is so many times any other.
_LARGER = 2.0


def _changes_there(sheet: Sheet, read: Sequence[int], jumps: Sequence[Jump]) -> str:
    """A column that is not read and changes at each of some jumps as nowhere else, in words; "" without one."""
    for index in range(len(sheet.names) if jumps else 0):
        if index in read or not sheet.columns:
            continue
        cells = [c.strip() for c in sheet.columns[index]]
        behind = np.array([jump.row for jump in jumps])
        changed = np.array([a != b for a, b in pairwise(cells)])
        there = np.zeros(changed.size, dtype=bool)
        there[behind - 1] = True
        numbers = numbers_in(cells, sheet.declared_decimal)
        steps = np.abs(np.diff(numbers))
        if not np.all(changed[there]):
            continue
        as_number = np.all(np.isfinite(steps)) and float(steps[there].min()) > _LARGER * float(steps[~there].max(initial=0.0))
        if as_number or np.count_nonzero(changed) <= _LARGER * len(jumps):
            row = jumps[0].row
            name = f'"{sheet.names[index]}"' if sheet.names[index] else str(index + 1)
            return f'what column {name} shows, which changes there from "{cells[row - 1]}" to "{cells[row]}"'
    return ""


def _why_lost(sheet: Sheet, column: ReadColumn, last: int, row: int, why: str) -> str:
    cells = sheet.columns[column.index]
    shown = f'"{cells[last].strip()}", then "{cells[row].strip()}"'
    return f"{_name(column)} alone leaves its course in line {int(sheet.lines[row])} ({shown}) and comes back, as by {why}"


def _name(column: ReadColumn) -> str:
    return stands_for(column.quantity)


def _in_words(
    sheet: Sheet, column: ReadColumn, jumps: Sequence[Jump], values: Mapping[str, FloatArray], reading: Reading
) -> str:
    cells, first = sheet.columns[column.index], jumps[0]
    more = f", and so in {len(jumps) - 1} more places, such as line {int(sheet.lines[jumps[1].row])}" if len(jumps) > 1 else ""
    kind = {"force": ("displacement", *CAPACITANCES), "displacement": ("force", *CAPACITANCES)}
    beside = [q for q in kind.get(column.quantity, ("force", "displacement")) if q in values and q != column.quantity]
    others = " and ".join(dict.fromkeys(stands_for(q) for q in beside))
    alone = f", which {others} do{'es' if len(set(others.split(' and '))) == 1 else ''} not show" if others else ""
    place = f'"{cells[first.last].strip()}", then "{cells[first.row].strip()}" in line {int(sheet.lines[first.row])}'
    unit = unit_in_words(sheet, column.index, column.heading, reading)
    if first.kind == SCALED:
        return (
            f'column "{sheet.names[column.index]}": from this line on the readings are {first.factor:.2g} times what '
            f"those above go on as ({place}){alone}{more}, as by {first.why}"
        )
    size = f"{first.size / column.factor:.5g} {unit}".rstrip()
    return f'column "{sheet.names[column.index]}": the readings jump by {size} ({place}){alone}{more}, as by {first.why}'
