"""From a `Sheet` to a `LabTable`: columns chosen, units applied, unusable rows given a reason, faults collected."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from types import MappingProxyType

import numpy as np

from calib.errors import Choice, Fault, InputError, capped, in_shell
from calib.lab.instruments.alternating import alternating
from calib.lab.instruments.another_zero import another_zero
from calib.lab.instruments.astray import rows_astray
from calib.lab.instruments.below_zero import counted_below_zero
from calib.lab.instruments.both_marks import with_one_mark
from calib.lab.instruments.brackets import unit_of_joined
from calib.lab.instruments.channel_in_g import load_or_acceleration
from calib.lab.instruments.choice import choose_columns, missing_columns
from calib.lab.instruments.circuit import impossible_loss, shows_deviations, untold_circuit
from calib.lab.instruments.column_words import column_says, few_values
from calib.lab.instruments.conventions import conventions
from calib.lab.instruments.disowned import disowned_in
from calib.lab.instruments.even_steps import even_steps
from calib.lab.instruments.exchanged import exchanged, exchanged_rows
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.footnotes import footnotes
from calib.lab.instruments.footnotes import in_words as of_footnote
from calib.lab.instruments.keys import keys_in_turn, remarks_on_scale, several_records
from calib.lab.instruments.labtable import LabTable, Reading, Unread
from calib.lab.instruments.level_told import level_told
from calib.lab.instruments.lexicon import COMPARED
from calib.lab.instruments.long_form import never_together, one_reading_a_row
from calib.lab.instruments.no_time import counted_time, note_on_time
from calib.lab.instruments.notation import Notation, decide_notation, mark_shown, marks_apart
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.of_other_rows import of_other_rows
from calib.lab.instruments.order import sorted_rows
from calib.lab.instruments.other_clock import clocks_beside, of_another_clock, of_one_time, second_clock, twin_axes
from calib.lab.instruments.own_ways import with_plain_numbers
from calib.lab.instruments.pasted import pasted_beside_clock, pasted_rows
from calib.lab.instruments.press_unread import notes_on_press
from calib.lab.instruments.readings import DAMAGED, ReadColumn, readings_of
from calib.lab.instruments.rescaled import rescaled
from calib.lab.instruments.rivals import holds_clock
from calib.lab.instruments.rounded import Rounded, course_of, rounded_rows
from calib.lab.instruments.rounded import in_words as told_of_rounded
from calib.lab.instruments.row_counts import told_rows
from calib.lab.instruments.rows import OF_RESULTS
from calib.lab.instruments.said_in_rows import with_said_in_rows, words_in_rows
from calib.lab.instruments.sense import sense_of_load
from calib.lab.instruments.series_loss import series_loss
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.shifted import MOVED
from calib.lab.instruments.size import implausible, is_usual_alone, no_press, only_changes
from calib.lab.instruments.spikes import SMOOTH, alone, in_words
from calib.lab.instruments.stalled import stalled
from calib.lab.instruments.started import started_at
from calib.lab.instruments.sticking import sticking, told_of_sticking
from calib.lab.instruments.subseconds import with_subseconds
from calib.lab.instruments.ticks import stated_tick
from calib.lab.instruments.times import begins_anew, copied_rows
from calib.lab.instruments.told import told_otherwise
from calib.lab.instruments.unit_choice import (
    after_raw_counts,
    contradicts,
    of_a_direction,
    results_in_own_units,
    source_of_column,
    unit_in_words,
    unit_of_column,
    weight_in_words,
    words_against,
)
from calib.lab.instruments.upside_down import upside_down
from calib.lab.instruments.validity import compares, said_bad
from calib.lab.instruments.vocabulary import is_of_experiment, unit_of_normal_force, words, words_passed_by
from calib.lab.instruments.where import only_rows, rows_asked
from calib.lab.stretches import stretches
from models.sensor import BoolArray, FloatArray

_ESSENTIAL = ("time", "displacement", "force", "capacitance", "capacitance_series")
_LEVELS = ("capacitance", "capacitance_series")
# What instruments beside each other measure; so many rows without a reading in succession are none that was lost.
_CHANNELS, _PAUSE = ("force", "capacitance", "capacitance_series"), 10
_STATUS_GOOD = ("0.0", "ok", "normal", "good", "")
# No flag is set: "0", "+0", "0x00", "00000000".
_NO_FLAG = re.compile(r"\+?(?:0x|0b)?0+", re.IGNORECASE)


def read_columns(sheet: Sheet, family: InstrumentFamily, reason: str, reading: Reading) -> LabTable:
    """Read the columns of a sheet that are understood into SI, with a reason at each row that is not usable.

    Where several columns stand for one quantity the preferred name is taken and the choice noted, or the user is asked; every
    column that is not read is named in `LabTable.unread`, with the reason.

    Parameters
    ----------
    sheet : the record.
    family, reason : what it was recognised as, and why.
    reading : what the user says of the file.

    Raises
    ------
    InputError
        With every fault: a needed column missing, a choice of columns or of rows that the file leaves open, a unit missing,
        unknown or contradictory, readings of an implausible size, text in a number cell, an ambiguous decimal mark.
    """
    table = _read_rows_asked(sheet, family, reason, reading)
    count, note = told_rows(sheet)
    return replace(table, told_rows=(len(sheet.lines), count), notes=(*table.notes, note)) if count else table


def _read_rows_asked(sheet: Sheet, family: InstrumentFamily, reason: str, reading: Reading) -> LabTable:
    """Read the rows that the user chose, all where none are chosen."""
    if not reading.where:
        return _read_rows(with_said_in_rows(sheet), family, reason, reading)
    asked = rows_asked(sheet, reading)
    table = _read_rows(with_said_in_rows(only_rows(sheet, asked.kept)), family, reason, reading)
    keys = {key.what: key for key in (_unread(sheet, index, "rows are chosen by it") for index in asked.columns)}
    unread = (*asked.others, *(keys.get(unread.what, unread) for unread in table.unread))
    return replace(table, notes=(*asked.notes, *table.notes), unread=unread)


def _read_rows(sheet: Sheet, family: InstrumentFamily, reason: str, reading: Reading) -> LabTable:
    """Read all rows of a sheet."""
    clock = with_subseconds(with_plain_numbers(sheet))
    sheet = clock.sheet
    choice = choose_columns(sheet, family, reading)
    notes, faults, unread = list(choice.notes), [*clock.faults, *choice.faults], dict(choice.unread)
    which = {
        f.choice.key
        for f in choice.faults
        if f.choice is not None and len(f.choice.alternatives) > 1 and f.choice.key in choice.chosen
        if not any(map(is_numeric, sheet.columns[choice.chosen[f.choice.key][0]][:_MARKS_SEEN]))
    }
    validity = said_bad(sheet)
    sheet = replace(sheet, reasons={**validity.rows, **sheet.reasons})
    unread.update({i: why for i, why in validity.columns.items() if i in unread})
    missing = missing_columns(sheet, family, choice, reading)
    one_each = one_reading_a_row(sheet, choice.chosen) if missing else None
    if one_each is not None:
        raise InputError(one_each)
    counted = counted_time(sheet, [i for i, _ in choice.chosen.values()], unread) if missing else ""
    faults += [
        replace(f, advice=f"{counted}. {f.advice}") if counted and f.message.startswith("no time column") else f
        for f in missing
    ]
    if not family.verified:
        notes.append(f"the layout of {family.name} files is built from what is documented of them: check these numbers once")
    columns: list[ReadColumn] = []
    without_unit: set[str] = set()
    around = sheet.lines_around.keys() - dict(sheet.in_every_row).keys()
    noted = footnotes(sheet, ((n, sheet.text.lines[n - 1]) for n in sorted(around) if 0 < n <= len(sheet.text.lines)))
    for quantity, (index, heading) in choice.chosen.items():
        if quantity == "status":
            continue
        of_day = quantity == "time" and holds_clock(sheet.columns[index])
        fault, factor = (None, 1.0) if of_day else unit_of_column(sheet, index, heading, reading)
        if fault is not None and quantity == "frequency":
            unread[index] = "it has no unit of frequency"
            notes.append(f'"{sheet.names[index]}" left out: it has no unit of frequency')
            continue
        if fault is not None:
            faults += [fault] if quantity not in which else []
            without_unit.add(quantity)
        elif not of_day and (own := contradicts(sheet, index, heading, reading)):
            asked = unit_in_words(sheet, index, heading, reading)
            though = f", though the file says {own}" if own != asked else ""
            notes.append(f'"{sheet.names[index]}" is read in {asked} as asked{though}')
        elif quantity not in reading.units:
            notes += [] if of_day else results_in_own_units(sheet, index, quantity, factor)
        elif not of_day and (against := words_against(sheet, index, quantity, factor)):
            asked = unit_in_words(sheet, index, heading, reading)
            notes.append(f'"{sheet.names[index]}" is read in {asked} as asked, though "{against[0]}" says {against[2]}')
        notes += (
            _against_a_tick(sheet, index, factor) if quantity in reading.units and quantity == "time" and not of_day else ()
        )
        columns.append(ReadColumn(index, heading, factor, of_day))
        if (usual := sheet.usual_case_of(index)) and fault is None:
            among = "in a name of capitals " if sheet.names[index].isupper() else ""
            notes.append(f'"{sheet.names[index]}": {among}"{usual.upper()}" is read as {usual}')
        if (usual := sheet.from_small_letters(index)) and fault is None and quantity not in reading.units:
            notes.append(f'"{sheet.names[index]}": in a name of small letters "{usual.lower()}" is read as {usual}')
            faults += of_a_direction(sheet, index, usual)
        if (usual := unit_of_joined(sheet.names[index])) and fault is None and quantity not in reading.units:
            notes.append(f'"{sheet.names[index]}": the end of the name is read as its unit, {usual}')
            faults += of_a_direction(sheet, index, usual) if usual == "N" else []
        if index not in sheet.assigned and is_of_experiment(sheet.names[index]):
            notes.append(f'"{sheet.names[index]}": "exp" is read as of the experiment, not as expected')
        symbol = unit_of_normal_force(sheet.names[index], sheet.unit_below(index))
        if symbol not in ("", "N") and fault is None and quantity not in reading.units:
            notes.append(f'"{sheet.names[index]}": the index is that of a normal force, the unit is {symbol}')
        notes += [of_footnote(sheet.names[index], noted[index])] if index in noted else []
        passed = words_passed_by(sheet.names[index]) if index not in sheet.assigned else ""
        if passed and not any(f'"{sheet.names[index]}"' in note for note in choice.notes):
            notes.append(f'"{sheet.names[index]}": "{passed}" behind its unit is passed by, and not understood')
        unit = heading.unit or sheet.unit_below(index)
        if (unit.startswith("1/1") or re.search(r"[·\u22c5] ?10", unit)) and fault is None:
            notes.append(f'"{sheet.names[index]}" is read as numbers of {unit}')
        notes += weight_in_words(sheet, index, heading, reading) if fault is None else ()
        notes += after_raw_counts(sheet, index, heading) if fault is None and quantity not in reading.units else ()
        if heading.unit and words(heading.unit) == heading.name:
            notes.append(f'"{sheet.names[index]}" is the name of a unit alone: taken as the {quantity}')
        if heading.unit_doubt and fault is None:
            notes.append(f'"{sheet.names[index]}" is read in the unit asked for, though it has {heading.unit_doubt}')
    cells = {c.quantity: _cells(sheet, c.index) for c in columns}
    written = [c for c in columns if not c.clock]
    trusted = sheet.trusted()
    notation = _typed(sheet, written, cells, reading) or decide_notation(
        [_cells(trusted, c.index) for c in written],
        [sheet.names[c.index] for c in written],
        declared=sheet.declared_decimal,
        asked=reading.decimal,
        delimiter=sheet.delimiter,
        beside=cache(lambda: _mark_beside(trusted, [c.index for c in columns])),
        apart_beside=cache(lambda: _apart_beside(trusted, [c.index for c in columns])),
        fits=lambda c, largest: is_usual_alone(written[c].quantity, largest * written[c].factor),
    )
    alike = with_one_mark(sheet, [c.index for c in written]) if notation.conflict else None
    if alike is not None and reading.decimal == ".":
        return _read_rows(alike, family, reason, reading)
    if notation.conflict:
        fault = _notation_fault(sheet, notation, written)
        own = "" if alike is None else 'If each cell has a decimal mark of its own, --decimal "." reads it by that. '
        raise InputError([*faults, replace(fault, advice=f"{own}{fault.advice}")])
    notes += notation.notes
    decimals = dict(zip((c.quantity for c in written), notation.decimals, strict=True))
    reasons = [""] * len(sheet.lines)
    if sheet.cut_short:
        reasons[-1] = "cut short: the file ends within this row"
    values: dict[str, FloatArray] = {}
    for column in columns:
        found = readings_of(sheet, column, cells[column.quantity], decimals.get(column.quantity, ""), reading)
        # Of a time without a unit nothing else can be said.
        # Of words, beside another column that may be meant, the cells are no matter yet.
        without = (column.quantity == "time" and "time" in without_unit) or column.quantity in which
        faults += found.faults if not without else ()
        notes += found.notes
        for r, why in found.rows:
            _append(reasons, r, why)
        # A quantity logged at a lower rate than the others leaves most of its cells empty: that makes no row unusable. Nor
        # does an instrument that began later than the other, or ended earlier.
        n_empty = int(np.count_nonzero(found.empty))
        if len(reasons) / 2 < n_empty < len(reasons):
            name = sheet.names[column.index]
            notes.append(f'"{name}" has a value in {len(reasons) - n_empty} of {len(reasons)} rows only')
        elif column.quantity in _ESSENTIAL or (column.quantity == "dissipation" and "capacitance_series" in choice.chosen):
            blocks = _blocks(found.empty) if column.quantity in _CHANNELS else []
            notes += [_without_value(sheet, column.index, blocks)] if blocks else []
            paused = {r for first, behind in blocks for r in range(first, behind)}
            for r in np.flatnonzero(found.empty).tolist():
                if r not in paused:
                    cell = cells[column.quantity][r].strip()
                    nothing = f"no number, {cell}" if cell[:1] == "#" else "empty cell"
                    _append(reasons, r, f"{nothing}: {column.quantity.removesuffix('_series')}")
        values[column.quantity] = found.values
    places = {q: index for q, (index, _) in choice.chosen.items()}
    if "quality" in values:
        quality = values.pop("quality")
        values["dissipation"] = np.divide(1.0, quality, out=np.full(quality.shape, np.nan), where=quality != 0)
        notes.append(f'dissipation is 1/Q of "{sheet.names[places["quality"]]}"')
    by_resistance = None
    if "capacitance_series" in values and not {"capacitance", "dissipation"} & values.keys():
        by_resistance = series_loss(sheet, places["capacitance_series"], values, notation.decimal)
    if by_resistance is not None:
        values["dissipation"] = by_resistance.values
        notes.append(by_resistance.note)
        unread.pop(by_resistance.index, None)
        for r in np.flatnonzero(np.isnan(by_resistance.values) & np.isfinite(values["capacitance_series"])).tolist():
            _append(reasons, r, f'no reading in "{sheet.names[by_resistance.index]}"')
    elif "capacitance_series" in values and "capacitance" not in values and "dissipation" in values:
        loss = places.get("dissipation", places.get("quality", 0))
        faults += impossible_loss(sheet, loss, values["dissipation"], told="dissipation" in reading.units)
    if "capacitance" in values:
        more, unclear = untold_circuit(sheet, *choice.chosen["capacitance"], values.get("dissipation"))
        notes, faults = notes + more, faults + unclear + shows_deviations(sheet, places["capacitance"])
    notes += level_told(sheet, places[meter]) if (meter := next((q for q in _LEVELS if q in values), "")) else ()
    faults += (
        of_another_clock(sheet, places)
        or second_clock(sheet, places, values, unread, reading)
        or twin_axes(sheet, places, unread, reading)
    )
    notes += of_one_time(sheet, places)
    clocks, told = clocks_beside(sheet, places, unread)
    unread.update(clocks)
    notes += told
    keyed = {q: index for q, index in places.items() if q in values}
    if "force" in values:
        faults += load_or_acceleration(sheet, *choice.chosen["force"], values, reading)
        sense = sense_of_load(sheet, values["force"], places["force"], places.values(), reading.columns)
        notes, faults = [*notes, *sense.notes], [*faults, *sense.faults]
        if sense.index >= 0:
            unread[sense.index], keyed["sense"] = sense.reason, sense.index
        if sense.signs is not None:
            values["force"] = np.where(values["force"] == 0, 0.0, values["force"] * sense.signs)
            for r in np.flatnonzero(np.isnan(sense.signs) & np.isnan(values["force"])).tolist():
                _append(reasons, r, f'"{sheet.names[sense.index]}" does not say which sign the load has')
    faults += several_records(sheet, keyed, values) or never_together(
        sheet, places, values, decimal=notation.decimal, clock=any(c.clock for c in columns if c.quantity == "time")
    )
    notes += keys_in_turn(sheet, keyed) if not faults else ()
    if "time" not in choice.chosen and "time" not in reading.columns:
        notes += [note] if (note := note_on_time(sheet, places.values(), unread)) else []
    notes += notes_on_press(sheet, {*choice.chosen, *reading.columns}, unread)
    factors = {c.quantity: c.factor for c in columns if c.quantity not in without_unit and not c.clock}
    told, remarks = remarks_on_scale(sheet, places, factors, reading)
    named = {c.quantity: (sheet.name_for_asking(c.index), c.index) for c in columns}
    around_and_in = dict.fromkeys((*sheet.lines_around.items(), *words_in_rows(sheet)))
    remarks += disowned_in(around_and_in, named, reading, sheet.text.path)
    notes, faults = [*notes, *told], [*faults, *remarks]
    faults = capped(sorted(faults, key=lambda f: (f.line or 0, f.column or 0)), "faults", 12) if len(faults) > 12 else faults
    again = pasted_rows(values) if not faults else {}
    faults += pasted_beside_clock(sheet, values) if not (again or faults) else ()
    same = "time and readings" if "time" in values else "readings"
    for r in again:
        _append(reasons, r, f"a row above once more, in a block pasted again: the same {same}")
    for array in values.values():
        array[list(again)] = np.nan
    if again:
        first, above = (int(sheet.lines[r]) for r in next(iter(again.items())))
        notes.append(f"{len(again)} row(s) stand twice, the same {same}, and are left out: line {first} is line {above} again")
    rounded: dict[ReadColumn, list[Rounded]] = {}
    if not faults:
        good = np.array([not why for why in reasons])
        for r, why in exchanged_rows(sheet, columns, {q: np.where(good, v, np.nan) for q, v in values.items()}).items():
            _append(reasons, r, why)
            good[r] = False
        unsigned, faults = counted_below_zero(
            sheet, columns, cells, {q: np.where(good, v, np.nan) for q, v in values.items()}, decimals
        )
        for quantity, below in unsigned.items():
            for r, why in below.items():
                _append(reasons, r, why)
                values[quantity][r] = np.nan
        smooth = {q: np.where(good, v, np.nan) for q, v in values.items() if q in SMOOTH}
        for c in (c for c in columns if c.quantity in smooth and c.quantity != "displacement"):
            rounded |= {c: parts} if (parts := rounded_rows(smooth[c.quantity] / c.factor)) else {}
        lone = _alone(smooth, values.get("time"), rounded)
        for first, behind in sticking(smooth, lone.get("force", ()), apart=True):
            notes.append(told_of_sticking(sheet, places["force"], first, behind))
            lone["force"] = {r: near for r, near in lone["force"].items() if not first <= r < behind}
        for quantity, rows in lone.items():
            column = next(c for c in columns if c.quantity == quantity)
            unit = unit_in_words(sheet, column.index, column.heading, reading)
            for r, near in rows.items():
                _append(reasons, r, in_words(cells[quantity][r], near / column.factor, unit))
                values[quantity][r] = np.nan
        faults += implausible(sheet, values, places, decimals, reading)
    faults = faults or of_other_rows(sheet, columns, values, reading) or upside_down(sheet, columns, values, reading)
    if not faults:
        told, faults = rescaled(sheet, columns, values, decimals, reading)
        notes += told
    if faults:
        raise InputError(_with_a_way_out(faults, choice.chosen))
    good = np.array([not why for why in reasons])
    usable = _courses({q: np.where(good, v, np.nan) for q, v in values.items()}, rounded)
    notes += [
        told_of_rounded(sheet.names[c.index], unit_in_words(sheet, c.index, c.heading, reading), sheet.lines, part)
        for c, parts in rounded.items()
        for part in parts
    ]
    contradicting, both, faults = rows_astray(sheet, columns, usable, reading)
    for quantity in contradicting:
        usable[quantity][list(both)] = np.nan
    if contradicting and another_zero(sheet, columns, usable, reading).faults:
        # A counter that overflowed and came back is told as that.
        contradicting, faults = {q: {r: why for r, why in rows.items() if r in both} for q, rows in contradicting.items()}, []
    for quantity, lost in contradicting.items():
        usable[quantity][list(lost)] = np.nan
    faults = [*faults, *exchanged(sheet, columns, usable), *sorted_rows(sheet, columns, usable, reading)]
    still = stalled(sheet, columns, usable, reading)
    if faults := faults or still.faults or alternating(sheet, columns, usable, reading):
        raise InputError(faults)
    filled = even_steps(sheet, [c for c in columns if c not in rounded], usable, reading)
    for left_out in (still.lost, filled):
        for quantity, lost in left_out.items():
            usable[quantity][list(lost)] = np.nan
    zeros = another_zero(sheet, columns, usable, reading)
    faults = [*zeros.faults] or only_changes(sheet, usable, places, reading)
    if not faults and "time" in usable:
        faults = begins_anew(sheet, places["time"], usable["time"])
    contradicted = told_otherwise(sheet, columns, usable, notation.decimal, reading)
    if faults := faults or [*contradicted.faults] or no_press(sheet, usable, places, reading):
        raise InputError(_with_a_way_out(faults, choice.chosen))
    notes += contradicted.notes
    notes += [*still.notes, *zeros.notes]
    for left_out in (contradicting, still.lost, filled, zeros.lost):
        for quantity, lost in left_out.items():
            for r, why in lost.items():
                _append(reasons, r, why)
                values[quantity][r] = np.nan
    if "status" in choice.chosen:
        unread[places["status"]] = "the status of the meter, which says which rows are good"
        cells_of_status = _cells(sheet, places["status"])
        compared = COMPARED if compares(cells_of_status) else ()
        if compared and any(cell.lower() in compared and cell.lower() != "in" for cell in cells_of_status):
            name = sheet.names[places["status"]]
            notes.append(f'"{name}" says which readings are within limits that were set: those above and below are used, too')
        for r, cell in enumerate(cells_of_status):
            good_so = cell.lower() in _STATUS_GOOD or cell.lower() in compared or _NO_FLAG.fullmatch(cell) is not None
            if not good_so and not is_missing(cell):
                _append(reasons, r, f"LCR status {cell[:20]}")
    for r in copied_rows(values):
        _append(reasons, r, "the row before once more: the same time and readings")
    for r, why in sheet.reasons.items():
        # An empty cell at an end of a row that is moved is no cell without a reading, nor is one of a row of results.
        moved = why.startswith((MOVED, OF_RESULTS)) and reasons[r].startswith("empty cell")
        reasons[r] = why if moved or not reasons[r] else reasons[r]
    for array in values.values():
        array.flags.writeable = False
    return LabTable(
        path=sheet.text.path,
        sha256=sheet.text.sha256,
        recognised_as=family.name,
        reason=reason,
        encoding=sheet.text.encoding,
        delimiter=sheet.delimiter,
        decimal=notation.decimal,
        columns=MappingProxyType(values),
        sources=MappingProxyType(
            {
                "dissipation" if c.quantity == "quality" else c.quantity: source_of_column(
                    sheet, c.index, c.heading, reading, clock=c.clock
                )
                for c in columns
            }
            | ({"dissipation": sheet.names[by_resistance.index]} if by_resistance is not None else {})
        ),
        lines=sheet.lines,
        reasons=tuple(reasons),
        notes=(*sheet.notes, *notes),
        unread=(
            *sheet.unread,
            *(_unread(sheet, index, _with_its_words(sheet, index, why)) for index, why in sorted(unread.items())),
        ),
        stages=_stages(sheet, [i for i in unread if i not in validity.columns and i not in places.values()]),
        started=started_at(sheet, values.get("time")),
        sign=reading.sign,
        zeroed=MappingProxyType(zeros.rows),
        conventions=conventions(sheet, values),
        written=MappingProxyType({c.quantity: values[c.quantity] / c.factor for c in columns if c.quantity in _CHANNELS}),
    )


def _against_a_tick(sheet: Sheet, index: int, factor: float) -> list[str]:
    """What to say of counts of a clock that are read in another unit than a line beside the record says one lasts."""
    tick = None if sheet.unit_written(index) else stated_tick(sheet.lines_around)
    if tick is None or np.isclose(tick.seconds, factor, rtol=1e-3, atol=0.0):
        return []
    return [
        f'one count of "{sheet.names[index]}" is read as {factor:.4g} s, as asked, though line {tick.line} says '
        f'"{tick.shown}": if one count lasts that, --units {in_shell("time=" + tick.unit)}'
    ]


def _typed(
    sheet: Sheet, columns: Sequence[ReadColumn], cells: Mapping[str, Sequence[str]], reading: Reading
) -> Notation | None:
    """The decimal marks of a file whose numbers are numbers by its format; None where they are for the cells to show.

    Text cells that held more than a number may have commas yet: these show the mark of their own columns.
    """
    if not sheet.text.typed:
        return None
    of = [cells[c.quantity] for c in columns]
    open_ = [i for i, own in enumerate(of) if "," in "".join(own) and any("," in c and is_numeric(c) for c in own)]
    names = [sheet.names[columns[i].index] for i in open_]
    found = decide_notation([of[i] for i in open_], names, asked=reading.decimal) if open_ else Notation("")
    if found.conflict:
        return replace(found, places=tuple((row, open_[c]) for row, c in found.places))
    own = dict(zip(open_, found.decimals, strict=True))
    notes = [
        f'the numbers in the cells of "{name}" have a decimal comma'
        for name, i in zip(names, open_, strict=True)
        if own[i] == ","
    ]
    decimals = tuple(own.get(i, sheet.text.decimal) for i in range(len(columns)))
    return Notation(sheet.text.decimal, decimals, (*found.notes, *notes))


def _cells(sheet: Sheet, index: int) -> Sequence[str]:
    cells = sheet.columns[index]
    if not sheet.cut_short:
        return cells
    cells = list(cells)
    cells[-1] = ""
    return cells


def _blocks(empty: BoolArray) -> list[tuple[int, int]]:
    """Where cells are empty in many rows in succession: the first row of each such block, and the one behind it."""
    return [(a, b) for a, b in stretches(empty) if _PAUSE <= b - a < empty.size]


def _without_value(sheet: Sheet, index: int, blocks: Sequence[tuple[int, int]]) -> str:
    """What to say of rows without readings of a channel, of which the others are used where the rows can be trusted."""
    first, behind = blocks[0]
    more = f", nor in {sum(b - a for a, b in blocks[1:])} rows farther down" if len(blocks) > 1 else ""
    where = f"lines {sheet.lines[first]} to {sheet.lines[behind - 1]}"
    if all(r in sheet.reasons for a, b in blocks for r in range(a, b)):
        return f'"{sheet.names[index]}" has no value in {where}{more}: these rows are left out, {sheet.reasons[first]}'
    return f'"{sheet.names[index]}" has no value in {where}{more}: what else these rows hold is used'


def _courses(values: Mapping[str, FloatArray], rounded: Mapping[ReadColumn, Sequence[Rounded]]) -> dict[str, FloatArray]:
    """Readings with their course where they are rounded more coarsely than elsewhere: to judge by, not to use."""
    courses = {
        c.quantity: course_of(values[c.quantity], parts, c.factor) for c, parts in rounded.items() if c.quantity in values
    }
    return {**values, **courses}


def _alone(
    values: Mapping[str, FloatArray], time: FloatArray | None, rounded: Mapping[ReadColumn, Sequence[Rounded]]
) -> dict[str, dict[int, float]]:
    """Readings that stand alone, among those that are rounded more coarsely by their course, as that does not scatter."""
    if not rounded:
        return alone(values, time)
    coarse = {c.quantity: np.zeros(values[c.quantity].size, dtype=bool) for c in rounded}
    for c, parts in rounded.items():
        for part in parts:
            coarse[c.quantity][part.first : part.behind] = True
    found = alone({q: np.where(coarse[q], np.nan, v) if q in coarse else v for q, v in values.items()}, time)
    for quantity, rows in alone(_courses(values, rounded), time).items():
        for r in (r for r in rows if quantity in coarse and coarse[quantity][r]):
            found.setdefault(quantity, {})[r] = rows[r]
    return found


def _append(reasons: list[str], row: int, reason: str) -> None:
    reasons[row] = f"{reasons[row]}; {reason}" if reasons[row] else reason


def _with_its_words(sheet: Sheet, index: int, reason: str) -> str:
    """Why a column is not read, and what its cells say."""
    says = column_says(sheet.columns[index], sheet.lines)
    return f"{reason}; it says {says}" if says else reason


def _stages(sheet: Sheet, indices: Collection[int]) -> dict[str, Sequence[str]]:
    """The columns among these that have a few values, and their cells."""
    return {sheet.names[i] or f"column {i + 1}": sheet.columns[i] for i in indices if few_values(sheet.columns[i])}


def _unread(sheet: Sheet, index: int, reason: str) -> Unread:
    name = sheet.names[index]
    return Unread(f'column {index + 1} "{name}"' if name else f"column {index + 1}", reason)


# The likelier mark that may be asked for -> what to say; ".," if either may be right, "" if the user cannot decide.
_SAY_MARK = {
    "": "",
    ",": 'Say --decimal "," if the comma is the decimal mark, --decimal "." if it sets thousands apart ("1,243" for 1243). ',
    ".": 'Say --decimal "." if the point is the decimal mark, --decimal "," if it sets thousands apart ("1.243" for 1243). ',
    ".,": "Say which it is, a point or a comma, by the option --decimal. ",
}


_WITHOUT_TIME = re.compile(r",? or leave (?:it|these|the time) out: --columns time=none")


def _with_a_way_out(faults: Sequence[Fault], chosen: Collection[str]) -> list[Fault]:
    """The faults, without the advice to leave the time out where nothing else ties the readings to a press."""
    if {"force", "displacement"} & set(chosen):
        return list(faults)
    return [replace(fault, advice=_WITHOUT_TIME.sub("", fault.advice), choice=_but_time(fault.choice)) for fault in faults]


def _but_time(choice: Choice | None) -> Choice | None:
    without = choice is not None and (choice.option, choice.key, choice.alternatives) == ("columns", "time", ("none",))
    return None if without else choice


# A time of day with a decimal comma, but for that of milliseconds, which programs write in any language.
_WITH_COMMA = re.compile(r"(?:.*[ T])?\d{1,2}:\d\d(?::\d\d)?,(?:\d{1,2}|\d{4,})")
_TIMES_SEEN = 50
# Cells of a column that is not read that are looked at for their decimal mark.
_MARKS_SEEN = 2000


def _has_commas_of_its_language(cells: Sequence[str]) -> bool:
    """Whether the first cells of a column are times of day with decimal commas, as a program writes all its numbers."""
    there = [c.strip() for c in cells[:_TIMES_SEEN] if c.strip()]
    return len(there) > 2 and all(map(_WITH_COMMA.fullmatch, there))


def _mark_beside(sheet: Sheet, read: Collection[int]) -> tuple[str, str]:
    """The decimal mark that times of day, or columns that are not read, show for the others, and which these are."""
    if any(map(_has_commas_of_its_language, sheet.columns)):
        return ",", "the times of day"
    marks = {i: mark for i, cells in enumerate(sheet.columns) if i not in read and (mark := mark_shown(cells[:_MARKS_SEEN]))}
    first = next(iter(marks), -1)
    return (marks[first], f'"{sheet.names[first]}"') if len({*marks.values()}) == 1 else ("", "")


def _apart_beside(sheet: Sheet, read: Collection[int]) -> dict[str, str]:
    """The marks that set thousands apart in columns that are not read, and the names of these."""
    return marks_apart({name: sheet.columns[i] for i, name in enumerate(sheet.names) if name and i not in read})


def _notation_fault(sheet: Sheet, notation: Notation, columns: Sequence[ReadColumn]) -> Fault:
    shown = " and ".join(
        f'"{sheet.columns[columns[c].index][r].strip()}" (line {sheet.lines[r]}, column "{sheet.names[columns[c].index]}")'
        for r, c in notation.places
    )
    row, column = notation.places[-1] if notation.places else (0, 0)
    mark = notation.askable
    say = f'If all numbers are right as they stand, say --decimal "{mark}". ' if notation.damaged else _SAY_MARK[mark]
    message, advice = f"the decimal mark cannot be told: {notation.conflict}: {shown}", f"{say}{DAMAGED}"
    if notation.against:
        message = f"{notation.conflict}: {shown}"
        advice = f'Say --decimal "{mark}", or leave the option out; where it sets thousands apart, write the numbers without it'
    return Fault(message, sheet.text.path, int(sheet.lines[row]), columns[column].index + 1, advice=advice)
