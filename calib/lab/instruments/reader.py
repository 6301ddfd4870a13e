"""From a lab file to its `LabTable`: taken apart, cut into a record, recognised as an instrument's, read as columns in SI."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.cell_units import with_plain_cells
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.columns import read_columns
from calib.lab.instruments.cut import cut
from calib.lab.instruments.designated import designated
from calib.lab.instruments.disowned import disowned_in
from calib.lab.instruments.families import FAMILIES
from calib.lab.instruments.formats import format_of
from calib.lab.instruments.header import find_header
from calib.lab.instruments.labtable import AS_FOUND, LabTable, Reading, Unread
from calib.lab.instruments.legend import with_legend
from calib.lab.instruments.lines import FEW_ROWS, telling
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.other_sheets import said_in_sheets, with_its_sheet, with_their_sheets
from calib.lab.instruments.parallel import as_parallel
from calib.lab.instruments.part import EXPORT_ALIKE, CellTypes, Part
from calib.lab.instruments.plain_clocks import with_plain_clocks
from calib.lab.instruments.sheet import SeveralSpecimens, Sheet
from calib.lab.instruments.side_clocks import ONE_CLOCK
from calib.lab.instruments.stated import stated_units
from calib.lab.instruments.text import LabText, read_lab_text, require_readable
from calib.lab.instruments.typed import certain, uncalculated_fault, with_reasons
from calib.lab.instruments.unit_columns import with_unit_columns
from calib.lab.instruments.units import IN_PLACE_OF, SI_UNIT
from calib.lab.instruments.vocabulary import understand

#: What `Reading.units` and `Reading.columns` may name.
QUANTITIES = (*(q for q in SI_UNIT if q not in IN_PLACE_OF), *IN_PLACE_OF)


# A table of few rows is one of results beside a record of so many times as many.
_FEWER = 5


def no_such_quantity(name: str) -> str:
    """What to say of a quantity that there is not: the one that is spelled like it, and all that there are.

    >>> no_such_quantity("forse")[:48]
    'there is no quantity "forse", did you mean force'
    """
    close = difflib.get_close_matches(name.lower(), QUANTITIES, n=1)
    meant = f", did you mean {close[0]}?" if close else "."
    return f'there is no quantity "{name}"{meant} The quantities are {", ".join(QUANTITIES)}'


def read_lab_file(path: Path | str, reading: Reading = AS_FOUND) -> LabTable:
    """Read one record of a file of a testing machine or an LCR meter into columns in SI.

    Encoding, delimiter, decimal mark, header and units are found in the file; what was found is stated in the table.
    Nothing is guessed: a missing or unknown unit, text in a number cell or an ambiguous decimal mark is refused, an empty
    cell or an over-range reading makes its row unusable and says so.

    Parameters
    ----------
    path : a text file (CSV, TSV, TXT, TRA), a workbook (.xlsx, .xls), or a file of LabVIEW (.lvm, .tdms) or MATLAB (.mat).
    reading : what the user says of the file: units, columns, which of several specimens or sheets.

    Returns
    -------
    Columns in SI with the signs of the file.

    Raises
    ------
    SeveralSpecimens
        If the file holds several specimens and `reading` does not say which.
    calib.errors.InputError
        If several sheets, groups or variables are records and `reading` does not say which; or with every fault of the
        file, each with line, column and advice.
    """
    path = Path(path)
    unknown = sorted({*reading.units, *reading.columns} - set(QUANTITIES))
    if unknown:
        raise InputError([Fault(no_such_quantity(name), path) for name in unknown])
    tables = {"columns": reading.columns, "units": reading.units, "where": reading.where, "sign": reading.sign}
    no_text = [(option, *item) for option, table in tables.items() for item in table.items() if not isinstance(item[1], str)]
    if no_text:
        how = 'Write it in quotes: {} = {{"{}": "{}"}}'
        raise InputError([Fault(f"{o}: {k} = {v!r} is no text", path, advice=how.format(o, k, v)) for o, k, v in no_text])
    for name, said, known in (("decimal", reading.decimal, (".", ",")), ("scale", reading.scale, ("micro",))):
        if said and said not in known:
            listed = " or ".join(f'"{word}"' for word in known)
            raise InputError(Fault(f'{name} "{said}" is none that there is', path, advice=f"Write {name} = {listed}"))
    require_readable(path)
    form = format_of(path)
    if form is not None:
        return _one_of(path, form.take_apart(path), reading)
    if reading.sheet:
        raise InputError(Fault(f'there is no sheet "{reading.sheet}": the file is text', path, advice="Leave the sheet out"))
    return _read_text(read_lab_text(path), reading)


def _read_text(text: LabText, reading: Reading, types: CellTypes | None = None) -> LabTable:
    """Read one record of a text, or of a part of a file with the types of its cells."""
    told, reading = with_legend(text, reading)
    table = _read_told(replace(told, notes=()), reading, types)
    return replace(table, notes=(*told.notes, *table.notes)) if told.notes else table


def _read_told(text: LabText, reading: Reading, types: CellTypes | None) -> LabTable:
    """Read one record of a text whose header says all that is said of its columns."""
    sheet = _own_sheet(text, reading) or cut(text, reading)
    found = None if types is None else certain(sheet, types, reading)
    if found is not None and found.sheet.declared_decimal and (found.of_texts or not text.typed):
        reading = replace(reading, decimal="")  # it was for the texts, which are numbers now
    sheet = with_unit_columns(sheet if found is None else found.sheet, reading)
    sheet = with_plain_clocks(with_plain_cells(sheet, reading), reading)
    for family in FAMILIES:
        reason = family.recognise(sheet)
        if reason:
            table = as_parallel(read_columns(sheet, family, reason, reading), sheet.header_line, reading)
            return table if found is None else with_reasons(table, found)
    raise AssertionError("every sheet is a table")


# --- files of several parts --------------------------------------------------------------------------------------------


def _one_of(path: Path, parts: Sequence[Part], reading: Reading) -> LabTable:
    """Read the part that was asked for, or else the one that is a record."""
    if not parts:
        raise InputError(Fault("there is nothing in the file", path, advice="Export it again from the instrument's software"))
    if reading.sheet:
        own, others = _asked(path, parts, reading.sheet)
        table = _read_part(path, own, reading, said_in_sheets([part for part in others if _holds_no_record(part, reading)]))
        return _with_unread(table, own, {part.title: part.reason or f"{own.title} was asked for" for part in others})
    faults: dict[Part, InputError] = {}
    read: dict[Part, LabTable] = {}
    for part in parts:
        try:
            read[part] = _read_part(path, part, reading)
        except InputError as error:
            faults[part] = error
    # A part that is a record but for its faults is one too: it must not be passed over for another.
    records = [part for part in parts if part in read or (part.text is not None and _is_record(part.text, reading))]
    n_row = {part: len(read[part].lines) if part in read else _n_rows(part) for part in records}
    few = {
        part: f"{n} row(s), too few for a record"
        for part, n in n_row.items()
        if n < FEW_ROWS and _FEWER * n <= max(n_row.values())
    }
    records = [part for part in records if part not in few]
    chosen = [part for part in records if not part.hidden] or records
    if len(chosen) > 1:
        listed = "; ".join(f"{part.name} ({_shown(read.get(part), faults.get(part))})" for part in chosen)
        message = f"{len(chosen)} {chosen[0].kind}s of the file are records: {listed}"
        choice = Choice("sheet", tuple(part.name for part in chosen))
        raise InputError(
            Fault(message, path, advice=f"Say which one: {choice} (in an experiment file: sheet = ...)", choice=choice)
        )
    if len(parts) == 1 or chosen:
        own = chosen[0] if chosen else parts[0]
        said = said_in_sheets([part for part in parts if part not in records and part is not own])
        if said:
            read[own] = _read_part(path, own, reading, said)
        elif own in faults:
            raise faults[own]
        _heed_remarks(path, read[own], [part for part in parts if part not in records], reading)
        why = {
            part.title: "it is hidden" if part in records else (few.get(part) or _why(part, faults.get(part))) + _said_by(part)
            for part in parts
            if part is not own
        }
        return _with_unread(read[own], own, why)
    apart = _times_apart(path, parts, reading)
    if apart is not None:
        raise InputError(apart)
    listed = "; ".join(f"{part.title}: {_why(part, faults.get(part))}" for part in parts)
    advice = (
        "If one of them holds a record, say which, and what its columns are: --sheet NAME --columns force=2 --units force=..."
    )
    if any(part.text is None and part.reason.endswith(EXPORT_ALIKE) for part in parts):
        # A channel of another length is no part that could be read beside them.
        advice = "Export all channels with as many readings each, or write them into one CSV file, row by row"
    raise InputError(Fault(f"none of the {len(parts)} parts of the file is a record: {listed}", path, advice=advice))


def _heed_remarks(path: Path, table: LabTable, others: Sequence[Part], reading: Reading) -> None:
    """Refuse a record of whose columns another sheet without one, as of notes, says that they are not what they seem."""
    names = {quantity: (name, -1) for quantity, name in table.sources.items()}
    faults = []
    for part in others:
        lines = ((None, line.replace("\t", " ").strip()) for line in (part.text.lines if part.text is not None else ()))
        faults += [_of(part, fault) for fault in disowned_in(lines, names, reading, path)]
    if faults:
        raise InputError(faults)


_ANOTHER = "Give a file, or a sheet of it, that holds a record: export it again from the instrument's software"


def _asked(path: Path, parts: Sequence[Part], name: str) -> tuple[Part, list[Part]]:
    found = [part for part in parts if part.name == name] or [
        part for part in parts if part.name.strip().casefold() == name.strip().casefold()
    ]
    if len(found) != 1:
        there = ", ".join(f'"{part.name}"' for part in parts)
        what = "is no" if not found else "is more than one"
        raise InputError(Fault(f'there {what} {parts[0].kind} "{name}"; there are {there}', path, advice="Name one of these"))
    return found[0], [part for part in parts if part is not found[0]]


def _read_part(path: Path, part: Part, reading: Reading, said: Sequence[tuple[str, str]] = ()) -> LabTable:
    if part.text is None:
        raise InputError(Fault(f"{part.title} is no table: {part.reason}", path, advice=_ANOTHER))
    try:
        text = replace(_with_its_name(part.text, part), elsewhere=tuple(words for _, words in said))
        table = with_their_sheets(_read_text(text, reading, part.types), said)
        return replace(table, lines=table.lines - part.above)
    except SeveralSpecimens as error:
        raise SeveralSpecimens(_of(part, error.faults[0]), error.count) from None
    except InputError as error:
        unknown = uncalculated_fault(part)
        told = unknown is None or any(fault.advice == unknown.advice for fault in error.faults)
        more = () if told or unknown is None else (unknown,)
        placed = [with_its_sheet(fault, said) for fault in (*more, *error.faults)]
        raise InputError([_of(part, fault, where) for fault, where in placed]) from None


def _with_its_name(text: LabText, part: Part) -> LabText:
    """A text with the name of its part as a remark on it, where that says a unit: a sheet called "Force in mN"."""
    return replace(text, comments=(*text.comments, (1, -1, part.name))) if next(stated_units(part.name), None) else text


def _of(part: Part, fault: Fault, where: str = "") -> Fault:
    line = fault.line if not part.above or fault.line is None else fault.line - part.above
    return replace(fault, message=f"{where or part.title}: {fault.message}", line=line if line is None or line > 0 else None)


def _times_apart(path: Path, parts: Sequence[Part], reading: Reading) -> Fault | None:
    """What to say where parts with times of their own hold the force, and others the displacement; None if they do not."""
    of_parts = {part: _named_in(part.text, reading) for part in parts if part.text is not None}
    forces = [part for part, named in of_parts.items() if {"force", "time"} <= named]
    displacements = [part for part, named in of_parts.items() if {"displacement", "time"} <= named]
    if not forces or not displacements:
        return None
    listed = "; ".join(
        f"{part.title} ({', '.join(sorted(of_parts[part]))}, {_n_rows(part)} rows)" for part in (*displacements, *forces)
    )
    message = (
        f"force and displacement are in parts of the file that have times of their own, so that no row holds both: {listed}"
    )
    return Fault(message, path, advice=ONE_CLOCK)


def _is_record(text: LabText, reading: Reading) -> bool:
    """Whether a header is found that names force over displacement, or a capacitance."""
    quantities = _named_in(text, reading)
    return bool({"force", "displacement"} <= quantities or {"capacitance", "capacitance_series"} & quantities)


def _named_in(text: LabText, reading: Reading) -> set[str]:
    """The quantities that a header names, or the user; none without a header."""
    found = find_header(text, reading)
    if found is None:
        return set()
    quantities = {heading.quantity for cell in found[2] if (heading := understand(cell)) is not None} | set(reading.columns)
    return quantities | {heading.quantity for heading, _ in designated(tuple(found[2]), ("",) * len(found[2])).values()}


def _holds_no_record(part: Part, reading: Reading) -> bool:
    """Whether a part is a sheet of a few lines, or one in which no header of a record is found."""
    return part.text is not None and (_n_rows(part) < FEW_ROWS or not _is_record(part.text, reading))


def _n_rows(part: Part) -> int:
    """The lines of a part that hold two numbers or more."""
    lines = part.text.lines if part.text is not None else ()
    cells = (re.split(r"[\t;,|]| +", line) for line in lines)
    return sum(sum(is_numeric(c) or is_clock(c) for c in row) > 1 for row in cells)


def _shown(table: LabTable | None, error: InputError | None) -> str:
    if table is not None:
        return f"{', '.join(table.columns)}, {len(table.lines)} rows"
    return _brief(error)


def _why(part: Part, error: InputError | None) -> str:
    return part.reason or f"not understood: {_brief(error)}"


def _said_by(part: Part) -> str:
    """What a part that is no record says, as a sheet of notes does: all of a short one."""
    says = telling([line.replace("\t", " ") for line in part.text.lines]) if part.text is not None else ""
    return f"; it says {says}" if says else ""


def _brief(error: InputError | None) -> str:
    return error.faults[0].message[:160] if error is not None else "no record"


def _with_unread(table: LabTable, own: Part, others: Mapping[str, str]) -> LabTable:
    unread = (*table.unread, *(Unread(title, reason) for title, reason in others.items()))
    chosen = (f"read from {own.title}",) if others or own.hidden else ()
    return replace(table, unread=unread, notes=(*chosen, *own.notes, *table.notes))


def _own_sheet(text: LabText, reading: Reading) -> Sheet | None:
    """Cut a text in the way of its family, if that has one; None if no family does."""
    sheets = (family.cut(text, reading) for family in FAMILIES if family.cut is not None)
    return next((sheet for sheet in sheets if sheet is not None), None)
