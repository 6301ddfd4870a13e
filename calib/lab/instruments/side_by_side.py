"""From a `Sheet` in which several specimens stand side by side to the columns of the one that is asked for."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.header import split_line
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.no_header import no_header
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.rivals import difference, goes_back, readings, stands_still
from calib.lab.instruments.sheet import Sheet, which_specimen
from calib.lab.instruments.together import unit_in
from calib.lab.instruments.unit_choice import unit_of_column, written_unit
from calib.lab.instruments.units import RECORDED
from calib.lab.instruments.vocabulary import Heading, without_run

# Rows of numbers by which it is seen which columns hold them.
_ROWS_SEEN = 20
# Lines that are looked at to tell how columns go on.
_LINES_SEEN = 2000
# A time goes on behind another within so many steps.
_STEPS = 2.5


def one_of_side_by_side(sheet: Sheet, reading: Reading) -> tuple[Sheet, tuple[str, ...]]:
    """Keep the columns of one specimen, where several stand side by side with the same names, or with names for the first only.

    Parameters
    ----------
    sheet : without rows.
    reading : what the user says of the file.

    Returns
    -------
    The sheet, and a note on the specimen; () if there is one only.

    Raises
    ------
    SeveralSpecimens
        If several stand side by side and `reading` does not say which.
    InputError
        If their columns differ, or the header names none that is understood.
    """
    found = sheet.headings
    if not found:
        raise InputError(no_header(sheet.text))
    places: dict[tuple[str, str], list[int]] = {}
    for index, heading in found.items():
        if index not in sheet.assigned and heading.quantity != "status":
            places.setdefault((heading.quantity, heading.name), []).append(index)
    repeated = {key: at for key, at in places.items() if len(at) > 1}
    counts = {len(at) for at in repeated.values()}
    if len(repeated) < 2 or len(counts) != 1:
        return _first_named_only(sheet, reading, found)
    count = counts.pop()
    steps = {b - a for at in repeated.values() for a, b in pairwise(at)}
    if len(steps) != 1 or _in_two_units(sheet, reading, found, repeated):
        return sheet, ()
    period = steps.pop()
    first = min(at[0] for at in repeated.values())
    groups = [sheet.names[first + k * period : first + (k + 1) * period] for k in range(count)]
    groups = [(*group, *[""] * (period - len(group))) for group in groups]
    alone = [i for i, h in found.items() if i < first and h.quantity != "time"]
    plain = {tuple(map(_without_unit, group)) for group in groups}
    if len(plain) != 1 or alone:
        raise InputError(
            Fault(
                f"{count} specimens seem to stand side by side, but their columns differ: "
                + " / ".join(", ".join(f'"{n}"' for n in group) for group in groups),
                sheet.text.path,
                sheet.header_line,
                first + 1,
                advice="Export one specimen per file, or correct the header",
            )
        )
    if reading.specimen is None and _time_goes_on(sheet, found, range(first, first + count * period), period):
        raise InputError(
            Fault(
                f"{count} blocks of columns stand side by side, and the time of each goes on where that of the block before "
                "ends: they seem to be one record",
                sheet.text.path,
                sheet.header_line,
                first + 1,
                advice="Put them one below the other, under one line of names, in the order of their times; if they are "
                f"specimens, say which one: --specimen 1 to --specimen {count}",
            )
        )
    return _specimen(sheet, reading, first, period, count)


def _without_unit(name: str) -> str:
    """A name without its run and the unit that ends it, which may be another for each specimen."""
    name = without_run(name).strip()
    unit = unit_in(name)
    match = re.search(rf"[\s_,:|/(\[]*{re.escape(unit)}\s*[)\]]?$", name) if unit else None
    return name[: match.start()] if match is not None else name


def _time_goes_on(sheet: Sheet, found: Mapping[int, Heading], of_all: range, period: int) -> bool:
    """Whether the times of blocks of columns follow each other by a step as within a block, as where a table is folded."""
    times = [i for i in of_all if i in found and found[i].quantity == "time"]
    rows = _first_lines(sheet)
    if len(times) * period != len(of_all) or len(rows) == _LINES_SEEN:
        return False
    columns = readings(
        [[row[i] if i < len(row) else "" for row in rows] for i in times], [1.0] * len(times), sheet.declared_decimal
    )
    parts = [values[np.isfinite(values)] for values in columns]
    if any(part.size < 2 or np.any(np.diff(part) < 0) for part in parts):
        return False
    return all(0 < after[0] - part[-1] <= _STEPS * np.median(np.diff(part)) for part, after in pairwise(parts))


def _first_named_only(sheet: Sheet, reading: Reading, found: Mapping[int, Heading]) -> tuple[Sheet, tuple[str, ...]]:
    """The sheet with the names of the first specimen over the columns of the one asked for, where those have none."""
    named = [i for i, name in enumerate(sheet.names) if name]
    last = named[-1] + 1
    quantities = {h.quantity for i, h in found.items() if i not in sheet.assigned}
    if len(quantities) < 2 or len(sheet.names) < last + 2:
        return sheet, ()
    numbers = _columns_of_numbers(sheet)
    nameless = [i for i in range(last, len(sheet.names)) if i in numbers]
    first = named[0]
    own = [i for i in range(first, last) if i in numbers]
    if len(nameless) < 2 or not own or any(i >= last for i in sheet.assigned):
        return sheet, ()
    if 2 * max(numbers[i] for i in nameless) <= max(numbers.values()):
        return sheet, ()  # values of a small table beside the rows
    period = _period(own, nameless) if _go_on(sheet, found, own, nameless) else 0
    if not period and sheet.delimiter == ",":
        return sheet, ()
    count = 1 + -(-(max(nameless) + 1 - first - period) // period) if period else 0
    if not period or any((i - first) % period + first not in own for i in nameless):
        columns = f"columns {nameless[0] + 1} to {nameless[-1] + 1}"
        raise InputError(
            Fault(
                f"{columns} hold numbers and have no names: whether other specimens or other channels cannot be told",
                sheet.text.path,
                sheet.header_line,
                nameless[0] + 1,
                advice="Name them in the header, or say which columns are meant by their numbers: "
                + " ".join(f'--columns "{h.quantity}={i + 1}"' for i, h in found.items() if h.quantity in RECORDED),
            )
        )
    names, units = list(sheet.names), [sheet.unit_below(i) for i in range(len(sheet.names))]
    for k in range(1, count):
        for i in range(first, min(first + period, len(names) - k * period)):
            names[i + k * period], units[i + k * period] = sheet.names[i], sheet.unit_below(i)
    whole = replace(sheet, names=tuple(names), units=tuple(units) if sheet.units else ())
    chosen, notes = _specimen(whole, reading, first, period, count)
    if reading.specimen != 1:
        notes = (*notes, f"these columns have no names; those of columns {first + 1} to {first + period} are taken")
    return chosen, notes


def _first_lines(sheet: Sheet) -> list[list[str]]:
    """The cells of the lines below the header, as many as are looked at."""
    return [split_line(line, sheet.delimiter) for line in sheet.text.lines[sheet.header_line :][:_LINES_SEEN]]


def _in_two_units(
    sheet: Sheet, reading: Reading, found: Mapping[int, Heading], repeated: Mapping[tuple[str, str], Sequence[int]]
) -> bool:
    """Whether columns stand again in other units, as one converts them in a spreadsheet: no specimens, whose readings differ.

    One quantity that agrees shows that; of others that do not the user is asked when columns are chosen.
    """
    seen = [row for row in _first_lines(sheet) if sum(map(is_numeric, row)) > 1]
    agree = False
    for (quantity, _), at in repeated.items():
        if len({found[i].index for i in at}) > 1:
            return False
        written = {unit for i in at if (unit := written_unit(sheet, i, found[i]))}
        if quantity == "time" or len(written) < len(at):
            continue
        cells = [[row[i] if i < len(row) else "" for row in seen] for i in at]
        units = [unit_of_column(sheet, i, found[i], reading) for i in at]
        first, *others = readings(cells, [factor for _, factor in units], sheet.declared_decimal)
        known = all(fault is None for fault, _ in units) and not stands_still(first)
        agree |= known and all(difference(first, other)[0] == "same" for other in others)
    return agree


def _go_on(sheet: Sheet, found: Mapping[int, Heading], own: Sequence[int], nameless: Sequence[int]) -> bool:
    """Whether the columns may be those of specimens: with decimals somewhere, and times that do not fall."""
    period = _period(own, nameless)
    rows = _first_lines(sheet)
    if not period or (sheet.delimiter == "," and not any("." in cell for row in rows for cell in row)):
        return False
    times = [i for i, h in found.items() if h.quantity == "time"]
    if len(times) != 1:
        return True
    for index in range(times[0], len(sheet.names), period):
        cells = [row[index] for row in rows if index < len(row)]
        (values,) = readings([cells], [1.0], sheet.declared_decimal)
        if cells and (stands_still(values) or goes_back(values)):
            return False
    return True


def _period(own: Sequence[int], nameless: Sequence[int]) -> int:
    """The number of columns after which those of the next specimen begin; 0 if the columns do not repeat."""
    width = own[-1] + 1 - own[0]
    for period in range(width, nameless[-1] + 1):
        count = -(-(nameless[-1] + 1 - own[0]) // period)
        expected = [i + k * period for k in range(count) for i in own]
        if expected == [*own, *nameless]:
            return period
    return 0


def _columns_of_numbers(sheet: Sheet) -> Counter[int]:
    """The columns that hold numbers in the first rows of numbers below the header, and in how many of these."""
    found: Counter[int] = Counter()
    start = max(sheet.header_line, sheet.units_line or 0)
    seen = 0
    for line in sheet.text.lines[start : start + 4 * _ROWS_SEEN]:
        numbers = {i for i, cell in enumerate(split_line(line, sheet.delimiter)) if is_numeric(cell)}
        if len(numbers) > 1:
            found.update(numbers)
            seen += 1
        if seen >= _ROWS_SEEN:
            break
    return found


def _specimen(sheet: Sheet, reading: Reading, first: int, period: int, count: int) -> tuple[Sheet, tuple[str, ...]]:
    if reading.specimen is None:
        listed = "; ".join(
            f"{k + 1}: columns {first + k * period + 1} to {min(first + (k + 1) * period, len(sheet.names))}"
            for k in range(count)
        )
        raise which_specimen(sheet, f"{count} specimens stand side by side ({listed})", count)
    if not 1 <= reading.specimen <= count:
        raise which_specimen(sheet, f"there is no specimen {reading.specimen}, {count} stand side by side", count)
    own = range(first + (reading.specimen - 1) * period, first + reading.specimen * period)
    of_all = range(first, first + count * period)
    aside = {
        i: f"of specimen {(i - first) // period + 1}: {reading.specimen} is asked for"
        for i in of_all
        if i not in own and i < len(sheet.names)
    }
    note = f"specimen {reading.specimen} of {count} side by side: columns {own.start + 1} to {own.stop}"
    return replace(sheet, set_aside={**sheet.set_aside, **aside}), (note,)
