"""From the lines of a lab file to the `Sheet` of one record."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, takewhile, zip_longest

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.brackets import no_record
from calib.lab.instruments.circuit import OF_METER, said_circuit
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.common_words import common_words
from calib.lab.instruments.declared import declared_decimal, declared_units
from calib.lab.instruments.dressed import plain_names
from calib.lab.instruments.footnotes import Footnote, footnotes
from calib.lab.instruments.forms import of_one_form
from calib.lab.instruments.header import DELIMITERS, HEADER_WITHIN, ROW_NAMES, find_header, split_line, without_comment_mark
from calib.lab.instruments.json_lines import json_lines
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.lines import FEW_ROWS, OF_RESULTS, is_comment, is_other_header, n_named, not_read
from calib.lab.instruments.named_values import named_values
from calib.lab.instruments.no_header import no_header, unknown_header
from calib.lab.instruments.numbered import listed_header
from calib.lab.instruments.numbers import is_numeric, is_over_range
from calib.lab.instruments.quotes import check_quotes
from calib.lab.instruments.raw_counts import raw_counts
from calib.lab.instruments.rows import with_rows
from calib.lab.instruments.said_again import said_again
from calib.lab.instruments.scalings import with_scalings
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.side_by_side import one_of_side_by_side
from calib.lab.instruments.side_clocks import of_one_clock
from calib.lab.instruments.stated import stated_factors
from calib.lab.instruments.text import LabText
from calib.lab.instruments.titles import BelowHeader, begins_at, below_header, units_above
from calib.lab.instruments.torn import thousands_advice, thousands_in, torn_decimals, torn_thousands
from calib.lab.instruments.unit_cells import with_its_unit
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import understand, words

# Lines above rows of results with their title, names and units.
_TITLES = 3
# Lines above a header and below a table that may speak of it.
_WORDS_BESIDE = 200
# Lines below a header that show how many cells its rows have.
_ROWS_BESIDE = 30


def cut(text: LabText, reading: Reading) -> Sheet:
    """Find delimiter, header and units row of a lab file, and cut one record into cells.

    The header is the line near the top below which most rows of numbers stand in columns that are understood, whatever stands
    above it. Where it stands again, the record goes on if time does; otherwise another specimen begins there. Specimens may
    also stand side by side. A table without a header is read if the user says which of its columns are what, by number.

    Parameters
    ----------
    text : the file.
    reading : what the user says of it.

    Returns
    -------
    One record, as text.

    Raises
    ------
    InputError
        If no header is found, no row follows it, another table follows, a row is wider than the header, or the file
        holds several specimens and `reading` does not say which.
    """
    pairs = None if text.typed else named_values(text)
    if pairs is None and not text.typed:
        pairs = json_lines(text) or of_one_form(text, reading)
    if pairs is not None:
        around = pairs.beside or tuple(_beside(replace(pairs, names=(), columns=()), ()))
        stated = {q: (words_of, n) for n, line in around for q, (words_of, _) in stated_factors([line]).items()}
        assigned = _assigned(reading, pairs.names, text, int(pairs.lines[0]), pairs.units)
        return replace(pairs, assigned=assigned, beside=around, declared_factors=stated)
    found = find_header(text, reading)
    listed = listed_header(text)
    if listed is not None and (found is None or found[1] <= listed.above):
        found = listed.delimiter, listed.above, list(listed.names)
    else:
        listed = None
    by_number = all(c.isdecimal() or c == "none" for c in reading.columns.values()) and any(
        map(str.isdecimal, reading.columns.values())
    )
    if found is None and by_number:
        found = find_header(text, reading, numbers=True) or unknown_header(text)
        if found is None or _named_otherwise(found[2], reading):
            return _without_header(text, reading)
    if found is not None and listed is None and by_number and _is_beside_the_rows(text, *found):
        return _without_header(text, reading)
    if found is None:
        raise InputError(no_header(text))
    delimiter, header, names = found
    names, named_above = _with_names_above(text, delimiter, header, names) if listed is None else (names, ())
    below = below_header(text, delimiter, header, names, strict=not any(c.isdecimal() for c in reading.columns.values()))
    check_quotes(text, delimiter, header, text.lines[header : below.start])
    below, units_notes = _with_units_above(text, delimiter, header, names, below)
    assigned = _assigned(reading, names, text, header + 1, below.units)
    plain, again_notes = said_again(names, below.units)
    sheet = Sheet(
        text,
        delimiter,
        header + 1,
        plain,
        below.units_line,
        below.units,
        {
            **_units_declared_below(text, header),
            **declared_units(_of_no_column(text, text.lines[: header if listed is None else listed.first])),
        },
        text.decimal or declared_decimal(text.lines[:header]),
        assigned,
    )
    sheet = replace(sheet, set_aside=raw_counts(sheet))
    sheet = replace(sheet, declared_units={**sheet.declared_units, **_units_of_columns(sheet)})
    above = (*_rows_above(sheet, reading), *units_notes, *again_notes, *named_above)
    written = split_line(text.lines[header], delimiter)
    if listed is not None:
        one = listed.first == listed.last
        where = f"line {listed.first + 1} lists" if one else f"lines {listed.first + 1} to {listed.last + 1} list"
        above = (*above, f"the names of the columns are those that {where} by number")
    elif names[0] == ROW_NAMES and len(names) == len(written) + 1:
        above = (*above, f"rows have a cell more than line {header + 1}, the first: their names, as R and pandas write them")
    elif (words := common_words(written))[1] == names != written:
        above = (*above, f'all names in line {header + 1} begin with "{words[0]}", which is passed by')
    elif written[: len(names)] != names[: len(names)] and is_comment(text.lines[header]):
        above = (*above, f'the header in line {header + 1} stands behind "{text.lines[header].strip()[0]}"')
    elif names == [f"{name} ({unit})" for name, unit in zip(written[::2], written[1::2], strict=False)]:
        above = (*above, f"in line {header + 1} the unit of each column stands in a cell of its own behind its name")
    if listed is None and written != names and plain_names(written) == names:
        above = (*above, f'the names in line {header + 1} are taken without what is written around each: "{written[0]}"')
    decided = _lines_that_decide(sheet, reading)
    names_at = range(header, header + 1) if listed is None else range(listed.first, listed.last + 1)
    read = {*decided, sheet.units_line}
    beside = [i for i in range(header + 1) if text.lines[i].strip() and i not in names_at and i + 1 not in read]
    unread = not_read(sheet, beside, "above the header" if listed is None else "above the rows")
    if any(index < 0 for index in assigned):
        above = (*above, *(f"{quantity} is left out, as asked" for index, quantity in assigned.items() if index < 0))
    whole_sheet = sheet
    sheet, side_notes = one_of_side_by_side(sheet, reading)
    if not side_notes:
        _check_nameless(whole_sheet, below.start, reading)
    sheet = of_one_clock(sheet, below.start, reading)
    whole = with_rows(sheet, below.start, reading, side_notes)
    if (torn := torn_decimals(whole) or torn_thousands(whole)) is not None:
        raise InputError(torn)
    whole = with_scalings(whole, names_at, below.start)
    around = tuple(_beside(whole, names_at))
    noted = footnotes(whole, around)
    return replace(
        whole,
        notes=(*above, *decided.values(), *whole.notes),
        unread=(*unread, *below.unread, *whole.unread),
        declared_factors={**_factors_beside(text, header, int(whole.lines[-1])), **_factors_noted(whole, noted)},
        beside=(*around, *((f.line, f'{f.text} (on "{whole.names[i]}")') for i, f in noted.items() if f.line)),
    )


def _with_names_above(text: LabText, delimiter: str, header: int, names: list[str]) -> tuple[list[str], tuple[str, ...]]:
    """The names with those that stand in the line above alone, where names go over two lines, and notes on these."""
    above = split_line(without_comment_mark(text.lines[header - 1], delimiter), delimiter) if header else []
    if len(above) != len(names) or all(names):
        return names, ()
    there = {h.quantity for name in names if name and (h := understand(name)) is not None}
    missing = {i: h for i, name in enumerate(names) if not name and above[i] and (h := understand(above[i])) is not None}
    quantities = [heading.quantity for heading in missing.values()]
    taken = {
        i: above[i]
        for i, heading in missing.items()
        if heading.quantity not in there and quantities.count(heading.quantity) == 1
    }
    notes = tuple(
        f'the name of column {i + 1}, "{name}", stands in line {header}, above those of the others' for i, name in taken.items()
    )
    return [taken.get(i, name) for i, name in enumerate(names)], notes


def _with_units_above(
    text: LabText, delimiter: str, header: int, names: Sequence[str], below: BelowHeader
) -> tuple[BelowHeader, tuple[str, ...]]:
    """What stands below a header, with the units above it where none stand below, and a note; those of both must agree."""
    found = units_above(text, delimiter, header, names)
    if found is None:
        return below, ()
    line, units = found
    if below.units_line is None:
        note = f"the units of the columns are those of line {line}, above their names: {', '.join(u or '-' for u in units)}"
        return replace(below, units_line=line, units=units), (note,)
    for index, (name, one, other) in enumerate(zip(names, units, below.units, strict=False)):
        heading = understand(name, other)
        if heading is None or not (one and other) or not is_unit_of(other, heading.quantity):
            continue
        if lab_factor(one, heading.quantity) != lab_factor(other, heading.quantity):
            message = f'column "{name}" has the unit "{one}" above its name and "{other}" below it'
            raise InputError(Fault(message, text.path, line, index + 1, advice="Correct one of the two, or remove it"))
    return below, ()


def _units_declared_below(text: LabText, header: int) -> Mapping[str, tuple[str, int]]:
    """Units declared in comments that end a file, as `declared_units` has them."""
    first = len(text.lines)
    while first - 1 > header and (not text.lines[first - 1].strip() or is_comment(text.lines[first - 1])):
        first -= 1
    last = list(text.lines[first : first + _WORDS_BESIDE])
    return {quantity: (unit, first + line) for quantity, (unit, line) in declared_units(last).items()}


def _of_no_column(text: LabText, lines: Sequence[str]) -> tuple[str, ...]:
    """Lines from the first on without those that are of one column alone, which are empty."""
    owned = {line for line, _, _ in text.of_columns}
    return tuple("" if number in owned else line for number, line in enumerate(lines, 1)) if owned else tuple(lines)


def _units_of_columns(sheet: Sheet) -> Mapping[str, tuple[str, int]]:
    """Units that lines declare which are of one column alone, where no other column is of its quantity."""
    found: dict[str, tuple[str, int]] = {}
    quantities = [stands_for(h.quantity) for h in sheet.headings.values()]
    for line, index, words_of in sheet.text.of_columns:
        heading = sheet.headings.get(index)
        quantity = stands_for(heading.quantity) if heading is not None else ""
        own = declared_units([f"{quantity} {words_of}"]).get(quantity) if quantities.count(quantity) == 1 else None
        found |= {quantity: (own[0], line)} if own is not None else {}
    return found


def _lines_that_decide(sheet: Sheet, reading: Reading) -> dict[int, str]:
    """The lines above a header by which columns are read -> a note on each: units, decimal mark, a meter's circuit."""
    quantities = {stands_for(h.quantity) for h in sheet.headings.values()}
    found: dict[int, list[str]] = {}
    for quantity, (unit, line) in sheet.declared_units.items():
        if quantity in quantities and not {q for q in reading.units if stands_for(q) == quantity}:
            found.setdefault(line, []).append(f"the unit of {quantity} ({unit})")
    mark = next((i for i, line in enumerate(sheet.prelude, 1) if declared_decimal([line])), 0)
    if mark and not reading.decimal and sheet.declared_decimal:
        found.setdefault(mark, []).append(f'the decimal mark ("{sheet.declared_decimal}")')
    circuit = said_circuit(sheet.prelude_of(OF_METER))
    if circuit is not None and any(h.quantity == "capacitance" and i not in sheet.assigned for i, h in sheet.headings.items()):
        found.setdefault(circuit.line, []).append("how the meter takes the capacitance")
    return {line: f"line {line} says {', '.join(said)}" for line, said in sorted(found.items())}


def _factors_beside(text: LabText, header: int, last: int) -> Mapping[str, tuple[str, int]]:
    """The factors that are stated above a header and below the last row."""
    first = max(header - _WORDS_BESIDE, 0)
    below = stated_factors(text.lines[last : last + _WORDS_BESIDE], last + 1)
    of_cells = [(line, own, line == header + 1 and index >= 0) for line, index, own in text.comments]
    of_columns = [(line, own, True) for line, _, own in text.of_columns]
    named = {
        q: (words, line)
        for line, own, of_one in (*of_cells, *of_columns)
        for q, (words, _) in stated_factors([own]).items()
        if q or not of_one  # what is of one column is of the quantity that it names, if of another than its own
    }
    return {**named, **below, **stated_factors(_of_no_column(text, text.lines[:header])[first:], first + 1)}


def _factors_noted(sheet: Sheet, noted: Mapping[int, Footnote]) -> Mapping[str, tuple[str, int]]:
    """The factors that footnotes state of the readings of their columns."""
    of = {i: stands_for(heading.quantity) for i, heading in sheet.headings.items()}
    told = {of[i]: f for i, f in noted.items() if i in of and f.line}
    return {
        quantity: (f.text[:60], f.line)
        for quantity, f in told.items()
        if any(stated_factors([words]) for words in (f.text, f"{quantity}: {f.text}", f"{quantity} {f.text}"))
    }


# A name with its unit in brackets.
_NAME_WITH_UNIT = re.compile(r"[^()\[\]]+[(\[][^()\[\]]+[)\]]")


def _beside(sheet: Sheet, names_at: Sequence[int]) -> Iterator[tuple[int, str]]:
    """What stands above, below and among the rows of a record, in the names of empty columns and on cells, with its line."""
    lines, rows = sheet.text.lines, sheet.lines
    first, last = int(rows[0]), int(rows[-1])
    start = max(min(names_at, default=first - 1) - _WORDS_BESIDE, 0)
    above = [i for i in range(start, first - 1) if i not in names_at and i + 1 != sheet.units_line]
    among = [i for r in np.flatnonzero(np.diff(rows) > 1).tolist() for i in range(int(rows[r]), int(rows[r + 1]) - 1)]
    below = takewhile(lambda i: not is_other_header(split_line(lines[i], sheet.delimiter)), range(last, len(lines)))
    for i in (*above, *(i for i in among if is_comment(lines[i])), *islice(below, _WORDS_BESIDE)):
        yield i + 1, lines[i]
    for index, (name, column) in enumerate(zip(sheet.names, sheet.columns, strict=False)):
        seldom = name and sum(map(bool, column[:_ROWS_BESIDE])) * 2 < min(len(column), _ROWS_BESIDE)
        # A name with its unit above an empty column of a template is one of a column, and no remark on the others.
        if seldom and (any(map(str.strip, column)) or not _NAME_WITH_UNIT.fullmatch(name) or index not in sheet.headings):
            yield sheet.header_line, name
    for line, index, words_on in sheet.text.comments:
        on_name = line == sheet.header_line and 0 <= index < len(sheet.names)
        yield line, f'{words_on} (on "{sheet.names[index]}")' if on_name else words_on


def _check_nameless(sheet: Sheet, start: int, reading: Reading) -> None:
    """Refuse numbers below the empty end of a header: the names may stand one cell too far to the left of their columns."""
    named = n_named(sheet)
    if named == len(sheet.names) or sheet.headings.keys() <= sheet.assigned.keys():
        return
    if sheet.text.typed:  # a cell of a workbook stands in its own column, whatever stands beside it
        return
    rows = [split_line(line, sheet.delimiter) for line in sheet.text.lines[start : start + 50] if line.strip()]
    filled = [i for i, row in enumerate(rows) if any(map(is_numeric, row[named : len(sheet.names)]))]
    if 2 * len(filled) <= len(rows) or not rows:
        return
    cut_number = thousands_in(rows, named, sheet.delimiter)
    raise InputError(
        Fault(
            f"the header names {named} columns, numbers stand in more: which name belongs to which column cannot be told",
            sheet.text.path,
            sheet.header_line,
            named + 1,
            advice=thousands_advice(cut_number, sheet.delimiter)
            if cut_number
            else "If the first cell of each row is its number, write a name for it into the header, such as No; if names "
            "stand in the next line, too, write all into one; or say of every column, by its number, what it is and its unit",
        )
    )


def _assigned(reading: Reading, names: Sequence[str], text: LabText, line: int, units: Sequence[str] = ()) -> dict[int, str]:
    """Columns by the user's word: index -> quantity. A column may be called as it is shown, with the unit below its name."""
    shown = [f"{name} ({unit})" if unit else name for name, unit in zip_longest(names, units[: len(names)], fillvalue="")]
    assigned: dict[int, str] = {}
    for quantity, wanted in reading.columns.items():
        if wanted == "none" and wanted not in names:
            assigned[-1 - len(assigned)] = quantity  # no column is: none of those that are understood as it
            continue
        matching = [i for i, name in enumerate(names) if name == wanted]
        if not matching and wanted.isdecimal() and 1 <= int(wanted) <= len(names):
            matching = [int(wanted) - 1]
        matching = (
            matching
            or [i for i, name in enumerate(names) if words(name) == words(wanted)]
            or [i for i, name in enumerate(shown) if words(name) == words(wanted)]
        )
        if len(matching) != 1:
            there = ", ".join(f'{i + 1} "{n}"' for i, n in enumerate(names))
            raise InputError(
                Fault(
                    f'{"no" if not matching else "more than one"} column "{wanted}" for {quantity}; the columns are {there}',
                    text.path,
                    line,
                    advice=_by_its_number(quantity, matching or _that_may_be(quantity, names, units, assigned)),
                )
            )
        if matching[0] in assigned:
            raise InputError(
                Fault(
                    f'column "{names[matching[0]]}" is named for {assigned[matching[0]]} and for {quantity}',
                    text.path,
                    line,
                    matching[0] + 1,
                    advice=f"Say another column for one of them: --columns {quantity}=...",
                )
            )
        assigned[matching[0]] = quantity
    return assigned


def _that_may_be(quantity: str, names: Sequence[str], units: Sequence[str], taken: Mapping[int, str]) -> list[int]:
    """The columns that may be a quantity: those named so, else those with a unit of it, else those not understood at all."""
    below = [*units, *[""] * len(names)]
    found = [understand(name, below[i]) for i, name in enumerate(names)]
    asked = stands_for(quantity)
    free = [i for i, name in enumerate(names) if name and i not in taken]
    named = [i for i in free if (h := found[i]) is not None and stands_for(h.quantity) == asked]
    unknown = [i for i in free if found[i] is None]
    units_of = [(below[i], *re.findall(r"[(\[]([^()\[\]]+)", names[i])) for i in range(len(names))]
    return named or [i for i in unknown if any(u and is_unit_of(u, asked) for u in units_of[i])] or unknown


def _by_its_number(quantity: str, columns: Sequence[int]) -> str:
    """The advice to name a column by its number, with those of the columns that may be meant."""
    if not columns:
        return f"Name it by its number, counted from 1: --columns {quantity}=..."
    return f"Name it by its number, such as {Choice('columns', tuple(str(i + 1) for i in columns), quantity)}"


def _named_otherwise(names: Sequence[str], reading: Reading) -> bool:
    """Whether a line with numbers in it names columns otherwise than the user does by their numbers: it is no header."""
    said = {int(c) - 1: stands_for(q) for q, c in reading.columns.items() if c.isdecimal()}
    meant = {i: h for i, name in enumerate(names) if i in said and (h := understand(name)) is not None}
    return any(stands_for(h.quantity) != said[i] for i, h in meant.items())


def _is_beside_the_rows(text: LabText, delimiter: str, header: int, names: Sequence[str]) -> bool:
    """Whether a line of names has another number of cells than each row of numbers below it: its places are not the rows'."""
    below = [line for line in text.lines[header + 1 :][:_ROWS_BESIDE] if line.strip()]
    widths = {(len(row), mark) for line in below for mark in DELIMITERS if _is_of_numbers(row := split_line(line, mark))}
    return bool(widths) and not any(mark == delimiter and n in (len(names), len(names) + 1) for n, mark in widths)


def _is_of_numbers(row: Sequence[str]) -> bool:
    """Whether the cells of a row are numbers, clocks, or empty as those of a column between two tables."""
    return len(row) > 1 and any(row) and all(not c or is_numeric(c) or is_clock(c) or is_over_range(c) for c in row)


def _without_header(text: LabText, reading: Reading) -> Sheet:
    """A table of numbers only, with the columns that the user names by number; units and counts of columns may stand above."""
    wanted = [int(c) for c in reading.columns.values() if c.isdecimal()]
    last, widest = max(wanted), (0, 0)
    for index, line in enumerate(text.lines[:HEADER_WITHIN]):
        for delimiter in DELIMITERS:
            cells = split_line(line, delimiter)
            if len(cells) > widest[0] and sum(is_numeric(c) or with_its_unit(c) for c in cells) > 1:
                widest = len(cells), index + 1
            chosen = [cells[c - 1] for c in wanted] if min(wanted) > 0 and last <= len(cells) else []
            if chosen and all(is_numeric(c) or is_clock(c) or is_over_range(c) or with_its_unit(c) for c in chosen):
                names = tuple(str(i + 1) for i in range(len(cells)))
                assigned = _assigned(reading, names, text, index + 1)
                begin = begins_at(text, delimiter, index, len(cells))
                below = below_header(text, delimiter, begin - 1, names, strict=False, nameless=True)
                sheet = Sheet(
                    text,
                    delimiter,
                    0,
                    names,
                    below.units_line,
                    below.units,
                    declared_decimal=text.decimal,
                    assigned=assigned,
                )
                whole = with_rows(sheet, below.start, reading, ())
                above = not_read(sheet, [i for i in range(begin) if text.lines[i].strip()], "above the rows")
                unread = (*above, *below.unread, *whole.unread)
                return replace(whole, unread=unread, beside=tuple(_beside(whole, ())))
    if widest[0] and not 0 < min(wanted) <= last <= widest[0]:
        none = last if last > widest[0] else 0
        message = f"there is no column {none}: the rows have {widest[0]}, counted from 1"
        raise InputError(Fault(message, text.path, widest[1], advice="Name columns that there are: --columns time=1"))
    raise InputError(no_header(text))


def _are_results(sheet: Sheet, rows: Sequence[int], reading: Reading) -> bool:
    """Whether rows are those of results: named so, or too few for a record, and counted where specimens are told apart."""
    few = len(rows) < FEW_ROWS
    cells = [[c for c in split_line(sheet.text.lines[row - 1], sheet.delimiter) if c] for row in rows]
    counted = [row[0] for row in cells] == [str(k + 1) for k in range(len(rows))]
    above = [line for line in sheet.text.lines[: rows[0] - 1] if line.strip()][-_TITLES:]
    named = any(OF_RESULTS.search(line) or any(map(no_record, split_line(line, sheet.delimiter))) for line in above)
    if named and (few or counted):
        return True
    return few and (reading.specimen is None or (counted and len(cells[0]) < n_named(sheet)))


def _rows_above(sheet: Sheet, reading: Reading) -> tuple[str, ...]:
    """The note on rows of numbers above the header, as of a table of results; what may be a record is refused."""
    rows = []
    for number, line in enumerate(sheet.prelude, 1):
        cells = [c for c in split_line(line, sheet.delimiter) if c]
        if len(cells) > 1 and all(map(is_numeric, cells)):
            rows.append(number)
    if not rows:
        return ()
    if not _are_results(sheet, rows, reading):
        raise InputError(
            Fault(
                f"{len(rows)} rows of numbers stand above the header of line {sheet.header_line}, under none understood",
                sheet.text.path,
                rows[0],
                advice="Save one record per file, or correct the header above these rows",
            )
        )
    return (f"{len(rows)} row(s) of numbers above the header left out, the first in line {rows[0]}",)
