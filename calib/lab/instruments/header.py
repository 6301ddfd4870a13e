"""From the lines of a lab file to its header: delimiter, line and names."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

from calib.lab.instruments.alone_in_unit import alone_in_unit
from calib.lab.instruments.brackets import LONGEST, goes_on_with_conditions
from calib.lab.instruments.by_function import by_function
from calib.lab.instruments.clock_cells import is_clock, is_reading
from calib.lab.instruments.common_words import common_words
from calib.lab.instruments.declared import stated_each
from calib.lab.instruments.designated import designated
from calib.lab.instruments.dressed import plain_names
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.text import LabText
from calib.lab.instruments.unit_cells import with_its_unit
from calib.lab.instruments.units import is_unit_of_a_record, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import as_a_mean, spelled_unit, understand

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


def are_units(cells: Sequence[str]) -> bool:
    """Whether all cells that are not empty are units, in brackets or not."""
    return all(looks_like_unit(cell.strip("[]() ")) for cell in cells if cell)


def _says_units_of_names_below(line: str, below: Sequence[str]) -> bool:
    """Whether a line is one of quantities and units, "force in mN, time in ms", of which two at least are named below."""
    said = {quantity for quantity, _ in stated_each(line)} if "," in line or ";" in line else set()
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
        above = row if all(row) and any(map(str.isalpha, "".join(row))) and not are_units(row) else []
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
