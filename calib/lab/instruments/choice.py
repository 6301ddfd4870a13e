"""From a `Sheet` to which of its columns stand for which quantity, why the others are not read, and what is a choice."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.brackets import words_in
from calib.lab.instruments.circuit import OF_METER, circuit_beside_unit, names_parallel, said_circuit
from calib.lab.instruments.clock import read_clock
from calib.lab.instruments.clock_cells import is_reading
from calib.lab.instruments.clock_words import in_figures
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.lexicon import MOVING, OF_TESTERS, PRESSING, STEP_TIMES
from calib.lab.instruments.meanings import is_channel
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.other_axes import along_another_axis
from calib.lab.instruments.passed_by import tells_how_measured
from calib.lab.instruments.preference import PossibleColumn, best_of, first_cell, in_words, other_clock
from calib.lab.instruments.rivals import add_up, difference, goes_back, holds_clock, moves_with, readings, stands_still
from calib.lab.instruments.said_in_rows import circuits_in_turn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.times import clocks_by_cells, date_column
from calib.lab.instruments.units import is_mass, is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import (
    EXAMPLE,
    MAY_BE_A_CHANGE,
    NEEDS_UNIT,
    Heading,
    as_a_mean,
    as_a_record,
    heading_as,
    understand,
    understood_names,
    why_unread,
)
from calib.lab.instruments.where import asked_name
from models.sensor import FloatArray


@dataclass(frozen=True)
class ColumnChoice:
    """Which columns are read, and what is to be said of all others.

    Attributes
    ----------
    chosen : quantity -> index of its column and its heading.
    unread : index -> why a column is not read.
    notes : choices made, one sentence each.
    faults : choices that the file does not tell.
    """

    chosen: Mapping[str, tuple[int, Heading]]
    unread: Mapping[int, str]
    notes: tuple[str, ...]
    faults: tuple[Fault, ...]


def choose_columns(sheet: Sheet, family: InstrumentFamily, reading: Reading) -> ColumnChoice:
    """Choose which column of a file stands for which quantity: by the user's word, else by the preferred name.

    A column that stands still gives way to one that moves, one that was worked on to one that was not, and one whose unit or
    name is in doubt to one that is plain. Columns that agree but for their zero and sign are decided by the preferred name; of
    those that differ beyond that the user must choose, but for a raw force, which is preferred to a corrected one, and for a
    name with a number or letter (Load 2), which gives way to one without.

    Parameters
    ----------
    sheet : the record.
    family : what it was recognised as.
    reading : what the user says of the file.
    """
    sheet = sheet.trusted()
    headings, unread, notes, faults = _in_circuit(sheet, reading)
    unread.update({i: why for i, why in sheet.set_aside.items() if i < len(sheet.names)})
    headings = _without_stray_letters(sheet, headings, family, unread)
    by_cells = _clocks_by_cells(sheet, headings, unread)
    headings |= by_cells
    by_axis = _x_alone(sheet, headings, unread)
    headings |= by_axis
    by_unit, by_function = sheet.alone_in_unit(), sheet.by_function()
    headings = {i: h for i, h in headings.items() if i not in by_unit or i in sheet.assigned or _goes_with(sheet, i, headings)}
    headings, passed_by = _with_words_passed_by(sheet, headings)
    by_quantity: dict[str, list[PossibleColumn]] = {}
    for index, heading in headings.items():
        by_quantity.setdefault(heading.quantity, []).append(PossibleColumn(index, heading))
    chosen: dict[str, tuple[int, Heading]] = {}
    for quantity, candidates in by_quantity.items():
        asked = [c for c in candidates if c.index in sheet.assigned]
        if asked:
            chosen[quantity] = asked[0].index, asked[0].heading
            notes.append(f'{quantity} is taken from "{_shown(sheet, asked[0].index)}" as asked')
            faults += other_clock(sheet, asked[0].index, reading).faults if quantity == "time" else ()
            continue
        best, more = best_of(sheet, quantity, candidates, reading, _index_of_asked(sheet))
        unread.update(more.unread)
        notes += more.notes
        faults += more.faults
        if best is not None:
            chosen[quantity] = best.index, best.heading
            notes += [_by_cells_note(sheet, best.index)] if best.index in by_cells else []
            others = sum(is_unit_of(sheet.unit_written(i) or "?", "displacement") for i in range(len(sheet.names))) > 1
            moves = " that moves" if others else ""
            notes += [_BY_AXIS.format(sheet.names[best.index], moves)] if best.index in by_axis else []
            notes += [_by_unit_note(sheet, best.index, best.heading)] if best.index in by_unit else []
            notes += _of_channel_or_reach(sheet, best.index, best.heading) if best.index not in by_unit else ()
            notes += [_by_function_note(sheet, best.index, quantity)] if best.index in by_function else []
            notes += [_passed_by_note(sheet, best.index, quantity, passed_by[best.index])] if best.index in passed_by else []
            of_rest = _at_rest(sheet, quantity, candidates)
            moves_at_rest = (
                bool(of_rest) and _runs_through(_alone(sheet, best.index)) and _goes_with(sheet, best.index, headings)
            )
            faults += [] if moves_at_rest else of_rest
            notes += [_NOT_AT_REST.format(sheet.names[best.index])] if moves_at_rest else []
    notes += _made_records(sheet, chosen, {*by_cells, *by_axis, *by_unit, *by_function})
    notes += _without_empty_capacitance(sheet, chosen, unread)
    notes += _letter_of_a_place(sheet, chosen)
    _drop_what_has_no_use(sheet, chosen, unread, faults)
    notes += _rest(sheet, chosen, unread, faults)
    faults += along_another_axis(sheet, chosen, unread)
    return ColumnChoice(chosen, unread, tuple(notes), tuple(faults))


def _clocks_by_cells(sheet: Sheet, headings: Mapping[int, Heading], unread: Mapping[int, str]) -> dict[int, Heading]:
    """The headings of columns that are clocks by their cells, or the time of one step, where no other is the time."""
    if "time" in {h.quantity for h in headings.values()} or "time" in sheet.assigned.values():
        return {}
    left = [i for i in range(len(sheet.names)) if i not in headings and i not in unread and _says_nothing(sheet, i)]
    clocks = clocks_by_cells(sheet, left) or [i for i in left if _is_time_of_one_step(sheet, i)]
    return {i: heading_as("time", sheet.names[i], sheet.unit_below(i)) for i in clocks}


def _is_time_of_one_step(sheet: Sheet, index: int) -> bool:
    """Whether a column is called the time within a step, has a unit of time, and never begins anew."""
    heading = heading_as("time", sheet.names[index], sheet.unit_below(index))
    if heading.name not in STEP_TIMES or not is_unit_of(heading.unit or sheet.unit_below(index), "time"):
        return False
    values = _alone(sheet, index)
    return not stands_still(values) and not goes_back(values)


def _alone(sheet: Sheet, index: int) -> FloatArray:
    return readings([sheet.columns[index]], [1.0], sheet.declared_decimal)[0]


_BY_AXIS = 'displacement is taken from "{}", the only column of a length{}: if it is none, --columns displacement=none'


def _x_alone(sheet: Sheet, headings: Mapping[int, Heading], unread: Mapping[int, str]) -> dict[int, Heading]:
    """The heading of a column "x" in a unit of length, where no other is a displacement or has such a unit and moves.

    Beside one that stands still, such as x or the thickness d of the sample, it may be called "y", too.
    """
    lengths = [i for i in range(len(sheet.names)) if is_unit_of(sheet.unit_written(i) or "?", "displacement")]
    still = [i for i in lengths if stands_still(_alone(sheet, i))] if len(lengths) > 1 else []
    known = {i: h for i, h in headings.items() if not (i in still and h.letter)}
    there = {stands_for(h.quantity) for h in known.values()} | set(sheet.assigned.values())
    if "displacement" in there or not there & {"force", "capacitance"}:
        return {}
    moving = [i for i in lengths if i not in still]
    if len(moving) != 1 or moving[0] in unread or moving[0] in headings:
        return {}
    axis = "[xy]" if still else "x"
    alone = re.fullmatch(rf"{axis}(?:\s*[(\[].*|[\s_,/]+\S+)?", sheet.names[moving[0]].strip(), re.IGNORECASE) is not None
    return {i: heading_as("displacement", sheet.names[i], sheet.unit_below(i)) for i in moving if alone}


def _goes_with(sheet: Sheet, index: int, headings: Mapping[int, Heading]) -> bool:
    """Whether the readings of a column that is a quantity by its unit alone fit it: a time never falls, others go together."""
    quantity, values = headings[index].quantity, _alone(sheet, index)
    if quantity == "time":
        return holds_clock(sheet.columns[index]) or not (stands_still(values) or goes_back(values))
    others = [i for i, h in headings.items() if i != index and stands_for(h.quantity) in _TOGETHER]
    ranks = [np.argsort(np.argsort(_alone(sheet, i))) for i in (index, *others)]
    there = not stands_still(values) and np.isfinite(values).sum() > 2
    return there and (not others or max(abs(np.corrcoef(ranks[0], rank)[0, 1]) for rank in ranks[1:]) > 0.5)


_TOGETHER = ("displacement", "force", "capacitance")


def _with_words_passed_by(sheet: Sheet, headings: Mapping[int, Heading]) -> tuple[dict[int, Heading], dict[int, str]]:
    """The headings, without the doubt by words in brackets of how they are measured, and these words: index -> words.

    That is so where no other column is of the quantity by its name, or in a unit of it, and the readings fit it.
    """
    kept, words = dict(headings), {}
    for index, heading in headings.items():
        said, quantity = heading.not_understood, heading.quantity
        if not said or index in sheet.assigned or quantity not in _BY_WORDS:
            continue
        others = [
            i
            for i, name in enumerate(sheet.names)
            if i != index
            and (
                is_unit_of(sheet.unit_written(i) or "?", quantity)
                or ((h := as_a_record(name, sheet.unit_below(i)) if name else None) is not None and h.quantity == quantity)
            )
        ]
        if not others and all(tells_how_measured(part, quantity) for part in said) and _goes_with(sheet, index, headings):
            kept[index] = replace(heading, name_doubt="", not_understood=())
            words[index] = ", ".join(said)
    return kept, words


# The level of a capacitance matters, and in which circuit it is measured.
_BY_WORDS = ("time", "displacement", "force")


def _passed_by_note(sheet: Sheet, index: int, quantity: str, words: str) -> str:
    return (
        f'{quantity} is taken from "{sheet.names[index]}": "{words}" in its name is passed by, and no other column is the '
        f"{quantity} or in such a unit"
    )


def _by_unit_note(sheet: Sheet, index: int, heading: Heading) -> str:
    name, unit, quantity = sheet.names[index], sheet.unit_written(index) or sheet.names[index], heading.quantity
    why = "a letter with more than any capacitor has" if heading.letter else f"the only column in {unit}"
    return f'{quantity} is taken from "{name}", {why}: if it is something else, --columns {quantity}=none'


# How far an instrument reaches, right behind the name of its quantity: "Force 50N (N)".
_REACH = re.compile(r"(?<![\w.,])(?P<reach>\d+(?:[.,]\d+)?\s?(?P<unit>[^\W\d_]{1,3}))(?![\w)\]])")


def _of_channel_or_reach(sheet: Sheet, index: int, heading: Heading) -> tuple[str, ...]:
    """What to say of a column that nothing but a number of a channel and a unit names, or with a reach that is passed by."""
    name, quantity = sheet.names[index], heading.quantity
    if is_channel(heading.name) and (unit := sheet.unit_written(index)):
        said = f"a channel, by its unit {unit}: if it is something else, --columns {quantity}=none"
        return (f'{quantity} is taken from "{name}", {said}',)
    reach = _REACH.search(name) if any(map(str.isdigit, heading.index)) and not heading.index.isdecimal() else None
    if reach is not None and is_unit_of(reach["unit"], stands_for(quantity)):
        return (f'"{reach["reach"]}" in "{name}" is passed by, as how far the instrument reaches',)
    return ()


def _by_function_note(sheet: Sheet, index: int, quantity: str) -> str:
    return f'{quantity} is taken from "{sheet.names[index]}", as "{sheet.by_function()[index][1]}" above says'


def _says_nothing(sheet: Sheet, index: int) -> bool:
    """Whether the name of a column tells nothing of what it is."""
    reason = why_unread(sheet.names[index], sheet.unit_below(index)) if sheet.names[index] else ""
    return reason in ("", "not understood", "names of the rows: not used")


def _by_cells_note(sheet: Sheet, index: int) -> str:
    if not holds_clock(sheet.columns[index]):
        return f'"{_shown(sheet, index)}" is taken as the time: it never begins anew, as if the record were one step'
    dated = "-" in (first := in_figures(first_cell(sheet, index)).text) or "/" in first or first.count(".") > 1
    of_day = dated or read_clock(sheet.columns[index][:_FEW_CELLS]).of_day
    what = "dates with times of day" if dated else "times of day" if of_day else "durations"
    return f'"{_shown(sheet, index)}" is taken as the time, as its cells are {what}'


# Cells that show how times are written.
_FEW_CELLS = 50


def _made_records(sheet: Sheet, chosen: Mapping[str, tuple[int, Heading]], told: Collection[int]) -> list[str]:
    """The notes on columns that are a record only by what stands beside them, but for those of which one is made already."""
    notes, designations = [], sheet.designated()
    for quantity, (index, _) in chosen.items():
        name, below = sheet.names[index], sheet.unit_below(index)
        if index in sheet.assigned or index in told or understand(name, below) is not None:
            continue
        if index in designations and as_a_mean(name, below) is None:
            notes.append(_passed_by_note(sheet, index, quantity, designations[index][1]))
            continue
        why = (
            "holds a mean of readings in each row"
            if as_a_mean(name, below) is not None
            else "counts seconds, as another counts their parts"
            if quantity == "time"
            else "was measured where another was set"
        )
        notes.append(f'{quantity} is taken from "{name}", which {why}: no other column is the {quantity}')
    return notes


def _at_rest(sheet: Sheet, quantity: str, candidates: Sequence[PossibleColumn]) -> list[Fault]:
    """The fault of a capacitance "C0" alone, which is a channel, or the one at rest by which changes are divided."""
    if len(candidates) != 1 or not quantity.startswith("capacitance"):
        return []
    index, heading = candidates[0].index, candidates[0].heading
    if heading.index != "0" or "ch" in heading.name:
        return []
    this, none = (Choice("columns", (said,), "capacitance") for said in (sheet.name_for_asking(index), "none"))
    return [
        Fault(
            f'column "{sheet.names[index]}" may be a channel, or the capacitance at rest, which is no record',
            sheet.text.path,
            sheet.named_at,
            index + 1,
            advice=f"If it is what was measured during the press: {this}; else leave it out: {none}",
            choice=this,
        )
    ]


_NOT_AT_REST = (
    'capacitance is taken from "{}", which changes as what is measured does: it is not the capacitance at rest; if it is no '
    "record, --columns capacitance=none"
)
# A reading changes by more than this share of itself, and so many times what it is off the line of those beside it; fewest.
_CHANGE, _OVER_NOISE, _FEWEST_RUNNING = 1e-3, 20.0, 10


def _runs_through(values: FloatArray) -> bool:
    """Whether readings change smoothly, by far more than their noise, as those of a press do, and a drift at rest does not."""
    there = values[np.isfinite(values)]
    if there.size < _FEWEST_RUNNING:
        return False
    middle = np.median(np.lib.stride_tricks.sliding_window_view(there, 5), axis=1)
    noise = float(np.median(np.abs(np.diff(there, 2))))
    span = float(np.ptp(middle))
    return span > max(_OVER_NOISE * noise, _CHANGE * float(np.median(np.abs(there))))


def _shown(sheet: Sheet, index: int) -> str:
    return sheet.names[index] or f"column {index + 1}"


def _index_of_asked(sheet: Sheet) -> str:
    """The number or letter in the names that the user gave, if they have one: the others go with it."""
    found = {sheet.plain_heading(i).index for i in sheet.assigned if i >= 0} - {""}
    return found.pop() if len(found) == 1 else ""


def _in_circuit(sheet: Sheet, reading: Reading) -> tuple[dict[int, Heading], dict[int, str], list[str], list[Fault]]:
    """The headings, with a capacitance whose name does not say so in series where the lines above the header do."""
    headings = dict(sheet.headings)
    notes: list[str] = []
    faults: list[Fault] = []
    above = said_circuit(sheet.prelude_of(OF_METER), sheet.in_every_row)
    untold = {i: h for i, h in sheet.headings.items() if h.quantity == "capacitance" and i not in sheet.assigned}
    if untold and (in_turn := circuits_in_turn(sheet)) is not None:
        return headings, {}, notes, [_in_circuits(sheet, index, *in_turn) for index in untold]
    for index, heading in untold.items():
        said = circuit_beside_unit(sheet, index) or above
        if said is None:
            continue
        names_it = names_parallel(heading)
        if said.word == "both" or (said.word == "series" and names_it):
            claim, asking = f'"{said.shown}" stands in line {said.line}', (sheet.name_for_asking(index),)
            series, parallel = Choice("columns", asking, "capacitance_series"), Choice("columns", asking, "capacitance")
            faults.append(
                Fault(
                    f'column "{sheet.names[index]}" may be a series or a parallel capacitance: {claim}',
                    sheet.text.path,
                    sheet.named_at,
                    index + 1,
                    advice=f"Say which: {series} for Cs, {parallel} for Cp",
                    choice=series,
                )
            )
        elif said.word == "series":
            headings[index] = replace(heading, quantity="capacitance_series")
            notes.append(f'"{sheet.names[index]}" is a series capacitance: "{said.shown}" stands in line {said.line}')
        elif said.word == "parallel" and not names_it:
            headings[index] = replace(heading, name=f"parallel {heading.name}")
            notes.append(f'"{sheet.names[index]}" is a parallel capacitance: "{said.shown}" stands in line {said.line}')
    return headings, {}, notes, faults


def _in_circuits(sheet: Sheet, index: int, key: int, cells: Sequence[str]) -> Fault:
    """The fault of a capacitance of which another column says that it is in series in some rows, and parallel in others."""
    lines = [int(sheet.lines[list(sheet.columns[key]).index(cell)]) for cell in cells]
    said = " and ".join(f'"{cell.strip()}" from line {line} on' for cell, line in zip(cells, lines, strict=True))
    rows = Choice("where", tuple(cells), asked_name(sheet, key))
    all_of = Choice("columns", (sheet.name_for_asking(index),), "capacitance")
    return Fault(
        f'column "{sheet.names[index]}" is a capacitance of two circuits: "{_shown(sheet, key)}" says {said}',
        sheet.text.path,
        lines[1],
        index + 1,
        advice=f"Say which rows are meant: {rows}; if all of them are Cp: {all_of}",
        choice=rows,
    )


def _without_stray_letters(
    sheet: Sheet, headings: Mapping[int, Heading], family: InstrumentFamily, unread: dict[int, str]
) -> dict[int, Heading]:
    """The headings without letters that have no unit and are not needed: `C`, `T` or `Z` may mean anything."""
    kept = dict(headings)
    for index, heading in headings.items():
        has_unit = heading.unit or sheet.unit_below(index) or heading.quantity in sheet.declared_units
        stray = heading.letter and heading.quantity in NEEDS_UNIT and not has_unit and index not in sheet.assigned
        others = frozenset(stands_for(h.quantity) for i, h in kept.items() if i != index)
        stray = stray and not (heading.quantity == "time" and sheet.names[index].strip().islower())
        if stray and not family.requirement(others):
            del kept[index]
            unread[index] = "a letter without a unit"
    return kept


# --- what is left --------------------------------------------------------------------------------------------------------


def _without_empty_capacitance(sheet: Sheet, chosen: dict[str, tuple[int, Heading]], unread: dict[int, str]) -> list[str]:
    """Take out a capacitance without a reading in any row, as of a meter that was not connected, beside a press; its note."""
    notes = []
    for quantity in ("capacitance", "capacitance_series"):
        index = chosen[quantity][0] if quantity in chosen else -1
        if index < 0 or index in sheet.assigned or not all(map(is_missing, sheet.columns[index])):
            continue
        if all(q in chosen and first_cell(sheet, chosen[q][0]) for q in ("displacement", "force")):
            del chosen[quantity]
            unread[index] = "empty"
            notes.append(f'"{_shown(sheet, index)}" has no reading in any row: the press is read without it')
    return notes


def _letter_of_a_place(sheet: Sheet, chosen: dict[str, tuple[int, Heading]]) -> list[str]:
    """Take a letter D beside a force for the displacement, where there is none, nor a capacitance of which it is a loss."""
    index, heading = chosen.get("dissipation", (-1, None))
    alone = "force" in chosen and not {"displacement", "capacitance", "capacitance_series"} & chosen.keys()
    if heading is None or not (alone and heading.letter) or heading.unit or index in sheet.assigned:
        return []
    del chosen["dissipation"]
    chosen["displacement"] = index, replace(heading, quantity="displacement")
    return [f'displacement is taken from "{_shown(sheet, index)}", beside a force and no capacitance']


def _drop_what_has_no_use(
    sheet: Sheet, chosen: dict[str, tuple[int, Heading]], unread: dict[int, str], faults: list[Fault]
) -> None:
    """Take out what only a capacitance gives a meaning: its losses, and the status of its meter."""
    meter = "capacitance" in chosen or "capacitance_series" in chosen
    if "dissipation" in chosen and "quality" in chosen:
        unread[chosen.pop("quality")[0]] = f'"{sheet.names[chosen["dissipation"][0]]}" is preferred'
    for quantity in ("dissipation", "quality"):
        if quantity in chosen and not meter and chosen[quantity][0] not in sheet.assigned:
            unread[chosen.pop(quantity)[0]] = "no capacitance stands beside it"
    if "frequency" in chosen and chosen["frequency"][0] not in sheet.assigned:
        index = chosen["frequency"][0]
        if _follows_a_reading(_alone(sheet, index)):
            unread[chosen.pop("frequency")[0]] = _OF_OSCILLATOR
    if "cycle" in chosen and chosen["cycle"][0] not in sheet.assigned:
        index = chosen["cycle"][0]
        if not any(is_numeric(cell) for cell in sheet.columns[index]):
            del chosen["cycle"]
            unread[index] = "holds words, no count of cycles"
    faults += _letter_that_may_be_a_place(sheet, chosen)
    if "status" in chosen and chosen["status"][0] not in sheet.assigned:
        index = chosen["status"][0]
        said = {c.strip().lower() for c in sheet.columns[index]} - {""}
        if not meter:
            unread[chosen.pop("status")[0]] = "the status of a tester"
        elif said and all(any(w in OF_TESTERS for w in s.split()) for s in said):
            unread[chosen.pop("status")[0]] = "the status of a tester, not of a meter"


_OF_OSCILLATOR = (
    "a frequency that changes from row to row, as of a circuit that a sensor is in: it is no setting of a meter, and no "
    "capacitance without the circuit's inductance"
)
# Rows that are looked at, and by which share of itself a frequency changes that is not one that a meter reads back.
_ROWS_OF_FREQUENCY, _READ_BACK = 2000, 2e-4


def _follows_a_reading(values: FloatArray) -> bool:
    """Whether most readings of a frequency differ from each other, over more than what a meter reads back."""
    there = values[:_ROWS_OF_FREQUENCY]
    there = there[np.isfinite(there)]
    if there.size < _FEW_CELLS // 2 or np.unique(there).size * 2 < there.size:
        return False
    return bool(np.ptp(there) > _READ_BACK * np.median(np.abs(there)))


def _letter_that_may_be_a_place(sheet: Sheet, chosen: Mapping[str, tuple[int, Heading]]) -> list[Fault]:
    """The fault of a letter D without a unit that is no loss by its readings, where no displacement stands in the file."""
    if "dissipation" not in chosen or "displacement" in chosen:
        return []
    index, heading = chosen["dissipation"]
    if index in sheet.assigned or not heading.letter or heading.unit or sheet.unit_below(index):
        return []
    if "force" not in chosen and sheet.names[index].strip() == "D":
        return []  # as meters write it
    values = _alone(sheet, index)
    there = values[np.isfinite(values)]
    if not there.size or (there.min() >= 0 and (np.ptp(there) < 0.5 * there.max() or there.max() < 0.05)):
        return []
    asking = (sheet.name_for_asking(index),)
    loss, place = Choice("columns", asking, "dissipation"), Choice("columns", asking, "displacement")
    return [
        Fault(
            f'column "{sheet.names[index]}" may be a dissipation or a displacement: it has no unit, and goes from '
            f"{there.min():.3g} to {there.max():.3g}",
            sheet.text.path,
            sheet.named_at,
            index + 1,
            advice=f"Say which: {loss} or {place}, with --units displacement=...",
            choice=loss,
        )
    ]


def _rest(sheet: Sheet, chosen: Mapping[str, tuple[int, Heading]], unread: dict[int, str], faults: list[Fault]) -> list[str]:
    """Give every other column its reason, and note those whose unit says that they might have been meant."""
    notes: list[str] = []
    used = {index for index, _ in chosen.values()}
    taken = {heading.quantity: index for index, heading in chosen.values()}
    clock = taken.get("time")
    days = date_column(sheet, clock) if clock is not None and holds_clock(sheet.columns[clock]) else None
    for index, name in enumerate(sheet.names):
        if index in used or index in unread:
            continue
        if not first_cell(sheet, index):
            unread[index] = "empty"
        elif not name:
            first = first_cell(sheet, index)
            shown = f', beginning "{first[:40]}"' if first[0].isalpha() and not is_reading(first) else ""
            unread[index] = f"without a name{shown}"
        else:
            heading = sheet.plain_heading(index)
            reason = why_unread(name, sheet.unit_below(index))
            if heading.quantity not in ("", "time", "cycle", "status") and sheet.holds_words(index):
                reason = f"holds words, no {in_words(heading.quantity)}"
            elif index == days:
                reason = f'the days of "{_shown(sheet, taken["time"])}", whose times are read with them'
            elif heading.quantity in taken:
                reason = f'"{_shown(sheet, taken[heading.quantity])}" is taken'
            elif heading.quantity:
                reason = "not used"
            unread[index] = reason
            if reason == "not understood":
                notes += _same_unit(sheet, index, taken, unread, faults)
    return notes


def _same_unit(sheet: Sheet, index: int, taken: Mapping[str, int], unread: dict[int, str], faults: list[Fault]) -> list[str]:
    """The note on a column not understood with a unit of a quantity that is read; a choice where it may be meant instead."""
    unit = sheet.unit_written(index)
    for quantity in ("force", "displacement", "capacitance"):
        if not unit or is_mass(unit) or not is_unit_of(unit, quantity) or not is_numeric(first_cell(sheet, index)):
            continue
        unread[index] = f"not understood, though in {unit}"
        if quantity not in taken or taken[quantity] in sheet.assigned:
            return []
        own = taken[quantity]
        units = [sheet.unit_written(own) or unit, unit]
        factors = [lab_factor(u, quantity) if is_unit_of(u, quantity) else 1.0 for u in units]
        one, other = readings([sheet.columns[i] for i in (own, index)], factors, sheet.declared_decimal)
        still = stands_still(one) and not stands_still(other)
        rival = quantity == "displacement" and _nearer_the_ball(sheet.names[own], sheet.names[index])
        parts = quantity == "displacement" and add_up(one, other)
        if still or parts or (rival and moves_with(one, other) and difference(one, other)[0] == "different"):
            choice = Choice("columns", tuple(sheet.name_for_asking(i) for i in (index, own)), quantity)
            own_does, other_does = ("stands still", "moves") if still else (f"is a {quantity}", "moves with it, but differs")
            advice = f"Say which one is the {quantity}: {choice}"
            if parts:
                choice = Choice("columns", (sheet.name_for_asking(own),), quantity)
                own_does, other_does = (
                    "goes in steps",
                    "goes on between them, as a fine drive on a coarse one: neither is the way alone",
                )
                advice = f"Write their sum, in one unit, in the place of both; if the steps alone are the {quantity}: {choice}"
            faults.append(
                Fault(
                    f'"{sheet.names[own]}" {own_does}, and "{sheet.names[index]}", which is not understood, {other_does}',
                    sheet.text.path,
                    sheet.named_at,
                    index + 1,
                    advice=advice,
                    choice=choice,
                )
            )
        return [f'{quantity} is taken from "{sheet.names[own]}"; "{sheet.names[index]}", in {unit} too, is not understood']
    return []


def _nearer_the_ball(own: str, other: str) -> bool:
    """Whether another name speaks of what presses, or one of what moves it, which gives way itself, and the other does not."""
    names = {"own": words_in(own), "other": words_in(other)}
    pressing, moving = (
        {key for key, of in names.items() if any(w.startswith(tuple(said)) for w in of)} for said in (PRESSING, MOVING)
    )
    return ("other" in pressing and "own" not in pressing) or moving == {"own"}


def _with_unit(sheet: Sheet, quantity: str, indices: Sequence[int]) -> str:
    """What has to be said of the unit beside a column that is named, where its name leaves that in doubt all the same."""
    doubts = {i: heading_as(quantity, sheet.names[i], sheet.unit_below(i)) for i in indices}
    unit = next((h.unit or sheet.unit_below(i) for i, h in doubts.items() if h.unit_doubt), "")
    return (
        f" and --units {quantity}=... ({unit} if the readings are right so, 10 {unit} if they count 10 {unit})" if unit else ""
    )


# A share of a capacitance or a resistance, which no height makes a length: "ΔC/C0 (%)", "dR/R0", "Capacitance change (%)".
_OF_A_METER = re.compile(r"[CR]\w*\s*/\s*[CR]|[Δ∆δd]\s?[CR](?![^\W\d_])|\b(?:[Cc]apa|[Kk]apa|[Rr]esist|[Ww]iderst)")


def _which_it_is(sheet: Sheet, quantity: str, choice: ColumnChoice) -> str:
    """How the user may say which column a quantity is: one in its unit, a strain of a known height, or any other."""
    may_be = ("not understood, though in ", MAY_BE_A_CHANGE)
    of_unit = [i for i, why in choice.unread.items() if why.startswith(may_be)]
    fitting = [i for i in of_unit if is_unit_of(sheet.unit_written(i), quantity)]
    moving = [i for i in fitting if not stands_still(_alone(sheet, i))]
    of_its_name = [i for i, name in enumerate(sheet.names) if i in choice.unread and name and is_unit_of(name, quantity)]
    own = tuple(sheet.name_for_asking(i) for i in moving or fitting or of_its_name)
    if own:
        return f"say which column it is: {Choice('columns', own, quantity)}{_with_unit(sheet, quantity, moving or fitting)}"
    strains = [i for i, why in choice.unread.items() if why.startswith(("a share or strain", "a strain"))]
    of_length = [i for i in strains if not _OF_A_METER.search(sheet.names[i])]
    shares = tuple(sheet.name_for_asking(i) for i in of_length if sheet.unit_written(i) == "%")
    of_height = ""
    if quantity == "displacement" and shares:
        asked = Choice("columns", shares[:1], quantity)
        of_height = f'; a strain of a known height, as of 2 mm, is {asked} --units "displacement=0.02 mm"'
    return f"say which column it is, by its name or number: --columns {quantity}=...{of_height}"


def _how_to_give(sheet: Sheet, quantity: str, choice: ColumnChoice, reading: Reading) -> str:
    """What to do where a quantity that is needed has no column: name one, or export it, where there is none left to name."""
    alone = "a load alone is no press, export the displacement of the same rows too, in a column beside it"
    taken = {index for index, _ in choice.chosen.values()}
    none_left = all(i in taken or not name or not first_cell(sheet, i) for i, name in enumerate(sheet.names))
    if quantity == "displacement" and (none_left or reading.columns.get(quantity) == "none"):
        return alone[0].upper() + alone[1:]
    named = (
        f"{quantity.capitalize()} is understood under the names {understood_names(quantity)} and others, "
        f'for example "{EXAMPLE[quantity]}"; or {_which_it_is(sheet, quantity, choice)}'
    )
    return f"{named}; if no column is one: {alone}" if quantity == "displacement" else named


def _but_of_a_meter(sheet: Sheet, needed: Sequence[str]) -> Sequence[str]:
    """The quantities that are needed, or the capacitance alone where columns are in a unit of it and none in one of a press."""
    units = [unit for i, name in enumerate(sheet.names) if (unit := sheet.unit_written(i)) and (unit != name or len(unit) > 1)]
    of_unit = {q for q in ("capacitance", "force", "displacement") if any(is_unit_of(unit, q) for unit in units)}
    return ("capacitance",) if of_unit == {"capacitance"} and "capacitance" in needed else needed


def _blanks_among_tabs(sheet: Sheet) -> Fault | None:
    """The fault of names that stand apart by blanks, so that they are one cell, where tabs part others; None if none do."""
    parts = {name: re.split(r"\s{2,}", name.strip()) for name in sheet.names} if sheet.delimiter == "\t" else {}
    name = next((n for n, own in parts.items() if len(own) > 1 and all(understand(part) is not None for part in own)), "")
    if not name:
        return None
    return Fault(
        f'"{name}" are {len(parts[name])} names with blanks between them, where tabs stand between other cells',
        sheet.text.path,
        sheet.named_at,
        sheet.names.index(name) + 1,
        advice="Put one mark between all cells, such as a tab in place of blanks in succession, in the header and in every row",
    )


def missing_columns(sheet: Sheet, family: InstrumentFamily, choice: ColumnChoice, reading: Reading) -> list[Fault]:
    """List the faults of quantities that are needed and not there, and of units given to columns that are not there.

    Parameters
    ----------
    sheet : the record.
    family : what it was recognised as.
    choice : its columns.
    reading : what the user says of the file.
    """
    found = frozenset(stands_for(q) for q in choice.chosen)
    if family.requirement(found) and (mixed := _blanks_among_tabs(sheet)) is not None:
        return [mixed]
    there = ", ".join(
        f'"{n}"' + (f" ({choice.unread[i]})" if choice.unread.get(i, "not understood") != "not understood" else "")
        for i, n in enumerate(sheet.names)
        if n
    )
    faults = [
        Fault(
            f"no {quantity} column among {there}",
            sheet.text.path,
            sheet.named_at,
            advice=_how_to_give(sheet, quantity, choice, reading),
        )
        for quantity in _but_of_a_meter(sheet, family.requirement(found))
    ]
    faults += [
        Fault(
            f'there is no {quantity} column to give the unit "{unit}" to',
            sheet.text.path,
            sheet.named_at,
            advice=f"Say which column it is: --columns {quantity}=..., or leave the unit out",
        )
        for quantity, unit in reading.units.items()
        if stands_for(quantity) not in found
    ]
    return faults
