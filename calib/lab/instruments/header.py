"""From the lines of a lab file to its header: delimiter, line and names, and the units and decimal mark declared above it."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice, pairwise
from types import MappingProxyType

from calib.errors import Choice, Fault
from calib.lab.instruments.alone_in_unit import alone_in_unit
from calib.lab.instruments.brackets import LONGEST, goes_on_with_conditions
from calib.lab.instruments.by_function import by_function
from calib.lab.instruments.clock_cells import is_clock, is_date, is_reading
from calib.lab.instruments.common_words import common_words
from calib.lab.instruments.designated import designated
from calib.lab.instruments.dressed import plain_names
from calib.lab.instruments.labtable import AS_FOUND, Reading
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.odd_delimiters import parted_oddly
from calib.lab.instruments.stated import explained_units, stated_units
from calib.lab.instruments.text import LabText
from calib.lab.instruments.unit_cells import with_its_unit
from calib.lab.instruments.units import RECORDED, is_unit_of, is_unit_of_a_record, lab_factor, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import EXAMPLE, Heading, as_a_mean, spelled_unit, understand, understood_names

#: Delimiters tried, in the order in which a draw is decided; a blank stands for runs of blanks.
DELIMITERS = ("\t", ";", ",", "|", " ")

# The header of a lab file lies near its top; further down only a second block would be found.
HEADER_WITHIN = 2000
# More columns than any instrument writes.
_WIDEST = 400
# Rows that show at which delimiter they are cut.
_FEW = 5
# Rows below a header that are looked at to distinguish a table of results from a record.
_ROWS_SEEN = 30
# Lines that are looked at for quantities that stand in lines, and how many readings, of what share of the cells, show one.
_LINES_OF_QUANTITIES, _READINGS_IN_A_LINE, _MOSTLY = 50, 10, 0.8
# Numbers of one reading, in lines of their own between blank ones, are fewer.
_MOST_OF_RECORD = 20


def split_line(line: str, delimiter: str) -> list[str]:
    """Cut one line into its cells, quotes and blanks around them taken off.

    Parameters
    ----------
    line : of the file.
    delimiter : between cells; a blank stands for runs of blanks.

    >>> split_line('"","1,000.06200","0.5"', ",")
    ['', '1,000.06200', '0.5']
    """
    if delimiter == " ":
        return split_blanks(line)
    if '"' in line:
        try:
            return [c.strip() for c in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
        except csv.Error:
            pass
    return [c.strip() for c in line.split(delimiter)]


_QUOTED_OR_NOT = re.compile(r'"([^"]*)"(?=\s|$)|(\S+)')


def split_blanks(line: str) -> list[str]:
    """Cut a line at runs of blanks, but for those within quotes, as R writes the names of rows.

    >>> split_blanks('"ball 1" 0.00 -0.0002'), split_blanks('5" rod')
    (['ball 1', '0.00', '-0.0002'], ['5"', 'rod'])
    """
    return [m[1] if m[2] is None else m[2] for m in _QUOTED_OR_NOT.finditer(line)] if '"' in line else line.split()


def find_header(text: LabText, reading: Reading, *, numbers: bool = False) -> tuple[str, int, list[str]] | None:
    """Find the line that names the columns, whatever a software writes above it.

    Of the lines in which names are understood (or that the user gave), that with most rows of numbers below it, then that
    with most names, then one with as many cells as they have, then the
    first.

    Parameters
    ----------
    text : the file.
    reading : what the user says of it.
    numbers : whether names may be numbers, such as frequencies, beside those that are understood.

    Returns
    -------
    Delimiter, index of the line from 0, and its cells; None if no line is one.
    """
    wanted = set(reading.columns.values())
    best: tuple[int, int, bool] = (0, 0, False)
    found: tuple[str, int, list[str]] | None = None
    for index, written in enumerate(text.lines[:HEADER_WITHIN]):
        if not written.strip() or is_numeric(written) or not any(c.isalpha() for c in written) or width_of_row(written):
            continue
        below = text.lines[index + 1 : index + _ROWS_SEEN]
        if index and text.lines[index - 1] == written == next(iter(below), None):
            continue  # the same in line after line
        for delimiter in DELIMITERS:
            line = without_comment_mark(written, delimiter)
            if delimiter == " " and ((found is not None and found[0] != " " and best[0]) or text.typed):
                continue  # cells of a workbook stand by themselves
            for cells in _header_cells(line, delimiter, below):
                if len(cells) > _WIDEST or not any(cells):
                    continue
                cells = cells if wanted.intersection(cells) else plain_names(cells)
                known = [i for i, c in enumerate(cells) if c and (c in wanted or understand(c) is not None)]
                known = known or [i for i, c in enumerate(cells) if c and as_a_mean(c) is not None]
                known = known or list(designated(tuple(cells), ("",) * len(cells)))
                known = known or list(by_function(cells, ("",) * len(cells), text.lines[:index]))
                known = known or _known_by_units(text.lines, index, cells, delimiter)
                if not known and (behind := common_words(cells)[1]):
                    cells, known = behind, [i for i, c in enumerate(behind) if c and understand(c) is not None]
                # A first number may be the specimen's, another the name of a channel.
                named_so = numbers or any(is_numeric(c) and c in wanted for c in cells)
                most = len(cells) if named_so and any(understand(c) for c in cells) else (len(known) - 1) // 2
                numerals = sum(map(is_numeric, cells[1:]))
                if (
                    not known
                    or numerals > most
                    or (numerals and named_so and not _fits_rows(len(cells), below, delimiter))
                    or _units_of_names_above(text.lines[:index], cells, delimiter)
                    or _says_units_of_names_below(line, below)
                ):
                    continue
                rows = _rows_below(text, index, delimiter, len(cells), known)
                if not rows and delimiter == " " and _stands_between_others(line, below):
                    continue
                if len(known) < 2 and (rows == 0 or _names_stand_nearer(cells, below, delimiter)):
                    continue
                score = (rows, len(known), rows > 0 and _width_below(below, delimiter) == len(cells))
                if found is not None and rows and is_same_header(cells, found[2]) and best[0]:
                    if (
                        list(cells) == list(found[2])
                        and _in_comments(text.lines[found[1] : index])
                        and not _in_comments([written])
                    ):
                        found = (delimiter, index, cells)  # which a comment above it says first
                    continue  # the header again
                if score > best and (rows or len(known) > best[1]):
                    best, found = score, (delimiter, index, cells)
    return found


def _in_comments(lines: Sequence[str]) -> bool:
    """Whether lines are nothing but comments, behind a mark of one each."""
    return all(_COMMENT_MARK.match(line) is not None for line in lines if line.strip())


def _fits_rows(width: int, below: Sequence[str], delimiter: str) -> bool:
    """Whether the first row of numbers below has so many cells, or one more; a line with numbers above others is a setting."""
    first = _width_below(below, delimiter)
    return first is None or first in (width, width + 1)


def _width_below(below: Sequence[str], delimiter: str) -> int | None:
    """How many cells the first row of numbers has; None without one."""
    rows = ([cell for cell in split_line(line, delimiter) if cell] for line in below)
    return next((len(r) for r in rows if len(r) > 1 and all(is_numeric(c) or is_clock(c) or is_missing(c) for c in r)), None)


def _known_by_units(lines: Sequence[str], index: int, cells: Sequence[str], delimiter: str) -> list[int]:
    """The cells that are a quantity by a unit that is theirs alone, in the cell or the next line; none of units beside names.

    Units alone are no names where a line of names stands above or below, be one missing, or readings above.
    """
    below, above = (
        split_line(next((lines[k] for k in others if lines[k].strip(f" \t{delimiter}")), ""), delimiter)
        for others in (range(index + 1, len(lines)), range(index - 1, -1, -1))
    )
    if any(map(_unit_alone, cells)):
        of_words = (sum(bool(c) and not is_reading(c) for c in beside) for beside in (above, below))
        if max(of_words) >= max(2, len(cells) - 1) or sum(map(is_reading, above)) > 1:
            return []
    units = tuple(map(_unit_alone, below)) if len(below) == len(cells) else ("",) * len(cells)
    if sum(map(bool, units)) > 1 and all(unit or not cell for unit, cell in zip(units, below, strict=True)):
        named = [
            i for i, (cell, unit) in enumerate(zip(cells, units, strict=True)) if unit and understand(cell, unit) is not None
        ]
        return sorted({*named, *designated(tuple(cells), units)} or alone_in_unit(tuple(cells), units))
    return list(alone_in_unit(tuple(cells), units))


def _unit_alone(cell: str) -> str:
    """The unit that is all of a cell, in brackets or not; "" if it is none."""
    unit = cell.strip(" ()[]")
    return unit if is_unit_of_a_record(unit) else ""


def _units_of_names_above(above: Sequence[str], cells: Sequence[str], delimiter: str) -> bool:
    """Whether cells are units, spelled out, of as many names in the line above, which may not be understood."""
    if sum(spelled_unit(cell) is not None for cell in cells) < 2:
        return False
    names = split_line(next((line for line in reversed(above) if line.strip()), ""), delimiter)
    return len(names) == len(cells) and all(name and not is_numeric(name) for name in names)


def _says_units_of_names_below(line: str, below: Sequence[str]) -> bool:
    """Whether a line is one of quantities and units, "force in mN, time in ms", of which two at least are named below."""
    said = {quantity for quantity, _ in _stated_each(line)} if "," in line or ";" in line else set()
    first = next((other for other in below if other.strip() and not _in_comments([other])), "") if len(said) > 1 else ""
    for delimiter in DELIMITERS if first else ():
        cells = split_line(first, delimiter)
        named = {stands_for(h.quantity) for cell in cells if cell and (h := understand(cell)) is not None}
        if len(said & named) > 1 and not any(map(is_reading, cells)):
            return True
    return False


def width_of_row(line: str) -> int:
    """How many cells a line of numbers or times, with exponents or NaN, has between some delimiter; 0 of any other line.

    >>> width_of_row("0.1,0.0004,12:00:01"), width_of_row("Time,Force")
    (3, 0)
    """
    for delimiter in DELIMITERS:
        cells = [c for c in split_line(line, delimiter) if c]
        if len(cells) > 1 and is_reading(cells[0]) and all(is_reading(c) or is_missing(c) for c in cells):
            return len(cells)
    return 0


def _names_stand_nearer(cells: Sequence[str], below: Sequence[str], delimiter: str) -> bool:
    """Whether a line of words right above the rows has as many cells as they have, and one above it another."""
    above: list[str] = []
    for line in below:
        if not line.strip():
            continue
        row = split_line(line, delimiter)
        if sum(map(is_reading, row)) > 1:
            return bool(above) and len(above) == len(row) != len(cells) and not any(is_reading(c) for c in above if c)
        above = row if all(row) and any(map(str.isalpha, "".join(row))) and not _are_units(row) else []
    return False


def _stands_between_others(line: str, below: Sequence[str]) -> bool:
    """Whether another delimiter than blanks parts a line, and the lines below it into as many numbers, as it does no name."""
    first = [row for row in below if row.strip()][:_FEW]
    for delimiter in (d for d in DELIMITERS[:-1] if d in line.strip()):
        rows = [split_line(row, delimiter) for row in first]
        if len(rows) > 1 and all(len(r) == len(split_line(line, delimiter)) and all(map(is_reading, r)) for r in rows):
            return True
    return False


def is_same_header(cells: Sequence[str], header: Sequence[str]) -> bool:
    """Whether cells are a header again, or that of the next specimen, whose number stands in its first cell.

    Parameters
    ----------
    cells, header : stripped.
    """
    if list(cells) == list(header):
        return True
    numbered = len(cells) > 1 and cells[0].isdecimal() and len(header) > 1 and header[0].isdecimal()
    return numbered and list(cells[1:]) == list(header[1:])


_COMMENT_MARK = re.compile(r'\s*(?P<quote>"?)(?:#+|%+|//+|;+|!)(?P<rest>.*)', re.DOTALL)


# What stands before the names in a comment: "# Columns: time [s], force [N]".
_SAYS_COLUMNS = re.compile(
    r"(?:columns?|fields?|header|names|variables|spalten|colonnes|columnas|colonne)\s*[:=]\s*", re.IGNORECASE
)


def without_comment_mark(line: str, delimiter: str) -> str:
    """The line without the mark that sets it apart as a comment: "# Time (s),Load (N)" as numpy.savetxt writes a header.

    Parameters
    ----------
    line : of the file.
    delimiter : between cells; a mark before it is a cell of its own, "#,Time (s)", the number of the row.
    """
    match = _COMMENT_MARK.match(line)
    if match is None or not match["rest"].strip():
        return line
    rest = _SAYS_COLUMNS.sub("", match["rest"].lstrip(" "))
    own_cell = rest.startswith(delimiter) if delimiter != " " else False
    if own_cell or (delimiter == ";" and line.lstrip().startswith(";")) or (delimiter == "\t" and rest.startswith("\t")):
        return line
    return match["quote"] + rest


def _header_cells(line: str, delimiter: str, below: Sequence[str]) -> Iterator[list[str]]:
    """The ways in which a line may be cut into header cells, given the lines below it."""
    if delimiter != " ":
        if delimiter in line:
            cells = split_line(line, delimiter)
            paired = with_their_units(cells, delimiter, below)
            yield paired or _with_row_names(_whole_brackets(cells, delimiter, below), delimiter, below)
            return
        for other in DELIMITERS[:-1]:
            # Names between semicolons, above rows between commas.
            cells = split_line(line.strip(), other) if other in line else []
            if len(cells) > 2 and _are_as_wide(below, len(cells), other, delimiter):
                yield cells
        return
    for other in DELIMITERS[:-1]:
        # Names between commas, above rows between blanks.
        cells = split_line(line.strip(), other) if other in line else []
        if len(cells) > 1 and _are_as_wide(below, len(cells), other, delimiter):
            yield cells
    if line.count('"') >= 4:
        # As R writes tables: names in quotes, blanks between them.
        yield _with_row_names(split_blanks(line), delimiter, below)
    if re.search(r"\S\s{2,}\S", line.strip()):
        yield [c.strip() for c in re.split(r"\s{2,}", line.strip())]
    # A unit in brackets belongs to the name before it.
    cells = re.findall(r"[^\s()\[\]]+(?:\s?[(\[][^()\[\]]*[)\]])?", line)
    yield [ROW_NAMES, *cells] if line.startswith(" ") and _are_counted(below, len(cells) + 1) else cells


def _are_counted(lines: Sequence[str], width: int) -> bool:
    """Whether lines are rows of numbers between blanks, so many in each, the first counting them, as pandas prints a table."""
    rows = [line.split() for line in lines if line.strip()]
    if len(rows) < 3 or not all(len(row) == width and row[0].isdecimal() for row in rows):
        return False
    return all(int(after[0]) == int(before[0]) + 1 for before, after in pairwise(rows))


def _are_as_wide(lines: Sequence[str], width: int, mark: str, delimiter: str) -> bool:
    """Whether lines are rows of numbers, as many in each, without a mark that stands between the names."""
    rows = [split_line(line, delimiter) for line in lines if line.strip()]
    return bool(rows) and not any(mark in line for line in lines) and all(len(r) == width and is_numeric(r[0]) for r in rows)


def with_their_units(cells: Sequence[str], delimiter: str, below: Sequence[str]) -> list[str]:
    """The names with the unit that stands in the cell behind each, where the rows have half as many cells; [] of any others.

    Parameters
    ----------
    cells : of a header.
    delimiter, below : between cells, and the lines below it.

    >>> with_their_units(["Time", "s", "Force", "N"], ",", ["0.0,0.1", "0.1,0.2"])
    ['Time (s)', 'Force (N)']
    """
    names, units = cells[::2], cells[1::2]
    if len(names) != len(units) or len(names) < 2 or not all(names) or not all(map(is_unit_of_a_record, units)):
        return []
    rows = [row for row in (split_line(line, delimiter) for line in below if line.strip()) if row and is_numeric(row[0])]
    fits = len(rows) > 1 and all(len(row) == len(names) for row in rows)
    return [f"{name} ({unit})" for name, unit in zip(names, units, strict=True)] if fits else []


def _whole_brackets(cells: list[str], delimiter: str, below: Sequence[str]) -> list[str]:
    """The cells, with names that delimiters cut in two put together if rows have as many then.

    These are names with brackets ("Force (N" and "tared)"), and with settings of a meter ("Cp (pF) @ 1 kHz" and "1 V").
    """
    whole: list[str] = []
    for cell in cells:
        goes_on = bool(whole) and (_is_open(whole[-1]) or goes_on_with_conditions(whole[-1], cell))
        whole[len(whole) - goes_on :] = [f"{whole[-1]}{delimiter} {cell}" if goes_on else cell]
    if len(whole) == len(cells):
        return cells
    widths = {len(row) for row in (split_line(line, delimiter) for line in below) if row and is_numeric(row[0])}
    return whole if widths == {len(whole)} else cells


def _is_open(cell: str) -> bool:
    return len(cell) <= LONGEST and any(cell.count(opening) > cell.count(closing) for opening, closing in ("()", "[]"))


def _with_row_names(cells: list[str], delimiter: str, below: Sequence[str]) -> list[str]:
    """The cells with a name before them if every row begins with one in quotes, as R writes the names of rows without a name.

    The cells behind it are without quotes, as R writes numbers: where all are in quotes a name may be missing anywhere.
    """
    rows = [line for line in below if line.strip()]
    named = all(_ROW_NAME.match(line) and len(split_line(line, delimiter)) == len(cells) + 1 for line in rows)
    return [ROW_NAMES, *cells] if rows and named else cells


#: What the column of the names of rows is called, to which no header gives a name.
ROW_NAMES = "row names"
_ROW_NAME = re.compile(r'\s*"[^"]*"\s*[\s,;|]\s*[^"\s]')


def _rows_below(text: LabText, header: int, delimiter: str, width: int, known: Sequence[int]) -> int:
    """Rows of numbers below a header, at most `_ROWS_SEEN`, up to the next line of words after the first row."""
    rows = 0
    words_since = 0
    for line in text.lines[header + 1 : header + 4 * _ROWS_SEEN]:
        if not line.strip():
            continue
        cells = split_line(line, delimiter)
        numbers = sum(1 for i in known if i < len(cells) and (is_reading(cells[i]) or with_its_unit(cells[i])))
        if numbers and (delimiter != " " or len(cells) == width) and len(cells) > 1:
            rows += 1
        elif rows:
            break
        else:
            words_since += 1
            if words_since > 3:
                break
        if rows >= _ROWS_SEEN:
            break
    return rows


#: What may be said of the columns of a file whose names are not understood, as an example: units are those of the file.
SAID_BY_NUMBER = (
    "--columns time=1 --columns displacement=2 --columns force=3 --units time=... --units displacement=... --units force=..., "
    "each in the unit of the file"
)


#: What a table looks like, for a file in which none is found.
A_TABLE = (
    "A table has one line of names with their units, below it one line for each reading, and one separator in all of them: "
    '"Time (s);Displacement (mm);Force (N)", then "0.0;0.000;0.001", then "0.1;0.020;0.004". Export the file so, or write it '
    "so by a few lines of a program"
)


def no_header(text: LabText) -> Fault:
    """The fault of a file without a header that is understood, with what seems to be one."""
    first, width = _first_row(text)
    unknown = unknown_header(text)
    seen = (unknown[1] + 1, [f'"{c[:40]}"' for c in unknown[2] if c][:12]) if unknown is not None else _likely_header(text)
    found = (
        f"; found {', '.join(seen[1])}"
        if seen
        else f'; {"the first row is" if width else "the file begins with"} "{text.lines[first].strip()[:60]}"'
    )
    numbered = find_header(text, AS_FOUND, numbers=True)
    odd = [(k, c) for k, c in enumerate(numbered[2], 1) if is_numeric(c)] if numbered is not None else []
    if numbered is not None and odd and not seen:
        said = f"--columns capacitance={odd[0][1]} --units capacitance=..."
        return Fault(
            f"numbers stand where names of columns would: {', '.join(c for _, c in odd[:8])}",
            text.path,
            numbered[1] + 1,
            odd[0][0],
            advice=f"If they are names, say which column is what, and its unit: {said}",
        )
    if (odd_delimiter := parted_oddly(text.path, text.lines)) is not None:
        return odd_delimiter
    if (alone := _one_a_line(text)) is not None:
        return alone
    lying = _quantities_in_lines(text)
    if lying and not seen:
        places = " and ".join(f'"{name}" in line {line}' for line, name in lying[:4])
        return Fault(
            f"each quantity stands in a line, with its readings one beside the other: {places}",
            text.path,
            lying[0][0],
            advice="Turn rows and columns, so that each quantity is a column with its name on top (in a spreadsheet: copy, "
            "paste special, transpose), and save the file again",
        )
    with_units = _numbers_with_units(text)
    names = split_line(text.lines[seen[0] - 1], with_units[1]) if seen is not None and with_units is not None else []
    blank = with_units is not None and with_units[1] == " "
    if with_units is not None and ((blank and not seen) or all(with_its_unit(name) or is_reading(name) for name in names)):
        line, _, of = with_units
        shown = ", ".join(f"{quantity} in column {k}" for quantity, k in of.items())
        said = " ".join(str(Choice("columns", (str(k),), quantity)) for quantity, k in of.items())
        return Fault(
            f'there is no header, but numbers with their units, "{text.lines[line].strip()[:60]}": by these {shown}',
            text.path,
            line + 1,
            advice=f"If that is so, say it: {said}; or write names above them",
        )
    replies = _reply_lines(text)
    if replies and not seen:
        return Fault(
            f"there is no header; the lines look like replies of {replies}, without a time and without the names of the values",
            text.path,
            advice="A capacitance is read over a time: log the time of each reply in a column before it, and write names and "
            'units above, as in "Time (s),Cp (F),D,status"',
        )
    if not seen and (clock := _beside_a_clock(text.lines[first])) is not None:
        return Fault(f"there is no header; {clock[0]}{found}", text.path, first + 1, advice=clock[1])
    if not width:
        return Fault(
            f"no table is found{found}",
            text.path,
            first + 1,
            advice=A_TABLE,
        )
    understood = "; ".join(f"{q}: {understood_names(q)}" for q in ("displacement", "force", "capacitance", "time"))
    return Fault(
        f"no header row with column names that are understood{found}",
        text.path,
        seen[0] if seen else first + 1,
        advice=f'Name the columns for example "{EXAMPLE["time"]}", "{EXAMPLE["force"]}", or say which is what, by '
        f"{'name or ' if seen else ''}number: {_by_number(text, width, unknown)}. Understood are {understood}",
    )


def _first_row(text: LabText) -> tuple[int, int]:
    """The index of the first line of numbers that stands with others, and its cells; the first line and 0 of a file without."""
    filled = [i for i, line in enumerate(text.lines[:HEADER_WITHIN]) if line.strip()]
    widths = ((i, width_of_row(text.lines[i])) for i in filled)
    rows = ((i, n) for (i, n), (_, below) in pairwise(widths) if n > 1 and n == below)
    return next(rows, (filled[0] if filled else 0, 0))


def _one_a_line(text: LabText) -> Fault | None:
    """The fault of a file that has one number a line; None of any other. Blank lines show how many are of one record."""
    numbers = [is_reading(line.strip()) and not width_of_row(line) for line in text.lines[:HEADER_WITHIN] if line.strip()]
    if len(numbers) < _READINGS_IN_A_LINE or sum(numbers) < _MOSTLY * len(numbers):
        return None
    first = next(i for i, line in enumerate(text.lines) if is_reading(line.strip()))
    names = [line.strip() for line in text.lines[:first] if line.strip()]
    blocks = Counter(len(block.split()) for block in re.split(r"\n\s*\n", "\n".join(text.lines[first:]).strip()))
    block, n_block = blocks.most_common(1)[0]
    n = block if 1 < block < _MOST_OF_RECORD and n_block > 1 else len(names) if len(names) > 1 else 3
    of_names = ", as many as lines of names stand above" if n == len(names) else ""
    each = "" if of_names or n == block else " (here three, a dash for each)"
    name = text.path.name
    return Fault(
        "each line holds one number, and nothing shows which of them are of one reading",
        text.path,
        first + 1,
        advice="Write what was read at one time in one line, below a line of names such as Time (s),Force (N). Where "
        f"{n} lines in turn{each} are one reading{of_names}, a terminal does it: grep -v '^ *$' \"{name}\" | paste -d ';' "
        f'{" ".join("-" * n)} > "new_{name}". Where one column stands below the other, write them side by side',
    )


# A number with the unit behind it, a blank between them or not, or another word.
_WITH_UNIT_APART = re.compile(r"[-+]?[\d.][\d.,]*(?:[eE][-+]?\d+)?\s?[^\W\d_][^\s\d]*(?=\s|$)|\S+")


def _numbers_with_units(text: LabText) -> tuple[int, str, dict[str, int]] | None:
    """The first line of numbers with their units, what parts them, and quantity -> column from 1; None if there is none.

    Each quantity is the one of a single column.
    """
    for line, written in enumerate(text.lines[:HEADER_WITHIN]):
        if not re.search(r"[^\W\d_]", written):
            continue
        for delimiter in DELIMITERS:
            cells = split_line(written, delimiter) if delimiter != " " else _WITH_UNIT_APART.findall(written)
            own = {k: re.sub(r"^[^a-zµμÅ%]*", "", c, flags=re.I) for k, c in enumerate(cells, 1) if with_its_unit(c)}
            if len(own) < 2 or not all(with_its_unit(c) or is_reading(c) or is_missing(c) for c in cells if c):
                continue
            found = {q: [k for k, unit in own.items() if is_unit_of(unit, q)] for q in RECORDED}
            of = {q: k for q, (k, *others) in ((q, ks) for q, ks in found.items() if ks) if not others}
            return (line, delimiter, of) if "capacitance" in of or {"force", "displacement"} <= of.keys() else None
    return None


def _quantities_in_lines(text: LabText) -> list[tuple[int, str]]:
    """The 1-based lines that begin with the name of a quantity and go on with its readings, and those names; [] of one only."""
    for delimiter in DELIMITERS[:-1]:
        found: list[tuple[int, str]] = []
        for number, line in enumerate(text.lines[:_LINES_OF_QUANTITIES], 1):
            name, *readings = split_line(line, delimiter)
            heading = understand(name) if name and len(readings) >= _READINGS_IN_A_LINE else None
            if heading is not None and sum(map(is_reading, readings)) >= _MOSTLY * len(readings):
                found.append((number, name))
        if len(found) > 1:
            return found
    return []


def _beside_a_clock(line: str) -> tuple[str, str] | None:
    """What stands in a line of numbers behind a time of day, with its date before it or not, and the options that read these.

    >>> _beside_a_clock("2026-03-01 10:00:00 97.12")[0], _beside_a_clock("touch at 10:00:00")
    ('column 2 holds times of day, column 1 their dates, column 3 numbers', None)
    """
    for delimiter in DELIMITERS:
        cells = [cell for cell in split_line(line, delimiter) if cell]
        clocks = [k for k, cell in enumerate(cells, 1) if is_clock(cell)]
        dates = [k for k, cell in enumerate(cells, 1) if is_date(cell)]
        others = [k for k in range(1, len(cells) + 1) if k not in (*clocks, *dates)]
        if len(clocks) != 1 or len(dates) > 1 or not others or not all(is_reading(cells[k - 1]) for k in others):
            continue
        parts = ("capacitance",) if len(others) == 1 else ("displacement", "force", "capacitance")[: len(others)]
        said = [f"--columns time={clocks[0]}", *(f"--columns {of}={k}" for of, k in zip(parts, others, strict=False))]
        units = " ".join(f"--units {of}=..." for of in parts)
        held = [f"column {clocks[0]} holds times of day", *(f"column {k} their dates" for k in dates)]
        numbers = f"column{'s' if len(others) > 1 else ''} {', '.join(map(str, others))} numbers"
        what = f"if it is a {parts[0]}" if len(parts) == 1 else f"if they are a {', a '.join(parts)}, or by their own numbers"
        return ", ".join(
            [*held, numbers]
        ), f"Say what the numbers are, {what}: {' '.join(said)} {units}; or write names above them"
    return None


def _by_number(text: LabText, width: int, unknown: tuple[str, int, list[str]] | None) -> str:
    """Options that say of columns what they are: those whose names have a unit of a press, else the first ones."""
    mark, header, names = unknown if unknown is not None else ("", 0, [])
    inside = [re.findall(r"[(\[]([^()\[\]]+)[)\]]", name) for name in names]
    if names and _are_units(below := split_line(text.lines[header + 1], mark)):
        inside = [[unit.strip("[]() ")] for unit in below]
    of = {q: next((k for k, units in enumerate(inside, 1) if any(is_unit_of(u, q) for u in units)), 0) for q in RECORDED}
    if (of["displacement"] and of["force"]) or (of["time"] and of["capacitance"]):
        return " ".join(f"--columns {quantity}={k}" for quantity, k in of.items() if k)
    shown = ("time", "capacitance") if width == 2 else ("time", "displacement", "force")
    said = " ".join(f"--columns {quantity}={k}" for k, quantity in enumerate(shown, 1))
    begin = re.split(r"[\t;,|]", text.lines[_first_row(text)[0]].strip())[0]
    timed = is_clock(begin) or is_clock(begin.split()[0] if begin.split() else "")
    units = " ".join(f"--units {quantity}=..." for quantity in shown[timed:])  # a time of day has none
    return f"{said} {units}, each in the unit of the file"


def unknown_header(text: LabText) -> tuple[str, int, list[str]] | None:
    """Delimiter, index and cells of the names right above the first rows of numbers, one for each, be they understood or not.

    Names that stand there more than once are the numbers of their columns.

    Parameters
    ----------
    text : of a file in which no header is understood.
    """
    first, width = _first_row(text)
    above = list(islice((i for i in range(first - 1, -1, -1) if text.lines[i].strip()), 2))
    for delimiter in DELIMITERS if width else ():
        row = split_line(text.lines[first], delimiter)
        if sum(map(bool, row)) != width:
            continue
        found = [(i, split_line(without_comment_mark(text.lines[i], delimiter), delimiter)) for i in above]
        apart = next((k for k, (_, cells) in enumerate(found) if not _are_above(cells, row)), len(found))
        names = found[:apart]
        if len(names) > 1 and _are_units(names[0][1]):
            names = names[1:]
        if names and not _are_units(names[0][1]):
            line, cells = names[0]
            return delimiter, line, [name if cells.count(name) == 1 else str(k) for k, name in enumerate(cells, 1)]
    return None


def _are_units(cells: Sequence[str]) -> bool:
    return all(looks_like_unit(cell.strip("[]() ")) for cell in cells if cell)


def _are_above(names: Sequence[str], row: Sequence[str]) -> bool:
    """Whether cells are words, one above each number of a row."""
    there = [name for name, cell in zip(names, row, strict=False) if cell]
    return len(names) == len(row) and all(any(map(str.isalpha, name)) and not is_reading(name) for name in there)


_BUS_REPLY = re.compile(
    r"^\s*[+-]?\d\.\d+E[+-]\d+\s*,\s*[+-]?\d\.\d+E[+-]\d+\s*,\s*[+-]?\d+\s*(?:,\s*[+-]?\d+)?\s*$", re.IGNORECASE
)


def _reply_lines(text: LabText) -> str:
    lines = [line for line in text.lines[:20] if line.strip()]
    if lines and all(_BUS_REPLY.match(line) for line in lines):
        return "a Keysight E4980A (value, value, status)"
    return ""


def _likely_header(text: LabText) -> tuple[int, list[str]] | None:
    # The last line of words above the first line of numbers: what the user would call the header.
    above: tuple[int, list[str]] | None = None
    for index, line in enumerate(text.lines[:HEADER_WITHIN]):
        for delimiter in DELIMITERS[:-1]:
            cells = [c for c in split_line(line, delimiter) if c]
            if len(cells) < 2:
                continue
            if sum(map(is_reading, cells)) >= 2:
                return above
            above = (index + 1, [f'"{c[:40]}"' for c in cells[:12]])
            break
    return None  # no rows below


# --- what stands above it -----------------------------------------------------------------------------------------------

#: What a unit is called, for patterns.
UNIT_NAMES = (
    r"units?|einheit(?:en)?|unités?|unidad(?:es)?|unità|eenhe(?:id|den)|enhet(?:er)?|enhed(?:er)?|jednostk[ai]|yksik(?:kö|öt)"
)
_UNIT_WORD = re.compile(rf"\b(?:{UNIT_NAMES})\b|单位|単位|단위", re.I)


# Between the names and units that a line above the header declares, and words between one and its unit.
_APART = re.compile(r"[\t;,|:=]|\s{2,}")
_FILLERS = frozenset(["in", "is", "are", "as", "of", "en"])
# The mark of a comment at the beginning of a line, and how many units between blanks are a list: "N m" is one of a torque.
_MARK, _LISTED = re.compile(r"^\s*(?:#|//|%|!)+"), 3
# What the unit of a displacement may be declared as, beside those of force or time.
_LENGTH = re.compile(r"lengths?|länge|longueur|longitud|lunghezza|comprimento|lengte|długość|长度|長さ|길이", re.IGNORECASE)


def declared_units(lines: Sequence[str]) -> Mapping[str, tuple[str, int]]:
    """Units declared above: `Units : Force,kN`, `Units Time s Load kN`, `Load;kN`, `Force in kN`, `Units: s, mm, kN`.

    Of lines that contradict each other all units are given, as "kN or N", which is none. A unit of length is that of the
    displacement where units of force or time are declared, too.

    >>> dict(declared_units(["Units : Time ms", "Load|kN"]))
    {'time': ('ms', 1), 'force': ('kN', 2)}
    >>> dict(declared_units(["# units: s mm N"])), dict(declared_units(["Units: N m"]))
    ({'time': ('s', 1), 'displacement': ('mm', 1), 'force': ('N', 1)}, {})
    >>> dict(declared_units(["Units: time in s, displacement in um"]))
    {'time': ('s', 1), 'displacement': ('um', 1)}
    """
    declared: dict[str, tuple[str, int]] = {}
    lengths: dict[str, tuple[str, int]] = {}
    for number, line in enumerate(lines[-200:], max(len(lines) - 200, 0) + 1):
        parts = [p for part in _APART.split(_MARK.sub("", line)) if (p := part.strip(' \t"{}'))]
        if not _UNIT_WORD.search(line) or len(line) > 200:
            own = (
                list(stated_units(line))
                or _stated_each(line)
                or (list(_named_units(parts)) if len(parts) == 2 and _is_plain(parts[0]) else [])
                or list(explained_units(line))
            )
            _declare(declared, own, number)
            continue
        sentence = _UNIT_WORD.sub("", line).strip(" \t:=")
        if own := (_stated_each(sentence) or list(stated_units(sentence))):
            _declare(declared, own, number)
            continue
        parts = [p for part in parts if (p := _UNIT_WORD.sub("", part).strip())]
        if parts and all(map(looks_like_unit, parts)):
            _declare(declared, _listed_units(parts), number)
            continue
        apart = " ".join(parts).split()
        strokes = apart[0].split("/") if len(apart) == 1 else []
        if len(strokes) >= _LISTED and all(map(looks_like_unit, strokes)):
            _declare(declared, _listed_units(strokes), number)
            continue
        if _is_list_of_units(apart):
            _declare(declared, _listed_units([unit.strip("()[]") for unit in apart]), number)
            continue
        found = [*_named_units(parts), *_named_units(apart)]
        _declare(declared, found, number)
        _declare(lengths, _named_lengths(parts), number)
    beside = "displacement" not in declared and ("force" in declared or "time" in declared)
    return MappingProxyType(declared | lengths if beside else declared)


def _is_list_of_units(words: Sequence[str]) -> bool:
    """Whether words are units alone, and not each second one that of the letter before it, as in "s mm F N"."""
    bare = [word.strip("()[]") for word in words]
    if len(bare) < _LISTED or not all(map(looks_like_unit, bare)):
        return False
    pairs = list(zip(bare[::2], bare[1::2], strict=False))
    named = [(h := _named(name, unit)) is not None and is_unit_of(unit, h.quantity) for name, unit in pairs]
    return len(bare) % 2 == 1 or not all(named)


def _stated_each(line: str) -> list[tuple[str, str]]:
    """Quantity and unit of each part of a sentence that states one in every part: "Load in mN, travel in um, time in s"."""
    stated = [list(stated_units(part)) for part in re.split(r"[,;]\s+|\s(?:and|und|et|y|e|en|i)\s", line) if part.strip()]
    return [own for part in stated for own in part] if len(stated) > 1 and all(stated) else []


def _declare(declared: dict[str, tuple[str, int]], found: Iterable[tuple[str, str]], line: int) -> None:
    """Add what a line declares; another unit of the same quantity than before leaves both."""
    for named, unit in found:
        quantity = stands_for(named)
        before = declared[quantity][0].split(" or ") if quantity in declared else []
        others = [u for u in before if lab_factor(u, quantity) != lab_factor(unit, quantity)]
        declared[quantity] = " or ".join([*others, unit]), line


def _named_units(parts: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Quantity and unit of names with a unit of theirs behind each; a name may be several parts long."""
    name: list[str] = []
    for part in parts:
        unit = part[1:-1] if part[:1] + part[-1:] in ("()", "[]") else part
        heading = next((h for n in range(len(name)) if (h := _named(" ".join(name[n:]), unit)) is not None), None)
        if heading is not None and is_unit_of(unit, heading.quantity):
            yield heading.quantity, unit
            name = []
        elif part.lower() not in _FILLERS:
            name.append(part)


def _named_lengths(parts: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The units that stand behind nothing but a word for length: "Length mm", not "Gauge length mm"."""
    pairs = [*pairwise(parts), *(tuple(part.split()) for part in parts if len(part.split()) == 2)]
    for name, unit in pairs:
        if _LENGTH.fullmatch(name) and is_unit_of(unit.strip("()[]"), "displacement"):
            yield "displacement", unit.strip("()[]")


def _is_plain(name: str) -> bool:
    heading = understand(name)
    return heading is not None and not heading.index and heading.unit is None


def _named(name: str, unit: str) -> Heading | None:
    return understand(name) or understand(name, unit)


def _listed_units(units: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Quantity and unit of units that stand without names, of those that are of one quantity each."""
    for quantity in RECORDED:
        own = {unit for unit in units if is_unit_of(unit, quantity)}
        if len(own) == 1:
            yield quantity, own.pop()


# `MTS793|MPT|DEU|1|0|,|.|:|...`: the sixth field is the decimal mark.
_MTS = re.compile(r"^\ufeff?MTS793\|[^|]*\|[^|]*\|[^|]*\|[^|]*\|(?P<mark>[.,])\|")
_DECIMAL_WORDS = re.compile(
    r"^\W*(?:decimal (?:mark|separator|sign|symbol)|dezimal(?:trennzeichen|zeichen)|séparateur décimal|separador decimal)\W*"
    r"[\s:;,=\t\"]\W*?(?P<mark>[.,]|comma|komma|point|punkt|dot)\"?\s*$",
    re.IGNORECASE,
)


def declared_decimal(lines: Sequence[str]) -> str:
    """The decimal mark declared above the header: by MTS's first line, or in words; "" if it is not."""
    for line in lines[-200:]:
        match = _MTS.match(line) or _DECIMAL_WORDS.match(line)
        if match:
            mark = match["mark"].lower()
            return mark if mark in ".," else "," if mark in ("comma", "komma") else "."
    return ""
