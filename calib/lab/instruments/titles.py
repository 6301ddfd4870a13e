"""From the lines between a header and its rows to the units that stand there, and what else does: rulers, counts, titles."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from types import MappingProxyType

from calib.errors import Fault, InputError
from calib.lab.instruments.brackets import are_counts, is_factor, says_sense, usual_case, without_conditions
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.common_words import say_nothing
from calib.lab.instruments.header import split_line, without_comment_mark
from calib.lab.instruments.instrument_words import instrument_words
from calib.lab.instruments.labtable import Unread
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, parse_number
from calib.lab.instruments.passed_by import may_be_passed_by
from calib.lab.instruments.text import LabText
from calib.lab.instruments.together import unit_in
from calib.lab.instruments.unit_cells import begins_with_unit, unit_cell, with_its_unit
from calib.lab.instruments.units import is_unit_of, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import NEEDS_UNIT, Heading, understand

# Lines that are looked at before the first row.
_FEW_LINES = 5
_ONE_LINE = (
    "Which of the two names a column cannot be told: keep one line of names, each with its unit, or say of every column by its "
    "number what it is, and its unit: --columns force=... --units force=..."
)
_OF_RECORD = re.compile(r"\b(?:run|test|trial|specimen|sample|probe|versuch|essai)[ ._#]*(\d+)\b", re.IGNORECASE)
# What programs call the types of numbers, in a row of them: "float,float,float", "datetime64[ns]", "<f8", "DOUBLE PRECISION".
_TYPE = re.compile(
    r"(?:float|double|single|real|decimal|numeric|number|numerical|u?int(?:eger)?|bool(?:ean)?|str(?:ing)?|text|object|date|time|"
    r"datetime|timestamp|category|categorical|varchar|char)(?:\d{1,3})?(?:\[ns\]|\(\d+\)| precision)?|[<>|=][fiuSUO]\d{1,2}",
    re.IGNORECASE,
)
_SERIAL_NUMBER = re.compile(
    r"(?:s/?n|ser(?:ial|ien)?[. ]?-?(?:no|nr|num(?:ber|mer)?)?)[.:# ]{0,3}(?=[\w-]*\d{3})[\w-]+", re.IGNORECASE
)
# The number of a press or file behind a word, in a comment on all columns: "press 3".
_NUMBER_BEHIND = re.compile(r"(?<=[^\W\d_])[ _#-]*\d{1,4}$")
# Letters that formulas have for a quantity, beside its own first letter; what a capacitance is measured with.
_OF_FORMULAS = MappingProxyType({"displacement": tuple("xszdhu"), "force": tuple("FPL"), "time": ("t",)})
_METER = re.compile(r"(?:(?:lcr|rlc|capacitance|impedance)[ -]?)?(?:meter|bridge|analy[sz]er)|lcr|rlc", re.IGNORECASE)
# A name as the letter of formulas, with an index.
_SYMBOL = re.compile(r"[^\W\d_](?:_?[^\W_]{1,2})?")
# Where programs keep columns: a group, a task or a measurement, with a name or a number.
_OF_A_PLACE = re.compile(
    r"(?:[^\W\d_]+[ _.-])?(?:groups?|gruppe|groupe|grup[po]o|tasks?|messung|measurement|mesure|run|test|daq|rig)"
    r"(?:[ _.-]?(?:[^\W_]+))?",
    re.IGNORECASE,
)
_RULER = re.compile(r"[-=_+|*~\s,;.:]*[-=_~*]{2}[-=_+|*~\s,;.:]*")


@dataclass(frozen=True)
class BelowHeader:
    """What stands below a header: index of the line where rows may begin, units and their 1-based line, and what is left."""

    start: int
    units_line: int | None = None
    units: tuple[str, ...] = ()
    unread: tuple[Unread, ...] = ()


def below_header(
    text: LabText, delimiter: str, header: int, names: Sequence[str], *, strict: bool, nameless: bool = False
) -> BelowHeader:
    """Find the units row below a header, and pass by rulers and by numbers of columns or channels.

    Parameters
    ----------
    text : the file.
    delimiter : between cells.
    header : index of the line of the header.
    names : its cells.
    strict : whether a second line of titles is refused; not where the user says which column is what.
    nameless : whether the columns have numbers only, so that a row which counts them is no reading, however those are written.

    Raises
    ------
    InputError
        If another line of titles stands below the header: which of the two names a column cannot be told.
    """
    unread: list[Unread] = []
    units_line: int | None = None
    units: tuple[str, ...] = ()
    start = header + 1
    time = next((i for i, n in enumerate(names) if (found_name := understand(n)) and found_name.quantity == "time"), None)
    lines = list(islice((i for i in range(header + 1, len(text.lines)) if text.lines[i].strip(f" \t{delimiter}")), _FEW_LINES))
    for place, index in enumerate(lines):
        line = without_comment_mark(text.lines[index], delimiter)
        cells = split_line(line, delimiter)
        shown, later = text.lines[index].strip()[:60], [split_line(text.lines[i], delimiter) for i in lines[place + 1 :]]
        if cells[0].endswith("=") and names[0].endswith("="):
            # As LabChart labels every line of what it says of channels: "ChannelTitle=", "Range=", "UnitName=".
            if not re.match("units?", cells[0], re.IGNORECASE):
                unread.append(Unread(f"line {index + 1}", f'settings of the channels, "{shown}"'))
                start = index + 1
                continue
            cells = ["", *cells[1:]]
        found = _units(_above_readings(cells, names, later), names) if units_line is None else None
        of_logger = tuple(cells[: len(_OF_CAMPBELL)]) == _OF_CAMPBELL and units_line is None
        if index + 1 == text.units_line or of_logger:
            # Units that are not known stay as they are written: what has one is no quantity, or is refused.
            found = tuple(c.strip() if (own := unit_cell(c)) is None else own.unit for c in cells)
        if of_logger and found is not None:
            found = ("", "", *found[len(_OF_CAMPBELL) :])
        if _RULER.fullmatch(line):
            unread.append(Unread(f"line {index + 1}", f'a ruler, "{shown}"'))
        elif all(c.strip(' -–—"') == "" for c in cells):
            unread.append(Unread(f"line {index + 1}", f'nothing but dashes, "{shown}"'))
        elif units_line is None and _symbols(cells, names, later):
            unread.append(Unread(f"line {index + 1}", f'the names of line {header + 1} as symbols, "{shown}"'))
        elif units_line is None and later and _described(cells, names, later[0]):
            unread.append(Unread(f"line {index + 1}", f'the names of line {header + 1} in words, "{shown}"'))
        elif found is not None:
            units_line, units = index + 1, found
            unread += _words_among(cells, found, index + 1)
        elif units_line == index and _made_by_logger(text.lines[index - 1], cells, delimiter):
            unread.append(Unread(f"line {index + 1}", f'what the logger made of its readings, "{shown}"'))
            _check_no_statistics(text, index, cells, names)
        elif _counts(cells, names) and ((nameless and len(names) > 2) or _written_otherwise(cells, later)):
            unread.append(Unread(f"line {index + 1}", f'numbers of the columns, "{shown}"'))
        elif _falls_after(cells, later, time):
            unread.append(Unread(f"line {index + 1}", f'numbers above the record, time falls after them: "{shown}"'))
        elif said := _leaves_columns(cells, names, units):
            unread.append(Unread(f"line {index + 1}", f'{said}, "{shown}"'))
        elif units_line is not None and units_line == lines[place - 1] + 1 and _comments(cells, names, units):
            unread.append(Unread(f"line {index + 1}", f'comments on the columns, "{shown}"'))
        elif delimiter != " " and _one_for_all(cells, names):
            unread.append(Unread(f"line {index + 1}", f'the same words in every column, "{shown}"'))
        elif _titles(cells, names) and delimiter != " ":
            if _named_again(cells, names):
                unread.append(Unread(f"line {index + 1}", f'the names of line {header + 1} in other words, "{shown}"'))
            elif strict:
                message = f'"{shown}" stands below the header of line {header + 1} like another header'
                raise InputError(Fault(message, text.path, index + 1, advice=_ONE_LINE))
            else:
                unread.append(Unread(f"line {index + 1}", f'another line of titles, "{shown}"'))
        else:
            break
        start = index + 1
    return BelowHeader(start, units_line, units, tuple(unread))


# What loggers of Campbell (TOA5) write as units of their time stamps and of the numbers of their records.
_OF_CAMPBELL = ("TS", "RN")
# What they write below: of readings as they are, or of their mean, and of statistics that are no record.
_READINGS, _STATISTICS = (
    ("", "smp", "avg"),
    ("max", "min", "std", "tot", "tmx", "tmn", "med", "cov", "cot", "mom", "hst", "rfh"),
)


def _made_by_logger(units: str, cells: Sequence[str], delimiter: str) -> bool:
    """Whether a line below units of a logger of Campbell says what it made of the readings of each column."""
    of_units = tuple(split_line(units, delimiter)[: len(_OF_CAMPBELL)])
    return of_units == _OF_CAMPBELL and all(c.strip().lower() in (*_READINGS, *_STATISTICS) for c in cells)


def _check_no_statistics(text: LabText, index: int, cells: Sequence[str], names: Sequence[str]) -> None:
    """Refuse a statistic under a name of readings, which says nothing of it."""
    for column, (cell, name) in enumerate(zip(cells, names, strict=False)):
        heading = understand(name)
        if cell.strip().lower() not in _STATISTICS or heading is None or heading.name_doubt:
            continue
        message = f'"{cell.strip()}" stands below "{name}": it is no reading, but a statistic of several'
        otherwise = f'else write the statistic into the name, "{name}_{cell.strip()}"'
        advice = f"Empty that cell if these are the readings that are meant, {otherwise}"
        raise InputError(Fault(message, text.path, index + 1, column + 1, advice=advice))


def _above_readings(cells: Sequence[str], names: Sequence[str], later: Sequence[Sequence[str]]) -> list[str]:
    """The cells but for those over columns that hold nothing and are none by name, as of results beside a table."""
    width = max(map(len, later), default=0)
    holding = [any(k < len(row) and row[k] for row in later) for k in range(width)]
    empty = {k for k, name in enumerate(names) if not (k < width and holding[k]) and understand(name) is None}
    return list(cells) if len(later) < 2 else ["" if k in empty else cell for k, cell in enumerate(cells)]


def units_above(text: LabText, delimiter: str, header: int, names: Sequence[str]) -> tuple[int, tuple[str, ...]] | None:
    """Find a row of units right above a header: units alone, one above each name at least twice, and none of another kind.

    Parameters
    ----------
    text : the file.
    delimiter : between cells.
    header : index of the line of the header.
    names : its cells.

    Returns
    -------
    Its 1-based line, and the units, "" where there is none; None if no such row stands there.
    """
    for index in range(header - 1, max(header - 1 - _FEW_LINES, -1), -1):
        cells = split_line(without_comment_mark(text.lines[index], delimiter), delimiter)
        if not any(cells):
            continue
        units = units_in_row(cells, names)
        named = [(h.quantity, u) for n, u in zip(names, units, strict=True) if u and (h := understand(n, u))] if units else []
        fitting = len(named) > 1 and all(is_unit_of(unit, quantity) for quantity, unit in named)
        return (index + 1, units) if units and fitting else None
    return None


def units_in_row(cells: Sequence[str], names: Sequence[str]) -> tuple[str, ...] | None:
    """The units of a row that holds nothing else, as many cells as there are names, "" where there is none; else None.

    Parameters
    ----------
    cells, names : of the row and of the header.

    >>> units_in_row(["s", "[mm]", ""], ["Time", "Extension", "No"]), units_in_row(["s", "5"], ["Time", "Load"])
    (('s', 'mm', ''), None)
    """
    alone = all((own := unit_cell(c)) is not None and not own.remark for c in cells)
    return _units(cells, names) if alone and len(cells) == len(names) else None


def begins_at(text: LabText, delimiter: str, row: int, width: int) -> int:
    """The line where a table without names begins: at its first row of numbers, or at rows of units and counts right above.

    Parameters
    ----------
    text : the file.
    delimiter : between cells.
    row : index of the first row of numbers.
    width : its number of cells.
    """
    names = [str(k + 1) for k in range(width)]
    while row > 0:
        cells = split_line(without_comment_mark(text.lines[row - 1], delimiter), delimiter)
        if len(cells) != width or not (_units(cells, names) or _counts(cells, names)):
            break
        row -= 1
    return row


def _words_among(cells: Sequence[str], units: Sequence[str], line: int) -> list[Unread]:
    """What stands in a row of units beside them, or in place of one, and is not read."""
    found = []
    for cell, unit in zip(cells, units, strict=True):
        own = unit_cell(cell)
        if own is None and cell.strip() and not unit:
            found.append(Unread(f"line {line}", f'"{cell[:40]}" stands among the units'))
        elif own is not None and own.remark:
            found.append(Unread(f"line {line}", f'"{own.remark[:40]}" stands beside the unit {own.unit}'))
    return found


def _units(cells: Sequence[str], names: Sequence[str]) -> tuple[str, ...] | None:
    """The units in a row of units, "" where there is none; None if it is none, as one of numbers alone: "1" or "1,200"."""
    if all(is_numeric(c) or not c.strip() for c in cells):
        return None
    usual = [usual_case(name, c) for c, name in zip_longest(cells, names[: len(cells)], fillvalue="")]
    read = [unit_cell(c) for c in usual]
    units = tuple("" if u is None else u.unit if c == w else c for c, w, u in zip(cells, usual, read, strict=True))
    if any(units) and all(own is not None for own in read):
        return units
    there = [c for c in cells if c.strip()]
    if len(cells) > len(names) or len(there) < 2:
        return None
    # Where words may change what a unit means, its column has none; but the row is one of units.
    if all(begins_with_unit(c) or unit_cell(c) is not None for c in there):
        return units
    # Names of what has no unit may stand again among them: "NO.,Time,ms,N,mm".
    fitting = [_fits(n, c) for n, c in zip(names, units, strict=False)]
    if sum(fit is True for fit in fitting) > 1 and False not in fitting and not any(map(_is_reading, there)):
        return tuple(unit if fit else "" for unit, fit in zip(units, fitting, strict=False))
    # Counts of a converter are in no unit: "s,counts,N,steps,mm".
    of_counts = [own is None and are_counts(c) for c, own in zip(cells, read, strict=True)]
    if any(of_counts) and all(is_count or own is not None for is_count, own in zip(of_counts, read, strict=True)):
        return units if any(u and looks_like_unit(u) for u in units) else None
    # A remark may stand among them, in the last of several cells.
    known = sum(bool(u) and looks_like_unit(u) for u in units)
    wordy = [c for c, own in zip(cells, read, strict=True) if c.strip() and own is None]
    return units if known >= max(2, len(there) - 1) and not any(map(_is_reading, wordy)) else None


def _symbols(cells: Sequence[str], names: Sequence[str], later: Sequence[Sequence[str]]) -> bool:
    """Whether cells are the names once more as symbols, above the row of units, as Logger Pro has them: "t", "F", "d"."""
    pairs = [(name, cell) for name, cell in zip(names, cells, strict=False) if cell.strip()]
    short = all(_SYMBOL.fullmatch(cell) and _is_symbol_of(cell, name) for name, cell in pairs)
    if len(cells) != len(names) or len(pairs) < 2 or not short or not later or len(later[0]) != len(names):
        return False
    below = [_fits(name, unit) for name, unit in zip(names, later[0], strict=True)]
    own = [_fits(name, cell) for name, cell in zip(names, cells, strict=True)]
    return below.count(True) > 1 and False not in below and own.count(True) < below.count(True)


def _is_symbol_of(cell: str, name: str) -> bool:
    """Whether a name begins with the letter of a symbol, or formulas have that for its quantity, alone or with a number."""
    own = understand(name)
    of_formulas = own is not None and re.sub(r"_?\d$", "", cell) in _OF_FORMULAS.get(own.quantity, ())
    return cell[:1].casefold() == name[:1].casefold() or of_formulas


def _described(cells: Sequence[str], names: Sequence[str], below: Sequence[str]) -> bool:
    """Whether cells say in words what each name is, above the row of units: "elapsed time", "load cell" below "t", "F"."""
    units = _units(below, names)
    if units is None or not len(cells) == len(names) == len(units) or not _comments(cells, names, units):
        return False
    told = [understand(cell) is not None for cell in cells]
    return sum(told) > 1 and all(own or not cell.strip() or _is_meter(cell) for own, cell in zip(told, cells, strict=True))


def _is_meter(cell: str) -> bool:
    """Whether a cell says what a capacitance is measured with, and at which frequency: "LCR meter, 1 kHz"."""
    return _METER.fullmatch(without_conditions(cell)[0].strip(" ,;@")) is not None


def _fits(name: str, unit: str) -> bool | None:
    """Whether a cell is the unit of the quantity that a name alone is; None of a name that needs none, or of a clock."""
    own = understand(name) if name else None
    if own is None or own.quantity not in NEEDS_UNIT or (own.quantity == "time" and not looks_like_unit(unit)):
        return None
    return is_unit_of(unit, own.quantity)


def _is_reading(cell: str) -> bool:
    return is_numeric(cell) or is_clock(cell) or is_over_range(cell) or is_missing(cell) or with_its_unit(cell)


def _counts(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row counts the columns: 1, 2, 3 or 0, 1, 2 or CH1, CH2, CH3."""
    digits = [re.sub(r"^(?:ch(?:annel)?|col(?:umn)?|no)?[ ._#]*", "", c.strip().lower()) for c in cells if c.strip()]
    whole = all(d.isdecimal() and len(d) < 4 for d in digits)
    if len(digits) < 2 or len(digits) < len([n for n in names if n]) - 1 or not whole:
        return False
    first = int(digits[0])
    return first in (0, 1) and [int(d) for d in digits] == list(range(first, first + len(digits)))


def _falls_after(cells: Sequence[str], rows: Sequence[Sequence[str]], time: int | None) -> bool:
    """Whether a row of numbers, as of gains, stands above the record: time falls after it, and is written otherwise below."""
    rows = [row for row in rows if time is not None and time < len(row) and parse_number(row[time], ".") is not None]
    if (
        time is None
        or time >= len(cells)
        or len(rows) < 3
        or len(cells) < len(rows[0])
        or parse_number(cells[time], ".") is None
    ):
        return False
    values = [parse_number(row[time], ".") or 0.0 for row in (cells, *rows)]
    if not values[0] > values[1] < values[2] < values[3]:
        return False
    digits = [[len(c.partition(".")[2]) for c in row] for row in (cells, *rows)]
    odd = [
        k for k in range(len(cells)) if is_numeric(cells[k]) and digits[0][k] not in [d[k] for d in digits[1:] if k < len(d)]
    ]
    return len(odd) > 1


def _written_otherwise(cells: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Whether the rows below have decimals in most columns, or all of them in two, where these cells are whole numbers."""
    rows = [row for row in rows if sum(map(is_numeric, row)) * 2 >= len(row)]
    if not rows:
        return False
    if not all(map(is_numeric, (c for c in cells if c))):
        return True
    decimals = [[bool(re.search(r"[.,]\d|[eE]", c)) for c in row] for row in rows]
    always = sum(map(all, zip(*decimals, strict=False)))
    return always > 1 or min(map(sum, decimals)) * 2 >= len([c for c in cells if c])


def _comments(cells: Sequence[str], names: Sequence[str], units: Sequence[str]) -> bool:
    """Whether a row below the units, as Origin has one, says of columns what leaves them as they are, and names none anew."""
    if not len(cells) == len(names) == len(units) or not any(c.strip() for c in cells):
        return False
    if len({match[1] for cell in cells if (match := _OF_RECORD.search(cell)) is not None}) > 1:
        return False  # columns of several records
    for cell, name, unit in zip(cells, names, units, strict=True):
        if not cell.strip():
            continue
        own, above = understand(cell), understand(name, unit)
        renamed = own is not None and (above is None or own.quantity != above.quantity)
        if renamed or _is_reading(cell) or begins_with_unit(cell):
            return False
        # A remark, or the instrument: "measured", "Instron 5943".
        if _is_meter(cell):
            continue
        if unit_cell(f"({unit or '-'}) {cell}") is None and not all(instrument_words(cell.split())):
            return False
    return True


def _leaves_columns(cells: Sequence[str], names: Sequence[str], units: Sequence[str]) -> str:
    """What a row says that leaves columns with names and units what they are: types, serial numbers, comments.

    "" if it says something else, or the columns have no names and units. Words that differ tell columns of one quantity apart.
    """
    pairs = [(understand(name, unit), unit) for name, unit in zip(names, [*units, *[""] * len(names)], strict=False)]
    needed = [heading.unit or unit for heading, unit in pairs if heading is not None and heading.quantity in NEEDS_UNIT]
    said = [cell.strip() for cell in cells if cell.strip(" -–—")]
    if len(said) < 2 or len(cells) > len(names) or len(needed) < 2 or not all(needed):
        return ""
    if all(_TYPE.fullmatch(cell) for cell in said):
        return "types of the columns"
    serial = [_SERIAL_NUMBER.fullmatch(cell) is not None for cell in said]
    if any(serial) and all(own or all(instrument_words(cell.split())) for cell, own in zip(said, serial, strict=True)):
        return "serial numbers"
    if len(set(said)) > 1:
        return "comments on the columns" if _remarks(cells, [heading for heading, _ in pairs], names, units) else ""
    if len(said) + 1 < len(names) or understand(said[0]) is not None or begins_with_unit(said[0]):
        return ""
    words = _NUMBER_BEHIND.sub("", said[0])
    changes = (
        _is_reading(words)
        or is_factor(words)
        or says_sense(words)
        or any(unit_cell(f"({unit}) {words}") is None for unit in needed)
    )
    return "" if changes else "one comment on all columns"


def _remarks(cells: Sequence[str], headings: Sequence[Heading | None], names: Sequence[str], units: Sequence[str]) -> bool:
    """Whether a row holds words that leave each column what it is, where no two are of one quantity or in units of one."""
    quantities = [stands_for(h.quantity) for h in headings if h is not None]
    written = [unit or unit_in(name) for name, unit in zip_longest(names, units, fillvalue="")]
    apart = all(quantities.count(q) == 1 and sum(is_unit_of(u or "?", q) for u in written) < 2 for q in set(quantities))
    return apart and all(
        may_be_passed_by(cell.strip(), heading.quantity if heading is not None else "")
        for cell, heading in zip_longest(cells[: len(headings)], headings)
        if cell is not None and cell.strip(" -–—")
    )


def _titles(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row holds words for several columns, as a header does."""
    there = [c for c in cells if c.strip()]
    if len(there) < 2 or len(cells) < len(names) or [c.strip() for c in cells] == list(names):
        return False
    return not any(map(_is_reading, there))


def _one_for_all(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row has the same words in every cell, of where columns are kept ("wf group 1"), not of what they are."""
    if len(names) < 2 or len(cells) != len(names) or len({*cells}) > 1 or not any(map(str.isalpha, cells[0])):
        return False
    known = any(reads(cells[0]) for reads in (understand, with_its_unit, unit_cell, says_sense, are_counts, is_missing))
    return not known and cells[0] not in names and _OF_A_PLACE.fullmatch(cells[0]) is not None and say_nothing(cells[0])


def _named_again(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row names each column once more, as in another language, without a unit or a word that the first has not."""
    pairs = [(understand(cell), understand(name)) for cell, name in zip_longest(cells, names, fillvalue="")]
    same = [
        one is not None
        and other is not None
        and (one.quantity, one.index, one.processed) == (other.quantity, other.index, other.processed)
        and not (one.unit or one.unit_doubt or one.name_doubt)
        for one, other in pairs
    ]
    return all(same)
